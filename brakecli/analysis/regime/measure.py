"""The record of answers to the questions of `table`, from a history and what is known of its case."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.regime.answers import Answers, Fate
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.cycles import Cycles, cycles_of
from brakecli.analysis.regime.evidence import (
    FEWEST_SAMPLES,
    LONGEST,
    WINDOWS,
    Envelope,
    Part,
    level_change,
    tenths,
    windowed,
)
from brakecli.analysis.regime.table import Thresholds
from brakecli.analysis.stability.linear import Linear
from brakecli.solver.history import History
from brakecli.solver.quantities import ContactState
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import Events, Track

_NOTHING = 1e-3  # of a beat over the slowest wave, that is rounding


class Continued(NamedTuple):
    """What the motion comes to on the smooth wheel, in SI units; nan where it is no limit cycle."""

    fate: Fate = Fate.UNKNOWN
    amplitude: float = math.nan
    level: float = math.nan  # standard deviation of vx
    rate: float = math.nan  # at which its slowest disturbance fades
    period: float = math.nan
    sticks: float = math.nan  # in a period


class Shown:
    """What a history shows."""

    def __init__(self, history: History, context: Context, limits: Thresholds, track: Track) -> None:
        """Take a history, what is known of its case, and what the loop has noted."""
        self.history, self.context, self.limits, self.track = history, context, limits, track
        self.duration = history.samples * history.interval
        self.whole = Part(history, 0, history.samples)
        self.half = Part(history, history.samples // 2, history.samples)
        self.last = Part(history, history.samples * (WINDOWS - 10) // WINDOWS, history.samples)
        first, last = tenths(history.samples)
        self.tenths = Part(history, 0, first), Part(history, last, history.samples)

    @cached_property
    def envelope(self) -> Envelope | None:
        """The level of vx over time; None where samples are too few."""
        return Envelope(self.history) if self.history.samples >= FEWEST_SAMPLES else None

    @cached_property
    def settled(self) -> Part | None:
        """The settled part, if there is one."""
        within = self.limits.settled_within
        first = self.envelope.settled_window(within, 0.4 * within) if self.envelope else None
        return None if first is None else replace(self.whole, start=first * self.history.samples // WINDOWS)

    @property
    def judged(self) -> Part:
        """The settled part, or the second half."""
        return self.settled or self.half

    @cached_property
    def linear(self) -> Linear | None:
        """The theory, where the motion has long been linear at last."""
        theory, slow = self.context.linear(), self.slowest(0.0)
        if theory is None:
            return None
        start = max(min(self.last.start, self.history.samples - int(slow / self.history.interval)), 0)
        slides = replace(self.last, start=start).slides(theory.slip) or theory.stays(self.end[1])
        return theory if slides else None

    @property
    def end(self) -> tuple[float, np.ndarray]:
        """Time and state of the last sample."""
        last = self.history.samples - 1
        state = [float(self.history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return last * self.history.interval, np.array(state)

    @cached_property
    def cycles(self) -> Cycles | None:
        """The cycles of the part that is judged."""
        return cycles_of(self.judged, self.events, self.context.step)

    @cached_property
    def events(self) -> Events:
        """The events of the part that is judged, as far as the loop keeps them and spectra are taken."""
        first = max(self.judged.start, self.history.samples - LONGEST)
        return self.track.events(first * self.history.interval)

    def slowest(self, amplitude: float) -> float:
        """Period (s) of the slowest wave that counts beside an amplitude of x (m) and beside the others; or 0."""
        return 1.0 / min(counts) if (counts := self._counting(amplitude)) else 0.0

    def beat(self, amplitude: float = 0.0) -> float:
        """Period (s) of the slowest wave, or of the slowest beat of one that counts with a multiple of another."""
        return _beat(self._counting(amplitude))

    def _counting(self, amplitude: float) -> tuple[float, ...]:
        """Frequencies (Hz) of the waves that count beside an amplitude of x (m) and beside the others."""
        least = max([amplitude, *(swing for _, swing in self.context.waves)])
        return tuple([f for f, swing in self.context.waves if swing >= self.limits.settled_within * least])

    def changes(self) -> float:
        """By which part vx or x, whichever does more so, swings otherwise in the last quarter than before."""
        before = replace(self.half, stop=3 * self.history.samples // 4)
        sizes = [np.array([each.deviation("vx"), each.amplitude("x")]) for each in (before, self.last)]
        return float(np.abs(sizes[0] / np.maximum(sizes[1], 1e-300) - 1.0).max())

    def powers(self) -> dict[str, float]:
        """Powers (W) that friction and the roughness give, with their errors, by the loop's account."""
        begin = self.judged.start * self.history.interval
        given, open_by = self.track.given(begin, self.judged.mean("friction_force"))
        means = windowed(given)
        (friction, roughness), (off, off_too) = means.mean(axis=0).tolist(), (means.std(axis=0) / 2.0).tolist()
        found = {"power_of_friction": friction, "power_of_roughness": roughness}
        errors = {"friction_error": max(off, abs(open_by)), "roughness_error": max(off_too, abs(open_by))}
        return found | errors


