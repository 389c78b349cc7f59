"""The contact by the midpoint rule on cell means: the quadrature for pads that touch in part.

The tables and the loops over them are cut into tiles of a constant number of nodes, which the compiler lays out
without a loop. Reassociation lets it keep several partial sums side by side; no test in here depends on signed
zeros or on the order of additions. Both together make it about as fast as C for one number of waves and nodes.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.contact.pad import BESIDE, TILE
from brakecli.solver.heights import phases, profiles
from brakecli.solver.kernels import FAST, kernel, stopped
from brakecli.solver.records import Layer


@kernel(fastmath=FAST)
def _sums(y: float, reach: float, f1: Floats, f2: Floats) -> tuple[float, float, float, float, float, float]:
    """Sums over the touching nodes of: gap, 1, rise of f2 across the cell, gap², gap times rise; and the number of
    nodes where the gap f2 - f1 - y is within reach of zero. The rise is that of a polynomial through six
    neighbours, (45 (f_1 - f_-1) - 9 (f_2 - f_-2) + f_3 - f_-3)/60.
    """
    force = 0.0
    touching = 0.0
    rise = 0.0
    square = 0.0
    work = 0.0
    near = 0.0
    for j in range(f1.size):
        gap = f2[j + 3] - f1[j] - y
        near += 1.0 if abs(gap) <= reach else 0.0
        touch = 1.0 if gap > 0.0 else 0.0
        gap = gap if gap > 0.0 else 0.0
        across = 45.0 * (f2[j + 4] - f2[j + 2]) - 9.0 * (f2[j + 5] - f2[j + 1]) + (f2[j + 6] - f2[j])
        force += gap
        touching += touch
        rise += touch * across
        square += gap * gap
        work += gap * across
    return force, touching, rise / 60.0, square, work / 60.0, near


@kernel(fastmath=FAST)
def _pressed(y: float, f1: Floats, f2: Floats) -> tuple[float, float]:
    """Sums over the touching nodes, where f2 - f1 - y > 0, of: gap, 1."""
    force = 0.0
    touching = 0.0
    for j in range(f1.size):
        gap = f2[j + 3] - f1[j] - y
        touch = 1.0 if gap > 0.0 else 0.0
        gap = gap if gap > 0.0 else 0.0
        force += gap
        touching += touch
    return force, touching


@kernel(fastmath=FAST)
def _add_parts(even: Floats, odd: Floats, table: Floats, s: float, c: float) -> None:
    """Add the wave s g cos(ωξ) + c g sin(ωξ), with s = sin ψ and c = cos ψ: its even part and its odd part."""
    for j in range(even.size):
        even[j] += s * table[j + TILE]
        odd[j] += c * table[j]


@kernel(fastmath=FAST)
def _add_five_parts(even: Floats, odd: Floats, table: Floats, s: Floats, c: Floats) -> None:
    """`_add_five`, with what is even in ξ and what is odd apart."""
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


@kernel(fastmath=FAST)
def _pressed_both(y: float, f1: Floats, even: Floats, odd: Floats) -> tuple[float, float]:
    """Sums over the touching nodes of a tile and of those opposite: gap, 1."""
    force = 0.0
    touching = 0.0
    for j in range(even.size):
        one = even[j] + odd[j] - f1[j] - y
        other = even[j] - odd[j] - f1[j + TILE] - y
        touching += (1.0 if one > 0.0 else 0.0) + (1.0 if other > 0.0 else 0.0)
        force += (one if one > 0.0 else 0.0) + (other if other > 0.0 else 0.0)
    return force, touching


@kernel(inline=False)
def _press_halves(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> tuple[float, float]:
    """As `_pressed`. What is even in f2 and what is odd give two opposite heights from the tables of one node."""
    pad = layer.pad
    sines_at, cosines_at = phases(x, layer, tables, scratch)
    sines = scratch[sines_at:cosines_at]
    cosines = scratch[cosines_at : 2 * cosines_at - sines_at]
    n = pad.nodes
    waves = pad.wheel_terms
    at = pad.waves_at
    force = 0.0
    touching = 0.0
    left = (n + 1) // 2 + BESIDE
    for opposite in range(pad.opposite_at, pad.opposite_at + n + 2 * BESIDE, 2 * TILE):
        if stopped(pad.signals):
            break
        columns = min(TILE, (left + 7) // 8 * 8)
        i = 0
        even = scratch[:columns]
        odd = scratch[TILE : TILE + columns]
        left = left - TILE
        for j in range(columns):
            even[j] = odd[j] = 0.0
        while i + 5 <= waves:
            _add_five_parts(even, odd, tables[at : at + 10 * TILE], sines[i : i + 5], cosines[i : i + 5])
            i = i + 5
            at = at + 10 * TILE
        while i < waves:
            _add_parts(even, odd, tables[at : at + 2 * TILE], sines[i], cosines[i])
            i = i + 1
            at = at + 2 * TILE
        more, touch = _pressed_both(y, tables[opposite : opposite + 2 * TILE], even, odd)
        force = force + more
        touching = touching + touch
    return force, touching


@kernel(inline=False)
def left_out(y: float, layer: Layer, tables: Floats, scratch: Floats) -> float:
    """What the rule leaves out of F_y (N) at the edges of patches, with the heights of the last `evaluate`.

    An edge at the part θ of the way between two nodes, whose gaps are g > 0 and g' < 0, cuts a cell: where the gap
    is straight, it holds (g - g')(θ - 1/2)²/2 spacings more than its mean. With θ = g/(g - g') that is
    (g + g')²/8(g - g'). What is left falls with the third power of the spacing. A patch, or a hole, that lies
    between nodes is that of a parabola with the bend d = g_1 - 2 g_2 + g_3 and the extreme value m: it holds
    4/3 |m| √(2|m/d|) spacings. The mean of its cell is d/24 above the gap in the middle.
    """
    pad = layer.pad
    n = layer.pad.nodes
    edges = 0.0
    hidden = 0.0
    f1 = tables[pad.nodes_at : pad.nodes_at + n]
    f2 = scratch[BESIDE : BESIDE + n]
    before = f2[0] - f1[0] - y
    gap = f2[1] - f1[1] - y
    if gap * before < 0.0:
        edges += (gap + before) ** 2 / abs(gap - before)
    for j in range(2, n):
        after = f2[j] - f1[j] - y
        bend = before - 2.0 * gap + after
        if after * gap < 0.0:
            edges += (after + gap) ** 2 / abs(after - gap)
        elif 6.0 * abs(gap) < abs(bend) and bend * gap > 0.0 and gap * before > 0.0:
            extreme = gap - bend / 24.0 - 0.125 * (after - before) ** 2 / bend
            if extreme * gap < 0.0:
                hidden += abs(extreme) * math.sqrt(2.0 * abs(extreme / bend))
        before = gap
        gap = after
    return pad.k * (2.0 * pad.half_length / n) * (0.125 * edges + 4.0 / 3.0 * hidden)  # type: ignore[no-any-return]


@kernel
def press(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """`evaluate` where normal force, stiffness and fraction are enough; the same but for rounding.

    F_y = k 2a/n Σ gap over the touching nodes, (2), and -∂F_y/∂y = k 2a/n times their number.
    """
    pad = layer.pad
    contact = layer.contact
    if layer.window.rows > 0:
        profiles(x, layer, tables, scratch)
        force, touching = _pressed(y, tables[pad.nodes_at : pad.nodes_at + pad.nodes], scratch)
    else:
        force, touching = _press_halves(x, y, layer, tables, scratch)
    spacing = 2.0 * pad.half_length / pad.nodes
    contact.normal_force = pad.k * spacing * force  # Eq. (2)
    contact.stiffness = pad.k * spacing * touching
    contact.fraction = touching / pad.nodes
    contact.kind = MIDPOINT
    contact.valid = 1


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See the package. The error falls with the square of the spacing, by its kinks at the edges of patches;
    ∂F_y/∂x and ∂V/∂x take the rise of f2 from the neighbouring nodes.
    """
    pad = layer.pad
    contact = layer.contact
    n = layer.pad.nodes
    profiles(x, layer, tables, scratch)
    f1 = tables[pad.nodes_at : pad.nodes_at + n]
    if stopped(pad.signals):  # the heights are not complete, and their sums would take as long as a step may
        f1 = f1[:0]
    force, touching, rise, square, work, near = _sums(y, contact.reach, f1, scratch)
    k = pad.k
    spacing = 2.0 * pad.half_length / n
    contact.normal_force = k * spacing * force  # Eq. (2)
    contact.stiffness = k * spacing * touching
    contact.tangential = k * rise
    contact.fraction = touching / n
    contact.store = 0.5 * k * spacing * square
    contact.store_x = k * work
    contact.kind = MIDPOINT
    contact.valid = 1
    contact.near = k * spacing * near
    contact.blur = contact.stiffness * pad.rise_error
