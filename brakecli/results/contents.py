"""What a result file holds, and how two of them differ."""

import math
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np

from brakecli.errors import UsageError, printable
from brakecli.results.field import Field, flat, integer, named, plain, plain_units, ratio
from brakecli.results.fields import OBJECT, RUN, TEXT, WELCH
from brakecli.results.numbers import DECLARED
from brakecli.results.read import BLOCK, StoredResult, Variable
from brakecli.results.toml_lines import parse
from brakecli.results.write import FILL

_CASES = ("resolved_toml", "resolved_sweep_toml", "resolved_study_toml")
_APART = {
    "case_toml",
    "sweep_toml",
    "study_toml",
    *_CASES,
    "title",
    "kind",
    "format",
    "format_version",
    "complete",
}
"""Attributes that differ between any two results, or are compared key by key."""
_RISING = ("time", "frequency")  # axes along which values are interpolated

HELD = (
    Field("group", "", "group of the file", TEXT),
    Field("name", "", "name of the variable", TEXT),
    Field("dims", "", "names of its axes", OBJECT),
    Field("shape", "1", "their lengths", OBJECT),
    Field("units", "", "its unit", TEXT),
    Field("meaning", "", "what it is", TEXT),
)
INFO = (
    Field("file", "", "the file", TEXT, at="path"),
    *named(RUN, "status"),
    Field("kind", "", "run, sweep, comparison, stability, branch or scatter", TEXT),
    Field("title", "", "title of the case or of the sweep", TEXT),
    Field("whole", "", "whether every byte is as it was written; any other file is refused", "?"),
    integer("bytes", "size of the file"),
    integer("format_version", "version of the form of the file"),
    Field("versions", "", "versions of brakecli and of the libraries that made it", OBJECT),
    Field("variables", "", "all variables", OBJECT, rows=HELD),
)
DIFFERENT_VALUE = (
    Field("name", "", "key of the case, or name of the number with its group", TEXT),
    Field("a", "", "value in the first file; null where there is none", OBJECT),
    Field("b", "", "value in the second file; null where there is none", OBJECT),
)
DIFFERENT_NUMBER = (*DIFFERENT_VALUE, Field("units", "", "unit of both values", TEXT))
DIFFERENT_VARIABLE = (
    *HELD[:2],
    Field("shapes", "1", "lengths of its axes in both files; null where it is missing", OBJECT),
    integer("compared", "number of values that are in both"),
    integer("different", "number of those that differ"),
    Field("largest", "of the variable", "largest difference of two values; null for texts"),
    ratio("relative", "that over the largest value in both; null where that is 0"),
    Field("units", "", "unit of the variable", TEXT),
    Field("interpolated", "", "the axis, time or frequency, where its values differ; null otherwise", TEXT),
)
DIFFERENCE_OF_TWO = (
    Field("same", "", "whether case, numbers and variables are the same", "?"),
    Field("sentence", "", "what differs, in a sentence", TEXT),
    Field("case", "", "keys of the case and of the sweep that differ", OBJECT, rows=DIFFERENT_VALUE),
    Field("numbers", "", "attributes that differ", OBJECT, rows=DIFFERENT_NUMBER),
    Field("variables", "", "variables that differ", OBJECT, rows=DIFFERENT_VARIABLE),
    Field("versions", "", "versions that differ", OBJECT, rows=DIFFERENT_VALUE),
)
"""How two files differ; neither this nor what one holds is in any file."""


def contents(result: StoredResult) -> dict[str, Any]:
    """What `INFO` declares."""
    variables = []
    for group in result.groups:
        for name, variable in result.variables(group).items():
            units, meaning = (str(variable.attributes.get(name, "")) for name in ("units", "long_name"))
            about = {"units": units, "meaning": meaning}
            variables.append(
                {"group": group, "name": name, "dims": variable.dims, "shape": variable.shape, **about}
            )
    attributes = result.attributes
    facts = {name: attributes.get(name) for name in ("status", "kind", "title", "format_version")}
    sizes = {"whole": True, "bytes": result.length}
    return {"path": str(result.path), **facts, **sizes, "versions": result.versions, "variables": variables}


def _is_aside(name: str) -> bool:
    """Whether a variable says how well another one is known, or where it was sought: it is no result by itself."""
    return name.endswith("_error") or "windows" in name


class DifferentVariable(TypedDict):
    """A variable that differs, as `DIFFERENT_VARIABLE` declares it."""

    group: str
    name: str
    shapes: list[list[int] | None]
    compared: int
    different: int
    largest: float | None
    relative: float | None
    units: str
    interpolated: str | None


