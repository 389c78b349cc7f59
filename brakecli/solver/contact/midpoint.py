"""The contact by the midpoint rule on cell means: the quadrature for pads that touch in part."""

import math

import numpy as np
from numba import float64, types, void
from numpy.typing import NDArray

from brakecli.solver.compile import (
    EVALUATE,
    FRACTION,
    KIND,
    NORMAL_FORCE,
    SCRATCH,
    STIFFNESS,
    STORE,
    STORE_X,
    TANGENTIAL,
    VALID,
    kernel,
    vector,
)
from brakecli.solver.contact.pad import AT_COS, AT_NODES, AT_SIN, AT_WHEEL, HALF, NODES, WHEEL_TERMS, K

_SUMS = types.UniTuple(float64, 5)(float64, vector, vector)
_FAST = frozenset({"reassoc", "contract", "nsz"})


@kernel(_SUMS, fastmath=_FAST)
def _sums(y: float, f1: NDArray[np.float64], f2: NDArray[np.float64]) -> tuple[float, float, float, float, float]:
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
def _add_wave(
    sine: float,
    cosine: float,
    sines: NDArray[np.float64],
    cosines: NDArray[np.float64],
    f2: NDArray[np.float64],
) -> None:
    """Add g sin(ωξ + ψ) at the nodes, by addition from the tables of g sin(ωξ) and g cos(ωξ)."""
    for j in range(f2.size):
        f2[j] += cosine * sines[j] + sine * cosines[j]


@kernel(EVALUATE)
def evaluate(
    x: float, y: float, angles: NDArray[np.float64], pad: NDArray[np.float64], contact: NDArray[np.float64]
) -> None:
    """See the package. The error falls with the square of the spacing, by its kinks at the edges of patches;
    ∂F_y/∂x and ∂V/∂x take the rise of f2 from the neighbouring nodes.
    """
    n, terms = int(pad[NODES]), int(pad[WHEEL_TERMS])
    at_omega, at_sin, at_cos = int(pad[AT_WHEEL]) + terms, int(pad[AT_SIN]), int(pad[AT_COS])
    at_f1, columns = int(pad[AT_NODES]), n + 2
    f2 = contact[SCRATCH : SCRATCH + columns]
    f2[:] = 0.0
    for i in range(terms):
        psi = pad[at_omega + i] * x + angles[i]
        sines = pad[at_sin + i * columns : at_sin + (i + 1) * columns]
        cosines = pad[at_cos + i * columns : at_cos + (i + 1) * columns]
        _add_wave(math.sin(psi), math.cos(psi), sines, cosines, f2)
    force, touching, rise, square, work = _sums(y, pad[at_f1 : at_f1 + columns], f2)
    k, spacing = pad[K], 2.0 * pad[HALF] / n
    contact[NORMAL_FORCE] = k * spacing * force
    contact[STIFFNESS] = k * spacing * touching
    contact[TANGENTIAL] = k * rise
    contact[FRACTION] = touching / n
    contact[STORE] = 0.5 * k * spacing * square
    contact[STORE_X] = k * work
    contact[KIND] = 1.0
    contact[VALID] = 1.0
