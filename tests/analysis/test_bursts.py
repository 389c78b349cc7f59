"""Bursts: a tone that comes and goes is found where it is, with its frequency and its level."""

import numpy as np
import pytest

from brakecli.analysis.regime.bursts import bursts
from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.regime.of_signal import Measurand, Signal, look
from tests.campaign import campaign

RATE = 20000.0
TIME = np.arange(int(RATE)) / RATE


def tone(frequency: float, start: float, end: float, size: float) -> np.ndarray:
    return np.where((start <= TIME) & (end > TIME), size * np.sin(2.0 * np.pi * frequency * TIME), 0.0)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_two_squeals_are_found_where_they_are(noise: float) -> None:
    values = tone(3000.0, 0.1, 0.25, 2.0) + tone(900.0, 0.5, 0.9, 1.0)
    values = values + noise * np.random.default_rng(1).normal(size=len(values))
    first, second = bursts(values, 1.0 / RATE)
    for found, (start, end, frequency, size) in (
        (first, (0.1, 0.25, 3000.0, 2.0)),
        (second, (0.5, 0.9, 900.0, 1.0)),
    ):
        assert (found.start, found.end) == pytest.approx((start, end), abs=4.0 / frequency)  # of four cycles
        assert found.frequency == pytest.approx(frequency, rel=2e-3)
        assert found.level == pytest.approx(size / np.sqrt(2.0), rel=0.03)


@pytest.mark.parametrize(
    "quantity", [pytest.param(each, marks=campaign if n % 2 else ()) for n, each in enumerate(Measurand)]
)
def test_a_squeal_of_part_of_the_record_has_not_died_out(quantity: Measurand) -> None:
    values = tone(2000.0, 0.3, 0.7, 0.1) + 1e-4 * np.random.default_rng(2).normal(size=len(TIME))
    found = look(Signal(values, 1.0 / RATE), quantity=quantity).verdict
    assert found.regime == Regime.QUASI_HARMONIC, found
    assert found.frequency == pytest.approx(2000.0, rel=1e-3)
    assert "in a burst from 0.3" in found.reasons[0]
    assert len(found.bursts) == 1


def test_a_ring_down_has_died_out_and_a_steady_tone_is_one_burst() -> None:
    noise = 1e-3 * np.random.default_rng(3).normal(size=len(TIME))
    ringing = np.exp(-8.0 * TIME) * np.sin(2.0 * np.pi * 2000.0 * TIME) + noise
    found = look(Signal(ringing, 1.0 / RATE), quantity=Measurand.PRESSURE).verdict
    assert found.regime == Regime.DAMPED
    assert found.bursts[0].start < 0.01
    (whole,) = bursts(np.sin(2.0 * np.pi * 440.0 * TIME) + noise, 1.0 / RATE)
    assert whole.end - whole.start > 0.99
    assert bursts(noise, 1.0 / RATE) == bursts(np.cumsum(noise), 1.0 / RATE) == []


def test_an_acceleration_gives_the_amplitude_of_the_displacement() -> None:
    turn, size = 2.0 * np.pi * 200.0, 3e-6
    values = -(turn**2) * size * np.sin(turn * TIME)
    found = look(Signal(values, 1.0 / RATE), quantity=Measurand.ACCELERATION).verdict
    assert found.amplitude == pytest.approx(size, rel=0.02)
    assert found.frequency == pytest.approx(200.0, rel=1e-3)
    sound = look(Signal(values, 1.0 / RATE), quantity=Measurand.PRESSURE).verdict
    assert sound.amplitude is None  # a pressure has no metres
