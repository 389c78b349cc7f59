"""Error bars of critical values of random shoes, held against answers that share nothing with the package.

A bar holds the truth if the growth of disturbances changes its sign within it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from brakecli.analysis.branches.line import Line
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from tests.campaign import campaign
from tests.commands import brakecli
from tests.examples import make
from tests.studies.sweeps.independent import Tables, forced, smooth_is_unstable
from tests.studies.sweeps.shoes import drawn

pytestmark = pytest.mark.usefixtures("without_runs")

SEEDS = {  # shoes with a critical value in their range
    "opening": [2, 6, 9, 13, 17, 26],
    "undamped": [2, 5, 9, 17],
    "passing": [1, 8, 11, 21],
    "smooth": [2, 10, 20, 27],
    "soft": [6, 13, 29, 42],
}
FEW = [("smooth", 10), ("smooth", 27), ("soft", 42)]
INDEPENDENT = 3e-5  # of the range: what three times as many cells and steps of the other integrator move
WAY = 12  # values on the way to the bar, along which the forced motion is followed
WITHIN = (-0.5, -0.25, -0.1, -0.03, -0.01, 0.01, 0.03, 0.1, 0.25, 0.5, 1.0)  # of a bar that holds several windows


def answer(kind: str, seed: int) -> tuple[Search, Tables, str, float, float]:
    """What a search finds, without its runs for the least sustained value; and what was searched."""
    tables, key, lower, upper, tolerance = drawn(seed, kind)
    critical = Critical(parameter=key.replace("__", "."), lower=lower, upper=upper, tolerance=tolerance)
    found = search(critical, Line(make(tables), [critical.parameter], lower, upper))
    return found, tables, key, lower, upper


def at(tables: Tables, key: str, value: float) -> Tables:
    table, name = key.split("__")
    return {**tables, table: {**tables[table], name: value}}


def changes_within(tables: Tables, key: str, value: float, bar: float, start: float) -> bool:
    """Whether the growth of the motion that is followed from the start of a range changes sign beside a value."""
    state: Any = None
    for place in np.linspace(start, value - bar, WAY)[:-1].tolist():
        state = forced(at(tables, key, place), state)[1]
    first, state = forced(at(tables, key, value - bar), state)
    if forced(at(tables, key, value + bar), state)[0] * first < 0.0:
        return True
    for part in WITHIN:
        rate, state = forced(at(tables, key, value + part * bar), state)
        if rate * first < 0.0:
            return True
    return False


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        pytest.param(kind, seed, marks=() if (kind, seed) in FEW else campaign)
        for kind, seeds in SEEDS.items()
        for seed in seeds
    ],
)
def test_the_truth_lies_within_the_error_bar(kind: str, seed: int) -> None:
    found, tables, key, lower, upper = answer(kind, seed)
    assert found.value is not None
    assert found.error is not None
    assert found.error < upper - lower
    if kind in ("smooth", "soft"):
        below, above = (
            smooth_is_unstable(at(tables, key, found.value + by)) for by in (-found.error, found.error)
        )
        assert below is not above
        return
    lost = found.outcome is Outcome.FOUND
    error = found.error + INDEPENDENT * (upper - lower)
    bar, start = (error, lower) if lost else (-error, upper)
    assert changes_within(tables, key, found.value, bar, start)


BETWEEN: Tables = {  # stable for half a per cent of the range
    "shoe": {"mass": 9.792},
    "wheel": {"radius": 0.2, "angular_speed": 25.44},
    "link1": {"stiffness": 2556000.0, "damping": 9.511, "angle_deg": 0.0},
    "link2": {"stiffness": 2290000.0, "damping": 12.11, "angle_deg": 29.84},
    "load": {"force": 386.2},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.055, "stiffness": 22780000.0},
    "roughness": {
        "wheel": {"amplitudes": [3.585e-05], "wavelengths": [0.028], "phases_deg": [80.72]},
        "shoe": {"amplitudes": [1.411e-05, 1.441e-05], "wavelengths": [0.026, 0.036]},
    },
    "solver": {"duration": 0.59, "scheme": "two-layer", "step": 0.00016},
}


@campaign
def test_the_truth_lies_within_the_error_bars_of_all_windows() -> None:
    upper = 5.8
    key = "friction__coefficient"
    critical = Critical(parameter="friction.coefficient", lower=0.0, upper=upper, tolerance=1e-4)
    found = search(critical, Line(make(BETWEEN), [critical.parameter], critical.lower, critical.upper))
    ends = np.ravel(found.windows)
    errors = np.ravel(found.window_errors)
    assert (found.value, found.error) == (ends[0], errors[0])
    assert len(found.windows) == 2
    assert (ends[-1], errors[-1]) == (upper, 0.0)
    for end, error in zip(ends[:-1], errors, strict=False):
        assert error < 0.045 * end
        assert changes_within(BETWEEN, key, end, error, end - 1.5 * error)


@campaign
def test_a_loss_of_stability_that_only_the_scheme_has_does_not_count() -> None:
    """Its weights damp: without them sliding is unstable from below the range on, as the eigenvalues say."""
    rough, tables, key, lower, upper = answer("passing", 40)
    assert smooth_is_unstable(at(tables, key, lower))
    critical = Critical(parameter=key.replace("__", "."), lower=lower, upper=upper)
    smooth = {name: table for name, table in tables.items() if name != "roughness"}
    for found in (rough, search(critical, Line(make(smooth), [critical.parameter], lower, upper))):
        assert found.outcome is Outcome.REGAINED
        assert found.value is not None
        assert found.error is not None
        ends = [found.value - found.error, found.value + found.error]
        assert [smooth_is_unstable(at(tables, key, end)) for end in ends] == [True, False]


@campaign
def test_an_error_bar_of_a_third_of_the_range_is_no_answer_and_says_what_to_do(tmp_path: Path) -> None:
    """Two waves of a golden ratio have no common period; Lyapunov's exponent leaves 0 to 1.17 open."""
    tables: Tables = {
        "shoe": {"mass": 14.4},
        "wheel": {"radius": 0.5, "angular_speed": 9.56},
        "link1": {"stiffness": 1240000.0, "damping": 20.1},
        "link2": {"stiffness": 2320000.0, "damping": 10.7, "angle_deg": 13.4},
        "load": {"force": 39.4},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.05, "stiffness": 14900000.0},
        "roughness": {
            "shoe": {"amplitudes": [7.31e-6], "wavelengths": [0.032]},
            "wheel": {"amplitudes": [8.16e-6, 5.44e-6], "wavelengths": [0.077, 0.0475886171337419]},
        },
        "solver": {"duration": 0.87, "step": 7.2e-5},
    }
    critical = {"parameter": "friction.coefficient", "lower": 0.0, "upper": 1.5}
    (tmp_path / "c.toml").write_text(tomli_w.dumps(tables))
    (tmp_path / "s.toml").write_text(tomli_w.dumps({"case": "c.toml", "critical": critical}))
    printed = brakecli("sweep", "s.toml", "-j", "1", "--json", cwd=tmp_path).json
    assert printed["critical_status"] == ["undecided"]
    assert any("no critical value is decided; try" in each for each in printed["findings"])
