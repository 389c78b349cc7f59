"""The compiled part of the reference: exact contact, forces, steps of order 8 and places of events.

Nothing here comes from brakecli. All kernels stand in one file, so that an edited one is compiled again together
with those that call it. Units are SI; symbols are those of docs/model.md.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

Floats = NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """A compiled function for Python and for other kernels; division by zero raises."""
    compiled: F = numba.njit(cache=True)(function)
    return compiled


def inner(function: F) -> F:
    """A compiled function for other kernels only, which saves compiling what Python would call."""
    compiled: F = numba.njit(cache=True, no_cpython_wrapper=True)(function)
    return compiled


Three = tuple[float, float, float]
SLIP = 0
STICK = 1
STAGES = 12
# Coefficients of Dormand and Prince, order 8, as SciPy publishes them; its stepper is not used.
A, B, C = (np.ascontiguousarray(each, dtype=float) for each in (DOP853.A[:STAGES, :STAGES], DOP853.B, DOP853.C))
E3, E5 = (np.ascontiguousarray(each[:STAGES], dtype=float) for each in (DOP853.E3, DOP853.E5))
GRAZING = 1e-3  # of what an event function would fall by along its slopes: room for its curve within a step
NARROWEST = 1e-8  # width of a part of the pad that is not divided further, over the half length
MOST_PARTS = 64
ROUNDING = 1e-13  # of an event function, over what it falls by within a step
MOST_STEPS = 3_000_000


class Shoe(NamedTuple):
    """The numbers of a case: Eqs. (6) and (7), the contact, and the surfaces at the edges of cells of the pad."""

    m: float
    c_xx: float
    c_xy: float
    c_yy: float
    b_xx: float
    b_xy: float
    b_yy: float
    sin_beta: float
    cos_beta: float
    phi: float
    k: float
    a: float
    g_1: Floats
    q_1: Floats  # wavenumbers, rad/m
    p_1: Floats  # phases, rad
    g_2: Floats
    q_2: Floats
    edges: Floats  # of the cells, m
    f_1: Floats  # the shoe's surface there, m
    sines: Floats  # of q_2 times the edges, one row for each wave
    cosines: Floats
    curvature: float  # bound of the second derivative of f_2 - f_1, 1/m
    height: float  # bound of |f_2 - f_1|, m
    area_1: float  # integral of f_1 over the pad, m²


class Span(NamedTuple):
    """A time without knots in it: speed U + U_t t and load Q + Q_t t, with the phases of the wheel at t = 0."""

    length: float  # s
    U: float
    U_t: float  # m/s²
    Q: float
    Q_t: float  # N/s
    phases: Floats  # of the wheel's waves where the shoe is at x = 0, rad


class Phase(NamedTuple):
    """What the forces follow until an event."""

    mode: int
    sign: float  # of the sliding speed, in slip
    pressed: bool  # a smooth pad on its wheel


class Work(NamedTuple):
    """Places of a step: the state, what rounding has left out of it, rates of the stages, and the state behind."""

    z: Floats
    rest: Floats
    scale: Floats
    k: Floats
    new: Floats
    new_rest: Floats
    rate: Floats


@inner
def gap(shoe: Shoe, theta: Floats, xi: float) -> tuple[float, float]:
    """f_2 - f_1 at a place of the pad, and its slope; theta are the phases of the wheel at its centre."""
    height = 0.0
    slope = 0.0
    for i in range(len(shoe.g_2)):
        angle = shoe.q_2[i] * xi + theta[i]
        height += shoe.g_2[i] * math.sin(angle)
        slope += shoe.g_2[i] * shoe.q_2[i] * math.cos(angle)
    for i in range(len(shoe.g_1)):
        angle = shoe.q_1[i] * xi + shoe.p_1[i]
        height -= shoe.g_1[i] * math.sin(angle)
        slope -= shoe.g_1[i] * shoe.q_1[i] * math.cos(angle)
    return height, slope


@inner
def area(shoe: Shoe, theta: Floats, y: float, left: float, right: float) -> float:
    """The integral of f_2 - f_1 - y, m²; differences of cosines as products, so that nothing cancels."""
    middle = 0.5 * (left + right)
    half = 0.5 * (right - left)
    total = -2.0 * y * half
    for i in range(len(shoe.g_2)):
        q = shoe.q_2[i]
        total += 2.0 * shoe.g_2[i] / q * math.sin(q * half) * math.sin(q * middle + theta[i])
    for i in range(len(shoe.g_1)):
        q = shoe.q_1[i]
        total -= 2.0 * shoe.g_1[i] / q * math.sin(q * half) * math.sin(q * middle + shoe.p_1[i])
    return total


@inner
def root(shoe: Shoe, theta: Floats, y: float, left: float, right: float, low: float, high: float) -> float:
    """The one root between places where f_2 - f_1 - y has the signs of `low` and `high`: Newton in a bracket."""
    rising = high > low
    xi = left + (right - left) * low / (low - high)
    for _ in range(60):
        height, slope = gap(shoe, theta, xi)
        height -= y
        if height == 0.0:
            return xi
        if (height < 0.0) == rising:
            left = xi
        else:
            right = xi
        new = xi - height / slope if slope != 0.0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
        if abs(new - xi) <= 2e-16 * shoe.a:
            return new
        xi = new
    return xi


@kernel
def contact(shoe: Shoe, theta: Floats, y: float) -> tuple[float, float]:
    """The exact normal force, Eq. (2), N, and the length that touches, m.

    Cells are divided until the bound of the curvature proves that they hold no root, or one.
    """
    if y >= shoe.height and shoe.height > 0.0:
        return 0.0, 0.0
    if y <= -shoe.height:
        return shoe.k * area(shoe, theta, y, -shoe.a, shoe.a), 2.0 * shoe.a
    bent = shoe.curvature
    total = 0.0
    length = 0.0
    lefts = np.empty(MOST_PARTS)
    rights = np.empty(MOST_PARTS)
    lows = np.empty(MOST_PARTS)
    highs = np.empty(MOST_PARTS)
    turn_s = np.sin(theta)
    turn_c = np.cos(theta)
    at = 0.0
    for j in range(len(shoe.edges)):
        before = at
        at = -shoe.f_1[j] - y
        for i in range(len(shoe.g_2)):
            at += shoe.g_2[i] * (shoe.sines[i, j] * turn_c[i] + shoe.cosines[i, j] * turn_s[i])
        if j == 0:
            begun = -shoe.a if at > 0.0 else math.nan
            continue
        count = 1
        lefts[0] = shoe.edges[j - 1]
        rights[0] = shoe.edges[j]
        lows[0] = before
        highs[0] = at
        while count > 0:
            count -= 1
            left = lefts[count]
            right = rights[count]
            low = lows[count]
            high = highs[count]
            width = right - left
            same = (low > 0.0) == (high > 0.0)
            if same and min(abs(low), abs(high)) > 0.125 * bent * width * width:
                continue
            middle = 0.5 * (left + right)
            height, slope = gap(shoe, theta, middle)
            narrow = width < NARROWEST * shoe.a or count + 2 > MOST_PARTS
            if abs(slope) > 0.5 * bent * width or narrow:
                if same:
                    continue
                place = root(shoe, theta, y, left, right, low, high)
                if high > 0.0:
                    begun = place
                else:
                    total += area(shoe, theta, y, begun, place)
                    length += place - begun
                continue
            height -= y  # the left half lies on top, so that roots are found from left to right
            lefts[count] = middle
            rights[count] = right
            lows[count] = height
            highs[count] = high
            lefts[count + 1] = left
            rights[count + 1] = middle
            lows[count + 1] = low
            highs[count + 1] = height
            count += 2
    if at > 0.0:
        total += area(shoe, theta, y, begun, shoe.a)
        length += shoe.a - begun
    return shoe.k * total, length


@inner
def normal(shoe: Shoe, span: Span, t: float, x: float, y: float, pressed: bool) -> tuple[float, float]:
    """Normal force, N, and touching length, m; a smooth pad is pressed or not until an event says otherwise."""
    if shoe.height == 0.0:
        return (-2.0 * shoe.a * shoe.k * y, 2.0 * shoe.a) if pressed else (0.0, 0.0)
    theta = shoe.q_2 * (x - (span.U + 0.5 * span.U_t * t) * t) + span.phases
    return contact(shoe, theta, y)


@inner
def needed(shoe: Shoe, span: Span, t: float, z: Floats) -> float:
    """The friction force that gives the shoe the acceleration of the wheel, from Eq. (6), N."""
    x, y, vx, vy = z
    links = shoe.b_xx * vx + shoe.c_xx * x + shoe.b_xy * vy + shoe.c_xy * y
    return shoe.m * span.U_t + links + (span.Q + span.Q_t * t) * shoe.sin_beta


@inner
def rates(shoe: Shoe, span: Span, t: float, z: Floats, phase: Phase, out: Floats) -> tuple[float, float]:
    """Time derivatives of x, y, vx and vy, Eqs. (3) to (7); returns normal force and touching length."""
    x, y, vx, vy = z
    F_y, length = normal(shoe, span, t, x, y, phase.pressed)
    Q = span.Q + span.Q_t * t
    out[0] = vx
    out[1] = vy
    if phase.mode == STICK:
        out[2] = span.U_t
    else:
        links = shoe.b_xx * vx + shoe.c_xx * x + shoe.b_xy * vy + shoe.c_xy * y
        out[2] = (-links - shoe.phi * F_y * phase.sign - Q * shoe.sin_beta) / shoe.m
    links = shoe.b_yy * vy + shoe.c_yy * y + shoe.b_xy * vx + shoe.c_xy * x
    out[3] = (-links + F_y - Q * shoe.cos_beta) / shoe.m
    return F_y, length


@inner
def step(shoe: Shoe, span: Span, t: float, h: float, phase: Phase, work: Work) -> float:
    """A step of order 8 from z + rest, where k[0] are the rates, to `new`; returns its error over the scale."""
    k = work.k
    stage = np.empty(4)
    for s in range(1, STAGES):
        for i in range(4):
            total = 0.0
            for r in range(s):
                total += A[s, r] * k[r, i]
            stage[i] = work.z[i] + (work.rest[i] + h * total)
        rates(shoe, span, t + C[s] * h, stage, phase, k[s])
    fifth = 0.0
    third = 0.0
    for i in range(4):
        total = 0.0
        five = 0.0
        three = 0.0
        for s in range(STAGES):
            total += B[s] * k[s, i]
            five += E5[s] * k[s, i]
            three += E3[s] * k[s, i]
        more = work.rest[i] + h * total
        work.new[i] = work.z[i] + more
        work.new_rest[i] = more - (work.new[i] - work.z[i])
        fifth += (five / work.scale[i]) ** 2
        third += (three / work.scale[i]) ** 2
    if phase.mode == STICK:
        work.new[2] = span.U + span.U_t * (t + h)
        work.new_rest[2] = 0.0
    if fifth == 0.0:
        return 0.0
    return abs(h) * fifth / math.sqrt(4.0 * (fifth + 0.01 * third))


@inner
def ends(
    shoe: Shoe, span: Span, t: float, z: Floats, rate: Floats, phase: Phase, F_y: float, length: float
) -> tuple[Three, Three]:
    """What is positive as long as the phase lasts, and its slopes over time.

    In slip this is the sliding speed, in stick the room on both sides of the cone of friction, on smooth surfaces
    the height, positive on the side where the pad is. What does not apply is 1.
    """
    one = 1.0
    d_one = 0.0
    two = 1.0
    d_two = 0.0
    three = 1.0
    d_three = 0.0
    if phase.mode == SLIP and shoe.phi > 0.0:
        one = phase.sign * (z[2] - (span.U + span.U_t * t))
        d_one = phase.sign * (rate[2] - span.U_t)
    elif phase.mode == STICK:
        force = needed(shoe, span, t, z)
        grown = shoe.b_xx * span.U_t + shoe.c_xx * z[2] + shoe.b_xy * rate[3] + shoe.c_xy * z[3]
        grown += span.Q_t * shoe.sin_beta
        pull = -shoe.phi * shoe.k * length * z[3]  # a stuck shoe moves with the wheel: only y changes the force
        one = shoe.phi * F_y - force
        d_one = pull - grown
        two = shoe.phi * F_y + force
        d_two = pull + grown
    if shoe.height == 0.0:
        three, d_three = (-z[1], -z[3]) if phase.pressed else (z[1], z[3])
    return (one, two, three), (d_one, d_two, d_three)


@inner
def look(shoe: Shoe, span: Span, t: float, h: float, phase: Phase, work: Work) -> tuple[Three, Three]:
    """What ends the phase, and its slopes, after a step of h."""
    step(shoe, span, t, h, phase, work)
    F_y, length = rates(shoe, span, t + h, work.new, phase, work.rate)
    return ends(shoe, span, t + h, work.new, work.rate, phase, F_y, length)


@inner
def lowest(v_0: float, s_0: float, v_1: float, s_1: float, h: float) -> float:
    """The least value within a step of the cubic with these values and slopes at its ends."""
    low = min(v_0, v_1)
    for i in range(1, 16):
        u = i / 16.0
        w = 1.0 - u
        rise = w * w * ((1.0 + 2.0 * u) * v_0 + u * h * s_0)
        low = min(low, rise + u * u * ((3.0 - 2.0 * u) * v_1 - w * h * s_1))
    return low


@inner
def dip(shoe: Shoe, span: Span, t: float, h: float, phase: Phase, work: Work, e: int, fall: float) -> float:
    """Where within a step of h the e-th of what ends a phase is negative, though not behind it; -1 if nowhere."""
    low = 0.0
    high = h
    for _ in range(60):
        at = 0.5 * (low + high)
        values, slopes = look(shoe, span, t, at, phase, work)
        if values[e] < -ROUNDING * fall:
            return at
        if high - low < 1e-13 * h:
            break
        if slopes[e] < 0.0:
            low = at
        else:
            high = at
    return -1.0


@inner
def zero(shoe: Shoe, span: Span, t: float, h: float, phase: Phase, work: Work, e: int, least: float) -> float:
    """The first zero of the e-th of what ends a phase, which is negative after a step of h: Illinois, and halves.

    It may be zero at the start of the step, where a phase has just begun.
    """
    low = 0.0
    high = h
    at = 0.0
    v_low = 0.0
    v_high = 0.0
    side = 0
    for turn in range(200):
        before = at
        at = 0.5 * (low + high)
        if turn % 4 < 3 and v_low > 0.0 > v_high:
            at = low + (high - low) * v_low / (v_low - v_high)
        value = look(shoe, span, t, at, phase, work)[0][e]
        if value < 0.0:
            high = at
            v_high = value
            v_low = 0.5 * v_low if side < 0 else v_low
            side = -1
        else:
            low = at
            v_low = value
            v_high = 0.5 * v_high if side > 0 else v_high
            side = 1
        if value == 0.0 < at or high - low <= least or (abs(at - before) <= least and v_low > 0.0 > v_high):
            break
    return at


@inner
def begin(shoe: Shoe, span: Span, t: float, z: Floats, phase: Phase, rate: Floats) -> Phase:
    """Stick or slip of a shoe that has the velocity of the wheel, and the sign of slip: Eqs. (3) to (5)."""
    F_y, _ = rates(shoe, span, t, z, phase, rate)
    force = needed(shoe, span, t, z)
    if shoe.phi > 0.0 and abs(force) <= shoe.phi * F_y:
        return Phase(STICK, phase.sign, phase.pressed)
    return Phase(SLIP, (-1.0 if force > 0.0 else 1.0 if force < 0.0 else phase.sign), phase.pressed)


@kernel
def integrate(
    shoe: Shoe,
    spans: Floats,
    phases: Floats,
    work: Work,
    longest: float,
    tolerance: float,
    sampled: Floats,
    counts: Floats,
) -> bool:
    """Integrate over the spans, rows of `Span`; `sampled` receives the state at the end of each.

    `longest` is the longest step, s; a step may be wrong by the tolerance, times the scale. `counts` receives the
    number of sticks, of turns of friction without stick, of lifts (rough: steps without touch), of steps with an
    open pad, and of steps. Returns whether it succeeded.
    """
    z = work.z
    rest = work.rest
    h = 1e-3 * longest
    acceleration = math.nan
    pressed = z[1] < 0.0 or (z[1] == 0.0 and (z[3] < 0.0 or (z[3] == 0.0 and spans[0, 3] * shoe.cos_beta > 0.0)))
    phase = Phase(SLIP, (1.0 if z[2] > spans[0, 1] else -1.0), pressed)
    if z[2] == spans[0, 1]:
        span = Span(spans[0, 0], spans[0, 1], spans[0, 2], spans[0, 3], spans[0, 4], phases[0])
        phase = begin(shoe, span, 0.0, z, phase, work.rate)
        counts[0] += phase.mode == STICK
    for number in range(len(spans)):
        one = spans[number]
        span = Span(one[0], one[1], one[2], one[3], one[4], phases[number])
        t = 0.0
        if phase.mode == STICK and span.U_t != acceleration:  # at a knot the wheel's acceleration jumps
            z[2] = span.U
            rest[2] = 0.0
            phase = begin(shoe, span, t, z, phase, work.rate)
            h = 1e-3 * longest
        acceleration = span.U_t
        while t < span.length:
            counts[4] += 1.0
            if counts[4] > MOST_STEPS:
                return False
            F_y, length = rates(shoe, span, t, z, phase, work.k[0])
            values, slopes = ends(shoe, span, t, z, work.k[0], phase, F_y, length)
            last = t + h >= span.length * (1.0 - 1e-14)
            taking = span.length - t if last else h
            error = step(shoe, span, t, taking, phase, work) / tolerance
            if not math.isfinite(error):
                return False
            if error > 1.0 and taking > 1e-9 * longest:
                h = taking * max(0.2, 0.9 * error**-0.125)
                continue
            counts[2] += shoe.height > 0.0 and length == 0.0
            counts[3] += 0.0 < length < 2.0 * shoe.a * (1.0 - 1e-12)
            after, risen = look(shoe, span, t, taking, phase, work)
            first = taking
            which = -1
            for e in range(3):
                upper = -1.0
                fall = taking * (abs(slopes[e]) + abs(risen[e]))
                if after[e] < 0.0:
                    upper = taking
                elif slopes[e] < 0.0 < risen[e]:
                    least = lowest(values[e], slopes[e], after[e], risen[e], taking)
                    if least <= GRAZING * fall:
                        upper = dip(shoe, span, t, taking, phase, work, e, fall)
                if upper > 0.0:
                    place = zero(shoe, span, t, upper, phase, work, e, 1e-16 * longest)
                    if place <= first:
                        first = place
                        which = e
            if which >= 0:
                taking = first
                last = False
            step(shoe, span, t, taking, phase, work)  # again: looking for events has used its place
            z[:] = work.new
            rest[:] = work.new_rest
            t = span.length if last else t + taking
            if which < 0:
                grown = taking * min(5.0, 0.9 * max(error, 1e-12) ** -0.125)
                h = min(longest, max(h, grown) if last else grown)
                continue
            h = 1e-3 * longest
            if which == 2:
                phase = Phase(phase.mode, phase.sign, not phase.pressed)
                z[1] = 0.0
                rest[1] = 0.0
                counts[2] += not phase.pressed
            elif phase.mode == SLIP:
                z[2] = span.U + span.U_t * t
                rest[2] = 0.0
                phase = begin(shoe, span, t, z, phase, work.rate)
                counts[0] += phase.mode == STICK
                counts[1] += phase.mode == SLIP
            else:
                phase = Phase(SLIP, (-1.0 if which == 0 else 1.0), phase.pressed)
        sampled[number] = z
    return True
