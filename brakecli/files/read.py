"""The form of a result file, and reading one: exactly what was written, or UnreadableResultError.

A result is HDF5 that opens as netCDF-4, followed by 32 bytes: the SHA-256 of everything before them. HDF5 ignores
these bytes. A reader compares them before the library sees the file, and so knows that it is as it was written.
The checksums inside the file are weaker: they leave out texts, and a hole of zeros passes them. A program that
edits the file cuts the 32 bytes off; then only the checksums inside remain.
"""

import hashlib
import os
import resource
import signal
import stat
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from io import RawIOBase
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from brakecli.errors import OtherKindError, UnreadableResultError, printable
from brakecli.files import valid

FORMAT = "brakecli"
FORMAT_VERSION = 1

SHORTEST_TRIAL = 5.0  # s of processor time, and 0.1 s for each MB, to read a file that may be damaged
_SIGNATURE = b"\x89HDF\r\n\x1a\n"


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
    attributes: dict[str, Any]
    length: int  # bytes
    sealed: bool  # whether the whole file is as it was written, by its digest
    _variables: dict[str, dict[str, Variable]] = field(default_factory=dict)  # that were looked at

    @cached_property
    def groups(self) -> dict[str, None]:
        """All groups, the root first."""
        with _explained(self.path):
            names = ["/"]
            self.file.visit(names.append)
            return {name: None for name in names if isinstance(valid.member(self.file, name), h5py.Group)}

    def group_attributes(self, group: str) -> dict[str, Any]:
        """The attributes of a group."""
        with _explained(self.path):
            return valid.attributes_of(self._group(group), str(self.attributes.get("kind")))

    def text(self, name: str) -> str:
        """A text among the attributes of the root."""
        with _explained(self.path):
            if name not in self.attributes:
                raise ValueError(f"attribute {name} is missing")
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
        found = {}
        with _explained(self.path):
            parent = self._group(group)
            for name in parent:
                node = valid.member(parent, name)
                if isinstance(node, h5py.Dataset):
                    dims, attributes = valid.axes_of(node, name), valid.attributes_of(node, "")
                    found[name] = Variable(dims, node.shape, attributes, node.dtype.kind)
        self._variables[group] = found
        return found

    def read(self, group: str, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        """The rows `start` to `stop` of a variable, checked: no damage, and no number that is not finite."""
        with _explained(self.path):
            node, where = valid.member(self._group(group), name), f"variable {name} in group {group}"
            if not isinstance(node, h5py.Dataset) or node.ndim == 0:
                raise ValueError(f"there is no {where}")
            if node.dtype.kind not in "iufS":
                raise ValueError(f"{where} holds no numbers")
            valid.check_size(node, self.length, where)
            values = np.asarray(node[start:stop])
            if values.dtype.kind == "S":
                return np.char.decode(values, "utf-8")
            if values.dtype == np.float16:  # its squares are infinite from 256 on
                values = values.astype(np.float64)
            limit = valid.LARGEST_IN_HISTORY if group == "history" else valid.LARGEST
            if values.dtype.kind == "f" and not (np.abs(values) <= limit).all():
                raise ValueError(f"{where} holds values that are not finite, or too large")
            return values

    def _group(self, group: str) -> h5py.Group:
        node = valid.member(self.file, group)
        if not isinstance(node, h5py.Group):
            raise ValueError(f"there is no group {group}")
        return node


@contextmanager
def open_result(path: Path, kind: str | None = None) -> Iterator[StoredResult]:
    """Open a result file for reading, once it is known to be complete, undamaged and of this `kind`.

    Raises UnreadableResultError in every other case, and so does all reading from it.
    """
    with ExitStack() as stack:
        with _explained(path):
            if not stat.S_ISREG(path.stat().st_mode):  # a pipe would block forever
                raise ValueError("this is not a regular file")
            stream = stack.enter_context(path.open("rb", buffering=0))
            if not (sealed := _has_digest(stream)):
                _try_out(path)
            # h5py gets the very file that was verified, and does without the file locks of HDF5
            file = stack.enter_context(h5py.File(stream, "r"))
            its_kind = str(valid.plain_attribute(file, "kind"))
            attributes = valid.attributes_of(file, its_kind)
            if attributes.get("format") != FORMAT:
                raise ValueError(f'it was not written by this program, attribute format = "{FORMAT}" is missing')
            if (version := attributes.get("format_version")) != FORMAT_VERSION:
                raise ValueError(f"its format version is {version}, and only version {FORMAT_VERSION} is known")
            if attributes.get("complete") != 1:
                raise ValueError("it is incomplete, attribute complete is not 1")
            if kind is not None and attributes.get("kind") != kind:
                what = f"{path}: holds a result of kind {printable(repr(its_kind))}, and {kind!r} is needed"
                remedy = f"name the result of a {kind}, or see what this one holds by brakecli report or plot"
                raise OtherKindError(f"{what}; {remedy}")
            length = path.stat().st_size
            valid.check_variables(file, its_kind, length)
        yield StoredResult(path, file, attributes, length, sealed)


def is_hdf5(path: Path) -> bool:
    """Whether this is a regular file with the signature of HDF5, behind a user block or not."""
    with suppress(OSError, ValueError):  # looking into a pipe would use up what it holds
        return stat.S_ISREG(path.stat().st_mode) and bool(h5py.is_hdf5(path))
    return False


def digest(file: RawIOBase, length: int) -> bytes:
    """The SHA-256 of the first `length` bytes; afterwards `file` stands behind them."""
    file.seek(0)
    total = hashlib.sha256()
    while length > 0 and (block := file.read(min(length, 1 << 20))):
        total.update(block)
        length -= len(block)
    return total.digest()


def _has_digest(file: RawIOBase) -> bool:
    """Whether the digest stands behind the end of the HDF5 part; raises ValueError where it does not fit."""
    file.seek(0)
    superblock = file.read(36) or b""
    if not superblock.startswith(_SIGNATURE):
        raise ValueError("this is not an HDF5 file" if superblock else "the file is empty")
    if superblock[8:9] != b"\x02":  # other versions have other layouts; this program does not write them
        raise ValueError("it was not written by this program; a copy that xarray writes has another form")
    end = int.from_bytes(superblock[28:36], "little")
    behind = file.seek(0, 2) - end
    if behind and (behind != 32 or digest(file, end) != file.read(32)):
        raise ValueError("the file is truncated, damaged or was altered by another program")
    return behind > 0


def _try_out(path: Path) -> None:
    """Read a file that no digest vouches for in another process first: some damage ends or blocks HDF5 itself."""
    with warnings.catch_warnings():  # Python 3.12 warns where there are threads; the child uses none of them
        warnings.simplefilter("ignore")
        child = os.fork()
    if not child:
        try:
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            size = path.stat().st_size
            seconds = int(SHORTEST_TRIAL + size / 1e7)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            with h5py.File(path, "r", locking=False) as file:
                valid.read_everything(file, size)
        finally:
            os._exit(0)  # what fails here with an exception will do so again
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) < 0:
        raise ValueError("the file is damaged, and HDF5 cannot read it")


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turn whatever h5py raises on a damaged file into UnreadableResultError."""
    try:
        yield
    except OtherKindError:
        raise
    except Exception as error:
        reason = getattr(error, "strerror", None) or str(error)
        what = f"{path}: cannot be read as a result: {' '.join(reason.split())}"
        raise UnreadableResultError(f"{what}; name an intact result file, or compute it again") from error
