"""A measured signal without gaps, spikes and drift: its velocity at any smoothing, and the noise in it."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from brakecli.analysis.regime.spectra import line_share, rises
from brakecli.analysis.spectrum import Array

CERTAIN = 15.0  # a line's power over the mean of the noise, which reaches it in one bin of three million
_SPIKE_DEVIATIONS = 8.0  # by which a spike leaves the median of its neighbours
_OUTER = 0.1  # part of the values at each end that the range leaves out, as spikes are there
DRIFT_CYCLES = 8.0  # over which drift is averaged
_SHORTEST = 8  # samples in which noise can be told
DEVIATION = 1.4826  # standard deviation of a normal distribution over the median of the distances from its middle


@dataclass(frozen=True)
class Velocity:
    """A velocity per sample, which is the difference of a displacement or force, and the noise in it."""

    values: Array
    mean: float  # that was taken from it
    noise: float  # standard deviation of one sample of the signal
    measured: bool  # otherwise it is the difference of what was measured
    first: int = 0  # of its samples in the record, of which gaps may have left a part

    @cached_property
    def _primitive(self) -> Array:
        """Running sum of the velocity; of a displacement, that of the displacement itself."""
        total = np.concatenate([[0.0], np.cumsum(self.values)])
        return total if self.measured else np.concatenate([[0.0], np.cumsum(total)])

    def smoothed(self, m: int, stride: int = 1) -> Array:
        """The velocity, smoothed over m samples; that of a displacement twice, since its noise is steeper."""
        c = self._primitive
        if self.measured:
            return (c[m::stride] - c[:-m:stride]) / m
        return (c[2 * m :: stride] - 2.0 * c[m:-m:stride] + c[: -2 * m : stride]) / m**2

    def thinned(self, m: int) -> Array:
        """Samples of the velocity smoothed over m samples, as many as differ enough to be worth a look."""
        return self.smoothed(m, max(1, m // 8))

    def noise_at(self, m: int) -> float:
        """Variance of the noise of the velocity smoothed over m samples."""
        return self.noise**2 / m if self.measured else 2.0 * self.noise**2 / m**3

    @cached_property
    def scales(self) -> list[tuple[int, float]]:
        """Smoothings m = 1, 2, 4 … that leave the motion above the noise, with the part of the noise.

        What moves little over m samples, beside the largest change, has been smoothed away.
        """
        every = [1 << k for k in range(max(1, len(self.values) // 60).bit_length())]
        sizes = {m: float(self.thinned(m).var()) for m in every}
        noise = {m: self.noise_at(m) / max(size, 1e-300) for m, size in sizes.items()}
        # The noise of high frequencies would hide in a velocity what the displacement shows.
        moves = {m: size if self.measured else m * m * size for m, size in sizes.items()}
        clear = [m for m in every if noise[m] < 0.6]  # of the variance, at most, where slips are sought
        most = max((moves[m] for m in (clear if self.measured else every)), default=0.0)
        return [(m, noise[m]) for m in clear if moves[m] >= (0.15 if self.measured else 0.15**2) * most]

    @cached_property
    def quiet(self) -> int:
        """The least smoothing at which noise is a small part of the variance; otherwise the quietest."""
        parts = [(share, m) for m, share in self.scales]
        return next((m for share, m in parts if share <= 0.02), min(parts, default=(1.0, 1))[1])

    def levels(self, m: int, start: int, windows: int) -> Array:
        """Standard deviations in windows from a sample on, smoothed over m samples, without the noise."""
        parts = np.array_split(self.smoothed(m)[start:], windows)
        return np.sqrt(np.maximum([float(p.var()) - self.noise_at(m) for p in parts], 0.0))

    def denoised(self, *, hann: bool = False) -> tuple[Array, Array]:
        """The velocity made of those lines only that stand out of the noise, and their power over rfft's bins."""
        values = self.values
        window = np.hanning(len(values)) if hann else np.ones(1)
        spectrum = np.fft.rfft(values * window)
        turn = np.linspace(0.0, np.pi, len(spectrum))
        gain = np.ones(len(turn)) if self.measured else 2.0 - 2.0 * np.cos(turn)
        power = np.abs(spectrum) ** 2
        lines = (power > CERTAIN * len(values) * np.mean(window**2) * self.noise**2 * gain) & (turn > 0.0)
        return np.fft.irfft(np.where(lines, spectrum, 0.0), len(values)), np.where(lines, power, 0.0)


def cleaned(values: Array, order: int) -> tuple[Velocity, list[str]]:
    """The velocity of a signal without its gaps and spikes; notes report each of them.

    `order` says of which derivative of the displacement the values are: 0, 1 or 2.
    """
    notes: list[str] = []
    first = 0
    if len(values) >= _SHORTEST and not np.isfinite(values).all():
        cycle = _cycle(_velocity(bridge(values), order > 0))
        # a straight line over a quarter of a cycle changes no turning point by much
        values, first = _longest_piece(values, max(1.0, 0.25 * cycle), notes)
        values = bridge(values)
    if len(values) >= _SHORTEST:
        values = _without_spikes(values, order > 0, notes)
    velocity = replace(_velocity(values, order > 0), first=first)
    if order < 2 or not velocity.scales:  # the sum of noise would not look like noise
        return velocity, notes
    values = np.cumsum(velocity.values)
    width = int(DRIFT_CYCLES * _cycle(velocity))
    slow = uniform_filter1d(values, width) if 2 * width <= len(values) else 0.0
    return replace(_velocity(values - slow, True), first=first), notes


