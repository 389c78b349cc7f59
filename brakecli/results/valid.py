"""What is true of every result: whoever writes one makes sure of it, and whoever reads one relies on it."""

import re
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from brakecli.results import fields, stability_fields
from brakecli.results.field import LARGEST, LARGEST_SQUARE, Field
from brakecli.results.read import BLOCK, attributes_of, check_form, groups_of

_TEXTS = ("format", "kind", "title", "case_toml", "resolved_toml", "sweep_toml", "resolved_sweep_toml")
_WHOLE = ("format_version", "complete")
_ROOT = (
    *(Field(name, "", "a text", fields.TEXT) for name in _TEXTS),
    *(Field(name, "", "a whole number", "i8") for name in _WHOLE),
)
_ATTRIBUTES = {
    ("run", "/"): fields.RUN,
    ("run", "spectrum"): fields.WELCH,
    ("run", "events"): fields.EARLIER,
    ("sweep", "/"): fields.SWEEP,
    ("comparison", "/"): fields.COMPARISON,
    ("stability", "/"): stability_fields.LOCK_IN,
    ("branch", "/"): stability_fields.BRANCH,
    ("branch", "branch_*"): stability_fields.ONE_BRANCH,
    ("scatter", "/"): stability_fields.SCATTER,
}
_VARIABLES = {  # the first of a kind has the length of all
    ("run", "history"): fields.HISTORY,
    ("run", "spectrum"): (fields.FREQUENCY, *fields.SPECTRUM.values()),
    ("run", "unconverged"): fields.UNCONVERGED,
    ("run", "events"): fields.EVENTS,
    ("run", "over_time"): (fields.WINDOW_TIME, *fields.OVER_TIME),
    ("run", "spectrogram"): (fields.WINDOW_TIME, fields.FREQUENCY, fields.SHORT_TIME),
    ("run", "vibrations"): (fields.INTERVAL, *fields.VIBRATION),
    ("sweep", "/"): (
        *fields.POINT,
        *fields.CRITICAL,
        *fields.STARTS,
        *fields.DIFFERENCE,
        fields.DIRECTION,
    ),
    ("sweep", "attractors"): fields.ATTRACTOR,
    ("comparison", "/"): (fields.ENTRY_PLACE, *fields.ENTRY),
    ("stability", "/"): (*stability_fields.VARIED, *stability_fields.MODES),
    ("branch", "branch_*"): stability_fields.BRANCH_POINT,
    ("scatter", "/"): (stability_fields.SAMPLE, *stability_fields.SCATTERED),
    ("branch", "branch_*/special"): stability_fields.SPECIAL,
}
_OBJECTS = {field.group: field for field in fields.RUN if field.group}  # whose items are attributes of a group


def check_result(file: h5py.File) -> None:
    """Raise ValueError where a result has a declared attribute or variable that is not what was declared.

    Numbers in variables are checked as they are written, by `check_numbers`.
    """
    root = attributes_of(file)
    check_form(root)
    kind = str(root.get("kind"))
    for group in groups_of(file):
        _check_attributes(attributes_of(file[group]), kind, group)
        if declared := _VARIABLES.get((kind, _every(group))):
            _check_variables(file[group], kind, group, declared)


def declared_attributes(kind: str, group: str) -> dict[str, Field]:
    """The attributes that a group of a result of this kind may have, by name."""
    declared = [field for field in _ATTRIBUTES.get((kind, _every(group)), ()) if field.in_file]
    return {field.name: field for field in (*declared, *_ROOT * (group == "/"))}


def check_numbers(values: NDArray[Any], group: str, where: str) -> None:
    """Raise ValueError for numbers of a variable that are not finite, or too large."""
    largest = LARGEST if group == "history" else LARGEST_SQUARE
    if values.dtype.kind == "f" and not (np.abs(values) <= largest).all():
        raise ValueError(f"{where} holds values that are not finite, or too large")


def _every(group: str) -> str:
    """The name of a group under which it is declared: all branches have one."""
    return re.sub(r"^branch_\d+", "branch_*", group)


def _check_attributes(attributes: Mapping[str, Any], kind: str, group: str) -> None:
    declared = declared_attributes(kind, group)
    if kind == "run" and (item := _OBJECTS.get(group)):  # of numbers; evidence also has lists and words
        free = {name for name, value in attributes.items() if isinstance(value, str) or np.ndim(value) == 1}
        declared = {
            name: Field(name, "", item.meaning)
            for name in attributes
            if item.name != "evidence" or name not in free
        }
    for name, field in declared.items():
        if name in attributes and not _fits(field, attributes[name]):
            raise ValueError(f"attribute {name} is not what belongs there: {field.meaning}")


def _check_variables(parent: h5py.Group, kind: str, group: str, declared: tuple[Field, ...]) -> None:
    """Raise ValueError for a declared variable of a wrong type or shape, or an axis that does not rise."""
    axis = declared[0].name
    for field in declared:
        if field.name not in parent:
            continue
        node = parent[field.name]
        where = f"variable {field.name} in group {group}"
        if node.dtype.kind not in ("S" if field.kind[0] in "SO" else "iuf"):
            raise ValueError(f"{where} is not what belongs there: {field.meaning}")
        shape = parent[axis].shape if axis in parent and field is not fields.FREQUENCY else node.shape
        if kind == "sweep" and field in (fields.DIRECTION, *fields.DIFFERENCE):
            shape = shape[1:] if field is not fields.DIRECTION else shape[:1]
        inner = len(np.dtype(field.kind).shape) if field.kind[0] == "(" else 0
        if node.shape[: len(node.shape) - inner] != shape:
            raise ValueError(f"{where} has the shape {node.shape}, and {axis} has {shape}")
        for start in range(0, len(node), BLOCK) if field.rising else ():
            # less lies beyond what the smallest and largest numbers of a case make
            if not (np.diff(node[max(start - 1, 0) : start + BLOCK]) > 1e-120).all():
                raise ValueError(f"{where} does not increase")


def _fits(field: Field, value: object) -> bool:
    """Whether an attribute is what was declared."""
    whole = isinstance(value, int)
    if field.kind[0] == "f":
        return isinstance(value, int | float) and abs(value) <= LARGEST
    if field.kind[0] == "i" or field.rows:
        return whole
    if not field.is_list:
        return isinstance(value, str)
    if field.units:
        return isinstance(value, np.ndarray)
    return isinstance(value, list) and all(isinstance(item, str) for item in value)
