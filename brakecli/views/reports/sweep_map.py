"""The map of a sweep on a page: cells in colour, and the values of each point for pointer and keyboard."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex

from brakecli.analysis.regime.decision import Regime
from brakecli.views.plots import style
from brakecli.views.plots.axis import Axis
from brakecli.views.plots.maps import slices
from brakecli.views.plots.sweep import REGIMES, SweepPicture
from brakecli.views.reports.blocks import Map, Side, shown

MOST = 10_000  # points whose values are on the page
_WORDY = 2000  # up to here with the reasons, and with five digits
_NONE = "#f2f2f2"
_LETTERS = {Regime.RELAXATION: "R", Regime.QUASI_HARMONIC: "Q", Regime.UNDECIDED: "?"}  # colours are alike in grey


def maps(picture: SweepPicture, names: list[str]) -> Iterator[Map]:
    """A map for each direction and each value of a third axis; none where there are too many points."""
    size = picture["status"].size
    names = names if size <= _WORDY else [name for name in names if name != "reason"]
    for way in picture.directions if size <= MOST else ():
        piece = picture.towards(way)
        for title, layer in slices(piece) if len(piece.axes) == 3 else [("", piece)]:
            titles = [f"on the way {way}"] * bool(way) + [title] * bool(title)
            yield _map(layer, names, ", ".join(titles))


def _map(picture: SweepPicture, names: list[str], title: str) -> Map:
    x = _side(picture.axes[0], 400.0)
    flat = len(picture.axes) == 1
    y = Side("", [0.0, 40.0], [""], [""]) if flat else _side(picture.axes[1], 260.0, upwards=True)
    shape = len(x.values), len(y.values)
    colours, legend = _colours(picture)
    cells: dict[str, list[str]] = {}
    letters = []
    for i, j in product(*map(range, shape)):
        x_low, x_high = x.edges[i : i + 2]
        one, other = y.edges[j : j + 2]
        low = min(one, other)
        high = max(one, other)
        cell = f"M{x_low:.4g} {low:.4g}H{x_high:.4g}V{high:.4g}H{x_low:.4g}z"
        cells.setdefault(colours.reshape(shape)[i, j], []).append(cell)
        letter = _LETTERS.get(picture["regime"].reshape(shape)[i, j], "") if picture.critical is None else ""
        if letter and min(x_high - x_low, high - low) > 11.0:  # so that it holds a letter
            letters.append((0.5 * (x_low + x_high), 0.5 * (low + high) + 4.0, letter))
    columns = {}
    for name in names:
        values = picture[name].reshape(shape)
        unit = picture.units.get(name, "")
        columns[name.replace("_", " ")] = _numbers(values, unit) if values.dtype.kind in "iuf" else _texts(values)
    names_of_axes = [x.label, y.label]
    data = {"x": x.edges, "y": y.edges, "xs": x.values, "ys": y.values, "names": names_of_axes, "columns": columns}
    return Map(title, x, y, [(colour, "".join(paths)) for colour, paths in cells.items()], letters, legend, data)


def _side(axis: Axis, length: float, upwards: bool = False) -> Side:
    """The cells of an axis from 0 to a length; upwards the first one is at the bottom."""
    edges = np.log(axis.edges) if axis.logarithmic else axis.edges
    edges = length * (edges - edges[0]) / (edges[-1] - edges[0])
    edges = length - edges if upwards else edges
    factor, unit = style.prefixed(style.largest(axis.values), axis.units)
    texts = list(axis.texts or (style.readable(factor * float(value), axis.digits) for value in axis.values))
    short = list(axis.texts or (style.readable(float(f"{factor * value:.3g}")) for value in axis.values))
    short = short if len({*short}) == len(short) else texts
    return Side(style.labelled(axis.key, unit), [round(float(edge), 2) for edge in edges], texts, short)


def _colours(picture: SweepPicture) -> tuple[style.Array, list[tuple[str, str]]]:
    """The colour of every point, and what colours mean."""
    if picture.critical is None:
        colour_of = {str(regime): colour for regime, (colour, _) in REGIMES.items()} | {"": _NONE}
        regimes = picture["regime"].astype(str)
        present = [name for name in colour_of if (regimes == name).any()]
        legend = [(colour_of[name], name or "failed") for name in present]
        return np.vectorize(colour_of.get, otypes=[object])(regimes), legend
    values = picture["critical"]
    shades = colormaps["cividis"]
    there = values[np.isfinite(values)]
    low, high = (float(there.min()), float(there.max())) if there.size else (0.0, 1.0)
    steps = 31  # from one shade to the next
    level = np.round(np.nan_to_num((values - low) / ((high - low) or 1.0)) * steps) / steps
    colours = np.vectorize(lambda fraction: to_hex(shades(float(fraction))), otypes=[object])(level)
    unit = picture.units["critical"]
    ends = [(to_hex(shades(end)), shown(float(f"{value:.4g}"), unit)) for end, value in ((0.0, low), (1.0, high))]
    return np.where(np.isfinite(values), colours, _NONE), [*ends, (_NONE, "none found")]


def _numbers(values: style.Array, unit: str) -> dict[str, object]:
    """Numbers in the unit of the largest, with the digits that a reader needs; null where there is none."""
    factor, unit = style.prefixed(style.largest(values), unit)
    digits = 5 if values.size <= _WORDY else 4

    def shortened(x: float) -> float | None:
        return float(f"{factor * x:.{digits}g}") if np.isfinite(x) else None

    return {"unit": unit, "values": [[*map(shortened, row)] for row in values.tolist()]}


def _texts(values: style.Array) -> dict[str, object]:
    """Texts, each of them once, and the number of the text of each point."""
    texts, places = np.unique(values, return_inverse=True)
    return {"texts": texts.tolist(), "values": places.reshape(values.shape).tolist()}
