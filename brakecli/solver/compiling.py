"""What a program says while kernels are compiled; but for `errors`, only the standard library is imported here."""

import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext

from brakecli.errors import RefusedError

Tell = Callable[[int, int], None]
"""Called with how many kernels are there, of how many; both 0 as long as this is not known."""
Progress = Callable[[float], AbstractContextManager[Tell]]
"""Called with the seconds that all kernels take, about, before they are compiled."""

KERNELS = 1_430_000_000
"""Bytes of address space to compile all kernels in one process.

Measured: a `compare-schemes` that compiles those of all schemes aborts with 1,331 MB, and ends with 1,434 MB.
"""

_notice: Callable[[str], object] | None = None
_progress: Progress | None = None
_warning: Callable[[str], object] | None = None
_trouble = ""
_BLAS = "scipy.linalg.cython_blas"
_alone = False


def set_notice(notice: Callable[[str], object] | None) -> None:
    """Have this process call `notice` before it compiles a first kernel itself; None: it compiles in silence.

    `notice` gets what keeps this process from using the cache, with the remedy; an empty text if nothing does.
    """
    global _notice
    _notice = notice


def set_progress(progress: Progress | None) -> None:
    """Have this process show how far the kernels are that are compiled beforehand; None: it waits in silence."""
    global _progress
    _progress = progress


def progress(seconds: float) -> AbstractContextManager[Tell]:
    """What shows it, for something that takes about so many seconds."""
    return _progress(seconds) if _progress is not None else nullcontext(lambda done, total: None)


def set_warning(warning: Callable[[str], object] | None) -> None:
    """Have this process call `warning` with what keeps kernels from being compiled beforehand; None: silence."""
    global _warning
    _warning = warning


def warn(text: str) -> None:
    """Tell what keeps kernels from being compiled beforehand."""
    if _warning is not None:
        _warning(text)


def set_trouble(text: str) -> None:
    """Remember what keeps this process from using the cache of compiled kernels."""
    global _trouble
    _trouble = text


def begins() -> None:
    """Call the notice once: a kernel is being compiled, as no cache holds it.

    Raises RefusedError where the address space is too small for that: LLVM would end the process.
    """
    global _notice
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if resource.RLIM_INFINITY != limit < KERNELS:
        limited = f"the address space is limited to {limit / 1e6:.0f} MB"
        what = f"{limited}, and compiling kernels needs {KERNELS / 1e6:.0f} MB"
        raise RefusedError(f"{what}; raise the limit with: ulimit -v unlimited")
    notice = _notice
    _notice = None
    if notice is not None:
        notice(_trouble)


def set_alone() -> None:
    """Say that this process has no kernels but ours."""
    global _alone
    _alone = True


@contextmanager
def without_blas() -> Iterator[None]:
    """Let Numba find no BLAS in a process that is alone: its import takes 0.2 s, and none of our kernels calls it.

    Numba imports it with the first kernel that it loads.
    """
    hidden = _alone and _BLAS not in sys.modules
    if hidden:
        sys.modules[_BLAS] = None  # type: ignore[assignment]  # whoever imports it learns that there is none
    try:
        yield
    finally:
        if hidden:
            del sys.modules[_BLAS]
