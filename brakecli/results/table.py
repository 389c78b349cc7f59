"""A text file of columns of numbers: their names, their units, their values.

A unit stands in a second line of names, in brackets behind a name, `height (mm)`, or at its end, `height_mm`.
Whatever is wrong in the file is an UnreadableResultError.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache
from io import BytesIO, TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError, UsageError, printable
from brakecli.faces import argument
from brakecli.results.opening import contents

Array = NDArray[Any]

_COMMENTS = ("#", "%")
LARGEST = 500_000_000  # bytes of a file of measured numbers
_HEAD = 1 << 16  # bytes of a text file from which its layout is found
_QUOTED = re.compile(r'"[^"]*"')
_COMMA = re.compile(r"[+-]?(?:[0-9]+,[0-9]*|,[0-9]+)(?:[eE][+-]?[0-9]+)?")
_GROUPED = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
_COMMENT = re.compile(r"[#%].*")
_ONE = r"[^\W\d_]+|[°%]"  # name of a unit
_POWER = r"(?:\^?-?\d|⁻?[¹²³])?"  # bounded
_UNIT = rf"(?:{_ONE}){_POWER}(?:(?: *[*·⋅/] *| +)(?:{_ONE}){_POWER})*"


def require(good: object, problem: str) -> None:
    """Raise UnreadableResultError unless all is good."""
    if not good:
        raise UnreadableResultError(problem)


def ordinal(text: str) -> int:
    """The number of a column, from 1, that a text names; 0 where it names none."""
    return int(text) if text.isascii() and text.isdigit() and len(text) <= 9 else 0  # no file has more


class TextTable:
    """A text file of columns. Its first lines show separator, decimal sign and header."""

    def __init__(self, path: Path, wanted: str = "a CSV file") -> None:
        """Read the file, and its first lines; the numbers are found when they are asked for."""
        self._data = contents(path, LARGEST)
        head = self._data[:_HEAD]
        require(head.strip() != b"", "the file is empty; name a file with numbers")
        require(b"\0" not in head, f"this is not text; name {wanted}")
        try:
            self._data.decode()
            self._encoding = "utf-8-sig"
        except UnicodeDecodeError:
            self._encoding = "latin-1"
        lines = [*TextIOWrapper(BytesIO(head), encoding=self._encoding, errors="replace")]
        lines = lines[:-1] if len(head) == _HEAD and len(lines) > 1 else lines
        self.names: list[str] = []
        self.units: list[str] = []  # as they are written in a line of their own
        self.header: list[str] = []  # the lines before the numbers
        self.places: list[int] = []  # the columns that were read last
        for self.skip, line in enumerate(lines):
            if line.strip() and not line.lstrip().startswith(_COMMENTS):
                bare = _QUOTED.sub("", line)
                self.separator = next((s for s in (";", "\t", ",") if s in bare), None)  # None: white space
                cells = self._cells(_COMMENT.sub("", line))
                comma = any(map(_COMMA.fullmatch, cells))
                numbers = [_number(cell, decimal_comma=comma) for cell in cells]
                if any(cells) and None not in numbers:
                    self.columns = len(cells)
                    self._find_sign(lines[self.skip : self.skip + 100])
                    self._name()
                    return
            self.header.append(line)
        raise UnreadableResultError("no line of numbers was found at its start; name a file of columns of numbers")

    def _cells(self, line: str) -> list[str]:
        return [cell.strip() for row in self._rows(iter([line.lstrip("#% ")])) for cell in row]

    def _rows(self, lines: Iterator[str]) -> Iterator[list[str]]:
        """The cells of lines; none of an empty line."""
        if self.separator is None:
            yield from ([cell.strip('"') for cell in line.split()] for line in lines)
            return
        reader = csv.reader(lines, delimiter=self.separator, skipinitialspace=True)
        line = self.skip
        try:
            for row in reader:
                line = self.skip + reader.line_num
                yield row
        except csv.Error as error:
            what = f"behind line {line}: {error}"
            raise UnreadableResultError(f"{what}; close what is quoted, and give every row a line") from error

    def _find_sign(self, lines: list[str]) -> None:
        """Find the decimal sign of the first lines of numbers."""
        cells = (cell for line in lines for cell in self._cells(_COMMENT.sub("", line)))
        commas = [cell for cell in cells if _COMMA.fullmatch(cell)]
        self.decimal_comma = bool(commas)
        parted = self.separator == "," and self.decimal_comma and all(map(_GROUPED.fullmatch, commas))
        what = f"commas in {commas[0] if commas else ''} may part thousands, or be decimal signs"
        require(not parted, f"line {self.skip + 1}: {what}; write numbers without them")

    def _name(self) -> None:
        """Take names and units of the last lines before the numbers that have a cell for each column."""
        bare = [line for line in self.header if line.strip() and not line.lstrip().startswith(_COMMENTS)]
        named = len(self._cells(bare[-1])) if bare and self.separator is not None else 1
        short = f"the line before the numbers has {named} cells, and line {self.skip + 1} has {self.columns}"
        require(named in (1, self.columns), f"{short}; give both the same, or begin the former with #")
        fitting = [(line, cells) for line in self.header if len(cells := self._cells(line)) == self.columns]
        rows = [cells for line, cells in fitting if not line.lstrip().startswith(_COMMENTS)]
        rows = (rows or [cells for _, cells in fitting])[-2:]
        has_units = len(rows) == 2 and any(si(cell.strip("[]()")) for cell in rows[1])
        self.names = rows[0 if has_units else -1] if rows else []
        self.units = [cell.strip("[]()") for cell in rows[1]] if has_units else []

    def numbers(self) -> list[Array]:
        """All columns."""
        return self._read(list(range(self.columns)))

    def columns_of(self, column: str | None, time_column: str | None) -> list[Array]:
        """The chosen column, and the times where they are in a column."""
        there = ", ".join(self.names) or f"columns 1 to {self.columns}, without names"
        times = [] if time_column is None else [self._index(time_column, argument("time-column"), there)]
        others = [i for i in range(self.columns) if i not in times]
        values = others if column is None else [self._index(column, argument("column"), there)]
        if len(values) != 1:
            raise UsageError(f"which column is the signal? give {argument('column')}; there are {there}")
        self.places = chosen = [*values, *times]
        return self._read(chosen)

    def _index(self, wanted: str, option: str, there: str) -> int:
        """Place of a column; a name comes before a number, and need not have its unit in brackets."""
        without = [re.sub(r"\s*[(\[][^()\[\]]+[)\]]$", "", name) for name in self.names]
        names = self.names if wanted in self.names else without
        if names.count(wanted) > 1:
            raise UsageError(f"{option}: several columns are named {wanted}; give its number, from 1")
        if wanted in names:
            return names.index(wanted)
        number = ordinal(wanted)
        none = f"{option}: there is no column {printable(wanted)}; there are {there}"
        require(1 <= number <= self.columns, none)
        return number - 1

    def unit(self, column: int, *wanted: str) -> tuple[float, str] | None:
        """The unit of a column, from 0: its size in SI and which of these SI units that is; None without one.

        Raises UnreadableResultError for another unit, and for two that contradict each other.
        """
        name = self.names[column] if self.names else ""
        end = name.rpartition("_")[2] if "_" in name else ""
        texts = [*self.units[column : column + 1], *re.findall(r"[(\[]([^()\[\]]+)[)\]]", name)[-1:]]
        texts += (  # the end of `force_x` or `height_a` need not be a unit, nor a name like `h`
            text
            for text in (end, name)
            if (size := si(text)) and (size[1] in wanted or (text == end and (len(text) > 1 or text in "NV")))
        )
        sizes = {text.strip(): si(text.strip()) for text in texts if text.strip() not in ("", "-", "1")}
        for text, base in sizes.items():
            require(base, f"column {name}: there is no unit {printable(text)}; give one as in mm, um or m/s^2")
            if base and base[1] not in wanted:
                what = f"column {name}: {printable(text)} is {base[1]}, not {' or '.join(wanted)}"
                raise UnreadableResultError(f"{what}; correct the unit, or name the column otherwise")
        require(len({*sizes.values()}) < 2, f"column {name}: has the units {' and '.join(sizes)}; keep one")
        return next(iter(sizes.values()), None)

    def _read(self, columns: list[int]) -> list[Array]:
        """Some columns; every row is as long as the first one, and each cell holds a number, nothing or nan."""
        rows = self._rows(self._lines())
        line = self.skip
        columns_of_blocks = [list[Array]() for _ in columns]
        while some := list(islice(rows, 10_000)):
            places: Sequence[int] = range(line + 1, line + 1 + len(some))
            line += len(some)
            if {*map(len, some)} != {self.columns} or self.columns == 1:
                places = [
                    number for number, row in zip(places, some, strict=True) if not self._is_blank(row, number)
                ]
                some = [some[number - line - 1] for number in places]  # from behind
            for blocks, column in zip(columns_of_blocks, columns, strict=True):
                blocks.append(self._column([row[column] for row in some], column, places))
        return [np.concatenate(blocks) for blocks in columns_of_blocks]

    def _is_blank(self, row: list[str], line: int) -> bool:
        """Whether a row is an empty line; raises UnreadableResultError for one that is shorter or longer."""
        if len(row) < 2 and not "".join(row).strip():
            return True
        what = f"line {line}: has {len(row)} cells, and the first line of numbers {self.columns}"
        require(len(row) == self.columns, f"{what}; give every row the same columns")
        return False

    def _column(self, cells: list[str], column: int, lines: Sequence[int]) -> Array:
        """The numbers of cells of a column, which stand in these lines."""
        if _is_plain("".join(cells)) and not self.decimal_comma:
            with suppress(ValueError):  # perhaps because of an empty cell
                return np.array([*map(float, cells)])
        numbers = list[float]()
        for line, cell in zip(lines, cells, strict=True):
            number = _number(cell, decimal_comma=self.decimal_comma)
            if number is None:
                what = f"line {line}, column {column + 1}: is no number (found {printable(cell.strip())!r})"
                sign = ", with the decimal comma that others have" * self.decimal_comma
                raise UnreadableResultError(f"{what}; give every cell a number{sign}, nothing or nan")
            numbers.append(number)
        return np.array(numbers)

    def _lines(self) -> Iterator[str]:
        """The lines from the first numbers on, without comments."""
        lines = islice(TextIOWrapper(BytesIO(self._data), encoding=self._encoding), self.skip, None)
        if any(sign.encode() in self._data for sign in _COMMENTS):
            return (_COMMENT.sub("", line) for line in lines)
        return lines


def _is_plain(text: str) -> bool:
    """Whether no character is there that Python takes for a part of a number, and nobody else."""
    return text.isascii() and "_" not in text


def _number(cell: str, *, decimal_comma: bool) -> float | None:
    """The number of a cell, NaN if it is empty, None if it is none; a file has one decimal sign."""
    text = cell.strip()
    if decimal_comma:
        text = "." if "." in text else text.replace(",", ".")
    if not _is_plain(text):
        return None
    try:
        return float(text or "nan")
    except ValueError:
        return None


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@cache
def si(unit: str) -> tuple[float, str] | None:
    """The size of a unit in SI, and that SI unit in words, such as meter or radian; None where there is none."""
    if len(unit) > 80 or not re.fullmatch(_UNIT, unit):  # pint would compute powers of powers
        return None
    registry = _registry()
    try:
        # Nm is a torque, and not the fineness of a yarn
        size, base = registry.get_base_units(registry.parse_units(re.sub(r"N(?=[cm]?m\b)", "N*", unit)))
    except Exception:  # whatever the parser meets
        return None
    return float(size), str(base)
