"""What a picture of a sweep shows, gathered from its result: numbers over rising axes, missing ones as NaN."""

import math
import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.read import parse_table
from brakecli.errors import CaseError, UnreadableResultError, UsageError
from brakecli.files.read import StoredResult, Variable
from brakecli.files.write import FILL
from brakecli.sweeps.plan import label
from brakecli.sweeps.tables import Critical, Sweep

Array = NDArray[np.float64]

_NEEDED = ("status", "regime", "excitation", "amplitude", "frequency")
_NEEDED_CRITICAL = (
    "critical_status",
    "critical",
    "critical_lower",
    "critical_upper",
    "critical_error",
    "critical_eigenvalue",
    "critical_sustained",
    "sustained_status",
)
_LEAST_LOG = 5.0
"""Ratio of the ends of an axis from which on it may be logarithmic: ticks of less are easier to read on a line."""
_LONGEST_KEY = 45
_MOST_LISTED = 12
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_PANELS = 5
"""Values of a third axis, at most: its maps stand side by side."""


@dataclass(frozen=True)
class Axis:
    """An axis of the grid. `values` are the places along it: numbers in rising order, or 0, 1 … for texts."""

    dimension: str
    key: str
    units: str
    values: Array
    texts: tuple[str, ...] | None = None

    @property
    def label(self) -> str:
        """Key path and unit."""
        return labelled(textwrap.shorten(self.key, _LONGEST_KEY, placeholder=" …"), self.units)

    @property
    def logarithmic(self) -> bool:
        """Whether the ratios of neighbours are more alike than their distances."""
        values = self.values
        if self.texts is not None or len(values) < 3 or values[0] <= 0.0 or values[-1] < _LEAST_LOG * values[0]:
            return False
        steps, ratios = np.diff(values), np.diff(np.log(values))
        return bool(np.std(ratios) / np.mean(ratios) < 0.999 * np.std(steps) / np.mean(steps))

    def named(self, place: int) -> str:
        """The value at a place, with its key and unit."""
        if self.texts is not None:
            return f"{self.key} = {self.texts[place]}"
        return f"{self.key} = {readable(float(self.values[place]))} {_plain(self.units)}".rstrip()


@dataclass(frozen=True)
class SweepPicture:
    """Everything that is drawn of a sweep.

    Each variable has the shape of the axes, behind one dimension for `directions`: ("",) where the motion was
    not followed, or else those of "up" and "down" in which it was.
    """

    title: str
    findings: tuple[str, ...]
    chosen: tuple[str, ...]  # what was selected, and axes of a single value
    directions: tuple[str, ...]
    axes: tuple[Axis, ...]
    variables: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]
    long_names: Mapping[str, str]
    critical: Critical | None

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A variable."""
        return self.variables[name]

    @property
    def summary(self) -> str:
        """Points, and what they have come to, in one line."""
        status = self["status"]
        failed = int((status != "done").sum())
        parts = [f"{status.size} point{'s' if status.size != 1 else ''}"]
        if self.critical is None:
            counts = Counter(self["regime"][status == "done"].tolist())
            parts += [f"{name} {counts[name]}" for name in sorted(counts)]
        else:
            known = self["critical"][np.isfinite(self["critical"])]
            units = _plain(self.units["critical"])
            ends = (readable(float(f"{value:.4g}")) for value in (known.min(), known.max())) if known.size else ()
            span = f": {' to '.join(ends)} {units}" if known.size else ""
            parts.append(f"critical value found at {known.size}{span.rstrip()}")
        parts += [f"failed {failed}"] if failed else []
        return "   ·   ".join(parts)

    def at(self, axis: int, place: int) -> "SweepPicture":
        """What is left of the picture at one place of an axis."""
        variables = {name: np.take(values, place, axis + 1) for name, values in self.variables.items()}
        axes = self.axes[:axis] + self.axes[axis + 1 :]
        return replace(self, axes=axes, variables=variables, chosen=(*self.chosen, self.axes[axis].named(place)))

    def towards(self, direction: int) -> "SweepPicture":
        """The picture of one direction alone."""
        variables = {name: values[direction : direction + 1] for name, values in self.variables.items()}
        chosen = (*self.chosen, f"on the way {self.directions[direction]}")
        return replace(
            self, directions=self.directions[direction : direction + 1], variables=variables, chosen=chosen
        )


def readable(value: float) -> str:
    """A number to six digits, with a power of ten where it is large or small."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.6g}".replace("-", "−")
    mantissa, _, exponent = f"{value:.5e}".partition("e")
    digits = mantissa.rstrip("0").rstrip(".").replace("-", "−")
    power = "10" + str(int(exponent)).translate(_RAISED)
    return {"1": power, "−1": f"−{power}"}.get(digits, f"{digits}·{power}")


def labelled(name: str, units: str) -> str:
    """A name and its unit, if it has one."""
    return f"{name} ({_plain(units)})" if _plain(units) else name


