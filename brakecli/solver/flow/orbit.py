"""The limit cycle that a motion on smooth pads comes to, found before the motion has come to it.

Each fall of ẋ through 0 is a point s = (x, y, ẏ) of the section ẋ = 0, and the return map P leads from one to
the next. Newton's iteration s + (I - M)⁻¹ (P(s) - s) finds the point that returns to itself, and with it the
orbit.

M = dP/ds is the derivative of the flow over a period (`smooth`), less what it has along the velocity f of the
motion: with n along ẋ, the section takes away f (n·w) / (n·f). The eigenvalues of M are Floquet's multipliers. If
all lie within the unit circle, the orbit attracts its neighbours.
"""

import math
from typing import Any

import numba
from numba import float64, int64, types, void

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import kernel
from brakecli.solver.flow.smooth import DONE, MOST_EVENTS, MOST_STEPS, PATH_TYPE, flow, step, zero_of_velocity
from brakecli.solver.motions import BELT, FLOW_TYPE, PHASES, SIZE, TERMS, V_X, V_Y, X, Y
from brakecli.solver.records import COEFFICIENTS, record
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.schemes.piecewise_exact.locate import NO_EVENT
from brakecli.solver.schemes.piecewise_exact.steps import look
from brakecli.solver.schemes.piecewise_exact.switch import place

_REACH = 0.1  # of the size of a cycle: step of Newton's iteration beyond which it may lead elsewhere
_ROUNDS = 6
_CLOSED = 1e-11  # of the size of a cycle, by which an orbit may fail to close
_FOLLOWS = 0.25  # part by which a return to the orbit may differ from what the multipliers say
_UNSURE = 100.0  # times `_CLOSED`, by which returns may differ in any case
# Of the standard deviation of v_x. A whole run counts the rises through one of 0.3.
_BANDS: tuple[float, ...] = 0.25, 0.35
MOST_TURNS = 6  # falls in a cycle
_MANY = 1000  # more often no phase is entered in a cycle

PURSUIT = record(
    "duration",  # of the run, s
    "time",  # reached, s
    "period late",  # of the last cycle, or of the orbit, and by how much it has just been corrected, s
    "amplitude",  # half of peak to peak of x in it, m
    "low high",  # least and largest x since the last fall, or of the cycle, m
    "error",  # of the orbit, in sizes
    "away",  # of the last return from the orbit, in sizes
    "fastest",  # largest v_x of the orbit over the wheel's speed
    "mean_x mean_y square",  # integrals of x, y and v_x² over the orbit, m s and m²/s
    started=int,
    events=int,  # since the last fall
    falls=int,
    next_try=int,  # fall from which on an orbit is sought again
    way=int,  # how often each phase was entered since the last fall, as one number
    sliding=int,  # phase of steady sliding
    kept=(float, 3),  # the point of return
    saved=(float, SIZE),  # motion to go on with
    turns=int,  # falls in a cycle
    returns=(float, (MOST_TURNS + 1, 3)),  # the last points of the section, the latest first
    fell=(float, MOST_TURNS + 1),  # when, s
    lows=(float, MOST_TURNS),  # least x before each of them, m
    ways=(int, MOST_TURNS),  # the same before each
    beaten=(int, 2),  # rises of v_x from below a band to above it in the cycle, for a narrow band and a wide one
    side=(int, 2),  # 1 where v_x was below the band last
    point=(float, 3),  # of the orbit
    map=(float, (3, 3)),  # M
    by_point=(float, 3),  # derivative of the period by it
    spent=(float, PHASES),  # time of the cycle in each phase, s
    rest=(float, 4),  # steady sliding
    into=(float, (2, 4, 4)),  # from a motion beside it to the amplitudes of its modes, real and imaginary parts
    growth=(float, 4),  # of each mode, 1/s
    reach=(float, (4, 3)),  # of a mode of amplitude 1 in x, y (m) and v_x (m/s)
    bound=(float, 3),  # of the motion's distance from steady sliding in them
    room=(float, 2),  # of y and v_x until an event comes
)
"""A motion on its way to its orbit, and what is measured there."""
PURSUIT_TYPE = numba.from_dtype(PURSUIT)


