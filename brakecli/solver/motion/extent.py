"""How far a motion reaches: extremes of its state and of its margins, the time in each phase, and its turns."""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BANDS, MARGINS, PHASES, TERMS, V_X, Block, Exact, X
from brakecli.solver.kernels import kernel
from brakecli.solver.motion import exact
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.motion.locate import NO_EVENT, root
from brakecli.solver.phases import STICK
from brakecli.solver.records import Notes
from brakecli.solver.track import put, turned

_BANDS: tuple[float, ...] = 0.25, 0.35
"""Of the standard deviation of v_x. A whole run counts the rises through one of 0.3."""


@kernel(inline=False)
def begin(m: Block) -> None:
    """Begin to note, from the motion reached on."""
    m.square = 0.0
    for phase in range(PHASES):
        m.spent[phase] = 0.0
        for k in range(MARGINS):
            m.least[phase, k] = math.inf
    for i in range(4):
        m.low[i] = m.high[i] = m.z[i]
    for k in range(BANDS):
        m.beaten[k] = 0
        m.side[k] = 0


@kernel(inline=False)
def zero_of_velocity(e: Exact, m: Block) -> float:
    """The part of the last step's span at which v_x passes through zero; puts the motion there in `at`."""
    sign = 1.0 if m.begin[V_X] > 0.0 else -1.0
    exact.expand(e, m.begin, m.old, m.span)
    for k in range(TERMS):
        e.polynomial[0, k] = sign * e.series[k, V_X]
    theta = root(e, 0, 0.0, m.taken)
    exact.reach(e, theta)
    return theta


@kernel(inline=False)
def note_turn(e: Exact, m: Block, track: Notes, scratch: Floats) -> None:
    """Note a turning point in the last step."""
    kind = turned(track, m.z[V_X])
    if kind < 0:
        return
    theta = 0.0  # at the event behind which the step began, where v_x was that of a wheel at rest
    x = m.begin[X]
    if m.begin[V_X] * m.z[V_X] < 0.0:
        theta = zero_of_velocity(e, m)
        x = e.at[X]
    put(track, scratch, kind, m.base + m.time + (theta - m.taken) * m.span, x)


@kernel
def _square(first: float, last: float, way: float, seconds: float) -> float:
    """The integral of v_x² over a step, by the parabola through both ends whose mean is the way over the time.

    With τ from 0 to 1 it is v = first (1 - τ) + last τ + 6 d τ (1 - τ), where d is the mean less that of the ends.
    """
    if seconds <= 0.0:
        return 0.0
    d = way / seconds - 0.5 * (first + last)
    return seconds * ((first * first + first * last + last * last) / 3.0 + d * (first + last) + 1.2 * d * d)


@kernel(inline=False)
def note(e: Exact, m: Block) -> None:
    """Note what is least and largest in the last step, and how long it took."""
    seconds = m.taken * m.span
    m.spent[m.old] += seconds
    for i in range(4):
        m.low[i] = min(m.low[i], m.z[i])
        m.high[i] = max(m.high[i], m.z[i])
    if m.begin[V_X] * m.z[V_X] < 0.0:
        zero_of_velocity(e, m)
        m.low[X] = min(m.low[X], e.at[X])
        m.high[X] = max(m.high[X], e.at[X])
    if m.which == NO_EVENT and m.span == m.h:
        for k in range(MARGINS if m.old == STICK else MARGINS - 1):
            fall = m.margins[MARGINS + k]
            rise = e.before[4 + MARGINS + k]
            if fall < 0.0 < rise:
                _, value = lowest(m.margins[k], fall, e.before[4 + k], rise)
                m.least[m.old, k] = min(m.least[m.old, k], max(value, 0.0))
    m.square += _square(m.begin[V_X], m.z[V_X], m.z[X] - m.begin[X], seconds)
    for k in range(BANDS if m.band > 0.0 else 0):
        if abs(m.z[V_X]) > _BANDS[k] * m.band:
            below = 1 if m.z[V_X] < 0.0 else 0
            m.beaten[k] += 1 if m.side[k] > below else 0
            m.side[k] = below
