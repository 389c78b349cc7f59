"""What the cycles of a vibration show: amplitude, frequency, stick, force, and how far they drift."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from brakecli.analysis.regime.evidence import LINE_BINS, Part
from brakecli.analysis.regime.spectra import Array, upward_crossings
from brakecli.solver.quantities import ContactState
from brakecli.solver.track import KINDS, LIFT, SLIP, STICK, TOUCH, Events, events_from_samples

_HARMONICS = 5
_MOST_RISES_PER_CYCLE = 4
_GROUPS = 10  # of neighbouring cycles, of which a median is taken
_MIDDLE = np.array([1.0 / 6.0, 0.5, 5.0 / 6.0])  # quantiles
_TREND = 3.0  # standard errors of the slope of ten medians, beyond which an amplitude drifts
_BANDS = (0.3, 0.5, 0.15)  # of the standard deviation of vx: ripple within it does not count
_BETWEEN = 1e-3  # of the energy of vx, between the lines of one rise, that makes a cycle of several
_SEEN = 0.85  # least part of a force's swing in every other sample that all samples see
SIZE_OFF, _PERIOD_OFF = 3.5, 0.2  # of an amplitude and a period, per step in a contact: most that impacts were off
_ALIKE = 0.5  # of a sample that no cycle has seen, beyond which all cycles are seen at the same places
_EARLY = 1 / 8  # of a cycle: where it begins with a stick, samples may place that before its begin
_SAME = 0.02  # squared difference, over twice the variance, between one period of the mean of vx and the next


def median(values: Array) -> tuple[float, float]:
    """Median, and half of the range of the middle two thirds."""
    last = len(values) - 1
    low, middle, high = np.interp(last * _MIDDLE, np.arange(last + 1), np.sort(values)).tolist()
    return middle, 0.5 * (high - low)


def swings(part: Part, edges: Array) -> Array:
    """Half of peak to peak of x (m) in each cycle; `edges` part the last samples.

    Between samples an extreme value is that of a parabola.
    """
    x = part.last("x")
    inner, before, after = x[1:-1], x[:-2], x[2:]
    bend, tops = 2.0 * inner - before - after, []
    for sign in (1.0, -1.0):
        extreme = (sign * inner >= sign * before) & (sign * inner > sign * after)
        refined = sign * x
        refined[1:-1][extreme] += (sign * (after - before) ** 2 / (8.0 * np.where(bend, bend, 1.0)))[extreme]
        tops.append(np.maximum.reduceat(refined[: int(edges[-1])], np.asarray(edges[:-1], int)))
    return np.asarray(0.5 * (tops[0] + tops[1]))


@dataclass(frozen=True)
class Cycles:
    """What the cycles of vx show, which are counted by its rises through the mean; medians with their spread."""

    evidence: dict[str, Any]
    frequency: float  # Hz
    frequency_off: float  # Hz, what the step may change
    kick: float  # part of itself by which impacts, as steps fall into them, may change the vibration in a cycle
    amplitude: float  # m
    amplitude_spread: float
    stick_fraction: float
    contact_loss_fraction: float
    drift: "Drift"  # of the amplitude
    detuning: "Drift"  # of the period
    force_variation: float | None  # N, peak to peak of the friction force


def cycles_of(
    part: Part, events: Events | None = None, step: float = 0.0, waves: Sequence[tuple[float, float]] = ()
) -> Cycles | None:
    """The cycles of a part with its events, which samples show as far as none are given; None without cycles.

    The spreads hold what a step (s) may change, with which the motion was computed, on a wheel whose `waves` (Hz,
    m) pass. Stick, loss of contact and frequency are medians of ten groups of cycles.

    `kick`: where contact begins (or ends) a part s ≤ 1/2 into a step h, the force at its middle pushes by
    K v h² s²/2 too little, and likewise from the other end: by 1/24 in the mean over s, and by up to 1/8 where all
    cycles meet the step alike. With Ω² = K/m that is (Ω h)² times as much of the speed v, and a contact takes
    half a period of Ω.
    """
    velocity, interval = part.last("vx"), part.history.interval
    crossings, rises = _beginnings(part, velocity, waves)
    if len(crossings) < 4:
        return None
    cycles, first = len(crossings) - 1, part.stop - len(velocity)
    edges = np.linspace(0, cycles, min(cycles, _GROUPS) + 1).astype(int)
    groups = crossings[edges]
    period, period_spread = median(np.diff(groups) / np.diff(edges))
    unseen, step = 0.0 if events else _unseen(crossings)[0], step / interval
    if events is None:
        x, v_x, state = (part.history.read(name, first, part.stop) for name in ("x", "vx", "state"))
        events = events_from_samples(interval * np.arange(first, part.stop, dtype=np.float64), x, v_x, state)
    places = {kind: events.time[events.kind == kind] / interval - first for kind in range(len(KINDS))}
    per_cycle = np.histogram(places[STICK], crossings - _EARLY * period)[0]
    turn, contact = 2.0 * np.pi * step / period, contact_length(part)
    impact = step / contact

    def time_in(begin: int, end: int) -> tuple[float, float]:
        """Part of a cycle between two kinds of events, and its spread, with the step, and what samples miss."""
        spent = np.diff(_time_in(places[begin], places[end], groups)) / np.diff(groups)
        middle, spread = median(spent)
        begins = np.count_nonzero((places[begin] > groups[0]) & (places[begin] < groups[-1]))
        missed = 1.0 if unseen > _ALIKE else unseen
        return middle, max(spread, (missed + step) * begins / cycles / period)

    (stick, stick_spread), (loss, loss_spread) = time_in(STICK, SLIP), time_in(LIFT, TOUCH)
    frequency = 1.0 / (period * interval)
    evidence = {
        "cycles": float(cycles),
        "samples_per_cycle": period,
        "rises_per_cycle": float(rises),
        **in_lines(part, frequency, period),
        "stick_cycles": float(np.mean(per_cycle > 0)),
        "stick_episodes_per_cycle": float(np.mean(per_cycle)),
        "frequency_spread": frequency * period_spread / period,
        "stick_spread": stick_spread,
        "contact_loss_spread": loss_spread,
    }
    sizes, periods = swings(part, crossings), np.diff(crossings)
    changes = _drift(sizes), _drift(periods)
    force = part.history.read("friction_force", first, part.stop)
    amplitude, spread = median(sizes)
    missed = 3.0 / 128.0 * (2.0 * np.pi / period) ** 4 * amplitude  # of a crest between two samples: parabola
    spread = max(spread, _unseen(crossings)[0] * missed) + (0.25 * turn**2 + SIZE_OFF * impact) * amplitude
    off = frequency * (turn**2 / 8.0 + _PERIOD_OFF * impact)
    alike = _unseen(crossings / step)[0] if step else 0.0
    kick = (1.0 - loss) * period / contact * (np.pi * impact) ** 2 * (1.0 + 2.0 * alike) / 24.0  # of all impacts
    varies = _force_variation(force, crossings, groups)
    return Cycles(evidence, frequency, off, kick, amplitude, spread, stick, loss, *changes, varies)


def _time_in(begins: Array, ends: Array, times: Array) -> Array:
    """The time spent between begins and ends up to some times; what begins before all of them begins with them."""
    if len(ends) and not (len(begins) and begins[0] <= ends[0]):
        begins = np.concatenate([[min(times[0], ends[0])], begins])
    if len(begins) == 0:
        return np.zeros(len(times))
    lasts = np.concatenate([ends, [np.inf] * (len(begins) - len(ends))])[: len(begins)] - begins
    before = np.concatenate([[0.0], np.cumsum(lasts[:-1])])
    last = np.searchsorted(begins, times, "right") - 1
    at = np.maximum(last, 0)
    return np.where(last < 0, 0.0, before[at] + np.minimum(times - begins[at], lasts[at]))


def in_lines(part: Part, frequency: float, period: float) -> dict[str, Any]:
    """Parts of the energy of vx in a line (Hz) and its harmonics, and their amplitudes over its own."""
    first, *higher = (part.share([n * frequency]) for n in range(1, _HARMONICS + 1))
    return {
        "fundamental_share": first,
        "harmonic_share": part.share([n * frequency for n in range(1, 1 + int(0.5 * period))]),
        "harmonics": [float(np.sqrt(share / first)) for share in higher if first > 0.0],
    }


def contact_length(part: Part) -> float:
    """How many samples a contact with the wheel takes, in the mean; infinity where it is never lost."""
    away = ContactState.SEPARATED
    begins = sum(np.count_nonzero((piece[:-1] == away) & (piece[1:] != away)) for piece in part.pieces("state"))
    return (1.0 - part.fraction(away)) * (part.stop - part.start) / begins if begins else np.inf


def _force_variation(force: Array, crossings: Array, groups: Array) -> float | None:
    """Peak to peak (N) in groups of cycles, as a median: an impact of less than a sample is seen in one of them.

    None where half of the places in a cycle that samples see, in turn, show much less, so that all may miss some.
    """
    edges, begin = crossings.astype(int), groups[:-1].astype(int) - int(crossings[0])
    force = force[edges[0] : edges[-1]]
    unseen, middle = _unseen(crossings)
    place = np.arange(edges[0], edges[-1]) - np.repeat(crossings[:-1], np.diff(edges)) + middle
    odd = np.floor(place / unseen) % 2.0 == 1.0
    seen = [force, np.where(odd, force, np.nan), np.where(odd, np.nan, force)]
    swings = [median(np.fmax.reduceat(each, begin) - np.fmin.reduceat(each, begin))[0] for each in seen]
    return swings[0] if min(swings) >= _SEEN * swings[0] else None


def _unseen(crossings: Array) -> tuple[float, float]:
    """The longest part of a sample in which no cycle begins, and where in a sample its middle lies."""
    places = np.sort(crossings % 1.0)  # where cycles last whole samples, all are one
    gaps = np.diff(places, append=places[0] + 1.0)
    longest = int(np.argmax(gaps))
    return float(gaps[longest]), float(places[longest] + 0.5 * gaps[longest])


def _beginnings(part: Part, velocity: Array, waves: Sequence[tuple[float, float]]) -> tuple[Array, int]:
    """Where cycles begin, and how many rises each holds: one, unless lines lie between those of one.

    Lines of waves (Hz, m) may lie there as well. Rises are told from ripple by the first of `_BANDS` with which
    the motion repeats after some of them.
    """
    everywhere = [upward_crossings(velocity, band * float(velocity.std())) for band in _BANDS]
    return next(
        (found for each in everywhere if (found := _repeated(part, velocity, waves, each))), (everywhere[0], 1)
    )


def _repeated(
    part: Part, velocity: Array, waves: Sequence[tuple[float, float]], crossings: Array
) -> tuple[Array, int] | None:
    """Where cycles begin, and how many rises each holds; None if the motion does not repeat after as few."""
    if len(crossings) < 2:
        return None
    period = float(crossings[-1] - crossings[0]) / (len(crossings) - 1)
    width = 2.0 * LINE_BINS / (len(velocity) * part.history.interval)
    mean = np.diff(part.last("x"))
    for rises in range(1, _MOST_RISES_PER_CYCLE + 1):  # after which the motion repeats
        if 1.0 <= (lag := rises * period) < len(velocity) // 2 and _unlike(mean, lag) <= _SAME:
            longest = 1.0 / (lag * part.history.interval)
            divisors = [each for each in range(1, rises) if rises % each == 0]
            for fewer in divisors:  # samples may repeat only after several cycles
                lines = [n * longest for n in range(1, 2 * rises) if n % (rises // fewer)]  # above: jumps, aliased
                beside = [f for f in lines if all(abs(f - wave) > width for wave, _ in waves)]
                if part.mean_share(beside, LINE_BINS // 2) <= _BETWEEN:
                    return crossings[::fewer], fewer
            return crossings[::rises], rises
    return None


def _unlike(values: Array, lag: float) -> float:
    """Squared difference of samples and of those a lag later, over twice the variance.

    A lag of no whole number of samples (at least one) is met by cubic interpolation.
    """
    first, a = int(lag) - 1, lag % 1.0
    inner, outer = 0.5 * (a + 1.0) * (a - 2.0), a * (a - 1.0) / 6.0
    weights = [-outer * (a - 2.0), inner * (a - 1.0), -inner * a, outer * (a + 1.0)]
    later = np.convolve(values[first:], weights[::-1], "valid")
    return float(np.mean((later - values[: len(later)]) ** 2)) / (2.0 * float(values.var()) or 1.0)


class Drift(NamedTuple):
    """Part of itself by which a number changes from the first third of the cycles to the last."""

    part: float
    sure: bool  # whether it is more than chance


def _drift(sizes: Array) -> Drift:
    """The drift of a number, one for each cycle."""
    first, *_, last = (median(third)[0] for third in np.array_split(sizes, 3) if len(third))
    groups = np.array([median(group)[0] for group in np.array_split(sizes, min(len(sizes), _GROUPS))])
    places = np.arange(len(groups)) - 0.5 * (len(groups) - 1)
    slope = float(places @ groups / (places @ places))
    rest = groups - groups.mean() - slope * places
    error = float(np.std(rest) / (np.std(places) * np.sqrt(max(len(groups) - 2, 1))))
    return Drift(last / first - 1.0 if first > 0.0 else 0.0, abs(slope) > _TREND * error)
