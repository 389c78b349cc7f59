"""The form of a result file, and reading one: exactly what was written, or UnreadableResultError.

A result is HDF5 that opens as netCDF-4, followed by 32 bytes: the SHA-256 of everything before them. HDF5 ignores
these bytes. A reader compares them before the library sees the file, and so knows that it is as this program wrote
it, which has checked what it wrote. A program that edits the file cuts the 32 bytes off.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from io import FileIO, RawIOBase
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from brakecli.errors import OtherKindError, UnreadableResultError, printable
from brakecli.faces import command
from brakecli.results.opening import hdf5_begin, open_regular

FORMAT = "brakecli"
FORMAT_VERSION = 1
BLOCK = 1 << 20  # rows read at a time
_DIGEST = 32  # bytes
_MACHINERY = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Encoding", "_FillValue"}  # of netCDF-4

_Node = TypeVar("_Node", bound=h5py.HLObject)


class _Named(dict[str, Any]):
    """What a file holds, by name; raises UnreadableResultError for a name that is not there."""

    def __init__(self, path: Path, items: Mapping[str, Any]) -> None:
        """Hold the items."""
        super().__init__(items)
        self._path = path

    def __missing__(self, name: str) -> Any:
        """Tell that it is missing."""
        raise UnreadableResultError(f"{self._path}: {printable(name)} is missing; name an intact result file")


@dataclass(frozen=True)
class Variable:
    """A variable, without its values."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attributes: dict[str, Any]
    kind: str  # of its values, as NumPy names it


