"""The result of a sweep: what its file holds, and what the command tells of it."""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import Case
from brakecli.case.read import key_path
from brakecli.case.tables import key_schema
from brakecli.files import fields
from brakecli.files.field import Field, plain, values_of
from brakecli.files.write import ResultFile
from brakecli.runs.run import origin
from brakecli.sweeps.file import LoadedSweep
from brakecli.sweeps.journal import Journal
from brakecli.sweeps.plan import Plan, label
from brakecli.sweeps.point import Status, fields_of, line_points

MOST_FAILURES = 100
MOST_TOLD = 10_000
"""Points up to which every number is told as JSON; of more, the file holds them."""
SAME_AMPLITUDE = 0.05
"""Motions whose amplitudes differ by less than this part, in the same regime, are the same."""

_DONE = Status.DONE.encode()


class Columns:
    """The variables of a finished sweep in the shape of its grid, read one by one."""

    def __init__(self, plan: Plan, journal: Journal) -> None:
        """Read from a journal that holds every unit."""
        self.plan = plan
        self._journal = journal

    @property
    def names(self) -> tuple[str, ...]:
        """The dimensions: those of the axes, in front of them the direction if both were followed."""
        names = [axis.name for axis in self.plan.sweep.axis] or ["point"]
        return (*(["direction"] if self.plan.passes == 2 else []), *names)

    @property
    def shape(self) -> tuple[int, ...]:
        """The length of each dimension."""
        return (*([2] if self.plan.passes == 2 else []), *(self.plan.shape or (1,)))

    def decoded(self, name: str) -> NDArray[Any]:
        """A variable, its texts as str."""
        values = self[name]
        return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A variable; missing numbers are NaN."""
        units = self._journal.column(name)
        if self.plan.followed is None:
            return units.reshape(self.shape)
        values = np.empty((self.plan.passes, self.plan.points), units.dtype)
        lines = len(units) // self.plan.passes
        for line, row in enumerate(units):
            values[line // lines, sorted(line_points(self.plan, line))] = row
        return values.reshape(self.shape)


@dataclass(frozen=True)
class Findings:
    """What there is to tell of a sweep without looking at every point."""

    points: int
    dimensions: tuple[str, ...]
    failed: int
    failures: tuple[dict[str, Any], ...]  # the first of them
    warned: int
    first_warning: str
    regimes: dict[str, int]
    critical: tuple[int, float, float] | None  # how many points have a critical value, the least, the largest
    hysteresis: NDArray[Any] | None
    sentences: tuple[str, ...]
    variables: dict[str, Any] | None


@dataclass(frozen=True)
class SweepReport:
    """A sweep that has ended."""

    output: Path
    loaded: LoadedSweep
    findings: Findings
    seconds: float
    resumed: int  # points that were there already
    notes: tuple[str, ...]

    @property
    def axes(self) -> dict[str, Any]:
        """The parameters and the values of each axis; none where there are too many points."""
        axes = self.loaded.sweep.axis if self.findings.variables is not None else ()
        return {
            axis.name: {"parameter": axis.parameter, "values": [axis.value(i) for i in range(axis.size)]}
            for axis in axes
        }

    def numbers(self) -> dict[str, Any]:
        """Names and values as `--json` gives them: the variables of the file, null where a number is missing."""
        return {**values_of(fields.SWEEP, self), **(self.findings.variables or {})}


def findings(columns: Columns) -> Findings:
    """Look through the variables of a sweep."""
    plan = columns.plan
    status, warnings = columns["status"], columns["warning_count"]
    failed = np.flatnonzero(status.ravel() != _DONE)
    reasons = columns["reason"].ravel()[failed[:MOST_FAILURES]]
    failures = [
        {"point": int(index), "parameters": _parameters(plan, int(index)), "reason": reason.decode()}
        for index, reason in zip(failed, reasons, strict=False)
    ]
    warned = np.flatnonzero(warnings.ravel())
    critical = None
    if plan.sweep.critical is not None:
        known = columns["critical"]
        known = known[~np.isnan(known)]
        critical = (len(known), float(known.min()), float(known.max())) if len(known) else (0, 0.0, 0.0)
    hysteresis = _hysteresis(columns)
    told = status.size <= MOST_TOLD
    return Findings(
        points=status.size,
        dimensions=columns.names,
        failed=len(failed),
        failures=tuple(failures),
        warned=len(warned),
        first_warning=columns["warning"].ravel()[warned[0]].decode() if len(warned) else "",
        regimes={name.decode(): count for name, count in sorted(Counter(columns["regime"].ravel()).items())},
        critical=critical,
        hysteresis=hysteresis,
        sentences=tuple(_sentences(columns, hysteresis)),
        variables={each.name: plain(columns[each.name]) for each in fields_of(plan)} if told else None,
    )


def write(result: ResultFile, report: SweepReport, columns: Columns) -> None:
    """Everything that the file holds."""
    loaded, found, plan = report.loaded, report.findings, columns.plan
    sweep = {"sweep_toml": loaded.text, "resolved_sweep_toml": loaded.resolved}
    result.set_attributes({**origin("sweep", loaded.title, loaded.base), **sweep})
    result.set_fields(fields.SWEEP, report.numbers())
    if "direction" in found.dimensions:
        result.axis("/", fields.DIRECTION, np.array(["up", "down"]))
    for axis in plan.sweep.axis:
        values = [axis.value(place) for place in range(axis.size)]
        data = np.array(values, dtype=np.float64) if axis.numeric else np.array([label(value) for value in values])
        field = Field(axis.name, unit(axis.parameter[0]), ", ".join(axis.parameter))
        result.variable("/", field, (axis.name,), data, {"parameters": list(axis.parameter)})
    if not plan.sweep.axis:
        result.axis("/", fields.BASE_POINT, np.zeros(1))
    for field in fields.POINT:
        result.column(field, columns.names, columns.decoded(field.name))
    if (critical := plan.sweep.critical) is not None:
        for field in fields.CRITICAL:
            numeric = field.kind == "f8"
            of_parameter = replace(field, units=unit(critical.parameter)) if numeric else field
            attributes = {"parameter": critical.parameter} if numeric else {}
            result.column(of_parameter, columns.names, columns.decoded(field.name), **attributes)
    if found.hysteresis is not None:
        result.column(*fields.DIFFERENCE, found.dimensions[1:], found.hysteresis)


def unit(parameter: str) -> str:
    """The unit of a key of the case, by the schema of its file; empty where it has none."""
    return str(key_schema(Case, key_path(parameter)).get("unit", ""))


def _hysteresis(columns: Columns) -> NDArray[Any] | None:
    """Where the motions on the way up and on the way down differ (1); None unless both were followed."""
    if columns.plan.passes != 2:
        return None
    regime, amplitude = columns["regime"], columns["amplitude"]
    decided = ((columns["status"] == _DONE) & (regime != b"undecided")).all(axis=0)
    larger = np.fmax(amplitude[0], amplitude[1])
    apart = np.nan_to_num(np.abs(amplitude[0] - amplitude[1])) > SAME_AMPLITUDE * np.nan_to_num(larger)
    lasting = (regime != b"damped").any(axis=0)
    return np.asarray(decided & ((regime[0] != regime[1]) | (apart & lasting)), dtype=np.int64)


def _sentences(columns: Columns, hysteresis: NDArray[Any] | None) -> list[str]:
    """What is to be said about motions that depend on where they come from."""
    plan, sentences = columns.plan, []
    if hysteresis is not None:
        count = int(hysteresis.sum())
        where = [_parameters(plan, int(index)) for index in np.flatnonzero(hysteresis.ravel())[:3]]
        places = "; ".join(", ".join(f"{key} = {label(value)}" for key, value in each.items()) for each in where)
        sentences.append(
            f"hysteresis at {count} of {hysteresis.size} points: {places}{' …' if count > 3 else ''}"
            if count
            else "no hysteresis: the motion is the same on the way up and on the way down"
        )
        if open_ := int(((columns["regime"] == b"undecided").any(axis=0)).sum()):
            sentences.append(
                f"hysteresis cannot be told at {open_} points, whose regime is undecided in a direction"
            )
    critical = plan.sweep.critical
    if critical is not None:
        sustained = columns["critical_sustained"]
        early = np.nan_to_num(columns["critical_lower"] - sustained, nan=0.0)
        late = np.nan_to_num(sustained - columns["critical_upper"], nan=0.0)
        if beside := int((early > critical.tolerance).sum()):
            sentences.append(
                f"hysteresis at {beside} of {early.size} points: from the case's own start vibration lasts at "
                f"values up to {early.max():.3g} below the one at which steady sliding loses its stability"
            )
        if after := int((late > critical.tolerance).sum()):
            sentences.append(
                f"at {after} of {late.size} points the case's own start leads into lasting vibration only at "
                f"values up to {late.max():.3g} above the critical one; longer runs may tell another"
            )
    return sentences


def _parameters(plan: Plan, index: int) -> dict[str, Any]:
    """What the axes set at a point, by its place in a variable of the result."""
    return {".".join(path): value for path, value in plan.settings(index % plan.points).items()}
