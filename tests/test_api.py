"""The functions of `import brakecli`: what they return is what the commands write and print."""

import inspect
import json
import math
import multiprocessing
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import typer
import xarray as xr

import brakecli
from brakecli.api import progress
from brakecli.api.progress import telling
from brakecli.api.records import Report
from brakecli.cli.app import app
from brakecli.errors import BrakecliError, CaseError, UnreadableResultError, UsageError
from brakecli.views.view import sentence
from tests.campaign import campaign
from tests.commands import QUICK, ROOT, TINY, attributes, left_in
from tests.commands import brakecli as command

HERE = Path()
CASE = str(ROOT / "cases" / "relaxation.toml")
SHORT = {"solver.duration": 0.2, "output.sample_interval": 5e-5}
SET = ("--set", "solver.duration=0.2", "--set", "output.sample_interval=5e-5")


def test_importing_takes_nothing_large() -> None:
    large = "{'numpy', 'xarray', 'numba', 'pydantic', 'typer'}"
    code = f"import sys, brakecli, brakecli.api; print({large} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
    tables = {"branch", "load", "run", "scatter", "stability", "sweep", "classify"}
    assert {*brakecli.__all__} == tables | {"advise", "diff", "plot", "report"}
    with pytest.raises(AttributeError, match="has no attribute 'ran'"):
        _ = brakecli.ran


def test_a_run_is_that_of_the_command(tmp_path: Path) -> None:
    printed = command("run", CASE, *SET, "-o", "r.h5", "--json", cwd=tmp_path).json
    tree = brakecli.run(CASE, SHORT)
    with xr.open_datatree(tmp_path / "r.h5", engine="h5netcdf") as stored:
        assert tree.identical(stored.load())
    assert (tree.attrs["regime"], tree.attrs["frequency"]) == (printed["regime"], printed["frequency"])
    assert tree["history"].vx.attrs["units"] == "m/s"
    assert brakecli.load(tmp_path / "r.h5").identical(tree)
    assert brakecli.run(tmp_path / "r.h5").attrs["resolved_toml"] == tree.attrs["resolved_toml"]
    verdict = brakecli.classify(tmp_path / "r.h5", thresholds={"stick_cycles": 0.9})
    assert verdict.regime == printed["regime"]
    assert float(verdict.frequency) == printed["frequency"]
    assert json.loads(verdict.attrs["thresholds"])["stick_cycles"] == 0.9
    verdict.to_netcdf(tmp_path / "v.nc", engine="h5netcdf")


def test_numbers_of_a_verdict_that_do_not_exist_are_nan_and_in_no_file(tmp_path: Path) -> None:
    found = brakecli.run(CASE, SHORT | {"friction.coefficient": 0.3})
    assert found.attrs["regime"] == "damped"
    assert np.isnan(found.attrs["frequency"])
    found.brakecli.table()
    again = brakecli.run(CASE, SHORT | {"friction.coefficient": 0.3}, output=tmp_path / "r.h5")
    assert "frequency" not in attributes(tmp_path / "r.h5")
    assert found.identical(again)
    assert brakecli.diff(found, tmp_path / "r.h5").numbers == []


def test_outputs_stay_only_where_they_are_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    brakecli.run(CASE, SHORT)
    assert not [*tmp_path.iterdir()]
    brakecli.run(CASE, SHORT, output="kept.h5")
    with pytest.raises(UsageError, match="exists"):
        brakecli.run(CASE, SHORT, output="kept.h5")
    brakecli.run(CASE, SHORT, output="kept.h5", force=True)
    assert [each.name for each in tmp_path.iterdir()] == ["kept.h5"]


def test_stability_is_that_of_the_command() -> None:
    printed = command("stability", CASE, "--set", "friction.coefficient=0.4", "--json", cwd=HERE).json
    found = brakecli.stability(CASE, {"friction": {"coefficient": np.float64(0.4)}})
    del printed["command"]
    assert {*printed} == {*found.data_vars, *found.attrs}
    for name, value in printed.items():
        if name in found.attrs:
            held = found.attrs[name]
            assert (json.loads(held) if isinstance(held, str) else held) == value
        elif value is None:
            assert found[name].item() == "" or math.isnan(found[name].item())
        else:
            assert found[name].item() == value
    assert found.critical_frequency.attrs["units"] == "Hz"


def test_what_one_function_returns_the_next_takes() -> None:
    found = brakecli.stability(CASE)
    less = brakecli.run(CASE, {**SHORT, "friction.coefficient": 0.5 * found.critical_friction})
    assert less.attrs["regime"] == "damped"
    assert brakecli.run(less)["history"].to_dataset().identical(less["history"].to_dataset())


