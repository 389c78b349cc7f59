"""The picture of a run: motion in detail, whole history, phase portrait and spectrum.

The history is read in pieces: a run of 10^8 samples takes no more memory than a short one.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.files.read import StoredResult
from brakecli.plots import style
from brakecli.solver.quantities import ContactState

CYCLES = 12  # drawn in detail
MOST_DETAIL = 100_000  # samples drawn one by one
FEW = 4000  # samples of the detail where no frequency says how long a cycle is
COLUMNS = 1200  # columns of the envelope: about the width of its panel in pixels
BLOCK = 1 << 20  # samples read at a time
_SHADES = ((ContactState.STICK, style.ORANGE, "stick"), (ContactState.SEPARATED, style.GREY, "no contact"))
_BELT: dict[str, Any] = {"color": style.VERMILION, "ls": style.DASHES}


class RunPicture:
    """Everything that is drawn of a run, in SI units.

    `detail` holds the samples that are drawn one by one: time, x, vx, state and belt (U); `part` names them.
    """

    def __init__(self, result: StoredResult) -> None:
        """Read it from a result; raises UnreadableResultError where it is not there."""
        variables, needed = result.variables("history"), ("time", "x", "vx", "state")
        shapes = {variables[name].shape if name in variables else (0,) for name in needed}
        if len(shapes) != 1 or not (samples := max(shapes)[0]):
            raise style.unreadable(result, f"its history has no {', '.join(needed)} of equal length above 0")
        try:
            case = parse_case(str(result.attributes.get("resolved_toml", "")), "its resolved case").case
        except CaseError as error:
            raise style.unreadable(result, f"the case in it is not valid: {error.problems[0]}") from error
        system, read = system_of(case), partial(result.read, "history")
        self.title, self.summary = case.title or "Case without a title", _summary(result.attributes)
        start, end = (float(read("time", i, i + 1)[0]) for i in (0, samples - 1))
        self.span = start, end  # s, of the whole run
        self.interval = (end - start) / (samples - 1) if samples > 1 else case.output.sample_interval
        self.part, first, stop = _detail(result, samples, self.interval)
        self.detail = {name: read(name, first, stop) for name in needed}
        self.detail["belt"] = np.interp(self.detail["time"], system.belt["time"], system.belt["value"])
        fastest, moving = style.largest(self.detail["belt"]), style.largest(self.detail["vx"])
        self.near = moving == 0.0 or fastest <= 4.0 * moving  # U fits beside the motion without flattening it
        self.velocity_unit = style.prefixed(max(moving, fastest if self.near else 0.0), "m/s")
        places, lowest, highest = envelope(partial(read, "x"), samples)
        self.envelope = start + self.interval * places, lowest, highest
        settled = start + self.interval * float(result.group_attributes("spectrum").get("first_sample", 0))
        self.spectrum = settled, result.read("spectrum", "frequency"), result.read("spectrum", "vx")
        fundamental, peak = (result.attributes.get(name) for name in ("frequency", "spectrum_peak"))
        self.line = ("fundamental", fundamental) if fundamental else ("highest peak", peak)  # Hz
        self.resolution = result.attributes.get("frequency_resolution")  # Hz, not in older files
        steady, speed = np.ptp(system.belt["value"]) == 0.0, system.fastest_belt
        self.passing = tuple(sorted(speed * system.wheel.turns)) if steady and speed else ()  # Hz, of its waves


def envelope(read: Callable[[int, int], style.Array], samples: int, columns: int = COLUMNS) -> list[style.Array]:
    """Middle (in samples) of each column, least and greatest value of the samples that fall into it.

    Columns are equally wide; there are never more of them than samples. At most `BLOCK` samples are read at once.
    """
    columns = min(columns, samples)
    lowest, highest = np.full(columns, np.inf), np.full(columns, -np.inf)
    for begin in range(0, samples, BLOCK):
        values = read(begin, min(begin + BLOCK, samples))
        column = np.arange(begin, begin + len(values)) * columns // samples
        np.minimum.at(lowest, column, values)
        np.maximum.at(highest, column, values)
    firsts = -(-np.arange(columns + 1) * samples // columns)
    return [0.5 * (firsts[:-1] + firsts[1:] - 1), lowest, highest]


def episodes(state: style.Array, wanted: ContactState) -> list[tuple[int, int]]:
    """First and last sample of every unbroken stretch of a state."""
    edges = np.flatnonzero(np.diff(state == wanted, prepend=False, append=False))
    return [(int(first), int(behind) - 1) for first, behind in edges.reshape(-1, 2)]


def _detail(result: StoredResult, samples: int, interval: float) -> tuple[str, int, int]:
    """Name, first sample and end of the last cycles of the run, or of the motion where it has come to rest."""
    fundamental = result.attributes.get("frequency")
    frequency = fundamental or result.attributes.get("spectrum_peak")
    wanted = CYCLES / (frequency * interval) if frequency else FEW
    length = min(samples, max(2, round(min(wanted, MOST_DETAIL))))
    if fundamental:
        return "Settled motion", samples - length, samples
    if result.attributes.get("status") == "failed":
        return "Motion up to the failure", samples - length, samples
    for begin in range((samples - 1) // BLOCK * BLOCK, -1, -BLOCK):
        moving = np.flatnonzero(result.read("history", "state", begin, begin + BLOCK) != ContactState.STICK)
        if moving.size:
            break
    rest = (begin + int(moving[-1]) if moving.size else -1) + length // 8 + 2
    if rest < samples:
        return "Last motion, then stick", max(0, rest - length), rest
    return "End of the run" if length < samples else "Whole run", samples - length, samples


def _summary(attributes: dict[str, Any]) -> str:
    """Regime, excitation and numbers in one line."""
    if attributes.get("status") == "failed":
        return f"failed at {str(attributes.get('failure', '')).partition(';')[0]}"
    regime, excitation = attributes.get("regime"), attributes.get("excitation")
    parts = [f"{regime}" if excitation == "none" else f"{regime}, {excitation}"]
    if regime == "undecided":
        parts[0] += f": {'; '.join(attributes.get('reasons', ()))}"
    if frequency := attributes.get("frequency"):
        parts.append(f"{frequency:.4g} Hz")
    if (amplitude := attributes.get("amplitude")) and excitation != "none":
        factor, unit = style.prefixed(amplitude, "m")
        parts.append(f"amplitude of x {amplitude * factor:.3g} {unit}")
    for name, words in (("stick_fraction", "stick"), ("contact_loss_fraction", "contact lost")):
        if share := attributes.get(name):
            parts.append(f"{words} {share:.1%} of the time")
    return "   ·   ".join(parts)


def draw(picture: RunPicture) -> Figure:
    """The figure with its four panels."""
    figure = style.headed(10.4, 7.2, picture.title, picture.summary, wspace=0.05, hspace=0.06)
    panels = figure.subplots(2, 2, width_ratios=(1.55, 1.0))
    drawing = (_draw_detail, _draw_portrait, _draw_history, _draw_spectrum)
    for axes, draw_panel in zip(panels.flat, drawing, strict=True):
        draw_panel(axes, picture)
    for axes in panels[0] if not picture.near else ():
        note = f"U = {picture.detail['belt'][-1]:.4g} m/s, off the scale"
        axes.set_title(note, loc="right", size=8.5, color=style.VERMILION)
    spans: tuple[Any, ...] = (picture.detail["time"], picture.span)
    for axes, time in zip(panels[:, 0], spans, strict=True):
        if time[-1] > time[0]:
            axes.set_xlim(time[0], time[-1])
        if axes.get_legend_handles_labels()[1]:  # with room for the legend above the data
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.14 * (high - low))
            axes.legend(loc="upper right", ncols=3)
    return figure


def _draw_detail(axes: Axes, picture: RunPicture) -> None:
    time, belt, interval = picture.detail["time"], picture.detail["belt"], picture.interval
    factor, unit = picture.velocity_unit
    axes.plot(time, factor * picture.detail["vx"], color=style.BLUE, marker=_marker(time))
    look: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "alpha": 0.3, "lw": 0, "zorder": 0.5}
    for state, colour, label in _SHADES:
        found = episodes(picture.detail["state"], state)
        spans = [(time[first] - 0.5 * interval, (last - first + 1) * interval) for first, last in found]
        if spans:
            axes.broken_barh(spans, (0, 1), color=colour, label=label, **look)
    if picture.near:
        label = f"U = {factor * belt[-1]:.4g} {unit}" if np.ptp(belt) == 0.0 else "U"
        axes.plot(time, factor * belt, lw=1.1, label=label, **_BELT)
    axes.set(title=f"{picture.part}: tangential velocity", xlabel="time (s)", ylabel=f"velocity ẋ ({unit})")


def _draw_portrait(axes: Axes, picture: RunPicture) -> None:
    detail, centre = picture.detail, _centre(picture.detail["x"])
    x_factor, x_unit = style.prefixed(style.largest(detail["x"] - centre), "m")
    factor, unit = picture.velocity_unit
    x, vx = x_factor * (detail["x"] - centre), factor * detail["vx"]
    axes.plot(x, vx, color=style.BLUE, lw=0.9, marker=_marker(x))
    stick = detail["state"] == ContactState.STICK
    axes.plot(x[stick], vx[stick], color=style.ORANGE, ls="none", marker="o", ms=3.0)
    for speed in np.unique([detail["belt"].min(), detail["belt"].max()]) if picture.near else ():
        axes.axhline(factor * speed, lw=1.1, **_BELT)
    axes.locator_params(axis="x", nbins=6)
    about = f" − ({centre:.12g} m)".replace("-", "−") if centre else ""
    axes.set(title="Phase portrait", xlabel=f"displacement x{about} ({x_unit})", ylabel=f"velocity ẋ ({unit})")


def _draw_history(axes: Axes, picture: RunPicture) -> None:
    time, lowest, highest = picture.envelope
    factor, unit = style.prefixed(max(style.largest(lowest), style.largest(highest)), "m")
    axes.fill_between(time, factor * lowest, factor * highest, color=style.BLUE, lw=0.9)
    if len(time) < 3:
        axes.plot(time, factor * lowest, color=style.BLUE, marker="o", ms=4.0)
    first, last = picture.detail["time"][[0, -1]]
    if first < last < first + 0.9 * (picture.span[1] - picture.span[0]):
        axes.axvspan(first, last, color=style.GREEN, alpha=0.25, lw=0, zorder=0.5, label="drawn above")
    axes.set(title="Whole run: tangential displacement", xlabel="time (s)", ylabel=f"displacement x ({unit})")


def _draw_spectrum(axes: Axes, picture: RunPicture) -> None:
    start, frequency, density = picture.spectrum
    axes.set(title=f"Spectrum of ẋ from {start:.4g} s on", xlabel="frequency (Hz)")
    axes.set_ylabel("power spectral density ((m/s)²/Hz)")
    shown = density > 0.0
    shown[:1] = False  # the mean was removed
    if not shown.any():
        axes.set(xticks=[], yticks=[])
        axes.text(0.5, 0.5, "no motion", transform=axes.transAxes, ha="center", color="#666666")
        return
    name, line = picture.line
    highest = min(frequency[-1], max([6.5 * (line or np.inf), *(1.3 * f for f in picture.passing)]))
    near = shown & (frequency <= highest)
    near = near if near.any() else shown
    frequency, density = frequency[near], density[near]
    lowest = max(0.3 * float(density.min()), 1e-10 * float(density.max()))
    axes.semilogy(frequency, density, color=style.BLUE, lw=1.0, marker=_marker(frequency))
    axes.set_ylim(lowest, 30.0 * float(density.max()))
    axes.set_xlim(0.0, min(highest, max(1.3 * float(frequency[density > lowest][-1]), 2.0 * (line or 0.0))))
    for number, wave in enumerate(picture.passing):
        axes.axvline(wave, lw=0.9, zorder=0.8, label="" if number else "waves of the wheel pass", **_BELT)
    if line:
        known = f" ± {picture.resolution:.2g}" if picture.resolution and name != "fundamental" else ""
        label = f"{name} {line:.4g}{known} Hz"
        axes.axvline(line, color=style.GREEN, ls=style.DOTS, lw=1.4, zorder=0.9, label=label)
    if picture.passing or line:
        axes.legend(loc="upper right")


def _marker(values: style.Array) -> str:
    return "." if len(values) < 40 else ""  # a line alone would not show so few samples


def _centre(values: style.Array) -> float:
    """What to subtract from values that differ too little for readable ticks, in round numbers; otherwise 0."""
    middle, width = 0.5 * float(values.min() + values.max()), float(np.ptp(values))
    if not 0.0 < width < 0.1 * abs(middle):
        return 0.0
    digits = math.ceil(math.log10(abs(middle) / width))
    return float(f"{middle:.{digits}e}")
