"""The picture of a sweep over one axis: curves of critical values, or of amplitude and frequency."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.analysis.regime.decision import Excitation
from brakecli.studies.sweeps.windows import Outcome
from brakecli.views.plots import style, sweep
from brakecli.views.plots.sweep import Sign, SweepPicture

_DIRECTIONS = {"": ("", "-"), "up": (">", "-"), "down": ("<", style.DASHES)}  # marker and dashes of curves


def draw(picture: SweepPicture) -> Figure:
    """The figure of a sweep over one axis: one panel, or two above each other."""
    panels: dict[Callable[[Axes, SweepPicture], None], float]  # with their heights
    panels = {partial(_draw_motion, name="amplitude"): 1.5, partial(_draw_motion, name="frequency"): 1.0}
    if picture.shown:
        panels = {partial(_draw_motion, name=picture.shown): 1.0}
    elif picture.critical is not None:
        panels = {_draw_critical: 3.2}
        if _simulated(picture) and np.isfinite(picture["critical"] - picture["critical_eigenvalue"]).any():
            panels[_draw_difference] = 1.0
    figure = picture.figure(sweep.WIDTH, 5.2 if len(panels) == 1 else 6.4)
    rows = figure.subplots(len(panels), 1, sharex=True, height_ratios=[*panels.values()], squeeze=False)
    for axes, draw_panel in zip(rows.flat, panels, strict=True):
        draw_panel(axes, picture)
        picture.axes[0].apply_to(axes.xaxis)
        axes.label_outer()
    figure.align_ylabels()
    sweep.add_legend(figure)
    return figure


def _draw_critical(axes: Axes, picture: SweepPicture) -> None:
    """The critical value along the axis of a sweep, and the least sustained one where it differs."""
    critical = picture.critical
    axis = picture.axes[0]
    assert critical is not None
    x = axis.values
    value = picture["critical"][0]
    sustained = picture["critical_sustained"][0]
    eigenvalue = picture["critical_eigenvalue"][0]
    size = sweep.size_of(len(x))
    marker, ms, ls = (".", 0.6 * size, "-") if axis.texts is None else ("_", 16.0, "none")
    axes.plot(x, eigenvalue, color=style.DARK, lw=1.1, label="by eigenvalues", marker=marker, ms=ms, ls=ls)
    regained = picture["critical_status"][0] == Outcome.REGAINED
    if critical.method == "simulation":
        label_of_value = "by simulation" if _simulated(picture) else "critical value"
        for chosen, face, label in ((~regained, style.BLUE, label_of_value), (regained, "white", "stable above")):
            if (there := chosen & np.isfinite(value)).any():
                axes.plot(x[there], value[there], "o", color=style.BLUE, mfc=face, ms=size, label=label)
    elif regained.any():
        axes.plot(x[regained], value[regained], "o", mfc="white", mec=style.DARK, label="stable above")
    low = picture["critical_windows_lower"][0]
    high = picture["critical_windows_upper"][0]
    if (high < critical.upper).any():  # otherwise all is unstable above the critical value
        bars = np.repeat(x, low.shape[1]), low.ravel(), high.ravel()
        axes.vlines(*bars, label="unstable", color=style.BLUE, alpha=0.2, lw=1.2 * size, zorder=0.8)
    if (apart := picture.differs()[0]).any():
        axes.vlines(x[apart], sustained[apart], value[apart], color=style.VERMILION, lw=1.0, ls=style.DOTS)
        label = "vibration lasts from here on, from the case's own start"
        axes.plot(x[apart], sustained[apart], "v", ms=size, color=style.VERMILION, label=label)
    ends = np.concatenate([low.ravel(), high.ravel()])
    within = ends[(ends > critical.lower) & (ends < critical.upper)]  # not those that a bound cuts
    error = np.nan_to_num(picture["critical_error"][0])
    drawn = np.concatenate([value - error, value + error, eigenvalue, sustained, within])
    highest = style.largest(drawn) or max(abs(critical.lower), abs(critical.upper))
    style.set_ticks(axes.yaxis, 0.0, highest, picture.units["critical"], f"critical {critical.parameter}")
    if np.isfinite(drawn).any():
        style.widen(axes, drawn)
    else:
        axes.set_ylim(critical.lower, critical.upper)
    if critical.method == "simulation":
        _bars(axes, x, value, error, size)
    _mark(axes, x, picture.missing())


def _simulated(picture: SweepPicture) -> bool:
    """Whether runs measured a critical value: where steps are exact, all are those of the eigenvalues."""
    critical = picture.critical
    value = picture["critical"]
    apart = np.isfinite(value) & (value != picture["critical_eigenvalue"])
    return critical is not None and critical.method == "simulation" and bool(apart.any())


def _draw_difference(axes: Axes, picture: SweepPicture) -> None:
    """By how much the critical value by simulation lies above the one by eigenvalues, with its error bars."""
    x = picture.axes[0].values
    difference = (picture["critical"] - picture["critical_eigenvalue"])[0]
    error = np.where(np.isfinite(difference), picture["critical_error"][0], np.nan)
    size = sweep.size_of(len(x))
    axes.axhline(0.0, color=style.DARK, lw=1.1)
    axes.plot(x, difference, "o", color=style.BLUE, ms=size)
    highest = style.largest(np.abs(difference) + error)
    name = "simulation\nless eigenvalue"
    style.set_ticks(axes.yaxis, 0.0, highest, picture.units["critical"], name)
    style.widen(axes, np.concatenate([difference - error, difference + error, [0.0]]))
    _bars(axes, x, difference, error, size)


def _draw_motion(axes: Axes, picture: SweepPicture, name: str) -> None:
    """Amplitude or frequency; points have the colour of their regime, and are arrows if it was followed."""
    axis = picture.axes[0]
    unit = picture.units[name]
    died = picture.died(name)
    values = np.where(died, np.nan, picture[name])  # what dies out has no place on a curve
    factor, unit = style.prefixed(style.largest(values), unit)
    lasting, _, wide = picture.lasting_amplitudes()
    wide = wide and name == "amplitude"  # drawn on a logarithmic axis
    # that is drawn: the least of what lasts is at most 30 times as large
    least = max(lasting / 30.0, float(values[values > 0.0].min())) if wide else 0.0
    x = axis.values
    size = sweep.size_of(len(axis.values))
    small = values < least
    shaken = picture["excitation"] == Excitation.FORCED
    none = np.full_like(values, np.nan)
    forced = picture.variables.get(sweep.FORCED_PART, none) if name == "amplitude" else none
    forced = np.where(forced >= least, forced, np.nan)  # beside what the shoe adds
    for number, direction in enumerate(picture.directions):
        y = factor * np.where(small[number], np.nan, values[number])
        arrow, dashes = _DIRECTIONS[direction]
        if axis.texts is None:
            arrows: style.Look = {"marker": arrow, "mfc": "white", "mec": style.DARK, "ms": size}
            label = f"on the way {direction}" if direction else None
            axes.plot(x, y, color="#777777", lw=1.0, ls=dashes, label=label, **arrows)
        for order, (chosen, label, colour, marker) in enumerate(picture.kinds):
            points: style.Look = {"ls": "none", "mfc": colour, "mec": style.DARK, "mew": 0.6}
            axes.plot(x[chosen[number]], y[chosen[number]], marker=arrow or marker, ms=size, **points)
            if (chosen & (~died | bool(picture.attractors))).any() and order < sweep.MOST_NAMED:  # for the legend
                axes.plot([], [], marker="s" if direction else marker, ms=7, label=label, **points)
        waves = np.where(shaken[number], y, factor * forced[number])
        if (drawn := np.isfinite(waves)).any():
            axes.plot(x[drawn], waves[drawn], "o", color=style.DARK, ms=0.4 * size, mec="white", mew=0.5)
    if shaken.any() or np.isfinite(forced).any():
        axes.plot([], [], "o", ms=3, color=style.DARK, label=sweep.FORCED)
    for index in np.flatnonzero(picture["hysteresis"][0]):  # `style.labels` names the first alone
        span = axis.edges[index : index + 2]
        axes.axvspan(*span, color=style.GREEN, alpha=0.16, lw=0, zorder=0.5, label=sweep.DIFFERENT)
    margin = picture.variables.get(sweep.MARGIN, np.zeros((1, 0)))[0]
    for crossing in _crossings(axis.values, margin):
        axes.axvline(crossing, color=style.DARK, lw=1.1, ls=style.DASHES, zorder=0.7, label=sweep.CRITICAL_LINE)
    words = picture.long_names[name].replace("`", "")
    axes.set(ylabel=style.labelled(name.replace("_", " "), unit), title=words[:1].upper() + words[1:])
    floor = factor * least
    highest = factor * float(np.nanmax(values, initial=0.0))
    if not np.isfinite(values).any():
        axes.set_yticks([])
        nothing = "no sustained vibration" if name in ("amplitude", "frequency") else "no values"
        axes.text(0.5, 0.5, nothing, transform=axes.transAxes, ha="center", color="#666666")
    elif name != "amplitude":
        style.widen(axes, factor * values)
    elif wide:
        axes.set(yscale="log", ylim=(0.5 * floor, 2.0 * highest))
        style.set_ticks(axes.yaxis, 0.5 * floor, 2.0 * highest)
    else:
        axes.set_ylim(-0.03 * (highest or 1.0), 1.08 * (highest or 1.0))
    _, nothing, colour, _ = next(picture.kinds)  # steady sliding is the first attractor
    nothing = nothing if picture.attractors else "damped: nothing lasts"
    still = sweep.sign(died, nothing, ".", colour, style.DARK)
    _mark(axes, x, [sweep.sign(small, "smaller than drawn", "v", style.DARK, "white"), picture.failed(), still])


def _crossings(x: style.Array, margin: style.Array) -> Iterator[float]:
    """Where the margin in friction passes zero, between neighbours along a straight line."""
    passes = np.diff(np.sign(margin)) * np.isfinite(margin[:-1] + margin[1:])
    for index in np.flatnonzero(passes):
        low, high = margin[index : index + 2]
        yield float(x[index] - low * (x[index + 1] - x[index]) / (high - low))


def _mark(axes: Axes, x: style.Array, signs: Iterable[Sign]) -> None:
    """Signs at the edge of the axes, in room of their own: at the top for triangles that point up."""
    there = [(where.any(axis=0), look) for where, look in signs if where.any()]
    up = [look["marker"] == "^" for _, look in there]
    axes.get_ylim()  # settles limits that are left to the data
    scaled = axes.transScale + axes.transLimits
    ends = [(0.0, 0.0 if all(up) else -0.09), (0.0, 1.09 if any(up) else 1.0)]
    axes.set_ylim(*scaled.inverted().transform(ends)[:, 1])
    if there and not all(up):  # on a line of their own, apart from the values
        edge = scaled.inverted().transform([(0.0, -0.03)])[0, 1]
        axes.axhline(edge, color=style.GREY, lw=0.8, zorder=0.6)
        axes.set_yticks([tick for tick in axes.get_yticks() if tick >= edge])
    for chosen, look in there:
        height = np.full(int(chosen.sum()), 0.965 if look["marker"] == "^" else 0.035)
        transform = axes.get_xaxis_transform()
        axes.plot(
            x[chosen], height, ms=sweep.size_of(len(x)), clip_on=False, zorder=3, transform=transform, **look
        )


def _bars(axes: Axes, x: style.Array, value: style.Array, error: style.Array, size: float) -> None:
    """Error bars that reach beyond dots of a size (1/72 inch); how large others are, the legend says."""
    low, high = axes.get_ylim()
    height = 72.0 * axes.get_window_extent().height / axes.figure.dpi
    visible = error * height > 0.5 * size * (high - low)
    if visible.any():
        axes.errorbar(
            x[visible],
            value[visible],
            error[visible],
            label="error bar",
            fmt="none",
            ecolor=style.BLUE,
            capsize=0.6 * size,
            elinewidth=1.0,
        )
    if hidden := style.largest(error[~visible & np.isfinite(value)]):
        axes.plot(
            [], [], "|", color=style.BLUE, label=f"errors up to {style.readable(hidden, 2)} lie within the dots"
        )
