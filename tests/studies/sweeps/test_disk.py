"""Sweeps that cannot write keep what is finished, and leave nothing else behind."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from brakecli.api.inputs import load_sweep
from brakecli.errors import CannotWriteError
from brakecli.studies.sweeps.journal import identity
from tests.campaign import campaign
from tests.commands import brakecli, left_in, shell
from tests.studies.sweeps.helpers import frictions, inline, interrupted, journal_size, write_sweep


def journal_bytes(folder: Path) -> int:
    """How large the journal of a sweep gets, at least: some 100 bytes of a packed point are numbers."""
    plan = load_sweep(str(folder / "s.toml"), None).plan
    return len(json.dumps(identity(plan))) + 100 * plan.points


@campaign
def test_a_full_disk_ends_a_sweep_with_the_path_and_keeps_what_is_finished(good: Path, here: Path) -> None:
    whole = journal_bytes(here)
    kept = 0
    for limit, name in ((0, "s.h5"), (1, "s.h5"), (whole // 2048, "s.h5.partial")):
        cut = f"export PYTHONDONTWRITEBYTECODE=1; ulimit -f {limit}"  # which would cut compiled sources, too
        done = shell(f"{cut}; $B sweep s.toml --quiet --task-size 1 -j 1", here)
        told = done.told(74, f"{name}: cannot write: ", "free some space")
        assert told.count("\n") == 1
        assert left_in(here) <= {"tiny.toml", "s.toml", "s.h5.partial"}
        assert kept <= journal_size(here) <= limit * 1024
        kept = journal_size(here)
    assert kept > 0.4 * whole
    done = brakecli("sweep", "s.toml", "-j", "1", cwd=here)  # there is room again
    assert "of them are there already" in done.told(0)
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}


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
    """Let each write of a sweep fail, every other one in part; then sweep again."""
    loaded = write_sweep(folder, frictions(6))
    output = folder / "s.h5"
    output.write_text("old")
    count = fail_at(10**9, partly=False)
    inline(loaded, output, task_size=2, force=True)
    repair()
    output.unlink()
    writes = count()
    inline(loaded, folder / "expected.h5", task_size=2)
    expected = (folder / "expected.h5").read_bytes()
    names = left_in(folder)
    outcomes = []
    told = set()
    for number in range(1, writes + 2):
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
    assert count() < number
    assert str(output) in told
    assert told <= {str(output), f"{output}.partial"}
    return outcomes


@campaign
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
    interrupted(loaded, tmp_path / "s.h5", task_size=2, limit=2)
    assert inline(loaded, tmp_path / "s.h5").resumed == 4
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "expected.h5").read_bytes()


def test_a_block_that_could_not_be_written_leaves_a_journal_to_go_on_with(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(6))
    interrupted(loaded, tmp_path / "s.h5", task_size=2, limit=1)
    before = journal_size(tmp_path)
    fail_at(4, partly=True)  # after those of the lock; the journal's own follows
    try:
        with pytest.raises(CannotWriteError):
            inline(loaded, tmp_path / "s.h5", task_size=2)
    finally:
        repair()
    assert journal_size(tmp_path) == before
    assert inline(loaded, tmp_path / "s.h5", task_size=2).resumed == 2
