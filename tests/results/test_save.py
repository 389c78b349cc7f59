"""A result in memory is kept as a file by `result.brakecli.save`, and by nothing else."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import brakecli
from brakecli.errors import CannotWriteError, UnreadableResultError, UsageError
from brakecli.results.contents import difference
from brakecli.results.read import open_result
from tests.campaign import campaign
from tests.commands import TINY
from tests.commands import brakecli as command

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny case, and its result."""
    folder = tmp_path_factory.mktemp("kept")
    (folder / "tiny.toml").write_text(TINY)
    brakecli.run(folder / "tiny.toml", output=folder / "run.h5")
    return folder


@pytest.fixture
def tree(folder: Path) -> Any:
    return brakecli.load(folder / "run.h5")


def told_apart(first: Path, second: Path) -> str:
    with open_result(first) as a, open_result(second) as b:
        return difference(a, b).sentence


def test_a_run_that_is_kept_is_the_same_and_has_the_form_of_a_result(
    folder: Path, tree: Any, tmp_path: Path
) -> None:
    tree.brakecli.save(tmp_path / "kept.h5")
    xr.testing.assert_identical(brakecli.load(tmp_path / "kept.h5"), tree)
    assert told_apart(folder / "run.h5", tmp_path / "kept.h5") == "no difference in case, numbers and variables"
    with h5py.File(folder / "run.h5") as before, h5py.File(tmp_path / "kept.h5") as after:
        names: list[str] = []
        before.visit(names.append)
        for name in names:
            assert type(after[name]) is type(before[name])
            if isinstance(node := before[name], h5py.Dataset):
                assert (after[name].dtype, after[name].fletcher32) == (node.dtype, True), name
                assert {*after[name].attrs} == {*node.attrs}, name
    assert [path.name for path in tmp_path.iterdir()] == ["kept.h5"]


@campaign
def test_every_command_reads_what_is_kept(tree: Any, tmp_path: Path) -> None:
    tree.brakecli.save(tmp_path / "kept.h5")
    found = command("info", "kept.h5", "--json", cwd=tmp_path).json
    assert (found["kind"], found["whole"]) == ("run", True)
    assert found["versions"]["brakecli"] == tree.attrs["brakecli_version"]
    assert command("classify", "kept.h5", "--json", cwd=tmp_path).json["regime"] == tree.attrs["regime"]
    for words in (["plot"], ["report"], ["export"], ["run", "-o", "again.h5"]):
        command(words[0], "kept.h5", *words[1:], cwd=tmp_path).told(0)


KINDS: dict[str, Callable[[Path], Any]] = {
    "sweep": lambda case: brakecli.sweep(case, axes={"friction.coefficient": [0.3, 0.6]}, jobs=1),
    "loop": lambda case: brakecli.sweep(case, axes={"friction.coefficient": [0.3, 0.6]}, direction="both", jobs=1),
    "stability": lambda case: brakecli.stability(case, vary={"friction.coefficient": [0.5, 0.6, 0.7]}),
    "branch": lambda case: brakecli.branch(case, parameter={"friction.coefficient": (0.5, 0.7)}, pushes=0),
}


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=campaign) for kind in KINDS if kind != "sweep"] + ["sweep"]
)
def test_results_of_other_kinds_are_kept(kind: str, folder: Path, tmp_path: Path) -> None:
    found = KINDS[kind](folder / "tiny.toml")
    found.brakecli.save(tmp_path / "kept.h5")
    again = brakecli.load(tmp_path / "kept.h5")
    xr.testing.assert_identical(again if kind == "branch" else again.to_dataset(), found)
    again.brakecli.save(tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "kept.h5").read_bytes()
    assert command("plot", "kept.h5", cwd=tmp_path).told(0) == ""


