"""What lanes carry along with their motions: a small disturbance, and the errors that steps and nodes make.

An error obeys the derivative of the steps, as a disturbance does, with what each step adds. Of the steps that is
what the motion misses of the scheme with steps twice as long, over what such steps miss more than these. Every
second level has one, and counts twice: one at every level would add up to nothing where a patch opens or closes.
Of the nodes it is what `contact.midpoint.left_out` finds at every second level.
"""

import math
from typing import Any

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.lanes.records import (
    ALIKE,
    DISTURBED,
    LANES,
    NODES,
    PAIR,
    STEPS,
    THETA_1,
    THETA_2,
    THETA_3,
    Shared,
)
from brakecli.solver.records import PARTS
from brakecli.solver.tangent import LEAST, MOST

_MORE = 7.0  # times that steps twice as long miss more, as errors fall with h³ at least
_START = 14.0  # the same of x after a start twice as long, over what a start is off by, as that falls with h⁴
NEAR = 3.0
"""Sliding velocity over its error, from which on a stick may have been missed."""


@kernel(fastmath=ALIKE)
def _miss(o: Any, shared: Shared) -> None:
    """What the motion misses of (6) and (7) with steps twice as long, between the last three even levels.

    The source is 2/7 of (θ1 (φ, 1) F^{n+1} + θ2 … + θ3 … - B w - C z - N (sin β, cos β)) - m (z^{n+1} - 2z^n +
    z^{n-1})/(4h²), weighed as in the steps.
    """
    h = 2.0 * shared.h
    for n in range(LANES):
        o.even_x[2, n], o.even_x[1, n], o.even_x[0, n] = o.even_x[1, n], o.even_x[0, n], o.x[n]
        o.even_y[2, n], o.even_y[1, n], o.even_y[0, n] = o.even_y[1, n], o.even_y[0, n], o.y[n]
        o.even_force[2, n], o.even_force[1, n], o.even_force[0, n] = (
            o.even_force[1, n],
            o.even_force[0, n],
            o.force[n],
        )
        o.even_d[2, n], o.even_d[1, n] = o.even_d[1, n], o.even_d[0, n]
        o.even_e[2, n], o.even_e[1, n] = o.even_e[1, n], o.even_e[0, n]
    for n in range(LANES):
        x = o.even_x[1, n]
        y = o.even_y[1, n]
        d = 0.5 / h * (o.x[n] - o.even_x[2, n])
        e = 0.5 / h * (o.y[n] - o.even_y[2, n])
        o.even_d[0, n] = d
        o.even_e[0, n] = e
        a_x = (o.x[n] - 2.0 * x + o.even_x[2, n]) / (h * h)
        a_y = (o.y[n] - 2.0 * y + o.even_y[2, n]) / (h * h)
        d -= THETA_1 * (d - 2.0 * o.even_d[1, n] + o.even_d[2, n])
        e -= THETA_1 * (e - 2.0 * o.even_e[1, n] + o.even_e[2, n])
        x = THETA_2 * x + THETA_1 * o.x[n] + THETA_3 * o.even_x[2, n]
        y = THETA_2 * y + THETA_1 * o.y[n] + THETA_3 * o.even_y[2, n]
        force = THETA_2 * o.even_force[1, n] + THETA_1 * o.force[n] + THETA_3 * o.even_force[2, n]
        x_side = o.grip[n] * force - o.b_xx[n] * d - o.b_xy[n] * e - o.c_xx[n] * x - o.c_xy[n] * y
        y_side = force - o.b_xy[n] * d - o.b_yy[n] * e - o.c_xy[n] * x - o.c_yy[n] * y
        o.source_x[n] = 2.0 / _MORE * (x_side - o.load[n] * o.sin_beta[n] - o.m[n] * a_x)
        o.source_y[n] = 2.0 / _MORE * (y_side - o.load[n] * o.cos_beta[n] - o.m[n] * a_y)


