"""A difference scheme that is asked for a tolerance is held against one motion that knows its own error."""

import math
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System
from brakecli.studies.runs import against as room
from brakecli.studies.runs.against import AIM, AIM_OF_NODES, MOST, MOST_RUNS, PART, against, reference_of
from brakecli.studies.runs.judge import motion_of, to_judge
from brakecli.studies.runs.tolerance import certify
from tests.campaign import counts
from tests.examples import ROUGH, SQUEAL, make
from tests.studies.runs.test_tolerance import OPEN, kept, promised

# benchmarks are not type-checked
cases: Any = import_module("benchmarks.statistics.cases")
judging: Any = import_module("benchmarks.statistics.judging")
reference: Any = import_module("benchmarks.statistics.reference")

SECOND_ORDER: tuple[dict[str, Any], ...] = (
    {"scheme": "two-layer", "theta": (0.5, 0.5)},
    {"scheme": "three-layer", "theta": (0.25, 0.5, 0.25)},
    {"scheme": "three-layer", "theta": (0.3, 0.4, 0.3)},
    {"scheme": "three-layer", "theta": NUMEROV},
)
FIRST_ORDER: tuple[dict[str, Any], ...] = (
    {"scheme": "two-layer", "theta": (1.0, 0.5)},
    {"scheme": "two-layer", "theta": (0.6, 0.6)},
    {"scheme": "three-layer", "theta": (0.3, 0.45, 0.25)},
)


def drawn(number: int) -> Any:
    """A random case with one of the schemes; its tolerance is 1e-5 and more, 1e-3 for those of order one."""
    rng = np.random.default_rng((49, number))
    kind = cases.KINDS[number % len(cases.KINDS)]
    slow = rng.uniform() < 0.3
    schemes = FIRST_ORDER if slow else SECOND_ORDER
    tolerance = float(10.0 ** rng.uniform(-3.0 if slow else -5.0, -2.0))
    found = cases.draw(kind, 49, number)
    solver = {**found.tables["solver"], **schemes[rng.integers(len(schemes))], "tolerance": tolerance}
    return replace(found, tolerance=tolerance, tables={**found.tables, "solver": solver})


@pytest.mark.parametrize("many", counts(0, 12))
def test_no_promise_of_a_difference_scheme_is_broken(many: int) -> None:
    """The reference of benchmarks/statistics shares no code with what is judged."""
    judged = [judging.judge(drawn(number), reference.QUICK_SHARE) for number in range(many)]
    assert [str(each) for each in judged if each is None or each.faulty] == []
    assert sum(each.certified for each in judged) > 0.9 * many


@pytest.mark.parametrize("solver", [*SECOND_ORDER, *FIRST_ORDER], ids=str)
def test_all_weights_keep_a_tolerance(solver: dict[str, Any]) -> None:
    rough = promised(OPEN, 1e-2, solver__duration=0.002)
    sticks = promised(SQUEAL, 1e-3, friction__coefficient=0.7, solver__duration=0.05)
    for case, tolerance in ((rough, 1e-2), (sticks, 1e-3)):
        tables = case.model_dump()
        found = certify(system_of(Case.model_validate({**tables, "solver": {**tables["solver"], **solver}})))
        assert found.certificate.certified
        assert kept(found, case, 1e-8) <= tolerance
        assert (found.motion.system.method.scheme, found.motion.system.method.theta) == tuple(solver.values())


def test_the_reference_is_ten_times_better_and_carries_a_disturbance_where_a_verdict_asks_for_it() -> None:
    for base, scheme in ((SQUEAL, "piecewise-exact"), (OPEN, "event-driven")):
        system = system_of(promised(base, 1e-3, solver__scheme="two-layer"))
        beside = reference_of(replace(system, tracked=True, tangents=True))
        assert (beside.method.scheme, beside.method.tolerance) == (scheme, 1e-4)
        assert not beside.tracked
        assert beside.tangents
        assert not reference_of(system).tangents


def runs_of(system: System) -> tuple[list[Motion], Any]:
    """The runs of a difference scheme, and what comes of them."""
    made = list[Motion]()

    def run(rung: System) -> Motion:
        motion = solve(rung)
        made.extend([motion] if rung.method.scheme == system.method.scheme else [])
        return motion

    return made, against(system, certify(reference_of(system)), run)


@pytest.mark.parametrize("solver", [SECOND_ORDER[0], SECOND_ORDER[1], FIRST_ORDER[1]], ids=str)
def test_one_run_tells_the_step_of_the_next_by_the_order_of_the_scheme(solver: dict[str, Any]) -> None:
    """A linear motion: the error falls as the order says, so that the second run is the last one."""
    tolerance = 1e-4 if solver in SECOND_ORDER else 1e-2
    beside = {"initial__at": "equilibrium", "initial__x": 1e-6}
    case = promised(SQUEAL, tolerance, solver__duration=0.02, friction__coefficient=0.3, **beside)
    tables = case.model_dump()
    made, found = runs_of(system_of(Case.model_validate({**tables, "solver": {**tables["solver"], **solver}})))
    assert len(made) == 2
    assert found.certificate.certified
    assert 0.8 * AIM < found.certificate.estimated_error / tolerance < 1.6 * AIM


