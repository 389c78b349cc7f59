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
    held = {name: plain(value) for name, value in result.attributes.items()}
    there = result.groups
    objects = {each.name: dict(result.group_attributes(each.group)) for each in declared if each.group in there}
    found = {**dict.fromkeys(each.name for each in declared), **objects, **held}
    if "vibrations" in there:
        found["vibrations"] = rows(result, "vibrations", fields.VIBRATION)
    if kind == "comparison":
        found["entries"] = rows(result, "/", fields.ENTRY)
        best = held.get("recommended")
        found["recommended"] = None if best is None else found["entries"][best]
    if kind == "stability":
        along = Field(result.variables("/")["frequencies"].dims[0], "", "")
        known = (along, *stability_fields.VARIED, *stability_fields.MODES)
        found["vary"] = [{**each, "value": each[along.name]} for each in rows(result, "/", known)]
    if kind == "branch":
        names = [name for name in there if name.startswith("branch_") and "/" not in name]
        names.sort(key=lambda name: int(name.removeprefix("branch_")))
        found["branches"] = [_branch(result, name) for name in names]
    if kind == "scatter":
        found |= _by_name(result, stability_fields.OUTCOME, stability_fields.PROBABILITY)
        found |= _by_name(result, stability_fields.SCATTERING, stability_fields.INDEX)
    return found


def rows(result: StoredResult, group: str, known: Iterable[Field]) -> list[dict[str, Any]]:
    """The variables of a group, a record for each place along them; None stands for a number that is missing."""
    there = result.variables(group)
    columns = {each.name: result.read(group, each.name) for each in known if each.name in there}
    lists = {name: _known(values.tolist()) for name, values in columns.items()}
    return [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]


def _known(value: Any) -> Any:
    if isinstance(value, list):
        return [_known(each) for each in value]
    return None if value == FILL else value


def _branch(result: StoredResult, group: str) -> dict[str, Any]:
    """A branch: its motions, and its special points."""
    points = [each for each in stability_fields.BRANCH_POINT if each.name != "multipliers"]
    found: dict[str, Any] = {"note": ""}
    found |= {name: plain(value) for name, value in result.group_attributes(group).items()}
    found["points"] = rows(result, group, points)
    found["special"] = rows(result, f"{group}/special", stability_fields.SPECIAL)
    return found


def _by_name(result: StoredResult, names: Field, known: Iterable[Field]) -> dict[str, Any]:
    """Values by the texts along their axis; none where the file has no such axis."""
    if names.name not in result.variables("/"):
        return {}
    held = rows(result, "/", (names, *known))
    return {each.name: {row[names.name]: row.get(each.name) for row in held} for each in known}
