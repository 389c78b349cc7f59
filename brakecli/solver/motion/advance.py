"""The loop of exact propagation: step by step through a phase, to the first event in it, and on into the next one.

A step is a whole one, by matrices; or a part of one, by a series: up to a stop, a knot of speed or load, or an
event. Nothing is smoothed.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, MARGINS, MOST_SMOOTH_EVENTS, SIZE, V_X, V_Y, Y
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.kernels import kernel
from brakecli.solver.motion import columns, exact, extent
from brakecli.solver.motion.events import (
    DONE,
    LONG,
    TURNED,
    anchor,
    enter_phase,
    look,
    note_phase,
    pass_event,
    pass_knot,
    see,
)
from brakecli.solver.motion.locate import NO_EVENT, first_event
from brakecli.solver.phases import OPEN, sliding_phase
from brakecli.solver.plant import Plant

_WHOLE = 1e-12
"""Part of a step by which a stop may lie before or behind its end."""


@kernel(inline=False)
def begin(p: Plant, scratch: Floats) -> None:
    """Find the phase of the motion `z`, at the time `base`, from which a word of phases begins."""
    m = p.block
    m.time = 0.0
    m.events = 0
    m.which = NO_EVENT
    touches = m.z[Y] == 0.0
    leaves = m.z[V_Y] > 0.0 or (m.z[V_Y] == 0.0 and touches and exact.rises(p.c, p.exact, m.z, m.h))
    clear = m.z[Y] > 0.0 or (touches and leaves)
    enter_phase(p, OPEN if clear else sliding_phase(m.z[V_X] - m.z[BELT]))
    anchor(p, scratch)
    look(p)
    m.word[0] = m.phase
    see(m)


@kernel(inline=False)
def _note(p: Plant, scratch: Floats) -> None:
    """Note what there is to note of the last step."""
    m = p.block
    if m.measures == 1:
        extent.note(p.exact, m)
    if p.track.on == 1:
        extent.note_turn(p.exact, m, p.track, scratch)


@kernel(inline=False)
def _part_step(p: Plant, scratch: Floats, remaining: float) -> int:
    """Take a step on the series, up to an event, a knot or the stop; how a call ends there, or `DONE`."""
    m = p.block
    e = p.exact
    to_knot = m.knot - m.base - m.time
    m.span = max(min(m.h, remaining, to_knot), 0.0)
    exact.expand(e, m.z, m.phase, m.span)
    m.which, m.taken = first_event(e, m.phase, p.c.m, m.span)
    if m.taken > 0.0:
        if m.account == 1:
            exact.part_works(p.c, e, m, p.work)
        exact.reach(e, m.taken)
        for i in range(SIZE):
            m.z[i] = e.at[i]
        columns.carry_part(e, m)
    m.time += m.taken * m.span
    if m.which == NO_EVENT:
        if to_knot <= m.span:
            exact.add_works(p.c, e, m, p.work)
            pass_knot(p, scratch, m.knot)
        exact.look(e, m.phase, m.z)
        _note(p, scratch)
        return DONE
    _note(p, scratch)
    if m.account == 1:
        exact.add_works(p.c, e, m, p.work)
    ends: int = pass_event(p, scratch)
    note_phase(p, scratch, m.phase)
    return ends


@kernel(inline=False)
def advance(p: Plant, scratch: Floats, until: float, turns: bool) -> int:
    """Carry the block until a time (s) since `base`; with `turns` also until v_x has changed its sign in a step.

    `begin` has found the phase, `knot` says when speed or load change their slopes, `h` is the step, and `count`,
    `rounds`, `account`, `measures` and `limit` say what is carried along. It returns how it ends (`events`): by
    `TURNED` also where an event in the same step ends it.
    """
    m = p.block
    e = p.exact
    for _ in range(100_000):  # Python hears signals in between
        remaining = until - m.time
        if not remaining > 0.0:
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
        beyond = remaining - m.h
        ends = DONE
        if beyond >= -_WHOLE * m.h and m.base + m.time + m.h < m.knot and exact.try_whole_step(e, m):
            m.which = NO_EVENT
            m.span = m.h
            m.taken = 1.0
            m.time += m.h
            if m.account == 1:
                exact.add_products(e, m)
                if m.waiting == 4096:  # so that rounding does not add up
                    exact.add_works(p.c, e, m, p.work)
            columns.carry(e, m)
            if m.measures == 1 or (p.track.on == 1 and not m.z[V_X] * p.track.way > 0.0):
                _note(p, scratch)
        else:
            ends = _part_step(p, scratch, remaining)
        if m.which == NO_EVENT and until - m.time <= _WHOLE * m.h:
            m.time = until
        if turns and m.begin[V_X] * m.z[V_X] <= 0.0 and m.begin[V_X] != 0.0:
            return TURNED
        if ends != DONE:
            return ends
    return LONG


@kernel(inline=False)
def fly(p: Plant, scratch: Floats, span: float, count: int) -> int:
    """Carry the motion `z` over a span (s), with so many columns of its derivative; how it ends.

    Speed and load are constant. The block knows afterwards how far the motion has reached.
    """
    m = p.block
    m.base = 0.0
    m.knot = math.inf
    m.events_time = 0.0
    m.crowded = 0
    m.limit = MOST_SMOOTH_EVENTS
    m.count = count
    m.measures = 1
    columns.identify(m)
    begin(p, scratch)
    extent.begin(m)
    exact.rate(p.exact, m.phase, m.z, m.start)
    ends = advance(p, scratch, span, False)
    exact.rate(p.exact, m.phase, m.z, m.velocity)
    return ends
