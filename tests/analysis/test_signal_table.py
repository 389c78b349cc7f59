"""The table of measured signals: every row decides somewhere, and every threshold moves a verdict."""

import re
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.signals.look import Measurand, Signal, look
from brakecli.analysis.signals.table import ROWS, SignalAnswers, SignalThresholds, decide
from brakecli.results.fields import evidence_unit
from tests.analysis.measured_signals import Array, clipped, measured, stick_slip

SINE = SignalAnswers(
    samples=5000.0,
    heard=True,
    cycles=100.0,
    samples_per_cycle=50.0,
    died_to=1.0,
    hidden=0.01,
    was_loud=True,
    level_change=0.0,
    level_change_error=0.01,
    skewness=0.0,
    events=100.0,
    overtones=0.0,
    beyond_lines=0.0,
    noise_share=0.0,
    plateau=1.0,
    sticks=0.1,
    line_share=1.0,
)
STICK = {"skewness": 2.0, "slips": True, "overtones": 0.1, "beyond_lines": 0.1}
LINES = {"skewness": 0.6, "slips": True, "beyond_lines": 0.1, "overtones": 0.01}

ANSWERS: dict[str, dict[str, Any]] = {
    "few samples": {"samples": 63.0},
    "noise": {"heard": False},
    "few cycles": {"cycles": 9.0},
    "few samples in a cycle": {"samples_per_cycle": 7.0},
    "died out": {"died_to": 0.04},
    "still changes": {"level_change": -0.5},
    "slips or lines": LINES | {"noise_share": 0.02},
    "slips": STICK,
    "stays at the belt's speed": {"plateau": 3.0, "knows_belt": True},
    "stays at one speed": {"plateau": 3.0},
    "reaches the belt's speed": {"reaches": True},
    "irregular": {"line_share": 0.5},
    "lines": {},
}
THRESHOLDS: dict[str, tuple[float, dict[str, Any], str, str]] = {
    "fewest_cycles": (120.0, {}, "lines", "few cycles"),
    "samples_per_cycle": (60.0, {}, "lines", "few samples in a cycle"),
    "negligible": (0.2, {"level_change": 0.3}, "still changes", "lines"),
    "sure_errors": (8.0, {"level_change": 0.3, "level_change_error": 0.05}, "still changes", "lines"),
    "skewness_certain": (0.5, LINES, "lines", "slips"),
    "skewness_lines": (3.0, STICK | {"beyond_lines": 0.0}, "slips", "lines"),
    "overtones": (0.001, LINES, "lines", "slips"),
    "beyond_lines": (0.001, STICK | {"skewness": 1.0, "beyond_lines": 0.002}, "lines", "slips"),
    "plateau": (2.0, {"plateau": 2.4}, "lines", "stays at one speed"),
    "line_share": (0.9, {"line_share": 0.8}, "lines", "irregular"),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_every_row_decides(name: str) -> None:
    assert list(ANSWERS) == [row.name for row in ROWS]
    decision = decide(replace(SINE, **ANSWERS[name]), SignalThresholds())
    assert decision.row == name
    assert "{" not in decision.sentence
    assert "nan" not in decision.sentence


@pytest.mark.parametrize("name", THRESHOLDS)
def test_every_threshold_moves_a_verdict(name: str) -> None:
    assert list(THRESHOLDS) == [each.name for each in fields(SignalThresholds)]
    value, changes, before, after = THRESHOLDS[name]
    answers = replace(SINE, **changes)
    assert decide(answers, SignalThresholds()).row == before
    assert decide(answers, SignalThresholds(**{name: value})).row == after


def test_noise_and_a_level_among_noise_count_as_nothing() -> None:
    assert decide(replace(SINE, died_to=0.1, hidden=0.15), SignalThresholds()).row == "died out"
    assert decide(replace(SINE, died_to=0.01, was_loud=False), SignalThresholds()).row == "lines"
    assert decide(replace(SINE, level_change=0.5, level_change_error=0.2), SignalThresholds()).row == "lines"


TIME = np.arange(5000.0)


def noisy(values: Array, part: float) -> Array:
    disturbed: Array = values + part * values.std() * np.random.default_rng(1).normal(size=len(values))
    return disturbed


SIGNALS: dict[str, tuple[Array, float | None]] = {
    "few samples": (np.sin(TIME[:60]), None),
    "noise": (noisy(np.sin(0.001 * TIME), 100.0), None),
    "few cycles": (np.sin(0.01 * TIME), None),
    "few samples in a cycle": (np.sin(1.2 * TIME), None),
    "died out": (np.exp(-TIME / 500.0) * np.sin(0.3 * TIME), None),
    "still changes": (np.exp(-TIME / 3000.0) * np.sin(0.3 * TIME), None),
    "slips or lines": (noisy(np.cos(0.3 * TIME[:800]) + 0.5 * np.cos(0.6 * TIME[:800]), 0.6), None),
    "slips": (measured(stick_slip(50, 100, 0.1), 50, Measurand.VELOCITY, 40), None),
    "stays at the belt's speed": (clipped(0.1), 1.0),
    "stays at one speed": (clipped(0.1), None),
    "reaches the belt's speed": (noisy(clipped(0.08), 0.03), 1.0),
    "irregular": (np.convolve(np.random.default_rng(2).normal(size=5000), np.hanning(12), "same"), None),
    "lines": (np.sin(0.3 * TIME), None),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_comes_to_every_row(name: str) -> None:
    assert list(SIGNALS) == [row.name for row in ROWS]
    values, belt_speed = SIGNALS[name]
    found = look(Signal(values, 1.0), Measurand.VELOCITY, belt_speed).verdict
    assert found.evidence["row"] == name, found


def test_every_row_and_every_threshold_stands_in_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs" / "measured-signals.md").read_text()
    for row in ROWS:
        assert f"| {row.name} |" in page
    for name, value in vars(SignalThresholds()).items():
        assert f"`{name}` ({value:g})" in page


def test_the_evidence_has_the_units_of_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs" / "measured-signals.md").read_text()
    _, _, evidence = page.partition("## The evidence")
    rows = re.findall(r"^\| (`.*?`) \| ?(.*?) ?\|", evidence, re.M)
    told = {name: unit for names, unit in rows for name in names.split(", ")}
    assert {"`events`", "`samples_per_cycle`", "`noise`"} < {*told}
    for name, unit in told.items():
        if unit in ("1", ""):
            assert evidence_unit(name.strip("`")) == "", name
