"""Results and numbers as xarray holds them."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import xarray as xr

from brakecli.errors import UnreadableResultError
from brakecli.files.field import Field
from brakecli.files.read import open_result


def opened(path: Path) -> xr.DataTree:
    """A result file in memory, checked; what other programs have put there may be more than xarray takes."""
    try:
        with open_result(path) as result:
            _once(result.file)
            for group in result.groups:
                result.variables(group)  # damaged axes end xarray without a word
        with xr.open_datatree(path, engine="h5netcdf", phony_dims="access") as tree:
            return tree.load()
    except (ValueError, TypeError, LookupError, AttributeError, OSError, RuntimeError) as error:
        what = f"{path}: xarray cannot read what it holds: {error}"
        raise UnreadableResultError(f"{what}; compute the result again") from error


def _once(root: Any) -> None:
    """Raise ValueError where a group holds one that was seen before: xarray would read on without an end.

    So it would behind a link to another file, which is no part of the result.
    """
    seen, groups = {root}, [root]
    while groups:
        group = groups.pop()
        for name in group:
            if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
                raise ValueError(f"the group {group.name} holds {name}, which is a link to another file")
        for inner in (each for name in group if hasattr(each := group.get(name), "keys")):
            if inner in seen:
                raise ValueError(f"the group {group.name} holds {inner.name}, which stands elsewhere, too")
            seen.add(inner)
            groups.append(inner)


def dataset(declared: Iterable[Field], numbers: Mapping[str, Any]) -> xr.Dataset:
    """Numbers and texts as variables with their units; lists as attributes, and objects, as JSON."""
    found, known = xr.Dataset(), {field.name: field for field in declared}
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
