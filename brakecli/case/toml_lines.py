"""TOML with line numbers: what a text says, in which line each key stands, and everything that is wrong with it.

`tomllib` decides what is valid, but it gives no lines and stops at the first error. So the text is also split
into its statements, and where something is wrong each of them is parsed by itself.
"""

import json
import re
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

KeyPath = tuple[str | int, ...]

LARGEST_TEXT = 500_000
"""Most bytes of a file; with the limits below, whatever is wrong is told within half a second."""
MOST_PARTS = 32
"""Most parts of a dotted key: the time that tomllib takes grows with their square."""
MOST_STATEMENTS = 1000
"""Most keys and table headers of a file: the time to tell what is wrong grows with them."""
MOST_MARKS = 50_000
"""Most commas, brackets and signs of equality outside texts, and so most entries of all lists together."""

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\\?\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:\\[^\n]|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|#[^\n]*(?:\n[ \t\n]*#[^\n]*)*"
    r"|\n[ \t\n]*"
    r"|[\[\]{}.,=]",
    re.DOTALL,
)
_HEADER = re.compile(r"[ \t]*\[")
_NOTHING = re.compile(r"[ \t\n]*(#.*)?", re.DOTALL)
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_POSITION = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")

WRITING = "numbers are written 1.5 or 2e-3, texts in quotes, lists as [1, 2], table headers as [table]"
"""The remedy for what is not TOML."""


class Statement(NamedTuple):
    """A table header or a key with its value, and the line where it begins."""

    line: int
    text: str


class Finding(NamedTuple):
    """Something wrong with a text, before it is known which file the text is from; line 0 is the whole text."""

    line: int
    key: KeyPath
    what: str
    remedy: str


class UnfitTextError(Exception):
    """The text is nothing that should be given to tomllib."""

    def __init__(self, finding: Finding) -> None:
        """Hold what is wrong with the text."""
        super().__init__(finding.what)
        self.finding = finding


def too_large() -> Finding:
    """What is wrong with a text of more than `LARGEST_TEXT` bytes."""
    return Finding(0, (), f"is larger than {LARGEST_TEXT} bytes", "give a shorter file")


def _unfit(line: int, what: str, remedy: str) -> UnfitTextError:
    return UnfitTextError(Finding(line, (), what, remedy))


def split(text: str) -> list[Statement]:
    """The statements of a text, be they valid or not. Raises `UnfitTextError`."""
    if len(text) > LARGEST_TEXT:
        raise UnfitTextError(too_large())
    if text.startswith("\ufeff"):
        raise _unfit(1, "begins with a byte order mark", "save the file as UTF-8 without one")
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise _unfit(line, "holds a NUL character", "save the file as UTF-8 text, not as UTF-16")
    statements = []
    start, line, first, depth, dots, marks = 0, 1, 1, 0, 0, 0
    in_header = _HEADER.match(text)
    text = text.replace("\r\n", "\n") + "\n"
    for token in _TOKEN.finditer(text):
        mark = token[0]
        if mark == ".":
            dots += 1
            if dots == MOST_PARTS:
                raise _unfit(line, f"a key has more than {MOST_PARTS} parts", "shorten the key")
            continue
        if mark[0] in "[]{},=\n":
            dots = 0
            depth += (mark in "[{") - (mark in "]}")
            marks += mark[0] != "\n"
            if marks > MOST_MARKS:
                what = f"there are more than {MOST_MARKS} commas and brackets"
                raise _unfit(line, what, "give shorter lists")
        line += mark.count("\n")
        if mark[0] == "\n" and (depth <= 0 or in_header):
            statements.append(Statement(first, text[start : token.start()]))
            start, first, depth = token.end(), line, 0
            in_header = _HEADER.match(text, start)
    statements.append(Statement(first, text[start:]))
    statements = [statement for statement in statements if not _NOTHING.fullmatch(statement.text)]
    if len(statements) > MOST_STATEMENTS:
        line = statements[MOST_STATEMENTS].line
        raise _unfit(line, f"there are more than {MOST_STATEMENTS} keys", "give a shorter file")
    return statements


