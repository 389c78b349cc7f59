"""What a result file holds, and how two of them differ."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from brakecli.errors import UnreadableResultError, UsageError
from brakecli.files.field import plain
from brakecli.files.read import StoredResult
from brakecli.files.write import FILL

_CASES = ("resolved_toml", "resolved_sweep_toml")
_APART = {"case_toml", "sweep_toml", *_CASES, "title", "kind", "format", "format_version", "complete"}
_BLOCK = 1 << 20  # rows read at a time


def contents(result: StoredResult) -> dict[str, Any]:
    """What `fields.INFO` declares."""
    held = []
    for group in result.groups():
        for name, each in result.variables(group).items():
            about = {key: each.attributes.get(there, "") for key, there in _ABOUT.items()}
            held.append({"group": group, "name": name, "dims": each.dims, "shape": each.shape, **about})
    attributes = result.attributes
    known = {name: attributes.get(name) for name in ("status", "kind", "title", "format_version")}
    sizes = {"whole": result.sealed, "bytes": result.length}
    return {"path": str(result.path), **known, **sizes, "versions": _versions(attributes), "variables": held}


_ABOUT = {"units": "units", "meaning": "long_name"}


@dataclass(frozen=True)
class Difference:
    """How a second result differs from a first one; `fields.DIFFERENCE_OF_TWO` declares it."""

    case: list[dict[str, Any]]
    numbers: list[dict[str, Any]]
    variables: list[dict[str, Any]]
    versions: list[dict[str, Any]]

    @property
    def same(self) -> bool:
        """Whether there is none, but for versions."""
        return not (self.case or self.numbers or self.variables)


def difference(a: StoredResult, b: StoredResult) -> Difference:
    """Compare two results of one kind; raises UsageError for two kinds, and UnreadableResultError."""
    kinds = [str(each.attributes.get("kind")) for each in (a, b)]
    if kinds[0] != kinds[1]:
        what = f"{a.path} is a {kinds[0]}, and {b.path} a {kinds[1]}"
        raise UsageError(f"{what}: they hold different things; name two results of one kind")
    groups = list(dict.fromkeys([*a.groups(), *b.groups()]))
    numbers: list[dict[str, Any]] = [{}, {}]
    for found, result in zip(numbers, (a, b), strict=True):
        there = set(result.groups())
        for group in groups:
            for name, value in result.group_attributes(group).items() if group in there else ():
                if name not in _APART and not name.endswith("_version"):
                    found[name if group == "/" else f"{group}/{name}"] = plain(value)
    return Difference(
        [*_changed(*map(_keys, (a, b)))],
        [*_changed(*numbers)],
        [each for group in groups for each in _variables(a, b, group)],
        [*_changed(*(_versions(each.attributes) for each in (a, b)))],
    )


def _versions(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name.removesuffix("_version"): value
        for name, value in attributes.items()
        if name.endswith("_version") and name != "format_version"
    }


def _keys(result: StoredResult) -> dict[str, Any]:
    """All keys of the case and of the sweep with their values."""

    def flat(value: Any, path: str) -> Iterator[tuple[str, Any]]:
        inner: Any = value.items() if isinstance(value, dict) else ()
        if isinstance(value, list) and value and isinstance(value[0], dict):
            inner = ((f"[{place}]", each) for place, each in enumerate(value))
        if not inner:
            yield path, value
        for key, each in inner:
            yield from flat(each, path + key if key[0] == "[" else f"{path}.{key}".strip("."))

    found: dict[str, Any] = {}
    for name in _CASES:
        try:
            found |= flat(tomllib.loads(str(result.attributes.get(name, ""))), "")
        except (ValueError, RecursionError) as error:
            raise UnreadableResultError(
                f"{result.path}: the case in it is not valid; name an intact file"
            ) from error
    return found


def _changed(a: dict[str, Any], b: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for name in dict.fromkeys([*a, *b]):
        if a.get(name) != b.get(name):
            yield {"name": name, "a": a.get(name), "b": b.get(name)}


def _variables(a: StoredResult, b: StoredResult, group: str) -> Iterator[dict[str, Any]]:
    """The variables of a group that differ; of two lengths the first rows are compared."""
    known = [
        {name: each for name, each in result.variables(group).items() if "units" in each.attributes}
        if group in result.groups()
        else {}
        for result in (a, b)  # what other programs have added need not have units
    ]
    for name in dict.fromkeys([*known[0], *known[1]]):
        shapes = [list(each[name].shape) if name in each else [] for each in known]
        compared = different = 0
        largest = highest = 0.0
        numeric = True
        if all(shapes) and shapes[0][1:] == shapes[1][1:]:
            rows = min(shape[0] for shape in shapes)
            for one, other in zip(*(_blocks(each, group, name, rows) for each in (a, b)), strict=True):
                apart = one != other
                compared, different = compared + one.size, different + int(apart.sum())
                numeric = one.dtype.kind in "iuf" and other.dtype.kind in "iuf"
                if numeric:
                    there = (one != FILL) & (other != FILL)
                    largest = max(largest, float(np.abs(1.0 * one - other)[there].max(initial=0.0)))
                    highest = max(highest, *(float(np.abs(each[there]).max(initial=0.0)) for each in (one, other)))
        if different or shapes[0] != shapes[1]:
            yield {
                "group": group,
                "name": name,
                "shapes": [shape or None for shape in shapes],
                "compared": compared,
                "different": different,
                "largest": largest if numeric and compared else None,
                "relative": largest / highest if numeric and highest else None,
            }


def _blocks(result: StoredResult, group: str, name: str, rows: int) -> Iterator[Any]:
    for start in range(0, rows, _BLOCK):
        yield result.read(group, name, start, min(start + _BLOCK, rows))
