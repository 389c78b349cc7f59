"""A small disturbance of a motion, carried along with it: does it grow or fade, and how fast?

It is a column of the motion's block (`motion.columns`, `motion.errors`). A difference scheme has none: what grows
beside its history, `runs.against` asks of a motion of the equations.
"""

import math
from typing import NamedTuple

import numpy as np

from brakecli.solver.alike import by_rows
from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.records import PARTS, Tangent

BATCHES = 8
"""Batches of the parts of the second half of a run; of twice as many parts each, half as many."""
SURE = 3.0
"""Errors of a trend of rates beyond which it is none by chance; a choice."""
FEWEST_SAMPLES = 64
"""Fewest samples of a run with an exponent: its growth is noted at them."""
LEAST = 1e-280
MOST = 1e280
"""Size of a disturbance."""
MOST_POWERS = 700.0
"""Powers of e by which anything may grow or fade: e^709 is beyond all numbers."""


class Exponent(NamedTuple):
    """Growth rate of small disturbances of a motion (1/s), Lyapunov's exponent, with its standard error (1/s)."""

    rate: float
    error: float
    even: float = math.nan  # the rate by a line through the size of a disturbance, which does not wander where the
    even_error: float = math.nan  # motion is linear: it swings about an exponential function


def seed(t: Tangent) -> None:
    """Begin with a disturbance of size one in no particular direction."""
    t.on = 1
    t.x = 0.5 / t.rate
    t.y = 0.5 / t.rate
    t.v_x = 0.5
    t.v_y = -0.5


def _error_of_mean(rates: Floats) -> Floats:
    """The standard error of the mean of n rates, each the difference of two means in a row.

    Neighbours share one of these. Where growth is a random walk of variance 1 in a batch, a rate has the variance
    2/3, and two neighbours the covariance 1/6: the mean has (3 n - 1)/3n² where s²/n is (2 n - 1)/3n².
    """
    n = len(rates)
    error: Floats = rates.std(axis=0, ddof=1) * math.sqrt((3.0 * n - 1.0) / (2.0 * n - 1.0) / n)
    return error


def _line(sizes: Floats, apart: float) -> tuple[Floats, Floats]:
    """The slopes of lines through logarithms of sizes so far apart (s), and their standard errors (1/s).

    What leaves the line at one place does so at the next: of correlation r from one to the next, n sizes tell as
    much as n (1 - r)/(1 + r) that know nothing of each other (Santer et al. 2008, doi 10.1002/joc.1756, eqs. 4-6).
    What is left beside a line shows too small an r, by (2 + 4 r)/n in the mean. Two of them a line goes through;
    one more is taken for granted.
    """
    count = len(sizes)
    places = (np.arange(count) - 0.5 * (count - 1)) * apart
    squares = places @ places
    slopes = places @ sizes / squares
    beside = sizes - sizes.mean(axis=0) - np.outer(places, slopes)
    scatter = (beside**2).sum(axis=0)
    shown = (beside[1:] * beside[:-1]).sum(axis=0) / np.maximum(scatter, LEAST)
    alike = np.clip(shown + (2.0 + 4.0 * shown) / count, 0.0, 1.0)
    independent = count * (1.0 - alike) / (1.0 + alike)
    errors = np.sqrt(scatter / np.maximum(independent - 2.0, 1.0) / squares)
    return slopes, errors


def _trend(rates: Floats) -> Floats:
    """By how much a line rises or falls over all rates; 0 where its slope is less than `SURE` of its errors."""
    slopes, errors = _line(rates, 1.0)
    change: Floats = np.where(np.abs(slopes) > SURE * errors, np.abs(slopes) * len(rates), 0.0)
    return change


def exponents(logs: Floats, duration: float) -> list[Exponent]:
    """The exponents in the second half of runs, with their standard errors.

    Within a cycle a disturbance swings: its size is a mean over a batch. What wanders slowly is alike in
    neighbouring batches, which tell too little of it: the error is the larger of those by all batches and by half
    as many. A trend that surely is there goes on: what it has changed is in the error, too.

    `logs`: ln of the growth in each part, in the columns of runs. `even` is by a run but for its first eighth.
    """
    sizes = np.cumsum(logs, axis=0).reshape(4 * BATCHES, -1, logs.shape[1]).mean(axis=1)
    late = sizes[2 * BATCHES :].reshape(BATCHES, 2, -1).mean(axis=1)
    rates = np.diff(late, axis=0) * (2 * BATCHES / duration)
    longer = np.diff(late.reshape(BATCHES // 2, 2, -1).mean(axis=1), axis=0) * (BATCHES / duration)
    errors = np.hypot(np.maximum(_error_of_mean(rates), _error_of_mean(longer)), _trend(rates))
    slopes, off = _line(sizes[len(sizes) // 8 :], duration / len(sizes))
    columns = {"rate": rates.mean(axis=0), "error": errors, "even": slopes, "even_error": off}
    return [Exponent(**row) for row in by_rows(columns)]


@kernel
def renew(t: Tangent, number: int, samples: int) -> float:
    """Note the growth up to a sample, and go on with a disturbance of size one; what it was multiplied by.

    The square of its size is rate² (x² + y²) + v_x² + v_y².
    """
    size = math.sqrt(t.rate * t.rate * (t.x * t.x + t.y * t.y) + (t.v_x * t.v_x + t.v_y * t.v_y))
    if number > 0:
        t.logs[(number - 1) * PARTS // samples] += math.log(min(max(size, LEAST), MOST))
    if not LEAST < size < MOST:
        t.x = 1.0 / t.rate
        t.y = 0.0
        t.v_x = 0.0
        t.v_y = 0.0
        return 0.0
    factor = 1.0 / size
    t.x = factor * t.x
    t.y = factor * t.y
    t.v_x = factor * t.v_x
    t.v_y = factor * t.v_y
    return factor
