"""The picture of a sweep over two axes, or over three: maps, the first axis along x, the second along y."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import QuadMesh
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from brakecli.plots import marks, style
from brakecli.plots.marks import DIFFERENT, FORCED, REGIMES
from brakecli.plots.style import Array
from brakecli.plots.sweep import MOST_PANELS, SweepPicture

_LONG_TITLE = 34
"""Number of characters of a panel's title from which on it takes two lines."""
_MAP_WIDTH, _PANEL_WIDTH = 10.4, 3.0
"""Widths (inches): of a figure with two columns of maps, and of each map where maps stand side by side."""
_MOST_NUMBERS = 80
_MOST_DRAWN = 4096
"""Number of cells up to which each cell of a map is a shape of its own in a PDF or SVG file."""


@dataclass(frozen=True)
class Scale:
    """The colours of numbers times `factor`, the same in all maps of a figure."""

    label: str
    norm: Normalize
    factor: float = 1.0
    extend: str = "neither"


def draw(picture: SweepPicture) -> Figure:
    """The figure of a sweep over two axes, or over three: then a column of maps for each value of one of them."""
    critical, sliced = picture.critical is not None, len(picture.axes) == 3
    layers: dict[str, Callable[[Axes, SweepPicture, Scale], ScalarMappable]]
    if critical:
        scale, layers = critical_scale(picture), {"": _draw_critical}
    else:
        scale, layers = amplitude_scale(picture), {"Regime": _draw_regimes, "Amplitude": _draw_amplitude}
    if sliced:
        pieces = _slices(picture)
        width, height = max(_MAP_WIDTH, 1.2 + _PANEL_WIDTH * len(pieces)), 4.6 if critical else 7.2
    else:
        pieces = [(f" on the way {way}" if way else "", picture.towards(way)) for way in picture.directions]
        width, height = (marks.WIDTH, 5.8) if critical else (_MAP_WIDTH, 1.0 + 3.9 * len(pieces))
    figure = marks.sweep_figure(picture, width, height)
    shape = (len(layers), len(pieces)) if sliced else (len(pieces), len(layers))
    panels = figure.subplots(*shape, sharex=True, sharey=True, squeeze=False)
    for row, (name, piece) in zip(panels.T if sliced else panels, pieces, strict=True):
        for axes, (layer, draw_layer) in zip(row, layers.items(), strict=True):
            mesh = draw_layer(axes, piece, scale)
            axes.set_title("" if sliced else layer + name)
            axes.label_outer()
        if sliced:
            row[0].set_title(name, parse_math=False)
    _add_colours(figure, mesh, panels[-1] if sliced else panels, scale)
    style.add_legend_above(figure, marks.LEGEND_ORDER)
    return figure


def _slices(picture: SweepPicture) -> list[tuple[str, SweepPicture]]:
    """Title and picture for each value of the shortest axis, or of an axis of texts if there is one."""
    lengths = [len(axis.values) for axis in picture.axes]
    short = [number for number in range(3) if lengths[number] <= MOST_PANELS]
    sliced = min(short, key=lambda number: (picture.axes[number].texts is None, lengths[number], -number))
    names = [picture.axes[sliced].named(place) for place in range(lengths[sliced])]
    titles = [name if len(name) < _LONG_TITLE else name.replace(" = ", "\n= ") for name in names]
    return [(title, picture.at(sliced, place)) for place, title in enumerate(titles)]


def _draw_regimes(axes: Axes, picture: SweepPicture, _: Scale) -> ScalarMappable:
    """The regime of each point as a colour."""
    codes = np.full(picture["regime"].shape, np.nan)
    for regime, where in marks.regimes(picture):
        codes[where] = list(REGIMES).index(regime)
        axes.plot([], [], ls="none", marker="s", ms=9, mfc=REGIMES[regime][0], mec="none", label=str(regime))
    colours = ListedColormap([colour for colour, _ in REGIMES.values()])
    mesh = _mesh(axes, picture, codes[0], cmap=colours, vmin=-0.5, vmax=len(REGIMES) - 0.5)
    _sign(axes, picture, marks.forced(picture), marker="o", color=style.DARK, mec="white", label=FORCED)
    different = picture.variables.get("hysteresis", np.zeros(codes.shape)) == 1
    _sign(axes, picture, different, marker="$≠$", color=style.DARK, label=DIFFERENT)
    _sign(axes, picture, marks.failed(picture).where, **marks.failed(picture).look)
    return mesh


def _draw_amplitude(axes: Axes, picture: SweepPicture, scale: Scale) -> ScalarMappable:
    """The amplitude of each point."""
    mesh = _mesh(axes, picture, scale.factor * picture["amplitude"][0], cmap="viridis", norm=scale.norm)
    _sign(axes, picture, marks.failed(picture).where, **marks.failed(picture).look)
    return mesh


def amplitude_scale(picture: SweepPicture) -> Scale:
    """Colours from 0 on, or logarithmic ones if amplitudes that last are of very different size."""
    least, largest, wide = marks.lasting_amplitudes(picture)
    largest = largest or style.largest(picture["amplitude"])
    factor, unit = style.prefixed(largest, picture.units["amplitude"])
    low, high = factor * least if wide else 0.0, factor * largest or 1.0
    drawn = factor * picture["amplitude"]
    beyond = int((drawn < low).any()) + 2 * int((drawn > 1.0001 * high).any())
    norm = LogNorm(low, high) if wide else Normalize(low, high)
    return Scale(f"amplitude ({unit})", norm, factor, ("neither", "min", "max", "both")[beyond])


