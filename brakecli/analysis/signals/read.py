"""Reading a measured signal from a text file of columns, a sound file, or a dataset of any HDF5 file.

Columns are named as in the header, or counted from 1. Whatever is wrong in the file is an UnreadableResultError.
"""

import os
import re
import struct
import warnings
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np

from brakecli.analysis.signals.look import Measurand, Signal
from brakecli.analysis.spectrum import Array
from brakecli.errors import UnreadableResultError, UsageError, printable
from brakecli.faces import argument
from brakecli.results.opening import contents
from brakecli.results.table import LARGEST, TextTable, ordinal, si
from brakecli.results.table import require as _require

_SI = {
    Measurand.DISPLACEMENT: ("meter",),
    Measurand.VELOCITY: ("meter / second",),
    Measurand.FORCE: ("kilogram * meter / second ** 2",),
    Measurand.TORQUE: ("kilogram * meter ** 2 / second ** 2",),
    Measurand.ACCELERATION: ("meter / second ** 2", "kilogram"),  # g, a gram to pint, is taken for gravity
    Measurand.PRESSURE: ("kilogram / meter / second ** 2",),
}
_MOST_SAMPLES = 50_000_000
_PART = "give a part of the record"
# s between samples
_NEAREST = 1e-12
_FARTHEST = 1e12
_JUMPS = (
    "a force of the contact jumps where slip ends, and {} force is that of the spring, which does not: "
    "regime and frequency may be wrong; classify the velocity, or the result itself"
)


def read_signal(
    source: str,
    quantity: Measurand,
    *,
    column: str | None = None,
    time_column: str | None = None,
    sample_rate: float | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
) -> Signal:
    """The signal of a text file, a WAV file, or of ``FILE.h5:/path``, in SI units.

    Units come from the file and from `unit` and `time_unit`. Raises UnreadableResultError and UsageError.
    """
    if sample_rate is not None and not 1.0 / _FARTHEST <= sample_rate <= 1.0 / _NEAREST:
        what = "is not a number above 0 Hz (1e-12 to 1e12); give samples per second"
        raise UsageError(f"{argument('sample-rate')} {sample_rate}: {what}")
    path = Path(source)
    inside = None
    there = os.path.exists(path)  # noqa: PTH110 - pathlib's may raise
    if not there and (match := re.fullmatch(r"(.+?):(/.*)", source)):
        path = Path(match[1])
        inside = match[2]
    try:
        if time_unit is not None and time_column is None:
            remedy = f"leave it out, or name one with {argument('time-column')}"
            raise UsageError(f"{argument('time-unit')}: is for a column of times; {remedy}")
        times = []
        name = ""
        relative = False
        wanted = _SI[quantity]
        if path.suffix.lower() in (".wav", ".wave") and inside is None:
            if time_column is not None:
                raise UsageError(f"{argument('time-column')}: a sound file has no column of times; leave it out")
            values, sample_rate = _sound(path, column, sample_rate)
            size = _size(None, unit, *wanted)
            relative = unit is None
        elif (sample_rate is None) == (time_column is None):
            how = "are not given" if time_column is None else "are given twice"
            remedy = f"give {argument('sample-rate')} HZ or {argument('time-column')} NAME"
            raise UsageError(f"the times of the samples {how}; {remedy}")
        elif inside is None:
            table = TextTable(path, "a CSV file, or FILE.h5:/path of an HDF5 file")
            values, *times = table.columns_of(column, time_column)
            index, *clock = table.places
            size = _size(table.unit(index, *wanted), unit, *wanted)
            times = [time * _size(table.unit(clock[0], "second"), time_unit, "second") for time in times]
            name = table.names[index] if table.names else ""
        elif column is not None or time_column is not None:
            remedy = f"leave out {argument('column')}, and give {argument('sample-rate')} HZ"
            raise UsageError(f"a dataset has no columns; {remedy}")
        else:
            from brakecli.analysis.signals.foreign import dataset

            values, written = dataset(path, name := inside, _MOST_SAMPLES)
            size = _size(_written(written, unit, quantity), unit, *wanted)
        values = _numbers(values) * size
        signal = _evenly(values, *times) if sample_rate is None else Signal(values, 1.0 / sample_rate)
        near = f"its samples lie {signal.interval:g} s apart; check the unit of the times"
        _require(_NEAREST <= signal.interval <= _FARTHEST, near)
        of_contact = any(word in name for word in ("friction_force", "normal_force"))
        jumps = [_JUMPS.format(argument("quantity"))] * (of_contact and quantity is Measurand.FORCE)
        return replace(signal, notes=(*signal.notes, *jumps), relative=relative)
    except (UsageError, UnreadableResultError) as error:
        raise type(error)(f"{source}: {error}") from error
    except OSError as error:
        what = (error.strerror or str(error)).lower()
        raise UnreadableResultError(f"{source}: {what}; name a readable file") from error


