"""The picture of a measured signal: units, and where its events stand."""

import numpy as np
import pytest

from brakecli.analysis.signals.look import Measurand, Signal, look
from brakecli.plots.signal import draw
from brakecli.plots.style import applied
from tests.plots.helpers import line


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
