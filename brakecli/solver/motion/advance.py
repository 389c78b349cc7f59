"""The one loop: step by step through a phase, to the first event in it, and on into the next phase.

A step is a whole one, or a part of one: up to a stop, to a knot of speed or load, or to an event. Nothing is
smoothed, and nothing is passed over.
"""

import math
from typing import Any

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion import columns, exact, extent, runge_kutta
from brakecli.solver.motion.locate import NO_EVENT, first_event
from brakecli.solver.motion.phases import (
    HEIGHT,
    OPEN,
    PULL,
    PUSH,
    STICK,
    UNDECIDED,
    anchored,
    counted,
    following,
    held,
    sliding_phase,
    stalled,
)
from brakecli.solver.motion.record import (
    BELT,
    BELT_SLOPE,
    LOAD,
    LOAD_SLOPE,
    MARGINS,
    MOST_EVENTS,
    MOST_SMOOTH_EVENTS,
    SIZE,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND
from brakecli.solver.schedules import KNOT, TIME, integral_at, segment, slope_at, value_at
from brakecli.solver.track import enter

MOST_STEPS = 100_000
"""Steps of a call: Python hears signals in between."""
DONE, GRAZED, EVENTFUL, LONG, TURNED, STALLED, LOST, INTERRUPTED = range(8)
"""How a call ends: at its stop; at an event that is only grazed, which has no derivative; after too many events or
too many steps; where v_x has passed through zero; where events do not end; far away; by a signal."""
_SIGNALS = 1023
"""Steps of the grid between two looks at signals, plus one a power of two."""
_WHOLE = 1e-12
"""Part of a step by which a stop may lie before or behind its end."""
_KEPT = 4096
"""Steps from one sum of the works to the next, so that rounding does not add up."""


@kernel(inline=False)
def _enter(p: Plant, phase: int) -> None:
    """Enter a phase; where it is undecided the shoe has the wheel's velocity exactly, and the forces decide.

    What rounding leaves of an event may be more than a short rest of a step allows.
    """
    m = p.block
    if m.exact == 0:
        if phase == UNDECIDED:
            m.z[V_X] = m.z[BELT]
            phase = runge_kutta.held_phase(p)
        m.phase = phase
        return
    if phase == UNDECIDED:
        exact.make(p.c, p.exact, STICK, m.h)
        m.z[V_X] = m.z[BELT]
        pull, its_rounding = exact.hold(p.exact, PULL, m.z)
        push, rounding = exact.hold(p.exact, PUSH, m.z)
        phase = held(pull, push, its_rounding, rounding)
    m.phase = phase
    exact.make(p.c, p.exact, phase, m.h)


@kernel(inline=False)
def _anchor(p: Plant, scratch: Floats) -> None:
    """In stick, remember where the shoe holds on to the wheel."""
    m = p.block
    if m.exact == 0:
        m.anchor = m.z[X] - m.z[BELT] * m.time
    elif m.phase == STICK and p.drive.belt_end > p.drive.belt_at:
        travel, travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], m.base, m.time)
        m.anchor, m.anchor_low = anchored(m.z[X], travel, travel_low)


@kernel
def _see(m: Any) -> None:
    """See whether U and Q change."""
    m.steady = 1 if m.z[BELT_SLOPE] == 0.0 and m.z[LOAD_SLOPE] == 0.0 else 0
    for i in range(SIZE):
        m.begin[i] = m.z[i]


@kernel(inline=False)
def pass_knot(p: Plant, scratch: Floats, t: float) -> None:
    """Speed, load and their slopes from a knot on, or from the start; then when the next knot is."""
    m = p.block
    belt = scratch[p.drive.belt_at : p.drive.belt_end]
    load = scratch[p.drive.load_at : p.drive.load_end]
    m.z[BELT] = value_at(belt, t)
    m.z[BELT_SLOPE] = slope_at(belt, t)
    m.z[LOAD] = value_at(load, t)
    m.z[LOAD_SLOPE] = slope_at(load, t)
    _see(m)
    in_belt = segment(belt, t) + 1
    in_load = segment(load, t) + 1
    m.knot = min(
        belt[KNOT * in_belt + TIME] if in_belt < belt.size // KNOT else math.inf,
        load[KNOT * in_load + TIME] if in_load < load.size // KNOT else math.inf,
    )


