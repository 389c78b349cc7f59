"""The heights of both surfaces at the nodes: of few waves by sums, of many from a window of the wheel.

The nodes are equally spaced, so that on a grid that divides their spacing all of them lie at one place between two
points: each height is a sum of `POINTS` heights on the grid, with weights that all nodes share (Lagrange's).
The window holds the grid below the pad and ahead of it. Sums of waves fill it, once for each point that passes, so
that their number hardly matters, nor how long a run lasts; a height does not depend on what was evaluated before.
`contact.pad.interpolation_error` bounds the error.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.contact.pad import BESIDE, POINTS, TILE
from brakecli.solver.double_double import two_product
from brakecli.solver.kernels import FAST, kernel, stopped
from brakecli.solver.records import Layer
from brakecli.solver.roughness import turn_to
from brakecli.solver.sine import sine_cosine

FARTHEST = 4e18
"""Points of the grid up to which they are numbered; a motion that runs away passes it."""
WEIGHTS = np.array([-((-1.0) ** i) * math.comb(POINTS - 1, i) / math.factorial(POINTS - 1) for i in range(POINTS)])
"""Lagrange's, without what depends on the place."""


@kernel(fastmath=FAST)
def _add_wave(f2: Floats, table: Floats, s: float, c: float) -> None:
    """Add g sin(ωξ + ψ) at the nodes of a tile, by addition from the tables of g sin(ωξ) and g cos(ωξ)."""
    for j in range(TILE):
        f2[j] += c * table[j] + s * table[j + TILE]