@dataclass(frozen=True)
class Difference:
    """How a second result differs from a first one; `DIFFERENCE_OF_TWO` declares it."""

    case: Sequence[Mapping[str, object]]
    numbers: Sequence[Mapping[str, object]]
    variables: Sequence[DifferentVariable]
    versions: Sequence[Mapping[str, object]]
    judged: bool  # whether both hold a verdict

    @property
    def same(self) -> bool:
        """Whether there is none, but for versions."""
        return not (self.case or self.numbers or self.variables)

    @property
    def sentence(self) -> str:
        """What differs: keys of the case, the verdict, and which variable does most, beside its largest value."""
        if self.same:
            return "no difference in case, numbers and variables"
        names = [str(key["name"]) for key in self.case]
        remaining = len(names[3:])
        more = f" and {remaining} more key{'s' * (remaining > 1)}" if remaining else ""
        said = [f"the case differs in {', '.join(names[:3])}{more}" if names else "the case is the same"]
        if self.judged:
            pairs = [row for row in self.numbers if row["name"] == "regime"]
            places = [row for row in self.variables if row["name"] == "regime" and row["different"]]
            said += [f"the verdict differs: {row['a']} and {row['b']}" for row in pairs]
            said += [f"the verdict differs at {row['different']} of {row['compared']} points" for row in places]
            said += ["the verdict is the same"] * (not pairs and not places)
        if numeric := [row for row in self.variables if row["relative"] and not _is_aside(row["name"])]:
            most = max(numeric, key=lambda row: row["relative"] or 0.0)
            units = "" if most["units"] == "1" else f" {plain_units(most['units'])}"
            size = f"{most['largest']:.3g}{units}, {most['relative']:.3g} times its largest value"
            said.append(f"{most['name']} differs most, by up to {size}")
        return "; ".join(said)


def difference(a: StoredResult, b: StoredResult) -> Difference:
    """Compare two results of one kind; raises UsageError for two kinds, UnreadableResultError."""
    kinds = [str(file.attributes.get("kind")) for file in (a, b)]
    if kinds[0] != kinds[1]:
        what = f"{a.path} is a {printable(kinds[0])}, and {b.path} a {printable(kinds[1])}"
        raise UsageError(f"{what}: they hold different things; name two results of one kind")
    groups = list(dict.fromkeys([*a.groups, *b.groups]))
    numbers: list[dict[str, object]] = [{}, {}]
    for attributes, result in zip(numbers, (a, b), strict=True):
        for group in groups:
            for name, value in result.group_attributes(group).items() if group in result.groups else ():
                if name not in _APART and not name.endswith("_version"):
                    value = plain(value)  # xarray takes a list of one for a number
                    value = value[0] if isinstance(value, list) and len(value) == 1 else value
                    attributes[name if group == "/" else f"{group}/{name}"] = value
    declared = DECLARED.get(kinds[0], ())
    rows = ((field.group, row) for field in declared for row in (field.rows if field.group else [field]))
    units = {f"{group}/{row.name}": row.units for group, row in rows}
    units |= {f"spectrum/{field.name}": field.units for field in WELCH}
    differing = [*changed(*numbers)]
    for number in differing:
        name = str(number["name"])
        number["units"] = units.get(name, units.get(f"/{name}", ""))
    variables = [variable for group in groups for variable in _variables(a, b, group)]
    of_program = [*changed(a.versions, b.versions)]
    judged = all("regime" in {**file.attributes, **file.variables("/")} for file in (a, b))
    return Difference([*changed(*map(keys, (a, b)))], differing, variables, of_program, judged)


def keys(result: StoredResult, texts: Sequence[str] = _CASES) -> dict[str, object]:
    """All keys of the case, and of the sweep or the study, with their values."""
    values: dict[str, object] = {}
    for name in texts:
        values |= flat(parse(str(result.attributes.get(name, "")), f"{result.path}: {name}"))
    return values


def changed(a: Mapping[str, object], b: Mapping[str, object]) -> Iterator[dict[str, object]]:
    """Name and both values of all that differs; None stands for what one of them lacks."""
    for name in dict.fromkeys([*a, *b]):
        if a.get(name) != b.get(name):
            yield {"name": name, "a": a.get(name), "b": b.get(name)}


