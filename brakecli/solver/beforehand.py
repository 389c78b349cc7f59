"""All kernels compiled beforehand, by child processes, so that whoever computes never compiles.

A manifest lies beside the kernels: what they were made by and from, and each file with its size. Where it fits,
all of them are there. Otherwise all are made anew, by one process at a time. Only the standard library is imported
here.
"""

import fcntl
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from brakecli.solver import cache_folder, compiling
from brakecli.solver.cache_folder import HOW, LAZY, MANIFEST, REMEDY

CHILD = "child"
"""What `HOW` says in the processes that compile all kernels."""
OPTIMISATION = "1"
"""How much Numba optimises: its default takes a fifth more time, and nothing runs faster."""
ROOM = 30e6
"""Free bytes on a disk on which kernels are compiled beforehand; they take 6 million."""
MOST_CHILDREN = 4
"""Processes that compile, at most: each takes 1 GB, and with more of them the largest kernel sets the time."""
QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""Where a container says how much time (µs) it may take of each period (µs), on all cores together."""
_LARGEST = 1_000_000  # bytes of a manifest
TOTAL = "total"
_STAMP = "stamp.json"  # in the folder of each kernel: its files with their sizes and checksums
_TRIED = 8_000_000  # bytes that are written for a trial
_LOCK = "beforehand.lock"
_PAUSE = 0.2  # s between two looks how far the children are
SOLVER = Path(__file__).parent
_START = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from brakecli.solver.compile_all import child
child(*sys.argv[2:])
"""
"""What a child runs, in an interpreter that imports nothing but from the places that this process knows."""


def is_lazy() -> bool:
    """Whether kernels are compiled as they are needed."""
    return os.environ.get(HOW) == LAZY


def is_child() -> bool:
    """Whether this process is one of those that compile all kernels."""
    return os.environ.get(HOW) == CHILD


