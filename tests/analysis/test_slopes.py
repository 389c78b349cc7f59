"""What the slopes of passing waves do to the growth of small vibrations in full contact."""

import math
from typing import Any

import numpy as np
import pytest
from brakecli.analysis.regime.slopes import growth_with_slopes
from scipy.integrate import solve_ivp

from brakecli.analysis.regime.linear import linear_theory
from brakecli.analysis.regime.table import Excitation, Regime
from brakecli.case.system import system_of
from tests.analysis.found import SHOES
from tests.analysis.histories import verdict_of
from tests.campaign import counts
from tests.examples import SQUEAL, make, simulate


def floquet(a: Any, b: Any, push: Any, waves: Any, period: float) -> float:
    """Growth rate by the monodromy of the periodic motion of z̈ + B ż + S z = push g sin(...), integrated."""
    g, k, omega, phase = waves
    p = np.outer(np.concatenate([np.zeros(2), push]), [1.0, 0.0, 0.0, 0.0])

    def rates(t: float, u: Any) -> Any:
        angle = phase - omega * t + k * u[0]
        forces = np.concatenate([np.zeros(2), push * (g @ np.sin(angle))])
        slope = (g * k) @ np.cos(angle)
        return np.concatenate([a @ u[:4] + forces, ((a + slope * p) @ u[4:].reshape(4, 4)).ravel()])

    state = np.zeros(4)
    for _ in range(8):
        start = np.concatenate([state, np.eye(4).ravel()])
        end = solve_ivp(rates, (0.0, period), start, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        monodromy, gap = end[4:].reshape(4, 4), end[:4] - state
        if np.abs(gap).max() < 1e-9:
            break
        state = state + np.linalg.solve(np.eye(4) - monodromy, gap)
    return math.log(np.abs(np.linalg.eigvals(monodromy)).max()) / period


@pytest.mark.parametrize("systems", counts(4, 60))
def test_growth_with_slopes_is_that_of_the_monodromy(systems: int) -> None:
    """Random systems, many near a resonance of a wave with sums, differences or doubles of frequencies."""
    rng, found = np.random.default_rng(11), 0
    while found < systems:
        s = np.array([[1.0, rng.uniform(-0.1, 0.5)], [rng.uniform(-0.2, 0.2), rng.uniform(1.2, 4.0)]])
        b = 10.0 ** rng.uniform(-4.0, -2.5) * np.array([[1.3, 0.1], [0.1, 1.2]])
        push = np.array([rng.uniform(0.0, 1.0), 1.0])
        one, other = np.sqrt(np.abs(np.linalg.eigvals(s)))
        base = rng.choice([one + other, abs(one - other), 2.0 * one, 2.0 * other, 1.1 * one])
        omega = base * (1.0 + 3e-3 * rng.normal()) * np.array([1.0, rng.choice([0.5, 2.0, 1.5, 3.0])])
        k = 10.0 ** rng.uniform(-0.5, 0.5, 2)
        g, phase = 0.8 * 10.0 ** rng.uniform(-2.5, -1.0) / k, rng.uniform(0.0, 2.0 * math.pi, 2)
        a = np.block([[np.zeros((2, 2)), np.eye(2)], [-s, -b]])
        x = [
            np.linalg.solve(s - w * w * np.eye(2) - 1j * w * b, push)[0] * size * np.exp(1j * turn)
            for w, size, turn in zip(omega, g, phase, strict=True)
        ]
        bends = np.outer(k, x)
        if np.abs(bends).sum() > 0.25:  # the theory is of the first order in it
            continue
        found += 1
        p = np.concatenate([np.zeros(2), push])
        rate, off = growth_with_slopes(a, p, -omega, g * k * np.exp(1j * phase), bends)
        # The integration is exact to 1e-9 a period of about 10.
        exact = floquet(a, b, push, (g, k, omega, phase), 12.0 * math.pi / omega[0])
        assert rate == pytest.approx(exact, abs=off + 1e-8)


TWICE = 338.5690237228429  # Hz, of a natural frequency of SQUEAL at a friction of 0.3, by `brakecli stability`
STEEP: dict[str, Any] = SQUEAL | {  # the wave passes at TWICE
    "contact": {"half_length": 0.0005, "stiffness": 2e9},
    "roughness": {"wheel": {"amplitudes": [2e-5], "wavelengths": [0.002]}},
}


@pytest.mark.parametrize("detuned", [1.0, 1.05])
def test_a_steep_wave_lets_grow_what_the_mean_stiffness_damps(detuned: float) -> None:
    changes: dict[str, Any] = {"link1__damping": 3.0, "link2__damping": 3.0, "friction__coefficient": 0.3}
    changes |= {
        "wheel__angular_speed": TWICE * 0.002 / 0.5 * detuned,
        "solver__step": 1e-5,
        "initial__at": "equilibrium",
    }
    changes |= {"initial__x": 1e-8, "solver__duration": 6.0}
    case, grows = make(STEEP, **changes), detuned == 1.0
    theory, verdict = linear_theory(system_of(case), TWICE * 0.002 * detuned), verdict_of(case)
    assert theory is not None
    assert theory.direction == -1
    assert verdict.regime is (Regime.UNDECIDED if grows else Regime.DAMPED)
    assert verdict.excitation is (Excitation.NONE if grows else Excitation.FORCED)
    # Two neighbours: the slope of ln of their distance, of which the other mode's part has gone after 3 s.
    apart = simulate(case).vx - simulate(make(STEEP, **changes, initial__vx=1e-6)).vx
    first, last = (float(np.log(part.std())) for part in np.split(apart[-30_000:], 2))
    # The step changes frequencies by (ωh)²/12 = 1e-5, and thereby the distance from resonance by 0.02 1/s.
    assert verdict.growth_rate == pytest.approx((last - first) / 1.5, abs=0.05)


def test_advice_on_the_growth_between_steep_waves_can_be_followed() -> None:
    """The shoe's own part falls with the run; its line is not among those of the waves, nor counted there."""
    tables = SHOES["steep waves leave the growth open"]
    short, long = (verdict_of(make(tables, solver__duration=times * 4.38384)) for times in (0.25, 1.0))
    assert all("leave open whether" in each.reasons[0] for each in (short, long))
    assert short.amplitude_own is not None
    assert long.amplitude_own is not None
    assert long.amplitude_own < 0.5 * short.amplitude_own
    assert (long.evidence["line_shares"][0] > 0.8, long.evidence["line_forced"][0]) == (True, 0.0)
    assert long.evidence["forced_share"] < 0.5
