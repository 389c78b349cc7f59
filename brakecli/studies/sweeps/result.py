"""The result of a sweep: what its file holds, and what the command reports of it."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import is_undamped
from brakecli.case.case import Case
from brakecli.case.parts import SETTLED
from brakecli.case.read import key_path
from brakecli.case.system import system_of
from brakecli.case.tables import key_schema
from brakecli.results import fields
from brakecli.results.field import Field, plain, values_of
from brakecli.results.write import ResultFile
from brakecli.studies.runs.run import origin
from brakecli.studies.sweeps.attractors import SAME_AMPLITUDE, Attractor, Attractors
from brakecli.studies.sweeps.journal import Journal
from brakecli.studies.sweeps.plan import LoadedSweep, Plan, label
from brakecli.studies.sweeps.record import Status
from brakecli.studies.sweeps.short_runs import on_short_runs
from brakecli.studies.sweeps.tables import Axis

MOST_FAILURES = 100
_DONE = Status.DONE.encode()
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")  # by which sentences of one kind differ
_LONGER = re.compile(rf"run at least ({_NUMBER.pattern}) s")


class Failure(TypedDict):
    """A point without a result."""

    point: int
    parameters: dict[str, object]
    reason: str


class Findings:
    """What the command reports of a sweep as a whole."""

    def __init__(self, journal: Journal) -> None:
        """Look through the variables of a sweep."""
        plan = journal.plan
        self.points = plan.passes * plan.points
        self.dimensions = tuple(plan.dimensions)
        self.failed = 0
        warnings = 0
        first = ""
        self.failures = list[Failure]()
        regimes = Counter[bytes]()
        for start, records in journal.blocks():
            failed = np.flatnonzero(records["status"] != _DONE)
            warned = np.flatnonzero(records["warning_count"])
            for index in failed[: MOST_FAILURES - len(self.failures)].tolist():
                point = start + index
                reason = records["reason"][index].decode()
                self.failures.append(Failure(point=point, parameters=_parameters(plan, point), reason=reason))
            if len(warned) and not warnings:
                first = records["warning"][warned[0]].decode()
            self.failed = self.failed + len(failed)
            warnings += len(warned)
            names, counts = np.unique(records["regime"], return_counts=True)
            regimes.update(dict(zip(names.tolist(), counts.tolist(), strict=True)))
        self.warnings = [f"points that ran with warnings: {warnings}, the first: {first}"] if warnings else []
        self.regimes = {name.decode(): count for name, count in sorted(regimes.items())}
        self.hysteresis, said = _hysteresis(journal)
        self.sentences = [*said, *on_short_runs(journal), *_on_undecided(journal), *_on_settled(journal)]
        self.critical: tuple[int, float, float] | None = None  # how many points have one, the least, the largest
        if (sought := plan.sweep.critical) is not None:
            values = journal.column("critical")
            finite = values[~np.isnan(values)]
            self.critical = (0, 0.0, 0.0)
            if len(finite):
                self.critical = (len(finite), float(finite.min()), float(finite.max()))
            bars = _on_wide_bars(journal, sought.lower, sought.upper)
            self.sentences += [*_on_lasting_vibration(journal, sought.tolerance), *bars, *_on_no_dashpots(plan)]
        self.attractors: list[Attractor] | None = None
        if plan.over_starts:
            come_to = Attractors.of(journal)
            self.come_to = come_to.numbers
            self.attractors = come_to.attractors
            self.sentences += come_to.sentences
        self.variables: dict[str, Any] | None = None
        if self.points <= 10_000:  # of more the file alone holds every number
            self.variables = {field.name: plain(journal.column(field.name)) for field in plan.fields}
            if self.attractors is not None:
                self.variables[fields.STARTS[0].name] = plain(self.come_to)


@dataclass(frozen=True)
class SweepReport:
    """A sweep that has ended."""

    output: Path
    loaded: LoadedSweep
    findings: Findings
    resumed: int  # points that were there already
    notes: tuple[str, ...]
    computed: int  # points that were not
    seconds: float = 0.0  # of the command
    overhead: float = 0.0  # part of the workers' time that they did not spend on points

    @property
    def points_per_second(self) -> float | None:
        """How fast points were computed, start and end of the command included."""
        return self.computed / self.seconds if self.computed and self.seconds else None

    @property
    def axes(self) -> dict[str, object]:
        """The parameters and the values of each axis; none where there are too many points."""
        axes = self.loaded.sweep.axis if self.findings.variables is not None else ()
        return {axis.name: {"parameter": axis.parameter, "values": _values(axis)} for axis in axes}

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them: the variables of the file, null where a number is missing."""
        return {**values_of(fields.SWEEP, self), **(self.findings.variables or {})}


