"""How far a motion of a branch reaches and where it is in the mean: by cubics between many of its states.

The states lie at equal distances, and on both sides of each event, where the acceleration jumps. Between two of
them the fourth derivative alone is missed: with 64 of them in a period 2e-7 of the amplitude of a sine.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from brakecli.analysis.branches.problem import Array

Carry = Callable[[float, Array, float], tuple[Array, Array] | None]
"""From a time (s) and a state over a span (s): the state at its end and its derivative; None where that fails."""


class Extent(NamedTuple):
    """Half of peak to peak of y (m) and v_x (m/s), and the means of x and y (m); None where not known."""

    amplitude_y: float | None
    amplitude_vx: float | None
    mean_x: float | None
    mean_y: float | None


UNKNOWN = Extent(None, None, None, None)


def extent(begins: Sequence[Array], period: float, events: Iterable[float], pieces: int, carry: Carry) -> Extent:
    """The extent of a motion whose period is cut into parts, which begin with some states, in so many pieces."""
    length = period / len(begins)
    middles = np.fromiter(events, float)
    low = np.full(2, np.inf)
    high = np.full(2, -np.inf)
    total = np.zeros(2)
    for number, begin in enumerate(begins):
        first = number * length
        near = middles[(middles > first) & (middles < first + length)] - first
        apart = 1e-7 * length
        beside = [apart, *(near - apart), *(near + apart)]
        times = np.unique(np.clip([*np.linspace(0.0, length, pieces + 1), *beside], 0.0, length))
        states = [begin]
        slopes = list[Array]()
        for time, span in zip(times.tolist(), np.diff(times).tolist(), strict=False):
            end = carry(first + time, states[-1], span)
            if end is None:
                return UNKNOWN
            states.append(end[0])
            slopes.append(end[1])
        values = np.array(states)
        slope = np.array([slopes[0], *slopes])  # the first piece is too short for it to change
        ends = _extremes(values[:, 1:3], slope[:, 1:3], np.diff(times)[:, None])
        low = np.minimum(low, ends[0])
        high = np.maximum(high, ends[1])
        spans = np.diff(times)
        total += np.trapezoid(values[:, :2], times, axis=0)
        total += spans**2 @ (values[:-1, 2:] - values[1:, 2:]) / 12.0
    y, v_x = 0.5 * (high - low)
    mean_x, mean_y = total / period
    return Extent(float(y), float(v_x), float(mean_x), float(mean_y))


def _extremes(values: Array, slopes: Array, spans: Array) -> tuple[Array, Array]:
    """The least and the largest value of the cubics through values with these slopes, at the spans' ends.

    With τ from 0 to 1 the slope of a cubic is a + 2 b τ + 3 c τ².
    """
    rise = np.diff(values, axis=0)
    a = slopes[:-1] * spans
    end = slopes[1:] * spans
    b = 3.0 * rise - 2.0 * a - end
    c = a + end - 2.0 * rise
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -b - np.copysign(np.sqrt(b * b - 3.0 * a * c), b)
        turns = np.stack([q / (3.0 * c), a / q])
    turns = np.where((turns > 0.0) & (turns < 1.0), turns, 0.0)
    extremes = values[:-1] + turns * (a + turns * (b + turns * c))
    every = np.concatenate([values, *extremes])
    return every.min(axis=0), every.max(axis=0)
