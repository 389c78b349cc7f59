"""What a sweep computes: the case of every point of its grid."""

import copy
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import tomli_w
from pydantic import ValidationError

from brakecli.case.case import Case
from brakecli.case.read import key_path, parse_table, put
from brakecli.case.toml_lines import key_text
from brakecli.case.wording import sentences
from brakecli.errors import CaseError, Problem
from brakecli.sweeps.tables import Direction, Sweep

Settings = Mapping[tuple[str, ...], Any]
"""Values by key path, to be put into the base case."""


@dataclass(frozen=True)
class Plan:
    """A sweep with its base case, both as TOML that stands for itself: all that a worker needs.

    `case_text` holds the keys that were given, overrides applied, so that a default which follows from another key
    follows it at every point.
    """

    sweep_text: str
    case_text: str

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel as two texts: a worker meets the same plan again and again."""
        return plan_of, (self.sweep_text, self.case_text)

    @cached_property
    def sweep(self) -> Sweep:
        """The axes and the critical parameter."""
        return parse_table(Sweep, self.sweep_text, "the sweep")

    @cached_property
    def _base(self) -> dict[str, Any]:
        return tomllib.loads(self.case_text)

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each axis."""
        return tuple(axis.size for axis in self.sweep.axis)

    @property
    def points(self) -> int:
        """Points of the grid."""
        return self.sweep.points

    @cached_property
    def followed(self) -> int | None:
        """The axis along which the motion is followed."""
        return next((index for index, axis in enumerate(self.sweep.axis) if axis.direction is not None), None)

    @property
    def passes(self) -> int:
        """How many times the grid is gone through: twice where the motion is followed both up and down."""
        axis = self.followed
        return 2 if axis is not None and self.sweep.axis[axis].direction is Direction.BOTH else 1

    @property
    def unit_length(self) -> int:
        """Points of a unit, which is computed in one go: one, or a line along the followed axis."""
        return 1 if self.followed is None else self.shape[self.followed]

    @property
    def units(self) -> int:
        """Units of the sweep."""
        return self.passes * self.points // self.unit_length

    def places(self, point: int) -> tuple[int, ...]:
        """Where a point lies along each axis; points are counted with the last axis fastest."""
        found = []
        for size in reversed(self.shape):
            point, place = divmod(point, size)
            found.append(place)
        return tuple(reversed(found))

    def settings(self, point: int) -> dict[tuple[str, ...], Any]:
        """What the axes set at a point."""
        found: dict[tuple[str, ...], Any] = {}
        for axis, place in zip(self.sweep.axis, self.places(point), strict=True):
            found |= dict.fromkeys((key_path(text) for text in axis.parameter), axis.value(place))
        return found

    def case(self, settings: Settings) -> Case:
        """The base case with some values put into it; raises CaseError."""
        return case_with(self._base, settings)


def case_with(base: dict[str, Any], settings: Settings, where: str = "the point") -> Case:
    """A case of its data with values put into it; raises CaseError, its problems at `where`."""
    data = copy.deepcopy(base)
    for path, value in settings.items():
        try:
            put(data, path, value, Case, kept=settings)
        except TypeError:
            what = f"{key_text(path[:-1])} is not a table"
            raise CaseError([Problem(where, key_text(path), what, "name a key of a table")]) from None
    try:
        return Case.model_validate(data)
    except ValidationError as error:
        if settings and (whole := _whole(error, settings)):
            return case_with(base, whole, where)
        raise CaseError(
            [Problem(where, key_text(key), what, remedy) for key, what, remedy in sentences(error, Case)]
        ) from None


def _whole(error: ValidationError, settings: Settings) -> Settings | None:
    """The settings as whole numbers where whole numbers are wanted: a range of nodes is one of floats."""
    wanted = {each["loc"] for each in error.errors(include_url=False) if each["type"] == "int_type"}
    found = {
        path: int(value) if path in wanted and isinstance(value, float) and value.is_integer() else value
        for path, value in settings.items()
    }
    return found if any(type(found[path]) is not type(settings[path]) for path in found) else None


def given_toml(table: Sweep | Case) -> str:
    """The keys of a table that were given, as TOML."""
    return tomli_w.dumps(table.model_dump(mode="json", exclude_unset=True, exclude_none=True))


@lru_cache(maxsize=4)
def plan_of(sweep_text: str, case_text: str) -> Plan:
    """The plan of two texts, parsed once."""
    return Plan(sweep_text, case_text)


def label(value: Any) -> str:
    """A value of an axis as text: as TOML writes it, but for the quotes of texts."""
    if isinstance(value, str):
        return value
    return f"{value:.9g}" if isinstance(value, float) else json.dumps(value)
