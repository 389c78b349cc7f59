"""The numbers of what lasts: amplitude, its spread, whether it is settled, and from where on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from brakecli.analysis.regime.answers import Answers
from brakecli.analysis.regime.cycles import SIZE_OFF, Cycles, contact_time, in_lines, median, swings
from brakecli.analysis.regime.evidence import WINDOWS, Part, trend
from brakecli.analysis.regime.measure import Shown
from brakecli.analysis.regime.table import Decision, Excitation, Regime, Thresholds
from brakecli.analysis.spectrum import Array
from brakecli.analysis.stability.linear import Linear

_LIKELY = 16  # waves, of which one moves x most
_RELAXED = 1.0  # power of e by which a disturbance fades within a settled part, which then shows what lasts
_REST = 0.3  # of a forced motion, by which its closed form may be off
_LONGER = 1.4  # a run whose last quarter and the window before it are settled, over what comes before
_FEWEST_PIECES, _PIECES = 4, 16  # of a settled part, in which the friction force is compared
_WIDER = 1.02  # times as far as in the last half of them, a transient swings
_SPARSE = 8  # of the places at which a forced motion is computed, one of so many suffices
_DRIFT = 5e-3  # by which amplitude or frequency of a settled limit cycle may change
_SHIFTED = 0.5  # of itself, by which impacts may shift a cycle: beyond, its frequency is not known
_IMPACT_AMPLITUDE_ERROR = 0.5  # largest error of a cycle's amplitude, as a part of its shift by impacts
_IMPACT_FREQUENCY_ERROR = 0.1  # and of its frequency
_MODULATES = 0.1  # of a vibration, beside which waves count: smaller ones change its cycles, too
_CYCLES_SHARE = 0.5  # of the energy on the lines of the cycles, below which the strongest line is the frequency
QUARTER = 4.0 / 3.0  # a run whose last quarter is settled, over what comes before
_VAGUE = "the amplitude may be off by as much as itself: run longer, or take a smaller solver.step"


@dataclass
class Lasting:
    """The numbers of the settled part, in SI units; None where one is not known."""

    part: Part
    settled: bool
    amplitude: float
    spread: float | None = None
    forced: float | None = None  # half of peak to peak of x that the roughness forces
    own: float | None = None  # and that the shoe adds
    forced_frequency: float | None = None  # of the wave that moves x most
    variation: float | None = None  # of the friction force, peak to peak
    frequency: float | None = None  # of cycles
    cycles: Cycles | None = None  # of a vibration that lasts by itself
    force_from: int = 0  # the sample from which on the force has settled: y may ring longer than x
    force_rings: float | None = None  # for how long it still rings beside a settled x
    longer: bool = True  # whether a longer run may settle what has not
    notes: dict[str, str | None] = field(default_factory=dict)
    evidence: dict[str, Any] = field(default_factory=dict)


def lasting(shown: Shown, answers: Answers, decision: Decision, *, in_full: bool) -> Lasting:
    """The numbers of a motion that has been decided on."""
    forced = decision.excitation is Excitation.FORCED
    lines: Sequence[float] = shown.context.forced if forced else ()
    if forced:
        closed = _forced_linear(shown, shown.linear, answers.decay) if shown.linear else None
        found = closed or _forced(shown, answers)
    elif decision.excitation is Excitation.SELF_EXCITED and shown.cycles:
        found = _self_excited(shown, answers, shown.cycles)
    else:
        part = shown.half if answers.linear else shown.judged
        stays = not answers.moves or answers.carried  # all else dies, or is not known
        left = shown.tenths[1] if decision.regime is Regime.DAMPED else part
        found = Lasting(part, answers.settled and stays, left.amplitude("x"))
        return _with_force(shown, found, lasts=decision.regime is not Regime.UNDECIDED)
    if forced and found.settled and found.forced is None:  # its neighbours come together: nothing else is left
        found.forced = found.amplitude
    if found.cycles and shown.context.forced and _holds_two(shown, found.part):
        split = found.part.split(shown.context.forced)
        found.forced, found.own = split if split and split[0] <= split[1] else (None, None)
    if forced and in_full:
        found.forced_frequency = _wave(shown, found.part)
    _add_ripple(shown, found, lines)
    if found.spread is not None and 0.0 < found.amplitude <= found.spread:  # then not even its order is known
        found.notes["settled"] = found.notes.get("settled") or (_VAGUE if found.settled else None)
        found.spread, found.settled = None, False
    return _with_force(shown, found, lasts=True)


def _wave(shown: Shown, part: Part) -> float | None:
    """The passing frequency (Hz) of the wave that moves x most; where many pass, of those that should do so."""
    likely = sorted(shown.context.waves, key=lambda wave: -wave[1])[:_LIKELY]
    if not likely:
        return None
    x, time = part.places()
    lines = np.exp(-2j * np.pi * np.outer([frequency for frequency, _ in likely], time))
    sizes = np.abs(lines @ ((x - x.mean()) * np.hanning(len(x))))
    return likely[int(np.argmax(sizes))][0]


def _holds_two(shown: Shown, part: Part) -> bool:
    """Whether a part holds two periods of the slowest wave."""
    slow = min((frequency for frequency, _ in shown.context.waves), default=0.0)
    return (part.stop - part.start) * shown.history.interval * slow >= 2.0


def _forced_linear(shown: Shown, theory: Linear, decay: float) -> Lasting | None:
    """The forced motion in closed form, with the settled part in which what the shoe adds has died away.

    None where the waves force more than the closed form has.
    """
    whole, samples, interval = shown.whole, shown.history.samples, shown.history.interval
    forced, lasting, own, time = theory.parts(*whole.places())
    first, level, end, stays = _gone(shown, decay, own, forced)
    if stays and end >= _REST * forced:
        return None
    found = Lasting(shown.judged, False, forced, None, forced)
    begin, slow = first * samples // WINDOWS, shown.slowest(0.0)
    if first <= WINDOWS - 10 and shown.duration - begin * interval >= 2.0 * slow:
        found.part, found.settled = replace(whole, start=begin), True
        force, rings = theory.force_parts(*whole.places("y"))
        first, level, end, _ = _gone(shown, decay, rings, force)
        if first <= WINDOWS - 10:
            found.force_from = first * samples // WINDOWS
        elif theory.slip is not None:
            found.force_rings = _wait(decay, end, level)
    else:
        late = shown.duration + _wait(decay, end, level)
        needed = max(_LONGER * late, 1.05 * (late + 2.0 * slow))
        found.notes["settled"] = f"what the shoe adds has not died away yet: run at least {needed:.3g} s"
    seconds = samples * interval - max(min(shown.last.start * interval, shown.duration - slow), 0.0)
    if theory.opens and (beat := shown.beat()) > seconds:
        found.notes["beat"] = f"the waves beat every {beat:.3g} s, which may open the pad again"
    found.own = 0.5 * float(np.ptp(own[time >= found.part.start * interval]))
    if found.settled:
        found.spread = found.own + forced - 0.5 * float(np.ptp(lasting))
    return found


def _wait(decay: float, end: float, level: float) -> float:
    """Time (s) until what is left, which decays at this rate (1/s), has come to a level."""
    return math.log(max(end / max(level, 1e-300), 1.0)) / decay


def _gone(shown: Shown, decay: float, own: Array, forced: float) -> tuple[int, float, float, bool]:
    """The window from which on what the shoe adds has gone beside what is forced, and to which level.

    Also what is left in the last quarter, and whether it stays: then it is forced, and missing in the closed form.
    """
    starts = -(-len(own) * np.arange(WINDOWS) // WINDOWS)
    high, low = np.maximum.reduceat(own, starts), np.minimum.reduceat(own, starts)
    left = 0.5 * (high - low)
    end = 0.5 * float(high[-10:].max() - low[-10:].min())  # a window may be shorter than a period
    change = trend(np.log(np.maximum(left[WINDOWS // 2 :], 1e-300)))[0]
    lost = 0.5 * decay * shown.duration
    stays = 0.5 * lost > _RELAXED and change > -0.25 * lost
    level = shown.limits.settled_within * forced
    if end < _REST * forced and stays:
        level = max(level, 1.2 * end)
    late = np.flatnonzero(left > level)
    return int(late[-1]) + 1 if len(late) else 1, level, end, stays


def _forced(shown: Shown, answers: Answers) -> Lasting:
    """A forced motion of a pad that opens: its cycle is the slowest wave, or the slowest beat."""
    part, interval, history = shown.judged, shown.history.interval, shown.history
    rate = -answers.exponent if math.isfinite(answers.exponent) else -shown.context.growth()
    fading = 0.25 * shown.duration * rate < _RELAXED  # too slowly to be seen within a quarter of the run
    chaos = math.isfinite(answers.exponent) and answers.exponent > 0.0
    found = Lasting(part, shown.settled is not None, 0.0)
    if not found.settled and not fading:
        found.settled = shown.changes() <= shown.limits.settled_within
    seconds = (part.stop - part.start) * interval
    if not chaos and (not found.settled or seconds * rate < _RELAXED):
        found.settled = False
        needed = QUARTER * (shown.duration + 3.0 / max(rate, 1e-300))
        text = f"what the shoe adds dies away at only {rate:.3g} 1/s"
        found.notes["settled"] = f"{text}: run at least {needed:.3g} s to see the amplitude that lasts"
    elif found.settled and seconds < (beat := shown.beat()):
        found.settled, found.notes["beat"] = False, f"the waves beat every {beat:.3g} s: run longer"
    end = part.stop * interval
    begin = max(part.start * interval, shown.track.since)
    period = max(min(shown.beat(), end - begin), interval)
    edges = np.asarray(end - period * np.arange(int((end - begin) / period), -1, -1), np.float64)
    sizes = swings(shown.events, edges)
    found.amplitude, spread = median(sizes if len(sizes) else np.array([part.amplitude("x")]))
    if (found.settled or not fading) and len(edges) >= 3 - found.settled:
        off = SIZE_OFF * found.amplitude * shown.context.step / contact_time(shown.events, begin, end)
        found.spread = off + max(spread, _beating(shown, part) * part.amplitude("x") - found.amplitude)
    _settle_force(shown, found, history.samples)
    return found


def _beating(shown: Shown, part: Part) -> float:
    """Amplitude of a longer motion over that of the settled part, as waves beat that force a linear one."""
    if not (theory := shown.context.linear()):
        return 1.0
    forced, lasting, *_ = theory.parts(*(each[::_SPARSE] for each in part.places()))
    return 2.0 * forced / max(float(np.ptp(lasting)), 1e-300)


def _settle_force(shown: Shown, found: Lasting, stop: int) -> None:
    """Find from where on the friction force has settled: it may ring longer than x.

    From there on it swings no wider, within pieces of the settled part, than in the last half of them.
    """
    part, interval = found.part, shown.history.interval
    seconds = max(shown.context.pattern, shown.beat())
    count = min(int((part.stop - part.start) * interval / seconds), _PIECES) if seconds else 0
    if count < _FEWEST_PIECES:
        return
    ends = np.linspace(part.start, stop, count + 1).astype(int).tolist()
    pieces = (replace(part, start=start, stop=stop) for start, stop in pairwise(ends))
    widths = np.array([piece.amplitude("friction_force") for piece in pieces])
    late = widths[count // 2 :]
    first = int(np.flatnonzero(np.append(True, widths > _WIDER * late.max()))[-1])
    if (np.diff(widths[: first + 1]) < 0.0).all():  # not the chance of waves that meet
        found.force_from = ends[first]
    if len(late) >= _FEWEST_PIECES and (np.diff(late) < 0.0).all() and late[0] > _WIDER * late[-1]:
        found.force_rings = shown.duration


def _self_excited(shown: Shown, answers: Answers, cycles: Cycles) -> Lasting:
    """A vibration that lasts by itself: medians of its cycles, with what a drift becomes in the spreads."""
    part, seconds, interval = shown.judged, answers.seconds, shown.history.interval
    rate = 0.0 if answers.undamped else min(abs(answers.growth), shown.context.settles)
    if math.isfinite(answers.rate_without_waves):
        rate = min(rate, answers.rate_without_waves) if answers.waves else answers.rate_without_waves
    shift = cycles.kick * cycles.frequency / rate if rate > 0.0 else 0.0
    lasts = answers.settled and rate * seconds >= _RELAXED
    found = Lasting(part, lasts, cycles.amplitude, cycles=cycles)
    found.evidence = cycles.evidence | {"stick_cycles": answers.stick_cycles}
    changed = max(_surely(cycles.drift, shown.limits), _surely(cycles.detuning, shown.limits))
    off = abs(answers.amplitude - answers.amplitude_without_waves)
    turns = answers.period_without_waves * cycles.frequency
    far = not off <= shown.limits.settled_within * answers.amplitude_without_waves  # also where it is not known
    far |= math.isfinite(turns) and abs(turns - round(turns)) > _DRIFT * turns
    longer = f"run at least {QUARTER * (shown.duration + 3.0 / max(rate, 1e-9)):.3g} s for numbers that last"
    text: str | None = None
    if shift >= _SHIFTED:
        step = shown.context.step * math.sqrt(0.3 * _SHIFTED / shift)
        text = f"this vibration settles at only {rate:.2g} 1/s, and impacts of so few steps may shift it by"
        text += f" {_IMPACT_AMPLITUDE_ERROR * shift:.0%}"
        text += f": take a solver.step of {step:.2g} s, or a solver.tolerance"
        found.longer = False
    elif not lasts:
        text = f"this vibration may settle at only {rate:.2g} 1/s: {longer}" if answers.settled else None
    elif not answers.waves and far:
        text = f"continued, this vibration comes to {answers.limit}: {longer}"
    elif changed > _DRIFT:
        text = f"its amplitude or frequency still changes by {changed:.1%} within the settled part: {longer}"
    elif answers.waves and seconds < (beat := shown.beat(_MODULATES * cycles.amplitude)):
        text = f"the waves beat every {beat:.3g} s: run at least {1.05 * (part.start * interval + beat):.3g} s"
        text += " for numbers that last"
    found.settled, found.notes["settled"] = lasts and text is None, text

    def held(spread: float, value: float, drift: tuple[float, float]) -> float | None:
        """A spread with what a drift becomes until small disturbances have changed by a factor of e."""
        if lasts:
            return spread + _surely(drift, shown.limits) * value
        if answers.undamped:
            return None  # there is no end to it
        return min(spread + abs(drift[0]) * value / max(min(rate * seconds, 1.0), 1e-9), value)

    wander = cycles.evidence["frequency_spread"]
    spread = held(wander, cycles.frequency, cycles.detuning)
    more = cycles.frequency_off + _IMPACT_FREQUENCY_ERROR * shift * cycles.frequency
    found.evidence["frequency_spread"] = min((wander if spread is None else spread) + more, cycles.frequency)
    found.frequency = cycles.frequency
    if cycles.evidence["harmonic_share"] < _CYCLES_SHARE and answers.stick_cycles < shown.limits.stick_cycles:
        found.frequency, width = part.strongest
        found.evidence |= {"frequency_spread": width, **in_lines(part, found.frequency)}
    short = seconds < shown.slowest(0.0) or abs(answers.change) > shown.limits.settled_within
    if lasts or not short:  # otherwise the run does not show where it ends
        found.spread = held(
            cycles.amplitude_spread + _IMPACT_AMPLITUDE_ERROR * shift * cycles.amplitude,
            cycles.amplitude,
            cycles.drift,
        )
        if far and not answers.waves and found.spread is not None and math.isfinite(off):
            found.spread += off
    return found


def _surely(change: tuple[float, float], limits: Thresholds) -> float:
    """The size of a change with its error, as far as it is no chance."""
    return abs(change[0]) if abs(change[0]) > limits.sure_errors * change[1] else 0.0


def _add_ripple(shown: Shown, found: Lasting, lines: Sequence[float]) -> None:
    """What nodes and steps change in a motion forced on lines (Hz), or in one that lasts by itself."""
    context, part = shown.context, found.part
    ripple = context.ripple(part, lines) if not found.cycles else None
    if found.spread is not None and lines and not (shown.linear and found.forced == found.amplitude):
        found.spread += found.amplitude * context.detuned(part, lines) + (ripple.size if ripple else 0.0)
    if ripple and ripple.counts:
        found.evidence |= {f"ripple_{name}": getattr(ripple, name) for name in ("x", "vx", "force")}
        found.longer &= not found.settled
        found.notes["ripple"], found.settled = ripple.sentence, False


def _with_force(shown: Shown, found: Lasting, *, lasts: bool) -> Lasting:
    """The same with the variation of the friction force, and why it is missing or may be too small."""
    part, interval, pattern = found.part, shown.history.interval, shown.context.pattern
    late = replace(part, start=max(part.start, found.force_from))
    low, high = late.extremes("friction_force")
    found.variation = high - low
    if found.cycles:
        found.variation = found.cycles.force_variation
        if found.variation is None:
            finer = f"give an output.sample_interval of {0.25 * interval:.2g} s"
            text = f"samples miss impacts of the friction force, and torque_variation is missing: {finer}"
            found.notes["torque_variation"] = text
    elif found.force_rings is not None:
        found.variation = None
        longer = QUARTER * (shown.duration + found.force_rings)
        text = f"the friction force still rings, and torque_variation is missing: run at least {longer:.3g} s"
        found.notes["torque_variation"] = text
    elif lasts and shown.context.steady and (late.stop - late.start) * interval < 0.999 * pattern:
        found.notes["torque_variation"] = (
            f"torque_variation needs {pattern:.3g} s, until the waves repeat: run longer"
        )
    return found
