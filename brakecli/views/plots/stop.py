"""Two more panels where speed or load change: the spectrogram, and the amplitude against the speed."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from brakecli.results.read import StoredResult
from brakecli.solver.system import System
from brakecli.views.plots import style

DECIBELS = 60.0  # below its largest value what a spectrogram shows


class Stop:
    """What the windows of a run show, in SI units."""

    def __init__(self, result: StoredResult, system: System) -> None:
        """Read it; raises UnreadableResultError."""
        self.time, self.lines = (result.read("spectrogram", name) for name in ("time", "frequency"))
        self.density = result.read("spectrogram", "vx")
        names = ("speed", "load_force", "amplitude", "stick_fraction")
        self.speed, self.load, self.amplitude, self.stick = (result.read("over_time", name) for name in names)
        starts, ends = (result.read("vibrations", name) for name in ("start", "end"))
        self.vibrations = [*zip(starts, ends - starts, strict=True)]
        self.waves = sorted(system.wheel.turns)[:12]  # 1/m, the longest, which are drawn


def draw_spectrogram(axes: Axes, stop: Stop, modes: list[float]) -> None:
    """The power of vx over time and frequency, with the passing waves, both modes, and when it vibrates."""
    largest = float(stop.density.max(initial=0.0)) or 1.0
    level = 10.0 * np.log10(np.maximum(stop.density / largest, 10.0 ** (-0.1 * DECIBELS - 1.0)))
    axes.pcolormesh(
        stop.time,
        stop.lines,
        level.T,
        shading="nearest",
        rasterized=True,
        cmap="cividis",
        vmin=-DECIBELS,
        vmax=0.0,
    )
    outlined = [withStroke(linewidth=2.2, foreground="black")]
    dashed: style.Look = {"color": "white", "ls": style.DASHES, "lw": 1.1}
    for number, wave in enumerate(stop.waves):
        label = "" if number else "waves of the wheel pass"
        axes.plot(stop.time, np.abs(stop.speed) * wave, path_effects=outlined, label=label, **dashed)
    across = axes.get_yaxis_transform()
    for number, mode in enumerate(modes):  # at both ends, so that nothing is hidden
        for ends in ((0.0, 0.04), (0.96, 1.0)):
            look: style.Look = {"color": style.ORANGE, "lw": 1.1, "label": "" if number or ends[0] else "modes"}
            axes.plot(ends, (mode, mode), transform=across, path_effects=outlined, **look)
    if stop.vibrations:
        top = axes.get_xaxis_transform()
        axes.broken_barh(
            stop.vibrations, (0.97, 0.03), transform=top, color=style.VERMILION, lw=0, label="vibrates"
        )
    axes.set(title=f"Spectrogram of ẋ, {DECIBELS:.0f} dB from dark to bright", ylim=(0.0, _highest(stop, modes)))
    style.set_ticks(axes.yaxis, 0.0, _highest(stop, modes), "Hz", "frequency")
    axes.grid(False)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper right", ncols=3, bbox_to_anchor=(1.0, 0.97))


def _highest(stop: Stop, modes: list[float]) -> float:
    """Up to where there is something to see: what is not too faint, and half as high again as both modes."""
    faint = stop.density.max(initial=0.0) * 10.0 ** (-0.1 * (0.7 * DECIBELS))
    loud = (stop.density > faint).any(axis=0)
    loudest = float(stop.lines[loud][-1]) if loud.any() else 0.0
    return min(max(1.2 * loudest, 1.5 * max(modes, default=0.0), float(stop.lines[1])), float(stop.lines[-1]))


def draw_amplitude(axes: Axes, stop: Stop) -> None:
    """Amplitude of x against the wheel's speed, or the load where that alone changes; stick is marked."""
    factor, unit = style.prefixed(style.largest(stop.amplitude), "m")
    along = stop.speed
    name = "speed"
    its_unit = "m/s"
    words = "speed of the wheel's surface"
    if np.ptp(along) <= 1e-9 * style.largest(along):
        along = stop.load
        name = "load"
        its_unit = "N"
        words = "load"
    axes.plot(along, factor * stop.amplitude, color=style.BLUE, lw=0.8, marker=".")
    stuck = stop.stick > 0.0
    look: style.Look = {"ls": "none", "marker": "s", "ms": 4.0, "color": style.ORANGE, "label": "with stick"}
    axes.plot(along[stuck], factor * stop.amplitude[stuck], **look)
    axes.set(title=f"Amplitude of x against {name}", ylabel=style.labelled("amplitude", unit))
    style.set_ticks(axes.xaxis, float(along.min()), float(along.max()), its_unit, words)
    if stuck.any():
        axes.legend(loc="best")
