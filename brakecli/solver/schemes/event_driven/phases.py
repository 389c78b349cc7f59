"""Phases of the motion between two events: what acts on the shoe in each, how long it lasts, what follows.

A phase is a side of the friction law (stick, or slip in one direction) on a pad that may touch or that is clear of
the wheel. Within a phase the forces on a flat pad are smooth: its normal force is continued linearly beyond zero,
and an event ends the phase where it vanishes. On a rough pad patches that appear, merge or vanish make kinks of
the order gap^(3/2) inside a phase; the control of the step finds them.
"""

from typing import NamedTuple

import numpy as np
from numba import float64, int64, types, void
from numpy.typing import NDArray

from brakecli.solver.compile import (
    COEFFICIENTS,
    EVALUATE,
    FRACTION,
    KIND,
    NORMAL_FORCE,
    STATE_SIZE,
    STIFFNESS,
    STORE_X,
    VALID,
    VX,
    VY,
    Coefficients,
    X,
    Y,
    kernel,
    vector,
)
from brakecli.solver.contact.closed_form import FULL, clear, coverage, full_contact
from brakecli.solver.contact.pad import HALF, SHOE_BOTTOM, SHOE_TERMS, SHOE_TOP, WHEEL_BOUND, WHEEL_TERMS, K
from brakecli.solver.double_double import two_sum
from brakecli.solver.loop import DRIVE, EVALUATIONS, Drive
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.schemes.event_driven.dop853 import END_STAGE, POWERS, SIZE, STAGES, interpolated

# `memory`: the state of an event-driven motion. Its first entries are those of `kernels`, the motion reached, at
# which the next step begins.
(
    SIDE,  # sign of the sliding velocity, 0 in stick
    TOUCHING,  # 0 where the pad is clear of the wheel for sure
    STARTED,
    LEVEL_AT,  # number of the sample interval that has been reached
    TIME,  # when it began, s
    TAU,  # time since then, s
    BELT,  # U, its slope (m/s²) and the travel of the wheel, a sum of two doubles
    BELT_SLOPE,
    TRAVEL,
    TRAVEL_LOW,
    LOAD,  # Q and its slope (N/s)
    LOAD_SLOPE,
    ANCHOR,  # x - travel in stick, a sum of two doubles
    ANCHOR_LOW,
    TOLERANCE,
    STEP,  # to try next, s
    SWITCHES,  # changes of phase without a step in between
    EVENTS,  # events without progress
    EVENTS_TIME,  # since then, s
    STEP_DONE,  # the step that the continuous solution belongs to, s,
    TIME_DONE,  # when it began
    TAU_DONE,
    SIDE_DONE,  # and its phase
    TOUCHING_DONE,
    ROW,  # the sample at the level that counts
) = range(STATE_SIZE, STATE_SIZE + 25)
LARGEST = ROW + 8  # of x, y and their velocities so far
BEGIN = LARGEST + SIZE
END = BEGIN + SIZE
SLOPES = END + SIZE
POWER = SLOPES + SIZE * STAGES
WORK_RATES = POWER + SIZE * POWERS
WORKS = 5
MEMORY_SIZE = WORK_RATES + WORKS * STAGES

EPSILON = 2.220446049250313e-16


class Plant(NamedTuple):
    """Everything that a step of an event-driven motion works with."""

    evaluate: object
    c: Coefficients
    pad: NDArray[np.float64]
    angles: NDArray[np.float64]
    memory: NDArray[np.float64]
    contact: NDArray[np.float64]
    counts: NDArray[np.int64]


PLANT = types.NamedTuple(
    [types.FunctionType(EVALUATE), COEFFICIENTS, vector, vector, vector, vector, int64[::1]], Plant
)
_PAIR = types.UniTuple(float64, 2)
_TRIPLE = types.UniTuple(float64, 3)


@kernel(float64(vector))
def full_stiffness(pad: NDArray[np.float64]) -> float:
    """2ak, N/m."""
    return 2.0 * pad[HALF] * pad[K]  # type: ignore[no-any-return]


@kernel(float64(vector))
def clear_height(pad: NDArray[np.float64]) -> float:
    """The height (m) from which on the pad is sure to touch nowhere: 0 on smooth surfaces, as it must be."""
    return pad[WHEEL_BOUND] + pad[SHOE_BOTTOM]  # type: ignore[no-any-return]


@kernel(_PAIR(COEFFICIENTS, float64, float64, float64, float64, float64))
def resistance(c: Coefficients, load: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float]:
    """Forces of links and load against x and y, (6)-(7): what friction and normal force work against."""
    return (
        c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + load * c.sin_beta,
        c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + load * c.cos_beta,
    )


