"""The regime of a measured signal, which carries no flags: see docs/measured-signals.md.

Stick shows in the distribution of the velocity: long at one value, the belt's, then short and fast in the other
direction. So its skewness is large. The velocity is smoothed over m samples; of m = 1, 2,
4 … that one is taken which shows the skewness best, so that one procedure serves any sampling rate and noise.
"""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.cleaning import (
    CERTAIN,
    Motion,
    condition,
    count_turns,
    denoised,
    line_share,
    stride_of,
    trend,
)
from brakecli.analysis.regime.rules import Excitation, Regime

Array = NDArray[np.float64]

_FINE = 1000.0
"""Samples of a cycle, after interpolation, among which a plateau is sought …"""
_PLATEAU_SAMPLES = 1 << 20
"""… in so many samples at most."""
_PARTS = 7
_FEWEST_SAMPLES = 64
_SHORTEST_PLATEAU = 0.03
"""Of the time."""


class Quantity(StrEnum):
    """What was measured; a force is that of a spring between the belt's friction and the frame."""

    DISPLACEMENT = "displacement"
    VELOCITY = "velocity"
    FORCE = "force"


@dataclass(frozen=True)
class Signal:
    """Equally spaced values, NaN where there are none, in SI units; `notes` tell what reading has changed."""

    values: Array
    interval: float  # s
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Thresholds:
    """Where the rules draw their lines; kept with every verdict."""

    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    decayed_to: float = 0.05
    """A motion has died out when its velocity has fallen to this part of its largest."""
    trend_order: float = 0.85
    """Rank correlation of the envelope with time beyond which it may grow or decay …"""
    trend_ratio: float = 1.25
    """… if its last third is so many times its first third, or the reverse."""
    trend_order_large: float = 0.6
    trend_ratio_large: float = 4.0
    """The same for a change that is large."""
    skewness_unlikely: float = 0.3
    """Skewness of the velocity up to which there is no stick, except for a short one at the belt's speed …"""
    skewness_certain: float = 0.9
    """… and from which there is. Two lines in step reach 0.816 and no more."""
    overtones: float = 0.03
    """Between these two it is stick if the third to eighth multiple hold this part of the energy."""
    plateau: float = 2.6
    """Time at the belt's speed, over the time next to it, from which it is stick; a sine reaches 2.41."""
    line_share: float = 0.7
    """Part of the energy of the velocity in three narrow bands in quasi-harmonic vibration."""


