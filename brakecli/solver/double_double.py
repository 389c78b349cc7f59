"""Arithmetic with twice the digits of a double, for the travel of the wheel: after hours it is 10^7 m, of which
the roughness needs the last nanometres. A number is an unevaluated sum high + low.

T. J. Dekker, Numer. Math. 18 (1971) 224-242; the products are split because no fused multiply-add is at hand.
"""

from fractions import Fraction

from brakecli.solver.kernels import kernel

EPSILON = 2.220446049250313e-16
"""Distance from 1 to the next number."""
ROUNDING = 4.0 * EPSILON
"""Rounding of a sum of few terms, over their sizes."""
_SPLITTER = 134217729.0  # 2^27 + 1


def split(value: Fraction) -> tuple[float, float]:
    """The two doubles whose sum is nearest to an exact value."""
    high = float(value)
    return high, float(value - Fraction(high))


@kernel
def two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b, exactly."""
    s = a + b
    v = s - a
    return s, (a - (s - v)) + (b - v)


@kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """a b, exactly, unless it overflows (above about 1e300)."""
    p = a * b
    t = _SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = _SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


@kernel
def add(a: float, a_low: float, b: float, b_low: float) -> tuple[float, float]:
    """(a + a_low) + (b + b_low) to about 32 digits of the larger of the two, not of a difference."""
    s, e = two_sum(a, b)
    return two_sum(s, e + (a_low + b_low))


@kernel
def multiply(a: float, a_low: float, b: float, b_low: float) -> tuple[float, float]:
    """(a + a_low)(b + b_low) to about 32 digits."""
    p, e = two_product(a, b)
    return two_sum(p, e + (a * b_low + a_low * b))
