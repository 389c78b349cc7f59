"""The first event in a step that keeps a tolerance: which margin runs out, where on the continuous solution."""

import math

from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.forces import NEAR, find_margins, rounding
from brakecli.solver.motion.locate import NO_EVENT
from brakecli.solver.motion.phases import HEIGHT, OPEN, SOONER, STICK, side_of
from brakecli.solver.motion.record import BELT, BELT_SLOPE, MARGINS, V_X, V_Y, Y
from brakecli.solver.motion.tableaus import interpolated, interpolated_both, reach
from brakecli.solver.plant import Plant

LOOKS = 8
"""Places of a step at which the margins are looked at; a step is at most two radians of the fastest motion."""

_NEAR = 1e-12
_BESIDE = 1e-3
"""Part of a step over which a margin rises or falls at its ends."""
_APART = 0.05
"""Part of a step between the places of a parabola."""
_GOLDEN = 0.3819660112501051
_GOLDEN_STEPS = 40
"""Part of a bracket at which it is divided, and how often: to 1e-8 of itself, and 1e-16 in the value."""
_SECANTS = 20
_MOST_STEPS = 100
"""Steps of the search for a root by secants, after which brackets are halved, and all of them."""
_SOUGHT = 8
"""Places at which a margin that begins at zero is sought above it."""
_FALLS = 7.0
"""Rise², over bend and height in the middle, beyond which a parabola falls to an eighth of that: it falls by
rise² / (8 bend), and 8 (1 - 1/8) = 7."""

Margins = tuple[float, float, float]


@kernel(inline=False)
def margins(p: Plant, theta: float) -> Margins:
    """The margins of the phase at the part theta of the step."""
    m = p.block
    r = p.runge
    acceleration = 0.0
    r.w[Y] = interpolated(r, Y, theta)
    if m.phase == STICK:
        since = theta * r.length
        r.w[0] = m.z[0] + (m.z[BELT] + 0.5 * m.z[BELT_SLOPE] * since) * since
        r.w[V_X] = m.z[BELT] + m.z[BELT_SLOPE] * since
        r.w[V_Y], slope = interpolated_both(r, V_Y, theta)
        acceleration = slope / r.length
    elif m.phase != OPEN:
        r.w[V_X] = interpolated(r, V_X, theta)
    find_margins(p, r.w, acceleration, theta * r.length)
    return r.margin[0], r.margin[1], r.margin[2]


@kernel
def _allowances(p: Plant) -> Margins:
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
def _root(p: Plant, which: int, left: float, right: float) -> float:
    """Where a margin passes zero between left and right: the secant inside the bracket, halved if it lags.

    Near enough for Newton's iteration on the true motion to make it exact.
    """
    low = margins(p, left)[which]
    high = margins(p, right)[which]
    if low <= 0.0:
        return left
    place = left
    moved = 0
    for turn in range(_MOST_STEPS):
        new = left + (right - left) * (low / (low - high))
        if turn > _SECANTS or not left < new < right:
            new = 0.5 * (left + right)
        if abs(new - place) <= _NEAR * right or right - left <= _NEAR * right:
            return new
        place = new
        value = margins(p, place)[which]
        if value > 0.0:
            left = place
            low = value
            high *= 0.5 if moved == 1 else 1.0  # Illinois: the end that stays twice counts less
            moved = 1
        elif value < 0.0:
            right = place
            high = value
            low *= 0.5 if moved == -1 else 1.0
            moved = -1
        else:
            return place
    return right


@kernel(inline=False)
def lowest(p: Plant, which: int, left: float, right: float) -> tuple[float, float]:
    """Where a margin is lowest between left and right, and its value; by the golden section, until below zero."""
    a = left + _GOLDEN * (right - left)
    b = right - _GOLDEN * (right - left)
    at_a = margins(p, a)[which]
    at_b = margins(p, b)[which]
    for _ in range(_GOLDEN_STEPS):
        if at_a < 0.0 or at_b < 0.0:
            break
        if at_a < at_b:
            right = b
            b = a
            at_b = at_a
            a = left + _GOLDEN * (right - left)
            at_a = margins(p, a)[which]
        else:
            left = a
            a = b
            at_a = at_b
            b = right - _GOLDEN * (right - left)
            at_b = margins(p, b)[which]
    return (a, at_a) if at_a < at_b else (b, at_b)


@kernel(inline=False)
def _depth(p: Plant, which: int, root: float) -> float:
    """How far below zero a margin would fall behind its root, if the phase went on: by a parabola; or infinity.

    With m_1 and m_2 at one and two distances before the root that is (2 m_1 - m_2/2)²/2(m_2 - 2 m_1).
    """
    apart = 0.5 * min(root, 2.0 * _APART)
    one = margins(p, root - apart)[which]
    two = margins(p, root - 2.0 * apart)[which]
    fall = 2.0 * one - 0.5 * two
    bend = two - 2.0 * one
    return 0.5 * fall * fall / bend if bend > 0.0 else math.inf


@kernel(inline=False)
def crossing(p: Plant, h: float) -> tuple[int, float]:
    """The margin that runs out first and the part of the step at which it does; 0 where it never was positive.

    None does where the continuous solution cannot get that far from the begin of the step. A margin may also dip
    between two places: it is followed down beside the ends of the step, and where a parabola says that it comes so
    `near` to zero. How low it gets without an event is kept, and how far it would fall behind one, as the error of
    the motion may make an event of it, or none.
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
    before_last = last = margins(p, 0.0)
    for look in range(1, LOOKS + 1):
        theta = look / LOOKS
        found = NO_EVENT
        first = math.inf
        now = margins(p, theta)
        for which in range(MARGINS):
            left = (look - 1) / LOOKS
            right = 0.0
            dip = -1.0
            until = 0.0
            bend = before_last[which] - 2.0 * last[which] + now[which]
            rise = now[which] - before_last[which]
            if now[which] < -allowed[which]:
                right = theta
                if look == 1 and last[which] <= allowed[which]:  # it begins at zero: where is it positive?
                    left = theta
                    for _ in range(_SOUGHT):
                        left *= SOONER
                        if margins(p, left)[which] > allowed[which]:
                            break
                    else:
                        return which, 0.0
            elif look == 1 and allowed[which] < last[which] <= now[which]:
                dip = 0.0 if margins(p, _BESIDE)[which] < last[which] else -1.0
                until = theta
            elif before_last[which] > last[which] <= now[which] and rise * rise > _FALLS * bend * (
                last[which] - near
            ):
                dip = theta - 2.0 / LOOKS
                until = theta
            if right == 0.0 and dip < 0.0 and look == LOOKS and now[which] <= last[which]:
                dip = left if margins(p, 1.0 - _BESIDE)[which] < now[which] else -1.0
                until = theta
            if dip >= 0.0:
                place, value = lowest(p, which, dip, until)
                if value < -allowed[which]:
                    left = dip
                    right = place
                elif which != HEIGHT:
                    r.lowest = min(r.lowest, value)
            if right > 0.0:
                root = _root(p, which, left, right)
                if root < first:
                    found = which
                    first = root
        if found != NO_EVENT:
            if found != HEIGHT:
                r.lowest = min(r.lowest, _depth(p, found, first))
            return found, first
        before_last = last
        last = now
    return NO_EVENT, 1.0
