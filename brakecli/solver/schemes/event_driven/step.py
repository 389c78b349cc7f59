"""One step of an event-driven motion: tried, cut at the first event, and taken."""

import math

import numpy as np
from numba import float64, int64, void
from numpy.typing import NDArray

from brakecli.solver.compile import KIND, VALID, VX, VY, W_BELT, X, Y, kernel, vector
from brakecli.solver.contact.pad import CELL, WHEEL_TERMS
from brakecli.solver.loop import BOUND, DRIVE, EVALUATIONS, GRID, KIND_0, MOST, Drive, Grid
from brakecli.solver.quantities import Failure
from brakecli.solver.schedules import SCHEDULE, Schedule, segment
from brakecli.solver.schemes.event_driven.dop853 import (
    END_STAGE,
    NODES,
    SIZE,
    STAGES,
    A,
    combined,
    interpolated,
    interpolated_slope,
    local_error,
    make_continuous,
)
from brakecli.solver.schemes.event_driven.locate import NONE, first_event
from brakecli.solver.schemes.event_driven.phases import (
    BEGIN,
    BELT,
    BELT_SLOPE,
    END,
    EPSILON,
    EVENTS,
    EVENTS_TIME,
    LARGEST,
    LEVEL_AT,
    PLANT,
    POWER,
    SIDE,
    SIDE_DONE,
    SLOPES,
    STEP,
    STEP_DONE,
    SWITCHES,
    TAU,
    TAU_DONE,
    TIME,
    TIME_DONE,
    TOLERANCE,
    TOUCHING,
    TOUCHING_DONE,
    WORK_RATES,
    WORKS,
    Plant,
    arrive,
    clear_height,
    full_stiffness,
    margin_slope,
    margins,
    rounding,
    slopes,
    switch,
    take_hold,
)

_LOCAL = 0.05
"""Error of a step over the tolerance of the histories, to which the errors of all steps add up."""
_DEFECT, _EARLY, _LATE = 20.0, 0.47, 0.93
"""Defect of a step over the error that it is allowed, and where it is taken: between the stages."""
_DENSE_ROUNDING = 63.0
"""Rounding of the continuous solution's slope there over that of the slopes of the stages."""
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 6.0
"""Of the step that the error asks for: what is taken, and the bounds of its change."""
_RADIANS = 2.0
"""Of the fastest motion, in a step: the looks at the margins are to follow it."""
_DECAY = 4.0
"""Powers of e by which the fastest decay goes on in a step; steps are stable up to six, but wrong in between."""
_FIRST = 0.05
"""The first step over the longest."""
_MOST_SWITCHES, _MOST_EVENTS, _NO_PROGRESS = 60, 1000, 1e-6
"""Phases that end at once, and events within a part of the longest step, before a run ends."""
_TINY = 1e-300  # no division by zero where nothing moves

_NONE, _NOT_CLOSED, _DIVERGED = int(Failure.NONE), int(Failure.NOT_CLOSED), int(Failure.DIVERGED)
_STALLED = int(Failure.STALLED)


@kernel(float64(SCHEDULE, float64))
def _to_knot(s: Schedule, t: float) -> float:
    """Time (s) to the next knot of a schedule; one within the rounding of t has been reached."""
    k = segment(t + 4.0 * EPSILON * abs(t), s.times) + 1
    return s.times[k] - t if k < s.times.size else math.inf


@kernel(float64(PLANT, float64), inlined=False)
def _longest(p: Plant, duration: float) -> float:
    """The longest step (s), by the fastest motion and the passing waves; `duration` where nothing limits it."""
    c, m = p.c, p.memory
    stiffness = (1.0 + c.phi) * full_stiffness(p.pad) if m[TOUCHING] != 0.0 else 0.0
    bound = c.c_xx + c.c_yy + 2.0 * abs(c.c_xy) + stiffness  # of the largest eigenvalue of the stiffness
    longest = duration
    if bound * longest * longest > _RADIANS * _RADIANS * c.m:
        longest = _RADIANS / math.sqrt(bound / c.m)
    rate = (c.b_xx + c.b_yy) / c.m  # at least that of the fastest decay
    if rate * longest > _DECAY:
        longest = _DECAY / rate
    if p.pad[WHEEL_TERMS] > 0.0 and m[TOUCHING] != 0.0 and m[SIDE] != 0.0:
        # A fourth of the shortest wave, so that no patch comes and goes unseen.
        slide = abs(m[VX] - m[BELT]) + abs(m[SLOPES + 2] - m[BELT_SLOPE]) * m[STEP]
        if slide * longest > p.pad[CELL]:
            longest = p.pad[CELL] / slide
    return longest