@kernel(fastmath=FAST)
def _add_five(f2: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """Add five waves at once: f2 is read and written only once."""
    s_0 = s[0]
    s_1 = s[1]
    s_2 = s[2]
    s_3 = s[3]
    s_4 = s[4]
    c_0 = c[0]
    c_1 = c[1]
    c_2 = c[2]
    c_3 = c[3]
    c_4 = c[4]
    for j in range(TILE):
        one = c_0 * table[j] + s_0 * table[j + TILE] + c_1 * table[j + 2 * TILE] + s_1 * table[j + 3 * TILE]
        two = (
            c_2 * table[j + 4 * TILE]
            + s_2 * table[j + 5 * TILE]
            + c_3 * table[j + 6 * TILE]
            + s_3 * table[j + 7 * TILE]
        )
        f2[j] += one + two + c_4 * table[j + 8 * TILE] + s_4 * table[j + 9 * TILE]


@kernel
def phases(x: float, layer: Layer, tables: Floats, scratch: Floats) -> tuple[int, int]:
    """Sine and cosine of the phase ωx + ψ of each wave, eight at a time; where in the scratch they begin."""
    pad = layer.pad
    waves = layer.pad.wheel_terms
    at = pad.nodes + 2 * BESIDE + 2 * TILE
    omega_at = pad.wheel_at + waves
    eights = (waves + 7) // 8 * 8
    sines = scratch[at : at + eights]
    cosines = scratch[at + eights : at + 2 * eights]
    for i in range(waves):
        sines[i] = tables[omega_at + i] * x + scratch[layer.angles_at + i]
    for i in range(eights):
        sines[i], cosines[i] = sine_cosine(sines[i])
    return at, at + eights


@kernel
def _sum_waves(x: float, f2: Floats, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """f2 = Σ g sin(ω(ξ + x) + ψ) where the shoe is at x, in whole tiles."""
    pad = layer.pad
    sines_at, cosines_at = phases(x, layer, tables, scratch)
    sines = scratch[sines_at:cosines_at]
    cosines = scratch[cosines_at : 2 * cosines_at - sines_at]
    waves = pad.wheel_terms
    at = pad.waves_at
    for begin in range(0, f2.size, TILE):
        if stopped(pad.signals):
            return
        tile = f2[begin : begin + TILE]
        i = 0
        for j in range(TILE):
            tile[j] = 0.0
        while i + 5 <= waves:
            _add_five(tile, tables[at : at + 10 * TILE], sines[i : i + 5], cosines[i : i + 5])
            i = i + 5
            at = at + 10 * TILE
        while i < waves:
            _add_wave(tile, tables[at : at + 2 * TILE], sines[i], cosines[i])
            i = i + 1
            at = at + 2 * TILE


@kernel
def _fill(tile: int, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The heights in a tile of the window."""
    pad = layer.pad
    window = layer.window
    n = layer.pad.wheel_terms
    angles = scratch[layer.angles_at : layer.angles_at + n]
    travel, travel_low = two_product(-float(TILE * tile), window.rows * window.spacing)
    turn_to(tables[pad.turns_at : pad.turns_at + 3 * n], travel, travel_low, angles)
    for row in range(window.rows):
        at = window.at + row * window.width + TILE * (tile - window.origin)
        _sum_waves(row * window.spacing, scratch[at : at + TILE], layer, tables, scratch)


@kernel
def _cover(low: int, high: int, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See that the window has the tiles from low to high; if it has to move, most of it lies ahead."""
    window = layer.window
    tiles = window.width // TILE
    if low < window.origin or high >= window.origin + tiles:
        window.origin = high + 2 - tiles if low < window.origin else low - 1
        window.first = window.end = low
    while window.first > low or window.end <= high:
        if window.first > low:
            window.first -= 1
            tile = window.first
        else:
            tile = window.end
            window.end += 1
        _fill(tile, layer, tables, scratch)


@kernel
def _row(point: int, layer: Layer) -> int:
    """Where the heights begin at a point of the grid and, a node's spacing further each, at those that follow."""
    window = layer.window
    column = (point >> window.shift) - TILE * window.origin
    return window.at + (point & (window.rows - 1)) * window.width + column  # type: ignore[no-any-return]


@kernel(fastmath=FAST)
def _weigh(part: float, weights: Floats) -> None:
    """Lagrange's weights of the points, this part of the way from the last one of the first half to the next.

    That of point i is Π (p - j)/(i - j) over all other points j, which lie at -n/2 + 1 … n/2.
    """
    product = 1.0
    for i in range(POINTS // 2):
        product *= (part + i) * (part - 1.0 - i)
    for i in range(POINTS):
        weights[i] = product * WEIGHTS[i] / (part - (i - POINTS // 2 + 1))


@kernel(fastmath=FAST)
def _add_rows(begin: int, w: Floats, f2: Floats, layer: Layer, scratch: Floats) -> None:
    """f2 as the weighted sum of `POINTS` heights, the first at a point of the grid."""
    size = f2.size
    r_0 = scratch[_row(begin, layer) :]
    r_1 = scratch[_row(begin + 1, layer) :]
    r_2 = scratch[_row(begin + 2, layer) :]
    r_3 = scratch[_row(begin + 3, layer) :]
    r_4 = scratch[_row(begin + 4, layer) :]
    r_5 = scratch[_row(begin + 5, layer) :]
    r_6 = scratch[_row(begin + 6, layer) :]
    r_7 = scratch[_row(begin + 7, layer) :]
    r_8 = scratch[_row(begin + 8, layer) :]
    r_9 = scratch[_row(begin + 9, layer) :]
    r_10 = scratch[_row(begin + 10, layer) :]
    r_11 = scratch[_row(begin + 11, layer) :]
    w_0 = w[0]
    w_1 = w[1]
    w_2 = w[2]
    w_3 = w[3]
    w_4 = w[4]
    w_5 = w[5]
    w_6 = w[6]
    w_7 = w[7]
    w_8 = w[8]
    w_9 = w[9]
    w_10 = w[10]
    w_11 = w[11]
    for j in range(size):
        one = w_0 * r_0[j] + w_1 * r_1[j] + w_2 * r_2[j]
        two = w_3 * r_3[j] + w_4 * r_4[j] + w_5 * r_5[j]
        three = w_6 * r_6[j] + w_7 * r_7[j] + w_8 * r_8[j]
        four = w_9 * r_9[j] + w_10 * r_10[j] + w_11 * r_11[j]
        f2[j] = one + two + three + four


@kernel
def _interpolate(x: float, f2: Floats, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """f2 where the shoe is at x, from the window."""
    window = layer.window
    shift = layer.window.shift
    place = (x - window.travel) / window.spacing
    whole = np.floor(place)
    point = whole - window.points
    begin = (int(point) if abs(point) < FARTHEST else 0) - POINTS // 2 + 1
    last = (begin + POINTS - 1 >> shift) + f2.size - 1
    _cover((begin >> shift) // TILE, last // TILE, layer, tables, scratch)
    weights = scratch[window.at - POINTS : window.at]
    _weigh(max(place - whole, 1e-200), weights)  # at no point, where it would divide by zero
    _add_rows(begin, weights, f2, layer, scratch)


@kernel
def profiles(x: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The heights f2 at the nodes and beside them, from the begin of the scratch on.

    They are not to be used where the process is to end. Those of f1 are in the tables.
    """
    n = layer.pad.nodes
    f2 = scratch[: (n + 2 * BESIDE + TILE - 1) // TILE * TILE]
    if layer.window.rows == 0:
        _sum_waves(x, f2, layer, tables, scratch)
    else:
        _interpolate(x, f2[: n + 2 * BESIDE], layer, tables, scratch)
