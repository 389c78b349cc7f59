"""What a terminal of 80 columns shows, what long work says without one, and the starters."""

import os
import pty
import re
import signal
import subprocess
import sys
import time
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from brakecli.api import progress
from brakecli.case.read import parse_case, starters
from brakecli.cli.app import GROUPS
from brakecli.studies.scattering.study import parse_study
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.views.motion import of_verdict
from brakecli.views.render import TERMINAL
from brakecli.views.terminal import grid, terminal_text
from tests.campaign import campaign
from tests.commands import COMMAND, LONG, ROOT, TINY, attributes, brakecli, each, environment, left_in


@pytest.fixture(autouse=True)
def _eighty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def test_each_command_says_in_a_whole_line_what_it_does(tmp_path: Path) -> None:
    shown = brakecli("--help", cwd=tmp_path, COLUMNS="80").out
    groups = re.findall(r"^(Ask|Simulate|Show|Files):\n((?:  .*\n)+)", shown, re.MULTILINE)
    assert [name for name, _ in groups] == ["Ask", "Simulate", "Show", "Files"]
    lines = [line for _, commands in groups for line in commands.splitlines()]
    assert len(lines) == sum(map(len, GROUPS.values()))
    assert [line for line in lines if not re.fullmatch(r"  [a-z-]+ +[A-Z].*\.", line) or line.endswith("..")] == []


def test_no_word_of_a_table_is_broken_and_what_does_not_fit_follows_below() -> None:
    columns = {key: ["1", "20000000"] for key in ("friction.coefficient", "wheel.angular_speed")}
    columns |= {
        f"critical {name}, N s/m": ["quasi-harmonic", "0.123456"] for name in ("eigenvalue", "error", "bias")
    }
    shown = grid(columns | {"sustained status": ["undecided", "found"]}, 2)
    assert max(map(len, shown.splitlines())) <= 80
    first, second = (block.split() for block in shown.split("\n\n"))
    keys = {"friction.", "coefficient", "wheel.", "angular_speed"}
    assert keys <= {*first}
    assert {*columns} >= {*second} & {*columns} == {"friction.coefficient", "wheel.angular_speed"}
    assert {"critical", "eigenvalue,", "error,", "quasi-harmonic"} <= {*first}
    assert {"sustained", "status", "undecided", "found"} <= {*second}


def test_a_word_of_more_than_half_a_line_is_folded() -> None:
    path = "/".join(["directory"] * 12)
    lines = grid({"label": ["file", "time of the loop"], "value": [path, "2 s"]}, show_header=False).splitlines()
    assert max(map(len, lines)) <= 80
    assert "".join(line[18:] for line in lines[:-1]) == path
    assert lines[-1] == "time of the loop  2 s"


def test_evidence_has_the_units_of_the_page() -> None:
    page = (ROOT / "docs" / "regimes.md").read_text(encoding="utf-8").partition("## The evidence")[2]
    units = dict(re.findall(r"^\| `(\w+)` \| ([^|]+) \|", page, re.MULTILINE))
    assert len(units) > 25
    numbers: dict[str, Any] = dict.fromkeys(("frequency", "amplitude", "stick_fraction", "contact_loss_fraction"))
    numbers |= {
        "regime": "damped",
        "excitation": "none",
        "reasons": ["so it is"],
        "evidence": dict.fromkeys(units, 2.5),
    }
    numbers["evidence"]["line_frequencies"] = [100.0, 200.0]
    shown = evidence(numbers)
    assert shown["line frequencies"] == "100 Hz, 200 Hz"
    for name, unit in units.items():
        if name != "line_frequencies":
            assert shown[name.replace("_", " ")] == f"2.5 {'' if unit == '1' else unit}".rstrip(), name


def evidence(numbers: dict[str, Any]) -> dict[str, str]:
    """The rows of a verdict's evidence on a terminal."""
    text = terminal_text(of_verdict(numbers, "f.h5", TERMINAL), details=True)
    rows = [re.split("  +", line, maxsplit=1) for line in text.splitlines()]
    return {row[0]: row[1] for row in rows if len(row) == 2}


def test_the_noise_of_an_acceleration_is_that_of_the_velocity_by_which_it_is_judged() -> None:
    for measured, unit in (("m", "m"), ("m/s", "m/s"), ("m/s²", "m/s"), ("N", "N"), ("of full scale",) * 2):
        numbers: dict[str, Any] = dict.fromkeys(
            ("frequency", "amplitude", "stick_fraction", "contact_loss_fraction")
        )
        numbers |= {"regime": "damped", "excitation": "none", "reasons": ["so it is"], "evidence": {"noise": 2.5}}
        assert evidence(numbers | {"unit": measured})["noise"] == f"2.5 {unit}"


def test_a_terminal_gets_messages_without_a_broken_word_and_a_file_gets_them_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = f"sweep-of-angles.toml: {'is-not-readable ' * 12}{'directory/' * 9}"
    progress.say(words)
    assert capsys.readouterr().err == f"brakecli: {words}\n"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    progress.say(words)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(map(str.strip, lines)) == f"brakecli: {words}"
    assert len(lines) > 3
    assert all(len(line) <= 80 or "directory" in line for line in lines)


