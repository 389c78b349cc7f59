"""The first event in a step that keeps a tolerance: which margin runs out, where on the continuous solution."""

import math

from brakecli.solver.block import BELT, BELT_SLOPE, MARGINS, V_X, V_Y, X, Y
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.motion.forces import NEAR, find_margin_rates, find_margins, rounding
from brakecli.solver.motion.locate import NO_EVENT
from brakecli.solver.motion.tableaus import END_STAGE, interpolated_both, reach
from brakecli.solver.phases import HEIGHT, OPEN, SOONER, STICK, side_of
from brakecli.solver.plant import Plant

LOOKS = 8
"""Places of a step at which the margins are looked at; a step is at most two radians of the fastest motion."""


@kernel(inline=False)
def _see(p: Plant, theta: float) -> None:
    """The margins of the phase at the part theta of the step, and their rates.

    In stick the rate of F_y takes the stiffness of the contact between those at both ends.
    """
    m = p.block
    r = p.runge
    since = theta * r.length
    for i in range(4):
        r.w[i], slope = interpolated_both(r, i, theta)
        r.rates[i] = slope / r.length
    if m.phase == STICK:
        r.w[X] = m.z[X] + (m.z[BELT] + 0.5 * m.z[BELT_SLOPE] * since) * since
        r.w[V_X] = m.z[BELT] + m.z[BELT_SLOPE] * since
        r.rates[X] = r.w[V_X]
        r.rates[V_X] = m.z[BELT_SLOPE]
    find_margins(p, r.w, r.rates[V_Y], since)
    find_margin_rates(p, r.rates, r.touch[0, 1] + theta * (r.touch[END_STAGE, 1] - r.touch[0, 1]))


@kernel
def _allowances(p: Plant) -> tuple[float, float, float]:
    """How far each margin may be below zero by rounding alone.

    The acceleration along y is rounded as its velocity is, over the step.
    """
    m = p.block
    r = p.runge
    height = ROUNDING * (abs(m.z[Y]) + p.layer.pad.clear_from)
    if m.phase != STICK:
        late = abs(m.z[BELT_SLOPE]) * (m.base + m.time)  # the wheel's velocity at a time that is rounded
        return height, ROUNDING * (abs(m.z[V_X]) + abs(m.z[BELT]) + late), 0.0
    along, _ = rounding(p)
    along += p.c.phi * p.c.m * ROUNDING * max(abs(m.z[V_Y]), abs(r.end[V_Y])) / r.length
    return height, 2.0 * along, 2.0 * along


@kernel(inline=False)
def _root(p: Plant, which: int, low: float, high: float) -> float:
    """Where a margin falls through zero between left and right: Newton's iteration, kept in the bracket."""
    r = p.runge
    theta = 0.5 * (low + high)
    for _ in range(60):  # halving alone takes 40
        _see(p, theta)
        value = r.margin[which]
        rate = r.length * r.margin_rate[which]
        if value > 0.0:
            low = theta
        else:
            high = theta
        new = theta - value / rate if rate < 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - theta) <= 1e-12 * high:  # the true motion makes it exact
            return new
        theta = new
    return theta


@kernel(inline=False)
def _depth(p: Plant, which: int, root: float) -> float:
    """How far below zero a margin would fall behind its root, if the phase went on: by a parabola; or infinity.

    With the rates m' at the root and m_1' a time τ before it that is m'² τ / 2(m' - m_1').
    """
    r = p.runge
    apart = min(root, 0.05)  # part of a step over which the margin bends
    _see(p, root - apart)
    before = r.margin_rate[which]
    _see(p, root)
    fall = r.margin_rate[which]
    bend = (fall - before) / (apart * r.length)
    return 0.5 * fall * fall / bend if bend > 0.0 else math.inf


@kernel(inline=False)
def _above(p: Plant, which: int, right: float, allowed: float) -> float:
    """Where a margin that begins at zero is positive before it is negative at `right`; 0 where it never is."""
    theta = right
    for _ in range(8):
        theta *= SOONER
        _see(p, theta)
        if p.runge.margin[which] > allowed:
            return theta
    return 0.0


@kernel(inline=False)
def _below(p: Plant, which: int, first: float, allowed: float, near: float) -> float:
    """Where a margin is negative between two looks, or 0: at the second one, or where it is lowest in between.

    How low it gets without an event is kept, unless it begins at zero.
    """
    r = p.runge
    begin = r.first_margin[which]
    end = r.last_margin[which]
    if end < -allowed:
        return first + 1.0 / LOOKS
    width = r.length / LOOKS
    fall = width * r.first_rate[which]
    rise = width * r.last_rate[which]
    share, value = lowest(begin, fall, end, rise)
    # the margin may leave the cubic by a part of its changes by the rates at both looks
    if share < 0.0 or value > allowed + near + 0.01 * (abs(fall) + abs(rise)):
        return 0.0
    theta = first + share / LOOKS
    _see(p, theta)
    value = r.margin[which]
    if value < -allowed:
        return theta
    if which != HEIGHT and begin > allowed:
        r.lowest = min(r.lowest, value)
    return 0.0


@kernel(inline=False)
def crossing(p: Plant, h: float) -> tuple[int, float]:
    """The margin that runs out first and the part of the step at which it does; 0 where it never was positive.

    None does where the continuous solution cannot get that far from the begin of the step. A margin may also dip
    between two looks. How low it gets without an event is kept, and how far it would fall behind one, as the error
    of the motion may make an event of it, or none.
    """
    m = p.block
    r = p.runge
    sliding = side_of(m.phase) * (m.z[V_X] - m.z[BELT])
    near = 2.0 * NEAR * p.tangent.moved if p.tangent.knows == 1 else 0.0
    far = reach(r, V_X) + abs(m.z[BELT_SLOPE]) * h + near
    r.lowest = math.inf
    stays = abs(m.z[Y] - p.layer.pad.clear_from) > reach(r, Y)
    if stays and (m.phase == OPEN or (m.phase != STICK and sliding > far)):
        return NO_EVENT, 1.0
    allowed = _allowances(p)
    event = NO_EVENT
    first = 1.0
    _see(p, 0.0)
    for look in range(LOOKS):
        begin = look / LOOKS
        for which in range(MARGINS):
            r.first_margin[which] = r.margin[which] if look == 0 else r.last_margin[which]
            r.first_rate[which] = r.margin_rate[which] if look == 0 else r.last_rate[which]
        _see(p, begin + 1.0 / LOOKS)
        for which in range(MARGINS):
            r.last_margin[which] = r.margin[which]
            r.last_rate[which] = r.margin_rate[which]
        for which in range(MARGINS):
            below = _below(p, which, begin, allowed[which], near)
            if below == 0.0:
                continue
            start = begin
            if look == 0 and r.first_margin[which] <= allowed[which]:
                start = _above(p, which, below, allowed[which])
                if start == 0.0:
                    return which, 0.0
            root = _root(p, which, start, below)
            if root < first:
                event = which
                first = root
        if event != NO_EVENT:
            if event != HEIGHT:
                r.lowest = min(r.lowest, _depth(p, event, first))
            return event, first
    return NO_EVENT, 1.0
