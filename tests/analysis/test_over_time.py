"""Motion under changing speed or load, window by window: intervals of vibration, short-time spectra, and files."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from brakecli.analysis.over_time import LOUD, over_time
from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.results.read import open_result
from brakecli.solver.history import History, array_history
from brakecli.solver.quantities import HISTORY, ContactState
from brakecli.solver.schedules import schedule
from tests.campaign import campaign
from tests.commands import ROOT, brakecli

SYSTEM = replace(system_of(parse_case(*read_text(str(ROOT / "cases" / "brake-stop.toml"))).case), interval=1e-4)
FREQUENCY = 250.0
AMPLITUDE = 3e-5


def burst(first: float, last: float, *, amplitude: float = AMPLITUDE, samples: int = 40_000) -> History:
    """A tone between two times (s) of a slow drift, stick after it, and a friction force of 500 N."""
    time = 1e-4 * np.arange(samples)
    on = (time >= first) & (time < last)
    columns = dict.fromkeys(HISTORY, np.zeros(samples))
    omega = 2.0 * math.pi * FREQUENCY
    columns["x"] = 1e-3 * time + on * amplitude * np.sin(omega * time)
    columns["vx"] = 1e-3 + on * amplitude * omega * np.cos(omega * time)
    columns["friction_force"] = np.full(samples, 500.0)
    columns["state"] = np.where(time < last, ContactState.BACKWARD_SLIP, ContactState.STICK).astype(float)
    return array_history(1e-4, np.stack([columns[name] for name in HISTORY], axis=1))


def test_a_tone_is_found_with_its_numbers() -> None:
    found = over_time(burst(1.0, 2.5), SYSTEM)
    assert found is not None
    [vibration] = found.vibrations
    hop = found.time[1] - found.time[0]
    assert hop == pytest.approx(5.0 / SYSTEM.natural_frequencies[0], rel=0.01)  # a quarter of 20 cycles
    assert vibration.start == pytest.approx(1.0, abs=hop)
    assert vibration.end == pytest.approx(2.5, abs=hop)
    # 40 samples a cycle: the extremes are missed by up to 1 - cos(π/40) = 0.3 %
    assert vibration.amplitude == pytest.approx(AMPLITUDE, rel=4e-3)
    # the parabola through a Hann line's logarithm is off by up to 0.03 bins, each 1/(4 hop)
    assert vibration.frequency == pytest.approx(FREQUENCY, abs=0.03 / (4.0 * hop))
    np.testing.assert_allclose(found.braking_torque, 0.5 * 500.0)
    np.testing.assert_allclose(found.speed, np.interp(found.time, [0.5, 4.0], [4.0, 0.0]), atol=1e-12)
    assert found.stick_fraction[found.time < 2.5 - hop].max() == 0.0
    assert found.stick_fraction[found.time > 2.5 + hop].min() == 1.0
    assert vibration.speed in found.speed


def test_two_bursts_are_two_intervals_and_what_is_faint_is_none() -> None:
    first, second = (burst(*ends) for ends in ((0.5, 1.0), (2.0, 3.0)))
    rows = [np.stack([h.read(name, 0, 40_000) for name in HISTORY], axis=1) for h in (first, second)]
    rows[0][:, 2:] *= 1.5 * LOUD
    rows[0][:, :2] *= 1.5 * LOUD
    both = over_time(array_history(1e-4, rows[0] + rows[1]), SYSTEM)
    faint = over_time(array_history(1e-4, rows[0] * 0.6 + rows[1]), SYSTEM)
    assert both is not None
    assert faint is not None
    assert [round(each.start, 1) for each in both.vibrations] == [0.5, 2.0]
    assert [round(each.start, 1) for each in faint.vibrations] == [2.0]


def test_a_shoe_that_hardly_moves_does_not_vibrate() -> None:
    # the static compression is 5000 N over c_yy + 2ak, with c_yy = 1e7 + 1.2e7 sin² 5° and 2ak = 2e6 N/m
    pressed = 5000.0 / (1.2e7 + 1.2e7 * math.sin(math.radians(5.0)) ** 2)
    for part, count in ((0.009, 0), (0.011, 1)):
        found = over_time(burst(1.0, 2.0, amplitude=part * pressed), SYSTEM)
        assert found is not None
        assert len(found.vibrations) == count


def test_a_fast_wheel_hides_no_vibration() -> None:
    fast = replace(SYSTEM, belt=schedule([0.0, 0.5, 4.0], [100.0, 100.0, 0.0]))
    found = over_time(burst(1.0, 2.0), fast)
    assert found is not None
    assert len(found.vibrations) == 1


def test_constant_speed_or_few_samples_have_no_windows() -> None:
    steady = system_of(parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml"))).case)
    assert over_time(burst(0.0, 4.0), steady) is None
    assert over_time(burst(0.0, 0.01, samples=100), SYSTEM) is None
    # 64 cycles of the lower natural frequency, 165 Hz, take 0.39 s
    assert over_time(burst(0.0, 0.3, samples=3000), SYSTEM) is None
    assert over_time(burst(0.0, 0.4, samples=4000), SYSTEM) is not None


@campaign
def test_a_stop_is_analysed_in_its_file_in_json_and_by_classify(tmp_path: Path) -> None:
    case = str(ROOT / "cases" / "brake-stop.toml")
    done = brakecli("run", case, "-o", "stop.h5", "--json", cwd=tmp_path)
    [interval] = done.json["vibrations"]
    assert interval["frequency"] == pytest.approx(174.0, abs=1.0)  # the mode of brakecli stability
    assert interval["end"] == pytest.approx(4.0, abs=0.03)  # the wheel stands from 4 s on
    assert brakecli("classify", "stop.h5", "--json", cwd=tmp_path).json["vibrations"] == [interval]
    assert "vibrates" in brakecli("classify", "stop.h5", cwd=tmp_path).out
    with xr.open_datatree(tmp_path / "stop.h5", engine="h5netcdf") as tree:
        assert tree["spectrogram"].vx.dims == ("time", "frequency")
        assert tree["over_time"].sizes["time"] == tree["spectrogram"].sizes["time"]
        assert float(tree["vibrations"].end[0]) == interval["end"]
        assert np.isnan(tree["over_time"].frequency.values[-1])
    with open_result(tmp_path / "stop.h5") as stored:
        assert stored.variables("spectrogram")["vx"].shape[0] == len(stored.read("over_time", "time"))
