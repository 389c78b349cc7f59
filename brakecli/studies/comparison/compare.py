"""Comparing methods on one case: a reference, a first round for the errors, further rounds for the times."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from statistics import median

import numpy as np

from brakecli.analysis.spectrum import FEWEST_BINS
from brakecli.analysis.stability import report as linear
from brakecli.errors import BrakecliError, RefusedError
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Counted, Motion, Work, solve
from brakecli.solver.method import Method
from brakecli.solver.quantities import HISTORY
from brakecli.solver.steps.loop import load
from brakecli.solver.system import System
from brakecli.studies.comparison.methods import kinds, ladder, method_label, rungs
from brakecli.studies.runs.limits import check, refuse, within_range

FEWEST_SAMPLES = 64
"""Samples that are compared, and of a line, at least; a choice."""
MOST_REPEATS = 21
"""Turns of timing, at most; a choice."""
# what is compared
MOTION = ("x", "y", "vx", "vy")
FORCES = ("friction_force", "normal_force")
LEFT_OUT = "left out: no time within the budget"


@dataclass(frozen=True)
class Errors:
    """Relative errors against a reference, all of them parts of the largest value of the quantity.

    `largest` of each quantity over the samples; `mean`: the same in the mean over time (L1), as one sample on
    the other side of a jump of the friction force makes its largest error 2. `error`: the largest of x, y, vx
    and vy. `amplitude` and `phase` (rad): of the strongest line of vx over the last quarter of the time, None
    where there is none.
    """

    error: float
    largest: dict[str, float]
    mean: dict[str, float]
    amplitude: float | None
    phase: float | None


@dataclass
class Entry:
    """A method at one step or tolerance, with what came of it; None where it does not exist."""

    label: str  # the method in a few words
    kind: Method  # without step and tolerance
    method: Method
    rung: int  # on the ladder of steps or tolerances, from the coarsest on
    errors: Errors | None = None
    work: Work | None = None
    failure: str = ""
    iterations: int = 0  # evaluations of the contact in the steps, one for each; none where steps are explicit
    seconds: list[float] = field(default_factory=list)
    order: float | None = None
    critical_bias: float | None = None
    step_limit: float | None = None  # s; infinite where any step is stable
    on_front: bool = False

    def __str__(self) -> str:
        """The method with its step or tolerance."""
        if self.method.row.exact:
            return self.label
        rung = f"tolerance {self.tolerance:g}" if self.method.step is None else f"step {self.method.step:.3g} s"
        return f"{self.label}, {rung}"

    @property
    def tolerance(self) -> float | None:
        """The tolerance; None where there is a step."""
        return self.method.tolerance or None

    @property
    def error(self) -> float:
        """The largest error of the motion; infinite where it is not known."""
        return math.inf if self.errors is None else self.errors.error

    @property
    def stable_step(self) -> float | None:
        """The limit on the step, s; None where there is none, or where it is not known."""
        return None if self.step_limit is None or math.isinf(self.step_limit) else self.step_limit

    @property
    def wall_seconds(self) -> float | None:
        """Median time of the loop alone, s."""
        return median(self.seconds) if self.seconds else None


@dataclass(frozen=True)
class Comparison:
    """All entries on one case."""

    duration: float  # s; less than the case's where the reference would take too long
    interval: float
    reference_error: float
    reference_seconds: float
    repeats: int
    left_out: int  # rungs that the budget did not allow
    entries: tuple[Entry, ...]


def compare(
    system: System,
    *,
    schemes: Sequence[str] = (),
    steps: Sequence[float] = (),
    budget: float = 60.0,
    progress: Counted = lambda what, done, total: None,
) -> Comparison:
    """Compare the methods on a system within about `budget` s. Raises RefusedError where there is no reference."""
    with within_range():
        lengths = ladder(system, steps)
        entries = list[Entry]()
        for kind in kinds(system, schemes):  # compilation is not part of the budget
            load(kind.scheme)
            label = method_label(kind)
            entries += [Entry(label, kind, method, rung) for rung, method in enumerate(rungs(kind, lengths))]
        begin = time.perf_counter()
        report = linear.stability(system)
        progress("reference", 0, 0)
        sampled = replace(system, interval=lengths[0])
        reference = _reference(sampled, 0.3 * budget)
        sampled = replace(sampled, duration=(len(reference.rows) - 1) * sampled.interval)
        checked = _event_driven(sampled, 1e-10, "it is not known how good the reference is")
        reference_error = errors(checked.rows, reference.rows).error
        _measure(sampled, entries, reference.rows, begin + 0.8 * budget, progress)  # the rest is for times
        _add_limits(system, report, entries)
        repeats = _repeat(sampled, entries, begin + budget, progress)
    _mark_front(entries)
    left_out = sum(entry.failure == LEFT_OUT for entry in entries)
    duration = sampled.duration
    interval = sampled.interval
    seconds = reference.work.solve_seconds
    return Comparison(duration, interval, reference_error, seconds, repeats, left_out, tuple(entries))


def _motion(system: System, method: Method, *, at_once: bool = False) -> Motion:
    """The motion by a method, in one block if `at_once`; raises RefusedError."""
    system = replace(system, method=method)
    refuse(check(system))
    return solve(system, first_block=system.steps if at_once else 1)


def _event_driven(system: System, tolerance: float, without: str) -> Motion:
    """The motion to a tolerance; raises RefusedError where it fails, with what is missing then."""
    motion = _motion(system, Method("event-driven", tolerance=tolerance))
    if motion.work.failed:
        raise RefusedError(f"{without}: {motion.work.failure_sentence}")
    return motion


def _reference(system: System, budget: float) -> Motion:
    """The longest part of the motion whose reference fits the budget (s), from the start on."""
    shortest = FEWEST_SAMPLES * system.interval
    piece = replace(system, duration=shortest)
    whole = max(system.duration, shortest)
    while True:
        motion = _event_driven(piece, 1e-12, "there is no reference to compare with")
        seconds = motion.work.solve_seconds
        if piece.duration >= whole or 3.0 * seconds > budget:
            return motion
        # A longer run may take more than in proportion: it aims below the budget, and at most four times as far.
        longer = piece.duration * min(4.0, 0.7 * budget / max(seconds, 1e-3))
        piece = replace(piece, duration=min(longer, whole))


def _measure(system: System, entries: list[Entry], reference: Floats, deadline: float, progress: Counted) -> None:
    """Run every rung once, the coarse ones first, while there is time, and measure its error."""
    last: dict[Method, float] = {}
    for done, entry in enumerate(sorted(entries, key=lambda entry: entry.rung)):
        progress("errors", done, len(entries))
        # The coarsest of each method is run in any case
        if entry.rung and time.perf_counter() + 2.0 * last.get(entry.kind, 0.0) > deadline:
            entry.failure = LEFT_OUT
            continue
        try:
            motion = _motion(system, entry.method)
        except BrakecliError as error:
            entry.failure = " ".join(str(error).split())
            continue
        work = entry.work = motion.work
        last[entry.kind] = work.solve_seconds
        entry.failure = work.failure_sentence or ""
        entry.iterations = work.contact_evaluations - len(motion.rows) if entry.method.step else 0
        if not work.failed:
            entry.seconds.append(work.solve_seconds)
            entry.errors = errors(motion.rows, reference)


def _repeat(system: System, entries: list[Entry], deadline: float, progress: Counted) -> int:
    """Time all that ran again, in turns, as often as the budget allows; how many times each."""
    timed = [entry for entry in entries if entry.seconds]
    for repeat in range(MOST_REPEATS):
        if repeat == 3:  # enough for loops of a tenth of a second and more, where chance matters less
            timed = [entry for entry in timed if entry.seconds[-1] < 0.1]
        # a turn may take longer than the last one, and each run takes some ms beside its loop
        expected = 1.3 * sum(entry.seconds[-1] for entry in timed) + 0.005 * len(timed)
        if time.perf_counter() + expected > deadline:
            return max(repeat, 1)
        for done, entry in enumerate(timed):
            progress(f"times, turn {repeat + 1}", done, len(timed))
            at_once = entry.seconds[-1] < 1.0  # s: the time that blocks take is small beside longer ones
            seconds = _motion(system, entry.method, at_once=at_once).work.solve_seconds
            # The first time counts only where there are no others: it found memory and caches cold
            entry.seconds = [*entry.seconds, seconds] if repeat else [seconds]
    return MOST_REPEATS


def _add_limits(system: System, report: linear.StabilityReport, entries: list[Entry]) -> None:
    """Add what the amplification matrices say, and the observed orders."""
    stiffness_at = report.stiffness_at
    exact = report.critical
    # Neither depends on starts, iterations and evaluators
    limit = cache(lambda scheme: linear.step_limit(replace(system, method=scheme), stiffness_at))

    @cache
    def bias(scheme: Method, step: float) -> float | None:
        at = replace(system, interval=step, duration=step, method=replace(scheme, step=step))
        critical = linear.discrete_critical(at, stiffness_at, exact) if exact else None
        return critical - exact.friction if critical is not None and exact else None

    for entry in entries:
        scheme = Method(entry.kind.scheme, entry.kind.theta)
        step = entry.method.step
        if step is None:
            entry.step_limit = math.inf
            entry.critical_bias = 0.0 if exact else None
        elif report.discrete is not None:  # otherwise no steady sliding could lose its stability
            longest = limit(scheme)
            entry.step_limit = math.inf if longest is None else longest
            entry.critical_bias = bias(scheme, step)
    for coarse, fine in pairwise(entries):
        long = coarse.method.step
        short = fine.method.step
        if fine.rung and long and short and 0.0 < fine.error < math.inf and 0.0 < coarse.error < math.inf:
            fine.order = math.log(coarse.error / fine.error) / math.log(long / short)


def _mark_front(entries: list[Entry]) -> None:
    """Mark the entries that no other beats in both error and time."""
    best = math.inf
    for entry in sorted(entries, key=lambda entry: (entry.wall_seconds or 0.0, entry.error)):
        if entry.error < best:
            entry.on_front = True
            best = entry.error


def errors(rows: Floats, reference: Floats) -> Errors:
    """Compare rows of `quantities.HISTORY`, sampled at the same times."""
    columns = {name: pair for name, *pair in zip(HISTORY, rows.T, reference.T, strict=True)}
    largest = {}
    mean = {}
    for name in (*MOTION, *FORCES):
        values, exact = columns[name]
        apart = np.abs(values - exact)
        scale = float(np.abs(exact).max()) or 1.0
        largest[name] = float(apart.max()) / scale
        mean[name] = float(apart.mean()) / scale
    amplitude, phase = _line(*columns["vx"])
    return Errors(
        error=max(largest[name] for name in MOTION),
        largest=largest,
        mean=mean,
        amplitude=amplitude,
        phase=phase,
    )


def _line(values: Floats, reference: Floats) -> tuple[float | None, float | None]:
    """Relative error of the amplitude, and error of the phase, of the reference's strongest line."""
    count = len(reference) // 4
    if count < FEWEST_SAMPLES:
        return None, None
    window = np.hanning(count + 2)[1:-1]
    late = reference[-count:] - reference[-count:].mean()
    size = np.abs(np.fft.rfft(window * late))
    top = int(np.argmax(size))
    rounding = 1e-9 * count * float(np.abs(reference).max())
    if top < FEWEST_BINS or size[top] <= rounding:
        return None, None
    turning = np.exp(-2j * math.pi * top / count * np.arange(count)) * window
    exact = complex(turning @ late)
    computed = complex(turning @ (values[-count:] - values[-count:].mean()))
    return abs(computed) / abs(exact) - 1.0, float(np.angle(computed / exact))
