"""One step of an event-driven motion: tried, cut at the first event, and taken."""

import math
from typing import Any

from brakecli.solver import runge_kutta
from brakecli.solver.arrays import Floats
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.double_double import EPSILON, ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.phases import OPEN, STICK, UNDECIDED, counted, sliding_phase, stalled
from brakecli.solver.motion.record import V_X, V_Y, X, Y
from brakecli.solver.motions import POWERED, STAGES
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.runge_kutta import END_STAGE, NODES, ORDER, USED, A
from brakecli.solver.schedules import KNOT, TIME, Schedule, segment
from brakecli.solver.schemes.event_driven import phases
from brakecli.solver.schemes.event_driven.error import grow
from brakecli.solver.schemes.event_driven.locate import NONE, first_event
from brakecli.solver.track import enter, put, turned

_LOCAL = 0.05
"""Error of a step over the tolerance of the histories, to which the errors of all steps add up."""
_DEFECT = 20.0
_EARLY = 0.47
_LATE = 0.93
"""Allowed defect of a step over its allowed error, and the parts of the step where it is taken, between stages."""
_DENSE_ROUNDING = 63.0
"""The continuous solution's slope there is rounded so many times more than the slopes of the stages."""
_SAFETY = 0.9
_LEAST = 0.2
_MOST = 6.0
"""The part that is taken of the step that the error asks for, and the bounds of a step's change."""
_RADIANS = 2.0
"""Largest angle that the fastest motion turns by in a step, so that the looks at the margins follow it."""
_DECAY = 4.0
"""Largest step times decay rate: steps are stable up to 6, but inaccurate beyond 4."""
_FIRST = 0.05
_FIRST_ON_NODES = 0.25
"""The first step over the longest."""
_MANY_SWITCHES = 2
_CLOSER = 0.1
"""Phases that end at once, after which the next step is shorter: closer by, one of them does not end."""
_MOST_SWITCHES = 60
"""A run ends after so many phases that end at once."""
_LOOSE = 2e-5
"""Tolerance from which on steps of order five are cheaper, where the contact is that of nodes."""
_NEAR = 1e-3
"""The last change of a place in a step by Newton's iteration, over the step: what is left is about its square."""
_CORRECTED = 6
"""Steps of that iteration, at most."""
_AGAIN = 8
"""Steps that are made to where an event is, at most."""
_TINY = 1e-300  # no division by zero where nothing moves

_NONE, _DIVERGED, _STALLED = (int(each) for each in (Failure.NONE, Failure.DIVERGED, Failure.STALLED))
_NOT_CLOSED = int(Failure.NOT_CLOSED)


@kernel
def _to_knot(s: Schedule, t: float) -> float:
    """Time (s) to the next knot of a schedule; one within the rounding of t has been reached."""
    k = segment(s, t + ROUNDING * abs(t)) + 1
    return s[KNOT * k + TIME] - t if k < s.size // KNOT else math.inf


@kernel
def _longest(p: Plant, duration: float) -> float:
    """The longest step (s), by the fastest motion and the passing waves; `duration` where nothing limits it.

    2 rad over its bound of the angular frequency, √(stiffness/m), 4 over its bound of the decay rate, (b_xx +
    b_yy)/m, and a part of the shortest wave over the sliding speed.
    """
    c = p.c
    m = p.motion
    pad = p.layer.pad
    stiffness = (1.0 + c.phi) * (2.0 * pad.half_length * pad.k) if m.phase != OPEN else 0.0
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + stiffness  # of the largest eigenvalue of the stiffness
    longest = duration
    if bound * longest * longest > _RADIANS * _RADIANS * c.m:
        longest = _RADIANS / math.sqrt(bound / c.m)
    rate = (c.b_xx + c.b_yy) / c.m  # at least that of the fastest decay
    if rate * longest > _DECAY:
        longest = _DECAY / rate
    if pad.wheel_terms > 0 and m.phase != OPEN and m.phase != STICK:
        # A fourth of the shortest wave, so that no patch comes and goes unseen; on nodes half of it.
        slide = abs(m.v_x - m.belt) + abs(m.slopes[0, V_X] - m.belt_slope) * m.step
        wave = pad.cell if m.light == 0 else 2.0 * pad.cell
        if slide * longest > wave:
            longest = wave / slide
    return longest