@kernel(void(PATH_TYPE, PURSUIT_TYPE, int64))
def note_event(path: Any, o: Any, phase: int) -> None:
    """Note the phase that the last step has ended in."""
    if path.which != NO_EVENT:
        o.events = o.events + 1
        o.way = o.way + _MANY**phase


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE), inlined=False)
def _returned(c: Coefficients, m: Any, path: Any, o: Any) -> int:
    """From `point` over a period, and on to the section: the return in `kept`, and M; 0 where there is none.

    The rest of the way to the section, -ẋ/ẍ, is followed along the velocity. It vanishes as Newton's iteration
    closes the orbit, which is closed only when it has: M is that of the time flown.
    """
    m.z[X] = o.point[0]
    m.z[Y] = o.point[1]
    m.z[V_X] = 0.0
    m.z[V_Y] = o.point[2]
    if flow(c, m, path, o.period, 1) != DONE or path.velocity[V_X] >= 0.0:
        return 0
    rest = -m.z[V_X] / path.velocity[V_X]
    o.period = o.period + rest
    o.late = rest
    for row in range(3):
        i = row if row < 2 else V_Y
        o.kept[row] = m.z[i] + rest * path.velocity[i]
        for column in range(3):
            o.by_point[column] = -path.tangents[column if column < 2 else V_Y, V_X] / path.velocity[V_X]
            o.map[row, column] = (
                path.tangents[column if column < 2 else V_Y, i] + path.velocity[i] * o.by_point[column]
            )
    return 1


@kernel(void(FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE, float64, float64, int64), inlined=False)
def _add_up(m: Any, path: Any, o: Any, part: float, band: float, falls: int) -> None:
    """Add a part of the last step to the numbers of the cycle."""
    for k in range(TERMS):
        power = path.h * part ** (k + 1) / (k + 1)
        o.mean_x = o.mean_x + power * m.series[k, X]
        o.mean_y = o.mean_y + power * m.series[k, Y]
    o.fastest = max(o.fastest, m.z[V_X] / m.z[BELT])
    o.square += 0.5 * part * path.h * (path.begin[V_X] ** 2 + m.z[V_X] ** 2)
    for k in range(2):
        if abs(m.z[V_X]) > _BANDS[k] * band:
            below = 1 if m.z[V_X] < 0.0 else 0
            o.beaten[k] = o.beaten[k] + (1 if o.side[k] > below else 0)
            o.side[k] = below
    if falls == 1 or path.begin[V_X] < 0.0 <= m.z[V_X]:
        zero_of_velocity(m, path, 1.0 if falls == 1 else -1.0)
        o.low, o.high = min(o.low, m.at[X]), max(o.high, m.at[X])


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE), inlined=False)
def _around(c: Coefficients, m: Any, path: Any, o: Any) -> int:
    """From `point` over a period, for the numbers of the cycle; 0 where it takes another way than the motion did.

    Its falls are not counted: of a short rise and fall of ẋ within a step the motion may have seen nothing.
    """
    m.z[X] = o.point[0]
    m.z[Y] = o.point[1]
    m.z[V_X] = 0.0
    m.z[V_Y] = o.point[2]
    place(c, m, path.h)
    look(m)
    # band: of the round before
    band = math.sqrt(o.square / o.period)
    way = 0
    passed = 0.0
    last = False
    path.word[0] = m.phase
    path.events = 0
    for k in range(o.turns):
        way += o.ways[k]
    o.mean_x = 0.0
    o.mean_y = 0.0
    o.square = 0.0
    o.events = 0
    o.way = 0
    o.low = o.point[0]
    o.high = o.point[0]
    o.fastest = 0.0
    for k in range(2):
        o.beaten[k] = 0
        o.side[k] = 0
    for k in range(PHASES):
        o.spent[k] = 0.0
    for _ in range(MOST_STEPS):
        step(c, m, path, 1)
        falls = 1 if path.begin[V_X] > 0.0 >= m.z[V_X] else 0
        part = path.part
        last = passed + part * path.h >= o.period * (1.0 - _CLOSED)
        if last:
            part = (o.period - passed) / path.h
        passed = passed + part * path.h
        o.spent[path.old] = o.spent[path.old] + part * path.h
        _add_up(m, path, o, part, band, falls)
        if last:
            break
        note_event(path, o, m.phase)
        if o.events > MOST_EVENTS:
            return 0
        if o.events > path.events:
            path.times[path.events] = passed
            path.events = o.events
            path.word[path.events] = m.phase
    o.amplitude = 0.5 * (o.high - o.low)
    return 1 if last and o.way == way else 0


