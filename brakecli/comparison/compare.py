"""Comparing methods on one case: a reference, a first round for the errors, further rounds for the times."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.report import (
    StabilityReport,
    discrete_critical,
    mean_stiffness,
    stability,
    step_limit,
)
from brakecli.comparison.deviation import Errors, errors
from brakecli.comparison.methods import Rung, kinds, ladder, rungs
from brakecli.errors import BrakecliError, RefusedError
from brakecli.runs.limits import check, refuse, within_range
from brakecli.solver import contact
from brakecli.solver.method import Method
from brakecli.solver.motion import Motion, Work, solve
from brakecli.solver.system import System

REFERENCE, CHECK = 1e-12, 1e-10
"""Tolerances of the reference, and of the run that tells how good it is."""
REFERENCE_SHARE = 0.3
"""Part of the budget that the reference may take."""
FEWEST_SAMPLES = 64
MOST_REPEATS, SLOW_REPEATS, SLOW = 21, 3, 0.1
"""Turns of most loops, and of those that take long (s): there, chance matters less."""
LONGEST_CALL = 1.0
"""Loops that take less (s) are timed in one call; longer ones in blocks, whose own time is small beside theirs."""


@dataclass
class Entry:
    """A rung with what came of it; None where it does not exist."""

    rung: Rung
    errors: Errors | None = None
    work: Work | None = None
    failure: str = ""
    samples: int = 0
    seconds: list[float] = field(default_factory=list)
    order: float | None = None
    critical_bias: float | None = None
    step_limit: float | None = None  # s; infinite where any step is stable
    on_front: bool = False

    @property
    def iterations(self) -> int:
        """Evaluations of the contact in the steps, one for each iteration; none where steps are explicit."""
        if self.work is None or self.rung.step is None:
            return 0
        return self.work.contact_evaluations - self.samples

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

    system: System
    duration: float  # s; less than the case's where the reference would take too long
    interval: float
    reference_error: float
    reference_seconds: float
    repeats: int
    left_out: int  # rungs that the budget did not allow
    entries: tuple[Entry, ...]

    def cheapest(self, target: float) -> Entry | None:
        """The entry that takes the least time of those whose error is at most `target`."""
        able = [
            entry
            for entry in self.entries
            if entry.errors is not None and entry.errors.error + self.reference_error <= target and entry.seconds
        ]
        return min(able, key=lambda entry: entry.wall_seconds or math.inf, default=None)

    def finer_error(self, entry: Entry) -> float:
        """The largest error of the same method at finer steps; above the entry's own, that is low by chance."""
        kind, step = entry.rung.kind, entry.rung.step or 0.0
        finer = (each for each in self.entries if each.rung.kind == kind and (each.rung.step or step) < step)
        return max((each.errors.error for each in finer if each.errors is not None), default=0.0)


Progress = Callable[[str, int, int], None]
"""Told what is done, how many rungs are done, and of how many."""


def compare(
    system: System,
    *,
    schemes: Sequence[str] = (),
    steps: Sequence[float] = (),
    budget: float = 60.0,
    progress: Progress = lambda what, done, total: None,
) -> Comparison:
    """Compare the methods on a system within about `budget` s. Raises RefusedError where there is no reference."""
    with within_range():
        tried = kinds(system, schemes)
        for kind in tried:  # compilation is not part of the budget
            _ = kind.module, contact.load("exact" if kind.evaluator == "auto" else kind.evaluator)
        begin = time.perf_counter()
        found = ladder(system, steps)
        report = stability(system)
        progress("reference", 0, 0)
        sampled = replace(system, interval=found[0])
        reference = _reference(sampled, REFERENCE_SHARE * budget)
        sampled = replace(sampled, duration=(len(reference.rows) - 1) * sampled.interval)
        reference_error = _reference_error(sampled, reference.rows)
        entries = [Entry(rung) for kind in tried for rung in rungs(kind, found)]
        left_out = _first_round(sampled, entries, reference.rows, begin + 0.8 * budget, progress)
        _add_limits(system, report, entries)
        repeats = _repeat(sampled, entries, begin + budget, progress)
    _fronts(entries)
    return Comparison(
        system,
        sampled.duration,
        sampled.interval,
        reference_error,
        reference.work.solve_seconds,
        repeats,
        left_out,
        tuple(entries),
    )


def _motion(system: System, method: Method, *, at_once: bool = False) -> Motion:
    """The motion by a method, in one block if `at_once`; raises RefusedError."""
    system = replace(system, method=method)
    refuse(system, check(system), math.inf)
    return solve(system, first_block=system.steps if at_once else 1)


def _reference(system: System, budget: float) -> Motion:
    """The longest part of the motion whose reference fits the budget (s), from the start on."""
    whole = max(system.duration, FEWEST_SAMPLES * system.interval)
    duration = FEWEST_SAMPLES * system.interval
    while True:
        duration = min(duration, whole)
        motion = _motion(replace(system, duration=duration), Method("event-driven", tolerance=REFERENCE))
        if motion.work.failed:
            raise RefusedError(f"there is no reference to compare with: {motion.work.failure_sentence}")
        seconds = motion.work.solve_seconds
        if duration >= whole or 3.0 * seconds > budget:
            return motion
        duration *= min(4.0, 0.7 * budget / max(seconds, 1e-3))


