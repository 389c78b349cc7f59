"""Compiling kernels, with a cache that works and with one that does not."""

import fcntl
import os
import random
import shutil
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from brakecli.solver import implicit_step, schemes
from brakecli.solver.compile import address
from brakecli.solver.schemes import event_driven
from tests.campaign import campaign
from tests.commands import environment

COUNT = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
{limit}
from brakecli.solver import compiling
told = []
compiling.set_notice(lambda trouble: told.append(1))
from brakecli.solver import friction
print(friction.minimise(1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0))
print(bool(told))
"""


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
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "True"]
    return cache


@pytest.fixture
def cache(filled: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return shutil.copytree(filled, tmp_path / "cache")


def test_a_second_process_finds_the_machine_code_of_the_first_and_gives_no_notice(cache: Path) -> None:
    stored = {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}
    assert stored
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "False"]
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")} == stored


@campaign
def test_the_notice_comes_once_and_before_the_first_kernel_is_kept(tmp_path: Path) -> None:
    program = """
from pathlib import Path
from brakecli.solver import compiling
compiling.set_notice(lambda trouble: print([*Path("FOLDER").rglob("*.nbc")]))
from brakecli.solver import friction
"""
    assert python(program.replace("FOLDER", str(tmp_path)), tmp_path) == "[]\n"
    assert len([*tmp_path.rglob("*.nbc")]) > 1


@campaign
def test_a_kind_of_kernels_that_a_warm_cache_lacks_brings_the_notice(cache: Path) -> None:
    another = COUNT.format(limit="").replace("import friction", "import friction, double_double")
    assert [python(another, cache).split()[-1] for _ in range(2)] == ["True", "False"]


@campaign
def test_python_compiles_in_silence(tmp_path: Path) -> None:
    words = [sys.executable, "-c", "import brakecli.solver.friction"]
    done = subprocess.run(words, env=lazily(tmp_path), capture_output=True, check=True)
    assert done.stdout + done.stderr == b""
    assert any(tmp_path.rglob("*.nbc"))


@campaign
def test_kernels_compile_without_a_cache_where_the_disk_is_full(tmp_path: Path) -> None:
    out = python(COUNT.format(limit="resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"), tmp_path)
    assert out.splitlines()[0] == "(2.0, 0.0, 1.0)"


def test_a_kernel_for_kernels_alone_cannot_be_called_from_python() -> None:
    with pytest.raises(TypeError, match="has no wrapper for calls from Python"):
        implicit_step._try_force(None, None, 0.0)  # type: ignore[arg-type]


LOADED = """
from threading import Barrier, Thread
from brakecli.solver import contact, friction, implicit_step, schemes
kernels = friction.minimise, implicit_step.newton, implicit_step._try_force
print(*(len(each.overloads) for each in kernels))
at_once, found = Barrier(8), []

def call():
    at_once.wait()
    found.append(friction.minimise(1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0))

threads = [Thread(target=call) for _ in range(8)]
for each in threads:
    each.start()
for each in threads:
    each.join()
print(len(found), *set(found), *(len(each.overloads) for each in kernels))
scheme, evaluate = schemes.load("two-layer"), contact.load("midpoint")
print(len(scheme.advance.overloads), len(evaluate.overloads))  # before anything is timed
"""
NAMED = """
import pickle
from brakecli.solver import friction
moved = pickle.loads(pickle.dumps(friction.minimise))
print(moved(1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0))
print(friction.minimise(a_11=1.0, a_12=0.0, a_22=1.0, g_1=3.0, g_2=0.0, g_0=1.0, belt=0.0))
"""


@campaign
def test_a_cached_kernel_is_loaded_by_its_first_call_even_by_eight_threads_at_once(tmp_path: Path) -> None:
    """One for kernels alone is compiled with its caller and never loaded."""
    assert python(LOADED, tmp_path).splitlines()[0] == "1 1 1"
    assert python(LOADED, tmp_path).splitlines() == ["0 0 0", "8 (2.0, 0.0, 1.0) 1 0 0", "1 1"]
    assert python(NAMED, tmp_path) == 2 * "(2.0, 0.0, 1.0)\n"


SELF_CONTAINED = """
import math
from brakecli.solver.compile import kernel
from numba import float64, void