def gather_sweep(result: StoredResult, select: Sequence[str] = ()) -> SweepPicture:
    """Read from a result what its picture shows.

    `select` holds `KEY=VALUE`; axes of a single value are selected anyway. Raises UnreadableResultError where
    something is missing, UsageError where there is no such key or value.
    """
    sweep = _sweep(result)
    known = result.variables("/")
    names = _NEEDED + (_NEEDED_CRITICAL if sweep.critical is not None else ())
    if missing := [name for name in names if name not in known]:
        raise _unreadable(result, f"it has no variable {missing[0]}")
    if len({(known[name].dims, known[name].shape) for name in names}) != 1:
        raise _unreadable(result, "its variables do not lie on the same axes")
    dims = known["status"].dims
    both = dims[:1] == ("direction",)
    variables = {name: _masked(result.read("/", name)) for name in names}
    if both and known.keys() >= {"hysteresis"} and known["hysteresis"].dims == dims[1:]:
        variables["hysteresis"] = np.stack(2 * [result.read("/", "hysteresis")])
    axes = []
    for number, dimension in enumerate(dims[both:], start=both):
        axis, order = _axis(result, known[dimension], dimension)
        axes.append(axis)
        variables = {name: np.take(values, order, number) for name, values in variables.items()}
    directions = ["up", "down"] if both else [next((str(a.direction) for a in sweep.axis if a.direction), "")]
    picture = SweepPicture(
        title=str(result.attributes.get("title", "")) or "Sweep without a title",
        findings=tuple(str(each) for each in result.attributes.get("findings", ())),
        chosen=(),
        directions=tuple(directions),
        axes=tuple(axes),
        variables=variables if both else {name: values[np.newaxis] for name, values in variables.items()},
        units={name: str(known[name].attributes.get("units", "")) for name in variables},
        long_names={name: str(known[name].attributes.get("long_name", "")) for name in variables},
        critical=sweep.critical,
    )
    for wanted in select:  # what was found of the whole does not hold of a part
        picture = replace(_selected(picture, wanted, result), findings=())
    for axis in picture.axes:
        if len(axis.values) == 1:
            picture = picture.at(picture.axes.index(axis), 0)
    _check_drawable(picture, result)
    return picture


def _check_drawable(picture: SweepPicture, result: StoredResult) -> None:
    axes = picture.axes
    if not axes:
        raise UsageError(
            f"{result.path}: a single point makes no picture; sweep along an [[axis]] of two values or more, or "
            "read the point's numbers in the file"
        )
    most, remedy = 3, "draw a part of it with --select KEY=VALUE for"
    keys = ", ".join(axis.key for axis in axes)
    if len(axes) > most or (len(axes) == most and len(picture.directions) > 1):
        also = " in two directions" if len(picture.directions) > 1 else ""
        keys += ", direction" if also else ""
        raise UsageError(f"{result.path}: {len(axes)} axes{also} are too many for one picture; {remedy} {keys}")
    if len(axes) == most and (least := min(len(axis.values) for axis in axes)) > MOST_PANELS:
        raise UsageError(
            f"{result.path}: of three axes one may have {MOST_PANELS} values at most, to stand side by side (the "
            f"shortest has {least}); {remedy} one of {keys}"
        )


def _axis(result: StoredResult, variable: Variable, dimension: str) -> tuple[Axis, NDArray[np.intp]]:
    """An axis, and the order in which its values rise."""
    values = result.read("/", dimension)
    key, units = (str(variable.attributes.get(name, "")) for name in ("long_name", "units"))
    if values.dtype.kind == "U":
        places = np.arange(len(values))
        return Axis(dimension, key, units, places.astype(np.float64), tuple(values.tolist())), places
    order = np.argsort(values, kind="stable")
    return Axis(dimension, key, units, values[order].astype(np.float64)), order


def _masked(values: NDArray[Any]) -> NDArray[Any]:
    return np.where(values == FILL, np.nan, values) if values.dtype.kind == "f" else values


def _selected(picture: SweepPicture, wanted: str, result: StoredResult) -> SweepPicture:
    """The picture at the value of one `KEY=VALUE`."""
    key, _, value = (part.strip() for part in wanted.partition("="))
    where, value = f"{result.path}: --select {wanted}", value.strip("\"'")
    if key == "direction" and value in picture.directions and len(picture.directions) > 1:
        return picture.towards(picture.directions.index(value))
    keys = [axis.key for axis in picture.axes] + (["direction"] if len(picture.directions) > 1 else [])
    found = [number for number, axis in enumerate(picture.axes) if key in (axis.dimension, *axis.key.split(", "))]
    if not found:
        there = f"give one of {', '.join(keys)}" if keys else "leave it out"
        if key == "direction" and key in keys:
            there = "give up or down"
        raise UsageError(f"{where}: no axis has this key or value; {there}, as KEY=VALUE")
    axis = picture.axes[found[0]]
    place = _place(axis, value)
    if place is None:
        texts = axis.texts or [label(float(each)) for each in axis.values]
        more = " …" if len(texts) > _MOST_LISTED else ""
        raise UsageError(f"{where}: no point has this value; give one of {', '.join(texts[:_MOST_LISTED])}{more}")
    return picture.at(found[0], place)


def _place(axis: Axis, value: str) -> int | None:
    """Where a value stands on an axis, to the six digits that a picture shows of it."""
    if axis.texts is not None:
        return axis.texts.index(value) if value in axis.texts else None
    try:
        number = float(value)
    except ValueError:
        return None
    nearest = int(np.argmin(np.abs(axis.values - number))) if math.isfinite(number) else 0
    size = float(np.abs(axis.values).max())
    return nearest if math.isclose(axis.values[nearest], number, rel_tol=1e-5, abs_tol=1e-9 * size) else None


def _sweep(result: StoredResult) -> Sweep:
    try:
        return parse_table(Sweep, str(result.attributes.get("resolved_sweep_toml", "")), "its resolved sweep")
    except CaseError as error:
        raise _unreadable(result, f"the sweep it holds is none: {error.problems[0]}") from error


def _unreadable(result: StoredResult, reason: str) -> UnreadableResultError:
    return UnreadableResultError(f"{result.path}: cannot be drawn: {reason}; compute it again")


def _plain(units: str) -> str:
    return "" if units == "1" else units
