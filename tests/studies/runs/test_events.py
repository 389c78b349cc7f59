"""The events in a result file: where closed forms have them, as many as are kept, and only if they are located."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UsageError
from brakecli.results.contents import contents, difference
from brakecli.results.export import export
from brakecli.results.read import open_result
from brakecli.solver.records import MOST_EVENTS
from brakecli.studies.runs.limits import adjustments
from brakecli.studies.runs.run import RunReport, run
from tests.campaign import campaign
from tests.examples import COULOMB, SQUEAL

pytestmark = pytest.mark.usefixtures("compiled")
EVENTS = {"output": {"sample_interval": 1e-4, "events": True}}
STICKS = {**SQUEAL, **EVENTS, "solver": {"tolerance": 1e-6, "duration": 0.2}}
RUBS = {  # on a wheel at rest
    **COULOMB,
    "solver": {"tolerance": 1e-9, "duration": 30.0},
    "output": {"sample_interval": 0.1, "events": True},
}


def written(path: Path, case: dict[str, Any], *overrides: str) -> RunReport:
    return run(parse_case(tomli_w.dumps(case), "case.toml", overrides), path, force=True)


def events(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, group="events", engine="h5netcdf") as found:
        return found.load()


def interpolated(path: Path, name: str, times: NDArray[Any]) -> NDArray[Any]:
    """A variable of the history at other times, along straight lines."""
    with open_result(path) as result:
        found: NDArray[Any] = np.interp(times, result.read("history", "time"), result.read("history", name))
        return found


@pytest.mark.parametrize("scheme", ["event-driven", "piecewise-exact"])
def test_a_shoe_that_rubs_turns_and_stops_where_the_closed_form_says_so(scheme: str, tmp_path: Path) -> None:
    """ẍ + x = -sign ẋ: extremes come closer by 2 each time, and between -1 and 1 friction holds."""
    written(tmp_path / "a.h5", RUBS, f'solver.scheme="{scheme}"')
    found = events(tmp_path / "a.h5")
    n = np.arange(8)
    assert found.kind.values.tolist() == ["turn"] * 7 + ["stick"]
    np.testing.assert_allclose(found.time, math.atan2(6.0, 13.0) + math.pi * n, atol=1e-6)
    np.testing.assert_allclose(found.x, (math.hypot(13.0, 6.0) - 1.0 - 2.0 * n) * (-1.0) ** n, atol=1e-6)
    np.testing.assert_allclose([found.y, found.vx, found.vy], np.outer([-1.0, 0.0, 0.0], np.ones(8)), atol=1e-6)
    assert found.attrs["earlier"] == 0


def test_events_lie_on_the_motion_and_sticks_alternate_with_slips(tmp_path: Path) -> None:
    written(tmp_path / "a.h5", STICKS)
    found = events(tmp_path / "a.h5")
    times = found.time.values
    assert 30 < len(times) < MOST_EVENTS
    assert found.kind.values.tolist() == (["stick", "slip"] * len(times))[: len(times)]
    assert (found.vx == 0.05).all()  # as fast as the wheel, to the last bit
    for name in ("x", "y", "vy"):
        gap = np.abs(found[name].values - interpolated(tmp_path / "a.h5", name, times)).max()
        assert gap < 0.02 * float(np.ptp(found[name].values))
    assert {name: each.attrs["units"] for name, each in found.data_vars.items()} == {
        "time": "s", "kind": "", "x": "m", "y": "m", "vx": "m/s", "vy": "m/s",
    }  # fmt: skip


def test_flight_begins_with_a_lift_off_and_ends_with_a_touch(tmp_path: Path) -> None:
    written(tmp_path / "a.h5", STICKS, "initial.y=1e-3", "solver.duration=0.02")
    found = events(tmp_path / "a.h5")
    flights = found.where(found.kind.isin(["lift-off", "touch"]), drop=True)
    assert flights.kind.values.tolist()[:3] == ["touch", "lift-off", "touch"]
    assert np.abs(flights.y).max() < 1e-12  # the pad is flat
    assert ((flights.vy > 0.0) == (flights.kind == "lift-off")).all()


def test_schemes_that_do_not_locate_events_are_refused() -> None:
    case = tomli_w.dumps({**SQUEAL, **EVENTS})
    with pytest.raises(CaseError) as caught:
        parse_case(case, "case.toml")
    (problem,) = caught.value.problems
    assert problem.key == "output.events"
    assert "two-layer does not" in problem.what
    parse_case(case, "case.toml", ['solver.scheme="event-driven"', "solver.theta=[]"])


def test_a_run_that_was_not_asked_has_no_events(tmp_path: Path) -> None:
    written(tmp_path / "a.h5", STICKS, "output.events=false", "solver.duration=0.01")
    with open_result(tmp_path / "a.h5") as result:
        assert "events" not in result.groups
        with pytest.raises(UsageError, match=r"it has one with output\.events = true"):
            export(result, tmp_path / "a.csv", "events", (), force=False)


def test_info_diff_and_export_know_the_group(tmp_path: Path) -> None:
    paths = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for path, friction in zip(paths, (0.6, 0.7), strict=True):
        written(path, STICKS, f"friction.coefficient={friction}", "solver.duration=0.05")
    found = events(paths[0])
    with open_result(paths[0]) as a, open_result(paths[1]) as b:
        held = {each["name"]: each["shape"] for each in contents(a)["variables"] if each["group"] == "events"}
        assert held == dict.fromkeys(("event", "time", "kind", "x", "y", "vx", "vy"), found.time.shape)
        assert {each["name"] for each in difference(a, b).variables if each["group"] == "events"} >= {"time", "x"}
        export(a, tmp_path / "a.csv", "events", (), force=False)
    header, *rows = csv.reader((tmp_path / "a.csv").read_text().splitlines())
    assert header == ["event", "time (s)", "kind", "x (m)", "y (m)", "vx (m/s)", "vy (m/s)"]
    assert [float(row[1]) for row in rows] == found.time.values.tolist()
    assert [row[2] for row in rows] == found.kind.values.tolist()


def test_a_start_beside_steady_sliding_is_said() -> None:
    near = {**SQUEAL, "initial": {"at": "equilibrium", "x": 1e-6}}
    (said,) = adjustments(system_of(parse_case(tomli_w.dumps(near), "case.toml").case))
    assert said == "initial: x = 1e-06 m and y = 0 m are added to the position of steady sliding"


@campaign
def test_only_the_last_events_are_kept_and_that_is_said(tmp_path: Path) -> None:
    """Two turning points of x for each two turns of the sliding, beside a wheel that hardly moves it."""
    case = {**RUBS, "friction": {"coefficient": 1e-6}, "wheel": {"radius": 1.0, "angular_speed": 1e-3}}
    report = written(
        tmp_path / "a.h5", case, "solver.duration=7e4", "output.sample_interval=10.0", "initial.x=1e3"
    )
    found = events(tmp_path / "a.h5")
    earlier = found.attrs["earlier"]
    assert len(found.time) == MOST_EVENTS // 2
    assert len(found.time) + earlier == pytest.approx(7e4 / math.pi, abs=2)
    assert (
        f"output.events: the last {len(found.time)} events are in the file, {earlier} earlier"
        in report.warnings[-1]
    )
