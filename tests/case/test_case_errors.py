"""Whatever is wrong with a case file is told at once: each problem with its line, its key and a remedy."""

import io
import sys
import time
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from brakecli.case.case import Case
from brakecli.case.read import parse_case, read_case
from brakecli.case.system import system_of
from brakecli.case.toml_lines import LARGEST_TEXT, MOST_MARKS, MOST_PARTS, MOST_STATEMENTS, Located, split
from brakecli.case.wording import tables
from brakecli.errors import CaseError, Problem
from brakecli.runs.warnings import adjustments

CONSTANT = """\
title = "constant wheel and load"
[shoe]
mass = 10.0
[wheel]
radius = 0.5
angular_speed = 4.0
[link1]
stiffness = 1e7
damping = 300.0
angle_deg = 1.0
[link2]
stiffness = 1.2e7
damping = 300.0
angle_deg = 5.0
[load]
force = 5000.0
[friction]
coefficient = 0.45
[contact]
half_length = 0.05
stiffness = 2e7
evaluator = "auto"
nodes = 256
[roughness.shoe]
amplitudes = [1e-6, 7e-7]
wavelengths = [0.02, 0.011]
phases_deg = [0.0, 90.0]
[roughness.wheel]
amplitudes = [1e-6, 8e-7]
wavenumbers = [300.0, 500.0]
phases_deg = [0.0, 90.0]
[initial]
at = "rest"
x = 0.0
y = 0.0
vx = 0.0
vy = 0.0
[solver]
scheme = "two-layer"
theta = [0.5, 0.5]
iteration = "newton"
start = "consistent"
step = 1e-5
duration = 1.0
allow_unconverged = false
[output]
sample_interval = 1e-4
"""
VARYING = (
    CONSTANT.replace("angular_speed = 4.0", "times = [0.0, 1.0]\nangular_speeds = [4.0, 0.0]")
    .replace("force = 5000.0", "times = [0.0, 1.0]\nforces = [0.0, 5000.0]")
    .replace("wavelengths = [0.02, 0.011]", "wavenumbers = [300.0, 500.0]")
    .replace("[1e-6, 8e-7]\nwavenumbers = [300.0, 500.0]", "[1e-6, 8e-7]\nwavelengths = [0.02, 0.011]")
)
EVENT_DRIVEN = (
    CONSTANT.replace('"two-layer"', '"event-driven"')
    .replace("theta = [0.5, 0.5]\n", "")
    .replace("step = 1e-5", "tolerance = 1e-10")
)

VALUES = ("nan", "inf", "-1", "0", "1e999", "1e-320", '"text"', "true", "2020-01-01", "[1, 2]")
"""What is put into every field, as TOML."""

NUMBER, NON_NEGATIVE, POSITIVE, LIST = {"-1", "0"}, {"0"}, set[str](), {"[1, 2]"}
ALLOWED = {
    "title": {'"text"'},
    "shoe.mass": POSITIVE,
    "wheel.radius": POSITIVE,
    "wheel.angular_speed": NUMBER,
    "wheel.times": LIST,
    "wheel.angular_speeds": LIST,
    "link1.stiffness": NON_NEGATIVE,
    "link1.damping": NON_NEGATIVE,
    "link1.angle_deg": NUMBER,
    "link2.stiffness": NON_NEGATIVE,
    "link2.damping": NON_NEGATIVE,
    "link2.angle_deg": NUMBER,
    "load.force": NUMBER,
    "load.times": LIST,
    "load.forces": LIST,
    "friction.coefficient": NON_NEGATIVE,
    "contact.half_length": POSITIVE,
    "contact.stiffness": POSITIVE,
    "contact.evaluator": set(),
    "contact.nodes": set(),
    "roughness.shoe.amplitudes": LIST,
    "roughness.shoe.wavelengths": LIST,
    "roughness.shoe.wavenumbers": LIST,
    "roughness.shoe.phases_deg": LIST,
    "roughness.wheel.amplitudes": LIST,
    "roughness.wheel.wavelengths": LIST,
    "roughness.wheel.wavenumbers": LIST,
    "roughness.wheel.phases_deg": LIST,
    "initial.at": set(),
    "initial.x": NUMBER,
    "initial.y": NUMBER,
    "initial.vx": NUMBER,
    "initial.vy": NUMBER,
    "solver.scheme": set(),
    "solver.theta": set(),
    "solver.iteration": set(),
    "solver.start": set(),
    "solver.step": POSITIVE,
    "solver.tolerance": set(),
    "solver.duration": POSITIVE,
    "solver.allow_unconverged": {"true"},
    "output.sample_interval": POSITIVE,
}
"""Which of `VALUES` the contract allows in each field."""
ALLOWED_IN_LIST = {
    "wheel.times": POSITIVE,  # times increase, and the first is 0
    "wheel.angular_speeds": NUMBER,
    "load.times": POSITIVE,
    "load.forces": NUMBER,
    "roughness.shoe.amplitudes": NUMBER,
    "roughness.shoe.wavelengths": POSITIVE,
    "roughness.shoe.wavenumbers": POSITIVE,
    "roughness.shoe.phases_deg": NUMBER,
    "roughness.wheel.amplitudes": NUMBER,
    "roughness.wheel.wavelengths": POSITIVE,
    "roughness.wheel.wavenumbers": POSITIVE,
    "roughness.wheel.phases_deg": NUMBER,
    "solver.theta": NON_NEGATIVE,
}


