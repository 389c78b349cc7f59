"""The regime of a measured signal, which carries no flags: see docs/measured-signals.md.

Stick shows in the distribution of the velocity: it stays long at one value, the belt's, and is then short and fast
in the other direction. So its skewness is large. The velocity is smoothed over m = 1, 2, 4 … samples, and the m
that shows the skewness best is used, so that one procedure serves any sampling rate and noise.
"""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.cleaning import CERTAIN, Velocity, cleaned, count_falls, line_share
from brakecli.analysis.regime.rules import Excitation, Regime

Array = NDArray[np.float64]

_FINE = 1000.0
"""Samples of a cycle, after interpolation, among which a plateau is sought."""
_PLATEAU_SAMPLES = 1 << 20
"""A plateau is sought in at most so many samples."""
_SHORTEST_PLATEAU = 0.03  # of the time
_PARTS = 7
_FEWEST_SAMPLES = 64


class Measurand(StrEnum):
    """What was measured; a force is that of a spring between the belt's friction and the frame."""

    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    FORCE = "force"


@dataclass(frozen=True)
class Signal:
    """Equally spaced values in SI units, NaN where there are none; `notes` report what reading has changed."""

    values: Array
    interval: float  # s
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class SignalThresholds:
    """Where the rules draw their lines; every verdict carries them."""

    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    decayed_to: float = 0.05
    """A motion has died out when its velocity has fallen to this part of its largest."""
    trend_order: float = 0.85
    """Rank correlation of the envelope with time from which it may grow or decay."""
    trend_ratio: float = 1.25
    """The envelope grows or decays if also its last third is so many times its first third, or the reverse."""
    trend_order_large: float = 0.6
    """The rank correlation that suffices for a change by `trend_ratio_large`."""
    trend_ratio_large: float = 4.0
    skewness_unlikely: float = 0.3
    """Skewness of the velocity up to which there is no stick, except for a short one at the belt's speed."""
    skewness_certain: float = 0.9
    """Skewness of the velocity from which there is stick. Two lines in step reach 0.816 and no more."""
    overtones: float = 0.03
    """Between these two it is stick if the third to eighth multiple hold this part of the energy."""
    plateau: float = 2.6
    """Time at the belt's speed, over the time next to it, from which it is stick; a sine reaches 2.41."""
    line_share: float = 0.7
    """Part of the energy of the velocity in three narrow bands in quasi-harmonic vibration."""


@dataclass(frozen=True)
class SignalVerdict:
    """The regime of a measured signal, its numbers (SI units), and the reasons in plain words.

    A measurement does not show where the energy comes from, so `excitation` is always none, nor whether contact
    was lost.
    """

    regime: Regime
    reasons: tuple[str, ...]
    excitation: Excitation = Excitation.NONE
    frequency: float | None = None  # Hz: strongest line, or events of stick per second
    amplitude: float | None = None  # m, half of peak to peak of x
    stick_fraction: float | None = None
    contact_loss_fraction: float | None = None
    evidence: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    thresholds: SignalThresholds = field(default_factory=SignalThresholds)


class Stick(NamedTuple):
    """What speaks for stick: skewness of the velocity, events, part of the time."""

    skewness: float
    events: int
    fraction: float


def classify_signal(
    signal: Signal,
    *,
    quantity: Measurand,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    thresholds: SignalThresholds = SignalThresholds(),
) -> SignalVerdict:
    """The regime of a measured signal; `belt_speed` in m/s, `stiffness` in N/m (of a force) where known."""
    size = float(np.nanmax(np.abs(signal.values), initial=0.0))  # squares of the smallest numbers must not vanish
    velocity = cleaned(signal.values / (size or 1.0), quantity == Measurand.VELOCITY)
    metres, belt = size, np.nan if belt_speed is None else abs(belt_speed)
    if quantity == Measurand.FORCE:
        known = np.nan if stiffness is None else stiffness
        metres, belt = size / known, belt * known
    if quantity == Measurand.VELOCITY:
        metres *= signal.interval
    else:
        belt *= signal.interval
    rules = _Rules(velocity, signal.interval, belt / (size or 1.0), thresholds)
    verdict = rules.verdict()
    amplitude = metres * velocity.amplitude(rules.start, rules.windows) if rules.above_noise else np.nan
    return replace(
        verdict,
        amplitude=amplitude if np.isfinite(amplitude) else None,
        evidence={**rules.evidence, "noise": size * velocity.noise},
        warnings=(*signal.notes, *velocity.notes),
    )


