"""Views of many runs: of a sweep, and of a comparison of schemes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.analysis.regime.decision import Regime
from brakecli.faces import argument
from brakecli.results import fields
from brakecli.results.field import Field, named, values_of
from brakecli.views.render import Renderer, text_of
from brakecli.views.view import SHORT_POINTS, Row, Table, View, details, sentences

if TYPE_CHECKING:
    from brakecli.studies.sweeps.attractors import Attractor
    from brakecli.studies.sweeps.result import SweepReport

POINTS = named(fields.POINT, "regime", "frequency", "amplitude")
CRITICAL = (*named(fields.POINT, "regime"), *named(fields.CRITICAL, "critical", "critical_error"))
SEARCHES = named(fields.CRITICAL, "critical_eigenvalue", "critical_sustained", "critical_status")
"""What a search says beside its value, shown where it says something else."""
MOST_LISTED_POINTS = 200
ENTRIES = (
    ("method", "method", ""),
    ("step", "step, s", ".3g"),
    ("error", "error", ".2e"),
    ("observed_order", "order", ".2f"),
    ("critical_bias", "bias of φ", ".1e"),
    ("contact_evaluations", "evaluations", "d"),
    ("milliseconds", "time, ms", ".3g"),
)
"""Of the methods that are compared: name of the numbers, header, format."""


def of_sweep(report: SweepReport, show: Renderer) -> View:
    """What the points of a sweep come to, where that changes, and every point of a small one."""
    findings = report.findings
    blocks: list[Row | Table] = []
    if findings.points <= MOST_LISTED_POINTS:
        blocks.append(_points(report, show))
    if findings.attractors:
        blocks.append(_attractors(findings.attractors))
    blocks += _stretches(report)
    blocks += [Row("note", note) for note in findings.sentences]
    if findings.failed:
        blocks.append(Row("failed", f"{findings.failed} points"))
    speed = report.points_per_second
    cost = f": {speed:.3g} points/s, {report.overhead:.0%} of the time not on points" if speed else ""
    resumed = f", {report.resumed} of them computed before" if report.resumed else ""
    hidden = f"; listed with {argument('details')}" * (SHORT_POINTS < findings.points <= MOST_LISTED_POINTS)
    blocks.append(Row("points", f"{findings.points}{resumed}{hidden}"))
    blocks += details(Row("time", text_of(report.seconds, "s", ".3g") + cost))
    blocks.append(Row("file", str(report.output)))
    return View(report.loaded.title, sentences(_answer(report, show)), blocks)


def regimes_sentence(regimes: Mapping[str, int], size: int) -> str:
    """At how many points it vibrates, and the regimes of all."""
    lasting = sum(regimes.get(regime, 0) for regime in (Regime.RELAXATION, Regime.QUASI_HARMONIC))
    counts = ", ".join(f"{name} at {count}" for name, count in regimes.items() if name)
    return f"it vibrates at {lasting} of {size} points: {counts}"


def _answer(report: SweepReport, show: Renderer) -> list[str]:
    """What the points say as a whole."""
    findings = report.findings
    sought = report.loaded.sweep.critical
    if sought is None or findings.critical is None:
        return [regimes_sentence(findings.regimes, findings.points)]
    if findings.points == 1 and (said := [*filter(None, (findings.variables or {})["critical_sentence"])]):
        return [str(said[0])]
    count, least, largest = findings.critical
    span = ""
    if count > 1:
        span = f", from {show.text(least)}{_where(report, least)} to {show.text(largest)}{_where(report, largest)}"
    elif count:
        span = f": {show.text(least)}{_where(report, least)}"
    return [
        f"a critical {sought.parameter} is found at {count} of {findings.points} points{span}",
        *_beside(report, show),
    ]


def _beside(report: SweepReport, show: Renderer) -> list[str]:
    """Where a vibration can exist beside stable sliding, by a search at several points."""
    variables = report.findings.variables
    if variables is None:
        return []
    values = np.ravel(np.array(variables["coexists_from"], float))
    values = values[np.isfinite(values)]
    if not values.size:
        return []
    where = f"at {values.size} of {report.findings.points} points, the least value is {show.text(values.min())}"
    return [f"beside stable sliding a vibration can exist {where}"]


def _where(report: SweepReport, critical: float) -> str:
    """The first point that has a critical value, in words; empty where the points are too many."""
    from brakecli.studies.sweeps.plan import label

    variables = report.findings.variables
    plan = report.loaded.plan
    if variables is None:
        return ""
    values = np.ravel(np.array(variables["critical"], float))
    settings = plan.settings(int(np.flatnonzero(values == critical)[0]) % plan.points)
    where = ", ".join(f"{'.'.join(path)} = {label(value)}" for path, value in settings.items())
    return f" at {where}" if where else ""


def _stretches(report: SweepReport) -> list[Row]:
    """Along a single axis: up to six stretches of equal regimes, where the points are too many to be listed."""
    from brakecli.studies.sweeps.plan import label

    findings = report.findings
    axes = report.loaded.plan.sweep.axis
    both_ways = "direction" in findings.dimensions  # of which hysteresis is said
    if (
        len(axes) != 1
        or both_ways
        or findings.variables is None
        or findings.critical is not None
        or findings.points <= SHORT_POINTS
    ):
        return []
    regimes = np.ravel(np.array(findings.variables["regime"], object)).tolist()
    values = [label(axes[0].value(index)) for index in range(axes[0].size)]
    parts = []
    for regime, stretch in groupby(zip(regimes, values, strict=True), key=itemgetter(0)):
        ends = [value for _, value in stretch]
        span = dict.fromkeys([ends[0], ends[-1]])
        parts.append(f"{regime or 'failed'} {'at' if len(span) == 1 else 'from'} {' to '.join(span)}")
    return [Row(axes[0].parameter[0], ", ".join(parts))] if len(parts) <= 6 else []


def _points(report: SweepReport, show: Renderer) -> Table:
    """A row for each point: its place on the axes, and what was found there."""
    from brakecli.studies.sweeps.plan import label

    findings = report.findings
    plan = report.loaded.plan
    variables = findings.variables or {}
    positions = [plan.places(point % plan.points) for point in range(findings.points)]
    columns: dict[str, list[str]] = {}
    if "direction" in findings.dimensions:
        columns["way"] = [("up", "down")[point // plan.points] for point in range(findings.points)]
    for number, axis in enumerate(plan.sweep.axis):
        columns[axis.parameter[0]] = [label(axis.value(position[number])) for position in positions]
    if plan.listed is not None:
        for key, column in zip(plan.listed.keys, plan.listed.columns, strict=True):
            columns[key] = [label(value) for value in column]
    keys = len(columns)
    columns_shown = POINTS
    if findings.critical is not None:
        columns_shown = (*CRITICAL, *(field for field in SEARCHES if _says_more(field, variables)))
    if findings.attractors is not None:
        columns_shown += fields.STARTS
    for field in columns_shown:
        values = np.ravel(np.array(variables[field.name], object))
        header = f"{field.title}, {field.units}" if field.units.strip("1") else field.title
        is_error = field.title == "±"
        columns[header] = [text_of(value, form=".2g") if is_error else show.text(value) for value in values]
    return Table(columns, keys=max(keys, 1), first=None if findings.points <= SHORT_POINTS else 0)


def _says_more(field: Field, variables: Mapping[str, object]) -> bool:
    """Whether a number of a search differs from the critical value by more than that one's error."""
    values = np.ravel(np.array(variables[field.name], object))
    if field.name == "critical_status":
        return bool((values != "found").any())
    critical, error = (np.ravel(np.array(variables[name], float)) for name in ("critical", "critical_error"))
    other = values.astype(float)
    differs = np.abs(other - critical) > np.maximum(np.nan_to_num(error), 1e-4 * np.abs(critical))
    return bool((differs | (np.isnan(other) != np.isnan(critical))).any())


