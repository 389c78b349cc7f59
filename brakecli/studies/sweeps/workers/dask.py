"""The points of a sweep on many machines, by dask.distributed; this process alone writes."""

import json
import logging
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING

from brakecli.errors import BrakecliError, RefusedError, UsageError
from brakecli.faces import argument
from brakecli.results.opening import contents
from brakecli.studies.sweeps.workers.task import (
    Compute,
    Engine,
    Finished,
    NextTask,
    Task,
    attempt,
    fingerprint,
    headline,
)

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_SECONDS = 20
WAIT_SECONDS = 60.0  # for a worker to come, or to come back
LOOK_SECONDS = 1.0  # from one look at which workers there are to the next
NOISY = ("distributed", "tornado", "asyncio")  # packages whose logs do not belong on standard error
KEPT = "; finished points are kept, run the same command again"
INSTALL = "; install the same version there"


class ClusterEngine(Engine):
    """The workers of a dask scheduler. Dask gives the tasks of a worker that dies to others."""

    def __init__(self, compute: Compute, scheduler: object, scheduler_file: str | None) -> None:
        """Connect to a scheduler and compare versions; raises UsageError or RefusedError.

        It is given by its address, or by a client or a cluster of dask; these stay as they are.
        """
        self.compute = compute
        self._versions = fingerprint()
        self._shared: Future[Compute] | None = None
        address = str(getattr(getattr(scheduler, "scheduler", None), "address", scheduler))
        option, name = ("scheduler", address) if scheduler_file is None else ("scheduler-file", scheduler_file)
        self._where = f"{argument(option)} {name}"
        address = address if scheduler_file is None else self._address_in(scheduler_file)
        self._client = self._connected(address, getattr(scheduler, "security", None))
        with ExitStack() as failed:
            failed.push(self)
            with self._explained(UsageError, "the scheduler does not answer"):
                try:
                    self._client.wait_for_workers(1, timeout=WAIT_SECONDS)
                except TimeoutError as error:
                    none = f"{self._where}: has no workers; start some with: dask worker {address}"
                    raise UsageError(none) from error
                self._compare()
                self.workers = max(1, sum(self._client.nthreads().values()))
            failed.pop_all()

    def __exit__(self, *error: object) -> None:
        """Leave, which cancels what is still to be computed; scheduler and workers go on."""
        with suppress(Exception):
            self._client.close(timeout=1)

    def run(self, next_task: NextTask) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        with self._explained(BrakecliError, "the scheduler has gone", KEPT):
            yield from self._run(next_task)

    def _run(self, next_task: NextTask) -> Iterator[Finished]:
        from distributed import wait

        running: dict[Future[Finished | str], Task] = {}
        suspects: deque[Task] = deque()  # last tries that died with a worker which had other tasks, too
        alone = None
        self._reachable = self._addresses()
        looked = last_sign = time.monotonic()
        while True:
            while len(running) < 3 * self.workers and (task := next_task()) is not None:
                running[self._submit(task)] = task
            if suspects and not running:
                alone = suspects.popleft()
                running[self._submit(alone)] = alone
            if not running:
                yield from self._gone()
                return
            with self._client.as_current(), suppress(TimeoutError):
                wait(list(running), timeout=0.5, return_when="FIRST_COMPLETED")
            for future in [future for future in running if future.done()]:
                try:
                    finished = self._collect(future)
                except TimeoutError:
                    continue
                task = running.pop(future)
                last_sign = time.monotonic()
                if finished is not None:
                    yield finished
                elif task.last_try and task is not alone:
                    suspects.append(task)
                else:
                    yield Finished(task, failure="several workers of the cluster have died of it")
            if time.monotonic() - looked > LOOK_SECONDS:
                yield from self._gone()
                looked = time.monotonic()
                last_sign = looked if self._reachable else last_sign
            if time.monotonic() - last_sign > WAIT_SECONDS + LOOK_SECONDS:
                raise BrakecliError(f"{self._where}: has no workers any more{KEPT}")

    def _submit(self, task: Task) -> "Future[Finished | str]":
        # What computes, measured profiles included, is a task as well: it travels once, and survives its worker.
        # Not by dask's own executor, whose futures never end where a result cannot be fetched.
        self._shared = self._shared or self._client.submit(_itself, self.compute, pure=False)
        return self._client.submit(_attempt, self._shared, task, self._versions, pure=False)

    def _collect(self, future: "Future[Finished | str]") -> Finished | None:
        """The end of a task, None if its workers have died. Raises TimeoutError while dask computes it again."""
        from distributed import KilledWorker

        if future.status == "cancelled":
            raise BrakecliError(f"{self._where}: the scheduler has gone{KEPT}")
        if future.status == "lost":  # with its worker; it is computed again
            raise TimeoutError
        if future.status == "error":
            if isinstance(error := future.exception(), KilledWorker):
                return None
            raise BrakecliError(f"{self._where}: a worker cannot compute ({headline(error)}){KEPT}")
        finished: Finished | str = future.result(timeout=5.0)  # s; its worker may have died with it
        if isinstance(finished, str):
            raise RefusedError(f"{self._where}: {finished}{INSTALL}")
        return finished

    def _gone(self) -> Iterator[Finished]:
        """The workers that are no longer there."""
        now = self._addresses()
        gone = sorted(self._reachable - now)
        self._reachable = now
        for address in gone:
            yield Finished(None, failure=f"the worker at {address} has gone")

    def _addresses(self) -> set[str]:
        try:
            return set(self._client.scheduler_info(n_workers=-1)["workers"])
        except TypeError:  # older versions report all workers anyway
            return set(self._client.scheduler_info()["workers"])

    @contextmanager
    def _explained(self, kind: type[BrakecliError], what: str, remedy: str = "") -> Iterator[None]:
        """Turn what dask raises, which is of many kinds, of all its layers, into one sentence."""
        try:
            yield
        except BrakecliError:
            raise
        except Exception as error:
            raise kind(f"{self._where}: {what} ({headline(error)}){remedy}") from error

    def _address_in(self, scheduler_file: str) -> str:
        """The address in a scheduler's file; dask itself would wait for ever for the file to come."""
        try:
            return str(json.loads(contents(scheduler_file, 1_000_000))["address"])
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
        except (ValueError, KeyError, TypeError, RecursionError):
            reason = "it holds no address"
        remedy = f"start a scheduler with: dask scheduler --scheduler-file {scheduler_file}"
        raise UsageError(f"{self._where}: cannot be read: {reason}; {remedy}")

    def _connected(self, address: str, security: object) -> "Client":
        try:
            from distributed import Client
        except ImportError as error:
            what = "needs dask.distributed, which is not installed"
            what += "; install it with: python -m pip install distributed"
            raise UsageError(f"{self._where}: {what}") from error

        for name in {*NOISY, *logging.root.manager.loggerDict}:  # dask has given its loggers levels of their own
            if name.partition(".")[0] in NOISY:
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)

        class _Client(Client):
            def __del__(self) -> None:
                """Where its start has failed there is nothing to close; dask would try to, and complain."""

        quiet: type[Client] = _Client
        with self._explained(UsageError, "no scheduler answers", "; start one with: dask scheduler"):
            return quiet(address, timeout=CONNECT_SECONDS, security=security, set_as_default=False)

    def _compare(self) -> None:
        """Refuse workers of another version: their results would not be the same."""
        with self._explained(UsageError, "a worker cannot load brakecli", INSTALL):
            fingerprints = self._client.run(fingerprint)
        for worker, theirs in sorted(fingerprints.items()):
            if difference := _difference(self._versions, theirs, f"the worker at {worker}"):
                raise RefusedError(f"{self._where}: {difference}{INSTALL}")


def _itself(compute: Compute) -> Compute:
    return compute


def _attempt(compute: Compute, task: Task, versions: Mapping[str, str]) -> Finished | str:
    """Compute a task in a worker of the cluster; the difference where that is of another version."""
    return _difference(versions, fingerprint(), "a worker that joined later") or attempt(compute, task)


def _difference(ours: Mapping[str, str], theirs: Mapping[str, str], who: str) -> str:
    different = [key for key in ours if theirs.get(key) != ours[key]]
    return "".join(f"{key} is {theirs.get(key)} on {who} and {ours[key]} here" for key in different[:1])
