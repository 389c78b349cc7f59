"""The points of a sweep on this machine: one process for each worker, one task each."""

import fcntl
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Self

from brakecli.about import ONE_THREAD
from brakecli.errors import BrakecliError, UsageError
from brakecli.faces import argument
from brakecli.results.os_signals import lastly, signals_deferred
from brakecli.stop import check_signals
from brakecli.studies.sweeps.workers.task import Compute, Engine, Finished, NextTask, Task, attempt

_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)


@dataclass
class Worker:
    """A process, our end of the pipe to it, and the task that it computes."""

    process: SpawnProcess
    pipe: Connection
    task: Task | None = None


class CallerEngine(Engine):
    """This process itself: nothing is started, so that a script needs no guard."""

    workers = 1

    def __init__(self, compute: Compute) -> None:
        """Remember what computes."""
        self.compute = compute

    def __exit__(self, *error: object) -> None:
        """Nothing was started."""

    def run(self, next_task: NextTask) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        while (task := next_task()) is not None:
            finished = attempt(self.compute, task)
            check_signals()
            yield finished


class LocalEngine(Engine):
    """Processes on this machine: one that dies takes no more than its task with it, and another one is started.

    Libraries were tried. The pools of the standard library and of loky lose the tasks of all workers with one
    worker. A pool of one process for each worker does not, but its semaphores stay behind in the system where the
    whole group is killed, Python tells of them on standard error where only the parent is, and a task costs four
    times as much. The code is hardly shorter with either. Pebble's workers go on after the death of their parent
    until their task has ended, and Ctrl-C waits for them.
    """

    def __init__(self, compute: Compute, workers: int, *, spare: bool = False) -> None:
        """Prepare as many workers. Each is started with its first task."""
        self.compute = compute
        self.workers = workers
        self.spare = spare
        self.pool: list[Worker] = []
        self._ending = ExitStack()
        self._lost: int | None = 0  # workers that ended before any has answered; None once one has

    def __enter__(self) -> Self:
        """See to it that the workers end with the block."""
        self._ending.enter_context(lastly(self._kill))
        return self

    def __exit__(self, *error: object) -> None:
        """Kill the workers."""
        self._ending.close()

    def _kill(self) -> None:
        for worker in self.pool:
            worker.process.kill()
        while self.pool:
            self._remove(self.pool[-1])

    def run(self, next_task: NextTask) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        while True:
            self._hand_out(next_task)
            busy = [worker for worker in self.pool if worker.task is not None]
            if not busy:
                return
            # A signal may have arrived just before this: it is looked for once in a second.
            ready = connection.wait([worker.pipe for worker in busy], 1.0)
            finished = [self._collect(worker) for worker in busy if worker.pipe in ready]
            self._hand_out(next_task)  # before the results are written, which a worker need not wait for
            yield from finished

    def _hand_out(self, next_task: NextTask) -> None:
        for worker in [worker for worker in self.pool if worker.task is None and not worker.process.is_alive()]:
            self._remove(worker)  # it has died between two tasks
        idle = [worker for worker in self.pool if worker.task is None]
        while (idle or len(self.pool) < self.workers) and (task := next_task()) is not None:
            worker = idle.pop() if idle else self._start()
            worker.task = task
            with suppress(OSError):  # it has died this moment, which reading its pipe reports
                worker.pipe.send(task)

    def _start(self) -> Worker:
        context = get_context("spawn")  # a forked child would keep our locks and our threads' memory
        ours, theirs = context.Pipe()
        worker = Worker(context.Process(target=_serve, args=(theirs,), daemon=True), ours)
        try:
            resource_tracker.ensure_running()  # here, as it lets signals through
            with theirs, _starting():
                worker.process.start()
                self.pool.append(worker)
        except OSError as error:
            what = f"a worker process cannot be started: {error.strerror or error}"
            remedy = f"finished points are kept, run the same command again with fewer {argument('jobs')}"
            raise BrakecliError(f"{what}; {remedy}") from error
        # By the pipe, as signals are heard while a large one waits there until the worker has started.
        with suppress(OSError):
            worker.pipe.send(self.compute)
        return worker

    def _refuse_starts(self, code: int) -> None:
        """Give up where each worker ends in an error before it computes anything: the next ones would as well."""
        if code == os.EX_USAGE:
            remedy = 'call it below  if __name__ == "__main__":  , or with jobs=1'
            what = "brakecli.sweep: its workers run the script anew, up to this call"
            raise UsageError(f"{what}; {remedy}") from None
        if self._lost is None or code != 1:
            return
        self._lost += 1
        if self._lost > self.workers + 1:
            remedy = "see above what ends them; they run the script anew that calls brakecli, but not with jobs=1"
            raise UsageError(f"no worker starts: {_cause_of_death(code)}, {self._lost} times; {remedy}") from None

    def _remove(self, worker: Worker) -> None:
        self.pool.remove(worker)
        worker.process.join()
        worker.pipe.close()

    def _collect(self, worker: Worker) -> Finished:
        task = worker.task
        worker.task = None
        try:
            finished: Finished = worker.pipe.recv()
        except (EOFError, OSError):
            self._remove(worker)
            code = worker.process.exitcode or 0
            self._refuse_starts(code)
            return Finished(task, failure=_cause_of_death(code))
        self._lost = None
        if finished.records is None:  # it ends itself after that
            self._remove(worker)
        return finished


def _cause_of_death(code: int) -> str:
    if code >= 0:
        return f"its process ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    hint = ", as when memory runs out" if -code == signal.SIGKILL else ""
    return f"its process was killed by {name}{hint}"


@contextmanager
def _starting() -> Iterator[None]:
    """Let a child start on one thread and without signals: one would end Python's start in a traceback."""
    with signals_deferred():
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        ours = dict(os.environ)
        os.environ.update(ONE_THREAD)
        try:
            yield
        finally:
            for name in ONE_THREAD.keys() - ours.keys():
                del os.environ[name]
            os.environ.update(ours)
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _serve(pipe: Connection) -> None:
    """Compute tasks until the parent ends. The parent kills its workers itself, also after Ctrl-C."""
    for number in (*_SIGNALS, signal.SIGIO):
        ends = number in (signal.SIGTERM, signal.SIGIO)
        signal.signal(number, signal.SIG_DFL if ends else signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
    parent = parent_process()
    assert parent is not None
    _die_with(parent.sentinel)
    with suppress(EOFError, OSError):
        compute = pipe.recv()
        while True:
            finished = attempt(compute, pipe.recv())
            pipe.send(finished)
            if finished.records is None:  # who knows in what state this process is
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
