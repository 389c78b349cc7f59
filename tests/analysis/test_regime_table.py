"""Regimes of cases whose regime theory knows: constructed ones, all of them, and random ones without an error."""

import math
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.stability.report import StabilityReport, stability
from brakecli.case.case import Case
from brakecli.case.system import system_of
from tests.analysis.histories import verdict_of
from tests.examples import SQUEAL, make

SHOES = [  # α in degrees, c2/c1, k in N/m²
    (3.0, 1.2, 2e7),
    (5.0, 1.2, 2e7),
    (8.0, 1.2, 2e7),
    (5.0, 1.5, 5e7),
    (10.0, 2.0, 1e8),
    (5.0, 1.05, 1e7),
]
ROUGHNESS = [
    {"amplitudes": [2e-5], "wavelengths": [0.03]},
    {"amplitudes": [1e-5, 8e-6], "wavelengths": [0.03, 0.017]},
    {"amplitudes": [4e-4], "wavelengths": [0.03]},
]


def shoe(kind: tuple[float, float, float], **changes: Any) -> Case:
    alpha, ratio, k = kind
    base = {"link2__angle_deg": alpha, "link2__stiffness": ratio * 1e7, "contact__stiffness": k}
    return make(SQUEAL, **{**base, **changes})


def disturbed(report: StabilityReport, frequency: float, seconds: float) -> dict[str, Any]:
    """Start at steady sliding plus 1e-3 of it, with 100 steps per period of this frequency (Hz)."""
    assert report.equilibrium is not None
    step = 0.01 / frequency
    return {
        "initial__at": "equilibrium",
        "initial__x": 1e-3 * report.equilibrium.x,
        "initial__y": 1e-3 * report.equilibrium.y,
        "solver__step": step,
        "solver__duration": max(seconds, 120.0 / frequency),
        "output__sample_interval": 2.0 * step,
    }


@pytest.mark.parametrize("motion", ["below", "slow wheel", "fast wheel"])
@pytest.mark.parametrize("kind", SHOES[::2])
def test_flat_shoes_ten_percent_off_their_critical_friction(kind: tuple[float, float, float], motion: str) -> None:
    flat = stability(system_of(shoe(kind)))
    assert flat.critical is not None
    assert flat.equilibrium is not None
    # Growth is limited by stick where the velocity reaches U long before the amplitude reaches the compression
    # that keeps the pad on the wheel, and by loss of contact where it is the other way round.
    lift_off = 2.0 * math.pi * flat.critical.frequency * abs(flat.equilibrium.y)
    speed = {"below": 0.05, "slow wheel": 0.02 * lift_off, "fast wheel": 3.0 * lift_off}[motion]
    changes: dict[str, Any] = {
        "friction__coefficient": flat.critical.friction * (0.9 if motion == "below" else 1.1),
        "wheel__angular_speed": 2.0 * speed,
    }
    report = stability(system_of(shoe(kind, **changes)))
    assert (report.modes[0].growth > 0.0) == (motion != "below")
    times = disturbed(report, flat.critical.frequency, 25.0 / abs(report.modes[0].growth))
    verdict = verdict_of(shoe(kind, **changes, **times))
    expected = {"below": Regime.DAMPED, "slow wheel": Regime.RELAXATION, "fast wheel": Regime.QUASI_HARMONIC}
    assert verdict.regime is expected[motion], verdict.reasons
    if motion != "below":
        assert verdict.excitation is Excitation.SELF_EXCITED
        assert verdict.frequency == pytest.approx(flat.critical.frequency, rel=0.02)
    assert (verdict.stick_fraction > 0.0) == (motion == "slow wheel")
    assert (verdict.contact_loss_fraction > 0.0) == (motion == "fast wheel")


