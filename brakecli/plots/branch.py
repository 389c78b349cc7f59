"""Branches along a key: amplitude above, frequency below; stable motions full, unstable ones dashed."""

import math
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.errors import UsageError
from brakecli.faces import argument
from brakecli.files.read import StoredResult
from brakecli.plots import style

# inches
_WIDTH = 8.8
_HEIGHT = 6.6
_COLOURS = style.BLUE, style.VERMILION, style.GREEN, style.ORANGE
_MARKERS = {
    "flutter": "o",
    "divergence": "X",
    "fold": "s",
    "flip": "D",
    "torus": "^",
    "branch point": "P",
    "grazing stick": "v",
    "grazing flight": "d",
    "end": "|",
    "budget": "x",
}
_SLIDING = "steady sliding"
_DRAWN = ("amplitude", "frequency", "stick_fraction", "contact_loss_fraction")
_WIDE = 30.0  # ratio of amplitudes from which on their axis is logarithmic


def draw(result: StoredResult, variable: str = "") -> Figure:
    """The figure, with another number of the motions in place of the amplitude.

    Raises UsageError where there is no motion at all, or no such number, and UnreadableResultError.
    """
    upper_name = variable or "amplitude"
    names = ("value", "stable", *dict.fromkeys(("frequency", upper_name)))
    if upper_name not in _DRAWN:
        what = f"{argument('variable')} {variable}: is no number of branches that is drawn"
        raise UsageError(f"{result.path}: {what}; give one of {', '.join(_DRAWN)}")
    groups = sorted(
        (name for name in result.groups if name.startswith("branch_") and "/" not in name), key=_number
    )
    attributes = result.attributes
    branches = []
    for group in groups:
        columns = {name: np.asarray(result.read(group, name), float) for name in names}
        kind = str(result.group_attributes(group).get("kind", ""))
        if kind == _SLIDING and len(columns["value"]):
            cut = _other_mode(columns["frequency"], np.asarray(result.read(group, "multipliers"), float))
            columns = {name: np.insert(each, cut, each[cut]) for name, each in columns.items()}
            columns["frequency"][cut + np.arange(len(cut))] = np.nan
        inner = f"{group}/special"
        marks = {name: result.read(inner, name) for name in ("kind", "value", "amplitude", "frequency")}
        columns = _with_ends(columns, marks)
        branches.append((kind, columns, marks))
    if not groups or not any(len(columns["value"]) for _, columns, _ in branches):
        raise UsageError(f"{result.path}: holds no motion, so there is nothing to draw")
    units = style.unit_of(result.variables(groups[0])["value"].attributes)
    key = str(attributes.get("parameter", ""))
    sentence = str(attributes.get("sentence", ""))
    figure = style.headed(_WIDTH, _HEIGHT, str(attributes.get("title", "")), sentence, hspace=0.05)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
    sizes = np.concatenate([np.zeros(0), *(each[upper_name] for kind, each, _ in branches if kind != _SLIDING)])
    sizes = sizes[sizes > 0.0]
    wide = upper_name == "amplitude" and len(sizes) > 0 and sizes.max() > _WIDE * sizes.min()
    shown = set[str]()
    for number, (kind, columns, marks) in enumerate(branches):
        colour = style.DARK if kind == _SLIDING else _COLOURS[(number - 1) % len(_COLOURS)]
        upper.plot([], [], color=colour, lw=1.8, label=kind)
        for axes, name in ((upper, upper_name), (lower, "frequency")):
            if not (wide and axes is upper and kind == _SLIDING):
                _line(axes, columns, name, colour)
            _marks(axes, marks, name, colour, shown if axes is upper else None, wide and kind == _SLIDING)
    if not all(columns["stable"].all() for _, columns, _ in branches):
        upper.plot([], [], color=style.GREY, lw=1.2, ls=style.DASHES, label="unstable")
    if wide:
        upper.set_yscale("log")
    for name, text in (("critical", "squeals by itself"), ("coexists_from", "can vibrate")):
        value = attributes.get(name)
        if isinstance(value, int | float) and math.isfinite(value):
            for axes in (upper, lower):
                look: dict[str, Any] = {"label": f"{text} from {value:.4g} on"} if axes is upper else {}
                axes.axvline(float(value), color=style.GREY, lw=1.1, ls=style.DOTS, zorder=1.5, **look)
    low = float(sizes.min()) if wide else 0.0
    unit = style.unit_of(result.variables(groups[0])[upper_name].attributes)
    words = "amplitude of x" if upper_name == "amplitude" else upper_name.replace("_", " ")
    style.set_ticks(upper.yaxis, low, style.largest(sizes), unit, words)
    frequencies = np.concatenate([columns["frequency"] for _, columns, _ in branches])
    style.set_ticks(lower.yaxis, 0.0, style.largest(frequencies), "Hz", "frequency")
    values = np.concatenate([columns["value"] for _, columns, _ in branches])
    style.set_ticks(lower.xaxis, float(values.min()), float(values.max()), units, key)
    figure.align_ylabels()
    upper.legend(loc="best")
    return figure


