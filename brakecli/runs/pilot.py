"""Measure what a case costs by beginning it: formulas cannot know how often friction and patches cut the steps."""

from dataclasses import replace
from time import process_time
from typing import NamedTuple

from brakecli.runs.cost import evaluation_seconds, start_seconds
from brakecli.runs.ladder import first_nodes, first_rung
from brakecli.runs.own_error import first_of
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.motion import Stepping
from brakecli.solver.system import System

SECONDS = 0.15
"""Processor time (s) after which a pilot run stops, at the end of its step. Other programs do not change it."""
MOST_EVALUATION, MOST_AT_NODES = 0.02, 2e-3
"""Guessed time (s) of an evaluation of the contact, exact and by nodes, beyond which no step is tried."""
FINER, RUNGS = 4, 16.0  # steps of the last run of a ladder, and time of all of its runs, over the first one's
FINER_FOUND, RUNGS_FOUND = 1.2, 1.7  # the same of runs that know their error: one or two
FEW = 20  # steps, the first of which are shorter than those that follow
SLOWER = 2.0
"""Evaluations for a second of motion in the latter half of a pilot run, over their mean, from which on the rest
may take more yet. They are counted: the seconds of a busy machine say nothing."""


class Price(NamedTuple):
    """What a case costs: steps of a run, seconds of all of its runs, and whether it may well be much more."""

    steps: int
    seconds: float
    at_least: bool


def measured(system: System) -> Price | None:
    """The cost of a case by a pilot run, or None where a single step may take too long."""
    if evaluation_seconds(system) > (MOST_EVALUATION if system.finds_patches else MOST_AT_NODES):
        return None
    method = system.method
    if method.step is not None or method.row.exact:
        return _begun(system)
    if not method.own_steps:
        return _ladder(system)
    found = _begun(first_of(system))
    return found._replace(steps=int(FINER_FOUND * found.steps), seconds=RUNGS_FOUND * found.seconds)


def _ladder(system: System) -> Price:
    """A ladder of steps and nodes, each refined twice at least."""
    method = replace(system.method, nodes=first_nodes(system), step=first_rung(system)[0])
    found = _begun(replace(system, method=method))
    return Price(FINER * found.steps, RUNGS * found.seconds, at_least=True)


def _begun(system: System) -> Price:
    """One run, begun and continued at the same pace."""
    own, slow_start = system.method.own_steps and not system.method.row.exact, start_seconds(system)
    if slow_start > SECONDS:  # a shoe that starts elsewhere moves as fast
        system = replace(system, initial=replace(system.initial, from_equilibrium=False))
    _ = system.scheme, system.evaluate  # compiled
    begin = process_time()
    stepping = Stepping(system)
    counts, state, ready, size = stepping.counts, stepping.plant.state, process_time(), 1
    first, last = int(counts.level), system.steps + stepping.scheme.LAG
    marks = [(0.0, 0.0, 0)]  # seconds spent, time that has been reached, and evaluations
    while counts.level < last and not stepping.work.failed and marks[-1][0] < SECONDS:
        stepping.block(min(last, int(counts.level) + size))
        reached = float(state.time + state.tau) if own else (counts.level - first) * system.step
        marks.append((process_time() - ready, reached, int(counts.evaluations)))
        size = 2 * size if marks[-1][0] < SECONDS / 8.0 else size
    steps, (seconds, reached, evaluated) = int(counts.kinds.sum()), marks[-1]
    start = ready - begin + (slow_start if slow_start > SECONDS else 0.0)
    if counts.level >= last or stepping.work.failed:
        return Price(steps, start + seconds, at_least=False)
    length = max(reached / steps, state.step if own and steps < FEW else 0.0)  # the first steps are short
    more = float(1.0 + (system.sampled_duration - reached) / max(length * steps, 1e-300))
    about = int(float(f"{min(steps * more, 1e300):.2g}")) if own else system.steps
    _, reached_before, before = max(mark for mark in marks if mark[0] <= 0.5 * seconds)
    slower = (evaluated - before) * reached > SLOWER * evaluated * (reached - reached_before)
    may_open = own and not system.smooth and int(counts.kinds[CLOSED_FORM]) == steps
    return Price(about, start + seconds * more, at_least=slower or may_open)
