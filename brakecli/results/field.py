"""How a number or text of a result is declared and read; `brakecli.results.fields` declares them all."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

LARGEST = 1e150
"""Magnitude of numbers that say something: the squares of larger ones overflow. What is beyond it is missing."""
LARGEST_SQUARE = 1e300
"""Magnitude in variables that hold squares, as spectra do."""


@dataclass(frozen=True)
class Field:
    """A number or text of a result, or an object that holds several."""

    name: str
    units: str  # in SI; `1` for pure numbers, empty for texts
    meaning: str
    kind: str = "f8"  # the NumPy type of many; a float may be missing: null in JSON, `_FillValue` in a file
    at: str = ""  # attributes, keys and methods on the way to the value; ends with the name if empty or with a dot
    label: str = ""  # words for the terminal; the name if empty
    missing: object = None  # what stands for a value that does not exist
    in_file: bool = True  # what changes from one run of the same case to the next stays outside
    group: str = ""  # of the file, whose attributes hold the items of an object
    rising: bool = False  # whether it is an axis whose numbers increase, none of them missing
    rows: "tuple[Field, ...]" = ()  # the items of an object, or of each object in a list

    @property
    def title(self) -> str:
        """The words for the terminal."""
        return self.label or self.name.replace("_", " ")

    @property
    def is_flag(self) -> bool:
        """Whether its number means yes or no."""
        return "(0, 1)" in self.meaning

    @property
    def is_list(self) -> bool:
        """Whether a file holds it as a list."""
        return self.kind == "O" and not self.rows

    @property
    def is_part_of_time(self) -> bool:
        """Whether it is a part of the time, which people read in per cent."""
        return self.meaning.startswith("part of the time")

    @cached_property
    def _path(self) -> list[str]:
        return (self.at + self.name if self.at[-1:] in ("", ".") else self.at).split(".")

    def read(self, report: object) -> Any:
        """The value that a report holds, as JSON and files hold it."""
        value: Any = report
        for step in self._path:
            if value is not None:
                value = value[step] if isinstance(value, dict) else getattr(value, step)
                value = value() if callable(value) else value
        if not self.rows and self.kind != "i8":
            value = plain(value)
        if value is None:
            return self.missing
        if self.rows and isinstance(value, list | tuple):
            return [values_of(self.rows, item) for item in value]
        if self.rows:
            return values_of(self.rows, value)
        return int(value) if self.kind == "i8" else value


def labelled(name: str, units: str) -> str:
    """A name and its unit in brackets, if there is one."""
    return f"{name} ({units})" if units not in ("", "1") else name


def plain_units(units: str) -> str:
    """A unit of a file as people write it: `N^2/Hz` and `(m/s)^2/Hz` for `(N)2 Hz-1` and `(m/s)2 Hz-1`."""
    units = re.sub(r"^\(([^/ ]*)\)2 Hz-1", r"\1^2/Hz", units).replace("2 Hz-1", "^2/Hz")
    return units.replace("1^2/Hz", "1/Hz")


def integer(name: str, meaning: str, at: str = "", *, missing: object = None, in_file: bool = True) -> Field:
    """A field of a whole number, which has no unit."""
    return Field(name, "1", meaning, "i8", at, missing=missing, in_file=in_file)


def ratio(name: str, meaning: str, at: str = "", *, label: str = "", in_file: bool = True) -> Field:
    """A field of a real number without a unit."""
    return Field(name, "1", meaning, "f8", at, label, in_file=in_file)


def within(at: str, *fields: Field) -> tuple[Field, ...]:
    """The fields of a part of a report, which is found `at` the end of this path."""
    return tuple(replace(field, at=at + field.at) for field in fields)


def values_of(fields: Iterable[Field], report: object) -> dict[str, Any]:
    """Names and values as `--json` gives them; None stands for what does not exist."""
    return {field.name: field.read(report) for field in fields}


def named(fields: Iterable[Field], *names: str) -> tuple[Field, ...]:
    """The fields of these names, in this order."""
    by_name = {field.name: field for field in fields}
    return tuple(by_name[name] for name in names)


def flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The keys of nested tables, and of lists of tables, by their paths as `axis[0].values`."""
    inner: Any = value.items() if isinstance(value, dict) else ()
    if isinstance(value, list) and value and isinstance(value[0], dict):
        inner = ((f"[{index}]", item) for index, item in enumerate(value))
    if not inner:
        yield path, value
    for key, item in inner:
        yield from flat(item, path + key if key[0] == "[" else f"{path}.{key}".strip("."))


def plain(value: Any) -> Any:
    """A value as JSON holds it: enumerations are texts, complex numbers pairs, NaN in an array is None.

    So is a number that is too large to say anything. NaN alone stays, as a fault of whoever made it.
    """
    if type(value) is float or value is None:  # most of them
        return None if value is not None and abs(value) > LARGEST else value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "S":
            return np.char.decode(value, "utf-8").tolist()
        if value.dtype.kind == "f":
            value = np.where(np.abs(value) <= LARGEST, value.astype(object), np.array(None))
        return value.tolist()
    if is_dataclass(value):
        value = vars(value)
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, list | tuple) else value
