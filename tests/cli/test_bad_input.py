"""Bad cases, results and command lines: a sentence with the place and a remedy, and an exit code."""

import random
from pathlib import Path

import pytest

from tests.campaign import campaign
from tests.commands import SOON, TINY, brakecli, each, left_in, shell, variants

pytestmark = pytest.mark.usefixtures("compiled")


def test_wrong_values_are_told_all_at_once_with_their_lines(tmp_path: Path) -> None:
    bad = TINY.replace("mass = 10.0", "mass = nan").replace("radius = 0.5", 'radius = "0.5"')
    bad = bad.replace("load.force = 5000.0", "load.force = true\nload.forse = 1").replace("1e-5,", "1e-320,")
    (tmp_path / "bad.toml").write_text(bad)
    for command in ("run", "check"):
        told = brakecli(command, "bad.toml", "--set", "contact.stiffness=0", cwd=tmp_path).told(2)
        starts = ["bad.toml:2: shoe.mass: ", "bad.toml:3: wheel.radius: ", "bad.toml:6: load.force: "]
        starts += ["bad.toml:7: load.forse: ", "bad.toml:10: solver.step: "]
        starts += ["--set contact.stiffness=0: contact.stiffness: "]
        lines = told.splitlines()
        assert [
            line.removeprefix("brakecli: ").startswith(start) for line, start in zip(lines, starts, strict=True)
        ]
        assert all("(found " in line and "; " in line for line in lines)
        assert "force" in lines[3].split(";")[1]  # the nearest valid key
    assert left_in(tmp_path) == {"bad.toml"}