def problems(text: str, *overrides: str) -> tuple[Problem, ...]:
    with pytest.raises(CaseError) as caught:
        parse_case(text, "case.toml", overrides)
    for problem in caught.value.problems:
        assert problem.what
        assert problem.remedy
        assert str(problem).isprintable()
    assert len(set(caught.value.problems)) == len(caught.value.problems)
    return caught.value.problems


def told(text: str, *overrides: str) -> list[str]:
    return [str(problem) for problem in problems(text, *overrides)]


def where(text: str, *overrides: str) -> list[tuple[str, str]]:
    return [(problem.where, problem.key) for problem in problems(text, *overrides)]


def put(key: str, value: str) -> tuple[str, int]:
    """A case with a value written into one of its fields, and the line of that field."""
    table, _, name = key.rpartition(".")
    for text in (CONSTANT, VARYING, EVENT_DRIVEN):
        lines = text.splitlines()
        first = lines.index(f"[{table}]") if table else -1
        for index in range(first + 1, len(lines)):
            if lines[index].startswith("["):
                break
            if lines[index].startswith(f"{name} = "):
                lines[index] = f"{name} = {value}"
                return "\n".join(lines), index + 1
    raise AssertionError(f"no such field: {key}")


def test_the_cases_of_this_file_are_valid() -> None:
    parse_case(CONSTANT, "constant")
    parse_case(VARYING, "varying")
    parse_case(EVENT_DRIVEN, "event-driven")


def test_the_table_of_allowed_values_has_every_field() -> None:
    inner = dict(tables(Case))
    fields = {
        ".".join(map(str, (*path, key)))
        for path, table in inner.items()
        for key in table.model_fields
        if (*path, key) not in inner
    }
    assert fields == set(ALLOWED)


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("key", ALLOWED)
def test_every_field_takes_what_the_contract_allows_and_nothing_else(key: str, value: str) -> None:
    text, line = put(key, value)
    if value in ALLOWED[key]:
        parse_case(text, "case.toml")
        return
    first, *others = problems(text)
    assert first.where == f"case.toml:{line}"
    if key == "solver.theta" and value == "[1, 2]":
        assert first.key == "solver.theta[1]"
    else:
        assert first.key == key
    assert "(found " in first.what
    assert not others


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("key", ALLOWED_IN_LIST)
def test_every_list_takes_what_the_contract_allows_and_nothing_else(key: str, value: str) -> None:
    text, line = put(key, f"[0.0, {value}]" if key.endswith("times") else f"[0.5, {value}]")
    if value in ALLOWED_IN_LIST[key]:
        parse_case(text, "case.toml")
        return
    assert where(text) == [(f"case.toml:{line}", f"{key}[1]")]


@pytest.mark.parametrize("value", ["1e-100", "1e100"])
def test_the_bounds_of_magnitude_belong_to_the_range(value: str) -> None:
    parse_case(put("shoe.mass", value)[0], "case.toml")


@pytest.mark.parametrize("value", ["9e-101", "1.1e100", "1" + "0" * 400, "0x" + "f" * 5000])
def test_magnitudes_out_of_the_range_are_refused_as_such(value: str) -> None:
    (line,) = told(put("shoe.mass", value)[0])
    assert line.startswith("case.toml:3: shoe.mass: is not between 1e-100 and 1e+100 in magnitude (found ")