@kernel(_PAIR(PLANT), inlined=False)
def rounding(p: Plant) -> tuple[float, float]:
    """Rounding in the tangential and in the normal balance of forces, N."""
    c, pad, m = p.c, p.pad, p.memory
    x, y, v_x, v_y = abs(m[X]), abs(m[Y]), abs(m[VX]), abs(m[VY])
    load, normal = abs(m[LOAD]), 0.0
    if m[TOUCHING] != 0.0:
        normal = full_stiffness(pad) * (y + pad[WHEEL_BOUND] + max(pad[SHOE_TOP], pad[SHOE_BOTTOM]))
    along = c.b_xx * v_x + abs(c.b_xy) * v_y + c.c_xx * x + abs(c.c_xy) * y + load * abs(c.sin_beta)
    across = abs(c.b_xy) * v_x + c.b_yy * v_y + abs(c.c_xy) * x + c.c_yy * y + load * c.cos_beta
    along += c.m * abs(m[BELT_SLOPE]) + c.phi * normal
    return 4.0 * EPSILON * along, 4.0 * EPSILON * (across + normal)


@kernel(void(PLANT, DRIVE), inlined=False)
def arrive(p: Plant, drive: Drive) -> None:
    """What acts from outside at the time reached and, as no knot lies inside a step, all through the next step."""
    m, t, tau = p.memory, p.memory[TIME], p.memory[TAU]
    after = t + tau + 4.0 * EPSILON * (t + tau)  # a knot within the rounding of the time has been reached
    m[BELT], m[BELT_SLOPE] = value_at(drive.belt, t + tau), slope_at(drive.belt, after)
    m[LOAD], m[LOAD_SLOPE] = value_at(drive.load, t + tau), slope_at(drive.load, after)
    m[TRAVEL], m[TRAVEL_LOW] = integral_at(drive.belt, t, tau)
    if drive.wheel.g.size > 0:
        wheel_angles(drive.wheel, m[TRAVEL], m[TRAVEL_LOW], p.angles)
    if m[STARTED] != 0.0 and m[SIDE] == 0.0:  # no drift can build up
        m[X], m[VX] = (m[ANCHOR] + m[TRAVEL]) + (m[ANCHOR_LOW] + m[TRAVEL_LOW]), m[BELT]


@kernel(float64(PLANT, float64, float64, float64), inlined=False)
def press(p: Plant, x: float, y: float, touching: float) -> float:
    """F_y (N) in the phase and the rest of `contact`; the closed form while a bound proves full contact.

    x is less what the wheel has travelled since the time that `angles` belong to.
    """
    pad, contact = p.pad, p.contact
    if touching == 0.0:
        clear(x, y, p.angles, pad, contact)
        return 0.0
    p.counts[EVALUATIONS] += 1
    if pad[SHOE_TERMS] + pad[WHEEL_TERMS] == 0.0:
        contact[STIFFNESS] = full_stiffness(pad)
        contact[NORMAL_FORCE] = -contact[STIFFNESS] * y  # Eq. (2), continued: an event ends the phase at y = 0
        contact[FRACTION] = 1.0 if y < 0.0 else 0.0
        contact[STORE_X], contact[KIND], contact[VALID] = 0.0, 0.0, 1.0
    elif coverage(y, pad) == FULL:
        full_contact(x, y, p.angles, pad, contact)
    else:
        p.evaluate(x, y, p.angles, pad, contact)  # type: ignore[operator]
    return contact[NORMAL_FORCE]  # type: ignore[no-any-return]


@kernel(void(PLANT, int64, float64, float64, float64, float64, float64), inlined=False)
def slopes(p: Plant, stage: int, since: float, x: float, y: float, v_x: float, v_y: float) -> None:
    """(6)-(7) as equations of first order, and the powers of the energy account, `since` the begin of the step.

    In stick x and its velocity are the wheel's, whatever is given.
    """
    c, m = p.c, p.memory
    side, load = m[SIDE], m[LOAD] + m[LOAD_SLOPE] * since
    belt, travel = m[BELT] + m[BELT_SLOPE] * since, (m[BELT] + 0.5 * m[BELT_SLOPE] * since) * since
    if side == 0.0:
        x, v_x = m[X] + travel, belt
    normal = press(p, x - travel, y, m[TOUCHING])
    against_x, against_y = resistance(c, load, x, y, v_x, v_y)
    friction = -side * c.phi * normal if side != 0.0 else c.m * m[BELT_SLOPE] + against_x
    at, sliding = SLOPES + SIZE * stage, v_x - belt
    m[at], m[at + 1] = v_x, v_y
    m[at + 2] = (friction - against_x) / c.m if side != 0.0 else m[BELT_SLOPE]
    m[at + 3] = (normal - against_y) / c.m
    at = WORK_RATES + WORKS * stage
    m[at] = friction * belt
    m[at + 1] = -friction * sliding
    m[at + 2] = c.b_xx * v_x * v_x + 2.0 * c.b_xy * v_x * v_y + c.b_yy * v_y * v_y
    m[at + 3] = load * (c.sin_beta * v_x + c.cos_beta * v_y)
    m[at + 4] = p.contact[STORE_X] * sliding