def write(result: ResultFile, report: SweepReport, journal: Journal) -> None:
    """Everything that the file holds."""
    loaded = report.loaded
    findings = report.findings
    plan = journal.plan
    sweep = {"sweep_toml": loaded.text, "resolved_sweep_toml": loaded.resolved}
    result.set_attributes({**origin("sweep", loaded.title, loaded.base), **sweep})
    result.set_fields(fields.SWEEP, report.numbers())
    if "direction" in findings.dimensions:
        result.axis("/", fields.DIRECTION, np.array(["up", "down"]))
    for axis in plan.sweep.axis:
        _write_along(result, axis.name, axis.parameter, axis.name, _values(axis))
    if plan.listed is not None:
        keys = plan.listed.keys
        point = fields.LISTED_POINT
        result.variable("/", point, (point.name,), np.arange(plan.points), parameters=[*keys])
        for key, column in zip(keys, plan.listed.columns, strict=True):
            _write_along(result, key.replace(".", "_"), [key], point.name, column)
    elif not plan.sweep.axis:
        result.axis("/", fields.BASE_POINT, np.zeros(1))
    windows = 0
    critical = plan.sweep.critical
    if critical is not None:
        windows = journal.column("critical_windows_lower").shape[-1]
        result.axis("/", fields.WINDOW, np.arange(float(windows)))
    for field in plan.fields:
        attributes = {}
        kind = journal.stored[field.name]
        dimensions = findings.dimensions
        if critical is not None and field in fields.CRITICAL and "f8" in field.kind and not field.units:
            attributes = {"parameter": critical.parameter}
            field = replace(field, units=unit(critical.parameter))
        if kind.shape:
            dimensions = (*dimensions, fields.WINDOW.name)
        result.begin_column(field, dimensions, kind, **attributes)
    for first, last, where in result.blocks(findings.dimensions):
        records = journal.read(first, last)
        shape = [span.stop - span.start for span in where]
        for field in plan.fields:
            values = records[field.name]
            values = values[:, :windows] if values.ndim > 1 else values
            result.fill(field.name, where, values.reshape(*shape, *values.shape[1:]))
    if findings.hysteresis is not None:
        result.column(*fields.DIFFERENCE, findings.dimensions[1:], findings.hysteresis)
    if findings.attractors is not None:
        result.column(*fields.STARTS, findings.dimensions, findings.come_to)
        own, *others = fields.ATTRACTOR
        result.axis("attractors", own, np.arange(1, len(findings.attractors) + 1))
        for field in others:
            numbers = [field.read(attractor) for attractor in findings.attractors]
            result.column(field, (own.name,), numbers, "attractors")


def _write_along(
    result: ResultFile, name: str, keys: Sequence[str], dimension: str, values: Sequence[Any]
) -> None:
    """The values that keys take along a dimension."""
    about = key_schema(Case, key_path(keys[0]))
    types = {*map(type, values)}
    number = "i8" if types == {int} and about.get("type") == "integer" else "f8"
    numeric = all(type(value) in (int, float) and math.isfinite(value) for value in values)
    data = np.array(values, number) if numeric else np.array([*map(label, values)])
    result.variable(
        "/", Field(name, unit(keys[0]), ", ".join(keys), number), (dimension,), data, parameters=[*keys]
    )


def unit(parameter: str) -> str:
    """The unit of a key of the case, by the schema of its file; empty where it has none."""
    return str(key_schema(Case, key_path(parameter)).get("unit", ""))


def _values(axis: Axis) -> list[Any]:
    return [axis.value(index) for index in range(axis.size)]