@kernel(float64(float64), inlined=False)
def helper(x):  # too long for the compiler to inline it of its own accord
STEPS    return x

@kernel(float64(float64))
def caller(x):
    return helper(x) + helper(2.0 * x)

(compiled,) = caller.overloads.values()
for function in compiled.library._get_module_for_linking().functions:
    if not function.is_declaration:
        print("helper" in function.name, function.linkage.name)
""".replace("STEPS", 20 * "    x = math.sin(x) / (1.0 + x * x)\n")


def test_a_kernel_takes_no_other_copy_of_what_it_calls_than_its_own(tmp_path: Path) -> None:
    """Otherwise one that a process has just compiled and one that it has loaded may add in another order."""
    lines = python(SELF_CONTAINED, tmp_path).splitlines()
    assert [line for line in lines if line.startswith("True")] == ["True internal"]


RECORDS = """
import hashlib
from pathlib import Path
from brakecli.sweeps.workers.task import compute_units
from tests.sweeps.test_together import rough
plan = rough(Path("FOLDER"), 12).plan
print(hashlib.sha256(compute_units(plan, 0, plan.points)).hexdigest())
"""


@campaign
def test_a_process_that_compiles_computes_the_bytes_of_one_that_loads(tmp_path: Path) -> None:
    one, other = (python(RECORDS.replace("FOLDER", str(tmp_path)), tmp_path / "cache") for _ in range(2))
    assert one == other


IN_ORDER = """
import importlib, pkgutil, random
import brakecli.solver
for module in pkgutil.walk_packages(brakecli.solver.__path__, "brakecli.solver."):
    importlib.import_module(module.name)
from brakecli.solver.compile import kernels, ready
order = [*kernels]
random.Random(SEED).shuffle(order) if SEED else order.reverse()
for each in order:
    ready(each)
assert len(order) > 200
"""


@campaign
@pytest.mark.usefixtures("compiled")
def test_the_order_in_which_kernels_are_loaded_changes_no_byte(tmp_path: Path) -> None:
    """One that was linked with another's copy of what both call would give other last digits."""
    records = RECORDS.replace("FOLDER", str(tmp_path))
    programs = [records, *(IN_ORDER.replace("SEED", str(seed)) + records for seed in (0, 1, 2))]
    found = {
        subprocess.run(
            [sys.executable, "-c", program], env=environment(), capture_output=True, text=True, check=True
        ).stdout
        for program in programs
    }
    assert len(found) == 1
    assert len(found.pop()) == 65


def test_a_kernel_that_is_called_by_its_address_is_there_with_its_scheme() -> None:
    schemes.load("event-driven")
    kernel: Any = event_driven.solve
    (compiled,) = kernel.overloads.values()
    assert address(kernel) == compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name) != 0


@pytest.mark.parametrize(("before", "found"), [("", "False"), ("import scipy.linalg.cython_blas", "True")])
@campaign
def test_kernels_load_no_blas_and_leave_it_to_those_of_others(cache: Path, before: str, found: str) -> None:
    dot = "numba.njit(lambda a: numpy.dot(a, a))(numpy.ones(3))"
    program = f"""
{before}
import sys, numba, numpy
from brakecli.solver import friction
print("scipy.linalg" in sys.modules, {dot}, "scipy.linalg.cython_blas" in sys.modules)
"""
    assert python(program, cache).split() == [found, "3.0", "True"]


