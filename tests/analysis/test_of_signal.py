"""Measured signals: the regime is that by which they were made, whatever noise, rate and disturbance."""

import numpy as np
import pytest

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.analysis.signals.look import Measurand, Signal, SignalVerdict, look
from brakecli.analysis.signals.table import SignalThresholds
from tests.analysis.measured_signals import (
    Array,
    clipped,
    disturbed,
    measured,
    motions,
    outcome,
    stick_slip,
    verdict,
)
from tests.campaign import campaign

IN_DOUBT = {  # at 20 dB and worse
    "two lines in step": "noise hides the overtones that tell stick from two lines",
    "stick-slip 0.3": "noise hides the overtones, 1 % of the energy, that tell stick from three lines in step",
    "irregular stick-slip lognormal 0.3": "the same: a long slip among noise",
    "irregular stick-slip lognormal 0.02": "few samples, in which noise hides that a slip goes one way only",
    "irregular stick-slip decade 0.3": "few samples, in which noise hides that slips go with the time before them",
}


@pytest.mark.parametrize(
    ("per_cycle", "quantity"),
    [
        pytest.param(n, quantity, marks=() if (n, k) in ((10, 0), (10, 2)) else campaign)
        for n in (10, 50, 200)
        for k, quantity in enumerate((Measurand.DISPLACEMENT, Measurand.VELOCITY, Measurand.FORCE))
    ],
)
def test_no_motion_is_mistaken_for_another(per_cycle: int, quantity: Measurand) -> None:
    checked = 0
    for motion in motions(per_cycle, 100):
        for decibels in (40, 20, 10):
            values = measured(motion.displacement, per_cycle, quantity, decibels)
            found = verdict(values, per_cycle, quantity)
            result = outcome(found.regime, motion.regime)
            doubtful = motion.name in IN_DOUBT and decibels <= (20 if per_cycle <= 10 else 10)
            assert result == "right" or (doubtful and result == "undecided"), (motion.name, decibels, found)
            checked += 1
    assert checked == 69


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [
        pytest.param(kind, quantity, marks=campaign if (k + n) % 2 else ())
        for k, kind in enumerate(("spikes", "drift", "offset", "sign reversed", "short gaps", "long gap"))
        for n, quantity in enumerate((Measurand.DISPLACEMENT, Measurand.VELOCITY))
    ],
)
def test_disturbances_do_not_change_the_regime(kind: str, quantity: Measurand) -> None:
    checked = 0
    for motion in motions(50, 100):
        values = disturbed(measured(motion.displacement, 50, quantity, 20), 50, kind)
        checked += 1
        if motion.name == "noise" and kind == "spikes":
            continue  # spikes in nothing but noise are events, for all that a signal can show
        found = verdict(values, 50, quantity).regime
        assert outcome(found, motion.regime) != "wrong", motion.name
    assert checked == 23


def test_what_was_changed_is_reported() -> None:
    values = measured(np.sin(2.0 * np.pi * np.arange(5000) / 50), 50, Measurand.DISPLACEMENT, 40)
    for kind, words in {
        "spikes": "spikes removed",
        "drift": "drift removed",
        "short gaps": "short gaps bridged: 8",
        "long gap": "long gaps: 1, so that only the longest piece is used, 3650 of 5000 samples",
    }.items():
        slow = disturbed(values, 50, kind)
        if kind == "drift":
            slow = slow + 50.0 * np.sin(2.0 * np.pi * np.arange(5000) / 2500)
        found = verdict(slow, 50, Measurand.DISPLACEMENT)
        assert any(words in warning for warning in found.warnings), (kind, found.warnings)
    assert verdict(values, 50, Measurand.DISPLACEMENT).warnings == ()


