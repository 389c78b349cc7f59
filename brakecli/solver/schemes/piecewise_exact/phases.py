"""The phases of the automaton on smooth surfaces: what moves the shoe in each, and the matrices of a step.

With U, Q and their slopes as further components, the motion is z' = A z in each phase, its margins are linear in
z, and powers are quadratic in z.
"""

from typing import Any

import numpy as np
from numba import float64, int64, types, void

from brakecli.solver.automaton import HEIGHT, OPEN, PULL, PUSH, SLIDING, STICK, side_of
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.compile import Floats, kernel
from brakecli.solver.motions import (
    BELT,
    BELT_SLOPE,
    FLOW_TYPE,
    LOAD,
    LOAD_SLOPE,
    MARGINS,
    NODES,
    SIZE,
    TERMS,
    V_X,
    V_Y,
    X,
    Y,
)
from brakecli.solver.records import COEFFICIENTS, WORK_TYPE

_NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(NODES)[0]
_SHARES = 0.5 * np.polynomial.legendre.leggauss(NODES)[1]
"""Gauss' rule over a step: as a step is a part of a period, exact to rounding for what is quadratic in z."""
_POWERS = np.vander(np.append(_NODES, 1.0), TERMS, increasing=True)
"""Powers of the places of the nodes, and of the end of the step."""


@kernel(types.UniTuple(float64, 2)(FLOW_TYPE, int64, *[float64] * 4))
def acceleration(m: Any, phase: int, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float]:
    """A (x, y, v_x, v_y) along x and y in a phase: what links, dashpots and contact make of (6)-(7)."""
    a = m.generator
    return (
        (a[phase, V_X, X] * x + a[phase, V_X, Y] * y) + (a[phase, V_X, V_X] * v_x + a[phase, V_X, V_Y] * v_y),
        (a[phase, V_Y, X] * x + a[phase, V_Y, Y] * y) + (a[phase, V_Y, V_X] * v_x + a[phase, V_Y, V_Y] * v_y),
    )


@kernel(void(FLOW_TYPE, int64, float64), inlined=False)
def expand(m: Any, phase: int, span: float) -> None:
    """The series of the motion over a span (s), from its first coefficient on: (A span)^k z / k!."""
    a = m.generator
    z = m.series
    x = z[0, X]
    y = z[0, Y]
    v_x = z[0, V_X]
    v_y = z[0, V_Y]
    load = z[0, LOAD]
    belt_slope = z[0, BELT_SLOPE]
    z[1, BELT], z[1, LOAD] = span * z[0, BELT_SLOPE], span * z[0, LOAD_SLOPE]  # further terms are 0
    for k in range(1, TERMS):
        part = span / k
        a_x, a_y = acceleration(m, phase, x, y, v_x, v_y)
        a_x += a[phase, V_X, LOAD] * load + a[phase, V_X, BELT_SLOPE] * belt_slope
        a_y += a[phase, V_Y, LOAD] * load
        x = part * v_x
        y = part * v_y
        v_x = part * a_x
        v_y = part * a_y
        load = z[1, LOAD] if k == 1 else 0.0
        belt_slope = 0.0
        z[k, X] = x
        z[k, Y] = y
        z[k, V_X] = v_x
        z[k, V_Y] = v_y


@kernel(void(FLOW_TYPE, float64))
def reach(m: Any, theta: float) -> None:
    """Put the motion at a part of the span of the series, Σ z_k θ^k, into `m.at`."""
    z = m.series
    q = theta * theta
    for i in range(SIZE):  # the compiler makes one vector of them
        value = 0.0
        for k in range(TERMS - 2, -1, -2):  # in pairs, which wait for each other half as long
            value = value * q + (z[k + 1, i] * theta + z[k, i])
        m.at[i] = value


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64), inlined=False)
def _describe(c: Coefficients, m: Any, phase: int) -> None:
    """The generator of a phase, its friction force and margins."""
    a = m.generator[phase]
    force = m.friction[phase]
    needed = m.needed
    margin = m.margins[phase, :, 4:]
    pressed = m.stiffness if phase != OPEN else 0.0  # F_y = -pressed y, Eq. (2)
    side = side_of(phase)
    for j in range(4):
        m.margins[phase, j, j] = 1.0
    # Eq. (6) with the velocity and the acceleration of the wheel
    needed[X] = c.c_xx
    needed[Y] = c.c_xy
    needed[V_Y] = c.b_xy
    needed[LOAD] = c.sin_beta
    needed[BELT] = c.b_xx
    needed[BELT_SLOPE] = c.m
    a[X, V_X] = a[Y, V_Y] = a[BELT, BELT_SLOPE] = a[LOAD, LOAD_SLOPE] = 1.0
    # Eq. (7)
    a[V_Y, X] = -c.c_xy / c.m
    a[V_Y, Y] = -(c.c_yy + pressed) / c.m
    a[V_Y, LOAD] = -c.cos_beta / c.m
    a[V_Y, V_X] = -c.b_xy / c.m
    a[V_Y, V_Y] = -c.b_yy / c.m
    margin[Y, HEIGHT] = 1.0 if phase == OPEN else -1.0
    if phase == STICK:
        a[V_X, BELT_SLOPE] = 1.0
        for j in range(SIZE):
            force[j] = needed[j]  # Eq. (4)
            margin[j, PULL] = -needed[j]
            margin[j, PUSH] = needed[j]
        margin[Y, PULL], margin[Y, PUSH] = margin[Y, PULL] - c.phi * pressed, margin[Y, PUSH] - c.phi * pressed
    else:
        force[Y] = side * c.phi * pressed  # Eq. (5)
        # Eq. (6)
        a[V_X, X] = -c.c_xx / c.m
        a[V_X, Y] = (force[Y] - c.c_xy) / c.m
        a[V_X, LOAD] = -c.sin_beta / c.m
        a[V_X, V_X] = -c.b_xx / c.m
        a[V_X, V_Y] = -c.b_xy / c.m
        margin[V_X, SLIDING] = side
        margin[BELT, SLIDING] = -side


