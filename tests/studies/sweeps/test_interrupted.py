"""Sweeps that are interrupted, or started twice."""

import os
import signal
import socket
import time
from pathlib import Path

import pytest

from tests.campaign import campaign
from tests.commands import ROOT, brakecli, ended, left_in, signalled, started, wait_until
from tests.studies.sweeps.helpers import PROGRAM, alive, journal_size, workers


@pytest.mark.parametrize(
    ("number", "group", "delay"),
    [
        (signal.SIGINT, True, 0.05),
        pytest.param(signal.SIGTERM, True, 0.6, marks=campaign),
        pytest.param(signal.SIGTERM, False, 1.0, marks=campaign),
        pytest.param(signal.SIGINT, True, 0.3, marks=campaign),
        pytest.param(signal.SIGINT, False, 0.6, marks=campaign),
        pytest.param(signal.SIGINT, True, 1.0, marks=campaign),
        pytest.param(signal.SIGTERM, False, 0.05, marks=campaign),
    ],
)
def test_a_signal_ends_a_sweep_soon_and_in_one_sentence(
    here: Path, number: signal.Signals, group: bool, delay: float
) -> None:
    """A terminal sends Ctrl-C to all processes of a command, also while they are being started."""
    word = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}[number]
    with started("sweep", "s.toml", "--quiet", "-j", "2", cwd=here) as process:
        wait_until(lambda: workers(process.pid))
        time.sleep(delay)
        crew = workers(process.pid)
        done = signalled(process, number, group=group)
    assert done.told(128 + number, f"brakecli: {word}").count("\n") == 1
    assert not any(map(alive, crew))
    assert left_in(here) <= {"tiny.toml", "s.toml", "s.h5.partial"}


@campaign
def test_a_signal_is_heard_while_a_worker_that_starts_slowly_is_waited_for(here: Path) -> None:
    """It is stopped before it can take the large cases of its sweep, which fill the pipe to it."""
    with started("large", here / "s.toml", cwd=ROOT, command=PROGRAM) as process:
        wait_until(lambda: workers(process.pid))
        (worker,) = workers(process.pid)
        os.kill(worker, signal.SIGSTOP)
        time.sleep(1.0)
        done = signalled(process, signal.SIGTERM)
    assert done.told(143) == "brakecli: terminated; nothing unfinished was left behind\n"
    assert not alive(worker)
    assert left_in(here) == {"tiny.toml", "s.toml"}  # no point is finished


@campaign
def test_an_interrupted_sweep_is_resumed_by_the_same_command(good: Path, here: Path) -> None:
    with started("sweep", "s.toml", "-q", "-j", "1", cwd=here) as process:
        wait_until(lambda: journal_size(here) > 5000)
        process.send_signal(signal.SIGINT)
        ended(process).told(130)
    assert left_in(here) == {"tiny.toml", "s.toml", "s.h5.partial"}
    done = brakecli("sweep", "s.toml", "-j", "1", "--json", cwd=here)
    resumed = done.json["resumed_points"]
    assert 5 < resumed < 120
    assert f"; {resumed} of them are there already" in done.told(0)
    assert (here / "s.h5").read_bytes() == (good / "s.h5").read_bytes()


@campaign
def test_a_second_sweep_into_the_same_output_is_refused_and_names_the_first(here: Path) -> None:
    with started("sweep", "s.toml", "-q", "-j", "1", cwd=here) as first:
        wait_until(lambda: journal_size(here) > 2000)
        first.send_signal(signal.SIGSTOP)  # or it might be finished before the second has looked
        second = brakecli("sweep", "s.toml", "-q", "--force", cwd=here)
        second.told(2, f"s.h5: is being written by process {first.pid} on {socket.gethostname()}; wait until")
        assert first.poll() is None
        first.send_signal(signal.SIGTERM)
        first.send_signal(signal.SIGCONT)
        ended(first).told(143)
