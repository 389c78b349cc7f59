"""Branches as files and `--json` give them: rows of motions, and marks where something is special."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby, pairwise

import numpy as np

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.extent import Extent
from brakecli.analysis.branches.follow import Stop
from brakecli.analysis.branches.forced import Forced
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Newton, Settings
from brakecli.analysis.branches.point import Branch, End, Point, Special
from brakecli.analysis.branches.sliding import Change, Slide, Sliding
from brakecli.analysis.stability.follow import followed
from brakecli.analysis.stability.modes import Mode, modes_of
from brakecli.solver.tangent import MOST_POWERS

SLIDING = "steady sliding"
LIMIT_CYCLE = "limit cycle"
FORCED = "forced motion"
IN_SLIDING = "it ends in steady sliding, where that flutters"
SHORTEST = 1e-12
"""Length of a stride, and an amplitude (m), that is rounding."""


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion on a branch, as files and `--json` give it (SI units)."""

    value: float
    amplitude: float
    frequency: float
    stick_fraction: float
    contact_loss_fraction: float
    extent: Callable[[], Extent]
    """Computed where it is asked for: points of sweeps have no use for it."""


@dataclass(frozen=True, slots=True)
class Row:
    """A motion, whether it is stable, and what its disturbances are multiplied by."""

    motion: Motion
    stable: bool
    multipliers: tuple[complex, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """A special point of a branch; error in the unit of the value, and why, or what begins or ends there."""

    motion: Motion
    kind: str
    error: float
    reason: str = ""


@dataclass(frozen=True)
class Followed:
    """A branch, its motions in order, and what is special on it."""

    kind: str
    points: list[Row]
    special: list[Mark]
    branch: Branch | None = None
    problem: Cycles | Forced | None = None
    note: str = ""
    unstable: Callable[[], list[tuple[float, float]]] = list
    """The values between which it is not stable, in its order; computed where they are asked for."""

    @property
    def unstable_lower(self) -> list[float]:
        """Lower ends of the intervals in which it is unstable."""
        return [low for low, _ in self.unstable()]

    @property
    def unstable_upper(self) -> list[float]:
        """Their upper ends."""
        return [high for _, high in self.unstable()]

    @property
    def ended(self) -> list[Mark]:
        """Why it ends, at either end."""
        return [mark for mark in self.special if mark.kind in ("end", "budget")]


def of_sliding(sliding: Sliding, slides: list[Slide], changes: list[Change]) -> Followed:
    """Steady sliding, and the mode that is the first to grow, or comes nearest to it, followed by continuity.

    Multipliers are those of a period of this mode, or of a second.
    """
    line = sliding.line
    width = abs(line.high - line.low)
    there = [slide for slide in slides if slide.eigenvalues is not None]
    pairs = [pair for pair in followed(map(_modes, there)) if pair is not None]
    growing = [pair for slide, pair in zip(there, pairs, strict=True) if not slide.stable]
    worst = max(growing[:1] or pairs, key=lambda pair: max(mode.growth for mode in pair), default=None)
    which = max((0, 1), key=lambda number: worst[number].growth) if worst else 0
    rows = []
    for slide, pair in zip(there, pairs, strict=True):
        frequency = pair[which].frequency
        turned = np.asarray(slide.eigenvalues) / (frequency or 1.0)
        factors = np.exp(np.clip(turned.real, -MOST_POWERS, MOST_POWERS)) * np.exp(1j * turned.imag)
        rows.append(Row(_at_rest(line, slide, frequency), slide.stable, tuple(factors.tolist())))
    marks = [
        Mark(_at_rest(line, sliding.at(change.p), change.frequency), change.kind, change.error * width)
        for change in changes
    ]
    if there:
        for slide, end in ((there[0], "lower"), (there[-1], "upper")):
            whole = slide.p == (0.0 if end == "lower" else 1.0)
            why = f"it reaches the {end} end of the range" if whole else "there is no steady sliding beyond"
            marks.append(Mark(_at_rest(line, slide, 0.0), "end", 0.0, why))
    unstable = partial(_unstable, line, slides, changes)
    return Followed(SLIDING, rows, sorted(marks, key=lambda mark: mark.motion.value), unstable=unstable)


def _unstable(line: Line, slides: list[Slide], changes: list[Change]) -> list[tuple[float, float]]:
    """The values between which steady sliding is not stable, up to the changes beside its places."""
    spans = list[tuple[float, float]]()
    at = [change.p for change in changes]
    for grows, group in groupby(
        range(len(slides)), lambda k: slides[k].eigenvalues is not None and not slides[k].stable
    ):
        if grows:
            places = [*group]
            first = slides[places[0]].p
            last = slides[places[-1]].p
            before = slides[max(places[0] - 1, 0)].p
            after = slides[min(places[-1] + 1, len(slides) - 1)].p
            low = max((p for p in at if before <= p <= first), default=first)
            high = min((p for p in at if last <= p <= after), default=last)
            spans.append((line.value(low), line.value(high)))
    return spans


def _modes(slide: Slide) -> tuple[Mode, ...]:
    assert slide.eigenvalues is not None
    assert slide.vectors is not None
    return tuple(modes_of(slide.eigenvalues, slide.vectors))


def _at_rest(line: Line, slide: Slide, frequency: float) -> Motion:
    """Steady sliding as a motion."""
    x, y = slide.equilibrium or (None, None)
    return Motion(line.value(slide.p), 0.0, frequency, 0.0, 0.0, lambda: Extent(0.0, 0.0, x, y))


def of_branch(
    line: Line,
    branch: Branch,
    problem: Cycles | Forced,
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
        beyond = points[0].s + 1e-5 if line.smooth else 0.0  # what is closer is the begin
        specials = [special for special in specials if special.s > beyond or special.kind == "end"]
        marks.append(_mark(line, Special("flutter", change.p, change.error, points[0], points[0].s), problem))
    for special in specials:
        if special.kind == "end" and special.name == IN_SLIDING and changes:
            near = min(changes, key=lambda candidate: abs(candidate.p - special.p))
            marks.append(_mark(line, Special("flutter", near.p, near.error, special.point, special.s), problem))
        else:
            marks.append(_mark(line, special, problem, branch.ended))
    return Followed(kind, _rows(line, points, problem), marks, replace(branch, points=points), problem)


def _rows(line: Line, points: list[Point], problem: Cycles | Forced) -> list[Row]:
    return [
        Row(_moving(line.value(point.p), point, problem), point.stable, tuple(point.multipliers.tolist()))
        for point in points
    ]


def finer(line: Line, followed: Followed, stop: Stop) -> Followed:
    """A branch with more motions, where it bends so much between two that a straight line does not show it."""
    branch = followed.branch
    problem = followed.problem
    if branch is None or problem is None:
        return followed
    points = [*branch.points]
    newton = Newton(problem, Settings())
    for _ in range(5):  # each time to a quarter of the distance: from all of an amplitude
        for k in reversed(_bent(points)):
            one = points[k]
            other = points[k + 1]
            problem.use(one.chart)
            middle = None if stop() else newton.between(one, other, 0.5)
            if middle is not None and middle.word == one.word and middle.stable in (one.stable, other.stable):
                points.insert(k + 1, middle)
    rows = _rows(line, points, problem)
    return replace(followed, points=rows, branch=replace(branch, points=points))


def _bent(points: list[Point]) -> list[int]:
    """The strides from whose middle a branch is too far, as far as the strides beside them tell.

    An arc of length c that turns by an angle θ from chord to chord is c θ / 8 away from its chord.
    """
    strides = [k for k, (one, other) in enumerate(pairwise(points)) if one.chart is other.chart]
    if not strides:
        return []
    sizes = np.array([(point.facts.amplitude, point.facts.frequency) for point in points])
    places = np.column_stack(([point.p for point in points], np.log(np.maximum(sizes, SHORTEST))))
    chords = np.diff(places, axis=0)[strides]
    lengths = np.maximum(np.linalg.norm(chords, axis=1), SHORTEST)
    smooth = np.array([points[k].word == points[k + 1].word for k in strides])
    cosines = np.sum(chords[1:] * chords[:-1], axis=1) / (lengths[1:] * lengths[:-1])
    turns = np.where(smooth[1:] & smooth[:-1], np.arccos(np.clip(cosines, -1.0, 1.0)), 0.0)
    angles = np.maximum(np.append(turns, 0.0), np.append(0.0, turns))
    # 0.002 is half the width of a line of 1.8 points in a picture 460 points high
    bent = smooth & (lengths * angles > 8.0 * 0.002)
    return [k for k, far in zip(strides, bent.tolist(), strict=True) if far]


def _moving(value: float, point: Point, problem: Cycles | Forced) -> Motion:
    """A motion that repeats."""
    cycle = point.facts
    return Motion(
        value,
        cycle.amplitude,
        cycle.frequency,
        cycle.stick_fraction,
        cycle.contact_loss_fraction,
        cache(partial(problem.extent, point)),
    )


def _mark(line: Line, special: Special, problem: Cycles | Forced, ended: Sequence[End] = ()) -> Mark:
    kind = special.name if special.kind == "grazing" else special.kind
    if kind.startswith("sequence"):
        kind = "grazing stick"
    cut = [end for end in ended if end.reason == special.name and end.kind in ("points", "seconds", "interrupted")]
    return Mark(
        _moving(line.value(special.p), special.point, problem),
        "budget" if special.kind == "end" and cut else kind,
        special.error * abs(line.high - line.low),
        special.name if special.kind == "end" else special.change,
    )
