"""`advise`, as its users meet it."""

import signal
import time
from pathlib import Path

import pytest

from brakecli.analysis.stability.advice import KEYS
from brakecli.case.read import parse_case, read_text
from brakecli.studies.runs.advise import advise
from brakecli.views.render import TERMINAL
from brakecli.views.stability import of_advice
from brakecli.views.terminal import terminal_text
from tests.campaign import campaign
from tests.cli.test_interrupted import interrupt, many_waves
from tests.commands import ROOT, brakecli, each, left_in, started

CASES = {name: str(ROOT / "cases" / f"{name}.toml") for name in ("relaxation", "damped", "rough-partly-open")}
SHORT = ["--set", "solver.duration=0.1"]

pytestmark = pytest.mark.usefixtures("compiled")


def test_json_has_the_names_of_the_page_and_the_advised_value_keeps_its_promise(tmp_path: Path) -> None:
    line = ["advise", CASES["relaxation"], *SHORT, "--json", "--keys", "link2.angle_deg,shoe.*", "--margin", "0.1"]
    numbers = brakecli(*line, cwd=tmp_path).json
    assert numbers["critical_friction"] == pytest.approx(0.5753762, abs=1e-7)
    assert numbers["friction_coefficient"] == 0.7
    assert numbers["margin"] == pytest.approx(0.5753762 / 0.7 - 1.0, abs=1e-6)
    assert numbers["conclusion"].startswith(
        "squeals at 174.3 Hz; sliding loses its stability from a friction coefficient of 0.575 on, 18 % below the"
        " case's 0.7; "
    )
    by_key = {each["parameter"]: each for each in numbers["sensitivities"]}
    assert set(by_key["link2.angle_deg"]) >= {"parameter", "value", "elasticity", "derivative"}
    assert by_key["link1.angle_deg"]["elasticity"] is None
    assert by_key["link1.angle_deg"]["derivative"] < 0.0
    best, other = numbers["advice"]
    assert [best["parameter"], other["parameter"]] == ["link2.angle_deg", "shoe.mass"]
    assert best["from"] == 5.0
    assert best["critical_friction"] == pytest.approx(0.77, rel=1e-9)
    assert numbers["check"]["regime"] == "damped"
    again = ["stability", CASES["relaxation"], "--set", f"link2.angle_deg={best['to']!r}", "--json"]
    assert brakecli(*again, cwd=tmp_path).json["critical_friction"] == pytest.approx(best["critical_friction"])
    page = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    names = [*list(numbers)[1:], *best, *by_key["shoe.mass"], *numbers["check"]]
    assert [name for name in names if f"`{name}`" not in page] == []


def test_what_takes_long_is_left_out_where_no_more_is_wanted_and_the_run_that_checks_is_short() -> None:
    loaded = parse_case(*read_text(CASES["relaxation"]), ["solver={duration=1e7}"])
    less = advise(loaded, KEYS, 0.2, lambda what, done, total: None, most=-1.0)
    left_out = "what to change is left out, as it takes long here: `brakecli advise` asks it"
    assert less.notes() == ["of the load of 5000 N, 825 N press the shoe on; the links carry the rest", left_out]
    assert (less.sensitivities, less.advice, less.check) == ([], [], None)
    assert less.critical_friction == pytest.approx(0.5753762, abs=1e-7)
    check = advise(loaded, ["shoe.mass"], 0.2, lambda what, done, total: None).check
    assert check is not None
    assert check.duration < 1000.0


def test_the_table_fits_into_eighty_columns_and_ends_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    loaded = parse_case(*read_text(CASES["relaxation"]), ["solver.duration=0.1"])
    report = advise(loaded, KEYS, 0.2, lambda what, done, total: None)
    table = terminal_text(of_advice(report, TERMINAL), details=True)
    assert max(map(len, table.splitlines())) <= 80
    for words in (
        "link2.angle_deg 5 7.692 0.84 89.99 damped",
        "Confirmed by a run, smallest ratio (or rad) first: what helps",
        "No help within bounds: no help from none in load.force 5000 500 to 5e+04",
    ):
        assert words in " ".join(table.split())
    assert "\nSqueals at 174.3 Hz; sliding loses its stability" in table
    assert "\nchecked by a run   link2.angle_deg = 7.692, " in table
    short = terminal_text(of_advice(report, TERMINAL)).splitlines()
    assert len(short) <= 12
    assert "note  of the load of 5000 N, 825 N press the shoe on; the links carry the rest" in short
    assert any(line.endswith("--details):") for line in short)
    assert "(2 of 8; all: --details):" in " ".join(short)  # the load does not help, and is none of them


def test_wrong_options_are_told(tmp_path: Path) -> None:
    lines = [["--keys", "shoe.weight"], ["--keys", "solver.step"], ["--margin", "-1"], ["--margin", "x"]]
    words = [
        "--keys shoe.weight: names no number that may be advised; these are shoe.mass, ",
        "--keys solver.step",
    ]
    for word, done in zip(
        [*words, "margin", "margin"],
        each(tmp_path, [["advise", CASES["damped"], *line] for line in lines]),
        strict=True,
    ):
        done.told(2, word)
        assert done.out == ""


@campaign
@pytest.mark.parametrize(
    ("line", "number"),
    [
        (["advise", "waves.toml", "--quiet"], signal.SIGINT),
        (["advise", "waves.toml", "--quiet"], signal.SIGTERM),
        (["stability", CASES["rough-partly-open"], "--vary", "contact.half_length=0.01:0.1:200"], signal.SIGTERM),
        (
            ["stability", CASES["rough-partly-open"], "--vary", "load.force=5e2:5e3:400", "-o", "x.h5"],
            signal.SIGINT,
        ),
    ],
)
def test_a_signal_ends_a_command_soon_and_leaves_nothing(
    tmp_path: Path, line: list[str], number: signal.Signals
) -> None:
    (tmp_path / "waves.toml").write_text(many_waves(300))
    with started(*line, cwd=tmp_path) as process:
        time.sleep(4.0)  # for the imports
        interrupt(process, number)
    assert left_in(tmp_path) == {"waves.toml"}
