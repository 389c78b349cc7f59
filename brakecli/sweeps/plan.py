"""What a sweep computes: the case of every point of its grid."""

import copy
import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import tomli_w
from pydantic import ValidationError

from brakecli.case import wording
from brakecli.case.case import Case
from brakecli.case.read import key_path, parse_table, put
from brakecli.errors import CaseError, Problem
from brakecli.sweeps.tables import Sweep

Settings = Mapping[tuple[str, ...], Any]
"""Values by key path, to be put into the base case."""


class Plan:
    """A sweep with its base case: all that a worker needs.

    Both texts hold the keys that were given, overrides applied: a default that follows from another key follows it
    at every point.
    """

    def __init__(self, sweep_text: str, case_text: str) -> None:
        """Read the sweep and the keys of its case."""
        self.sweep_text, self.case_text = sweep_text, case_text
        self.sweep, self.case_keys = parse_table(Sweep, sweep_text, "the sweep"), tomllib.loads(case_text)
        axes = self.sweep.axis
        self.shape = tuple(axis.size for axis in axes)
        self.points = math.prod(self.shape)  # of the grid
        # the axis along which the motion is followed, and how often that is: twice both up and down
        self.followed = next((index for index, axis in enumerate(axes) if axis.direction), None)
        self.passes = 2 if any(axis.direction == "both" for axis in axes) else 1
        sizes = {axis.name: axis.size for axis in axes} or {"point": 1}
        self.dimensions = {"direction": 2, **sizes} if self.passes == 2 else sizes  # of the result
        # units are what tasks consist of: single points, or lines along the followed axis
        self.unit_length = 1 if self.followed is None else self.shape[self.followed]
        self.units = self.passes * self.points // self.unit_length

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel as two texts."""
        return plan_of, (self.sweep_text, self.case_text)

    def places(self, point: int) -> tuple[int, ...]:
        """Where a point lies along each axis; points are counted with the last axis fastest."""
        strides = (math.prod(self.shape[axis + 1 :]) for axis in range(len(self.shape)))
        return tuple(point // stride % size for stride, size in zip(strides, self.shape, strict=True))

    def settings(self, point: int) -> dict[tuple[str, ...], Any]:
        """What the axes set at a point."""
        found: dict[tuple[str, ...], Any] = {}
        for axis, place in zip(self.sweep.axis, self.places(point), strict=True):
            found |= dict.fromkeys((key_path(text) for text in axis.parameter), axis.value(place))
        return found

    def case(self, settings: Settings) -> Case:
        """The base case with some values put into it; raises CaseError."""
        data = copy.deepcopy(self.case_keys)
        for path, value in settings.items():
            put(data, path, value, Case, kept=settings)
        try:
            return Case.model_validate(data)
        except ValidationError as error:
            for each in error.errors(include_url=False):
                path = tuple(map(str, each["loc"]))
                value = settings.get(path)
                if each["type"] == "int_type" and isinstance(value, float) and value.is_integer():
                    return self.case({**settings, path: int(value)})  # a range holds floats
            problems = [replace(each, source="the point") for each in wording.problems(error, Case)]
            raise CaseError(problems) from None

    def problems(self, settings: Settings) -> tuple[Problem, ...]:
        """What is wrong with these values."""
        try:
            self.case(settings)
        except CaseError as error:
            return error.problems
        return ()


def given_toml(table: Sweep | Case) -> str:
    """The keys of a table that were given, as TOML."""
    return tomli_w.dumps(table.model_dump(mode="json", exclude_unset=True, exclude_none=True))


@lru_cache(maxsize=4)
def plan_of(sweep_text: str, case_text: str) -> Plan:
    """The plan of the texts of a sweep and of its case; a worker meets the same ones again and again."""
    return Plan(sweep_text, case_text)  # `lru_cache(Plan)` would inherit `__reduce__`, and could not be sent


def label(value: Any) -> str:
    """A value of an axis as TOML writes it, but a text without its quotes."""
    if isinstance(value, str):
        return value
    return f"{value:.9g}" if isinstance(value, float) else json.dumps(value)
