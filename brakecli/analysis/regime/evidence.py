"""What the rules of the regimes go by: envelope, cycles, stick, lines and powers of a history."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.spectra import upward_crossings
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

if TYPE_CHECKING:  # measured signals need not wait for compiled code
    from brakecli.solver.records import Coefficients

Array = NDArray[np.float64]

LONGEST = 1 << 20
"""Samples read at a time. Cycles are counted and lines weighed in at most so many samples, the last ones."""
LINE_BINS = 4
"""Bins that a line takes on either side: the Hann window's main lobe, and the line's drift within the record."""
MOST_LINES = 8
LEAST_LINE = 1e-3
HARMONICS = 5
MOST_RISES_PER_CYCLE = 4
SAME = 0.02  # squared difference, over twice the variance, between one period of vx and the next


@dataclass(frozen=True)
class Part:
    """The samples start … stop - 1 of a history, read in pieces that fit into memory."""

    history: History
    start: int
    stop: int

    def pieces(self, name: str) -> Iterator[Array]:
        """A variable, piece by piece."""
        for begin in range(self.start, self.stop, LONGEST):
            yield self.history.read(name, begin, min(begin + LONGEST, self.stop))

    def last(self, name: str) -> Array:
        """The last samples of a variable, at most `LONGEST`, without their mean."""
        values = self.history.read(name, max(self.start, self.stop - LONGEST), self.stop)
        return np.asarray(values - values.mean())

    def mean(self, name: str) -> float:
        """Mean of a variable."""
        return sum(float(np.sum(piece)) for piece in self.pieces(name)) / (self.stop - self.start)

    def fraction(self, state: ContactState) -> float:
        """Part of the samples in a state of the contact."""
        return sum(int(np.sum(piece == state)) for piece in self.pieces("state")) / (self.stop - self.start)

    def extremes(self, name: str) -> tuple[float, float]:
        """Least and largest value of a variable."""
        least, largest = zip(
            *((float(piece.min()), float(piece.max())) for piece in self.pieces(name)), strict=True
        )
        return min(least), max(largest)

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

    @cached_property
    def power(self) -> "Power":
        """Power spectrum of the last samples of vx, under a Hann window."""
        values = self.last("vx")
        scale = float(np.max(np.abs(values))) or 1.0
        power = np.abs(np.fft.rfft(values / scale * np.hanning(len(values)))) ** 2
        return Power(power, np.fft.rfftfreq(len(values), self.history.interval).astype(np.float64))


@dataclass(frozen=True)
class Power:
    """A power spectrum, to some scale, over frequencies (Hz)."""

    power: Array
    frequencies: Array

    def share(self, lines: Sequence[float]) -> float:
        """Part of the power that lies on lines (Hz)."""
        total = float(self.power.sum())
        if not lines or total == 0.0:
            return 0.0
        chosen = np.zeros(len(self.power), dtype=bool)
        for line in lines:
            middle = round(line / self.frequencies[1])
            chosen[max(middle - LINE_BINS, 0) : middle + LINE_BINS + 1] = True
        return float(self.power[chosen].sum()) / total

    def lines(self, forced: Sequence[float]) -> dict[str, list[float]]:
        """The strongest lines: frequencies (Hz), parts of the energy, and 1 where roughness acts there.

        A line is a peak with `LINE_BINS` on either side that holds at least a thousandth of the energy.
        """
        left, total = self.power.copy(), float(self.power.sum())
        found: dict[str, list[float]] = {"line_frequencies": [], "line_shares": [], "line_forced": []}
        while total > 0.0 and len(found["line_shares"]) < MOST_LINES:
            top = int(np.argmax(left))
            near = slice(max(top - LINE_BINS, 0), top + LINE_BINS + 1)
            share = float(left[near].sum()) / total
            if share < LEAST_LINE:
                break
            left[near] = 0.0
            distance = min((abs(line - self.frequencies[top]) for line in forced), default=np.inf)
            found["line_frequencies"].append(float(self.frequencies[top]))
            found["line_shares"].append(share)
            found["line_forced"].append(float(distance <= LINE_BINS * self.frequencies[1]))
        return found

    def harmonics(self, fundamental: float) -> list[float]:
        """Amplitudes at the first multiples of a fundamental (Hz), over that of the fundamental."""
        parts = [self.share([n * fundamental]) for n in range(1, HARMONICS + 1)]
        return [float(np.sqrt(part / parts[0])) for part in parts[1:]] if parts[0] > 0.0 else []


@dataclass(frozen=True)
class Envelope:
    """A history in equal windows: standard deviation of vx (m/s), least and largest x (m), centres (s)."""

    WINDOWS: ClassVar[int] = 40
    FEWEST_SAMPLES: ClassVar[int] = 160
    LAST: ClassVar[slice] = slice(-10, None)

    vx: Array
    least: Array
    largest_x: Array
    centres: Array

    @property
    def final(self) -> float:
        """Mean over the last windows, m/s."""
        return float(np.mean(self.vx[self.LAST]))

    @property
    def largest(self) -> float:
        """Largest value, m/s."""
        return float(self.vx.max())

    def slope(self) -> dict[str, float]:
        """Slope of the logarithm of its last half (1/s) with its standard error; empty where it touches zero."""
        half = self.WINDOWS // 2
        if not self.vx[half:].min() > 0.0:
            return {}
        (slope, _), covariance = np.polyfit(self.centres[half:], np.log(self.vx[half:]), 1, cov=True)
        return {"envelope_slope": float(slope), "envelope_slope_error": float(np.sqrt(max(covariance[0, 0], 0.0)))}

    def settled_window(self, within: float, reach: float) -> int | None:
        """The window, never the first, from which on all are settled; None if fewer than ten are."""
        settled = np.abs(self.vx - self.final) <= within * self.final
        span = float(np.mean((self.largest_x - self.least)[self.LAST]))
        for bound in (self.least, self.largest_x):
            settled &= np.abs(bound - np.mean(bound[self.LAST])) <= reach * span
        first = self.WINDOWS - int(np.argmin(settled[::-1])) if not settled.all() else 1
        return first if first <= self.WINDOWS - 10 else None


def envelope_of(history: History) -> Envelope:
    """The envelope of a history of at least `Envelope.FEWEST_SAMPLES`."""
    edges = np.linspace(0, history.samples, Envelope.WINDOWS + 1).astype(int)
    windows = [Part(history, begin, end) for begin, end in pairwise(edges)]
    vx, least, largest = np.array([(window.deviation("vx"), *window.extremes("x")) for window in windows]).T
    return Envelope(vx, least, largest, np.array(0.5 * (edges[:-1] + edges[1:]) * history.interval))


def cycles_of(part: Part) -> dict[str, Any]:
    """What the cycles of vx show; they are counted by its rises through the mean. Empty if there are none.

    A motion that repeats only after two to four rises has that long a period.
    """
    velocity = part.last("vx")
    crossings = upward_crossings(velocity, 0.3 * float(velocity.std()))
    if len(crossings) < 2:
        return {}
    period = float(crossings[-1] - crossings[0]) / (len(crossings) - 1)
    rises = _rises_per_cycle(velocity, period)
    crossings, period = crossings[::rises], period * rises
    frequency, power = 1.0 / (period * part.history.interval), part.power
    state = part.history.read("state", part.stop - len(velocity), part.stop)
    sticks = np.flatnonzero((state[1:] == ContactState.STICK) & (state[:-1] != ContactState.STICK)) + 1
    per_cycle = np.histogram(sticks, crossings)[0] if len(crossings) > 1 else np.zeros(1)
    return {
        "cycles": float(len(crossings) - 1),
        "samples_per_cycle": period,
        "rises_per_cycle": float(rises),
        "fundamental_share": power.share([frequency]),
        "harmonic_share": power.share([n * frequency for n in range(1, 1 + int(0.5 * period))]),
        "harmonics": power.harmonics(frequency),
        "stick_cycles": float(np.mean(per_cycle > 0)),
        "stick_episodes_per_cycle": float(np.mean(per_cycle)),
    }


def _rises_per_cycle(velocity: Array, period: float) -> int:
    """The least number of rises after which the motion repeats; 1 where it does not."""
    variance = float(velocity.var())
    for rises in range(1, MOST_RISES_PER_CYCLE + 1):
        shift = round(rises * period)
        if not 0 < shift < len(velocity) // 2 or variance == 0.0:
            break
        if float(np.mean((velocity[shift:] - velocity[:-shift]) ** 2)) <= 2.0 * SAME * variance:
            return rises
    return 1


def powers_of(part: Part, c: "Coefficients", belt: float, load: float) -> dict[str, float]:
    """Mean powers (W) at constant U (m/s) and Q (N): the belt's, and what becomes of it.

    What is left, `power_rest`, is the work of the roughness and the change of the energy in the links and the
    contact; on flat surfaces it falls with the length of the settled part.
    """
    sums = np.zeros(4)
    for v_x, v_y, friction in zip(*map(part.pieces, ("vx", "vy", "friction_force")), strict=True):
        sums += (
            belt * friction.sum(),
            -float(friction @ (v_x - belt)),
            float(c.b_xx * v_x @ v_x + 2.0 * c.b_xy * v_x @ v_y + c.b_yy * v_y @ v_y),
            load * (c.sin_beta * v_x.sum() + c.cos_beta * v_y.sum()),
        )
    taken, heat, dashpots, lifted = (float(value) for value in sums / (part.stop - part.start))
    return {
        "power_belt": taken,
        "power_friction": heat,
        "power_dashpots": dashpots,
        "power_load": lifted,
        "power_rest": taken - heat - dashpots - lifted,
    }
