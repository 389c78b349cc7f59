"""What pydantic found wrong with a table, in plain sentences that name the remedy."""

from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any, NamedTuple, get_args

from pydantic import ValidationError

from brakecli.case.case import json_schema
from brakecli.case.tables import LARGEST, SMALLEST, Table
from brakecli.case.toml_lines import KeyPath, key_text, value_text

MISSING = "is missing"
_WHAT = {
    "missing": MISSING,
    "float_type": "is not a number",
    "int_type": "is not a whole number",
    "bool_type": "is neither true nor false",
    "string_type": "is not a text",
    "string_pattern_mismatch": "holds a line break or a control character",
    "enum": "is not one of the choices",
    "tuple_type": "is not a list",
    "model_type": "is not a table",
    "too_short": "is too short",
    "finite_number": "is not finite",
    "greater_than": "is out of range",
    "greater_than_equal": "is out of range",
    "less_than_equal": "is out of range",
    "magnitude": f"is not between {SMALLEST:g} and {LARGEST:g} in magnitude",
}
"""The kinds of error that pydantic reports for the types of a case, and our own; a rule brings its own words."""


Tables = dict[KeyPath, type[Table]]


class Sentence(NamedTuple):
    """One problem: the key path, what is wrong with what was found there, and what to do."""

    key: KeyPath
    what: str
    remedy: str


def tables(model: type[Table], path: KeyPath = ()) -> Iterator[tuple[KeyPath, type[Table]]]:
    """Every table of a model, itself included, by its key path."""
    yield path, model
    for key, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, Table):
                yield from tables(kind, (*path, key))


def sentences(error: ValidationError, model: type[Table]) -> Iterator[Sentence]:
    """Tell everything that is wrong with a table in plain words."""
    known = dict(tables(model))
    schema = json_schema(model)
    errors = error.errors(include_url=False)
    meant = {each["loc"]: _nearest(each["loc"], known) for each in errors if each["type"] == "extra_forbidden"}
    for each in errors:
        path, kind, found = each["loc"], each["type"], each["input"]
        if kind == "extra_forbidden":
            yield Sentence(path, "is unknown" + _found(found), _suggestion(path, meant[path], known))
            if meant[path] and (table := known.get(meant[path])) and isinstance(found, dict):
                yield from _inside(path, table, found)
        elif kind == "rule":
            words = each["ctx"]
            yield Sentence(path, words["what"] + ("" if found is None else _found(found)), words["remedy"])
        elif kind == "missing":
            if path not in meant.values():  # else it is misspelt
                yield Sentence(path, MISSING, f"give {_expected(path, schema)}")
        else:
            too_large = kind == "float_type" and type(found) is int
            what = _WHAT["magnitude" if too_large else kind]
            yield Sentence(path, what + _found(found), f"give {_expected(path, schema)}")


def _inside(path: KeyPath, table: type[Table], found: dict[str, Any]) -> Iterator[Sentence]:
    """What is wrong with the keys of a table whose own name is misspelt."""
    try:
        table.model_validate(found)
    except ValidationError as error:
        for sentence in sentences(error, table):
            yield sentence._replace(key=path + sentence.key)


def _nearest(path: KeyPath, known: Tables) -> KeyPath:
    """The key path that an unknown one was probably meant to be, () if none comes near."""
    parent, key = _names(path[:-1]), str(path[-1])
    elsewhere = [table for table, model in known.items() if key in model.model_fields]
    if elsewhere:
        return (*elsewhere[0], key)
    for table in (parent, *known):
        if near := get_close_matches(key, known[table].model_fields, n=1, cutoff=0.7):
            return (*table, near[0])
    return ()


def _suggestion(path: KeyPath, meant: KeyPath, known: Tables) -> str:
    parent, key = _names(path[:-1]), path[-1]
    if not meant:
        keys = ", ".join(known[parent].model_fields)
        return f"the keys {f'of [{key_text(parent)}]' if parent else 'at the top'} are {keys}"
    if meant in known:
        return f"did you mean [{key_text(meant)}]?"
    if meant[-1] != key and meant[:-1] == parent:
        return f'did you mean "{meant[-1]}"?'
    owners = [f"[{key_text(table)}]" for table, model in known.items() if meant[-1] in model.model_fields]
    return f"did you mean {meant[-1]} of {' or '.join(owners)}?"


def _names(path: KeyPath) -> KeyPath:
    """A key path without the places in lists."""
    return tuple(part for part in path if isinstance(part, str))


def _expected(path: KeyPath, schema: dict[str, Any]) -> str:
    """What belongs at a key path, from the JSON Schema: "a number above 0, in kg"."""
    node = schema
    unit = ""
    for part in path:
        node = node["items"] if isinstance(part, int) else node["properties"][part]
        unit = node.get("unit", unit)
        node = schema["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    if "enum" in node:
        return "one of " + ", ".join(f'"{choice}"' for choice in node["enum"])
    if node["type"] == "object":
        required = node.get("required", []) + node.get("oneOf", [{}])[0].get("required", [])
        return f"the table [{key_text(path)}]" + (f" with {' and '.join(required)}" if required else "")
    measured = f", in {unit}" if unit not in ("", "1") else ""
    if "array" in node["type"]:
        at_least = " of at least one entry" if "minItems" in node else ""
        return f"a list{at_least}, each {_kind(node['items'])}{measured}"
    return _kind(node) + measured


def _kind(node: dict[str, Any]) -> str:
    if "type" not in node:
        return "a value"
    kind = {
        "number": "a number",
        "integer": "a whole number",
        "boolean": "true or false",
        "string": "one line of text in quotes",
    }[node["type"]]
    if "exclusiveMinimum" in node:
        return f"{kind} above {node['exclusiveMinimum']:g}"
    if "maximum" in node:
        return f"{kind} from {node['minimum']} to {node['maximum']}"
    return f"{kind} of at least {node['minimum']:g}" if "minimum" in node else kind


def _found(value: object) -> str:
    return f" (found {value_text(value)})"
