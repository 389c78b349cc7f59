"""Motions that are known exactly."""

import numpy as np
import pytest

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
