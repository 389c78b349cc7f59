"""What is carried along with an event-driven motion: a small disturbance, and the motion's own error.

The error e of a motion u obeys e' = A(t) e + u' - f(u). What the continuous solution of each step misses of
(6)-(7), and what the rule for the contact leaves out of its force, is carried on as a disturbance is. A step is
cut into as many parts as Gauss's rule has places: in each, A and what is missed are those of its place.
"""

import math
from typing import Any

import numpy as np

from brakecli.solver import runge_kutta
from brakecli.solver.arrays import Floats
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.contact.midpoint import left_out
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion.phases import OPEN, STICK, side_of
from brakecli.solver.motion.record import V_X, V_Y, X, Y
from brakecli.solver.motions import STAGES
from brakecli.solver.plant import Plant
from brakecli.solver.records import DISTURBED, SPANS
from brakecli.solver.runge_kutta import END_STAGE
from brakecli.solver.schemes.event_driven import phases

_RULES = [np.polynomial.legendre.leggauss(points) for points in (5, 3, 12)]
POINTS = np.array([len(places) for places, _ in _RULES])
"""Places in a step of DOP853, of DOPRI5, whose continuous solutions are of order seven and four, and in a step in
which patches come or go."""
PLACES, SHARES = (np.array([np.resize(0.5 * each[i] + 0.5 * (1 - i), 12) for each in _RULES]) for i in (0, 1))
_TERMS = 4
"""Terms of the series over up to 0.22 of a step, in which the fastest motion turns by less than half a radian."""
_AT = STAGES - 1
_FIRST = 16
_ROUNDING = 1e-12
"""Part of a run in which no error is too large, and what of the largest place is rounding."""
_MUCH = 0.3
"""Part of the pad that comes or goes in a step, from which on more places are looked at."""


@kernel(inline=False)
def _ahead(p: Plant, tau: float) -> None:
    """Carry errors and disturbance by exp(A τ) e = Σ (A τ)^n e/n!, with the contact at the last place."""
    c = p.c
    m = p.motion
    grip = -side_of(m.phase) * c.phi
    stiffness = m.touch[_AT, 0]
    tangential = m.touch[_AT, 1]
    free = 0.0 if m.phase == STICK else 1.0 / c.m
    whole = 1.0 / c.m
    x_x = free * (grip * tangential - c.c_xx)
    x_y = free * (-grip * stiffness - c.c_xy)
    y_x = whole * (tangential - c.c_xy)
    y_y = whole * (-stiffness - c.c_yy)
    x_u = -free * c.b_xx
    x_w = -free * c.b_xy
    y_u = -whole * c.b_xy
    y_w = -whole * c.b_yy
    for kind in range(DISTURBED + p.tangent.on):
        e = p.tangent.error[kind]
        x = e[X]
        y = e[Y]
        u = e[V_X]
        w = e[V_Y]
        d_x = x
        d_y = y
        d_u = u
        d_w = w
        for n in range(1, _TERMS + 1):
            part = tau / n
            a_x = x_x * d_x + x_y * d_y + x_u * d_u + x_w * d_w
            a_y = y_x * d_x + y_y * d_y + y_u * d_u + y_w * d_w
            d_x = part * d_u
            d_y = part * d_w
            d_u = part * a_x
            d_w = part * a_y
            x = x + d_x
            y = y + d_y
            u = u + d_u
            w = w + d_w
        e[X] = x
        e[Y] = y
        e[V_X] = u
        e[V_Y] = w


@kernel
def _size(error: float) -> float:
    """Its absolute value; infinite where a motion has amplified it beyond all numbers."""
    return abs(error) if abs(error) < math.inf else math.inf


@kernel(inline=False)
def _beyond(p: Plant, grid: Any) -> int:
    """1 where the error is more than the most; at first, when the motion is small, it says nothing."""
    m = p.motion
    t = p.tangent
    if t.knows == 0:
        return 0
    rounding = _ROUNDING * max(m.largest[X], m.largest[Y])
    for i in range(4):
        size = max(m.largest[i], abs(m.end[i]))
        error = abs(t.error[0, i])
        if size > rounding * (t.rate if i >= V_X else 1.0) and not error <= t.most * size:
            return 1 if m.level > grid.samples // _FIRST else 0
    return 0


