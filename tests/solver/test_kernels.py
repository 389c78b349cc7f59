"""Kernels: interpreted where Python calls them, entries from a cache that works and from one that does not."""

import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from brakecli.solver import kernels
from brakecli.solver.friction import minimise
from brakecli.solver.roughness import wheel_angles
from tests.campaign import campaign
from tests.commands import environment

COUNT = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
{limit}
from brakecli.solver import compiling
told = []
compiling.set_notice(lambda trouble: told.append(1))
from brakecli.solver.roughness import surface, turned
print(turned(surface([1.0], wavelengths=[4.0]), 1.0).phase.round(6))
print(bool(told))
"""
FOUND = "[-1.570796]"


def lazily(cache: Path) -> dict[str, str]:
    return {**os.environ, "NUMBA_CACHE_DIR": str(cache), "NUMBA_DISABLE_JIT": "0", "BRAKECLI_COMPILE": "lazy"}


def python(program: str, cache: Path) -> str:
    """What a program prints that compiles each kernel as it needs it, into a cache of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program], env=lazily(cache), capture_output=True, text=True, check=True
    )
    return done.stdout


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache that a process has left, only to be read."""
    cache = tmp_path_factory.mktemp("filled")
    assert python(COUNT.format(limit=""), cache).splitlines() == [FOUND, "True"]
    return cache


@pytest.fixture
def cache(filled: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return shutil.copytree(filled, tmp_path / "cache")


def test_a_kernel_is_interpreted_and_an_entry_is_loaded_by_its_first_call_or_before() -> None:
    assert minimise(1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0) == (2.0, 0.0, 1.0)
    assert kernels.load(minimise) is minimise
    assert kernels.load(wheel_angles) is kernels.load(wheel_angles)
    assert wheel_angles in kernels.entries


def test_a_second_process_finds_the_machine_code_of_the_first_and_gives_no_notice(cache: Path) -> None:
    stored = {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}
    assert stored
    assert python(COUNT.format(limit=""), cache).splitlines() == [FOUND, "False"]
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")} == stored


@campaign
def test_the_notice_comes_once_and_before_the_first_kernel_is_kept(tmp_path: Path) -> None:
    program = """
from pathlib import Path
from brakecli.solver import compiling
compiling.set_notice(lambda trouble: print([*Path("FOLDER").rglob("*.nbc")]))
from brakecli.solver.roughness import turn_wheel, wheel_angles
wheel_angles.load(), turn_wheel.load()
"""
    assert python(program.replace("FOLDER", str(tmp_path)), tmp_path) == "[]\n"
    assert len([*tmp_path.rglob("*.nbc")]) == 2


@campaign
def test_a_kind_of_kernels_that_a_warm_cache_lacks_brings_the_notice(cache: Path) -> None:
    another = COUNT.format(limit="") + "from brakecli.solver.roughness import turn_wheel\nturn_wheel.load()\n"
    another += "print(bool(told))\n"
    assert [python(another, cache).split()[-1] for _ in range(2)] == ["True", "False"]


@campaign
def test_python_compiles_in_silence(tmp_path: Path) -> None:
    words = [sys.executable, "-c", "from brakecli.solver.roughness import wheel_angles\nwheel_angles.load()"]
    done = subprocess.run(words, env=lazily(tmp_path), capture_output=True, check=True)
    assert done.stdout + done.stderr == b""
    assert any(tmp_path.rglob("*.nbc"))


@campaign
def test_kernels_compile_without_a_cache_where_the_disk_is_full(tmp_path: Path) -> None:
    out = python(COUNT.format(limit="resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"), tmp_path)
    assert out.splitlines()[0] == FOUND


AT_ONCE = """
from threading import Barrier, Thread
import numpy as np
from brakecli.solver.roughness import surface, turned, wheel_angles
at_once, found = Barrier(8), []
wheel = surface([1.0], wavelengths=[4.0])

def call():
    at_once.wait()
    found.append(float(turned(wheel, 1.0).phase[0]))

threads = [Thread(target=call) for _ in range(8)]
for each in threads:
    each.start()
for each in threads:
    each.join()
print(len(found), len(set(found)))
"""


@campaign
def test_an_entry_is_loaded_once_by_eight_threads_at_once(tmp_path: Path) -> None:
    assert [python(AT_ONCE, tmp_path) for _ in range(2)] == ["8 1\n"] * 2


RECORDS = """
import hashlib
from pathlib import Path
from brakecli.studies.sweeps.workers.task import compute_units
from tests.studies.sweeps.test_together import rough
plan = rough(Path("FOLDER"), 12).plan
print(hashlib.sha256(compute_units(plan, 0, plan.points)).hexdigest())
"""
IN_ORDER = """
import importlib, pkgutil, random
import brakecli.solver
for module in pkgutil.walk_packages(brakecli.solver.__path__, "brakecli.solver."):
    importlib.import_module(module.name)
