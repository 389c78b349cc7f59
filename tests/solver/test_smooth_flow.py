"""The flow on smooth pads: its end, its derivative, its events and its margins."""

from itertools import islice
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from brakecli.case.system import system_of
from brakecli.solver.arrays import Floats
from brakecli.solver.block import MOST_SMOOTH_EVENTS
from brakecli.solver.integrate import solve
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.motion.events import DONE, EVENTFUL
from brakecli.solver.motion.flow import SmoothFlow
from brakecli.solver.phases import BACKWARD, FORWARD, HEIGHT, OPEN, SLIDING, STICK
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System
from tests.analysis.shoes import random_shoes
from tests.campaign import campaign, counts
from tests.examples import ROUGH, make

pytestmark = pytest.mark.usefixtures("compiled")


def shoes(count: int) -> list[tuple[dict[str, Any], System]]:
    """Cases on a turning wheel, and their systems."""
    found = ((tables, system_of(make(tables))) for tables in random_shoes("smooth", 2501))
    return list(islice((each for each in found if each[1].belt_speed != 0.0), count))


def scales_of(system: System) -> Floats:
    """Sizes of x, y, v_x and v_y: the pad's compression, and the wheel's speed."""
    depth = abs(steady_sliding(system).y)
    return np.array([depth, depth, *[abs(system.belt_speed)] * 2])


def drawn(system: System, chance: np.random.Generator) -> tuple[Floats, float]:
    """A state in any phase, and a span of up to two periods."""
    rest = steady_sliding(system)
    state = np.array([rest.x, rest.y, 0.0, 0.0]) + scales_of(system) * chance.normal(0.0, 1.5, 4)
    if chance.random() < 0.3:
        state[2] = system.belt_speed
        state[1] = -abs(state[1])
    return state, chance.uniform(0.05, 2.0) / system.natural_frequencies[0]


@pytest.mark.parametrize("number", counts(5, 100, 1000))
def test_the_derivative_is_that_of_central_differences(number: int) -> None:
    """Differences by 1e-5 of the sizes are off by its square, and by rounding: 1e-16 over 1e-5.

    Where stick begins and ends, the derivative grows with the inverse of how steeply the event is passed. A state
    is left out where a difference changes the sequence of phases, or where halving it tells that it is too large.
    """
    chance = np.random.default_rng(25)
    checked = 0
    seen = set[int]()
    while checked < number:
        for _, system in shoes(50):
            state, span = drawn(system, chance)
            scales = scales_of(system)
            flow = SmoothFlow.of(system)
            if flow(state, span) != DONE:
                continue
            word = flow.word
            exact = flow.derivative * scales / scales[:, None]
            differences = []
            for size in (1e-5, 5e-6):
                columns = []
                for i in range(4):
                    held = state[2] == system.belt_speed and word[0] == STICK and i == 2
                    ends = []
                    for sign in (1.0, -1.0):
                        moved = state.copy()
                        moved[i] += sign * size * scales[i]
                        if not held and (flow(moved, span, False) != DONE or flow.word != word):
                            break
                        ends.append(flow.state if not held else np.zeros(4))
                    if len(ends) < 2:
                        break
                    columns.append((ends[0] - ends[1]) / (2.0 * size * scales))
                if len(columns) == 4:
                    differences.append(np.array(columns).T)
            if len(differences) < 2:
                continue
            free = [i for i in range(4) if not (word[0] == STICK and i == 2)]  # stick cannot be left along ẋ
            largest = np.abs(exact[:, free]).max()
            fine = differences[1][:, free]
            coarse = differences[0][:, free]
            if np.abs(fine - coarse).max() > 2e-6 * largest:
                continue
            np.testing.assert_allclose(fine, exact[:, free], rtol=0.0, atol=1e-6 * largest)
            checked = checked + 1
            seen = seen | set(word)
    assert seen == {BACKWARD, STICK, FORWARD, OPEN}


