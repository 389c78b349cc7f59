"""The table: what is said of a motion, by one record of answers. Nothing here looks at a history.

Rows are tried from the top, and the first whose condition holds decides; the last one always does. A row that
says that the motion lasts by itself leaves it to the rows of `LOOKS` how it looks.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Generic, NamedTuple, TypeVar

from brakecli.analysis.regime.answers import Answers, Fate


class Regime(StrEnum):
    """The paper's three regimes, and `undecided`."""

    DAMPED = "damped"
    RELAXATION = "relaxation"
    QUASI_HARMONIC = "quasi-harmonic"
    UNDECIDED = "undecided"


class Excitation(StrEnum):
    """Where the energy of a sustained motion comes from."""

    SELF_EXCITED = "self-excited"
    FORCED = "forced"
    NONE = "none"


@dataclass(frozen=True)
class Thresholds:
    """The only numbers that decide a verdict: see docs/regimes.md, and `make statistics` for what each moves."""

    settled_within: float = 0.05  # part of its level by which a settled motion may change
    sure_errors: float = 3.0  # standard errors beyond which a change is no chance
    comes_together: float = 1.0  # powers of e by which neighbours that come together do so in half of the run
    same_level: float = 0.3  # part by which two motions of the same level may differ
    most: float = 2.0  # times the power of the other, of what gives most of the energy
    fewest_cycles: float = 10.0  # in the settled part
    samples_per_cycle: float = 8.0
    stick_cycles: float = 0.8  # part of the cycles that stick in relaxation; in 1 less it, others may
    harmonic_share: float = 0.8  # part of the energy on one line and its multiples
    band_share: float = 0.9  # part of it in three narrow bands, which chaos may have, too


class Decision(NamedTuple):
    """What a row decides, and why."""

    reason: str
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    frequency: float | None = None  # Hz
    stick_fraction: float | None = None
    advice: str = ""  # what to do
    row: str = ""  # its name
    longer: bool = False  # whether a longer run may decide

    @property
    def sentence(self) -> str:
        """The reason, and what to do."""
        return f"{self.reason}; {self.advice}" if self.advice else self.reason


A = TypeVar("A")  # the answers
T = TypeVar("T")  # and the thresholds of a table


class Row(NamedTuple, Generic[A, T]):
    """A row: its name, its condition, what it says, and what to do. `{…}` are attributes of the answers.

    `longer` says whether a longer run may decide where the row does not.
    """

    name: str
    holds: Callable[[A, T], Any]
    sentence: str
    remedy: str = ""
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    longer: bool | Callable[[A], Any] = False

    def decision(self, answers: A) -> Decision:
        """What it says of these answers."""
        reason, advice = (text.format(a=answers) for text in (self.sentence, self.remedy))
        longer = bool(self.longer(answers) if callable(self.longer) else self.longer)
        return Decision(reason, self.regime, self.excitation, advice=advice, row=self.name, longer=longer)


def _steady(a: Answers, t: Thresholds) -> bool:
    """The level does not change, but for chance."""
    return abs(a.change) <= max(t.sure_errors * a.change_error, 2.0 * t.settled_within)


def _together(a: Answers, t: Thresholds) -> bool:
    """Neighbours of the motion come together."""
    return a.powers(a.exponent) < -max(t.comes_together, t.sure_errors * a.powers(a.exponent_error))


def _apart(a: Answers, t: Thresholds) -> bool:
    """Nothing shows that neighbours come together, however slowly: the motion may have a phase of its own."""
    return a.exponent >= -t.sure_errors * a.exponent_error


def _same(a: Answers, t: Thresholds) -> bool:
    """The motion has the level that it would have on the smooth wheel."""
    return abs(a.level - a.level_without_waves) <= t.same_level * a.level_without_waves


def _another(a: Answers, t: Thresholds) -> bool:
    """It has another level than it would come to on the smooth wheel."""
    return math.isfinite(a.level_without_waves) and not _same(a, t)


