"""The contact by the midpoint rule on cell means: the quadrature for pads that touch in part.

The tables and the loops over them are cut into tiles of a constant number of nodes, which the compiler lays out
without a loop. Reassociation lets it keep several partial sums side by side; no test in here depends on signed
zeros or on the order of additions. Both together make it about as fast as C for one number of waves and nodes.
"""

from numba import float64, types

from brakecli.solver.compile import FAST, Floats, borrowed, kernel, vector
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.heights import profiles
from brakecli.solver.records import EVALUATE, Layer


@kernel(types.UniTuple(float64, 6)(float64, float64, vector, vector), fastmath=FAST)
def _sums(y: float, reach: float, f1: Floats, f2: Floats) -> tuple[float, float, float, float, float, float]:
    """Sums over the touching nodes of: gap, 1, rise of f2 across the cell, gap², gap times rise; and the number of
    nodes where the gap is within reach of zero. The rise is that of a polynomial through six neighbours.
    """
    force, touching, rise, square, work, near = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
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


@kernel(types.UniTuple(float64, 2)(float64, vector, vector), fastmath=FAST)
def _pressed(y: float, f1: Floats, f2: Floats) -> tuple[float, float]:
    """Sums over the touching nodes of: gap, 1."""
    force, touching = 0.0, 0.0
    for j in range(f1.size):
        gap = f2[j + 3] - f1[j] - y
        touch = 1.0 if gap > 0.0 else 0.0
        gap = gap if gap > 0.0 else 0.0
        force += gap
        touching += touch
    return force, touching


@kernel(EVALUATE)
def press(x: float, y: float, layer: Layer) -> None:
    """`evaluate` where normal force, stiffness and fraction are enough."""
    layer = borrowed(layer)
    pad, contact = layer.pad, layer.contact
    force, touching = _pressed(y, *profiles(x, layer))
    spacing = 2.0 * pad.half_length / pad.nodes
    contact.normal_force = pad.k * spacing * force  # Eq. (2)
    contact.stiffness = pad.k * spacing * touching
    contact.fraction = touching / pad.nodes
    contact.kind, contact.valid = MIDPOINT, 1


@kernel(EVALUATE)
def evaluate(x: float, y: float, layer: Layer) -> None:
    """See the package. The error falls with the square of the spacing, by its kinks at the edges of patches;
    ∂F_y/∂x and ∂V/∂x take the rise of f2 from the neighbouring nodes.
    """
    layer = borrowed(layer)
    pad, contact, n = layer.pad, layer.contact, layer.pad.nodes
    f1, f2 = profiles(x, layer)
    force, touching, rise, square, work, near = _sums(y, contact.reach, f1, f2)
    k, spacing = pad.k, 2.0 * pad.half_length / n
    contact.normal_force = k * spacing * force  # Eq. (2)
    contact.stiffness = k * spacing * touching
    contact.tangential = k * rise
    contact.fraction = touching / n
    contact.store = 0.5 * k * spacing * square
    contact.store_x = k * work
    contact.kind, contact.valid = MIDPOINT, 1
    contact.near, contact.blur = k * spacing * near, contact.stiffness * pad.rise_error
