"""Signals of the operating system, and standard streams that may be closed or full.

Only the standard library is imported here, so that signals are handled before anything large is imported.
"""

import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

from brakecli.errors import CannotWriteError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_WORDS = {signal.SIGHUP: "hung up", signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class Interrupted(BaseException):
    """A signal has arrived, and the program unwinds."""

    def __init__(self, number: int) -> None:
        """Remember which signal it was."""
        super().__init__(_WORDS[signal.Signals(number)])
        self.exit_code = 128 + number
        self.left = "nothing unfinished was left behind"


def handle_signals() -> None:
    """Let a signal end the process at once.

    No exception passes through imports, which may turn it into another one.
    """
    _handle(_leave)


@contextmanager
def unwinding() -> Iterator[Callable[[], None]]:
    """Within the block, the first signal raises `Interrupted`, so that unfinished files are removed.

    Later signals are ignored, as they would cut through the clean-up. The C code in front of a compiled function
    calls back into Python, and loses exceptions or turns them into others: an interruption there waits until the
    function that this yields is called. Whatever takes long calls it now and then.
    """
    arrived: list[int] = []

    def recall() -> None:
        if arrived:
            raise Interrupted(arrived[0])

    def note(number: int, frame: FrameType | None) -> None:
        if not arrived:
            arrived.append(number)
            if not _is_called_from_c(frame):
                recall()

    before = _handle(note)
    try:
        yield recall
    except Exception:
        recall()
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Hold back the program's own handlers of Ctrl-C, SIGTERM and SIGHUP until the block has ended.

    An exception out of a handler must not cut through HDF5, which calls back into Python, nor through a clean-up.
    """
    if threading.current_thread() is not threading.main_thread():  # Python runs handlers in the main thread only
        yield
        return
    handlers = {number: signal.getsignal(number) for number in _WORDS}
    own = {number: handler for number, handler in handlers.items() if callable(handler)}
    waiting: list[int] = []
    try:
        for number in own:
            signal.signal(number, lambda arrived, _frame: waiting.append(arrived))
        yield
    finally:
        for number, handler in own.items():
            signal.signal(number, handler)
        for arrived in waiting:
            signal.raise_signal(arrived)


def _is_called_from_c(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] in ("numba", "llvmlite"):
            return True
        frame = frame.f_back
    return False


def _handle(handler: Callable[[int, FrameType | None], None]) -> dict[signal.Signals, Any]:
    """Set a handler for all signals that are not ignored; return the handlers before.

    A shell lets background jobs ignore Ctrl-C, and nohup lets every command ignore SIGHUP.
    """
    before = {number: signal.getsignal(number) for number in _WORDS}
    before = {number: old for number, old in before.items() if old != signal.SIG_IGN}
    for number in before:
        signal.signal(number, handler)
    return before


def _leave(number: int, frame: FrameType | None) -> None:
    try:
        os.write(2, f"brakecli: {_WORDS[signal.Signals(number)]}\n".encode())
    finally:
        os._exit(128 + number)


def guard_streams() -> None:
    """Make closed streams swallow what is written, and a full standard output raise CannotWriteError once.

    A full standard error changes nothing in what a command does.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: the next file to be opened must not become a standard stream
            os.open(os.devnull, os.O_RDWR)
    for number, name in ((1, "stdout"), (2, "stderr")):
        old = getattr(sys, name)  # None where it was closed before Python started
        raw = io.BufferedWriter(_Stream(number, "w", closefd=False))
        encoding = old.encoding if old is not None else "utf-8"
        setattr(sys, name, io.TextIOWrapper(raw, encoding, "backslashreplace", line_buffering=True))


class _Stream(io.FileIO):
    """A standard stream. A failed output takes all that follows, as Python writes once more when it ends."""

    _failed = False

    def write(self, data: "ReadableBuffer") -> int:
        try:
            if not self._failed:
                return super().write(data)
        except OSError as error:
            self._failed = self.fileno() == 1
            # a broken pipe is not a failure: whoever read the output has gone
            if self._failed and not isinstance(error, BrokenPipeError):
                reason = (error.strerror or str(error)).lower()
                sentence = f"standard output: cannot write: {reason}; redirect it elsewhere"
                raise CannotWriteError(sentence) from error
        return memoryview(data).nbytes
