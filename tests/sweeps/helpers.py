"""Sweeps for the tests: files of them, work that misbehaves, an engine without processes, processes to watch.

Run as a program, this module is a process that sweeps and may come to harm.
"""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from brakecli.errors import RefusedError
from brakecli.sweeps.driver import sweep
from brakecli.sweeps.file import LoadedSweep, read_sweep
from brakecli.sweeps.plan import plan_of
from brakecli.sweeps.point import Status, blank, record_type
from brakecli.sweeps.result import SweepReport
from brakecli.sweeps.workers.dask import ClusterEngine
from brakecli.sweeps.workers.local import Finished, Job, LocalEngine, Supply, Work
from brakecli.sweeps.workers.task import work
from tests.commands import COMMAND, LIMIT, TINY, Done, environment

WICKED = 7
"""The point that ends its worker."""
MEMORY = 400_000_000
"""Bytes that `hungry` leaves its process, and that one point wants twice."""


def axis(parameter: str, *lines: str) -> str:
    """An axis of a sweep file."""
    return "\n".join(("[[axis]]", f'parameter = "{parameter}"', *lines, ""))


def frictions(num: int, *more: str) -> str:
    """An axis of friction coefficients."""
    return axis("friction.coefficient", "start = 0.1", "stop = 1.0", f"num = {num}", *more)


def write_sweep(folder: Path, *tables: str, case: str = TINY) -> LoadedSweep:
    """A sweep of the tiny case, in s.toml."""
    (folder / "tiny.toml").write_text(case)
    (folder / "s.toml").write_text("\n".join(('case = "tiny.toml"', *tables)))
    return read_sweep(str(folder / "s.toml"))


# work instead of that of the program: a function of a module, so that worker processes find it


def quick(job: Job, first: int, count: int) -> bytes:
    """Records that tell their points, without any simulation."""
    plan = plan_of(*job)
    record = blank(record_type(plan), Status.DONE, "made up")
    records = np.repeat(record, count * plan.unit_length)
    records["frequency"] = np.arange(first * plan.unit_length, (first + count) * plan.unit_length)
    return records.tobytes()


def slow(job: Job, first: int, count: int) -> bytes:
    """The same, slowly."""
    time.sleep(0.1 * count)
    return quick(job, first, count)


def deadly(job: Job, first: int, count: int) -> bytes:
    """The same, but for the wicked point."""
    if first <= WICKED < first + count:
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(job, first, count)


def hungry(job: Job, first: int, count: int) -> bytes:
    """The same in little memory, of which the wicked point wants more than there is."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    if first <= WICKED < first + count:
        np.ones(2 * MEMORY, dtype=np.int8)
    return quick(job, first, count)


def broken(job: Job, first: int, count: int) -> bytes:
    """The same, but for the wicked point, for which nothing is prepared."""
    if first <= WICKED < first + count:
        raise ZeroDivisionError("division by zero\nin two lines")
    return quick(job, first, count)


def deaf(job: Job, first: int, count: int) -> bytes:
    """A computation of hours within one call of C, which lets no other thread run; a file tells that it runs."""
    Path(f"{os.getpid()}.computes").touch()
    re.fullmatch(r"(a+)+b", "a" * 60)
    return quick(job, first, count)


# engines and sweeps


class Inline:
    """An engine without workers, which takes `limit` tasks and is then interrupted."""

    workers = 1

    def __init__(self, job: Job, work: Work = work, limit: int | None = None) -> None:
        self._job, self._work, self._limit = job, work, limit

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def run(self, supply: Supply) -> Iterator[Finished]:
        done = 0
        while (task := supply()) is not None:
            if done == self._limit:
                raise KeyboardInterrupt
            done += 1
            yield Finished(task, self._work(self._job, task.first, task.size), 0.1)


def job_of(loaded: LoadedSweep) -> Job:
    return Job(loaded.plan.sweep_text, loaded.plan.case_text)


def inline(
    loaded: LoadedSweep, output: Path, work: Work = quick, limit: int | None = None, **options: Any
) -> SweepReport:
    """Sweep in this process."""
    return sweep(loaded, output, Inline(job_of(loaded), work, limit), **({"force": False} | options))


def local(loaded: LoadedSweep, output: Path, work: Work, workers: int = 2, **options: Any) -> SweepReport:
    """Sweep in worker processes."""
    with LocalEngine(job_of(loaded), work, workers) as engine:
        return sweep(loaded, output, engine, **({"force": False} | options))


# processes


def children(pid: int) -> set[int]:
    """The processes that a process has started."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = stat.read_text().rpartition(")")[2].split()[:2]
        except (OSError, ValueError):  # it has ended meanwhile
            continue
        if int(parent) == pid and state != "Z":
            found.add(int(stat.parent.name))
    return found


