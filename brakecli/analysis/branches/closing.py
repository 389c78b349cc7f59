"""Whether a branch has come back: to its first point, or over itself."""

import math
from collections.abc import Sequence

import numpy as np

from brakecli.analysis.branches.newton import Newton, zero
from brakecli.analysis.branches.point import End, Point

LEAST_LOOP = 8
"""A closed branch turns by 2π, so it has more points than this: each stride turns by at most 0.7 rad."""
TURNED_BACK = End("lost", "it is lost: it has turned back on itself")
SHARP = 0.7
"""Cosine of the angle by which a branch turns at a sharp corner."""
SAME_PLACE = 1e-7
"""Distance at which two points are one; corrections end at about 1e-12."""
SAME_WAY = 0.999
"""Least cosine of the angle between the tangents of two points that are one."""


def turned_back(points: list[Point], new: Point, border: float) -> bool:
    """Whether the branch has come back across a border and runs back over itself."""
    if new.word == points[-1].word:
        return False
    reach = 10.0 * border  # within so many strides across a border it meets a late point again
    for point in points[:-21:-1]:
        if point.chart is new.chart and point.word == new.word:
            chord = new.z - point.z
            return bool(math.sqrt(chord @ chord) < reach and new.tangent @ point.tangent < -SAME_WAY)
    return False


def find_passed(points: Sequence[Point], here: Point, new: Point) -> list[Point]:
    """The nearest of these points, if any, that a stride passes on its way along their stretch of a branch.

    Newton's method may go over to another branch where two cross, or nearly meet. Then it may be one that has
    been followed, or a closed one is entered, whose first point is not that of the walk.
    """
    chord = new.z - here.z
    way = new.s - here.s
    beside = [
        point
        for point in points
        if abs(point.p - new.p) <= way
        and point.chart is new.chart
        and point.word == new.word
        and abs(float(point.tangent @ new.tangent)) > SHARP
        and float(np.abs(point.z - new.z).max()) <= way
        and 0.0 <= float(chord @ (point.z - here.z)) <= float(chord @ chord)
    ]
    return sorted(beside, key=lambda point: float(np.abs(point.z - new.z).max()))[:1]


def closing(newton: Newton, first: Point, here: Point, new: Point) -> tuple[Point | None, End | None]:
    """The last point and the end of a branch that has come back to its first point; None where it has not.

    Where a stride crosses the plane across the first tangent, the crossing is bracketed on this branch until
    no other one can be mistaken for it, and then compared with the first point: place and direction.
    """
    if here.chart is not new.chart or here.word != new.word or here is first:
        return None, None
    foreign = new.chart is not first.chart
    if foreign and abs(first.tangent[-1]) < 1e-3:
        return None, None  # the parameter alone does not say where it passes the first point

    def ahead(point: Point) -> float:
        if foreign:
            return float((point.z[-1] - first.z[-1]) * first.tangent[-1])
        return float((point.z - first.z) @ first.tangent)

    if ahead(here) * ahead(new) > 0.0:
        return None, None
    if not foreign:
        away = here.z - first.z
        if math.sqrt(away @ away) > 4.0 * (new.s - here.s):
            return None, None  # so many strides from the first point it passes elsewhere; a choice
    one = here
    other = new
    for _ in range(7):  # a choice: what is wider then is compared all the same
        low = ahead(one)
        high = ahead(other)
        middle = newton.between(one, other, zero(low, high))
        if middle is None or middle.word != here.word:
            return None, None
        if ahead(middle) == 0.0 or other.s - one.s < 1e-7:
            one = middle
            break
        one, other = (middle, other) if low * ahead(middle) > 0.0 else (one, middle)
    nearest = min((one, other), key=lambda point: abs(ahead(point)))
    guess = nearest.z
    onward = nearest.tangent
    chart = new.chart
    if foreign:
        in_chart = newton.problem.carry(nearest, first.chart)
        if in_chart is None:
            return None, None
        guess = np.append(in_chart[0], nearest.p)
        onward = in_chart[1]
        chart = first.chart
    newton.problem.use(chart)
    guess = guess - first.tangent * ((guess - first.z) @ first.tangent)
    crossing = newton.solve(guess, first.tangent, onward, nearest.s, exact=True)
    if crossing is None or crossing.word != first.word:
        return None, None
    # corrections end at about 1e-12; carrying a point to another chart is less exact
    if float(np.abs(crossing.z - guess).max()) > (1e-4 if foreign else SAME_PLACE):
        return None, None
    if float(np.abs(crossing.z - first.z).max()) > SAME_PLACE:
        return None, None
    cosine = float(crossing.tangent @ first.tangent)
    if cosine > SAME_WAY:
        return crossing, End("closed", "it is closed: it comes back to its first point")
    if cosine < -SAME_WAY:
        return None, TURNED_BACK
    return None, None
