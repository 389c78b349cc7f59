"""Result files that go wrong: full disks, failed writes, interruptions, rivals, damage; and never half a file."""

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
from pathlib import Path
from types import FrameType
from typing import Any

import h5py
import numpy as np
import pytest

from brakecli.errors import CannotWriteError, UnreadableResultError, UsageError
from brakecli.files.fields import Field
from brakecli.files.read import open_result
from brakecli.files.write import ResultFile, new_result

ROWS = 40000


def fill(result: ResultFile, rows: int = ROWS) -> None:
    result.set_attributes({"kind": "run", "case_toml": 'title = "Größe"\n' * 50})
    result.axis("history", Field("time", "s", "time"))
    result.variable("history", Field("state", "1", "state of the pad", "i1"), ["time"])
    for start in range(0, rows, 10000):
        time = np.arange(start, min(rows, start + 10000)) * 1e-5
        result.append("history", {"time": time, "state": np.full(time.shape, -1)})
        result.read("history", "time", 0, 5)
    result.axis("spectrum", Field("frequency", "Hz", "frequency"), np.arange(50.0))
    result.variable("spectrum", Field("vx", "m²/s", "density of vx"), ["frequency"], np.arange(50.0) ** 2)


def write(path: Path, rows: int = ROWS) -> None:
    with new_result(path, force=True) as result:
        fill(result, rows)
        result.commit()


def read_all(path: Path) -> dict[str, Any]:
    with open_result(path, "run") as result:
        everything: dict[str, Any] = {"": str(result.attributes)}
        for group in result.groups():
            for name, variable in result.variables(group).items():
                everything[f"{group}/{name}"] = str(variable), result.read(group, name).tobytes()
        return everything


def in_a_process(action: str, path: Path) -> subprocess.CompletedProcess[str]:
    """Run a function of this file where a crash or a hang is seen, and does not take the tests along."""
    command = [sys.executable, "-W", "error", __file__, action, str(path)]
    done = subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


# what cannot be written


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
    assert str(caught.value).startswith(f"{path}: ")
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
    in_a_process("full_disk", tmp_path / "r.h5")


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
    in_a_process("failing_write", tmp_path / "r.h5")


# interruptions


def terminate(_number: int, _frame: FrameType | None) -> None:
    raise SystemExit(143)


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
            assert {entry.name for entry in path.parent.iterdir()} <= {path.name}
            if path.exists():
                read_all(path)
        assert stopped > 20
    assert signal.getsignal(signal.SIGTERM) is terminate


def test_an_interruption_inside_hdf5_leaves_nothing_or_the_whole_file(tmp_path: Path) -> None:
    in_a_process("interrupted", tmp_path / "r.h5")


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
        assert {entry.name for entry in path.parent.iterdir()} <= {path.name}
        if path.exists():
            read_all(path)
    assert stopped == 50


def test_an_interruption_at_any_time_leaves_nothing_or_the_whole_file(tmp_path: Path) -> None:
    in_a_process("interrupted_at_random", tmp_path / "r.h5")


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, RuntimeError, OSError])
def test_an_exception_of_the_caller_passes_and_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    def fail() -> None:
        with new_result(tmp_path / "r.h5", force=False) as result:
            fill(result)
            raise error

    with pytest.raises(error):
        fail()
    assert list(tmp_path.iterdir()) == []


# rivals


def hold(path: Path) -> None:
    with new_result(path, force=True) as result:
        fill(result)
        print("ready", flush=True)  # noqa: T201
        sys.stdin.read()


def test_a_live_rival_is_named_and_a_killed_one_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    command = [sys.executable, __file__, "hold", str(path)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, cwd=Path(__file__).parents[2], text=True, **pipes) as rival:  # type: ignore[call-overload]
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
    threads_failed: list[BaseException] = []

    def run() -> None:
        try:
            in_a_process("compete", tmp_path / "r.h5")
        except BaseException as error:
            threads_failed.append(error)

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not threads_failed
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


