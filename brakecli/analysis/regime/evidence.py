"""What the rules of the regimes go by: envelope, cycles, stick, lines, read from a history in pieces."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.spectra import upward_crossings
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState
from brakecli.solver.records import Coefficients

Array = NDArray[np.float64]

LONGEST = 1 << 20
"""Samples read at a time, and samples at the end of a history in which cycles are counted and lines weighed."""
LINE_BINS = 4
"""A line takes so many bins on either side: the Hann window's main lobe, and what it wanders within the record."""
MOST_LINES = 8
LEAST_LINE = 1e-3
HARMONICS = 5
MOST_CYCLES_PER_PERIOD = 4
SAME = 0.02  # squared difference, over twice the variance, between one period of vx and the next


def blocks(history: History, name: str, start: int, stop: int) -> Iterator[Array]:
    """A variable in pieces that fit into memory."""
    for begin in range(start, stop, LONGEST):
        yield history.read(name, begin, min(begin + LONGEST, stop))


def last_samples(history: History, name: str, start: int) -> Array:
    """The samples from `start` on, but no more than `LONGEST`, without their mean."""
    values = history.read(name, max(start, history.samples - LONGEST), history.samples)
    return np.asarray(values - values.mean())


def mean(history: History, name: str, start: int) -> float:
    """Mean of a variable from sample `start` on."""
    total = sum(float(np.sum(block)) for block in blocks(history, name, start, history.samples))
    return total / (history.samples - start)


def fraction_in_state(history: History, state: ContactState, start: int) -> float:
    """Part of the samples from `start` on in a state of the contact."""
    count = sum(int(np.sum(block == state)) for block in blocks(history, "state", start, history.samples))
    return count / (history.samples - start)


def extremes(history: History, name: str, start: int, stop: int) -> tuple[float, float]:
    """Least and largest value of a variable."""
    bounds = [(float(block.min()), float(block.max())) for block in blocks(history, name, start, stop)]
    return min(least for least, _ in bounds), max(largest for _, largest in bounds)


def deviation(history: History, name: str, start: int, stop: int) -> float:
    """Standard deviation of a variable, from sums that begin at its first value."""
    first, total, square = float(history.read(name, start, start + 1)[0]), 0.0, 0.0
    for block in blocks(history, name, start, stop):
        values = block - first
        total, square = total + float(values.sum()), square + float(values @ values)
    count = stop - start
    return float(np.sqrt(max(square / count - (total / count) ** 2, 0.0)))


def largest_values(history: History, start: int, belt_speed: float) -> dict[str, float]:
    """Half of peak to peak of y and of the velocities from sample `start` on, and the largest vx over U."""
    found = {}
    for name in ("y", "vx", "vy"):
        least, largest = extremes(history, name, start, history.samples)
        found[f"amplitude_{name}"] = 0.5 * (largest - least)
        if name == "vx" and belt_speed != 0.0:
            found["largest_vx_over_belt_speed"] = (largest if belt_speed > 0.0 else least) / belt_speed
    return found


@dataclass(frozen=True)
class Envelope:
    """The history in equal windows: standard deviation of vx (m/s), least and largest x (m), centres (s)."""

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
        """m/s."""
        return float(self.vx.max())

    def slope(self) -> dict[str, float]:
        """Slope of the logarithm of its last half (1/s) with its standard error; empty where it touches zero."""
        half = self.WINDOWS // 2
        if not self.vx[half:].min() > 0.0:
            return {}
        (slope, _), covariance = np.polyfit(self.centres[half:], np.log(self.vx[half:]), 1, cov=True)
        return {"envelope_slope": float(slope), "envelope_slope_error": float(np.sqrt(max(covariance[0, 0], 0.0)))}

    def settled_window(self, within: float, reach: float) -> int | None:
        """The first window, but the very first, from which on all are settled; None if fewer than the last ten."""
        settled = np.abs(self.vx - self.final) <= within * self.final
        span = float(np.mean((self.largest_x - self.least)[self.LAST]))
        for bound in (self.least, self.largest_x):
            settled &= np.abs(bound - np.mean(bound[self.LAST])) <= reach * span
        first = self.WINDOWS - int(np.argmin(settled[::-1])) if not settled.all() else 1
        return first if first <= self.WINDOWS - 10 else None


def envelope_of(history: History) -> Envelope:
    """The envelope of a history of at least `Envelope.FEWEST_SAMPLES`."""
    edges = np.linspace(0, history.samples, Envelope.WINDOWS + 1).astype(int)
    rows = [
        (deviation(history, "vx", begin, end), *extremes(history, "x", begin, end))
        for begin, end in pairwise(edges)
    ]
    vx, least, largest = np.array(rows).T
    return Envelope(vx, least, largest, np.array(0.5 * (edges[:-1] + edges[1:]) * history.interval))


@dataclass(frozen=True)
class Cycles:
    """Cycles of vx: how many, their period (samples), the fundamental frequency (Hz), and what else they show."""

    count: int
    period: float = 0.0
    frequency: float = 0.0
    evidence: dict[str, Any] = field(default_factory=dict)


