"""All branches of a case along a line: steady sliding, and the motions that are born where it loses stability."""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import pairwise
from time import perf_counter

import numpy as np

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.follow import Stop, both_ways, follow
from brakecli.analysis.branches.forced import MOST_PERIODS, Forced
from brakecli.analysis.branches.islands import PARTS, Search, places, try_pushes
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import LEFT, OFF, Newton, Settings
from brakecli.analysis.branches.point import Branch, Point, cubic
from brakecli.analysis.branches.problem import Array, Problem
from brakecli.analysis.branches.rough_cycles import RoughCycles
from brakecli.analysis.branches.rows import FORCED, IN_SLIDING, LIMIT_CYCLE, Followed, Mark, of_branch, of_sliding
from brakecli.analysis.branches.sliding import Change, Slide, Sliding
from brakecli.analysis.branches.stable_parts import unstable_spans
from brakecli.analysis.branches.starts import settle
from brakecli.analysis.branches.switch import crossing_sheet, switch
from brakecli.analysis.stability.modes import is_undamped
from brakecli.analysis.stability.search import bisect
from brakecli.errors import CaseError

SMALLEST = 0.5
"""Amplitude over that at the begin below which a cycle of a rough shoe ends in steady sliding."""
LARGEST = 1e4
"""Amplitude of a cycle over that at the begin of its branch, beyond which it is not followed."""
MOST = 12
"""Branches of one command."""
MOST_PUSHED = 4
"""Of these, such as pushes come to: each costs as much as a branch from flutter."""
MEETS = 16
"""Motions of a branch that are looked for on another one; a choice."""
LONGEST = 0.25
"""Longest stride, in sizes of the motion and of the range."""
POINTS = 3000
ALL_POINTS = 10_000
SECONDS = 60.0
"""Budgets: of points of one branch and of all of them, and of time."""
GROWING_POINTS = 300
"""Budget of points in which the waves grow to their size; a choice."""
GROWN_AT: tuple[float, ...] = 0.0, 1.0, 0.5, 0.25, 0.75
"""Places of the line at which a forced motion is sought that grows with the waves, where none is known yet."""
NEAR = 1e-6
NOTHING = 1e-12
"""Parts of the way between two points to which a place between them is guessed, and found; choices."""
SAME = 1e-6
"""Relative difference of amplitude and period by which two motions at one value are the same."""
LARGE = "its amplitude is ten thousand times that of its begin"
UNDAMPED = "no dashpot damps the shoe: all multipliers stay on the unit circle, so that no limit cycle is followed"


@dataclass(frozen=True)
class Explored:
    """What there is along a line."""

    line: Line
    slides: list[Slide]
    changes: list[Change]
    branches: list[Followed]
    notes: list[str]
    interrupted: bool = False
    search: Search = field(default_factory=Search)
    unfollowed: list[float] = field(default_factory=list)  # places of motions beside branches, by the budget


Tell = Callable[[str, int, int], None]


