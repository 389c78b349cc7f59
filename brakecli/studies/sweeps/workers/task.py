"""What engines compute and how: tasks of a sweep, in worker processes on this machine or on others.

An engine takes tasks and gives back their records in any order. It reports of which task a worker has died. The
records do not depend on the engine, nor on how the units of a sweep were cut into tasks.
"""

import time
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from typing import NamedTuple

from brakecli import about
from brakecli.about import __version__
from brakecli.studies.sweeps.plan import Plan


class Task(NamedTuple):
    """Some neighbouring units. `last_try`: a worker has died of one of them before."""

    first: int
    size: int
    last_try: bool = False


class Finished(NamedTuple):
    """A task that has ended: its records and the seconds it took, or why there are no records.

    Without a task: a worker has gone, and the engine has seen to its tasks.
    """

    task: Task | None
    records: bytes | None = None
    seconds: float = 0.0
    failure: str = ""


Compute = Callable[[int, int], bytes]
"""compute(first, count): the records of some units. Workers get a pickled copy."""
NextTask = Callable[[], Task | None]
"""The next task, None where there is none now. It is asked again after each task that has ended."""


class Engine(AbstractContextManager["Engine"]):
    """Computes tasks by `workers` processes; a context, at whose end these end, too.

    `spare`: the caller may compute the tasks itself, where that takes no longer than workers take to start.
    """

    workers: int
    compute: "Compute"
    spare = False

    @abstractmethod
    def run(self, next_task: NextTask) -> Iterator[Finished]:
        """Compute until there are no more tasks."""


def attempt(compute: Compute, task: Task) -> Finished:
    """Compute a task. An error within is the task's own fault, not that of the worker or the network."""
    begin = time.perf_counter()
    try:
        return Finished(task, compute(task.first, task.size), time.perf_counter() - begin)
    except MemoryError:
        return Finished(task, failure="it ran out of memory")
    except Exception as error:  # of one task, which must not cost the others
        return Finished(task, failure=f"{type(error).__name__}: {headline(error)}")


def headline(error: object) -> str:
    """The first line of an error's text; its kind where it has none."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def compute_units(plan: Plan, first: int, count: int) -> bytes:
    """The records of some units of a sweep; the kernels are loaded when the first one is computed."""
    from brakecli.studies.sweeps.point import compute

    return compute(plan, first, count).tobytes()


@cache
def fingerprint() -> Mapping[str, str]:
    """Versions that a result may depend on: of this program, of its sources, and of the numerical libraries.

    They are those that this process has loaded: a long-lived worker does not notice changed files.
    """
    from brakecli.solver.cache_folder import source_hash
    from brakecli.studies.runs.run import versions

    sources = source_hash(Path(about.__file__).parent)
    return {"brakecli_version": __version__, "brakecli_sources": sources, **versions()}