def _comes_to_it(a: Answers, t: Thresholds) -> bool:
    """What it will look like is how the limit cycle of the smooth wheel looks, and not yet its own cycles."""
    return not a.waves or not _steady(a, t)


def _gives(a: Answers, t: Thresholds) -> bool:
    return a.power_of_friction > t.sure_errors * a.friction_error


def _friction_gives_most(a: Answers, t: Thresholds) -> bool:
    error = math.hypot(a.friction_error, t.most * a.roughness_error)
    return a.power_of_friction - t.most * max(a.power_of_roughness, 0.0) > t.sure_errors * error


def _roughness_gives_most(a: Answers, t: Thresholds) -> bool:
    error = math.hypot(a.roughness_error, t.most * a.friction_error)
    return a.power_of_roughness - t.most * max(a.power_of_friction, 0.0) > t.sure_errors * error


def _regular(a: Answers, t: Thresholds) -> bool:
    return a.harmonic_share >= t.harmonic_share or a.band_share >= t.band_share


def _takes(a: Answers, t: Thresholds) -> bool:
    return a.power_of_friction < -t.sure_errors * a.friction_error


def _decays(a: Answers, t: Thresholds) -> bool:
    rate, error = a.rate(t.sure_errors)
    return rate < -error


def _grows(a: Answers, t: Thresholds) -> bool:
    rate, error = a.rate(t.sure_errors)
    return rate > error


_DAMPED, _FORCED = Regime.DAMPED, (Regime.DAMPED, Excitation.FORCED)
_OWN = Regime.UNDECIDED, Excitation.SELF_EXCITED  # how it looks, `LOOKS` decides
_DASHPOT = "a dashpot would decide"
_CHECK = "check load.force, and the angles of the links"
_LINEAR = "full contact and slip to one side make the motion linear"

