"""The flow on smooth pads, exact to rounding, with its derivative by the state that it begins at.

Within a phase a small disturbance w follows the same linear equation as the motion: w(t) = exp(A t) w(0). The
disturbed motion comes to an event n·z = 0 later, by -n·w / n·f, where f = A z is the velocity of the motion as it
arrives. For that time it goes on with f and not with f', the velocity behind the event:

    w' = (I + (f' - f) nᵀ / (nᵀ f)) w,

the saltation matrix (R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
Springer 2004, ch. 7). Where stick begins it takes away what w has along ẋ. Where stick ends, and where contact is
lost or made, no force jumps: f' = f, and it is the identity. Speed and load are constant.
"""

import math
from typing import Any

import numba
import numpy as np
from numba import float64, int64, void

from brakecli.solver.automaton import OPEN, STICK
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import Floats, kernel
from brakecli.solver.motions import BELT, FLOW, FLOW_TYPE, LOAD, MARGINS, PHASES, SIZE, TERMS, V_X, X
from brakecli.solver.records import COEFFICIENTS, new, record
from brakecli.solver.schemes.piecewise_exact import phases
from brakecli.solver.schemes.piecewise_exact.locate import NO_EVENT, first_event, root
from brakecli.solver.schemes.piecewise_exact.steps import look, whole
from brakecli.solver.schemes.piecewise_exact.switch import place, switch
from brakecli.solver.system import System

MOST_EVENTS = 60
"""Events of a span; one with more of them is given up."""
MOST_STEPS = 100_000
"""Steps of a span, or of a call: Python hears signals in between."""

PATH = record(
    "h",  # step, s
    "part",  # of the last step that was taken, up to its event
    "time",  # since the begin of the span, s
    which=int,  # event at the end of the last step
    old=int,  # phase of that step
    steps=int,
    evaluations=int,  # of the contact: steps in which the shoe touches
    events=int,  # in the span
    begin=(float, SIZE),  # motion at the begin of the last step
    tangents=(float, (4, 4)),  # what has become of small disturbances of x, y, v_x and v_y, one in each row
    start=(float, 4),  # derivative of the state by time at the begin of the span, m/s and m/s²
    velocity=(float, 4),  # the same at its end
    word=(int, MOST_EVENTS + 1),  # phases of the span
    times=(float, MOST_EVENTS),  # of the events between them, s
    spent=(float, PHASES),  # time in each phase, s
    low=(float, 4),  # least x, y, v_x and v_y at the ends of steps, and x where it turns, m and m/s
    high=(float, 4),  # the largest
    least=(float, (PHASES, MARGINS)),  # least margins inside of phases, in which they fall and rise again
    before=(float, 2 * MARGINS),  # margins at the begin of the last step, and their slopes times the step
)
"""The way of a motion through a span of time."""
PATH_TYPE = numba.from_dtype(PATH)

DONE, GRAZED, EVENTFUL, LONG = range(4)
"""How a span ends: at its end; at an event that is only grazed, which has no derivative; after too many events or
too many steps."""


@kernel(void(FLOW_TYPE, PATH_TYPE))
def expand(m: Any, o: Any) -> None:
    """The series of the last step."""
    for i in range(SIZE):
        m.series[0, i] = o.begin[i]
    phases.expand(m, o.old, o.h)


@kernel(void(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, int64), inlined=False)
def step(c: Coefficients, m: Any, o: Any, closely: int) -> None:
    """Move to the end of a step, or through the event in it; `closely` follows the series in any case."""
    for i in range(SIZE):
        o.begin[i] = m.z[i]
    o.old = m.phase
    o.part = 1.0
    o.which = NO_EVENT
    o.steps += 1
    o.evaluations += 1 if m.phase != OPEN else 0
    if closely == 1 or whole(m, o.h) == 0:
        expand(m, o)
        o.which, o.part = first_event(m)
        phases.reach(m, o.part)
        for i in range(SIZE):
            m.z[i] = m.at[i]
        if o.which != NO_EVENT:
            switch(c, m, o.which, o.h)
        look(m)


