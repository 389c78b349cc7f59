"""Results and numbers as xarray holds them."""

import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import xarray as xr

from brakecli.errors import BrakecliError, UsageError
from brakecli.results.field import Field
from brakecli.results.read import explained, open_result
from brakecli.results.valid import declared_attributes
from brakecli.results.write import ResultFile, new_result

_WITHOUT_GAPS = ("history", "spectrum", "spectrogram", "events")
"""Groups of a run in which no number is missing."""


def read_tree(path: Path) -> xr.DataTree:
    """A result file in memory. A run without a frequency has NaN as its attribute `frequency`, as no file has."""
    with open_result(path) as result, explained(path):
        result.stream.seek(0)
        with xr.open_datatree(result.stream, engine="h5netcdf") as tree:
            loaded: xr.DataTree = tree.load()
    if loaded.attrs["kind"] == "run":
        loaded.attrs.setdefault("frequency", math.nan)
    return loaded


def save(data: xr.Dataset | xr.DataTree, path: Path, *, force: bool = False) -> None:
    """Keep a result in memory as a file; raises UsageError for what is no whole result, and CannotWriteError."""
    try:
        tree = data if isinstance(data, xr.DataTree) else xr.DataTree(data)
        if not isinstance(kind := tree.attrs.get("kind"), str):
            raise ValueError("attribute kind is missing, as of a part of a result")
        with new_result(path, force=force) as result:
            for node in tree.subtree:
                _write(result, node, kind)
            result.finish()
            result.publish()
    except (ValueError, TypeError) as error:
        remedy = "give all that a function of brakecli gave, with finite numbers, selected by lists or slices"
        raise UsageError(f"{path}: is no result that can be kept: {error}; {remedy}") from error


def _write(result: ResultFile, node: xr.DataTree, kind: str) -> None:
    """Write a group; ValueError and TypeError tell what a result cannot hold."""
    group = node.path.strip("/") or "/"
    declared = declared_attributes(kind, group)
    for name, value in node.attrs.items():
        if isinstance(value, np.ndarray) and value.dtype.kind not in "iuf":
            value = value.tolist()
        if name in declared and declared[name].is_list and np.ndim(value) == 0:  # as xarray reads a list of one
            value = np.array([value]) if declared[name].units else [value]
        if not (isinstance(value, float) and math.isnan(value)):  # a number that does not exist
            result.set_attributes({str(name): value}, group)
    data = node.to_dataset(inherit=False)
    indices = {axis: np.arange(size) for axis, size in data.sizes.items() if axis not in data.coords}
    data = data.assign_coords({axis: node.coords.get(axis, places) for axis, places in indices.items()})
    for name in sorted(data.variables, key=lambda name: name not in data.sizes):  # axes come first
        variable = data.variables[name]
        dims = [str(axis) for axis in variable.dims]
        about = dict(variable.attrs)
        values = variable.values
        if values.dtype.kind in "OT" and all(isinstance(text, str) for text in values.flat):
            values = values.astype(np.str_)
        form = {"f": "f8", "U": "S"}.get(values.dtype.kind, values.dtype.str)
        field = Field(str(name), about.pop("units", ""), about.pop("long_name", str(name)), form)
        if name in data.sizes or group in _WITHOUT_GAPS:
            result.variable(group, field, dims, values, **about)
        else:
            result.column(field, dims, values, group, **about)


@contextmanager
def stored(data: xr.Dataset | xr.DataTree, name: str) -> Iterator[Path]:
    """A result in memory as a file of this name, within the block; messages call it by its name."""
    with tempfile.TemporaryDirectory(prefix="brakecli-") as folder:
        path = Path(folder) / name
        try:
            save(data, path)
            yield path
        except BrakecliError as error:
            error.args = (str(error).replace(f"{folder}/", ""),)
            raise


def dataset(declared: Iterable[Field], numbers: Mapping[str, object]) -> xr.Dataset:
    """Numbers and texts as variables with their units; lists as attributes, and objects, as JSON."""
    result = xr.Dataset()
    by_name = {field.name: field for field in declared}
    for name, value in numbers.items():
        field = by_name.get(name)
        if isinstance(value, list | tuple | dict):
            flat = not isinstance(value, dict) and all(isinstance(item, str | int | float) for item in value)
            result.attrs[name] = list(value) if flat else json.dumps(value)
        elif field and field.kind != "O":
            missing = "" if field.kind.startswith("S") else float("nan")
            about = {"units": field.units, "long_name": field.meaning}
            result[name] = ((), missing if value is None else value, about)
    return result
