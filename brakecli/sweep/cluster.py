"""The points of a sweep on many machines, by dask.distributed; this process alone writes."""

import logging
import time
from collections.abc import Iterator
from contextlib import suppress
from types import TracebackType
from typing import Any, Self

from brakecli.errors import BrakecliError, RefusedError, UsageError
from brakecli.sweep.engines import Finished, Job, Supply, Task, Work
from brakecli.sweep.worker import fingerprint

CONNECT_SECONDS = 20
WAIT_SECONDS = 60.0
"""How long to wait for a worker to come (back) before giving up."""
TASKS_PER_THREAD = 3


class ClusterEngine:
    """The workers of a dask scheduler. A worker that dies is replaced by others, which dask sees to."""

    def __init__(self, job: Job, work: Work, address: str | None, scheduler_file: str | None) -> None:
        """Connect to a scheduler and compare versions; raises UsageError or RefusedError."""
        try:
            from distributed import Client
        except ImportError as error:
            raise UsageError(
                "--scheduler: needs dask.distributed, which is not installed; pip install 'brakecli[cluster]'"
            ) from error
        self._job, self._work = job, work
        self._name = scheduler_file or str(address)
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # its workers come and go, which is told here
        where: dict[str, Any] = {"scheduler_file": scheduler_file} if scheduler_file else {"address": address}
        try:
            self._client: Any = Client(**where, timeout=CONNECT_SECONDS, set_as_default=False)
        except Exception as error:  # dask raises many kinds, of all its layers
            raise UsageError(
                f"--scheduler {self._name}: no scheduler answers ({_first_line(error)}); start one with: "
                "dask scheduler"
            ) from error
        try:
            self._client.wait_for_workers(1, timeout=WAIT_SECONDS)
            self._compare()
        except BaseException as error:
            self._client.close()
            if isinstance(error, TimeoutError):
                raise UsageError(
                    f"--scheduler {self._name}: has no workers; start some with: dask worker {self._name}"
                ) from error
            raise
        self.workers = self._threads()

    def __enter__(self) -> Self:
        """Nothing more to start."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Cancel what is still to be computed, and leave; scheduler and workers go on."""
        with suppress(Exception):
            self._client.close(timeout=1)

    def run(self, supply: Supply) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        from distributed import wait

        running: dict[Any, Task] = {}
        known, alone_since = self._addresses(), time.monotonic()
        try:
            while True:
                while len(running) < TASKS_PER_THREAD * self.workers and (task := supply()) is not None:
                    arguments = (self._work, self._job, task.first, task.size)
                    running[self._client.submit(_timed, *arguments, pure=False)] = task
                if not running:
                    return
                with suppress(TimeoutError):
                    wait(list(running), timeout=0.5, return_when="FIRST_COMPLETED")
                for future in [each for each in running if each.done()]:
                    yield self._collect(future, running.pop(future))
                    alone_since = time.monotonic()
                now = self._addresses()
                for gone in sorted(known - now):
                    yield Finished(None, None, 0.0, f"the worker at {gone} has gone")
                known = now
                if now:
                    alone_since = max(alone_since, time.monotonic() - 1.0)
                elif time.monotonic() - alone_since > WAIT_SECONDS:
                    raise self._lost("has no workers any more")
        finally:
            with suppress(Exception):
                self._client.cancel(list(running))

    def _collect(self, future: Any, task: Task) -> Finished:
        from distributed import KilledWorker

        if future.status == "finished":
            records, seconds = future.result()
            return Finished(task, records, seconds)
        if future.status in ("cancelled", "lost"):
            raise self._lost("has gone")
        error = future.exception()
        if isinstance(error, KilledWorker):
            return Finished(task, None, 0.0, "several workers of the cluster have died of it")
        raise BrakecliError(
            f"--scheduler {self._name}: a worker cannot compute ({_first_line(error)}); finished points are kept, "
            "run the same command again"
        )

    def _lost(self, how: str) -> BrakecliError:
        return BrakecliError(
            f"--scheduler {self._name}: {how}; finished points are kept, run the same command again"
        )

    def _addresses(self) -> set[str]:
        try:
            return set(self._client.scheduler_info(n_workers=-1)["workers"])
        except TypeError:  # older versions tell of all workers anyway
            return set(self._client.scheduler_info()["workers"])

    def _threads(self) -> int:
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def _compare(self) -> None:
        """Refuse workers of another version: their results would not be the same."""
        ours = fingerprint()
        try:
            found = self._client.run(fingerprint)
        except Exception as error:
            raise UsageError(
                f"--scheduler {self._name}: a worker cannot load brakecli ({_first_line(error)}); install the "
                "same version there"
            ) from error
        for worker, theirs in sorted(found.items()):
            for key, value in ours.items():
                if theirs.get(key) != value:
                    raise RefusedError(
                        f"--scheduler {self._name}: {key} is {theirs.get(key)} on the worker at {worker} and "
                        f"{value} here; install the same version there"
                    )


def _timed(work: Work, job: Job, first: int, size: int) -> tuple[bytes, float]:
    begin = time.perf_counter()
    return work(job, first, size), time.perf_counter() - begin


def _first_line(error: object) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
