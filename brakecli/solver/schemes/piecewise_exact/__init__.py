"""The piecewise-exact scheme, for smooth surfaces: between two events the motion is linear, a step is a matrix.

A whole step multiplies the motion by exp(A h), which is made once for each phase. Where a margin of the phase runs
out in a step, or may dip below zero in it, the step follows Taylor series from event to event. Whatever happens,
steps end on the grid of samples. Nothing is smoothed, and nothing is passed over.
"""

import math
from typing import Any

from numba import float64, int64, void

from brakecli.solver import own_steps
from brakecli.solver.automaton import CONE, OPEN, SLIDING, STICK, anchored, carried, counted, side_of, stalled
from brakecli.solver.compile import Floats, from_memory, into_memory, kernel
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.friction import observed
from brakecli.solver.motions import (
    BELT,
    BELT_SLOPE,
    FLOW,
    FLOW_TYPE,
    LOAD,
    LOAD_SLOPE,
    SIZE,
    TERMS,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.records import COUNTS_TYPE, Plant, Weights, plant_type
from brakecli.solver.schedules import integral_at, segment, slope_at, value_at
from brakecli.solver.schemes.piecewise_exact import phases
from brakecli.solver.schemes.piecewise_exact.locate import NO_EVENT, first_event
from brakecli.solver.schemes.piecewise_exact.phases import add_works
from brakecli.solver.schemes.piecewise_exact.steps import carry_part, disturb, look, meet, note_turn, whole
from brakecli.solver.schemes.piecewise_exact.switch import place, switch
from brakecli.solver.tangent import renew
from brakecli.solver.track import enter, mark

STATE = FLOW
LAG = own_steps.LAG
MEMORY = own_steps.MEMORY
VELOCITIES = own_steps.VELOCITIES
begin = own_steps.begin
sample = own_steps.sample
weighted_time = own_steps.weighted_time
mechanical_energy = own_steps.mechanical_energy

_KEPT = 4096  # levels from one sum of the works to the next, so that rounding does not add up

_PLANT = plant_type(FLOW)
hold = into_memory(_PLANT)
_plant_at = from_memory(_PLANT)
_NONE, _DIVERGED, _STALLED = (int(each) for each in (Failure.NONE, Failure.DIVERGED, Failure.STALLED))


def order(s: Weights, start: str) -> int:
    """The order of the series that steps with events follow; all others are exact."""
    return TERMS - 1


@kernel(void(_PLANT, int64, float64), inlined=False)
def _mark(p: Plant, number: int, t: float) -> None:
    """Make a mark at a sample."""
    m = p.state
    add_works(p.c, m, p.work, p.s.h)
    store = 0.5 * m.stiffness * m.z[Y] * m.z[Y] if m.phase != OPEN else 0.0
    at = mark(p.track, p.work, number, p.grid.samples, t, store)
    at[0] = m.z[X]
    at[1] = m.z[Y]
    at[2] = m.z[V_X]
    at[3] = m.z[V_Y]


@kernel(void(_PLANT, float64), inlined=False)
def _pass_knot(p: Plant, t: float) -> None:
    """Speed, load and their slopes from a knot on, or from the start; then when the next knot is."""
    m = p.state
    belt = p.drive.belt
    load = p.drive.load
    m.z[BELT] = value_at(belt, t)
    m.z[BELT_SLOPE] = slope_at(belt, t)
    m.z[LOAD] = value_at(load, t)
    m.z[LOAD_SLOPE] = slope_at(load, t)
    in_belt = segment(belt, t) + 1
    in_load = segment(load, t) + 1
    m.knot = min(
        belt[in_belt].time if in_belt < belt.size else math.inf,
        load[in_load].time if in_load < load.size else math.inf,
    )


@kernel(void(_PLANT, float64, float64), inlined=False)
def _anchor(p: Plant, t: float, tau: float) -> None:
    """In stick, remember where the shoe holds on to the wheel."""
    m = p.state
    if m.phase == STICK:
        travel, travel_low = integral_at(p.drive.belt, t, tau)
        m.anchor, m.anchor_low = anchored(m.z[X], travel, travel_low)


@kernel(void(_PLANT), inlined=False)
def _start(p: Plant) -> None:
    """Find the phase of the initial state."""
    m = p.state
    m.stiffness = 2.0 * p.layer.pad.half_length * p.layer.pad.k
    m.z[X], m.z[Y], m.z[V_X], m.z[V_Y] = m.x, m.y, m.v_x, m.v_y
    _pass_knot(p, 0.0)
    place(p.c, m, p.s.h)
    _anchor(p, 0.0, 0.0)
    look(m)
    m.started = 1
    if p.track.on == 1:
        p.track.phase = m.phase


@kernel(void(FLOW_TYPE, COUNTS_TYPE))
def _count(m: Any, counts: Any) -> None:
    """Count a step; its matrix evaluates the contact once, where there is any."""
    counts.kinds[CLOSED_FORM] += 1
    if m.phase != OPEN:
        counts.evaluations += 1
        counts.most = 1


@kernel(int64(_PLANT, float64, int64), inlined=False)
def _through(p: Plant, t: float, to_sample: int) -> int:
    """Step on beyond the level behind time t, through all events and knots; a `Failure`.

    Whole steps go on from an event, so that the motion is beyond the levels that follow, until the next sample.
    """
    m = p.state
    h = p.s.h
    tau = p.state.beyond
    while tau < h:
        v_x = m.z[V_X]
        to_knot = m.knot - t - tau
        fits = to_sample == 0 or tau == 0.0
        if fits and h < to_knot and min(m.before[4], m.before[5], m.before[6]) >= 0.0 and whole(m, h) == 1:
            _count(m, p.counts)
            if p.tangent.on == 1:
                disturb(m, p.tangent)
            tau += h
            if p.track.on == 1 and not m.z[V_X] * p.track.way > 0.0:
                note_turn(m, p.track, t + tau, h, v_x)
            continue
        span = max(min(h - tau if to_sample == 1 else h, to_knot), 0.0)
        for i in range(SIZE):
            m.series[0, i] = m.z[i]
        phases.expand(m, m.phase, span)
        which, theta = first_event(m)
        if theta > 0.0:
            phases.take_part(p.c, m, p.work, span, theta)
            _count(m, p.counts)
            carry_part(m, p.tangent, theta * span)
            if p.track.on == 1 and not m.z[V_X] * p.track.way > 0.0:
                note_turn(m, p.track, t + tau + theta * span, theta * span, v_x)
        tau += theta * span
        if which != NO_EVENT:
            m.events_time, m.events = counted(m.events_time, m.events, t + tau, h)
            if stalled(m.events):
                return _STALLED
            add_works(p.c, m, p.work, p.s.h)
            before = m.phase
            switch(p.c, m, which, p.s.h)
            if p.tangent.on == 1 and which == SLIDING and before != OPEN and before != STICK:
                meet(p.c, m, p.tangent)
            if p.track.on == 1:
                enter(p.track, m.phase, t + tau, m.z[X], m.z[Y], m.z[V_X], m.z[V_Y])
            _anchor(p, t, tau)
            if m.phase == STICK:
                m.error[V_X] = 0.0
        elif to_knot <= span:
            _pass_knot(p, m.knot)
        elif to_sample == 1:
            tau = h
        look(m)
    m.beyond = tau - h if to_sample == 0 else 0.0
    return _NONE


@kernel(void(_PLANT, float64))
def _sample(p: Plant, t: float) -> None:
    """Put the sample at the level reached into the state; in stick the shoe is carried along without drift."""
    m = p.state
    c = p.c
    z = p.state.z
    belt = p.drive.belt
    if m.phase == STICK:
        travel, travel_low = integral_at(belt, t, 0.0)
        z[BELT] = z[V_X] = value_at(belt, t)
        z[X] = carried(m.anchor, m.anchor_low, travel, travel_low)
        m.error[V_X] = 0.0
    for i in range(4):
        m.worst[i], m.largest[i] = max(m.worst[i], abs(m.error[i])), max(m.largest[i], abs(z[i]))
    normal = max(-m.stiffness * z[Y], 0.0) if m.phase != OPEN else 0.0
    needed = 0.0
    for i in range(SIZE if m.phase == STICK else 0):
        needed += m.needed[i] * z[i]
    holds = m.phase == STICK and abs(needed) <= c.phi * normal * CONE
    state, friction = observed(side_of(m.phase), holds, needed, normal, c.phi * normal)
    m.row[0] = z[X]
    m.row[1] = z[Y]
    m.row[2] = z[V_X]
    m.row[3] = z[V_Y]
    m.row[4] = friction
    m.row[5] = normal
    m.row[6] = 1.0 if normal > 0.0 else 0.0
    m.row[7] = state


@kernel(int64(int64, float64[:, ::1], float64[:, ::1], int64))
def advance(address: int, rows: Floats, events: Floats, stop: int) -> int:
    """Step from the level reached to `stop`, filling `rows` with the samples before each step; a `Failure`."""
    p: Plant = _plant_at(address)
    m = p.state
    counts = p.counts
    grid = p.grid
    h = p.s.h
    row = 0
    if m.started == 0:
        _start(p)
    last = grid.samples * grid.per_sample
    failure = _NONE
    sampled = counts.level // grid.per_sample
    part = counts.level % grid.per_sample
    while failure == _NONE:
        t = grid.interval * sampled + part * h
        if part == 0:
            _sample(p, t)
            if p.tangent.on == 1:
                renew(p.tangent, sampled, grid.samples)
            if p.track.on == 1 and sampled >= p.track.next:
                _mark(p, sampled, t)
        if counts.level == stop:
            break
        if part == 0:
            for column in range(8):  # a slice would take seconds to compile
                rows[row, column] = m.row[column]
            row += 1
        v_x = m.z[V_X]
        if m.beyond == 0.0 and t + h < m.knot and whole(m, h) == 1:
            _count(m, counts)
            if p.tangent.on == 1:
                disturb(m, p.tangent)
            if p.track.on == 1 and not m.z[V_X] * p.track.way > 0.0:
                note_turn(m, p.track, t + h, h, v_x)
        else:
            failure = _through(p, t, int(part + 1 == grid.per_sample))
        if not abs(m.z[X]) + abs(m.z[Y]) + abs(m.z[V_X]) + abs(m.z[V_Y]) < BOUND:
            failure = _DIVERGED
        if failure == _NONE:
            counts.level += 1
            part += 1
            if part == grid.per_sample:
                sampled = sampled + 1
                part = 0
        if failure != _NONE or counts.level % _KEPT == 0 or counts.level == last:
            add_works(p.c, m, p.work, p.s.h)
    m.x = m.z[X]
    m.y = m.z[Y]
    m.v_x = m.z[V_X]
    m.v_y = m.z[V_Y]
    return failure