def test_a_problem_reads_file_line_key_what_found_and_remedy() -> None:
    assert told(put("shoe.mass", "-1")[0]) == [
        "case.toml:3: shoe.mass: is out of range (found -1); give a number above 0, in kg"
    ]


REMEDIES = {
    ("contact.evaluator", '"quick"'): 'give one of "auto", "closed-form", "midpoint", "exact"',
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


# Rules between keys


def change(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


def lines_of(text: str, *starts: str) -> list[str]:
    lines = text.splitlines()
    return [
        f"case.toml:{next(i for i, line in enumerate(lines, 1) if line.startswith(start))}" for start in starts
    ]


RULES = [
    ("angular_speed = 4.0", "angular_speed = 4.0\ntimes = [0.0]\nangular_speeds = [1.0]", "wheel.times", "times"),
    ("angular_speed = 4.0\n", "", "wheel.angular_speed", "[wheel]"),
    ("angular_speed = 4.0", "times = [0.0]", "wheel.angular_speeds", "[wheel]"),
    ("angular_speed = 4.0", "times = [0.0]\nangular_speeds = [1, 2]", "wheel.angular_speeds", "angular_speeds"),
    ("angular_speed = 4.0", "times = [1, 1]\nangular_speeds = [1, 2]", "wheel.times[1]", "times"),
    ("force = 5000.0", "force = 5000.0\nforces = [1.0]", "load.forces", "forces"),
    ("force = 5000.0", "", "load.force", "[load]"),
    ("wavelengths = [0.02, 0.011]\n", "", "roughness.shoe.wavelengths", "[roughness.shoe]"),
    ("wavelengths = [0.02, 0.011]", "wavelengths = [0.02]", "roughness.shoe.wavelengths", "wavelengths"),
    ("wavelengths = [0.02, 0.011]", "wavelengths = []", "roughness.shoe.wavelengths", "wavelengths"),
    ("1.0\n[link2]", "1.0\nangel_deg = 2\n[link2]", "link1.angel_deg", "angel_deg"),
    ("theta = [0.5, 0.5]", "theta = [0.25, 0.5, 0.25]", "solver.theta", "theta"),
    ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"\ntheta = [0.5, 0.5]', "solver.theta", "theta"),
    ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"\ntheta = [0.5, 0.5, 0.1]', "solver.theta", "theta"),
    ('start = "consistent"', 'start = "paper"', "solver.start", "start"),
    ("sample_interval = 1e-4", "sample_interval = 0.99e-5", "output.sample_interval", "sample_interval"),
    ("[shoe]\nmass = 10.0\n", "", "shoe", None),
    ("[initial]", "[initial]\nz = 0", "initial.z", "z"),
    ("mass = 10.0\n", "", "shoe.mass", "[shoe]"),
]


@pytest.mark.parametrize(("old", "new", "key", "line"), RULES)
def test_a_broken_rule_is_told_at_its_key(old: str, new: str, key: str, line: str | None) -> None:
    text = change(CONSTANT, (old, new))
    (found,) = where(text)
    assert found == (lines_of(text, line)[0] if line else "case.toml", key)


def test_the_paper_start_needs_a_shoe_at_rest() -> None:
    three = change(
        CONSTANT,
        ('"two-layer"\ntheta = [0.5, 0.5]', '"three-layer"'),
        ('start = "consistent"', 'start = "paper"'),
    )
    parse_case(three, "case.toml", ['initial.at="equilibrium"', "initial.x=1e-6"])
    moving = change(three, ("vy = 0.0", "vy = 0.1"))
    assert where(moving) == [(lines_of(moving, "start")[0], "solver.start")]


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        (
            "tolerance = 1e-10",
            "tolerance = 1e-10\nstep = 1e-5",
            "solver.tolerance",
            "is given together with step (found 1e-10); keep one of the two",
        ),
        ("duration = 1.0", "duration = 1.0\ntheta = [0.5, 0.5]", "solver.theta", "which has no weights"),
        ('"newton"', '"fixed-point"', "solver.iteration", "is not for event-driven"),
        ('"consistent"', '"paper"', "solver.start", "is for the three-layer scheme alone"),
        ("= false", "= true", "solver.allow_unconverged", "is not for event-driven"),
        ("sample_interval = 1e-4", "", "output.sample_interval", "there is no time step to take its place"),
        ('"auto"', '"midpoint"', "contact.evaluator", "event-driven is exact"),
    ],
)
def test_what_is_not_for_the_event_driven_scheme_is_told(old: str, new: str, line: str, what: str) -> None:
    first, *_ = told(change(EVENT_DRIVEN, (old, new)))
    assert f" {line}: " in first
    assert what in first


