"""Locale, home, terminal, cache and names of files change no bit of a result."""

import os
import re
import unicodedata
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.campaign import campaign
from tests.commands import TINY, Done, brakecli, each, lazily, shell
from tests.results.results import edited

pytestmark = pytest.mark.usefixtures("compiled")

COMPILING = (
    "brakecli: compiling numerical kernels for this kind of work, once for this version; "
    "this may take a minute or two\n"
)


@campaign
def test_the_surroundings_change_no_bit(good: Path, here: Path) -> None:
    surroundings: list[dict[str, str | None]] = [
        {"LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "COLUMNS": "1"},
        {
            "LC_ALL": "C",
            "PYTHONUTF8": "0",
            "PYTHONCOERCECLOCALE": "0",
            "PYTHONIOENCODING": "ascii",
            "HOME": None,
            "BRAKECLI_COMPILE": "lazy",
        },
        {"TERM": "dumb", "NO_COLOR": "1", "COLUMNS": "no", "HDF5_USE_FILE_LOCKING": "FALSE", "TZ": "Asia/Tokyo"},
    ]

    def run(n: int) -> Done:
        return brakecli("run", "tiny.toml", "-o", f"{n}.h5", cwd=here, stdin="", **surroundings[n])

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(run, range(len(surroundings))))
    for n, done in enumerate(outcomes):
        assert done.told(0).replace(COMPILING, "") == ""  # there may be another home, without compiled code
        assert re.search(r"\d\.\d", done.out)
        assert not re.search(r"\d,\d", done.out)
        assert all(len(line) <= 100 for line in done.out.splitlines())
        assert len(done.out.splitlines()) < 60
        assert (here / f"{n}.h5").read_bytes() == (good / "tiny.h5").read_bytes()


@campaign
def test_without_a_place_for_compiled_code_everything_works_but_slower(here: Path) -> None:
    done = brakecli("run", "tiny.toml", "--json", cwd=here, **lazily("/proc/nowhere"))
    told = unhurried(done.told(0, "warning: the cache of compiled kernels cannot be used: ", "XDG_CACHE_HOME"))
    assert told.startswith(COMPILING)
    assert told.count("\n") == 2
    assert done.json["steps"] == 2000


@campaign
def test_a_command_says_that_it_compiles_when_it_does_and_only_then(good: Path, here: Path) -> None:
    def told(*arguments: str | Path) -> str:
        return unhurried(brakecli(*arguments, cwd=here, **lazily(here / "cache")).told(0))

    assert told("info", good / "tiny.h5") == ""
    assert told("classify", good / "tiny.h5") == ""
    assert not (here / "cache").exists()  # nothing has been compiled
    assert told("check", "tiny.toml") == ""
    assert not (here / "cache").exists()
    assert told("run", "tiny.toml", "-o", "c.h5") == COMPILING
    assert any((here / "cache").rglob("*.nbc"))
    assert told("run", "tiny.toml", "-o", "d.h5") == ""


def unhurried(told: str) -> str:
    """What was told, without how far a run had come on a busy machine."""
    return "".join(line for line in told.splitlines(keepends=True) if not line.startswith("brakecli: steps "))


def test_paths_may_hold_spaces_and_letters_of_any_script_or_none(good: Path, tmp_path: Path) -> None:
    folder = tmp_path / "Größe 轮 [x]"
    folder.mkdir()
    names = ["mit Leerzeichen.toml", "колесо.toml", os.fsdecode(b"\xff.toml"), "--help.toml"]
    for name in names:
        (folder / name).write_text(TINY)
    for name, done in zip(names, each(folder, [["run", "--json", "--", name] for name in names]), strict=True):
        assert done.told(0) == ""
        result = name.removesuffix(".toml") + ".h5"
        assert done.json["output"] == result
        assert (folder / result).read_bytes() == (good / "tiny.h5").read_bytes()


ODD = "a\x1b[2J\x07\x9b\u202eb\u2066c\r\x7f"
SHOWN = r"a\u001b[2J\u0007\u009b\u202eb\u2066c\r\u007f"


def odd_in(text: str) -> set[str]:
    return {char for char in text if char != "\n" and unicodedata.category(char) in ("Cc", "Cf")}


@campaign
def test_no_control_character_of_a_file_a_name_or_a_title_reaches_the_terminal(good: Path, tmp_path: Path) -> None:
    (tmp_path / f"{ODD}.toml").write_text(TINY)
    (tmp_path / f"{ODD}.csv").write_text(f"{ODD},y\n0,1\n1,2\n")
    (tmp_path / f"{ODD}.h5").write_bytes((good / "tiny.h5").read_bytes())
    with edited(tmp_path / f"{ODD}.h5") as file:
        text = file.attrs["resolved_toml"].replace('title = "Tiny"', r'title = "\u202Ex"')
        file.attrs["resolved_toml"] = text
        file.attrs["failure"] = ODD
        file.attrs["kind"] = "run"
    signal = ["classify", f"{ODD}.csv", "--quantity", "force", "--sample-rate", "1"]
    lines = [
        *(["check", f"{ODD}.toml"], ["run", f"{ODD}.toml", "--set", 'title="\\u202Ex"'], ["run", f"{ODD}.toml"]),
        *(
            ["classify", f"{ODD}.h5"],
            ["plot", f"{ODD}.h5"],
            ["plot", f"{ODD}.h5"],
            ["new", ODD],
            [ODD],
            ["--" + ODD],
        ),
        *(["check", f"{ODD}.toml", "--set", f"{ODD}=1"], ["check", f"{ODD}.toml", ODD, ODD], ["check", ODD]),
        *([*signal], [*signal, "--column", ODD], ["stability", f"{ODD}.toml", "--vary", ODD]),
        *(["run", f"{ODD}.toml", "-o", f"{ODD}/x.h5"], ["compare-schemes", f"{ODD}.toml", "--schemes", ODD]),
    ]
    for line, done in zip(lines, each(tmp_path, lines), strict=True):
        assert odd_in(done.out + done.err) == set(), line
        assert "Traceback" not in done.err
    done = brakecli("classify", f"{ODD}.h5", "--json", cwd=tmp_path)
    assert SHOWN in done.out
    assert r"\u202ex" in brakecli("check", f"{ODD}.toml", "--set", r'title="\u202Ex"', cwd=tmp_path).out
    assert done.json["source"] == f"{ODD}.h5"


@pytest.mark.parametrize("kilobytes", [100_000, 400_000, 900_000])
def test_an_address_space_too_small_for_the_libraries_is_told_before_they_are_loaded(
    here: Path, kilobytes: int
) -> None:
    done = shell(f"ulimit -v {kilobytes}; $B run tiny.toml", here)
    assert done.told(3, "the address space is limited to", "raise the limit with: ulimit -v").count("\n") == 1
    assert "Usage" in shell(f"ulimit -v {kilobytes}; $B --help", here).out


def test_an_address_space_too_small_to_compile_is_told_and_compiled_kernels_work_in_it(here: Path) -> None:
    small = "ulimit -v 1055000; $B run tiny.toml -q --force"
    shell(small, here).told(0)
    shell(small, here, **lazily(here / "empty")).told(3, "compiling kernels needs 1430 MB", "ulimit -v unlimited")