@pytest.mark.parametrize(
    "text",
    [
        "[a" * 5000,
        f"{'a.' * 20000}b = 1",
        TINY + "\0",
        "\ufeff" * 3 + TINY,
        TINY.encode("utf-16"),
        b"title = '\xe9'",
    ],
    ids=["nested", "deep", "nul", "marks", "utf-16", "latin-1"],
)
def test_hostile_texts_are_refused_soon(tmp_path: Path, text: str | bytes) -> None:
    (tmp_path / "bad.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
    done = brakecli("check", "bad.toml", cwd=tmp_path)
    done.told(2, "bad.toml")
    assert done.seconds < SOON


def test_a_run_that_is_too_large_is_refused_with_its_size(here: Path) -> None:
    steps = [["solver.duration=1e7"], ["solver.step=1e-100", "solver.duration=1e100"]]
    for done in variants(here, *steps):
        told = done.told(
            3, "the run is too long: about 1e+", "steps, ", "MB of memory, a file of ", "reduce solver"
        )
        assert done.out == ""
        assert told.count("\n") == 1
    check = brakecli("check", "tiny.toml", "--set", "solver.duration=1e100", cwd=here)
    check.told(3, "the run is too long")
    assert "e+105 steps" in check.out  # no number of a hundred digits
    check = brakecli("check", "tiny.toml", "--set", "solver.duration=1e7", cwd=here)
    check.told(3, "about 1e+12 steps", "1e+11 are the most", "6.5e+06 MB")
    nodes = ["--set", "contact.nodes=10000000", "--set", "contact.evaluator='midpoint'"]
    several = f"roughness.wheel={{amplitudes={[1e-6] * 60}, wavelengths={[0.01] * 60}}}"
    brakecli("run", "tiny.toml", *nodes, "--set", several, cwd=here).told(3, "contact.nodes")
    assert left_in(here) == {"tiny.toml"}


def test_no_command_line_ends_in_a_traceback(good: Path, here: Path) -> None:
    result = (good / "tiny.h5").read_bytes()
    (here / "r.h5").write_bytes(result)
    generator = random.Random(11)
    words = [
        *(
            "run",
            "check",
            "new",
            "schema",
            "plot",
            "tiny.toml",
            "r.h5",
            "-",
            "--",
            "--json",
            "--quiet",
            "-q",
            "-h",
        ),
        *(
            "--force",
            "-o",
            "--output",
            "--set",
            "--version",
            "--help",
            "--no-such",
            "",
            " ",
            ".",
            "..",
            "/",
            "=",
            "é",
        ),
        *(
            "solver.duration=0.01",
            "solver.duration=",
            "a.b.c=1",
            "shoe=1",
            "shoe.mass=-1",
            "\udcff",
            "\x1b[31m",
            "%s",
        ),
        *(
            "title='x'",
            "out.h5",
            "missing.toml",
            "x" * 300,
            "-5",
            "~",
            "*",
            "${HOME}",
            "--set=",
            "-o=",
            "-oq",
            "\n",
        ),
    ]
    lines = [
        [generator.choice(words[:5]), *generator.choices(words, k=generator.randrange(5))] for _ in range(24)
    ] + [generator.choices(words, k=generator.randrange(4)) for _ in range(8)]
    codes = []
    for line, done in zip(lines, each(here, lines), strict=True):
        assert "Traceback" not in done.err, line
        assert done.code in (0, 1, 2, 3, 4, 74), line
        assert done.code == 0 or done.err, line
        codes.append(done.code)
    assert 0 in codes
    assert 2 in codes
    assert (here / "tiny.toml").read_text() == TINY
    assert not any(name.endswith((".part", ".lock")) for name in left_in(here))


def test_a_name_that_is_too_long_to_be_drawn_from_is_told(tmp_path: Path) -> None:
    brakecli("plot", "x" * 300, cwd=tmp_path).told(4, "cannot be read as a result: File name too long; ")


@campaign
def test_a_pipe_is_read_once(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    sweep = 'case = "tiny.toml"\n[[axis]]\nparameter = "shoe.mass"\nvalues = [1.0]\n'
    (tmp_path / "bad.toml").write_text(sweep.replace("shoe.mass", "shoe.mas"))
    assert shell("$B check <(cat tiny.toml) --json", tmp_path).json["valid"]
    told = shell("$B check <(cat bad.toml)", tmp_path).told(2, "/dev/fd/63:3: shoe.mas: is unknown")
    assert told.count("\n") == 1
    shell("$B check <(printf '\\xff')", tmp_path).told(2, "is not UTF-8")
    shell("$B run <(cat bad.toml)", tmp_path).told(2, "this is a sweep")
    shell("$B sweep <(cat tiny.toml)", tmp_path).told(2, "this is a case")
    for text, words in ((TINY, "steps"), (sweep, "points")):
        assert words in brakecli("check", "-", cwd=tmp_path, stdin=text).out


def test_a_case_whose_name_begins_with_a_dash_is_suggested_as_a_path(here: Path) -> None:
    (here / "-dash.toml").write_text(TINY)
    lines = [
        ["check", "-dash.toml"],
        ["check", "-absent.toml"],
        ["sweep", "--", "-dash.toml"],
        ["new", "--", "-new case"],
        ["new", "map", "-o", "."],
    ]
    check, absent, sweep, new, folder = each(here, lines)
    folder.told(74, ".: cannot write: this is a directory")
    check.told(2, "No such option", "brakecli: -dash.toml: was read as options; name the file ./-dash.toml")
    assert "./" not in absent.told(2, "No such option")
    sweep.told(2, "-dash.toml: this is a case; simulate it with: brakecli run ./-dash.toml")
    assert new.out == "-new case.toml: written; run it with: brakecli run './-new case.toml'\n"
    brakecli("check", "./-dash.toml", cwd=here).told(0)


@pytest.mark.parametrize(
    "vary",
    [
        "friction.coefficiant=0.1:0.2:2",
        "shoe.mass=-1:1:2",
        "shoe=1:2:2",
        "shoe.mass.x=1:2:2",
        "a b=1:2:2",
        "x..y=1:2:2",
        "link2.angle_deg=1e308:-1e308:3",
    ],
)
def test_a_key_that_cannot_be_varied_is_told_of_the_option_that_named_it(here: Path, vary: str) -> None:
    told = brakecli("stability", "tiny.toml", "--vary", vary, cwd=here).told(2, f"--vary {vary[:4]}")
    assert "--set" not in told


def test_what_another_command_computes_is_told_with_that_command(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(
        'case = "c.toml"\nsamples = 64\n[[parameter]]\nkey = "shoe.mass"\nmean = 1.0\ndeviation = 0.1\n'
    )
    (tmp_path / "sweep.toml").write_text('case = "c.toml"\n[[axis]]\nparameter = "shoe.mass"\nvalues = [1.0]\n')
    for words, told in (
        (("sweep", "study.toml"), "this is a study; compute it with: brakecli scatter study.toml"),
        (("scatter", "sweep.toml"), "this is a sweep; compute it with: brakecli sweep sweep.toml"),
    ):
        done = brakecli(*words, cwd=tmp_path)
        assert (done.code, done.err) == (2, f"brakecli: {words[1]}: {told}\n")


def test_a_number_with_a_unit_is_told_of_its_option(tmp_path: Path) -> None:
    done = brakecli("new", "b", "--frequency", "2.6kHz", cwd=tmp_path)
    assert done.code == 2
    assert "--frequency" in done.err
    assert "2.6kHz is no number in Hz" in " ".join(done.err.split())
    assert not [*tmp_path.iterdir()]


def test_a_text_file_without_its_quantity_is_told_of_that_first(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("t,a\n0,1\n")
    remedy = "state with --quantity what was measured; or name an intact result file, or compute it again"
    for command in ("classify", "plot"):
        brakecli(command, "x.csv", cwd=tmp_path).told(
            4, f"this is not an HDF5 file; for a measured signal, {remedy}"
        )
