"""A result file that tests write, damage and read, and processes that do so."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from brakecli.results.field import Field
from brakecli.results.read import digest, open_result
from brakecli.results.write import ResultFile, new_result
from tests.commands import LIMIT, ROOT

ROWS = 40000


def fill(result: ResultFile, rows: int = ROWS) -> None:
    result.set_attributes({"kind": "run", "case_toml": 'title = "Größe"\n' * 50})
    result.axis("history", Field("time", "s", "time"))
    result.variable("history", Field("state", "1", "state of the pad", "i1"), ["time"])
    for start in range(0, rows, 10000):
        time = np.arange(start, min(rows, start + 10000)) * 1e-5
        result.append("history", {"time": time, "state": np.full(time.shape, -1)})
        result.read("history", "time", 0, 5)
    result.axis("spectrum", Field("frequency", "Hz", "frequency"), np.arange(50.0))
    result.variable("spectrum", Field("vx", "m²/s", "density of vx"), ["frequency"], np.arange(50.0) ** 2)


def write(path: Path, rows: int = ROWS) -> None:
    with new_result(path, force=True) as result:
        fill(result, rows)
        result.commit()


def read_all(path: Path) -> dict[str, Any]:
    with open_result(path, "run") as result:
        everything: dict[str, Any] = {"": str(result.attributes)}
        for group in ("history", "spectrum"):
            for name, variable in result.variables(group).items():
                everything[f"{group}/{name}"] = str(variable), result.read(group, name).tobytes()
        return everything


@contextmanager
def edited(path: Path) -> Iterator[h5py.File]:
    """A result that may be changed within the block, and has a digest that fits again behind it."""
    with h5py.File(path, "r+") as file:  # which cuts the digest off
        yield file
    with path.open("r+b", buffering=0) as stream:
        stream.write(digest(stream, path.stat().st_size))


Action = Callable[[Path], None]


def command_of(action: Action, path: Path) -> list[str]:
    """The command that calls a function of a test file, which has to be a program that does so."""
    return [sys.executable, "-W", "error", "-m", action.__module__, action.__name__, str(path)]


def in_a_process(action: Action, path: Path) -> None:
    """Call a function where a crash or a hang is seen, and does not take the tests along."""
    done = subprocess.run(command_of(action, path), cwd=ROOT, capture_output=True, text=True, timeout=3 * LIMIT)
    assert done.returncode == 0, done.stdout + done.stderr