@kernel(fastmath=ALIKE)
def _begin(o: Any, shared: Shared) -> None:
    """At the second level: the error of the first one, by a start with a step twice as long.

    It is 1/14 of z⁰ + h v⁰ + h² (2a⁰ + a¹)/6 - z¹ with h twice as long.
    """
    h = 2.0 * shared.h
    for n in range(LANES):
        x = o.even_x[0, n]
        y = o.even_y[0, n]
        v_x = o.even_d[0, n]
        v_y = o.even_e[0, n]
        d = 2.0 / h * (o.x[n] - x) - v_x
        e = 2.0 / h * (o.y[n] - y) - v_y
        f_x = o.grip[n] * (2.0 * o.even_force[0, n] + o.force[n]) - 3.0 * o.load[n] * o.sin_beta[n]
        f_y = 2.0 * o.even_force[0, n] + o.force[n] - 3.0 * o.load[n] * o.cos_beta[n]
        f_x -= o.b_xx[n] * (2.0 * v_x + d) + o.b_xy[n] * (2.0 * v_y + e)
        f_x -= o.c_xx[n] * (2.0 * x + o.x[n]) + o.c_xy[n] * (2.0 * y + o.y[n])
        f_y -= o.b_xy[n] * (2.0 * v_x + d) + o.b_yy[n] * (2.0 * v_y + e)
        f_y -= o.c_xy[n] * (2.0 * x + o.x[n]) + o.c_yy[n] * (2.0 * y + o.y[n])
        part = h * h / 6.0 / o.m[n]
        o.t_x[STEPS, n] += (x + h * v_x + part * f_x - o.x[n]) / _START
        o.t_y[STEPS, n] += (y + h * v_y + part * f_y - o.y[n]) / _START
        o.even_x[1, n], o.even_x[0, n], o.even_y[1, n], o.even_y[0, n] = x, o.x[n], y, o.y[n]
        o.even_force[1, n], o.even_force[0, n] = o.even_force[0, n], o.force[n]


@kernel(fastmath=ALIKE)
def _hides(before: float, gap: float, after: float) -> bool:
    """Whether the gap in the middle is so near zero beside its bend that a patch, or a hole, may lie beside it.

    Its bend g₋ - 2g + g₊ is more than six times g, and all three have one sign.
    """
    return before * gap + after * gap > 8.0 * gap * gap and before * gap > 0.0 and after * gap >= 0.0


@kernel(fastmath=ALIKE, inline=False)
def _add_hidden(o: Any, gaps: Floats, at: int) -> None:
    """Add what three nodes leave out, in spacings: a patch, or a hole, between them.

    With the bend b = g₋ - 2g + g₊ a parabola has the extreme c = g - b/24 - (g₊ - g₋)²/(8b), and beyond its zeros
    the area 4/3 |c| √(2|c/b|).
    """
    for n in range(LANES):
        before = gaps[at + n]
        gap = gaps[at + PAIR + n]
        after = gaps[at + 2 * PAIR + n]
        bend = before - 2.0 * gap + after
        inverse = 1.0 / bend if bend != 0.0 else 0.0
        extreme = gap - bend / 24.0 - 0.125 * (after - before) ** 2 * inverse
        size = 4.0 / 3.0 * abs(extreme) * math.sqrt(2.0 * abs(extreme * inverse))
        o.missing[n] += size if _hides(before, gap, after) and extreme * gap < 0.0 else 0.0


@kernel(fastmath=ALIKE)
def _cut(gap: float, after: float) -> tuple[float, float]:
    """What a cell with an edge leaves out, over an eighth of a spacing, as a fraction; 0/1 without one."""
    return ((after + gap) ** 2, abs(after - gap)) if after * gap < 0.0 else (0.0, 1.0)


@kernel(fastmath=ALIKE, inline=False)
def _leave_out(o: Any, shared: Shared, tables: Floats) -> None:
    """`contact.midpoint.left_out` of pads that touch in part, where the contact was evaluated last.

    From both ends to the middle, where both halves find an edge: a pair of two such cells takes one division.
    """
    gaps = tables[shared.gaps_at :]
    at = 0
    half = shared.nodes // 2
    part = shared.length / shared.nodes
    last = (1 + half) * PAIR
    for n in range(LANES):
        gaps[last + PAIR + n], gaps[last + PAIR + LANES + n] = gaps[last + LANES + n], gaps[last + n]
        o.missing[n] = 0.0
    for pair in range(half + 1):
        share = 0.125 if pair < half else 0.0625
        hidden = 0
        for n in range(LANES):
            before = gaps[at + n]
            gap = gaps[at + PAIR + n]
            after = gaps[at + 2 * PAIR + n]
            one, over = _cut(gap, after)
            hidden |= 1 if _hides(before, gap, after) else 0
            before = gaps[at + LANES + n]
            gap = gaps[at + PAIR + LANES + n]
            after = gaps[at + 2 * PAIR + LANES + n]
            other, under = _cut(gap, after)
            hidden |= 1 if _hides(before, gap, after) else 0
            both = over * under
            o.missing[n] += share * (one * under + other * over) / both if both != 0.0 else 0.0
        if hidden:
            _add_hidden(o, gaps, at)
            _add_hidden(o, gaps, at + LANES)
        at += PAIR
    for n in range(LANES):
        o.missing[n] = part * o.k[n] * o.missing[n] if o.partly[n] > 0.0 else 0.0


