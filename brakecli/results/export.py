"""Numbers of a result for other programs: tables as CSV, a motion as sound."""

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.errors import UnreadableResultError, UsageError, escaped
from brakecli.faces import argument
from brakecli.results import fields, stability_fields
from brakecli.results.atomic import check_target, new_output
from brakecli.results.field import labelled, plain_units
from brakecli.results.read import StoredResult, Variable
from brakecli.results.write import FILL
from brakecli.solver.arrays import Floats

RATE = 44_100  # samples of sound per second
_FORMULAS = ("=", "+", "-", "@")  # what begins one in a spreadsheet
_TABLES = (
    fields.EVENTS,
    fields.HISTORY,
    fields.POINT,
    fields.CRITICAL,
    stability_fields.VARIED,
    stability_fields.MODES,
    fields.ENTRY,
    stability_fields.BRANCH_POINT,
)
_ORDER = [field.name for rows in _TABLES for field in rows]  # of columns
_AXES = {
    "history": ("time",),
    "spectrum": ("frequency",),
    "over_time": ("time",),
    "spectrogram": ("time", "frequency"),
    "vibrations": ("interval",),
    "events": ("event",),
}


class Excerpt(NamedTuple):
    """The part of a motion that is exported: both ends (s), and of how many samples one is kept."""

    start: float = -math.inf
    end: float = math.inf
    every: int = 1


WHOLE = Excerpt()


