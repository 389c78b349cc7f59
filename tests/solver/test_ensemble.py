"""Runs in lanes have the motion that event-driven runs find on the same nodes, whoever is beside them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.case.system import system_of
from brakecli.solver.ensemble import LEFT, fits, run_together
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.lanes.records import LANES
from brakecli.solver.method import Method
from brakecli.solver.schemes import NUMEROV, QUARTERS
from brakecli.solver.system import System
from tests.campaign import counts
from tests.examples import ROUGH, make

PROMISED: dict[str, Any] = ROUGH | {"solver": {"tolerance": 1e-3, "duration": 0.02}}


def system(step: float = 2e-5, nodes: int = 128, tolerance: float = 1e-3, **changes: Any) -> System:
    """A rough pad that opens in part, with the method of a ladder's rung."""
    found = system_of(make(PROMISED, **changes))
    method = replace(
        found.method, scheme="three-layer", theta=NUMEROV, step=step, nodes=nodes, tolerance=tolerance
    )
    return replace(found, method=replace(method, evaluator="midpoint"))


def drawn(rng: np.random.Generator, **more: Any) -> System:
    """A random shoe on these surfaces, either way round, sometimes away from rest."""
    return system(
        shoe__mass=rng.uniform(5.0, 15.0),
        wheel__angular_speed=rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 10.0),
        link1__stiffness=10.0 ** rng.uniform(6.5, 7.5),
        link2__damping=10.0 ** rng.uniform(1.0, 3.0),
        link2__angle_deg=rng.uniform(-20.0, 40.0),
        load__force=rng.uniform(500.0, 6000.0),
        friction__coefficient=rng.uniform(0.0, 0.5),
        contact__stiffness=10.0 ** rng.uniform(7.0, 8.0),
        initial__y=rng.choice([0.0, rng.uniform(-1e-4, 1e-4)]),
        initial__vx=rng.uniform(-0.1, 0.1),
        **more,
    )


def apart(one: Motion, other: Motion) -> float:
    """The largest difference of x, y and the velocities, over the largest value of each."""
    return float((np.abs(one.rows - other.rows).max(axis=0) / np.abs(other.rows).max(axis=0))[:4].max())


def by_events(system: System, tolerance: float) -> Motion:
    """The motion of a system on its nodes, to a local tolerance."""
    return solve(system, Method("event-driven", evaluator="midpoint", nodes=system.nodes, tolerance=tolerance))


@pytest.mark.parametrize("lanes", counts(12, 60))
def test_a_lane_gives_the_motion_on_its_nodes(lanes: int) -> None:
    """To what half a step leaves of the error; the iteration leaves less than 5e-6.

    What it leaves, `LEFT` of the tolerance, is a force that may act in every step, always at one sign.
    """
    rng = np.random.default_rng(5)
    loose = [drawn(rng, tolerance=1e-3) for _ in range(lanes)]
    sharp = [replace(each, method=replace(each.method, tolerance=1e-9)) for each in loose]
    half = [replace(each, method=replace(each.method, step=0.5 * each.step)) for each in sharp]
    runs = zip(sharp, run_together(loose), run_together(sharp), run_together(half), strict=True)
    compared = 0
    partly = 0
    errors = list[list[float]]()
    for each, rough, exact, finer in runs:
        alone = by_events(each, 1e-8)
        if exact is None or rough is None or finer is None:
            assert len(set(alone.rows[:, 7])) > 1 or alone.work.failed
            continue
        assert apart(rough, exact) <= 5.0 * LEFT * 1e-3
        errors.append([apart(exact, alone), apart(finer, alone)])
        for column in range(4, 6):  # forces
            assert exact.rows[:, column] == pytest.approx(alone.rows[:, column], rel=1e-3, abs=1.0)
        assert exact.rows[:, 6] == pytest.approx(alone.rows[:, 6], abs=2.0 / each.nodes)
        assert exact.rows[:, 7].tolist() == alone.rows[:, 7].tolist()
        assert exact.work.steps == each.steps
        compared += 1
        touching = exact.rows[:, 6]
        partly += int(((touching > 0.0) & (touching < 1.0)).mean() > 0.1)
    assert compared > 0.7 * lanes
    assert partly > 0.3 * compared
    assert (np.max(errors, axis=0) <= [5e-5, 1e-5]).all()


def test_a_run_does_not_depend_on_the_lanes_beside_it() -> None:
    rng = np.random.default_rng(6)
    strangers = [drawn(rng) for _ in range(LANES + 5)]
    strangers[3] = system(initial__vy=1e40)  # leaves its lane at once
    together = run_together(strangers)
    assert together[3] is None
    for order in (range(LANES + 4, -1, -1), [5], [7, 3, 7]):
        for place, found in zip(order, run_together([strangers[i] for i in order]), strict=True):
            before = together[place]
            if before is None or found is None:
                assert found is before
                continue
            assert found.rows.tobytes() == before.rows.tobytes()
            assert found.work.contact_evaluations == before.work.contact_evaluations


@pytest.mark.parametrize(
    "changes",
    [
        {"wheel__angular_speed": 0.02},  # sticks
        {"initial__vy": 1e40},  # blows up
        {"link1__stiffness": 1e12, "step": 1e-4},  # the iteration contracts too little
    ],
)
def test_what_a_lane_cannot_compute_leaves_it(changes: dict[str, Any]) -> None:
    alone = system(**changes)
    beside = system(step=changes.get("step", 2e-5))
    assert fits(alone) == fits(beside) is not None
    assert [found is None for found in run_together([alone, beside])] == [True, False]


@pytest.mark.parametrize(
    "changes",
    [
        {"roughness__wheel": None},
        {"initial__vx": 2.0},  # as fast as the wheel
        {"wheel__angular_speed": None, "wheel__times": [0.0, 0.02], "wheel__angular_speeds": [4.0, 5.0]},
        {"roughness__wheel": {"amplitudes": [1e-6] * 6, "wavelengths": [0.01] * 6}},
    ],
)
def test_what_no_lane_can_compute_is_not_tried(changes: dict[str, Any]) -> None:
    assert fits(system(**changes)) is None


@pytest.mark.parametrize("changes", [{"evaluator": "auto"}, {"theta": QUARTERS}, {"iteration": "fixed-point"}])
def test_a_lane_keeps_to_the_method_that_is_asked_for(changes: dict[str, Any]) -> None:
    asked = system()
    assert fits(replace(asked, method=replace(asked.method, **changes))) is None
