"""Comparing methods on one case: a reference, a first round for the errors, further rounds for the times."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from brakecli import contact
from brakecli.analysis.precision import spectral_radius
from brakecli.case import Case, Evaluator, Iteration, Scheme, Start
from brakecli.check import check, refuse, within_range
from brakecli.compare.errors import Errors, errors
from brakecli.compare.methods import Method, Rung, case_of, ladder, methods, rungs
from brakecli.errors import BrakecliError, RefusedError
from brakecli.model import Failure
from brakecli.run import failure_sentence
from brakecli.schemes import has_own_steps, load
from brakecli.setup import Setup, set_up
from brakecli.simulate import Motion, Work
from brakecli.stability import MARGIN, StabilityReport, stability

REFERENCE, CHECK = 1e-12, 1e-10
"""Tolerances of the reference, and of the run that tells how good it is."""
REFERENCE_SHARE = 0.3
"""Part of the budget that the reference may take."""
FEWEST_SAMPLES = 64
FIRST_PART = 1.0 / 64.0
MOST_REPEATS = 7


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
    def wall_seconds(self) -> float | None:
        """Median time of the loop alone, s."""
        return median(self.seconds) if self.seconds else None


@dataclass(frozen=True)
class Comparison:
    """All entries on one case."""

    setup: Setup
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


Progress = Callable[[str, int, int], None]
"""Told what is done, how many rungs are done, and of how many."""


def compare(
    case: Case,
    *,
    schemes: Sequence[str] = (),
    steps: Sequence[float] = (),
    budget: float = 60.0,
    progress: Progress = lambda what, done, total: None,
) -> Comparison:
    """Compare the methods on a case within about `budget` s. Raises RefusedError where there is no reference."""
    with within_range():
        setup = set_up(case)
        kinds = methods(setup, schemes)
        for method in kinds:  # compilation is no part of the budget
            _ = load(method.scheme), contact.load("exact" if method.evaluator == "auto" else method.evaluator)
        begin = time.perf_counter()
        found = ladder(setup, steps)
        interval = found[0]
        report = stability(setup)
        progress("reference", 0, 0)
        duration, reference, reference_seconds = _reference(case, interval, REFERENCE_SHARE * budget)
        rough_reference = _rows(_reference_case(case, interval, duration, CHECK))[0]
        reference_error = errors(rough_reference, reference, interval).error
        entries = [Entry(rung) for method in kinds for rung in rungs(method, found)]
        left_out = _first_round(case, entries, reference, (interval, duration), begin + 0.8 * budget, progress)
        _judge(setup, report, entries)
        repeats = _repeat(case, entries, (interval, duration), begin + budget, progress)
    _fronts(entries)
    return Comparison(
        setup, duration, interval, reference_error, reference_seconds, repeats, left_out, tuple(entries)
    )


def _reference_case(case: Case, interval: float, duration: float, tolerance: float) -> Case:
    method = Method(Scheme.EVENT_DRIVEN, (), Start.CONSISTENT, Iteration.NEWTON, Evaluator.AUTO, 0)
    return case_of(case, Rung(method, None, tolerance), interval, duration)


def _rows(case: Case) -> tuple[NDArray[np.float64], Work]:
    """Samples and work of a run; raises RefusedError."""
    setup = set_up(case)
    refuse(setup, check(setup), math.inf)
    blocks: list[NDArray[np.float64]] = []
    work, _ = Motion(setup).run(lambda rows: blocks.append(rows.copy()))
    return np.concatenate(blocks), work


def _reference(case: Case, interval: float, budget: float) -> tuple[float, NDArray[np.float64], float]:
    """The longest part of the motion whose reference fits the budget (s), from the start on, and its samples."""
    whole = case.solver.duration
    duration = max(FIRST_PART * whole, FEWEST_SAMPLES * interval)
    while True:
        duration = min(duration, max(whole, FEWEST_SAMPLES * interval))
        rows, work = _rows(_reference_case(case, interval, duration, REFERENCE))
        if work.failure is not Failure.NONE:
            raise RefusedError(f"there is no reference to compare with: {failure_sentence(work)}")
        if duration >= whole or 3.0 * work.solve_seconds > budget:
            return duration, rows, work.solve_seconds
        duration *= min(4.0, 0.7 * budget / max(work.solve_seconds, 1e-3))


def _first_round(
    case: Case,
    entries: list[Entry],
    reference: NDArray[np.float64],
    grid: tuple[float, float],
    deadline: float,
    progress: Progress,
) -> int:
    """Run every rung once, the coarse ones first, and measure its error; how many there was no time for."""
    places: dict[Method, int] = {}
    order = []
    for entry in entries:
        places[entry.rung.method] = place = places.get(entry.rung.method, -1) + 1
        order.append((place, entry))
    left_out = 0
    last: dict[Method, float] = {}
    for done, (_, entry) in enumerate(sorted(order, key=lambda pair: pair[0])):
        progress("errors", done, len(entries))
        if time.perf_counter() + 2.0 * last.get(entry.rung.method, 0.0) > deadline:
            entry.failure = "left out: no time within the budget"
            left_out += 1
            continue
        try:
            rows, work = _rows(case_of(case, entry.rung, *grid))
        except BrakecliError as error:
            entry.failure = " ".join(str(error).split())
            continue
        last[entry.rung.method] = work.solve_seconds
        entry.work, entry.samples = work, len(rows)
        if work.failure is not Failure.NONE:
            entry.failure = failure_sentence(work)
        else:
            entry.seconds.append(work.solve_seconds)
            entry.errors = errors(rows, reference, grid[0])
    return left_out


def _repeat(
    case: Case, entries: list[Entry], grid: tuple[float, float], deadline: float, progress: Progress
) -> int:
    """Time all that ran again, in turns, as often as the budget allows; how many times each."""
    timed = [entry for entry in entries if entry.seconds]
    for repeat in range(1, MOST_REPEATS):
        expected = 1.3 * sum(entry.seconds[-1] for entry in timed) + 0.005 * len(timed)
        if time.perf_counter() + expected > deadline:
            return repeat
        for done, entry in enumerate(timed):
            progress(f"times, turn {repeat + 1}", done, len(timed))
            entry.seconds.append(_rows(case_of(case, entry.rung, *grid))[1].solve_seconds)
    return MOST_REPEATS


def _judge(setup: Setup, report: StabilityReport, entries: list[Entry]) -> None:
    """Add what the amplification matrices say, and the observed orders."""
    limits: dict[tuple[str, tuple[float, ...]], float] = {}
    before: Entry | None = None
    for entry in entries:
        method, step = entry.rung.method, entry.rung.step
        if before is not None and before.rung.method == method:
            entry.order = _order(before, entry)
        before = entry
        if step is None:
            entry.step_limit, entry.critical_bias = math.inf, 0.0 if report.critical else None
            continue
        at = set_up(case_of(setup.case, entry.rung, step, step))
        key = (str(method.scheme), method.theta)
        if key not in limits:
            discrete = stability(at).discrete
            limits[key] = math.nan if discrete is None else discrete.step_limit or math.inf
            if discrete is not None and discrete.step_limit == 0.0:
                limits[key] = 0.0
        entry.step_limit = None if math.isnan(limits[key]) else limits[key]
        entry.critical_bias = _bias(at, report)


def _bias(setup: Setup, report: StabilityReport) -> float | None:
    """φ at which the scheme's spectral radius passes one, less the exact one; the contact's stiffness is kept."""
    if report.critical is None or has_own_steps(setup.scheme):
        return None
    c, exact = setup.coefficients, report.critical.friction

    def excess(friction: float) -> float:
        at = c._replace(phi=friction)
        k = report.contact_stiffness
        return spectral_radius(at, setup.weights, setup.scheme, k, setup.belt_speed) - 1.0 - MARGIN

    frictions = [float(value) for value in np.linspace(0.0, 2.0 * exact, 9)]
    values = [excess(friction) for friction in frictions]
    if values[0] > 0.0:
        return -exact
    first = next((place for place in range(1, 9) if values[place] > 0.0), None)
    if first is None:
        return None
    return float(brentq(excess, frictions[first - 1], frictions[first], xtol=1e-12)) - exact


def _order(coarse: Entry, fine: Entry) -> float | None:
    """Observed order between two rungs: how the error falls with the step, or with the evaluations."""
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