def test_a_sweep_is_that_of_its_file(tmp_path: Path) -> None:
    critical = {"parameter": "friction.coefficient", "lower": 0.0, "upper": 3.0, "method": "eigenvalue"}
    file = tmp_path / "angles.toml"
    given = "\n".join(f"{key} = {json.dumps(value)}" for key, value in critical.items())
    axis = '[[axis]]\nparameter = "link2.angle_deg"\nvalues = [5.0, 10.0, 20.0]\n'
    file.write_text(f"case = {json.dumps(CASE)}\n{axis}[critical]\n{given}\n")
    of_file = brakecli.sweep(file, jobs=1)
    found = brakecli.sweep(CASE, axes={"link2.angle_deg": np.array([5.0, 10, 20])}, critical=critical, jobs=1)
    assert found.critical.identical(of_file.critical)
    again = brakecli.sweep(brakecli.load(file), jobs=1)
    xr.testing.assert_identical(again, of_file)
    exact = [brakecli.stability(CASE, {"link2.angle_deg": angle}).critical_friction for angle in (5.0, 10.0, 20.0)]
    np.testing.assert_allclose(found.critical, exact, rtol=1e-9)


def test_whole_numbers_along_an_axis_stay_whole_where_their_key_is(tmp_path: Path) -> None:
    (tmp_path / "t.toml").write_text(TINY)
    seeds = [2**60 + 1, 2**60 + 3]
    spectrum = {"rms": 1e-7, "hurst": 0.8, "shortest": 0.01, "longest": 0.07, "terms": 5}
    axes: dict[str | tuple[str, ...], Any] = {"roughness.wheel.spectrum.seed": seeds, "shoe.mass": [9, 10]}
    found = brakecli.sweep(tmp_path / "t.toml", {"roughness.wheel": {"spectrum": spectrum}}, axes=axes, jobs=1)
    assert found.roughness_wheel_spectrum_seed.values.tolist() == seeds
    assert (found.roughness_wheel_spectrum_seed.dtype.kind, found.shoe_mass.dtype.kind) == ("i", "f")


def test_errors_are_those_of_the_commands(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"friction\.coefficient: is out of range"):
        brakecli.run(CASE, {"friction.coefficient": -1})
    with pytest.raises(CaseError, match=r"link2\.stiffness: is missing"):
        brakecli.run(CASE, {"link2": {"angle_deg": 5}})
    with pytest.raises(CaseError, match="link3: is unknown"):
        brakecli.sweep(CASE, axes={"link3.angle_deg": [1.0]})
    with pytest.raises(CaseError, match="cannot be read"):
        brakecli.load(tmp_path / "none.toml")
    (tmp_path / "broken.h5").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(UnreadableResultError):
        brakecli.load(tmp_path / "broken.h5")
    with pytest.raises(UsageError, match="no settings"):
        brakecli.load(tmp_path / "broken.h5", SHORT)
    with pytest.raises(UsageError, match="noise: is not known"):
        brakecli.classify(CASE, "noise")
    for jobs in (0, -1, 1.5, "2"):
        with pytest.raises(UsageError, match="is no number of workers"):
            brakecli.sweep(CASE, axes={"shoe.mass": [1.0]}, jobs=jobs)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"shoe\.mass: cannot be set to NoneType"):
        brakecli.run(CASE, {"shoe.mass": None})
    with pytest.raises(UsageError, match="settings: is no mapping"):
        brakecli.run(CASE, 5)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="axes: is no mapping"):
        brakecli.sweep(CASE, axes=1.5)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="vary: is no mapping"):
        brakecli.stability(CASE, vary=5)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="thresholds: is no mapping"):
        brakecli.classify(CASE, thresholds=5)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"vary\.values: cannot be set to Fraction"):
        brakecli.stability(CASE, vary={"shoe.mass": [Fraction(1, 3)]})  # type: ignore[list-item]
    with pytest.raises(UsageError, match=r"sweep\.critical\.lower: cannot be set to NoneType"):
        brakecli.sweep(CASE, critical={"lower": None})
    for given in ("sample_rate", "stiffness"):
        with pytest.raises(UsageError, match=f"{given} 1000: is not a number"):
            brakecli.classify(CASE, "force", **{given: "1000"})  # type: ignore[arg-type]
    for given in ("sample_rate", "stiffness", "belt_speed"):
        for huge in (10**400, -(10**5000)):
            with pytest.raises(UsageError, match=f"^{given}: is too large for a number"):
                brakecli.classify(CASE, "force", **{given: huge})  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"output: is no path \(found 5\)"):
        brakecli.run(CASE, SHORT, output=5)  # type: ignore[arg-type]
    (tmp_path / "own.toml").write_text(TINY)
    with pytest.raises(UsageError, match="is no result, and is not replaced by one"):
        brakecli.run(tmp_path / "own.toml", output=tmp_path / "own.toml", force=True)
    assert (tmp_path / "own.toml").read_text() == TINY
    endless: list[Any] = []
    endless.append(endless)
    for deep in (endless, {"parameter": endless}):
        with pytest.raises(UsageError, match="a value lies too deep in others, or in itself"):
            brakecli.run(CASE, {"shoe.mass": deep})
        with pytest.raises(UsageError, match="a value lies too deep in others, or in itself"):
            brakecli.sweep(CASE, critical={"parameter": deep})
    for name in ({1}, b"shoe.mass"):
        with pytest.raises(CaseError, match=r"critical\.parameter"):
            brakecli.sweep(CASE, critical={"parameter": name, "lower": 0, "upper": 1})
    with pytest.raises(UsageError, match="rise or fall"):
        brakecli.stability(CASE, vary={"shoe.mass": [1.0, 3.0, 2.0]})
    with pytest.raises(UsageError, match="only for a measured signal"):
        brakecli.classify(tmp_path / "broken.h5", belt_speed=3.0)
    with pytest.raises(TypeError, match="unexpected keyword argument 'columns'"):
        brakecli.classify(tmp_path / "broken.h5", columns=3)  # type: ignore[call-arg]
    with pytest.raises(UsageError, match="is no case"):
        brakecli.run(3)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="no threshold few"):
        brakecli.classify(tmp_path / "broken.h5", thresholds={"few": 1})


