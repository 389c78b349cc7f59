"""What kind of vibration a history shows, and why: the rules. What they go by is measured in `evidence`."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from brakecli.analysis.regime.evidence import (
    Envelope,
    cycles_of,
    envelope_of,
    extremes,
    fraction_in_state,
    largest_values,
    last_samples,
    lines_of,
    mean,
    power_of,
    powers_of,
    share_of,
)
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState
from brakecli.solver.records import Coefficients


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


_GROWN, _NOTHING = math.log(1e9), 1e-3
"""Growth rate times duration: from rounding to the size of the motion; no more than rounding of eigenvalues."""


@dataclass(frozen=True)
class Thresholds:
    """Where the rules draw their lines; kept with every verdict."""

    decayed_to: float = 0.02
    """A motion has died out when the envelope of vx has fallen to this part of its largest value."""
    settled_within: float = 0.05
    """Settled windows: the envelope of vx within this part of its final value …"""
    reach_within: float = 0.02
    """… and the least and largest x within this part of the final peak to peak from their final values."""
    trend_errors: float = 3.0
    """Standard errors of the envelope's slope beyond which it grows or decays."""
    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    stick_cycles: float = 0.8
    """Part of the cycles that stick in relaxation."""
    harmonic_share: float = 0.8
    """Part of the energy of vx on one line and its multiples in quasi-harmonic vibration."""
    forced_share: float = 0.8
    """Part of the energy of vx on the lines of the roughness in forced vibration."""


@dataclass(frozen=True)
class Context:
    """What is known of the case behind a history.

    `belt_speed` U (m/s), `steady`: U and Q are constant, `forced`: lines of the roughness (Hz), `quiet`: size of
    vx (m/s) that is no more than rounding, `coefficients` and `load` Q (N) for the balance of powers, `growth`
    (1/s): how fast a small disturbance of steady sliding grows, 0 where it does not.
    """

    belt_speed: float
    steady: bool = True
    forced: tuple[float, ...] = ()
    quiet: float = 0.0
    coefficients: Coefficients | None = None
    load: float = 0.0
    growth: Callable[[], float] = lambda: 0.0


@dataclass(frozen=True)
class Verdict:
    """The regime of a history, its numbers (SI units) over the settled part, and the reasons in plain words."""

    regime: Regime
    excitation: Excitation
    frequency: float | None  # Hz, fundamental of vx when sustained
    amplitude: float  # m, half of peak to peak of x
    settled_from: int  # sample
    settled: bool  # whether a settled part was found; else `settled_from` is the middle
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    reasons: tuple[str, ...]
    evidence: dict[str, Any] = field(default_factory=dict)
    thresholds: Thresholds = field(default_factory=Thresholds)


def forced_lines(belt_speed: float, waves_per_metre: Sequence[float], highest: float) -> tuple[float, ...]:
    """Frequencies (Hz, up to `highest`) at which the passing roughness acts: each wave's, its multiples, and
    the sums and differences of two, which a contact that opens adds.
    """
    base = [abs(belt_speed) * waves for waves in waves_per_metre]
    multiples = {n * f for f in base for n in range(1, 11)}
    pairs = {abs(f + sign * g) for f in base for g in base for sign in (1, -1)}
    return tuple(sorted(f for f in multiples | pairs if 0.0 < f <= highest))


