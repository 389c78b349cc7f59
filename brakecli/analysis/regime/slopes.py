"""What the slopes of passing waves do to the growth of a small vibration in full contact: Hill's method.

A small motion δx changes the phase of each wave, and with it the normal force by K s(t) δx, where s is the slope
of the wheel's surface, as the pad feels it. The coefficients of the linear equations then repeat with the waves:
ż = (A + K s(t) P) z. A solution is e^{λt} times terms e^{iΩt} of all sums Ω of their frequencies, which is an
eigenvalue problem for λ. Sums of a few frequencies are kept.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST_WAVES, _MOST_SUMS = 4, 41  # with which sums of two frequencies are kept
_HIGHEST = 4  # frequencies in a sum
_OWN = 0.2  # least part of an eigenvector at the sum 0: others are copies, moved by a frequency and cut off
_NEGLIGIBLE = 1e-3  # part of the growth rate
_DEFECTIVE = 1e8  # condition of eigenvectors that hardly differ

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
Sum = tuple[int, ...]


def growth_with_slopes(
    a: Floats, p: Floats, frequencies: Floats, slopes: Complex, bends: Complex
) -> tuple[float, float]:
    """Growth rate (1/s) of the fastest solution of ż = (A + K s(t) P) z, and how far it may be off.

    Each wave passes at a frequency (rad/s). Its `slopes` (N/m) are K s = Re Σ slopes e^{iΩt} at rest; the forced
    motion x = Im Σ X e^{iΩt} moves its phase by `bends` = ω X.
    """
    scale = np.repeat([float(np.abs(np.linalg.eigvals(a)).max()) or 1.0, 1.0], 2)  # of position beside velocity
    a, p = (scale[:, None] * each / scale for each in (a, p))
    values, vectors = np.linalg.eig(a)
    plain = float(values.real.max())
    modal = np.linalg.cond(vectors) < _DEFECTIVE
    effects = np.abs(slopes) * np.linalg.norm(np.linalg.solve(vectors, p @ vectors) if modal else p, 2)
    if modal and float(effects.sum()) <= _NEGLIGIBLE * abs(plain):  # a bound of what the waves change
        return plain, float(effects.sum())
    steepest = np.argsort(-effects)
    few = min(len(steepest), _MOST_WAVES)
    kept, left = steepest[:few], float(effects[steepest[few:]].sum())
    order = next(n for n in range(_HIGHEST, 0, -1) if len(_sums(few, n)) <= _MOST_SUMS)
    terms = _terms(slopes[kept], bends[np.ix_(kept, kept)])
    omega = frequencies[kept]
    coarse, fine = (_fastest(a, p, omega, terms, n) for n in (order - 1, order))
    bent = float(np.abs(bends[np.ix_(kept, kept)]).sum(axis=1).max())
    return fine, left + abs(fine - coarse) + bent * abs(fine - plain)


def _sums(waves: int, order: int) -> list[Sum]:
    """How often each wave's frequency enters a sum of at most so many."""
    if waves == 0:
        return [()]
    return [(n, *rest) for n in range(-order, order + 1) for rest in _sums(waves - 1, order - abs(n))]


def _terms(slopes: Complex, bends: Complex) -> dict[Sum, complex]:
    """K s(t) as a sum over e^{iΩt}, up to products of two waves: cos(θ + δ) = cos θ - δ sin θ."""
    terms, unit = dict[Sum, complex](), np.eye(len(slopes), dtype=int)

    def add(where: Any, amount: complex) -> None:
        for each, part in ((where, amount), (-where, np.conj(amount))):
            terms[tuple(each.tolist())] = terms.get(tuple(each.tolist()), 0.0) + part

    for j, slope in enumerate(slopes):
        add(unit[j], 0.5 * slope)
        for k, bend in enumerate(bends[j]):
            add(unit[j] + unit[k], 0.25 * slope * bend)
            add(unit[j] - unit[k], -0.25 * slope * np.conj(bend))
    return terms


def _fastest(a: Any, p: Any, omega: Any, terms: dict[Sum, complex], order: int) -> float:
    """Growth rate (1/s) with sums of at most so many frequencies."""
    sums = _sums(len(omega), order)
    where = {each: i for i, each in enumerate(sums)}
    matrix = np.zeros((len(sums), 4, len(sums), 4), complex)
    for each, i in where.items():
        matrix[i, :, i] += a - 1j * float(np.dot(each, omega)) * np.eye(4)
        for change, amount in terms.items():
            j = where.get(tuple(n - m for n, m in zip(each, change, strict=True)))
            if j is not None:
                matrix[i, :, j] += amount * p
    values, vectors = np.linalg.eig(matrix.reshape(4 * len(sums), -1))
    own = slice(4 * where[(0,) * len(omega)], 4 * where[(0,) * len(omega)] + 4)
    try:
        share = np.abs(np.sum(vectors[own] * np.linalg.inv(vectors)[:, own].T, axis=0))
    except np.linalg.LinAlgError:
        return math.nan
    near = np.argsort(share)
    return float(values[(share >= _OWN) | (share >= share[near[-4]])].real.max())
