"""The limit cycle that a motion on smooth pads comes to, found before the motion has come to it.

Each fall of ẋ through 0 is a point s = (x, y, ẏ) of the section ẋ = 0, and the return map P leads from one to
the next. Newton's iteration s + (I - M)⁻¹ (P(s) - s) finds the point that returns to itself, and with it the
orbit.

M = dP/ds is a product of known matrices. Within a phase a small disturbance w follows the same linear equation
as the motion: w(t) = exp(A t) w(0). The disturbed motion comes to an event n·z = 0 later, by -n·w / n·f, where
f = A z is the velocity of the motion as it arrives. For that time it goes on with f and not with f', the
velocity behind the event:

    w' = (I + (f' - f) nᵀ / (nᵀ f)) w,

the saltation matrix (R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
Springer 2004, ch. 7). Where stick begins it takes away what w has along ẋ. Where stick ends, and where contact
is lost or made, no force jumps: f' = f, and it is the identity. The end on the section takes away f (n·w) /
(n·f), with n along ẋ. The eigenvalues of M are Floquet's multipliers. If all lie within the unit circle, the
orbit attracts its neighbours.
"""

import math
from typing import Any

import numba
from numba import float64, int64, types, void

from brakecli.solver.automaton import OPEN
from brakecli.solver.compile import kernel
from brakecli.solver.records import (
    BELT,
    COEFFICIENTS,
    FLOW_TYPE,
    PHASES,
    SIZE,
    TERMS,
    V_X,
    V_Y,
    Coefficients,
    X,
    Y,
    record,
)
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.schemes.piecewise_exact import look, phases, whole
from brakecli.solver.schemes.piecewise_exact.locate import NO_EVENT, first_event, root
from brakecli.solver.schemes.piecewise_exact.switch import place, switch

_REACH = 0.1  # of the size of a cycle: step of Newton's iteration beyond which it may lead elsewhere
_ROUNDS = 6
_CLOSED = 1e-11  # of the size of a cycle, by which an orbit may fail to close
_FOLLOWS = 0.25  # part by which a return to the orbit may differ from what the multipliers say
MOST_STEPS = 100_000  # in a call: Python hears signals in between
MOST_EVENTS = 60  # in a cycle
_BANDS = (0.25, 0.35)  # of the standard deviation of v_x: a whole run counts the rises through one of 0.3
MOST_TURNS = 6  # falls in a cycle
_PRIME = 1_000_003

ORBIT = record(
    "h",  # step, s
    "duration",  # of the run, s
    "time",  # reached, s
    "part",  # of the last step that was taken, up to its event
    "period",  # of the last cycle, or of the orbit, s
    "amplitude",  # half of peak to peak of x in it, m
    "low high",  # least and largest x since the last fall, or of the cycle, m
    "error",  # of the orbit, in sizes
    "away",  # of the last return from the orbit, in sizes
    "fastest",  # largest v_x of the orbit over the wheel's speed
    "mean_x mean_y square",  # integrals of x, y and v_x² over the orbit, m s and m²/s
    which=int,  # event at the end of the last step
    old=int,  # phase of that step
    started=int,
    steps=int,
    evaluations=int,  # of the contact: steps in which the shoe touches
    events=int,  # since the last fall
    falls=int,
    next_try=int,  # fall from which on an orbit is sought again
    way=int,  # phases entered since the last fall
    sliding=int,  # phase of steady sliding
    begin=(float, SIZE),  # motion at the begin of the last step
    kept=(float, SIZE),  # a place on the way round the cycle
    saved=(float, SIZE),  # motion to go on with
    turns=int,  # falls in a cycle
    returns=(float, (MOST_TURNS + 1, 3)),  # the last points of the section, the latest first
    fell=(float, MOST_TURNS + 1),  # when, s
    lows=(float, MOST_TURNS),  # least x before each of them, m
    ways=(int, MOST_TURNS),  # phases entered before each, as numbers that other ways hardly share
    strange=int,  # ways of the cycle that the motion has not taken
    beaten=(int, 2),  # rises of v_x from below a band to above it in the cycle, for a narrow band and a wide one
    side=(int, 2),  # 1 where v_x was below the band last
    point=(float, 3),  # of the orbit
    tangents=(float, (3, 4)),  # small disturbances of x, y and v_y on the way round the cycle
    map=(float, (3, 3)),  # M
    spent=(float, PHASES),  # time of the cycle in each phase, s
    rest=(float, 4),  # steady sliding
    into=(float, (2, 4, 4)),  # from a motion beside it to the amplitudes of its modes, real and imaginary parts
    growth=(float, 4),  # of each mode, 1/s
    reach=(float, (4, 3)),  # of a mode of amplitude 1 in x, y (m) and v_x (m/s)
    bound=(float, 3),  # of the motion's distance from steady sliding in them
    room=(float, 2),  # of y and v_x until an event comes
)
"""A motion on its way to its orbit, and the orbit."""
ORBIT_TYPE = numba.from_dtype(ORBIT)


