"""The gap between both surfaces at the edges of cells: of few waves by sums, of many from a window of the wheel.

Cells are equally long, so that on a grid that divides their length all edges lie at one place between two
points: each height is a sum of `POINTS` heights on the grid, with weights that all edges share (Lagrange's).
The window holds the grid below the pad and ahead of it. Sums of waves fill it, once for each point that passes, so
that their number hardly matters, nor how long a run lasts; a height does not depend on what was evaluated before.
`contact.pad.interpolation_error` bounds the error.

A wave is even or odd about the middle of the pad, so that tables of one half are enough. They are cut into tiles
of a constant number of edges, which stay in the cache while all waves are added. What is known of a place is kept:
a shoe that sticks stays at one.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.contact.pad import BESIDE, POINTS, RISE, TILE
from brakecli.solver.double_double import two_product
from brakecli.solver.kernels import FAST, kernel, stopped
from brakecli.solver.records import Layer
from brakecli.solver.roughness import turn_to
from brakecli.solver.sine import sine_cosine

WEIGHTS = np.array([-((-1.0) ** i) * math.comb(POINTS - 1, i) / math.factorial(POINTS - 1) for i in range(POINTS)])
"""Lagrange's, without what depends on the place."""


@kernel(fastmath=FAST)
def _add_wave(even: Floats, odd: Floats, table: Floats, s: float, c: float) -> None:
    """Add the wave s g cos(ωξ) + c g sin(ωξ), with s = sin ψ and c = cos ψ: its even part and its odd part."""
    for j in range(even.size):
        even[j] += s * table[j + TILE]
        odd[j] += c * table[j]


