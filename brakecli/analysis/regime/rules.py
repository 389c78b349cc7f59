"""What kind of vibration a history shows, and why: the rules. `evidence` measures what they go by."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, WINDOWS, Cycles, Envelope, Part, cycles_of, median, swings
from brakecli.analysis.regime.spectra import segment
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

if TYPE_CHECKING:  # a measured signal needs no compiled code
    from brakecli.analysis.regime.linear import Linear


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
_QUARTER = 4.0 / 3.0  # a run whose last quarter is settled, over what comes before
_MOST_COMBINED = 6  # waves whose frequencies are combined by threes
_COMBINATIONS = [(i, j, k) for i in range(-2, 3) for j in range(-2, 3) for k in (-1, 0, 1)]
_LARGER = 5.0  # times what the waves force in full contact: a larger motion needs more proof that it is forced
_NEAR = 0.2  # by which the amplitude of a motion that stick or loss of contact limits may still change
_DRIFT = 5e-3  # by which the amplitude of a settled motion may change where sliding is stable
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
    subharmonics: tuple[float, ...] = ()  # Hz, further lines that a pad that opens may add
    waves: tuple[tuple[float, float], ...] = ()  # Hz and m, passing frequencies and the swing of x that each forces
    quiet: float = 0.0  # m/s, size of vx that may come from rounding
    scale: float = math.inf  # m/s, of a motion that would open the contact
    frictionless: bool = False
    growth: Callable[[], float] = lambda: 0.0  # 1/s, of a small disturbance of steady sliding; below 0 it decays
    linear: Callable[[], "Linear | None"] = lambda: None  # the theory of full contact
    powers: Callable[[Part], dict[str, float]] = lambda part: {}  # W, what becomes of the power of the belt
    radius: float = 1.0  # R, m


class Feeds(StrEnum):
    """What gives energy to the vibration on a rough wheel."""

    FRICTION = "friction"
    ROUGHNESS = "roughness"
    UNKNOWN = "unknown"


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
    amplitude: float  # m, half of peak to peak of x: median over the cycles
    amplitude_spread: float | None  # m, of the amplitudes of the cycles
    amplitude_forced: float | None  # m, on a rough wheel: what the roughness forces
    amplitude_own: float | None  # m, on a rough wheel: what the shoe adds
    growth_rate: float | None  # 1/s, of the slowest mode where the motion is linear
    ringing_frequency: float | None  # Hz, of that mode
    frequency_resolution: float  # Hz, to which a line of the spectrum is known
    torque_variation: float  # N m, peak to peak
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


def subharmonics(belt_speed: float, waves_per_metre: Sequence[float], highest: float) -> tuple[float, ...]:
    """Halves, thirds and quarters of the passing frequencies and their multiples, and combinations of up to three."""
    base = [abs(belt_speed) * waves for waves in waves_per_metre]
    parts = {k * f / n for f in base for n in (2, 3, 4) for k in range(1, 4 * n)}
    few = base if len(base) <= _MOST_COMBINED else []
    sums = {abs(i * f + j * g + k * h) for f in few for g in few for h in few for i, j, k in _COMBINATIONS}
    return tuple(sorted(f for f in parts | sums if 0.0 < f <= highest))


class _Rules:
    """The rules on one history, in their order. They gather evidence until one of them decides."""

    def __init__(self, history: History, context: Context, limits: Thresholds) -> None:
        self.history, self.context, self.limits = history, context, limits
        self.duration = history.samples * history.interval
        self.whole = Part(history, 0, history.samples)
        self.last = replace(self.whole, start=history.samples * (WINDOWS - 10) // WINDOWS)
        self.settled_part, self.settled = replace(self.whole, start=history.samples // 2), False
        self.theory: Linear | None = None  # where the motion is linear
        self.cycles: Cycles | None = None
        self.parts: tuple[float, float] | None = None  # m, half of peak to peak of what is forced and what is added
        self.evidence: dict[str, Any] = {}

    def contact(self) -> Decision | None:
        standing = self.context.belt_speed == 0.0
        if self.settled_part.fraction(ContactState.SEPARATED) == 1.0:
            never = self.whole.fraction(ContactState.SEPARATED) == 1.0
            text = "never touched the wheel" if never else "lost contact for good"
            return Decision(f"the shoe has {text}; check the sign and size of load.force")
        if (self.last if standing else self.settled_part).fraction(ContactState.STICK) < 1.0:
            return None
        if standing:
            return Decision("the shoe has come to rest, sticking to the standing wheel", Regime.DAMPED)
        return Decision("the shoe sticks throughout and is carried along by the wheel; run longer")

    def unmoved(self) -> Decision | None:
        if self.history.samples < FEWEST_SAMPLES:
            return Decision(f"fewer than {FEWEST_SAMPLES} samples; run longer")
        envelope = self.envelope = Envelope(self.history)
        self.evidence |= envelope.evidence
        if not self.context.steady:
            return Decision("the wheel's speed or the load changes with time, so the motion cannot settle")
        if envelope.largest > self.context.quiet:
            return None
        if (growth := self.context.growth()) > 0.0:
            text = f"nothing moves yet, but sliding is unstable: a disturbance grows at {growth:.3g} 1/s"
            return Decision(f"{text}; start beside steady sliding, or run at least {_GROWN / growth:.2g} s")
        return Decision("nothing moves beyond rounding: the shoe slides steadily or rests", Regime.DAMPED)

    def linear(self) -> Decision | None:
        """Theory decides where the shoe has long been sliding in full contact, to one side."""
        theory, slow = self.context.linear(), self._slowest(0.0)
        start = max(min(self.last.start, self.history.samples - int(slow / self.history.interval)), 0)
        if theory is None or not replace(self.last, start=start).slides(theory.slip):
            return None
        self.theory, mode = theory, theory.mode
        how = f"{mode.frequency:.4g} Hz" if mode.frequency else "without oscillation"
        linear = "full contact and slip to one side make the motion linear"
        if theory.direction == 0:
            return Decision(f"{linear}: it neither grows nor decays ({how}); a dashpot would decide")
        if theory.direction > 0:
            self.evidence["seconds_to_go"] = more = theory.seconds_to_limit(*self._end()) + 3.0 / mode.growth
            growing = f"{linear}: still growing at {mode.growth:.3g} 1/s ({how})"
            return Decision(f"{growing}; run at least {_QUARTER * (self.duration + more):.3g} s")
        decays = f"{linear}: the shoe's own vibration decays at {-mode.growth:.3g} 1/s ({how})"
        if not len(theory.waves):
            return Decision(decays, Regime.DAMPED)
        if self.duration < slow:
            return self._too_short(slow)
        return self._shaken(theory, slow, decays)

    def _end(self) -> tuple[float, Any]:
        """Time and state of the last sample."""
        last = self.history.samples - 1
        state = [float(self.history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return last * self.history.interval, np.array(state)

    def _shaken(self, theory: "Linear", slow: float, decays: str) -> Decision | None:
        """The forced motion that lasts, with the settled part in which the shoe's own part has gone."""
        x, time = self.whole.places()
        lasting = theory.forced(time)[0][0]
        forced, own = 0.5 * float(np.ptp(lasting)), x - theory.rest[0] - lasting
        left = np.array([0.5 * float(np.ptp(part)) for part in np.array_split(own, WINDOWS)])
        end = float(left[-10:].mean())
        slope = np.polyfit(np.arange(WINDOWS // 2), np.log(np.maximum(left[WINDOWS // 2 :], 1e-300)), 1)[0]
        if slope * WINDOWS > 1.0 and end > self.limits.settled_within * forced:
            return None  # the passing waves excite what the mean stiffness damps
        first = WINDOWS - int(np.argmin((left <= self.limits.settled_within * forced)[::-1]))
        begin = max(first, 1) * self.history.samples // WINDOWS
        wait = max(math.log(max(end / (self.limits.settled_within * forced), 1.0)) / -theory.mode.growth, 0.0)
        hint = ""
        if first <= WINDOWS - 10 and self.duration - begin * self.history.interval >= 2.0 * slow:
            self.settled_part, self.settled = replace(self.whole, start=begin), True
        else:
            hint = f"; run at least {max(_QUARTER * (self.duration + wait), self._long_enough(slow)):.3g} s"
            hint += " to see only that"
        chosen = time >= self.settled_part.start * self.history.interval
        self.parts = forced, 0.5 * float(np.ptp(own[chosen]))
        text = f"only the roughness shakes the shoe, by {forced:.3g} m: {decays}{hint}"
        return Decision(text, Regime.DAMPED, Excitation.FORCED)

    def _slowest(self, amplitude: float) -> float:
        """Period (s) of the slowest wave that counts beside an amplitude of x (m) and beside the others; or 0."""
        least = max([amplitude, *(swing for _, swing in self.context.waves)]) if self.context.waves else 0.0
        counts = [f for f, swing in self.context.waves if swing >= self.limits.settled_within * least]
        return 1.0 / min(counts) if counts else 0.0

    def _long_enough(self, slow: float) -> float:
        """Duration (s) of a run whose settled part holds two periods."""
        start = self.settled_part.start * self.history.interval if self.settled else 0.5 * self.duration
        return max(start + 2.0 * slow, _QUARTER * 2.0 * slow) * 1.05

    def _too_short(self, slow: float) -> Decision:
        turns = (self.duration if self.duration < slow else self._settled_seconds) / slow
        what = "run" if self.duration < slow else "settled part"
        text = f"the {what} holds only {turns:.2g} periods of the slowest wave, which passes every {slow:.3g} s"
        return Decision(f"{text}; run at least {self._long_enough(slow):.3g} s")

    @property
    def _settled_seconds(self) -> float:
        return self.duration - self.settled_part.start * self.history.interval

    def forced(self) -> Decision | None:
        if not self.context.forced:
            return None
        slow = self._slowest(self.settled_part.amplitude("x"))
        if self.duration < slow:
            return self._too_short(slow)
        growth = self.context.growth()
        if self.context.frictionless and growth < 0.0:
            return self._forced("without friction nothing but the roughness shakes the shoe")
        share, dense = self._share(self.context.forced, 0.5)
        self.evidence["forced_share"] = share
        if share < self.limits.forced_share:
            lines = tuple({*self.context.forced, *self.context.subharmonics})
            share, dense = self._share(lines, 0.3)
            if growth >= 0.0 or dense or share < self.limits.forced_share:
                return None
        powers_of_e = growth * self.duration
        if powers_of_e > _GROWN:
            return None  # the shoe's own vibration falls on the same lines
        what = f"{share:.0%} of the energy of vx lies on the lines of the roughness"
        if powers_of_e > _NOTHING:
            own = f"but sliding is unstable: the shoe's own vibration grows at {growth:.3g} 1/s"
            return Decision(f"{what}, {own}; run at least {_GROWN / growth:.2g} s")
        expected, feeds = _LARGER * self._expected, self._feeds()
        if feeds is Feeds.FRICTION and self.evidence["power_of_roughness"] < 0.0:
            return None
        doubtful = 0.0 < expected < self.last.deviation("x") or self._unstable_in_full_contact
        if feeds is Feeds.FRICTION or (doubtful and feeds is Feeds.UNKNOWN):
            return self._either()
        if dense:
            text = f"{what}, which lie too close to be told from others; run twice as long"
            return self.fed() or Decision(text)
        return self._forced(f"only the roughness shakes the shoe: {what}")

    @property
    def _unstable_in_full_contact(self) -> bool:
        theory = self.context.linear()
        return theory is not None and theory.direction > 0

    @property
    def _expected(self) -> float:
        """Standard deviation of x (m) that the waves force in full contact."""
        return math.sqrt(0.5 * sum(swing**2 for _, swing in self.context.waves))

    def _share(self, lines: Sequence[float], most: float) -> tuple[float, bool]:
        """Part of the energy of vx on lines, in the second half or in the last quarter, where it is more.

        Also whether that shows nothing: the lines cover more than `most` of the band, and the motion is larger than
        what they force.
        """
        shares = []
        for part in (self.settled_part, self.last):
            dense = part.covered(lines) > most and part.deviation("x") > 2.0 * self._expected
            shares.append((part.share(lines), dense))
        clear = [share for share, dense in shares if not dense and share >= self.limits.forced_share]
        return (max(clear), False) if clear else max(shares)

    def _forced(self, text: str) -> Decision:
        """Forced, as seen in a settled part of two periods of the slowest wave."""
        self._settle()
        slow = self._slowest(self.settled_part.amplitude("x"))
        if self._settled_seconds < 2.0 * slow:
            return self._too_short(slow)
        return Decision(text, Regime.DAMPED, Excitation.FORCED)

    def _settle(self) -> bool:
        """Find the settled part."""
        first = self.envelope.settled_window(self.limits.settled_within, self.limits.reach_within)
        if first is not None:
            start = first * self.history.samples // WINDOWS
            self.settled_part, self.settled = replace(self.settled_part, start=start), True
        return self.settled

    def died_out(self) -> Decision | None:
        """Little is left beside the start, beside the wheel's speed and beside the compression, and it falls."""
        envelope, belt = self.envelope, abs(self.context.belt_speed)
        if belt == 0.0 and self.context.growth() < 0.0:
            return Decision("the wheel stands: friction and dashpots take the energy", Regime.DAMPED)
        small = min(envelope.largest, belt or math.inf, self.context.scale)
        falls = self.evidence.get("envelope_slope", -1.0) < 0.0 or envelope.final <= self.context.quiet
        ends = self.last.fraction(ContactState.STICK) == self.last.fraction(ContactState.SEPARATED) == 0.0
        if envelope.final > max(self.limits.decayed_to * small, self.context.quiet) or not (falls and ends):
            return None
        if self.context.growth() > 0.0:
            return None
        text = f"vx has fallen to {envelope.final / envelope.largest:.2g} of its largest amplitude"
        return Decision(f"the vibration has died out: {text}", Regime.DAMPED)

    def trend(self) -> Decision | None:
        """Decides where the motion still grows or decays; otherwise it finds the settled part."""
        if self.context.frictionless:
            if self.context.growth() < 0.0:
                return Decision("without friction nothing excites the shoe, and the dashpots damp it", Regime.DAMPED)
            return Decision("without friction nothing excites the shoe, but no dashpot damps it; a dashpot would decide")
        if self._settle():
            return None
        slope = self.evidence.get("envelope_slope")
        if slope is None:
            return Decision("the motion comes and goes; run longer")
        if abs(slope) <= self.limits.trend_errors * self.evidence["envelope_slope_error"]:
            return None  # an amplitude that beats or wanders, without a trend
        if self.context.growth() > 0.0 and 0.5 * abs(slope) * self.duration <= _NEAR:
            return None  # a vibration that has reached its limits, cannot die out, and comes near its amplitude
        text = f"still {'growing' if slope > 0.0 else 'decaying'} at {abs(slope):.3g} 1/s"
        return Decision(f"{text}; run at least {3.0 / abs(slope):.2g} s longer")

    def sustained(self) -> Decision:
        theory = self.context.linear() if not self.context.forced else None
        self.cycles = found = cycles_of(self.settled_part, theory.slip if theory else None)
        cycles = found.evidence["cycles"] if found else 0.0
        self.evidence |= found.evidence if found else {}
        if not found or cycles < self.limits.fewest_cycles:
            return Decision(f"only {cycles:.0f} cycles in the settled part; run longer")
        period, stick, harmonic = (found.evidence[name] for name in ("samples_per_cycle", "stick_cycles", "harmonic_share"))
        if period < self.limits.samples_per_cycle:
            return Decision(f"only {period:.1f} samples a cycle; reduce output.sample_interval")
        if self._settled_seconds < 2.0 * (slow := self._slowest(found.amplitude)):
            return self._too_short(slow)
        if theory and (decision := self._unfounded(theory, found)):
            return decision
        if self.context.forced and self._feeds() is Feeds.UNKNOWN:
            return self._either()
        own = Excitation.SELF_EXCITED, found.frequency
        if stick >= self.limits.stick_cycles:
            text = f"sustained, with stick in {stick:.0%} of {cycles:.0f} cycles"
            return Decision(text, Regime.RELAXATION, *own)
        lines = f"{harmonic:.0%} of the energy of vx in one line and its harmonics"
        if stick == 0.0 and harmonic >= self.limits.harmonic_share:
            return Decision(f"sustained without stick: {lines}", Regime.QUASI_HARMONIC, *own)
        irregular = f"irregular: stick in {stick:.0%} of the cycles, {lines}"
        return Decision(f"{irregular}; run longer, or look at the spectrum")

    def _unfounded(self, theory: "Linear", found: Cycles) -> Decision | None:
        """What speaks against self-excited vibration on smooth surfaces, where theory knows small vibrations."""
        if found.limited < self.limits.stick_cycles:
            text = f"the shoe sticks or leaves the wheel in only {found.limited:.0%} of the settled part"
            return Decision(f"{text}; run longer")
        if theory.direction > 0:
            return None
        if theory.direction == 0:
            return Decision("sliding is stable, and no dashpot makes a large vibration settle; a dashpot would decide")
        if abs(found.drift) > _DRIFT:
            text = f"sliding is stable, and the amplitude still changes by {found.drift:.2%}"
            return Decision(f"{text} within the last part of the run; run longer")
        return None

    def _feeds(self) -> "Feeds":
        """Who gives energy to the vibration on a rough wheel.

        The roughness, where friction takes energy in the mean, or gives less than half as much as the roughness while
        sliding is stable. Friction, where the roughness takes energy, or gives less than friction, or less than half
        as much if sliding is stable.
        """
        friction, off = self.settled_part.power("friction_force", "vx")
        roughness, off_too = self.settled_part.power("normal_force", "vy")
        self.evidence |= {"power_of_friction": friction, "power_of_roughness": roughness}
        error = self.limits.trend_errors * math.hypot(off, off_too)
        stable = self.context.growth() < 0.0 and not self._unstable_in_full_contact
        if stable and roughness - 2.0 * max(friction, 0.0) > error:
            return Feeds.ROUGHNESS
        if friction + self.limits.trend_errors * off < 0.0 and roughness > -0.5 * friction:
            return Feeds.ROUGHNESS
        if friction > error and (roughness + error < 0.0 or friction > (2.0 if stable else 1.0) * roughness):
            return Feeds.FRICTION
        return Feeds.UNKNOWN

    def fed(self) -> Decision | None:
        """On a rough wheel: forced where it is the roughness that feeds the vibration."""
        if not self.context.forced or self._feeds() is not Feeds.ROUGHNESS:
            return None
        return self._forced(f"only the roughness shakes the shoe: {self._powers}")

    def _either(self) -> Decision:
        remedy = "a second run, without roughness or with less friction, decides at the cost of this one"
        return Decision(f"{self._powers}, so that either may keep it up; {remedy}")

    @property
    def _powers(self) -> str:
        friction, roughness = (self.evidence[name] for name in ("power_of_friction", "power_of_roughness"))
        return f"friction gives {friction:.2g} W and the roughness {roughness:.2g} W to the vibration"

    def decide(self) -> Decision:
        """What the first rule that applies decides."""
        rules = (self.contact, self.unmoved, self.linear, self.forced, self.died_out, self.trend, self.fed)
        return next((found for rule in rules if (found := rule()) is not None), None) or self.sustained()

    def split(self) -> tuple[float, float] | None:
        """Half of peak to peak of x (m) that roughness forces and that the shoe adds, by the lines of the spectrum."""
        slow = min((frequency for frequency, _ in self.context.waves), default=0.0)
        return self.settled_part.split(self.context.forced) if self._settled_seconds * slow >= 2.0 else None

    def amplitude(self, decision: Decision) -> tuple[float, float | None]:
        """Half of peak to peak of x (m) as a median over cycles, and its spread."""
        part = self.settled_part
        if self.cycles and decision.excitation is Excitation.SELF_EXCITED:
            return self.cycles.amplitude, self.cycles.amplitude_spread
        if decision.excitation is not Excitation.FORCED:
            return part.amplitude("x"), None
        if self.theory and self.parts and not self.settled:
            return self.parts[0], None
        period = max(self._slowest(0.0) / self.history.interval, 1.0)
        samples = len(part.last("x"))
        edges = samples - period * np.arange(int(samples / period), -1, -1)
        return median(swings(part, edges)) if len(edges) > 1 else (part.amplitude("x"), None)


def classify(history: History, context: Context, thresholds: Thresholds = Thresholds()) -> Verdict:
    """The regime of a run's history, by the rules of docs/regimes.md; the first that applies decides."""
    rules = _Rules(history, context, thresholds)
    decision = rules.decide()
    part, belt, cycles = rules.settled_part, context.belt_speed, rules.cycles
    sustained = cycles is not None and decision.excitation is Excitation.SELF_EXCITED
    friction, torques = part.mean("friction_force"), part.extremes("friction_force")
    evidence = rules.evidence | {f"amplitude_{name}": part.amplitude(name) for name in ("y", "vx", "vy")}
    if belt != 0.0:
        evidence["largest_vx_over_belt_speed"] = part.extremes("vx")[int(belt > 0.0)] / belt
    evidence |= part.lines(context.forced) | (context.powers(part) if context.steady else {})
    forced, own = rules.parts or rules.split() or (None, None)
    amplitude, spread = rules.amplitude(decision)
    return Verdict(
        regime=decision.regime,
        excitation=decision.excitation,
        frequency=decision.frequency,
        amplitude=amplitude,
        amplitude_spread=spread,
        amplitude_forced=forced,
        amplitude_own=own,
        growth_rate=rules.theory.mode.growth if rules.theory else None,
        ringing_frequency=rules.theory.mode.frequency if rules.theory else None,
        frequency_resolution=1.0 / (segment(part.stop - part.start) * history.interval),
        torque_variation=context.radius * (torques[1] - torques[0]),
        settled_from=part.start * history.interval,
        start=part.start,
        settled=rules.settled and decision.regime is not Regime.UNDECIDED,
        stick_fraction=cycles.stick_fraction if sustained and cycles else part.fraction(ContactState.STICK),
        contact_loss_fraction=(
            cycles.contact_loss_fraction if sustained and cycles else part.fraction(ContactState.SEPARATED)
        ),
        mean_friction_force=friction,
        braking_torque=context.radius * friction,
        reasons=(decision.reason,),
        evidence=evidence,
        thresholds=thresholds,
    )