@lru_cache(maxsize=4)  # the points of a sweep ask for the same ones
def _beat(counts: tuple[float, ...]) -> float:
    """Period (s) of the slowest of some waves (Hz), or of the slowest beat of one with a multiple of another."""
    slow = 1.0 / min(counts) if counts else 0.0
    beats = [abs(f - n * g) for f in counts for g in counts for n in range(1, 11)]
    return max([slow, *(1.0 / beat for beat in beats if beat * slow > _NOTHING)])


def answers(
    shown: Shown, exponent: Exponent | None, continued: Callable[[], Continued], failure: str = ""
) -> Answers:
    """The record of answers; `continued` is asked only where a row may need it."""
    context, history, half, last = shown.context, shown.history, shown.half, shown.last
    stands, waves = context.belt_speed == 0.0, bool(context.forced)
    away = ContactState.SEPARATED
    lost = half.always(away)
    found: dict[str, Any] = {
        "failure": failure or "",
        "duration": shown.duration,
        "samples": history.samples,
        "few_samples": shown.envelope is None,
        "steady": context.steady,
        "stands": stands,
        "waves": waves,
        "frictionless": context.frictionless,
        "undamped": context.undamped,
        "locks": math.nan if context.locks is None else context.locks,
        "held": context.held,
        "never": lost and shown.whole.always(away),
        "lost": lost,
        "left": last.always(away),
        "carried": (last if stands else half).always(ContactState.STICK),
    }
    if exponent is not None:
        found |= dict(zip(("exponent", "exponent_error", "even", "even_error"), exponent, strict=True))
    if shown.envelope is None or not context.steady or failure:
        return Answers(**found)
    change, change_error = level_change(shown.envelope.vx[WINDOWS // 2 :])
    found |= {
        "moves": shown.envelope.largest > context.quiet,
        "slowest": shown.slowest(half.amplitude("x")),
        "change": change,
        "change_error": change_error,
        "amplitude": last.amplitude("x"),
        "level": last.deviation("vx"),
        "settled": shown.settled is not None,
        "seconds": (history.samples - shown.judged.start) * history.interval,
    }
    if (theory := shown.linear) is not None:
        found |= {"linear": True, "ringing": theory.mode.frequency}
        if math.isfinite(theory.known_to):  # otherwise only neighbours tell
            found |= {"growth": theory.mode.growth, "growth_error": theory.known_to}
        if theory.direction > 0:
            found |= {"to_limit": theory.seconds_to_limit(*shown.end), "steadier": context.steadier()}
        return Answers(**found)
    found["growth"] = context.growth()
    if not context.frictionless:
        alone = continued()
        names = ("without_waves", *(f"{name}_without_waves" for name in Continued._fields[1:]))
        found |= dict(zip(names, alone, strict=True))
    if waves:
        found |= shown.powers() | {"touches": context.touches()}
    if cycles := shown.cycles:
        names = ("cycles", "samples_per_cycle", "stick_cycles", "harmonic_share")
        found |= {name: cycles.evidence[name] for name in names} | {"frequency": cycles.frequency}
        if cycles.evidence["frequency_spread"] <= shown.limits.settled_within * cycles.frequency:
            found["band_share"] = shown.judged.narrow()
        if context.step:
            found["steps_per_cycle"] = 1.0 / (cycles.frequency * context.step)
    return Answers(**found)
