"""A scheme and an evaluator of one's own are one file, one row, and one branch each: nothing else has to change.

A copy of the package gets them as CONTRIBUTING says, and is interpreted.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.campaign import campaign
from tests.commands import TINY, environment

ROOT = Path(__file__).parents[2]
ROWS = {
    "solver/contact/__init__.py": (
        '    "exact": Evaluator(',
        '    "spring": Evaluator("brakecli.solver.contact.spring"),\n',
    ),
    "solver/schemes.py": (
        '    "event-driven": Scheme(',
        '    "backward-euler": Scheme("brakecli.solver.steps.backward_euler", (Trial(),),'
        ' unstable="or take another scheme"),\n',
    ),
    "solver/contact/force.py": (
        "    elif layer.evaluator == _EXACT:",
        '    elif layer.evaluator == list(EVALUATORS).index("spring"):\n'
        "        spring.evaluate(x, y, layer, tables, scratch)\n",
    ),
    "solver/steps/step.py": (
        "    else:\n        three_layer.prepare(",
        '    elif p.grid.scheme == list(SCHEMES).index("backward-euler"):\n'
        "        backward_euler.prepare(p.c, p.s, state, problem)\n",
    ),
}


def insert(path: Path, before: str, text: str) -> None:
    contents = path.read_text()
    assert contents.count(before) == 1
    path.write_text(contents.replace(before, text + before))


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package and the two of our own."""
    folder = tmp_path_factory.mktemp("copy")
    package = shutil.copytree(ROOT / "brakecli", folder / "brakecli", ignore=shutil.ignore_patterns("__pycache__"))
    here = Path(__file__).parent
    shutil.copy(here / "small_evaluator.py", package / "solver/contact/spring.py")
    shutil.copy(here / "small_scheme.py", package / "solver/steps/backward_euler.py")
    for name, (before, text) in ROWS.items():
        insert(package / name, before, text)
    steps = package / "solver/steps/step.py"
    finish = "    else:\n        three_layer.finish("
    insert(
        steps,
        finish,
        '    elif p.grid.scheme == list(SCHEMES).index("backward-euler"):\n'
        "        backward_euler.finish(p.c, p.s, state, problem, contact, work)\n",
    )
    for path, own in ((steps, "backward_euler"), (package / "solver/contact/force.py", "spring")):
        line = f"from brakecli.solver.{path.parent.name} import {own}\n"
        insert(path, "from brakecli.solver.kernels import", line)
    text = TINY.replace("step = 1e-5,", 'scheme = "backward-euler", step = 1e-5,')
    (folder / "same.toml").write_text(TINY.replace("step = 1e-5,", "theta = [1.0, 1.0], step = 1e-5,"))
    (folder / "own.toml").write_text(text.replace("stiffness = 2e7 }", 'stiffness = 2e7, evaluator = "spring" }'))
    return folder


def call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command of the copy."""
    return subprocess.run(
        [sys.executable, "-c", "from brakecli.cli.app import main; main()", *arguments],
        cwd=folder,
        env=environment(NUMBA_DISABLE_JIT="1", PYTHONPATH=str(folder)),
        capture_output=True,
        text=True,
        check=False,
    )


def answer(folder: Path, *arguments: str) -> dict[str, Any]:
    """The JSON of a command of the copy."""
    done = call(folder, *arguments, "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def history(folder: Path, name: str) -> Any:
    """Positions, velocities and forces of a run of the copy, in rows."""
    answer(folder, "run", f"{name}.toml", "-o", f"{name}.h5", "--force")
    names = "x", "y", "vx", "vy", "friction_force", "normal_force"
    with h5py.File(folder / f"{name}.h5") as file:
        return np.array([file[f"history/{each}"][:] for each in names])


@campaign
def test_a_small_scheme_and_a_small_evaluator_go_through_check_run_and_compare_schemes(copy: Path) -> None:
    checked = answer(copy, "check", "own.toml")
    assert checked["evaluator"] == "spring"
    ran = answer(copy, "run", "own.toml", "-o", "own.h5")
    assert (ran["scheme"], ran["evaluators"]) == ("backward-euler", {"spring": 2000})
    assert abs(ran["energy"]["relative_closing_error"]) < 1e-6  # what the scheme takes out is an item of its own
    words = "--schemes", "backward-euler", "--steps", "2e-5,1e-5", "-o", "c.h5"
    entries = answer(copy, "compare-schemes", "own.toml", *words)["entries"]
    assert [entry["scheme"] for entry in entries] == ["backward-euler"] * 2
    assert entries[1]["observed_order"] == pytest.approx(1.0, abs=0.15)


@campaign
def test_the_small_ones_agree_with_those_of_the_solver(copy: Path) -> None:
    """The two-layer scheme with weights of one is backward Euler."""
    own, same = (history(copy, name) for name in ("own", "same"))
    np.testing.assert_allclose(own, same, rtol=0.0, atol=1e-9 * np.abs(same).max())


def test_an_evaluator_on_nodes_is_not_taken_where_a_tolerance_chooses_nodes_itself(
    copy: Path, tmp_path: Path
) -> None:
    shutil.copytree(copy, tmp_path, dirs_exist_ok=True)
    registry = tmp_path / "brakecli/solver/contact/__init__.py"
    row = '"brakecli.solver.contact.spring"'
    registry.write_text(registry.read_text().replace(row, f"{row}, nodes_per_wave=8"))
    overrides = "--set", "solver={tolerance=1e-3, duration=0.02}", "--set", 'contact.evaluator="spring"'
    done = call(tmp_path, "check", "own.toml", *overrides)
    assert done.returncode == 2
    assert "with a tolerance the program chooses them" in done.stderr


def test_a_scheme_that_has_no_row_is_refused_with_those_that_have_one(copy: Path) -> None:
    done = call(copy, "check", "own.toml", "--set", 'solver.scheme="forward-euler"')
    assert done.returncode == 2
    assert '"backward-euler"' in done.stderr
