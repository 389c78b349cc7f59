"""What a sweep will take, by counts: its workers, the points of a task, and what is refused."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from brakecli.api.inputs import load_sweep
from brakecli.errors import BrakecliError, RefusedError
from brakecli.studies.sweeps.driver import choose_engine, sweep
from brakecli.studies.sweeps.point import compute, line_points
from brakecli.studies.sweeps.size import MOST_POINTS, refuse_sweep, size_of
from brakecli.studies.sweeps.workers.local import LocalEngine
from tests.examples import ROUGH
from tests.studies.sweeps.helpers import axis, frictions, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")

PROMISED = ROUGH | {"solver": {"tolerance": 1e-3, "duration": 0.02}, "output": {"sample_interval": 2.5e-4}}


def test_points_that_fit_into_lanes_come_together(tmp_path: Path) -> None:
    speeds = np.linspace(0.5, 8.0, 40).tolist()
    moving = axis("wheel.angular_speed", f"values = {speeds}")
    plan = write_sweep(tmp_path, moving, case=tomli_w.dumps(PROMISED)).plan
    assert size_of(plan, 1).together == 40  # all: a task holds more
    assert size_of(plan, 4).together == 10
    assert size_of(write_sweep(tmp_path, frictions(40)).plan, 1).together == 1  # smooth, which shares no loop


def test_a_short_sweep_is_computed_without_workers_unless_they_are_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = write_sweep(tmp_path, frictions(4)).plan
    found = size_of(short, 2, spare=True)
    assert found.workers == 0
    assert found.sentence().startswith("4 points: ")
    assert "4 points on 2 workers" in size_of(short, 2).sentence()
    long = write_sweep(tmp_path, frictions(4).replace("num = 4", "num = 10000")).plan
    assert size_of(long, 2, spare=True).workers == 2
    monkeypatch.setattr(LocalEngine, "run", lambda engine, tasks: iter(()))  # which leaves all points missing
    for jobs, in_caller, starts in ((None, False, False), (2, False, True), (None, True, True)):
        missing = pytest.raises(BrakecliError, match="4 of 4") if starts else nullcontext()
        with choose_engine(short, jobs, in_caller=in_caller) as engine, missing:
            sweep(write_sweep(tmp_path, frictions(4)), tmp_path / "s.h5", engine, force=True)


def test_a_long_run_at_a_corner_is_worth_workers(tmp_path: Path) -> None:
    durations = ", ".join(f"0.0{n}" for n in range(10, 90, 2))
    for values, workers in ((durations, 0), (f"{durations}, 2000.0", 2)):
        plan = write_sweep(tmp_path, frictions(4), axis("solver.duration", f"values = [{values}]")).plan
        assert size_of(plan, 2, spare=True).workers == workers


def test_a_sweep_is_refused_by_its_points_and_by_the_bytes_of_its_file(tmp_path: Path) -> None:
    found = size_of(write_sweep(tmp_path, frictions(4)).plan, 1)
    refuse_sweep(found, 1e9)
    with pytest.raises(RefusedError, match=r"10,000,000 points are the most"):
        refuse_sweep(replace(found, points=MOST_POINTS + 1), 1e9)
    with pytest.raises(RefusedError, match="the file would be too large"):
        refuse_sweep(found, 1.9 * found.file_size)
    with pytest.raises(RefusedError, match="needs more memory than there is"):
        refuse_sweep(replace(found, memory=1e18), 1e9)


def test_a_followed_motion_that_dies_out_below_the_numbers_of_a_case_goes_on(tmp_path: Path) -> None:
    """A run of 2 s with σ = -15 1/s leaves e^-30 of a velocity, whatever the wheel's speed: after eight of them it
    is no number that a case takes."""
    write_sweep(tmp_path, axis("wheel.angular_speed", "start=3.0", "stop=4.0", "num=24", 'direction = "up"'))
    settings = ["solver={tolerance=1e-3, duration=2.0}", "friction.coefficient=0.05"]
    plan = load_sweep(str(tmp_path / "s.toml"), [*settings, "output.sample_interval=1e-4"]).plan
    assert compute(plan, 0, 1)["status"].tolist() == [b"done"] * len(line_points(plan, 0))
