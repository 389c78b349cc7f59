"""What a command has found, as a table for people and as names and values for programs."""

import io
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from brakecli.analysis.stability.modes import Crossing, Mode
from brakecli.analysis.stability.report import Discrete, StabilityReport
from brakecli.comparison.compare import Entry
from brakecli.comparison.methods import method_label
from brakecli.comparison.result import ComparisonReport
from brakecli.runs.limits import Check
from brakecli.runs.run import RunReport
from brakecli.solver.method import Method
from brakecli.solver.quantities import COEFFICIENTS
from brakecli.sweeps.cost import Estimate
from brakecli.sweeps.plan import label
from brakecli.sweeps.result import SweepReport

Rows = list[tuple[str, str]]

MOST_LISTED_POINTS = 30
NARROWEST = 40
"""Columns of a table, whatever the terminal says: in fewer nothing can be read."""


def run_table(report: RunReport) -> str:
    """Summary of a run."""
    verdict, system, work, energy = report.verdict, report.motion.system, report.motion.work, report.motion.energy
    shares = ", ".join(f"{kind} {count / max(work.steps, 1):.1%}" for kind, count in work.evaluators.items())
    rows: Rows = [
        (
            "regime",
            f"{verdict.regime} ({verdict.excitation})" if verdict.excitation != "none" else str(verdict.regime),
        ),
        ("because", "; ".join(verdict.reasons)),
        ("frequency", _unit(verdict.frequency, "Hz")),
        ("amplitude of x", _unit(verdict.amplitude, "m")),
        ("peak of the spectrum of vx", _unit(report.spectrum_peak, "Hz")),
        ("mean friction force", _unit(verdict.mean_friction_force, "N")),
        ("braking torque", _unit(report.braking_torque, "N m")),
        ("stick, lost contact", f"{verdict.stick_fraction:.2%}, {verdict.contact_loss_fraction:.2%} of the time"),
        ("settled part", f"from {report.settled_from:.4g} s on"),
        ("scheme", _scheme(system.method)),
        *([("tolerance", report.certificate.sentence())] if report.certificate is not None else []),
        ("contact", shares + (f", {system.nodes} nodes" if "midpoint" in work.evaluators else "")),
        ("modelled", "; ".join(report.modelled)),
        ("left out", "; ".join(report.left_out) or "nothing"),
        ("steps", f"{work.steps}{_step(report)}, {work.contact_evaluations} contact evaluations"),
        ("energy account", f"closes to {abs(energy.relative_closing_error):.1e} of its largest item"),
        ("time of the loop", f"{work.solve_seconds:.3g} s"),
        ("file", str(report.output)),
    ]
    if report.failed:
        rows.insert(0, ("failed", str(work.failure_sentence)))
    return _table(report.title, rows)


def check_table(title: str, found: Check) -> str:
    """What a run would cost and which limits it meets."""
    low, high = found.natural_frequencies
    link_low, link_high = found.link_frequencies
    rows: Rows = [
        *(
            (
                f"{quantity.symbol}, {quantity.long_name}",
                _unit(found.coefficients[name], quantity.units.removeprefix("1")),
            )
            for name, quantity in COEFFICIENTS.items()
        ),
        ("surface speed U", _unit(found.belt_speed, "m/s")),
        ("contact stiffness 2ak", _unit(found.contact_stiffness, "N/m")),
        ("natural frequencies", f"{low:.5g} and {high:.5g} Hz in full contact"),
        ("without contact", f"{link_low:.5g} and {link_high:.5g} Hz"),
        ("shortest wave passes at", _unit(found.passing_frequency, "Hz")),
        (
            "step",
            f"{found.step:.6g} s, {found.steps} steps" if found.step else f"its own, about {found.steps} steps",
        ),
        *(_step_rows(found) if found.step else ()),
        ("contact", found.evaluator + (f", {found.nodes} nodes" if found.nodes else "")),
        ("nodes per shortest wave", _unit(found.nodes_per_wave, "")),
        ("time", f"about {found.seconds:.2g} s"),
        ("memory", f"about {found.memory / 1e6:.0f} MB"),
        ("file", f"about {found.file_size / 1e6:.2g} MB"),
        *(("adjusted", text) for text in found.adjustments),
    ]
    return _table(title, rows)


