"""What is carried along with an event-driven motion: a small disturbance, and the motion's own error.

The error e of a motion u obeys e' = A(t) e + u' - f(u): what the continuous solution of each step misses of (6)-(7),
and what the rule for the contact leaves out of its force, is carried on as a disturbance is. The integral over a
step is Gauss's sum: between its places, what has come together is carried on by the series of exp(A τ).
"""

import numpy as np
from numba import float64, int64, types, void

from brakecli.solver.automaton import STICK, side_of
from brakecli.solver.compile import kernel
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.contact.midpoint import left_out
from brakecli.solver.records import GRID, PARTS, STAGES, V_X, V_Y, Grid, X, Y
from brakecli.solver.schemes.event_driven import phases, runge_kutta
from brakecli.solver.schemes.event_driven.phases import SHOE, Shoe
from brakecli.solver.schemes.event_driven.runge_kutta import END_STAGE, USED, A

_RULES = [np.polynomial.legendre.leggauss(points) for points in (5, 3, 12)]
POINTS = np.array([len(places) for places, _ in _RULES])
"""Places in a step of DOP853, of DOPRI5, whose continuous solutions are of order seven and four, and where edges of
patches are."""
PLACES, SHARES = (np.array([np.resize(0.5 * each[i] + 0.5 * (1 - i), 12) for each in _RULES]) for i in (0, 1))
_TERMS = 6
"""Of the series, over half of a step at most, which is one radian of the fastest motion."""
_AT = STAGES - 1

_FOUR = types.UniTuple(float64, 4)


@kernel(_FOUR(SHOE, int64, *[float64] * 4))
def _rate(p: Shoe, stage: int, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float, float, float]:
    """How a disturbance changes at a stage, A(t) e."""
    c, m = p.c, p.motion
    force = m.touch[stage, 1] * x - m.touch[stage, 0] * y
    against_x, against_y = phases.resistance(c, 0.0, x, y, v_x, v_y)
    along = -side_of(m.phase) * c.phi * force - against_x if m.phase != STICK else 0.0
    return v_x, v_y, along / c.m, (force - against_y) / c.m


@kernel(_FOUR(SHOE, float64, *[float64] * 4), inlined=False)
def carried(p: Shoe, h: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float, float, float]:
    """A disturbance along the step that has been made, by its derivative, and on to an event behind it."""
    m, k, step = p.motion, p.motion.disturbed, p.motion.step_done
    at_x, at_y, at_v_x, at_v_y = x, y, v_x, v_y
    for stage in range(END_STAGE + 1):
        if USED[m.pair] <= stage < END_STAGE:
            continue
        at_x, at_y, at_v_x, at_v_y = 0.0, 0.0, 0.0, 0.0
        for j in range(min(stage, USED[m.pair])):
            a = A[m.pair, stage, j]
            at_x, at_y = at_x + a * k[j, X], at_y + a * k[j, Y]
            at_v_x, at_v_y = at_v_x + a * k[j, V_X], at_v_y + a * k[j, V_Y]
        at_x, at_y, at_v_x, at_v_y = x + step * at_x, y + step * at_y, v_x + step * at_v_x, v_y + step * at_v_y
        k[stage, X], k[stage, Y], k[stage, V_X], k[stage, V_Y] = _rate(p, stage, at_x, at_y, at_v_x, at_v_y)
    rest, last = h - step, END_STAGE
    at_x, at_y = at_x + rest * k[last, X], at_y + rest * k[last, Y]
    return at_x, at_y, at_v_x + rest * k[last, V_X], at_v_y + rest * k[last, V_Y]


@kernel(_FOUR(SHOE, float64, *[float64] * 4), inlined=False)
def _ahead(p: Shoe, tau: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float, float, float]:
    """exp(A τ) e with the contact at the last place."""
    d_x, d_y, d_v_x, d_v_y = x, y, v_x, v_y
    for n in range(1, _TERMS + 1):
        part = tau / n
        d_x, d_y, d_v_x, d_v_y = _rate(p, _AT, d_x, d_y, d_v_x, d_v_y)
        d_x, d_y, d_v_x, d_v_y = part * d_x, part * d_y, part * d_v_x, part * d_v_y
        x, y, v_x, v_y = x + d_x, y + d_y, v_x + d_v_x, v_y + d_v_y
    return x, y, v_x, v_y


@kernel(void(SHOE, float64, GRID), inlined=False)
def grow(p: Shoe, h: float, grid: Grid) -> None:
    """Carry the error of the motion along the step that has been made, and add what the step makes of its own."""
    c, m, t, step = p.c, p.motion, p.tangent, p.motion.step_done
    rule = m.pair
    if m.touch[0, 0] != m.touch[END_STAGE, 0]:
        rule = 2
    e, n = t.error[0], t.error[1]
    worst = t.worst[min(m.level * PARTS // grid.samples, PARTS - 1)]
    for place in range(POINTS[rule]):
        theta, part = PLACES[rule, place], step * SHARES[rule, place]
        at_x, slope_x = runge_kutta.interpolated_both(m, X, theta)
        at_y, slope_y = runge_kutta.interpolated_both(m, Y, theta)
        at_v_x, slope_v_x = runge_kutta.interpolated_both(m, V_X, theta)
        at_v_y, slope_v_y = runge_kutta.interpolated_both(m, V_Y, theta)
        phases.find_slopes(p, _AT, theta * step, at_x, at_y, at_v_x, at_v_y)
        missing = left_out(at_y, p.layer) / c.m if p.layer.contact.kind == MIDPOINT else 0.0
        for half in range(2):
            e[X], e[Y], e[V_X], e[V_Y] = _ahead(p, 0.5 * part, e[X], e[Y], e[V_X], e[V_Y])
            n[X], n[Y], n[V_X], n[V_Y] = _ahead(p, 0.5 * part, n[X], n[Y], n[V_X], n[V_Y])
            if half == 0:
                if m.phase != STICK:
                    e[X] += part * (slope_x / step - m.slopes[_AT, X])
                    e[V_X] += part * (slope_v_x / step - m.slopes[_AT, V_X])
                e[Y] += part * (slope_y / step - m.slopes[_AT, Y])
                e[V_Y] += part * (slope_v_y / step - m.slopes[_AT, V_Y])
                n[V_X] += part * side_of(m.phase) * c.phi * missing
                n[V_Y] -= part * missing
        for i in range(4):
            worst[0, i] = max(worst[0, i], abs(e[i]))
            worst[1, i] = max(worst[1, i], abs(n[i]))
            worst[2, i] = max(worst[2, i], abs(e[i] + n[i]))
    rest = h - step
    e[X], e[Y], e[V_X], e[V_Y] = _ahead(p, rest, e[X], e[Y], e[V_X], e[V_Y])
    n[X], n[Y], n[V_X], n[V_Y] = _ahead(p, rest, n[X], n[Y], n[V_X], n[V_Y])
