"""TOML with line numbers: what a text says, in which line each key stands, and everything that is wrong with it.

`tomllib` decides what is valid, but it gives no lines and stops at the first error. So the text is also split
into its statements, and each of them is parsed by itself.
"""

import re
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, TypeVar

from brakecli.errors import CaseError, KeyPath, Problem, key_text, printable

# Within these limits every problem of a file is reported within half a second.
LARGEST_TEXT = 500_000  # bytes of a file that is given
MOST_PARTS = 32  # of a dotted key: the time that tomllib takes grows with their square
MOST_STATEMENTS = 1000  # keys and table headers
MOST_MARKS = 50_000  # commas, brackets and signs of equality outside texts; so many entries may all lists have
LARGEST_STORED = 1_250_000  # bytes with all defaults: an entry gets 7 of indentation, and a phase of 9 at the most

_OPAQUE = re.compile(  # texts and comments, also those that do not end
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\\?\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:\\[^\n]|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|#[^\n]*(?:\n[ \t\n]*#[^\n]*)*",
    re.DOTALL,
)
_DEEP = rf"(?:\.[^][.{{}},=\n]*+){{{MOST_PARTS - 1}}}\."  # ends with the first dot that is too much
_MANY = rf"\A(?:[^][{{}},=]*+[][{{}},=]){{{MOST_MARKS + 1}}}"  # ends with the first mark that is too much
_ROW = re.compile(r"^[ \t]*[^ \t\n].*", re.MULTILINE)
_Value = TypeVar("_Value")
_HEADER = re.compile(r"[ \t]*\[")
_POSITION = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
WRITING = "numbers are written 1.5 or 2e-3, texts in quotes, lists as [1, 2], table headers as [table]"
"""The remedy for what is not TOML."""


def unfit(what: str, remedy: str, source: str = "", line: int = 0) -> CaseError:
    """The error for a text of which no key can be named."""
    return CaseError([Problem((), what, remedy, source, line)])


def check_size(text: str | bytes, source: str, most: int) -> None:
    """Raise `CaseError` for more than so many bytes."""
    if len(text) > most:
        raise unfit(f"is larger than {most} bytes", "give a shorter file", source)


def innermost(values: Mapping[KeyPath, _Value], path: KeyPath, default: _Value) -> _Value:
    """The value of a key path, otherwise that of the innermost table around it."""
    prefixes = (path[:end] for end in range(len(path), 0, -1))
    return next((values[prefix] for prefix in prefixes if prefix in values), default)


def only_path(data: object) -> tuple[tuple[str, ...], object]:
    """The path through tables of a single key, and what stands at its end."""
    path: tuple[str, ...] = ()
    while isinstance(data, dict) and len(data) == 1:
        ((key, data),) = data.items()
        path = (*path, key)
    return path, data


@lru_cache(maxsize=4)  # who shows the lines of a text and then its data asks twice
def split(text: str, source: str = "") -> list[tuple[int, str]]:
    """Headers and keys with their values, valid or not, each with the line where it begins.

    Raises `CaseError` for a text that tomllib must not get.
    """
    check_size(text, source, LARGEST_STORED)
    text = text.replace("\r\n", "\n")
    bare = _OPAQUE.sub(lambda opaque: (" " if opaque[0][0] == "#" else "_") * len(opaque[0]), text)
    for searched, pattern, what, remedy in (
        (text, r"\A\ufeff", "begins with a byte order mark", "save the file as UTF-8 without one"),
        (text, r"\0", "holds a NUL character", "save the file as UTF-8 text, not as UTF-16"),
        (bare, _DEEP, f"a key has more than {MOST_PARTS} parts", "shorten the key"),
        (bare, _MANY, f"there are more than {MOST_MARKS} commas and brackets", "give shorter lists"),
    ):
        if match := re.search(pattern, searched):
            raise unfit(what, remedy, source, text.count("\n", 0, match.end() - 1) + 1)
    statements = []
    line = 1
    begin = 0
    depth = 0
    for row in _ROW.finditer(bare):
        if not depth:
            line = line + text.count("\n", begin, row.start())
            begin = row.start()
        opened, closed = (sum(map(row[0].count, marks)) for marks in ("[{", "]}"))
        depth = 0 if _HEADER.match(bare, begin) else max(0, depth + opened - closed)
        if not depth:
            statements.append((line, text[begin : row.end()]))
    if depth:
        statements.append((line, text[begin:]))
    if len(statements) > MOST_STATEMENTS:
        what = f"there are more than {MOST_STATEMENTS} keys"
        raise unfit(what, "give a shorter file", source, statements[MOST_STATEMENTS][0])
    return statements


