"""Files that are not cases, or cannot be read, are refused quickly and in plain words."""

import io
import sys
import time
from pathlib import Path

import pytest

from brakecli.case.read import parse_case, read_text
from brakecli.errors import CaseError
from brakecli.results.toml_lines import LARGEST_STORED, LARGEST_TEXT, MOST_MARKS, MOST_PARTS, MOST_STATEMENTS
from tests.case.examples import CONSTANT, change, messages, problems, put
from tests.commands import SOON, TINY

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
def test_a_hostile_file_is_refused_soon(text: str) -> None:
    """What grows with the square of such a text takes minutes."""
    start = time.process_time()
    assert problems(text)
    assert time.process_time() - start < SOON


def test_a_key_of_more_than_32_parts_is_refused_and_one_of_32_is_only_unknown() -> None:
    assert MOST_PARTS == 32
    (deep,) = problems(".".join("a" * 33) + " = 1")
    assert (deep.where, deep.what) == ("case.toml:1", "a key has more than 32 parts")
    assert "a: is unknown" in messages(".".join("a" * 32) + " = 1")[-1]
    parse_case(CONSTANT + "# " + "a." * 40, "case.toml")


def test_dots_in_texts_and_lists_of_numbers_are_no_deep_key() -> None:
    text = change(CONSTANT, ('"constant wheel and load"', '"' + "a." * 50 + '"'))
    entries = ", ".join(f"{i}.5" for i in range(50))
    text = change(text, ("force = 5000.0", f"times = [{entries}]\nforces = [{entries}]"))
    parse_case(text, "case.toml")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("#" * (LARGEST_STORED + 1), f"is larger than {LARGEST_STORED} bytes"),
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


def test_of_a_long_list_the_first_wrong_entries_are_reported_and_their_number() -> None:
    found = problems(put("roughness.wheel.amplitudes", "[" + "nan, " * 1000 + "]")[0])
    assert len(found) == 21
    assert found[0].key == "roughness.wheel.amplitudes[0]"
    assert found[-1].key == "roughness.wheel.amplitudes"
    assert found[-1].what == "has 1000 wrong entries, of which the first 20 are reported"


@pytest.mark.parametrize(
    ("data", "place", "what"),
    [
        (CONSTANT.encode("utf-16"), "1", "is UTF-16, not UTF-8"),
        (CONSTANT.encode("utf-16-be"), "1", "holds a NUL character"),
        (CONSTANT.replace("[shoe]", "[shoe] # für").encode("latin-1"), "2", "is not UTF-8 (found byte 0xfc)"),
        (b"\x89HDF\r\n\x1a\n" + bytes(1000), "", "is a result, not TOML"),
        (b"#" * (LARGEST_TEXT + 5), "", f"is larger than {LARGEST_TEXT} bytes"),
        (("#" + "ω" * (LARGEST_TEXT // 2)).encode(), "", f"is larger than {LARGEST_TEXT} bytes"),
    ],
)
def test_bytes_that_are_not_utf_8_text_are_refused(tmp_path: Path, data: bytes, place: str, what: str) -> None:
    path = tmp_path / "case.toml"
    path.write_bytes(data)
    with pytest.raises(CaseError) as caught:
        parse_case(*read_text(str(path)))
    (problem,) = caught.value.problems
    assert problem.where == (f"{path}:{place}" if place else str(path))
    assert problem.what == what


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_bytes(CONSTANT.encode("utf-8-sig"))
    assert parse_case(*read_text(str(tmp_path / "case.toml"))).text == CONSTANT


def test_a_file_without_end_is_refused_at_once() -> None:
    with pytest.raises(CaseError, match="this is not a regular file"):
        parse_case(*read_text("/dev/zero"))


@pytest.mark.parametrize("name", ["absent.toml", ".", "absent/case.toml", "x" * 300, "a\0b", "", "case.toml/x"])
def test_a_file_that_cannot_be_read_is_a_usage_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CONSTANT)
    with pytest.raises(CaseError, match=r"cannot be read: [a-z]") as caught:
        parse_case(*read_text(name))
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("stream", [None, io.TextIOWrapper(io.BytesIO())])
def test_a_closed_standard_input_is_a_usage_error(
    monkeypatch: pytest.MonkeyPatch, stream: io.TextIOWrapper | None
) -> None:
    if stream is not None:
        stream.close()
    monkeypatch.setattr(sys, "stdin", stream)
    with pytest.raises(CaseError, match="standard input: cannot be read"):
        parse_case(*read_text("-"))


def test_a_nul_in_the_path_of_a_profile_is_told() -> None:
    with pytest.raises(CaseError, match="null byte"):
        parse_case(TINY, "tiny.toml", ['roughness.wheel.profile="a\\u0000b"'])
