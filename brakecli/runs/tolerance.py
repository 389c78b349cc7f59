"""Choose scheme, nodes and step so that the error of the histories stays below the requested tolerance.

Runs of different fineness are compared, and the finest one is the answer. What two of them differ by is the error
of the coarser one, so the answer is better than it is said to be. Only a run whose steps are exact knows its own
error, which is rounding.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from brakecli.runs.certificate import (
    DISPLACED,
    ORDER,
    ROUNDING,
    Certificate,
    Certified,
    Rounding,
    coarser,
    coarser_by_steps,
    compare,
    replica,
    sizes,
)
from brakecli.runs.cost import evaluation_seconds
from brakecli.runs.ladder import MOST_SECONDS, ladder
from brakecli.solver.motion import Motion, Progress, solve
from brakecli.solver.system import System

FIRST_EVENT_DIGITS, MOST_EVENT_DIGITS = 6, 13  # tolerances of the event-driven scheme are powers of ten
EVENT_DIGITS = 2  # from one tolerance to the next
EVENT_MARGIN = 3  # digits of the first tolerance beyond the requested one, at least: no event may be missed twice
SECOND_RUN = 10.0 ** (EVENT_DIGITS / ORDER)  # what a run costs over the one before
NODES_FROM = 1e-5  # tolerance from which on events with nodes may be cheaper than with the exact contact
WORTH_A_PILOT = 1.0  # guessed time (s) of the next runs from which on they are weighed against event-driven ones
PILOT = 32  # duration of the case over that of the event-driven pilot run, which counts the work of such runs
# Time is guessed from counted work, not measured, so that a case gives the same bytes wherever it runs.
FIRST_BLOCK = 5e-3  # guessed time (s) of the first block of a run whose steps take one evaluation of the contact
SHORTER = 0.7  # step of the second of two piecewise-exact runs over that of the first
ROUNDED_MARGIN = 20.0  # the error of a piecewise-exact run over the rounding that it has carried along, at most
ROUNDING_MARGIN = 4.0  # the error of such a run over what two of them differ by, at most


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
    method = system.method
    chosen = method.automatic and method.own_steps and not method.row.exact
    return chosen and method.tolerance >= NODES_FROM and system.steady


def _run(system: System, progress: Progress, **changes: Any) -> Motion:
    """The motion by the system's method with these changes."""
    return _solved(replace(system, method=replace(system.method, **changes)) if changes else system, progress)


def _solved(system: System, progress: Progress) -> Motion:
    per_sample, block = system.per_sample, 1
    if system.nodes or not system.method.own_steps:
        block += int(FIRST_BLOCK / (evaluation_seconds(system) + 1e-6))
    return solve(system, progress=lambda steps: progress(steps // per_sample), first_block=block)


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
        number = work.contact_evaluations * system.samples / samples * (1.0 + SECOND_RUN)
        return math.inf if work.failed else number

    def too_slow(run: Motion, more: float) -> bool:
        taken = run.work.evaluators
        part = 1.0 - taken.get("closed-form", 0) / max(sum(taken.values()), 1)
        if part == 0.0:
            return True
        seconds = part * more * run.work.contact_evaluations * evaluation_seconds(run.system)
        return seconds > WORTH_A_PILOT and seconds > part * evaluations() * evaluation_seconds(system)

    return too_slow


def first_event_digits(system: System) -> int:
    """The digits of the tolerance of the first event-driven run; a second one with more can follow."""
    digits = EVENT_MARGIN - math.floor(math.log10(system.method.tolerance) + 1e-9)
    return min(max(FIRST_EVENT_DIGITS, digits), MOST_EVENT_DIGITS - EVENT_DIGITS)


def first_event_tolerance(system: System) -> float:
    """The tolerance of the first event-driven run."""
    return float(f"1e-{first_event_digits(system)}")


def _by_phases(system: System, progress: Progress) -> Certified:
    """A piecewise-exact run, whose only error is rounding: each step adds some to what it carries along.

    Where that may be too much, a replica with other steps shows what the motion makes of it. Where samples are
    close, a step of this run passes over several of them.
    """
    wanted, run, longest = system.method.tolerance, _run(system, progress), SHORTER * system.longest_step
    largest, carried = run.work.rounding or (np.zeros(4), np.zeros(4))
    error = max(ROUNDED_MARGIN * float((carried / sizes(system, largest, largest)).max()), ROUNDING)
    if error <= wanted and not run.work.failed:
        how = f"the rounding of piecewise-exact steps of {run.system.step:.3g} s"
        return Certified(run, Certificate(wanted, True, error, system.sampled_duration, how))
    every = max(n for n in range(1, 1 + max(1, int(longest / system.interval))) if system.samples % n == 0)
    share = min(1.0, run.system.step / system.longest_step) if every == 1 else 1.0
    sparse = replace(system, interval=every * system.interval, duration=system.sampled_duration)
    other = _run(replica(sparse), lambda samples: None, share=SHORTER * share)
    run.work.solve_seconds += other.work.solve_seconds
    apart = compare(run, other)
    error, failed = ROUNDING_MARGIN * apart.error, run.work.failed or other.work.failed
    certified = error <= wanted and not failed
    until = system.sampled_duration if certified else apart.until(wanted / ROUNDING_MARGIN)
    steps = f"{run.system.step:.3g} and {other.system.step:.3g} s (displaced by {DISPLACED:.0e})"
    how = f"piecewise-exact runs with steps of {steps}"
    return Certified(run, Certificate(wanted, certified, error, until, how))


def _by_events(system: System, progress: Progress) -> Certified:
    """Event-driven runs, each to a hundredth of the tolerance of the one before, as long as that helps.

    The first one is a replica: what the second one differs by holds what the motion makes of rounding, too. Where
    that is too much, a run of the first kind tells rounding apart, and up to where the promise can be kept at all.
    """
    wanted, first = system.method.tolerance, first_event_digits(system)
    runs, names, rounding = list[Motion](), list[str](), Rounding(0.0, system.sampled_duration, wanted)

    def run(digits: int, system: System = system, name: str = "") -> Motion:
        runs.append(_run(system, progress, tolerance=float(f"1e-{digits}")))
        names.append(f"1e-{digits:02}{name}")
        return runs[-1]

    coarse, fine = first, first + EVENT_DIGITS
    before = run(first, replica(system), f" (displaced by {DISPLACED:.0e})")
    while True:
        now = run(fine)
        factor = coarser(10.0 ** (coarse - fine))
        if fine < MOST_EVENT_DIGITS:  # the last run needs no finer one: no step of it is wrong by more than that
            factor = max(factor, coarser_by_steps(before, now))
        apart = compare(before, now, rounding.until)
        until = apart.until(rounding.left / factor) if factor < math.inf else 0.0
        seconds, failed = sum(each.work.solve_seconds for each in runs), now.work.failed or before.work.failed
        if until >= rounding.until or failed or seconds > MOST_SECONDS or fine == MOST_EVENT_DIGITS:
            break
        if len(runs) == 2:
            rounding = Rounding.of(before, run(first), wanted)
        before, coarse, fine = now, fine, min(fine + EVENT_DIGITS, MOST_EVENT_DIGITS)
    error = (factor * compare(before, now).error if factor < math.inf else 1.0) + rounding.error
    certified = error <= wanted and not failed
    now.work.solve_seconds = seconds
    how = f"event-driven runs to {', '.join(names[:-1])} and {names[-1]}"
    return Certified(now, Certificate(wanted, certified, error, until, how))


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
