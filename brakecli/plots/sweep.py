"""What curves and maps of a sweep share: numbers over rising axes, missing ones as NaN; heading, legend, looks."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from brakecli.analysis.regime.table import Excitation, Regime
from brakecli.case.read import parse_table
from brakecli.errors import CaseError, UsageError
from brakecli.faces import argument
from brakecli.files import fields
from brakecli.files.read import StoredResult
from brakecli.plots import style
from brakecli.plots.axis import Axis
from brakecli.sweeps.margin import margins
from brakecli.sweeps.plan import Plan, label
from brakecli.sweeps.point import Status
from brakecli.sweeps.tables import Critical, Sweep
from brakecli.sweeps.windows import Outcome

REGIMES = {  # colour and marker
    Regime.DAMPED: ("#BFDDF0", "o"),
    Regime.RELAXATION: (style.ORANGE, "s"),
    Regime.QUASI_HARMONIC: (style.BLUE, "D"),
    Regime.UNDECIDED: ("#7A7A7A", "X"),  # in grey, between orange and blue
}
MARGIN = "margin"  # critical friction less friction, where the picture shows its zero
FORCED, DIFFERENT = "forced by the wheel's waves", "up and down differ"
CRITICAL_LINE = "critical friction"
WIDTH = 8.8  # inches, of a figure with one column of panels
MOST_PANELS = 5  # values of a third axis: its maps stand side by side
_NEEDED = ("status", "regime", "excitation", "amplitude", "frequency")
_CRITICAL = (
    *("critical_status", "critical", "critical_lower", "critical_upper", "critical_error"),
    *("critical_eigenvalue", "critical_sustained", "sustained_status"),
)
FORCED_PART, ATTRACTOR = "amplitude_forced", "attractor"
_WINDOWS = ("critical_windows_lower", "critical_windows_upper")
_FIRST = (*map(str, REGIMES), "by simulation", "with its error bar", "by eigenvalues")  # in the legend
_WIDE = 20.0  # ratio of lasting amplitudes from which on their scale is logarithmic

Sign = tuple[style.Array, dict[str, Any]]  # points without a value that could be drawn, the look of their marker


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
    shown: str = ""  # the variable that is asked for
    attractors: tuple[str, ...] = ()  # of a sweep over initial states: what each is, in words

    def __getitem__(self, name: str) -> style.Array:
        """A variable."""
        return self.variables[name]

    def died(self, name: str) -> style.Array:
        """Where nothing lasts: amplitude and frequency there are those of a rest that dies out."""
        dies = (self["regime"] == Regime.DAMPED) & (self["excitation"] == Excitation.NONE)
        return dies if name in ("amplitude", "frequency") else np.zeros_like(dies)

    @property
    def summary(self) -> str:
        """The number of points, and the results of their computation, in one line."""
        done = self["status"] == Status.DONE
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

    def lasting_amplitudes(self) -> tuple[float, float, bool]:
        """The least and the largest amplitude (m) that lasts, or 0; whether their scale is logarithmic."""
        sustained = np.isin(self["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
        amplitude = self["amplitude"][sustained & (self["amplitude"] > 0.0)]
        least, largest = (float(amplitude.min()), float(amplitude.max())) if amplitude.size else (0.0, 0.0)
        return least, largest, largest > _WIDE * least

    def differs(self) -> style.Array:
        """Where the least sustained value lies outside the bracket of the critical one, or where there is none."""
        assert self.critical is not None
        sustained, tolerance = self["critical_sustained"], self.critical.tolerance
        early = self["critical_lower"] - sustained > tolerance  # false where one of the two is missing
        late = sustained - self["critical_upper"] > tolerance
        return np.asarray(np.isfinite(sustained) & (early | late | np.isnan(self["critical"])))

    def failed(self) -> Sign:
        """Points that failed."""
        return sign(self["status"] != Status.DONE, "failed", "x", style.VERMILION, style.VERMILION)

    def missing(self) -> Iterator[Sign]:
        """Points without a critical value, or without a least sustained one, by the reason."""
        assert self.critical is not None
        status, sustained = self["critical_status"], self["sustained_status"]
        low, high = style.readable(self.critical.lower), style.readable(self.critical.upper)
        always = (sustained == Outcome.SUSTAINED) & (status != Outcome.UNSTABLE)
        never = (sustained == Outcome.DAMPED) & (status != Outcome.STABLE)
        yield sign(status == Outcome.STABLE, f"stable up to {high}", "^", style.BLUE, "white")
        yield sign(status == Outcome.UNSTABLE, f"unstable from {low} on", "v", style.BLUE, style.BLUE)
        yield sign(status == Outcome.NO_SLIDING, "no steady sliding", "s", style.DARK, "white")
        yield sign(always, f"vibration lasts from {low} on", "v", style.VERMILION, "white")
        in_part = f"vibration lasts at {low}, fades at {high}"
        yield sign(sustained == Outcome.IN_PART, in_part, "D", style.VERMILION, "white")
        yield sign(never, f"vibration fades up to {high}", "^", style.VERMILION, "white")
        several = np.isfinite(self["critical_windows_lower"]).sum(axis=-1) > 1
        yield sign(several, "several windows of instability", "+", style.DARK, style.DARK)
        yield self.failed()

    def figure(self, width: float, height: float, columns: int = 1) -> Figure:
        """An empty figure (inches) below the heading; `height` is that of the part below the heading."""
        chosen = ["   ·   ".join(self.chosen)] if self.chosen else []
        lines = [self.summary, *chosen, *self.findings[:2]]
        return style.headed(width, height + 0.21 * len(lines), self.title, *lines, columns=columns)


def sign(where: style.Array, label: str, marker: str, colour: str, face: str) -> Sign:
    """A sign for points without a value; a triangle that points up stands at the top of curves."""
    return where, {"ls": "none", "label": label, "marker": marker, "mec": colour, "mfc": face, "mew": 1.2}


def add_legend(figure: Figure) -> None:
    """Add all labels in as few rows as fit between the heading and the panels."""
    artists = style.labels(figure)
    if not artists:
        return
    texts = sorted(artists, key=lambda text: _FIRST.index(text) if text in _FIRST else len(_FIRST))
    width, height = figure.get_size_inches()
    for columns in range(len(texts), 0, -1):
        longest = [max(map(len, column)) for column in np.array_split(texts, columns)]  # as Matplotlib fills them
        if sum(0.075 * length + 0.45 for length in longest) <= width - 0.4:
            break
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    left, bottom, wide, high = engine.get()["rect"]
    look: dict[str, Any] = {"frameon": False, "borderaxespad": 0.0, "borderpad": 0.0, "columnspacing": 1.6}
    look |= {"loc": "upper left", "bbox_to_anchor": (0.125 / width, bottom + high), "ncols": columns}
    figure.legend([artists[text] for text in texts], texts, **look).set_in_layout(False)
    taken = (0.19 * -(-len(texts) // columns) + 0.09) / height
    engine.set(rect=(left, bottom, wide, high - taken))


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
    known, variables = result.variables("/"), _variables(result, sweep, shown, more)
    dims = known["status"].dims
    both = dims[:1] == ("direction",)
    units = {name: style.unit_of(each.attributes) for name, each in known.items()}
    long_names = {name: str(each.attributes.get("long_name", "")) for name, each in known.items()}
    axes = []
    for number, dimension in enumerate(dims[both:], start=1):
        values = result.read("/", dimension)
        texts = tuple(values.tolist()) if values.dtype.kind == "U" else None
        order = np.arange(len(values)) if texts else np.argsort(values, kind="stable")
        places = (order if texts else values[order]).astype(np.float64)
        axes.append(Axis(dimension, long_names[dimension], units[dimension], places, texts))
        variables = {name: np.take(values, order, number) for name, values in variables.items()}
    title = str(result.attributes.get("title", "")) or "Sweep without a title"
    findings = tuple(map(str, result.attributes.get("findings", ())))
    way = next((axis.direction for axis in sweep.axis if axis.direction), "")
    ways = ("up", "down") if both else (way,)
    picture = SweepPicture(
        title, findings, (), ways, tuple(axes), variables, units, long_names, sweep.critical, shown
    )
    if ATTRACTOR in known:
        picture = replace(picture, attractors=tuple(_attractors(variables)))
    for wanted in select:  # findings about the whole sweep need not hold for a part of it
        picture = replace(_selected(picture, wanted, result), findings=())
    for axis in picture.axes:
        if len(axis.values) == 1:
            picture = picture.at(picture.axes.index(axis), 0)
    _check_drawable(picture, result)
    return picture


def _variables(result: StoredResult, sweep: Sweep, shown: str, more: Sequence[str]) -> dict[str, style.Array]:
    """What is drawn of the points, over the directions and the axes as they lie in the file."""
    known = result.variables("/")
    names = _NEEDED + (_CRITICAL if sweep.critical is not None else ())
    if missing := [name for name in names if name not in known]:
        raise style.unreadable(result, f"it has no variable {missing[0]}")
    if len({(known[name].dims, known[name].shape) for name in names}) != 1:
        raise style.unreadable(result, "its variables do not lie on the same axes")
    dims = known["status"].dims
    both = dims[:1] == ("direction",)

    def read(name: str) -> style.Array:
        return style.read_column(result, name)[... if both else np.newaxis]

    variables = {name: read(name) for name in names}
    shape = variables["status"].shape
    for name in _WINDOWS if sweep.critical is not None else ():  # older results have none
        there = name in known and known[name].dims == (*dims, fields.WINDOW.name)
        variables[name] = read(name) if there else np.full((*shape, 1), np.nan)
    if shown and shown not in (able := numeric(result)):
        problem = f"{argument('variable')} {shown}: no number of its points has this name"
        raise UsageError(f"{result.path}: {problem}; give one of {', '.join(able)}")
    base = str(result.attributes.get("resolved_toml", ""))
    margin = None
    with suppress(CaseError, ValueError, RecursionError):  # of older results, and of forged ones
        margin = margins(Plan(result.text("resolved_sweep_toml"), base)) if sweep.critical is None else None
    if margin is not None and margin.size == np.prod(shape[1:]):
        variables[MARGIN] = np.broadcast_to(margin.reshape(shape[1:]), shape)
    for name in {shown, *more, *({FORCED_PART, ATTRACTOR} & {*known})} - {"", *variables}:
        values = read(name)
        nothing = np.nan if values.dtype.kind in "if" else ""
        variables[name] = np.where(variables["status"] == Status.DONE, values, nothing)
    for name in ("regime", "excitation"):  # those of points that failed mean nothing
        variables[name] = np.where(variables["status"] == Status.DONE, variables[name], "")
    differ = result.read("/", "hysteresis") == 1 if both and "hysteresis" in known else False
    variables["hysteresis"] = np.broadcast_to(differ, shape)
    return variables


def _attractors(variables: Mapping[str, style.Array]) -> Iterator[str]:
    """Number, regime, frequency, amplitude and share of each attractor, by its points."""
    numbers = variables[ATTRACTOR]
    for number in range(1, int(np.nanmax(numbers, initial=0)) + 1):
        here = numbers == number
        regimes, counts = np.unique(variables["regime"][here], return_counts=True)
        regime, share = str(regimes[counts.argmax()]), float(here.mean())
        frequency, amplitude = (float(np.median(variables[name][here])) for name in ("frequency", "amplitude"))
        if np.all(variables["excitation"][here] == Excitation.NONE):
            amplitude = 0.0  # what dies comes to steady sliding
        factor, unit = style.prefixed(amplitude, "m")
        tone = f", {frequency:.4g} Hz" if frequency > 0.0 else ""
        size = f", {factor * amplitude:.3g} {unit}" if amplitude else ""
        yield f"{number}: {regime}{tone}{size}, {share:.1%} of the points"


def numeric(result: StoredResult) -> list[str]:
    """The variables of a sweep that hold a number for each point."""
    known = result.variables("/")
    dims = known["status"].dims
    return [name for name, each in known.items() if each.dims == dims and name not in dims and each.kind in "if"]


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
                picture = picture.at(number, place)
                same = axis.texts or style.readable(float(axis.values[place])) == style.readable(float(value))
                note = "" if same else f" (nearest to {value})"
                return replace(picture, chosen=(*picture.chosen[:-1], picture.chosen[-1] + note))
            problem, choices = "no point has this value", [*(axis.texts or map(label, axis.values.tolist()))]
    some = textwrap.shorten(", ".join(choices), 120, placeholder=" …")
    remedy = f"give one of {some}, as KEY=VALUE" if choices else "leave it out"
    raise UsageError(f"{result.path}: {argument('select')} {wanted}: {problem}; {remedy}")


def _check_drawable(picture: SweepPicture, result: StoredResult) -> None:
    """Raise UsageError where there are no axes to draw along, or too many, or too long ones."""
    count, both = len(picture.axes), len(picture.directions) > 1
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
