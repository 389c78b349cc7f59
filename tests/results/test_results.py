"""Result files that are well: what is written comes back, in this program, in h5py and in xarray."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

from brakecli.errors import UsageError
from brakecli.results.field import Field
from brakecli.results.opening import is_hdf5
from brakecli.results.read import open_result
from brakecli.results.write import ResultFile, new_result

STATES: dict[str, Any] = {
    "flag_values": np.array([-1, 0, 1, 2], np.int8),
    "flag_meanings": "backward stick forward separated",
}


def history(rows: int) -> dict[str, Any]:
    time_s = np.arange(rows) * 1e-5
    return {"time": time_s, "vx": np.sin(700 * time_s), "state": np.arange(rows) % 4 - 1}


def write(path: Path, rows: int = 100, piece: int = 1000) -> None:
    with new_result(path, force=True) as result:
        result.set_attributes({"kind": "run", "case_toml": 'title = "Größe"\n' * 500})
        result.set_attributes(
            {"regime": "damped", "reasons": ["too short", "zu kurz"], "frequency": 12.5}, "/regime"
        )
        result.axis("history", Field("time", "s", "time"))
        result.variable("history", Field("vx", "m/s", "horizontal velocity"), ["time"])
        result.variable("history", Field("state", "1", "state of the pad", "i1"), ["time"], **STATES)
        whole = history(rows)
        for start in range(0, rows, piece):
            result.append("history", {name: values[start : start + piece] for name, values in whole.items()})
        result.axis("points", Field("solver_scheme", "1", "scheme"), ["two-layer", "größer"])
        result.axis("points", Field("phi", "1", "friction"), [0.1, 0.2, 0.3])
        result.variable("points", Field("amplitude", "m", "amplitude"), ["solver_scheme", "phi"], np.ones((2, 3)))
        result.axis("nothing", Field("frequency", "Hz", "frequency"), [])
        result.commit()


@contextmanager
def growing(path: Path) -> Iterator[ResultFile]:
    with new_result(path, force=False) as result:
        result.axis("history", Field("time", "s", "time"))
        result.variable("history", Field("state", "1", "state", "i1"), ["time"])
        yield result


@pytest.mark.parametrize("rows", [0, 1, 100, 16384, 40000])
def test_what_is_written_comes_back_exactly(tmp_path: Path, rows: int) -> None:
    write(tmp_path / "r.h5", rows)
    with open_result(tmp_path / "r.h5", "run") as result:
        for name, values in history(rows).items():
            np.testing.assert_array_equal(result.read("history", name), values, strict=name != "state")
        assert result.read("history", "vx", 3, 7).tolist() == history(rows)["vx"][3:7].tolist()
        assert result.read("points", "solver_scheme").tolist() == ["two-layer", "größer"]
        assert result.read("nothing", "frequency").shape == (0,)
        assert result.attributes["case_toml"] == 'title = "Größe"\n' * 500
        assert result.group_attributes("regime") == {
            "regime": "damped",
            "reasons": ["too short", "zu kurz"],
            "frequency": 12.5,
        }
        assert set(result.file) == {"history", "points", "nothing", "regime"}
        state = result.variables("history")["state"]
        assert (state.dims, state.shape, state.attributes["units"]) == (("time",), (rows,), "1")
        assert result.variables("points")["amplitude"].dims == ("solver_scheme", "phi")


def test_xarray_opens_every_group_with_coordinates_units_and_flags(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", 20000)
    with xr.open_dataset(tmp_path / "r.h5", group="history", engine="h5netcdf") as data:
        assert list(data.coords) == ["time"]
        np.testing.assert_array_equal(data.vx.sel(time=5e-5), np.sin(700 * 5e-5))
        assert data.vx.attrs == {"units": "m/s", "long_name": "horizontal velocity"}
        assert data.state.dtype == np.int8
        assert data.state.attrs["flag_values"].tolist() == [-1, 0, 1, 2]
        assert data.state.attrs["flag_meanings"] == STATES["flag_meanings"]
        assert data.time.attrs == {"units": "s", "long_name": "time"}
    with xr.open_dataset(tmp_path / "r.h5", group="points", engine="h5netcdf") as data:
        assert data.amplitude.dims == ("solver_scheme", "phi")
        assert data.solver_scheme.values.tolist() == ["two-layer", "größer"]
    with xr.open_dataset(tmp_path / "r.h5", group="nothing", engine="h5netcdf") as data:
        assert data.sizes == {"frequency": 0}
    with xr.open_dataset(tmp_path / "r.h5", group="regime", engine="h5netcdf") as data:
        assert data.attrs["reasons"] == ["too short", "zu kurz"]
    with xr.open_dataset(tmp_path / "r.h5", engine="h5netcdf") as data:
        assert (data.attrs["format"], data.attrs["complete"]) == ("brakecli", 1)


def test_every_dataset_has_a_checksum_and_no_time_stamp(tmp_path: Path) -> None:
    write(tmp_path / "r.h5")
    seen = []

    def look(name: str, node: h5py.HLObject) -> None:
        if isinstance(node, h5py.Dataset):
            seen.append(name)
            assert node.fletcher32
            assert node.compression is None
            assert not node.id.get_create_plist().get_obj_track_times()

    with h5py.File(tmp_path / "r.h5") as file:
        file.visititems(look)
    assert len(seen) == 7


@pytest.mark.parametrize("rows", [40000])
def test_the_bytes_do_not_depend_on_time_process_or_pieces(tmp_path: Path, rows: int) -> None:
    write(tmp_path / "a.h5", rows)
    time.sleep(1.1)  # time stamps in HDF5 count seconds
    script = [sys.executable, __file__, str(tmp_path / "b.h5"), str(rows)]
    subprocess.run(script, check=True, cwd=Path(__file__).parents[2])
    expected = (tmp_path / "a.h5").read_bytes()
    assert (tmp_path / "b.h5").read_bytes() == expected
    for piece in (7, 1000, rows):
        write(tmp_path / "c.h5", rows, piece)
        assert (tmp_path / "c.h5").read_bytes() == expected


def test_rows_are_read_back_while_more_are_written(tmp_path: Path) -> None:
    with growing(tmp_path / "r.h5") as result:
        for start in range(0, 50000, 5000):
            rows = np.arange(start, start + 5000)
            result.append("history", {"time": rows, "state": rows % 3})
        assert result.rows("history") == 50000
        for start, stop in ((0, 50000), (0, 10), (16380, 16390), (32000, 49999), (49990, 60000), (60000, 60001)):
            expected = np.arange(start, min(stop, 50000))
            np.testing.assert_array_equal(result.read("history", "time", start, stop), expected)
            np.testing.assert_array_equal(result.read("history", "state", start, stop), expected % 3)
        result.commit()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, True, 1j, None])
def test_only_finite_numbers_reach_a_file(tmp_path: Path, bad: Any) -> None:
    with growing(tmp_path / "r.h5") as result:
        with pytest.raises(ValueError, match="history/time"):
            result.append("history", {"time": [bad], "state": [0]})
        with pytest.raises(ValueError, match="points/phi"):
            result.axis("points", Field("phi", "1", "friction"), [bad])
        with pytest.raises(ValueError, match="amplitude"):
            result.set_attributes({"amplitude": bad})


def test_a_mistake_of_the_caller_is_refused(tmp_path: Path) -> None:
    with growing(tmp_path / "r.h5") as result:
        with pytest.raises(ValueError, match=r"history/state: does not fit int8"):
            result.append("history", {"time": [0.0], "state": [128]})
        with pytest.raises(ValueError, match="needs"):
            result.append("history", {"time": [0.0]})
        with pytest.raises(ValueError, match="same number of rows"):
            result.append("history", {"time": [0.0, 1.0], "state": [0]})
        with pytest.raises(ValueError, match="no dimension"):
            result.variable("history", Field("x", "m", "scalar"), [], 1.0)
        with pytest.raises(ValueError, match="twice"):
            result.axis("history", Field("time", "s", "time"))
        with pytest.raises(ValueError, match="growing"):
            result.variable("history", Field("x", "m", "over an axis that is not there"), ["place"])
        result.axis("points", Field("phi", "1", "friction"), [0.1, 0.2])
        with pytest.raises(ValueError, match="its shape"):
            result.variable("points", Field("x", "m", "too long"), ["phi"], [1.0, 2.0, 3.0])


def test_an_existing_output_is_kept_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    path.write_text("old")
    with pytest.raises(UsageError, match=r"r\.h5: exists already; .*--force.*-o"), new_result(path, force=False):
        raise AssertionError
    with new_result(path, force=True) as result:
        assert path.read_text() == "old"
        result.commit()
    assert is_hdf5(path)


def test_only_a_result_is_replaced(tmp_path: Path) -> None:
    """What is called .h5, or empty, may be what is left of one."""
    for name, text in (("case.toml", "[shoe]"), ("profile.csv", "x,y")):
        (tmp_path / name).write_text(text)
        with pytest.raises(UsageError, match="is no result, and is"), new_result(tmp_path / name, force=True):
            raise AssertionError
        assert (tmp_path / name).read_text() == text
    for name in ("empty", "damaged.h5"):
        (tmp_path / name).write_text("?" * (name != "empty"))
        with new_result(tmp_path / name, force=True) as result:
            result.commit()


def test_an_output_that_appears_meanwhile_is_kept_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    with new_result(path, force=False) as result:
        path.write_text("someone else's")
        with pytest.raises(UsageError, match="exists already"):
            result.commit()
    assert [entry.name for entry in tmp_path.iterdir()] == ["r.h5"]
    assert path.read_text() == "someone else's"


def test_a_symbolic_link_keeps_pointing_to_the_result(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "link.h5").symlink_to(tmp_path / "disk" / "r.h5")
    write(tmp_path / "link.h5")
    assert (tmp_path / "link.h5").is_symlink()
    assert is_hdf5(tmp_path / "disk" / "r.h5")


def test_without_commit_nothing_remains(tmp_path: Path) -> None:
    with growing(tmp_path / "r.h5") as result:
        result.append("history", {"time": [0.0], "state": [0]})
        assert {entry.name for entry in tmp_path.iterdir()} == {".r.h5.lock", ".r.h5.part"}
    assert list(tmp_path.iterdir()) == []


def test_hdf5_is_known_by_its_signature_alone(tmp_path: Path) -> None:
    write(tmp_path / "case.toml")
    with h5py.File(tmp_path / "block.mat", "w", userblock_size=1024):
        pass
    (tmp_path / "text.h5").write_text("[shoe]\n" * 1000)
    (tmp_path / "empty.h5").touch()
    assert is_hdf5(tmp_path / "case.toml")
    assert is_hdf5(tmp_path / "block.mat")
    for other in ("text.h5", "empty.h5", "missing.h5", ".", "x" * 300, "nul\0"):
        assert not is_hdf5(tmp_path / other)


if __name__ == "__main__":
    write(Path(sys.argv[1]), int(sys.argv[2]))
