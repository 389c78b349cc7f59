"""A sweep from its plan to the finished result file: hand out tasks, keep what is finished, write."""

import math
import multiprocessing
import os
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import BrakecliError, CannotWriteError
from brakecli.results.os_signals import lastly
from brakecli.results.write import ResultFile, new_result
from brakecli.solver.beforehand import cores
from brakecli.solver.integrate import Counted
from brakecli.studies.runs.limits import free_bytes
from brakecli.studies.sweeps.journal import Journal, open_journal
from brakecli.studies.sweeps.plan import LoadedSweep, Plan
from brakecli.studies.sweeps.record import Status, blank, unsound
from brakecli.studies.sweeps.result import Findings, SweepReport, write
from brakecli.studies.sweeps.size import Size, refuse_sweep, size_of
from brakecli.studies.sweeps.workers.local import CallerEngine, LocalEngine
from brakecli.studies.sweeps.workers.task import Compute, Engine, Task, compute_units


class TaskQueue:
    """Cuts what is not finished into tasks, of a size by the time that units have taken so far."""

    def __init__(self, finished: NDArray[np.bool_], size: int | None, workers: int = 1, least: int = 1) -> None:
        """Queue what is not finished; `size` fixes that of the tasks.

        Units that are computed side by side come `least` at a time: fewer would take as long.
        """
        edges = np.flatnonzero(np.diff(finished, prepend=True, append=True)).reshape(-1, 2).tolist()
        self._tasks = deque([Task(first, end - first) for first, end in edges])
        self._waiting = sum(task.size for task in self._tasks)
        self._size = size
        self._least = least
        # Handing out a task costs little beside 0.2 s of work. A scheduler hands out 500 a second: they are longer
        # where workers would ask for more than 100.
        self._task_seconds = max(0.2, workers / 100.0)
        self._part_of_remaining = 0.01 / workers  # so that all end at about the same time
        self._most = max(1000, 10 * workers)  # points
        # computed so far
        self.seconds = 0.0
        self.units = 0

    def next_task(self) -> Task | None:
        """The next task, None where there is none now."""
        if not self._tasks:
            return None
        task = self._tasks.popleft()
        rate = self.units / max(self.seconds, 1e-9)
        # In the middle of long sweeps it is 1 s of work: a task costs a cluster some 5 ms of a core.
        by_remaining = int(min(rate, self._part_of_remaining * self._waiting, self._most))
        by_time = math.ceil(min(self._task_seconds * rate, self._most))
        size = min(task.size, self._size or max(self._least, by_time, by_remaining))
        self._waiting -= size
        if size < task.size:
            self._tasks.appendleft(Task(task.first + size, task.size - size))
        return task._replace(size=size)

    def note_time(self, task: Task, seconds: float) -> None:
        """Note how long a task has taken."""
        self.seconds += seconds
        self.units += task.size

    def retry(self, task: Task) -> bool:
        """Queue the units of a task that has failed once more, one by one; False if that was their last try."""
        if not task.last_try:
            units = range(task.first, task.first + task.size)
            self._waiting += task.size
            self._tasks.extendleft(Task(unit, 1, last_try=True) for unit in reversed(units))
        return not task.last_try


def choose_engine(
    plan: Plan,
    jobs: int | None,
    scheduler: object = None,
    scheduler_file: str | None = None,
    *,
    in_caller: bool = False,
    compute: Compute | None = None,
) -> Engine:
    """The engine for a sweep: workers here, or those of a dask scheduler. Raises UsageError.

    `scheduler` is its address, or a client or a cluster of dask. `in_caller`: a single worker is this process
    itself; in a script it must be asked for, or the time that a sweep takes would decide whether the script needs
    a guard. A daemonic process, as the worker of a pool, may start none, and computes itself. `compute` is what it
    computes, in place of points.
    """
    compute = compute or partial(compute_units, plan)
    if scheduler is None and scheduler_file is None:
        if (in_caller and jobs == 1) or multiprocessing.current_process().daemon:
            return CallerEngine(compute)
        return LocalEngine(compute, crew(plan, jobs), spare=jobs is None and not in_caller)
    from brakecli.studies.sweeps.workers.dask import ClusterEngine

    return ClusterEngine(compute, scheduler, scheduler_file)