@kernel(void(FLOW_TYPE, ORBIT_TYPE))
def _expand(m: Any, o: Any) -> None:
    """The series of the last step."""
    for i in range(SIZE):
        m.series[0, i] = o.begin[i]
    phases.expand(m, o.old, o.h)


@kernel(void(COEFFICIENTS, FLOW_TYPE, ORBIT_TYPE, int64), inlined=False)
def step(c: Coefficients, m: Any, o: Any, closely: int) -> None:
    """Move to the end of a step, or through the event in it; `closely` follows the series in any case."""
    for i in range(SIZE):
        o.begin[i] = m.z[i]
    o.old, o.part, o.which = m.phase, 1.0, NO_EVENT
    o.steps += 1
    o.evaluations += 1 if m.phase != OPEN else 0
    if closely == 1 or whole(m, o.h) == 0:
        _expand(m, o)
        o.which, o.part = first_event(m)
        phases.reach(m, o.part)
        for i in range(SIZE):
            m.z[i] = m.at[i]
        if o.which != NO_EVENT:
            switch(c, m, o.which, o.h)
        look(m)


@kernel(float64(FLOW_TYPE, ORBIT_TYPE, float64), inlined=False)
def zero_of_velocity(m: Any, o: Any, sign: float) -> float:
    """The part of the last step at which v_x falls through zero, or rises where the sign is -1; goes there."""
    _expand(m, o)
    for k in range(TERMS):
        m.polynomial[0, k] = sign * m.series[k, V_X]
    part = root(m, 0, 0.0, o.part)
    phases.reach(m, part)
    return part


@kernel(void(ORBIT_TYPE, int64))
def note_event(o: Any, phase: int) -> None:
    """Note the phase that the last step has ended in."""
    if o.which != NO_EVENT:
        o.events, o.way = o.events + 1, (o.way * 5 + phase + 1) % _PRIME


@kernel(void(FLOW_TYPE, ORBIT_TYPE, float64), inlined=False)
def _carry(m: Any, o: Any, part: float) -> None:
    """Move the disturbances along a part of the last step."""
    whole_step = part == 1.0
    for j in range(3):
        if whole_step:
            for i in range(4):
                m.at[i] = 0.0
                for k in range(4):
                    m.at[i] += m.step[o.old, k, i] * o.tangents[j, k]
        else:
            for i in range(SIZE):
                m.series[0, i] = o.tangents[j, i] if i < 4 else 0.0
            phases.expand(m, o.old, o.h)
            phases.reach(m, part)
        for i in range(4):
            o.tangents[j, i] = m.at[i]


@kernel(float64(FLOW_TYPE, ORBIT_TYPE, int64, int64))
def _velocity(m: Any, o: Any, phase: int, i: int) -> float:
    """A component of the velocity A z of a phase at the place `o.kept`."""
    total = 0.0
    for k in range(SIZE):
        total += m.generator[phase, i, k] * o.kept[k]
    return total


