"""The error that a run in a lane knows: against closed forms, event-driven runs and neighbours."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.solver.ensemble import run_together
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.lanes.records import LANES
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


@pytest.mark.parametrize("many", counts(3, 20))
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