SAID = [
    (lambda: brakecli.run("none.toml"), "no such file or directory; name a TOML file$"),
    (lambda: brakecli.load("a\x1b[31m\nb.toml"), r"^a\\u001b\[31m\\nb\.toml: cannot be read: no such file"),
    (lambda: brakecli.load("none.toml"), "no such file or directory; name a TOML file$"),
    (lambda: brakecli.run(CASE, {"shoe.mas": 3}), r"^setting shoe\.mas=3: shoe\.mas: is unknown"),
    (lambda: brakecli.run(CASE, {"wheel.times": [1.0, -math.inf]}), r"^setting wheel\.times=\[1\.0, -inf\]: "),
    (
        lambda: brakecli.run(CASE, SHORT, output="kept"),
        "replace it with force=True, or choose another output with output$",
    ),
    (lambda: brakecli.classify("kept", "velocity"), "give sample_rate HZ or time_column NAME$"),
    (lambda: brakecli.classify("kept", belt_speed=3.0), "^belt_speed: is only .* state with quantity what was"),
    (lambda: brakecli.classify("kept.h5", thresholds={"few": 1}), "^thresholds few=1: there is no threshold few"),
    (lambda: brakecli.sweep(CASE), "simulate it with: brakecli.run$"),
]


@pytest.mark.parametrize("name", ["my case.toml", "it's.toml", "a  b's c.toml"])
def test_errors_name_functions_whatever_the_path_is(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(TINY)
    with pytest.raises(UsageError, match=r"simulate it with: brakecli\.run$"):
        brakecli.sweep(tmp_path / name)


@pytest.mark.parametrize(("call", "words"), SAID)
def test_errors_name_arguments_and_no_options(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Any, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("kept", "kept.h5"):
        (tmp_path / name).write_text("1,2\n3,4\n5,6\n7,8\n")
    with pytest.raises(BrakecliError, match=words) as caught:
        call()
    assert "--" not in str(caught.value)


def test_a_run_that_fails_raises_and_keeps_its_history(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    with (
        pytest.warns(UserWarning, match=r"load\.force: 1e\+25 N is more than 1e\+06 N"),
        pytest.warns(UserWarning, match=r"contact\.stiffness: a pad pressed in by .* half lengths is more than"),
        pytest.warns(UserWarning, match="not resolved"),
        pytest.raises(BrakecliError, match="grew beyond all bounds"),
    ):
        brakecli.run(tmp_path / "tiny.toml", {"load.force": 1e25}, output=tmp_path / "r.h5")
    assert brakecli.load(tmp_path / "r.h5").attrs["status"] == "failed"


def test_other_threads_compute_as_well() -> None:
    found = list[Any]()
    thread = threading.Thread(target=lambda: found.append(brakecli.run(CASE, SHORT)))
    thread.start()
    thread.join()
    assert found[0].identical(brakecli.run(CASE, SHORT))


def test_an_interrupted_run_ends_soon_and_the_next_one_is_whole() -> None:
    before = brakecli.run(CASE, SHORT)
    main = threading.get_ident()
    timer = threading.Timer(1.0, lambda: signal.pthread_kill(main, signal.SIGINT))
    timer.start()
    start = time.process_time()
    with pytest.raises(KeyboardInterrupt):
        brakecli.run(CASE, {"solver.duration": 500.0, "output.sample_interval": 0.1})  # half a minute
    assert time.process_time() - start < 1.0 + QUICK  # less where the machine is busy
    timer.join()
    assert brakecli.run(CASE, SHORT).identical(before)


def test_advice_is_that_of_the_command(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(STUDY)
    lines = ["advise", CASE, "--keys", "link2.*,shoe.mass", "--margin", "0.3", "--scatter", "s.toml", "--json"]
    printed = command(*lines, cwd=tmp_path).json
    given = {"keys": ["link2.*", "shoe.mass"], "margin": 0.3, "scatter": tmp_path / "s.toml"}
    with pytest.warns(UserWarning, match="the case has 0.7, but the study scatters it between"):
        found = brakecli.advise(CASE, **given)  # type: ignore[arg-type]
    numbers = found.numbers()
    del printed["command"], printed["check"]["seconds"], numbers["check"]["seconds"]
    assert numbers == printed
    best = found.advice[0]
    assert (best.parameter, best.to) == (printed["advice"][0]["parameter"], printed["advice"][0]["to"])
    assert best.to is not None
    assert best.squeal is not None
    margin = brakecli.stability(CASE, {best.parameter: best.to}).critical_friction / found.stability.friction - 1.0
    assert abs(margin - 0.3) < 1e-9
    assert sentence(found.conclusion) in " ".join(repr(found).split())
    assert f"{found.conclusion}" == found.conclusion() == numbers["conclusion"]
    assert brakecli.advise(CASE, keys="shoe.mass").advice[0].parameter == "shoe.mass"


STUDY = f"""\
case = {json.dumps(CASE)}
samples = 64
[[parameter]]
key = "friction.coefficient"
distribution = "uniform"
low = 0.5
high = 0.6
"""


@campaign
def test_results_in_memory_are_drawn_compared_and_reported_like_their_files(tmp_path: Path) -> None:
    folder = tmp_path / "files"
    folder.mkdir()
    a = brakecli.run(CASE, SHORT, output=folder / "a.h5")
    b = brakecli.run(CASE, {**SHORT, "friction.coefficient": 0.72}, output=folder / "b.h5")
    for name, result in (("own", a), ("a", folder / "a.h5")):
        brakecli.plot(result, output=tmp_path / f"{name}.png", variable="x")
    assert (tmp_path / "own.png").read_bytes() == (tmp_path / "a.png").read_bytes()
    printed = command("diff", "a.h5", "b.h5", "-o", "two.png", "--json", cwd=folder).json
    (tmp_path / "two.png").write_bytes(b"")
    drawn = brakecli.diff(a, b, output=tmp_path / "two.png", force=True)
    for found in (drawn, brakecli.diff(folder / "a.h5", b)):
        assert not found.same
        assert found.case == printed["case"]
        assert found.variables == printed["variables"]
        assert found.numbers == printed["numbers"]
    assert (tmp_path / "two.png").read_bytes() == (folder / "two.png").read_bytes()
    assert "friction.coefficient" in repr(found)
    assert brakecli.diff(folder / "a.h5", a).same
    command("stability", CASE, "--vary", "friction.coefficient=0:1:5", "-o", "result.h5", cwd=folder).told(0)
    modes = brakecli.stability(CASE, vary={"friction.coefficient": np.linspace(0.0, 1.0, 5)})
    page = brakecli.report(folder / "result.h5")
    assert brakecli.report(modes, output=tmp_path / "page.html") == page
    assert (tmp_path / "page.html").read_text() == page


def test_objects_of_a_result_are_records() -> None:
    found = brakecli.stability(CASE)
    shown = found.brakecli
    plain = json.loads(found.attrs["modes"])
    assert [vars(mode) for mode in shown.modes] == plain
    assert [(each.friction, each.lost) for each in shown.crossings] == [(float(found.critical_friction), True)]
    assert shown.equilibrium.stiffness == float(found.contact_stiffness)
    assert shown.discrete.step_limit is None
    standing = brakecli.stability(CASE, {"load.force": -100.0}).brakecli
    assert (standing.equilibrium, standing.discrete) == (None, None)
    assert shown.reasons == ()


@campaign
def test_vibrations_while_the_wheel_stops_are_records(tmp_path: Path) -> None:
    stop = {"wheel": {"radius": 0.5, "times": [0.0, 0.4], "angular_speeds": [0.2, 0.02]}}
    settings = {**stop, "solver": {"tolerance": 1e-3, "duration": 0.4}}
    tree = brakecli.run(CASE, settings, output=tmp_path / "r.h5")
    printed = command("classify", "r.h5", "--json", cwd=tmp_path).json["vibrations"]
    assert len(printed) > 0
    for found in (tree, brakecli.classify(tree)):
        assert [vars(each) for each in found.brakecli.vibrations] == printed


@campaign
def test_a_notebook_shows_the_table_and_the_picture(tmp_path: Path) -> None:
    tree = brakecli.run(CASE, SHORT, output=tmp_path / "r.h5")
    shown = tree.brakecli
    table = command("classify", "r.h5", cwd=tmp_path).out.split()
    assert repr(shown).split()[-20:] == [each for each in repr(shown).split()[-20:] if each in table]
    assert shown.reasons[0].split(":")[0] in " ".join(repr(shown).split())
    page = shown._repr_html_()
    assert page.startswith("<pre>")
    assert 'src="data:image/png;base64,' in page
    command("plot", "r.h5", "-o", "r.png", cwd=tmp_path).told(0)
    assert shown._repr_png_() == (tmp_path / "r.png").read_bytes()
    assert brakecli.plot(tree)._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    numbers = brakecli.stability(CASE)
    assert numbers.brakecli._repr_png_() is None
    assert "critical friction" in numbers.brakecli._repr_html_()
    assert repr(brakecli.load(tmp_path / "r.h5").brakecli) == repr(shown)


def test_tables_say_what_results_of_other_kinds_answer() -> None:
    branches = brakecli.branch(CASE, parameter={"friction.coefficient": (0.0, 1.0)})
    assert sentence(branches.attrs["sentence"]) in " ".join(repr(branches.brakecli).split())
    assert "steady sliding, " in repr(branches.brakecli)
    grid = brakecli.sweep(CASE, SHORT, axes={"friction.coefficient": [0.1, 0.2]}, jobs=1)
    assert "It vibrates at 0 of 2 points: damped at 2. points 2 failed points 0" in " ".join(
        repr(grid.brakecli).split()
    )
    modes = brakecli.stability(CASE, vary={"friction.coefficient": [0.1, 0.9]})
    assert f"{modes.attrs['critical_values']:.4g}" in repr(modes.brakecli)


def test_a_motion_is_followed_along_an_axis_as_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TINY)
    axis = '[[axis]]\nparameter = "friction.coefficient"\nvalues = [0.4, 0.5]\ndirection = "both"\n'
    (tmp_path / "s.toml").write_text(f'case = "c.toml"\n{axis}[[axis]]\nparameter = "shoe.mass"\nvalues = [9.0]\n')
    of_file = brakecli.sweep(tmp_path / "s.toml", jobs=1)
    axes: dict[Any, Any] = {"friction.coefficient": [0.4, 0.5], "shoe.mass": [9.0]}
    found = brakecli.sweep(
        tmp_path / "c.toml", axes=axes, direction={"friction.coefficient": "both"}, jobs=1, progress=False
    )
    assert found.sizes == {"direction": 2, "friction_coefficient": 2, "shoe_mass": 1}
    assert {*found.data_vars} == {*of_file.data_vars}
    for name in found.data_vars:
        assert found[name].identical(of_file[name]), name
    alone = brakecli.sweep(
        tmp_path / "c.toml", axes={"friction.coefficient": [0.4, 0.5]}, direction="down", jobs=1
    )
    np.testing.assert_array_equal(alone.friction_coefficient, [0.4, 0.5])
    for wrong, words in (("both", "direction: is no mapping"), ({"shoe.mas": "up"}, "not among the axes")):
        with pytest.raises(UsageError, match=words):
            brakecli.sweep(tmp_path / "c.toml", axes=axes, direction=wrong, jobs=1)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="direction: is for axes"):
        brakecli.sweep(tmp_path / "s.toml", direction="up", jobs=1)
    with pytest.raises(UsageError, match="settings: come too late"):
        brakecli.sweep(brakecli.load(tmp_path / "s.toml"), {"shoe.mass": 8.0}, jobs=1)


def test_progress_goes_to_a_function_and_to_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "c.toml").write_text(TINY)
    told = list[tuple[str, int, int]]()
    axes: dict[Any, Any] = {"friction.coefficient": [0.4, 0.5, 0.6]}
    brakecli.sweep(tmp_path / "c.toml", axes=axes, jobs=1, progress=lambda *each: told.append(each))
    assert (told[0], told[-1]) == (("points", 0, 3), ("points", 3, 3))
    with telling(quiet=False, first_line=0.0) as tell:
        tell("points", 1, 3)
    assert capsys.readouterr().err == "brakecli: points 1 of 3, 0 s\n"
    with pytest.raises(ValueError, match="not in list"):
        brakecli.run(
            CASE, {"solver.duration": 20.0}, output=tmp_path / "r.h5", progress=lambda *_: told.remove(("", 0, 0))
        )
    assert not (tmp_path / "r.h5").exists()


def test_what_a_line_has_counted_is_told_to_its_end(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """At 25 s a line is due, the next one at 50 s; a short count within that time is not told."""
    times = iter([0.0, 25.0, 30.0, 31.0, 31.0, 32.0, 33.0])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(times)))
    with telling(quiet=False) as tell:
        for done, total in ((1, 9), (8, 9), (9, 9), (9, 9), (1, 2), (2, 2)):
            tell("points", done, total)
    told = ["brakecli: points 1 of 9, 25 s", "brakecli: points 9 of 9, 31 s"]
    assert capsys.readouterr().err.splitlines() == told


