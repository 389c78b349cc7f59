"""Where the points of a sweep are computed: worker processes on this machine, or those of a cluster.

An engine takes tasks, neighbouring units of the sweep, gives back their records in any order, and says which task
a worker has died of. The records do not depend on the engine, nor on how the units were cut into tasks.
"""

import fcntl
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import TracebackType
from typing import NamedTuple, Protocol, Self

from brakecli.errors import BrakecliError
from brakecli.files.os_signals import signals_deferred

_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)


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


class Attempt(NamedTuple):
    """What has come of a task in a worker: records and seconds, or why there are none."""

    records: bytes | None
    seconds: float
    failure: str = ""


def attempt(work: Work, job: Job, first: int, size: int) -> Attempt:
    """Compute a task. What goes wrong within is the task's own fault, not that of the worker or the network."""
    begin = time.perf_counter()
    try:
        return Attempt(work(job, first, size), time.perf_counter() - begin)
    except MemoryError:
        return Attempt(None, 0.0, "it ran out of memory")
    except Exception as error:  # of one task, which must not cost the others
        return Attempt(None, 0.0, f"{type(error).__name__}: {first_line(error)}")


def first_line(error: object) -> str:
    """The first line of an error's text, or else its kind."""
    return (str(error).splitlines() or [type(error).__name__])[0]


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
            finished = [self._collect(worker) for worker in busy if worker.pipe in ready]
            self._hand_out(supply)  # before the results are written, which a worker need not wait for
            yield from finished

    def _hand_out(self, supply: Supply) -> None:
        for worker in [each for each in self._pool if each.task is None and not each.process.is_alive()]:
            self._remove(worker)  # it has died since its last task, and of none
        idle = [worker for worker in self._pool if worker.task is None]
        while idle or len(self._pool) < self.workers:
            task = supply()
            if task is None:
                return
            worker = idle.pop() if idle else self._start()
            worker.task = task
            try:
                worker.pipe.send(task)
            except OSError:  # it has died this moment; its pipe tells so when it is read
                continue

    def _start(self) -> _Worker:
        context = get_context("spawn")  # a forked child would keep our locks and our threads' memory
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, self._job, self._work), daemon=True)
        worker = _Worker(process, ours)
        try:
            resource_tracker.ensure_running()  # here, as it lets signals through
            with _single_threaded(), _signals_blocked():
                process.start()
                self._pool.append(worker)
        except OSError as error:
            raise BrakecliError(
                f"a worker process cannot be started: {error.strerror or error}; finished points are kept, run "
                "the same command again with fewer --jobs"
            ) from error
        finally:
            theirs.close()
        return worker

    def _remove(self, worker: _Worker) -> None:
        self._pool.remove(worker)
        worker.process.join()
        worker.pipe.close()

    def _collect(self, worker: _Worker) -> Finished:
        task, worker.task = worker.task, None
        assert task is not None
        try:
            found: Attempt = worker.pipe.recv()
        except (EOFError, OSError):
            self._remove(worker)
            return Finished(task, None, 0.0, _death(worker.process.exitcode or 0))
        if found.records is None:  # it ends itself after that
            self._remove(worker)
        return Finished(task, found.records, found.seconds, found.failure)


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


@contextmanager
def _signals_blocked() -> Iterator[None]:
    """Start a process that hears no signals until it is ready: Python's start would end in a traceback."""
    with signals_deferred():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Connection, job: Job, work: Work) -> None:
    """Compute tasks until the parent ends. Its Ctrl-C is not ours: the parent kills us."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    for number in (signal.SIGTERM, signal.SIGIO):
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    parent = parent_process()
    assert parent is not None
    _die_with(parent.sentinel)
    while True:
        try:
            task = pipe.recv()
            found = attempt(work, job, task.first, task.size)
            pipe.send(found)
        except (EOFError, OSError):
            return
        if found.records is None:  # who knows in what state this process is
            return


def _die_with(sentinel: int) -> None:
    """End this process with its parent: the system sends SIGIO, which no computation holds up.

    A thread sees to it on systems that send nothing.
    """
    fcntl.fcntl(sentinel, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(sentinel, fcntl.F_SETFL, fcntl.fcntl(sentinel, fcntl.F_GETFL) | os.O_ASYNC)
    if connection.wait([sentinel], timeout=0):  # it has ended before that
        os._exit(1)

    def watch() -> None:
        connection.wait([sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
