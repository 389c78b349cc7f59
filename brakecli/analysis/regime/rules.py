"""What kind of vibration a history shows, and why: the rules. `evidence` measures what they go by."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, WINDOWS, Envelope, Part, cycles_of
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState


class Regime(StrEnum):
    """The paper's three regimes, and `undecided`."""

    DAMPED = "damped"
    RELAXATION = "relaxation"
    QUASI_HARMONIC = "quasi-harmonic"
    UNDECIDED = "undecided"


class Excitation(StrEnum):
    """Where the energy of a sustained motion comes from."""

    SELF_EXCITED = "self-excited"
    FORCED = "forced"
    NONE = "none"


# Growth rate times duration
_GROWN = math.log(1e9)  # from which a disturbance grows from rounding to the size of the motion
_NOTHING = 1e-3  # which may come from the rounding of the eigenvalues


@dataclass(frozen=True)
class Thresholds:
    """The thresholds of docs/regimes.md, which every verdict carries."""

    decayed_to: float = 0.02
    settled_within: float = 0.05
    reach_within: float = 0.02
    trend_errors: float = 3.0
    fewest_cycles: float = 10.0
    samples_per_cycle: float = 8.0
    stick_cycles: float = 0.8
    harmonic_share: float = 0.8
    forced_share: float = 0.8


@dataclass(frozen=True)
class Context:
    """What is known of the case behind a history."""

    belt_speed: float  # U, m/s
    steady: bool = True  # whether U and Q are constant
    forced: tuple[float, ...] = ()  # Hz, lines of the roughness
    quiet: float = 0.0  # m/s, size of vx that may come from rounding
    growth: Callable[[], float] = lambda: 0.0  # 1/s, of a small disturbance of steady sliding; 0 where it decays
    powers: Callable[[Part], dict[str, float]] = lambda part: {}  # W, what becomes of the power of the belt
    radius: float = 1.0  # R, m


class Decision(NamedTuple):
    """What a rule decides, and why."""

    reason: str
    regime: Regime = Regime.UNDECIDED
    excitation: Excitation = Excitation.NONE
    frequency: float | None = None  # Hz
    stick_fraction: float | None = None


@dataclass(frozen=True)
class Verdict:
    """The regime of a history, its numbers (SI units) over the settled part, and the reasons in plain words."""

    regime: Regime
    excitation: Excitation
    frequency: float | None  # Hz, fundamental of vx when sustained
    amplitude: float  # m, half of peak to peak of x
    settled_from: float  # s; the middle where no settled part was found
    start: int  # the sample there
    settled: bool  # whether a settled part was found
    stick_fraction: float
    contact_loss_fraction: float
    mean_friction_force: float  # N
    braking_torque: float  # N m, its mean torque on the wheel's axis, R F_x
    reasons: tuple[str, ...]
    evidence: dict[str, Any]
    thresholds: Thresholds


def forced_lines(belt_speed: float, waves_per_metre: Sequence[float], highest: float) -> tuple[float, ...]:
    """Frequencies (Hz, up to `highest`) of the passing waves, their multiples, and sums and differences of two."""
    base = [abs(belt_speed) * waves for waves in waves_per_metre]
    multiples = {n * f for f in base for n in range(1, 11)}
    pairs = {abs(f + sign * g) for f in base for g in base for sign in (1, -1)}
    return tuple(sorted(f for f in multiples | pairs if 0.0 < f <= highest))