def cores() -> int:
    """Cores that this process may use, by its affinity and by the quota of its container."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with suppress(OSError, ValueError):  # no such file on other systems; no number where there is no quota
        quota, period = QUOTA.read_text().split()
        return max(1, min(count, -(-int(quota) // int(period))))
    return count


def prepare(folder: Path, facts: dict[str, str]) -> str:
    """See to it that a folder holds all kernels; `facts` are what else they depend on than their sources.

    Returns what keeps them from it, as a sentence without its full stop, or an empty text.
    """
    if (how := os.environ.get(HOW)) not in (None, "", LAZY, CHILD):
        compiling.warn(f"{HOW}: unknown value (found {how!r}); it may be {LAZY!r}")
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
            with suppress(OSError):  # a disk without locks
                fcntl.flock(lock, fcntl.LOCK_UN)  # a process that was forked meanwhile has it as well
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
    with compiling.progress(150.0 / min(cores(), MOST_CHILDREN)) as tell:  # 150 s of one core, about
        if waits:
            while not _is_ours(lock):
                tell(*_come(folder))
                time.sleep(_PAUSE)
                if _fits(folder, facts):
                    return ""
            if _fits(folder, facts):
                return ""
            _wipe(folder)
        why = _compiled(folder, tell)
        if not why:
            names = [path.parent.name for path in sorted(folder.glob(f"*/{_STAMP}"))]
            manifest = {"facts": facts, "sources": _stamps(), "names": names}
            write(folder / MANIFEST, json.dumps(manifest, indent=1))
        return why


def is_sound(folder: Path) -> bool:
    """Whether a folder holds machine code as it was written: damaged code would end the process."""
    return _matches(folder, lambda path, size, checksum: _stamp(path) == [size, checksum])


def vouch(folder: Path) -> None:
    """Write down what a folder holds, whose kernel has just been compiled."""
    files = {str(path.relative_to(folder)): _stamp(path) for path in sorted(folder.rglob("*.nb?"))}
    write(folder / _STAMP, json.dumps(files))


def emptied(folder: Path) -> Path | None:
    """A folder for the machine code of a kernel, without what does not fit; None where it cannot be kept."""
    try:
        folder.mkdir(mode=cache_folder.OURS, exist_ok=True)
        for path in folder.iterdir():
            _remove(path)
    except OSError:
        return None
    return folder if is_ours(folder) else None


def is_ours(folder: Path) -> bool:
    """Whether this process may write in a folder and all below it: otherwise Numba takes another place."""
    return all(os.access(path, os.W_OK) for path in (folder, *folder.rglob("*/")))


def _matches(folder: Path, matches: Callable[[Path, int, int], bool]) -> bool:
    """Whether there is what is written down of a folder, and each file of it matches its size and checksum."""
    with suppress(OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        files = json.loads(cache_folder.read(folder / _STAMP, _LARGEST))
        return bool(files) and all(matches(folder / name, *stamp) for name, stamp in files.items())
    return False


def _stamp(path: Path) -> list[int]:
    """Size and checksum of a file."""
    contents = cache_folder.read(path, cache_folder.LARGEST)
    return [len(contents), zlib.crc32(contents)]


def forget(folder: Path) -> None:
    """Remove the manifest: `prepare` makes all kernels anew."""
    (folder / MANIFEST).unlink(missing_ok=True)


def _stamps() -> dict[str, list[int]]:
    """Time and size of each source: Numba compares them."""
    statuses = {str(path.relative_to(SOLVER)): path.stat() for path in sorted(SOLVER.rglob("*.py"))}
    return {name: [status.st_mtime_ns, status.st_size] for name, status in statuses.items()}


def _fits(folder: Path, facts: dict[str, str]) -> bool:
    """Whether the manifest says that all kernels are there, and they are."""
    try:
        manifest = json.loads(cache_folder.read(folder / MANIFEST, _LARGEST))
        names = manifest["names"]
        made = bool(names) and manifest["facts"] == facts and manifest["sources"] == _stamps()
        return made and all(
            _matches(folder / name, lambda path, size, _: path.lstat().st_size == size) for name in names
        )
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return False


def write(path: Path, text: str) -> None:
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
    try:
        with tempfile.TemporaryFile(dir=folder) as file:  # a quota, or a limit of the length of files
            file.write(bytes(_TRIED))
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        tried = f"{_TRIED / 1e6:.0f} MB cannot be written: {why}"
        return f"{what}: {tried} (found {folder}); free some there, or {REMEDY}"
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
    for path in folder.iterdir():
        if path.name != _LOCK:
            _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _come(folder: Path) -> tuple[int, int]:
    """How many kernels are there, of how many; 0 where this is not known yet."""
    with suppress(OSError, ValueError):
        return sum(1 for _ in folder.glob(f"*/{_STAMP}")), int(cache_folder.read(folder / TOTAL, 20))
    return 0, 0


def _places() -> list[str]:
    """Where this process looks for modules, but for the current folder."""
    try:
        here = os.getcwd()  # noqa: PTH109 - pathlib's is the same
    except OSError:
        here = ""
    texts = [path for path in sys.path if isinstance(path, str)]  # Python passes over others
    absolute = [path for path in texts if path and os.path.isabs(path) and path != here]  # noqa: PTH117
    root = str(SOLVER.parent.parent)
    return absolute if root in absolute else [root, *absolute]


def _compiled(folder: Path, tell: compiling.Tell) -> str:
    """Have children compile all kernels; why they have not, or an empty text."""
    count = min(cores(), MOST_CHILDREN)
    environment = {
        **os.environ,
        HOW: CHILD,
        "NUMBA_OPT": OPTIMISATION,
        cache_folder.BASE: str(folder.parent.parent),
    }
    children: list[subprocess.Popen[bytes]] = []
    with tempfile.TemporaryFile() as said:
        try:
            words = [
                sys.executable,
                "-I",
                *(["-" + "O" * sys.flags.optimize] if sys.flags.optimize else []),
                "-c",
                _START,
                json.dumps(_places()),
                str(folder),
            ]
            for k in range(count):
                child = subprocess.Popen(
                    [*words, str(k)],
                    cwd=folder,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=said,
                    env=environment,
                )
                children.append(child)
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
