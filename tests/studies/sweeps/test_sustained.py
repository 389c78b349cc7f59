"""From which value on vibration lasts: held against runs of 64 durations by an integrator of its own."""

import math
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.starts import settle
from brakecli.analysis.fate import fate_on_smooth_pads
from brakecli.analysis.regime.decision import Decision, Regime
from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.shoe import Shoe
from brakecli.case.system import system_of
from brakecli.solver.motion.flow import SmoothFlow
from brakecli.studies.sweeps.sustained import _by_runs, sustained
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from brakecli.studies.sweeps.windows_of_branch import explored
from tests.campaign import campaign
from tests.examples import SQUEAL, make
from tests.studies.sweeps.test_critical import found

KICKED: dict[
    str, Any
] = {  # decays slowly: -0.30 1/s at 2.795, -0.018 at 3.15; lives from between 3.15 and 3.17 on
    "shoe": {"mass": 4.4942},
    "wheel": {"radius": 0.5, "angular_speed": 3.6162},
    "link1": {"stiffness": 2621600.0, "damping": 10.07},
    "link2": {"stiffness": 904960.0, "damping": 15.253, "angle_deg": 31.916},
    "load": {"force": 279.99},
    "friction": {"coefficient": 2.8536},
    "contact": {"half_length": 0.046097, "stiffness": 26564000.0},
    "initial": {"at": "rest", "vx": -0.0002065, "vy": -0.059812},
    "solver": {"duration": 0.36389, "step": 5.7542e-05},
    "output": {"sample_interval": 0.00011508},
}
RESTING: dict[str, Any] = {  # lives from between 157.4 and 157.7 kN/m on
    "shoe": {"mass": 9.123},
    "wheel": {"radius": 0.5, "angular_speed": 2.7178},
    "link1": {"stiffness": 487700.0, "damping": 29.856},
    "link2": {"stiffness": 408040.0, "damping": 77.088, "angle_deg": 18.891},
    "load": {"force": 243.92},
    "friction": {"coefficient": 1.815},
    "contact": {"half_length": 0.023344, "stiffness": 35790000.0},
    "initial": {"at": "rest"},
    "solver": {"duration": 3.0244, "tolerance": 1e-4},
    "output": {"sample_interval": 0.00025533},
}
ANGLED: dict[str, Any] = {  # the less the second link leans, the less it vibrates
    "shoe": {"mass": 4.0499},
    "wheel": {"radius": 0.4, "angular_speed": 0.041197},
    "link1": {"stiffness": 2451000.0, "damping": 34.863, "angle_deg": -66.824},
    "link2": {"stiffness": 1117370.0, "damping": 5.1527, "angle_deg": -19.103},
    "load": {"force": 1109.6},
    "friction": {"coefficient": 0.20764},
    "contact": {"half_length": 0.013333, "stiffness": 91291000.0},
    "initial": {"at": "rest"},
    "solver": {"scheme": "two-layer", "theta": [0.5, 0.5], "step": 3.5087e-05, "duration": 0.60724},
    "output": {"sample_interval": 0.00017543},
}
BOUNCING: dict[str, Any] = {  # dies out from 4.2 compressions to 1e-14 at 1.865, and keeps half of one at 1.876
    "shoe": {"mass": 0.586},
    "wheel": {"radius": 0.5, "angular_speed": 1.22},
    "link1": {"stiffness": 14200000.0, "damping": 0.899, "angle_deg": 0.0},
    "link2": {"stiffness": 24900000.0, "damping": 2.36, "angle_deg": 7.23},
    "load": {"force": 4000.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.02, "stiffness": 75400000.0},
    "output": {"sample_interval": 1.8e-05},
    "solver": {"duration": 0.07, "scheme": "piecewise-exact"},
    "initial": {"vx": -7.37, "vy": 1.18},
}
HARD: dict[str, Any] = {  # bounces long, and dies out everywhere
    "shoe": {"mass": 1.22},
    "wheel": {"radius": 0.5, "angular_speed": 0.929},
    "link1": {"stiffness": 438000.0, "damping": 0.15, "angle_deg": 0.0},
    "link2": {"stiffness": 682000.0, "damping": 0.115, "angle_deg": 23.6},
    "load": {"force": 58.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.02, "stiffness": 2320000.0},
    "solver": {"duration": 0.57, "scheme": "event-driven"},
    "output": {"sample_interval": 0.00014},
    "initial": {"vy": 0.204},
}
STEEP: dict[str, Any] = {  # bounces for 10 to 40 s, and then fades at the 0.0102 1/s of its eigenvalue
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 4.0},
    "link1": {"stiffness": 10000000.0, "damping": 300.0, "angle_deg": 90.0},
    "link2": {"stiffness": 12000000.0, "damping": 300.0, "angle_deg": 5.0},
    "load": {"force": 5000.0},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 20000000.0},
    "solver": {"step": 2e-05, "scheme": "two-layer", "duration": 0.2},
}


