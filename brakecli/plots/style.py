"""The look that all pictures share: colours, heading, units, ticks, and the bytes of a picture's file."""

import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError
from brakecli.files.read import StoredResult
from brakecli.files.write import FILL

Array = NDArray[Any]

# The colours of Okabe and Ito, which people who do not see red or green can tell apart.
BLUE, ORANGE, VERMILION, GREEN, GREY = "#0072B2", "#E69F00", "#D55E00", "#009E73", "#9A9A9A"
DARK = "#333333"
DASHES, DOTS = (0, (5, 3)), (0, (1, 1.5))
WIDE = 300.0  # ratio of the ends of a logarithmic axis from which on only powers of ten have a number
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LOOK: tuple[tuple[str, dict[str, Any]], ...] = (
    ("font", {"size": 9.5}),
    ("axes", {"titlesize": 10.5, "titlelocation": "left", "titlepad": 8.0}),
    ("axes", {"edgecolor": "#555555", "labelcolor": "#222222", "grid": True, "axisbelow": True}),
    ("axes.spines", {"top": False, "right": False}),
    ("axes.formatter", {"useoffset": False, "use_mathtext": True}),
    ("grid", {"color": "#E4E4E4", "linewidth": 0.7}),
    ("xtick", {"color": "#444444"}),
    ("ytick", {"color": "#444444"}),
    ("lines", {"linewidth": 1.2}),
    ("legend", {"framealpha": 0.85, "edgecolor": "none", "fontsize": 8.5, "handlelength": 1.6}),
    ("svg", {"hashsalt": "brakecli"}),  # the same picture gives the same bytes
)
_UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


@contextmanager
def applied() -> Iterator[None]:
    """Draw with this style, not the user's own; do not warn of glyphs that the font lacks."""
    look = {f"{group}.{key}": value for group, values in _LOOK for key, value in values.items()}
    with matplotlib.style.context(["default", look]), warnings.catch_warnings():
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
    """An empty figure (inches) with a title and lines of text above its panels.

    The lines are wrapped to the width; the height counts one line for each.
    """
    bold, plain = {"size": 13, "weight": "bold"}, {"size": 10.0, "color": "#444444"}
    wrapped = [
        (step, text, look)
        for line, letters, step, look in ((title, 9.4, 0.29, bold), *((line, 12.3, 0.21, plain) for line in lines))
        for text in textwrap.wrap(line, round(letters * width), max_lines=6, placeholder=" …") or [""]
    ]
    height += sum(step for step, *_ in wrapped) - 0.29 - 0.21 * len(lines)
    figure, below = Figure(figsize=(width, height)), 0.16
    for step, text, look in wrapped:
        figure.text(0.125 / width, 1.0 - below / height, text, look, va="top", parse_math=False)
        below += step
    rect = (0.05 / width, 0.036 / height, 1.0 - 0.1 / width, 1.0 - (below + 0.096) / height)
    figure.set_layout_engine("constrained", rect=rect, **spacing)
    return figure


def labels(figure: Figure) -> dict[str, Any]:
    """What the panels label, each label once, with the artist that has it."""
    found: dict[str, Any] = {}
    for axes in figure.axes:
        for artist, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, artist)
    return found


def read_column(result: StoredResult, name: str) -> Array:
    """A variable of the root; missing numbers are NaN."""
    values = result.read("/", name)
    return np.where(values == FILL, np.nan, values) if values.dtype.kind == "f" else values


def unreadable(result: StoredResult, reason: str) -> UnreadableResultError:
    """The error of a result that lacks what its picture shows."""
    return UnreadableResultError(f"{result.path}: cannot be drawn: {reason}; compute it again")


def largest(values: Array) -> float:
    """The largest magnitude of the finite values, 0 if there are none."""
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def prefixed(magnitude: float, unit: str) -> tuple[float, str]:
    """The factor for values up to this magnitude that makes them easy to read, and the unit with its SI prefix."""
    for exponent, prefix in ((3, "k"), (0, ""), (-3, "m"), (-6, "µ"), (-9, "n"), (-12, "p")):
        if 10.0**exponent <= magnitude < 1e6:
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
    """A name and its unit, if there is one."""
    return f"{name} ({units})" if units else name


def set_ticks(axis: Axis, low: float, high: float) -> None:
    """Write each tick of an axis from `low` to `high` in full, without a power of ten at the end of the axis."""
    if axis.get_scale() == "log":
        axis.set_major_locator(log_locator(high / low))
        if high / low < WIDE:
            axis.set_minor_locator(NullLocator())
    elif 1e-2 <= max(abs(low), abs(high)) < 1e5:
        return
    axis.set_major_formatter(lambda value, _: readable(value))


def log_locator(ratio: float) -> LogLocator:
    """Places of the ticks of a logarithmic axis: at 1, 2 and 5 of each decade where there are few decades."""
    return LogLocator(subs=(1.0, 2.0, 5.0) if ratio < WIDE else (1.0,))
