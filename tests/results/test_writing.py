"""Results that cannot be written, are interrupted or have a rival: the old file or the new one, never a half."""

import errno
import fcntl
import os
import random
import re
import resource
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from brakecli.errors import CannotWriteError, UsageError, escaped
from brakecli.results.field import Field
from brakecli.results.write import new_result
from tests.campaign import campaign
from tests.commands import ROOT
from tests.results.results import command_of, fill, in_a_process, read_all, write


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("missing/r.h5", "the directory .*/missing does not exist; create it"),
        ("file/r.h5", "the directory .*/file does not exist"),
        ("folder", "this is a directory"),
        (".", "this is a directory"),
        ("x" * 300, "file name too long"),
        ("x" * 253, "file name too long"),
        ("nul\0.h5", "null"),
        ("loop", "symbolic link"),
        ("/proc/r.h5", "no such file"),
        ("/dev/null", "not a regular file"),
        ("/dev/full", "not a regular file"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_at_once(tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = set(tmp_path.iterdir())
    path = tmp_path / name
    with pytest.raises(CannotWriteError, match=reason) as caught, new_result(path, force=True):
        raise AssertionError
    assert str(caught.value).startswith(f"{escaped(str(path))}: ")
    assert "-o" in str(caught.value)
    assert set(tmp_path.iterdir()) == before


def test_a_deleted_working_directory_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(CannotWriteError, match=r"^r\.h5: cannot write"), new_result(Path("r.h5"), force=False):
        raise AssertionError


def write_for_ever(path: Path, appended: list[int]) -> None:
    with new_result(path, force=True) as result:
        result.axis("history", Field("time", "s", "time"))
        while True:
            result.append("history", {"time": np.ones(10000)})
            appended.append(80000)


def full_disk(path: Path) -> None:
    """The limit on the length of a file fails writes as a full disk does, and needs no rights and no mount."""
    write(path, 100)
    old = path.read_bytes()
    for limit in range(0, 700_000, 23_456):
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
        appended: list[int] = []
        with pytest.raises(
            CannotWriteError, match=re.escape(f"{path}: cannot write: file too large; free some space")
        ):
            write_for_ever(path, appended)
        assert sum(appended) < limit + 300_000, "went on for long after the disk was full"
        assert path.read_bytes() == old
        assert [entry.name for entry in path.parent.iterdir()] == [path.name]
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    write(path)
    read_all(path)


def test_a_full_disk_ends_the_run_soon_and_leaves_the_old_file(tmp_path: Path) -> None:
    in_a_process(full_disk, tmp_path / "r.h5")


def call_after(number: int, action: Callable[[], None]) -> Callable[[], int]:
    """Replace the system calls of writing by ones of which the n-th performs `action` first; returns the count."""
    count = 0

    def patched(original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            nonlocal count
            count += 1
            if count == number:
                action()
            return original(*arguments)

        return call

    for name, original in SYSTEM_CALLS.items():
        setattr(os, name, patched(original))
    return lambda: count


SYSTEM_CALLS = {name: getattr(os, name) for name in ("write", "pwrite", "ftruncate", "fsync", "replace")}


def no_space() -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def failing_write(path: Path) -> None:
    write(path)
    expected = read_all(path)
    outcomes = []
    for number in range(1, 1000):
        path.write_text("old")
        count = call_after(number, no_space)
        try:
            write(path)
        except CannotWriteError:
            assert path.read_text() == "old"
            outcomes.append("old")
        else:
            assert read_all(path) == expected
            outcomes.append("new")
        assert [entry.name for entry in path.parent.iterdir()] == [path.name]
        if count() < number:
            break
    # only the very last call may fail unnoticed: the one that makes the finished replacement last
    assert len(outcomes) > 20
    assert outcomes == ["old"] * (len(outcomes) - 2) + ["new", "new"]


def test_whichever_write_fails_there_is_the_old_file_or_the_new_one(tmp_path: Path) -> None:
    in_a_process(failing_write, tmp_path / "r.h5")


# interruptions and rivals


def terminate(_number: int, _frame: FrameType | None) -> None:
    raise SystemExit(143)


def nothing_or_whole(path: Path) -> None:
    assert {entry.name for entry in path.parent.iterdir()} <= {path.name}
    if path.exists():
        read_all(path)


def interrupted(path: Path) -> None:
    signal.signal(signal.SIGTERM, terminate)
    for sent, raised in ((signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)):
        stopped = 0
        for number in range(1, 1000):
            path.unlink(missing_ok=True)
            count = call_after(number, lambda sent=sent: signal.raise_signal(sent))  # type: ignore[misc]
            try:
                write(path)
            except raised:
                stopped += 1
            if count() < number:
                break
            nothing_or_whole(path)
        assert stopped > 20
    assert signal.getsignal(signal.SIGTERM) is terminate


@campaign
def test_an_interruption_inside_hdf5_leaves_nothing_or_the_whole_file(tmp_path: Path) -> None:
    in_a_process(interrupted, tmp_path / "r.h5")


def interrupted_at_random(path: Path) -> None:
    signal.signal(signal.SIGTERM, terminate)
    chance = random.Random(1)
    stopped = 0
    for _ in range(50):
        path.unlink(missing_ok=True)
        timer = threading.Timer(chance.uniform(0, 0.05), os.kill, (os.getpid(), signal.SIGTERM))
        try:
            timer.start()
            write(path)
            timer.join()
        except SystemExit:
            stopped += 1
        timer.join()
        nothing_or_whole(path)
    assert stopped == 50


@campaign
def test_an_interruption_at_any_time_leaves_nothing_or_the_whole_file(tmp_path: Path) -> None:
    in_a_process(interrupted_at_random, tmp_path / "r.h5")


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, RuntimeError, OSError])
def test_an_exception_of_the_caller_passes_and_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    def fail() -> None:
        with new_result(tmp_path / "r.h5", force=False) as result:
            fill(result)
            raise error

    with pytest.raises(error):
        fail()
    assert list(tmp_path.iterdir()) == []


def hold(path: Path) -> None:
    with new_result(path, force=True) as result:
        fill(result)
        print("ready", flush=True)  # noqa: T201
        sys.stdin.read()


def test_a_live_rival_is_named_and_a_killed_one_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    command = command_of(hold, path)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, cwd=ROOT, text=True, **pipes) as rival:  # type: ignore[call-overload]
        assert rival.stdout.readline() == "ready\n"
        for force in (False, True):
            holder = re.escape(f"process {rival.pid} on {socket.gethostname()}")
            with pytest.raises(UsageError, match=holder), new_result(path, force=force):
                raise AssertionError
        rival.kill()
    assert {entry.name for entry in tmp_path.iterdir()} == {".r.h5.lock", ".r.h5.part"}
    write(path)
    read_all(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["r.h5"]


def compete(path: Path) -> None:
    """Count how often this process was the only writer; fail if it ever was not."""
    written = 0
    while written < 40:
        try:
            with new_result(path, force=True):
                inside = os.open(f"{path}.inside", os.O_CREAT | os.O_EXCL)
                os.close(inside)
                Path(f"{path}.inside").unlink()
                written += 1
        except UsageError:
            pass


def test_of_many_rivals_only_one_writes_at_a_time(tmp_path: Path) -> None:
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(in_a_process, [compete] * 4, [tmp_path / "r.h5"] * 4))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("holder", "free"),
    [
        ("", True),
        ("process 4194999 on {host}", True),  # above the largest process number of Linux
        ("process 99999999999999999999 on {host}", True),
        ("process 1 on {host}", False),
        ("process 4194999 on elsewhere", False),
    ],
)
def test_without_file_locks_the_process_named_in_the_lock_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, holder: str, free: bool
) -> None:
    monkeypatch.setattr(fcntl, "flock", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOLCK, "no locks")))
    lock = tmp_path / ".r.h5.lock"
    lock.write_text(holder.format(host=socket.gethostname()))
    if free:
        write(tmp_path / "r.h5")
        assert [entry.name for entry in tmp_path.iterdir()] == ["r.h5"]
    else:
        with pytest.raises(UsageError, match="is being written by process"):
            write(tmp_path / "r.h5")
        assert [entry.name for entry in tmp_path.iterdir()] == [".r.h5.lock"]


