"""Short answers: at most twelve lines in a terminal of eighty columns, none twice, and the rest on demand."""

import re
from pathlib import Path

import pytest

from brakecli.case.read import starters
from brakecli.views.motion import motion_sentence
from brakecli.views.render import EXACT, TERMINAL
from brakecli.views.terminal import terminal_text
from brakecli.views.view import Row, Table, View, sentence
from tests.commands import brakecli

MOST_LINES = 12
STARTERS = ("case", "rough", "stop", "sweep", "hysteresis", "branch", "scatter")
SHORT = ("--set", "samples=128")
LINES = [
    ["run", "case.toml"],
    ["run", "stop.toml"],
    ["classify", "rough.h5"],
    ["classify", "stop.h5"],
    ["stability", "case.toml"],
    ["stability", "case.toml", "--vary", "link2.angle_deg=1:10:10"],
    ["advise", "case.toml"],
    ["advise", "rough.toml"],
    ["sweep", "sweep.toml"],
    ["scatter", "scatter.toml", *SHORT],
    ["diff", "case.h5", "rough.h5"],
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The starters, and the results of the first three runs."""
    here = tmp_path_factory.mktemp("short")
    for name in STARTERS:
        (here / f"{name}.toml").write_text(starters()[name])
    for name in ("case", "rough", "stop"):
        brakecli("run", f"{name}.toml", "--quiet", cwd=here)
    return here


@pytest.mark.parametrize("line", LINES, ids=" ".join)
def test_an_answer_has_twelve_lines_at_most_none_twice_and_the_rest_on_demand(
    line: list[str], folder: Path
) -> None:
    new = ["--force"] if line[0] in ("run", "sweep", "scatter") else []
    short = brakecli(*line, *new, cwd=folder, COLUMNS="80").out.splitlines()
    whole = brakecli(*line, *new, "--details", cwd=folder, COLUMNS="80").out.splitlines()
    written = [each for each in short if each]
    assert len(short) <= MOST_LINES
    assert max(map(len, [*short, *whole])) <= 80
    assert len({*written}) == len(written)
    assert len(whole) > len(short) or line[0] == "sweep"


def test_a_view_without_its_details_has_the_first_rows_of_its_tables() -> None:
    columns = {"key": ["a", "b", "c"]}
    rows: list[Row | Table] = [Row("seen", "1"), Row("hidden", "2", detail=True)]
    blocks = [*rows, Table(columns, "keys", first=2), Table(columns, first=0)]
    short = View("title", ["It is so."], blocks).short()
    first, table = short.blocks
    assert first == Row("seen", "1")
    assert isinstance(table, Table)
    assert table.columns == {"key": ["a", "b"]}
    assert table.title == "keys (2 of 3; all: --details)"
    assert terminal_text(short) == "title\nIt is so.\nseen  1\n\nkeys (2 of 3; all: --details):\nkey\na\nb"


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (4.65219e-05, None, "46.52 µm"),
        (4.65219e-05, 1e-12, "46.52 µm"),
        (4.65219e-05, 1.3e-7, "46.52 ± 0.13 µm"),
        (3.59763e-08, 1.34759e-09, "36.0 ± 1.3 nm"),
        (3.0, 41.0, "3 ± 41 m"),
        (None, 1.0, "-"),
    ],
)
def test_a_number_has_the_digits_that_its_error_allows(
    value: float | None, error: float | None, shown: str
) -> None:
    assert TERMINAL.with_error(value, error, "m") == shown


def test_all_digits_are_there_on_demand() -> None:
    assert TERMINAL.text(0.57537617, "") == "0.5754"
    assert EXACT.text(0.57537617, "") == "0.5753762"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("the pad opens", "The pad opens."),
        ("solver.duration: settled", "solver.duration: settled."),
        ("`brakecli branch` says it", "`brakecli branch` says it."),
        ("link2.angle_deg 5 → 6 helps", "link2.angle_deg 5 → 6 helps."),
    ],
)
def test_a_sentence_keeps_the_spelling_of_keys(text: str, shown: str) -> None:
    assert sentence(text) == shown


def test_a_stop_is_headed_by_what_happens() -> None:
    """Where speed or load change nothing settles: the intervals in which it vibrates are the answer."""
    interval = {"start": 0.0, "end": 3.015, "frequency": 173.8, "amplitude": 1.83e-4, "speed": 3.22}
    numbers = {"regime": "undecided", "reasons": ["the speed changes"], "vibrations": [interval]}
    stands = {**numbers, "evidence": {"wheel_stands": 1}}
    said = "It vibrates from 0 to 3.015 s (173.8 Hz, 183 µm, most at 3.22 m/s)"
    assert motion_sentence(numbers, TERMINAL) == f"{said}."
    assert motion_sentence(stands, TERMINAL) == f"{said}, then rests."
    twice = motion_sentence({**stands, "vibrations": [interval, {**interval, "start": 4.0, "end": 5.0}]}, TERMINAL)
    assert len(re.findall(r"from \d", twice)) == 2
    many = motion_sentence({**stands, "vibrations": [interval] * 7}, TERMINAL)
    assert many.endswith(", and in 4 more intervals, then rests.")


@pytest.mark.parametrize(
    ("share", "said"), [(0.0, "without stick (quasi-"), (6.8e-4, "without stick in most cycles (quasi-")]
)
def test_no_vibration_that_sticks_is_said_to_be_without_stick(share: float, said: str) -> None:
    reasons = ["the vibration lasts, with stick in 17% of the cycles"]
    numbers = {"regime": "quasi-harmonic", "excitation": "self-excited", "stick_fraction": share}
    assert said in motion_sentence({**numbers, "reasons": reasons}, TERMINAL)