def test_kernels_compile_where_no_cache_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    out = python(COUNT.format(limit=""), tmp_path / "file")
    assert out.splitlines() == ["(2.0, 0.0, 1.0)", "True"]


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
    assert python(COUNT.format(limit=""), tmp_path / "file").splitlines() == ["(2.0, 0.0, 1.0)", "True"]
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
def test_a_damaged_cache_is_compiled_anew(cache: Path, ending: str, change: Callable[[bytes], bytes]) -> None:
    damaged = {path: change(path.read_bytes()) for path in cache.rglob(f"*.{ending}")}
    for path, contents in damaged.items():
        path.write_bytes(contents)
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "True"]
    called = {path: contents for path, contents in damaged.items() if path.match("friction.minimise-*")}
    assert called
    assert all(path.read_bytes() != contents for path, contents in called.items())
    stored = {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "False"]
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")} == stored


@campaign
def test_the_files_of_a_kernel_are_not_taken_for_those_of_another(cache: Path) -> None:
    (one,) = cache.rglob("friction.minimise-*.nbc")
    other = next(path for path in sorted(cache.rglob("*.nbc")) if path != one)
    kept = one.read_bytes()
    one.write_bytes(other.read_bytes())
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "True"]
    assert len(one.read_bytes()) == len(kept)


@campaign
def test_a_cache_that_others_may_write_is_not_used(cache: Path, tmp_path: Path) -> None:
    (folder,) = (cache / "brakecli").iterdir()
    assert folder.stat().st_mode & 0o077 == 0
    folder.chmod(0o777)
    assert python(COUNT.format(limit=""), cache).splitlines() == ["(2.0, 0.0, 1.0)", "True"]
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    assert python(COUNT.format(limit=""), cache).splitlines()[1] == "True"


TROUBLE = """
from brakecli.solver import compiling
compiling.set_notice(lambda trouble: print("trouble:", trouble))
from brakecli.solver import kernel_cache
kernel_cache.PATIENCE = 0.1
from brakecli.solver import friction
"""


@campaign
def test_a_process_that_keeps_the_lock_is_waited_for_no_longer_than_a_limit_and_is_named(tmp_path: Path) -> None:
    python("from brakecli.solver import compile", tmp_path)
    (folder,) = (tmp_path / "brakecli").iterdir()
    assert folder.stat().st_mode & 0o777 == 0o700
    with (folder / "lock").open("r+") as lock:
        fcntl.lockf(lock, fcntl.LOCK_EX)
        said = python(TROUBLE, tmp_path)
    assert said.startswith(f"trouble: {folder}/lock: another process has compiled a kernel for more than 0.1 s")
    assert said.count("\n") == 1
    assert any(folder.rglob("*.nbc"))


@campaign
def test_a_process_waits_for_the_kernels_alone_that_another_one_compiles(cache: Path) -> None:
    """Those of friction are locked by their names; others are compiled meanwhile."""
    (folder,) = (cache / "brakecli").iterdir()
    indices = sorted(folder.rglob("friction.*.nbi"))
    with (folder / "lock").open("r+") as lock:
        for path in indices:
            fcntl.lockf(lock, fcntl.LOCK_EX, 1, zlib.crc32(path.name.encode()))
            path.unlink()
        assert python(TROUBLE.replace("friction", "double_double"), cache) == "trouble: \n"
        assert f"{folder}/lock: another process" in python(TROUBLE, cache)
    assert indices


@pytest.mark.parametrize("kind", ["of others", "a file", "a link", "read-only"])
@campaign
def test_a_cache_that_cannot_be_used_is_named_with_the_remedy(tmp_path: Path, kind: str) -> None:
    python("from brakecli.solver import compile", tmp_path)
    (folder,) = (tmp_path / "brakecli").iterdir()
    if kind == "of others":
        folder.chmod(0o722)
    else:
        folder.rename(tmp_path / "elsewhere")
    if kind == "a file":
        folder.write_text("")
    elif kind == "a link":
        folder.symlink_to(tmp_path / "elsewhere")
    elif kind == "read-only":
        folder.mkdir()
        (folder / "lock").mkdir()  # root may write everywhere; this cannot be opened by anybody
    said = python(TROUBLE, tmp_path)
    assert said.startswith("trouble: the cache of compiled kernels cannot be used: ")
    assert str(folder) in said
    assert "name a folder of your own with XDG_CACHE_HOME" in said
