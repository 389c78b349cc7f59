"""A measured signal made ready to be judged: gaps, spikes and drift taken out, its noise known, its velocity
at any smoothing.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BAND = 0.3
"""Of the mean size of the velocity: ripple within it is no cycle."""
_SPIKES = (8.0, 0.35)
"""A spike leaves the median of its neighbours by so many deviations, and by this part of the signal's range."""
_NOISE_SHARE = 0.6
_SMOOTHED_AWAY = 0.15
_DRIFT_CYCLES = 8.0
_COARSE = 24
_SHORTEST = 8
_LINES_LEFT = 0.5
CERTAIN = 15.0
"""A line's power over the mean power of the noise: one bin in three million of pure noise."""


@dataclass(frozen=True)
class Motion:
    """A velocity per sample (that of a displacement or force: its difference), the noise of the samples, notes."""

    velocity: Array
    raw: Array  # the same with its mean and drift
    noise: float  # standard deviation of one sample of the signal
    measured_velocity: bool
    notes: tuple[str, ...] = ()

    @cached_property
    def _primitive(self) -> Array:
        """Running sum of the velocity; of a displacement, that of the displacement itself."""
        total = np.concatenate([[0.0], np.cumsum(self.velocity)])
        return total if self.measured_velocity else np.concatenate([[0.0], np.cumsum(total)])

    @property
    def largest(self) -> int:
        """The widest smoothing at which statistics make sense."""
        return max(1, len(self.velocity) // 100)

    def smoothed(self, m: int, stride: int = 1) -> Array:
        """The velocity, smoothed over m samples; that of a displacement twice, since its noise is steeper."""
        c = self._primitive
        if self.measured_velocity:
            return (c[m::stride] - c[:-m:stride]) / m
        return (c[2 * m :: stride] - 2.0 * c[m:-m:stride] + c[: -2 * m : stride]) / m**2

    def noise_at(self, m: int) -> float:
        """Variance of the noise of the velocity smoothed over m samples."""
        return self.noise**2 / m if self.measured_velocity else 2.0 * self.noise**2 / m**3

    @cached_property
    def variances(self) -> list[tuple[int, float]]:
        """Smoothings, and the variance of the velocity there: those that show more than noise, up to the one that
        smooths the motion itself away.
        """
        found: list[tuple[int, float]] = []
        most = 0.0
        for m in scales(self.largest):
            variance = float(self.smoothed(m, stride_of(m)).var())
            if self.noise_at(m) >= _NOISE_SHARE * variance:
                continue
            most = max(most, variance - self.noise_at(m))
            if variance - self.noise_at(m) < _SMOOTHED_AWAY * most:
                break
            found.append((m, variance))
        return found

    def quiet_scale(self, share: float = 0.02) -> int:
        """The least smoothing at which noise is no more than this share of the variance, or the least."""
        parts = [(m, self.noise_at(m) / variance) for m, variance in self.variances]
        quiet = [m for m, part in parts if part <= share]
        return quiet[0] if quiet else min(parts, key=lambda p: p[1], default=(1, 1.0))[0]

    def amplitude(self, start: int, windows: int) -> float:
        """Half of peak to peak of the displacement from a sample on, drift removed: median of equal windows."""
        m, c = self.quiet_scale(), self._primitive
        x = c if self.measured_velocity else (c[m:] - c[:-m]) / m
        return 0.5 * float(np.median([np.ptp(part) for part in np.array_split(x[start:], windows)]))


@dataclass(frozen=True)
class Trend:
    """The envelope (of the velocity) in equal windows, its noise taken off, and how it changes."""

    envelope: Array
    ratio: float  # last third over first third
    order: float  # rank correlation with time


def scales(largest: int) -> list[int]:
    """1, 2, 4 … up to the largest."""
    return [1 << k for k in range(int(largest).bit_length())]


def stride_of(m: int) -> int:
    """Samples of a signal smoothed over m that say something new."""
    return max(1, m // 8)


def condition(values: Array, is_velocity: bool) -> Motion:
    """Take out gaps, spikes and drift, each told in the notes."""
    notes: list[str] = []
    if len(values) >= _SHORTEST and not np.isfinite(values).all():
        cycle = _cycle(_motion(_bridged(values), is_velocity))
        values = _bridged(values[_longest_piece(values, max(1.0, 0.25 * cycle), notes)])
    if len(values) < _SHORTEST:
        raw = values if is_velocity else np.diff(values)
        return Motion(raw - raw.mean() if len(raw) else raw, raw, 0.0, is_velocity, tuple(notes))
    values, spikes = _without_spikes(values, is_velocity)
    if spikes:
        notes.append(f"{spikes} spikes removed")
    motion = _motion(values, is_velocity)
    width = int(_DRIFT_CYCLES * _cycle(motion))
    if 2 * width >= len(values):
        return Motion(motion.velocity, motion.raw, motion.noise, is_velocity, tuple(notes))
    drift = _running_mean(motion.velocity, width)
    if float(drift.std()) > 0.1 * float(np.sqrt(max(_signal_variance(motion), 0.0))):
        notes.append("drift removed")
    return Motion(motion.velocity - drift, motion.raw, motion.noise, is_velocity, tuple(notes))


def _running_mean(values: Array, width: int) -> Array:
    from scipy.ndimage import uniform_filter1d

    mean: Array = uniform_filter1d(values, max(1, width), mode="reflect")
    return mean


def denoised(motion: Motion) -> tuple[Array, Array]:
    """The velocity made of those lines only that stand out of the noise, and their power over rfft's bins."""
    velocity = motion.velocity[: _handy(len(motion.velocity))]
    spectrum = np.fft.rfft(velocity)
    turn = np.linspace(0.0, np.pi, len(spectrum))
    gain = np.ones(len(turn)) if motion.measured_velocity else 2.0 - 2.0 * np.cos(turn)
    power = np.abs(spectrum) ** 2
    hidden = (power <= CERTAIN * len(velocity) * motion.noise**2 * gain) | (turn == 0.0)
    spectrum[hidden] = 0.0
    power[hidden] = 0.0
    return np.fft.irfft(spectrum, len(velocity)), power


def line_share(power: Array, bands: int) -> float:
    """Part of the energy in the strongest bands, each 6 % to either side."""
    left, total, found = power.copy(), float(power.sum()), 0.0
    for _ in range(bands):
        peak = int(np.argmax(left))
        band = slice(int(peak / 1.06), int(peak * 1.06) + 2)
        found += float(left[band].sum())
        left[band] = 0.0
    return found / total if total > 0.0 else 0.0


def _handy(count: int) -> int:
    """Of many samples, so many that their Fourier transform is fast."""
    return count - count % 1024 if count > 1 << 16 else count


def trend(motion: Motion, m: int, start: int, windows: int) -> Trend:
    """How the velocity's size changes from a sample on."""
    parts = np.array_split(motion.smoothed(m)[start:], windows)
    envelope = np.sqrt(np.maximum([float(p.var()) - motion.noise_at(m) for p in parts], 0.0))
    third = max(1, windows // 3)
    first, last = float(envelope[:third].mean()), float(envelope[-third:].mean())
    if float(np.ptp(envelope)) == 0.0:
        return Trend(envelope, 1.0, 0.0)
    ranks = np.argsort(np.argsort(envelope)).astype(float)
    order = float(np.corrcoef(ranks, np.arange(windows))[0, 1])
    return Trend(envelope, last / max(first, 1e-300), order)


def count_turns(velocity: Array, low: float, high: float) -> int:
    """How often a signal goes from above `high` to below `low`."""
    side = np.where(velocity > high, 1, np.where(velocity < low, -1, 0)).astype(np.int8)
    side = side[side != 0]
    return int(np.sum((side[:-1] > 0) & (side[1:] < 0)))


def _motion(values: Array, is_velocity: bool, notes: tuple[str, ...] = ()) -> Motion:
    raw = values if is_velocity else np.diff(values)
    return Motion(raw - raw.mean(), raw, _noise(values), is_velocity, notes)


def _noise(values: Array) -> float:
    """Standard deviation of white noise: the lesser of what third differences and the spectrum's floor allow."""
    rough = np.diff(values, 3)
    local = float(np.median(np.abs(rough - np.median(rough)))) / 0.6745 / np.sqrt(20.0)
    values = values[: _handy(len(values))]
    line = np.linspace(values[0], values[-1], len(values))
    floor = np.median(np.abs(np.fft.rfft(values - line)) ** 2) / np.log(2.0) / len(values)
    return float(min(local, np.sqrt(floor)))


def _signal_variance(motion: Motion) -> float:
    m = motion.quiet_scale()
    return float(motion.smoothed(m, stride_of(m)).var()) - motion.noise_at(m)


def _cycle(motion: Motion) -> float:
    """Samples of a cycle, roughly; what is slower than a part of the record is left out."""
    steady = motion.velocity - _running_mean(motion.velocity, len(motion.velocity) // _COARSE)
    motion = Motion(steady, motion.raw, motion.noise, motion.measured_velocity)
    m = motion.quiet_scale()
    velocity = motion.smoothed(m)
    band = _BAND * float(np.abs(velocity).mean())
    return len(velocity) / max(1, count_turns(velocity, -band, band))


def _bridged(values: Array) -> Array:
    """Gaps filled by straight lines."""
    good = np.isfinite(values)
    if good.all():
        return values
    places = np.arange(len(values))
    return np.interp(places, places[good], values[good])


def _longest_piece(values: Array, longest_gap: float, notes: list[str]) -> slice:
    """The longest part without a gap longer than that."""
    bad = np.concatenate([[False], ~np.isfinite(values), [False]])
    edges = np.flatnonzero(bad[1:] != bad[:-1])
    starts, stops = edges[::2], edges[1::2]
    cuts = stops - starts > longest_gap
    if len(starts) > np.sum(cuts):
        notes.append(f"{len(starts) - int(np.sum(cuts))} short gaps bridged")
    if not cuts.any():
        return slice(0, len(values))
    begins, ends = np.concatenate([[0], stops[cuts]]), np.concatenate([starts[cuts], [len(values)]])
    i = int(np.argmax(ends - begins))
    used = f"{ends[i] - begins[i]} of {len(values)} samples"
    notes.append(f"{int(np.sum(cuts))} long gaps: only the longest piece is used, {used}")
    return slice(int(begins[i]), int(ends[i]))


def _without_spikes(values: Array, is_velocity: bool) -> tuple[Array, int]:
    """Single samples far from both sides replaced; but a velocity's pulses of slip are no spikes."""
    from scipy.ndimage import median_filter

    away = values - median_filter(values, 5, mode="nearest")
    low, high = np.quantile(values, [0.1, 0.9])
    deviation = 1.4826 * float(np.median(np.abs(away)))
    spikes = np.abs(away) > max(_SPIKES[0] * deviation, _SPIKES[1] * float(high - low))
    beside = np.abs(np.stack([np.roll(values, 1), np.roll(values, -1)]) - (values - away)).max(axis=0)
    spikes &= np.abs(away) > 3.0 * beside
    count = int(np.sum(spikes))
    if count == 0 or count == len(values):
        return values, 0
    cleaned = _bridged(np.where(spikes, np.nan, values))
    if is_velocity and count >= 5 and abs(float(np.mean(np.sign(away[spikes])))) > 0.6:
        rest = cleaned[: _handy(len(cleaned))]
        power = np.abs(np.fft.rfft(rest - _running_mean(rest, len(rest) // _COARSE))) ** 2
        if line_share(power, 3) < _LINES_LEFT:  # nothing is left without them
            return values, 0
    return cleaned, count
