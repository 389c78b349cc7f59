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
from brakecli.runs.certificate import Certificate
from brakecli.runs.cost import beside_seconds, guessed
from brakecli.solver.motion import Work
from brakecli.solver.system import System

MOST_SECONDS = 20.0
"""Guessed time of the longest run that is tried: a minute of waiting at most, with those before it."""
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
    """Duration (s) of the longest run that is tried: the first one times a power of two.

    It goes by guesses and not by the clock, so that a case gives the same bytes wherever it runs.
    """
    seconds = guessed(system).seconds + beside_seconds(system)
    times = min(MOST_SECONDS / seconds, MOST_SAMPLES / system.samples)
    return system.sampled_duration * 2.0 ** max(0, math.floor(math.log2(times)))


def settled(system: System, run: Callable[[System], Judged[M]]) -> Settled[M]:
    """The run of a system; of one that is to settle, the shortest that is decided, or the longest that helps.

    A run that fails is not made longer, nor one that cannot keep its tolerance however fine its steps are: that
    takes several runs each time.
    """
    part, most = system, longest(system) if system.settles else 0.0
    while True:
        found = run(part)
        verdict, failed, longer = found.verdict, found.motion.work.failed, 2.0 * part.sampled_duration
        kept = found.certificate is None or found.certificate.certified or part.method.row.exact
        if not verdict.unfinished or failed or not kept or longer > most:
            break
        part = replace(part, duration=longer)
    if not system.settles:
        return Settled(found, system)
    part, after = replace(part, duration=part.sampled_duration, settles=False), f"{part.sampled_duration:.6g} s"
    if failed:
        return Settled(found, part)
    if not verdict.unfinished and verdict.regime is not Regime.UNDECIDED:
        return Settled(found, replace(part, notes=(*part.notes, f"solver.duration: {SETTLED} after {after}")))
    why = "a longer run would not keep the tolerance"
    if not verdict.unfinished:
        why = "a longer run would not decide more"
    elif longer > most:
        why = f"no more than {MOST_SAMPLES:,} samples, or some {MOST_SECONDS:g} s of computing, are tried"
    return Settled(found, part, (f"solver.duration: not {SETTLED} after {after}; {why}",))