@kernel(void(FLOW_TYPE, int64, float64), inlined=False)
def _unroll(m: Any, phase: int, h: float) -> None:
    """The series of exp(A h): the rows for x, y, v_x and v_y of (A h)^k / k!.

    Two terms in one loop make it large enough for the compiler to take vectors; a short one it unrolls instead.
    """
    a = m.generator
    f = m.flow
    for i in range(4):
        for j in range(SIZE):
            f[0, i, j] = 1.0 if i == j else 0.0
            f[1, i, j] = h * a[phase, i, j]
    xx = a[phase, V_X, X]
    xy = a[phase, V_X, Y]
    xu = a[phase, V_X, V_X]
    xv = a[phase, V_X, V_Y]
    yx = a[phase, V_Y, X]
    yy = a[phase, V_Y, Y]
    yu = a[phase, V_Y, V_X]
    yv = a[phase, V_Y, V_Y]
    for k in range(2, TERMS, 2):
        part = h / k
        then = h / (k + 1)
        for j in range(SIZE):
            x = f[k - 1, X, j]
            y = f[k - 1, Y, j]
            v_x = f[k - 1, V_X, j]
            v_y = f[k - 1, V_Y, j]
            a_x = (xx * x + xy * y) + (xu * v_x + xv * v_y)
            a_y = (yx * x + yy * y) + (yu * v_x + yv * v_y)
            x = part * v_x
            y = part * v_y
            v_x = part * a_x
            v_y = part * a_y
            f[k, X, j] = x
            f[k, Y, j] = y
            f[k, V_X, j] = v_x
            f[k, V_Y, j] = v_y
            a_x = (xx * x + xy * y) + (xu * v_x + xv * v_y)
            a_y = (yx * x + yy * y) + (yu * v_x + yv * v_y)
            f[k + 1, X, j] = then * v_x
            f[k + 1, Y, j] = then * v_y
            f[k + 1, V_X, j] = then * a_x
            f[k + 1, V_Y, j] = then * a_y
    for k in range(1, TERMS):  # a slope of Q is followed as Q is, and added up over time
        for i in range(4):
            f[k, i, LOAD_SLOPE] = h / k * f[k - 1, i, LOAD]


@kernel(types.UniTuple(float64, 3)(COEFFICIENTS, float64, float64))
def _rates(c: Coefficients, v_x: float, v_y: float) -> tuple[float, float, float]:
    """The forces of the dashpots (N) on a velocity, and the velocity along Q: B v, and v_x sin β + v_y cos β."""
    return c.b_xx * v_x + c.b_xy * v_y, c.b_xy * v_x + c.b_yy * v_y, c.sin_beta * v_x + c.cos_beta * v_y


@kernel(void(FLOW_TYPE, int64))
def _sum_up(m: Any, node: int) -> None:
    """The rows of exp(A t) = Σ (t/h)^k (A h)^k/k! at a node of Gauss' rule or the end: the small terms first."""
    for i in range(4):
        for j in range(SIZE):
            total = 0.0
            for k in range(TERMS - 1, -1, -1):
                total += _POWERS[node, k] * m.flow[k, i, j]
            m.rows[i, j] = total


