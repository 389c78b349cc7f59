"""The heights of both surfaces at the nodes: of few waves by sums, of many from a window of the wheel.

The nodes are equally spaced, so that on a grid that divides their spacing all of them lie at one place between two
points: each height is a sum of `POINTS` heights on the grid, with weights that all nodes share (Lagrange's).
The window holds the grid below the pad and ahead of it. Sums of waves fill it, once for each point that passes, so
that their number hardly matters, nor how long a run lasts; a height does not depend on what was evaluated before.
`contact.pad.interpolation_error` bounds the error.
"""

import math

import numpy as np
from numba import float64, int64, types, void

from brakecli.solver.compile import FAST, Floats, borrowed, kernel, stopped, vector
from brakecli.solver.contact.pad import BESIDE, POINTS, TILE
from brakecli.solver.double_double import two_product
from brakecli.solver.records import LAYER, Layer
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.sine import sine_cosine

FARTHEST = 4e18
"""Points of the grid up to which they are numbered; a motion that runs away passes it."""
WEIGHTS = np.array([-((-1.0) ** i) * math.comb(POINTS - 1, i) / math.factorial(POINTS - 1) for i in range(POINTS)])
"""Lagrange's, without what depends on the place."""


@kernel(void(vector, vector, float64, float64), fastmath=FAST)
def _add_wave(f2: Floats, table: Floats, s: float, c: float) -> None:
    """Add g sin(ωξ + ψ) at the nodes of a tile, by addition from the tables of g sin(ωξ) and g cos(ωξ)."""
    for j in range(TILE):
        f2[j] += c * table[j] + s * table[j + TILE]


@kernel(void(vector, vector, vector, vector), fastmath=FAST)
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


@kernel(types.UniTuple(vector, 2)(float64, LAYER))
def phases(x: float, layer: Layer) -> tuple[Floats, Floats]:
    """Sine and cosine of the phase ωx + ψ of each wave; they come eight at a time."""
    pad = layer.pad
    waves = layer.pad.wheel_terms
    at = pad.nodes + 2 * BESIDE + 2 * TILE
    omega_at = pad.wheel_at + waves
    eights = (waves + 7) // 8 * 8
    sines = layer.scratch[at : at + eights]
    cosines = layer.scratch[at + eights : at + 2 * eights]
    for i in range(waves):
        sines[i] = layer.tables[omega_at + i] * x + layer.angles[i]
    for i in range(eights):
        sines[i], cosines[i] = sine_cosine(sines[i])
    return sines, cosines


@kernel(void(float64, vector, LAYER))
def _sum_waves(x: float, f2: Floats, layer: Layer) -> None:
    """f2 = Σ g sin(ω(ξ + x) + ψ) where the shoe is at x, in whole tiles."""
    pad = layer.pad
    tables = layer.tables
    sines, cosines = phases(x, layer)
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


@kernel(void(int64, LAYER), inlined=False)
def _fill(tile: int, layer: Layer) -> None:
    """The heights in a tile of the window."""
    layer = borrowed(layer)
    pad = layer.pad
    window = layer.window
    n = layer.pad.wheel_terms
    travel, travel_low = two_product(-float(TILE * tile), window.rows * window.spacing)
    wheel_angles(layer.tables[pad.turns_at : pad.turns_at + 3 * n], travel, travel_low, layer.angles)
    for row in range(window.rows):
        at = window.at + row * window.width + TILE * (tile - window.origin)
        _sum_waves(row * window.spacing, layer.scratch[at : at + TILE], layer)


@kernel(void(int64, int64, LAYER))
def _cover(low: int, high: int, layer: Layer) -> None:
    """See that the window has the tiles from low to high; if it has to move, most of it lies ahead."""
    window = layer.window
    tiles = window.width // TILE
    if low < window.origin or high >= window.origin + tiles:
        window.origin = high + 2 - tiles if low < window.origin else low - 1
        window.first = window.end = low
    while window.first > low:
        window.first -= 1
        _fill(window.first, layer)
    while window.end <= high:
        _fill(window.end, layer)
        window.end += 1


@kernel(vector(int64, int64, LAYER))
def _row(point: int, size: int, layer: Layer) -> Floats:
    """The heights at a point of the grid and, a node's spacing further each, at the points that follow."""
    window = layer.window
    column = (point >> window.shift) - TILE * window.origin
    begin = window.at + (point & (window.rows - 1)) * window.width + column
    return layer.scratch[begin : begin + size]


@kernel(void(float64, vector), fastmath=FAST)
def _weigh(part: float, weights: Floats) -> None:
    """Lagrange's weights of the points, this part of the way from the last one of the first half to the next.

    That of point i is Π (p - j)/(i - j) over all other points j, which lie at -n/2 + 1 … n/2.
    """
    product = 1.0
    for i in range(POINTS // 2):
        product *= (part + i) * (part - 1.0 - i)
    for i in range(POINTS):
        weights[i] = product * WEIGHTS[i] / (part - (i - POINTS // 2 + 1))


@kernel(void(int64, vector, vector, LAYER), fastmath=FAST)
def _add_rows(begin: int, w: Floats, f2: Floats, layer: Layer) -> None:
    """f2 as the weighted sum of `POINTS` heights, the first at a point of the grid."""
    size = f2.size
    r_0 = _row(begin, size, layer)
    r_1 = _row(begin + 1, size, layer)
    r_2 = _row(begin + 2, size, layer)
    r_3 = _row(begin + 3, size, layer)
    r_4 = _row(begin + 4, size, layer)
    r_5 = _row(begin + 5, size, layer)
    r_6 = _row(begin + 6, size, layer)
    r_7 = _row(begin + 7, size, layer)
    r_8 = _row(begin + 8, size, layer)
    r_9 = _row(begin + 9, size, layer)
    r_10 = _row(begin + 10, size, layer)
    r_11 = _row(begin + 11, size, layer)
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


@kernel(void(float64, vector, LAYER))
def _interpolate(x: float, f2: Floats, layer: Layer) -> None:
    """f2 where the shoe is at x, from the window."""
    window = layer.window
    shift = layer.window.shift
    place = (x - window.travel) / window.spacing
    whole = np.floor(place)
    point = whole - window.points
    begin = (int(point) if abs(point) < FARTHEST else 0) - POINTS // 2 + 1
    last = (begin + POINTS - 1 >> shift) + f2.size - 1
    _cover((begin >> shift) // TILE, last // TILE, layer)
    weights = layer.scratch[window.at - POINTS : window.at]
    _weigh(max(place - whole, 1e-200), weights)  # at no point, where it would divide by zero
    _add_rows(begin, weights, f2, layer)


@kernel(types.UniTuple(vector, 2)(float64, LAYER))
def profiles(x: float, layer: Layer) -> tuple[Floats, Floats]:
    """f1 at the nodes, and f2 with those beside them; not to be used where the process is to end."""
    pad = layer.pad
    n = pad.nodes
    f2 = layer.scratch[: (n + 2 * BESIDE + TILE - 1) // TILE * TILE]
    if layer.window.rows == 0:
        _sum_waves(x, f2, layer)
    else:
        _interpolate(x, f2[: n + 2 * BESIDE], layer)
    return layer.tables[pad.nodes_at : pad.nodes_at + n], f2
