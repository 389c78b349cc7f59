"""How people read the values of a result: one way for terminal, Python and pages; each has its form of numbers."""

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from brakecli.files.field import Field, plain_units

_UNSAID = ("1", "of the key")  # units that no reader needs


@dataclass(frozen=True)
class Renderer:
    """What differs between faces: how a number is written with its unit, and what stands for nothing."""

    number: Callable[[Any, str], str]
    none: str = "-"
    most: int = sys.maxsize  # values of a list that are written
    each: bool = False  # whether each value of a list has its unit; otherwise the last one has

    def text(self, value: Any, units: str = "") -> str:
        """A value with its unit; lists and tables in one line."""
        units = "" if units in _UNSAID else plain_units(units)
        if isinstance(value, str) or value is None:
            return value or self.none
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, Mapping):
            return ", ".join(f"{name} {self.text(each)}" for name, each in value.items())
        if hasattr(value, "__len__"):
            more = f" … ({len(value)} values)" * (len(value) > self.most)
            texts = ", ".join(self.text(each, units * self.each) for each in value[: self.most])
            return f"{texts} {units * (not self.each)}".rstrip() + more if texts else self.none
        return self.number(value, units)

    def field(self, field: Field, value: Any) -> str:
        """The value of a declared field: yes or no, a part of the time, or a value with its unit."""
        if value is not None and field.is_flag:
            return self.text(bool(value))
        if value is not None and field.is_part_of_time:
            return f"{value:.2%} of the time"
        return self.text(value, field.units)

    def rows(self, known: Iterable[Field], values: Mapping[str, Any]) -> list[tuple[str, str, str]]:
        """Title, value and meaning of each field that has a value."""
        return [
            (each.title, self.field(each, values[each.name]), each.meaning.replace("`", "").replace(" (0, 1)", ""))
            for each in known
            if values.get(each.name) is not None
        ]


def _written(form: str, value: Any, units: str) -> str:
    return f"{value:{form}} {units}".rstrip()


TERMINAL = Renderer(partial(_written, ".6g"))


def text_of(value: Any, units: str = "", form: str = ".6g") -> str:
    """A value with its unit for the terminal, its numbers in some form."""
    return Renderer(partial(_written, form)).text(value, units)
