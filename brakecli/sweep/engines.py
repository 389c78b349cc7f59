"""Where the points of a sweep are computed: worker processes on this machine, or those of a cluster.

An engine takes tasks, neighbouring units of the sweep, gives back their records in any order, and says which task
a worker has died of. The records do not depend on the engine, nor on how the units were cut into tasks.
"""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import NamedTuple, Protocol, Self


class Job(NamedTuple):
    """The plan that all tasks belong to, in the texts that it is made of."""

    sweep_text: str
    case_text: str


class Task(NamedTuple):
    """Some neighbouring units. `last_try`: a worker has died of one of them before."""

    first: int
    size: int
    last_try: bool = False


class Finished(NamedTuple):
    """A task with its records and the seconds it took; or without records, and how its worker died.

    No task at all: a worker has gone, and the engine has seen to its tasks.
    """

    task: Task | None
    records: bytes | None
    seconds: float
    death: str = ""


Work = Callable[[Job, int, int], bytes]
"""work(job, first, count): the records of some units. A function of a module, so that workers find it."""
Supply = Callable[[], Task | None]
"""The next task, None where there is none now; asked again after each task that has ended."""


class Engine(Protocol):
    """What computes tasks; a context, which ends all workers it has started."""

    workers: int

    def __enter__(self) -> Self:
        """Start the workers."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End them."""

    def run(self, supply: Supply) -> Iterator[Finished]:
        """Compute until there are no more tasks."""


@dataclass
class _Worker:
    process: SpawnProcess
    pipe: Connection
    task: Task | None = None


class LocalEngine:
    """Processes on this machine, one task each: a process that dies takes no more than its task with it.

    The pools of the standard library and of loky lose the whole sweep with one worker; this one starts another.
    """

    def __init__(self, job: Job, work: Work, workers: int) -> None:
        """Prepare as many workers."""
        self.workers = workers
        self._job, self._work = job, work
        self._pool: list[_Worker] = []

    def __enter__(self) -> Self:
        """Start nothing yet: a worker is started with its first task."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Kill the workers: whatever they still compute is not wanted."""
        for worker in self._pool:
            worker.process.kill()
        for worker in self._pool:
            worker.process.join()
            worker.pipe.close()
        self._pool.clear()

    def run(self, supply: Supply) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        while True:
            self._hand_out(supply)
            busy = [worker for worker in self._pool if worker.task is not None]
            if not busy:
                return
            ready = connection.wait([worker.pipe for worker in busy], timeout=1.0)
            for worker in busy:
                if worker.pipe in ready:
                    yield self._collect(worker)

    def _hand_out(self, supply: Supply) -> None:
        idle = [worker for worker in self._pool if worker.task is None]
        while idle or len(self._pool) < self.workers:
            task = supply()
            if task is None:
                return
            worker = idle.pop() if idle else self._start()
            worker.task = task
            try:
                worker.pipe.send(task)
            except OSError:  # it has died since its last task; its pipe tells so when it is read
                continue

    def _start(self) -> _Worker:
        context = get_context("spawn")  # a forked child would keep our locks and our threads' memory
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, self._job, self._work), daemon=True)
        with _single_threaded():
            process.start()
        theirs.close()
        worker = _Worker(process, ours)
        self._pool.append(worker)
        return worker

    def _collect(self, worker: _Worker) -> Finished:
        task, worker.task = worker.task, None
        assert task is not None
        try:
            records, seconds = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join()
            worker.pipe.close()
            self._pool.remove(worker)
            return Finished(task, None, 0.0, _death(worker.process.exitcode or 0))
        return Finished(task, records, seconds)


def _death(code: int) -> str:
    if code >= 0:
        return f"its process ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    hint = ", as when memory runs out" if -code == signal.SIGKILL else ""
    return f"its process was killed by {name}{hint}"


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Let a child start without threads of its own for linear algebra: each core has a process already."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(pipe: Connection, job: Job, work: Work) -> None:
    """Compute tasks until the parent ends. Its Ctrl-C is not ours: the parent kills us."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = pipe.recv()
            begin = time.perf_counter()
            pipe.send((work(job, task.first, task.size), time.perf_counter() - begin))
        except (EOFError, OSError):
            return


def _die_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
    os._exit(1)
