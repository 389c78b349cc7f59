"""A difference scheme is held against one motion that knows its own error: the reference.

What a run differs by from the reference, and the error of the reference, add up to no less than the error of the
run. So its step is made finer until that is less than what was promised.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from brakecli.solver.contact.pad import NODES
from brakecli.solver.integrate import Motion, Work, solve
from brakecli.solver.method import Method
from brakecli.solver.roughness import turned
from brakecli.solver.system import MOST_TABLE_BYTES, Initial, System
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import Track
from brakecli.studies.runs.certificate import MISSED, NOTHING, Certificate, Certified, compare, displacement
from brakecli.studies.runs.first import FIRST, ORDER_OF_NODES, first_nodes, first_step
from brakecli.studies.runs.own_error import MOST_WORK, SAFETY, Known, first_of
from brakecli.studies.runs.work import FINEST, evaluation_work, work_done

PART = 0.1
"""Error of the reference over the promised one."""
MOST_RUNS = 5
"""Runs of the scheme, at most."""
AIM = 0.5
"""Part of the promise that the next run leaves to its steps,"""
AIM_OF_NODES = 0.25
"""and to its nodes. With that of the reference, 0.15 is left for what the order does not foresee."""
MOST = 32.0
"""By what a step becomes shorter from one run to the next, at most; a choice, as the order says nothing of large
errors."""
FAILED = 4.0
"""By what it becomes shorter where a run has failed; a choice."""


def reference_of(system: System) -> System:
    """The run that a difference scheme is held against."""
    scheme = "piecewise-exact" if system.smooth else "event-driven"
    tolerance = max(PART * system.method.tolerance, FINEST)
    method = Method(scheme, tolerance=tolerance, automatic=True)
    return replace(system, method=method, tracked=False)


def exponent_of(system: System, track: Track) -> Exponent | None:
    """The exponent beside the history of a difference scheme, which carries no disturbance along.

    It is that of the motion of the equations from the state that the history has reached at its half, for as long
    as the history lasts: what the scheme made of the way there is not asked again. Its tolerance is a choice, as
    rates of growth swing by far more from one part of a run to the next.
    """
    half = len(track.times) // 2
    x, y, v_x, v_y = track.states[half].tolist()
    reached = Initial(x=x, y=y, vx=v_x, vy=v_y)
    wheel = turned(system.wheel, system.belt_speed * float(track.times[half]))
    precise = system.by(step=None, tolerance=1e-3 / PART)
    return solve(first_of(reference_of(replace(precise, initial=reached, wheel=wheel)))).exponent


class _Tried(NamedTuple):
    """A run with its step (s) and its error."""

    step: float
    error: float


def against(system: System, reference: Certified, run: Callable[[System], Motion]) -> Certified:
    """Runs of a difference scheme, each as much finer as the reference shows; the last one with its certificate.

    Where the reference itself is not known to the end, the promise is to be kept as long as it is. `run` makes a
    run.
    """
    wanted = system.method.tolerance
    exact, promise = reference
    until = promise.certified_until
    off = promise.estimated_error if promise.certified else PART * wanted
    rung, spent = _with_nodes(system, reference, run)
    seconds = sum(work.solve_seconds for work in spent)
    steps = sum(work.all_steps for work in spent)
    step = first_step(system)
    before = None
    counted = 0.0
    for remaining in range(MOST_RUNS - 1, -1, -1):
        motion = run(rung.by(step=step))
        work = motion.work
        seconds += work.solve_seconds
        last = work_done(motion.system, work)
        counted += last
        apart = compare(motion, exact)
        error = apart.error_until(until) + off
        within = not work.failed and error <= wanted
        if within or not remaining or until == 0.0:
            break
        tried = None if work.failed else _Tried(motion.system.step, error)
        step = motion.system.step / (_finer(motion.system, before, tried) if tried else FAILED)
        before = tried
        if counted + last * motion.system.step / step > MOST_WORK:
            break
        steps += work.steps
    work.solve_seconds = seconds
    work.coarser_steps = steps
    certified = within and promise.certified
    if not certified:
        whole = apart.error + promise.estimated_error
        error = NOTHING if work.failed or exact.work.failed else max(whole, wanted * MISSED)
    with_nodes = f" and {motion.system.nodes} nodes" if motion.system.nodes else ""
    known_until = "" if promise.certified else f", known up to {until:.4g} s"
    own = f"held against {exact.system.method.scheme} ones{known_until}"
    certificate = Certificate(
        tolerance=wanted,
        certified=certified,
        estimated_error=error,
        certified_until=0.0 if work.failed else min(until, apart.until(wanted - off)),
        method=f"{system.method.scheme} steps of {motion.system.step:.3g} s{with_nodes}, {own}",
    )
    return Certified(replace(motion, exponent=exact.exponent), certificate)


def _finer(system: System, before: _Tried | None, tried: _Tried) -> float:
    """By what the next step is shorter: by the order of the scheme, or by what it shows, if that is less.

    Two runs show it from small errors on. It counts as one half at least: beside kinks errors fall unevenly, with
    order one or by chance less. With one at least, a wheel that turns back and forth within a step takes more than
    five runs. A step that is hardly shorter may not change anything. These are choices.
    """
    method = system.method
    order = float(system.scheme.order(system.weights, method.start))
    if before and before.error < 0.1:
        shown = math.log(max(before.error / tried.error, 1.0)) / math.log(before.step / tried.step)
        order = min(order, max(shown, 0.5))
    excess = max(tried.error / (AIM * method.tolerance), 1.0)
    return float(min(MOST, max(1.25, excess ** (1.0 / order))))


def _with_nodes(
    system: System, reference: Certified, run: Callable[[System], Motion]
) -> tuple[System, tuple[Work, ...]]:
    """The system with as few nodes as are enough, and what has been spent until now.

    What nodes make of the error is known from the reference or, where its contact is exact, from one more run.
    Where so many are needed that the exact contact is cheaper, the scheme takes that.
    """
    motion = reference.motion
    spent: tuple[Work, ...] = (motion.work,)
    nodes = first_nodes(system)
    if not nodes or set(motion.work.evaluators) == {"closed-form"}:
        return system.by(nodes=nodes), spent
    wanted = system.method.tolerance
    if not motion.system.nodes:
        on_nodes = reference_of(system).by(evaluator="cells", nodes=2 * nodes, tolerance=FIRST * wanted)
        motion = run(replace(on_nodes, start_error=displacement(system)))
        spent = (*spent, motion.work)
    fraction = reference.certificate.certified_until / system.sampled_duration
    error = SAFETY * Known.of_run(motion).by_nodes(fraction)
    # Errors may grow beyond all bounds; 16 times as many nodes make an error of one a thousandth and less.
    more = min((error / (AIM_OF_NODES * wanted)) ** (1.0 / ORDER_OF_NODES), 16.0)
    nodes = max(nodes, NODES * math.ceil(more * motion.system.nodes / NODES))
    on_nodes = system.by(nodes=nodes)
    exact = system.by(evaluator="exact")
    dear = evaluation_work(on_nodes) > evaluation_work(exact) or on_nodes.table_bytes > MOST_TABLE_BYTES
    return exact if dear else on_nodes, spent
