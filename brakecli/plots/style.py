"""What all pictures have in common: the look, the heading, and the way into a file, the same bytes each time."""

import textwrap
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

SUFFIXES = (".pdf", ".png", ".svg")

# Okabe and Ito's colours, told apart also without red or green.
BLUE, ORANGE, VERMILION, GREEN, GREY = "#0072B2", "#E69F00", "#D55E00", "#009E73", "#9A9A9A"
DASHES = (0, (5, 3))
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


def check_target(result: Path, target: Path) -> None:
    """Raise UsageError where `target` can be no picture of this result, or where matplotlib is missing."""
    suffix = target.suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError(
            f"{target}: its suffix names no kind of picture (found {target.suffix!r}); name a file that ends in "
            f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]} with -o"
        )
    if target.exists() and result.exists() and target.samefile(result):
        raise UsageError(f"{target}: this is the result itself; choose another output with -o")
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise UsageError(
            f"matplotlib cannot be imported ({error}); install it with: python -m pip install matplotlib"
        ) from error


def render(draw: Callable[[], "Figure"], suffix: str) -> bytes:
    """What `draw` draws as the bytes of a file of this suffix; nothing in them depends on when or where."""
    with style():
        figure = draw()
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axes in figure.axes:  # the layout's last digits depend on the order in which it solved for them
            axes.set_position(tuple(round(bound, 6) for bound in axes.get_position().bounds))
        stream = BytesIO()
        figure.savefig(stream, format=suffix[1:], dpi=150, metadata=_UNDATED.get(suffix))
        return stream.getvalue()


@contextmanager
def style() -> Iterator[None]:
    """Matplotlib's own defaults and ours, whatever the user's say; a glyph that its font lacks is no alarm."""
    import matplotlib.style

    with matplotlib.style.context(["default", _STYLE]), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def headed(width: float, height: float, title: str, *lines: str) -> "Figure":
    """An empty figure (inches) below its title and some lines, each cut to the width, that say what it shows."""
    from matplotlib.figure import Figure

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
    figure.set_layout_engine("constrained", rect=rect)
    return figure


def layout(figure: "Figure") -> "ConstrainedLayoutEngine":
    """What lays out the panels of a headed figure; its `rect` is the room that the heading leaves."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    return engine
