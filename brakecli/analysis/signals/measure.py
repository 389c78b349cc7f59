"""The record of answers to the questions of `table`, from a velocity and its slips."""

import math
from functools import cached_property
from itertools import product
from typing import TypedDict

import numpy as np

from brakecli.analysis.regime.evidence import WINDOWS, level_change
from brakecli.analysis.regime.spectra import line_share
from brakecli.analysis.signals.cleaning import CERTAIN, DRIFT_CYCLES, Velocity
from brakecli.analysis.signals.slips import Slips
from brakecli.analysis.signals.table import FEWEST_SAMPLES, SignalAnswers, SignalThresholds, steady
from brakecli.analysis.spectrum import Array, interpolated

_PLATEAU_SAMPLES = 1 << 20  # most samples in which a plateau is sought
_WINDOW_CYCLES = 3.0  # fewer cycles in a window do not have a level


class Lasts(TypedDict):
    """Answers about whether it lasts."""

    died_to: float
    hidden: float
    was_loud: bool
    steady_from: float
    level_change: float
    level_change_error: float


class Harmony(TypedDict):
    """Answers about where the energy lies."""

    overtones: float
    beyond_lines: float
    noise_share: float
    line_share: float


class Stay(TypedDict):
    """Answers about how long the velocity stays where it is."""

    plateau: float
    sticks: float
    reaches: bool


