"""The picture of a comparison: error against time, and against work that no machine changes."""

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import Evaluator, Iteration, Scheme, Start
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.files.read import StoredResult
from brakecli.files.write import FILL
from brakecli.plots.style import BLUE, DASHES, GREEN, GREY, VERMILION, headed, layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_TEXTS = ("method", "scheme", "theta", "start", "iteration", "evaluator", "failure")
_NUMBERS = ("step", "tolerance", "error", "wall_seconds", "contact_evaluations", "nodes", "on_front")
DARK, SKY, PURPLE = "#222222", "#56B4E9", "#CC79A7"
_COLOURS = {Scheme.TWO_LAYER: BLUE, Scheme.THREE_LAYER: VERMILION, Scheme.EVENT_DRIVEN: DARK}
_MARKERS = {
    "0.5, 0.5": "o",
    "1, 0.5": "^",
    "0.5, 1": "v",
    "1, 1": "s",
    "0.25, 0.5, 0.25": "o",
    "0.0833333, 0.833333, 0.0833333": "D",
    "": "*",
}
_NODE_MARKERS = "<>ph"
"""For the same weights with other numbers of nodes."""
LARGEST = 3.0
"""Errors above are no results any more; they are not drawn."""

FEW_DECADES = 300.0
"""Ratio of the ends of an axis below which more than powers of ten have a number."""


@dataclass(frozen=True)
class Curve:
    """A method over its steps or tolerances: places of its entries in the columns, and how it looks."""

    label: str
    places: NDArray[np.intp]
    look: dict[str, Any]


@dataclass(frozen=True)
class ComparisonPicture:
    """What is drawn of a comparison: columns over its entries, NaN where a number is missing."""

    title: str
    lines: tuple[str, ...]
    columns: dict[str, NDArray[Any]]
    curves: tuple[Curve, ...]
    target: float
    reference_error: float
    recommended: int | None

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column."""
        return self.columns[name]

    @property
    def timed(self) -> bool:
        """Whether it has times at all."""
        return bool(np.isfinite(self["wall_seconds"]).any())


def gather_comparison(result: StoredResult) -> ComparisonPicture:
    """Read what is drawn; raises UsageError where there is nothing to draw, UnreadableResultError."""
    columns: dict[str, NDArray[Any]] = {name: result.read("/", name) for name in _TEXTS}
    for name in _NUMBERS:
        values = result.read("/", name).astype(np.float64)
        columns[name] = np.where(values == FILL, np.nan, values)
    if not np.isfinite(columns["error"]).any():
        raise UsageError(f"{result.path}: none of its entries has an error, so there is nothing to draw")
    target, reference = (float(result.attributes.get(name, 0.0)) for name in ("target_error", "reference_error"))
    best = result.attributes.get("recommended")
    if best is not None and not (isinstance(best, int) and 0 <= best < len(columns["error"])):
        raise UnreadableResultError(f"{result.path}: recommends an entry that it does not hold; compute it again")
    return ComparisonPicture(
        title=str(result.attributes.get("title", "")),
        lines=_lines(result.attributes, columns, best),
        columns=columns,
        curves=_curves(columns),
        target=target,
        reference_error=reference,
        recommended=best,
    )


def _lines(attributes: dict[str, Any], columns: dict[str, NDArray[Any]], best: int | None) -> tuple[str, ...]:
    """What stands below the title."""
    target = f"{attributes.get('target_error', 0.0):g}"
    if best is None:
        first = f"no entry has an error of at most {target}"
    else:
        step, tolerance = columns["step"][best], columns["tolerance"][best]
        at = f"step {step:.3g} s" if math.isfinite(step) else f"tolerance {tolerance:g}"
        found = f"error {columns['error'][best]:.2g}"
        seconds = columns["wall_seconds"][best]
        cost = f" in {1e3 * seconds:.3g} ms" if math.isfinite(seconds) else ""
        first = f"cheapest of error ≤ {target}: {columns['method'][best]}, {at}: {found}{cost}"
    parts = [f"{attributes.get('duration', 0.0):.4g} s of motion"]
    parts.append(f"reference good to {attributes.get('reference_error', 0.0):.1e}")
    left_out = int(attributes.get("left_out", 0))
    failed = int(np.count_nonzero(columns["failure"] != "")) - left_out
    parts += [f"failed {failed}"] if failed else []
    parts += [f"left out for want of time {left_out}"] if left_out else []
    return first, "   ·   ".join(parts)


def _curves(columns: dict[str, NDArray[Any]]) -> tuple[Curve, ...]:
    """The methods in the order of the file."""
    labels = list(dict.fromkeys(columns["method"].tolist()))
    usual = Counter(columns["nodes"].tolist()).most_common(1)[0][0]
    counts = sorted({n for n in columns["nodes"].tolist() if n not in (0.0, usual)})
    curves = []
    for label in labels:
        places = np.flatnonzero(columns["method"] == label)
        first = {name: columns[name][places[0]] for name in (*_TEXTS, "nodes")}
        curves.append(Curve(label, places, _look(first, counts)))
    return tuple(curves)


def _look(method: dict[str, Any], counts: list[float]) -> dict[str, Any]:
    """Colour by the kind of scheme, marker by weights; hollow: the paper's start, dashes: the fixed point."""
    colour, marker = _COLOURS.get(method["scheme"], GREEN), _MARKERS.get(method["theta"], "P")
    if method["evaluator"] == Evaluator.EXACT and method["scheme"] != Scheme.EVENT_DRIVEN:
        colour = PURPLE
    elif method["evaluator"] == Evaluator.MIDPOINT and method["nodes"] in counts:
        colour, marker = SKY, _NODE_MARKERS[counts.index(method["nodes"]) % len(_NODE_MARKERS)]
    hollow = method["start"] == Start.PAPER
    fixed = method["iteration"] == Iteration.FIXED_POINT
    own = method["scheme"] == Scheme.EVENT_DRIVEN
    return {
        "color": colour,
        "marker": marker,
        "markersize": 9.0 if own else 5.0,
        "markerfacecolor": "white" if hollow else colour,
        "linestyle": (0, (2, 1.5)) if fixed else "-",
        "linewidth": 2.0 if own else 1.1,
        "zorder": 3.0 if own else 2.0,
    }