@dataclass(frozen=True)
class MeasuredVerdict:
    """The regime of a measured signal, its numbers (SI units), and the reasons in plain words.

    What a measurement cannot tell: where the energy comes from, so `excitation` is always none, and whether
    contact was lost.
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
    thresholds: Thresholds = field(default_factory=Thresholds)


@dataclass(frozen=True)
class Stick:
    """What speaks for stick: skewness of the velocity, events, part of the time."""

    skewness: float
    events: int
    fraction: float


def classify_signal(
    signal: Signal,
    *,
    quantity: Quantity,
    belt_speed: float | None = None,
    stiffness: float | None = None,
    thresholds: Thresholds = Thresholds(),
) -> MeasuredVerdict:
    """The regime of a measured signal; `belt_speed` in m/s, `stiffness` in N/m (of a force) where known."""
    size = float(np.nanmax(np.abs(signal.values), initial=0.0))  # squares of the smallest numbers must not vanish
    motion = condition(signal.values / (size or 1.0), quantity == Quantity.VELOCITY)
    scale, level = size, None if belt_speed is None else abs(belt_speed)
    if quantity == Quantity.FORCE:
        scale = np.nan if stiffness is None else size / stiffness
        level = None if belt_speed is None or stiffness is None else abs(belt_speed) * stiffness
    if quantity == Quantity.VELOCITY:
        scale *= signal.interval
    elif level is not None:
        level *= signal.interval
    judge = _Judge(motion, signal.interval, None if level is None else level / (size or 1.0), thresholds)
    regime, reason, frequency, stick = judge.verdict()
    amplitude = scale * motion.amplitude(judge.start, judge.windows) if judge.above_noise else np.nan
    return MeasuredVerdict(
        regime,
        (reason,),
        frequency=frequency,
        amplitude=amplitude if np.isfinite(amplitude) else None,
        stick_fraction=stick,
        evidence={**judge.evidence, "noise": size * motion.noise},
        warnings=(*signal.notes, *motion.notes, *judge.notes),
        thresholds=thresholds,
    )


class _Judge:
    """One motion under judgement: gathers evidence until a rule applies."""

    def __init__(self, motion: Motion, interval: float, level: float | None, limits: Thresholds) -> None:
        self.motion, self.interval, self.level, self.limits = motion, interval, level, limits
        self.scale, self.start, self.windows, self.above_noise = 1, 0, 1, True
        self.evidence: dict[str, float] = {}
        self.notes: list[str] = []

    def verdict(self) -> tuple[Regime, str, float | None, float | None]:
        """Regime, reason, frequency (Hz), part of the time in stick."""
        motion, limits = self.motion, self.limits
        count = len(motion.velocity)
        if count < _FEWEST_SAMPLES:
            self.above_noise = False
            return self._undecided(f"only {count} samples in one piece; measure longer")
        self.scale = motion.quiet_scale()
        stick = self._stick()
        clean, power = denoised(motion)
        self.evidence |= {"samples": float(count), "skewness": stick.skewness}
        self.evidence |= {
            "smoothed_over": float(self.scale),
            "events": float(stick.events),
        }
        if not motion.variances:
            self.above_noise = False
            return self._undecided("nothing stands out of the noise; measure closer, or with less noise")
        cycles, frequency = self._cycles(stick, power, len(clean) * self.interval)
        self.windows = int(np.clip(cycles / 3.0, 1, 40))
        period = 1.0 / (frequency * self.interval)
        self.evidence |= {"cycles": cycles, "samples_per_cycle": period}
        if cycles < limits.fewest_cycles:
            return self._undecided(f"only {cycles:.0f} cycles; measure longer")
        if period < limits.samples_per_cycle:
            return self._undecided(f"only {period:.1f} samples a cycle; measure at a higher rate")
        if reason := self._unsettled(cycles):
            return reason
        return self._sustained(stick, clean, power, frequency)

    def _sustained(
        self, stick: Stick, clean: Array, power: Array, frequency: float
    ) -> tuple[Regime, str, float | None, float | None]:
        """The regime of a motion that neither grows nor dies out."""
        limits, rate = self.limits, stick.events / (len(self.motion.velocity) * self.interval)
        sticks = self._sticks(stick, power, frequency)
        if sticks is None:
            what = "the velocity is skewed, by stick or by two lines in step, and noise hides which"
            return self._undecided(f"{what}; measure with less noise, or for longer")
        if sticks:
            reason = f"{stick.events} events of stick and slip: skewness of the velocity {stick.skewness:.2g}"
            return Regime.RELAXATION, reason, rate, stick.fraction
        top, beside = self._plateau(clean)
        self.evidence |= {"plateau": top / max(beside, 1e-9), "plateau_time": top}
        flat = top > limits.plateau * beside
        if flat and self.level is not None:
            fraction = max(0.0, top - 0.5 * beside)
            reason = (
                f"the velocity stays at the belt's speed for {fraction:.0%} of the time, in every cycle or nearly"
            )
            return Regime.RELAXATION, reason, frequency, fraction
        share = line_share(power, 3)
        self.evidence |= {"line_share": share}
        if flat:
            return self._undecided(
                "the velocity is cut off flat on one side, as by short stick; give the belt speed"
            )
        if self._reaches_belt(clean):
            return self._undecided(
                "the velocity just reaches the belt's; with less noise it would show if it stays"
            )
        if share < limits.line_share:
            return self._undecided(
                f"irregular without stick: {share:.0%} of the energy in three lines; measure longer"
            )
        reason = f"sustained without stick: {share:.0%} of the energy of the velocity in at most three lines"
        return Regime.QUASI_HARMONIC, reason, frequency, 0.0

    def _undecided(self, reason: str) -> tuple[Regime, str, float | None, float | None]:
        return Regime.UNDECIDED, reason, None, None

    def _stick(self) -> Stick:
        """Skewness at the smoothing that shows it best, and what goes with it."""
        motion, best, sign = self.motion, 0.0, 1.0
        scale = self.scale
        for m, _ in motion.variances:
            skewness = _skewness(motion.smoothed(m, stride_of(m)))
            if abs(skewness) > max(best, 4.0 * np.sqrt(6.0 * m / len(motion.velocity))):
                best, sign, scale = abs(skewness), -np.sign(skewness), m
        if best < self.limits.skewness_certain:
            scale = self.scale
        velocity = sign * motion.smoothed(scale)
        velocity = velocity - velocity.mean()
        bulk = velocity[velocity > 0.0]
        if not len(bulk):
            return Stick(best, 0, 0.0)
        middle, noise = float(np.median(bulk)), float(np.sqrt(motion.noise_at(scale)))
        events = count_turns(velocity, -max(0.5 * middle, 4.0 * noise), 0.25 * middle)
        return Stick(best, events, float(np.mean(velocity > -0.5 * middle)))

    def _cycles(self, stick: Stick, power: Array, length: float) -> tuple[float, float]:
        """How many, and how many a second; `length` of what the power was taken from, in seconds."""
        duration = len(self.motion.velocity) * self.interval
        strongest = int(np.argmax(power))
        certain = stick.skewness >= self.limits.skewness_certain and stick.events >= self.limits.fewest_cycles
        if certain or power[strongest] == 0.0:
            return float(stick.events), max(stick.events, 1) / duration
        return strongest * duration / length, max(strongest, 1) / length

    def _unsettled(self, cycles: float) -> tuple[Regime, str, float | None, float | None] | None:
        """Why the motion is not sustained; moves the start behind a transient."""
        limits, motion = self.limits, self.motion
        windows = int(np.clip(cycles / 3.0, 4, 40))
        whole = trend(motion, self.scale, 0, windows)
        last, largest = float(whole.envelope[-max(1, windows // 4) :].mean()), float(np.sort(whole.envelope)[-3])
        floor = np.sqrt(motion.noise_at(self.scale))
        self.evidence |= {
            "envelope_ratio": whole.ratio,
            "envelope_order": whole.order,
            "died_to": last / max(largest, 1e-300),
        }
        early = bool(whole.envelope[: windows // 2].max() >= largest)
        if early and last <= max(limits.decayed_to * largest, min(0.2 * largest, 0.5 * floor)):
            share = last / max(largest, 1e-300)
            return Regime.DAMPED, f"the vibration has died out: down to {share:.2g} of its largest", None, None
        found = whole
        for start in (0, len(motion.velocity) // 4, len(motion.velocity) // 2):
            found = trend(motion, self.scale, start, windows)
            change = max(found.ratio, 1.0 / max(found.ratio, 1e-9))
            slow = change > limits.trend_ratio and abs(found.order) > limits.trend_order
            if not slow and not (
                change > limits.trend_ratio_large and abs(found.order) > limits.trend_order_large
            ):
                self.start = start
                return None
        word, end = ("growing", "settled") if found.ratio > 1.0 else ("decaying", "died out")
        return self._undecided(f"still {word}; measure longer, until it has {end}")

    def _sticks(self, stick: Stick, power: Array, frequency: float) -> bool | None:
        """Whether the velocity is skewed by stick, and not by two lines in step; None if noise hides which."""
        limits, motion = self.limits, self.motion
        if stick.events < limits.fewest_cycles or stick.skewness < limits.skewness_unlikely:
            return False
        if stick.skewness >= limits.skewness_certain:
            return True
        strongest = int(np.argmax(power))
        bands = [slice(int(0.97 * n * strongest), int(1.03 * n * strongest) + 2) for n in range(3, 9)]
        overtones = sum(float(power[band].sum()) for band in bands) / float(power.sum())
        self.evidence |= {"overtones": overtones}
        if overtones > limits.overtones:
            return True
        turn = 2.0 * np.pi * min(4.0 * frequency * self.interval, 0.5)
        gain = 1.0 if motion.measured_velocity else 2.0 - 2.0 * np.cos(turn)
        hidden = CERTAIN * len(motion.velocity) * motion.noise**2 * gain
        return None if hidden > limits.overtones / 3.0 * float(power.sum()) else False

    def _reaches_belt(self, clean: Array) -> bool:
        """Whether the velocity's largest values, in either direction, are about the belt's."""
        least, most = np.quantile(clean + self.motion.raw.mean(), [0.01, 0.99])
        return self.level is not None and any(0.95 * self.level <= v <= 1.2 * self.level for v in (-least, most))

    def _plateau(self, clean: Array) -> tuple[float, float]:
        """Part of the time at the belt's speed (or at the velocity's extreme value) and next to it."""
        finer = int(np.ceil(_FINE / self.evidence["samples_per_cycle"]))
        clean = clean[: _PLATEAU_SAMPLES // finer]
        clean = finer * np.fft.irfft(np.fft.rfft(clean), finer * len(clean))
        absolute = clean + self.motion.raw.mean()
        reach = 0.5 * float(np.ptp(np.quantile(clean, [0.01, 0.99])))
        levels = (self.level, -self.level) if self.level is not None else _extreme_modes(absolute, reach)
        results = [(0.0, 1.0)]
        for level in levels:
            away = np.abs(absolute - level) / reach
            for width in (0.02, 0.01, 0.005):
                at = float(np.mean(away <= width))
                if at >= _SHORTEST_PLATEAU:
                    results.append((at, float(np.mean((away > width) & (away <= 3.0 * width)))))
        return max(results, key=lambda r: r[0] / max(r[1], 1e-9))


def _skewness(values: Array) -> float:
    """The median of equal parts', which a single jump does not change."""
    parts = [part - part.mean() for part in np.array_split(values, _PARTS)]
    return float(np.median([np.mean(p * p * p) / max(float(np.mean(p * p)), 1e-100) ** 1.5 for p in parts]))


def _extreme_modes(values: Array, reach: float) -> list[float]:
    """The most frequent values of the upper and of the lower quarter of the range."""
    edges = np.arange(values.min(), values.max() + 0.01 * reach, 0.01 * reach)
    counts, quarter = np.histogram(values, edges)[0], max(1, len(edges) // 4)
    places = int(np.argmax(counts[:quarter])), len(counts) - quarter + int(np.argmax(counts[-quarter:]))
    return [float(0.5 * (edges[i] + edges[i + 1])) for i in places]
