"""A sweep over two axes, drawn onto given axes: the first one along x, the second along y."""

from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.plots.run import prefixed
from brakecli.plots.style import VERMILION
from brakecli.plots.sweep.curves import cell_edges
from brakecli.plots.sweep.marks import (
    DARK,
    REGIME_COLOURS,
    SUSTAINED,
    differs,
    failed,
    forced,
    missing,
    regimes,
    set_scale,
)
from brakecli.plots.sweep.picture import Array, SweepPicture, labelled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import QuadMesh
    from matplotlib.colors import Normalize

_WIDE = 20.0
"""Ratio of amplitudes from which on their colours are logarithmic."""
_MOST_NUMBERS = 80
_MOST_DRAWN = 4096
"""Cells of a map, up to which each is a shape of its own in a PDF or SVG file."""


def draw_regimes(axes: "Axes", picture: SweepPicture, direction: int = 0) -> None:
    """The regime of each point as a colour. A legend is left to the caller."""
    from matplotlib.colors import ListedColormap

    codes = np.full(picture["regime"].shape, np.nan)
    for code, regime in enumerate(REGIME_COLOURS):
        codes[(picture["regime"] == regime) & (picture["status"] == "done")] = code
    colours = ListedColormap(list(REGIME_COLOURS.values()))
    _mesh(axes, picture, codes[direction], cmap=colours, vmin=-0.5, vmax=len(REGIME_COLOURS) - 0.5)
    for regime, _ in regimes(picture):
        axes.plot([], [], ls="none", marker="s", ms=9, mfc=REGIME_COLOURS[regime], mec="none", label=str(regime))
    if forced(picture).any():
        label = "forced by the wheel's waves"
        _sign(axes, picture, forced(picture)[direction], marker="o", color=DARK, mec="white", label=label)
    if "hysteresis" in picture.variables:
        where = picture["hysteresis"][direction] == 1
        _sign(axes, picture, where, marker="$≠$", color=DARK, label="up and down differ")
    _sign_mark(axes, picture, [failed(picture)], direction)


def draw_amplitude(
    axes: "Axes", picture: SweepPicture, factor: float, norm: "Normalize", direction: int = 0
) -> "ScalarMappable":
    """The amplitude of each point, times `factor`, in the colours of `norm`: see `amplitude_unit` and `…_norm`."""
    mesh = _mesh(axes, picture, factor * picture["amplitude"][direction], cmap="viridis", norm=norm)
    _sign_mark(axes, picture, [failed(picture)], direction)
    return mesh


def amplitude_unit(picture: SweepPicture) -> tuple[float, str]:
    """By what to multiply amplitudes for a unit that makes them easy to read, and its name."""
    return prefixed(_largest(picture), picture.units["amplitude"])


def amplitude_norm(picture: SweepPicture) -> "Normalize":
    """Colours from 0 on, or logarithmic ones if amplitudes that last are of very different size."""
    from matplotlib.colors import LogNorm, Normalize

    factor, _ = amplitude_unit(picture)
    lasting = _lasting(picture)
    if lasting.size and lasting.max() > _WIDE * lasting.min():
        return LogNorm(factor * lasting.min(), factor * lasting.max())
    return Normalize(0.0, factor * _largest(picture) or 1.0)


def draw_critical_map(
    axes: "Axes", picture: SweepPicture, norm: "Normalize", direction: int = 0
) -> "ScalarMappable":
    """The critical value over two axes, in the colours of `norm`, with contours, or numbers where there are few.

    Points without one are marked by the reason. A legend is left to the caller.
    """
    assert picture.critical is not None
    values = picture["critical"][direction]
    mesh = _mesh(axes, picture, values, cmap="cividis", norm=norm)
    if _is_whole(picture, values):
        _draw_contours(axes, picture, values, norm)
    elif values.size <= _MOST_NUMBERS:
        _write_numbers(axes, picture, values, norm)
    if differs(picture).any():
        label = "vibration lasts elsewhere, from the case's own start"
        _sign(axes, picture, differs(picture)[direction], marker="d", color=VERMILION, mec="white", label=label)
    _sign_mark(axes, picture, missing(picture), direction)
    return mesh


def critical_norm(picture: SweepPicture) -> "Normalize":
    """The colours of all critical values."""
    from matplotlib.colors import Normalize

    values = picture["critical"][np.isfinite(picture["critical"])]
    if not values.size:
        assert picture.critical is not None
        return Normalize(picture.critical.lower, picture.critical.upper)
    low, high = float(values.min()), float(values.max())
    least = 0.01 * max(abs(low), abs(high))
    return Normalize(low, high) if high - low > least else Normalize(low - (least or 1.0), high + (least or 1.0))


