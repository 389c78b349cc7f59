"""What kind of vibration a history shows, with the evidence: see the regimes in docs/result-format.md."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.spectra import upward_crossings
from brakecli.history import History
from brakecli.model import ContactState


class Regime(StrEnum):
    """The paper's three regimes, and what cannot be told."""

    DAMPED = "damped"
    RELAXATION = "relaxation"
    QUASI_HARMONIC = "quasi-harmonic"
    UNDECIDED = "undecided"


class Excitation(StrEnum):
    """Where the energy of a sustained motion comes from."""

    SELF_EXCITED = "self-excited"
    FORCED = "forced"
    NONE = "none"


WINDOWS = 40
"""Equal parts of the history whose amplitudes make the envelope."""
LONGEST = 1 << 20
"""Samples at the end of the history in which cycles are counted and lines are weighed."""
SETTLED_WITHIN = 0.05  # of the final amplitude: windows that are settled
REACH_WITHIN = 0.02  # of the final peak to peak of x: its least and largest values in windows that are settled
DECAYED_TO = 0.02  # of the largest amplitude: a motion that has died out
FEWEST_CYCLES = 10
SAMPLES_PER_CYCLE = 8
STICK_CYCLES = 0.8  # part of the cycles that must stick for relaxation
HARMONIC_SHARE = 0.8  # of the energy of vx in the fundamental and its harmonics, or in the forced lines


@dataclass(frozen=True)
class Verdict:
    """The regime of a history, its numbers (SI units) over the settled part, and the reasons in plain words."""

    regime: Regime
    excitation: Excitation
    frequency: float | None  # Hz, fundamental of vx when sustained
    amplitude: float  # m, half of peak to peak of x
    settled_from: int  # sample
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    reasons: tuple[str, ...]
    evidence: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Context:
    """What is known of the case behind a history: U (m/s), whether U and Q are constant, forced lines (Hz)."""

    belt_speed: float
    steady: bool = True
    forced: tuple[float, ...] = ()


def forced_lines(belt_speed: float, waves_per_metre: Sequence[float], highest: float) -> tuple[float, ...]:
    """Frequencies (Hz, up to `highest`) at which the passing roughness acts: each wave's, its multiples, and
    the sums and differences of two, which a contact that opens adds.
    """
    base = [abs(belt_speed) * waves for waves in waves_per_metre]
    multiples = {n * f for f in base for n in range(1, 11)}
    pairs = {abs(f + sign * g) for f in base for g in base for sign in (1, -1)}
    return tuple(sorted(f for f in multiples | pairs if 0.0 < f <= highest))


