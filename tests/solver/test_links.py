"""The coefficients of the links, against the energy and the power of two inclined springs and dashpots."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.links import coefficients

EPS = 2.0**-52
stiffness = st.floats(0, 1e12)
angle = st.floats(-90, 90)


def links(c_1: float, b_1: float, beta: float, c_2: float, b_2: float, alpha: float) -> Coefficients:
    return coefficients(mass=3.0, c_1=c_1, b_1=b_1, beta_deg=beta, c_2=c_2, b_2=b_2, alpha_deg=alpha, phi=0.3)


@given(stiffness, stiffness, angle, stiffness, stiffness, angle, st.floats(0, 360))
def test_the_coefficients_are_the_energy_of_the_links(
    c_1: float, b_1: float, beta: float, c_2: float, b_2: float, alpha: float, towards: float
) -> None:
    """A displacement r stretches a link of direction u by u·r, so that the energy is the sum of c (u·r)²/2."""
    c = links(c_1, b_1, beta, c_2, b_2, alpha)
    r = np.array([math.cos(math.radians(towards)), math.sin(math.radians(towards))])
    # Link 1 leans by beta from the vertical (y) towards x; link 2 leads away along x and rises by alpha against x.
    u_1 = rotated((0.0, 1.0), -beta)
    u_2 = rotated((1.0, 0.0), -alpha)
    for one, two, xx, xy, yy in ((c_1, c_2, c.c_xx, c.c_xy, c.c_yy), (b_1, b_2, c.b_xx, c.b_xy, c.b_yy)):
        energy = 0.5 * one * float(u_1 @ r) ** 2 + 0.5 * two * float(u_2 @ r) ** 2
        quadratic = 0.5 * (xx * r[0] ** 2 + 2 * xy * r[0] * r[1] + yy * r[1] ** 2)
        # Some ten roundings of terms that are at most one + two.
        assert quadratic == pytest.approx(energy, rel=0, abs=16 * EPS * (one + two))
        # No direction can give energy away.
        assert xx >= 0
        assert yy >= 0
        assert xx * yy - xy**2 >= -16 * EPS * (one + two) ** 2


def rotated(u: tuple[float, float], degrees: float) -> NDArray[np.float64]:
    """The vector turned anticlockwise."""
    sine = math.sin(math.radians(degrees))
    cosine = math.cos(math.radians(degrees))
    return np.array([cosine * u[0] - sine * u[1], sine * u[0] + cosine * u[1]])


@given(angle)
def test_the_load_acts_along_link_one(beta: float) -> None:
    """The reaction of link 1 and the load share one direction: (sin beta, cos beta)."""
    c = links(1e6, 0.0, beta, 0.0, 0.0, 0.0)
    along = np.array([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy]]) @ [c.sin_beta, c.cos_beta]
    np.testing.assert_allclose(along, 1e6 * np.array([c.sin_beta, c.cos_beta]), rtol=0, atol=1e6 * 16 * EPS)
    assert c.sin_beta**2 + c.cos_beta**2 == pytest.approx(1.0, rel=4 * EPS)


def test_mass_and_friction_pass_through() -> None:
    c = links(1.0, 1.0, 10.0, 1.0, 1.0, 10.0)
    assert (c.m, c.phi) == (3.0, 0.3)
