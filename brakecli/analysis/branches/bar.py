"""Where a stable part of a branch ends, and how far steps and cells may have moved that end."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from brakecli.analysis.branches.follow import both_ways
from brakecli.analysis.branches.newton import Newton, Settings, zero
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Problem

LEFT_OPEN = 4.0
"""Times by which the error may exceed the change with finer steps. An error of second order is 1.8 times that
change, but kinks of the contact force let it fall unevenly: as patches open, and where a whole pad lands."""


class Bound(NamedTuple):
    """An end of a stable part of a branch."""

    p: float
    error: float = 0.0  # by the bracket
    inner: Point | None = None  # the last stable motion; None where no steps are taken, or the range ends
    beyond: Point | None = None  # the first one that is not
    problem: Problem | None = None
    known: bool = True  # otherwise the motion goes on, and nobody knows how far

    @property
    def bar(self) -> float:
        """The error of p: that of the bracket, and what steps leave open."""
        # errors of more steps and of more cells may cancel, so the end is located again with each of them alone
        finer = self.problem.finer(1.5) if self.problem is not None and self.inner is not None else []
        if not finer:
            return self.error
        moved = [self._moved(problem) for problem in finer]
        # multipliers are checked to 1e-6, so no bar is narrower where steps are taken
        return max(self.error, 1e-6) + sum(LEFT_OPEN * abs(p - self.p) if p is not None else 1.0 for p in moved)

    def _moved(self, finer: Problem) -> float | None:
        """Where the end is with finer steps; None where it is not found."""
        if self.inner is None or self.beyond is None:
            return None
        newton = Newton(finer, Settings())
        one, other = sorted((self.inner, self.beyond), key=lambda point: point.s)
        finer.use(one.chart)
        # two motions beside the end are moved apart until finer steps find it between them
        for apart in (0.0, 1e-4, 1e-3, 1e-2, 5e-2):
            ends = [
                newton.solve(
                    point.z + way * point.tangent, point.tangent, point.tangent, point.s + way, exact=True
                )
                for point, way in ((one, -apart), (other, apart))
            ]
            if ends[0] is not None and ends[1] is not None and ends[0].stable is not ends[1].stable:
                return locate(newton, ends[0], ends[1])
        first = newton.solve(self.inner.z, self.inner.tangent, self.inner.tangent, 0.0, exact=True)
        # else the branch is followed some way with finer steps
        points = both_ways(finer, first, Settings(points=60)).points if first is not None else []
        pairs = [pair for pair in pairwise(points) if pair[0].stable is not pair[1].stable]
        places = [locate(newton, *pair) for pair in pairs if pair[0].chart is pair[1].chart]
        return min(places, key=lambda p: abs(p - self.p), default=None)


def locate(newton: Newton, one: Point, other: Point) -> float:
    """The p between two motions of one chart at which the largest multiplier leaves the unit circle.

    By the Illinois method and by halves in turns: without damping the multiplier stays beside the circle up to
    there, and then leaves it like a root.
    """
    low = _outside(one)
    high = _outside(other)
    p = one.p
    side = 0
    for turn in range(24):
        fraction = 0.5 if turn % 2 else zero(low, high)
        middle = newton.between(one, other, fraction) or newton.between(one, other, 0.5)
        if middle is None:
            break
        moved = abs(middle.p - p)
        p = middle.p
        if moved < 1e-7:
            return p
        if middle.stable is one.stable:
            one = middle
            low = _outside(middle)
            high = high * (0.5 if side == 1 else 1.0)
            side = 1
        else:
            other = middle
            high = _outside(middle)
            low = low * (0.5 if side == -1 else 1.0)
            side = -1
    return 0.5 * (one.p + other.p)


def _outside(point: Point) -> float:
    """ln of the largest multiplier, with the sign that the verdict on stability has: negative if it is stable."""
    size = math.log(max(float(np.abs(point.multipliers).max()), 1e-300))
    return min(size, -1e-12) if point.stable else max(size, 1e-12)
