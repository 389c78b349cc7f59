"""What `scatter` has found, as a table for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from brakecli.front.tables import grid, two_columns

if TYPE_CHECKING:
    from brakecli.scattering.scatter import ScatterReport

_NAMES = {"critical_below": "critical friction below own", "squeal": "squeal"}


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
        "a sample is": [_NAMES.get(name, name) for name in report.probabilities],
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
