"""A sweep file's tables: the axes of the grid, and the critical parameter that is sought at each point."""

import sys
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from brakecli.case.read import key_path
from brakecli.case.tables import MISSING, Number, OverCase, Positive, Table, described, from_list
from brakecli.errors import Problem, found_text


def _not_key_paths(*texts: str) -> Iterator[Problem]:
    for text in texts:
        if not key_path(text):
            yield Problem(
                ("parameter",), "is not a key path" + found_text(text), 'write it as in "link2.angle_deg"'
            )


class Axis(Table):
    """One axis of the grid: the key paths that it sets, together, and the values that they take."""

    alternatives = (("start", "stop", "num"), ("values",))

    parameter: Annotated[
        tuple[str, ...],
        *from_list,
        BeforeValidator(lambda value: (value,) if isinstance(value, str) else value),
    ] = described(
        "key path of the case, or a list of key paths that take the same values",
        min_length=1,
        json_schema_extra={"type": ["string", "array"]},
    )
    start: Number | None = described("first value", None)
    stop: Number | None = described("last value", None)
    num: Annotated[int, Field(ge=1)] | None = described("number of values", None)
    spacing: Literal["linear", "log"] = described("how the values are spaced between the first and last", "linear")
    values: Annotated[tuple[Any, ...], Field(min_length=1), *from_list] | None = described(
        "the values themselves", None
    )
    direction: Literal["up", "down", "both"] | None = described(
        "follow the motion along this axis: each point starts from the end of the one before", None
    )

    @property
    def name(self) -> str:
        """The name of the dimension in the result: the first key path, its dots turned into underscores."""
        return self.parameter[0].replace(".", "_")

    @property
    def size(self) -> int:
        """How many values the axis has."""
        return len(self.values) if self.values is not None else self.num or 0

    @property
    def numeric(self) -> bool:
        """Whether there are numbers along it."""
        largest = sys.float_info.max  # a whole number may be larger, and is no float then
        return all(type(value) in (int, float) and -largest <= value <= largest for value in self.values or ())

    def value(self, index: int) -> Any:
        """The value at a place along the axis; both ends of a range are exact."""
        if self.values is not None:
            return self.values[index]
        assert self.start is not None
        assert self.stop is not None
        last = max(self.size - 1, 1)
        if index == last:
            return self.stop
        if self.spacing == "log":
            return self.start * (self.stop / self.start) ** (index / last)
        return self.start + index * (self.stop - self.start) / last

    def _broken_rules(self) -> Iterator[Problem]:
        yield from super()._broken_rules()
        yield from _not_key_paths(*self.parameter)
        if self.spacing == "log":
            if self.values is not None:
                yield self.wrong("spacing", "is only for start and stop", "leave spacing out")
            for key in ("start", "stop"):
                value = getattr(self, key)
                if value is not None and value <= 0.0:
                    yield self.wrong(key, "is not above 0", "a logarithmic axis needs values above 0")
        if self.direction is not None and not self.numeric:
            yield self.wrong("direction", "needs numbers to follow", "leave it out")


class Critical(Table):
    """The parameter whose critical value is sought: the least at which steady sliding loses its stability."""

    parameter: str = described("key path of the case, such as friction.coefficient")
    lower: Number = described("where the search begins")
    upper: Number = described("where the search ends")
    tolerance: Positive = described("width of the bracket of the least value from the own start", 1e-3)
    method: Literal["simulation", "eigenvalue"] = described(
        "by branches and runs, or only by eigenvalues", "simulation"
    )

    def _broken_rules(self) -> Iterator[Problem]:
        if self.upper <= self.lower:
            yield self.wrong("upper", "is not above lower", "give a range to search in")
        elif self.tolerance < 1e-12 * max(abs(self.lower), abs(self.upper)):  # eigenvalues tell no less apart
            yield self.wrong("tolerance", "is below the rounding of the parameter", "widen it")
        yield from _not_key_paths(self.parameter)


class Sweep(OverCase):
    """A grid of cases around a base case, and what to find at each of them."""

    axis: Annotated[tuple[Axis, ...], *from_list] = described("the axes of the grid; the last varies fastest", ())
    points: str | None = described(
        "a table of points in place of axes, .csv, seen from the sweep's own file: a column for each key path",
        None,
    )
    critical: Critical | None = described("the critical parameter to find at each point", None)

    def _broken_rules(self) -> Iterator[Problem]:
        if not self.axis and self.critical is None and self.points is None:
            remedy = "give at least one [[axis]], points, or [critical]"
            yield Problem(("axis",), MISSING, remedy, instead=("points", "critical"))
        if self.axis and self.points is not None:
            yield self.wrong("points", "is given together with [[axis]]", "keep one of the two")
        taken: set[tuple[str, ...]] = set()
        for index, text in ((index, text) for index, axis in enumerate(self.axis) for text in axis.parameter):
            if key_path(text) in taken:
                path = ("axis", index, "parameter")
                yield Problem(path, "is set twice" + found_text(text), "set each key path once")
            taken.add(key_path(text))
        if self.critical is not None and key_path(self.critical.parameter) in taken:
            remedy = "look for another parameter, or leave that axis out"
            yield self.wrong("critical.parameter", "is set by an axis", remedy)
        followed = [("axis", index, "direction") for index, axis in enumerate(self.axis) if axis.direction]
        for path in followed[1:]:
            yield Problem(path, "is given twice", "follow the motion along one axis alone")
        if followed and self.critical is not None:
            yield Problem(followed[0], "is given together with [critical]", "keep one of the two")