@kernel(fastmath=ALIKE)
def _contact(o: Any, shared: Shared) -> None:
    """The derivative of the contact force at the older level of the motion.

    Along the motion dF_y/dt = ∂F_y/∂x (v_x - U) + ∂F_y/∂y v_y. This gives ∂F_y/∂x without another sum over nodes,
    as the sliding velocity never vanishes in a lane. All three rates are differences over two steps: a constant
    ∂F_y/∂x is exact, any other is right to h².
    """
    h = shared.h
    for n in range(LANES):
        d_slope = THETA_1 * (o.i_11[n] * o.grip[n] + o.i_12[n])  # by the force of the next level
        e_slope = THETA_1 * (o.i_12[n] * o.grip[n] + o.i_22[n])
        stiffness = o.k[n] * shared.length * o.touched[n]
        sliding = o.d[n] - o.belt[n]
        o.tangential[n] = 0.5 / h * (o.force[n] - o.earlier[n]) + stiffness * o.e[n]
        o.stiffness[n] = stiffness * sliding  # both slopes are multiplied by the sliding velocity
        feedback = sliding - 2.0 * h * (o.tangential[n] * d_slope - o.stiffness[n] * e_slope)
        o.feedback[n] = 1.0 / feedback if feedback != 0.0 else 0.0


@kernel(fastmath=ALIKE)
def _move(o: Any, shared: Shared, kind: int) -> None:
    """Carry one of them to the older level of the motion, by the derivative of its steps.

    It is the step for (δx, δy) without the load, where δF_y = ∂F_y/∂x δx + ∂F_y/∂y δy is solved for. Sources of
    steps stand beside the forces, and what nodes leave out is a part of δF_y.
    """
    h = shared.h
    by_steps = 1.0 if kind == STEPS else 0.0
    by_nodes = 2.0 if kind == NODES else 0.0
    for n in range(LANES):
        inertia = o.m[n] * (2.0 / (h * h))
        x_old = o.t_x_old[kind, n]
        y_old = o.t_y_old[kind, n]
        x = THETA_2 * o.t_x[kind, n] + (THETA_3 + THETA_1) * x_old
        y = THETA_2 * o.t_y[kind, n] + (THETA_3 + THETA_1) * y_old
        v_x = o.t_d[kind, n]
        v_y = o.t_e[kind, n]
        v_x = THETA_1 * (2.0 * v_x - o.t_d_old[kind, n])
        v_y = THETA_1 * (2.0 * v_y - o.t_e_old[kind, n])
        known = THETA_2 * o.t_force[kind, n] + THETA_3 * o.t_before[kind, n]
        g_1 = inertia * (o.t_x[kind, n] - x_old) - o.c_xx[n] * x - o.c_xy[n] * y + by_steps * o.source_x[n]
        g_2 = inertia * (o.t_y[kind, n] - y_old) - o.c_yy[n] * y - o.c_xy[n] * x + by_steps * o.source_y[n]
        g_1 += o.grip[n] * known - o.b_xx[n] * v_x - o.b_xy[n] * v_y
        g_2 += known - o.b_xy[n] * v_x - o.b_yy[n] * v_y
        d = o.i_11[n] * g_1 + o.i_12[n] * g_2
        e = o.i_12[n] * g_1 + o.i_22[n] * g_2
        d_slope = THETA_1 * (o.i_11[n] * o.grip[n] + o.i_12[n])
        e_slope = THETA_1 * (o.i_12[n] * o.grip[n] + o.i_22[n])
        x = x_old + 2.0 * h * d
        y = y_old + 2.0 * h * e
        own = by_nodes * o.missing[n] * (o.d[n] - o.belt[n])
        force = (o.tangential[n] * x - o.stiffness[n] * y - own) * o.feedback[n]
        d = d + d_slope * force
        e = e + e_slope * force
        o.t_x_old[kind, n], o.t_y_old[kind, n] = o.t_x[kind, n], o.t_y[kind, n]
        o.t_d_old[kind, n], o.t_e_old[kind, n] = o.t_d[kind, n], o.t_e[kind, n]
        o.t_x[kind, n] = x_old + 2.0 * h * d
        o.t_y[kind, n] = y_old + 2.0 * h * e
        o.t_d[kind, n] = d
        o.t_e[kind, n] = e
        o.t_before[kind, n] = o.t_force[kind, n]
        o.t_force[kind, n] = force


@kernel
def _size(error: float) -> float:
    """|error|; infinite where a motion has amplified it beyond all numbers."""
    return abs(error) if abs(error) < math.inf else math.inf


