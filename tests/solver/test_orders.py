"""Orders of accuracy: of every scheme on smooth motion, and through stick-slip."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from brakecli.case.system import system_of
from brakecli.solver.steps.loop import load
from brakecli.solver.system import System
from tests.analysis.branches.phasewise import Phasewise
from tests.analysis.shoes import Shoe
from tests.examples import SQUEAL, make, simulate

END = 0.004
INTERVAL = 4e-5
STEPS = [4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6]

# A rough pad that touches everywhere, sliding on a wheel that slows down under a load that rises.
SMOOTH: dict[str, Any] = {
    **SQUEAL,
    "wheel": {"radius": 0.5, "times": [0.0, 0.01], "angular_speeds": [10.0, 6.0]},
    "load": {"times": [0.0, 0.01], "forces": [5000.0, 9000.0]},
    "roughness": {"wheel": {"amplitudes": [1e-5, 4e-6], "wavelengths": [0.03, 0.017], "phases_deg": [40.0, 0.0]}},
    "initial": {"at": "equilibrium", "x": 1e-5, "vx": 0.02, "vy": -0.01},
    "output": {"sample_interval": INTERVAL},
}


def smooth_case(scheme: str, theta: Sequence[float], start: str, step: float) -> Any:
    velocity = {"initial__vx": 0.0, "initial__vy": 0.0} if start == "paper" else {}
    return make(
        SMOOTH,
        solver__scheme=scheme,
        solver__theta=theta,
        solver__start=start,
        solver__step=step,
        solver__duration=END,
        **velocity,
    )


def smooth_reference(
    system: System, start: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The same motion by a Runge-Kutta method of order eight, with (2) of full contact and (6)-(7) written out."""
    c = system.coefficients
    wheel = system.wheel
    k = system.contact_stiffness
    sinc = np.sinc(wheel.omega * 0.05 / np.pi)

    def slope(t: float, z: NDArray[np.float64]) -> list[float]:
        x, y, v_x, v_y = z
        travel = 5.0 * t - 0.5 * 200.0 * t * t
        load = 5000.0 + 4e5 * t
        normal = k * (-y + np.sum(wheel.g * sinc * np.sin(wheel.omega * (x - travel) + wheel.phase)))
        a_x = (c.phi * normal - c.b_xx * v_x - c.b_xy * v_y - c.c_xx * x - c.c_xy * y - load * c.sin_beta) / c.m
        a_y = (normal - c.b_xy * v_x - c.b_yy * v_y - c.c_xy * x - c.c_yy * y - load * c.cos_beta) / c.m
        return [v_x, v_y, a_x, a_y]

    # Piecewise between samples: a tolerance of 1e-13 is reached there without piling up.
    return solve_ivp(slope, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-18).y.T


@pytest.mark.parametrize(
    ("scheme", "theta", "start", "order"),
    [
        ("two-layer", (0.5, 0.5), "consistent", 2),
        ("two-layer", (1.0, 1.0), "consistent", 1),
        ("two-layer", (1.0, 0.5), "consistent", 1),
        ("two-layer", (0.5, 1.0), "consistent", 1),
        ("three-layer", (0.25, 0.5, 0.25), "consistent", 2),
        ("three-layer", (0.25, 0.5, 0.25), "paper", 1),
        ("three-layer", (0.0, 1.0, 0.0), "consistent", 2),
        ("three-layer", (0.5, 0.5, 0.0), "consistent", 1),
    ],
)
def test_order_on_smooth_motion(scheme: str, theta: tuple[float, ...], start: str, order: int) -> None:
    errors = []
    for step in STEPS:
        case = smooth_case(scheme, theta, start, step)
        result = simulate(case)
        assert result.contact_fraction.min() == 1.0
        assert set(result.state) == {-1.0}
        system = system_of(case)
        exact = smooth_reference(system, result.rows[0, :4], result.time)
        errors.append(np.abs(result.rows[:, :2] - exact[:, :2]).max())
    assert len(errors) == 5
    slopes = np.diff(np.log(errors)) / np.diff(np.log(STEPS))
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] == pytest.approx(order, abs=0.15)
    assert slopes[-1] == pytest.approx(order, abs=0.15)
    assert load(scheme).order(system.weights, start) == order


def test_two_layer_scheme_keeps_second_order_through_stick_slip() -> None:
    # The limit cycle of the relaxation case: settle, then follow it for 20 ms against exact phases.
    settled = simulate(make(SQUEAL, friction__coefficient=0.7, solver__duration=1.0, solver__step=1e-6))
    slipping = np.flatnonzero((settled.state == -1) & (settled.time > 0.9))[0]
    x, y, v_x, v_y = settled.rows[slipping, :4]
    start = {"initial__x": x, "initial__y": y, "initial__vx": v_x, "initial__vy": v_y}
    steps = [4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6, 1.25e-6]
    errors = []
    exact = None
    stick = 0
    for step in steps:
        case = make(
            SQUEAL,
            friction__coefficient=0.7,
            solver__duration=0.02,
            solver__step=step,
            output__sample_interval=4e-5,
            **start,
        )
        result = simulate(case)
        if exact is None:
            reference = Phasewise(Shoe.of({**SQUEAL, "friction": {"coefficient": 0.7}}))
            exact, _ = reference.samples(result.rows[0, :4], 4e-5, 500)
        errors.append(np.abs(result.rows[:, :2] - exact[:, :2]).max())
        stick += int(np.sum(result.state == 0))
    assert stick > 6 * 3 * 5  # three cycles and more that stick
    assert len(errors) == 6
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)
