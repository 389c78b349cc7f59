"""The Poincaré section of a run: its state once in each period of a passing wave, or at each event of a kind."""

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import CubicHermiteSpline

from brakecli.case.system import system_of
from brakecli.errors import UsageError
from brakecli.faces import argument
from brakecli.results.numbers import stored_numbers
from brakecli.results.read import BLOCK, StoredResult
from brakecli.solver.period import common_period
from brakecli.views.motion import motion_sentence
from brakecli.views.plots import style
from brakecli.views.plots.quantities import scaled
from brakecli.views.plots.run import case_of
from brakecli.views.render import TERMINAL

MOST = 200_000  # samples whose time is drawn, the last ones
WAVE = "wave"
_WITH_THE_WHEEL = ("stick", "slip", "turn")  # where vx is the wheel's speed
KINDS = (*_WITH_THE_WHEEL, "lift-off", "touch")
_STATE = ("x", "y", "vx", "vy")


class _Sampled(NamedTuple):
    """When a history was sampled (s)."""

    start: float
    end: float
    interval: float


def draw(result: StoredResult, section: str) -> Figure:
    """The figure; raises UsageError for a section that the run does not have, and UnreadableResultError."""
    samples = result.variables("history")["time"].shape[0]
    if samples < 2:
        raise style.unreadable(result, "its history has less than two samples")
    start, end = (float(result.read("history", "time", at, at + 1)[0]) for at in (0, samples - 1))
    sampled = _Sampled(start, end, (end - start) / (samples - 1))
    settled = min(max(float(result.attributes.get("settled_from") or 0.0), start), end)
    first = max(min(round((settled - start) / sampled.interval), samples - 2), samples - MOST)
    begin = max(settled, start + first * sampled.interval)
    if section == WAVE:
        dots, where = _at_waves(result, sampled, begin)
    elif section in KINDS:
        dots = _at_events(result, section, begin)
        where = f"at each {section}"
    else:
        choices = ", ".join((WAVE, *KINDS))
        raise UsageError(f"{argument('section')} {section}: there is no such section; give one of {choices}")
    motion = {name: result.read("history", name, first) for name in _STATE}
    count = f"{len(dots['x'])} points from {begin:.4g} s on"
    title = case_of(result).case.title or "Case without a title"
    verdict = motion_sentence(stored_numbers(result), TERMINAL)  # how the dots are to be read: a torus, chaos
    lines = f"Poincaré section {where}   ·   {count}", verdict
    figure = style.headed(10.4, 4.81, title, *lines, columns=2, wspace=0.05)
    pairs = (("x", "y"), ("x", "vy")) if section in _WITH_THE_WHEEL else (("x", "vx"), ("y", "vy"))
    for axes, pair in zip(style.panels(figure, 1, 2).flat, pairs, strict=True):
        _draw_panel(axes, pair, dots, motion)
    return figure


def _draw_panel(axes: Axes, pair: tuple[str, str], dots: style.Columns, motion: style.Columns) -> None:
    """Dots over the motion, by two of their quantities; dots that spread fill the axes."""
    wide = 0.01  # of the motion: what spreads less is one dot on it
    spreads = {name: (float(np.ptp(dots[name])), float(np.ptp(motion[name]))) for name in pair}
    fill = any(spread > wide * whole for spread, whole in spreads.values())
    looks = [scaled(name, (dots if fill else motion)[name], np.r_[motion[name], dots[name]]) for name in pair]
    curve, points = (
        [look(states[name]) for name, look in zip(pair, looks, strict=True)] for states in (motion, dots)
    )
    axes.plot(*curve, color=style.GREY, lw=0.4, alpha=0.6 if fill else 1.0, label="motion", rasterized=True)
    axes.plot(*points, color=style.BLUE, ls="none", marker=".", label="section")
    limits = [look.limits for look in looks]
    for number, (spread, whole) in enumerate(spreads.values() if fill else ()):
        middle = 0.5 * float(points[number].min() + points[number].max())
        half = looks[number].factor * max(0.54 * spread, 0.5 * wide * whole)
        limits[number] = middle - half, middle + half
    axes.set(xlabel=looks[0].label, ylabel=looks[1].label, xlim=limits[0], ylim=limits[1])


def _at_waves(result: StoredResult, sampled: _Sampled, begin: float) -> tuple[style.Columns, str]:
    """The states once in each period of the wave that moves x most, or else of the highest one; words for it."""
    system = system_of(case_of(result).case)
    passing = np.abs(system.belt_speed) * system.wheel.turns
    if not system.steady or not passing.any():
        remedy = f"give an event: {', '.join(KINDS)}"
        raise UsageError(
            f"{argument('section')} {WAVE}: no wave of a rough wheel passes at a constant speed; {remedy}"
        )
    forced = result.attributes.get("forced_frequency")
    wave = np.argmin(np.abs(passing - forced)) if forced else np.argmax(np.abs(system.wheel.g))
    frequency = float(passing[wave])
    start, end, interval = sampled
    fewest = 8  # samples in a period between which a state is certain
    if frequency * interval > 1.0 / fewest:
        what = f"samples every {interval:.3g} s do not resolve the wave of {frequency:.4g} Hz"
        raise UsageError(
            f"{argument('section')} {WAVE}: {what}; run with output.sample_interval={1.0 / frequency / fewest:.2g}"
        )
    times = np.arange(math.ceil(begin * frequency), math.floor(end * frequency) + 1) / frequency
    if not len(times):
        raise UsageError(f"{argument('section')} {WAVE}: less than a period from {begin:.4g} s on; run longer")
    places = np.minimum((times - start) / interval, (end - start) / interval - 1.0).astype(int)
    parts = []
    for first in range(int(places[0]), int(places[-1]) + 1, BLOCK):
        there = times[(places >= first) & (places < first + BLOCK)]
        block = (first, first + BLOCK + 1)
        t, x, y, v_x, v_y = (result.read("history", name, *block) for name in ("time", *_STATE))
        curves = [CubicHermiteSpline(t, *motion) for motion in ((x, v_x), (y, v_y))]
        parts.append([curve(there, order) for order in (0, 1) for curve in curves])
    points = {name: np.concatenate(pieces) for name, pieces in zip(_STATE, zip(*parts, strict=True), strict=True)}
    together = round((common_period(system) or 0.0) * frequency)
    repeat = f"; the waves repeat together every {together} dots" if together > 1 else ""
    return points, f"at each wave of {frequency:.4g} Hz{repeat}"


def _at_events(result: StoredResult, kind: str, begin: float) -> style.Columns:
    """The states at the events of a kind."""
    if "events" not in result.file:
        remedy = f"run its case again with {argument('set')} output.events=true"
        raise UsageError(f"{argument('section')} {kind}: {result.path} holds no events; {remedy}")
    there = result.read("events", "time") >= begin
    kinds = result.read("events", "kind")[there]
    if kind not in kinds:
        choices = f"give one of {', '.join(sorted({*kinds.tolist()}))}" if len(kinds) else "run longer"
        raise UsageError(f"{argument('section')} {kind}: {result.path} has none from {begin:.4g} s on; {choices}")
    return {name: result.read("events", name)[there][kinds == kind] for name in _STATE}
