"""Unknown keys and broken TOML are reported all at once, each in its line, however the file is written."""

import tomllib
from contextlib import suppress
from typing import Any

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from brakecli.case.read import parse_case
from brakecli.errors import CaseError
from brakecli.results.toml_lines import Located
from tests.campaign import campaign
from tests.case.examples import CONSTANT, change, messages, where


def test_unknown_misspelt_duplicate_and_misplaced_keys_are_reported_together_by_line() -> None:
    text = change(
        CONSTANT,
        ("mass = 10.0", "mas = 10.0"),
        ("angular_speed = 4.0", "angular_speed = 4.0\nangular_speed = 5.0\nstiffness = 3.0"),
        ("[friction]", "[fricton]"),
        ("coefficient = 0.45", "coefficient = -0.45\nqqq = 2"),
        ("[initial]", "[initial]\nzzz = 1\n[load]"),
        ("duration = 1.0", "duration = 1,0"),
    )
    assert messages(text) == [
        "case.toml:3: shoe.mas: is unknown (found 10.0); did you mean shoe.mass?",
        "case.toml:7: wheel.angular_speed: is given twice, first in line 6; keep one of the two",
        "case.toml:8: wheel.stiffness: is unknown (found 3.0);"
        " did you mean link1.stiffness or link2.stiffness or contact.stiffness?",
        "case.toml:19: fricton: is unknown (found a table); did you mean [friction]?",
        "case.toml:20: fricton.coefficient: is out of range (found -0.45); give a number of at least 0",
        "case.toml:21: fricton.qqq: is unknown (found 2); the keys of [friction] are coefficient",
        "case.toml:36: initial.zzz: is unknown (found 1);"
        " the keys of [initial] are from, at, x, y, vx, vy, wheel_angle",
        "case.toml:37: load: is given twice, first in line 17; keep one of the two",
        'case.toml:38: load.at: is unknown (found "rest"); did you mean initial.at?',
        "case.toml:39: load.x: is unknown (found 0.0); did you mean initial.x?",
        "case.toml:40: load.y: is unknown (found 0.0); did you mean initial.y?",
        "case.toml:41: load.vx: is unknown (found 0.0); did you mean initial.vx?",
        "case.toml:42: load.vy: is unknown (found 0.0); did you mean initial.vy?",
        "case.toml:43: load.wheel_angle: is unknown (found 0.0); did you mean initial.wheel_angle?",
        "case.toml:50: is not valid TOML: expected newline or end of document after a statement"
        " (found duration = 1,0); numbers are written 1.5 or 2e-3, texts in quotes, lists as [1, 2],"
        " table headers as [table]",
    ]


def test_a_key_before_any_table_is_sent_to_its_table() -> None:
    text = "radius = 0.5\n" + change(CONSTANT, ("radius = 0.5\n", ""))
    assert messages(text) == [
        "case.toml:1: radius: is unknown (found 0.5); did you mean wheel.radius?",
    ]


def test_a_table_that_is_a_list_is_reported() -> None:
    assert where(change(CONSTANT, ("[shoe]", "[[shoe]]"))) == [("case.toml:2", "shoe")]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[wheel]", "[[shoe]]\nmass = 1.0\n[wheel]", "4: shoe: has both headers [shoe] and [[shoe]]"),
        ("[shoe]", "[[shoe]]\nmass = 1.0\n[shoe]", "4: shoe: has both headers [shoe] and [[shoe]]"),
        ("[wheel]", "[shoe]\nmass = 1.0\n[wheel]", "4: shoe: is given twice"),
        ("[shoe]", "shoe = 3\n[shoe]", "3: shoe: is given twice"),
    ],
)  # fmt: skip
def test_a_table_that_is_given_twice_brings_one_message(old: str, new: str, expected: str) -> None:
    assert messages(change(CONSTANT, (old, new))) == [
        f"case.toml:{expected}, first in line 2; keep one of the two"
    ]


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


def test_several_syntax_errors_are_reported_together() -> None:
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
def test_broken_toml_is_reported_with_a_line(text: str) -> None:
    lines = where(text)
    assert any(place.startswith("case.toml:") for place, _ in lines)


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
    (line,) = messages(CONSTANT + '"\\u001b[31m\\n" = "\\u009b\\u202e"\n')
    assert line.startswith('case.toml:49: output."\\u001b[31m\\n": is unknown (found "\\u009b\\u202e")')


TREES = st.recursive(
    st.integers() | st.booleans() | st.text(st.characters(exclude_categories=["Cs"])) | st.dates() | st.floats(),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text("ab.\"'\n #[]=é", max_size=4), inner, max_size=3)
    ),
    max_leaves=12,
)
DOCUMENTS = st.dictionaries(st.text("ab.\"'\n #[]=é", max_size=4), TREES, max_size=4)


@given(DOCUMENTS)
@campaign
def test_statement_by_statement_a_text_says_the_same_as_in_one_piece(document: dict[str, Any]) -> None:
    text = tomli_w.dumps(document)
    located = Located(text)
    assert repr(located.data) == repr(tomllib.loads(text))  # nan is not equal to itself
    assert not located.problems


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
    assert Located(text).lines == {
        ("case",): 1,
        ("axis",): 2,
        ("axis", 0): 2,
        ("axis", 0, "start"): 3,
        ("axis", 1): 4,
        ("axis", 1, "start"): 5,
        ("axis", 1, "more"): 6,
        ("axis", 1, "more", "stop"): 7,
    }
