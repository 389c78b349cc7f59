"""Pictures of results. That of a run: motion in detail, whole history, phase portrait and spectrum."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import UsageError
from brakecli.files.atomic import new_output
from brakecli.files.read import StoredResult, open_result
from brakecli.plots.run import Array, Detail, Picture, episodes, gather, prefixed
from brakecli.plots.style import BLUE, DASHES, GREEN, GREY, ORANGE, VERMILION, check_target, headed, layout, render
from brakecli.solver.quantities import ContactState

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHADES = ((ContactState.STICK, ORANGE, "stick"), (ContactState.SEPARATED, GREY, "no contact"))


def plot_result(result: Path, target: Path, *, force: bool, select: Sequence[str] = ()) -> None:
    """Draw a result, by its kind, into a PNG, PDF or SVG file, by the suffix of `target`.

    `select` holds `KEY=VALUE` for axes of a sweep of which one value is to be drawn. Raises UsageError for another
    suffix, an existing target without `force`, for what cannot be drawn or selected, or where matplotlib is
    missing; UnreadableResultError; CannotWriteError.
    """
    check_target(result, target)
    with open_result(result) as stored, new_output(target, force=force) as file:
        file.write(render(_drawing(stored, select), target.suffix.lower()))
        file.publish()


def _drawing(stored: StoredResult, select: Sequence[str]) -> Callable[[], "Figure"]:
    """What draws this result; all that it draws is read here."""
    kind = stored.attributes.get("kind")
    if kind == "sweep":
        from brakecli.plots.sweep.figure import draw_sweep
        from brakecli.plots.sweep.picture import gather_sweep

        return partial(draw_sweep, gather_sweep(stored, select))
    if kind not in ("run", "comparison"):
        known = "a run, of a sweep or of a comparison"
        raise UsageError(f"{stored.path}: holds a result of kind {kind!r}; name the result of {known}")
    if select:
        raise UsageError(f"{stored.path}: --select is for sweeps (found {select[0]!r}); leave it out for a {kind}")
    if kind == "comparison":
        from brakecli.plots.comparison import draw_comparison, gather_comparison

        return partial(draw_comparison, gather_comparison(stored))
    return partial(draw, gather(stored))


def draw(picture: Picture) -> "Figure":
    """The figure with its four panels."""
    figure = headed(10.4, 7.2, picture.title, picture.summary)
    layout(figure).set(wspace=0.05, hspace=0.06)
    panels = figure.subplots(2, 2, width_ratios=(1.55, 1.0))
    _draw_detail(panels[0, 0], picture.detail)
    _draw_portrait(panels[0, 1], picture.detail)
    _draw_history(panels[1, 0], picture)
    _draw_spectrum(panels[1, 1], picture)
    return figure


def _draw_detail(axes: "Axes", detail: Detail) -> None:
    factor, unit = prefixed(_reach(detail), "m/s")
    axes.plot(detail.time, factor * detail.vx, color=BLUE, marker=_marker(detail.time))
    for state, colour, label in _SHADES:
        spans = [
            (detail.time[first] - 0.5 * detail.interval, (last - first + 1) * detail.interval)
            for first, last in episodes(detail.state, state)
        ]
        if spans:
            across = axes.get_xaxis_transform()
            axes.broken_barh(
                spans, (0, 1), transform=across, color=colour, alpha=0.3, lw=0, zorder=0.5, label=label
            )
    if _is_near(detail):
        label = f"U = {factor * detail.belt[-1]:.4g} {unit}" if np.ptp(detail.belt) == 0.0 else "U"
        axes.plot(detail.time, factor * detail.belt, color=VERMILION, ls=DASHES, lw=1.1, label=label)
    if len(detail.time) > 1:
        axes.set_xlim(detail.time[0], detail.time[-1])
    axes.set(title=f"{detail.name}: tangential velocity", xlabel="time (s)", ylabel=f"velocity ẋ ({unit})")
    _note_far(axes, detail)
    _legend_above(axes)


def _draw_portrait(axes: "Axes", detail: Detail) -> None:
    centre = _centre(detail.x)
    x_factor, x_unit = prefixed(_largest(detail.x - centre), "m")
    factor, unit = prefixed(_reach(detail), "m/s")
    x, vx = x_factor * (detail.x - centre), factor * detail.vx
    axes.plot(x, vx, color=BLUE, lw=0.9, marker=_marker(x))
    stick = detail.state == ContactState.STICK
    axes.plot(x[stick], vx[stick], color=ORANGE, ls="none", marker="o", ms=3.0)
    if _is_near(detail):
        for value in sorted({float(detail.belt.min()), float(detail.belt.max())}):
            axes.axhline(factor * value, color=VERMILION, ls=DASHES, lw=1.1)
    axes.locator_params(axis="x", nbins=6)
    about = f" − ({centre:.12g} m)".replace("-", "−") if centre else ""
    axes.set(title="Phase portrait", xlabel=f"displacement x{about} ({x_unit})", ylabel=f"velocity ẋ ({unit})")
    _note_far(axes, detail)


def _is_near(detail: Detail) -> bool:
    """Whether the wheel's surface speed fits beside the motion without flattening it."""
    moving = _largest(detail.vx)
    return moving == 0.0 or _largest(detail.belt) <= 4.0 * moving


