"""A span on rough pads: steps, the events that divide them, and the derivative across these."""

import math
from typing import Any

from numba import float64, int64, types, void

from brakecli.solver.automaton import PULL, STICK, UNDECIDED, following, sliding_phase
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import Floats, from_memory, into_memory, kernel, stopped, vector
from brakecli.solver.flow.rough.contact import press
from brakecli.solver.flow.rough.record import COLUMNS, MOST_EVENTS, ROUGH_TYPE, Status
from brakecli.solver.flow.rough.step import find_margins, look, rounding, step, take_hold
from brakecli.solver.motions import V_X, V_Y, X, Y
from brakecli.solver.records import COEFFICIENTS, Parts

BOUND = 1e100  # of a state, beyond which the motion has run away
LANDING = 16  # parts of a step in which the whole pad lands or lifts off: the force has a kink there
_ROUNDED = 1e-9  # of a step, that may be left of it by rounding
_SEEKS = 60  # steps of the search for an event
_ABOVE = 0.75  # of a part at which a margin is negative, the middle of a bracket from its half on
# of the rounding of a margin, and of a step: ends of that search
_CERTAIN = 0.01
_NARROWEST = 1e-16
_STRETCHED = 1.5  # times the longest part, up to which the last one is stretched: none is shorter than half of it
_SIGNALS = 1023  # steps between two looks at signals, plus one a power of two
_NONE = -1
_DONE, _TOO_MANY_EVENTS, _NOT_FINITE, _GRAZED, _STOPPED = (int(status) for status in Status)


@kernel(types.UniTuple(float64, 2)(float64, float64, float64, float64, float64))
def _lowest(begin: float, rate: float, end: float, end_rate: float, h: float) -> tuple[float, float]:
    """Part of a step at which the cubic through values and rates is lowest inside it, and its value there.

    The cubic is m_0 + b p + (3d - 2b - e) p² + (b + e - 2d) p³ with the change d and both rates b and e, times h.
    The part is -1 where it does not fall at the begin and rise at the end.
    """
    if not (rate < 0.0 < end_rate):
        return -1.0, end
    b = h * rate
    e = h * end_rate
    d = end - begin
    cubic = b + e - 2.0 * d
    square = 3.0 * d - 2.0 * b - e
    root = math.sqrt(max(square * square - 3.0 * cubic * b, 0.0))  # where 3 cubic p² + 2 square p + b = 0
    part = -b / (square + root) if square + root > 0.0 else 0.5
    part = min(max(part, 0.0), 1.0)
    return part, begin + part * (b + part * (square + part * cubic))


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, vector, float64, int64), inlined=False)
def _margin_at(c: Coefficients, f: Any, tables: Floats, h: float, which: int) -> float:
    """A margin after a step h that is tried."""
    step(c, f, tables, h, 0)
    look(c, f, tables, 0)
    return f.end_margin[which]  # type: ignore[no-any-return]


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, vector, float64, float64, int64), inlined=False)
def _located(c: Coefficients, f: Any, tables: Floats, h: float, high: float, which: int) -> float:
    """The part of the step h at which a margin is zero; at its part `high` it is negative.

    Newton's method, kept inside a bracket. A phase begins where its margin is zero: it must have risen before.
    """
    low = 0.0
    noise = rounding(c, f)
    begin = f.margin[which]
    if begin > noise:
        part = high * begin / (begin - _margin_at(c, f, tables, high * h, which))
    else:
        for _ in range(_SEEKS):
            part = 0.5 * high
            if _margin_at(c, f, tables, part * h, which) > 0.0:
                low = part
                part = _ABOVE * high
                break
            high = part
        if low == 0.0:
            return 0.0
    for _ in range(_SEEKS):
        value = _margin_at(c, f, tables, part * h, which)
        if value > 0.0:
            low = part
        else:
            high = part
        if abs(value) <= _CERTAIN * noise or high - low <= _NARROWEST:
            break
        slope = h * f.end_margin_rate[which]
        rest = -value / slope if slope < 0.0 else 2.0
        if not low < part + rest < high:
            rest = 0.5 * (low + high) - part
        if part + rest == part:
            break
        part += rest
    return part  # type: ignore[no-any-return]