Rows = tuple[Row[Answers, Thresholds], ...]
CONTACT: Rows = (
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
SMOOTH: Rows = (
    Row(
        "linear, held by the steps",
        lambda a, t: a.linear and _grows(a, t) and a.steadier,
        _LINEAR + ": it grows at {a.own:.3g} 1/s, but the scheme's steps damp it",
        "{a.steadier}",
    ),
    Row(
        "linear, grows",
        lambda a, t: a.linear and _grows(a, t),
        _LINEAR + ": still growing at {a.own:.3g} 1/s ({a.ringing:.4g} Hz)",
        "run at least {a.grown:.3g} s",
        longer=True,
    ),
    Row(
        "linear, decays",
        lambda a, t: a.linear and _decays(a, t),
        _LINEAR + ": the shoe's own vibration decays at {a.decay:.3g} 1/s ({a.ringing:.4g} Hz)",
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
    Row(
        "no friction, no dashpots",
        lambda a, t: a.frictionless,
        "without friction nothing excites the shoe, but no dashpot damps it",
        _DASHPOT,
    ),
    Row(
        "no dashpots",
        lambda a, t: a.undamped and not a.growth > 0.0,
        "sliding is stable, and no dashpot makes a large vibration settle",
        _DASHPOT,
    ),
    Row(
        "fades",
        lambda a, t: a.without_waves == Fate.DIES,
        "the vibration dies out: continued, it comes to steady sliding",
        "",
        _DAMPED,
    ),
    Row(
        "lasts",
        lambda a, t: a.without_waves == Fate.LASTS and _same(a, t),
        "the vibration lasts: continued, it comes to an amplitude of {a.amplitude_without_waves:.3g} m",
        "",
        *_OWN,
    ),
    Row(
        "on its way",
        lambda a, t: a.without_waves == Fate.LASTS and math.isfinite(a.amplitude_without_waves),
        "the vibration lasts, and is still on its way to an amplitude of {a.amplitude_without_waves:.3g} m",
        "",
        *_OWN,
    ),
    Row(
        "lasts, irregular",
        lambda a, t: a.without_waves == Fate.LASTS and _steady(a, t),
        "the vibration lasts, as sliding is unstable, and its level does not change",
        "",
        *_OWN,
    ),
    COMES_AND_GOES,
    Row(
        "undecided",
        lambda a, t: True,
        "the level {a.word} by e^{a.change:.2g} in the second half, and what it comes to is not known",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
)
ROUGH: Rows = (
    Row(
        "shorter than a wave",
        lambda a, t: a.duration < a.slowest,
        "the run is shorter than the period of the slowest wave, {a.slowest:.3g} s",
        "run at least {a.two_waves:.3g} s",
        longer=True,
    ),
    *SMOOTH[:1],
    Row(
        "linear, forced",
        lambda a, t: a.linear and _decays(a, t) and not a.undamped,
        "only the roughness shakes the shoe: " + SMOOTH[2].sentence,
        "",
        *_FORCED,
    ),
    SMOOTH[1],
    Row(
        "linear, open",
        lambda a, t: a.linear,
        _LINEAR + ": neighbours neither come together nor part surely, at {a.even:.2g} ± {a.even_error:.1g} 1/s",
        "run longer; without dashpots, " + _DASHPOT,
        longer=True,
    ),
    Row(
        "forced, no friction",
        lambda a, t: a.frictionless and not a.undamped,
        "only the roughness shakes the shoe: without friction nothing else excites it",
        "",
        *_FORCED,
    ),
    SMOOTH[5],
    Row(
        "bounces",
        lambda a, t: not a.touches,
        "sliding steadily the shoe would not touch the wheel: it bounces, and may leave it for good",
        _CHECK,
    ),
    Row(
        "forced, neighbours",
        lambda a, t: a.without_waves == Fate.DIES and _together(a, t),
        "only the roughness shakes the shoe: without it the vibration dies out, and neighbours come together at "
        "{a.exponent:.3g} 1/s",
        "",
        *_FORCED,
    ),
    Row(
        "forced, level",
        lambda a, t: (
            a.without_waves == Fate.DIES
            and (_steady(a, t) or a.change < 0.0)
            and not _friction_gives_most(a, t)
            and not a.undamped
        ),
        "only the roughness shakes the shoe: without it the vibration dies out, and its level does not grow",
        "",
        *_FORCED,
    ),
    Row(
        "forced, friction takes",
        lambda a, t: _takes(a, t) and (_steady(a, t) or a.without_waves == Fate.DIES) and not a.undamped,
        "only the roughness shakes the shoe: friction takes {a.power_of_friction:.2g} W from the vibration",
        "",
        *_FORCED,
    ),
    Row(
        "forced, roughness gives",
        lambda a, t: _together(a, t) and _steady(a, t) and _roughness_gives_most(a, t) and not a.undamped,
        "only the roughness shakes the shoe: it gives {a.power_of_roughness:.2g} W, friction "
        "{a.power_of_friction:.2g} W, and neighbours come together at {a.exponent:.3g} 1/s",
        "",
        *_FORCED,
    ),
    Row(
        "forced, another level",
        lambda a, t: _together(a, t) and _steady(a, t) and _another(a, t) and not a.undamped,
        "only the roughness shakes the shoe: neighbours come together at {a.exponent:.3g} 1/s, and vx has "
        "{a.level:.3g} m/s, not the {a.level_without_waves:.3g} m/s to which it would come without the roughness",
        "",
        *_FORCED,
    ),
    Row(
        "dies out, not yet",
        lambda a, t: a.without_waves == Fate.DIES and not _steady(a, t),
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
            a.without_waves == Fate.LASTS
            and _apart(a, t)
            and (a.growth > 0.0 or (_steady(a, t) and not _another(a, t)))
            and _gives(a, t)
            and not a.undamped
        ),
        "the vibration lasts without the roughness, with a phase of its own",
        "",
        *_OWN,
    ),
    Row(
        "locked to the waves",
        lambda a, t: (
            a.without_waves == Fate.LASTS
            and _together(a, t)
            and _steady(a, t)
            and _same(a, t)
            and _friction_gives_most(a, t)
        ),
        "the vibration lasts without the roughness at the same level, and is locked to it",
        "",
        *_OWN,
    ),
    COMES_AND_GOES,
    Row(
        "still changes",
        lambda a, t: not _steady(a, t),
        "the level {a.word} by e^{a.change:.2g} in the second half",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
    Row(
        "either",
        lambda a, t: True,
        "friction and the roughness may both keep the vibration up: of its power friction gives "
        "{a.power_of_friction:.2g} W and the roughness {a.power_of_roughness:.2g} W; neighbours change at "
        "{a.exponent:.2g} 1/s; without the roughness it {a.without_waves}",
        longer=True,
    ),
)
LOOKS: Rows = (
    Row(
        "few cycles",
        lambda a, t: not a.cycles or a.cycles < (1.0 if a.settled else 1.5) * t.fewest_cycles,
        "but only {a.cycles:.0f} cycles in {a.seconds:.3g} s",
        "run longer",
        longer=True,
    ),
    Row(
        "few steps in a cycle",
        lambda a, t: a.steps_per_cycle < t.samples_per_cycle,
        "but only {a.steps_per_cycle:.1f} steps a cycle",
        "reduce solver.step and output.sample_interval",
    ),
    Row(
        "few samples in a cycle",
        lambda a, t: a.samples_per_cycle < t.samples_per_cycle,
        "but only {a.samples_per_cycle:.1f} samples a cycle",
        "reduce output.sample_interval",
    ),
    Row(
        "shorter than two waves",
        lambda a, t: a.seconds < 2.0 * a.slowest,
        "but the settled part holds less than two periods of the slowest wave, {a.slowest:.3g} s",
        "run at least {a.two_waves:.3g} s",
        longer=True,
    ),
    Row(
        "limit cycle with stick",
        lambda a, t: a.sticks_without_waves >= 1.0 and _comes_to_it(a, t),
        "in a limit cycle of {a.ends_at:.4g} Hz with stick",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "limit cycle without stick",
        lambda a, t: a.sticks_without_waves == 0.0 and _comes_to_it(a, t),
        "in a limit cycle of {a.ends_at:.4g} Hz without stick",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "on its way",
        lambda a, t: a.waves and not _steady(a, t),
        "but its level still {a.word} by e^{a.change:.2g} in the second half, which changes how it looks",
        "run at least {a.longer:.3g} s",
        longer=True,
    ),
    Row(
        "relaxation",
        lambda a, t: a.stick_cycles >= t.stick_cycles,
        "with stick in {a.stick_cycles:.0%} of {a.cycles:.0f} cycles",
        "",
        Regime.RELAXATION,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "quasi-harmonic",
        lambda a, t: a.stick_cycles <= 1.0 - t.stick_cycles and _regular(a, t),
        "{a.sticks}: {a.lines}",
        "",
        Regime.QUASI_HARMONIC,
        Excitation.SELF_EXCITED,
    ),
    Row(
        "irregular",
        lambda a, t: True,
        "irregular: stick in {a.stick_cycles:.0%} of the cycles, {a.lines}",
        "run longer, or look at the spectrum",
        longer=True,
    ),
)
_WITH_WAVES, _WITHOUT = (*CONTACT, *ROUGH), (*CONTACT, *SMOOTH)


def decide(answers: Answers, thresholds: Thresholds) -> Decision:
    """What the first row says whose condition holds."""
    found = first(_WITH_WAVES if answers.waves else _WITHOUT, answers, thresholds)
    if found.excitation is not Excitation.SELF_EXCITED:
        return found
    look = first(LOOKS, answers, thresholds)
    return look._replace(reason=f"{found.reason}, {look.reason}", row=f"{found.row}: {look.row}")


def first(rows: tuple[Row[A, T], ...], answers: A, thresholds: T) -> Decision:
    """What the first row of a table says whose condition holds."""
    return next(row for row in rows if row.holds(answers, thresholds)).decision(answers)