@kernel(inline=False)
def first_step(p: Plant, tables: Floats, scratch: Floats, grid: Any) -> None:
    """Find the phase of the initial state, and a step to begin with."""
    m = p.motion
    m.tolerance = _LOCAL * grid.tolerance
    m.light = 1 if p.layer.pad.nodes > 0 else 0
    m.pair = 1 if m.light == 1 and grid.tolerance >= _LOOSE else 0
    phases.arrive(p, tables, scratch)
    m.largest[X], m.largest[Y], m.largest[V_X], m.largest[V_Y] = abs(m.x), abs(m.y), abs(m.v_x), abs(m.v_y)
    height = m.y - p.layer.pad.clear_from
    m.phase = OPEN if height > 0.0 or (height == 0.0 and m.v_y > 0.0) else sliding_phase(m.v_x - m.belt)
    if m.phase == UNDECIDED:
        phases.take_hold(p, tables, scratch)
    phases.find_slopes(p, tables, scratch, 0, 0.0, m.x, m.y, m.v_x, m.v_y)
    m.step = (_FIRST if m.light == 0 else _FIRST_ON_NODES) * _longest(p, grid.samples * grid.interval)


@kernel(inline=False)
def _defect(p: Plant, tables: Floats, scratch: Floats, h: float) -> float:
    """By how much the continuous solution misses (6)-(7) inside a step, over what the tolerance leaves it.

    It is |du/dθ - h f(u)|. The error estimate is a linear functional of the slopes, which vanishes for a kink at
    certain places of a step.
    """
    m = p.motion
    worst = 0.0
    along, across = phases.rounding(p)
    for theta in (_EARLY, _LATE):
        x = runge_kutta.interpolated(m, X, theta)
        y = runge_kutta.interpolated(m, Y, theta)
        v_x = runge_kutta.interpolated(m, V_X, theta)
        v_y = runge_kutta.interpolated(m, V_Y, theta)
        phases.find_slopes(p, tables, scratch, STAGES - 1, theta * h, x, y, v_x, v_y)
        for i in (V_X, V_Y):
            if m.phase == STICK and i == V_X:
                continue
            defect = abs(runge_kutta.interpolated_both(m, i, theta)[1] - h * m.slopes[STAGES - 1, i])
            noise = _DENSE_ROUNDING * h * (along if i == V_X else across) / p.c.m
            largest = max(m.largest[i], abs(m.end[i]))
            worst = max(worst, defect / (_DEFECT * m.tolerance * largest + noise + _TINY))
    return worst


@kernel(inline=False)
def _try(p: Plant, tables: Floats, scratch: Floats, h: float, allowed: float) -> float:
    """Make the stages of a step, its end and, if its error is allowed, its continuous solution; the error.

    The error is that of the worst component over what the tolerance and rounding leave it.
    """
    m = p.motion
    worst = 0.0
    used = USED[m.pair]
    m.begin[X], m.begin[Y], m.begin[V_X], m.begin[V_Y] = m.x, m.y, m.v_x, m.v_y
    for stage in range(1, STAGES):
        if used <= stage < END_STAGE:
            continue
        if stage == END_STAGE + 1:
            along, across = phases.rounding(p)
            for i in range(4):
                tangential = i in (X, V_X)
                if m.phase == STICK and tangential:
                    continue
                noise = h * (along if tangential else across) / p.c.m
                floor = noise if i >= V_X else h * noise
                floor += ROUNDING * max(abs(m.begin[i]), abs(m.end[i]))
                largest = max(m.largest[i], abs(m.end[i]))
                error = h * runge_kutta.local_error(m, i) / (m.tolerance * largest + floor + _TINY)
                if not error < math.inf:
                    return math.inf
                worst = max(worst, error)
            if worst > allowed:
                return worst
            if m.pair == 1:
                break
        x, y, v_x, v_y = runge_kutta.combined(m, stage)
        x = m.begin[X] + h * x
        y = m.begin[Y] + h * y
        v_x = m.begin[V_X] + h * v_x
        v_y = m.begin[V_Y] + h * v_y
        phases.find_slopes(p, tables, scratch, stage, NODES[m.pair, stage] * h, x, y, v_x, v_y)
        if stage == END_STAGE:
            m.end[X] = x
            m.end[Y] = y
            m.end[V_X] = v_x
            m.end[V_Y] = v_y
            if p.layer.contact.valid == 0:
                return math.inf
    runge_kutta.make_continuous(m, h)
    m.step_done = h
    return worst if p.layer.contact.kind == CLOSED_FORM else max(worst, _defect(p, tables, scratch, h))