ALONG: dict[Any, Any] = {"friction.coefficient": (0.1, 0.9)}
FEW = STUDY.replace("samples = 64", 'samples = 8\nindices_of = "none"')
TELLING: dict[str, Callable[[Any], Any]] = {
    "run": lambda tell: brakecli.run("c.toml", progress=tell),
    "settled": lambda tell: brakecli.run(CASE, {"solver": {"duration": "settled"}}, progress=tell),
    "stability": lambda tell: brakecli.stability(CASE, progress=tell),
    "vary": lambda tell: brakecli.stability("c.toml", vary={"friction.coefficient": [0.1, 0.9]}, progress=tell),
    "branch": lambda tell: brakecli.branch(CASE, parameter=ALONG, progress=tell),
    "advise": lambda tell: brakecli.advise("c.toml", progress=tell),
    "sweep": lambda tell: brakecli.sweep("c.toml", axes=ALONG, jobs=1, progress=tell),
    "scatter": lambda tell: brakecli.scatter("few.toml", jobs=1, progress=tell),
    "report": lambda tell: brakecli.report("sweep.h5", progress=tell),
}


@pytest.mark.parametrize("function", TELLING)
def test_what_a_function_that_is_told_the_progress_raises_comes_out_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, function: str
) -> None:
    """Also kinds of exceptions that the code on the way handles."""
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_text(TINY)
    Path("few.toml").write_text(FEW)
    if function == "report":
        brakecli.sweep("c.toml", axes=ALONG, jobs=1, output="sweep.h5")
    left = left_in(tmp_path)
    kinds = OverflowError, KeyboardInterrupt, CaseError, TimeoutError, np.linalg.LinAlgError
    for error in (kind([]) for kind in kinds):

        def tell(what: str, done: int, total: int, error: BaseException = error) -> None:
            raise error

        with pytest.raises(type(error)) as raised:
            TELLING[function](tell)
        assert raised.value is error
    assert left_in(tmp_path) == left


