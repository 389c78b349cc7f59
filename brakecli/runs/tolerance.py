"""A run that keeps its promise: scheme, evaluator, nodes and step by the error that the histories may have.

The error is never taken from one run: two runs of different fineness are compared, and the finer one is the
answer. What they differ by is the error of the coarser one, so the answer is better than it is said to be.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.discrete import natural_frequencies
from brakecli.case.case import Case, Evaluator, Scheme, changed
from brakecli.case.system import Setup, set_up
from brakecli.runs.limits import evaluation_seconds
from brakecli.solver.contact.pad import default_nodes
from brakecli.solver.energy import EnergyAccount
from brakecli.solver.motion import Motion, Work
from brakecli.solver.quantities import HISTORY, Failure

FIRST_EVENT_TOLERANCE, LEAST_EVENT_TOLERANCE = 1e-6, 1e-13
EVENT_RATIO = 1e-2
"""From one tolerance of the event-driven scheme to the next: its errors fall by about as much."""
EVENT_MARGIN = 1e-3
"""The coarser tolerance is at most this part of the promise: an event that is missed must not be missed twice."""
LAYERED_FROM = 3e-4
"""Promises from which on the layered schemes are cheaper, where surfaces open: docs/accuracy.md."""
FIRST_STEPS = 40
"""Steps per period of the fastest motion, and per passing wave, that a ladder of steps begins with."""
MOST_RUNGS = 12
STEPS_BETWEEN_KNOTS = 4
"""Steps that what speed or load do between two knots takes at least, to be seen."""
WORTH_A_PILOT = 0.2
"""A finer run of the ladder that is guessed to take longer (s) is weighed against event-driven ones …"""
PILOT = 32
"""… of which one over this part of the motion is made to count its work …"""
EVEN_CHANCE = 0.5
"""… and is not begun beyond this part of their time: as likely as not it would not be the last one.