@kernel(fastmath=ALIKE)
def _note(o: Any) -> None:
    """The largest errors, and whether the shoe may have stuck for less than a step.

    That of the nodes is known from every second level, by chance too large or too small: it takes nothing off that
    of the steps.
    """
    for n in range(LANES):
        x = _size(o.t_x[STEPS, n])
        y = _size(o.t_y[STEPS, n])
        d = _size(o.t_d[STEPS, n])
        e = _size(o.t_e[STEPS, n])
        o.worst[0, 0, n], o.worst[0, 1, n] = max(o.worst[0, 0, n], x), max(o.worst[0, 1, n], y)
        o.worst[0, 2, n], o.worst[0, 3, n] = max(o.worst[0, 2, n], d), max(o.worst[0, 3, n], e)
        x_n = _size(o.t_x[NODES, n])
        y_n = _size(o.t_y[NODES, n])
        d_n = _size(o.t_d[NODES, n])
        e_n = _size(o.t_e[NODES, n])
        o.worst[1, 0, n], o.worst[1, 1, n] = max(o.worst[1, 0, n], x_n), max(o.worst[1, 1, n], y_n)
        o.worst[1, 2, n], o.worst[1, 3, n] = max(o.worst[1, 2, n], d_n), max(o.worst[1, 3, n], e_n)
        x = x + x_n
        y = y + y_n
        d = d + d_n
        e = e + e_n
        o.worst[2, 0, n], o.worst[2, 1, n] = max(o.worst[2, 0, n], x), max(o.worst[2, 1, n], y)
        o.worst[2, 2, n], o.worst[2, 3, n] = max(o.worst[2, 2, n], d), max(o.worst[2, 3, n], e)
        change = o.d[n] - o.d_old[n]
        dip = (1.0 / 8.0 + 1.0 / 6.0) * abs(change - o.change[n])  # of vx between two steps, and of d beside vx
        o.change[n] = change
        o.unsure[n] = 1.0 if o.side[n] * (o.d[n] - o.belt[n]) < dip + NEAR * d else o.unsure[n]


@kernel(inline=False)
def carry(o: Any, shared: Shared, tables: Floats, step: int) -> None:
    """Carry all that is carried along to the older level of the motion, behind a step that has been made."""
    _contact(o, shared)
    even = step % 2 == 0
    own = shared.first == STEPS
    if own and even and step > 0:
        _miss(o, shared)
    if own:  # by kinds that the compiler knows: otherwise it takes one lane at a time
        _move(o, shared, STEPS)
        _move(o, shared, NODES)
    if shared.beyond > DISTURBED:
        _move(o, shared, DISTURBED)
    if not own:
        return
    if step == 0:
        _begin(o, shared)
    _note(o)
    partly = 0
    for n in range(LANES):
        o.source_x[n] = o.source_y[n] = o.missing[n] = 0.0
        partly |= 1 if o.partly[n] > 0.0 else 0
    if even and partly:
        _leave_out(o, shared, tables)


@kernel(inline=False)
def renew(o: Any, shared: Shared, sizes: Floats, number: int, samples: int) -> None:
    """At a sample that ends a part of the run, note the sizes, and go on with disturbances of size one.

    The square of a size is twice the energy over the mass where the pad touches everywhere. It hardly swings then.
    """
    part = (number - 1) * PARTS // samples
    if number == 0 or (number < samples and number * PARTS // samples == part):
        return
    for n in range(LANES):
        x = o.t_x_old[DISTURBED, n]
        y = o.t_y_old[DISTURBED, n]
        d = o.t_d[DISTURBED, n]
        e = o.t_e[DISTURBED, n]
        springs = o.c_xx[n] * x * x + 2.0 * o.c_xy[n] * x * y + (o.c_yy[n] + o.k[n] * shared.length) * y * y
        size = math.sqrt(max(springs, 0.0) / o.m[n] + d * d + e * e)
        sizes[part, n] = size
        o.t_kept[n] = 1.0 / size if LEAST < size < MOST else 0.0
    for each in (o.t_x, o.t_y, o.t_x_old, o.t_y_old, o.t_d, o.t_e, o.t_d_old, o.t_e_old, o.t_force, o.t_before):
        for n in range(LANES):
            each[DISTURBED, n] = o.t_kept[n] * each[DISTURBED, n] if o.t_kept[n] > 0.0 else 0.0
    for n in range(LANES):
        if o.t_kept[n] == 0.0:
            o.t_d[DISTURBED, n] = 1.0
            o.t_x[DISTURBED, n] = shared.h