def _variables(a: StoredResult, b: StoredResult, group: str) -> Iterator[DifferentVariable]:
    """The variables of a group that differ, at the same places along their axis."""
    by_name = [file.variables(group) if group in file.groups else {} for file in (a, b)]
    for name in dict.fromkeys([*by_name[0], *by_name[1]]):
        pair = [variables[name] for variables in by_name if name in variables]
        shapes = [list(variables[name].shape) if name in variables else [] for variables in by_name]
        compared = different = 0
        largest = highest = 0.0
        coded = any("flag_meanings" in variable.attributes for variable in pair)
        numeric = True
        along = None
        if all(shapes) and shapes[0][1:] == shapes[1][1:]:
            along = _other_places(a, b, group, pair)
            rows = _interpolated(a, b, group, name, along) if along else _pairs(a, b, group, name)
            for one, other in rows:
                numeric = not coded and one.dtype.kind in "iuf" and other.dtype.kind in "iuf"
                apart = one != other
                if numeric:
                    there = (one != FILL) & (other != FILL)
                    off = np.where(there, np.abs(1.0 * one - other), 0.0)
                    sizes = [float(np.abs(values[there]).max(initial=0.0)) for values in (one, other)]
                    apart &= ~there | (off > (1e-9 * max(sizes) if along else 0.0))  # interpolation may add that
                    largest = max(largest, float(off.max(initial=0.0)))
                    highest = max(highest, *sizes)
                compared = compared + one.size
                different = different + int(apart.sum())
        if different or shapes[0] != shapes[1]:
            yield {
                "group": group,
                "name": name,
                "shapes": [shape or None for shape in shapes],
                "compared": compared,
                "different": different,
                "largest": largest if numeric and compared else None,
                "relative": largest / highest if numeric and highest else None,
                "units": str(pair[0].attributes["units"]),
                "interpolated": along,
            }


def _other_places(a: StoredResult, b: StoredResult, group: str, pair: list[Variable]) -> str | None:
    """The name of the axis of a variable, if it has one of numbers with other values in the second result."""
    axis = pair[0].dims[0]
    if pair[0].dims != pair[1].dims or len({*pair[0].dims} - {"mode"}) != 1 or axis not in _RISING:
        return None
    return axis if any((one != other).any() for one, other in _pairs(a, b, group, axis)) else None


def _pairs(a: StoredResult, b: StoredResult, group: str, name: str) -> Iterator[tuple[Any, Any]]:
    """The rows of a variable in both results, up to the end of the shorter one."""
    rows = min(result.variables(group)[name].shape[0] for result in (a, b))
    for start in range(0, rows, BLOCK):
        one, other = (result.read(group, name, start, min(start + BLOCK, rows)) for result in (a, b))
        yield one, other


def _interpolated(a: StoredResult, b: StoredResult, group: str, name: str, axis: str) -> Iterator[tuple[Any, Any]]:
    """A variable of both results at the places of the one that has fewer in the range of both; in blocks.

    Numbers of the other one are interpolated along the axis, states are those of its nearest row.
    """

    def row(result: StoredResult, position: float) -> int:
        rows = range(result.variables(group)[axis].shape[0])
        return bisect_left(rows, position, key=lambda row: float(result.read(group, axis, row, row + 1)[0]))

    ends = [[float(result.read(group, axis, *at)[0]) for at in ((0, 1), (-1, None))] for result in (a, b)]
    first = max(low for low, _ in ends)
    last = min(high for _, high in ends)
    parts = [range(row(result, first), row(result, math.nextafter(last, math.inf))) for result in (a, b)]
    second_is_coarser = len(parts[1]) < len(parts[0])
    coarse, fine, span = (b, a, parts[1]) if second_is_coarser else (a, b, parts[0])
    for start in span[::BLOCK]:
        stop = min(start + BLOCK, span.stop)
        at, values = (coarse.read(group, variable, start, stop) for variable in (axis, name))
        around = max(row(fine, at[0]) - 1, 0), row(fine, at[-1]) + 1
        places, there = (fine.read(group, variable, *around) for variable in (axis, name))
        where = np.interp(at, places, np.arange(len(places)))
        low = np.floor(where).astype(int)
        high = np.ceil(where).astype(int)
        if there.dtype.kind == "f":
            weight = (where - low).reshape(-1, *[1] * (there.ndim - 1))
            present = (there[low] != FILL) & (there[high] != FILL)
            between = np.where(present, there[low] + weight * (there[high] - there[low]), FILL)
        else:
            between = there[np.round(where).astype(int)]
        yield (between, values) if second_is_coarser else (values, between)
