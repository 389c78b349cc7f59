"""Disturbances in lanes: against eigenvalues, event-driven runs and neighbours, whoever is beside them."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.solver.ensemble import fits, run_together
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.lanes.records import LANES
from brakecli.solver.system import System
from brakecli.solver.tangent import Exponent
from tests.solver.test_ensemble import drawn, system

TINY: dict[str, Any] = {  # so tiny that eigenvalues say all, in full contact
    "roughness__wheel": {"amplitudes": [1e-9], "wavelengths": [0.023]},
    "roughness__shoe": None,
    "load__force": 5e4,
}
SELF_EXCITED: dict[str, Any] = {
    "shoe__mass": 14.3,
    "wheel__angular_speed": -16.3,
    "link1__stiffness": 6.89e6,
    "link1__damping": 27.7,
    "link2__damping": 616.0,
    "link2__angle_deg": 11.7,
    "friction__coefficient": 0.638,
    "contact__stiffness": 4.81e7,
}
UNDAMPED = {"link1__damping": 0.0, "link2__damping": 0.0, "friction__coefficient": 0.0}


def shaken(step: float = 5e-5, duration: float = 1.0, **changes: Any) -> System:
    """A system that begins near steady sliding, and carries a disturbance along."""
    start: dict[str, Any] = {"initial__at": "equilibrium", "initial__vx": 0.01}
    changes = start | {"solver__duration": duration, "output__sample_interval": 5e-4} | changes
    return replace(system(step, **changes), tangents=True)


def alone(system: System) -> tuple[Motion, Exponent]:
    """Its motion in a lane, with the exponent."""
    (found,) = run_together([system])
    assert found is not None
    assert found.exponent is not None
    return found, found.exponent


def eigenvalue(system: System) -> float:
    """The largest real part of an eigenvalue, in slip and full contact, 1/s."""
    c = system.coefficients
    k = system.contact_stiffness
    grip = c.phi * np.sign(system.belt_speed)
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2] = -np.array([c.c_xx, c.c_xy + grip * k, c.b_xx, c.b_xy]) / c.m
    a[3] = -np.array([c.c_xy, c.c_yy + k, c.b_xy, c.b_yy]) / c.m
    return float(np.linalg.eigvals(a).real.max())


@pytest.mark.parametrize("turn", [0.1, 0.3])  # of the fastest motion in a step, rad
@pytest.mark.parametrize(
    "changes",
    [
        {},
        UNDAMPED,
        UNDAMPED | {"friction__coefficient": 0.1},
        SELF_EXCITED | {"initial__vx": 0.0, "duration": 0.5},
    ],
)
def test_in_full_contact_it_grows_as_the_least_stable_eigenvalue_says(
    changes: dict[str, Any], turn: float
) -> None:
    each = shaken(**TINY, **changes)
    step = turn / (2.0 * math.pi * each.natural_frequencies[1])
    each = replace(each, interval=step, method=replace(each.method, step=step))
    rate, error, *_ = alone(each)[1]
    expected = eigenvalue(each)
    assert rate == pytest.approx(expected, rel=1e-2, abs=3.0 * error)
    assert error < max(1e-2 * abs(expected), 0.05)


@pytest.mark.parametrize(
    "changes",
    [
        {  # grows three times as fast as in full contact
            "shoe__mass": 8.72,
            "wheel__angular_speed": -13.3,
            "link1__stiffness": 1.51e7,
            "link1__damping": 233.0,
            "link2__damping": 17.0,
            "link2__angle_deg": -3.4,
            "load__force": 1990.0,
            "friction__coefficient": 0.986,
            "contact__stiffness": 7.37e7,
        },
        SELF_EXCITED | {"load__force": 413.0},  # bounces
    ],
)
def test_where_the_pad_opens_it_grows_as_beside_the_motion_of_the_equations(changes: dict[str, Any]) -> None:
    each = shaken(2.5e-5, 2.0, **changes)
    motion, (rate, error, *_) = alone(each)
    assert (motion.rows[len(motion.rows) // 2 :, 6] < 1.0).mean() > 0.3
    beside = solve(each.by(scheme="event-driven", theta=(), step=None, tolerance=1e-6)).exponent
    assert beside is not None
    assert abs(rate - beside.rate) <= 3.0 * math.hypot(error, beside.error)
    assert error < 0.1 * max(abs(rate), 1.0)


def test_the_disturbance_changes_nothing_of_the_motions_in_lanes() -> None:
    rng = np.random.default_rng(8)
    strangers = [drawn(rng, solver__duration=0.1) for _ in range(LANES)]
    asking = [replace(each, tangents=True) for each in strangers]
    compared = 0
    for quiet, found in zip(run_together(strangers), run_together(asking), strict=True):
        assert (quiet is None) == (found is None)
        if quiet is None or found is None:
            continue
        assert found.rows.tobytes() == quiet.rows.tobytes()
        assert quiet.exponent is None
        assert found.exponent is not None
        compared += 1
    assert compared > 0.7 * LANES
    assert fits(strangers[0]) != fits(asking[0])


def test_few_samples_give_no_exponent_in_a_lane() -> None:
    for samples, known in ((63, False), (64, True)):
        (found,) = run_together([shaken(duration=5e-4 * samples)])
        assert found is not None
        assert (found.exponent is not None) is known


def test_a_disturbance_that_vanishes_between_samples_fades_as_fast_as_can_be_told_in_a_lane() -> None:
    """By dashpots near the critical damping, e^-800 in a sample interval of 1 s, beyond what a double holds."""
    each = shaken(1e-4, 64.0, output__sample_interval=1.0, **TINY)
    strong = each.coefficients._replace(b_xx=2e4, b_xy=0.0, b_yy=2e4, phi=0.0)
    each = replace(each, coefficients=strong)
    assert eigenvalue(each) < -700.0
    rate, *_ = alone(each)[1]
    assert rate == pytest.approx(math.log(1e-280), rel=0.01)
