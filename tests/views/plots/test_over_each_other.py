"""The picture of two results shows the curves of both."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.case.read import parse_case
from brakecli.errors import UsageError
from brakecli.results.read import open_result
from brakecli.studies.runs.run import run
from brakecli.views.plots import over_each_other, style
from tests.campaign import campaign
from tests.commands import TINY
from tests.views.plots.helpers import ANGLE, CRITICAL, SPEED, columns, write


def picture(names: list[Path], variable: str = "") -> Any:
    with style.applied(), open_result(names[0]) as first, open_result(names[1]) as second:
        figure = over_each_other.draw((first, second), variable)
        style.rendered(figure, ".png")
        return figure


@campaign
def test_the_last_cycles_of_both_runs_are_drawn_as_they_are_stored(tmp_path: Path) -> None:
    names = [tmp_path / "a.h5", tmp_path / "b.h5"]
    stored = []
    for name, friction in zip(names, (0.6, 0.7), strict=True):
        run(parse_case(TINY, "tiny", [f"friction.coefficient={friction}"]), name, force=False)
        with open_result(name) as result:
            stored.append((result.read("history", "time"), result.read("history", "vx")))
    detail, whole, spectra = picture(names).axes
    assert [text.get_text() for text in detail.get_legend().get_texts()] == ["a.h5", "b.h5"]
    for line, (time, vx) in zip(detail.get_lines(), stored, strict=True):
        np.testing.assert_allclose(line.get_xdata(), time[-len(line.get_xdata()) :])
        np.testing.assert_allclose(line.get_ydata(), 1e3 * vx[-len(line.get_xdata()) :])  # mm/s
    assert detail.get_ylabel() == "velocity ẋ (mm/s)"
    assert len(spectra.get_lines()) == 2
    assert whole.get_xlim() == (0.0, 0.02)


def test_the_critical_values_of_two_sweeps_are_drawn_along_their_axis(tmp_path: Path) -> None:
    table = {"axis": [ANGLE], "critical": CRITICAL}
    values = columns((8,), critical=True)["critical"]
    names = [write(tmp_path / f"{n}.h5", table, {"critical": values * (1 + n)}) for n in (0, 1)]
    (axes,) = picture(names).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["0.h5", "1.h5"]
    for number, line in enumerate(axes.get_lines()):
        np.testing.assert_array_equal(line.get_xdata(), np.arange(1.0, 9.0))
        np.testing.assert_array_equal(line.get_ydata(), values * (1 + number))
    assert axes.get_xlabel() == "link2.angle_deg (deg)"


@campaign
def test_without_critical_values_amplitude_and_frequency_are_drawn_or_what_is_named(tmp_path: Path) -> None:
    names = [write(tmp_path / f"{n}.h5", {"axis": [SPEED]}) for n in (0, 1)]
    assert [axes.get_ylabel() for axes in picture(names).axes] == ["amplitude (µm)", "frequency (Hz)"]
    (axes,) = picture(names, "steps").axes
    assert axes.get_ylabel() == "steps"


@campaign
def test_results_over_several_axes_or_over_different_ones_have_no_curves(tmp_path: Path) -> None:
    tables = ({"axis": [ANGLE]}, {"axis": [SPEED]}, {"axis": [ANGLE, SPEED]})
    one, other, several = (write(tmp_path / f"{n}.h5", table) for n, table in enumerate(tables))
    with pytest.raises(UsageError, match="only numbers along one axis"):
        picture([several, several])
    with pytest.raises(UsageError, match="amplitude is not a number along the same axes in all of them"):
        picture([one, other])
    with pytest.raises(UsageError, match="regime is not a number"):
        picture([one, one], "regime")
