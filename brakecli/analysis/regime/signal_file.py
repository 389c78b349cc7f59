"""Reading a measured signal from a text file of columns, or from a dataset of any HDF5 file.

Columns are named as in the header, or counted from 1. Whatever is wrong in the file is an UnreadableResultError.
"""

import re
import stat
from pathlib import Path

import numpy as np

from brakecli.analysis.regime.of_signal import Signal
from brakecli.analysis.regime.spectra import Array
from brakecli.errors import UnreadableResultError, UsageError
from brakecli.files.table import TextTable
from brakecli.files.table import require as _require

_UNEVEN = 0.01  # part of the step by which steps may differ before the signal is resampled
_GAP = 1.5  # steps of this many times the usual one are gaps
_LONGEST = 10.0  # gaps may make a signal so many times as long; a record with longer gaps is mostly gap


def read_signal(source: str, *, column: str | None, time_column: str | None, sample_rate: float | None) -> Signal:
    """The signal of a text file, or of ``FILE.h5:/path``; raises UnreadableResultError and UsageError."""
    if sample_rate is not None and not (np.isfinite(sample_rate) and sample_rate > 0.0):
        raise UsageError(f"--sample-rate: must be above 0 Hz, found {sample_rate}; give samples per second")
    path, inside = Path(source), None
    if not path.exists() and (found := re.fullmatch(r"(.+?):(/.*)", source)):
        path, inside = Path(found[1]), found[2]
    try:
        if (sample_rate is None) == (time_column is None):
            raise UsageError(
                "the times of the samples are needed once; give either --sample-rate HZ or --time-column"
            )
        _require(stat.S_ISREG(path.stat().st_mode), "this is not a regular file; name a file")
        if inside is not None and (column is not None or time_column is not None):
            raise UsageError("a dataset has no columns; leave out --column, and give --sample-rate HZ")
        values, *times = [_dataset(path, inside)] if inside else TextTable(path).columns_of(column, time_column)
        values = _numbers(values)
        return Signal(values, 1.0 / sample_rate) if sample_rate is not None else _evenly(values, *times)
    except (UsageError, UnreadableResultError) as error:
        raise type(error)(f"{source}: {error}") from error
    except OSError as error:
        what = (error.strerror or str(error)).lower()
        raise UnreadableResultError(f"{source}: {what}; name a readable file") from error


def _dataset(path: Path, inside: str) -> Array:
    """A one-dimensional dataset of numbers; whatever h5py raises on damage is reported."""
    import h5py

    from brakecli.files.valid import check_size, member

    try:
        with h5py.File(path, "r", locking=False) as file:
            node = member(file, inside)  # links to other files may lead to a pipe
            if not isinstance(node, h5py.Dataset):
                names: list[str] = []
                file.visit(names.append)
                names = [f"/{name}" for name in names if isinstance(member(file, name), h5py.Dataset)]
                raise ValueError(f"there is no dataset {inside}, only {', '.join(names[:12]) or 'none'}")
            if node.ndim != 1 or node.dtype.kind not in "iuf":
                raise ValueError(f"{inside} is not a row of numbers, found shape {node.shape}, {node.dtype}")
            check_size(node, path.stat().st_size, f"dataset {inside}")  # HDF5 crashes on a virtual one of itself
            return np.asarray(node[:], dtype=np.float64)
    except Exception as error:
        what = f"cannot be read: {' '.join(str(error).split())}"
        raise UnreadableResultError(f"{what}; name an intact HDF5 file and a dataset in it") from error


def _numbers(values: Array) -> Array:
    """The values, NaN in gaps; not one value at all times."""
    good = np.isfinite(values)
    numbers = values[good]
    _require(len(numbers) > 0, "the column holds no numbers; name another column")
    _require(len(numbers) > 1, "there is only one sample; measure longer")
    _require(np.ptp(numbers) != 0.0, f"the signal is constant, all values are {numbers[0]:g}; name another column")
    limit = "values beyond 1e100 cannot be measured; name another column, or use SI units"
    _require(np.abs(numbers).max() <= 1e100, limit)
    return np.where(good, values, np.nan)


def _evenly(values: Array, times: Array) -> Signal:
    """The signal over equal steps of time; jumps of time become gaps."""
    _require(np.isfinite(times).all(), "a time is not a number; remove the rows without a time")
    steps = np.diff(times)
    row = int(np.argmin(steps > 0.0)) + 2
    _require(steps.min() > 0.0, f"time does not increase at sample {row}; sort the rows and remove repeated times")
    within = steps[steps < _GAP * np.median(steps)]
    step = float(within.mean())
    if float(np.abs(steps - step).max()) <= _UNEVEN * step:
        return Signal(values, float(times[-1] - times[0]) / (len(times) - 1))
    count = int((times[-1] - times[0]) / step + 1.5)
    _require(count <= _LONGEST * len(times), "most of the record is gaps; give a part without long gaps")
    grid = times[0] + step * np.arange(count)
    even = np.interp(grid, times, values)  # NaN spreads to both sides of a missing value
    jumps = np.flatnonzero(steps >= _GAP * step)
    for i in jumps:
        first, last = np.searchsorted(grid, [times[i] + 0.5 * step, times[i + 1] - 0.5 * step])
        even[first:last] = np.nan
    notes = [f"{len(jumps)} jumps in time were treated as gaps"] if len(jumps) else []
    if float(np.abs(within - step).max()) > _UNEVEN * step:
        notes.append(f"the samples were not equally spaced and were resampled at {1.0 / step:.6g} Hz")
    return Signal(even, step, tuple(notes))