@kernel(float64(FLOW_TYPE, PATH_TYPE, float64), inlined=False)
def zero_of_velocity(m: Any, o: Any, sign: float) -> float:
    """The part of the last step at which v_x falls through zero, or rises where the sign is -1; goes there."""
    expand(m, o)
    for k in range(TERMS):
        m.polynomial[0, k] = sign * m.series[k, V_X]
    part = root(m, 0, 0.0, o.part)
    phases.reach(m, part)
    return part


@kernel(float64(FLOW_TYPE, int64, int64))
def _rate(m: Any, phase: int, i: int) -> float:
    """The derivative by time of a component of the motion at `at`, in a phase: row i of A times it."""
    total = 0.0
    for k in range(SIZE):
        total += m.generator[phase, i, k] * m.at[k]
    return total


@kernel(void(FLOW_TYPE, PATH_TYPE, float64), inlined=False)
def _carry(m: Any, o: Any, part: float) -> None:
    """Move the disturbances along a part of the last step: exp(A t) times them."""
    whole_step = part == 1.0
    for j in range(4):
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


@kernel(int64(FLOW_TYPE, PATH_TYPE), inlined=False)
def _jump(m: Any, o: Any) -> int:
    """Take the disturbances through the event that has just been passed; 0 where it is only grazed.

    With the margin n z and the rates f and f' before and behind it, dz becomes dz + (f' - f) (n dz)/(n f).
    """
    rate = 0.0
    for i in range(SIZE):
        m.at[i] = m.z[i]
    for i in range(4):
        rate += m.margins[o.old, i, 4 + o.which] * _rate(m, o.old, i)
    if rate >= 0.0:
        return 0
    for j in range(4):
        late = 0.0
        for i in range(4):
            late += m.margins[o.old, i, 4 + o.which] * o.tangents[j, i] / rate
        for i in range(4):
            o.tangents[j, i] += (_rate(m, m.phase, i) - _rate(m, o.old, i)) * late
    return 1


@kernel(void(FLOW_TYPE, PATH_TYPE))
def _remember(m: Any, o: Any) -> None:
    """The margins at the begin of the next step, and their slopes."""
    for k in range(2 * MARGINS):
        o.before[k] = m.before[4 + k]


