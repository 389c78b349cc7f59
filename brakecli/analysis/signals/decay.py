"""The frequency and the damping ratio of a measured vibration that dies out, by its logarithmic decrement."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from brakecli.analysis.spectrum import Array


@dataclass(frozen=True)
class Ringing:
    """A frequency (Hz) and a damping ratio, with their standard errors."""

    ringing_frequency: float
    ringing_frequency_error: float
    damping_ratio: float
    damping_ratio_error: float


def ringing(values: Array, interval: float, line: float, noise: float, sure_errors: float) -> Ringing | None:
    """What a vibration rings with that decays from its largest value on; None where that is not sure, or too fast.

    `line` is its frequency, roughly (cycles per sample), and `noise` the standard deviation of that of a sample. A
    window that holds nothing but exp(-δt) cos(ωt) turns it by the same factor wherever it stands. So the logarithm
    falls by the decrement, and the phase turns by ω, from window to window, exactly.
    """
    values = values - np.median(values)
    values = values[int(np.argmax(np.abs(values))) :]
    # Cycles, the deviation of a Gaussian window: its spectrum at rest has 1.5e-5 of that at the line. At its ends,
    # four deviations away, it has 3e-4 of its height.
    width = 0.75
    half = math.ceil(4.0 * width / line)
    hop = max(1, round(2.0 * width / line))
    count = (len(values) - 2 * half - 1) // hop + 1
    fewest = 4  # a line through three has a single number for its error
    if count < fewest:
        return None
    places = np.arange(-half, half + 1)
    window = np.exp(-0.5 * (places * line / width) ** 2)
    wave = window * np.exp(-2j * np.pi * line * places)
    windows = sliding_window_view(values, len(wave))[::hop][:count]
    step = max(1, (1 << 22) // len(wave))  # so many samples at once
    tones = np.concatenate([windows[first : first + step] @ wave for first in range(0, count, step)])
    # up to four times the noise its logarithm is off by a thirtieth at most, 1/2 of the square of 1/4
    faint = np.flatnonzero(np.abs(tones) <= 4.0 * noise * float(np.linalg.norm(window)))
    tones = tones[: faint[0]] if len(faint) else tones
    if len(tones) < fewest or not np.abs(tones).min() > 0.0:
        return None
    time = (hop * interval) * np.arange(len(tones)).astype(np.float64)
    weights = np.abs(tones / np.abs(tones).max()) ** 2  # noise moves a logarithm by its part of the tone
    fall, fall_error = _slope(time, -np.log(np.abs(tones)), weights)
    turned = np.unwrap(np.angle(tones * np.exp(-2j * np.pi * line * hop * np.arange(len(tones)))))
    turn, turn_error = _slope(time, turned, weights)
    turn += 2.0 * math.pi * line / interval
    size = math.hypot(fall, turn)
    if not sure_errors * fall_error < fall < size:
        return None
    error = math.hypot(turn * fall_error, fall * turn_error) * turn / size**3  # of fall/size
    return Ringing(turn / (2.0 * math.pi), turn_error / (2.0 * math.pi), fall / size, error)


def _slope(time: Array, values: Array, weights: Array) -> tuple[float, float]:
    """The slope of a weighted line, and its standard error by what the line leaves.

    Windows that are n hops of two deviations apart have noise in common by the part exp(-n²). The error of a slope
    is larger by the root of the sum of all these.
    """
    away = time - np.average(time, weights=weights)
    spread = float(weights @ away**2)
    middle = float(np.average(values, weights=weights))
    slope = float(weights @ (away * (values - middle))) / spread
    residual = values - middle - slope * away
    return slope, math.pi**0.25 * math.sqrt(float(weights @ residual**2) / (len(time) - 2) / spread)
