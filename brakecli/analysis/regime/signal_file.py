"""Reading a measured signal from a text file of columns, or from a dataset of any HDF5 file.

Columns are named as in the header, or counted from 1. Whatever is wrong in the file is an UnreadableResultError.
"""

import re
import stat
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.of_signal import Signal
from brakecli.errors import UnreadableResultError, UsageError

Array = NDArray[np.float64]

_COMMENTS = ("#", "%")
_HEAD = 1 << 16
_UNEVEN = 0.01
"""Part of the step by which steps may differ before the signal is resampled."""
_GAP = 1.5
"""Steps of this many times the usual one are gaps."""
_LONGEST = 10.0
"""Gaps and resampling may make a signal so many times as long; a record with longer gaps is mostly gap."""


@dataclass(frozen=True)
class _Layout:
    """How a text file is laid out."""

    separator: str | None  # None: white space
    decimal_comma: bool
    names: tuple[str, ...]
    columns: int
    skip: int  # lines before the first number


def read_signal(source: str, *, column: str | None, time_column: str | None, sample_rate: float | None) -> Signal:
    """The signal of a text file, or of ``FILE.h5:/path``; raises UnreadableResultError and UsageError."""
    if sample_rate is not None and not (np.isfinite(sample_rate) and sample_rate > 0.0):
        raise UsageError(f"--sample-rate: must be above 0 Hz, found {sample_rate}; give samples per second")
    if sample_rate is not None and time_column is not None:
        raise UsageError("--sample-rate and --time-column: only one of them can hold; leave one out")
    path, inside = _split(source)
    if sample_rate is None and time_column is None:
        raise UsageError(f"{source}: no times are known; give --sample-rate HZ, or --time-column")
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise _unreadable(source, "this is no regular file", "name a file")
        if inside is not None:
            if column is not None or time_column is not None:
                raise UsageError(
                    f"{source}: a dataset has no columns; leave out --column, and give --sample-rate HZ"
                )
            values, times = _dataset(source, path, inside), None
        else:
            values, times = _columns(source, path, column, time_column)
    except OSError as error:
        raise _unreadable(source, (error.strerror or str(error)).lower(), "name a readable file") from error
    return _signal(source, values, times, sample_rate)


def _split(source: str) -> tuple[Path, str | None]:
    """File and path within it."""
    if not Path(source).exists() and (found := re.fullmatch(r"(.+?):(/.*)", source)):
        return Path(found[1]), found[2]
    return Path(source), None


def _unreadable(where: str, what: str, remedy: str) -> UnreadableResultError:
    return UnreadableResultError(f"{where}: {what}; {remedy}")


def _dataset(source: str, path: Path, inside: str) -> Array:
    """A one-dimensional dataset of numbers; whatever h5py raises on damage is told."""
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            node = file.get(inside)
            if not isinstance(node, h5py.Dataset):
                names: list[str] = []
                file.visititems(lambda name, n: names.append(f"/{name}") if isinstance(n, h5py.Dataset) else None)
                raise ValueError(f"there is no dataset {inside}, only {', '.join(names[:12]) or 'none'}")
            if node.ndim != 1 or node.dtype.kind not in "iuf":
                raise ValueError(f"dataset {inside} is no row of numbers, found shape {node.shape}, {node.dtype}")
            if node.dtype.itemsize * node.size > 100 * path.stat().st_size + (1 << 24):
                raise ValueError(f"dataset {inside} claims {node.size} values, far more than the file holds")
            return np.asarray(node[:], dtype=np.float64)
    except Exception as error:
        what = " ".join(str(error).split())
        raise _unreadable(
            source, f"cannot be read: {what}", "name an intact HDF5 file and a dataset in it"
        ) from error


def _columns(source: str, path: Path, column: str | None, time_column: str | None) -> tuple[Array, Array | None]:
    """The chosen column of a text file, and its times."""
    layout = _layout(source, path)
    time = None if time_column is None else _index(source, layout, time_column, "--time-column")
    if column is not None:
        value = _index(source, layout, column, "--column")
    else:
        others = [i for i in range(layout.columns) if i != time]
        if len(others) != 1:
            raise UsageError(f"{source}: which column is the signal? give --column; there are {_listed(layout)}")
        value = others[0]
    chosen = [value] if time is None else [value, time]
    if layout.columns - 1 not in chosen:
        chosen.append(layout.columns - 1)  # shows that rows are whole
    table = _table(source, path, layout, chosen)
    return table[:, 0], None if time is None else table[:, 1]


