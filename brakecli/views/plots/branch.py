"""Branches along a key: amplitude above, frequency below; stable motions full, unstable ones dashed."""

import math
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.errors import UsageError
from brakecli.faces import argument
from brakecli.results.read import StoredResult
from brakecli.views.plots import style

_OF_ALL = style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, "#CC79A7", "#56B4E9"  # Okabe and Ito
_COLOURS = (*_OF_ALL, "#7F4F24", "#6A3D9A", "#808000", "#1A237E", "#B2182B")  # of twelve with steady sliding
_SIZE = 4.0  # of a mark, in points
_MARKERS = {
    "flutter": "o",
    "divergence": "X",
    "fold": "s",
    "flip": "D",
    "torus": "^",
    "branch point": "P",
    "grazing stick": "v",
    "grazing flight": "d",
    "budget": "x",
    "end": "",  # where the line ends, without a mark
}
_SLIDING = "steady sliding"
_QUANTITIES = {  # the words at their axis
    "amplitude": "amplitude of x",
    "amplitude_y": "amplitude of y",
    "amplitude_vx": "amplitude of ẋ",
    "mean_x": "mean of x",
    "mean_y": "mean of y",
    "frequency": "frequency",
    "stick_fraction": "stick fraction",
    "contact_loss_fraction": "contact loss fraction",
}
_SHORT = {"x": "amplitude", "y": "amplitude_y", "vx": "amplitude_vx", "mean": "mean_x"}


@dataclass(frozen=True)
class _Branch:
    """A branch: its motions in columns, and its special points."""

    kind: str
    columns: style.Columns
    marks: style.Columns

    @property
    def slides(self) -> bool:
        """Whether it is steady sliding."""
        return self.kind == _SLIDING


def draw(result: StoredResult, variable: str = "") -> Figure:
    """The figure, with another number of the motions in place of the amplitude.

    Raises UsageError where there is no motion at all, or no such number, and UnreadableResultError.
    """
    above = _SHORT.get(variable, variable) or "amplitude"
    if above not in _QUANTITIES:
        what = f"{argument('variable')} {variable}: is no number of branches that is drawn"
        raise UsageError(f"{result.path}: {what}; give one of {', '.join((*_SHORT, *_QUANTITIES))}")
    groups = sorted(
        (name for name in result.groups if name.startswith("branch_") and "/" not in name), key=_number
    )
    names = dict.fromkeys((above, "frequency"))
    branches = [_read(result, group, [*names]) for group in groups]
    values = np.concatenate([np.zeros(0), *(branch.columns["value"] for branch in branches)])
    if not len(values):
        raise UsageError(f"{result.path}: holds no motion, so there is nothing to draw")
    variables = result.variables(groups[0])
    attributes = result.attributes
    lines = str(attributes.get("title", "")), str(attributes.get("sentence", ""))
    kinds = {str(kind) for branch in branches for kind in branch.marks["kind"]} & {*filter(_MARKERS.get, _MARKERS)}
    thresholds = (
        ("critical", "squeals by itself", style.DOTS),
        ("coexists_from", "can vibrate", (0, (6, 2, 1, 2))),
    )
    in_row = 2 if style.is_narrow() else 4
    rows = math.ceil((len(branches) + len(kinds) + len(thresholds)) / in_row)  # of the legend
    figure = style.headed(8.8, 6.6 + 0.19 * rows, *lines, hspace=0.05)
    heights = [1.6, 1.0][: len(names)]
    panels = figure.subplots(len(names), 1, sharex=True, height_ratios=heights, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        _panel(axes, branches, name, style.unit_of(variables[name].attributes))
        for threshold, text, look in thresholds:
            value = attributes.get(threshold)
            if isinstance(value, int | float) and math.isfinite(value):
                label = f"{text} from {value:.4g} on"
                axes.axvline(float(value), color=style.GREY, lw=1.1, ls=look, zorder=1.5, label=label)
    key = str(attributes.get("parameter", ""))
    units = style.unit_of(variables["value"].attributes)
    style.set_ticks(panels[-1].xaxis, float(values.min()), float(values.max()), units, key)
    figure.align_ylabels()
    for axes in panels:
        _thin_marks(axes)
    shown = style.labels(panels[:1])
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=in_row, frameon=False)
    return figure


def _read(result: StoredResult, group: str, names: list[str]) -> _Branch:
    """A branch; raises UsageError where its file is too old for one of these numbers."""
    variables = result.variables(group)
    if lacking := [name for name in names if name not in variables]:
        problem = f"its branches have no {lacking[0]}, which older versions did not compute"
        raise UsageError(f"{result.path}: {problem}; follow them again, with brakecli branch")
    inner = f"{group}/special"
    columns = {name: style.read_column(result, name, group).astype(float) for name in ("value", "stable", *names)}
    there = [name for name in ("kind", "value", *names) if name in result.variables(inner)]
    marks = {name: style.read_column(result, name, inner) for name in there}
    kind = str(result.group_attributes(group).get("kind", ""))
    return _Branch(kind, _with_ends(columns, marks), marks)


