"""Writing result files: HDF5 that opens as netCDF-4, and appears whole or not at all.

The same calls give the same bytes, however the rows of a growing variable are cut into pieces.
"""

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from brakecli.errors import CannotWriteError, UsageError, found_text
from brakecli.faces import argument
from brakecli.results import valid
from brakecli.results.atomic import OutputFile, new_output
from brakecli.results.field import LARGEST_SQUARE, Field
from brakecli.results.opening import is_hdf5
from brakecli.results.os_signals import signals_deferred
from brakecli.results.read import FORMAT, FORMAT_VERSION, digest

FILL = 9.969209968386869e36  # what netCDF puts where a number is missing; the attribute `_FillValue` names it
_CHUNK = 16384  # most values in a chunk: 128 KiB of float64


@dataclass
class _Variable:
    """A declared variable, its axes, and rows that do not yet fill a chunk: only whole chunks are written."""

    field: Field
    dims: tuple[str, ...]
    attributes: dict[str, object]
    waiting: NDArray[Any]
    written: int = 0


class ResultFile:
    """A result file that is being written. A group is named by its path, the root by ``/``.

    What readers could not rely on is refused with ValueError, by the checks of `valid`. Once a write has failed,
    every method raises CannotWriteError.
    """

    def __init__(self, output: OutputFile) -> None:
        """Prepare a result in the file that `new_result` has opened."""
        self._output = output
        self._growing: dict[str, dict[str, _Variable]] = {}
        self._file: h5py.File = None

    def open(self) -> None:
        """Begin with an empty file."""
        with self._hdf5():
            # v108: headers with checksums, and any HDF5 since 1.8 reads it. No cache, as chunks are written whole
            self._file = h5py.File(self._output, "w", libver=("v108", "v108"), rdcc_nbytes=0)
        self.set_attributes({"format": FORMAT, "format_version": FORMAT_VERSION})

    def set_attributes(self, attributes: Mapping[str, object], group: str = "/") -> None:
        """Set attributes of a group: str, int, float, lists of str, and lists and arrays of numbers."""
        with self._hdf5():
            _set_attributes(self._file.require_group(group), attributes)

    def set_fields(self, fields: Iterable[Field], values: Mapping[str, Any]) -> None:
        """Set those of the fields that belong in a file, as attributes. What does not exist is left out."""
        for field in fields:
            if field.in_file and field.name in values:
                items = values[field.name] if field.group else {field.name: values[field.name]}
                present = {
                    name: value
                    for name, value in items.items()
                    if value is not None and not (isinstance(value, list) and not value)
                }
                self.set_attributes(present, field.group or "/")

    def axis(self, group: str, field: Field, values: ArrayLike | None = None) -> None:
        """Make a dimension of this name in `group`, with numbers or texts along it; without `values` it grows."""
        self.variable(group, field, (field.name,), values)

    def column(
        self, field: Field, dims: Sequence[str], values: ArrayLike, group: str = "/", **attributes: object
    ) -> None:
        """Write a variable whose numbers may be missing: None, NaN, or too large to say anything."""
        if field.kind == "f8":
            numbers = np.asarray(values, dtype=np.float64)
            values = np.where(np.abs(numbers) <= LARGEST_SQUARE, numbers, FILL)
            attributes = {"_FillValue": np.array([FILL]), **attributes}
        self.variable(group, field, dims, values, **attributes)

    def variable(
        self,
        group: str,
        field: Field,
        dims: Sequence[str],
        values: ArrayLike | None = None,
        **attributes: object,
    ) -> None:
        """Write a variable over the axes `dims` of its group; without `values` it grows along its only axis.

        A scalar belongs in an attribute: HDF5 keeps no checksum of one.
        """
        name = field.name
        growing = self._growing.setdefault(group, {})
        attributes = {"units": field.units, "long_name": field.meaning, **attributes}
        variable = _Variable(field, tuple(dims), attributes, np.empty(0, field.kind))
        if not dims or name in growing:
            raise ValueError(f"{group}/{name}: has no dimension, or is declared twice")
        if values is None:
            if len(dims) != 1 or (name != dims[0] and dims[0] not in growing):
                raise ValueError(f"{group}/{name}: only a variable over one growing axis can grow")
            growing[name] = variable
            return
        checked = _checked(group, name, values, field.kind)
        if checked.dtype.kind == "S":
            attributes["_Encoding"] = "utf-8"  # by which xarray knows text from bytes
        with self._hdf5():
            lengths = {axis: self._file[group][axis].shape[0] for axis in dims if axis != name}
            if checked.shape != tuple(lengths.get(axis, checked.size) for axis in dims):
                raise ValueError(f"{group}/{name}: its shape {checked.shape} is not that of its axes {lengths}")
            self._create(group, variable, checked.shape, checked.dtype, grows=0 in checked.shape)[...] = checked

    def begin_column(
        self, field: Field, dims: Sequence[str], kind: np.dtype[np.generic], **attributes: object
    ) -> None:
        """Begin a packed variable of the root for values of a type, with as many more axes; `fill` gives them."""
        packed: dict[str, object] = {"shuffle": True, "compression": "gzip", "compression_opts": 1}
        more = {"units": field.units, "long_name": field.meaning, **attributes}
        if kind.base.kind == "S":
            more["_Encoding"] = "utf-8"
        elif kind.base.kind == "f":
            more["_FillValue"] = np.array([FILL])
        variable = _Variable(field, tuple(dims), more, np.empty(0, kind.base))
        with self._hdf5():
            shape = tuple(self._file[axis].shape[0] for axis in dims)
            grid = shape[: len(shape) - kind.ndim]
            dtype = h5py.string_dtype("utf-8", kind.itemsize) if kind.kind == "S" else kind.base
            chunks = _chunks(grid) + shape[len(grid) :]
            self._create("/", variable, shape, dtype, grows=False, chunks=chunks, **packed)

    def blocks(self, dims: Sequence[str]) -> Iterator[tuple[int, int, tuple[slice, ...]]]:
        """The chunks of a variable over some axes in the order of its values: first value, end, and place."""
        with self._hdf5():
            shape = tuple(self._file[axis].shape[0] for axis in dims)
        chunks = _chunks(shape)
        starts = [range(0, length, chunk) for length, chunk in zip(shape, chunks, strict=True)]
        first = 0
        for corner in product(*starts):
            ends = [min(start + chunk, length) for start, chunk, length in zip(corner, chunks, shape, strict=True)]
            where = tuple(slice(start, end) for start, end in zip(corner, ends, strict=True))
            last = first + math.prod(end - start for start, end in zip(corner, ends, strict=True))
            yield first, last, where
            first = last

    def fill(self, name: str, where: tuple[slice, ...], values: NDArray[Any]) -> None:
        """Fill a chunk of a variable that was begun; a number that is missing is NaN."""
        if values.dtype.kind == "S":
            values = values.astype(h5py.string_dtype("utf-8", values.dtype.itemsize))
        elif values.dtype.kind == "f":
            values = np.where(np.isnan(values), FILL, values)
            valid.check_numbers(values, "/", name)
        with self._hdf5():
            self._file[name][where] = values

    def append(self, group: str, rows: Mapping[str, ArrayLike]) -> None:
        """Append rows to all growing variables of `group`, the growing axis among them."""
        self._output.check()
        growing = self._growing[group]
        if rows.keys() != growing.keys():
            raise ValueError(f"{group}: needs {sorted(growing)}, got {sorted(rows)}")
        blocks = {name: _checked(group, name, rows[name], growing[name].field.kind) for name in rows}
        shape, *others = {block.shape for block in blocks.values()}
        if others or len(shape) != 1:
            raise ValueError(f"{group}: every variable needs the same number of rows")
        for first in range(0, shape[0], _CHUNK):
            for name, variable in growing.items():
                variable.waiting = np.concatenate([variable.waiting, blocks[name][first : first + _CHUNK]])
                if len(variable.waiting) >= _CHUNK:
                    with self._hdf5():
                        self._write_rows(group, variable, _CHUNK)

    def rows(self, group: str) -> int:
        """The number of rows appended to `group` so far."""
        variable = next(iter(self._growing[group].values()))
        return variable.written + len(variable.waiting)

    def read(self, group: str, name: str, start: int, stop: int) -> NDArray[Any]:
        """The rows `start` to `stop` of a growing variable, of those appended so far; both are >= 0."""
        written = self._growing[group][name].written
        waiting = self._growing[group][name].waiting
        if not written:
            return waiting[start:stop]
        with self._hdf5():
            before = self._file[group][name][start:stop]
        return np.concatenate([before, waiting[max(0, start - written) : max(0, stop - written)]])

    def commit(self) -> None:
        """Finish the file and put it in its place; nothing can be written after that.

        Raises CannotWriteError, too, where readers could not rely on it, which is a fault of this program.
        """
        try:
            self.finish()
        except ValueError as error:
            what = f"{self._output.path}: is not written, as nothing could read it ({error})"
            raise CannotWriteError(f"{what}; report the case, as this is a fault of the program") from error
        self.publish()

    def finish(self) -> None:
        """Write what waits, and raise ValueError where readers could not rely on what is written."""
        with self._hdf5():
            for group, growing in self._growing.items():
                for variable in growing.values():
                    if len(variable.waiting) or not variable.written:
                        self._write_rows(group, variable, len(variable.waiting))
            self._file.attrs["complete"] = 1
        with self._hdf5():
            self._file.flush()
            valid.check_result(self._file)

    def publish(self) -> None:
        """Put the finished file in its place, with its digest; nothing can be written after that."""
        self.close()
        self._output.write(digest(self._output, self._output.seek(0, 2)))
        self._output.publish()

    def close(self) -> None:
        """Close the HDF5 file, before its output is closed; without an earlier `commit` all is lost."""
        with signals_deferred():
            if self._file is not None:
                self._file.close()
            self._file = None

    @contextmanager
    def _hdf5(self) -> Iterator[None]:
        """Surround all calls of HDF5 with checks, and hold back signals.

        Objects of HDF5 are to be freed within the block, too, so no variable beside it holds one: Python loses an
        exception that a handler raises while one is freed.
        """
        self._output.check()
        with signals_deferred():
            yield
        self._output.check()

    def _write_rows(self, group: str, variable: _Variable, count: int) -> None:
        """Write the first of the waiting rows behind those that are written."""
        rows = variable.waiting[:count]
        variable.waiting = variable.waiting[count:]
        if not variable.written:  # created only now, so that a short series gets a chunk of just its length
            self._create(group, variable, rows.shape, rows.dtype, grows=True)[...] = rows
        else:
            dataset = self._file[group][variable.field.name]
            dataset.resize(variable.written + count, axis=0)
            dataset[variable.written :] = rows
        variable.written += count

    def _create(
        self,
        group: str,
        variable: _Variable,
        shape: tuple[int, ...],
        kind: np.dtype[np.generic],
        *,
        grows: bool = False,
        **how: object,
    ) -> h5py.Dataset:
        """Create a dataset with checksums, its attributes and axes."""
        parent = self._file.require_group(group)
        name = variable.field.name
        maxshape = (None,) * len(shape) if grows else None  # HDF5 takes no chunk longer than its dataset can get
        options = {"chunks": _chunks(shape), "maxshape": maxshape, "fletcher32": True, **how}
        dataset = parent.create_dataset(name, shape, kind, **options)
        _set_attributes(dataset, variable.attributes)
        if variable.dims == (name,):
            dataset.make_scale(name)
        else:
            for dimension, axis in zip(dataset.dims, variable.dims, strict=True):
                dimension.attach_scale(parent[axis])
        return dataset