def export(
    result: StoredResult,
    target: Path,
    group: str | None,
    names: Sequence[str],
    excerpt: Excerpt = WHOLE,
    *,
    force: bool,
    tell: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> list[str]:
    """Write numbers of a result as CSV, or one variable of a run as WAV; sentences on what was left out.

    Raises UsageError for what the result does not have, UnreadableResultError and CannotWriteError.
    """
    check_target(target, "a kind of file", (".csv", ".wav"), [result.path])
    suffix = target.suffix.lower()
    kind = result.attributes.get("kind")
    numbered = kind == "branch" and suffix == ".csv"
    if numbered:
        group = group or ("branch_1" if "branch_1" in result.groups else "branch_0")
        if not group.startswith("branch_") or "/" in group or group not in result.groups:
            branches = ", ".join(name for name in result.groups if name.startswith("branch_") and "/" not in name)
            raise UsageError(f"{argument('group')} {group}: there is none; give one of {branches}")
    elif kind != "run" and (group or suffix == ".wav"):
        what = f"{argument('group')} {group}" if group else str(target)
        raise UsageError(
            f"{what}: is for runs, and {result.path} is a {kind}; export it as .csv without {argument('group')}"
        )
    if not numbered and group not in (None, *_AXES):
        raise UsageError(f"{argument('group')} {group}: there is none; give one of {', '.join(_AXES)}")
    if group and group not in result.file:
        where = "with output.events = true" if group == "events" else "where speed or load change"
        raise UsageError(f"{argument('group')} {group}: this run has none; it has one {where}")
    if suffix == ".wav" and (group not in (None, "history") or len(names) > 1):
        remedy = f"give one {argument('variable')} and no other group"
        raise UsageError(f"{target}: a sound is one variable of the history; {remedy}")
    group = group or ("history" if kind == "run" else "/")
    if excerpt != WHOLE and _AXES.get(group, ("",))[0] != "time":
        ends = ", ".join(map(argument, ("from", "to", "every")))
        raise UsageError(f"{ends}: are for what has a time, as the history of a run; leave them out")
    if suffix == ".wav" and excerpt.every > 1:
        raise UsageError(f"{argument('every')}: would bend the tones of a sound; leave it out")
    with new_output(target, force=force) as file:
        notes = list[str]()
        if suffix == ".wav":
            sound, notes = _sound(result, names[0] if names else "vx", excerpt)
            file.write(sound)
        else:
            for rows in _rows(result, group, names, excerpt, tell):
                stream = io.StringIO()
                csv.writer(stream, lineterminator="\n").writerows(rows)
                file.write(stream.getvalue().encode())
        file.publish()
    return notes


def _rows(
    result: StoredResult, group: str, names: Sequence[str], excerpt: Excerpt, tell: Callable[[str, int, int], None]
) -> Iterator[list[Sequence[object]]]:
    """The header and blocks of rows of a table: one row for each place along the axes of the group."""
    variables = result.variables(group)
    axes = ("point",) if group.startswith("branch_") else _AXES[group] if group != "/" else _main(variables)
    if not axes:
        raise UnreadableResultError(f"{result.path}: holds no numbers along an axis; name another result")
    shape = tuple(variables[axis].shape[0] for axis in axes)
    ordered = sorted(variables, key=lambda name: _ORDER.index(name) if name in _ORDER else len(_ORDER))
    there = [
        name for name in ordered if variables[name].dims != (name,) and _lies_along(variables[name], axes, shape)
    ]
    chosen = {
        name: _numbers_with_column(result, group, name, len(axes)) for name in _checked(names, there, result)
    }
    header = [_head(axis, variables[axis]) for axis in axes]
    for name, numbers in chosen.items():
        inner = variables[name].dims[len(axes) :]
        header += [
            _head(f"{name} of {inner[0]} {number + 1}" if inner else name, variables[name]) for number in numbers
        ]
    yield [_cells(np.array(header))]
    places = [result.read(group, axis) for axis in axes]
    first, last = _ends(places[0], excerpt) if excerpt != WHOLE else (0, shape[0])
    every = excerpt.every
    rows = every * max(1, (1 << 16) // math.prod(shape[1:]))  # read at a time
    for start in range(first, last, rows):
        stop = min(start + rows, last)
        block = places[0][start:stop:every]
        columns = [coordinates.ravel() for coordinates in np.meshgrid(block, *places[1:], indexing="ij")]
        for name, numbers in chosen.items():
            if variables[name].dims == axes[1:]:  # alike in both directions
                values = np.broadcast_to(result.read(group, name), (len(block), *shape[1:]))
            else:
                values = result.read(group, name, start, stop)[::every]
            columns += [*values.reshape(len(columns[0]), -1).T[numbers]]
        yield [*zip(*map(_cells, columns), strict=True)]
        tell("rows", stop - first, last - first)


def _ends(time: Floats, excerpt: Excerpt) -> tuple[int, int]:
    """The rows between two times, both included; raises UsageError where there are none."""
    first = int(np.searchsorted(time, excerpt.start, "left"))
    last = int(np.searchsorted(time, excerpt.end, "right"))
    if first >= last:
        between = f"{argument('from')} {excerpt.start:g}, {argument('to')} {excerpt.end:g}"
        there = f"those of the result reach from {time[0]:g} to {time[-1]:g} s" if len(time) else "there is none"
        raise UsageError(f"{between}: no time lies there; {there}")
    return first, last


def _cells(column: NDArray[Any]) -> list[object]:
    """What stands in a column: numbers, or nothing; texts that no spreadsheet takes for formulas or controls."""
    if column.dtype.kind == "U":
        return ["'" * text.lstrip().startswith(_FORMULAS) + escaped(text) for text in column.tolist()]
    return [None if value == FILL else value for value in column.tolist()]


def _lies_along(variable: Variable, axes: tuple[str, ...], shape: tuple[int, ...]) -> bool:
    """Whether a variable has a value, or several, at each place, or at each of both directions of a sweep."""
    deep = len(variable.shape) > len(axes) + 1  # complex numbers of several: they are in the file
    return (variable.shape[: len(axes)] == shape and not deep) or (
        axes[0] == "direction" and variable.dims == axes[1:]
    )


def _numbers_with_column(result: StoredResult, group: str, name: str, axes: int) -> list[int]:
    """Which values at a place have a column: of the windows of instability as many as the point with most has."""
    inner = result.variables(group)[name].shape[axes:]
    if not inner:
        return [0]
    values = result.read(group, name).reshape(-1, math.prod(inner))
    return [number for number, column in enumerate(values.T) if column.dtype.kind != "f" or (column != FILL).any()]


def _main(variables: dict[str, Variable]) -> tuple[str, ...]:
    """The axes that all numbers of a sweep, of stability or of a comparison have in common."""
    dims = [variable.dims for name, variable in variables.items() if variable.dims != (name,)]
    return variables["status"].dims if "status" in variables else min(dims, key=len, default=())


def _checked(names: Sequence[str], there: Sequence[str], result: StoredResult) -> Sequence[str]:
    """The wanted names, or all there are; raises UsageError for one that is not there."""
    for name in names:
        if name not in there:
            raise UsageError(
                f"{argument('variable')} {name}: {result.path} has none; give one of {', '.join(there)}"
            )
    return names or there


def _head(name: str, variable: Variable) -> str:
    return labelled(name, plain_units(str(variable.attributes.get("units", ""))))


def _sound(result: StoredResult, name: str, excerpt: Excerpt) -> tuple[bytes, list[str]]:
    """A variable of a history as a WAV file of 16 bits, without its mean; what cannot be heard of it."""
    from scipy.io import wavfile
    from scipy.signal import resample_poly

    variables = result.variables("history")
    _checked([name], [variable for variable in variables if variable not in ("time", "state")], result)
    time = result.read("history", "time")
    first, last = _ends(time, excerpt) if excerpt != WHOLE else (0, len(time))
    steps = np.diff(time[first:last])
    values = result.read("history", name, first, last) if len(steps) else np.zeros(0)
    if len(steps) and np.ptp(steps) > 1e-3 * np.median(steps):
        raise UsageError(f"{result.path}: its samples are not equally spaced, as a sound needs them; export .csv")
    duration = float(np.mean(steps)) * len(values) if len(values) else 0.0
    if duration > 3600.0:
        raise UsageError(f"{result.path}: {duration:.4g} s are too long for a sound; an hour is the most")
    values = values - np.mean(values) if len(values) else values
    if not np.any(values):
        silent = f"{name} does not change, there is nothing to hear"
        raise UsageError(f"{result.path}: {silent}; name another {argument('variable')}")
    rate = len(values) / duration
    notes = list[str]()
    power = np.abs(np.fft.rfft(values)) ** 2
    frequency = np.fft.rfftfreq(len(values), 1.0 / rate)
    if rate > RATE:
        lost = float(power[frequency > 0.5 * RATE].sum() / power.sum())
        if lost > 1e-3:
            notes.append(f"{lost:.2%} of the power of {name} is above {0.5 * RATE:g} Hz and not in the sound")
    ratio = Fraction(RATE / rate).limit_denominator(10_000)
    sound = resample_poly(values, ratio.numerator, ratio.denominator) if ratio else np.zeros(1)
    if not (peak := float(np.abs(sound).max())) > 1e-6 * float(np.abs(values).max()):
        above = f"all of {name} is above {0.5 * RATE:g} Hz, which no sound holds"
        raise UsageError(f"{result.path}: {above}; export .csv")
    tone = result.attributes.get("frequency") or frequency[np.argmax(power)]
    if tone < 20.0 or tone > 0.5 * RATE:
        notes.append(f"the vibration at {tone:.4g} Hz cannot be heard")
    if [result.attributes.get(name) for name in ("regime", "excitation")] == ["damped", "none"]:
        faded = 0.01  # 40 dB below its peak: what is less of a sound is not heard beside it; a choice
        heard = np.flatnonzero(np.abs(sound) > faded * peak)[[0, -1]] / RATE
        when = f"from {heard[0]:.3g} to {heard[1]:.3g} s of {len(sound) / RATE:.3g} s"
        notes.append(f"the motion dies out: it is heard {when}, and elsewhere is below {faded:.0%} of its peak")
    stream = io.BytesIO()
    loudest = 10.0 ** (-3.0 / 20.0)  # 3 dB below full scale
    wavfile.write(stream, RATE, np.round(sound * (loudest * 32767.0 / peak)).astype(np.int16))
    return stream.getvalue(), notes