@pytest.mark.parametrize("name", [".r.h5.lock", ".r.h5.part"])
@pytest.mark.parametrize("kind", ["text", "pipe", "directory", "link", "dangling", "second name"])
def test_what_this_program_has_not_written_is_named_and_left_alone(tmp_path: Path, name: str, kind: str) -> None:
    precious = tmp_path / "precious"
    place = tmp_path / name
    precious.write_text("kept")
    make: dict[str, Callable[[], object]] = {
        "text": lambda: place.write_text("kept"),
        "pipe": lambda: os.mkfifo(place),
        "directory": place.mkdir,
        "link": lambda: place.symlink_to(precious),
        "dangling": lambda: place.symlink_to(tmp_path / "nowhere"),
        "second name": lambda: place.hardlink_to(precious),
    }
    make[kind]()
    before = place.lstat()
    with pytest.raises(CannotWriteError, match=re.escape(f"{place}: is in the way")):
        write(tmp_path / "r.h5")
    assert (place.lstat().st_ino, place.lstat().st_mode, place.lstat().st_size) == (
        *(before.st_ino, before.st_mode, before.st_size),
    )
    assert precious.read_text() == "kept"
    assert {entry.name for entry in tmp_path.iterdir()} == {"precious", name}


def memory(path: Path) -> None:
    peaks = []
    for rows in (200_000, 5_000_000):
        with new_result(path, force=True) as result:
            result.axis("history", Field("time", "s", "time"))
            for start in range(0, rows, 10_000):
                result.append("history", {"time": np.arange(start, start + 10_000)})
            result.commit()
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    assert peaks[1] < peaks[0] + 4096, peaks  # KiB; the file has 40 MB


def test_memory_does_not_grow_with_the_number_of_rows(tmp_path: Path) -> None:
    in_a_process(memory, tmp_path / "r.h5")


if __name__ == "__main__":
    globals()[sys.argv[1]](Path(sys.argv[2]))