def critical_label(picture: SweepPicture) -> str:
    """What the colours of critical values mean."""
    assert picture.critical is not None
    return labelled(f"critical {picture.critical.parameter}", picture.units["critical"])


def _mesh(axes: "Axes", picture: SweepPicture, values: Array, **look: Any) -> "QuadMesh":
    """A cell around each point, in the colour of its value; none where it is missing."""
    edges = [cell_edges(axis.values, logarithmic=axis.logarithmic) for axis in picture.axes]
    for side, axis in zip(("x", "y"), picture.axes, strict=True):
        set_scale(axes, side, axis)  # type: ignore[arg-type]
    axes.grid(False)
    axes.set_facecolor("#F7F7F7")
    seams = {"edgecolors": "white", "linewidth": 0.4} if values.size <= 1000 else {"edgecolors": "face"}
    drawn = np.ma.masked_invalid(values.T)
    mesh = axes.pcolormesh(*edges, drawn, **look, **seams, rasterized=values.size > _MOST_DRAWN)
    axes.set_xlim(edges[0][0], edges[0][-1])
    axes.set_ylim(edges[1][0], edges[1][-1])
    return mesh


def _draw_contours(axes: "Axes", picture: SweepPicture, values: Array, norm: "Normalize") -> None:
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import MaxNLocator

    x, y = (axis.values for axis in picture.axes)
    ends = float(np.nanmin(values)), float(np.nanmax(values))
    levels = MaxNLocator(6).tick_values(float(norm.vmin or 0.0), float(norm.vmax or 0.0))
    if not (levels := [level for level in levels if ends[0] < level < ends[1]]):
        return
    lines = axes.contour(x, y, np.ma.masked_invalid(values.T), levels, colors="white", linewidths=1.1)
    lines.set_path_effects([withStroke(linewidth=2.2, foreground="#00000070")])
    for text in lines.clabel(fmt="%g", fontsize=8.5, use_clabeltext=True):
        text.set_path_effects([withStroke(linewidth=2.5, foreground=DARK)])


def _is_whole(picture: SweepPicture, values: Array) -> bool:
    """Whether values are known over most of an area, so that contours tell what they do."""
    if any(axis.texts is not None or len(axis.values) < 3 for axis in picture.axes):
        return False
    known = np.isfinite(values)
    return bool(np.mean(known[1:, 1:] & known[:-1, 1:] & known[1:, :-1] & known[:-1, :-1]) > 0.3)


def _write_numbers(axes: "Axes", picture: SweepPicture, values: Array, norm: "Normalize") -> None:
    for place in np.argwhere(np.isfinite(values)):
        x, y = (axis.values[at] for axis, at in zip(picture.axes, place, strict=True))
        value = values[tuple(place)]
        colour = "white" if norm(value) < 0.6 else "black"
        axes.text(x, y, f"{value:.4g}", ha="center", va="center", size=8.0, color=colour)


def _sign_mark(axes: "Axes", picture: SweepPicture, marks: Any, direction: int) -> None:
    for mark in marks:
        if mark.where.any():
            _sign(axes, picture, mark.where[direction], label=mark.label, **mark.look)


def _sign(axes: "Axes", picture: SweepPicture, where: Any, **look: Any) -> None:
    """A sign in the middle of some cells, small where cells are."""
    places = np.argwhere(where)
    x, y = (axis.values[places[:, number]] for number, axis in enumerate(picture.axes))
    box, scale = axes.get_window_extent(), 72.0 / float(axes.figure.dpi)
    room = min(box.width / len(picture.axes[0].values), box.height / len(picture.axes[1].values)) * scale
    axes.plot(x, y, **{"ls": "none", "ms": float(np.clip(0.4 * room, 1.0, 7.0)), **look})


def _lasting(picture: SweepPicture) -> Array:
    amplitude = picture["amplitude"]
    return amplitude[np.isin(picture["regime"], SUSTAINED) & (amplitude > 0.0)]


def _largest(picture: SweepPicture) -> float:
    """The largest amplitude that lasts, or else the largest (m)."""
    amplitude = picture["amplitude"]
    lasting = _lasting(picture)
    if lasting.size:
        return float(lasting.max())
    return float(np.max(amplitude, where=np.isfinite(amplitude), initial=0.0))
