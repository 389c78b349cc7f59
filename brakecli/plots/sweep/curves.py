"""A sweep over one axis, drawn onto given axes: critical values, or amplitude and frequency."""

from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.plots.run import prefixed
from brakecli.plots.style import BLUE, DASHES, GREEN, VERMILION
from brakecli.plots.sweep.marks import (
    DARK,
    REGIME_COLOURS,
    REGIME_MARKERS,
    SUSTAINED,
    Mark,
    differs,
    failed,
    forced,
    missing,
    regimes,
    set_log_ticks,
    set_scale,
    set_ticks,
)
from brakecli.plots.sweep.picture import Array, SweepPicture, labelled
from brakecli.sweeps.critical import Outcome
from brakecli.sweeps.tables import Method

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FEW = 60
"""Points up to which each has a marker of full size."""
_DIRECTIONS = {"up": (">", "-"), "down": ("<", DASHES)}
_ALIKE = 0.02
"""Values that differ by less than this part fill no axis from bottom to top."""
_WIDE = 20.0
"""Ratio of amplitudes from which on they are drawn on a logarithmic axis."""


def draw_critical(axes: "Axes", picture: SweepPicture) -> None:
    """The critical value along the axis of a sweep, and the least sustained one where it differs.

    With error bars where it was found by simulation, and then beside that by eigenvalues. Points without one are
    marked at the top, if it is stable up to there, or at the bottom. A legend is left to the caller.
    """
    critical = picture.critical
    assert critical is not None
    x, value, sustained = picture.axes[0].values, picture["critical"][0], picture["critical_sustained"][0]
    numbers = picture.axes[0].texts is None
    size = _size(len(x))
    line: dict[str, Any] = {"marker": ".", "ms": 0.6 * size}
    line = line if numbers else {"ls": "none", "marker": "_", "ms": 16}
    axes.plot(x, picture["critical_eigenvalue"][0], color=DARK, lw=1.1, label="by eigenvalues", **line)
    regained = picture["critical_status"][0] == Outcome.REGAINED
    if critical.method is Method.SIMULATION:
        for chosen, face, label in ((~regained, BLUE, "by simulation"), (regained, "white", "stable above")):
            if (there := chosen & np.isfinite(value)).any():
                error = picture["critical_error"][0][there]
                axes.errorbar(x[there], value[there], error, mfc=face, label=label, **_bars(size))
    elif regained.any():
        axes.plot(x[regained], value[regained], ls="none", marker="o", mfc="white", mec=DARK, label="stable above")
    if (apart := differs(picture)[0]).any():
        axes.vlines(x[apart], sustained[apart], value[apart], color=VERMILION, lw=1.0, ls=(0, (1, 1.5)))
        label = "vibration lasts from here on, from the case's own start"
        axes.plot(x[apart], sustained[apart], ls="none", marker="v", ms=size, color=VERMILION, label=label)
    set_scale(axes, "x", picture.axes[0])
    axes.set_ylabel(labelled(f"critical {critical.parameter}", picture.units["critical"]), parse_math=False)
    drawn = np.concatenate([value, picture["critical_eigenvalue"][0], sustained])
    set_ticks(axes.yaxis, _largest(drawn) or max(abs(critical.lower), abs(critical.upper)))
    if np.isfinite(drawn).any():
        _widen(axes, drawn)
    else:
        axes.set_ylim(critical.lower, critical.upper)
    _mark(axes, x, missing(picture))


def draw_difference(axes: "Axes", picture: SweepPicture) -> None:
    """By how much the critical value by simulation lies above the one by eigenvalues, with its error bars."""
    x, size = picture.axes[0].values, _size(len(picture.axes[0].values))
    difference = picture["critical"][0] - picture["critical_eigenvalue"][0]
    error = np.where(np.isfinite(difference), picture["critical_error"][0], np.nan)
    axes.axhline(0.0, color=DARK, lw=1.1)
    axes.errorbar(x, difference, error, **_bars(size))
    set_scale(axes, "x", picture.axes[0])
    set_ticks(axes.yaxis, _largest(np.abs(difference) + error))
    axes.margins(y=0.15)
    axes.set_ylabel(labelled("simulation\nless eigenvalue", picture.units["critical"]), parse_math=False)


def draw_motion(axes: "Axes", picture: SweepPicture, name: str) -> None:
    """`name`, the amplitude or the frequency, along the axis of a sweep; each point in the colour of its regime.

    Where the motion was followed its points are arrows that show which way. A legend is left to the caller.
    """
    x, numbers = picture.axes[0].values, picture.axes[0].texts is None
    factor, unit = _prefixed(picture, name)
    size, small = _size(len(x)), picture[name] < _least(picture, name)
    for number, direction in enumerate(picture.directions):
        y = factor * np.where(small[number], np.nan, picture[name][number])
        marker, dashes = _DIRECTIONS.get(direction, ("", "-"))
        if numbers:
            label = f"on the way {direction}" if direction else None
            look: dict[str, Any] = {"marker": marker, "mfc": "white", "mec": DARK, "ms": size}
            axes.plot(x, y, color="#777777", lw=1.0, ls=dashes, label=label, **(look if direction else {}))
        for regime, where in regimes(picture):
            chosen = where[number]
            look = {"marker": marker or REGIME_MARKERS[regime], "mfc": REGIME_COLOURS[regime], "mec": DARK}
            axes.plot(x[chosen], y[chosen], ls="none", mew=0.6, ms=size, **look)
        if (shaken := forced(picture)[number] & np.isfinite(y)).any():
            axes.plot(x[shaken], y[shaken], ls="none", marker="o", color=DARK, ms=0.4 * size, mec="white", mew=0.5)
    _name_regimes(axes, picture)
    _shade_hysteresis(axes, picture)
    set_scale(axes, "x", picture.axes[0])
    _set_height(axes, picture, name, factor)
    axes.set_ylabel(labelled(name, unit))
    words = picture.long_names[name]
    axes.set_title(words[:1].upper() + words[1:])
    if not np.isfinite(picture[name]).any():
        axes.set_yticks([])
        axes.text(0.5, 0.5, "no sustained vibration", transform=axes.transAxes, ha="center", color="#666666")
    _mark(axes, x, [Mark("smaller than drawn", small, "v", DARK, False, "bottom"), failed(picture)])


