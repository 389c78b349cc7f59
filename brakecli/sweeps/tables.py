"""A sweep file's tables: the axes of the grid, and the critical parameter that is looked for at each point."""

import math
from collections.abc import Iterator
from enum import StrEnum
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field

from brakecli.case.read import key_path
from brakecli.case.tables import Broken, Number, Positive, Table, from_list, from_text


class Spacing(StrEnum):
    """How the values of an axis lie between its ends."""

    LINEAR = "linear"
    LOG = "log"


class Direction(StrEnum):
    """Whether each point of an axis starts from the end of the one before it, and which way that goes."""

    UP = "up"
    DOWN = "down"
    BOTH = "both"


class Method(StrEnum):
    """How a critical parameter is found: by the growth of small disturbances in runs, or by eigenvalues."""

    SIMULATION = "simulation"
    EIGENVALUE = "eigenvalue"


Values = Annotated[tuple[Any, ...], Field(min_length=1), *from_list]


def _one_is_a_list(value: Any) -> Any:
    return (value,) if isinstance(value, str) else value


class Axis(Table):
    """One axis of the grid: the key paths that it sets, together, and the values that they take."""

    alternatives: ClassVar[tuple[tuple[str, ...], ...]] = (("start", "stop", "num"), ("values",))

    parameter: Annotated[
        tuple[str, ...],
        Field(
            min_length=1,
            description="key path of the case, or a list of key paths that take the same values",
            json_schema_extra={"type": ["string", "array"]},
        ),
        *from_list,
        BeforeValidator(_one_is_a_list),
    ]
    start: Annotated[Number | None, Field(description="first value")] = None
    stop: Annotated[Number | None, Field(description="last value")] = None
    num: Annotated[int | None, Field(ge=1, description="number of values")] = None
    spacing: Annotated[Spacing, from_text, Field(description="how the values lie between the first and last")] = (
        Spacing.LINEAR
    )
    values: Annotated[Values | None, Field(description="the values themselves")] = None
    direction: Annotated[
        Direction | None,
        from_text,
        Field(description="follow the motion along this axis: each point starts from the end of the one before"),
    ] = None

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
        return all(type(value) in (int, float) and math.isfinite(value) for value in self.values or ())

    def value(self, place: int) -> Any:
        """The value at a place along the axis; both ends of a range are exact."""
        if self.values is not None:
            return self.values[place]
        assert self.start is not None
        assert self.stop is not None
        last = max(self.size - 1, 1)
        if place == last:
            return self.stop
        if self.spacing is Spacing.LOG:
            return self.start * (self.stop / self.start) ** (place / last)
        return self.start + place * (self.stop - self.start) / last

    def _broken_rules(self) -> Iterator[Broken]:
        yield from super()._broken_rules()
        for text in self.parameter:
            if not key_path(text):
                yield Broken(("parameter",), "is no key path", 'write it as in "link2.angle_deg"', text)
        if self.values is not None and self.spacing is Spacing.LOG:
            yield Broken(("spacing",), "is for start and stop", "leave spacing out", str(self.spacing))
        for key in ("start", "stop"):
            value = getattr(self, key)
            if self.spacing is Spacing.LOG and value is not None and value <= 0.0:
                yield Broken((key,), "is not above 0", "a logarithmic axis needs values above 0", value)
        if self.direction is not None and not self.numeric:
            yield Broken(("direction",), "needs numbers to follow", "leave it out", str(self.direction))


class Critical(Table):
    """The parameter whose critical value is looked for: the least at which steady sliding loses its stability."""

    parameter: Annotated[str, Field(description="key path of the case, such as friction.coefficient")]
    lower: Annotated[Number, Field(description="the search begins here …")]
    upper: Annotated[Number, Field(description="… and ends here")]
    tolerance: Annotated[Positive, Field(description="widest bracket to be content with")] = 1e-3
    method: Annotated[Method, from_text, Field(description="runs, or eigenvalues alone")] = Method.SIMULATION

    def _broken_rules(self) -> Iterator[Broken]:
        if self.upper <= self.lower:
            yield Broken(("upper",), "is not above lower", "give a range to search in", self.upper)
        elif self.tolerance < 1e-12 * max(abs(self.lower), abs(self.upper)):
            yield Broken(("tolerance",), "is below the rounding of the parameter", "widen it", self.tolerance)
        if not key_path(self.parameter):
            yield Broken(("parameter",), "is no key path", 'write it as in "link2.angle_deg"', self.parameter)


class Sweep(Table):
    """A grid of cases around a base case, and what to find at each of them."""

    title: Annotated[
        str, Field(pattern=r"^[^\x00-\x1f\x7f-\x9f]*$", description="one line for people to read")
    ] = ""
    case: Annotated[str, Field(min_length=1, description="the base case's file, seen from the sweep's own")]
    axis: Annotated[
        tuple[Axis, ...], *from_list, Field(description="the axes of the grid, the last one fastest")
    ] = ()
    critical: Annotated[Critical | None, Field(description="the critical parameter to find at each point")] = None

    @property
    def points(self) -> int:
        """How many points the grid has."""
        return math.prod(axis.size for axis in self.axis)

    def _broken_rules(self) -> Iterator[Broken]:
        if not self.axis and self.critical is None:
            yield Broken(("axis",), "is missing", "give at least one [[axis]], or [critical]")
        taken: set[tuple[str, ...]] = set()
        for index, axis in enumerate(self.axis):
            for text in axis.parameter:
                if key_path(text) in taken:
                    yield Broken(("axis", index, "parameter"), "is set twice", "set each key path once", text)
                taken.add(key_path(text))
        if self.critical is not None and key_path(self.critical.parameter) in taken:
            what, remedy = "is set by an axis", "look for another parameter, or leave that axis out"
            yield Broken(("critical", "parameter"), what, remedy, self.critical.parameter)
        followed = [index for index, axis in enumerate(self.axis) if axis.direction is not None]
        for index in followed[1:]:
            yield Broken(("axis", index, "direction"), "is given twice", "follow the motion along one axis alone")
        if followed and self.critical is not None:
            what, remedy = "is given together with [critical]", "keep one of the two"
            yield Broken(("axis", followed[0], "direction"), what, remedy)