Time is guessed from counted work, not measured: the same case is to give the same bytes wherever it runs.
"""
MOST_SECONDS = 900.0
"""Time of the loop after which no finer run is begun."""

ROUNDING = 1e-12
"""No estimate is below this: runs that share their rounding agree better than they are right."""
_COLUMNS = {name: index for index, name in enumerate(HISTORY)}
_MOTION = 4  # x, y, vx, vy: the first columns of a sample


@dataclass(frozen=True)
class Certificate:
    """What a tolerance has come to.

    `estimated_error`: how far the histories may be off, relative to the largest value of each of x, y, vx and vy.
    `certified_until` (s): up to here they keep the promise where they do not to the end.
    """

    tolerance: float
    certified: bool
    estimated_error: float
    certified_until: float
    method: str
    runs: int

    def sentence(self) -> str:
        """The certificate in words."""
        if self.certified:
            return f"error at most {self.estimated_error:.1e}, by {self.method}"
        return (
            f"{self.tolerance:g} cannot be certified: {self.method} give {self.estimated_error:.1e}; up to "
            f"{self.certified_until:.4g} s they keep it"
        )


@dataclass(frozen=True)
class Certified:
    """A motion with its certificate; `setup` is that of the run which is the answer, and so are its numbers.

    `work` counts that run alone, but its `solve_seconds` are those of all runs together.
    """

    setup: Setup
    rows: NDArray[np.float64]
    work: Work
    energy: EnergyAccount
    certificate: Certificate


@dataclass(frozen=True)
class _Run:
    setup: Setup
    rows: NDArray[np.float64]
    work: Work
    energy: EnergyAccount


Tell = Callable[[int], None]


def certify(case: Case, progress: Tell = lambda samples: None) -> Certified:
    """Compute a case to the error that it promises; `progress` is told the samples of the run in progress.

    Smooth surfaces, and rough ones that touch everywhere, go to the event-driven scheme, whose cost hardly
    depends on the error. Where surfaces open, that scheme needs the exact contact integral, which is dear: while
    friction does not jump, a ladder of steps and nodes of the two-layer scheme may be cheaper down to
    `LAYERED_FROM`. It is left where its next run takes long beside all the event-driven ones.
    """
    promise = case.solver.effective_tolerance
    assert promise is not None
    scheme = case.solver.scheme
    if scheme is Scheme.AUTO:
        if promise < LAYERED_FROM or not _opens_and_slides(case, progress):
            return _by_events(case, promise, progress)
        found = _by_steps(case, promise, progress, _dearer_than_events(case, promise, progress))
        if not found.certificate.certified and found.work.solve_seconds < MOST_SECONDS:
            again, spent = _by_events(case, promise, progress), found.work.solve_seconds
            found = min(found, again, key=lambda each: each.certificate.estimated_error)
            found.work.solve_seconds = spent + again.work.solve_seconds
        return found
    if scheme is Scheme.EVENT_DRIVEN:
        return _by_events(case, promise, progress)
    return _by_steps(case, promise, progress)


def _opens_and_slides(case: Case, progress: Tell) -> bool:
    """Whether the surfaces are rough and touch in part now and then, and friction never jumps, by a coarse run.

    Not where speed or load change with time, as steps would have to be short beside what they do.
    """
    setup = set_up(case)
    if setup.smooth or len(setup.belt.times) > 1 or len(setup.load.times) > 1:
        return False
    step, interval = _coarsest(setup)
    pilot = _run(_stepped(case, step, interval, 0), lambda samples: progress(0))
    return set(pilot.work.evaluators) != {"closed-form"} and not pilot.work.turns


def _dearer_than_events(case: Case, promise: float, progress: Tell) -> Callable[[float], bool]:
    """Tells whether a run takes too long beside two event-driven ones, a part of which is run when first asked."""

    @cache
    def events() -> float:
        timing = set_up(case).timing
        samples = max(1, timing.samples // PILOT)
        pilot = changed(
            _event_case(case, _first_event_tolerance(promise)), solver={"duration": samples * timing.interval}
        )
        found = _run(pilot, lambda samples: progress(0))
        if found.work.failure is not Failure.NONE:
            return math.inf
        return float(_guessed_seconds(found) * timing.samples / samples * (1.0 + EVENT_RATIO**-0.125))

    return lambda seconds: seconds > WORTH_A_PILOT and seconds > EVEN_CHANCE * events()


def _guessed_seconds(run: _Run) -> float:
    """Of the evaluations of a contact that is open in part, beside which others cost nothing."""
    taken = run.work.evaluators
    part = 1.0 - taken.get("closed-form", 0) / max(sum(taken.values()), 1)
    return float(part * run.work.contact_evaluations * evaluation_seconds(run.setup))


def _first_event_tolerance(promise: float) -> float:
    # Two tolerances at least, as runs to the same one agree in any case.
    return max(min(FIRST_EVENT_TOLERANCE, EVENT_MARGIN * promise), LEAST_EVENT_TOLERANCE / EVENT_RATIO)


def _by_events(case: Case, promise: float, progress: Tell) -> Certified:
    """Event-driven runs, each to a hundredth of the tolerance of the one before."""
    tolerance = _first_event_tolerance(promise)
    before: _Run | None = None
    seconds, runs = 0.0, 0
    while True:
        tolerance = max(tolerance, LEAST_EVENT_TOLERANCE)
        run = _run(_event_case(case, tolerance), progress)
        seconds, runs = seconds + run.work.solve_seconds, runs + 1
        if before is not None:
            until, error = _compare(before, run, promise)
            failed = run.work.failure is not Failure.NONE
            if error <= promise or failed or tolerance <= LEAST_EVENT_TOLERANCE or seconds > MOST_SECONDS:
                method = f"event-driven runs to {tolerance / EVENT_RATIO:.0e} and {tolerance:.0e}"
                kept = error <= promise and not failed
                return _answer(run, Certificate(promise, kept, error, until, method, runs), seconds)
        before, tolerance = run, EVENT_RATIO * tolerance


def _by_steps(
    case: Case, promise: float, progress: Tell, dear: Callable[[float], bool] = lambda seconds: False
) -> Certified:
    """Runs with steps half as long, and twice as many nodes, as those before.

    Differences that fall by a factor r from rung to rung leave an error of the last one over r - 1. Thrice that is
    the estimate, and at least thrice the last difference and three quarters of the one before: kinks and jumps
    make differences fall unevenly, and one that is small by luck must not pass. Nor must differences of runs that
    all step over what speed or load do between two knots.
    """
    setup = set_up(case)
    longest = _shortest_span(setup) / STEPS_BETWEEN_KNOTS * (1.0 + 1e-9)
    step, interval = _coarsest(setup)
    nodes = 0 if setup.smooth else default_nodes(case.contact.half_length, setup.shoe, setup.wheel)
    before: _Run | None = None
    last = math.inf
    seconds, runs = 0.0, 0
    for rung in range(MOST_RUNGS):
        run = _run(_stepped(case, step / 2**rung, interval, nodes * 2**rung), progress)
        seconds, runs = seconds + run.work.solve_seconds, runs + 1
        if before is not None and run.work.failure is before.work.failure is Failure.NONE:
            until, difference = _compare(before, run, promise)
            error = max(_remaining(last, difference), _unseen(run))
            if run.setup.timing.step > longest:
                error = math.inf
            last = difference
            method = f"{run.setup.case.solver.scheme} runs of {run.setup.timing.step * 2:.3g} and half of that"
            if error <= promise:
                return _answer(run, Certificate(promise, True, error, until, method, runs), seconds)
            slower = 4.5 * run.work.solve_seconds if nodes else 2.2 * run.work.solve_seconds
            if seconds + slower > MOST_SECONDS or dear(4.0 * _guessed_seconds(run)):
                break
        before = run
    seen = math.isfinite(last) and run.setup.timing.step <= longest
    error = max(3.0 * last, _unseen(run), promise * 1.0000001) if seen else 1.0
    method = f"the finest of {runs} runs, with steps of {run.setup.timing.step:.3g} s,"
    return _answer(run, Certificate(promise, False, error, 0.0, method, runs), seconds)


def _shortest_span(setup: Setup) -> float:
    """Between two knots of speed or load, s; infinite where there are none."""
    return min(float(np.diff(each.times).min(initial=math.inf)) for each in (setup.belt, setup.load))


def _unseen(run: _Run) -> float:
    """By how much ẋ may be off, relative to its largest value, as steps do not know when in them friction jumps.

    Where a jump falls right behind a time that all rungs step on, they agree on what is wrong by up to this.
    """
    if not run.work.turns:
        return 0.0
    c, fastest = run.setup.coefficients, float(np.abs(run.rows[:, _COLUMNS["vx"]]).max())
    jump = 2.0 * c.phi * float(run.rows[:, _COLUMNS["normal_force"]].max()) * run.setup.timing.step / c.m
    return jump / fastest if fastest > 0.0 else math.inf


def _remaining(before: float, last: float) -> float:
    """The error that is left after two differences in a row."""
    if not math.isfinite(before) or last >= before:
        return math.inf
    return 3.0 * max(last, last / (before / last - 1.0), before / 4.0) if last > 0.0 else ROUNDING


def _answer(run: _Run, certificate: Certificate, seconds: float) -> Certified:
    run.work.solve_seconds = seconds
    return Certified(run.setup, run.rows, run.work, run.energy, certificate)


def _compare(coarse: _Run, fine: _Run, promise: float) -> tuple[float, float]:
    """Until when (s) two runs differ by no more than the promise, and by how much they differ at most.

    What never exceeds the rounding of the motion does not count, as velocities of a shoe that stays where it is.
    """
    count = min(len(coarse.rows), len(fine.rows))
    if count < len(fine.rows):
        return 0.0, 1.0
    one, other = coarse.rows[:, :_MOTION], fine.rows[:, :_MOTION]
    largest, setup = np.abs(other).max(axis=0), fine.setup
    rate = 2.0 * math.pi * natural_frequencies(setup.coefficients, setup.contact_stiffness)[1]
    rounding = ROUNDING * largest[:2].max() * np.array([1.0, 1.0, rate, rate])
    moves = np.maximum(np.abs(one).max(axis=0), largest) > rounding
    apart = (np.abs(one - other) / np.where(moves, np.maximum(largest, rounding), math.inf)).max(axis=1)
    late = np.flatnonzero(apart > promise)
    until = (int(late[0]) - 1 if len(late) else count - 1) * fine.setup.timing.interval
    return max(until, 0.0), max(float(apart.max()), ROUNDING)


def _coarsest(setup: Setup) -> tuple[float, float]:
    """The step (s) that a ladder begins with, and the sample interval."""
    interval = setup.timing.interval
    fast = natural_frequencies(setup.coefficients, setup.contact_stiffness)[1]
    speed = float(np.abs(setup.belt.values).max())
    passing = speed * float(max(setup.wheel.turns, default=0.0))
    wanted = 1.0 / (FIRST_STEPS * max(fast, passing, 1e-300))
    wanted = min(wanted, max(_shortest_span(setup) / STEPS_BETWEEN_KNOTS, wanted / 2**MOST_RUNGS))
    return interval / max(1, math.ceil(interval / wanted)), interval


def _stepped(case: Case, step: float, interval: float, nodes: int) -> Case:
    """The case with a step; a scheme that is to be chosen is two-layer."""
    scheme = case.solver.scheme
    chosen = {"scheme": Scheme.TWO_LAYER, "theta": (0.5, 0.5)} if scheme is Scheme.AUTO else {}
    exact = case.contact.evaluator is Evaluator.EXACT
    return changed(
        case,
        solver={"step": step, "tolerance": None, **chosen},
        contact={"nodes": None if exact or not nodes else nodes},
        output={"sample_interval": interval},
    )


def _event_case(case: Case, tolerance: float) -> Case:
    return changed(case, solver={"scheme": Scheme.EVENT_DRIVEN, "theta": (), "tolerance": tolerance})


def _run(case: Case, progress: Tell) -> _Run:
    setup = set_up(case)
    blocks: list[NDArray[np.float64]] = []
    per_sample = setup.timing.per_sample
    work, energy = Motion(setup).run(
        lambda rows: blocks.append(rows.copy()), lambda steps: progress(steps // per_sample)
    )
    return _Run(setup, np.concatenate(blocks), work, energy)
