"""The error that a run in a lane knows: against closed forms, event-driven runs and neighbours."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from brakecli.solver.arrays import Floats
from brakecli.solver.ensemble import filled, run_together, shared
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.lanes.contact import leave_out, touch
from brakecli.solver.lanes.records import LANES, Shared
from brakecli.solver.method import Method
from brakecli.solver.system import System
from brakecli.studies.runs.own_error import Known
from brakecli.studies.runs.together import SAFETY
from tests.campaign import counts
from tests.solver.test_ensemble import drawn, system
from tests.solver.test_ensemble_tangents import TINY, shaken


def knowing(system: System, start_error: tuple[float, float] = (0.0, 0.0), **changes: Any) -> Motion:
    """Its motion in a lane, with its error."""
    method = replace(system.method, **changes)
    (found,) = run_together([replace(system, method=method, tangents=False, start_error=start_error)])
    assert found is not None
    assert found.own is not None
    return found


def true_errors(run: Motion) -> np.ndarray:
    """The largest deviation from an event-driven run, of each component relative to its largest value."""
    exact = solve(replace(run.system, start_error=None), Method("event-driven", tolerance=1e-9)).rows[:, :4]
    return np.asarray(np.abs(run.rows[:, :4] - exact).max(axis=0) / np.abs(exact).max(axis=0))


def evaluate(o: Any, shared: Shared, table: Floats, gaps: Floats) -> None:
    """The contact at `at_x` and `at_y` at t = 0, with what its nodes leave out; interpreted."""
    touch(o, shared, table, gaps, 0.0)
    leave_out(o, gaps, shared.length / shared.nodes)


def gaps(system: System, x: float, y: float) -> Floats:
    """Means over the cells of the pad, m."""
    spacing = 2.0 * system.half_length / system.nodes
    xi = -system.half_length + spacing * (np.arange(system.nodes) + 0.5)
    shoe, wheel = (
        (f.g * np.sinc(f.omega * spacing / (2.0 * np.pi))) @ np.sin(np.outer(f.omega, places) + f.phase[:, None])
        for f, places in ((system.shoe, xi), (system.wheel, xi + x))
    )
    return np.asarray(wheel - shoe - y)


def left_out(gap: Floats) -> float:
    """What the midpoint rule leaves out, in spacings: see `contact.midpoint.left_out`."""
    total = 0.0
    for one, other in pairwise(gap):
        total += (one + other) ** 2 / (8.0 * abs(one - other)) if one * other < 0.0 else 0.0
    for before, middle, after in zip(gap[:-2], gap[1:-1], gap[2:], strict=True):
        bend = before - 2.0 * middle + after
        if min(before * middle, middle * after) > 0.0 and 6.0 * abs(middle) < abs(bend) and bend * middle > 0.0:
            extreme = middle - bend / 24.0 - (after - before) ** 2 / (8.0 * bend)
            total += 4.0 / 3.0 * abs(extreme) * math.sqrt(2.0 * abs(extreme / bend)) * (extreme * middle < 0.0)
    return total


def test_the_nodes_of_a_lane_leave_out_what_their_gaps_say() -> None:
    """Also where the pad opens at its very end, at which there is one neighbour only, and in its middle."""
    each = system(nodes=64)
    rng = np.random.default_rng(11)
    found = list[tuple[float, float]]()
    alike, table, gaps_at_nodes = shared(each)
    spacing = 2.0 * each.half_length / each.nodes
    for _ in range(20):
        o = filled([each] * LANES)
        places = rng.uniform(-0.01, 0.01, LANES)
        for n, x in enumerate(places):
            level = gaps(each, x, 0.0)
            o.at_x[n] = x
            near = level[rng.choice([0, 1, 31, 32, 62, 63])]
            o.at_y[n] = rng.choice([rng.uniform(level.min(), level.max()), near + 1e-12, near - 1e-12])
        evaluate(o, alike, table, gaps_at_nodes)
        for n, x in enumerate(places):
            gap = gaps(each, x, o.at_y[n])
            assert o.at_force[n] == pytest.approx(
                each.layer_stiffness * spacing * gap[gap > 0.0].sum(), rel=1e-9, abs=1e-9
            )
            found.append((o.missing[n], each.layer_stiffness * spacing * left_out(gap)))
    ours, expected = np.transpose(found)
    assert ours == pytest.approx(expected, rel=1e-9, abs=1e-9 * expected.max())
    assert np.count_nonzero(expected) > 0.9 * len(expected)


def test_an_error_of_the_start_grows_as_the_matrix_exponential_says() -> None:
    """In full contact under waves so small that the motion is linear; steps add little beside such a start."""
    each = shaken(1e-5, 0.05, **TINY)
    start = (3e-7, -2e-7)
    run = knowing(each, start)
    a = np.zeros((4, 4))
    c = each.coefficients
    k = each.contact_stiffness
    grip = each.coefficients.phi * np.sign(each.belt_speed)
    a[0, 2] = a[1, 3] = 1.0
    a[2] = -np.array([c.c_xx, c.c_xy + grip * k, c.b_xx, c.b_xy]) / c.m
    a[3] = -np.array([c.c_xy, c.c_yy + k, c.b_xy, c.b_yy]) / c.m
    step = expm(a * each.step)
    e = np.array([*start, 0.0, 0.0])
    exact = []
    for _ in range(each.steps):
        exact.append(np.abs(e))
        e = step @ e
    assert run.own is not None
    assert run.own.worst[0, 0] == pytest.approx(np.max(exact, axis=0), rel=0.01)
    assert run.own.worst[0, 1].max() == 0.0


@pytest.mark.parametrize("many", counts(3, 60))
@pytest.mark.parametrize(("step", "nodes"), [(2.5e-4, 4096), (1.25e-4, 4096), (2e-5, 256)])
def test_it_is_the_true_one(step: float, nodes: int, many: int) -> None:
    """Of steps where nodes are many, and of nodes where steps are short.

    Errors by steps are taken to fall with h³. Where the pad does not open they fall with h⁴: 15/7 times too much.
    `SAFETY` times it is promised, so that it has to be more than so small a part of the true one.
    """
    rng = np.random.default_rng(21)
    ratios = list[float]()
    for _ in range(many):
        each = drawn(rng, step=step, solver__duration=0.05, output__sample_interval=2.5e-4)
        method = replace(each.method, nodes=nodes)
        (run,) = run_together([replace(each, method=method, start_error=(0.0, 0.0))])
        if run is None:
            continue
        steps, by_nodes, both = Known.of_run(run).of.max(axis=0).tolist()
        ratios.append(both / float(true_errors(run).max()))
        if (run.rows[:, 6] < 1.0).mean() > 0.1:
            assert (by_nodes > 5.0 * steps) if nodes == 256 else (steps > by_nodes)
    assert len(ratios) > 0.6 * many
    assert min(ratios) > 1.0 / SAFETY
    assert max(ratios) < 7.0
    assert 0.8 < float(np.median(ratios)) < 2.3


def test_it_does_not_depend_on_the_lanes_beside_it() -> None:
    rng = np.random.default_rng(6)
    strangers = [drawn(rng, solver__duration=0.1) for _ in range(LANES + 5)]
    strangers[3] = system(initial__vy=1e40, solver__duration=0.1)  # leaves its lane at once
    strangers = [replace(each, start_error=(1e-12, 1e-12)) for each in strangers]
    together = run_together(strangers)
    compared = 0
    for order in (range(LANES + 4, -1, -1), [5], [7, 3, 7]):
        for place, found in zip(order, run_together([strangers[i] for i in order]), strict=True):
            before = together[place]
            if before is not None and found is not None:
                assert before.own is not None
                assert found.own is not None
                assert found.own.worst.tobytes() == before.own.worst.tobytes()
                assert found.own.unsure == before.own.unsure
                compared += 1
    assert compared > LANES


def test_a_motion_that_nearly_sticks_may_have_stuck() -> None:
    """Its sliding velocity comes to nearly nothing: a dip between two steps may hide a stick."""
    each = shaken(5e-5, 0.05, **TINY)
    known = {}
    free = each.coefficients._replace(phi=0.0, b_xx=0.0, b_xy=0.0, b_yy=0.0, c_xy=0.0)
    for part in (0.5, 0.9999):  # of the wheel's speed, which vx comes to again in every cycle
        initial = replace(each.initial, vx=part * each.belt_speed)
        run = knowing(replace(each, coefficients=free, initial=initial))
        assert run.own is not None
        known[part] = run.own.unsure
    assert known == {0.5: math.inf, 0.9999: 0.0}


def test_an_error_that_overflows_is_no_promise() -> None:
    """A start that is off by so much that its square has no number."""
    run = knowing(shaken(5e-5, 0.05, **TINY), (1e308, 1e308))
    assert run.own is not None
    assert math.isinf(run.own.worst[0, 2].max())
    assert Known.of_run(run).until(1e-3, 0.05) == 0.0