def _reach(detail: Detail) -> float:
    """The largest velocity (m/s) to be drawn."""
    return max(_largest(detail.vx), _largest(detail.belt) if _is_near(detail) else 0.0)


def _note_far(axes: "Axes", detail: Detail) -> None:
    if not _is_near(detail):
        note = f"U = {detail.belt[-1]:.4g} m/s, off the scale"
        axes.set_title(note, loc="right", size=8.5, color=VERMILION)


def _draw_history(axes: "Axes", picture: Picture) -> None:
    factor, unit = prefixed(max(_largest(picture.lowest), _largest(picture.highest)), "m")
    time, detail = picture.time, picture.detail.time
    axes.fill_between(time, factor * picture.lowest, factor * picture.highest, color=BLUE, lw=0.9)
    if len(time) < 3:
        axes.plot(time, factor * picture.lowest, color=BLUE, marker="o", ms=4.0)
    if len(detail) > 1 and detail[-1] - detail[0] < 0.9 * (picture.span[1] - picture.span[0]):
        axes.axvspan(detail[0], detail[-1], color=GREEN, alpha=0.25, lw=0, zorder=0.5, label="drawn above")
    if picture.span[1] > picture.span[0]:
        axes.set_xlim(*picture.span)
    _legend_above(axes)
    axes.set(title="Whole run: tangential displacement", xlabel="time (s)", ylabel=f"displacement x ({unit})")


def _draw_spectrum(axes: "Axes", picture: Picture) -> None:
    axes.set(title=f"Spectrum of ẋ from {picture.spectrum_from:.4g} s on")
    axes.set(xlabel="frequency (Hz)", ylabel="power spectral density ((m/s)²/Hz)")
    shown = picture.density > 0.0
    shown[:1] = False  # the mean was removed
    if not shown.any():
        axes.set(xticks=[], yticks=[])
        axes.text(0.5, 0.5, "no motion", transform=axes.transAxes, ha="center", color="#666666")
        return
    line = picture.fundamental or picture.peak
    highest = min(picture.frequency[-1], max([6.5 * (line or np.inf), *(1.3 * f for f in picture.passing)]))
    near = shown & (picture.frequency <= highest)
    near = near if near.any() else shown
    frequency, density = picture.frequency[near], picture.density[near]
    lowest = max(0.3 * float(density.min()), 1e-10 * float(density.max()))
    axes.semilogy(frequency, density, color=BLUE, lw=1.0, marker=_marker(frequency))
    axes.set_ylim(lowest, 30.0 * float(density.max()))
    axes.set_xlim(0.0, min(highest, max(1.3 * float(frequency[density > lowest][-1]), 2.0 * (line or 0.0))))
    words = "fundamental" if picture.fundamental else "highest peak"
    for wave in picture.passing:
        label = "waves of the wheel pass" if wave == picture.passing[0] else None
        axes.axvline(wave, color=VERMILION, ls=DASHES, lw=0.9, zorder=0.8, label=label)
    if line:
        axes.axvline(line, color=GREEN, ls=(0, (1, 1.5)), lw=1.4, zorder=0.9, label=f"{words} {line:.4g} Hz")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper right")


def _legend_above(axes: "Axes") -> None:
    """A legend, if there is anything to tell, with room for it above the data."""
    if axes.get_legend_handles_labels()[1]:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.14 * (high - low))
        axes.legend(loc="upper right", ncols=3)


def _marker(values: NDArray[Any]) -> str:
    """Dots where samples are so few that a line would not show them."""
    return "." if len(values) < 40 else ""


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _centre(values: Array) -> float:
    """What to subtract from values that differ too little for readable ticks, in round numbers; else 0."""
    middle, width = 0.5 * float(values.min() + values.max()), float(np.ptp(values))
    if not 0.0 < width < 0.1 * abs(middle):
        return 0.0
    digits = math.ceil(math.log10(abs(middle) / width))
    return float(f"{middle:.{digits}e}")
