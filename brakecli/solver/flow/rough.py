"""The flow on rough pads, with its derivative: a Runge-Kutta method with a fixed number of steps.

The number of steps does not depend on the state, so the end is a smooth function of the state, of the span and of
the parameters, as long as the sequence of phases is the same.

**Contact.** The pad is cut into cells of equal length, and the gap f2 - f1 - y is a straight line in each of
them. The force (2), its derivatives by x and y and the length that touches are then closed forms, and the force is
continuously differentiable. The heights at the nodes are those of the surfaces times tan(ωc/2) / (ωc/2) for a cell
of length c. With this factor the force of a pad that touches everywhere is exact. In partial contact the cells in
which contact begins or ends have an error of order c³, which cancels on average as the edge passes through a
cell. The end of a flow has an error of order c⁴. A wave is even or odd about the middle of the pad, so tables of
one half are enough.

**Events.** A phase ends where a margin becomes zero: in slip the sliding speed, in stick how far the friction that
is needed lies within the friction cone. The event is located inside the step and divides it into two parts.
Lift-off is no event, because the normal force is continuous. A margin that dips below zero and returns within one
step is found by the cubic through its values and slopes.

**Derivative.** Columns hold the derivatives of x, y, v_x and v_y by each component of the first state. They obey
the variational equations, and their steps are the derivatives of the steps of the state. At an event the length p
of a part of a step depends on the state: margin(z(p)) = 0 gives dp = -dm / (∂m/∂p). The disturbed motion then has
dz + (∂z/∂p) dp, and reaches the event later by dp. The next part begins later by dp and is shorter by dp. For
short steps this is the saltation matrix (R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth
Mechanical Systems, Springer 2004, ch. 7). Here it is the exact derivative of the computed flow, whatever the step
is.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numba
import numpy as np
from numba import float64, int64, types, void

from brakecli import stop
from brakecli.solver.automaton import PULL, STICK, UNDECIDED, following, held, sliding_phase
from brakecli.solver.compile import FAST, LARGEST, Floats, from_memory, into_memory, kernel, stopped, vector
from brakecli.solver.contact.pad import aligned
from brakecli.solver.double_double import two_product
from brakecli.solver.records import COEFFICIENTS, V_X, V_Y, Coefficients, Parts, X, Y, new, record
from brakecli.solver.roughness import Surface, wheel_angles
from brakecli.solver.runge_kutta import END_STAGE, NODES, USED, A
from brakecli.solver.sine import sine_cosine
from brakecli.solver.system import System

MOST_EVENTS = 256  # in a span
BOUND = 1e100  # of a state, beyond which the motion has run away
CELLS_PER_WAVE, LEAST_CELLS = 24, 96
LANDING = 16  # parts of a step in which the whole pad lands or lifts off: the force has a kink there
_ROUNDED = 1e-9  # of a step, that may be left of it by rounding
STEPS_PER_PERIOD = 20  # of the fastest mode, or of the shortest wave that passes

_STAGES = int(USED[1])
_A, _B, _C = A[1, :_STAGES, :_STAGES].copy(), A[1, END_STAGE, :_STAGES].copy(), NODES[1, :_STAGES].copy()
"""DOPRI5, of order five. On 60 random rough pads its median error is a seventh of that of the classical method of
order four at 160 evaluations of the contact to a period, and a fourth at 320. From 320 on DOP853 is worse than
both, because the force of partial contact has kinks in its second derivative."""

_COLUMNS, _EIGHT, _FOUR = 4, 8, 4
"""Columns of the derivative; lanes of sines, and of nodes and waves in the tables."""
_TINY = 1e-300  # avoids a division by zero where a cell is open
_ROUNDING = 1e-14  # of the terms of a margin: a margin that is negative by less is zero
_SEEKS = 60  # steps of the search for an event
_SIGNALS = 1023  # steps between two looks at signals, plus one a power of two
_NONE = -1


class Status(IntEnum):
    """How a flow ended."""

    DONE = 0
    TOO_MANY_EVENTS = 1
    NOT_FINITE = 2
    GRAZED = 3  # a margin becomes zero without passing through it: the flow has no derivative
    STOPPED = 4  # by a signal


_DONE, _TOO_MANY_EVENTS, _NOT_FINITE, _GRAZED, _STOPPED = (int(status) for status in Status)

ROUGH = record(
    "belt",  # U, m/s
    "pull_x pull_y",  # Q_x and Q_y, N
    "stiffness",  # 2ak, N/m
    "half",  # k times half a cell, N/m
    "shoe_mean",  # mean of f1 over the pad, m
    "full_up_to clear_from",  # heights y: up to it all touches for sure, from it on nothing, m
    "since",  # time since the begin of the span, s
    "length",  # of the step that was tried last, s
    "anchor",  # x - U since, in stick, m
    "force slope touching",  # last contact: F_y (N), ∂F_y/∂x and -∂F_y/∂y (N/m)
    "place",  # x - U since, for which sines and heights are known, m
    "before_force before_slope before_touching",  # contact at the begin of the step
    "least_slide least_hold least_pass",  # see `Margins`
    "least_contact most_contact",  # part of the pad that touches
    "open stuck",  # time, s
    "least_x most_x least_y most_y",  # m
    cells=int,
    half_cells=int,  # cells of half a pad
    width=int,  # nodes of half a pad in the tables
    waves=int,
    phase=int,
    tangents=int,  # 1 where the derivative is carried along
    known=int,  # of the place: 0 nothing, 1 sines, 2 heights, 3 also their slopes
    events=int,
    which=int,  # margin that ends the phase
    signals=int,  # where to see that a signal has come, see `compile.stopped`
    omega_at=int,  # where in the tables begin: wavenumbers
    g_at=int,  # amplitudes, with the factor of the cells
    full_at=int,  # F_y of a full contact by the sine of each wave, N
    angles_at=int,  # phases at the begin of the span
    waves_at=int,  # sines and cosines of each wave at the nodes of half a pad
    shoe_at=int,  # f1 at the nodes of the right half, and of the left half
    sines_at=int,  # scratch: g sin and g cos of the angles, and these times ω
    nodes_at=int,  # scratch: f2 at the nodes, the even part and the odd part, then of its slope
    z=(float, 4),  # state at the begin of the step, and at its end
    end=(float, 4),
    w=(float, 4),
    k=(float, (_STAGES, 4)),  # rates of the state at the stages
    margin=(float, 2),  # at the begin of the step and at its end, and rates of both; in slip m/s, in stick N
    margin_rate=(float, 2),
    end_margin=(float, 2),
    end_margin_rate=(float, 2),
    rates=(float, 4),  # of the state where the contact was evaluated last for margins
    t=(float, (4, _COLUMNS)),  # derivatives of `z` and of `end`
    t_end=(float, (4, _COLUMNS)),
    t_w=(float, (4, _COLUMNS)),
    t_kept=(float, (4, _COLUMNS)),  # of the state at an event, for a fixed length of the step
    late_kept=(float, _COLUMNS),
    t_k=(float, (_STAGES, 4, _COLUMNS)),
    late=(float, _COLUMNS),  # derivatives of the time at which the step begins, and of its length
    stretch=(float, _COLUMNS),
    times=(float, MOST_EVENTS),  # of events, s
    word=(int, MOST_EVENTS + 1),  # phases
)
"""A flow on its way."""
ROUGH_TYPE = numba.from_dtype(ROUGH)


# --- contact --------------------------------------------------------------------------------------------------


@kernel(void(vector, vector, vector, vector, vector), fastmath=FAST)
def _add_four(even: Floats, odd: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """Add four waves s cos(ωξ) + c sin(ωξ) to the even part and to the odd part of a height."""
    n = even.size
    s_0, s_1, s_2, s_3 = s[0], s[1], s[2], s[3]
    c_0, c_1, c_2, c_3 = c[0], c[1], c[2], c[3]
    for j in range(n):
        odd[j] += (c_0 * table[j] + c_1 * table[j + 2 * n]) + (c_2 * table[j + 4 * n] + c_3 * table[j + 6 * n])
        one = s_0 * table[j + n] + s_1 * table[j + 3 * n]
        even[j] += one + (s_2 * table[j + 5 * n] + s_3 * table[j + 7 * n])


@kernel(void(vector, vector, vector, float64, float64), fastmath=FAST)
def _add_one(even: Floats, odd: Floats, table: Floats, s: float, c: float) -> None:
    """Add a wave s cos(ωξ) + c sin(ωξ) to the even part and to the odd part of a height."""
    n = even.size
    for j in range(n):
        odd[j] += c * table[j]
        even[j] += s * table[j + n]


@kernel(void(ROUGH_TYPE, vector, vector, vector, int64), inlined=False)
def _sum_waves(f: Any, tables: Floats, even: Floats, odd: Floats, at: int) -> None:
    """The even part and the odd part of a sum of waves, whose factors begin `at` a place of the tables."""
    n, i, eights = f.width, 0, (f.waves + _EIGHT - 1) // _EIGHT * _EIGHT
    for j in range(n):
        even[j] = odd[j] = 0.0
    while i + 4 <= f.waves:
        begin = f.waves_at + 2 * n * i
        s, c = tables[at + i : at + i + 4], tables[at + eights + i : at + eights + i + 4]
        _add_four(even, odd, tables[begin : begin + 8 * n], s, c)
        i += 4
    while i < f.waves:
        begin = f.waves_at + 2 * n * i
        _add_one(even, odd, tables[begin : begin + 2 * n], tables[at + i], tables[at + eights + i])
        i += 1


@kernel(types.UniTuple(float64, 2)(float64, float64), fastmath=FAST)
def _cell(one: float, two: float) -> tuple[float, float]:
    """The part of a cell that touches, and twice the mean gap there, from the gaps at both ends."""
    high, low = (one, two) if one > two else (two, one)
    press, rest = (high if high > 0.0 else 0.0), (low if low > 0.0 else 0.0)
    return np.divide(press, press - (low - rest) + _TINY), press + rest


@kernel(types.UniTuple(float64, 2)(float64, vector, vector, vector, vector, int64), fastmath=FAST)
def _pressed(y: float, even: Floats, odd: Floats, right: Floats, left: Floats, cells: int) -> tuple[float, float]:
    """Twice the force over k and the cell, and twice the number of cells that touch; `right` and `left` are f1."""
    force, touching = 0.0, 0.0
    for j in range(cells):
        one, two = even[j] + odd[j] - right[j] - y, even[j + 1] + odd[j + 1] - right[j + 1] - y
        part, gap = _cell(one, two)
        force, touching = force + part * gap, touching + 2.0 * part
        one, two = even[j] - odd[j] - left[j] - y, even[j + 1] - odd[j + 1] - left[j + 1] - y
        part, gap = _cell(one, two)
        force, touching = force + part * gap, touching + 2.0 * part
    return force, touching


@kernel(float64(float64, float64, float64, float64, float64), fastmath=FAST)
def _slope(part: float, one: float, two: float, steep: float, steeper: float) -> float:
    """The derivative of a cell's force by x: from the part that touches, gaps and slopes of f2 at both ends."""
    of_high, of_low = (steep, steeper) if one > two else (steeper, steep)
    return part * (2.0 - part) * of_high + part * part * of_low