def _hysteresis(journal: Journal) -> tuple[NDArray[np.int64] | None, list[str]]:
    """Where the motions on the way up and on the way down differ (1), and what to say of it; None without both."""
    if journal.plan.passes != 2:
        return None, []
    regime = journal.column("regime")
    amplitude = journal.column("amplitude")
    done = (journal.column("status") == _DONE) & (regime != b"undecided")
    lasting = (regime != b"damped").any(axis=0)
    other = regime[0] != regime[1]
    apart = np.ptp(amplitude, axis=0) > SAME_AMPLITUDE * amplitude.max(axis=0)  # not where one is missing
    on_its_way = ~other & apart & lasting & (journal.column("settled") == 0).any(axis=0)
    comparable = done.all(axis=0) & ~on_its_way
    differ = comparable & (other | (apart & lasting))
    count = int(differ.sum())
    size = differ.size
    decided = int(comparable.sum())
    said = list[str]()
    lasts = regime != b"damped"
    simple = differ.ndim == 1 and (differ == (lasts[0] != lasts[1]))[comparable].all()
    if count and simple and (ends := _ends_of_loop(journal.plan, lasts, done)):
        said.append(f"hysteresis at {count} of {size} points: {ends}")
    elif count:
        where = [_parameters(journal.plan, int(index)) for index in np.flatnonzero(differ.ravel())[:3]]
        places = "; ".join(", ".join(f"{key} = {label(value)}" for key, value in point.items()) for point in where)
        more = f"; and {count - 3} more" if count > 3 else ""
        said.append(f"hysteresis at {count} of {size} points: {places}{more}")
    elif decided:
        those = f" at the {decided} point{'s that are' if decided > 1 else ' that is'} decided"
        those *= decided < size
        same = "the motion is the same on the way up and on the way down"
        if damped := int((comparable & ~lasting).sum()):
            both = "damped on the way up and on the way down"
            same = both if damped == decided else f"{both} at {damped} of them, and {same} at the others"
        said.append(f"no hysteresis{those}: {same}")
    if decided < size:
        doubtful = int((~comparable & apart).sum())
        ways = f"; the amplitudes of the two ways differ at {doubtful} of them" if doubtful else ""
        which = "s, which failed, are undecided or still on their way"
        which = which if size - decided > 1 else ", which failed, is undecided or still on its way"
        said.append(f"hysteresis is not known at {size - decided} point{which} in a direction{ways}")
    return differ.astype(np.int64), said


def _on_undecided(journal: Journal) -> Iterator[str]:
    """Where a quarter of the points or more are undecided: the most frequent reason, and what to do."""
    undecided = (journal.column("regime") == b"undecided") & (journal.column("status") == _DONE)
    count = int(undecided.sum())
    size = undecided.size
    if journal.plan.sweep.critical is not None or 4 * count < size or not count:
        return
    alike: dict[str, list[str]] = {}
    for reason in journal.column("reason")[undecided].tolist():
        alike.setdefault(_NUMBER.sub("", reason.decode()), []).append(reason.decode())
    most = max(alike.values(), key=len)
    longest = max(most, key=lambda text: float(match[1]) if (match := _LONGER.search(text)) else 0.0)
    by_itself = journal.plan.case({}).solver.duration == SETTLED
    remedy = '; solver.duration = "settled" runs as long as each needs' * ("run " in longest and not by_itself)
    yield f"{count} of {size} points are undecided, {len(most)} of them: {longest}{remedy}"


def _on_settled(journal: Journal) -> Iterator[str]:
    """How many points that run as long as they need have settled, and how long they ran."""
    plan = journal.plan
    size = journal.column("status").size
    if plan.sweep.critical is not None or ("solver", "duration") in plan.settings(0):
        return
    if plan.case({}).solver.duration != SETTLED:
        return
    done = journal.column("status") == _DONE
    seconds = journal.column("duration")
    lasts = journal.column("excitation") != b"none"
    settled = done & (journal.column("regime") != b"undecided") & (~lasts | (journal.column("settled") == 1))

    def ran(which: NDArray[np.bool_]) -> str:
        ends = dict.fromkeys(f"{end:.4g}" for end in (seconds[which].min(), seconds[which].max()))
        return f"{' to '.join(ends)} s"

    count = f"all {size}" if settled.all() else f"{int(settled.sum())} of {size}"
    said = f"{count} points are decided" + (f", in {ran(settled)} of motion" if settled.any() else "")
    yield said + (
        f"; others ran for {ran(others)} of it, and their reasons say more"
        if (others := done & ~settled).any()
        else ""
    )