HUGE = 10**5000
FOREIGN: dict[str, tuple[str, Callable[[], Any]]] = {
    "keys of advice": ("keys: are no key paths (found 5)", lambda: brakecli.advise(CASE, keys=cast(Any, 5))),
    "a key of advice": ("keys: are no key paths", lambda: brakecli.advise(CASE, keys=cast(Any, [HUGE]))),
    "a margin": ("margin: is no number from 0 to 10", lambda: brakecli.advise(CASE, margin=HUGE)),
    "a key": ("settings: a key is no text (found 5)", lambda: brakecli.stability(CASE, cast(Any, {5: 0.1}))),
    "an inner key": ("shoe: a key is no text", lambda: brakecli.run(CASE, {"shoe": {5: 0.1}})),
    "a value": ("shoe.mass: is too large for a number", lambda: brakecli.run(CASE, {"shoe.mass": HUGE})),
    "a variable": ("variable: is no text (found a table)", lambda: brakecli.plot(CASE, variable=cast(Any, {}))),
    "a section": ("section: is no text", lambda: brakecli.plot(CASE, section=cast(Any, {}))),
    "a compared variable": (
        "variable: is no text",
        lambda: brakecli.diff("r.h5", "r.h5", output="x.png", variable=cast(Any, {})),
    ),
    "a selection": ("select: a key is no text", lambda: brakecli.plot("r.h5", select=cast(Any, {5: 1}))),
    "a chosen value": ("select: x: is too large", lambda: brakecli.plot("r.h5", select={"x": HUGE})),
    "keys of a branch": (
        'parameter: a key is no text (found ["a", 3])',
        lambda: brakecli.branch(CASE, parameter=cast(Any, {("a", 3): (0, 1)})),
    ),
    "an end of a branch": (
        "parameter: is not both ends of a range",
        lambda: brakecli.branch(CASE, parameter={"shoe.mass": (0, HUGE)}),
    ),
    "jobs": ("jobs: is no number of workers", lambda: brakecli.sweep(CASE, axes=ALONG, jobs=HUGE)),
    "a key of an axis": ("axes: a key is no text", lambda: brakecli.sweep(CASE, axes=cast(Any, {5: [1]}))),
    "a value of an axis": ("sweep.axis.values: is too large", lambda: brakecli.sweep(CASE, axes={"x": [HUGE]})),
    "a text of an axis": ("sweep.axis.values: is not UTF-8", lambda: brakecli.sweep(CASE, axes={"x": ["\udcff"]})),
    "a followed key": (
        "direction: a key is no text",
        lambda: brakecli.sweep(CASE, axes=ALONG, direction=cast(Any, {5: "up"})),
    ),
    "a column": ("points: a key is no text", lambda: brakecli.sweep(CASE, points=cast(Any, {5: [1]}))),
    "a point": ("points.x: is too large", lambda: brakecli.sweep(CASE, points={"x": [HUGE]})),
    "a search": ("critical: a key is no text", lambda: brakecli.sweep(CASE, critical=cast(Any, {5: 1}))),
    "a scheduler": ("scheduler: is none", lambda: brakecli.sweep(CASE, axes=ALONG, scheduler=HUGE)),
    "a varied key": ("vary: a key is no text", lambda: brakecli.stability(CASE, vary=cast(Any, {5: [1, 2]}))),
    "a varied value": ("vary.values: is too large", lambda: brakecli.stability(CASE, vary={"x": [1, HUGE]})),
    "samples": ("samples: is too large for a number", lambda: brakecli.scatter("s.toml", {"samples": HUGE})),
    "a study": ("int: is no path", lambda: brakecli.scatter(cast(Any, HUGE))),
    "a file": ("int: is no path", lambda: brakecli.load(cast(Any, HUGE))),
    "an output": ("output: is no path", lambda: brakecli.run(CASE, SHORT, output=cast(Any, HUGE))),
    "a threshold": (
        "thresholds: a key is no text",
        lambda: brakecli.classify("r.h5", thresholds=cast(Any, {5: 1})),
    ),
    "its value": ("thresholds: few: is too large", lambda: brakecli.classify("r.h5", thresholds={"few": HUGE})),
    "a quantity": ("quantity: is no text", lambda: brakecli.classify("r.csv", cast(Any, {}))),
    "a column of a file": (
        "column: is too large",
        lambda: brakecli.classify("r.csv", "force", column=HUGE, sample_rate=1.0),
    ),
}


