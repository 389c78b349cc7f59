"""The energy account closes, and friction takes energy only."""

from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Stepping
from brakecli.solver.quantities import ContactState
from tests.examples import MODE_COUPLING, ROUGH, SQUEAL, make, simulate

NUMEROV = ("three-layer", (1 / 12, 10 / 12, 1 / 12))
SYMMETRIC = [("two-layer", (0.5, 0.5)), ("three-layer", (0.25, 0.5, 0.25)), NUMEROV]
"""Schemes with weights that take no energy out of a motion."""
DAMPING = [("two-layer", (1.0, 1.0)), ("two-layer", (1.0, 0.5)), ("three-layer", (0.5, 0.25, 0.25))]
SCHEMES = SYMMETRIC + DAMPING


@pytest.mark.parametrize(("scheme", "theta"), SYMMETRIC)
def test_account_closes_with_the_square_of_the_step_on_a_rough_pad_that_opens(
    scheme: str, theta: tuple[float, ...]
) -> None:
    steps = [4e-5, 2e-5, 1e-5, 5e-6]
    errors = []
    for step in steps:
        case = make(
            ROUGH, contact__evaluator="exact", solver__scheme=scheme, solver__theta=theta, solver__step=step,
            solver__duration=0.01, output__sample_interval=4e-5, wheel__angular_speed=1.0,
        )  # fmt: skip
        result = simulate(case)
        assert 0.2 < result.contact_fraction[10:].min() < 0.95
        assert result.energy.friction > 0.0
        errors.append(abs(result.energy.closing_error))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.3)  # kinks jitter
    assert errors[-1] < 1e-6 * result.energy.friction


@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
def test_dissipation_of_a_scheme_is_an_item_of_its_own(scheme: str, theta: tuple[float, ...]) -> None:
    case = make(
        MODE_COUPLING, friction__coefficient=0.0, initial__x=0.5, solver__scheme=scheme, solver__theta=theta,
        solver__step=0.02,
    )  # fmt: skip
    energy = simulate(case).energy
    lost = -(energy.kinetic + energy.links + energy.contact + energy.load)
    if (scheme, theta) in SYMMETRIC:
        assert energy.scheme == 0.0
        assert abs(lost) < 1e-4  # bounded by h² for a store that is not placed where the scheme keeps it
    else:
        assert energy.scheme > 0.01
        assert energy.scheme == pytest.approx(lost, rel=0.02)  # estimated by differences: to first order in h


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
def test_friction_never_feeds_energy_in_the_frame_of_the_wheel(
    scheme: str, theta: tuple[float, ...], flat: bool
) -> None:
    base: dict[str, Any] = SQUEAL if flat else {**ROUGH, "wheel": {"radius": 0.5, "angular_speed": 0.1}}
    case = make(base, solver__scheme=scheme, solver__theta=theta, friction__coefficient=0.8, solver__step=2e-5)
    motion = Stepping(system_of(case))
    slips = 0
    sticks = 0
    for _ in range(1500):
        motion.block(int(motion.counts.level) + 1)
        p = motion.plant.problem
        friction = p.a_11 * p.d + p.a_12 * p.e - p.g_1
        sliding = p.d - p.belt
        rounding = 1e-15 * (abs(p.a_11 * p.d) + abs(p.a_12 * p.e) + abs(p.g_1))
        assert friction * sliding <= rounding * abs(sliding)
        assert abs(friction) <= 0.8 * p.normal_force + 4.0 * rounding
        slips = slips + (sliding != 0.0)
        sticks = sticks + (sliding == 0.0)
    assert slips > 100
    assert sticks > 10 or not flat


HELD_AT_A_KNOT: dict[str, Any] = {
    "shoe": {"mass": 16.464507079599265},
    "wheel": {
        "radius": 0.5,
        "times": [0.017174452809830553, 0.034348905619661106, 0.06869781123932221],
        "angular_speeds": [0.0438512543012029, -0.0438512543012029, 0.01315537629036087],
    },
    "link1": {"stiffness": 1790620.2713060244, "damping": 835.0774377976629, "angle_deg": 4.972196142868441},
    "link2": {"stiffness": 8974620.273857726, "damping": 320.3882157391155, "angle_deg": -52.60482848877393},
    "load": {"force": 123.48687788184202},
    "friction": {"coefficient": 1.1615395435468407},
    "contact": {"half_length": 0.05, "stiffness": 14751827.30210386},
    "solver": {"scheme": "event-driven", "tolerance": 1e-06, "duration": 0.08587226404915277},
    "output": {"events": True, "sample_interval": 0.00021468066012288192},
    "initial": {
        "x": 1.771968114200446e-05,
        "y": -1.9101723960709597e-05,
        "vx": -0.00830792923367157,
        "vy": -0.009546127944610879,
    },
    "roughness": {
        "wheel": {
            "amplitudes": [2.032004497319661e-05],
            "wavelengths": [0.01268217147736175],
            "phases_deg": [211.2317127291078],
        }
    },
}
"""A shoe on a rough wheel that turns back: it sticks where the wheel's speed has a knot."""


def test_the_account_closes_over_a_knot_in_stick() -> None:
    """The force that stick takes jumps there, by the mass times the change of the wheel's acceleration."""
    result = simulate(Case.model_validate(HELD_AT_A_KNOT))
    assert ContactState.STICK in result.rows[:, 7]
    assert abs(result.energy.relative_closing_error) < 1e-4
