"""Whether disturbances of steady sliding decay, and where rounding leaves that open.

Routh and Hurwitz's conditions are polynomials of a case's numbers, so that the rounding of each is known. That of
eigenvalues has no useful bound where two of them meet, as those of lightly damped shoes nearly do.
"""

import math
from typing import NamedTuple, Self

import numpy as np

from brakecli.analysis.stability.modes import routh_hurwitz
from brakecli.case.case import Case
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.links import sin_cos, tensor

EPSILON = float(np.finfo(float).eps)  # twice what a rounding may be off by, so that bounds hold their own rounding


class Rounded:
    """A number and how far it may be from the one that exact arithmetic gives."""

    __slots__ = ("error", "value")

    def __init__(self, value: float, error: float = 0.0) -> None:
        """Hold an exact number, or one with a bound of its error."""
        self.value = value
        self.error = error

    def __add__(self, other: Self) -> "Rounded":
        """Both errors add up."""
        value = self.value + other.value
        return Rounded(value, self.error + other.error + EPSILON * abs(value))

    def __sub__(self, other: Self) -> "Rounded":
        """Both errors add up."""
        value = self.value - other.value
        return Rounded(value, self.error + other.error + EPSILON * abs(value))

    def __mul__(self, other: Self) -> "Rounded":
        """Relative errors add up."""
        value = self.value * other.value
        spread = abs(self.value) * other.error + self.error * (abs(other.value) + other.error)
        return Rounded(value, spread + EPSILON * abs(value))

    def __pow__(self, power: int) -> "Rounded":
        """Only the square."""
        return self * self if power == 2 else NotImplemented

    @property
    def negative(self) -> bool:
        """Whether it is surely below zero."""
        return self.value < -self.error

    @property
    def positive(self) -> bool | None:
        """Whether it is above zero; None where zero lies within the error."""
        return None if abs(self.value) <= self.error else self.value > 0.0


class Links(NamedTuple):
    """What the conditions take of a case, rounded; b and c: xx, xy and yy, as in (6)-(7)."""

    m: Rounded
    b: tuple[Rounded, Rounded, Rounded]
    c: tuple[Rounded, Rounded, Rounded]
    pressed: Rounded  # the load that is left on a contact without friction, over Q/cxx


def links_of(case: Case) -> Links:
    """The links of a case; a force that points away from the wheel presses nothing."""
    one = case.link1
    two = case.link2
    beta = _inclined(one.angle_deg)
    alpha = _inclined(two.angle_deg)
    b = tensor(Rounded(one.damping), Rounded(two.damping), beta, alpha)
    c = tensor(Rounded(one.stiffness), Rounded(two.stiffness), beta, alpha)
    return Links(Rounded(case.shoe.mass), b, c, c[0] * beta[1] - c[1] * beta[0])


def links_with(c: Coefficients) -> Links:
    """The links by the coefficients of a system, each of which is rounded."""
    b = _rounded(c.b_xx), _rounded(c.b_xy), _rounded(c.b_yy)
    stiffness = _rounded(c.c_xx), _rounded(c.c_xy), _rounded(c.c_yy)
    return Links(_rounded(c.m), b, stiffness, _rounded(c.c_xx * c.sin_beta - c.c_xy * c.cos_beta))


def _rounded(value: float) -> Rounded:
    return Rounded(value, EPSILON * abs(value))


def _inclined(degrees: float) -> tuple[Rounded, Rounded]:
    """Sine and cosine of an angle, whose conversion to radians is rounded, too."""
    sine, cosine = sin_cos(degrees)
    angle = abs(math.radians(degrees))
    if degrees in (0.0, 90.0, -90.0):
        return Rounded(sine), Rounded(cosine)
    off = EPSILON * angle
    return (
        Rounded(sine, EPSILON * abs(sine) + off * abs(cosine)),
        Rounded(cosine, EPSILON * abs(cosine) + off * abs(sine)),
    )


def conditions(links: Links, contact_stiffness: float, grip: float) -> list[Rounded]:
    """What is positive where all disturbances decay, U ≠ 0; the contact stiffness K in N/m, grip = sign(U) φ."""
    k = Rounded(contact_stiffness, EPSILON * contact_stiffness)
    damped = links.b[0].value + links.b[2].value != 0.0
    return routh_hurwitz(links.m, links.b, links.c, k, Rounded(grip), damped=damped)
