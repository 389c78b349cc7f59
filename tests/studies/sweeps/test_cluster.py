"""Sweeps on a dask cluster of processes: the same bytes, and what may befall workers, scheduler and network."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from brakecli.studies.sweeps.workers.task import compute_units
from tests.campaign import campaign
from tests.commands import ROOT, TINY, brakecli, ended, environment, left_in, run, signalled, started, wait_until
from tests.studies.sweeps.helpers import (
    ANGLES,
    SLOWER,
    WICKED,
    alive,
    axis,
    children,
    frictions,
    inline,
    journal_size,
    program,
    write_sweep,
)

IMPATIENT = (
    "import brakecli.studies.sweeps.workers.dask as c; c.CONNECT_SECONDS = 1; c.WAIT_SECONDS = 1.0; "
    "from brakecli.__main__ import main; main()"
)
COMMAND = [sys.executable, "-W", "error", "-c", IMPATIENT]
LATE = (  # results are fetched long after they are there, so that a worker dies in between
    "import distributed, time; soon = distributed.wait; "
    "distributed.wait = lambda *a, **k: (soon(*a, **k), time.sleep(1.0)); "
)

pytestmark = pytest.mark.usefixtures("compiled")


class Cluster:
    """A scheduler in a process of its own, and workers in others, on the loopback address."""

    def __init__(self, folder: Path, stack: ExitStack, allowed_failures: int) -> None:
        self.folder = folder
        self._stack = stack
        self.file = folder / "scheduler.json"
        options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file)]
        failures = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(allowed_failures)}
        self.scheduler = self._start("distributed.cli.dask_scheduler", options, **failures)
        wait_until(lambda: self.file.exists() and self.file.read_text().endswith("}"))
        self.address: str = json.loads(self.file.read_text())["address"]

    def worker(self, *options: str, **changes: str) -> subprocess.Popen[bytes]:
        """One more worker; a moment passes until the scheduler knows it."""
        known = {"host": "127.0.0.1", "nthreads": 1, "memory-limit": 0, "death-timeout": 30}
        known["local-directory"] = str(self.folder)
        words = [word for name, value in known.items() for word in (f"--{name}", str(value))]
        words += ["--no-dashboard", *options]
        return self._start("distributed.cli.dask_worker", [self.address, *words], **changes)

    def _start(self, module: str, options: list[str], **changes: str) -> subprocess.Popen[bytes]:
        # without -W error: their warnings are not ours
        return self._stack.enter_context(
            started(
                *options,
                cwd=self.folder,
                command=[sys.executable, "-m", module],
                stdin=subprocess.DEVNULL,
                output=False,
                **changes,
            )
        )


@contextmanager
def cluster_of(folder: Path, allowed_failures: int = 3) -> Iterator[Cluster]:
    folder.mkdir()
    with ExitStack() as stack:
        yield Cluster(folder, stack, allowed_failures)


@pytest.fixture(scope="module")
def cluster(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A scheduler with two workers, one of which is watched over by dask's nanny."""
    with cluster_of(tmp_path_factory.mktemp("cluster") / "dask") as cluster:
        cluster.worker("--nanny")
        cluster.worker("--no-nanny")
        yield cluster