@kernel(inline=False)
def _to_event(p: Plant, tables: Floats, scratch: Floats, which: int, h: float) -> float:
    """Make the step that ends at an event, located to rounding; its length, or 0 where the contact is not closed.

    A step to where the continuous solution has it, and from there one of Newton's, so short that it is exact.
    Where a loose tolerance lets the step come to another place, it is made anew.
    """
    m = p.motion
    longest = p.motion.step_done
    for _ in range(_AGAIN):
        if _try(p, tables, scratch, h, math.inf) == math.inf:
            return 0.0
        margin = phases.margins(p, tables, scratch, h, 1.0)[which]
        slope = phases.margin_slope(p, which)
        rest = -margin / slope if slope != 0.0 else 0.0
        if abs(rest) <= _NEAR * h:
            for i in range(4):
                m.end[i] += rest * m.slopes[END_STAGE, i]
            return h + rest
        if not 0.0 < h + rest <= longest:
            break
        h += rest
    return m.step_done  # type: ignore[no-any-return]


@kernel
def _passed(m: Any, item: int) -> float:
    """A work of the step that has been made, over its length: Σ A_end,s P_s over the powers at its stages."""
    total = 0.0
    for stage in range(USED[m.pair]):
        total += A[m.pair, END_STAGE, stage] * m.work_rates[stage, item]
    return total


@kernel(inline=False)
def _meet(p: Plant) -> None:
    """Note where in the step that has been made a rough pad comes to the wheel or leaves it.

    A contact that vanishes has a force that grows with its age to the power 3/2, so that its age is 3/2 F/|dF/dt|.
    """
    m = p.motion
    stage = END_STAGE
    meets = p.motion.touch[END_STAGE, 0] > 0.0
    x = m.end[X]
    y = m.end[Y]
    v_x = m.end[V_X]
    v_y = m.end[V_Y]
    since = m.step_done
    if not meets:
        stage = 0
        x = m.begin[X]
        y = m.begin[Y]
        v_x = m.begin[V_X]
        v_y = m.begin[V_Y]
        since = 0.0
    _, against = phases.resistance(p.c, m.load + m.load_slope * since, x, y, v_x, v_y)
    force = p.c.m * m.slopes[stage, V_Y] + against
    rate = m.touch[stage, 1] * (v_x - m.belt - m.belt_slope * since) - m.touch[stage, 0] * v_y
    age = 1.5 * force
    part = 1.0
    if age < abs(rate) * m.step_done:
        part = max(age / abs(rate) / m.step_done, 0.0)
    theta = 1.0 - part if meets else part
    enter(
        p.track,
        m.phase if meets else OPEN,
        m.time + m.tau + theta * m.step_done,
        runge_kutta.interpolated(m, X, theta),
        runge_kutta.interpolated(m, Y, theta),
        runge_kutta.interpolated(m, V_X, theta),
        runge_kutta.interpolated(m, V_Y, theta),
    )


@kernel(inline=False)
def _follow(p: Plant) -> None:
    """Note a turning point on the continuous solution of the step that has been made, and what the pad does."""
    m = p.motion
    track = p.track
    kind = turned(track, m.end[V_X])
    if kind >= 0:
        first = m.begin[V_X]
        last = m.end[V_X]
        theta = first / (first - last) if first * last < 0.0 else 0.0
        for _ in range(_CORRECTED):
            velocity, slope = runge_kutta.interpolated_both(m, V_X, theta)
            new = min(max(theta - velocity / slope, 0.0), 1.0) if slope != 0.0 else theta
            theta, moved = new, abs(new - theta)
            if moved < _NEAR:
                break
        put(track, kind, m.time + m.tau + theta * m.step_done, runge_kutta.interpolated(m, X, theta))
    if (m.touch[END_STAGE, 0] > 0.0) == (track.phase == OPEN):
        _meet(p)


