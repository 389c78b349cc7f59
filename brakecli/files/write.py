"""Writing result files: HDF5 that opens as netCDF-4, and appears whole or not at all.

The same calls give the same bytes, however the rows of a growing variable are cut into pieces. Which variables a
result has is known to the callers alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from brakecli.files.atomic import OutputFile, new_output, signals_deferred
from brakecli.files.read import FORMAT, FORMAT_VERSION, StoredResult, Variable, digest, is_hdf5, open_result

__all__ = ["ResultFile", "StoredResult", "Variable", "is_hdf5", "new_result", "open_result"]

FILL = 9.969209968386869e36
"""What netCDF puts where a number is missing; it stands in the attribute ``_FillValue`` then."""
_CHUNK = 16384
"""Values in a chunk, at most: 128 KiB of float64."""


@dataclass
class _Column:
    """A declared variable: where it stands, and what is written beside its values."""

    name: str
    dims: tuple[str, ...]
    dtype: np.dtype[Any]
    attributes: dict[str, Any]


@dataclass
class _Table:
    """The growing variables of one group. Rows wait here until they fill a chunk, so nothing depends on pieces."""

    columns: dict[str, _Column] = field(default_factory=dict)
    waiting: dict[str, NDArray[Any]] = field(default_factory=dict)
    rows_waiting: int = 0
    rows_stored: int = 0

    def add(self, column: _Column) -> None:
        self.columns[column.name] = column
        self.waiting[column.name] = np.empty(_CHUNK, column.dtype)


class ResultFile:
    """A result file that is being written. A group is named by its path, the root by ``/``.

    NaN and infinities are refused with ValueError. Once a write has failed, every method raises CannotWriteError.
    """

    def __init__(self, output: OutputFile) -> None:
        """Prepare a result in the file that `new_result` has opened."""
        self._output = output
        self._tables: dict[str, _Table] = {}
        self._file: Any = None

    def open(self) -> None:
        """Begin with an empty file."""
        with self._hdf5():
            # v108: headers with checksums, and any HDF5 since 1.8 reads it. No cache, as chunks are written whole
            self._file = h5py.File(self._output, "w", libver=("v108", "v108"), rdcc_nbytes=0)
        self.set_attributes({"format": FORMAT, "format_version": FORMAT_VERSION})

    def set_attributes(self, attributes: Mapping[str, Any], group: str = "/") -> None:
        """Set attributes of a group: str, int, float, lists of str, and lists and arrays of numbers."""
        with self._hdf5():
            _set_attributes(self._file.require_group(group), attributes)

    def axis(self, group: str, name: str, units: str, long_name: str, values: ArrayLike | None = None) -> None:
        """Make a dimension of this name in `group`, with numbers or texts along it; without `values` it grows."""
        self.variable(group, name, (name,), units, long_name, values)

    def variable(
        self,
        group: str,
        name: str,
        dims: Sequence[str],
        units: str,
        long_name: str,
        values: ArrayLike | None = None,
        *,
        dtype: DTypeLike = np.float64,
        attributes: Mapping[str, Any] | None = None,
    ) -> None:
        """Write a variable over the axes `dims` of its group; without `values` it grows along its only axis.

        A scalar belongs in an attribute: HDF5 keeps no checksum of one.
        """
        texts = {"units": units, "long_name": long_name}
        column = _Column(name, tuple(dims), np.dtype(dtype), {**texts, **(attributes or {})})
        table = self._tables.setdefault(group, _Table())
        if not dims or name in table.columns:
            raise ValueError(f"{group}/{name}: has no dimension, or is declared twice")
        if values is None:
            if len(dims) != 1 or (name != dims[0] and dims[0] not in table.columns):
                raise ValueError(f"{group}/{name}: only a variable over one growing axis can grow")
            table.add(column)
            return
        checked = _checked(f"{group}/{name}", values, column.dtype)
        if checked.dtype.kind == "S":
            column.attributes["_Encoding"] = "utf-8"  # by which xarray knows text from bytes
        with self._hdf5():
            lengths = {axis: self._file[group][axis].shape[0] for axis in dims if axis != name}
            if checked.shape != tuple(lengths.get(axis, checked.size) for axis in dims):
                raise ValueError(f"{group}/{name}: its shape {checked.shape} is not that of its axes {lengths}")
            self._create(group, column, checked.shape, checked.dtype, _chunk(checked.shape))[...] = checked

    def append(self, group: str, rows: Mapping[str, ArrayLike]) -> None:
        """Append rows to all growing variables of `group`, the growing axis among them."""
        self.check()
        table = self._tables[group]
        if rows.keys() != table.columns.keys():
            raise ValueError(f"{group}: needs {sorted(table.columns)}, got {sorted(rows)}")
        blocks = {
            name: _checked(f"{group}/{name}", rows[name], column.dtype) for name, column in table.columns.items()
        }
        shapes = {block.shape for block in blocks.values()}
        if len(shapes) != 1 or len(count := shapes.pop()) != 1:
            raise ValueError(f"{group}: every variable needs the same number of rows")
        done = 0
        while done < count[0]:
            take = min(count[0] - done, _CHUNK - table.rows_waiting)
            for name, block in blocks.items():
                table.waiting[name][table.rows_waiting :][:take] = block[done : done + take]
            table.rows_waiting += take
            done += take
            if table.rows_waiting == _CHUNK:
                self._store(group, table)

    def rows(self, group: str) -> int:
        """The number of rows appended to `group` so far."""
        table = self._tables[group]
        return table.rows_stored + table.rows_waiting

    def read(self, group: str, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        """The rows `start` to `stop` of a variable of numbers, of those appended so far; both are >= 0."""
        with self._hdf5():
            table = self._tables[group]
            if name not in table.columns:
                return np.asarray(self._file[group][name][start:stop])
            stop = self.rows(group) if stop is None else stop
            first = table.rows_stored
            stored = self._file[group][name][start:stop] if first else np.empty(0, table.columns[name].dtype)
            waiting = table.waiting[name][: table.rows_waiting]
            return np.concatenate([stored, waiting[max(0, start - first) : max(0, stop - first)]])

    def check(self) -> None:
        """Raise CannotWriteError if any write so far has failed, so that a long run can end early."""
        self._output.check()

    def commit(self) -> None:
        """Finish the file and put it in its place; nothing can be written after that."""
        with self._hdf5():
            for group, table in self._tables.items():
                if table.columns and (table.rows_waiting or not table.rows_stored):
                    self._store(group, table)
            self._file.attrs["complete"] = 1
        self.close()
        self._output.write(digest(self._output, self._output.seek(0, 2)))
        self._output.publish()

    def close(self) -> None:
        """Let go of the file, before its output is closed; without an earlier `commit` all is lost."""
        with signals_deferred():
            if self._file is not None:
                self._file.close()
            self._file = None

    @contextmanager
    def _hdf5(self) -> Iterator[None]:
        """Around all calls of HDF5.

        Its objects have to die within, too: Python loses an exception that a handler raises while one dies.
        """
        self.check()
        with signals_deferred():
            yield
        self.check()

    def _store(self, group: str, table: _Table) -> None:
        """Write the waiting rows behind the stored ones."""
        end = table.rows_stored + table.rows_waiting
        with self._hdf5():
            for column in table.columns.values():
                self._extend(group, column, table, end)
        table.rows_stored, table.rows_waiting = end, 0

    def _extend(self, group: str, column: _Column, table: _Table, end: int) -> None:
        if not table.rows_stored:  # created only now, so that a short series gets a chunk of just its length
            self._create(group, column, (0,), column.dtype, (max(1, end),))
        dataset = self._file[group][column.name]
        dataset.resize(end, axis=0)
        dataset[table.rows_stored :] = table.waiting[column.name][: table.rows_waiting]

    def _create(
        self,
        group: str,
        column: _Column,
        shape: tuple[int, ...],
        dtype: np.dtype[Any],
        chunks: tuple[int, ...],
    ) -> h5py.Dataset:
        """Create a dataset with checksums, its attributes and its axes."""
        parent = self._file.require_group(group)
        maxshape = None
        if 0 in shape:  # HDF5 takes no chunk that is longer than its dataset can get
            maxshape = (None,) * len(shape)
        dataset = parent.create_dataset(
            column.name, shape, dtype, chunks=chunks, maxshape=maxshape, fletcher32=True
        )
        _set_attributes(dataset, column.attributes)
        if column.dims == (column.name,):
            dataset.make_scale(column.name)
        else:
            for dimension, axis in zip(dataset.dims, column.dims, strict=True):
                dimension.attach_scale(parent[axis])
        return dataset


@contextmanager
def new_result(path: Path, *, force: bool) -> Iterator[ResultFile]:
    """Begin a result file; unless `commit` is called within the block, nothing of it remains.

    Raises CannotWriteError where nothing can be written, and UsageError where the file exists and `force` is not
    set or where another process is writing it: both at once, before anything is computed.
    """
    with new_output(path, force=force) as output:
        result = ResultFile(output)
        try:
            result.open()
            yield result
        finally:
            result.close()


def _chunk(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The longest last dimensions that fit a chunk."""
    room = _CHUNK
    chunk: list[int] = []
    for length in reversed(shape):
        chunk.insert(0, max(1, min(length, room)))
        room //= chunk[0]
    return tuple(chunk)


def _set_attributes(node: h5py.HLObject, attributes: Mapping[str, Any]) -> None:
    for name, value in attributes.items():
        node.attrs[name] = _attribute(name, value)


def _attribute(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple) and all(isinstance(item, str) for item in value):
        return np.array(value, dtype=h5py.string_dtype())
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise ValueError(f"attribute {name}: must be text or finite numbers (found {value!r})")
    return array


def _checked(name: str, values: ArrayLike, dtype: np.dtype[Any]) -> NDArray[Any]:
    """The values in the type they are stored in; a number that would not come back as it was is refused."""
    array = np.asarray(values)
    if array.dtype.kind == "U":
        text = np.char.encode(array, "utf-8")
        return text.astype(h5py.string_dtype("utf-8", max(1, text.dtype.itemsize)))
    if array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise ValueError(f"{name}: must be finite numbers")
    with np.errstate(all="ignore"):
        converted = array.astype(dtype, copy=False)
    if converted.dtype.kind not in "iuf" or not np.array_equal(converted, array):
        raise ValueError(f"{name}: does not fit {dtype}")
    return converted
