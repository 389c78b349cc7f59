"""Nothing is asked twice: how often a run, a point of a sweep and a comparison ask for what they need."""

import functools
import importlib
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from brakecli.api.inputs import load_case, load_sweep
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.studies.comparison.compare import compare
from brakecli.studies.runs.run import run
from brakecli.studies.sweeps.workers.task import compute_units
from tests.commands import ROOT, TINY
from tests.examples import ROUGH, make

ASKED = {
    "work": ("brakecli.studies.runs.work", "work_of"),
    "limits": ("brakecli.studies.runs.limits", "check"),
    "modes and forced motion": ("brakecli.analysis.stability.linear", "linear_theory"),
    "steady sliding": ("brakecli.solver.steady_sliding", "steady_sliding"),
    "tables of the contact": ("brakecli.solver.contact.pad", "build_pad"),
}

Counts = Counter[tuple[str, int, float | None, int | None]]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Counts:
    """Calls of each function for each system, friction and mean contact, or number of nodes (none: no tables)."""
    counts = Counts()
    kept = list[Any]()

    def counting(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def counted(*given: Any, **options: Any) -> Any:
            kept.append(given)  # so that no other object gets this place in memory
            of = id(given[0]) if function.__name__ != "build_pad" else given[4]
            mean = options.get("mean")
            kept.append(mean)
            counts[name, of, options.get("phi"), id(mean) if mean else None] += of > 0
            return function(*given, **options)

        return counted

    for what, (module, name) in ASKED.items():
        function: Callable[..., Any] = getattr(importlib.import_module(module), name)
        for each in [*sys.modules.values()]:
            if each.__name__.startswith("brakecli") and getattr(each, name, None) is function:
                monkeypatch.setattr(each, name, counting(what, function))
    return counts


@pytest.mark.parametrize(
    ("case", "settings"),
    [
        ("cases/relaxation.toml", ["solver.duration=0.05"]),
        ("cases/rough-partly-open.toml", ["solver={tolerance=1e-3,duration=0.01}", 'contact.evaluator="auto"']),
        ("cases/accuracy/C.toml", ["solver={tolerance=1e-3,duration=0.05}"]),
    ],
)
def test_a_run_asks_once(case: str, settings: list[str], asked: Counts, tmp_path: Path) -> None:
    run(load_case(str(ROOT / case), settings), tmp_path / "r.h5", force=False)
    assert asked
    assert {what for (what, *_), count in asked.items() if count > 1} == set()
    assert sum(count for (what, *_), count in asked.items() if what == "work") == 1
    assert sum(count for (what, *_), count in asked.items() if what == "modes and forced motion") <= 1


def test_a_point_of_a_sweep_asks_once(asked: Counts, tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "s.toml").write_text(
        'case = "tiny.toml"\n[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.3]\n'
    )
    compute_units(load_sweep(str(tmp_path / "s.toml"), None).plan, 0, 1)
    assert asked
    assert {what for (what, *_), count in asked.items() if count > 1} == set()


def test_a_comparison_asks_once(asked: Counts) -> None:
    case: Case = make(ROUGH, solver__duration=0.005)
    compare(system_of(case), schemes=["two-layer"], steps=[1e-5, 5e-6], budget=5.0)
    assert asked
    assert {what for (what, *_), count in asked.items() if count > 1} == set()
