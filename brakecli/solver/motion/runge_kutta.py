"""Propagation on rough pads: Runge-Kutta steps of the motion and its columns alike, on a grid of time.

The grid does not depend on the state, so the end is a smooth function of the state, of the span and of the
parameters, as long as the sequence of phases is the same. An event divides a step of the grid into parts. It is
found by the cubic through the margins at both ends and their rates, and located on steps that are tried.

Lift-off is no event, because the normal force of a rough pad is continuous.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.cells import press
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.motion.locate import NO_EVENT
from brakecli.solver.motion.phases import PULL, STICK, held, side_of
from brakecli.solver.motion.record import BELT, LOAD, RUNGE_STAGES, V_X, V_Y, X, Y
from brakecli.solver.plant import Plant
from brakecli.solver.runge_kutta import END_STAGE, NODES, A

_A = A[1, :RUNGE_STAGES, :RUNGE_STAGES].copy()
_B = A[1, END_STAGE, :RUNGE_STAGES].copy()
_C = NODES[1, :RUNGE_STAGES].copy()
"""DOPRI5, of order five. On 60 random rough pads its median error is a seventh of that of the classical method of
order four at 160 evaluations of the contact to a period, and a fourth at 320. From 320 on DOP853 is worse than
both, because the force of partial contact has kinks in its second derivative."""
_ROUNDING = 1e-14  # of the terms of a margin: a margin that is negative by less is zero
LANDING = 16  # parts of a step in which the whole pad lands or lifts off: the force has a kink there
_STRETCHED = 1.5  # times the longest part, up to which the last one is stretched: none is shorter than half of it
_SEEKS = 60  # steps of the search for an event
_ABOVE = 0.75  # of a part at which a margin is negative, the middle of a bracket from its half on
# of the rounding of a margin, and of a step: ends of that search
_CERTAIN = 0.01
_NARROWEST = 1e-16


@kernel(inline=False)
def touch(p: Plant, tables: Floats, since: float, x: float, y: float, steeply: bool) -> None:
    """The contact of a place that is reached `since` the begin of the step."""
    m = p.block
    place = m.anchor if m.phase == STICK else x - m.z[BELT] * (m.time + since)
    press(p.cells, tables, place, y, steeply)


@kernel(inline=False)
def rate(p: Plant, phase: int, z: Floats, found: Floats) -> None:
    """The derivative of x, y, v_x and v_y by time, (6)-(7), with the contact found last."""
    c = p.c
    load = p.block.z[LOAD]
    force = p.cells.force
    found[X] = z[V_X]
    found[Y] = z[V_Y]
    found[V_X] = 0.0
    if phase != STICK:
        against = c.b_xx * z[V_X] + c.b_xy * z[V_Y] + c.c_xx * z[X] + c.c_xy * z[Y] + load * c.sin_beta
        found[V_X] = (-side_of(phase) * c.phi * force - against) / c.m  # Eq. (6) with Eq. (5)
    against = c.b_xy * z[V_X] + c.b_yy * z[V_Y] + c.c_xy * z[X] + c.c_yy * z[Y] + load * c.cos_beta
    found[V_Y] = (force - against) / c.m  # Eq. (7)


@kernel
def _rate_of(p: Plant, w: Floats, found: Floats) -> None:
    """The same of a column: ∂F_y/∂x δx + ∂F_y/∂y δy takes the place of F_y. In stick δẍ = 0."""
    c = p.c
    phase = p.block.phase
    pressed = p.cells.slope * w[X] - p.cells.touching * w[Y]
    found[X] = w[V_X]
    found[Y] = w[V_Y]
    found[V_X] = 0.0
    if phase != STICK:
        against = c.b_xx * w[V_X] + c.b_xy * w[V_Y] + c.c_xx * w[X] + c.c_xy * w[Y]
        found[V_X] = (-side_of(phase) * c.phi * pressed - against) / c.m  # Eq. (6)
    against = c.b_xy * w[V_X] + c.b_yy * w[V_Y] + c.c_xy * w[X] + c.c_yy * w[Y]
    found[V_Y] = (pressed - against) / c.m  # Eq. (7)


@kernel(inline=False)
def _step(p: Plant, tables: Floats, h: float, count: int) -> None:
    """A step from the begin to `end`, z + h Σ B_s k_s, and so many columns; stages are at z + h Σ A_sr k_r.

    The contact at the begin is known, and that at the end is found.
    """
    m = p.block
    r = p.runge
    f = p.cells
    for s in range(RUNGE_STAGES):
        for i in range(4):
            total = 0.0
            for q in range(s):
                total += _A[s, q] * r.k[q, i]
            r.w[i] = m.begin[i] + h * total
        if s == 0:
            f.force = r.force
            f.slope = r.slope
            f.touching = r.touching
        else:
            touch(p, tables, _C[s] * h, r.w[X], r.w[Y], count > 0)
        rate(p, m.phase, r.w, r.k[s])
        for j in range(count):
            for i in range(4):
                total = 0.0
                for q in range(s):
                    total += _A[s, q] * r.k_columns[q, j, i]
                r.w[i] = m.columns[j, i] + h * total
            _rate_of(p, r.w, r.k_columns[s, j])
    for i in range(4):
        total = 0.0
        for q in range(RUNGE_STAGES):
            total += _B[q] * r.k[q, i]
        r.end[i] = m.begin[i] + h * total
        for j in range(count):
            total = 0.0
            for q in range(RUNGE_STAGES):
                total += _B[q] * r.k_columns[q, j, i]
            r.end_columns[j, i] = m.columns[j, i] + h * total
    touch(p, tables, h, r.end[X], r.end[Y], count > 0)
    _find_margins(p, r.end)


@kernel
def _needed(p: Plant, z: Floats) -> float:
    """The friction force (N) that stick takes, (4) and (6): b_xx ẋ + b_xy ẏ + c_xx x + c_xy y + Q_x."""
    c = p.c
    links = c.b_xx * z[V_X] + c.b_xy * z[V_Y] + c.c_xx * z[X] + c.c_xy * z[Y]
    return links + p.block.z[LOAD] * c.sin_beta  # type: ignore[no-any-return]


@kernel(inline=False)
def _find_margins(p: Plant, z: Floats) -> None:
    """Margins at a state, their rates and that of the state, from the contact found there.

    In slip the margin is side (ẋ - U); in stick there are two, φ F_y - needed and φ F_y + needed.
    """
    c = p.c
    m = p.block
    r = p.runge
    rate(p, m.phase, z, r.rates)
    if m.phase != STICK:
        side = side_of(m.phase)
        r.margin[0] = side * (z[V_X] - m.z[BELT])
        r.margin_rate[0] = side * r.rates[V_X]
        r.margin[1] = 0.0
        r.margin_rate[1] = 0.0
        return
    needed = _needed(p, z)
    bound = c.phi * p.cells.force
    change = c.b_xy * r.rates[V_Y] + c.c_xx * z[V_X] + c.c_xy * z[V_Y]
    opens = -c.phi * p.cells.touching * z[V_Y]
    r.margin[0] = bound - needed
    r.margin_rate[0] = opens - change
    r.margin[1] = bound + needed
    r.margin_rate[1] = opens + change


@kernel(inline=False)
def rounding(p: Plant, phase: int, z: Floats) -> float:
    """The rounding of the margins at a state: 1e-14 of the sum of the sizes of their terms."""
    c = p.c
    m = p.block
    if phase != STICK:
        return _ROUNDING * (abs(m.z[BELT]) + abs(z[V_X]))  # type: ignore[no-any-return]
    links = c.b_xx * abs(z[V_X]) + abs(c.b_xy * z[V_Y]) + c.c_xx * abs(z[X]) + abs(c.c_xy * z[Y])
    return _ROUNDING * (links + abs(m.z[LOAD] * c.sin_beta) + c.phi * p.cells.force)  # type: ignore[no-any-return]


@kernel(inline=False)
def held_phase(p: Plant) -> int:
    """The phase at the motion reached, which moves with the wheel: stick where friction can hold it, (3)-(5)."""
    m = p.block
    r = p.runge
    needed = _needed(p, m.z)
    bound = p.c.phi * p.cells.force
    noise = rounding(p, STICK, m.z)
    phase = held(bound - needed, bound + needed, noise, noise)
    if phase == STICK:
        r.least_hold = min(r.least_hold, max(bound - abs(needed), 0.0))
    else:
        r.least_pass = min(r.least_pass, abs(needed) - bound)
    return phase


@kernel(inline=False)
def falls(p: Plant) -> float:
    """The rate of the margin that has run out, its gradient in `normal`, and the rates before and behind."""
    c = p.c
    m = p.block
    f = p.cells
    rate(p, m.old, m.z, m.arrives)
    rate(p, m.phase, m.z, m.leaves)
    if m.old != STICK:
        for i in range(4):
            m.normal[i] = 0.0
        m.normal[V_X] = side_of(m.old)
        return side_of(m.old) * m.arrives[V_X]  # type: ignore[no-any-return]
    sign = -1.0 if m.which == PULL else 1.0
    m.normal[X] = c.phi * f.slope + sign * c.c_xx
    m.normal[Y] = -c.phi * f.touching + sign * c.c_xy
    m.normal[V_X] = sign * c.b_xx
    m.normal[V_Y] = sign * c.b_xy
    change = c.b_xy * m.arrives[V_Y] + c.c_xx * m.z[V_X] + c.c_xy * m.z[V_Y]
    return sign * change - c.phi * f.touching * m.z[V_Y]  # type: ignore[no-any-return]


@kernel(inline=False)
def look(p: Plant) -> None:
    """Make the contact found last, and the margins of the phase, those of the begin of the next step."""
    r = p.runge
    _find_margins(p, p.block.z)
    r.force = p.cells.force
    r.slope = p.cells.slope
    r.touching = p.cells.touching
    for i in range(2):
        r.first_margin[i] = r.margin[i]
        r.first_rate[i] = r.margin_rate[i]


@kernel(inline=False)
def _located(p: Plant, tables: Floats, h: float, high: float, which: int) -> float:
    """The part of the step h at which a margin is zero; at its part `high` it is negative.

    Newton's method, kept inside a bracket. A phase begins where its margin is zero: it must have risen before.
    """
    r = p.runge
    low = 0.0
    noise = rounding(p, p.block.phase, r.end)
    begin = r.first_margin[which]
    if begin > noise:
        _step(p, tables, high * h, 0)
        part = high * begin / (begin - r.margin[which])
    else:
        for _ in range(_SEEKS):
            part = 0.5 * high
            _step(p, tables, part * h, 0)
            if r.margin[which] > 0.0:
                low = part
                part = _ABOVE * high
                break
            high = part
        if low == 0.0:
            return 0.0
    for _ in range(_SEEKS):
        _step(p, tables, part * h, 0)
        value = r.margin[which]
        if value > 0.0:
            low = part
        else:
            high = part
        if abs(value) <= _CERTAIN * noise or high - low <= _NARROWEST:
            break
        slope = h * r.margin_rate[which]
        rest = -value / slope if slope < 0.0 else 2.0
        if not low < part + rest < high:
            rest = 0.5 * (low + high) - part
        if part + rest == part:
            break
        part += rest
    return part  # type: ignore[no-any-return]


@kernel(inline=False)
def _first_crossing(p: Plant, tables: Floats, h: float) -> tuple[int, float]:
    """The margin that ends the phase within the step that has been made, and the part of the step until then.

    Notes how near margins come to zero.
    """
    m = p.block
    r = p.runge
    noise = rounding(p, m.phase, r.end)
    dips = False
    which = NO_EVENT
    high = 1.0
    first = 2.0
    number = 2 if m.phase == STICK else 1
    for i in range(number):
        if r.margin[i] < -noise:
            fall = r.first_margin[i] - r.margin[i]
            part = r.first_margin[i] / fall if fall > 0.0 else 0.0
            if part < first:
                which = i
                first = part
    if which != NO_EVENT:
        return which, _located(p, tables, h, high, which)
    for i in range(number):
        part, value = lowest(r.first_margin[i], h * r.first_rate[i], r.margin[i], h * r.margin_rate[i])
        if part >= 0.0 and value < -noise:
            dips = True
            _step(p, tables, part * h, 0)
            if r.margin[i] < -noise:
                return i, _located(p, tables, h, part, i)
            _step(p, tables, h, 0)
        if part >= 0.0 and r.first_margin[i] > noise:  # not at the event that the phase begins with
            if m.phase != STICK:
                r.least_slide = min(r.least_slide, max(value, 0.0))
            else:
                r.least_hold = min(r.least_hold, max(value, 0.0))
    if dips and m.count > 0:
        _step(p, tables, h, m.count)  # as it was before the dip was tried
    return NO_EVENT, 1.0


@kernel
def _note(p: Plant, h: float) -> None:
    """Note extremes and shares of the step that has been made, from x, y and their rates at both ends."""
    m = p.block
    r = p.runge
    for i in range(2):
        begin = m.begin[i]
        end = r.end[i]
        slope = h * m.begin[V_X + i]
        rise = h * r.end[V_X + i]
        m.low[i] = min(m.low[i], min(end, lowest(begin, slope, end, rise)[1]))
        m.high[i] = max(m.high[i], max(end, -lowest(-begin, -slope, -end, -rise)[1]))
    m.spent[m.phase] += h
    touching = p.cells.touching
    r.open += 0.5 * h * ((1.0 if r.touching == 0.0 else 0.0) + (1.0 if touching == 0.0 else 0.0))
    part = touching / p.cells.stiffness
    r.least_contact = min(r.least_contact, part)
    r.most_contact = max(r.most_contact, part)


@kernel(inline=False)
def take(p: Plant, tables: Floats, left: float) -> None:
    """Take a step of the grid, or the part of one that is left, up to an event at most."""
    m = p.block
    r = p.runge
    h = left if left <= _STRETCHED * m.h else m.h
    _step(p, tables, h, m.count)
    if m.h == r.grid and (r.touching == 0.0) != (p.cells.touching == 0.0):
        m.h = r.grid / LANDING
        h = left if left <= _STRETCHED * m.h else m.h
        _step(p, tables, h, m.count)
    which, part = _first_crossing(p, tables, h)
    m.which = NO_EVENT
    if which != NO_EVENT:
        m.which = PULL + which
        h = part * h
        _step(p, tables, h, m.count)
    m.span = h
    m.part = 1.0
    _note(p, h)
    for i in range(4):
        m.z[i] = r.end[i]
        for j in range(m.count):
            m.columns[j, i] = r.end_columns[j, i]
    m.time += h


@kernel(inline=False)
def note_border(p: Plant) -> None:
    """Note the margins where the span begins or ends."""
    r = p.runge
    if p.block.phase != STICK:
        r.least_slide = min(r.least_slide, max(r.margin[0], 0.0))
    else:
        r.least_hold = min(r.least_hold, max(min(r.margin[0], r.margin[1]), 0.0))


@kernel(inline=False)
def prepare(p: Plant, tables: Floats) -> None:
    """Prepare for the state `z`, at the begin of a span: its contact."""
    r = p.runge
    f = p.cells
    f.place = math.nan
    f.known = 0
    r.open = 0.0
    r.least_slide = math.inf
    r.least_hold = math.inf
    r.least_pass = math.inf
    press(f, tables, p.block.z[X], p.block.z[Y], p.block.count > 0)
    part = f.touching / f.stiffness
    r.least_contact = part
    r.most_contact = part
