"""Where speed or load change, the picture shows the spectrogram and the amplitude against the speed."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from brakecli.case.read import parse_case, read_text
from brakecli.results.read import open_result
from brakecli.studies.runs.run import run
from brakecli.views.plots import style
from brakecli.views.plots.run import RunPicture, draw
from tests.commands import ROOT


@pytest.fixture(scope="module")
def stop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stop") / "stop.h5"
    run(parse_case(*read_text(str(ROOT / "cases" / "brake-stop.toml"))), path, force=False)
    return path


def test_the_spectrogram_has_the_waves_both_modes_and_the_vibration(stop: Path) -> None:
    with open_result(stop) as stored, style.applied():
        figure = draw(picture := RunPicture(stored))
    axes = figure.axes[4]
    shown: dict[str, Any] = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    assert {*shown} == {"waves of the wheel pass", "modes", "vibrates"}
    wave = shown["waves of the wheel pass"]
    # the longest wave, 0.03 m, at 4 m/s until 0.5 s and at rest from 4 s on
    times = np.asarray(wave.get_xdata(), float)
    np.testing.assert_allclose(wave.get_ydata(), np.interp(times, [0.5, 4.0], [4.0 / 0.03, 0.0]), atol=1e-9)
    assert shown["modes"].get_ydata()[0] == pytest.approx(picture.modes[0])
    [mesh] = [each for each in axes.collections if hasattr(each, "get_coordinates")]
    levels = np.asarray(mesh.get_array())
    with h5py.File(stop) as file:
        density = file["spectrogram/vx"][:]
        amplitude = file["over_time/amplitude"][:]
    assert levels.shape == density.T.shape
    assert levels.max() == 0.0
    where = np.unravel_index(np.argmax(levels), levels.shape)
    assert where[::-1] == np.unravel_index(np.argmax(density), density.shape)
    curve = figure.axes[5].get_lines()[0]
    np.testing.assert_allclose(np.asarray(curve.get_ydata(), float), 1e6 * amplitude)