@pytest.mark.parametrize("waves", ROUGHNESS)
@pytest.mark.parametrize("kind", SHOES[1:2])
def test_roughness_below_the_critical_friction_forces_and_does_not_excite(
    kind: tuple[float, float, float], waves: dict[str, Any]
) -> None:
    changes: dict[str, Any] = {"roughness__wheel": waves, "wheel__angular_speed": 4.0}
    report = stability(system_of(shoe(kind, **changes)))
    assert report.critical is not None
    changes["friction__coefficient"] = 0.85 * report.critical.friction
    report = stability(system_of(shoe(kind, **changes)))
    times = disturbed(report, 180.0, 15.0 / abs(report.modes[0].growth))
    verdict = verdict_of(shoe(kind, **changes, **times))
    assert (verdict.regime, verdict.excitation) == (Regime.DAMPED, Excitation.FORCED), verdict.reasons


def test_steady_sliding_left_alone_is_damped_and_not_rounding_that_vibrates() -> None:
    verdict = verdict_of(make(SQUEAL, initial__at="equilibrium", friction__coefficient=0.3, solver__duration=0.5))
    assert verdict.regime is Regime.DAMPED
    assert "slides steadily" in verdict.reasons[0]


def random_case(rng: np.random.Generator) -> dict[str, Any]:
    mass = 10.0 ** rng.uniform(-1.0, 2.0)
    c_1 = 10.0 ** rng.uniform(6.0, 8.0)
    contact = c_1 * 10.0 ** rng.uniform(-1.0, 1.0)
    c_2 = (c_1 + contact) * 10.0 ** rng.uniform(-0.2, 0.2)
    damping = 2.0 * 10.0 ** rng.uniform(-3.0, -1.3) * math.sqrt(mass)
    return {
        "shoe": {"mass": mass},
        "wheel": {"radius": 0.5, "angular_speed": 2.0 * 10.0 ** rng.uniform(-2.5, 0.5)},
        "link1": {"stiffness": c_1, "damping": damping * math.sqrt(c_1), "angle_deg": rng.uniform(-30.0, 30.0)},
        "link2": {
            "stiffness": c_2,
            "damping": damping * math.sqrt(c_2) * rng.uniform(0.3, 3.0),
            "angle_deg": rng.uniform(-30.0, 30.0),
        },
        "load": {"force": 10.0 ** rng.uniform(2.0, 4.0)},
        "friction": {"coefficient": rng.uniform(0.05, 1.5)},
        "contact": {"half_length": 0.05, "stiffness": contact / 0.1},
        "solver": {"step": 1e-6, "duration": 1e-5},
    }


CHANGES: list[dict[str, Any]] = [
    {},
    {"solver__duration": 3.0},
    {"output__sample_interval": 5e-5},
    {"initial__x": 3e-5, "initial__vy": 0.01},
    {"solver__scheme": "three-layer", "solver__theta": (0.25, 0.5, 0.25), "solver__step": 2e-6},
    {"solver__step": 2e-6},
]


@pytest.mark.parametrize(
    ("phi", "speed", "regime"),
    [(0.5, 0.1, Regime.DAMPED), (0.7, 0.1, Regime.RELAXATION), (0.65, 0.6, Regime.QUASI_HARMONIC)],
)
def test_verdict_does_not_change_with_what_does_not_matter(phi: float, speed: float, regime: Regime) -> None:
    base: dict[str, Any] = {
        "friction__coefficient": phi, "wheel__angular_speed": speed, "solver__duration": 1.5, "solver__step": 1e-5,
    }  # fmt: skip
    verdicts = [verdict_of(make(SQUEAL, **{**base, **change})) for change in CHANGES]
    assert {verdict.regime for verdict in verdicts} == {regime}, [verdict.reasons for verdict in verdicts]
    if regime is not Regime.DAMPED:
        frequencies = [verdict.frequency for verdict in verdicts if verdict.frequency]
        assert len(frequencies) == len(CHANGES)
        assert np.ptp(frequencies) < 0.002 * frequencies[0]
