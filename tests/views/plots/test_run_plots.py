"""Pictures of runs: what they show is what the result holds, and every fault ends in its exit code."""

import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from numpy.typing import NDArray

from brakecli.case.read import parse_case
from brakecli.cli import app as cli
from brakecli.errors import BrakecliError, UnreadableResultError, UsageError
from brakecli.results.field import Field
from brakecli.results.fields import SPECTRUM
from brakecli.results.read import open_result
from brakecli.results.write import new_result
from brakecli.solver.quantities import HISTORY, ContactState
from brakecli.views.plots import run, style
from brakecli.views.plots.quantities import VARIABLES
from brakecli.views.plots.result import plot_result
from brakecli.views.plots.run import RunPicture, draw, envelope, episodes
from brakecli.views.plots.style import applied
from tests.campaign import campaign

CASE = """
title = "Größe $x_{"
shoe.mass = 1
wheel = { radius = 0.5, angular_speed = 2 }
link1.stiffness = 1
link2.stiffness = 1
load.force = 1
friction.coefficient = 1
contact = { half_length = 0.05, stiffness = 2e7 }
solver = { step = 0.01, duration = 10 }
"""
INTERVAL = 0.01
Samples = dict[str, NDArray[Any]]


def sine(samples: int, frequency: float = 1.0) -> Samples:
    """Sticks while the velocity is in its upper quarter, on a belt that moves at 1 m/s."""
    angle = 2.0 * np.pi * frequency * INTERVAL * np.arange(samples)
    velocity = np.minimum(1.2 * np.sin(angle), 1.0)
    return {"x": -np.cos(angle), "vx": velocity, "state": np.where(velocity == 1.0, 0, -1)}


