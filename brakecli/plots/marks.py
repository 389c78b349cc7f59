"""What curves and maps of a sweep share: heading, looks of regimes and outcomes, the scale of a sweep's axis."""

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal

import matplotlib.axes
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from brakecli.analysis.regime.rules import Excitation, Regime
from brakecli.plots import style
from brakecli.plots.sweep import Axis, SweepPicture
from brakecli.sweeps.critical import Outcome
from brakecli.sweeps.point import Status

REGIMES = {
    Regime.DAMPED: ("#BFDDF0", "o"),
    Regime.RELAXATION: (style.ORANGE, "s"),
    Regime.QUASI_HARMONIC: (style.BLUE, "D"),
    Regime.UNDECIDED: (style.GREY, "X"),
}
"""Colour and marker of each regime."""
LEGEND_ORDER = (*map(str, REGIMES), "by simulation", "by eigenvalues")
FORCED, DIFFERENT = "forced by the wheel's waves", "up and down differ"
WIDTH = 8.8
"""Width (inches) of a figure with one column of panels."""
_MOST_TEXTS = 30
_MOST_CHARACTERS = 70
_FEW = 6
"""Number of values of an axis up to which each has its tick."""
_WIDE = 20.0
"""Ratio of lasting amplitudes from which on their scale is logarithmic."""


@dataclass(frozen=True)
class Mark:
    """A sign for points without a value that could be drawn; `where` has the shape of the picture's variables."""

    label: str
    where: NDArray[np.bool_]
    marker: str
    colour: str
    face: str
    at: Literal["top", "bottom"]

    @property
    def look(self) -> dict[str, Any]:
        """As Matplotlib's properties of a line of markers."""
        edge = {"markeredgecolor": self.colour, "markeredgewidth": 1.2}
        return {"ls": "none", "marker": self.marker, "markerfacecolor": self.face, "label": self.label, **edge}


def failed(picture: SweepPicture) -> Mark:
    """Points that failed."""
    return Mark("failed", picture["status"] != Status.DONE, "x", style.VERMILION, style.VERMILION, "bottom")


def missing(picture: SweepPicture) -> Iterator[Mark]:
    """Points without a critical value, or without a least sustained one, by the reason."""
    critical = picture.critical
    assert critical is not None
    status, sustained = picture["critical_status"], picture["sustained_status"]
    low, high = style.readable(critical.lower), style.readable(critical.upper)
    always = (sustained == Outcome.SUSTAINED) & (status != Outcome.UNSTABLE)
    never = (sustained == Outcome.DAMPED) & (status != Outcome.STABLE)
    yield Mark(f"stable up to {high}", status == Outcome.STABLE, "^", style.BLUE, "white", "top")
    yield Mark(f"unstable from {low} on", status == Outcome.UNSTABLE, "v", style.BLUE, style.BLUE, "bottom")
    yield Mark("no steady sliding", status == Outcome.NO_SLIDING, "s", style.DARK, "white", "bottom")
    yield Mark(f"vibration lasts from {low} on", always, "v", style.VERMILION, "white", "bottom")
    yield Mark(f"vibration fades up to {high}", never, "^", style.VERMILION, "white", "top")
    yield failed(picture)


def differs(picture: SweepPicture) -> NDArray[np.bool_]:
    """Where the least sustained value lies outside the bracket of the critical one, or where there is none."""
    assert picture.critical is not None
    sustained, tolerance = picture["critical_sustained"], picture.critical.tolerance
    early = picture["critical_lower"] - sustained > tolerance  # false where one of the two is missing
    late = sustained - picture["critical_upper"] > tolerance
    return np.asarray(np.isfinite(sustained) & (early | late | np.isnan(picture["critical"])))


def forced(picture: SweepPicture) -> NDArray[np.bool_]:
    """Where the waves of a rough wheel shake the shoe."""
    return np.asarray((picture["excitation"] == Excitation.FORCED) & (picture["status"] == Status.DONE))


def regimes(picture: SweepPicture) -> Iterator[tuple[Regime, NDArray[np.bool_]]]:
    """Every regime that occurs, and where."""
    for regime in REGIMES:
        where = np.asarray((picture["regime"] == regime) & (picture["status"] == Status.DONE))
        if where.any():
            yield regime, where


def lasting_amplitudes(picture: SweepPicture) -> tuple[float, float, bool]:
    """The least and the largest amplitude (m) that lasts, 0 if none does; whether their scale is logarithmic."""
    sustained = np.isin(picture["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
    amplitude = picture["amplitude"][sustained & (picture["amplitude"] > 0.0)]
    least, largest = (float(amplitude.min()), float(amplitude.max())) if amplitude.size else (0.0, 0.0)
    return least, largest, largest > _WIDE * least


def critical_label(picture: SweepPicture) -> str:
    """The searched parameter and its unit."""
    assert picture.critical is not None
    return style.labelled(f"critical {picture.critical.parameter}", picture.units["critical"])


def sweep_figure(picture: SweepPicture, width: float, height: float) -> Figure:
    """An empty figure below the sweep's heading; `height` is that of the part below the heading."""
    findings = (
        textwrap.wrap(each, round(12.0 * width), max_lines=2, placeholder=" …") for each in picture.findings
    )
    lines = [picture.summary, *chain.from_iterable(list(findings)[:2])]
    if picture.chosen:
        lines.insert(1, "   ·   ".join(picture.chosen))
    return style.headed(width, height + 0.21 * len(lines), picture.title, *lines)


def set_scale(axes: matplotlib.axes.Axes, side: Literal["x", "y"], along: Axis) -> None:
    """Set the scale, the ticks and the label of an axis of the sweep."""
    axis = axes.xaxis if side == "x" else axes.yaxis
    axis.set_label_text(along.label, parse_math=False)
    values, texts = along.values, along.texts
    if texts is not None:
        step = -(-len(texts) // _MOST_TEXTS)
        slanted = side == "x" and sum(map(len, texts)) > _MOST_CHARACTERS
        turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
        axis.set_ticks(values[::step], labels=texts[::step], parse_math=False, **turned)
        axes.set(**{f"{side}lim": (-0.5, len(texts) - 0.5)})
        axis.grid(False)
    elif along.logarithmic:
        axes.set(**{f"{side}scale": "log"})
        style.set_log_ticks(axis, values[-1] / values[0])
    elif len(values) <= _FEW and np.diff(values).min(initial=np.inf) > 0.1 * np.ptp(values):
        axis.set_ticks(values, labels=[style.readable(float(value)) for value in values])
    else:
        style.set_ticks(axis, float(np.abs(values).max()))
