"""Where a stable part of a branch ends, and how far steps and cells may have moved that end."""

from typing import Any, NamedTuple

from brakecli.branches.follow import both_ways
from brakecli.branches.newton import Newton, Settings
from brakecli.branches.point import Point, Special
from brakecli.branches.signs import special_points

FINER = 1.5
"""Times as many steps, and then as many cells, with which an end is located again: errors of both may cancel."""
LEFT_OPEN = 4.0
"""Times by which the error may exceed the change with finer steps. An error of second order is 1.8 times that
change, but kinks of the contact force let it fall unevenly: as patches open, and where a whole pad lands."""
KNOWN = 1e-6
"""Least bar, in parts of the range, where steps are taken: multipliers are checked to so much."""
STRIDES = 1e-4, 1e-3, 1e-2
"""Lengths to either side of an end between which it is located with finer steps."""
AROUND = Settings(points=60, seconds=10.0)
"""How far a branch is followed with finer steps where these lengths did not hold its end."""


class Bound(NamedTuple):
    """An end of a stable part of a branch."""

    p: float
    error: float = 0.0  # by the bracket
    point: Point | None = None  # the last stable one; None where no steps are taken, or the range ends
    problem: Any = None
    special: Special | None = None  # None where only its neighbours are known
    known: bool = True  # otherwise the motion goes on, and nobody knows how far

    @property
    def bar(self) -> float:
        """The error of p: that of the bracket, and what steps leave open."""
        finer = self.problem.finer(FINER) if self.point is not None else []
        if not finer:
            return self.error
        moved = [self._moved(each) for each in finer]
        return max(self.error, KNOWN) + sum(LEFT_OPEN * abs(p - self.p) if p is not None else 1.0 for p in moved)

    def _moved(self, finer: Any) -> float | None:
        """Where the end is with finer steps; None where it is not found."""
        if self.special is None or self.point is None:
            return None
        newton, at, found = Newton(finer, Settings()), self.special.point, list[Special]()
        finer.use(at.chart)
        for stride in STRIDES:
            ways = (-stride, stride)
            beside = [
                newton.solved(at.z + way * at.tangent, at.tangent, at.tangent, way, exact=True) for way in ways
            ]
            points = [point for point in beside if point is not None]
            if len(points) == len(ways):
                found = special_points(newton, points, lambda: None)[0]
            same = [each.p for each in found if each.kind == self.special.kind]
            if same:
                return min(same, key=lambda p: abs(p - self.p))
        first = newton.solved(self.point.z, self.point.tangent, self.point.tangent, 0.0, exact=True)
        if first is None:
            return None
        found = both_ways(finer, first, AROUND).specials
        same = [each.p for each in found if each.kind == self.special.kind]
        return min(same, key=lambda p: abs(p - self.p), default=None)
