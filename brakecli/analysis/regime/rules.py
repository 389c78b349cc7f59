"""What kind of vibration a history shows, and why: the rules. `evidence` measures what they go by."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brakecli.analysis.regime.cycles import (
    SIZE_OFF,
    Cycles,
    Drift,
    contact_length,
    cycles_of,
    in_lines,
    median,
    swings,
)
from brakecli.analysis.regime.evidence import FEWEST_SAMPLES, Envelope
from brakecli.analysis.regime.forced import GROWN, QUARTER, TO_TOUCH
from brakecli.analysis.regime.linear_rules import DASHPOT, LinearRules
from brakecli.analysis.regime.verdict import Decision, Excitation, Feeds, Regime
from brakecli.solver.quantities import ContactState

if TYPE_CHECKING:  # a measured signal needs no compiled code
    from brakecli.analysis.regime.linear import Linear

_NEAR = 0.3  # by which the amplitude of a motion that stick or loss of contact limits may still change
_DRIFT = 5e-3  # by which the amplitude of a motion without stick may change where sliding is stable
_BANDS = 0.9  # least part of the energy in three bands: chaos may have less
_SPREAD = 0.05  # of the frequency of cycles, beyond which three bands hold no vibration
_CYCLES_SHARE = 0.5  # of the energy on the lines of the cycles, below which the strongest line must be one of them
_CREEPS = 2.0  # amplitudes by which the mean of x may move where nothing has settled
_MODULATES = 0.1  # of a vibration, beside which waves count: smaller ones change its cycles, too
_SPARSE = 8  # of the places at which a forced motion is computed, one of so many suffices
_UNSETTLED = 1.5  # times as many cycles where nothing has settled: a hop may look like a vibration
_SURE = 10.0  # standard errors of a slope: neighbouring windows of an amplitude that wanders go together
_LONG = "run longer"
_SHIFTED = 0.5  # of itself, by which impacts may shift a cycle: beyond, its frequency is not known to _SPREAD
_KICKED = 0.5, 0.1  # of its shift by impacts: most that the amplitude and the frequency of a cycle were off
_FED = 0.1  # of what keeps a vibration up, that nodes may add


class Rules(LinearRules):
    """The rules on one history, in their order. They gather evidence until one of them decides."""

    drifts: str | None = None  # why a limit cycle that seems settled may still change

    def contact(self) -> Decision | None:
        """The shoe does not touch the wheel, or sticks to it throughout."""
        standing = self.context.belt_speed == 0.0
        if self.settled_part.fraction(ContactState.SEPARATED) == 1.0:
            never = self.whole.fraction(ContactState.SEPARATED) == 1.0
            text = "never touched the wheel" if never else "lost contact for good"
            return Decision(f"the shoe has {text}", advice=TO_TOUCH)
        if self.last.fraction(ContactState.SEPARATED) == 1.0:
            return Decision("the shoe has left the wheel", advice="run longer, to see whether it comes back")
        if (self.last if standing else self.settled_part).fraction(ContactState.STICK) < 1.0:
            return None
        if standing:
            return Decision("the shoe has come to rest, sticking to the standing wheel", Regime.DAMPED)
        text = "the shoe sticks throughout and is carried along by the wheel"
        if not self.context.held:
            return Decision(f"{text}: no link holds it along the wheel", advice="incline a link, by its angle_deg")
        if (limit := self.context.locks) is None or not self.context.steady:
            return Decision(text, advice=_LONG)
        why = "friction grows faster with x than the force that it needs, so that no longer run will see it slip"
        return Decision(
            f"{text}: it locks itself, as {why}", advice=f"it slips below a friction coefficient of {limit:.4g}"
        )

    def unmoved(self) -> Decision | None:
        """There is nothing to judge, or nothing that could settle."""
        if self.history.samples < FEWEST_SAMPLES:
            return Decision(f"fewer than {FEWEST_SAMPLES} samples", advice=_LONG)
        envelope = self.envelope = Envelope(self.history)
        self.evidence |= envelope.evidence
        if not self.context.steady:
            return Decision("the wheel's speed or the load changes with time, so the motion cannot settle")
        if envelope.largest > self.context.quiet:
            return None
        if (growth := self.context.growth()) > 0.0:
            text = f"nothing moves yet, but sliding is unstable: a disturbance grows at {growth:.3g} 1/s"
            longer = f", or run at least {GROWN / growth:.2g} s" if growth * self.duration < GROWN else ""
            return Decision(text, advice=f"start beside steady sliding{longer}")
        return Decision("nothing moves beyond rounding: the shoe slides steadily or rests", Regime.DAMPED)

    def died_out(self) -> Decision | None:
        """Little is left beside the start, beside the wheel's speed and beside the compression, and it falls."""
        envelope = self.envelope
        if self.context.belt_speed == 0.0 and self.context.growth() < 0.0:
            return Decision("the wheel stands: friction and dashpots take the energy", Regime.DAMPED)
        kept = bool(self.context.forced) and self.context.growth() < 0.0  # up by the roughness
        falls = self.evidence.get("envelope_slope", 0.0) < 0.0 or (kept and self._trend == 0.0)
        falls |= envelope.final <= self.context.quiet
        ends = self.last.fraction(ContactState.STICK) == self.last.fraction(ContactState.SEPARATED) == 0.0
        if envelope.final > max(self._little, self.context.quiet) or not (falls and ends):
            return None
        if self.context.growth() > 0.0:
            return None
        text = f"vx has fallen to {envelope.final / envelope.largest:.2g} of its largest amplitude"
        if kept:
            found = self._forced(text)
            if found.regime is Regime.DAMPED:
                return found
            text = f"the shoe's own vibration has died out: {text}; {found.sentence}"
            return Decision(text, Regime.DAMPED, Excitation.FORCED)
        return Decision(f"the vibration has died out: {text}", Regime.DAMPED)

    @property
    def _little(self) -> float:
        """Standard deviation of vx (m/s) below which a vibration has died out."""
        belt = abs(self.context.belt_speed) or math.inf
        return self.limits.decayed_to * min(self.envelope.largest, belt, self.context.scale)

    def trend(self) -> Decision | None:
        """Decides where the motion still grows or decays; otherwise it finds the settled part."""
        if self.context.frictionless:
            text = "without friction nothing excites the shoe"
            if self.context.growth() < 0.0:
                return Decision(f"{text}, and the dashpots damp it", Regime.DAMPED)
            return Decision(f"{text}, but no dashpot damps it", advice=DASHPOT)
        if self._settle():
            return None
        if "envelope_slope" not in self.evidence:
            return Decision("the motion comes and goes", advice=_LONG)
        if not (slope := self._trend):
            return None  # an amplitude that beats or wanders, without a trend
        if self.context.growth() > 0.0 and 0.5 * abs(slope) * self.duration <= _NEAR:
            return None  # a vibration that has reached its limits, cannot die out, and comes near its amplitude
        text = f"still {'growing' if slope > 0.0 else 'decaying'} at {abs(slope):.3g} 1/s"
        if self.context.undamped and (slope < 0.0 or self.context.growth() <= 0.0):  # it wanders
            text += f", {'and' if slope > 0.0 else 'though'} no dashpot damps the shoe"
            return Decision(text, advice="run four times as long, or add a dashpot")
        more = 3.0 / abs(slope)
        if slope < 0.0:  # until what is left is forced, has died out, or lasts
            more = max(self._powers_to_lose, math.log(max(self.envelope.final / self._little, 1.0))) / -slope
        longer = QUARTER * (self.duration + more) - self.duration  # the last quarter is judged
        return Decision(text, advice=f"run at least {longer:.2g} s longer")

    def sustained(self) -> Decision:
        """What is left is a vibration that lasts, if enough of it is there: its cycles decide."""
        theory = self.context.linear() if not self.context.forced else None
        known, slip = self.context, theory.slip if theory else None
        self.cycles = found = cycles_of(self.settled_part, slip, known.step, known.belt_speed, known.waves)
        cycles = found.evidence["cycles"] if found else 0.0
        self.evidence |= found.evidence if found else {}
        if not found or cycles < (1.0 if self.settled else _UNSETTLED) * self.limits.fewest_cycles:
            text = f"only {cycles:.0f} cycles in the {'settled part' if self.settled else 'second half'}"
            if (growth := self.context.growth()) > 0.0:
                text += f", and a disturbance of steady sliding grows at {growth:.3g} 1/s"
            return Decision(text, advice=_LONG)
        names = ("samples_per_cycle", "stick_cycles", "harmonic_share")
        period, stick, harmonic = (found.evidence[name] for name in names)
        if period < (few := self.limits.samples_per_cycle):
            both = "solver.step and " if period * self.history.interval < few * known.step else ""
            return Decision(f"only {period:.1f} samples a cycle", advice=f"reduce {both}output.sample_interval")
        if self._settled_seconds < 2.0 * (slow := self._slowest(found.amplitude)):
            return self._too_short(slow)
        if theory and (decision := self._unfounded(theory, found)):
            return decision
        # The waves cannot force it, and sliding is unstable.
        certain = self._larger and self.context.growth() > 0.0 and self._relaxed
        if self.context.forced and not certain and (self._feeds() is Feeds.UNKNOWN or self._doubtful):
            return self._either()
        drift = abs(found.drift.part) if found.drift.sure else 0.0
        self._drift_further(found, max(drift, abs(found.detuning.part) if found.detuning.sure else 0.0))
        if self.lasts and self._settled_seconds < (beat := self._beat(_MODULATES * found.amplitude)):
            longer = 1.05 * (self.settled_part.start * self.history.interval + beat)
            text = f"the waves beat every {beat:.3g} s: run at least {longer:.3g} s for numbers that last"
            self.settled, self.drifts = False, text
        unsure = self.context.undamped or self.context.growth() < 0.0
        if drift > (_DRIFT if unsure else self.limits.settled_within):
            text = f"the amplitude still changes by {found.drift.part:.1%} within the last part of the run"
            return Decision(text, advice=_LONG)
        if self.context.forced and (decision := self._rippled()):
            return decision
        own, wander = (Excitation.SELF_EXCITED, found.frequency), found.evidence["frequency_spread"]
        held = self._held(wander, found.frequency, found.detuning)
        off = found.frequency_off + _KICKED[1] * self._shift * found.frequency
        self.evidence["frequency_spread"] = min((wander if held is None else held) + off, found.frequency)
        wanders = wander > _SPREAD * found.frequency
        missed = None if wanders or harmonic >= _CYCLES_SHARE else self._missed(found.frequency, wander)
        if stick >= self.limits.stick_cycles and not missed:
            text = f"sustained, with stick in {stick:.0%} of {cycles:.0f} cycles"
            return Decision(text, Regime.RELAXATION, *own)
        unseen = self._sticks(found.may_stick - stick) > 0  # in more than hardly any
        if unseen and self._sticks(stick) != self._sticks(found.may_stick):
            return self._unseen(stick, found.may_stick)
        bands = self.evidence["band_share"] = self.settled_part.narrow()
        lines = f"{harmonic:.0%} of the energy of vx in one line and its harmonics"
        if harmonic < bands:
            lines = f"{bands:.0%} of the energy of vx in three narrow bands"
        regular = harmonic if wanders or bands < _BANDS else max(harmonic, bands)
        slips = max(stick, self.context.sticks) <= 1.0 - self.limits.stick_cycles
        if slips and regular >= self.limits.harmonic_share:
            how = f"with stick in only {stick:.0%} of the cycles" if stick else "without stick"
            own = (Excitation.SELF_EXCITED, missed or found.frequency)
            return Decision(f"sustained {how}: {lines}", Regime.QUASI_HARMONIC, *own)
        without = f" ({self.context.sticks:.0%} without the roughness)" if self.context.sticks else ""
        irregular = f"irregular: stick in {stick:.0%} of the cycles{without}, {lines}"
        irregular += ", but the frequency wanders" if wanders else ""
        irregular += f", but not at the {found.frequency:.4g} Hz of its rises" if missed else ""
        finer = "reduce output.sample_interval, " if self._sticks(stick) == 1 else ""  # stick may hide between two
        return Decision(irregular, advice=f"{finer}{'' if missed else 'run longer, or '}look at the spectrum")

    def _unseen(self, stick: float, may: float) -> Decision:
        """Stick is seen in a part of the cycles, and may fall between samples in more of them."""
        finer = 0.25 * self.history.interval
        keys = "solver.step and " * (finer < 1.1 * self.context.step) + "output.sample_interval"
        text = f"stick is seen in {stick:.0%} of the cycles, but may fall between samples in {may:.0%}"
        return Decision(text, advice=f"reduce {keys} to {finer:.2g} s")

    def _missed(self, frequency: float, off: float) -> float | None:
        """Frequency (Hz) of the strongest line of vx where it is no multiple of that of its rises."""
        line, width = self.settled_part.strongest
        multiple = max(round(line / frequency), 1)
        if abs(line - multiple * frequency) <= multiple * off + width:
            return None
        self.evidence |= {
            "frequency_spread": width,
            **in_lines(self.settled_part, line, 1.0 / line / self.history.interval),
        }
        return line

    def _rippled(self) -> Decision | None:
        """What the ripple of the nodes gives to a vibration that friction seems to keep up."""
        if not (ripple := self.context.ripple(self.settled_part, ())) or not ripple.counts:
            return None
        friction, _ = self.settled_part.power("friction_force", "vx")
        gains = max(self.context.powers(self.settled_part).get("power_dashpots", 0.0), abs(friction))
        if ripple.power <= _FED * gains:
            return None
        text = f"ripple of the contact's {ripple.nodes} nodes gives {ripple.power:.2g} W to the vibration"
        return Decision(f"{text}, so that friction may not keep it up", advice=ripple.advice)

    def _sticks(self, part: float) -> int:
        """Whether stick in a part of the cycles is stick in hardly any (0), in some, or in nearly all (2)."""
        return (part > 1.0 - self.limits.stick_cycles) + (part >= self.limits.stick_cycles)

    def _drift_further(self, found: Cycles, changed: float) -> None:
        """Whether a limit cycle that seems settled may still change, and how long a run must be to show it.

        Its amplitude or frequency has `changed` by a part of itself.
        """
        slope, error = abs(self._trend), self.evidence.get("envelope_slope_error", 0.0)
        change, rate, more = slope * self._settled_seconds, self._rate, 3.0
        settled, lasts, (parted, left) = self.settled, self.lasts, found.parting
        self.settled &= changed <= _DRIFT
        if not settled or rate == 0.0:
            return
        if (shift := self._shift) >= _SHIFTED:
            step, self.settled = self.context.step * math.sqrt(0.3 * _SHIFTED / shift), False
            text = f"this vibration settles at only {rate:.2g} 1/s, and impacts of so few steps may shift it by"
            advice = f"take a solver.step of {step:.2g} s, or a solver.tolerance"
            self.drifts = f"{text} {_KICKED[0] * shift:.0%}: {advice}"
            return
        if parted:
            rate, more, self.settled = parted / self._settled_seconds, left + 3.0, False
            text = f"neighbouring cycles part at {rate:.2g} 1/s, so that this vibration becomes another"
        elif not lasts:
            text = f"this vibration may settle at only {rate:.2g} 1/s"
        elif slope > _SURE * error and change > self.limits.settled_within:
            text, self.settled = f"the vibration still changes by {change:.0%} within the settled part", False
        elif not self.settled:
            text = f"its amplitude or frequency still changes by {changed:.1%} within the settled part"
        else:
            return
        self.drifts = f"{text}: run at least {QUARTER * (self.duration + more / rate):.3g} s for numbers that last"

    def _unfounded(self, theory: "Linear", found: Cycles) -> Decision | None:
        """What speaks against self-excited vibration on smooth surfaces, where theory knows small vibrations."""
        if found.limited < self.limits.stick_cycles:
            text = f"the shoe sticks or leaves the wheel in only {found.limited:.0%} of the settled part"
            return Decision(text, advice=_LONG)
        if not self.settled and (creep := self._creep) > _CREEPS * found.amplitude:
            text = f"x creeps by {creep:.2g} m in the second half, but vibrates by {found.amplitude:.2g} m only"
            return Decision(text, advice=_LONG)
        if theory.direction > 0:
            return None
        if theory.direction == 0:
            return Decision("sliding is stable, and no dashpot makes a large vibration settle", advice=DASHPOT)
        if not self._relaxed:
            text = f"sliding is stable, but disturbances decay at only {-theory.mode.growth:.2g} 1/s"
            advice = f"run at least {self._relaxing:.3g} s"
            return Decision(f"{text}, so that the vibration may still die out", advice=advice)
        sticks = found.evidence["stick_cycles"] >= self.limits.stick_cycles
        if abs(found.drift.part) > (self.limits.settled_within if sticks else _DRIFT):
            text = f"sliding is stable, and the amplitude still changes by {found.drift.part:.2%}"
            return Decision(f"{text} within the last part of the run", advice=_LONG)
        return None

    @property
    def _creep(self) -> float:
        """Distance (m) of the means of x in the third and in the last quarter."""
        before = replace(self.settled_part, stop=(self.settled_part.start + self.history.samples) // 2)
        after = replace(self.settled_part, start=before.stop)
        return abs(after.mean("x") - before.mean("x"))

    def decide(self) -> Decision:
        """What the first rule that applies decides."""
        rules = (self.contact, self.unmoved, self.linear, self.forced, self.died_out, self.trend, self.fed)
        return next((found for rule in rules if (found := rule()) is not None), None) or self.sustained()

    def amplitude(self, decision: Decision) -> tuple[float, float | None]:
        """Half of peak to peak of x (m) as a median over cycles, and its spread."""
        part = self.settled_part
        if (found := self.cycles) and decision.excitation is Excitation.SELF_EXCITED:
            short, change = self._settled_seconds < self._slowest(0.0), 0.5 * abs(self._trend) * self.duration
            if not self.lasts and (short or change > self.limits.settled_within):
                return found.amplitude, None  # where it ends, the run does not show
            spread = found.amplitude_spread + _KICKED[0] * self._shift * found.amplitude
            return found.amplitude, self._held(spread, found.amplitude, found.drift)
        if decision.excitation is not Excitation.FORCED:
            return part.amplitude("x"), None
        if self.theory and self.parts:
            return self.parts[0], self.parts[1] + self.unseen if self.settled else None
        samples = len(part.last("x"))
        period = max(min(self._beat() / self.history.interval, samples - 1), 1.0)
        edges = np.asarray(samples - period * np.arange(int(samples / period), -1, -1), np.float64)
        size, spread = median(swings(part, edges))
        if self.rings or len(edges) < 3 - self.settled:
            return size, None
        off = SIZE_OFF * size * self.context.step / self.history.interval / contact_length(part)
        return size, off + max(spread, self._beating() * part.amplitude("x") - size)

    def _beating(self) -> float:
        """Amplitude of a longer motion over that of the settled part, as waves beat that force a linear one."""
        if not (theory := self.context.linear()):
            return 1.0
        forced, lasting, *_ = theory.parts(*(each[::_SPARSE] for each in self.settled_part.places()))
        return 2.0 * forced / max(float(np.ptp(lasting)), 1e-300)

    @property
    def _shift(self) -> float:
        """Part of itself by which a step may shift a cycle: what impacts change in a cycle, over its decay in one.

        z' = (1 - rT) z + kick comes to rest at z = kick/rT.
        """
        found, rate = self.cycles, self._rate
        return found.kick * found.frequency / rate if found and rate > 0.0 else 0.0

    def _held(self, spread: float, value: float, drift: Drift) -> float | None:
        """A spread with what a drift becomes until small disturbances have changed by a factor of e."""
        if self.lasts:
            return spread + (abs(drift.part) * value if drift.sure else 0.0)
        if self.context.undamped:
            return None  # there is no end to it
        ends = min(self._rate * self._settled_seconds, 1.0)
        return min(spread + abs(drift.part) * value / max(ends, 1e-9), value)
