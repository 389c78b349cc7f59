"""Vibrations that no branch from flutter reaches: sought by pushes, each followed to what becomes of it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from brakecli.analysis.branches.problem import Array
from brakecli.analysis.branches.rows import Followed
from brakecli.analysis.branches.sliding import Change, Slide, stable_spans
from brakecli.analysis.fate import fate_on_smooth_pads
from brakecli.analysis.shoe import Shoe
from brakecli.solver.motion.flow import Orbit

PARTS = 5
"""Of all pushes one is made at the own value, if sliding is stable there; the others are spread."""
VALUES = 16
"""Values among which pushes are spread: islands may be as narrow as a thirtieth of the range. More values cost
more where each has a known cycle, which must be recognized anew."""
LARGEST = 10.0
"""Largest one, over the compression of the pad: nearly all larger ones land again and come to what these do."""
LONGEST = 2000.0
"""Periods of the fastest mode for which a push is followed."""


@dataclass
class Search:
    """How widely was sought, and what was found."""

    pushes: int = 0
    undecided: int = 0  # of which it was not known in time what they come to
    islands: list[Followed] = field(default_factory=list)
    seconds: float = 0.0  # of the whole search


@dataclass(frozen=True)
class Tried:
    """What pushes at one value have come to."""

    pushes: int
    undecided: int
    orbits: list[Orbit]  # each once


class Place(NamedTuple):
    """Where to seek, and the numbers of the pushes there."""

    p: float
    first: int
    number: int


def places(slides: Sequence[Slide], changes: Sequence[Change], own: float | None, number: int) -> list[Place]:
    """Where to seek by `PARTS` times a number of pushes.

    One part is for the own place, if sliding is stable there. The others are shared among the middles of equal
    parts of the range where it is stable.
    """
    spans = [(low, high) for (low, _), (high, _) in stable_spans(slides, changes)]
    if not spans:
        return []
    inside = own is not None and any(low < own < high for low, high in spans)
    result = [Place(own, 0, number)] if own is not None and inside else []
    first = number * len(result)
    edges = np.linspace(first, PARTS * number, VALUES + 1).astype(int).tolist()
    whole = sum(high - low for low, high in spans)
    for k, (begin, end) in enumerate(pairwise(edges)):
        ahead = (k + 0.5) / VALUES * whole
        for low, high in spans:
            if ahead < high - low:
                result.append(Place(low + ahead, begin, end - begin))
                break
            ahead -= high - low
    return [place for place in result if place.number]


def pushes(first: int, count: int, smallest: float) -> Array:
    """States (x, y, v_x, v_y) beside steady sliding of the pushes from a number on, by rows.

    In compressions of the pad, and in these times the angular frequency of the fastest mode. The directions are
    those of a sphere, the logarithms of the sizes those from the smallest to the largest; both are spread evenly.
    """
    numbers = np.arange(first + 1, first + count + 1)[:, None]
    # the root of x⁵ = x + 1: the multiples of its powers spread evenly in four dimensions (M. Roberts, 2018)
    size, share, one, other = (numbers * 1.1673039782614187 ** -np.arange(1.0, 5.0) % 1.0).T
    one = 2.0 * math.pi * one
    other = 2.0 * math.pi * other
    along = np.sqrt(share)
    across = np.sqrt(1.0 - share)
    sphere = np.array([along * np.cos(one), across * np.cos(other), along * np.sin(one), across * np.sin(other)])
    return np.asarray((smallest * (LARGEST / smallest) ** size * sphere).T)


def try_pushes(shoe: Shoe, first: int, count: int, stop: Callable[[], bool]) -> Tried:
    """What the pushes from a number on come to."""
    c = shoe.coefficients
    orbits = list[Orbit]()
    undecided = 0
    done = 0
    if shoe.rest is None or not shoe.rest[1] < 0.0:
        return Tried(0, 0, [])
    fastest = math.sqrt((c.c_xx + c.c_yy + shoe.stiffness) / c.m)  # rad/s; at most this, by the trace
    equilibrium = np.array([*shoe.rest, 0.0, 0.0])
    depth = -shoe.rest[1]
    scales = depth * np.array([1.0, 1.0, fastest, fastest])
    longest = LONGEST * 2.0 * math.pi / fastest
    # An event follows from 1, or from less, as modes of stable sliding are oblique and a push may grow at first.
    # What is smaller by far comes to nothing but linear decay.
    smallest = 0.1 * min(1.0, abs(shoe.belt) / (fastest * depth))
    for push in pushes(first, count, smallest):
        if stop():
            break
        done += 1
        end = fate_on_smooth_pads(shoe, equilibrium + scales * push, longest)
        undecided += end.lasts is None
        if end.orbit is not None and not any(_alike(end.orbit, orbit) for orbit in orbits):
            orbits.append(end.orbit)
    return Tried(done, undecided, orbits)


def _alike(one: Orbit, other: Orbit) -> bool:
    pairs = (one.amplitude, other.amplitude), (one.period, other.period)
    return all(math.isclose(*pair, rel_tol=1e-6) for pair in pairs)
