"""The contact of a rough pad whose gap is straight in each cell."""

import math
from typing import Any

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import FAST, kernel
from brakecli.solver.records import record
from brakecli.solver.sine import sine_cosine

EIGHT = 8
FOUR = 4
"""Lanes of sines, and of nodes and waves in the tables."""
_TINY = 1e-300  # avoids a division by zero where a cell is open

CELLS = record(
    "stiffness",  # 2ak, N/m
    "half",  # k times half a cell, N/m
    "shoe_mean",  # mean of f1 over the pad, m
    "full_up_to clear_from",  # heights y: up to it all touches for sure, from it on nothing, m
    "force slope touching",  # last contact: F_y (N), ∂F_y/∂x and -∂F_y/∂y (N/m)
    "place",  # x - U since, for which sines and heights are known, m
    half_cells=int,  # cells of half a pad
    width=int,  # nodes of half a pad in the tables
    waves=int,
    known=int,  # of the place: 0 nothing, 1 sines, 2 heights, 3 also their slopes
    signals=int,  # where to see that a signal has come, see `kernels.stopped`
    omega_at=int,  # where in the tables begin: wavenumbers
    g_at=int,  # amplitudes, with the factor of the cells
    full_at=int,  # F_y of a full contact by the sine of each wave, N
    angles_at=int,  # phases at the begin of the span
    waves_at=int,  # sines and cosines of each wave at the nodes of half a pad
    shoe_at=int,  # f1 at the nodes of the right half, and of the left half
    sines_at=int,  # scratch: g sin and g cos of the angles, and these times ω
    nodes_at=int,  # scratch: f2 at the nodes, the even part and the odd part, then of its slope
)
"""A rough pad in cells of equal length, and its contact found last."""


