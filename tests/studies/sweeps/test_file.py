"""Sweep files: what they may say, and how every problem of one is reported."""

import tomllib
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from brakecli.case.tables import json_schema
from brakecli.errors import CaseError
from brakecli.studies.sweeps.plan import LoadedSweep, Plan, kind_of, parse_sweep
from brakecli.studies.sweeps.tables import Sweep
from tests.commands import TINY

GRID = """\
case = "tiny.toml"
[[axis]]
parameter = "link2.angle_deg"
start = 1
stop = 10
num = 10
[[axis]]
parameter = ["link1.damping", "link2.damping"]
values = [0.0, 300.0, 1e3]
"""
CRITICAL = """\
[critical]
parameter = "friction.coefficient"
lower = 0.0
upper = 2.0
"""


def loaded(folder: Path, text: str, *overrides: str, case: str = TINY) -> LoadedSweep:
    (folder / "tiny.toml").write_text(case)
    return parse_sweep(text, "sweep.toml", folder, overrides)


def problems(folder: Path, text: str, *overrides: str) -> list[str]:
    with pytest.raises(CaseError) as error:
        loaded(folder, text, *overrides)
    return [str(problem) for problem in error.value.problems]


def test_the_last_axis_runs_fastest_and_keys_that_move_together_take_one_value(tmp_path: Path) -> None:
    plan = loaded(tmp_path, GRID).plan
    assert plan.shape == (10, 3)
    found = [plan.case(plan.settings(point)) for point in range(plan.points)]
    angles = [case.link2.angle_deg for case in found]
    assert angles == [float(angle) for angle in range(1, 11) for _ in range(3)]
    assert [case.link1.damping for case in found[:3]] == [0.0, 300.0, 1e3]
    assert all(case.link1.damping == case.link2.damping for case in found)


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        ("start = 0.1\nstop = 0.7\nnum = 7", np.linspace(0.1, 0.7, 7)),
        ("start = 5\nstop = 1\nnum = 5", [5.0, 4.0, 3.0, 2.0, 1.0]),
        ("start = 1e-2\nstop = 1e1\nnum = 4\nspacing = 'log'", [1e-2, 1e-1, 1.0, 1e1]),
        ("start = 3.3\nstop = 7.7\nnum = 1", [3.3]),
        ("values = [3, 1.5]", [3, 1.5]),
    ],
)
def test_values_lie_as_the_axis_says_and_its_ends_are_exact(
    tmp_path: Path, axis: str, expected: list[float]
) -> None:
    plan = loaded(tmp_path, f'case = "tiny.toml"\n[[axis]]\nparameter = "link2.angle_deg"\n{axis}\n').plan
    values = [plan.sweep.axis[0].value(place) for place in range(plan.points)]
    np.testing.assert_allclose(values, expected, rtol=1e-15)  # a few roundings of quotients, powers and sums
    assert values[-1] == expected[-1]
    if len(values) > 1:
        assert values[0] == expected[0]


