"""The table: what is said of a motion, by one record of answers. Nothing here looks at a history.

Rows are tried from the top, and the first whose condition holds decides; the last one always does. A row that
says that the motion lasts by itself leaves it to the rows of `SHAPES` how it looks.
"""

import math

from brakecli.analysis.regime.answers import Answers, Continuation
from brakecli.analysis.regime.conditions import (
    another,
    apart,
    balances,
    decays,
    friction_gives_less,
    friction_gives_most,
    gives,
    grows,
    roughness_gives_most,
    roughness_is_idle,
    same,
    steady,
    takes,
    together,
)
from brakecli.analysis.regime.decision import Decision, Excitation, Regime, Row, Thresholds, first
from brakecli.analysis.regime.shapes import SHAPES

_DAMPED = Regime.DAMPED
_DASHPOT = "a dashpot would decide"
_CHECK = "check load.force, and the angles of the links"
_LINEAR = "full contact and slip to one side make the motion linear"
_SOURCES = (
    "[of its power friction gives {power_of_friction:.2g} W and the roughness {power_of_roughness:.2g} W; ]"
    "[neighbours change at {lyapunov_exponent:.2g} 1/s; ]without the roughness {becomes}"
)
_DECAYS = _LINEAR + ": the shoe's own vibration decays at {decay:.3g} 1/s ({ringing_frequency:.4g} Hz)"