# damage


def mutate(data: bytes, chance: random.Random) -> bytes:
    """One flipped bit, or up to 4 KiB of noise, zeros or nothing at all in the place of what was there."""
    start = chance.randrange(len(data))
    length = min(chance.choice([1, 4, 64, 512, 4096]), len(data) - start)
    middle = chance.choice(
        [
            bytes([data[start] ^ 1 << chance.randrange(8)]) + data[start + 1 : start + length],
            chance.randbytes(length),
            bytes(length),
            b"",
        ]
    )
    return data[:start] + middle + data[start + length :]


def damaged(path: Path) -> None:
    refused = 0  # the rest were read, and exactly: zeros written over zeros do no damage
    for rows in (100, ROWS):
        write(path, rows)
        good, expected = path.read_bytes(), read_all(path)
        chance = random.Random(rows)
        variants = [mutate(good, chance) for _ in range(600)]
        variants += [good[: len(good) * part // 50] for part in range(50)]
        variants += [good[:-length] for length in range(1, 32)]
        variants += [good + b"\0", good + good]
        for variant in variants:
            path.write_bytes(variant)
            try:
                assert read_all(path) == expected
            except UnreadableResultError:
                refused += 1
    assert refused > 1000


def test_a_damaged_file_is_refused_or_read_exactly(tmp_path: Path) -> None:
    in_a_process("damaged", tmp_path / "r.h5")


def edit(change: Callable[[h5py.File], object]) -> Callable[[Path], object]:
    def on_file(path: Path) -> None:
        write(path, 100)
        with h5py.File(path, "r+") as file:
            change(file)

    return on_file


def foreign(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["x"] = [1.0, 2.0]


def foreign_of_our_kind(path: Path) -> None:
    with h5py.File(path, "w", libver=("v108", "v108")) as file:
        file["x"] = [1.0, 2.0]


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "not a regular file"),
        (os.mkfifo, "not a regular file"),
        (lambda path: path.touch(), "the file is empty"),
        (lambda path: path.write_text("time,vx\n0,1\n"), "not an HDF5 file"),
        (foreign, "not written by this program"),
        (foreign_of_our_kind, "not written by this program"),
        (edit(lambda file: file.attrs.modify("format", "other")), "not written by this program"),
        (edit(lambda file: file.attrs.modify("format_version", 2)), "format version is 2, and only version 1"),
        (edit(lambda file: file.attrs.modify("complete", 0)), "incomplete"),
        (edit(lambda file: file.attrs.pop("complete")), "incomplete"),
        (edit(lambda file: file.attrs.modify("kind", "sweep")), "kind 'sweep', and 'run' is needed"),
        (edit(lambda file: file["history/time"].write_direct(np.full(100, np.nan))), "not finite"),
        (edit(lambda file: file["history"].__delitem__("time")), "no variable time"),
        (edit(lambda file: file.__delitem__("history")), "no group history"),
    ],
)
def test_a_file_that_is_no_result_is_refused_with_the_reason(
    tmp_path: Path, make: Callable[[Path], object], reason: str
) -> None:
    path = tmp_path / "r.h5"
    make(path)
    with pytest.raises(UnreadableResultError, match=f"(?i){reason}") as caught, open_result(path, "run") as result:
        result.read("history", "time")
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("name", ["nul\0", "x" * 300])
def test_a_name_that_cannot_exist_is_an_unreadable_result(tmp_path: Path, name: str) -> None:
    with pytest.raises(UnreadableResultError), open_result(tmp_path / name):
        raise AssertionError


def test_an_exception_while_reading_is_the_callers_own(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", 10)
    with pytest.raises(ZeroDivisionError), open_result(tmp_path / "r.h5"):
        raise ZeroDivisionError


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
    in_a_process("memory", tmp_path / "r.h5")


if __name__ == "__main__":
    globals()[sys.argv[1]](Path(sys.argv[2]))