@kernel(void(FLOW_TYPE, PATH_TYPE, float64), inlined=False)
def _note(m: Any, o: Any, part: float) -> None:
    """Note what is least and largest in a part of the last step, at whose end the motion `at` is.

    A margin that falls at the begin of a whole step and rises at its end is least inside: on Hermite's cubic.
    """
    o.spent[o.old] += part * o.h
    for i in range(4):
        o.low[i], o.high[i] = min(o.low[i], m.at[i]), max(o.high[i], m.at[i])
    turns = o.begin[V_X] * m.at[V_X] < 0.0
    if part == 1.0 and o.which == NO_EVENT:
        for k in range(MARGINS if o.old == STICK else MARGINS - 1):
            fall = o.before[MARGINS + k]
            rise = m.before[4 + MARGINS + k]
            if fall < 0.0 < rise:
                begin = o.before[k]
                end = m.before[4 + k]
                # Its slope begin' + 2 b t + 3 a t² has one zero between, as its ends have different signs.
                a = 2.0 * (begin - end) + fall + rise
                b = 3.0 * (end - begin) - 2.0 * fall - rise
                t = -fall / (b + math.sqrt(max(b * b - 3.0 * a * fall, 0.0)))
                lowest = begin + t * (fall + t * (b + t * a))
                o.least[o.old, k] = min(o.least[o.old, k], max(lowest, 0.0))
    if turns:
        zero_of_velocity(m, o, 1.0 if o.begin[V_X] > 0.0 else -1.0)
        o.low[X], o.high[X] = min(o.low[X], m.at[X]), max(o.high[X], m.at[X])


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, float64, int64))
def flow(c: Coefficients, m: Any, o: Any, span: float, tangents: int) -> int:
    """Carry the motion `m.z` over a span (s), with its derivative if there are to be `tangents`; how it ends."""
    for j in range(4):
        for i in range(4):
            o.tangents[j, i] = 1.0 if i == j else 0.0
        o.low[j] = o.high[j] = m.z[j]
    for phase in range(PHASES):
        o.spent[phase] = 0.0
        for k in range(MARGINS):
            o.least[phase, k] = math.inf
    place(c, m, o.h)
    look(m)
    for i in range(SIZE):
        m.at[i] = m.z[i]
    for i in range(4):
        o.start[i] = _rate(m, m.phase, i)
    o.word[0] = m.phase
    o.events = 0
    o.time = 0.0
    for _ in range(MOST_STEPS):
        _remember(m, o)
        step(c, m, o, 0)
        if o.time + o.part * o.h >= span:
            part = (span - o.time) / o.h
            if tangents == 1:
                _carry(m, o, part)
            expand(m, o)
            phases.reach(m, part)
            for i in range(4):
                o.velocity[i] = _rate(m, o.old, i)
            for i in range(SIZE):
                m.z[i] = m.at[i]
            o.which = NO_EVENT
            o.part = part
            m.phase = o.old
            o.time = span
            _note(m, o, part)
            return DONE
        if tangents == 1:
            _carry(m, o, o.part)
            if o.which != NO_EVENT and _jump(m, o) == 0:
                return GRAZED
        o.time += o.part * o.h
        for i in range(SIZE):
            m.at[i] = m.z[i]
        _note(m, o, o.part)
        if o.which != NO_EVENT:
            if o.events == MOST_EVENTS:
                return EVENTFUL
            o.times[o.events] = o.time
            o.events += 1
            o.word[o.events] = m.phase
    return LONG


class SmoothFlow:
    """The flow of a shoe on smooth pads, at constant speed and load; one call after the other.

    After a call `path` holds what is known of the way, `state` its end (x, y, v_x, v_y), and `derivative` that of
    the end by the begin: one row for each component of the end.
    """

    def __init__(self, c: Coefficients, stiffness: float, belt: float, load: float, step: float) -> None:
        """From the contact's stiffness (N/m), U (m/s), Q (N) and the longest exact step (s)."""
        self._coefficients = c
        self._motion = new(FLOW)
        self.path = new(PATH)
        self._motion.stiffness = stiffness
        self.path.h = step
        self._motion.z[BELT] = belt
        self._motion.z[LOAD] = load
        self._state = self._motion.z[:4]

    @classmethod
    def of(cls, system: System) -> "SmoothFlow":
        """The flow of a system; raises ValueError where surfaces are rough, or where speed or load change."""
        if not (system.smooth and system.steady):
            raise ValueError("the exact flow needs smooth pads, a constant speed and a constant load")
        acting = system.contact_stiffness, system.belt_speed, system.load_at_start
        return cls(system.coefficients, *acting, system.longest_step)

    def __call__(self, state: Floats, span: float, tangents: bool = True) -> int:
        """Carry a state over a span (s), with its derivative unless that is not needed; how it ends, as `DONE`."""
        self._state[:] = state
        return int(flow(self._coefficients, self._motion, self.path, span, int(tangents)))

    @property
    def state(self) -> Floats:
        """x, y (m), v_x and v_y (m/s) at the end of the last span."""
        return np.array(self._state)

    @property
    def derivative(self) -> Floats:
        """Derivative of the last end by its begin, (4, 4), in SI units."""
        return np.array(self.path.tangents.T)

    @property
    def word(self) -> tuple[int, ...]:
        """The phases of the last span."""
        return tuple(self.path.word[: self.path.events + 1].tolist())

    @property
    def times(self) -> tuple[float, ...]:
        """When they change, s."""
        return tuple(self.path.times[: self.path.events].tolist())
