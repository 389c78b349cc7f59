"""What the slopes of passing waves do to the growth of a small vibration in full contact: Hill's method.

A small motion δx changes the phase of each wave, and with it the normal force by K s(t) δx, where s is the slope
of the wheel's surface, as the pad feels it. The coefficients of the linear equations then repeat with the waves:
ż = (A + K s(t) P) z. A solution is e^{λt} times terms e^{iΩt} of all sums Ω of their frequencies, which is an
eigenvalue problem for λ. Sums of a few frequencies are kept.

P acts on x alone. So each sum enters by one number, how x answers a force there, and the sums beside 0 add
a stiffness to the mean one, T(λ): where they do not come near a mode, a few steps of λ = eigenvalue of A + T(λ) P
find it.
"""

import math
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST_WAVES, _MOST_SUMS = 4, 41  # with which sums of two frequencies are kept
_HIGHEST = 4  # frequencies in a sum
_OWN = 0.2  # least part of an eigenvector at the sum 0: others are copies, moved by a frequency and cut off
_NEGLIGIBLE = 1e-3  # part of the growth rate
_DEFECTIVE = 1e8  # condition of eigenvectors that hardly differ
_ALONE = 0.05  # by which the part at the sum 0 may differ from 1 where no other sum comes near a mode
_MOST_STEPS, _EXACT = 12, 1e-11  # of the iteration, and the part of the largest eigenvalue at which it ends

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
Sum = tuple[int, ...]


def growth_with_slopes(
    a: Floats, p: Floats, frequencies: Floats, slopes: Complex, bends: Complex
) -> tuple[float, float]:
    """Growth rate (1/s) of the fastest solution of ż = (A + K s(t) P) z, and how far it may be off.

    Each wave passes at a frequency (rad/s). Its `slopes` (N/m) are K s = Re Σ slopes e^{iΩt} at rest; the forced
    motion x = Im Σ X e^{iΩt} moves its phase by `bends` = ω X. `p` is the first column of P.
    """
    largest = float(np.abs(np.linalg.eigvals(a)).max()) or 1.0
    scale = np.array([largest, largest, 1.0, 1.0])  # of position beside velocity
    a, p = scale[:, None] * a / scale, scale * p / largest
    values, vectors = np.linalg.eig(a)
    plain, residues = float(values.real.max()), None
    with suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(vectors)
        if np.linalg.norm(vectors) * np.linalg.norm(inverse) < _DEFECTIVE:
            residues = inverse @ p
    size = np.linalg.norm(p) if residues is None else np.linalg.norm(residues) * np.linalg.norm(vectors[0])
    effects = np.abs(slopes) * size
    most = float(effects.sum())  # a bound of what the waves change
    if residues is not None and most <= _NEGLIGIBLE * abs(plain):
        return plain, most
    steepest = np.argsort(-effects)
    few = min(len(steepest), _MOST_WAVES)
    kept, left = steepest[:few], float(effects[steepest[few:]].sum())
    order = _order(few)
    omega, bends = frequencies[kept], bends[kept[:, None], kept]
    moved = [0.5 * slopes[kept], *(0.25 * slopes[kept] * each for each in bends.T)]  # cos(θ + δ) = cos θ - δ sin θ
    parts = np.concatenate([*moved, *(-0.25 * slopes[kept] * each for each in bends.conj().T)])
    answer = None if residues is None else (values, vectors[0] * residues)
    begin = values[values.imag >= 0.0]
    coarse, begin = _fastest(a, p, omega, parts, order - 1, answer, begin)
    fine, _ = _fastest(a, p, omega, parts, order, answer, begin)
    bent = float(np.abs(bends).sum(axis=1).max())
    return fine, left + abs(fine - coarse) + bent * abs(fine - plain)


@cache
def _order(waves: int) -> int:
    """How many frequencies a sum may have."""
    return next(n for n in range(_HIGHEST, 0, -1) if len(_sums(waves, n)) <= _MOST_SUMS)


def _sums(waves: int, order: int) -> list[Sum]:
    """How often each wave's frequency enters a sum of at most so many."""
    if waves == 0:
        return [()]
    return [(n, *rest) for n in range(-order, order + 1) for rest in _sums(waves - 1, order - abs(n))]


