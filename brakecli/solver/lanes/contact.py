"""The contact of all lanes: the normal force, (2), and what nodes leave out of it."""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.lanes.records import ALIKE, LANES, WAVES, Lane, Shared
from brakecli.solver.lanes.steps import some
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.sine import sine_cosine


@kernel(fastmath=ALIKE)
def _sum(waves: Floats, n: int, table: Floats, j: int, first: int) -> float:
    """The sum of all waves in a lane by their factors in a row of a table."""
    total = 0.0
    for i in range(WAVES):
        total += waves[i, n] * table[j, first + i]
    return total


@kernel(fastmath=ALIKE)
def _add_nodes(o: Lane, table: Floats, gaps: Floats) -> None:
    """The midpoint sum of the gaps (m), how many nodes touch, and the gaps themselves.

    The gap at ξ is f2 - f1 - y, where f2 = Σ g (sin cos ωξ + cos sin ωξ) by the sine and cosine of each wave. What
    is even in ξ and what is odd give the gaps at ξ and -ξ from the table of one node.
    """
    for n in range(LANES):
        o.at_force[n] = o.touches[n] = 0.0
    for j in range(table.shape[0]):
        f1 = table[j, 0]
        opposite = table[j, 1]
        for n in range(LANES):
            odd = _sum(o.cosine, n, table, j, 2)
            even = _sum(o.sine, n, table, j, 2 + WAVES) - o.at_y[n]
            one = even + odd - f1
            other = even - odd - opposite
            o.at_force[n] += (one if one > 0.0 else 0.0) + (other if other > 0.0 else 0.0)
            o.touches[n] += (1.0 if one > 0.0 else 0.0) + (1.0 if other > 0.0 else 0.0)
            gaps[j + 2, n] = one
            gaps[j + 2, LANES + n] = other


@kernel(fastmath=ALIKE, inline=False)
def touch(o: Lane, shared: Shared, table: Floats, gaps: Floats, t: float) -> None:
    """The normal force, and the part that touches: in closed form where a bound proves it, or by nodes.

    F_y = k ∫ max(f2 - f1 - y, 0) dξ; of a pad that touches everywhere it is k (Σ wave sin - length (y + mean f1)).
    A wave of the wheel has the angle ωx + φ - 2π t times `turns` at the middle of the pad.
    """
    length = shared.length
    full = shared.full_up_to
    clear = shared.clear_from
    mean = shared.shoe_mean
    for i in range(WAVES):
        omega = shared.waves[0, i]
        phase = shared.waves[1, i]
        for n in range(LANES):
            turns = o.turns[i, n] * t
            angle = omega * o.at_x[n] + (phase - TWO_PI * (turns - np.floor(turns)))
            o.sine[i, n], o.cosine[i, n] = sine_cosine(angle)
    for n in range(LANES):
        o.partly[n] = 1.0 if full < o.at_y[n] and o.at_y[n] < clear else 0.0
    if some(o.partly):
        _add_nodes(o, table, gaps)
    weight = 1.0 / shared.nodes
    for n in range(LANES):
        whole = _sum(o.sine, n, shared.waves, 2, 0) - length * (o.at_y[n] + mean)
        closed = whole if whole > 0.0 and o.at_y[n] <= full else 0.0
        o.at_force[n] = o.k[n] * (length * weight * o.at_force[n] if o.partly[n] > 0.0 else closed)
        o.touches[n] = weight * o.touches[n] if o.partly[n] > 0.0 else 1.0 if o.at_y[n] <= full else 0.0


@kernel(fastmath=ALIKE)
def _hides(gaps: Floats, j: int, n: int) -> bool:
    """Whether the gap in the middle is so near zero beside its bend that a patch, or a hole, may lie beside it.

    Its bend g₋ - 2g + g₊ is more than six times g, and all three have one sign.
    """
    gap: float = gaps[j + 1, n]
    before: float = gaps[j, n] * gap
    after: float = gaps[j + 2, n] * gap
    return before + after > 8.0 * gap * gap and before > 0.0 and after >= 0.0


@kernel(fastmath=ALIKE)
def _hidden(gaps: Floats, j: int, n: int) -> float:
    """What three nodes leave out, in spacings: a patch, or a hole, between them.

    With the bend b = g₋ - 2g + g₊ a parabola has the extreme c = g - b/24 - (g₊ - g₋)²/(8b), and beyond its zeros
    the area 4/3 |c| √(2|c/b|).
    """
    gap = gaps[j + 1, n]
    bend = gaps[j, n] - 2.0 * gap + gaps[j + 2, n]
    inverse = 1.0 / bend if bend != 0.0 else 0.0
    extreme = gap - bend / 24.0 - 0.125 * (gaps[j + 2, n] - gaps[j, n]) ** 2 * inverse
    size = 4.0 / 3.0 * abs(extreme) * math.sqrt(2.0 * abs(extreme * inverse))
    return size if _hides(gaps, j, n) and extreme * gap < 0.0 else 0.0


@kernel(fastmath=ALIKE)
def _cut(gaps: Floats, j: int, n: int) -> tuple[float, float]:
    """What a cell with an edge leaves out, over an eighth of a spacing, as a fraction; 0/1 without one."""
    gap = gaps[j + 1, n]
    after = gaps[j + 2, n]
    return ((after + gap) ** 2, abs(after - gap)) if after * gap < 0.0 else (0.0, 1.0)


@kernel(fastmath=ALIKE, inline=False)
def leave_out(o: Lane, gaps: Floats, spacing: float) -> None:
    """`contact.cells.left_out` of pads that touch in part, where the contact was evaluated last.

    From both ends to the middle, where both halves find an edge: a pair of two such cells takes one division.
    """
    last = gaps.shape[0] - 1
    for n in range(LANES):
        gaps[last, n] = gaps[last - 1, LANES + n]
        gaps[last, LANES + n] = gaps[last - 1, n]
        o.missing[n] = 0.0
    for j in range(last - 1):
        share = 0.125 if j < last - 2 else 0.0625
        hidden = 0
        for n in range(LANES):
            one, over = _cut(gaps, j, n)
            other, under = _cut(gaps, j, LANES + n)
            hidden |= 1 if _hides(gaps, j, n) else 0
            hidden |= 1 if _hides(gaps, j, LANES + n) else 0
            both = over * under
            o.missing[n] += share * (one * under + other * over) / both if both != 0.0 else 0.0
        if hidden:
            for n in range(LANES):
                o.missing[n] += _hidden(gaps, j, n) + _hidden(gaps, j, LANES + n)
    for n in range(LANES):
        o.missing[n] = spacing * o.k[n] * o.missing[n] if o.partly[n] > 0.0 else 0.0
