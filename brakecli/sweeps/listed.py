"""Points that are listed: a table with a column for each key path, and a row for each point."""

import csv
import io
import zlib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from brakecli.case.read import key_path
from brakecli.case.tables import entries
from brakecli.errors import CaseError, Problem, UnreadableResultError
from brakecli.files.opening import contents

LARGEST = 500_000_000
"""Bytes of such a table."""
GIVEN = "-"
"""The file of points that come from no file."""


@dataclass(frozen=True)
class Listed:
    """Listed points. Two lists are one and the same where keys and checksum agree."""

    keys: tuple[str, ...]
    columns: tuple[tuple[Any, ...], ...] = field(compare=False)
    checksum: int
    lines: tuple[int, ...] = field(default=(), compare=False)  # where each stands in its file

    @classmethod
    def of(cls, keys: Sequence[str], columns: Iterable[Iterable[Any]], lines: tuple[int, ...] = ()) -> "Listed":
        """The points whose values stand in the columns of these keys."""
        found = tuple(tuple(each) for each in columns)
        return cls(tuple(keys), found, zlib.crc32(repr(found).encode()), lines)

    @property
    def size(self) -> int:
        """How many points there are."""
        return len(self.columns[0])


def read_listed(path: Path, source: str, at: int) -> Listed:
    """The points of a CSV file, which a line of a sweep names; raises CaseError with the line."""

    def wrong(what: str, remedy: str, line: int = 0) -> NoReturn:
        if line:
            raise CaseError([Problem((), what, remedy, str(path), line)])
        raise CaseError([Problem(("points",), what, remedy, source, at)])

    try:
        text = contents(path, LARGEST).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError, UnreadableResultError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        reason = "it is no text in UTF-8" if isinstance(error, UnicodeDecodeError) else reason
        wrong(f"cannot be read ({path}: {reason})", "name a CSV file in UTF-8")
    reader = csv.reader(io.StringIO(text), skipinitialspace=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        line = reader.line_num
        wrong(f"is no CSV ({error})", "write a line for each point, its values with commas between them", line)
    if len(rows) < 2:
        wrong("lists no point", "write key paths in the first line, and a line for each point", 1)
    (head, keys), *rows = rows
    for number, key in enumerate(keys):
        if not key_path(key):
            wrong(f"column {number + 1} has no key path (found {key!r})", "name a key as in link2.angle_deg", head)
        if key_path(key) in [*map(key_path, keys[:number])]:
            wrong(f"{key} has two columns", "keep one of them", head)
    for line, row in rows:
        if len(row) != len(keys) or "" in row:
            some = (
                f"has {entries(tuple(row))} for {len(keys)} keys" if len(row) != len(keys) else "has an empty cell"
            )
            wrong(some, "give each key a value at each point", line)
    columns = zip(*([_value(cell) for cell in row] for _, row in rows), strict=True)
    return Listed.of(keys, columns, tuple(line for line, _ in rows))


def _value(text: str) -> Any:
    """What a cell holds: a number, true or false, or a text."""
    for kind in (int, float) if text.isascii() and "_" not in text else ():
        with suppress(ValueError):
            return kind(text)
    return {"true": True, "false": False}.get(text, text)
