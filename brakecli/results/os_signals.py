"""Signals of the operating system, and standard streams that may be closed or full.

Only the standard library is imported here, so that signals are handled before anything large is imported.
"""

import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from brakecli.errors import CannotWriteError, escaped
from brakecli.stop import show_signals

if TYPE_CHECKING:
    from signal import _HANDLER

    from _typeshed import ReadableBuffer

_WORDS: dict[int, str] = {
    signal.SIGHUP: "hung up",
    signal.SIGTERM: "terminated",
    signal.SIGINT: "interrupted",  # last: a KeyboardInterrupt cuts through what handles the signals in their order
}
_last: list[Callable[[], str | None]] = []  # what `lastly` still has to call


def handle_signals() -> None:
    """Let a signal end the process at once, after what `lastly` has been given.

    No exception passes through the program, which might lose it or turn it into another one.
    """

    def leave(number: int, frame: FrameType | None) -> None:
        ignore_signals()
        last_words = ""
        try:
            while _last:
                with suppress(Exception):  # a failing disk, or a bar that is just being drawn
                    last_words = _last.pop()() or last_words
            said = "; ".join(filter(None, (_WORDS[number], escaped(last_words))))
            os.write(2, f"brakecli: {said}\n".encode())
        finally:
            os._exit(128 + number)

    for number in _handlers():
        signal.signal(number, leave)
    show_signals()


def ignore_signals() -> None:
    """Let no signal change how a process ends that is about to do so."""
    for number in _handlers():
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def lastly(act: Callable[[], str | None]) -> Iterator[None]:
    """Call `act` at the end of the block, whatever ends it: also a signal that ends the process.

    After a signal the inner blocks come first. A text that the outermost `act` returns is what the user is told.
    """
    _last.append(act)
    try:
        yield
    finally:
        with signals_deferred():
            _last.remove(act)
            act()


@contextmanager
def signals_deferred() -> Iterator[list[int]]:
    """Hold back Ctrl-C, SIGTERM and SIGHUP until the block has ended; yields those held.

    In Python, Ctrl-C raises an exception, which must not cut through HDF5, which calls back into Python, nor
    through a clean-up.
    """
    waiting: list[int] = []
    if threading.current_thread() is not threading.main_thread():  # Python runs handlers in the main thread only
        yield waiting
        return
    before = _handlers()
    try:
        for number in before:
            signal.signal(number, lambda number, _frame: waiting.append(number))
        yield waiting
    finally:
        for number, old in before.items():
            signal.signal(number, old)
        for number in waiting:
            signal.raise_signal(number)


def _handlers() -> "dict[int, _HANDLER]":
    """The handlers of all signals that are not ignored.

    A shell lets background jobs ignore Ctrl-C, and nohup lets every command ignore SIGHUP.
    """
    handlers = {number: signal.getsignal(number) for number in _WORDS}
    return {number: handler for number, handler in handlers.items() if handler not in (signal.SIG_IGN, None)}


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
        raw = io.BufferedWriter(_Stream(number, "w", closefd=False))
        encoding = getattr(getattr(sys, name), "encoding", "utf-8")  # None if closed before Python started
        setattr(sys, name, _Shown(raw, encoding, "backslashreplace", line_buffering=True))


class _Shown(io.TextIOWrapper):
    """A standard stream that no file, name or title can use to control the terminal."""

    def write(self, text: str) -> int:
        return super().write(escaped(text, allowed="\n"))


class Styled:
    """A standard stream for a text whose control characters are the program's own."""

    def __init__(self, stream: TextIO) -> None:
        """Write to `stream`, which is `sys.stdout` or `sys.stderr`."""
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        """All but `write` is the stream's own."""
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text as it is."""
        return (
            super(_Shown, self._stream).write(text)
            if isinstance(self._stream, _Shown)
            else self._stream.write(text)
        )


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
                what = f"cannot write: {(error.strerror or str(error)).lower()}"
                raise CannotWriteError(f"standard output: {what}; redirect it elsewhere") from error
        return memoryview(data).nbytes
