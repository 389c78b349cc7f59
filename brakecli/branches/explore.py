"""All branches of a case along a line: steady sliding, and the motions that are born where it loses stability."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np

from brakecli.analysis.stability.modes import is_undamped
from brakecli.branches.begin import settled
from brakecli.branches.cycles import Cycles
from brakecli.branches.follow import Stop, both_ways, follow
from brakecli.branches.forced import Forced
from brakecli.branches.line import Line
from brakecli.branches.newton import Newton, Settings
from brakecli.branches.point import Branch, End, Point, Special
from brakecli.branches.problem import Problem
from brakecli.branches.rough_cycles import RoughCycles
from brakecli.branches.sliding import Change, Slide, Sliding
from brakecli.branches.switch import switch
from brakecli.errors import CaseError

SLIDING, LIMIT_CYCLE, FORCED = "steady sliding", "limit cycle", "forced motion"
SMALLEST = 0.5
"""Amplitude over that at the begin below which a cycle of a rough shoe ends in steady sliding."""
LARGEST = 1e4
"""Amplitude of a cycle over that at the begin of its branch, beyond which it is not followed."""
MOST = 12
"""Branches of one command."""
LONGEST = 0.25
"""Longest stride, in sizes of the motion and of the range."""
POINTS, ALL_POINTS, SECONDS = 3000, 10_000, 60.0
"""Budgets: of points of one branch and of all of them, and of time."""
GROWN_AT = 0.0, 1.0, 0.5, 0.25, 0.75
"""Places of the line at which a forced motion is sought that grows with the waves, where none is known yet."""
SAME = 1e-6
"""Relative difference of amplitude and period by which two motions at one value are the same."""
IN_SLIDING = "it ends in steady sliding, where that flutters"
LARGE = "its amplitude is ten thousand times that of its begin"
UNDAMPED = "no dashpot damps the shoe: all multipliers stay on the unit circle, so that no limit cycle is followed"


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


@dataclass(frozen=True)
class Explored:
    """What there is along a line."""

    line: Line
    slides: list[Slide]
    changes: list[Change]
    branches: list[Followed]
    notes: list[str]
    interrupted: bool = False


Tell = Callable[[str, int, int], None]


class Explorer:
    """Follows one branch after another, within a budget of time, until it is stopped."""

    def __init__(
        self, line: Line, tell: Tell, stop: Stop, seconds: float = SECONDS, points: int = ALL_POINTS
    ) -> None:
        """`tell` shows how many points there are; `stop` ends the work, and keeps what was found.

        The budget of `points` is that of all branches; that of `seconds` is for a user who waits. Where the same
        bytes must come out again, it is infinite.
        """
        self.line, self.tell, self.stop = line, tell, stop
        self.end, self.count, self.points = perf_counter() + seconds, 0, points
        self.sliding = Sliding(line)
        self.slides = self.sliding.along()
        self.changes = self.sliding.changes(self.slides)
        self.branches: list[Followed] = []
        self.notes: list[str] = []

    def explore(self, states: Sequence[tuple[float, Any]] = (), switches: bool = False) -> Explored:
        """Follow everything: from flutter, from given states (p and state), and from flips if that is wanted."""
        self.branches.append(self._sliding(self.slides, self.changes))
        if self.line.case.roughness.wheel is not None:
            self._forced()
        else:
            self._cycles(self.sliding, self.changes)
        for p, state in states:
            self.begin_at(p, state)
        if switches:
            self._doubled()
        return self.explored

    @property
    def explored(self) -> Explored:
        """What has been found so far."""
        found = [*self.branches], [*self.notes]
        return Explored(self.line, self.slides, self.changes, *found, bool(self.stop()))

    def begin_at(self, p: float, state: Any) -> None:
        """Follow the branch of the motion that a state at a place comes to, if it is not known."""
        if self.line.case.roughness.wheel is None:
            if not self._over() and not is_undamped(self.line.case_coefficients):
                self._from_state(self.sliding, p, state)
        elif self.waves is not None:
            self._forced_from(self.waves, p, state)

    def _sliding(self, slides: list[Slide], changes: list[Change]) -> Followed:
        """Steady sliding: its multipliers are those of a period of its least stable mode, or of a second."""
        rows, marks = [], []
        there = [slide for slide in slides if slide.eigenvalues is not None]
        for slide in there:
            assert slide.eigenvalues is not None
            fastest = slide.eigenvalues[int(np.argmax(slide.eigenvalues.real))]
            frequency = abs(float(fastest.imag)) / (2.0 * math.pi)
            factors = np.exp(np.clip((slide.eigenvalues / (frequency or 1.0)).real, -700.0, 700.0)) * np.exp(
                1j * (slide.eigenvalues / (frequency or 1.0)).imag
            )
            rows.append(
                Row(self.line.value(slide.p), 0.0, frequency, 0.0, 0.0, slide.stable, tuple(factors.tolist()))
            )
        for change in changes:
            width = abs(self.line.high - self.line.low)
            marks.append(Mark(change.kind, self.line.value(change.p), change.error * width, 0.0, change.frequency))
        if there:
            for slide, end in ((there[0], "lower"), (there[-1], "upper")):
                whole = slide.p == (0.0 if end == "lower" else 1.0)
                why = f"it reaches the {end} end of the range" if whole else "there is no steady sliding beyond"
                marks.append(Mark("end", self.line.value(slide.p), 0.0, 0.0, 0.0, why))
        else:
            self.notes.append("there is no steady sliding in the range")
        return Followed(SLIDING, rows, sorted(marks, key=lambda mark: mark.value))

    def _settings(self) -> Settings:
        left = max(self.end - perf_counter(), 0.0)
        return Settings(longest=LONGEST, points=min(POINTS, max(self.points - self.count, 0)), seconds=left)

    def _until(self, problem: Problem, first: Point) -> Callable[[Point], str | None]:
        """Ends a branch that has come back to steady sliding, or grown beyond all bounds."""
        begun, smooth, left = first.facts.amplitude, self.line.smooth, [False]
        cycles = isinstance(problem, Cycles)

        def until(point: Point) -> str | None:
            self.count += 1
            self.tell("points of branches", self.count, 0)
            amplitude = point.facts.amplitude
            if cycles:
                slips = len(set(point.facts.word)) == 1
                if left[0] and slips and (smooth or amplitude < SMALLEST * begun):
                    return IN_SLIDING
                # on smooth pads slip alone is linear; a rough shoe slips in larger cycles, too
                left[0] |= not slips or (amplitude > begun and not smooth)
            return LARGE if cycles and amplitude > LARGEST * begun else None  # waves may begin at nothing

        return until

    def _cycles(self, sliding: Sliding, changes: list[Change]) -> None:
        """Limit cycles on a smooth wheel, from each flutter."""
        if is_undamped(self.line.case_coefficients):
            self.notes.append(UNDAMPED)
            return
        for change in changes:
            if change.kind != "flutter" or self._over():
                continue
            if any(mark.kind == "flutter" and mark.value == self.line.value(change.p) for mark in self._marks()):
                continue  # a branch from another flutter has ended here
            problem = self._problem()
            first = sliding.vibration(problem, change)
            value = self.line.value(change.p)
            if first is None:
                self.notes.append(f"no limit cycle was found at the flutter at {value:.6g}")
                continue
            branch = follow(problem, first, None, self._settings(), self._until(problem, first), self.stop)
            self.branches.append(self._followed(branch, problem, change, changes))

    @cached_property
    def waves(self) -> Forced | None:
        """The problem of motions that a rough wheel forces; None where there are none that repeat."""
        try:
            return Forced.along(self.line)
        except CaseError as error:
            self.notes.append("; ".join(each.what for each in error.problems))
            return None

    def _forced(self) -> None:
        """Motions that a rough wheel forces: those that grow with the waves."""
        problem = self.waves
        if problem is None:
            return
        for p in GROWN_AT:
            if self._over() or any(low <= p <= high for low, high in map(span, self.branches[1:])):
                continue
            first = problem.begun(p, replace(self._settings(), points=300))
            if first is not None:
                branch = both_ways(problem, first, self._settings(), self._until(problem, first), self.stop)
                self.branches.append(self._followed(branch, problem, kind=FORCED))
        if len(self.branches) == 1 and not self.stop():
            self.notes.append("no motion was found that the waves force")

    def _forced_from(self, problem: Forced, p: float, state: Any) -> None:
        """The branch of the forced motion that a run comes to; none where it is known already."""
        value = self.line.value(p)
        found = None if self._over() else problem.settled(p, state)
        if found is None:
            self.notes.append(f"the motion given for {value:.6g} comes to no periodic motion")
        elif self._known(p, found[1]):
            self.notes.append(f"the motion given for {value:.6g} comes to one of a branch that is known")
        else:
            branch = both_ways(*found, self._settings(), self._until(*found), self.stop)
            note = f"from the motion given for {value:.6g}"
            self.branches.append(replace(self._followed(branch, found[0], kind=FORCED), note=note))

    def _known(self, p: float, first: Point) -> bool:
        """Whether a motion at p lies on a branch that has been followed, perhaps as several of its periods."""
        for followed in self.branches:
            for point in crossing(followed, p):
                one, other = point.facts, first.facts
                if math.isclose(one.amplitude, other.amplitude, rel_tol=SAME) and any(
                    math.isclose(k * one.period, other.period, rel_tol=SAME) for k in (1, 2, 3, 4)
                ):
                    return True
        return False

    def _from_state(self, sliding: Sliding, p: float, state: Any) -> None:
        """The branch of the cycle that a motion comes to; none where it is known already."""
        values = sliding.at(p).eigenvalues
        frequency = 0.0 if values is None else float(np.abs(values.imag).max()) / (2.0 * math.pi)
        if values is not None:
            least_stable = values[int(np.argmax(values.real))]
            frequency = abs(float(least_stable.imag)) / (2.0 * math.pi) or frequency
        value, problem = self.line.value(p), self._problem()
        first = settled(problem, p, state, frequency) if frequency else None
        if first is None:
            self.notes.append(f"the motion given for {value:.6g} comes to no limit cycle")
            return
        if self._known(p, first):
            self.notes.append(f"the motion given for {value:.6g} comes to a cycle of a branch from flutter")
            return
        branch = both_ways(problem, first, self._settings(), self._until(problem, first), self.stop)
        note = f"from the motion given for {value:.6g}"
        self.branches.append(replace(self._followed(branch, problem), note=note))

    def _problem(self) -> Cycles:
        return Cycles(self.line) if self.line.smooth else RoughCycles(self.line)

    def _marks(self) -> list[Mark]:
        return [mark for followed in self.branches if followed.kind == LIMIT_CYCLE for mark in followed.special]

    def _over(self) -> bool:
        spent = perf_counter() > self.end or self.count >= self.points
        return self.stop() or spent or len(self.branches) >= MOST

    def _doubled(self) -> None:
        """The motions of twice the period that are born at flips."""
        for followed in list(self.branches):
            for special in followed.branch.specials if followed.branch is not None else ():
                if special.kind != "flip" or self._over():
                    continue
                problem = followed.problem.of_periods(2 * followed.problem.periods)
                first = switch(problem, special.point, self._settings())
                value = self.line.value(special.p)
                if first is None:
                    self.notes.append(f"no motion of twice the period was found at the flip at {value:.6g}")
                    continue
                branch = follow(problem, first, None, self._settings(), self._until(problem, first), self.stop)
                note = f"twice the period, from the flip at {value:.6g}"
                self.branches.append(replace(self._followed(branch, problem, kind=followed.kind), note=note))

    def _followed(
        self,
        branch: Branch,
        problem: Any,
        change: Change | None = None,
        changes: Sequence[Change] = (),
        kind: str = LIMIT_CYCLE,
    ) -> Followed:
        """A branch as rows and marks; of the linear vibrations at its flutter only the largest one is kept."""
        points, specials = branch.points, branch.specials
        marks = []
        if change is not None and not self.line.smooth:
            specials = [special for special in specials if special.s > 0.0 or special.kind == "end"]
            marks.append(self._mark(Special("flutter", change.p, change.error, points[0], points[0].s)))
        elif change is not None:
            begin = next((k for k, point in enumerate(points) if len(set(point.facts.word)) > 1), len(points))
            begin = max(begin - 1, 0)
            points = points[begin:]
            specials = [special for special in specials if special.s > points[0].s + 1e-5 or special.kind == "end"]
            marks.append(self._mark(Special("flutter", change.p, change.error, points[0], points[0].s)))
        for special in specials:
            if special.kind == "end" and special.name == IN_SLIDING and changes:
                near = min(changes, key=lambda each: abs(each.p - special.p))
                marks.append(self._mark(Special("flutter", near.p, near.error, special.point, special.s)))
            else:
                marks.append(self._mark(special, branch.ended))
        rows = [self._row(point) for point in points]
        return Followed(kind, rows, marks, replace(branch, points=points), problem)

    def _row(self, point: Point) -> Row:
        cycle = point.facts
        return Row(
            self.line.value(point.p),
            cycle.amplitude,
            cycle.frequency,
            cycle.stick_fraction,
            cycle.contact_loss_fraction,
            point.stable,
            tuple(point.multipliers.tolist()),
        )

    def _mark(self, special: Special, ended: Sequence[End] = ()) -> Mark:
        kind = special.name if special.kind == "grazing" else special.kind
        if kind.startswith("sequence"):
            kind = "grazing stick"
        cut = [
            end for end in ended if end.reason == special.name and end.kind in ("points", "seconds", "interrupted")
        ]
        facts, width = special.point.facts, abs(self.line.high - self.line.low)
        return Mark(
            "budget" if special.kind == "end" and cut else kind,
            self.line.value(special.p),
            special.error * width,
            facts.amplitude,
            facts.frequency,
            special.name if special.kind == "end" else "",
        )


def span(followed: Followed) -> tuple[float, float]:
    """The least place and the largest one of a followed branch."""
    assert followed.branch is not None
    places = [point.p for point in followed.branch.points]
    return min(places), max(places)


def crossing(followed: Followed, p: float) -> list[Point]:
    """The motions of a branch at a place of the line."""
    found: list[Point] = []
    if followed.branch is None:
        return found
    newton = Newton(followed.problem, Settings())
    turns = [special.point for special in followed.branch.specials if special.kind == "fold"]
    along = sorted([*followed.branch.points, *turns], key=lambda point: point.s)  # stable, where charts change
    for one, other in pairwise(along):
        if one.chart is not other.chart or not (one.p - p) * (other.p - p) <= 0.0 or one.p == other.p:
            continue
        followed.problem.use(one.chart)
        part = (p - one.p) / (other.p - one.p)
        point = newton.at_parameter(one.z + part * (other.z - one.z), p, other.z - one.z, one.s, exact=True)
        if point is not None:
            found.append(point)
    return found
