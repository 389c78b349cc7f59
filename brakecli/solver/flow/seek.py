"""Follow a motion on smooth pads, without samples, until it is known what becomes of it.

At constant speed and load it either comes so near to steady sliding that no event can follow, or its returns to
the section ẋ = 0 come close to one another, and `orbit` finds the limit cycle. The modes of steady sliding
bound the first: the sum of |a_q V_q|, with the amplitudes a_q of the motion beside steady sliding along the
eigenvectors V_q, is not reached at any later time where they decay, and it is multiplied by exp(σ_q t) where
they grow.
"""

import math
from typing import Any

import numpy as np
from numba import float64, int64, void
from numpy.typing import NDArray

from brakecli.solver.automaton import BACKWARD, FORWARD, OPEN, STICK
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import Floats, kernel
from brakecli.solver.flow.orbit import MOST_TURNS, PURSUIT, PURSUIT_TYPE, closed, note_event, sizes
from brakecli.solver.flow.repeating import Orbit
from brakecli.solver.flow.smooth import MOST_EVENTS, MOST_STEPS, PATH, PATH_TYPE, step, zero_of_velocity
from brakecli.solver.motions import BELT, FLOW, FLOW_TYPE, LOAD, SIZE, V_X, V_Y, X, Y
from brakecli.solver.records import COEFFICIENTS, new
from brakecli.solver.schemes.piecewise_exact import phases
from brakecli.solver.schemes.piecewise_exact.steps import look
from brakecli.solver.schemes.piecewise_exact.switch import place
from brakecli.solver.system import longest_step
from brakecli.solver.tangent import MOST_POWERS

GOING_ON, LINEAR, FOUND, ENDED = range(4)
"""What `seek` has come to: nothing yet; no event can follow; an orbit; the end of the time, or of the progress."""

FOREVER = 1e300
"""A time (s) that no motion reaches: finite, as a mode that decays does not grow in it at all."""

_FIRST = 3  # falls before an orbit is sought, and between two tries, which grow further apart
_NEAR = 0.02  # of the size of a cycle: distance of two returns at which an orbit is sought


@kernel(void(FLOW_TYPE, PURSUIT_TYPE, float64), inlined=False)
def _bound(m: Any, o: Any, seconds: float) -> None:
    """How far from steady sliding a linear motion can come in a time t: Σ |a| exp(max(σ, 0) t) of its modes."""
    for k in range(3):
        o.bound[k] = 0.0
    for q in range(4):
        real = 0.0
        imaginary = 0.0
        for i in range(4):
            real += o.into[0, q, i] * (m.z[i] - o.rest[i])
            imaginary += o.into[1, q, i] * (m.z[i] - o.rest[i])
        powers = max(o.growth[q], 0.0) * seconds
        size = math.hypot(real, imaginary) * (math.exp(powers) if powers < MOST_POWERS else math.inf)
        for k in range(3):
            o.bound[k] += size * o.reach[q, k]


@kernel(int64(FLOW_TYPE, PURSUIT_TYPE), inlined=False)
def _stays_linear(m: Any, o: Any) -> int:
    """Whether the motion slides steadily, or beside that, and no event can come before the end."""
    if m.phase != o.sliding:
        return 0
    _bound(m, o, o.duration - o.time)
    return 1 if o.bound[1] < o.room[0] and o.bound[2] < o.room[1] else 0


@kernel(int64(FLOW_TYPE, PURSUIT_TYPE, float64), inlined=False)
def _returned(m: Any, o: Any, fall: float) -> int:
    """Note a return to the section, which is in `m.at`; whether it lies close to the one `turns` before."""
    s = o.returns
    for k in range(MOST_TURNS, 0, -1):
        s[k, 0], s[k, 1], s[k, 2], o.fell[k] = s[k - 1, 0], s[k - 1, 1], s[k - 1, 2], o.fell[k - 1]
        if k < MOST_TURNS:
            o.lows[k], o.ways[k] = o.lows[k - 1], o.ways[k - 1]
    s[0, 0] = m.at[X]
    s[0, 1] = m.at[Y]
    s[0, 2] = m.at[V_Y]
    o.fell[0], o.lows[0], o.ways[0], o.falls = fall, o.low, o.way, o.falls + 1
    o.low = s[0, 0]
    o.way = 0
    o.events = 0
    if o.falls < max(o.next_try, _FIRST):
        return 0
    low = o.lows[0]
    high = s[0, 0]
    for k in range(1, min(MOST_TURNS, o.falls - 1) + 1):
        low = min(low, o.lows[k - 1])
        high = max(high, s[k - 1, 0])
        o.period = fall - o.fell[k]
        o.amplitude = 0.5 * (high - low)
        o.turns = k
        if sizes(o, s[0, 0] - s[k, 0], s[0, 1] - s[k, 1], s[0, 2] - s[k, 2]) < _NEAR:
            return 1
    return 0


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE), inlined=False)
def _try(c: Coefficients, m: Any, path: Any, o: Any) -> int:
    """Seek an orbit near the last return. Where there is none the motion goes on as if nothing had been sought."""
    phase = m.phase
    way = o.way
    events = o.events
    low = o.low
    for i in range(SIZE):
        o.saved[i] = m.z[i]
    found = closed(c, m, path, o)
    for i in range(SIZE):
        m.z[i] = o.saved[i]
    m.phase = phase
    o.way = way
    o.events = events
    o.low = low
    look(m)
    o.next_try = o.falls + _FIRST + (o.falls - o.next_try) // 2
    return found