def test_long_work_without_a_terminal_says_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seconds = iter([0.0, 5.0, 21.0, 30.0, 41.0, 50.0, 99.0, 101.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(seconds, 200.0))
    with progress.telling(False) as tell:
        for done in range(6):
            tell("steps", 10 * done, 100)
        tell("reference", 0, 0)
    said = ["steps 10 of 100, 21 s", "steps 40 of 100, 50 s", "reference, 101 s"]
    assert capsys.readouterr().err.splitlines() == [f"brakecli: {line}" for line in said]
    with progress.telling(True) as tell:
        tell("steps", 1, 2)
    assert capsys.readouterr().err == ""


def test_a_terminal_is_told_of_work_that_says_nothing_itself() -> None:
    """The process waits until its standard input ends, which is when the words were seen."""
    work = "import sys; from brakecli.api.progress import telling\nwith telling(False): sys.stdin.read()"
    terminal, stderr = pty.openpty()
    line = [sys.executable, "-c", work]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stderr=stderr, env=environment(TERM="xterm")) as process:
        os.close(stderr)
        shown = b""
        while b"at work" not in shown:
            shown += os.read(terminal, 1 << 16)
        process.communicate()
    os.close(terminal)
    assert process.returncode == 0


@campaign
def test_a_signal_takes_the_bar_away_and_gives_the_cursor_back(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    terminal, stderr = pty.openpty()
    line = [*COMMAND, "run", "tiny.toml", *LONG]
    shown = b""
    with subprocess.Popen(line, cwd=tmp_path, stderr=stderr, env=environment(TERM="xterm")) as process:
        os.close(stderr)
        with suppress(OSError):  # the end of what a terminal shows
            while more := os.read(terminal, 1 << 16):
                if b"steps" not in shown and b"steps" in more:
                    process.send_signal(signal.SIGINT)
                shown += more
    os.close(terminal)
    assert process.returncode == 130
    hidden, begin, rest = shown.decode().rpartition("\x1b[?25h")
    assert hidden.rpartition("\x1b[?25l")[1]
    assert begin
    assert rest.endswith("\x1b[2Kbrakecli: interrupted; nothing unfinished was left behind\r\n")


def test_the_json_of_a_run_holds_its_case_once_and_all_that_its_file_says_of_versions(good: Path) -> None:
    numbers = brakecli("run", "tiny.toml", "--json", "-o", "json.h5", cwd=good).json
    stored = attributes(good / "json.h5")
    names = ["kind", "title", "resolved_toml", *(name for name in stored if name.endswith("_version"))]
    assert len(names) > 8
    assert "case_toml" not in numbers
    assert [name for name in names if name != "format_version" and numbers[name] != stored[name]] == []


def test_a_tolerance_that_is_set_replaces_what_a_step_needs_but_not_what_is_set_beside_it(tmp_path: Path) -> None:
    text = starters()["case"].replace(
        "tolerance = 1e-4", 'step = 1e-5\ntheta = [1.0, 1.0]\niteration = "fixed-point"'
    )
    text = text.replace('evaluator = "auto"', 'evaluator = "midpoint"')
    case = parse_case(text, "file", ["solver.tolerance=1e-5"]).case
    assert (case.solver.step, case.solver.tolerance, case.solver.theta) == (None, 1e-5, ())
    assert (case.solver.iteration, case.contact.evaluator) == ("newton", "auto")
    for key, kept in (("theta", text), ("evaluator", re.sub("theta.*\niteration.*", "", text))):
        (tmp_path / "both.toml").write_text(kept.replace("step = 1e-5", "tolerance = 1e-5"))
        brakecli("check", "both.toml", cwd=tmp_path).told(2, f"{key}: ")
    (tmp_path / "step.toml").write_text(text)
    beside = ["--set", "solver.tolerance=1e-5", "--set", "solver.theta=[1.0, 1.0]"]
    assert (
        brakecli("check", "step.toml", *beside, cwd=tmp_path).told(2, "solver.theta: is not used").count("\n") == 1
    )


def test_new_lists_a_starter_for_each_kind_of_question_and_writes_it(tmp_path: Path) -> None:
    listed, sweep, again, named = each(
        tmp_path, [["new", "--list"], ["new", "sweep"], ["new", "sweep"], ["new", "map", "-q"]]
    )
    for name, text in starters().items():
        question, *_ = text.splitlines()
        assert question.startswith("# ")
        assert question.endswith("?")
        assert f"\n{name} " in listed.out
        assert question.split()[-1] in listed.out
    assert sweep.out == "sweep.toml and case.toml: written; run it with: brakecli sweep sweep.toml\n"
    again.told(2, "sweep.toml: exists already")
    assert (named.told(0), named.out) == ("", "")
    assert left_in(tmp_path) == {"sweep.toml", "case.toml", "map.toml"}
    for name, text in starters().items():
        if "parameter" in tomllib.loads(text):
            assert parse_study(text, name, tmp_path).study.names
        elif base := tomllib.loads(text).get("case"):
            (tmp_path / base).write_text(starters()[base.removesuffix(".toml")])
            assert parse_sweep(text, name, tmp_path).plan.points > 1
        else:
            assert parse_case(text, name).case.title.startswith("Starter")
