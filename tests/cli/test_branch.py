"""`brakecli branch`: its answers, its file, its pictures, and what it refuses."""

import subprocess
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr

import brakecli
from brakecli.errors import UsageError
from brakecli.results.field import Field, integer
from brakecli.results.read import open_result
from brakecli.results.stability_fields import MOTION
from brakecli.results.write import ResultFile, new_result
from brakecli.views.plots.result import draw
from brakecli.views.plots.style import BLUE, DARK, applied
from brakecli.views.render import TERMINAL
from brakecli.views.stability import of_branch
from brakecli.views.view import Table
from tests.analysis.shoes import Shoe
from tests.campaign import campaign
from tests.commands import ROOT, environment
from tests.commands import brakecli as command

pytestmark = pytest.mark.usefixtures("compiled")

FRICTION = ("--parameter", "friction.coefficient=0:1")


def answer_of(here: Path, *words: str) -> dict[str, Any]:
    """What a command says as JSON, once it has ended well."""
    done = command(*words, "--json", cwd=here)
    done.told(0)
    return done.json


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("branch")
    command("new", "branch", cwd=folder).told(0)
    return folder


@pytest.fixture(scope="module")
def found(here: Path) -> dict[str, Any]:
    return answer_of(here, "branch", "branch.toml", *FRICTION, "-o", "branch.h5")


def test_the_starter_can_vibrate_below_its_critical_friction(here: Path, found: dict[str, Any]) -> None:
    """Critical friction against the roots of Hurwitz' polynomial, and the fold below it."""
    shoe = Shoe.of(tomllib.loads((here / "branch.toml").read_text()))
    assert shoe.critical is not None
    assert found["critical"] == pytest.approx(shoe.critical, rel=1e-9)
    sliding, cycle = found["branches"]
    assert [branch["kind"] for branch in found["branches"]] == ["steady sliding", "limit cycle"]
    assert [mark["kind"] for mark in sliding["special"]] == ["end", "flutter", "end"]
    assert [mark["kind"] for mark in cycle["special"]] == ["flutter", "fold", "end"]
    fold = cycle["special"][1]
    assert found["coexists_from"] == fold["value"] < found["critical"]
    where = (
        f"from {fold['value']:.4g} on a vibration at {fold['frequency']:.4g} Hz can exist beside stable sliding"
    )
    assert where in found["sentence"]
    assert found["critical_windows_lower"] == [found["critical"]]
    assert found["critical_windows_upper"] == [1.0]


@campaign
def test_runs_that_start_on_either_side_of_the_barrier_end_apart(here: Path, found: dict[str, Any]) -> None:
    """A fifth of the push that the unstable cycle stands for dies out, and five times it lasts."""
    points = found["branches"][1]["points"]
    lasting = min((point for point in points if point["stable"]), key=lambda point: abs(point["value"] - 0.4))
    words = []
    for factor in (0.2, 5.0):
        push = factor * 2.0 * np.pi * 200.0 * found["barrier"]
        settings = (
            "--set",
            f"initial.vy={-push}",
            "--set",
            'initial.at="equilibrium"',
            "--set",
            "solver.duration=40.0",
        )
        words.append(answer_of(here, "run", "branch.toml", *settings, "-o", "r.h5", "--force"))
    assert words[0]["amplitude"] < 0.1 * found["barrier"]
    assert words[1]["amplitude"] == pytest.approx(lasting["amplitude"], rel=0.05)
    assert words[1]["frequency"] == pytest.approx(lasting["frequency"], rel=0.01)


