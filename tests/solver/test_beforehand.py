"""Kernels that are compiled beforehand: the manifest, who waits for whom, and what is done where it cannot be."""

import fcntl
import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from brakecli.solver import beforehand, compiling
from brakecli.solver.cache_folder import HOW, LAZY, MANIFEST, REMEDY
from tests.campaign import campaign
from tests.commands import TINY, brakecli, ended, environment, started, wait_until

FACTS = {"numba": "1.2"}


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The folders in which children would have compiled, which write two kernels instead."""
    folders: list[Path] = []

    def write(folder: Path, tell: compiling.Tell) -> str:
        (folder / "a.part").mkdir(exist_ok=True)
        (folder / "a.part" / "a.1.nbc").write_bytes(b"code")
        (folder / "a.part" / "a.nbi").write_bytes(b"index")
        beforehand.vouch(folder / "a.part")
        tell(1, 1)
        folders.append(folder)
        return ""

    monkeypatch.delenv(HOW, raising=False)
    monkeypatch.setattr(beforehand, "_compiled", write)
    return folders


def test_what_is_there_is_not_compiled_again(made: list[Path], tmp_path: Path) -> None:
    for _ in range(3):
        assert beforehand.prepare(tmp_path, FACTS) == ""
    assert made == [tmp_path]
    assert beforehand.is_sound(tmp_path / "a.part")
    assert not beforehand.is_sound(tmp_path / "b.part")
    (tmp_path / "a.part" / "a.1.nbc").write_bytes(b"core")  # as long as before
    assert not beforehand.is_sound(tmp_path / "a.part")


def _shorten(folder: Path) -> None:
    (folder / "a.part" / "a.1.nbc").write_bytes(b"cod")


def _remove(folder: Path) -> None:
    (folder / "a.part" / "a.nbi").unlink()


def _break(folder: Path) -> None:
    (folder / MANIFEST).write_text("{")


def _list(folder: Path) -> None:
    (folder / MANIFEST).write_text("[1]")


@pytest.mark.parametrize("change", [_shorten, _remove, _break, _list, beforehand.forget])
def test_what_does_not_fit_is_made_anew_as_a_whole(
    made: list[Path], tmp_path: Path, change: Callable[[Path], None]
) -> None:
    beforehand.prepare(tmp_path, FACTS)
    (tmp_path / "a.part" / "old.nbc").write_bytes(b"")
    change(tmp_path)
    assert beforehand.prepare(tmp_path, FACTS) == ""
    assert len(made) == 2
    assert not (tmp_path / "a.part" / "old.nbc").exists()
    assert beforehand.prepare(tmp_path, FACTS) == ""
    assert len(made) == 2


def test_other_versions_and_touched_sources_are_made_anew(
    made: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beforehand.prepare(tmp_path, FACTS)
    beforehand.prepare(tmp_path, {"numba": "1.3"})
    assert len(made) == 2
    monkeypatch.setattr(beforehand, "_stamps", lambda: {"friction.py": [1, 2]})
    beforehand.prepare(tmp_path, {"numba": "1.3"})
    assert len(made) == 3


@pytest.mark.parametrize("mode", [LAZY, beforehand.CHILD])
def test_whoever_compiles_himself_waits_for_nobody(
    made: list[Path], tmp_path: Path, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(HOW, mode)
    assert beforehand.prepare(tmp_path, FACTS) == ""
    assert made == []


def test_what_keeps_children_from_compiling_is_told_with_the_remedy(
    made: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(os, "statvfs", lambda path: SimpleNamespace(f_bavail=1, f_frsize=4096))
        told = beforehand.prepare(tmp_path, FACTS)
        assert told.endswith(f"(found {tmp_path}); free 30 MB there, or {REMEDY}")
    with monkeypatch.context() as patch:
        patch.setattr(resource, "getrlimit", lambda which: (10**9, 10**9))
        assert beforehand.prepare(tmp_path, FACTS).endswith("raise the limit with: ulimit -v unlimited")
    with monkeypatch.context() as patch:
        patch.setattr(sys, "executable", "")
        assert beforehand.prepare(tmp_path, FACTS).endswith("call brakecli once from a shell")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        told = beforehand.prepare(tmp_path, FACTS)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert "8 MB cannot be written: file too large" in told
    (tmp_path / "file").write_text("in the way")
    told = beforehand.prepare(tmp_path / "file", FACTS)
    assert told.endswith(f"beforehand: file exists (found {tmp_path}/file); {REMEDY}")
    assert made == []


def test_an_unknown_way_to_compile_is_told(
    made: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setenv(HOW, "later")
    compiling.set_warning(told.append)
    try:
        assert beforehand.prepare(tmp_path, FACTS) == ""
    finally:
        compiling.set_warning(None)
    assert told == ["BRAKECLI_COMPILE: unknown value (found 'later'); it may be 'lazy'"]


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _deep(path: Path) -> None:
    path.write_text(200_000 * "[")


def _long(path: Path) -> None:
    path.touch()
    os.truncate(path, 10**11)


def _link(path: Path) -> None:
    (path.parent / "precious").write_text("mine")
    path.symlink_to("precious")


def _folder(path: Path) -> None:
    path.mkdir()
    (path / "file").touch()


@pytest.mark.parametrize(
    ("make", "name"),
    [(_fifo, MANIFEST), (_deep, MANIFEST), (_long, "total"), (_link, "a.part/a.nbi"), (_folder, "a.part/a.1.nbc")],
)
def test_whatever_is_in_the_place_of_a_file_is_replaced(
    made: list[Path], tmp_path: Path, make: Callable[[Path], None], name: str
) -> None:
    beforehand.prepare(tmp_path, FACTS)
    (tmp_path / name).unlink(missing_ok=True)
    make(tmp_path / name)
    if name == "total":
        beforehand.forget(tmp_path)
    for _ in range(2):
        assert beforehand.prepare(tmp_path, FACTS) == ""
    assert len(made) == 2
    assert (
        not (tmp_path / "a.part" / "precious").exists() or (tmp_path / "a.part" / "precious").read_text() == "mine"
    )


@pytest.mark.parametrize("make", [_fifo, _link, _folder])
def test_what_is_in_the_place_of_the_lock_is_left_alone_and_told(
    made: list[Path], tmp_path: Path, make: Callable[[Path], None]
) -> None:
    make(tmp_path / "beforehand.lock")
    told = beforehand.prepare(tmp_path, FACTS)
    assert f"(found {tmp_path}/beforehand.lock); {REMEDY}" in told
    assert made == []
    assert not (tmp_path / "precious").exists() or (tmp_path / "precious").read_text() == "mine"


def _interpreter(folder: Path, script: str) -> str:
    """What runs a script of the shell in place of Python's; $5 is the folder of kernels."""
    interpreter = folder / "python"
    interpreter.write_text(f"#!/bin/sh\n{script}\n")
    interpreter.chmod(0o755)
    return str(interpreter)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo one >&2; echo out of memory >&2; exit 1", "out of memory"),
        ("exit 0", "0 of 0 could be kept"),
        ("kill -9 $$", "signal 9 has ended what compiles them, perhaps for lack of memory"),
    ],
)
def test_children_that_fail_leave_no_manifest_and_their_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, said: str
) -> None:
    cache = tmp_path / "cache"
    monkeypatch.delenv(HOW, raising=False)
    monkeypatch.setattr(sys, "executable", _interpreter(tmp_path, script))
    told = beforehand.prepare(cache, FACTS)
    assert told == f"the kernels cannot be compiled beforehand: {said} (found {cache}); {REMEDY}"
    assert not (cache / MANIFEST).exists()


