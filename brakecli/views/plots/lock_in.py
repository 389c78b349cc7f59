"""The lock-in diagram: frequencies of both modes along a key of the case, and their growth below."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from brakecli.errors import UsageError
from brakecli.results.read import StoredResult
from brakecli.views.plots import style

FEW = 40  # values up to which each has a marker


def draw(result: StoredResult) -> Figure:
    """The figure: frequencies above, growth rates below. Raises UsageError where there is nothing to draw."""
    dimension = result.variables("/")["frequencies"].dims[0]
    attributes = result.variables("/")[dimension].attributes
    key = str(attributes.get("long_name", ""))
    units = style.unit_of(attributes)
    x, *modes = (style.read_column(result, name) for name in (dimension, "frequencies", "growth_rates"))
    if not np.isfinite(modes[0]).any():
        raise UsageError(f"{result.path}: there is no steady sliding at any value, so there is nothing to draw")
    critical = np.asarray(result.attributes.get("critical_values", ()), float).ravel()
    return diagram(str(result.attributes.get("title", "")), key, units, x, modes, critical[np.isfinite(critical)])


def diagram(
    title: str, key: str, units: str, x: style.Array, modes: Sequence[style.Array], critical: style.Array
) -> Figure:
    """The figure of both modes, their frequencies (Hz) and growth rates (1/s), along a key of the case."""
    factor, unit = style.prefixed(style.largest(x), units)
    numbers = ", ".join(style.readable(factor * float(value)) for value in critical)
    said = f"changes at {numbers} {unit}".rstrip() if len(critical) else "does not change in between"
    summary = f"{len(x)} value{'s' * (len(x) > 1)}   ·   stability {said}"
    figure = style.headed(8.8, 6.4, title, summary, hspace=0.05)
    panels = figure.subplots(2, 1, sharex=True, height_ratios=[1.35, 1.0])
    looks: tuple[style.Look, ...] = (  # the wide line is seen behind the dashed one where modes have met
        {"color": "#7DB9DE", "lw": 4.0, "ls": "-", "marker": "o", "ms": 6.5, "solid_capstyle": "round"},
        {"color": style.VERMILION, "lw": 1.5, "ls": style.DASHES, "marker": "o", "ms": 3.0},
    )
    turning = 2.0 * np.pi * style.largest(modes[0])  # rad/s: of its rounding is that of a growth rate
    for axes, values, label in zip(panels, modes, ("frequency", "growth rate"), strict=True):
        for mode, look in enumerate(looks):
            shown: style.Look = look if len(x) <= FEW else {**look, "marker": None}
            axes.plot(x, values[:, mode], label=f"mode {mode + 1}", **shown)
        axes.margins(y=0.08)
        for number, value in enumerate(critical):
            words = "" if number else "stability changes"
            axes.axvline(value, color=style.DARK, lw=1.1, ls=style.DOTS, zorder=1.6, label=words)
        style.keep_flat(axes, values, turning if label == "growth rate" else 0.0)
        style.set_ticks(axes.yaxis, 0.0, style.largest(values), "Hz" if label == "frequency" else "1/s", label)
    panels[1].axhline(0.0, color=style.DARK, lw=1.0, zorder=1.5)
    style.set_ticks(panels[1].xaxis, float(x.min()), float(x.max()), units, key)
    figure.align_ylabels()
    panels[0].legend(loc="best")
    return figure
