"""The cycle that a motion comes to in the end, from which a branch may begin."""

import math

import numpy as np

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.newton import start
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array
from brakecli.analysis.fate import fate_on_smooth_pads
from brakecli.solver.motion.events import DONE

SETTLE = 400
SEEN = 8
"""Periods of the mode for which a motion of a rough shoe is left to itself, and in which returns are sought."""
LOOKS = 60
SOONEST = 12
"""Places of a period at which the motion is looked at, and after how many it may have returned."""
PARTS = 4
"""Parts of a period that a motion left to itself is carried at a time, and places whose return is sought."""
RETURNS = 0.25
"""Distance, in sizes of the motion, of a state from an earlier one that may be the same."""
TRIES = 12
"""Pairs of states from which Newton's method is begun."""
CLEAR = 0.05
"""Part of the wheel's speed by which a first state has to slide: one that sticks is no place of a section."""
WHOLE = 0.3
"""Part of the size that was seen which a cycle has at least: a smaller one is another."""
AT_REST = 1e-3
"""Size of a motion, over the compression of the pad, below which it has died out."""


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
    states = [np.array(state, float)]
    for k in range(SETTLE * PARTS + SEEN * LOOKS):
        if flow(states[-1], period * (1.0 / PARTS if k < SETTLE * PARTS else 1.0 / LOOKS), False) != DONE:
            return None
        states = [flow.state] if k < SETTLE * PARTS else [*states, flow.state]
    samples = np.array(states)
    size = 0.5 * float(np.ptp(samples[:, :2], axis=0).max())
    if not size > AT_REST * abs(equilibrium[1]):
        return None
    omega = 2.0 * math.pi * frequency
    scales = size * np.array([1.0, 1.0, omega, omega])
    x = 0.5 * float(np.ptp(samples[:, 0]))
    belt = problem.line.shoe(p).belt
    places = [k for k in range(LOOKS) if abs(samples[k, 2] - belt) > CLEAR * abs(belt)]
    tries = 0
    for k in places[:: max(len(places) // PARTS, 1)]:
        away = np.abs((samples - samples[k]) / scales).max(axis=1)
        for j in range(k + SOONEST, len(samples) - 1):
            if not (away[j] < RETURNS and away[j - 1] >= away[j] <= away[j + 1]):
                continue
            tries += 1
            if tries > TRIES:
                return None
            point = _started(problem, p, samples[k], (j - k) / LOOKS * period, scales, period, x)
            if point is not None and point.facts.amplitude > WHOLE * x:
                return point
    return None
