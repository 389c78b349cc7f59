"""What pydantic found wrong with a table, in plain sentences that name the remedy."""

from collections.abc import Iterator
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError

from brakecli.case.tables import LARGEST, MISSING, SMALLEST, Table, key_schema, tables_within
from brakecli.errors import KeyPath, Problem, found, key_text

_WHAT = {
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
"""The kinds of error that pydantic reports for one value of a case."""

_KINDS = {
    "number": "a number",
    "integer": "a whole number",
    "boolean": "true or false",
    "string": "one line of text in quotes",
}


def problems(error: ValidationError, kind: type[Table]) -> Iterator[Problem]:
    """Everything that is wrong with a table, in plain words."""
    tables = tables_within(kind)
    errors = error.errors(include_url=False)
    meant = {each["loc"]: _nearest(each["loc"], tables) for each in errors if each["type"] == "extra_forbidden"}
    for each in errors:
        path, value = each["loc"], each["input"]
        match each["type"]:
            case "rule":
                yield replace(each["ctx"]["problem"], path=path)
            case "extra_forbidden":
                yield Problem(path, "is unknown" + found(value), _suggestion(path, meant[path], tables))
                if (
                    meant[path] and meant[path] in tables and isinstance(value, dict)
                ):  # the name of a table is misspelt
                    yield from _within(path, tables[meant[path]], value)
            case "missing":
                if path not in meant.values():  # otherwise it is misspelt
                    yield Problem(path, MISSING, f"give {_expected(path, kind)}")
            case reason:
                too_large = reason == "float_type" and type(value) is int
                what = _WHAT["magnitude" if too_large else reason]
                yield Problem(path, what + found(value), f"give {_expected(path, kind)}")


def _within(path: KeyPath, kind: type[Table], data: dict[str, Any]) -> Iterator[Problem]:
    try:
        kind.model_validate(data)
    except ValidationError as error:
        for problem in problems(error, kind):
            yield replace(problem, path=path + problem.path)


def _nearest(path: KeyPath, tables: dict[KeyPath, type[Table]]) -> KeyPath:
    """The key path that an unknown one was probably meant to be; empty if none comes near."""
    key = str(path[-1])
    for table, kind in tables.items():
        if key in kind.model_fields:
            return (*table, key)
    for table in (_names(path[:-1]), *tables):
        if near := get_close_matches(key, tables[table].model_fields, n=1, cutoff=0.7):
            return (*table, near[0])
    return ()


def _suggestion(path: KeyPath, meant: KeyPath, tables: dict[KeyPath, type[Table]]) -> str:
    parent = _names(path[:-1])
    if not meant:
        keys = ", ".join(tables[parent].model_fields)
        return f"the keys {f'of [{key_text(parent)}]' if parent else 'at the top'} are {keys}"
    if meant in tables:
        return f"did you mean [{key_text(meant)}]?"
    if meant[:-1] == parent:
        return f'did you mean "{meant[-1]}"?'
    owners = [f"[{key_text(table)}]" for table, kind in tables.items() if meant[-1] in kind.model_fields]
    return f"did you mean {meant[-1]} of {' or '.join(owners)}?"


def _names(path: KeyPath) -> KeyPath:
    """A key path without the places in lists."""
    return tuple(part for part in path if isinstance(part, str))


def _expected(path: KeyPath, kind: type[Table]) -> str:
    """What belongs at a key path, by its JSON Schema: "a number above 0, in kg"."""
    node = key_schema(kind, path)
    if "enum" in node:
        return "one of " + ", ".join(f'"{choice}"' for choice in node["enum"])
    if node["type"] == "object":
        required = node.get("required", []) + node.get("oneOf", [{}])[0].get("required", [])
        return f"the table [{key_text(path)}]" + (f" with {' and '.join(required)}" if required else "")
    if "array" in node["type"]:
        text = f"a list{' of at least one entry' if 'minItems' in node else ''}, each {_value(node['items'])}"
    else:
        text = _value(node)
    return text if node.get("unit") in (None, "1") else f"{text}, in {node['unit']}"


def _value(node: dict[str, Any]) -> str:
    text = _KINDS.get(node.get("type", ""), "a value")
    if "exclusiveMinimum" in node:
        return f"{text} above {node['exclusiveMinimum']:.9g}"
    if "maximum" in node:
        return f"{text} from {node['minimum']:.9g} to {node['maximum']:.9g}"
    return f"{text} of at least {node['minimum']:.9g}" if "minimum" in node else text
