"""Runs that are interrupted, or started twice."""

import random
import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest

from tests.campaign import campaign, counts
from tests.commands import (
    COMMAND,
    LIMIT,
    LONG,
    TINY,
    brakecli,
    environment,
    left_in,
    signalled,
    started,
    wait_until,
)

pytestmark = pytest.mark.usefixtures("compiled")


def listens(process: subprocess.Popen[bytes]) -> bool:
    """Whether the command has handlers of its own; before, Python's hears SIGINT, and nothing the others."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = int(next(line for line in status.splitlines() if line.startswith("SigCgt")).split()[1], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def interrupt(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to a command that has minutes to go; it ends soon, with its code and one sentence."""
    wait_until(lambda: listens(process))
    done = signalled(process, number)
    word = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}[number]
    assert done.told(128 + number, f"brakecli: {word}").count("\n") == 1
    assert done.out == ""


@pytest.mark.parametrize(
    ("number", "delay"),
    [
        (signal.SIGINT, 0.0),
        pytest.param(signal.SIGTERM, 0.0, marks=campaign),
        pytest.param(signal.SIGHUP, 0.2, marks=campaign),
        pytest.param(signal.SIGINT, 0.5, marks=campaign),
        pytest.param(signal.SIGTERM, 0.5, marks=campaign),
    ],
)
def test_a_signal_ends_a_run_in_the_loop_and_leaves_nothing(
    here: Path, number: signal.Signals, delay: float
) -> None:
    with started("run", "tiny.toml", *LONG, cwd=here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        time.sleep(delay)
        interrupt(process, number)
    assert left_in(here) == {"tiny.toml"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_reading_of_a_case(here: Path, number: signal.Signals) -> None:
    with started("run", "-", cwd=here, stdin=subprocess.PIPE) as process:
        time.sleep(0.7)  # it waits for its case
        interrupt(process, number)
    assert left_in(here) == {"tiny.toml"}


def test_a_signal_ends_the_imports_without_a_traceback(here: Path) -> None:
    command = [COMMAND[0], "-X", "importtime", *COMMAND[1:], "run", "tiny.toml"]
    for module in (b"typer.main", b"pydantic.types", b"h5py", b"numba.core.types"):
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


@campaign
def test_a_signal_ends_a_run_of_slow_steps(here: Path) -> None:
    waves = "roughness.wheel={amplitudes=[1e-6, 1e-6], wavelengths=[0.02, 0.01]}"
    slow = ["--set", "contact.nodes=2000000", "--set", "contact.evaluator='midpoint'", "--set", waves]
    with started("run", "tiny.toml", *slow, cwd=here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        time.sleep(1.0)  # for the tables of the contact
        interrupt(process, signal.SIGINT)
    assert left_in(here) == {"tiny.toml"}


def many_waves(count: int) -> str:
    """A case on an open pad, whose run takes minutes with 300 waves, and hours with 3000."""
    waves = [round(0.03 * 0.1 ** (i / count), 9) for i in range(count)]
    rough = f"\n[roughness.wheel]\namplitudes = {[round(6e-5 / count, 12)] * count}\nwavelengths = {waves}\n"
    solver = 'scheme = "event-driven", tolerance = 1e-6, duration = 0.1'
    case = TINY.replace("step = 1e-5, duration = 0.02", solver)
    return case.replace("load.force = 5000.0", "load.force = 200.0") + rough


@pytest.mark.parametrize(
    ("count", "number"),
    [
        (300, signal.SIGINT),
        (3000, signal.SIGTERM),
        (300, signal.SIGTERM),
        (3000, signal.SIGINT),
    ],
)
@campaign
def test_a_signal_ends_steps_that_find_the_patches_of_many_waves(
    here: Path, count: int, number: signal.Signals
) -> None:
    (here / "tiny.toml").write_text(many_waves(count))
    with started("run", "tiny.toml", cwd=here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        time.sleep(1.0 if count < 1000 else 3.0)  # for the tables of the contact
        interrupt(process, number)
    assert left_in(here) == {"tiny.toml"}


@campaign
@pytest.mark.parametrize(
    ("command", "surface", "wavelength", "height", "delay"),
    [
        ("stability", "wheel", 1.8e-5, 0.1, 5.0),
        ("run", "shoe", 4e-8, 1e-6, 5.0),
        ("run", "wheel", 4e-8, 1e-6, 10.0),
    ],
)
def test_a_signal_ends_a_search_for_the_patches_of_millions_of_waves(
    here: Path, command: str, surface: str, wavelength: float, height: float, delay: float
) -> None:
    solver = "tolerance = 1e-4, duration = 1e-3"
    rough = f"[roughness.{surface}]\namplitudes = [{height}]\nwavelengths = [{wavelength}]\n"
    (here / "tiny.toml").write_text(TINY.replace("step = 1e-5, duration = 0.02", solver) + rough)
    with started(command, "tiny.toml", "--quiet", cwd=here) as process:
        time.sleep(delay)
        interrupt(process, signal.SIGTERM)
    assert left_in(here) == {"tiny.toml"}


@campaign
@pytest.mark.parametrize(
    ("count", "command"), [(300, "run"), (7800, "stability"), (300, "compare-schemes"), (7800, "sweep")]
)
def test_a_signal_ends_every_long_command_on_many_waves_at_any_time(here: Path, command: str, count: int) -> None:
    """In their imports and later."""
    if (command, count) == ("stability", 7800):
        count = 5000  # more waves are refused, for they would take hours
    (here / "tiny.toml").write_text(many_waves(count))
    axis = '[[axis]]\nparameter = "load.force"\nvalues = [200.0, 250.0]\n'
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\n'
    (here / "map.toml").write_text(f'case = "tiny.toml"\n{axis}{search}')
    file = "map.toml" if command == "sweep" else "tiny.toml"
    for number, delay in ((signal.SIGINT, 1.5), (signal.SIGTERM, 6.0)):
        with started(command, file, "--quiet", cwd=here) as process:
            time.sleep(delay)
            interrupt(process, number)
        assert left_in(here) <= {"tiny.toml", "map.toml", "map.h5.partial"}


@campaign
def test_more_waves_than_memory_are_refused_by_every_command(here: Path) -> None:
    (here / "tiny.toml").write_text(many_waves(16000))
    for command in ("run", "check", "stability"):
        said = brakecli(command, "tiny.toml", cwd=here).told(3, "4.1 GB of memory", "number of waves in roughness")
        assert said.count("16000 waves") == 1


@campaign
def test_a_second_ctrl_c_ends_with_the_same_code(here: Path) -> None:
    with started("run", "tiny.toml", *LONG, cwd=here) as process:
        wait_until((here / ".tiny.h5.part").exists)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=LIMIT)
    assert (process.returncode, err) == (130, b"brakecli: interrupted; nothing unfinished was left behind\n")
    assert left_in(here) == {"tiny.toml"}


@pytest.mark.parametrize("times", counts(0, 4))
def test_an_interruption_at_any_time_of_a_short_run_leaves_nothing_or_the_result(
    good: Path, here: Path, times: int
) -> None:
    generator = random.Random(5)
    outcomes: set[int] = set()
    # A run may end before the signal comes: at once is tried until a signal comes first.
    for delay in [*(generator.uniform(0.0, 0.12) for _ in range(times)), *[0.0] * 20]:
        if delay == 0.0 and 130 in outcomes:
            break
        (here / "tiny.h5").unlink(missing_ok=True)
        with started("run", "tiny.toml", "-q", cwd=here) as process:
            wait_until(lambda: (here / ".tiny.h5.part").exists() or (here / "tiny.h5").exists())
            time.sleep(delay)
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


def test_a_second_writer_is_refused_and_names_the_first_whose_lock_ends_with_it(good: Path, here: Path) -> None:
    with started("run", "tiny.toml", *LONG, cwd=here) as first:
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
