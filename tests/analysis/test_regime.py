"""Regimes of runs whose regime is known, and of histories made by hand."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.analysis.fate import Fate, Kind
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.decision import Excitation, Regime, Thresholds
from brakecli.analysis.regime.spectra import forced_lines
from brakecli.analysis.regime.statistics import statistics
from brakecli.solver.history import History
from tests.analysis.histories import INTERVAL, classified, history_of, lasting, verdict_of
from tests.examples import COULOMB, SQUEAL, make

TIME = INTERVAL * np.arange(20000)


def made(vx: NDArray[np.float64], state: float | NDArray[np.float64] = -1.0) -> History:
    """A motion to which friction gives energy."""
    return history_of(len(vx), vx=vx, x=np.cumsum(vx) * INTERVAL, friction_force=vx, state=state)


def test_where_rises_miss_the_lines_of_a_motion_the_strongest_line_is_its_frequency() -> None:
    """In most cycles of the line at 100 Hz the one at 237 Hz makes no further rise, in some it does."""
    lines = [size * np.sin(2.0 * np.pi * frequency * TIME) for size, frequency in ((1.0, 100.0), (0.9, 237.0))]
    slides = made(lines[0] + lines[1])
    known = Context(3.0, growth=lambda: 1.0, settles=100.0)
    verdict = lasting(slides, known)
    assert verdict.regime is Regime.QUASI_HARMONIC
    assert verdict.frequency == pytest.approx(100.0, abs=0.1)
    assert verdict.evidence["fundamental_share"] == pytest.approx(1.0 / 1.81, abs=0.01)


def test_an_amplitude_that_varies_by_as_much_as_itself_is_not_settled() -> None:
    """Two fifths of the cycles swing five times as far as others, in turns as long as the envelope's windows."""
    known = Context(3.0, growth=lambda: 1.0, settles=100.0)
    settled = []
    time = INTERVAL * np.arange(100_000)
    for low in (0.2, 0.9):
        sizes = np.where(time % 0.25 < 0.1, 1.0, low)
        verdict = lasting(made(sizes * np.sin(2.0 * np.pi * 100.0 * time)), known)
        assert verdict.regime is Regime.QUASI_HARMONIC
        settled.append((verdict.settled, verdict.amplitude_spread is not None, len(verdict.reasons)))
    assert settled == [(False, False, 2), (True, True, 1)]


def test_a_shoe_at_rest_on_a_standing_wheel_is_damped() -> None:
    verdict = verdict_of(make(COULOMB))
    assert verdict.regime is Regime.DAMPED
    assert "rest" in verdict.reasons[0]
    assert verdict.stick_fraction == 1.0


@pytest.mark.parametrize("place", [0.3, -12.34567, 1e-9 / 7.0])
def test_a_shoe_at_rest_has_settled_wherever_it_rests(place: float) -> None:
    """The mean of equal numbers may differ from them by rounding: nothing else moves there."""
    time = INTERVAL * np.arange(6001)
    late = time > 0.3 * time[-1]
    x = np.where(late, place, 1.5 * place * np.cos(20.0 * time))
    v_x = np.where(late, 0.0, -30.0 * place * np.sin(20.0 * time))
    [found] = statistics([history_of(len(time), x=x, vx=v_x)], Thresholds().settled_within)
    assert 0 < found.settled_from * INTERVAL <= 0.4 * time[-1]


def test_a_shoe_that_never_moves_along_a_standing_wheel_has_a_verdict_while_the_load_changes() -> None:
    changes: dict[str, Any] = {"wheel__angular_speed": 0.0, "friction__coefficient": 2.0, "load__force": None}
    load = {"load__times": (0.0, 0.5), "load__forces": (100.0, 5000.0)}
    verdict = verdict_of(make(SQUEAL, **changes, **load, solver__duration=0.5))
    assert verdict.regime is Regime.DAMPED
    assert verdict.remaining == 0.0


def test_a_shoe_that_is_carried_along_is_not_called_damped() -> None:
    changes: dict[str, Any] = {"link2__stiffness": 0.0, "link2__damping": 0.0, "solver__duration": 0.5}
    verdict = verdict_of(make(SQUEAL, **changes))
    assert verdict.regime is Regime.UNDECIDED
    assert "carried along" in verdict.reasons[0]


