"""What result files hold and how two differ, as tables for people."""

from collections.abc import Mapping
from typing import Any

from brakecli.errors import value_text
from brakecli.front.render import text_of
from brakecli.front.tables import grid, two_columns

_ASIDE = ("regime/", "adjustments", "reasons", "warnings", "modelled", "left_out")  # long, and in --json


def info_table(numbers: Mapping[str, Any]) -> str:
    """Contents of a file, a row for each group of variables."""
    groups: dict[str, list[str]] = {}
    for each in numbers["variables"]:
        sizes = " x ".join(f"{name} {size}" for name, size in zip(each["dims"], each["shape"], strict=True))
        groups.setdefault(f"{each['group']}: {sizes}", []).append(each["name"])
    changed = "unchecked: no digest vouches for its bytes"
    made = ", ".join(f"{name} {version}" for name, version in numbers["versions"].items())
    rows = [
        ("kind", str(numbers["kind"]) + (f", {numbers['status']}" if numbers["status"] else "")),
        ("title", numbers["title"] or "-"),
        ("whole", "yes, every byte is as it was written" if numbers["whole"] else changed),
        ("size", f"{numbers['bytes'] / 1e6:.3g} MB"),
        ("made by", made),
        *((where, ", ".join(names)) for where, names in groups.items()),
    ]
    return two_columns(numbers["file"], rows)


def diff_table(files: Mapping[str, str], numbers: Mapping[str, Any]) -> str:
    """Keys, numbers and variables that differ, each side by side."""
    parts = [_prose(numbers["sentence"])]
    for name in ("case", "numbers", "versions"):
        shown = [each for each in numbers[name] if not each["name"].startswith(_ASIDE)]
        if shown:
            columns = {name: [each["name"] for each in shown]}
            for side in ("a", "b"):
                columns[files[side]] = [_text(each[side], each.get("units")) for each in shown]
            parts.append(grid(columns))
        if more := len(numbers[name]) - len(shown):
            parts.append(f"{more} more with reasons and evidence differ; --json lists them")
    alike = [each for each in numbers["variables"] if each["compared"] and not each["different"]]
    if variables := [each for each in numbers["variables"] if each not in alike]:
        columns = {
            "variable": [_place(each) for each in variables],
            "differ": [f"{each['different']} of {each['compared']}" for each in variables],
            "by at most": [_text(each["largest"], each["units"], ".3g") for each in variables],
            "of the largest": [text_of(each["relative"], form=".2%") for each in variables],
            "shapes": [_shapes(each) for each in variables],
        }
        if all(each["shapes"][0] == each["shapes"][1] for each in variables):
            del columns["shapes"]
        parts.append(grid(columns))
    if alike:
        named = ", ".join(f"{_place(each)} ({_shapes(each)})" for each in alike)
        parts.append(_prose(f"the same where both have values, of different lengths: {named}"))
    if along := {each["interpolated"]: None for each in numbers["variables"] if each["interpolated"]}:
        parts.append(f"compared at equal {' and '.join(along)}; the finer result is interpolated")
    if files["output"]:
        parts.append(f"{files['output']}: written")
    return "\n\n".join(parts)


def _prose(text: str) -> str:
    """A sentence in lines as wide as the terminal."""
    return grid({"": [text]}, show_header=False)


def _text(value: Any, units: str | None = None, form: str = ".6g") -> str:
    if isinstance(value, float) or value is None:
        return text_of(value, units or "", form)
    return value_text(value).strip('"')


def _place(variable: Mapping[str, Any]) -> str:
    return f"{variable['group']}/{variable['name']}".replace("//", "")


def _shapes(variable: Mapping[str, Any]) -> str:
    return " and ".join(map(_shape, variable["shapes"]))


def _shape(shape: Any) -> str:
    return "-" if shape is None else " x ".join(map(str, shape))