@kernel
def _look(p: Plant) -> None:
    """The margins of the phase at the motion reached, and what the next step needs."""
    m = p.block
    if m.exact == 1:
        exact.look(p.exact, m.phase, m.z)
    else:
        runge_kutta.look(p)


@kernel(inline=False)
def begin(p: Plant, tables: Floats, scratch: Floats) -> None:
    """Find the phase of the motion `z`, at the time `base`, from which a word of phases begins."""
    m = p.block
    m.time = 0.0
    m.events = 0
    m.which = NO_EVENT
    if m.exact == 0:
        runge_kutta.prepare(p, tables)
        _enter(p, sliding_phase(m.z[V_X] - m.z[BELT]))
        p.runge.least_pass = math.inf
        _anchor(p, scratch)
        _look(p)
        runge_kutta.note_border(p)
        m.word[0] = m.phase
        return
    touches = m.z[Y] == 0.0
    leaves = m.z[V_Y] > 0.0 or (m.z[V_Y] == 0.0 and touches and exact.rises(p.c, p.exact, m.z, m.h))
    clear = m.z[Y] > 0.0 or (touches and leaves)
    _enter(p, OPEN if clear else sliding_phase(m.z[V_X] - m.z[BELT]))
    _anchor(p, scratch)
    _look(p)
    m.word[0] = m.phase
    _see(m)


@kernel(inline=False)
def _note(p: Plant) -> None:
    """Note what there is to note of the last step."""
    m = p.block
    if m.measures == 1:
        extent.note(p.exact, m)
    if p.track.on == 1:
        extent.note_turn(p.exact, m, p.track)


@kernel(inline=False)
def _pass_event(p: Plant, scratch: Floats) -> int:
    """Enter the phase that follows the event at the end of the last step; how a call ends there, or `DONE`."""
    m = p.block
    t = m.base + m.time
    m.events_time, m.crowded = counted(m.events_time, m.crowded, t, m.h)
    if stalled(m.crowded):
        return STALLED
    if m.account == 1:
        exact.add_works(p.c, p.exact, m, p.work)
    if m.which == HEIGHT:
        m.z[Y] = 0.0
    _enter(p, following(m.phase, m.which, m.z[V_X] - m.z[BELT]))
    jumps = m.count == 0 or columns.jump(p)
    if p.track.on == 1:
        enter(p.track, m.phase, t, m.z[X], m.z[Y], m.z[V_X], m.z[V_Y])
    _anchor(p, scratch)
    columns.hold_on(m)
    _look(p)
    if m.limit > 0:
        if not jumps:
            return GRAZED
        if m.events == m.limit:
            return EVENTFUL
        m.times[m.events] = m.time
        m.events += 1
        m.word[m.events] = m.phase
    return DONE


@kernel(inline=False)
def _part_step(p: Plant, scratch: Floats, left: float) -> int:
    """Take a step on the series, up to an event, a knot or the stop; how a call ends there, or `DONE`."""
    m = p.block
    e = p.exact
    to_knot = m.knot - m.base - m.time
    m.span = max(min(m.h, left, to_knot), 0.0)
    exact.expand(e, m.z, m.phase, m.span)
    m.which, m.part = first_event(e, m.phase)
    if m.part > 0.0:
        if m.account == 1:
            exact.part_works(p.c, e, m, p.work)
        exact.reach(e, m.part)
        for i in range(SIZE):
            m.z[i] = e.at[i]
        columns.carry_part(e, m)
    m.time += m.part * m.span
    if m.which == NO_EVENT:
        if to_knot <= m.span:
            exact.add_works(p.c, e, m, p.work)
            pass_knot(p, scratch, m.knot)
        exact.look(e, m.phase, m.z)
        _note(p)
        return DONE
    _note(p)
    return _pass_event(p, scratch)


