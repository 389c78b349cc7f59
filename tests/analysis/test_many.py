"""Verdicts on many motions at once."""

from typing import Any

import numpy as np
import pytest

from brakecli.analysis.regime import evidence
from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.evidence import Stretch
from brakecli.analysis.regime.measure import Given
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.system import system_of
from brakecli.solver.history import stacked
from brakecli.solver.integrate import solve
from brakecli.studies.runs.judge import in_memory, to_judge
from tests.analysis.histories import history_of
from tests.examples import ROUGH, SQUEAL, make

pytestmark = pytest.mark.usefixtures("compiled")

COARSE: dict[str, Any] = {"solver__step": 2e-5, "contact__nodes": 64}
LOADED = ROUGH | {"load": {"force": 2e4}}
DAMPED = {"link1__damping": 2e4, "link2__damping": 1e4}


def motions() -> list[Given]:
    """Forced ones that are linear, settled or not, at two speeds; pads that open; smooth ones; too short ones."""
    rough = [make(LOADED, **COARSE, friction__coefficient=each) for each in (0.1, 0.2, 0.3, 0.4)]
    rough += [make(LOADED, **COARSE, **DAMPED, friction__coefficient=each) for each in (0.1, 0.2, 0.3)]
    rough += [make(LOADED, **COARSE, **DAMPED, wheel__angular_speed=each) for each in (-4.0, 2.0)]
    rough += [make(ROUGH, **COARSE, load__force=each) for each in (300.0, 600.0)]
    rough += [make(LOADED, **COARSE, **DAMPED, solver__duration=each) for each in (0.005, 0.2)]
    smooth = [make(SQUEAL, friction__coefficient=each) for each in (0.0, 0.3, 0.6, 0.9)]
    systems = [to_judge(system_of(case)) for case in (*rough, *smooth)]
    return [in_memory(solve(each), each) for each in systems]


def bits(found: list[Verdict]) -> list[str]:
    return [*map(repr, found)]


@pytest.mark.parametrize("in_full", [True, False])
def test_no_bit_of_a_verdict_depends_on_the_others(in_full: bool) -> None:
    given = motions()
    found = [each for one in given for each in classify([one], in_full=in_full)]
    rows = {(each.evidence["row"], each.settled) for each in found}
    assert {("linear, forced", True), ("linear, forced", False), ("forced, level", False)} <= rows
    assert {row for row, _ in rows} >= {"few samples", "linear, decays", "lasts: few cycles"}
    for size in (2, 3, 7, len(given)):
        blocks = [given[first : first + size] for first in range(0, len(given), size)]
        assert bits([each for some in blocks for each in classify(some, in_full=in_full)]) == bits(found)
    assert bits(classify(given[::-1], in_full=in_full))[::-1] == bits(found)


def test_pieces_of_a_long_history_tell_since_when_something_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the last sample at which it does not, also where that lies in another piece."""
    monkeypatch.setattr(evidence, "LONGEST", 10)
    values = np.zeros((4, 35))
    values[1, 34] = 1.0
    values[2, [3, 12]] = 1.0
    values[3, 29] = 1.0
    whole = Stretch(stacked([history_of(35, x=each) for each in values]), 0, 35)
    assert whole.since("x", lambda x: x == 0.0).tolist() == [0, 35, 13, 30]
    for row, expected in zip(values, (0, 35, 13, 30), strict=True):
        assert Stretch(history_of(35, x=row), 0, 35).since("x", lambda x: x == 0.0) == expected
