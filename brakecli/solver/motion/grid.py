"""Runge-Kutta steps on a grid of time: of the motion and its columns alike, with a fixed number to a span.

The grid does not depend on the state, so the end is a smooth function of the state, of the span and of the
parameters, as long as the sequence of phases is the same. An event divides a step of the grid into parts. It is
found by the cubic through the margins at both ends and their rates, and located on steps that are tried.

Lift-off is no event, because the normal force of a rough pad is continuous.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion import columns, extent
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.motion.events import DONE, INTERRUPTED, LOST, anchor, enter_phase, look, pass_event
from brakecli.solver.motion.forces import find_margin_rates, find_margins, rate, resistance, touch
from brakecli.solver.motion.locate import NO_EVENT
from brakecli.solver.motion.phases import HEIGHT, PULL, PUSH, SLIDING, STICK, side_of, sliding_phase
from brakecli.solver.motion.record import (
    BELT,
    LOAD,
    MARGINS,
    MOST_EVENTS,
    RUNGE_STAGES,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.motion.runge_kutta import advance_stages
from brakecli.solver.motion.tableaus import END_STAGE, A
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND

_A = A[1, :RUNGE_STAGES, :RUNGE_STAGES].copy()
_B = A[1, END_STAGE, :RUNGE_STAGES].copy()
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
_WHOLE = 1e-12  # part of a step by which a stop may lie before or behind its end
_SIGNALS = 1023
"""Steps of the grid between two looks at signals, plus one a power of two."""


@kernel
def _rate_of(p: Plant, stage: int, w: Floats, found: Floats) -> None:
    """`forces.rate` of a column: ∂F_y/∂x δx + ∂F_y/∂y δy takes the place of F_y. In stick δẍ = 0."""
    c = p.c
    phase = p.block.phase
    pressed = p.runge.touch[stage, 2] * w[X] - p.runge.touch[stage, 1] * w[Y]
    along, across = resistance(c, 0.0, w[X], w[Y], w[V_X], w[V_Y])
    found[X] = w[V_X]
    found[Y] = w[V_Y]
    found[V_X] = 0.0 if phase == STICK else (-side_of(phase) * c.phi * pressed - along) / c.m  # Eq. (6)
    found[V_Y] = (pressed - across) / c.m  # Eq. (7)


@kernel(inline=False)
def _step(p: Plant, tables: Floats, scratch: Floats, h: float, steeply: bool) -> None:
    """A step from the motion reached to `end`, with the margins there; the contact at its begin is known."""
    r = p.runge
    r.steeply = 1 if steeply else 0
    advance_stages(p, tables, scratch, h, 1, RUNGE_STAGES)
    advance_stages(p, tables, scratch, h, END_STAGE, END_STAGE + 1)
    find_margins(p, r.end, r.slopes[END_STAGE, V_Y], h)
    find_margin_rates(p, r.slopes[END_STAGE], r.touch[END_STAGE, 1])


@kernel(inline=False)
def _carry(p: Plant, h: float) -> None:
    """Move the columns along the step that has been made: w + h Σ B_s k_s, stages are at w + h Σ A_sr k_r."""
    m = p.block
    r = p.runge
    for j in range(m.count):
        for s in range(RUNGE_STAGES):
            for i in range(4):
                total = 0.0
                for q in range(s):
                    total += _A[s, q] * r.k_columns[q, i]
                r.w[i] = m.columns[j, i] + h * total
            _rate_of(p, s, r.w, r.k_columns[s])
        for i in range(4):
            total = 0.0
            for q in range(RUNGE_STAGES):
                total += _B[q] * r.k_columns[q, i]
            m.columns[j, i] += h * total


@kernel(inline=False)
def _noise(p: Plant) -> float:
    """The rounding of the margins at the end of the step: 1e-14 of the sum of the sizes of their terms."""
    c = p.c
    m = p.block
    z = p.runge.end
    if m.phase != STICK:
        return _ROUNDING * (abs(m.z[BELT]) + abs(z[V_X]))  # type: ignore[no-any-return]
    links = c.b_xx * abs(z[V_X]) + abs(c.b_xy * z[V_Y]) + c.c_xx * abs(z[X]) + abs(c.c_xy * z[Y])
    return _ROUNDING * (links + abs(m.z[LOAD] * c.sin_beta) + c.phi * p.layer.contact.normal_force)  # type: ignore[no-any-return]


@kernel(inline=False)
def _located(p: Plant, tables: Floats, scratch: Floats, h: float, high: float, which: int) -> float:
    """The part of the step h at which a margin is zero; at its part `high` it is negative.

    Newton's method, kept inside a bracket. A phase begins where its margin is zero: it must have risen before.
    """
    r = p.runge
    low = 0.0
    noise = _noise(p)
    begin = r.first_margin[which]
    if begin > noise:
        _step(p, tables, scratch, high * h, False)
        part = high * begin / (begin - r.margin[which])
    else:
        for _ in range(_SEEKS):
            part = 0.5 * high
            _step(p, tables, scratch, part * h, False)
            if r.margin[which] > 0.0:
                low = part
                part = _ABOVE * high
                break
            high = part
        if low == 0.0:
            return 0.0
    for _ in range(_SEEKS):
        _step(p, tables, scratch, part * h, False)
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
def _first_crossing(p: Plant, tables: Floats, scratch: Floats, h: float) -> tuple[int, float]:
    """The margin that ends the phase within the step that has been made, and the part of the step until then.

    Notes how near margins come to zero.
    """
    m = p.block
    r = p.runge
    noise = _noise(p)
    dips = False
    which = NO_EVENT
    first = 2.0
    end = MARGINS if m.phase == STICK else MARGINS - 1
    for i in range(HEIGHT + 1, end):
        if r.margin[i] < -noise:
            fall = r.first_margin[i] - r.margin[i]
            part = r.first_margin[i] / fall if fall > 0.0 else 0.0
            if part < first:
                which = i
                first = part
    if which != NO_EVENT:
        return which, _located(p, tables, scratch, h, 1.0, which)
    for i in range(HEIGHT + 1, end):
        part, value = lowest(r.first_margin[i], h * r.first_rate[i], r.margin[i], h * r.margin_rate[i])
        if part >= 0.0 and value < -noise:
            dips = True
            _step(p, tables, scratch, part * h, False)
            if r.margin[i] < -noise:
                return i, _located(p, tables, scratch, h, part, i)
            _step(p, tables, scratch, h, False)
        if part >= 0.0 and r.first_margin[i] > noise:  # not at the event that the phase begins with
            if m.phase != STICK:
                r.least_slide = min(r.least_slide, max(value, 0.0))
            else:
                r.least_hold = min(r.least_hold, max(value, 0.0))
    if dips and m.count > 0:
        _step(p, tables, scratch, h, m.count > 0)  # as it was before the dip was tried
    return NO_EVENT, 1.0


@kernel
def _note(p: Plant, h: float) -> None:
    """Note extremes and shares of the step that has been made, from x, y and their rates at both ends."""
    m = p.block
    r = p.runge
    for i in range(2):
        begin = m.z[i]
        end = r.end[i]
        slope = h * m.z[V_X + i]
        rise = h * r.end[V_X + i]
        m.low[i] = min(m.low[i], min(end, lowest(begin, slope, end, rise)[1]))
        m.high[i] = max(m.high[i], max(end, -lowest(-begin, -slope, -end, -rise)[1]))
    m.spent[m.phase] += h
    before = r.touch[0, 1]
    touching = r.touch[END_STAGE, 1]
    r.open += 0.5 * h * ((1.0 if before == 0.0 else 0.0) + (1.0 if touching == 0.0 else 0.0))
    _note_contact(p, touching)


@kernel
def _note_contact(p: Plant, touching: float) -> None:
    r = p.runge
    part = touching / p.cells.stiffness
    r.least_contact = min(r.least_contact, part)
    r.most_contact = max(r.most_contact, part)


@kernel(inline=False)
def _take(p: Plant, tables: Floats, scratch: Floats, left: float) -> None:
    """Take a step of the grid, or the part of one that is left, up to an event at most."""
    m = p.block
    r = p.runge
    steeply = m.count > 0
    h = left if left <= _STRETCHED * m.h else m.h
    _step(p, tables, scratch, h, steeply)
    if m.h == r.grid and (r.touch[0, 1] == 0.0) != (r.touch[END_STAGE, 1] == 0.0):
        m.h = r.grid / LANDING
        h = left if left <= _STRETCHED * m.h else m.h
        _step(p, tables, scratch, h, steeply)
    m.old = m.phase
    m.which, part = _first_crossing(p, tables, scratch, h)
    if m.which != NO_EVENT:
        h = part * h
        _step(p, tables, scratch, h, steeply)
    _note(p, h)
    _carry(p, h)
    for i in range(4):
        m.z[i] = r.end[i]
    m.time += h


@kernel(inline=False)
def _look(p: Plant) -> None:
    """The contact found last and the margins of the phase are those of the begin of the next step."""
    r = p.runge
    look(p)
    find_margins(p, p.block.z, r.slopes[0, V_Y], 0.0)
    find_margin_rates(p, r.slopes[0], r.touch[0, 1])
    for i in range(MARGINS):
        r.first_margin[i] = r.margin[i]
        r.first_rate[i] = r.margin_rate[i]


@kernel(inline=False)
def _note_border(p: Plant) -> None:
    """Note the margins where the span begins or ends."""
    r = p.runge
    if p.block.phase != STICK:
        r.least_slide = min(r.least_slide, max(r.margin[SLIDING], 0.0))
    else:
        r.least_hold = min(r.least_hold, max(min(r.margin[PULL], r.margin[PUSH]), 0.0))


@kernel(inline=False)
def _begin(p: Plant, tables: Floats, scratch: Floats) -> None:
    """Find the phase of the motion `z` and its contact, at the begin of a span."""
    m = p.block
    r = p.runge
    m.time = 0.0
    m.events = 0
    p.cells.place = math.nan
    r.open = 0.0
    r.least_slide = math.inf
    r.least_hold = math.inf
    r.least_contact = math.inf
    r.most_contact = 0.0
    r.steeply = 1 if m.count > 0 else 0
    m.phase = sliding_phase(m.z[V_X] - m.z[BELT])
    touch(p, tables, scratch, m.z[X], m.z[Y])
    enter_phase(p, m.phase)
    r.least_pass = math.inf
    anchor(p, scratch)
    columns.hold_on(m)
    _look(p)
    _note_border(p)
    _note_contact(p, r.touch[0, 1])
    m.word[0] = m.phase


@kernel(inline=False)
def fly_on_grid(p: Plant, tables: Floats, scratch: Floats, span: float) -> int:
    """Carry the motion `z` over a span (s) in `steps` steps, with its columns; how it ends."""
    m = p.block
    r = p.runge
    m.base = 0.0
    m.events_time = 0.0
    m.crowded = 0
    m.limit = MOST_EVENTS
    r.grid = span / r.steps
    m.h = r.grid
    columns.identify(m)
    extent.begin(m)
    _begin(p, tables, scratch)
    rate(p, m.phase, m.z, 0.0, m.start)
    for n in range(r.steps):
        m.h = r.grid
        until = (n + 1) * r.grid
        while until - m.time > _WHOLE * m.h:
            _take(p, tables, scratch, until - m.time)
            if not abs(m.z[X]) + abs(m.z[Y]) + abs(m.z[V_X]) + abs(m.z[V_Y]) < BOUND:
                return LOST
            ends = pass_event(p, scratch) if m.which != NO_EVENT else DONE
            if ends != DONE:
                return ends
            _look(p)
        m.time = until
        if n & _SIGNALS == _SIGNALS and stopped(p.cells.signals):
            return INTERRUPTED
    _note_border(p)
    rate(p, m.phase, m.z, 0.0, m.velocity)
    return DONE
