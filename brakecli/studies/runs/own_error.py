"""Runs that know their own error: one is made and, while its error is too large, one as much finer as it says.

The error is carried along with the motion, that of steps and that of nodes apart (`motion.errors`). A run
that is too coarse says how fine the next one has to be, and one that is fine enough needs no other.
"""

import math
from collections.abc import Callable, Generator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.contact.pad import NODES
from brakecli.solver.integrate import Motion
from brakecli.solver.quantities import Failure
from brakecli.solver.system import MOST_TABLE_BYTES, System
from brakecli.studies.runs.certificate import MISSED, ROUNDING, Certificate, Certified, displacement, sizes
from brakecli.studies.runs.first import FIRST, ORDER_OF_NODES, first_nodes
from brakecli.studies.runs.work import FINEST, evaluation_work, work_done

SAFETY = 1.5
"""What is promised, over the error that a run knows; `make statistics` compares that with true ones."""
MOST_WORK = 900.0
"""Work of all runs, as `runs.work` counts it, after which no finer one is begun; a choice."""
AIM = 0.4
"""Part of the promise that a finer run leaves to steps, and to nodes."""
_MOST_RUNS = 8
_EXACT = 3.0  # evaluations of the exact contact for one by nodes, as steps are shorter and of higher order


Finer = Callable[[System, float, float], System | None]
"""Makes a finer run of which errors by steps and by nodes are less by these factors; None where there is none."""


class Known(NamedTuple):
    """The error that a run knows, relative to the largest values of x, y, vx and vy."""

    of: Floats  # in each span of the run: by steps, by nodes, and both
    unsure: float  # s, from which on it may be another, as an event may have been missed; infinite where none

    @classmethod
    def of_run(cls, run: Motion) -> "Known":
        """What a run has carried along."""
        assert run.own is not None
        largest = np.abs(run.rows[:, :4]).max(axis=0, initial=0.0)
        size = sizes(run.system, largest, largest)
        with np.errstate(invalid="ignore"):  # nothing moves where a size is infinite
            of = np.where(np.isfinite(size), run.own.worst / size, 0.0)
        return cls(of.max(axis=2), run.own.unsure)

    def by_nodes(self, fraction: float) -> float:
        """The largest error by nodes in a part of the run, from its start on."""
        spans = len(self.of)
        return float(self.of[: math.ceil(min(fraction, 1.0) * spans), 1].max(initial=0.0))

    def until(self, limit: float, duration: float) -> float:
        """Up to when (s) it is surely below a limit."""
        over = np.flatnonzero(~(self.of[:, 2] <= limit))
        spans = len(self.of)
        return min(duration, self.unsure, duration * (int(over[0]) if len(over) else spans) / spans)


def by_own_error(system: System) -> Generator[System, Motion, Certified]:
    """Event-driven runs to the tolerance of a method, see `promised`.

    On nodes, where the method leaves that open, unless so many were needed that the exact contact is cheaper.
    """
    return promised(system, first_of(system), partial(_finer, system))


def last_of(runs: Generator[System, Motion, Certified], run: Callable[[System], Motion]) -> Certified:
    """What comes of runs that are made one after the other."""
    rung = next(runs)
    while True:
        try:
            rung = runs.send(run(rung))
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]


