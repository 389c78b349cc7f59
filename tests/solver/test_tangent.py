"""Small disturbances that are carried along: against closed forms, neighbours, multipliers and a publication."""

import math
from dataclasses import replace
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, Stepping, solve
from brakecli.solver.system import System
from brakecli.solver.tangent import exponents
from tests.analysis.shoes import Tables, random_shoes
from tests.campaign import campaign
from tests.examples import SQUEAL, make

pytestmark = pytest.mark.usefixtures("compiled")
Array = Any
FIRST = np.array([0.5, 0.5, 0.5, -0.5])
"""The disturbance that each begins with: places times the angular frequency of the fast mode, and velocities."""


def carried(system: System) -> tuple[Motion, Array]:
    """A motion, and the disturbance at its end that has grown from `FIRST`."""
    stepping = Stepping(replace(system, tangents=True))
    motion = stepping.run()
    t = stepping.tangent
    size = math.exp(float(np.sum(t.logs)))
    return motion, size * np.array([t.rate * t.x, t.rate * t.y, t.v_x, t.v_y])


def scales(system: System) -> Array:
    """What a state is multiplied by for the size of a disturbance."""
    rate = 2.0 * math.pi * system.natural_frequencies[1]
    return np.array([rate, rate, 1.0, 1.0])


def by_neighbours(system: System, size: float) -> Array:
    """The same from two motions beside, on either side."""
    ends = list[Array]()
    start = system.initial
    for way in (size, -size):
        x, y, vx, vy = way * FIRST / scales(system)
        beside = replace(start, x=start.x + x, y=start.y + y, vx=start.vx + vx, vy=start.vy + vy)
        ends.append(solve(replace(system, initial=beside)).rows[-1, :4])
    return (ends[0] - ends[1]) / (2.0 * size) * scales(system)


def by_scheme(tables: Tables, scheme: str, **changes: Any) -> Case:
    """A case with another scheme."""
    solver = {"duration": tables["solver"]["duration"]}
    if scheme == "event-driven":
        solver |= {"tolerance": 1e-10}
    return make({**tables, "solver": {**solver, "scheme": scheme}}, **changes)


@pytest.mark.parametrize(("scheme", "error"), [("piecewise-exact", 1e-11), ("event-driven", 1e-8)])
def test_in_slip_a_disturbance_grows_as_the_matrix_exponential_says(scheme: str, error: float) -> None:
    case = by_scheme(SQUEAL, scheme, initial__at="equilibrium", initial__vx=1e-3, solver__duration=5e-3)
    system = system_of(case)
    c = system.coefficients
    k = system.contact_stiffness
    grip = system.coefficients.phi
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2] = -np.array([c.c_xx, c.c_xy + grip * k, c.b_xx, c.b_xy]) / c.m
    a[3] = -np.array([c.c_xy, c.c_yy + k, c.b_xy, c.b_yy]) / c.m
    end = expm(a * system.sampled_duration) @ (FIRST / scales(system)) * scales(system)
    np.testing.assert_allclose(carried(system)[1], end, atol=error)


@pytest.mark.parametrize("number", [0, 6])
def test_it_follows_neighbours_on_pads_that_open_and_stick(number: int) -> None:
    """Those of event-driven motions, 1e-7 m/s apart, whose errors are 1e-10 of the motion."""
    tables = next(islice(random_shoes("open", 5), number, None))
    duration = 400 * tables["output"]["sample_interval"]
    system = system_of(by_scheme(tables, "event-driven", solver__duration=duration))
    motion, found = carried(system)
    assert (motion.rows[:, 7] == 0.0).any() if number else (motion.rows[:, 6] < 1.0).any()
    np.testing.assert_allclose(found, by_neighbours(system, 1e-7), rtol=1e-3, atol=1e-3 * np.abs(found).max())


@cache
def sticking() -> Tables:
    """A smooth shoe with a limit cycle that sticks."""
    tables = next(islice(random_shoes("smooth", 5), 7, None))
    return {**tables, "solver": {**tables["solver"], "duration": 4.0 * tables["solver"]["duration"]}}


