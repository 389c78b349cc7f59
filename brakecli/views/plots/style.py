"""The look that all pictures share: colours, heading, units, ticks, and the bytes of a picture's file."""

import math
import textwrap
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from itertools import pairwise
from typing import Any, TypedDict

import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, LogFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError
from brakecli.results.field import labelled as labelled
from brakecli.results.read import StoredResult
from brakecli.results.write import FILL
from brakecli.views.render import prefixed as prefixed

Array = NDArray[Any]
Columns = dict[str, Array]  # by the names of the result

# The colours of Okabe and Ito, which people who do not see red or green can tell apart.
BLUE = "#0072B2"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
GREEN = "#009E73"
GREY = "#9A9A9A"
DARK = "#333333"
NARROW = 4.6  # inches
DASHES: tuple[int, tuple[float, ...]] = 0, (5, 3)  # offset, and lengths on and off in turns
DOTS: tuple[int, tuple[float, ...]] = 0, (1, 1.5)
ROUNDING = 1e-12  # relative difference below which numbers of a computation are the same
WIDE = 300.0  # ratio of the ends of a logarithmic axis from which on only powers of ten have a number
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


class Look(TypedDict, total=False):
    """How a line with its markers is drawn, by Matplotlib's short names."""

    color: str
    ls: str | tuple[int, tuple[float, ...]]
    lw: float
    solid_capstyle: str
    marker: str | None
    ms: float
    mfc: str
    mec: str
    mew: float
    label: str | None
    zorder: float


@contextmanager
def applied(narrow: bool = False, titled: bool = True) -> Iterator[None]:
    """Draw with this style, not the user's own; do not warn of glyphs that the font lacks.

    Figures that are `narrow` have a single column of panels, for a small screen. Those of a page, which has the
    title itself, are not `titled`.
    """
    look: dict[str, object] = {
        "font.size": 9.5,
        "axes.titlesize": 10.5,
        "axes.titlelocation": "left",
        "axes.titlepad": 8.0,
        "axes.edgecolor": "#555555",
        "axes.labelcolor": "#222222",
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.formatter.useoffset": False,
        "axes.formatter.use_mathtext": False,  # a formula takes 5 ms, a text nothing
        "grid.color": "#E4E4E4",
        "grid.linewidth": 0.7,
        "xtick.color": "#444444",
        "ytick.color": "#444444",
        "lines.linewidth": 1.2,
        "legend.framealpha": 0.85,
        "legend.edgecolor": "none",
        "legend.fontsize": 8.5,
        "legend.handlelength": 1.6,
        "svg.hashsalt": "brakecli",  # the same picture gives the same bytes
    }
    look |= {"figure.figsize": (NARROW, NARROW)} if narrow else {}
    look |= {} if titled else {"figure.titlesize": 0.0}
    with matplotlib.style.context(["default", look]), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def rendered(figure: Figure, suffix: str, dpi: int = 150) -> bytes:
    """The figure as a file of this suffix; its bytes do not depend on the time or the machine."""
    every = [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]
    for axis in every:
        if isinstance(axis.get_major_formatter(), LogFormatter):  # it writes formulas
            axis.set_major_formatter(lambda value, _: power_of_ten(value))
    figure.draw_without_rendering()
    for axis in every:
        if axis.get_offset_text().get_text():  # a power of ten, where another text may stand
            axis.set_major_formatter(lambda value, _: readable(value))
            figure.draw_without_rendering()
        thin_ticks(axis, figure)
    figure.set_layout_engine(None)
    for axes in figure.axes:  # the layout's last digits depend on the order in which it solved for them
        axes.set_position(tuple(round(bound, 6) for bound in axes.get_position().bounds))
    stream = BytesIO()
    figure.savefig(stream, format=suffix[1:], dpi=dpi, metadata=_UNDATED.get(suffix))
    return stream.getvalue()


