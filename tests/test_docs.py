"""The documentation names what files and commands give."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.decision import Thresholds
from brakecli.analysis.stability.report import stability
from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.results import stability_fields as fields
from brakecli.results.field import values_of
from brakecli.results.read import open_result
from brakecli.studies.comparison.compare import compare
from brakecli.studies.comparison.result import ComparisonReport, write
from brakecli.studies.runs.run import run
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.workers.task import compute_units
from brakecli.views.plots.branch import _MARKERS
from tests.campaign import campaign
from tests.commands import ROOT
from tests.studies.sweeps.helpers import inline

REMEDY = "run make tables, which writes what is declared; write the others into the page"


def test_every_name_in_a_result_is_documented(tmp_path: Path) -> None:
    pages = "".join((ROOT / "docs" / page).read_text() for page in ("result-format.md", "regimes.md"))
    run(parse_case(starters()["case"], "starter"), tmp_path / "run.h5", force=False)
    with open_result(tmp_path / "run.h5") as stored:
        names = [*stored.attributes, *stored.variables("history"), *stored.variables("spectrum")]
        for group in ("regime/evidence", "regime/thresholds", "energy", "evaluators", "spectrum"):
            names += stored.group_attributes(group)
    assert len(names) > 70
    assert [name for name in names if f"`{name}`" not in pages] == [], REMEDY


def test_every_name_of_a_sweep_is_documented(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "sweeps.md").read_text()
    (tmp_path / "case.toml").write_text(starters()["case"])
    axis = '[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.5, 0.7]\n'
    critical = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 1.0\nmethod = "eigenvalue"\n'
    for number, text in enumerate((f'{axis}direction = "both"\n', critical)):
        overrides = ["solver.duration=0.05"]
        loaded = parse_sweep(f'case = "case.toml"\n{text}', "sweep.toml", tmp_path, overrides)
        report = inline(loaded, tmp_path / f"{number}.h5", compute_units)
        with open_result(tmp_path / f"{number}.h5", kind="sweep") as stored:
            names = [*stored.attributes, *stored.variables("/"), *report.numbers()]
        shared = (ROOT / "docs" / "result-format.md").read_text()
        assert [name for name in names if f"`{name}`" not in page + shared and "_coefficient" not in name] == [], (
            REMEDY
        )


def test_every_name_of_a_comparison_is_documented(tmp_path: Path) -> None:
    page = "".join((ROOT / "docs" / page).read_text() for page in ("accuracy.md", "result-format.md"))
    loaded = parse_case(starters()["case"], "starter", ["solver.duration=0.01"])
    found = compare(system_of(loaded.case), schemes=["event-driven"], budget=1.0)
    report = ComparisonReport(tmp_path / "r.h5", loaded.case, found, 1e-3)
    write(report.output, loaded, report, force=False)
    numbers = report.numbers()
    with open_result(report.output, kind="comparison") as stored:
        names = [*stored.attributes, *stored.variables("/"), *numbers, *numbers["entries"][0]]
    assert len(set(names)) > 50
    assert [name for name in names if f"`{name}`" not in page] == [], REMEDY


def test_the_tables_of_the_pages_are_those_of_the_declaration() -> None:
    command = [sys.executable, "docs/tables.py", "--check"]
    done = subprocess.run(command, cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert done.stdout + done.stderr == ""
    assert done.returncode == 0


def test_every_threshold_stands_in_the_documentation_with_its_default() -> None:
    page = (ROOT / "docs" / "regimes.md").read_text()
    for name, value in vars(Thresholds()).items():
        assert f"| `{name}` | {value:g} |" in page


def test_every_answer_by_which_a_motion_is_judged_stands_in_the_evidence() -> None:
    page = (ROOT / "docs" / "regimes.md").read_text().partition("## The evidence")[2]
    assert [name for name in Answers._fields if f"`{name}`" not in page] == [], "write them into The evidence"


def test_every_kind_of_special_point_has_a_mark_in_pictures_and_a_row_in_the_page() -> None:
    page = (ROOT / "docs" / "branches.md").read_text().partition("## Which special points")[2]
    kinds = re.findall(r"^\| `([^`]+)`", page.partition("\n## ")[0], re.MULTILINE)
    assert {*kinds} == {*_MARKERS}, "add it to _MARKERS or to the table of kinds, where it is missing"


@campaign
def test_every_example_of_the_regimes_has_the_verdict_in_its_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")  # where `make regime-pictures` finds it
    pictures = importlib.import_module("regime_pictures")
    for example in (*pictures.SMOOTH, *pictures.ROUGH, *pictures.LOOKS):
        shown, _ = pictures.both(example._replace(after=0.0))  # ends where another row has decided
        assert ("level: " in pictures.answers(shown.numbers)) is ("level_change" in shown.numbers["evidence"])


def test_every_name_of_stability_is_documented() -> None:
    page = (ROOT / "docs" / "stability.md").read_text()
    report = stability(system_of(parse_case(starters()["case"], "starter").case))
    numbers = values_of(fields.STABILITY, report)
    objects = (numbers["discrete"], numbers["equilibrium"], numbers["modes"][0], numbers["crossings"][0])
    names = [*numbers, *(name for each in objects for name in each)]
    assert len(names) > 30
    assert [name for name in names if f"`{name}`" not in page] == [], REMEDY
