"""The event-driven scheme: Runge-Kutta steps of order eight within a phase, and every event located.

Its steps are its own. Each component keeps the tolerance, relative to the largest value that it has had. Stick,
slip, lift-off and touch-down end a step: nothing is smoothed, nothing stepped over.
"""

import numpy as np
from numba import float64, int64, types, void
from numpy.typing import NDArray

from brakecli.solver.compile import (
    COEFFICIENTS,
    EVALUATE,
    FRACTION,
    KIND,
    VX,
    VY,
    Coefficients,
    Weights,
    X,
    Y,
    borrowed,
    kernel,
    vector,
)
from brakecli.solver.compile import WEIGHTS as WEIGHTS_TYPE
from brakecli.solver.loop import COLUMNS, DRIVE, GRID, LEVEL, Drive, Grid
from brakecli.solver.quantities import ContactState, Failure
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.schemes.event_driven.dop853 import interpolated
from brakecli.solver.schemes.event_driven.phases import (
    ANCHOR,
    ANCHOR_LOW,
    BEGIN,
    LEVEL_AT,
    MEMORY_SIZE,
    PLANT,
    POWER,
    ROW,
    SIDE,
    SIDE_DONE,
    STARTED,
    STEP_DONE,
    TAU,
    TAU_DONE,
    TIME_DONE,
    TOUCHING,
    TOUCHING_DONE,
    TRAVEL,
    TRAVEL_LOW,
    Plant,
    press,
    resistance,
)
from brakecli.solver.schemes.event_driven.step import first_step, step

WEIGHTS = 0
LAG = 0
MEMORY = (X, Y, VX, VY)
VELOCITIES = (VX, VY)

_BUDGET, _EXACT = 4096, 64
"""Steps of one call, and as how many one counts that finds patches: an interruption need not wait for a sample."""

_NONE = int(Failure.NONE)
_BACKWARD, _STICK, _FORWARD, _SEPARATED = (int(state) for state in ContactState)


def weighted_time(s: Weights) -> float:
    """Steps of other schemes place their forces; this one has none."""
    return 0.0


def order(s: Weights, start: str) -> int:
    """Of the steps, through all events, on smooth surfaces."""
    return 8


def begin(
    s: Weights, position: tuple[float, float], velocity: tuple[float, float], acceleration: tuple[float, float]
) -> NDArray[np.float64]:
    """The initial state; the phase is found with the first step."""
    memory = np.zeros(MEMORY_SIZE)
    memory[[X, Y]], memory[[VX, VY]] = position, velocity
    return memory


def mechanical_energy(
    c: Coefficients, s: Weights, state: NDArray[np.float64]
) -> tuple[float, float, tuple[float, float], float]:
    """Kinetic energy and energy of the links (J), the position and how many sample intervals back they belong."""
    x, y = state[X], state[Y]
    links = 0.5 * (c.c_xx * x * x + 2.0 * c.c_xy * x * y + c.c_yy * y * y)
    return 0.5 * c.m * float(state[VX] ** 2 + state[VY] ** 2), float(links), (x, y), 0.0