class Located:
    """What can be read of a text: its data, the line of each key, and what is wrong with the rest."""

    def __init__(self, statements: Sequence[Statement]) -> None:
        """Parse statement after statement."""
        self.data: dict[str, Any] = {}
        self.lines: dict[KeyPath, int] = {}
        self.findings: list[Finding] = []
        self._table: dict[str, Any] | None = self.data
        self._path: KeyPath = ()
        for statement in statements:
            is_header = _HEADER.match(statement.text)
            parsed = parse(statement.text, statement.line)
            if isinstance(parsed, Finding):
                self.findings.append(parsed)
                if is_header:
                    self._table = None  # nobody knows whose keys come next
            elif is_header:
                self._enter(parsed, statement.line)
            elif self._table is not None:
                self._add(self._table, self._path, parsed, statement.line)

    def _enter(self, parsed: dict[str, Any], line: int) -> None:
        """Let the keys that follow belong to the table of a header, given as what tomllib makes of it."""
        table, rest = self.data, parsed
        path: KeyPath = ()
        while rest:
            ((key, rest),) = rest.items()
            path = (*path, key)
            inner = table.setdefault(key, [] if isinstance(rest, list) else {})
            if isinstance(rest, list) and isinstance(inner, list):
                self.lines.setdefault(path, line)
                inner.append({})
                rest = {}
            if isinstance(inner, list) and inner:
                path = (*path, len(inner) - 1)
                inner = inner[-1]
            if not isinstance(inner, dict):
                self._twice(path, line)
                self._table = None
                return
            table = inner
        if path in self.lines:
            self._twice(path, line)
        self.lines.setdefault(path, line)
        self._table, self._path = table, path

    def _add(self, table: dict[str, Any], path: KeyPath, parsed: dict[str, Any], line: int) -> None:
        for key, value in parsed.items():
            here = (*path, key)
            held = table.get(key)
            if isinstance(held, dict) and isinstance(value, dict):
                self.lines.setdefault(here, line)
                self._add(held, here, value, line)
            elif key in table:
                self._twice(here, line)
            else:
                table[key] = value
                self._note(here, value, line)

    def _note(self, path: KeyPath, value: object, line: int) -> None:
        self.lines.setdefault(path, line)
        if isinstance(value, dict):
            for key, inner in value.items():
                self._note((*path, key), inner, line)

    def _twice(self, path: KeyPath, line: int) -> None:
        first = next((self.lines[path[:end]] for end in range(len(path), 0, -1) if path[:end] in self.lines), None)
        what = "is given twice" + (f", first in line {first}" if first else "")
        self.findings.append(Finding(line, path, what, "keep one of the two"))


def parse(text: str, line: int = 1) -> dict[str, Any] | Finding:
    """The data of a text that begins in a line of a file, or what is wrong with it."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        return Finding(line, (), "is nested too deep", "case files hold no list or table of more than two levels")
    except (ValueError, OverflowError) as error:
        # Beside its own error, tomllib lets through those of int() (too many digits) and of dates.
        message = str(error)
        position = _POSITION.search(message)
        if position:
            message = message[: position.start()]
            line += int(position[1] or 1) - 1
        found = text.split("\n")[int(position[1] or 1) - 1 if position else 0].strip()
        return Finding(
            line,
            (),
            f"is not valid TOML: {message[0].lower()}{message[1:]} (found {printable(found)})",
            WRITING,
        )


def key_text(path: KeyPath) -> str:
    """A key path as it is written in TOML, places in a list in brackets: `roughness.wheel.amplitudes[2]`."""
    parts = (
        f"[{part}]"
        if isinstance(part, int)
        else "." + (part if _BARE_KEY.fullmatch(part) else json.dumps(part, ensure_ascii=False))
        for part in path
    )
    return printable("".join(parts).removeprefix("."))


def value_text(value: object) -> str:
    """A value as it is written in TOML, shortened to fit into a message."""
    return printable("".join(_written(value)))


def _written(value: object) -> Iterator[str]:
    match value:
        case bool():
            yield str(value).lower()
        case str():
            yield json.dumps(value[:80], ensure_ascii=False)
        case int() if value.bit_length() > 250:
            yield "an integer of more than 75 digits"
        case dict():
            yield "a table"
        case list() | tuple():
            shown = ", ".join("[…]" if isinstance(each, list) else value_text(each) for each in value[:5])
            yield f"[{shown}{', …' if len(value) > 5 else ''}]"
        case _:
            yield str(value)


def printable(text: str) -> str:
    """A text in one line of at most 80 characters that a terminal shows as they are."""
    text = text if len(text) <= 80 else text[:79] + "…"
    return "".join(char if char.isprintable() else f"\\u{ord(char):04x}" for char in text)
