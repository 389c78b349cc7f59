"""The cache of compiled kernels on disk: where it is, its files with checksums, and who compiles what now."""

import atexit
import fcntl
import io
import os
import shutil
import sys
import tempfile
import time
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from llvmlite import binding as llvm
from numba import njit
from numba.core import caching as numba_caching
from numba.core import codegen as numba_codegen
from numba.core import config as numba_config

from brakecli.solver import beforehand, cache_folder, compiling

config: Any = numba_config  # its settings come from the environment, so type checkers know none of them
caching: Any = numba_caching  # has no types
codegen: Any = numba_codegen  # has no types


_TEMPORARY = "brakecli-kernels-"  # what the names of temporary caches begin with, before the process
_STALE = 3600.0  # s
_DECIDING = (
    "NUMBA_CPU_NAME",
    "NUMBA_CPU_FEATURES",
    "NUMBA_ENABLE_AVX",
    "NUMBA_BOUNDSCHECK",
    "NUMBA_DEBUGINFO",
    "NUMBA_LOOP_VECTORIZE",
    "NUMBA_SLP_VECTORIZE",
)
"""Variables of the environment that decide what machine code Numba writes."""


def _facts() -> dict[str, str]:
    """What kernels depend on beside their sources."""
    return {
        "python": sys.version,
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "processor": f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}",
        "path": str(Path(__file__).parent),
        **{name: os.environ[name] for name in _DECIDING if name in os.environ},
    }


FACTS = _facts()


