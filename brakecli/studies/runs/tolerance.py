"""Choose scheme, nodes and step so that the error of the histories stays below the requested tolerance.

Runs whose steps are exact, and event-driven ones, know their own error. Runs of difference schemes are held
against one of these.
"""

from dataclasses import replace

import numpy as np

from brakecli.solver.integrate import Motion, Progress, solve
from brakecli.solver.system import System
from brakecli.studies.runs.against import against, reference_of
from brakecli.studies.runs.certificate import (
    DISPLACED,
    ROUNDING,
    Certificate,
    Certified,
    compare,
    replica,
    sizes,
)
from brakecli.studies.runs.own_error import by_own_error, last_of
from brakecli.studies.runs.work import evaluation_work

ROUNDING_MARGIN = 4.0  # the error of a piecewise-exact run over what two of them differ by, at most


def certify(system: System, progress: Progress = lambda samples: None) -> Certified:
    """Compute a motion to the tolerance of its method; `progress` receives the samples of the run in progress.

    Smooth surfaces go to the piecewise-exact scheme, as its cost does not depend on the error, and all others to
    the event-driven one. A difference scheme is refined until it agrees with that motion.
    """

    def run(rung: System) -> Motion:
        return _solved(rung, progress)

    if system.method.row.exact:
        return _by_phases(system, progress)
    if system.method.own_steps:
        return last_of(by_own_error(system), run)
    return against(system, certify(reference_of(system), progress), run)


def begins_with_steps(system: System) -> bool:
    """Whether steps and nodes that are refined apart may keep the tolerance."""
    method = system.method
    chosen = method.automatic and method.own_steps and not method.row.exact
    return chosen and method.tolerance >= 1e-5 and system.steady  # below, lanes are not worth a try


def _solved(system: System, progress: Progress) -> Motion:
    """The motion. Work sizes its first block, no clock, so that a case gives the same bytes wherever it runs."""
    per_sample = system.per_sample
    block = 1
    if system.nodes or not system.method.own_steps:
        block += int(5e-3 / (evaluation_work(system) + 1e-6))
    return solve(system, progress=lambda steps: progress(steps // per_sample), first_block=block)


def _by_phases(system: System, progress: Progress) -> Certified:
    """A piecewise-exact run, whose only error is rounding: each step adds some to what it carries along.

    The error is 20 times what it has carried along, at most. Where that may be too much, a replica with shorter
    steps shows what the motion makes of it. Where samples are close, a step of that passes over several of them.
    """
    wanted = system.method.tolerance
    run = _solved(system, progress)
    shorter = 0.7
    longest = shorter * system.longest_step
    largest, carried = run.work.rounding or (np.zeros(4), np.zeros(4))
    size = sizes(system, largest, largest)
    relative = np.divide(carried, size, out=np.zeros(4), where=np.isfinite(size))  # what rests has no error
    error = max(20.0 * float(relative.max()), ROUNDING)
    if error <= wanted and not run.work.failed:
        how = f"the rounding of piecewise-exact steps of {run.system.step:.3g} s"
        return Certified(run, Certificate(wanted, True, error, system.sampled_duration, how))
    every = max(n for n in range(1, 1 + max(1, int(longest / system.interval))) if system.samples % n == 0)
    share = min(1.0, run.system.step / system.longest_step) if every == 1 else 1.0
    sparse = replace(system, interval=every * system.interval, duration=system.sampled_duration)
    other = _solved(replica(sparse).by(share=shorter * share), lambda samples: None)
    run.work.solve_seconds += other.work.solve_seconds
    run.work.coarser_steps = other.work.steps
    apart = compare(run, other)
    error = ROUNDING_MARGIN * apart.error
    failed = run.work.failed or other.work.failed
    certified = error <= wanted and not failed
    until = system.sampled_duration if certified else apart.until(wanted / ROUNDING_MARGIN)
    steps = f"{run.system.step:.3g} and {other.system.step:.3g} s (displaced by {DISPLACED:.0e})"
    how = f"piecewise-exact runs with steps of {steps}"
    return Certified(run, Certificate(wanted, certified, error, until, how))
