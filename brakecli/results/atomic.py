"""An output file that appears whole or not at all: a lock, a temporary file beside it, one atomic replacement.

While ``NAME`` is written, ``.NAME.lock`` and ``.NAME.part`` stand beside it. The lock ends with the process that
holds it, however that ends, and the next process takes over whatever was left behind.
"""

import errno
import fcntl
import os
import socket
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING

from brakecli.errors import CannotWriteError, UsageError
from brakecli.faces import argument
from brakecli.results.os_signals import lastly, signals_deferred
from brakecli.stop import check_signals

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

_REMEDIES = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT), "free some space there, or "),
    errno.EFBIG: "free some space there, raise ulimit -f, or ",
}


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
        self._force = force
        self._temporary = target.with_name(f".{target.name}.part")
        super().__init__(self._temporary, "w+", opener=open_own)

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
        size = self.tell() if size is None else size
        try:
            os.ftruncate(self.fileno(), size)
        except OSError as error:
            self.failure = self.failure or error
        return size

    def check(self) -> None:
        """Raise CannotWriteError if any write so far has failed."""
        with explained(self.path):
            if self.failure is not None:
                raise self.failure

    def publish(self) -> None:
        """Put the finished file in the place of the target, on the disk and not only in its cache."""
        check_signals()
        self.check()
        with explained(self.path):
            os.fsync(self.fileno())
            _resolve(self.path, force=self._force)
            self._temporary.replace(self._target)
        with suppress(OSError), ExitStack() as clean_up:  # some network file systems refuse; the file is there
            directory = os.open(self._target.parent, os.O_RDONLY)
            clean_up.callback(os.close, directory)
            os.fsync(directory)

    def discard(self) -> None:
        """Close, and remove the temporary file unless it was published."""
        for action in (self.close, self._temporary.unlink):
            with suppress(OSError):  # a failing disk may refuse; what is left is overwritten next time
                action()


def follow_link(path: Path) -> Path:
    """The file that a path stands for: that to which a symbolic link leads, also in a directory that is gone."""
    is_link = os.path.islink(path)  # noqa: PTH114 - pathlib's may raise
    return Path(os.path.realpath(path)) if is_link else path


def check_target(target: Path, what: str, suffixes: Sequence[str], results: Iterable[Path] = ()) -> None:
    """Raise UsageError where a target has the suffix of nothing that can be written, or is one of the results.

    The same holds for the file that a symbolic link leads to.
    """
    ends = [name.suffix for name in (target, follow_link(target))]
    if wrong := [suffix for suffix in ends if suffix.lower() not in suffixes]:
        problem = f"its suffix does not name {what} (found {wrong[0]!r})"
        named = " or ".join(filter(None, (", ".join(suffixes[:-1]), suffixes[-1])))
        raise UsageError(f"{target}: {problem}; name a file that ends in {named} with {argument('output')}")
    for result in results:
        refuse_source(target, result, "result")


def refuse_source(target: Path, source: str | Path, what: str) -> None:
    """Raise UsageError where a target is the file that it is made of."""
    with suppress(OSError, ValueError):  # one of them does not exist, or cannot
        if target.samefile(source):
            raise UsageError(
                f"{target}: this is the {what} itself; choose another output with {argument('output')}"
            )


@contextmanager
def new_output(path: Path, *, force: bool) -> Iterator[OutputFile]:
    """Open the temporary file of `path` under its lock; leaving without `publish` leaves nothing behind.

    Raises CannotWriteError where nothing can be written, now or later, and UsageError where the file exists and
    `force` is not set or where another process is writing it. A symbolic link is followed.
    """
    target = _resolve(path, force=force)
    lock = target.with_name(f".{target.name}.lock")
    clean_up = ExitStack()

    def leave_nothing() -> str:
        clean_up.close()
        return "nothing unfinished was left behind"

    with lastly(leave_nothing):
        with signals_deferred(), explained(path):
            descriptor = _acquire(path, lock)
            clean_up.callback(_release, descriptor, lock)
            temporary = target.with_name(f".{target.name}.part")
            if os.path.lexists(temporary) and not os.fstat(descriptor).st_size:  # a killed process leaves both
                raise _not_ours(temporary)
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
            output = OutputFile(path, target, force=force)
            clean_up.callback(output.discard)
        try:
            yield output
        except Exception:
            output.check()  # the cause, where the exception is only a consequence of a failed write
            raise


def _resolve(path: Path, *, force: bool) -> Path:
    """The file that `path` stands for, unless something prevents writing it."""
    with explained(path):
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise _refused(path, f"the directory {target.parent} does not exist", "create it, or ")
        try:
            mode = target.stat().st_mode
        except FileNotFoundError:
            return target
    if stat.S_ISDIR(mode):
        raise _refused(path, "this is a directory", "name a file in it, or ")
    if not stat.S_ISREG(mode):  # replacing /dev/null would harm more than this command
        raise _refused(path, "this is not a regular file")
    if not force:
        raise UsageError(
            f"{path}: exists already; "
            f"replace it with {argument('force')}, or choose another output with {argument('output')}"
        )
    return target


def _acquire(path: Path, lock: Path) -> int:
    """Open and lock the lock file, unless another process holds it."""
    while True:
        descriptor = open_own(lock, os.O_RDWR | os.O_CREAT)
        holder = os.pread(descriptor, 1000, 0).decode(errors="replace").strip()
        if holder and not holder.startswith("process "):
            os.close(descriptor)
            raise _not_ours(lock)
        if not _take(descriptor, holder):
            os.close(descriptor)
            remedy = f"wait until it has ended, or choose another output with {argument('output')}"
            raise UsageError(f"{path}: is being written by {holder or 'another process'}; {remedy}")
        with suppress(FileNotFoundError):  # its last holder has removed it meanwhile
            if os.path.samestat(os.fstat(descriptor), lock.lstat()):
                return descriptor
        os.close(descriptor)


def _take(descriptor: int, holder: str) -> bool:
    """Lock without waiting. A file system without locks: free unless the process named in the file may live."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    except OSError:
        return not _lives(holder)


def _lives(holder: str) -> bool:
    """Whether the process that a lock file names may still run; one on another host counts as alive."""
    match holder.split():
        case ["process", number, "on", host] if number.isdecimal():
            try:
                if host == socket.gethostname():
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
        if os.path.samestat(os.fstat(descriptor), lock.lstat()):
            lock.unlink()
    os.close(descriptor)


def open_own(path: str | Path, flags: int) -> int:
    """Open a file that stands beside an output: a regular one of this user without other names, or a new one."""
    with suppress(FileNotFoundError):
        there = os.lstat(path)
        if not stat.S_ISREG(there.st_mode) or there.st_uid != os.geteuid() or there.st_nlink > 1:
            raise _not_ours(path)
    return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)


def _not_ours(path: str | Path) -> CannotWriteError:
    what = "is in the way: it is not a file that this program has written"
    return CannotWriteError(f"{path}: {what}; move it away, or choose another output with {argument('output')}")


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn what the operating system refuses into CannotWriteError with a remedy."""
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or str(error)
        raise _refused(
            path, reason[:1].lower() + reason[1:], _REMEDIES.get(getattr(error, "errno", None) or 0, "")
        ) from error


def _refused(path: Path, reason: str, remedy: str = "") -> CannotWriteError:
    return CannotWriteError(
        f"{path}: cannot write: {reason}; {remedy}choose another output with {argument('output')}"
    )
