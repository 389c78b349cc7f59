"""The finished points of a sweep that is not finished: what a later run of the same sweep begins with.

``OUTPUT.partial`` begins with a line of JSON that says which sweep it belongs to. Blocks of records follow, each
written at once with its checksum: whatever ends the process costs the block that is being written, no more.
"""

import json
import math
import os
import struct
import zlib
from bisect import bisect_right, insort
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import FileIO
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import BrakecliError, CannotWriteError, RefusedError, value_text
from brakecli.faces import argument
from brakecli.results.atomic import explained, open_own
from brakecli.results.field import flat
from brakecli.results.os_signals import lastly
from brakecli.results.toml_lines import parse
from brakecli.studies.sweeps.plan import Plan
from brakecli.studies.sweeps.record import Status, record_type, unsound
from brakecli.studies.sweeps.workers.task import fingerprint

_PLACE = struct.Struct("<qqI")  # first unit, units, bytes of their records, which are packed
_HEAD = struct.Struct("<qqII")  # the place, checksum of the place and the packed records
_FIRST_KEY = b"brakecli_version"


class Journal:
    """The records of the units of a sweep: a point each, or a line of points that follow one another."""

    def __init__(self, path: Path, file: FileIO, plan: Plan) -> None:
        """Begin without any records; `open_journal` reads those of the file."""
        self.path = path
        self.plan = plan
        self.kind = record_type(plan)
        self.finished = np.zeros(plan.units, dtype=bool)
        # points
        self.done = 0
        self.failed = 0
        self._file = file
        self._unit_bytes = plan.unit_length * self.kind.itemsize
        # first unit, units, where their records begin and end, and their checksum
        self._blocks: list[tuple[int, int, int, int, int]] = []
        self._longest = {name: 1 for name in self.kind.names or () if self.kind[name].kind == "S"}  # bytes
        self._block = 0, b""  # read last: where it begins, and its records
        # Lines read last: the first and the last, and their records.
        self._slab: tuple[int, int, NDArray[np.void]] | None = None

    def add(self, first: int, records: bytes) -> None:
        """Append the records of finished units, which are sound."""
        count = len(records) // self._unit_bytes
        packed = zlib.compress(records, 1)  # texts are alike, and numbers hardly smaller at other levels
        extent = first, count, len(packed)
        offset = self._file.seek(0, os.SEEK_END)
        try:
            with explained(self.path):
                self._write(_HEAD.pack(*extent, _checksum(extent, packed)) + packed)
                os.fsync(self._file.fileno())
        except CannotWriteError:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), offset)
            raise
        self._note(extent, offset + _HEAD.size, records, packed)

    @property
    def stored(self) -> np.dtype[np.void]:
        """The record of a point in a result: its texts as long as the longest of them."""
        lengths = {name: f"S{length}" for name, length in self._longest.items()}
        return np.dtype([(name, lengths.get(name, self.kind[name])) for name in self.kind.names or ()])

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        """The records of the places start … stop - 1 of the result, in its order; no unit may be missing."""
        plan = self.plan
        if plan.followed is None:
            return self._units(start, stop)
        inner = math.prod(plan.shape[plan.followed + 1 :])  # lines side by side, in as many units
        size = inner * plan.unit_length
        first = start // size * inner
        last = -(-stop // size) * inner
        if self._slab is None or self._slab[:2] != (first, last):
            lines = self._units(first, last).reshape(-1, inner, plan.unit_length)
            self._slab = first, last, np.ascontiguousarray(lines.transpose(0, 2, 1)).ravel()
        begin = first * plan.unit_length
        return self._slab[2][start - begin : stop - begin]

    def blocks(self) -> Iterator[tuple[int, NDArray[np.void]]]:
        """All records in the order of the result, some at a time: the place of the first, and they."""
        points = len(self.finished) * self.plan.unit_length
        at_once = 1 << 14
        for start in range(0, points, at_once):
            yield start, self.read(start, min(start + at_once, points))

    def column(self, name: str) -> NDArray[Any]:
        """A field of all records, in the shape of the grid; every unit has to be finished.

        A field of several numbers has one more dimension, as long as the record that holds most of them needs.
        """
        blocks = [records[name] for _, records in self.blocks()]
        column = np.concatenate(blocks).reshape(*self.plan.dimensions.values(), *self.kind[name].shape)
        if self.kind[name].shape:
            column = column[..., : max(1, int(np.isfinite(column).sum(axis=-1).max()))]
        return column

    def _units(self, first: int, last: int) -> NDArray[np.void]:
        """The records of some units, in their order."""
        length = self.plan.unit_length
        kind = self.stored
        records = np.empty((last - first) * length, kind)
        for begin, count, *block in self._blocks[bisect_right(self._blocks, first, key=itemgetter(0)) - 1 :]:
            if begin >= last:
                break
            data = self._unpacked(*block)
            low = max(begin, first)
            high = min(begin + count, last)
            rows = np.frombuffer(data, self.kind)[(low - begin) * length : (high - begin) * length]
            records[(low - first) * length : (high - first) * length] = rows
        return records

    def _unpacked(self, start: int, end: int, checksum: int) -> bytes:
        """The records of a block, which may be read in pieces: those that were sound when it was noted."""
        if self._block[0] != start:
            packed = os.pread(self._file.fileno(), end - start, start)
            if zlib.crc32(packed) != checksum:
                again = f"run the same command again, with {argument('force')} if it is refused"
                raise BrakecliError(f"{self.path}: was changed while in use; {again}")
            self._block = start, zlib.decompress(packed)
        return self._block[1]

    def discard(self) -> None:
        """Remove the file: its sweep is finished."""
        with suppress(OSError):
            self.path.unlink()

    def begin(self, *, force: bool) -> None:
        """Take up what an earlier run has left, or write the header of a new journal."""
        own = identity(self.plan)
        header = self._file.read(5_000_000)  # of no header
        header = header[: header.find(b"\n") + 1] or header
        if not (refusal := _refusal(header, own)):
            self._read_blocks(len(header))
            return
        if header and not force:
            raise RefusedError(f"{self.path}: {refusal}")
        if header and _FIRST_KEY not in header[:100]:
            what = "was not written by this program"
            raise RefusedError(f"{self.path}: {what}; move it away, or choose another output")
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
            *extent, checksum = _HEAD.unpack(head)
            first, count, length = extent
            if not 0 <= first < first + count <= len(self.finished):
                break
            packed = self._file.read(min(length, 2 * count * self._unit_bytes + 1000))
            if len(packed) < length or _checksum((first, count, length), packed) != checksum:
                break
            if not self.finished[first : first + count].any():  # a copy of a block brings nothing new
                if (records := self._sound(packed, count)) is None:
                    break
                self._note((first, count, length), offset + _HEAD.size, records, packed)
            offset = self._file.tell()
        os.ftruncate(self._file.fileno(), offset)

    def _sound(self, packed: bytes, count: int) -> bytes | None:
        """The records of a block of so many units; None where they are not what belongs there."""
        stream = zlib.decompressobj()
        try:
            records = stream.decompress(packed, count * self._unit_bytes + 1)
        except zlib.error:
            return None
        return records if stream.eof and not unsound(self.plan, records, count) else None

    def _note(self, extent: tuple[int, int, int], offset: int, records: bytes, packed: bytes) -> None:
        first, count, length = extent
        insort(self._blocks, (first, count, offset, offset + length, zlib.crc32(packed)))
        self.finished[first : first + count] = True
        rows = np.frombuffer(records, self.kind)
        self.done += len(rows)
        self.failed += int((rows["status"] != Status.DONE.encode()).sum())
        for name in self._longest:
            self._longest[name] = max(self._longest[name], int(np.char.str_len(rows[name]).max()))

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

        def close() -> None:
            if not journal.finished.any():
                journal.discard()

        with lastly(close):
            yield journal


def _checksum(extent: tuple[int, int, int], packed: bytes) -> int:
    return zlib.crc32(packed, zlib.crc32(_PLACE.pack(*extent)))


def identity(plan: Plan) -> dict[str, object]:
    """What makes a sweep this one: every key of the sweep and its case, and the versions it is computed with.

    Of the measured profiles that points need, names and contents count: a folder may have been moved.
    """
    sweep = dict(flat(parse(plan.sweep_text)))
    case = {key: value for key, value in flat(plan.case_keys) if not key.endswith(".profile")}
    measured = defaultdict[str, list[int]](list)
    profiles = {str(Path(path).absolute()): record for path, record in plan.records.items()}
    for path, record in sorted(profiles.items()):
        checksum = zlib.crc32(record.height, zlib.crc32(record.place, record.is_angle))
        measured[f"checksum of {Path(path).name}"].append(checksum)
    if plan.listed is not None:
        measured["checksum of the points"] = [plan.listed.checksum]
    return {**fingerprint(), **case, **measured, **{f"sweep {key}": value for key, value in sweep.items()}}


def _refusal(header: bytes, own: Mapping[str, object]) -> str:
    """Why a journal that begins with a line belongs to another sweep; empty where it belongs to this one."""
    try:
        there = json.loads(header)
        keys = [key for key in {**there, **own} if there.get(key) != own.get(key)]
    except (ValueError, TypeError, AttributeError, RecursionError):
        return (
            "holds no finished points, or its first line is damaged; "
            f"remove it, or start again with {argument('force')}"
        )
    if not keys:
        return ""
    were, are = (
        {key: value_text(entries.get(key, "not set")).strip('"') for key in keys} for entries in (there, own)
    )
    differences = [f"{key} was {were[key]}, is {are[key]}" for key in keys]
    differences[5:] = [f"and {len(keys) - 5} more"] * (len(keys) > 5)
    remedy = f"undo the change to go on, or start again with {argument('force')}, which drops the finished points"
    return f"holds finished points of another sweep: {', '.join(differences)}; {remedy}"
