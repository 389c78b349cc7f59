"""The contact by the midpoint rule on cell means: the quadrature for pads that touch in part."""

import math

from numba import float64, types, void

from brakecli.solver.compile import Floats, kernel, stopped, vector
from brakecli.solver.contact import MIDPOINT
from brakecli.solver.records import EVALUATE, Layer

_SUMS = types.UniTuple(float64, 5)(float64, vector, vector)
_FAST = frozenset({"reassoc", "contract", "nsz"})


@kernel(_SUMS, fastmath=_FAST)
def _sums(y: float, f1: Floats, f2: Floats) -> tuple[float, float, float, float, float]:
    """Sums over the touching nodes of: gap, 1, rise of f2 across the cell, gap², gap times rise.

    Reassociation lets the compiler keep several partial sums side by side; no test in here depends on signed
    zeros or on the order of additions.
    """
    force, touching, rise, square, work = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(f1.size - 2):
        gap = f2[j + 1] - f1[j + 1] - y
        touch = 1.0 if gap > 0.0 else 0.0
        gap = gap if gap > 0.0 else 0.0
        across = f2[j + 2] - f2[j]
        force += gap
        touching += touch
        rise += touch * across
        square += gap * gap
        work += gap * across
    return force, touching, 0.5 * rise, square, 0.5 * work


@kernel(void(float64, float64, vector, vector, vector))
def _add_wave(sine: float, cosine: float, sines: Floats, cosines: Floats, f2: Floats) -> None:
    """Add g sin(ωξ + ψ) at the nodes, by addition from the tables of g sin(ωξ) and g cos(ωξ)."""
    for j in range(f2.size):
        f2[j] += cosine * sines[j] + sine * cosines[j]


@kernel(EVALUATE)
def evaluate(x: float, y: float, layer: Layer) -> None:
    """See the package. The error falls with the square of the spacing, by its kinks at the edges of patches;
    ∂F_y/∂x and ∂V/∂x take the rise of f2 from the neighbouring nodes.
    """
    pad, tables, contact, angles = layer.pad, layer.tables, layer.contact, layer.angles
    n, columns, omega_at = pad.nodes, pad.nodes + 2, pad.wheel_at + pad.wheel_terms
    f2 = layer.scratch[:columns]
    f2[:] = 0.0
    for i in range(pad.wheel_terms):
        if stopped(pad.signals):
            return
        psi = tables[omega_at + i] * x + angles[i]
        sines = tables[pad.sin_at + i * columns : pad.sin_at + (i + 1) * columns]
        cosines = tables[pad.cos_at + i * columns : pad.cos_at + (i + 1) * columns]
        _add_wave(math.sin(psi), math.cos(psi), sines, cosines, f2)
    f1 = tables[pad.nodes_at : pad.nodes_at + columns]
    force, touching, rise, square, work = _sums(y, f1, f2)
    k, spacing = pad.k, 2.0 * pad.half_length / n
    contact.normal_force = k * spacing * force  # Eq. (2)
    contact.stiffness = k * spacing * touching
    contact.tangential = k * rise
    contact.fraction = touching / n
    contact.store = 0.5 * k * spacing * square
    contact.store_x = k * work
    contact.kind, contact.valid = MIDPOINT, 1
