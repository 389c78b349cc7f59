"""The look that all pictures share: colours, heading, units, ticks, legend, and the bytes of a picture's file."""

import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError
from brakecli.files.read import StoredResult

Array = NDArray[np.float64]

# The colours of Okabe and Ito, which people who do not see red or green can tell apart.
BLUE, ORANGE, VERMILION, GREEN, GREY = "#0072B2", "#E69F00", "#D55E00", "#009E73", "#9A9A9A"
DARK = "#333333"
DASHES = (0, (5, 3))
WIDE = 300.0
"""Ratio of the ends of a logarithmic axis from which on only powers of ten have a number."""
_SMALL, _LARGE = 1e-2, 1e5
"""Values of an axis outside these limits are written with powers of ten."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_STYLE = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.titlepad": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.labelcolor": "#222222",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.7,
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "lines.linewidth": 1.2,
    "lines.solid_joinstyle": "round",
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.fontsize": 8.5,
    "legend.handlelength": 1.6,
    "svg.hashsalt": "brakecli",  # the same picture gives the same bytes
}
_UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


@contextmanager
def applied() -> Iterator[None]:
    """Draw with this style, not the user's own; do not warn of glyphs that the font lacks."""
    with matplotlib.style.context(["default", _STYLE]), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def rendered(figure: Figure, suffix: str) -> bytes:
    """The figure as a file of this suffix; its bytes do not depend on the time or the machine."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:  # the layout's last digits depend on the order in which it solved for them
        axes.set_position(tuple(round(bound, 6) for bound in axes.get_position().bounds))
    stream = BytesIO()
    figure.savefig(stream, format=suffix[1:], dpi=150, metadata=_UNDATED.get(suffix))
    return stream.getvalue()


def headed(width: float, height: float, title: str, *lines: str, **spacing: float) -> Figure:
    """An empty figure (inches) with a title and lines of text above its panels, each cut to the width."""
    figure = Figure(figsize=(width, height))
    top = 1.0 - 0.16 / height
    text = textwrap.shorten(title, round(9.4 * width), placeholder=" …")
    figure.text(0.125 / width, top, text, size=13, weight="bold", va="top", parse_math=False)
    for number, line in enumerate(lines):
        text, below = textwrap.shorten(line, round(12.3 * width), placeholder=" …"), 0.29 + 0.21 * number
        at = (0.125 / width, top - below / height)
        figure.text(*at, text, size=10.0, color="#444444", va="top", parse_math=False)
    used = (0.51 + 0.21 * len(lines)) / height
    rect = (0.05 / width, 0.036 / height, 1.0 - 0.1 / width, 1.0 - used - 0.036 / height)
    figure.set_layout_engine("constrained", rect=rect, **spacing)
    return figure


def labels(figure: Figure) -> dict[str, Any]:
    """What the panels label, each label once, with the artist that has it."""
    found: dict[str, Any] = {}
    for axes in figure.axes:
        for artist, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, artist)
    return found


def add_legend_above(figure: Figure, first: Sequence[str]) -> None:
    """Add all labels, those in `first` first, in as few rows as fit between the heading and the panels."""
    artists = labels(figure)
    if not artists:
        return
    texts = sorted(artists, key=lambda text: first.index(text) if text in first else len(first))
    (width, height), columns = figure.get_size_inches(), len(texts)
    while columns > 1 and _legend_width(texts, columns) > width - 0.4:
        columns -= 1
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    left, bottom, wide, high = engine.get()["rect"]
    look: dict[str, Any] = {"frameon": False, "borderaxespad": 0.0, "borderpad": 0.0, "columnspacing": 1.6}
    look |= {"loc": "upper left", "bbox_to_anchor": (0.125 / width, bottom + high), "ncols": columns}
    figure.legend([artists[text] for text in texts], texts, **look).set_in_layout(False)
    taken = (0.19 * -(-len(texts) // columns) + 0.09) / height
    engine.set(rect=(left, bottom, wide, high - taken))


def _legend_width(texts: list[str], columns: int) -> float:
    """Approximate width (inches) of a legend with this number of columns, filled as Matplotlib fills them."""
    longest = [max(map(len, column)) for column in np.array_split(texts, columns)]
    return sum(0.075 * length + 0.45 for length in longest)


def unreadable(result: StoredResult, reason: str) -> UnreadableResultError:
    """The error of a result that lacks what its picture shows."""
    return UnreadableResultError(f"{result.path}: cannot be drawn: {reason}; compute it again")


def write_inside(axes: Axes, words: str) -> None:
    """Write in the middle of a panel why it is empty."""
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", color="#666666")


def largest(values: Array) -> float:
    """The largest magnitude of the finite values, 0 if there are none."""
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def prefixed(magnitude: float, unit: str) -> tuple[float, str]:
    """The factor for values up to this magnitude that makes them easy to read, and the unit with its SI prefix."""
    if 0.0 < magnitude < 1e6:
        for exponent, prefix in ((3, "k"), (0, ""), (-3, "m"), (-6, "µ"), (-9, "n"), (-12, "p")):
            if magnitude >= 10.0**exponent:
                return 10.0**-exponent, prefix + unit
    return 1.0, unit


def readable(value: float) -> str:
    """A number to six digits, with a power of ten where it is large or small."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.6g}".replace("-", "−")
    mantissa, _, exponent = f"{value:.5e}".partition("e")
    digits = mantissa.rstrip("0").rstrip(".").replace("-", "−")
    power = "10" + str(int(exponent)).translate(_RAISED)
    return {"1": power, "−1": f"−{power}"}.get(digits, f"{digits}·{power}")


def labelled(name: str, units: str) -> str:
    """A name and its unit; the unit "1" is not written."""
    return f"{name} ({units})" if units not in ("", "1") else name


def set_ticks(axis: Axis, magnitude: float) -> None:
    """Write each tick of a linear axis in full, without a power of ten at the end of the axis."""
    if not _SMALL <= magnitude < _LARGE:
        axis.set_major_formatter(lambda value, _: readable(value))


def set_log_ticks(axis: Axis, ratio: float) -> None:
    """Ticks of a logarithmic axis, one end of which is `ratio` times the other."""
    axis.set_major_locator(log_locator(ratio))
    axis.set_major_formatter(lambda value, _: readable(value))
    if ratio < WIDE:
        axis.set_minor_locator(NullLocator())


def log_locator(ratio: float) -> LogLocator:
    """Places of the ticks of a logarithmic axis: at 1, 2 and 5 of each decade where there are few decades."""
    return LogLocator(subs=(1.0, 2.0, 5.0) if ratio < WIDE else (1.0,))