def promised(
    system: System, rung: System, finer: Finer, safety: float = SAFETY
) -> Generator[System, Motion, Certified]:
    """Runs, each of which says how fine the next one has to be; the first one is given.

    It yields what is to be run, receives its motion, and returns the last one with its certificate. `safety` is
    what is promised, over the error that a run knows.
    """
    wanted = system.method.tolerance
    duration = system.sampled_duration
    seconds = 0.0
    counted = 0.0
    steps_before = 0
    most = 2.0 * wanted / safety  # by steps; a run ends early beyond, as a finer one has to follow anyway
    for remaining in range(_MOST_RUNS, 0, -1):
        most = most if remaining > 1 else math.inf
        motion = yield replace(rung, most_error=most)
        seconds += motion.work.solve_seconds
        counted += work_done(motion.system, motion.work)
        motion.work.coarser_steps = steps_before
        steps_before = motion.work.all_steps
        errors = Known.of_run(motion)
        steps, by_nodes, both = errors.of.max(axis=0).tolist()
        coarse = most < math.inf and motion.work.failure is Failure.COARSE
        reached = float(motion.work.failure_time or 0.0) if coarse else duration
        error = max(safety * both, ROUNDING)
        failed = motion.work.failed and not coarse
        until = errors.until(wanted / safety, duration)
        certified = not (failed or coarse) and error <= wanted and until >= duration
        late = counted > MOST_WORK
        if certified or failed or most == math.inf or (late and not coarse):
            break
        surer = 0.03 if errors.unsure < duration else math.inf  # a choice where an event may have been missed
        aim = min(AIM * wanted / safety, surer * both)
        factor = 1.0
        if coarse:  # errors of steps add up, those of nodes at random; half the aim, as that is a guess
            aim = 0.5 * aim
            factor = duration / reached
        finer_rung = None
        if not late:
            finer_rung = finer(rung, max(1.0, factor * steps / aim), max(1.0, factor**0.5 * by_nodes / aim))
        if finer_rung is None and not coarse:
            break
        most = math.inf if finer_rung is None else most  # nothing finer helps: the whole of it is worth having
        rung = finer_rung or rung
    motion.work.solve_seconds = seconds
    if not certified:
        error = max(error, wanted * MISSED) if error < np.inf else 1.0
    method = rung.method
    with_nodes = f" and {rung.nodes} nodes" if rung.nodes else ""
    steps_of = f"to {method.tolerance:.0e}" if method.own_steps else f"of {rung.step:.3g} s"
    assert motion.own is not None
    certificate = Certificate(
        tolerance=wanted,
        certified=certified,
        estimated_error=error,
        certified_until=until if not failed else 0.0,
        method=f"the error that is carried along with steps {steps_of}{with_nodes}",
        by_steps=safety * steps,
        by_nodes=safety * by_nodes,
        amplification=motion.own.amplification,
    )
    return Certified(motion, certificate)


def _finer(system: System, rung: System, steps: float, by_nodes: float) -> System | None:
    """A finer event-driven run, to a thousandth of the tolerance at least, with 8 times as many nodes at most."""
    at = rung.method
    if at.tolerance < 1e-3 * FINEST * steps:  # no run has such a tolerance, though errors may fall faster than it
        return None
    tolerance = max(at.tolerance * max(1.0 / steps, 1e-3), FINEST)
    more = min(by_nodes ** (1.0 / ORDER_OF_NODES), 8.0)
    run = _run(system, tolerance, NODES * -int(-rung.nodes * more // NODES))
    return run if run.method != at else None


def first_of(system: System) -> System:
    """The first run."""
    return _run(system, FIRST * system.method.tolerance, 2 * first_nodes(_on_nodes(system)))


def _run(system: System, tolerance: float, nodes: int) -> System:
    """A run to a tolerance on nodes, or with the exact contact where that is cheaper, or without nodes."""
    exact = replace(system.by(tolerance=tolerance), start_error=displacement(system))
    on_nodes = _on_nodes(exact.by(nodes=nodes)) if nodes else exact
    return exact if exact_is_cheaper(on_nodes, system) else on_nodes


def exact_is_cheaper(on_nodes: System, system: System) -> bool:
    """Whether so many nodes cost more than the exact contact, if the latter finds patches at all."""
    if not system.finds_patches:
        return False
    dear = evaluation_work(on_nodes) > _EXACT * evaluation_work(system)
    return dear or on_nodes.table_bytes > MOST_TABLE_BYTES


def _on_nodes(system: System) -> System:
    """The system with its contact on nodes, where the method leaves that open."""
    return system.by(evaluator="cells") if system.method.automatic and not system.smooth else system