@kernel(int64(FLOW_TYPE, ORBIT_TYPE, int64), inlined=False)
def _jump(m: Any, o: Any, section: int) -> int:
    """Take the disturbances through an event, or onto the section, at `o.kept`; 0 where it is only grazed."""
    rate = 0.0
    for i in range(4):
        normal = (1.0 if i == V_X else 0.0) if section == 1 else m.margins[o.old, i, 4 + o.which]
        rate += normal * _velocity(m, o, o.old, i)
    if rate >= 0.0:
        return 0
    for j in range(3):
        late = 0.0
        for i in range(4):
            normal = (1.0 if i == V_X else 0.0) if section == 1 else m.margins[o.old, i, 4 + o.which]
            late += normal * o.tangents[j, i] / rate
        for i in range(4):
            leaves = 0.0 if section == 1 else _velocity(m, o, m.phase, i)
            o.tangents[j, i] += (leaves - _velocity(m, o, o.old, i)) * late
    return 1


@kernel(void(FLOW_TYPE, ORBIT_TYPE, float64, float64, int64), inlined=False)
def _add_up(m: Any, o: Any, part: float, band: float, falls: int) -> None:
    """Add a part of the last step to the numbers of the cycle."""
    for k in range(TERMS):
        power = o.h * part ** (k + 1) / (k + 1)
        o.mean_x, o.mean_y = o.mean_x + power * m.series[k, X], o.mean_y + power * m.series[k, Y]
    o.fastest = max(o.fastest, m.z[V_X] / m.z[BELT])
    o.square += 0.5 * part * o.h * (o.begin[V_X] ** 2 + m.z[V_X] ** 2)
    for k in range(2):
        if abs(m.z[V_X]) > _BANDS[k] * band:
            below = 1 if m.z[V_X] < 0.0 else 0
            o.beaten[k], o.side[k] = o.beaten[k] + (1 if o.side[k] > below else 0), below
    if falls == 1 or o.begin[V_X] < 0.0 <= m.z[V_X]:
        zero_of_velocity(m, o, 1.0 if falls == 1 else -1.0)
        o.low, o.high = min(o.low, m.at[X]), max(o.high, m.at[X])


@kernel(int64(COEFFICIENTS, FLOW_TYPE, ORBIT_TYPE, int64), inlined=False)
def _around(c: Coefficients, m: Any, o: Any, closely: int) -> int:
    """From `point` once round, with M or, `closely`, with the numbers of the cycle; 0 where it does not close.

    It ends with the point of return in `kept`.
    """
    for j in range(3):
        for i in range(4):
            o.tangents[j, i] = 1.0 if i == (j if j < 2 else V_Y) else 0.0
    m.z[X], m.z[Y], m.z[V_X], m.z[V_Y] = o.point[0], o.point[1], 0.0, o.point[2]
    place(c, m, o.h)
    look(m)
    band, turns = math.sqrt(o.square / o.period), 0  # of the round before
    o.period, o.mean_x, o.mean_y, o.square, o.events, o.way, o.strange = 0.0, 0.0, 0.0, 0.0, 0, 0, 0
    o.low, o.high, o.fastest = o.point[0], o.point[0], 0.0
    for k in range(2):
        o.beaten[k], o.side[k] = 0, 0
    for k in range(PHASES):
        o.spent[k] = 0.0
    for _ in range(MOST_STEPS):
        step(c, m, o, closely)
        falls, part = 1 if o.begin[V_X] > 0.0 >= m.z[V_X] else 0, o.part
        turns += falls
        last = falls == 1 and turns == o.turns
        if last:
            part = zero_of_velocity(m, o, 1.0)
        for i in range(SIZE):
            o.kept[i] = m.at[i] if last else m.z[i]
        o.period, o.spent[o.old] = o.period + part * o.h, o.spent[o.old] + part * o.h
        if closely == 1:
            _add_up(m, o, part, band, falls)
        else:
            _carry(m, o, part)
            if (last or o.which != NO_EVENT) and _jump(m, o, int(last)) == 0:
                return 0
        if falls == 1:
            o.strange += 1 if o.way != o.ways[o.turns - turns] else 0
            o.way = 0
        if last:
            break
        note_event(o, m.phase)
        if o.events > MOST_EVENTS:
            return 0
    if closely == 1:
        o.amplitude = 0.5 * (o.high - o.low)
    for j in range(3 if closely == 0 else 0):
        o.map[0, j], o.map[1, j], o.map[2, j] = o.tangents[j, X], o.tangents[j, Y], o.tangents[j, V_Y]
    return 1 if turns == o.turns else 0


