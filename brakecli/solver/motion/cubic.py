"""What a margin may do between two places: the cubic through its values and slopes there."""

import math

from brakecli.solver.kernels import kernel


@kernel
def lowest(begin: float, slope: float, end: float, rise: float) -> tuple[float, float]:
    """Where between 0 and 1 a cubic is lowest, and its value there; -1 and `end` where it is lowest at a border.

    `slope` and `rise` are its slopes at both ends. It is m_0 + b p + c p² + a p³, and lowest where its slope
    b + 2 c p + 3 a p² vanishes and it bends upwards.
    """
    change = end - begin
    c = 3.0 * change - 2.0 * slope - rise
    a = slope + rise - 2.0 * change
    under = c * c - 3.0 * a * slope
    if not under > 0.0:
        return -1.0, end
    root = math.sqrt(under)
    p = -1.0
    if c > 0.0:
        p = -slope / (c + root)
    elif a != 0.0:
        p = (root - c) / (3.0 * a)
    if not 0.0 < p < 1.0:
        return -1.0, end
    return p, begin + p * (slope + p * (c + p * a))
