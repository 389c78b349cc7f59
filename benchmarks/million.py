"""Many points over dask workers on one machine: what handing out, collecting and writing cost beside the points.

    python -m benchmarks.million [POINTS [POINTS_KILLED]]

First a million points that are made up, by tasks of 100 points and of 10,000, over two workers. Then POINTS real
ones of a rough shoe (10⁶ unless given) over four workers, by the command itself. Then POINTS_KILLED (20,000)
undisturbed, and once more with workers killed and the command, too: the file must hold the same bytes. All shares
are those of processor time. Parent and scheduler also take some 50 ms of it each second, whatever is computed, so
that a machine with other work gives larger shares.
"""

import os
import resource
import sys
import tempfile
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from brakecli.studies.sweeps.driver import journal_path, sweep
from brakecli.studies.sweeps.workers.dask import ClusterEngine
from tests.commands import started, wait_until
from tests.studies.sweeps.helpers import axis, quick, write_sweep
from tests.studies.sweeps.test_cluster import Cluster, cluster_of

MADE_UP = 1_000_000
ROUGH = Path(__file__).parents[1] / "cases" / "accuracy" / "B.toml"
SETTINGS = ("solver={tolerance=1e-2, duration=0.02}", "output.sample_interval=1e-4")
WORKERS = 4
FEW = 32 * 32  # points whose cost counts as that of start, end and the points drawn before the start
POINTS = 1_000_000, 20_000
TICKS = os.sysconf("SC_CLK_TCK")


def processor_seconds(process: int) -> float:
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / TICKS


def made_up(folder: Path, cluster: Cluster) -> None:
    lines = ("start = 0.1", "stop = 1.0", "num = 1000")
    loaded = write_sweep(folder, axis("friction.coefficient", *lines), axis("shoe.mass", *lines))
    crew = [cluster.worker("--no-nanny").pid for _ in range(2)]
    for size in (100, 10_000):
        begin = time.perf_counter()
        own = time.process_time()
        others = [processor_seconds(each) for each in (cluster.scheduler.pid, *crew)]
        with ClusterEngine(partial(quick, loaded.plan), cluster.address, None) as engine:
            sweep(loaded, folder / "s.h5", engine, force=True, task_size=size)
        seconds = time.perf_counter() - begin
        tasks = MADE_UP // size
        parent = time.process_time() - own
        now = [processor_seconds(each) for each in (cluster.scheduler.pid, *crew)]
        scheduler, *workers = (after - before for after, before in zip(now, others, strict=True))
        print(
            f"{MADE_UP} made-up points in {tasks} tasks: {seconds:.1f} s; parent {parent:.1f} s, "
            f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB; scheduler {scheduler:.1f} s, "
            f"{1e3 * scheduler / tasks:.2g} ms a task; workers {1e3 * sum(workers) / tasks:.2g} ms a task",
            flush=True,
        )


def write_rough(folder: Path, points: int) -> int:
    """A map of the rough shoe over friction and the angle of a link, in map.toml; how many points it has."""
    side = round(points**0.5)
    axes = (("friction.coefficient", 0.1, 0.6), ("link2.angle_deg", 10.0, 50.0))
    tables = (axis(key, f"start = {low}", f"stop = {high}", f"num = {side}") for key, low, high in axes)
    (folder / "map.toml").write_text("\n".join((f'case = "{ROUGH}"', *tables)))
    return side * side


def command(output: Path, cluster: Cluster) -> list[str | Path]:
    settings = [word for each in SETTINGS for word in ("--set", each)]
    return ["sweep", "map.toml", "-q", "--force", *settings, "--scheduler", cluster.address, "-o", output]


