"""What a sweep will take, by counts: its points, workers, memory and the size of its result."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from brakecli.case.system import system_of
from brakecli.errors import CaseError, RefusedError, key_text
from brakecli.faces import argument
from brakecli.studies.runs.judge import to_judge
from brakecli.studies.runs.limits import FILE_BYTES, MOST_BYTES, check, refuse, within_range
from brakecli.studies.runs.plausible import implausible
from brakecli.studies.runs.together import TOGETHER, loops
from brakecli.studies.runs.work import work_of
from brakecli.studies.sweeps.early import may_be_early
from brakecli.studies.sweeps.plan import Plan, label

MOST_POINTS = 10_000_000
WORKER_WORK = 1.3
"""Work, as `runs.work` counts it, that a core does while workers start: less is not worth them."""
WORKER_BYTES = 1.8e8
"""Memory of a process; it and that of records is measured with `make bench-sweep`."""


@dataclass(frozen=True)
class Size:
    """Points and workers of a sweep, its memory, and the size of its result (bytes).

    Without workers, the process that asks computes the points itself.
    """

    points: int
    workers: int
    memory: float
    file_size: float
    together: int = 1  # points that a task should hold, as they are computed side by side
    refused: tuple[str, ...] = ()  # points that were looked at and will fail, each with its reason
    implausible: tuple[str, ...] = ()  # warnings of those points that a number is out of the range of brakes

    def sentence(self) -> str:
        """The counts in words."""
        noun = "point" if self.points == 1 else "points"
        crew = "worker" if self.workers == 1 else "workers"
        on = f" on {self.workers} {crew}" * bool(self.workers)
        memory = f"{self.memory / 1e6:.0f} MB of memory"
        return f"{self.points} {noun}{on}: {memory}, a file of {self.file_size / 1e6:.2g} MB"


def size_of(plan: Plan, workers: int, *, spare: bool = False) -> Size:
    """The size of a sweep; the first and the last of its points are looked at, none is run.

    `spare`: there are no workers where they would take longer to start than the points take.
    """
    samples = 0
    tables = 0.0
    work = 0.0
    together = TOGETHER
    failing = list[str]()
    strange = dict[str, None]()  # each said once
    critical = plan.sweep.critical
    for point in sorted({0, plan.points - 1}):
        with _noted(plan, point, failing), within_range():
            system = system_of(plan.case(plan.settings(point)))
            strange |= dict.fromkeys(implausible(system))
            refuse(check(system))
            samples = max(samples, system.samples)
            tables = max(tables, system.table_bytes)
            run = 3e-3 if may_be_early(system) else work_of(system).amount
            if critical is not None:  # by simulation, some runs look for the least sustained value
                run = 0.1 + (12.0 * run if critical.method == "simulation" else run)
            work = max(work, run)
            together = min(together, TOGETHER if plan.followed is None and loops([to_judge(system)]) else 1)
    if spare and plan.units * plan.unit_length * work < WORKER_WORK:
        workers = 0
    together = max(1, min(together, plan.units // max(workers, 1)))
    records = plan.passes * plan.points
    in_parent = 20.0 if plan.followed is None else 400.0  # which writes lines that are followed all at once
    histories = 8.0 * 24 * samples * max(workers, 1) * together
    return Size(
        points=records,
        workers=workers,
        memory=(WORKER_BYTES + tables) * (workers + 1) + histories + in_parent * records,
        file_size=150.0 * records + FILE_BYTES,
        together=together,
        refused=tuple(failing),
        implausible=tuple(strange),
    )


@contextmanager
def _noted(plan: Plan, point: int, failing: list[str]) -> Iterator[None]:
    """Within the block a point that fails when its turn comes is added to a list, with its reason."""
    try:
        yield
    except (CaseError, RefusedError) as error:
        where = ", ".join(f"{key_text(path)} = {label(value)}" for path, value in plan.settings(point).items())
        failing.append(f"point {point}{f' ({where})' if where else ''} will fail: {error}")


def refuse_sweep(size: Size, free_bytes: float) -> None:
    """Raise RefusedError where a sweep would be too large."""
    if size.points > MOST_POINTS:
        most = f"{MOST_POINTS:,} points are the most"
        raise RefusedError(f"the sweep is too large: {size.sentence()}, and {most}; take fewer points")
    if 2.0 * size.file_size > min(MOST_BYTES, free_bytes):  # finished points and the result, side by side
        free = f"{free_bytes / 1e6:.3g} MB are free"
        remedy = "free some space, or take fewer points"
        raise RefusedError(f"the file would be too large, {free}: {size.sentence()}; {remedy}")
    with suppress(ValueError, OSError):  # systems that do not say how much memory they have
        if size.memory > os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
            remedy = f"take fewer {argument('jobs')}, or sample less often"
            raise RefusedError(f"the sweep needs more memory than there is: {size.sentence()}; {remedy}")
