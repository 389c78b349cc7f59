"""The picture of a sweep over two axes, or over three: maps, the first axis along x, the second along y."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.studies.sweeps.record import Status
from brakecli.views.plots import style, sweep
from brakecli.views.plots.sweep import Sign, SweepPicture

_EMPTY = "#F7F7F7"  # of cells without a value


class Scale(NamedTuple):
    """The colours of numbers times `factor`, the same in all maps of a figure."""

    label: str
    norm: Normalize
    factor: float = 1.0
    extend: str = "neither"


def draw(picture: SweepPicture) -> Figure:
    """The figure of a sweep over two axes, or over three: then a column of maps for each value of one of them."""
    critical = picture.critical is not None
    sliced = len(picture.axes) == 3
    chosen = picture.shown if picture.shown != sweep.ATTRACTOR else ""  # it has a map of its own
    shown = chosen or ("critical" if critical else "amplitude")
    scale = _amplitude_scale(picture) if shown == "amplitude" else _scale(picture, shown)
    draw_shown = _draw_critical if shown == "critical" else partial(_draw_numbers, name=shown)
    layers: dict[str, Callable[[Axes, SweepPicture, Scale], ScalarMappable]]
    layers = {"" if critical else shown.replace("_", " ").capitalize(): draw_shown}
    starts = {"Attractor": _draw_attractors} if picture.attractors else {"Regime": _draw_regimes}
    layers = layers if critical else {**starts, **layers}
    two_maps = 10.4  # inches
    if sliced:
        pieces = slices(picture)
        width = max(two_maps, 1.2 + 3.0 * len(pieces))
        height = 4.6 if critical else 7.2
    else:
        pieces = [(f" on the way {way}" if way else "", picture.towards(way)) for way in picture.directions]
        width, height = (sweep.WIDTH, 5.8) if critical else (two_maps, 1.0 + 3.9 * len(pieces))
    shape = (len(layers), len(pieces)) if sliced else (len(pieces), len(layers))
    figure = picture.figure(width, height, shape[1])
    panels = style.panels(figure, *shape, sharex=True, sharey=True)
    for row, (name, piece) in zip(panels.T if sliced else panels, pieces, strict=True):
        for axes, (layer, draw_layer) in zip(row, layers.items(), strict=True):
            mesh = draw_layer(axes, piece, scale)
            axes.label_outer()
            if not sliced or axes is row[0]:
                axes.set_title(name if sliced else layer + name, parse_math=False)
    if np.ma.getmaskarray(np.ma.asarray(mesh.get_array())).all():  # no colour means anything
        for axes in panels[-1] if sliced else panels[:, -1]:
            axes.text(0.5, 0.5, "no values to draw", transform=axes.transAxes, ha="center", color="#444444")
        sweep.add_legend(figure)
        return figure
    bar = figure.colorbar(mesh, ax=panels[-1] if sliced else panels, extend=scale.extend, aspect=30, pad=0.015)
    low, high = (value or 0.0 for value in mesh.get_clim())
    style.set_ticks(bar.ax.yaxis, low, high)
    bar.minorticks_off()
    bar.set_label(scale.label, parse_math=False)
    bar.outline.set_visible(False)
    sweep.add_legend(figure)
    return figure


def slices(picture: SweepPicture) -> list[tuple[str, SweepPicture]]:
    """Title and picture for each value of the shortest axis, or of an axis of texts if there is one."""
    lengths = [len(axis.values) for axis in picture.axes]
    short = [number for number in range(3) if lengths[number] <= sweep.MOST_PANELS]
    sliced = min(short, key=lambda number: (picture.axes[number].texts is None, lengths[number], -number))
    pieces = [(picture.axes[sliced].named(index), picture.at(sliced, index)) for index in range(lengths[sliced])]
    # a title of more letters takes two lines
    return [(name if len(name) < 34 else name.replace(" = ", "\n= "), piece) for name, piece in pieces]


def _amplitude_scale(picture: SweepPicture) -> Scale:
    """Colours from 0 on, or logarithmic ones if amplitudes that last are of very different size."""
    least, largest, wide = picture.lasting_amplitudes()
    largest = largest or style.largest(picture["amplitude"][~picture.died("amplitude")])
    factor, unit = style.prefixed(largest, picture.units["amplitude"])
    low = factor * least if wide else 0.0
    high = factor * largest or 1.0
    drawn = factor * picture["amplitude"][~picture.died("amplitude")]
    beyond = int((drawn < low).any()) + 2 * int((drawn > 1.0001 * high).any())
    norm = LogNorm(low, high) if wide else Normalize(low, high)
    return Scale(f"amplitude ({unit})", norm, factor, ("neither", "min", "max", "both")[beyond])


def _scale(picture: SweepPicture, name: str) -> Scale:
    """Colours from the least to the greatest number; numbers that hardly differ have one colour."""
    critical = picture.critical
    unit = picture.units[name]
    drawn = np.isfinite(picture[name])
    values = picture[name][drawn & ~picture.died(name)] if name == "frequency" else picture[name][drawn]
    words = name.replace("_", " ")
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)
    if name == "critical" and critical is not None:
        words = f"critical {critical.parameter}"
        low, high = (low, high) if values.size else (critical.lower, critical.upper)
    largest = max(abs(low), abs(high))
    alike = 1e-2 if name == "critical" else 1e-6
    if high - low <= alike * largest:
        low = low - (0.01 * largest or 1.0)
        high = high + (0.01 * largest or 1.0)
    factor, unit = style.prefixed(largest, unit)
    return Scale(style.labelled(words, unit), Normalize(factor * low, factor * high), factor)


def _draw_regimes(axes: Axes, picture: SweepPicture, _: Scale) -> ScalarMappable:
    codes = np.full(picture["regime"].shape, np.nan)
    for code, (regime, (colour, _marker)) in enumerate(sweep.REGIMES.items()):
        marker = "X" if regime == Regime.UNDECIDED else "s"  # its cells have a cross
        if (where := picture["regime"] == regime).any():
            codes[where] = code
            axes.plot([], [], marker, ms=9, mfc=colour, mec="none", label=str(regime))
    colours = ListedColormap([colour for colour, _marker in sweep.REGIMES.values()])
    shaken: style.Look = {"marker": "o", "color": style.DARK, "mec": "white", "label": sweep.FORCED}
    different: style.Look = {"marker": "$≠$", "color": style.DARK, "label": sweep.DIFFERENT}
    open_: style.Look = {"marker": "x", "color": style.DARK, "label": "_"}  # its grey is that of relaxation
    signs = [
        Sign(picture["excitation"] == Excitation.FORCED, shaken),
        Sign(picture["hysteresis"], different),
        Sign(picture["regime"] == Regime.UNDECIDED, open_),
        picture.failed(),
    ]
    norm = Normalize(-0.5, len(sweep.REGIMES) - 0.5)
    mesh = _mesh(axes, picture, codes, *signs, cmap=colours, norm=norm)
    x, y = (axis for axis, _ in picture.plane)
    if sweep.MARGIN in picture.variables and min(map(len, (x.values, y.values))) > 1 and not (x.texts or y.texts):
        margin = np.ma.masked_invalid(picture[sweep.MARGIN][0].T)
        if margin.min() < 0.0 < margin.max():
            lines = [style.DASHES]
            axes.contour(x.values, y.values, margin, [0.0], colors="black", linewidths=1.8, linestyles=lines)
            axes.plot([], [], color="black", lw=1.8, ls=style.DASHES, label=sweep.CRITICAL_LINE)
    return mesh


def _draw_attractors(axes: Axes, picture: SweepPicture, _: Scale) -> ScalarMappable:
    """A colour for each attractor; the legend says what it is."""
    numbers = picture[sweep.ATTRACTOR]
    count = len(picture.attractors)
    colours = ListedColormap(sweep.shades(count))
    for number, label in enumerate(picture.attractors[: sweep.MOST_NAMED]):
        axes.plot([], [], "s", ms=9, mfc=colours(number), mec="none", label=label)
    open_: style.Look = {"marker": "x", "color": style.DARK, "label": sweep.UNKNOWN}
    nothing = (numbers == 0) & (picture["status"] == Status.DONE)
    values = np.where(numbers > 0, numbers, np.nan)
    norm = Normalize(0.5, count + 0.5)
    return _mesh(axes, picture, values, Sign(nothing, open_), picture.failed(), cmap=colours, norm=norm)


def _draw_numbers(axes: Axes, picture: SweepPicture, scale: Scale, name: str) -> ScalarMappable:
    died = picture.died(name)
    values = np.where(died, np.nan, scale.factor * picture[name])
    if died.any():  # its cells are empty
        axes.plot([], [], "s", ms=9, mfc=_EMPTY, mec=style.GREY, label="damped: nothing lasts")
    empty: style.Look = {"marker": ".", "color": style.GREY, "label": "no value"}
    nothing = np.isnan(values) & ~died & (picture["status"] == Status.DONE)
    return _mesh(axes, picture, values, Sign(nothing, empty), picture.failed(), cmap="viridis", norm=scale.norm)


def _draw_critical(axes: Axes, picture: SweepPicture, scale: Scale) -> ScalarMappable:
    """The critical value with contours, or with numbers where there are few; points without one are marked."""
    label = "vibration lasts elsewhere, from the case's own start"
    elsewhere: style.Look = {"marker": "d", "color": style.VERMILION, "mec": "white", "label": label}
    signs = Sign(picture.differs(), elsewhere), *picture.missing()
    mesh = _mesh(axes, picture, scale.factor * picture["critical"], *signs, cmap="cividis", norm=scale.norm)
    if picture.listed:
        return mesh
    values = scale.factor * picture["critical"][0]
    finite = np.isfinite(values)
    areas = finite[1:, 1:] & finite[:-1, 1:] & finite[1:, :-1] & finite[:-1, :-1]
    numeric = all(axis.texts is None and len(axis.values) >= 3 for axis in picture.axes)
    if numeric and np.mean(areas) > 0.3:  # of the cells have known corners, so that lines say more than numbers
        _draw_contours(axes, picture, values, scale.norm)
        return mesh
    width = axes.get_window_extent().width / axes.figure.dpi
    if values.size <= 80 and width > 0.5 * len(values):  # inches, as a number is wide
        for i, j in np.argwhere(finite):
            x = picture.axes[0].values[i]
            y = picture.axes[1].values[j]
            value = values[i, j]
            colour = "white" if scale.norm(value) < 0.6 else "black"  # on the dark part of the colours
            axes.text(x, y, f"{value:.4g}", ha="center", va="center", size=8.0, color=colour)
    return mesh


def _mesh(
    axes: Axes, picture: SweepPicture, values: style.Array, *signs: Sign, cmap: str | Colormap, norm: Normalize
) -> ScalarMappable:
    """A cell around each point, in the colour of its value, none where it is missing; with signs in the middle.

    Listed points fill no grid: each is a dot.
    """
    (x, across), (y, up) = picture.plane
    x.apply_to(axes.xaxis)
    y.apply_to(axes.yaxis)
    if picture.listed:
        size = sweep.size_of(values.size, 8.0)
        area = size**2
        drawn = np.ma.masked_invalid(values[0])
        none = np.ma.getmaskarray(drawn)
        axes.scatter(across[none], up[none], area, fc=_EMPTY, ec=style.GREY, linewidths=0.6)
        mesh: ScalarMappable = axes.scatter(
            across, up, area, drawn, cmap=cmap, norm=norm, ec=style.DARK, linewidths=0.6
        )
        size *= 0.6
    else:
        axes.grid(False)
        axes.set_facecolor(_EMPTY)
        drawn = np.ma.masked_invalid(values[0].T)
        seams = {"edgecolors": "white", "linewidth": 0.4} if drawn.size <= 1000 else {"edgecolors": "face"}
        many = drawn.size > 4096  # for shapes of their own in a PDF or SVG file
        mesh = axes.pcolormesh(x.edges, y.edges, drawn, cmap=cmap, norm=norm, rasterized=many, **seams)
        axes.set(xlim=x.edges[[0, -1]], ylim=y.edges[[0, -1]])
        # signs are small where cells are
        box = axes.get_window_extent()
        scale = 72.0 / float(axes.figure.dpi)
        size = float(np.clip(0.4 * min(box.width / len(x.values), box.height / len(y.values)) * scale, 1.0, 7.0))
    for where, sign in signs:
        if where.any():  # drawn above contours
            look: style.Look = {"ls": "none", "ms": size, "zorder": 2.1, **sign}
            axes.plot(across[where[0]], up[where[0]], **look)
    return mesh


def _draw_contours(axes: Axes, picture: SweepPicture, values: style.Array, norm: Normalize) -> None:
    x, y = (axis.values for axis in picture.axes)
    levels = MaxNLocator(6).tick_values(float(norm.vmin or 0.0), float(norm.vmax or 0.0))
    if not (levels := [level for level in levels if np.nanmin(values) < level < np.nanmax(values)]):
        return
    lines = axes.contour(x, y, np.ma.masked_invalid(values.T), levels, colors="white", linewidths=1.1)
    lines.set_path_effects([withStroke(linewidth=2.2, foreground="#00000070")])
    for text in lines.clabel(fmt="%g", fontsize=8.5, use_clabeltext=True):
        text.set_path_effects([withStroke(linewidth=2.5, foreground=style.DARK)])