class Explorer:
    """Follows one branch after another, within a budget of time, until it is stopped."""

    def __init__(
        self,
        line: Line,
        tell: Tell,
        stop: Stop = lambda: False,
        seconds: float = SECONDS,
        points: int = ALL_POINTS,
    ) -> None:
        """Look at steady sliding, and at the waves. What takes longer is left to `explore`.

        `tell` shows how many points there are; `stop` ends the work, and keeps what was found.

        The budget of `points` is that of all branches; that of `seconds` is for a user who waits. Where the same
        bytes must come out again, it is infinite.
        """
        self.line = line
        self.tell = tell
        self.stop = stop
        self.end = perf_counter() + seconds
        self.count = 0
        self.points = points
        self.sliding = Sliding(line)
        self.slides = self.sliding.along()
        self.changes = self.sliding.changes(self.slides)
        self.branches: list[Followed] = []
        self.notes: list[str] = []
        self.search = Search()
        self.unfollowed: list[float] = []
        self.waves = None if line.case.roughness.wheel is None else self._waves()

    def explore(
        self, states: Sequence[tuple[float, Array]] = (), switches: bool = False, pushes: int = 0
    ) -> Explored:
        """Follow everything: from flutter, from given states (p and state), and from flips if that is wanted.

        On smooth pads vibrations beside these are sought by five times so many `pushes`.
        """
        self.branches.append(of_sliding(self.sliding, self.slides, self.changes))
        if not self.branches[0].points:
            self.notes.insert(0, "there is no steady sliding in the range")
        if self.line.case.roughness.wheel is not None:
            self._forced()
        else:
            self._cycles(self.sliding, self.changes)
        for p, state in states:
            self.begin_at(p, state)
        if switches:
            self._doubled()
        if pushes and self.line.smooth and not is_undamped(self.line.case_coefficients):
            self._islands(pushes)
        return self.explored

    @property
    def explored(self) -> Explored:
        """What has been found so far."""
        return Explored(
            line=self.line,
            slides=self.slides,
            changes=self.changes,
            branches=[*self.branches],
            notes=[*self.notes],
            interrupted=bool(self.stop()),
            search=self.search,
            unfollowed=[*self.unfollowed],
        )

    def begin_at(self, p: float, state: Array) -> None:
        """Follow the branch of the motion that a state at a place comes to, if it is not known."""
        if self.line.case.roughness.wheel is None:
            if not self._over() and not is_undamped(self.line.case_coefficients):
                self._from_state(self.sliding, p, state)
        elif self.waves is not None:
            self._forced_from(self.waves, p, state)

    def _follow(
        self,
        problem: Cycles | Forced,
        first: Point,
        kind: str = LIMIT_CYCLE,
        note: str = "",
        *,
        within: bool = False,
        change: Change | None = None,
        changes: Sequence[Change] = (),
    ) -> None:
        """Follow the branch of a motion along its tangent, or both ways if it lies `within` it."""
        how = self._settings(), self._until(problem, first), self.stop, self._known(problem)
        branch = both_ways(problem, first, *how) if within else follow(problem, first, None, *how)
        followed = replace(of_branch(self.line, branch, problem, kind, change, changes), note=note)
        self.branches.append(replace(followed, unstable=cache(partial(self._unstable, followed))))
        for other in [*branch.aside, *(crossed(problem, branch) if kind == FORCED else [])]:
            if any(passes(followed, other) for followed in self.branches):
                continue
            if self._over():
                self.unfollowed.append(other.p)
                value = self.line.value(other.p)
                self.notes.append(f"a motion beside a branch at {value:.6g} was not followed any more")
            else:
                self._follow(problem, other, kind, note, within=True)

    def _known(self, problem: Problem) -> list[Point]:
        """The points of the branches of a problem."""
        same = [followed.branch for followed in self.branches if followed.problem is problem]
        return [point for branch in same if branch is not None for point in branch.points]

    def _unstable(self, followed: Followed) -> list[tuple[float, float]]:
        return [(self.line.value(low), self.line.value(high)) for low, high in unstable_spans(followed)]

    def _settings(self) -> Settings:
        seconds = max(self.end - perf_counter(), 0.0)
        return Settings(longest=LONGEST, points=min(POINTS, max(self.points - self.count, 0)), seconds=seconds)

    def _until(self, problem: Problem, first: Point) -> Callable[[Point], str | None]:
        """Ends a branch that has come back to steady sliding, or grown beyond all bounds."""
        begun = first.facts.amplitude
        smooth = self.line.smooth
        away = [False]
        cycles = isinstance(problem, Cycles)

        def until(point: Point) -> str | None:
            self.count += 1
            self.tell("points of branches", self.count, 0)
            amplitude = point.facts.amplitude
            if cycles:
                slips = len(set(point.facts.word)) == 1
                if away[0] and slips and (smooth or amplitude < SMALLEST * begun):
                    return IN_SLIDING
                # on smooth pads slip alone is linear; a rough shoe slips in larger cycles, too
                away[0] |= not slips or (amplitude > begun and not smooth)
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
            if any(
                mark.kind == "flutter" and mark.motion.value == self.line.value(change.p) for mark in self._marks()
            ):
                continue  # a branch from another flutter has ended here
            problem = self._problem()
            first = sliding.vibration(problem, change)
            value = self.line.value(change.p)
            if first is None:
                self.notes.append(f"no limit cycle was found at the flutter at {value:.6g}")
                continue
            self._follow(problem, first, change=change, changes=changes)

    def _waves(self) -> Forced | None:
        """The problem of motions that a rough wheel forces; None where there are none that repeat."""
        try:
            return Forced.along(self.line)
        except CaseError as error:
            self.notes.append("; ".join(f"{problem.what}; {problem.remedy}" for problem in error.problems))
            return None

    def _forced(self) -> None:
        """Motions that a rough wheel forces: those that grow with the waves."""
        problem = self.waves
        if problem is None:
            return
        for p in GROWN_AT:
            if self._over() or any(low <= p <= high for low, high in map(span, self.branches[1:])):
                continue
            first = problem.begin(p, replace(self._settings(), points=GROWING_POINTS))
            if first is not None:
                self._follow(problem, first, FORCED, within=True)
        if len(self.branches) == 1 and not self.stop():
            self.notes.append("no motion was found that the waves force")

    def _forced_from(self, problem: Forced, p: float, state: Array) -> None:
        """The branch of the forced motion that a run comes to; none where it is known already."""
        value = self.line.value(p)
        motion = None if self._over() else problem.settle(p, state)
        if motion is None:
            self.notes.append(f"the motion given for {value:.6g} comes to no periodic motion")
        elif self._is_followed(motion[1]):
            self.notes.append(f"the motion given for {value:.6g} comes to one of a branch that is known")
        else:
            self._follow(*motion, FORCED, f"from the motion given for {value:.6g}", within=True)

    def _is_followed(self, first: Point) -> bool:
        """Whether a motion lies on a branch that has been followed, perhaps as several of its periods."""
        return any(lies_on(followed, first) for followed in self.branches)

    def _from_state(self, sliding: Sliding, p: float, state: Array) -> None:
        """The branch of the cycle that a motion comes to; none where it is known already."""
        values = sliding.at(p).eigenvalues
        frequency = 0.0
        if values is not None:
            least_stable = abs(float(values[int(np.argmax(values.real))].imag))
            frequency = (least_stable or float(np.abs(values.imag).max())) / (2.0 * math.pi)
        value = self.line.value(p)
        problem = self._problem()
        first = settle(problem, p, state, frequency) if frequency else None
        if first is None:
            self.notes.append(f"the motion given for {value:.6g} comes to no limit cycle")
            return
        if self._is_followed(first):
            self.notes.append(f"the motion given for {value:.6g} comes to a cycle of a branch from flutter")
            return
        self._follow(problem, first, note=f"from the motion given for {value:.6g}", within=True)

    def _islands(self, pushes: int) -> None:
        """The branches of cycles that pushes come to, if they are not known: each within the whole budget."""
        begun = perf_counter()
        search = self.search
        budget = self.points
        most = len(self.branches) + MOST_PUSHED
        own = None if self.line.own is None else self.line.place(self.line.own)
        for p, first, count in places(self.slides, self.changes, own, pushes):
            if self.stop() or perf_counter() > self.end:
                break
            self.tell("pushes", first, PARTS * pushes)
            ends = try_pushes(self.line.shoe(p), first, count, self.stop)
            search.pushes += ends.pushes
            search.undecided += ends.undecided
            for orbit in ends.orbits:
                self.points = self.count + budget
                self._from_push(p, np.array(orbit.state), most)
        search.seconds = perf_counter() - begun

    def _from_push(self, p: float, state: Array, most: int) -> None:
        """The branch of the cycle that a push has come to, among so many; none where it is known already."""
        value = self.line.value(p)
        problem = self._problem()
        first = settle(problem, p, state, math.nan)
        if first is not None and self._is_followed(first):
            return
        if first is None or self._over() or len(self.branches) >= most:
            self.notes.append(f"a vibration that a push at {value:.4g} comes to was not followed")
        else:
            self._follow(problem, first, note=f"from a push at {value:.6g}", within=True)
            *others, followed = self.branches
            if not any(meets(followed, other) for other in others):
                self.search.islands.append(followed)

    def _problem(self) -> Cycles:
        return Cycles(self.line) if self.line.smooth else RoughCycles(self.line)

    def _marks(self) -> list[Mark]:
        return [mark for followed in self.branches if followed.kind == LIMIT_CYCLE for mark in followed.special]

    def _over(self) -> bool:
        spent = perf_counter() > self.end or self.count >= self.points
        return self.stop() or spent or len(self.branches) >= MOST

    def _doubled(self) -> None:
        """The motions of twice the period that are born at flips."""
        for origin in list(self.branches):
            if origin.branch is None or origin.problem is None:
                continue
            for special in origin.branch.specials:
                if special.kind != "flip" or self._over():
                    continue
                problem = origin.problem.of_periods(2 * origin.problem.periods)
                first = switch(problem, special.point, self._settings())
                value = self.line.value(special.p)
                if first is None:
                    self.notes.append(f"no motion of twice the period was found at the flip at {value:.6g}")
                    continue
                if self._is_followed(first):
                    continue  # the branch from another flip has ended here
                self._follow(problem, first, origin.kind, f"twice the period, from the flip at {value:.6g}")