@kernel(types.UniTuple(float64, 3)(float64, vector, vector, vector, vector, vector, vector, int64), fastmath=FAST)
def _pressed_steeply(
    y: float, even: Floats, odd: Floats, rise: Floats, turn: Floats, right: Floats, left: Floats, cells: int
) -> tuple[float, float, float]:
    """As `_pressed`, and the derivative of its first number by x; the slope of f2 has the parts `rise`, `turn`."""
    force, touching, slope = 0.0, 0.0, 0.0
    for j in range(cells):
        one, two = even[j] + odd[j] - right[j] - y, even[j + 1] + odd[j + 1] - right[j + 1] - y
        part, gap = _cell(one, two)
        force, touching = force + part * gap, touching + 2.0 * part
        slope += _slope(part, one, two, rise[j] + turn[j], rise[j + 1] + turn[j + 1])
        one, two = even[j] - odd[j] - left[j] - y, even[j + 1] - odd[j + 1] - left[j + 1] - y
        part, gap = _cell(one, two)
        force, touching = force + part * gap, touching + 2.0 * part
        slope += _slope(part, one, two, rise[j] - turn[j], rise[j + 1] - turn[j + 1])
    return force, touching, slope


@kernel(void(ROUGH_TYPE, vector, float64), inlined=False)
def _turn(f: Any, tables: Floats, place: float) -> None:
    """Sines and cosines of the waves where x - U since is `place`, times amplitudes, and times ω as well."""
    n, eights = f.waves, (f.waves + _EIGHT - 1) // _EIGHT * _EIGHT
    at = f.sines_at
    sines, cosines = tables[at : at + eights], tables[at + eights : at + 2 * eights]
    rises, turns = tables[at + 2 * eights : at + 3 * eights], tables[at + 3 * eights : at + 4 * eights]
    for i in range(n):
        sines[i] = tables[f.omega_at + i] * place + tables[f.angles_at + i]
    for i in range(eights):
        sines[i], cosines[i] = sine_cosine(sines[i])
    for i in range(n):
        g, omega = tables[f.g_at + i], tables[f.omega_at + i]
        sines[i], cosines[i] = g * sines[i], g * cosines[i]
        rises[i], turns[i] = omega * cosines[i], -omega * sines[i]
    f.place, f.known = place, 1


