"""What happens between two phases, whoever carries the motion: a phase is entered, an event or a knot passed."""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import (
    BELT,
    BELT_SLOPE,
    LOAD,
    LOAD_SLOPE,
    RUNGE_KUTTA,
    SIZE,
    V_X,
    V_Y,
    Block,
    X,
    Y,
)
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion import columns, exact, forces
from brakecli.solver.phases import (
    HEIGHT,
    PULL,
    PUSH,
    STICK,
    UNDECIDED,
    anchored,
    counted,
    following,
    stalled,
    stick_or_slip,
)
from brakecli.solver.plant import Plant
from brakecli.solver.schedules import KNOT, TIME, integral_at, segment, slope_at, value_at
from brakecli.solver.track import enter

DONE, GRAZED, EVENTFUL, LONG, TURNED, STALLED, LOST, INTERRUPTED = range(8)
"""How a call ends: at its stop; at an event that is only grazed, which has no derivative; after too many events or
too many steps; where v_x has passed through zero; where events do not end; far away; by a signal."""


@kernel(inline=False)
def enter_phase(p: Plant, phase: int) -> None:
    """Enter a phase. Where it is undecided, forces choose; a shoe that sticks has the wheel's velocity."""
    m = p.block
    if m.propagator == RUNGE_KUTTA:
        m.phase = forces.held_phase(p) if phase == UNDECIDED else phase
        return
    if phase == UNDECIDED:
        exact.make(p.c, p.exact, STICK, m.h)
        m.z[V_X] = m.z[BELT]
        pull, its_rounding = exact.hold(p.exact, PULL, m.z, p.c.m, m.h)
        push, rounding = exact.hold(p.exact, PUSH, m.z, p.c.m, m.h)
        phase = stick_or_slip(pull, push, its_rounding, rounding)
    m.phase = phase
    exact.make(p.c, p.exact, phase, m.h)


@kernel(inline=False)
def anchor(p: Plant, scratch: Floats) -> None:
    """Remember where the shoe holds on to the wheel, if it sticks; at constant speed in any phase."""
    m = p.block
    if p.drive.belt_end == p.drive.belt_at:
        m.anchor = m.z[X] - m.z[BELT] * m.time
    elif m.phase == STICK:
        travel, travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], m.base, m.time)
        m.anchor, m.anchor_low = anchored(m.z[X], travel, travel_low)


@kernel(inline=False)
def look(p: Plant) -> None:
    """What the next step needs to know of the motion reached."""
    m = p.block
    if m.propagator == RUNGE_KUTTA:
        forces.renew(p)
    else:
        exact.look(p.exact, m.phase, m.z)


@kernel
def see(m: Block) -> None:
    """See whether U and Q change."""
    m.steady = 1 if m.z[BELT_SLOPE] == 0.0 and m.z[LOAD_SLOPE] == 0.0 else 0
    for i in range(SIZE):
        m.begin[i] = m.z[i]


@kernel(inline=False)
def pass_knot(p: Plant, scratch: Floats, t: float) -> None:
    """Speed, load and their slopes from a time on, also of a knot within its rounding; when the next knot is."""
    m = p.block
    belt = scratch[p.drive.belt_at : p.drive.belt_end]
    load = scratch[p.drive.load_at : p.drive.load_end]
    after = t + ROUNDING * t
    m.z[BELT] = value_at(belt, t)
    m.z[BELT_SLOPE] = slope_at(belt, after)
    m.z[LOAD] = value_at(load, t)
    m.z[LOAD_SLOPE] = slope_at(load, after)
    see(m)
    in_belt = segment(belt, after) + 1
    in_load = segment(load, after) + 1
    m.knot = min(
        belt[KNOT * in_belt + TIME] if in_belt < belt.size // KNOT else math.inf,
        load[KNOT * in_load + TIME] if in_load < load.size // KNOT else math.inf,
    )


@kernel
def note_phase(p: Plant, scratch: Floats, phase: int) -> None:
    """Note the events with which a phase begins at the motion reached; without contact it is flight."""
    m = p.block
    if p.track.on == 1:
        enter(p.track, scratch, phase, m.base + m.time, m.z[X], m.z[Y], m.z[V_X], m.z[V_Y])


@kernel(inline=False)
def pass_event(p: Plant, scratch: Floats) -> int:
    """Enter the phase that follows the event at the end of the last step; how a call ends there, or `DONE`."""
    m = p.block
    t = m.base + m.time
    m.events_time, m.crowded = counted(m.events_time, m.crowded, t, m.h)
    if stalled(m.crowded):
        return STALLED
    if m.which == HEIGHT:
        m.z[Y] = p.layer.pad.clear_from if m.propagator == RUNGE_KUTTA else 0.0
    enter_phase(p, following(m.phase, m.which, m.z[V_X] - m.z[BELT]))
    jumps = m.count == 0 or columns.jump(p)
    anchor(p, scratch)
    columns.hold_on(m)
    look(p)
    if m.limit > 0:
        if not jumps:
            return GRAZED
        if m.events == m.limit:
            return EVENTFUL
        m.times[m.events] = m.time
        m.events += 1
        m.word[m.events] = m.phase
    return DONE