@kernel(void(PLANT, DRIVE, GRID), inlined=False)
def first_step(p: Plant, drive: Drive, grid: Grid) -> None:
    """Find the phase of the initial state, and a step to begin with."""
    m = p.memory
    m[TOLERANCE] = _LOCAL * grid.tolerance
    arrive(p, drive)
    for i in range(SIZE):
        m[LARGEST + i] = abs(m[i])
    height = m[Y] - clear_height(p.pad)
    m[TOUCHING] = 0.0 if height > 0.0 or (height == 0.0 and m[VY] > 0.0) else 1.0
    if m[VX] == m[BELT]:
        take_hold(p)
    else:
        m[SIDE] = 1.0 if m[VX] > m[BELT] else -1.0
    slopes(p, 0, 0.0, m[X], m[Y], m[VX], m[VY])
    m[STEP] = _FIRST * _longest(p, grid.samples * grid.interval)


@kernel(float64(PLANT, float64), inlined=False)
def _defect(p: Plant, h: float) -> float:
    """By how much the continuous solution misses (6)-(7) inside a step, over what the tolerance leaves it.

    The error estimate is a linear functional of the slopes, which vanishes for a kink at certain places of a step.
    """
    m, worst = p.memory, 0.0
    along, across = rounding(p)
    for theta in (_EARLY, _LATE):
        x, y = interpolated(m, BEGIN, POWER, X, theta), interpolated(m, BEGIN, POWER, Y, theta)
        v_x, v_y = interpolated(m, BEGIN, POWER, VX, theta), interpolated(m, BEGIN, POWER, VY, theta)
        slopes(p, STAGES - 1, theta * h, x, y, v_x, v_y)
        for i in (VX, VY):
            if m[SIDE] == 0.0 and i == VX:
                continue
            defect = abs(interpolated_slope(m, POWER, i, theta) - h * m[SLOPES + SIZE * (STAGES - 1) + i])
            noise = _DENSE_ROUNDING * h * (along if i == VX else across) / p.c.m
            largest = max(m[LARGEST + i], abs(m[END + i]))
            worst = max(worst, defect / (_DEFECT * m[TOLERANCE] * largest + noise + _TINY))
    return worst


@kernel(float64(PLANT, float64, float64), inlined=False)
def _try(p: Plant, h: float, allowed: float) -> float:
    """Make the stages of a step, its end and, if its error is allowed, its continuous solution; the error.

    The error is that of the worst component over what the tolerance and rounding leave it.
    """
    m = p.memory
    worst = 0.0
    for i in range(SIZE):
        m[BEGIN + i] = m[i]
    for stage in range(1, STAGES):
        if stage == END_STAGE + 1:
            along, across = rounding(p)
            for i in range(SIZE):
                tangential = i in (X, VX)
                if m[SIDE] == 0.0 and tangential:
                    continue
                noise = h * (along if tangential else across) / p.c.m
                floor = noise if i >= VX else h * noise
                floor += 4.0 * EPSILON * max(abs(m[BEGIN + i]), abs(m[END + i]))
                largest = max(m[LARGEST + i], abs(m[END + i]))
                error = h * local_error(m, SLOPES, i) / (m[TOLERANCE] * largest + floor + _TINY)
                if not error < math.inf:
                    return math.inf
                worst = max(worst, error)
            if worst > allowed:
                return worst
        x, y, v_x, v_y = combined(m, SLOPES, stage)
        x, y = m[BEGIN + X] + h * x, m[BEGIN + Y] + h * y
        v_x, v_y = m[BEGIN + VX] + h * v_x, m[BEGIN + VY] + h * v_y
        slopes(p, stage, NODES[stage] * h, x, y, v_x, v_y)
        if stage == END_STAGE:
            m[END + X], m[END + Y], m[END + VX], m[END + VY] = x, y, v_x, v_y
            if p.contact[VALID] == 0.0:
                return math.inf
    make_continuous(m, SLOPES, BEGIN, END, POWER, h)
    m[STEP_DONE] = h
    return worst if p.contact[KIND] == 0.0 else max(worst, _defect(p, h))


@kernel(float64(PLANT, int64, float64), inlined=False)
def _to_event(p: Plant, which: int, h: float) -> float:
    """Make the step that ends at an event, located to rounding; its length, or 0 where the contact is not closed.

    A step to where the continuous solution has it, and from there one of Newton's, so short that it is exact.
    """
    m = p.memory
    if _try(p, h, math.inf) == math.inf:
        return 0.0
    margin = margins(p, h, 1.0)[which]
    slope = margin_slope(p, which)
    rest = -margin / slope if slope != 0.0 else 0.0
    if not abs(rest) <= 1e-3 * h:
        return h
    for i in range(SIZE):
        m[END + i] += rest * m[SLOPES + SIZE * END_STAGE + i]
    return h + rest