def test_the_file_holds_what_json_says_and_opens_in_xarray(here: Path, found: dict[str, Any]) -> None:
    for number, branch in enumerate(found["branches"]):
        group = f"branch_{number}"
        with xr.open_dataset(here / "branch.h5", group=group, engine="h5netcdf") as data:
            assert data.attrs["kind"] == branch["kind"]
            for name in (*(field.name for field in MOTION), "stable"):
                assert data[name].values.tolist() == [point[name] for point in branch["points"]]
            first = [pair for pair in data["multipliers"].values[0].tolist() if not np.isnan(pair[0])]
            assert first == branch["points"][0]["multipliers"]
        with xr.open_dataset(here / "branch.h5", group=f"{group}/special", engine="h5netcdf") as data:
            assert data["kind"].values.tolist() == [mark["kind"] for mark in branch["special"]]
            assert data["value"].values.tolist() == [mark["value"] for mark in branch["special"]]
    tree = brakecli.load(here / "branch.h5")
    assert tree.attrs["kind"] == "branch"
    assert tree.attrs["coexists_from"] == found["coexists_from"]


@campaign
def test_steady_sliding_is_full_up_to_its_flutter_and_dashed_beyond(here: Path, found: dict[str, Any]) -> None:
    with open_result(here / "branch.h5") as stored, applied():
        upper, lower = draw(stored).axes
        of_part, _ = draw(stored, variable="stick_fraction").axes
    assert upper.get_ylabel() == "amplitude of x (µm)"
    assert of_part.get_ylabel() == "stick fraction"
    lines: list[Any] = [each for each in lower.get_lines() if each.get_color() == DARK]
    full, dashed = [each for each in lines if len(each.get_xdata()) > 1]
    assert (full.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    assert full.get_xdata()[-1] == dashed.get_xdata()[0] == found["critical"]
    assert dashed.get_xdata()[-1] == 1.0
    refused = command("plot", "branch.h5", "--variable", "none", cwd=here)
    refused.told(
        2, "--variable none: is no number of branches that is drawn; give one of x, y, vx, mean, amplitude"
    )


def test_the_neutral_motion_at_flutter_is_not_counted_as_unstable(found: dict[str, Any]) -> None:
    """A branch of cycles that are all stable, but for the linear vibration at flutter from which they are born."""
    cycle = found["branches"][1]
    flutter, *others = cycle["points"]
    assert not flutter["stable"]
    stable = [point for point in others if point["stable"]]
    for points in ([flutter, *stable], [*stable, flutter]):
        tables = of_branch({**found, "branches": [{**cycle, "points": points}]}, "", "1", TERMINAL).blocks
        (head,) = [each.title for each in tables if isinstance(each, Table)]
        assert f"{len(stable)} motions beside the one at flutter, {len(stable)} of them stable" in head


def test_the_legend_lies_beside_the_curves(here: Path, found: dict[str, Any]) -> None:
    for narrow in (False, True):
        with open_result(here / "branch.h5") as stored, applied(narrow):
            figure = draw(stored)
            figure.draw_without_rendering()
        box = figure.legends[0].get_window_extent()
        panels = [axes.get_tightbbox() for axes in figure.axes]
        assert not any(box.overlaps(panel) for panel in panels if panel)
        assert 0.0 <= box.x0 < box.x1 <= figure.bbox.x1


@pytest.mark.parametrize("variable", ["", "vx"])
def test_steady_sliding_stands_at_the_foot_of_a_logarithmic_axis(
    variable: str, here: Path, found: dict[str, Any]
) -> None:
    with open_result(here / "branch.h5") as stored, applied():
        figure = draw(stored, variable=variable)
    upper: Any = figure.axes[0]
    assert upper.get_yscale() == "log"
    low, _ = upper.get_ylim()
    lines = [each for each in upper.get_lines() if len(each.get_xdata()) > 1]
    sliding = [each.get_ydata() for each in lines if each.get_color() == DARK]
    others = np.concatenate([each.get_ydata() for each in lines if each.get_color() == BLUE])
    assert len(sliding) == 2  # stable, and beyond flutter
    assert len({height for each in sliding for height in each}) == 1
    assert low < sliding[0][0] < others.min()
    assert "steady sliding, amplitude 0" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_frequency_of_steady_sliding_does_not_jump_where_another_mode_decays_more_slowly(
    tmp_path: Path,
) -> None:
    """Of this pad the lower mode decays more slowly at first, and the upper one flutters.

    The modes come from the equations of the page on the model. The upper one comes down to the lower one.
    """
    command("new", "pad", cwd=tmp_path).told(0)
    answer = answer_of(tmp_path, "branch", "pad.toml", "--parameter", "friction.coefficient=0:1")
    sliding, cycle = answer["branches"]
    shoe = Shoe.of(tomllib.loads((tmp_path / "pad.toml").read_text()))
    frequencies = []
    for point in sliding["points"]:
        both = np.abs(replace(shoe, phi=point["value"]).modes.imag) / (2.0 * np.pi)
        assert np.abs(both - point["frequency"]).min() < 1e-6 * point["frequency"]
        frequencies.append(point["frequency"])
    (flutter,) = [mark for mark in sliding["special"] if mark["kind"] == "flutter"]
    first = replace(shoe, phi=0.0).modes
    least = abs(first[0].imag) / (2.0 * np.pi)  # the least stable one
    assert frequencies[0] > 1.1 * least
    assert frequencies[0] == pytest.approx(np.abs(first.imag).max() / (2.0 * np.pi))
    stable = [each["frequency"] for each in sliding["points"] if each["stable"]]
    assert (np.diff([*stable, flutter["frequency"]]) < 0.0).all()  # towards the other mode
    assert flutter["frequency"] == pytest.approx(cycle["special"][0]["frequency"], rel=1e-3)


def test_the_file_is_drawn_reported_exported_and_compared(here: Path, found: dict[str, Any]) -> None:
    command("plot", "branch.h5", "-o", "a.png", cwd=here).told(0)
    command("report", "branch.h5", "-o", "a.html", cwd=here).told(0)
    assert "can exist beside stable sliding" in (here / "a.html").read_text()
    command("export", "branch.h5", "-o", "a.csv", cwd=here).told(0)
    assert len((here / "a.csv").read_text().splitlines()) == 1 + len(found["branches"][1]["points"])
    command("export", "branch.h5", "-o", "b.csv", "--group", "branch_7", cwd=here).told(2, "branch_0, branch_1")
    same = command("diff", "branch.h5", "branch.h5", cwd=here)
    same.told(0)
    assert "No difference" in same.out
    shown = command("branch", "branch.toml", *FRICTION, cwd=here)
    shown.told(0)
    assert "limit cycle" in shown.out


def test_the_same_case_gives_the_same_bytes(here: Path, found: dict[str, Any]) -> None:
    command("branch", "branch.toml", *FRICTION, "-q", "-o", "again.h5", cwd=here).told(0)
    assert (here / "again.h5").read_bytes() == (here / "branch.h5").read_bytes()


def test_functions_take_a_number_of_pushes(here: Path) -> None:
    case = here / "branch.toml"
    along = cast(Any, {"friction.coefficient": (0.0, 1.0)})
    assert brakecli.branch(case, parameter=along, pushes=3).attrs["pushes"] == 15
    assert int(brakecli.stability(case, pushes=0).pushes) == 0
    wrong: Any
    for wrong in (-1, 2.5, True, "many", 10**9):
        with pytest.raises(UsageError, match="is no whole number from 0 to 100000"):
            brakecli.stability(case, pushes=wrong)
        with pytest.raises(UsageError, match="is no whole number from 0 to 100000"):
            brakecli.branch(case, parameter=along, pushes=wrong)


def test_a_run_of_another_case_is_said_to_be_one(here: Path, tmp_path: Path) -> None:
    """Keys that do not enter the equations of motion, and the one that is followed, may differ."""
    case = str(here / "branch.toml")
    own = tomllib.loads((here / "branch.toml").read_text())["link1"]["damping"]
    said = []
    for damping in (own, own + 1.5):
        settings = (f"link1.damping={damping}", "friction.coefficient=0.6", "solver.duration=0.01", 'title="it"')
        words = [word for each in settings for word in ("--set", each)]
        command("run", case, *words, "-q", "-o", "r.h5", "--force", cwd=tmp_path).told(0)
        answer = answer_of(tmp_path, "branch", case, *FRICTION, "--start", "r.h5", "--pushes", "0")
        said.append("another case" in answer["sentence"])
    assert said == [False, True]
    compared = f"link1.damping {own + 1.5:.6g}, not {own:.6g}"
    assert f"the motion given for 0.6 is one of another case ({compared});" in answer["sentence"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--parameter", "friction.coefficient=1:0"), "LOW below HIGH"),
        (("--parameter", "friction.coefficient=0:nan"), "LOW below HIGH"),
        (("--parameter", "friction.coeff=0:1"), "friction.coeff"),
        (("--parameter", "friction=0:1"), "a table, not a number (found 0.0); did you mean friction.coefficient?"),
        (("--parameter", "load=0:1"), "did you mean load.force?"),
        (("--parameter", "friction.coefficient,friction.coefficient=0:1"), "no key twice"),
        (("--parameter", "link2.angle_deg=0:95"), "link2.angle_deg"),
        (
            ("--parameter", "solver.step=1e-5:1e-4"),
            "solver.step: is no quantity of the shoe; follow e.g.",
        ),
        (("--parameter", "shoe.mass,initial.x=1:2"), "initial.x: is no quantity of the shoe"),
        (("--parameter", "title=0:1"), "title: is no quantity of the shoe"),
        (("--parameter", "friction.coefficient=0:1", "-o", "a.txt"), ".h5"),
    ],
)
def test_bad_input_is_told_in_a_sentence(here: Path, words: tuple[str, ...], said: str) -> None:
    command("branch", "branch.toml", *words, cwd=here).told(2, said)


