"""Whatever a command is given as a file: what is wrong with it is said at once."""

import bz2
import gzip
import lzma
import os
import socket
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import brakecli as brakecli_in_python
from brakecli.errors import UsageError
from brakecli.studies.sweeps import driver
from tests.campaign import campaign
from tests.commands import TINY, brakecli, each, forked, run
from tests.results.results import edited

pytestmark = pytest.mark.usefixtures("compiled")

SWEEP = 'case = "{}"\n[[axis]]\nparameter = "load.force"\nvalues = [1000.0, 2000.0]\n'
NO_FILE = "this is not a regular file"


@pytest.mark.parametrize("kind", ["pipe", "folder", "device", "socket"])
def test_no_command_waits_for_what_is_no_file(here: Path, kind: str) -> None:
    path = here / "x"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        server = socket.socket(socket.AF_UNIX)
        here_before = Path.cwd()
        os.chdir(here)  # the path of a socket must be short
        server.bind("x")
        os.chdir(here_before)
        server.close()
    (here / "of.toml").write_text(SWEEP.format("x"))
    (here / "sweep.toml").write_text(SWEEP.format("tiny.toml"))
    wanted = (
        (2, ["check", "x"]),
        (2, ["run", "tiny.toml", "--set", 'roughness.wheel.profile="x"']),
        (2, ["sweep", "of.toml"]),
        (2, ["sweep", "sweep.toml", "--scheduler-file", "x"]),
        (4, ["classify", "x", "--quantity", "velocity", "--sample-rate", "1000"]),
        (4, ["classify", "x:/v", "--quantity", "velocity", "--sample-rate", "1000"]),
        (4, ["info", "x"]),
        (4, ["report", "x"]),
    )
    for (code, _), done in zip(wanted, each(here, [words for _, words in wanted]), strict=True):
        assert done.code == code, done
        assert done.err.count("\n") == 1, done
        assert NO_FILE in done.err or (kind in ("folder", "socket") and "x" in done.err), done


@campaign
def test_no_command_reads_a_result_without_a_digest_that_fits(good: Path, here: Path) -> None:
    whole = (good / "tiny.h5").read_bytes()
    (here / "bad.h5").write_bytes(whole[:-1] + b"\0")
    (here / "other.h5").write_bytes(whole[:-32])
    remedies = {
        "bad.h5": "its digest does not fit, so that it is damaged or was altered; name an intact result file",
        "other.h5": "has no digest, as another program has saved it; keep a Dataset by result.brakecli.save(path)",
    }
    commands = ["info"], ["check"], ["plot"], ["report"], ["export"], ["classify"], ["diff", str(good / "tiny.h5")]
    for name, remedy in remedies.items():
        for command, *more in (*commands, ["run", "-o", "again.h5"], ["stability"], ["advise"]):
            told = brakecli(command, name, *more, cwd=here).told(4, name, f"{remedy}, or compute it again")
            assert told.count("\n") == 1
    assert {path.name for path in here.iterdir()} == {"tiny.toml", "bad.h5", "other.h5"}
    brakecli("info", "bad.h5", "--force-read", cwd=here).told(2, "--force-read")


@campaign
def test_no_variable_of_a_library_changes_a_picture_or_ends_it(good: Path, here: Path) -> None:
    (here / "matplotlibrc").write_text("lines.linewidth: 20\nbackend: none\n")
    brakecli("plot", good / "tiny.h5", "-o", "usual.png", cwd=here).told(0)
    given = {
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        "MATPLOTLIBRC": str(here / "matplotlibrc"),
        "HDF5_DRIVER": "core",
        "HDF5_PLUGIN_PATH": str(here),
        "NPY_DISABLE_CPU_FEATURES": "AVX2",
        "NUMBA_DISABLE_JIT": "1",
    }
    brakecli("plot", good / "tiny.h5", "-o", "told.png", cwd=here, **given).told(0)
    assert (here / "told.png").read_bytes() == (here / "usual.png").read_bytes()


def test_no_cell_of_a_table_is_a_formula_and_none_holds_control_characters(good: Path, here: Path) -> None:
    path = here / "r.h5"
    path.write_bytes((good / "tiny.h5").read_bytes())
    texts = ["=1+1", "+1", "-x", "@x", "\x1b[31m", " =2", "plain", "-1.5"]
    with edited(path) as file:
        file.create_dataset("history/=note", data=np.resize(np.array(texts, dtype="S8"), file["history/x"].shape))
        file["history/=note"].dims[0].attach_scale(file["history/time"])
    done = brakecli("export", path.name, "--variable", "=note", "-o", "t.csv", cwd=here)
    done.told(0)
    header, *rows = (here / "t.csv").read_text().splitlines()
    assert header == "time (s),'=note"
    cells = [row.split(",", 1)[1] for row in rows[: len(texts)]]
    assert cells == ["'=1+1", "'+1", "'-x", "'@x", "\\u001b[31m", "' =2", "plain", "'-1.5"]


