"""The picture of a sweep over one axis: curves of critical values, or of amplitude and frequency."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.plots import marks, style
from brakecli.plots.marks import DIFFERENT, FORCED, REGIMES, Mark
from brakecli.plots.style import Array
from brakecli.plots.sweep import SweepPicture
from brakecli.sweeps.critical import Outcome

_FEW = 60
"""Number of points up to which each has a marker of full size."""
_DIRECTIONS = {"": ("", "-"), "up": (">", "-"), "down": ("<", style.DASHES)}
"""Marker and dashes of the curve of each direction."""
_ALIKE = 0.02
"""Values whose relative difference is smaller do not fill the axis from bottom to top."""


def draw(picture: SweepPicture) -> Figure:
    """The figure of a sweep over one axis: one panel, or two above each other."""
    panels: list[tuple[float, Callable[[Axes, SweepPicture], None]]]
    if picture.critical is None:
        panels = [(1.5, partial(_draw_motion, name="amplitude")), (1.0, partial(_draw_motion, name="frequency"))]
    else:
        panels = [(3.2, _draw_critical)]
        compared = np.isfinite(picture["critical"] - picture["critical_eigenvalue"]).any()
        if picture.critical.method == "simulation" and compared:
            panels.append((1.0, _draw_difference))
    figure = marks.sweep_figure(picture, marks.WIDTH, 5.2 if len(panels) == 1 else 6.4)
    heights = [height for height, _ in panels]
    rows = figure.subplots(len(panels), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (_, draw_panel) in zip(rows, panels, strict=True):
        draw_panel(axes, picture)
        axes.label_outer()
    figure.align_ylabels()
    style.add_legend_above(figure, marks.LEGEND_ORDER)
    return figure


def _draw_critical(axes: Axes, picture: SweepPicture) -> None:
    """The critical value along the axis of a sweep, and the least sustained one where it differs.

    Values found by simulation have error bars, and those by eigenvalues stand beside them. Points without a value
    are marked at the top if they are stable up to there, otherwise at the bottom.
    """
    critical = picture.critical
    assert critical is not None
    x, value, sustained = picture.axes[0].values, picture["critical"][0], picture["critical_sustained"][0]
    eigenvalue, size = picture["critical_eigenvalue"][0], _size(x)
    line: dict[str, Any] = {"marker": ".", "ms": 0.6 * size}
    if picture.axes[0].texts is not None:
        line = {"ls": "none", "marker": "_", "ms": 16}
    axes.plot(x, eigenvalue, color=style.DARK, lw=1.1, label="by eigenvalues", **line)
    regained = picture["critical_status"][0] == Outcome.REGAINED
    if critical.method == "simulation":
        for chosen, face, label in ((~regained, style.BLUE, "by simulation"), (regained, "white", "stable above")):
            if (there := chosen & np.isfinite(value)).any():
                error = picture["critical_error"][0][there]
                axes.errorbar(x[there], value[there], error, mfc=face, label=label, **_bars(size))
    elif regained.any():
        axes.plot(x[regained], value[regained], "o", mfc="white", mec=style.DARK, label="stable above")
    if (apart := marks.differs(picture)[0]).any():
        axes.vlines(x[apart], sustained[apart], value[apart], color=style.VERMILION, lw=1.0, ls=(0, (1, 1.5)))
        label = "vibration lasts from here on, from the case's own start"
        axes.plot(x[apart], sustained[apart], "v", ms=size, color=style.VERMILION, label=label)
    marks.set_scale(axes, "x", picture.axes[0])
    axes.set_ylabel(marks.critical_label(picture), parse_math=False)
    drawn = np.concatenate([value, eigenvalue, sustained])
    style.set_ticks(axes.yaxis, style.largest(drawn) or max(abs(critical.lower), abs(critical.upper)))
    if np.isfinite(drawn).any():
        _widen(axes, drawn)
    else:
        axes.set_ylim(critical.lower, critical.upper)
    _mark(axes, x, marks.missing(picture))


def _draw_difference(axes: Axes, picture: SweepPicture) -> None:
    """By how much the critical value by simulation lies above the one by eigenvalues, with its error bars."""
    x = picture.axes[0].values
    difference = picture["critical"][0] - picture["critical_eigenvalue"][0]
    error = np.where(np.isfinite(difference), picture["critical_error"][0], np.nan)
    axes.axhline(0.0, color=style.DARK, lw=1.1)
    axes.errorbar(x, difference, error, **_bars(_size(x)))
    marks.set_scale(axes, "x", picture.axes[0])
    style.set_ticks(axes.yaxis, style.largest(np.abs(difference) + error))
    axes.margins(y=0.15)
    axes.set_ylabel(style.labelled("simulation\nless eigenvalue", picture.units["critical"]), parse_math=False)


def _draw_motion(axes: Axes, picture: SweepPicture, name: str) -> None:
    """`name`, the amplitude or the frequency, along the axis of a sweep; each point in the colour of its regime.

    Where the motion was followed, the points are arrows that show the direction.
    """
    axis, values, unit = picture.axes[0], picture[name], picture.units[name]
    factor, unit = style.prefixed(style.largest(values), unit) if unit == "m" else (1.0, unit)
    least = _least(picture) if name == "amplitude" else 0.0
    x, size, small = axis.values, _size(axis.values), values < least
    for number, direction in enumerate(picture.directions):
        y = factor * np.where(small[number], np.nan, values[number])
        marker, dashes = _DIRECTIONS[direction]
        arrows: dict[str, Any] = {"marker": marker, "mfc": "white", "mec": style.DARK, "ms": size}
        arrows = {"label": f"on the way {direction}", **arrows} if direction else {}
        if axis.texts is None:
            axes.plot(x, y, color="#777777", lw=1.0, ls=dashes, **arrows)
        for regime, where in marks.regimes(picture):
            colour, sign = REGIMES[regime]
            points: dict[str, Any] = {"ls": "none", "mfc": colour, "mec": style.DARK, "mew": 0.6}
            chosen = where[number]
            axes.plot(x[chosen], y[chosen], marker=marker or sign, ms=size, **points)
            if number == 0:  # for the legend
                axes.plot([], [], marker="s" if direction else sign, ms=7, label=str(regime), **points)
        if (shaken := marks.forced(picture)[number] & np.isfinite(y)).any():
            axes.plot(x[shaken], y[shaken], "o", color=style.DARK, ms=0.4 * size, mec="white", mew=0.5)
    if marks.forced(picture).any():
        axes.plot([], [], "o", ms=3, color=style.DARK, label=FORCED)
    _shade_hysteresis(axes, picture)
    marks.set_scale(axes, "x", axis)
    _set_height(axes, name, factor * values, factor * least)
    words = picture.long_names[name]
    axes.set(ylabel=style.labelled(name, unit), title=words[:1].upper() + words[1:])
    if not np.isfinite(values).any():
        axes.set_yticks([])
        style.write_inside(axes, "no sustained vibration")
    _mark(axes, x, [Mark("smaller than drawn", small, "v", style.DARK, "white", "bottom"), marks.failed(picture)])


def _least(picture: SweepPicture) -> float:
    """The least amplitude that is drawn on a logarithmic axis; 0 where the axis is linear."""
    least, _, wide = marks.lasting_amplitudes(picture)
    values = picture["amplitude"]
    return max(least / 30.0, float(np.nanmin(values[values > 0.0]))) if wide else 0.0


def _set_height(axes: Axes, name: str, values: Array, floor: float) -> None:
    """Show amplitudes from 0 on, or on a logarithmic axis from the floor on; frequencies around their middle."""
    if not np.isfinite(values).any():
        return
    highest = float(np.nanmax(values))
    if name != "amplitude":
        _widen(axes, values)
    elif floor:
        axes.set(yscale="log", ylim=(0.5 * floor, 2.0 * highest))
        style.set_log_ticks(axes.yaxis, 4.0 * highest / floor)
    else:
        axes.set_ylim(-0.03 * (highest or 1.0), 1.08 * (highest or 1.0))


def _shade_hysteresis(axes: Axes, picture: SweepPicture) -> None:
    """A band around every value at which the ways up and down differ."""
    if "hysteresis" not in picture.variables:
        return
    edges, label = picture.axes[0].edges, DIFFERENT
    for place in np.flatnonzero(picture["hysteresis"][0] == 1):
        axes.axvspan(edges[place], edges[place + 1], color=style.GREEN, alpha=0.16, lw=0, zorder=0.5, label=label)
        label = "_"


def _widen(axes: Axes, values: Array) -> None:
    """Keep values that differ too little in the middle of the axis."""
    low, high = np.nanmin(values), np.nanmax(values)
    if high - low < _ALIKE * abs(high + low) / 2.0:
        middle, half = 0.5 * (high + low), 0.25 * _ALIKE * abs(high + low)
        axes.set_ylim(middle - half, middle + half)
    else:
        axes.margins(y=0.08)


def _mark(axes: Axes, x: Array, signs: Iterable[Mark]) -> None:
    """Signs at the edge of the axes, in room of their own."""
    there = [mark for mark in signs if mark.where.any()]
    sides = {mark.at for mark in there}
    axes.get_ylim()  # settles limits that are left to the data
    scaled = axes.transScale + axes.transLimits
    low, high = (-0.09 if "bottom" in sides else 0.0), (1.09 if "top" in sides else 1.0)
    axes.set_ylim(*scaled.inverted().transform([(0.0, low), (0.0, high)])[:, 1])
    for mark in there:
        chosen = mark.where.any(axis=0)
        height = np.full(int(chosen.sum()), 0.035 if mark.at == "bottom" else 0.965)
        look: dict[str, Any] = {**mark.look, "ms": _size(x), "transform": axes.get_xaxis_transform()}
        axes.plot(x[chosen], height, clip_on=False, zorder=3, **look)


def _size(points: Array) -> float:
    """The size of markers, smaller where there are many points."""
    return 6.5 if len(points) <= _FEW else max(2.0, 6.5 * (_FEW / len(points)) ** 0.5)


def _bars(size: float) -> dict[str, Any]:
    """The look of points with error bars."""
    return {"fmt": "o", "color": style.BLUE, "ms": size, "capsize": 0.6 * size, "elinewidth": 1.0}