def _layout(source: str, path: Path) -> _Layout:
    """Separator, decimal sign and header, from the first lines."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if not head.strip():
        raise _unreadable(source, "the file is empty", "name a file with numbers")
    if b"\0" in head:
        raise _unreadable(source, "this is no text", "name a CSV file, or FILE.h5:/path of an HDF5 file")
    lines = head.decode("utf-8-sig", errors="replace").splitlines()
    lines = lines[:-1] if len(head) == _HEAD and len(lines) > 1 else lines
    named: list[str] = []
    for number, line in enumerate(lines):
        if not line.strip() or line.lstrip().startswith(_COMMENTS):
            continue
        separator = next((s for s in (";", "\t", ",") if s in line), None)
        comma = separator != "," and "," in line
        cells = [cell.strip().strip('"') for cell in line.split(separator)]
        if sum(_is_number(cell, comma) for cell in cells) and all(_is_number(c, comma) or not c for c in cells):
            comma = comma or (separator != "," and any("," in text for text in lines[number : number + 100]))
            names = tuple(named) if len(named) == len(cells) else ()
            return _Layout(separator, comma, names, len(cells), number)
        named = named if len(named) == len(cells) else cells  # a second line of names is that of the units
    raise _unreadable(source, "no line of numbers was found at its start", "name a file of columns of numbers")


def _is_number(cell: str, decimal_comma: bool) -> bool:
    try:
        float(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return False
    return True


def _listed(layout: _Layout) -> str:
    return ", ".join(layout.names) if layout.names else f"columns 1 to {layout.columns}, without names"


def _index(source: str, layout: _Layout, wanted: str, option: str) -> int:
    """Place of a column; a name comes before a number."""
    if layout.names.count(wanted) > 1:
        raise UsageError(f"{source}: {option}: several columns are named {wanted}; give its number, from 1")
    if wanted in layout.names:
        return layout.names.index(wanted)
    if wanted.isascii() and wanted.isdigit() and 1 <= int(wanted) <= layout.columns:
        return int(wanted) - 1
    raise _unreadable(source, f"{option}: there is no column {wanted}", f"there are {_listed(layout)}")


def _table(source: str, path: Path, layout: _Layout, columns: list[int]) -> Array:
    """The chosen columns, by numpy's own reader; empty cells and decimal commas take it longer."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if not layout.decimal_comma:
            try:
                return _load(path, layout, columns, layout.skip, None)
            except (ValueError, IndexError):
                pass  # perhaps no more than an empty cell
        text = path.read_text(encoding="utf-8-sig", errors="replace")
        if layout.decimal_comma:
            text = text.replace(",", ".")
        lines = text.split("\n")[layout.skip :]
        try:
            return _load(lines, layout, columns, 0, _number)
        except (ValueError, IndexError) as error:
            what = " ".join(str(error).split())
            remedy = "give every row the same columns, and every cell a number, nothing or nan"
            raise _unreadable(source, f"from line {layout.skip + 1} on: {what}", remedy) from error


def _number(cell: str) -> float:
    return float(cell.strip().strip('"') or "nan")


def _load(
    source: Path | list[str],
    layout: _Layout,
    columns: list[int],
    skip: int,
    converter: Callable[[str], float] | None,
) -> Array:
    table: Array = np.loadtxt(
        source,
        dtype=np.float64,
        comments=_COMMENTS,
        delimiter=layout.separator,
        converters=converter,
        skiprows=skip,
        usecols=columns,
        ndmin=2,
        encoding="utf-8-sig",
    )
    return table


def _signal(source: str, values: Array, times: Array | None, sample_rate: float | None) -> Signal:
    """Equally spaced values, NaN in gaps."""
    good = np.isfinite(values)
    if not good.any():
        raise _unreadable(source, "not one value is a number", "name another column")
    if good.sum() < 2:
        raise _unreadable(source, "only one sample", "measure longer")
    if np.ptp(values[good]) == 0.0:
        raise _unreadable(source, f"the signal is constant, {values[good][0]:g} throughout", "name another column")
    if float(np.abs(values[good]).max()) > 1e100:
        raise _unreadable(source, "values beyond 1e100 are no measurement", "name another column, or use SI units")
    values = np.where(good, values, np.nan)
    if times is None:
        assert sample_rate is not None
        return Signal(values, 1.0 / sample_rate, source)
    return _evenly(source, values, times)


def _evenly(source: str, values: Array, times: Array) -> Signal:
    """The signal over equal steps of time; jumps of time become gaps."""
    if not np.isfinite(times).all():
        raise _unreadable(source, "a time is no number", "remove the rows without a time")
    steps = np.diff(times)
    if not (steps > 0.0).all():
        row = int(np.argmin(steps > 0.0)) + 2
        raise _unreadable(source, f"time does not increase at sample {row}", "sort the rows, without repeats")
    step = float(np.median(steps))
    within = steps[steps < _GAP * step]
    step = float(within.mean())
    if float(np.abs(steps - step).max()) <= _UNEVEN * step:
        return Signal(values, float(times[-1] - times[0]) / (len(times) - 1), source)
    count = int((times[-1] - times[0]) / step + 1.5)
    if count > _LONGEST * len(times):
        raise _unreadable(source, "more gaps than record", "give one piece of it")
    notes = []
    grid = times[0] + step * np.arange(count)
    even = np.interp(grid, times, values)  # NaN spreads to both sides of a missing value
    jumps = np.flatnonzero(steps >= _GAP * step)
    for i in jumps:
        first, last = np.searchsorted(grid, [times[i] + 0.5 * step, times[i + 1] - 0.5 * step])
        even[first:last] = np.nan
    if len(jumps):
        notes.append(f"{len(jumps)} jumps of time taken as gaps")
    if float(np.abs(within - step).max()) > _UNEVEN * step:
        notes.append(f"sampled irregularly, resampled at {1.0 / step:.6g} Hz")
    return Signal(even, step, source, tuple(notes))