@kernel(void(ROUGH_TYPE, vector, float64, float64, int64), inlined=False)
def _press(f: Any, tables: Floats, place: float, y: float, steeply: int) -> None:
    """The contact where x - U since is `place`; ∂F_y/∂x only where it is asked for `steeply`."""
    f.slope = 0.0
    if y >= f.clear_from:
        f.force = f.touching = 0.0
        return
    eights = (f.waves + _EIGHT - 1) // _EIGHT * _EIGHT
    if place != f.place:
        f.known = 0
    if f.known == 0:
        _turn(f, tables, place)
    if y <= f.full_up_to:
        force, slope = -(y + f.shoe_mean) * f.stiffness, 0.0
        for i in range(f.waves):
            force += tables[f.full_at + i] * tables[f.sines_at + i]
            slope += tables[f.full_at + i] * tables[f.sines_at + 2 * eights + i]
        f.force, f.slope, f.touching = force, slope, f.stiffness
        return
    n, at = f.width, f.nodes_at
    even, odd = tables[at : at + n], tables[at + n : at + 2 * n]
    right, left = tables[f.shoe_at : f.shoe_at + n], tables[f.shoe_at + n : f.shoe_at + 2 * n]
    if f.known < 2:
        _sum_waves(f, tables, even, odd, f.sines_at)
        f.known = 2
    if steeply == 0:
        force, touching = _pressed(y, even, odd, right, left, f.half_cells)
    else:
        rise, turn = tables[at + 2 * n : at + 3 * n], tables[at + 3 * n : at + 4 * n]
        if f.known < 3:
            _sum_waves(f, tables, rise, turn, f.sines_at + 2 * eights)
            f.known = 3
        force, touching, slope = _pressed_steeply(y, even, odd, rise, turn, right, left, f.half_cells)
        f.slope = f.half * slope
    f.force, f.touching = f.half * force, f.half * touching


# --- a step ---------------------------------------------------------------------------------------------------


