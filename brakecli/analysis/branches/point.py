"""A point of a branch, and a branch."""

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.branches.multipliers import Complex
from brakecli.solver.arrays import Floats

TURN, FOLD, FLIP, TORUS = range(4)
"""Places in `Point.tests`."""


@dataclass(slots=True, eq=False)
class Point:
    """A motion on a branch."""

    z: Floats
    """(n + 1,), the unknowns and the parameter."""
    tangent: Floats
    """(n + 1,), of length one, in the direction of rising s."""
    s: float
    """Length along the branch from its first point, in the charts of the points."""
    multipliers: Complex
    stable: bool
    tests: tuple[float, ...]
    """dp/ds; asinh of det(I - M), of det(I + M), and of the bialternate product."""
    coefficients: tuple[float, ...]
    """asinh of the coefficients of the characteristic polynomial."""
    orientation: tuple[float, float]
    """Sign, and logarithm of the modulus, of the determinant of the derivatives bordered by the tangent."""
    word: Hashable
    facts: Any
    chart: Any  # how the problem reads the unknowns
    maps: Floats
    margins: tuple[float, ...]

    @property
    def u(self) -> Floats:
        """The unknowns."""
        return self.z[:-1]

    @property
    def p(self) -> float:
        """The parameter, 0..1."""
        return float(self.z[-1])

    def turned(self) -> "Point":
        """The same point of the branch walked the other way."""
        sign, log = self.orientation
        return replace(
            self,
            tangent=-self.tangent,
            s=-self.s,
            tests=(-self.tests[TURN], *self.tests[FOLD:]),
            orientation=(-sign, log),
        )


def cubic(one: Point, other: Point, t: float) -> Floats:
    """The place at a part of the way between two neighbours, by their tangents; on the chord across a border."""
    chord = other.z - one.z
    if one.word != other.word:
        return np.asarray(one.z + t * chord)
    bend = (1.0 - t) * one.tangent - t * other.tangent
    return np.asarray(one.z + (3.0 * t**2 - 2.0 * t**3) * chord + (t * (1.0 - t) * (other.s - one.s)) * bend)


class End(NamedTuple):
    """Why a branch ends."""

    kind: str
    """range, closed, met, halved, lost, stopped, points, seconds, interrupted, or start, where it was begun."""
    reason: str
    """For a reader."""


@dataclass(frozen=True, slots=True, eq=False)
class Special:
    """A point at which something changes."""

    kind: str
    """fold, branch point, flip, torus, grazing or end."""
    p: float
    error: float
    """Bound or estimate of the error of p, by the bracket or by the last change."""
    point: Point
    s: float
    name: str = ""
    """What is grazed, or the reason of the end."""
    turns: bool = False
    """Whether the parameter turns here."""
    change: str = ""
    """What begins or ends along the branch where something is grazed."""


@dataclass(slots=True, eq=False)
class Branch:
    """A followed branch.

    Where the problem took a new chart, the same motion stands twice, once in each chart, at the same s.
    """

    points: list[Point]
    specials: list[Special]
    ended: tuple[End, End]
    """At the first point and at the last one."""
    evaluations: int
    unsearched: str = ""
    """Why the search for special points is incomplete; empty where it is complete."""
    aside: list[Point] = field(default_factory=list)
    """Points beyond a change of orientation, by a long stride: of this branch, or of one that nearly meets it."""
