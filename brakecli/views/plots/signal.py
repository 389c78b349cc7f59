"""The picture of a measured signal: the record, its smoothed velocity with the events found, and its spectrum."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from brakecli.analysis.regime.decision import Regime
from brakecli.analysis.signals.bursts import Burst
from brakecli.analysis.signals.look import Measurand, SignalLook
from brakecli.analysis.spectrum import segment
from brakecli.views.plots import style
from brakecli.views.plots.run import COLUMNS, CYCLES, FEW, MOST_DETAIL, ROOM, envelope

_VELOCITY = {
    Measurand.FORCE: ("rate of the force", "N/s"),
    Measurand.TORQUE: ("rate of the torque", "N m/s"),
    Measurand.PRESSURE: ("pressure", "Pa"),
}


def draw(look: SignalLook, source: str) -> Figure:
    """The figure with its three panels."""
    verdict = look.verdict
    parts = [str(verdict.regime) + f": {'; '.join(verdict.reasons)}" * (verdict.frequency is None)]
    if verdict.frequency is not None:
        parts.append(f"{verdict.frequency:.4g} Hz")
    if verdict.stick_fraction:
        parts.append(f"stick {verdict.stick_fraction:.1%} of the time")
    figure = style.headed(10.4, 7.2, _title(source), "   ·   ".join(parts), wspace=0.05, hspace=0.06)
    panels = figure.subplot_mosaic([["record", "record"], ["velocity", "spectrum"]])
    _draw_record(panels["record"], look)
    _draw_velocity(panels["velocity"], look)
    _draw_spectrum(panels["spectrum"], look)
    return figure


def _title(source: str) -> str:
    """The name of the file, and of the dataset in it."""
    file, separator, inside = source.partition(":/")
    return Path(file).name + separator + inside


def _draw_record(axes: Axes, look: SignalLook) -> None:
    values = look.signal.values
    step = look.signal.interval
    factor, unit = style.prefixed(style.largest(values), look.verdict.unit)
    if len(values) > 2 * COLUMNS:
        places, low, high = envelope(lambda begin, end: values[begin:end], len(values))
        axes.fill_between(step * places, factor * low, factor * high, color=style.BLUE, lw=0.6)
    else:
        axes.plot(step * np.arange(len(values)), factor * values, color=style.BLUE, lw=0.9)
    for i, tone in enumerate(sorted(look.verdict.bursts, key=lambda tone: -tone.level)):
        axes.axvspan(tone.start, tone.end, color=style.ORANGE, alpha=0.25, lw=0, zorder=0.5)
        if i < 4:  # the loudest
            centre = 0.5 * (tone.start + tone.end)
            where = axes.get_xaxis_transform()
            axes.text(centre, 1.0, f"{tone.frequency:.4g} Hz", transform=where, ha="center", va="bottom", size=8)
    words = ", where a tone stands out shaded" if look.verdict.bursts else ""
    axes.set_title(f"Record{words}", pad=14.0)
    axes.set(ylabel=style.labelled(str(look.quantity), unit), xlim=(0.0, step * len(values)))
    style.set_ticks(axes.xaxis, 0.0, step * len(values), "s", "time")


def _draw_velocity(axes: Axes, look: SignalLook) -> None:
    """Some cycles in the middle of the record, or of the burst that the verdict is about."""
    velocity = look.velocity
    m = look.smoothing
    step = look.signal.interval
    name, unit = _VELOCITY.get(look.quantity, ("velocity", "m/s"))
    unit = look.verdict.unit if look.signal.relative else unit
    smoothed = f", smoothed over {m} samples" * (m > 1)
    axes.set_title(f"{name.capitalize()}{smoothed}")
    if len(velocity.values) < 3 * m:
        axes.set(xticks=[], yticks=[])
        return
    size = style.largest(look.signal.values) / (step if look.quantity.order == 0 else 1.0)
    size *= step if look.quantity is Measurand.ACCELERATION else 1.0
    values = size * velocity.smoothed(m)
    offset = velocity.first + (0.5 * m if velocity.measured else m)
    frequency = look.verdict.frequency
    gap = float(np.median(np.diff(look.slips.places))) if look.slips.count > 1 else 0.0
    cycle = 1.0 / (frequency * step) if frequency else gap
    wanted = int(min(CYCLES * cycle or FEW, MOST_DETAIL, len(values)))
    middle = 0.5 * len(values)
    if burst := _strongest(look):
        middle = 0.5 * (burst.start + burst.end) / step - offset
    first = int(np.clip(middle - 0.5 * wanted, 0, len(values) - wanted))
    factor, unit = style.prefixed(style.largest(values[first : first + wanted]), unit)
    time = step * (offset + np.arange(first, first + wanted))
    axes.plot(time, factor * values[first : first + wanted], color=style.BLUE)
    places = look.slips.places
    places = places[(places >= first) & (places < first + wanted)]
    reach = int(0.5 * gap) + 1  # in which a slip is fastest
    places = np.array([start + int(np.argmax(np.abs(values[start : start + reach]))) for start in places], int)
    if len(places):
        there = step * (offset + places), factor * values[places]
        axes.plot(*there, ls="none", marker="v", color=style.VERMILION, label="events found")
        style.make_room(axes)
        axes.legend(loc="upper right")
    axes.set(xlim=(time[0], time[-1]), ylabel=f"{name} ({unit})")
    style.set_ticks(axes.xaxis, time[0], time[-1], "s", "time")


def _strongest(look: SignalLook) -> Burst | None:
    """The burst that the verdict is about; None where it is about the whole record."""
    if look.verdict.regime == Regime.RELAXATION:
        return None
    return max(look.verdict.bursts, key=lambda burst: burst.energy, default=None)


def _draw_spectrum(axes: Axes, look: SignalLook) -> None:
    """The spectrum of the record; that of a burst alone reaches as far as it stands out."""
    from scipy.signal import welch

    values = look.signal.values
    step = look.signal.interval
    frequency = look.verdict.frequency
    title = f"Spectrum of the {look.quantity}"
    burst = _strongest(look)
    if burst:
        values = values[int(burst.start / step) : int(burst.end / step)]
        frequency = frequency or burst.frequency
        title += f" from {burst.start:.4g} to {burst.end:.4g} s"
    good = np.flatnonzero(np.isfinite(values))
    filled = np.interp(np.arange(len(values)), good, values[good])
    frequencies, density = welch(filled, 1.0 / step, nperseg=segment(len(filled)), detrend="constant")
    shown = (frequencies > 0.0) & (density > 0.0)
    scale, label = style.density(density, frequencies, look.verdict.unit)
    density *= scale
    (axes.semilogy if burst else axes.loglog)(frequencies[shown], density[shown], color=style.BLUE, lw=1.0)
    axes.set(title=title, ylabel=label)
    if shown.any() and style.largest(density) < style.WIDE * density[shown].min():
        style.set_ticks(axes.yaxis, *axes.get_ylim())
    low, high = (float(frequencies[shown][i]) for i in (0, -1)) if shown.any() else (1.0, 1.0)
    if burst:
        low = 0.0
        loud = frequencies[density > 1e-6 * style.largest(density)]  # what is fainter adds nothing to the axis
        high = min(high, max(ROOM * float(loud.max(initial=0.0)), 2.0 * burst.frequency))
        axes.set_xlim(low, high)
    style.set_ticks(axes.xaxis, low, high, "Hz", "frequency")
    if frequency is not None:
        label = f"{'events' if look.verdict.regime == Regime.RELAXATION else 'line'} {frequency:.4g} Hz"
        axes.axvline(frequency, color=style.GREEN, ls=style.DOTS, lw=1.4, zorder=0.9, label=label)
        axes.legend(loc="best")