def test_a_start_that_is_no_result_is_refused(here: Path) -> None:
    command("branch", "branch.toml", *FRICTION, "--start", "none.h5", cwd=here).told(4, "none.h5")


def test_on_a_standing_wheel_nothing_slides(here: Path) -> None:
    answer = answer_of(here, "branch", "branch.toml", *FRICTION, "--set", "wheel.angular_speed=0.0")
    assert "nothing slides steadily" in answer["sentence"]
    assert answer["critical"] is None


def test_without_dashpots_it_says_that_no_cycle_is_followed(here: Path) -> None:
    none = ("--set", "link1.damping=0.0", "--set", "link2.damping=0.0")
    answer = answer_of(here, "branch", "branch.toml", *FRICTION, *none)
    assert "no dashpot" in answer["sentence"]
    assert len(answer["branches"]) == 1


INTERRUPTED = """
import os, signal
from brakecli.analysis.branches import explore

begin = explore.Explorer.__init__

def interrupted(self, line, tell):
    begin(self, line, lambda what, done, total: os.kill(os.getpid(), signal.SIGINT) if done == 30 else None)

explore.Explorer.__init__ = interrupted
from brakecli.__main__ import main
main()
"""


@campaign
def test_an_interruption_leaves_a_whole_file_that_ends_in_budget(here: Path) -> None:
    """The signal comes at the thirtieth motion."""
    words = [sys.executable, "-c", INTERRUPTED, "branch", "branch.toml", *FRICTION, "-o", "cut.h5", "-q"]
    done = subprocess.run(words, cwd=here, env=environment(), capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "brakecli: interrupted; what was followed up to here is in cut.h5\n"
    tree = brakecli.load(here / "cut.h5")
    assert tree["branch_1/special/kind"].values.tolist()[-1] == "budget"
    assert 10 < tree["branch_1"].sizes["point"] < 31


LOOKING = """
import os, signal
from brakecli.analysis.branches import sliding

look = sliding.Sliding._at

def interrupted(self, p):
    os.write(2, b".")
    os.kill(os.getpid(), signal.SIGTERM)
    return look(self, p)

sliding.Sliding._at = interrupted
from brakecli.__main__ import main
main()
"""


def test_before_there_is_anything_to_keep_a_signal_ends_the_work_at_once(tmp_path: Path) -> None:
    """At the first of the 65 places at which steady sliding is looked at: with many waves each takes long."""
    case = str(ROOT / "cases" / "rough-partly-open.toml")
    words = [sys.executable, "-c", LOOKING, "branch", case, *FRICTION, "-o", "cut.h5", "-q"]
    done = subprocess.run(words, cwd=tmp_path, env=environment(), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (143, ".brakecli: terminated\n")
    assert not [*tmp_path.iterdir()]


BEGINNING = """
import os, signal, threading
from brakecli.analysis.branches import forced

grow = forced.Forced.grow

def interrupted(*arguments):
    os.kill(os.getpid(), signal.SIGTERM)
    timer = threading.Timer(20.0, os._exit, [9])
    timer.daemon = True
    timer.start()
    return grow(*arguments)

forced.Forced.grow = interrupted
from brakecli.__main__ import main
main()
"""


@campaign
def test_an_interruption_ends_the_search_for_a_first_motion(tmp_path: Path) -> None:
    """As the waves of a rough wheel grow to find it, which takes half a minute here."""
    case = str(ROOT / "cases" / "rough-partly-open.toml")
    words = [sys.executable, "-c", BEGINNING, "branch", case, *FRICTION, "-o", "cut.h5", "-q"]
    done = subprocess.run(words, cwd=tmp_path, env=environment(), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (
        143,
        "brakecli: terminated; what was followed up to here is in cut.h5\n",
    )
    assert "branch_0" in brakecli.load(tmp_path / "cut.h5")


def test_a_shoe_that_locks_is_said_to_lock(here: Path) -> None:
    """Divergence where the determinant cxx (cyy + K) - (cxy + φ K) cxy vanishes; a short range has no flutter."""
    tables = tomllib.loads((here / "branch.toml").read_text())
    tables["wheel"]["angular_speed"] *= -1.0
    c = Shoe.of(tables).c
    k = Shoe.of(tables).k
    locks = abs((c[0, 0] * (c[1, 1] + k) - c[0, 1] ** 2) / (k * c[0, 1]))
    words = ("--parameter", f"friction.coefficient=0:{1.2 * locks}")
    side = "-0.025" if c[0, 1] < 0.0 else "0.025"
    answer = answer_of(
        here, "branch", "branch.toml", *words, "--pushes", "0", "--set", f"wheel.angular_speed={side}"
    )
    assert answer["critical"] == pytest.approx(locks, rel=1e-9)
    assert answer["sentence"].startswith(f"locks from {locks:.4g} on")
    assert [mark["kind"] for mark in answer["branches"][0]["special"]].count("divergence") == 1


def _write_branch(result: ResultFile, group: str, kind: str, folds: Sequence[float] = ()) -> None:
    """A branch of two motions, with some folds."""
    result.axis(group, integer("point", "number"), range(2))
    result.set_attributes({"kind": kind}, group)
    for name in ("value", "amplitude", "frequency", "stable"):
        result.column(Field(name, "1", name), ("point",), [0.0, 1.0], group)
    inner = f"{group}/special"
    result.axis(inner, integer("special", "number"), range(len(folds)))
    for name in ("value", "amplitude", "frequency"):
        result.column(Field(name, "1", name), ("special",), folds, inner)
    result.column(Field("kind", "", "kind", "S16"), ("special",), ["fold"] * len(folds), inner)


def test_numbers_that_an_older_file_lacks_are_named_with_the_remedy(
    here: Path, found: dict[str, Any], tmp_path: Path
) -> None:
    older = tmp_path / "older.h5"
    with new_result(older, force=False) as result:
        result.set_attributes({"kind": "branch", "parameter": "friction.coefficient"})
        _write_branch(result, "branch_0", "steady sliding")
        result.commit()
    command("plot", "older.h5", "-o", "a.png", cwd=tmp_path).told(0)
    command("plot", "older.h5", "-o", "b.png", "--variable", "mean", cwd=tmp_path).told(
        2, "its branches have no mean_x, which older versions did not compute; follow them again"
    )
