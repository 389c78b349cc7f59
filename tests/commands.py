"""Running the command line as its users do: in processes of its own, with an environment that is known.

Most of the time of a short command goes into imports. A server of command lines, which is this module run as a
program, imports once and forks for each command.
"""

import atexit
import gc
import json
import math
import os
import resource
import shlex
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import h5py

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-W", "error", "-m", "brakecli"]
LIMIT = 600.0  # s, after which a command hangs: kernels may have to be compiled first, and the machine be busy
SOON = 10.0  # s of a processor, in which a hostile file is refused: twenty times what is promised of any
LONG = ["--set", "solver.duration=1e4"]  # minutes
QUICK = 4.0  # s of a processor, after which an interruption has ended a command: forty times what it takes

TINY = """\
title = "Tiny"
shoe.mass = 10.0
wheel = { radius = 0.5, angular_speed = 0.1 }
link1 = { stiffness = 1e7, damping = 300.0 }
link2 = { stiffness = 1.2e7, damping = 300.0, angle_deg = 5.0 }
load.force = 5000.0
friction.coefficient = 0.6
contact = { half_length = 0.05, stiffness = 2e7 }
solver = { step = 1e-5, duration = 0.02 }
output.sample_interval = 1e-4
"""


def lazily(cache: str | Path) -> dict[str, Any]:
    """Variables for a command that has a cache of its own, in which it compiles what it needs alone."""
    return {"XDG_CACHE_HOME": str(cache), "BRAKECLI_COMPILE": "lazy"}


def environment(**changes: str | None) -> dict[str, str]:
    """The tests' own environment without anything that changes how output looks; None takes a variable out."""
    names = "PATH", "HOME", "XDG_CACHE_HOME", "OPENBLAS_CORETYPE"  # the last decides how eigenvalues are rounded
    kept = {name: os.environ[name] for name in names if name in os.environ}
    known: dict[str, str | None] = {**kept, "PYTHONPATH": str(ROOT), "COLUMNS": "100", "LC_ALL": "C.UTF-8"}
    return {name: value for name, value in (known | changes).items() if value is not None}


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    code: int
    out: str
    err: str
    seconds: float = field(default=math.nan, compare=False)
    """Processor time of a fork, which has Python's start and the imports behind it. Compare it with `SOON`."""

    @property
    def json(self) -> dict[str, Any]:
        """The JSON object on standard output; nothing else may be there, and no NaN or infinity in it."""

        def refuse(constant: str) -> None:
            raise AssertionError(f"{constant} is no JSON")

        value: dict[str, Any] = json.loads(self.out, parse_constant=refuse)
        return value

    def told(self, code: int, *words: str) -> str:
        """Standard error, once it is sure that the command ended so and told these words in whole sentences."""
        assert self.code == code, self
        assert "Traceback" not in self.err, self
        for word in words:
            assert word in self.err, self
        return self.err


def brakecli(
    *arguments: str | Path,
    cwd: Path,
    stdin: str | None = None,
    stdout: str | None = None,
    **changes: str | None,
) -> Done:
    """Run one command to its end: a fork, unless it needs another environment than another width of lines.

    `stdout`: where a fork writes to, instead of into the answer.
    """
    words = [str(argument) for argument in arguments]
    if not changes.keys() - {"COLUMNS"}:
        return forked(*words, cwd=cwd, stdout=stdout, stdin=stdin or "", columns=changes.get("COLUMNS"))
    done = subprocess.run(
        [*COMMAND, *words],
        cwd=cwd,
        input=(stdin or "").encode(),
        capture_output=True,
        timeout=LIMIT,
        env=environment(**changes),
    )
    return Done(done.returncode, done.stdout.decode(), done.stderr.decode())


def forked(
    *words: str,
    cwd: Path,
    stdout: str | None = None,
    memory: int | None = None,
    stdin: str = "",
    columns: str | None = None,
) -> Done:
    """Run one command in a fork, which may take so many bytes of memory."""
    server = _server()
    assert server.stdin is not None
    assert server.stdout is not None
    server.stdin.write(json.dumps([str(cwd), words, stdout, memory, stdin, columns]) + "\n")
    server.stdin.flush()
    return Done(**json.loads(server.stdout.readline()))


