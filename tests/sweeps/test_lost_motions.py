"""Critical values where the search finds no motion, or another one: it must not report what it does not know.

The truths are those of another integrator, which follows the motion in small steps.
"""

from pathlib import Path
from typing import Any

import pytest
import tomli_w

from brakecli.branches.line import Line
from brakecli.sweeps.critical import search
from brakecli.sweeps.tables import Critical
from brakecli.sweeps.windows import Outcome, Search
from tests.campaign import campaign
from tests.commands import brakecli
from tests.examples import make
from tests.sweeps.test_windows import assert_found, listed_ends

pytestmark = pytest.mark.usefixtures("without_runs")

LOST: dict[str, Any] = {  # no motion is found where vibration grows by hundreds 1/s
    "shoe": {"mass": 7.565},
    "wheel": {"radius": 0.5, "angular_speed": 3.714},
    "link1": {"stiffness": 17990000.0, "damping": 119.2, "angle_deg": 11.35},
    "link2": {"stiffness": 19690000.0, "damping": 198.4, "angle_deg": 28.15},
    "load": {"force": 940.9},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.04, "stiffness": 387800000.0},
    "roughness": {
        "wheel": {"amplitudes": [4.764e-06, 4.702e-06], "wavelengths": [0.012, 0.052]},
        "shoe": {"amplitudes": [4.569e-06], "wavelengths": [0.017]},
    },
    "solver": {"duration": 0.05, "scheme": "three-layer", "step": 1.3e-05, "theta": [0.35, 0.3, 0.35]},
}
IN_STEP: dict[str, Any] = {  # a vibration that keeps in step with the waves grows out of the unstable motion
    "shoe": {"mass": 59.81},
    "wheel": {"radius": 0.2, "angular_speed": 3.724},
    "link1": {"stiffness": 1618000.0, "damping": 35.93, "angle_deg": -1.517},
    "link2": {"stiffness": 1460000.0, "damping": 34.38, "angle_deg": 29.26},
    "load": {"force": 41.07},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.055, "stiffness": 5392000.0},
    "roughness": {
        "wheel": {
            "amplitudes": [1.114e-05, 6.737e-06],
            "wavelengths": [0.014, 0.06],
            "phases_deg": [177.2, 323.7],
        },
        "shoe": {"amplitudes": [2.966e-06, 3.145e-06], "wavelengths": [0.039, 0.022]},
    },
    "solver": {"duration": 1.9, "scheme": "three-layer", "step": 0.00016, "theta": [0.35, 0.3, 0.35]},
}
FLIGHTS: dict[str, Any] = {  # of 23 static compressions
    "shoe": {"mass": 12.59},
    "wheel": {"radius": 0.5, "angular_speed": 12.62},
    "link1": {"stiffness": 1907000.0, "damping": 22.02, "angle_deg": 0.0},
    "link2": {"stiffness": 3524000.0, "damping": 16.09, "angle_deg": 29.15},
    "load": {"force": 107.1},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.015, "stiffness": 79610000.0},
    "roughness": {"wheel": {"amplitudes": [1.038e-05], "wavelengths": [0.072]}},
    "solver": {"duration": 0.61, "scheme": "three-layer", "step": 0.00017, "theta": [0.3, 0.4, 0.3]},
}
LONGER: dict[str, Any] = {  # of 120
    "shoe": {"mass": 19.97},
    "wheel": {"radius": 0.2, "angular_speed": -76.71},
    "link1": {"stiffness": 13650000.0, "damping": 57.03, "angle_deg": 0.7919},
    "link2": {"stiffness": 27080000.0, "damping": 64.26, "angle_deg": -11.03},
    "load": {"force": 567.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.01, "stiffness": 884000000.0},
    "roughness": {"wheel": {"amplitudes": [1.648e-05], "wavelengths": [0.087]}},
    "solver": {"duration": 0.3, "scheme": "two-layer", "step": 8.4e-05, "theta": [0.5, 0.5]},
}
BESIDE: dict[str, Any] = {  # with the step given, another motion is stable up to half as far from its end
    "shoe": {"mass": 1.071},
    "wheel": {"radius": 0.33, "angular_speed": 28.65},
    "link1": {"stiffness": 894800.0, "damping": 8.673, "angle_deg": 5.911},
    "link2": {"stiffness": 1951000.0, "damping": 7.418, "angle_deg": 30.67},
    "load": {"force": 106.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.04, "stiffness": 9009000.0},
    "roughness": {"wheel": {"amplitudes": [1.898e-05, 2.605e-05], "wavelengths": [0.05, 0.048]}},
    "solver": {"duration": 0.25, "scheme": "three-layer", "step": 4.2e-05, "theta": [0.35, 0.3, 0.35]},
}


def answer(tables: dict[str, Any], upper: float) -> Search:
    """The critical friction, without runs for the least sustained value."""
    critical = Critical(parameter="friction.coefficient", lower=0.0, upper=upper, tolerance=1e-3)
    return search(critical, Line(make(tables), [critical.parameter], 0.0, upper))


@campaign
def test_a_note_says_where_no_motion_was_found(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(tomli_w.dumps(LOST))
    critical = {"parameter": "friction.coefficient", "lower": 0.0, "upper": 4.9, "tolerance": 1e-3}
    (tmp_path / "s.toml").write_text(tomli_w.dumps({"case": "case.toml", "critical": critical}))
    printed = brakecli("sweep", "s.toml", "-j", "1", "--json", cwd=tmp_path).json
    assert any("a window of instability ends anywhere from" in each for each in printed["findings"])


@campaign
def test_where_no_motion_was_found_a_window_ends_anywhere() -> None:
    """Growth of up to 557 1/s lasts to the end of the range."""
    found = answer(LOST, 4.9)
    [(lower, upper)], [(_, error)] = found.windows, found.window_errors
    assert lower == pytest.approx(1.87867, abs=found.error)
    assert upper == 4.9
    assert 1.0 < error < upper - lower


@pytest.mark.parametrize(
    ("tables", "upper", "truth"),
    [
        pytest.param(IN_STEP, 4.9, [2.51647, 4.9], marks=campaign),
        (FLIGHTS, 1.6, [0.91385, 0.98693]),
        pytest.param(LONGER, 1.2, [0.0, 0.38588, 1.1208, 1.2], marks=campaign),
        pytest.param(BESIDE, 2.5, [1.28478, 2.5], marks=campaign),
    ],
)
def test_a_motion_is_followed_to_its_end_and_no_further(
    tables: dict[str, Any], upper: float, truth: list[float]
) -> None:
    found, listed = listed_ends(tables, "friction__coefficient", (0.0, upper))
    assert found.outcome in (Outcome.FOUND, Outcome.UNDECIDED)  # one is lost where flights become too long
    assert_found(truth, found, listed, (0.0, upper))
