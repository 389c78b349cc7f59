"""Bursts: when a tone stands out of a measured signal, at which frequency and how strongly."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from brakecli.analysis.spectrum import FEWEST_CYCLES, Array, interpolated

_FRAMES = 64  # parts of the record, half of which overlap; each holds
_CYCLES = 8  # cycles of its strongest line at least
_SHORTEST = 64  # samples of a frame at least
_FEWEST = 4  # frames of a record at least
_LOBE = 4.0  # bins that hold the main lobe of a Hann window
_STANDS_OUT = 20.0  # power of a tone's bin over the mean of the noise, which reaches it in one bin of 5e8
_SHARE = 0.3  # part of the energy of a frame in its tone
_FAINT = 1e-3  # part of the power of the strongest tone
_SAME = 0.06  # part of its frequency by which a tone may move from frame to frame
_MOST = 32


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

    def numbers(self) -> dict[str, float]:
        """By the names of `--json`."""
        return {"start": self.start, "end": self.end, "frequency": self.frequency, "level": self.level}


def bursts(values: Array, interval: float) -> list[Burst]:
    """The bursts of a signal without gaps."""
    if len(values) < _FEWEST * _SHORTEST or not np.ptp(values):
        return []
    whole = np.abs(np.fft.rfft(np.diff(values) * np.hanning(len(values) - 1)))  # differences, as drift is slow
    period = len(values) / max(FEWEST_CYCLES + int(np.argmax(whole[FEWEST_CYCLES:])), 1)
    wanted = max(len(values) / _FRAMES, _CYCLES * period, _SHORTEST)
    size = 1 << int(min(np.ceil(np.log2(wanted)), np.log2(len(values) / _FEWEST)))
    found = sorted(_tones(values, size), key=lambda tone: tone[0])
    strongest = max((power for _, _, power in found), default=0.0)
    groups: list[list[tuple[int, float, float]]] = []
    for tone in (tone for tone in found if tone[2] >= _FAINT * strongest):
        last = groups[-1][-1] if groups else (-size, 0.0, 0.0)
        near = tone[0] - last[0] <= size // 2 and abs(tone[1] - last[1]) <= max(_SAME * tone[1], 1.0 / size)
        groups = [*groups[:-1], [*groups[-1], tone]] if near else [*groups, [tone]]
    groups = sorted(groups, key=lambda group: -sum(power for *_, power in group))[:_MOST]
    results = (_burst(values, interval, size, group) for group in groups)
    return sorted((burst for burst in results if burst), key=lambda burst: burst.start)


def _tones(values: Array, size: int) -> Iterator[tuple[int, float, float]]:
    """First sample, frequency (1/sample) and power of the tone of each frame in which one stands out."""
    window = np.hanning(size)
    ramp = np.linspace(0.0, 1.0, size)
    frequencies = np.fft.rfftfreq(size).astype(np.float64)
    for first in range(0, len(values) - size + 1, size // 2):
        part = values[first : first + size]
        flat = part - part[0] - (part[-1] - part[0]) * ramp
        power = np.abs(np.fft.rfft((flat - flat.mean()) * window)) ** 2
        power[: _CYCLES - 2] = 0.0  # drift
        i = int(np.argmax(power))
        tone = float(power[max(i - 2, 0) : i + 3].sum())
        near = slice(max(_CYCLES - 2, i // 2), max(2 * i, 4 * _CYCLES))
        level = power[near] * frequencies[near] ** 2  # of the derivative: drift has a slope, but no line
        clear = power[i] * frequencies[i] ** 2 > _STANDS_OUT * float(np.median(level)) / np.log(2.0)
        if clear and tone >= _SHARE * power.sum():
            yield first, interpolated(frequencies, power, i), tone


def _burst(values: Array, interval: float, size: int, group: list[tuple[int, float, float]]) -> Burst | None:
    """The burst of neighbouring frames, with its ends where the tone's amplitude is half."""
    begin = group[0][0]
    end = group[-1][0] + size
    weights = np.array([power for *_, power in group])
    frequency = float(np.average([f for _, f, _ in group], weights=weights))
    low = max(0, begin - size)
    high = min(len(values), end + size)
    piece = values[low:high] - np.linspace(values[low], values[high - 1], high - low)
    lines = np.fft.fftfreq(len(piece))
    half = max(_SAME * frequency, _LOBE / size)
    tone = np.fft.ifft(np.where(np.abs(lines - frequency) <= half, np.fft.fft(piece), 0.0))
    amplitude = uniform_filter1d(2.0 * np.abs(tone), max(1, min(size // 4, int(2 / frequency))))
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


def _edge(amplitude: Array) -> int:
    """The first sample of a frame at which the tone has half of the amplitude that it comes to in it."""
    return int(np.argmax(amplitude >= 0.5 * amplitude.max()))
