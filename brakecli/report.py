"""What a run or a check has found, as a table for people and as names and values for programs."""

import io
import math
import sys
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table

from brakecli.check import Check
from brakecli.run import RunReport

Rows = list[tuple[str, str]]

NARROWEST = 40
"""Columns of a table, whatever the terminal says: in fewer nothing can be read."""


def run_table(report: RunReport) -> str:
    """Summary of a run."""
    verdict, work, energy, times = report.verdict, report.work, report.energy, report.setup.timing
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
        ("settled part", f"from {verdict.settled_from * times.interval:.4g} s on"),
        ("scheme", f"{report.setup.case.solver.scheme} {_weights(report)}, {report.setup.case.solver.iteration}"),
        ("contact", shares + (f", {report.setup.nodes} nodes" if "midpoint" in work.evaluators else "")),
        ("steps", f"{work.steps} of {times.step:.4g} s, {work.contact_evaluations} contact evaluations"),
        ("energy account", f"closes to {abs(energy.relative_closing_error):.1e} of its largest item"),
        ("time of the loop", f"{work.solve_seconds:.3g} s"),
        ("file", str(report.output)),
    ]
    if report.failed:
        rows.insert(0, ("failed", str(report.failure_sentence)))
    return _table(report.title, rows)


def check_table(title: str, found: Check) -> str:
    """What a run would cost and which limits it meets."""
    low, high = found.natural_frequencies
    link_low, link_high = found.link_frequencies
    limits = found.limits
    rows: Rows = [
        ("surface speed U", _unit(found.belt_speed, "m/s")),
        ("contact stiffness 2ak", _unit(found.contact_stiffness, "N/m")),
        ("natural frequencies", f"{low:.5g} and {high:.5g} Hz in full contact"),
        ("without contact", f"{link_low:.5g} and {link_high:.5g} Hz"),
        ("shortest wave passes at", _unit(found.passing_frequency, "Hz")),
        ("step", f"{found.step:.6g} s, {found.steps} steps"),
        ("steps per period", f"{found.steps_per_period:.4g} of the fastest motion"),
        ("fixed-point contraction", f"{limits.contraction:.3g} (it may diverge from 1 on)"),
        ("solution of a step", "sure to be unique" if limits.unique else "not sure to be unique"),
        ("scheme", f"multiplies a frictionless disturbance by at most {limits.growth:.8g} a step"),
        ("contact", found.evaluator + (f", {found.nodes} nodes" if found.nodes else "")),
        ("nodes per shortest wave", _unit(found.nodes_per_wave, "")),
        ("time", f"about {found.seconds:.2g} s"),
        ("memory", f"about {found.memory / 1e6:.0f} MB"),
        ("file", f"about {found.file_size / 1e6:.2g} MB"),
        *(("adjusted", text) for text in found.adjustments),
    ]
    return _table(title, rows)


def check_numbers(found: Check) -> dict[str, Any]:
    """Names and values of a check, numbers that are infinite left out."""
    values = asdict(found)
    limits = values.pop("limits")
    return {name: value for name, value in {**values, **limits}.items() if not _infinite(value)}


def _infinite(value: object) -> bool:
    return isinstance(value, float) and math.isinf(value)


def _weights(report: RunReport) -> str:
    return "(" + ", ".join(f"{weight:.4g}" for weight in report.setup.case.solver.theta) + ")"


def _unit(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.6g} {unit}".rstrip()


def _table(title: str, rows: Rows) -> str:
    """Rows in two columns, as wide as the terminal."""
    table = Table(title=title or None, show_header=False, box=None, title_justify="left", padding=(0, 2, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, value)
    file, colours = io.StringIO(), sys.stdout.isatty() or None
    # Titles and file names are no markup.
    console = Console(file=file, force_terminal=colours, markup=False, emoji=False, highlight=False)
    console.width = max(console.width, NARROWEST)
    console.print(table)
    return "\n".join(line.rstrip() for line in file.getvalue().splitlines())
