"""Slips in a velocity: how much they skew it, where they are, and whether they are those of stick-slip.

Stick skews the distribution of the velocity: it stays long at the belt's, and is then short and fast in the other
direction. Smoothing over the m = 1, 2, 4 … samples that show this best serves any sampling rate and noise. Impacts
and spikes skew it as well, but a slip lasts until the belt has loaded the spring again, and nothing swings back.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from brakecli.analysis.regime.spectra import rises
from brakecli.analysis.signals.cleaning import DEVIATION, Velocity
from brakecli.analysis.signals.table import FEWEST_SAMPLES
from brakecli.analysis.spectrum import Array

_FEWEST = 10  # slips, below which their shape is not looked at
_MOST = 512  # slips whose shape is averaged
_AROUND = 5  # widths of a slip in which it would swing


@dataclass(frozen=True)
class Slips:
    """What skews a velocity most."""

    skewness: float = 0.0
    scale: int = 1  # samples over which the velocity is smoothed to see them
    places: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp), repr=False)  # the last before
    stick: float = 0.0  # part of the time between slips
    lasts: float = 0.0  # part of a slip that is left a quarter of a cycle later; 0 for a ring-down, or a spike
    swings: float = 0.0  # how far the velocity goes the other way beside, between and around slips, over them
    loaded: bool = False  # whether slips go with the time that has loaded them; random spikes do not

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.places)

    @property
    def often(self) -> float:
        """How many there are in a sample."""
        return (self.count - 1) / float(self.places[-1] - self.places[0])

    @property
    def stick_slip(self) -> bool:
        """Whether they can be slips between sticks."""
        least_lasting = 0.55  # of a slip: a spike and a ring-down leave nothing a quarter of a cycle later
        most_swinging = 0.6  # of a slip, the other way: what is struck swings back by as much as it was moved
        return self.lasts >= least_lasting and self.swings <= most_swinging and self.loaded


def seek(velocity: Velocity, certain: float) -> Slips:
    """The slips at the smoothing that shows them best, if the skewness is `certain`; otherwise at a quiet one."""
    if len(velocity.values) < FEWEST_SAMPLES:
        return Slips()
    sure = 4.0  # standard errors and deviations of noise, which chance does not reach
    largest = 0.0
    sign = 1.0
    scale = velocity.quiet
    for m, _ in velocity.scales:
        skewness = _skewness(velocity.thinned(m))
        if abs(skewness) > max(largest, sure * np.sqrt(6.0 * m / len(velocity.values))):
            largest = abs(skewness)
            sign = -np.sign(skewness)
            scale = m
    scale = scale if largest >= certain else velocity.quiet
    chosen = replace(velocity, values=sign * velocity.values)
    values = chosen.smoothed(scale)
    values = values - values.mean()
    bulk = values[values > 0.0]
    if not len(bulk):
        return Slips(largest)
    middle = float(np.median(bulk))
    noise = float(np.sqrt(velocity.noise_at(scale)))
    spread = middle + 3.0 * DEVIATION * float(np.median(np.abs(bulk - middle))) if largest >= certain else 0.0
    high = max(0.5 * middle, sure * noise, spread)
    begun = -0.25 * middle  # the other way by a quarter of the velocity in stick, a slip has begun
    places = rises(-values, begun, high)
    slips = Slips(largest, scale, places, stick=float(np.mean(values > -high)))
    return _shaped(slips, chosen) if slips.count >= _FEWEST else slips


def _skewness(values: Array) -> float:
    """Median of the parts of the record, which a single jump does not change."""
    parts = [piece - piece.mean() for piece in np.array_split(values, 7)]
    return float(np.median([np.mean(p * p * p) / max(float(np.mean(p * p)), 1e-100) ** 1.5 for p in parts]))


def _shaped(slips: Slips, velocity: Velocity) -> Slips:
    """What is left of the strong slips, what swings back, and whether time has loaded them."""
    scale = slips.scale
    x = np.concatenate([[0.0], np.cumsum(velocity.values)])
    # Where impulses and noise make the largest falls, a smoothed displacement shows where slips are.
    starts, depths = _falls(uniform_filter1d(x, 1 + scale // 2), slips.places, scale)
    if not len(depths):
        return slips
    strong = depths >= 0.4 * np.sort(depths)[-min(_FEWEST, len(depths))]  # of the tenth largest
    if strong.sum() < 3:  # the shape of weaker ones is not looked at
        return slips
    lasts = _lasting(x, starts[strong], scale) / max(float(depths[strong].mean()), 1e-300)
    returns = _returning(x, starts[strong], min(velocity.quiet, scale), scale)
    loaded = not velocity.measured or _loaded(velocity.values, starts, depths, scale)
    swings = abs(returns) + _swinging(velocity.smoothed(scale), starts[strong])
    return replace(slips, lasts=lasts, swings=swings, loaded=loaded)


def _falls(x: Array, places: NDArray[np.intp], scale: int) -> tuple[NDArray[np.intp], Array]:
    """Where the displacement falls most behind each place, and by how much."""
    falls = sliding_window_view(x[:-scale] - x[scale:], _AROUND * scale)
    near = falls[places[places < len(falls)]]
    return places[: len(near)] + near.argmax(axis=1), near.max(axis=1)


def _returning(x: Array, starts: NDArray[np.intp], fine: int, scale: int) -> float:
    """How far the velocity swings the other way around a slip, over the slip itself, in the median.

    Both count beyond what windows of the same length do in the middle between slips: that is noise and hum.
    """
    near = (x[fine:] - x[:-fine]) / fine
    waits = np.diff(starts)
    wide = int(min(max(_AROUND * scale, 0.125 * len(x) / len(starts)), 0.4 * np.median(waits))) + 1
    long = waits >= np.median(waits)
    between = starts[:-1][long] + waits[long] // 2
    exact = sliding_window_view(near, 2 * scale)
    fastest = starts + exact[np.minimum(starts, len(exact) - 1)].argmin(axis=1)
    low, high = _median_ends(near, fastest, wide)
    least, most = _median_ends(near, between, wide)
    slip = max(least - low, 0.25 * (most - least), 1e-300)  # no less than a quarter of what is between
    return float((high - most) / slip)


def _median_ends(values: Array, places: NDArray[np.intp], wide: int) -> tuple[float, float]:
    """Medians of the least and the largest value in windows that begin a quarter before places."""
    few = np.clip(places - wide // 4, 0, len(values) - wide)[:: 1 + len(places) // _MOST]
    windows = sliding_window_view(values, wide)[few]
    return float(np.median(windows.min(axis=1))), float(np.median(windows.max(axis=1)))


def _around(values: Array, starts: NDArray[np.intp], before: int, after: int) -> Array:
    """Mean of the values around starts, in which hum and noise cancel; empty where the record is too short."""
    inside = starts[(starts >= before) & (starts + after < len(values))]
    few = inside[:: 1 + len(inside) // _MOST]
    return np.mean([values[i - before : i + after + 1] for i in few], axis=0) if len(few) else np.zeros(0)


def _swinging(values: Array, starts: NDArray[np.intp]) -> float:
    """The largest velocity the other way around the mean slip, over that in it."""
    wide = 1
    while len(mean := _around(values, starts, wide, wide)):
        mean = mean - np.median(mean)
        if wide >= _AROUND * np.sum(mean < 0.5 * mean.min()):
            return float(mean.max() / max(-mean.min(), 1e-300))
        wide *= 2
    return 0.0


def _lasting(x: Array, starts: NDArray[np.intp], scale: int) -> float:
    """Mean fall of the displacement over slips, beside a common slope, seen from a quarter of a cycle around."""
    wide = int(max(3 * scale, 0.25 * len(x) / len(starts)))
    if not len(mean := _around(x, starts, wide, scale + wide)):
        return 0.0
    time = np.arange(-wide, scale + wide + 1)
    away = (time <= -(scale // 2)) | (time >= scale + scale // 2)
    terms = np.stack([np.ones(len(time)), time, time > 0.5 * scale], axis=1).astype(np.float64)
    return -float(np.linalg.lstsq(terms[away], mean[away] - mean[0], rcond=None)[0][2])


def _loaded(values: Array, starts: NDArray[np.intp], depths: Array, scale: int) -> bool:
    """Whether pulses are wider than spikes, or come regularly, or go with the time before or after them."""
    narrow = 2  # samples of a pulse that may be a spike
    wide = scale + 2 * narrow
    pulses = sliding_window_view(values, wide)[np.minimum(starts, len(values) - wide)]
    waits = np.diff(starts)
    first, median, last = np.quantile(waits, [0.25, 0.5, 0.75])
    width = np.median((pulses < 0.5 * pulses.min(axis=1, keepdims=True)).sum(axis=1))
    if width > narrow or last - first < 0.3 * median:
        return True
    along = np.corrcoef([depths[1:], depths[:-1], waits])[2, :2]
    return bool(np.nanmax(along) >= max(0.4, 2.5 / np.sqrt(len(waits))))  # chance does not reach 2.5/√n
