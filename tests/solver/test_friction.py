"""The minimisation that a step comes down to: against brute force, its optimality and the edges of stick."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from brakecli.solver.friction import minimise, slopes
from tests.campaign import campaign

EPS = 2.0**-52
magnitudes = st.floats(-6, 6).map(lambda power: 10.0**power)
signed = st.one_of(st.just(0.0), magnitudes, magnitudes.map(lambda value: -value))


@st.composite
def problems(draw: st.DrawFn) -> tuple[float, float, float, float, float, float, float]:
    """a11, a12, a22, g1, g2, g0, U with a positive definite: a12² <= 0.98 a11 a22."""
    a_11 = draw(magnitudes)
    a_22 = draw(magnitudes)
    a_12 = draw(st.just(0.0) | st.floats(1e-6, 0.99) | st.floats(-0.99, -1e-6)) * math.sqrt(a_11 * a_22)
    return a_11, a_12, a_22, draw(signed), draw(signed), draw(st.just(0.0) | magnitudes), draw(signed)


Problem = tuple[float, float, float, float, float, float, float]


def rounding(problem: Problem) -> float:
    """What rounding may do to d: a few units in the last place of every term of (g1 a22 - g2 a12 ± g0 a22)/a, and
    of a = a11 a22 - a12², whose own digits cancel.
    """
    a_11, a_12, a_22, g_1, g_2, g_0, belt = problem
    a = a_11 * a_22 - a_12**2
    terms = (abs(g_1) * a_22 + abs(g_2 * a_12) + g_0 * a_22) / a
    return 4 * EPS * (terms * (a_11 * a_22 + a_12**2) / a + abs(belt))


def rounding_of_e(problem: Problem) -> float:
    a_11, a_12, a_22, g_1, g_2, g_0, belt = problem
    a = a_11 * a_22 - a_12**2
    terms = (abs(g_2) * a_11 + abs(g_1 * a_12) + g_0 * abs(a_12)) / a
    return 4 * EPS * (terms * (a_11 * a_22 + a_12**2) / a + (abs(g_2) + abs(a_12 * belt)) / a_22)


@given(problems())
def test_the_subdifferential_holds_zero_at_the_minimiser(problem: Problem) -> None:
    a_11, a_12, a_22, g_1, g_2, g_0, belt = problem
    d, e, side = minimise(*problem)
    tolerance_d = rounding(problem)
    tolerance_e = rounding_of_e(problem)
    # Rounding in d and e, carried through the gradient, and the gradient's own.
    by_e = abs(a_12) * tolerance_d + a_22 * tolerance_e + 4 * EPS * (abs(a_12 * d) + abs(a_22 * e) + abs(g_2))
    assert a_12 * d + a_22 * e == pytest.approx(g_2, rel=0, abs=by_e)
    by_d = a_11 * tolerance_d + abs(a_12) * tolerance_e + 4 * EPS * (abs(a_11 * d) + abs(a_12 * e) + abs(g_1))
    force = a_11 * d + a_12 * e - g_1  # the friction force of this d, -g0 sign(d - U)
    if side == 0.0:
        assert d == belt
        assert abs(force) <= g_0 + by_d
    else:
        assert math.copysign(1.0, d - belt) == side
        assert force == pytest.approx(-side * g_0, rel=0, abs=by_d)


@given(problems(), st.sampled_from([-1.0, 1.0]), st.integers(-4, 4))
def test_both_edges_of_stick_are_passed_without_a_jump(problem: Problem, side: float, steps: int) -> None:
    """g1 such that the free minimiser lies a bound away from the belt, and some units in the last place off.

    Beyond the other edge of stick it may be only where both edges are one within rounding.
    """
    a_11, a_12, a_22, _, g_2, g_0, belt = problem
    a = a_11 * a_22 - a_12**2
    g_1 = (belt * a + g_2 * a_12) / a_22 + side * g_0
    for _ in range(abs(steps)):
        g_1 = math.nextafter(g_1, math.copysign(math.inf, steps))
    at_edge = (a_11, a_12, a_22, g_1, g_2, g_0, belt)
    d, e, found = minimise(*at_edge)
    moved = abs(steps) * math.ulp(g_1) * a_22 / a
    off = rounding(at_edge) + moved
    assert found in ((0.0, side) if g_0 * a_22 / a > off else (0.0, -1.0, 1.0))
    assert d == pytest.approx(belt, rel=0, abs=off)
    stuck = (g_2 - a_12 * belt) / a_22
    slack = rounding_of_e(at_edge) + abs(a_12) / a_22 * off
    assert e == pytest.approx(stuck, rel=0, abs=slack)
    if found == 0.0:
        assert d == belt


@given(signed)
def test_without_friction_a_shoe_in_step_with_the_wheel_counts_as_stuck(belt: float) -> None:
    assert minimise(1.0, 0.0, 1.0, belt, 0.0, 0.0, belt) == (belt, 0.0, 0.0)


@given(problems(), st.floats(0, 5))
@campaign
def test_the_slopes_are_the_derivatives_by_the_normal_force(problem: Problem, phi: float) -> None:
    """d and e are linear in F on a branch, so that any two points on it give the slope."""
    a_11, a_12, a_22, g_1, g_2, force, belt = problem
    assume(force > 0)

    def at(f: float) -> tuple[float, float, float]:
        return minimise(a_11, a_12, a_22, g_1, g_2 + f, phi * f, belt)

    d, e, side = at(force)
    d_next, e_next, side_next = at(1.5 * force)
    assume(side == side_next)
    d_slope, e_slope = slopes(a_11, a_12, a_22, phi, side)
    extreme = (a_11, a_12, a_22, g_1, abs(g_2) + 1.5 * force, 1.5 * phi * force, belt)
    assert (d_next - d) == pytest.approx(0.5 * force * d_slope, rel=0, abs=2 * rounding(extreme))
    assert (e_next - e) == pytest.approx(0.5 * force * e_slope, rel=0, abs=2 * rounding_of_e(extreme))


def test_every_branch_is_met() -> None:
    rng = np.random.default_rng(3)
    sides = {minimise(2.0, 0.5, 1.0, rng.normal(), rng.normal(), 0.5, 0.1)[2] for _ in range(200)}
    assert sides == {-1.0, 0.0, 1.0}