def headed(width: float, height: float, title: str, *lines: str, columns: int = 1, **spacing: float) -> Figure:
    """An empty figure (inches) with a title and lines of text above its panels, which stand in some columns.

    The lines are wrapped to the width; the height counts one line for each.
    """
    if is_narrow():
        width = NARROW
        height = 0.85 * height * columns
    title = title if matplotlib.rcParams["figure.titlesize"] else ""
    bold = {"size": 13, "weight": "bold"}
    plain = {"size": 10.0, "color": "#444444"}
    wrapped = [
        (step, text, look)
        for line, letters, step, look in (
            *(((title, 9.4, 0.29, bold),) if title else ()),
            *((line, 12.3, 0.21, plain) for line in lines),
        )
        for text in textwrap.wrap(line, round(letters * width), max_lines=6, placeholder=" …") or [""]
    ]
    height += sum(step for step, *_ in wrapped) - 0.29 - 0.21 * len(lines)
    figure = Figure(figsize=(width, height))
    below = 0.16
    for step, text, look in wrapped:
        text = text.strip(" ·")  # what stands between two parts does not end a line
        figure.text(0.125 / width, 1.0 - below / height, text, look, va="top", parse_math=False)
        below += step
    rect = (0.05 / width, 0.036 / height, 1.0 - 0.1 / width, 1.0 - (below + 0.096) / height)
    figure.set_layout_engine("constrained", rect=rect, **spacing)
    return figure


def is_narrow() -> bool:
    """Whether figures have a single column."""
    return bool(matplotlib.rcParams["figure.figsize"][0] == NARROW)


def panels(
    figure: Figure,
    rows: int,
    columns: int,
    *,
    width_ratios: Sequence[float] | None = None,
    height_ratios: Sequence[float] | None = None,
    sharex: bool = False,
    sharey: bool = False,
) -> Array:
    """Panels in rows and columns; in a narrow figure all below each other, but in an array of this shape."""
    shape = rows, columns
    if is_narrow():
        shape = rows * columns, 1
        width_ratios = None
        height_ratios = height_ratios and np.repeat(height_ratios, columns).tolist()
    axes = figure.subplots(
        *shape,
        sharex=sharex,
        sharey=sharey,
        squeeze=False,
        width_ratios=width_ratios,
        height_ratios=height_ratios,
    )
    return np.asarray(axes).reshape(rows, columns)


def labels(panels: Iterable[Axes]) -> dict[str, Artist]:
    """What panels label, each label once, with the artist that has it."""
    artists: dict[str, Artist] = {}
    for axes in panels:
        for artist, label in zip(*axes.get_legend_handles_labels(), strict=True):
            artists.setdefault(label, artist)
    return artists


def read_column(result: StoredResult, name: str, group: str = "/") -> Array:
    """A variable of a group; missing numbers are NaN."""
    values = result.read(group, name)
    return np.where(values == FILL, np.nan, values) if values.dtype.kind == "f" else values


def unreadable(result: StoredResult, reason: str) -> UnreadableResultError:
    """The error of a result that lacks what its picture shows."""
    return UnreadableResultError(f"{result.path}: cannot be drawn: {reason}; compute it again")