def test_a_step_chooses_two_layer_and_none_leaves_the_choice() -> None:
    plain = change(CONSTANT, ('scheme = "two-layer"\n', ""), ("theta = [0.5, 0.5]\n", ""))
    assert parse_case(plain, "case.toml").case.solver.scheme == "two-layer"
    free = parse_case(change(plain, ("step = 1e-5\n", "")), "case.toml").case.solver
    assert (free.scheme, free.step, free.tolerance, free.promise) == ("auto", None, None, 1e-3)
    kept = parse_case(plain, "case.toml", ["solver.tolerance=1e-5"]).case.solver
    assert (kept.scheme, kept.step, kept.promise) == ("auto", None, 1e-5)
    (line,) = told(change(plain, ("[solver]", '[solver]\nscheme = "auto"')))
    assert 'solver.step: is given, but "auto" chooses the step' in line


def test_nodes_are_chosen_by_the_tolerance() -> None:
    case = parse_case(CONSTANT, "case.toml", ["solver={duration=1.0, tolerance=1e-4}"]).case
    assert "contact.nodes: not used, the tolerance chooses nodes itself" in adjustments(system_of(case))


def test_event_driven_takes_the_step_of_a_case_for_its_samples_alone() -> None:
    case = parse_case(CONSTANT, "case.toml", ['solver.scheme="event-driven"', "solver.theta=[]"]).case
    (told_,) = adjustments(system_of(case))
    assert "solver.step: not used, event-driven finds its steps itself, to a tolerance of 1e-10" in told_


def test_an_override_makes_a_case_event_driven() -> None:
    solver = parse_case(
        CONSTANT, "case.toml", ['solver.scheme="event-driven"', "solver.tolerance=1e-10", "solver.theta=[]"]
    ).case.solver
    assert (solver.step, solver.theta, solver.tolerance) == (None, (), 1e-10)


def test_an_interval_of_one_step_to_rounding_is_allowed() -> None:
    parse_case(change(CONSTANT, ("sample_interval = 1e-4", "sample_interval = 0.9999999999e-5")), "case.toml")


def test_empty_lists_are_a_smooth_surface() -> None:
    smooth = "amplitudes = []\nwavelengths = []\nphases_deg = []"
    text = change(
        CONSTANT, ("amplitudes = [1e-6, 7e-7]\nwavelengths = [0.02, 0.011]\nphases_deg = [0.0, 90.0]", smooth)
    )
    shoe = parse_case(
        text.replace("phases_deg = [0.0, 90.0]\n[roughness", "[roughness"), "case.toml"
    ).case.roughness.shoe
    assert shoe is not None
    assert shoe.amplitudes == shoe.wavelengths == shoe.phases_deg == ()


def test_one_entry_is_a_constant_schedule() -> None:
    text = change(CONSTANT, ("force = 5000.0", "times = [0.0]\nforces = [5000.0]"))
    assert parse_case(text, "case.toml").case.load.forces == (5000.0,)


def test_rules_are_checked_where_other_keys_and_tables_are_wrong() -> None:
    text = change(
        CONSTANT,
        ("radius = 0.5", "radius = -0.5"),
        ("angular_speed = 4.0", "times = [1, 0]\nangular_speeds = [1]"),
        ("force = 5000.0", ""),
        ("theta = [0.5, 0.5]", "theta = [0.5]"),
        ('iteration = "newton"', 'iteration = "none"'),
        ("sample_interval = 1e-4", 'sample_interval = "small"'),
    )
    keys = [key for _, key in where(text)]
    assert keys == [
        "wheel.radius",
        "wheel.times[1]",
        "wheel.angular_speeds",
        "load.force",
        "solver.theta",
        "solver.iteration",
        "output.sample_interval",
    ]


def test_rules_between_tables_are_checked_where_a_third_table_is_wrong() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = nan"), ("sample_interval = 1e-4", "sample_interval = 1e-9"))
    assert [key for _, key in where(text)] == ["shoe.mass", "output.sample_interval"]


# Unknown, misspelt and duplicate keys, wrong tables, syntax


