"""What a result file holds under declared names is checked before anyone uses it; other contents are left alone.

HDF5 ends the process on some attributes of a wrong type, and makes room for whatever size a file claims. So types
and sizes are looked at first, and references are followed here.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from fnmatch import fnmatchcase
from typing import Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5s, h5t, h5z
from numpy.typing import NDArray

from brakecli.errors import escaped
from brakecli.files import fields, stability_fields
from brakecli.files.field import LARGEST, Field

LARGEST_SQUARE = 1e300  # magnitude in variables that hold squares, as spectra do
BLOCK = 1 << 20  # rows read at a time
_CONTROLS = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")  # which neither XML nor TOML may hold
_RATIO = 1100  # no filter of HDF5 makes data smaller than this
# levels of groups and their variables, and the number of both
DEEPEST = 8
_MOST_NODES = 10_000
_MOST_ATTRIBUTES = 1000  # of a group or a variable
MOST_MEMORY = 1_250_000_000  # bytes of unpacked values: a variable of the largest sweep takes nearly as many
_TEXTS = ("format", "kind", "title", "case_toml", "resolved_toml", "sweep_toml", "resolved_sweep_toml")
_WHOLE = ("format_version", "complete")
_ATTRIBUTES = {
    ("run", "/"): fields.RUN,
    ("run", "/spectrum"): fields.WELCH,
    ("run", "/events"): fields.EARLIER,
    ("sweep", "/"): fields.SWEEP,
    ("comparison", "/"): fields.COMPARISON,
    ("stability", "/"): stability_fields.LOCK_IN,
    ("branch", "/"): stability_fields.BRANCH,
    ("branch", "/branch_*"): stability_fields.ONE_BRANCH,
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
_OBJECTS = {f"/{each.group}": each for each in fields.RUN if each.group}  # whose items are attributes of a group
_BRIEFEST = 1e-120  # between two numbers of an axis: beyond what the smallest and largest of a case make
_MACHINERY = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Encoding", "_FillValue"}  # of netCDF-4


def check_variables(file: h5py.File, kind: str, length: int) -> None:
    """Raise ValueError for a declared variable of a wrong type, shape or size, or an axis that does not rise.

    `length`: of the file in bytes.
    """
    named = [(group, declared) for (its_kind, group), declared in _VARIABLES.items() if its_kind == kind]
    numbered = [
        (group.replace("branch_*", name), declared)
        for name in file
        for group, declared in named
        if "*" in group and fnmatchcase(name, "branch_*")
    ]
    for group, declared in [each for each in named if "*" not in each[0]] + numbered:
        parent = member(file, group)
        if parent is None:
            continue
        if not isinstance(parent, h5py.Group):
            raise ValueError(f"{group} is not a group")
        members = {field.name: (field, member(parent, field.name)) for field in declared}
        if linked := [name for name, (_, node) in members.items() if node is None and name in {*parent}]:
            raise ValueError(f"variable {linked[0]} in group {group} is a link, or a view of something else")
        found = {name: (field, node) for name, (field, node) in members.items() if node is not None}
        for name, (field, node) in found.items():
            where = f"variable {name} in group {group}"
            kinds = "S" if field.kind[0] in "SO" else "iuf"  # other programs write whole numbers as floats
            if not isinstance(node, h5py.Dataset) or node.ndim == 0 or node.dtype.kind not in kinds:
                raise ValueError(f"{where} is not what belongs there: {field.meaning}")
            check_size(node, length, where)
            axis = declared[0].name
            own = shape_of(node)
            shape = shape_of(found[axis][1]) if axis in found and field is not fields.FREQUENCY else own
            if kind == "sweep" and field in (fields.DIRECTION, *fields.DIFFERENCE):
                shape = shape[1:] if field is not fields.DIRECTION else shape[:1]
            if own[: len(own) - (len(np.dtype(field.kind).shape) if field.kind[0] == "(" else 0)] != shape:
                raise ValueError(f"{where} has the shape {own}, and {axis} has {shape}")
            if field.rising:
                for block in _blocks(node):
                    check_rising(block, where)


def check_result(file: h5py.File, kind: str, length: int) -> dict[str, Any]:
    """All that is true of a result: whoever writes one makes sure of it, and whoever reads one relies on it.

    Returns what `tree` does; raises ValueError. Numbers in variables are checked as they are written and read, by
    `check_numbers`.
    """
    nodes = tree(file)
    check_variables(file, kind, length)
    for node in nodes.values():
        if isinstance(node, h5py.Group):
            attributes_of(node, kind)
    return nodes


def check_numbers(values: NDArray[Any], group: str, where: str) -> None:
    """Raise ValueError for numbers of a variable that are not finite, or too large."""
    largest = LARGEST if group == "history" else LARGEST_SQUARE
    if values.dtype.kind == "f" and not (np.abs(values) <= largest).all():
        raise ValueError(f"{where} holds values that are not finite, or too large")


def check_rising(values: NDArray[Any], where: str) -> None:
    """Raise ValueError for numbers along an axis that do not increase."""
    check_numbers(values, "history", where)
    if not (np.diff(values) > _BRIEFEST).all():
        raise ValueError(f"{where} does not increase")


def tree(file: h5py.File) -> dict[str, Any]:
    """All groups and variables by their names, each once, the root first.

    Raises ValueError where there are too many, or groups too deep in others.
    """
    names = {file["/"]: "/"}
    groups = [("", file["/"])]
    for path, group in groups:
        for key in group:
            if (node := member(group, key)) is not None and node not in names:
                names[node] = path + key
                if len(node.attrs) > _MOST_ATTRIBUTES:
                    raise ValueError(f"{path}{key} has more than {_MOST_ATTRIBUTES} attributes")
                if names[node].count("/") >= DEEPEST or len(names) > _MOST_NODES:
                    limits = f"{_MOST_NODES} groups and variables, or groups of more than {DEEPEST} levels"
                    raise ValueError(f"it holds more than {limits}")
                groups += [(f"{path}{key}/", node)] * isinstance(node, h5py.Group)
    return {name: node for node, name in sorted(names.items(), key=lambda each: each[1])}


def look_through(file: h5py.File, length: int, *, everything: bool) -> None:
    """Read all attributes of known types, and of variables their axes and sizes, or everything.

    Variables with texts of any length are not read: all entries may refer to one very long text.
    """
    for name, node in tree(file).items():
        for attribute in node.attrs:
            plain_attribute(node, attribute)
        with suppress(Exception):
            if isinstance(node, h5py.Dataset):
                axes_of(node, name)
                check_size(node, length, name)
                for _ in _blocks(node) if everything and node.dtype.kind in "iufS" else ():
                    pass


def check_size(node: h5py.Dataset, length: int, where: str) -> None:
    """Raise ValueError for a dataset that claims more than a file of this length (bytes) can hold."""
    plist = node.id.get_create_plist()
    stored = node.id.get_storage_size()
    ratio = _RATIO if packed(node) else 1
    room = node.size * node.dtype.itemsize
    chunk = 0
    if plist.get_layout() == h5d.CHUNKED:
        chunk = int(np.prod(node.chunks, dtype=object)) * node.dtype.itemsize
    own = plist.get_layout() in (h5d.CHUNKED, h5d.CONTIGUOUS, h5d.COMPACT) and not plist.get_external_count()
    if not own or stored > length or max(room, chunk * bool(room)) > ratio * stored:
        raise ValueError(f"{where} claims {node.size} values, which are not in the file")
    check_memory(chunk * packed(node), f"a chunk of {where}")


def packed(node: h5py.Dataset) -> bool:
    """Whether a filter makes data smaller, so that the length of the file is no bound for them."""
    plist = node.id.get_create_plist()
    filters = {plist.get_filter(number)[0] for number in range(plist.get_nfilters())}
    return not filters <= {h5z.FILTER_FLETCHER32, h5z.FILTER_SHUFFLE}


def check_memory(needed: int, where: str) -> None:
    """Raise ValueError for what takes more bytes in memory, once it is unpacked, than are spent on it."""
    if needed > MOST_MEMORY:
        raise ValueError(f"{where} takes {needed} bytes in memory, and {MOST_MEMORY} are the most")


def axes_of(node: h5py.Dataset, name: str) -> tuple[str, ...]:
    """The names of the axes of a variable; empty where it has none."""
    if plain_attribute(node, "CLASS") == "DIMENSION_SCALE" and (node.ndim < 2 or node.dtype == "S1"):
        return (name, f"string{node.shape[-1]}")[: node.ndim] if node.ndim else (name,)  # of texts: as xarray does
    if "DIMENSION_LIST" not in node.attrs:
        return tuple("" for _ in node.shape)
    attribute = h5a.open(node.id, b"DIMENSION_LIST")
    kind = attribute.get_type()
    if not isinstance(kind, h5t.TypeVlenID) or not kind.get_super().equal(h5t.STD_REF_OBJ):
        raise ValueError(f"attribute DIMENSION_LIST of {name} holds no references")
    lists = node.attrs["DIMENSION_LIST"]
    if np.shape(lists) != (node.ndim,):
        raise ValueError(f"attribute DIMENSION_LIST of {name} does not fit its {node.ndim} dimensions")
    names = [str(node.file[axes[0]].name) if len(axes) else "" for axes in lists]
    return tuple([each.rpartition("/")[2] for each in names])


def is_axis_alone(node: h5py.Dataset) -> bool:
    """Whether it names an axis of other variables and has no values, by the mark of netCDF-4."""
    mark = "This is a netCDF dimension but not a netCDF variable"
    return not node.id.get_storage_size() and str(plain_attribute(node, "NAME")).startswith(mark)


def shape_of(node: h5py.Dataset) -> tuple[int, ...]:
    """The shape of a variable, whose texts xarray may have saved as rows of letters along an axis of their own."""
    letters = node.dtype == "S1" and node.ndim and axes_of(node, "")[-1] == f"string{node.shape[-1]}"
    return tuple(node.shape[:-1] if letters else node.shape)


def member(group: h5py.Group, name: str) -> Any:
    """What a group holds under a name; None where there is nothing, or only a link or a view of something else.

    HDF5 opens what such a view shows as soon as its shape is asked for, and crashes on one that shows itself.
    """
    if name == "/":
        return group
    for part in name.strip("/").split("/"):
        if not isinstance(group, h5py.Group) or not isinstance(group.get(part, getlink=True), h5py.HardLink):
            return None
        group = group[part]
        if isinstance(group, h5py.Dataset) and group.id.get_create_plist().get_layout() == h5d.VIRTUAL:
            return None
    return group


def attributes_of(node: h5py.HLObject, kind: str) -> dict[str, Any]:
    """Attributes as str, int, float, list of str, or array of numbers; foreign ones of other types are left out.

    Raises ValueError for a declared one that is not what was declared.
    """
    name = "/branch_*" if fnmatchcase(str(node.name), "/branch_*") else str(node.name)
    declared = [each for each in _ATTRIBUTES.get((kind, name), ()) if each.in_file]
    given = {name: plain_attribute(node, name) for name in node.attrs if name not in _MACHINERY}
    if node.name == "/":
        declared += [Field(name, "", "a text", fields.TEXT) for name in _TEXTS]
        declared += [Field(name, "", "a whole number", "i8") for name in _WHOLE]
    elif kind == "run" and (item := _OBJECTS.get(str(node.name))):  # of numbers; evidence also has lists and words
        free = {name for name, value in given.items() if isinstance(value, str) or np.ndim(value) == 1}
        free = free if item.name == "evidence" else set()
        declared = [Field(name, "", item.meaning) for name in given if name not in free]
    known = {field.name: field for field in declared}
    found = {name: _formed(known.get(name), value) for name, value in given.items()}
    for name, value in found.items() if isinstance(node, h5py.Group) else ():
        if not isinstance(value, str | list) and value is not None and not np.isfinite(value).all():
            raise ValueError(f"attribute {name} holds numbers that are not finite")
    for name, field in known.items():
        if name in found and not _fits(field, found[name]):
            raise ValueError(f"attribute {name} is not what belongs there: {field.meaning}")
    return {name: value for name, value in found.items() if value is not None}


def plain_attribute(node: h5py.HLObject, name: str) -> Any:
    """An attribute; None where it is missing, or neither numbers nor UTF-8."""
    if name not in node.attrs:
        return None
    attribute = h5a.open(node.id, name.encode("utf-8", "surrogateescape"))
    plain = attribute.get_type().get_class() in (h5t.INTEGER, h5t.FLOAT, h5t.STRING)
    if not plain or attribute.get_space().get_simple_extent_type() == h5s.NULL:
        return None
    value = node.attrs[name]
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
        return value
    value = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    try:
        return _decoded(value)
    except UnicodeError:
        return None


def _decoded(value: Any) -> Any:
    if isinstance(value, list):
        return [_decoded(each) for each in value]
    if isinstance(value, bytes | str):
        value = value.decode() if isinstance(value, bytes) else value
        value.encode()  # h5py marks what is not UTF-8
        return plain_text(value)
    return value


def plain_text(text: str) -> str:
    """A text without control characters but ends of lines: neither pages nor pictures in SVG may hold them."""
    return _CONTROLS.sub(lambda found: escaped(found[0]), text)


def _formed(field: Field | None, value: Any) -> Any:
    """An attribute as it is declared: xarray saves an array of one for a number, and a text for a list of one."""
    if field is None:
        return value
    if field.kind == fields.OBJECT and not field.rows:
        return [value] if isinstance(value, str) else value
    return value.item() if isinstance(value, np.ndarray) and value.shape == (1,) else value


def _fits(field: Field, value: Any) -> bool:
    """Whether an attribute is what was declared."""
    whole = isinstance(value, int)
    if field.kind[0] == "f":
        return (whole or isinstance(value, float)) and abs(value) <= LARGEST
    if field.kind[0] == "i" or field.rows:
        return whole
    if field.kind != fields.OBJECT:
        return isinstance(value, str)
    if field.units:
        return isinstance(value, np.ndarray)
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _blocks(node: h5py.Dataset) -> Iterator[Any]:
    """The rows of a dataset in pieces, each beginning with the last row of the one before."""
    row = int(np.prod(node.shape[1:], dtype=object))
    check_memory(row * node.dtype.itemsize * packed(node), f"a row of {node.name}")
    rows = max(1, BLOCK // max(1, row))
    for start in range(0, node.shape[0], rows):
        yield np.asarray(node[max(start - 1, 0) : start + rows])
