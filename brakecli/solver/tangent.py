"""A small disturbance of a motion, carried along with it: does it grow or fade, and how fast?

Within a phase it follows the derivative of the steps of the motion, or of the equations where the contact changes
within a step (`motion.errors`). Where the shoe comes to the wheel's velocity, and nowhere else, a
force jumps: there the disturbance of the sliding velocity is multiplied by the ratio of its accelerations behind
and before, which is 0 where the shoe sticks. That is all of the saltation matrix (R. I. Leine and H. Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer 2004, chapter 7): the normal of the event is
that of the sliding velocity, and only the acceleration along the wheel jumps.

At such an event the derivative of a step of a difference scheme says nothing. The step knows of the event to a
step only, so that its end is a saw of the state at its begin, whose slope is not that of the motion. Instead the
disturbance moves on as before up to the event, and a shoe that sticks holds it still.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from brakecli.solver.alike import by_rows
from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.kernels import kernel
from brakecli.solver.records import PARTS, Beside

BATCHES = 8
"""Batches of the parts of the second half of a run; of twice as many parts each, half as many."""
ALIKE = 4
"""Sizes of a group that may leave the line of `even` together: an eighth of a run."""
PLACED = 1 / 16
PLACED_LAGGING = 1 / 4
"""Parts of a step by which the growth may be off at an event inside it. The first is for schemes whose velocity is
that of the level reached, the second for those whose velocity lags. Limit cycles, whose exponent is 0, have shown
0.06 and 0.34."""
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


def seed(t: Any, state: Any, h: float) -> None:
    """Begin with a disturbance of size one in no particular direction; `state` is that of a difference scheme."""
    t.on = 1
    t.x, t.y, t.v_x, t.v_y = state.x, state.y, state.v_x, state.v_y = 0.5 / t.rate, 0.5 / t.rate, 0.5, -0.5
    state.x_old = state.x - h * state.v_x
    state.y_old = state.y - h * state.v_y


def _error_of_mean(rates: Floats) -> Floats:
    """The standard error of the mean of n rates, each the difference of two means in a row.

    Neighbours share one of these. Where growth is a random walk of variance 1 in a batch, a rate has the variance
    2/3, and two neighbours the covariance 1/6: the mean has (3 n - 1)/3n² where s²/n is (2 n - 1)/3n².
    """
    n = len(rates)
    found: Floats = rates.std(axis=0, ddof=1) * math.sqrt((3.0 * n - 1.0) / (2.0 * n - 1.0) / n)
    return found


def exponents(logs: Floats, duration: float) -> list[Exponent]:
    """The exponents in the second half of runs, with their standard errors.

    Within a cycle a disturbance swings: its size is a mean over a batch. What wanders slowly is alike in
    neighbouring batches, which tell too little of it: the error is the larger of those by all batches and by half
    as many. `logs`: ln of the growth in each part, in the columns of runs. `even` is by the whole of a run but its
    first eighth; its error is the larger of those by sizes that know nothing of each other, and that are alike in
    groups.
    """
    sizes = np.cumsum(logs, axis=0).reshape(4 * BATCHES, -1, logs.shape[1]).mean(axis=1)
    late = sizes[2 * BATCHES :].reshape(BATCHES, 2, -1).mean(axis=1)
    rates = np.diff(late, axis=0) * (2 * BATCHES / duration)
    longer = np.diff(late.reshape(BATCHES // 2, 2, -1).mean(axis=1), axis=0) * (BATCHES / duration)
    errors = np.maximum(_error_of_mean(rates), _error_of_mean(longer))
    lined = sizes[len(sizes) // 8 :]
    places = (np.arange(len(lined)) - 0.5 * (len(lined) - 1)) * (duration / len(sizes))
    slopes = places @ lined / (places @ places)
    rest = lined - lined.mean(axis=0) - np.outer(places, slopes)
    apart = (rest**2).sum(axis=0) * (places @ places) / (len(lined) - 2)
    alike = ((places[:, None] * rest).reshape(-1, ALIKE, rest.shape[1]).sum(axis=1) ** 2).sum(axis=0)
    off = np.sqrt(np.maximum(apart, alike)) / (places @ places)
    columns = {"rate": rates.mean(axis=0), "error": errors, "even": slopes, "even_error": off}
    return [Exponent(**row) for row in by_rows(columns)]


def exponent(t: Any, duration: float, h: float, lag: int) -> Exponent:
    """The exponent of a run in the common loop.

    The error also contains, for each event that a difference scheme has placed, the part `PLACED` of a step h (s),
    in radians of the fastest motion, or the part `PLACED_LAGGING` where the velocity lags.
    """
    (found,) = exponents(t.logs[:, None], duration)
    placed = PLACED_LAGGING if lag else PLACED
    return found._replace(error=math.hypot(found.error, placed * t.rate * h * t.placed / duration))


@kernel
def kept(needed: float, bound: float) -> float:
    """The part of a disturbance of the sliding velocity that is left as the shoe comes to the wheel's velocity.

    `needed` is the friction force (N) that it takes to stay there, `bound` the one that there is. Accelerations
    before and behind are as |needed| + bound and |needed| - bound, and the part is their ratio, at least 0.
    """
    return max(abs(needed) - bound, 0.0) / (abs(needed) + bound) if bound > 0.0 else 1.0


@kernel
def meet(beside: Beside, part: float, theta: float, h: float, lag: int) -> None:
    """Keep a part of the disturbed velocity from an event on, which lies at the part theta of a step h.

    δx += θ (1 - part) h δv_x, and δv_x becomes part δv_x. The velocity of a scheme that lags is the change of the
    place in the step before, in which the event lies: there δx -= (1 - θ) (1 - part) (δx - δx_old).
    """
    b = beside.state
    if lag == 1:
        change = b.x - b.x_old
        b.x -= (1.0 - theta) * (1.0 - part) * change
        b.x_old = b.x - part * change
    else:
        b.x += theta * (1.0 - part) * h * b.v_x
        b.v_x *= part


@kernel
def solve(c: Coefficients, beside: Beside, of: Any, side: float, stiffness: float, tangential: float) -> None:
    """The minimisation of a step, differentiated: velocities and normal force of the disturbance.

    In slip a11 δd + a12 δe = δg1 - side φ δF and a12 δd + a22 δe = δg2 + δF; in stick δd = 0. In both δF = ∂F_y/∂x
    δx + ∂F_y/∂y δy.
    """
    b = beside.problem
    grip = -side * c.phi
    a_11 = of.a_11
    a_12 = of.a_12
    a_22 = of.a_22
    if side == 0.0:
        d = 0.0
        d_slope = 0.0
        e = b.g_2 / a_22
        e_slope = 1.0 / a_22
    else:
        part = 1.0 / (a_11 * a_22 - a_12 * a_12)
        d = part * (b.g_1 * a_22 - b.g_2 * a_12)
        e = part * (b.g_2 * a_11 - b.g_1 * a_12)
        d_slope = part * (grip * a_22 - a_12)
        e_slope = part * (a_11 - grip * a_12)
    x = b.x_0 + b.gain * d
    y = b.y_0 + b.gain * e
    force = (tangential * x - stiffness * y) / (1.0 - b.gain * (tangential * d_slope - stiffness * e_slope))
    b.d = d + d_slope * force
    b.e = e + e_slope * force
    b.normal_force = force


@kernel
def renew(t: Any, number: int, samples: int) -> float:
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
    part = 1.0 / size
    t.x = part * t.x
    t.y = part * t.y
    t.v_x = part * t.v_x
    t.v_y = part * t.v_y
    return part