@pytest.mark.parametrize(("part", "locks"), [(0.98, False), (1.02, True)])
def test_a_shoe_that_locks_itself_is_told_that_no_longer_run_will_see_it_slip(part: float, *, locks: bool) -> None:
    """The wheel draws x, the links ask for a force and press the pad: both are linear in x, and y gives way."""
    angle = math.radians(40.0)
    first = 1e7
    second = 1.2e7
    contact = 2e6
    xx = second * math.cos(angle) ** 2
    xy = second * math.sin(angle) * math.cos(angle)
    yy = first
    yy += second * math.sin(angle) ** 2
    limit = (xx - xy**2 / (yy + contact)) / (contact * xy / (yy + contact))
    changes: dict[str, Any] = {"link2__angle_deg": -40.0, "friction__coefficient": part * limit}
    verdict = verdict_of(make(SQUEAL, **changes, wheel__angular_speed=0.5, solver__duration=1.0))
    assert verdict.stick_fraction == float(locks)
    assert locks is (f"it slips below a friction coefficient of {limit:.4g}" in verdict.reasons[0])
    assert "run longer" not in verdict.reasons[0]


def test_a_shoe_that_lost_contact_is_not_called_damped() -> None:
    load = {"load__force": None, "load__times": [0.0, 0.1], "load__forces": [5000.0, -5000.0]}
    verdict = verdict_of(make(SQUEAL, solver__duration=1.0, **load))
    assert verdict.regime is Regime.UNDECIDED
    assert "lost contact for good" in verdict.reasons[0]
    assert verdict.contact_loss_fraction == 1.0


@pytest.mark.parametrize("force", [-5000.0, 0.0])
def test_a_shoe_that_never_touched_is_not_called_damped(force: float) -> None:
    verdict = verdict_of(make(SQUEAL, load__force=force))
    assert verdict.regime is Regime.UNDECIDED
    assert "never touched" in verdict.reasons[0]


@pytest.mark.parametrize(("rate", "word"), [(2.0, "grows"), (-1.0, "falls")])
def test_a_motion_that_still_grows_or_decays_is_undecided_and_says_how_fast(rate: float, word: str) -> None:
    verdict = classified(made(1e-3 * np.exp(rate * TIME) * np.sin(2 * np.pi * 170.0 * TIME)), Context(1.0))
    assert verdict.regime is Regime.UNDECIDED
    assert word in verdict.reasons[0]
    assert verdict.evidence["level_change"] == pytest.approx(rate * 0.5 * TIME[-1], rel=0.02)


def test_a_decay_to_nothing_is_damped() -> None:
    history = made(np.exp(-5.0 * TIME) * np.sin(2 * np.pi * 170.0 * TIME))
    assert classified(history, Context(1.0)).regime is Regime.UNDECIDED
    assert classified(history, Context(1.0), continued=lambda: Fate(Kind.STEADY_SLIDING)).regime is Regime.DAMPED


def test_what_dies_has_no_settled_amplitude_however_slowly_it_does() -> None:
    known = Fate(Kind.STEADY_SLIDING)
    verdict = classified(made(np.sin(2 * np.pi * 170.0 * TIME)), Context(1.0), continued=lambda: known)
    assert (verdict.regime, verdict.settled) == (Regime.DAMPED, False)


def test_stick_in_some_cycles_only_is_neither() -> None:
    vx = 0.02 * np.sin(2 * np.pi * 170.0 * TIME)
    state = np.where((vx > 0.019) & (np.floor(170.0 * TIME) % 3 == 0), 0.0, -1.0)
    verdict = lasting(made(vx, state), Context(0.03))
    assert verdict.regime is Regime.UNDECIDED
    assert "with stick in 33% of the cycles, neither in most nor in few" in verdict.reasons[0]


def test_lines_of_the_roughness_are_the_passing_frequency_and_its_multiples() -> None:
    lines = forced_lines(2.0, (1.0 / 0.02,), 5000.0)
    assert lines[0] == pytest.approx(100.0)
    assert len(lines) == 10