def _attractors(attractors: Iterable[Attractor]) -> Table:
    """What the points of a sweep over initial states come to."""
    rows = [values_of(fields.ATTRACTOR, row) for row in attractors]
    columns = {
        "attractor": [str(row["attractor"]) for row in rows],
        "regime": [row["regime"] for row in rows],
        "Hz": [text_of(row["frequency"], form=".4g") for row in rows],
        "amplitude of x, m": [text_of(row["amplitude"], form=".4g") for row in rows],
        "share": [f"{row['share']:.1%}" for row in rows],
        "95 % interval": [f"{row['share_lower']:.1%} to {row['share_upper']:.1%}" for row in rows],
    }
    return Table(columns)


def of_comparison(numbers: Mapping[str, Any], keys: Mapping[str, object], title: str) -> View:
    """What is recommended, the entries that no other beats, and on demand the finest of each other method.

    `numbers` are those of `--json`; `keys` of a case ask for the recommended method.
    """
    best = numbers["recommended"]
    target = numbers["target_error"]
    able = [entry for entry in numbers["entries"] if entry["error"] is not None]
    front = sorted((entry for entry in able if entry["on_front"]), key=lambda entry: entry["wall_seconds"] or 0.0)
    finest = {_method(entry): entry for entry in able if not entry["on_front"]}
    failed = [entry for entry in numbers["entries"] if entry["steps"] and entry["error"] is None]
    answer = [f"no method meets the wanted error of {target:g}"]
    if best is not None:
        said = f"recommended is {_entry(best)}"
        answer = [f"{said}: its error is {best['error']:.2g}, and {target:g} is the target"]
        if (finer := finer_error(able, best)) > target:
            chance = f"this is by chance: at a finer step its error is {finer:.2g}"
            answer.append(f"{chance}; choose a method with more margin")
    blocks: list[Row | Table] = []
    if keys:
        blocks.append(Row("in a case", ", ".join(f"{key} = {json.dumps(value)}" for key, value in keys.items())))
    such = [f"{len(failed)} entries, such as {_entry(entry)}: {entry['failure']}" for entry in failed[:1]]
    blocks += [Row("failed", text) for text in such]
    if skipped := numbers["left_out"]:
        blocks.append(Row("left out", f"{skipped} entries, because the time was used up; give a larger --budget"))
    if numbers.get("output"):
        blocks.append(Row("file", numbers["output"]))
    repeats = numbers["repeats"]
    times = f"median of {repeats} repetitions," if repeats > 1 else "measured once,"
    reference = f"error below {numbers['reference_error']:.1e}"
    if (seconds := numbers["reference_seconds"]) is not None:
        reference += f", {seconds:.3g} s"
    blocks += details(
        Row("compared over", f"{numbers['duration']:.6g} s of motion"),
        Row("reference", f"event-driven, {reference}"),
        Row("times", f"{times} of the time loop alone"),
    )
    blocks.append(Table(_entries(front), "No other has a smaller error in less time"))
    blocks.append(Table(_entries(finest.values()), "The finest of the others", first=0))
    return View(title, sentences(answer), blocks)


