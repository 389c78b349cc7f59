"""Power spectral densities and their peak."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from brakecli.solver.arrays import Floats
from brakecli.solver.history import History

Array = Floats

LONGEST_SEGMENT = 1 << 16  # samples, so that the memory that a spectrum takes does not grow with the run
SEGMENTS_AT_ONCE = 16
FEWEST_CYCLES = 5  # of a line in the record, and bins below it: what is slower is not told from drift
FEWEST_BINS = 3  # below a line, which otherwise is not told from the mean
SPECTRAL = ("x", "y", "vx", "vy", "friction_force", "normal_force", "contact_fraction")


@dataclass(frozen=True)
class Spectrum:
    """One-sided power spectral densities (unit² per Hz) over frequencies (Hz), from sample `start` on."""

    frequency: Array
    density: dict[str, Array]
    start: int
    segments: int
    window: str = "hann"


def segment(samples: int) -> int:
    """Samples of a segment of the spectrum of so many samples: eight segments, where they are not too short."""
    return min(LONGEST_SEGMENT, max(min(16, samples), 2 * samples // 9))


def spectrum(history: History, start: int) -> Spectrum:
    """Welch's estimate (Hann window, half overlap, mean removed) of the samples from `start` on."""
    length = history.samples - start
    size = segment(length)
    hop = max(1, size - size // 2)
    segments = 1 + (length - size) // hop
    window = 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, size + 1)[:size]) if size > 1 else np.ones(1)
    # The sum and the interval are rounded as in `scipy.signal.welch`, whose import takes half a second.
    window *= 1.0 / np.sqrt(np.cumsum(window**2)[-1] / (1.0 / (1.0 / history.interval)))
    densities = {name: np.zeros(size // 2 + 1) for name in SPECTRAL}
    for first in range(0, segments, SEGMENTS_AT_ONCE):
        count = min(SEGMENTS_AT_ONCE, segments - first)
        begin = start + first * hop
        for name, total in densities.items():
            block = history.read(name, begin, begin + (count - 1) * hop + size)
            # Squares of the smallest numbers would vanish, so the block is brought to a scale of one.
            scale = float(np.max(np.abs(block))) or 1.0
            parts = sliding_window_view(block / scale, size)[::hop]
            lines = np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window)
            power = np.ascontiguousarray((lines.real**2 + lines.imag**2).T)
            power[1 : (size + 1) // 2] *= 2.0
            total += count * power.mean(axis=1) * scale**2
    frequency: Array = np.fft.rfftfreq(size, history.interval).astype(np.float64)
    return Spectrum(frequency, {name: total / segments for name, total in densities.items()}, start, segments)


def peak(
    frequency: Array, density: Array, duration: float = math.inf, strongest: float = math.inf
) -> float | None:
    """Frequency (Hz) of the highest peak above zero; None where none is resolved.

    That takes three bins below it, also below the strongest line (Hz) that the whole record shows, and five
    cycles in the duration (s) of the record.
    """
    if density.size < FEWEST_BINS or not density[1:].max() > 0.0 or strongest < FEWEST_BINS * frequency[1]:
        return None
    i = 1 + int(np.argmax(density[1:]))
    line = interpolated(frequency, density, i)
    return line if i >= FEWEST_BINS and line * duration >= FEWEST_CYCLES else None


def interpolated(frequency: Array, density: Array, i: int) -> float:
    """Frequency (Hz) of the peak at bin i, from a parabola through its logarithm."""
    if i + 1 >= density.size or density[i - 1] <= 0.0 or density[i + 1] <= 0.0:
        return float(frequency[i])
    below, top, above = np.log(density[i - 1 : i + 2])
    curve = below - 2.0 * top + above
    shift = 0.5 * (below - above) / curve if curve < 0.0 else 0.0
    return float(frequency[i] + np.clip(shift, -0.5, 0.5) * (frequency[1] - frequency[0]))