def span(followed: Followed) -> tuple[float, float]:
    """The least place and the largest one of a followed branch: at its folds, where it turns there."""
    branch = followed.branch
    assert branch is not None
    places = [point.p for point in branch.points] + [special.p for special in branch.specials]
    return min(places), max(places)


def crossed(problem: Problem, branch: Branch) -> list[Point]:
    """Motions of the sheets that a branch crosses at its branch points."""
    newton = Newton(problem, Settings())
    motions: list[Point] = []
    for special in branch.specials:
        if special.kind == "branch point":
            k = bisect_left(branch.points, special.s, 1, len(branch.points) - 1, key=lambda point: point.s)
            way = branch.points[k].z - branch.points[k - 1].z
            motions += crossing_sheet(newton, special.point, way)
    return motions


def lies_on(followed: Followed, motion: Point) -> bool:
    """Whether a motion is one of a branch, perhaps as several of its periods."""
    other = motion.facts
    return any(
        math.isclose(one.amplitude, other.amplitude, rel_tol=SAME)
        and any(math.isclose(k * one.period, other.period, rel_tol=SAME) for k in range(1, MOST_PERIODS + 1))
        for one in (point.facts for point in crossing(followed, motion.p))
    )


def meets(one: Followed, other: Followed) -> bool:
    """Whether a branch goes on as another one, which was cut somewhere: some of its motions lie on that."""
    points = one.branch.points if one.branch is not None else []
    return any(lies_on(other, point) for point in points[:: max(len(points) // MEETS, 1)])


def passes(followed: Followed, motion: Point) -> bool:
    """Whether a branch passes through a motion: there, in the plane across its chord that holds the motion."""
    problem = followed.problem
    if followed.branch is None or problem is None:
        return False
    newton = Newton(problem, Settings())
    for one, other in pairwise(followed.branch.points):
        if one.chart is not motion.chart or other.chart is not motion.chart:
            continue
        chord = other.z - one.z
        length = math.sqrt(chord @ chord)
        ahead = chord @ (motion.z - one.z)
        behind = chord @ (other.z - motion.z)
        if ahead < 0.0 or behind < 0.0 or length == 0.0:
            continue
        fraction = _across(one, other, motion, chord)
        if np.linalg.norm(cubic(one, other, fraction) - motion.z) > LEFT * length + OFF:
            continue
        problem.use(one.chart)
        point = newton.between(one, other, fraction)
        if point is not None and np.linalg.norm(point.z - motion.z) < SAME:
            return True
    return False


def _across(one: Point, other: Point, motion: Point, chord: Array) -> float:
    """The part of the way between two neighbours at which their cubic is level with a motion."""
    fraction, _ = bisect(lambda t: bool(chord @ (cubic(one, other, t) - motion.z) < 0.0), 0.0, 1.0, width=NOTHING)
    return fraction


def crossing(followed: Followed, p: float) -> list[Point]:
    """The motions of a branch at a place of the line."""
    motions: list[Point] = []
    problem = followed.problem
    if followed.branch is None or problem is None:
        return motions
    newton = Newton(problem, Settings())
    turns = [special.point for special in followed.branch.specials if special.kind == "fold"]
    along = sorted([*followed.branch.points, *turns], key=lambda point: point.s)  # stable, where charts change
    for one, other in pairwise(along):
        if one.chart is not other.chart or not (one.p - p) * (other.p - p) <= 0.0 or one.p == other.p:
            continue
        problem.use(one.chart)
        guess = _near(one, other, p)
        point = newton.at_parameter(guess, p, other.z - one.z, one.s, exact=True)
        if point is not None:
            motions.append(point)
    return motions


def _near(one: Point, other: Point, p: float) -> Array:
    """About where a branch passes a place of the line between two neighbours, by the cubic through them."""
    fraction, _ = bisect(lambda t: bool(cubic(one, other, t)[-1] < p) is (one.p < p), 0.0, 1.0, width=NEAR)
    return cubic(one, other, fraction)