def largest(values: Array) -> float:
    """The largest magnitude of the finite values, 0 if there are none."""
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def readable(value: float, digits: int = 6) -> str:
    """A number to some digits, with a power of ten where it is large or small."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.{digits}g}".replace("-", "−")
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    factor = mantissa.rstrip("0").rstrip(".").replace("-", "−")
    power = _raised(int(exponent))
    return {"1": power, "−1": f"−{power}"}.get(factor, f"{factor}·{power}")


def power_of_ten(value: float) -> str:
    """A power of ten as such, whatever its size, and any other number as it is easy to read."""
    mantissa, _, exponent = f"{value:.6e}".partition("e")
    return _raised(int(exponent)) if float(mantissa) == 1.0 else readable(value)


def _raised(exponent: int) -> str:
    return "10" + str(exponent).translate(_RAISED)


def digits_of(largest: float, apart: float) -> int:
    """Digits of numbers up to a largest magnitude that tell apart those that differ by so much: 6 at least."""
    return int(np.clip(math.ceil(math.log10(largest / apart)) + 1, 6, 15)) if 0.0 < apart < largest else 6


def density(values: Array, frequency: Array, unit: str) -> tuple[float, str]:
    """The factor of power spectral densities of a quantity in this unit, and what stands at their axis."""
    size = float(np.sqrt(values.max(initial=0.0) * frequency[1:2].max(initial=1.0)))
    factor, unit = prefixed(size, unit)
    squared = f"({unit})²" if set(unit) & {"/", " "} else f"{unit}²" if unit else "1"
    return factor**2, f"power spectral density ({squared}/Hz)"


def unit_of(attributes: Mapping[str, object]) -> str:
    """The unit of a variable; none where it is "1". A dollar sign, with which formulas begin, is left out."""
    units = str(attributes.get("units", "")).replace("$", "")
    return "" if units == "1" else units


def set_ticks(axis: Axis, low: float, high: float, unit: str = "", name: str = "") -> None:
    """Write each tick of an axis from `low` to `high` in full, without a power of ten at the end of the axis.

    The label, if there is a name, has the unit of the numbers at the ticks: with a prefix where they need one.
    """
    logarithmic = axis.get_scale() == "log"
    largest = max(abs(low), abs(high))
    digits = digits_of(max(abs(low), abs(high)), 0.1 * (high - low))
    factor, unit = (1.0, unit) if logarithmic and unit == "Hz" else prefixed(largest, unit)
    if name:
        axis.set_label_text(labelled(name, unit), parse_math=False)
    if logarithmic:
        axis.set_major_locator(log_locator(high / low))
        if high / low < WIDE:
            axis.set_minor_locator(NullLocator())
    elif factor == 1.0 and 1e-2 <= largest < 1e5:
        return
    axis.set_major_formatter(lambda value, _: readable(factor * value, digits))


def widen(axes: Axes, values: Array) -> None:
    """Fit the axis to the values, and keep those that differ too little in its middle."""
    low = np.nanmin(values)
    high = np.nanmax(values)
    alike = 0.02  # values whose relative difference is smaller do not fill the axis from bottom to top
    if high - low < alike * abs(high + low) / 2.0:
        middle = 0.5 * (high + low)
        half = 0.25 * alike * abs(high + low)
        axes.set_ylim(middle - half, middle + half)
    else:
        room = 0.08 * (high - low)
        axes.set_ylim(low - room, high + room)


def make_room(axes: Axes, fraction: float = 0.14) -> None:
    """Leave room for a legend above what is drawn."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + fraction * (high - low))


def keep_flat(axes: Axes, values: Array, scale: float = 0.0) -> None:
    """Draw values that differ by rounding, of numbers as large as they or `scale`, as a line in the middle."""
    finite = values[np.isfinite(values)]
    size = max(largest(finite), scale)
    if finite.size and float(np.ptp(finite)) <= ROUNDING * size:
        middle = float(np.median(finite))
        half = 0.05 * (size or 1.0)
        axes.set_ylim(middle - half, middle + half)


def thin_ticks(axis: XAxis | YAxis, figure: Figure) -> None:
    """Leave out every second tick until the numbers stand apart; the figure has been laid out."""
    while len(places := axis.get_majorticklocs()) > 2:
        side = 0 if axis.axis_name == "x" else 1
        low, high = sorted(axis.get_view_interval())
        boxes = [
            tick.label1.get_window_extent().get_points()[:, side]
            for position, tick in zip(places, axis.get_major_ticks(), strict=False)
            if low <= position <= high and tick.label1.get_visible() and tick.label1.get_rotation() == 0.0
        ]
        gap = 4.0 if side == 0 else 0.0
        if all(after[0] - before[1] >= gap for before, after in pairwise(sorted(boxes, key=lambda box: box[0]))):
            return
        fixed = isinstance(axis.get_major_formatter(), FixedFormatter)
        texts = [text.get_text() for text in axis.get_majorticklabels()][::2] if fixed else None
        axis.set_ticks(places[::2], labels=texts)
        figure.draw_without_rendering()


def log_locator(ratio: float) -> LogLocator:
    """Places of the ticks of a logarithmic axis: at 1, 2 and 5 of each decade where there are few decades."""
    return LogLocator(subs=(1.0, 2.0, 5.0) if ratio < WIDE else (1.0,))