def test_frequency_and_amplitude_of_a_sine_are_those_of_its_displacement() -> None:
    time = np.arange(20000) / 1000.0
    frequency = 20.0
    size = 3e-5
    stiffness = 4e6
    x = size * np.sin(40.0 * np.pi * time)
    v = 40.0 * np.pi * size * np.cos(40.0 * np.pi * time)
    for values, quantity in (
        (x, Measurand.DISPLACEMENT),
        (v, Measurand.VELOCITY),
        (stiffness * x, Measurand.FORCE),
    ):
        known = look(Signal(values, 1e-3), quantity=quantity, stiffness=stiffness).verdict
        assert known.frequency == pytest.approx(frequency, rel=1.0 / 400)  # a bin of 400 cycles
        # smoothed over a cycle's 1/25 at most, and the largest sample up to 1/100 of a cycle from the peak
        assert known.amplitude == pytest.approx(size, rel=0.01)
    assert look(Signal(stiffness * x, 1e-3), quantity=Measurand.FORCE).verdict.amplitude is None


@pytest.mark.parametrize(("noise", "frequency"), [(0.0, 900.13), (1.0, 900.0), (3.0, 900.13)])
def test_the_amplitude_of_an_acceleration_is_that_of_its_tone_and_not_of_integrated_noise(
    noise: float, frequency: float
) -> None:
    turn = 2.0 * np.pi * frequency
    time = np.arange(60_000) / 20_000.0
    values = 20.0 * np.sin(turn * time) + noise * np.random.default_rng(5).normal(size=len(time))
    found = look(Signal(values, 1.0 / 20_000.0), quantity=Measurand.ACCELERATION).verdict
    true = 20.0 / turn**2
    assert found.amplitude is not None
    assert found.amplitude_spread is not None
    # of a known frequency the amplitude has a standard deviation of σ √(2/n); here it is that of a window
    assert found.amplitude_spread < 1e-4 * true + 10.0 * noise * np.sqrt(2.0 / len(time)) / turn**2
    assert abs(found.amplitude - true) <= 1e-3 * true + 3.0 * found.amplitude_spread


@pytest.mark.parametrize(("quantity", "slip"), [(Measurand.VELOCITY, 0.3), (Measurand.ACCELERATION, 0.1)])
def test_the_amplitude_of_stick_slip_among_noise_is_that_of_its_displacement(
    quantity: Measurand, slip: float
) -> None:
    x = stick_slip(100, 60, slip)
    found = look(Signal(measured(x, 100, quantity, 20), 0.01), quantity=quantity).verdict
    assert found.amplitude is not None
    assert found.amplitude_spread is not None
    true = 0.5 * float(np.ptp(x))
    # overtones that noise hides bring the corners closer: the k-th has 2/πk of a saw-tooth
    assert found.amplitude == pytest.approx(true, rel=0.03)


@pytest.mark.parametrize("quantity", [Measurand.DISPLACEMENT, Measurand.VELOCITY, Measurand.ACCELERATION])
def test_what_has_died_out_has_no_amplitude(quantity: Measurand) -> None:
    time = np.arange(60_000) / 20_000.0
    values = 2e-5 * np.exp(-8.0 * time) * np.sin(1800.0 * np.pi * time)
    values = values + 2e-8 * np.random.default_rng(5).normal(size=len(time))
    found = look(Signal(values, 1.0 / 20_000.0), quantity=quantity).verdict
    assert found.regime == Regime.DAMPED
    assert (found.amplitude, found.amplitude_spread) == (None, None)


def test_events_and_time_of_stick_are_counted() -> None:
    for slip in (0.05, 0.1, 0.3):
        found = verdict(
            measured(stick_slip(100, 60, slip), 100, Measurand.DISPLACEMENT, 40), 100, Measurand.DISPLACEMENT
        )
        assert found.frequency == pytest.approx(1.0, abs=1.5 / 60)  # an event at either end
        assert found.stick_fraction == pytest.approx(1.0 - slip, abs=0.06)


