"""What points of a sweep cost: a few of them, drawn over the whole grid, are computed and timed.

Formulas know the steps of a run, but not how many runs keep a tolerance, which points leave the lanes, what a
verdict takes, nor whether it comes early. All this changes over a grid, and its corners do not show it. Nothing
that a sweep writes depends on these times.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from time import process_time

from brakecli.analysis.stability.linear import Theory
from brakecli.runs.cost import stability_seconds
from brakecli.runs.limits import Check, within_range
from brakecli.runs.price import measured
from brakecli.runs.settled import Judged
from brakecli.runs.together import TOGETHER, certify_together, loops
from brakecli.solver.integrate import Motion
from brakecli.solver.lanes.records import LANES
from brakecli.solver.system import MOST_STEPS
from brakecli.sweeps.early import may_be_early
from brakecli.sweeps.plan import Plan
from brakecli.sweeps.point import FAULTS, Begun, begun, computed, followed
from brakecli.sweeps.simulate import judged, judged_together, may_suffice

SECONDS = 1.0
"""Processor time (s) after which no further place is drawn. Other programs do not change it."""
PART = 0.05  # of the time of the sweep, as far as it is known, that the pilot may take
START_SECONDS = 0.7  # of the command, until it loads kernels, and to end
WORKER_SECONDS = 1.3  # that its workers take to start, until they load kernels
MOST_LOADING = 1.5  # s, which both take to load kernels: what takes longer has compiled them, and stays
LONGEST = 0.3  # guessed time (s) of a point beyond which its run is only begun
# places
FEWEST = 3
MOST = 32
_ROUNDS = 60  # after which an iteration that at least halves its error has come to rounding
DRAWN = 0.25  # of the points, at most
LOADING = 2  # neighbours that load the kernels of lanes
APART = 4  # neighbours that are computed where few share a loop
FOLLOWED = 3  # points at a place of a line, the first of which starts like no other
UNEVEN = 3.0  # time of the most expensive place over the mean, beyond which others may well cost more yet


@dataclass
class Pilot:
    """What the points that were drawn have cost."""

    plan: Plan
    workers: int  # none where this process computes the points
    with_searches: bool
    times: list[float] = field(default_factory=list)  # processor time (s) of a point, at each place
    points: list[int] = field(default_factory=list)  # that were looked at
    together: int = 1  # points that are computed side by side
    samples: int = 0  # of a history, at most
    guess: float = 0.0  # s of a point that was looked at, at most, by formulas
    in_lanes: int = 0  # points that have begun in lanes,
    alone: int = 0  # and how many of them were not certified there
    begun: bool = False  # runs were only begun, and may take longer
    start: float = START_SECONDS  # s, beside the points
    loading: float = 0.0  # s, of kernels

    @property
    def seconds(self) -> float:
        """Mean processor time (s) of a point."""
        return sum(self.times) / max(len(self.times), 1)

    @property
    def at_least(self) -> bool:
        """Whether points that were not drawn may well cost more."""
        mixed = 0 < self.alone < self.in_lanes
        return mixed or self.begun or max(self.times, default=0.0) > UNEVEN * self.seconds > 0.0

    def sweep_seconds(self, each: float) -> float:
        """The time (s) of the sweep where a point takes `each`: no unit is shared by two workers."""
        start = self.start + self.loading + (WORKER_SECONDS + self.loading) * bool(self.workers)
        return start + math.ceil(self.plan.units / max(self.workers, 1)) * self.plan.unit_length * each

    def look(self) -> None:
        """Draw places and compute their points until that has taken its time."""
        plan = self.plan
        spent = 0.0
        shape = plan.shape or (1,) if plan.followed is None else (plan.units, plan.unit_length)
        enough = max(1.0, DRAWN * math.prod(shape))
        for place in itertools.islice(drawn(shape), MOST):
            if not self.times:  # the kernels are loaded first
                begin = process_time()
                self._place(shape, place, most=LOADING)
                self.loading += min(process_time() - begin, MOST_LOADING)
                self.points.clear()
            begin = process_time()
            seconds = self._place(shape, place)
            if seconds > UNEVEN * max(self.times, default=math.inf):  # kernels may have been loaded there
                looked_at = len(self.points)
                begin = process_time()
                again = self._place(shape, place)
                self.loading += min(max(seconds - again, 0.0), MOST_LOADING)
                seconds = min(seconds, again)
                del self.points[looked_at:]
            self.times.append(seconds)
            spent += process_time() - begin
            limit = min(SECONDS, PART * self.sweep_seconds(self.seconds))
            few = len(self.times) < FEWEST and spent < SECONDS
            if len(self.points) >= enough or (spent >= limit and not few):
                break
        self.start += spent

    def _place(self, shape: Sequence[int], place: Sequence[int], most: int = LANES) -> float:
        """The processor time (s) of a point at a place; one that fails takes none."""
        with suppress(*FAULTS):
            if self.plan.followed is not None:
                return self._line(*place)
            at = 0
            for number, size in zip(place, shape, strict=True):
                at = at * size + number
            return self._block(at, most)
        return 0.0

    def _block(self, at: int, most: int) -> float:
        """Processor time (s) of a point among neighbours that are computed side by side with it.

        As many as a task holds share loops of lanes, which take as long where lanes are empty.
        """
        task = max(1, min(TOGETHER, self.plan.units // self.workers))
        begin = process_time()
        middle = begun(self.plan, self.plan.settings(at))
        in_lanes = isinstance(middle, Begun) and loops([middle.check.system])
        task_loops = 0
        others = list[Begun]()
        if in_lanes:
            self.together = task
            others = self._begun(at, task)
            task_loops = loops([each.check.system for each in others])
        prepared = (process_time() - begin) / max(len(others), 1)
        size = min(most, task if 2 * task_loops <= len(others) else APART) if in_lanes else 1
        ready = self._begun(at, size)
        systems = [each.check.system for each in ready]
        self.points += range(self._first(at, size), self._first(at, size) + size)
        self.samples = max([self.samples, *(system.samples for system in systems)])
        self.guess = max([self.guess, *(each.check.seconds for each in ready)])
        begin = process_time()
        with within_range():
            certified = certify_together(systems, may_suffice)
        climbed = (process_time() - begin) / max(loops(systems), 1) * task_loops / max(len(others), 1)
        begin = process_time()
        alone = list[Begun]()
        with within_range():
            known = judged_together(systems, certified)
        for each, (found, theory) in zip(ready, known, strict=True):
            if found is None:
                alone.append(each)
            else:
                self._point(each, found, theory)
        seconds = process_time() - begin
        if in_lanes:
            self.in_lanes = self.in_lanes + len(ready)
            self.alone = self.alone + len(alone)
        if alone:
            seconds += len(alone) * self._alone(alone[len(alone) // 2])
        return prepared + climbed + seconds / size

    def _first(self, at: int, size: int) -> int:
        """The first of so many neighbours."""
        return max(0, min(at - size // 2, self.plan.units - size))

    def _begun(self, at: int, size: int) -> list[Begun]:
        """So many neighbours, without those that fail."""
        first = self._first(at, size)
        points = (begun(self.plan, self.plan.settings(each)) for each in range(first, first + size))
        return [each for each in points if isinstance(each, Begun)]

    def _line(self, unit: int, at: int) -> float:
        """Processor time (s) of a point that is followed along a line, from some place of it on."""
        plan = self.plan
        size = self.plan.unit_length
        inner = math.prod(plan.shape[(plan.followed or 0) + 1 :])
        outer, rest = divmod(unit % (plan.points // size), inner)
        first = max(0, min(at, size - FOLLOWED))
        points = [(outer * size + place) * inner + rest for place in range(first, min(first + FOLLOWED, size))]
        self.points += points
        start = begun(plan, plan.settings(points[0]))
        if not isinstance(start, Begun):
            return 0.0
        self.samples = max(self.samples, start.check.system.samples)
        self.guess = max(self.guess, start.check.seconds)
        if self._guess(start.check) > LONGEST:
            return self._alone(start)
        times = list[float]()
        records = followed(plan, points)
        for _ in points:
            begin = process_time()
            next(records)
            times.append(process_time() - begin)
        others = times[1:] or times
        return sum(others) / len(others)

    def _alone(self, point: Begun) -> float:
        """The processor time (s) of a point by itself; one that seems long is only begun."""
        system = point.check.system
        if self._guess(point.check) > LONGEST:
            self.begun |= not system.smooth
            price = measured(system) if system.steps <= MOST_STEPS else None
            if price is None:
                self.begun = True
                return self._guess(point.check)
            self.begun |= price.at_least
            return price.seconds
        begin = process_time()
        self._point(point)
        return process_time() - begin

    def _guess(self, check: Check) -> float:
        """A guess at the time (s) of a point."""
        searches = self.with_searches and self.plan.sweep.critical is not None
        searched = stability_seconds(check.system) if searches else 0.0
        return searched + (0.0 if may_be_early(check.system) else check.seconds)

    def _point(self, point: Begun, known: Judged[Motion] | None = None, theory: Theory | None = None) -> None:
        if self.with_searches:
            computed(self.plan, point, known, theory)
            return
        with suppress(*FAULTS):
            judged(point.case, point.check, known, theory, whole=False)


def drawn(shape: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Places of a grid that fill it evenly, however many are taken; the first one lies in its middle.

    They are multiples of the powers of 1/g, without their whole parts, where g^(d+1) = g + 1 in d dimensions: in
    one it is the golden ratio.
    """
    g = 2.0
    for _ in range(_ROUNDS):
        g = (1.0 + g) ** (1.0 / (len(shape) + 1))
    for n in itertools.count():
        parts = ((0.5 + n * g ** -(axis + 1)) % 1.0 for axis in range(len(shape)))
        yield tuple(min(int(part * size), size - 1) for part, size in zip(parts, shape, strict=True))
