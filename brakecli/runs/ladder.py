"""The ladder of runs that keep a tolerance: steps and nodes are refined apart, each as far as is needed."""

import math
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from brakecli.runs.certificate import MISSED, ROUNDING, Certificate, Certified, Rounding, compare, replica
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.contact.pad import NODES, default_nodes
from brakecli.solver.motion import Motion
from brakecli.solver.system import System

FIRST_TURN = 15.0  # square of the turn (rad) of the fastest motion in a first step, over the tolerance
# Two halvings leave a sixth of the tolerance: (1/12, 10/12, 1/12) takes a sixth of that square off a velocity.
LONGEST_TURN = 0.4  # rad, in a first step
FIRST_PER_WAVE = 8.0  # first steps to a passing wave, at least
FINEST_FIRST = 4e-4  # tolerance from which on a quarter of the usual nodes is enough to begin with
MOST_SPARSE = 4  # halvings of a first step before it has reached the sample interval, at most
MOST_DOUBLINGS = 12  # of steps and nodes each
STEPS_BETWEEN_KNOTS = 4  # of speed or load, at least: with fewer, no run sees what happens there
SAFETY = 3.0  # what is promised, over what differences of runs say is left
JUMPS = 3.0  # what the estimate of steps is multiplied by where friction turns, or speed or load have knots
NEXT = 2.2  # time of a run with half the steps, or twice the nodes, over that of the last one
MOST_SECONDS = 900.0  # time of the loop after which no finer run is begun


@dataclass
class _Axis:
    """How often steps were halved, or nodes doubled, and what the last two times changed."""

    margin: ClassVar[float] = 1.0
    doublings: int = 0
    before: float = math.inf
    last: float = math.inf

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
        least = max(self.last, SAFETY * self.before / 12.0)
        return self.margin * max(least, SAFETY * self.last / (self.before / self.last - 1.0))


@dataclass
class _Nodes(_Axis):
    """The axis of quadrature nodes. Where edges of patches hardly move, no sum over positions evens errors out."""

    margin: ClassVar[float] = 2.0


def ladder(system: System) -> Generator[System, Motion, Certified]:
    """Runs with steps half as long, or twice the nodes: what is needed more.

    It yields what is to be run, receives its motion, and returns the last one with its certificate. The errors of
    steps and of nodes add up, and each is estimated apart. A replica of the first run shows what the motion makes
    of rounding, and up to when the promise can be kept. The first steps may pass over samples, the last ones may
    not, nor over what speed or load do between two knots, as no run would see it.
    """
    wanted = system.method.tolerance
    first, every = first_rung(system)
    longest = min(_shortest_span(system) / STEPS_BETWEEN_KNOTS, system.interval) * (1.0 + 1e-9)
    nodes = first_nodes(system)
    steps = _Axis()
    quadrature = _Nodes()
    before = None
    finer = steps
    seconds = 0.0
    rounding = Rounding(0.0, system.sampled_duration, wanted)
    steps_before = 0
    while True:
        rung = system.by(nodes=nodes << quadrature.doublings, step=first * 0.5**steps.doublings)
        rung = replace(rung, interval=max(1, every >> steps.doublings) * system.interval)
        beside = (yield replica(rung)) if before is None else None
        run = yield rung
        spent = run.work.solve_seconds
        failed = run.work.failed
        if beside:
            steps_before += beside.work.steps
            seconds = seconds + beside.work.solve_seconds
            failed = failed or beside.work.failed
            rounding = rounding if failed else Rounding.of(beside, run, wanted)
        run.work.solve_seconds = seconds = seconds + spent
        run.work.coarser_steps = steps_before
        steps_before = run.work.all_steps
        if before is not None and not failed:
            finer.before = finer.last
            finer.last = compare(before, run, rounding.until).error
        before = before if failed else run
        opens = set(run.work.evaluators) != {"closed-form"}
        used = quadrature if nodes and opens else _Axis(0, 0.0, 0.0)
        margin = JUMPS if run.work.turns or not system.steady else 1.0
        jump = _jump_error(run)
        error = math.inf if failed else margin * steps.error + used.error + jump
        short = run.system.step <= longest
        if kept := short and error <= rounding.left:
            break
        coarse = failed or not short or jump > 0.5 * rounding.left
        finer = steps if coarse or margin * steps.error >= used.error else quadrature
        late = run.system.interval == system.interval and seconds + NEXT * spent > MOST_SECONDS
        if finer.doublings == MOST_DOUBLINGS or late:
            break
        finer.doublings += 1
    error += rounding.error
    if not (certified := kept and error <= wanted):
        error = max(error, wanted * MISSED) if short and error < math.inf else 1.0
    with_nodes = f" and {run.system.nodes} nodes" if used is quadrature else ""
    finest = f"steps of {run.system.step:.3g} s{with_nodes}"
    how = f"{system.method.scheme} runs down to {finest}, and a replica of the first"
    return Certified(run, Certificate(wanted, certified, error, rounding.until if kept else 0.0, how))


def _shortest_span(system: System) -> float:
    """Between two knots of speed or load, s; infinite where there are none."""
    times = (each["time"] for each in (system.belt, system.load) if len(each) > 1)
    return min((float(np.diff(each).min()) for each in times), default=math.inf)


def _jump_error(run: Motion) -> float:
    """By how much ẋ may be off, relative to its largest value, as steps do not know when in them friction turns.

    Where it turns right behind a time that all rungs step on, they agree on what is wrong by up to this. A shoe
    that sticks for more than a step has the velocity of the wheel then, whenever in a step it began.
    """
    jump = 2.0 * run.system.coefficients.phi * run.work.crossing * run.system.step / run.system.coefficients.m
    fastest = float(np.abs(run.rows[:, 2]).max(initial=0.0)) if jump > 0.0 else 1.0
    return jump / fastest if fastest > 0.0 else math.inf


def first_rung(system: System) -> tuple[float, int]:
    """The steps (s) that a ladder begins with, and how many samples each passes over, a power of two."""
    interval = system.interval
    fastest = 2.0 * math.pi * max(system.natural_frequencies[1], 1e-300)
    wanted = min(LONGEST_TURN, math.sqrt(FIRST_TURN * system.method.tolerance)) / fastest
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
    return max(NODES, usual // 4) << finer
