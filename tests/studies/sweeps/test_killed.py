"""Sweeps whose processes are killed or run out of memory lose no point but the one that is to blame."""

import os
import random
import re
import sys
import time
from functools import partial
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import h5py
import pytest

from brakecli.results.read import open_result
from brakecli.studies.sweeps.workers.local import LocalEngine
from brakecli.studies.sweeps.workers.task import Task
from tests.campaign import campaign
from tests.commands import ROOT, TINY, brakecli, left_in, run, shell, started, wait_until
from tests.studies.sweeps.helpers import (
    PROGRAM,
    WICKED,
    Compute,
    alive,
    axis,
    broken,
    children,
    deadly,
    frictions,
    hungry,
    journal_size,
    local,
    slow,
    threads,
    workers,
    write_sweep,
)

pytestmark = pytest.mark.usefixtures("compiled")


def variable(path: Path, name: str) -> Any:
    with open_result(path, "sweep"), h5py.File(path) as file:
        return file[name][:]


@pytest.mark.parametrize("kills", [(False, True), (False, True, False, True, True)], ids=len)
@campaign
def test_a_killed_sweep_ends_with_the_bytes_of_an_undisturbed_one(
    good: Path, here: Path, kills: tuple[bool, ...]
) -> None:
    """Each kill comes while workers are started, or, where true, while they compute."""
    chance = random.Random(1)
    size = 0
    for computing in kills:
        with started("sweep", "s.toml", "--quiet", "-j", "2", cwd=here) as process:
            wait_until(lambda process=process: workers(process.pid))  # type: ignore[misc]
            if computing:
                wait_until(lambda size=size: journal_size(here) > max(size, 1500))  # type: ignore[misc]
            time.sleep(chance.uniform(0.0, 0.25))
            crew = children(process.pid)
            assert process.poll() is None
            process.kill()
            # a worker that is being started notices once it has started
            wait_until(lambda crew=crew: not any(map(alive, crew)))  # type: ignore[misc]
        assert journal_size(here) >= size
        size = journal_size(here)
    last = brakecli("sweep", "s.toml", "-j", "1", cwd=here)
    assert re.search(r"120 points on . workers?: .*; [1-9]\d* of them are there already", last.told(0))
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


def test_workers_die_with_their_parent_whatever_they_are_in(tmp_path: Path) -> None:
    write_sweep(tmp_path, frictions(4))
    with started("stuck", tmp_path / "s.toml", cwd=ROOT, command=PROGRAM) as process:
        wait_until(lambda: len([*tmp_path.glob("*.computes")]) == 2)
        crew = children(process.pid)
        process.kill()
        wait_until(lambda: not any(map(alive, crew)))  # what they compute does not end


@pytest.mark.parametrize(
    ("wicked", "task_size", "reason"),
    [
        pytest.param(deadly, 1, "killed by SIGKILL, as when memory runs out", marks=campaign),
        (deadly, 5, "killed by SIGKILL, as when memory runs out"),
        pytest.param(hungry, 5, "it ran out of memory", marks=campaign),
        pytest.param(broken, 5, "ZeroDivisionError: division by zero", marks=campaign),
    ],
)
def test_a_point_that_ends_its_worker_is_marked_and_all_others_are_computed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], wicked: Compute, task_size: int, reason: str
) -> None:
    loaded = write_sweep(tmp_path, frictions(20))
    report = local(loaded, tmp_path / "s.h5", wicked, 2 if wicked is deadly else 1, task_size=task_size)
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


@campaign
def test_workers_that_die_idle_cost_no_point(tmp_path: Path) -> None:
    loaded = write_sweep(tmp_path, frictions(12))
    with LocalEngine(partial(slow, loaded.plan), 2) as engine:
        planned = Task(0, 1, True), Task(1, 9, True), None, Task(10, 1, True), Task(11, 1, True)
        tasks = chain(planned, repeat(None))
        killed: list[int] = []

        def next_task() -> Task | None:
            if (task := next(tasks)) is None and not killed:
                (idle,) = (each.process for each in engine.pool if each.task is None)
                idle.kill()
                wait_until(lambda: not idle.is_alive())  # all of its threads
                killed.append(idle.pid or 0)
            return task

        found = list(engine.run(next_task))
    assert killed
    assert sorted(each.task.first for each in found if each.task and each.records) == [0, 1, 10, 11]
    assert len(found) == 4


@pytest.mark.parametrize("ours", [pytest.param("7", marks=campaign), None])
def test_linear_algebra_takes_one_thread_in_a_worker_and_ours_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ours: str | None
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if ours:
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", ours)
    with LocalEngine(partial(threads, write_sweep(tmp_path, frictions(2)).plan), 1) as engine:
        (found,) = engine.run(chain([Task(0, 1, True)], repeat(None)).__next__)
    assert found.records == b"1"
    assert os.environ.get("OPENBLAS_NUM_THREADS") == ours


@campaign
def test_a_point_without_memory_fails_with_the_reason_and_exit_code_1(tmp_path: Path) -> None:
    durations = axis("solver.duration", "values = [0.02, 100.0, 0.03]")
    write_sweep(tmp_path, durations, case=TINY.replace("sample_interval = 1e-4", "sample_interval = 1e-5"))
    done = shell("ulimit -v 1200000; $B sweep s.toml --json -q -j 1", tmp_path, OPENBLAS_NUM_THREADS="1")
    done.told(1, "point 1 (solver.duration = 100.0): out of memory", "1 of 3 points failed")
    assert done.json["status"] == ["done", "failed", "done"]


@campaign
def test_workers_that_cannot_start_end_a_command_and_are_not_tried_for_each_point(tmp_path: Path) -> None:
    """A script that fails wherever it is not the main process."""
    write_sweep(tmp_path, frictions(500))
    (tmp_path / "fails.py").write_text(
        "import multiprocessing\n"
        "assert multiprocessing.current_process().name == 'MainProcess', 'not in a worker'\n"
        "import brakecli, brakecli.errors\n"
        "if __name__ == '__main__':\n"
        "    try:\n"
        "        brakecli.sweep('s.toml', jobs=2)\n"
        "    except brakecli.errors.UsageError as error:\n"
        "        print(error)\n"
    )
    done = run(cwd=tmp_path, command=[sys.executable, "fails.py"])
    assert done.out.startswith("no worker starts: its process ended with exit code 1, 4 times; see above")
    assert done.err.count("AssertionError: not in a worker") <= 6  # four, and two that were started meanwhile
