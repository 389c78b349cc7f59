"""A run that begins at the end of another one goes on as if it had never ended, wheel and all."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from numpy.typing import NDArray

import brakecli
from brakecli.case.case import Case
from brakecli.case.read import parse_case, read_text
from brakecli.case.restart import initial_at, last_of
from brakecli.errors import BrakecliError, CaseError
from brakecli.results.read import open_result
from brakecli.studies.runs.branch import start_of
from brakecli.studies.runs.run import run
from brakecli.studies.sweeps.plan import parse_sweep
from tests.campaign import campaign
from tests.examples import ROUGH, SQUEAL
from tests.results.results import edited

pytestmark = pytest.mark.usefixtures("compiled")
MOTION = ("x", "y", "vx", "vy", "normal_force")
EXACT = {key: table for key, table in ROUGH.items() if key != "solver"} | {
    "contact": {"half_length": 0.05, "stiffness": 5e7},
    "solver": {"scheme": "event-driven", "duration": 0.02, "tolerance": 1e-8},
}
STICKS = {**SQUEAL, "solver": {"duration": 0.1, "tolerance": 1e-6}}


def motion(path: Path, case: dict[str, Any], *overrides: str) -> dict[str, NDArray[Any]]:
    """The history of a run, which is written to a file."""
    run(parse_case(tomli_w.dumps(case), "case.toml", overrides), path, force=True)
    with open_result(path) as result:
        return {name: result.read("history", name) for name in MOTION}


def end_of(path: Path) -> dict[str, float]:
    """The keys of `initial` at the end of a run."""
    end = last_of(path, Case.model_validate)
    return initial_at(end.case.wheel, end.case.initial.wheel_angle, end.time, end.state)


def apart(case: dict[str, Any], folder: Path, begin: str = "", *overrides: str) -> float:
    """By how much a run of two halves misses a whole one, over the largest deviation from the mean."""
    duration = case["solver"]["duration"]
    whole = motion(folder / "whole.h5", case, f"solver.duration={2.0 * duration}", *overrides)
    first = motion(folder / "first.h5", case, *overrides)
    start = begin.format(**{name: float(first[name][-1]) for name in MOTION}) if begin else ""
    start = start or f'initial.from="{folder / "first.h5"}"'
    second = motion(folder / "second.h5", case, start, *overrides)
    half = len(first["x"]) - 1
    return max(float(np.abs(second[n] - whole[n][half:]).max() / np.ptp(whole[n][half:])) for n in MOTION)


@pytest.mark.parametrize(
    ("case", "bound"),
    [
        (ROUGH, 1e-11),  # the state of a two-layer scheme is in the file: the error is that of Newton's iteration
        # the error of a run is 1e-8, and that of its start is carried along
        pytest.param(EXACT, 1e-6, marks=campaign),
        (STICKS, 1e-9),  # exact steps between events: rounding
    ],
    ids=["two-layer", "event-driven", "piecewise-exact"],
)
def test_two_runs_are_as_one(case: dict[str, Any], bound: float, tmp_path: Path) -> None:
    assert apart(case, tmp_path) < bound


def test_without_the_angle_of_the_wheel_the_waves_begin_anew(tmp_path: Path) -> None:
    assert apart(ROUGH, tmp_path, "initial={{x={x}, y={y}, vx={vx}, vy={vy}}}") > 0.05


def test_the_resolved_case_repeats_the_run_without_the_file(tmp_path: Path) -> None:
    motion(tmp_path / "a.h5", ROUGH)
    second = motion(tmp_path / "b.h5", ROUGH, f'initial.from="{tmp_path / "a.h5"}"')
    with open_result(tmp_path / "b.h5") as result:
        resolved = result.text("resolved_toml")
    (tmp_path / "a.h5").unlink()
    loaded = parse_case(resolved, "resolved")
    assert "from" not in resolved.split()
    assert loaded.case.initial.wheel_angle == pytest.approx(0.08, rel=1e-14)
    run(loaded, tmp_path / "c.h5", force=False)
    with open_result(tmp_path / "c.h5") as result:
        assert all((result.read("history", name) == second[name]).all() for name in MOTION)


@campaign
def test_a_path_is_seen_from_the_file_of_the_case_in_sweeps_and_python_as_well(tmp_path: Path) -> None:
    folder = tmp_path / "inner"
    folder.mkdir()
    motion(folder / "a.h5", ROUGH)
    case = folder / "next.toml"
    case.write_text(tomli_w.dumps({**ROUGH, "initial": {"from": "a.h5"}}))
    expected = end_of(folder / "a.h5")
    assert parse_case(*read_text(str(case))).case.initial.model_dump(exclude={"at", "from"}) == expected
    text = 'case = "next.toml"\naxis = [{ parameter = "friction.coefficient", values = [0.2, 0.3] }]'
    plan = parse_sweep(text, "sweep", folder).plan
    (folder / "a.h5").unlink()  # no point opens it
    assert plan.case(plan.settings(1)).initial.wheel_angle == expected["wheel_angle"]
    motion(folder / "a.h5", ROUGH)
    with pytest.warns(UserWarning, match="nodes per shortest|dies away"):
        tree = brakecli.run(str(case))
    assert float(tree["history"].x[0]) == expected["x"]


def test_an_override_by_a_result_replaces_a_start_that_is_given(tmp_path: Path) -> None:
    motion(tmp_path / "a.h5", ROUGH)
    given = {**ROUGH, "initial": {"at": "equilibrium", "x": 1e-6}}
    case = parse_case(tomli_w.dumps(given), "case.toml", [f'initial.from="{tmp_path / "a.h5"}"']).case
    assert case.initial.at == "rest"
    assert case.initial.x == end_of(tmp_path / "a.h5")["x"]


def test_a_motion_that_has_died_out_begins_at_rest(tmp_path: Path) -> None:
    """A case takes no number below 1e-100 but 0."""
    motion(tmp_path / "a.h5", ROUGH)
    with edited(tmp_path / "a.h5") as file:
        file["history/vx"][-1] = -1e-200
    assert end_of(tmp_path / "a.h5")["vx"] == 0.0


def altered(path: Path, name: str, value: str) -> None:
    with edited(path) as file:
        file.attrs[name] = value


def test_what_is_no_end_of_a_run_is_refused_with_one_sentence(tmp_path: Path) -> None:
    whole = tmp_path / "a.h5"

    def problem(*overrides: str, path: Path = whole) -> str:
        with pytest.raises(CaseError) as caught:
            parse_case(tomli_w.dumps(ROUGH), "case.toml", [f'initial.from="{path}"', *overrides])
        (found,) = caught.value.problems
        assert found.where.startswith("--set initial.")
        return f"{found.key}: {found.what}; {found.remedy}"

    assert "initial.from: cannot be read as a result: No such file or directory" in problem()
    motion(whole, ROUGH)
    assert "initial.vx: is given together with from (found 1.0); keep one of the two" in problem("initial.vx=1.0")
    part = tmp_path / "part.h5"
    part.write_bytes(whole.read_bytes()[:-100])
    assert "its digest does not fit, so that it is damaged or was altered" in problem(path=part)
    part.write_text("no result")
    assert "this is not an HDF5 file" in problem(path=part)

    def start() -> str:
        with pytest.raises(BrakecliError) as caught:
            start_of(whole, ["friction.coefficient"])
        return str(caught.value)

    altered(whole, "status", "failed")
    assert "has failed, and its last state is of no use" in problem()
    assert start() == f"{whole}: has failed, and its last state is of no use; name a run that is done"
    altered(whole, "status", "done")
    before = whole.read_bytes()
    with edited(whole) as file:
        for name in file["history"]:
            file["history"][name].resize(0, axis=0)
    assert "initial.from: has no history (found " in problem()
    assert start() == f"{whole}: has no history; run its case again"
    whole.write_bytes(before)
    assert start_of(whole, ["friction.coefficient"]).state.tolist() == [*end_of(whole).values()][:4]
    altered(whole, "resolved_toml", "shoe.mass = -1")
    assert "holds no case of this version" in problem()
    assert start() == f"{whole}: holds no case of this version; run its case again"
    altered(whole, "kind", "stability")
    assert "holds a result of kind 'stability'" in problem()
