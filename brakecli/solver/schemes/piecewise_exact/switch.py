"""From one phase to the next: which one a motion is in, and which one follows where a margin has run out."""

from typing import Any

from numba import boolean, float64, int64, void

from brakecli.solver.compile import kernel
from brakecli.solver.records import BELT, COEFFICIENTS, FLOW_TYPE, MARGINS, SIZE, TERMS, V_X, V_Y, Coefficients, Y
from brakecli.solver.schemes.piecewise_exact import phases
from brakecli.solver.schemes.piecewise_exact.locate import ROUNDING
from brakecli.solver.schemes.piecewise_exact.phases import BACKWARD, FORWARD, HEIGHT, OPEN, STICK


@kernel(void(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def _take_hold(c: Coefficients, m: Any, h: float) -> None:
    """The phase of a touching shoe at the wheel's velocity: stick if friction can hold it, else slip, (3)-(5).

    It has this velocity exactly: what rounding leaves of an event may be more than a short rest of a step allows.
    """
    phases.make(c, m, STICK, h)
    m.z[V_X] = m.z[BELT]
    for which in range(1, MARGINS):
        total, terms = 0.0, 0.0
        for i in range(SIZE):
            part = m.margins[STICK, i, 4 + which] * m.z[i]
            total, terms = total + part, terms + abs(part)
        if total < -0.5 * ROUNDING * terms:
            m.phase = BACKWARD if which == 1 else FORWARD
            return
    m.phase = STICK


@kernel(void(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def _land(c: Coefficients, m: Any, h: float) -> None:
    """The phase of a shoe that touches, by its sliding velocity."""
    if m.z[V_X] == m.z[BELT]:
        _take_hold(c, m, h)
    else:
        m.phase = FORWARD if m.z[V_X] > m.z[BELT] else BACKWARD


@kernel(boolean(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def _rises(c: Coefficients, m: Any, h: float) -> bool:
    """Whether a shoe that rests on the wheel without pressing it leaves: its first derivative that is not zero."""
    phases.make(c, m, OPEN, h)  # nothing presses, so that all phases begin alike
    for i in range(SIZE):
        m.series[0, i] = m.z[i]
    phases.expand(m, OPEN, h)
    for k in range(TERMS):
        total, terms = 0.0, 0.0
        for i in range(SIZE):
            part = m.generator[OPEN, V_Y, i] * m.series[k, i] if i < BELT or k < 2 else 0.0
            total, terms = total + part, terms + abs(part)
        if abs(total) > ROUNDING * terms:
            return total > 0.0
    return False


@kernel(void(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def place(c: Coefficients, m: Any, h: float) -> None:
    """Find the phase of a motion."""
    touches = m.z[Y] == 0.0
    if m.z[Y] > 0.0 or (touches and (m.z[V_Y] > 0.0 or (m.z[V_Y] == 0.0 and _rises(c, m, h)))):
        m.phase = OPEN
    else:
        _land(c, m, h)
    phases.make(c, m, m.phase, h)


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def switch(c: Coefficients, m: Any, which: int, h: float) -> None:
    """Enter the phase that follows where a margin has run out."""
    if which == HEIGHT:
        m.z[Y] = 0.0
        if m.phase == OPEN:
            _land(c, m, h)
        else:
            m.phase = OPEN
    elif m.phase == STICK:
        m.phase = BACKWARD if which == 1 else FORWARD  # friction cannot pull that hard, or cannot push
    else:
        _take_hold(c, m, h)
    phases.make(c, m, m.phase, h)
