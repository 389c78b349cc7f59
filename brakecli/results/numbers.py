"""What a result file holds by the names of `--json`, so that a page says of it what its command has said."""

from collections.abc import Iterable
from typing import Any

from brakecli.results import fields, stability_fields
from brakecli.results.field import Field, plain
from brakecli.results.read import StoredResult
from brakecli.results.write import FILL

DECLARED = {
    "run": fields.RUN,
    "sweep": fields.SWEEP,
    "comparison": fields.COMPARISON,
    "stability": stability_fields.LOCK_IN,
    "branch": stability_fields.BRANCH,
    "scatter": stability_fields.SCATTER,
}


def stored_numbers(result: StoredResult) -> dict[str, Any]:
    """Names and values, None where there is none. Raises UnreadableResultError."""
    kind = str(result.attributes.get("kind"))
    declared = DECLARED.get(kind, ())
    attributes = {name: plain(value) for name, value in result.attributes.items()}
    there = result.groups
    objects = {
        field.name: dict(result.group_attributes(field.group)) for field in declared if field.group in there
    }
    numbers = {**dict.fromkeys(field.name for field in declared), **objects, **attributes}
    if "vibrations" in there:
        numbers["vibrations"] = rows(result, "vibrations", fields.VIBRATION)
    if kind == "comparison":
        numbers["entries"] = rows(result, "/", fields.ENTRY)
        best = attributes.get("recommended")
        numbers["recommended"] = None if best is None else numbers["entries"][best]
    if kind == "stability":
        along = Field(result.variables("/")["frequencies"].dims[0], "", "")
        columns = (along, *stability_fields.VARIED, *stability_fields.MODES)
        numbers["vary"] = [{**row, "value": row[along.name]} for row in rows(result, "/", columns)]
    if kind == "branch":
        names = [name for name in there if name.startswith("branch_") and "/" not in name]
        names.sort(key=lambda name: int(name.removeprefix("branch_")))
        numbers["branches"] = [_branch(result, name) for name in names]
    if kind == "scatter":
        numbers |= _by_name(result, stability_fields.OUTCOME, stability_fields.PROBABILITY)
        numbers |= _by_name(result, stability_fields.SCATTERING, stability_fields.INDEX)
    return numbers


def rows(result: StoredResult, group: str, declared: Iterable[Field]) -> list[dict[str, Any]]:
    """The variables of a group, a record for each place along them; None stands for a number that is missing."""
    there = result.variables(group)
    columns = {field.name: result.read(group, field.name) for field in declared if field.name in there}
    lists = {name: _or_none(values.tolist()) for name, values in columns.items()}
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def _or_none(value: object) -> object:
    if isinstance(value, list):
        return [_or_none(item) for item in value]
    return None if value == FILL else value


def _branch(result: StoredResult, group: str) -> dict[str, object]:
    """A branch: its motions, and its special points."""
    points = [field for field in stability_fields.BRANCH_POINT if field.name != "multipliers"]
    branch: dict[str, object] = {"note": ""}
    branch |= {name: plain(value) for name, value in result.group_attributes(group).items()}
    branch["points"] = rows(result, group, points)
    branch["special"] = rows(result, f"{group}/special", stability_fields.SPECIAL)
    return branch


def _by_name(result: StoredResult, names: Field, declared: Iterable[Field]) -> dict[str, object]:
    """Values by the texts along their axis; none where the file has no such axis."""
    if names.name not in result.variables("/"):
        return {}
    records = rows(result, "/", (names, *declared))
    return {field.name: {row[names.name]: row.get(field.name) for row in records} for field in declared}
