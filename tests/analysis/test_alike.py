"""Ten shoes or records like each of the named ones, drawn: what holds of the named one holds of them."""

import math
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.spectrum import peak, spectrum
from brakecli.solver.quantities import ContactState
from tests.analysis.histories import INTERVAL, history_of, lasting, verdict_of
from tests.campaign import counts
from tests.examples import SQUEAL, make


@pytest.mark.parametrize("draws", counts(2, 10))
def test_no_shoe_that_sticks_after_a_hard_start_has_died_out(draws: int) -> None:
    rng = np.random.default_rng(12)
    for _ in range(draws):
        changes: dict[str, Any] = {
            "wheel__angular_speed": 10.0 ** rng.uniform(-2.7, -1.5),
            "initial__vx": -rng.uniform(0.2, 1.0),
            "friction__coefficient": rng.uniform(0.62, 1.0),  # sliding is unstable from 0.575 on
        }
        verdict = verdict_of(make(SQUEAL, **changes, solver__duration=0.5))
        assert verdict.regime is not Regime.DAMPED, changes
        assert "died out" not in verdict.reasons[0]


@pytest.mark.parametrize("draws", counts(3, 10))
def test_the_amplitude_is_that_which_lasts_and_not_its_transient(draws: int) -> None:
    rng = np.random.default_rng(15)
    time = INTERVAL * np.arange(20000)
    for _ in range(draws):
        frequency = rng.uniform(50.0, 200.0)
        depth = rng.uniform(-0.05, 0.1)
        rate = rng.uniform(2.0, 8.0)
        vx = 1e-2 * (1.0 + depth * np.exp(-rate * time)) * np.sin(2 * np.pi * frequency * time)
        motion = history_of(len(vx), vx=vx, x=np.cumsum(vx) * INTERVAL, state=np.where(vx > 0.0099, 0.0, -1.0))
        verdict = lasting(motion, Context(1e-2))
        # The median cycle lies in the second half; fifty samples a cycle miss (π/50)²/2 of a crest.
        left = abs(depth) * math.exp(-rate * 0.5 * time[-1]) + 2e-3
        assert verdict.amplitude == pytest.approx(1e-2 / (2 * np.pi * frequency), rel=left)
        assert verdict.frequency == pytest.approx(frequency, rel=1e-3)


@pytest.mark.parametrize("draws", counts(5, 100))
def test_each_peak_of_a_short_record_is_right_within_its_resolution_or_left_out(draws: int) -> None:
    rng = np.random.default_rng(16)
    named = 0
    for _ in range(draws):
        cycles = 10.0 ** rng.uniform(0.0, 1.7)
        frequency = rng.uniform(20.0, 400.0)
        samples = int(cycles / frequency / INTERVAL)
        time = INTERVAL * np.arange(samples)
        vx = np.sin(2.0 * np.pi * frequency * time + rng.uniform(0.0, 6.0))
        lines = spectrum(history_of(samples, vx=vx), 0)
        found = peak(lines.frequency, lines.density["vx"], samples * INTERVAL)
        if found is not None:
            assert found == pytest.approx(frequency, abs=float(lines.frequency[1])), (frequency, cycles)
            assert cycles >= 4.0  # five, less half a line
            named += 1
        else:
            assert cycles < 10.0, (frequency, cycles)
    assert named >= draws // 4


@pytest.mark.parametrize("draws", counts(20, 200))
def test_a_cycle_of_no_whole_number_of_samples_is_not_taken_for_several(draws: int) -> None:
    """The shoe sticks to a belt of speed 1, and slips back at once faster than that: vx jumps, x does not."""
    rng = np.random.default_rng(17)
    for _ in range(draws):
        cycle = rng.integers(8, 20) + rng.choice([1 / 4, 1 / 3, 1 / 2, 2 / 3, 3 / 4]) + rng.uniform(-2e-3, 2e-3)
        slip = rng.uniform(0.2, 0.5)  # part of a cycle
        place = np.arange(20000) / cycle % 1.0
        turn = np.pi * (place - 1.0 + slip) / slip
        sticks = place < 1.0 - slip
        x = np.where(sticks, place, (1.0 - slip) * 0.5 * (1.0 + np.cos(turn)))
        vx = np.where(sticks, 1.0, -(1.0 - slip) * 0.5 * np.pi / slip * np.sin(turn))
        state = np.where(sticks, ContactState.STICK, ContactState.BACKWARD_SLIP)
        verdict = lasting(history_of(len(x), x=x * cycle * INTERVAL, vx=vx, state=state), Context(1.0))
        assert verdict.regime is Regime.RELAXATION, (cycle, slip)
        assert verdict.frequency == pytest.approx(1.0 / cycle / INTERVAL, rel=1e-3), (cycle, slip)