class _Judge:
    """One history under judgement: gathers evidence until a rule applies."""

    def __init__(self, history: History, context: Context, limits: Thresholds) -> None:
        self.history, self.context, self.limits = history, context, limits
        self.start, self.settled = history.samples // 2, False
        self.evidence: dict[str, Any] = {}

    def judge(self) -> Verdict:
        """Apply the rules in their order; the first that applies decides."""
        for rule in (self._contact, self._unmoved, self._forced, self._trend):
            verdict = rule()
            if verdict is not None:
                return verdict
        return self._sustained()

    def _contact(self) -> Verdict | None:
        """Never in contact; or contact lost for good, or stick throughout, in the second half."""
        gone, stuck = (
            fraction_in_state(self.history, state, self.start) == 1.0
            for state in (ContactState.SEPARATED, ContactState.STICK)
        )
        if gone and fraction_in_state(self.history, ContactState.SEPARATED, 0) == 1.0:
            return self._undecided("the shoe has never touched the wheel; check the sign and size of load.force")
        if gone:
            return self._undecided("the shoe has lost contact for good; check the sign and size of load.force")
        if stuck and self.context.belt_speed == 0.0:
            return self._verdict(Regime.DAMPED, "the shoe has come to rest, sticking to the standing wheel")
        if stuck:
            return self._undecided("the shoe sticks throughout and is carried along by the wheel; run longer")
        return None

    def _unmoved(self) -> Verdict | None:
        """Too short, not steady, never moved, or died out."""
        if self.history.samples < Envelope.FEWEST_SAMPLES:
            return self._undecided(f"fewer than {Envelope.FEWEST_SAMPLES} samples; run longer")
        envelope = self.envelope = envelope_of(self.history)
        self.evidence |= {
            "envelope_final": envelope.final,
            "envelope_largest": envelope.largest,
            **envelope.slope(),
        }
        if not self.context.steady:
            return self._undecided("the wheel's speed or the load changes with time, so the motion cannot settle")
        if envelope.largest <= self.context.quiet:
            return self._verdict(Regime.DAMPED, "nothing moves but by rounding: the shoe slides steadily or rests")
        if envelope.final <= max(self.limits.decayed_to * envelope.largest, self.context.quiet):
            share = envelope.final / envelope.largest
            text = f"the vibration has died out: vx has fallen to {share:.2g} of its largest amplitude"
            return self._verdict(Regime.DAMPED, text)
        return None

    def _forced(self) -> Verdict | None:
        """Only the roughness shakes the shoe."""
        if not self.context.forced:
            return None
        power, frequencies = power_of(last_samples(self.history, "vx", self.start), self.history.interval)
        share = share_of(power, frequencies, self.context.forced)
        self.evidence["forced_share"] = share
        if share < self.limits.forced_share:
            return None
        growth = self.context.growth()
        powers_of_e = growth * self.history.samples * self.history.interval
        if powers_of_e > _GROWN:  # so its own vibration falls on the same lines
            return None
        if powers_of_e > _NOTHING:
            return self._undecided(
                f"{share:.0%} of the energy of vx lies on the lines of the roughness, but sliding is unstable: "
                f"the shoe's own vibration grows at {growth:.3g} 1/s; run at least {_GROWN / growth:.2g} s"
            )
        text = f"only the roughness shakes the shoe: {share:.0%} of the energy of vx lies on its lines"
        return self._verdict(Regime.DAMPED, text, Excitation.FORCED)

    def _trend(self) -> Verdict | None:
        """Not settled: still growing or decaying."""
        first = self.envelope.settled_window(self.limits.settled_within, self.limits.reach_within)
        if first is not None:
            self.start, self.settled = first * self.history.samples // Envelope.WINDOWS, True
            return None
        slope, error = self.evidence.get("envelope_slope"), self.evidence.get("envelope_slope_error", 0.0)
        if slope is None:
            return self._undecided("the motion comes and goes; run longer")
        if abs(slope) <= self.limits.trend_errors * error:
            return None  # an amplitude that beats or wanders, without a trend
        word = "growing" if slope > 0.0 else "decaying"
        return self._undecided(
            f"still {word} at {abs(slope):.3g} 1/s; run at least {3.0 / abs(slope):.2g} s longer"
        )

    def _sustained(self) -> Verdict:
        """A motion whose amplitude has settled: cycles, stick, lines."""
        found = cycles_of(self.history, self.start)
        self.evidence |= found.evidence
        if found.count < self.limits.fewest_cycles:
            return self._undecided(f"only {max(found.count, 0)} cycles in the settled part; run longer")
        if found.period < self.limits.samples_per_cycle:
            return self._undecided(f"only {found.period:.1f} samples a cycle; reduce output.sample_interval")
        stick, harmonic = found.evidence["stick_cycles"], found.evidence["harmonic_share"]
        if stick >= self.limits.stick_cycles:
            text = f"sustained, with stick in {stick:.0%} of {found.count} cycles"
            return self._verdict(Regime.RELAXATION, text, Excitation.SELF_EXCITED, found.frequency)
        if stick == 0.0 and harmonic >= self.limits.harmonic_share:
            text = f"sustained without stick: {harmonic:.0%} of the energy of vx in one line and its harmonics"
            return self._verdict(Regime.QUASI_HARMONIC, text, Excitation.SELF_EXCITED, found.frequency)
        return self._undecided(
            f"irregular: stick in {stick:.0%} of the cycles, {harmonic:.0%} of the energy of vx in one line and "
            "its harmonics; run longer, or look at the spectrum"
        )

    def _undecided(self, reason: str) -> Verdict:
        return self._verdict(Regime.UNDECIDED, reason)

    def _verdict(
        self,
        regime: Regime,
        reason: str,
        excitation: Excitation = Excitation.NONE,
        frequency: float | None = None,
    ) -> Verdict:
        """Add the means and fractions of the settled part."""
        least, largest = extremes(self.history, "x", self.start, self.history.samples)
        belt, c = self.context.belt_speed, self.context.coefficients
        self.evidence |= largest_values(self.history, self.start, belt)
        power, frequencies = power_of(last_samples(self.history, "vx", self.start), self.history.interval)
        self.evidence |= lines_of(power, frequencies, self.context.forced)
        if c is not None and self.context.steady:
            self.evidence |= powers_of(self.history, self.start, c, belt, self.context.load)
        return Verdict(
            regime=regime,
            excitation=excitation,
            frequency=frequency,
            amplitude=0.5 * (largest - least),
            settled_from=self.start,
            settled=self.settled,
            stick_fraction=fraction_in_state(self.history, ContactState.STICK, self.start),
            contact_loss_fraction=fraction_in_state(self.history, ContactState.SEPARATED, self.start),
            mean_friction_force=mean(self.history, "friction_force", self.start),
            reasons=(reason,),
            evidence=self.evidence,
            thresholds=self.limits,
        )


def classify(history: History, context: Context, thresholds: Thresholds | None = None) -> Verdict:
    """The regime of a run's history, by the rules of docs/result-format.md."""
    return _Judge(history, context, thresholds or Thresholds()).judge()
