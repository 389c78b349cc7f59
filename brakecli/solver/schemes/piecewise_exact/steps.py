"""A whole step as a matrix, and what goes along with it: the error of the motion, a disturbance, its turns."""

import math
from typing import Any

from numba import float64, int64, types, void

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
from brakecli.solver.records import COEFFICIENTS, TANGENT_TYPE, TRACK_TYPE, Coefficients
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
    a, z = m.now, m.z
    z_0, z_1, z_2, z_3, z_4, z_5, z_6, z_7 = z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7]
    for k in range(AHEAD):
        one, two = a[0, k] * z_0 + a[1, k] * z_1, a[2, k] * z_2 + a[3, k] * z_3
        three, four = a[4, k] * z_4 + a[5, k] * z_5, a[6, k] * z_6 + a[7, k] * z_7
        m.after[k] = (one + two) + (three + four)


@kernel(void(FLOW_TYPE))
def _round(m: Any) -> None:
    """Add a bound of the rounding of a step to the error, ε Σ |z_i now_ik|, with the signs that do most harm."""
    a, x, y, v_x, v_y, belt, load = m.now, m.z[X], m.z[Y], m.z[V_X], m.z[V_Y], m.z[BELT], m.z[LOAD]
    for i in range(4):
        place = (abs(a[X, i] * x) + abs(a[Y, i] * y)) + (abs(a[V_X, i] * v_x) + abs(a[V_Y, i] * v_y))
        drive = abs(a[BELT, i] * belt) + abs(a[LOAD, i] * load)
        m.error[i] += math.copysign(ROUNDING * (place + drive), m.error[i])


@kernel(void(FLOW_TYPE))
def _carry(m: Any) -> None:
    """Move the error along a whole step, which has a rounding error of its own."""
    a, x, y, v_x, v_y = m.now, m.error[X], m.error[Y], m.error[V_X], m.error[V_Y]
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
        fall, rise = m.before[MARGINS + k], m.after[MARGINS + k]
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
    a, x, y, v_x, v_y = m.now, t.x, t.y, t.v_x, t.v_y
    t.x = (a[0, 0] * x + a[1, 0] * y) + (a[2, 0] * v_x + a[3, 0] * v_y)
    t.y = (a[0, 1] * x + a[1, 1] * y) + (a[2, 1] * v_x + a[3, 1] * v_y)
    t.v_x = (a[0, 2] * x + a[1, 2] * y) + (a[2, 2] * v_x + a[3, 2] * v_y)
    t.v_y = (a[0, 3] * x + a[1, 3] * y) + (a[2, 3] * v_x + a[3, 3] * v_y)


@kernel(_FOUR(FLOW_TYPE, float64, *_FOUR), inlined=False)
def _moved(m: Any, seconds: float, x: float, y: float, v_x: float, v_y: float) -> Four:
    """A disturbance after a part of a step in the present phase: Σ (A s)^k z/k!, s in seconds."""
    phase, moved_x, moved_y, moved_v_x, moved_v_y = m.phase, x, y, v_x, v_y
    for k in range(1, _ERROR_TERMS):
        a_x, a_y = acceleration(m, phase, x, y, v_x, v_y)
        part = seconds / k
        x, y, v_x, v_y = part * v_x, part * v_y, part * a_x, part * a_y
        moved_x, moved_y, moved_v_x, moved_v_y = moved_x + x, moved_y + y, moved_v_x + v_x, moved_v_y + v_y
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
    a, z, phase, kind = m.generator, m.z, m.phase, turned(track, m.z[V_X])
    if kind < 0:
        return
    back = -span * z[V_X] / (z[V_X] - v_before) if z[V_X] * v_before <= 0.0 else 0.0
    place = 0.0
    for _ in range(_CORRECTED):
        x, y, v_x, v_y, load, belt_slope = z[X], z[Y], z[V_X], z[V_Y], z[LOAD], z[BELT_SLOPE]
        velocity, slope, bend, power, before = v_x, 0.0, 0.0, 1.0, 0.0
        place = x
        for k in range(1, _ERROR_TERMS):
            a_x, a_y = acceleration(m, phase, x, y, v_x, v_y)
            a_x += a[phase, V_X, LOAD] * load + a[phase, V_X, BELT_SLOPE] * belt_slope
            a_y += a[phase, V_Y, LOAD] * load
            x, y, v_x, v_y = v_x, v_y, a_x, a_y
            load, belt_slope = z[LOAD_SLOPE] if k == 1 else 0.0, 0.0
            slope, bend = slope + power * v_x, bend + before * v_x
            before, power = power, power * (back / k)
            place, velocity = place + power * x, velocity + power * v_x
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
