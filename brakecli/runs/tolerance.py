"""Choose scheme, nodes and step so that the error of the histories stays below the requested tolerance.

The error is never taken from one run: two runs of different fineness are compared, and the finer one is the
answer. What they differ by is the error of the coarser one, so the answer is better than it is said to be.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from brakecli.runs.cost import evaluation_seconds
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.contact.pad import default_nodes
from brakecli.solver.motion import Motion, Progress, solve
from brakecli.solver.quantities import HISTORY
from brakecli.solver.system import System

FIRST_EVENT_TOLERANCE, LEAST_EVENT_TOLERANCE = 1e-6, 1e-13
EVENT_RATIO = 1e-2  # from one tolerance of the event-driven scheme to the next: its errors fall by about as much
EVENT_MARGIN = 1e-3  # largest first tolerance over the requested one: no event may be missed twice
LAYERED_FROM = 3e-4  # the layered schemes are cheaper from here on, where surfaces open: docs/accuracy.md
FIRST_STEPS = 40  # per period of the fastest motion, and per passing wave: a ladder of steps begins with them
MOST_RUNGS = 12
STEPS_BETWEEN_KNOTS = 4  # of speed or load, at least: with fewer, no run sees what happens there
WORTH_A_PILOT = 0.2  # guessed time (s) of the next run from which on it is weighed against event-driven runs
PILOT = 32  # duration of the case over that of the event-driven pilot run, which counts the work of such runs
# Time is guessed from counted work, not measured, so that a case gives the same bytes wherever it runs.
EVEN_CHANCE = 0.5  # beyond this part of the time of event-driven runs, a next run is likely not to be the last one
MOST_SECONDS = 900.0  # time of the loop after which no finer run is begun
SHORTER = 0.7  # step of the second of two piecewise-exact runs over that of the first
ROUNDING_MARGIN = 4.0  # the error of such a run over what two of them differ by, at most
ROUNDING = 1e-12  # least estimate: runs that share their rounding agree better than they are right


@dataclass(frozen=True)
class Certificate:
    """How far the histories may be off, and how that is known."""

    tolerance: float
    certified: bool
    estimated_error: float  # relative to the largest value of each of x, y, vx and vy
    certified_until: float  # s; up to here they keep the tolerance where they do not to the end
    method: str

    def sentence(self) -> str:
        """The certificate in words."""
        if self.certified:
            return f"error at most {self.estimated_error:.1e}, by {self.method}"
        kept = f"up to {self.certified_until:.4g} s they keep it"
        return f"{self.tolerance:g} cannot be certified: {self.method} give {self.estimated_error:.1e}; {kept}"


class Certified(NamedTuple):
    """A motion with its certificate; its `work` counts the last run, but `solve_seconds` those of all runs."""

    motion: Motion
    certificate: Certificate


def certify(system: System, progress: Progress = lambda samples: None) -> Certified:
    """Compute a motion to the tolerance of its method; `progress` receives the samples of the run in progress.

    Smooth surfaces go to the piecewise-exact scheme, rough ones that touch everywhere to the event-driven one, as
    their cost hardly depends on the error. Where surfaces open, the latter needs the exact contact integral, which
    is expensive: while friction does not jump, a ladder of steps and nodes of the two-layer scheme may be cheaper
    down to `LAYERED_FROM`. It is left where its next run takes long beside all the event-driven ones.
    """
    method = system.method
    if not method.own_steps:
        return _by_steps(system, progress)
    if method.row.exact:
        return _by_phases(system, progress)
    layered = replace(system, method=replace(method, scheme="two-layer", theta=(0.5, 0.5)))
    if not method.automatic or method.tolerance < LAYERED_FROM or not _opens_and_slides(layered, progress):
        return _by_events(system, progress)
    found = _by_steps(layered, progress, slower_than_events(system, progress))
    spent = found.motion.work.solve_seconds
    if found.certificate.certified or spent >= MOST_SECONDS:
        return found
    again = _by_events(system, progress)
    spent += again.motion.work.solve_seconds
    found = min(found, again, key=lambda each: each.certificate.estimated_error)
    found.motion.work.solve_seconds = spent
    return found


def _run(system: System, progress: Progress, **changes: Any) -> Motion:
    """The motion by the system's method with these changes."""
    system = replace(system, method=replace(system.method, **changes))
    per_sample = system.per_sample
    return solve(system, progress=lambda steps: progress(steps // per_sample))


def _opens_and_slides(system: System, progress: Progress) -> bool:
    """Whether the surfaces are rough and touch in part now and then, and friction never jumps, by a coarse run.

    Not where speed or load change with time, as steps would have to be short beside what they do.
    """
    if system.smooth or len(system.belt) > 1 or len(system.load) > 1:
        return False
    work = _run(system, lambda samples: progress(0), step=coarsest_step(system), nodes=0).work
    return set(work.evaluators) != {"closed-form"} and not work.turns


def slower_than_events(system: System, progress: Progress) -> Callable[[float], bool]:
    """A test whether a run of so many seconds takes too long beside two event-driven ones.

    A part of such a run is made when the test is first needed.
    """

    @cache
    def events() -> float:
        samples = max(1, system.samples // PILOT)
        part, tolerance = replace(system, duration=samples * system.interval), first_event_tolerance(system)
        found = _run(part, lambda samples: progress(0), tolerance=tolerance)
        seconds = _guessed_seconds(found) * system.samples / samples * (1.0 + EVENT_RATIO**-0.125)
        return math.inf if found.work.failed else seconds

    return lambda seconds: seconds > WORTH_A_PILOT and seconds > EVEN_CHANCE * events()


def _guessed_seconds(motion: Motion) -> float:
    """Time of the evaluations of a contact that is open in part; beside these, others cost nothing."""
    taken = motion.work.evaluators
    part = 1.0 - taken.get("closed-form", 0) / max(sum(taken.values()), 1)
    return float(part * motion.work.contact_evaluations * evaluation_seconds(motion.system))


def first_event_tolerance(system: System) -> float:
    """The tolerance of the first event-driven run."""
    # Two tolerances at least, as runs to the same one agree in any case.
    largest = min(FIRST_EVENT_TOLERANCE, EVENT_MARGIN * system.method.tolerance)
    return max(largest, LEAST_EVENT_TOLERANCE / EVENT_RATIO)


def _by_phases(system: System, progress: Progress) -> Certified:
    """Two piecewise-exact runs with different steps: they differ by what the motion makes of rounding.

    Where samples are close, a step of the second run passes over several of them.
    """
    wanted, run, longest = system.method.tolerance, _run(system, progress), SHORTER * system.longest_step
    every = max(n for n in range(1, 1 + max(1, int(longest / system.interval))) if system.samples % n == 0)
    share = min(1.0, run.system.step / system.longest_step) if every == 1 else 1.0
    sparse = replace(system, interval=every * system.interval, duration=system.sampled_duration)
    other = _run(sparse, lambda samples: None, share=SHORTER * share)
    run.work.solve_seconds += other.work.solve_seconds
    until, difference = _compare(replace(run, rows=run.rows[::every]), other, wanted / ROUNDING_MARGIN)
    error, failed = ROUNDING_MARGIN * difference, run.work.failed or other.work.failed
    how = f"piecewise-exact runs with steps of {run.system.step:.3g} and {other.system.step:.3g} s"
    return Certified(run, Certificate(wanted, error <= wanted and not failed, error, until, how))


def _by_events(system: System, progress: Progress) -> Certified:
    """Event-driven runs, each to a hundredth of the tolerance of the one before."""
    wanted, tolerance = system.method.tolerance, first_event_tolerance(system)
    run = _run(system, progress, tolerance=tolerance)
    while True:
        before, tolerance = run, max(EVENT_RATIO * tolerance, LEAST_EVENT_TOLERANCE)
        run = _run(system, progress, tolerance=tolerance)
        run.work.solve_seconds += before.work.solve_seconds
        until, error = _compare(before, run, wanted)
        failed, late = run.work.failed, run.work.solve_seconds > MOST_SECONDS
        if error <= wanted or failed or late or tolerance <= LEAST_EVENT_TOLERANCE:
            break
    how = f"event-driven runs to {tolerance / EVENT_RATIO:.0e} and {tolerance:.0e}"
    return Certified(run, Certificate(wanted, error <= wanted and not failed, error, until, how))


def _by_steps(
    system: System, progress: Progress, too_slow: Callable[[float], bool] = lambda seconds: False
) -> Certified:
    """Runs with steps half as long, and twice as many nodes, as those before.

    Differences that fall by a factor r from rung to rung leave an error of the last one over r - 1. Thrice that is
    the estimate, and at least thrice the last difference and three quarters of the one before: kinks and jumps
    make differences fall unevenly, and one that is small by luck must not pass. Nor must differences of runs that
    all step over what speed or load do between two knots.
    """
    method, wanted, step = system.method, system.method.tolerance, coarsest_step(system)
    longest = _shortest_span(system) / STEPS_BETWEEN_KNOTS * (1.0 + 1e-9)
    nodes = 0 if system.smooth else default_nodes(system.half_length, system.shoe, system.wheel)
    before: Motion | None = None
    last, seconds = math.inf, 0.0
    for rung in range(MOST_RUNGS):
        finer = nodes * 2**rung if EVALUATORS[method.evaluator].needs_nodes else 0
        run = _run(system, progress, step=step / 2**rung, nodes=finer)
        spent = run.work.solve_seconds
        run.work.solve_seconds = seconds = seconds + spent
        if before is not None and not run.work.failed and not before.work.failed:
            until, difference = _compare(before, run, wanted)
            error = max(_remaining(last, difference), _jump_error(run)) if run.system.step <= longest else math.inf
            last = difference
            if error <= wanted:
                how = f"{method.scheme} runs of {run.system.step * 2:.3g} and half of that"
                return Certified(run, Certificate(wanted, True, error, until, how))
            slower = spent * (4.5 if nodes else 2.2)
            if seconds + slower > MOST_SECONDS or too_slow(4.0 * _guessed_seconds(run)):
                break
        before = run
    seen = math.isfinite(last) and run.system.step <= longest
    error = max(3.0 * last, _jump_error(run), wanted * 1.0000001) if seen else 1.0
    how = f"the finest of {rung + 1} runs, with steps of {run.system.step:.3g} s,"
    return Certified(run, Certificate(wanted, False, error, 0.0, how))


def _shortest_span(system: System) -> float:
    """Between two knots of speed or load, s; infinite where there are none."""
    return min(float(np.diff(each["time"]).min(initial=math.inf)) for each in (system.belt, system.load))


def _jump_error(run: Motion) -> float:
    """By how much ẋ may be off, relative to its largest value, as steps do not know when in them friction jumps.

    Where a jump falls right behind a time that all rungs step on, they agree on what is wrong by up to this.
    """
    if not run.work.turns:
        return 0.0
    c, columns = run.system.coefficients, dict(zip(HISTORY, run.rows.T, strict=True))
    fastest = float(np.abs(columns["vx"]).max())
    jump = 2.0 * c.phi * float(columns["normal_force"].max()) * run.system.step / c.m
    return jump / fastest if fastest > 0.0 else math.inf


def _remaining(before: float, last: float) -> float:
    """The error that is left after two differences in a row."""
    if not math.isfinite(before) or last >= before:
        return math.inf
    return 3.0 * max(last, last / (before / last - 1.0), before / 4.0) if last > 0.0 else ROUNDING


def _compare(coarse: Motion, fine: Motion, tolerance: float) -> tuple[float, float]:
    """Until when (s) two runs differ by no more than the tolerance, and by how much they differ at most.

    What never exceeds the rounding of the motion does not count, as velocities of a shoe that stays where it is.
    """
    count, system = len(fine.rows), fine.system
    if len(coarse.rows) < count:
        return 0.0, 1.0
    one, other = coarse.rows[:count, :4], fine.rows[:, :4]  # x, y, vx, vy
    largest = np.abs(other).max(axis=0)
    rate = 2.0 * math.pi * system.natural_frequencies[1]
    rounding = ROUNDING * largest[:2].max() * np.array([1.0, 1.0, rate, rate])
    moves = np.maximum(np.abs(one).max(axis=0), largest) > rounding
    apart = (np.abs(one - other) / np.where(moves, np.maximum(largest, rounding), math.inf)).max(axis=1)
    late = np.flatnonzero(apart > tolerance)
    until: float = (int(late[0]) - 1 if len(late) else count - 1) * system.interval
    return max(until, 0.0), max(float(apart.max()), ROUNDING)


def coarsest_step(system: System) -> float:
    """The step (s) that a ladder begins with: a whole part of the sample interval."""
    interval = system.interval
    wanted = 1.0 / (FIRST_STEPS * max(system.natural_frequencies[1], system.passing_frequency, 1e-300))
    wanted = min(wanted, max(_shortest_span(system) / STEPS_BETWEEN_KNOTS, wanted / 2**MOST_RUNGS))
    return float(interval / max(1, math.ceil(interval / wanted)))
