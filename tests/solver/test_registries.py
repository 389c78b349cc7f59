"""A scheme and an evaluator of one's own are one file and one row: nothing else has to change."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from brakecli.cli.app import app
from brakecli.errors import CaseError
from brakecli.solver.contact import EVALUATORS, Evaluator
from brakecli.solver.schemes import SCHEMES, Scheme, Trial
from tests.commands import TINY
from tests.examples import SQUEAL, make, simulate

HERE = "tests.solver"


@pytest.fixture(autouse=True)
def rows(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluator = Evaluator(f"{HERE}.small_evaluator")
    monkeypatch.setitem(EVALUATORS, "spring", evaluator)
    scheme = Scheme(f"{HERE}.small_scheme", (Trial(),), colour="#CC79A7", unstable="or take another scheme")
    monkeypatch.setitem(SCHEMES, "backward-euler", scheme)


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    text = TINY.replace("step = 1e-5,", 'scheme = "backward-euler", step = 1e-5,')
    text = text.replace("stiffness = 2e7 }", 'stiffness = 2e7, evaluator = "spring" }')
    (tmp_path / "own.toml").write_text(text)
    return "own.toml"


def answer(*arguments: str) -> dict[str, Any]:
    """The JSON of a command that runs in this process."""
    done = CliRunner().invoke(app, [*arguments, "--json", "--quiet"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_a_small_scheme_and_a_small_evaluator_go_through_check_run_and_compare_schemes(case: str) -> None:
    checked = answer("check", case)
    assert checked["evaluator"] == "spring"
    ran = answer("run", case, "-o", "own.h5")
    assert (ran["scheme"], ran["evaluators"]) == ("backward-euler", {"spring": 2000})
    assert abs(ran["energy"]["relative_closing_error"]) < 1e-6  # what the scheme takes out is an item of its own
    compared = answer("compare-schemes", case, "--schemes", "backward-euler", "--steps", "2e-5,1e-5", "-o", "c.h5")
    entries = compared["entries"]
    assert [entry["scheme"] for entry in entries] == ["backward-euler"] * 2
    assert entries[1]["observed_order"] == pytest.approx(1.0, abs=0.15)


def test_the_small_ones_agree_with_those_of_the_solver(case: str) -> None:
    own = make(SQUEAL, solver__scheme="backward-euler", contact__evaluator="spring")
    same = make(SQUEAL, solver__theta=(1.0, 1.0))  # two-layer with these weights is backward Euler
    one = simulate(own).rows[:, :6]
    other = simulate(same).rows[:, :6]
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9 * np.abs(other).max(axis=0).max())


def test_an_evaluator_on_nodes_is_not_taken_where_a_tolerance_chooses_nodes_itself(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(EVALUATORS, "spring", Evaluator(f"{HERE}.small_evaluator", needs_nodes=True))
    overrides = ("--set", "solver={tolerance=1e-3, duration=0.02}", "--set", 'contact.evaluator="spring"')
    done = CliRunner().invoke(app, ["check", case, *overrides])
    assert isinstance(done.exception, CaseError)
    assert "with a tolerance the program chooses them" in str(done.exception)


def test_a_scheme_that_has_no_row_is_refused_with_those_that_have_one(case: str) -> None:
    done = CliRunner().invoke(app, ["check", case, "--set", 'solver.scheme="forward-euler"'])
    assert done.exit_code != 0
