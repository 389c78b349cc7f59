"""The finished points of a sweep that is not finished: what a later run of the same sweep begins with.

``OUTPUT.partial`` begins with a line of JSON that says which sweep it belongs to. Blocks of records follow, each
written at once with its checksum: whatever ends the process costs the block that is being written, no more.
"""

import json
import os
import struct
import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import BrakecliError, CannotWriteError, RefusedError

Identity = Mapping[str, Any]
"""What makes a sweep that one: keys and values, none of them a mapping."""

_HEAD = struct.Struct("<qqI")  # first unit, units, checksum of the records
_LONGEST_HEADER = 5_000_000
MOST_DIFFERENCES = 5


class _Block(NamedTuple):
    first: int
    size: int
    offset: int


class Journal:
    """The records of the units of a sweep: a point each, or a line of points that follow one another.

    Raises CannotWriteError where it cannot be written, and RefusedError where there is one of another sweep and
    `force` is not set.
    """

    def __init__(
        self, path: Path, identity: Identity, kind: np.dtype[Any], units: int, length: int, *, force: bool
    ) -> None:
        """Open the journal beside an output, or begin it. A unit has `length` records."""
        self.path = path
        self.finished = np.zeros(units, dtype=bool)
        self._kind, self._length = kind, length
        self._blocks: list[_Block] = []
        self._file = self._opened(identity, force=force)

    def __enter__(self) -> Self:
        """Nothing more to open."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it; one without any finished unit is removed."""
        with suppress(OSError):
            self._file.close()
        if not self._blocks:
            self.discard()

    def add(self, first: int, records: bytes) -> None:
        """Append the records of finished units."""
        count, rest = divmod(len(records), self._kind.itemsize * self._length)
        if rest or self.finished[first : first + count].any():
            raise ValueError(f"units {first} … hold {len(records)} bytes, or are there already")
        offset = self._file.seek(0, os.SEEK_END)
        try:
            _write(self._file, _HEAD.pack(first, count, zlib.crc32(records)) + records)
            os.fsync(self._file.fileno())
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), offset)
            raise _cannot_write(self.path, error) from error
        self._note(_Block(first, count, offset + _HEAD.size))

    def column(self, name: str) -> NDArray[Any]:
        """A field of all records in the order of the units, which have to be finished."""
        values = np.empty((len(self.finished), self._length), self._kind[name])
        for block in self._blocks:
            self._file.seek(block.offset)
            data = self._file.read(size := block.size * self._length * self._kind.itemsize)
            if len(data) < size:
                raise BrakecliError(f"{self.path}: was cut short while in use; run the same command again")
            records = np.frombuffer(data, self._kind).reshape(block.size, self._length)
            values[block.first : block.first + block.size] = records[name]
        return values

    def discard(self) -> None:
        """Remove the file: its sweep is finished."""
        with suppress(OSError):
            self.path.unlink()

    def _opened(self, identity: Identity, *, force: bool) -> BinaryIO:
        header = json.dumps(dict(identity)).encode() + b"\n"
        try:
            file = open(os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666), "r+b", buffering=0)  # noqa: SIM115, PTH123
        except OSError as error:
            raise _cannot_write(self.path, error) from error
        try:
            found = file.read(_LONGEST_HEADER)
            found = found[: found.find(b"\n") + 1]
            if found and found != header and not force:
                raise RefusedError(_differences(self.path, found, identity))
            if found == header:
                self._read(file, len(header))
            else:
                os.ftruncate(file.fileno(), 0)
                file.seek(0)
                self._begin(file, header)
        except OSError as error:
            file.close()
            raise _cannot_write(self.path, error) from error
        except BaseException:
            file.close()
            raise
        return file

    def _begin(self, file: BinaryIO, header: bytes) -> None:
        try:
            _write(file, header)
        except OSError:
            self.discard()  # it holds nothing
            raise

    def _read(self, file: BinaryIO, offset: int) -> None:
        """Note the blocks of a journal, and cut off one that was not finished."""
        while True:
            file.seek(offset)
            head = file.read(_HEAD.size)
            if len(head) < _HEAD.size:
                break
            first, count, checksum = _HEAD.unpack(head)
            size = count * self._length * self._kind.itemsize
            if not 0 <= first < first + count <= len(self.finished):
                break
            records = file.read(size)
            if len(records) < size or zlib.crc32(records) != checksum:
                break
            self._note(_Block(first, count, offset + _HEAD.size))
            offset += _HEAD.size + size
        os.ftruncate(file.fileno(), offset)

    def _note(self, block: _Block) -> None:
        self._blocks.append(block)
        self.finished[block.first : block.first + block.size] = True


def _write(file: BinaryIO, data: bytes) -> None:
    """Write all of it: a disk that is nearly full takes a part."""
    view = memoryview(data)
    while view:
        view = view[os.write(file.fileno(), view) :]


def _differences(path: Path, found: bytes, identity: Identity) -> str:
    """In which keys the journal that is there belongs to another sweep."""
    remedy = "undo the change to go on, or start anew with --force, which drops the finished points"
    try:
        there = json.loads(found)
        keys = [key for key in {**there, **identity} if there.get(key) != identity.get(key)]
    except (ValueError, TypeError, AttributeError, RecursionError):
        return f"{path}: holds no finished points; remove it, or start anew with --force"
    told = [
        f"{key} was {there.get(key, 'not set')!s:.60}, is {identity.get(key, 'not set')!s:.60}" for key in keys
    ]
    more = [f"and {len(keys) - MOST_DIFFERENCES} more"] if len(keys) > MOST_DIFFERENCES else []
    differences = ", ".join(told[:MOST_DIFFERENCES] + more)
    return f"{path}: holds finished points of another sweep: {differences}; {remedy}"


def _cannot_write(path: Path, error: OSError) -> CannotWriteError:
    reason = (error.strerror or str(error)).lower()
    return CannotWriteError(
        f"{path}: cannot write: {reason}; free some space there, or choose another output with -o"
    )
