"""The process as its caller sees it: signals, and standard streams that may be closed or full.

The standard library alone is imported here, so that signals are handled before anything large is imported.
"""

import io
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from brakecli.errors import CannotWriteError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_WORDS = {signal.SIGHUP: "hung up", signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class Interrupted(BaseException):
    """A signal has arrived, and the program unwinds."""

    def __init__(self, number: int) -> None:
        """Remember which."""
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
    """Within, the first signal raises `Interrupted`, so that unfinished files are removed.

    Later ones are not heard, as they would cut through the cleaning up. The C code in front of a compiled function
    calls back into Python, and loses exceptions or turns them into others: an interruption there has to wait until
    what this yields is called, as whatever takes long does now and then.
    """
    arrived: list[int] = []

    def recall() -> None:
        if arrived:
            raise Interrupted(arrived[0])

    def hear(number: int, frame: FrameType | None) -> None:
        if not arrived:
            arrived.append(number)
            if not _is_called_from_c(frame):
                recall()

    before = _handle(hear)
    try:
        yield recall
    except Exception:
        recall()
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_called_from_c(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] in ("numba", "llvmlite"):
            return True
        frame = frame.f_back
    return False


def _handle(handler: Callable[[int, FrameType | None], None]) -> dict[signal.Signals, Any]:
    """Set a handler; the ones before. A shell lets background jobs ignore Ctrl-C, nohup lets all ignore SIGHUP."""
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
    """Make closed streams swallow what is written, a full standard output a CannotWriteError, once.

    A full standard error changes nothing of what a command does.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: the next file to be opened must not become a standard stream
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = _text(_Output(1, "w", closefd=False), sys.stdout)
    sys.stderr = _text(_Messages(2, "w", closefd=False), sys.stderr)


def _text(raw: io.FileIO, stream: TextIO | None) -> io.TextIOWrapper:
    encoding = stream.encoding if stream is not None else "utf-8"
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, "backslashreplace", line_buffering=True)


class _Output(io.FileIO):
    """Standard output. After a failed write it takes everything, as Python writes once more on leaving."""

    _failed = False

    def write(self, data: "ReadableBuffer") -> int:
        if not self._failed:
            try:
                return super().write(data)
            except BrokenPipeError:  # whoever read it has gone: no failure, and nobody to tell
                self._failed = True
            except OSError as error:
                self._failed = True
                reason = (error.strerror or str(error)).lower()
                sentence = f"standard output: cannot write: {reason}; redirect it elsewhere"
                raise CannotWriteError(sentence) from error
        return memoryview(data).nbytes


class _Messages(io.FileIO):
    """Standard error."""

    def write(self, data: "ReadableBuffer") -> int:
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes
