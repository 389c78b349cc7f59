"""The contact with a gap that is straight in each cell: the quadrature for pads that touch in part.

Heights at the edges of a cell are such that their mean is that of the surface over the cell (`pad.flattened`).
The edges of patches then lie within cells, and the force is continuously differentiable. In full contact it is the
closed form; an edge of a patch costs an error of third power in the length of a cell, see `left_out`.

Reassociation lets the compiler keep several partial sums side by side; no test in here depends on signed zeros or
on the order of additions.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import CELLS
from brakecli.solver.contact.heights import gaps, rises
from brakecli.solver.contact.pad import BESIDE
from brakecli.solver.kernels import FAST, kernel
from brakecli.solver.records import Layer

_TINY = 1e-300  # m, least difference of the gaps at both edges of a cell: nothing is divided by zero


@kernel(fastmath=FAST)
def _cell(high: float, low: float) -> tuple[float, float, float, float]:
    """From the larger gap h at both edges and the smaller one l: the part θ of the cell that touches, h⁺, l⁺, and
    1/(h - l). θ is 1, h/(h - l) or 0; h⁺ and l⁺ are 0 where the gap is negative.
    """
    inverse = np.divide(1.0, high - low if high - low > _TINY else _TINY)
    deep = high if high > 0.0 else 0.0
    shallow = low if low > 0.0 else 0.0
    return 1.0 if low > 0.0 else deep * inverse, deep, shallow, inverse


@kernel(fastmath=FAST)
def _pressed(y: float, gap: Floats) -> tuple[float, float]:
    """The first two of `_sums`."""
    force = 0.0
    touching = 0.0
    for j in range(gap.size - 1):
        one = gap[j] - y
        two = gap[j + 1] - y
        theta, deep, shallow, _ = _cell(one if one > two else two, two if one > two else one)
        force += theta * (deep + shallow)
        touching += theta
    return 0.5 * force, touching


@kernel(fastmath=FAST)
def _pressed_steeply(y: float, gap: Floats, rises: Floats) -> tuple[float, float, float]:
    """The first two of `_sums`, and its rise."""
    force = 0.0
    touching = 0.0
    rise = 0.0
    for j in range(gap.size - 1):
        one = gap[j] - y
        two = gap[j + 1] - y
        falls = one > two
        rise_one = rises[j]
        rise_two = rises[j + 1]
        theta, deep, shallow, _ = _cell(one if falls else two, two if falls else one)
        force += theta * (deep + shallow)
        touching += theta
        turn = rise_one - rise_two
        rise += theta * (rise_one + rise_two + (1.0 - theta) * (turn if falls else -turn))
    return 0.5 * force, touching, 0.5 * rise


@kernel(fastmath=FAST, inline=False)
def _sums(y: float, reach: float, gap: Floats, rises: Floats) -> tuple[float, float, float, float, float, float]:
    """Integrals over the touching parts, in cells: of gap, 1, gap², f2', gap f2', the latter two times a cell; and
    the part within reach of a gap of zero. They are sums of θ (h⁺ + l⁺)/2, θ, θ (h⁺² + h⁺ l⁺ + l⁺²)/3, and the
    derivatives of the first and of half the third by x. By h and l these are θ (2 - θ)/2, θ²/2 and
    (θ h⁺ (3 - θ) + l⁺)/6, (θ² h⁺ + 2 l⁺)/6.
    """
    force = 0.0
    touching = 0.0
    square = 0.0
    rise = 0.0
    work = 0.0
    near = 0.0
    for j in range(gap.size - 1):
        one = gap[j] - y
        two = gap[j + 1] - y
        falls = one > two
        high = one if falls else two
        low = two if falls else one
        rise_one = rises[j]
        rise_two = rises[j + 1]
        of_high = rise_one if falls else rise_two
        of_low = rise_two if falls else rise_one
        theta, deep, shallow, inverse = _cell(high, low)
        force += theta * (deep + shallow)
        touching += theta
        square += theta * (deep * deep + deep * shallow + shallow * shallow)
        rise += theta * ((2.0 - theta) * of_high + theta * of_low)
        work += (theta * deep * (3.0 - theta) + shallow) * of_high + (
            theta * theta * deep + 2.0 * shallow
        ) * of_low
        within = (high if high < reach else reach) - (low if low > -reach else -reach)
        within = within if within > _TINY else _TINY
        near += (within if high >= -reach and low <= reach else 0.0) * inverse
    return 0.5 * force, touching, square / 3.0, 0.5 * rise, work / 6.0, near


@kernel
def _bent(mean: float, slope: float, bend: float) -> float:
    """What is positive of a parabola over a cell, ∫ max(m + p u + b (u² - 1/12)/2, 0) du from -1/2 to 1/2."""
    middle = mean - bend / 24.0
    square = slope * slope - 2.0 * bend * middle
    if square <= 0.0 or bend == 0.0:
        return mean if middle > 0.0 else 0.0
    to_roots = -(slope + math.copysign(math.sqrt(square), slope))
    one = to_roots / bend
    two = 2.0 * middle / to_roots if to_roots != 0.0 else 0.0
    low = min(max(min(one, two), -0.5), 0.5)
    high = min(max(max(one, two), -0.5), 0.5)
    both = low + high
    between = middle + 0.5 * slope * both + bend / 6.0 * (both * both - low * high)
    between = between * (high - low)
    return between if bend < 0.0 else mean - between


@kernel(inline=False)
def left_out(y: float, layer: Layer, scratch: Floats) -> float:
    """What straight cells leave out of F_y (N), with the gaps of the last evaluation.

    With the neighbouring edges a gap is m + p u + b (u² - 1/12)/2 + c u³/6 in a cell, -1/2 <= u <= 1/2. Where it
    is straight instead, its mean m is the same and its slope p - c/24. What is positive of the parabola is known,
    patches and holes within a cell included. An edge at u takes c (u⁴/24 + u²/48 - 1/128) more from the side that
    touches. The first is of third power: it is small, as b is where a gap is zero, and an edge that moves takes it
    back. The second is of fourth power.
    """
    pad = layer.pad
    gap = scratch[BESIDE - 1 : BESIDE + pad.nodes + 2]
    total = 0.0
    before = gap[0] - y
    one = gap[1] - y
    two = gap[2] - y
    for j in range(pad.nodes):
        after = gap[j + 3] - y
        bend = 0.5 * (before - one - two + after)
        cut = one * two < 0.0
        if cut or 12.0 * min(abs(one), abs(two)) < abs(bend):
            theta, deep, shallow, _ = _cell(max(one, two), min(one, two))
            mean = 0.5 * (one + two)
            total += _bent(mean, two - one, bend) - 0.5 * theta * (deep + shallow)
            if cut:
                u = mean / (one - two)
                turn = after - before - 3.0 * (two - one)
                total += math.copysign(turn, turn * one) * (u * u * (u * u / 24.0 + 1.0 / 48.0) - 1.0 / 128.0)
        before = one
        one = two
        two = after
    return pad.k * (2.0 * pad.half_length / pad.nodes) * total


@kernel(inline=False)
def extreme_gap(
    x: float, y: float, everywhere: bool, layer: Layer, tables: Floats, scratch: Floats
) -> tuple[float, float]:
    """The gap f2 - f1 - y at an edge, and the slope of f2 there: the least gap, zero where all begins to touch
    `everywhere`, or the largest one, zero where something begins to touch.
    """
    pad = layer.pad
    rises(x, layer, tables, scratch)
    sign = -1.0 if everywhere else 1.0
    most = -math.inf
    edge = 0
    for j in range(pad.nodes + 1):
        gap = sign * (scratch[BESIDE + j] - y)
        if gap > most:
            most = gap
            edge = j
    return sign * most, scratch[pad.parts_at + edge] * (pad.nodes / (2.0 * pad.half_length))


@kernel
def note(kind: int, force: float, touching: float, layer: Layer) -> None:
    """Force, stiffness and fraction from the first two of `_sums`."""
    pad = layer.pad
    contact = layer.contact
    cell = 2.0 * pad.half_length / pad.nodes
    contact.normal_force = pad.k * cell * force  # Eq. (2)
    contact.stiffness = pad.k * cell * touching
    contact.fraction = touching / pad.nodes
    contact.kind = kind
    contact.valid = 1


@kernel
def note_more(square: float, rise: float, work: float, near: float, layer: Layer) -> None:
    """What else is found, from the others."""
    pad = layer.pad
    contact = layer.contact
    cell = 2.0 * pad.half_length / pad.nodes
    contact.tangential = pad.k * rise
    contact.store = 0.5 * pad.k * cell * square
    contact.store_x = pad.k * work
    contact.near = pad.k * cell * near
    contact.blur = contact.stiffness * pad.rise_error


@kernel
def press(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats, steeply: bool) -> None:
    """`evaluate` where normal force, stiffness and fraction are enough, and ∂F_y/∂x where it is asked for
    `steeply`; the same but for rounding.
    """
    pad = layer.pad
    n = layer.pad.nodes
    gap = scratch[BESIDE : BESIDE + n + 1]
    if steeply:
        rises(x, layer, tables, scratch)
        slopes = scratch[pad.parts_at : pad.parts_at + n + 1]
        force, touching, rise = _pressed_steeply(y, gap, slopes)
        layer.contact.tangential = pad.k * rise
    else:
        gaps(x, layer, tables, scratch)
        force, touching = _pressed(y, gap)
    note(CELLS, force, touching, layer)


@kernel
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See the package. ∂F_y/∂x and ∂V/∂x take the slope of f2 from the neighbouring edges."""
    pad = layer.pad
    n = layer.pad.nodes
    rises(x, layer, tables, scratch)
    gap = scratch[BESIDE : BESIDE + n + 1]
    slopes = scratch[pad.parts_at : pad.parts_at + n + 1]
    force, touching, square, rise, work, near = _sums(y, layer.contact.reach, gap, slopes)
    note(CELLS, force, touching, layer)
    note_more(square, rise, work, near, layer)