@pytest.mark.parametrize("stick", [0.08, 0.1, 0.2])
def test_short_stick_shows_by_the_speed_of_the_belt(stick: float) -> None:
    signal = Signal(clipped(stick), 1e-3)
    known = look(signal, quantity=Measurand.VELOCITY, belt_speed=1.0).verdict
    assert known.regime == Regime.RELAXATION
    assert known.stick_fraction == pytest.approx(stick, abs=0.03)
    assert look(signal, quantity=Measurand.VELOCITY).verdict.regime != Regime.QUASI_HARMONIC


@pytest.mark.parametrize("size", [0.5, 0.9, 2.0])
def test_a_sine_that_passes_the_belts_speed_or_keeps_below_does_not_stick(size: float) -> None:
    signal = Signal(size * np.cos(0.0631 * np.arange(20000)), 1e-3)
    assert look(signal, quantity=Measurand.VELOCITY, belt_speed=1.0).verdict.regime == Regime.QUASI_HARMONIC


def _undecided(values: Array, reason: str) -> SignalVerdict:
    found = look(Signal(values, 1.0), quantity=Measurand.DISPLACEMENT).verdict
    assert found.regime == Regime.UNDECIDED
    assert reason in found.reasons[0]
    assert found.frequency is None
    return found


def test_every_undecided_names_its_reason() -> None:
    time = np.arange(3000.0)
    _undecided(np.sin(2.0 * np.pi * time / 500), "cycles; measure longer")
    _undecided(np.sin(2.0 * np.pi * time / 5.03), "samples a cycle; measure at a higher rate")
    _undecided(np.exp(time / 800) * np.sin(0.3 * time), "the level grows")
    _undecided(np.exp(-time / 2000) * np.sin(0.3 * time), "the level falls")
    _undecided(np.random.default_rng(1).normal(0.0, 1.0, 3000), "hidden by noise")


def test_short_and_hostile_signals_are_undecided_at_worst() -> None:
    random = np.random.default_rng(2)
    hostile = [
        np.array([0.0, 1.0]),
        np.array([0.0, 1.0, 0.0, 1.0]),
        np.arange(100.0),
        np.where(np.arange(1000) == 500, 1.0, 0.0),
        np.where(np.arange(1000) < 500, 1.0, 0.0),
        np.where(random.random(200) < 0.9, np.nan, 1.0) * random.normal(size=200),
        1e90 * random.normal(size=300),
        1e-200 * random.normal(size=300),
    ]
    for values in hostile:
        for quantity in Measurand:
            found = look(Signal(values, 1.0), quantity=quantity, belt_speed=1.0, stiffness=1.0).verdict
            assert found.regime in (Regime.UNDECIDED, Regime.DAMPED), values[:5]
            numbers = [value for name, value in found.evidence.items() if name != "row"]
            assert np.isfinite(numbers).all(), found.evidence


def test_a_measurement_does_not_show_what_drives_it_and_keeps_its_thresholds() -> None:
    found = look(
        Signal(np.sin(0.1 * np.arange(5000)), 1.0),
        quantity=Measurand.DISPLACEMENT,
        thresholds=SignalThresholds(fewest_cycles=1000.0),
    ).verdict
    assert (found.regime, found.excitation) == (Regime.UNDECIDED, Excitation.NONE)
    assert found.contact_loss_fraction is None
    assert found.thresholds.fewest_cycles == 1000.0


@pytest.mark.parametrize("cycles", [12.5, 325.6])
@pytest.mark.parametrize("form", ["sine", "saw-teeth"])
def test_a_frequency_is_better_than_one_over_the_length_of_the_record(cycles: float, form: str) -> None:
    phase = np.arange(20_000) * cycles / 20_000
    values = np.sin(2.0 * np.pi * phase) if form == "sine" else np.minimum(phase % 1.0, 10.0 * (1.0 - phase % 1.0))
    found = look(Signal(values, 1.0 / 20_000), quantity=Measurand.DISPLACEMENT).verdict
    assert found.regime == (Regime.QUASI_HARMONIC if form == "sine" else Regime.RELAXATION)
    assert found.frequency == pytest.approx(cycles, abs=0.1)
