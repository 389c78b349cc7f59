"""The picture of a comparison: error against time, and against work that is the same on every machine."""

import math
from collections import Counter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from brakecli.errors import UsageError
from brakecli.files.read import StoredResult
from brakecli.plots import style
from brakecli.solver.schemes import SCHEMES

Columns = dict[str, style.Array]  # over the entries; errors that cannot be drawn are NaN
LARGEST = 3.0  # entries with larger errors are useless as results; they are not drawn
_TEXTS = ("method", "scheme", "theta", "start", "iteration", "evaluator", "failure")
_NUMBERS = ("step", "tolerance", "error", "wall_seconds", "contact_evaluations", "nodes", "on_front")
_PANELS = (  # column, factor, title and label of the work
    ("wall_seconds", 1e3, "Work–precision", "median time of the loop (ms)"),
    ("contact_evaluations", 1.0, "Work counted, the same on every machine", "evaluations of the contact force"),
)
_MARKERS = {"0.5, 0.5": "o", "1, 0.5": "^", "0.5, 1": "v", "1, 1": "s"}  # by weights: of two layers
_MARKERS |= {"0.25, 0.5, 0.25": "o", "0.0833333, 0.833333, 0.0833333": "D", "": "*"}  # of three, and none
# colours of the exact contact force, of entries on nodes alone
_EXACT = "#CC79A7"
_OTHER_NODES = "#56B4E9"
_NODE_MARKERS = "<>ph"  # markers of the same weights with other numbers of nodes


def draw(result: StoredResult) -> Figure:
    """The figure: error against time, if it was measured, and error against evaluations of the contact force.

    Raises UsageError where there is nothing to draw, UnreadableResultError where something is missing.
    """
    columns = {name: style.read_column(result, name) for name in _TEXTS + _NUMBERS}
    if not np.isfinite(columns["error"]).any():
        raise UsageError(f"{result.path}: none of its entries has an error, so there is nothing to draw")
    best = result.attributes.get("recommended")
    if best is not None and not (isinstance(best, int) and 0 <= best < len(columns["error"])):
        raise style.unreadable(result, "it recommends an entry that it does not hold")
    heading = str(result.attributes.get("title", ""))
    lines = _lines(result.attributes, columns, best)
    target, floor = (float(result.attributes.get(name, 0.0)) for name in ("target_error", "reference_error"))
    drawn = (columns["error"] > 0.0) & (columns["error"] <= LARGEST)
    errors = columns["error"]
    columns["error"] = np.where(drawn, columns["error"], np.nan)
    rows = _PANELS if np.isfinite(columns["wall_seconds"]).any() else _PANELS[1:]
    figure = style.headed(12.4, 6.6, heading, *lines, columns=len(rows), wspace=0.04)
    panels = style.panels(figure, 1, len(rows), sharey=True)[0]
    for axes, (name, factor, title, label) in zip(panels, rows, strict=True):
        work = np.where(drawn & (columns[name] > 0.0), factor * columns[name], np.nan)
        _draw_errors(axes, columns, work)
        if target > 0.0:
            axes.axhline(
                target, color=style.GREEN, ls=style.DASHES, lw=1.3, zorder=1.0, label=f"target {target:g}"
            )
        if best is not None and math.isfinite(columns[name][best]):
            ring: dict[str, Any] = {"ms": 16.0, "mfc": "none", "mec": style.GREEN, "mew": 2.2, "zorder": 4.0}
            axes.plot(factor * columns[name][best], errors[best], "o", label="recommended", **ring)
        (_draw_front if name == "wall_seconds" else _draw_slopes)(axes, columns, work)
        axes.set(title=title, xlabel=label)
        if not style.is_narrow():
            axes.label_outer()
        left, right = axes.get_xlim()
        axes.xaxis.set_major_locator(style.log_locator(right / left))
        axes.xaxis.set_minor_formatter(NullFormatter())
        if right / left < style.WIDE:
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panels[0].set_ylabel("largest relative error of x, y, ẋ, ẏ")
    if drawn.any():
        low = 0.4 * min(float(np.nanmin(columns["error"])), target or LARGEST)
        panels[0].set_ylim(low, 2.5 * float(np.nanmax(columns["error"])))
        panels[0].yaxis.set_major_locator(LogLocator(numticks=20))
        for axes in panels if floor > low else ():
            band: dict[str, Any] = {"color": style.GREY, "alpha": 0.2, "lw": 0, "zorder": 0.5}
            axes.axhspan(low, floor, label="within the reference's error", **band)
    found = style.labels(figure.axes)
    look: dict[str, Any] = {"frameon": False, "handlelength": 2.6, "labelspacing": 0.6}
    look["loc"] = "outside lower left" if style.is_narrow() else "outside right center"
    figure.legend(found.values(), found.keys(), **look)
    return figure