@kernel(_TRIPLE(PLANT, float64, float64), inlined=False)
def margins(p: Plant, h: float, theta: float) -> tuple[float, float, float]:
    """What is positive while the phase lasts, at the part theta of the step h.

    In slip the sliding velocity (m/s) and nothing; in stick how far the force needed is within the friction cone
    (N), on the side of backward slip and of forward slip; then the height (m) before the pad is clear, or is not.
    """
    c, m, since = p.c, p.memory, theta * h
    y = interpolated(m, BEGIN, POWER, Y, theta)
    height = clear_height(p.pad) - y if m[TOUCHING] != 0.0 else y - clear_height(p.pad)
    belt = m[BELT] + m[BELT_SLOPE] * since
    if m[SIDE] != 0.0:
        return m[SIDE] * (interpolated(m, BEGIN, POWER, VX, theta) - belt), 1.0, height
    x = m[X] + (m[BELT] + 0.5 * m[BELT_SLOPE] * since) * since
    bound = c.phi * press(p, m[X], y, m[TOUCHING])
    v_y = interpolated(m, BEGIN, POWER, VY, theta)
    against_x, _ = resistance(c, m[LOAD] + m[LOAD_SLOPE] * since, x, y, belt, v_y)
    needed = c.m * m[BELT_SLOPE] + against_x
    return bound - needed, bound + needed, height


@kernel(float64(PLANT, int64), inlined=False)
def margin_slope(p: Plant, which: int) -> float:
    """Rate of a margin at the end of a step, from the slopes and the contact there."""
    c, m, at = p.c, p.memory, SLOPES + SIZE * END_STAGE
    if which == 2:
        return -m[at + 1] if m[TOUCHING] != 0.0 else m[at + 1]  # type: ignore[no-any-return]
    if m[SIDE] != 0.0:
        return m[SIDE] * (m[at + 2] - m[BELT_SLOPE])  # type: ignore[no-any-return]
    bound = -c.phi * p.contact[STIFFNESS] * m[at + 1]
    needed, _ = resistance(c, m[LOAD_SLOPE], m[at], m[at + 1], m[at + 2], m[at + 3])
    return bound - needed if which == 0 else bound + needed  # type: ignore[no-any-return]


@kernel(void(PLANT), inlined=False)
def take_hold(p: Plant) -> None:
    """The side where the shoe moves with the wheel: stick if friction can hold it there, else slip, (3)-(5).

    A shoe that slips on keeps its velocity: the wheel's is as uncertain as the time, however fast it changes.
    """
    c, m = p.c, p.memory
    normal = press(p, m[X], m[Y], m[TOUCHING])
    against_x, _ = resistance(c, m[LOAD], m[X], m[Y], m[BELT], m[VY])
    needed, (along, _) = c.m * m[BELT_SLOPE] + against_x, rounding(p)
    if abs(needed) <= c.phi * normal + along:
        anchor, anchor_low = two_sum(m[X], -m[TRAVEL])
        m[ANCHOR], m[ANCHOR_LOW], m[VX] = anchor, anchor_low - m[TRAVEL_LOW], m[BELT]
        m[SIDE] = 0.0
    else:
        m[SIDE] = -1.0 if needed > 0.0 else 1.0


@kernel(void(PLANT, int64), inlined=False)
def switch(p: Plant, which: int) -> None:
    """Enter the phase that follows where a margin has run out."""
    m = p.memory
    if which == 2:
        m[Y] = clear_height(p.pad)
        m[TOUCHING] = 1.0 - m[TOUCHING]
    elif m[SIDE] == 0.0:
        m[SIDE] = -1.0 if which == 0 else 1.0  # friction cannot pull that hard, or cannot push
    else:
        take_hold(p)
    slopes(p, 0, 0.0, m[X], m[Y], m[VX], m[VY])
