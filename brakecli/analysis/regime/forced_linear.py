"""The numbers of what lasts, and what they are of forced motions in closed form."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.regime.answers import LONGER
from brakecli.analysis.regime.cycles import Cycles
from brakecli.analysis.regime.evidence import LAST, WINDOWS, Stretch, trend
from brakecli.analysis.regime.measure import Shown
from brakecli.analysis.spectrum import Array
from brakecli.analysis.stability.linear import Linear, force_parts, parts
from brakecli.solver.alike import at_once, by_rows
from brakecli.solver.history import stacked
from brakecli.solver.motion.flow import Orbit

RELAXED = 1.0  # power of e by which a disturbance fades within a settled part, which then shows what lasts
_REST = 0.3  # of a forced motion, by which its closed form may be off
ROOM = 1.05  # a requested run is longer than needed by this, so that it holds whole samples and windows


@dataclass
class Lasting:
    """The numbers of the settled part, in SI units; None where one is not known."""

    stretch: Stretch
    settled: bool
    amplitude: float
    spread: float | None = None
    forced: float | None = None  # half of peak to peak of x that the roughness forces
    own: float | None = None  # and that the shoe adds
    forced_frequency: float | None = None  # of the wave that moves x most
    mean_force: float = math.nan  # of the friction force
    variation: float | None = None  # of it, peak to peak
    frequency: float | None = None  # of cycles
    cycles: Cycles | None = None  # of a vibration that lasts by itself
    orbit: Orbit | None = None  # on which that is, so that its numbers are those of the orbit
    force_from: int = 0  # the sample from which on the force has settled: y may ring longer than x
    force_rings: float | None = None  # for how long it still rings beside a settled x
    longer: bool = True  # whether a longer run may settle what has not
    notes: dict[str, str | None] = field(default_factory=dict)
    evidence: dict[str, Any] = field(default_factory=dict)


def forced_linear(shown: Sequence[Shown], decays: Sequence[float]) -> list[Lasting | None]:
    """Forced motions in closed form, with the settled part in which what the shoe adds has died away.

    None where the waves force more than the closed form has.
    """
    theories = [motion.linear for motion in shown if motion.linear]
    x, time = _whole(shown).places()
    forced, lasting, own = parts(theories, x, time)
    results = [*map(_closed, shown, theories, decays, forced.tolist(), _gone(shown, decays, own, forced))]
    if settled := [row for row in zip(results, shown, decays, strict=True) if row[0] and row[0].settled]:
        _settle_force(*zip(*settled, strict=True))
    starts = [
        numbers and int(time.searchsorted(numbers.stretch.start * numbers.stretch.history.interval))
        for numbers in results
    ]
    added = at_once(starts, lambda at: (0.5 * np.ptp(own[at, starts[at[0]] :], axis=1)).tolist())
    for numbers, swing, adds in zip(results, (0.5 * np.ptp(lasting, axis=1)).tolist(), added, strict=True):
        if numbers is not None:
            numbers.own = adds
            numbers.spread = adds + numbers.amplitude - swing if numbers.settled else None
    return results


def _settle_force(results: Sequence[Lasting], shown: Sequence[Shown], decays: Sequence[float]) -> None:
    """Find from where on the friction forces have settled: y may ring longer than x."""
    theories = [motion.linear for motion in shown if motion.linear]
    forced, rings = force_parts(theories, *_whole(shown).places("y"))
    gone = _gone(shown, decays, rings, forced)
    for numbers, theory, decay, remainder in zip(results, theories, decays, gone, strict=True):
        if remainder.window <= WINDOWS - LAST:
            numbers.force_from = remainder.window * numbers.stretch.stop // WINDOWS
        elif theory.slip is not None:
            numbers.force_rings = _wait(decay, remainder)


def _whole(shown: Sequence[Shown]) -> Stretch:
    """All samples of many histories."""
    return Stretch(stacked([motion.history for motion in shown]), 0, shown[0].samples)


class _Gone(NamedTuple):
    """What is left, beside what is forced, of what the shoe adds."""

    window: int  # from which on it has gone
    level: float  # to which it has then come
    end: float  # what is left in the last quarter
    stays: bool  # then it is forced, and missing in the closed form


def _gone(shown: Sequence[Shown], decays: Sequence[float], own: Array, forced: Array) -> list[_Gone]:
    """What becomes of what each shoe adds (in rows), which decays (1/s), beside what is forced."""
    starts = -(-own.shape[1] * np.arange(WINDOWS) // WINDOWS)
    within = shown[0].limits.settled_within
    high, low = (extreme.reduceat(own, starts, axis=1) for extreme in (np.maximum, np.minimum))
    swing = 0.5 * (high - low)
    end = 0.5 * (high[:, -LAST:].max(axis=1) - low[:, -LAST:].min(axis=1))  # a window may be shorter than a period
    change, _ = trend(np.log(np.maximum(swing[:, WINDOWS // 2 :], 1e-300)))
    lost = 0.5 * np.array(decays) * shown[0].duration
    # what decays by less than a quarter of what is expected stays; windows hold no more than the last quarter
    # where they are below 1.2 times that
    stays = (0.5 * lost > RELAXED) & (change > -0.25 * lost)
    level = np.where((end < _REST * forced) & stays, np.maximum(within * forced, 1.2 * end), within * forced)
    late = (swing > level[:, None])[:, ::-1]
    window = np.where(late.any(axis=1), WINDOWS - late.argmax(axis=1), 1)
    columns = {"window": window, "level": level, "end": end, "stays": stays}
    return [_Gone(**row) for row in by_rows(columns)]


def _closed(shown: Shown, theory: Linear, decay: float, forced: float, gone: _Gone) -> Lasting | None:
    """A forced motion in closed form, but for what the shoe adds."""
    if gone.stays and gone.end >= _REST * forced:
        return None
    numbers = Lasting(shown.judged, False, forced, None, forced)
    begin = gone.window * shown.samples // WINDOWS
    slow = shown.slowest(0.0)
    if gone.window <= WINDOWS - LAST and shown.duration - begin * shown.interval >= 2.0 * slow:
        numbers.stretch = shown.stretch(begin)
        numbers.settled = True
    else:
        late = shown.duration + _wait(decay, gone)
        needed = max(LONGER * late, ROOM * (late + 2.0 * slow))
        numbers.notes["settled"] = f"what the shoe adds has not died away yet: run at least {needed:.3g} s"
    seconds = shown.duration - max(min(shown.quarter * shown.interval, shown.duration - slow), 0.0)
    if (beat := shown.beat()) > seconds and theory.opens:
        numbers.notes["beat"] = f"the waves beat every {beat:.3g} s, which may open the pad again"
    return numbers


def _wait(decay: float, gone: _Gone) -> float:
    """Time (s) until what is left, which decays at this rate (1/s), has come to its level."""
    return math.log(max(gone.end / max(gone.level, 1e-300), 1.0)) / decay
