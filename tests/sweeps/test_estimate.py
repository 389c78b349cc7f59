"""What a sweep is said to cost: which of its points are computed for it, and when it says "at least"."""

from collections.abc import Sequence
from contextlib import nullcontext
from itertools import count, islice
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from brakecli.errors import BrakecliError
from brakecli.front.inputs import load_sweep
from brakecli.sweeps import pilot as clocked
from brakecli.sweeps.cost import estimate
from brakecli.sweeps.driver import choose_engine, sweep
from brakecli.sweeps.pilot import DRAWN, MOST, UNEVEN, Pilot, drawn
from brakecli.sweeps.point import compute, line_points
from brakecli.sweeps.workers.local import LocalEngine
from tests.examples import ROUGH
from tests.sweeps.helpers import axis, frictions, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture(autouse=True)
def _counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that goes on by a millisecond each time it is asked: places take what is done there, not more."""
    ticks = count(0.0, 1e-3)
    monkeypatch.setattr(clocked, "process_time", lambda: next(ticks))


PROMISED = ROUGH | {"solver": {"tolerance": 1e-3, "duration": 0.02}, "output": {"sample_interval": 2.5e-4}}


@pytest.mark.parametrize("shape", [(100,), (100, 100), (7, 100, 30)])
def test_places_begin_in_the_middle_and_fill_every_axis(shape: tuple[int, ...]) -> None:
    places = np.array([*islice(drawn(shape), 32)])
    assert places[0].tolist() == [size // 2 for size in shape]
    for of_axis, size in zip(places.T, shape, strict=True):
        # a quarter of the axis has 8 of 32 places in the mean; where they lie evenly, no less than half of that
        counts = np.bincount(4 * of_axis // size, minlength=4)
        assert counts.min() >= 4


def test_the_estimate_computes_points_inside_the_grid_and_few_of_them(tmp_path: Path) -> None:
    plan = write_sweep(tmp_path, frictions(20), axis("link2.angle_deg", "start=1.0", "stop=9.0", "num=20")).plan
    pilot = Pilot(plan, 2, with_searches=True)
    pilot.look()
    rows, columns = np.divmod(pilot.points, 20)
    assert len(pilot.times) == len(pilot.points) >= 3
    assert len(pilot.points) <= min(MOST, DRAWN * plan.points)
    assert ((rows > 0) & (rows < 19) & (columns > 0) & (columns < 19)).any()


def test_kernels_that_are_loaded_at_a_later_place_are_no_part_of_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pilot = Pilot(write_sweep(tmp_path, frictions(40)).plan, 2, with_searches=True)
    taken = iter(
        [1e-3, 1e-3, 9.0, *[1e-3] * 99]
    )  # to load the first ones; a place; one that loads others; the rest

    def place(shape: Sequence[int], place: Sequence[int], most: int = 1) -> float:
        pilot.points.append(place[0])
        return next(taken)

    monkeypatch.setattr(pilot, "_place", place)
    pilot.look()
    assert {*pilot.times} == {1e-3}
    assert len(pilot.times) == len(pilot.points) >= 3
    assert not pilot.at_least


def test_a_sweep_of_one_point_is_estimated_too(tmp_path: Path) -> None:
    pilot = Pilot(write_sweep(tmp_path, frictions(1).replace("num = 1", "num = 2")).plan, 2, with_searches=True)
    pilot.look()
    assert len(pilot.times) == 1


def test_where_some_points_leave_the_lanes_the_estimate_says_at_least(tmp_path: Path) -> None:
    """At the least speed the shoe sticks, and leaves its lane."""
    speeds = np.linspace(0.5, 8.0, 40)
    moving = axis("wheel.angular_speed", f"values = {speeds.tolist()}")
    speeds[16:24] = 0.02
    mixed = axis("wheel.angular_speed", f"values = {speeds.tolist()}")
    said = []
    for tables in (moving, mixed):
        plan = write_sweep(tmp_path, tables, case=tomli_w.dumps(PROMISED)).plan
        pilot = Pilot(plan, 1, with_searches=True)
        pilot.look()
        said.append((pilot.alone > 0, "at least" in estimate(plan, 1).sentence()))
        assert pilot.in_lanes > 0
        assert pilot.together == 40  # all: a task holds more
    assert said[1] == (True, True)
    assert not said[0][0]


def test_uneven_places_mean_at_least(tmp_path: Path) -> None:
    pilot = Pilot(write_sweep(tmp_path, frictions(9)).plan, 1, with_searches=True)
    pilot.times = [1.0] * 8
    assert not pilot.at_least
    pilot.times.append(8.0 * UNEVEN)
    assert pilot.at_least


def test_units_that_no_two_workers_share_are_counted_whole(tmp_path: Path) -> None:
    plan = write_sweep(tmp_path, frictions(50, 'direction = "up"')).plan
    one, two = (Pilot(plan, workers, with_searches=True).sweep_seconds(1.0) for workers in (1, 2))
    assert one == two


def test_a_search_that_is_too_long_to_be_computed_says_at_least(tmp_path: Path) -> None:
    critical = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\n'
    assert "at least" in estimate(write_sweep(tmp_path, critical).plan, 1).sentence()  # runs with a given step


def test_a_long_run_at_a_corner_that_no_drawn_place_shows_means_at_least(tmp_path: Path) -> None:
    durations = ", ".join([*(f"0.0{n}" for n in range(10, 90, 2)), "200.0"])
    short, long = (
        estimate(
            write_sweep(tmp_path, frictions(4), axis("solver.duration", f"values = [{values}]")).plan,
            2,
            spare=True,
        )
        for values in (durations.removesuffix(", 200.0"), durations)
    )
    assert (short.at_least, short.workers) == (False, 0)
    assert (long.at_least, long.workers) == (True, 2)


def test_a_short_sweep_is_computed_without_workers_unless_they_are_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = write_sweep(tmp_path, frictions(4)).plan
    found = estimate(short, 2, spare=True)
    assert found.workers == 0
    assert found.sentence().startswith("4 points: about ")
    assert found.seconds < estimate(short, 2).seconds - 1.0  # they take that long to start
    assert "4 points on 2 workers" in estimate(short, 2).sentence()
    long = write_sweep(tmp_path, frictions(4).replace("num = 4", "num = 10000")).plan
    assert estimate(long, 2, spare=True).workers == 2
    monkeypatch.setattr(LocalEngine, "run", lambda engine, tasks: iter(()))  # which leaves all points missing
    for jobs, in_caller, starts in ((None, False, False), (2, False, True), (None, True, True)):
        missing = pytest.raises(BrakecliError, match="4 of 4") if starts else nullcontext()
        with choose_engine(short, jobs, in_caller=in_caller) as engine, missing:
            sweep(write_sweep(tmp_path, frictions(4)), tmp_path / "s.h5", engine, force=True)


def test_a_followed_motion_that_dies_out_below_the_numbers_of_a_case_goes_on(tmp_path: Path) -> None:
    """A run of 2 s with σ = -15 1/s leaves e^-30 of a velocity, whatever the wheel's speed: after eight of them it
    is no number that a case takes."""
    write_sweep(tmp_path, axis("wheel.angular_speed", "start=3.0", "stop=4.0", "num=24", 'direction = "up"'))
    settings = ["solver={tolerance=1e-3, duration=2.0}", "friction.coefficient=0.05"]
    plan = load_sweep(str(tmp_path / "s.toml"), [*settings, "output.sample_interval=1e-4"]).plan
    assert compute(plan, 0, 1)["status"].tolist() == [b"done"] * len(line_points(plan, 0))
