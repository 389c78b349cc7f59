"""Motions that are known exactly."""

import numpy as np
import pytest
from scipy.linalg import expm

from brakecli.case.system import system_of
from tests.examples import COULOMB, MODE_COUPLING, SQUEAL, make, simulate

COULOMB_REST = 15.0 - np.sqrt(205.0)  # 0.6821789367236466


def test_coulomb_oscillator_comes_to_rest_where_it_must() -> None:
    result = simulate(make(COULOMB))
    assert result.x[-1] == pytest.approx(COULOMB_REST - 1.35e-4, abs=1e-6)  # published for this step and scheme
    assert result.vx[-1] == 0.0


def test_coulomb_oscillator_meets_all_its_peaks() -> None:
    # The first peak is -1 + √205, then the amplitude about the shifted centre falls by 2 every half cycle.
    result = simulate(make(COULOMB, solver__step=0.001, solver__duration=30.0))
    turns = np.flatnonzero(np.diff(np.sign(result.vx)) * np.sign(result.vx[:-1]) < 0)
    peaks = [result.x[i : i + 2][np.argmax(np.abs(result.x[i : i + 2]))] for i in turns]
    exact = [(-1.0) ** n * (np.sqrt(205.0) - 1.0 - 2.0 * n) for n in range(7)]
    # The error at h = 0.01 is 1.35e-4, so at 0.001 about 1.4e-6; samples miss a peak by at most x h²/8.
    assert len(exact) == 7
    assert np.allclose(peaks[:7], exact, atol=5e-6)


def test_coulomb_rest_converges_with_the_square_of_the_step_on_the_whole() -> None:
    steps = np.array([0.02, 0.01, 0.005, 0.0025, 0.00125, 0.000625])
    errors = [abs(simulate(make(COULOMB, solver__step=h)).x[-1] - COULOMB_REST) for h in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.3)  # event times jitter on the grid


def test_a_sticking_shoe_stays_at_rest_exactly() -> None:
    result = simulate(make(COULOMB))
    stuck = result.state == 0
    assert stuck[-1000:].all()
    assert np.ptp(result.x[-1000:]) == 0.0
    assert np.all(result.vx[stuck] == 0.0)


@pytest.mark.parametrize(("scheme", "theta"), [("two-layer", [0.5, 0.5]), ("three-layer", [0.25, 0.5, 0.25])])
def test_mode_coupling_grows_at_the_published_rate_and_frequency(scheme: str, theta: list[float]) -> None:
    case = make(
        MODE_COUPLING, solver__scheme=scheme, solver__theta=theta, solver__step=0.002, solver__duration=40.0
    )
    result = simulate(case)
    assert set(result.state) == {-1.0}
    motion = result.x - simulate(make(MODE_COUPLING, solver__duration=0.01, initial__x=0.0)).x[0]
    # A sum of four exponentials obeys a linear recurrence of order four over equal times, whatever its phases.
    thin = motion[::200]
    columns = np.column_stack([thin[i : len(thin) - 4 + i] for i in range(4)])
    recurrence = np.linalg.lstsq(columns, thin[4:], rcond=None)[0]
    exponents = np.log(np.roots([1.0, *-recurrence[::-1]]).astype(complex)) / 0.4
    fastest = exponents[np.argmax(exponents.real)]
    assert fastest.real == pytest.approx(0.2020717687680948, abs=1e-4)
    assert abs(fastest.imag) == pytest.approx(1.4285772641803685, abs=1e-4)


@pytest.mark.parametrize(("phi", "grows"), [(0.74, False), (0.76, True)])
def test_mode_coupling_grows_only_above_its_critical_friction(phi: float, grows: bool) -> None:
    result = simulate(make(MODE_COUPLING, friction__coefficient=phi, solver__duration=150.0))
    motion = np.abs(result.vx)
    early = motion[:6000].max()
    late = motion[-6000:].max()
    assert (late > 10.0 * early) == grows
    assert late < 1.01 * early or grows


def test_without_friction_the_motion_is_the_matrix_exponential() -> None:
    case = make(
        SQUEAL,
        friction__coefficient=0.0,
        initial__at="equilibrium",
        initial__x=2e-5,
        initial__vy=0.01,
        solver__step=1e-6,
    )
    system = system_of(case)
    result = simulate(case)
    c = system.coefficients
    k = system.contact_stiffness
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:] = -np.array([[c.c_xx, c.c_xy, c.b_xx, c.b_xy], [c.c_xy, c.c_yy + k, c.b_xy, c.b_yy]]) / c.m
    rest = np.linalg.solve([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy + k]], [0.0, -5000.0])
    step = expm(a * 1e-4)
    exact = [result.rows[0, :4] - [*rest, 0.0, 0.0]]
    for _ in result.time[1:]:
        exact.append(step @ exact[-1])
    motion = result.rows[:, :4] - [*rest, 0.0, 0.0]
    # The scheme turns each mode by ωh - (ωh)³/12 a step: after 0.1 s its phase is off by ω³h²t/12 = 1.2e-5.
    scale = np.abs(np.array(exact)).max(axis=0)
    assert np.all(np.abs(motion - exact).max(axis=0) < 3e-5 * scale)


def belt(damping: float) -> dict[str, object]:
    return {
        "link1__damping": 0.0,
        "link2__damping": damping,
        "link2__angle_deg": 0.0,
        "initial__at": "equilibrium",
        "initial__x": -4e-5,  # where friction holds it: its bound is 4.2e-5 of spring
        "initial__vx": 0.05,
        "wheel__angular_speed": 0.1,
        "solver__duration": 1.0,
    }


def test_an_undamped_mass_on_a_belt_sticks_then_circles_at_the_belt_speed() -> None:
    result = simulate(make(SQUEAL, **belt(0.0)))
    assert np.all(result.state[:5] == 0)
    late = result.vx[-3000:]
    omega_h = np.sqrt(1.2e6) * 1e-5
    # Samples every 0.11 of a radian miss the top by (0.055)²/2; the circle itself keeps U but for (ωh)².
    assert late.max() == pytest.approx(0.05, rel=0.0555**2 / 2 + omega_h**2)
    assert result.vx.max() == 0.05


def test_any_dashpot_makes_the_mass_on_a_belt_decay() -> None:
    result = simulate(make(SQUEAL, **belt(300.0)))
    decay = np.exp(-300.0 / 20.0 * 0.9)  # exp(-b t / 2m) from the end of stick on, before 0.002 s
    assert np.abs(result.vx[-1000:]).max() < 0.05 * decay * 1.05
