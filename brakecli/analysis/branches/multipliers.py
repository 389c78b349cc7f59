"""Floquet multipliers of a product of maps, and smooth functions that vanish where stability changes."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.arrays import Floats

Complex = NDArray[np.complex128]

POWERS = 600.0
"""Largest logarithm by which a scaled product is multiplied, so that it stays a number."""


class Spectrum(NamedTuple):
    """What the multipliers say."""

    multipliers: Complex
    """The largest modulus comes first."""
    tests: tuple[float, ...]
    """asinh of det(I - M), of det(I + M), and of the product of 1 - λ_i λ_j over all pairs.

    NaN where rounding decides their sign.
    """
    coefficients: tuple[float, ...]
    """asinh of the coefficients of the characteristic polynomial."""

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(abs(self.multipliers[0]) < 1.0 - 1e-10)  # beside the circle rounding decides


def product(maps: Floats) -> tuple[Floats, float]:
    """Return the product divided by its size, and the logarithm of its size, so that nothing overflows."""
    total = maps[0]
    log = 0.0
    for k in range(len(maps)):
        if k:
            total = maps[k] @ total
        size = float(np.abs(total).max())
        if 1e-300 < size < math.inf and not 1e-3 < size < 1e3:  # a choice, as scaling takes time
            total = total / size
            log = log + math.log(size)
    return total, log


def spectrum(maps: Floats) -> Spectrum:
    """Multipliers and tests.

    The tests are symmetric functions of the multipliers, that is, polynomials in the coefficients of the
    characteristic polynomial. They stay smooth where two multipliers meet, although the multipliers do not.
    """
    total, log = product(maps)
    scaled = sorted(np.linalg.eigvals(total).tolist(), key=abs, reverse=True)
    scale = math.exp(min(log, POWERS))
    values = [complex(value * scale) for value in scaled]
    # some units of rounding in each entry of the product
    error = 1e-14 * max(abs(values[0]), scale * float(np.abs(total).max()))
    pairs = [(a, b) for i, a in enumerate(values) for b in values[i + 1 :]]
    tests = (
        _asinh(((1.0 - a, error) for a in values), error),
        _asinh(((1.0 + a, error) for a in values), error),
        _asinh(((1.0 - a * b, error * (abs(a) + abs(b))) for a, b in pairs), error),
    )
    symmetric = [1.0 + 0.0j]
    for value in scaled:
        symmetric = [a + value * b for a, b in zip([*symmetric, 0.0], [0.0, *symmetric], strict=True)]
    coefficients = tuple(_scaled_asinh(e.real, k * log) for k, e in enumerate(symmetric) if k)
    return Spectrum(np.array(values, dtype=complex), tests, coefficients)


def resonant_pair(multipliers: Iterable[complex]) -> tuple[complex, complex] | None:
    """Return the two multipliers whose product is nearest to one; None where there is only one multiplier."""
    values = [complex(value) for value in multipliers]
    pairs = [(a, b) for i, a in enumerate(values) for b in values[i + 1 :]]
    return min(pairs, key=lambda pair: abs(1.0 - pair[0] * pair[1])) if pairs else None


def _asinh(factors: Iterable[tuple[complex, float]], error: float) -> float:
    """asinh of a product of factors with their errors, through its logarithm."""
    log = 0.0
    phase = 1.0 + 0.0j
    for factor, bound in factors:
        size = abs(factor)
        if error > 1e-6 and size < 10.0 * bound:
            return math.nan  # of a small multiplier beside a huge one nobody knows the sign of the factor
        if size == 0.0:
            return 0.0
        log += math.log(size)
        phase *= factor / size
    return _scaled_asinh(1.0 if phase.real >= 0.0 else -1.0, log)


def _scaled_asinh(value: float, log: float) -> float:
    """asinh(value · exp(log)) without overflow."""
    if value == 0.0:
        return 0.0
    total = math.log(abs(value)) + log
    # beyond 300 the number itself may overflow
    size = total + math.log(2.0) if total > 300.0 else math.asinh(math.exp(total))
    return math.copysign(size, value)
