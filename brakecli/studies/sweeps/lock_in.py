"""The lock-in diagram: both modes of steady sliding along a key of the case, and where stability changes."""

import csv
import io
from dataclasses import dataclass, replace
from functools import cache, reduce
from pathlib import Path
from typing import Any

import tomli_w

from brakecli.analysis.stability.certain import Rounded, conditions, links_with
from brakecli.analysis.stability.edges import middles
from brakecli.analysis.stability.follow import followed
from brakecli.analysis.stability.margin import changes
from brakecli.analysis.stability.report import stability
from brakecli.case.case import given_toml
from brakecli.case.read import LoadedCase
from brakecli.case.roughness import Records
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.results import stability_fields as fields
from brakecli.results.atomic import new_output
from brakecli.results.field import Field, labelled, values_of
from brakecli.results.fields import TEXT
from brakecli.results.write import new_result
from brakecli.solver.integrate import Counted
from brakecli.solver.steady_sliding import sliding
from brakecli.solver.system import System
from brakecli.studies.runs.run import origin
from brakecli.studies.sweeps.plan import Plan
from brakecli.studies.sweeps.result import unit
from brakecli.studies.sweeps.tables import Axis


@dataclass(frozen=True)
class LockIn:
    """Stability along an axis; an entry holds the names of `fields.VARIED` and `fields.MODES`."""

    axis: Axis
    entries: list[dict[str, Any]]
    critical_values: list[float]  # in the order of the axis

    @property
    def parameters(self) -> list[str]:
        """The keys that are varied."""
        return list(self.axis.parameter)


def lock_in(loaded: LoadedCase, axis: Axis, option: str, progress: Counted) -> LockIn:
    """Modes and critical friction at each value of an axis; messages call the axis `option`. Raises CaseError."""
    sweep = {"case": "-", "axis": [axis.model_dump(exclude_unset=True)]}
    plan = Plan(tomli_w.dumps(sweep), given_toml(loaded.case), Records(loaded.records))

    def system_at(value: float) -> System:
        settings = dict.fromkeys(plan.settings(0), value)
        try:
            return system_of(plan.case(settings))
        except CaseError as error:
            raise CaseError([replace(problem, source=option) for problem in error.problems]) from None

    values = [axis.value(index) for index in range(axis.size)]
    reports = []
    for value in (values[0], values[-1]):  # so that a wrong end is known before anything is computed
        system_at(value)
    for index, value in enumerate(values):
        progress("values", index, axis.size)
        reports.append(stability(system_at(value)))
    there = (report.modes if report.stable is not None and report.belt_speed else () for report in reports)
    entries = []
    for value, report, pair in zip(values, reports, followed(there), strict=True):
        names = ("frequency", "growth", "damping_ratio")
        columns = ([mode and getattr(mode, name) for mode in pair or (None, None)] for name in names)
        numbers = dict(zip((field.name for field in fields.MODES), columns, strict=True))
        entries.append({"value": value, **values_of(fields.VARIED, report), **numbers})
    critical = list[float]()
    moving = {value: report for value, report in zip(values, reports, strict=True) if report.belt_speed}

    case = plan.case(dict.fromkeys(plan.settings(0), values[0]))
    whole = isinstance(reduce(getattr, axis.parameter[0].split("."), case), int)

    @cache
    def signs_at(value: float) -> list[Rounded] | None:
        value = round(value) if whole else value
        if value not in moving:
            progress("critical values", len(critical), len(critical) + 1)
        system = system_at(value)
        equilibrium = moving[value].equilibrium if value in moving else sliding(system)
        return (
            None
            if equilibrium is None or not equilibrium.is_pressed(system.load_at_start)
            else conditions(
                links_with(system.coefficients), equilibrium.stiffness, system.coefficients.grip(system.belt_speed)
            )
        )

    inner = middles(case, list(axis.parameter), values[0], values[-1]) if moving else []
    for change in changes(signs_at, sorted({*moving, *inner})):
        rounding = 1e-12 * abs(values[-1] - values[0])
        critical.append(change.value if abs(change.value) > rounding else 0.0)
    if values[-1] < values[0]:
        critical.reverse()
    return LockIn(axis, entries, critical)


def write(path: Path, loaded: LoadedCase, diagram: LockIn, *, force: bool) -> None:
    """Write the diagram as HDF5, or as CSV where the name ends so; raises UsageError or CannotWriteError."""
    if path.suffix.lower() == ".csv":
        with new_output(path, force=force) as file:
            file.write(_csv(diagram).encode())
            file.publish()
        return
    axis = diagram.axis
    names = diagram.parameters
    with new_result(path, force=force) as result:
        result.set_attributes(origin("stability", loaded.case.title, loaded))
        result.set_fields(fields.LOCK_IN, values_of(fields.LOCK_IN, diagram))
        along = Field(axis.name, unit(names[0]), ", ".join(names))
        result.variable("/", along, (axis.name,), [entry["value"] for entry in diagram.entries], parameters=names)
        result.axis("/", fields.MODE, [1, 2])
        for field in (*fields.VARIED, *fields.MODES):
            dims, kind = ((axis.name, "mode"), "f8") if field in fields.MODES else ((axis.name,), field.kind)
            column = [entry[field.name] for entry in diagram.entries]
            data = [text or "" for text in column] if kind == TEXT else column
            result.column(replace(field, kind=kind), dims, data)
        result.commit()


def _csv(diagram: LockIn) -> str:
    """A line for each value; what does not exist is empty."""
    key = ", ".join(diagram.parameters)
    columns = {labelled(key, unit(diagram.parameters[0])): [entry["value"] for entry in diagram.entries]}
    for field in fields.VARIED:
        columns[labelled(field.name, field.units)] = [entry[field.name] for entry in diagram.entries]
    for field, mode in ((field, mode) for field in fields.MODES for mode in (1, 2)):
        values = [entry[field.name][mode - 1] for entry in diagram.entries]
        columns[labelled(f"{field.name} of mode {mode}", field.units)] = values
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([columns, *zip(*columns.values(), strict=True)])
    return stream.getvalue()