def swept(folder: Path, cluster: Cluster, crew: list[int], points: int) -> tuple[float, float, float, float]:
    """Processor seconds of parent, scheduler and workers, and the parent's largest memory in bytes."""
    write_rough(folder, points)
    others = cluster.scheduler.pid, *crew
    before = [processor_seconds(each) for each in others]
    with started(*command(folder / "map.h5", cluster), cwd=folder, output=False) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    scheduler, *workers = (processor_seconds(each) - was for each, was in zip(others, before, strict=True))
    return used.ru_utime + used.ru_stime, scheduler, sum(workers), 1024.0 * used.ru_maxrss


def rough(folder: Path, cluster: Cluster, points: int) -> None:
    """What a sweep of more points costs beyond one of a few."""
    crew = [cluster.worker("--no-nanny").pid for _ in range(WORKERS)]
    swept(folder, cluster, crew, FEW)  # workers load their kernels
    few = swept(folder, cluster, crew, FEW)
    begin = time.perf_counter()
    found = swept(folder, cluster, crew, points)
    seconds = time.perf_counter() - begin
    points = write_rough(folder, points)
    size = (folder / "map.h5").stat().st_size
    parent, scheduler, workers, memory = (one - other for one, other in zip(found, few, strict=True))
    more = points - FEW
    share = (parent + scheduler) / (parent + scheduler + workers)
    print(
        f"{points} rough points over {WORKERS} workers: {seconds:.0f} s, of the processor {sum(found[:3]):.0f} s; "
        f"{found[0] + found[1]:.1f} s of parent and scheduler, {few[0] + few[1]:.1f} s of it for {FEW}\n"
        f"a point: workers {1e3 * workers / more:.3f} ms, parent {1e6 * parent / more:.1f} µs, "
        f"scheduler {1e6 * scheduler / more:.1f} µs, a share of {share:.2%}; with start and end "
        f"{sum(found[:2]) / sum(found[:3]):.2%}\n"
        f"parent: {found[3] / 1e6:.0f} MB, {memory / more:.0f} bytes a point; "
        f"result {size / points:.1f} bytes a point",
        flush=True,
    )


def killed(folder: Path, cluster: Cluster, points: int) -> None:
    """Workers are killed at a fifth and two fifths of the journal, the command at a third and at three fifths."""
    output = folder / "killed.h5"
    crew = [cluster.worker("--no-nanny") for _ in range(WORKERS)]
    points = write_rough(folder, points)
    whole = 0

    def size() -> int:
        return journal_path(output).stat().st_size if journal_path(output).exists() else 0

    def grown(part: float) -> None:
        wait_until(lambda: size() > part * whole, seconds=3600.0)

    with started(*command(folder / "whole.h5", cluster), cwd=folder, output=False) as process:
        while process.poll() is None:  # its journal tells how far the others are
            path = journal_path(folder / "whole.h5")
            whole = max(whole, path.stat().st_size if path.exists() else 0)
            time.sleep(0.05)
        assert process.returncode == 0
    for worker_at, command_at in ((0.2, 1 / 3), (0.4, 0.6)):
        with started(*command(output, cluster), cwd=folder, output=False) as process:
            grown(worker_at)
            crew.pop(0).kill()
            crew.append(cluster.worker("--no-nanny"))
            grown(command_at)
            assert process.poll() is None
            process.kill()
    left = size()
    with started(*command(output, cluster), cwd=folder, output=False) as process:
        assert process.wait() == 0
    same = output.read_bytes() == (folder / "whole.h5").read_bytes()
    print(
        f"{points} rough points, two workers killed, and twice the command at {left / whole:.0%}: "
        f"{'the same bytes' if same else 'OTHER BYTES'}; journal {whole / points:.1f} bytes a point",
        flush=True,
    )
    assert same


def main() -> None:
    points, points_killed = [*map(int, sys.argv[1:]), *POINTS[len(sys.argv) - 1 :]]
    for part in (made_up, partial(rough, points=points), partial(killed, points=points_killed)):
        with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
            part(Path(name), stack.enter_context(cluster_of(Path(name) / "dask")))


if __name__ == "__main__":
    sys.exit(main())
