"""What the picture of a sweep shows, gathered from its result: numbers over rising axes, missing ones as NaN."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from brakecli.case.read import parse_table
from brakecli.errors import CaseError, UsageError
from brakecli.files.read import StoredResult
from brakecli.plots import style
from brakecli.sweeps.plan import label
from brakecli.sweeps.tables import Critical, Sweep

MOST_PANELS = 5  # values of a third axis: its maps stand side by side
_NEEDED = ("status", "regime", "excitation", "amplitude", "frequency")
_CRITICAL = (
    *("critical_status", "critical", "critical_lower", "critical_upper", "critical_error"),
    *("critical_eigenvalue", "critical_sustained", "sustained_status"),
)
_LEAST_LOG = 5.0  # ratio of the ends of a logarithmic axis; below it, linear ticks are easier to read


@dataclass(frozen=True)
class Axis:
    """An axis of the grid. `values` are the places along it: numbers in rising order, or 0, 1 … for texts."""

    dimension: str
    key: str
    units: str
    values: style.Array
    texts: tuple[str, ...] | None = None

    @property
    def logarithmic(self) -> bool:
        """Whether the ratios of neighbours are more alike than their distances."""
        values = self.values
        if self.texts is not None or len(values) < 3 or values[0] <= 0.0 or values[-1] < _LEAST_LOG * values[0]:
            return False
        steps, ratios = np.diff(values), np.diff(np.log(values))
        return bool(np.std(ratios) / np.mean(ratios) < 0.999 * np.std(steps) / np.mean(steps))

    @property
    def edges(self) -> style.Array:
        """The limits of the cells around the values: half way between neighbours."""
        places = np.log(self.values) if self.logarithmic else self.values
        middles = 0.5 * (places[1:] + places[:-1])
        edges = np.concatenate([[2.0 * places[0] - middles[0]], middles, [2.0 * places[-1] - middles[-1]]])
        return np.exp(edges) if self.logarithmic else edges

    def named(self, place: int) -> str:
        """The value at a place, with its key and unit."""
        value = self.texts[place] if self.texts is not None else style.readable(float(self.values[place]))
        return f"{self.key} = {value} {self.units}".rstrip()

    def place(self, value: str) -> int | None:
        """Where a value stands on the axis, compared in the six digits that a picture shows; None if nowhere."""
        with suppress(ValueError):
            if self.texts is not None:
                return self.texts.index(value)
            nearest = int(np.argmin(np.abs(self.values - float(value))))
            size = float(np.abs(self.values).max())
            if math.isclose(self.values[nearest], float(value), rel_tol=1e-5, abs_tol=1e-9 * size):
                return nearest
        return None


@dataclass(frozen=True)
class SweepPicture:
    """Everything that is drawn of a sweep.

    Each variable has the shape of the axes behind one dimension for `directions`: ("",) where the motion was not
    followed, otherwise those of "up" and "down" in which it was.
    """

    title: str
    findings: tuple[str, ...]
    chosen: tuple[str, ...]  # what was selected, and axes of a single value
    directions: tuple[str, ...]
    axes: tuple[Axis, ...]
    variables: Mapping[str, style.Array]
    units: Mapping[str, str]
    long_names: Mapping[str, str]
    critical: Critical | None

    def __getitem__(self, name: str) -> style.Array:
        """A variable."""
        return self.variables[name]

    @property
    def summary(self) -> str:
        """The number of points, and the results of their computation, in one line."""
        done = self["status"] == "done"
        parts = [f"{done.size} point{'s' if done.size != 1 else ''}"]
        if self.critical is None:
            regimes = zip(*np.unique(self["regime"][done], return_counts=True), strict=True)
            parts += [f"{name} {count}" for name, count in regimes]
        else:
            known = self["critical"][np.isfinite(self["critical"])]
            ends = [style.readable(float(f"{end(known):.4g}")) for end in (np.min, np.max) if known.size]
            span = f": {' to '.join(ends)} {self.units['critical']}".rstrip() if ends else ""
            parts.append(f"critical value found at {known.size}{span}")
        parts += [f"failed {(~done).sum()}"] if not done.all() else []
        return "   ·   ".join(parts)

    def at(self, axis: int, place: int) -> "SweepPicture":
        """What is left of the picture at one place of an axis."""
        variables = {name: np.take(values, place, axis + 1) for name, values in self.variables.items()}
        axes = self.axes[:axis] + self.axes[axis + 1 :]
        return replace(self, axes=axes, variables=variables, chosen=(*self.chosen, self.axes[axis].named(place)))

    def towards(self, direction: str) -> "SweepPicture":
        """The picture of one direction alone."""
        place = [self.directions.index(direction)]
        variables = {name: values[place] for name, values in self.variables.items()}
        chosen = (*self.chosen, f"on the way {direction}")
        return replace(self, directions=(direction,), variables=variables, chosen=chosen)


def gather(result: StoredResult, select: Sequence[str] = ()) -> SweepPicture:
    """Read from a result what its picture shows.

    `select` holds `KEY=VALUE`; axes of a single value are selected anyway. Raises UnreadableResultError where
    something is missing, UsageError where there is no such key or value.
    """
    try:
        sweep = parse_table(Sweep, str(result.attributes.get("resolved_sweep_toml", "")), "its resolved sweep")
    except CaseError as error:
        raise style.unreadable(result, f"the sweep in it is not valid: {error.problems[0]}") from error
    known = result.variables("/")
    names = _NEEDED + (_CRITICAL if sweep.critical is not None else ())
    if missing := [name for name in names if name not in known]:
        raise style.unreadable(result, f"it has no variable {missing[0]}")
    if len({(known[name].dims, known[name].shape) for name in names}) != 1:
        raise style.unreadable(result, "its variables do not lie on the same axes")
    dims = known["status"].dims
    both = dims[:1] == ("direction",)
    variables = {name: style.read_column(result, name)[... if both else np.newaxis] for name in names}
    for name in ("regime", "excitation"):  # those of points that failed mean nothing
        variables[name] = np.where(variables["status"] == "done", variables[name], "")
    followed = both and "hysteresis" in known and known["hysteresis"].dims == dims[1:]
    differ = result.read("/", "hysteresis") == 1 if followed else False
    variables["hysteresis"] = np.broadcast_to(differ, variables["status"].shape)
    units = {name: str(each.attributes.get("units", "")) for name, each in known.items()}
    units = {name: unit if unit != "1" else "" for name, unit in units.items()}
    long_names = {name: str(each.attributes.get("long_name", "")) for name, each in known.items()}
    axes = []
    for number, dimension in enumerate(dims[both:], start=1):
        values = result.read("/", dimension)
        texts = tuple(values.tolist()) if values.dtype.kind == "U" else None
        order = np.arange(len(values)) if texts else np.argsort(values, kind="stable")
        places = (order if texts else values[order]).astype(np.float64)
        axes.append(Axis(dimension, long_names[dimension], units[dimension], places, texts))
        variables = {name: np.take(values, order, number) for name, values in variables.items()}
    picture = SweepPicture(
        title=str(result.attributes.get("title", "")) or "Sweep without a title",
        findings=tuple(map(str, result.attributes.get("findings", ()))),
        chosen=(),
        directions=("up", "down") if both else (next((str(a.direction) for a in sweep.axis if a.direction), ""),),
        axes=tuple(axes),
        variables=variables,
        units=units,
        long_names=long_names,
        critical=sweep.critical,
    )
    for wanted in select:  # findings about the whole sweep need not hold for a part of it
        picture = replace(_selected(picture, wanted, result), findings=())
    for axis in picture.axes:
        if len(axis.values) == 1:
            picture = picture.at(picture.axes.index(axis), 0)
    _check_drawable(picture, result)
    return picture


def _selected(picture: SweepPicture, wanted: str, result: StoredResult) -> SweepPicture:
    key, _, value = (part.strip() for part in wanted.partition("="))
    value, both = value.strip("\"'"), len(picture.directions) > 1
    problem, choices = "no axis has this key or value", [axis.key for axis in picture.axes] + both * ["direction"]
    if key == "direction" and both:
        if value in picture.directions:
            return picture.towards(value)
        choices = [*picture.directions]
    for number, axis in enumerate(picture.axes):
        if key in (axis.dimension, *axis.key.split(", ")):
            if (place := axis.place(value)) is not None:
                return picture.at(number, place)
            problem, choices = "no point has this value", [*(axis.texts or map(label, axis.values.tolist()))]
    some = textwrap.shorten(", ".join(choices), 120, placeholder=" …")
    remedy = f"give one of {some}, as KEY=VALUE" if choices else "leave it out"
    raise UsageError(f"{result.path}: --select {wanted}: {problem}; {remedy}")


def _check_drawable(picture: SweepPicture, result: StoredResult) -> None:
    """Raise UsageError where there are no axes to draw along, or too many, or too long ones."""
    count, both = len(picture.axes), len(picture.directions) > 1
    keys = ", ".join([axis.key for axis in picture.axes] + both * ["direction"])
    least = min((len(axis.values) for axis in picture.axes), default=0)
    remedy = f"draw a part of it with --select KEY=VALUE for one of {keys}"
    if count == 0:
        problem = "a single point makes no picture"
        remedy = "sweep along an [[axis]] of two values or more, or read the point's numbers in the file"
    elif count + both > 3:
        problem = f"{count} axes{' in two directions' if both else ''} are too many for one picture"
    elif count == 3 and least > MOST_PANELS:
        problem = f"one of three axes may have {MOST_PANELS} values at most, and the shortest has {least}"
    else:
        return
    raise UsageError(f"{result.path}: {problem}; {remedy}")