def _step_rows(found: Check) -> Rows:
    """What the step of the case means for its scheme."""
    limits = found.limits
    return [
        ("steps per period", f"{found.steps_per_period:.4g} of the fastest motion"),
        ("fixed-point contraction", f"{limits.contraction:.3g} (it may diverge from 1 on)"),
        ("solution of a step", "sure to be unique" if limits.unique else "not sure to be unique"),
        ("scheme", f"multiplies a frictionless disturbance by at most {limits.growth:.8g} a step"),
    ]


def check_numbers(found: Check) -> dict[str, Any]:
    """Names and values of a check, numbers that are infinite left out."""
    values = asdict(found)
    limits = values.pop("limits")
    return {name: value for name, value in {**values, **limits}.items() if not _infinite(value)}


def verdict_table(source: str, numbers: dict[str, Any]) -> str:
    """A verdict, from the names and values that `--json` gives."""
    regime, excitation = numbers["regime"], numbers["excitation"]
    rows: Rows = [
        ("regime", regime if excitation == "none" else f"{regime} ({excitation})"),
        ("because", "; ".join(numbers["reasons"])),
        ("frequency", _unit(numbers["frequency"], "Hz")),
        ("amplitude of x", _unit(numbers["amplitude"], "m")),
        ("stick", _share(numbers["stick_fraction"])),
        ("lost contact", _share(numbers["contact_loss_fraction"])),
        *((name.replace("_", " "), _numbers(value)) for name, value in numbers["evidence"].items()),
    ]
    return _table(source, rows)


def stability_table(title: str, report: StabilityReport) -> str:
    """Steady sliding, its modes and its critical friction."""
    rest, critical = report.equilibrium, report.critical
    rows: Rows = [
        ("surface speed U", _unit(report.belt_speed, "m/s")),
        (
            "steady sliding",
            f"y = {rest.y:.5g} m, F_y = {rest.normal_force:.5g} N, {rest.contact_fraction:.1%} of the pad touches"
            if rest
            else f"none: {report.no_equilibrium}",
        ),
        ("contact stiffness K", _unit(report.contact_stiffness, "N/m")),
        ("critical friction", _crossing(critical) if critical else "none"),
        *(("also changes at", _crossing(crossing)) for crossing in report.crossings if crossing is not critical),
        ("without dashpots", _undamped(report)),
        (f"at φ = {report.friction:g}", {True: "stable", False: "unstable", None: "-"}[report.stable]),
        *((f"mode at {mode.frequency:.5g} Hz", _mode(mode)) for mode in report.modes),
    ]
    if report.discrete:
        rows += _discrete_rows(report.discrete)
    return _table(title, rows)


def vary_table(key: str, entries: list[dict[str, Any]]) -> str:
    """Critical friction along a parameter."""
    rows = [
        (
            f"{entry['value']:.6g}",
            _unit(entry["critical_friction"], ""),
            entry["instability"] or "-",
            _unit(entry["discrete_critical_friction"], ""),
        )
        for entry in entries
    ]
    return _grid((key, "critical friction", "instability", "as the scheme has it"), rows)


def sweep_table(report: SweepReport) -> str:
    """Summary of a sweep; of a small one every point."""
    found = report.findings
    rows: Rows = [
        ("points", f"{found.points}" + (f", {report.resumed} of them computed before" if report.resumed else "")),
        ("regimes", ", ".join(f"{name} {count}" for name, count in found.regimes.items())),
    ]
    if found.critical is not None and report.loaded.sweep.critical is not None:
        count, least, largest = found.critical
        span = f"{least:.6g} to {largest:.6g}, " if count else ""
        parameter = report.loaded.sweep.critical.parameter
        rows.append((f"critical {parameter}", f"{span}found at {count} of {found.points} points"))
    rows += [("note", sentence) for sentence in found.sentences]
    if found.failed:
        rows.append(("failed", f"{found.failed} points"))
    rows += [("time", f"{report.seconds:.3g} s"), ("file", str(report.output))]
    listed = _points_table(report) + "\n\n" if found.points <= MOST_LISTED_POINTS else ""
    return listed + _table(report.loaded.title, rows)


