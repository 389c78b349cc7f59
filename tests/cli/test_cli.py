"""The command line in normal use: what goes in, what comes out, and where."""

import fcntl
import json
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import termios
from importlib import import_module, resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.about import __released__, __version__
from brakecli.case.read import starters
from brakecli.solver.quantities import HISTORY
from tests.campaign import campaign
from tests.commands import (
    COMMAND,
    LIMIT,
    ROOT,
    TINY,
    Done,
    attributes,
    brakecli,
    each,
    environment,
    left_in,
)

xarray = import_module("xarray")  # imported so because h5netcdf has no type hints

ESCAPE = "\x1b"
COMMANDS = ["run", "check", "new", "schema", "plot"]


pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture(scope="module")
def folder(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a case that was run once; tests write other files beside it."""
    directory = tmp_path_factory.mktemp("cli")
    (directory / "tiny.toml").write_text(TINY)
    return directory


@pytest.fixture(scope="module")
def tiny(folder: Path) -> Done:
    """The run with `--json` that wrote tiny.h5."""
    return brakecli("run", "tiny.toml", "--json", cwd=folder)


# what a run gives


def test_json_is_one_object_with_the_names_of_the_contract_and_nothing_else(tiny: Done) -> None:
    assert (tiny.code, tiny.err) == (0, "")
    assert tiny.out.count("\n") == 1
    wanted = {
        *("regime", "frequency", "amplitude", "stick_fraction", "contact_loss_fraction", "evidence", "output"),
        *("steps", "contact_evaluations", "unconverged_steps", "solve_seconds", "excitation", "reasons"),
    }
    assert wanted <= tiny.json.keys()
    assert tiny.json["output"] == "tiny.h5"
    assert tiny.json["steps"] == 2000
    assert tiny.json["contact_evaluations"] >= 2000
    assert tiny.json["unconverged_steps"] == 0
    assert 0.0 < tiny.json["solve_seconds"] < 10.0


def test_the_file_says_the_same_as_json(folder: Path, tiny: Done) -> None:
    stored = attributes(folder / "tiny.h5")
    same = [name for name, value in tiny.json.items() if isinstance(value, str | int | float)]
    same = [name for name in same if name not in ("command", "output", "solve_seconds")]
    assert len(same) > 10
    assert {name: stored[name] for name in same} == {name: tiny.json[name] for name in same}
    evidence = {name: value for name, value in tiny.json["evidence"].items() if value != []}
    assert attributes(folder / "tiny.h5", "regime/evidence") == evidence != {}


def test_the_root_attributes_of_the_contract_are_there(folder: Path, tiny: Done) -> None:
    stored = attributes(folder / "tiny.h5")
    assert (stored["format"], stored["format_version"], stored["kind"]) == ("brakecli", 1, "run")
    assert (stored["complete"], stored["brakecli_version"]) == (1, __version__)
    assert stored["case_toml"] == TINY
    assert "nodes" in stored["resolved_toml"] or "evaluator" in stored["resolved_toml"]
    assert {"numpy_version", "scipy_version", "numba_version", "hdf5_version"} <= stored.keys()


def test_history_and_spectrum_open_in_xarray_with_units_and_flags(folder: Path, tiny: Done) -> None:
    options: dict[str, Any] = {"engine": "h5netcdf"}
    with xarray.open_dataset(folder / "tiny.h5", group="history", **options) as history:
        assert set(history.data_vars) == set(HISTORY)
        assert history["time"].dims == history["x"].dims == ("time",)
        assert np.array_equal(history["time"], 1e-4 * np.arange(201))
        assert {name: history[name].units for name in HISTORY} == {name: q.units for name, q in HISTORY.items()}
        assert all(history[name].long_name for name in [*HISTORY, "time"])
        assert history["time"].units == "s"
        assert list(history["state"].flag_values) == [-1, 0, 1, 2]
        assert history["state"].flag_meanings == "backward_slip stick forward_slip separated"
        assert set(np.unique(history["state"])) <= {-1, 0, 1, 2}
    with xarray.open_dataset(folder / "tiny.h5", group="spectrum", **options) as spectrum:
        assert set(spectrum.data_vars) == set(HISTORY) - {"state"}
        assert spectrum["frequency"].units == "Hz"
        assert all(spectrum[name].dims == ("frequency",) for name in spectrum.data_vars)
        assert all(spectrum[name].units and spectrum[name].long_name for name in spectrum.data_vars)


def test_no_path_date_or_time_is_stored(folder: Path, tiny: Done, tmp_path: Path) -> None:
    other = tmp_path / "another place"
    other.mkdir()
    shutil.copy(folder / "tiny.toml", other / "renamed.toml")
    os.utime(other / "renamed.toml", (0, 0))
    brakecli("run", "renamed.toml", "-o", "b.h5", cwd=other, TZ="Asia/Tokyo", COLUMNS="40").told(0)
    assert (other / "b.h5").read_bytes() == (folder / "tiny.h5").read_bytes()


def test_running_a_result_again_gives_the_same_bytes(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    settings = ["--set", "friction.coefficient=0.5", "--set", 'title="Größe \\"x\\""', "--set", "contact.nodes=20"]
    brakecli("run", "tiny.toml", "-o", "a.h5", *settings, cwd=tmp_path).told(0)
    assert attributes(tmp_path / "a.h5")["title"] == 'Größe "x"'
    shutil.copy(tmp_path / "a.h5", tmp_path / "no-suffix")
    again, renamed = each(tmp_path, [["run", "a.h5", "-o", "b.h5"], ["run", "no-suffix", "-o", "c.h5"]])
    again.told(0)
    renamed.told(0)
    first = (tmp_path / "a.h5").read_bytes()
    assert first == (tmp_path / "b.h5").read_bytes() == (tmp_path / "c.h5").read_bytes()
    brakecli("run", "a.h5", "--force", cwd=tmp_path).told(0)  # in its own place
    assert first == (tmp_path / "a.h5").read_bytes()


def test_overrides_are_repeatable_and_change_a_result_that_is_run_again(folder: Path, tiny: Done) -> None:
    changes = ["--set", "friction.coefficient=0.1", "--set", "wheel.angular_speed=-2"]
    of_case, of_result = each(
        folder,
        [["run", name, *changes, "--json", "-o", f"changed.{name}.h5"] for name in ("tiny.toml", "tiny.h5")],
    )
    assert of_case.told(0) == of_result.told(0) == ""
    stored = attributes(folder / "changed.tiny.toml.h5")
    assert "coefficient = 0.1" in stored["resolved_toml"]
    assert "angular_speed = -2.0" in stored["resolved_toml"]
    assert stored["case_toml"] == TINY
    one, other = ((folder / f"changed.{name}.h5").read_bytes() for name in ("tiny.toml", "tiny.h5"))
    assert one == other != (folder / "tiny.h5").read_bytes()


def test_a_case_from_standard_input_is_written_to_case_h5(folder: Path, tiny: Done, tmp_path: Path) -> None:
    done = brakecli("run", "-", "--json", cwd=tmp_path, stdin=TINY)
    assert done.told(0) == ""
    assert left_in(tmp_path) == {"case.h5"}
    assert (tmp_path / "case.h5").read_bytes() == (folder / "tiny.h5").read_bytes()


def test_the_table_names_what_was_found_and_quiet_prints_nothing(folder: Path) -> None:
    ways = enumerate((["--details"], ["-q"]))
    loud, quiet = each(folder, [["run", "tiny.toml", "-o", f"t{n}.h5", *way] for n, way in ways])
    assert loud.told(0) == quiet.told(0) == ""
    for word in ("regime", "undecided", "growing", "friction force", "energy account", "t0.h5", "2000 of 1e-05 s"):
        assert word in loud.out
    assert ESCAPE not in loud.out
    assert quiet.out == ""


def test_titles_and_file_names_are_shown_as_they_are(folder: Path) -> None:
    title = "[/x] [bold]b[/bold] :smile: 50%"
    done = brakecli("run", "tiny.toml", "--set", f'title="{title}"', "-o", "[red]r.h5", cwd=folder)
    done.told(0)
    assert done.out.startswith(title + "\n")
    assert "[red]r.h5\n" in done.out


def test_adjusted_steps_and_durations_are_reported(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    changes = ["--set", "solver.step=1.3e-5", "--set", "solver.duration=0.01234"]
    run, quiet, check = each(
        tmp_path,
        [
            ["run", "tiny.toml", *changes, "--json"],
            ["run", "tiny.toml", *changes, "-o", "q.h5", "--quiet"],
            ["check", "tiny.toml", *changes],
        ],
    )
    run.told(0, "solver.step: reduced from 1.3e-05 s to 1.25e-05 s", "solver.duration: extended from 0.01234 s")
    assert len(run.json["adjustments"]) == 2
    assert run.json["step"] == 1.25e-5
    assert run.json["steps"] == 8 * 124
    assert quiet.told(0) == ""
    assert "reduced from 1.3e-05 s" in check.out


# the other commands


def test_new_writes_a_case_that_runs(tmp_path: Path) -> None:
    installed = str(Path(sys.executable).with_name("brakecli"))
    options: dict[str, Any] = {"cwd": tmp_path, "env": environment(), "check": True, "timeout": LIMIT}
    made = subprocess.run([installed, "new", "my wheel"], capture_output=True, text=True, **options)
    assert "brakecli run 'my wheel.toml'" in made.stdout
    assert (tmp_path / "my wheel.toml").read_text() == starters()["case"]
    ran = subprocess.run([installed, "run", "my wheel.toml", "--json"], capture_output=True, **options)
    assert json.loads(ran.stdout)["regime"] == "relaxation"
    assert left_in(tmp_path) == {"my wheel.toml", "my wheel.h5"}


def test_no_command_replaces_the_file_that_it_reads(tmp_path: Path) -> None:
    axis = '[[axis]]\nparameter = "load.force"\nvalues = [1.0]\n'
    texts = {"tiny.toml": TINY, "sweep.toml": 'case = "tiny.toml"\n' + axis}
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    commands = [["run", "tiny.toml"], ["compare-schemes", "tiny.toml"], ["sweep", "sweep.toml"]]
    done = each(tmp_path, [[*command, "-o", command[1], "--force"] for command in commands])
    for result, kind in zip(done, ("case", "case", "sweep"), strict=True):
        result.told(2, f"this is the {kind} itself; choose another output with -o")
    assert {name: (tmp_path / name).read_text() for name in texts} == texts


def test_a_directory_is_not_a_result_to_draw(tmp_path: Path) -> None:
    brakecli("plot", ".", cwd=tmp_path).told(2, "name a file that ends in .pdf, .png or .svg")


def test_the_schema_is_the_shipped_file(tmp_path: Path) -> None:
    done = brakecli("schema", cwd=tmp_path)
    ascii_only = brakecli("schema", cwd=tmp_path, PYTHONIOENCODING="ascii")
    shipped = resources.files("brakecli.case").joinpath("case.schema.json").read_text(encoding="utf-8")
    assert done.told(0) == ascii_only.told(0) == ""
    assert done.json == ascii_only.json == json.loads(shipped)


def test_check_reports_cost_and_limits_and_writes_nothing(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    table, numbers, quiet = each(tmp_path, [["check", "tiny.toml", *flag] for flag in ([], ["--json"], ["-q"])])
    assert table.told(0) == numbers.told(0) == quiet.told(0) == quiet.out == ""
    for word in ("surface speed U", "50 mm/s", "natural frequencies", "2000 steps", "MB", "closed-form"):
        assert word in table.out
    assert numbers.json["valid"] is True
    assert numbers.json["steps"] == 2000
    assert numbers.json["contact_stiffness"] == pytest.approx(2e6)
    # The frictionless shoe on its links and the contact: det(K - m ω²) = 0 at each frequency.
    angle = np.radians(5.0)
    stiffness = 1.2e7 * np.array([[np.cos(angle) ** 2, np.sin(2 * angle) / 2]] * 2)
    stiffness[1] = [1.2e7 * np.sin(2 * angle) / 2, 1.2e7 * np.sin(angle) ** 2 + 1e7 + 2e6]
    for frequency in numbers.json["natural_frequencies"]:
        matrix = stiffness - 10.0 * (2 * np.pi * frequency) ** 2 * np.eye(2)
        assert min(abs(np.linalg.eigvalsh(matrix))) < 1e-6 * stiffness.max()
    assert left_in(tmp_path) == {"tiny.toml"}


def test_the_version_is_printed() -> None:
    assert brakecli("--version", cwd=ROOT) == Done(0, f"brakecli {__version__}\n", "")


def test_every_command_has_help_and_a_place_in_the_documentation() -> None:
    listed = brakecli("--help", cwd=ROOT)
    listed.told(0)
    commands = re.findall(r"^  ([a-z-]+)  ", listed.out.split("Ask:")[1], re.MULTILINE)
    assert set(COMMANDS) <= set(commands)
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    documentation = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    for command, done in zip(commands, each(ROOT, [[command, "--help"] for command in commands]), strict=True):
        assert done.told(0) == ""
        assert "Usage: " in done.out
        assert f"brakecli {command}" in documentation, f"name `brakecli {command}` in the README or in docs/"


def test_a_command_that_does_not_exist_is_told_with_the_nearest_one() -> None:
    brakecli("runn", cwd=ROOT).told(2, "No such command 'runn'. Did you mean 'run'?")


# how it is shown


def loaded_by(arguments: list[str], cwd: Path | None = None) -> set[str]:
    """The names of the modules that a command has loaded by its end."""
    code = (
        f"import sys; sys.argv = {['brakecli', *arguments]}\n"
        "from brakecli.__main__ import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('loaded:', *sys.modules, file=sys.stderr)\n"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=cwd, env=environment(), timeout=LIMIT, check=True
    )
    return set(done.stderr.split("loaded:")[1].split())


def test_help_imports_no_numerical_library() -> None:
    loaded = loaded_by(["--help"])
    assert "typer" in loaded
    assert loaded.isdisjoint({"numpy", "numba", "h5py", "scipy", "pydantic", "matplotlib", "rich"})


def test_a_run_waits_for_no_library_that_it_does_not_need(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    loaded = loaded_by(["run", "tiny.toml"], tmp_path)
    assert {"numba", "h5py", "brakecli.solver.steps.loop"} <= loaded
    unused = {"scipy.signal", "scipy.stats", "scipy.interpolate", "scipy.optimize", "scipy.ndimage"}
    unused |= {"scipy.linalg", "numpy.f2py"}
    unused |= {"matplotlib", "pint", "brakecli.studies.sweeps", "brakecli.studies.comparison"}
    assert loaded.isdisjoint(unused)


def test_a_run_that_keeps_a_tolerance_tells_the_step_that_it_took(tmp_path: Path) -> None:
    """So many steps of that length are the duration; the case gives none."""
    case = TINY.replace("{ step = 1e-5, duration", '{ scheme = "two-layer", tolerance = 1e-4, duration')
    done = brakecli("run", "-", "--details", cwd=tmp_path, stdin=case)
    found = re.search(r"steps +(\d+) of (\S+) s,", done.out)
    assert found is not None, done
    assert int(found[1]) * float(found[2]) == pytest.approx(0.02, rel=1e-3)


def test_vibration_on_smooth_pads_waits_for_no_kernels_of_rough_ones(tmp_path: Path) -> None:
    """Whether it lasts is asked of the flow on smooth pads."""
    loaded = loaded_by(["run", str(ROOT / "cases" / "relaxation.toml"), "--output", "r.h5"], tmp_path)
    assert "brakecli.solver.motion.orbit" in loaded
    assert loaded.isdisjoint({"brakecli.solver.motion.rough", "brakecli.solver.steps.event_driven"})


@campaign
def test_a_sweep_without_a_search_waits_for_no_kernels_of_branches(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    axis = '[[axis]]\nparameter = "load.force"\nvalues = [1000.0, 2000.0]\n'
    (tmp_path / "sweep.toml").write_text(f'case = "tiny.toml"\n{axis}')
    loaded = loaded_by(["sweep", "sweep.toml"], tmp_path)
    assert {"brakecli.studies.sweeps.point", "brakecli.solver.steps.loop"} <= loaded
    others = "solver.motion.rough", "solver.steps.event_driven", "analysis.branches.explore"
    assert loaded.isdisjoint(f"brakecli.{name}" for name in others)


def test_a_measured_signal_waits_for_no_compiled_code(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "signal.csv", np.sin(0.1 * np.arange(2000.0)))
    loaded = loaded_by(["classify", "signal.csv", "--sample-rate", "1e3", "--quantity", "displacement"], tmp_path)
    assert "brakecli.analysis.signals.look" in loaded
    assert loaded.isdisjoint({"numba", "h5py", "scipy.signal", "scipy.stats", "scipy.optimize", "matplotlib"})


def on_a_terminal(arguments: list[str], cwd: Path, **changes: str) -> tuple[int, str, str]:
    """Run with standard error on a terminal; the exit code and both outputs."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    settings = environment(TERM="xterm-256color", **changes)
    process = subprocess.Popen(
        [*COMMAND, *arguments], cwd=cwd, stdout=subprocess.PIPE, stderr=theirs, stdin=theirs, env=settings
    )
    os.close(theirs)
    told = b""
    try:
        while block := os.read(ours, 65536):
            told += block
    except OSError:  # how Linux says that the other end is closed
        pass
    os.close(ours)
    out, _ = process.communicate(timeout=LIMIT)
    return process.returncode, out.decode(), told.decode()


def test_a_progress_bar_appears_on_a_terminal_and_leaves_it_clean(folder: Path) -> None:
    code, out, told = on_a_terminal(["run", "tiny.toml", "--json", "-o", "p.h5"], folder)
    assert code == 0
    assert json.loads(out)["steps"] == 2000
    assert "2000/2000" in told
    assert "100%" in told
    assert told.rstrip("\r\n").endswith(f"{ESCAPE}[2K")  # the line of the bar is wiped
    assert told.count(f"{ESCAPE}[?25h") == told.count(f"{ESCAPE}[?25l")  # and the cursor is back


@campaign
def test_quiet_shows_no_bar_and_no_color_no_colours(folder: Path) -> None:
    assert on_a_terminal(["run", "tiny.toml", "-q", "-o", "q.h5"], folder) == (0, "", "")
    code, _, told = on_a_terminal(["run", "tiny.toml", "-o", "n.h5"], folder, NO_COLOR="1")
    assert code == 0
    assert "2000/2000" in told
    assert not re.search(rf"{ESCAPE}\[[0-9;]*[34][0-9]", told)  # codes of colours


def test_a_starter_with_a_slip_in_its_name_is_asked_about(tmp_path: Path) -> None:
    slip, own = (brakecli("new", name, cwd=tmp_path) for name in ("scater", "wheel7"))
    assert slip.code == 2
    assert "no starter is called scater; did you mean scatter?" in slip.err
    assert own.err == ""
    assert [each.name for each in tmp_path.iterdir()] == ["wheel7.toml"]


def test_the_citation_has_version_and_year_and_says_what_its_file_says() -> None:
    cited = brakecli("--cite", cwd=ROOT)
    cited.told(0)
    assert f"version = {{{__version__}}},\n  year    = {{{__released__[:4]}}}\n" in cited.out
    assert cited.out.count("{") == cited.out.count("}")
    of_file = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\ndate-released: {__released__}\n" in of_file
    paper = re.findall(r"title: (.*)", of_file)[-1]
    assert f"title  = {{{paper}}}" in cited.out
    for name in ("The brakecli authors", "Koptovets", "UDC 622.625.28-592.112", "National Mining University"):
        assert name in cited.out
        assert name in of_file