@kernel(fastmath=FAST)
def _add_two(even: Floats, odd: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """Add two waves at once."""
    s_0 = s[0]
    s_1 = s[1]
    c_0 = c[0]
    c_1 = c[1]
    for j in range(even.size):
        even[j] += s_0 * table[j + TILE] + s_1 * table[j + 3 * TILE]
        odd[j] += c_0 * table[j] + c_1 * table[j + 2 * TILE]


@kernel(fastmath=FAST)
def _add_five(even: Floats, odd: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """Add five waves at once: both parts are read and written only once."""
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
    for j in range(even.size):
        one = s_0 * table[j + TILE] + s_1 * table[j + 3 * TILE] + s_2 * table[j + 5 * TILE]
        even[j] += one + (s_3 * table[j + 7 * TILE] + s_4 * table[j + 9 * TILE])
        two = c_0 * table[j] + c_1 * table[j + 2 * TILE] + c_2 * table[j + 4 * TILE]
        odd[j] += two + (c_3 * table[j + 6 * TILE] + c_4 * table[j + 8 * TILE])


@kernel
def eights(layer: Layer) -> int:
    """Sines of the waves, to whole lanes; as many cosines follow."""
    return (layer.pad.wheel_terms + 7) // 8 * 8


@kernel
def _turn(x: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Sine and cosine of the phase ωx + ψ of each wave, eight at a time."""
    pad = layer.pad
    waves = layer.pad.wheel_terms
    omega_at = pad.wheel_at + waves
    number = eights(layer)
    sines = scratch[pad.sines_at : pad.sines_at + number]
    cosines = scratch[pad.sines_at + number : pad.sines_at + 2 * number]
    for i in range(waves):
        sines[i] = tables[omega_at + i] * x + scratch[layer.angles_at + i]
    for i in range(number):
        sines[i], cosines[i] = sine_cosine(sines[i])


@kernel
def _holds(x: float, level: int, layer: Layer) -> bool:
    """Whether so much is known of a place; what is known of another one is forgotten."""
    if x != layer.x:
        layer.x = x
        layer.level = 0
    if layer.level >= level:
        return True
    layer.level = level
    return False


@kernel
def phases(x: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Sines and cosines of all waves where the shoe is at x; without a window."""
    if not _holds(x, 1, layer):
        _turn(x, layer, tables, scratch)


@kernel
def _sum_waves(columns: int, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Both parts of f2 = Σ g sin(ωξ + ψ) in so many columns of the tables."""
    pad = layer.pad
    waves = pad.wheel_terms
    number = eights(layer)
    sines = scratch[pad.sines_at : pad.sines_at + number]
    cosines = scratch[pad.sines_at + number : pad.sines_at + 2 * number]
    at = pad.waves_at
    for begin in range(0, columns, TILE):
        if stopped(pad.signals):
            return
        width = min(TILE, (columns - begin + 7) // 8 * 8)
        even = scratch[pad.parts_at + begin : pad.parts_at + begin + width]
        odd = scratch[pad.parts_at + pad.columns + begin : pad.parts_at + pad.columns + begin + width]
        for j in range(width):
            even[j] = odd[j] = 0.0
        i = 0
        while i + 5 <= waves:
            _add_five(even, odd, tables[at : at + 10 * TILE], sines[i : i + 5], cosines[i : i + 5])
            i = i + 5
            at = at + 10 * TILE
        while i + 2 <= waves:
            _add_two(even, odd, tables[at : at + 4 * TILE], sines[i : i + 2], cosines[i : i + 2])
            i = i + 2
            at = at + 4 * TILE
        if i < waves:
            _add_wave(even, odd, tables[at : at + 2 * TILE], sines[i], cosines[i])
            at = at + 2 * TILE


@kernel(fastmath=FAST)
def _place_sums(gap: Floats, f1: Floats, middle: int, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """f2 - f1 about a middle, from the turned waves."""
    pad = layer.pad
    _sum_waves(middle + 1, layer, tables, scratch)
    even = scratch[pad.parts_at : pad.parts_at + middle + 1]
    odd = scratch[pad.parts_at + pad.columns : pad.parts_at + pad.columns + middle + 1]
    ahead = gap[middle:]
    f1_ahead = f1[middle:]
    for j in range(ahead.size):
        ahead[j] = even[j] + odd[j] - f1_ahead[j]
    for j in range(middle + 1):
        i = np.uint64(middle - j)  # an index that can be negative takes four times as long
        gap[i] = even[j] - odd[j] - f1[i]


@kernel
def _fill(tile: int, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The heights in a tile of the window."""
    pad = layer.pad
    window = layer.window
    n = layer.pad.wheel_terms
    angles = scratch[layer.angles_at : layer.angles_at + n]
    middle = TILE * tile + TILE // 2 - BESIDE - pad.nodes // 2
    travel, travel_low = two_product(-float(middle), window.rows * window.spacing)
    turn_to(tables[pad.turns_at : pad.turns_at + 3 * n], travel, travel_low, angles)
    for row in range(window.rows):
        at = window.at + row * window.width + TILE * (tile - window.origin)
        _turn(row * window.spacing, layer, tables, scratch)
        nothing = tables[pad.nothing_at : pad.nothing_at + TILE]
        _place_sums(scratch[at : at + TILE], nothing, TILE // 2, layer, tables, scratch)


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
    """Where the heights begin at a point of the grid and, a cell further each, at those that follow."""
    window = layer.window
    column = (point >> window.shift) - TILE * window.origin
    return window.at + (point & (window.rows - 1)) * window.width + column


@kernel(fastmath=FAST)
def _weigh(p: float, weights: Floats) -> None:
    """Lagrange's weights of the points, this part of the way from the last one of the first half to the next.

    That of point i is Π (p - j)/(i - j) over all other points j, which lie at -n/2 + 1 … n/2.
    """
    product = 1.0
    for i in range(POINTS // 2):
        product *= (p + i) * (p - 1.0 - i)
    for i in range(POINTS):
        weights[i] = product * WEIGHTS[i] / (p - (i - POINTS // 2 + 1))


@kernel(fastmath=FAST)
def _add_rows(begin: int, w: Floats, gap: Floats, f1: Floats, layer: Layer, scratch: Floats) -> None:
    """f2 - f1, with f2 as the weighted sum of `POINTS` heights, the first at a point of the grid."""
    size = gap.size
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
        gap[j] = one + two + three + four - f1[j]


@kernel
def _interpolate(x: float, gap: Floats, f1: Floats, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """f2 - f1 where the shoe is at x, from the window."""
    window = layer.window
    shift = layer.window.shift
    position = (x - window.travel) / window.spacing
    whole = np.floor(position)
    point = whole - window.points
    begin = (
        (int(point) if abs(point) < 4e18 else 0) - POINTS // 2 + 1
    )  # a motion that runs away passes all numbers
    last = (begin + POINTS - 1 >> shift) + gap.size - 1
    _cover((begin >> shift) // TILE, last // TILE, layer, tables, scratch)
    weights = scratch[window.at - POINTS : window.at]
    _weigh(max(position - whole, 1e-200), weights)  # at no point, where it would divide by zero
    _add_rows(begin, weights, gap, f1, layer, scratch)


@kernel
def gaps(x: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The gap f2 - f1 at the edges and beside them, from the begin of the scratch on.

    It is not to be used where the process is to end.
    """
    pad = layer.pad
    width = pad.nodes + 1 + 2 * BESIDE
    gap = scratch[:width]
    f1 = tables[pad.nodes_at : pad.nodes_at + width]
    if layer.window.rows == 0:
        phases(x, layer, tables, scratch)
        if not _holds(x, 2, layer):
            _place_sums(gap, f1, pad.nodes // 2 + BESIDE, layer, tables, scratch)
    elif not _holds(x, 2, layer):
        _interpolate(x, gap, f1, layer, tables, scratch)


@kernel(fastmath=FAST)
def _find_rises(gap: Floats, rises_of_f1: Floats, into: Floats) -> None:
    """f2' times a cell at the edges, by a polynomial through eight neighbours on each side."""
    for j in range(into.size):
        one = RISE[0] * (gap[j + 9] - gap[j + 7]) + RISE[1] * (gap[j + 10] - gap[j + 6])
        two = RISE[2] * (gap[j + 11] - gap[j + 5]) + RISE[3] * (gap[j + 12] - gap[j + 4])
        three = RISE[4] * (gap[j + 13] - gap[j + 3]) + RISE[5] * (gap[j + 14] - gap[j + 2])
        four = RISE[6] * (gap[j + 15] - gap[j + 1]) + RISE[7] * (gap[j + 16] - gap[j])
        into[j] = one + two + (three + four) + rises_of_f1[j]


@kernel
def rises(x: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """`gaps`, and behind them f2' times a cell at the edges, m."""
    pad = layer.pad
    edges = pad.nodes + 1
    gaps(x, layer, tables, scratch)
    if not _holds(x, 3, layer):
        rises_of_f1 = tables[pad.rises_at : pad.rises_at + edges]
        _find_rises(scratch[: edges + 2 * BESIDE], rises_of_f1, scratch[pad.parts_at : pad.parts_at + edges])