@pytest.fixture(scope="module")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a sweep and its result, only to be read."""
    folder = tmp_path_factory.mktemp("good")
    inline(write_sweep(folder, frictions(20), ANGLES, case=SLOWER), folder / "s.h5", compute_units)
    return folder


# the same bytes


@campaign
def test_a_cluster_gives_the_bytes_of_a_sweep_at_home(cluster: Cluster, good: Path, here: Path) -> None:
    done = brakecli("sweep", "s.toml", "--scheduler", cluster.address, "--task-size", "7", "--json", cwd=here)
    assert re.fullmatch(r"brakecli: 60 points on [12] workers?: \d+ MB of memory, .*\n", done.told(0))
    assert done.json["points"] == 60
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5"}


@pytest.mark.parametrize("method", ["eigenvalue", "run"])
@campaign
def test_so_does_a_study_of_scatter(cluster: Cluster, tmp_path: Path, method: str) -> None:
    (tmp_path / "case.toml").write_text(TINY)
    scatters = '[[parameter]]\nkey = "friction.coefficient"\ndistribution = "uniform"\nlow = 0.1\nhigh = 0.9\n'
    study = f'case = "case.toml"\nsamples = 16\nmethod = "{method}"\nindices_of = "none"\n{scatters}'
    (tmp_path / "s.toml").write_text(study)
    for target, options in (("a.h5", ["--jobs", "1"]), ("b.h5", ["--scheduler", cluster.address])):
        brakecli("scatter", "s.toml", *options, "-o", target, cwd=tmp_path).told(0)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


@campaign
def test_a_scheduler_is_found_by_its_file_and_by_the_environment(cluster: Cluster, tmp_path: Path) -> None:
    both = frictions(4, 'direction = "both"'), axis("link2.angle_deg", "values = [1.0, 5.0]")
    search = '[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = 2.0\nmethod = "eigenvalue"\n'
    loaded = write_sweep(tmp_path, *both)
    inline(loaded, tmp_path / "followed.h5", compute_units)
    brakecli("sweep", "s.toml", "-q", "--scheduler-file", cluster.file, "--task-size", "1", cwd=tmp_path).told(0)
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "followed.h5").read_bytes()
    loaded = write_sweep(tmp_path, both[1], search)
    inline(loaded, tmp_path / "critical.h5", compute_units)
    command = ["sweep", "s.toml", "-q", "--force"]
    run(*command, cwd=tmp_path, DASK_SCHEDULER_ADDRESS=cluster.address).told(0)
    assert (tmp_path / "s.h5").read_bytes() == (tmp_path / "critical.h5").read_bytes()


@campaign
def test_in_python_a_client_leads_to_its_cluster_and_stays_open(cluster: Cluster, good: Path, here: Path) -> None:
    script = f"""
import distributed
import brakecli
with distributed.Client({cluster.address!r}, set_as_default=False) as client:
    brakecli.sweep("s.toml", output="s.h5", scheduler=client)
    assert client.submit(abs, -3).result() == 3