def test_unknown_misspelt_duplicate_and_misplaced_keys_are_told_together_by_line() -> None:
    text = change(
        CONSTANT,
        ("mass = 10.0", "mas = 10.0"),
        ("angular_speed = 4.0", "angular_speed = 4.0\nangular_speed = 5.0\nstiffness = 3.0"),
        ("[friction]", "[fricton]"),
        ("coefficient = 0.45", "coefficient = -0.45"),
        ("[initial]", "[initial]\nzzz = 1\n[load]"),
        ("duration = 1.0", "duration = 1,0"),
    )
    assert told(text) == [
        'case.toml:3: shoe.mas: is unknown (found 10.0); did you mean "mass"?',
        "case.toml:7: wheel.angular_speed: is given twice, first in line 6; keep one of the two",
        "case.toml:8: wheel.stiffness: is unknown (found 3.0);"
        " did you mean stiffness of [link1] or [link2] or [contact]?",
        "case.toml:19: fricton: is unknown (found a table); did you mean [friction]?",
        "case.toml:20: fricton.coefficient: is out of range (found -0.45); give a number of at least 0",
        "case.toml:35: initial.zzz: is unknown (found 1); the keys of [initial] are at, x, y, vx, vy",
        "case.toml:36: load: is given twice, first in line 17; keep one of the two",
        'case.toml:37: load.at: is unknown (found "rest"); did you mean at of [initial]?',
        "case.toml:38: load.x: is unknown (found 0.0); did you mean x of [initial]?",
        "case.toml:39: load.y: is unknown (found 0.0); did you mean y of [initial]?",
        "case.toml:40: load.vx: is unknown (found 0.0); did you mean vx of [initial]?",
        "case.toml:41: load.vy: is unknown (found 0.0); did you mean vy of [initial]?",
        "case.toml:48: is not valid TOML: expected newline or end of document after a statement"
        " (found duration = 1,0); numbers are written 1.5 or 2e-3, texts in quotes, lists as [1, 2],"
        " table headers as [table]",
    ]


def test_a_key_before_any_table_is_sent_to_its_table() -> None:
    text = "radius = 0.5\n" + change(CONSTANT, ("radius = 0.5\n", ""))
    assert told(text) == [
        "case.toml:1: radius: is unknown (found 0.5); did you mean radius of [wheel]?",
    ]


def test_a_table_that_is_a_list_is_told() -> None:
    assert where(change(CONSTANT, ("[shoe]", "[[shoe]]"))) == [("case.toml:2", "shoe")]


def test_an_empty_file_lacks_every_required_table() -> None:
    found = where("# nothing\n")
    assert [key for _, key in found] == [
        "shoe",
        "wheel",
        "link1",
        "link2",
        "load",
        "friction",
        "contact",
        "solver",
    ]
    assert {place for place, _ in found} == {"case.toml"}


def test_nothing_is_missed_where_a_part_cannot_be_read() -> None:
    text = change(CONSTANT, ("[wheel]", "[wheel"), ("mass = 10.0", "mass = -1"))
    assert where(text) == [("case.toml:3", "shoe.mass"), ("case.toml:4", "")]


def test_several_syntax_errors_are_told_together() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = ten"), ("force = 5000.0", "force 5000.0"))
    assert [place for place, _ in where(text)] == ["case.toml:3", "case.toml:16"]


@pytest.mark.parametrize(
    "text",
    [
        'a = "open\n',
        "a = 'open\n",
        'a = """open\nb = 1\n',
        "a = '''open\nb = 1\n",
        "a = [1, 2\nb = 1\n",
        "a = {b = 1\n",
        "a = ]\n",
        "= 1\n",
        "a = 1 b = 2\n",
        "a = 2020-13-45\n",
        "a = 1" + "0" * 5000 + "\n",
        "[a]]\n",
        "a = 1\r\r\n",
        "shoe = {mass = 1}\nshoe.mass = 2\n",
        "a = [1]\n[[a]]\n",
        "a.b = 1\n[a]\nc = 2\n",
        "a = 1\n[a.b]\n",
    ],
)
def test_broken_toml_is_told_with_a_line(text: str) -> None:
    lines = where(text)
    assert any(place.startswith("case.toml:") for place, _ in lines)


# Lines


