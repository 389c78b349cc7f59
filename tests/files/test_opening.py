"""What is opened: regular files alone, at once, and no more of them than a bound."""

import io
import os
import resource
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from brakecli.analysis.signals.look import Measurand
from brakecli.analysis.signals.read import read_signal
from brakecli.errors import UnreadableResultError
from brakecli.files import read
from brakecli.files.as_xarray import opened as as_xarray
from brakecli.files.opening import contents, opened
from brakecli.files.read import digest, open_result
from brakecli.files.table import TextTable
from brakecli.files.trust import readings
from tests.campaign import campaign
from tests.files.results import write


def seal(path: Path) -> None:
    """Give a file a digest that fits."""
    data = path.read_bytes()
    path.write_bytes(data + digest(io.BytesIO(data), len(data)))  # type: ignore[arg-type]


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, make: object) -> None:
    make(tmp_path / "x")  # type: ignore[operator]
    with pytest.raises(OSError, match="not a regular file"):
        opened(tmp_path / "x")


def test_more_bytes_than_the_bound_are_refused(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"12345")
    assert contents(tmp_path / "x", 5) == b"12345"
    with pytest.raises(OSError, match="larger than 4 bytes"):
        contents(tmp_path / "x", 4)


def test_a_table_is_read_as_it_is_whatever_its_name(tmp_path: Path) -> None:
    (tmp_path / "x.gz").write_text("1,2\n3,4\n")
    assert [column.tolist() for column in TextTable(tmp_path / "x.gz").numbers()] == [[1.0, 3.0], [2.0, 4.0]]


def test_a_sound_that_declares_more_than_it_holds_says_so(tmp_path: Path) -> None:
    head = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 1, 8000, 16000, 2, 16)
    data = b"data" + struct.pack("<I", 2**31) + np.arange(20_000, dtype="<i2").tobytes()
    (tmp_path / "x.wav").write_bytes(b"RIFF" + struct.pack("<I", 2**31 + 36) + head + data)
    with pytest.raises(UnreadableResultError, match="declares 2147483648 bytes and holds 40000"):
        read_signal(str(tmp_path / "x.wav"), Measurand.PRESSURE)


def test_groups_of_more_than_eight_levels_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    path.write_bytes(path.read_bytes()[:-32])
    with h5py.File(path, "r+") as file:
        file.create_group("/".join("g" * 9))
    with pytest.raises(UnreadableResultError, match="more than 8 levels"), open_result(path):
        raise AssertionError