def write(path: Path, moved: Samples, *overrides: str, **attributes: Any) -> Path:
    """A result of a run that holds this motion; other variables are zero."""
    samples = len(moved["x"])
    loaded = parse_case(CASE, "case", overrides)
    with new_result(path, force=True) as result:
        texts = {"kind": "run", "case_toml": CASE, "resolved_toml": loaded.resolved}
        numbers = {"status": "done", "regime": "relaxation", "excitation": "self-excited", "amplitude": 1.0}
        result.set_attributes(texts | numbers | attributes)
        result.axis("history", Field("time", "s", "time"), INTERVAL * np.arange(samples))
        for name, quantity in HISTORY.items():
            values = moved.get(name, np.zeros(samples))
            result.variable("history", Field(name, quantity.units, quantity.long_name), ("time",), values)
        result.axis("spectrum", Field("frequency", "Hz", "frequency"), np.linspace(0.0, 50.0, 1 + samples // 2))
        density = np.zeros(1 + samples // 2)
        density[len(density) // 50 + 1 :: len(density) // 50 + 1] = 1.0
        for name in SPECTRUM:
            result.variable(
                "spectrum", Field(name, "1", "density"), ("frequency",), density if samples > 3 else 0 * density
            )
        result.set_attributes({"first_sample": 0, "segments": 1}, "spectrum")
        result.commit()
    return path


def gathered(path: Path, moved: Samples, *overrides: str, **attributes: Any) -> RunPicture:
    with open_result(write(path, moved, *overrides, **attributes), kind="run") as result:
        return RunPicture(result)


@pytest.fixture
def run_command(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Run the command line here; what it is given back is the exit code."""

    def run(*arguments: str | Path) -> int:
        monkeypatch.setattr(sys, "argv", ["brakecli", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        return int(caught.value.code or 0)

    return run


@campaign
def test_each_suffix_gives_a_whole_picture_of_its_kind_and_the_same_bytes_again(tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5", sine(2000), frequency=1.0)
    for suffix in (".png", ".SVG", ".pdf"):
        for name in ("a", "b"):
            plot_result(result, tmp_path / f"{name}{suffix}", force=False)
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    image = imread(tmp_path / "a.png")
    assert image.shape == (1080, 1560, 4)
    assert image[..., :3].std() > 0.05  # not blank
    assert ET.parse(tmp_path / "a.SVG").getroot().tag == "{http://www.w3.org/2000/svg}svg"
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert pdf.startswith(b"%PDF-")
    assert pdf.rstrip().endswith(b"%%EOF")


@given(st.lists(st.sampled_from([int(state) for state in ContactState]), max_size=60))
def test_episodes_cover_exactly_the_samples_of_a_state(states: list[int]) -> None:
    found = episodes(np.array(states, dtype=np.int8), ContactState.STICK)
    covered = [sample for first, last in found for sample in range(first, last + 1)]
    assert covered == [sample for sample, state in enumerate(states) if state == ContactState.STICK]
    for (_, last), (first, _) in pairwise(found):
        assert first > last + 1  # whole stretches


def test_stick_is_shaded_half_an_interval_around_each_of_its_samples(tmp_path: Path) -> None:
    picture = gathered(tmp_path / "r.h5", sine(2000), frequency=1.0)
    shades = [
        shade for shade in draw(picture).axes[0].collections if shade.get_label() == "stick" and shade.get_paths()
    ]
    assert len(shades) == 1
    spans = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in shades[0].get_paths()]  # type: ignore[index, union-attr]
    time = picture.detail["time"]
    stick = picture.detail["state"] == ContactState.STICK
    assert stick.any()
    inside = [any(low < moment < high for low, high in spans) for moment in time]
    np.testing.assert_array_equal(inside, stick)
    assert sum(high - low for low, high in spans) == pytest.approx(stick.sum() * INTERVAL, rel=1e-9)


@pytest.mark.parametrize("samples", [1, 2, 7, 1200, 1201, 5000])
def test_envelope_is_the_least_and_greatest_value_of_each_column(
    samples: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "BLOCK", 333)
    values = np.random.default_rng(1).normal(size=samples)
    asked: list[int] = []

    def read(start: int, stop: int) -> NDArray[np.float64]:
        asked.append(stop - start)
        return values[start:stop]

    for columns in (1, 3, 1200):
        middles, lowest, highest = envelope(read, samples, columns)
        width = samples / min(columns, samples)
        owner = np.array([int((sample + 1e-9) / width) for sample in range(samples)])
        assert len(lowest) == min(columns, samples) == owner[-1] + 1
        for column in range(len(lowest)):
            mine = np.flatnonzero(owner == column)
            assert (lowest[column], highest[column]) == (values[mine].min(), values[mine].max())
            assert middles[column] == 0.5 * (mine[0] + mine[-1])
    assert max(asked) <= 333


def test_a_settled_motion_shows_its_last_twelve_cycles(tmp_path: Path) -> None:
    picture = gathered(tmp_path / "r.h5", sine(5000, 2.0), frequency=2.0)
    assert picture.detail["time"].size * INTERVAL * 2.0 == pytest.approx(12.0)
    assert picture.detail["time"][-1] == picture.span[1] == 4999 * INTERVAL


def test_a_motion_that_comes_to_rest_is_shown_until_it_rests(tmp_path: Path) -> None:
    moved = sine(20000, 2.0)
    moved["state"][7000:] = 0
    moved["state"][6999] = 1
    picture = gathered(tmp_path / "r.h5", moved, spectrum_peak=2.0, excitation="none")
    assert picture.detail["time"][0] < 6999 * INTERVAL < picture.detail["time"][-1] < 7100 * INTERVAL


@campaign
def test_each_quantity_of_the_history_can_be_drawn(tmp_path: Path) -> None:
    assert {*VARIABLES} == {*HISTORY} - {"state"} | {"torque"}
    rng = np.random.default_rng(1)
    moved = sine(500) | {name: rng.normal(3.0, 1.0, 500) for name in HISTORY if name not in ("x", "vx", "state")}
    result = write(tmp_path / "r.h5", moved, frequency=1.0)
    units = {"friction_force": "(N)", "torque": "(N m)", "vy": "(m/s)", "contact_fraction": "touching"}
    for name in VARIABLES:
        with open_result(result) as stored, applied():
            figure = draw(RunPicture(stored, name))
        curve = np.asarray(figure.axes[0].get_lines()[0].get_ydata(), float)
        values = 0.5 * moved["friction_force"] if name == "torque" else moved[name]  # a radius of 0.5 m
        np.testing.assert_allclose(curve, values[-len(curve) :], rtol=1e-12)
        assert units.get(name, "") in figure.axes[0].get_ylabel()
        ordinate = "vx" if name == "x" else name
        lines = figure.axes[1].get_lines()[0]
        np.testing.assert_allclose(np.asarray(lines.get_xdata()), moved["x"][-len(curve) :], rtol=1e-12)
        if ordinate in moved:
            np.testing.assert_allclose(np.asarray(lines.get_ydata()), moved[ordinate][-len(curve) :], rtol=1e-12)
    with pytest.raises(UsageError, match="give one of x, y, vx"):
        plot_result(result, tmp_path / "r.png", force=False, variable="state")


def drawn_labels(picture: RunPicture) -> list[str]:
    return [str(each) for each in draw(picture).axes[3].get_legend_handles_labels()[1]]


def test_few_waves_have_lines_in_the_spectrum_and_many_have_ticks(tmp_path: Path) -> None:
    for count, words in ((5, "waves of the wheel pass"), (6, "6 waves of the wheel pass")):
        lengths = [0.1 * (1 + number) for number in range(count)]
        waves = f"roughness.wheel={{amplitudes={[1e-6] * count}, wavelengths={lengths}}}"
        axes = draw(picture := gathered(tmp_path / "r.h5", sine(500), waves)).axes[3]
        lines = [each for each in axes.get_lines() if each.get_color() == style.VERMILION]
        assert len(lines) == (5 if count == 5 else 1)
        assert words in drawn_labels(picture)
        places = np.concatenate([np.unique(np.asarray(each.get_xdata(), float)) for each in lines])
        np.testing.assert_allclose(np.sort(places), picture.passing)


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_rounding_is_drawn_as_a_line_and_not_from_bottom_to_top(level: float, tmp_path: Path) -> None:
    noise = 1e-16 * np.random.default_rng(2).normal(size=500)
    moved = {"x": level * (1.0 + noise), "vx": noise, "normal_force": 5.0 + noise, "state": np.ones(500)}
    for name in ("vx", "x", "normal_force"):
        with open_result(write(tmp_path / "r.h5", moved)) as stored, applied():
            figure = draw(RunPicture(stored, name))
        for axes in figure.axes[:3]:
            for line in axes.get_lines()[:1]:
                low, high = axes.get_ylim()
                assert np.ptp(np.asarray(line.get_ydata(), float)) < 1e-6 * (high - low)


def test_a_damaged_result_ends_in_exit_4_without_a_picture(tmp_path: Path, run_command: Any) -> None:
    result = write(tmp_path / "r.h5", sine(500))
    content = bytearray(result.read_bytes())
    content[len(content) // 2] ^= 1
    result.write_bytes(content)
    assert run_command("plot", result, "-o", tmp_path / "r.png") == 4
    assert run_command("plot", tmp_path / "absent.h5", "-o", tmp_path / "r.png") == 4
    assert [path.name for path in tmp_path.iterdir()] == ["r.h5"]


def test_an_existing_picture_is_replaced_only_by_force(
    tmp_path: Path, run_command: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    result = write(tmp_path / "r.h5", sine(500))
    target = tmp_path / "r.svg"
    target.write_text("mine")
    assert run_command("plot", result, "-o", target) == 2
    assert "--force" in capsys.readouterr().err
    assert target.read_text() == "mine"
    assert run_command("plot", result, "-o", target, "--force") == 0
    assert capsys.readouterr().out == f"{target}: written\n"
    assert target.read_text().startswith("<?xml")


def test_another_suffix_is_refused_and_the_three_are_named(tmp_path: Path) -> None:
    result = write(tmp_path / "r.h5", sine(500))
    for name in ("r.gif", "r"):
        with pytest.raises(UsageError, match=r"\.pdf, \.png or \.svg"):
            plot_result(result, tmp_path / name, force=False)


def test_a_result_is_never_replaced_by_its_picture(tmp_path: Path) -> None:
    result = write(tmp_path / "r.png", sine(500))
    with pytest.raises(UsageError, match="the result itself"):
        plot_result(result, result, force=True)


def test_without_matplotlib_the_message_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(UsageError, match="pip install"):
        plot_result(tmp_path / "r.h5", tmp_path / "r.png", force=False)


def test_a_result_without_what_is_drawn_is_unreadable(tmp_path: Path) -> None:
    faults: list[tuple[Samples, dict[str, Any]]] = [(sine(0), {}), (sine(9), {"resolved_toml": "title = 1"})]
    for moved, attributes in faults:
        with pytest.raises(UnreadableResultError) as caught:
            gathered(tmp_path / "r.h5", moved, **attributes)
        assert caught.value.exit_code == 4
    with new_result(tmp_path / "empty.h5", force=False) as result:
        result.set_attributes({"kind": "run"})
        result.commit()
    with pytest.raises(BrakecliError) as other:
        plot_result(tmp_path / "empty.h5", tmp_path / "r.png", force=False)
    assert other.value.exit_code == 4
    assert not (tmp_path / "r.png").exists()