def crew(plan: Plan, jobs: int | None = None) -> int:
    """How many workers compute a sweep here: one for each core that this process may use, or `jobs`."""
    return min(jobs or cores(), plan.units)


def sweep(
    loaded: LoadedSweep,
    output: Path,
    engine: Engine,
    *,
    force: bool,
    task_size: int | None = None,
    begin: Callable[[Size, int], None] = lambda size, resumed: None,
    progress: Callable[[int, int], None] = lambda done, failed: None,
    write: Callable[[ResultFile, SweepReport, Journal], None] = write,
) -> SweepReport:
    """Compute every point of a sweep that is not yet there, and write its result file.

    `begin` is called before the start with the size and the number of points that an earlier run has left,
    `progress` often, with the points that are done and that have failed, and `write` at the end. Raises
    RefusedError, CannotWriteError or UsageError before anything is computed, CannotWriteError also later; a point
    that fails is marked and reported.
    """
    plan = loaded.plan
    start = time.perf_counter()
    size = size_of(plan, engine.workers, spare=engine.spare)
    engine = engine if size.workers else CallerEngine(engine.compute)
    with new_result(output, force=force) as result:
        refuse_sweep(size, free_bytes(output.resolve().parent))
        with open_journal(journal_path(output), plan, force=force) as journal:
            resumed = journal.done
            begin(size, resumed)
            queue = TaskQueue(journal.finished, task_size, engine.workers, size.together)
            notes = _compute(engine, journal, queue, progress)
            if missing := int((~journal.finished).sum()):
                lost = f"{output}: {missing} of {plan.units} points or lines are missing"
                raise BrakecliError(f"{lost}; run the same command again")
            report = SweepReport(output, loaded, Findings(journal), resumed, notes, queue.units * plan.unit_length)
            write(result, report, journal)
            result.commit()
            journal.discard()
    seconds = time.perf_counter() - start
    return replace(report, seconds=seconds, overhead=1.0 - queue.seconds / (seconds * engine.workers))


def counting(plan: Plan, tell: Counted) -> Callable[[int, int], None]:
    """The progress of a sweep in words: which points are done, and how many have failed."""

    def progress(done: int, failed: int) -> None:
        tell(f"points, {failed} failed" if failed else "points", done, plan.passes * plan.points)

    return progress


def journal_path(output: Path) -> Path:
    """Where the finished points of a sweep are kept until its result is written."""
    return Path(f"{os.path.realpath(output)}.partial")


@contextmanager
def keeping_points(output: Path) -> Iterator[None]:
    """Add to the message on an interruption, or on a failed write, that finished points are kept, if they are."""

    def hint() -> str:
        there = (journal := journal_path(output)).is_file() and not journal.is_symlink()
        return "finished points are kept, and the same command goes on with them" if there else ""

    try:
        with lastly(hint):
            yield
    except CannotWriteError as error:
        raise CannotWriteError("; ".join(filter(None, (str(error), hint())))) from error


def _compute(
    engine: Engine, journal: Journal, queue: TaskQueue, progress: Callable[[int, int], None]
) -> tuple[str, ...]:
    """Have the engine compute what the journal does not hold; returns what there is to say about its workers."""
    ends: list[str] = []
    progress(journal.done, journal.failed)
    for task, records, seconds, failure in engine.run(queue.next_task):
        if task is not None and records is not None and (wrong := unsound(journal.plan, records, task.size)):
            records = None
            failure = f"it returned {wrong}"
        if records is None:
            ends.append(failure)
            if task is not None and not queue.retry(task):
                record = blank(journal.kind, Status.CRASHED, f"the point ends its worker: {failure}")
                records = np.repeat(record, task.size * journal.plan.unit_length).tobytes()
        elif task is not None:
            queue.note_time(task, seconds)
        if task is not None and records is not None:
            journal.add(task.first, records)
        progress(journal.done, journal.failed)
    if not ends:
        return ()
    times = "a worker process has failed" if len(ends) == 1 else f"{len(ends)} times a worker process has failed"
    return (f"{times} ({ends[0]}); its points were computed again",)
