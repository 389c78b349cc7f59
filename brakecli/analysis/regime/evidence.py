"""What verdicts go by: envelope, stick, lines and powers of a history."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.spectra import line_share
from brakecli.analysis.spectrum import FEWEST_CYCLES, Array, interpolated
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

FEWEST_SAMPLES = 160  # of a history that has an envelope
WINDOWS = 40
LAST = 10  # windows of the last quarter, which gives the final values
LONGEST = 1 << 20  # samples read at a time; cycles and lines are sought in at most so many, the last ones
LINE_BINS = 4  # on either side of a line: the Hann window's main lobe, and the line's drift within the record
GROUPS = 10  # of neighbouring values, whose means or medians are taken
FULL = 1.0 - 1e-9  # part of the pad that touches in full contact, but for rounding


def tenths(samples: int) -> tuple[int, int]:
    """The sample that ends the first tenth of so many, and the one that begins the last tenth."""
    return -(-samples // 10), samples - -(-samples // 10)


def last_quarter(samples: int) -> int:
    """The sample that begins the last quarter of so many."""
    return samples * (WINDOWS - LAST) // WINDOWS


@dataclass(frozen=True)
class Stretch:
    """The samples start … stop - 1 of a history, read in pieces that fit into memory.

    Of many histories at once, most of its numbers are arrays with one for each.
    """

    history: History
    start: int
    stop: int

    def pieces(self, name: str) -> Iterator[Array]:
        """A variable, piece by piece."""
        for begin in range(self.start, self.stop, LONGEST):
            yield self.history.read(name, begin, min(begin + LONGEST, self.stop))

    def last(self, name: str) -> Array:
        """The last samples of a variable, as many as can be read at a time, without their mean."""
        values = self.history.read(name, max(self.start, self.stop - LONGEST), self.stop)
        return np.asarray(values - values.mean())

    def mean(self, name: str) -> Any:
        """Mean of a variable."""
        return sum(np.sum(piece, axis=-1) for piece in self.pieces(name)) / (self.stop - self.start)

    def fraction(self, state: ContactState) -> float:
        """Part of the samples of one history in a state of the contact."""
        number = int(state)  # which NumPy compares in half the time
        return sum(np.count_nonzero(piece == number) for piece in self.pieces("state")) / (self.stop - self.start)

    def since(self, name: str, holds: Callable[[Array], NDArray[np.bool_]]) -> NDArray[np.intp]:
        """The sample from which on something holds of a variable; `stop` where it does not hold at the end."""
        start: NDArray[np.intp] = np.asarray(self.start)
        for begin, piece in zip(range(self.start, self.stop, LONGEST), self.pieces(name), strict=True):
            broken = ~holds(piece)[..., ::-1]
            last = begin + broken.shape[-1] - broken.argmax(axis=-1)
            start = np.where(broken.any(axis=-1), last, start)
        return start

    def extremes(self, name: str) -> tuple[Any, Any]:
        """Least and largest value of a variable."""
        bounds = [
            (np.minimum.reduce(piece, axis=-1), np.maximum.reduce(piece, axis=-1)) for piece in self.pieces(name)
        ]
        least, largest = zip(*bounds, strict=True)
        return reduce(np.minimum, least), reduce(np.maximum, largest)

    def amplitude(self, name: str) -> Any:
        """Half of peak to peak of a variable."""
        least, largest = self.extremes(name)
        return 0.5 * (largest - least)

    def deviation(self, name: str) -> Any:
        """Standard deviation of a variable, from sums that begin at its first value."""
        first = self.history.read(name, self.start, self.start + 1)
        total = 0.0
        square = 0.0
        for piece in self.pieces(name):
            values = piece - first
            # no threads
            total = total + values.sum(axis=-1)
            square = square + np.square(values).sum(axis=-1)
        count = self.stop - self.start
        return np.sqrt(np.maximum(square / count - (total / count) ** 2, 0.0))

    def touches(self) -> bool:
        """Whether the whole pad touches at all of the samples of one history."""
        return bool(self.extremes("contact_fraction")[0] >= FULL)

    def places(self, name: str = "x") -> tuple[Array, Array]:
        """Evenly spaced samples of a variable, not too many, and their times (s)."""
        stride = -(-(self.stop - self.start) // (1 << 16))
        picked = []
        first = self.start
        for begin in range(self.start, self.stop, LONGEST):
            values = self.history.read(name, begin, min(begin + LONGEST, self.stop))
            picked.append(values[..., first - begin :: stride])
            first += stride * picked[-1].shape[-1]
        x = np.concatenate(picked, axis=-1)
        return x, np.asarray(self.history.interval * (self.start + stride * np.arange(x.shape[-1])), np.float64)

    @cached_property
    def _spectrum(self) -> tuple[Array, Array, float]:
        """Frequencies (Hz), power of the last samples of vx under a Hann window, to some scale, and its sum."""
        return _spectrum(self.last("vx"), self.history.interval)

    def share(self, lines: Sequence[float], bins: int = LINE_BINS) -> float:
        """Part of the energy of vx that lies on lines (Hz), with so many bins on either side."""
        frequencies, power, total = self._spectrum
        return float(power[_near(lines, frequencies, bins)].sum()) / total if lines and total else 0.0

    @property
    def strongest(self) -> tuple[float, float]:
        """Frequency (Hz) of the strongest line of vx, and half of its width."""
        frequencies, power, _ = self._spectrum
        top = FEWEST_CYCLES + int(np.argmax(power[FEWEST_CYCLES:]))
        return interpolated(frequencies, power, top), LINE_BINS * float(frequencies[1])

    def narrow(self) -> float:
        """Part of the energy of vx in its three strongest narrow bands."""
        return line_share(self._spectrum[1])

    def covered(self, lines: Sequence[float], bins: int = LINE_BINS) -> float:
        """Part of the band up to the highest frequency of note that lines (Hz) take: what chance would find."""
        frequencies, power, total = self._spectrum
        band = 1 + int(np.searchsorted(np.cumsum(power), 0.99 * total)) + bins
        return float(_near(lines, frequencies, bins)[:band].mean()) if lines else 0.0

    def split(self, lines: Sequence[float]) -> tuple[float, float] | None:
        """Half of peak to peak of the parts of x on lines (Hz) and beside them, in the middle half of the samples.

        None where the lines lie too close for the length of the record, or hold no more than leaks onto them.
        """
        if self.covered(lines) > 0.2 or self.stop - self.start < FEWEST_SAMPLES // 4:
            return None
        x = self.last("x")
        window = np.hanning(len(x))
        middle = slice(len(x) // 4, 3 * len(x) // 4)
        spectrum = np.fft.rfft(x * window)
        chosen = _near(lines, np.fft.rfftfreq(len(x), self.history.interval))
        chosen[: LINE_BINS // 2] = True
        forced = np.fft.irfft(np.where(chosen, spectrum, 0.0), len(x))[middle] / window[middle]
        forced -= 0.5 * (forced.max() + forced.min())
        parts = 0.5 * float(np.ptp(forced)), 0.5 * float(np.ptp(x[middle] - forced))
        return parts if parts[0] > 0.02 * parts[1] else None  # so much of a decaying motion leaks onto the lines

    def beside(self, name: str, lines: Sequence[float]) -> tuple[float, float]:
        """Part of the deviation of a variable that lies on no line (Hz), and half of its peak to peak."""
        values = self.last(name)
        spectrum = np.fft.rfft(values * np.hanning(len(values)))
        near = _near(lines, np.fft.rfftfreq(len(values), self.history.interval))
        near[: LINE_BINS // 2] = True
        beside = np.where(near, 0.0, spectrum)
        share = float(np.linalg.norm(beside)) / max(float(np.linalg.norm(spectrum)), 1e-300)
        return share, 0.5 * float(np.ptp(np.fft.irfft(beside, len(values))))

    def lines(self, forced: Sequence[float], quiet: float = 0.0) -> dict[str, list[float]]:
        """The strongest lines of vx: frequencies (Hz), parts of the energy, and 1 where roughness acts there.

        None where vx (m/s) is quiet: that is rounding.
        """
        frequencies, power, total = self._spectrum
        remaining = power.copy()
        strongest = list[tuple[float, float, float]]()
        chosen = _near(forced, frequencies)
        total = total if self.amplitude("vx") > quiet else 0.0
        while total > 0.0 and len(strongest) < 8:
            top = int(np.argmax(remaining))
            near = slice(max(top - LINE_BINS, 0), top + LINE_BINS + 1)
            share = float(remaining[near].sum()) / total
            if share < 1e-3:
                break
            remaining[near] = 0.0
            if top < FEWEST_CYCLES:
                continue  # a line of fewer cycles is not told from the drift of the mean
            strongest.append((interpolated(frequencies, power, top), share, float(chosen[top])))
        names = ("line_frequencies", "line_shares", "line_forced")
        return {name: [line[i] for line in strongest] for i, name in enumerate(names)}


def _spectrum(values: Array, interval: float) -> tuple[Array, Array, float]:
    """Frequencies (Hz), power of samples under a Hann window, to some scale, and its sum; the interval in s."""
    scale = float(np.max(np.abs(values))) or 1.0
    power = np.abs(np.fft.rfft(values / scale * np.hanning(len(values)))) ** 2
    frequencies: Array = np.fft.rfftfreq(len(values), interval).astype(np.float64)
    return frequencies, power, float(power.sum())


def _near(lines: Sequence[float], frequencies: NDArray[np.floating], bins: int = LINE_BINS) -> NDArray[np.bool_]:
    """Which frequencies of a spectrum belong to lines (Hz)."""
    chosen = np.zeros(len(frequencies), dtype=bool)
    for line in lines if len(frequencies) > 1 else ():
        middle = round(line / frequencies[1])
        chosen[max(middle - bins, 0) : middle + bins + 1] = True
    return chosen


@lru_cache(maxsize=4)
def _evenly(count: int) -> tuple[Array, float]:
    """Times of evenly spaced values in a record of length one, from its middle, and the sum of their squares."""
    time = (np.arange(count) + 0.5) / count
    away = time - time.mean()
    return away, float(away @ away)


def trend(values: Array) -> tuple[Any, Any]:
    """Change of evenly spaced values over their record, by a line of least squares, and its standard error."""
    away, squares = _evenly(values.shape[-1])
    residual = values - values.mean(axis=-1, keepdims=True)
    slope = np.vecdot(away, residual) / squares
    residual = residual - slope[..., None] * away
    return slope, np.sqrt(np.vecdot(residual, residual) / squares / (values.shape[-1] - 2))


def window_means(values: Array) -> Array:
    """Means of the rows in four overlapping pieces, under a window that weighs cut cycles at the ends little."""
    size = max(2 * len(values) // 5, 1)
    window = np.hanning(size + 2)[1:-1] / np.hanning(size + 2).sum()
    starts = np.linspace(0, len(values) - size, 4).astype(int)
    return np.array([window @ values[i : i + size] for i in starts])


def level_change(levels: Array) -> tuple[Any, Any]:
    """Change of the logarithm of a level over its record, with its standard error; nan where there is none.

    The error is that of the means of ten batches, or of three levels or more where there are fewer.
    """
    count = levels.shape[-1]
    batches = min(GROUPS, count)
    means = levels[..., count % batches :].reshape(*levels.shape[:-1], batches, -1).mean(axis=-1)
    positive = means.min(axis=-1, keepdims=True) > 0.0
    return trend(np.log(np.where(positive, means, math.nan)))
