"""Periodic motions that the waves of a wheel force on a shoe, as motions that the engine follows.

The unknowns are the states at the begin of each segment of the common period of the waves (multiple shooting). The
gap is the end of each segment less the begin of the next one. States count from steady sliding at the same
parameter, in units of the depth that the load presses the shoe in by. Over the whole range each segment takes
the same number of steps, and the pad has the same cells. So the gap is a smooth function of the parameter as long
as the sequence of phases is the same.
"""

import math
from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from brakecli.analysis.branches.cycles import changed_phases, cyclic
from brakecli.analysis.branches.extent import Extent, extent
from brakecli.analysis.branches.follow import follow
from brakecli.analysis.branches.frame import NO_PERIOD, Frame, frame_of, resting
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Settings, start
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array, Doubled, Evaluation, Guess, Problem, steps_in_p
from brakecli.errors import CaseError
from brakecli.solver.motion.flow import Orbit
from brakecli.solver.motion.rough import STEPS_PER_PERIOD, Flown, RoughFlow, Status
from brakecli.solver.period import common_period
from brakecli.solver.phases import STICK
from brakecli.solver.roughness import surface
from brakecli.solver.system import System
from brakecli.stop import signalled

DIFFERENCE = 1e-6
"""Change of the parameter for derivatives by it, to one side. The rounding of a flow is about 1e-13, so they are
exact to about 1e-6, as is the direction of a branch."""
MOST_PERIODS = 4
"""Common periods in which a motion is sought that repeats; a choice, as flips double them."""
AT_REPEAT = 0.1
"""Distance, in depths, of two states of a run from which Newton's method is begun."""
REASONS = {
    Status.GRAZED: "an event is grazed",
    Status.TOO_MANY_EVENTS: "there are too many events in a segment",
    Status.STALLED: "events do not end",
    Status.NOT_FINITE: "the motion grows without bound",
    Status.STOPPED: "it was interrupted",
}


class _Flown(NamedTuple):
    """All segments of a motion."""

    runs: list[Flown]
    ends: Array  # (segments, 4), scaled
    word: tuple[int, ...]
    period: float


