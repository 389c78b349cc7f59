"""The one door to every file that is read: regular files alone, and no more bytes than a bound.

A library gets the bytes or the stream that come from here. By its path it might open another file than the one
that was checked, unpack it because of its name, or wait for a pipe. Only the standard library is imported here.
"""

import os
import stat
from contextlib import suppress
from io import BufferedReader, FileIO, RawIOBase
from os import PathLike

SIGNATURE = b"\x89HDF\r\n\x1a\n"
_OPEN_PIPES = ("/dev/fd/", "/dev/stdin", "/proc/self/fd/")  # where a shell names the pipes of `<(command)`


def open_regular(path: str | PathLike[str], *, pipes: bool = False) -> FileIO:
    """A regular file, open for reading; anything else is refused at once, as a pipe may never end.

    With `pipes`, also one that the shell has opened for this process. Raises OSError, and ValueError for a NUL.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    kind = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(kind) and not (pipes and stat.S_ISFIFO(kind) and os.fspath(path).startswith(_OPEN_PIPES)):
        os.close(descriptor)
        raise OSError("this is not a regular file")
    os.set_blocking(descriptor, True)  # a pipe, which was not to be waited for
    return FileIO(descriptor)


def contents(path: str | PathLike[str], most: int) -> bytes:
    """All bytes of a regular file; raises OSError where it has more than `most`."""
    with BufferedReader(open_regular(path)) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(f"it is larger than {most} bytes")
    return data


def is_hdf5(path: str | PathLike[str]) -> bool:
    """Whether this is a regular file with the signature of HDF5, behind a user block or not."""
    with suppress(OSError, ValueError), open_regular(path) as file:
        return hdf5_begin(file) is not None
    return False


def hdf5_begin(file: RawIOBase) -> int | None:
    """Where HDF5 begins in a file: behind a user block, if there is one; None where it does not."""
    size = file.seek(0, os.SEEK_END)
    for begin in (0, *(1 << power for power in range(9, size.bit_length()))):
        if file.seek(begin) == begin and file.read(8) == SIGNATURE:
            return begin
    return None
