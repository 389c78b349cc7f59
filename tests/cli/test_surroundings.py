"""Locale, home, terminal, cache and names of files change no bit of a result."""

import os
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.commands import TINY, Done, brakecli, each

pytestmark = pytest.mark.usefixtures("compiled")

COMPILING = "brakecli: compiling kernels, once for this version …\n"


def test_the_surroundings_change_no_bit(good: Path, here: Path) -> None:
    surroundings: list[dict[str, str | None]] = [
        {"LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "COLUMNS": "1"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii", "HOME": None},
        {"TERM": "dumb", "NO_COLOR": "1", "COLUMNS": "no", "HDF5_USE_FILE_LOCKING": "FALSE", "TZ": "Asia/Tokyo"},
    ]

    def run(n: int) -> Done:
        return brakecli("run", "tiny.toml", "-o", f"{n}.h5", cwd=here, stdin="", **surroundings[n])

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(run, range(len(surroundings))))
    for n, done in enumerate(outcomes):
        assert done.told(0).replace(COMPILING, "") == ""  # there may be another home, without compiled code
        assert "e-05" in done.out
        assert not re.search(r"\d,\d", done.out)
        assert all(len(line) <= 100 for line in done.out.splitlines())
        assert len(done.out.splitlines()) < 60
        assert (here / f"{n}.h5").read_bytes() == (good / "tiny.h5").read_bytes()


def test_without_a_place_for_compiled_code_everything_works_but_slower(here: Path) -> None:
    done = brakecli("check", "tiny.toml", "--json", cwd=here, XDG_CACHE_HOME="/proc/nowhere")
    assert done.told(0) == COMPILING
    assert done.json["steps"] == 2000


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
