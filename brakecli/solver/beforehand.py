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
import select
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from brakecli.solver import compiling

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
_TOTAL = "total"
_LOCK = "beforehand.lock"
_PAUSE = 0.2  # s between two looks how far the children are
_SOLVER = Path(__file__).parent


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
    if is_lazy() or is_child() or _fits(folder, facts):
        return ""
    if hindrance := _hindrance(folder):
        return hindrance
    try:
        with (folder / _LOCK).open("w") as lock, compiling.progress(_expected()) as tell:
            while not _is_ours(lock):  # another process makes them
                tell(*_come(folder))
                time.sleep(_PAUSE)
            if _fits(folder, facts):
                return ""
            _wipe(folder)
            if why := _compiled(folder, tell):
                return why
            _write_manifest(folder, facts)
    except OSError as error:
        return f"the kernels cannot be compiled beforehand: {error.strerror or error}"
    return ""


def names(folder: Path, file: Path) -> bool:
    """Whether the manifest says that a file is there."""
    with suppress(OSError, ValueError, LookupError):
        return str(file.relative_to(folder)) in json.loads((folder / MANIFEST).read_bytes())["files"]
    return False


def forget(folder: Path) -> None:
    """Remove the manifest: `prepare` makes all kernels anew."""
    (folder / MANIFEST).unlink(missing_ok=True)


def _expected() -> float:
    """Seconds that it takes on this machine, about."""
    return PROCESSOR_SECONDS / min(cores(), MOST_CHILDREN)


def _stamps() -> dict[str, list[int]]:
    """Time and size of each source: Numba compares them."""
    found = {str(path.relative_to(_SOLVER)): path.stat() for path in sorted(_SOLVER.rglob("*.py"))}
    return {name: [status.st_mtime_ns, status.st_size] for name, status in found.items()}


def _fits(folder: Path, facts: dict[str, str]) -> bool:
    """Whether the manifest says that all kernels are there, and they are."""
    try:
        manifest: Any = json.loads((folder / MANIFEST).read_bytes())
        made = manifest["facts"] == facts and manifest["sources"] == _stamps()
        return made and all((folder / name).stat().st_size == size for name, size in manifest["files"].items())
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return False


def _write_manifest(folder: Path, facts: dict[str, str]) -> None:
    files = {str(path.relative_to(folder)): path.stat().st_size for path in sorted(folder.rglob("*.nb?"))}
    text = json.dumps({"facts": facts, "sources": _stamps(), "files": files}, indent=1)
    (folder / f"{MANIFEST}.new").write_text(text)
    (folder / f"{MANIFEST}.new").replace(folder / MANIFEST)


def _hindrance(folder: Path) -> str:
    """Why children would not get far, or an empty text."""
    if not sys.executable:
        return "the kernels cannot be compiled beforehand: there is no interpreter to start"
    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:
        return "the kernels are not compiled beforehand: the address space is limited"
    status = os.statvfs(folder)
    if status.f_bavail * status.f_frsize < ROOM:
        return f"the kernels are not compiled beforehand: the disk of {folder} is nearly full"
    return ""


def _is_ours(lock: IO[str]) -> bool:
    """Whether this process has got the lock, or there are none on this disk."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def _wipe(folder: Path) -> None:
    """Remove what does not fit."""
    for path in [folder / MANIFEST, folder / _TOTAL, *folder.rglob("*.nb?")]:
        path.unlink(missing_ok=True)


def _come(folder: Path) -> tuple[int, int]:
    """How many kernels are there, of how many; 0 where this is not known yet."""
    with suppress(OSError, ValueError):
        return sum(1 for _ in folder.rglob("*.nbc")), int((folder / _TOTAL).read_text())
    return 0, 0


def _compiled(folder: Path, tell: compiling.Tell) -> str:
    """Have children compile all kernels; why they have not, or an empty text."""
    count = min(cores(), MOST_CHILDREN)
    roots = [str(_SOLVER.parent.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, VARIABLE: CHILD, "NUMBA_OPT": "1", "PYTHONPATH": os.pathsep.join(roots)}
    children: list[subprocess.Popen[bytes]] = []
    with tempfile.TemporaryFile() as said:
        try:
            for k in range(count):
                # -P: nothing in the current folder is imported
                words = [sys.executable, "-P", "-m", "brakecli.solver.beforehand", str(folder), str(k), str(count)]
                children.append(
                    subprocess.Popen(
                        words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said, env=environment
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
        if total and done >= total and not any(child.returncode for child in children):
            return ""
        said.seek(0)
        lines = said.read().decode(errors="replace").splitlines() or [f"{done} of {total} could be kept"]
        return f"the kernels cannot be compiled beforehand: {lines[-1]}"


def _is_alone() -> bool:
    """Whether the process that has started this one has ended."""
    return bool(select.select([sys.stdin], [], [], 0.0)[0])


def _in_turn(kernels: list[Any], k: int, count: int) -> list[Any]:
    """All kernels in the order of a child: pairs of them come towards each other, so that none follows another.

    A kernel that another child compiles is waited for; one who followed would wait all the time.
    """
    first = (k + k % 2) * len(kernels) // (count + count % 2)
    way = -1 if k % 2 else 1
    return (kernels[first:] + kernels[:first])[::way]


def _child(folder: Path, k: int, count: int) -> None:
    """Compile all kernels that no other child has compiled, in an order of its own."""
    for module in pkgutil.walk_packages([str(_SOLVER)], "brakecli.solver."):
        importlib.import_module(module.name)
    from brakecli.solver.compile import is_kept, kernels, ready
    from brakecli.solver.kernel_cache import CACHE

    if folder != CACHE:
        raise SystemExit(f"the cache is {CACHE}, not {folder}")
    (folder / f"{_TOTAL}.{k}").write_text(str(len(kernels)))
    (folder / f"{_TOTAL}.{k}").replace(folder / _TOTAL)
    for each in _in_turn(kernels, k, count):
        if _is_alone():
            return
        if not is_kept(each):
            ready(each)


if __name__ == "__main__":
    _child(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
