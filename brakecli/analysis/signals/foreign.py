"""A row of numbers in any HDF5 file. No digest vouches for it, so it is opened with care.

HDF5 ends or blocks the process on some damage, and makes room for whatever size a file claims. So another process
looks first, links are not followed, and sizes are looked at before values are read.
"""

import os
import resource
import signal
import warnings
from collections.abc import Callable
from functools import partial
from io import FileIO
from pathlib import Path

import h5py
import numpy as np
from h5py import h5a, h5d, h5s, h5t, h5z

from brakecli.analysis.spectrum import Array
from brakecli.errors import UnreadableResultError, printable
from brakecli.results.opening import open_regular

SHORTEST_TRIAL = 5.0  # s of processor time, and 0.1 s for each MB, to read a file that may be damaged
_DEEPEST = 8  # levels of groups and their datasets
_MOST_NODES = 10_000  # groups and datasets
_MOST_MEMORY = 1_250_000_000  # bytes of a chunk that is unpacked; a row of numbers takes less


def dataset(path: Path, inside: str, most: int) -> tuple[Array, str]:
    """A row of at most so many numbers with its attribute `units`; whatever h5py raises on damage is reported."""
    with open_regular(path) as stream:
        row = partial(_row, inside=inside, most=most, length=os.fstat(stream.fileno()).st_size)
        try:
            _try_out(stream, row)
            with h5py.File(stream, "r") as file:
                return row(file)
        except Exception as error:
            what = f"cannot be read: {' '.join(str(error).split())}"
            raise UnreadableResultError(f"{what}; name an intact HDF5 file and a dataset in it") from error


def _row(file: h5py.File, inside: str, most: int, length: int) -> tuple[Array, str]:
    """A row of numbers in an open HDF5 file of this length (bytes), and its unit; raises ValueError."""
    if inside.count("/") > _DEEPEST:
        raise ValueError(f"{printable(inside)} lies in groups of more than {_DEEPEST} levels")
    node = _member(file, inside)
    if not isinstance(node, h5py.Dataset):
        names = _datasets(file)
        raise ValueError(f"there is no dataset {inside}, only {', '.join(names[:12]) or 'none'}")
    if not node.shape or sum(size != 1 for size in node.shape) > 1 or node.dtype.kind not in "iuf":
        raise ValueError(f"{inside} is not a row of numbers, found shape {node.shape}, {node.dtype}")
    _check_size(node, length, f"dataset {inside}")
    if node.size > most:
        raise ValueError(f"dataset {inside} has {node.size} samples, and {most} are the most")
    return np.asarray(node[:], dtype=np.float64).ravel(), _units(node)


def _try_out(stream: FileIO, look: Callable[[h5py.File], object]) -> None:
    """Look at an HDF5 file in another process first: some damage ends or blocks HDF5 itself, or takes all memory.

    Raises ValueError where that process is ended, and for its exceptions.
    """
    longest = 2000  # characters of what is wrong
    reading, writing = os.pipe()
    with warnings.catch_warnings():  # Python 3.12 warns where there are threads; the child uses none of them
        warnings.simplefilter("ignore")
        child = os.fork()
    if not child:
        try:
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
                signal.signal(number, signal.SIG_DFL)
            seconds = int(SHORTEST_TRIAL + os.fstat(stream.fileno()).st_size / 1e7)
            signal.alarm(int(10.0 * seconds))  # as other processes or a slow disk may hold it up
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            in_use = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            hard = resource.getrlimit(resource.RLIMIT_AS)[1]
            most = in_use + 2 * _MOST_MEMORY
            resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))
            with h5py.File(stream, "r") as file:
                look(file)
        except BaseException as error:
            os.write(writing, (str(error) or type(error).__name__)[:longest].encode(errors="replace"))
        finally:
            os._exit(0)
    os.close(writing)
    with FileIO(reading) as pipe:
        wrong = pipe.read(longest).decode(errors="replace")
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) < 0:
        raise ValueError("the file is damaged, and HDF5 cannot read it")
    if wrong:
        raise ValueError(wrong)


def _datasets(file: h5py.File) -> list[str]:
    """The names of all datasets; raises ValueError where there are too many, or groups too deep in others."""
    names = {file["/"]: ""}
    for group in (groups := [file["/"]]):
        for key in group:
            if (node := _member(group, key)) is not None and node not in names:
                names[node] = f"{names[group]}/{key}"
                if names[node].count("/") > _DEEPEST or len(names) > _MOST_NODES:
                    limits = f"{_MOST_NODES} groups and variables, or groups of more than {_DEEPEST} levels"
                    raise ValueError(f"it holds more than {limits}")
                groups += [node] * isinstance(node, h5py.Group)
    return sorted(name for node, name in names.items() if isinstance(node, h5py.Dataset))


def _member(group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset | None:
    """What a group holds under a path; None where there is nothing, or only a link or a view of something else.

    Links to other files may lead to a pipe. HDF5 opens what a view shows as soon as its shape is asked for, and
    crashes on one that shows itself.
    """
    for key in name.strip("/").split("/"):
        if not isinstance(group, h5py.Group) or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            return None
        group = group[key]
        if isinstance(group, h5py.Dataset) and group.id.get_create_plist().get_layout() == h5d.VIRTUAL:
            return None
    return group


def _check_size(node: h5py.Dataset, length: int, where: str) -> None:
    """Raise ValueError for a dataset that claims more than a file of this length (bytes) can hold."""
    plist = node.id.get_create_plist()
    filters = {plist.get_filter(number)[0] for number in range(plist.get_nfilters())}
    packed = not filters <= {h5z.FILTER_FLETCHER32, h5z.FILTER_SHUFFLE}
    stored = node.id.get_storage_size()
    room = node.size * node.dtype.itemsize
    chunk = 0
    if plist.get_layout() == h5d.CHUNKED:
        chunk = int(np.prod(node.chunks, dtype=object)) * node.dtype.itemsize
    own = plist.get_layout() in (h5d.CHUNKED, h5d.CONTIGUOUS, h5d.COMPACT) and not plist.get_external_count()
    most = (1100 if packed else 1) * stored  # no filter of HDF5 makes data smaller
    if not own or stored > length or max(room, chunk * bool(room)) > most:
        raise ValueError(f"{where} claims {node.size} values, which are not in the file")
    if packed and chunk > _MOST_MEMORY:
        raise ValueError(f"a chunk of {where} takes {chunk} bytes in memory, and {_MOST_MEMORY} are the most")


def _units(node: h5py.Dataset) -> str:
    """The attribute `units`; empty where there is none, or it is no text of UTF-8."""
    if "units" not in node.attrs:
        return ""
    attribute = h5a.open(node.id, b"units")  # HDF5 ends the process on some attributes of other types
    if (
        attribute.get_type().get_class() != h5t.STRING
        or attribute.get_space().get_simple_extent_type() == h5s.NULL
    ):
        return ""
    value = node.attrs["units"]
    value = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
    try:
        value = value.decode() if isinstance(value, bytes) else value
        str(value).encode()  # h5py marks what is not UTF-8
    except UnicodeError:
        return ""
    return value if isinstance(value, str) else ""
