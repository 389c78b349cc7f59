"""Runge-Kutta steps that keep a tolerance: each tried, cut at the first event, and taken.

Each component keeps the tolerance, relative to the largest value that it has had. A step ends at a knot of speed
or load, so that what acts from outside is linear in it.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import (
    BELT,
    BELT_SLOPE,
    KNOWN,
    LOAD_SLOPE,
    POWERED,
    RUNGE_KUTTA,
    SIZE,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.double_double import EPSILON
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion import errors
from brakecli.solver.motion.crossing import crossing
from brakecli.solver.motion.events import STALLED, anchor, enter_phase, note_phase, pass_event, pass_knot
from brakecli.solver.motion.forces import act_first, renew
from brakecli.solver.motion.locate import NO_EVENT
from brakecli.solver.motion.runge_kutta import attempt, to_event
from brakecli.solver.motion.tableaus import END_STAGE, ORDER, USED, A, interpolated, interpolated_both
from brakecli.solver.phases import HEIGHT, OPEN, STICK, carried, sliding_phase
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.roughness import turn
from brakecli.solver.schedules import integral_at
from brakecli.solver.track import enter, put, turned

_NONE, _DIVERGED, _STALLED = (int(failure) for failure in (Failure.NONE, Failure.DIVERGED, Failure.STALLED))
_NOT_CLOSED = int(Failure.NOT_CLOSED)


@kernel
def _longest(p: Plant) -> float:
    """The longest step (s), by the fastest motion and the passing waves; the whole run where nothing limits it.

    2 rad over its bound of the angular frequency, √(stiffness/m), 4 over its bound of the decay rate, (b_xx +
    b_yy)/m, and a part of the shortest wave over the sliding speed.
    """
    c = p.c
    m = p.block
    r = p.runge
    pad = p.layer.pad
    angle = 2.0  # that the fastest motion may turn by, rad, so that the looks at the margins follow it
    decay = 4.0  # of the step times its rate: steps are stable up to 6, but inaccurate beyond 4
    stiffness = (1.0 + c.phi) * (2.0 * pad.half_length * pad.k) if m.phase != OPEN else 0.0
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + stiffness  # of the largest eigenvalue of the stiffness
    longest = p.grid.samples * p.grid.interval
    if bound * longest * longest > angle * angle * c.m:
        longest = angle / math.sqrt(bound / c.m)
    rate = (c.b_xx + c.b_yy) / c.m  # at least that of the fastest decay
    if rate * longest > decay:
        longest = decay / rate
    if pad.wheel_terms > 0 and m.phase != OPEN and m.phase != STICK:
        # A fourth of the shortest wave, so that no patch comes and goes unseen; on nodes half of it.
        slide = abs(m.z[V_X] - m.z[BELT]) + abs(r.slopes[0, V_X] - m.z[BELT_SLOPE]) * r.step
        wave = pad.cell if r.light == 0 else 2.0 * pad.cell
        if slide * longest > wave:
            longest = wave / slide
    return longest


@kernel(inline=False)
def _arrive(p: Plant, tables: Floats, scratch: Floats) -> None:
    """What acts from outside at the time reached and, as no knot lies inside a step, all through the next step."""
    m = p.block
    t = m.base + m.time
    pass_knot(p, scratch, t)
    travel, travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], m.base, m.time)
    if p.layer.pad.wheel_terms > 0:
        turn(travel, travel_low, p.layer, tables, scratch)
    if m.phase == STICK:
        m.z[X] = carried(m.anchor, m.anchor_low, travel, travel_low)
        m.z[V_X] = m.z[BELT]


@kernel(inline=False)
def put_at_start(p: Plant, tables: Floats, scratch: Floats) -> None:
    """Put the motion at its initial state, whose contact is to be found, see `begin`."""
    m = p.block
    r = p.runge
    m.propagator = RUNGE_KUTTA
    m.account = 1
    m.which = NO_EVENT
    m.z[X] = m.x
    m.z[Y] = m.y
    m.z[V_X] = m.v_x
    m.z[V_Y] = m.v_y
    for i in range(4):
        m.largest[i] = abs(m.z[i])
    if p.tangent.on == 1 or p.tangent.knows == 1:
        m.count = KNOWN + p.tangent.on
    r.tolerance = 0.05 * p.grid.tolerance  # of a step: in the histories the errors of all steps add up
    r.light = 1 if p.layer.pad.nodes > 0 else 0
    r.pair = 1 if r.light == 1 and p.grid.tolerance >= 2e-5 else 0  # from there on order five is cheaper on nodes
    m.phase = OPEN
    _arrive(p, tables, scratch)
    height = m.z[Y] - p.layer.pad.clear_from
    if height < 0.0 or (height == 0.0 and m.z[V_Y] <= 0.0):
        m.phase = sliding_phase(m.z[V_X] - m.z[BELT])


@kernel(inline=False)
def begin(p: Plant, scratch: Floats) -> None:
    """Find the phase of the initial state from its contact, and a step to begin with."""
    r = p.runge
    enter_phase(p, p.block.phase)
    anchor(p, scratch)
    renew(p)
    r.step = (0.05 if r.light == 0 else 0.25) * _longest(p)


@kernel
def _passed(p: Plant, item: int) -> float:
    """A work of the step that has been made, over its length: Σ A_end,s P_s over the powers at its stages."""
    r = p.runge
    total = 0.0
    for stage in range(USED[r.pair]):
        total += A[r.pair, END_STAGE, stage] * r.work_rates[stage, item]
    return total


@kernel(inline=False)
def _meet(p: Plant, scratch: Floats) -> None:
    """Note where in the step that has been made a rough pad comes to the wheel or leaves it.

    A contact that vanishes has a force that grows with its age to the power 3/2, so that its age is 3/2 F/|dF/dt|.
    """
    m = p.block
    r = p.runge
    meets = r.touch[END_STAGE, 1] > 0.0
    stage = END_STAGE if meets else 0
    since = r.length if meets else 0.0
    rates = r.slopes[stage]
    slides = rates[X] - m.z[BELT] - m.z[BELT_SLOPE] * since
    rate = abs(r.touch[stage, 2] * slides - r.touch[stage, 1] * rates[Y])
    age = 1.5 * r.touch[stage, 0]
    share = max(age / rate / r.length, 0.0) if age < rate * r.length else 1.0
    theta = 1.0 - share if meets else share
    enter(
        p.track,
        scratch,
        m.phase if meets else OPEN,
        m.base + m.time + theta * r.length,
        interpolated(r, X, theta),
        interpolated(r, Y, theta),
        interpolated(r, V_X, theta),
        interpolated(r, V_Y, theta),
    )


@kernel(inline=False)
def _follow(p: Plant, scratch: Floats) -> None:
    """Note a turning point on the continuous solution of the step that has been made, and what the pad does."""
    m = p.block
    r = p.runge
    track = p.track
    kind = turned(track, r.end[V_X])
    if kind >= 0:
        first = r.begin[V_X]
        last = r.end[V_X]
        theta = first / (first - last) if first * last < 0.0 else 0.0
        for _ in range(6):
            velocity, slope = interpolated_both(r, V_X, theta)
            before = theta
            theta = min(max(theta - velocity / slope, 0.0), 1.0) if slope != 0.0 else theta
            if abs(theta - before) < 1e-3:  # what is missed then is about its square
                break
        put(track, scratch, kind, m.base + m.time + theta * r.length, interpolated(r, X, theta))
    if (r.touch[END_STAGE, 1] > 0.0) == (track.phase == OPEN):
        _meet(p, scratch)


@kernel(inline=False)
def _take(p: Plant, tables: Floats, scratch: Floats, h: float, last: bool) -> None:
    """Take the step that has been made; the `last` one reaches the end of the run."""
    m = p.block
    r = p.runge
    work = p.work
    if p.track.on == 1:
        _follow(p, scratch)
    work.belt += h * _passed(p, 0)
    work.friction += h * _passed(p, 1)
    work.dashpots += h * _passed(p, 2)
    work.load += h * _passed(p, 3)
    work.roughness += h * _passed(p, 4)
    r.base = m.base
    r.time = m.time
    for i in range(BELT, SIZE):
        r.outside[i - BELT] = m.z[i]
    for i in range(4):
        m.z[i] = r.end[i]
        m.largest[i] = max(m.largest[i], abs(r.end[i]))
        r.slopes[0, i] = r.slopes[END_STAGE, i]
    for i in range(3):
        r.touch[0, i] = r.touch[END_STAGE, i]
    r.stores[0] = r.stores[END_STAGE]
    for item in range(POWERED):
        r.work_rates[0, item] = r.work_rates[END_STAGE, item]
    m.time += h
    whole = math.floor(m.time / p.grid.interval)
    r.level += whole
    m.time = max(m.time - whole * p.grid.interval, 0.0)
    if last:
        r.level = p.grid.samples
        m.time = 0.0
    m.base = p.grid.interval * r.level
    r.switches = 0
    p.counts.kinds[p.layer.contact.kind] += 1
    _arrive(p, tables, scratch)


@kernel
def _at_knot(p: Plant) -> bool:
    """Whether the slope of speed or load has changed with the last step."""
    z = p.block.z
    before = p.runge.outside
    return z[BELT_SLOPE] != before[BELT_SLOPE - BELT] or z[LOAD_SLOPE] != before[LOAD_SLOPE - BELT]  # type: ignore[no-any-return]


@kernel(inline=False)
def step(p: Plant, tables: Floats, scratch: Floats) -> int:
    """Take one step, up to an event at most; a `Failure`."""
    m = p.block
    r = p.runge
    evaluations = p.counts.evaluations
    to_end = (p.grid.samples - r.level) * p.grid.interval - m.time
    m.h = _longest(p)
    limit = min(m.h, m.knot - m.base - m.time)
    last = to_end <= limit
    limit = min(limit, to_end)
    h = min(r.step, limit)
    growth = 6.0  # of a step over the one before, at most
    while True:
        if stopped(p.layer.pad.signals):  # stages are empty then, and no step keeps the tolerance
            return _STALLED
        if h < limit:
            last = False
        error = attempt(p, tables, scratch, h, 1.0)
        # a part of the step that the error asks for
        factor = max(0.2, min(growth, 0.9 * error ** (-1.0 / ORDER[r.pair]))) if error > 0.0 else growth
        if error <= 1.0:
            break
        h = h * factor
        growth = 1.0
        if not h > EPSILON * m.h or m.time + h == m.time:
            return _STALLED if p.layer.contact.valid == 1 else _NOT_CLOSED
    r.step = max(h * factor, r.step if h == limit else 0.0)
    m.which, theta = crossing(p, h)
    m.old = m.phase
    if m.which != NO_EVENT and theta == 0.0:
        r.switches += 1
        if r.switches > 2:
            r.step = 0.1 * h  # closer by, one of the phases does not end at once
        if r.switches > 60:
            return _STALLED
    else:
        if m.which != NO_EVENT:
            h = to_event(p, tables, scratch, m.which, theta * h)
            last = False
            if h == 0.0:
                return _NOT_CLOSED
        if m.count > 0:
            errors.grow(p, tables, scratch, h)
        _take(p, tables, scratch, h, last)
        p.counts.most = max(p.counts.most, p.counts.evaluations - evaluations)
        if not abs(m.z[X]) + abs(m.z[Y]) + abs(m.z[V_X]) + abs(m.z[V_Y]) < BOUND:
            return _DIVERGED
    if m.which != NO_EVENT or _at_knot(p):
        act_first(p, tables, scratch)  # at an event exactly; at a knot what stick takes jumps
    if m.which == NO_EVENT:
        return _NONE
    p.tangent.moved = math.inf
    if pass_event(p, scratch) == STALLED:
        return _STALLED
    if m.which == HEIGHT:
        act_first(p, tables, scratch)
    note_phase(p, scratch, m.phase if r.touch[0, 1] > 0.0 else OPEN)
    return _NONE