def test_children_look_for_modules_where_this_process_does_but_not_in_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = str(Path(beforehand.__file__).parents[2])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", str(tmp_path), "relative", "/somewhere", root])
    assert beforehand._places() == ["/somewhere", root]
    monkeypatch.setattr(sys, "path", ["/somewhere", Path("/text")])
    assert beforehand._places() == [root, "/somewhere"]
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert beforehand._places() == [root, "/somewhere"]


def test_one_who_comes_while_another_compiles_waits_and_sees_how_far_it_is(
    made: list[Path], tmp_path: Path
) -> None:
    """The other one lets go of the lock once it has been told of its progress twice."""
    beforehand.prepare(tmp_path, FACTS)
    manifest = (tmp_path / MANIFEST).read_bytes()
    beforehand.forget(tmp_path)
    (tmp_path / "total").write_text("7")
    told: list[tuple[int, int]] = []
    with (tmp_path / "beforehand.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)

        @contextmanager
        def shown(seconds: float) -> Iterator[compiling.Tell]:
            assert seconds > 0.0

            def tell(done: int, total: int) -> None:
                told.append((done, total))
                if len(told) == 2:
                    (tmp_path / MANIFEST).write_bytes(manifest)
                    fcntl.flock(lock, fcntl.LOCK_UN)

            yield tell

        compiling.set_progress(shown)
        try:
            assert beforehand.prepare(tmp_path, FACTS) == ""
        finally:
            compiling.set_progress(None)
    assert told == [(1, 7), (1, 7)]
    assert made == [tmp_path]


@pytest.mark.parametrize(
    ("quota", "count"), [("150000 100000", 2), ("10000 100000", 1), ("max 100000", 0), ("", 0)]
)
def test_the_quota_of_a_container_bounds_the_cores(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, quota: str, count: int
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {*range(6)})
    monkeypatch.setattr(beforehand, "QUOTA", tmp_path / "cpu.max")
    assert beforehand.cores() == 6
    (tmp_path / "cpu.max").write_text(quota)
    assert beforehand.cores() == (count or 6)


def child(folder: Path, cache: Path, stdin: int) -> subprocess.CompletedProcess[str]:
    changes: dict[str, str | None] = {"XDG_CACHE_HOME": str(cache), HOW: beforehand.CHILD}
    words = [
        sys.executable,
        "-I",
        "-c",
        beforehand._START,
        json.dumps(beforehand._places()),
        str(folder),
        "0",
    ]
    return subprocess.run(words, stdin=stdin, capture_output=True, text=True, env=environment(**changes))


@campaign
def test_a_child_ends_with_the_process_that_has_started_it(tmp_path: Path) -> None:
    """Its standard input has an end then."""
    with subprocess.Popen(["sleep", "60"], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        wrong = child(tmp_path, tmp_path / "cache", other.stdout.fileno())
        other.kill()
    (folder,) = (tmp_path / "cache" / "brakecli").iterdir()
    assert wrong.stderr == f"the cache is {folder}\n"
    assert child(folder, tmp_path / "cache", subprocess.DEVNULL).returncode == 1
    assert not any(folder.rglob("*.nbc"))


COUNT = """
from numba.core import event
from brakecli.cli.app import main
import sys
compiled = []

class Compiling(event.Listener):
    def on_start(self, event):
        compiled.append(event)

    def on_end(self, event):
        pass

event.register("numba:compile", Compiling())
for line in sys.argv[1:]:
    sys.argv = ["brakecli", *line.split(), "--quiet"]
    try:
        main()
    except SystemExit as end:
        assert not end.code, line
print(len(compiled))
"""


@campaign
@pytest.mark.usefixtures("compiled")
def test_whoever_computes_never_compiles(tmp_path: Path) -> None:
    listed = brakecli("new", "--list", cwd=tmp_path).out
    starters = [line.split()[0] for line in listed.splitlines()[1:] if line[:1].isalpha()]  # below the headers
    lines = [f"new {name} -o {name}.toml" for name in starters]
    for name in starters:
        brakecli("new", name, "-o", f"{name}.toml", cwd=tmp_path)
        text = (tmp_path / f"{name}.toml").read_text()
        if "[shoe]" in text:
            lines += [f"run {name}.toml --set solver.duration=0.01 -o {name}.h5", f"stability {name}.toml"]
            lines += [f"compare-schemes {name}.toml --set solver.duration=0.001 --budget 1 -o {name}-c.h5"]
    done = subprocess.run(
        [sys.executable, "-c", COUNT, *lines[len(starters) :]],
        cwd=tmp_path, env=environment(), capture_output=True, text=True,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("0\n", "")
    assert len(starters) > 3


SENTENCE = "brakecli: compiling all numerical kernels, once for this version; this takes about "


@campaign
def test_first_commands_side_by_side_wait_for_one_and_a_killed_one_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    cache: dict[str, Any] = {"XDG_CACHE_HOME": str(tmp_path / "cache")}

    def compiled() -> int:
        return len([*(tmp_path / "cache").rglob("*.nbc")])

    with started("run", "tiny.toml", "-o", "first.h5", cwd=tmp_path, **cache) as first:
        wait_until(lambda: compiled() > 0)
        os.killpg(first.pid, signal.SIGKILL)
    with (
        started("run", "tiny.toml", "-o", "one.h5", cwd=tmp_path, **cache) as one,
        started("run", "tiny.toml", "-o", "two.h5", "-q", cwd=tmp_path, **cache) as two,
    ):
        said = ended(one, 900.0).told(0)
        assert ended(two, 900.0).told(0) == ""
    assert said.startswith(SENTENCE)
    assert brakecli("run", "tiny.toml", "-o", "three.h5", cwd=tmp_path, stdin="", **cache).told(0) == ""
    (folder,) = (tmp_path / "cache" / "brakecli").iterdir()
    assert int((folder / "total").read_text()) == compiled() > 5
