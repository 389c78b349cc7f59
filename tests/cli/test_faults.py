"""The command line when something is wrong: a sentence and an exit code, no traceback, nothing left behind."""

import os
import random
import re
import shlex
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np
import pytest

from tests.commands import (
    COMMAND,
    LIMIT,
    TINY,
    Done,
    attributes,
    brakecli,
    each,
    environment,
    left_in,
    variants,
    warm_up,
)

LONG = ["--set", "solver.duration=1e4"]  # minutes
COMPILING = "brakecli: compiling kernels, once for this version …\n"
QUICK = 2.0  # s, within which an interruption ends a command


pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture(scope="module")
def compiled() -> None:
    """Kernels."""
    warm_up()


@pytest.fixture(scope="module")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the tiny case and its result, only to be read."""
    directory = tmp_path_factory.mktemp("good")
    (directory / "tiny.toml").write_text(TINY)
    brakecli("run", "tiny.toml", "--quiet", cwd=directory).told(0)
    return directory


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A directory with nothing but the tiny case."""
    (tmp_path / "tiny.toml").write_text(TINY)
    return tmp_path


def shell(line: str, cwd: Path, **changes: str | None) -> Done:
    """Run a line of the shell in which $B stands for the command."""
    command, settings = line.replace("$B", shlex.join(COMMAND)), environment(**changes)
    done = subprocess.run(["bash", "-c", command], cwd=cwd, capture_output=True, timeout=LIMIT, env=settings)
    return Done(done.returncode, done.stdout.decode(), done.stderr.decode())


def shells(cwd: Path, lines: Sequence[str]) -> list[Done]:
    """Run lines of the shell, two at a time."""
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(lambda line: shell(line, cwd), lines))


@contextmanager
def started(
    arguments: Sequence[str], cwd: Path, stdin: int | IO[Any] = subprocess.DEVNULL
) -> Iterator[subprocess.Popen[bytes]]:
    """A command that is running; it is killed if it still does at the end."""
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        cwd=cwd,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


# F4, F14, F22: what cannot be written


def test_a_full_disk_is_told_with_the_path_and_leaves_nothing(here: Path) -> None:
    limits = (0, 10, 60)  # KiB that a file may have
    run = "$B run tiny.toml --set solver.duration=0.1 -o"
    for limit, done in zip(limits, shells(here, [f"ulimit -f {n}; {run} {n}.h5" for n in limits]), strict=True):
        assert done.told(74, f"{limit}.h5: cannot write: ").count("\n") == 1
    assert shell("ulimit -f 0; $B new other", here).told(74, "other.toml: cannot write: ").count("\n") == 1
    assert left_in(here) == {"tiny.toml"}
    brakecli("run", "tiny.toml", "-o", "10.h5", "--quiet", cwd=here).told(0)  # once there is room again


def test_a_full_standard_output_is_told(here: Path) -> None:
    commands = [
        "run tiny.toml -o 1.h5 --json",
        "run tiny.toml -o 2.h5",
        "check tiny.toml",
        "check tiny.toml --json",
    ]
    commands += ["new x", "schema", "--help", "run --help", "--version"]
    for done in shells(here, [f"$B {command} > /dev/full" for command in commands]):
        assert done.told(74, "standard output: cannot write: no space left on device").count("\n") == 1


def test_closed_streams_and_a_full_standard_error_change_nothing(good: Path, here: Path) -> None:
    redirections = [">&-", "<&- >&- 2>&-", "2>/dev/full", "| true"]
    lines = [f"set -o pipefail; $B run tiny.toml -o {n}.h5 {to}" for n, to in enumerate(redirections)]
    for n, done in enumerate(shells(here, lines)):
        done.told(0)
        assert (here / f"{n}.h5").read_bytes() == (good / "tiny.h5").read_bytes()
    wrong = ["$B run missing.toml", "$B no-such-command"]
    for done in shells(here, [f"{command} {to}" for command in wrong for to in redirections[:3]]):
        done.told(2)
    shell("set -o pipefail; $B --help | true", here).told(0)
    shell("$B run - <&-", here).told(2, "standard input: cannot be read")


