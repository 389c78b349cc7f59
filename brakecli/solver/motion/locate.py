"""The first event in a step: which margin of the phase runs out, and where, on the series of the motion."""

from brakecli.solver.block import BELT, LOAD, MARGINS, SIZE, TERMS, V_X, V_Y, Exact, X, Y
from brakecli.solver.double_double import EPSILON
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.exact import ROUNDING, unseen
from brakecli.solver.phases import SOONER, STICK

NO_EVENT = -1


@kernel
def _value(e: Exact, row: int, theta: float) -> tuple[float, float]:
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
def root(e: Exact, row: int, low: float, high: float) -> float:
    """Where a polynomial falls through zero between left and right: Newton's iteration, kept in the bracket."""
    first = e.polynomial[row, 0] if low == 0.0 else _value(e, row, low)[0]
    last = _value(e, row, high)[0]
    theta = low + (high - low) * first / (first - last) if first > 0.0 > last else high
    for _ in range(200):  # halving alone takes 53 from a bracket that does not begin at 0
        value, slope = _value(e, row, theta)
        if value > 0.0:
            low = theta
        else:
            high = theta
        if slope < 0.0 and abs(value) <= -EPSILON * theta * slope:
            break
        new = theta - value / slope if slope < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if not low < new < high:
            break
        theta = new
    return theta


@kernel(inline=False)
def _follow(e: Exact, phase: int, which: int) -> float:
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
def _below(e: Exact, allowed: float) -> float:
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
    begin = 0.0
    width = 1.0
    while begin < 1.0:
        half = 0.5 * width
        end = min(begin + width, 1.0)
        value, slope = _value(e, 0, begin + half)
        bend = -_value(e, 1, begin + half)[1]
        change = bound * half  # of the bend, up to an end
        clear = value - (abs(slope) + 0.5 * (abs(bend) + change) * half) * half > 0.0
        if not clear and -change < bend < change and half > 2.0**-12:  # of the span
            width = half
            continue
        if not clear:
            if bend > 0.0 and _value(e, 1, begin)[0] > 0.0 > _value(e, 1, end)[0]:
                dip = root(e, 1, begin, end)
                if _value(e, 0, dip)[0] < -allowed:
                    return dip
            if _value(e, 0, end)[0] < -allowed:
                return end
        begin = end
        width = min(2.0 * width, 1.0 - begin)
    return 0.0


@kernel(inline=False)
def first_event(e: Exact, phase: int, mass: float, span: float) -> tuple[int, float]:
    """The margin that runs out first on the series, and at which part of the span; 0 if it never was positive.

    A shoe of this mass (kg) sticks although it lacks a little, see `exact.unseen`; the span is in s.
    """
    event = NO_EVENT
    first = 1.0
    for which in range(MARGINS if phase == STICK else MARGINS - 1):
        allowed = _follow(e, phase, which)
        start = e.polynomial[0, 0]
        if start < -allowed:
            if phase != STICK or start < -unseen(mass, e.series[0, BELT], e.polynomial[0, 1] / span):
                return which, 0.0
            allowed = -start
        high = _below(e, allowed)
        if high == 0.0:
            continue
        low = 0.0
        if start <= allowed:  # it begins at zero: where is it positive?
            low = high
            for _ in range(12):
                low *= SOONER
                if _value(e, 0, low)[0] > allowed:
                    break
            else:
                return which, 0.0
        theta = root(e, 0, low, high)
        if theta < first:
            event = which
            first = theta
    return event, first
