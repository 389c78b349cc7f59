"""The first event in a step: which margin of the phase runs out, and where, on the series of the motion."""

from typing import Any

from brakecli.solver.block import BELT, LOAD, MARGINS, SIZE, TERMS, V_X, V_Y, X, Y
from brakecli.solver.double_double import EPSILON
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.exact import ROUNDING, unseen
from brakecli.solver.phases import SOONER, STICK

NO_EVENT = -1
_SMALLEST = 2.0**-12  # part of a span that is looked at for a dip
_LOOKS = 12  # how often a margin that begins at zero is sought above it
_MOST_STEPS = 200  # of a search for a root; halving alone takes 53 from a bracket that does not begin at 0


@kernel
def _value(e: Any, row: int, theta: float) -> tuple[float, float]:
    """A polynomial Σ p_k θ^k and its slope at a part θ of the span."""
    of = e.polynomial
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


@kernel(inline=False)
def root(e: Any, row: int, left: float, right: float) -> float:
    """Where a polynomial falls through zero between left and right: Newton's iteration, kept in the bracket."""
    first = e.polynomial[row, 0] if left == 0.0 else _value(e, row, left)[0]
    last = _value(e, row, right)[0]
    place = left + (right - left) * first / (first - last) if first > 0.0 > last else right
    for _ in range(_MOST_STEPS):
        value, slope = _value(e, row, place)
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


@kernel(inline=False)
def _follow(e: Any, phase: int, which: int) -> float:
    """A margin on the series as a polynomial Σ (m z_k) θ^k, and minus its slope as another; its rounding."""
    row = e.margins[phase, :, 4 + which]
    z = e.series
    of = e.polynomial
    x = row[X]
    y = row[Y]
    v_x = row[V_X]
    v_y = row[V_Y]
    for k in range(TERMS):
        of[0, k] = (x * z[k, X] + y * z[k, Y]) + (v_x * z[k, V_X] + v_y * z[k, V_Y])
    of[0, 1] += row[BELT] * z[1, BELT] + row[LOAD] * z[1, LOAD]
    terms = 0.0
    for i in range(SIZE):
        terms += abs(row[i] * z[0, i])
        if i > V_Y:
            of[0, 0] += row[i] * z[0, i]
    of[1, TERMS - 1] = 0.0
    for k in range(TERMS - 1, -1, -1):
        terms = terms + abs(of[0, k])
        if k > 0:
            of[1, k - 1] = -k * of[0, k]
    return ROUNDING * terms


@kernel(inline=False)
def _below(e: Any, allowed: float) -> float:
    """The first place found at which a margin is negative beyond its rounding; 0 where it surely is nowhere so.

    A piece of the span is passed where a bound proves it, or where the polynomial bends one way all over it, so
    that it is lowest at an end, or where its slope vanishes; another one is halved.
    """
    of = e.polynomial
    far = 0.0
    bound = 0.0
    for k in range(1, TERMS):
        far += abs(of[0, k])
        bound += k * (k - 1) * (k - 2) * abs(of[0, k])
    if far < of[0, 0]:
        return 0.0
    left = 0.0
    width = 1.0
    while left < 1.0:
        half = 0.5 * width
        right = min(left + width, 1.0)
        value, slope = _value(e, 0, left + half)
        bend = -_value(e, 1, left + half)[1]
        change = bound * half  # of the bend, up to an end
        clear = value - (abs(slope) + 0.5 * (abs(bend) + change) * half) * half > 0.0
        if not clear and -change < bend < change and half > _SMALLEST:
            width = half
            continue
        if not clear:
            if bend > 0.0 and _value(e, 1, left)[0] > 0.0 > _value(e, 1, right)[0]:
                place = root(e, 1, left, right)
                if _value(e, 0, place)[0] < -allowed:
                    return place
            if _value(e, 0, right)[0] < -allowed:
                return right
        left = right
        width = min(2.0 * width, 1.0 - left)
    return 0.0


@kernel(inline=False)
def first_event(e: Any, phase: int, mass: float, span: float) -> tuple[int, float]:
    """The margin that runs out first on the series, and at which part of the span; 0 if it never was positive.

    A shoe of this mass (kg) sticks although it lacks a little, see `exact.unseen`; the span is in s.
    """
    found = NO_EVENT
    first = 1.0
    for which in range(MARGINS if phase == STICK else MARGINS - 1):
        allowed = _follow(e, phase, which)
        start = e.polynomial[0, 0]
        if start < -allowed:
            if phase != STICK or start < -unseen(mass, e.series[0, BELT], e.polynomial[0, 1] / span):
                return which, 0.0
            allowed = -start
        right = _below(e, allowed)
        if right == 0.0:
            continue
        left = 0.0
        if start <= allowed:  # it begins at zero: where is it positive?
            left = right
            for _ in range(_LOOKS):
                left *= SOONER
                if _value(e, 0, left)[0] > allowed:
                    break
            else:
                return which, 0.0
        place = root(e, 0, left, right)
        if place < first:
            found = which
            first = place
    return found, first
