"""What `branch` has found, as a table for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from brakecli.front.render import text_of
from brakecli.front.tables import grid, two_columns

if TYPE_CHECKING:
    from brakecli.branches.answers import Answers
    from brakecli.branches.told import Followed


def branch_table(title: str, found: Answers, units: str) -> str:
    """Each branch with its special points, then the answer in a sentence."""
    rows = [
        ("along", f"{found.parameter} from {found.lower:g} to {found.upper:g} {units.removeprefix('1')}".strip()),
        ("critical", text_of(found.critical, units.removeprefix("1"), ".7g")),
        ("can vibrate from", text_of(found.coexists_from, units.removeprefix("1"), ".7g")),
        ("barrier", text_of(found.barrier, "m", ".4g")),
    ]
    parts = [two_columns(title, rows)]
    for number, each in enumerate(found.branches):
        stable = sum(point.stable for point in each.points)
        head = f"branch {number}: {each.kind}, {len(each.points)} motions, {stable} of them stable"
        parts.append(f"{head}{f' ({each.note})' if each.note else ''}\n{grid(_columns(each))}")
    parts.append(two_columns("", [("in a sentence", found.sentence)]))
    return "\n\n".join(parts)


def _columns(found: Followed) -> dict[str, list[str]]:
    marks = found.special
    return {
        "special point": [mark.kind for mark in marks],
        "value": [f"{mark.value:.8g}" for mark in marks],
        "error": [f"{mark.error:.1g}" if mark.error else "-" for mark in marks],
        "amplitude, m": [text_of(mark.amplitude or None, form=".4g") for mark in marks],
        "frequency, Hz": [text_of(mark.frequency or None, form=".5g") for mark in marks],
        "why": [mark.reason or "-" for mark in marks],
    }
