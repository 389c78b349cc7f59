"""Power spectral densities and the fundamental frequency of a history."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.history import History

LONGEST_SEGMENT = 1 << 16
"""Samples of one Welch segment: the memory that a spectrum takes does not grow with the run."""
SEGMENTS_AT_ONCE = 16
SEGMENTS_WANTED = 8
SHORTEST_SEGMENT = 16

SPECTRAL = ("x", "y", "vx", "vy", "friction_force", "normal_force", "contact_fraction")
"""The variables that have a spectrum; the state has no size."""


@dataclass(frozen=True)
class Spectrum:
    """One-sided power spectral densities (unit² per Hz) over frequencies (Hz), of samples start … stop - 1."""

    frequency: NDArray[np.float64]
    density: dict[str, NDArray[np.float64]]
    start: int
    segments: int
    window: str = "hann"


def spectrum(history: History, start: int) -> Spectrum:
    """Welch's estimate (Hann window, half overlap, mean removed) of the samples from `start` on.

    Segments are as long as leaves about `SEGMENTS_WANTED` of them, within `LONGEST_SEGMENT`.
    """
    length = history.samples - start
    size = min(LONGEST_SEGMENT, max(min(SHORTEST_SEGMENT, length), 2 * length // (SEGMENTS_WANTED + 1)))
    hop = max(1, size - size // 2)
    segments = 1 + (length - size) // hop
    frequency: NDArray[np.float64] = np.fft.rfftfreq(size, history.interval).astype(np.float64)
    return Spectrum(
        frequency,
        {name: _density(history, name, start, size, hop, segments) for name in SPECTRAL},
        start,
        segments,
    )


def _density(history: History, name: str, start: int, size: int, hop: int, segments: int) -> NDArray[np.float64]:
    """Mean periodogram of the segments, some of them at a time."""
    from scipy import signal  # half a second, which a command without spectra need not wait for

    total = np.zeros(size // 2 + 1)
    for first in range(0, segments, SEGMENTS_AT_ONCE):
        count = min(SEGMENTS_AT_ONCE, segments - first)
        begin = start + first * hop
        block = history.read(name, begin, begin + (count - 1) * hop + size)
        # Brought to a scale of one, so that squares of the smallest numbers do not vanish.
        scale = float(np.max(np.abs(block), initial=0.0)) or 1.0
        _, density = signal.welch(
            block / scale, 1.0 / history.interval, nperseg=size, noverlap=size - hop, detrend="constant"
        )
        total += count * density * scale**2
    mean: NDArray[np.float64] = total / segments
    return mean


def peak(frequency: NDArray[np.float64], density: NDArray[np.float64]) -> float | None:
    """Frequency (Hz) of the highest peak above zero, from a parabola through its logarithm; None without one."""
    if density.size < 3 or not density[1:].max() > 0.0:
        return None
    i = 1 + int(np.argmax(density[1:]))
    if i + 1 >= density.size or density[i - 1] <= 0.0 or density[i + 1] <= 0.0:
        return float(frequency[i])
    left, middle, right = np.log(density[i - 1 : i + 2])
    curve = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curve if curve < 0.0 else 0.0
    return float(frequency[i] + np.clip(shift, -0.5, 0.5) * (frequency[1] - frequency[0]))


def upward_crossings(values: NDArray[np.float64], band: float) -> NDArray[np.float64]:
    """Places (in samples) where a signal rises through zero between leaving -band and reaching +band.

    The band keeps ripple on a slow cycle from counting as cycles. The places are interpolated linearly.
    """
    side = np.where(values > band, 1, np.where(values < -band, -1, 0))
    marked = np.flatnonzero(side)
    rises = np.flatnonzero((side[marked[:-1]] < 0) & (side[marked[1:]] > 0))
    places = []
    for low, high in zip(marked[rises], marked[rises + 1], strict=True):
        i = low + int(np.argmax(values[low : high + 1] >= 0.0)) - 1
        places.append(i + values[i] / (values[i] - values[i + 1]))
    return np.array(places)
