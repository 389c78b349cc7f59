"""Bursts: when a tone stands out of a measured signal, at which frequency and how strongly."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from brakecli.analysis.spectrum import FEWEST_CYCLES, Array, interpolated

_CYCLES = 8  # of the strongest line of the record in a frame, at least
_SAME = 0.06  # part of its frequency by which a tone may move from frame to frame, or differ; a choice
_Tone = tuple[int, float, float]  # first sample of a frame, and the frequency (1/sample) and power of its tone


@dataclass(frozen=True)
class Burst:
    """A tone that stands out for a while."""

    start: float  # s
    end: float  # s
    frequency: float  # Hz, its peak
    level: float  # RMS, in the unit of the quantity

    @property
    def energy(self) -> float:
        """Level squared times length."""
        return self.level**2 * (self.end - self.start)

    def is_like(self, other: "Burst") -> bool:
        """Whether it is the same tone."""
        return abs(self.frequency - other.frequency) <= _SAME * other.frequency

    def is_part_of(self, other: "Burst") -> bool:
        """Whether it is the same tone at the same time."""
        return self.is_like(other) and other.start <= 0.5 * (self.start + self.end) <= other.end

    def numbers(self) -> dict[str, float]:
        """By the names of `--json`."""
        return {"start": self.start, "end": self.end, "frequency": self.frequency, "level": self.level}


def bursts(values: Array, interval: float) -> list[Burst]:
    """The bursts of a signal without gaps."""
    shortest = 64  # samples of a frame
    fewest = 4  # frames, half of which overlap
    if len(values) < fewest * shortest or not np.ptp(values):
        return []
    whole = np.abs(np.fft.rfft(np.diff(values) * np.hanning(len(values) - 1)))  # differences, as drift is slow
    period = len(values) / max(FEWEST_CYCLES + int(np.argmax(whole[FEWEST_CYCLES:])), 1)
    wanted = max(len(values) / 64, _CYCLES * period, shortest)
    size = 1 << int(min(np.ceil(np.log2(wanted)), np.log2(len(values) / fewest)))
    groups: list[list[_Tone]] = []
    for tone in _tones(values, size):
        if groups and _lasts(values, size, groups[-1][-1], tone):
            groups[-1].append(tone)
        else:
            groups.append([tone])
    groups = sorted(groups, key=lambda group: -sum(power for *_, power in group))[:32]
    results: list[Burst] = []
    for group in groups:
        burst = _burst(values, interval, size, group)
        if burst and not any(burst.is_part_of(other) for other in results):
            results.append(burst)
    return sorted(results, key=lambda burst: burst.start)


def _tones(values: Array, size: int) -> list[_Tone]:
    """The tones of the frames in which one stands out."""
    window = np.hanning(size)
    ramp = np.linspace(0.0, 1.0, size)
    frequencies = np.fft.rfftfreq(size).astype(np.float64)
    loudest = 0.0
    tones = []
    for first in range(0, len(values) - size + 1, size // 2):
        frame = values[first : first + size]
        flat = frame - frame[0] - (frame[-1] - frame[0]) * ramp
        power = np.abs(np.fft.rfft((flat - flat.mean()) * window)) ** 2
        level = power * frequencies**2  # of the derivative: drift has a slope, but no line
        power[: _CYCLES - 2] = 0.0  # drift
        loudest = max(loudest, float(power.sum()))
        i = int(np.argmax(power))
        tone = float(power[max(i - 2, 0) : i + 3].sum())
        around = np.median(level[max(_CYCLES - 2, i // 2) : max(2 * i, 4 * _CYCLES)])
        slower = np.median(level[i // 2 : i - 2])  # on the flank of a slow line, more than what is around
        # noise reaches twenty times its mean in one bin of 5e8
        clear = level[i] > 20.0 * float(max(around, slower)) / np.log(2.0)
        if clear and tone >= 0.3 * power.sum():  # power of the frame
            tones.append((first, interpolated(frequencies, power, i), tone))
    return [tone for tone in tones if tone[2] >= 1e-3 * loudest]  # less is rounding, or stands out of nothing


def _lasts(values: Array, size: int, last: _Tone, tone: _Tone) -> bool:
    """Whether a tone is that of an earlier frame, and keeps half of its amplitude between the two."""
    if abs(tone[1] - last[1]) > max(_SAME * tone[1], 1.0 / size):
        return False
    if tone[0] - last[0] <= size // 2:
        return True
    between = slice(last[0], tone[0] + size)
    frequency = 0.5 * (last[1] + tone[1])
    amplitude = _amplitude(_band(values[between], size, frequency), size, frequency)
    least = amplitude[size // 2 : -size // 2].min()
    return bool(least >= 0.5 * min(amplitude[:size].max(), amplitude[-size:].max()))


def _begin(values: Array, size: int, frequency: float, first: int) -> int:
    """The first sample of the earliest frame up to which the tone keeps half of its amplitude, frame by frame."""
    while first > 0:
        low = max(0, first - size)
        earlier = max(0, first - size // 2)
        amplitude = _amplitude(_band(values[low : first + size], size, frequency), size, frequency)
        if amplitude[earlier - low : first - low].min() < 0.5 * amplitude[first - low :].max():
            break
        first = earlier
    return first


def _burst(values: Array, interval: float, size: int, group: list[_Tone]) -> Burst | None:
    """The burst of neighbouring frames, with its ends where the tone's amplitude is half."""
    weights = np.array([power for *_, power in group])
    frequency = float(np.average([f for _, f, _ in group], weights=weights))
    begin = _begin(values, size, frequency, group[0][0])
    end = len(values) - _begin(values[::-1], size, frequency, len(values) - group[-1][0] - size)
    low = max(0, begin - size)
    high = min(len(values), end + size)
    tone = _band(values[low:high], size, frequency)
    amplitude = _amplitude(tone, size, frequency)
    first = begin - low
    last = end - low
    first = first + _edge(amplitude[first : first + size])
    last = last - _edge(amplitude[last - size : last][::-1])
    if (last - first) * frequency < _CYCLES / 2:
        return None
    turn = np.angle(np.vdot(tone[first : last - 1], tone[first + 1 : last]))
    return Burst(
        start=(low + first) * interval,
        end=(low + last) * interval,
        frequency=float(turn) / (2.0 * np.pi * interval),
        level=float(np.sqrt(0.5 * np.mean(amplitude[first:last] ** 2))),
    )


def _band(values: Array, size: int, frequency: float) -> NDArray[np.complex128]:
    """A tone alone, as it turns: half of its amplitude, and its phase."""
    piece = values - np.linspace(values[0], values[-1], len(values))
    lines = np.fft.fftfreq(len(piece))
    half = max(_SAME * frequency, 4.0 / size)  # bins that hold the main lobe of a Hann window
    return np.fft.ifft(np.where(np.abs(lines - frequency) <= half, np.fft.fft(piece), 0.0))


def _amplitude(tone: NDArray[np.complex128], size: int, frequency: float) -> Array:
    """Its amplitude, in the mean of two cycles."""
    return np.asarray(uniform_filter1d(2.0 * np.abs(tone), max(1, min(size // 4, int(2 / frequency)))))


def _edge(amplitude: Array) -> int:
    """The first sample of a frame at which the tone has half of the amplitude that it comes to in it."""
    return int(np.argmax(amplitude >= 0.5 * amplitude.max()))
