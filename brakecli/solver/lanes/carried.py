"""What lanes carry along with their motions: a small disturbance, and the errors that steps and nodes make.

An error obeys the derivative of the steps, as a disturbance does, with what each step adds. Of the steps that is
what the motion misses of the scheme with steps twice as long, over what such steps miss more than these. Every
second level has one, and counts twice: one at every level would add up to nothing where a patch opens or closes.
Of the nodes it is what `contact.cells.left_out` finds at every second level.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.lanes.contact import leave_out
from brakecli.solver.lanes.records import ALIKE, LANES, Lane, Levels, Shared
from brakecli.solver.lanes.steps import THETA_1, forces, move, prepare, solve, some
from brakecli.solver.records import PARTS
from brakecli.solver.tangent import LEAST, MOST

_MORE = 7.0  # times that steps twice as long miss more, as errors fall with h³ at least
_START = 14.0  # the same of x after a start twice as long, over what a start is off by, as that falls with h⁴
NEAR = 3.0
"""Sliding velocity over its error, from which on a stick may have been missed."""


@kernel(fastmath=ALIKE)
def _miss(o: Lane, shared: Shared) -> None:
    """What the motion misses of (6) and (7) with steps twice as long, between the last three even levels.

    The source is 2/7 of g + θ1 (φ, 1) F^{n+1} - a w.
    """
    s = o.motion
    c = o.coarse
    rate = 0.5 * shared.rate
    gain = 4.0 * shared.h * THETA_1
    now = 1.0 - THETA_1
    for n in range(LANES):
        prepare(o, c, n, rate)
        d = 0.5 * rate * (s.x[n] - c.x_old[n])
        e = 0.5 * rate * (s.y[n] - c.y_old[n])
        f_x, f_y = forces(o, n, gain * d, gain * e, now * d, now * e, THETA_1 * s.force[n])
        inertia = 2.0 * rate * o.m[n]
        o.by_steps.source_x[n] = 2.0 / _MORE * (c.g_1[n] + f_x - inertia * d)
        o.by_steps.source_y[n] = 2.0 / _MORE * (c.g_2[n] + f_y - inertia * e)
        move(c, n, s.x[n], s.y[n], d, e, s.force[n])


@kernel(fastmath=ALIKE)
def _begin(o: Lane, shared: Shared) -> None:
    """At the second level: the error of the first one, by a start with a step h twice as long.

    It is 1/14 of z⁰ + h v⁰ + h² (2a⁰ + a¹)/6 - z¹.
    """
    s = o.motion
    c = o.coarse
    h = 2.0 * shared.h
    for n in range(LANES):
        x = c.x[n]
        y = c.y[n]
        v_x = s.d_old[n]
        v_y = s.e_old[n]
        d = shared.rate * (s.x[n] - x) - v_x
        e = shared.rate * (s.y[n] - y) - v_y
        force = 2.0 * c.force[n] + s.force[n]
        f_x, f_y = forces(o, n, 2.0 * x + s.x[n], 2.0 * y + s.y[n], 2.0 * v_x + d, 2.0 * v_y + e, force)
        factor = h * h / 6.0 / o.m[n]
        o.by_steps.x[n] += (x + h * v_x + factor * (f_x + 3.0 * s.source_x[n]) - s.x[n]) / _START
        o.by_steps.y[n] += (y + h * v_y + factor * (f_y + 3.0 * s.source_y[n]) - s.y[n]) / _START
        move(c, n, s.x[n], s.y[n], v_x, v_y, s.force[n])


@kernel(fastmath=ALIKE)
def _contact(o: Lane, shared: Shared, n: int) -> None:
    """The derivative of the contact force at the older level of the motion.

    Along the motion dF_y/dt = ∂F_y/∂x (v_x - U) + ∂F_y/∂y v_y. This gives ∂F_y/∂x without another sum over nodes,
    as the sliding velocity never vanishes in a lane. All three rates are differences over two steps: a constant
    ∂F_y/∂x is exact, any other is right to h².
    """
    s = o.motion
    d_slope = THETA_1 * (o.i_11[n] * o.grip[n] + o.i_12[n])  # by the force of the next level
    e_slope = THETA_1 * (o.i_12[n] * o.grip[n] + o.i_22[n])
    stiffness = o.k[n] * shared.length * o.touched[n]
    sliding = s.d[n] - o.belt[n]
    o.tangential[n] = 0.5 * shared.rate * (s.force[n] - o.earlier[n]) + stiffness * s.e[n]
    o.stiffness[n] = stiffness * sliding  # both slopes are multiplied by the sliding velocity
    feedback = sliding - 2.0 * shared.h * (o.tangential[n] * d_slope - o.stiffness[n] * e_slope)
    o.feedback[n] = 1.0 / feedback if feedback != 0.0 else 0.0


@kernel(fastmath=ALIKE)
def _go_on(o: Lane, shared: Shared, s: Levels, n: int, own: float) -> None:
    """Carry one of them to the older level of the motion, by the derivative of its steps.

    It is the step for (δx, δy) with its own sources, where δF_y = ∂F_y/∂x δx + ∂F_y/∂y δy is solved for; `own` is
    a part of it (N) times the sliding velocity.
    """
    prepare(o, s, n, shared.rate)
    x, y, d, e = solve(o, s, n, shared.h, 0.0)
    force = (o.tangential[n] * x - o.stiffness[n] * y - own) * o.feedback[n]
    x, y, d, e = solve(o, s, n, shared.h, force)
    move(s, n, x, y, d, e, force)


@kernel(fastmath=ALIKE)
def _note(o: Lane, n: int, component: int, by_steps: float, by_nodes: float) -> float:
    """The largest errors of a component; the sum of both.

    That of the nodes is known from every second level, by chance too large or too small: it takes nothing off that
    of the steps. Both are infinite where a motion has amplified them beyond all numbers.
    """
    steps = abs(by_steps) if abs(by_steps) < math.inf else math.inf
    nodes = abs(by_nodes) if abs(by_nodes) < math.inf else math.inf
    o.worst[0, component, n] = max(o.worst[0, component, n], steps)
    o.worst[1, component, n] = max(o.worst[1, component, n], nodes)
    o.worst[2, component, n] = max(o.worst[2, component, n], steps + nodes)
    return steps + nodes


@kernel(inline=False)
def carry(o: Lane, shared: Shared, gaps: Floats, step: int) -> None:
    """Carry all that is carried along to the older level of the motion, behind a step that has been made."""
    even = step % 2 == 0
    if even and step > 0:
        _miss(o, shared)
    for n in range(LANES):
        _contact(o, shared, n)
        _go_on(o, shared, o.by_steps, n, 0.0)
        _go_on(o, shared, o.by_nodes, n, 2.0 * o.missing[n] * (o.motion.d[n] - o.belt[n]))
        _go_on(o, shared, o.disturbed, n, 0.0)
    if step == 0:
        _begin(o, shared)
    steps = o.by_steps
    nodes = o.by_nodes
    for n in range(LANES):
        _note(o, n, 0, steps.x[n], nodes.x[n])
        _note(o, n, 1, steps.y[n], nodes.y[n])
        error = _note(o, n, 2, steps.d[n], nodes.d[n])
        _note(o, n, 3, steps.e[n], nodes.e[n])
        sliding = o.side[n] * (o.motion.d[n] - o.belt[n])
        change = o.motion.d[n] - o.motion.d_old[n]
        dip = (1.0 / 8.0 + 1.0 / 6.0) * abs(change - o.change[n])  # of vx between two steps, and of d beside vx
        o.change[n] = change
        o.unsure[n] = 1.0 if sliding < dip + NEAR * error else o.unsure[n]
        steps.source_x[n] = steps.source_y[n] = o.missing[n] = 0.0
    if even and some(o.partly):
        leave_out(o, gaps, shared.length / shared.nodes)


@kernel(inline=False)
def renew(o: Lane, shared: Shared, sizes: Floats, number: int, samples: int) -> None:
    """At a sample that ends a part of the run, note the growth, and go on with disturbances of size one.

    The square of a size is twice the energy over the mass where the pad touches everywhere. It hardly swings then.
    """
    row = (number - 1) * PARTS // samples
    if number == 0 or (number < samples and number * PARTS // samples == row):
        return
    s = o.disturbed
    for n in range(LANES):
        x = s.x_old[n]
        y = s.y_old[n]
        springs = o.c_xx[n] * x * x + 2.0 * o.c_xy[n] * x * y + (o.c_yy[n] + o.k[n] * shared.length) * y * y
        size = math.sqrt(max(springs, 0.0) / o.m[n] + s.d[n] * s.d[n] + s.e[n] * s.e[n])
        sizes[row, n] = min(max(size, LEAST), MOST)
        o.shrink[n] = 1.0 / sizes[row, n]
    for values in (s.x, s.y, s.x_old, s.y_old, s.d, s.e, s.d_old, s.e_old, s.force, s.before):
        for n in range(LANES):
            values[n] *= o.shrink[n]