class _Rules:
    """The rules on one history, in their order. They gather evidence until one of them decides."""

    def __init__(self, history: History, context: Context, limits: Thresholds) -> None:
        self.history, self.context, self.limits = history, context, limits
        self.settled_part, self.settled = Part(history, history.samples // 2, history.samples), False
        self.evidence: dict[str, Any] = {}

    def contact(self) -> Decision | None:
        if self.settled_part.fraction(ContactState.SEPARATED) == 1.0:
            never = replace(self.settled_part, start=0).fraction(ContactState.SEPARATED) == 1.0
            text = "never touched the wheel" if never else "lost contact for good"
            return Decision(f"the shoe has {text}; check the sign and size of load.force")
        if self.settled_part.fraction(ContactState.STICK) < 1.0:
            return None
        if self.context.belt_speed == 0.0:
            return Decision("the shoe has come to rest, sticking to the standing wheel", Regime.DAMPED)
        return Decision("the shoe sticks throughout and is carried along by the wheel; run longer")

    def unmoved(self) -> Decision | None:
        if self.history.samples < FEWEST_SAMPLES:
            return Decision(f"fewer than {FEWEST_SAMPLES} samples; run longer")
        envelope = self.envelope = Envelope(self.history)
        self.evidence |= envelope.evidence
        if not self.context.steady:
            return Decision("the wheel's speed or the load changes with time, so the motion cannot settle")
        if envelope.largest <= self.context.quiet:
            return Decision("nothing moves beyond rounding: the shoe slides steadily or rests", Regime.DAMPED)
        if envelope.final <= max(self.limits.decayed_to * envelope.largest, self.context.quiet):
            text = f"vx has fallen to {envelope.final / envelope.largest:.2g} of its largest amplitude"
            return Decision(f"the vibration has died out: {text}", Regime.DAMPED)
        return None

    def forced(self) -> Decision | None:
        if not self.context.forced:
            return None
        share = self.evidence["forced_share"] = self.settled_part.share(self.context.forced)
        if share < self.limits.forced_share:
            return None
        growth = self.context.growth()
        powers_of_e = growth * self.history.samples * self.history.interval
        if powers_of_e > _GROWN:
            return None  # the shoe's own vibration falls on the same lines
        if powers_of_e > _NOTHING:
            what = f"{share:.0%} of the energy of vx lies on the lines of the roughness, but sliding is unstable"
            own = f"the shoe's own vibration grows at {growth:.3g} 1/s"
            return Decision(f"{what}: {own}; run at least {_GROWN / growth:.2g} s")
        text = f"only the roughness shakes the shoe: {share:.0%} of the energy of vx lies on its lines"
        return Decision(text, Regime.DAMPED, Excitation.FORCED)

    def trend(self) -> Decision | None:
        """Decides where the motion still grows or decays; otherwise it finds the settled part."""
        first = self.envelope.settled_window(self.limits.settled_within, self.limits.reach_within)
        if first is not None:
            start = first * self.history.samples // WINDOWS
            self.settled_part, self.settled = replace(self.settled_part, start=start), True
            return None
        slope = self.evidence.get("envelope_slope")
        if slope is None:
            return Decision("the motion comes and goes; run longer")
        if abs(slope) <= self.limits.trend_errors * self.evidence["envelope_slope_error"]:
            return None  # an amplitude that beats or wanders, without a trend
        text = f"still {'growing' if slope > 0.0 else 'decaying'} at {abs(slope):.3g} 1/s"
        return Decision(f"{text}; run at least {3.0 / abs(slope):.2g} s longer")

    def sustained(self) -> Decision:
        found = cycles_of(self.settled_part)
        self.evidence |= found
        cycles = found.get("cycles", 0.0)
        if not found or cycles < self.limits.fewest_cycles:
            return Decision(f"only {cycles:.0f} cycles in the settled part; run longer")
        period, stick, harmonic = found["samples_per_cycle"], found["stick_cycles"], found["harmonic_share"]
        if period < self.limits.samples_per_cycle:
            return Decision(f"only {period:.1f} samples a cycle; reduce output.sample_interval")
        own = Excitation.SELF_EXCITED, 1.0 / (period * self.history.interval)
        if stick >= self.limits.stick_cycles:
            text = f"sustained, with stick in {stick:.0%} of {cycles:.0f} cycles"
            return Decision(text, Regime.RELAXATION, *own)
        lines = f"{harmonic:.0%} of the energy of vx in one line and its harmonics"
        if stick == 0.0 and harmonic >= self.limits.harmonic_share:
            return Decision(f"sustained without stick: {lines}", Regime.QUASI_HARMONIC, *own)
        irregular = f"irregular: stick in {stick:.0%} of the cycles, {lines}"
        return Decision(f"{irregular}; run longer, or look at the spectrum")


def classify(history: History, context: Context, thresholds: Thresholds = Thresholds()) -> Verdict:
    """The regime of a run's history, by the rules of docs/regimes.md; the first that applies decides."""
    rules = _Rules(history, context, thresholds)
    decision = rules.contact() or rules.unmoved() or rules.forced() or rules.trend() or rules.sustained()
    part, belt, friction = rules.settled_part, context.belt_speed, rules.settled_part.mean("friction_force")
    evidence = rules.evidence | {f"amplitude_{name}": part.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        evidence["largest_vx_over_belt_speed"] = part.extremes("vx")[int(belt > 0.0)] / belt
    evidence |= part.lines(context.forced) | (context.powers(part) if context.steady else {})
    return Verdict(
        regime=decision.regime,
        excitation=decision.excitation,
        frequency=decision.frequency,
        amplitude=part.amplitude("x"),
        settled_from=part.start * history.interval,
        start=part.start,
        settled=rules.settled,
        stick_fraction=part.fraction(ContactState.STICK),
        contact_loss_fraction=part.fraction(ContactState.SEPARATED),
        mean_friction_force=friction,
        braking_torque=context.radius * friction,
        reasons=(decision.reason,),
        evidence=evidence,
        thresholds=thresholds,
    )
