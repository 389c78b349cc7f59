"""The rules of a motion that is linear: theory decides where the shoe slides in full contact."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.analysis.regime.evidence import WINDOWS, line
from brakecli.analysis.regime.forced import QUARTER, ForcedRules
from brakecli.analysis.regime.spectra import Array
from brakecli.analysis.regime.verdict import Decision, Excitation, Regime

if TYPE_CHECKING:  # a measured signal needs no compiled code
    from brakecli.analysis.regime.linear import Linear

_REST = 0.3  # of a forced motion, by which its closed form may be off
_LONGER = 1.4  # a run whose last quarter and the window before it are settled, over what comes before
_FEWEST_PIECES, _PIECES = 4, 16  # of a settled part, in which the friction force is compared
_WIDER = 1.02  # times as far as in the last half of them, a transient swings
_FAR = 0.3  # rad, of a wave, by which what the shoe adds moves it
DASHPOT = "a dashpot would decide"


class LinearRules(ForcedRules):
    """The rules where theory knows the motion."""

    force_from = 0  # the sample from which on the force has settled: y may ring longer than x
    force_rings: float | None = None  # s, for which it still rings beside a settled x

    def linear(self) -> Decision | None:
        """Theory decides where the shoe has long been sliding in full contact, to one side."""
        theory, slow = self.context.linear(), self._slowest(0.0)
        start = max(min(self.last.start, self.history.samples - int(slow / self.history.interval)), 0)
        if theory is None:
            return None
        if not replace(self.last, start=start).slides(theory.slip) and not theory.stays(self._end()[1]):
            return None
        mean, theory = theory, theory.with_slopes()
        if theory.direction != mean.direction and (theory.direction == 0 or self._swings_far(theory)):
            return self._steep(theory)
        self.theory = theory
        if theory.direction == 0:
            return Decision(theory.sentence, advice=DASHPOT)
        if theory.direction > 0:
            if remedy := self.context.steadier():
                return Decision(f"{theory.sentence}, but the scheme's steps damp it", advice=remedy)
            more = theory.seconds_to_limit(*self._end())
            self.evidence["seconds_to_go"] = more = more + 3.0 / theory.mode.growth
            return Decision(theory.sentence, advice=f"run at least {QUARTER * (self.duration + more):.3g} s")
        if not len(theory.waves):
            return Decision(theory.sentence, Regime.DAMPED)
        if self.duration < slow:
            return self._too_short(slow)
        return self._shaken(theory, slow, (self.history.samples - start) * self.history.interval)

    def settle_force(self) -> None:
        """Find from where on the friction force of a forced motion has settled: it may ring longer than x.

        From there on it swings no wider, within pieces of the settled part, than in the last half of them.
        """
        part, interval = self.settled_part, self.history.interval
        seconds = max(self.context.pattern, self._beat())
        count = min(int((part.stop - part.start) * interval / seconds), _PIECES) if seconds else 0
        if count < _FEWEST_PIECES:
            return
        ends = np.linspace(part.start, part.stop, count + 1).astype(int).tolist()
        pieces = (replace(part, start=start, stop=stop) for start, stop in pairwise(ends))
        swings = np.array([piece.amplitude("friction_force") for piece in pieces])
        late = swings[count // 2 :]
        first = int(np.flatnonzero(np.append(True, swings > _WIDER * late.max()))[-1])
        if (np.diff(swings[: first + 1]) < 0.0).all():  # not the chance of waves that meet
            self.force_from = ends[first]
        if len(late) >= _FEWEST_PIECES and (np.diff(late) < 0.0).all() and late[0] > _WIDER * late[-1]:
            self.force_rings = self.duration

    def _swings_far(self, theory: "Linear") -> bool:
        """Whether what the shoe adds is no longer small beside the waves, so that their slope is not linear."""
        own = theory.parts(*self.last.places())[2]
        return 0.5 * float(np.ptp(own)) * float(theory.wavenumbers.max()) > _FAR

    def _steep(self, theory: "Linear") -> Decision:
        """The slopes of the waves leave open whether a small vibration grows: lines may show that it is forced."""
        found = self.forced()
        if found and found.regime is Regime.DAMPED:
            return found
        forced, _, own, _ = theory.parts(*self.settled_part.places())
        self.parts = forced, 0.5 * float(np.ptp(own))
        text = "the slopes of the passing waves leave open whether the shoe's own vibration grows in full contact"
        rate = f"by {theory.mode.growth:.2g} ± {theory.known_to:.1g} 1/s"
        return Decision(f"{text}, {rate}", advice="run longer, and see whether amplitude_own falls")

    def _end(self) -> tuple[float, Any]:
        """Time and state of the last sample."""
        last = self.history.samples - 1
        state = [float(self.history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return last * self.history.interval, np.array(state)

    def _shaken(self, theory: "Linear", slow: float, seen: float) -> Decision | None:
        """The forced motion that lasts, with the settled part in which the shoe's own part has gone."""
        forced, lasting, own, time = theory.parts(*self.whole.places())
        first, level, end, slope = self._gone(theory, own, forced)
        if slope * WINDOWS > 1.0 and end > self.limits.settled_within * forced:
            return None  # the passing waves excite what the mean stiffness damps
        if end >= _REST * forced and self._stays(theory, slope):
            return None  # the waves force more than the closed form has
        begin = first * self.history.samples // WINDOWS
        wait = math.log(max(end / max(level, 1e-300), 1.0)) / -theory.mode.growth
        advice = list[str]()
        if first <= WINDOWS - 10 and self.duration - begin * self.history.interval >= 2.0 * slow:
            self.settled_part, self.settled = replace(self.whole, start=begin), True
            force, rings = theory.force_parts(*self.whole.places("y"))
            first, level, end, _ = self._gone(theory, rings, force)
            if first <= WINDOWS - 10:
                self.force_from = first * self.history.samples // WINDOWS
            elif theory.slip is not None:
                self.force_rings = math.log(max(end / max(level, 1e-300), 1.0)) / -theory.mode.growth
        else:
            needed = max(_LONGER * (self.duration + wait), 1.05 * (self.duration + wait + 2.0 * slow))
            advice.append(f"run at least {needed:.3g} s to see only that")
        if theory.opens and (beat := self._beat()) > seen:
            advice.append(f"the waves beat every {beat:.3g} s, which may open the pad again")
        chosen = time >= self.settled_part.start * self.history.interval
        self.parts, self.unseen = (forced, 0.5 * float(np.ptp(own[chosen]))), forced - 0.5 * float(np.ptp(lasting))
        text = f"only the roughness shakes the shoe, by {forced:.3g} m: {theory.sentence}"
        return Decision(text, Regime.DAMPED, Excitation.FORCED, advice="; ".join(advice))

    def _stays(self, theory: "Linear", slope: float) -> bool:
        """Whether what the shoe seems to add does not decay as its own vibration would, but is forced."""
        decay = theory.mode.growth * self.duration / WINDOWS
        return 0.25 * WINDOWS * decay < -1.0 and slope > 0.25 * decay

    def _gone(self, theory: "Linear", own: Array, forced: float) -> tuple[int, float, float, float]:
        """The window from which on what the shoe adds has gone beside what is forced, and to which level.

        Also what is left in the last quarter, and the slope of its logarithm, per window.
        """
        starts = -(-len(own) * np.arange(WINDOWS) // WINDOWS)
        left = 0.5 * (np.maximum.reduceat(own, starts) - np.minimum.reduceat(own, starts))
        end = 0.5 * float(np.ptp(own[starts[-10] :]))  # a window may be shorter than a period
        slope = line(np.arange(0.5 * WINDOWS), np.log(np.maximum(left[WINDOWS // 2 :], 1e-300)))[0]
        level = self.limits.settled_within * forced
        if end < _REST * forced and self._stays(theory, slope):
            level = max(level, 1.2 * end)  # forced, and missing in the closed form
        return int(np.flatnonzero(np.append(True, left[1:] > level))[-1]) + 1, level, end, slope
