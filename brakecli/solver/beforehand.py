"""All kernels compiled beforehand, by child processes, so that whoever computes never compiles.

A manifest lies beside the kernels: what they were made by and from, and each file with its size. Where it fits,
all of them are there. Otherwise all are made anew, by one process at a time. Only the standard library is imported
here.
"""

import fcntl
import importlib
import json
import os
import pkgutil
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Any

from brakecli.solver import cache_folder, compiling

VARIABLE = "BRAKECLI_COMPILE"
"""The environment variable that says how kernels are compiled."""
LAZY = "lazy"
"""Its value for whoever edits the solver: each kernel as it is needed, by the process that needs it."""
CHILD = "child"
"""Its value in the processes that compile all of them."""
MANIFEST = "manifest.json"
ROOM = 200e6
"""Free bytes on a disk on which kernels are compiled beforehand; they take 40 million."""
MOST_CHILDREN = 8
PROCESSOR_SECONDS = 120.0
"""Time (s) that one core takes for all kernels, about."""
REMEDY = "name a folder of your own with XDG_CACHE_HOME"
_LARGEST = 1_000_000  # bytes of a manifest
_TOTAL = "total"
_LOCK = "beforehand.lock"
_PAUSE = 0.2  # s between two looks how far the children are
_SOLVER = Path(__file__).parent
_START = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from brakecli.solver.beforehand import child
child(*sys.argv[2:])
"""
"""What a child runs, in an interpreter that imports nothing but from the places that this process knows."""


def is_lazy() -> bool:
    """Whether kernels are compiled as they are needed."""
    return os.environ.get(VARIABLE) == LAZY


def is_child() -> bool:
    """Whether this process is one of those that compile all kernels."""
    return os.environ.get(VARIABLE) == CHILD


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def prepare(folder: Path, facts: dict[str, str]) -> str:
    """See to it that a folder holds all kernels; `facts` are what else they depend on than their sources.

    Returns what keeps them from it, as a sentence without its full stop, or an empty text.
    """
    if (asked := os.environ.get(VARIABLE)) not in (None, "", LAZY, CHILD):
        compiling.warn(f"{VARIABLE}: unknown value (found {asked!r}); it may be {LAZY!r}")
    if is_lazy() or is_child() or _fits(folder, facts):
        return ""
    try:
        folder.mkdir(mode=cache_folder.OURS, parents=True, exist_ok=True)
        if hindrance := _hindrance(folder):
            return hindrance
        lock = cache_folder.opened_lock(folder / _LOCK)
        try:
            return _made(folder, facts, lock)
        finally:
            os.close(lock)
    except OSError as error:
        what = f"the kernels cannot be compiled beforehand: {(error.strerror or str(error)).lower()}"
        return f"{what} (found {error.filename or folder}); {REMEDY}"


def _made(folder: Path, facts: dict[str, str], lock: int) -> str:
    """Have all kernels compiled, or wait until another process has done so; why they are not, or an empty text."""
    waits = not _is_ours(lock)
    if not waits and _fits(folder, facts):  # another process has just made them
        return ""
    if not waits:
        _wipe(folder)
    with compiling.progress(PROCESSOR_SECONDS / min(cores(), MOST_CHILDREN)) as tell:
        if waits:
            while not _is_ours(lock):
                tell(*_come(folder))
                time.sleep(_PAUSE)
            if _fits(folder, facts):
                return ""
            _wipe(folder)
        why = _compiled(folder, tell)
        if not why:
            files = {str(path.relative_to(folder)): path.stat().st_size for path in sorted(folder.rglob("*.nb?"))}
            manifest = {"facts": facts, "sources": _stamps(), "files": files}
            _write(folder / MANIFEST, json.dumps(manifest, indent=1))
        return why


def names(folder: Path, file: Path) -> bool:
    """Whether the manifest says that a file is there."""
    with suppress(OSError, ValueError, LookupError, TypeError, RecursionError):
        return str(file.relative_to(folder)) in _manifest(folder)["files"]
    return False


def forget(folder: Path) -> None:
    """Remove the manifest: `prepare` makes all kernels anew."""
    (folder / MANIFEST).unlink(missing_ok=True)


def _stamps() -> dict[str, list[int]]:
    """Time and size of each source: Numba compares them."""
    found = {str(path.relative_to(_SOLVER)): path.stat() for path in sorted(_SOLVER.rglob("*.py"))}
    return {name: [status.st_mtime_ns, status.st_size] for name, status in found.items()}


def _manifest(folder: Path) -> Any:
    return json.loads(cache_folder.read(folder / MANIFEST, _LARGEST))


def _fits(folder: Path, facts: dict[str, str]) -> bool:
    """Whether the manifest says that all kernels are there, and they are."""
    try:
        manifest = _manifest(folder)
        files = manifest["files"]
        made = bool(files) and manifest["facts"] == facts and manifest["sources"] == _stamps()
        return made and all((folder / name).lstat().st_size == size for name, size in files.items())
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return False


def _write(path: Path, text: str) -> None:
    """Write a file completely or not at all."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
        file.write(text)
    Path(file.name).replace(path)