class _Rules:
    """The rules on one velocity: they gather evidence until one of them applies."""

    def __init__(self, velocity: Velocity, interval: float, belt: float, limits: SignalThresholds) -> None:
        self.velocity, self.interval, self.limits = velocity, interval, limits
        self.belt = belt  # the belt's speed, as the velocity would show it; NaN where it is not known
        self.duration = len(velocity.values) * interval
        self.scale, self.start, self.windows, self.above_noise = 1, 0, 1, True
        self.evidence: dict[str, float] = {}

    def verdict(self) -> SignalVerdict:
        """Apply the rules in their order; the first that applies decides. Only the amplitude is left out."""
        velocity, limits = self.velocity, self.limits
        count = len(velocity.values)
        if count < _FEWEST_SAMPLES:
            self.above_noise = False
            return self._undecided(f"only {count} samples in one piece; measure longer")
        self.scale = velocity.quiet_scale()
        stick = self.stick = self._stick()
        self.clean, self.power = velocity.denoised()
        self.evidence |= {"samples": float(count), "skewness": stick.skewness}
        self.evidence |= {"smoothed_over": float(self.scale), "events": float(stick.events)}
        if not velocity.variances:
            self.above_noise = False
            return self._undecided("nothing stands out of the noise; measure closer, or with less noise")
        cycles, self.frequency = self._cycles()
        self.windows = int(np.clip(cycles / 3.0, 1, 40))
        period = 1.0 / (self.frequency * self.interval)
        self.evidence |= {"cycles": cycles, "samples_per_cycle": period}
        if cycles < limits.fewest_cycles:
            return self._undecided(f"only {cycles:.0f} cycles; measure longer")
        if period < limits.samples_per_cycle:
            return self._undecided(f"only {period:.1f} samples a cycle; measure at a higher rate")
        return self._unsettled(cycles) or self._sticking() or self._without_stick()

    def _verdict(
        self, regime: Regime, reason: str, frequency: float | None = None, stick: float | None = None
    ) -> SignalVerdict:
        return SignalVerdict(regime, (reason,), frequency=frequency, stick_fraction=stick, thresholds=self.limits)

    def _undecided(self, reason: str) -> SignalVerdict:
        return self._verdict(Regime.UNDECIDED, reason)

    def _stick(self) -> Stick:
        """Skewness at the smoothing that shows it best, and the events of slip that go with it."""
        velocity, best, sign, scale = self.velocity, 0.0, 1.0, self.scale
        for m, _ in velocity.variances:
            skewness = _skewness(velocity.thinned(m))
            if abs(skewness) > max(best, 4.0 * np.sqrt(6.0 * m / len(velocity.values))):
                best, sign, scale = abs(skewness), -np.sign(skewness), m
        if best < self.limits.skewness_certain:
            scale = self.scale
        values = sign * velocity.smoothed(scale)
        values = values - values.mean()
        bulk = values[values > 0.0]
        if not len(bulk):
            return Stick(best, 0, 0.0)
        middle, noise = float(np.median(bulk)), float(np.sqrt(velocity.noise_at(scale)))
        events = count_falls(values, -max(0.5 * middle, 4.0 * noise), 0.25 * middle)
        return Stick(best, events, float(np.mean(values > -0.5 * middle)))

    def _cycles(self) -> tuple[float, float]:
        """How many cycles there are, and how many a second."""
        stick, strongest, length = self.stick, int(np.argmax(self.power)), len(self.clean) * self.interval
        certain = stick.skewness >= self.limits.skewness_certain and stick.events >= self.limits.fewest_cycles
        if certain or self.power[strongest] == 0.0:
            return float(stick.events), max(stick.events, 1) / self.duration
        return strongest * self.duration / length, max(strongest, 1) / length

    def _unsettled(self, cycles: float) -> SignalVerdict | None:
        """Decides where the motion has died out, still grows or decays; moves the start behind a transient."""
        limits, velocity = self.limits, self.velocity
        windows = int(np.clip(cycles / 3.0, 4, 40))
        whole = velocity.trend(self.scale, 0, windows)
        last, largest = float(whole.envelope[-max(1, windows // 4) :].mean()), float(np.sort(whole.envelope)[-3])
        floor = np.sqrt(velocity.noise_at(self.scale))
        died_to = last / max(largest, 1e-300)
        self.evidence |= {"envelope_ratio": whole.ratio, "envelope_order": whole.order, "died_to": died_to}
        early = bool(whole.envelope[: windows // 2].max() >= largest)
        if early and last <= max(limits.decayed_to * largest, min(0.2 * largest, 0.5 * floor)):
            return self._verdict(
                Regime.DAMPED, f"the vibration has died out: down to {died_to:.2g} of its largest"
            )
        found = whole
        for start in (0, len(velocity.values) // 4, len(velocity.values) // 2):
            found = velocity.trend(self.scale, start, windows)
            change, order = max(found.ratio, 1.0 / max(found.ratio, 1e-9)), abs(found.order)
            slow = change > limits.trend_ratio and order > limits.trend_order
            fast = change > limits.trend_ratio_large and order > limits.trend_order_large
            if not slow and not fast:
                self.start = start
                return None
        word, end = ("growing", "settled") if found.ratio > 1.0 else ("decaying", "died out")
        return self._undecided(f"still {word}; measure longer, until it has {end}")

    def _sticking(self) -> SignalVerdict | None:
        """Decides where stick has skewed the velocity; undecided if noise hides whether two lines in step did."""
        limits, stick, velocity, total = self.limits, self.stick, self.velocity, float(self.power.sum())
        if stick.events < limits.fewest_cycles or stick.skewness < limits.skewness_unlikely:
            return None
        if stick.skewness < limits.skewness_certain:
            strongest = int(np.argmax(self.power))
            bands = [slice(int(0.97 * n * strongest), int(1.03 * n * strongest) + 2) for n in range(3, 9)]
            overtones = sum(float(self.power[band].sum()) for band in bands) / total
            self.evidence |= {"overtones": overtones}
            if overtones <= limits.overtones:
                turn = 2.0 * np.pi * min(4.0 * self.frequency * self.interval, 0.5)
                gain = 1.0 if velocity.measured else 2.0 - 2.0 * np.cos(turn)
                if CERTAIN * len(velocity.values) * velocity.noise**2 * gain <= limits.overtones / 3.0 * total:
                    return None
                what = "the velocity is skewed, by stick or by two lines in step, and noise hides which"
                return self._undecided(f"{what}; measure with less noise, or for longer")
        reason = f"{stick.events} events of stick and slip: skewness of the velocity {stick.skewness:.2g}"
        return self._verdict(Regime.RELAXATION, reason, stick.events / self.duration, stick.fraction)

    def _without_stick(self) -> SignalVerdict:
        """Decides on a motion that neither grows nor dies out, nor sticks for long."""
        top, beside = self._plateau()
        self.evidence |= {"plateau": top / max(beside, 1e-9), "plateau_time": top}
        flat = top > self.limits.plateau * beside
        if flat and np.isfinite(self.belt):
            fraction = max(0.0, top - 0.5 * beside)
            reason = (
                f"the velocity stays at the belt's speed for {fraction:.0%} of the time, in most cycles or all"
            )
            return self._verdict(Regime.RELAXATION, reason, self.frequency, fraction)
        share = line_share(self.power, 3)
        self.evidence |= {"line_share": share}
        if flat:
            return self._undecided(
                "the velocity is cut off flat on one side, as by short stick; give the belt speed"
            )
        least, most = np.quantile(self.clean + self.velocity.raw.mean(), [0.01, 0.99])
        if any(0.95 * self.belt <= v <= 1.2 * self.belt for v in (-least, most)):
            return self._undecided(
                "the velocity just reaches the belt's; with less noise it would show if it stays"
            )
        if share < self.limits.line_share:
            return self._undecided(
                f"irregular without stick: {share:.0%} of the energy in three lines; measure longer"
            )
        reason = f"sustained without stick: {share:.0%} of the energy of the velocity in at most three lines"
        return self._verdict(Regime.QUASI_HARMONIC, reason, self.frequency, 0.0)

    def _plateau(self) -> tuple[float, float]:
        """Part of the time at the belt's speed (or an extreme velocity), and part of the time next to it."""
        finer = int(np.ceil(_FINE / self.evidence["samples_per_cycle"]))
        clean = self.clean[: _PLATEAU_SAMPLES // finer]
        clean = finer * np.fft.irfft(np.fft.rfft(clean), finer * len(clean))
        absolute = clean + self.velocity.raw.mean()
        reach = 0.5 * float(np.ptp(np.quantile(clean, [0.01, 0.99])))
        levels = (self.belt, -self.belt) if np.isfinite(self.belt) else _extreme_modes(absolute, reach)
        results = [(0.0, 1.0)]
        for level in levels:
            away = np.abs(absolute - level) / reach
            for width in (0.02, 0.01, 0.005):
                at = float(np.mean(away <= width))
                if at >= _SHORTEST_PLATEAU:
                    results.append((at, float(np.mean((away > width) & (away <= 3.0 * width)))))
        return max(results, key=lambda r: r[0] / max(r[1], 1e-9))


def _skewness(values: Array) -> float:
    """Median of the skewness of equal parts, which a single jump does not change."""
    parts = [part - part.mean() for part in np.array_split(values, _PARTS)]
    return float(np.median([np.mean(p * p * p) / max(float(np.mean(p * p)), 1e-100) ** 1.5 for p in parts]))


def _extreme_modes(values: Array, reach: float) -> list[float]:
    """The most frequent values of the upper and of the lower quarter of the range."""
    edges = np.arange(values.min(), values.max() + 0.01 * reach, 0.01 * reach)
    counts, quarter = np.histogram(values, edges)[0], max(1, len(edges) // 4)
    places = int(np.argmax(counts[:quarter])), len(counts) - quarter + int(np.argmax(counts[-quarter:]))
    return [float(0.5 * (edges[i] + edges[i + 1])) for i in places]
