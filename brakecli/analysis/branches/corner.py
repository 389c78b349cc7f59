"""Corners of a branch: how it goes on beyond a border at which it turns sharply."""

import math
from dataclasses import replace

import numpy as np

from brakecli.analysis.branches.newton import Newton
from brakecli.analysis.branches.point import Point


def beyond_corner(newton: Newton, here: Point) -> Point | None:
    """Go on beyond a border at which the branch turns sharply.

    Just beyond the border the tangent of the other side is the null vector of the derivatives. Only one of its
    two directions stays on the other side.
    """
    for reach in (1e-5, 1e-4, 1e-3, 5e-3):
        beside = here.z + reach * here.tangent
        for _ in range(2):  # the second time, from a place on the tangent of the other side
            evaluation = newton.evaluate(beside, True)
            if evaluation is None or evaluation.by_p is None or evaluation.word == here.word:
                break
            rows = np.column_stack([evaluation.by_u, evaluation.by_p])
            if not np.isfinite(rows).all():
                break
            onward = np.linalg.svd(rows)[2][-1]
            for length in (times * reach for times in (0.1, 1.0, 10.0)):
                for way in (onward, -onward):
                    # Newton's method begins beyond the border: from this side it would find this side again
                    guess = beside + (length - (beside - here.z) @ way) * way
                    new = newton.solve(guess, way, way, 0.0)
                    if new is None or new.word != evaluation.word:
                        new = newton.solve(here.z + length * way, way, way, 0.0)
                    if new is None or new.word != evaluation.word or not newton.holds(new):
                        continue
                    chord = new.z - here.z
                    distance = math.sqrt(chord @ chord)
                    new.s = here.s + distance
                    # a point farther beyond the border belongs to another branch
                    led = led_on(newton, here, new, length) if distance < 5.0 * length + reach else None
                    if led is not None:
                        return led
            beside = here.z + reach * onward
        newton.last = evaluation
    return None


def led_on(newton: Newton, here: Point, new: Point, length: float) -> Point | None:
    """A point just beyond a border, with its tangent away from the border; None if neither way leads on."""
    one = new.z - here.z
    for point in (new, replace(new.turned(), s=new.s)):
        guess = point.z + length * point.tangent
        further = newton.solve(guess, point.tangent, point.tangent, 0.0)
        if further is not None and further.word == new.word and newton.holds(further):
            other = further.z - here.z
            if float(other @ other) > float(one @ one):
                return point
    return None