def _lines(attributes: dict[str, Any], columns: Columns, best: int | None) -> tuple[str, str]:
    target = f"{attributes.get('target_error', 0.0):g}"
    first = f"no entry has an error of at most {target}"
    if best is not None:
        names = ("method", "step", "tolerance", "error", "wall_seconds")
        method, step, tolerance, error, seconds = (columns[name][best] for name in names)
        at = f", step {step:.3g} s" if math.isfinite(step) else ""
        at += f", tolerance {tolerance:g}" if math.isfinite(tolerance) else ""
        cost = f" in {1e3 * seconds:.3g} ms" if math.isfinite(seconds) else ""
        first = f"cheapest of error ≤ {target}: {method}{at}: error {error:.2g}{cost}"
    parts = [f"{attributes.get('duration', 0.0):.4g} s of motion"]
    parts.append(f"reference good to {attributes.get('reference_error', 0.0):.1e}")
    left_out = attributes.get("left_out", 0)
    counts = {"failed": (columns["failure"] != "").sum() - left_out, "left out because of the budget": left_out}
    return first, "   ·   ".join(parts + [f"{words} {count}" for words, count in counts.items() if count])


def _draw_errors(axes: Axes, columns: Columns, work: style.Array) -> None:
    """The error of every method over its work, in the order of the file.

    The colour shows the scheme, the marker its weights, a hollow marker the paper's start, and dashes the fixed
    point iteration. Colour and marker also tell methods apart that differ in the contact force only.
    """
    axes.set(xscale="log", yscale="log")
    usual = Counter(columns["nodes"].tolist()).most_common(1)[0][0]
    others = sorted({*columns["nodes"].tolist()} - {0, usual})
    for label in dict.fromkeys(columns["method"].tolist()):
        places = columns["method"] == label
        if np.isnan(work[places]).all():
            continue
        entry = {name: values[places][0] for name, values in columns.items()}
        scheme = SCHEMES.get(entry["scheme"])
        colour, own = (scheme.colour, scheme.own_steps) if scheme else (style.GREEN, False)
        marker = _MARKERS.get(entry["theta"], "P")
        if entry["evaluator"] == "exact" and not own:
            colour = _EXACT
        elif entry["evaluator"] in ("midpoint", "cells"):
            place = others.index(entry["nodes"]) % len(_NODE_MARKERS) if entry["nodes"] in others else -1
            colour = _OTHER_NODES
            marker = _NODE_MARKERS[place] if place >= 0 else "X"
        size, width, above = (9.0, 2.0, 3.0) if own else (5.0, 1.1, 2.0)
        face = "white" if entry["start"] == "paper" else colour
        dashes = (0, (2, 1.5)) if entry["iteration"] == "fixed-point" else "-"
        look: dict[str, Any] = {"label": label, "color": colour, "marker": marker, "mfc": face, "ls": dashes}
        axes.plot(work[places], columns["error"][places], ms=size, lw=width, zorder=above, **look)


def _draw_front(axes: Axes, columns: Columns, work: style.Array) -> None:
    """The entries that no other beats in both error and time."""
    by_work = np.argsort(work, kind="stable")  # NaN at the end
    on = by_work[columns["on_front"][by_work] == 1]
    look: dict[str, Any] = {"color": style.GREY, "alpha": 0.45, "lw": 8.0, "solid_capstyle": "round"}
    axes.plot(work[on], columns["error"][on], zorder=0.9, label="no other is better in both", **look)


def _draw_slopes(axes: Axes, columns: Columns, work: style.Array) -> None:
    """How errors fall with the work at orders one and two, from the coarsest steps on."""
    stepped = np.isfinite(columns["step"]) & np.isfinite(work)
    if not stepped.any():
        return
    ends = np.array([work[stepped].min(), work[stepped].max()])
    top = 1.5 * float(columns["error"][stepped].max())
    note: dict[str, Any] = {"xytext": (4, 0), "textcoords": "offset points", "va": "center", "size": 8.5}
    for order in (1, 2):
        errors = top * (ends / ends[0]) ** -order
        axes.plot(ends, errors, color="#777777", lw=0.9, ls=(0, (1, 2)), zorder=0.8)
        axes.annotate(f"order {order}", (ends[1], errors[1]), color="#555555", **note)
