"""The root of a function of one number, in a bracket."""

import math
from collections.abc import Callable
from typing import NamedTuple


class _Place(NamedTuple):
    x: float
    f: float


def bracketed_root(
    function: Callable[[float], float],
    low: float,
    high: float,
    *,
    absolute: float = 0.0,
) -> float:
    """Where a function that has other signs at both ends passes zero, to `absolute` or four units of rounding.

    By inverse quadratic interpolation where it is sure to hit the bracket, else by halves: T. R. Chandrupatla,
    Advances in Engineering Software 28 (1997) 145-149. Raises ValueError where both ends have one sign.
    """
    new = _Place(low, function(low))
    end = _Place(high, function(high))
    if not min(new.f, end.f) <= 0.0 <= max(new.f, end.f):
        raise ValueError(f"no root between {low!r} and {high!r}: {new.f!r} there, and {end.f!r}")
    share = 0.5
    while True:
        best = new if abs(new.f) < abs(end.f) else end
        near = absolute + 4.0 * math.ulp(1.0) * abs(best.x)
        least = 0.5 * near / abs(end.x - new.x) if end.x != new.x else 1.0
        if least > 0.5 or best.f == 0.0:
            return best.x
        x = new.x + min(max(share, least), 1.0 - least) * (end.x - new.x)
        tried = _Place(x, function(x))
        if (tried.f > 0.0) is (new.f > 0.0):
            third = new
        else:
            third = end
            end = new
        new = tried
        share = _interpolated(new, end, third)


def _interpolated(new: _Place, end: _Place, third: _Place) -> float:
    """Part of the way from `new` to `end` where x, as a parabola of the values, is zero; half if it bends more."""
    if end.f == third.f:
        return 0.5
    way = (new.x - end.x) / (third.x - end.x)
    rise = (new.f - end.f) / (third.f - end.f)
    if not (rise**2 < way and (1.0 - rise) ** 2 < 1.0 - way):
        return 0.5
    straight = new.f / (end.f - new.f) * third.f / (end.f - third.f)
    bent = (third.x - new.x) / (end.x - new.x) * new.f / (third.f - new.f) * end.f / (third.f - end.f)
    return straight + bent
