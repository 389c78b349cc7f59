"""The coefficients of (6)-(7) from the two inclined links, and the frequencies that follow from them."""

import math
from functools import lru_cache
from typing import Any

from brakecli.solver.coefficients import Coefficients

Pair = tuple[Any, Any]


def coefficients(
    *, mass: float, c_1: float, b_1: float, beta_deg: float, c_2: float, b_2: float, alpha_deg: float, phi: float
) -> Coefficients:
    """Coefficients for link 1 at `beta_deg` to the vertical and link 2 at `alpha_deg` to the friction plane."""
    beta = sin_cos(beta_deg)
    alpha = sin_cos(alpha_deg)
    b_xx, b_xy, b_yy = tensor(b_1, b_2, beta, alpha)
    c_xx, c_xy, c_yy = tensor(c_1, c_2, beta, alpha)
    sin_beta, cos_beta = beta
    return Coefficients(
        m=mass,
        b_xx=b_xx,
        b_xy=b_xy,
        b_yy=b_yy,
        c_xx=c_xx,
        c_xy=c_xy,
        c_yy=c_yy,
        sin_beta=sin_beta,
        cos_beta=cos_beta,
        phi=phi,
    )


def tensor(one: Any, two: Any, beta: Pair, alpha: Pair) -> tuple[Any, Any, Any]:
    """What two links with these stiffnesses, or dampings, make of them: xx, xy, yy; angles by sine and cosine.

    It takes all that can be added and multiplied.
    """
    sin_beta, cos_beta = beta
    sin_alpha, cos_alpha = alpha
    return (
        one * sin_beta**2 + two * cos_alpha**2,
        one * sin_beta * cos_beta - two * sin_alpha * cos_alpha,
        one * cos_beta**2 + two * sin_alpha**2,
    )


@lru_cache(maxsize=256)  # the points of a block are asked for again and again
def natural_frequencies(c: Coefficients, contact_stiffness: float) -> tuple[float, float]:
    """Undamped natural frequencies (Hz, rising) of the shoe on its links and a contact stiffness (N/m)."""
    s_xx = c.c_xx
    s_xy = c.c_xy
    s_yy = c.c_yy + contact_stiffness
    high = 0.5 * (s_xx + s_yy) + math.hypot(0.5 * (s_xx - s_yy), s_xy)
    low = (s_xx * s_yy - s_xy**2) / high if high > 0.0 else 0.0
    return math.sqrt(max(low, 0.0) / c.m) / (2.0 * math.pi), math.sqrt(max(high, 0.0) / c.m) / (2.0 * math.pi)


def sin_cos(degrees: float) -> tuple[float, float]:
    """Sine and cosine, exact at 0 and ±90 degrees, where the links decouple x from y."""
    if abs(degrees) == 90.0:
        return math.copysign(1.0, degrees), 0.0
    return math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
