"""Sweep file → the case of every point of its grid, or every problem of the sweep and of its base case at once."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import tomli_w
from pydantic import ValidationError

from brakecli.case import wording
from brakecli.case.case import Case, given_toml
from brakecli.case.read import LoadedCase, key_path, parse_over_case, parse_table, put
from brakecli.case.records import Record
from brakecli.case.roughness import Records, reading
from brakecli.case.tables import Table, tables_within
from brakecli.errors import CaseError, KeyPath, Problem
from brakecli.results import fields
from brakecli.results.toml_lines import Located, innermost, parse
from brakecli.studies.sweeps.point_list import GIVEN, Listed, read_listed
from brakecli.studies.sweeps.tables import Axis, Sweep

MOST_TRIED = 1000  # listed numbers of an axis that are tried before the sweep starts; of a range it is both ends

Settings = dict[tuple[str, ...], Any]
"""Values by key path, to be put into the base case."""


class Plan:
    """A sweep with its base case: all that a worker needs.

    Both texts hold the keys that were given, overrides applied: a default that follows from another key follows it
    at every point. `records` are the measured profiles that points need: no file is opened where points are
    computed, and what becomes of a file meanwhile does not matter. `listed` are the points of a sweep without axes
    that has a table of them.
    """

    def __init__(
        self,
        sweep_text: str,
        case_text: str,
        records: Mapping[str, Record] = MappingProxyType({}),
        listed: Listed | None = None,
    ) -> None:
        """Read the sweep and the keys of its case."""
        self.sweep_text = sweep_text
        self.case_text = case_text
        self.records = records
        self.listed = listed
        self.sweep = parse_table(Sweep, sweep_text, "the sweep")
        self.case_keys = parse(case_text, "the case")
        axes = self.sweep.axis
        self.shape = tuple(axis.size for axis in axes) if listed is None else (listed.size,)
        self.points = math.prod(self.shape)  # of the grid
        # the axis along which the motion is followed, and how often that is: twice both up and down
        self.followed = next((index for index, axis in enumerate(axes) if axis.direction), None)
        self._valid = dict(_valid_tables(self.case_keys))  # which points need not check again
        self.passes = 2 if any(axis.direction == "both" for axis in axes) else 1
        sizes = {axis.name: axis.size for axis in axes} or {"point": self.points}
        self.dimensions = {"direction": 2, **sizes} if self.passes == 2 else sizes  # of the result
        self.fields = fields.POINT + (fields.CRITICAL if self.sweep.critical is not None else ())  # of a point
        # units are what tasks consist of: single points, or lines along the followed axis
        self.unit_length = 1 if self.followed is None else self.shape[self.followed]
        self.units = self.passes * self.points // self.unit_length

    @property
    def over_starts(self) -> bool:
        """Whether the points differ in their initial states alone, which are not those of other points."""
        keys = [text for axis in self.sweep.axis for text in axis.parameter] + [
            *(self.listed.keys if self.listed else ())
        ]
        return self.followed is None and {key_path(text)[0] for text in keys} == {"initial"}

    def __reduce__(self) -> tuple[object, ...]:
        """Travel as two texts, the measured profiles and the listed points."""
        return plan_of, (self.sweep_text, self.case_text, tuple(self.records.items()), self.listed)

    def places(self, point: int) -> tuple[int, ...]:
        """Where a point lies along each axis; points are counted with the last axis fastest."""
        strides = (math.prod(self.shape[axis + 1 :]) for axis in range(len(self.shape)))
        return tuple(point // stride % size for stride, size in zip(strides, self.shape, strict=True))

    def settings(self, point: int) -> Settings:
        """What the axes, or the table, set at a point."""
        settings: Settings = {}
        if self.listed is not None:
            return {
                key_path(key): column[point]
                for key, column in zip(self.listed.keys, self.listed.columns, strict=True)
            }
        for axis, index in zip(self.sweep.axis, self.places(point), strict=True):
            settings |= dict.fromkeys((key_path(text) for text in axis.parameter), axis.value(index))
        return settings

    def case(self, settings: Settings) -> Case:
        """The base case with some values put into it; raises CaseError."""
        data = _tables(self.case_keys)
        for path, value in settings.items():
            put(data, path, value, Case, kept=settings)
        same = self._valid.keys() - {path[0] for path in settings}
        data |= {name: self._valid[name] for name in same if data[name] == self.case_keys[name]}
        try:
            with reading(self.records):
                return Case.model_validate(data)
        except ValidationError as error:
            for fault in error.errors(include_url=False):
                path = tuple(map(str, fault["loc"]))
                value = settings.get(path)
                if fault["type"] == "int_type" and isinstance(value, float) and value.is_integer():
                    return self.case({**settings, path: int(value)})  # a range holds floats
            raise CaseError(
                [replace(problem, source="the point") for problem in wording.problems(error, Case)]
            ) from None

    def problems(self, settings: Settings) -> tuple[Problem, ...]:
        """What is wrong with these values."""
        try:
            self.case(settings)
        except CaseError as error:
            return error.problems
        return ()


def _valid_tables(data: dict[str, object]) -> Iterator[tuple[str, Table]]:
    """The tables of a case that are right by themselves."""
    for name, table in data.items():
        if (kind := tables_within(Case).get((name,))) is not None:
            with suppress(ValidationError):
                yield name, kind.model_validate(table)


def _tables(data: dict[str, object]) -> dict[str, object]:
    """The data of a table whose tables, but no lists, are copies."""
    return {key: _tables(value) if isinstance(value, dict) else value for key, value in data.items()}


@lru_cache(maxsize=4)
def plan_of(
    sweep_text: str, case_text: str, records: tuple[tuple[str, Record], ...] = (), listed: Listed | None = None
) -> Plan:
    """The plan of what travels; a worker meets the same one again and again."""
    # `lru_cache(Plan)` would inherit `__reduce__`, and could not be sent
    return Plan(sweep_text, case_text, dict(records), listed)


@dataclass(frozen=True)
class LoadedSweep:
    """A sweep with the texts it was read from; `resolved` is its file with every default filled in."""

    sweep: Sweep
    text: str
    resolved: str
    base: LoadedCase
    plan: Plan

    @property
    def title(self) -> str:
        """The title of the sweep, otherwise that of its case."""
        return self.sweep.title or self.base.case.title


def parse_sweep(text: str, name: str, folder: Path, overrides: Sequence[str] = ()) -> LoadedSweep:
    """Make a sweep of its text; the path of its base case begins at `folder`. Raises `CaseError`.

    Overrides of `critical` and `case` belong to the sweep, all others to its base case.
    """
    sweep, base, lines = parse_over_case(Sweep, text, name, folder, overrides, {"case", "critical"})
    listed = None
    if sweep.points is not None:
        listed = read_listed(folder / sweep.points, name, lines.get(("points",), 0))
        if sweep.critical is not None and key_path(sweep.critical.parameter) in map(key_path, listed.keys):
            raise CaseError(
                [
                    Problem(
                        ("critical", "parameter"),
                        "is set by a column of points",
                        "look for another parameter, or leave that column out",
                        name,
                    )
                ]
            )
    return _checked(sweep, text, name, base, listed)


def sweep_of(tables: dict[str, object], base: LoadedCase, listed: Listed | None = None) -> LoadedSweep:
    """The sweep of the tables that its file would have, over a case at hand. Raises `CaseError`."""
    text = tomli_w.dumps(tables)
    name = "the sweep"
    try:
        return _checked(parse_table(Sweep, text, name), text, name, base, listed)
    except CaseError as error:  # lines of that text would help nobody
        raise CaseError([replace(problem, line=0) for problem in error.problems]) from None


def _checked(sweep: Sweep, text: str, name: str, base: LoadedCase, listed: Listed | None) -> LoadedSweep:
    """A sweep over a case; raises `CaseError` where its axes, or its listed points, do not fit."""
    sweep_text = tomli_w.dumps(sweep.model_dump(mode="json", exclude_unset=True, exclude_none=True))
    keys = [key_path(text) for axis in sweep.axis if not axis.direction for text in axis.parameter]
    keys += [key_path(sweep.critical.parameter)] if sweep.critical else []
    keys += map(key_path, listed.keys if listed else ())
    # Other keys leave the sines of a measured profile as they are, and along a line the wheel keeps its waves.
    anew = any(path[0] == "roughness" or path in (("wheel",), ("wheel", "radius")) for path in keys)
    plan = Plan(sweep_text, given_toml(base.case, profiles=anew), Records(base.records if anew else {}), listed)
    if problems := _wrong_values(plan, text, name) + _wrong_points(plan):
        raise CaseError(problems)
    plan.records = dict(plan.records)  # which reads nothing any more
    resolved = tomli_w.dumps(sweep.model_dump(mode="json", exclude_none=True))
    return LoadedSweep(sweep, text, resolved, base, plan)


def _wrong_points(plan: Plan) -> list[Problem]:
    """What is wrong with the first of the listed points that are tried, at the line of each in its table."""
    if plan.listed is None:
        return []
    for point in range(min(plan.points, MOST_TRIED)):
        if problems := plan.problems(plan.settings(point)):
            file = plan.sweep.points
            where = (f"point {point}", 0) if file in (None, GIVEN) else (file, plan.listed.lines[point])
            return [replace(problem, source=where[0], line=where[1]) for problem in problems]
    return []


def kind_of(text: str) -> str:
    """What a text is meant to be, by its keys at the top: "case", "sweep", "study", or none of them."""
    keys = keys_at_top(text)
    if "shoe" in keys:
        return "" if keys & {"axis", "critical"} else "case"
    if "parameter" in keys:
        return "study"
    return "sweep" if keys & {"case", "axis", "critical", "points"} else ""


def keys_at_top(text: str) -> set[str]:
    """The keys at the top of a text, none of one that is no TOML."""
    try:
        return {*Located(text).data}
    except CaseError:
        return set()


def label(value: object) -> str:
    """A value of an axis as TOML writes it, but a text without its quotes."""
    if isinstance(value, str):
        return value
    return f"{value:.9g}" if isinstance(value, float) else json.dumps(value)


def _wrong_values(plan: Plan, text: str, name: str) -> list[Problem]:
    """What is wrong with the axes and the search: keys that no case has, and values that no key takes.

    A value may need those of other axes: it is wrong if it fits neither the base case nor a corner of the grid.
    """
    axes: dict[KeyPath, Axis] = {("axis", index): axis for index, axis in enumerate(plan.sweep.axis)}
    if (critical := plan.sweep.critical) is not None:
        axes["critical",] = Axis(parameter=(critical.parameter,), values=(critical.lower, critical.upper))
    lines = Located(text, name).lines
    corners = [plan.settings(0), plan.settings(plan.points - 1)] if plan.listed is None else [{}]
    problems: dict[tuple[int, str], Problem] = {}
    for path, axis in axes.items():
        line = innermost(lines, (*path, "parameter"), 0)
        tried = (axis.start, axis.stop) if axis.values is None else axis.values
        for value in tried[: MOST_TRIED if axis.numeric else None]:  # all profiles are read
            settings = {key_path(parameter): value for parameter in axis.parameter}
            wrong = plan.problems(settings)
            for problem in wrong if wrong and all(plan.problems(corner | settings) for corner in corners) else ():
                problems.setdefault((line, problem.key), replace(problem, source=name, line=line))
    return list(problems.values())