@pytest.mark.parametrize("given", FOREIGN)
def test_what_no_function_takes_is_an_error_of_usage(given: str) -> None:
    said, call = FOREIGN[given]
    with pytest.raises(UsageError) as refused:
        call()
    assert str(refused.value).startswith(said)
    assert "; " in str(refused.value)


def _swept(case: str, jobs: int) -> list[float]:
    found = brakecli.sweep(case, axes=ALONG, jobs=jobs)
    return [float(each) for each in found.amplitude]


@campaign
def test_a_worker_of_a_pool_computes_a_sweep_itself(tmp_path: Path) -> None:
    """It may start no processes."""
    (tmp_path / "c.toml").write_text(TINY)
    case = str(tmp_path / "c.toml")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_swept, (case, 2)) == _swept(case, 1)


@campaign
def test_a_profile_may_be_an_array(tmp_path: Path) -> None:
    places = np.linspace(0.0, np.pi, 180, endpoint=False)  # m; a turn of a wheel of 0.5 m
    heights = 1e-6 * np.sin(2.0 * places) + 3e-7 * np.sin(6.0 * places)
    np.savetxt(tmp_path / "runout.csv", np.transpose([places, heights]), delimiter=",")
    (tmp_path / "c.toml").write_text(TINY)
    of_file = brakecli.run(tmp_path / "c.toml", {"roughness.wheel.profile": str(tmp_path / "runout.csv")})
    columns = np.column_stack([places, heights])
    given: list[Any] = [
        {"roughness.wheel.profile": columns},
        {"roughness.wheel": {"profile": columns.tolist()}},
        {"roughness": {"wheel": {"profile": xr.DataArray(columns[::-1])}}},
    ]
    for settings in given:
        found = brakecli.run(tmp_path / "c.toml", settings)
        assert (found["history"].x == of_file["history"].x).all()
        note = found.attrs["resolved_toml"].partition('note = "')[2]
        assert note.startswith("array ")
    loaded = brakecli.load(tmp_path / "c.toml", given[0])
    coarse = {"roughness.wheel.profile_error": 0.5}
    assert brakecli.run(loaded, coarse).identical(brakecli.run(tmp_path / "c.toml", given[0] | coarse))
    both = {"roughness.wheel.profile": columns, "roughness.shoe.profile": columns}
    assert len(brakecli.load(tmp_path / "c.toml", both).records) == 1
    both["roughness.shoe.profile"] = 2.0 * columns
    surfaces = brakecli.load(tmp_path / "c.toml", both).case.roughness
    for side in ("shoe", "wheel"):
        alone = {f"roughness.{side}.profile": both[f"roughness.{side}.profile"]}
        assert getattr(brakecli.load(tmp_path / "c.toml", alone).case.roughness, side) == getattr(surfaces, side)
    radii: dict[Any, Any] = {"wheel.radius": [0.5, 0.499]}
    sweep = brakecli.sweep(loaded, axes=radii, jobs=1)
    assert sweep.amplitude[0] == found.attrs["amplitude"]
    for wrong, words in (
        (np.zeros(5), r"is an array of shape \(5,\)"),
        (np.zeros((5, 3)), r"is an array of shape \(5, 3\)"),
        (columns.T, r"is an array of shape \(2, 180\); give places and heights \(m\), as two columns"),
        (np.zeros((2, 2)), "has 2 rows"),
        (["a", "b"], "is no array of numbers"),
        (columns.astype(str), "is no array of numbers"),
        ([[0.0, 1.0], [2.0]], "is no array of numbers"),
        (np.ma.masked_less(columns, 1e-7), "a cell is empty"),
        (columns * [1.0, 0.0], "all heights are equal"),
    ):
        with pytest.raises(UsageError, match=rf"^roughness\.wheel\.profile: {words}"):
            brakecli.run(tmp_path / "c.toml", {"roughness.wheel.profile": wrong})


