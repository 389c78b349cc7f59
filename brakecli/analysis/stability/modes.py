"""Linear stability of steady sliding: eigenvalues, modes and the critical friction coefficient.

Linearised about steady sliding with U ≠ 0, (6)-(7) read m z̈ + B ż + S z = 0 with the contact's stiffness K and
S = [[cxx, cxy + sign(U) φ K], [cxy, cyy + K]]. Friction makes S unsymmetric: two modes can meet and flutter, or
the wedge that friction and links form can lock (divergence).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients

Complex = NDArray[np.complex128]
Tensor = tuple[Any, Any, Any]


@dataclass(frozen=True)
class Mode:
    """One mode of the linearised motion."""

    growth: float  # rate, 1/s
    frequency: float  # Hz
    damping_ratio: float  # negative where it grows
    shape: float | None  # y/x, None where x does not move
    shape_phase: float | None  # of y/x, deg


@dataclass(frozen=True)
class Crossing:
    """A friction coefficient at which stability changes, by flutter or divergence, at which frequency (Hz)."""

    friction: float
    instability: str
    frequency: float
    lost: bool  # or regained


def stiffness_matrix(c: Coefficients, contact_stiffness: float | Floats, grip: float | Floats) -> Floats:
    """S, N/m, with the contact stiffness K (N/m) and grip = sign(U) φ, for one system or a matrix for each."""
    return _matrix(c.c_xx, c.c_xy + grip * contact_stiffness, c.c_xy, c.c_yy + contact_stiffness)


def damping_matrix(c: Coefficients) -> Floats:
    """B, N s/m."""
    return _matrix(c.b_xx, c.b_xy, c.b_xy, c.b_yy)


def _matrix(*entries: float | Floats) -> Floats:
    """A matrix of two rows of its four entries, or one for each of their values."""
    matrix = np.empty((*np.shape(entries[1]), 2, 2))
    matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 1, 0], matrix[..., 1, 1] = entries
    return matrix


def first_order(c: Coefficients, s: Floats) -> Floats:
    """A of ż = A z for x, y, vx, vy, from S/m."""
    a = np.zeros((*s.shape[:-2], 4, 4))
    a[..., 0, 2] = a[..., 1, 3] = 1.0
    a[..., 2:, :2] = -s
    a[..., 2:, 2:] = -damping_matrix(c) / np.asarray(c.m)[..., None, None]
    return a


def locks_from(c: Coefficients, contact_stiffness: float, belt: float) -> float:
    """The friction coefficient from which a shoe that sticks for long never slips again; or infinity.

    The wheel carries it along: with x grow the force that the links ask for, (c_xx - c_xy²/(c_yy + K)) |x|, and
    the one that friction offers, φ K c_xy sign(U) |x|/(c_yy + K). From there on S has a negative determinant.
    """
    presses = math.copysign(contact_stiffness, belt) * c.c_xy
    asks = c.c_xx * (c.c_yy + contact_stiffness) - c.c_xy**2
    return asks / presses if presses > 0.0 else math.inf


def is_undamped(c: Coefficients) -> bool:
    """Whether no dashpot acts at all: then what is stable is only marginally so."""
    return c.b_xx == 0.0 and c.b_yy == 0.0


def slowest_of_cycles(c: Coefficients) -> float:
    """Rate (1/s) that the slowest disturbance of a limit cycle without stick decays at, at most.

    Dashpots alone shrink volumes in phase space, at (b1 + b2)/m, which its three disturbances share.
    """
    return (c.b_xx + c.b_yy) / (3.0 * c.m)


@lru_cache(maxsize=4)
def eigensystem(c: Coefficients, contact_stiffness: float, grip: float) -> tuple[Complex, Complex]:
    """The four eigenvalues (1/s) and the displacement parts of their vectors, in columns.

    Without dashpots they are square roots of the eigenvalues of -S/m, so that a marginal motion has no spurious
    growth from rounding.
    """
    s = stiffness_matrix(c, contact_stiffness, grip) / c.m
    if is_undamped(c):
        trace = s[0, 0] + s[1, 1]
        determinant = s[0, 0] * s[1, 1] - s[0, 1] * s[1, 0]
        root = np.emath.sqrt((0.5 * (s[0, 0] - s[1, 1])) ** 2 + s[0, 1] * s[1, 0])
        large = 0.5 * trace + root
        squares = np.array([large, determinant / large if large != 0.0 else 0.5 * trace - root], dtype=complex)
        vectors = np.array([_null_vector(s, square) for square in squares]).T
        roots = np.sqrt(-squares)
        return np.concatenate([roots, -roots]), np.concatenate([vectors, vectors], axis=1)
    values, vectors = np.linalg.eig(first_order(c, s))
    return values.astype(complex), vectors[:2].astype(complex)


def _null_vector(s: Floats, square: complex) -> Complex:
    """The vector with (S/m - square) v = 0, from the larger row."""
    rows = s - square * np.eye(2)
    row = rows[np.argmax(np.abs(rows).sum(axis=1))]
    vector = np.array([-row[1], row[0]], dtype=complex)
    size = np.linalg.norm(vector)
    return vector / size if size > 0.0 else np.array([1.0, 0.0], dtype=complex)


def modes(c: Coefficients, contact_stiffness: float, grip: float) -> list[Mode]:
    """The modes, the one that grows fastest (decays slowest) first; a pair of eigenvalues is one mode."""
    return modes_of(*eigensystem(c, contact_stiffness, grip))


def modes_of(values: Complex, vectors: Complex) -> list[Mode]:
    """The modes with these eigenvalues and vectors, in this order."""
    unsorted = [_mode(value, vector) for value, vector in zip(values, vectors.T, strict=True) if value.imag >= 0.0]
    return sorted(unsorted, key=lambda mode: -mode.growth)


def _mode(value: np.complex128, vector: Complex) -> Mode:
    value += 0.0  # without -0
    moves = abs(vector[0]) > 1e-12 * abs(vector[1])  # beyond rounding
    ratio = vector[1] / vector[0] if moves else 0.0
    return Mode(
        growth=float(value.real),
        frequency=float(value.imag / (2.0 * math.pi)),
        damping_ratio=float(-value.real / abs(value)) + 0.0 if value != 0.0 else 0.0,
        shape=float(abs(ratio)) if moves else None,
        shape_phase=float(np.degrees(np.angle(ratio))) if moves else None,
    )


def routh_hurwitz(m: Any, b: Tensor, c: Tensor, k: Any, grip: Any, *, damped: bool) -> list[Any]:
    """What is positive where all disturbances decay, U ≠ 0; b and c: xx, xy and yy of (6)-(7), grip = sign(U) φ.

    It takes all that can be added and multiplied. With S as in `modes`: its determinant; and Hurwitz'
    a1 a2 a3 - a1² a4 - a0 a3² over m, so ordered that nothing cancels but the difference of the
    stiffnesses. Without dashpots nothing decays, and two frequencies must not meet.
    """
    b_xx, b_xy, b_yy = b
    c_xx, c_xy, c_yy = c
    s_xy = c_xy + grip * k
    s_yy = c_yy + k
    product = s_xy * c_xy
    both = s_xy + c_xy
    gap = c_xx - s_yy
    trace = b_xx + b_yy
    if damped:
        quick = (b_xx * b_yy - b_xy**2) * trace * (b_xx * s_yy + b_yy * c_xx - b_xy * both)
        apart = m * ((b_xx * gap + b_xy * both) * (b_yy * gap - b_xy * both) + product * trace**2) + quick
    else:
        twice = product + product
        apart = gap**2 + (twice + twice)
    return [c_xx * s_yy - product, apart]


def growth(c: Coefficients, contact_stiffness: float, grip: float) -> float:
    """Growth rate (1/s) of the fastest disturbance; negative where all decay."""
    return float(eigensystem(c, contact_stiffness, grip)[0].real.max())


def crossings(c: Coefficients, contact_stiffness: float, belt: float) -> list[Crossing]:
    """Every φ > 0 at which stability changes, for a contact stiffness K (N/m) that does not depend on φ.

    det(m s² + B s + S) = a4 s⁴ + a3 s³ + a2 s² + a1 s + a0, of which only a1 and a0 contain φ, linearly. A real
    eigenvalue passes zero where a0 = 0; a pair passes the imaginary axis where Hurwitz' a1 a2 a3 - a1² a4 -
    a0 a3² = 0 with a1/a3 > 0. Without dashpots two imaginary pairs meet where a2² = 4 a4 a0.
    """
    if belt == 0.0 or not contact_stiffness > 0.0:
        return []
    pull = math.copysign(contact_stiffness, belt)
    s = stiffness_matrix(c, contact_stiffness, 0.0)
    a4 = c.m**2
    a3 = c.m * (c.b_xx + c.b_yy)
    a2 = c.m * (s[0, 0] + s[1, 1]) + c.b_xx * c.b_yy - c.b_xy**2
    a1 = np.array([c.b_xx * s[1, 1] + c.b_yy * s[0, 0] - 2.0 * c.b_xy * c.c_xy, -c.b_xy * pull])  # + φ ...
    a0 = np.array([s[0, 0] * s[1, 1] - c.c_xy**2, -c.c_xy * pull])
    candidates = [(phi, 0.0) for phi in _positive_roots(a0)]  # φ and ω², which is 0 for divergence
    if is_undamped(c):
        gap = 0.5 * (s[0, 0] - s[1, 1])  # a2² - 4 a4 a0 without the cancellation
        meeting = c.m**2 * 4.0 * np.array([gap**2 + c.c_xy**2, c.c_xy * pull])
        candidates += [(phi, 0.5 * a2 / a4) for phi in _positive_roots(meeting)]
    else:
        hurwitz = np.append(a2 * a3 * a1 - a3**2 * a0, 0.0) - a4 * np.convolve(a1, a1)
        turning = [(phi, (a1[0] + a1[1] * phi) / a3) for phi in _positive_roots(hurwitz)]
        candidates += [(phi, square) for phi, square in turning if square > 0.0]
    candidates.sort()
    edges = [0.0, *(phi for phi, _ in candidates), 2.0 * candidates[-1][0] if candidates else 0.0]
    middles = [0.5 * (low + high) for low, high in pairwise(edges)]
    unstable = [growth(c, contact_stiffness, math.copysign(phi, belt)) > 0.0 for phi in middles]
    return [
        Crossing(phi, "flutter" if square > 0.0 else "divergence", math.sqrt(square) / (2.0 * math.pi), after)
        for (phi, square), (before, after) in zip(candidates, pairwise(unstable), strict=True)
        if before != after  # between the candidate and its neighbours the sign of the growth really changes
    ]


def _positive_roots(coefficients: Floats) -> list[float]:
    """Real roots > 0 of a polynomial with rising powers; an imaginary part below 1e-9 is rounding."""
    scale = np.abs(coefficients).max()
    if scale == 0.0:
        return []
    roots = np.polynomial.polynomial.polyroots(np.trim_zeros(coefficients / scale, "b"))
    return [float(root.real) for root in roots if abs(root.imag) <= 1e-9 * abs(root) and root.real > 0.0]