@kernel(void(PLANT, DRIVE, GRID, vector, float64, int64), inlined=False)
def _take(p: Plant, drive: Drive, grid: Grid, work: NDArray[np.float64], h: float, last: int) -> None:
    """Take the step that has been made; `last` is 1 where it reaches the end of the run."""
    m, interval = p.memory, grid.interval
    m[TIME_DONE], m[TAU_DONE] = m[TIME], m[TAU]
    m[SIDE_DONE], m[TOUCHING_DONE] = m[SIDE], m[TOUCHING]
    for item in range(WORKS):
        total = 0.0
        for stage in range(END_STAGE):
            total += A[END_STAGE, stage] * m[WORK_RATES + WORKS * stage + item]
        work[W_BELT + item] += h * total
    for i in range(SIZE):
        m[i] = m[END + i]
        m[LARGEST + i] = max(m[LARGEST + i], abs(m[i]))
        m[SLOPES + i] = m[SLOPES + SIZE * END_STAGE + i]
    for item in range(WORKS):
        m[WORK_RATES + item] = m[WORK_RATES + WORKS * END_STAGE + item]
    tau = m[TAU] + h
    whole = math.floor(tau / interval)
    m[LEVEL_AT] += whole
    m[TAU] = max(tau - whole * interval, 0.0)
    if last == 1:
        m[LEVEL_AT], m[TAU] = grid.samples, 0.0
    m[TIME] = interval * m[LEVEL_AT]
    arrive(p, drive)
    m[SWITCHES] = 0.0
    p.counts[KIND_0 + int(p.contact[KIND])] += 1


@kernel(int64(PLANT, int64, float64), inlined=False)
def _enter(p: Plant, which: int, longest: float) -> int:
    """Enter the phase after an event, and see that events do not pile up without progress; a `Failure`."""
    m = p.memory
    t = m[TIME] + m[TAU]
    switch(p, which)
    if t - m[EVENTS_TIME] > _NO_PROGRESS * longest:
        m[EVENTS_TIME], m[EVENTS] = t, 0.0
    m[EVENTS] += 1.0
    return _STALLED if m[EVENTS] > _MOST_EVENTS else _NONE


@kernel(int64(PLANT, DRIVE, GRID, vector), inlined=False)
def step(p: Plant, drive: Drive, grid: Grid, work: NDArray[np.float64]) -> int:
    """Take one step, up to an event at most; a `Failure`."""
    m, evaluations = p.memory, p.counts[EVALUATIONS]
    t = m[TIME] + m[TAU]
    to_end = (grid.samples - m[LEVEL_AT]) * grid.interval - m[TAU]
    longest = _longest(p, grid.samples * grid.interval)
    limit = min(longest, _to_knot(drive.belt, t), _to_knot(drive.load, t))
    last = 1 if to_end <= limit else 0
    limit = min(limit, to_end)
    h, growth = min(m[STEP], limit), _MOST
    while True:
        if h < limit:
            last = 0
        error = _try(p, h, 1.0)
        factor = max(_LEAST, min(growth, _SAFETY * error**-0.125)) if error > 0.0 else growth
        if error <= 1.0:
            break
        h, growth = h * factor, 1.0
        if not h > EPSILON * longest or m[TAU] + h == m[TAU]:
            return _STALLED if p.contact[VALID] == 1.0 else _NOT_CLOSED
    m[STEP] = max(h * factor, m[STEP] if h == limit else 0.0)
    which, theta = first_event(p, h)
    if which != NONE and theta == 0.0:
        m[SWITCHES] += 1.0
        if m[SWITCHES] > 2.0:  # two phases that both end at once: closer by, one of them does not
            m[STEP] = 0.1 * h
        if m[SWITCHES] > _MOST_SWITCHES:
            return _STALLED
        return _enter(p, which, longest)
    if which != NONE:
        h, last = _to_event(p, which, theta * h), 0
        if h == 0.0:
            return _NOT_CLOSED
    _take(p, drive, grid, work, h, last)
    p.counts[MOST] = max(p.counts[MOST], p.counts[EVALUATIONS] - evaluations)
    if not abs(m[X]) + abs(m[Y]) + abs(m[VX]) + abs(m[VY]) < BOUND:
        return _DIVERGED
    return _enter(p, which, longest) if which != NONE else _NONE
