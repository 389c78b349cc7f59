"""Sweeps of any size take little memory, or are refused at once."""

from pathlib import Path
from typing import Any

import pytest

from tests.campaign import campaign
from tests.commands import TINY, brakecli, left_in
from tests.studies.sweeps.helpers import axis, frictions, program, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")


@campaign
def test_a_sweep_of_a_billion_points_is_refused_at_once_with_its_size(tmp_path: Path) -> None:
    names = ("friction.coefficient", "link2.angle_deg", "shoe.mass")
    billions = {
        "one-axis": [frictions(1_000_000_000)],
        "followed": [frictions(1_000_000_000, 'direction = "both"')],
        "three-axes": [axis(name, "start = 0.1", "stop = 1.0", "num = 1000") for name in names],
    }
    for name, tables in billions.items():
        (folder := tmp_path / name).mkdir()
        write_sweep(folder, *tables)
        told = brakecli("sweep", "s.toml", "-j", "2", cwd=folder).told(
            3,
            f"brakecli: the sweep is too large: {1 + (name == 'followed')}000000000 points on 2 workers: ",
            " MB of memory, a file of ",
        )
        assert told.count("\n") == 1
    done = program("refused", *(tmp_path / name / "s.toml" for name in billions))
    assert int(done.out) < 400_000_000  # bytes; one for each point would be more
    assert all(left_in(tmp_path / name) == {"tiny.toml", "s.toml"} for name in billions)


def test_a_sweep_of_more_points_than_an_integer_of_64_bits_holds_is_refused_too(tmp_path: Path) -> None:
    names = ("friction.coefficient", "link2.angle_deg", "shoe.mass")
    write_sweep(tmp_path, *(axis(name, "start = 0.1", "stop = 1.0", "num = 10000000") for name in names))
    brakecli("check", "s.toml", cwd=tmp_path).told(3, "the sweep is too large: 1000000000000000000000 points")


def memory_of(folder: Path, points: int, compute: str) -> dict[str, Any]:
    """The largest memory of a sweep of the shortest runs, in bytes, of its parent and of its workers."""
    shortest = TINY.replace("step = 1e-5, duration = 0.02", "step = 1e-4, duration = 1e-4")
    write_sweep(folder, frictions(points), case=shortest)
    (folder / "s.h5").unlink(missing_ok=True)
    done = program("memory", folder / "s.toml", compute, limit=900.0)
    assert done.code == 0, done
    found = done.json
    assert found["failed"] == 0
    assert found["points"] == points
    return found


POINT_BYTES = 1000
"""What a point may cost the parent, which holds all values of one variable at a time. The widest are texts of
240 bytes, once as bytes and once as characters of four bytes each; 660 bytes were measured."""

WORKER_MARGIN = 10_000_000
"""Bytes; a worker knows of one task at a time, and what it needs besides depends on how memory was handed out."""


@pytest.mark.parametrize(("points", "compute"), [(100_000, "quick"), (30_000, "compute_units")])
@campaign
def test_many_points_need_no_more_memory_than_a_thousand(tmp_path: Path, points: int, compute: str) -> None:
    few = memory_of(tmp_path, 1000, compute)
    many = memory_of(tmp_path, points, compute)
    assert many["parent"] < few["parent"] + POINT_BYTES * (points - 1000)
    assert many["workers"] < few["workers"] + WORKER_MARGIN
