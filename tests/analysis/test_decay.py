"""What a measured vibration rings with that dies out: the closed form has its frequency and its damping ratio."""

import math

import numpy as np
import pytest

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.signals.decay import ringing
from brakecli.analysis.signals.look import Measurand, Signal, look
from tests.analysis.measured_signals import Array

RATE = 10_000.0
NATURAL = 2.0 * math.pi * 200.0  # rad/s


def decaying(ratio: float, start: float = 0.0, seconds: float = 1.0) -> Array:
    """A vibration that is exp(-ζωt) cos(ω_d t) from a time (s) on."""
    time = np.maximum(np.arange(int(seconds * RATE)) / RATE - start, 0.0)
    turn = NATURAL * math.sqrt(1.0 - ratio**2)
    values: Array = np.exp(-ratio * NATURAL * time) * np.cos(turn * time) * (np.arange(len(time)) >= start * RATE)
    return values


def line(ratio: float) -> float:
    return NATURAL * math.sqrt(1.0 - ratio**2) / (2.0 * math.pi)


@pytest.mark.parametrize(
    ("ratio", "start", "quantity"),
    [(0.003, 0.0, Measurand.DISPLACEMENT), (0.01, 0.1, Measurand.VELOCITY), (0.03, 0.1, Measurand.ACCELERATION)],
)
def test_frequency_and_damping_ratio_are_those_of_the_closed_form(
    ratio: float, start: float, quantity: Measurand
) -> None:
    """A difference, and a constant beside it, change neither of them."""
    found = look(Signal(1e-6 * (decaying(ratio, start, 2.0) + 2.0), 1.0 / RATE), quantity).verdict
    assert found.regime is Regime.DAMPED
    assert found.frequency is None
    assert found.ringing_frequency == pytest.approx(line(ratio), rel=1e-5)
    assert found.damping_ratio == pytest.approx(ratio, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.003, 0.01, 0.03])
def test_errors_are_those_by_which_noise_moves_both(ratio: float) -> None:
    random = np.random.default_rng(8)
    clean = decaying(ratio)
    away = []
    for _ in range(60):
        found = ringing(clean + 0.01 * random.normal(size=len(clean)), 1.0 / RATE, 200.0 / RATE, 0.01, 3.0)
        assert found is not None
        frequency = (found.ringing_frequency - line(ratio)) / found.ringing_frequency_error
        away.append((frequency, (found.damping_ratio - ratio) / found.damping_ratio_error))
    # 60 numbers of 20 windows or so: their root mean square is one to within 4/√120, and Student's tails
    assert (np.sqrt(np.mean(np.square(away), axis=0)) < 1.5).all()
    assert (np.sqrt(np.mean(np.square(away), axis=0)) > 0.6).all()


def test_friction_that_takes_the_same_at_any_amplitude_has_a_damping_ratio_with_a_large_error() -> None:
    """A line of constant slope, as Coulomb friction gives, and an exponential of the same begin."""
    time = np.arange(int(RATE)) / RATE
    coulomb = np.maximum(1.0 - time / 0.8, 0.0) * np.cos(NATURAL * time)
    bent = ringing(coulomb, 1.0 / RATE, 200.0 / RATE, 1e-3, 3.0)
    straight = ringing(decaying(1.0 / 0.8 / NATURAL), 1.0 / RATE, 200.0 / RATE, 1e-3, 3.0)
    assert bent is not None
    assert straight is not None
    assert bent.damping_ratio_error > 100.0 * straight.damping_ratio_error


def test_nothing_is_said_of_what_lasts_grows_or_dies_too_fast() -> None:
    time = np.arange(int(RATE)) / RATE
    wave = np.cos(NATURAL * time)
    noise = 1e-2 * np.random.default_rng(9).normal(size=len(time))
    assert ringing(wave + noise, 1.0 / RATE, 200.0 / RATE, 1e-2, 3.0) is None
    assert ringing(np.exp(time) * wave, 1.0 / RATE, 200.0 / RATE, 0.0, 3.0) is None
    assert ringing(decaying(0.3) + noise, 1.0 / RATE, 200.0 / RATE, 1e-2, 3.0) is None
    assert look(Signal(wave, 1.0 / RATE), Measurand.VELOCITY).verdict.damping_ratio is None