@campaign
def test_limits_hold_where_the_work_is_done(here: Path) -> None:
    brakecli("advise", "tiny.toml", "--set", "output.sample_interval=1e20", cwd=here).told(
        3, "the run is too long"
    )


@campaign
def test_many_waves_are_drawn_without_a_minute_of_silence(here: Path) -> None:
    waves = ", ".join(f"{0.001 + 1e-6 * n:.6f}" for n in range(9000))
    sizes = ", ".join(["1e-9"] * 9000)
    rough = f"roughness.wheel = {{ amplitudes = [{sizes}], wavelengths = [{waves}] }}\n"
    text = TINY.replace("duration = 0.02", "duration = 0.001").replace("step = 1e-5", "step = 1e-4")
    (here / "many.toml").write_text(text + rough)
    brakecli("run", "many.toml", "-q", cwd=here).told(0)
    forked("plot", "many.h5", cwd=here, memory=2_715_000_000).told(0)  # sums of two would take 16 GB


def test_a_small_file_that_unpacks_to_very_much_is_refused(good: Path, here: Path) -> None:
    with h5py.File(here / "s.h5", "w") as file:
        file.create_dataset(
            "v", shape=(2**30,), dtype="f8", chunks=(2**20,), compression="gzip", compression_opts=9
        )
        file["v"][: 2**21] = 0.0
        group = file
        for _ in range(1000):
            group = group.create_group("g")
    reading = ["--quantity", "velocity", "--sample-rate", "1000"]
    told = forked("classify", "s.h5:/v", *reading, cwd=here, memory=1_715_000_000)
    assert "claims 1073741824 values" in told.told(4)
    inside = "/".join("g" * 1000)
    brakecli("classify", f"s.h5:/{inside}", *reading, cwd=here).told(4, "more than 8 levels")
    brakecli("classify", "s.h5:/g", *reading, cwd=here).told(4, "groups of more than 8 levels")


def test_a_table_is_not_unpacked_because_of_its_name(here: Path) -> None:
    data = b"time (s),v (m/s)\n" + b"0.001,0.002\n" * 100
    for name, pack in (("gz", gzip.compress), ("bz2", bz2.compress), ("xz", lzma.compress)):
        (here / f"v.csv.{name}").write_bytes(pack(data))
        words = ["classify", f"v.csv.{name}", "--quantity", "velocity", "--sample-rate", "1000"]
        brakecli(*words, cwd=here).told(4, "this is not text; name a CSV file")


def test_small_helps(here: Path) -> None:
    (here / "sweep.toml").write_text(SWEEP.format("tiny.toml"))
    for code, word, words in (
        (2, "run it first", ["plot", "tiny.toml"]),
        (2, "name a file that ends in .h5", ["run", "tiny.toml", "-o", "out.txt"]),
        (2, "the same in stick and in slip", ["check", "tiny.toml", "--set", "friction.static=0.3"]),
    ):
        brakecli(*words, cwd=here).told(code, word)
    still = brakecli("advise", "tiny.toml", "--set", "wheel.angular_speed=0", "--json", cwd=here)
    assert still.json["stable"] is None
    assert "nothing slides" in still.json["conclusion"]


def test_windows_gets_a_sentence_from_the_first_command(here: Path) -> None:
    program = "import os, runpy; os.name = 'nt'; runpy.run_module('brakecli', run_name='__main__')"
    done = run("-c", program, "check", "tiny.toml", cwd=here, command=[sys.executable])
    done.told(2, "does not run on Windows")
    assert done.err.count("\n") == 1


@campaign
def test_a_script_without_a_guard_computes_with_one_job_and_is_told_with_more(here: Path) -> None:
    (here / "sweep.toml").write_text(SWEEP.format("tiny.toml"))
    script = "import brakecli\nfound = brakecli.sweep('sweep.toml', jobs={})\nprint(found.status.values)\n"
    (here / "one.py").write_text(script.format(1))
    (here / "two.py").write_text(script.format(2))
    one = run("one.py", cwd=here, command=[sys.executable])
    assert (one.code, one.out) == (0, "['done' 'done']\n"), one
    two = run("two.py", cwd=here, command=[sys.executable])
    assert two.code == 1
    assert two.err.count("Traceback") == 1  # the caller's
    assert 'call it below  if __name__ == "__main__":  , or with jobs=1' in two.err
    assert two.out == ""


def test_python_looks_for_the_cluster_that_the_environment_names(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def chosen(plan: object, jobs: object, scheduler: object, *rest: object, **more: object) -> None:
        raise UsageError(f"of {scheduler}")

    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", "nowhere:1")
    monkeypatch.setattr(driver, "choose_engine", chosen)
    (here / "sweep.toml").write_text(SWEEP.format("tiny.toml"))
    with pytest.raises(UsageError, match="of nowhere:1"):
        brakecli_in_python.sweep(here / "sweep.toml")
