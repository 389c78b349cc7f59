"""Branches as files and `--json` give them: rows of motions, and marks where something is special."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from brakecli.branches.line import Line
from brakecli.branches.point import Branch, End, Point, Special
from brakecli.branches.sliding import Change, Slide
from brakecli.solver.tangent import MOST_POWERS

SLIDING = "steady sliding"
LIMIT_CYCLE = "limit cycle"
FORCED = "forced motion"
IN_SLIDING = "it ends in steady sliding, where that flutters"
BESIDE = 1e-5
"""Length along a branch from its begin, within which a special point is that begin."""


@dataclass(frozen=True, slots=True)
class Row:
    """A motion on a branch, as files and `--json` give it (SI units)."""

    value: float
    amplitude: float
    frequency: float
    stick_fraction: float
    contact_loss_fraction: float
    stable: bool
    multipliers: tuple[complex, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """A special point of a branch; error in the unit of the value, and why, where the branch ends."""

    kind: str
    value: float
    error: float
    amplitude: float
    frequency: float
    reason: str = ""


@dataclass(frozen=True)
class Followed:
    """A branch, its motions in order, and what is special on it."""

    kind: str
    points: list[Row]
    special: list[Mark]
    branch: Branch | None = None
    problem: Any = None
    note: str = ""

    @property
    def ended(self) -> list[Mark]:
        """Why it ends, at either end."""
        return [mark for mark in self.special if mark.kind in ("end", "budget")]


def slid(line: Line, slides: list[Slide], changes: list[Change]) -> Followed:
    """Steady sliding: its multipliers are those of a period of its least stable mode, or of a second."""
    rows = []
    marks = []
    there = [slide for slide in slides if slide.eigenvalues is not None]
    for slide in there:
        assert slide.eigenvalues is not None
        fastest = slide.eigenvalues[int(np.argmax(slide.eigenvalues.real))]
        frequency = abs(float(fastest.imag)) / (2.0 * math.pi)
        turned = slide.eigenvalues / (frequency or 1.0)
        factors = np.exp(np.clip(turned.real, -MOST_POWERS, MOST_POWERS)) * np.exp(1j * turned.imag)
        rows.append(Row(line.value(slide.p), 0.0, frequency, 0.0, 0.0, slide.stable, tuple(factors.tolist())))
    for change in changes:
        width = abs(line.high - line.low)
        marks.append(Mark(change.kind, line.value(change.p), change.error * width, 0.0, change.frequency))
    if there:
        for slide, end in ((there[0], "lower"), (there[-1], "upper")):
            whole = slide.p == (0.0 if end == "lower" else 1.0)
            why = f"it reaches the {end} end of the range" if whole else "there is no steady sliding beyond"
            marks.append(Mark("end", line.value(slide.p), 0.0, 0.0, 0.0, why))
    return Followed(SLIDING, rows, sorted(marks, key=lambda mark: mark.value))


def told_of(
    line: Line,
    branch: Branch,
    problem: Any,
    kind: str,
    change: Change | None = None,
    changes: Sequence[Change] = (),
) -> Followed:
    """A branch as rows and marks; of the linear vibrations at its flutter only the largest one is kept."""
    points = branch.points
    specials = branch.specials
    marks = []
    if change is not None:
        first = 0
        if line.smooth:
            first = next((k for k, point in enumerate(points) if len(set(point.facts.word)) > 1), len(points))
        points = points[max(first - 1, 0) :]
        beyond = points[0].s + BESIDE if line.smooth else 0.0
        specials = [special for special in specials if special.s > beyond or special.kind == "end"]
        marks.append(_mark(line, Special("flutter", change.p, change.error, points[0], points[0].s)))
    for special in specials:
        if special.kind == "end" and special.name == IN_SLIDING and changes:
            near = min(changes, key=lambda each: abs(each.p - special.p))
            marks.append(_mark(line, Special("flutter", near.p, near.error, special.point, special.s)))
        else:
            marks.append(_mark(line, special, branch.ended))
    rows = [_row(line, point) for point in points]
    return Followed(kind, rows, marks, replace(branch, points=points), problem)


def _row(line: Line, point: Point) -> Row:
    cycle = point.facts
    return Row(
        line.value(point.p),
        cycle.amplitude,
        cycle.frequency,
        cycle.stick_fraction,
        cycle.contact_loss_fraction,
        point.stable,
        tuple(point.multipliers.tolist()),
    )


def _mark(line: Line, special: Special, ended: Sequence[End] = ()) -> Mark:
    kind = special.name if special.kind == "grazing" else special.kind
    if kind.startswith("sequence"):
        kind = "grazing stick"
    cut = [end for end in ended if end.reason == special.name and end.kind in ("points", "seconds", "interrupted")]
    facts = special.point.facts
    width = abs(line.high - line.low)
    return Mark(
        "budget" if special.kind == "end" and cut else kind,
        line.value(special.p),
        special.error * width,
        facts.amplitude,
        facts.frequency,
        special.name if special.kind == "end" else "",
    )
