"""The picture of a comparison: error against time, and against work that is the same on every machine."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from brakecli.errors import UsageError
from brakecli.results.read import StoredResult
from brakecli.views.plots import style
from brakecli.views.plots.run import case_of

LARGEST = 3.0  # entries with larger errors are useless as results; they are not drawn
_TEXTS = ("method", "scheme", "theta", "start", "iteration", "evaluator", "failure")
_NUMBERS = ("step", "tolerance", "error", "wall_seconds", "contact_evaluations", "on_front")
_OTHERS = "other methods"
_COLOURS = (style.BLUE, style.VERMILION, style.ORANGE, "#CC79A7", "#56B4E9", style.DARK)
_MARKERS = "osD^vP*"  # of named methods, in turn: of another length than the colours


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
    of_case = _method_of_case(columns, result)
    named = _named(columns, best, target, of_case)
    counted = "Work counted, the same on every machine"
    works = {  # factor, title and label
        "wall_seconds": (1e3, "Work–precision", "median time of the loop (ms)"),
        "contact_evaluations": (1.0, counted, "evaluations of the contact force"),
    }
    if not np.isfinite(columns["wall_seconds"]).any():
        del works["wall_seconds"]
    figure = style.headed(12.4, 6.6, heading, *lines, columns=len(works), wspace=0.04)
    panels = style.panels(figure, 1, len(works), sharey=True)[0]
    for axes, (name, (factor, title, label)) in zip(panels, works.items(), strict=True):
        work = np.where(drawn & (columns[name] > 0.0), factor * columns[name], np.nan)
        _draw_errors(axes, columns, work, named, of_case)
        if target > 0.0:
            axes.axhline(
                target, color=style.GREEN, ls=style.DASHES, lw=1.3, zorder=1.0, label=f"target {target:g}"
            )
        if best is not None and math.isfinite(columns[name][best]):
            ring: style.Look = {"ms": 16.0, "mfc": "none", "mec": style.GREEN, "mew": 2.2, "zorder": 4.0}
            axes.plot(factor * columns[name][best], errors[best], "o", label="recommended", **ring)
        (_draw_front if name == "wall_seconds" else _draw_slopes)(axes, columns, work)
        axes.set(title=title, xlabel=label)
        if not style.is_narrow():
            axes.label_outer()
        lowest, highest = axes.get_xlim()
        axes.xaxis.set_major_locator(style.log_locator(highest / lowest))
        axes.xaxis.set_minor_formatter(NullFormatter())
        if highest / lowest < style.WIDE:
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    panels[0].set_ylabel("largest relative error of x, y, ẋ, ẏ")
    if drawn.any():
        low = 0.4 * min(float(np.nanmin(columns["error"])), target or LARGEST)
        panels[0].set_ylim(low, 2.5 * float(np.nanmax(columns["error"])))
        panels[0].yaxis.set_major_locator(LogLocator(numticks=20))
        for axes in panels if floor > low else ():
            words = "within the reference's error"
            axes.axhspan(low, floor, label=words, color=style.GREY, alpha=0.2, lw=0, zorder=0.5)
    artists = style.labels(figure.axes)
    artists = {**{name: artist for name, artist in artists.items() if name != _OTHERS}, **artists}
    figure.legend(
        artists.values(),
        artists.keys(),
        loc="outside lower left" if style.is_narrow() else "outside right center",
        frameon=False,
        handlelength=2.6,
        labelspacing=0.6,
    )
    return figure


def _lines(attributes: dict[str, Any], columns: style.Columns, best: int | None) -> tuple[str, str]:
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


def _named(columns: style.Columns, best: int | None, target: float, of_case: str) -> list[str]:
    """The methods that have a name in the picture: what the case asks for, what is recommended, and the front.

    Of the front those that meet the target, or all where none does.
    """
    methods = columns["method"]
    front = columns["on_front"] == 1
    good = front & (columns["error"] <= target)
    best_of_all = [] if best is None else [methods[best]]
    named = [*best_of_all, *methods[good if good.any() else front].tolist()]
    return [*dict.fromkeys([*([of_case] if of_case else []), *named])]


def _method_of_case(columns: style.Columns, result: StoredResult) -> str:
    """The method that the case itself asks for, on the usual contact; empty where it is none of them."""
    solver = case_of(result).case.solver
    theta = ", ".join(f"{weight:.6g}" for weight in solver.theta or ())
    settings = {"scheme": solver.scheme, "theta": theta, "start": solver.start, "iteration": solver.iteration}
    same = np.all([columns[name] == value for name, value in settings.items()], axis=0)
    return str(columns["method"][same][0]) if same.any() else ""


def _draw_errors(axes: Axes, columns: style.Columns, work: style.Array, named: list[str], of_case: str) -> None:
    """The error of every method over its work, in the order of the file; those without a name are grey."""
    axes.set(xscale="log", yscale="log")
    for method in dict.fromkeys(columns["method"].tolist()):
        places = columns["method"] == method
        if np.isnan(work[places]).all():
            continue
        look: style.Look = {"color": "#CFCFCF", "marker": ".", "lw": 0.9, "zorder": 1.5, "label": _OTHERS}
        if method in named:
            number = named.index(method)
            colour = _COLOURS[number % len(_COLOURS)]
            label = f"{method}, of the case" if method == of_case else method
            look = {
                "color": colour,
                "marker": _MARKERS[number % len(_MARKERS)],
                "label": label,
                "zorder": 2.5,
                "ms": 6.0,
            }
        axes.plot(work[places], columns["error"][places], **look)


def _draw_front(axes: Axes, columns: style.Columns, work: style.Array) -> None:
    """The entries that no other beats in both error and time."""
    by_work = np.argsort(work, kind="stable")  # NaN at the end
    on = by_work[columns["on_front"][by_work] == 1]
    look: style.Look = {"color": style.GREEN, "lw": 8.0, "solid_capstyle": "round", "zorder": 0.9}
    axes.plot(work[on], columns["error"][on], alpha=0.25, label="no other is better in both", **look)


def _draw_slopes(axes: Axes, columns: style.Columns, work: style.Array) -> None:
    """How errors fall with the work at orders one and two, from the coarsest steps on."""
    stepped = np.isfinite(columns["step"]) & np.isfinite(work)
    if not stepped.any():
        return
    ends = np.array([work[stepped].min(), work[stepped].max()])
    top = 1.5 * float(columns["error"][stepped].max())

    for order in (1, 2):
        errors = top * (ends / ends[0]) ** -order
        axes.plot(ends, errors, color="#777777", lw=0.9, ls=(0, (1, 2)), zorder=0.8)
        axes.annotate(
            f"order {order}",
            (ends[1], errors[1]),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            size=8.5,
            color="#555555",
        )
