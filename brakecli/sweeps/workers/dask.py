"""The points of a sweep on many machines, by dask.distributed; this process alone writes."""

import json
import logging
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import Any

from brakecli.errors import BrakecliError, RefusedError, UsageError
from brakecli.sweeps.workers.task import (
    Compute,
    Engine,
    Finished,
    NextTask,
    Task,
    attempt,
    fingerprint,
    first_line,
)

CONNECT_SECONDS = 20
WAIT_SECONDS = 60.0
"""How long to wait for a worker to come (back) before giving up."""
FETCH_SECONDS = 5.0
"""How long to wait for a finished result, whose worker may have died with it: dask then computes it again."""
LOOK_SECONDS = 1.0
"""How often to look which workers there are."""
TASKS_PER_THREAD = 3


class ClusterEngine(Engine):
    """The workers of a dask scheduler. Dask gives the tasks of a worker that dies to others."""

    def __init__(self, compute: Compute, address: str | None, scheduler_file: str | None) -> None:
        """Connect to a scheduler and compare versions; raises UsageError or RefusedError."""
        self._compute = compute
        option, name = ("--scheduler", address) if scheduler_file is None else ("--scheduler-file", scheduler_file)
        self._where = f"{option} {name}"
        address = str(address) if scheduler_file is None else self._address_in(scheduler_file)
        self._versions = fingerprint()
        self._client = self._connected(address)
        with ExitStack() as failed:
            failed.callback(self.close)
            try:
                self._client.wait_for_workers(1, timeout=WAIT_SECONDS)
                self._compare()
                self.workers = max(1, sum(self._client.nthreads().values()))
            except BrakecliError:
                raise
            except TimeoutError as error:
                raise self._unusable(f"has no workers; start some with: dask worker {address}") from error
            except Exception as error:
                raise self._unusable(f"the scheduler does not answer ({first_line(error)})") from error
            failed.pop_all()

    def close(self) -> None:
        """Leave, which cancels what is still to be computed; scheduler and workers go on."""
        with suppress(Exception):
            self._client.close(timeout=1)

    def run(self, next_task: NextTask) -> Iterator[Finished]:
        """Compute until there are no more tasks."""
        try:
            yield from self._run(next_task)
        except BrakecliError:
            raise
        except Exception as error:  # dask raises many kinds once its scheduler is gone
            raise self._lost(f"the scheduler has gone ({first_line(error)})") from error

    def _run(self, next_task: NextTask) -> Iterator[Finished]:
        from distributed import wait

        running: dict[Any, Task] = {}
        suspects: deque[Task] = deque()  # last tries that died with a worker which had other tasks, too
        alone = None
        self._known = self._addresses()
        looked = seen = time.monotonic()
        while True:
            while len(running) < TASKS_PER_THREAD * self.workers and (task := next_task()) is not None:
                running[self._submit(task)] = task
            if suspects and not running:
                alone = suspects.popleft()
                running[self._submit(alone)] = alone
            if not running:
                yield from self._gone()
                return
            with self._client.as_current(), suppress(TimeoutError):
                wait(list(running), timeout=0.5, return_when="FIRST_COMPLETED")
            for future in [each for each in running if each.done()]:
                try:
                    finished = self._collect(future)
                except TimeoutError:
                    continue
                task = running.pop(future)
                seen = time.monotonic()
                if finished is not None:
                    yield finished
                elif task.last_try and task is not alone:
                    suspects.append(task)
                else:
                    yield Finished(task, failure="several workers of the cluster have died of it")
            if time.monotonic() - looked > LOOK_SECONDS:
                yield from self._gone()
                looked = time.monotonic()
                seen = looked if self._known else seen
            if time.monotonic() - seen > WAIT_SECONDS + LOOK_SECONDS:
                raise self._lost("has no workers any more")

    def _submit(self, task: Task) -> Any:
        return self._client.submit(_attempt, self._compute, task, self._versions, pure=False)

    def _collect(self, future: Any) -> Finished | None:
        """The end of a task, None if its workers have died. Raises TimeoutError while dask computes it again."""
        from distributed import KilledWorker

        if future.status == "cancelled":
            raise self._lost("the scheduler has gone")
        if future.status == "lost":  # with its worker; it is computed again
            raise TimeoutError
        if future.status == "error":
            if isinstance(error := future.exception(), KilledWorker):
                return None
            raise self._lost(f"a worker cannot compute ({first_line(error)})")
        finished: Finished | str = future.result(timeout=FETCH_SECONDS)
        if isinstance(finished, str):
            raise self._refused(finished)
        return finished

    def _gone(self) -> Iterator[Finished]:
        """The workers that are no longer there."""
        now = self._addresses()
        gone, self._known = sorted(self._known - now), now
        for address in gone:
            yield Finished(None, failure=f"the worker at {address} has gone")

    def _addresses(self) -> set[str]:
        try:
            return set(self._client.scheduler_info(n_workers=-1)["workers"])
        except TypeError:  # older versions report all workers anyway
            return set(self._client.scheduler_info()["workers"])

    def _lost(self, how: str) -> BrakecliError:
        return BrakecliError(f"{self._where}: {how}; finished points are kept, run the same command again")

    def _refused(self, difference: str) -> RefusedError:
        return RefusedError(f"{self._where}: {difference}; install the same version there")

    def _unusable(self, what: str) -> UsageError:
        return UsageError(f"{self._where}: {what}")

    def _address_in(self, scheduler_file: str) -> str:
        """The address in a scheduler's file; dask itself would wait for ever for the file to come."""
        try:
            return str(json.loads(Path(scheduler_file).read_text())["address"])
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
        except (ValueError, KeyError, TypeError, RecursionError):
            reason = "it holds no address"
        remedy = f"start a scheduler with: dask scheduler --scheduler-file {scheduler_file}"
        raise self._unusable(f"cannot be read: {reason}; {remedy}")

    def _connected(self, address: str) -> Any:
        try:
            from distributed import Client
        except ImportError as error:
            what = "needs dask.distributed, which is not installed; pip install 'brakecli[cluster]'"
            raise self._unusable(what) from error

        _silence("distributed", "tornado", "asyncio")

        class _Client(Client):
            def __del__(self) -> None:
                """Where its start has failed there is nothing to close; dask would try to, and complain."""

        quiet: Any = _Client
        try:
            return quiet(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except Exception as error:  # dask raises many kinds, of all its layers
            what = f"no scheduler answers ({first_line(error)}); start one with: dask scheduler"
            raise self._unusable(what) from error

    def _compare(self) -> None:
        """Refuse workers of another version: their results would not be the same."""
        try:
            found = self._client.run(_own_versions)
        except Exception as error:
            what = f"a worker cannot load brakecli ({first_line(error)}); install the same version there"
            raise self._unusable(what) from error
        for worker, theirs in sorted(found.items()):
            if difference := _difference(self._versions, theirs, f"the worker at {worker}"):
                raise self._refused(difference)


def _silence(*packages: str) -> None:
    """Keep the logs of packages off standard error; dask's loggers have got levels of their own by now."""
    for name in {*packages, *logging.root.manager.loggerDict}:
        if name.partition(".")[0] in packages:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _attempt(compute: Compute, task: Task, versions: Mapping[str, str]) -> Finished | str:
    """Compute a task in a worker of the cluster; the difference where that is of another version."""
    return _difference(versions, _own_versions(), "a worker that has come later") or attempt(compute, task)


@cache
def _own_versions() -> Mapping[str, str]:
    """Versions of the sources that this process has loaded; a long-lived worker does not notice changed files."""
    return fingerprint()


def _difference(ours: Mapping[str, str], theirs: Mapping[str, str], who: str) -> str:
    different = [key for key in ours if theirs.get(key) != ours[key]]
    return "".join(f"{key} is {theirs.get(key)} on {who} and {ours[key]} here" for key in different[:1])
