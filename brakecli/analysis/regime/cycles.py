"""What the cycles of a vibration show: amplitude, frequency, stick, force, and how far they drift."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from brakecli.analysis.regime.evidence import GROUPS, Stretch, level_change
from brakecli.analysis.regime.spectra import rises
from brakecli.analysis.spectrum import Array
from brakecli.solver.track import LIFT, MIN, SLIP, STICK, TOUCH, Events

DRIFT = 5e-3
"""Part by which amplitude or frequency of a settled limit cycle may be off, or change."""
SIZE_OFF = 3.5  # of an amplitude, per step in a contact: most that impacts were off


def median(values: Array) -> tuple[float, float]:
    """Median, and half of the range of the middle two thirds."""
    last = len(values) - 1
    quantiles = np.array([1.0 / 6.0, 0.5, 5.0 / 6.0])
    low, middle, high = np.interp(last * quantiles, np.arange(last + 1), np.sort(values)).tolist()
    return middle, 0.5 * (high - low)


def swings(events: Events, edges: Array) -> Array:
    """Half of peak to peak of x (m) between times (s), by its turning points; empty where some hold none."""
    turns = events.kind <= MIN
    places = np.searchsorted(events.time[turns], edges)
    if not np.diff(places).all():
        return np.zeros(0)
    x = events.x[turns][: places[-1]]
    first = places[:-1]
    return np.asarray(0.5 * (np.maximum.reduceat(x, first) - np.minimum.reduceat(x, first)))


@dataclass(frozen=True)
class Cycles:
    """What the cycles of a vibration show, which begin where x turns up; medians with their spread."""

    evidence: dict[str, Any]
    frequency: float  # Hz
    frequency_off: float  # Hz, what the step may change
    amplitude: float  # m
    amplitude_spread: float
    stick_fraction: float
    contact_loss_fraction: float
    drift: tuple[float, float]  # change of the logarithm of the amplitude, with its error
    detuning: tuple[float, float]  # the same of the period
    force_variation: float | None  # N, peak to peak of the friction force
    sizes: Array  # half of peak to peak of x in each cycle, m; empty where some hold no turning point


def cycles_of(stretch: Stretch, events: Events, step: float = 0.0, known: float = math.nan) -> Cycles | None:
    """The cycles of a part by its events; None without cycles.

    They are those of the limit cycle whose period (s) is `known`, where rises fit into it. The spreads hold what
    a step (s) may change, with which the motion was computed. Stick, loss of contact and frequency are medians of
    ten groups of cycles.
    """
    begins, lag = _beginnings(stretch, events, known)
    if len(begins) <= 3:  # fewer do not tell a drift from their spread
        return None
    cycles = len(begins) - 1
    interval = stretch.history.interval
    edges = np.linspace(0, cycles, min(cycles, GROUPS) + 1).astype(int)
    groups = begins[edges]
    period, period_spread = median(np.diff(groups) / np.diff(edges))
    # a step may place a stick with which a cycle begins before that
    sticks = np.histogram(events.time[events.kind == STICK], begins - 0.125 * period)[0]

    def time_in(begin: int, end: int) -> tuple[float, float]:
        """Part of a cycle between two kinds of events, and its spread, with the step."""
        middle, spread = median(np.diff(_spent(events, begin, end, groups)) / np.diff(groups))
        count = np.count_nonzero(events.kind == begin)
        return middle, max(spread, step * count / (events.time[-1] - events.time[0]))

    stick, stick_spread = time_in(STICK, SLIP)
    loss, loss_spread = time_in(LIFT, TOUCH)
    frequency = 1.0 / period
    sizes = swings(events, begins)
    evidence = {
        "cycles": float(cycles),
        "samples_per_cycle": period / interval,
        "rises_per_cycle": float(lag),
        **in_lines(stretch, frequency),
        "stick_cycles": float(np.mean(sticks > 0)),
        "stick_episodes_per_cycle": float(np.mean(sticks)),
        "frequency_spread": frequency * period_spread / period,
        "stick_spread": stick_spread,
        "contact_loss_spread": loss_spread,
    }
    amplitude, spread = median(sizes)
    contact = contact_time(events, groups[0], groups[-1])
    turn = 2.0 * np.pi * step / period
    impact = step / contact  # of which periods were off by a fifth at most, and sizes by `SIZE_OFF`
    return Cycles(
        evidence,
        frequency,
        frequency_off=frequency * (turn**2 / 8.0 + 0.2 * impact),
        amplitude=amplitude,
        amplitude_spread=spread + (0.25 * turn**2 + SIZE_OFF * impact) * amplitude,
        stick_fraction=stick,
        contact_loss_fraction=loss,
        drift=level_change(sizes),
        detuning=level_change(np.diff(begins)),
        force_variation=_force_variation(stretch, begins / interval, groups / interval),
        sizes=sizes,
    )


def _spent(events: Events, begin: int, end: int, times: Array) -> Array:
    """The time spent between begins and ends, two kinds of events, up to some times (s)."""
    mine = (events.kind == begin) | (events.kind == end)
    inside = events.kind[mine] == begin
    if not len(inside):
        return np.zeros(len(times))
    knots = np.concatenate([[min(times[0], events.time[0])], events.time[mine], [max(times[-1], events.time[-1])]])
    spent = np.diff(knots) * np.concatenate([[not inside[0]], inside])
    return np.asarray(np.interp(times, knots, np.concatenate([[0.0], np.cumsum(spent)])))


def contact_time(events: Events, begin: float, end: float) -> float:
    """How long (s) a contact with the wheel lasts, in the mean between two times; infinity if it is never lost."""
    between = (events.time >= begin) & (events.time < end)
    touches = np.count_nonzero(events.kind[between] == TOUCH)
    away = np.diff(_spent(events, LIFT, TOUCH, np.array([begin, end])))[0]
    return float(end - begin - away) / touches if touches else np.inf


def in_lines(stretch: Stretch, frequency: float) -> dict[str, float | list[float]]:
    """Parts of the energy of vx in a line (Hz) and its harmonics, and their amplitudes over its own."""
    first, *higher = (stretch.share([n * frequency]) for n in range(1, 6))
    multiples = range(1, 1 + int(0.5 / (frequency * stretch.history.interval)))
    return {
        "fundamental_share": first,
        "harmonic_share": stretch.share([n * frequency for n in multiples]),
        "harmonics": [float(np.sqrt(share / first)) for share in higher if first > 0.0],
    }


def _force_variation(stretch: Stretch, begins: Array, groups: Array) -> float | None:
    """Peak to peak (N) of the friction force in groups of cycles, as a median; places in samples.

    An impact of less than a sample is seen in one of them. None where half of the places in a cycle that samples
    see, in turn, show much less, so that all may miss some.
    """
    edges = begins.astype(int)
    first = groups[:-1].astype(int) - int(begins[0])
    force = stretch.history.read("friction_force", edges[0], edges[-1])
    unseen, middle = _unseen(begins)
    position = np.arange(edges[0], edges[-1]) - np.repeat(begins[:-1], np.diff(edges)) + middle
    odd = np.floor(position / unseen) % 2.0 == 1.0
    samples = [force, np.where(odd, force, np.nan), np.where(odd, np.nan, force)]
    varies = [median(np.fmax.reduceat(values, first) - np.fmin.reduceat(values, first))[0] for values in samples]
    return varies[0] if min(varies) >= 0.85 * varies[0] else None  # what all samples see


def _unseen(places: Array) -> tuple[float, float]:
    """The longest part of a sample in which no cycle begins, and where in a sample its middle lies."""
    places = np.sort(places % 1.0)  # where cycles last whole samples, all are one
    gaps = np.diff(places, append=places[0] + 1.0)
    longest = int(np.argmax(gaps))
    return float(gaps[longest]), float(places[longest] + 0.5 * gaps[longest])


def _beginnings(stretch: Stretch, events: Events, known: float) -> tuple[Array, int]:
    """When cycles begin (s), and how many rises of x each holds: after so many the motion repeats.

    A rise whose mean vx lies within a band, a part of its level, is ripple: of four bands the first is taken with
    which the motion repeats. Where its period (s) is `known`, that says after how many rises: samples take rises
    for the same that differ by less than they show.
    """
    turning = events.kind <= MIN
    level = stretch.deviation("vx")
    interval = stretch.history.interval
    time = events.time[turning]
    mean = np.diff(stretch.last("x"))
    speed = np.diff(events.x[turning]) / np.maximum(np.diff(time), 1e-300)
    everywhere = [time[1 + rises(speed, -band * level, band * level)] for band in (0.2, 0.35, 0.6, 0.1)]
    candidates = {len(times): times for times in everywhere if len(times) > 1}.values()
    for begins in candidates:
        lag = _fitting(known * (len(begins) - 1) / (begins[-1] - begins[0]))
        if lag:
            return begins[::lag], lag
    for begins in candidates:
        rise = max((begins[-1] - begins[0]) / (len(begins) - 1) / interval, 1.0)
        lags = np.arange(1, 5)
        unlike = np.array([_unlike(mean, lag * rise) for lag in lags if lag * rise < len(mean) // 2])
        same = 0.035  # where vx jumps, interpolation between eight samples of a cycle makes 0.031
        if len(unlike) and unlike.min() <= same:
            lag = 1 + int(np.argmax(unlike <= max(same, 4.0 * unlike.min())))
            return begins[::lag], lag
    return everywhere[0], 1


def _fitting(rises: float) -> int:
    """How many whole rises these are, within what the frequency of a settled motion may be off; 0 for none."""
    whole = round(rises) if math.isfinite(rises) else 0
    return whole if abs(rises - whole) <= DRIFT * rises else 0


def _unlike(values: Array, lag: float) -> float:
    """Squared difference of samples and of those a lag later, over twice the variance.

    A lag of no whole number of samples (at least one) is met by cubic interpolation.
    """
    first = int(lag) - 1
    a = lag % 1.0
    inner = 0.5 * (a + 1.0) * (a - 2.0)
    outer = a * (a - 1.0) / 6.0
    weights = [-outer * (a - 2.0), inner * (a - 1.0), -inner * a, outer * (a + 1.0)]
    later = np.convolve(values[first:], weights[::-1], "valid")
    return float(np.mean((later - values[: len(later)]) ** 2)) / (2.0 * float(values.var()) or 1.0)
