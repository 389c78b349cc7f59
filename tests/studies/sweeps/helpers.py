"""Sweeps for the tests: files of them, work that misbehaves, an engine without processes, processes to watch.

Run as a program, this module is a process that sweeps and may come to harm.
"""

import json
import os
import re
import resource
import signal
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.api.inputs import load_sweep
from brakecli.errors import RefusedError
from brakecli.results.os_signals import handle_signals
from brakecli.studies.sweeps.driver import sweep
from brakecli.studies.sweeps.plan import LoadedSweep, Plan
from brakecli.studies.sweeps.record import Status, blank, record_type
from brakecli.studies.sweeps.result import SweepReport
from brakecli.studies.sweeps.workers.dask import ClusterEngine
from brakecli.studies.sweeps.workers.local import LocalEngine
from brakecli.studies.sweeps.workers.task import Engine, Finished, NextTask, compute_units
from tests.commands import LIMIT, ROOT, TINY, Done, run

PROGRAM = [sys.executable, "-W", "error", "-m", "tests.studies.sweeps.helpers"]
ANGLES = """\
[[axis]]
parameter = "link2.angle_deg"
values = [1.0, 3.0, 5.0]
"""
SLOWER = TINY.replace("duration = 0.02", "duration = 2.4")
"""25 ms a point."""
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
    return load_sweep(str(folder / "s.toml"), None)


# functions in place of `compute_units`: those of a module, so that worker processes find them

Compute = Callable[[Plan, int, int], bytes]


def quick(plan: Plan, first: int, count: int) -> bytes:
    """Records that hold their points as frequencies, without any simulation."""
    record = blank(record_type(plan), Status.DONE, "made up")
    records = np.repeat(record, count * plan.unit_length)
    records["frequency"] = np.arange(first * plan.unit_length, (first + count) * plan.unit_length)
    return records.tobytes()


def slow(plan: Plan, first: int, count: int) -> bytes:
    """The same, slowly."""
    time.sleep(0.1 * count)
    return quick(plan, first, count)


def threads(plan: Plan, first: int, count: int) -> bytes:
    """How many threads linear algebra may take here."""
    return os.environ.get("OPENBLAS_NUM_THREADS", "all").encode()


def deadly(plan: Plan, first: int, count: int) -> bytes:
    """The same, but for the wicked point."""
    if first <= WICKED < first + count:
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(plan, first, count)


def hungry(plan: Plan, first: int, count: int) -> bytes:
    """The same in little memory, of which the wicked point wants more than there is."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    if first <= WICKED < first + count:
        np.ones(2 * MEMORY, dtype=np.int8)
    return quick(plan, first, count)


def broken(plan: Plan, first: int, count: int) -> bytes:
    """The same, but for the wicked point, for which nothing is prepared."""
    if first <= WICKED < first + count:
        raise ZeroDivisionError("division by zero\nin two lines")
    return quick(plan, first, count)


def padded(padding: bytes, plan: Plan, first: int, count: int) -> bytes:
    """The same, by a function that is large."""
    return quick(plan, first, count)


def deaf(plan: Plan, first: int, count: int) -> bytes:
    """A computation of hours within one call of C, which lets no other thread run; a file tells that it runs."""
    Path(f"{os.getpid()}.computes").touch()
    re.fullmatch(r"(a+)+b", "a" * 60)
    return quick(plan, first, count)


# engines and sweeps


class Inline(Engine):
    """An engine without workers, which takes `limit` tasks and is then interrupted; backwards with `order` -1."""

    workers = 1

    def __init__(self, plan: Plan, compute: Compute, limit: int | None = None, order: int = 1) -> None:
        self._plan = plan
        self._compute = compute
        self._limit = limit
        self._order = order

    def __exit__(self, *error: object) -> None:
        pass

    def run(self, next_task: NextTask) -> Iterator[Finished]:
        tasks = iter(next_task, None)
        for done, task in enumerate(tasks if self._order > 0 else [*tasks][::-1]):
            if done == self._limit:
                raise KeyboardInterrupt
            yield Finished(task, self._compute(self._plan, task.first, task.size), 0.1)


def inline(
    loaded: LoadedSweep, output: Path, compute: Compute = quick, limit: int | None = None, **options: Any
) -> SweepReport:
    """Sweep in this process."""
    engine = Inline(loaded.plan, compute, limit, options.pop("order", 1))
    return sweep(loaded, output, engine, **({"force": False} | options))


def interrupted(loaded: LoadedSweep, output: Path, compute: Compute = quick, **options: Any) -> None:
    """Begin a sweep in this process, and leave its journal."""
    try:
        inline(loaded, output, compute, **options)
    except KeyboardInterrupt:
        return
    raise AssertionError("the sweep was not interrupted")


def local(loaded: LoadedSweep, output: Path, compute: Compute, workers: int = 2, **options: Any) -> SweepReport:
    """Sweep in worker processes."""
    with LocalEngine(partial(compute, loaded.plan), workers) as engine:
        return sweep(loaded, output, engine, **({"force": False} | options))


# processes


def _proc(pid: int | str, name: str) -> str:
    """A file of the system on a process; empty once that has ended."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text()
    except OSError:
        return ""