def _hindrance(folder: Path) -> str:
    """Why children would not get far, with the remedy, or an empty text."""
    what = "the kernels are not compiled beforehand"
    if not sys.executable:
        return f"{what}: there is no interpreter to start; call brakecli once from a shell"
    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:
        return f"{what}: the address space is limited; raise the limit with: ulimit -v unlimited"
    status = os.statvfs(folder)
    if status.f_bavail * status.f_frsize < ROOM:
        return f"{what}: the disk is nearly full (found {folder}); free {ROOM / 1e6:.0f} MB there, or {REMEDY}"
    return ""


def _is_ours(lock: int) -> bool:
    """Whether this process has got the lock, or there are none on this disk."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def _wipe(folder: Path) -> None:
    """Remove what does not fit, whatever it is."""
    for path in [folder / MANIFEST, folder / _TOTAL, *folder.rglob("*.nb?")]:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def _come(folder: Path) -> tuple[int, int]:
    """How many kernels are there, of how many; 0 where this is not known yet."""
    with suppress(OSError, ValueError):
        return sum(1 for _ in folder.rglob("*.nbc")), int(cache_folder.read(folder / _TOTAL, 20))
    return 0, 0


def _places() -> list[str]:
    """Where this process looks for modules, but for the current folder."""
    try:
        here = os.getcwd()  # noqa: PTH109 - pathlib's is the same
    except OSError:
        here = ""
    found = [place for place in sys.path if place and os.path.isabs(place) and place != here]  # noqa: PTH117
    root = str(_SOLVER.parent.parent)
    return found if root in found else [*found, root]


def _compiled(folder: Path, tell: compiling.Tell) -> str:
    """Have children compile all kernels; why they have not, or an empty text."""
    count = min(cores(), MOST_CHILDREN)
    environment = {**os.environ, VARIABLE: CHILD, "NUMBA_OPT": "1", cache_folder.BASE: str(folder.parent.parent)}
    children: list[subprocess.Popen[bytes]] = []
    with tempfile.TemporaryFile() as said:
        try:
            for k in range(count):
                words = [
                    sys.executable,
                    "-I",
                    "-c",
                    _START,
                    json.dumps(_places()),
                    str(folder),
                    str(k),
                    str(count),
                ]
                children.append(
                    subprocess.Popen(
                        words,
                        cwd=folder,
                        stdin=subprocess.PIPE,
                        stdout=subprocess.DEVNULL,
                        stderr=said,
                        env=environment,
                    )
                )
            while any(child.poll() is None for child in children):
                tell(*_come(folder))
                time.sleep(_PAUSE)
        finally:
            for child in children:
                assert child.stdin is not None
                child.stdin.close()
                if child.poll() is None:
                    child.terminate()
                    child.wait()
        done, total = _come(folder)
        tell(done, total)
        if total and done >= total:
            return ""
        said.seek(0)
        lines = said.read().decode(errors="replace").splitlines()
    killed = [-child.returncode for child in children if child.returncode < 0]
    if killed:
        why = f"signal {killed[0]} has ended what compiles them, perhaps for lack of memory"
    else:
        why = lines[-1] if lines else f"{done} of {total} could be kept"
    return f"the kernels cannot be compiled beforehand: {why} (found {folder}); {REMEDY}"


def _end_with_parent() -> None:
    """End this process where the one that has started it has ended: its standard input is at its end then."""
    while os.read(0, 1):
        pass
    os._exit(1)


def _in_turn(kernels: list[Any], k: int, count: int) -> list[Any]:
    """All kernels in the order of a child: pairs of them come towards each other, so that none follows another.

    A kernel that another child compiles is waited for; one who followed would wait all the time.
    """
    first = (k + k % 2) * len(kernels) // (count + count % 2)
    way = -1 if k % 2 else 1
    return (kernels[first:] + kernels[:first])[::way]


def child(where: str, k: str, count: str) -> None:
    """Compile all kernels that no other child has compiled, in an order of its own."""
    Thread(target=_end_with_parent, daemon=True).start()
    folder = Path(where)
    for module in pkgutil.walk_packages([str(_SOLVER)], "brakecli.solver."):
        importlib.import_module(module.name)
    from brakecli.solver.compile import is_kept, kernels, ready
    from brakecli.solver.kernel_cache import CACHE

    if folder != CACHE:
        raise SystemExit(f"the cache is {CACHE}")
    _write(folder / _TOTAL, str(len(kernels)))
    for each in _in_turn(kernels, int(k), int(count)):
        if not is_kept(each):
            ready(each)
            if not is_kept(each):
                raise SystemExit("no more can be written there")
