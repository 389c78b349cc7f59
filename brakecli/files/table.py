"""A text file of columns of numbers: their names, their units, their values.

A unit stands in a second line of names, in brackets behind a name, `height (mm)`, or at its end, `height_mm`.
Whatever is wrong in the file is an UnreadableResultError.
"""

import re
import warnings
from collections.abc import Iterable
from contextlib import suppress
from functools import cache, partial
from io import BytesIO, TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError, UsageError, printable
from brakecli.faces import argument
from brakecli.files.opening import contents

Array = NDArray[Any]

_COMMENTS = ("#", "%")
LARGEST = 500_000_000  # bytes of a file of measured numbers
_HEAD = 1 << 16  # bytes of a text file from which its layout is found
_ONE = r"[^\W\d_]+|[°%]"  # name of a unit
_LONGEST = 80  # characters of a unit
_POWER = r"(?:\^?-?\d|⁻?[¹²³])?"  # bounded
_UNIT = rf"(?:{_ONE}){_POWER}(?:(?: *[*·⋅/] *| +)(?:{_ONE}){_POWER})*"


def require(good: Any, problem: str) -> None:
    """Raise UnreadableResultError unless all is good."""
    if not good:
        raise UnreadableResultError(problem)


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
        lines = head.decode(self._encoding, errors="replace").splitlines()
        lines = lines[:-1] if len(head) == _HEAD and len(lines) > 1 else lines
        self.names: list[str] = []
        self.units: list[str] = []  # as they are written in a line of their own
        self.header: list[str] = []  # the lines before the numbers
        self.places: list[int] = []  # the columns that were read last
        for self.skip, line in enumerate(lines):
            if not line.strip() or line.lstrip().startswith(_COMMENTS):
                self.header.append(line)
                continue
            self.separator = next((s for s in (";", "\t", ",") if s in line), None)  # None: white space
            self.decimal_comma = self.separator != "," and "," in line
            cells = self._cells(line)
            numbers = [_is_number(cell, self.decimal_comma) for cell in cells]
            self.columns = len(cells)
            if any(numbers) and all(good or not cell for good, cell in zip(numbers, cells, strict=True)):
                near = lines[self.skip : self.skip + 100]
                self.decimal_comma |= self.separator != "," and any("," in text for text in near)
                self._name()
                return
            self.header.append(line)
        raise UnreadableResultError("no line of numbers was found at its start; name a file of columns of numbers")

    def _cells(self, line: str) -> list[str]:
        return [cell.strip().strip('"') for cell in line.lstrip("#% ").split(self.separator)]

    def _name(self) -> None:
        """Take names and units of the last lines before the numbers that have a cell for each column."""
        fitting = [(line, cells) for line in self.header if len(cells := self._cells(line)) == self.columns]
        rows = [cells for line, cells in fitting if not line.lstrip().startswith(_COMMENTS)]
        rows = (rows or [cells for _, cells in fitting])[-2:]
        has_units = len(rows) == 2 and any(si(cell.strip("[]()")) for cell in rows[1])
        self.names = rows[0 if has_units else -1] if rows else []
        self.units = [cell.strip("[]()") for cell in rows[1]] if has_units else []

    def numbers(self) -> list[Array]:
        """All columns."""
        return list(self._read(list(range(self.columns))).T)

    def columns_of(self, column: str | None, time_column: str | None) -> list[Array]:
        """The chosen column, and the times where they are in a column."""
        there = ", ".join(self.names) or f"columns 1 to {self.columns}, without names"
        times = [] if time_column is None else [self._index(time_column, argument("time-column"), there)]
        others = [i for i in range(self.columns) if i not in times]
        values = others if column is None else [self._index(column, argument("column"), there)]
        if len(values) != 1:
            raise UsageError(f"which column is the signal? give {argument('column')}; there are {there}")
        self.places = chosen = [*values, *times]
        last = self.columns - 1
        table = self._read(chosen if last in chosen else [*chosen, last])  # the last shows that rows are whole
        return list(table.T[: len(chosen)])

    def _index(self, wanted: str, option: str, there: str) -> int:
        """Place of a column; a name comes before a number, and need not have its unit in brackets."""
        without = [re.sub(r"\s*[(\[][^()\[\]]+[)\]]$", "", name) for name in self.names]
        names = self.names if wanted in self.names else without
        if names.count(wanted) > 1:
            raise UsageError(f"{option}: several columns are named {wanted}; give its number, from 1")
        if wanted in names:
            return names.index(wanted)
        number = int(wanted) if wanted.isascii() and wanted.isdigit() else 0
        require(1 <= number <= self.columns, f"{option}: there is no column {wanted}; there are {there}")
        return number - 1

    def unit(self, column: int, *wanted: str) -> tuple[float, str] | None:
        """The unit of a column, from 0: its size in SI and which of these SI units that is; None without one.

        Raises UnreadableResultError for another unit, and for two that contradict each other.
        """
        name = self.names[column] if self.names else ""
        end = name.rpartition("_")[2] if "_" in name else ""
        given = [*self.units[column : column + 1], *re.findall(r"[(\[]([^()\[\]]+)[)\]]", name)[-1:]]
        given += (  # the end of `force_x` or `height_a` need not be a unit, nor a name like `h`
            text
            for text in (end, name)
            if (size := si(text)) and (size[1] in wanted or (text == end and (len(text) > 1 or text in "NV")))
        )
        known = {text.strip(): si(text.strip()) for text in given if text.strip() not in ("", "-", "1")}
        for text, base in known.items():
            require(base, f"column {name}: there is no unit {printable(text)}; give one as in mm, um or m/s^2")
            if base and base[1] not in wanted:
                what = f"column {name}: {printable(text)} is {base[1]}, not {' or '.join(wanted)}"
                raise UnreadableResultError(f"{what}; correct the unit, or name the column otherwise")
        require(len({*known.values()}) < 2, f"column {name}: has the units {' and '.join(known)}; keep one")
        return next(iter(known.values()), None)

    def _read(self, columns: list[int]) -> Array:
        """Some columns, by numpy's own reader; empty cells and decimal commas take it longer."""
        load = partial(np.loadtxt, comments=_COMMENTS, delimiter=self.separator, usecols=columns, ndmin=2)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if not self.decimal_comma:
                with suppress(ValueError, IndexError):  # perhaps because of an empty cell
                    return load(self._lines())
            lines = (line.replace(",", ".") for line in self._lines()) if self.decimal_comma else self._lines()
            try:
                return load(lines, converters=lambda cell: float(cell.strip().strip('"') or "nan"))
            except (ValueError, IndexError) as error:
                what = f"from line {self.skip + 1} on: {' '.join(str(error).split())}"
                remedy = "give every row the same columns, and every cell a number, nothing or nan"
                raise UnreadableResultError(f"{what}; {remedy}") from error

    def _lines(self) -> Iterable[str]:
        """The lines from the first numbers on."""
        return islice(TextIOWrapper(BytesIO(self._data), encoding=self._encoding), self.skip, None)


def _is_number(cell: str, decimal_comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return False
    return True


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@cache
def si(unit: str) -> tuple[float, str] | None:
    """The size of a unit in SI, and that SI unit in words, such as meter or radian; None where there is none."""
    if len(unit) > _LONGEST or not re.fullmatch(_UNIT, unit):  # pint would compute powers of powers
        return None
    registry = _registry()
    try:
        # Nm is a torque, and not the fineness of a yarn
        size, base = registry.get_base_units(registry.parse_units(re.sub(r"N(?=[cm]?m\b)", "N*", unit)))
    except Exception:  # whatever the parser meets
        return None
    return float(size), str(base)
