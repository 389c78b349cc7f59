"""The cycle that a motion comes to in the end, from which a branch may begin."""

import math

import numpy as np

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.newton import start
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array
from brakecli.analysis.fate import fate_on_smooth_pads
from brakecli.solver.motion.events import DONE


def settle(problem: Cycles, p: float, state: Array, frequency: float) -> Point | None:
    """The cycle that the motion from a state (x, y, v_x, v_y) comes to at p.

    None where the motion dies out, or where no cycle is found. On rough shoes the cycle is sought among motions
    whose frequency is about as given (Hz).
    """
    if not problem.line.smooth:
        return _returning(problem, p, state, frequency)
    end = fate_on_smooth_pads(problem.line.shoe(p), state)
    flow = problem.flow(p)
    if end.orbit is None:
        return None
    state = np.array(end.orbit.state)
    period = end.orbit.period
    if flow(state, period, False) != DONE:
        return None
    sizes = 0.5 * (flow.path.high - flow.path.low)
    omega = 2.0 * math.pi / period
    scales = float(sizes[:2].max()) * np.array([1.0, 1.0, omega, omega])
    return _started(problem, p, state, period, scales, period, float(sizes[0]))


def _started(
    problem: Cycles, p: float, state: Array, period: float, scales: Array, time: float, x: float
) -> Point | None:
    """The cycle near a state and a period (s), in a chart of these scales, time (s) and size (m)."""
    u = np.append((state - problem.equilibrium(p)) / scales, period / time)
    chart = problem.chart_at(u, p, scales, time, x)
    if chart is None:
        return None
    problem.use(chart)
    return start(problem, u, p)


def _returning(problem: Cycles, p: float, state: Array, frequency: float) -> Point | None:
    """The cycle of a rough shoe whose motion returns to itself."""
    flow = problem.flow(p)
    equilibrium = problem.equilibrium(p)
    period = 1.0 / frequency
    state = np.array(state, float)
    for _ in range(4 * 400):  # periods for which it is left to itself, by quarters
        if flow(state, 0.25 * period, False) != DONE:
            return None
        state = flow.state
    states = [state]
    per_period = 60
    for _ in range(8 * per_period):  # periods in which returns are sought
        if flow(states[-1], period * (1.0 / per_period), False) != DONE:
            return None
        states.append(flow.state)
    samples = np.array(states)
    size = 0.5 * float(np.ptp(samples[:, :2], axis=0).max())
    if not size > 1e-3 * abs(equilibrium[1]):
        return None  # it has died out
    omega = 2.0 * math.pi * frequency
    scales = size * np.array([1.0, 1.0, omega, omega])
    x = 0.5 * float(np.ptp(samples[:, 0]))
    belt = problem.line.shoe(p).belt
    # a state that sticks is no place of a section
    places = [k for k in range(per_period) if abs(samples[k, 2] - belt) > 0.05 * abs(belt)]
    tries = 0
    for k in places[:: max(len(places) // 4, 1)]:
        away = np.abs((samples - samples[k]) / scales).max(axis=1)
        for j in range(k + per_period // 5, len(samples) - 1):
            if not (away[j] < 0.25 and away[j - 1] >= away[j] <= away[j + 1]):  # sizes of the motion
                continue
            tries += 1
            if tries > 12:
                return None
            point = _started(problem, p, samples[k], (j - k) / per_period * period, scales, period, x)
            if point is not None and point.facts.amplitude > 0.3 * x:  # a smaller cycle is another one
                return point
    return None