@pytest.mark.parametrize(
    ("tables", "key", "ends", "tolerance", "lives"),
    [
        (KICKED, "friction__coefficient", (0.0, 5.07), 0.0015, (3.15, 3.17)),
        (BOUNCING, "friction__coefficient", (1.7, 2.07), 0.002, (1.865, 1.876)),
        (RESTING, "link2__stiffness", (122400.0, 1020000.0), 900.0, (157.4e3, 157.7e3)),
    ],
)
def test_slow_decay_on_a_smooth_pad_does_not_last(
    tables: dict[str, Any], key: str, ends: tuple[float, float], tolerance: float, lives: tuple[float, float]
) -> None:
    answer = found(tables, *ends, key, tolerance=tolerance)
    assert answer.sustained_outcome is Outcome.FOUND
    assert answer.sustained is not None
    assert lives[0] - tolerance < answer.sustained < lives[1] + tolerance


def test_what_fades_right_below_the_critical_value_lasts_from_that_value_on() -> None:
    """Below its critical friction nothing lasts of the squeal shoe, as its branches show."""
    answer = found(SQUEAL, 0.0, 2.0, tolerance=0.02)
    assert answer.outcome is answer.sustained_outcome is Outcome.FOUND
    assert answer.sustained == answer.value
    assert "its own start" not in answer.sentence


def test_what_lasts_at_the_lower_bound_only_does_not_last_throughout() -> None:
    """Beyond -13.95 degrees sliding is stable, and runs of another integrator die out at -12.56 and -11.10."""
    answer = found(ANGLED, -27.1, -11.1, "link2__angle_deg", tolerance=0.05)
    assert answer.outcome is Outcome.REGAINED
    assert (answer.sustained, answer.sustained_outcome) == (None, Outcome.IN_PART)


def test_what_bounces_longer_than_a_run_beside_stable_sliding_does_not_last() -> None:
    answer = found(HARD, 0.0, 2.47, tolerance=2.47e-3)
    assert answer.outcome is Outcome.STABLE
    assert answer.sustained_outcome in (Outcome.DAMPED, Outcome.UNDECIDED)
    assert answer.sustained is None


@campaign
def test_what_bounces_ever_higher_beside_stable_sliding_lasts() -> None:
    """It grows slowly, to an orbit that closes to rounding and attracts it; at 1.9 it fades as slowly."""
    answer = found(STEEP, 0.0, 2.0, tolerance=2e-3)
    assert answer.outcome is Outcome.STABLE
    assert answer.sustained_outcome is Outcome.FOUND
    assert answer.sustained is not None
    assert 1.9 < answer.sustained < 1.92
    case = make(STEEP, friction__coefficient=1.92)
    flow = SmoothFlow.of(system_of(case))
    shoe = Shoe.of(system_of(case))
    assert shoe.rest is not None
    end = fate_on_smooth_pads(shoe, system_of(case).initial.beside(shoe.rest))
    assert end.state is not None
    assert end.orbit is not None
    flow(end.state, end.orbit.period)
    np.testing.assert_allclose(flow.state, end.state, atol=1e-12)
    sizes = sorted(np.abs(np.linalg.eigvals(flow.derivative)))
    assert sizes[-1] == pytest.approx(1.0, abs=1e-9)
    assert sizes[-2] < 0.999


def verdict(amplitude: float, regime: Regime = Regime.RELAXATION) -> Verdict:
    """The verdict on a run of a vibration with stick."""
    return Verdict(Decision("", regime), amplitude, 0.5, 0.0, 0.0, 0.0, 0.0, True, {})


@pytest.mark.parametrize(
    ("amplitudes", "lasts"), [((1.0, 1.005), True), ((1.0, 1.02, 1.01), True), ((1.0, 0.9, 0.8, 0.7), None)]
)
def test_without_a_common_period_a_vibration_lasts_that_keeps_its_amplitude(
    amplitudes: tuple[float, ...], lasts: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    waves = {"amplitudes": [1e-6, 1e-6], "wavelengths": [0.02, 0.02 / math.sqrt(2.0)]}
    case = make(SQUEAL, roughness__wheel=waves)
    kept = [verdict(each) for each in amplitudes]
    for told, expected in (
        (kept, lasts),
        (4 * [verdict(1.0, Regime.UNDECIDED)], None),
        ([verdict(1.0, Regime.DAMPED)], False),
    ):
        runs = Mock(side_effect=told)
        monkeypatch.setattr("brakecli.studies.sweeps.sustained.verdict_of", runs)
        assert _by_runs(case, system_of(case)).lasts is expected


@pytest.mark.usefixtures("without_runs")
def test_the_vibration_that_lasts_lowest_down_is_handed_on() -> None:
    critical = Critical(parameter="friction.coefficient", lower=0.3, upper=0.9)
    answers = Answers(explored(critical, make(SQUEAL)).explored, None)
    answer = sustained(answers, 1e-2, Search(Outcome.UNSTABLE))
    line = answers.line
    assert answer.outcome is Outcome.FOUND
    assert answer.value is not None
    assert answer.state is not None
    assert answer.at is not None
    assert 0.0 < answer.at - answer.value < 1e-2
    point = settle(Cycles(line), line.place(answer.at), answer.state, 1.0)
    assert point is not None
    assert point.stable