def _panel(axes: Axes, branches: list[_Branch], name: str, unit: str) -> None:
    """One number of all motions."""
    drawn = np.concatenate([branch.columns[name] for branch in branches])
    sizes = np.concatenate([np.zeros(0), *(branch.columns[name] for branch in branches if not branch.slides)])
    sizes = sizes[sizes > 0.0]
    floor = -np.inf
    if name.startswith("amplitude") and len(sizes) and sizes.max() > 30.0 * sizes.min():
        axes.set_yscale("log")
        floor = 0.4 * float(sizes.min())  # there steady sliding stands, as 0 has no place on such an axis
    kinds = [branch.kind for branch in branches]
    for number, branch in enumerate(branches):
        colour = style.DARK if branch.slides else _COLOURS[(number - 1) % len(_COLOURS)]
        label = branch.kind + ", amplitude 0" * (branch.slides and floor > 0.0)
        label += f", branch {number}" * (kinds.count(branch.kind) > 1)  # as the table in the terminal names it
        axes.plot([], [], color=colour, lw=1.8, label=label)
        _line(axes, {**branch.columns, name: np.maximum(branch.columns[name], floor)}, name, colour)
        _marks(axes, branch.marks, name, colour, floor)
    if not all(branch.columns["stable"].all() for branch in branches):
        axes.plot([], [], color=style.GREY, lw=1.2, ls=style.DASHES, label="unstable")
    style.set_ticks(axes.yaxis, max(floor, 0.0), style.largest(drawn), unit, _QUANTITIES[name])


def _number(group: str) -> int:
    digits = group.rpartition("_")[2]
    return int(digits) if digits.isdigit() else 0


def _with_ends(columns: style.Columns, marks: style.Columns) -> style.Columns:
    """A branch with the special points between its motions at which it gains or loses its stability."""
    values = columns["value"]
    at = np.asarray(marks["value"], float)
    for index in np.flatnonzero(np.diff(columns["stable"]))[::-1].tolist():
        low, high = sorted(values[index : index + 2].tolist())
        for mark in np.flatnonzero((low < at) & (at < high))[:1].tolist():
            middle = {name: float(column[index : index + 2].mean()) for name, column in columns.items()}
            there = {name: float(marks[name][mark]) if name in marks else middle[name] for name in columns}
            there["stable"] = 1.0
            columns = {name: np.insert(column, index + 1, there[name]) for name, column in columns.items()}
    return columns


def _line(axes: Axes, columns: style.Columns, name: str, colour: str) -> None:
    """One quantity of a branch: full between stable motions, dashed elsewhere."""
    stable = columns["stable"].astype(bool)
    for full, stretch in groupby(range(len(stable) - 1), lambda index: bool(stable[index : index + 2].all())):
        inside = [*stretch]
        inside.append(inside[-1] + 1)
        look: style.Look = {"ls": "-", "lw": 1.8} if full else {"ls": style.DASHES, "lw": 1.2}
        axes.plot(columns["value"][inside], columns[name][inside], color=colour, **look)


def _thin_marks(axes: Axes) -> None:
    """Leave one of several marks of a kind, and of a branch, that would lie on each other."""
    axes.get_xlim(), axes.get_ylim()  # so that they are those of all that is drawn
    figure = axes.get_figure(root=True)
    # by one and a half widths of a mark two of one kind are told apart; a choice
    apart = 1.5 * _SIZE / 72.0 * figure.get_dpi() if figure else 0.0
    drawn = list[tuple[object, float, float]]()
    for line in [marker for marker in axes.get_lines() if marker.get_marker() not in ("None", "")]:
        ((x, y),) = axes.transData.transform(line.get_xydata())
        kind = line.get_label(), line.get_color()
        if any(kind == other and math.hypot(x - a, y - b) < apart for other, a, b in drawn):
            line.remove()
        else:
            drawn.append((kind, x, y))


def _marks(axes: Axes, marks: style.Columns, name: str, colour: str, floor: float) -> None:
    """The special points, where they have this number."""
    if name not in marks:
        return
    for kind, value, height in zip(marks["kind"], marks["value"], marks[name], strict=True):
        if (marker := _MARKERS.get(str(kind))) and np.isfinite(height) and (name != "frequency" or height > 0.0):
            look: style.Look = {"marker": marker, "ms": _SIZE, "mfc": "white", "ls": "none", "zorder": 3.0}
            axes.plot([float(value)], [max(float(height), floor)], color=colour, label=str(kind), **look)