@kernel(float64(types.Array(float64, 1, "A"), int64, float64))
def _driven(row: Floats, j: int, time: float) -> float:
    """What U, Q or one of their slopes is worth in a row after a time: r_j, and t r_(j-1) as well for slopes."""
    return (row[j] if j > V_Y else 0.0) + (time * row[j - 1] if j in (BELT_SLOPE, LOAD_SLOPE) else 0.0)


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def make(c: Coefficients, m: Any, phase: int, h: float) -> None:
    """The matrices of a phase for steps h: its margins M, their slopes h A' M, and exp(A h)' times all."""
    if m.made[phase] > 0:
        return
    m.made[phase] = 1
    _describe(c, m, phase)
    a = m.generator[phase]
    margins = m.margins[phase]
    step = m.step[phase]
    rows = m.rows
    for k in range(4, 4 + MARGINS):
        for j in range(SIZE):
            slope = 0.0
            for i in range(SIZE):
                slope += margins[i, k] * a[i, j]
            margins[j, k + MARGINS] = h * slope
    _unroll(m, phase, h)
    _sum_up(m, NODES)
    for j in range(SIZE):
        for k in range(4):
            step[j, k] = rows[k, j]
        for k in range(4, 4 + 2 * MARGINS):
            moved = rows[X, j] * margins[X, k] + rows[Y, j] * margins[Y, k]
            moved += rows[V_X, j] * margins[V_X, k] + rows[V_Y, j] * margins[V_Y, k]
            step[j, k] = moved + _driven(margins[:, k], j, h)


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def _make_works(c: Coefficients, m: Any, phase: int, h: float) -> None:
    """The works of a step of a phase as forms in its first motion, z' W z, by Gauss' rule.

    They are the integrals of F_x U, F_x (U - ẋ), ẋ b_xx ẋ + 2 ẋ b_xy ẏ + ẏ b_yy ẏ, and Q_x ẋ + Q_y ẏ.
    """
    m.made[phase] = 2
    r = m.rows
    pull = m.factors[0]
    v_x = m.factors[1]
    v_y = m.factors[2]
    along = m.factors[3]
    across = m.factors[4]
    slides = 0.0 if phase == STICK else 1.0
    w = m.works[phase]
    _unroll(m, phase, h)
    for n in range(NODES):
        _sum_up(m, n)
        share = h * _SHARES[n]
        time = h * _NODES[n]
        for j in range(SIZE):
            force = _driven(m.friction[phase], j, time)
            rates = _rates(c, r[V_X, j], r[V_Y, j])
            for i in range(4):
                force += m.friction[phase, i] * r[i, j]
            pull[n, j] = share * force
            v_x[n, j] = r[V_X, j]
            v_y[n, j] = r[V_Y, j]
            along[n, j] = share * rates[0]
            across[n, j] = share * rates[1]
            for k in range(2):
                u = max(j, BELT + k)
                q = max(j, LOAD + k)
                part = time if k == 1 else 1.0
                w[0, u, j + BELT + k - u] += part * pull[n, j]
                w[3, q, j + LOAD + k - q] += part * share * rates[2]
    for i in range(SIZE):
        for j in range(i + 1):
            drag = damp = 0.0
            for n in range(NODES):
                drag += pull[n, i] * v_x[n, j] + pull[n, j] * v_x[n, i]
                damp += v_x[n, i] * along[n, j] + v_y[n, i] * across[n, j]
            w[1, i, j] = slides * (w[0, i, j] - (drag if j < i else 0.5 * drag))
            w[2, i, j] = 2.0 * damp if j < i else damp


@kernel(void(COEFFICIENTS, FLOW_TYPE, WORK_TYPE, float64, float64), inlined=False)
def take_part(c: Coefficients, m: Any, work: Any, span: float, theta: float) -> None:
    """Move to a part of the span of the series, and add the works on the way, as `_make_works` has them."""
    z = m.at
    for node in range(NODES):
        reach(m, theta * _NODES[node])
        share = theta * span * _SHARES[node]
        force = 0.0
        rates = _rates(c, z[V_X], z[V_Y])
        for i in range(SIZE):
            force += m.friction[m.phase, i] * z[i]
        work.belt += share * force * z[BELT]
        work.friction += share * force * (z[BELT] - z[V_X]) if m.phase != STICK else 0.0
        work.dashpots += share * (rates[0] * z[V_X] + rates[1] * z[V_Y])
        work.load += share * z[LOAD] * rates[2]
    reach(m, theta)
    for i in range(SIZE):
        m.z[i] = z[i]


@kernel(void(COEFFICIENTS, FLOW_TYPE, WORK_TYPE, float64), inlined=False)
def add_works(c: Coefficients, m: Any, work: Any, h: float) -> None:
    """Add up the works Σ W_ij Σ z_i z_j of the whole steps that wait for it, all of the present phase."""
    if m.waiting == 0:
        return
    if m.made[m.phase] < 2:
        _make_works(c, m, m.phase, h)
    works = m.works[m.phase]
    sums = m.sums
    belt = 0.0
    heat = 0.0
    dashpots = 0.0
    load = 0.0
    pair = 0
    for i in range(SIZE):
        for j in range(i + 1):
            belt = belt + works[0, i, j] * sums[pair]
            heat = heat + works[1, i, j] * sums[pair]
            dashpots = dashpots + works[2, i, j] * sums[pair]
            load = load + works[3, i, j] * sums[pair]
            sums[pair] = 0.0
            pair += 1
    m.waiting = 0
    work.belt = work.belt + belt
    work.friction = work.friction + heat
    work.dashpots = work.dashpots + dashpots
    work.load = work.load + load