@kernel(void(PLANT, DRIVE, float64, int64), inlined=False)
def _sample(p: Plant, drive: Drive, interval: float, level: int) -> None:
    """Put the sample of a level that the motion has reached into the state, with the forces at its time."""
    c, m = p.c, p.memory
    t = interval * level
    travel, travel_low = integral_at(drive.belt, t, 0.0)
    belt, belt_slope = value_at(drive.belt, t), slope_at(drive.belt, t)
    side, touching = m[SIDE], m[TOUCHING]
    x, y, v_x, v_y = m[X], m[Y], m[VX], m[VY]
    if m[LEVEL_AT] > level or m[TAU] > 0.0:
        side, touching = m[SIDE_DONE], m[TOUCHING_DONE]
        theta = ((t - m[TIME_DONE]) - m[TAU_DONE]) / m[STEP_DONE]
        x, y = interpolated(m, BEGIN, POWER, X, theta), interpolated(m, BEGIN, POWER, Y, theta)
        v_x, v_y = interpolated(m, BEGIN, POWER, VX, theta), interpolated(m, BEGIN, POWER, VY, theta)
        if side == 0.0:
            x, v_x = (m[ANCHOR] + travel) + (m[ANCHOR_LOW] + travel_low), belt
    passed = (travel - m[TRAVEL]) + (travel_low - m[TRAVEL_LOW])
    normal = max(press(p, x - passed, y, touching), 0.0)
    bound = c.phi * normal
    against_x, _ = resistance(c, value_at(drive.load, t), x, y, v_x, v_y)
    needed = c.m * belt_slope + against_x
    if normal == 0.0:
        state, friction = _SEPARATED, 0.0
    elif side == 0.0 and abs(needed) <= bound * (1.0 + 1e-12):  # by the rounding of the cone it still sticks
        state, friction = _STICK, needed
    elif side > 0.0 or (side == 0.0 and needed < 0.0):
        state, friction = _FORWARD, -bound
    else:
        state, friction = _BACKWARD, bound
    m[ROW], m[ROW + 1], m[ROW + 2], m[ROW + 3] = x, y, v_x, v_y
    m[ROW + 4], m[ROW + 5], m[ROW + 6], m[ROW + 7] = friction, normal, p.contact[FRACTION], state


@kernel(
    void(
        types.FunctionType(EVALUATE),
        COEFFICIENTS,
        WEIGHTS_TYPE,
        DRIVE,
        GRID,
        vector,
        vector,
        vector,
        vector,
        int64[::1],
        vector,
    )
)
def sample(
    evaluate: object,
    c: Coefficients,
    s: Weights,
    drive: Drive,
    grid: Grid,
    pad: NDArray[np.float64],
    angles: NDArray[np.float64],
    state: NDArray[np.float64],
    contact: NDArray[np.float64],
    counts: NDArray[np.int64],
    row: NDArray[np.float64],
) -> None:
    """Write the sample at the level that has been reached."""
    for column in range(COLUMNS):  # a slice would take seconds to compile
        row[column] = state[ROW + column]


@kernel(
    int64(
        types.FunctionType(EVALUATE),
        COEFFICIENTS,
        WEIGHTS_TYPE,
        DRIVE,
        GRID,
        vector,
        vector,
        vector,
        vector,
        vector,
        vector,
        int64[::1],
        float64[:, ::1],
        float64[:, ::1],
        int64,
    )
)
def advance(
    evaluate: object,
    c: Coefficients,
    s: Weights,
    drive: Drive,
    grid: Grid,
    pad: NDArray[np.float64],
    angles: NDArray[np.float64],
    state: NDArray[np.float64],
    problem: NDArray[np.float64],
    contact: NDArray[np.float64],
    work: NDArray[np.float64],
    counts: NDArray[np.int64],
    rows: NDArray[np.float64],
    events: NDArray[np.float64],
    stop: int,
) -> int:
    """Step until the sample `stop` is reached, or until the budget of a call is spent; a `Failure`.

    `rows` gets the samples before that of counts[LEVEL], which waits in the state; a failure adds it.
    """
    m, row, steps = borrowed(state), 0, 0
    p = Plant(evaluate, c, borrowed(pad), borrowed(angles), m, borrowed(contact), borrowed(counts))
    if m[STARTED] == 0.0:
        first_step(p, drive, grid)
        _sample(p, drive, grid.interval, 0)
        m[STARTED] = 1.0
    while True:
        while counts[LEVEL] < stop and counts[LEVEL] < m[LEVEL_AT]:
            for column in range(COLUMNS):
                rows[row, column] = m[ROW + column]
            row += 1
            counts[LEVEL] += 1
            _sample(p, drive, grid.interval, counts[LEVEL])
        if counts[LEVEL] == stop or steps >= _BUDGET:
            return _NONE
        failure = step(p, drive, grid, borrowed(work))
        steps += 1 if p.contact[KIND] == 0.0 else _EXACT
        if failure != _NONE:
            for column in range(COLUMNS):
                rows[row, column] = m[ROW + column]
            return failure
