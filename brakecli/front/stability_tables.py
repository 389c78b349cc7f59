"""What `stability`, `advise`, `branch` and `scatter` have found, as tables for people."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from brakecli.analysis.stability.advice import rounded
from brakecli.files import stability_fields as fields
from brakecli.front.render import text_of
from brakecli.front.tables import Row, grid, two_columns

if TYPE_CHECKING:
    from pathlib import Path

    from brakecli.analysis.stability.advice import Change
    from brakecli.analysis.stability.modes import Crossing
    from brakecli.analysis.stability.report import StabilityReport
    from brakecli.branches.answers import Answers
    from brakecli.branches.islands import Search
    from brakecli.branches.thresholds import Thresholds
    from brakecli.branches.told import Followed
    from brakecli.runs.advise import AdviceReport
    from brakecli.scattering.scatter import ScatterReport
    from brakecli.sweeps.lock_in import LockIn

_STATE = {True: "stable", False: "unstable", None: "-"}


def stability_table(
    title: str,
    report: StabilityReport,
    found: LockIn | None,
    both: Thresholds | None = None,
    output: Path | None = None,
) -> str:
    """Steady sliding, its modes and both thresholds of friction; below that what there is along a key."""
    rest = report.equilibrium
    critical = report.critical
    discrete = report.discrete
    undamped = {"flutter": report.undamped_flutter, "divergence": report.undamped_divergence}
    known = [f"{kind} at {friction:.7g}" for kind, friction in undamped.items() if friction is not None]
    sliding = f"none: {report.no_equilibrium}"
    if rest is not None:
        touching = f"{rest.contact_fraction:.1%} of the pad touches"
        sliding = f"y = {rest.y + 0.0:.5g} m, F_y = {rest.normal_force:.5g} N, {touching}"
    rows = [
        ("surface speed U", text_of(report.belt_speed, "m/s")),
        ("steady sliding", sliding),
        ("contact stiffness K", text_of(report.contact_stiffness, "N/m") + _bar(report.contact_stiffness_error)),
        ("critical friction", _crossing(critical, report.critical_error) if critical else "none"),
        *_coexisting(both),
        ("also changes at", [_crossing(each) for each in report.crossings if each is not critical]),
        ("without dashpots", ", ".join(known) or "neither flutter nor divergence"),
        (f"at φ = {report.friction:g}", _STATE[report.stable]),
    ]
    for mode in report.modes:
        motion = f"{'grows' if mode.growth > 0.0 else 'decays'} at {abs(mode.growth):.4g} 1/s"
        shape = "along y alone"
        if mode.shape is not None and mode.shape_phase is not None:
            shape = f"y/x {mode.shape:.3g} at {round(mode.shape_phase)}°"
        what = f"{motion}, damping ratio {mode.damping_ratio:.3g}, {shape}"
        rows.append((f"mode at {mode.frequency:.5g} Hz", what))
    if discrete:
        limit = discrete.step_limit
        friction = discrete.critical_friction
        radius = discrete.spectral_radius
        bias = "" if discrete.bias is None else f", {discrete.bias:+.2g} from the exact one"
        rows += [
            ("the scheme's growth", f"{text_of(discrete.growth, '1/s')}, a factor {radius:.8g} a step"),
            ("its critical friction", "none" if friction is None else f"{friction:.7g}{bias}"),
            ("its stable steps", "any" if limit is None else f"up to {limit:.4g} s" if limit else "none"),
        ]
    rows += _search(both.search) if both else []
    if both and both.sentence:
        rows.append(("in a sentence", both.sentence))
    if output:
        rows.append(("file", str(output)))
    return two_columns(title, rows) + (_lock_in(found) if found else "")


def _coexisting(both: Thresholds | Answers | None, units: str = "") -> list[Row]:
    """From where on a vibration can exist, and the push that it needs, where that is known."""
    if both is None or both.coexists_from is None:
        return []
    barrier = [] if both.barrier is None else [("barrier", text_of(both.barrier, "m", ".4g"))]
    return [("can vibrate from", text_of(both.coexists_from, units, ".7g")), *barrier]


def _search(search: Search) -> list[Row]:
    """How widely vibrations were sought that no branch from flutter reaches, and how long that took."""
    if not search.pushes:
        return []
    return [("search for other vibrations", f"{search.seconds:.1f} s, {search.pushes} pushes")]


def _lock_in(found: LockIn) -> str:
    """Critical friction and both modes along a key, and where stability changes."""
    from brakecli.sweeps.result import unit

    entries = found.entries
    keys = ", ".join(found.parameters)
    columns = {"value": [f"{entry['value']:.6g}" for entry in entries]}
    columns |= {field.title: [text_of(each[field.name]) for each in entries] for field in fields.VARIED}
    looks = (("frequency {}, Hz", 1.0, ".5g"), ("growth {}, 1/s", 1.0, ".4g"), ("damping {}, %", 100.0, ".3g"))
    for field, (head, factor, form) in zip(fields.MODES, looks, strict=True):
        for mode in (0, 1):
            values = [each[field.name][mode] for each in entries]
            shown = [None if value is None else factor * value for value in values]
            columns[head.format(mode + 1)] = [text_of(value, form=form) for value in shown]
    units = unit(found.parameters[0])
    critical = ", ".join(text_of(value, units.removeprefix("1"), ".7g") for value in found.critical_values)
    changes = f"Stability changes at {critical}." if critical else "Stability does not change in between."
    return "\n\n" + "\n\n".join((f"Along {keys}:\n" + grid(columns), changes))


def _bar(error: float | None) -> str:
    """What stands behind a number that is not known to all of its digits."""
    if error is None:
        return ", but single windows of the waves have none near it"
    return f" ± {error:.1g}" if error else ""


def _crossing(crossing: Crossing, error: float | None = 0.0) -> str:
    change = "lost" if crossing.lost else "regained"
    where = f" at {crossing.frequency:.5g} Hz" if crossing.frequency else ""
    digits = crossing.friction if not error else round(crossing.friction, 1 - math.floor(math.log10(error)))
    return f"{digits:.7g}{_bar(error)}: stability {change} by {crossing.instability}{where}"


def _until(change: Change) -> str:
    """Where safe values end, rounded towards them; or where there are none."""
    if change.to is None:
        return f"none in {change.lowest:.4g} to {change.highest:.4g}"
    return "-" if change.until is None else rounded(change.until, change.until < change.to)


def advice_table(report: AdviceReport) -> str:
    """What moves the critical friction, what to change, and the answer in a sentence."""
    found = report.stability
    check = report.check
    margin = report.margin
    moving = [each for each in report.sensitivities if each.elasticity or each.derivative or each.growth_change]
    moves = {
        "what moves it": [each.parameter for each in moving],
        "value": [text_of(each.value) if isinstance(each.value, float) else "list" for each in moving],
        "% for 1 %": [text_of(each.elasticity, form=".3g") for each in moving],
        "for a unit": [text_of(each.derivative, form=".3g") for each in moving],
        "growth for 1 %": [text_of(each.growth_change, form=".3g") for each in moving],
    }
    helps = {
        "what helps": [each.parameter for each in report.advice],
        "from": [text_of(each.start) for each in report.advice],
        "to": [each.rounded for each in report.advice],
        "critical φ": [text_of(each.critical_friction, form=".4g") for each in report.advice],
        "safe until": [_until(each) for each in report.advice],
        "a run is": [each.check or "-" for each in report.advice],
    }
    if report.squeal:
        left = [each.squeal.squeal_probability if each.squeal else None for each in report.advice]
        helps["squeals"] = [text_of(each, form=".2%") for each in left]
    rows: list[Row] = [
        ("critical friction", _crossing(found.critical) if found.critical else "none"),
        *_coexisting(report.thresholds),
        (f"at φ = {found.friction:g}", _STATE[report.stable]),
        ("margin", "-" if margin is None else f"{margin:.1%}; {report.wanted_margin:.1%} is wanted"),
    ]
    if under := report.squeal:
        low = under.squeal_lower
        high = under.squeal_upper
        rows.append(("squeal under scatter", f"{under.squeal_probability:.2%} (95 %: {low:.2%} to {high:.2%})"))
    ends: list[Row] = [("note", report.notes())]
    if check:
        ran = f"{check.parameter} = {check.value:.6g}: {check.duration:.3g} s of motion, in {check.seconds:.2g} s"
        ends.append(("checked by a run", [ran, f"{check.verdict.regime}: {'; '.join(check.verdict.reasons)}"]))
    ends.append(("in a sentence", report.conclusion()))
    meant = "Critical friction for 1 % and for 1 unit of a value; growth rate (1/s) for 1 %:\n"
    stays = "Advice moves the loss of stability alone; below it a vibration may still exist:\n"
    grids = [meant + grid(moves)] * bool(moving) + [stays + grid(helps)] * bool(report.advice)
    return "\n\n".join((two_columns(report.title, rows), *grids, two_columns("", ends)))


def branch_table(title: str, found: Answers, units: str, output: Path | None = None) -> str:
    """Each branch with its special points, then the answer in a sentence."""
    rows = [
        ("along", f"{found.parameter} from {found.lower:g} to {found.upper:g} {units.removeprefix('1')}".strip()),
        ("critical", text_of(found.critical, units.removeprefix("1"), ".7g")),
        *_coexisting(found, units.removeprefix("1")),
        *_search(found.explored.search),
    ]
    parts = [two_columns(title, rows)]
    for number, each in enumerate(found.branches):
        stable = sum(point.stable for point in each.points)
        head = f"branch {number}: {each.kind}, {len(each.points)} motions, {stable} of them stable"
        parts.append(f"{head}{f' ({each.note})' if each.note else ''}\n{grid(_special_points(each))}")
    parts.append(two_columns("", [("in a sentence", found.sentence), ("file", [str(output)] if output else [])]))
    return "\n\n".join(parts)


def _special_points(found: Followed) -> dict[str, list[str]]:
    marks = found.special
    return {
        "special point": [mark.kind for mark in marks],
        "value": [f"{mark.value:.8g}" for mark in marks],
        "error": [f"{mark.error:.1g}" if mark.error else "-" for mark in marks],
        "amplitude, m": [text_of(mark.amplitude or None, form=".4g") for mark in marks],
        "frequency, Hz": [text_of(mark.frequency or None, form=".5g") for mark in marks],
        "why": [mark.reason or "-" for mark in marks],
    }


def scatter_table(report: ScatterReport) -> str:
    """Probabilities, distributions and indices, then the answer in a sentence."""
    parts = [grid(_probabilities(report), 1)]
    if report.distributions:
        parts.append(grid(_distributions(report), 1))
    if report.indices.total:
        parts.append(f"What decides on {report.indices.of.replace('_', ' ')}\n{grid(_indices(report), 1)}")
    rows = [
        ("samples", f"{report.samples}{f', {report.failed} without an answer' if report.failed else ''}"),
        ("note", report.notes),
        ("in a sentence", [report.sentence]),
        ("file", str(report.output)),
    ]
    return "\n\n".join([*parts, two_columns(report.loaded.title, rows)])


def _probabilities(report: ScatterReport) -> dict[str, list[str]]:
    shown = report.probabilities.values()
    return {
        "a sample is": [fields.PROBABLE.get(name, name) for name in report.probabilities],
        "probability": [f"{each.value:.2%}" for each in shown],
        "95 % interval": [f"{each.lower:.2%} to {each.upper:.2%}" for each in shown],
    }


def _distributions(report: ScatterReport) -> dict[str, list[str]]:
    from brakecli.scattering.answers import SHARES

    shown = report.distributions
    heads = [f"{each.name.replace('_', ' ')}{f', {each.units}' if each.units else ''}" for each in shown]
    columns = {"quantiles": heads}
    for place, share in enumerate(SHARES):
        columns[f"{share:.0%}"] = [f"{each.quantiles[place]:.4g}" for each in shown]
    return columns


def _indices(report: ScatterReport) -> dict[str, list[str]]:
    found = report.indices
    names = sorted(found.total, key=lambda name: -found.total[name])
    return {
        "parameter": names,
        "alone": [f"{found.first_order[name]:.3f}" for name in names],
        "with all others": [f"{found.total[name]:.3f}" for name in names],
        "±": [f"{found.error[name]:.2g}" for name in names],
    }