def _reference_error(system: System, reference: NDArray[np.float64]) -> float:
    """By how much the reference differs from a run at a looser tolerance."""
    motion = _motion(system, Method("event-driven", tolerance=CHECK))
    if motion.work.failed:
        raise RefusedError(f"it is not known how good the reference is: {motion.work.failure_sentence}")
    return errors(motion.rows, reference, system.interval).error


def _first_round(
    system: System, entries: list[Entry], reference: NDArray[np.float64], deadline: float, progress: Progress
) -> int:
    """Run every rung once, the coarse ones first, and measure its error; how many there was no time for.

    The coarsest of each method is run in any case.
    """
    places: dict[Method, int] = {}
    order = []
    for entry in entries:
        places[entry.rung.kind] = place = places.get(entry.rung.kind, -1) + 1
        order.append((place, entry))
    left_out = 0
    last: dict[Method, float] = {}
    for done, (place, entry) in enumerate(sorted(order, key=lambda pair: pair[0])):
        progress("errors", done, len(entries))
        if place and time.perf_counter() + 2.0 * last.get(entry.rung.kind, 0.0) > deadline:
            entry.failure = "left out: no time within the budget"
            left_out += 1
            continue
        try:
            motion = _motion(system, entry.rung.method)
        except BrakecliError as error:
            entry.failure = " ".join(str(error).split())
            continue
        work = entry.work = motion.work
        last[entry.rung.kind] = work.solve_seconds
        entry.samples, entry.failure = len(motion.rows), work.failure_sentence or ""
        if not work.failed:
            entry.seconds.append(work.solve_seconds)
            entry.errors = errors(motion.rows, reference, system.interval)
    return left_out


def _repeat(system: System, entries: list[Entry], deadline: float, progress: Progress) -> int:
    """Time all that ran again, in turns, as often as the budget allows; how many times each.

    The times of the first round, which found memory and caches cold, count only where there are no others.
    """
    timed = [entry for entry in entries if entry.seconds]
    for repeat in range(MOST_REPEATS):
        if repeat == SLOW_REPEATS:
            timed = [entry for entry in timed if entry.seconds[-1] < SLOW]
        expected = 1.3 * sum(entry.seconds[-1] for entry in timed) + 0.005 * len(timed)
        if time.perf_counter() + expected > deadline:
            return max(repeat, 1)
        for done, entry in enumerate(timed):
            progress(f"times, turn {repeat + 1}", done, len(timed))
            at_once = entry.seconds[-1] < LONGEST_CALL
            seconds = _motion(system, entry.rung.method, at_once=at_once).work.solve_seconds
            entry.seconds = [*entry.seconds, seconds] if repeat else [seconds]
    return MOST_REPEATS


def _add_limits(system: System, report: StabilityReport, entries: list[Entry]) -> None:
    """Add what the amplification matrices say, and the observed orders."""
    stiffness_at = mean_stiffness(system, report.contact_stiffness)
    exact = report.critical
    limits: dict[tuple[str, tuple[float, ...]], float | None] = {}
    biases: dict[tuple[str, tuple[float, ...], float], float | None] = {}
    before: Entry | None = None
    for entry in entries:
        kind, step = entry.rung.kind, entry.rung.step
        if before is not None and before.rung.kind == kind:
            entry.order = _order(before, entry)
        before = entry
        if step is None:
            entry.step_limit, entry.critical_bias = math.inf, 0.0 if exact else None
            continue
        if report.discrete is None:  # no steady sliding that could lose its stability
            continue
        scheme = kind.scheme, kind.theta
        if (*scheme, step) not in biases:
            at = replace(system, interval=step, duration=step, method=entry.rung.method)
            if scheme not in limits:
                limit = step_limit(at, stiffness_at)
                limits[scheme] = math.inf if limit is None else limit
            found = discrete_critical(at, stiffness_at, exact) if exact else None
            biases[*scheme, step] = found - exact.friction if found is not None and exact else None
        entry.step_limit, entry.critical_bias = limits[scheme], biases[*scheme, step]


def _order(coarse: Entry, fine: Entry) -> float | None:
    """Observed order between two rungs: how the error falls with the step."""
    if coarse.errors is None or fine.errors is None or not (fine.errors.error > 0.0 < coarse.errors.error):
        return None
    if coarse.rung.step is None or fine.rung.step is None:
        return None
    return math.log(coarse.errors.error / fine.errors.error) / math.log(coarse.rung.step / fine.rung.step)


def _fronts(entries: list[Entry]) -> None:
    """Mark the entries that no other beats in both error and time."""
    best = math.inf
    able = [entry for entry in entries if entry.errors is not None and entry.wall_seconds is not None]
    for entry in sorted(able, key=lambda each: (each.wall_seconds, each.errors.error if each.errors else 0.0)):
        if entry.errors is not None and entry.errors.error < best:
            entry.on_front, best = True, entry.errors.error
