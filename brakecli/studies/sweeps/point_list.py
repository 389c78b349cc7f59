"""Points that are listed: a table with a column for each key path, and a row for each point."""

import csv
import os
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BufferedReader, TextIOWrapper
from pathlib import Path
from typing import TextIO

from brakecli.case.read import key_path
from brakecli.case.tables import entries
from brakecli.errors import CaseError, Problem, RefusedError
from brakecli.results.opening import open_regular

LARGEST = 500_000_000
"""Bytes of such a table."""
LONGEST_LINE = 1_000_000
"""Characters of a line, which is read whole."""
MOST_KEYS = 200
"""Keys of a list: a case has fewer."""
MOST_VALUES = 3_000_000
"""Values of a list, keys times points: a choice. One takes up to 100 bytes, here and in each worker."""
GIVEN = "-"
"""The file of points that come from no file."""

Row = tuple[int, list[str]]
"""The line at which a row ends, and its cells."""


@dataclass(frozen=True)
class Listed:
    """Listed points. Two lists are one and the same where keys and checksum agree."""

    keys: tuple[str, ...]
    columns: tuple[tuple[object, ...], ...] = field(compare=False)
    checksum: int
    lines: tuple[int, ...] = field(default=(), compare=False)  # where each stands in its file

    @classmethod
    def of(cls, keys: Sequence[str], columns: Iterable[Iterable[object]], lines: tuple[int, ...] = ()) -> "Listed":
        """The points whose values stand in the columns of these keys."""
        values = tuple(tuple(column) for column in columns)
        checksum = 0
        at_once = 1 << 14
        for column in values:
            for begin in range(0, len(column), at_once):
                checksum = zlib.crc32(repr(column[begin : begin + at_once]).encode(), checksum)
        return cls(tuple(keys), values, checksum, lines)

    @property
    def size(self) -> int:
        """How many points there are."""
        return len(self.columns[0])


def refuse_many(keys: int, points: int, where: str) -> None:
    """Raise RefusedError where a list has more keys, or more values, than a list may have."""
    if keys > MOST_KEYS:
        raise RefusedError(f"{where}: {keys} keys are too many, {MOST_KEYS} are the most; leave some out")
    if keys * points > MOST_VALUES:
        what = f"the points are too many: with {keys} key{'s' * (keys > 1)} {MOST_VALUES // keys} are the most"
        raise RefusedError(f"{where}: {what}; take fewer, or divide them among several lists")


def read_listed(path: Path, source: str, at: int) -> Listed:
    """The points of a CSV file, which a line of a sweep names.

    Raises CaseError with the line of what is wrong, and RefusedError where there are too many.
    """
    try:
        with TextIOWrapper(BufferedReader(open_regular(path)), encoding="utf-8-sig", newline="") as file:
            if os.fstat(file.fileno()).st_size > LARGEST:
                raise OSError(f"it is larger than {LARGEST} bytes")
            return _points(_rows(file, str(path)), str(path))
    except (OSError, ValueError) as error:  # ValueError: no text, or a NUL in the path
        reason = getattr(error, "strerror", None) or str(error)
        reason = "it is no text in UTF-8" if isinstance(error, UnicodeDecodeError) else reason
        what = f"cannot be read ({path}: {reason})"
        raise CaseError([Problem(("points",), what, "name a CSV file in UTF-8", source, at)]) from error


def _points(rows: Iterator[Row], name: str) -> Listed:
    """The points of the rows of a file; no row is kept beside its values."""
    line, keys = next(rows, (1, []))
    refuse_many(len(keys), 0, f"{name}:{line}")
    paths = dict[tuple[str, ...], str]()
    for number, key in enumerate(keys):
        path = key_path(key)
        if not path:
            what = f"column {number + 1} has no key path (found {key!r})"
            raise _wrong(what, "name a key as in link2.angle_deg", name, line)
        if path in paths:
            raise _wrong(f"{key} has two columns", "keep one of them", name, line)
        paths[path] = key
    columns = [list[object]() for _ in keys]
    lines = list[int]()
    for line, cells in rows:
        if len(cells) != len(keys) or "" in cells:
            has = f"has {entries(tuple(cells))} for {len(keys)} keys"
            what = has if len(cells) != len(keys) else "has an empty cell"
            raise _wrong(what, "give each key a value at each point", name, line)
        lines.append(line)
        refuse_many(len(keys), len(lines), f"{name}:{line}")
        for column, cell in zip(columns, cells, strict=True):
            column.append(_value(cell))
    if not lines:
        remedy = "write key paths in the first line, and a line for each point"
        raise _wrong("lists no point", remedy, name, 1)
    return Listed.of(keys, columns, tuple(lines))


def _rows(file: TextIO, name: str) -> Iterator[Row]:
    """The rows of a CSV file that are not empty, one after the other."""
    reader = csv.reader(iter(lambda: file.readline(LONGEST_LINE), ""), skipinitialspace=True)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except csv.Error as error:
        remedy = "write a line for each point, its values with commas between them"
        raise _wrong(f"is no CSV ({error})", remedy, name, reader.line_num) from error


def _wrong(what: str, remedy: str, name: str, line: int) -> CaseError:
    return CaseError([Problem((), what, remedy, name, line)])


def _value(text: str) -> object:
    """What a cell holds: a number, true or false, or a text."""
    for kind in (int, float) if text.isascii() and "_" not in text else ():
        with suppress(ValueError):
            return kind(text)
    return {"true": True, "false": False}.get(text, text)
