"""Outputs that cannot be written: the path and the reason are told, and nothing is left behind."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.campaign import campaign
from tests.commands import TINY, Done, brakecli, each, left_in, shell

pytestmark = pytest.mark.usefixtures("compiled")


def shells(cwd: Path, lines: Sequence[str]) -> list[Done]:
    """Run lines of the shell, two at a time."""
    with ThreadPoolExecutor(2) as pool:
        return list(pool.map(lambda line: shell(line, cwd), lines))


def test_a_full_disk_is_told_with_the_path_and_leaves_nothing(here: Path) -> None:
    limits = (0, 60)  # KiB that a file may have
    run = "$B run tiny.toml --set solver.duration=0.1 -o"
    for limit, done in zip(limits, shells(here, [f"ulimit -f {n}; {run} {n}.h5" for n in limits]), strict=True):
        assert done.told(74, f"{limit}.h5: cannot write: ").count("\n") == 1
    assert shell("ulimit -f 0; $B new other", here).told(74, "other.toml: cannot write: ").count("\n") == 1
    assert left_in(here) == {"tiny.toml"}
    brakecli("run", "tiny.toml", "-o", "10.h5", "--quiet", cwd=here).told(0)  # once there is room again


def test_a_full_standard_output_is_told(here: Path) -> None:
    commands = [
        "run tiny.toml -o 1.h5 --json",
        "run tiny.toml -o 2.h5",
        "check tiny.toml",
        "check tiny.toml --json",
    ]
    commands += ["new x", "schema", "--help", "run --help", "--version"]
    forks = [brakecli(*command.split(), cwd=here, stdout="/dev/full") for command in commands]
    for done in (*forks, shell("$B check tiny.toml > /dev/full", here)):
        assert done.told(74, "standard output: cannot write: no space left on device").count("\n") == 1


@campaign
def test_closed_streams_and_a_full_standard_error_change_nothing(good: Path, here: Path) -> None:
    redirections = [">&-", "<&- >&- 2>&-", "2>/dev/full", "| true"]
    lines = [f"set -o pipefail; $B run tiny.toml -o {n}.h5 {to}" for n, to in enumerate(redirections)]
    for n, done in enumerate(shells(here, lines)):
        done.told(0)
        assert (here / f"{n}.h5").read_bytes() == (good / "tiny.h5").read_bytes()
    wrong = zip(("run missing.toml", "no-such-command", "run missing.toml"), redirections, strict=False)
    for done in shells(here, [f"$B {command} {to}" for command, to in wrong]):
        done.told(2)
    shell("set -o pipefail; $B --help | true", here).told(0)
    shell("$B run - <&-", here).told(2, "standard input: cannot be read")


@pytest.mark.parametrize(
    ("output", "reason"),
    [
        ("missing/r.h5", "the directory"),
        ("folder", "this is a directory"),
        ("/proc/r.h5", "no such file or directory"),
        ("x" * 300, "file name too long"),
        ("/dev/null", "not a regular file"),
    ],
)
def test_an_output_that_cannot_be_is_told_with_its_path(here: Path, output: str, reason: str) -> None:
    (here / "folder").mkdir()
    brakecli("run", "tiny.toml", "-o", output, "--force", cwd=here).told(74, f"{output}: cannot write: ", reason)
    assert left_in(here) == {"tiny.toml", "folder"}


def test_outputs_elsewhere_are_written_and_the_case_is_never_replaced(here: Path) -> None:
    (here / "inner").mkdir()
    brakecli("run", "../tiny.toml", "-o", "../r.h5", "-q", cwd=here / "inner").told(0)
    assert left_in(here) == {"tiny.toml", "inner", "r.h5"}
    for name in ("tiny.toml", "./tiny.toml", "inner/../tiny.toml"):
        told = brakecli("run", "tiny.toml", "--force", "-o", name, cwd=here)
        told.told(2, "this is the case itself; choose another output with -o")
    assert (here / "tiny.toml").read_text() == TINY
    before = (here / "r.h5").read_bytes()
    brakecli("run", "tiny.toml", "-o", "r.h5", cwd=here).told(2, "r.h5: exists already; replace it with --force")
    assert (here / "r.h5").read_bytes() == before


@campaign
def test_a_deleted_working_directory_is_told(here: Path) -> None:
    gone = 'mkdir gone; cd gone; rmdir "$PWD"; $B '
    shell(f"{gone} run {here}/tiny.toml", here).told(74, "tiny.h5: cannot write: no such file or directory")
    shell(f"{gone} new", here).told(74, "case.toml: cannot write: no such file or directory")
    shell(f"{gone} check {here}/tiny.toml", here).told(0)


def test_of_a_symbolic_link_the_file_counts_that_it_leads_to(good: Path, here: Path) -> None:
    """Its own name does not say what is lost; a link to a result is replaced as the result itself."""
    (here / "r.h5").write_bytes((good / "tiny.h5").read_bytes())
    (here / "precious.txt").write_text("mine")
    (here / "precious").write_text("mine")
    for suffix in ("h5", "png", "csv", "html"):
        (here / f"ln.{suffix}").symlink_to("precious.txt")
    (here / "bare.h5").symlink_to("precious")
    sweep = 'case = "tiny.toml"\n[[axis]]\nparameter = "shoe.mass"\nvalues = [10.0]\n'
    (here / "s.toml").write_text(sweep)
    vary = "friction.coefficient=0.1:0.5:3"
    lines = [
        ["run", "tiny.toml", "-o", "ln.h5"],
        ["run", "tiny.toml", "-o", "bare.h5"],
        ["sweep", "s.toml", "-j", "1", "-o", "bare.h5"],
        ["branch", "tiny.toml", "--parameter", "friction.coefficient=0:1", "-o", "bare.h5"],
        ["compare-schemes", "tiny.toml", "-o", "bare.h5"],
        ["stability", "tiny.toml", "--vary", vary, "-o", "ln.csv"],
        ["plot", "r.h5", "-o", "ln.png"],
        ["export", "r.h5", "-o", "ln.csv"],
        ["report", "r.h5", "-o", "ln.html"],
    ]
    for line, done in zip(lines, each(here, [[*line, "--force"] for line in lines]), strict=True):
        name = line[-1]
        found = "is no result" if name == "bare.h5" else "is HDF5, not .txt" if name == "ln.h5" else "found '.txt'"
        done.told(2, name, found)
    assert {(here / name).read_text() for name in ("precious", "precious.txt")} == {"mine"}
    (here / "latest.h5").symlink_to("r.h5")
    brakecli("run", "tiny.toml", "-o", "latest.h5", "--force", "-q", cwd=here).told(0)
    assert (here / "latest.h5").is_symlink()
    assert (here / "r.h5").read_bytes() == (good / "tiny.h5").read_bytes()