"""
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=here, env=environment(), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


# workers that die


@campaign
@pytest.mark.parametrize("nanny", ["--nanny", "--no-nanny"])
def test_a_killed_worker_costs_a_warning_and_no_point(good: Path, here: Path, nanny: str) -> None:
    with cluster_of(here / "dask") as cluster:
        crew = [cluster.worker(nanny), cluster.worker("--no-nanny")]
        with started(
            "sweep", "s.toml", "-q", "--scheduler", cluster.address, "--task-size", "1", cwd=here
        ) as process:
            wait_until(lambda: journal_size(here) > 5000)
            victims = children(crew[0].pid) if nanny == "--nanny" else {crew[0].pid}
            for pid in victims:
                os.kill(pid, signal.SIGKILL)
            told = ended(process).told(0, "brakecli: warning: a worker process has failed (the worker")
    assert victims
    assert told.count("\n") == 1
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


# interruptions


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@campaign
def test_a_signal_ends_a_sweep_whose_points_are_kept(
    cluster: Cluster, good: Path, here: Path, number: signal.Signals
) -> None:
    with started("sweep", "s.toml", "-q", "--scheduler", cluster.address, cwd=here) as process:
        wait_until(lambda: journal_size(here) > 2000)
        done = signalled(process, number, group=True)
    assert done.told(128 + number, "brakecli: ").count("\n") == 1
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5.partial"}
    if number == signal.SIGTERM:
        return
    resumed = brakecli("sweep", "s.toml", "-j", "1", cwd=here)  # what one engine has begun another one ends
    assert re.search(r"; [1-9]\d* of them are there already", resumed.told(0))
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@campaign
def test_a_signal_ends_the_wait_for_a_scheduler(tmp_path: Path, number: signal.Signals) -> None:
    write_sweep(tmp_path, frictions(4))
    with started("sweep", "s.toml", "--scheduler", "tcp://127.0.0.1:9", cwd=tmp_path) as process:
        wait_until(
            lambda: b"tornado" in Path(f"/proc/{process.pid}/maps").read_bytes() or process.poll() is not None
        )
        time.sleep(1.0)
        done = signalled(process, number)
    assert done.told(128 + number, "brakecli: ").count("\n") == 1
    assert left_in(tmp_path) == {"tiny.toml", "s.toml"}


# what is not there, or not the same


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--scheduler", "nonsense"], "--scheduler nonsense: no scheduler answers (missing port number"),
        (["--scheduler-file", "none"], "--scheduler-file none: cannot be read: no such file or directory; start"),
        (["--scheduler-file", "tiny.toml"], "--scheduler-file tiny.toml: cannot be read: it holds no address"),
    ],
)
def test_a_scheduler_that_does_not_exist_is_reported(tmp_path: Path, options: list[str], reason: str) -> None:
    write_sweep(tmp_path, frictions(4))
    assert brakecli("sweep", "s.toml", *options, cwd=tmp_path).told(2, reason).count("\n") == 1
    assert left_in(tmp_path) == {"tiny.toml", "s.toml"}


@campaign
def test_a_scheduler_that_does_not_answer_is_not_waited_for_for_ever(tmp_path: Path) -> None:
    write_sweep(tmp_path, frictions(4))
    done = run("sweep", "s.toml", "--scheduler", "tcp://127.0.0.1:9", cwd=tmp_path, command=COMMAND)
    told = done.told(2, "--scheduler tcp://127.0.0.1:9: no scheduler answers (Timed out")
    assert told.count("\n") == 1
    assert left_in(tmp_path) == {"tiny.toml", "s.toml"}


@campaign
def test_a_cluster_without_workers_or_with_those_of_another_version_is_reported(here: Path) -> None:
    with cluster_of(here / "dask") as cluster:
        command = ["sweep", "s.toml", "-q", "--scheduler", cluster.address]
        none = run(*command, cwd=here, command=COMMAND)
        told = none.told(2, f"--scheduler {cluster.address}: has no workers; start some with: dask worker tcp://")
        assert told.count("\n") == 1

        other = here / "other"
        other.mkdir()
        (other / "sitecustomize.py").write_text('from brakecli import about; about.__version__ = "99.0"')
        cluster.worker("--no-nanny")
        write_sweep(here, frictions(2000), ANGLES, case=SLOWER)  # far longer than a worker takes to start
        with started(*command, cwd=here) as process:
            wait_until(lambda: journal_size(here) > 1500)
            cluster.worker("--no-nanny", PYTHONPATH=f"{other}:{ROOT}")  # one that comes later
            told = ended(process).told(3, "brakecli_version is 99.0 on a worker that joined later")
        assert told.count("\n") == 1
        kept = journal_size(here)
        assert kept > 1500

        refused = brakecli(*command, cwd=here)
        told = refused.told(
            3, "brakecli_version is 99.0 on the worker at tcp://", "install the same version there"
        )
        assert told.count("\n") == 1
        assert journal_size(here) == kept


@campaign
def test_a_scheduler_that_dies_ends_the_sweep_with_a_sentence(here: Path) -> None:
    with cluster_of(here / "dask") as cluster:
        cluster.worker("--no-nanny")
        with started("sweep", "s.toml", "-q", "--scheduler", cluster.address, cwd=here) as process:
            wait_until(lambda: journal_size(here) > 1500)
            cluster.scheduler.kill()
            done = ended(process, limit=10.0)
    told = done.told(1, "the scheduler has gone", "finished points are kept, run the same command again")
    assert told.count("\n") == 1
    assert journal_size(here) > 1500
    assert left_in(here) - {"dask"} == {"tiny.toml", "s.toml", "s.h5.partial"}


@pytest.mark.parametrize("before", ["", LATE])
@campaign
def test_a_cluster_without_workers_is_waited_for_and_then_given_up(here: Path, before: str) -> None:
    with cluster_of(here / "dask") as cluster:
        only = cluster.worker("--no-nanny")
        command = ["sweep", "s.toml", "-q", "--scheduler", cluster.address]
        with started(*command, cwd=here, command=[*COMMAND[:-1], before + IMPATIENT]) as process:
            wait_until(lambda: journal_size(here) > 1500)
            only.kill()
            done = ended(process)
    assert done.told(1, "has no workers any more; finished points are kept").count("\n") == 1
    assert not alive(only.pid)


@campaign
def test_a_point_that_ends_its_worker_is_marked_and_all_others_are_computed(tmp_path: Path) -> None:
    """No failure is allowed: every task that a dying worker has had at the time comes back, guilty or not."""
    write_sweep(tmp_path, frictions(20))
    with cluster_of(tmp_path / "dask", allowed_failures=0) as cluster:
        for _ in range(2):
            cluster.worker("--nanny")
        done = program("on_cluster", tmp_path / "s.toml", cluster.address)
    assert done.told(0) == ""
    for name, reason in (
        ("deadly", "workers of the cluster have died of it"),
        ("hungry", "it ran out of memory"),
    ):
        found = done.json[name]
        assert [failure["point"] for failure in found["failures"]] == [WICKED]
        assert reason in found["failures"][0]["reason"]
        assert len(found["notes"]) == 1