def test_a_range_gives_whole_numbers_to_a_key_that_wants_them(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "contact.nodes"\nstart = 64\nstop = 256\nnum = 4\n'
    plan = loaded(tmp_path, text).plan
    assert [plan.case(plan.settings(point)).contact.nodes for point in range(4)] == [64, 128, 192, 256]


def test_texts_and_lists_go_along_an_axis_as_well(tmp_path: Path) -> None:
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "solver.scheme"\nvalues = ["two-layer", "three-layer"]\n'
    plan = loaded(tmp_path, text).plan
    assert [plan.case(plan.settings(point)).solver.theta for point in (0, 1)] == [(0.5, 0.5), (0.25, 0.5, 0.25)]
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "solver.theta"\nvalues = [[0.5, 0.5], [1.0, 1.0]]\n'
    plan = loaded(tmp_path, text).plan
    assert plan.case(plan.settings(1)).solver.theta == (1.0, 1.0)


def test_a_default_that_follows_another_key_follows_it_at_every_point(tmp_path: Path) -> None:
    case = TINY.replace("output.sample_interval = 1e-4\n", "")
    text = 'case = "tiny.toml"\n[[axis]]\nparameter = "solver.step"\nvalues = [1e-5, 1e-4]\n'
    plan = loaded(tmp_path, text, case=case).plan
    assert [plan.case(plan.settings(point)).output.sample_interval for point in (0, 1)] == [1e-5, 1e-4]


def test_a_key_along_an_axis_takes_the_place_of_one_that_excludes_it(tmp_path: Path) -> None:
    text = (
        'case = "tiny.toml"\n[[axis]]\nparameter = "load.times"\nvalues = [[0.0, 1.0]]\n'
        '[[axis]]\nparameter = "load.forces"\nvalues = [[1e3, 2e3]]\n'
    )
    load = (plan := loaded(tmp_path, text).plan).case(plan.settings(0)).load
    assert (load.force, load.forces) == (None, (1e3, 2e3))


def test_overrides_set_the_base_case_and_the_search(tmp_path: Path) -> None:
    found = loaded(tmp_path, GRID + CRITICAL, "shoe.mass=7.0", "critical.tolerance=0.01", "critical.upper=1.5")
    assert found.plan.case({}).shoe.mass == 7.0
    assert found.sweep.critical is not None
    assert (found.sweep.critical.tolerance, found.sweep.critical.upper) == (0.01, 1.5)


def test_the_texts_of_a_plan_stand_for_it(tmp_path: Path) -> None:
    plan = loaded(tmp_path, GRID + CRITICAL).plan
    again = Plan(plan.sweep_text, plan.case_text)
    assert again.sweep == plan.sweep
    assert again.case(again.settings(17)) == plan.case(plan.settings(17))


def test_every_problem_of_a_sweep_is_reported_at_once_with_its_line(tmp_path: Path) -> None:
    text = (
        'case = "tiny.toml"\n[[axis]]\nparamter = "link2.angle_deg"\nstart = 1\nstop = 2\n[critical]\nlower = 1\n'
    )
    reported = "\n".join(problems(tmp_path, text))
    for words in (
        'sweep.toml:3: axis[0].paramter: is unknown (found "link2.angle_deg"); did you mean axis.parameter?',
        "axis[0].num: is missing",
        "critical.parameter: is missing",
        "critical.upper: is missing",
    ):
        assert words in reported


AXIS = '[[axis]]\nparameter = "link2.angle_deg"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GRID.replace("stop = 10", "stop = 100"), "sweep.toml:3: link2.angle_deg: is out of range (found 100.0)"),
        (GRID.replace("angle_deg", "angel_deg"), "sweep.toml:3: link2.angel_deg: is unknown (found 1.0)"),
        (GRID.replace("1e3]", "-1e3]"), "sweep.toml:8: link1.damping: is out of range (found -1000.0)"),
        (GRID.replace('"link2.angle_deg"', '"title.x"'), "sweep.toml:3: title.x: title is not a table"),
        (CRITICAL.replace("friction.", "friktion."), "friktion: is unknown"),
        ('case = ""', 'sweep.toml:1: case: is empty (found ""); give'),
        ("", "axis: is missing; give at least one [[axis]], points, or [critical]"),
        (AXIS + "values = []", "axis[0].values: is too short"),
        (AXIS + "values = [1.0]\nstart = 1.0", "is given together with"),
        (AXIS + "start = 1.0\nstop = 2.0\nnum = 0", "axis[0].num: is out of range (found 0)"),
        (AXIS + "start = 0.0\nstop = 2.0\nnum = 3\nspacing = 'log'", "axis[0].start: is not above 0"),
        (AXIS + "values = [1.0]\nspacing = 'log'", "axis[0].spacing: is only for start and stop"),
        (AXIS + "start = nan\nstop = 2.0\nnum = 3", "axis[0].start"),
        ('[[axis]]\nparameter = []\nvalues = [1.0]', "axis[0].parameter: is too short"),
        ('[[axis]]\nparameter = "a b"\nvalues = [1.0]', "axis[0].parameter: is not a key path"),
        ('[[axis]]\nparameter = "' + "a." * 40 + 'a"\nvalues = [1.0]', "axis[0].parameter: is not a key path"),
        (AXIS + "values = [1.0]\n" + AXIS + "values = [2.0]", "axis[1].parameter: is set twice"),
        (AXIS + "values = [1.0]\n" + CRITICAL.replace("friction.coefficient", "link2.angle_deg"),
         "is set by an axis"),
        (AXIS + "values = [1.0]\ndirection = 'up'\n" + CRITICAL, "is given together with [critical]"),
        (AXIS + "values = ['a']\ndirection = 'up'\n", "axis[0].direction: needs numbers to follow"),
        (CRITICAL + "tolerance = 0.0", "critical.tolerance: is out of range"),
        (CRITICAL + "tolerance = 1e-30", "critical.tolerance: is below the rounding"),
        (CRITICAL.replace("2.0", "-2.0"), "critical.upper: is not above lower"),
        (CRITICAL + "method = 'guess'", 'give one of "simulation", "eigenvalue"'),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_line_and_a_remedy(tmp_path: Path, text: str, words: str) -> None:
    head = "" if text.startswith("case") else 'case = "tiny.toml"\n'
    assert words in "\n".join(problems(tmp_path, head + text))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[axis]\nparameter = 'shoe.mass'\nvalues = [1.0]",
         "2: axis: is not a list (found a table); give each entry under a header of its own, [[axis]]"),
        (AXIS + "start = 1.0\nstop = 2.0\nnmu = 3",
         "6: axis[0].nmu: is unknown (found 3); did you mean axis.num?"),
        (AXIS + "valeus = [1.0]", "4: axis[0].valeus: is unknown (found [1.0]); did you mean axis.values?"),
        (AXIS + "values = [1.0]\nx = 1", "5: axis[0].x: is unknown (found 1); the keys of [[axis]] are "
         "parameter, start, stop, num, spacing, values, direction"),
        ("[[axes]]\nparameter = 'shoe.mass'\nvalues = [1.0]",
         "2: axes: is unknown (found [a table]); did you mean [[axis]]?"),
        (CRITICAL.replace("critical", "critcal"),
         "2: critcal: is unknown (found a table); did you mean [critical]?"),
        (AXIS + "values = [1.0]\n[axis]\nparameter = 'shoe.mass'",
         "5: axis: has both headers [axis] and [[axis]], first in line 2; keep one of the two"),
        ("case = ''\n" + AXIS + "values = [1.0]",
         '1: case: is empty (found ""); give a text of at least one character'),
    ],
)  # fmt: skip
def test_one_mistake_brings_one_message(tmp_path: Path, text: str, words: str) -> None:
    head = "" if text.startswith("case") else 'case = "tiny.toml"\n'
    assert problems(tmp_path, head + text) == [f"sweep.toml:{words}"]


