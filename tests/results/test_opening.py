"""What is opened: regular files alone, at once, and no more of them than a bound."""

import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from brakecli.analysis.signals.look import Measurand
from brakecli.analysis.signals.read import read_signal
from brakecli.errors import UnreadableResultError
from brakecli.results.opening import contents, open_regular
from brakecli.results.read import open_result
from brakecli.results.table import TextTable
from tests.results.results import write


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, make: object) -> None:
    make(tmp_path / "x")  # type: ignore[operator]
    with pytest.raises(OSError, match="not a regular file"):
        open_regular(tmp_path / "x")


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


def test_variables_of_libraries_are_fixed() -> None:
    program = "import os, brakecli.about as it; it.fix_environment(); print(sorted(os.environ.items()))"
    given = {"HDF5_DRIVER": "no", "MPLBACKEND": "module://x", "NUMBA_OPT": "0", "HDF5_USE_FILE_LOCKING": "FALSE"}
    done = subprocess.run([sys.executable, "-c", program], env=given, capture_output=True, text=True, check=True)
    assert "HDF5_DRIVER" not in done.stdout
    assert "NUMBA_OPT" not in done.stdout
    assert "('MPLBACKEND', 'agg')" in done.stdout
    assert "('HDF5_USE_FILE_LOCKING', 'FALSE')" in done.stdout


def test_a_name_that_is_missing_is_told(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, 10)
    with open_result(path) as result:
        with pytest.raises(UnreadableResultError, match=r"r\.h5: z is missing"):
            result.variables("history")["z"]
        with pytest.raises(UnreadableResultError, match="z is missing"):
            result.attributes["z"]