@kernel(inline=False)
def advance(p: Plant, tables: Floats, scratch: Floats, until: float, turns: bool) -> int:
    """Carry the block until a time (s) since `base`, or until v_x next passes through zero; how the call ends."""
    m = p.block
    e = p.exact
    for _ in range(MOST_STEPS):
        left = until - m.time
        if not left > 0.0:
            return DONE
        for i in range(4):
            m.begin[i] = m.z[i]
        if m.steady == 0:
            for i in range(4, SIZE):
                m.begin[i] = m.z[i]
        if m.measures == 1:
            for k in range(2 * MARGINS):
                m.margins[k] = e.before[4 + k]
        m.old = m.phase
        p.counts.kinds[CLOSED_FORM] += 1
        if m.phase != OPEN:
            p.counts.evaluations += 1
            p.counts.most = 1
        rest = left - m.h
        ends = DONE
        if m.exact == 0:
            runge_kutta.take(p, tables, left)
            if not abs(m.z[X]) + abs(m.z[Y]) + abs(m.z[V_X]) + abs(m.z[V_Y]) < BOUND:
                return LOST
            if m.which == NO_EVENT:
                runge_kutta.look(p)
            else:
                ends = _pass_event(p, scratch)
        elif rest >= -_WHOLE * m.h and m.base + m.time + m.h < m.knot and exact.whole(e, m):
            m.which = NO_EVENT
            m.span = m.h
            m.part = 1.0
            m.time += m.h
            if m.account == 1:
                exact.add_products(e, m)
                if m.waiting == _KEPT:
                    exact.add_works(p.c, e, m, p.work)
            columns.carry(e, m)
            if m.measures == 1 or (p.track.on == 1 and not m.z[V_X] * p.track.way > 0.0):
                _note(p)
        else:
            ends = _part_step(p, scratch, left)
        if m.which == NO_EVENT and until - m.time <= _WHOLE * m.h:
            m.time = until
        if turns and m.begin[V_X] * m.z[V_X] <= 0.0 and m.begin[V_X] != 0.0:
            return TURNED
        if ends != DONE:
            return ends
    return LONG


@kernel(inline=False)
def _rate(p: Plant, found: Floats) -> None:
    """The derivative of the state by time at the motion reached."""
    m = p.block
    if m.exact == 1:
        exact.rate(p.exact, m.phase, m.z, found)
    else:
        runge_kutta.rate(p, m.phase, m.z, found)


@kernel(inline=False)
def fly(p: Plant, tables: Floats, scratch: Floats, span: float, count: int) -> int:
    """Carry the motion `z` over a span (s), with so many columns of its derivative; how it ends.

    Speed and load are constant. The block knows afterwards how far the motion has reached.
    """
    m = p.block
    r = p.runge
    m.base = 0.0
    m.knot = math.inf
    m.events_time = 0.0
    m.crowded = 0
    m.limit = MOST_SMOOTH_EVENTS if m.exact == 1 else MOST_EVENTS
    m.count = count
    m.measures = m.exact
    for j in range(count):
        for i in range(4):
            m.columns[j, i] = 1.0 if i == j else 0.0
    if m.exact == 0:
        r.grid = span / r.steps
        m.h = r.grid
    begin(p, tables, scratch)
    if m.exact == 0 and m.phase == STICK:
        for j in range(count):
            m.columns[j, V_X] = 0.0
    extent.begin(m)
    _rate(p, m.start)
    ends = DONE
    if m.exact == 1:
        ends = advance(p, tables, scratch, span, False)
    else:
        for n in range(r.steps):
            m.h = r.grid
            ends = advance(p, tables, scratch, (n + 1) * r.grid, False)
            if ends != DONE:
                break
            if n & _SIGNALS == _SIGNALS and stopped(p.cells.signals):
                return INTERRUPTED
        runge_kutta.note_border(p)
    _rate(p, m.velocity)
    return ends