@kernel(void(COEFFICIENTS, ROUGH_TYPE, int64), inlined=False)
def _find_tangents(c: Coefficients, f: Any, stage: int) -> None:
    """The variational equations at a stage, for the disturbances `t_w` and the contact found there."""
    grip, node, mass = (1 - f.phase) * c.phi, _C[stage], 1.0 / c.m
    slips = mass if f.phase != STICK else 0.0
    for j in range(_COLUMNS):
        x, y, v_x, v_y = f.t_w[X, j], f.t_w[Y, j], f.t_w[V_X, j], f.t_w[V_Y, j]
        moved = x - f.belt * (f.late[j] + node * f.stretch[j])
        pressed = f.slope * moved - f.touching * y
        f.t_k[stage, X, j], f.t_k[stage, Y, j] = v_x, v_y
        along = grip * pressed - (c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y)  # Eq. (6)
        f.t_k[stage, V_X, j] = slips * along
        across = pressed - (c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y)  # Eq. (7)
        f.t_k[stage, V_Y, j] = mass * across


@kernel(void(COEFFICIENTS, ROUGH_TYPE, int64))
def _find_rates(c: Coefficients, f: Any, stage: int) -> None:
    """(6)-(7) as equations of first order at a stage, for the state `w` and the contact found there."""
    x, y, v_x, v_y = f.w[X], f.w[Y], f.w[V_X], f.w[V_Y]
    f.k[stage, X], f.k[stage, Y] = v_x, v_y
    if f.phase != STICK:
        against = c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + f.pull_x
        f.k[stage, V_X] = ((1 - f.phase) * c.phi * f.force - against) / c.m  # Eq. (6) with Eq. (5)
    else:
        f.k[stage, V_X] = 0.0
    against = c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + f.pull_y
    f.k[stage, V_Y] = (f.force - against) / c.m  # Eq. (7)


@kernel(void(COEFFICIENTS, ROUGH_TYPE, vector, float64, int64), inlined=False)
def _step(c: Coefficients, f: Any, tables: Floats, h: float, tangents: int) -> None:
    """A step from `z` to `end`, and from `t` to `t_end`; the contact at the begin is known."""
    f.length = h
    for s in range(_STAGES):
        for i in range(4):
            total = 0.0
            for r in range(s):
                total += _A[s, r] * f.k[r, i]
            f.w[i] = f.z[i] + h * total
        if s == 0:
            f.force, f.slope, f.touching = f.before_force, f.before_slope, f.before_touching
        else:
            place = f.anchor if f.phase == STICK else f.w[X] - f.belt * (f.since + _C[s] * h)
            _press(f, tables, place, f.w[Y], tangents)
        _find_rates(c, f, s)
        if tangents != 0:
            for i in range(4):
                total = 0.0
                for r in range(s):
                    total += _A[s, r] * f.k[r, i]
                for j in range(_COLUMNS):
                    f.t_w[i, j] = f.t[i, j] + total * f.stretch[j]
                for r in range(s):
                    if _A[s, r] != 0.0:
                        for j in range(_COLUMNS):
                            f.t_w[i, j] += h * _A[s, r] * f.t_k[r, i, j]
            _find_tangents(c, f, s)
    for i in range(4):
        total = 0.0
        for r in range(_STAGES):
            total += _B[r] * f.k[r, i]
        f.end[i] = f.z[i] + h * total
        if tangents != 0:
            for j in range(_COLUMNS):
                f.t_end[i, j] = f.t[i, j] + total * f.stretch[j]
            for r in range(_STAGES):
                for j in range(_COLUMNS):
                    f.t_end[i, j] += h * _B[r] * f.t_k[r, i, j]


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, float64, float64, float64, float64))
def _needed(c: Coefficients, f: Any, x: float, y: float, v_x: float, v_y: float) -> float:
    """The friction force (N) that stick takes, (4) and (6) with the wheel's velocity, which is constant."""
    return c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + f.pull_x  # type: ignore[no-any-return]


@kernel(void(COEFFICIENTS, ROUGH_TYPE), inlined=False)
def _find_margins(c: Coefficients, f: Any) -> None:
    """Margins at `end`, their rates and those of the state, from the contact found there."""
    for i in range(4):
        f.w[i] = f.end[i]
    kept_x, kept_y, kept_v_x, kept_v_y = f.k[0, X], f.k[0, Y], f.k[0, V_X], f.k[0, V_Y]
    _find_rates(c, f, 0)
    for i in range(4):
        f.rates[i] = f.k[0, i]
    f.k[0, X], f.k[0, Y], f.k[0, V_X], f.k[0, V_Y] = kept_x, kept_y, kept_v_x, kept_v_y
    x, y, v_x, v_y = f.end[X], f.end[Y], f.end[V_X], f.end[V_Y]
    if f.phase != STICK:
        side = f.phase - STICK
        f.end_margin[0], f.end_margin_rate[0] = side * (v_x - f.belt), side * f.rates[V_X]
        f.end_margin[1], f.end_margin_rate[1] = 0.0, 0.0
        return
    needed, bound = _needed(c, f, x, y, v_x, v_y), c.phi * f.force
    change = c.b_xy * f.rates[V_Y] + c.c_xx * v_x + c.c_xy * v_y
    opens = -c.phi * f.touching * v_y
    f.end_margin[0], f.end_margin_rate[0] = bound - needed, opens - change
    f.end_margin[1], f.end_margin_rate[1] = bound + needed, opens + change


