"""What pydantic found wrong with a table, in plain sentences that name the remedy."""

from collections.abc import Iterator
from dataclasses import replace
from difflib import get_close_matches

from pydantic import ValidationError
from pydantic.json_schema import JsonSchemaValue

from brakecli.case.tables import LARGEST, MISSING, SMALLEST, Table, key_schema, tables_within
from brakecli.errors import KeyPath, Problem, found_text, key_text

_WHAT = {
    "float_type": "is not a number",
    **dict.fromkeys(("int_type", "multiple_of"), "is not a whole number"),
    "bool_type": "is neither true nor false",
    "string_type": "is not a text",
    "string_pattern_mismatch": "holds a line break or a control character",
    **dict.fromkeys(("enum", "literal_error"), "is not one of the choices"),
    "tuple_type": "is not a list",
    "model_type": "is not a table",
    "too_short": "is too short",
    "string_too_short": "is empty",
    "finite_number": "is not finite",
    **dict.fromkeys(("greater_than", "greater_than_equal", "less_than_equal"), "is out of range"),
    "magnitude": f"is not between {SMALLEST:g} and {LARGEST:g} in magnitude",
}
"""The kinds of error that pydantic reports for one value of a case."""
_TEXT = "one line of text in quotes"
_KINDS = {"number": "a number", "integer": "a whole number", "boolean": "true or false", "string": _TEXT}


def problems(error: ValidationError, kind: type[Table], where: str = "at the top") -> Iterator[Problem]:
    """Everything that is wrong with a table, in plain words; where says to what its own keys belong."""
    tables = tables_within(kind)
    errors = error.errors(include_url=False)
    meant = {
        details["loc"]: _meant(details["loc"], tables)
        for details in errors
        if details["type"] == "extra_forbidden"
    }
    misspelt = [paths[0] for paths in meant.values() if paths]
    for details in errors:
        path = details["loc"]
        value = details["input"]
        reason = details["type"]
        if reason == "rule":
            problem = replace(details["ctx"]["problem"], path=path)
            if problem.what != MISSING or not any(_may_be(problem, near) for near in misspelt):
                yield problem
        elif reason == "missing":
            if path not in misspelt:
                yield Problem(path, MISSING, f"give {_expected(path, kind)}")
        elif reason == "model_type" and isinstance(value, float) and (needed := _required(key_schema(kind, path))):
            choices = " or ".join(key_text((*path, key)) for key in needed)
            yield Problem(path, "is a table, not a number" + found_text(value), f"did you mean {choices}?")
        elif reason != "extra_forbidden":
            too_large = reason == "float_type" and type(value) is int
            yield Problem(
                path,
                _WHAT["magnitude" if too_large else reason] + found_text(value),
                f"give {_expected(path, kind)}",
            )
        elif path[0] == "friction" and ("friction", "coefficient") not in meant[path]:
            remedy = "the model has one coefficient, the same in stick and in slip: give friction.coefficient"
            yield Problem(path, "is unknown" + found_text(value), remedy)
        elif not meant[path]:
            parent = _table(path)
            keys = ", ".join(tables[parent].model_fields)
            remedy = f"the keys {f'of {_name(parent, tables)}' if parent else where} are {keys}"
            yield Problem(path, "is unknown" + found_text(value), remedy)
        else:
            near = " or ".join(_name(near, tables) for near in meant[path])
            yield Problem(path, "is unknown" + found_text(value), f"did you mean {near}?")
            inner = tables.get(_names(meant[path][0]))
            if inner and isinstance(value, dict):  # a table whose name is misspelt has keys, too
                try:
                    inner.model_validate(value)
                except ValidationError as wrong:
                    for problem in problems(wrong, inner, f"of {near}"):
                        yield replace(problem, path=path + problem.path)


def _meant(path: KeyPath, tables: dict[KeyPath, type[Table]]) -> list[KeyPath]:
    """The key paths that an unknown one was probably meant to be; empty if none comes near."""
    parent = _table(path)
    key = str(path[-1])
    names = dict.fromkeys(name for kind in tables.values() for name in kind.model_fields)
    if key not in names:
        # less likeness is enough in its own table: nmu for num
        if near := get_close_matches(key, tables[parent].model_fields, n=1, cutoff=0.65):
            return [(*path[:-1], near[0])]
        key = next(iter(get_close_matches(key, names, n=1, cutoff=0.7)), "")
    return [(*table, key) for table, kind in tables.items() if key in kind.model_fields]


def _may_be(missing: Problem, path: KeyPath) -> bool:
    """Whether a key is the one that is missing, or one of the choices in its place."""
    return missing.path[:-1] == path[:-1] and path[-1] in (missing.path[-1], *missing.instead)


def _name(path: KeyPath, tables: dict[KeyPath, type[Table]]) -> str:
    path = _names(path)
    return _header(path, tables[()]) if path in tables else key_text(path)


def _header(path: KeyPath, kind: type[Table]) -> str:
    is_list = key_schema(kind, path)["type"] == "array"
    return f"[[{key_text(path)}]]" if is_list else f"[{key_text(path)}]"


def _names(path: KeyPath) -> KeyPath:
    """A path without the places in lists."""
    return tuple(step for step in path if isinstance(step, str))


def _table(path: KeyPath) -> KeyPath:
    """The table around a key, without the places in lists."""
    return _names(path[:-1])


def _expected(path: KeyPath, kind: type[Table]) -> str:
    """What belongs at a key path, by its JSON Schema: "a number above 0, in kg"."""
    node = key_schema(kind, path)
    if "anyOf" in node:  # a number, or a word in its place
        number, word = node["anyOf"]
        return f'{_value(number)}, in {node["unit"]}, or "{word["const"]}"'
    if "enum" in node:
        return "one of " + ", ".join(f'"{choice}"' for choice in node["enum"])
    if node["type"] == "object":
        required = _required(node)
        return f"the table [{key_text(path)}]" + (f" with {' and '.join(required)}" if required else "")
    if "array" in node["type"] and path in tables_within(kind):
        return f"each entry under a header of its own, {_header(path, kind)}"
    if "array" in node["type"]:
        text = f"a list{' of at least one entry' if 'minItems' in node else ''}, each {_value(node['items'])}"
    elif "minLength" in node:
        text = "a text of at least one character"
    else:
        text = _value(node)
    return text if node.get("unit") in (None, "1") else f"{text}, in {node['unit']}"


def _required(node: JsonSchemaValue) -> list[str]:
    """The keys that a table needs, by its JSON Schema; of groups that exclude each other, those of the first."""
    return [*node.get("required", []), *node.get("oneOf", [{}])[0].get("required", [])]


def _value(node: JsonSchemaValue) -> str:
    text = _KINDS.get("integer" if "multipleOf" in node else node.get("type", ""), "a value")
    if "exclusiveMinimum" in node:
        return f"{text} above {node['exclusiveMinimum']:.9g}"
    if "maximum" in node:
        return f"{text} from {node['minimum']:.9g} to {node['maximum']:.9g}"
    return f"{text} of at least {node['minimum']:.9g}" if "minimum" in node else text