def finer_error(entries: Iterable[Mapping[str, Any]], entry: Mapping[str, Any]) -> float:
    """The largest error of the same method at finer steps; above the entry's own, that is low by chance."""
    step = entry["step"] or 0.0
    alike = [other for other in entries if _method(other) == _method(entry)]
    errors = [other["error"] for other in alike if (other["step"] or step) < step]
    return max((error for error in errors if error is not None), default=0.0)


def _method(entry: Mapping[str, object]) -> tuple[str, ...]:
    """What distinguishes a method from others, whatever its step."""
    return tuple(str(entry[name]) for name in ("scheme", "theta", "start", "iteration", "evaluator", "nodes"))


def _entry(entry: Mapping[str, object]) -> str:
    """The method with its step or tolerance."""
    if entry["step"] is not None:
        return f"{entry['method']}, step {entry['step']:.3g} s"
    return f"{entry['method']}, tolerance {entry['tolerance']:g}" if entry["tolerance"] else str(entry["method"])


def _entries(records: Iterable[Mapping[str, Any]]) -> dict[str, Sequence[str]]:
    rows = []
    for record in records:
        rung = f"to {record['tolerance']:g}" if record["tolerance"] else "exact"
        milliseconds = 1e3 * (record["wall_seconds"] or 0.0)
        rows.append({**record, "step": record["step"] or rung, "milliseconds": milliseconds})
    return {header: [text_of(row[name], form=form) for row in rows] for name, header, form in ENTRIES}