WAYS = {
    "dotted keys": ("shoe.mass = -1\n", 1),
    "an inline table": ("shoe = { mass = -1 }\n", 1),
    "quoted keys": ('["shoe"]\n"mass" = -1\n', 2),
    "spaces around dots": ("  shoe . 'mass'   = -1\n", 1),
    "a comment with brackets": ("# [shoe\n[shoe] # ]]\nmass = -1 # {\n", 3),
    "CRLF": ("\r\n[shoe]\r\nmass = -1\r\n", 3),
    "a text of several lines": ('title2 = """\n[shoe]\nmass = 3 ""\n"""\n[shoe]\nmass = -1\n', 6),
    "a literal text of several lines": ("title2 = '''\n[shoe]\n'''\n[shoe]\nmass = -1\n", 5),
    "escaped quotes": ('title2 = "\\"[" # "\n[shoe]\nmass = -1\n', 3),
    "a list of several lines": ("title2 = [\n1, # ]\n'[',\n]\n[shoe]\nmass = -1\n", 6),
    "blank and indented lines": ("\n\n  \n\t[shoe]\n\n   # note\n\t mass = -1", 7),
}


@pytest.mark.parametrize(("text", "line"), WAYS.values(), ids=WAYS.keys())
def test_the_line_is_right_however_the_key_is_written(text: str, line: int) -> None:
    assert (f"case.toml:{line}", "shoe.mass") in where(text)


@pytest.mark.parametrize(("text", "line"), WAYS.values(), ids=WAYS.keys())
def test_the_line_is_right_also_where_the_file_is_broken(text: str, line: int) -> None:
    assert (f"case.toml:{line}", "shoe.mass") in where(f"{text}\n= 3\n")


def test_the_line_of_a_header_counts_where_its_key_is_missing() -> None:
    text = change(CONSTANT, ("[shoe]\nmass = 10.0\n", "")) + "\n\n[shoe] # empty\n"
    assert where(text) == [(f"case.toml:{text.count(chr(10))}", "shoe.mass")]


def test_strange_keys_and_values_are_shown_as_plain_text() -> None:
    (line,) = told(CONSTANT + '"\\u001b[31m\\n" = "\\u009b\\u202e"\n')
    assert line.startswith('case.toml:48: output."\\u001b[31m\\n": is unknown (found "\\u009b\\u202e")')


# Files that are no case


