"""The phases of a motion on smooth surfaces: what moves the shoe in each, and the matrices of a step.

A phase is a side of the friction law, or a pad that is clear of the wheel. With U, Q and their slopes as further
components, the motion is z' = A z in each, what keeps the phase up is linear in z, and powers are quadratic in z.
"""

import math
from typing import Any

import numpy as np
from numba import float64, int64, types, void

from brakecli.solver.compile import kernel
from brakecli.solver.records import (
    BELT,
    BELT_SLOPE,
    COEFFICIENTS,
    FLOW_TYPE,
    LOAD,
    LOAD_SLOPE,
    MARGINS,
    NODES,
    PAIRS,
    PHASES,
    SIZE,
    TERMS,
    V_X,
    V_Y,
    WORK_TYPE,
    WORKS,
    Coefficients,
    X,
    Y,
)

BACKWARD, STICK, FORWARD, OPEN = range(PHASES)
"""The sign of the sliding velocity plus one, or the pad that is clear."""
HEIGHT, SLIDING = 0, 1
"""Margins: how far the pad is pressed in, or clear; then, in slip, the sliding speed; in stick, how far the force
needed is within the friction cone, on the side of backward slip and, third, on that of forward slip."""

_NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(NODES)[0]
_SHARES = 0.5 * np.polynomial.legendre.leggauss(NODES)[1]
"""Gauss' rule over a step: as a step is a part of a period, exact to rounding for what is quadratic in z."""


@kernel(void(FLOW_TYPE, int64, float64), inlined=False)
def expand(m: Any, phase: int, span: float) -> None:
    """The series of the motion over a span (s), from its first coefficient on: (A span)^k z / k!."""
    a, z = m.generator, m.series
    x, y, v_x, v_y, load, belt_slope = z[X, 0], z[Y, 0], z[V_X, 0], z[V_Y, 0], z[LOAD, 0], z[BELT_SLOPE, 0]
    z[BELT, 1], z[LOAD, 1] = span * z[BELT_SLOPE, 0], span * z[LOAD_SLOPE, 0]  # further terms are 0
    for k in range(1, TERMS):
        part = span / k
        a_x = (a[phase, V_X, X] * x + a[phase, V_X, Y] * y) + (a[phase, V_X, V_X] * v_x + a[phase, V_X, V_Y] * v_y)
        a_y = (a[phase, V_Y, X] * x + a[phase, V_Y, Y] * y) + (a[phase, V_Y, V_X] * v_x + a[phase, V_Y, V_Y] * v_y)
        a_x += a[phase, V_X, LOAD] * load + a[phase, V_X, BELT_SLOPE] * belt_slope
        a_y += a[phase, V_Y, LOAD] * load
        x, y, v_x, v_y = part * v_x, part * v_y, part * a_x, part * a_y
        load, belt_slope = z[LOAD, 1] if k == 1 else 0.0, 0.0
        z[X, k], z[Y, k], z[V_X, k], z[V_Y, k] = x, y, v_x, v_y


@kernel(void(FLOW_TYPE, int64, float64, int64, int64))
def reach(m: Any, phase: int, theta: float, node: int, column: int) -> None:
    """Put the motion at a part of the span of the series into `m.at[node, column]`, with its friction force."""
    z, at, q = m.series, m.at, theta * theta
    x = y = v_x = v_y = 0.0
    for k in range(TERMS - 2, -1, -2):  # in pairs, which wait for each other half as long
        x, y = x * q + (z[X, k + 1] * theta + z[X, k]), y * q + (z[Y, k + 1] * theta + z[Y, k])
        v_x, v_y = v_x * q + (z[V_X, k + 1] * theta + z[V_X, k]), v_y * q + (z[V_Y, k + 1] * theta + z[V_Y, k])
    at[node, column, X], at[node, column, Y], at[node, column, V_X], at[node, column, V_Y] = x, y, v_x, v_y
    at[node, column, BELT], at[node, column, BELT_SLOPE] = z[BELT, 0] + theta * z[BELT, 1], z[BELT_SLOPE, 0]
    at[node, column, LOAD], at[node, column, LOAD_SLOPE] = z[LOAD, 0] + theta * z[LOAD, 1], z[LOAD_SLOPE, 0]
    m.pull[node, column] = 0.0
    for i in range(SIZE):
        m.pull[node, column] += m.friction[phase, i] * at[node, column, i]