@contextmanager
def new_result(path: Path, *, force: bool) -> Iterator[ResultFile]:
    """Begin a result file; unless `commit` is called within the block, nothing of it remains.

    Raises what `new_output` raises, before anything is computed, and UsageError where the file is no result: it
    may be the case, or a profile that the case reads. Of a symbolic link the file counts that it leads to.
    """
    with suppress(OSError, ValueError):
        target = Path(os.path.realpath(path))
        if force and target.suffix != ".h5" and target.is_file() and target.stat().st_size and not is_hdf5(target):
            raise UsageError(
                f"{path}: is no result, and is not replaced by one; "
                f"choose another output with {argument('output')}"
            )
    with new_output(path, force=force) as output, closing(ResultFile(output)) as result:
        result.open()
        yield result


def _chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The chunks of a dataset: the longest last dimensions that fit."""
    room = _CHUNK
    chunks = list[int]()
    for length in reversed(shape):
        chunks.insert(0, max(1, min(length, room)))
        room //= chunks[0]
    return tuple(chunks)


def _set_attributes(node: h5py.HLObject, attributes: Mapping[str, Any]) -> None:
    for name, value in attributes.items():
        texts = [value] if isinstance(value, str) else value
        if isinstance(texts, list | tuple) and all(isinstance(item, str) for item in texts):
            node.attrs[name] = np.array(value, dtype=h5py.string_dtype())
        else:
            node.attrs[name] = _finite(f"attribute {name}", value)


def _finite(name: str, values: ArrayLike) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise ValueError(f"{name}: must be finite numbers, or text{found_text(values)}")
    return array


def _checked(group: str, name: str, values: ArrayLike, kind: str) -> NDArray[Any]:
    """The values in the type of the file; a number that would not come back as it was is refused."""
    array = np.asarray(values)
    where = f"{group}/{name}"
    if array.dtype.kind == "U":
        text = np.char.encode(array, "utf-8")
        return text.astype(h5py.string_dtype("utf-8", max(1, text.dtype.itemsize)))
    valid.check_numbers(_finite(where, array), group, where)
    with np.errstate(all="ignore"):
        converted = array.astype(kind, copy=False)
    if not np.array_equal(converted, array):
        raise ValueError(f"{where}: does not fit {np.dtype(kind)}")
    return converted