@kernel(types.UniTuple(float64, 2)(COEFFICIENTS, ROUGH_TYPE, vector, float64), inlined=False)
def _first_crossing(c: Coefficients, f: Any, tables: Floats, h: float) -> tuple[float, float]:
    """The margin that ends the phase within the step, -1 for none, and the part of the step until then.

    Notes how near margins come to zero.
    """
    noise = rounding(c, f)
    dips = 0
    which = _NONE
    high = 1.0
    first = 2.0
    for i in range(2 if f.phase == STICK else 1):
        if f.end_margin[i] < -noise:
            fall = f.margin[i] - f.end_margin[i]
            part = f.margin[i] / fall if fall > 0.0 else 0.0
            if part < first:
                which = i
                first = part
    if which == _NONE:
        for i in range(2 if f.phase == STICK else 1):
            part, value = _lowest(f.margin[i], f.margin_rate[i], f.end_margin[i], f.end_margin_rate[i], h)
            if part >= 0.0 and value < -noise:
                dips = 1
                if _margin_at(c, f, tables, part * h, i) < -noise:
                    which = i
                    high = part
                    break
            if part >= 0.0 and f.margin[i] > noise:  # not at the event that the phase begins with
                if f.phase != STICK:
                    f.least_slide = min(f.least_slide, max(value, 0.0))
                else:
                    f.least_hold = min(f.least_hold, max(value, 0.0))
    if which == _NONE:
        if dips != 0:
            step(c, f, tables, h, f.tangents)  # as it was before the dip was tried
            look(c, f, tables, f.tangents)
        return -1.0, 1.0
    return float(which), _located(c, f, tables, h, high, which)


@kernel(void(ROUGH_TYPE, float64))
def _note(f: Any, h: float) -> None:
    """Note extremes and shares of the step that was taken; its end is `end`, with its rates."""
    least = -_lowest(-f.z[X], -f.z[V_X], -f.end[X], -f.end[V_X], h)[1]
    x = f.end[X]
    f.most_x = max(f.most_x, x, least)
    f.least_x = min(f.least_x, x, _lowest(f.z[X], f.z[V_X], x, f.end[V_X], h)[1])
    least = -_lowest(-f.z[Y], -f.z[V_Y], -f.end[Y], -f.end[V_Y], h)[1]
    y = f.end[Y]
    f.most_y = max(f.most_y, y, least)
    f.least_y = min(f.least_y, y, _lowest(f.z[Y], f.z[V_Y], y, f.end[V_Y], h)[1])
    f.stuck += h if f.phase == STICK else 0.0
    f.open += 0.5 * h * ((1.0 if f.before_touching == 0.0 else 0.0) + (1.0 if f.touching == 0.0 else 0.0))
    part = f.touching / f.stiffness
    f.least_contact, f.most_contact = min(f.least_contact, part), max(f.most_contact, part)


@kernel(void(ROUGH_TYPE))
def _advance(f: Any) -> None:
    """Make the end of the step the begin of the next one."""
    for i in range(4):
        f.z[i] = f.end[i]
    for i in range(2):
        f.margin[i], f.margin_rate[i] = f.end_margin[i], f.end_margin_rate[i]
    f.before_force = f.force
    f.before_slope = f.slope
    f.before_touching = f.touching
    if f.tangents != 0:
        for i in range(4):
            for j in range(COLUMNS):
                f.t[i, j] = f.t_end[i, j]


@kernel(float64(COEFFICIENTS, ROUGH_TYPE, float64, float64, float64, float64, float64))
def _change(c: Coefficients, f: Any, x: float, y: float, v_x: float, v_y: float, late: float) -> float:
    """The change of the margin that ends the phase, for small changes of the state and of the time.

    In slip side δẋ; in stick φ (∂F_y/∂x (δx - U δt) + ∂F_y/∂y δy) less or plus δ needed.
    """
    if f.phase != STICK:
        return (f.phase - STICK) * v_x  # type: ignore[no-any-return]
    needed = c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y
    cone = c.phi * (f.slope * (x - f.belt * late) - f.touching * y)
    return cone - needed if f.which == 0 else cone + needed  # type: ignore[no-any-return]


@kernel(int64(COEFFICIENTS, ROUGH_TYPE, vector, float64), inlined=False)
def _carry_to_event(c: Coefficients, f: Any, tables: Floats, h: float) -> int:
    """Step to an event, with the derivatives of the state and of the time there; 0 where it only grazes.

    The length p of the step changes by dp = -dm/(∂m/∂p), and the state by dz + ∂z/∂p dp.
    """
    t = f.t_end
    kept = f.t_kept
    late = f.late_kept
    for j in range(COLUMNS):
        f.stretch[j] = 0.0
    step(c, f, tables, h, 1)
    for j in range(COLUMNS):
        late[j] = f.late[j]
        f.late[j] = 0.0
        f.stretch[j] = 1.0
        for i in range(4):
            kept[i, j] = t[i, j]
            f.t[i, j] = 0.0
    step(c, f, tables, h, 1)  # each column is now the derivative by the length of the step
    look(c, f, tables, 1)
    rate = _change(c, f, t[X, 0], t[Y, 0], t[V_X, 0], t[V_Y, 0], 1.0)
    if not rate < 0.0:
        return 0
    for j in range(COLUMNS):
        longer = -_change(c, f, kept[X, j], kept[Y, j], kept[V_X, j], kept[V_Y, j], late[j]) / rate
        f.late[j] = late[j] + longer
        for i in range(4):
            t[i, j] = kept[i, j] + longer * t[i, j]
    return 1


