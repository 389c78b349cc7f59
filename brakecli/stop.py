"""Where compiled code sees that a signal has come, on which it gives up what takes long.

Handlers in Python wait until compiled code returns. The handler in C does not: it writes the number of the signal
into a file that kernels see as memory. Only the standard library is imported here.
"""

import mmap
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

try:
    _file = os.memfd_create("signals")
    os.truncate(_file, mmap.PAGESIZE)
    os.set_blocking(_file, False)
    memory: bytearray | mmap.mmap = mmap.mmap(_file, mmap.PAGESIZE)
except (AttributeError, OSError):  # some systems have no such files: kernels then see no signal
    _file = -1
    memory = bytearray(8)
"""The first byte of `memory` is the number of the first signal, or 0; its address never changes."""


def show_signals() -> None:
    """Show kernels the signals that come from now on."""
    signal.set_wakeup_fd(_file, warn_on_full_buffer=False)


def signalled() -> bool:
    """Whether kernels give up, as a signal has come; what flies by many short ones asks here."""
    return memory[0] in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)


def check_signals() -> None:
    """Raise KeyboardInterrupt after Ctrl-C, and SystemExit after another signal that kernels have given up on.

    Python's handler has raised one already. It is lost where it comes out of a finalizer, or out of the C code in
    front of a compiled function, and what kernels have given up is worth nothing.
    """
    if signalled():
        raise KeyboardInterrupt if memory[0] == signal.SIGINT else SystemExit(128 + memory[0])


def hide_signals(file: int = -1) -> None:
    """Let kernels see no signals any more, nor those that have come; `file` is to hear of the next ones."""
    signal.set_wakeup_fd(file)
    memory[:8] = bytes(8)
    if _file >= 0:
        os.lseek(_file, 0, os.SEEK_SET)


@contextmanager
def signals_shown() -> Iterator[None]:
    """Show kernels the signals that come within the block, in a program that goes on afterwards.

    A block in which one came ends as `check_signals` says, whatever it has made of it.
    """
    before = signal.set_wakeup_fd(_file, warn_on_full_buffer=False)
    try:
        yield
    except Exception:
        check_signals()
        raise
    else:
        check_signals()
    finally:
        hide_signals(before)