@pytest.mark.parametrize(
    ("output", "reason"),
    [
        ("missing/r.h5", "the directory"),
        ("tiny.toml/r.h5", "the directory"),
        (".", "this is a directory"),
        ("folder", "this is a directory"),
        ("/proc/r.h5", "no such file or directory"),
        ("x" * 300, "file name too long"),
        ("x" * 254 + "/r.h5", "the directory"),
        ("/dev/null", "not a regular file"),
    ],
)
def test_an_output_that_cannot_be_is_told_with_its_path(here: Path, output: str, reason: str) -> None:
    (here / "folder").mkdir()
    brakecli("run", "tiny.toml", "-o", output, "--force", cwd=here).told(74, f"{output}: cannot write: ", reason)
    assert left_in(here) == {"tiny.toml", "folder"}


def test_outputs_elsewhere_are_written_and_the_case_is_never_replaced(here: Path) -> None:
    (here / "inner").mkdir()
    brakecli("run", "../tiny.toml", "-o", "../r.h5", "-q", cwd=here / "inner").told(0)
    assert left_in(here) == {"tiny.toml", "inner", "r.h5"}
    for name in ("tiny.toml", "./tiny.toml", "inner/../tiny.toml"):
        told = brakecli("run", "tiny.toml", "--force", "-o", name, cwd=here)
        told.told(2, "this is the case itself; choose another output with -o")
    assert (here / "tiny.toml").read_text() == TINY
    before = (here / "r.h5").read_bytes()
    brakecli("run", "tiny.toml", "-o", "r.h5", cwd=here).told(2, "r.h5: exists already; replace it with --force")
    assert (here / "r.h5").read_bytes() == before


def test_a_deleted_working_directory_is_told(here: Path) -> None:
    gone = 'mkdir gone; cd gone; rmdir "$PWD"; $B '
    shell(f"{gone} run {here}/tiny.toml", here).told(74, "tiny.h5: cannot write: no such file or directory")
    shell(f"{gone} new", here).told(74, "case.toml: cannot write: no such file or directory")
    shell(f"{gone} check {here}/tiny.toml", here).told(0)


# F6: result files that are none


def test_a_broken_result_is_no_case_to_run_again(good: Path, tmp_path: Path) -> None:
    whole = (good / "tiny.h5").read_bytes()
    middle = len(whole) // 2
    files = {
        "empty.h5": (b"", 4, "the file is empty"),
        "text.h5": (b"[shoe]\nmass = 1\n", 4, "this is not an HDF5 file"),
        "half.h5": (whole[:middle], 4, "truncated, damaged or was altered"),
        "cut.h5": (whole[:-1], 4, "truncated, damaged or was altered"),
        "flipped.h5": (whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :], 4, "damaged"),
        "flipped": (whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :], 4, "damaged"),
        "empty": (b"", 2, "shoe: is missing"),
    }
    for name, (data, _, _) in files.items():
        (tmp_path / name).write_bytes(data)
    with h5py.File(tmp_path / "foreign.h5", "w") as foreign:
        foreign["x"] = np.arange(5.0)
    (tmp_path / "sweep.h5").write_bytes(whole[:-32])
    with h5py.File(tmp_path / "sweep.h5", "r+") as other:
        other.attrs["kind"] = "sweep"
    (tmp_path / "edited.h5").write_bytes(whole[:-32])
    with h5py.File(tmp_path / "edited.h5", "r+") as edited:
        edited.attrs["resolved_toml"] = edited.attrs["resolved_toml"].replace("mass = 10.0", "mass = -1.0")
    expected = {name: (code, reason) for name, (_, code, reason) in files.items()} | {
        "foreign.h5": (4, "was not written by this program"),
        "sweep.h5": (4, "holds a result of kind 'sweep'"),
        "edited.h5": (2, "shoe.mass"),
        "missing.h5": (2, "missing.h5: cannot be read"),
    }
    done = each(tmp_path, [["run", name, "-o", "out.h5"] for name in expected])
    for (name, (code, reason)), result in zip(expected.items(), done, strict=True):
        result.told(code, name, reason)
    assert not (tmp_path / "out.h5").exists()