@kernel(void(COEFFICIENTS, ROUGH_TYPE, vector, int64), inlined=False)
def _look(c: Coefficients, f: Any, tables: Floats, steeply: int) -> None:
    """Contact and margins at `end`, the end of the step that was tried."""
    place = f.anchor if f.phase == STICK else f.end[X] - f.belt * (f.since + f.length)
    _press(f, tables, place, f.end[Y], steeply)
    _find_margins(c, f)


@kernel(float64(COEFFICIENTS, ROUGH_TYPE))
def _noise(c: Coefficients, f: Any) -> float:
    """The rounding of the margins at `end`."""
    if f.phase != STICK:
        return _ROUNDING * (abs(f.belt) + abs(f.end[V_X]))  # type: ignore[no-any-return]
    x, y, v_x, v_y = abs(f.end[X]), abs(f.end[Y]), abs(f.end[V_X]), abs(f.end[V_Y])
    links = c.b_xx * v_x + abs(c.b_xy) * v_y + c.c_xx * x + abs(c.c_xy) * y + abs(f.pull_x)
    return _ROUNDING * (links + c.phi * f.force)  # type: ignore[no-any-return]


# --- events ---------------------------------------------------------------------------------------------------


@kernel(types.UniTuple(float64, 2)(float64, float64, float64, float64, float64))
def _lowest(begin: float, rate: float, end: float, end_rate: float, h: float) -> tuple[float, float]:
    """Part of a step at which the cubic through values and rates is lowest inside it, and its value there.

    The part is -1 where the cubic does not fall at the begin and rise at the end.
    """
    if not (rate < 0.0 < end_rate):
        return -1.0, end
    b, e, d = h * rate, h * end_rate, end - begin
    cubic, square = b + e - 2.0 * d, 3.0 * d - 2.0 * b - e
    root = math.sqrt(max(square * square - 3.0 * cubic * b, 0.0))  # where 3 cubic p² + 2 square p + b = 0
    part = -b / (square + root) if square + root > 0.0 else 0.5
    part = min(max(part, 0.0), 1.0)
    return part, begin + part * (b + part * (square + part * cubic))


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, vector, float64, int64), inlined=False)
def _margin_at(c: Coefficients, f: Any, tables: Floats, h: float, which: int) -> float:
    """A margin after a step h that is tried."""
    _step(c, f, tables, h, 0)
    _look(c, f, tables, 0)
    return f.end_margin[which]  # type: ignore[no-any-return]


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, vector, float64, float64, int64), inlined=False)
def _located(c: Coefficients, f: Any, tables: Floats, h: float, high: float, which: int) -> float:
    """The part of the step h at which a margin is zero; at its part `high` it is negative.

    Newton's method, kept inside a bracket. A phase begins where its margin is zero: it must have risen before.
    """
    low, noise, begin = 0.0, _noise(c, f), f.margin[which]
    if begin > noise:
        part = high * begin / (begin - _margin_at(c, f, tables, high * h, which))
    else:
        for _ in range(_SEEKS):
            part = 0.5 * high
            if _margin_at(c, f, tables, part * h, which) > 0.0:
                low, part = part, 0.75 * high
                break
            high = part
        if low == 0.0:
            return 0.0
    for _ in range(_SEEKS):
        value = _margin_at(c, f, tables, part * h, which)
        if value > 0.0:
            low = part
        else:
            high = part
        if abs(value) <= 0.01 * noise or high - low <= 1e-16:
            break
        slope = h * f.end_margin_rate[which]
        rest = -value / slope if slope < 0.0 else 2.0
        if not low < part + rest < high:
            rest = 0.5 * (low + high) - part
        if part + rest == part:
            break
        part += rest
    return part  # type: ignore[no-any-return]


@kernel(types.UniTuple(float64, 2)(COEFFICIENTS, ROUGH_TYPE, vector, float64), inlined=False)
def _first_crossing(c: Coefficients, f: Any, tables: Floats, h: float) -> tuple[float, float]:
    """The margin that ends the phase within the step, -1 for none, and the part of the step until then.

    Notes how near margins come to zero.
    """
    noise, dips = _noise(c, f), 0
    which, high, first = _NONE, 1.0, 2.0
    for i in range(2 if f.phase == STICK else 1):
        if f.end_margin[i] < -noise:
            fall = f.margin[i] - f.end_margin[i]
            part = f.margin[i] / fall if fall > 0.0 else 0.0
            if part < first:
                which, first = i, part
    if which == _NONE:
        for i in range(2 if f.phase == STICK else 1):
            part, value = _lowest(f.margin[i], f.margin_rate[i], f.end_margin[i], f.end_margin_rate[i], h)
            if part >= 0.0 and value < -noise:
                dips = 1
                if _margin_at(c, f, tables, part * h, i) < -noise:
                    which, high = i, part
                    break
            if part >= 0.0 and f.margin[i] > noise:  # not at the event that the phase begins with
                if f.phase != STICK:
                    f.least_slide = min(f.least_slide, max(value, 0.0))
                else:
                    f.least_hold = min(f.least_hold, max(value, 0.0))
    if which == _NONE:
        if dips != 0:
            _step(c, f, tables, h, f.tangents)  # as it was before the dip was tried
            _look(c, f, tables, f.tangents)
        return -1.0, 1.0
    return float(which), _located(c, f, tables, h, high, which)