def _ends_of_loop(plan: Plan, lasts: NDArray[np.bool_], decided: NDArray[np.bool_]) -> str:
    """Where vibration begins and ends on both ways, (2, points), between points that are known.

    Empty if on a way it does so more than once, or not at all with every point known.
    """
    (axis,) = plan.sweep.axis
    values = np.array(_values(axis))
    said = list[str]()
    for way, row, there, order in zip(
        ("up", "down"), lasts, decided, (np.argsort(values), np.argsort(-values)), strict=True
    ):
        change = _change(row[order], there[order], [label(float(value)) for value in values[order]])
        if not change:
            return ""
        verb, where = change
        said.append(f"{verb} on the way {way} {where}")
    return f"along {', '.join(axis.parameter)} the vibration {said[0]}, and {said[1]}"


def _change(lasts: NDArray[np.bool_], is_decided: NDArray[np.bool_], values: list[str]) -> tuple[str, str] | None:
    """What a vibration does once along points in their order, and where; None if this is not known."""
    decided = np.flatnonzero(is_decided)
    changes = np.flatnonzero(np.diff(lasts[decided]))
    if len(changes) == 1:
        before, after = decided[changes[0] : changes[0] + 2]
        return "begins" if lasts[after] else "ends", f"between {values[before]} and {values[after]}"
    if len(changes) or is_decided.all() or not len(decided):
        return None
    first = decided[0]
    last = decided[-1]
    if last < len(is_decided) - 1:  # the rest of the way is open
        return "lasts" if lasts[last] else "has not begun", f"at {values[last]}, and what follows is not known"
    if first == 0:
        return None
    return "begins" if lasts[first] else "ends", f"at {values[first]} or before"


def _on_lasting_vibration(journal: Journal, tolerance: float) -> Iterator[str]:
    """What is to be said where vibration from the case's own start does not begin at the critical value."""
    sustained = journal.column("critical_sustained")
    early = np.nan_to_num(journal.column("critical_lower") - sustained, nan=0.0)
    late = np.nan_to_num(sustained - journal.column("critical_upper"), nan=0.0)
    if below := int((early > tolerance).sum()):
        start = "from the case's own start vibration lasts at values up to"
        least = "below the one at which steady sliding loses its stability"
        both = f"vibration beside stable sliding at {below} of {early.size} points"
        yield f"{both}: {start} {early.max():.3g} {least}"
    if above := int((late > tolerance).sum()):
        start = "the case's own start leads into lasting vibration only at values up to"
        longer = "above the critical one; longer runs may give another answer"
        yield f"at {above} of {late.size} points {start} {late.max():.3g} {longer}"


def _on_wide_bars(journal: Journal, lower: float, upper: float) -> Iterator[str]:
    """What is to be done where no critical value is known, or hardly one, and where windows are hardly known."""
    wide = 0.1 * (upper - lower)
    size = journal.column("status").size
    undecided = int((journal.column("critical_status") == b"undecided").sum())
    unsure = int((np.nan_to_num(journal.column("critical_error"), nan=0.0) > wide).sum())
    wheel = "or waves of the wheel that have a common period"
    remedy = f"try a narrower range, {wheel}"
    for count, what in (
        (undecided, "no critical value is decided"),
        (unsure, "the error bar is a tenth of the range or wider"),
    ):
        if count:
            yield f"at {count} of {size} points {what}; {remedy}"
    for end in ("lower", "upper"):
        values, errors = (journal.column(f"critical_windows_{end}{of}") for of in ("", "_error"))
        vague = np.nan_to_num(errors, nan=0.0) > wide
        if vague.any():
            low = max(lower, (values - errors)[vague].min())
            high = min(upper, (values + errors)[vague].max())
            what = f"a window of instability {'begins' if end == 'lower' else 'ends'} anywhere"
            where = f"from {low:.5g} to {high:.5g}: no motion was found there, or its growth is not certain"
            yield f"at {int(vague.any(axis=-1).sum())} of {size} points {what} {where}"


def _on_no_dashpots(plan: Plan) -> Iterator[str]:
    """What counts as growth where nothing damps."""
    system = system_of(plan.case({}))
    by_runs = plan.sweep.critical is not None and plan.sweep.critical.method == "simulation"
    if by_runs and len(system.wheel.g) and is_undamped(system.coefficients):
        from brakecli.studies.sweeps.windows_of_branch import LIGHT  # only searches wait for its kernels

        none = f"growth that a damping ratio of {LIGHT:g} would stop counts as none"
        yield f"no dashpot acts: {none}; give the links the damping that they have"


def _parameters(plan: Plan, index: int) -> dict[str, object]:
    """What the axes set at a point, by its place in a variable of the result."""
    return {".".join(path): value for path, value in plan.settings(index % plan.points).items()}
