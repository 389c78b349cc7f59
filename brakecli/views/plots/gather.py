"""What the picture of a sweep shows, read from its result: its axes, its variables, its attractors."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from brakecli.analysis.regime.decision import Excitation
from brakecli.case.read import parse_table
from brakecli.errors import CaseError, UsageError
from brakecli.faces import argument
from brakecli.results import fields
from brakecli.results.read import StoredResult
from brakecli.studies.sweeps.margin import margins
from brakecli.studies.sweeps.plan import Plan, label
from brakecli.studies.sweeps.record import Status
from brakecli.studies.sweeps.tables import Sweep
from brakecli.views.plots import style
from brakecli.views.plots.axis import Axis
from brakecli.views.plots.run import case_of
from brakecli.views.plots.sweep import ATTRACTOR, FORCED_PART, MARGIN, MOST_PANELS, SweepPicture

_NEEDED = ("status", "regime", "excitation", "amplitude", "frequency")
_CRITICAL = (
    *("critical_status", "critical", "critical_lower", "critical_upper", "critical_error"),
    *("critical_eigenvalue", "critical_sustained", "sustained_status"),
)
_WINDOWS = ("critical_windows_lower", "critical_windows_upper")


def gather(
    result: StoredResult, select: Sequence[str] = (), shown: str = "", more: Sequence[str] = ()
) -> SweepPicture:
    """Read from a result what its picture shows: the variable that is `shown`, if it is named, and `more` of them.

    `select` holds `KEY=VALUE`; axes of a single value are selected anyway. Raises UnreadableResultError where
    something is missing, UsageError where there is no such key, value or variable.
    """
    try:
        sweep = parse_table(Sweep, str(result.attributes.get("resolved_sweep_toml", "")), "its resolved sweep")
    except CaseError as error:
        raise style.unreadable(result, f"the sweep in it is not valid: {error.problems[0]}") from error
    stored = result.variables("/")
    variables = _variables(result, sweep, shown, more)
    dims = stored["status"].dims
    both = dims[:1] == ("direction",)
    units = {name: style.unit_of(variable.attributes) for name, variable in stored.items()}
    long_names = {name: str(variable.attributes.get("long_name", "")) for name, variable in stored.items()}
    listed = _listed(result)
    axes = []
    # a list over a single key is a sweep along this key
    alone = len(listed) == 1 and len(listed[0][0].values) == len(listed[0][1])
    along, listed = (listed[0][0].dimension, ()) if alone else ("", listed)
    for number, dimension in enumerate(dims[both:], start=1):
        values = result.read("/", along or dimension)
        order = np.arange(len(values)) if values.dtype.kind == "U" else np.argsort(values, kind="stable")
        axes.append(_axis(result, along or dimension, values[order]))
        variables = {name: np.take(values, order, number) for name, values in variables.items()}
    title = str(result.attributes.get("title", "")) or "Sweep without a title"
    findings = tuple(map(str, result.attributes.get("findings", ())))
    way = next((axis.direction for axis in sweep.axis if axis.direction), "")
    ways = ("up", "down") if both else (way,)
    picture = SweepPicture(
        title, findings, (), ways, tuple(axes), variables, units, long_names, sweep.critical, shown, (), listed
    )
    if more_keys := ", ".join(axis.key for axis, _ in listed[2:]):
        picture = replace(picture, chosen=(f"at different {more_keys}",))
    if ATTRACTOR in stored:
        picture = replace(picture, attractors=tuple(_attractors(variables)))
    for wanted in select:  # findings about the whole sweep need not hold for a part of it
        picture = replace(_selected(picture, wanted, result), findings=())
    for axis in picture.axes:
        if len(axis.values) == 1:
            picture = picture.at(picture.axes.index(axis), 0)
    _check_drawable(picture, result)
    return picture


def _axis(result: StoredResult, name: str, values: style.Array) -> Axis:
    """The axis of a variable, by its values in order."""
    about = result.variables("/")[name].attributes
    texts = tuple(values.tolist()) if values.dtype.kind == "U" else None
    places = (np.arange(len(values)) if texts else values).astype(np.float64)
    key = str(about.get("long_name", ""))
    state = {f"initial.{component}" for component in ("x", "y", "vx", "vy")}
    offset = {*key.split(", ")} <= state and case_of(result).case.initial.at == "equilibrium"
    return Axis(name, key, style.unit_of(about), places, texts, offset)


def _listed(result: StoredResult) -> tuple[tuple[Axis, style.Array], ...]:
    """An axis of each key of listed points that varies, and where along it each of them lies."""
    listed = []
    stored = result.variables("/")
    point = fields.LISTED_POINT.name
    keys = np.ravel(stored[point].attributes.get("parameters", ())) if point in stored else ()
    for name in (str(key).replace(".", "_") for key in keys):
        values, places = np.unique(result.read("/", name), return_inverse=True)
        axis = _axis(result, name, values)
        listed += [(axis, axis.values[places])] * (len(values) > 1)
    return tuple(listed)


def _variables(result: StoredResult, sweep: Sweep, shown: str, more: Sequence[str]) -> dict[str, style.Array]:
    """What is drawn of the points, over the directions and the axes as they lie in the file."""
    stored = result.variables("/")
    names = _NEEDED + (_CRITICAL if sweep.critical is not None else ())
    dims = stored["status"].dims
    both = dims[:1] == ("direction",)

    def read(name: str) -> style.Array:
        return style.read_column(result, name)[... if both else np.newaxis]

    variables = {name: read(name) for name in names}
    shape = variables["status"].shape
    for name in _WINDOWS if sweep.critical is not None else ():  # older results have none
        there = name in stored and stored[name].dims == (*dims, fields.WINDOW.name)
        variables[name] = read(name) if there else np.full((*shape, 1), np.nan)
    if shown and shown not in (able := numeric(result)):
        problem = f"{argument('variable')} {shown}: no number of its points has this name"
        raise UsageError(f"{result.path}: {problem}; give one of {', '.join(able)}")
    base = str(result.attributes.get("resolved_toml", ""))
    margin = None
    with suppress(CaseError, ValueError):  # of older results
        margin = margins(Plan(result.text("resolved_sweep_toml"), base)) if sweep.critical is None else None
    if margin is not None and margin.size == np.prod(shape[1:]):
        variables[MARGIN] = np.broadcast_to(margin.reshape(shape[1:]), shape)
    for name in {shown, *more, *({FORCED_PART, ATTRACTOR} & {*stored})} - {"", *variables}:
        values = read(name)
        nothing = np.nan if values.dtype.kind in "if" else ""
        variables[name] = np.where(variables["status"] == Status.DONE, values, nothing)
    for name in ("regime", "excitation"):  # those of points that failed mean nothing
        variables[name] = np.where(variables["status"] == Status.DONE, variables[name], "")
    differ = result.read("/", "hysteresis") == 1 if both and "hysteresis" in stored else False
    variables["hysteresis"] = np.broadcast_to(differ, shape)
    return variables


def _attractors(variables: Mapping[str, style.Array]) -> Iterator[str]:
    """Number, regime, frequency, amplitude and share of each attractor, by its points."""
    numbers = variables[ATTRACTOR]
    for number in range(1, int(np.nanmax(numbers, initial=0)) + 1):
        here = numbers == number
        regimes, counts = np.unique(variables["regime"][here], return_counts=True)
        regime = str(regimes[counts.argmax()])
        share = float(here.mean())
        frequency, amplitude = (float(np.median(variables[name][here])) for name in ("frequency", "amplitude"))
        if np.all(variables["excitation"][here] == Excitation.NONE):
            amplitude = 0.0  # what dies comes to steady sliding
        factor, unit = style.prefixed(amplitude, "m")
        tone = f", {frequency:.4g} Hz" if frequency > 0.0 else ""
        size = f", {factor * amplitude:.3g} {unit}" if amplitude else ""
        yield f"{number}: {regime}{tone}{size}, {share:.1%} of the points"


def numeric(result: StoredResult) -> list[str]:
    """The variables of a sweep that hold a number for each point."""
    stored = result.variables("/")
    dims = stored["status"].dims
    of_points = {name: variable for name, variable in stored.items() if variable.dims == dims and name not in dims}
    return [name for name, variable in of_points.items() if variable.kind in "if"]


def _selected(picture: SweepPicture, wanted: str, result: StoredResult) -> SweepPicture:
    key, _, value = (text.strip() for text in wanted.partition("="))
    value = value.strip("\"'")
    both = len(picture.directions) > 1
    problem = "no axis has this key or value"
    choices = [axis.key for axis in picture.axes] + both * ["direction"]
    if key == "direction" and both:
        if value in picture.directions:
            return picture.towards(value)
        choices = [*picture.directions]
    for number, axis in enumerate(picture.axes):
        if key in (axis.dimension, *axis.key.split(", ")):
            if (index := axis.index_of(value)) is not None:
                picture = picture.at(number, index)
                same = axis.texts or style.readable(float(axis.values[index])) == style.readable(float(value))
                note = "" if same else f" (nearest to {value})"
                return replace(picture, chosen=(*picture.chosen[:-1], picture.chosen[-1] + note))
            problem = "no point has this value"
            choices = [*(axis.texts or map(label, axis.values.tolist()))]
    some = textwrap.shorten(", ".join(choices), 120, placeholder=" …")
    remedy = f"give one of {some}, as KEY=VALUE" if choices else "leave it out"
    raise UsageError(f"{result.path}: {argument('select')} {wanted}: {problem}; {remedy}")


def _check_drawable(picture: SweepPicture, result: StoredResult) -> None:
    """Raise UsageError where there are no axes to draw along, or too many, or too long ones."""
    count = len(picture.axes)
    both = len(picture.directions) > 1
    keys = ", ".join([axis.key for axis in picture.axes] + both * ["direction"])
    least = min((len(axis.values) for axis in picture.axes), default=0)
    remedy = f"draw a part of it with {argument('select')} KEY=VALUE for one of {keys}"
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