def _name_regimes(axes: "Axes", picture: SweepPicture) -> None:
    """What the legend is to say of the colours."""
    for regime, _ in regimes(picture):
        marker = "s" if picture.directions[0] else REGIME_MARKERS[regime]
        look: dict[str, Any] = {"marker": marker, "mfc": REGIME_COLOURS[regime], "mec": DARK, "mew": 0.6}
        axes.plot([], [], ls="none", ms=7, label=str(regime), **look)
    if forced(picture).any():
        axes.plot([], [], ls="none", marker="o", ms=3, color=DARK, label="forced by the wheel's waves")


def _shade_hysteresis(axes: "Axes", picture: SweepPicture) -> None:
    """A band around every value at which the ways up and down differ."""
    if "hysteresis" not in picture.variables:
        return
    edges = cell_edges(picture.axes[0].values, logarithmic=picture.axes[0].logarithmic)
    label = "up and down differ"
    for place in np.flatnonzero(picture["hysteresis"][0] == 1):
        axes.axvspan(edges[place], edges[place + 1], color=GREEN, alpha=0.16, lw=0, zorder=0.5, label=label)
        label = "_"


def cell_edges(values: Array, *, logarithmic: bool) -> Array:
    """The limits of the cells around values along an axis: half way between them."""
    places = np.log(values) if logarithmic else values
    if len(places) == 1:
        return np.array([places[0] - 0.5, places[0] + 0.5])
    middles = 0.5 * (places[1:] + places[:-1])
    edges = np.concatenate([[2.0 * places[0] - middles[0]], middles, [2.0 * places[-1] - middles[-1]]])
    return np.exp(edges) if logarithmic else edges


def _least(picture: SweepPicture, name: str) -> float:
    """The least amplitude that is drawn on a logarithmic axis; 0 where the axis is linear."""
    values = picture[name]
    lasting = values[np.isin(picture["regime"], SUSTAINED) & (values > 0.0)]
    if name != "amplitude" or not lasting.size or lasting.max() <= _WIDE * lasting.min():
        return 0.0
    return float(max(lasting.min() / 30.0, np.nanmin(values[values > 0.0])))


def _set_height(axes: "Axes", picture: SweepPicture, name: str, factor: float) -> None:
    """Amplitudes from 0 on, or on a logarithmic axis if those that last are of very different size."""
    values = factor * picture[name]
    if not np.isfinite(values).any():
        return
    if name != "amplitude":
        _widen(axes, values)
        return
    if floor := factor * _least(picture, name):
        axes.set_yscale("log")
        axes.set_ylim(0.5 * floor, 2.0 * np.nanmax(values))
        set_log_ticks(axes.yaxis, 4.0 * np.nanmax(values) / floor)
    else:
        highest = float(np.nanmax(values)) or 1.0
        axes.set_ylim(-0.03 * highest, 1.08 * highest)


def _widen(axes: "Axes", values: Array) -> None:
    """Leave values that differ too little in the middle of the axis."""
    low, high = np.nanmin(values), np.nanmax(values)
    if high - low < _ALIKE * abs(high + low) / 2.0:
        middle, half = 0.5 * (high + low), 0.25 * _ALIKE * abs(high + low)
        axes.set_ylim(middle - half, middle + half)
    else:
        axes.margins(y=0.08)


def _mark(axes: "Axes", x: Array, marks: Any) -> None:
    """Signs at the edge of the axes, in room of their own."""
    there: list[Mark] = [mark for mark in marks if mark.where.any()]
    sides = {mark.at for mark in there}
    axes.get_ylim()  # settles limits that are left to the data
    scaled = axes.transScale + axes.transLimits
    low, high = (-0.09 if "bottom" in sides else 0.0), (1.09 if "top" in sides else 1.0)
    bounds = scaled.inverted().transform([(0.0, low), (0.0, high)])[:, 1]
    axes.set_ylim(*bounds)
    for mark in there:
        chosen = mark.where.any(axis=0)
        height = np.full(int(chosen.sum()), 0.035 if mark.at == "bottom" else 0.965)
        look: dict[str, Any] = {**mark.look, "ms": _size(len(x)), "transform": axes.get_xaxis_transform()}
        axes.plot(x[chosen], height, label=mark.label, clip_on=False, zorder=3, **look)


def _prefixed(picture: SweepPicture, name: str) -> tuple[float, str]:
    unit = picture.units[name]
    return prefixed(_largest(picture[name]), unit) if unit == "m" else (1.0, unit)


def _largest(values: Array) -> float:
    """The largest magnitude of those that are there."""
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def _size(points: int) -> float:
    """Of markers, in points."""
    return 6.5 if points <= _FEW else max(2.0, 6.5 * (_FEW / points) ** 0.5)


def _bars(size: float) -> dict[str, Any]:
    """How points with error bars look."""
    return {"fmt": "o", "color": BLUE, "ms": size, "capsize": 0.6 * size, "elinewidth": 1.0}
