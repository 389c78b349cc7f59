"""`stability --vary`, its files and its picture, as their users meet them."""

import csv
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from brakecli.analysis.stability.report import stability
from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.results.field import values_of
from brakecli.results.stability_fields import LOCK_IN, STABILITY
from brakecli.studies.sweeps.lock_in import lock_in
from brakecli.studies.sweeps.tables import Axis
from brakecli.views.render import TERMINAL
from brakecli.views.stability import of_stability
from brakecli.views.terminal import terminal_text
from tests.campaign import campaign
from tests.commands import ROOT, brakecli, each, left_in
from tests.views.plots.helpers import panels

xarray = import_module("xarray")  # imported so because h5netcdf has no type hints

MODE_COUPLING, DAMPED = (str(ROOT / "cases" / f"{name}.toml") for name in ("mode-coupling", "damped"))
FRICTION = ["--vary", "friction.coefficient=0:1.5:7"]
NAMES = ("frequencies", "growth_rates", "damping_ratios")


@pytest.fixture(scope="module")
def here(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the diagram of the minimal model as HDF5, its picture, and as CSV."""
    folder: Path = tmp_path_factory.mktemp("lock-in")
    lines = [["stability", MODE_COUPLING, *FRICTION, "-q", "-o", name] for name in ("d.h5", "d.csv")]
    for done in each(folder, [*lines, ["plot", "d.h5", "-q"]]):
        done.told(0)  # the model has no units, and numbers that no brake has
        assert done.out == ""
    return folder


@campaign
def test_the_same_numbers_are_in_json_in_the_file_and_in_a_spreadsheet(here: Path) -> None:
    numbers = brakecli("stability", MODE_COUPLING, *FRICTION, "--json", cwd=here).json
    assert numbers["parameters"] == ["friction.coefficient"]
    assert numbers["critical_values"] == pytest.approx([0.75], abs=1e-7)
    assert numbers["output"] is None
    with xarray.open_dataset(here / "d.h5", engine="h5netcdf") as stored:
        assert stored.attrs["kind"] == "stability"
        assert np.atleast_1d(stored.attrs["critical_values"]).tolist() == numbers["critical_values"]
        assert stored.frequencies.dims == ("friction_coefficient", "mode")
        assert (stored.frequencies.units, stored.growth_rates.units) == ("Hz", "1/s")
        assert list(stored.friction_coefficient.values) == [entry["value"] for entry in numbers["vary"]]
        for name in NAMES:
            assert stored[name].values.tolist() == [entry[name] for entry in numbers["vary"]]
        assert list(stored.instability.values) == ["flutter"] * 7
        assert stored.critical_friction.values == pytest.approx([0.75] * 7)
    rows = list(csv.DictReader((here / "d.csv").read_text(encoding="utf-8").splitlines()))
    assert [float(row["friction.coefficient"]) for row in rows] == [entry["value"] for entry in numbers["vary"]]
    for mode in (0, 1):
        column = [float(row[f"frequencies of mode {mode + 1} (Hz)"]) for row in rows]
        assert column == [entry["frequencies"][mode] for entry in numbers["vary"]]
    growth = abs(np.sqrt(2.0 + 1j).imag)  # at φ = 1.5, where ω² = 2 ± i
    assert numbers["vary"][-1]["growth_rates"] == pytest.approx([growth, -growth], abs=1e-12)


@campaign
def test_the_picture_shows_both_modes_and_where_stability_changes(here: Path) -> None:
    assert (here / "d.png").stat().st_size > 10_000
    above, below = panels(here / "d.h5")
    with xarray.open_dataset(here / "d.h5", engine="h5netcdf") as stored:
        for axes, name in ((above, "frequencies"), (below, "growth_rates")):
            lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
            for mode in (0, 1):
                assert np.array_equal(lines[f"mode {mode + 1}"][:, 1], stored[name].values[:, mode])
            assert lines["stability changes"][:, 0] == pytest.approx(0.75)
    assert above.get_ylabel() == "frequency (Hz)"
    assert below.get_ylabel() == "growth rate (1/s)"
    assert below.get_xlabel() == "friction.coefficient"
    told = brakecli("classify", "d.h5", cwd=here).told(4, "holds a result of kind 'stability'")
    assert told.count("\n") == 1


def test_values_without_steady_sliding_are_gaps_and_the_ends_of_sliding_are_marked(here: Path) -> None:
    locking = ["--set", "link2.angle_deg=-5.0", "--vary", "friction.coefficient=0:100:5"]
    speed = ["--vary", "wheel.angular_speed=1:-1:5", "-o", "gap.h5"]
    lines = [["stability", DAMPED, *more, "--json"] for more in (locking, speed)]
    locks, turns = (done.json for done in each(here, lines))
    assert [entry["frequencies"][0] is None for entry in locks["vary"]] == [False, False, False, True, True]
    assert locks["critical_values"] == pytest.approx([locks["critical_friction"]], rel=1e-9)
    gap = turns["vary"][2]
    assert [gap[name] for name in NAMES] == [[None, None]] * 3
    assert [entry["instability"] for entry in turns["vary"]] == ["flutter", "flutter", None, *["divergence"] * 2]
    with xarray.open_dataset(here / "gap.h5", engine="h5netcdf") as stored:
        assert np.isnan(stored.frequencies.values).any(axis=1).tolist() == [False, False, True, False, False]
        assert stored.wheel_angular_speed.units == "rad/s"
    assert np.isnan(panels(here / "gap.h5")[0].get_lines()[0].get_ydata()).any()


def test_keys_are_tied_and_whole_numbers_stay_whole(here: Path) -> None:
    tied = ["--vary", "link1.stiffness,link2.stiffness=1e7:2e7:2", "--json"]
    alone = ["--set", "link1.stiffness=2e7", "--set", "link2.stiffness=2e7", "--json"]
    nodes = [
        "--set",
        "roughness.wheel={amplitudes=[1e-7], wavelengths=[0.02]}",
        "--vary",
        "contact.nodes=64:256:3",
    ]
    lines = [["stability", DAMPED, *more] for more in (tied, alone, [*nodes, "--json"])]
    many, one, whole = (done.json for done in each(here, lines))
    assert many["parameters"] == ["link1.stiffness", "link2.stiffness"]
    assert many["vary"][1]["critical_friction"] == one["critical_friction"]
    assert sorted(many["vary"][1]["growth_rates"]) == sorted(mode["growth"] for mode in one["modes"])
    assert [entry["value"] for entry in whole["vary"]] == [64, 160, 256]


def test_a_table_fits_into_eighty_columns_and_breaks_no_word(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    case = parse_case(*read_text(DAMPED))
    axis = Axis(parameter=("link1.stiffness", "link2.stiffness"), start=1e7, stop=2e7, num=3)
    found = lock_in(case, axis, "--vary", lambda what, done, total: None)
    numbers = values_of(STABILITY, stability(system_of(case.case))) | {"vary": found.entries}
    view = of_stability(numbers | values_of(LOCK_IN, found), "Title", TERMINAL)
    assert view.answer[-1] == "Along link1.stiffness, link2.stiffness, stability does not change."
    table = terminal_text(view).partition("\nAlong ")[2]
    assert max(map(len, table.splitlines())) <= 80
    words = (
        "link1.stiffness, link2.stiffness",
        " frequency ",
        " growth ",
        " damping 1, ",
        "2e+07",
    )
    assert [word for word in words if word not in table] == []


def test_what_cannot_be_varied_or_written_is_told_before_anything_is_computed(here: Path) -> None:
    before = left_in(here)
    words = {
        ("--vary", "title=0:1:2"): "title: is not a text (found 0.0)",
        ("--vary", "shoe.mass,shoe.mass=1:2:2"): "is not KEY=START:STOP:NUM",
        ("--vary", "shoe.mass=1:1e200:2"): "is not KEY=START:STOP:NUM",
        ("--vary", "shoe.mass,shoe.weight=1:2:2"): "shoe.weight: is unknown",
        ("--vary", "contact.nodes=2:3:3"): "is not a whole number (found 2.5)",
        (*FRICTION, "-o", "d.h5"): "d.h5: exists already; replace it with --force",
        (*FRICTION, "-o", "d.xlsx"): "ends in .h5 or .csv",
        ("-o", "e.h5"): "give --vary",
    }
    for (arguments, told), done in zip(
        words.items(), each(here, [["stability", MODE_COUPLING, *line] for line in words]), strict=True
    ):
        assert done.told(2, told).count("\n") == 1, arguments
        assert done.out == ""
    brakecli("stability", MODE_COUPLING, *FRICTION, "-o", "no/d.csv", cwd=here).told(74, "no/d.csv: cannot write")
    assert left_in(here) == before
