"""The first event in a step: which margin of the phase runs out, and where, on the series of the motion."""

from typing import Any

from numba import float64, int64, types

from brakecli.solver.automaton import SOONER, STICK
from brakecli.solver.compile import kernel
from brakecli.solver.double_double import EPSILON
from brakecli.solver.motions import BELT, FLOW_TYPE, LOAD, MARGINS, SIZE, TERMS, V_X, V_Y, X, Y

NO_EVENT = -1
ROUNDING = 8.0 * EPSILON
"""Rounding of a margin over the sum of its terms."""
_LOOKS = 12  # how often a margin that begins at zero is sought above it
_MOST_STEPS = 200  # of a search for a root; halving alone takes 53 from a bracket that does not begin at 0


@kernel(types.UniTuple(float64, 2)(FLOW_TYPE, int64, float64))
def _value(m: Any, row: int, theta: float) -> tuple[float, float]:
    """A polynomial Σ p_k θ^k and its slope at a part θ of the span."""
    of = m.polynomial
    q = theta * theta
    value = 0.0
    slope = 0.0
    odd = 0.0
    odd_slope = 0.0
    for k in range(TERMS - 2, -1, -2):  # even and odd powers apart, which do not wait for each other
        slope = slope * q + value
        odd_slope = odd_slope * q + odd
        value = value * q + of[row, k]
        odd = odd * q + of[row, k + 1]
    return value + theta * odd, odd + 2.0 * theta * (slope + theta * odd_slope)


@kernel(float64(FLOW_TYPE, int64, float64, float64), inlined=False)
def root(m: Any, row: int, left: float, right: float) -> float:
    """Where a polynomial falls through zero between left and right: Newton's iteration, kept in the bracket."""
    first = m.polynomial[row, 0] if left == 0.0 else _value(m, row, left)[0]
    last = _value(m, row, right)[0]
    place = left + (right - left) * first / (first - last) if first > 0.0 > last else right
    for _ in range(_MOST_STEPS):
        value, slope = _value(m, row, place)
        if value > 0.0:
            left = place
        else:
            right = place
        if slope < 0.0 and abs(value) <= -EPSILON * place * slope:
            break
        new = place - value / slope if slope < 0.0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
        if not left < new < right:
            break
        place = new
    return place


@kernel(types.UniTuple(float64, 3)(FLOW_TYPE, int64), inlined=False)
def _follow(m: Any, which: int) -> tuple[float, float, float]:
    """A margin on the series as a polynomial Σ (m z_k) θ^k: its value and slope at the end, and its rounding."""
    row = m.margins[m.phase, :, 4 + which]
    z = m.series
    of = m.polynomial
    x = row[X]
    y = row[Y]
    v_x = row[V_X]
    v_y = row[V_Y]
    for k in range(TERMS):
        of[0, k] = (x * z[k, X] + y * z[k, Y]) + (v_x * z[k, V_X] + v_y * z[k, V_Y])
    of[0, 1] += row[BELT] * z[1, BELT] + row[LOAD] * z[1, LOAD]
    terms = 0.0
    value = 0.0
    slope = 0.0
    for i in range(SIZE):
        terms += abs(row[i] * z[0, i])
        if i > V_Y:
            of[0, 0] += row[i] * z[0, i]
    for k in range(TERMS - 1, -1, -1):
        value = value + of[0, k]
        slope = slope + k * of[0, k]
        terms = terms + abs(of[0, k])
    return value, slope, ROUNDING * terms


@kernel(types.Tuple((int64, float64))(FLOW_TYPE), inlined=False)
def first_event(m: Any) -> tuple[int, float]:
    """The margin that runs out first on the series, and at which part of the span; 0 if it never was positive."""
    found = NO_EVENT
    first = 1.0
    for which in range(MARGINS if m.phase == STICK else MARGINS - 1):
        last, slope, allowed = _follow(m, which)
        start = m.polynomial[0, 0]
        right = 0.0
        if start < -allowed:
            return which, 0.0
        if last < -allowed:
            right = 1.0
        elif m.polynomial[0, 1] < 0.0 < slope:  # it is lowest inside
            for k in range(1, TERMS):
                m.polynomial[1, k - 1] = -k * m.polynomial[0, k]
            place = root(m, 1, 0.0, 1.0)
            right = place if _value(m, 0, place)[0] < -allowed else 0.0
        if right == 0.0:
            continue
        left = 0.0
        if start <= allowed:  # it begins at zero: where is it positive?
            left = right
            for _ in range(_LOOKS):
                left *= SOONER
                if _value(m, 0, left)[0] > allowed:
                    break
            else:
                return which, 0.0
        place = root(m, 0, left, right)
        if place < first:
            found = which
            first = place
    return found, first
