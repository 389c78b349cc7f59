"""Sweeps that go wrong: killed, interrupted, out of disk or memory, changed in between; and the same bytes."""

import errno
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import pytest

from brakecli.errors import CannotWriteError, RefusedError
from brakecli.files.read import open_result
from brakecli.sweeps.file import read_sweep
from brakecli.sweeps.workers.local import LocalEngine, Task, Work
from brakecli.sweeps.workers.task import work
from tests.commands import LIMIT, ROOT, TINY, Done, environment, left_in, warm_up
from tests.sweeps.helpers import (
    WICKED,
    alive,
    axis,
    broken,
    children,
    deadly,
    ended,
    frictions,
    hungry,
    inline,
    job_of,
    journal_size,
    local,
    run,
    slow,
    started,
    wait_until,
    workers,
    write_sweep,
)

QUICK = 2.0  # s, within which an interruption ends a command
GRID = (frictions(40), axis("link2.angle_deg", "values = [1.0, 3.0, 5.0]"))
SLOWER = TINY.replace("duration = 0.02", "duration = 0.6")  # 30 ms a point

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.fixture(scope="module")
def compiled() -> None:
    """Kernels."""
    warm_up()


@pytest.fixture(scope="module")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a sweep and its result, only to be read."""
    folder = tmp_path_factory.mktemp("good")
    write_sweep(folder, *GRID, case=SLOWER)
    run("sweep", "s.toml", "--quiet", cwd=folder).told(0)
    return folder


@pytest.fixture
def here(good: Path, tmp_path: Path) -> Path:
    """A directory with that sweep, without its result."""
    for name in ("tiny.toml", "s.toml"):
        shutil.copy(good / name, tmp_path)
    return tmp_path


def variable(path: Path, name: str) -> Any:
    with open_result(path, "sweep"), h5py.File(path) as file:
        return file[name][:]


# F1, F2, F3: killed processes


def test_a_sweep_killed_five_times_ends_with_the_bytes_of_an_undisturbed_one(good: Path, here: Path) -> None:
    chance = random.Random(1)
    size = 0
    for computing in (False, True, False, True, True):
        with started("sweep", "s.toml", "--quiet", "-j", "2", cwd=here) as process:
            wait_until(lambda process=process: workers(process.pid))  # type: ignore[misc]
            if computing:
                wait_until(lambda size=size: journal_size(here) > max(size, 1500))  # type: ignore[misc]
            time.sleep(chance.uniform(0.0, 0.25))
            crew = children(process.pid)
            assert process.poll() is None
            process.kill()
            # a worker that is being started notices once it has started
            wait_until(lambda crew=crew: not any(map(alive, crew)), seconds=1.0 if computing else LIMIT)  # type: ignore[misc]
        assert journal_size(here) >= size
        size = journal_size(here)
    last = run("sweep", "s.toml", cwd=here)
    assert re.search(r"120 points on . workers?: .*; [1-9]\d* of them are there already", last.told(0))
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


def test_workers_die_with_their_parent_whatever_they_are_in(tmp_path: Path) -> None:
    write_sweep(tmp_path, frictions(4))
    command = [sys.executable, "-m", "tests.sweeps.helpers", "stuck", str(tmp_path / "s.toml")]
    with subprocess.Popen(command, cwd=ROOT, env=environment()) as process:
        wait_until(lambda: len([*tmp_path.glob("*.computes")]) == 2)
        crew = children(process.pid)
        process.kill()
        wait_until(lambda: not any(map(alive, crew)), seconds=1.0)


def test_a_killed_worker_costs_a_warning_and_no_point(good: Path, here: Path) -> None:
    with started("sweep", "s.toml", "--quiet", "-j", "2", cwd=here) as process:
        wait_until(lambda: journal_size(here) > 2000)
        os.kill(min(workers(process.pid)), signal.SIGKILL)
        done = ended(process)
    told = done.told(0, "brakecli: warning: a worker process has ended before its time (its process was killed by")
    assert told.count("\n") == 1
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}


@pytest.mark.parametrize(
    ("wicked", "task_size", "reason"),
    [
        (deadly, 1, "killed by SIGKILL, as when memory runs out"),
        (deadly, 5, "killed by SIGKILL, as when memory runs out"),
        (hungry, 5, "it ran out of memory"),
        (broken, 5, "ZeroDivisionError: division by zero"),
    ],
)
def test_a_point_that_ends_its_worker_is_marked_and_all_others_are_computed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], wicked: Work, task_size: int, reason: str
) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    report = local(loaded, tmp_path / "s.h5", wicked, task_size=task_size)
    assert report.findings.failed == 1
    (failure,) = report.findings.failures
    assert failure["point"] == WICKED
    assert reason in failure["reason"]
    assert len(report.notes) == 1
    assert variable(tmp_path / "s.h5", "status").tolist() == [
        b"crashed" if point == WICKED else b"done" for point in range(20)
    ]
    frequency = variable(tmp_path / "s.h5", "frequency").tolist()
    assert frequency[:WICKED] + frequency[WICKED + 1 :] == [n for n in range(20) if n != WICKED]
    assert capfd.readouterr().err == ""


def test_workers_that_die_idle_cost_no_point(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(12))
    with LocalEngine(job_of(loaded), slow, 2) as engine:
        tasks = iter([Task(0, 1, True), Task(1, 9, True), None, Task(10, 1, True), Task(11, 1, True), *[None] * 9])
        killed: list[int] = []

        def supply() -> Task | None:
            if (task := next(tasks)) is None and not killed:
                (idle,) = (each.process for each in engine._pool if each.task is None)
                idle.kill()
                wait_until(lambda: not idle.is_alive())  # all of its threads
                killed.append(idle.pid or 0)
            return task

        found = list(engine.run(supply))
    assert killed
    assert sorted(each.task.first for each in found if each.task and each.records) == [0, 1, 10, 11]
    assert len(found) == 4


def test_a_point_without_memory_fails_with_the_reason_and_exit_code_1(tmp_path: Path) -> None:
    durations = axis("solver.duration", "values = [0.02, 100.0, 0.03]")
    write_sweep(tmp_path, durations, case=TINY.replace("sample_interval = 1e-4", "sample_interval = 1e-5"))
    command = f"ulimit -v 1200000; exec {sys.executable} -W error -m brakecli sweep s.toml --json -q -j 1"
    shell = subprocess.run(
        ["bash", "-c", command],
        cwd=tmp_path,
        capture_output=True,
        timeout=LIMIT,
        env=environment(OPENBLAS_NUM_THREADS="1"),
    )
    done = Done(shell.returncode, shell.stdout.decode(), shell.stderr.decode())
    done.told(1, "point 1 (solver.duration = 100.0): out of memory", "1 of 3 points failed")
    assert done.json["status"] == ["done", "failed", "done"]


# F4, F5: what cannot be written


def shell(line: str, cwd: Path) -> Done:
    command = line.replace("$B", f"exec {sys.executable} -W error -m brakecli")
    done = subprocess.run(["bash", "-c", command], cwd=cwd, capture_output=True, timeout=LIMIT, env=environment())
    return Done(done.returncode, done.stdout.decode(), done.stderr.decode())


def test_a_full_disk_ends_a_sweep_with_the_path_and_keeps_what_is_finished(good: Path, here: Path) -> None:
    whole = journal_bytes(here)
    kept = 0
    for limit, name in ((0, "s.h5"), (1, "s.h5"), (whole // 2048, "s.h5.partial")):
        done = shell(f"ulimit -f {limit}; $B sweep s.toml --quiet", here)
        told = done.told(74, f"{name}: cannot write: ", "free some space")
        assert told.count("\n") == 1
        assert left_in(here) <= {"tiny.toml", "s.toml", "s.h5.partial"}
        assert kept <= journal_size(here) <= limit * 1024
        kept = journal_size(here)
    assert kept > 0.4 * whole
    done = shell("$B sweep s.toml", here)  # there is room again
    assert "of them are there already" in done.told(0)
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}


def journal_bytes(folder: Path) -> int:
    """How large the journal of a sweep gets."""
    from brakecli.sweeps.driver import identity
    from brakecli.sweeps.point import record_type

    plan = read_sweep(str(folder / "s.toml")).plan
    return len(json.dumps(identity(plan))) + plan.points * record_type(plan).itemsize


SYSTEM_CALLS = {name: getattr(os, name) for name in ("write", "pwrite", "ftruncate", "fsync", "replace")}


def fail_at(number: int, partly: bool) -> Callable[[], int]:
    """Let the n-th system call that writes fail, and all that follow, as on a full disk; returns the count.

    `partly`: the n-th still takes half of what it is given, and only the next one fails.
    """
    count = 0

    def patched(name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            nonlocal count
            count += 1
            if count == number and partly and name == "write":
                return original(arguments[0], memoryview(arguments[1])[: max(1, len(arguments[1]) // 2)])
            if count >= number and name != "ftruncate":
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return original(*arguments)

        return call

    for name, original in SYSTEM_CALLS.items():
        setattr(os, name, patched(name, original))
    return lambda: count


def repair() -> None:
    for name, original in SYSTEM_CALLS.items():
        setattr(os, name, original)


def failing_write(folder: Path) -> list[str]:
    """Let each write of a sweep fail, the first, the second, …, every other one in part; then sweep again."""
    loaded, output = write_sweep(folder, frictions(6)), folder / "s.h5"
    inline(loaded, folder / "expected.h5", task_size=2)
    expected = (folder / "expected.h5").read_bytes()
    names = left_in(folder)
    outcomes, told = [], set()
    for number in range(1, 1000):
        output.write_text("old")
        count = fail_at(number, partly=number % 2 == 0)
        try:
            inline(loaded, output, task_size=2, force=True)
        except CannotWriteError as error:
            told.add(str(error).partition(": cannot write: no space left on device")[0])
            assert output.read_text() == "old"
            outcomes.append("old")
            repair()
            assert left_in(folder) - names <= {"s.h5", "s.h5.partial"}
            assert inline(loaded, output, task_size=2, force=True).resumed in (0, 2, 4, 6)
        else:
            outcomes.append("new")
        finally:
            repair()
        assert output.read_bytes() == expected
        assert left_in(folder) - names == {"s.h5"}
        if count() < number:
            assert str(output) in told
            assert told <= {str(output), f"{output}.partial"}
            return outcomes
    raise AssertionError


def test_whichever_write_fails_the_old_file_stays_and_the_journal_can_be_used(tmp_path: Path) -> None:
    outcomes = failing_write(tmp_path)
    assert outcomes.count("old") > 50
    # only the very last call may fail unnoticed: the one that makes the finished replacement last
    assert outcomes == ["old"] * (len(outcomes) - 2) + ["new", "new"]


def test_a_disk_that_takes_a_part_of_each_write_gets_all_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded = write_sweep(tmp_path, frictions(6))
    inline(loaded, tmp_path / "expected.h5")
    monkeypatch.setattr(os, "write", lambda file, data: SYSTEM_CALLS["write"](file, memoryview(data)[:333]))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", task_size=2, limit=2)
    assert inline(loaded, tmp_path / "s.h5").resumed == 4
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()


def test_a_block_that_could_not_be_written_leaves_a_journal_to_go_on_with(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(6))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", task_size=2, limit=1)
    before = journal_size(tmp_path)
    fail_at(4, partly=True)  # after those of the lock; the journal's own follows
    try:
        with pytest.raises(CannotWriteError):
            inline(loaded, tmp_path / "s.h5", task_size=2)
    finally:
        repair()
    assert journal_size(tmp_path) == before
    assert inline(loaded, tmp_path / "s.h5", task_size=2).resumed == 2


# F11: too large


@pytest.mark.parametrize(
    "tables",
    [
        [frictions(1_000_000_000)],
        [frictions(1_000_000_000, 'direction = "both"')],
        [
            axis(name, "start = 0.1", "stop = 1.0", "num = 1000")
            for name in ("friction.coefficient", "link2.angle_deg", "shoe.mass")
        ],
    ],
    ids=["one axis", "followed", "three axes"],
)
def test_a_sweep_of_a_billion_points_is_refused_at_once_with_its_size(tmp_path: Path, tables: list[str]) -> None:
    write_sweep(tmp_path, *tables)
    start = time.monotonic()
    with started("sweep", "s.toml", "-j", "2", cwd=tmp_path) as process:
        assert process.stderr is not None
        told = process.stderr.read().decode()
        process.wait()
    Done(process.returncode, "", told).told(
        3, "brakecli: the sweep is too large: 1000000000 points on 2 workers: about ", " MB of memory, a file of "
    )
    assert told.count("\n") == 1
    assert time.monotonic() - start < 5.0
    command = [sys.executable, "-W", "error", "-m", "tests.sweeps.helpers", "refused", str(tmp_path / "s.toml")]
    done = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, text=True, timeout=100)
    assert int(done.stdout) < 400_000_000  # bytes; one for each point would be more
    assert left_in(tmp_path) == {"tiny.toml", "s.toml"}


# F12: interruptions


@pytest.mark.parametrize(
    ("number", "group", "delays"),
    [
        (signal.SIGINT, True, (0.05, 0.3, 1.0)),
        (signal.SIGINT, False, (0.6,)),
        (signal.SIGTERM, True, (0.6,)),
        (signal.SIGTERM, False, (0.05, 1.0)),
    ],
)
def test_a_signal_ends_a_sweep_soon_and_in_one_sentence(
    here: Path, number: signal.Signals, group: bool, delays: Sequence[float]
) -> None:
    """A terminal sends Ctrl-C to all processes of a command, also while they are being started."""
    word = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}[number]
    for delay in delays:
        with started("sweep", "s.toml", "--quiet", "-j", "2", cwd=here) as process:
            wait_until(lambda process=process: workers(process.pid))  # type: ignore[misc]
            time.sleep(delay)
            crew = workers(process.pid)
            start = time.monotonic()
            assert process.poll() is None
            os.killpg(process.pid, number) if group else process.send_signal(number)
            done = ended(process)
            assert time.monotonic() - start < QUICK
        assert done.told(128 + number, f"brakecli: {word}").count("\n") == 1
        assert not any(map(alive, crew))
        assert left_in(here) <= {"tiny.toml", "s.toml", "s.h5.partial"}


def test_an_interrupted_sweep_is_resumed_by_the_same_command(good: Path, here: Path) -> None:
    with started("sweep", "s.toml", "-q", cwd=here) as process:
        wait_until(lambda: journal_size(here) > 5000)
        process.send_signal(signal.SIGINT)
        ended(process).told(130)
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5.partial"}
    done = run("sweep", "s.toml", "--json", cwd=here)
    resumed = done.json["resumed_points"]
    assert 5 < resumed < 120
    assert f"; {resumed} of them are there already" in done.told(0)
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


# F13, F23: rivals and changes


def test_a_second_sweep_into_the_same_output_is_refused_and_names_the_first(here: Path) -> None:
    with started("sweep", "s.toml", "-q", cwd=here) as first:
        wait_until(lambda: journal_size(here) > 2000)
        first.send_signal(signal.SIGSTOP)  # or it might be finished before the second has looked
        second = run("sweep", "s.toml", "-q", "--force", cwd=here)
        second.told(2, f"s.h5: is being written by process {first.pid} on {socket.gethostname()}; wait until")
        assert first.poll() is None
        first.send_signal(signal.SIGTERM)
        first.send_signal(signal.SIGCONT)
        ended(first).told(143)


def edited(path: Path, old: str, new: str) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        text = (folder / path).read_bytes()
        assert text.count(old.encode()) == 1
        (folder / path).write_bytes(text.replace(old.encode(), new.encode()))

    return edit


@pytest.mark.parametrize(
    ("edit", "difference"),
    [
        (edited(Path("tiny.toml"), "mass = 10.0", "mass = 11.0"), "shoe.mass was 10.0, is 11.0"),
        (edited(Path("tiny.toml"), "damping = 300.0, ", ""), "link2.damping was 300.0, is not set"),
        (edited(Path("s.toml"), "num = 20", "num = 21"), "sweep axis[0].num was 20, is 21"),
        (
            edited(Path("s.h5.partial"), '"brakecli_version": "', '"brakecli_version": "7'),
            "brakecli_version was 7",
        ),
        (edited(Path("s.h5.partial"), '"numpy_version": "', '"numpy_version": "7'), "numpy_version was 7"),
        (
            edited(Path("s.h5.partial"), '{"brakecli_version', '[{"brakecli_version'),
            "holds no finished points",
        ),
    ],
    ids=["case", "default", "sweep", "version", "library", "foreign"],
)
def test_finished_points_of_another_sweep_are_refused_and_the_key_named(
    tmp_path: Path, edit: Callable[[Path], None], difference: str
) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", work, limit=4, task_size=3)
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5.partial"}
    edit(tmp_path)
    before = (tmp_path / "s.h5.partial").read_bytes()
    with pytest.raises(RefusedError, match=r"s\.h5\.partial: holds .* start anew with --force") as refused:
        inline(read_sweep(str(tmp_path / "s.toml")), tmp_path / "s.h5", work)
    assert refused.value.exit_code == 3
    assert difference in str(refused.value)
    assert (tmp_path / "s.h5.partial").read_bytes() == before
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5.partial"}
    assert inline(read_sweep(str(tmp_path / "s.toml")), tmp_path / "s.h5", work, force=True).resumed == 0
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5"}


def test_the_command_names_the_key_that_has_changed_and_starts_anew_with_force(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", work, limit=4, task_size=3)
    command = ["sweep", "s.toml", "--set", "friction.coefficient=0.5", "--set", "shoe.mass=11.0", "-j", "1"]
    refused = run(*command, cwd=tmp_path).told(3, "s.h5.partial: holds finished points of another sweep: ")
    assert "friction.coefficient was 0.6, is 0.5" in refused
    assert "shoe.mass was 10.0, is 11.0" in refused
    assert refused.count("\n") == 1
    anew = run(*command, "--force", "--json", cwd=tmp_path)
    anew.told(0)
    assert anew.json["resumed_points"] == 0
    assert left_in(tmp_path) == {"tiny.toml", "s.toml", "s.h5"}


def test_a_journal_of_the_same_sweep_is_taken_up(tmp_path: Path) -> None:
    """The control of the refusals above: without a change the very same journal is used."""
    loaded = write_sweep(tmp_path, frictions(20))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", work, limit=4, task_size=3)
    done = run("sweep", "s.toml", "--json", "-j", "1", cwd=tmp_path)
    assert done.told(0).endswith("; 12 of them are there already\n")
    assert done.json["resumed_points"] == 12


@pytest.mark.parametrize("cut", [1, 5, 400])
def test_a_journal_that_ends_within_a_block_loses_that_block_alone(tmp_path: Path, cut: int) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    with pytest.raises(KeyboardInterrupt):
        inline(loaded, tmp_path / "s.h5", limit=4, task_size=1)
    path = tmp_path / "s.h5.partial"
    path.write_bytes(path.read_bytes()[:-cut])
    assert inline(loaded, tmp_path / "s.h5").resumed == 3


def test_damaged_records_of_a_journal_are_computed_again(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    inline(loaded, tmp_path / "expected.h5")
    chance = random.Random(3)
    resumed = []
    for _ in range(20):
        with pytest.raises(KeyboardInterrupt):
            inline(loaded, tmp_path / "s.h5", limit=4, task_size=1)
        path = tmp_path / "s.h5.partial"
        data = bytearray(path.read_bytes())
        begin = data.index(b"\n") + 1
        data[chance.randrange(begin, len(data))] ^= 1 << chance.randrange(8)
        path.write_bytes(data)
        resumed.append(inline(loaded, tmp_path / "s.h5").resumed)
        assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()
        (tmp_path / "s.h5").unlink()
    assert set(resumed) == {0, 1, 2, 3}


# F24: the same bytes


SWEEPS = {
    "grid": (frictions(11), axis("link2.angle_deg", "values = [1.0, 5.0, 9.0]")),
    "followed": (frictions(5, 'direction = "both"'), axis("link2.angle_deg", "values = [1.0, 5.0, 9.0]")),
    "critical": (
        axis("link2.angle_deg", "start = 1.0", "stop = 9.0", "num = 4"),
        '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\nmethod = "eigenvalue"\n',
    ),
}


@pytest.mark.parametrize("name", SWEEPS)
def test_no_way_of_computing_a_sweep_changes_a_byte(tmp_path: Path, name: str) -> None:
    loaded = write_sweep(tmp_path, *SWEEPS[name])
    inline(loaded, tmp_path / "s.h5", work)
    expected = (tmp_path / "s.h5").read_bytes()

    def same() -> None:
        assert (tmp_path / "s.h5").read_bytes() == expected
        (tmp_path / "s.h5").unlink()
        assert left_in(tmp_path) == {"tiny.toml", "s.toml"}

    same()
    for size, order in ((1, 1), (7, 1), (1000, 1), (1, -1), (7, -1)):
        inline(loaded, tmp_path / "s.h5", work, task_size=size, order=order)
        same()
    for size, order in ((1, 1), (2, -1)):  # with an interruption in the middle
        with pytest.raises(KeyboardInterrupt):
            inline(loaded, tmp_path / "s.h5", work, task_size=size, order=order, limit=1)
        assert inline(loaded, tmp_path / "s.h5", work, task_size=size + 1, order=-order).resumed > 0
        same()
    local(loaded, tmp_path / "s.h5", work, 2, task_size=1)
    same()
    if name == "grid":
        local(loaded, tmp_path / "s.h5", work, 1, task_size=7, order=-1)
        same()
        run("sweep", "s.toml", "-q", "-j", "2", "--task-size", "1000", cwd=tmp_path).told(0)
        same()


def test_a_critical_value_by_simulation_does_not_depend_on_the_workers(tmp_path: Path) -> None:
    angles = axis("link2.angle_deg", "values = [3.0, 8.0]")
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\ntolerance = 0.1\n'
    loaded = write_sweep(tmp_path, angles, search)
    inline(loaded, tmp_path / "one.h5", work)
    local(loaded, tmp_path / "two.h5", work, task_size=1)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


# F25: size


def memory_of(folder: Path, points: int) -> dict[str, Any]:
    """The largest memory of a sweep of the shortest runs, in bytes, of its parent and of its workers."""
    shortest = TINY.replace("step = 1e-5, duration = 0.02", "step = 1e-4, duration = 1e-4")
    write_sweep(folder, frictions(points), case=shortest)
    (folder / "s.h5").unlink(missing_ok=True)
    command = [sys.executable, "-W", "error", "-m", "tests.sweeps.helpers", "memory", str(folder / "s.toml")]
    done = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    assert found["failed"] == 0
    assert found["points"] == points
    return found


POINT_BYTES = 1000
"""What a point may cost the parent: of each variable all values are there at a time, and the widest are texts of
240 bytes, once as stored and once as characters of four bytes each; 660 bytes were measured."""
WORKER_MARGIN = 10_000_000
"""Bytes; a worker knows of one task at a time, and what it needs besides depends on how memory was handed out."""


@pytest.mark.slow
def test_a_hundred_thousand_points_need_no_more_memory_than_a_thousand(tmp_path: Path) -> None:
    few, many = memory_of(tmp_path, 1000), memory_of(tmp_path, 100_000)
    assert many["parent"] < few["parent"] + POINT_BYTES * 99_000
    assert many["workers"] < few["workers"] + WORKER_MARGIN
