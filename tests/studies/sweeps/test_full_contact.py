"""Critical values on rough wheels in full contact: the motion there is linear, and theory gives its growth."""

from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.line import Line
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from tests.campaign import campaign
from tests.examples import make
from tests.studies.sweeps.independent import smooth_is_unstable
from tests.studies.sweeps.shoes import flat_critical

pytestmark = pytest.mark.usefixtures("without_runs")

BARE: dict[str, Any] = {  # no dashpots; near a friction of 0.3 the wave meets a natural frequency
    "shoe": {"mass": 75.84},
    "wheel": {"radius": 0.5, "angular_speed": -9.686},
    "link1": {"stiffness": 5510000.0, "damping": 0.0, "angle_deg": -13.95},
    "link2": {"stiffness": 11850000.0, "damping": 0.0, "angle_deg": -14.6},
    "load": {"force": 499.3},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.015, "stiffness": 135600000.0},
    "roughness": {"wheel": {"amplitudes": [3.096e-06], "wavelengths": [0.085], "phases_deg": [359.4]}},
    "solver": {"duration": 0.96, "scheme": "three-layer", "step": 0.00027, "theta": [0.3, 0.45, 0.25]},
}
FAST: dict[str, Any] = {  # vibration grows by up to 469 1/s
    "shoe": {"mass": 8.084},
    "wheel": {"radius": 0.5, "angular_speed": 5.279},
    "link1": {"stiffness": 17320000.0, "damping": 67.79, "angle_deg": 0.0},
    "link2": {"stiffness": 46910000.0, "damping": 39.62, "angle_deg": 24.04},
    "load": {"force": 2172.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.01, "stiffness": 938000000.0},
    "roughness": {"wheel": {"amplitudes": [7.67e-06], "wavelengths": [0.073], "phases_deg": [356.6]}},
    "solver": {"duration": 0.2, "scheme": "two-layer", "step": 2.6e-05, "theta": [0.55, 0.55]},
}


def found(tables: dict[str, Any], upper: float, tolerance: float) -> Search:
    """The critical friction, without runs for the least sustained value."""
    critical = Critical(parameter="friction.coefficient", lower=0.0, upper=upper, tolerance=tolerance)
    return search(critical, Line(make(tables), [critical.parameter], 0.0, upper))


def test_without_dashpots_a_large_motion_beside_full_contact_hides_no_flutter() -> None:
    answer = found(BARE, 0.94, 1e-4)
    assert answer.value is not None
    assert abs(answer.value - flat_critical(BARE)) <= (answer.error or 0.0) < 2e-4
    assert answer.windows == ((answer.value, 0.94),)


@campaign
def test_growth_so_fast_that_a_run_leaves_full_contact_shows_no_gap_of_stability() -> None:
    answer = found(FAST, 1.9, 1e-3)
    assert answer.value is not None
    assert answer.error is not None
    assert answer.windows == ((answer.value, 1.9),)
    assert answer.error < 1e-3  # though the weights of the scheme damp
    places = (answer.value - answer.error, answer.value + answer.error)
    assert [smooth_is_unstable({**FAST, "friction": {"coefficient": at}}) for at in places] == [False, True]


@campaign
def test_growth_by_theory_is_known_where_the_wheel_has_many_waves() -> None:
    """Of thirty waves theory takes up four: near zero, where others might count, a long motion decides."""
    wheel = {"amplitudes": [7.67e-6 / 30] * 30, "wavelengths": np.linspace(0.03, 0.09, 30).round(5).tolist()}
    answer = found({**FAST, "roughness": {"wheel": wheel}, "solver": {"duration": 0.2, "step": 2.6e-5}}, 1.9, 1e-3)
    one = found(FAST, 1.9, 1e-3)
    assert answer.outcome is Outcome.FOUND
    assert answer.value == pytest.approx(one.value, abs=answer.error)
    assert (answer.error or 1.0) < 1e-3
