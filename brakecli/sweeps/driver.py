"""A sweep from its plan to the finished result file: hand out tasks, keep what is finished, write."""

import math
import os
import time
import tomllib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import CannotWriteError
from brakecli.files.os_signals import Interrupted
from brakecli.files.write import new_result
from brakecli.runs.limits import free_bytes
from brakecli.sweeps.cost import Estimate, estimate, refuse_sweep
from brakecli.sweeps.file import LoadedSweep
from brakecli.sweeps.journal import Journal
from brakecli.sweeps.plan import Plan
from brakecli.sweeps.point import Status, blank, record_type
from brakecli.sweeps.result import Columns, SweepReport, findings, write
from brakecli.sweeps.workers.local import Engine, Job, LocalEngine, Task
from brakecli.sweeps.workers.task import fingerprint, work

TASK_SECONDS = 0.2
"""A task has this much work in it, so that handing it out costs little."""
LARGEST_TASK = 1000


@dataclass(frozen=True)
class Progress:
    """How far a sweep has come, in points."""

    done: int
    failed: int
    points: int


class Dealer:
    """Cuts what is not finished into tasks, of a size by the time that units have taken so far."""

    def __init__(self, finished: NDArray[np.bool_], size: int | None, order: int = 1) -> None:
        """Deal the units that are not finished; `size` fixes that of the tasks, `order` = -1 deals backwards."""
        missing = np.flatnonzero(~finished)
        cuts = np.flatnonzero(np.diff(missing) != 1) + 1
        runs = [(int(run[0]), len(run)) for run in np.split(missing, cuts) if len(run)]
        self._runs = deque(runs[::order])
        self._again: deque[Task] = deque()
        self._size = size
        self._seconds, self._units = 0.0, 0

    def __call__(self) -> Task | None:
        """The next task."""
        if self._again:
            return self._again.popleft()
        if not self._runs:
            return None
        first, count = self._runs.popleft()
        size = min(count, self._next_size())
        if size < count:
            self._runs.appendleft((first + size, count - size))
        return Task(first, size)

    def learn(self, task: Task, seconds: float) -> None:
        """Note how long a task has taken."""
        self._seconds += seconds
        self._units += task.size

    def retry(self, task: Task) -> bool:
        """Deal the units of a task whose worker died once more, one by one; False if that was their last try."""
        if task.last_try:
            return False
        self._again += [Task(unit, 1, True) for unit in range(task.first, task.first + task.size)]
        return True

    def _next_size(self) -> int:
        if self._size is not None:
            return self._size
        if not self._units:
            return 1
        return math.ceil(min(TASK_SECONDS * self._units / max(self._seconds, 1e-9), LARGEST_TASK))


def choose_engine(
    plan: Plan, jobs: int | None, scheduler: str | None = None, scheduler_file: str | None = None
) -> Engine:
    """The engine for a sweep: workers here, or those of a dask scheduler. Raises UsageError."""
    job = Job(plan.sweep_text, plan.case_text)
    if scheduler is None and scheduler_file is None:
        return LocalEngine(job, work, min(jobs or cores(), plan.units))
    from brakecli.sweeps.workers.dask import ClusterEngine

    return ClusterEngine(job, work, scheduler, scheduler_file)


def cores() -> int:
    """The cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def sweep(
    loaded: LoadedSweep,
    output: Path,
    engine: Engine,
    *,
    force: bool,
    task_size: int | None = None,
    order: int = 1,
    begin: Callable[[Estimate, int], None] = lambda found, resumed: None,
    progress: Callable[[Progress], None] = lambda progress: None,
) -> SweepReport:
    """Compute every point of a sweep that is not yet there, and write its result file.

    `begin` is told of the sweep and of the points that an earlier run has left before it starts, `progress` how
    far it has come, often. Raises RefusedError, CannotWriteError or UsageError before anything is computed,
    CannotWriteError also later; a point that fails is marked as such and reported.
    """
    plan, start = loaded.plan, time.perf_counter()
    found = estimate(plan, engine.workers)
    with _keeping(_journal_path(output)), new_result(output, force=force) as result:
        refuse_sweep(found, free_bytes(output.resolve().parent))
        with Journal(
            _journal_path(output), identity(plan), record_type(plan), plan.units, plan.unit_length, force=force
        ) as journal:
            resumed = int(journal.finished.sum()) * plan.unit_length
            begin(found, resumed)
            notes = _compute(plan, engine, journal, task_size, order, progress)
            columns = Columns(plan, journal)
            seconds = time.perf_counter() - start
            report = SweepReport(output, loaded, findings(columns), seconds, resumed, tuple(notes))
            write(result, report, columns)
            result.commit()
            journal.discard()
    return report


@contextmanager
def _keeping(journal: Path) -> Iterator[None]:
    """Say of what could not be written that the finished points are kept, if they are."""
    try:
        yield
    except (CannotWriteError, Interrupted) as error:
        if os.path.lexists(journal):
            kept = "finished points are kept, and the same command goes on with them"
            if isinstance(error, CannotWriteError):
                raise CannotWriteError(f"{error}; {kept}") from error
            error.left = kept
        raise


def identity(plan: Plan) -> dict[str, Any]:
    """What makes a sweep this one: every key of the sweep and its case, and the versions it is computed with."""
    return {
        **fingerprint(),
        **dict(_flat(tomllib.loads(plan.case_text), "")),
        **dict(_flat(tomllib.loads(plan.sweep_text), "sweep ")),
    }


def _flat(value: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _flat(each, f"{prefix}{'' if prefix in ('', 'sweep ') else '.'}{key}")
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, each in enumerate(value):
            yield from _flat(each, f"{prefix}[{index}]")
    else:
        yield prefix, value


def _journal_path(output: Path) -> Path:
    target = Path(os.path.realpath(output))
    return target.with_name(f"{target.name}.partial")


def _compute(
    plan: Plan,
    engine: Engine,
    journal: Journal,
    task_size: int | None,
    order: int,
    progress: Callable[[Progress], None],
) -> list[str]:
    """Have the engine compute what the journal does not hold; what there is to say about its workers."""
    kind, length = record_type(plan), plan.unit_length
    dealer = Dealer(journal.finished, task_size, order)
    done = int(journal.finished.sum()) * length
    failed = int((journal.column("status")[journal.finished] != Status.DONE.encode()).sum())
    deaths: list[str] = []
    progress(Progress(done, failed, plan.passes * plan.points))
    for finished in engine.run(dealer):
        task, records = finished.task, finished.records
        if records is None:
            deaths.append(finished.death)
            if task is not None and not dealer.retry(task):
                record = blank(kind, Status.CRASHED, f"the point ends its worker: {finished.death}")
                records = np.repeat(record, task.size * length).tobytes()
        elif task is not None:
            dealer.learn(task, finished.seconds)
        if task is not None and records is not None:
            journal.add(task.first, records)
            statuses = np.frombuffer(records, kind)["status"]
            done += len(statuses)
            failed += int((statuses != Status.DONE.encode()).sum())
        progress(Progress(done, failed, plan.passes * plan.points))
    if not deaths:
        return []
    times = "a worker process has ended" if len(deaths) == 1 else f"{len(deaths)} times a worker process has ended"
    return [f"{times} before its time ({deaths[0]}); its points were computed again"]
