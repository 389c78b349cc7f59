"""Runs in lanes are those that are computed alone, whoever is beside them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.case.system import system_of
from brakecli.solver.ensemble import LANES, LEFT, fits, run_together
from brakecli.solver.motion import Motion, solve
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
    return replace(found, method=method)


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


@pytest.mark.parametrize("lanes", counts(20, 800))
def test_a_lane_gives_the_run_that_is_computed_alone(lanes: int) -> None:
    """To rounding where the iteration leaves no more than that; to a part of the tolerance otherwise.

    What it leaves, `LEFT` of the tolerance, is a force that may act in every step, always at one sign. The few
    periods of such a run then add up to no more than some tens of it.
    """
    rng = np.random.default_rng(5)
    sharp = [drawn(rng, tolerance=1e-9) for _ in range(lanes)]  # 1e-13 of the load
    loose = [replace(each, method=replace(each.method, tolerance=1e-3)) for each in sharp]
    compared = partly = 0
    for each, exact, rough in zip(sharp, run_together(sharp), run_together(loose), strict=True):
        alone = solve(each)
        if exact is None or rough is None:
            assert alone.work.turns or alone.work.failed
            continue
        assert apart(exact, alone) <= 1e-9
        assert apart(rough, alone) <= 50.0 * LEFT * 1e-3
        for column in range(4, 8):  # forces, the part that touches, the state
            assert exact.rows[:, column] == pytest.approx(alone.rows[:, column], rel=1e-6, abs=1e-3 * (column < 6))
        assert (exact.work.steps, exact.work.turns) == (alone.work.steps, 0)
        assert exact.work.evaluators == alone.work.evaluators
        compared += 1
        partly += alone.work.evaluators.get("midpoint", 0) > 100
    assert compared > 0.7 * lanes
    assert partly > 0.3 * compared


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


def test_fewer_waves_and_a_smooth_shoe_are_the_same_in_a_lane() -> None:
    waves = {"amplitudes": [3e-5], "wavelengths": [0.023], "phases_deg": [40.0]}
    one = system(tolerance=1e-9, roughness__wheel=waves, roughness__shoe=None, initial__at="equilibrium")
    (found,), alone = run_together([one]), solve(one)
    assert found is not None
    assert apart(found, alone) <= 1e-9


@pytest.mark.parametrize(
    "changes",
    [
        {"wheel__angular_speed": 0.02},  # sticks
        {"initial__vy": 1e40},  # blows up
        {"link1__stiffness": 1e12, "step": 1e-4},  # the iteration contracts too little
    ],
)
def test_what_a_lane_cannot_compute_leaves_it(changes: dict[str, Any]) -> None:
    alone, beside = system(**changes), system(step=changes.get("step", 2e-5))
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


@pytest.mark.parametrize("changes", [{"evaluator": "midpoint"}, {"theta": QUARTERS}, {"iteration": "fixed-point"}])
def test_a_lane_keeps_to_the_method_that_is_asked_for(changes: dict[str, Any]) -> None:
    asked = system()
    assert fits(replace(asked, method=replace(asked.method, **changes))) is None
