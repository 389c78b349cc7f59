"""The figure of a sweep: which panels it has, and what stands around them."""

import textwrap
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.plots.style import headed, layout
from brakecli.plots.sweep.curves import draw_critical, draw_difference, draw_motion
from brakecli.plots.sweep.maps import (
    amplitude_norm,
    amplitude_unit,
    critical_label,
    critical_norm,
    draw_amplitude,
    draw_critical_map,
    draw_regimes,
)
from brakecli.plots.sweep.marks import REGIME_COLOURS, log_ticks, set_ticks
from brakecli.plots.sweep.picture import MOST_PANELS, SweepPicture
from brakecli.sweeps.tables import Method

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

_LONG_TITLE = 34
"""Characters of a panel's title from which on it takes two lines."""
_WIDTH, _MAP_WIDTH, _PANEL_WIDTH = 8.8, 10.4, 3.0
"""Inches: of curves, of two maps or one, and of each map where they stand side by side."""


def draw_sweep(picture: SweepPicture) -> "Figure":
    """The figure of a sweep over one to three axes."""
    if len(picture.axes) == 1:
        figure = _draw_critical(picture) if picture.critical is not None else _draw_motion(picture)
    elif len(picture.axes) == 2:
        figure = _draw_critical_map(picture) if picture.critical is not None else _draw_maps(picture)
    else:
        figure = _draw_slices(picture)
    _add_legend(figure)
    return figure


def _headed(picture: SweepPicture, width: float, height: float) -> "Figure":
    """An empty figure below its heading."""
    wrapped = [
        textwrap.wrap(each, round(12.0 * width), max_lines=2, placeholder=" …") for each in picture.findings
    ]
    lines = [picture.summary, *chain.from_iterable(wrapped[:2])]
    if picture.chosen:
        lines.insert(1, "   ·   ".join(picture.chosen))
    return headed(width, height + 0.21 * len(lines), picture.title, *lines)


def _draw_critical(picture: SweepPicture) -> "Figure":
    compared = np.isfinite(picture["critical"] - picture["critical_eigenvalue"]).any()
    if picture.critical is None or picture.critical.method is not Method.SIMULATION or not compared:
        figure = _headed(picture, _WIDTH, 5.2)
        draw_critical(figure.subplots(), picture)
        return figure
    figure = _headed(picture, _WIDTH, 6.4)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.2, 1.0))
    draw_critical(upper, picture)
    draw_difference(lower, picture)
    upper.label_outer()
    figure.align_ylabels()
    return figure


def _draw_motion(picture: SweepPicture) -> "Figure":
    figure = _headed(picture, _WIDTH, 6.4)
    panels = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
    for axes, name in zip(panels, ("amplitude", "frequency"), strict=True):
        draw_motion(axes, picture, name)
        axes.label_outer()
    figure.align_ylabels()
    return figure


def _draw_maps(picture: SweepPicture) -> "Figure":
    rows = len(picture.directions)
    figure = _headed(picture, _MAP_WIDTH, 1.0 + 3.9 * rows)
    panels = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    factor, norm = amplitude_unit(picture)[0], amplitude_norm(picture)
    for number, direction in enumerate(picture.directions):
        way = f" on the way {direction}" if direction else ""
        regime, amplitude = panels[number]
        draw_regimes(regime, picture, number)
        mesh = draw_amplitude(amplitude, picture, factor, norm, number)
        regime.set_title(f"Regime{way}")
        amplitude.set_title(f"Amplitude{way}")
        regime.label_outer()
        amplitude.label_outer()
    _add_colours(figure, mesh, panels, *_amplitude_label(picture))
    return figure


def _draw_critical_map(picture: SweepPicture) -> "Figure":
    figure = _headed(picture, _WIDTH, 5.8)
    axes = figure.subplots()
    mesh = draw_critical_map(axes, picture, critical_norm(picture))
    _add_colours(figure, mesh, axes, critical_label(picture), (False, False))
    return figure


