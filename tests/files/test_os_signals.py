"""Signals that come while compiled code is being loaded."""

import signal
import time
from collections.abc import Callable, Iterator

import pytest

from brakecli.files.os_signals import Interrupted, unwinding


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Handlers that do not end the tests."""
    before = {each: signal.signal(each, signal.default_int_handler) for each in (signal.SIGTERM, signal.SIGALRM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def interrupted(act: Callable[[], None]) -> Interrupted:
    """How a block ends in which something acts."""
    with pytest.raises(Interrupted, match="terminated") as caught, unwinding():
        act()
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    return caught.value


def terminate() -> None:
    signal.raise_signal(signal.SIGTERM)


def terminate_in_numba() -> None:
    """SIGTERM in a function of Numba, whose callers lose exceptions."""
    exec("terminate()", {"__name__": "numba.core", "terminate": terminate})


def test_a_signal_during_a_load_of_compiled_code_is_heard_soon_after() -> None:
    deaf = []

    def act() -> None:
        terminate_in_numba()
        start = time.monotonic()
        while time.monotonic() < start + 20.0:
            pass
        deaf.append("for 20 s")

    assert interrupted(act).exit_code == 128 + signal.SIGTERM
    assert not deaf


def test_a_signal_in_a_finalizer_which_loses_it_is_heard_soon_after(capsys: pytest.CaptureFixture[str]) -> None:
    class Dying:
        def __del__(self) -> None:
            terminate()

    deaf = []

    def act() -> None:
        Dying()
        time.sleep(20.0)
        deaf.append("for 20 s")

    interrupted(act)
    assert not deaf
    assert capsys.readouterr().err == ""


def test_a_block_ends_as_an_interruption_whatever_it_has_made_of_the_signal() -> None:
    """Compiled code sees the signal and gives up: what the block has found by then is worth nothing."""

    def fail() -> None:
        terminate_in_numba()
        raise ValueError("what the C code makes of it")

    interrupted(terminate_in_numba)
    interrupted(fail)


def test_only_the_first_signal_is_raised_and_nobody_can_lose_it() -> None:
    later = []

    def act() -> None:
        with pytest.raises(Interrupted):
            terminate()
        terminate()
        later.append("not raised")

    interrupted(act)
    assert later
