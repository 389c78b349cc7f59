"""The cycle that a motion comes to: a first point of a branch to which none leads from steady sliding."""

import math

import numpy as np

from brakecli.branches.cycles import Cycles
from brakecli.branches.newton import start
from brakecli.branches.point import Point
from brakecli.branches.problem import Array
from brakecli.solver.flow.smooth import DONE

SETTLE, SEEN = 400, 8
"""Periods of the mode for which a motion is left to itself, and in which its returns are sought."""
LOOKS = 60
"""Places of a period at which the motion is looked at."""
RETURNS = 0.25
"""Distance, in sizes of the motion, of a state from an earlier one that may be the same."""
TRIES = 12
"""Pairs of states from which Newton's method is begun."""
AT_REST = 1e-3
"""Size of a motion, over the compression of the pad, below which it has died out."""


def settled(problem: Cycles, p: float, state: Array, frequency: float) -> Point | None:
    """The cycle that the motion from a state (x, y, v_x, v_y) comes to at p; its frequency is about as given (Hz).

    None where the motion dies out, or where no cycle is found.
    """
    flow, rest, period = problem.flow(p), problem.rest(p), 1.0 / frequency
    state = np.array(state, float)
    states = [state]
    for k in range(SETTLE * 4 + SEEN * LOOKS):
        if flow(states[-1], period * (0.25 if k < SETTLE * 4 else 1.0 / LOOKS), False) != DONE:
            return None
        states = [flow.state] if k < SETTLE * 4 else [*states, flow.state]
    seen = np.array(states)
    size = 0.5 * float(np.ptp(seen[:, :2], axis=0).max())
    if not size > AT_REST * abs(rest[1]):
        return None
    omega = 2.0 * math.pi * frequency
    scales, x = size * np.array([1.0, 1.0, omega, omega]), 0.5 * float(np.ptp(seen[:, 0]))
    belt = problem.line.shoe(p).belt
    places = [k for k in range(LOOKS) if abs(seen[k, 2] - belt) > 0.05 * abs(belt)]
    tries = 0
    for k in places[:: max(len(places) // 4, 1)]:
        away = np.abs((seen - seen[k]) / scales).max(axis=1)
        for j in range(k + LOOKS // 5, len(seen) - 1):
            if not (away[j] < RETURNS and away[j - 1] >= away[j] <= away[j + 1]):
                continue
            tries += 1
            if tries > TRIES:
                return None
            u = np.append((seen[k] - rest) / scales, (j - k) / LOOKS)
            chart = problem.chart_at(u, p, scales, period, x)
            if chart is None:
                continue
            problem.use(chart)
            point = start(problem, u, p)
            if point is not None and point.facts.amplitude > 0.3 * x:
                return point
    return None