def test_xarray_follows_no_link(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    path.write_bytes(path.read_bytes()[:-32])
    with h5py.File(path, "r+") as file:
        file["history/x"] = h5py.ExternalLink("/dev/zero", "/")
    seal(path)
    with pytest.raises(UnreadableResultError, match="is a link, or a view"):
        as_xarray(path)


@campaign
def test_damage_on_which_hdf5_never_ends_is_refused_though_its_digest_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    data = bytearray(path.read_bytes()[:-32])
    place = data.index(b"GCOL") + 16
    while int.from_bytes(data[place : place + 2], "little"):
        place += 16 + (int.from_bytes(data[place + 8 : place + 16], "little") + 7) // 8 * 8
    data[place + 8 : place + 16] = bytes(8)
    path.write_bytes(data)
    seal(path)
    monkeypatch.setattr(read, "SHORTEST_TRIAL", 1.0)
    with pytest.raises(UnreadableResultError, match="HDF5 cannot read it"), open_result(path):
        raise AssertionError


def test_a_digest_that_does_not_fit_needs_force_and_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(UnreadableResultError, match="only --force-read"), open_result(path):
        raise AssertionError
    said = list[str]()
    try:
        readings.begin(said.append, forced=True)
        with open_result(path) as result:
            assert not result.sealed
        assert readings.noted() == {"digest": "does not fit"}
        assert readings.mark()
        assert len(said) == 1
    finally:
        readings.begin()


def test_variables_of_libraries_are_fixed() -> None:
    program = "import os, brakecli.about as it; it.fix_environment(); print(sorted(os.environ.items()))"
    given = {"HDF5_DRIVER": "no", "MPLBACKEND": "module://x", "NUMBA_OPT": "0", "HDF5_USE_FILE_LOCKING": "FALSE"}
    done = subprocess.run([sys.executable, "-c", program], env=given, capture_output=True, text=True, check=True)
    assert "HDF5_DRIVER" not in done.stdout
    assert "NUMBA_OPT" not in done.stdout
    assert "('MPLBACKEND', 'agg')" in done.stdout
    assert "('HDF5_USE_FILE_LOCKING', 'FALSE')" in done.stdout


def changed(path: Path, change: Callable[[h5py.File], object]) -> None:
    """A result with a change, and a digest that fits."""
    write(path, 10)
    path.write_bytes(path.read_bytes()[:-32])
    with h5py.File(path, "r+") as file:
        change(file)
    seal(path)


def the_same_text(file: h5py.File) -> None:
    """Many names for one long text."""
    data = file.create_dataset("history/z", (100_000,), h5py.string_dtype(), chunks=(100_000,))
    data[0] = "A" * 1_000_000
    file.flush()
    place = data.id.get_chunk_info(0).byte_offset
    with Path(file.filename).open("rb") as raw:
        raw.seek(place)
        data.id.write_direct_chunk((0,), raw.read(16) * 100_000)


def much_in_little(file: h5py.File) -> None:
    """1.6 GB of zeros in as many MB."""
    data = file.create_dataset("history/z", (200_000_000,), "f8", chunks=(1_000_000,), compression="gzip")
    packed = zlib.compress(bytes(8_000_000), 9)
    for start in range(0, 200_000_000, 1_000_000):
        data.id.write_direct_chunk((start,), packed)


def many_attributes(file: h5py.File) -> None:
    for number in range(1001):
        file["history"].attrs[f"a{number}"] = number


def in_energy(value: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file.require_group("energy").attrs["belt"] = value

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (many_attributes, "more than 1000 attributes"),
        (in_energy(np.nan), "not finite"),
        (in_energy("12"), "is not what belongs there"),
        (in_energy(np.ones((2, 2))), "is not what belongs there"),
        (
            lambda file: file.attrs.__setitem__("complete", np.ones(2)),
            "complete is not what belongs there: a whole number",
        ),
    ],
)
def test_what_does_not_belong_there_is_named(
    tmp_path: Path, change: Callable[[h5py.File], object], reason: str
) -> None:
    path = tmp_path / "r.h5"
    changed(path, change)
    with pytest.raises(UnreadableResultError, match=reason), open_result(path) as result:
        result.group_attributes("energy")


def test_texts_of_any_length_under_other_names_are_not_read(tmp_path: Path) -> None:
    changed(tmp_path / "r.h5", the_same_text)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    with open_result(tmp_path / "r.h5") as result:
        assert result.variables("history")["z"].kind == "O"
    with pytest.raises(UnreadableResultError, match="history/z holds texts or lists of any length"):
        as_xarray(tmp_path / "r.h5")
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < before + 1_000_000  # kB


def test_what_unpacks_to_more_than_the_bound_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    changed(path, much_in_little)
    assert path.stat().st_size < 4_000_000
    with pytest.raises(UnreadableResultError, match=r"takes \d+ bytes in memory, and \d+ are the most"):
        as_xarray(path)
    with open_result(path) as result:
        assert result.read("history", "z", 0, 5).tolist() == [0.0] * 5
        with pytest.raises(UnreadableResultError, match="bytes in memory"):
            result.read("history", "z")


def test_a_name_that_is_missing_is_told(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    with open_result(path) as result:
        with pytest.raises(UnreadableResultError, match=r"r\.h5: z is missing"):
            result.variables("history")["z"]
        with pytest.raises(UnreadableResultError, match="z is missing"):
            result.attributes["z"]


def test_no_control_character_of_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    changed(path, lambda file: file.attrs.modify("title", "\x1b[31mred\x07\nend"))
    with open_result(path) as result:
        assert result.attributes["title"] == "\\u001b[31mred\\u0007\nend"


def test_a_user_block_makes_a_file_unchecked_and_not_unreadable(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    with h5py.File(path) as old, h5py.File(tmp_path / "b.h5", "w", userblock_size=512) as new:
        new.attrs.update(old.attrs)
        for name in old:
            old.copy(name, new)
    with open_result(tmp_path / "b.h5") as result:
        assert not result.sealed
    assert readings.noted() == {}  # nobody is told, and so no later result is marked
