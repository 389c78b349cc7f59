"""Sweeps over a list of points, from a table or from Python."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import brakecli
from brakecli.errors import BrakecliError, CaseError, RefusedError
from brakecli.results.read import open_result
from brakecli.studies.sweeps import point_list
from brakecli.studies.sweeps.journal import identity
from brakecli.studies.sweeps.plan import LoadedSweep
from brakecli.studies.sweeps.point_list import read_listed
from brakecli.studies.sweeps.workers.task import compute_units
from tests.campaign import campaign
from tests.commands import brakecli as command
from tests.studies.sweeps.helpers import axis, inline, local, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")
PLAN = """\
friction.coefficient, link2.angle_deg, solver.scheme

0.2, 3, two-layer
0.5, 5.5, piecewise-exact
0.9, 1, two-layer
"""


def listed(folder: Path, plan: str = PLAN, *tables: str) -> LoadedSweep:
    """A sweep over the points of plan.csv."""
    (folder / "plan.csv").write_text(plan)
    return write_sweep(folder, 'points = "plan.csv"', *tables)


def test_points_of_a_table_are_those_of_the_cases_that_they_name(tmp_path: Path) -> None:
    loaded = listed(tmp_path)
    report = inline(loaded, tmp_path / "s.h5", compute_units)
    assert report.findings.dimensions == ("point",)
    alone = [
        axis("friction.coefficient", "values = [0.2]") + axis("link2.angle_deg", "values = [3.0]"),
        axis("friction.coefficient", "values = [0.5]")
        + axis("link2.angle_deg", "values = [5.5]")
        + axis("solver.scheme", 'values = ["piecewise-exact"]'),
        axis("friction.coefficient", "values = [0.9]") + axis("link2.angle_deg", "values = [1.0]"),
    ]
    with open_result(tmp_path / "s.h5", kind="sweep") as result:
        assert result.read("/", "friction_coefficient").tolist() == [0.2, 0.5, 0.9]
        assert result.read("/", "link2_angle_deg").tolist() == [3.0, 5.5, 1.0]
        assert [*result.read("/", "solver_scheme")] == ["two-layer", "piecewise-exact", "two-layer"]
        found = result.read("/", "amplitude"), result.read("/", "steps")
    for point, tables in enumerate(alone):
        if point != 1:
            tables += axis("solver.scheme", 'values = ["two-layer"]')
        inline(write_sweep(tmp_path, tables), tmp_path / "one.h5", compute_units, force=True)
        with open_result(tmp_path / "one.h5", kind="sweep") as result:
            assert result.read("/", "amplitude").item() == found[0][point]
            assert result.read("/", "steps").item() == found[1][point]


@campaign
def test_workers_get_the_same_points(tmp_path: Path) -> None:
    loaded = listed(tmp_path)
    inline(loaded, tmp_path / "s.h5", compute_units)
    expected = (tmp_path / "s.h5").read_bytes()
    local(loaded, tmp_path / "s.h5", compute_units, force=True)
    assert (tmp_path / "s.h5").read_bytes() == expected


def test_other_points_are_another_sweep(tmp_path: Path) -> None:
    one, other = (identity(listed(tmp_path, PLAN.replace("5.5", text)).plan) for text in ("5.5", "5.6"))
    assert {key for key in one if one[key] != other[key]} == {"checksum of the points"}


def test_a_table_may_be_searched_for_critical_values(tmp_path: Path) -> None:
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\nmethod = "eigenvalue"\n'
    angles = "link2.angle_deg\n20\n30\n"
    report = inline(listed(tmp_path, angles, search), tmp_path / "s.h5", compute_units)
    assert report.findings.critical is not None
    assert report.findings.failed == 0


@pytest.mark.parametrize(
    ("plan", "said"),
    [
        ("friction.coefficient\n0.2\n\n-0.4\n", "plan.csv:4: friction.coefficient: is out of range"),
        ("frction.coefficient\n0.2\n", "frction: is unknown"),
        ("a b\n0.2\n", "plan.csv:1: column 1 has no key path"),
        ("shoe.mass, shoe.mass\n1, 2\n", "plan.csv:1: shoe.mass has two columns"),
        ("shoe.mass, friction.coefficient\n1\n", "plan.csv:2: has 1 entry for 2 keys"),
        ("shoe.mass, friction.coefficient\n1,\n", "plan.csv:2: has an empty cell"),
        ("shoe.mass\nnan\n", "plan.csv:2: shoe.mass: "),
        ("shoe.mass\n", "plan.csv:1: lists no point"),
        ("", "plan.csv:1: lists no point"),
        ("shoe.mass\n\xff", "plan.csv:2: shoe.mass: "),
        ("load.force\n5_000\n", "plan.csv:2: load.force: "),
        ("load.force\n٠.5\n", "plan.csv:2: load.force: "),
        ("shoe.mass\n1.0\n" + "9" * 200_000 + "\n", "plan.csv:3: is no CSV"),
    ],
)
def test_a_wrong_table_is_refused_with_its_line(tmp_path: Path, plan: str, said: str) -> None:
    with pytest.raises(CaseError) as refused:
        listed(tmp_path, plan)
    assert said in str(refused.value)


def test_a_table_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for exists in (False, True):
        if exists:
            (tmp_path / "no.csv").mkdir()
        with pytest.raises(CaseError, match=r"points: cannot be read \(.*no\.csv: "):
            write_sweep(tmp_path, 'points = "no.csv"')
    (tmp_path / "no.csv").rmdir()
    (tmp_path / "no.csv").write_bytes(b"shoe.mass\n\xff\xfe\n")
    with pytest.raises(CaseError, match=r"s\.toml:2: points: .*it is no text in UTF-8"):
        write_sweep(tmp_path, 'points = "no.csv"')


def test_a_column_is_not_searched_for(tmp_path: Path) -> None:
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\n'
    with pytest.raises(CaseError, match=r"critical\.parameter: is set by a column of points"):
        listed(tmp_path, PLAN, search)


def test_points_and_axes_exclude_each_other(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"points: is given together with \[\[axis\]\]"):
        listed(tmp_path, PLAN, axis("shoe.mass", "values = [10.0]"))


def test_a_listed_sweep_from_the_shell(tmp_path: Path) -> None:
    listed(tmp_path)
    shown = command("sweep", "s.toml", cwd=tmp_path).out
    assert "friction.coefficient  link2.angle_deg  solver.scheme" in shown
    assert "piecewise-exact" in shown
    assert "s.png: written" in command("plot", "s.h5", cwd=tmp_path).out


def test_points_from_python(tmp_path: Path) -> None:
    loaded = listed(tmp_path)
    columns: dict[str, Any] = {
        "friction.coefficient": np.array([0.2, 0.5, 0.9]),
        "link2.angle_deg": [3, 5.5, 1],
        "solver.scheme": ["two-layer", "piecewise-exact", "two-layer"],
    }
    report = inline(loaded, tmp_path / "s.h5", compute_units)
    found = brakecli.sweep(tmp_path / "tiny.toml", points=columns, jobs=1)
    assert found.sizes == {"point": 3}
    assert found.amplitude.to_numpy().tolist() == (report.findings.variables or {})["amplitude"]


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([1.0], "points: are no columns"),
        ({}, "one point at least"),
        ({"shoe.mass": []}, "one point at least"),
        ({"shoe.mass": 3.0}, "a value of each key at each point"),
        ({"shoe.mass": [1.0], "friction.coefficient": [0.2, 0.3]}, "a value of each key at each point"),
        ({"a b": [1.0]}, "'a b' is no key path"),
        ({"shoe.mass": [1.0], 'shoe."mass"': [2.0]}, "a key has two columns"),
        ({"shoe.mass": [2.0, -1.0]}, "point 1: shoe.mass: is out of range"),
    ],
)
def test_wrong_points_from_python(tmp_path: Path, points: Any, said: str) -> None:
    listed(tmp_path)
    with pytest.raises(BrakecliError) as refused:
        brakecli.sweep(tmp_path / "tiny.toml", points=points, jobs=1)
    assert said in str(refused.value)


def noted(monkeypatch: pytest.MonkeyPatch, name: str) -> list[str]:
    """The texts that a function of the module is called with from now on."""
    texts = list[str]()
    before = getattr(point_list, name)

    def called(text: str) -> Any:
        texts.append(text)
        return before(text)

    monkeypatch.setattr(point_list, name, called)
    return texts


def test_a_table_of_too_many_keys_or_points_is_refused_while_it_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No more lines are read than it takes to know that, and no more keys are parsed than a line holds."""
    parsed = noted(monkeypatch, "key_path")
    values = noted(monkeypatch, "_value")
    monkeypatch.setattr(point_list, "MOST_VALUES", 1000)
    keys = [f"a.b{number}" for number in range(3000)]
    for plan, said in (
        (f"{','.join(keys)}\n{','.join('1' * 3000)}\n", r"plan\.csv:1: 3000 keys are too many, 200 are the most"),
        ("shoe.mass\n" + "1.0\n" * 9000, r"plan\.csv:1002: the points are too many: with 1 key 1000 are the most"),
        ("shoe.mass,load.force\n" + "1.0,2.0\n" * 9000, r"plan\.csv:502: .* with 2 keys 500 are the most"),
    ):
        with pytest.raises(RefusedError, match=said):
            listed(tmp_path, plan)
    assert len(parsed) == 3
    assert len(values) == 2000
    for points in ({key: [1.0] for key in keys}, {"shoe.mass": np.ones(1001)}):
        with pytest.raises(RefusedError, match=r"points: .* too many"):
            brakecli.sweep(tmp_path / "tiny.toml", points=points, jobs=1)


def test_each_key_of_a_table_is_parsed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parsed = noted(monkeypatch, "key_path")
    keys = [f"a.b{number}" for number in range(100)]
    (tmp_path / "plan.csv").write_text(f"{','.join(keys)}\n{','.join('1' * 100)}\n")
    read_listed(tmp_path / "plan.csv", "s.toml", 1)
    assert parsed == keys


def test_a_line_without_end_is_no_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_list, "LONGEST_LINE", 1000)
    with pytest.raises(CaseError, match=r"plan\.csv:2: has 501 entries for 1 keys"):
        listed(tmp_path, "shoe.mass\n" + "1," * 100_000)
    with pytest.raises(CaseError, match=r"points: cannot be read .*null byte"):
        write_sweep(tmp_path, 'points = "a\\u0000b.csv"')
