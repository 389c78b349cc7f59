"""The rules that decide the regime of a measured signal: see docs/measured-signals.md."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from brakecli.analysis.regime.cleaning import CERTAIN, Velocity
from brakecli.analysis.regime.spectra import interpolated, line_share
from brakecli.analysis.regime.stick import Slips
from brakecli.analysis.regime.table import Decision, Regime

FEWEST_SAMPLES = 64
_FINE = 1000.0  # samples of a cycle, after interpolation, among which a plateau is sought
_PLATEAU_SAMPLES = 1 << 20  # most samples in which a plateau is sought
_SHORTEST_PLATEAU = 0.03  # of the time
_LONG = "measure longer"


@dataclass(frozen=True)
class SignalThresholds:
    """Where the rules draw their lines; every verdict carries them."""

    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    decayed_to: float = 0.05  # part of its largest to which the velocity of a motion that has died out has fallen
    trend_order: float = 0.85  # rank correlation of the envelope with time from which it may grow or decay,
    trend_ratio: float = 1.25  # and does if also its last third is so many times its first third, or the reverse
    trend_order_large: float = 0.6  # the rank correlation that suffices for a change by `trend_ratio_large`
    trend_ratio_large: float = 4.0
    skewness_unlikely: float = 0.3  # of the velocity; up to here no stick, except a short one at the belt's speed
    skewness_certain: float = 0.9  # from here there is stick; two lines in step reach 0.816 and no more
    skewness_lines: float = 1.5  # three lines in step reach 1.4 and no more
    overtones: float = 0.03  # between the two: part of the energy in the third to eighth multiple that shows stick
    beyond_lines: float = 0.003  # and above: part of the energy that three lines leave
    plateau: float = 2.6  # time at the belt's speed, over that next to it, that shows stick; a sine reaches 2.41
    line_share: float = 0.7  # part of the velocity's energy in three narrow bands in quasi-harmonic vibration


class SignalRules:
    """The rules on one velocity, in their order. They gather evidence until one of them decides."""

    def __init__(
        self, velocity: Velocity, slips: Slips, interval: float, belt: float, limits: SignalThresholds
    ) -> None:
        """The belt's speed as the velocity would show it; NaN where it is not known."""
        self.velocity, self.interval, self.limits, self.count = velocity, interval, limits, len(velocity.values)
        self.slips = slips
        self.has_belt = True  # whether its speed can be given
        self.belt = belt
        self.duration, self.start, self.windows = self.count * interval, 0, 1
        self.certain = slips.skewness >= limits.skewness_certain and slips.stick_slip
        self.smoothing = slips.scale if self.certain else velocity.quiet
        self.above_noise = self.count >= FEWEST_SAMPLES and (self.certain or bool(velocity.variances))
        self.evidence: dict[str, float] = {}

    def short(self) -> Decision | None:
        """Decides where cycles or samples are too few, or nothing rises above the noise."""
        velocity, limits = self.velocity, self.limits
        if self.count < FEWEST_SAMPLES:
            return Decision(f"only {self.count} samples without a gap", advice=_LONG)
        self.clean, self.power = velocity.denoised()
        self.evidence |= {"samples": float(self.count), "skewness": self.slips.skewness}
        self.evidence |= {"smoothed_over": float(self.smoothing), "events": float(self.slips.count)}
        self.evidence |= {"slip_lasts": self.slips.lasts, "slip_returns": self.slips.returns}
        self.evidence |= {"slip_swings": self.slips.swings}
        if not self.above_noise or not (self.certain or self.power.any()):
            advice = "measure closer to the shoe, or with less noise"
            return Decision("the vibration is hidden by noise", advice=advice)
        self.strongest = strongest = int(np.argmax(self.power))
        if self.certain:
            cycles, self.frequency = float(self.slips.count), max(self.slips.count, 1) / self.duration
        else:
            length = len(self.clean) * self.interval
            cycles, self.frequency = strongest * self.duration / length, max(strongest, 1) / length
        self.windows = int(np.clip(cycles / 3.0, 1, 40))
        period = 1.0 / (self.frequency * self.interval)
        self.evidence |= {"cycles": cycles, "samples_per_cycle": period}
        if cycles < limits.fewest_cycles:
            return Decision(f"only {cycles:.0f} cycles", advice=_LONG)
        if period < limits.samples_per_cycle:
            return Decision(f"only {period:.1f} samples a cycle", advice="measure at a higher rate")
        return None

    def unsettled(self) -> Decision | None:
        """Decides where the motion has died out, still grows or decays; moves the start behind a transient."""
        limits, velocity, windows = self.limits, self.velocity, max(self.windows, 4)
        envelope, ratio, order = velocity.trend(self.smoothing, 0, windows)
        last, largest = float(envelope[-max(1, windows // 4) :].mean()), float(np.sort(envelope)[-3])
        died_to, floor = last / max(largest, 1e-300), np.sqrt(velocity.noise_at(self.smoothing))
        self.evidence |= {"envelope_ratio": ratio, "envelope_order": order, "died_to": died_to}
        faded = last <= max(limits.decayed_to * largest, min(0.2 * largest, 0.5 * floor))
        if faded and envelope[: windows // 2].max() >= largest:
            return Decision(f"the vibration has died out: down to {died_to:.2g} of its largest", Regime.DAMPED)
        for start in (0, self.count // 4, self.count // 2):
            _, ratio, order = velocity.trend(self.smoothing, start, windows)
            change = max(ratio, 1.0 / max(ratio, 1e-9))
            slow = change > limits.trend_ratio and abs(order) > limits.trend_order
            fast = change > limits.trend_ratio_large and abs(order) > limits.trend_order_large
            if not slow and not fast:
                self.start = start
                return None
        word, end = ("growing", "settled") if ratio > 1.0 else ("decaying", "died out")
        return Decision(f"still {word}", advice=f"{_LONG}, until it has {end}")

    def sticking(self) -> Decision | None:
        """Decides where stick has skewed the velocity; undecided if noise hides whether two lines in step did."""
        limits, velocity, total = self.limits, self.velocity, float(self.power.sum())
        slips = self.slips
        if slips.count < limits.fewest_cycles or slips.skewness < limits.skewness_unlikely:
            return None
        if not slips.stick_slip and slips.skewness >= limits.skewness_certain:
            return None
        turn = 2.0 * np.pi * min(4.0 * self.frequency * self.interval, 0.5)
        gain = 1.0 if velocity.measured else 2.0 - 2.0 * np.cos(turn)
        for name, found, least in self._overtones(total):
            self.evidence |= {name: found}
            if found <= least and CERTAIN * self.count * velocity.noise**2 * gain > least / 3.0 * total:
                hidden = "stick, or lines in phase, have skewed the velocity, and noise hides which of them"
                return Decision(hidden, advice="measure with less noise, or for longer")
            if found <= least:
                return None
        if not slips.stick_slip:
            return None
        reason = f"{self.slips.count} events of stick and slip: skewness of the velocity {self.slips.skewness:.2g}"
        places = self.slips.places
        often = (len(places) - 1) / (float(places[-1] - places[0]) * self.interval)
        return Decision(reason, Regime.RELAXATION, frequency=often, stick_fraction=self.slips.stick)

    def _overtones(self, total: float) -> Iterator[tuple[str, float, float]]:
        """What lines in step lack: a name, part of the energy, and how much of it shows stick."""
        limits, power = self.limits, self.power
        if not self.certain:
            places = [(int(0.97 * n * self.strongest), int(1.03 * n * self.strongest) + 2) for n in range(3, 9)]
            yield "overtones", sum(float(power[i:j].sum()) for i, j in places) / total, limits.overtones
        if self.slips.skewness < limits.skewness_lines:
            beyond = 1.0 - line_share(self.velocity.denoised(hann=True)[1])
            yield "beyond_lines", beyond, limits.beyond_lines

    def without_stick(self) -> Decision:
        """Decides by a plateau at the belt's speed, and by the lines of the spectrum."""
        top, beside = self._plateau()
        self.evidence |= {"plateau": top / max(beside, 1e-9), "plateau_time": top}
        flat = top > self.limits.plateau * beside
        if flat and np.isfinite(self.belt):
            stick = max(0.0, top - 0.5 * beside)
            reason = f"the velocity is that of the belt for {stick:.0%} of the time, in most cycles or in all"
            return Decision(reason, Regime.RELAXATION, frequency=self._line(), stick_fraction=stick)
        share = line_share(self.power)
        self.evidence |= {"line_share": share}
        if flat:
            text = "the velocity has a plateau on one side, which short stick can cause"
            return Decision(text, advice="give --belt-speed" * self.has_belt)
        least, most = np.quantile(self.clean + self.velocity.raw.mean(), [0.01, 0.99])
        if any(0.95 * self.belt <= v <= 1.2 * self.belt for v in (-least, most)):
            text = "the velocity just reaches that of the belt"
            return Decision(text, advice="with less noise it would show whether it stays")
        if share < self.limits.line_share:
            return Decision(f"irregular without stick: {share:.0%} of the energy in three lines", advice=_LONG)
        reason = f"sustained without stick: {share:.0%} of the energy of the velocity in at most three lines"
        known = np.isfinite(self.belt)  # otherwise stick may be too short to be seen
        reason += "" if known or not self.has_belt else "; short stick would show only by --belt-speed"
        none = 0.0 if known else None
        return Decision(reason, Regime.QUASI_HARMONIC, frequency=self._line(), stick_fraction=none)

    def _line(self) -> float:
        """Frequency (Hz) of the strongest line; a line of the spectrum alone may be off by half a cycle in all."""
        power = self.velocity.denoised(hann=True)[1]
        near = max(self.strongest - 1, 0)
        place = near + int(np.argmax(power[near : near + 3]))
        return interpolated(np.arange(len(power)) / (len(self.clean) * self.interval), power, place)

    def _plateau(self) -> tuple[float, float]:
        """Part of the time at the belt's speed (or an extreme velocity), and part of the time next to it."""
        finer = int(np.ceil(_FINE / self.evidence["samples_per_cycle"]))
        clean = self.clean[: _PLATEAU_SAMPLES // finer]
        clean = finer * np.fft.irfft(np.fft.rfft(clean), finer * len(clean))
        absolute = clean + self.velocity.raw.mean()
        reach = 0.5 * float(np.ptp(np.quantile(clean, [0.01, 0.99])))
        levels = [self.belt, -self.belt]
        if not np.isfinite(self.belt):
            # the most frequent values of the lower and of the upper quarter of the range
            edges = np.arange(absolute.min(), absolute.max() + 0.01 * reach, 0.01 * reach)
            counts, quarter = np.histogram(absolute, edges)[0], max(1, len(edges) // 4)
            places = np.argmax(counts[:quarter]), len(counts) - quarter + np.argmax(counts[-quarter:])
            levels = [float(0.5 * (edges[i] + edges[i + 1])) for i in places]
        results = [(0.0, 1.0)]
        for level, width in product(levels, (0.02, 0.01, 0.005)):
            away = np.abs(absolute - level) / reach
            if (at := float(np.mean(away <= width))) >= _SHORTEST_PLATEAU:
                results.append((at, float(np.mean((away > width) & (away <= 3.0 * width)))))
        return max(results, key=lambda r: r[0] / max(r[1], 1e-9))
