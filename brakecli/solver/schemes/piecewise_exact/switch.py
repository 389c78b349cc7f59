"""From one phase to the next: which one a motion is in, and which one follows where a margin has run out."""

from typing import Any

from numba import boolean, float64, int64, types, void

from brakecli.solver.automaton import HEIGHT, OPEN, PULL, PUSH, STICK, UNDECIDED, following, held, sliding_phase
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import kernel
from brakecli.solver.motions import BELT, FLOW_TYPE, SIZE, TERMS, V_X, V_Y, Y
from brakecli.solver.records import COEFFICIENTS
from brakecli.solver.schemes.piecewise_exact import phases
from brakecli.solver.schemes.piecewise_exact.locate import ROUNDING


@kernel(types.UniTuple(float64, 2)(FLOW_TYPE, int64))
def _margin(m: Any, which: int) -> tuple[float, float]:
    """A margin in stick (N), its column times z, and by how much it may miss zero through rounding."""
    total = 0.0
    terms = 0.0
    for i in range(SIZE):
        part = m.margins[STICK, i, 4 + which] * m.z[i]
        total = total + part
        terms = terms + abs(part)
    return total, 0.5 * ROUNDING * terms


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def _enter(c: Coefficients, m: Any, phase: int, h: float) -> None:
    """Enter a phase; where it is undecided the shoe has the wheel's velocity exactly, and the forces decide.

    What rounding leaves of an event may be more than a short rest of a step allows.
    """
    if phase == UNDECIDED:
        phases.make(c, m, STICK, h)
        m.z[V_X] = m.z[BELT]
        pull, its_rounding = _margin(m, PULL)
        push, rounding = _margin(m, PUSH)
        phase = held(pull, push, its_rounding, rounding)
    m.phase = phase
    phases.make(c, m, phase, h)


@kernel(boolean(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def _rises(c: Coefficients, m: Any, h: float) -> bool:
    """Whether a shoe that rests on the wheel without pressing it leaves: its first derivative that is not zero."""
    phases.make(c, m, OPEN, h)  # nothing presses, so that all phases begin alike
    for i in range(SIZE):
        m.series[0, i] = m.z[i]
    phases.expand(m, OPEN, h)
    for k in range(TERMS):
        total = 0.0
        terms = 0.0
        for i in range(SIZE):
            part = m.generator[OPEN, V_Y, i] * m.series[k, i] if i < BELT or k < 2 else 0.0
            total = total + part
            terms = terms + abs(part)
        if abs(total) > ROUNDING * terms:
            return total > 0.0
    return False


@kernel(void(COEFFICIENTS, FLOW_TYPE, float64), inlined=False)
def place(c: Coefficients, m: Any, h: float) -> None:
    """Find the phase of a motion."""
    touches = m.z[Y] == 0.0
    clear = m.z[Y] > 0.0 or (touches and (m.z[V_Y] > 0.0 or (m.z[V_Y] == 0.0 and _rises(c, m, h))))
    _enter(c, m, OPEN if clear else sliding_phase(m.z[V_X] - m.z[BELT]), h)


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def switch(c: Coefficients, m: Any, which: int, h: float) -> None:
    """Enter the phase that follows where a margin has run out."""
    if which == HEIGHT:
        m.z[Y] = 0.0
    _enter(c, m, following(m.phase, which, m.z[V_X] - m.z[BELT]), h)
