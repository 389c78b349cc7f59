"""Forced or not: the rules on a rough wheel, by lines, power and the sign of σ."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.analysis.regime.cycles import Cycles
from brakecli.analysis.regime.evidence import LINE_BINS, WINDOWS, Envelope, Part, follows
from brakecli.analysis.regime.verdict import Context, Decision, Excitation, Feeds, Regime, Thresholds
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState

if TYPE_CHECKING:  # a measured signal needs no compiled code
    from brakecli.analysis.regime.linear import Linear

# Growth rate times duration
GROWN = math.log(1e9)  # from which a disturbance grows from rounding to the size of the motion
_NOTHING = 1e-3  # which may come from the rounding of the eigenvalues
_RELAXED = 1.0  # within a settled part, from which on what it shows does last

QUARTER = 4.0 / 3.0  # a run whose last quarter is settled, over what comes before
_ERRORS = 2.0  # standard errors of a mean power
_LARGER = 5.0  # times what the waves force in full contact: a larger motion needs more proof that it is forced
_OFTEN = 0.1  # part of the time that shows that stick or flight holds a vibration within its limits
_RING_DOWN = 0.5  # of the own vibration's decay, and of what dashpots take, that is kept up by nothing
TO_TOUCH = "check load.force, and the angles of the links"
_ON_LINES = "of the energy of vx lies on the lines of the roughness"
_TRACE = 0.1  # part of the energy of vx on the lines themselves, without which nothing is their subharmonic


class ForcedRules:
    """A history as it is judged, and the rules that say whether the roughness shakes the shoe."""

    envelope: Envelope

    def __init__(self, history: History, context: Context, limits: Thresholds) -> None:
        """Take a history and what is known of its case."""
        self.history, self.context, self.limits = history, context, limits
        self.duration = history.samples * history.interval
        self.whole = Part(history, 0, history.samples)
        self.last = Part(history, history.samples * (WINDOWS - 10) // WINDOWS, history.samples)
        self.settled_part, self.settled = Part(history, history.samples // 2, history.samples), False
        self.theory: Linear | None = None  # where the motion is linear
        self.cycles: Cycles | None = None
        self.parts: tuple[float, float] | None = None  # m, half of peak to peak: forced, and added
        self.unseen = 0.0  # m, by which waves that beat force more at other times
        self.rings = False  # whether what the shoe adds to a forced motion has not died away yet
        self.evidence: dict[str, Any] = {}

    def _slowest(self, amplitude: float) -> float:
        """Period (s) of the slowest wave that counts beside an amplitude of x (m) and beside the others; or 0."""
        return 1.0 / min(counts) if (counts := self._counting(amplitude)) else 0.0

    def _counting(self, amplitude: float) -> list[float]:
        """Frequencies (Hz) of the waves that count beside an amplitude of x (m) and beside the others."""
        least = max([amplitude, *(swing for _, swing in self.context.waves)])
        return [f for f, swing in self.context.waves if swing >= self.limits.settled_within * least]

    def _beat(self, amplitude: float = 0.0) -> float:
        """Period (s) of the slowest wave, or of the slowest beat of one that counts with a multiple of another."""
        slow, counts = self._slowest(amplitude), self._counting(amplitude)
        beats = [abs(f - n * g) for f in counts for g in counts for n in range(1, 11)]
        return max([slow, *(1.0 / beat for beat in beats if beat * slow > _NOTHING)])

    def _long_enough(self, slow: float) -> float:
        """Duration (s) of a run whose settled part holds two periods."""
        start = self.settled_part.start * self.history.interval if self.settled else 2.0 * slow
        return max(start + 2.0 * slow, QUARTER * 2.0 * slow) * 1.05

    def _too_short(self, slow: float) -> Decision:
        turns = (self.duration if self.duration < slow else self._settled_seconds) / slow
        what = "run" if self.duration < slow else "settled part"
        text = f"the {what} holds only {turns:.2g} periods of the slowest wave, which passes every {slow:.3g} s"
        return Decision(text, advice=f"run at least {self._long_enough(slow):.3g} s")

    @property
    def _settled_seconds(self) -> float:
        return self.duration - self.settled_part.start * self.history.interval

    def forced(self) -> Decision | None:
        """Decides where the roughness shakes the shoe, by where the energy of vx lies."""
        if not self.context.forced:
            return None
        slow = self._slowest(self.settled_part.amplitude("x"))
        if self.duration < slow:
            return self._too_short(slow)
        growth = self.context.growth()
        if self.context.frictionless:
            text = "without friction nothing else excites it"
            return self._forced(text) if growth < 0.0 else Decision(f"{text}, but no dashpot damps the shoe")
        if self.context.feeds is Feeds.ROUGHNESS:
            return self._forced("a second run shows it")
        if self.context.feeds is Feeds.FRICTION:
            return None
        share, dense = self._share(self.context.forced, 0.5)
        self.evidence["forced_share"] = share
        if share >= self.limits.forced_share and self.context.undamped and growth <= 0.0:
            text = f"{share:.0%} {_ON_LINES}"
            return Decision(f"{text}, but no dashpot damps what the shoe adds", advice="a dashpot would decide")
        if growth < 0.0 and not self._unstable_in_full_contact and not self._larger and self._follows():
            self._feeds()
            if self._locked:
                return self._either()
            return self._forced("the motion comes back wherever the waves of the wheel do, and sliding is stable")
        if share < self.limits.forced_share:
            lines = tuple({*self.context.forced, *self.context.subharmonics()})
            trace = share
            share, dense = self._share(lines, 0.3)
            if growth >= 0.0 or dense or share < self.limits.forced_share or trace < _TRACE:
                return None
        powers_of_e = growth * self.duration
        if powers_of_e > GROWN:
            return None  # the shoe's own vibration falls on the same lines
        feeds, larger = self._feeds(), self._larger
        if feeds is Feeds.FRICTION and larger and self._settle():
            return None
        what = f"{share:.0%} {_ON_LINES}"
        if powers_of_e > _NOTHING:
            own = f"but sliding is unstable: the shoe's own vibration grows at {growth:.3g} 1/s"
            advice = f"run at least {1.01 * GROWN / growth:.3g} s"
            return self.fed() or Decision(f"{what}, {own}", advice=advice, second_run=True)
        if feeds is Feeds.FRICTION and self.evidence["power_of_roughness"] < 0.0:
            return None
        doubtful = larger or self._unstable_in_full_contact or self._locked
        doubtful = doubtful or (self._makes_up and self._own_line() is not None)
        if feeds is Feeds.FRICTION or (doubtful and feeds is Feeds.UNKNOWN):
            return self._either()
        if dense:
            text = f"{what}, which lie too close to be told from others"
            return self.fed() or Decision(text, advice="run twice as long", second_run=True)
        decision = self._forced(what)
        if what in decision.reason:
            self.evidence["forced_share"] = share
        return decision

    @property
    def _unstable_in_full_contact(self) -> bool:
        theory = self.context.linear()
        return theory is not None and theory.direction > 0

    @property
    def _doubtful(self) -> bool:
        """Whether friction can keep up only a large vibration, which no second run has shown.

        Full contact says nothing of a pad that opens and moves as the waves do.
        """
        if self.context.feeds is Feeds.FRICTION:
            return False
        stable = self.context.growth() < 0.0
        if self.evidence.get("forced_share", 0.0) >= self.limits.forced_share:
            return stable or self._follows()
        return stable and not self._unstable_in_full_contact

    @property
    def _locked(self) -> bool:
        """Whether a vibration that friction keeps up may be locked to the waves, and go on without them.

        It often sticks or leaves the wheel, and gets more from friction than from the roughness, as far as samples
        show.
        """
        states = (ContactState.STICK, ContactState.SEPARATED)
        limited = sum(self.settled_part.fraction(state) for state in states) >= _OFTEN
        return limited and self._gives[0] > max(self._gives[1], 0.0)

    @property
    def _makes_up(self) -> bool:
        """Whether friction gives far more than the roughness, and about what the dashpots take."""
        friction, roughness = self._gives
        lost = self.context.powers(self.settled_part).get("power_dashpots", 0.0)
        return friction > 2.0 * max(roughness, 0.0) and abs(friction - lost) < _RING_DOWN * lost

    @property
    def _relaxed(self) -> bool:
        """Whether small disturbances change by a factor of e within the settled part: slower drifts hide in it."""
        return abs(self.context.growth()) * self._settled_seconds >= _RELAXED

    @property
    def _relaxing(self) -> float:
        """Duration (s) of a run in whose last quarter they do."""
        return 4.0 * _RELAXED / abs(self.context.growth())

    @property
    def _rate(self) -> float:
        """Rate (1/s) at which disturbances of a limit cycle change: dashpots alone may make it settle."""
        return 0.0 if self.context.undamped else min(abs(self.context.growth()), self.context.settles)

    @property
    def lasts(self) -> bool:
        """Whether the numbers of the settled part are those of any longer run."""
        return self.settled and (self.theory is not None or self._rate * self._settled_seconds >= _RELAXED)

    @property
    def _larger(self) -> bool:
        return 0.0 < _LARGER * self._expected < self.last.deviation("x")

    @property
    def _expected(self) -> float:
        """Standard deviation of x (m) that the waves force in full contact."""
        return math.sqrt(0.5 * sum(swing**2 for _, swing in self.context.waves))

    def _follows(self) -> bool:
        return any(follows(part, self.context.waves) for part in (self.settled_part, self.last))

    def _share(self, lines: Sequence[float], most: float) -> tuple[float, bool]:
        """Part of the energy of vx on lines, in the second half or in the last quarter, where it is more.

        Also whether that shows nothing: the lines cover more than `most` of the band, and the motion is larger
        than what they force.
        """
        shares = []
        for part, bins in ((self.settled_part, LINE_BINS), (self.last, LINE_BINS // 2)):  # as many Hz
            dense = part.covered(lines, bins) > most and part.deviation("x") > 2.0 * self._expected
            shares.append((part.share(lines, bins), dense))
        clear = [share for share, dense in shares if not dense and share >= self.limits.forced_share]
        return (max(clear), False) if clear else max(shares)

    def _forced(self, what: str) -> Decision:
        """Forced, as seen in a settled part of two periods of the slowest wave, and as `what` shows."""
        if self._open and not self.context.touches():
            text = "sliding steadily the shoe would not touch the wheel: it bounces, and may leave it for good"
            return Decision(text, advice=TO_TOUCH)
        growth = self.context.growth()
        fading = 0.25 * self.duration * growth > -_RELAXED  # too slowly to be seen within a quarter of the run
        falls = 0.0
        if not self._settle() and not fading:
            falls, changes = self._changes()
            self.settled = changes <= self.limits.settled_within
        slow = self._slowest(self.settled_part.amplitude("x"))
        if self._settled_seconds < 2.0 * slow:
            return self._too_short(slow)
        self.rings = not self.lasts and growth < 0.0 and (fading or falls > self.limits.settled_within)
        if not self.rings:
            if self._settled_seconds < (beat := self._beat()):
                self.settled, what = False, f"{what}; the waves beat every {beat:.3g} s"
            return Decision(f"only the roughness shakes the shoe: {what}", Regime.DAMPED, Excitation.FORCED)
        needed = max(QUARTER * (self.duration - self._powers_to_lose / growth), self._long_enough(slow))
        advice = f"run at least {needed:.3g} s to see the amplitude that lasts"
        rate = f"a small vibration of its own decays at {-growth:.3g} 1/s"
        if self._trend < _RING_DOWN * growth and self._open:
            text = f"still decaying at {-self._trend:.3g} 1/s; {rate}"
            return Decision(text, advice=advice, second_run=True)
        known = f"{what}; {rate}"
        if line := self._own_line():
            own = f"{rate}; its line at {line:.4g} Hz is not told from the waves'"
            known = own if what.endswith(_ON_LINES) else f"{what}; {own}"  # their share holds that line
        text = f"the roughness shakes the shoe: {known}"
        return Decision(text, Regime.DAMPED, Excitation.FORCED, advice=advice)

    @property
    def _open(self) -> bool:
        """Whether neither theory nor a second run has shown that what does not decay is forced."""
        return not self.context.frictionless and self.context.feeds is Feeds.UNKNOWN

    @property
    def _trend(self) -> float:
        """Slope (1/s) of the logarithm of the envelope's second half; 0 where it is unknown or chance."""
        slope, error = (self.evidence.get(f"envelope_slope{what}", 0.0) for what in ("", "_error"))
        return slope if abs(slope) > self.limits.trend_errors * error else 0.0

    def _changes(self) -> tuple[float, float]:
        """By which vx or x, whichever does more so, swings less in the last quarter, and by which otherwise."""
        before = replace(self.whole, start=self.settled_part.start, stop=3 * self.history.samples // 4)
        sizes = [np.array([each.deviation("vx"), each.amplitude("x")]) for each in (before, self.last)]
        parts = sizes[0] / np.maximum(sizes[1], 1e-300) - 1.0
        return float(parts.max()), float(np.abs(parts).max())

    def _own_line(self) -> float | None:
        """Frequency (Hz) of a mode that lies on lines with more of the energy than forced motion may lack."""
        bins = LINE_BINS / self._settled_seconds
        for own in (mode.frequency for mode in self.context.modes() if mode.frequency > 0.0):
            near = [line for line in self.context.forced if abs(line - own) <= 2.0 * bins]
            if self.settled_part.share(near) > 1.0 - self.limits.forced_share:
                return own
        return None

    @property
    def _powers_to_lose(self) -> float:
        """Powers of e by which what the shoe adds has to decay until the forced motion is left."""
        forced = math.sqrt(0.5 * sum((f * swing) ** 2 for f, swing in self.context.waves))
        lasting = self.limits.decayed_to * forced
        left = self.envelope.final / (2.0 * math.pi * lasting) if lasting > 0.0 else 1.0
        return min(max(3.0, math.log(max(left, 1.0))), GROWN)

    def _settle(self) -> bool:
        """Find the settled part."""
        first = self.envelope.settled_window(self.limits.settled_within, self.limits.reach_within)
        if first is not None:
            start = first * self.history.samples // WINDOWS
            self.settled_part, self.settled = replace(self.settled_part, start=start), True
        return self.settled

    def _feeds(self) -> "Feeds":
        """Who gives energy to the vibration on a rough wheel.

        The roughness, where sliding is stable and friction takes energy in the mean or gives less than half as
        much. Friction, where the roughness takes energy or gives less; less than half as much if sliding is
        stable. Nobody knows where the account stays open by half of that: F_x jumps between samples.
        """
        friction, off = self.settled_part.power("friction_force", "vx")
        roughness, off_too = self.settled_part.power("normal_force", "vy")
        self.evidence |= {"power_of_friction": friction, "power_of_roughness": roughness}
        if self.context.feeds is not Feeds.UNKNOWN:
            return self.context.feeds
        lost = self.context.powers(self.settled_part).get("power_dashpots", friction + roughness)
        open_by = abs(friction + roughness - lost)
        error = _ERRORS * max(math.hypot(off, off_too), open_by)
        stable = self.context.growth() < 0.0 and not self._unstable_in_full_contact
        takes = self.context.growth() < 0.0 and friction + _ERRORS * max(off, open_by) < 0.0
        shakes = stable and roughness - 2.0 * max(friction, 0.0) > error
        if (shakes or (takes and roughness > -0.5 * friction)) and friction + roughness > _RING_DOWN * lost:
            return Feeds.ROUGHNESS
        if friction > error and (roughness + error < 0.0 or friction > (2.0 if stable else 1.0) * roughness):
            return Feeds.FRICTION
        return Feeds.UNKNOWN

    @property
    def _gives(self) -> tuple[float, float]:
        """What friction and the roughness give to the vibration, W."""
        return self.evidence["power_of_friction"], self.evidence["power_of_roughness"]

    def fed(self) -> Decision | None:
        """On a rough wheel: forced where it is the roughness that feeds the vibration."""
        if not self.context.forced or self._feeds() is not Feeds.ROUGHNESS:
            return None
        return self._forced(self._powers)

    def _either(self) -> Decision:
        friction, roughness = self._gives
        rings = friction + roughness <= 0.0
        who = "either" if min(friction, roughness) > 0.0 else "friction" if friction > 0.0 else "the roughness"
        text = f"{self._powers}, so that {'it may be ringing down' if rings else f'{who} may keep it up'}"
        if self.context.undamped and self.context.growth() <= 0.0:
            return Decision(f"{text}, and no dashpot damps what the shoe adds", advice="a dashpot would decide")
        return Decision(text, advice="run longer" if rings else "", second_run=True)

    @property
    def _powers(self) -> str:
        friction, roughness = (f"{'gives' if each > 0.0 else 'takes'} {abs(each):.2g} W" for each in self._gives)
        return f"of the vibration's power friction {friction} and the roughness {roughness}"

    def split(self, lines: Sequence[float]) -> tuple[float, float] | None:
        """Half of peak to peak of x (m) that roughness forces on lines (Hz), and that the shoe adds."""
        slow = min((frequency for frequency, _ in self.context.waves), default=0.0)
        return self.settled_part.split(lines) if self._settled_seconds * slow >= 2.0 else None