@kernel(types.UniTuple(float64, WORKS)(COEFFICIENTS, FLOW_TYPE, int64, int64, int64, int64))
def _powers(
    c: Coefficients, m: Any, phase: int, node: int, one: int, other: int
) -> tuple[float, float, float, float]:
    """The powers of the account (W) in a motion at a node, or their bilinear form in two."""
    z, w, f_z, f_w = m.at[node, one], m.at[node, other], m.pull[node, one], m.pull[node, other]
    belt = f_z * w[BELT] + f_w * z[BELT]
    heat = f_z * (w[BELT] - w[V_X]) + f_w * (z[BELT] - z[V_X]) if phase != STICK else 0.0
    dashpots = c.b_xx * z[V_X] * w[V_X] + c.b_xy * (z[V_X] * w[V_Y] + z[V_Y] * w[V_X]) + c.b_yy * z[V_Y] * w[V_Y]
    load = z[LOAD] * (c.sin_beta * w[V_X] + c.cos_beta * w[V_Y])
    load += w[LOAD] * (c.sin_beta * z[V_X] + c.cos_beta * z[V_Y])
    return 0.5 * belt, 0.5 * heat, dashpots, 0.5 * load


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64), inlined=False)
def _describe(c: Coefficients, m: Any, phase: int) -> None:
    """The generator of a phase, its friction force, margins and powers."""
    a, force, margin, needed = m.generator[phase], m.friction[phase], m.margins[phase], m.needed
    pressed = m.stiffness if phase != OPEN else 0.0  # F_y = -pressed y, Eq. (2)
    side = phase - STICK if phase != OPEN else 0
    # Eq. (6) with the velocity and the acceleration of the wheel
    needed[X], needed[Y], needed[V_Y], needed[LOAD] = c.c_xx, c.c_xy, c.b_xy, c.sin_beta
    needed[BELT], needed[BELT_SLOPE] = c.b_xx, c.m
    a[X, V_X] = a[Y, V_Y] = a[BELT, BELT_SLOPE] = a[LOAD, LOAD_SLOPE] = 1.0
    a[V_Y, X], a[V_Y, Y], a[V_Y, LOAD] = -c.c_xy / c.m, -(c.c_yy + pressed) / c.m, -c.cos_beta / c.m  # Eq. (7)
    a[V_Y, V_X], a[V_Y, V_Y] = -c.b_xy / c.m, -c.b_yy / c.m
    margin[HEIGHT, Y] = 1.0 if phase == OPEN else -1.0
    if phase == STICK:
        a[V_X, BELT_SLOPE] = 1.0
        for j in range(SIZE):
            force[j] = needed[j]  # Eq. (4)
            margin[1, j], margin[2, j] = -needed[j], needed[j]
        margin[1, Y], margin[2, Y] = margin[1, Y] - c.phi * pressed, margin[2, Y] - c.phi * pressed
    else:
        force[Y] = side * c.phi * pressed  # Eq. (5)
        a[V_X, X], a[V_X, Y], a[V_X, LOAD] = -c.c_xx / c.m, (force[Y] - c.c_xy) / c.m, -c.sin_beta / c.m  # Eq. (6)
        a[V_X, V_X], a[V_X, V_Y] = -c.b_xx / c.m, -c.b_xy / c.m
        margin[SLIDING, V_X], margin[SLIDING, BELT] = side, -side


@kernel(void(COEFFICIENTS, FLOW_TYPE, int64, float64), inlined=False)
def make(c: Coefficients, m: Any, phase: int, h: float) -> None:
    """The matrices of a phase for steps h: exp(A h), and the works of a step as forms in its first motion."""
    if m.made[phase] == 1:
        return
    m.made[phase] = 1
    _describe(c, m, phase)
    a, margins, works, step = m.generator[phase], m.margins[phase], m.works[phase], m.step[phase]
    for k in range(MARGINS):
        for i in range(SIZE):
            for j in range(SIZE):
                margins[MARGINS + k, j] += h * margins[k, i] * a[i, j]
    still = m.knot == math.inf and m.z[BELT_SLOPE] == 0.0 and m.z[LOAD_SLOPE] == 0.0  # slopes stay zero
    for j in range(SIZE):
        if still and j in (BELT_SLOPE, LOAD_SLOPE):
            continue
        for i in range(SIZE):
            m.series[i, 0] = 1.0 if i == j else 0.0
        expand(m, phase, h)
        for node in range(NODES + 1):
            reach(m, phase, _NODES[node] if node < NODES else 1.0, node, j)
        for i in range(SIZE):
            if i <= V_Y:
                step[j, i] = m.at[NODES, j, i]
            for k in range(2 * MARGINS):
                step[j, 4 + k] += margins[k, i] * m.at[NODES, j, i]
    for node in range(NODES):
        pair = 0
        for i in range(SIZE):
            for j in range(i + 1):
                if still and (i in (BELT_SLOPE, LOAD_SLOPE) or j == BELT_SLOPE):
                    pair += 1
                    continue
                share = h * _SHARES[node] * (1.0 if i == j else 2.0)
                belt, heat, dashpots, load = _powers(c, m, phase, node, i, j)
                works[0, pair], works[1, pair] = works[0, pair] + share * belt, works[1, pair] + share * heat
                works[2, pair], works[3, pair] = works[2, pair] + share * dashpots, works[3, pair] + share * load
                pair += 1


@kernel(void(COEFFICIENTS, FLOW_TYPE, WORK_TYPE, float64, float64), inlined=False)
def take_part(c: Coefficients, m: Any, work: Any, span: float, theta: float) -> None:
    """Move to a part of the span of the series, and add the works on the way."""
    for node in range(NODES):
        reach(m, m.phase, theta * _NODES[node], node, 0)
        share = theta * span * _SHARES[node]
        belt, heat, dashpots, load = _powers(c, m, m.phase, node, 0, 0)
        work.belt, work.friction = work.belt + share * belt, work.friction + share * heat
        work.dashpots, work.load = work.dashpots + share * dashpots, work.load + share * load
    reach(m, m.phase, theta, NODES, 0)
    for i in range(SIZE):
        m.z[i] = m.at[NODES, 0, i]


@kernel(void(FLOW_TYPE, WORK_TYPE), inlined=False)
def add_works(m: Any, work: Any) -> None:
    """Add up the works of the whole steps that wait for it, all of the present phase."""
    works, sums, belt, heat, dashpots, load = m.works[m.phase], m.sums, 0.0, 0.0, 0.0, 0.0
    for pair in range(PAIRS):
        belt, heat = belt + works[0, pair] * sums[pair], heat + works[1, pair] * sums[pair]
        dashpots, load = dashpots + works[2, pair] * sums[pair], load + works[3, pair] * sums[pair]
        sums[pair] = 0.0
    work.belt, work.friction = work.belt + belt, work.friction + heat
    work.dashpots, work.load = work.dashpots + dashpots, work.load + load
