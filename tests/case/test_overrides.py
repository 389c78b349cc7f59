"""Overrides of a case by `--set`: what they change, and how a wrong one is reported."""

import pytest

from brakecli.case.read import parse_case
from tests.case.examples import CONSTANT, SMALL, change, messages, problems, where


def test_overrides_show_in_the_resolved_case_and_not_in_the_text() -> None:
    loaded = parse_case(SMALL, "small", ["shoe.mass=3", "shoe.mass=4", 'title="a=b"'])
    assert loaded.text == SMALL
    assert loaded.case.shoe.mass == 4.0  # the last one counts
    assert loaded.case.title == "a=b"
    assert parse_case(loaded.resolved, "resolved").case == loaded.case


def test_overrides_create_the_tables_they_need() -> None:
    overrides = ["roughness.wheel.amplitudes=[1e-6]", "roughness.wheel.wavenumbers=[300]", "initial={x=1e-6}"]
    case = parse_case(SMALL, "small", overrides).case
    assert case.roughness.wheel is not None
    assert case.roughness.wheel.wavenumbers == (300.0,)
    assert case.initial.x == 1e-6


@pytest.mark.parametrize(
    ("overrides", "there", "gone"),
    [
        (["load.times=[0, 1]", "load.forces=[0, 9]"], "forces", "force"),
        (["load.forces=[0, 9]", "load.times=[0, 1]"], "times", "force"),
    ],
)
def test_an_override_takes_the_place_of_its_alternative(overrides: list[str], there: str, gone: str) -> None:
    load = parse_case(SMALL, "small", overrides).case.load
    assert getattr(load, there) is not None
    assert getattr(load, gone) is None


def test_an_override_takes_the_place_of_a_schedule() -> None:
    text = SMALL.replace("angular_speed = -4", "times = [0, 1], angular_speeds = [4, 0]")
    wheel = parse_case(text, "small", ["wheel.angular_speed=7"]).case.wheel
    assert (wheel.angular_speed, wheel.times, wheel.angular_speeds) == (7.0, None, None)


def test_problems_of_overrides_name_the_override_and_come_after_those_of_the_file() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = -10.0"))
    assert messages(text, "link1.stiffness=-1", "solver.dration=2", "contact={half_length=1, stiffness=nan}") == [
        "case.toml:3: shoe.mass: is out of range (found -10.0); give a number above 0, in kg",
        "--set link1.stiffness=-1: link1.stiffness: is out of range (found -1);"
        " give a number of at least 0, in N/m",
        "--set solver.dration=2: solver.dration: is unknown (found 2); did you mean solver.duration?",
        "--set contact={half_length=1, stiffness=nan}: contact.stiffness: is not finite (found nan);"
        " give a number above 0, in N/m²",
    ]


def test_an_override_can_mend_a_wrong_value() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = -10.0"))
    assert parse_case(text, "case.toml", ["shoe.mass=1"]).case.shoe.mass == 1.0


def test_a_bare_word_is_refused_with_its_quoted_form() -> None:
    (line,) = messages(CONSTANT, "solver.scheme=three-layer")
    assert line == (
        "--set solver.scheme=three-layer: the value is not valid TOML (found three-layer);"
        " texts need quotes: --set solver.scheme='\"three-layer\"'"
    )


MALFORMED = [
    "",
    "shoe.mass",
    "=1",
    "shoe..mass=1",
    "shoe.mass=",
    "shoe.mass=1\nwheel.radius=2",
    "[shoe]\nmass=1",
    "[shoe]=1",
    "# mass=1",
    "roughness.wheel.amplitudes[0]=1",
    "shoe.mass=1,5",
    "shoe.mass=[1",
    "shoe.mass=" + "[" * 5000,
    "title.x=1",
    "title='\udcff'",
    "title='\0'",
    ".".join("a" * 40) + "=1",
    "title={" + ".".join("a" * 40) + "=1}",
]


@pytest.mark.parametrize("override", MALFORMED)
def test_a_malformed_override_is_refused(override: str) -> None:
    (problem,) = problems(CONSTANT, override)
    assert problem.where.startswith("--set ")


def test_all_malformed_overrides_are_reported() -> None:
    found = problems(CONSTANT, *MALFORMED)
    assert len(found) == len(MALFORMED)


def test_two_overrides_that_exclude_each_other_are_reported() -> None:
    for overrides in (
        ["load.force=1", "load.times=[0]", "load.forces=[1]"],
        ["load.times=[0]", "load.forces=[1]", "load.force=1"],
    ):
        assert where(CONSTANT, *overrides) == [("--set load.times=[0]", "load.times")]


def test_half_a_schedule_by_override_is_reported_as_missing_the_other_half() -> None:
    assert where(CONSTANT, "load.times=[0, 1]") == [("case.toml:15", "load.forces")]


def test_a_table_created_by_an_override_is_reported_there() -> None:
    text = CONSTANT[: CONSTANT.index("[roughness.shoe]")] + CONSTANT[CONSTANT.index("[initial]") :]
    override = "roughness.wheel.amplitudes=[1]"
    assert where(text, override) == [(f"--set {override}", "roughness.wheel.wavelengths")]