class Heard:
    """What a velocity shows."""

    def __init__(self, velocity: Velocity, slips: Slips, belt: float, limits: SignalThresholds) -> None:
        """Take a velocity, its slips, and the belt's speed as the velocity would show it; nan if not known."""
        self.velocity = velocity
        self.slips = slips
        self.belt = belt
        self.limits = limits
        self.samples = len(velocity.values)
        certain = slips.skewness >= limits.skewness_certain and slips.stick_slip
        self.smoothing = slips.scale if certain else velocity.quiet
        self.heard = self.samples >= FEWEST_SAMPLES and (certain or bool(velocity.scales))
        if self.heard:
            self.clean, self.power = velocity.denoised()
            self.strongest = int(np.argmax(self.power))
            self.heard = certain or self.strongest > 0
            self.cycles = float(slips.count) if certain else self.strongest * self.samples / len(self.clean)

    @property
    def windows(self) -> int:
        """How many windows hold three cycles or more each."""
        return int(np.clip(self.cycles / _WINDOW_CYCLES, 1, WINDOWS))

    def amplitude(self, measured: Velocity, order: int, begin: float) -> tuple[float, float]:
        """Half of peak to peak of the displacement at its tones, from some part of the record on, and its spread.

        `measured` is what the sensor gave, or the differences of a displacement: there the noise is white. Its sum
        is not, so lines are sought before they are integrated, each over its own frequency. Under a Hann window a
        line does not reach those far away, which integration would enlarge; the window is divided out where it is
        1/2 or more, in the middle half. Median of windows there, and half of the range of their middle two thirds
        with the standard deviation of the noise that the lines hold. nan where no line stands out.
        """
        values = measured.values[int(begin * len(measured.values)) :]
        count = len(values)
        window = np.hanning(count)
        spectrum = np.fft.rfft((values - values.mean()) * window)
        turn = np.linspace(0.0, 2.0 * np.pi * (len(spectrum) - 1) / count, len(spectrum))
        difference = np.exp(1j * turn) - 1.0
        gain = (1j * turn) ** order if order else difference  # from the displacement to what is given
        noise = np.mean(window**2) * count * measured.noise**2 * np.abs(1.0 if order else difference) ** 2
        often = self.cycles / self.samples
        tones = (np.abs(spectrum) ** 2 > CERTAIN * noise) & (turn > 2.0 * np.pi * often / DRIFT_CYCLES)
        if not tones.any():
            return math.nan, math.nan
        in_tones = np.zeros(len(spectrum))
        in_tones[tones] = (noise * np.ones(len(spectrum)))[tones] / np.abs(gain[tones]) ** 2
        x = np.zeros(len(spectrum), np.complex128)
        x[tones] = spectrum[tones] / gain[tones]
        # of 32 samples of a cycle the largest is 1/2 % below the peak at most, (π/32)²/2
        finer = int(np.ceil(32.0 * often)) if count <= _PLATEAU_SAMPLES else 1
        moved = finer * np.fft.irfft(x, finer * count)
        middle = slice(len(moved) // 4, 3 * len(moved) // 4)
        moved = moved[middle] / np.interp(np.arange(len(moved))[middle] / finer, np.arange(count), window)
        windows = int(np.clip(0.5 * often * count / _WINDOW_CYCLES, 1, WINDOWS))
        sizes = [0.5 * float(np.ptp(piece)) for piece in np.array_split(moved, windows)]
        low, size, high = map(float, np.quantile(sizes, [1.0 / 6.0, 0.5, 5.0 / 6.0]))
        return size, math.hypot(0.5 * (high - low), math.sqrt(2.0 * float(in_tones.sum())) / count)

    @cached_property
    def lines(self) -> Array:
        """Power of the lines above the noise, under a Hann window."""
        return self.velocity.denoised(hann=True)[1]

    @property
    def line(self) -> float:
        """Cycles per sample of the strongest line, interpolated between those of the spectrum."""
        near = max(self.strongest - 1, 0)
        peak = near + int(np.argmax(self.lines[near : near + 3]))
        return interpolated(np.arange(len(self.lines)) / len(self.clean), self.lines, peak)

    def lasts(self) -> Lasts:
        """Whether it lasts."""
        velocity = self.velocity
        windows = max(self.windows, 10)  # the error of a level takes ten batches
        levels = velocity.levels(self.smoothing, 0, windows)
        largest = max(float(np.sort(levels)[-3]), 1e-300)
        died_to = float(levels[-(windows // 4) :].mean()) / largest
        # where noise may hide more, what has died is not told from what lasts
        hidden = min(0.2, 0.5 * float(np.sqrt(velocity.noise_at(self.smoothing))) / largest)
        least = max(self.limits.negligible, hidden) * largest
        for steady_from in (0.0, 0.5):
            there = velocity.levels(self.smoothing, int(steady_from * self.samples), windows)
            change, error = map(float, level_change(np.maximum(there, least)))
            if steady(change, error, self.limits):
                break
        was_loud = bool(levels[: windows // 2].max() >= largest)
        return {
            "died_to": died_to,
            "hidden": hidden,
            "was_loud": was_loud,
            "steady_from": steady_from,
            "level_change": change,
            "level_change_error": error,
        }

    def harmony(self) -> Harmony:
        """Parts of the energy that tell lines in step from stick."""
        total = max(float(self.power.sum()), 1e-300)
        overtones = np.arange(3, 9)  # which two lines in step lack
        first, last = (((1.0 + off) * overtones * self.strongest).astype(int) for off in (-0.03, 0.03))
        turn = 2.0 * np.pi * min(4.0 * self.cycles / self.samples, 0.5)
        gain = 1.0 if self.velocity.measured else 2.0 - 2.0 * np.cos(turn)
        noise = CERTAIN * self.samples * self.velocity.noise**2 * gain
        return {
            "overtones": sum(float(self.power[i:j].sum()) for i, j in zip(first, last + 2, strict=True)) / total,
            "beyond_lines": 1.0 - line_share(self.lines),
            "noise_share": min(float(noise) / total, 1.0),
            "line_share": line_share(self.power),
        }

    def stay(self) -> Stay:
        """How long the velocity stays at that of the belt, or at an extreme one.

        A plateau is sought among 1000 samples of a cycle, interpolated, by three half widths over the amplitude.
        """
        tail = 0.01  # of the time, in which the velocity may go beyond its range
        finer = int(np.ceil(1000.0 * self.cycles / self.samples))
        mean = self.velocity.mean
        clean = self.clean[: _PLATEAU_SAMPLES // finer]
        clean = finer * np.fft.irfft(np.fft.rfft(clean), finer * len(clean))
        reach = 0.5 * float(np.ptp(np.quantile(clean, [tail, 1.0 - tail]))) or 1.0
        levels = np.array([self.belt, -self.belt]) - mean
        if not math.isfinite(self.belt):
            # the most frequent values of the lower and of the upper quarter of the range
            cell = 0.01 * reach
            edges = clean.min() + cell * np.arange(float(np.ptp(clean)) / cell + 2.0)
            counts = np.histogram(clean, edges)[0]
            quarter = max(1, len(edges) // 4)
            places = np.array([np.argmax(counts[:quarter]), len(counts) - quarter + np.argmax(counts[-quarter:])])
            levels = 0.5 * (edges[places] + edges[places + 1])
        times = [(0.0, 1.0)]  # at a level, and next to it
        for level, width in product(levels, (0.02, 0.01, 0.005)):
            away = np.abs(clean - level) / reach
            if (there := float(np.mean(away <= width))) >= 0.03:  # of the time
                times.append((there, float(np.mean(away <= 3.0 * width)) - there))
        top, beside = max(times, key=lambda time: time[0] / max(time[1], 1e-9))
        least, most = np.quantile(self.clean + mean, [tail, 1.0 - tail])
        return {
            "plateau": top / max(beside, 1e-9),
            "sticks": max(0.0, top - 0.5 * beside),
            "reaches": any(0.95 * self.belt <= v <= 1.2 * self.belt for v in (-least, most)),  # just so
        }


def answers(heard: Heard, *, has_belt: bool) -> SignalAnswers:
    """The record of answers."""
    slips = heard.slips
    samples = float(heard.samples)
    if not heard.heard:
        return SignalAnswers(samples=samples, has_belt=has_belt)
    return SignalAnswers(
        samples=samples,
        heard=True,
        has_belt=has_belt,
        knows_belt=math.isfinite(heard.belt),
        smoothed_over=float(heard.smoothing),
        cycles=heard.cycles,
        samples_per_cycle=samples / heard.cycles,
        skewness=slips.skewness,
        events=float(slips.count),
        slips=slips.stick_slip,
        slip_lasts=slips.lasts,
        slip_swings=slips.swings,
        **heard.lasts(),
        **heard.harmony(),
        **heard.stay(),
    )
