"""Every field takes the values that the contract allows, and reports any other with its line, key and remedy."""

import pytest

from brakecli.case.case import Case
from brakecli.case.read import parse_case
from brakecli.case.tables import tables_within
from brakecli.solver.contact import EVALUATORS
from tests.case.examples import CONSTANT, EVENT_DRIVEN, VARYING, messages, problems, put, where

VALUES = ("nan", "inf", "-1", "0", "1e999", "1e-320", '"text"', "true", "2020-01-01", "[1, 2]")
"""What is put into every field, as TOML."""

NUMBER = {"-1", "0"}
NON_NEGATIVE = {"0"}
POSITIVE = set[str]()
LIST = {"[1, 2]"}
ROUGHNESS = {"amplitudes": NUMBER, "wavelengths": POSITIVE, "wavenumbers": POSITIVE, "phases_deg": NUMBER}
SURFACES = [f"roughness.{side}" for side in ("shoe", "wheel")]
ALLOWED_IN_LIST = {
    "wheel.times": POSITIVE,  # times increase, and the first is 0
    "wheel.angular_speeds": NUMBER,
    "load.times": POSITIVE,
    "load.forces": NUMBER,
    **{f"{surface}.{key}": allowed for surface in SURFACES for key, allowed in ROUGHNESS.items()},
    "roughness.wheel.orders": POSITIVE,
    "solver.theta": NON_NEGATIVE,
}
"""Which of `VALUES` the contract allows in each list."""
GROUPS: list[tuple[set[str], str]] = [
    ({'"text"'}, "title roughness.shoe.note roughness.wheel.note"),
    (
        NON_NEGATIVE,
        " ".join(f"{surface}.spectrum.{key}" for surface in SURFACES for key in ("rms", "hurst", "seed")),
    ),
    (
        POSITIVE,
        " ".join(f"{surface}.spectrum.{key}" for surface in SURFACES for key in ("shortest", "longest", "terms")),
    ),
    ({"true"}, "solver.allow_unconverged output.events"),
    (POSITIVE, "shoe.mass wheel.radius contact.half_length contact.stiffness"),
    (POSITIVE, "solver.step solver.duration output.sample_interval"),
    (NON_NEGATIVE, "link1.stiffness link1.damping link2.stiffness link2.damping friction.coefficient"),
    (NUMBER, "wheel.angular_speed load.force link1.angle_deg link2.angle_deg"),
    (NUMBER, "initial.x initial.y initial.vx initial.vy initial.wheel_angle"),
    (LIST, " ".join(key for key in ALLOWED_IN_LIST if key != "solver.theta")),
    (set(), "contact.evaluator contact.nodes initial.at"),
    (set(), "solver.scheme solver.theta solver.iteration solver.start solver.tolerance"),
]
ALLOWED = {key: allowed for allowed, keys in GROUPS for key in keys.split()}
"""Which of `VALUES` the contract allows in each field."""


def test_the_cases_of_this_file_are_valid() -> None:
    parse_case(CONSTANT, "constant")
    parse_case(VARYING, "varying")
    parse_case(EVENT_DRIVEN, "event-driven")


def test_the_table_of_allowed_values_has_every_field() -> None:
    inner = tables_within(Case)
    fields = {
        ".".join(map(str, (*path, key)))
        for path, table in inner.items()
        for key in table.model_fields
        if (*path, key) not in inner
    }
    of_files = {f"{surface}.{key}" for surface in SURFACES for key in ("profile", "profile_error")}
    of_files |= {"initial.from"}  # test_roughness.py and tests/studies/runs/test_restart.py read files
    settled = {"solver.budget"}  # not beside a number: test_rules.py
    assert fields - of_files - settled == set(ALLOWED)


@pytest.mark.parametrize("key", ALLOWED)
def test_every_field_takes_what_the_contract_allows_and_nothing_else(key: str) -> None:
    for value in VALUES:
        text, line = put(key, value)
        if value in ALLOWED[key]:
            parse_case(text, "case.toml")
            continue
        first, *others = problems(text)
        assert first.where == f"case.toml:{line}", value
        assert first.key == (f"{key}[1]" if (key, value) == ("solver.theta", "[1, 2]") else key), value
        assert "(found " in first.what
        assert not others


@pytest.mark.parametrize("key", ALLOWED_IN_LIST)
def test_every_list_takes_what_the_contract_allows_and_nothing_else(key: str) -> None:
    start = {"times": "0.0", "orders": "1"}.get(key.rpartition(".")[2], "0.5")
    for value in VALUES:
        text, line = put(key, f"[{start}, {value}]")
        if value in ALLOWED_IN_LIST[key]:
            parse_case(text, "case.toml")
        else:
            assert where(text) == [(f"case.toml:{line}", f"{key}[1]")], value


@pytest.mark.parametrize("value", ["1e-100", "1e100"])
def test_the_bounds_of_magnitude_belong_to_the_range(value: str) -> None:
    parse_case(put("shoe.mass", value)[0], "case.toml")


@pytest.mark.parametrize("value", ["9e-101", "1.1e100", "1" + "0" * 400, "0x" + "f" * 5000])
def test_magnitudes_out_of_the_range_are_refused_as_such(value: str) -> None:
    (line,) = messages(put("shoe.mass", value)[0])
    assert line.startswith("case.toml:3: shoe.mass: is not between 1e-100 and 1e+100 in magnitude (found ")


def test_a_problem_reads_file_line_key_what_found_and_remedy() -> None:
    assert messages(put("shoe.mass", "-1")[0]) == [
        "case.toml:3: shoe.mass: is out of range (found -1); give a number above 0, in kg"
    ]


REMEDIES = {
    ("contact.evaluator", '"quick"'): "give one of " + ", ".join(f'"{name}"' for name in EVALUATORS),
    ("solver.tolerance", "1e-14"): "give a number from 1e-13 to 0.01",
    ("contact.nodes", "1"): "give a whole number from 2 to 10000000",
    ("link1.angle_deg", "91"): "give a number from -90 to 90, in deg",
    ("link1.damping", "-1"): "give a number of at least 0, in N·s/m",
    ("wheel.times", "[]"): "give a list of at least one entry, each a number, in s",
    ("solver.allow_unconverged", "1"): "give true or false",
    ("title", '"two\\nlines"'): "give one line of text in quotes",
    ("roughness.wheel.wavelengths", "3"): "give a list, each a number above 0, in m",
}


@pytest.mark.parametrize(("field", "remedy"), REMEDIES.items())
def test_the_remedy_says_what_belongs_there(field: tuple[str, str], remedy: str) -> None:
    (problem,) = problems(put(*field)[0])
    assert problem.remedy == remedy
