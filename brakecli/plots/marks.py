"""What curves and maps of a sweep share: heading, legend, looks of regimes and outcomes, the scale of an axis."""

import textwrap
from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from matplotlib.axis import XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from brakecli.analysis.regime.rules import Regime
from brakecli.plots import style
from brakecli.plots.sweep import Axis, SweepPicture
from brakecli.sweeps.critical import Outcome
from brakecli.sweeps.point import Status

Sign = tuple[style.Array, dict[str, Any]]  # points without a value that could be drawn, the look of their marker
REGIMES = {  # colour and marker
    Regime.DAMPED: ("#BFDDF0", "o"),
    Regime.RELAXATION: (style.ORANGE, "s"),
    Regime.QUASI_HARMONIC: (style.BLUE, "D"),
    Regime.UNDECIDED: (style.GREY, "X"),
}
FORCED, DIFFERENT = "forced by the wheel's waves", "up and down differ"
WIDTH = 8.8  # inches, of a figure with one column of panels
_FIRST = (*map(str, REGIMES), "by simulation", "by eigenvalues")
_LONGEST_KEY, _MOST_TEXTS, _MOST_CHARACTERS = 45, 30, 70
_FEW = 6  # values of an axis up to which each has its tick
_WIDE = 20.0  # ratio of lasting amplitudes from which on their scale is logarithmic


def sign(where: style.Array, label: str, marker: str, colour: str, face: str) -> Sign:
    """A sign for points without a value; a triangle that points up stands at the top of curves."""
    look = {"marker": marker, "markeredgecolor": colour, "markerfacecolor": face, "markeredgewidth": 1.2}
    return where, {"ls": "none", "label": label, **look}


def failed(picture: SweepPicture) -> Sign:
    """Points that failed."""
    return sign(picture["status"] != Status.DONE, "failed", "x", style.VERMILION, style.VERMILION)


def missing(picture: SweepPicture) -> Iterator[Sign]:
    """Points without a critical value, or without a least sustained one, by the reason."""
    critical = picture.critical
    assert critical is not None
    status, sustained = picture["critical_status"], picture["sustained_status"]
    low, high = style.readable(critical.lower), style.readable(critical.upper)
    always = (sustained == Outcome.SUSTAINED) & (status != Outcome.UNSTABLE)
    never = (sustained == Outcome.DAMPED) & (status != Outcome.STABLE)
    yield sign(status == Outcome.STABLE, f"stable up to {high}", "^", style.BLUE, "white")
    yield sign(status == Outcome.UNSTABLE, f"unstable from {low} on", "v", style.BLUE, style.BLUE)
    yield sign(status == Outcome.NO_SLIDING, "no steady sliding", "s", style.DARK, "white")
    yield sign(always, f"vibration lasts from {low} on", "v", style.VERMILION, "white")
    yield sign(never, f"vibration fades up to {high}", "^", style.VERMILION, "white")
    yield failed(picture)


def differs(picture: SweepPicture) -> style.Array:
    """Where the least sustained value lies outside the bracket of the critical one, or where there is none."""
    assert picture.critical is not None
    sustained, tolerance = picture["critical_sustained"], picture.critical.tolerance
    early = picture["critical_lower"] - sustained > tolerance  # false where one of the two is missing
    late = sustained - picture["critical_upper"] > tolerance
    return np.asarray(np.isfinite(sustained) & (early | late | np.isnan(picture["critical"])))


def regimes(picture: SweepPicture) -> list[tuple[Regime, style.Array]]:
    """Every regime that occurs, and where."""
    return [(regime, where) for regime in REGIMES if (where := picture["regime"] == regime).any()]


def lasting_amplitudes(picture: SweepPicture) -> tuple[float, float, bool]:
    """The least and the largest amplitude (m) that lasts, 0 if none does; whether their scale is logarithmic."""
    sustained = np.isin(picture["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
    amplitude = picture["amplitude"][sustained & (picture["amplitude"] > 0.0)]
    least, largest = (float(amplitude.min()), float(amplitude.max())) if amplitude.size else (0.0, 0.0)
    return least, largest, largest > _WIDE * least


def sweep_figure(picture: SweepPicture, width: float, height: float) -> Figure:
    """An empty figure below the sweep's heading; `height` is that of the part below the heading."""
    wrap = textwrap.TextWrapper(round(12.0 * width), max_lines=2, placeholder=" …").wrap
    chosen = ["   ·   ".join(picture.chosen)] if picture.chosen else []
    lines = [picture.summary, *chosen, *chain.from_iterable(map(wrap, picture.findings[:2]))]
    return style.headed(width, height + 0.21 * len(lines), picture.title, *lines)


def add_legend(figure: Figure) -> None:
    """Add all labels in as few rows as fit between the heading and the panels."""
    artists = style.labels(figure)
    if not artists:
        return
    texts = sorted(artists, key=lambda text: _FIRST.index(text) if text in _FIRST else len(_FIRST))
    width, height = figure.get_size_inches()
    for columns in range(len(texts), 0, -1):
        longest = [max(map(len, column)) for column in np.array_split(texts, columns)]  # as Matplotlib fills them
        if sum(0.075 * length + 0.45 for length in longest) <= width - 0.4:
            break
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    left, bottom, wide, high = engine.get()["rect"]
    look: dict[str, Any] = {"frameon": False, "borderaxespad": 0.0, "borderpad": 0.0, "columnspacing": 1.6}
    look |= {"loc": "upper left", "bbox_to_anchor": (0.125 / width, bottom + high), "ncols": columns}
    figure.legend([artists[text] for text in texts], texts, **look).set_in_layout(False)
    taken = (0.19 * -(-len(texts) // columns) + 0.09) / height
    engine.set(rect=(left, bottom, wide, high - taken))


def set_scale(axis: XAxis | YAxis, along: Axis) -> None:
    """Set the scale, the ticks and the label of an axis of the sweep."""
    side, values, texts = axis.axis_name, along.values, along.texts
    key = textwrap.shorten(along.key, _LONGEST_KEY, placeholder=" …")
    axis.set_label_text(style.labelled(key, along.units), parse_math=False)
    if texts is not None:
        step = -(-len(texts) // _MOST_TEXTS)
        slanted = side == "x" and sum(map(len, texts)) > _MOST_CHARACTERS
        turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
        axis.set_ticks(values[::step], labels=texts[::step], parse_math=False, **turned)
        axis.axes.set(**{f"{side}lim": (-0.5, len(texts) - 0.5)})
        axis.grid(False)
    elif not along.logarithmic and len(values) <= _FEW and np.diff(values).min() > 0.1 * np.ptp(values):
        axis.set_ticks(values, labels=[style.readable(float(value)) for value in values])
    else:
        if along.logarithmic:
            axis.axes.set(**{f"{side}scale": "log"})
        style.set_ticks(axis, values[0], values[-1])
