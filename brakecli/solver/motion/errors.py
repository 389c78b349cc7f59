"""What is carried along with a motion in Runge-Kutta steps: its own error, and a small disturbance.

The error e of a motion u obeys e' = A(t) e + u' - f(u). What the continuous solution of each step misses of
(6)-(7), and what the rule for the contact leaves out of its force, is carried on as a disturbance is. A step is
cut into as many parts as Gauss's rule has places: in each, A and what is missed are those of its place.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BY_NODES, BY_STEPS, STAGES, V_X, V_Y, X, Y
from brakecli.solver.contact import CELLS
from brakecli.solver.contact.cells import left_out
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion.forces import NEAR, act, cone
from brakecli.solver.motion.tableaus import END_STAGE, interpolated_both, reach
from brakecli.solver.phases import OPEN, STICK, side_of
from brakecli.solver.plant import Plant
from brakecli.solver.records import SPANS

_RULES = [np.polynomial.legendre.leggauss(points) for points in (5, 3, 12)]
POINTS = np.array([len(places) for places, _ in _RULES])
"""Places in a step of DOP853, of DOPRI5, whose continuous solutions are of order seven and four, and in a step in
which patches come or go."""
PLACES, SHARES = (np.array([np.resize(0.5 * rule[i] + 0.5 * (1 - i), 12) for rule in _RULES]) for i in (0, 1))


@kernel(inline=False)
def _ahead(p: Plant, tau: float) -> None:
    """Carry errors and disturbance by exp(A τ) e = Σ (A τ)^n e/n!, with the contact at the last place."""
    c = p.c
    m = p.block
    grip = -side_of(m.phase) * c.phi
    stiffness = p.runge.touch[STAGES - 1, 1]
    tangential = p.runge.touch[STAGES - 1, 2]
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
    for j in range(m.count):
        e = m.columns[j]
        x = e[X]
        y = e[Y]
        u = e[V_X]
        w = e[V_Y]
        d_x = x
        d_y = y
        d_u = u
        d_w = w
        for n in range(1, 5):  # the span is up to 0.22 of a step, which turns by less than half a radian
            factor = tau / n
            a_x = x_x * d_x + x_y * d_y + x_u * d_u + x_w * d_w
            a_y = y_x * d_x + y_y * d_y + y_u * d_u + y_w * d_w
            d_x = factor * d_u
            d_y = factor * d_w
            d_u = factor * a_x
            d_w = factor * a_y
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
def _beyond(p: Plant) -> int:
    """1 where the error is more than the most; in the first 16th of a run, when the motion is small, 0."""
    m = p.block
    t = p.tangent
    if t.knows == 0:
        return 0
    rounding = 1e-12 * max(m.largest[X], m.largest[Y])
    for i in range(4):
        size = max(m.largest[i], abs(p.runge.end[i]))
        error = abs(m.columns[BY_STEPS, i])
        if size > rounding * (t.rate if i >= V_X else 1.0) and not error <= t.most * size:
            return 1 if p.runge.level > p.grid.samples // 16 else 0
    return 0


@kernel
def _rule(p: Plant) -> int:
    """How many places of the step are looked at, as a row of `POINTS`."""
    m = p.block
    r = p.runge
    pad = p.layer.pad
    changes = abs(r.touch[0, 1] - r.touch[END_STAGE, 1])
    opens = m.phase != OPEN and r.begin[Y] + reach(r, Y) > pad.full_up_to
    # where much of the pad comes or goes in the step, more are
    if changes > 0.3 * 2.0 * pad.half_length * pad.k or (r.pair == 0 and opens):
        return 2
    return 0 if changes > 0.0 else r.pair


@kernel(inline=False)
def grow(p: Plant, tables: Floats, scratch: Floats, h: float) -> None:
    """Carry error and disturbance along the step that has been made, and add what the step makes of its own.

    At each place of Gauss's rule that is its share of u' - f(u), and of what cells leave out of F_y.
    """
    c = p.c
    m = p.block
    r = p.runge
    t = p.tangent
    e = m.columns[BY_STEPS]
    n = m.columns[BY_NODES]
    step = r.length
    rule = _rule(p)
    light = r.light
    r.light = 0
    begin = 0.0
    t.moved = 0.0
    worst = t.worst[min(r.level * SPANS // p.grid.samples, SPANS - 1)]
    for node in range(POINTS[rule]):
        if stopped(p.layer.pad.signals):  # an evaluation may take as long as a step
            break
        theta = PLACES[rule, node]
        span = step * SHARES[rule, node]
        before = theta - begin
        begin += SHARES[rule, node]
        for i in range(4):
            r.w[i], r.rates[i] = interpolated_both(r, i, theta)
        act(p, tables, scratch, STAGES - 1, theta * step, r.w)
        missing = left_out(r.w[Y], p.layer, scratch) / c.m if p.layer.contact.kind == CELLS else 0.0
        _ahead(p, before * step)
        for i in range(4):
            if m.phase != STICK or i in (Y, V_Y):
                e[i] += span * (r.rates[i] / step - r.slopes[STAGES - 1, i])
        n[V_X] += span * side_of(m.phase) * c.phi * missing
        n[V_Y] -= span * missing
        moved = abs(e[V_X] + n[V_X])
        if m.phase == STICK:
            moved = cone(p, theta * step, r.w)[1]
        t.moved = max(t.moved, moved)
        _ahead(p, span - before * step)
        for i in range(4):
            worst[0, i] = max(worst[0, i], _size(e[i]))
            worst[1, i] = max(worst[1, i], _size(n[i]))
            # each is known to a part of itself: neither takes anything off the other
            worst[2, i] = max(worst[2, i], _size(e[i]) + _size(n[i]))
    _ahead(p, h - step)
    if c.phi > 0.0 and r.lowest < NEAR * t.moved:  # without friction nothing happens there
        t.unsure = min(t.unsure, m.base + m.time)
    t.beyond = _beyond(p)
    r.light = light