def _draw_critical(axes: Axes, picture: SweepPicture, scale: Scale) -> ScalarMappable:
    """The critical value with contours, or with numbers where there are few; points without one are marked."""
    values = picture["critical"][0]
    mesh = _mesh(axes, picture, values, cmap="cividis", norm=scale.norm)
    if _is_whole(picture, values):
        _draw_contours(axes, picture, values, scale.norm)
    elif values.size <= _MOST_NUMBERS:
        _write_numbers(axes, picture, values, scale.norm)
    label = "vibration lasts elsewhere, from the case's own start"
    _sign(axes, picture, marks.differs(picture), marker="d", color=style.VERMILION, mec="white", label=label)
    for mark in marks.missing(picture):
        _sign(axes, picture, mark.where, **mark.look)
    return mesh


def critical_scale(picture: SweepPicture) -> Scale:
    """The colours of all critical values."""
    assert picture.critical is not None
    values = picture["critical"][np.isfinite(picture["critical"])]
    low, high = picture.critical.lower, picture.critical.upper
    if values.size:
        low, high = float(values.min()), float(values.max())
        least = 0.01 * max(abs(low), abs(high))
        if high - low <= least:
            low, high = low - (least or 1.0), high + (least or 1.0)
    return Scale(marks.critical_label(picture), Normalize(low, high))


def _mesh(axes: Axes, picture: SweepPicture, values: Array, **look: Any) -> QuadMesh:
    """A cell around each point, in the colour of its value; none where it is missing."""
    x, y = picture.axes
    marks.set_scale(axes, "x", x)
    marks.set_scale(axes, "y", y)
    axes.grid(False)
    axes.set_facecolor("#F7F7F7")
    seams = {"edgecolors": "white", "linewidth": 0.4} if values.size <= 1000 else {"edgecolors": "face"}
    drawn = np.ma.masked_invalid(values.T)
    mesh = axes.pcolormesh(x.edges, y.edges, drawn, **look, **seams, rasterized=values.size > _MOST_DRAWN)
    axes.set(xlim=x.edges[[0, -1]], ylim=y.edges[[0, -1]])
    return mesh


def _draw_contours(axes: Axes, picture: SweepPicture, values: Array, norm: Normalize) -> None:
    x, y = (axis.values for axis in picture.axes)
    ends = float(np.nanmin(values)), float(np.nanmax(values))
    levels = MaxNLocator(6).tick_values(float(norm.vmin or 0.0), float(norm.vmax or 0.0))
    if not (levels := [level for level in levels if ends[0] < level < ends[1]]):
        return
    lines = axes.contour(x, y, np.ma.masked_invalid(values.T), levels, colors="white", linewidths=1.1)
    lines.set_path_effects([withStroke(linewidth=2.2, foreground="#00000070")])
    for text in lines.clabel(fmt="%g", fontsize=8.5, use_clabeltext=True):
        text.set_path_effects([withStroke(linewidth=2.5, foreground=style.DARK)])


def _is_whole(picture: SweepPicture, values: Array) -> bool:
    """Whether values are known over most of an area, so that contours show what they do."""
    if any(axis.texts is not None or len(axis.values) < 3 for axis in picture.axes):
        return False
    known = np.isfinite(values)
    return bool(np.mean(known[1:, 1:] & known[:-1, 1:] & known[1:, :-1] & known[:-1, :-1]) > 0.3)


def _write_numbers(axes: Axes, picture: SweepPicture, values: Array, norm: Normalize) -> None:
    for place in np.argwhere(np.isfinite(values)):
        x, y = (axis.values[at] for axis, at in zip(picture.axes, place, strict=True))
        value = values[tuple(place)]
        colour = "white" if norm(value) < 0.6 else "black"
        axes.text(x, y, f"{value:.4g}", ha="center", va="center", size=8.0, color=colour)


def _sign(axes: Axes, picture: SweepPicture, where: NDArray[np.bool_], **look: Any) -> None:
    """A sign in the middle of each of these cells, small where cells are small."""
    if not where.any():
        return
    places = np.argwhere(where[0])
    x, y = (axis.values[places[:, number]] for number, axis in enumerate(picture.axes))
    box, scale = axes.get_window_extent(), 72.0 / float(axes.figure.dpi)
    room = min(box.width / len(picture.axes[0].values), box.height / len(picture.axes[1].values)) * scale
    axes.plot(x, y, **{"ls": "none", "ms": float(np.clip(0.4 * room, 1.0, 7.0)), **look})


def _add_colours(figure: Figure, mesh: ScalarMappable, panels: Any, scale: Scale) -> None:
    """Add the bar that explains the colours of a map's numbers."""
    bar = figure.colorbar(mesh, ax=panels, extend=scale.extend, aspect=30, pad=0.015)
    low, high = (value or 0.0 for value in mesh.get_clim())
    if isinstance(scale.norm, LogNorm):
        style.set_log_ticks(bar.ax.yaxis, high / low)
    else:
        style.set_ticks(bar.ax.yaxis, max(abs(low), abs(high)))
    bar.minorticks_off()
    bar.set_label(scale.label, parse_math=False)
    bar.outline.set_visible(False)