def classify(history: History, context: Context) -> Verdict:
    """The regime of a run's history."""
    half = history.samples // 2
    state = history.read("state", half, history.samples)
    gone, stuck = bool(np.all(state == ContactState.SEPARATED)), bool(np.all(state == ContactState.STICK))
    if gone:
        reason = "the shoe has lost contact for good; check the sign and size of load.force"
        return _verdict(history, half, Regime.UNDECIDED, reason)
    if stuck and context.belt_speed == 0.0:
        return _verdict(history, half, Regime.DAMPED, "the shoe has come to rest, sticking to the standing wheel")
    if stuck:
        reason = "the shoe sticks throughout and is carried along by the wheel; run longer"
        return _verdict(history, half, Regime.UNDECIDED, reason)
    if history.samples < 4 * WINDOWS:
        return _verdict(history, half, Regime.UNDECIDED, f"fewer than {4 * WINDOWS} samples; run longer")
    (envelope, least, largest), centres = _windows(history)
    last = slice(-WINDOWS // 4, None)
    final = float(np.mean(envelope[last]))
    evidence = {"envelope_final": final, "envelope_largest": float(envelope.max()), **_slope(envelope, centres)}
    if not context.steady:
        reason = "the wheel's speed or the load changes with time, so the motion cannot settle"
        return _verdict(history, half, Regime.UNDECIDED, reason, evidence)
    if final <= DECAYED_TO * envelope.max():
        share = final / envelope.max() if envelope.max() > 0.0 else 0.0
        reason = f"the vibration has died out: vx has fallen to {share:.2g} of its largest amplitude"
        return _verdict(history, half, Regime.DAMPED, reason, evidence)
    if (forced := _forced_share(history, context, half)) >= HARMONIC_SHARE:
        reason = f"only the roughness shakes the shoe: {forced:.0%} of the energy of vx lies on its lines"
        evidence |= {"forced_share": forced}
        return _verdict(history, half, Regime.DAMPED, reason, evidence, Excitation.FORCED)
    settled = np.abs(envelope - final) <= SETTLED_WITHIN * final
    for bound in (least, largest):
        settled &= np.abs(bound - np.mean(bound[last])) <= REACH_WITHIN * np.mean((largest - least)[last])
    first = WINDOWS - int(np.argmin(settled[::-1])) if not settled.all() else 1
    if first > WINDOWS - WINDOWS // 4:
        if _is_steady(evidence):  # an amplitude that beats or wanders, without a trend
            return _sustained(history, context, half, evidence)
        return _verdict(history, half, Regime.UNDECIDED, _unsettled(evidence), evidence)
    start = first * history.samples // WINDOWS
    return _sustained(history, context, start, evidence)


def _sustained(history: History, context: Context, start: int, evidence: dict[str, float]) -> Verdict:
    """The regime of a motion whose amplitude has settled from sample `start` on."""
    begin = max(start, history.samples - LONGEST)
    velocity = history.read("vx", begin, history.samples)
    velocity = velocity - velocity.mean()
    crossings = upward_crossings(velocity, 0.3 * float(velocity.std()))
    cycles = len(crossings) - 1
    if cycles < FEWEST_CYCLES:
        reason = f"only {max(cycles, 0)} cycles in the settled part; run longer"
        return _verdict(history, start, Regime.UNDECIDED, reason, evidence)
    period = float(crossings[-1] - crossings[0]) / cycles
    frequency = 1.0 / (period * history.interval)
    density, lines = _power(velocity, history.interval)
    harmonic = _share(density, lines, [n * frequency for n in range(1, 1 + int(0.5 * period))])
    state = history.read("state", begin, history.samples)
    sticks = np.flatnonzero((state[1:] == ContactState.STICK) & (state[:-1] != ContactState.STICK)) + 1
    per_cycle = np.histogram(sticks, crossings)[0]
    stick_cycles = float(np.mean(per_cycle > 0))
    evidence |= {
        "cycles": float(cycles),
        "harmonic_share": harmonic,
        "stick_cycles": stick_cycles,
        "stick_episodes_per_cycle": float(np.mean(per_cycle)),
        "samples_per_cycle": period,
    }
    if period < SAMPLES_PER_CYCLE:
        reason = f"only {period:.1f} samples a cycle; reduce output.sample_interval"
        return _verdict(history, start, Regime.UNDECIDED, reason, evidence)
    if stick_cycles >= STICK_CYCLES:
        regime, excitation = Regime.RELAXATION, Excitation.SELF_EXCITED
        reason = f"sustained, with stick in {stick_cycles:.0%} of {cycles} cycles"
    elif stick_cycles == 0.0 and harmonic >= HARMONIC_SHARE:
        regime, excitation = Regime.QUASI_HARMONIC, Excitation.SELF_EXCITED
        reason = f"sustained without stick: {harmonic:.0%} of the energy of vx in one line and its harmonics"
    else:
        reason = (
            f"irregular: stick in {stick_cycles:.0%} of the cycles, {harmonic:.0%} of the energy of vx in one "
            "line and its harmonics; run longer, or look at the spectrum"
        )
        return _verdict(history, start, Regime.UNDECIDED, reason, evidence)
    return _verdict(history, start, regime, reason, evidence, excitation, frequency)


def _forced_share(history: History, context: Context, start: int) -> float:
    """Part of the energy of vx, from sample `start` on, on the lines at which the roughness acts."""
    if not context.forced:
        return 0.0
    velocity = history.read("vx", max(start, history.samples - LONGEST), history.samples)
    power, frequencies = _power(velocity - velocity.mean(), history.interval)
    return _share(power, frequencies, context.forced)


def _verdict(
    history: History,
    start: int,
    regime: Regime,
    reason: str,
    evidence: dict[str, float] | None = None,
    excitation: Excitation = Excitation.NONE,
    frequency: float | None = None,
) -> Verdict:
    """Add the means and fractions from sample `start` on, read in pieces."""
    lowest, highest = _extremes(history, start, history.samples)
    count, stick, lost, friction = history.samples - start, 0, 0, 0.0
    for begin in range(start, history.samples, LONGEST):
        end = min(begin + LONGEST, history.samples)
        state = history.read("state", begin, end)
        stick += int(np.sum(state == ContactState.STICK))
        lost += int(np.sum(state == ContactState.SEPARATED))
        friction += float(np.sum(history.read("friction_force", begin, end)))
    return Verdict(
        regime=regime,
        excitation=excitation,
        frequency=frequency,
        amplitude=0.5 * (highest - lowest),
        settled_from=start,
        stick_fraction=stick / count,
        contact_loss_fraction=lost / count,
        mean_friction_force=friction / count,
        reasons=(reason,),
        evidence=evidence or {},
    )


def _windows(history: History) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """In equal windows, rows of: standard deviation of vx (m/s), least and largest x (m); and the times of their
    centres (s).
    """
    edges = np.linspace(0, history.samples, WINDOWS + 1).astype(int)
    rows = [(_deviation(history, begin, end), *_extremes(history, begin, end)) for begin, end in pairwise(edges)]
    return np.array(rows).T, 0.5 * (edges[:-1] + edges[1:]) * history.interval


def _deviation(history: History, begin: int, end: int) -> float:
    """Standard deviation of vx, read in pieces, with sums taken from its first value on."""
    count, total, square = 0, 0.0, 0.0
    first = float(history.read("vx", begin, begin + 1)[0])
    for start in range(begin, end, LONGEST):
        values = history.read("vx", start, min(start + LONGEST, end)) - first
        count, total = count + len(values), total + float(values.sum())
        square += float(values @ values)
    return float(np.sqrt(max(square / count - (total / count) ** 2, 0.0)))


def _extremes(history: History, begin: int, end: int) -> tuple[float, float]:
    """Least and largest x, read in pieces."""
    least, largest = np.inf, -np.inf
    for start in range(begin, end, LONGEST):
        values = history.read("x", start, min(start + LONGEST, end))
        least, largest = min(least, float(values.min())), max(largest, float(values.max()))
    return least, largest


def _slope(envelope: NDArray[np.float64], centres: NDArray[np.float64]) -> dict[str, float]:
    """Slope of the logarithm of the last half of the envelope (1/s) with its standard error."""
    last = envelope[WINDOWS // 2 :]
    if not last.min() > 0.0:
        return {}
    (slope, _), covariance = np.polyfit(centres[WINDOWS // 2 :], np.log(last), 1, cov=True)
    return {"envelope_slope": float(slope), "envelope_slope_error": float(np.sqrt(max(covariance[0, 0], 0.0)))}


def _is_steady(evidence: dict[str, float]) -> bool:
    """Whether the last half of the envelope shows no trend beyond its scatter."""
    return abs(evidence.get("envelope_slope", np.inf)) <= 3.0 * evidence.get("envelope_slope_error", 0.0)


def _unsettled(evidence: dict[str, float]) -> str:
    """Why the envelope has no settled end, and for how long to go on."""
    slope = evidence.get("envelope_slope")
    if not slope:
        return "the motion comes and goes; run longer"
    word = "growing" if slope > 0.0 else "decaying"
    return f"still {word} at {abs(slope):.3g} 1/s; run at least {3.0 / abs(slope):.2g} s longer"


def _power(values: NDArray[np.float64], interval: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power of a signal under a Hann window, and its frequencies (Hz)."""
    scale = float(np.max(np.abs(values))) or 1.0
    power = np.abs(np.fft.rfft(values / scale * np.hanning(len(values)))) ** 2
    return power, np.fft.rfftfreq(len(values), interval).astype(np.float64)


def _share(power: NDArray[np.float64], frequencies: NDArray[np.float64], lines: Sequence[float]) -> float:
    """Part of the power that lies on lines, each four bins wide on either side (the Hann window's main lobe
    and what the line wanders within the record).
    """
    total = float(power.sum())
    if not lines or total == 0.0:
        return 0.0
    chosen = np.zeros(len(power), dtype=bool)
    for line in lines:
        bin_ = round(line / frequencies[1])
        chosen[max(bin_ - 4, 0) : bin_ + 5] = True
    return float(power[chosen].sum()) / total