def _size(of_file: tuple[float, str] | None, option: str | None, *wanted: str) -> float:
    """Size of the unit that the file or an option gives; raises UsageError where they contradict each other."""
    name = f"{argument('time-unit' if 'second' in wanted else 'unit')} {printable(option or '')}"
    if option is not None:
        of_option = (1.0, "") if option == "1" else si(option)
        if of_option is None:
            raise UsageError(f"{name}: there is no such unit; give one as in mm, um or m/s^2")
        if of_option[1] not in ("", *wanted):
            remedy = f"correct the unit, or {argument('quantity')}"
            raise UsageError(f"{name}: is {of_option[1]}, not {' or '.join(wanted)}; {remedy}")
        if of_file not in (None, of_option):
            another = f"the file gives another unit, of {of_file[0]:g} {of_file[1]}"
            raise UsageError(f"{name}: {another}; leave the option out")
        of_file = of_option
    size, base = of_file or (1.0, "")
    if base == "kilogram" and size > 1e-3:  # a `g` is read as a gram, and means the acceleration of gravity
        what = f"acceleration is in m/s^2 or g, not in kilograms; correct the unit, or {argument('quantity')}"
        raise UsageError(what) if option else UnreadableResultError(what)
    return size * 9.80665e3 if base == "kilogram" else size  # m/s² over the gram's size in kg


def _written(text: str, option: str | None, quantity: Measurand) -> tuple[float, str] | None:
    """The unit that a dataset says it has."""
    text = text.partition(":")[0].strip()  # what follows explains
    of_dataset = si(text)
    if text in ("", "-", "1") or (option is not None and of_dataset is None):
        return None
    remedy = f"say with {argument('unit')} what it means"
    _require(of_dataset is not None, f"there is no unit {printable(text)}; {remedy}")
    fits = of_dataset and of_dataset[1] in _SI[quantity]
    _require(fits, f"its unit {printable(text)} is no {quantity}; correct {argument('quantity')}")
    return of_dataset


class _Sound(BytesIO):
    """A sound file that refuses to give more than it holds, as its header may declare."""

    def read(self, size: int | None = -1) -> bytes:
        data = super().read(size)
        if len(data) < (size or 0) and size != 4:  # bytes of a chunk's name, of which there are none at the end
            raise ValueError(f"a part of it declares {size} bytes and holds {len(data)}")
        return data