class Located:
    """What can be read of a text: its data, the line of each key, and what is wrong with the rest."""

    def __init__(self, text: str, source: str = "") -> None:
        """Parse statement after statement. Raises `CaseError` where the text cannot be split into statements."""
        self.data: dict[str, Any] = {}
        self.lines: dict[KeyPath, int] = {}
        self.problems: list[Problem] = []
        self._source = source
        self._repeated = False
        table: dict[str, Any] | None = self.data
        path: KeyPath = ()
        for line, statement in split(text, source):
            is_header = _HEADER.match(statement)
            try:
                parsed = parse(statement, source, line)
            except CaseError as error:
                self.problems += error.problems
                table = None if is_header else table  # nobody knows to which table the next keys belong
                continue
            if is_header:
                table, path = self._enter(parsed, line)
            elif table is not None:
                self._add(table, path, parsed, line)

    def _enter(self, parsed: dict[str, object], line: int) -> tuple[dict[str, Any] | None, KeyPath]:
        """The table of a header, given as what tomllib makes of it; the keys that follow belong to this table."""
        keys, leaf = only_path(parsed)
        table: Any = self.data
        path: KeyPath = ()
        for count, key in enumerate(keys, start=1):
            new = leaf if count == len(keys) else {}  # [{}] for a header in double brackets
            path = (*path, key)
            table = table.setdefault(key, type(new)())
            if new is leaf and {type(table), type(leaf)} == {dict, list}:
                self._report_twice(path, line, f"has both headers [{key_text(path)}] and [[{key_text(path)}]]")
                return None, path
            if isinstance(table, list) and isinstance(new, list):
                self.lines.setdefault(path, line)
                table += new
            if isinstance(table, list) and table:
                path = (*path, len(table) - 1)
                table = table[-1]
            if not isinstance(table, dict):
                self._report_twice(path, line)
                return None, path
        self._repeated = path in self.lines
        if self._repeated:
            self._report_twice(path, line)
        self.lines.setdefault(path, line)
        return table, path

    def _add(self, table: dict[str, Any], path: KeyPath, parsed: dict[str, object], line: int) -> None:
        for key, value in parsed.items():
            here = (*path, key)
            if isinstance(value, dict) and isinstance(table.setdefault(key, {}), dict):
                self.lines.setdefault(here, line)
                self._add(table[key], here, value, line)
            elif key not in table:
                table[key] = value
                self.lines.setdefault(here, line)
            elif not self._repeated:  # otherwise its table was reported
                self._report_twice(here, line)

    def _report_twice(self, path: KeyPath, line: int, what: str = "is given twice") -> None:
        first = innermost(self.lines, path, 0)
        what += f", first in line {first}" if first else ""
        self.problems.append(Problem(path, what, "keep one of the two", self._source, line))


def parse(text: str, source: str = "", line: int = 1) -> dict[str, Any]:
    """The data of a text, given or stored, that begins in a line of a file; raises `CaseError`."""
    split(text, source)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise unfit(
            "is nested too deep", "case files hold no list or table of more than two levels", source, line
        ) from None
    except (ValueError, OverflowError) as error:
        # Beside its own error, tomllib lets through those of int() (too many digits) and of dates.
        message = str(error)
        below = 0
        if position := _POSITION.search(message):
            message = message[: position.start()]
            below = int(position[1] or 1) - 1
        shown = printable(text.split("\n")[below].strip())
        raise unfit(
            f"is not valid TOML: {message[0].lower()}{message[1:]}" + (f" (found {shown})" if shown else ""),
            WRITING,
            source,
            line + below,
        ) from None