@kernel(float64(PURSUIT_TYPE, float64, float64, float64))
def sizes(o: Any, x: float, y: float, v_y: float) -> float:
    """A distance on the section over the amplitude of the cycle: the largest of |x|, |y| and |v_y| T/2π."""
    return max(abs(x), abs(y), abs(v_y) * o.period / TWO_PI) / o.amplitude  # type: ignore[no-any-return]


@kernel(types.UniTuple(float64, 3)(PURSUIT_TYPE, float64, float64, float64), inlined=False)
def _solved(o: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """(I - M)⁻¹ of a vector, by Cramer's rule; far away where there is none."""
    a = 1.0 - o.map[0, 0]
    b = -o.map[0, 1]
    c = -o.map[0, 2]
    d = -o.map[1, 0]
    e = 1.0 - o.map[1, 1]
    f = -o.map[1, 2]
    g = -o.map[2, 0]
    h = -o.map[2, 1]
    i = 1.0 - o.map[2, 2]
    whole = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if whole == 0.0:
        return 1e300, 1e300, 1e300
    one = x * (e * i - f * h) - b * (y * i - f * z) + c * (y * h - e * z)
    two = a * (y * i - f * z) - x * (d * i - f * g) + c * (d * z - y * g)
    three = a * (e * z - y * h) - b * (d * z - y * g) + x * (d * h - e * g)
    return one / whole, two / whole, three / whole


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE), inlined=False)
def closed(c: Coefficients, m: Any, path: Any, o: Any) -> int:
    """Find the orbit of `turns` falls near the last return; 0 where none is found that the motion comes to.

    By Newton's method: the point moves by (I - M)⁻¹ (return - point).
    """
    s = o.returns
    at = o.point
    k = o.turns
    for i in range(3):
        at[i] = s[0, i]
    for _ in range(_ROUNDS):
        if _returned(c, m, path, o) == 0:
            return 0
        x, y, v_y = _solved(o, o.kept[0] - o.point[0], o.kept[1] - o.point[1], o.kept[2] - o.point[2])
        o.error = max(sizes(o, x, y, v_y), TWO_PI * abs(o.late) / o.period)
        if not o.error < _REACH:
            return 0
        if o.error < _CLOSED:
            break
        o.point[0], o.point[1], o.point[2] = o.point[0] + x, o.point[1] + y, o.point[2] + v_y
        o.period += o.by_point[0] * x + o.by_point[1] * y + o.by_point[2] * v_y
    if o.error >= _CLOSED:
        return 0
    for i in range(3):  # does the last return follow from the one before it as M says?
        o.kept[i] = s[0, i] - at[i]
        for j in range(3):
            o.kept[i] -= o.map[i, j] * (s[k, j] - at[j])
    was = sizes(o, s[k, 0] - at[0], s[k, 1] - at[1], s[k, 2] - at[2])
    o.away = sizes(o, s[0, 0] - at[0], s[0, 1] - at[1], s[0, 2] - at[2])
    if not (sizes(o, o.kept[0], o.kept[1], o.kept[2]) <= _FOLLOWS * was + _UNSURE * _CLOSED and was < _REACH):
        return 0
    return _around(c, m, path, o) * _around(c, m, path, o)