@pytest.mark.parametrize("number", counts(10, 60))
def test_a_span_ends_where_a_run_of_the_other_scheme_does(number: int) -> None:
    """Both share the automaton, but neither how a phase is followed nor how an event is found."""
    chance = np.random.default_rng(26)
    for tables, system in shoes(number):
        state, span = drawn(system, chance)
        flow = SmoothFlow.of(system)
        scales = scales_of(system)
        if flow(state, span, False) != DONE:
            continue
        x, y, vx, vy = state.tolist()
        changed = tables | {
            "initial": {"at": "rest", "x": x, "y": y, "vx": vx, "vy": vy},
            "solver": {"scheme": "event-driven", "tolerance": 1e-12, "duration": span},
            "output": {"sample_interval": span},
        }
        end = np.array(solve(system_of(make(changed))).rows[-1, :4])
        largest = max(1.0, np.abs(end / scales).max(), np.abs(flow.path.high / scales).max())
        np.testing.assert_allclose(flow.state / scales, end / scales, rtol=0.0, atol=1e-9 * largest)


def test_the_velocity_at_both_ends_is_that_of_the_forces() -> None:
    """Eqs. (6) and (7) in steady sliding, from which nothing moves."""
    _, system = shoes(1)[0]
    rest = steady_sliding(system)
    flow = SmoothFlow.of(system)
    scales = scales_of(system)
    assert flow(np.array([rest.x, rest.y, 0.0, 0.0]), 0.01) == DONE
    omega = 2.0 * np.pi * system.natural_frequencies[1]
    for velocity in (flow.path.start, flow.path.velocity):
        assert np.abs(velocity / scales / omega).max() < 1e-9


def test_least_margins_tell_how_near_a_motion_comes_to_stick_and_to_flight() -> None:
    """A motion of one mode in slip alone: its margins are least where a dense run of the same flow has them."""
    _, system = shoes(1)[0]
    rest = steady_sliding(system)
    flow = SmoothFlow.of(system)
    start = np.array([rest.x + 0.05 * abs(rest.y), rest.y, 0.0, 0.0])
    span = 3.0 / system.natural_frequencies[0]
    assert flow(start, span) == DONE
    (phase,) = flow.word
    least = flow.path.least.copy()
    high = flow.path.high.copy()
    states = []
    for part in np.linspace(0.0, 1.0, 4001)[1:]:
        assert flow(start, part * span, False) == DONE
        states.append(flow.state)
    dense = np.array([start, *states])
    side = phase - STICK
    slides = float((side * (dense[:, 2] - system.belt_speed)).min())
    assert least[phase, HEIGHT] == pytest.approx(-dense[:, 1].max(), rel=1e-3)
    assert least[phase, SLIDING] == pytest.approx(slides, rel=1e-3)
    peak = dense[:, 0].max()
    fastest = 2.0 * np.pi * system.natural_frequencies[1]
    missed = 0.125 * (fastest * span / 4000.0) ** 2 * np.ptp(dense[:, 0])  # by samples half a step beside the peak
    assert peak * (1.0 - 1e-12) <= high[0] <= peak + missed


@campaign
def test_a_motion_of_too_many_events_is_given_up() -> None:
    """Stick-slip at a hundredth of the natural period and less would not end in 60 events."""
    for _, system in shoes(50):
        flow = SmoothFlow.of(system)
        rest = steady_sliding(system)
        start = np.array([rest.x, rest.y, 0.0, 3.0 * abs(rest.y) * 2.0 * np.pi * system.natural_frequencies[1]])
        if flow(start, 1e3 / system.natural_frequencies[0]) == EVENTFUL:
            assert flow.path.events == MOST_SMOOTH_EVENTS
            return
    raise AssertionError


@pytest.mark.parametrize("slope", [0.01, 0.3])
def test_a_margin_that_rises_at_both_ends_may_be_lowest_inside(slope: float) -> None:
    cubic = CubicHermiteSpline([0.0, 1.0], [0.1, 0.12], [slope, 1.5])
    place = max(cubic.derivative().roots())
    assert lowest(0.1, slope, 0.12, 1.5) == pytest.approx((place, float(cubic(place))), rel=1e-12)
    assert lowest(0.1, 1.0, 2.0, 1.0)[0] == -1.0  # it rises all the way


def test_rough_pads_and_changing_speeds_are_refused() -> None:
    with pytest.raises(ValueError, match="smooth pads"):
        SmoothFlow.of(system_of(make(ROUGH)))