@dataclass
class StoredResult:
    """A result file that `open_result` has verified; a group is named by its path, the root by ``/``."""

    path: Path
    file: h5py.File
    stream: FileIO  # from which `file` reads
    attributes: dict[str, Any]
    length: int  # bytes
    _variables: dict[str, dict[str, Variable]] = field(default_factory=dict)  # that were looked at

    @property
    def groups(self) -> list[str]:
        """All groups, the root first."""
        return groups_of(self.file)

    def group_attributes(self, group: str) -> dict[str, Any]:
        """The attributes of a group."""
        with explained(self.path):
            return _Named(self.path, attributes_of(self._node(group, h5py.Group, f"group {group}")))

    def text(self, name: str) -> str:
        """A text among the attributes of the root."""
        return str(self.attributes[name])

    @property
    def versions(self) -> dict[str, str]:
        """Program and libraries by which it was made."""
        names = [name for name in self.attributes if name.endswith("_version") and name != "format_version"]
        return {name.removesuffix("_version"): str(self.attributes[name]) for name in names}

    def variables(self, group: str) -> dict[str, Variable]:
        """The variables of a group, its axes included, by name."""
        if group in self._variables:
            return self._variables[group]
        with explained(self.path):
            nodes = self._node(group, h5py.Group, f"group {group}").items()
            variables = {name: _variable(name, node) for name, node in nodes if isinstance(node, h5py.Dataset)}
        self._variables[group] = named = _Named(self.path, variables)
        return named

    def read(self, group: str, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        """The rows `start` to `stop` of a variable."""
        with explained(self.path):
            node = self._node(f"{group}/{name}", h5py.Dataset, f"variable {name} in group {group}")
            values: NDArray[Any] = node[start:stop]
            return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values

    def _node(self, name: str, kind: type[_Node], what: str) -> _Node:
        node = self.file.get(name)
        if not isinstance(node, kind):
            raise ValueError(f"there is no {what}")
        return node


@contextmanager
def open_result(path: Path, kind: str | None = None) -> Iterator[StoredResult]:
    """Open a result file for reading, once it is known to be complete, undamaged and of this `kind`.

    Raises UnreadableResultError in every other case, and so does all reading from it.
    """
    with ExitStack() as stack:
        with explained(path):
            stream = stack.enter_context(open_regular(path))
            _check_digest(path, stream)
            # h5py gets the very file that was looked at, and does without the file locks of HDF5
            file = stack.enter_context(h5py.File(stream, "r"))
            attributes = attributes_of(file)
            check_form(attributes)
            its_kind = str(attributes.get("kind"))
            if kind not in (None, its_kind):
                what = f"{path}: holds a result of kind {printable(repr(its_kind))}, and {kind!r} is needed"
                remedy = f"name the result of a {kind}, or see what this one holds by brakecli report or plot"
                raise OtherKindError(f"{what}; {remedy}")
            length = os.fstat(stream.fileno()).st_size
        yield StoredResult(path, file, stream, _Named(path, attributes), length)


def check_form(attributes: Mapping[str, object]) -> None:
    """Raise ValueError unless these are the attributes of the root of a whole result of this version."""
    if attributes.get("format") != FORMAT:
        raise ValueError(f'it was not written by this program, attribute format = "{FORMAT}" is missing')
    if (version := attributes.get("format_version")) != FORMAT_VERSION:
        raise ValueError(f"its format version is {version}, and only version {FORMAT_VERSION} is known")
    if attributes.get("complete") != 1:
        raise ValueError("it is incomplete, attribute complete is not 1")


def groups_of(file: h5py.File) -> list[str]:
    """The names of all groups, the root first."""
    names = ["/"]
    file.visititems(lambda name, node: names.append(name) if isinstance(node, h5py.Group) else None)
    return names


def attributes_of(node: h5py.HLObject) -> dict[str, Any]:
    """Attributes as str, int, float, list of str, or array of numbers."""
    attributes = {}
    for name in node.attrs:
        if name not in _MACHINERY:
            value = node.attrs[name]
            as_it_is = isinstance(value, str) or (isinstance(value, np.ndarray) and value.dtype.kind in "iuf")
            attributes[name] = value if as_it_is else value.tolist()
    return attributes


def digest(file: RawIOBase, length: int) -> bytes:
    """The SHA-256 of the first `length` bytes; afterwards `file` stands behind them."""
    file.seek(0)
    total = hashlib.sha256()
    while length > 0 and (block := file.read(min(length, 1 << 20))):
        total.update(block)
        length -= len(block)
    return total.digest()


def _check_digest(path: Path, file: RawIOBase) -> None:
    """Raise ValueError or UnreadableResultError unless the last bytes are the digest of all before them."""
    length = file.seek(0, os.SEEK_END)
    begin = hdf5_begin(file)
    file.seek(0)
    head = file.read(48) or b""
    if begin is None:
        raise ValueError("this is not an HDF5 file" if head else "the file is empty")
    if digest(file, length - _DIGEST) == file.read(_DIGEST):
        return
    end = head[28:36] if head[8:9] >= b"\x02" else head[40:48]  # of HDF5, by the version of its superblock
    if begin or length == int.from_bytes(end, "little"):
        what = f"{path}: has no digest, as another program has saved it"
        raise UnreadableResultError(f"{what}; keep a Dataset by result.brakecli.save(path), or compute it again")
    raise ValueError("its digest does not fit, so that it is damaged or was altered")


def _variable(name: str, node: h5py.Dataset) -> Variable:
    """A variable; one that has no axes is an axis itself."""
    axes = [node.file[first].name for first, *_ in node.attrs.get("DIMENSION_LIST", [])] or [name]
    dims = tuple(axis.rpartition("/")[2] for axis in axes)
    return Variable(dims, node.shape, attributes_of(node), node.dtype.kind)


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn whatever h5py raises on a damaged file into UnreadableResultError."""
    try:
        yield
    except UnreadableResultError:
        raise
    except Exception as error:
        reason = getattr(error, "strerror", None) or str(error)
        what = f"{path}: cannot be read as a result: {' '.join(reason.split())}"
        remedy = "name an intact result file, or compute it again"
        if path.suffix == ".toml" and not isinstance(error, OSError):
            what = f"{path}: this is no result yet"
            remedy = f"compute it first: {command('run', path)}"
        raise UnreadableResultError(f"{what}; {remedy}") from error
