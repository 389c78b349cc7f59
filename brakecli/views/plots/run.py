"""The picture of a run: a quantity in detail, whole history, phase portrait and spectrum.

The history is read in pieces: a run of 10^8 samples takes no more memory than a short one.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.analysis.stability.modes import modes
from brakecli.case.read import LoadedCase, parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UsageError
from brakecli.faces import argument
from brakecli.results.numbers import stored_numbers
from brakecli.results.read import BLOCK, StoredResult
from brakecli.solver.quantities import ContactState
from brakecli.solver.schedules import times, values
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import System
from brakecli.studies.runs.work import stability_work, table_work
from brakecli.views.motion import motion_sentence
from brakecli.views.plots import style
from brakecli.views.plots.quantities import VARIABLES, Scaled, scaled
from brakecli.views.plots.stop import Stop, draw_amplitude, draw_spectrogram
from brakecli.views.render import TERMINAL

CYCLES = 12  # drawn in detail
MOST_DETAIL = 100_000  # samples drawn one by one
FEW = 4000  # samples of the detail where no frequency says how long a cycle is
COLUMNS = 1200  # columns of the envelope: about the width of its panel in pixels
# times its line, and times a wave or the last frequency that shows, a spectrum reaches
HARMONICS = 6.5
ROOM = 1.3
FAINTEST = 1e-10  # of the largest density: what is below shows rounding
_SHADES = ((ContactState.STICK, style.ORANGE, "stick"), (ContactState.SEPARATED, style.GREY, "no contact"))
_BELT: style.Look = {"color": style.VERMILION, "ls": style.DASHES}


class Spectrum(NamedTuple):
    """Power spectral density of the variable over frequency (Hz), of the motion from `start` (s) on."""

    start: float
    frequency: style.Array
    density: style.Array


class RunPicture:
    """Everything that is drawn of a run, in SI units.

    `detail` holds the samples that are drawn one by one: time, x, state, belt (U), the variable, and what is drawn
    against x, the `ordinate`; `detail_name` names them.
    """

    def __init__(self, result: StoredResult, variable: str = "vx") -> None:
        """Read it from a result; raises UnreadableResultError, or UsageError where no variable has this name."""
        if variable not in VARIABLES:
            problem = f"{argument('variable')} {variable}: a run has no such quantity"
            raise UsageError(f"{result.path}: {problem}; give one of {', '.join(VARIABLES)}")
        self.variable = variable
        self.ordinate = "vx" if variable == "x" else variable
        self.whole = "x" if variable == "vx" else variable
        stored = {name: "friction_force" if name == "torque" else name for name in ("x", self.ordinate, variable)}
        if not (samples := result.variables("history")["time"].shape[0]):
            raise style.unreadable(result, "its history is empty")
        case = case_of(result).case
        system = system_of(case)
        lever = {"torque": case.wheel.radius}

        def read(name: str, first: int, stop: int) -> style.Array:
            return lever.get(name, 1.0) * result.read("history", stored.get(name, name), first, stop)

        self.title = case.title or "Case without a title"
        self.summary = _summary(stored_numbers(result))
        start, end = (float(read("time", i, i + 1)[0]) for i in (0, samples - 1))
        self.span = start, end  # s, of the whole run
        self.interval = (end - start) / (samples - 1) if samples > 1 else case.output.sample_interval
        self.detail_name, first, stop = _detail(result, samples, self.interval)
        self.detail = {name: read(name, first, stop) for name in ("time", "state", *stored)}
        self.detail["belt"] = np.interp(self.detail["time"], times(system.belt), values(system.belt))
        wholes = {name: envelope(partial(read, name), samples) for name in {**stored, self.whole: ""}}
        self.envelope = start + self.interval * wholes["x"][0], *wholes[self.whole][1:]
        fastest = style.largest(self.detail["belt"])
        moving = style.largest(self.detail[self.ordinate])
        speed = fastest if self.ordinate == "vx" else 0.0
        # a wheel that is faster is not drawn beside the shoe, whose curve it would flatten
        self.near = self.ordinate == "vx" and (moving == 0.0 or fastest <= 4.0 * moving)
        ends = {name: np.array(bounds[1:]) for name, bounds in wholes.items()}
        self.axes = {
            name: scaled(name, self.detail[name], ends[name], speed * (name == "vx" and self.near))
            for name in stored
        }
        if speed and style.largest(ends[self.ordinate]) <= style.ROUNDING * speed:
            self.axes["vx"] = scaled("vx", 0.0 * self.detail["vx"], np.zeros(1), speed)
        self.whole_axis = scaled(self.whole, ends[self.whole], ends[self.whole])
        settled = start + self.interval * float(result.group_attributes("spectrum").get("first_sample", 0))
        density = lever.get(variable, 1.0) ** 2 * result.read("spectrum", stored[variable])
        self.spectrum = Spectrum(settled, result.read("spectrum", "frequency"), density)
        fundamental, peak = (result.attributes.get(name) for name in ("frequency", "spectrum_peak"))
        self.line = ("fundamental", fundamental) if fundamental else ("highest peak", peak)  # Hz
        self.resolution = result.attributes.get("frequency_resolution")  # Hz, not in older files
        steady = np.ptp(values(system.belt)) == 0.0
        fastest = system.fastest_belt
        self.passing = tuple(sorted(fastest * system.wheel.turns)) if steady and fastest else ()  # Hz
        self.modes = _mode_frequencies(system)
        self.stop = Stop(result, system) if "spectrogram" in result.file else None


def case_of(result: StoredResult) -> LoadedCase:
    """The case that a result holds; raises UnreadableResultError."""
    try:
        return parse_case(result.text("resolved_toml"), "its resolved case")
    except CaseError as error:
        raise style.unreadable(result, f"the case in it is not valid: {error.problems[0]}") from error


def _mode_frequencies(system: System) -> list[float]:
    """Frequencies (Hz) of the modes of steady sliding, as far as they turn; none where they would take long."""
    if stability_work(system) + table_work(system) > 5.0:  # seconds, or as many more as a machine is slower
        return []
    c = system.coefficients
    equilibrium = sliding(system)
    both = modes(c, equilibrium.stiffness if equilibrium else system.contact_stiffness, c.grip(system.belt_speed))
    return sorted(mode.frequency for mode in both if mode.frequency > 0.0)


def envelope(read: Callable[[int, int], style.Array], samples: int, columns: int = COLUMNS) -> list[style.Array]:
    """Middle (in samples) of each column, least and greatest value of the samples that fall into it.

    Columns are equally wide; there are never more of them than samples. At most `BLOCK` samples are read at once.
    """
    columns = min(columns, samples)
    lowest = np.full(columns, np.inf)
    highest = np.full(columns, -np.inf)
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
    behind = (begin + int(moving[-1]) if moving.size else -1) + length // 8 + 2
    if behind < samples:
        return "Last motion, then stick", max(0, behind - length), behind
    return "End of the run" if length < samples else "Whole run", samples - length, samples


def _summary(attributes: dict[str, Any]) -> str:
    """Regime, excitation and numbers in one line."""
    if attributes.get("status") == "failed":
        return f"failed at {str(attributes.get('failure', '')).partition(';')[0]}"
    if attributes.get("vibrations"):
        return motion_sentence(attributes, TERMINAL)
    regime = attributes.get("regime")
    excitation = attributes.get("excitation")
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
    """The figure with its four panels; two more where speed or load change."""
    rows = 3 if picture.stop else 2
    lines = picture.title, picture.summary
    figure = style.headed(10.4, 3.6 * rows, *lines, columns=2, wspace=0.05, hspace=0.06)
    panels = style.panels(figure, rows, 2, width_ratios=(1.55, 1.0))
    drawing = (_draw_detail, _draw_portrait, _draw_history, _draw_spectrum)
    for axes, draw_panel in zip(panels[:2].flat, drawing, strict=True):
        draw_panel(axes, picture)
    if picture.stop:
        draw_spectrogram(panels[2, 0], picture.stop, picture.modes)
        draw_amplitude(panels[2, 1], picture.stop)
    apart = {"vx": panels[0], "x": panels[0, 1:]}.get(picture.variable, ()) if not picture.near else ()
    for axes in apart[-1:] if style.is_narrow() else apart:  # where its title leaves room
        belt = picture.detail["belt"]
        factor, unit = style.prefixed(style.largest(belt), "m/s")
        size = f"= {factor * belt[-1]:.4g}" if np.ptp(belt) == 0.0 else f"up to {factor * style.largest(belt):.4g}"
        axes.set_title(f"U {size} {unit}, off the scale", loc="right", size=8.5, color=style.VERMILION)
    start, end = map(float, picture.detail["time"][[0, -1]])
    for axes, (first, last) in zip(panels[:, 0], ((start, end), picture.span, picture.span), strict=False):
        style.set_ticks(axes.xaxis, first, last, "s", "time")
        if last > first:
            axes.set_xlim(first, last)
        if axes in panels[:2, 0] and axes.get_legend_handles_labels()[1]:  # which gets room above the data
            style.make_room(axes)
            axes.legend(loc="upper right", ncols=3)
    return figure


def _draw_detail(axes: Axes, picture: RunPicture) -> None:
    time = picture.detail["time"]
    belt = picture.detail["belt"]
    interval = picture.interval
    look_of = picture.axes[picture.variable]
    axes.plot(time, look_of(picture.detail[picture.variable]), color=style.BLUE, marker=_marker(time))
    whole_height = axes.get_xaxis_transform()
    for state, colour, label in _SHADES:
        stretches = episodes(picture.detail["state"], state)
        spans = [(time[first] - 0.5 * interval, (last - first + 1) * interval) for first, last in stretches]
        if spans:
            axes.broken_barh(
                spans, (0, 1), transform=whole_height, color=colour, alpha=0.3, lw=0, zorder=0.5, label=label
            )
    if picture.near and picture.variable == "vx":
        label = f"U = {look_of.factor * belt[-1]:.4g} {look_of.unit}" if np.ptp(belt) == 0.0 else "U"
        axes.plot(time, look_of(belt), lw=1.1, label=label, **_BELT)
    axes.set(title=f"{picture.detail_name}: {VARIABLES[picture.variable].title}", ylabel=look_of.label)
    _limit(axes, look_of)


def _draw_portrait(axes: Axes, picture: RunPicture) -> None:
    along = picture.axes["x"]
    up = picture.axes[picture.ordinate]
    x = along(picture.detail["x"])
    y = up(picture.detail[picture.ordinate])
    marker = "o" if along.limits and up.limits else _marker(x)  # of a point
    axes.plot(x, y, color=style.BLUE, lw=0.9, marker=marker)
    stick = picture.detail["state"] == ContactState.STICK
    axes.plot(x[stick], y[stick], color=style.ORANGE, ls="none", marker="o", ms=3.0)
    belt = picture.detail["belt"]
    for speed in np.unique([belt.min(), belt.max()]) if picture.near else ():
        axes.axhline(up.factor * speed, lw=1.1, **_BELT)
    axes.locator_params(axis="x", nbins=6)
    title = "Phase portrait" if picture.ordinate == "vx" else "Against the displacement"
    axes.set(title=title, xlabel=along.label, ylabel=up.label)
    _limit(axes, up)
    if along.limits:
        axes.set_xlim(along.limits)


def _limit(axes: Axes, look: Scaled) -> None:
    if look.limits:
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, look.limits[0]), max(high, look.limits[1]))


def _draw_history(axes: Axes, picture: RunPicture) -> None:
    time, *ends = picture.envelope
    look = picture.whole_axis
    lowest, highest = map(look, ends)
    axes.fill_between(time, lowest, highest, color=style.BLUE, lw=0.9)
    if len(time) < 3:
        axes.plot(time, lowest, color=style.BLUE, marker="o", ms=4.0)
    first, last = picture.detail["time"][[0, -1]]
    if first < last < first + 0.9 * (picture.span[1] - picture.span[0]):
        axes.axvspan(first, last, color=style.GREEN, alpha=0.25, lw=0, zorder=0.5, label="drawn above")
    axes.set(title=f"Whole run: {VARIABLES[picture.whole].title}", ylabel=look.label)
    _limit(axes, look)


def _draw_spectrum(axes: Axes, picture: RunPicture) -> None:
    start, frequency, density = picture.spectrum
    quantity = VARIABLES[picture.variable]
    factor, label = style.density(density, frequency, quantity.unit)
    axes.set(title=f"Spectrum of {quantity.symbol} from {start:.4g} s on", ylabel=label)
    shown = density > 0.0
    shown[:1] = False  # the mean was removed
    if not shown.any():
        axes.set(xticks=[], yticks=[], xlabel="frequency")
        words = "no motion" if len(frequency) > 1 else "too few samples"
        axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", color="#666666")
        return
    kind, line = picture.line
    few = picture.passing if len(picture.passing) <= 5 else ()  # a line each; more have a tick each
    highest = min(frequency[-1], max([HARMONICS * (line or np.inf), *(ROOM * f for f in few)]))
    near = shown & (frequency <= highest)
    near = near if near.any() else shown
    frequency = frequency[near]
    density = factor * density[near]
    lowest = max(0.3 * float(density.min()), FAINTEST * float(density.max()))
    axes.semilogy(frequency, density, color=style.BLUE, lw=1.0, marker=_marker(frequency))
    right = min(highest, max(ROOM * float(frequency[density > lowest][-1]), 2.0 * (line or 0.0)))
    axes.set_xlim(0.0, right)
    style.set_ticks(axes.xaxis, 0.0, right, "Hz", "frequency")
    for number, wave in enumerate(few):
        axes.axvline(wave, lw=0.9, zorder=0.8, label="" if number else "waves of the wheel pass", **_BELT)
    if picture.passing and not few:
        ticks: style.Look = {"color": style.VERMILION, "ls": "none", "marker": "|", "ms": 14.0}
        ticks["label"] = f"{len(picture.passing)} waves of the wheel pass"
        bottom = 0.0 * np.array(picture.passing)
        axes.plot(picture.passing, bottom, transform=axes.get_xaxis_transform(), **ticks)
    if line:
        error = f" ± {picture.resolution:.2g}" if picture.resolution and kind != "fundamental" else ""
        label = f"{kind} {line:.4g}{error} Hz"
        axes.axvline(line, color=style.GREEN, ls=style.DOTS, lw=1.4, zorder=0.9, label=label)
    turning = [mode for mode in picture.modes if mode <= right]
    texts = dict.fromkeys(f"{mode:.4g}" for mode in turning)
    for mode in turning:
        label = f"mode{'s' * (len(texts) > 1)} {' and '.join(texts)} Hz" if mode == turning[0] else ""
        axes.axvline(mode, color=style.DARK, ls="-.", lw=0.9, zorder=0.7, label=label)
    entries = len(axes.get_legend_handles_labels()[1])
    axes.set_ylim(lowest, 10.0 ** (0.5 + 0.9 * entries) * float(density.max()))
    if entries:
        axes.legend(loc="upper right")


def _marker(values: style.Array) -> str:
    return "." if len(values) < 40 else ""  # a line alone would not show so few samples
