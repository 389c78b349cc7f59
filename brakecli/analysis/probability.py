"""How likely something is, by samples: a probability with its 95 % interval."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

LEVEL = 0.95


class Probability(NamedTuple):
    """A probability with its 95 % interval."""

    value: float
    lower: float
    upper: float

    @classmethod
    def within(cls, hits: NDArray[np.bool_], unknown: NDArray[np.bool_]) -> "Probability":
        """By samples of which some are not known: the interval reaches to where all of these are hits."""
        share = cls.of(hits)
        return share._replace(upper=cls.of(hits | unknown).upper) if unknown.any() else share

    @classmethod
    def of(cls, hits: NDArray[np.bool_]) -> "Probability":
        """By which of the samples, in sets that know nothing of each other: by what these differ by (Student's t).

        Of a single set, whose samples are independent, and where no set differs: Wilson's interval.
        """
        shares = hits.mean(axis=1)
        value = float(shares.mean())
        spread = float(shares.std(ddof=1)) if len(shares) > 1 else 0.0
        if spread == 0.0:
            wilson = stats.binomtest(int(hits.sum()), hits.size).proportion_ci(LEVEL, method="wilson")
            return cls(value, float(wilson.low), float(wilson.high))
        half = float(stats.t.ppf(0.5 + 0.5 * LEVEL, len(shares) - 1)) * spread / math.sqrt(len(shares))
        return cls(value, max(value - half, 0.0), min(value + half, 1.0))


def surely_fewer(hits: NDArray[np.bool_], before: NDArray[np.bool_]) -> bool:
    """Whether a change surely leaves fewer hits: by the 95 % interval of the difference of the same samples.

    Sets, samples. Sets differ as in `Probability.of` (Student's t); of a single one, and where no set differs,
    the samples do.
    """
    change = hits.astype(float) - before
    parts = change.mean(axis=1)
    if len(parts) == 1 or np.ptp(parts) == 0.0:
        parts = change.ravel()
    error = float(parts.std(ddof=1)) / math.sqrt(len(parts))
    return float(parts.mean()) + float(stats.t.ppf(0.5 + 0.5 * LEVEL, len(parts) - 1)) * error < 0.0