@kernel(inline=False)
def grow(p: Plant, tables: Floats, scratch: Floats, h: float, grid: Any) -> None:
    """Carry error and disturbance along the step that has been made, and add what the step makes of its own.

    At each place of Gauss's rule that is its share of u' - f(u), and of what the midpoint rule leaves out of F_y.
    """
    c = p.c
    m = p.motion
    t = p.tangent
    step = p.motion.step_done
    rule = m.pair
    light = m.light
    m.light = 0
    pad = p.layer.pad
    changes = abs(m.touch[0, 0] - m.touch[END_STAGE, 0])
    opens = m.phase != OPEN and m.begin[Y] + runge_kutta.reach(m, Y) > pad.full_up_to
    if changes > _MUCH * 2.0 * pad.half_length * pad.k or (m.pair == 0 and opens):
        rule = 2
    elif changes > 0.0:
        rule = 0
    e = t.error[0]
    n = t.error[1]
    w = t.error[DISTURBED]
    begin = 0.0
    t.moved = 0.0
    w[X] = t.x
    w[Y] = t.y
    w[V_X] = t.v_x
    w[V_Y] = t.v_y
    worst = t.worst[min(m.level * SPANS // grid.samples, SPANS - 1)]
    for place in range(POINTS[rule]):
        if stopped(pad.signals):  # an evaluation may take as long as a step
            break
        theta = PLACES[rule, place]
        part = step * SHARES[rule, place]
        at_x, slope_x = runge_kutta.interpolated_both(m, X, theta)
        at_y, slope_y = runge_kutta.interpolated_both(m, Y, theta)
        at_v_x, slope_v_x = runge_kutta.interpolated_both(m, V_X, theta)
        at_v_y, slope_v_y = runge_kutta.interpolated_both(m, V_Y, theta)
        phases.find_slopes(p, tables, scratch, _AT, theta * step, at_x, at_y, at_v_x, at_v_y)
        missing = left_out(at_y, p.layer, tables, scratch) / c.m if p.layer.contact.kind == MIDPOINT else 0.0
        before = theta - begin
        _ahead(p, before * step)
        d_x = part * (slope_x / step - m.slopes[_AT, X])
        d_y = part * (slope_y / step - m.slopes[_AT, Y])
        d_u = part * (slope_v_x / step - m.slopes[_AT, V_X])
        d_w = part * (slope_v_y / step - m.slopes[_AT, V_Y])
        n_u = part * side_of(m.phase) * c.phi * missing
        n_w = -part * missing
        if m.phase == STICK:
            d_x = d_u = 0.0
        e[X], e[Y], e[V_X], e[V_Y] = e[X] + d_x, e[Y] + d_y, e[V_X] + d_u, e[V_Y] + d_w
        n[V_X], n[V_Y] = n[V_X] + n_u, n[V_Y] + n_w
        moved = abs(e[V_X] + n[V_X])
        if m.phase == STICK:
            moved = phases.cone(p, theta * step, at_x, at_y, at_v_x, at_v_y)[1]
        t.moved = max(t.moved, moved)
        _ahead(p, part - before * step)
        begin += SHARES[rule, place]
        for i in range(4):
            worst[0, i] = max(worst[0, i], _size(e[i]))
            worst[1, i] = max(worst[1, i], _size(n[i]))
            worst[2, i] = max(worst[2, i], _size(e[i] + n[i]))
    _ahead(p, h - step)
    if c.phi > 0.0 and m.lowest < phases.NEAR * t.moved:  # without friction nothing happens there
        t.unsure = min(t.unsure, m.time + m.tau)
    t.x = w[X]
    t.y = w[Y]
    t.v_x = w[V_X]
    t.v_y = w[V_Y]
    t.beyond = _beyond(p, grid)
    m.light = light
