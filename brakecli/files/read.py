"""The form of a result file, and reading one: exactly what was written, or UnreadableResultError.

A result is HDF5 that opens as netCDF-4, followed by 32 bytes: the SHA-256 of everything before them. HDF5 ignores
these bytes. A reader compares them before the library sees the file, and so knows that it is as it was written.
The checksums inside the file are weaker: they leave out texts, and a hole of zeros passes them. A program that
edits the file cuts the 32 bytes off; then only the checksums inside remain.

Damage that a digest was made to fit ends or blocks HDF5 itself. So another process looks at each file first.
"""

import hashlib
import os
import resource
import signal
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from io import FileIO, RawIOBase
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from brakecli.errors import OtherKindError, UnreadableResultError, printable
from brakecli.faces import argument, command
from brakecli.files import trust, valid
from brakecli.files.opening import SIGNATURE, hdf5_begin, opened

FORMAT = "brakecli"
FORMAT_VERSION = 1

_LONGEST = 2000  # characters of what is wrong
SHORTEST_TRIAL = 5.0  # s of processor time, and 0.1 s for each MB, to read a file that may be damaged
_FIRST_LETTER = 32  # what is less controls a terminal
_WAITING = 10.0  # times as long may it take where other processes or a slow disk hold it up


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
    nodes: dict[str, Any]  # all groups and variables
    attributes: dict[str, Any]
    length: int  # bytes
    sealed: bool  # whether the whole file is as it was written, by its digest
    _variables: dict[str, dict[str, Variable]] = field(default_factory=dict)  # that were looked at

    @property
    def groups(self) -> dict[str, None]:
        """All groups, the root first."""
        return {name: None for name, node in self.nodes.items() if isinstance(node, h5py.Group)}

    def group_attributes(self, group: str) -> dict[str, Any]:
        """The attributes of a group."""
        with _explained(self.path):
            return _Named(self.path, valid.attributes_of(self._group(group), str(self.attributes.get("kind"))))

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
                if isinstance(node, h5py.Dataset) and not valid.is_axis_alone(node):
                    shape = valid.shape_of(node)
                    attributes = valid.attributes_of(node, "")
                    dims = valid.axes_of(node, name)[: len(shape)]
                    found[name] = Variable(dims, shape, attributes, node.dtype.kind)
            for name, each in found.items():
                for axis, size in zip(each.dims, each.shape, strict=False):
                    if axis in found and found[axis].shape != (size,):
                        raise ValueError(f"axis {axis} of {name} has the shape {found[axis].shape}, not {(size,)}")
        self._variables[group] = named = _Named(self.path, found)
        return named

    def read(self, group: str, name: str, start: int = 0, stop: int | None = None) -> NDArray[Any]:
        """The rows `start` to `stop` of a variable, checked: no damage, and no number that is not finite."""
        with _explained(self.path):
            node = valid.member(self._group(group), name)
            where = f"variable {name} in group {group}"
            if not isinstance(node, h5py.Dataset) or node.ndim == 0:
                raise ValueError(f"there is no {where}")
            if node.dtype.kind not in "iufS":
                raise ValueError(f"{where} holds no numbers")
            valid.check_size(node, self.length, where)
            rows = len(range(*slice(start, stop).indices(node.shape[0])))
            copies = 5 if node.dtype.kind == "S" else 2  # a character takes four bytes, and limits are checked
            needed = copies * rows * node.dtype.itemsize * int(np.prod(node.shape[1:], dtype=object))
            valid.check_memory(needed * valid.packed(node), where)
            values = np.asarray(node[start:stop])
            if values.ndim > len(valid.shape_of(node)):
                values = values.view(f"S{max(1, values.shape[-1])}")[..., 0]
            if values.dtype.kind == "S":
                texts = np.char.decode(values, "utf-8")
                controls = values.view(np.uint8)
                if ((controls < _FIRST_LETTER) & (controls > 0)).any():
                    texts = np.vectorize(valid.plain_text, otypes=[np.str_])(texts)
                return texts
            if values.dtype == np.float16:  # its squares are infinite from 256 on
                values = values.astype(np.float64)
            valid.check_numbers(values, group, where)
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
            stream = stack.enter_context(opened(path))
            length = os.fstat(stream.fileno()).st_size
            state = _digest_of(stream)
            if not trust.readings.admit(str(path), state):
                what = "the file is truncated, damaged or was altered by another program"
                raise ValueError(f"{what}, and only {argument('force-read')} looks at it all the same")
            try_out(stream, partial(valid.look_through, length=length, everything=bool(state)))
            # h5py gets the very file that was looked at, and does without the file locks of HDF5
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
            nodes = valid.check_result(file, its_kind, length)
        yield StoredResult(path, file, stream, nodes, _Named(path, attributes), length, not state)


def digest(file: RawIOBase, length: int) -> bytes:
    """The SHA-256 of the first `length` bytes; afterwards `file` stands behind them."""
    file.seek(0)
    total = hashlib.sha256()
    while length > 0 and (block := file.read(min(length, 1 << 20))):
        total.update(block)
        length -= len(block)
    return total.digest()


def _digest_of(file: RawIOBase) -> str:
    """What is wrong with the digest behind the end of the HDF5 part: nothing, or one of `trust`."""
    file.seek(0)
    superblock = file.read(36) or b""
    if not (begin := hdf5_begin(file)) and not superblock.startswith(SIGNATURE):
        raise ValueError("this is not an HDF5 file" if superblock else "the file is empty")
    if begin or superblock[8:9] != b"\x02":  # other programs write other versions, which have other layouts
        return trust.MISSING
    end = int.from_bytes(superblock[28:36], "little")
    behind = file.seek(0, os.SEEK_END) - end
    fits = behind == 32 and digest(file, end) == file.read(32)
    return "" if fits else trust.DIFFERS if behind else trust.MISSING


def try_out(stream: FileIO, look: Callable[[h5py.File], object]) -> None:
    """Look at an HDF5 file in another process first: some damage ends or blocks HDF5 itself, or takes all memory.

    Raises ValueError where that process is ended, and for its exceptions.
    """
    reading, writing = os.pipe()
    with warnings.catch_warnings():  # Python 3.12 warns where there are threads; the child uses none of them
        warnings.simplefilter("ignore")
        child = os.fork()
    if not child:
        try:
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
                signal.signal(number, signal.SIG_DFL)
            seconds = int(SHORTEST_TRIAL + os.fstat(stream.fileno()).st_size / 1e7)
            signal.alarm(int(_WAITING * seconds))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            hard = resource.getrlimit(resource.RLIMIT_AS)[1]
            most = held + 2 * valid.MOST_MEMORY
            resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))
            with h5py.File(stream, "r") as file:
                look(file)
        except BaseException as error:
            os.write(writing, (str(error) or type(error).__name__)[:_LONGEST].encode(errors="replace"))
        finally:
            os._exit(0)
    os.close(writing)
    with FileIO(reading) as pipe:
        wrong = pipe.read(_LONGEST).decode(errors="replace")
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) < 0:
        raise ValueError("the file is damaged, and HDF5 cannot read it")
    if wrong:
        raise ValueError(wrong)


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
        remedy = "name an intact result file, or compute it again"
        if path.suffix == ".toml" and not isinstance(error, OSError):
            what = f"{path}: this is no result yet"
            remedy = f"compute it first: {command('run', path)}"
        raise UnreadableResultError(f"{what}; {remedy}") from error