def test_an_axis_may_be_a_range_and_is_named_where_it_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TINY)

    def sweep(axis: Any) -> xr.Dataset:
        return brakecli.sweep(tmp_path / "c.toml", axes={"friction.coefficient": axis}, jobs=1)

    found = sweep({"start": 0.1, "stop": 0.4, "num": 3, "spacing": "log"})
    np.testing.assert_array_equal(found.friction_coefficient, [0.1, 0.2, 0.4])
    for wrong, words in (({"start": 0.1, "stop": 0.4}, "num: is missing"), (0.1, "values: is not a list")):
        with pytest.raises(CaseError, match=rf"^the sweep: axis\[0\]\.{words}"):
            sweep(wrong)


def test_a_result_in_memory_is_no_start_of_a_run(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(TINY)
    tree = brakecli.run(tmp_path / "c.toml", output=tmp_path / "before.h5")
    for settings in ({"initial.from": tree}, {"initial": {"from": tree["history"].to_dataset()}}):
        with pytest.raises(UsageError, match=r"^initial\.from: is a result in memory; give output to"):
            brakecli.run(tmp_path / "c.toml", settings)
    brakecli.run(tmp_path / "c.toml", {"initial.from": tmp_path / "before.h5"})


def test_what_cannot_be_drawn_or_reported_is_told(tmp_path: Path) -> None:
    tree = brakecli.run(CASE, SHORT)
    with pytest.raises(UsageError, match=r"^result\.h5: variable z: a run has no such quantity"):
        brakecli.plot(tree, variable="z")
    with pytest.raises(UsageError, match=r"^result\.h5: is no result that can be kept: attribute kind is missing"):
        brakecli.plot(brakecli.classify(tree))
    with pytest.raises(UsageError, match=r"^a\.h5: is no result that can be kept"):
        brakecli.diff(xr.Dataset(attrs={"kind": object()}), tree)
    with pytest.raises(UsageError, match="int: is no result"):
        brakecli.plot(3)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="report: there is no result"):
        brakecli.report()
    with pytest.raises(UsageError, match="its suffix does not name a kind of picture"):
        brakecli.plot(tree, output=tmp_path / "x.txt")
    for margin in (-0.1, 11, math.nan, "1"):
        with pytest.raises(UsageError, match="is no number from 0 to 10"):
            brakecli.advise(CASE, margin=margin)  # type: ignore[arg-type]


