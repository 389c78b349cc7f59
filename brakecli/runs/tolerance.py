"""Choose scheme, nodes and step so that the error of the histories stays below the requested tolerance.

Runs of different fineness are compared, and the finest one is the answer. What two of them differ by is the error
of the coarser one, so the answer is better than it is said to be. Only a run whose steps are exact knows its own
error, which is rounding.
"""

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from brakecli.runs.cost import evaluation_seconds
from brakecli.solver.compile import Floats
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.contact.pad import default_nodes
from brakecli.solver.motion import Motion, Progress, solve
from brakecli.solver.system import System

FIRST_EVENT_TOLERANCE, LEAST_EVENT_TOLERANCE = 1e-6, 1e-13
EVENT_RATIO = 1e-2  # from one tolerance of the event-driven scheme to the next: its errors fall by about as much
EVENT_MARGIN = 1e-3  # largest first tolerance over the requested one: no event may be missed twice
NODES_FROM = 1e-5  # tolerance from which on events with nodes may be cheaper than with the exact contact
FIRST_ON_NODES, NODES_RATIO = 0.2, 0.1  # first tolerance there over the requested one; from one to the next
FIRST_TURN = 15.0  # square of the turn (rad) of the fastest motion in a first step, over the tolerance
# Two halvings leave a sixth of the tolerance: (1/12, 10/12, 1/12) takes a sixth of that square off a velocity.
LONGEST_TURN = 0.4  # rad, in a first step
# In lanes errors grow with nearly the fourth power of such steps; two halvings leave a tenth of the tolerance.
FIRST_TURN_IN_LANES, LONGEST_TURN_IN_LANES = 60.0, 0.5
FIRST_PER_WAVE = 8.0  # first steps to a passing wave, at least
FINEST_FIRST = 4e-4  # tolerance from which on a quarter of the usual nodes is enough to begin with
MOST_SPARSE = 4  # halvings of a first step before it has reached the sample interval, at most
MOST_DOUBLINGS = 12  # of steps and nodes each
STEPS_BETWEEN_KNOTS = 4  # of speed or load, at least: with fewer, no run sees what happens there
JUMPS = 3.0  # what the estimate of steps is multiplied by where friction turns, or speed or load have knots
WORTH_A_PILOT = 1.0  # guessed time (s) of the next runs from which on they are weighed against event-driven ones
PILOT = 32  # duration of the case over that of the event-driven pilot run, which counts the work of such runs
# Time is guessed from counted work, not measured, so that a case gives the same bytes wherever it runs.
FIRST_BLOCK = 5e-3  # guessed time (s) of the first block of a run whose steps take one evaluation of the contact
MOST_SECONDS = 900.0  # time of the loop after which no finer run is begun
SHORTER = 0.7  # step of the second of two piecewise-exact runs over that of the first
ROUNDED_MARGIN = 20.0  # the error of a piecewise-exact run over the rounding that it has carried along, at most
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
    is expensive: nodes and local tolerances that are refined apart are cheaper there, unless that takes long, too.
    """
    method, spent = system.method, 0.0
    if not method.own_steps:
        return _by_steps(system, progress)
    if method.row.exact:
        return _by_phases(system, progress)
    found = list[Certified]()
    if method.automatic and method.tolerance >= NODES_FROM:
        is_left, on_nodes = slower_than_events(system, progress), replace(method, evaluator="midpoint")
        found = [_by_steps(replace(system, method=on_nodes), progress, is_left)]
        spent = found[0].motion.work.solve_seconds
    if not found or (not found[0].certificate.certified and spent < MOST_SECONDS):
        found.insert(0, _by_events(system, progress))
        spent += found[0].motion.work.solve_seconds
    best = min(found, key=lambda each: each.certificate.estimated_error)
    best.motion.work.solve_seconds = spent
    return best


def begins_with_steps(system: System) -> bool:
    """Whether steps and nodes that are refined apart may keep the tolerance."""
    method, changing = system.method, len(system.belt) > 1 or len(system.load) > 1
    chosen = method.automatic and method.own_steps and not method.row.exact
    return chosen and method.tolerance >= NODES_FROM and not changing


def _run(system: System, progress: Progress, **changes: Any) -> Motion:
    """The motion by the system's method with these changes."""
    return _solved(replace(system, method=replace(system.method, **changes)) if changes else system, progress)


