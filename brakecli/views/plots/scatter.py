"""A study of scatter: probabilities with their intervals, what decides, and how the numbers are distributed."""

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.results.read import StoredResult
from brakecli.results.stability_fields import PROBABLE
from brakecli.views.plots import style
from brakecli.views.plots.run import case_of

CRITICAL = "critical_friction"
_SQUEALS = style.VERMILION
_OTHERS = style.BLUE


def draw(result: StoredResult) -> Figure:
    """The figure: bars above, histograms below. Raises UnreadableResultError."""
    variables = result.variables("/")
    shares = [
        style.read_column(result, name) for name in ("probability", "probability_lower", "probability_upper")
    ]
    outcomes = [*map(str, result.read("/", "outcome"))]
    indexed = "total" in variables and "parameter" in variables
    columns = _columns(result)
    attributes = result.attributes
    bars = 0.36 * max(len(outcomes), 3)  # inches
    lines = (str(attributes.get(name, "")) for name in ("title", "sentence"))
    figure = style.headed(9.6, 1.6 + bars + 2.4, *lines, columns=2)
    upper, lower = style.panels(figure, 2, 2, height_ratios=[0.5 + bars, 2.6])
    _probabilities(upper[0], outcomes, *shares)
    if indexed:
        _tornado(upper[1], result, str(attributes.get("indices_of", "")))
    else:
        upper[1].set_visible(False)
    for axes, (name, (values, whose)) in zip(lower, columns.items(), strict=False):
        shown = {"": values}
        if name == CRITICAL:
            shown = {"critical": values, "own": _own_friction(result)}
        _histogram(axes, shown, name, style.unit_of(variables[name].attributes), whose)
    for axes in lower[len(columns) :]:
        axes.set_visible(False)
    return figure


def _columns(result: StoredResult) -> dict[str, tuple[style.Array, str]]:
    """The two numbers that are shown, and whose they are: critical friction, and how high it squeals or grows."""
    columns = dict[str, tuple[style.Array, str]]()
    variables = result.variables("/")
    squeals = style.read_column(result, "squeal") == 1 if "squeal" in variables else np.zeros(0, np.bool_)
    for name in (CRITICAL, "frequency" if squeals.any() else "growth_rate", "amplitude"):
        if name in variables and len(columns) < 2:
            values = style.read_column(result, name)
            only = name in ("frequency", "amplitude") and squeals.any()
            values = values[squeals] if only else values
            if np.isfinite(values).any():
                columns[name] = values[np.isfinite(values)], "samples that squeal" if only else "samples"
    return columns


def _own_friction(result: StoredResult) -> style.Array:
    """The friction of the brakes themselves: of each sample, or of all where it does not scatter."""
    for name, variable in result.variables("/").items():
        if "friction.coefficient" in str(variable.attributes.get("long_name", "")).split(", "):
            return style.read_column(result, name)
    return np.array([case_of(result).case.friction.coefficient])


def _probabilities(axes: Axes, names: list[str], value: style.Array, low: style.Array, high: style.Array) -> None:
    """A bar for each outcome, with its interval."""
    places = np.arange(len(names))[::-1]
    colours = [_SQUEALS if name == "squeal" else _OTHERS for name in names]
    off = np.clip(np.array([value - low, high - value]), 0.0, None)
    axes.barh(places, value, height=0.62, color=colours, xerr=off, error_kw={"ecolor": style.DARK, "capsize": 3.0})
    texts = [textwrap.fill(PROBABLE.get(name, name), 22) for name in names]
    axes.set_yticks(places, labels=texts, parse_math=False)
    axes.set_xlim(0.0, min(1.0, 1.1 * float(high.max())) or 1.0)
    axes.xaxis.set_major_formatter(lambda share, _: f"{100.0 * share:.3g} %")
    axes.set_title("probability, with its 95 % interval")
    axes.grid(visible=False, axis="y")


def _tornado(axes: Axes, result: StoredResult, of: str) -> None:
    """Total indices, the largest on top, and within them the first-order ones."""
    names = np.array([*map(str, result.read("/", "parameter"))])
    first, total, error = (style.read_column(result, name) for name in ("first_order", "total", "total_error"))
    order = np.argsort(total)
    places = np.arange(len(names))
    axes.barh(
        places,
        total[order],
        height=0.62,
        color="#9CCBE8",
        xerr=error[order],
        error_kw={"ecolor": style.DARK, "capsize": 3.0},
        label="with all others",
    )
    axes.barh(places, np.clip(first[order], 0.0, None), height=0.3, color=style.BLUE, label="alone")
    axes.set_yticks(places, labels=[*names[order]], parse_math=False)
    axes.set_xlim(0.0, None)
    axes.set_title(f"what decides on {of.replace('_', ' ')}", parse_math=False)
    axes.grid(visible=False, axis="y")
    axes.legend(loc="lower right")


def _histogram(axes: Axes, shown: dict[str, style.Array], name: str, units: str, whose: str) -> None:
    """How many samples have a number about so large, with the medians; what is the same for all is a line.

    Several numbers have the same bins, so that their bars lie over each other.
    """
    inside = {}
    for label, values in shown.items():
        low, high = np.quantile(values, (0.005, 0.995))
        inside[label] = values[(values >= low) & (values <= high)]
    every = np.concatenate([*inside.values()])
    count = min(40, 5 + int(max(map(len, inside.values())) ** 0.5))
    edges = np.histogram_bin_edges(every, count).tolist()
    for (label, values), colour in zip(shown.items(), (_OTHERS, style.ORANGE), strict=False):
        middle = float(np.median(values))
        number = f"{style.readable(middle, 4)} {units}".rstrip()
        same = bool(np.ptp(values) == 0.0)
        text = ", ".join(filter(None, (label, f"{number} of all" if same else f"median {number}")))
        if not same:
            axes.hist(inside[label], edges, color=colour, alpha=0.7, label=text)
            text = ""
        axes.axvline(middle, color=style.DARK, lw=1.3, ls=style.DASHES if same else style.DOTS, label=text)
    words = "friction coefficient" if len(shown) > 1 else name.replace("_", " ")
    style.set_ticks(axes.xaxis, float(every.min()), float(every.max()), units, words)
    axes.set_ylabel(whose)
    style.make_room(axes, 0.14 * len(shown))
    axes.legend(loc="upper right")
