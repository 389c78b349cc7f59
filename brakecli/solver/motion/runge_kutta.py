"""Runge-Kutta steps within a phase: stages, error and defect of a step, and one that ends at an event."""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import STAGES, V_X, V_Y, X
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion import tableaus
from brakecli.solver.motion.forces import act, find_margin_rates, find_margins, rounding
from brakecli.solver.motion.tableaus import END_STAGE, NODES, USED
from brakecli.solver.phases import STICK
from brakecli.solver.plant import Plant

_TINY = 1e-300  # no division by zero where nothing moves


@kernel(inline=False)
def advance_stages(p: Plant, tables: Floats, scratch: Floats, h: float, first: int, end: int) -> None:
    """The stages of a step h from one to another one, which is left out; that of its end puts it into `end`."""
    m = p.block
    r = p.runge
    for stage in range(first, end):
        if stopped(p.layer.pad.signals):  # an evaluation may take as long as a run
            return
        tableaus.combine(r, m.z, h, stage)
        act(p, tables, scratch, stage, NODES[r.pair, stage] * h, r.w)
    if first == END_STAGE:
        for i in range(4):
            r.end[i] = r.w[i]


@kernel(inline=False)
def _error(p: Plant, h: float) -> float:
    """The error of the worst component of a step, over what the tolerance and rounding leave it."""
    m = p.block
    r = p.runge
    worst = 0.0
    along, across = rounding(p)
    for i in range(4):
        tangential = i in (X, V_X)
        if m.phase == STICK and tangential:
            continue
        noise = h * (along if tangential else across) / p.c.m
        floor = noise if i >= V_X else h * noise
        floor += ROUNDING * max(abs(m.z[i]), abs(r.end[i]))
        largest = max(m.largest[i], abs(r.end[i]))
        error = h * tableaus.local_error(r, i) / (r.tolerance * largest + floor + _TINY)
        if not error < math.inf:
            return math.inf
        worst = max(worst, error)
    return worst


@kernel(inline=False)
def _defect(p: Plant, h: float, theta: float) -> float:
    """By how much the continuous solution misses (6)-(7) at a part of a step h, over 20 times its allowed error.

    It is |du/dθ - h f(u)|. The error estimate is a linear functional of the slopes, which vanishes for a kink at
    certain places of a step.
    """
    m = p.block
    r = p.runge
    worst = 0.0
    along, across = rounding(p)
    for i in range(V_Y if m.phase == STICK else V_X, 4):
        defect = abs(tableaus.interpolated_both(r, i, theta)[1] - h * r.slopes[STAGES - 1, i])
        noise = 63.0 * h * (along if i == V_X else across) / p.c.m  # 63 times that of stages
        largest = max(m.largest[i], abs(r.end[i]))
        worst = max(worst, defect / (20.0 * r.tolerance * largest + noise + _TINY))
    return worst


@kernel(inline=False)
def attempt(p: Plant, tables: Floats, scratch: Floats, h: float, allowed: float) -> float:
    """Make a step h from the motion reached, and its continuous solution if its error is allowed; the error."""
    r = p.runge
    advance_stages(p, tables, scratch, h, 1, USED[r.pair])
    advance_stages(p, tables, scratch, h, END_STAGE, END_STAGE + 1)
    if p.layer.contact.valid == 0:
        return math.inf
    worst = _error(p, h)
    if worst > allowed:
        return worst
    if r.pair == 0:
        advance_stages(p, tables, scratch, h, END_STAGE + 1, STAGES)
    tableaus.make_continuous(r, p.block.z, h)
    if p.layer.contact.kind == CLOSED_FORM:
        return worst
    for theta in (0.47, 0.93):  # between stages
        for i in range(4):
            r.w[i] = tableaus.interpolated(r, i, theta)
        act(p, tables, scratch, STAGES - 1, theta * h, r.w)
        worst = max(worst, _defect(p, h, theta))
    return worst


@kernel(inline=False)
def to_event(p: Plant, tables: Floats, scratch: Floats, which: int, h: float) -> float:
    """Make the step that ends at an event, located to rounding; its length (s), or 0 where a closed form fails.

    A step to where the continuous solution has it, and from there one of Newton's, so short that it is exact.
    Where a loose tolerance lets the step come to another place, it is made anew.
    """
    r = p.runge
    longest = r.length
    for _ in range(8):
        if attempt(p, tables, scratch, h, math.inf) == math.inf:
            return 0.0
        rates = r.slopes[END_STAGE]
        find_margins(p, r.end, rates[V_Y], h)
        find_margin_rates(p, rates, r.touch[END_STAGE, 1])
        slope = r.margin_rate[which]
        correction = -r.margin[which] / slope if slope != 0.0 else 0.0
        if abs(correction) <= 1e-6 * h:  # what is missed then is about its square
            for i in range(4):
                r.end[i] += correction * rates[i]
            h += correction
            break
        if not 0.0 < h + correction <= longest:
            break
        h += correction
    else:
        h = r.length
    return h
