"""What curves and maps of a sweep share: numbers over rising axes, missing ones as NaN; heading, legend, looks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from brakecli.analysis.regime.decision import Excitation, Regime
from brakecli.studies.sweeps.record import Status
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome
from brakecli.views.plots import style
from brakecli.views.plots.axis import Axis

REGIMES = {  # colour and marker
    Regime.DAMPED: ("#BFDDF0", "o"),
    Regime.RELAXATION: (style.ORANGE, "s"),
    Regime.QUASI_HARMONIC: (style.BLUE, "D"),
    Regime.UNDECIDED: ("#7A7A7A", "X"),  # in grey, between orange and blue
}
MARGIN = "margin"  # critical friction less friction, where the picture shows its zero
FORCED = "forced by the wheel's waves"
DIFFERENT = "up and down differ"
CRITICAL_LINE = "critical friction"
UNKNOWN = "no attractor known"
MOST_NAMED = 12  # attractors in the legend: the first of them
_FORMS = "osD^vPh*<>"  # markers of attractors, in turn
WIDTH = 8.8  # inches, of a figure with one column of panels
MOST_PANELS = 5  # values of a third axis: its maps stand side by side
FORCED_PART = "amplitude_forced"
ATTRACTOR = "attractor"
_FIRST = (*map(str, REGIMES), "by simulation", "critical value", "error bar", "by eigenvalues")  # in the legend


class Sign(NamedTuple):
    """Points without a value that could be drawn, and the look of their marker."""

    where: style.Array
    look: style.Look


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
    listed: tuple[tuple[Axis, style.Array], ...] = ()  # keys of listed points, and where along each they lie

    def __getitem__(self, name: str) -> style.Array:
        """A variable."""
        return self.variables[name]

    def died(self, name: str) -> style.Array:
        """Where nothing lasts: amplitude and frequency there are those of a rest that dies out."""
        dies = (self["regime"] == Regime.DAMPED) & (self["excitation"] == Excitation.NONE)
        return dies if name in ("amplitude", "frequency") else np.zeros_like(dies)

    @property
    def plane(self) -> tuple[tuple[Axis, style.Array], ...]:
        """Both axes of a map, and where along each of them the points lie."""
        if self.listed:
            return self.listed[:2]
        places = np.meshgrid(*(axis.values for axis in self.axes), indexing="ij")
        return tuple(zip(self.axes, places, strict=True))

    def named(self, indices: Sequence[np.intp]) -> str:
        """The keys of a point with their values, by its place along each axis."""
        if self.listed:
            at = [(axis, int(np.searchsorted(axis.values, along[indices[0]]))) for axis, along in self.listed]
        else:
            at = [*zip(self.axes, map(int, indices), strict=True)]
        return ", ".join(axis.named(where) for axis, where in at)

    @property
    def kinds(self) -> Iterator[tuple[style.Array, str, str, str]]:
        """Points by their attractor, otherwise by their regime: which they are, label, colour and marker."""
        for regime, look in {} if self.attractors else REGIMES.items():
            yield self["regime"] == regime, str(regime), *look
        colours = map(to_hex, shades(len(self.attractors)))
        for number, (words, colour) in enumerate(zip(self.attractors, colours, strict=True)):
            yield self[ATTRACTOR] == number + 1, words, colour, _FORMS[number % len(_FORMS)]
        if self.attractors:
            unknown = (self[ATTRACTOR] == 0) & (self["status"] == Status.DONE)
            yield unknown, UNKNOWN, *REGIMES[Regime.UNDECIDED]

    @property
    def summary(self) -> str:
        """The number of points, and the results of their computation, in one line."""
        done = self["status"] == Status.DONE
        parts = [f"{done.size} point{'s' if done.size != 1 else ''}"]
        if self.critical is None:
            regimes = zip(*np.unique(self["regime"][done], return_counts=True), strict=True)
            parts += [f"{name} {count}" for name, count in regimes]
        else:
            finite = self["critical"][np.isfinite(self["critical"])]
            ends = [style.readable(float(f"{end(finite):.4g}")) for end in (np.min, np.max) if finite.size]
            span = f": {' to '.join(ends)} {self.units['critical']}".rstrip() if ends else ""
            parts.append(f"critical value found at {finite.size}{span}")
        parts += [f"failed {(~done).sum()}"] if not done.all() else []
        return "   ·   ".join(parts)

    def at(self, axis: int, index: int) -> "SweepPicture":
        """What is left of the picture at one place of an axis."""
        variables = {name: np.take(values, index, axis + 1) for name, values in self.variables.items()}
        axes = self.axes[:axis] + self.axes[axis + 1 :]
        return replace(self, axes=axes, variables=variables, chosen=(*self.chosen, self.axes[axis].named(index)))

    def towards(self, direction: str) -> "SweepPicture":
        """The picture of one direction alone."""
        index = [self.directions.index(direction)]
        variables = {name: values[index] for name, values in self.variables.items()}
        chosen = (*self.chosen, f"on the way {direction}")
        return replace(self, directions=(direction,), variables=variables, chosen=chosen)

    def lasting_amplitudes(self) -> tuple[float, float, bool]:
        """The least and the largest amplitude (m) that lasts, or 0; whether their scale is logarithmic."""
        sustained = np.isin(self["regime"], (Regime.RELAXATION, Regime.QUASI_HARMONIC))
        amplitude = self["amplitude"][sustained & (self["amplitude"] > 0.0)]
        least, largest = (float(amplitude.min()), float(amplitude.max())) if amplitude.size else (0.0, 0.0)
        return least, largest, largest > 20.0 * least

    def differs(self) -> style.Array:
        """Where the least sustained value lies outside the bracket of the critical one, or where there is none."""
        assert self.critical is not None
        sustained = self["critical_sustained"]
        tolerance = self.critical.tolerance
        early = self["critical_lower"] - sustained > tolerance  # false where one of the two is missing
        late = sustained - self["critical_upper"] > tolerance
        return np.asarray(np.isfinite(sustained) & (early | late | np.isnan(self["critical"])))

    def failed(self) -> Sign:
        """Points that failed."""
        return sign(self["status"] != Status.DONE, "failed", "x", style.VERMILION, style.VERMILION)

    def missing(self) -> Iterator[Sign]:
        """Points without a critical value, or without a least sustained one, by the reason."""
        assert self.critical is not None
        status = self["critical_status"]
        sustained = self["sustained_status"]
        low = style.readable(self.critical.lower)
        high = style.readable(self.critical.upper)
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
    return Sign(where, {"ls": "none", "label": label, "marker": marker, "mec": colour, "mfc": face, "mew": 1.2})


def size_of(points: int, largest: float = 6.5) -> float:
    """The size of markers (1/72 inch), smaller where there are more than 60 points."""
    return float(max(2.0, largest * min(1.0, 60 / points) ** 0.5))


def shades(count: int) -> style.Array:
    """A colour for each attractor, the darker the larger its number: they are told apart in grey as well."""
    return np.asarray(colormaps["cividis_r"](np.linspace(0.05, 0.95, count)))


def add_legend(figure: Figure) -> None:
    """Add all labels in as few rows as fit between the heading and the panels."""
    artists = style.labels(figure.axes)
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
    x, y, wide, high = engine.get()["rect"]
    legend = figure.legend(
        [artists[text] for text in texts],
        texts,
        loc="upper left",
        bbox_to_anchor=(0.125 / width, y + high),
        ncols=columns,
        frameon=False,
        borderaxespad=0.0,
        borderpad=0.0,
        columnspacing=1.6,
    )
    legend.set_in_layout(False)
    taken = (0.19 * -(-len(texts) // columns) + 0.09) / height
    engine.set(rect=(x, y, wide, high - taken))