class Forced(Doubled):
    """Motions forced by a rough wheel at constant speed and load, over a range of a parameter."""

    def __init__(self, system: Callable[[float], System], frame: Frame, periods: int = 1) -> None:
        """`system` raises CaseError where a place is invalid; `periods`: common periods until a motion repeats."""
        self.system = system
        self.frame = frame
        self.periods = periods
        self.flow = lru_cache(maxsize=16)(self._flow)
        self.origin = lru_cache(maxsize=64)(frame.origin)

    @classmethod
    def along(cls, line: Line, periods: int = 1, per_period: float = STEPS_PER_PERIOD) -> "Forced":
        """The problem of forced motions along a line of cases, with so many steps to the fastest period.

        Raises CaseError where no place is valid, where speed or load change, and where the waves have no common
        period.
        """
        return cls(line.system, frame_of(line, per_period), periods)

    def of_periods(self, periods: int) -> "Forced":
        """The problem of motions that repeat after so many common periods, with the same steps and cells."""
        return Forced(self.system, self.frame, periods)

    def finer(self, factor: float) -> "list[Problem]":
        """The same motions with so many times more steps, with half of that more, and with more cells."""
        frame = self.frame
        steps = [replace(frame, steps=math.ceil(more * frame.steps)) for more in (factor, 0.5 + 0.5 * factor)]
        cells = replace(frame, cells=2 * math.ceil(0.5 * factor * frame.cells))
        return [Forced(self.system, variant, self.periods) for variant in (*steps, cells)]

    @property
    def segments(self) -> int:
        """Segments of a motion."""
        return self.periods * self.frame.segments

    def _flow(self, p: float) -> tuple[RoughFlow, float]:
        """The flow and the common period (s) at a place; raises CaseError or ValueError where there is none."""
        system = self.system(p)
        period = common_period(system)
        if period is None:
            raise ValueError(NO_PERIOD)
        return RoughFlow(system, self.frame.cells), period

    def _flown(self, u: Array, p: float, derivative: bool = True) -> _Flown | str:
        """The flow over all segments, or why there is none."""
        try:
            flow, period = self.flow(p)
        except (CaseError, ValueError) as error:
            return str(error)
        frame = self.frame
        origin = self.origin(p)
        belt = flow.system.belt_speed
        states = origin + u.reshape(-1, 4) * frame.scales
        length = period / frame.segments
        runs = list[Flown]()
        word = list[int]()
        for k, state in enumerate(states):
            # a segment that sticks ends with just the wheel's velocity, but Newton's method rounds the next begin
            if abs(state[2] - belt) <= 1e-6 * frame.scales[2]:
                state[2] = belt
            if signalled():
                return REASONS[Status.STOPPED]
            run = flow(state, k % frame.segments * length, length, frame.steps, derivative)
            if run.status is not Status.DONE:
                return REASONS[run.status]
            runs.append(run)
            word += run.word[1:] if word and word[-1] == run.word[0] else run.word
        ends = (np.array([run.state for run in runs]) - origin) / frame.scales
        return _Flown(runs, ends, cyclic(tuple(word)), self.periods * period)

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        """Carry the state of each segment to its end; the gaps and their derivatives."""
        flown = self._flown(u, p)
        if isinstance(flown, str):
            return flown
        m = self.segments
        scales = self.frame.scales
        runs = flown.runs
        maps = np.array([run.derivative for run in runs]) * (scales / scales[:, None])
        if not np.isfinite(maps).all():
            return "disturbances grow without bound"
        by_u = np.zeros((m, 4, m, 4))
        for k in range(m):
            by_u[k, :, k] += maps[k]
            by_u[k, :, (k + 1) % m] -= np.eye(4)
        gap = (flown.ends - np.roll(u.reshape(m, 4), -1, axis=0)).ravel()
        by_p = self._by_p(u, p, flown) if with_parameter else None
        facts = self._facts(u, p, flown)
        if with_parameter and by_p is None:
            return "the derivative by the parameter meets a border, or the end of what is valid"
        return Evaluation(
            gap,
            by_u.reshape(4 * m, 4 * m),
            by_p,
            maps,
            flown.word,
            facts,
            self._margins(p, flown),
            facts.amplitude / float(scales[0]),
        )

    def _facts(self, u: Array, p: float, flown: _Flown) -> Orbit:
        runs = flown.runs
        margins = [run.margins for run in runs]
        segment = flown.period / len(runs)
        return Orbit(
            flown.period,
            0.5 * (max(run.x[1] for run in runs) - min(run.x[0] for run in runs)),
            sum(margin.stick_share for margin in margins) / len(runs),
            sum(margin.open_share for margin in margins) / len(runs),
            tuple((self.origin(p) + u[:4] * self.frame.scales).tolist()),
            flown.word,
            tuple(k * segment + time for k, run in enumerate(runs) for time in run.times),
        )

    def extent(self, point: Point) -> Extent:
        """How far the motion of a point reaches, and where it is in the mean."""
        flow, _ = self.flow(point.p)
        motion = point.facts
        states = self.origin(point.p) + point.u.reshape(-1, 4) * self.frame.scales
        length = motion.period / self.segments

        def carry(time: float, state: Array, span: float) -> tuple[Array, Array] | None:
            steps = max(1, round(self.frame.steps * span / length))
            run = flow(state, time, span, steps, False)
            return (run.state, run.velocity) if run.status is Status.DONE else None

        return extent([*states], motion.period, motion.times, self.frame.steps, carry)

    def _margins(self, p: float, flown: _Flown) -> tuple[float, ...]:
        """How far a motion in slip alone is from stick: its least sliding speed over that of the wheel."""
        if len(flown.word) > 1 or flown.word[0] == STICK:
            return ()
        belt = self.flow(p)[0].system.belt_speed
        return (min(run.margins.slide for run in flown.runs) / abs(belt),)

    def _by_p(self, u: Array, p: float, flown: _Flown) -> Array | None:
        """The derivative of the gaps by p, of the same sequence of phases, to the first side that has it."""
        for step in steps_in_p(DIFFERENCE if p < 0.5 else -DIFFERENCE):
            if not 0.0 <= p + step <= 1.0:
                continue
            beside = self._flown(u, p + step, derivative=False)
            if not isinstance(beside, str) and beside.word == flown.word:
                return np.asarray(((beside.ends - flown.ends) / step).ravel())
        return None

    def halved(self, point: Point) -> Array | None:
        """By what half of its common periods moves a motion, if they are an even number."""
        if self.periods % 2:
            return None
        first, second = np.split(point.u, 2)
        return np.asarray(second - first)

    def border(self, before: Hashable, after: Hashable) -> str:
        """What one of two sequences of phases has more of. Lift-off is no border, as the force is continuous."""
        assert isinstance(before, tuple)
        assert isinstance(after, tuple)
        return "sequence of events changes" if before.count(STICK) == after.count(STICK) else "grazing stick"

    def change(self, before: Hashable, after: Hashable) -> str:
        """What begins or ends from one sequence of phases to another."""
        return changed_phases(before, after)

    def double(self, point: Point, vector: Array) -> Guess:
        """The motion of half the periods, twice, displaced along the eigenvector of -1."""
        shifts = [vector]
        for matrix in [*point.maps, *point.maps][:-1]:
            shifts.append(matrix @ shifts[-1])
        return np.tile(point.u, 2), np.append(np.concatenate(shifts), 0.0)

    # --- first points ------------------------------------------------------------------------------------------

    def begin(self, p: float, settings: Settings | None = None) -> Point | None:
        """A motion at p: one that grows with the waves, or else one to which a run from steady sliding comes."""
        point = self.grow(p, settings)
        if point is None:
            run = self.settle(p, self.origin(p), most=self.periods)
            if run is not None and run[0].periods == self.periods:
                point = run[1]
        return point

    def grow(self, p: float, settings: Settings | None = None) -> Point | None:
        """The motion at p that continues steady sliding as the waves grow from nothing; None where that fails.

        It begins with the steady sliding of a smooth wheel.
        """
        try:
            system = self.system(p)
        except CaseError:
            return None
        wheel = system.wheel

        def with_waves(fraction: float) -> System:
            return replace(system, wheel=wheel._replace(g=fraction * wheel.g))

        here = replace(self.frame, origins=self.frame.origin(p)[None, :2])
        problem = Forced(with_waves, here, self.periods)
        smooth = resting(replace(system, wheel=surface()))
        if smooth is None:
            return None
        u = np.tile((smooth - here.origin(0.0)) / here.scales, self.segments)
        first_waves = 1e-3  # part of the amplitude
        first = start(problem, u, first_waves)
        if first is None:
            return None
        # multipliers do not matter on the way
        growing = Settings(low=first_waves, first=0.05, longest=1.0, change=math.inf, seconds=20.0, insertions=0)
        branch = follow(problem, first, 1.0, settings or growing, stop=signalled)
        last = branch.points[-1]
        return start(self, last.u, p) if last.p == 1.0 else None

    def settle(
        self, p: float, state: Array, most: int = MOST_PERIODS, waited: int = 50
    ) -> "tuple[Forced, Point] | None":
        """The motion that a run from a state (x, y, v_x, v_y) at t = 0 comes to, and the problem of its periods.

        The run goes on for `waited` common periods. Then motions of 1, 2, ... and at most `most` of them are
        sought.
        """
        origin = self.origin(p)
        frame = self.frame
        one = self.of_periods(1)
        visited = [(np.asarray(state, float) - origin) / frame.scales]
        for n in range((waited + most) * frame.segments):
            end = one._segment(visited[-1], p, n % frame.segments)
            if end is None or signalled():
                return None
            visited.append(end)
        begin = waited * frame.segments
        gaps = {}
        for count in range(1, most + 1):
            away = visited[begin + count * frame.segments] - visited[begin]
            gaps[count] = max(math.sqrt(away @ away), 1e-7)  # closer states are not told apart
        for count in sorted(gaps, key=lambda count: (gaps[count], count)):
            if not gaps[count] < AT_REPEAT:
                break
            motion = self._repeating(np.concatenate(visited[begin : begin + count * frame.segments]), p, count)
            if motion is not None:
                return motion
        return None

    def _repeating(self, guess: Array, p: float, count: int) -> "tuple[Forced, Point] | None":
        """The motion near a guess of so many common periods, and the problem of the fewest in which it repeats."""
        problem = self.of_periods(count)
        point = start(problem, guess, p)
        if point is None or not float(np.abs(point.u - guess).max()) < 2.0 * AT_REPEAT:
            return None
        for fewer in (divisor for divisor in range(1, count) if count % divisor == 0):
            begin = point.u[: len(point.u) // count * fewer]
            if float(np.abs(np.tile(begin, count // fewer) - point.u).max()) < 1e-6:
                less = self._repeating(begin, p, fewer)
                if less is not None:
                    return less
        return problem, point

    def _segment(self, u: Array, p: float, k: int) -> Array | None:
        """Where a segment ends that begins at a scaled state; None where there is no flow to its end."""
        try:
            flow, period = self.flow(p)
        except (CaseError, ValueError):
            return None
        frame = self.frame
        origin = self.origin(p)
        length = period / frame.segments
        run = flow(origin + u * frame.scales, k * length, length, frame.steps, False)
        return (run.state - origin) / frame.scales if run.status is Status.DONE else None