def cycles_of(history: History, start: int) -> Cycles:
    """Count the cycles of vx from sample `start` on, by its rises through the mean.

    A motion that repeats only after two to four rises has that long a period.
    """
    velocity = last_samples(history, "vx", start)
    crossings = upward_crossings(velocity, 0.3 * float(velocity.std()))
    if len(crossings) < 2:
        return Cycles(0)
    period = float(crossings[-1] - crossings[0]) / (len(crossings) - 1)
    rises = _rises_per_period(velocity, period)
    crossings, period = crossings[::rises], period * rises
    frequency = 1.0 / (period * history.interval)
    power, frequencies = power_of(velocity, history.interval)
    multiples = [n * frequency for n in range(1, 1 + int(0.5 * period))]
    state = history.read("state", history.samples - len(velocity), history.samples)
    sticks = np.flatnonzero((state[1:] == ContactState.STICK) & (state[:-1] != ContactState.STICK)) + 1
    per_cycle = np.histogram(sticks, crossings)[0] if len(crossings) > 1 else np.zeros(1)
    evidence: dict[str, Any] = {
        "cycles": float(len(crossings) - 1),
        "samples_per_cycle": period,
        "rises_per_cycle": float(rises),
        "fundamental_share": share_of(power, frequencies, [frequency]),
        "harmonic_share": share_of(power, frequencies, multiples),
        "harmonics": harmonics_of(power, frequencies, frequency),
        "stick_cycles": float(np.mean(per_cycle > 0)),
        "stick_episodes_per_cycle": float(np.mean(per_cycle)),
    }
    return Cycles(len(crossings) - 1, period, frequency, evidence)


def _rises_per_period(velocity: Array, period: float) -> int:
    """After how many rises the motion repeats: the first number whose shifted copy is the same; else 1."""
    variance = float(velocity.var())
    for rises in range(1, MOST_CYCLES_PER_PERIOD + 1):
        shift = round(rises * period)
        if not 0 < shift < len(velocity) // 2 or variance == 0.0:
            break
        if float(np.mean((velocity[shift:] - velocity[:-shift]) ** 2)) <= 2.0 * SAME * variance:
            return rises
    return 1


def lines_of(power: Array, frequencies: Array, forced: Sequence[float]) -> dict[str, list[float]]:
    """The strongest lines of vx: frequencies (Hz), parts of its energy, and 1 where roughness acts there.

    A line is a peak with `LINE_BINS` on either side; what holds less than a thousandth is no line.
    """
    left, total = power.copy(), float(power.sum())
    found: dict[str, list[float]] = {"line_frequencies": [], "line_shares": [], "line_forced": []}
    while total > 0.0 and len(found["line_shares"]) < MOST_LINES:
        top = int(np.argmax(left))
        near = slice(max(top - LINE_BINS, 0), top + LINE_BINS + 1)
        share = float(left[near].sum()) / total
        if share < LEAST_LINE:
            break
        left[near] = 0.0
        distance = min((abs(line - frequencies[top]) for line in forced), default=np.inf)
        found["line_frequencies"].append(float(frequencies[top]))
        found["line_shares"].append(share)
        found["line_forced"].append(float(distance <= LINE_BINS * frequencies[1]))
    return found


def harmonics_of(power: Array, frequencies: Array, fundamental: float) -> list[float]:
    """Amplitudes of vx at the first multiples of a fundamental (Hz), over that of the fundamental."""
    parts = [share_of(power, frequencies, [n * fundamental]) for n in range(1, HARMONICS + 1)]
    return [float(np.sqrt(part / parts[0])) for part in parts[1:]] if parts[0] > 0.0 else []


def powers_of(history: History, start: int, c: Coefficients, belt: float, load: float) -> dict[str, float]:
    """Mean powers (W) from sample `start` on, at constant U (m/s) and Q (N): the belt's, and what becomes of it.

    What is left, `power_rest`, is the work of the roughness and the change of what is stored; on flat surfaces it
    falls with the length of the settled part.
    """
    sums = np.zeros(4)
    names = ("vx", "vy", "friction_force")
    pieces = zip(*(blocks(history, name, start, history.samples) for name in names), strict=True)
    for v_x, v_y, friction in pieces:
        sums += (
            belt * friction.sum(),
            -float(friction @ (v_x - belt)),
            float(c.b_xx * v_x @ v_x + 2.0 * c.b_xy * v_x @ v_y + c.b_yy * v_y @ v_y),
            load * (c.sin_beta * v_x.sum() + c.cos_beta * v_y.sum()),
        )
    taken, heat, dashpots, lifted = (float(value) for value in sums / (history.samples - start))
    return {
        "power_belt": taken,
        "power_friction": heat,
        "power_dashpots": dashpots,
        "power_load": lifted,
        "power_rest": taken - heat - dashpots - lifted,
    }


def power_of(values: Array, interval: float) -> tuple[Array, Array]:
    """Squared spectrum of a signal without mean under a Hann window, to some scale, and its frequencies (Hz)."""
    scale = float(np.max(np.abs(values))) or 1.0
    power = np.abs(np.fft.rfft(values / scale * np.hanning(len(values)))) ** 2
    return power, np.fft.rfftfreq(len(values), interval).astype(np.float64)


def share_of(power: Array, frequencies: Array, lines: Sequence[float]) -> float:
    """Part of the power that lies on lines (Hz)."""
    total = float(power.sum())
    if not lines or total == 0.0:
        return 0.0
    chosen = np.zeros(len(power), dtype=bool)
    for line in lines:
        bin_ = round(line / frequencies[1])
        chosen[max(bin_ - LINE_BINS, 0) : bin_ + LINE_BINS + 1] = True
    return float(power[chosen].sum()) / total
