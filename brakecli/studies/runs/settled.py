"""A run that is long enough by itself: it is made again, twice as long, while a longer one may say more.

Each of them starts anew, so that the last one is, to the last bit, the run of a case that gives its duration as a
number. All of them together take twice the time of the last one.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, NamedTuple, Protocol, TypeVar

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.parts import SETTLED
from brakecli.solver.integrate import Work
from brakecli.solver.system import System
from brakecli.studies.runs.certificate import Certificate

MOST_SAMPLES = 2_000_000
"""Samples of the longest run that is tried: a worker of a sweep holds them in memory, with half a GB."""


class Ends(Protocol):
    """A motion as far as it matters here: what it has cost."""

    @property
    def work(self) -> Work:
        """Its cost, and how it has ended."""


M = TypeVar("M", bound=Ends, covariant=True)


class Judged(NamedTuple, Generic[M]):
    """A motion with its verdict, and its certificate where the case gives no step."""

    verdict: Verdict
    motion: M
    certificate: Certificate | None


class Settled(NamedTuple, Generic[M]):
    """The last run that was made, its system, and what is to be said of its duration, with doubts and without."""

    judged: Judged[M]
    system: System
    warnings: tuple[str, ...] = ()


def longest(system: System) -> float:
    """Duration (s) of the longest run that is tried: the first one times a power of two."""
    times = MOST_SAMPLES / system.samples
    return system.sampled_duration * 2.0 ** max(0, math.floor(math.log2(times)))


def settle(system: System, run: Callable[[System], Judged[M]]) -> Settled[M]:
    """The run of a system; of one that is to settle, the shortest that is decided, or the longest that helps.

    It goes by counts and not by the clock, so that a case gives the same bytes wherever it runs. The first run is
    made in any case. A run that fails is not made longer, nor one that cannot keep its tolerance however fine its
    steps are: that takes several runs each time.
    """
    if not system.settles:
        return Settled(run(system), system)
    trial = system
    most = longest(system)
    taken = 0
    while True:
        judged = run(trial)
        verdict = judged.verdict
        work = judged.motion.work
        taken += work.all_steps
        needed = taken + 2 * work.all_steps  # for a run twice as long
        accurate = judged.certificate is None or judged.certificate.certified or trial.method.row.exact
        longer = 2.0 * trial.sampled_duration
        if not verdict.unfinished or work.failed or not accurate or longer > most or needed > system.budget:
            break
        trial = replace(trial, duration=longer)
    seconds = trial.sampled_duration
    trial = replace(trial, duration=seconds, budget=0)
    if work.failed:
        return Settled(judged, trial)
    if not verdict.unfinished and verdict.regime is not Regime.UNDECIDED:
        note = f"solver.duration: {SETTLED} after {seconds:.6g} s"
        return Settled(judged, replace(trial, notes=(*trial.notes, note)))
    if not verdict.unfinished:
        why = "a longer run would not decide more"
    elif not accurate:
        why = "a longer run would not keep the tolerance; a larger solver.tolerance lets it be longer"
    elif longer > most:
        wider = f"an output.sample_interval above {trial.interval:g} s lets it be longer"
        why = f"no more than {MOST_SAMPLES:,} samples are tried; {wider}"
    else:
        enough = rounded_up(needed)
        why = f"solver.budget is {system.budget:,} steps; solver.budget = {enough} lets it be twice as long"
    tried = f"not {SETTLED} after {seconds:.6g} s, and {taken:,} steps in all"
    return Settled(judged, trial, (f"solver.duration: {tried}; {why}",))


def rounded_up(count: int) -> int:
    """The least number of two digits and noughts that is not below a count."""
    unit: int = 10 ** max(0, len(str(count)) - 2)
    return -(-count // unit) * unit