# F7 … F9: the case


def test_wrong_values_are_told_all_at_once_with_their_lines(tmp_path: Path) -> None:
    bad = TINY.replace("mass = 10.0", "mass = nan").replace("radius = 0.5", 'radius = "0.5"')
    bad = bad.replace("load.force = 5000.0", "load.force = true\nload.forse = 1").replace("1e-5,", "1e-320,")
    (tmp_path / "bad.toml").write_text(bad)
    for command in ("run", "check"):
        told = brakecli(command, "bad.toml", "--set", "contact.stiffness=0", cwd=tmp_path).told(2)
        starts = ["bad.toml:2: shoe.mass: ", "bad.toml:3: wheel.radius: ", "bad.toml:6: load.force: "]
        starts += ["bad.toml:7: load.forse: ", "bad.toml:10: solver.step: "]
        starts += ["--set contact.stiffness=0: contact.stiffness: "]
        lines = told.splitlines()
        assert [
            line.removeprefix("brakecli: ").startswith(start) for line, start in zip(lines, starts, strict=True)
        ]
        assert all("(found " in line and "; " in line for line in lines)
        assert "force" in lines[3].split(";")[1]  # the nearest valid key
    assert left_in(tmp_path) == {"bad.toml"}


@pytest.mark.parametrize(
    "text",
    [
        "[a" * 5000,
        f"{'a.' * 20000}b = 1",
        TINY + "\0",
        "\ufeff" * 3 + TINY,
        TINY.encode("utf-16"),
        b"title = '\xe9'",
    ],
    ids=["nested", "deep", "nul", "marks", "utf-16", "latin-1"],
)
def test_hostile_texts_are_refused_as_fast_as_any_case(tmp_path: Path, text: str | bytes) -> None:
    (tmp_path / "bad.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
    start = time.monotonic()
    brakecli("check", "bad.toml", cwd=tmp_path).told(2, "bad.toml")
    assert time.monotonic() - start < 1.5  # half a second, and Python's start on a busy machine


# F11: too large


def test_a_run_that_is_too_large_is_refused_with_its_size(here: Path) -> None:
    steps = [["solver.duration=1e7"], ["solver.step=1e-100", "solver.duration=1e100"]]
    for done in variants(here, *steps):
        told = done.told(
            3, "the run is too long: about 1e+", "steps, ", "MB of memory, a file of ", "reduce solver"
        )
        assert done.out == ""
        assert told.count("\n") == 1
    check = brakecli("check", "tiny.toml", "--set", "solver.duration=1e7", cwd=here)
    check.told(3, "about 1e+12 steps", "41.7 hours", "6.5e+06 MB")
    nodes = ["--set", "contact.nodes=10000000", "--set", "contact.evaluator='midpoint'"]
    waves = ["--set", "roughness.wheel={amplitudes=[1e-6], wavelengths=[1e-2]}"]
    several = f"roughness.wheel={{amplitudes={[1e-6] * 30}, wavelengths={[0.01] * 30}}}"
    brakecli("run", "tiny.toml", *nodes, "--set", several, cwd=here).told(3, "contact.nodes")
    brakecli("run", "tiny.toml", *nodes, *waves, *LONG, cwd=here).told(3, "the run is too long")
    assert left_in(here) == {"tiny.toml"}


# F12: interruptions


def interrupt(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal; the command ends soon, with its code and one sentence."""
    assert process.poll() is None
    start = time.monotonic()
    process.send_signal(number)
    out, err = process.communicate(timeout=LIMIT)
    word = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}[number]
    done = Done(process.returncode, out.decode(), err.decode())
    assert done.told(128 + number, f"brakecli: {word}").count("\n") == 1
    assert time.monotonic() - start < QUICK
    assert done.out == ""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_in_the_loop_and_leaves_nothing(here: Path, number: signal.Signals) -> None:
    for delay in (0.0, 0.5) if number != signal.SIGHUP else (0.2,):
        with started(["run", "tiny.toml", *LONG], here) as process:
            wait_until((here / ".tiny.h5.part").exists)
            time.sleep(delay)
            interrupt(process, number)
        assert left_in(here) == {"tiny.toml"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_reading_of_a_case(here: Path, number: signal.Signals) -> None:
    with started(["run", "-"], here, stdin=subprocess.PIPE) as process:
        time.sleep(0.7)  # it waits for its case
        interrupt(process, number)
    assert left_in(here) == {"tiny.toml"}


def test_a_signal_ends_the_imports_without_a_traceback(here: Path) -> None:
    command = [COMMAND[0], "-X", "importtime", *COMMAND[1:], "run", "tiny.toml"]
    for module in (b"typer.main", b"pydantic.main", b"numba.core.types", b"numpy.fft"):
        with subprocess.Popen(command, cwd=here, stderr=subprocess.PIPE, env=environment()) as process:
            assert process.stderr is not None
            for line in process.stderr:
                if line.rstrip().endswith(module):
                    break
            else:
                pytest.fail(f"{module.decode()} was not imported")
            process.send_signal(signal.SIGINT)
            rest = process.stderr.read()
        assert b"Traceback" not in rest, rest
        assert process.returncode == 130
        assert b"brakecli: interrupted\n" in rest
    assert left_in(here) == {"tiny.toml"}


def test_a_signal_ends_a_run_of_slow_steps(here: Path) -> None:
    waves = "roughness.wheel={amplitudes=[1e-6, 1e-6], wavelengths=[0.02, 0.01]}"
    slow = ["--set", "contact.nodes=2000000", "--set", "contact.evaluator='midpoint'", "--set", waves]
    with started(["run", "tiny.toml", *slow], here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        time.sleep(1.0)  # for the tables of the contact
        interrupt(process, signal.SIGINT)
    assert left_in(here) == {"tiny.toml"}


def test_many_signals_at_once_leave_nothing_either(here: Path) -> None:
    with started(["run", "tiny.toml", *LONG], here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
            process.send_signal(number)
        _, err = process.communicate(timeout=LIMIT)
    assert b"Traceback" not in err
    assert process.returncode in (130, 143)
    assert left_in(here) == {"tiny.toml"}


def test_an_interruption_at_any_time_of_a_short_run_leaves_nothing_or_the_result(good: Path, here: Path) -> None:
    generator = random.Random(5)
    outcomes = set()
    for _ in range(4):
        (here / "tiny.h5").unlink(missing_ok=True)
        with started(["run", "tiny.toml", "-q"], here) as process:
            wait_until(lambda: (here / ".tiny.h5.part").exists() or (here / "tiny.h5").exists())
            time.sleep(generator.uniform(0.0, 0.12))
            process.send_signal(signal.SIGINT)
            _, err = process.communicate(timeout=LIMIT)
        assert b"Traceback" not in err
        outcomes.add(process.returncode)
        assert left_in(here) <= {"tiny.toml", "tiny.h5"}
        if (here / "tiny.h5").exists():
            assert (here / "tiny.h5").read_bytes() == (good / "tiny.h5").read_bytes()
        else:
            assert process.returncode == 130
    assert outcomes <= {0, 130, -signal.SIGINT}  # the last: Python itself, on its way out
    assert 130 in outcomes


# F13: rivals


def test_a_second_writer_is_refused_and_names_the_first_whose_lock_ends_with_it(good: Path, here: Path) -> None:
    with started(["run", "tiny.toml", *LONG], here) as first:
        wait_until((here / ".tiny.h5.part").exists)
        second = brakecli("run", "tiny.toml", "--force", cwd=here)
        second.told(2, f"tiny.h5: is being written by process {first.pid} on {socket.gethostname()}; wait until")
        assert first.poll() is None
        first.kill()
        first.wait()
    assert {".tiny.h5.part", ".tiny.h5.lock"} <= left_in(here)  # nobody was left to remove them
    brakecli("run", "tiny.toml", "--quiet", cwd=here).told(0)
    assert left_in(here) == {"tiny.toml", "tiny.h5"}
    assert (here / "tiny.h5").read_bytes() == (good / "tiny.h5").read_bytes()


# F15 … F18, F20, F21: cases at the edge


def test_extreme_speeds_and_frictions_end_in_a_regime_with_its_reason(here: Path) -> None:
    speeds = ["0.0", "-0.1", "1e-9", "1e4"]
    frictions = ["0.0", "5.0", "50.0"]
    done = variants(
        here,
        *([f"wheel.angular_speed={speed}", "solver.duration=0.05"] for speed in speeds),
        *([f"friction.coefficient={friction}", "solver.duration=0.05"] for friction in frictions),
    )
    results = dict(zip([*speeds, *(f"φ {friction}" for friction in frictions)], done, strict=True))
    for name, result in results.items():
        warned = "stick and slip are not resolved" in result.told(0)
        assert warned == (name in ("1e-9", "φ 50.0")), name  # friction there outruns the wheel within a step
        assert warned or result.told(0) == "", name
        numbers = result.json
        assert numbers["reasons"][0]
    still = results["0.0"].json
    assert still["regime"] == "damped"
    assert "come to rest" in still["reasons"][0]
    assert "carried along" in results["1e-9"].json["reasons"][0]
    for n, sign in ((1, -1.0), (3, 1.0)):  # the wheel drags the shoe along its own motion
        with h5py.File(here / f"{n}.h5") as file:
            assert sign * file["history/friction_force"][-100:].mean() > 0.0
    with h5py.File(here / "4.h5") as file:
        assert not np.any(file["history/friction_force"][:])


def test_a_reversed_wheel_of_a_symmetric_case_mirrors_the_motion(here: Path) -> None:
    straight = ["link2.angle_deg=0.0", "initial.x=1e-5"]
    mirrored = ["link2.angle_deg=0.0", "initial.x=-1e-5", "wheel.angular_speed=-0.1"]
    for done in variants(here, straight, mirrored):
        done.told(0)
    with h5py.File(here / "0.h5") as one, h5py.File(here / "1.h5") as other:
        assert np.ptp(one["history/x"][:]) > 0.0
        assert np.array_equal(one["history/x"][:], -other["history/x"][:])
        assert np.array_equal(one["history/y"][:], other["history/y"][:])


def test_an_explicit_scheme_beyond_its_step_is_refused_with_the_limit_which_then_holds(here: Path) -> None:
    weights = "solver.theta=[0.0, 0.0]"
    coarse = ["solver.step=1e-3", "output.sample_interval=1e-3", "solver.duration=0.1"]
    (two_layer, three_layer) = variants(
        here,
        [weights, *coarse],
        [
            "solver.scheme='three-layer'",
            "solver.theta=[0.0, 1.0, 0.0]",
            *coarse[2:],
            *(s.replace("1e", "3e") for s in coarse[:2]),
        ],
    )
    limits = []
    for done in (two_layer, three_layer):
        told = done.told(3, "solver.theta: at this step the scheme is unstable, it multiplies disturbances by")
        limits.append(float(told.split("take a solver.step of at most ")[1].split()[0]))
    # Leapfrog is stable up to 2/ω of the highest frequency, 181.8 Hz (dashpots lower it a little).
    assert limits[1] == pytest.approx(2.0 / (2.0 * np.pi * 181.8), rel=0.05)
    assert left_in(here) == {"tiny.toml"}
    (below,) = variants(here, [weights, f"solver.step={limits[0]}", "output.sample_interval=1e-3", coarse[2]])
    below.told(0)
    assert below.json["amplitude"] < 1.0


def test_a_motion_beyond_all_bounds_is_a_failure_that_is_written(here: Path) -> None:
    (done,) = variants(here, ["load.force=1e25"])
    done.told(1, "the motion grew beyond all bounds", "0.h5: the history up to the failure was written")
    assert done.json["status"] == "failed"
    assert done.json["regime"] == "undecided"
    assert attributes(here / "0.h5")["status"] == "failed"


def test_an_implicit_step_that_does_not_resolve_is_told_with_its_number(here: Path) -> None:
    (done,) = variants(here, ["solver.step=1e-3", "output.sample_interval=1e-3", "solver.duration=0.2"])
    assert "Traceback" not in done.err
    assert "warning: solver.step: 5.5 steps per period of the fastest motion (181.8 Hz)" in done.err
    assert done.json["warnings"][0].startswith("solver.step: 5.5 steps per period")


def test_steps_that_do_not_converge_end_the_run_unless_allowed_and_are_kept(here: Path) -> None:
    diverging = ["solver.iteration='fixed-point'", "solver.step=2e-3", "output.sample_interval=2e-3"]
    diverging += ["solver.duration=0.2", "contact.stiffness=2e9"]
    strict, allowed = variants(here, diverging, [*diverging, "solver.allow_unconverged=true"])
    strict.told(1, "solver.iteration: the fixed-point iteration may diverge (its bound of contraction is ")
    strict.told(1, "the iteration of a step did not converge", "0.h5: the history up to the failure was written")
    assert strict.json["unconverged_steps"] == 1
    assert strict.json["status"] == "failed"
    assert allowed.json["unconverged_steps"] > 1
    count = allowed.json["unconverged_steps"]
    allowed.told(1, f"warning: {count} of {allowed.json['steps']} steps did not converge, as the case allows")
    allowed.told(1, "the motion grew beyond all bounds")
    for name, steps in (("0.h5", 1), ("1.h5", count)):
        with h5py.File(here / name) as file:
            residuals, times = file["unconverged/residual"], file["unconverged/time"]
            assert residuals.shape == times.shape == (steps,)
            assert residuals.attrs["units"] == "N"
            assert np.all(np.abs(residuals[:]) > 0.0)
            assert np.all((times[:] >= 0.0) & (times[:] <= 0.2))
    assert attributes(here / "1.h5")["unconverged_steps"] == count


def test_unconverged_steps_that_do_little_harm_are_allowed_with_a_warning(here: Path) -> None:
    # The contraction is 1.004: the evaluations of a step run out, but at small residuals.
    close = ["solver.iteration='fixed-point'", "solver.step=1e-2", "output.sample_interval=1e-2"]
    close += ["solver.duration=0.2", "contact.stiffness=1e8", "wheel.angular_speed=2.0"]
    strict, allowed = variants(here, close, [*close, "solver.allow_unconverged=true"])
    strict.told(1, "did not converge")
    count = allowed.json["unconverged_steps"]
    assert count > 0
    allowed.told(0, f"warning: {count} of 20 steps did not converge, as the case allows")


def test_lost_contact_and_permanent_stick_are_named_and_never_damped(here: Path) -> None:
    done = variants(
        here,
        ["load={times=[0.0, 0.005], forces=[5000.0, -5000.0]}"],  # pulled off
        ["load.force=-5000.0"],
        ["load.force=0.0"],
        ["load.force=0.0", "initial.at='equilibrium'", "wheel.angular_speed=0.0"],
        ["friction.coefficient=5.0", "wheel.angular_speed=1e-3", "load.force=50000.0"],
        [
            "friction.coefficient=5.0",
            "load.force=50000.0",
            "wheel={radius=0.5, times=[0.0, 1.0], angular_speeds=[0.0, 1e-3]}",
        ],
    )
    lost, negative, unloaded, resting, carried, speeding = (result.json for result in done)
    for numbers in (lost, negative, unloaded, resting):
        assert numbers["regime"] == "undecided"
        assert numbers["contact_loss_fraction"] == 1.0
    assert "lost contact for good" in lost["reasons"][0]
    for numbers in (negative, unloaded, resting):  # what has never touched cannot lose contact
        assert "never" in numbers["reasons"][0]
    assert "load: the force is negative at times" in done[1].err
    for numbers in (carried, speeding):
        assert numbers["regime"] == "undecided"
        assert "sticks throughout and is carried along by the wheel" in numbers["reasons"][0]
        assert numbers["stick_fraction"] == 1.0


def test_a_shoe_that_a_stopping_wheel_leaves_in_stick_has_come_to_rest(here: Path) -> None:
    stop = "wheel={radius=0.5, times=[0.0, 0.005], angular_speeds=[0.1, 0.0]}"
    (done,) = variants(here, [stop, "friction.coefficient=5.0"])
    assert done.told(0) == ""
    assert done.json["regime"] == "damped"
    assert "come to rest" in done.json["reasons"][0]


def test_what_is_not_resolved_is_told_with_key_and_number(here: Path) -> None:
    wave = "roughness.wheel={amplitudes=[1e-6], wavelengths=[1e-3]}"
    nodes, passing = variants(
        here,
        [wave, "contact.evaluator='midpoint'", "contact.nodes=64", "wheel.angular_speed=0.0"],
        [wave, "contact.evaluator='midpoint'", "wheel.angular_speed=40.0"],
    )
    # The pad of 0.1 m holds 100 waves; 20 m/s over a wave of 1 mm is 20 kHz.
    nodes.told(0, "contact.nodes: 0.64 nodes per shortest wavelength; take at least ")
    told = passing.told(
        passing.code, "solver.step: 5 steps per passing wave of the wheel (2e+04 Hz); take a step of"
    )
    assert (
        "output.sample_interval: the shortest wave of the wheel at 2e+04 Hz lies above half the sampling" in told
    )
    assert "(5000 Hz)" in told


def test_roughness_of_no_height_is_the_smooth_path_bit_for_bit(here: Path) -> None:
    wheel = "{amplitudes=[0.0, 0.0], wavenumbers=[300.0, 700.0]}"
    flat = f"roughness={{shoe={{amplitudes=[0.0], wavelengths=[0.01]}}, wheel={wheel}}}"
    empty = "roughness={shoe={amplitudes=[], wavelengths=[]}}"
    for done in variants(here, [], [flat], [empty]):
        assert done.told(0) == ""
    with h5py.File(here / "0.h5") as smooth:
        for name in ("1.h5", "2.h5"):
            with h5py.File(here / name) as other:
                for group in ("history", "spectrum"):
                    assert len(smooth[group]) > 5
                    for variable in smooth[group]:
                        assert smooth[group][variable][:].tobytes() == other[group][variable][:].tobytes()
                assert dict(other["evaluators"].attrs) == {"closed-form": 2000}


def test_signals_of_nothing_and_next_to_nothing_have_finite_spectra(here: Path) -> None:
    still = ["load.force=0.0", "initial.at='equilibrium'", "wheel.angular_speed=0.0"]
    steady = ["friction.coefficient=0.1", "initial.at='equilibrium'"]
    tiny = ["load.force=1e-100"]
    tiniest = ["load.force=1e-100", "contact.stiffness=1e-60", "friction.coefficient=1e-100"]
    done = variants(here, still, steady, tiny, tiniest)
    for n, result in enumerate(done):
        assert "Traceback" not in result.err
        assert result.code == 0
        assert result.json["reasons"][0]
        with h5py.File(here / f"{n}.h5") as file:
            for variable in file["spectrum"].values():
                assert variable.size > 3
                assert np.isfinite(variable[:]).all()
                assert variable[:].min() >= 0.0
    with h5py.File(here / "0.h5") as file:
        assert not np.any(file["history/x"][:])
        assert not np.any(file["spectrum/vx"][:])
    assert done[0].json["spectrum_peak"] is None
    assert done[1].json["regime"] == "damped"


@pytest.mark.parametrize(
    "overrides",
    [
        ["link2.stiffness=1e100", "initial.at='equilibrium'"],
        ["contact.stiffness=1e100", "contact.half_length=1e100"],
        ["shoe.mass=1e-100", "link1.damping=1e100", "contact.stiffness=1e100"],
        ["shoe.mass=1e100", "solver.step=1e-100", "output.sample_interval=1e100", "solver.scheme='three-layer'"],
    ],
)
def test_numbers_that_no_brake_has_are_refused_or_run(here: Path, overrides: list[str]) -> None:
    for done in variants(here, overrides):
        assert "Traceback" not in done.err
        assert "RuntimeWarning" not in done.err
        assert done.code in (0, 1, 3)
        if done.code == 3:
            done.told(3, "; ")
    assert left_in(here) <= {"tiny.toml", "0.h5"}


# F22: the surroundings


def test_the_surroundings_change_no_bit(good: Path, here: Path) -> None:
    surroundings: list[dict[str, str | None]] = [
        {"LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"},
        {"HOME": None},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"},
        {"COLUMNS": "1"},
        {"TERM": "dumb", "NO_COLOR": "1", "COLUMNS": "nonsense"},
        {"HDF5_USE_FILE_LOCKING": "FALSE", "TZ": "Asia/Tokyo"},
    ]

    def run(n: int) -> Done:
        return brakecli("run", "tiny.toml", "-o", f"{n}.h5", cwd=here, stdin="", **surroundings[n])

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(run, range(len(surroundings))))
    for n, done in enumerate(outcomes):
        assert done.told(0).replace(COMPILING, "") == ""  # there may be another home, without compiled code
        assert "e-05" in done.out
        assert not re.search(r"\d,\d", done.out)
        assert all(len(line) <= 100 for line in done.out.splitlines())
        assert len(done.out.splitlines()) < 60
        assert (here / f"{n}.h5").read_bytes() == (good / "tiny.h5").read_bytes()


def test_without_a_place_for_compiled_code_everything_works_but_slower(here: Path) -> None:
    done = brakecli("check", "tiny.toml", "--json", cwd=here, XDG_CACHE_HOME="/proc/nowhere")
    assert done.told(0) == COMPILING
    assert done.json["steps"] == 2000


def test_paths_may_hold_spaces_and_letters_of_any_script_or_none(good: Path, tmp_path: Path) -> None:
    folder = tmp_path / "Größe 轮 [x]"
    folder.mkdir()
    names = ["mit Leerzeichen.toml", "колесо.toml", os.fsdecode(b"\xff.toml"), "--help.toml"]
    for name in names:
        (folder / name).write_text(TINY)
    for name, done in zip(names, each(folder, [["run", "--json", "--", name] for name in names]), strict=True):
        assert done.told(0) == ""
        result = name.removesuffix(".toml") + ".h5"
        assert done.json["output"] == result
        assert (folder / result).read_bytes() == (good / "tiny.h5").read_bytes()


def test_no_command_line_ends_in_a_traceback(good: Path, here: Path) -> None:
    result = (good / "tiny.h5").read_bytes()
    (here / "r.h5").write_bytes(result)
    generator = random.Random(11)
    words = [
        *(
            "run",
            "check",
            "new",
            "schema",
            "plot",
            "tiny.toml",
            "r.h5",
            "-",
            "--",
            "--json",
            "--quiet",
            "-q",
            "-h",
        ),
        *(
            "--force",
            "-o",
            "--output",
            "--set",
            "--version",
            "--help",
            "--no-such",
            "",
            " ",
            ".",
            "..",
            "/",
            "=",
            "é",
        ),
        *(
            "solver.duration=0.01",
            "solver.duration=",
            "a.b.c=1",
            "shoe=1",
            "shoe.mass=-1",
            "\udcff",
            "\x1b[31m",
            "%s",
        ),
        *(
            "title='x'",
            "out.h5",
            "missing.toml",
            "x" * 300,
            "-5",
            "~",
            "*",
            "${HOME}",
            "--set=",
            "-o=",
            "-oq",
            "\n",
        ),
    ]
    lines = [
        [generator.choice(words[:5]), *generator.choices(words, k=generator.randrange(5))] for _ in range(24)
    ] + [generator.choices(words, k=generator.randrange(4)) for _ in range(8)]
    codes = []
    for line, done in zip(lines, each(here, lines), strict=True):
        assert "Traceback" not in done.err, line
        assert done.code in (0, 1, 2, 3, 4, 74), line
        assert done.code == 0 or done.err, line
        codes.append(done.code)
    assert 0 in codes
    assert 2 in codes
    assert (here / "tiny.toml").read_text() == TINY
    assert not any(name.endswith((".part", ".lock")) for name in left_in(here))
