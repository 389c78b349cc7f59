"""Damaged and foreign files are refused with the reason, or read exactly."""

import os
import random
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from brakecli.errors import UnreadableResultError
from brakecli.files import read
from brakecli.files.read import open_result
from tests.campaign import campaign
from tests.files.results import ROWS, in_a_process, read_all, write


def mutate(data: bytes, chance: random.Random) -> bytes:
    """One flipped bit, or up to 4 KiB of noise, zeros or nothing at all in the place of what was there."""
    start = chance.randrange(len(data))
    length = min(chance.choice([1, 4, 64, 512, 4096]), len(data) - start)
    middle = chance.choice(
        [
            bytes([data[start] ^ 1 << chance.randrange(8)]) + data[start + 1 : start + length],
            chance.randbytes(length),
            bytes(length),
            b"",
        ]
    )
    return data[:start] + middle + data[start + length :]


def damaged(path: Path) -> None:
    refused = 0  # the rest were read, and exactly: zeros written over zeros do no damage
    for rows in (100, ROWS):
        write(path, rows)
        good = path.read_bytes()
        expected = read_all(path)
        chance = random.Random(rows)
        variants = [mutate(good, chance) for _ in range(600)]
        variants += [good[: len(good) * part // 50] for part in range(50)]
        variants += [good[:-length] for length in range(1, 32)]
        variants += [good + b"\0", good + good]
        for variant in variants:
            path.write_bytes(variant)
            try:
                assert read_all(path) == expected
            except UnreadableResultError:
                refused += 1
    assert refused > 1000


@campaign
def test_a_damaged_file_is_refused_or_read_exactly(tmp_path: Path) -> None:
    in_a_process(damaged, tmp_path / "r.h5")


def edit(change: Callable[[h5py.File], object]) -> Callable[[Path], object]:
    def on_file(path: Path) -> None:
        write(path, 100)
        with h5py.File(path, "r+") as file:
            change(file)

    return on_file


def foreign(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["x"] = [1.0, 2.0]


def foreign_of_our_kind(path: Path) -> None:
    with h5py.File(path, "w", libver=("v108", "v108")) as file:
        file["x"] = [1.0, 2.0]


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "not a regular file"),
        (os.mkfifo, "not a regular file"),
        (lambda path: path.touch(), "the file is empty"),
        (lambda path: path.write_text("time,vx\n0,1\n"), "not an HDF5 file"),
        (foreign, "not written by this program"),
        (foreign_of_our_kind, "not written by this program"),
        (edit(lambda file: file.attrs.modify("format", "other")), "not written by this program"),
        (edit(lambda file: file.attrs.modify("format_version", 2)), "format version is 2, and only version 1"),
        (edit(lambda file: file.attrs.modify("complete", 0)), "incomplete"),
        (edit(lambda file: file.attrs.pop("complete")), "incomplete"),
        (edit(lambda file: file.attrs.modify("kind", "sweep")), "kind 'sweep', and 'run' is needed"),
        (edit(lambda file: file["history/time"].write_direct(np.full(100, np.nan))), "not finite"),
        (edit(lambda file: file["history"].__delitem__("time")), "no variable time"),
        (edit(lambda file: file.__delitem__("history")), "no group history"),
    ],
)
def test_a_file_that_is_no_result_is_refused_with_the_reason(
    tmp_path: Path, make: Callable[[Path], object], reason: str
) -> None:
    path = tmp_path / "r.h5"
    make(path)
    with pytest.raises(UnreadableResultError, match=f"(?i){reason}") as caught, open_result(path, "run") as result:
        result.read("history", "time")
    assert str(caught.value).startswith(f"{path}: ")


@campaign
def test_a_file_on_which_hdf5_never_ends_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a heap of texts, free space that claims no length makes HDF5 read the same place again and again."""
    path = tmp_path / "r.h5"
    write(path, 10)
    data = bytearray(path.read_bytes()[:-32])
    place = data.index(b"GCOL") + 16
    while number := int.from_bytes(data[place : place + 2], "little"):
        assert 0 < number < 1000
        place += 16 + (int.from_bytes(data[place + 8 : place + 16], "little") + 7) // 8 * 8
    data[place + 8 : place + 16] = bytes(8)
    path.write_bytes(data)
    monkeypatch.setattr(read, "SHORTEST_TRIAL", 1.0)
    with pytest.raises(UnreadableResultError, match="HDF5 cannot read it"), open_result(path):
        raise AssertionError


@pytest.mark.parametrize("name", ["nul\0", "x" * 300])
def test_a_name_that_cannot_exist_is_an_unreadable_result(tmp_path: Path, name: str) -> None:
    with pytest.raises(UnreadableResultError), open_result(tmp_path / name):
        raise AssertionError


def test_an_exception_while_reading_is_the_callers_own(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", 10)
    with pytest.raises(ZeroDivisionError), open_result(tmp_path / "r.h5"):
        raise ZeroDivisionError


if __name__ == "__main__":
    globals()[sys.argv[1]](Path(sys.argv[2]))
