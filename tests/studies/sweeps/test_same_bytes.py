"""A sweep gives the same bytes however it is computed."""

from pathlib import Path

import pytest

from brakecli.studies.sweeps.workers.task import compute_units
from tests.campaign import campaign
from tests.commands import brakecli, left_in
from tests.studies.sweeps.helpers import axis, frictions, inline, interrupted, local, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")


SWEEPS = {
    "grid": (frictions(5), axis("link2.angle_deg", "values = [1.0, 5.0, 9.0]")),
    "followed": (  # the second scheme ends its points early
        axis("solver.duration", "values = [0.6]"),
        axis("solver.scheme", 'values = ["two-layer", "piecewise-exact"]'),
        frictions(3, 'direction = "both"'),
    ),
    "critical": (
        axis("link2.angle_deg", "start = 1.0", "stop = 9.0", "num = 4"),
        '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\nmethod = "eigenvalue"\n',
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
@campaign
def test_no_way_of_computing_a_sweep_changes_a_byte(tmp_path: Path, name: str) -> None:
    loaded = write_sweep(tmp_path, *SWEEPS[name])
    inline(loaded, tmp_path / "s.h5", compute_units)
    expected = (tmp_path / "s.h5").read_bytes()

    def same() -> None:
        assert (tmp_path / "s.h5").read_bytes() == expected
        (tmp_path / "s.h5").unlink()
        assert left_in(tmp_path) == {"tiny.toml", "s.toml"}

    same()
    for size, order in ((1, 1), (1000, 1), (7, -1)):
        inline(loaded, tmp_path / "s.h5", compute_units, task_size=size, order=order)
        same()
    for size, order in ((1, 1), (2, -1)):  # with an interruption in the middle
        interrupted(loaded, tmp_path / "s.h5", compute_units, task_size=size, order=order, limit=1)
        assert inline(loaded, tmp_path / "s.h5", compute_units, task_size=size + 1, order=-order).resumed > 0
        same()
    if name != "critical":  # as below
        local(loaded, tmp_path / "s.h5", compute_units, 2, task_size=1)
        same()
    if name == "grid":  # one task, and so one worker
        brakecli("sweep", "s.toml", "-q", "-j", "2", "--task-size", "1000", cwd=tmp_path).told(0)
        same()


@campaign
def test_a_critical_value_by_simulation_does_not_depend_on_the_workers(tmp_path: Path) -> None:
    angles = axis("link2.angle_deg", "values = [3.0, 8.0]")
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\ntolerance = 0.1\n'
    loaded = write_sweep(tmp_path, angles, search)
    inline(loaded, tmp_path / "one.h5", compute_units)
    local(loaded, tmp_path / "two.h5", compute_units, task_size=1)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()
