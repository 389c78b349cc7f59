"""The event-driven scheme: Runge-Kutta steps of order eight within a phase, and every event located.

Its steps are its own. Each component keeps the tolerance, relative to the largest value that it has had. Stick,
slip, lift-off and touch-down end a step: nothing is smoothed, nothing stepped over.
"""

from typing import Any

import numpy as np
from numba import float64, int64, void
from numpy.typing import NDArray

from brakecli.solver.compile import borrowed, kernel, vector
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.energy import Mechanical, energy_at_level
from brakecli.solver.quantities import ContactState, Failure
from brakecli.solver.records import (
    DRIVE,
    MOTION,
    MOTION_TYPE,
    V_X,
    V_Y,
    Coefficients,
    Drive,
    Pair,
    Plant,
    Weights,
    X,
    Y,
    plant_type,
)
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.schemes.event_driven.dop853 import interpolated
from brakecli.solver.schemes.event_driven.phases import SHOE, Shoe, press, resistance
from brakecli.solver.schemes.event_driven.step import first_step, step

STATE = MOTION
WEIGHTS = 0
LAG = 0
MEMORY = ("x", "y", "v_x", "v_y")
VELOCITIES = ("v_x", "v_y")

_PLANT = plant_type(MOTION)

_BUDGET, _EXACT = 4096, 64
"""Steps of one call, and as how many one counts that finds patches: an interruption need not wait for a sample."""

_NONE = int(Failure.NONE)
_BACKWARD, _STICK, _FORWARD, _SEPARATED = (int(state) for state in ContactState)


def weighted_time(s: Weights) -> float:
    """Steps of other schemes place their forces; this one has none."""
    return 0.0


def order(s: Weights, start: str) -> int:
    """The order of the steps, through all events, on smooth surfaces."""
    return 8


def begin(s: Weights, state: Any, position: Pair, velocity: Pair, acceleration: Pair) -> None:
    """The initial state; the phase is found with the first step."""
    state.x, state.y = position
    state.v_x, state.v_y = velocity


def mechanical_energy(c: Coefficients, s: Weights, state: Any) -> Mechanical:
    """The energies belong to the time reached."""
    return energy_at_level(c, state)


@kernel(void(MOTION_TYPE, vector))
def _write(m: Any, row: NDArray[np.float64]) -> None:
    for column in range(row.size):  # a slice would take seconds to compile
        row[column] = m.row[column]


@kernel(void(SHOE, DRIVE, float64, int64), inlined=False)
def _sample(p: Shoe, drive: Drive, interval: float, level: int) -> None:
    """Put the sample of a level that the motion has reached into the state, with the forces at its time."""
    c, m = p.c, p.motion
    t = interval * level
    travel, travel_low = integral_at(drive.belt, t, 0.0)
    belt, belt_slope = value_at(drive.belt, t), slope_at(drive.belt, t)
    side, touching = m.side, m.touching
    x, y, v_x, v_y = m.x, m.y, m.v_x, m.v_y
    if m.level > level or m.tau > 0.0:
        side, touching = m.side_done, m.touching_done
        theta = ((t - m.time_done) - m.tau_done) / m.step_done
        x, y = interpolated(m, X, theta), interpolated(m, Y, theta)
        v_x, v_y = interpolated(m, V_X, theta), interpolated(m, V_Y, theta)
        if side == 0.0:
            x, v_x = (m.anchor + travel) + (m.anchor_low + travel_low), belt
    passed = (travel - m.travel) + (travel_low - m.travel_low)
    normal = max(press(p, x - passed, y, touching), 0.0)
    bound = c.phi * normal
    against_x, _ = resistance(c, value_at(drive.load, t), x, y, v_x, v_y)
    needed = c.m * belt_slope + against_x  # Eq. (6) in stick
    if normal == 0.0:
        state, friction = _SEPARATED, 0.0
    elif side == 0.0 and abs(needed) <= bound * (1.0 + 1e-12):  # by the rounding of the cone it still sticks
        state, friction = _STICK, needed  # Eq. (4)
    elif side > 0.0 or (side == 0.0 and needed < 0.0):
        state, friction = _FORWARD, -bound  # Eq. (5)
    else:
        state, friction = _BACKWARD, bound  # Eq. (5)
    m.row[0], m.row[1], m.row[2], m.row[3] = x, y, v_x, v_y
    m.row[4], m.row[5], m.row[6], m.row[7] = friction, normal, p.layer.contact.fraction, state


@kernel(void(_PLANT, vector))
def sample(p: Plant, row: NDArray[np.float64]) -> None:
    """Write the sample at the level that has been reached."""
    _write(p.state, row)


@kernel(int64(_PLANT, float64[:, ::1], float64[:, ::1], int64))
def advance(p: Plant, rows: NDArray[np.float64], events: NDArray[np.float64], stop: int) -> int:
    """Step until the sample `stop` is reached, or until the budget of a call is spent; a `Failure`.

    `rows` gets the samples before that of counts.level, which waits in the state; a failure adds it.
    """
    p = borrowed(p)
    m, counts, drive, grid, row, steps = p.state, p.counts, p.drive, p.grid, 0, 0
    shoe = Shoe(p.c, p.layer, m, p.work, counts)
    if m.started == 0:
        first_step(shoe, drive, grid)
        _sample(shoe, drive, grid.interval, 0)
        m.started = 1
    while True:
        while counts.level < stop and counts.level < m.level:
            _write(m, rows[row])
            row += 1
            counts.level += 1
            _sample(shoe, drive, grid.interval, counts.level)
        if counts.level == stop or steps >= _BUDGET:
            return _NONE
        failure = step(shoe, drive, grid)
        steps += 1 if p.layer.contact.kind == CLOSED_FORM else _EXACT
        if failure != _NONE:
            _write(m, rows[row])
            return failure
