"""The finished points of a sweep that is not finished: what a later run of the same sweep begins with.

``OUTPUT.partial`` begins with a line of JSON that says which sweep it belongs to. Blocks of records follow, each
written at once with its checksum: whatever ends the process costs the block that is being written, no more.
"""

import json
import os
import struct
import tomllib
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import BrakecliError, CannotWriteError, RefusedError
from brakecli.files.atomic import explained, open_own
from brakecli.sweeps.plan import Plan
from brakecli.sweeps.point import Status, record_type
from brakecli.sweeps.workers.task import fingerprint

_PLACE = struct.Struct("<qq")  # first unit, units
_HEAD = struct.Struct("<qqI")  # the place, checksum of the place and the records
_LONGEST_HEADER, _FIRST_KEY = 5_000_000, b"brakecli_version"
MOST_DIFFERENCES = 5


class Journal:
    """The records of the units of a sweep: a point each, or a line of points that follow one another."""

    def __init__(self, path: Path, file: FileIO, plan: Plan) -> None:
        """Begin without any records; `open_journal` reads those of the file."""
        self.path, self.plan, self.kind = path, plan, record_type(plan)
        self.finished = np.zeros(plan.units, dtype=bool)
        self.done, self.failed = 0, 0  # points
        self._file = file
        self._unit_bytes = plan.unit_length * self.kind.itemsize
        self._blocks: list[tuple[int, int, int]] = []  # first unit, units, where their records begin

    def add(self, first: int, records: bytes) -> None:
        """Append the records of finished units."""
        count = len(records) // self._unit_bytes
        offset = self._file.seek(0, os.SEEK_END)
        try:
            with explained(self.path):
                self._write(_HEAD.pack(first, count, _checksum(first, count, records)) + records)
                os.fsync(self._file.fileno())
        except CannotWriteError:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), offset)
            raise
        self._note(first, count, offset + _HEAD.size, records)

    def column(self, name: str) -> NDArray[Any]:
        """A field of all records, in the shape of the grid; every unit has to be finished.

        A field of several numbers has one more dimension, as long as the record that holds most of them needs.
        """
        kind = self.kind[name]
        values = np.empty((len(self.finished), self.plan.unit_length), kind)
        for first, count, offset in self._blocks:
            data = os.pread(self._file.fileno(), count * self._unit_bytes, offset)
            if len(data) < count * self._unit_bytes:
                raise BrakecliError(f"{self.path}: was cut short while in use; run the same command again")
            values[first : first + count] = np.frombuffer(data, self.kind)[name].reshape(count, -1, *kind.shape)
        shape, followed = list(self.plan.dimensions.values()), self.plan.followed
        along = len(shape) - 1 if followed is None else followed + self.plan.passes - 1
        length = shape.pop(along)
        column = np.moveaxis(values.reshape(*shape, length, *kind.shape), len(shape), along)
        if kind.shape:
            column = column[..., : max(1, int(np.isfinite(column).sum(axis=-1).max()))]
        return column

    def discard(self) -> None:
        """Remove the file: its sweep is finished."""
        with suppress(OSError):
            self.path.unlink()

    def begin(self, *, force: bool) -> None:
        """Take up what an earlier run has left, or write the header of a new journal."""
        own, found = identity(self.plan), self._file.read(_LONGEST_HEADER)
        found = found[: found.find(b"\n") + 1] or found
        if not (refusal := _refusal(found, own)):
            self._read_blocks(len(found))
            return
        if found and not force:
            raise RefusedError(f"{self.path}: {refusal}")
        if found and _FIRST_KEY not in found[:100]:
            raise RefusedError(
                f"{self.path}: was not written by this program; move it away, or choose another output"
            )
        os.ftruncate(self._file.fileno(), 0)
        self._file.seek(0)
        try:
            self._write(json.dumps(own).encode() + b"\n")
        except OSError:
            self.discard()  # it holds nothing
            raise

    def _read_blocks(self, offset: int) -> None:
        """Note the blocks of a journal, and cut off one that was not finished."""
        self._file.seek(offset)
        while len(head := self._file.read(_HEAD.size)) == _HEAD.size:
            first, count, checksum = _HEAD.unpack(head)
            if not 0 <= first < first + count <= len(self.finished):
                break
            records = self._file.read(count * self._unit_bytes)
            if len(records) < count * self._unit_bytes or _checksum(first, count, records) != checksum:
                break
            if not self.finished[first : first + count].any():  # a copy of a block brings nothing new
                self._note(first, count, offset + _HEAD.size, records)
            offset = self._file.tell()
        os.ftruncate(self._file.fileno(), offset)

    def _note(self, first: int, count: int, offset: int, records: bytes) -> None:
        self._blocks.append((first, count, offset))
        self.finished[first : first + count] = True
        statuses = np.frombuffer(records, self.kind)["status"]
        self.done += len(statuses)
        self.failed += int((statuses != Status.DONE.encode()).sum())

    def _write(self, data: bytes) -> None:
        """Write all of it: a disk that is nearly full takes a part."""
        view = memoryview(data)
        while view:
            view = view[os.write(self._file.fileno(), view) :]


@contextmanager
def open_journal(path: Path, plan: Plan, *, force: bool) -> Iterator[Journal]:
    """Open the journal beside an output, or begin it; one without any finished unit is removed at the end.

    Raises CannotWriteError where it cannot be written, and RefusedError where there is one of another sweep and
    `force` is not set.
    """
    with explained(path):
        file = FileIO(path, "r+", opener=lambda name, flags: open_own(name, flags | os.O_CREAT))
    with file:
        journal = Journal(path, file, plan)
        with explained(path):
            journal.begin(force=force)
        try:
            yield journal
        finally:
            if not journal.finished.any():
                journal.discard()


def _checksum(first: int, count: int, records: bytes) -> int:
    return zlib.crc32(records, zlib.crc32(_PLACE.pack(first, count)))


def identity(plan: Plan) -> dict[str, Any]:
    """What makes a sweep this one: every key of the sweep and its case, and the versions it is computed with."""
    sweep = tomllib.loads(plan.sweep_text)
    return {**fingerprint(), **dict(_flat(plan.case_keys, "", "")), **dict(_flat(sweep, "sweep ", ""))}


def _flat(value: Any, path: str, dot: str = ".") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _flat(each, f"{path}{dot}{key}")
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, each in enumerate(value):
            yield from _flat(each, f"{path}[{index}]")
    else:
        yield path, value


def _refusal(found: bytes, own: Mapping[str, Any]) -> str:
    """Why a journal that begins with a line belongs to another sweep; empty where it belongs to this one."""
    try:
        there = json.loads(found)
        keys = [key for key in {**there, **own} if there.get(key) != own.get(key)]
    except (ValueError, TypeError, AttributeError, RecursionError):
        return "holds no finished points; remove it, or start again with --force"
    if not keys:
        return ""
    each = [f"{key} was {there.get(key, 'not set')!s:.60}, is {own.get(key, 'not set')!s:.60}" for key in keys]
    each[MOST_DIFFERENCES:] = [f"and {more} more"] if (more := len(keys) - MOST_DIFFERENCES) > 0 else []
    remedy = "undo the change to go on, or start again with --force, which drops the finished points"
    return f"holds finished points of another sweep: {', '.join(each)}; {remedy}"
