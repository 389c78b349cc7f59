"""The table of measured signals: what is said of one, by one record of answers. See docs/measured-signals.md.

Nothing here looks at a signal. Rows are tried from the top, and the first whose condition holds decides.
"""

import math
from dataclasses import dataclass

from brakecli.analysis.regime.decision import Decision, Regime, Row, first
from brakecli.faces import argument

FEWEST_SAMPLES = 64


@dataclass(frozen=True)
class SignalThresholds:
    """The only numbers that decide the verdict on a signal; every verdict carries them."""

    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    negligible: float = 0.05  # part of a level that counts as nothing: a steady one may change by it twice
    sure_errors: float = 3.0  # standard errors beyond which a change is no chance
    skewness_certain: float = 0.9  # of the velocity; two lines in step reach 0.816 and no more
    skewness_lines: float = 1.5  # three lines in step reach 1.4 and no more
    overtones: float = 0.03  # part of the energy in the third to eighth multiple, which two lines in step lack
    beyond_lines: float = 0.003  # part of the energy that three lines in step leave
    plateau: float = 2.6  # time at the belt's speed, over that next to it, that shows stick; a sine reaches 2.41
    line_share: float = 0.7  # part of the energy of the velocity in three narrow bands


@dataclass(frozen=True)
class SignalAnswers:
    """What is known of a measured motion; nan where a number is not known."""

    samples: float = 0.0  # without a gap
    heard: bool = False  # whether anything rises above the noise
    has_belt: bool = True  # whether the belt's speed can be given,
    knows_belt: bool = False  # and is
    smoothed_over: float = math.nan  # samples
    cycles: float = math.nan
    samples_per_cycle: float = math.nan
    died_to: float = math.nan  # level of the last quarter over the largest
    hidden: float = math.nan  # part of the largest level that noise hides
    was_loud: bool = False  # whether the largest level lies in the first half
    steady_from: float = math.nan  # part of the record from which on the change is that of the level: 0 or 1/2
    level_change: float = math.nan  # of its logarithm
    level_change_error: float = math.nan
    skewness: float = math.nan  # of the velocity
    events: float = math.nan  # of what skews it
    slip_lasts: float = math.nan  # part of a slip that is left a quarter of a cycle later
    slip_swings: float = math.nan  # how far the velocity goes the other way, over the slip
    slips: bool = False  # whether these are slips between sticks, by their shape
    overtones: float = math.nan  # part of the energy in the third to eighth multiple of the line
    beyond_lines: float = math.nan  # that three lines leave
    noise_share: float = math.nan  # that a line among the noise may have unseen
    plateau: float = math.nan  # time at the belt's speed, or at an extreme velocity, over that next to it
    sticks: float = math.nan  # part of the time at that velocity beyond what a smooth motion has
    reaches: bool = False  # the belt's speed, just so
    line_share: float = math.nan  # part of the energy in three narrow bands

    @property
    def word(self) -> str:
        """Which way the level changes."""
        return "grows" if self.level_change > 0.0 else "falls"

    @property
    def unseen(self) -> str:
        """What stays unknown without the belt's speed."""
        return f"; short stick would show only by {argument('belt-speed')}" * (
            self.has_belt and not self.knows_belt
        )

    @property
    def give_belt(self) -> str:
        """What to do where the belt's speed would decide."""
        return f"give {argument('belt-speed')}" * self.has_belt


def steady(change: float, error: float, limits: SignalThresholds) -> bool:
    """Whether the level does not change, but for chance."""
    return abs(change) <= max(limits.sure_errors * error, 2.0 * limits.negligible)


def _skewed(motion: SignalAnswers, limits: SignalThresholds) -> bool:
    """What may be slips skews the velocity."""
    some = (
        motion.slips or motion.skewness < limits.skewness_certain
    )  # two lines in step may hide the shape of slips
    return motion.events >= limits.fewest_cycles and motion.skewness > 0.0 and some


def _lacks(motion: SignalAnswers, limits: SignalThresholds) -> float:
    """The part of the energy that stick would have and lines in step lack, where it is not there; otherwise 0."""
    if motion.skewness < limits.skewness_certain and motion.overtones <= limits.overtones:
        return limits.overtones
    return (
        limits.beyond_lines
        if motion.skewness < limits.skewness_lines and motion.beyond_lines <= limits.beyond_lines
        else 0.0
    )


_LONGER = "measure longer"
ROWS: tuple[Row[SignalAnswers, SignalThresholds], ...] = (
    Row(
        "few samples",
        lambda motion, limits: motion.samples < FEWEST_SAMPLES,
        "only {samples:.0f} samples without a gap",
        _LONGER,
    ),
    Row(
        "noise",
        lambda motion, limits: not motion.heard,
        "the vibration is hidden by noise",
        "measure closer to the shoe, or with less noise",
    ),
    Row(
        "few cycles",
        lambda motion, limits: motion.cycles < limits.fewest_cycles,
        "only {cycles:.0f} cycles",
        _LONGER,
    ),
    Row(
        "few samples in a cycle",
        lambda motion, limits: motion.samples_per_cycle < limits.samples_per_cycle,
        "only {samples_per_cycle:.1f} samples a cycle",
        "measure at a higher rate",
    ),
    Row(
        "died out",
        lambda motion, limits: motion.was_loud and motion.died_to <= max(limits.negligible, motion.hidden),
        "the vibration has died out: down to {died_to:.2g} of its largest",
        "",
        Regime.DAMPED,
    ),
    Row(
        "still changes",
        lambda motion, limits: not steady(motion.level_change, motion.level_change_error, limits),
        "the level {word} by e^{level_change:.2g} in the second half",
        "measure longer, until it does not",
    ),
    Row(
        "slips or lines",
        lambda motion, limits: (
            # energy of three times the noise of a line is told from it; a choice
            _skewed(motion, limits) and motion.noise_share > _lacks(motion, limits) / 3.0 > 0.0
        ),
        "stick, or lines in phase, have skewed the velocity, and noise hides which of them",
        "measure with less noise, or for longer",
    ),
    Row(
        "slips",
        lambda motion, limits: _skewed(motion, limits) and motion.slips and not _lacks(motion, limits),
        "{events:.0f} events of stick and slip: skewness of the velocity {skewness:.2g}",
        "",
        Regime.RELAXATION,
    ),
    Row(
        "stays at the belt's speed",
        lambda motion, limits: motion.plateau > limits.plateau and motion.knows_belt,
        "the velocity is that of the belt for {sticks:.0%} of the time, in most cycles or in all",
        "",
        Regime.RELAXATION,
    ),
    Row(
        "stays at one speed",
        lambda motion, limits: motion.plateau > limits.plateau,
        "the velocity has a plateau on one side, which short stick can cause",
        "{give_belt}",
    ),
    Row(
        "reaches the belt's speed",
        lambda motion, limits: motion.reaches,
        "the velocity just reaches that of the belt",
        "less noise may show whether it stays",
    ),
    Row(
        "irregular",
        lambda motion, limits: motion.line_share < limits.line_share,
        "irregular without stick: {line_share:.0%} of the energy in three lines",
        _LONGER,
    ),
    Row(
        "lines",
        lambda motion, limits: True,
        "sustained without stick[: {line_share:.0%} of the energy in at most three lines]{unseen}",
        "",
        Regime.QUASI_HARMONIC,
    ),
)


def decide(answers: SignalAnswers, thresholds: SignalThresholds) -> Decision:
    """What the first row says whose condition holds."""
    return first(ROWS, answers, thresholds)