def workers(pid: int) -> set[int]:
    """The worker processes among them."""
    return {each for each in children(pid) if b"spawn_main" in _command(each)}


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (OSError, IndexError):
        return False


def peak(pid: int | str) -> int:
    """The most memory that a process has had, in bytes."""
    text = Path(f"/proc/{pid}/status").read_text()
    return next(int(line.split()[1]) * 1024 for line in text.splitlines() if line.startswith("VmHWM"))


def _command(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


@contextmanager
def started(
    *arguments: str | Path, cwd: Path, command: Sequence[str] = COMMAND, output: bool = True, **changes: str | None
) -> Iterator[subprocess.Popen[bytes]]:
    """A command that is running, in a group of processes of its own; all of it is killed at the end."""
    process = subprocess.Popen(
        [*command, *map(str, arguments)],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE if output else subprocess.DEVNULL,
        stderr=subprocess.PIPE if output else subprocess.DEVNULL,
        env=environment(**changes),
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def ended(process: subprocess.Popen[bytes]) -> Done:
    """A command that ends by itself."""
    out, err = process.communicate(timeout=LIMIT)
    return Done(process.returncode, out.decode(), err.decode())


def run(*arguments: str | Path, cwd: Path, command: Sequence[str] = COMMAND, **changes: str | None) -> Done:
    """Run a command to its end; a process of its own, as those of sweeps start others."""
    with started(*arguments, cwd=cwd, command=command, output=True, **changes) as process:
        return ended(process)


def wait_until(condition: Callable[[], object], seconds: float = LIMIT) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def journal_size(folder: Path) -> int:
    try:
        return (folder / "s.h5.partial").stat().st_size
    except FileNotFoundError:
        return 0


# what this module does as a program


def stuck(file: str) -> None:
    """Start workers whose computation does not end."""
    os.chdir(Path(file).parent)
    local(read_sweep(file), Path(file).with_suffix(".h5"), deaf)


def memory(file: str) -> None:
    """Sweep, and tell the largest memory of this process and of its workers, in bytes."""
    largest: list[int] = [0]

    def progress(_: object) -> None:
        if time.monotonic() - told[0] > 0.2:
            told[0] = time.monotonic()
            largest[0] = max([largest[0], *map(_peak_or_nothing, workers(os.getpid()))])

    told = [0.0]
    report = local(read_sweep(file), Path(file).with_suffix(".h5"), work, progress=progress)
    numbers = {"points": report.findings.points, "failed": report.findings.failed, "workers": largest[0]}
    print(json.dumps({**numbers, "parent": peak("self"), "seconds": report.seconds}))  # noqa: T201


def refused(file: str) -> None:
    """Try a sweep that is too large, and tell the largest memory of this process, in bytes."""
    try:
        local(read_sweep(file), Path(file).with_suffix(".h5"), work)
    except RefusedError:
        print(peak("self"))  # noqa: T201


def _peak_or_nothing(pid: int) -> int:
    try:
        return peak(pid)
    except (OSError, StopIteration):
        return 0


def on_cluster(file: str, name: str, address: str) -> None:
    """Sweep on a cluster, with a work of this module; tell what has come of it."""
    loaded = read_sweep(file)
    works: dict[str, Work] = {"deadly": deadly, "hungry": hungry, "broken": broken}
    with ClusterEngine(job_of(loaded), works[name], address, None) as engine:
        report = sweep(loaded, Path(file).with_suffix(".h5"), engine, force=False, task_size=5)
    print(json.dumps({"failures": report.findings.failures, "notes": report.notes}))  # noqa: T201


if __name__ == "__main__":
    actions: dict[str, Callable[..., None]] = {
        "stuck": stuck,
        "memory": memory,
        "refused": refused,
        "on_cluster": on_cluster,
    }
    actions[sys.argv[1]](*sys.argv[2:])