@kernel(fastmath=FAST)
def _add_four(even: Floats, odd: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """Add four waves s cos(ωξ) + c sin(ωξ) to the even part and to the odd part of a height."""
    n = even.size
    s_0 = s[0]
    s_1 = s[1]
    s_2 = s[2]
    s_3 = s[3]
    c_0 = c[0]
    c_1 = c[1]
    c_2 = c[2]
    c_3 = c[3]
    for j in range(n):
        odd[j] += (c_0 * table[j] + c_1 * table[j + 2 * n]) + (c_2 * table[j + 4 * n] + c_3 * table[j + 6 * n])
        one = s_0 * table[j + n] + s_1 * table[j + 3 * n]
        even[j] += one + (s_2 * table[j + 5 * n] + s_3 * table[j + 7 * n])


@kernel(fastmath=FAST)
def _add_one(even: Floats, odd: Floats, table: Floats, s: float, c: float) -> None:
    """Add a wave s cos(ωξ) + c sin(ωξ) to the even part and to the odd part of a height."""
    n = even.size
    for j in range(n):
        odd[j] += c * table[j]
        even[j] += s * table[j + n]


@kernel(inline=False)
def _sum_waves(f: Any, tables: Floats, even: Floats, odd: Floats, at: int) -> None:
    """The even part and the odd part of a sum of waves, whose factors begin `at` a place of the tables."""
    n = f.width
    i = 0
    eights = (f.waves + EIGHT - 1) // EIGHT * EIGHT
    for j in range(n):
        even[j] = odd[j] = 0.0
    while i + 4 <= f.waves:
        begin = f.waves_at + 2 * n * i
        s = tables[at + i : at + i + 4]
        c = tables[at + eights + i : at + eights + i + 4]
        _add_four(even, odd, tables[begin : begin + 8 * n], s, c)
        i += 4
    while i < f.waves:
        begin = f.waves_at + 2 * n * i
        _add_one(even, odd, tables[begin : begin + 2 * n], tables[at + i], tables[at + eights + i])
        i += 1


@kernel(fastmath=FAST)
def _cell(one: float, two: float) -> tuple[float, float]:
    """The part θ of a cell that touches, h⁺/(h⁺ - l⁻), and twice the mean gap there, h⁺ + l⁺.

    h is the larger gap at both ends and l the smaller one; h⁺ is h where it is positive, l⁻ is l where it is
    negative, and both are 0 otherwise.
    """
    high, low = (one, two) if one > two else (two, one)
    press = high if high > 0.0 else 0.0
    rest = low if low > 0.0 else 0.0
    return np.divide(press, press - (low - rest) + _TINY), press + rest


@kernel(fastmath=FAST)
def _pressed(y: float, even: Floats, odd: Floats, right: Floats, left: Floats, cells: int) -> tuple[float, float]:
    """Σ θ (h⁺ + l⁺) and Σ 2θ over all cells, see `_cell`: times kc/2 they are F_y, (2), and -∂F_y/∂y.

    c is the length of a cell; `right` and `left` are f1.
    """
    force = 0.0
    touching = 0.0
    for j in range(cells):
        one = even[j] + odd[j] - right[j] - y
        two = even[j + 1] + odd[j + 1] - right[j + 1] - y
        part, gap = _cell(one, two)
        force = force + part * gap
        touching = touching + 2.0 * part
        one = even[j] - odd[j] - left[j] - y
        two = even[j + 1] - odd[j + 1] - left[j + 1] - y
        part, gap = _cell(one, two)
        force = force + part * gap
        touching = touching + 2.0 * part
    return force, touching


@kernel(fastmath=FAST)
def _slope(part: float, one: float, two: float, steep: float, steeper: float) -> float:
    """The derivative of θ (h⁺ + l⁺) by x, θ (2 - θ) h' + θ² l': of a cell, with the slopes of f2 at both ends."""
    of_high, of_low = (steep, steeper) if one > two else (steeper, steep)
    return part * (2.0 - part) * of_high + part * part * of_low


@kernel(fastmath=FAST)
def _pressed_steeply(
    y: float, even: Floats, odd: Floats, rise: Floats, turn: Floats, right: Floats, left: Floats, cells: int
) -> tuple[float, float, float]:
    """As `_pressed`, and the derivative of its first number by x; the slope of f2 has the parts `rise`, `turn`."""
    force = 0.0
    touching = 0.0
    slope = 0.0
    for j in range(cells):
        one = even[j] + odd[j] - right[j] - y
        two = even[j + 1] + odd[j + 1] - right[j + 1] - y
        part, gap = _cell(one, two)
        force = force + part * gap
        touching = touching + 2.0 * part
        slope += _slope(part, one, two, rise[j] + turn[j], rise[j + 1] + turn[j + 1])
        one = even[j] - odd[j] - left[j] - y
        two = even[j + 1] - odd[j + 1] - left[j + 1] - y
        part, gap = _cell(one, two)
        force = force + part * gap
        touching = touching + 2.0 * part
        slope += _slope(part, one, two, rise[j] - turn[j], rise[j + 1] - turn[j + 1])
    return force, touching, slope


@kernel(inline=False)
def _turn(f: Any, tables: Floats, place: float) -> None:
    """g sin ψ, g cos ψ and their slopes by x of each wave: ψ = ω `place` + ψ_0 where x - U since is `place`."""
    n = f.waves
    eights = (f.waves + EIGHT - 1) // EIGHT * EIGHT
    at = f.sines_at
    sines = tables[at : at + eights]
    cosines = tables[at + eights : at + 2 * eights]
    rises = tables[at + 2 * eights : at + 3 * eights]
    turns = tables[at + 3 * eights : at + 4 * eights]
    for i in range(n):
        sines[i] = tables[f.omega_at + i] * place + tables[f.angles_at + i]
    for i in range(eights):
        sines[i], cosines[i] = sine_cosine(sines[i])
    for i in range(n):
        g = tables[f.g_at + i]
        omega = tables[f.omega_at + i]
        sines[i] = g * sines[i]
        cosines[i] = g * cosines[i]
        rises[i] = omega * cosines[i]
        turns[i] = -omega * sines[i]
    f.place = place
    f.known = 1


@kernel(inline=False)
def extreme_gap(f: Any, tables: Floats, place: float, y: float, everywhere: bool) -> tuple[float, float]:
    """The gap f2 - f1 - y at a node, and the slope of f2 there: the least gap, zero where all begins to touch
    `everywhere`, or the largest one, zero where something begins to touch.
    """
    n = f.width
    at = f.nodes_at
    if place != f.place or f.known == 0:
        _turn(f, tables, place)
    if f.known < 2:
        _sum_waves(f, tables, tables[at : at + n], tables[at + n : at + 2 * n], f.sines_at)
        f.known = 2
    sign = -1.0 if everywhere else 1.0
    most = -math.inf
    node = 0
    for j in range(f.half_cells + 1):
        even = tables[at + j] - y
        odd = tables[at + n + j]
        one = sign * (even + odd - tables[f.shoe_at + j])
        two = sign * (even - odd - tables[f.shoe_at + n + j])
        if one > most:
            most = one
            node = j
        if two > most:
            most = two
            node = -j
    slope = 0.0
    eights = (f.waves + EIGHT - 1) // EIGHT * EIGHT
    rises = f.sines_at + 2 * eights
    for i in range(f.waves):
        wave = f.waves_at + 2 * n * i + abs(node)
        sine = tables[wave] if node > 0 else -tables[wave]
        slope += tables[rises + i] * tables[wave + n] + tables[rises + eights + i] * sine
    return sign * most, slope


@kernel(inline=False)
def press(f: Any, tables: Floats, place: float, y: float, steeply: bool) -> None:
    """The contact where x - U since is `place`; ∂F_y/∂x only where it is asked for `steeply`.

    Where the pad touches everywhere, F_y = -2ak (y + mean f1) + Σ full sin ψ. Otherwise it is a sum over cells.
    """
    f.slope = 0.0
    if y >= f.clear_from:
        f.force = f.touching = 0.0
        return
    eights = (f.waves + EIGHT - 1) // EIGHT * EIGHT
    if place != f.place:
        f.known = 0
    if f.known == 0:
        _turn(f, tables, place)
    if y <= f.full_up_to:
        force = -(y + f.shoe_mean) * f.stiffness
        slope = 0.0
        for i in range(f.waves):
            force += tables[f.full_at + i] * tables[f.sines_at + i]
            slope += tables[f.full_at + i] * tables[f.sines_at + 2 * eights + i]
        f.force = force
        f.slope = slope
        f.touching = f.stiffness
        return
    n = f.width
    at = f.nodes_at
    even = tables[at : at + n]
    odd = tables[at + n : at + 2 * n]
    right = tables[f.shoe_at : f.shoe_at + n]
    left = tables[f.shoe_at + n : f.shoe_at + 2 * n]
    if f.known < 2:
        _sum_waves(f, tables, even, odd, f.sines_at)
        f.known = 2
    if not steeply:
        force, touching = _pressed(y, even, odd, right, left, f.half_cells)
    else:
        rise = tables[at + 2 * n : at + 3 * n]
        turn = tables[at + 3 * n : at + 4 * n]
        if f.known < 3:
            _sum_waves(f, tables, rise, turn, f.sines_at + 2 * eights)
            f.known = 3
        force, touching, slope = _pressed_steeply(y, even, odd, rise, turn, right, left, f.half_cells)
        f.slope = f.half * slope
    f.force = f.half * force
    f.touching = f.half * touching
