"""The only time loop: steps a state, and samples it on a fixed interval whatever the step."""

import math
from typing import NamedTuple

import numpy as np
from numba import float64, int64, types, void
from numpy.typing import NDArray

from brakecli.solver.compile import (
    COEFFICIENTS,
    EVALUATE,
    F_Y,
    FINISH,
    FRACTION,
    KIND,
    NORMAL_FORCE,
    PREPARE,
    RESIDUAL,
    VALID,
    VX,
    VY,
    WEIGHTS,
    X_OLD,
    Y_OLD,
    Coefficients,
    Weights,
    X,
    Y,
    borrowed,
    kernel,
    vector,
)
from brakecli.solver.implicit_step import SOLVE, SOLVED
from brakecli.solver.quantities import ContactState, Failure
from brakecli.solver.roughness import SURFACE, Surface, wheel_angles
from brakecli.solver.schedules import SCHEDULE, Schedule, integral_at, slope_at, value_at


class Drive(NamedTuple):
    """What acts from outside: the speed U of the wheel's surface (m/s), the load Q (N), the wheel's profile."""

    belt: Schedule
    load: Schedule
    wheel: Surface


class Grid(NamedTuple):
    """The grid of time: samples every `interval` s, `per_sample` steps between them.

    `weighted` and `lag` are the scheme's (see `solver.schemes`); `most` bounds the evaluations of one step;
    `go_on` is 1 where steps that did not converge are counted and do not end the run. `samples` is the number of
    the last sample, `tolerance` the error that a scheme with steps of its own keeps.
    """

    interval: float
    per_sample: int
    weighted: float
    lag: int
    most: int
    go_on: int
    samples: int
    tolerance: float


DRIVE = types.NamedTuple([SCHEDULE, SCHEDULE, SURFACE], Drive)
GRID = types.NamedTuple([float64, int64, float64, int64, int64, int64, int64, float64], Grid)

# `counts`: the level reached, and the work so far. KIND_0 + i counts the steps that evaluator i took, TURNS those
# after which the shoe in contact slides the other way, or sticks; steps of a scheme's own are not counted there.
LEVEL, EVALUATIONS, UNCONVERGED, RISING, MOST, TURNS, KIND_0 = range(7)
COUNTS_SIZE = KIND_0 + 3

COLUMNS = 8
EVENTS = 1000
"""How many unconverged steps are kept with their time and residual; all are counted."""

BOUND = 1e15
"""Position (m) and velocity (m/s) beyond which a motion is no motion of a brake."""

# IntEnum members are not known to compiled code, their numbers are.
_BACKWARD, _STICK, _FORWARD, _SEPARATED = (int(state) for state in ContactState)
_NONE, _UNCONVERGED, _DIVERGED, _NOT_CLOSED = (int(failure) for failure in tuple(Failure)[:4])

_matrix = float64[:, ::1]
_counts = int64[::1]


