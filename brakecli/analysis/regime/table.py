"""The table: what is said of a motion, by one record of answers. Nothing here looks at a history.

Rows are tried from the top, and the first whose condition holds decides; the last one always does. A row that
says that the motion lasts by itself leaves it to the rows of `LOOKS` how it looks.
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
from brakecli.analysis.regime.looks import LOOKS

_DAMPED = Regime.DAMPED
_DASHPOT = "a dashpot would decide"
_CHECK = "check load.force, and the angles of the links"
_LINEAR = "full contact and slip to one side make the motion linear"
_SOURCES = (
    "[of its power friction gives {a.power_of_friction:.2g} W and the roughness {a.power_of_roughness:.2g} W; ]"
    "[neighbours change at {a.exponent:.2g} 1/s; ]without the roughness {a.becomes}"
)
_DECAYS = _LINEAR + ": the shoe's own vibration decays at {a.decay:.3g} 1/s ({a.ringing:.4g} Hz)"

CONTACT: tuple[Row[Answers, Thresholds], ...] = (
    Row("failed", lambda a, t: a.failure, "the run failed: {a.failure}"),
    Row("older file", lambda a, t: a.unasked, "the file is older than the questions that decide", "{a.unasked}"),
    Row("never touched", lambda a, t: a.never, "the shoe has never touched the wheel", _CHECK),
    Row("lost", lambda a, t: a.lost, "the shoe has lost contact for good", _CHECK),
    Row(
        "left",
        lambda a, t: a.left,
        "the shoe has left the wheel",
        "run longer, to see whether it comes back",
        longer=True,
    ),
    Row(
        "at rest",
        lambda a, t: a.carried and a.stands,
        "the shoe has come to rest, sticking to the standing wheel",
        "",
        _DAMPED,
    ),
    Row(
        "not held",
        lambda a, t: a.carried and not a.held,
        "the shoe sticks throughout and is carried along by the wheel: no link holds it along the wheel",
        "incline a link, by its angle_deg",
    ),
    Row(
        "locks itself",
        lambda a, t: a.carried and a.steady and math.isfinite(a.locks),
        "the shoe sticks throughout and is carried along by the wheel: it locks itself, as friction grows faster "
        "with x than the force that it needs, so that no longer run will see it slip",
        "it slips below a friction coefficient of {a.locks:.4g}",
    ),
    Row(
        "carried",
        lambda a, t: a.carried,
        "the shoe sticks throughout and is carried along by the wheel",
        "run longer",
        longer=True,
    ),
    Row(
        "few samples",
        lambda a, t: a.few_samples,
        "only {a.samples} samples, too few",
        "run longer, or sample more often",
        longer=True,
    ),
    Row(
        "changes",
        lambda a, t: not a.steady,
        "the wheel's speed or the load changes with time, so the motion cannot settle",
    ),
    Row(
        "nothing moves yet",
        lambda a, t: not a.moves and a.growth > 0.0,
        "nothing moves yet, but sliding is unstable: a disturbance grows at {a.growth:.3g} 1/s",
        "start beside steady sliding{a.or_longer}",
        longer=lambda a: a.or_longer,
    ),
    Row(
        "nothing moves",
        lambda a, t: not a.moves,
        "nothing moves beyond rounding: the shoe slides steadily or rests",
        "",
        _DAMPED,
    ),
    Row(
        "standing wheel",
        lambda a, t: a.stands and not a.undamped,
        "the wheel stands: friction and dashpots take the energy",
        "",
        _DAMPED,
    ),
    Row("standing wheel, no dashpots", lambda a, t: a.stands, "the wheel stands, but no dashpot damps", _DASHPOT),
)
COMES_AND_GOES: Row[Answers, Thresholds] = Row(
    "comes and goes",
    lambda a, t: not math.isfinite(a.change),
    "the motion comes and goes: in a part of the second half nothing moves",
    "run longer",
    longer=True,
)
_HELD: Row[Answers, Thresholds] = Row(
    "linear, held by the steps",
    lambda a, t: a.linear and grows(a, t) and a.steadier,
    _LINEAR + ": it grows at {a.own:.3g} 1/s, but the scheme's steps damp it",
    "{a.steadier}",
)
_GROWS: Row[Answers, Thresholds] = Row(
    "linear, grows",
    lambda a, t: a.linear and grows(a, t),
    _LINEAR + ": still growing at {a.own:.3g} 1/s ({a.ringing:.4g} Hz)",
    "run at least {a.grown:.3g} s",
    longer=True,
)
_NO_DASHPOTS: Row[Answers, Thresholds] = Row(
    "no friction, no dashpots",
    lambda a, t: a.frictionless,
    "without friction nothing excites the shoe, but no dashpot damps it",
    _DASHPOT,
)
SMOOTH: tuple[Row[Answers, Thresholds], ...] = (
    _HELD,
    _GROWS,
    Row(
        "linear, decays",
        lambda a, t: a.linear and decays(a, t),
        _DECAYS,
        "",
        _DAMPED,
    ),
    Row("linear, neutral", lambda a, t: a.linear, _LINEAR + ": it neither grows nor decays", _DASHPOT),
    Row(
        "no friction",
        lambda a, t: a.frictionless and not a.undamped,
        "without friction nothing excites the shoe, and the dashpots damp it",
        "",
        _DAMPED,
    ),
    _NO_DASHPOTS,
    Row(
        "no dashpots",
        lambda a, t: a.undamped and not a.growth > 0.0,
        "sliding is stable, and no dashpot makes a large vibration settle",
        _DASHPOT,
    ),
    Row(
        "fades",
        lambda a, t: a.without_waves == Continuation.DIES,
        "the vibration dies out: continued, it comes to steady sliding",
        "",
        _DAMPED,
    ),
    Row(
        "lasts",
        lambda a, t: a.without_waves == Continuation.LASTS and same(a, t),
        "the vibration lasts[: continued, it comes to an amplitude of {a.amplitude_without_waves:.3g} m]",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "on its way",
        lambda a, t: a.without_waves == Continuation.LASTS and math.isfinite(a.amplitude_without_waves),
        "the vibration lasts, and is still on its way to an amplitude of {a.amplitude_without_waves:.3g} m",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "lasts, irregular",
        lambda a, t: a.without_waves == Continuation.LASTS and steady(a, t),
        "the vibration lasts, as sliding is unstable, and its level does not change",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    COMES_AND_GOES,
    Row(
        "undecided",
        lambda a, t: True,
        "[the level {a.word} by e^{a.change:.2g} in the second half, and ]what it comes to is not known",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
)
ROUGH: tuple[Row[Answers, Thresholds], ...] = (
    Row(
        "shorter than a wave",
        lambda a, t: a.duration < a.slowest,
        "the run is shorter than the period of the slowest wave, {a.slowest:.3g} s",
        "run at least {a.two_waves:.3g} s",
        longer=True,
    ),
    _HELD,
    Row(
        "linear, forced",
        lambda a, t: a.linear and decays(a, t) and not a.undamped,
        "only the roughness shakes the shoe: " + _DECAYS,
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    _GROWS,
    Row(
        "linear, open",
        lambda a, t: a.linear,
        _LINEAR + ": neighbours neither come together nor part surely[, at {a.even:.2g} ± {a.even_error:.1g} 1/s]",
        "run longer; without dashpots, " + _DASHPOT,
        longer=True,
    ),
    Row(
        "forced, no friction",
        lambda a, t: a.frictionless and not a.undamped,
        "only the roughness shakes the shoe: without friction nothing else excites it",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    _NO_DASHPOTS,
    Row(
        "bounces",
        lambda a, t: not a.touches,
        "sliding steadily the shoe would not touch the wheel: it bounces, and may leave it for good",
        _CHECK,
    ),
    Row(
        "forced, neighbours",
        lambda a, t: a.without_waves == Continuation.DIES and together(a, t),
        "only the roughness shakes the shoe: without it the vibration dies out, and small disturbances "
        "have a growth rate of {a.exponent:.3g} 1/s",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, level",
        lambda a, t: (
            a.without_waves == Continuation.DIES
            and (steady(a, t) or a.change < 0.0)
            and friction_gives_less(a, t)
            and not a.undamped
        ),
        "only the roughness shakes the shoe: without it the vibration dies out, and its level does not grow",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, friction takes",
        lambda a, t: (
            takes(a, t)
            and roughness_gives_most(a, t)
            and (steady(a, t) or a.without_waves == Continuation.DIES)
            and not a.undamped
        ),
        "only the roughness shakes the shoe: it gives {a.power_of_roughness:.2g} W, and friction takes "
        "{a.taken:.2g} W from the vibration",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, roughness gives",
        lambda a, t: together(a, t) and steady(a, t) and roughness_gives_most(a, t) and not a.undamped,
        "only the roughness shakes the shoe: it gives {a.power_of_roughness:.2g} W, friction "
        "{a.power_of_friction:.2g} W, and small disturbances have a growth rate of {a.exponent:.3g} 1/s",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "forced, another level",
        lambda a, t: together(a, t) and steady(a, t) and another(a, t) and not a.undamped,
        "only the roughness shakes the shoe: small disturbances have a growth rate of {a.exponent:.3g} 1/s, and "
        "vx has {a.level:.3g} m/s, not the {a.level_without_waves:.3g} m/s to which it would come without the "
        "roughness",
        regime=Regime.DAMPED,
        excitation=Excitation.FORCED,
    ),
    Row(
        "dies out, not yet",
        lambda a, t: a.without_waves == Continuation.DIES and not steady(a, t),
        "without the roughness the vibration dies out, but its level still {a.word} by e^{a.change:.2g} in the "
        "second half",
        "run at least {a.waited:.3g} s",
        longer=True,
    ),
    Row(
        "no dashpots, rough",
        lambda a, t: a.undamped and not a.growth > 0.0,
        "no dashpot damps what the shoe adds to what the waves force",
        _DASHPOT,
    ),
    Row(
        "self-excited",
        lambda a, t: (
            a.without_waves == Continuation.LASTS
            and apart(a, t)
            and (a.growth > 0.0 or (steady(a, t) and not another(a, t)))
            and gives(a, t)
        ),
        "the vibration lasts without the roughness, with a phase of its own",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "locked to the waves",
        lambda a, t: (
            a.without_waves == Continuation.LASTS
            and together(a, t)
            and steady(a, t)
            and same(a, t)
            and friction_gives_most(a, t)
        ),
        "the vibration lasts without the roughness at the same level, and is locked to it",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    Row(
        "kept up by friction",
        lambda a, t: (
            a.without_waves == Continuation.LASTS
            and steady(a, t)
            and (same(a, t) or (roughness_is_idle(a, t) and not another(a, t)))
            and friction_gives_most(a, t)
            and not a.undamped
        ),
        "the vibration lasts without the roughness, and of its power friction gives "
        "{a.power_of_friction:.2g} W and the roughness {a.power_of_roughness:.2g} W",
        regime=Regime.UNDECIDED,  # how it looks, `LOOKS` decides
        excitation=Excitation.SELF_EXCITED,
    ),
    COMES_AND_GOES,
    Row(
        "still changes",
        lambda a, t: not steady(a, t),
        "the level {a.word} by e^{a.change:.2g} in the second half",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
    Row(
        "energy still changes",
        lambda a, t: math.isfinite(a.power_left) and not balances(a, t),
        "the level of vx does not change, but the energy does: friction gives {a.power_of_friction:.2g} W and the "
        "roughness {a.power_of_roughness:.2g} W, {a.power_left:.2g} W more than dashpots take",
        "run longer",
        longer=True,
    ),
    Row(
        "phase not known",
        lambda a, t: math.isfinite(a.exponent_error) and not (together(a, t) or apart(a, t)),
        "it is not certain whether neighbours come together: they change at {a.exponent:.2g} ± "
        "{a.exponent_error:.1g} 1/s; " + _SOURCES,
        "run at least {a.told_apart:.3g} s",
        longer=True,
    ),
    Row(
        "either",
        lambda a, t: True,
        "friction and the roughness may both keep the vibration up: " + _SOURCES,
        longer=True,
    ),
)
_WITH_WAVES = (*CONTACT, *ROUGH)
_WITHOUT = (*CONTACT, *SMOOTH)


def decide(answers: Answers, thresholds: Thresholds) -> Decision:
    """What the first row says whose condition holds."""
    found = first(_WITH_WAVES if answers.waves else _WITHOUT, answers, thresholds)
    if found.excitation is not Excitation.SELF_EXCITED:
        return found
    look = first(LOOKS, answers, thresholds)
    return look._replace(reason=f"{found.reason}, {look.reason}", row=f"{found.row}: {look.row}")