def _cache_directory() -> Path | None:
    """Where machine code is kept; None where it cannot be kept.

    Where others could write, or nobody, it is a folder for this process and its workers.
    """
    name = f"-{zlib.crc32(repr(sorted(FACTS.items())).encode()):08x}"
    try:
        return _opened(name)
    except (OSError, RuntimeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        where = getattr(error, "filename", None) or "the folder of caches"
        what = f"the cache of compiled kernels cannot be used: {why[0].lower()}{why[1:]} (found {where})"
        compiling.set_trouble(f"{what}; {beforehand.REMEDY}")
        return _temporary(name)


def _opened(name: str) -> Path:
    """The folder of a name, whose file of locks is open."""
    global _lock
    directory = cache_folder.prepare(name)
    _lock = cache_folder.opened_lock(directory / "lock")
    return directory


def _temporary(name: str) -> Path | None:
    """A folder that goes with this process, in which it keeps what is needed, also for its workers."""
    try:
        _remove_stale()
        folder = tempfile.mkdtemp(prefix=f"{_TEMPORARY}{os.getpid()}-")
        os.environ[cache_folder.BASE] = folder
        os.environ[beforehand.VARIABLE] = beforehand.LAZY
        atexit.register(_removed, folder, os.getpid())
        return _opened(name)
    except (OSError, RuntimeError):
        return None


def _remove_stale() -> None:
    """Remove such folders of processes that were killed: theirs are older than an hour, and they have ended."""
    for path in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*-*"):
        with suppress(OSError, ValueError):
            status = path.lstat()
            owner = int(path.name.removeprefix(_TEMPORARY).partition("-")[0])
            if status.st_uid == os.geteuid() and time.time() - status.st_mtime > _STALE and not _is_running(owner):
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


_lock = -1  # the file whose bytes are the locks of kernels; it stays open, as closing it would let go of all
CACHE = _cache_directory()
_LARGEST = 100_000_000  # bytes of a file of the cache
_PAUSE = 0.02  # s between two looks whether another process has compiled a kernel
PATIENCE = 60.0  # s that another process may take to compile a kernel
_held: list[int] = []  # the bytes locked for the kernels that this process compiles, each called by the one before


class _CheckedFiles(caching.IndexDataCacheFile):  # type: ignore[misc]
    """The files of a kernel in the cache, each with its checksum at the end, which pickle does not read.

    A damaged file counts as missing, so that it is written anew: damaged machine code would end the process.
    """

    def load(self, key: Any) -> Any:
        found = super().load(key)
        if found is None:
            if self._is_damaged(key) and _remade() and (found := super().load(key)) is not None:
                return found
            _wait_for_others(zlib.crc32(Path(self._index_path).name.encode()))
            found = super().load(key)  # another process may have compiled it meanwhile
        return found

    def _is_damaged(self, key: Any) -> bool:
        """Whether a kernel that should be there cannot be loaded."""
        if CACHE is None or not beforehand.names(CACHE, Path(self._index_path)):
            return False
        return not _is_whole(self._index_path) or key in self._load_index()

    def _load_index(self) -> Any:
        return super()._load_index() if _is_whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        if not _is_whole(self._data_path(name)):
            raise FileNotFoundError(name)
        return super()._load_data(name)

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        with super()._open_for_write(filepath) as file:
            contents = io.BytesIO()
            yield contents
            file.write(contents.getvalue() + _checksum(filepath, contents.getvalue()))


def _wait_for_others(place: int) -> None:
    """Take the lock of a kernel, so that one process compiles it while others may compile other kernels."""
    global PATIENCE
    assert CACHE is not None
    _held.append(place)
    end = time.monotonic() + PATIENCE
    with suppress(OSError):  # a disk without locks: do without
        while True:
            with suppress(BlockingIOError):
                fcntl.lockf(_lock, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
                return
            if time.monotonic() > end:
                what = f"{CACHE / 'lock'}: another process has compiled a kernel for more than {PATIENCE:g} s"
                compiling.set_trouble(f"{what}, and is no longer waited for; end it if it hangs")
                PATIENCE = 0.0  # nor for the other kernels
                return
            time.sleep(_PAUSE)


def _is_whole(path: str) -> bool:
    try:
        data = cache_folder.read(Path(path), _LARGEST)
    except OSError:
        return False
    return data[-4:] == _checksum(path, data[:-4])


def _checksum(path: str, contents: bytes) -> bytes:
    """What the file at a path ends with: of its name as well, since another kernel has other contents."""
    return zlib.crc32(contents, zlib.crc32(Path(path).name.encode())).to_bytes(4)


def not_compiled(function: Any, options: dict[str, Any]) -> Any:
    """A kernel that is not compiled yet, with its place in the cache, if that can be used."""
    if CACHE is not None:
        before = config.CACHE_DIR, caching.IndexDataCacheFile
        config.CACHE_DIR = str(CACHE)
        caching.IndexDataCacheFile = _CheckedFiles
        try:
            return njit(cache=True, **options)(function)
        except Exception:  # the cache cannot be used after all: do without
            pass
        finally:
            config.CACHE_DIR, caching.IndexDataCacheFile = before
    return njit(**options)(function)


class _Whole(codegen.JITCodeLibrary):  # type: ignore[misc]
    """The machine code of a kernel with a copy of its own of each kernel that it calls.

    Numba lets a process use the first copy that it comes by: one that has just compiled a helper alone would take
    that, and one that loads the caller the caller's, where a sum may have another order.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == codegen.ll.Linkage.linkonce_odr:  # what kernels become that another one calls
                function.linkage = codegen.ll.Linkage.internal
        super()._optimize_final_module()


def is_cached(dispatcher: Any, signature: Any) -> bool:
    """Whether the cache knows a kernel, and it need not be compiled."""
    cache = dispatcher._cache
    if isinstance(cache, caching.NullCache):
        return False
    return cache._index_key(signature, dispatcher.targetctx.codegen()) in cache._cache_file._load_index()


@cache
def _prepare() -> bool:
    """See to it once that the cache holds all kernels; whether it does. What keeps it from that is told."""
    if CACHE is None:
        return False
    if why := beforehand.prepare(CACHE, FACTS):
        compiling.warn(why)
    return not why


def _remade() -> bool:
    """Have all kernels of a damaged cache compiled anew; whether they are."""
    assert CACHE is not None
    try:
        beforehand.forget(CACHE)
    except OSError as error:
        why = f"{(error.strerror or str(error)).lower()} (found {error.filename})"
        compiling.warn(
            f"the cache of compiled kernels is damaged, and cannot be mended: {why}; {beforehand.REMEDY}"
        )
        return False
    _prepare.cache_clear()
    return _prepare()


def compile_for(dispatcher: Any, signature: Any) -> None:
    """Compile a kernel for one signature, or load it from the cache, which then holds all of them."""
    _prepare()
    before = len(_held)
    maker = dispatcher.targetctx.codegen()
    maker._library_class, libraries = _Whole, maker._library_class
    try:
        dispatcher.compile(signature)
    except Exception:  # the cache cannot be written, on a full disk: do without
        dispatcher._cache = caching.NullCache()
        dispatcher.compile(signature)
    finally:
        maker._library_class = libraries
        while len(_held) > before:
            with suppress(OSError):  # a disk without locks
                fcntl.lockf(_lock, fcntl.LOCK_UN, 1, _held.pop())
    dispatcher.disable_compile()
