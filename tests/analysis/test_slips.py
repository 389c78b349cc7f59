"""Slips as they are measured: slow, irregular, under hum, noise and drift; and what only looks like slips."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.signals.look import Measurand, Signal, SignalVerdict, look
from tests.analysis.measured_signals import Array
from tests.campaign import counts

RATE = 2000.0
RECORDS = Path(__file__).parent / "measured" / "paper-on-paper.h5"
BOTH = (Measurand.DISPLACEMENT, Measurand.VELOCITY)


def judged(values: Array, quantity: Measurand, rate: float = RATE) -> SignalVerdict:
    return look(Signal(values, 1.0 / rate), quantity=quantity).verdict


def wandering(samples: int, size: float, random: np.random.Generator) -> Array:
    """A smooth drift through eight random values."""
    knots = np.linspace(0.0, 1.0, 8)
    smooth: Array = size * np.polynomial.Chebyshev.fit(knots, random.normal(size=8), 7)(np.linspace(0, 1, samples))
    return smooth


def disturbed(values: Array, part: float, random: np.random.Generator) -> Array:
    """White and impulsive noise, mains hum and drift, by a part of the size of the motion."""
    count = len(values)
    size = float(values.std())
    hum = part * size * np.sin(2.0 * np.pi * 50.0 / RATE * np.arange(count))
    impulses = np.where(random.random(count) < 0.005, 2.0 * size * random.standard_t(2, count), 0.0)
    noise = 0.5 * part * size * random.normal(size=count)
    changed: Array = values + hum + impulses + noise + wandering(count, 0.3 * size, random)
    return changed


def saw_teeth(mean: int, teeth: int, random: np.random.Generator) -> Array:
    """Loading at a constant rate, to a random height after a random time, and slips of 10 to 30 samples."""
    fall = int(random.integers(10, 30))
    level = 0.0
    parts = []
    shape = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, fall + 1) / fall)
    for wait in np.maximum(20, mean * random.lognormal(-0.1, 0.45, teeth)).astype(int):
        lowest = 0.5 * mean * (random.random() - 0.5)
        parts += [level + np.arange(wait), level + wait - (level + wait - lowest) * shape]
        level = lowest
    return np.concatenate(parts)


@pytest.mark.parametrize("cases", counts(4, 30))
def test_slow_saw_teeth_under_hum_impulses_and_drift_are_stick_slip(cases: int) -> None:
    for seed in range(cases):
        random = np.random.default_rng(seed)
        mean = int(10.0 ** random.uniform(2.4, 3.2))
        values = disturbed(saw_teeth(mean, 60, random), random.uniform(0.1, 0.35), random)
        found = judged(values, Measurand.FORCE)
        assert found.regime == Regime.RELAXATION, found
        assert found.frequency is not None
        assert 0.5 < found.frequency * (mean / RATE) < 2.0  # teeth per second, of which hum may hide or add some


@pytest.mark.parametrize("cases", counts(4, 30))
def test_an_oscillation_whose_amplitude_wanders_is_quasi_harmonic(cases: int) -> None:
    for seed in range(cases):
        random = np.random.default_rng(seed)
        turn = 2.0 * np.pi * random.uniform(20.0, 90.0) / RATE
        damping = 10.0 ** random.uniform(-2.2, -1.2)
        factor = np.exp((1j - damping) * turn)
        state = 0j
        values = np.empty(20000)
        for i, push in enumerate(random.normal(size=len(values))):
            state = factor * state + push
            values[i] = state.imag
        found = judged(disturbed(values, 0.1, random), Measurand.FORCE)
        assert found.regime == Regime.QUASI_HARMONIC, found
        assert found.stick_fraction is None  # nothing shows that there is no short stick


@pytest.mark.parametrize("cases", counts(0, 50, 200))
def test_ring_downs_after_impacts_are_never_stick_slip(cases: int) -> None:
    for seed in range(cases):
        random = np.random.default_rng(seed)
        turn = 2.0 * np.pi * random.uniform(0.01, 0.1)
        damping = 10.0 ** random.uniform(-2.7, -0.82)
        wait = 2.0 * np.pi / turn * random.uniform(6.0, 40.0)
        begins = np.cumsum(np.full(40, wait) if seed % 2 else wait * random.uniform(0.5, 1.5, 40))
        time = np.arange(int(begins[-1] + wait))
        values = np.zeros(len(time))
        ring = np.sin if seed % 4 > 1 else np.cos
        for begin in begins.astype(int):
            since = time[begin:] - begin
            sign = random.choice([-1.0, 1.0]) if seed % 8 > 3 else 1.0
            size = sign * random.lognormal(0.0, 0.3)
            values[begin:] += size * np.exp(-damping * turn * since) * ring(turn * since)
        values += 0.03 * values.std() * random.normal(size=len(values))
        for quantity in BOTH:
            assert judged(values, quantity).regime != Regime.RELAXATION, (seed, quantity)


@pytest.mark.parametrize(
    ("second", "third", "decibels"), [(0.3, 0.6, 60), (0.5, 0.25, 20), (0.5, 1.0 / 3.0, 60), (0.8, 1.0 / 3.0, 20)]
)
def test_three_lines_in_step_are_never_stick_slip(second: float, third: float, decibels: int) -> None:
    phase = 0.1203 * np.arange(8000)
    lines = [(1.0, 1), (second, 2), (third, 3)]
    noise = 10.0 ** (-decibels / 20.0) * np.random.default_rng(1).normal(size=len(phase))
    for quantity, wave in zip(BOTH, (np.sin, np.cos), strict=True):
        values = np.sum([size * wave(n * phase) for size, n in lines], axis=0)
        assert judged(values + values.std() * noise, quantity).regime != Regime.RELAXATION


@pytest.mark.parametrize("seed", range(3))
def test_spikes_of_one_sign_are_never_stick_slip(seed: int) -> None:
    random = np.random.default_rng(seed)
    values = random.normal(size=10000)
    places = random.choice(10000, 30, replace=False)
    values[places] += random.uniform(8.0, 40.0) * (random.lognormal(0.0, 0.4, 30) if seed % 2 else 1.0)
    for quantity in BOTH:
        assert judged(values, quantity).regime != Regime.RELAXATION


def test_stick_that_may_be_too_short_to_see_is_not_said_to_be_none() -> None:
    time = np.arange(20000) / 99.7
    size = 1.0 / np.cos(0.05 * np.pi)
    moved = np.cumsum(np.minimum(size * np.cos(2.0 * np.pi * time), 1.0))  # 5 % of each cycle at the belt's speed
    moved += 0.01 * moved.std() * np.random.default_rng(1).normal(size=len(moved))
    assert judged(moved, Measurand.DISPLACEMENT).stick_fraction is None


def test_measured_records_have_the_labels_of_those_who_measured_them() -> None:
    """Paper on paper: V. Colas et al., Phys. Rev. E 100 (2019) 032803; the file says what was changed."""
    found = []
    with h5py.File(RECORDS) as file:
        for name in ("k2254Nm_v42", "k2254Nm_v4300"):
            force = file[f"{name}/force"]
            values = force.attrs["scale"] * force[:].astype(np.float64)
            found.append(judged(values, Measurand.FORCE, force.attrs["sample_rate"]).regime)
    assert found == [Regime.RELAXATION, Regime.QUASI_HARMONIC]