@kernel(
    void(
        types.FunctionType(EVALUATE),
        COEFFICIENTS,
        WEIGHTS,
        DRIVE,
        GRID,
        vector,
        vector,
        vector,
        vector,
        _counts,
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
    """Write the sample that is due at this level: the motion, and the forces at its own time.

    F_y is evaluated at the sample; F_x follows from the slip law, or in stick from (6) with the wheel's
    acceleration. A three-layer scheme's velocity flickers about U in stick by the velocity that friction can
    change in a step: it sticks within that distance, where the force needed lies inside the friction cone.
    """
    t = grid.interval * ((counts[LEVEL] - grid.lag) // grid.per_sample)
    x, y = (state[X], state[Y]) if grid.lag == 0 else (state[X_OLD], state[Y_OLD])
    v_x, v_y, belt = state[VX], state[VY], value_at(drive.belt, t)
    if drive.wheel.g.size > 0:
        travel, travel_low = integral_at(drive.belt, t, 0.0)
        wheel_angles(drive.wheel, travel, travel_low, angles)
    evaluate(x, y, angles, pad, contact)  # type: ignore[operator]
    counts[EVALUATIONS] += 1
    normal = contact[NORMAL_FORCE]
    bound = c.phi * normal
    belt_slope = slope_at(drive.belt, t)
    sliding = v_x - belt
    if abs(sliding) <= 1e-15 * (abs(belt) + abs(belt_slope * t)):  # the step took U at its own rounding of t
        sliding = 0.0
    needed = (
        c.m * belt_slope
        + c.b_xx * belt
        + c.b_xy * v_y
        + c.c_xx * x
        + c.c_xy * y
        + value_at(drive.load, t) * c.sin_beta
    )
    if normal == 0.0:
        side, friction = _SEPARATED, 0.0
    elif abs(sliding) <= grid.lag * s.h * bound / c.m and abs(needed) <= bound:
        side, friction = _STICK, needed
    elif sliding > 0.0 or (sliding == 0.0 and needed < 0.0):
        side, friction = _FORWARD, -bound
    else:
        side, friction = _BACKWARD, bound
    row[0], row[1], row[2], row[3] = x, y, v_x, v_y
    row[4], row[5], row[6], row[7] = friction, normal, contact[FRACTION], side


@kernel(
    int64(
        types.FunctionType(EVALUATE),
        types.FunctionType(PREPARE),
        types.FunctionType(FINISH),
        types.FunctionType(SOLVE),
        COEFFICIENTS,
        WEIGHTS,
        DRIVE,
        GRID,
        vector,
        vector,
        vector,
        vector,
        vector,
        vector,
        _counts,
        _matrix,
        _matrix,
        int64,
    )
)
def advance(
    evaluate: object,
    prepare: object,
    finish: object,
    solve: object,
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
    """Step from level counts[LEVEL] to `stop`, filling `rows` with the samples before each step; a `Failure`.

    A failure leaves the state at the last good level.
    """
    pad, angles, state, problem = borrowed(pad), borrowed(angles), borrowed(state), borrowed(problem)
    contact, work, belt, load_over = borrowed(contact), borrowed(work), drive.belt, drive.load
    row, due = 0, grid.lag % grid.per_sample
    sampled, part = counts[LEVEL] // grid.per_sample, counts[LEVEL] % grid.per_sample
    belt_next = value_at(belt, grid.interval * sampled + part * s.h)
    while counts[LEVEL] < stop:
        if part == due:
            sample(evaluate, c, s, drive, grid, pad, angles, state, contact, counts, rows[row])
            row += 1
        # A level's time is that of the sample before it plus whole steps: no rounding piles up.
        t, t_low = grid.interval * sampled, (part + grid.weighted) * s.h
        belt_now = belt_next
        belt_next = value_at(belt, t + (part + 1) * s.h)
        load = value_at(load_over, t + t_low)
        if drive.wheel.g.size > 0:
            travel, travel_low = integral_at(belt, t, t_low)
            wheel_angles(drive.wheel, travel, travel_low, angles)
        prepare(c, s, state, load, belt_now, belt_next, problem)  # type: ignore[operator]
        outcome, evaluations, rising = solve(evaluate, grid.most, c.phi, angles, pad, problem, contact)  # type: ignore[operator]
        counts[EVALUATIONS] += evaluations
        counts[MOST] = max(counts[MOST], evaluations)
        if rising > 0:
            counts[RISING] += 1
        if outcome != SOLVED:
            if counts[UNCONVERGED] < events.shape[0]:
                events[counts[UNCONVERGED], 0] = t + t_low
                events[counts[UNCONVERGED], 1] = problem[RESIDUAL]
            counts[UNCONVERGED] += 1
            if grid.go_on == 0 or not math.isfinite(problem[F_Y]):
                return _UNCONVERGED
        if contact[VALID] == 0.0:
            return _NOT_CLOSED
        before = state[VX] - belt_now
        finish(c, s, state, load, belt_now, belt_next, problem, contact, work)  # type: ignore[operator]
        if before * (state[VX] - belt_next) <= 0.0 and problem[F_Y] > 0.0:
            counts[TURNS] += 1
        if not abs(state[X]) + abs(state[Y]) + abs(state[VX]) + abs(state[VY]) < BOUND:
            return _DIVERGED
        counts[KIND_0 + int(contact[KIND])] += 1
        counts[LEVEL] += 1
        part += 1
        if part == grid.per_sample:
            sampled, part = sampled + 1, 0
    return _NONE
