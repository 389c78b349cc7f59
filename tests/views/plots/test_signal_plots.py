"""The picture of a measured signal: units, and where its events stand."""

import numpy as np
import pytest

from brakecli.analysis.signals.look import Measurand, Signal, look
from brakecli.views.plots.signal import draw
from brakecli.views.plots.style import applied
from tests.views.plots.helpers import line


@pytest.mark.parametrize("cycles", [40.3, 325.6])
@pytest.mark.parametrize("form", ["sine", "saw-teeth"])
def test_events_stand_where_the_slip_is_fastest_and_below_their_legend(cycles: float, form: str) -> None:
    phase = np.arange(20_000) * cycles / 20_000
    values = np.sin(2.0 * np.pi * phase) if form == "sine" else np.minimum(phase % 1.0, 10.0 * (1.0 - phase % 1.0))
    with applied():
        figure = draw(look(Signal(values, 1.0 / 20_000), Measurand.DISPLACEMENT), "signal.csv")
    _, velocity, spectrum = figure.axes
    there = line(velocity, "events found").get_xydata()
    curve = np.asarray(velocity.get_lines()[0].get_xydata())[:, 1]
    assert len(there) >= 10
    np.testing.assert_allclose(there[:, 1], curve.min(), rtol=0.1)
    assert velocity.get_ylim()[1] > 1.1 * curve.max()
    assert spectrum.get_xlabel() == "frequency (Hz)"


def test_the_spectrum_of_a_burst_is_its_own_and_ends_where_it_does_not_stand_out() -> None:
    """Between bursts of 2150 and 2310 Hz noise reaches to 22 kHz; the stronger burst alone is what is shown."""
    rate = 44_100
    time = np.arange(3 * rate) / rate
    values = 0.002 * np.random.default_rng(1).standard_normal(len(time))
    for begin, end, frequency in ((0.5, 1.1, 2150.0), (2.0, 2.3, 2310.0)):
        there = (time > begin) & (time < end)
        hump = np.sin(np.pi * (time[there] - begin) / (end - begin))
        values[there] += 0.3 * hump * np.sin(2.0 * np.pi * frequency * time[there])
    found = look(Signal(values, 1.0 / rate), Measurand.PRESSURE)
    burst = max(found.verdict.bursts, key=lambda each: each.energy)
    with applied():
        spectrum = draw(found, "signal.wav").axes[2]
    assert (spectrum.get_xscale(), spectrum.get_yscale()) == ("linear", "log")
    assert spectrum.get_xlim()[0] == 0.0
    assert spectrum.get_xlim()[1] == pytest.approx(4300.0, rel=0.02)  # twice the line, beyond which is noise
    assert spectrum.get_title(loc="left").endswith(f"from {burst.start:.4g} to {burst.end:.4g} s")
    frequency, density = np.asarray(spectrum.get_lines()[0].get_xydata()).T
    assert frequency[density.argmax()] == pytest.approx(2150.0, abs=frequency[1] - frequency[0])
    other = np.abs(frequency - 2310.0) < 20.0
    assert density[other].max() < 1e-5 * density.max()