def draw_comparison(picture: ComparisonPicture) -> "Figure":
    """The figure: error against time, if it was measured, and error against evaluations of the contact."""
    figure = headed(12.4, 6.6, picture.title, *picture.lines)
    layout(figure).set(wspace=0.04)
    count = 2 if picture.timed else 1
    panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
    if picture.timed:
        _draw(panels[0], picture, "wall_seconds", 1e3)
        _draw_front(panels[0], picture)
        panels[0].set(title="Work–precision", xlabel="median time of the loop (ms)")
    _draw(panels[-1], picture, "contact_evaluations", 1.0)
    _draw_slopes(panels[-1], picture)
    panels[-1].set(title="Work counted, the same on every machine", xlabel="evaluations of the contact force")
    for axes in panels:
        axes.label_outer()
        _set_ticks(axes)
    panels[0].set_ylabel("largest relative error of x, y, ẋ, ẏ")
    _set_errors(panels[0], picture)
    handles: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside right center",
        frameon=False,
        handlelength=2.6,
        labelspacing=0.6,
    )
    return figure


def _draw(axes: "Axes", picture: ComparisonPicture, along: str, factor: float) -> None:
    """Every method, the target, and what the reference cannot tell."""
    axes.set(xscale="log", yscale="log")
    for curve in picture.curves:
        x, y = factor * picture[along][curve.places], picture["error"][curve.places]
        drawn = np.isfinite(x) & (x > 0.0) & (y > 0.0) & (y <= LARGEST)
        if drawn.any():
            axes.plot(np.where(drawn, x, np.nan), np.where(drawn, y, np.nan), label=curve.label, **curve.look)
    if picture.target > 0.0:
        axes.axhline(
            picture.target, color=GREEN, ls=DASHES, lw=1.3, zorder=1.0, label=f"target {picture.target:g}"
        )
    best = picture.recommended
    if best is not None and math.isfinite(picture[along][best]):
        at = factor * picture[along][best], picture["error"][best]
        ring: dict[str, Any] = {
            "marker": "o",
            "markersize": 16.0,
            "markerfacecolor": "none",
            "markeredgecolor": GREEN,
        }
        axes.plot(*at, ls="none", markeredgewidth=2.2, zorder=4.0, label="recommended", **ring)


def _draw_front(axes: "Axes", picture: ComparisonPicture) -> None:
    """The entries that no other beats in both error and time."""
    on = np.flatnonzero((picture["on_front"] == 1) & (picture["error"] <= LARGEST) & (picture["error"] > 0.0))
    on = on[np.argsort(picture["wall_seconds"][on], kind="stable")]
    x, y = 1e3 * picture["wall_seconds"][on], picture["error"][on]
    look: dict[str, Any] = {"color": GREY, "alpha": 0.45, "lw": 8.0, "solid_capstyle": "round", "zorder": 0.9}
    axes.plot(x, y, label="no other is better in both", **look)


def _draw_slopes(axes: "Axes", picture: ComparisonPicture) -> None:
    """How errors fall with the work at orders one and two, from the coarsest steps on."""
    x, y = picture["contact_evaluations"], picture["error"]
    stepped = np.isfinite(picture["step"]) & (x > 0.0) & (y > 0.0) & (y <= LARGEST)
    if not stepped.any():
        return
    low, high = float(x[stepped].min()), float(x[stepped].max())
    top = 1.5 * float(y[stepped].max())
    note: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "va": "center", "size": 8.5}
    for order in (1, 2):
        ends = np.array([low, high])
        axes.plot(ends, top * (ends / low) ** -order, color="#777777", lw=0.9, ls=(0, (1, 2)), zorder=0.8)
        axes.annotate(f"order {order}", (high, top * (high / low) ** -order), color="#555555", **note)


def _set_ticks(axes: "Axes") -> None:
    """Ticks along the work that read as numbers: at 1, 2 and 5 where there are few decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_xlim()
    few = high / low < FEW_DECADES
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    if few:
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _set_errors(axes: "Axes", picture: ComparisonPicture) -> None:
    """Errors from the smallest to the largest that are drawn; below its own error the reference tells nothing."""
    from matplotlib.ticker import LogLocator

    drawn = picture["error"][(picture["error"] > 0.0) & (picture["error"] <= LARGEST)]
    if not drawn.size:
        return
    low, high = 0.4 * min(float(drawn.min()), picture.target or LARGEST), 2.5 * float(drawn.max())
    axes.set_ylim(low, high)
    axes.yaxis.set_major_locator(LogLocator(numticks=20))
    if picture.reference_error > low:
        for panel in axes.figure.axes:
            panel.axhspan(
                low,
                picture.reference_error,
                color=GREY,
                alpha=0.2,
                lw=0,
                zorder=0.5,
                label="within the reference's error",
            )
