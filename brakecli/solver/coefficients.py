"""The constants of the equations of motion; nothing here waits for compiled code."""

import math
from typing import NamedTuple


class Coefficients(NamedTuple):
    """The constants of (6)-(7) and of the friction law, in the paper's symbols (SI units)."""

    m: float
    b_xx: float
    b_xy: float
    b_yy: float
    c_xx: float
    c_xy: float
    c_yy: float
    sin_beta: float  # Q_x = Q sin(beta)
    cos_beta: float  # Q_y = Q cos(beta)
    phi: float

    def grip(self, belt: float) -> float:
        """φ sign(U), the friction force of steady sliding over the normal force; 0 where the wheel stands."""
        return math.copysign(self.phi, belt) if belt else 0.0


def fastest_decay(c: Coefficients) -> float:
    """A bound (1/s) on how fast anything decays: the largest eigenvalue of the dashpots over the mass.

    With v' B v/m = β for the velocity v of a mode, λ² + β λ + κ = 0: real parts are -β at least, as κ >= 0.
    """
    mean = 0.5 * (c.b_xx + c.b_yy)
    return (mean + math.hypot(0.5 * (c.b_xx - c.b_yy), c.b_xy)) / c.m
