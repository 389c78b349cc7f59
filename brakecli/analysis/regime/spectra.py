"""Lines of a spectrum, those of a rough wheel, and the rises of a signal."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.spectrum import Array

MULTIPLES = 10  # of a passing frequency that are its lines


def rises(values: Array, low: float, high: float) -> NDArray[np.intp]:
    """The last samples below `low` before every rise above `high`."""
    side = np.where(values > high, 1, np.where(values < low, -1, 0)).astype(np.int8)
    marked = np.flatnonzero(side)
    return marked[np.flatnonzero((side[marked[:-1]] < 0) & (side[marked[1:]] > 0))]


def line_share(power: Array) -> float:
    """Part of the energy in the three strongest bands, each 6 % to either side."""
    remaining = power.copy()
    total = float(power.sum())
    energy = 0.0
    for _ in range(3):
        peak = int(np.argmax(remaining))
        band = slice(int(peak / 1.06), int(peak * 1.06) + 2)
        energy += float(remaining[band].sum())
        remaining[band] = 0.0
    return energy / total if total > 0.0 else 0.0


@lru_cache(maxsize=4)  # the points of a sweep ask for the same ones
def forced_lines(belt_speed: float, waves_per_metre: tuple[float, ...], highest: float) -> tuple[float, ...]:
    """Frequencies (Hz, up to `highest`) of the passing waves, their multiples, and sums and differences of two.

    With more than 2000 waves the sums and differences are left out: they would fill the spectrum, and memory.
    """
    base = abs(belt_speed) * np.array(waves_per_metre)
    few = base[: len(base) * (len(base) <= 2000)]
    multiples = np.outer(np.arange(1, MULTIPLES + 1), base)
    families = [multiples, np.add.outer(few, few), np.abs(np.subtract.outer(few, few))]
    lines = np.unique(np.concatenate([family.ravel() for family in families]))
    return tuple(lines[(lines > 0.0) & (lines <= highest)].tolist())