@pytest.mark.parametrize("duration", [0.5, 2.0])
def test_squeal_on_a_wheel_of_many_waves_is_not_called_forced(duration: float) -> None:
    """In a short run their lines cover all, the squeal too: then the power shows that friction feeds it."""
    roughness = {
        "shoe": {"amplitudes": [2e-6, 1e-6], "wavelengths": [0.020, 0.011]},
        "wheel": {"amplitudes": [4e-6, 2e-6], "wavelengths": [0.030, 0.017]},
    }
    changes: dict[str, Any] = {"wheel__angular_speed": 4.0, "load__force": 5000.0, "output__sample_interval": 2e-4}
    case = make(SQUEAL | {"roughness": roughness}, friction__coefficient=0.7, solver__duration=duration, **changes)
    verdict = verdict_of(case)
    assert (verdict.regime, verdict.excitation) == (Regime.QUASI_HARMONIC, Excitation.SELF_EXCITED)


@pytest.mark.parametrize("samples", [1, 2, 50, 159])
def test_too_few_samples_are_undecided(samples: int) -> None:
    verdict = classified(made(np.sin(np.arange(samples))), Context(1.0))
    assert verdict.regime is Regime.UNDECIDED
    assert "samples" in verdict.reasons[0]


def test_too_few_cycles_and_too_coarse_samples_are_undecided() -> None:
    slow = lasting(made(np.sin(2 * np.pi * 2.0 * TIME)), Context(1.0))
    coarse = lasting(made(np.sin(2 * np.pi * 2500.0 * TIME + 0.3)), Context(1.0))
    assert "cycles" in slow.reasons[0]
    assert "samples a cycle" in coarse.reasons[0]
    assert slow.regime is coarse.regime is Regime.UNDECIDED


@pytest.mark.parametrize(("step", "also"), [(0.0, ""), (0.1, ""), (0.6, "solver.step and ")])
def test_more_samples_than_steps_are_not_asked_for(step: float, also: str) -> None:
    coarse = lasting(made(np.sin(2 * np.pi * 2500.0 * TIME + 0.3)), Context(1.0, step=step * INTERVAL))
    assert coarse.reasons[0].endswith(f"; reduce {also}output.sample_interval")


@pytest.mark.parametrize(("growth", "longer"), [(10.0, True), (1e80, False)])
def test_a_rest_that_is_unstable_is_not_to_be_run_for_a_shorter_time(growth: float, longer: bool) -> None:
    (reason,) = classified(made(1e-12 * np.sin(TIME)), Context(1.0, quiet=1e-9, growth=lambda: growth)).reasons
    assert "start beside steady sliding" in reason
    assert ("run at least" in reason) == longer


def test_a_motion_without_a_cycle_is_undecided_whatever_the_thresholds() -> None:
    lenient = Thresholds(fewest_cycles=0.0, settled_within=1e9)
    verdict = lasting(made(np.sin(np.pi * TIME / TIME[-1])), Context(1.0), lenient)
    assert verdict.regime is Regime.UNDECIDED
    assert "only 0 cycles" in verdict.reasons[0]


def test_a_changing_wheel_speed_is_undecided() -> None:
    verdict = classified(made(np.sin(2 * np.pi * 170.0 * TIME)), Context(1.0, steady=False))
    assert verdict.regime is Regime.UNDECIDED
    assert "changes with time" in verdict.reasons[0]


def test_evidence_names_lines_harmonics_and_powers() -> None:
    verdict = verdict_of(make(SQUEAL, friction__coefficient=0.7, solver__duration=2.0))
    evidence = verdict.evidence
    assert evidence["line_frequencies"][0] == pytest.approx(verdict.frequency, abs=1.0)
    assert evidence["line_shares"][0] > 0.99
    assert set(evidence["line_forced"]) == {0.0}
    assert len(evidence["harmonics"]) == 4
    assert 0.01 < evidence["harmonics"][0] < 0.1
    assert evidence["largest_vx_over_belt_speed"] == 1.0
    # A settled motion stores no more and no less: what it takes from the belt becomes heat, but for what the ends
    # of the record hold more than its beginning: Q times 2 y over 1.8 s is 1 W at most.
    assert abs(evidence["power_rest"]) < 1.0
    assert evidence["power_belt"] == pytest.approx(
        evidence["power_friction"] + evidence["power_dashpots"] + evidence["power_load"] + evidence["power_rest"]
    )
    assert evidence["power_friction"] > 0.0


