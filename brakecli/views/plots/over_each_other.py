"""Two or three results of one kind, their curves over each other."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.errors import UsageError
from brakecli.faces import argument
from brakecli.results.read import StoredResult
from brakecli.views.plots import style
from brakecli.views.plots.lock_in import FEW
from brakecli.views.plots.quantities import VARIABLES, scaled
from brakecli.views.plots.run import FAINTEST, HARMONICS, RunPicture

_LOOKS: tuple[style.Look, ...] = (  # the wide line is seen behind the thin ones, also in grey
    {"color": "#7DB9DE", "lw": 3.2, "ls": "-"},
    {"color": style.VERMILION, "lw": 1.2, "ls": style.DASHES},
    {"color": style.DARK, "lw": 1.3, "ls": style.DOTS},
)
MOST = len(_LOOKS)
_SHOWN = {"stability": ("frequencies", "growth_rates"), "sweep": ("amplitude", "frequency")}


def draw(
    results: Sequence[StoredResult], variable: str, names: Sequence[str] = (), in_a_row: bool = False
) -> Figure:
    """The figure of two or three results, by the names of their files or others, with panels `in_a_row` or below.

    Raises UsageError where their kind has no curves.
    """
    kind, *others = {str(result.attributes.get("kind")) for result in results}
    if others or kind not in ("run", *_SHOWN):
        what = "only runs, sweeps, or results of stability have curves to compare"
        raise UsageError(f"{results[0].path}: {what}")
    names = names or [result.path.name for result in results]
    if kind == "run":
        return _runs(results, variable or "vx", names, in_a_row)
    return _curves(results, kind, variable, names, in_a_row)


def _panels(
    count: int, height: float, title: str, lines: Sequence[str], in_a_row: bool
) -> tuple[Figure, style.Array]:
    """A figure with so many panels in a row, or below each other, each so high (inches)."""
    columns = count if in_a_row else 1
    rows = 1 if in_a_row else count
    width = 9.4 * (1.3 if in_a_row else 1.0)
    figure = style.headed(width, 0.3 + height * rows, title, *lines, columns=columns, hspace=0.06)
    return figure, style.panels(figure, rows, columns).ravel()


def _runs(results: Sequence[StoredResult], variable: str, names: Sequence[str], in_a_row: bool) -> Figure:
    pictures = [RunPicture(result, variable) for result in results]
    lines = [f"{name}: {picture.summary}" for name, picture in zip(names, pictures, strict=True)]
    titles = {picture.title for picture in pictures}
    title = pictures[0].title if len(titles) == 1 else "Runs beside each other"
    figure, panels = _panels(3, 2.8, title, lines, in_a_row)
    same_end = len({picture.detail["time"][-1] for picture in pictures}) == 1
    times = [picture.detail["time"] for picture in pictures]
    times = [time - (0.0 if same_end else time[-1]) for time in times]
    ends = [max(float(time[0]) for time in times), max(float(time[-1]) for time in times)]  # of the shortest part
    inside = [time >= ends[0] for time in times]
    details = [picture.detail[variable][shown] for picture, shown in zip(pictures, inside, strict=True)]
    look = scaled(variable, np.concatenate(details), np.concatenate(details))
    envelopes = [_wider(picture) for picture in pictures]
    whole = np.concatenate([end for envelope in envelopes for end in envelope[1:]])
    shown = pictures[0].whole
    whole_look = scaled(shown, whole, whole)
    highest = max((picture.spectrum.density for picture in pictures), key=style.largest)
    scale, label = style.density(highest, pictures[0].spectrum.frequency, VARIABLES[variable].unit)
    label = label.removeprefix("power spectral ") if style.is_narrow() or in_a_row else label
    for number, (name, picture, curve) in enumerate(zip(names, pictures, _LOOKS, strict=False)):
        panels[0].plot(times[number][inside[number]], look(details[number]), label=_plain(name), **curve)
        time, *bounds = envelopes[number]
        lowest, highest = map(whole_look, bounds)
        if number == 0:
            panels[1].fill_between(time, lowest, highest, color=curve["color"], lw=1.5)
        else:
            panels[1].plot(time, lowest, time, highest, **curve)
        _, frequency, density = picture.spectrum
        panels[2].semilogy(frequency[1:], scale * np.where(density > 0.0, density, np.nan)[1:], **curve)
    _along(panels[0], "time" if same_end else "time before the end of each part", ends, "s")
    detail_names = {picture.detail_name for picture in pictures}
    detail_name = pictures[0].detail_name if len(detail_names) == 1 else "Last part of each"
    panels[0].set(title=f"{detail_name}: {VARIABLES[variable].title}", ylabel=look.label)
    small = style.is_narrow() or in_a_row
    style.make_room(panels[0], 0.2 * len(results) if small else 0.2)
    panels[0].legend(loc="upper right", ncols=1 if small else len(results))
    spans = [edge for picture in pictures for edge in picture.span]
    _along(panels[1], "time", [min(spans), max(spans)], "s")
    more = "" if small else ", least and largest"
    panels[1].set(title=f"Whole runs: {VARIABLES[shown].title}{more}", ylabel=whole_look.label)
    _spectra(panels[2], pictures, variable, scale, label)
    figure.align_ylabels()
    return figure


def _wider(picture: RunPicture) -> list[style.Array]:
    """An envelope of a hundred columns, so that each holds a cycle or more; the last one reaches to the end."""
    time, lowest, highest = picture.envelope
    end = picture.span[1]
    first = np.arange(0, len(time), max(1, len(time) // 100))
    low = np.minimum.reduceat(lowest, first)
    high = np.maximum.reduceat(highest, first)
    return [np.append(time[first], end), np.append(low, low[-1]), np.append(high, high[-1])]


def _spectra(axes: Axes, pictures: list[RunPicture], variable: str, scale: float, label: str) -> None:
    """Limits and labels of the spectra, by the lines that both runs have."""
    lines = [HARMONICS * line for picture in pictures if (line := picture.line[1])]
    highest = min(max(picture.spectrum.frequency[-1] for picture in pictures), max(lines, default=np.inf))
    most = scale * max(style.largest(picture.spectrum.density) for picture in pictures)
    if most:
        axes.set_ylim(FAINTEST * most, 10.0 * most)
    _along(axes, "frequency", [0.0, float(highest)], "Hz")
    axes.set(title=f"Spectra of {VARIABLES[variable].symbol}", ylabel=label)


def _along(axes: Axes, name: str, ends: list[float], unit: str) -> None:
    low, high = ends
    if low < high:
        axes.set_xlim(low, high)
    style.set_ticks(axes.xaxis, low, high, unit, name)


def _plain(name: str) -> str:
    """A name for a legend, in which dollar signs would begin a formula."""
    return name.replace("$", r"\$")


def _curves(
    results: Sequence[StoredResult], kind: str, variable: str, labels: Sequence[str], in_a_row: bool
) -> Figure:
    """Numbers along the one axis that all results have."""
    variables = results[0].variables("/")
    critical = kind == "sweep" and all("critical" in result.variables("/") for result in results)
    names = (variable,) if variable else ("critical",) if critical else _SHOWN[kind]
    axis = _axis_of(results, names)
    units = {name: style.unit_of(variables[name].attributes) for name in (axis, *names)}
    title = str(results[0].attributes.get("title", "")) or "Results beside each other"
    summary = " and ".join(filter(None, (", ".join(labels[:-1]), labels[-1])))
    height = 2.8 if in_a_row else 2.2 + 2.3 / len(names)
    figure, panels = _panels(len(names), height, title, [summary], in_a_row)
    places = [style.read_column(result, axis) for result in results]
    for axes, name in zip(panels, names, strict=True):
        columns = [style.read_column(result, name) for result in results]
        for label, x, values, look in zip(labels, places, columns, _LOOKS, strict=False):
            order = np.argsort(x, kind="stable")
            for number, line in enumerate(values[order].reshape(len(x), -1).T):
                legend = _plain(label) if number == 0 else None
                marker = "o" if len(x) <= FEW else ""
                axes.plot(x[order], line, marker=marker, ms=3.0 + look["lw"], label=legend, **look)
        drawn = np.concatenate([values.ravel() for values in columns])
        if name == "frequency" and np.isfinite(drawn).any():
            style.widen(axes, drawn)
        words = str(name).replace("_", " ")
        style.set_ticks(axes.yaxis, 0.0, max(map(style.largest, columns)), units[name], words)
    both = np.concatenate(places)
    words = str(variables[axis].attributes.get("long_name", axis))
    for axes in panels:
        style.set_ticks(axes.xaxis, float(both.min()), float(both.max()), units[axis], words)
        axes.label_outer()
    panels[0].legend(loc="best")
    figure.align_ylabels()
    return figure


def _axis_of(results: Sequence[StoredResult], names: tuple[str, ...]) -> str:
    """The one axis of numbers along which all results have these numbers; raises UsageError without one."""
    stored = [result.variables("/") for result in results]
    files = " and ".join(str(result.path) for result in results)
    for name in names:
        dims = {variables[name].dims if name in variables else () for variables in stored}
        if () in dims or len(dims) > 1 or any(_is_text(result, name) for result in results):
            problem = f"{name} is not a number along the same axes in all of them"
            raise UsageError(
                f"{files}: {problem}; name another {argument('variable')}, or leave {argument('output')} out"
            )
    axes = [dim for dim in stored[0][names[0]].dims if dim != "mode"]
    if len(axes) != 1 or any(_is_text(result, axes[0]) for result in results):
        remedy = f"draw each of them with brakecli plot, and leave {argument('output')} out"
        raise UsageError(f"{files}: only numbers along one axis of numbers are curves; {remedy}")
    return axes[0]


def _is_text(result: StoredResult, name: str) -> bool:
    return result.read("/", name, 0, 1).dtype.kind == "U"