@cache
def _pattern(waves: int, order: int) -> tuple[Any, Any, Any]:
    """The sums; the changes of sums to which each part of K s(t) and its conjugate belong; those between two sums.

    The parts are one for each wave, then products of two, up to which K s(t) is a sum over e^{iΩt}.
    """
    unit = np.eye(waves, dtype=int)
    pairs = [(unit + sign * unit[k]) for sign in (1, -1) for k in range(waves)]
    changes = np.concatenate([unit, *pairs])
    known, where = np.unique(np.concatenate([changes, -changes]), axis=0, return_inverse=True)
    place = {tuple(each): i for i, each in enumerate(known.tolist())}
    sums = np.array(_sums(waves, order)).reshape(-1, waves)
    between = [[place.get(tuple(each), len(known)) for each in (one - sums).tolist()] for one in sums]
    return sums.astype(float), np.eye(len(known) + 1, dtype=complex)[:, where.ravel()], np.array(between)


@cache
def _around(waves: int, order: int) -> tuple[Any, Any, Any, Any, Any]:
    """The sums beside 0, and which changes lie between two of them, from them to 0, from 0 to them, and at 0."""
    sums, _, between = _pattern(waves, order)
    own, others = len(sums) // 2, np.delete(np.arange(len(sums)), len(sums) // 2)
    return (
        sums[others],
        between[np.ix_(others, others)],
        between[own, others],
        between[others, own],
        between[own, own],
    )


def _fastest(
    a: Any, p: Any, omega: Any, parts: Complex, order: int, answer: tuple[Any, Any] | None, begin: Complex
) -> tuple[float, Complex]:
    """Growth rate (1/s) with sums of at most so many frequencies; the modes, with which the next order begins."""
    sums, belongs, between = _pattern(len(omega), order)
    changes = belongs @ np.concatenate([parts, parts.conj()])
    with suppress(np.linalg.LinAlgError):
        if answer is not None and (found := _beside(omega, changes, order, *answer, begin)) is not None:
            return float(found.real.max()), found
    size, coupling, turns = len(sums), changes[between], 1j * (sums @ omega)
    matrix = np.kron(coupling, np.outer(p, [1.0, 0.0, 0.0, 0.0])) + np.kron(np.eye(size), a)
    matrix = matrix - np.kron(np.diag(turns), np.eye(4))
    values, vectors = np.linalg.eig(matrix)
    own = slice(4 * (size // 2), 4 * (size // 2) + 4)
    try:
        share = np.abs(np.sum(vectors[own] * np.linalg.inv(vectors)[:, own].T, axis=0))
    except np.linalg.LinAlgError:
        return math.nan, begin
    near = np.argsort(share)
    return float(values[(share >= _OWN) | (share >= share[near[-4]])].real.max()), begin


def _beside(
    omega: Any, changes: Complex, order: int, values: Complex, residues: Complex, now: Complex
) -> Complex | None:
    """The modes, from what they are nearly; None where one is not alone, so that all eigenvalues are needed.

    x answers a force e^{μt} by Σ residues/(values - μ). So λ = value + T residue/(1 - T Σ') with the stiffness T,
    where Σ' is the sum of residues/(λ - values) over the other values. The part of an eigenvector at the sum 0 is
    1/(1 - f') where λ = f(λ).
    """
    exact = _EXACT * np.abs(values).max()
    sums, *among = _around(len(omega), order)
    turns, unit = (1j * (sums @ omega))[:, None], np.eye(len(sums))
    block, out, back, mean = (changes[each] for each in among)
    before, after, places = np.zeros(0, complex), np.zeros(0, complex), np.arange(len(now))
    for _ in range(_MOST_STEPS):
        distance = values - (now[:, None, None] + turns)
        if not distance.all():
            return None
        response = (residues / distance).sum(axis=-1)
        inner = unit + response[:, :, None] * block
        stiffness = mean - np.linalg.solve(inner, (response * back)[:, :, None])[:, :, 0] @ out
        away = now[:, None] - values
        nearest = np.abs(away).argmin(axis=1)
        away[places, nearest] = math.inf
        beside = stiffness * (residues / away).sum(axis=1)
        new = values[nearest] + stiffness * residues[nearest] / (1.0 - beside)
        if len(before):
            moved = np.where(np.abs(now - before) > exact, now - before, math.inf)
            slope = np.abs((new - after) / moved).max()
            if not slope <= _ALONE:
                return None
            if (slope + 1e-3) * np.abs(new - now).max() <= exact:
                return np.asarray(new)
        before, after, now = now, new, new
    return None