@kernel(inline=False)
def _take(p: Plant, tables: Floats, scratch: Floats, grid: Any, h: float, last: int) -> None:
    """Take the step that has been made; `last` is 1 where it reaches the end of the run."""
    m = p.motion
    work = p.work
    interval = grid.interval
    if p.tangent.on == 1 or p.tangent.knows == 1:
        grow(p, tables, scratch, h, grid)
    if p.track.on == 1:
        _follow(p)
    m.time_done = m.time
    m.tau_done = m.tau
    m.phase_done = m.phase
    m.belt_done = m.belt
    m.belt_slope_done = m.belt_slope
    m.load_done = m.load
    m.load_slope_done = m.load_slope
    work.belt += h * _passed(m, 0)
    work.friction += h * _passed(m, 1)
    work.dashpots += h * _passed(m, 2)
    work.load += h * _passed(m, 3)
    work.roughness += h * _passed(m, 4)
    m.x = m.end[X]
    m.y = m.end[Y]
    m.v_x = m.end[V_X]
    m.v_y = m.end[V_Y]
    for i in range(4):
        m.largest[i] = max(m.largest[i], abs(m.end[i]))
        m.slopes[0, i] = m.slopes[END_STAGE, i]
    m.touch[0, 0], m.touch[0, 1] = m.touch[END_STAGE, 0], m.touch[END_STAGE, 1]
    m.stores[0] = m.stores[END_STAGE]
    for item in range(POWERED):
        m.work_rates[0, item] = m.work_rates[END_STAGE, item]
    tau = m.tau + h
    whole = math.floor(tau / interval)
    m.level += whole
    m.tau = max(tau - whole * interval, 0.0)
    if last == 1:
        m.level = grid.samples
        m.tau = 0.0
    m.time = interval * m.level
    phases.arrive(p, tables, scratch)
    if m.belt_slope != m.belt_slope_done or m.load_slope != m.load_slope_done:
        phases.find_slopes(p, tables, scratch, 0, 0.0, m.x, m.y, m.v_x, m.v_y)  # what stick takes jumps at a knot
    m.switches = 0
    p.counts.kinds[p.layer.contact.kind] += 1


@kernel(inline=False)
def _enter(p: Plant, tables: Floats, scratch: Floats, which: int, longest: float) -> int:
    """Enter the phase after an event, and see that events do not pile up without progress; a `Failure`."""
    m = p.motion
    phases.switch(p, tables, scratch, which)
    if p.track.on == 1:
        phase = m.phase if m.touch[0, 0] > 0.0 else OPEN
        enter(p.track, phase, m.time + m.tau, m.x, m.y, m.v_x, m.v_y)
    m.events_time, m.events = counted(m.events_time, m.events, m.time + m.tau, longest)
    return _STALLED if stalled(m.events) else _NONE


@kernel(inline=False)
def step(p: Plant, tables: Floats, scratch: Floats, grid: Any) -> int:
    """Take one step, up to an event at most; a `Failure`."""
    m = p.motion
    evaluations = p.counts.evaluations
    t = m.time + m.tau
    to_end = (grid.samples - m.level) * grid.interval - m.tau
    longest = _longest(p, grid.samples * grid.interval)
    limit = min(
        longest,
        _to_knot(scratch[p.drive.belt_at : p.drive.belt_end], t),
        _to_knot(scratch[p.drive.load_at : p.drive.load_end], t),
    )
    last = 1 if to_end <= limit else 0
    limit = min(limit, to_end)
    h = min(m.step, limit)
    growth = _MOST
    while True:
        if h < limit:
            last = 0
        error = _try(p, tables, scratch, h, 1.0)
        factor = max(_LEAST, min(growth, _SAFETY * error ** (-1.0 / ORDER[m.pair]))) if error > 0.0 else growth
        if error <= 1.0:
            break
        h = h * factor
        growth = 1.0
        if not h > EPSILON * longest or m.tau + h == m.tau:
            return _STALLED if p.layer.contact.valid == 1 else _NOT_CLOSED
    m.step = max(h * factor, m.step if h == limit else 0.0)
    which, theta = first_event(p, tables, scratch, h)
    if which != NONE and theta == 0.0:
        m.switches += 1
        if m.switches > _MANY_SWITCHES:
            m.step = _CLOSER * h
        if m.switches > _MOST_SWITCHES:
            return _STALLED
        return _enter(p, tables, scratch, which, longest)
    if which != NONE:
        h = _to_event(p, tables, scratch, which, theta * h)
        last = 0
        if h == 0.0:
            return _NOT_CLOSED
    _take(p, tables, scratch, grid, h, last)
    p.counts.most = max(p.counts.most, p.counts.evaluations - evaluations)
    if not abs(m.x) + abs(m.y) + abs(m.v_x) + abs(m.v_y) < BOUND:
        return _DIVERGED
    return _enter(p, tables, scratch, which, longest) if which != NONE else _NONE