def test_a_base_case_that_is_missing_is_named_at_its_key_and_a_wrong_one_by_its_own_file(tmp_path: Path) -> None:
    assert "case: " in problems(tmp_path, GRID.replace("tiny", "other"))[0]
    assert "other.toml cannot be read" in problems(tmp_path, GRID.replace("tiny", "other"))[0]
    (tmp_path / "wrong.toml").write_text(TINY.replace("mass = 10.0", "mass = -1"))
    assert "wrong.toml:2: shoe.mass: is out of range" in problems(tmp_path, GRID.replace("tiny", "wrong"))[0]


def test_values_that_fit_only_together_are_no_problem(tmp_path: Path) -> None:
    text = (
        'case = "tiny.toml"\n[[axis]]\nparameter = "solver.step"\nvalues = [1e-3]\n'
        '[[axis]]\nparameter = "output.sample_interval"\nvalues = [1e-3]\n'
    )
    assert loaded(tmp_path, text).plan.points == 1


@pytest.mark.parametrize(
    ("text", "expected"), [(GRID, "sweep"), (CRITICAL, "sweep"), (TINY, "case"), ("", ""), ("=", "")]
)
def test_a_sweep_is_told_from_a_case_by_its_keys(text: str, expected: str) -> None:
    assert kind_of(text) == expected


def test_the_schema_of_sweep_files_accepts_what_is_accepted_here() -> None:
    validator = import_module("jsonschema").Draft202012Validator(json_schema(Sweep))
    for text in (GRID, CRITICAL):
        validator.validate(tomllib.loads('case = "tiny.toml"\n' + text.replace('case = "tiny.toml"\n', "")))
    assert not validator.is_valid(tomllib.loads(GRID.replace("paramter", "parameter").replace("num", "number")))


@pytest.mark.parametrize("value", ["nan", "[inf]", "{ a = -inf }"])
def test_values_of_an_axis_that_are_not_finite_are_told_by_their_key(value: str, tmp_path: Path) -> None:
    text = f'case = "tiny.toml"\n[[axis]]\nparameter = "shoe.mass"\nvalues = [{value}]\n'
    (told,) = problems(tmp_path, text)
    assert "sweep.toml:3: shoe.mass: is not " in told