from brakecli.solver.kernels import entries
order = [*entries]
random.Random(SEED).shuffle(order) if SEED else order.reverse()
for each in order:
    each.load()
assert len(order) > 5
"""
HISTORIES = """
import hashlib
from tests.solver.test_interpreted import histories
print(hashlib.sha256(b"".join(each.tobytes() for each in histories().values())).hexdigest())
"""


def printed(program: str, **changes: str) -> str:
    """What a program prints that loads kernels from the cache of the tests, or from another one."""
    words = [sys.executable, "-c", program]
    return subprocess.run(words, env=environment(**changes), capture_output=True, text=True, check=True).stdout


def copied(folder: Path) -> tuple[Path, Path]:
    """A copy of the kernels alone in a folder, and a whole one as its cache."""
    whole = kernels.folder()
    assert whole is not None
    alone = shutil.copytree(whole, folder / "kept", ignore=shutil.ignore_patterns("manifest.json", "*lock*"))
    return alone, shutil.copytree(whole, folder / "brakecli" / whole.name)


@campaign
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("made", [RECORDS, HISTORIES])
def test_the_order_in_which_kernels_are_loaded_changes_no_byte(tmp_path: Path, made: str) -> None:
    """One that was linked with another's copy of what both call would give other last digits."""
    made = made.replace("FOLDER", str(tmp_path))
    found = {printed(made), *(printed(IN_ORDER.replace("SEED", str(seed)) + made) for seed in (0, 1, 2))}
    assert len(found) == 1
    assert len(found.pop()) == 65


@campaign
@pytest.mark.usefixtures("compiled")
def test_a_process_that_compiles_computes_the_bytes_of_one_that_loads(tmp_path: Path) -> None:
    """The paper's schemes on the nodes of an open pad."""
    program = """
import hashlib, os
os.environ["NUMBA_OPT"] = "1"
from tests.examples import ROUGH, make, simulate
print(hashlib.sha256(simulate(make(ROUGH, solver__scheme="two-layer")).rows.tobytes()).hexdigest())
"""
    assert python(program, tmp_path) == printed(program)


@pytest.mark.parametrize(("alone", "found"), [("", "True 3.0"), ("compiling.set_alone()", "False 0.0")])
@campaign
def test_a_process_that_has_no_kernels_but_ours_waits_for_no_blas(cache: Path, alone: str, found: str) -> None:
    program = f"""
import sys, numba, numpy
from brakecli.solver import compiling
{alone}
from brakecli.solver.roughness import wheel_angles
wheel_angles.load()
there = "scipy.linalg" in sys.modules
print(there, numba.njit(lambda a: numpy.dot(a, a))(numpy.ones(3)) if there else 0.0)
"""
    assert python(program, cache) == f"{found}\n"


@campaign
def test_kernels_compile_where_no_cache_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    out = python(COUNT.format(limit=""), tmp_path / "file")
    assert out.splitlines() == [FOUND, "True"]


@campaign
def test_a_temporary_cache_goes_with_its_process_or_where_that_was_killed_with_a_later_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    (tmp_path / "file").write_text("in the way")
    ended = subprocess.Popen(["true"])
    ended.wait()
    names = [f"brakecli-kernels-{process}-{age}" for process in (ended.pid, os.getpid()) for age in ("old", "new")]
    for name in (*names, "brakecli-kernels-none-old"):
        (tmp_path / name).mkdir()
        if name.endswith("old"):
            os.utime(tmp_path / name, (1e9, 1e9))
    assert python(COUNT.format(limit=""), tmp_path / "file").splitlines() == [FOUND, "True"]
    assert {path.name for path in tmp_path.glob("brakecli-*")} == {*names[1:], "brakecli-kernels-none-old"}


def noise(data: bytes) -> bytes:
    """In the head of the machine code, which LLVM does not check: it ends the process."""
    return data[:50] + random.Random(17).randbytes(50) + data[100:]


