"""The wheel's surface speed U(t), its travel, and the load Q(t): constant or piecewise linear in time.

Before the first knot and after the last a schedule holds its value.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import chain

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.double_double import add, multiply, split, two_sum
from brakecli.solver.kernels import kernel

Schedule = Floats
"""A piecewise linear function of time: `KNOT` numbers for each of its knots."""
KNOT = 7
TIME, VALUE, VALUE_LOW, SLOPE, SLOPE_LOW, INTEGRAL, INTEGRAL_LOW = range(KNOT)
"""A knot: its time (s); value, slope after it and integral from t = 0 as sums of two doubles, to 32 digits."""


def schedule(times: Sequence[float], values: Sequence[float], scale: float = 1.0) -> Schedule:
    """Schedule through (times, scale * values); equal values make a constant. The times increase strictly."""
    if len({*values}) == 1:
        times = (0.0,)
        values = values[:1]
    t = [Fraction(time) for time in times]
    v = [Fraction(value) * Fraction(scale) for value in values]
    slopes = [(v[i + 1] - v[i]) / (t[i + 1] - t[i]) for i in range(len(t) - 1)] + [Fraction(0)]
    integrals = [Fraction(0)]
    for i in range(len(t) - 1):
        integrals.append(integrals[-1] + (v[i] + v[i + 1]) / 2 * (t[i + 1] - t[i]))
    k = max((i for i, time in enumerate(t) if time <= 0), default=0)
    at_zero = integrals[k] - (v[k] - (slopes[k] if t[k] <= 0 else 0) * t[k] / 2) * t[k]
    columns = [v, slopes, [integral - at_zero for integral in integrals]]
    pairs = [[split(value) for value in column] for column in columns]
    return np.array([(float(time), *chain(*parts)) for time, *parts in zip(t, *pairs, strict=True)]).ravel()


def knots(s: Schedule) -> int:
    """How many knots a schedule has; one that is constant has one."""
    return s.size // KNOT


def values(s: Schedule) -> Floats:
    """The values at its knots."""
    return s[VALUE::KNOT]


def times(s: Schedule) -> Floats:
    """The times of its knots, s."""
    return s[TIME::KNOT]


@kernel
def segment(s: Schedule, t: float) -> int:
    """Index of the last knot at or before t, -1 before the first."""
    low = -1
    high = s.size // KNOT
    while high - low > 1:
        middle = (low + high) // 2
        if s[KNOT * middle + TIME] <= t:
            low = middle
        else:
            high = middle
    return low


@kernel
def value_at(s: Schedule, t: float) -> float:
    """Value at time t (s): v_k + s_k (t - t_k) behind the knot k, with its value and slope."""
    if s.size == KNOT:
        return s[VALUE]  # type: ignore[no-any-return]
    k = segment(s, t)
    if k < 0:
        return s[VALUE]  # type: ignore[no-any-return]
    return s[KNOT * k + VALUE] + s[KNOT * k + SLOPE] * (t - s[KNOT * k + TIME])  # type: ignore[no-any-return]


@kernel
def slope_at(s: Schedule, t: float) -> float:
    """Time derivative just after time t."""
    k = segment(s, t)
    return s[KNOT * k + SLOPE] if k >= 0 else 0.0


@kernel
def integral_at(s: Schedule, t: float, t_low: float) -> tuple[float, float]:
    """Integral from 0 to t + t_low, as a sum of two doubles; t_low may be of any size, beyond a knot as well.

    It is I_k + (v_k + s_k τ/2) τ at the time τ behind the knot k.
    """
    t, t_low = two_sum(t, t_low)
    k = max(segment(s, t), 0)
    slope = s[KNOT * k + SLOPE]
    slope_low = s[KNOT * k + SLOPE_LOW]
    if t < s[TIME]:
        slope = 0.0
        slope_low = 0.0
    after, after_low = two_sum(t, -s[KNOT * k + TIME])
    after, after_low = add(after, after_low, t_low, 0.0)
    mean, mean_low = multiply(after, after_low, 0.5 * slope, 0.5 * slope_low)
    mean, mean_low = add(mean, mean_low, s[KNOT * k + VALUE], s[KNOT * k + VALUE_LOW])
    gain, gain_low = multiply(after, after_low, mean, mean_low)
    return add(gain, gain_low, s[KNOT * k + INTEGRAL], s[KNOT * k + INTEGRAL_LOW])
