"""What a worker process computes, on this machine or on another one."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from brakecli import __version__
from brakecli.sweeps.workers.local import Job


def work(job: Job, first: int, count: int) -> bytes:
    """The records of some units of a sweep: points, or lines along which the motion is followed."""
    with _one_compiles():
        from brakecli.sweeps.point import compute, follow
    from brakecli.sweeps.plan import plan_of

    plan = plan_of(*job)
    if plan.followed is None:
        return compute(plan, first, count).tobytes()
    return b"".join(follow(plan, line).tobytes() for line in range(first, first + count))


def fingerprint() -> dict[str, str]:
    """Versions that a result may depend on: of this program, of its sources, and of the numerical libraries."""
    from brakecli.runs.run import versions
    from brakecli.solver.compile import source_hash

    return {"brakecli_version": __version__, "brakecli_sources": source_hash(), **versions()}


@contextmanager
def _one_compiles() -> Iterator[None]:
    """Let one process at a time load kernels: several that fill one cold cache get into each other's way."""
    from brakecli.solver.compile import CACHE

    file = None
    if CACHE is not None:
        with suppress(OSError):  # a disk without locks: do without
            file = Path(f"{CACHE}.lock").open("w")  # noqa: SIM115 - closed below
            fcntl.flock(file, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if file is not None:
            file.close()