def test_what_was_changed_is_kept_as_it_is_now(tree: Any, tmp_path: Path) -> None:
    part = tree.isel(time=slice(0, 50))
    part["history/power"] = part["history/friction_force"] * part["history/vx"]
    part["history/power"].attrs["units"] = "W"
    part.attrs["title"] = "The start"
    part.brakecli.save(tmp_path / "part.h5")
    again = brakecli.load(tmp_path / "part.h5")
    assert again.attrs["title"] == "The start"
    np.testing.assert_array_equal(again["history/power"], part["history/power"])
    with open_result(tmp_path / "part.h5") as result:
        assert result.variables("history")["power"].attributes == {"units": "W", "long_name": "power"}
        assert result.variables("history")["x"].shape == (50,)


def with_a_gap(tree: Any) -> Any:
    tree["history/vx"][3] = np.nan
    return tree


def with_flags(tree: Any) -> Any:
    tree["history/fast"] = tree["history/vx"] > 0.01
    return tree


def with_attribute(name: str, value: object) -> Callable[[Any], Any]:
    def change(tree: Any) -> Any:
        tree.attrs[name] = value
        return tree

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (with_a_gap, "history/vx: must be finite numbers"),
        (with_flags, "history/fast: must be finite numbers, or text"),
        (with_attribute("frequency", "high"), "attribute frequency is not what belongs there: fundamental"),
        (with_attribute("title", {"a": 1}), "attribute title: must be finite numbers, or text"),
        (with_attribute("kind", None), "attribute kind is missing"),
        (lambda tree: tree["history"].to_dataset(), "attribute kind is missing, as of a part of a result"),
        (lambda tree: tree.isel(time=0), "has no dimension"),
        (lambda tree: tree.isel(time=slice(None, None, -1)), "time in group history does not increase"),
        (lambda tree: brakecli.classify(tree), "attribute kind is missing"),
    ],
)
def test_what_is_no_result_is_not_kept(
    tree: Any, tmp_path: Path, change: Callable[[Any], Any], reason: str
) -> None:
    with pytest.raises(UsageError, match=rf"kept\.h5: is no result that can be kept: .*{reason}"):
        change(tree.copy(deep=True)).brakecli.save(tmp_path / "kept.h5")
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_replaced_only_by_force_and_whole(tree: Any, tmp_path: Path) -> None:
    path = tmp_path / "kept.h5"
    tree.brakecli.save(path)
    before = path.read_bytes()
    part = tree.isel(time=slice(0, 50))
    with pytest.raises(UsageError, match=r"exists already; replace it with force=True"):
        part.brakecli.save(path)
    with pytest.raises(UsageError, match="must be finite numbers"):
        with_a_gap(tree.copy(deep=True)).brakecli.save(path, force=True)
    assert path.read_bytes() == before
    part.brakecli.save(str(path), force=True)
    assert brakecli.load(path)["history"].sizes["time"] == 50
    with pytest.raises(CannotWriteError, match="does not exist"):
        tree.brakecli.save(tmp_path / "nowhere" / "kept.h5")


@pytest.mark.parametrize("form", ["h5netcdf", "an older form"])
def test_what_xarray_has_saved_is_refused_with_the_remedy(tree: Any, tmp_path: Path, form: str) -> None:
    path = tmp_path / "copy.nc"
    tree.to_netcdf(path, engine="h5netcdf")
    if form != "h5netcdf":
        with h5py.File(path) as new, h5py.File(tmp_path / "old.nc", "w", libver="earliest") as old:
            old.attrs.update(new.attrs)
            new.copy("history", old)
        path = tmp_path / "old.nc"
    remedy = r"keep a Dataset by result\.brakecli\.save\(path\), or compute it again"
    with pytest.raises(UnreadableResultError, match=f"has no digest, as another program has saved it; {remedy}"):
        brakecli.load(path)
    told = command("plot", path.name, cwd=tmp_path).told(4, "has no digest", "result.brakecli.save(path)")
    assert told.count("\n") == 1