@kernel(void(ROUGH_TYPE, float64))
def _note(f: Any, h: float) -> None:
    """Note extremes and shares of the step that was taken; its end is `end`, with its rates."""
    least, x = -_lowest(-f.z[X], -f.z[V_X], -f.end[X], -f.end[V_X], h)[1], f.end[X]
    f.most_x = max(f.most_x, x, least)
    f.least_x = min(f.least_x, x, _lowest(f.z[X], f.z[V_X], x, f.end[V_X], h)[1])
    least, y = -_lowest(-f.z[Y], -f.z[V_Y], -f.end[Y], -f.end[V_Y], h)[1], f.end[Y]
    f.most_y = max(f.most_y, y, least)
    f.least_y = min(f.least_y, y, _lowest(f.z[Y], f.z[V_Y], y, f.end[V_Y], h)[1])
    f.stuck += h if f.phase == STICK else 0.0
    f.open += 0.5 * h * ((1.0 if f.before_touching == 0.0 else 0.0) + (1.0 if f.touching == 0.0 else 0.0))
    part = f.touching / f.stiffness
    f.least_contact, f.most_contact = min(f.least_contact, part), max(f.most_contact, part)


@kernel(void(ROUGH_TYPE))
def _advance(f: Any) -> None:
    """Make the end of the step the begin of the next one."""
    for i in range(4):
        f.z[i] = f.end[i]
    for i in range(2):
        f.margin[i], f.margin_rate[i] = f.end_margin[i], f.end_margin_rate[i]
    f.before_force, f.before_slope, f.before_touching = f.force, f.slope, f.touching
    if f.tangents != 0:
        for i in range(4):
            for j in range(_COLUMNS):
                f.t[i, j] = f.t_end[i, j]


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, float64, float64, float64, float64, float64))
def _change(c: Coefficients, f: Any, x: float, y: float, v_x: float, v_y: float, late: float) -> float:
    """The change of the margin that ends the phase, for small changes of the state and of the time."""
    if f.phase != STICK:
        return (f.phase - STICK) * v_x  # type: ignore[no-any-return]
    needed = c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y
    cone = c.phi * (f.slope * (x - f.belt * late) - f.touching * y)
    return cone - needed if f.which == 0 else cone + needed  # type: ignore[no-any-return]


@kernel(int64(COEFFICIENTS, ROUGH_TYPE, vector, float64), inlined=False)
def _carry_to_event(c: Coefficients, f: Any, tables: Floats, h: float) -> int:
    """Step to an event, with the derivatives of the state and of the time there; 0 where it only grazes."""
    t, kept, late = f.t_end, f.t_kept, f.late_kept
    for j in range(_COLUMNS):
        f.stretch[j] = 0.0
    _step(c, f, tables, h, 1)
    for j in range(_COLUMNS):
        late[j], f.late[j], f.stretch[j] = f.late[j], 0.0, 1.0
        for i in range(4):
            kept[i, j], f.t[i, j] = t[i, j], 0.0
    _step(c, f, tables, h, 1)  # each column is now the derivative by the length of the step
    _look(c, f, tables, 1)
    rate = _change(c, f, t[X, 0], t[Y, 0], t[V_X, 0], t[V_Y, 0], 1.0)
    if not rate < 0.0:
        return 0
    for j in range(_COLUMNS):
        longer = -_change(c, f, kept[X, j], kept[Y, j], kept[V_X, j], kept[V_Y, j], late[j]) / rate
        f.late[j] = late[j] + longer
        for i in range(4):
            t[i, j] = kept[i, j] + longer * t[i, j]
    return 1


@kernel(void(COEFFICIENTS, ROUGH_TYPE), inlined=False)
def _take_hold(c: Coefficients, f: Any) -> None:
    """The phase at `end`, where the shoe moves with the wheel: stick where friction can hold it, (3)-(5)."""
    f.end[V_X] = f.belt
    needed, bound = _needed(c, f, f.end[X], f.end[Y], f.belt, f.end[V_Y]), c.phi * f.force
    f.phase = STICK  # `_noise` is that of forces
    noise = _noise(c, f)
    f.phase = held(bound - needed, bound + needed, noise, noise)
    if f.phase == STICK:
        f.anchor = f.end[X] - f.belt * f.since
        f.least_hold = min(f.least_hold, max(bound - abs(needed), 0.0))
    else:
        f.least_pass = min(f.least_pass, abs(needed) - bound)
    for j in range(_COLUMNS):
        f.t_end[V_X, j] = 0.0 if f.phase == STICK else f.t_end[V_X, j]


@kernel(void(ROUGH_TYPE))
def _note_border(f: Any) -> None:
    """Note the margins at `end`, where the span begins or ends."""
    if f.phase != STICK:
        f.least_slide = min(f.least_slide, max(f.end_margin[0], 0.0))
    else:
        f.least_hold = min(f.least_hold, max(min(f.end_margin[0], f.end_margin[1]), 0.0))


