"""Floquet multipliers of a product of maps, and smooth functions that vanish where stability changes."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.arrays import Floats

Complex = NDArray[np.complex128]

ROUNDING = 1e-14
"""Error of a multiplier relative to the size of the product: some units of rounding in each of its entries."""
UNKNOWN = 1e-6
"""Beyond this error of small multipliers beside a huge one, the signs of the tests are checked against it."""
STABLE = 1e-10
"""Distance from the unit circle below which a multiplier is not called stable."""
POWERS = 600.0
"""Largest logarithm by which a scaled product is multiplied, so that it stays a number."""
SCALED = 1e3
"""Size beyond which, or below the inverse of which, a product is scaled; a choice, as scaling takes time."""
SURE = 10.0
"""Times its error that a factor must have for its sign to count."""
LARGE = 300.0
"""Logarithm beyond which asinh is taken from the logarithm, as the number itself may overflow."""


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
        return bool(abs(self.multipliers[0]) < 1.0 - STABLE)


def product(maps: Floats) -> tuple[Floats, float]:
    """Return the product divided by its size, and the logarithm of its size, so that nothing overflows."""
    total = maps[0]
    log = 0.0
    for k in range(len(maps)):
        if k:
            total = maps[k] @ total
        size = float(np.abs(total).max())
        if 1e-300 < size < math.inf and not 1.0 / SCALED < size < SCALED:
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
    error = ROUNDING * max(abs(values[0]), scale * float(np.abs(total).max()))
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


def resonant_pair(multipliers: Any) -> tuple[complex, complex] | None:
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
        if error > UNKNOWN and size < SURE * bound:
            return math.nan
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
    size = total + math.log(2.0) if total > LARGE else math.asinh(math.exp(total))
    return math.copysign(size, value)
