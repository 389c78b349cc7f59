"""A whole step as a matrix, and what goes along with it: the error of the motion, a disturbance, its turns."""

import math
from typing import Any

from numba import float64, int64, types, void

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import kernel
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.motions import (
    AHEAD,
    BELT,
    BELT_SLOPE,
    FLOW_TYPE,
    LOAD,
    LOAD_SLOPE,
    MARGINS,
    SIZE,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.records import COEFFICIENTS, TANGENT_TYPE, TRACK_TYPE
from brakecli.solver.schemes.piecewise_exact.phases import acceleration
from brakecli.solver.tangent import kept
from brakecli.solver.track import put, turned

_FLAT = 1e-12  # fall of a margin over its rise, by which it dips by 1e-18 of this at most
_NEAR = 0.03  # part of a step by which an iteration of third order may move a turning point at last
_CORRECTED = 6  # steps of that iteration, at most
_ERROR_TERMS = 9  # of the series of an error, which is known to a few digits only

Four = tuple[float, float, float, float]
_FOUR = types.UniTuple(float64, 4)


@kernel(void(FLOW_TYPE))
def _ahead(m: Any) -> None:
    """The matrix of a step times the motion, Σ now_ik z_i, in `after`; a tree of sums has less latency."""
    a = m.now
    z = m.z
    z_0 = z[0]
    z_1 = z[1]
    z_2 = z[2]
    z_3 = z[3]
    z_4 = z[4]
    z_5 = z[5]
    z_6 = z[6]
    z_7 = z[7]
    for k in range(AHEAD):
        one = a[0, k] * z_0 + a[1, k] * z_1
        two = a[2, k] * z_2 + a[3, k] * z_3
        three = a[4, k] * z_4 + a[5, k] * z_5
        four = a[6, k] * z_6 + a[7, k] * z_7
        m.after[k] = (one + two) + (three + four)


@kernel(void(FLOW_TYPE))
def _round(m: Any) -> None:
    """Add a bound of the rounding of a step to the error, ε Σ |z_i now_ik|, with the signs that do most harm."""
    a = m.now
    x = m.z[X]
    y = m.z[Y]
    v_x = m.z[V_X]
    v_y = m.z[V_Y]
    belt = m.z[BELT]
    load = m.z[LOAD]
    for i in range(4):
        place = (abs(a[X, i] * x) + abs(a[Y, i] * y)) + (abs(a[V_X, i] * v_x) + abs(a[V_Y, i] * v_y))
        drive = abs(a[BELT, i] * belt) + abs(a[LOAD, i] * load)
        m.error[i] += math.copysign(ROUNDING * (place + drive), m.error[i])


@kernel(void(FLOW_TYPE))
def _carry(m: Any) -> None:
    """Move the error along a whole step, which has a rounding error of its own."""
    a = m.now
    x = m.error[X]
    y = m.error[Y]
    v_x = m.error[V_X]
    v_y = m.error[V_Y]
    for i in range(4):
        m.error[i] = (a[0, i] * x + a[1, i] * y) + (a[2, i] * v_x + a[3, i] * v_y)
    _round(m)


@kernel(int64(FLOW_TYPE, float64), inlined=False)
def whole(m: Any, h: float) -> int:
    """Take a whole step and return 1, unless a margin runs out in it or may do so.

    A margin that falls at first and rises at last is lowest inside, and not below where its tangents at both ends
    cross. It does not fall but by rounding where a shoe breaks loose: then it begins at zero, and without a slope.
    """
    _ahead(m)
    for k in range(4, 4 + MARGINS):
        fall = m.before[MARGINS + k]
        rise = m.after[MARGINS + k]
        if m.after[k] < 0.0 or (fall < -_FLAT * rise < 0.0 and fall * m.after[k] > rise * (m.before[k] + fall)):
            return 0
    pair = 0
    for i in range(SIZE):
        for j in range(i + 1):
            m.sums[pair] += m.z[i] * m.z[j]
            pair += 1
    m.waiting = 1
    for i in range(4):
        m.z[i] = m.after[i]
    _carry(m)
    m.z[BELT], m.z[LOAD] = m.z[BELT] + h * m.z[BELT_SLOPE], m.z[LOAD] + h * m.z[LOAD_SLOPE]
    for k in range(AHEAD):
        m.before[k] = m.after[k]
    return 1


@kernel(void(FLOW_TYPE, TANGENT_TYPE), inlined=False)
def disturb(m: Any, t: Any) -> None:
    """Move the disturbance along a whole step."""
    a = m.now
    x = t.x
    y = t.y
    v_x = t.v_x
    v_y = t.v_y
    t.x = (a[0, 0] * x + a[1, 0] * y) + (a[2, 0] * v_x + a[3, 0] * v_y)
    t.y = (a[0, 1] * x + a[1, 1] * y) + (a[2, 1] * v_x + a[3, 1] * v_y)
    t.v_x = (a[0, 2] * x + a[1, 2] * y) + (a[2, 2] * v_x + a[3, 2] * v_y)
    t.v_y = (a[0, 3] * x + a[1, 3] * y) + (a[2, 3] * v_x + a[3, 3] * v_y)


@kernel(_FOUR(FLOW_TYPE, float64, *_FOUR), inlined=False)
def _moved(m: Any, seconds: float, x: float, y: float, v_x: float, v_y: float) -> Four:
    """A disturbance after a part of a step in the present phase: Σ (A s)^k z/k!, s in seconds."""
    phase = m.phase
    moved_x = x
    moved_y = y
    moved_v_x = v_x
    moved_v_y = v_y
    for k in range(1, _ERROR_TERMS):
        a_x, a_y = acceleration(m, phase, x, y, v_x, v_y)
        part = seconds / k
        x = part * v_x
        y = part * v_y
        v_x = part * a_x
        v_y = part * a_y
        moved_x = moved_x + x
        moved_y = moved_y + y
        moved_v_x = moved_v_x + v_x
        moved_v_y = moved_v_y + v_y
    return moved_x, moved_y, moved_v_x, moved_v_y


@kernel(void(FLOW_TYPE, TANGENT_TYPE, float64), inlined=False)
def carry_part(m: Any, t: Any, seconds: float) -> None:
    """Carry the error, and a disturbance, along a part of a step, at whose end the motion is."""
    e = m.error
    e[X], e[Y], e[V_X], e[V_Y] = _moved(m, seconds, e[X], e[Y], e[V_X], e[V_Y])
    _round(m)
    if t.on == 1:
        t.x, t.y, t.v_x, t.v_y = _moved(m, seconds, t.x, t.y, t.v_x, t.v_y)


@kernel(void(COEFFICIENTS, FLOW_TYPE, TANGENT_TYPE), inlined=False)
def meet(c: Coefficients, m: Any, t: Any) -> None:
    """What becomes of the disturbance as the shoe comes to the velocity of the wheel: see `tangent.kept`."""
    needed = 0.0
    for i in range(SIZE):
        needed += m.needed[i] * m.z[i]
    t.v_x *= kept(needed, max(-c.phi * m.stiffness * m.z[Y], 0.0))


@kernel(void(FLOW_TYPE, TRACK_TYPE, float64, float64, float64), inlined=False)
def note_turn(m: Any, track: Any, t: float, span: float, v_before: float) -> None:
    """Note a turning point in the step over a span (s) that ends at time t (s), where the motion is.

    Chebyshev's iteration from the secant on, on the series from the end back: mostly the series is needed once.
    """
    a = m.generator
    z = m.z
    phase = m.phase
    kind = turned(track, m.z[V_X])
    if kind < 0:
        return
    back = -span * z[V_X] / (z[V_X] - v_before) if z[V_X] * v_before <= 0.0 else 0.0
    place = 0.0
    for _ in range(_CORRECTED):
        x = z[X]
        y = z[Y]
        v_x = z[V_X]
        v_y = z[V_Y]
        load = z[LOAD]
        belt_slope = z[BELT_SLOPE]
        velocity = v_x
        slope = 0.0
        bend = 0.0
        power = 1.0
        before = 0.0
        place = x
        for k in range(1, _ERROR_TERMS):
            a_x, a_y = acceleration(m, phase, x, y, v_x, v_y)
            a_x += a[phase, V_X, LOAD] * load + a[phase, V_X, BELT_SLOPE] * belt_slope
            a_y += a[phase, V_Y, LOAD] * load
            x = v_x
            y = v_y
            v_x = a_x
            v_y = a_y
            load = z[LOAD_SLOPE] if k == 1 else 0.0
            belt_slope = 0.0
            slope = slope + power * v_x
            bend = bend + before * v_x
            before = power
            power = power * (back / k)
            place = place + power * x
            velocity = velocity + power * v_x
        rest = -velocity / slope if abs(velocity) < span * abs(slope) else 0.0
        rest -= 0.5 * bend * rest * rest / slope if rest != 0.0 else 0.0
        rest = min(max(rest, -span - back), -back)
        place += (velocity + 0.5 * slope * rest) * rest
        back += rest
        if abs(rest) <= _NEAR * span:
            break
    put(track, kind, t + back, place)


@kernel(void(FLOW_TYPE), inlined=False)
def look(m: Any) -> None:
    """The matrix of the phase, the margins of the motion reached, and their slopes."""
    for i in range(SIZE):
        for k in range(AHEAD):
            m.now[i, k] = m.margins[m.phase, i, k]
    _ahead(m)
    for i in range(SIZE):
        for k in range(AHEAD):
            m.now[i, k] = m.step[m.phase, i, k]
    for k in range(AHEAD):
        m.before[k] = m.after[k]
