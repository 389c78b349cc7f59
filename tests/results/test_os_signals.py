"""Signals: a command ends at once after its clean-ups, and in Python no Ctrl-C is lost."""

import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from brakecli.case.system import system_of
from brakecli.results.atomic import new_output
from brakecli.results.os_signals import lastly
from brakecli.solver.integrate import solve
from brakecli.stop import signals_shown
from brakecli.studies.sweeps.workers.local import CallerEngine
from brakecli.studies.sweeps.workers.task import Task
from tests.commands import LIMIT, ROOT
from tests.examples import SQUEAL, make

# a command


def ended(act: str) -> tuple[int, str]:
    """How a process with the command's handlers ends that acts so: its exit code, and what it has printed."""
    script = """\
import signal, sys, time
from brakecli.results.os_signals import handle_signals, lastly, signals_deferred

def say(text):
    print(text, flush=True)
    return text

def fail():
    raise RuntimeError

def terminate():
    signal.raise_signal(signal.SIGTERM)

handle_signals()
"""
    words = [sys.executable, "-c", script + textwrap.dedent(act) + "say('goes on')"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=LIMIT)
    return done.returncode, done.stdout + done.stderr


def test_clean_ups_come_before_the_end_the_inner_ones_first_and_the_outermost_says_what_is_left() -> None:
    act = """
    with lastly(lambda: say("outer é")), lastly(fail), lastly(lambda: say("inner")), lastly(lambda: None):
        terminate()
    """
    assert ended(act) == (143, "inner\nouter é\nbrakecli: terminated; outer é\n")


def test_a_name_in_the_last_words_does_not_control_the_terminal_nor_stop_them() -> None:
    act = r"""
    with lastly(lambda: "\x1b[2J \udcff"):
        terminate()
    """
    assert ended(act) == (143, "brakecli: terminated; \\u001b[2J \\udcff\n")


def test_a_second_signal_does_not_cut_through_the_clean_ups() -> None:
    act = """
    with lastly(lambda: say("done")), lastly(lambda: signal.raise_signal(signal.SIGINT)), lastly(terminate):
        terminate()
    """
    assert ended(act) == (143, "done\nbrakecli: terminated; done\n")


def test_a_signal_waits_for_the_end_of_what_it_must_not_cut() -> None:
    act = """
    with signals_deferred():
        terminate()
        say("whole")
    """
    assert ended(act) == (143, "whole\nbrakecli: terminated\n")


@pytest.mark.parametrize(
    "place",
    [
        "exec('terminate()', {'__name__': 'numba.core', 'terminate': terminate})",
        "type('Dying', (), {'__del__': lambda self: terminate()})()",
        """
        try:
            terminate()
        except BaseException:
            pass
        """,
    ],
    ids=["a load of compiled code", "a finalizer", "a block that takes every exception"],
)
def test_no_place_loses_a_signal(place: str) -> None:
    assert ended(textwrap.dedent(place) + "\n") == (143, "brakecli: terminated\n")


@pytest.mark.parametrize("error", [None, ValueError, KeyboardInterrupt])
def test_a_clean_up_comes_once_whatever_ends_its_block(error: type[BaseException] | None) -> None:
    came = []

    def block() -> None:
        with lastly(lambda: came.append("")):
            if error:
                raise error

    if error:
        with pytest.raises(error):
            block()
    else:
        block()
    assert came == [""]


# in Python


class Dying:
    """Gets Ctrl-C as it is taken down, where Python loses the exception of its handler."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


def interrupted(act: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> None:
    """See that a block ends as an interruption in which Ctrl-C is lost before something acts."""
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)

    @signals_shown()
    def block() -> None:
        Dying()
        act()

    with pytest.raises(KeyboardInterrupt):
        block()


def test_a_block_ends_as_an_interruption_whatever_it_has_made_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise ValueError("what the C code makes of it")

    interrupted(lambda: None, monkeypatch)
    interrupted(fail, monkeypatch)
    with signals_shown():  # the next one has not been interrupted
        pass


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM])
def test_another_signal_that_the_program_hears_ends_the_block_too(number: signal.Signals) -> None:
    before = signal.signal(number, lambda *_: None)
    try:
        with pytest.raises(SystemExit, match=str(128 + number)), signals_shown():
            signal.raise_signal(number)
    finally:
        signal.signal(number, before)


def test_what_compiled_code_has_given_up_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    used: list[object] = []

    def publish() -> None:
        with new_output(tmp_path / "r.h5", force=False) as file:
            file.publish()
            used.append("a file")

    def compute() -> None:
        used.extend(CallerEngine(lambda first, count: b"").run(iter([Task(0, 1), None]).__next__))

    system = system_of(make(SQUEAL))
    for act in (publish, compute, lambda: solve(system, sink=used.append)):
        interrupted(act, monkeypatch)
    assert not used
    assert not [*tmp_path.iterdir()]