HOSTILE = {
    "5000 nested tables": "\n".join("[" + ".".join(["a"] * depth) + "]" for depth in range(1, 5000, 100)),
    "a table of 5000 parts": "[" + ".".join("a" * 5000) + "]",
    "a key of 20000 parts": ".".join("a" * 20000) + " = 1",
    "a quoted key of 20000 parts": " . ".join(['"a"'] * 20000) + " = 1",
    "a deep key in an inline table": "a = {" + ".".join("a" * 20000) + " = 1}",
    "5000 nested lists": "a = " + "[" * 5000 + "]" * 5000,
    "5000 nested inline tables": "a = " + "{a = " * 5000 + "1" + "}" * 5000,
    "as many lists as fit": "a = " + "[" * (LARGEST_TEXT - 10),
    "only equals signs": "=" * LARGEST_TEXT,
    "only line ends": "\n" * LARGEST_TEXT,
    "only comments": "#\n" * (LARGEST_TEXT // 2),
    "only keys": "".join(f"a{i} = 1\n" for i in range(50_000)),
    "many unknown keys": "".join(f"abcde{i} = 1\n" for i in range(MOST_STATEMENTS)),
    "one key again and again": "a = 1\n" * MOST_STATEMENTS,
    "a long list": "a = [" + "nan, " * (MOST_MARKS - 10) + "]",
    "a long list of wrong entries": CONSTANT.replace("[1e-6, 7e-7]", "[" + "nan," * (MOST_MARKS - 100) + "]"),
    "a long schedule that runs backwards": CONSTANT.replace(
        "force = 5000.0",
        f"times = {list(range(MOST_MARKS // 2 - 50, 0, -1))}\nforces = {[1] * (MOST_MARKS // 2 - 50)}",
    ),
    "open texts": '"""\n\\"""\n' * 50_000,
    "open quotes": 'a = "' + '\\"' * (LARGEST_TEXT // 2 - 10),
    "a long text": 'a = """' + "\\\\" * (LARGEST_TEXT // 2 - 10) + '"""',
    "a long number": "a = " + "9" * (LARGEST_TEXT - 10),
    "a long hexadecimal number": "a = 0x" + "f" * (LARGEST_TEXT - 10),
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_file_is_refused_within_half_a_second(text: str) -> None:
    times = []
    for _ in range(3):  # a busy machine takes longer now and then
        start = time.process_time()
        assert problems(text)
        times.append(time.process_time() - start)
    assert min(times) < 0.5


def test_a_key_of_more_than_32_parts_is_refused_and_one_of_32_is_only_unknown() -> None:
    assert MOST_PARTS == 32
    (deep,) = problems(".".join("a" * 33) + " = 1")
    assert (deep.where, deep.what) == ("case.toml:1", "a key has more than 32 parts")
    assert "a: is unknown" in told(".".join("a" * 32) + " = 1")[-1]
    parse_case(CONSTANT + "# " + "a." * 40, "case.toml")


def test_dots_in_texts_and_lists_of_numbers_are_no_deep_key() -> None:
    text = change(CONSTANT, ('"constant wheel and load"', '"' + "a." * 50 + '"'))
    entries = ", ".join(f"{i}.5" for i in range(50))
    text = change(text, ("force = 5000.0", f"times = [{entries}]\nforces = [{entries}]"))
    parse_case(text, "case.toml")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("#" * (LARGEST_TEXT + 1), f"is larger than {LARGEST_TEXT} bytes"),
        ("a = [" + "1," * (MOST_MARKS + 1) + "]", f"there are more than {MOST_MARKS} commas and brackets"),
        (
            "".join(f"a{i} = 1\n" for i in range(MOST_STATEMENTS + 1)),
            f"there are more than {MOST_STATEMENTS} keys",
        ),
        ("a = " + "[" * 5000, "is nested too deep"),
        ("\ufeff" + CONSTANT, "begins with a byte order mark"),
        (CONSTANT + "\0", "holds a NUL character"),
    ],
)
def test_every_guard_says_what_it_refuses(text: str, what: str) -> None:
    first, *_ = problems(text)
    assert first.what == what


def test_of_a_long_list_the_first_wrong_entries_are_told_and_their_number() -> None:
    found = problems(put("roughness.wheel.amplitudes", "[" + "nan, " * 1000 + "]")[0])
    assert len(found) == 21
    assert found[0].key == "roughness.wheel.amplitudes[0]"
    assert found[-1].key == "roughness.wheel.amplitudes"
    assert found[-1].what == "has 1000 wrong entries, of which the first 20 are told"


@pytest.mark.parametrize(
    ("data", "place", "what"),
    [
        (CONSTANT.encode("utf-16"), "1", "is UTF-16, not UTF-8"),
        (CONSTANT.encode("utf-16-be"), "1", "holds a NUL character"),
        (CONSTANT.encode("utf-8-sig"), "1", "begins with a byte order mark"),
        (CONSTANT.replace("[shoe]", "[shoe] # für").encode("latin-1"), "2", "is not UTF-8 (found byte 0xfc)"),
        (b"\x89HDF\r\n\x1a\n" + bytes(1000), "1", "is not UTF-8 (found byte 0x89)"),
        (b"#" * (LARGEST_TEXT + 5), "", f"is larger than {LARGEST_TEXT} bytes"),
        (("#" + "ω" * (LARGEST_TEXT // 2)).encode(), "", f"is larger than {LARGEST_TEXT} bytes"),
    ],
)
def test_bytes_that_are_not_utf_8_text_are_refused(tmp_path: Path, data: bytes, place: str, what: str) -> None:
    path = tmp_path / "case.toml"
    path.write_bytes(data)
    with pytest.raises(CaseError) as caught:
        read_case(str(path))
    (problem,) = caught.value.problems
    assert problem.where == (f"{path}:{place}" if place else str(path))
    assert problem.what == what


def test_a_file_without_end_is_not_read_to_its_end() -> None:
    with pytest.raises(CaseError, match="larger than"):
        read_case("/dev/zero")


@pytest.mark.parametrize("name", ["absent.toml", ".", "absent/case.toml", "x" * 300, "a\0b", "", "case.toml/x"])
def test_a_file_that_cannot_be_read_is_a_usage_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CONSTANT)
    with pytest.raises(CaseError, match=r"cannot be read: [a-z]") as caught:
        read_case(name)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("stream", [None, io.TextIOWrapper(io.BytesIO())])
def test_a_closed_standard_input_is_a_usage_error(
    monkeypatch: pytest.MonkeyPatch, stream: io.TextIOWrapper | None
) -> None:
    if stream is not None:
        stream.close()
    monkeypatch.setattr(sys, "stdin", stream)
    with pytest.raises(CaseError, match="standard input: cannot be read"):
        read_case("-")


# Overrides


def test_problems_of_overrides_name_the_override_and_come_after_those_of_the_file() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = -10.0"))
    assert told(text, "link1.stiffness=-1", "solver.dration=2", "contact={half_length=1, stiffness=nan}") == [
        "case.toml:3: shoe.mass: is out of range (found -10.0); give a number above 0, in kg",
        "--set link1.stiffness=-1: link1.stiffness: is out of range (found -1);"
        " give a number of at least 0, in N/m",
        '--set solver.dration=2: solver.dration: is unknown (found 2); did you mean "duration"?',
        "--set contact={half_length=1, stiffness=nan}: contact.stiffness: is not finite (found nan);"
        " give a number above 0, in N/m²",
    ]


def test_an_override_can_mend_a_wrong_value() -> None:
    text = change(CONSTANT, ("mass = 10.0", "mass = -10.0"))
    assert parse_case(text, "case.toml", ["shoe.mass=1"]).case.shoe.mass == 1.0


def test_a_bare_word_is_refused_with_its_quoted_form() -> None:
    (line,) = told(CONSTANT, "solver.scheme=three-layer")
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


def test_all_malformed_overrides_are_told() -> None:
    found = problems(CONSTANT, *MALFORMED)
    assert len(found) == len(MALFORMED)


def test_two_overrides_that_exclude_each_other_are_told() -> None:
    for overrides in (
        ["load.force=1", "load.times=[0]", "load.forces=[1]"],
        ["load.times=[0]", "load.forces=[1]", "load.force=1"],
    ):
        assert where(CONSTANT, *overrides) == [("--set load.times=[0]", "load.times")]


def test_half_a_schedule_by_override_is_told_as_missing_the_other_half() -> None:
    assert where(CONSTANT, "load.times=[0, 1]") == [("case.toml:15", "load.forces")]


def test_a_table_created_by_an_override_is_told_there() -> None:
    text = CONSTANT[: CONSTANT.index("[roughness.shoe]")] + CONSTANT[CONSTANT.index("[initial]") :]
    override = "roughness.wheel.amplitudes=[1]"
    assert where(text, override) == [(f"--set {override}", "roughness.wheel.wavelengths")]


# Any file


TREES = st.recursive(
    st.integers() | st.booleans() | st.text(st.characters(exclude_categories=["Cs"])) | st.dates() | st.floats(),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text("ab.\"'\n #[]=é", max_size=4), inner, max_size=3)
    ),
    max_leaves=12,
)
DOCUMENTS = st.dictionaries(st.text("ab.\"'\n #[]=é", max_size=4), TREES, max_size=4)


@given(DOCUMENTS)
def test_statement_by_statement_a_text_says_the_same_as_in_one_piece(document: dict[str, Any]) -> None:
    text = tomli_w.dumps(document)
    located = Located(split(text))
    assert repr(located.data) == repr(tomllib.loads(text))  # nan is not equal to itself
    assert not located.findings


@given(st.data())
def test_no_edit_of_a_case_raises_anything_but_a_case_error(data: st.DataObject) -> None:
    text = CONSTANT
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(start, min(len(text), start + 40)))
        new = data.draw(st.text("\n[]{}=.,\"'\\#\r\t 1e-ab_", max_size=6) | st.text(max_size=3))
        text = text[:start] + new + text[end:]
    with suppress(CaseError):
        parse_case(text, "case.toml")


@given(st.text("\n[]{}=.,\"'\\#\r\t 1e-a", max_size=60), st.text("[]{}=.,\"'\\# 1ea", max_size=20))
def test_no_text_and_no_override_raises_anything_but_a_case_error(text: str, override: str) -> None:
    with pytest.raises(CaseError):
        parse_case(text, "case.toml", [override])


def test_tables_in_a_list_have_lines_of_their_own() -> None:
    text = "case = 1\n[[axis]]\nstart = 1\n[[axis]]\nstart = 2\n[axis.more]\nstop = 3\n"
    assert Located(split(text)).lines == {
        ("case",): 1,
        ("axis",): 2,
        ("axis", 0): 2,
        ("axis", 0, "start"): 3,
        ("axis", 1): 4,
        ("axis", 1, "start"): 5,
        ("axis", 1, "more"): 6,
        ("axis", 1, "more", "stop"): 7,
    }
