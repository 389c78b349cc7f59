"""How regimes and outcomes look, alike in curves and maps; and the scale of an axis."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.rules import Excitation, Regime
from brakecli.plots.style import BLUE, GREY, ORANGE, VERMILION
from brakecli.plots.sweep.picture import Axis, SweepPicture, readable
from brakecli.sweeps.critical import Outcome
from brakecli.sweeps.point import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.ticker import FuncFormatter, LogLocator

REGIME_COLOURS = {
    Regime.DAMPED: "#BFDDF0",
    Regime.RELAXATION: ORANGE,
    Regime.QUASI_HARMONIC: BLUE,
    Regime.UNDECIDED: GREY,
}
REGIME_MARKERS = {
    Regime.DAMPED: "o",
    Regime.RELAXATION: "s",
    Regime.QUASI_HARMONIC: "D",
    Regime.UNDECIDED: "X",
}
DARK = "#333333"
SUSTAINED = (Regime.RELAXATION, Regime.QUASI_HARMONIC)
_MOST_TEXTS = 30
_MOST_CHARACTERS = 70
_SMALL, _LARGE = 1e-2, 1e5
"""Values of an axis outside these have powers of ten."""
_FEW = 6
"""Values of an axis up to which each has its tick."""
_WIDE = 300.0
"""Ratio of the ends of a logarithmic axis from which on only powers of ten have a number."""


@dataclass(frozen=True)
class Mark:
    """A sign for points that have no value to be drawn at; `where` is over the picture's variables."""

    label: str
    where: NDArray[np.bool_]
    marker: str
    colour: str
    filled: bool
    at: Literal["top", "bottom"]

    @property
    def look(self) -> dict[str, Any]:
        """As matplotlib's properties of a line of markers."""
        face = self.colour if self.filled else "white"
        return {
            "ls": "none",
            "marker": self.marker,
            "markeredgecolor": self.colour,
            "markerfacecolor": face,
            "markeredgewidth": 1.2,
        }


def failed(picture: SweepPicture) -> Mark:
    """Points that failed."""
    return Mark("failed", picture["status"] != Status.DONE, "x", VERMILION, True, "bottom")


def missing(picture: SweepPicture) -> Iterator[Mark]:
    """Points without a critical value, or without a least sustained one, by the reason."""
    critical = picture.critical
    assert critical is not None
    status, sustained = picture["critical_status"], picture["sustained_status"]
    low, high = readable(critical.lower), readable(critical.upper)
    yield Mark(f"stable up to {high}", status == Outcome.STABLE, "^", BLUE, False, "top")
    yield Mark(f"unstable from {low} on", status == Outcome.UNSTABLE, "v", BLUE, True, "bottom")
    yield Mark("no steady sliding", status == Outcome.NO_SLIDING, "s", DARK, False, "bottom")
    always = (sustained == Outcome.SUSTAINED) & (status != Outcome.UNSTABLE)
    never = (sustained == Outcome.DAMPED) & (status != Outcome.STABLE)
    yield Mark(f"vibration lasts from {low} on", always, "v", VERMILION, False, "bottom")
    yield Mark(f"vibration fades up to {high}", never, "^", VERMILION, False, "top")
    yield failed(picture)


def differs(picture: SweepPicture) -> NDArray[np.bool_]:
    """Where the least sustained value lies outside the bracket of the critical one, or where there is none."""
    assert picture.critical is not None
    sustained, tolerance = picture["critical_sustained"], picture.critical.tolerance
    early = picture["critical_lower"] - sustained > tolerance  # neither holds of what is missing
    late = sustained - picture["critical_upper"] > tolerance
    return np.asarray(np.isfinite(sustained) & (early | late | np.isnan(picture["critical"])))


def forced(picture: SweepPicture) -> NDArray[np.bool_]:
    """Where the waves of a rough wheel shake the shoe."""
    return np.asarray((picture["excitation"] == Excitation.FORCED) & (picture["status"] == Status.DONE))


def regimes(picture: SweepPicture) -> Iterator[tuple[Regime, NDArray[np.bool_]]]:
    """Every regime that occurs, and where."""
    done = picture["status"] == Status.DONE
    for regime in REGIME_COLOURS:
        where = np.asarray((picture["regime"] == regime) & done)
        if where.any():
            yield regime, where


def set_scale(axes: "Axes", side: Literal["x", "y"], along: Axis) -> None:
    """The scale, ticks and label of an axis of the sweep."""
    axis = axes.xaxis if side == "x" else axes.yaxis
    axis.set_label_text(along.label, parse_math=False)
    if along.texts is not None:
        step = -(-len(along.texts) // _MOST_TEXTS)
        slanted = side == "x" and sum(map(len, along.texts)) > _MOST_CHARACTERS
        turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
        axis.set_ticks(along.values[::step], labels=along.texts[::step], parse_math=False, **turned)
        (axes.set_xlim if side == "x" else axes.set_ylim)(-0.5, len(along.texts) - 0.5)
        axis.grid(False)
    elif along.logarithmic:
        (axes.set_xscale if side == "x" else axes.set_yscale)("log")
        set_log_ticks(axis, along.values[-1] / along.values[0])
    elif len(along.values) <= _FEW and np.diff(along.values).min(initial=np.inf) > 0.1 * np.ptp(along.values):
        axis.set_ticks(along.values, labels=[readable(float(value)) for value in along.values])
    else:
        set_ticks(axis, float(np.abs(along.values).max()))


def set_ticks(axis: Any, largest: float) -> None:
    """Ticks up to a value of which each reads as it is, without a power of ten at the end of the axis."""
    from matplotlib.ticker import FuncFormatter

    if not _SMALL <= largest < _LARGE:
        axis.set_major_formatter(FuncFormatter(lambda value, _: readable(value)))


def set_log_ticks(axis: Any, ratio: float) -> None:
    """Ticks of a logarithmic axis of which one end is `ratio` times the other."""
    from matplotlib.ticker import NullLocator

    locator, formatter = log_ticks(ratio)
    axis.set_major_locator(locator)
    axis.set_major_formatter(formatter)
    if ratio < _WIDE:
        axis.set_minor_locator(NullLocator())


def log_ticks(ratio: float) -> tuple["LogLocator", "FuncFormatter"]:
    """Where ticks of a logarithmic axis stand, and how they read: at 1, 2 and 5 unless there are many decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    subs = (1.0, 2.0, 5.0) if ratio < _WIDE else (1.0,)
    return LogLocator(subs=subs), FuncFormatter(lambda value, _: readable(value))