@pytest.mark.parametrize(
    ("ending", "change"),
    [
        ("nbc", noise),
        ("nbi", noise),
        ("nbc", lambda data: data[:-1] + bytes([data[-1] ^ 1])),
        ("nbi", lambda data: b""),
        ("nbc", lambda data: b""),
        ("nbc", lambda data: b"\x80\x04K\x01."),
    ],
)
@campaign
@pytest.mark.usefixtures("compiled")
def test_a_damaged_entry_is_not_loaded(tmp_path: Path, ending: str, change: Callable[[bytes], bytes]) -> None:
    """All are made anew: here by a copy, as each would take a minute."""
    kept, folder = copied(tmp_path)
    (path,) = folder.joinpath("roughness.turn_to").rglob(f"*.{ending}")
    whole = path.read_bytes()
    changed = change(whole)
    path.write_bytes(changed)
    copy = f"lambda folder, tell: str(shutil.copytree({str(kept)!r}, folder, dirs_exist_ok=True))[:0]"
    program = f"import shutil\nfrom brakecli.solver import beforehand\nbeforehand._compiled = {copy}\n"
    found = printed(program + COUNT.format(limit=""), XDG_CACHE_HOME=str(tmp_path))
    assert found.splitlines() == [FOUND, "False"]
    assert path.read_bytes() == whole != changed


@campaign
@pytest.mark.usefixtures("compiled")
def test_a_folder_inside_that_cannot_be_written_sends_no_machine_code_elsewhere(tmp_path: Path) -> None:
    _, folder = copied(tmp_path)
    inside = folder / "roughness.turn_to"
    refused = f"import os\nmay = os.access\nos.access = lambda path, mode: {str(inside)!r} not in str(path)\n"
    found = printed(refused + COUNT.format(limit=""), XDG_CACHE_HOME=str(tmp_path))
    assert found.splitlines() == [FOUND, "True"]
    assert not [*Path(kernels.__file__).parent.rglob("*.nb?")]


FORK = """
import os, sys, threading, time
from brakecli.solver import kernels
from brakecli.solver.roughness import surface, turned
kernels.folder()
held = threading.Thread(target=lambda: (kernels._locks[-1].acquire(), time.sleep(60.0)), daemon=True)
held.start()
time.sleep(0.2)
if child := os.fork():
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
    os._exit(0)
turned(surface([1.0], wavelengths=[4.0]), 1.0)
os._exit(7)
"""


@campaign
@pytest.mark.usefixtures("compiled")
def test_a_process_that_is_forked_while_another_thread_loads_does_not_hang() -> None:
    assert printed(FORK) == "7\n"


@campaign
@pytest.mark.usefixtures("compiled")
def test_a_complete_cache_that_cannot_be_written_is_used_by_a_copy(tmp_path: Path) -> None:
    """As root may write everywhere, `os.access` says otherwise."""
    _, folder = copied(tmp_path)
    program = f"""
import os
may = os.access
os.access = lambda path, mode: may(path, mode) and str(path) != {str(folder)!r}
{COUNT.format(limit="")}
from brakecli.solver import kernels
print(str(kernels.folder()) != {str(folder)!r})
"""
    found = printed(program, XDG_CACHE_HOME=str(tmp_path), TMPDIR=str(tmp_path))
    assert found.splitlines() == [FOUND, "False", "True"]
    assert not [*tmp_path.glob("brakecli-kernels-*")]


@campaign
def test_a_cache_that_others_may_write_is_not_used(cache: Path, tmp_path: Path) -> None:
    (folder,) = (cache / "brakecli").iterdir()
    assert folder.stat().st_mode & 0o077 == 0
    folder.chmod(0o777)
    assert python(COUNT.format(limit=""), cache).splitlines() == [FOUND, "True"]
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    assert python(COUNT.format(limit=""), cache).splitlines()[1] == "True"


TROUBLE = """
from brakecli.solver import compiling
compiling.set_notice(lambda trouble: print("trouble:", trouble))
from brakecli.solver.roughness import wheel_angles
wheel_angles.load()
"""


@pytest.mark.parametrize("kind", ["of others", "a file", "a link"])
@campaign
def test_a_cache_that_cannot_be_used_is_named_with_the_remedy(tmp_path: Path, kind: str) -> None:
    python("from brakecli.solver import kernels; kernels.folder()", tmp_path)
    (folder,) = (tmp_path / "brakecli").iterdir()
    if kind == "of others":
        folder.chmod(0o722)
    else:
        folder.rename(tmp_path / "elsewhere")
    if kind == "a file":
        folder.write_text("")
    elif kind == "a link":
        folder.symlink_to(tmp_path / "elsewhere")
    said = python(TROUBLE, tmp_path)
    assert said.startswith("trouble: the cache of compiled kernels cannot be used: ")
    assert str(folder) in said
    assert "name a folder of your own with XDG_CACHE_HOME" in said
