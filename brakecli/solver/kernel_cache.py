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


def _facts() -> dict[str, str]:
    """What kernels depend on beside their sources."""
    return {
        "python": sys.version,
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "processor": f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}",
        "path": str(Path(__file__).parent),
        **{name: value for name, value in os.environ.items() if name.startswith("NUMBA_CPU_")},
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
        compiling.set_trouble(f"{what}; name a folder of your own with XDG_CACHE_HOME")
        return _temporary(name)


def _opened(name: str) -> Path:
    """The folder of a name, whose file of locks is open."""
    global _lock
    directory = cache_folder.prepare(name)
    _lock = os.open(directory / "lock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    return directory


def _temporary(name: str) -> Path | None:
    """A folder that goes with this process, in which it keeps what is needed, also for its workers."""
    try:
        folder = tempfile.mkdtemp(prefix="brakecli-")
        os.environ[cache_folder.TEMPORARY] = folder
        os.environ[beforehand.VARIABLE] = beforehand.LAZY
        atexit.register(_removed, folder, os.getpid())
        return _opened(name)
    except (OSError, RuntimeError):
        return None


def _removed(folder: str, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


_lock = -1  # the file whose bytes are the locks of kernels; it stays open, as closing it would let go of all
CACHE = _cache_directory()
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
            if CACHE is not None and beforehand.names(CACHE, Path(self._index_path)):
                beforehand.forget(CACHE)  # what should be there cannot be loaded
                _prepare.cache_clear()
                _prepare()
                if (found := super().load(key)) is not None:
                    return found
            _wait_for_others(zlib.crc32(Path(self._index_path).name.encode()))
            found = super().load(key)  # another process may have compiled it meanwhile
        return found

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
        data = Path(path).read_bytes()
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
def _prepare() -> None:
    """See to it once that the cache holds all kernels; what keeps it from that is told with the first compiled."""
    if CACHE is not None and (why := beforehand.prepare(CACHE, FACTS)):
        compiling.set_trouble(why)


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