@kernel(void(COEFFICIENTS, ROUGH_TYPE, vector), inlined=False)
def _begin(c: Coefficients, f: Any, tables: Floats) -> None:
    """Prepare for the state `z`."""
    f.since, f.length, f.place, f.known, f.events, f.anchor = 0.0, 0.0, math.nan, 0, 0, 0.0
    f.open, f.stuck, f.least_contact, f.most_contact = 0.0, 0.0, math.inf, -math.inf
    f.least_slide = f.least_hold = f.least_pass = math.inf
    for i in range(4):
        f.end[i] = f.z[i]
        for j in range(_COLUMNS):
            f.t_end[i, j] = 1.0 if i == j else 0.0
    f.least_x, f.most_x, f.least_y, f.most_y = f.z[X], f.z[X], f.z[Y], f.z[Y]
    _press(f, tables, f.z[X], f.z[Y], f.tangents)
    f.phase = sliding_phase(f.z[V_X] - f.belt)
    if f.phase == UNDECIDED:
        _take_hold(c, f)
    f.least_pass = math.inf
    _find_margins(c, f)
    f.word[0] = f.phase
    part = f.touching / f.stiffness
    f.least_contact = f.most_contact = part
    _note_border(f)
    _advance(f)


@kernel(float64(ROUGH_TYPE, float64, float64))
def _next_part(f: Any, end: float, longest: float) -> float:
    """The length of the next part of a step until some time. The last one ends there, however late it begins."""
    left = max(end - f.since, 0.0)
    last = left <= 1.5 * longest
    for j in range(_COLUMNS):
        f.stretch[j] = -f.late[j] if last else 0.0
    return left if last else longest


_PARTS = types.NamedTuple([COEFFICIENTS, ROUGH_TYPE, vector], Parts)
_hold, _parts_at = into_memory(_PARTS), from_memory(_PARTS)


@kernel(int64(int64, float64, int64))
def fly(address: int, h: float, steps: int) -> int:
    """Take so many steps h (s) from the state `z`; a `Status`. The end is `end`, its derivatives `t_end`."""
    p: Parts = _parts_at(address)
    c, f, tables = p.c, p.f, p.tables
    _begin(c, f, tables)
    for n in range(steps):
        f.since, left, longest = n * h, h, h
        for j in range(_COLUMNS):
            f.late[j] = f.stretch[j] = 0.0
        while True:
            _step(c, f, tables, left, f.tangents)
            _look(c, f, tables, f.tangents)
            if longest == h and (f.before_touching == 0.0) != (f.touching == 0.0):
                longest = h / LANDING
                left = _next_part(f, (n + 1) * h, longest)
                continue
            if not abs(f.end[X]) + abs(f.end[Y]) + abs(f.end[V_X]) + abs(f.end[V_Y]) < BOUND:
                return _NOT_FINITE
            which, part = _first_crossing(c, f, tables, left)
            if which < 0.0 and (n + 1) * h - f.since - left < _ROUNDED * h:
                break
            if which < 0.0:
                _note(f, left)
                _advance(f)
                f.since += left
                left = _next_part(f, (n + 1) * h, longest)
                continue
            if f.events == MOST_EVENTS:
                return _TOO_MANY_EVENTS
            f.which, part = int(which), part * left
            if f.tangents != 0:
                if _carry_to_event(c, f, tables, part) == 0:
                    return _GRAZED
            else:
                _step(c, f, tables, part, 0)
                _look(c, f, tables, 0)
            _note(f, part)
            f.since += part
            f.phase = following(f.phase, PULL + f.which, 0.0)
            if f.phase == UNDECIDED:
                _take_hold(c, f)
            _find_margins(c, f)
            _advance(f)
            f.times[f.events] = f.since
            f.events += 1
            f.word[f.events] = f.phase
            left = _next_part(f, (n + 1) * h, longest)
        _note(f, left)
        _advance(f)
        if n & _SIGNALS == _SIGNALS and stopped(f.signals):
            return _STOPPED
    _note_border(f)
    return _DONE


# --- from Python ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Margins:
    """How near a flow comes to another sequence of phases, and how its pad touches; infinite where nothing counts.

    `slide`: least sliding speed (m/s) inside phases of slip and at both ends of the span. `hold`: least distance
    (N) of the force that stick takes from the friction cone, as stick begins, inside it, and at both ends of the
    span. `pass_by`: least force (N) by which stick failed where slip reversed. Zeros at events do not count.
    `contact` and `most_contact`: least and largest part of the pad that touches, at the ends of steps.
    `open_share` and `stick_share`: parts of the span in which nothing touches, to half a step, and in which the
    shoe sticks.
    """

    slide: float
    hold: float
    pass_by: float
    contact: float
    most_contact: float
    open_share: float
    stick_share: float


@dataclass(frozen=True)
class Flown:
    """What a flow has come to: state and velocity (its derivative by time) are those of x, y, v_x and v_y.

    `derivative`: of the state by the first state; None where it was not asked for, or where the flow has failed.
    `word`: the phases, `BACKWARD`, `STICK` or `FORWARD`; `times` (s) of the events between them, from the begin.
    `x` and `y`: least and largest (m).
    """

    status: Status
    state: Floats
    derivative: Floats | None
    velocity: Floats
    word: tuple[int, ...]
    times: tuple[float, ...]
    x: tuple[float, float]
    y: tuple[float, float]
    margins: Margins


def default_cells(system: System) -> int:
    """Cells of the pad for the shortest wave of both surfaces."""
    return max(LEAST_CELLS, math.ceil(CELLS_PER_WAVE * 2.0 * system.half_length * system.most_turns))