def _sound(path: Path, column: str | None, sample_rate: float | None) -> tuple[Array, float]:
    """A channel of a WAV file, whole numbers over the largest, and its samples per second."""
    from scipy.io import wavfile

    sound = _Sound(data := contents(path, LARGEST))
    if (start := data.find(b"fmt ") + 8) > 8 and len(data) >= start + 16:
        kind, channels, _, block, bits = struct.unpack_from(
            f"{'>' if data[:4] == b'RIFX' else '<'}HHQHH", data, start
        )
        layout = f"{channels} channels of {bits} bits are in blocks of {block} bytes"
        # the formats whose samples are numbers: whole ones, others, and those that say it elsewhere
        damaged = kind in (1, 3, 0xFFFE) and not 0 < channels * bits <= 8 * block
        _require(not damaged, f"its header contradicts itself, as {layout}; name an intact WAV file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # chunks that it does not know
            rate, values = wavfile.read(sound)
    except Exception as error:
        explains = isinstance(error, ValueError | OSError)  # others are of SciPy's own code
        what = " ".join(str(error).split()) if explains else "its header is damaged"
        raise UnreadableResultError(f"cannot be read: {what}; name an intact WAV file") from error
    _require(rate > 0, "it has no sampling rate; name an intact WAV file")
    if sample_rate not in (None, rate):
        raise UsageError(
            f"{argument('sample-rate')} {sample_rate:g}: the file has {rate} Hz; leave the option out"
        )
    _require(len(values) <= _MOST_SAMPLES, f"it has {len(values)} samples, {_MOST_SAMPLES} are the most; {_PART}")
    rows = np.atleast_2d(values.T)
    chosen = column or "1" * (len(rows) == 1)
    number = ordinal(chosen)
    if not 1 <= number <= len(rows):
        raise UsageError(
            f"which channel is the signal? give {argument('column')} NUMBER; there are {len(rows)}, from 1"
        )
    if values.dtype.kind == "f":
        return rows[number - 1].astype(np.float64), float(rate)
    middle = 128.0 if values.dtype.kind == "u" else 0.0
    return (rows[number - 1] - middle) / (middle or -float(np.iinfo(values.dtype).min)), float(rate)


def _numbers(values: Array) -> Array:
    """The values, NaN in gaps; not one value at all times."""
    good = np.isfinite(values)
    numbers = values[good]
    _require(len(numbers) > 0, "the column holds no numbers; name another column")
    _require(len(numbers) > 1, "there is only one sample; measure longer")
    limit = "values beyond 1e100 cannot be measured; name another column, or use SI units"
    _require(np.abs(numbers).max() <= 1e100, limit)  # sums of squares are still finite
    _require(np.ptp(numbers) != 0.0, f"the signal is constant, all values are {numbers[0]:g}; name another column")
    return np.where(good, values, np.nan)


def _evenly(values: Array, times: Array) -> Signal:
    """The signal over equal steps of time; jumps of time become gaps, and steps that differ are resampled."""
    gap = 1.5  # usual steps
    uneven = 0.01  # part of a step
    _require(np.isfinite(times).all(), "a time is not a number; remove the rows without a time")
    steps = np.diff(times)
    row = int(np.argmin(steps > 0.0)) + 2
    _require(steps.min() > 0.0, f"time does not increase at sample {row}; sort the rows and remove repeated times")
    within = steps[steps < gap * np.median(steps)]
    step = float(within.mean())
    if float(np.abs(steps - step).max()) <= uneven * step:
        return Signal(values, float(times[-1] - times[0]) / (len(times) - 1))
    count = int((times[-1] - times[0]) / step + 1.5)
    _require(count <= 10.0 * len(times), "most of the record is gaps; give a part without long gaps")
    grid = times[0] + step * np.arange(count)
    even = np.interp(grid, times, values)  # NaN spreads to both sides of a missing value
    jumps = np.flatnonzero(steps >= gap * step)
    for i in jumps:
        first, last = np.searchsorted(grid, [times[i] + 0.5 * step, times[i + 1] - 0.5 * step])
        even[first:last] = np.nan
    notes = [f"jumps in time, treated as gaps: {len(jumps)}"] if len(jumps) else []
    if float(np.abs(within - step).max()) > uneven * step:
        notes.append(f"the samples were not equally spaced and were resampled at {1.0 / step:.6g} Hz")
    return Signal(even, step, tuple(notes))
