"""Results and numbers as xarray holds them."""

import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import xarray as xr

from brakecli.errors import BrakecliError, UnreadableResultError, UsageError
from brakecli.files import valid
from brakecli.files.field import Field
from brakecli.files.read import StoredResult, open_result
from brakecli.files.trust import MISSING, readings


def opened(path: Path, *, own: bool = False) -> xr.DataTree:
    """A result file in memory, checked; what other programs have put there may be more than xarray takes.

    A run without a frequency has NaN as its attribute `frequency`; no file holds that.
    A file that this program has just written (`own`) has no limit of memory.
    """
    try:
        with open_result(path) as result:
            _check(result, own=own)
            result.stream.seek(0)
            with xr.open_datatree(result.stream, engine="h5netcdf", phony_dims="access") as tree:
                found: xr.DataTree = tree.load()
            found.attrs |= readings.noted()
            if found.attrs.get("kind") == "run":
                found.attrs.setdefault("frequency", math.nan)
            for node in found.subtree:  # of results that xarray has saved; those of ours are read as str
                for name in [str(name) for name, each in node.variables.items() if each.dtype.kind == "S"]:
                    texts = node[name].astype(str).astype(object)
                    texts.encoding["dtype"] = "S1"  # so that a copy of the copy has the same form
                    node[name] = texts
            return found
    except (ValueError, TypeError, LookupError, AttributeError, OSError, RuntimeError, MemoryError) as error:
        reason = repr(error) if isinstance(error, LookupError) else error
        what = f"{path}: xarray cannot read what it holds: {reason}"
        raise UnreadableResultError(f"{what}; compute the result again") from error


@contextmanager
def stored(found: xr.Dataset | xr.DataTree, name: str) -> Iterator[Path]:
    """A result in memory as a file of this name, within the block; messages call it by its name.

    Raises UsageError where xarray cannot write it. What comes from a file whose digest does not fit stays marked.
    """
    with tempfile.TemporaryDirectory(prefix="brakecli-") as folder:
        path = Path(folder) / name
        found = found.copy(deep=False)
        found.attrs = {key: each for key, each in found.attrs.items() if not _missing(each)}
        try:
            found.to_netcdf(path, engine="h5netcdf")
        except (ValueError, TypeError, OSError, RuntimeError) as error:
            raise UsageError(f"{name}: xarray cannot write it as a file: {error}") from error
        before = readings.unchecked
        readings.unchecked = before | {str(path): MISSING, name: str(found.attrs.get("digest", MISSING))}
        try:
            yield path
        except BrakecliError as error:
            error.args = (str(error).replace(f"{folder}/", ""),)
            raise
        finally:
            readings.unchecked = before


def _missing(value: Any) -> bool:
    """Whether an attribute stands for a number that does not exist."""
    return isinstance(value, float) and math.isnan(value)


def _check(result: StoredResult, *, own: bool) -> None:
    """Raise ValueError where xarray would follow links, or need more memory than the file can stand for."""
    needed = 0
    for name, node in result.nodes.items():
        if isinstance(node, h5py.Group):
            result.variables(name)  # damaged axes end xarray without a word
            for inner in node:
                if valid.member(node, inner) is None or f"{name}/{inner}".lstrip("/") not in result.nodes:
                    raise ValueError(f"the group {name} holds {inner}, which is a link, or stands elsewhere, too")
        elif isinstance(node, h5py.Dataset) and not valid.is_axis_alone(node):
            if node.dtype.kind == "O":  # all entries may refer to one very long text
                raise ValueError(f"{name} holds texts or lists of any length")
            valid.check_size(node, result.length, name)
            each = node.dtype.itemsize + 64 * (node.dtype.kind == "S")  # a text is an object
            needed += 0 if own else node.size * each * valid.packed(node)
    valid.check_memory(needed, "all of it")


def dataset(declared: Iterable[Field], numbers: Mapping[str, Any]) -> xr.Dataset:
    """Numbers and texts as variables with their units; lists as attributes, and objects, as JSON."""
    found = xr.Dataset()
    known = {field.name: field for field in declared}
    for name, value in numbers.items():
        field = known.get(name)
        if isinstance(value, list | tuple | dict):
            flat = not isinstance(value, dict) and all(isinstance(each, str | int | float) for each in value)
            found.attrs[name] = list(value) if flat else json.dumps(value)
        elif field and field.kind != "O":
            missing = "" if field.kind.startswith("S") else float("nan")
            about = {"units": field.units, "long_name": field.meaning}
            found[name] = ((), missing if value is None else value, about)
    return found
