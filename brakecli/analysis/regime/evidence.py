"""What the rules of the regimes go by: envelope, cycles, stick, lines and powers of a history."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.spectra import FEWEST_CYCLES, Array, interpolated, line_share, upward_crossings
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

FEWEST_SAMPLES = 160  # of a history that has an envelope
WINDOWS = 40
_LAST = slice(-10, None)  # windows that give the final values
_LONGEST = 1 << 20  # samples read at a time; cycles and lines are sought in at most so many, the last ones
LINE_BINS = 4  # on either side of a line: the Hann window's main lobe, and the line's drift within the record
_MOST_LINES = 8
_LEAST_LINE = 1e-3  # part of the energy
_HARMONICS = 5
_MOST_RISES_PER_CYCLE = 4
_GROUPS = 10  # of neighbouring cycles, of which a median is taken
_MOST_PLACES = 1 << 16  # samples at which a forced motion is computed
_FULL = 1.0 - 1e-9  # part of the pad that touches in full contact, but for rounding
_ENDS = (ContactState.STICK, ContactState.SEPARATED)
_MOST_COVERED = 0.2  # part of the band on lines, beyond which they are not told from what lies beside them
_LEAST_FORCED = 0.02  # of what lies beside the lines: that much of a decaying motion leaks onto them
_MIDDLE = np.array([1.0 / 6.0, 0.5, 5.0 / 6.0])  # quantiles
_TREND = 3.0  # standard errors of the slope of ten medians, beyond which an amplitude drifts
_BETWEEN = 1e-3  # of the energy of vx, between the lines of one rise, that makes a cycle of several
_SAME = 0.02  # squared difference, over twice the variance, between one period of vx and the next


@dataclass(frozen=True)
class Part:
    """The samples start … stop - 1 of a history, read in pieces that fit into memory."""

    history: History
    start: int
    stop: int

    def pieces(self, name: str) -> Iterator[Array]:
        """A variable, piece by piece."""
        for begin in range(self.start, self.stop, _LONGEST):
            yield self.history.read(name, begin, min(begin + _LONGEST, self.stop))

    def last(self, name: str) -> Array:
        """The last samples of a variable, as many as can be read at a time, without their mean."""
        values = self.history.read(name, max(self.start, self.stop - _LONGEST), self.stop)
        return np.asarray(values - values.mean())

    def mean(self, name: str) -> float:
        """Mean of a variable."""
        return sum(float(np.sum(piece)) for piece in self.pieces(name)) / (self.stop - self.start)

    def fraction(self, state: ContactState) -> float:
        """Part of the samples in a state of the contact."""
        return sum(int(np.sum(piece == state)) for piece in self.pieces("state")) / (self.stop - self.start)

    def extremes(self, name: str) -> tuple[float, float]:
        """Least and largest value of a variable."""
        bounds = [(float(piece.min()), float(piece.max())) for piece in self.pieces(name)]
        return min(bounds)[0], max(largest for _, largest in bounds)

    def amplitude(self, name: str) -> float:
        """Half of peak to peak of a variable."""
        least, largest = self.extremes(name)
        return 0.5 * (largest - least)

    def deviation(self, name: str) -> float:
        """Standard deviation of a variable, from sums that begin at its first value."""
        first, total, square = float(self.history.read(name, self.start, self.start + 1)[0]), 0.0, 0.0
        for piece in self.pieces(name):
            values = piece - first
            total, square = total + float(values.sum()), square + float(values @ values)
        count = self.stop - self.start
        return float(np.sqrt(max(square / count - (total / count) ** 2, 0.0)))

    def slides(self, slip: ContactState | None) -> bool:
        """Whether the whole pad touches and the shoe slips to this side (None: to any) at all of the samples."""
        if slip is not None and self.fraction(slip) < 1.0:
            return False
        return self.extremes("contact_fraction")[0] >= _FULL

    def places(self) -> tuple[Array, Array]:
        """Evenly spaced samples of x, not too many, and their times (s)."""
        stride = -(-(self.stop - self.start) // _MOST_PLACES)
        picked, first = [], self.start
        for begin in range(self.start, self.stop, _LONGEST):
            values = self.history.read("x", begin, min(begin + _LONGEST, self.stop))
            picked.append(values[first - begin :: stride])
            first += stride * len(picked[-1])
        x = np.concatenate(picked)
        return x, np.asarray(self.history.interval * (self.start + stride * np.arange(len(x))), np.float64)

    def power(self, force: str, velocity: str) -> tuple[float, float]:
        """Mean power (W) that the deviation of a force gives to the vibration, and its standard error.

        Four overlapping pieces of the last samples, under a window that weighs cut cycles at the ends little.
        """
        f, v = self.last(force), self.last(velocity)
        size = max(2 * len(f) // 5, 1)
        window = np.hanning(size + 2)[1:-1]
        starts = np.linspace(0, len(f) - size, 4).astype(int)
        means = [window @ (f[i : i + size] * v[i : i + size]) / window.sum() for i in starts]
        return float(np.mean(means)), float(np.std(means)) / 2.0

    @cached_property
    def _spectrum(self) -> tuple[Array, Array, float]:
        """Frequencies (Hz), power of the last samples of vx under a Hann window, to some scale, and its sum."""
        values = self.last("vx")
        scale = float(np.max(np.abs(values))) or 1.0
        power = np.abs(np.fft.rfft(values / scale * np.hanning(len(values)))) ** 2
        frequencies: Array = np.fft.rfftfreq(len(values), self.history.interval).astype(np.float64)
        return frequencies, power, float(power.sum())

    def share(self, lines: Sequence[float]) -> float:
        """Part of the energy of vx that lies on lines (Hz)."""
        frequencies, power, total = self._spectrum
        if not lines or total == 0.0:
            return 0.0
        return float(power[_near(lines, frequencies)].sum()) / total

    def narrow(self) -> float:
        """Part of the energy of vx in its three strongest narrow bands."""
        return line_share(self._spectrum[1])

    def covered(self, lines: Sequence[float]) -> float:
        """Part of the band up to the highest frequency of note that lines (Hz) take: what chance would find."""
        frequencies, power, total = self._spectrum
        band = 1 + int(np.searchsorted(np.cumsum(power), 0.99 * total)) + LINE_BINS
        return float(_near(lines, frequencies)[:band].mean()) if lines else 0.0

    def split(self, lines: Sequence[float]) -> tuple[float, float] | None:
        """Half of peak to peak of the parts of x on lines (Hz) and beside them, in the middle half of the samples.

        None where the lines lie too close for the length of the record, or hold no more than leaks onto them.
        """
        if self.covered(lines) > _MOST_COVERED or self.stop - self.start < FEWEST_SAMPLES // 4:
            return None
        x = self.last("x")
        window, middle = np.hanning(len(x)), slice(len(x) // 4, 3 * len(x) // 4)
        spectrum = np.fft.rfft(x * window)
        chosen = _near(lines, np.fft.rfftfreq(len(x), self.history.interval))
        chosen[: LINE_BINS // 2] = True
        forced = np.fft.irfft(np.where(chosen, spectrum, 0.0), len(x))[middle] / window[middle]
        forced -= 0.5 * (forced.max() + forced.min())
        parts = 0.5 * float(np.ptp(forced)), 0.5 * float(np.ptp(x[middle] - forced))
        return parts if parts[0] > _LEAST_FORCED * parts[1] else None

    def lines(self, forced: Sequence[float]) -> dict[str, list[float]]:
        """The strongest lines of vx: frequencies (Hz), parts of the energy, and 1 where roughness acts there."""
        frequencies, power, total = self._spectrum
        left, found, places = power.copy(), list[tuple[float, float, float]](), np.array(forced)
        while total > 0.0 and len(found) < _MOST_LINES:
            top = int(np.argmax(left))
            near = slice(max(top - LINE_BINS, 0), top + LINE_BINS + 1)
            share = float(left[near].sum()) / total
            if share < _LEAST_LINE:
                break
            left[near] = 0.0
            if top < FEWEST_CYCLES:
                continue  # a line of fewer cycles is not told from the drift of the mean
            frequency = interpolated(frequencies, power, top)
            distance = np.abs(places - frequency).min(initial=np.inf)
            found.append((frequency, share, float(distance <= LINE_BINS * frequencies[1])))
        names = ("line_frequencies", "line_shares", "line_forced")
        return {name: [line[i] for line in found] for i, name in enumerate(names)}


def _near(lines: Sequence[float], frequencies: NDArray[Any]) -> NDArray[np.bool_]:
    """Which frequencies of a spectrum belong to lines (Hz)."""
    chosen = np.zeros(len(frequencies), dtype=bool)
    for line in lines:
        middle = round(line / frequencies[1])
        chosen[max(middle - LINE_BINS, 0) : middle + LINE_BINS + 1] = True
    return chosen


def median(values: Array) -> tuple[float, float]:
    """Median, and half of the range of the middle two thirds."""
    last = len(values) - 1
    low, middle, high = np.interp(last * _MIDDLE, np.arange(last + 1), np.sort(values)).tolist()
    return middle, 0.5 * (high - low)


def line(x: Array, y: Array) -> tuple[float, float]:
    """Slope of the line through some points, by least squares, and its standard error."""
    away, rest = x - x.mean(), y - y.mean()
    slope = float(away @ rest / (away @ away))
    rest = rest - slope * away
    return slope, math.sqrt(float(rest @ rest / (away @ away)) / (len(x) - 2))


def swings(part: Part, edges: Array) -> Array:
    """Half of peak to peak of x (m) in each cycle; `edges` part the last samples.

    Between samples an extreme value is that of a parabola.
    """
    x = part.last("x")
    inner, before, after = x[1:-1], x[:-2], x[2:]
    bend, tops = 2.0 * inner - before - after, []
    for sign in (1.0, -1.0):
        extreme = (sign * inner >= sign * before) & (sign * inner > sign * after)
        refined = sign * x
        refined[1:-1][extreme] += (sign * (after - before) ** 2 / (8.0 * np.where(bend, bend, 1.0)))[extreme]
        tops.append(np.maximum.reduceat(refined[: int(edges[-1])], np.asarray(edges[:-1], int)))
    return np.asarray(0.5 * (tops[0] + tops[1]))


class Envelope:
    """Standard deviations of vx (m/s) in equal windows; `evidence`: the last, the largest and the slope (1/s)."""

    def __init__(self, history: History) -> None:
        """Take a history of at least `FEWEST_SAMPLES`."""
        edges = np.linspace(0, history.samples, WINDOWS + 1).astype(int)
        if history.samples > _LONGEST:
            windows = [Part(history, begin, end) for begin, end in pairwise(edges)]
            self.vx, *self._x = np.array([(each.deviation("vx"), *each.extremes("x")) for each in windows]).T
        else:
            x, vx = (history.read(name, 0, history.samples) for name in ("x", "vx"))
            starts, counts = edges[:-1], np.diff(edges)
            self._x = [each.reduceat(x, starts) for each in (np.minimum, np.maximum)]
            away = vx - np.repeat(vx[starts], counts)
            mean, square = (np.add.reduceat(each, starts) / counts for each in (away, away * away))
            self.vx = np.sqrt(np.maximum(square - mean**2, 0.0))
        self.final, self.largest = float(np.mean(self.vx[_LAST])), float(self.vx.max())
        self.evidence = {"envelope_final": self.final, "envelope_largest": self.largest}
        half, centres = slice(WINDOWS // 2, None), np.array(0.5 * (edges[:-1] + edges[1:]) * history.interval)
        if self.vx[half].min() > 0.0:
            slope, error = line(centres[half], np.log(self.vx[half]))
            self.evidence |= {"envelope_slope": slope, "envelope_slope_error": error}

    def settled_window(self, within: float, reach: float) -> int | None:
        """The window, never the first, from which on all are settled; None if fewer than ten are."""
        settled = np.abs(self.vx - self.final) <= within * self.final
        least, largest = self._x
        span = float(np.mean((largest - least)[_LAST]))
        for bound in self._x:
            settled &= np.abs(bound - np.mean(bound[_LAST])) <= reach * span
        first = WINDOWS - int(np.argmin(settled[::-1])) if not settled.all() else 1
        return first if first <= WINDOWS - 10 else None


@dataclass(frozen=True)
class Cycles:
    """What the cycles of vx show, which are counted by its rises through the mean; medians with their spread."""

    evidence: dict[str, Any]
    frequency: float  # Hz
    amplitude: float  # m
    amplitude_spread: float
    stick_fraction: float
    contact_loss_fraction: float
    limited: float  # part of the groups of cycles in which the shoe sticks, leaves the wheel or overtakes it
    drift: "Drift"  # of the amplitude
    detuning: "Drift"  # of the period
    force_variation: float  # N, peak to peak of the friction force


def cycles_of(part: Part, slip: ContactState | None = None) -> Cycles | None:
    """The cycles of a part; None if there are none. `slip` is the side to which the shoe slips in steady sliding.

    Stick, loss of contact and frequency are medians of ten groups of neighbouring cycles, so that it does not
    matter how samples fall into each cycle.
    """
    velocity = part.last("vx")
    crossings, rises = _beginnings(part, velocity)
    if len(crossings) < 4:
        return None
    cycles = len(crossings) - 1
    edges = np.linspace(0, cycles, min(cycles, _GROUPS) + 1).astype(int)
    groups = crossings[edges]
    period, period_spread = median(np.diff(groups) / np.diff(edges))
    state = part.history.read("state", part.stop - len(velocity), part.stop)
    sticks = np.flatnonzero((state[1:] == ContactState.STICK) & (state[:-1] != ContactState.STICK)) + 1
    per_cycle = np.histogram(sticks, crossings)[0]
    begin, end = groups[:-1].astype(int), groups[1:].astype(int) + 1

    def shares(found: NDArray[np.bool_]) -> Array:
        """Part of the samples of each group."""
        count = np.concatenate([[0], np.cumsum(found)])
        return np.asarray((count[end] - count[begin]) / (end - begin))

    places = np.sort(crossings % 1.0)  # within their samples: where cycles last whole samples, all at one
    unseen = float(np.diff(places, append=places[0] + 1.0).max())

    def time_in(which: ContactState) -> tuple[float, float]:
        """Part of a cycle, and its spread, with the part of a sample that no cycle has seen."""
        there = state == which
        middle, spread = median(shares(there))
        return middle, max(spread, unseen * float(np.sum(there[1:] & ~there[:-1])) / cycles / period)

    (stick, stick_spread), (loss, loss_spread) = (time_in(which) for which in _ENDS)
    frequency = 1.0 / (period * part.history.interval)
    first, *higher = (part.share([n * frequency]) for n in range(1, _HARMONICS + 1))
    evidence = {
        "cycles": float(cycles),
        "samples_per_cycle": period,
        "rises_per_cycle": float(rises),
        "fundamental_share": first,
        "harmonic_share": part.share([n * frequency for n in range(1, 1 + int(0.5 * period))]),
        "harmonics": [float(np.sqrt(share / first)) for share in higher if first > 0.0],
        "stick_cycles": float(np.mean(per_cycle > 0)),
        "stick_episodes_per_cycle": float(np.mean(per_cycle)),
        "frequency_spread": frequency * period_spread / period,
        "stick_spread": stick_spread,
        "contact_loss_spread": loss_spread,
    }
    limited = float(np.mean(shares(state != slip) > 0.0))
    sizes = swings(part, crossings)
    drift, detuning = _drift(sizes), _drift(np.diff(crossings))
    force, whole = part.history.read("friction_force", part.stop - len(velocity), part.stop), crossings.astype(int)
    most, least = (each.reduceat(force[: whole[-1]], whole[:-1]) for each in (np.maximum, np.minimum))
    amplitude, spread = median(sizes)
    missed = 3.0 / 128.0 * (2.0 * np.pi / period) ** 4 * amplitude  # of a crest between two samples: parabola
    medians = amplitude, max(spread, unseen * missed), stick, loss
    evidence["force_variation_largest"] = float(
        (most - least)[2 * cycles // 3 :].max()
    )  # the start has gone there
    return Cycles(evidence, frequency, *medians, limited, drift, detuning, median(most - least)[0])


def _beginnings(part: Part, velocity: Array) -> tuple[Array, int]:
    """Where cycles begin, and how many rises each holds: one, unless lines lie between those of one."""
    crossings = upward_crossings(velocity, 0.3 * float(velocity.std()))
    if len(crossings) < 2:
        return crossings, 1
    period = float(crossings[-1] - crossings[0]) / (len(crossings) - 1)
    close = 2.0 * _SAME * float(velocity.var())
    for rises in range(1, _MOST_RISES_PER_CYCLE + 1):  # after which the motion repeats
        shift = round(rises * period)
        if 0 < shift < len(velocity) // 2 and np.mean((velocity[shift:] - velocity[:-shift]) ** 2) <= close:
            longest = 1.0 / (rises * period * part.history.interval)
            between = part.share([n * longest for n in range(1, _HARMONICS * rises) if n % rises])
            return (crossings[::rises], rises) if between > _BETWEEN else (crossings, 1)
    return crossings, 1


class Drift(NamedTuple):
    """Part of itself by which a number changes from the first third of the cycles to the last."""

    part: float
    sure: bool  # whether it is more than chance


def _drift(sizes: Array) -> Drift:
    """The drift of a number, one for each cycle."""
    first, *_, last = (median(third)[0] for third in np.array_split(sizes, 3) if len(third))
    groups = np.array([median(group)[0] for group in np.array_split(sizes, min(len(sizes), _GROUPS))])
    places = np.arange(len(groups)) - 0.5 * (len(groups) - 1)
    slope = float(places @ groups / (places @ places))
    rest = groups - groups.mean() - slope * places
    error = float(np.std(rest) / (np.std(places) * np.sqrt(max(len(groups) - 2, 1))))
    return Drift(last / first - 1.0 if first > 0.0 else 0.0, abs(slope) > _TREND * error)