def test_lines_of_the_roughness_are_distinguished_from_others() -> None:
    lines = forced_lines(2.0, (1.0 / 0.02,), 5000.0)
    both = np.sin(2 * np.pi * 100.0 * TIME) + np.sin(2 * np.pi * 151.0 * TIME + 1.0)
    evidence = lasting(made(both), Context(2.0, True, lines)).evidence
    found = dict(zip(evidence["line_frequencies"], evidence["line_forced"], strict=True))
    assert {round(frequency): flag for frequency, flag in found.items()} == {100: 1.0, 151: 0.0}


@pytest.mark.parametrize(
    ("rate", "undamped", "settled"), [(0.1, False, False), (5.0, False, True), (5.0, True, False)]
)
def test_what_small_disturbances_outlast_is_not_settled(rate: float, undamped: bool, settled: bool) -> None:
    known = Context(2.0, undamped=undamped, growth=lambda: rate)
    verdict = lasting(made(np.sin(2 * np.pi * 151.0 * TIME)), known)
    assert (verdict.regime, verdict.settled) == (Regime.QUASI_HARMONIC, settled)


def test_bands_whose_frequency_wanders_hold_no_vibration() -> None:
    """Frequencies drawn for every tenth of a second: bands hold nearly all, but cycles differ."""
    for swing, regime in ((0.002, Regime.QUASI_HARMONIC), (0.15, Regime.UNDECIDED)):
        drawn = 1.0 + swing * np.random.default_rng(4).uniform(-1.0, 1.0, 20)
        frequency = 150.0 * np.interp(TIME, np.linspace(0.0, TIME[-1], 20), drawn)
        verdict = lasting(made(np.sin(2 * np.pi * np.cumsum(frequency) * INTERVAL)), Context(2.0))
        assert verdict.regime is regime, verdict.reasons


@pytest.mark.parametrize(
    ("width", "samples", "missed"),
    [(0.02, 13.3, False), (0.02, 13.0, True), (0.5, 13.3, False), (0.5, 13.0, False)],
)
def test_impacts_of_less_than_a_sample_show_in_some_cycles_or_are_missed(
    width: float, samples: float, missed: bool
) -> None:
    """A pulse of 600 N on a swing of 200 N, for a quarter of a sample; cycles of 13.0 samples are alike."""
    phase = (np.arange(4000) / samples + 0.013) % 1.0
    vx = 0.01 * np.cos(2.0 * np.pi * phase)
    force = 1e4 * vx + np.where(phase < width, 600.0, 0.0)
    columns = {"vx": vx, "x": np.cumsum(vx) * INTERVAL, "friction_force": force}
    verdict = lasting(
        history_of(4000, state=np.where(vx > 0.008, 0.0, -1.0), **columns), Context(0.01, growth=lambda: 100.0)
    )
    assert verdict.settled
    assert any("output.sample_interval" in reason for reason in verdict.reasons) == missed
    if missed:
        assert verdict.torque_variation is None
    else:
        assert verdict.torque_variation == pytest.approx(800.0, rel=0.03)  # (π/13)²/2


@pytest.mark.parametrize(
    ("waves", "turns"),
    [
        ([1, 7], 1.0),
        ([2, 3], 1.0),
        ([4, 6], 0.5),
        ([6.0], 1 / 6),
        ([0.5, 2.5], 2.0),
        ([2.5], 0.4),
        ([1.3, 4], 1 / 1.3),
    ],
)
def test_the_variation_of_the_torque_needs_the_time_in_which_the_waves_repeat(
    waves: list[float], turns: float
) -> None:
    turn = 2.0 * np.pi * 0.4 / 3.0  # s, at 3 m/s
    passing = tuple((wave / turn, 1e-6) for wave in waves)
    context = Context(-3.0, radius=0.4, waves=(*passing, (0.01, 1e-12)))  # a weak wave is not waited for
    assert context.pattern == pytest.approx(turns * turn)
    history = history_of(len(TIME), state=-1.0)  # damped
    reasons = classified(history, Context(3.0, waves=((0.9 / TIME[-1], 1e-6),))).reasons
    assert any("torque_variation needs" in each for each in reasons)
    reasons = classified(history, Context(3.0, waves=((60.0, 1e-6),))).reasons
    assert not any("torque_variation needs" in each for each in reasons)
