"""Where compiled code sees that a signal has come, on which it gives up what takes long.

Handlers in Python wait until compiled code returns. The handler in C does not: it writes the number of the signal
into a file that kernels see as memory. Only the standard library is imported here.
"""

import mmap
import os
import signal
from contextlib import suppress

memory: bytearray | mmap.mmap = bytearray(8)
"""Its first byte is the number of the first signal, or 0."""


def show_signals() -> None:
    """Show kernels the signals that come from now on. Some systems have no such files: kernels then see none."""
    global memory
    with suppress(AttributeError, OSError):
        file = os.memfd_create("signals")
        os.truncate(file, mmap.PAGESIZE)
        os.set_blocking(file, False)
        memory = mmap.mmap(file, mmap.PAGESIZE)
        signal.set_wakeup_fd(file, warn_on_full_buffer=False)
