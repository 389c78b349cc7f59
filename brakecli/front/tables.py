"""What a command has found, as tables for people."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from brakecli.analysis.regime.decision import Thresholds
from brakecli.errors import escaped
from brakecli.files import fields
from brakecli.files.field import Field, named, values_of
from brakecli.front.render import TERMINAL, text_of
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.quantities import COEFFICIENTS

if TYPE_CHECKING:  # what one command prints need not wait for the modules of the others
    from brakecli.comparison.result import ComparisonReport
    from brakecli.runs.limits import Check
    from brakecli.runs.run import RunReport
    from brakecli.sweeps.attractors import Attractor
    from brakecli.sweeps.cost import Estimate
    from brakecli.sweeps.result import SweepReport

POINTS = named(fields.POINT, "regime", "frequency", "amplitude")
CRITICAL_NAMES = ("critical", "critical_error", "critical_eigenvalue", "critical_sustained", "critical_status")
CRITICAL_POINTS = (*named(fields.POINT, "regime"), *named(fields.CRITICAL, *CRITICAL_NAMES))
IF_KNOWN = (
    "amplitude_first",
    "forced_frequency",
    "growth_rate",
    "ringing_frequency",
    "amplitude_spread",
    "amplitude_forced",
    "amplitude_own",
)
MOST_LISTED_POINTS = 30
MOST_LISTED_BURSTS = 12
NARROWEST = 40  # columns of a table, whatever the terminal says: nothing can be read in fewer

Row = tuple[str, str | Sequence[str]]
"""A label with its text; a list gives a row for each of its texts, and none if it is empty."""

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


def run_table(report: RunReport) -> str:
    """Summary of a run."""
    numbers = report.numbers()
    work = report.motion.work
    method = report.motion.system.method
    weights = ", ".join(f"{weight:.4g}" for weight in method.theta)
    kept = "" if method.row.exact else f", tolerance {method.tolerance:.4g}"
    how = kept if method.own_steps else f" ({weights}), {method.iteration}"
    shares = ", ".join(f"{kind} {count / max(work.steps, 1):.1%}" for kind, count in work.evaluators.items())
    on_nodes = any(EVALUATORS[kind].needs_nodes for kind in work.evaluators)
    nodes = f", {numbers['nodes']} nodes" if on_nodes else ""
    step = "" if report.check.step is None else f" of {numbers['step']:.4g} s"
    error = abs(numbers["energy"]["relative_closing_error"])
    peak = text_of(numbers["spectrum_peak"]) if numbers["spectrum_peak"] is not None else ""
    since = f"from {numbers['settled_from']:.4g} s on"
    resolution = numbers["frequency_resolution"]
    rows = [
        ("failed", [numbers["failure"]] if work.failed else []),
        *_verdict_rows(numbers),
        ("peak of the spectrum of vx", f"{peak} ± {resolution:.2g} Hz" if peak else "not resolved"),
        *_rows(fields.RUN, numbers, "mean_friction_force", "braking_torque", "torque_variation"),
        ("disturbances", disturbances(numbers)),
        ("settled part", f"{'' if numbers['settled'] else 'none; the numbers are those '}{since}"),
        ("scheme", method.scheme + how),
        ("tolerance", [report.certificate.sentence()] if report.certificate else []),
        ("contact", shares + nodes),
        ("modelled", "; ".join(numbers["modelled"])),
        ("left out", "; ".join(numbers["left_out"]) or "nothing"),
        ("steps", f"{work.steps}{step}, {work.contact_evaluations} contact evaluations"),
        ("energy account", f"closes to {error:.1e} of its largest item"),
        ("time of the loop", text_of(work.solve_seconds, "s", ".3g")),
        ("file", str(report.output)),
    ]
    return two_columns(report.title, rows)


def disturbances(numbers: Mapping[str, Any]) -> list[str]:
    """Whether neighbours of a motion come to it, where that was asked."""
    rate = numbers.get("lyapunov_exponent")
    error = numbers.get("lyapunov_error")
    if rate is None or error is None:
        return []
    what = "fade" if rate < 0.0 else "grow"
    known = "" if abs(rate) > Thresholds.sure_errors * error else ", which is not told from 0"
    return [f"small ones {what} at {abs(rate):.3g} ± {error:.2g} 1/s{known}"]


def verdict_table(source: str, numbers: Mapping[str, Any]) -> str:
    """A verdict, from the names and values that `--json` gives."""
    rows = [*_verdict_rows(numbers), ("disturbances", disturbances(numbers))]
    quantity = numbers.get("quantity", "")
    si_unit = fields.MEASURED_UNITS.get(quantity, "")
    noise_unit = "m/s" if quantity == "acceleration" else si_unit  # an acceleration is judged by its integral
    tones = numbers.get("bursts", ())
    for tone in tones[:MOST_LISTED_BURSTS]:
        when = f"{tone['start']:.4g} to {tone['end']:.4g} s"
        level = f"{tone['level']:.3g} {si_unit}"
        rows.append(("burst", f"{when}: {tone['frequency']:.6g} Hz, {level}"))
    if len(tones) > MOST_LISTED_BURSTS:
        rows.append(("bursts", f"{len(tones) - MOST_LISTED_BURSTS} more, see --json"))
    for name, value in numbers["evidence"].items():
        unit = noise_unit if name == "noise" else fields.evidence_unit(name)
        rows.append((name.replace("_", " "), TERMINAL.text(value, unit)))
    return two_columns(source, rows)


def verdicts_table(results: Sequence[Mapping[str, Any]]) -> str:
    """The verdicts on several files, one in a row."""
    because = [each.get("error") or "; ".join(each["reasons"]) for each in results]
    regimes = [each.get("regime", "unreadable") for each in results]
    names = [each["source"] for each in results]
    tones = [*map(_tone, results)]
    return grid({"file": names, "regime": regimes, "Hz": tones, "because": because})


def _verdict_rows(numbers: Mapping[str, Any]) -> list[Row]:
    source = f" ({numbers['excitation']})" if numbers["excitation"] != "none" else ""
    return [
        ("regime", numbers["regime"] + source),
        ("because", "; ".join(numbers["reasons"])),
        ("frequency", _tone(numbers, "Hz")),
        *_rows(fields.VERDICT, numbers, "amplitude", "stick_fraction", "contact_loss_fraction"),
        *_rows(fields.VERDICT, numbers, *(name for name in IF_KNOWN if numbers.get(name) is not None)),
        ("vibrates", [_interval(each) for each in numbers.get("vibrations") or ()]),
    ]


def _tone(numbers: Mapping[str, Any], unit: str = "") -> str:
    """The frequency (Hz) of a motion; before it has settled it is not that of the motion which lasts."""
    shown = text_of(numbers.get("frequency"), unit)
    return shown if shown == "-" or numbers.get("settled", True) else f"{shown}, not settled"


def _interval(found: Mapping[str, Any]) -> str:
    when = f"{found['start']:.4g} to {found['end']:.4g} s, most at {found['speed']:.3g} m/s"
    tone = "" if found["frequency"] is None else f": {found['frequency']:.4g} Hz"
    return f"{when}{tone}, {found['amplitude']:.3g} m"


def check_table(title: str, found: Check) -> str:
    """What a run would cost and which limits it meets."""
    system = found.system
    limits = found.limits
    has_step = found.step is not None
    low, high = system.natural_frequencies
    link_low, link_high = found.link_frequencies
    growth = f"multiplies a frictionless disturbance by at most {limits.growth:.8g} a step"
    coefficients = zip(COEFFICIENTS.values(), system.coefficients, strict=True)
    rows = [
        *((f"{c.symbol}, {c.long_name}", text_of(value, c.units.removeprefix("1"))) for c, value in coefficients),
        ("surface speed U", text_of(system.belt_speed, "m/s")),
        ("contact stiffness 2ak", text_of(system.contact_stiffness, "N/m")),
        ("natural frequencies", f"{low:.5g} and {high:.5g} Hz in full contact"),
        ("without contact", f"{link_low:.5g} and {link_high:.5g} Hz"),
        ("shortest wave passes at", text_of(system.passing_frequency or None, "Hz")),
        ("step", (f"{found.step:.6g} s, " if has_step else "its own, about ") + f"{found.steps:.15g} steps"),
        ("steps per period", [f"{found.steps_per_period:.4g} of the fastest motion"] * has_step),
        ("fixed-point contraction", [f"{limits.contraction:.3g} (1 or more: it may diverge)"] * has_step),
        ("solution of each step", [f"{'unique' if limits.unique else 'perhaps not unique'}"] * has_step),
        ("scheme", [growth] * has_step),
        ("contact", system.evaluator + (f", {system.nodes} nodes" if system.nodes else "")),
        ("nodes per shortest wave", text_of(found.nodes_per_wave)),
        *_cost_rows(found),
        ("adjusted", found.adjustments),
    ]
    return two_columns(title, rows)


def estimate_table(title: str, found: Estimate) -> str:
    """What a sweep would cost."""
    workers = str(found.workers or "none, as they would take longer to start")
    return two_columns(title, [("points", str(found.points)), ("workers", workers), *_cost_rows(found)])


def _cost_rows(found: Check | Estimate) -> list[Row]:
    from brakecli.runs.cost import duration_text

    return [
        ("time", f"{'at least' if found.at_least else 'about'} {duration_text(found.seconds)}"),
        ("memory", f"about {found.memory / 1e6:.0f} MB"),
        ("file", f"about {found.file_size / 1e6:.2g} MB"),
    ]


def sweep_table(report: SweepReport) -> str:
    """Summary of a sweep, and every point of a small one."""
    found = report.findings
    critical = report.loaded.sweep.critical
    resumed = f", {report.resumed} of them computed before" if report.resumed else ""
    rows: list[Row] = [
        ("points", f"{found.points}{resumed}"),
        ("regimes", ", ".join(f"{name} {count}" for name, count in found.regimes.items())),
    ]
    if found.critical is not None and critical is not None:
        count, least, largest = found.critical
        span = f"{least:.6g} to {largest:.6g}, found" if count > 1 else f"{least:.6g}, found" if count else "found"
        rows.append((f"critical {critical.parameter}", f"{span} at {count} of {found.points} points"))
        told = (found.variables or {})["critical_sentence"] if found.points == 1 else []
        rows.append(("in a sentence", [str(each) for each in told if each]))
    speed = report.points_per_second
    cost = f": {speed:.3g} points/s, {report.overhead:.0%} of the time not on points" if speed else ""
    rows += [
        ("note", found.sentences),
        ("failed", [f"{found.failed} points"] if found.failed else []),
        ("time", text_of(report.seconds, "s", ".3g") + cost),
        ("file", str(report.output)),
    ]
    listed = [_points_table(report)] if found.points <= MOST_LISTED_POINTS else []
    listed += [_attractors_table(found.attractors)] if found.attractors else []
    return "\n\n".join([*listed, two_columns(report.loaded.title, rows)])


def _attractors_table(found: Iterable[Attractor]) -> str:
    """What the points of a sweep over initial states come to."""
    each = [values_of(fields.ATTRACTOR, one) for one in found]
    return grid(
        {
            "attractor": [str(one["attractor"]) for one in each],
            "regime": [one["regime"] for one in each],
            "Hz": [text_of(one["frequency"], form=".5g") for one in each],
            "amplitude of x, m": [text_of(one["amplitude"], form=".5g") for one in each],
            "share": [f"{one['share']:.1%}" for one in each],
            "95 % interval": [f"{one['share_lower']:.1%} to {one['share_upper']:.1%}" for one in each],
        }
    )


def _points_table(report: SweepReport) -> str:
    """A row for each point: its place on the axes, and what was found there."""
    from brakecli.sweeps.plan import label

    found = report.findings
    plan = report.loaded.plan
    places = [plan.places(point % plan.points) for point in range(found.points)]
    columns = {}
    if "direction" in found.dimensions:
        columns["way"] = [("up", "down")[point // plan.points] for point in range(found.points)]
    for number, axis in enumerate(plan.sweep.axis):
        columns[axis.parameter[0]] = [label(axis.value(place[number])) for place in places]
    if plan.listed is not None:
        columns |= {
            key: [label(each) for each in column]
            for key, column in zip(plan.listed.keys, plan.listed.columns, strict=True)
        }
    known = POINTS if found.critical is None else CRITICAL_POINTS
    known += fields.STARTS if found.attractors is not None else ()
    for field in known:
        values = np.ravel(np.array((found.variables or {})[field.name], object))
        header = f"{field.title}, {field.units}" if field.units.strip("1") else field.title
        columns[header] = [text_of(value, form=".2g" if field.title == "±" else ".5g") for value in values]
    return grid(columns, len(columns) - len(known))


def comparison_table(report: ComparisonReport) -> str:
    """The entries that no other beats, the finest of each other method, and what is recommended."""
    found = report.comparison
    best = report.recommended
    entries = list(zip(found.entries, report.numbers()["entries"], strict=True))
    for _, numbers in entries:
        numbers["milliseconds"] = 1e3 * (numbers["wall_seconds"] or 0.0)
        numbers["step"] = numbers["step"] or (f"to {numbers['tolerance']:g}" if numbers["tolerance"] else "exact")
    able = [(entry, numbers) for entry, numbers in entries if entry.errors is not None]
    front = sorted((numbers for entry, numbers in able if entry.on_front), key=lambda each: each["milliseconds"])
    finest = {entry.kind: numbers for entry, numbers in able if not entry.on_front}
    failed = [entry for entry in found.entries if entry.work is not None and entry.errors is None]
    recommended = [f"none meets {report.target:g}"]
    if best is not None:
        recommended = [f"{best}: error {best.error:.2g}, and {report.target:g} is the target"]
        if (finer := found.finer_error(best)) > report.target:
            chance = f"this is by chance: at a finer step its error is {finer:.2g}"
            recommended.append(f"{chance}; choose a method with more margin")
    times = f"median of {found.repeats} repetitions," if found.repeats > 1 else "measured once,"
    left_out = f"{found.left_out} entries, because the time was used up; give a larger --budget"
    rows = [
        ("compared over", f"{found.duration:.6g} s of motion"),
        ("reference", f"event-driven, error below {found.reference_error:.1e}, {found.reference_seconds:.3g} s"),
        ("times", f"{times} of the time loop alone"),
        ("left out", [left_out] if found.left_out else []),
        ("failed", [f"{len(failed)} entries, such as {each}: {each.failure}" for each in failed[:1]]),
        ("recommended", recommended),
        ("in a case", ", ".join(f"{key} = {json.dumps(each)}" for key, each in report.in_a_case.items()) or []),
        ("file", str(report.output)),
    ]
    best_entries = "No other has a smaller error in less time:\n" + _entries(front)
    others = "The finest of the others:\n" + _entries(finest.values())
    return "\n\n".join((best_entries, others, two_columns(report.title, rows)))


def _rows(known: Iterable[Field], numbers: Mapping[str, Any], *names: str) -> list[Row]:
    """A row for each of these fields, with its declared label and unit."""
    return [(each.title, TERMINAL.field(each, numbers[each.name])) for each in named(known, *names)]


def _entries(records: Collection[Mapping[str, Any]]) -> str:
    return grid({header: [text_of(each[name], form=form) for each in records] for name, header, form in ENTRIES})


def two_columns(title: str, rows: Sequence[Row]) -> str:
    """Rows in two columns."""
    lines = [(label, text) for label, texts in rows for text in ([texts] if isinstance(texts, str) else texts)]
    labels, values = zip(*lines, strict=True)
    return grid({"label": labels, "value": values}, title=title, show_header=False)


def grid(columns: Mapping[str, Sequence[str]], keys: int = 1, title: str = "", show_header: bool = True) -> str:
    """Columns under their headers, as wide as the terminal; words are kept whole up to half of that.

    Columns that do not fit beside the others follow below, behind the first `keys` columns.
    """
    from rich.cells import cell_len
    from rich.console import Console
    from rich.table import Table

    console = Console(markup=False, emoji=False, highlight=False)  # titles and file names are not markup
    console.width = room = max(console.width, NARROWEST)
    texts = {escaped(header): [*map(escaped, cells)] for header, cells in columns.items()}
    most = {header: max(map(cell_len, (header, *cells))) for header, cells in texts.items()}
    words = {header: " ".join((header.replace(".", ". "), *cells)).split() for header, cells in texts.items()}
    least = {header: min(max(map(cell_len, words[header])), room // 2) for header in texts}
    names = [*texts]
    while len(names) > keys + 1 and sum(least[name] + 2 for name in names) > room + 2:
        names.pop()
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, show_header=show_header)
    for cap in range(room, 0, -1):
        widths = {name: min(most[name], max(least[name], cap)) for name in names}
        if sum(width + 2 for width in widths.values()) <= room + 2:
            break
    for name, width in widths.items():
        header = name if cell_len(name) <= width else name.replace(".", ".\n")
        table.add_column(header, overflow="fold", width=width, style="bold" if name == "label" else None)
    for line in zip(*map(texts.get, names), strict=True):
        table.add_row(*line)
    with console.capture() as shown:
        if title:
            console.print(escaped(title), style="italic")
        console.print(table)
    others = {name: texts[name] for name in (*names[:keys], *[*texts][len(names) :])}
    below = ["", grid(others, keys)] if len(names) < len(texts) else []
    return "\n".join([*(line.rstrip() for line in shown.get().splitlines()), *below])
