"""Bursts: a tone that comes and goes is found where it is, with its frequency and its level."""

import numpy as np
import pytest

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.signals.bursts import bursts
from brakecli.analysis.signals.cleaning import cleaned
from brakecli.analysis.signals.look import Measurand, Signal, look
from tests.campaign import campaign

RATE = 20000.0
TIME = np.arange(int(RATE)) / RATE


def tone(frequency: float, start: float, end: float, size: float) -> np.ndarray:
    return np.where((start <= TIME) & (end > TIME), size * np.sin(2.0 * np.pi * frequency * TIME), 0.0)


@pytest.mark.parametrize("noise", [0.0, 0.2])
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
    turn = 2.0 * np.pi * 200.0
    size = 3e-6
    values = -(turn**2) * size * np.sin(turn * TIME)
    found = look(Signal(values, 1.0 / RATE), quantity=Measurand.ACCELERATION).verdict
    assert found.amplitude == pytest.approx(size, rel=0.02)
    assert found.frequency == pytest.approx(200.0, rel=1e-3)
    sound = look(Signal(values, 1.0 / RATE), quantity=Measurand.PRESSURE).verdict
    assert sound.amplitude is None  # a pressure has no metres


def in_bursts(frequency: float, count: int, noise: float, seed: int = 4) -> np.ndarray:
    """As many bursts as would fill 0.4 s, with noise."""
    starts = (np.arange(count) + 0.3) / count
    long = 0.4 / count
    values = sum((tone(frequency, start, start + long, 1.0) for start in starts), np.zeros(len(TIME)))
    return values + noise * np.random.default_rng(seed).normal(size=len(TIME))


@pytest.mark.parametrize(("count", "noise", "frequency"), [(1, 1e-4, 200.0), (4, 0.1, 1900.0), (4, 0.01, 7000.0)])
def test_no_sample_of_a_burst_is_a_spike(frequency: float, noise: float, count: int) -> None:
    for order in (0, 1):
        assert cleaned(in_bursts(frequency, count, noise), order)[1] == []


@pytest.mark.parametrize("count", [1, 4])
def test_spikes_are_found_in_bursts_and_beside_them_and_nothing_else(count: int) -> None:
    clean = in_bursts(1900.0, count, 1e-4)
    rng = np.random.default_rng(5)
    places = np.sort(rng.choice(len(TIME) // 40, 40, replace=False) * 40 + 20)
    values = clean.copy()
    values[places] += rng.choice([-5.0, 5.0], len(places))
    velocity, notes = cleaned(values, 1)
    assert notes == ["spikes removed: 40"]
    changed = np.flatnonzero(np.abs(velocity.values + velocity.mean - values) > 1e-9)
    assert changed.tolist() == places.tolist()


def test_a_record_with_several_bursts_says_so_first() -> None:
    for noise in (1e-4, 0.1):
        found = look(Signal(in_bursts(1900.0, 4, noise), 1.0 / RATE), quantity=Measurand.PRESSURE).verdict
        assert found.regime == Regime.QUASI_HARMONIC
        assert found.reasons[0].startswith("in 4 bursts, the strongest from ")
        assert found.frequency == pytest.approx(1900.0, rel=1e-3)
        assert len(found.bursts) == 4
    coarse = look(Signal(in_bursts(5000.0, 4, 1e-4), 1.0 / RATE), quantity=Measurand.PRESSURE).verdict
    assert coarse.regime == Regime.UNDECIDED
    assert coarse.reasons[0].startswith("in 4 bursts, the strongest from ")
    assert "samples a cycle" in coarse.reasons[0]


def saw_teeth(period: float, jitter: float, noise: float, seed: int = 7) -> np.ndarray:
    """20 s of stick that loads at a constant rate, and of slip in a fiftieth of each period (s), at 1 kHz."""
    random = np.random.default_rng(seed)
    lengths = period * (1.0 + jitter * random.normal(size=int(20.0 / period) + 10))
    ends = np.cumsum(lengths)
    times = np.ravel([ends - 0.02 * period, ends], order="F")
    heights = np.ravel([lengths, 0.0 * lengths], order="F")
    clock = np.arange(20_000) / 1000.0
    teeth: np.ndarray = np.interp(clock, [0.0, *times], [0.0, *heights])
    return teeth + noise * period * random.normal(size=len(clock))


@pytest.mark.parametrize(("noise", "jitter"), [(0.0, 0.0), (1e-2, 0.02), (1e-3, 0.1)])
def test_the_flank_of_slow_stick_slip_is_no_burst(jitter: float, noise: float) -> None:
    for cycles in (5, 6, 8):
        values = saw_teeth(20.0 / cycles, jitter, noise)
        assert bursts(values, 1e-3) == []
        assert "burst" not in look(Signal(values, 1e-3), quantity=Measurand.DISPLACEMENT).verdict.reasons[0]
    assert bursts(np.diff(saw_teeth(4.0, jitter, 0.0)), 1e-3) == []  # what rounding leaves in stick is no tone


@pytest.mark.parametrize(("noise", "jitter"), [(0.0, 0.0), (1e-2, 0.02)])
def test_a_tone_of_unbroken_stick_slip_is_that_of_the_whole_record(jitter: float, noise: float) -> None:
    (whole,) = bursts(saw_teeth(20.0 / 30.0, jitter, noise), 1e-3)
    assert whole.end - whole.start > 0.95 * 20.0
    assert whole.frequency == pytest.approx(1.5, rel=0.02)