SHELL_ALONE = {"as_json", "details", "quiet", "second_run"}
"""How a command prints, and an option that is gone."""
PYTHON_ALONE = {"progress", "axes", "points", "critical", "direction"}
"""Who shows progress, and what the shell writes into the file of a sweep."""


@pytest.mark.parametrize("name", sorted({*brakecli.__all__} - {"load"}))
def test_functions_take_what_commands_take_with_equal_defaults_and_say_so(name: str) -> None:
    group = typer.main.get_group(app)
    command = group.get_command(typer.Context(group), name)
    assert command is not None
    shell = {each.name: each for each in command.params}
    python = inspect.signature(getattr(brakecli, name)).parameters
    assert shell.keys() - SHELL_ALONE == python.keys() - PYTHON_ALONE
    for each in shell.keys() & python.keys():
        default = python[each].default
        assert default is inspect.Parameter.empty or (shell[each].default or None) == (default or None), each
        assert shell[each].help, each  # type: ignore[attr-defined]
    described = str(getattr(brakecli, name).__doc__)
    assert [each for each in python if f"{each}:" not in described] == []
    assert "{options}" not in described


def test_the_page_takes_any_number_of_results_and_else_what_its_record_has() -> None:
    function = inspect.signature(brakecli.report).parameters
    record = inspect.signature(Report).parameters
    assert [*function] == [*record]
    assert [each.default for each in function.values()] == [each.default for each in record.values()]