@kernel(void(ROUGH_TYPE))
def _note_border(f: Any) -> None:
    """Note the margins at `end`, where the span begins or ends."""
    if f.phase != STICK:
        f.least_slide = min(f.least_slide, max(f.end_margin[0], 0.0))
    else:
        f.least_hold = min(f.least_hold, max(min(f.end_margin[0], f.end_margin[1]), 0.0))


@kernel(void(COEFFICIENTS, ROUGH_TYPE, vector), inlined=False)
def _begin(c: Coefficients, f: Any, tables: Floats) -> None:
    """Prepare for the state `z`."""
    f.since = 0.0
    f.length = 0.0
    f.place = math.nan
    f.known = 0
    f.events = 0
    f.anchor = 0.0
    f.open = 0.0
    f.stuck = 0.0
    f.least_contact = math.inf
    f.most_contact = -math.inf
    f.least_slide = f.least_hold = f.least_pass = math.inf
    for i in range(4):
        f.end[i] = f.z[i]
        for j in range(COLUMNS):
            f.t_end[i, j] = 1.0 if i == j else 0.0
    f.least_x = f.z[X]
    f.most_x = f.z[X]
    f.least_y = f.z[Y]
    f.most_y = f.z[Y]
    press(f, tables, f.z[X], f.z[Y], f.tangents)
    f.phase = sliding_phase(f.z[V_X] - f.belt)
    if f.phase == UNDECIDED:
        take_hold(c, f)
    f.least_pass = math.inf
    find_margins(c, f)
    f.word[0] = f.phase
    part = f.touching / f.stiffness
    f.least_contact = f.most_contact = part
    _note_border(f)
    _advance(f)


@kernel(float64(ROUGH_TYPE, float64, float64))
def _next_part(f: Any, end: float, longest: float) -> float:
    """The length of the next part of a step until some time. The last one ends there, however late it begins."""
    left = max(end - f.since, 0.0)
    last = left <= _STRETCHED * longest
    for j in range(COLUMNS):
        f.stretch[j] = -f.late[j] if last else 0.0
    return left if last else longest


_PARTS = types.NamedTuple([COEFFICIENTS, ROUGH_TYPE, vector], Parts)
hold = into_memory(_PARTS)
_parts_at = from_memory(_PARTS)


@kernel(int64(int64, float64, int64))
def fly(address: int, h: float, steps: int) -> int:
    """Take so many steps h (s) from the state `z`; a `Status`. The end is `end`, its derivatives `t_end`."""
    p: Parts = _parts_at(address)
    c = p.c
    f = p.f
    tables = p.tables
    _begin(c, f, tables)
    for n in range(steps):
        f.since = n * h
        left = h
        longest = h
        for j in range(COLUMNS):
            f.late[j] = f.stretch[j] = 0.0
        while True:
            step(c, f, tables, left, f.tangents)
            look(c, f, tables, f.tangents)
            if longest == h and (f.before_touching == 0.0) != (f.touching == 0.0):
                longest = h / LANDING
                left = _next_part(f, (n + 1) * h, longest)
                continue
            if not abs(f.end[X]) + abs(f.end[Y]) + abs(f.end[V_X]) + abs(f.end[V_Y]) < BOUND:
                return _NOT_FINITE
            which, part = _first_crossing(c, f, tables, left)
            if which < 0.0 and (n + 1) * h - f.since - left < _ROUNDED * h:
                break
            if which < 0.0:
                _note(f, left)
                _advance(f)
                f.since += left
                left = _next_part(f, (n + 1) * h, longest)
                continue
            if f.events == MOST_EVENTS:
                return _TOO_MANY_EVENTS
            f.which = int(which)
            part = part * left
            if f.tangents != 0:
                if _carry_to_event(c, f, tables, part) == 0:
                    return _GRAZED
            else:
                step(c, f, tables, part, 0)
                look(c, f, tables, 0)
            _note(f, part)
            f.since += part
            f.phase = following(f.phase, PULL + f.which, 0.0)
            if f.phase == UNDECIDED:
                take_hold(c, f)
            find_margins(c, f)
            _advance(f)
            f.times[f.events] = f.since
            f.events += 1
            f.word[f.events] = f.phase
            left = _next_part(f, (n + 1) * h, longest)
        _note(f, left)
        _advance(f)
        if n & _SIGNALS == _SIGNALS and stopped(f.signals):
            return _STOPPED
    _note_border(f)
    return _DONE