@pytest.mark.parametrize("scheme", ["piecewise-exact", "event-driven"])
def test_a_limit_cycle_has_the_exponent_zero(scheme: str) -> None:
    """Of a disturbance along itself, which neither grows nor fades; all others fade."""
    motion = solve(replace(system_of(by_scheme(sticking(), scheme)), tangents=True))
    assert (motion.rows[len(motion.rows) // 2 :, 7] == 0.0).mean() > 0.1
    assert motion.exponent is not None
    rate, error, *_ = motion.exponent
    assert abs(rate) <= 3.0 * error
    assert error < 0.03 * 3040.0  # Hz of the cycle


@pytest.mark.parametrize(("number", "frequency"), [(7, 3040.0), (8, 2230.0)])
def test_at_events_nothing_is_lost_or_gained(number: int, frequency: float) -> None:
    """The exponent of a limit cycle that sticks, and of one that also lands and turns: a thousandth of a cycle."""
    tables = next(islice(random_shoes("smooth", 5), number, None))
    duration = 4.0 * tables["solver"]["duration"]
    case = by_scheme(tables, "piecewise-exact", solver__duration=duration)
    motion = solve(replace(system_of(case), tangents=True))
    assert motion.exponent is not None
    assert abs(motion.exponent.rate) < 1e-3 * frequency


def test_the_disturbance_changes_nothing_of_the_motion() -> None:
    for scheme in ("piecewise-exact", "event-driven"):
        system = system_of(by_scheme(SQUEAL, scheme))
        alone = solve(system)
        beside = solve(replace(system, tangents=True))
        np.testing.assert_array_equal(alone.rows, beside.rows)
        assert alone.exponent is None
        assert beside.exponent is not None


@campaign
def test_a_disturbance_that_vanishes_between_samples_begins_anew() -> None:
    """By dashpots near the critical damping, e^-1000 in a sample interval of 1 s, beyond what a double holds."""
    system = system_of(by_scheme(SQUEAL, "piecewise-exact", initial__at="equilibrium"))
    strong = system.coefficients._replace(b_xx=2.2e4, b_xy=0.0, b_yy=2.2e4, phi=0.0)
    system = replace(system, coefficients=strong, interval=1.0, duration=64.0, tangents=True)
    stepping = Stepping(system)
    stepping.run()
    logs = np.array(stepping.tangent.logs)
    assert np.isfinite(logs).all()
    assert logs.min() < -600.0


def test_few_samples_give_no_exponent() -> None:
    for samples, known in ((63, False), (64, True)):
        case = by_scheme(SQUEAL, "piecewise-exact", solver__duration=1e-4 * samples)
        assert (solve(replace(system_of(case), tangents=True)).exponent is not None) is known


@pytest.mark.parametrize("memory", [0.1, 1.0, 3.0, 6.0], ids=str)
def test_the_error_of_a_line_is_the_spread_of_its_slope_as_long_as_what_leaves_it_forgets(memory: float) -> None:
    """Sizes that leave a line as a process of first order, which forgets within so many of 28.

    The median error of 20,000 is the spread to 10 %. Beyond three errors lie no more than of Student's t with the
    freedom that is left, which is 2 where it forgets within six: 10 %.
    """
    random = np.random.default_rng(17)
    part = math.exp(-1.0 / memory)
    noise = random.standard_normal((128, 20_000))
    sizes = np.zeros_like(noise)
    for n in range(1, 128):
        sizes[n] = part * sizes[n - 1] + math.sqrt(1.0 - part**2) * noise[n]
    growth = np.diff(sizes[-33:], axis=0) - 3.0
    found = exponents(growth, 32.0)
    slopes = np.array([each.even for each in found])
    errors = np.array([each.even_error for each in found])
    assert np.median(errors) == pytest.approx(np.std(slopes), rel=0.1)
    assert (np.abs(slopes + 3.0) > 3.0 * errors).mean() < 0.1


def test_a_rate_that_surely_goes_on_changing_has_that_in_its_error() -> None:
    """Seven rates 0.2 1/s apart rise by 1.4 1/s; means of pairs are 0.4 apart, and their error is 0.4 √(8/15).

    Of rates that swing about one value none is a trend.
    """
    parts = np.arange(32.0)
    rising, swinging = exponents(np.stack([0.1 * parts - 3.0, 0.3 * np.cos(2.5 * parts) - 3.0], axis=1), 32.0)
    assert rising.error == pytest.approx(math.hypot(0.4 * math.sqrt(8.0 / 15.0), 1.4), rel=1e-9)
    assert swinging.error < 0.1
