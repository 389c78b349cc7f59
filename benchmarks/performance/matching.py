"""Ways of computing one motion, what error each has, and the time that each takes, in turns."""

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain, product
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.integrate import Stepping
from brakecli.solver.method import Method
from brakecli.solver.schemes import HALF, NUMEROV
from brakecli.solver.system import System

Floats = NDArray[np.float64]
TARGETS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
TURNS = 11
CLOSE = 1.4  # first times within this factor are timed in turns: the first one is by chance, too
SLOWEST = 0.5  # s; what took longer is the end of its ladder
SHORT = 0.01  # s
US = "brakecli"


@dataclass
class Entry:
    """A way of computing a motion: `compute` returns the seconds it took, and rows of x, y, vx, vy."""

    who: str
    label: str
    compute: Callable[[], tuple[float, Floats]]
    settings: dict[str, Any] = field(default_factory=dict)  # what an ensemble needs to take the same
    error: float = math.inf
    seconds: list[float] = field(default_factory=list)

    @property
    def time(self) -> float:
        return median(self.seconds[1:] or self.seconds)  # the first time found the caches cold


Ladder = Iterable[Entry]
"""Entries from the coarsest on. It ends where one is fine enough or too slow, or errors stop falling."""


def timed(call: Callable[[], Any], rows: Callable[[Any], Floats]) -> Callable[[], tuple[float, Floats]]:
    """The `compute` of an entry: a call that is timed, and what makes rows of its result.

    All times are those of the processor: what else the machine does lengthens none of them.
    """

    def compute() -> tuple[float, Floats]:
        begin = time.process_time()
        found = call()
        seconds = time.process_time() - begin
        return seconds, rows(found)

    return compute


def deviation(rows: Floats, reference: Floats) -> float:
    """The largest deviation of x, y and the velocities, each relative to its largest value."""
    if rows.shape != reference.shape or not np.isfinite(rows).all():
        return math.inf
    return float((np.abs(rows - reference).max(axis=0) / np.abs(reference).max(axis=0)).max())


def measure(ladders: Iterable[Ladder], reference: Floats, seconds: float) -> list[Entry]:
    """All entries with their errors; those that may be cheapest somewhere timed in turns, for so many seconds."""
    entries: list[Entry] = []
    for ladder in ladders:
        rungs: list[Entry] = []
        for entry in ladder:
            if not rungs:
                entry.compute()  # compiles
            spent, rows = entry.compute()
            entry.seconds = [spent]
            entry.error = deviation(rows, reference)
            rungs.append(entry)
            flat = len(rungs) > 2 and 0.7 * rungs[-3].error < entry.error < 0.1
            if entry.error <= TARGETS[-1] or spent > SLOWEST or flat:
                break
        entries += rungs
    sought = product(TARGETS, names(entries))
    chosen = {id(entry): entry for target, who in sought for entry in near(entries, who, target)}
    end = time.perf_counter() + seconds
    for _ in range(TURNS):
        for entry in chosen.values():
            entry.seconds.append(warm(entry))
        if time.perf_counter() > end:
            break
    return list(chosen.values())


def warm(entry: Entry) -> float:
    """Seconds of a short one right after itself: what ran before it has emptied the caches."""
    for _ in range(2 if entry.time < SHORT else 0):
        entry.compute()
    return entry.compute()[0]


def names(entries: list[Entry]) -> list[str]:
    return list(dict.fromkeys(entry.who for entry in entries))


def near(entries: list[Entry], who: str, target: float) -> list[Entry]:
    """The entries of a program that may be its cheapest ones to a target."""
    good = [entry for entry in entries if entry.who == who and entry.error <= target]
    return [entry for entry in good if entry.time <= CLOSE * min(each.time for each in good)]


def cheapest(entries: list[Entry], who: str, target: float) -> Entry | None:
    """The cheapest entry of a program whose error is at most the target."""
    good = [entry for entry in entries if entry.who == who and entry.error <= target]
    return min(good, key=lambda entry: entry.time, default=None)


def ratio(entries: list[Entry], who: str, target: float) -> float | None:
    """How many times longer a program takes than we do; None where one of the two does not reach the target."""
    ours = cheapest(entries, US, target)
    theirs = cheapest(entries, who, target)
    return theirs.time / ours.time if ours and theirs else None


def our_entry(system: System, method: Method, label: str) -> Entry:
    """A motion of our own; its time is that of the loop, in one block, as `wall_seconds` of compare-schemes."""
    system = replace(system, method=method)
    return Entry(US, label, lambda: loop(system), {"method": method})


def loop(system: System) -> tuple[float, Floats]:
    """Seconds of the loop, and its samples; the last one is taken outside of it, as in `solve`."""
    stepping = Stepping(system)
    end = system.steps + system.scheme.LAG
    seconds = 0.0
    parts = list[Floats]()
    while not stepping.work.failed and stepping.counts.level < end:  # a long call returns now and then
        begin = time.process_time()
        parts.append(stepping.block(end))
        seconds += time.process_time() - begin
    return seconds, np.vstack([*parts, stepping.last_row()])[:, :4]


def our_ladders(system: System) -> Iterator[Ladder]:
    """The schemes that are the cheapest at some error, over steps, nodes and tolerances."""
    counts = chain.from_iterable((2**k, 3 * 2 ** (k - 1)) if k else (1,) for k in range(11))
    steps = [system.interval / count for count in counts]
    if system.smooth:
        yield [our_entry(system, Method("piecewise-exact"), "piecewise-exact")]
    for scheme, theta in (("three-layer", NUMEROV), ("two-layer", HALF)):
        for nodes in (0,) if system.smooth else (64, 256, 1024):
            kind = Method(scheme, theta, nodes=nodes)
            words = f"{scheme}, {nodes} nodes" if nodes else scheme
            yield (our_entry(system, replace(kind, step=step), f"{words}, {step:.3g} s") for step in steps)
    for nodes in (0,) if system.smooth else (64, 256, 1024, 0):
        kind = Method("event-driven", evaluator="cells" if nodes else "auto", nodes=nodes)
        words = f"event-driven, {nodes} nodes" if nodes else "event-driven"
        events = (10.0 ** (-k / 2) for k in range(3, 19))
        yield (our_entry(system, replace(kind, tolerance=e), f"{words}, {e:.1g}") for e in events)