def default_steps(system: System, span: float, per_period: float = STEPS_PER_PERIOD) -> int:
    """Steps of a span (s), so many to the fastest period, of the shoe in full contact or of a wave that passes."""
    fastest = max(system.natural_frequencies[1], system.passing_frequency)
    return max(1, math.ceil(per_period * fastest * span))


class RoughFlow:
    """The flow of a system on rough pads, at constant speed and load; one call after the other."""

    def __init__(self, system: System, cells: int = 0) -> None:
        """Make the tables of so many cells, an even number; 0 takes `default_cells`.

        Raises ValueError where speed or load change, or where a cell is longer than half a wave.
        """
        if not system.steady:
            raise ValueError("the flow needs a constant speed and a constant load")
        cells = cells or default_cells(system)
        cells += cells % 2
        cell = 2.0 * system.half_length / cells
        if not cell * system.most_turns < 0.5:
            raise ValueError(f"{cells} cells are too few: two and more to each wave are needed")
        self.system, self.cells = system, cells
        self._flow, self._tables = _prepared(system, cells)
        n, at = system.wheel.g.size, int(self._flow["angles_at"])
        self._belt, self._waves, self._angles = system.belt_speed, system.wheel.waves, self._tables[at : at + n]
        self._memory = np.zeros(LARGEST, np.int8)
        self._address = self._memory.ctypes.data
        _hold(Parts(system.coefficients, self._flow, self._tables), self._address)

    def __call__(self, state: Floats, begin_time: float, span: float, steps: int, tangents: bool = True) -> Flown:
        """The flow from a state (x, y, v_x, v_y) at a time (s), over a span (s) in so many equal steps."""
        f = self._flow
        travel, travel_low = two_product(self._belt, begin_time)
        wheel_angles(self._waves, travel, travel_low, self._angles)
        f["z"], f["tangents"] = state, int(tangents)
        status = Status(fly(self._address, span / steps, steps))
        events = int(f["events"])
        return Flown(
            status,
            f["end"].copy(),
            f["t_end"].copy() if tangents and status is Status.DONE else None,
            f["rates"].copy(),
            tuple(f["word"][: events + 1].tolist()),
            tuple(f["times"][:events].tolist()),
            (float(f["least_x"]), float(f["most_x"])),
            (float(f["least_y"]), float(f["most_y"])),
            Margins(
                *(float(f[name]) for name in ("least_slide", "least_hold", "least_pass")),
                *(float(f[name]) for name in ("least_contact", "most_contact")),
                *(float(f[name]) / span for name in ("open", "stuck")),
            ),
        )


def _flattened(surface: Surface, cell: float) -> Floats:
    """Amplitudes of a gap that is straight in each cell: its force in full contact is that of the sines."""
    half = 0.5 * surface.omega * cell
    found: Floats = surface.g * np.tan(half) / half
    return found


def _prepared(system: System, cells: int) -> tuple[Any, Floats]:
    """The record of a flow, and its tables."""
    f, wheel, shoe, a = new(ROUGH), system.wheel, system.shoe, system.half_length
    half, waves, cell = cells // 2, wheel.g.size, 2.0 * a / cells
    width, eights = -(-(half + 1) // _FOUR) * _FOUR, -(-waves // _EIGHT) * _EIGHT
    shapes = {
        "waves_at": (waves, 2, width),  # first, for its rows must be aligned
        "nodes_at": (4, width),
        "shoe_at": (2, width),
        "sines_at": (4, eights),
        "omega_at": (waves,),
        "g_at": (waves,),
        "full_at": (waves,),
        "angles_at": (waves,),
    }
    tables, table, place = aligned(sum(map(math.prod, shapes.values()))), dict[str, Floats](), 0
    for name, shape in shapes.items():
        f[name], size = place, math.prod(shape)
        table[name] = tables[place : place + size].reshape(shape)
        place += size
    xi, g, heights = cell * np.arange(width), _flattened(wheel, cell), table["shoe_at"]
    for amplitude, omega, phase in zip(_flattened(shoe, cell), shoe.omega, shoe.phase, strict=True):
        heights += amplitude * np.sin(omega * np.array([xi, -xi]) + phase)
    table["omega_at"][:], table["g_at"][:] = wheel.omega, g
    angle = np.outer(wheel.omega, xi)
    table["waves_at"][:, 0], table["waves_at"][:, 1] = np.sin(angle), np.cos(angle)
    steeper = np.divide(wheel.g, g, out=np.ones_like(g), where=g != 0.0)
    table["full_at"][:] = system.contact_stiffness * np.sinc(wheel.omega * a / np.pi) * steeper
    f["belt"], f["stiffness"] = system.belt_speed, system.contact_stiffness
    load, c = system.load_at_start, system.coefficients
    f["pull_x"], f["pull_y"] = load * c.sin_beta, load * c.cos_beta
    f["half"], f["cells"], f["half_cells"] = 0.5 * system.layer_stiffness * cell, cells, half
    f["width"], f["waves"] = width, waves
    f["shoe_mean"] = float(np.sum(shoe.g * np.sin(shoe.phase) * np.sinc(shoe.omega * a / np.pi)))
    crest, nodes = float(np.abs(g).sum()), heights[:, : half + 1]
    f["full_up_to"], f["clear_from"] = -crest - nodes.max(), crest - nodes.min()
    f["signals"] = np.frombuffer(stop.memory, np.uint8).ctypes.data
    return f, tables
