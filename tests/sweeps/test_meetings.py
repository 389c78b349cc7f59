"""Windows of instability where multipliers meet, far narrower than the values of a scan lie apart.

The truths are those of another integrator, which follows the motion in small steps, at two steps of its own.
"""

from typing import Any

import numpy as np
import pytest

from brakecli.branches.answers import Answers
from brakecli.branches.explore import Explorer, crossing
from brakecli.branches.line import Line
from tests.campaign import campaign
from tests.examples import make
from tests.sweeps.test_windows import assert_found, listed_ends

DOUBLING: dict[str, Any] = {  # its period doubles over a 2150th of the range
    "shoe": {"mass": 1.961},
    "wheel": {"radius": 0.5, "angular_speed": 15.74},
    "link1": {"stiffness": 1422000.0, "damping": 12.82, "angle_deg": -7.031},
    "link2": {"stiffness": 2334000.0, "damping": 22.81, "angle_deg": 15.86},
    "load": {"force": 67.39},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.025, "stiffness": 23650000.0},
    "roughness": {
        "wheel": {"amplitudes": [1.451e-05, 1.363e-05], "wavelengths": [0.021, 0.036]},
        "shoe": {"amplitudes": [8.635e-06, 6.059e-06], "wavelengths": [0.021, 0.038]},
    },
    "solver": {"duration": 0.31, "scheme": "three-layer", "step": 5.1e-05, "theta": [0.3, 0.4, 0.3]},
}
REGAINED: dict[str, Any] = {  # a second sheet of its branch is stable where the first one has lost stability
    "shoe": {"mass": 46.56},
    "wheel": {"radius": 0.2, "angular_speed": 7.276},
    "link1": {"stiffness": 410500.0, "damping": 43.4, "angle_deg": 11.44},
    "link2": {"stiffness": 452300.0, "damping": 70.18, "angle_deg": 29.48},
    "load": {"force": 178.5},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.015, "stiffness": 22980000.0},
    "roughness": {"wheel": {"amplitudes": [0.0001145], "wavelengths": [0.074], "phases_deg": [235.6]}},
    "solver": {"duration": 2.6, "tolerance": 0.0001},
    "output": {"sample_interval": 0.0021},
}
BEYOND: dict[str, Any] = {  # a window of a 1050th above the critical value
    "shoe": {"mass": 15.92},
    "wheel": {"radius": 0.33, "angular_speed": 25.46},
    "link1": {"stiffness": 5096000.0, "damping": 28.86, "angle_deg": 0.0},
    "link2": {"stiffness": 6462000.0, "damping": 43.43, "angle_deg": 27.86},
    "load": {"force": 127.5},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.015, "stiffness": 193000000.0},
    "roughness": {
        "wheel": {"amplitudes": [3.397e-06, 3.945e-06], "wavelengths": [0.068, 0.056]},
        "shoe": {"amplitudes": [1.289e-06, 2.209e-06], "wavelengths": [0.025, 0.009]},
    },
    "solver": {"duration": 0.45, "scheme": "two-layer", "step": 7.5e-05, "theta": [0.5, 0.5]},
}

FOLD: dict[str, Any] = {  # where growth jumps rounding makes narrow windows
    "shoe": {"mass": 1.361},
    "wheel": {"radius": 0.33, "angular_speed": -7.467},
    "link1": {"stiffness": 495700.0, "damping": 8.161, "angle_deg": -0.0},
    "link2": {"stiffness": 793500.0, "damping": 14.12, "angle_deg": -32.0},
    "load": {"force": 133.1},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.04, "stiffness": 2880000.0},
    "roughness": {
        "wheel": {
            "amplitudes": [5.156e-05, 9.372e-05],
            "wavelengths": [0.025, 0.015],
            "phases_deg": [5.111, 354.4],
        }
    },
    "solver": {"duration": 0.45, "scheme": "three-layer", "step": 0.00012, "theta": [0.3, 0.4, 0.3]},
}


@pytest.mark.parametrize(
    ("tables", "upper", "truth"),
    [
        (DOUBLING, 2.3, [0.775843, 0.776855, 0.78291, 2.3]),
        pytest.param(FOLD, 4.0, [2.0793, 4.0], marks=campaign),
        pytest.param(BEYOND, 2.6, [0.54877, 0.64997, 1.30638, 1.30884, 2.6], marks=campaign),
    ],
)
@campaign
def test_windows_that_multipliers_open_where_they_meet_are_found(
    tables: dict[str, Any], upper: float, truth: list[float]
) -> None:
    found, listed = listed_ends(tables, "friction__coefficient", (0.0, upper))
    assert_found(truth, found, listed, (0.0, upper))
    assert found.error is not None
    assert found.error < 2e-3 * upper


@campaign
def test_a_value_is_stable_where_one_sheet_of_the_branch_is_and_all_ends_are_listed() -> None:
    """By another integrator the small motion is unstable from 1.71369 to 1.74247, and it ends at 1.76694. One of
    twice its amplitude is stable there. At 1.73 the largest multipliers are 0.99452 for it and 1.00356.
    """
    line = Line(make(REGAINED), ["friction.coefficient"], 0.0, 7.1)
    found = Answers(Explorer(line, lambda *_: None, lambda: False).explore(), None)
    assert found.critical == pytest.approx(1.76694, abs=2e-4)
    [base] = found.bases
    listed = {mark.kind: mark.value for mark in base.special[:4]}
    assert base.special[1].value == pytest.approx(1.71369, abs=2e-4)
    assert base.special[2].value == pytest.approx(1.74247, abs=2e-4)
    assert {"torus", "fold"} <= set(listed)
    largest = sorted(float(np.abs(each.multipliers).max()) for each in crossing(base, line.place(1.73)))
    assert largest[:2] == pytest.approx([0.99452, 1.00356], abs=1e-4)
