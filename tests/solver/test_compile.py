"""Compiling kernels, with a cache that works and with one that does not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.campaign import campaign

COUNT = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
{limit}
from brakecli.solver import friction
from brakecli.solver import compile as kernels
print(friction.minimise(1.0, 0.0, 1.0, 3.0, 0.0, 1.0, 0.0))
print(kernels.cache_is_cold())
"""


def python(program: str, cache: Path) -> str:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "NUMBA_DISABLE_JIT": "0"}
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout


def test_a_second_process_finds_the_machine_code_of_the_first(tmp_path: Path) -> None:
    python(COUNT.format(limit=""), tmp_path)
    stored = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert stored
    python(COUNT.format(limit=""), tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == stored


@pytest.mark.parametrize("limit", ["", "resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"])
def test_kernels_compile_without_a_cache_where_the_disk_is_full(limit: str, tmp_path: Path) -> None:
    out = python(COUNT.format(limit=limit), tmp_path)
    assert out.splitlines()[0] == "(2.0, 0.0, 1.0)"


def test_a_kernel_for_kernels_alone_cannot_be_called_from_python(tmp_path: Path) -> None:
    program = """
from brakecli.solver import implicit_step
try:
    implicit_step._try_force(None, None, 0.0)
except TypeError as error:
    print(error)
"""
    assert "has no wrapper for calls from Python" in python(program, tmp_path)


def test_kernels_compile_where_no_cache_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    out = python(COUNT.format(limit=""), tmp_path / "file")
    assert out.splitlines() == ["(2.0, 0.0, 1.0)", "True"]


@pytest.mark.parametrize(
    ("ending", "contents"),
    [
        ("nbc", b""),
        pytest.param("nbi", bytes(range(256)) * 20, marks=campaign),
        pytest.param("nbi", b"", marks=campaign),
        pytest.param("nbc", bytes(range(256)) * 20, marks=campaign),
        pytest.param("nbc", b"\x80\x04K\x01.", marks=campaign),
    ],
)
def test_a_damaged_cache_is_compiled_anew(tmp_path: Path, ending: str, contents: bytes) -> None:
    python(COUNT.format(limit=""), tmp_path)
    damaged = [*tmp_path.rglob(f"*.{ending}")]
    for path in damaged:
        path.write_bytes(contents)
    assert python(COUNT.format(limit=""), tmp_path).splitlines()[0] == "(2.0, 0.0, 1.0)"
    assert all(path.read_bytes() != contents for path in damaged if path.exists())
    stored = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")}
    assert python(COUNT.format(limit=""), tmp_path).splitlines() == ["(2.0, 0.0, 1.0)", "False"]
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nbc")} == stored


def test_a_cache_that_others_may_write_is_not_used(tmp_path: Path) -> None:
    python(COUNT.format(limit=""), tmp_path)
    (folder,) = (tmp_path / "brakecli").iterdir()
    assert folder.stat().st_mode & 0o077 == 0
    folder.chmod(0o777)
    assert python(COUNT.format(limit=""), tmp_path).splitlines() == ["(2.0, 0.0, 1.0)", "True"]
    folder.rename(tmp_path / "elsewhere")
    folder.symlink_to(tmp_path / "elsewhere")
    assert python(COUNT.format(limit=""), tmp_path).splitlines()[1] == "True"