def _points_table(report: SweepReport) -> str:
    """A row for each point: its place on the axes, and what was found there."""
    found, plan = report.findings, report.loaded.plan
    values = found.variables or {}
    shown: dict[str, str] = {"regime": "regime", "frequency": "frequency, Hz", "amplitude": "amplitude, m"}
    if found.critical is not None:
        shown = {
            "regime": "regime",
            "critical": "critical",
            "critical_error": "±",
            "critical_eigenvalue": "by eigenvalues",
            "critical_sustained": "vibrates from",
            "critical_status": "search",
        }
    columns = [np.array(values[name], dtype=object).ravel() for name in shown]
    rows = []
    for index in range(found.points):
        places = plan.places(index % plan.points)
        place = [label(axis.value(at)) for axis, at in zip(plan.sweep.axis, places, strict=True)]
        way = [("up", "down")[index // plan.points]] if "direction" in found.dimensions else []
        cells = [_cell(column[index]) for column in columns]
        rows.append((*way, *place, *cells))
    names = ["way"] if "direction" in found.dimensions else []
    return _grid((*names, *(axis.parameter[0] for axis in plan.sweep.axis), *shown.values()), rows)


def _cell(value: object) -> str:
    return "-" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)


def comparison_table(report: ComparisonReport) -> str:
    """The entries that no other beats, the finest of each other method, and what is recommended."""
    found, best = report.comparison, report.recommended
    able = [entry for entry in found.entries if entry.errors is not None]
    failed = [entry for entry in found.entries if entry.work is not None and entry.errors is None]
    front = sorted((entry for entry in able if entry.on_front), key=lambda entry: entry.wall_seconds or 0.0)
    finest = {entry.rung.kind: entry for entry in able if not entry.on_front}
    headers = ("method", "step, s", "error", "order", "bias of φ", "evaluations", "time, ms")
    rows: Rows = [
        ("compared over", f"{found.duration:.6g} s of motion"),
        ("reference", f"event-driven, good to {found.reference_error:.1e}, {found.reference_seconds:.3g} s"),
        ("times", f"median of {found.repeats} turns, of the loop alone"),
    ]
    if found.left_out:
        rows.append(("left out", f"{found.left_out} entries, for want of time: give a larger --budget"))
    if failed:
        rows.append(("failed", f"{len(failed)} entries, such as {_name(failed[0])}: {failed[0].failure}"))
    if best is None or best.errors is None:
        rows.append(("recommended", f"none meets {report.target:g}"))
    else:
        error = best.errors.error
        margin = f"error {error:.2g}, {report.target / error:.3g} times below {report.target:g}"
        rows.append(("recommended", f"{_name(best)}: {margin}"))
        if (finer := found.finer_error(best)) > report.target:
            rows.append(("", f"by chance: at a finer step its error is {finer:.2g}; choose one with more margin"))
    rows.append(("file", str(report.output)))
    parts = [
        "No other is better in both error and time:\n" + _grid(headers, [_entry_row(entry) for entry in front]),
        "The finest of the others:\n" + _grid(headers, [_entry_row(entry) for entry in finest.values()]),
        _table(report.title, rows),
    ]
    return "\n\n".join(parts)


def _name(entry: Entry) -> str:
    rung = entry.rung
    return f"{method_label(rung.kind)}, " + (
        f"step {rung.step:.3g} s" if rung.step is not None else f"tolerance {rung.tolerance:g}"
    )


def _entry_row(entry: Entry) -> tuple[str, ...]:
    rung, work = entry.rung, entry.work
    bias = entry.critical_bias
    return (
        method_label(rung.kind),
        f"{rung.step:.3g}" if rung.step is not None else f"to {rung.tolerance:g}",
        f"{entry.errors.error:.2e}" if entry.errors is not None else "-",
        "-" if entry.order is None else f"{entry.order:.2f}",
        "-" if bias is None else f"{bias:.1e}",
        str(work.contact_evaluations if work else 0),
        "-" if entry.wall_seconds is None else f"{entry.wall_seconds * 1e3:.3g}",
    )


def estimate_table(title: str, found: Estimate) -> str:
    """What a sweep would cost."""
    rows: Rows = [
        ("points", str(found.points)),
        ("workers", str(found.workers)),
        ("time", f"about {found.seconds:.2g} s"),
        ("memory", f"about {found.memory / 1e6:.0f} MB"),
        ("file", f"about {found.file_size / 1e6:.2g} MB"),
    ]
    return _table(title, rows)


def _crossing(crossing: Crossing) -> str:
    change = "lost" if crossing.lost else "regained"
    return f"{crossing.friction:.7g}: stability {change} by {crossing.instability}" + (
        f" at {crossing.frequency:.5g} Hz" if crossing.frequency else ""
    )


def _undamped(report: StabilityReport) -> str:
    named = (("flutter", report.undamped_flutter), ("divergence", report.undamped_divergence))
    return (
        ", ".join(f"{name} at {phi:.7g}" for name, phi in named if phi is not None)
        or "neither flutter nor divergence"
    )


def _mode(mode: Mode) -> str:
    motion = f"grows at {mode.growth:.4g} 1/s" if mode.growth > 0.0 else f"decays at {-mode.growth:.4g} 1/s"
    shape = f", y/x {mode.shape:.3g} at {mode.shape_phase:.0f}°" if mode.shape is not None else ", along y alone"
    return f"{motion}, damping ratio {mode.damping_ratio:.3g}{shape}"


def _discrete_rows(discrete: Discrete) -> Rows:
    limit = "any" if discrete.step_limit is None else f"up to {discrete.step_limit:.4g} s"
    if discrete.critical_friction is None:
        critical = "none"
    else:
        bias = "" if discrete.bias is None else f", {discrete.bias:+.2g} off"
        critical = f"{discrete.critical_friction:.7g}{bias}"
    return [
        ("the scheme's growth", f"{discrete.growth:.5g} 1/s, a factor {discrete.spectral_radius:.8g} a step"),
        ("its critical friction", critical),
        ("its stable steps", "none" if discrete.step_limit == 0.0 else limit),
    ]


def _numbers(value: float | Sequence[float]) -> str:
    return f"{value:.6g}" if isinstance(value, float | int) else ", ".join(f"{item:.4g}" for item in value) or "-"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.2%} of the time"


def _infinite(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)


def _scheme(method: Method) -> str:
    if method.own_steps:
        return f"{method.scheme}, tolerance {method.tolerance:.4g}"
    weights = ", ".join(f"{weight:.4g}" for weight in method.theta)
    return f"{method.scheme} ({weights}), {method.iteration}"


def _step(report: RunReport) -> str:
    return "" if report.check.step is None else f" of {report.check.step:.4g} s"


def _unit(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.6g} {unit}".rstrip()


def _table(title: str, rows: Rows) -> str:
    """Rows in two columns, as wide as the terminal."""
    table = Table(title=title or None, show_header=False, box=None, title_justify="left", padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, value)
    return _drawn(table)


def _grid(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Rows under headers."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for header in headers:
        table.add_column(header, overflow="fold")
    for row in rows:
        table.add_row(*row)
    return _drawn(table)


def _drawn(table: Table) -> str:
    file, colours = io.StringIO(), sys.stdout.isatty() or None
    # Titles and file names are no markup.
    console = Console(file=file, force_terminal=colours, markup=False, emoji=False, highlight=False)
    console.width = max(console.width, NARROWEST)
    console.print(table)
    return "\n".join(line.rstrip() for line in file.getvalue().splitlines())