def _number(group: str) -> int:
    digits = group.rpartition("_")[2]
    return int(digits) if digits.isdigit() else 0


def _other_mode(frequency: style.Array, multipliers: style.Array) -> style.Array:
    """The places of steady sliding at which another mode is the least stable one than at the place before.

    Multipliers are those of a period of the least stable mode, so that their angles say how far the other one is.
    Modes change places only where they are equally stable: between both places the gap of their moduli closes, as
    fast as it changes beside them. After flutter it stays open, and their frequencies are nearly the same.
    """
    angles = np.abs(np.arctan2(multipliers[..., 1], multipliers[..., 0])).max(axis=1) / (2.0 * np.pi)
    before = frequency[:-1]
    after = frequency[1:]
    apart = (angles * frequency)[:-1]
    other = np.minimum(np.abs(after - before - apart), np.abs(after - before + apart))
    gap = np.ptp(np.hypot(multipliers[..., 0], multipliers[..., 1]), axis=1)
    beside = np.pad(np.abs(np.diff(gap)), 1)
    closes = gap[:-1] + gap[1:] <= 2.0 * np.maximum(beside[:-2], beside[2:]) + 1e-9  # rounding
    return 1 + np.flatnonzero(closes & (other < np.abs(after - before)))


def _with_ends(columns: dict[str, Any], marks: dict[str, Any]) -> dict[str, Any]:
    """A branch with the special points between its motions at which it gains or loses its stability."""
    values = columns["value"]
    at = np.asarray(marks["value"], float)
    for place in np.flatnonzero(np.diff(columns["stable"]))[::-1].tolist():
        low, high = sorted(values[place : place + 2].tolist())
        for mark in np.flatnonzero((low < at) & (at < high))[:1].tolist():
            middle = {name: float(each[place : place + 2].mean()) for name, each in columns.items()}
            there = {name: float(marks[name][mark]) if name in marks else middle[name] for name in columns}
            there["stable"] = 1.0
            columns = {name: np.insert(each, place + 1, there[name]) for name, each in columns.items()}
    return columns


def _line(axes: Axes, columns: dict[str, Any], name: str, colour: str) -> None:
    """One quantity of a branch: full between stable motions, dashed elsewhere."""
    stable = columns["stable"].astype(bool)
    for full, part in groupby(range(len(stable) - 1), lambda place: bool(stable[place : place + 2].all())):
        inside = [*part]
        inside.append(inside[-1] + 1)
        look: dict[str, Any] = {"ls": "-", "lw": 1.8} if full else {"ls": style.DASHES, "lw": 1.2}
        axes.plot(columns["value"][inside], columns[name][inside], color=colour, **look)


def _marks(
    axes: Axes, marks: dict[str, Any], name: str, colour: str, shown: set[str] | None, hidden: bool
) -> None:
    """The special points, where they have this number; each kind is named once in the legend."""
    if name not in marks:
        return
    for kind, value, height in zip(marks["kind"], marks["value"], marks[name], strict=True):
        if str(kind) not in _MARKERS or str(kind) == "end" or (hidden and name == "amplitude") or height <= 0.0:
            continue
        label = None if shown is None or str(kind) in shown else str(kind)
        if shown is not None:
            shown.add(str(kind))
        look: dict[str, Any] = {
            "marker": _MARKERS[str(kind)],
            "ms": 5.5,
            "mfc": "white",
            "ls": "none",
            "zorder": 3.0,
        }
        axes.plot([float(value)], [float(height)], color=colour, label=label, **look)
