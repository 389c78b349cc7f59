"""A motion under changing speed or load, window by window: short-time spectra, and when it vibrates."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from brakecli.analysis.spectrum import Array, peak
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState
from brakecli.solver.schedules import value_at, values
from brakecli.solver.system import System

LOUD = 0.05  # part of the largest amplitude of vx from which it vibrates
_HOPS = 4  # in a window
_AT_ONCE = 16  # windows, so that memory does not grow with the run


@dataclass(frozen=True)
class Vibration:
    """An interval (s) in which the shoe vibrates; Hz, m and m/s where vx is largest."""

    start: float
    end: float
    frequency: float | None
    amplitude: float
    speed: float


@dataclass(frozen=True, eq=False)
class OverTime:
    """Numbers of each window, at its middle (SI units), and the power spectral density of vx in each."""

    time: Array
    speed: Array
    load: Array
    frequency: Array  # NaN where it does not vibrate, or no line is resolved
    amplitude: Array  # half of peak to peak of x, without its trend
    stick_fraction: Array
    braking_torque: Array
    lines: Array  # Hz
    density: Array  # windows × lines, (m/s)²/Hz
    vibrations: list[Vibration]


def over_time(history: History, system: System) -> OverTime | None:
    """What the windows of a history show; None where speed and load are constant, or samples are too few."""
    lowest, highest = system.natural_frequencies
    duration = (history.samples - 1) * history.interval
    # cycles in a window, and most and fewest windows without overlap; they overlap by three quarters
    window = min(max(20.0 / max(lowest, 1e-9), duration / 100), duration / 8)
    hop = round(window / (_HOPS * history.interval))
    count = history.samples // max(hop, 1) - _HOPS + 1
    few = hop < _HOPS or hop * history.interval * lowest < 2.0  # cycles
    if system.steady or few or count < 1:
        return None
    frequency, density = _spectra(history, hop, count)
    middles = (np.arange(count) + _HOPS / 2).astype(np.float64) * hop * history.interval
    speed, load = (np.array([value_at(s, t) for t in middles]) for s in (system.belt, system.load))
    amplitude, swing, stick, friction = _statistics(history, hop, count)
    pressed = float(np.abs(values(system.load)).max()) / (system.coefficients.c_yy + system.contact_stiffness)
    # what moves x by less than a hundredth of the compression of the pad is no vibration
    loud = (swing >= LOUD * swing.max()) & (amplitude.max() > 0.01 * pressed)
    length = _HOPS * hop * history.interval
    peaks = [peak(frequency, row, length) if on else None for row, on in zip(density, loud, strict=True)]
    tones = np.array([math.nan if tone is None else tone for tone in peaks])
    chosen = frequency <= 10.0 * highest
    group = math.ceil(chosen.sum() / 1024)  # neighbours, which are averaged
    whole = chosen.sum() // group * group
    lines = frequency[:whole].reshape(-1, group).mean(axis=1)
    shown = density[:, :whole].reshape(count, -1, group).mean(axis=2)
    edges = np.array([0.0, *(middles[:-1] + 0.5 * hop * history.interval), duration])
    vibrations = []
    for is_loud, places in groupby(range(count), lambda k: bool(loud[k])):
        if is_loud:
            loud_windows = [*places]
            most = max(loud_windows, key=lambda k: float(swing[k]))
            vibration = Vibration(
                start=float(edges[loud_windows[0]]),
                end=float(edges[loud_windows[-1] + 1]),
                frequency=peaks[most],
                amplitude=float(amplitude[most]),
                speed=float(speed[most]),
            )
            vibrations.append(vibration)
    torque = system.radius * friction
    return OverTime(middles, speed, load, tones, amplitude, stick, torque, lines, shown, vibrations)


def _spectra(history: History, hop: int, count: int) -> tuple[Array, Array]:
    """Frequencies (Hz) and power spectral densities of vx, a row for each window."""
    from scipy.signal import ShortTimeFFT

    transform = ShortTimeFFT.from_window(
        "hann", 1.0 / history.interval, _HOPS * hop, (_HOPS - 1) * hop, fft_mode="onesided", scale_to="psd"
    )
    rows = []
    for first in range(0, count, _AT_ONCE):
        windows = min(_AT_ONCE, count - first)
        block = history.read("vx", first * hop, (first + windows + _HOPS - 1) * hop)
        rows.append(transform.spectrogram(block, detr="constant", p0=_HOPS // 2, p1=_HOPS // 2 + windows).T)
    density = np.concatenate(rows)
    density[:, 1:-1] *= 2.0  # one-sided: the other side's power belongs to it
    return np.asarray(transform.f), density


def _statistics(history: History, hop: int, count: int) -> list[Array]:
    """Amplitude of x and of vx without their trends, stick, and mean friction force, in the middle of each window.

    These parts lie side by side; the first and the last reach to the ends of the history.
    """
    inner = [round((number + 0.5 * (_HOPS + 1)) * hop) for number in range(count - 1)]
    parts = [*pairwise([0, *inner, history.samples])]
    means = {
        name: np.array([piece.mean() for piece in _read(history, name, parts)])
        for name in ("x", "vx", "friction_force")
    }

    def swing(name: str) -> Array:
        """Half of peak to peak about the trend that the means of the neighbours show."""
        middles = np.array([0.5 * sum(ends) for ends in parts])
        trend = np.gradient(means[name], middles) if count > 1 else np.zeros(1)
        blocks = zip(_read(history, name, parts), trend, strict=True)
        spans = [np.ptp(block - k * np.arange(len(block))) for block, k in blocks]
        return 0.5 * np.array(spans)

    stick = [np.mean(states == ContactState.STICK) for states in _read(history, "state", parts)]
    return [swing("x"), swing("vx"), np.array(stick), means["friction_force"]]


def _read(history: History, name: str, parts: list[tuple[int, int]]) -> Iterator[Array]:
    """A variable in each of the parts, which lie side by side; several are read at once."""
    for first in range(0, len(parts), _AT_ONCE):
        few = parts[first : first + _AT_ONCE]
        start = few[0][0]
        yield from np.split(history.read(name, start, few[-1][1]), [stop - start for _, stop in few[:-1]])