@kernel(float64(ORBIT_TYPE, float64, float64, float64))
def sizes(o: Any, x: float, y: float, v_y: float) -> float:
    """A distance on the section, in sizes of the cycle."""
    return max(abs(x), abs(y), abs(v_y) * o.period / TWO_PI) / o.amplitude  # type: ignore[no-any-return]


@kernel(types.UniTuple(float64, 3)(ORBIT_TYPE, float64, float64, float64), inlined=False)
def _solved(o: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """(I - M)⁻¹ of a vector, by Cramer's rule; far away where there is none."""
    a, b, c = 1.0 - o.map[0, 0], -o.map[0, 1], -o.map[0, 2]
    d, e, f = -o.map[1, 0], 1.0 - o.map[1, 1], -o.map[1, 2]
    g, h, i = -o.map[2, 0], -o.map[2, 1], 1.0 - o.map[2, 2]
    whole = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if whole == 0.0:
        return 1e300, 1e300, 1e300
    one = x * (e * i - f * h) - b * (y * i - f * z) + c * (y * h - e * z)
    two = a * (y * i - f * z) - x * (d * i - f * g) + c * (d * z - y * g)
    three = a * (e * z - y * h) - b * (d * z - y * g) + x * (d * h - e * g)
    return one / whole, two / whole, three / whole


@kernel(int64(COEFFICIENTS, FLOW_TYPE, ORBIT_TYPE), inlined=False)
def closed(c: Coefficients, m: Any, o: Any) -> int:
    """Find the orbit of `turns` falls near the last return; 0 where none is found that the motion comes to."""
    s, at, k = o.returns, o.point, o.turns
    for i in range(3):
        at[i] = s[0, i]
    for _ in range(_ROUNDS):
        if _around(c, m, o, 0) == 0:
            return 0
        x, y, v_y = _solved(o, o.kept[X] - o.point[0], o.kept[Y] - o.point[1], o.kept[V_Y] - o.point[2])
        o.error = sizes(o, x, y, v_y)
        if not o.error < _REACH:
            return 0
        if o.error < _CLOSED:
            break
        o.point[0], o.point[1], o.point[2] = o.point[0] + x, o.point[1] + y, o.point[2] + v_y
    if o.error >= _CLOSED or o.strange > 0:
        return 0
    for i in range(3):  # does the last return follow from the one before it as M says?
        o.kept[i] = s[0, i] - at[i]
        for j in range(3):
            o.kept[i] -= o.map[i, j] * (s[k, j] - at[j])
    was = sizes(o, s[k, 0] - at[0], s[k, 1] - at[1], s[k, 2] - at[2])
    o.away = sizes(o, s[0, 0] - at[0], s[0, 1] - at[1], s[0, 2] - at[2])
    if not (sizes(o, o.kept[0], o.kept[1], o.kept[2]) <= _FOLLOWS * was + 100.0 * _CLOSED and was < _REACH):
        return 0
    return _around(c, m, o, 1) * _around(c, m, o, 1)
