"""Damaged and foreign files are refused with the reason, or read exactly."""

import os
import random
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

from brakecli.errors import UnreadableResultError
from brakecli.results.read import open_result
from tests.campaign import campaign
from tests.results.results import ROWS, edited, in_a_process, read_all, write


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
    """A result with a change, and a digest that fits, as one of another version would be."""

    def on_file(path: Path) -> None:
        write(path, 100)
        with edited(path) as file:
            change(file)

    return on_file


def changed_elsewhere(path: Path) -> None:
    write(path, 100)
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "added by hand"


def with_a_user_block(path: Path) -> None:
    write(path.with_suffix(".old"), 10)
    with h5py.File(path.with_suffix(".old")) as old, h5py.File(path, "w", userblock_size=512) as new:
        new.attrs.update(old.attrs)
        for name in old:
            old.copy(name, new)


def damaged_at_the_end(path: Path) -> None:
    write(path, 10)
    path.write_bytes(path.read_bytes()[:-1] + b"x")


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
        (foreign, "has no digest, as another program has saved it; keep a Dataset by result.brakecli.save"),
        (foreign_of_our_kind, "has no digest"),
        (changed_elsewhere, "has no digest"),
        (with_a_user_block, "has no digest"),
        (damaged_at_the_end, "its digest does not fit, so that it is damaged or was altered; name an intact"),
        (edit(lambda file: file.attrs.modify("format", "other")), "not written by this program"),
        (edit(lambda file: file.attrs.modify("format_version", 2)), "format version is 2, and only version 1"),
        (edit(lambda file: file.attrs.modify("complete", 0)), "incomplete"),
        (edit(lambda file: file.attrs.pop("complete")), "incomplete"),
        (edit(lambda file: file.attrs.modify("kind", "sweep")), "kind 'sweep', and 'run' is needed"),
        (edit(lambda file: file["history"].__delitem__("time")), "no variable time"),
        (edit(lambda file: file.__delitem__("history")), "no variable time in group history"),
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