def without_drift(velocity: Velocity, cycle: float, notes: list[str]) -> Velocity:
    """The velocity without what is slower than some cycles, which have at least so many samples."""
    width = int(DRIFT_CYCLES * max(cycle, _cycle(velocity))) if len(velocity.values) >= _SHORTEST else 0
    if not 0 < 2 * width <= len(velocity.values):
        return velocity
    drift = uniform_filter1d(velocity.values, width)
    m = velocity.quiet
    variance = float(velocity.thinned(m).var()) - velocity.noise_at(m)
    if float(drift.std()) > 0.1 * float(np.sqrt(max(variance, 0.0))):  # of the motion: less is not worth a note
        notes.append("drift removed")
    return replace(velocity, values=velocity.values - drift)


def _velocity(values: Array, is_velocity: bool) -> Velocity:
    """Velocity with its noise, the lesser of what third differences and the spectrum's floor allow."""
    raw = values if is_velocity else np.diff(values)
    noise = 0.0
    mean = float(raw.mean()) if len(raw) else 0.0
    if len(values) >= _SHORTEST:
        rough = np.diff(values, 3)  # has 20 times the variance of noise, whose median size is 0.6745 deviations
        local = float(np.median(np.abs(rough - np.median(rough)))) / 0.6745 / np.sqrt(20.0)
        line = np.linspace(values[0], values[-1], len(values))
        floor = np.median(np.abs(np.fft.rfft(values - line)) ** 2) / np.log(2.0) / len(values)
        noise = float(min(local, np.sqrt(floor)))
    return Velocity(raw - mean, mean, noise, is_velocity)


def _cycle(velocity: Velocity) -> float:
    """Samples of a cycle, roughly: ripple of less than 0.3 of the mean size of the velocity is none."""
    velocity = replace(velocity, values=_without_slow(velocity.values))
    values = velocity.smoothed(velocity.quiet)
    band = 0.3 * float(np.abs(values).mean())
    return len(values) / max(1, len(rises(-values, -band, band)))


def _without_slow(values: Array) -> Array:
    """Values without what is slower than a 24th of the record."""
    mean: Array = uniform_filter1d(values, max(1, len(values) // 24))
    return values - mean


def bridge(values: Array) -> Array:
    """Gaps filled by straight lines."""
    good = np.isfinite(values)
    places = np.arange(len(values))
    return values if good.all() else np.interp(places, places[good], values[good])


def without_spikes(values: Array, order: int) -> Array:
    """A signal without its gaps and spikes, as long as it was; `order` as of `cleaned`."""
    values = bridge(values)
    return _without_spikes(values, order > 0, []) if len(values) >= _SHORTEST else values


def _longest_piece(values: Array, longest_gap: float, notes: list[str]) -> tuple[Array, int]:
    """The longest part without a gap of more samples than `longest_gap`, and its first sample."""
    bad = np.concatenate([[False], ~np.isfinite(values), [False]])
    gaps = np.flatnonzero(bad[1:] != bad[:-1]).reshape(-1, 2)
    cuts = gaps[np.diff(gaps)[:, 0] > longest_gap]
    if len(cuts) < len(gaps):
        notes.append(f"short gaps bridged: {len(gaps) - len(cuts)}")
    if not len(cuts):
        return values, 0
    pieces = np.array([0, *cuts.flat, len(values)]).reshape(-1, 2)
    begin, end = pieces[np.argmax(np.diff(pieces))]
    used = f"{end - begin} of {len(values)} samples"
    notes.append(f"long gaps: {len(cuts)}, so that only the longest piece is used, {used}")
    return values[begin:end], int(begin)


def _far(values: Array, away: Array) -> Array:
    """By what a spike leaves the median of its neighbours, which others leave by `away`; along the last axis."""
    low, high = np.quantile(values, [_OUTER, 1.0 - _OUTER], axis=-1)
    deviation = DEVIATION * np.median(np.abs(away), axis=-1)
    far: Array = np.maximum(_SPIKE_DEVIATIONS * deviation, 0.35 * (high - low))
    return far


def _without_spikes(values: Array, is_velocity: bool, notes: list[str]) -> Array:
    """Replace single samples far from both sides. A velocity's pulses of slip are not spikes.

    They leave the record's level, and that of the samples beside them: a loud part is not far from itself.
    """
    away = values - median_filter(values, 5, mode="nearest")
    spikes = np.abs(away) > _far(values, away)
    beside = np.abs(np.stack([np.roll(values, 1), np.roll(values, -1)]) - (values - away)).max(axis=0)
    spikes &= np.abs(away) > 3.0 * beside
    places = np.flatnonzero(spikes)
    for side in (np.arange(-24, 0), np.arange(1, 25)):  # the louder of which a spike has to leave; a choice
        there = np.clip(places[:, None] + side, 0, len(values) - 1)
        # a tenth of normal numbers leave their middle by more than 1.645 deviations
        beyond = _SPIKE_DEVIATIONS * np.quantile(np.abs(away[there]), 1.0 - _OUTER, axis=-1) / 1.645
        spikes[places] &= np.abs(away[places]) > np.maximum(_far(values[there], away[there]), beyond)
    count = int(np.sum(spikes))
    if count == 0:
        return values
    without = bridge(np.where(spikes, np.nan, values))
    # five, mostly of one sign, may be pulses of slip
    if is_velocity and count >= 5 and abs(float(np.mean(np.sign(away[spikes])))) > 0.6:
        power = np.abs(np.fft.rfft(_without_slow(without))) ** 2
        if line_share(power) < 0.5:  # nothing is left without them
            return values
    notes.append(f"spikes removed: {count}")
    return without
