"""Attacks by random inputs: whatever a command is given, it ends with an exit code of its own and a sentence."""

import os
import random
import socket
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from brakecli.case.read import starters
from brakecli.cli.app import main
from brakecli.results.os_signals import guard_streams
from tests.campaign import campaign, counts
from tests.cli.mutator import mutated, with_another_header
from tests.cli.test_surroundings import ODD, odd_in
from tests.commands import TINY, brakecli, forked, left_in, shell

pytestmark = pytest.mark.usefixtures("compiled")

SWEEP = """\
case = "tiny.toml"
title = "two axes"
[[axis]]
parameter = "link2.angle_deg"
start = 1.0
stop = 10.0
num = 2
[[axis]]
parameter = ["shoe.mass", "contact.nodes"]
values = [8, 10]
spacing = "linear"
[critical]
parameter = "friction.coefficient"
lower = 0.0
upper = 2.0
method = "eigenvalue"
"""
ROUGH = """
[roughness.shoe]
amplitudes = [1e-6, 7e-7]
wavelengths = [0.020, 0.011]
[roughness.wheel]
amplitudes = [1e-6, 8e-7]
wavenumbers = [250.0, 480.0]
phases_deg = [0.0, 90.0]
[initial]
at = "equilibrium"
vx = -0.5
"""


@pytest.mark.parametrize("number", counts(20, 300, 5000))
def test_a_file_with_mistakes_is_refused_with_a_sentence_for_each_or_valid(
    number: int, here: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """In this process, as 5,000 others would take too long."""
    monkeypatch.chdir(here)
    for name in ("stdout", "stderr", "argv"):  # are restored at the end
        monkeypatch.setattr(sys, name, getattr(sys, name))
    guard_streams()
    chance = random.Random(number)
    codes = list[object]()
    texts = (TINY, starters()["case"], starters()["case"] + ROUGH, SWEEP)
    for n in range(number):
        name = f"{n}.toml"  # pipes are read once, and so is each name
        data = mutated(chance.choice(texts), chance)
        Path(name).write_bytes(data)
        sys.argv = ["brakecli", "check", name, *chance.choice(([], ["--json"], ["--set", "shoe.mass=9.0"]))]
        try:
            main()
            codes.append(0)
        except SystemExit as end:
            codes.append(end.code)
        Path(name).unlink()
        out, err = capfd.readouterr()
        assert codes[-1] in (0, 2, 3), (data, err)
        assert not odd_in(out + err), (data, err)
        for line in err.splitlines() if codes[-1] else ():
            assert line.startswith("brakecli: "), (data, err)
            assert "; " in line, (data, err)
            assert "(found )" not in line, (data, err)
    assert left_in(here) == {"tiny.toml"}
    assert number / 20 < codes.count(0) < number / 2


@pytest.mark.parametrize("number", counts(3, 30))
def test_a_measured_file_with_another_header_is_refused_with_a_sentence_or_used(
    number: int, tmp_path: Path
) -> None:
    with h5py.File(tmp_path / "f.h5", "w", libver=("v108", "v108")) as file:
        file.create_dataset(
            "v", data=np.sin(np.arange(2000.0)), chunks=(500,), compression="gzip", fletcher32=True
        )
        file["v"].attrs["units"] = np.array("m/s", h5py.string_dtype())
    whole = (tmp_path / "f.h5").read_bytes()
    chance = random.Random(number)
    refused = 0
    signal = ["f.h5:/v", "--quantity", "velocity", "--sample-rate", "1e4"]
    for _ in range(number):
        (tmp_path / "f.h5").write_bytes(with_another_header(whole, chance))
        done = forked("classify", *signal, cwd=tmp_path, memory=515_000_000)
        assert done.code in (0, 4), done
        assert done.code == 0 or done.err.count("\n") == 1, done
        assert not odd_in(done.err), done
        refused += done.code == 4
    assert refused > number / 5


@campaign
def test_odd_names_and_titles_reach_no_terminal(tmp_path: Path) -> None:
    chance = random.Random(16)
    for _ in range(10):
        odd = "a" + "".join(chance.choices(ODD + "\u2028\u200f\u0085\u061c\u2069", k=6))
        (tmp_path / f"{odd}.toml").write_text(TINY.replace("Tiny", odd.replace("\r", "").replace("\x1b", "")))
        for words in (
            ["check", f"{odd}.toml"],
            ["check", odd],
            ["new", odd],
            ["check", f"{odd}.toml", "--set", f"{odd}=1"],
        ):
            done = brakecli(*words, cwd=tmp_path)
            assert not odd_in(done.out + done.err), done
            assert "Traceback" not in done.err


@campaign
@pytest.mark.parametrize(
    ("ending", "kind"),
    [(".lock", "pipe"), (".lock", "second name"), (".part", "link"), (".part", "link to nothing")],
)
def test_what_stands_in_the_way_of_an_output_is_named_and_left_alone(
    kind: str, ending: str, tmp_path: Path
) -> None:
    place = tmp_path / f".case.toml{ending}"
    other = tmp_path / "other"
    other.write_text("mine")
    match kind:
        case "pipe":
            os.mkfifo(place)
        case "folder":
            place.mkdir()
        case "link":
            place.symlink_to(other)
        case "link to nothing":
            place.symlink_to(tmp_path / "nothing")
        case "second name":
            place.hardlink_to(other)
        case "socket":
            with socket.socket(socket.AF_UNIX) as opened:
                opened.bind(str(place))
        case _:
            place.write_text("mine")

    def look() -> list[float]:
        found = place.lstat()  # whoever reads a file changes its time of access
        return [
            getattr(found, f"st_{name}") for name in ("mode", "ino", "nlink", "uid", "gid", "size", "mtime_ns")
        ]

    before = look()
    brakecli("new", cwd=tmp_path).told(74, place.name, "is in the way")
    assert look() == before
    assert left_in(tmp_path) == {place.name, "other"}
    assert other.read_text() == "mine"


@campaign
def test_every_limit_of_the_address_space_that_is_too_small_is_told(here: Path) -> None:
    chance = random.Random(18)
    for _ in range(10):
        done = shell(f"ulimit -v {chance.randrange(100_000, 580_000)}; $B check tiny.toml", here)
        assert done.told(3, "the address space is limited to").count("\n") == 1