@contextmanager
def started(
    *arguments: str | Path,
    cwd: Path,
    command: Sequence[str] = COMMAND,
    stdin: int = subprocess.DEVNULL,
    output: bool = True,
    **changes: str | None,
) -> Iterator[subprocess.Popen[bytes]]:
    """A command that is running, in a group of processes of its own; all of it is killed at the end."""
    process = subprocess.Popen(
        [*command, *map(str, arguments)],
        cwd=cwd,
        stdin=stdin,
        stdout=subprocess.PIPE if output else subprocess.DEVNULL,
        stderr=subprocess.PIPE if output else subprocess.DEVNULL,
        env=environment(**changes),
        start_new_session=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def ended(process: subprocess.Popen[bytes], limit: float = LIMIT) -> Done:
    """A command that ends by itself."""
    out, err = process.communicate(timeout=limit)
    return Done(process.returncode, out.decode(), err.decode())


def signalled(process: subprocess.Popen[bytes], number: signal.Signals, *, group: bool = False) -> Done:
    """A command that a signal ends soon: by the time that it computes, as a machine may be busy."""
    assert process.poll() is None
    before = processor_time(process.pid)
    os.killpg(process.pid, number) if group else process.send_signal(number)
    over = partial(os.waitid, os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    wait_until(over)
    spent = processor_time(process.pid) - before
    assert spent < QUICK, f"it computed for {spent} s"
    return ended(process)


def processor_time(process: int) -> float:
    """Seconds that a process has computed, which may have ended unless it has been waited for."""
    numbers = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, numbers[11:13])) / os.sysconf("SC_CLK_TCK")


def run(
    *arguments: str | Path,
    cwd: Path,
    command: Sequence[str] = COMMAND,
    limit: float = LIMIT,
    **changes: str | None,
) -> Done:
    """Run a command to its end in a process of its own, which those of sweeps need, as they start others."""
    with started(
        *arguments, cwd=cwd, command=command, stdin=subprocess.DEVNULL, output=True, **changes
    ) as process:
        return ended(process, limit)


def shell(line: str, cwd: Path, **changes: str | None) -> Done:
    """Run a line of bash, in which $B is the command."""
    command = line.replace("$B", f"exec {shlex.join(COMMAND)}")
    return run("-c", command, cwd=cwd, command=["bash"], limit=LIMIT, **changes)


def wait_until(condition: Callable[[], object], seconds: float = LIMIT) -> None:
    """Wait for something that is to happen within so many seconds."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def warm_up() -> None:
    """See to it that kernels are compiled, so that no command has to do so, or to say that it does."""
    with TemporaryDirectory() as folder:
        variants(Path(folder), [])


def each(cwd: Path, commands: Sequence[Sequence[str | Path]]) -> list[Done]:
    """Run commands one after the other."""
    return [brakecli(*arguments, cwd=cwd) for arguments in commands]


@cache
def _server() -> subprocess.Popen[str]:
    server = subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "tests.commands"],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment(OPENBLAS_NUM_THREADS="1"),  # a process with threads should not fork
    )
    atexit.register(server.communicate)  # which ends it
    return server


def _serve() -> None:
    from matplotlib.backends import backend_agg, backend_svg  # noqa: F401 - which a picture loads as it is saved

    from brakecli.__main__ import main
    from tests import sentences

    sentences.read_all()
    for path in sorted((ROOT / "brakecli").rglob("[!_]*.py")):  # all that any command loads
        if path.stem not in ("api", "accessor"):
            import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    gc.freeze()  # a fork then leaves the memory of the server as it is

    for line in sys.stdin:
        cwd, words, place, memory, typed, columns = json.loads(line)
        with TemporaryFile() as out, TemporaryFile() as err, TemporaryFile() as given:
            given.write(typed.encode())
            given.seek(0)
            child = os.fork()
            if child == 0:
                os.chdir(cwd)
                os.environ.update({"COLUMNS": columns} if columns else {})
                if memory:
                    pages = int(Path("/proc/self/statm").read_text().split()[0])
                    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory,) * 2)
                written = os.open(place, os.O_WRONLY) if place else out.fileno()
                for number, opened in enumerate((given.fileno(), written, err.fileno())):
                    os.dup2(opened, number)
                os._exit(_code_of(main, ["brakecli", *words]))
            _, status, usage = os.wait4(child, 0)
            answer: dict[str, Any] = {
                "code": os.waitstatus_to_exitcode(status),
                "seconds": usage.ru_utime + usage.ru_stime,
            }
            for name, file in (("out", out), ("err", err)):
                file.seek(0)
                answer[name] = file.read().decode()
        print(json.dumps(answer), flush=True)  # noqa: T201


def _code_of(main: Callable[[], None], arguments: list[str]) -> int:
    sys.argv = arguments
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return 0


def variants(cwd: Path, *overrides: Sequence[str]) -> list[Done]:
    """Run the tiny case with overrides, once for each list of them, into 0.h5, 1.h5, …"""
    (cwd / "tiny.toml").write_text(TINY)
    settings = [[part for override in group for part in ("--set", override)] for group in overrides]
    return each(cwd, [["run", "tiny.toml", "--json", "-o", f"{n}.h5", *group] for n, group in enumerate(settings)])


def attributes(path: Path, group: str = "/") -> dict[str, Any]:
    """The attributes of a group of a result file, as any HDF5 program sees them."""
    with h5py.File(path) as file:
        return {name: getattr(value, "tolist", lambda v=value: v)() for name, value in file[group].attrs.items()}


def left_in(directory: Path) -> set[str]:
    """The names of all files there, hidden ones too."""
    return {path.name for path in directory.iterdir()}


if __name__ == "__main__":
    _serve()