@kernel(int64(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE))
def seek(c: Coefficients, m: Any, path: Any, o: Any) -> int:
    """Follow the motion until something is known of all that is to come; what that is, or `GOING_ON`."""
    if o.started == 0:
        m.z[X], m.z[Y], m.z[V_X], m.z[V_Y], o.low = m.x, m.y, m.v_x, m.v_y, m.x
        place(c, m, path.h)
        look(m)
        o.started = 1
        if _stays_linear(m, o) == 1:
            return LINEAR
    for _ in range(MOST_STEPS):
        if o.time >= o.duration or o.events > MOST_EVENTS:
            return ENDED
        step(c, m, path, 0)
        o.low = min(o.low, m.z[X])
        near = 0
        falls = path.begin[V_X] > 0.0 >= m.z[V_X]
        if falls:
            near = _returned(m, o, o.time + zero_of_velocity(m, path, 1.0) * path.h)
        o.time += path.part * path.h
        note_event(path, o, m.phase)
        if near == 1 and _try(c, m, path, o) == 1:
            return FOUND
        if falls and _stays_linear(m, o) == 1:
            return LINEAR
    return GOING_ON


@kernel(void(COEFFICIENTS, FLOW_TYPE, PATH_TYPE, PURSUIT_TYPE, float64))
def swing(c: Coefficients, m: Any, path: Any, o: Any, seconds: float) -> None:
    """Widen `low` and `high` to the least and largest x of a linear motion from `m.z` on, for some time.

    It ends early where the modes that are left can reach no further.
    """
    m.phase = o.sliding
    phases.make(c, m, m.phase, path.h)
    look(m)
    o.low, o.high = min(o.low, m.z[X]), max(o.high, m.z[X])
    for number in range(math.ceil(seconds / path.h)):
        step(c, m, path, 0)
        if path.begin[V_X] * m.z[V_X] < 0.0:
            part = zero_of_velocity(m, path, 1.0 if path.begin[V_X] > 0.0 else -1.0)
            if (number + part) * path.h > seconds:
                return
            o.low, o.high = min(o.low, m.at[X]), max(o.high, m.at[X])
            _bound(m, o, seconds)
            if o.rest[X] + o.bound[0] <= o.high and o.rest[X] - o.bound[0] >= o.low:
                return


class Pursuit:
    """A motion on smooth pads, at constant speed and load, which is followed to what becomes of it.

    `way` holds how far it has come, and what is measured on the orbit once it is found; `path` counts its steps.
    """

    def __init__(
        self,
        c: Coefficients,
        acting: tuple[float, float, float],
        state: Floats,
        rest: Floats,
        modes: tuple[NDArray[np.complex128], NDArray[np.complex128]],
        duration: float = FOREVER,
    ) -> None:
        """Begin from a state (x, y, v_x, v_y), with what acts: the contact's stiffness (N/m), U (m/s), Q (N).

        `rest`: x and y of steady sliding. `modes`: its eigenvalues, and the vectors of position and velocity in
        columns. Raises LinAlgError where two of them are alike.
        """
        self._coefficients = c
        self._flow = new(FLOW)
        self.path = new(PATH)
        self.way = new(PURSUIT)
        flow = self._flow
        o = self.way
        values, vectors = modes
        inverse = np.linalg.inv(modes[1])
        flow.stiffness, flow.z[BELT], flow.z[LOAD] = acting
        flow.x, flow.y, flow.v_x, flow.v_y = state
        self.path.h = longest_step(c, acting[0])
        belt = acting[1]
        o.duration = duration
        o.sliding = BACKWARD if belt > 0.0 else FORWARD
        o.rest[:2] = rest
        o.room[:] = (-rest[1], abs(belt))
        o.into[0] = inverse.real
        o.into[1] = inverse.imag
        o.growth[:] = values.real
        o.reach[:] = np.abs(vectors[:3]).T

    def seek(self) -> int:
        """Go on for some time; what the motion has come to, see `seek`."""
        return int(seek(self._coefficients, self._flow, self.path, self.way))

    def swing(self, begin: Floats, seconds: float) -> None:
        """Find the least and the largest x of a linear motion from a state on, for some time (s), see `swing`."""
        self._flow.z[:4] = begin
        swing(self._coefficients, self._flow, self.path, self.way, seconds)

    @property
    def state(self) -> Floats:
        """x, y (m), v_x and v_y (m/s) that the motion has reached."""
        return np.array(self._flow.z[:4])

    @property
    def orbit(self) -> Orbit:
        """The orbit, once it is found."""
        o = self.way
        path = self.path
        x, y, v_y = o.point.tolist()
        period = float(o.period)
        spent = (o.spent / period).tolist()
        word = path.word[: path.events + 1].tolist()
        times = path.times[: path.events].tolist()
        state = x, y, 0.0, v_y
        return Orbit(period, float(o.amplitude), spent[STICK], spent[OPEN], state, tuple(word), tuple(times))

    @property
    def multiplier(self) -> float:
        """Largest part of its size that a disturbance of the orbit keeps in a cycle; an orbit attracts below 1."""
        return float(np.abs(np.linalg.eigvals(self.way.map)).max())
