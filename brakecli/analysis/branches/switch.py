"""From a flip to the motion of twice the period that is born there, and from a branch point to what crosses it."""

import math

import numpy as np

from brakecli.analysis.branches.multipliers import POWERS, product
from brakecli.analysis.branches.newton import FROM_AFAR, LEFT, Newton, Settings
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array, Doubled

DISTANCES: tuple[float, ...] = 1e-2, 3e-3, 1e-3, 3e-4
"""Distances from the flip at which the doubled motion is sought."""


OBLIQUE = 4.0
"""Distances along a branch, over that across it, within which a sheet that crosses it is sought; a choice."""


def flipped(point: Point) -> Array:
    """The eigenvector (d,) of the multiplier nearest to -1, of length one."""
    total, log = product(point.maps)
    values, vectors = np.linalg.eig(total * math.exp(min(log, POWERS)))
    vector = vectors[:, int(np.argmin(np.abs(values + 1.0)))].real
    return np.asarray(vector / np.linalg.norm(vector))


def switch(problem: Doubled, point: Point, settings: Settings | None = None) -> Point | None:
    """A first point on the branch of doubled motions, with a tangent away from the flip; None if none is found.

    The plane in which it is sought lies across the doubled direction, at a distance from the flip. The motion of
    the single period crosses that plane only far away.
    """
    u, direction = problem.double(point, flipped(point))
    onward = direction / math.sqrt(direction @ direction)
    newton = Newton(problem, settings or Settings())
    flip = np.append(u, point.p)
    for distance in DISTANCES:
        new = newton.solve(flip + distance * onward, onward, onward, 0.0, exact=True, most=FROM_AFAR)
        if new is not None:
            off = new.z - flip - distance * onward
            if math.sqrt(off @ off) < LEFT * distance:
                return new
    return None


def crossing_sheet(newton: Newton, point: Point, way: Array) -> list[Point]:
    """First points on both sides of a branch, of the sheet that crosses it at a branch point, or nearly does.

    At a branch point the derivative by unknowns and parameter has two null vectors; of sheets that nearly meet
    the second one is nearly null. A plane across the `way` of the branch, at a distance, holds one motion near
    by: the other sheet's. That way is told by the neighbours, as the tangent turns where sheets nearly meet.
    """
    newton.problem.use(point.chart)
    evaluation = newton.evaluate(point.z, True)
    if evaluation is None or evaluation.by_p is None:
        return []
    nearly_null = np.linalg.svd(np.column_stack([evaluation.by_u, evaluation.by_p]))[2][-2:]
    across = nearly_null.T @ np.array([-(nearly_null[1] @ way), nearly_null[0] @ way])
    across /= math.sqrt(across @ across)
    sheet: list[Point] = []
    for onward in (across, -across):
        for distance in DISTANCES:
            guess = point.z + distance * onward
            new = newton.solve(guess, onward, onward, 0.0, exact=True, most=FROM_AFAR)
            if new is not None and new.word == point.word and np.abs(new.z - guess).max() < OBLIQUE * distance:
                sheet.append(new)
                break
    return sheet
