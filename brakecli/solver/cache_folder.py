"""The folder of compiled kernels: where it is, and whether this user alone can write there.

Kernels are machine code that runs as the user: who can write into their folder, or put another one in its place,
runs what he likes. Only the standard library is imported here, so that the folder is known before Numba is.
"""

import errno
import grp
import hashlib
import os
import pwd
import shutil
import stat
import tempfile
import time
import zlib
from collections.abc import Mapping
from contextlib import suppress
from multiprocessing.util import Finalize
from pathlib import Path

from brakecli.solver import compiling

BASE = "BRAKECLI_CACHES"
"""The environment variable by which a process hands its folder of caches to those that it starts."""
FOR_OTHERS = stat.S_IWGRP | stat.S_IWOTH
"""Permissions by which others write into a folder."""
OURS = 0o700
"""Permissions of a folder that is made here, whatever the process hides by its mask."""
HOW = "BRAKECLI_COMPILE"
"""The environment variable that says how kernels are compiled."""
LAZY = "lazy"
"""Its value for whoever edits the solver: each kernel as it is needed, by the process that needs it."""
MANIFEST = "manifest.json"
"""The file in the folder that says what it holds, once it holds all."""
REMEDY = "name a folder of your own with XDG_CACHE_HOME"

_TEMPORARY = "brakecli-kernels-"  # what the names of temporary caches begin with, before the process
LARGEST = 100_000_000  # bytes of a file of the cache


def opened(facts: Mapping[str, str]) -> Path | None:
    """Where machine code is kept that depends on such facts; None where it cannot be.

    Where others could write, or nobody, it is a folder for this process and its workers.
    """
    name = f"-{zlib.crc32(repr(sorted(facts.items())).encode()):08x}"
    folder = None
    try:
        folder = prepare(name)
        if os.access(folder, os.W_OK):
            return folder
        raise _refused(folder, "it is read-only")
    except (OSError, RuntimeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        where = getattr(error, "filename", None) or "the folder of caches"
        what = f"the cache of compiled kernels cannot be used: {why[0].lower()}{why[1:]} (found {where})"
        compiling.set_trouble(f"{what}; {REMEDY}")
        return _temporary(name, folder)


def _temporary(name: str, like: Path | None) -> Path | None:
    """A folder that goes with this process, in which it keeps what is needed, also for its workers.

    It begins with what another one holds, where that holds all.
    """
    try:
        _remove_stale()
        base = tempfile.mkdtemp(prefix=f"{_TEMPORARY}{os.getpid()}-")
    except OSError:
        return None
    Finalize(None, _removed, (base, os.getpid()), exitpriority=0)  # workers end without `atexit`
    os.environ[BASE] = base
    try:
        folder = prepare(name)
        if like is None or not (like / MANIFEST).is_file():
            os.environ[HOW] = LAZY
            return folder
        for path in sorted(like.rglob("*")):
            made = folder / path.relative_to(like)
            if path.is_dir():
                made.mkdir(mode=OURS)
            else:
                made.write_bytes(read(path, LARGEST))
    except (OSError, RuntimeError):
        _removed(base, os.getpid())
        return None
    return folder


def _remove_stale() -> None:
    """Remove such folders of processes that were killed: theirs are older than an hour, and they have ended."""
    for path in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*-*"):
        with suppress(OSError, ValueError):
            status = path.lstat()
            owner = int(path.name.removeprefix(_TEMPORARY).partition("-")[0])
            is_old = time.time() - status.st_mtime > 3600.0  # s
            if status.st_uid == os.geteuid() and is_old and not _is_running(owner):
                shutil.rmtree(path, ignore_errors=True)


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _removed(folder: str, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def source_hash(folder: Path = Path(__file__).parent) -> str:
    """Hash of the sources of the solver: otherwise a cached caller would keep the old code of an edited helper."""
    sources = b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py")))
    return hashlib.sha256(sources).hexdigest()[:16]


def prepare(name: str = "") -> Path:
    """The folder of this version's kernels, or of those that are made so as a name says; made where it is missing.

    Raises OSError where it cannot be made, and PermissionError where others could write there or swap it.
    """
    named = os.environ.get(BASE) or os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME")
    base = Path(named) if named else Path.home() / ".cache"
    folder = base.absolute() / "brakecli" / f"{source_hash()}{name}"
    for above in [*reversed(folder.parents), folder]:
        if not above.exists():
            above.mkdir(mode=OURS, exist_ok=True)
    if folder.is_symlink():
        raise _refused(folder, "it is a link")
    real = folder.resolve()
    for above in real.parents:
        refuse_shared(above)
    status = real.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & FOR_OTHERS:
        raise _refused(folder, "it is not a folder in which this user alone writes")
    return real


def read(path: Path, most: int) -> bytes:
    """The contents of a file of the cache; raises OSError where it is no file, or longer than so many bytes."""
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC)
    with open(file, "rb") as opened:  # noqa: PTH123 - a descriptor
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode) or status.st_size > most:
            raise OSError(errno.EINVAL, "it is no file of the cache", str(path))
        return opened.read()


def opened_lock(path: Path) -> int:
    """The descriptor of a file of locks; raises OSError where something else is in its place."""
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o600)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, "it is no file", str(path))
    return file


def refuse_shared(folder: Path) -> None:
    """Raise PermissionError where others could put something else in the place of what lies in a folder.

    They can where they own it, or where they may write there without the sticky bit. A group of which the user is
    the only member is no other.
    """
    status = folder.lstat()
    if status.st_uid not in (0, os.geteuid()):
        raise _refused(folder, "it belongs to another user")
    shared = status.st_mode & FOR_OTHERS
    if shared == stat.S_IWGRP and is_private(status.st_gid):
        shared = 0
    if shared and not status.st_mode & stat.S_ISVTX:
        raise _refused(folder, "others may write there")


def is_private(group: int) -> bool:
    """Whether a group is the user's own, as many systems give to each: of his name, and without other members."""
    try:
        user = pwd.getpwuid(os.geteuid())
        own = grp.getgrgid(group)
    except KeyError:
        return False
    return user.pw_gid == group and own.gr_name == user.pw_name and set(own.gr_mem) <= {user.pw_name}


def _refused(folder: Path, why: str) -> PermissionError:
    return PermissionError(errno.EPERM, why, str(folder))