def test_a_step_becomes_shorter_by_the_order_that_errors_show_where_it_is_less() -> None:
    system = system_of(make(SQUEAL, solver__scheme="two-layer", solver__step=1e-5)).by(step=None, tolerance=1e-4)
    aim = AIM * 1e-4
    tried = room._Tried
    assert room._finer(system, None, tried(1e-5, 9.0 * aim)) == pytest.approx(3.0)
    assert room._finer(system, tried(4e-5, 36.0 * aim), tried(1e-5, 9.0 * aim)) == pytest.approx(9.0)
    assert room._finer(system, tried(4e-5, 0.9), tried(1e-5, 9.0 * aim)) == pytest.approx(3.0)  # says nothing
    assert room._finer(system, None, tried(1e-5, 1e9)) == MOST


def test_a_scheme_gets_as_many_nodes_as_the_reference_says() -> None:
    """The error by nodes falls with their square: that of the run leaves the promise a quarter for them."""
    system = system_of(promised(OPEN, 1e-3, solver__scheme="two-layer", solver__duration=0.004))
    made, found = runs_of(system)
    assert found.certificate.certified
    nodes = made[-1].system.nodes
    assert {each.system.nodes for each in made} == {nodes}
    exact = certify(reference_of(system.by(tolerance=1e-5))).motion.rows[:, :4]
    finest = solve(made[-1].system.by(step=2e-7)).rows[:, :4]
    off = (np.abs(finest - exact).max(axis=0) / np.abs(exact).max(axis=0)).max()
    assert 0.05 * AIM_OF_NODES < off / 1e-3 < 1.1 * AIM_OF_NODES


@pytest.mark.parametrize("scheme", ["two-layer", "three-layer"])
def test_a_motion_that_nobody_knows_to_the_end_is_kept_as_long_as_it_is_known(scheme: str) -> None:
    """Beside an unstable equilibrium rounding grows by e in 0.15 s, and a true shoe never moves."""
    case = promised(SQUEAL, 1e-3, initial__at="equilibrium", friction__coefficient=0.7, solver__duration=3.0)
    system = system_of(case).by(scheme=scheme, theta=(), automatic=False)
    system = system.by(theta=system.method.row.theta)
    known = certify(reference_of(system)).certificate
    assert not known.certified
    made, (motion, found) = runs_of(system)
    assert len(made) == 1  # what nobody knows makes no step finer
    assert not found.certified
    assert found.certified_until == pytest.approx(known.certified_until)
    assert 0.0 < found.certified_until < 2.9
    assert "known up to" in found.sentence()
    rest = steady_sliding(system)
    until = 1 + round(found.certified_until / system.interval)
    away = np.abs(motion.rows[:until, :2] - np.array([rest.x, rest.y])).max(axis=0)
    assert (away <= 1e-3 * np.abs([rest.x, rest.y])).all()


def test_there_are_five_runs_at_most_and_none_that_would_take_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = {"solver__scheme": "two-layer", "solver__theta": (1.0, 1.0), "solver__duration": 0.02}
    case = promised(SQUEAL, 1e-9, **slow)
    monkeypatch.setattr(room, "MOST", 2.0)
    made, found = runs_of(system_of(case))
    assert len(made) == MOST_RUNS
    assert not found.certificate.certified
    assert kept(found, case) == pytest.approx(found.certificate.estimated_error, rel=1e-3)
    assert found.certificate.certified_until < 0.01
    monkeypatch.setattr(room, "MOST_WORK", 0.0)
    made, found = runs_of(system_of(case))
    assert len(made) == 1
    assert not found.certificate.certified
    assert found.motion.work.coarser_steps > 0  # those of the reference


def test_a_run_that_fails_keeps_nothing_and_is_repeated_with_shorter_steps() -> None:
    """A contact that is said to be closed opens, whatever the step."""
    case = promised(OPEN, 1e-2, solver__scheme="two-layer", contact__evaluator="closed-form")
    made, found = runs_of(system_of(case))
    assert len(made) == MOST_RUNS
    assert all(each.work.failed for each in made)
    assert [round(a.system.step / b.system.step, 1) for a, b in pairwise(made)] == [room.FAILED] * (MOST_RUNS - 1)
    assert not found.certificate.certified
    assert found.certificate.certified_until == 0.0
    assert found.certificate.known_error is None
    assert "no bound" in found.certificate.sentence()


def test_part_of_the_reference_steps_and_nodes_leave_some_of_the_promise() -> None:
    assert PART + AIM + AIM_OF_NODES < 1.0


def test_a_difference_scheme_has_the_exponent_of_the_motion_of_the_equations() -> None:
    """It carries none along: the motion from the history's half is asked, with a tolerance the reference."""
    system = to_judge(system_of(make(ROUGH, solver__duration=0.2)))
    assert system.method.scheme == "two-layer"
    assert solve(system).exponent is None
    motion, _ = motion_of(system)
    promised_, _ = motion_of(system.by(step=None, tolerance=1e-3))
    own = solve(system.by(scheme="event-driven", step=None, tolerance=1e-8)).exponent
    for found in (motion.exponent, promised_.exponent):
        assert found is not None
        assert own is not None
        assert abs(found.rate - own.rate) <= 3.0 * math.hypot(found.error, own.error)
    assert motion_of(replace(system, tangents=False))[0].exponent is None
