"""Motions of twice the period on a shoe whose cycle flips, grazes stick, and flips twice more."""

from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.cycles import changed_phases
from brakecli.analysis.branches.explore import Explorer, crossing
from brakecli.analysis.branches.line import Line
from brakecli.case.case import Case
from brakecli.solver.phases import BACKWARD, FORWARD, OPEN, STICK
from brakecli.studies.runs.branch import branch

pytestmark = pytest.mark.usefixtures("compiled")

TABLES: dict[str, Any] = {
    "shoe": {"mass": 1.7},
    "wheel": {"radius": 0.2, "angular_speed": 0.4328},
    "link1": {"stiffness": 340790.0, "damping": 5.1586, "angle_deg": -2.2099},
    "link2": {"stiffness": 6444240.0, "damping": 4.2004, "angle_deg": 11.5012},
    "load": {"force": 1500.0},
    "friction": {"coefficient": 0.35},
    "contact": {"half_length": 0.03, "stiffness": 5.0e7},
    "solver": {"tolerance": 1e-5, "duration": "settled"},
}
LEAVES = {
    "wheel": {"radius": 0.2, "angular_speed": 2.5},
    "link1": {"stiffness": 2.1e6, "damping": 30.0, "angle_deg": 3.0},
    "link2": {"stiffness": 5.5e6, "damping": 25.0, "angle_deg": 12.0},
}
"""Another shoe, whose cycle loses its stability where it begins to stick."""


def answers_of(tables: dict[str, Any], high: float, pushes: int = 0) -> Answers:
    line = Line(Case.model_validate(tables), ["friction.coefficient"], 0.0, high)
    return Answers(Explorer(line, lambda *_: None).explore(switches=True, pushes=pushes), line.own)


@pytest.fixture(scope="module")
def found() -> Answers:
    return answers_of(TABLES, 1.0, 128)


def test_a_doubled_branch_is_followed_once_between_the_places_where_it_is_born(found: Answers) -> None:
    _, mother, *doubled, _ = found.branches
    assert [each.note[:16] for each in doubled] == ["twice the period"] * 2
    first, second, third = (mark.motion.value for mark in mother.special if mark.kind == "flip")
    (stick,) = [mark.motion.value for mark in mother.special if "stick" in mark.kind and mark.motion.value > first]
    for each, begin, end in zip(doubled, (first, second), (stick, third), strict=True):
        *marks, last = each.special
        assert each.points[0].motion.value == pytest.approx(begin, abs=1e-4)
        assert last.motion.value == pytest.approx(end, abs=1e-6)
        assert last.reason == "it reaches the motion of half its period"
        assert len({round(mark.motion.value, 6) for mark in marks}) == len(marks)


def test_a_doubled_branch_is_no_loss_and_one_vibration_is_named_once(found: Answers) -> None:
    assert "cut" not in found.sentence
    begin = f"{found.coexists_from:.4g}"
    assert found.sentence.count(f"from {begin} on") == 1
    assert ", found in 640 pushes, can exist beside stable sliding" in found.sentence
    assert "another" not in found.sentence


def test_a_branch_that_is_cut_is_named() -> None:
    line = Line(Case.model_validate(TABLES), ["friction.coefficient"], 0.0, 1.0)
    cut = Answers(Explorer(line, lambda *_: None, points=30).explore(), line.own)
    assert "; branch 1 is cut at 0." in cut.sentence


def test_straight_lines_between_the_motions_of_a_file_miss_little() -> None:
    """Two thousandths of the range or of an amplitude, and a part for what neighbours do not tell of a stride."""
    line = Line(Case.model_validate(TABLES | LEAVES), ["friction.coefficient"], 0.0, 1.2)
    explorer = Explorer(line, lambda *_: None)
    (cycle,) = branch(explorer).branches[1:]
    missed = []
    for rows in (explorer.branches[1].points, cycle.points):
        drawn = np.array([(line.place(row.motion.value), np.log(row.motion.amplitude)) for row in rows])
        chords = np.diff(drawn, axis=0)
        lengths = np.maximum((chords**2).sum(axis=1), 1e-30)
        away = []
        for value in np.linspace(0.34, 1.19, 100).tolist():
            (motion,) = crossing(cycle, line.place(value))
            beside = np.array([motion.p, np.log(motion.facts.amplitude)]) - drawn[:-1]
            parts = np.clip((beside * chords).sum(axis=1) / lengths, 0.0, 1.0)
            away.append(np.linalg.norm(beside - parts[:, None] * chords, axis=1).min())
        missed.append(max(away))
    assert missed[0] > 0.01
    assert missed[1] < 0.0025


def test_what_is_said_of_a_border_is_what_begins_or_ends_there() -> None:
    assert changed_phases((BACKWARD,), (BACKWARD, STICK)) == "stick begins"
    assert changed_phases((BACKWARD, STICK, OPEN), (BACKWARD, OPEN)) == "stick ends"
    assert changed_phases((BACKWARD, STICK), (BACKWARD, STICK, OPEN)) == "flight begins"
    assert changed_phases((STICK, FORWARD), (STICK, FORWARD, STICK, BACKWARD)) == "stick once more"
    assert changed_phases((BACKWARD, FORWARD, STICK), (BACKWARD, STICK)) == "slip forwards ends"
    assert changed_phases((BACKWARD, OPEN, STICK), (BACKWARD, STICK, OPEN)) == ""
