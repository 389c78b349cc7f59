"""An output file that appears whole or not at all: a lock, a temporary file beside it, one atomic replacement.

While ``NAME`` is written, ``.NAME.lock`` and ``.NAME.part`` stand beside it. The lock ends with the process that
holds it, however that ends, and the next process takes over whatever was left behind.
"""

import errno
import fcntl
import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import CannotWriteError, UsageError
from brakecli.files.os_signals import signals_deferred

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer


class OutputFile(FileIO):
    """The temporary file, open for reading and writing; a failed write is remembered here instead of raised.

    After the first failure every write pretends to succeed: HDF5 is not able to survive a failing one. Whoever
    writes calls `check` now and then, and `publish` does so at the end.
    """

    def __init__(self, path: Path, target: Path, *, force: bool) -> None:
        """Begin with an empty file, in the place of one that a killed process left."""
        self.path = path
        self.failure: OSError | None = None
        self._target = target
        self._temporary = _beside(target, "part")
        self._force = force
        self._published = False
        super().__init__(self._temporary, "w+", opener=_open_no_link)

    def write(self, data: "ReadableBuffer") -> int:
        """Write all of `data`, or remember why not."""
        view = memoryview(data).cast("B")
        written = 0
        try:
            while written < len(view) and self.failure is None:
                written += os.write(self.fileno(), view[written:])
        except OSError as error:
            self.failure = error
        return len(view)

    def readinto(self, buffer: "WriteableBuffer") -> int:
        """Fill `buffer`, with zeros behind the end: what a failed write left out must not stop HDF5."""
        view = memoryview(buffer).cast("B")
        filled = 0
        while filled < len(view) and (count := super().readinto(view[filled:])):
            filled += count
        view[filled:] = bytes(len(view) - filled)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or remember why that failed."""
        try:
            os.ftruncate(self.fileno(), self.tell() if size is None else size)
        except OSError as error:
            self.failure = self.failure or error
        return self.tell() if size is None else size

    def check(self) -> None:
        """Raise CannotWriteError if any write so far has failed."""
        if self.failure is not None:
            raise cannot_write(self.path, self.failure) from self.failure

    def publish(self) -> None:
        """Put the finished file in the place of the target, on the disk and not only in its cache."""
        self.check()
        with explained(self.path):
            os.fsync(self.fileno())
            if not self._force and os.path.lexists(self._target):
                raise _exists(self.path)
            with signals_deferred():
                self._temporary.replace(self._target)
                self._published = True
        with suppress(OSError):  # some network file systems refuse; the file is in its place already
            directory = os.open(self._target.parent, os.O_RDONLY)
            try:
                os.fsync(directory)
            finally:
                os.close(directory)

    def discard(self) -> None:
        """Close, and remove the temporary file unless it was published."""
        with suppress(OSError):  # a failing disk may refuse even this; what is left is overwritten next time
            self.close()
        if not self._published:
            with suppress(OSError):
                self._temporary.unlink()


@contextmanager
def new_output(path: Path, *, force: bool) -> Iterator[OutputFile]:
    """Open the temporary file of `path` under its lock; leaving without `publish` leaves nothing behind.

    Raises CannotWriteError where nothing can be written, now or later, and UsageError where the file exists and
    `force` is not set or where another process is writing it. A symbolic link is followed.
    """
    output = None
    target = _checked_target(path, force=force)
    with _locked(path, target):
        try:
            with signals_deferred(), explained(path):
                output = OutputFile(path, target, force=force)
            yield output
        except Exception:
            if output is not None:
                output.check()  # the cause, where the exception is only a consequence of a failed write
            raise
        finally:
            with signals_deferred():
                if output is not None:
                    output.discard()


def _checked_target(path: Path, *, force: bool) -> Path:
    """The file that `path` stands for, unless something prevents writing it."""
    with explained(path):
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise CannotWriteError(
                f"{path}: cannot write: the directory {target.parent} does not exist; "
                "create it, or choose another output with -o"
            )
        try:
            mode = target.stat().st_mode
        except FileNotFoundError:
            return target
    if stat.S_ISDIR(mode):
        raise CannotWriteError(f"{path}: cannot write: this is a directory; name a file in it with -o")
    if not stat.S_ISREG(mode):  # replacing /dev/null would harm more than this command
        raise CannotWriteError(f"{path}: cannot write: this is not a regular file; choose another output with -o")
    if not force:
        raise _exists(path)
    return target


@contextmanager
def _locked(path: Path, target: Path) -> Iterator[None]:
    """Hold the lock of `target`, and remove it at the end."""
    lock = _beside(target, "lock")
    descriptor = None
    try:
        with signals_deferred(), explained(path):
            while descriptor is None:
                descriptor = _acquired(path, lock)
        yield
    finally:
        with signals_deferred():
            if descriptor is not None:
                _release(descriptor, lock)


def _acquired(path: Path, lock: Path) -> int | None:
    """Open and lock the lock file, and write into it who holds it; None where its last holder has removed it."""
    descriptor = _open_no_link(lock, os.O_RDWR | os.O_CREAT)
    holder = os.pread(descriptor, 1000, 0).decode(errors="replace").strip()
    if not _take(descriptor, holder):
        os.close(descriptor)
        raise UsageError(
            f"{path}: is being written by {holder or 'another process'}; "
            "wait until it has ended, or choose another output with -o"
        )
    if not _is_at(descriptor, lock):
        os.close(descriptor)
        return None
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
    except OSError:
        _release(descriptor, lock)
        raise
    return descriptor


def _take(descriptor: int, holder: str) -> bool:
    """Lock without waiting. A file system without locks: free unless the process named in the file may live."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return not _lives(holder)
    return True


def _lives(holder: str) -> bool:
    """Whether the process that a lock file names may still run; one on another host counts as alive."""
    match holder.split():
        case ["process", number, "on", host] if number.isdecimal():
            if host != socket.gethostname():
                return True
            try:
                os.kill(int(number), 0)
            except (ProcessLookupError, OverflowError):
                return False
            except PermissionError:
                pass  # it runs, and belongs to someone else
            return True
    return False


def _release(descriptor: int, lock: Path) -> None:
    """Remove the lock file while it is still locked, so that nobody holds a file without a name."""
    with suppress(OSError):
        if _is_at(descriptor, lock):
            lock.unlink()
    os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False


def _beside(target: Path, suffix: str) -> Path:
    return target.with_name(f".{target.name}.{suffix}")


def _open_no_link(path: str | Path, flags: int) -> int:
    return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)


def _exists(path: Path) -> UsageError:
    return UsageError(f"{path}: exists already; replace it with --force, or choose another output with -o")


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn what the operating system refuses into CannotWriteError with a remedy."""
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise cannot_write(path, error) from error


def cannot_write(path: Path, error: OSError | ValueError) -> CannotWriteError:
    """The sentence for an output that cannot be written, with its reason and a remedy."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    full = isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    remedy = "free some space there, or choose" if full else "choose"
    return CannotWriteError(
        f"{path}: cannot write: {reason[:1].lower()}{reason[1:]}; {remedy} another output with -o"
    )