def _solved(system: System, progress: Progress) -> Motion:
    per_sample, each = system.per_sample, evaluation_seconds(system) + 1e-6
    block = 1 if system.method.own_steps and not system.nodes else 1 + int(FIRST_BLOCK / each)
    return solve(system, progress=lambda steps: progress(steps // per_sample), first_block=block)


def _opens(run: Motion) -> bool:
    return set(run.work.evaluators) != {"closed-form"}


def slower_than_events(system: System, progress: Progress) -> Callable[[Motion, float], bool]:
    """A test whether runs of so many times the work of this one take longer than two with the exact contact.

    They do where the pad does not open. A part of such a run is made when the test is first needed: it has as many
    steps as the others. How often the contact is open in part, this run knows; beside its evaluations then, others
    cost nothing.
    """

    @cache
    def evaluations() -> float:
        samples = max(1, system.samples // PILOT)
        part, tolerance = replace(system, duration=samples * system.interval), first_event_tolerance(system)
        work = _run(part, lambda samples: progress(0), tolerance=tolerance).work
        number = work.contact_evaluations * system.samples / samples * (1.0 + EVENT_RATIO**-0.125)
        return math.inf if work.failed else number

    def too_slow(run: Motion, more: float) -> bool:
        taken = run.work.evaluators
        part = 1.0 - taken.get("closed-form", 0) / max(sum(taken.values()), 1)
        if part == 0.0:
            return True
        seconds = part * more * run.work.contact_evaluations * evaluation_seconds(run.system)
        return seconds > WORTH_A_PILOT and seconds > part * evaluations() * evaluation_seconds(system)

    return too_slow


def first_event_tolerance(system: System) -> float:
    """The tolerance of the first event-driven run."""
    # Two tolerances at least, as runs to the same one agree in any case.
    largest = min(FIRST_EVENT_TOLERANCE, EVENT_MARGIN * system.method.tolerance)
    return max(largest, LEAST_EVENT_TOLERANCE / EVENT_RATIO)


def _by_phases(system: System, progress: Progress) -> Certified:
    """A piecewise-exact run, whose only error is rounding: each step adds some to what it carries along.

    Where that may be too much, a second run with other steps shows what the motion makes of it. Where samples are
    close, a step of this run passes over several of them.
    """
    wanted, run, longest = system.method.tolerance, _run(system, progress), SHORTER * system.longest_step
    largest, carried = run.work.rounding or (np.zeros(4), np.zeros(4))
    error = max(ROUNDED_MARGIN * float((carried / _sizes(system, largest, largest)).max()), ROUNDING)
    if error <= wanted and not run.work.failed:
        how = f"the rounding of piecewise-exact steps of {run.system.step:.3g} s"
        return Certified(run, Certificate(wanted, True, error, system.sampled_duration, how))
    every = max(n for n in range(1, 1 + max(1, int(longest / system.interval))) if system.samples % n == 0)
    share = min(1.0, run.system.step / system.longest_step) if every == 1 else 1.0
    sparse = replace(system, interval=every * system.interval, duration=system.sampled_duration)
    other = _run(sparse, lambda samples: None, share=SHORTER * share)
    run.work.solve_seconds += other.work.solve_seconds
    until, difference = _compare(run, other, wanted / ROUNDING_MARGIN)
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


@dataclass
class _Axis:
    """How often steps were halved, or nodes doubled, and what the last two times changed."""

    growth: ClassVar[float] = 0.5  # power of the error's fall with which the work grows
    margin: ClassVar[float] = 1.0
    order: ClassVar[int] = 2  # with which errors fall at least
    doublings: int = 0
    before: float = math.inf
    last: float = math.inf

    @staticmethod
    def turn(tolerance: float) -> float:
        """By which angle (rad) the fastest motion turns in a first step."""
        return min(LONGEST_TURN, math.sqrt(FIRST_TURN * tolerance))

    @property
    def error(self) -> float:
        """Thrice the error that is left.

        Differences that fall by a factor r leave the last one over r - 1. They fall unevenly, and one that is
        small by luck must not pass: no less is left than the order makes of each of the last two. A single one
        says nothing: where no edge of a patch crosses the middle of a cell, twice the nodes give the same force.
        """
        if max(self.before, self.last) <= ROUNDING:
            return self.last
        if math.isinf(self.before) or self.last >= self.before:
            return math.inf
        fall = 2.0**self.order
        least = max(self.last, 3.0 * self.before / (fall * fall - fall))
        left = max(least, 3.0 * self.last / (self.before / self.last - 1.0))
        return self.margin * left

    def more(self, tolerance: float) -> float:
        """By how much the work is likely to grow until the error is below the tolerance."""
        return max(1.0, self.last / tolerance) ** self.growth if self.last < math.inf else 2.0


@dataclass
class InLanes(_Axis):
    """Of the steps of runs in lanes, whose errors fall with h³ at least."""

    growth: ClassVar[float] = 0.3
    order: ClassVar[int] = 3

    @staticmethod
    def turn(tolerance: float) -> float:
        """As of other steps, longer by the order."""
        return min(LONGEST_TURN_IN_LANES, math.sqrt(math.sqrt(FIRST_TURN_IN_LANES * tolerance)))


@dataclass
class _Nodes(_Axis):
    """Of quadrature nodes: where the edges of patches hardly move, no sum over many positions evens errors out."""

    margin: ClassVar[float] = 2.0


@dataclass
class _Tolerances(_Axis):
    """Of steps that are found: local tolerances, each a tenth of the one before."""

    growth: ClassVar[float] = 0.2

    @property
    def error(self) -> float:
        """What the last two runs differ by, which is the error of the coarser one."""
        return self.last


def _by_steps(
    system: System, progress: Progress, is_left: Callable[[Motion, float], bool] = lambda run, more: False
) -> Certified:
    """The runs of a ladder, one after the other."""
    runs = ladder(system, is_left)
    rung = next(runs)
    while True:
        try:
            rung = runs.send(_solved(rung, progress))
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]


def ladder(
    system: System,
    is_left: Callable[[Motion, float], bool] = lambda run, more: False,
    kind: type[_Axis] = _Axis,
) -> Generator[System, Motion, Certified]:
    """Runs with steps half as long, or a tenth of the local tolerance, or twice the nodes: what is needed more.

    It yields what is to be run, receives its motion, and returns the last one with its certificate. The errors of
    steps and of nodes add up, and each is estimated apart. The first steps may pass over samples, the last ones
    may not, nor over what speed or load do between two knots, as no run would see it.
    """
    wanted, events = system.method.tolerance, system.method.own_steps
    (first, every), fineness = first_rung(system, kind), "tolerance" if events else "step"
    longest = min(_shortest_span(system) / STEPS_BETWEEN_KNOTS, system.interval) * (1.0 + 1e-9)
    nodes, steps, quadrature = first_nodes(system), _Tolerances() if events else kind(), _Nodes()
    before, finer, seconds = None, steps, 0.0
    while True:
        interval = max(1, every >> steps.doublings) * system.interval
        at = first * (NODES_RATIO if events else 0.5) ** steps.doublings
        changes: dict[str, Any] = {"nodes": nodes << quadrature.doublings, fineness: at}
        run = yield replace(system, interval=interval, method=replace(system.method, **changes))
        spent, failed = run.work.solve_seconds, run.work.failed
        run.work.solve_seconds = seconds = seconds + spent
        if before is not None and not failed:
            finer.before, finer.last = finer.last, _compare(before, run, wanted)[1]
        before = before if failed else run
        used = quadrature if nodes and _opens(run) else _Axis(0, 0.0, 0.0)
        margin = JUMPS if not events and (run.work.turns or len(system.belt) + len(system.load) > 2) else 1.0
        jump = _jump_error(run)
        error = math.inf if failed else margin * steps.error + used.error + jump
        short = events or run.system.step <= longest
        if certified := short and error <= wanted:
            break
        coarse = failed or not short or jump > 0.5 * wanted
        finer = steps if coarse or margin * steps.error >= used.error else quadrature
        late = run.system.interval == system.interval and seconds + 2.2 * spent > MOST_SECONDS
        more = 2.0 * steps.more(0.5 * wanted / margin) * used.more(0.5 * wanted)
        if finer.doublings == MOST_DOUBLINGS or late or is_left(run, more):
            break
        finer.doublings += 1
    until = system.sampled_duration if certified else 0.0
    if not certified:
        error = max(error, wanted * 1.0000001) if short and error < math.inf else 1.0
    with_nodes = f" and {run.system.nodes} nodes" if used is quadrature else ""
    finest = f"local tolerances of {at:.0e}" if events else f"steps of {run.system.step:.3g} s"
    how = f"{system.method.scheme} runs down to {finest}{with_nodes}"
    return Certified(run, Certificate(wanted, certified, error, until, how))


def _shortest_span(system: System) -> float:
    """Between two knots of speed or load, s; infinite where there are none."""
    return min(float(np.diff(each["time"]).min(initial=math.inf)) for each in (system.belt, system.load))


def _jump_error(run: Motion) -> float:
    """By how much ẋ may be off, relative to its largest value, as steps do not know when in them friction turns.

    Where it turns right behind a time that all rungs step on, they agree on what is wrong by up to this. A shoe
    that sticks for more than a step has the velocity of the wheel then, whenever in a step it began.
    """
    jump = 2.0 * run.system.coefficients.phi * run.work.crossing * run.system.step / run.system.coefficients.m
    fastest = float(np.abs(run.rows[:, 2]).max(initial=0.0))
    return jump / fastest if fastest > 0.0 else math.inf if jump > 0.0 else 0.0


def _compare(coarse: Motion, fine: Motion, tolerance: float) -> tuple[float, float]:
    """Until when (s) two runs differ by no more than the tolerance, and by how much they differ at most.

    What never exceeds the rounding of the motion does not count, as velocities of a shoe that stays where it is.
    """
    system = max(coarse.system, fine.system, key=lambda each: each.interval)
    one, other = (
        each.rows[:: round(system.interval / each.system.interval), :4].T.copy() for each in (coarse, fine)
    )
    count = other.shape[1]
    if one.shape[1] < count:
        return 0.0, 1.0
    one = one[:, :count]  # x, y, vx, vy
    sizes, apart = _sizes(system, *(np.abs(each).max(axis=1) for each in (one, other))), np.abs(one - other)
    error = float((apart.max(axis=1) / sizes).max())
    late = np.flatnonzero((tolerance * sizes < apart.T).any(axis=1)) if error > tolerance else np.zeros(0)
    until: float = (int(late[0]) - 1 if len(late) else count - 1) * system.interval
    return max(until, 0.0), max(error, ROUNDING)


def _sizes(system: System, one: Floats, other: Floats) -> Floats:
    """The largest x, y, vx and vy of the latter of two runs; infinite where both are rounding, as at rest."""
    rate = 2.0 * math.pi * system.natural_frequencies[1]
    rounding = ROUNDING * other[:2].max() * np.array([1.0, 1.0, rate, rate])
    return np.where(np.maximum(one, other) > rounding, np.maximum(other, rounding), math.inf)


def first_rung(system: System, kind: type[_Axis] = _Axis) -> tuple[float, int]:
    """The steps (s) that a ladder begins with, and how many samples each passes over, a power of two.

    Where steps are found it is the local tolerance that the ladder begins with.
    """
    if system.method.own_steps:
        return FIRST_ON_NODES * system.method.tolerance, 1
    interval, fastest = system.interval, 2.0 * math.pi * max(system.natural_frequencies[1], 1e-300)
    wanted = kind.turn(system.method.tolerance) / fastest
    wanted = min(wanted, 1.0 / (FIRST_PER_WAVE * max(system.passing_frequency, 1e-300)))
    wanted = min(wanted, max(_shortest_span(system) / STEPS_BETWEEN_KNOTS, wanted / 2**MOST_DOUBLINGS))
    if interval > wanted:
        return float(interval / math.ceil(interval / wanted)), 1
    every = 2 ** int(min(MOST_SPARSE, math.log2(min(wanted / interval, system.samples))))
    return every * interval, every


def first_nodes(system: System) -> int:
    """The nodes that a ladder begins with, which hardly resolve the shortest wave; 0 where none are needed."""
    if system.smooth or not EVALUATORS[system.method.evaluator].needs_nodes:
        return 0
    usual = default_nodes(system.half_length, system.shoe, system.wheel)
    finer = max(0, int(0.5 * math.log2(FINEST_FIRST / system.method.tolerance)))
    return max(64, usual // 4) << finer
