"""Result files that were changed by hand: a sentence and exit code 4, or an answer, within little memory."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from brakecli.files.read import open_result
from tests.campaign import campaign, statistics
from tests.commands import TINY, Done, brakecli, forked
from tests.files.forger import forge

MEMORY = 605_000_000  # bytes beside the libraries; 1.09 GB with them
GRID = """\
case = "tiny.toml"
[[axis]]
parameter = "friction.coefficient"
values = [0.3, 0.6]
[[axis]]
parameter = "shoe.mass"
values = [8.0, 10.0, 12.0]
"""
LOOKS = [["info"], ["diff", "f.h5", "--json"], ["export", "-o", "o.csv", "--force", "-q"]]
COMMANDS = {
    "run": [
        ["classify"],
        ["classify", "--json"],
        ["classify"],
        ["run", "-o", "o.h5", "--force", "-q"],
        ["plot", "-q"],
        *LOOKS,
    ],
    "sweep": [["plot", "-q"], ["classify"], ["run", "-o", "o.h5"], *LOOKS],
    "comparison": [["plot", "-q"], ["classify"], *LOOKS],
    "stability": [["plot", "-q"], ["classify"], *LOOKS],
}


@pytest.fixture(scope="module")
def results(good: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result of each kind, without its digest."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "tiny.toml").write_text(TINY)
    (folder / "s.toml").write_text(GRID)
    brakecli("sweep", "s.toml", "-q", "-o", "sweep.h5", cwd=folder).told(0)
    schemes = ["--schemes", "two-layer", "--steps", "1e-4,5e-5", "--budget", "1"]
    brakecli("compare-schemes", "tiny.toml", "-q", "-o", "comparison.h5", *schemes, cwd=folder).told(0)
    vary = ["--vary", "friction.coefficient=0.5:0.7:3"]
    brakecli("stability", "tiny.toml", "-q", "-o", "stability.h5", *vary, cwd=folder).told(0)
    shutil.copy(good / "tiny.h5", folder / "run.h5")
    for kind in COMMANDS:
        path = folder / f"{kind}.h5"
        path.write_bytes(path.read_bytes()[:-32])
    return folder


def tried(folder: Path, name: str, command: list[str]) -> Done:
    first, *rest = command
    more = ["-o", "p.png", "--force"] if first == "plot" else []
    return forked(first, name, *rest, *more, cwd=folder, memory=MEMORY)


MANY = pytest.param(100, 0.0, marks=campaign), pytest.param(500, 0.0, marks=statistics)


@pytest.mark.parametrize(("number", "spared"), [(12, 0.9), *MANY])
def test_a_forged_result_is_refused_with_a_sentence_or_used(
    results: Path, tmp_path: Path, number: int, spared: float
) -> None:
    """`spared`: part of the pictures, which take long, that are replaced by a verdict."""
    chance = random.Random(number)
    found = 0
    for _ in range(number):
        kind = chance.choice(("run", "run", "run", "run", "sweep", "comparison", "stability"))
        shutil.copy(results / f"{kind}.h5", tmp_path / "f.h5")
        what = forge(tmp_path / "f.h5", chance)
        command = chance.choice(COMMANDS[kind])
        if command[0] == "plot" and chance.random() < spared:
            command = ["classify"]
        done = tried(tmp_path, "f.h5", command)
        # 1: a run fails; 2: there is nothing to draw in what was left
        assert done.code in ((0, 2, 4) if command[0] == "plot" else (0, 1, 4)), (what, command, done)
        assert "Traceback" not in done.err, (what, command, done)
        told = [line for line in done.err.splitlines() if "has no digest" not in line]
        assert done.code == 0 or len(told) == 1, (what, command, done)
        found += done.code == 4
    assert number / 5 < found < number


def test_what_other_programs_have_added_does_no_harm(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        for place in (file, file["history"], file["history/x"]):
            place.attrs["note"] = "ü"
            place.attrs["bytes"] = np.bytes_(b"\xff")
            place.attrs["of"] = np.arange(6.0).reshape(2, 3)
            place.attrs["flag"] = True
            place.attrs["empty"] = h5py.Empty("f8")
            place.attrs["link"] = file["history"].ref
        file["history/own"] = np.arange(3)
        file["history/one"] = 1.0
        file.create_dataset("history/large", (10**9,), "f8", chunks=(1000,))
        file["history/elsewhere"] = h5py.SoftLink("/nowhere")
        file["more/x"] = [b"a"]
        file.attrs["tool_version"] = [1, 2]
    for command in [*COMMANDS["run"], ["diff", str(results / "run.h5"), "--json"]]:
        tried(tmp_path, "f.h5", command).told(0)
    with open_result(tmp_path / "f.h5") as stored:
        assert stored.attributes["note"] == "ü"
        assert stored.read("history", "own").tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    "text", ["a = 1\na.b = 2", *(pytest.param(t, marks=campaign) for t in (f"a = {'[' * 3000}{']' * 3000}", ""))]
)
@campaign
def test_a_sweep_whose_case_is_no_toml_is_drawn_and_not_reported_on(
    results: Path, tmp_path: Path, text: str
) -> None:
    shutil.copy(results / "sweep.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        file.attrs["resolved_toml"] = text
    assert tried(tmp_path, "f.h5", ["plot"]).code == 0
    tried(tmp_path, "f.h5", ["report"]).told(4, "the case in it is not valid")


@campaign
def test_a_dollar_sign_in_a_unit_or_a_name_begins_no_formula(results: Path, tmp_path: Path) -> None:
    for name in ("$x^{b$.h5", "$y^{$.h5"):
        shutil.copy(results / "run.h5", tmp_path / name)
    assert tried(tmp_path, "$x^{b$.h5", ["diff", "$y^{$.h5", "-o", "d.png"]).code in (0, 1)
    assert (tmp_path / "d.png").exists()
    shutil.copy(results / "sweep.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        file["amplitude"].attrs["units"] = file["frequency"].attrs["units"] = r"$x^{$ \frac{"
    assert tried(tmp_path, "f.h5", ["plot"]).code == 0


def test_a_unit_that_is_a_number_is_named_in_json(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        file["history/state"].attrs["units"] = np.inf
    held = tried(tmp_path, "f.h5", ["info", "--json"]).json["variables"]
    assert "inf" in [each["units"] for each in held]


def test_a_history_in_half_precision_is_computed_with_in_double(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        half = 1e4 * np.ones_like(file["history/vy"], dtype="f2")  # its square is beyond the largest such number
        half[::2] = -1e4
        replaced("history/vy", half)(file)
    done = tried(tmp_path, "f.h5", ["classify", "--json"])
    assert done.code in (0, 4)
    assert "Warning" not in done.told(done.code)
    with open_result(tmp_path / "f.h5") as stored:
        assert stored.read("history", "vy").dtype == np.float64


def test_a_case_with_numbers_that_are_none_is_refused(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        file.attrs["resolved_toml"] = str(file.attrs["resolved_toml"]) + "\n[more]\nx = nan\n"
    for command in (["diff", str(results / "run.h5"), "--json"], ["classify", "--json"]):
        tried(tmp_path, "f.h5", command).told(4, "the case in it is not valid" if command[0] == "diff" else "")


def dims(kind: str) -> Callable[[h5py.File], object]:
    def change(file: h5py.File) -> None:
        del file["history/x"].attrs["DIMENSION_LIST"]
        file["history/x"].attrs["DIMENSION_LIST"] = np.zeros(1, kind)

    return change


def replaced(name: str, values: object, **more: object) -> Callable[[h5py.File], object]:
    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, data=values, **more)

    return change


def view_of_itself(name: str) -> Callable[[h5py.File], object]:
    """A virtual dataset without a fixed length: HDF5 crashes as soon as its shape is asked for."""

    def change(file: h5py.File) -> None:
        if name in file:
            del file[name]
        grows = h5py.h5s.create_simple((5,), (h5py.h5s.UNLIMITED,))
        grows.select_hyperslab((0,), (1,), block=(h5py.h5s.UNLIMITED,))
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_virtual(grows, b".", name.encode(), grows)
        h5py.h5d.create(file.id, name.encode(), h5py.h5t.NATIVE_DOUBLE, grows, plist)

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (view_of_itself("history/x"), "variable x in group history is a link, or a view of something else"),
        (dims("i8"), "attribute DIMENSION_LIST of x holds no references"),
        (replaced("history/x", np.zeros(7)), "variable x in group history has the shape (7,)"),
        (replaced("history/time", np.zeros(201)), "variable time in group history does not increase"),
        (replaced("history/time", np.full(201, 1e308)), "not finite, or too large"),
        (replaced("history/vx", np.full(201, b"x")), "variable vx in group history is not what belongs there"),
        (replaced("spectrum/vx", None, shape=(3 * 10**8,), dtype="f8", chunks=(1000,)), "claims 300000000 values"),
        (
            lambda file: file.attrs.__setitem__("failure", np.bytes_(b"\xff")),
            "attribute failure is not what belongs",
        ),
        (lambda file: file.attrs.__setitem__("failure", np.arange(3)), "attribute failure is not what belongs"),
        (lambda file: file.attrs.__delitem__("resolved_toml"), "attribute resolved_toml is missing"),
    ],
)
def test_a_forgery_is_named(
    results: Path, tmp_path: Path, change: Callable[[h5py.File], object], reason: str
) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        change(file)
    done = tried(tmp_path, "f.h5", ["classify"])
    assert done.told(4, "f.h5: cannot be read as a result: ", reason, "has no digest").count("\n") == 2


def test_samples_that_are_too_large_are_told_by_what_reads_them(results: Path, tmp_path: Path) -> None:
    """`classify` decides by the record of answers, and reads none."""
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        replaced("history/vx", np.full(201, 1e308))(file)
    tried(tmp_path, "f.h5", ["plot", "-q"]).told(
        4, "f.h5: cannot be read as a result: ", "not finite, or too large"
    )
    tried(tmp_path, "f.h5", ["classify"]).told(0)


def test_a_view_of_itself_is_no_signal_and_does_no_harm_in_a_result(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "run.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        view_of_itself("history/own")(file)
    tried(tmp_path, "f.h5", ["classify"]).told(0)
    signal = ["classify", "--quantity", "force", "--sample-rate", "1000"]
    told = tried(tmp_path, "f.h5:/history/own", signal).told(
        4, "there is no dataset /history/own, only /history/contact"
    )
    assert told.count("/history/own") == 2


@pytest.mark.parametrize(
    "command", [["info"], ["plot", "-q"], ["export", "-o", "o.csv"], ["report", "-o", "o.html"]]
)
def test_an_axis_that_does_not_fit_its_variables_is_told(
    results: Path, tmp_path: Path, command: list[str]
) -> None:
    shutil.copy(results / "stability.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        about = dict(file["friction_coefficient"].attrs)
        del file["friction_coefficient"]
        file["friction_coefficient"] = np.ones((3, 2))
        file["friction_coefficient"].attrs.update(
            {name: about[name] for name in ("units", "long_name", "parameters")}
        )
    tried(tmp_path, "f.h5", command).told(4, "axis friction_coefficient of", "has the shape (3, 2)")


def test_a_quantity_that_is_a_link_is_not_left_out_without_a_word(results: Path, tmp_path: Path) -> None:
    shutil.copy(results / "sweep.h5", tmp_path / "f.h5")
    with h5py.File(tmp_path / "f.h5", "r+") as file:
        del file["frequency"]
        file["frequency"] = h5py.ExternalLink(str(results / "sweep.h5"), "/frequency")
    tried(tmp_path, "f.h5", ["export", "-o", "o.csv"]).told(4, "variable frequency in group / is a link")
