"""The picture of a comparison: error against time, and against work that is the same on every machine."""

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from brakecli.errors import UsageError
from brakecli.files.read import StoredResult
from brakecli.files.write import FILL
from brakecli.plots import style
from brakecli.solver.schemes import SCHEMES

_TEXTS = ("method", "scheme", "theta", "start", "iteration", "evaluator", "failure")
_NUMBERS = ("step", "tolerance", "error", "wall_seconds", "contact_evaluations", "nodes", "on_front")
_MARKERS = {
    "0.5, 0.5": "o",
    "1, 0.5": "^",
    "0.5, 1": "v",
    "1, 1": "s",
    "0.25, 0.5, 0.25": "o",
    "0.0833333, 0.833333, 0.0833333": "D",
    "": "*",
}
"""Markers by weights."""
_EXACT, _OTHER_NODES = "#CC79A7", "#56B4E9"
"""Colours of the exact contact force, and of less usual numbers of nodes."""
_NODE_MARKERS = "<>ph"
"""Markers of the same weights with other numbers of nodes."""
LARGEST = 3.0
"""Entries with larger errors are useless as results; they are not drawn."""


@dataclass(frozen=True)
class ComparisonPicture:
    """What is drawn of a comparison: columns over its entries, NaN where a number is missing."""

    title: str
    lines: tuple[str, ...]
    columns: dict[str, NDArray[Any]]
    target: float
    reference_error: float
    recommended: int | None

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column."""
        return self.columns[name]

    @property
    def drawn(self) -> NDArray[np.bool_]:
        """The entries whose error can be drawn."""
        return np.asarray((self["error"] > 0.0) & (self["error"] <= LARGEST))


def gather(result: StoredResult) -> ComparisonPicture:
    """Read what is drawn; raises UsageError where there is nothing to draw, UnreadableResultError."""
    columns: dict[str, NDArray[Any]] = {name: result.read("/", name) for name in _TEXTS}
    for name in _NUMBERS:
        values = result.read("/", name).astype(np.float64)
        columns[name] = np.where(values == FILL, np.nan, values)
    if not np.isfinite(columns["error"]).any():
        raise UsageError(f"{result.path}: none of its entries has an error, so there is nothing to draw")
    best = result.attributes.get("recommended")
    if best is not None and not (isinstance(best, int) and 0 <= best < len(columns["error"])):
        raise style.unreadable(result, "it recommends an entry that it does not hold")
    return ComparisonPicture(
        title=str(result.attributes.get("title", "")),
        lines=_lines(result.attributes, columns, best),
        columns=columns,
        target=float(result.attributes.get("target_error", 0.0)),
        reference_error=float(result.attributes.get("reference_error", 0.0)),
        recommended=best,
    )


def _lines(attributes: dict[str, Any], columns: dict[str, NDArray[Any]], best: int | None) -> tuple[str, ...]:
    """The lines below the title."""
    target = f"{attributes.get('target_error', 0.0):g}"
    if best is None:
        first = f"no entry has an error of at most {target}"
    else:
        method, step, tolerance, error, seconds = (
            columns[name][best] for name in ("method", "step", "tolerance", "error", "wall_seconds")
        )
        at = f"step {step:.3g} s" if math.isfinite(step) else f"tolerance {tolerance:g}"
        cost = f" in {1e3 * seconds:.3g} ms" if math.isfinite(seconds) else ""
        first = f"cheapest of error ≤ {target}: {method}, {at}: error {error:.2g}{cost}"
    left_out = int(attributes.get("left_out", 0))
    failed = int(np.count_nonzero(columns["failure"] != "")) - left_out
    parts = [f"{attributes.get('duration', 0.0):.4g} s of motion"]
    parts.append(f"reference good to {attributes.get('reference_error', 0.0):.1e}")
    parts += [f"failed {failed}"] if failed else []
    parts += [f"left out for want of time {left_out}"] if left_out else []
    return first, "   ·   ".join(parts)


def draw(picture: ComparisonPicture) -> Figure:
    """The figure: error against time, if it was measured, and error against evaluations of the contact force."""
    figure = style.headed(12.4, 6.6, picture.title, *picture.lines, wspace=0.04)
    timed = bool(np.isfinite(picture["wall_seconds"]).any())
    panels = figure.subplots(1, 1 + timed, sharey=True, squeeze=False)[0]
    looks = _looks(picture)
    if timed:
        _draw_errors(panels[0], picture, looks, 1e3 * picture["wall_seconds"])
        _draw_front(panels[0], picture)
        panels[0].set(title="Work–precision", xlabel="median time of the loop (ms)")
    _draw_errors(panels[-1], picture, looks, picture["contact_evaluations"])
    _draw_slopes(panels[-1], picture)
    panels[-1].set(title="Work counted, the same on every machine", xlabel="evaluations of the contact force")
    for axes in panels:
        axes.label_outer()
        _set_ticks(axes)
    panels[0].set_ylabel("largest relative error of x, y, ẋ, ẏ")
    _set_errors(panels[0], picture)
    found = style.labels(figure)
    look: dict[str, Any] = {"frameon": False, "handlelength": 2.6, "labelspacing": 0.6}
    figure.legend(found.values(), found.keys(), loc="outside right center", **look)
    return figure


def _looks(picture: ComparisonPicture) -> dict[str, dict[str, Any]]:
    """The look of each method, in the order of the file.

    The colour shows the scheme, the marker its weights, a hollow marker the paper's start, and dashes the fixed
    point iteration. Colour and marker also tell methods apart that differ in the contact force only.
    """
    nodes = picture["nodes"].tolist()
    usual = Counter(nodes).most_common(1)[0][0]
    others = sorted({number for number in nodes if number not in (0.0, usual)})
    looks = {}
    for label in dict.fromkeys(picture["method"].tolist()):
        entry = {name: values[picture["method"] == label][0] for name, values in picture.columns.items()}
        scheme = SCHEMES.get(entry["scheme"])
        colour, own = (scheme.colour, scheme.own_steps) if scheme else (style.GREEN, False)
        marker = _MARKERS.get(entry["theta"], "P")
        if entry["evaluator"] == "exact" and not own:
            colour = _EXACT
        elif entry["evaluator"] == "midpoint" and entry["nodes"] in others:
            colour, marker = _OTHER_NODES, _NODE_MARKERS[others.index(entry["nodes"]) % len(_NODE_MARKERS)]
        looks[label] = {
            "color": colour,
            "marker": marker,
            "markersize": 9.0 if own else 5.0,
            "markerfacecolor": "white" if entry["start"] == "paper" else colour,
            "linestyle": (0, (2, 1.5)) if entry["iteration"] == "fixed-point" else "-",
            "linewidth": 2.0 if own else 1.1,
            "zorder": 3.0 if own else 2.0,
        }
    return looks


def _draw_errors(
    axes: Axes, picture: ComparisonPicture, looks: dict[str, dict[str, Any]], work: NDArray[np.float64]
) -> None:
    """The error of every method over its work, the target, and the recommended entry."""
    axes.set(xscale="log", yscale="log")
    for label, look in looks.items():
        places = picture["method"] == label
        drawn = (picture.drawn & (work > 0.0))[places]
        if drawn.any():
            x, y = (np.where(drawn, values[places], np.nan) for values in (work, picture["error"]))
            axes.plot(x, y, label=label, **look)
    if picture.target > 0.0:
        label = f"target {picture.target:g}"
        axes.axhline(picture.target, color=style.GREEN, ls=style.DASHES, lw=1.3, zorder=1.0, label=label)
    best = picture.recommended
    if best is not None and math.isfinite(work[best]):
        ring: dict[str, Any] = {"ms": 16.0, "mfc": "none", "mec": style.GREEN, "mew": 2.2, "zorder": 4.0}
        axes.plot(work[best], picture["error"][best], "o", label="recommended", **ring)


def _draw_front(axes: Axes, picture: ComparisonPicture) -> None:
    """The entries that no other beats in both error and time."""
    on = np.flatnonzero((picture["on_front"] == 1) & picture.drawn)
    on = on[np.argsort(picture["wall_seconds"][on], kind="stable")]
    x, y = 1e3 * picture["wall_seconds"][on], picture["error"][on]
    look: dict[str, Any] = {"color": style.GREY, "alpha": 0.45, "lw": 8.0, "solid_capstyle": "round"}
    axes.plot(x, y, zorder=0.9, label="no other is better in both", **look)


def _draw_slopes(axes: Axes, picture: ComparisonPicture) -> None:
    """How errors fall with the work at orders one and two, from the coarsest steps on."""
    work = picture["contact_evaluations"]
    stepped = np.isfinite(picture["step"]) & (work > 0.0) & picture.drawn
    if not stepped.any():
        return
    ends = np.array([work[stepped].min(), work[stepped].max()])
    top = 1.5 * float(picture["error"][stepped].max())
    note: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "va": "center", "size": 8.5}
    for order in (1, 2):
        errors = top * (ends / ends[0]) ** -order
        axes.plot(ends, errors, color="#777777", lw=0.9, ls=(0, (1, 2)), zorder=0.8)
        axes.annotate(f"order {order}", (ends[1], errors[1]), color="#555555", **note)


def _set_ticks(axes: Axes) -> None:
    """Ticks along the work that read as numbers where there are few decades."""
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(style.log_locator(high / low))
    axes.xaxis.set_minor_formatter(NullFormatter())
    if high / low < style.WIDE:
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")


def _set_errors(axes: Axes, picture: ComparisonPicture) -> None:
    """Errors from the smallest to the largest drawn; those within the reference's error are shaded."""
    drawn = picture["error"][picture.drawn]
    if not drawn.size:
        return
    low, high = 0.4 * min(float(drawn.min()), picture.target or LARGEST), 2.5 * float(drawn.max())
    axes.set_ylim(low, high)
    axes.yaxis.set_major_locator(LogLocator(numticks=20))
    if picture.reference_error > low:
        band: dict[str, Any] = {"color": style.GREY, "alpha": 0.2, "lw": 0, "zorder": 0.5}
        for panel in axes.figure.axes:
            panel.axhspan(low, picture.reference_error, label="within the reference's error", **band)
