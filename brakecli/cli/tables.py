"""What a command has found, as tables for people."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from brakecli.files import fields
from brakecli.files.field import Field, named
from brakecli.solver.quantities import COEFFICIENTS

if TYPE_CHECKING:  # what one command prints need not wait for the modules of the others
    from rich.table import Table

    from brakecli.analysis.stability.modes import Crossing, Mode
    from brakecli.analysis.stability.report import Discrete, StabilityReport
    from brakecli.comparison.compare import Entry
    from brakecli.comparison.result import ComparisonReport
    from brakecli.runs.limits import Check
    from brakecli.runs.run import RunReport
    from brakecli.solver.method import Method
    from brakecli.sweeps.cost import Estimate
    from brakecli.sweeps.result import SweepReport

MOST_LISTED_POINTS = 30
NARROWEST = 40
"""Columns of a table, whatever the terminal says: nothing can be read in fewer."""


class Row(NamedTuple):
    """A label with its value; a list gives a row for each of its texts, and none if it is empty."""

    label: str
    value: str | float | list[str] | tuple[str, ...] | None
    unit: str = ""
    form: str = ".6g"


class Column(NamedTuple):
    """The values of this name, under their header."""

    name: str
    header: str
    form: str = ".6g"


def _rows(known: Iterable[Field], numbers: Mapping[str, Any], *names: str) -> list[Row]:
    """A row for each of these fields, with the label and the unit that are declared."""
    return [
        Row(field.title, numbers[field.name], "of the time", ".2%")
        if field.units == "1"
        else Row(field.title, numbers[field.name], field.units)
        for field in named(known, *names)
    ]


def _columns(known: Iterable[Field], *names: str) -> tuple[Column, ...]:
    """A column for each of these fields, with the label and the unit that are declared."""
    return tuple(
        Column(field.name, f"{field.title}, {field.units}" if field.units not in ("", "1") else field.title, ".5g")
        for field in named(known, *names)
    )


ALONG_A_KEY = (
    Column("critical_friction", "critical friction"),
    Column("instability", "instability"),
    Column("discrete_critical_friction", "as the scheme has it"),
)
POINTS = _columns(fields.POINT, "regime", "frequency", "amplitude")
CRITICAL_POINTS = (
    *_columns(fields.POINT, "regime"),
    *_columns(fields.CRITICAL, "critical", "critical_error", "critical_eigenvalue", "critical_sustained"),
    *_columns(fields.CRITICAL, "critical_status"),
)
ENTRIES = (
    Column("method", "method"),
    Column("step", "step, s", ".3g"),
    Column("error", "error", ".2e"),
    Column("observed_order", "order", ".2f"),
    Column("critical_bias", "bias of φ", ".1e"),
    Column("contact_evaluations", "evaluations", "d"),
    Column("milliseconds", "time, ms", ".3g"),
)


def run_table(report: RunReport) -> str:
    """Summary of a run."""
    numbers, system, work = report.numbers(), report.motion.system, report.motion.work
    shares = ", ".join(f"{kind} {count / max(work.steps, 1):.1%}" for kind, count in work.evaluators.items())
    nodes = f", {system.nodes} nodes" if "midpoint" in work.evaluators else ""
    step = "" if report.check.step is None else f" of {report.check.step:.4g} s"
    energy = numbers["energy"]
    rows = [
        Row("failed", [numbers["failure"]] if report.failed else []),
        *_verdict_rows(numbers),
        *_rows(fields.RUN, numbers, "spectrum_peak", "mean_friction_force", "braking_torque"),
        Row("settled part", f"from {numbers['settled_from']:.4g} s on"),
        Row("scheme", _scheme(system.method)),
        Row("tolerance", [report.certificate.sentence()] if report.certificate else []),
        Row("contact", shares + nodes),
        Row("modelled", "; ".join(numbers["modelled"])),
        Row("left out", "; ".join(numbers["left_out"]) or "nothing"),
        Row("steps", f"{work.steps}{step}, {work.contact_evaluations} contact evaluations"),
        Row("energy account", f"closes to {abs(energy['relative_closing_error']):.1e} of its largest item"),
        Row("time of the loop", work.solve_seconds, "s", ".3g"),
        Row("file", str(report.output)),
    ]
    return _table(report.title, rows)


def _scheme(method: Method) -> str:
    if method.own_steps:
        return f"{method.scheme}, tolerance {method.tolerance:.4g}"
    return f"{method.scheme} ({', '.join(f'{weight:.4g}' for weight in method.theta)}), {method.iteration}"


def verdict_table(source: str, numbers: Mapping[str, Any]) -> str:
    """A verdict, from the names and values that `--json` gives."""
    rows = _verdict_rows(numbers)
    for name, value in numbers["evidence"].items():
        shown = ", ".join(f"{item:.4g}" for item in value) or None if isinstance(value, list | tuple) else value
        rows.append(Row(name.replace("_", " "), shown))
    return _table(source, rows)


def _verdict_rows(numbers: Mapping[str, Any]) -> list[Row]:
    regime, excitation = numbers["regime"], numbers["excitation"]
    return [
        Row("regime", regime if excitation == "none" else f"{regime} ({excitation})"),
        Row("because", "; ".join(numbers["reasons"])),
        *_rows(fields.VERDICT, numbers, "frequency", "amplitude", "stick_fraction", "contact_loss_fraction"),
    ]


def check_table(title: str, found: Check) -> str:
    """What a run would cost and which limits it meets."""
    low, high = found.natural_frequencies
    link_low, link_high = found.link_frequencies
    limits, has_step = found.limits, found.step is not None
    growth = f"multiplies a frictionless disturbance by at most {limits.growth:.8g} a step"
    rows = [
        *(
            Row(f"{each.symbol}, {each.long_name}", found.coefficients[name], each.units.removeprefix("1"))
            for name, each in COEFFICIENTS.items()
        ),
        Row("surface speed U", found.belt_speed, "m/s"),
        Row("contact stiffness 2ak", found.contact_stiffness, "N/m"),
        Row("natural frequencies", f"{low:.5g} and {high:.5g} Hz in full contact"),
        Row("without contact", f"{link_low:.5g} and {link_high:.5g} Hz"),
        Row("shortest wave passes at", found.passing_frequency, "Hz"),
        Row("step", (f"{found.step:.6g} s, " if has_step else "its own, about ") + f"{found.steps} steps"),
        Row("steps per period", [f"{found.steps_per_period:.4g} of the fastest motion"] * has_step),
        Row("fixed-point contraction", [f"{limits.contraction:.3g} (it may diverge from 1 on)"] * has_step),
        Row("solution of a step", [f"{'' if limits.unique else 'not '}sure to be unique"] * has_step),
        Row("scheme", [growth] * has_step),
        Row("contact", found.evaluator + (f", {found.nodes} nodes" if found.nodes else "")),
        Row("nodes per shortest wave", found.nodes_per_wave),
        *_cost_rows(found),
        Row("adjusted", found.adjustments),
    ]
    return _table(title, rows)


def estimate_table(title: str, found: Estimate) -> str:
    """What a sweep would cost."""
    rows = [Row("points", str(found.points)), Row("workers", str(found.workers)), *_cost_rows(found)]
    return _table(title, rows)


def _cost_rows(found: Check | Estimate) -> list[Row]:
    return [
        Row("time", f"about {found.seconds:.2g} s"),
        Row("memory", f"about {found.memory / 1e6:.0f} MB"),
        Row("file", f"about {found.file_size / 1e6:.2g} MB"),
    ]


def stability_table(title: str, report: StabilityReport, key: str, entries: Sequence[Mapping[str, Any]]) -> str:
    """Steady sliding, its modes and its critical friction; below that the critical friction along a key."""
    rest, critical = report.equilibrium, report.critical
    undamped = {"flutter": report.undamped_flutter, "divergence": report.undamped_divergence}
    known = [f"{kind} at {friction:.7g}" for kind, friction in undamped.items() if friction is not None]
    rows = [
        Row("surface speed U", report.belt_speed, "m/s"),
        Row(
            "steady sliding",
            f"y = {rest.y:.5g} m, F_y = {rest.normal_force:.5g} N, {rest.contact_fraction:.1%} of the pad touches"
            if rest
            else f"none: {report.no_equilibrium}",
        ),
        Row("contact stiffness K", report.contact_stiffness, "N/m"),
        Row("critical friction", _crossing(critical) if critical else "none"),
        Row("also changes at", [_crossing(each) for each in report.crossings if each is not critical]),
        Row("without dashpots", ", ".join(known) or "neither flutter nor divergence"),
        Row(f"at φ = {report.friction:g}", {True: "stable", False: "unstable", None: None}[report.stable]),
        *(Row(f"mode at {mode.frequency:.5g} Hz", _mode(mode)) for mode in report.modes),
        *(_discrete_rows(report.discrete) if report.discrete else ()),
    ]
    along = "\n\n" + _grid((Column("value", key), *ALONG_A_KEY), entries) if key else ""
    return _table(title, rows) + along


def _crossing(crossing: Crossing) -> str:
    change = "lost" if crossing.lost else "regained"
    where = f" at {crossing.frequency:.5g} Hz" if crossing.frequency else ""
    return f"{crossing.friction:.7g}: stability {change} by {crossing.instability}{where}"


def _mode(mode: Mode) -> str:
    motion = f"grows at {mode.growth:.4g} 1/s" if mode.growth > 0.0 else f"decays at {-mode.growth:.4g} 1/s"
    shape = f"y/x {mode.shape:.3g} at {mode.shape_phase:.0f}°" if mode.shape is not None else "along y alone"
    return f"{motion}, damping ratio {mode.damping_ratio:.3g}, {shape}"


def _discrete_rows(discrete: Discrete) -> list[Row]:
    limit, critical = discrete.step_limit, discrete.critical_friction
    bias = "" if discrete.bias is None else f", {discrete.bias:+.2g} off"
    steps = "any" if limit is None else "none" if limit == 0.0 else f"up to {limit:.4g} s"
    return [
        Row("the scheme's growth", f"{discrete.growth:.5g} 1/s, a factor {discrete.spectral_radius:.8g} a step"),
        Row("its critical friction", "none" if critical is None else f"{critical:.7g}{bias}"),
        Row("its stable steps", steps),
    ]


def sweep_table(report: SweepReport) -> str:
    """Summary of a sweep, and every point of a small one."""
    found, critical = report.findings, report.loaded.sweep.critical
    rows = [
        Row("points", f"{found.points}" + (f", {report.resumed} of them computed before" * (report.resumed > 0))),
        Row("regimes", ", ".join(f"{name} {count}" for name, count in found.regimes.items())),
    ]
    if found.critical is not None and critical is not None:
        count, least, largest = found.critical
        span = f"{least:.6g} to {largest:.6g}, " if count else ""
        rows.append(Row(f"critical {critical.parameter}", f"{span}found at {count} of {found.points} points"))
    rows += [
        Row("note", found.sentences),
        Row("failed", [f"{found.failed} points"] if found.failed else []),
        Row("time", report.seconds, "s", ".3g"),
        Row("file", str(report.output)),
    ]
    listed = _points_table(report) + "\n\n" if found.points <= MOST_LISTED_POINTS else ""
    return listed + _table(report.loaded.title, rows)


def _points_table(report: SweepReport) -> str:
    """A row for each point: its place on the axes, and what was found there."""
    found, plan = report.findings, report.loaded.plan
    from brakecli.sweeps.plan import label

    known = POINTS if found.critical is None else CRITICAL_POINTS
    columns = [*(Column(axis.name, axis.parameter[0]) for axis in plan.sweep.axis), *known]
    if "direction" in found.dimensions:
        columns.insert(0, Column("direction", "way"))
    variables = {each.name: np.ravel(np.array((found.variables or {})[each.name], object)) for each in known}
    records = []
    for point in range(found.points):
        record = {name: values[point] for name, values in variables.items()}
        record["direction"] = ("up", "down")[point // plan.points]
        for axis, place in zip(plan.sweep.axis, plan.places(point % plan.points), strict=True):
            record[axis.name] = label(axis.value(place))
        records.append(record)
    return _grid(columns, records)


def comparison_table(report: ComparisonReport) -> str:
    """The entries that no other beats, the finest of each other method, and what is recommended."""
    found, best = report.comparison, report.recommended
    able = [entry for entry in found.entries if entry.errors is not None]
    failed = [entry for entry in found.entries if entry.work is not None and entry.errors is None]
    front = sorted((entry for entry in able if entry.on_front), key=lambda entry: entry.wall_seconds or 0.0)
    finest = {entry.rung.kind: entry for entry in able if not entry.on_front}
    rows = [
        Row("compared over", f"{found.duration:.6g} s of motion"),
        Row("reference", f"event-driven, good to {found.reference_error:.1e}, {found.reference_seconds:.3g} s"),
        Row("times", f"median of {found.repeats} turns, of the loop alone"),
    ]
    if found.left_out:
        rows.append(Row("left out", f"{found.left_out} entries, for want of time: give a larger --budget"))
    if failed:
        rows.append(Row("failed", f"{len(failed)} entries, such as {_name(failed[0])}: {failed[0].failure}"))
    if best is None or best.errors is None:
        rows.append(Row("recommended", f"none meets {report.target:g}"))
    else:
        error = best.errors.error
        margin = f"error {error:.2g}, {report.target / error:.3g} times below {report.target:g}"
        rows.append(Row("recommended", f"{_name(best)}: {margin}"))
        if (finer := found.finer_error(best)) > report.target:
            rows.append(
                Row("", f"by chance: at a finer step its error is {finer:.2g}; choose one with more margin")
            )
    rows.append(Row("file", str(report.output)))
    parts = [
        "No other is better in both error and time:\n" + _entries_table(front),
        "The finest of the others:\n" + _entries_table(finest.values()),
        _table(report.title, rows),
    ]
    return "\n\n".join(parts)


def _name(entry: Entry) -> str:
    from brakecli.comparison.methods import method_label

    rung = entry.rung
    return f"{method_label(rung.kind)}, " + (
        f"step {rung.step:.3g} s" if rung.step is not None else f"tolerance {rung.tolerance:g}"
    )


def _entries_table(entries: Iterable[Entry]) -> str:
    from brakecli.comparison.result import entry_numbers

    records = [entry_numbers(entry) for entry in entries]
    for record in records:
        record["milliseconds"] = 1e3 * record["wall_seconds"]
        record["step"] = record["step"] or f"to {record['tolerance']:g}"
    return _grid(ENTRIES, records)


def _table(title: str, rows: Sequence[Row]) -> str:
    """Rows in two columns, as wide as the terminal."""
    from rich.table import Table

    table = Table(title=title or None, show_header=False, box=None, title_justify="left", padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for row in rows:
        for value in row.value if isinstance(row.value, list | tuple) else [row.value]:
            table.add_row(row.label, _text(value, row.form, row.unit))
    return _drawn(table)


def _grid(columns: Sequence[Column], records: Iterable[Mapping[str, Any]]) -> str:
    """A line for each record, under headers."""
    from rich.table import Table

    table = Table(box=None, padding=(0, 2, 0, 0))
    for column in columns:
        table.add_column(column.header, overflow="fold")
    for record in records:
        table.add_row(*(_text(record[column.name], column.form) for column in columns))
    return _drawn(table)


def _text(value: str | float | None, form: str, unit: str = "") -> str:
    """A value with its unit; a dash stands for what does not exist."""
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:{form}} {unit}".rstrip()


def _drawn(table: Table) -> str:
    from rich.console import Console

    file, colours = io.StringIO(), sys.stdout.isatty() or None
    # Titles and file names are not markup.
    console = Console(file=file, force_terminal=colours, markup=False, emoji=False, highlight=False)
    console.width = max(console.width, NARROWEST)
    console.print(table)
    return "\n".join(line.rstrip() for line in file.getvalue().splitlines())
