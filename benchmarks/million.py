"""A million points over two dask workers: what the parent, the scheduler and the file cost beside the points.

    python -m benchmarks.million

The points are made up, so that nothing but handing out, collecting and writing is measured; by tasks of 100 points
and of 10,000.
"""

import resource
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from brakecli.sweeps.driver import sweep
from brakecli.sweeps.workers.dask import ClusterEngine
from tests.sweeps.helpers import axis, quick, write_sweep
from tests.sweeps.test_cluster import cluster_of

POINTS = 1_000_000


def processor_seconds(process: int) -> float:
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / 100.0


def main() -> None:
    lines = ("start = 0.1", "stop = 1.0", "num = 1000")
    with tempfile.TemporaryDirectory() as name, cluster_of(Path(name) / "dask") as cluster:
        folder = Path(name)
        loaded = write_sweep(folder, axis("friction.coefficient", *lines), axis("shoe.mass", *lines))
        cluster.worker("--no-nanny")
        cluster.worker("--no-nanny")
        for size in (100, 10_000):
            begin, own, its = time.perf_counter(), time.process_time(), processor_seconds(cluster.scheduler.pid)
            with ClusterEngine(partial(quick, loaded.plan), cluster.address, None) as engine:
                sweep(loaded, folder / "s.h5", engine, force=True, task_size=size)
            seconds, tasks = time.perf_counter() - begin, POINTS // size
            parent = time.process_time() - own
            scheduler = processor_seconds(cluster.scheduler.pid) - its
            print(
                f"{POINTS} points in {tasks} tasks: {seconds:.1f} s; parent {parent:.1f} s, "
                f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB; scheduler {scheduler:.1f} s, "
                f"{1e3 * scheduler / tasks:.2g} ms a task"
            )


if __name__ == "__main__":
    sys.exit(main())