def _state_and_parent(pid: int) -> list[str]:
    return _proc(pid, "stat").rpartition(")")[2].split()[:2] or ["Z", "0"]


def alive(pid: int) -> bool:
    return _state_and_parent(pid)[0] != "Z"


def children(pid: int) -> set[int]:
    """The processes that a process has started."""
    numbers = {int(folder.name) for folder in Path("/proc").glob("[0-9]*")}
    return {each for each in numbers if _state_and_parent(each)[1] == str(pid) and alive(each)}


def workers(pid: int) -> set[int]:
    """The worker processes among them."""
    return {each for each in children(pid) if "spawn_main" in _proc(each, "cmdline")}


def peak(pid: int | str) -> int:
    """The most memory that a process has had, in bytes; 0 once it has ended."""
    return sum(int(line.split()[1]) * 1024 for line in _proc(pid, "status").splitlines() if "VmHWM:" in line)


def program(*arguments: str | Path, limit: float = LIMIT) -> Done:
    """Run this module as a program."""
    return run(*arguments, cwd=ROOT, command=PROGRAM, limit=limit)


def journal_size(folder: Path) -> int:
    try:
        return (folder / "s.h5.partial").stat().st_size
    except FileNotFoundError:
        return 0


# what this module does as a program


def stuck(file: str) -> None:
    """Start workers whose computation does not end."""
    os.chdir(Path(file).parent)
    local(load_sweep(file, None), Path(file).with_suffix(".h5"), deaf)


def large(file: str) -> None:
    """Start a worker that is to get ten megabytes, as a command does."""
    handle_signals()
    local(load_sweep(file, None), Path(file).with_suffix(".h5"), partial(padded, bytes(10_000_000)), 1)


def memory(file: str, name: str) -> None:
    """Sweep by a function, and print the largest memory of this process and of its workers, in bytes."""
    largest = 0
    looked = 0.0

    def progress(*_: int) -> None:
        nonlocal largest, looked
        if time.monotonic() - looked > 0.2:
            looked = time.monotonic()
            largest = max([largest, *map(peak, workers(os.getpid()))])

    functions: dict[str, Compute] = {"compute_units": compute_units, "quick": quick}
    report = local(load_sweep(file, None), Path(file).with_suffix(".h5"), functions[name], 1, progress=progress)
    numbers = {"points": report.findings.points, "failed": report.findings.failed, "workers": largest}
    print(json.dumps({**numbers, "parent": peak("self"), "seconds": report.seconds}))  # noqa: T201


def refused(*files: str) -> None:
    """Try sweeps that are too large, and print the largest memory of this process, in bytes."""
    for file in files:
        try:
            local(load_sweep(file, None), Path(file).with_suffix(".h5"), compute_units)
        except RefusedError:
            continue
        raise AssertionError(file)
    print(peak("self"))  # noqa: T201


def on_cluster(file: str, address: str) -> None:
    """Sweep on a cluster, with functions of this module; print what has come of it."""
    loaded = load_sweep(file, None)
    functions: dict[str, Compute] = {"deadly": deadly, "hungry": hungry}
    found = {}
    for name, function in functions.items():
        with ClusterEngine(partial(function, loaded.plan), address, None) as engine:
            report = sweep(loaded, Path(file).with_name(f"{name}.h5"), engine, force=False, task_size=5)
        found[name] = {"failures": report.findings.failures, "notes": report.notes}
    print(json.dumps(found))  # noqa: T201


if __name__ == "__main__":
    choices: list[Callable[..., None]] = [stuck, large, memory, refused, on_cluster]
    {each.__name__: each for each in choices}[sys.argv[1]](*sys.argv[2:])
