"""How people read the values of a result: one way for terminal, Python and pages; each has its form of numbers."""

import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import SupportsFloat

import numpy as np

from brakecli.results.field import Field, plain_units

_UNSAID = ("1", "of the key")  # units that no reader needs


@dataclass(frozen=True)
class Renderer:
    """What differs between faces: how a number is written with its unit, and what stands for nothing."""

    number: Callable[[SupportsFloat, str], str]
    none: str = "-"
    most: int = sys.maxsize  # values of a list that are written
    units_each: bool = False  # whether each value of a list has its unit; otherwise the last one has

    def text(self, value: object, units: str = "") -> str:
        """A value with its unit; lists and tables in one line."""
        units = "" if units in _UNSAID else plain_units(units)
        if isinstance(value, str) or value is None:
            return value or self.none
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, Mapping):
            return ", ".join(f"{name} {self.text(item)}" for name, item in value.items())
        if isinstance(value, Sequence | np.ndarray):
            more = f" … ({len(value)} values)" * (len(value) > self.most)
            texts = ", ".join(self.text(item, units * self.units_each) for item in value[: self.most])
            return f"{texts} {units * (not self.units_each)}".rstrip() + more if texts else self.none
        assert isinstance(value, SupportsFloat)
        return self.number(value, units)

    def field(self, field: Field, value: object) -> str:
        """The value of a declared field: yes or no, a part of the time, or a value with its unit."""
        if value is not None and field.is_flag:
            return self.text(bool(value))
        if field.is_part_of_time and isinstance(value, SupportsFloat):
            return f"{100.0 * float(value):.3g} % of the time"
        return self.text(value, field.units)

    def with_error(self, value: float | None, error: float | None, units: str = "") -> str:
        """A value with its error, where that can be seen; two digits of the error tell those of the value."""
        if value is None or not error or not error > 5e-4 * abs(value):  # half a unit of the last digit of 1.000
            return self.text(value, units)
        factor, unit = prefixed(max(abs(value), error), units)
        places = max(0, 1 - math.floor(math.log10(factor * error)))
        return f"{factor * value:.{places}f} ± {factor * error:.{places}f} {unit}".rstrip()

    def rows(self, fields: Iterable[Field], values: Mapping[str, object]) -> list[tuple[str, str, str]]:
        """Title, value and meaning of each field that has a value."""
        return [
            (f.title, self.field(f, values[f.name]), f.meaning.replace("`", "").replace(" (0, 1)", ""))
            for f in fields
            if values.get(f.name) is not None
        ]


def prefixed(magnitude: float, unit: str) -> tuple[float, str]:
    """The factor for values up to this magnitude that makes them easy to read, and the unit with its SI prefix.

    Prefixes are those that engineers use: no km/s, kHz from ten of them on, none for angles and pure numbers.
    """
    large = (unit == "Hz" and magnitude >= 1e4) or unit[:1] in "NJWP"
    small = unit in ("m", "m/s", "m/s²", "s") or unit[:1] in "NJWP"
    for exponent, prefix in ((9, "G"), (6, "M"), (3, "k"), (0, ""), (-3, "m"), (-6, "µ"), (-9, "n"), (-12, "p")):
        wanted = unit and (large if exponent > 0 else small or exponent == 0)
        if wanted and 10.0**exponent <= magnitude < 1e12:
            return 10.0**-exponent, prefix + unit
    return 1.0, unit


def _prefixed_text(digits: int, value: SupportsFloat, units: str) -> str:
    if isinstance(value, int):
        return f"{value} {units}".rstrip()
    factor, units = prefixed(abs(float(value)), units)
    return f"{factor * float(value) + 0.0:.{digits}g} {units}".rstrip()


def _written(form: str, value: SupportsFloat, units: str) -> str:
    return f"{value:{form}} {units}".rstrip()


TERMINAL = Renderer(partial(_prefixed_text, 4), units_each=True)
"""Four digits: the numbers of a brake are known to per cents."""
EXACT = Renderer(partial(_prefixed_text, 7), units_each=True)
"""What a terminal writes where all is asked for."""


def text_of(value: object, units: str = "", form: str = ".6g") -> str:
    """A value with its unit, its numbers in some form."""
    return Renderer(partial(_written, form)).text(value, units)