CONTACT: tuple[Row[Answers, Thresholds], ...] = (
    Row("failed", lambda motion, limits: motion.failure, "the run failed: {failure}"),
    Row(
        "older file",
        lambda motion, limits: motion.unasked,
        "the file is older than the questions that decide",
        "{unasked}",
    ),
    Row(
        "never touched",
        lambda motion, limits: motion.never_touched,
        "the shoe has never touched the wheel",
        _CHECK,
    ),
    Row("lost", lambda motion, limits: motion.contact_lost, "the shoe has lost contact for good", _CHECK),
    Row(
        "left",
        lambda motion, limits: motion.contact_left,
        "the shoe has left the wheel",
        "run longer, to see whether it comes back",
        longer=True,
    ),
    Row(
        "at rest",
        lambda motion, limits: motion.carried_along and motion.wheel_stands,
        "the shoe has come to rest, sticking to the standing wheel",
        "",
        _DAMPED,
    ),
    Row(
        "not held",
        lambda motion, limits: motion.carried_along and not motion.held_by_link,
        "the shoe sticks throughout and is carried along by the wheel: no link holds it along the wheel",
        "incline a link, by its angle_deg",
    ),
    Row(
        "locks itself",
        lambda motion, limits: (
            motion.carried_along and motion.constant_speed_and_load and math.isfinite(motion.locking_friction)
        ),
        "the shoe sticks throughout and is carried along by the wheel: it locks itself, as friction grows faster "
        "with x than the force that it needs, so that no longer run will see it slip",
        "it slips below a friction coefficient of {locking_friction:.4g}",
    ),
    Row(
        "carried",
        lambda motion, limits: motion.carried_along,
        "the shoe sticks throughout and is carried along by the wheel",
        "run longer",
        longer=True,
    ),
    Row(
        "few samples",
        lambda motion, limits: motion.few_samples,
        "only {samples} samples, too few",
        "run longer, or sample more often",
        longer=True,
    ),
    Row(
        "changes",
        lambda motion, limits: not motion.constant_speed_and_load,
        "the wheel's speed or the load changes with time, so the motion cannot settle",
    ),
    Row(
        "nothing moves yet",
        lambda motion, limits: not motion.moves and motion.growth_rate > 0.0,
        "nothing moves yet, but sliding is unstable: a disturbance grows at {growth_rate:.3g} 1/s",
        "start beside steady sliding{or_longer}",
        longer=lambda motion: motion.or_longer,
    ),
    Row(
        "nothing moves",
        lambda motion, limits: not motion.moves,
        "nothing moves beyond rounding: the shoe slides steadily or rests",
        "",
        _DAMPED,
    ),
    Row(
        "standing wheel",
        lambda motion, limits: motion.wheel_stands and not motion.undamped,
        "the wheel stands: friction and dashpots take the energy",
        "",
        _DAMPED,
    ),
    Row(
        "standing wheel, no dashpots",
        lambda motion, limits: motion.wheel_stands,
        "the wheel stands, but no dashpot damps",
        _DASHPOT,
    ),
)
COMES_AND_GOES: Row[Answers, Thresholds] = Row(
    "comes and goes",
    lambda motion, limits: not math.isfinite(motion.level_change),
    "the motion comes and goes: in a part of the second half nothing moves",
    "run longer",
    longer=True,
)
_HELD: Row[Answers, Thresholds] = Row(
    "linear, held by the steps",
    lambda motion, limits: motion.linear and grows(motion, limits) and motion.steadier,
    _LINEAR + ": it grows at {own:.3g} 1/s, but the scheme's steps damp it",
    "{steadier}",
)
_GROWS: Row[Answers, Thresholds] = Row(
    "linear, grows",
    lambda motion, limits: motion.linear and grows(motion, limits),
    _LINEAR + ": still growing at {own:.3g} 1/s ({ringing_frequency:.4g} Hz)",
    "run at least {grown:.3g} s",
    longer=True,
)
_NO_DASHPOTS: Row[Answers, Thresholds] = Row(
    "no friction, no dashpots",
    lambda motion, limits: motion.frictionless,
    "without friction nothing excites the shoe, but no dashpot damps it",
    _DASHPOT,
)
SMOOTH: tuple[Row[Answers, Thresholds], ...] = (
    _HELD,
    _GROWS,
    Row(
        "linear, decays",
        lambda motion, limits: motion.linear and decays(motion, limits),
        _DECAYS,
        "",
        _DAMPED,
    ),
    Row(
        "linear, neutral",
        lambda motion, limits: motion.linear,
        _LINEAR + ": it neither grows nor decays",
        _DASHPOT,
    ),
    Row(
        "no friction",
        lambda motion, limits: motion.frictionless and not motion.undamped,
        "without friction nothing excites the shoe, and the dashpots damp it",
        "",
        _DAMPED,
    ),
    _NO_DASHPOTS,
    Row(
        "no dashpots",
        lambda motion, limits: motion.undamped and not motion.growth_rate > 0.0,
        "sliding is stable, and no dashpot makes a large vibration settle",
        _DASHPOT,
    ),
    Row(
        "fades",
        lambda motion, limits: motion.without_waves == Continuation.DIES,
        "the vibration dies out: continued, it comes to steady sliding",
        "",
        _DAMPED,
    ),
    Row(
        "lasts",
        lambda motion, limits: motion.without_waves == Continuation.LASTS and same(motion, limits),
        "the vibration lasts[: continued, it comes to an amplitude of {amplitude_without_waves:.3g} m]",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "on its way",
        lambda motion, limits: (
            motion.without_waves == Continuation.LASTS and math.isfinite(motion.amplitude_without_waves)
        ),
        "the vibration lasts, and is still on its way to an amplitude of {amplitude_without_waves:.3g} m",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "lasts, irregular",
        lambda motion, limits: motion.without_waves == Continuation.LASTS and steady(motion, limits),
        "the vibration lasts, as sliding is unstable, and its level does not change",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    COMES_AND_GOES,
    Row(
        "undecided",
        lambda motion, limits: True,
        "[the level {word} by e^{level_change:.2g} in the second half, and ]what it comes to is not known",
        "run at least {longer:.3g} s",
        longer=True,
    ),
)
ROUGH: tuple[Row[Answers, Thresholds], ...] = (
    Row(
        "shorter than a wave",
        lambda motion, limits: motion.duration < motion.slowest_wave_period,
        "the run is shorter than the period of the slowest wave, {slowest_wave_period:.3g} s",
        "run at least {two_waves:.3g} s",
        longer=True,
    ),
    _HELD,
    Row(
        "linear, forced",
        lambda motion, limits: motion.linear and decays(motion, limits) and not motion.undamped,
        "only the roughness shakes the shoe: " + _DECAYS,
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    _GROWS,
    Row(
        "linear, open",
        lambda motion, limits: motion.linear,
        _LINEAR + ": neighbours neither come together nor part surely"
        "[, at {lyapunov_by_line:.2g} ± {lyapunov_by_line_error:.1g} 1/s]",
        "run longer; without dashpots, " + _DASHPOT,
        longer=True,
    ),
    Row(
        "forced, no friction",
        lambda motion, limits: motion.frictionless and not motion.undamped,
        "only the roughness shakes the shoe: without friction nothing else excites it",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    _NO_DASHPOTS,
    Row(
        "bounces",
        lambda motion, limits: not motion.touches_in_sliding,
        "sliding steadily the shoe would not touch the wheel: it bounces, and may leave it for good",
        _CHECK,
    ),
    Row(
        "forced, neighbours",
        lambda motion, limits: motion.without_waves == Continuation.DIES and together(motion, limits),
        "only the roughness shakes the shoe: without it the vibration dies out, and small disturbances "
        "have a growth rate of {lyapunov_exponent:.3g} 1/s",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, level",
        lambda motion, limits: (
            motion.without_waves == Continuation.DIES
            and (steady(motion, limits) or motion.level_change < 0.0)
            and friction_gives_less(motion, limits)
            and not motion.undamped
        ),
        "only the roughness shakes the shoe: without it the vibration dies out, and its level does not grow",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, friction takes",
        lambda motion, limits: (
            takes(motion, limits)
            and roughness_gives_most(motion, limits)
            and (steady(motion, limits) or motion.without_waves == Continuation.DIES)
            and not (motion.without_waves == Continuation.LASTS and apart(motion, limits))
            and not motion.undamped
        ),
        "only the roughness shakes the shoe: it gives {power_of_roughness:.2g} W, and friction takes "
        "{taken:.2g} W from the vibration",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, roughness gives",
        lambda motion, limits: (
            together(motion, limits)
            and steady(motion, limits)
            and roughness_gives_most(motion, limits)
            and not motion.undamped
        ),
        "only the roughness shakes the shoe: it gives {power_of_roughness:.2g} W, friction "
        "{power_of_friction:.2g} W, and small disturbances have a growth rate of {lyapunov_exponent:.3g} 1/s",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, another level",
        lambda motion, limits: (
            together(motion, limits) and steady(motion, limits) and another(motion, limits) and not motion.undamped
        ),
        "only the roughness shakes the shoe: small disturbances have a growth rate of {lyapunov_exponent:.3g} "
        "1/s, and vx has {level:.3g} m/s, not the {level_without_waves:.3g} m/s to which it would come without "
        "the roughness",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "dies out, not yet",
        lambda motion, limits: motion.without_waves == Continuation.DIES and not steady(motion, limits),
        "without the roughness the vibration dies out, but its level still {word} by e^{level_change:.2g} in the "
        "second half",
        "run at least {waited:.3g} s",
        longer=True,
    ),
    Row(
        "no dashpots, rough",
        lambda motion, limits: motion.undamped and not motion.growth_rate > 0.0,
        "no dashpot damps what the shoe adds to what the waves force",
        _DASHPOT,
    ),
    Row(
        "self-excited",
        lambda motion, limits: (
            motion.without_waves == Continuation.LASTS
            and apart(motion, limits)
            and (motion.growth_rate > 0.0 or (steady(motion, limits) and not another(motion, limits)))
            and gives(motion, limits)
        ),
        "the vibration lasts without the roughness, with a phase of its own"
        "[ (a torus: {torus:.4g} Hz and the frequencies of the waves are incommensurate)]",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "locked to the waves",
        lambda motion, limits: (
            motion.without_waves == Continuation.LASTS
            and together(motion, limits)
            and steady(motion, limits)
            and same(motion, limits)
            and friction_gives_most(motion, limits)
        ),
        "the vibration lasts without the roughness at the same level, and is locked to it",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "kept up by friction",
        lambda motion, limits: (
            motion.without_waves == Continuation.LASTS
            and steady(motion, limits)
            and (same(motion, limits) or (roughness_is_idle(motion, limits) and not another(motion, limits)))
            and friction_gives_most(motion, limits)
            and not motion.undamped
        ),
        "the vibration lasts without the roughness, and of its power friction gives "
        "{power_of_friction:.2g} W and the roughness {power_of_roughness:.2g} W",
        regime=Regime.UNDECIDED,  # how it looks, `SHAPES` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    COMES_AND_GOES,
    Row(
        "still changes",
        lambda motion, limits: not steady(motion, limits),
        "the level {word} by e^{level_change:.2g} in the second half",
        "run at least {longer:.3g} s",
        longer=True,
    ),
    Row(
        "energy still changes",
        lambda motion, limits: math.isfinite(motion.power_stored) and not balances(motion, limits),
        "the level of vx does not change, but the energy does: friction gives {power_of_friction:.2g} W and the "
        "roughness {power_of_roughness:.2g} W, {power_stored:.2g} W more than dashpots take",
        "run longer",
        longer=True,
    ),
    Row(
        "phase not known",
        lambda motion, limits: (
            math.isfinite(motion.lyapunov_error) and not (together(motion, limits) or apart(motion, limits))
        ),
        "it is not certain whether neighbours come together: they change at {lyapunov_exponent:.2g} ± "
        "{lyapunov_error:.1g} 1/s; " + _SOURCES,
        "run at least {told_apart:.3g} s",
        longer=True,
    ),
    Row(
        "either",
        lambda motion, limits: True,
        "friction and the roughness may both keep the vibration up: " + _SOURCES,
        longer=True,
    ),
)
_WITH_WAVES = (*CONTACT, *ROUGH)
_WITHOUT = (*CONTACT, *SMOOTH)


def decide(answers: Answers, thresholds: Thresholds) -> Decision:
    """What the first row says whose condition holds."""
    decision = first(_WITH_WAVES if answers.waves else _WITHOUT, answers, thresholds)
    if decision.excitation is not Excitation.SELF_EXCITED:
        return decision
    look = first(SHAPES, answers, thresholds)
    return look._replace(reason=f"{decision.reason}, {look.reason}", row=f"{decision.row}: {look.row}")