def _draw_slices(picture: SweepPicture) -> "Figure":
    """Maps side by side, one for each value of the shortest axis, or of one of texts."""
    lengths = [len(axis.values) for axis in picture.axes]
    short = [number for number in range(3) if lengths[number] <= MOST_PANELS]
    sliced = min(short, key=lambda number: (picture.axes[number].texts is None, lengths[number], -number))
    count = lengths[sliced]
    slices = [picture.at(sliced, place) for place in range(count)]
    width = max(_MAP_WIDTH, 1.2 + _PANEL_WIDTH * count)
    names = [picture.axes[sliced].named(place) for place in range(count)]
    if picture.critical is not None:
        figure = _headed(picture, width, 4.6)
        panels = figure.subplots(1, count, sharex=True, sharey=True, squeeze=False)
        norm: Normalize = critical_norm(picture)
        meshes = [draw_critical_map(axes, each, norm) for axes, each in zip(panels[0], slices, strict=True)]
        _add_colours(figure, meshes[0], panels, critical_label(picture), (False, False))
    else:
        figure = _headed(picture, width, 7.2)
        panels = figure.subplots(2, count, sharex=True, sharey=True, squeeze=False)
        factor, norm = amplitude_unit(picture)[0], amplitude_norm(picture)
        for axes, each in zip(panels[0], slices, strict=True):
            draw_regimes(axes, each)
        meshes = [draw_amplitude(axes, each, factor, norm) for axes, each in zip(panels[1], slices, strict=True)]
        _add_colours(figure, meshes[0], panels[1], *_amplitude_label(picture))
    for axes, name in zip(panels[0], names, strict=True):
        axes.set_title(name if len(name) < _LONG_TITLE else name.replace(" = ", "\n= "), parse_math=False)
    for axes in panels.flat:
        axes.label_outer()
    return figure


def _amplitude_label(picture: SweepPicture) -> tuple[str, tuple[bool, bool]]:
    """What the colours of amplitudes mean, and whether some lie below or above them."""
    factor, unit = amplitude_unit(picture)
    norm, drawn = amplitude_norm(picture), factor * picture["amplitude"]
    drawn = drawn[np.isfinite(drawn)]
    beyond = (bool((drawn < norm.vmin).any()), bool((drawn > 1.0001 * norm.vmax).any()))  # type: ignore[operator]
    return f"amplitude ({unit})", beyond


def _add_colours(
    figure: "Figure", mesh: "ScalarMappable", panels: Any, label: str, beyond: tuple[bool, bool]
) -> None:
    from matplotlib.colors import LogNorm

    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[beyond]
    low, high = (value or 0.0 for value in mesh.get_clim())
    ticks: dict[str, Any] = {}
    if isinstance(mesh.norm, LogNorm):
        locator, formatter = log_ticks(high / low)
        ticks = {"ticks": locator, "format": formatter}
    bar = figure.colorbar(mesh, ax=panels, extend=extend, aspect=30, pad=0.015, **ticks)
    bar.minorticks_off()
    if not ticks:
        set_ticks(bar.ax.yaxis, max(abs(low), abs(high)))
    bar.set_label(label, parse_math=False)
    bar.outline.set_visible(False)


def _add_legend(figure: "Figure") -> None:
    """All that the panels name, each name once, in as few rows as fit below the heading."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(text, handle)
    if not entries:
        return
    order = [*map(str, REGIME_COLOURS), "by simulation", "by eigenvalues"]
    texts = sorted(entries, key=lambda text: order.index(text) if text in order else len(order))
    (width, height), columns = figure.get_size_inches(), len(texts)
    while columns > 1 and _columns_width(texts, columns) > width - 0.4:
        columns -= 1
    engine = layout(figure)
    left, bottom, wide, high = engine.get()["rect"]
    look: dict[str, Any] = {
        "ncols": columns,
        "frameon": False,
        "borderaxespad": 0.0,
        "borderpad": 0.0,
        "columnspacing": 1.6,
    }
    handles, at = [entries[text] for text in texts], (0.125 / width, bottom + high)
    figure.legend(handles, texts, loc="upper left", bbox_to_anchor=at, **look).set_in_layout(False)
    taken = (0.19 * -(-len(texts) // columns) + 0.09) / height
    engine.set(rect=(left, bottom, wide, high - taken))


def _columns_width(texts: list[str], columns: int) -> float:
    """About how wide (inches) texts are in a legend of so many columns."""
    rows = -(-len(texts) // columns)
    widths = [max(map(len, texts[first : first + rows])) for first in range(0, len(texts), rows)]
    return sum(0.075 * width + 0.45 for width in widths)
