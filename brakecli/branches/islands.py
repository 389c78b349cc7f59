"""Vibrations that no branch from flutter reaches: sought by pushes, each followed to what becomes of it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from brakecli.branches.begin import on_smooth_pads
from brakecli.branches.line import Shoe
from brakecli.branches.problem import Array
from brakecli.branches.sliding import Change, Slide, stable_spans
from brakecli.branches.told import Followed
from brakecli.solver.flow.repeating import Orbit

VALUES = 5
"""Values at which is sought; a choice."""
SMALLEST = 1e-3
"""Least size of a push, over the compression of the pad: a smaller one comes to nothing but linear decay."""
LARGEST = 10.0
"""Largest one: nearly all larger ones land again and come to what those of ten times the compression do."""
LONGEST = 2000.0
"""Periods of the fastest mode for which a push is followed."""
_TURNED = 1.1673039782614187
"""The root of x⁵ = x + 1: the multiples of its powers spread evenly in four dimensions (M. Roberts, 2018)."""
ALIKE = 1e-6
"""Relative difference of amplitude and period by which two orbits are one."""


@dataclass
class Search:
    """How widely was sought, and what was found."""

    pushes: int = 0
    undecided: int = 0  # of which it was not known in time what they come to
    found: list[Followed] = field(default_factory=list)
    seconds: float = 0.0  # of the whole search


@dataclass(frozen=True)
class Tried:
    """What pushes at one value have come to."""

    pushes: int
    undecided: int
    orbits: list[Orbit]  # each once


def places(slides: Sequence[Slide], changes: Sequence[Change], own: float | None) -> list[float]:
    """Where to seek: at the own place, if sliding is stable there, and in the middles of equal stable parts."""
    spans = [(low, high) for (low, _), (high, _) in stable_spans(slides, changes)]
    if not spans:
        return []
    found = [own] if own is not None and any(low < own < high for low, high in spans) else []
    others = VALUES - len(found)
    whole = sum(high - low for low, high in spans)
    for k in range(others):
        ahead = (k + 0.5) / others * whole
        for low, high in spans:
            if ahead < high - low:
                found.append(low + ahead)
                break
            ahead -= high - low
    return found


def pushes(first: int, count: int) -> Array:
    """States (x, y, v_x, v_y) beside steady sliding of the pushes from a number on, by rows.

    In compressions of the pad, and in these times the angular frequency of the fastest mode. The directions are
    those of a sphere, the logarithms of the sizes those of an interval; both are spread evenly.
    """
    numbers = np.arange(first + 1, first + count + 1)[:, None]
    size, share, one, other = (numbers * _TURNED ** -np.arange(1.0, 5.0) % 1.0).T
    one, other = 2.0 * math.pi * one, 2.0 * math.pi * other
    along, across = np.sqrt(share), np.sqrt(1.0 - share)
    sphere = np.array([along * np.cos(one), across * np.cos(other), along * np.sin(one), across * np.sin(other)])
    return np.asarray((SMALLEST * (LARGEST / SMALLEST) ** size * sphere).T)


def tried(shoe: Shoe, first: int, count: int, stop: Callable[[], bool]) -> Tried:
    """What the pushes from a number on come to."""
    c, orbits, undecided, done = shoe.coefficients, list[Orbit](), 0, 0
    if shoe.rest is None or not shoe.rest[1] < 0.0:
        return Tried(0, 0, [])
    fastest = math.sqrt((c.c_xx + c.c_yy + shoe.stiffness) / c.m)  # rad/s; at most this, by the trace
    rest, depth = np.array([*shoe.rest, 0.0, 0.0]), -shoe.rest[1]
    scales = depth * np.array([1.0, 1.0, fastest, fastest])
    longest = LONGEST * 2.0 * math.pi / fastest
    for push in pushes(first, count):
        if stop():
            break
        done += 1
        end = on_smooth_pads(shoe, rest + scales * push, longest)
        undecided += end.lasts is None
        if end.orbit is not None and not any(_alike(end.orbit, orbit) for orbit in orbits):
            orbits.append(end.orbit)
    return Tried(done, undecided, orbits)


def _alike(one: Orbit, other: Orbit) -> bool:
    pairs = (one.amplitude, other.amplitude), (one.period, other.period)
    return all(math.isclose(*pair, rel_tol=ALIKE) for pair in pairs)
