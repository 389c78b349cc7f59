"""Limit cycles of a shoe on a smooth wheel, as motions that the engine follows.

The unknowns are a state on the cycle and the period T. The gap is the state after T less the state before, and
where the state lies along the cycle: on the plane of a chart across the flow. That takes the place of a section
ẋ = 0, whose crossings appear and vanish along a branch. States count from steady sliding at the same parameter, in
sizes of the motion, so that a branch is straight where the cycle moves along with steady sliding.
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from brakecli.analysis.branches.extent import Extent, extent
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array, Evaluation, Guess, Problem, steps_in_p
from brakecli.errors import CaseError
from brakecli.solver.block import Block
from brakecli.solver.motion.events import DONE, EVENTFUL, GRAZED
from brakecli.solver.motion.flow import Orbit, SmoothFlow
from brakecli.solver.phases import BACKWARD, FORWARD, OPEN, STICK

DIFFERENCE = 3e-6
"""Change of the parameter for derivatives by it. Central ones are exact to 1e-10. A shoe needs that whose dashpots
are so light that a multiplier stays near 1, as the direction of its branch hangs on it. Straddling a border would
mix two motions, so that there they are taken to one side."""
SHIFT = 1e-6
"""Length along the branch by which a point is moved to carry its direction to another chart."""
INSTANT = 1e-12
"""Part of the period that a flow takes at least: it has no step of no length."""


class Way(NamedTuple):
    """The way of a motion through a span (SI units)."""

    start: Array  # the derivative by time at the begin,
    velocity: Array  # and at the end
    time: float
    spent: Array  # in each phase
    low: Array  # of x, y and v_x; v_x counts in slip alone
    high: Array


class Flow(Protocol):
    """What carries a state over a span; what it says is that of the last span. `SmoothFlow` says it in full."""

    @property
    def path(self) -> Way | Block:
        """How it has come there."""

    @property
    def state(self) -> Array:
        """x, y (m), v_x and v_y (m/s) at the end."""

    @property
    def derivative(self) -> Array:
        """Derivative of the end by the begin, (4, 4)."""

    @property
    def word(self) -> tuple[int, ...]:
        """The phases."""

    @property
    def times(self) -> tuple[float, ...]:
        """When they change, s."""

    def __call__(self, state: Array, span: float, tangents: bool = True) -> int:
        """Carry a state over a span (s), with its derivative unless that is not needed; how it ends, as `DONE`."""


@dataclass(frozen=True, eq=False)
class Chart:
    """How unknowns are to be read: the plane through `anchor` across `normal`, scales, time (s), size (m)."""

    anchor: Array
    normal: Array
    scales: Array
    time: float
    size: float
    basis: Array  # (4, 3), of the plane


def cyclic(word: tuple[int, ...]) -> tuple[int, ...]:
    """The phases of a cycle, whichever of them it is read from."""
    word = word[:-1] if len(word) > 1 and word[-1] == word[0] else word
    return min(word[k:] + word[:k] for k in range(len(word)))


NAMES = {STICK: "stick", OPEN: "flight", FORWARD: "slip forwards", BACKWARD: "slip backwards"}
"""Of phases; what stands first is what a change of their sequence is told by."""


def changed_phases(before: Hashable, after: Hashable) -> str:
    """What begins or ends from one sequence of phases to another; empty where only their order changes."""
    assert isinstance(before, tuple)
    assert isinstance(after, tuple)
    for phase, name in NAMES.items():
        there = before.count(phase)
        more = after.count(phase) - there
        if more and not there:
            return f"{name} begins"
        if more:
            often = "once" if abs(more) == 1 else f"{abs(more)} times"
            return f"{name} {often} {'more' if more > 0 else 'less'}" if there + more else f"{name} ends"
    return ""


class Cycles(Problem):
    """Limit cycles along a line of cases on smooth pads."""

    chart: Chart

    def __init__(self, line: Line, periods: int = 1) -> None:
        """`periods`: of the motions from which these have been doubled."""
        self.line = line
        self.periods = periods
        self.flow = lru_cache(maxsize=16)(self._flow)
        self.equilibrium = lru_cache(maxsize=64)(self._equilibrium)

    def of_periods(self, periods: int) -> "Cycles":
        """The problem of motions that repeat after so many periods."""
        return type(self)(self.line, periods)

    def _flow(self, p: float) -> Flow:
        shoe = self.line.shoe(p)
        return SmoothFlow(*shoe)

    def _equilibrium(self, p: float) -> Array:
        """Steady sliding, from which states count."""
        x, y = self.line.shoe(p).rest or (math.nan, math.nan)
        return np.array([x, y, 0.0, 0.0])

    def _over_period(self, flow: Flow, state: Array, periods: float, chart: Chart, derivative: bool) -> int:
        """Carry a state over so many periods of a chart, so that the end is a smooth function of their number."""
        return flow(state, periods * chart.time, derivative)

    def _flown(self, u: Array, p: float, chart: Chart, derivative: bool = True) -> Flow | str:
        """The flow over the period that is sought, or why there is none."""
        periods = u[4]
        if not 1e-3 < periods < 400.0:
            return "the period vanishes, or grows without bound"
        try:
            flow = self.flow(p)
            equilibrium = self.equilibrium(p)
        except CaseError as error:
            return str(error)
        how = self._over_period(flow, equilibrium + u[:4] * chart.scales, periods, chart, derivative)
        if how == DONE:
            return flow
        return {GRAZED: "an event is grazed", EVENTFUL: "there are too many events in a period"}.get(
            how, "the period grows without bound"
        )

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        """Carry the state over the period; the gap, its derivatives and M across the flow."""
        chart = self.chart
        flow = self._flown(u, p, self.chart)
        if isinstance(flow, str):
            return flow
        equilibrium = self.equilibrium(p)
        path = flow.path
        scales = chart.scales
        matrix = flow.derivative * scales / scales[:, None]
        end = (flow.state - equilibrium) / scales
        speed = path.velocity / scales
        by_u = np.zeros((5, 5))
        gap = np.empty(5)
        by_u[:4, :4] = matrix
        by_u[:4, 4] = speed * chart.time
        by_u[4, :4] = chart.normal
        by_u.ravel()[0:24:6] -= 1.0
        gap[:4] = end - u[:4]
        gap[4] = chart.normal @ (u[:4] - chart.anchor)
        across = float(chart.normal @ speed)
        if across == 0.0:
            return "the flow runs along its plane"
        moved = matrix @ chart.basis
        on_plane = moved - (speed / across)[:, None] * (chart.normal @ moved)
        word = flow.word
        spent = path.spent
        period = float(path.time)
        facts = Orbit(
            period,
            0.5 * float(path.high[0] - path.low[0]),
            float(spent[STICK]) / period,
            float(spent[OPEN]) / period,
            tuple((equilibrium + u[:4] * scales).tolist()),
            word,
            flow.times,
        )
        margins = self._margins(p, word, path.low, path.high)
        by_p = self._by_p(u, p, end, word) if with_parameter else None
        if with_parameter and by_p is None:
            return "the derivative by the parameter meets a border, or the end of what is valid"
        return Evaluation(gap, by_u, by_p, (chart.basis.T @ on_plane)[None], cyclic(word), facts, margins)

    def extent(self, point: Point) -> Extent:
        """How far the motion of a point reaches, and where it is in the mean."""
        flow = self.flow(point.p)
        cycle = point.facts

        def carry(_: float, state: Array, span: float) -> tuple[Array, Array] | None:
            how = flow(state, span, False)
            return (flow.state, np.array(flow.path.velocity)) if how == DONE else None

        return extent([np.array(cycle.state)], cycle.period, cycle.times, 64, carry)

    def _by_p(self, u: Array, p: float, end: Array, word: tuple[int, ...]) -> Array | None:
        """The derivative of the gap by p, of the same sequence of events: central, or else to one side."""
        sides = {}
        for step in steps_in_p(DIFFERENCE):
            if not 0.0 <= p + step <= 1.0:
                continue
            flow = self._flown(u, p + step, self.chart, derivative=False)
            if isinstance(flow, str) or flow.word != word:
                continue
            sides[step] = (flow.state - self.equilibrium(p + step)) / self.chart.scales
            if -step in sides:
                return np.append((sides[abs(step)] - sides[-abs(step)]) / (2.0 * abs(step)), 0.0)
        for step, there in sides.items():
            return np.append((there - end) / step, 0.0)
        return None

    def _margins(self, p: float, word: tuple[int, ...], low: Array, high: Array) -> tuple[float, ...]:
        """How far a cycle in slip alone is from stick, and one that does not fly from flight, of order one."""
        margins = []
        belt = self.line.shoe(p).belt
        sliding = BACKWARD if belt > 0.0 else FORWARD
        if not set(word) - {sliding, OPEN}:
            fastest = high[2] if sliding == BACKWARD else low[2]
            margins.append(1.0 - float(fastest) / belt)
        if OPEN not in word:
            margins.append(float(high[1]) / float(self.equilibrium(p)[1]))
        return tuple(margins)

    def chart_at(self, u: Array, p: float, scales: Array, time: float, size: float) -> Chart | None:
        """A chart whose plane lies across the flow at a place; None where nothing moves there."""
        try:
            normal = self._along(u, p, scales, time)
        except CaseError:
            return None
        if normal is None:
            return None
        basis = np.linalg.svd(normal[None])[2][1:].T
        return Chart(u[:4].copy(), normal, scales, time, size, basis)

    def _along(self, u: Array, p: float, scales: Array, time: float) -> Array | None:
        """The direction of the flow at a place, of length one; None where nothing moves there."""
        flow = self.flow(p)
        # nothing turns within so short a time
        flow(self.equilibrium(p) + u[:4] * scales, 1e-9 * time, False)
        speed = flow.path.start / scales
        length = math.sqrt(speed @ speed)
        return speed / length if length > 0.0 else None

    def renew(self, point: Point) -> Guess | None:
        """A chart of the present size, with its anchor far from events, where either has become necessary."""
        cycle = point.facts
        chart = point.chart
        times = cycle.times or (cycle.period,)
        # where an event lies beside the anchor, a border would be seen there
        near = min(times[0], cycle.period - times[-1] if cycle.times else cycle.period) < 0.03 * cycle.period
        grown = cycle.amplitude / chart.size
        if not near and 0.5 < grown < 2.0 and self._fits(float(point.u[4])):
            along = self._along(point.u, point.p, chart.scales, cycle.period)
            if along is not None and chart.normal @ along > 0.9:
                return None
        ahead = _longest_slip(cycle) if near else 0.0
        if ahead is None:
            return None
        scales = chart.scales * grown
        u = self._moved(point.z, chart, ahead, scales, cycle.period)
        beside = self._moved(point.z + SHIFT * point.tangent, chart, ahead, scales, cycle.period)
        if u is None or beside is None:
            return None
        new = self.chart_at(u, point.p, scales, cycle.period, cycle.amplitude)
        if new is None:
            return None
        self.chart = new
        direction = np.append((beside - u) / SHIFT, point.tangent[5])
        speed = new.normal  # of length one: what the plane takes away of the direction lies along it
        direction[:4] -= speed * (new.normal @ direction[:4])
        return u, direction

    def _fits(self, periods: float) -> bool:
        """Whether a chart may be kept with whose time so many periods are made."""
        return True

    def _moved(self, z: Array, chart: Chart, ahead: float, scales: Array, time: float) -> Array | None:
        """A point of a chart, carried ahead (s) by the flow, in other scales."""
        p = min(max(float(z[5]), 0.0), 1.0)
        state = self.equilibrium(p) + z[:4] * chart.scales
        if ahead > 0.0:
            flow = self.flow(p)
            if flow(state, ahead, False) != DONE:
                return None
            state = flow.state
        return np.append((state - self.equilibrium(p)) / scales, z[4] * chart.time / time)

    def carry(self, point: Point, chart: Chart) -> Guess | None:
        """A point in another chart: the place where its cycle passes that plane nearest to the chart's anchor."""
        cycle = point.facts
        flow = self.flow(point.p)
        equilibrium = self.equilibrium(point.p)
        state = np.array(cycle.state)
        best = (math.inf, 0.0)
        for fraction in np.linspace(0.0, 1.0, 257)[:-1]:  # fine enough for Newton's method; a choice
            if flow(state, max(fraction, INSTANT) * cycle.period, False) != DONE:
                return None
            off = (flow.state - equilibrium) / chart.scales - chart.anchor
            best = min(best, (float(off @ off), float(fraction)))
        ahead = best[1] * cycle.period
        for _ in range(8):  # Newton's method for the time at which the plane is passed
            if flow(state, max(ahead % cycle.period, INSTANT * cycle.period), False) != DONE:
                return None
            off = (flow.state - equilibrium) / chart.scales - chart.anchor
            speed = flow.path.velocity / chart.scales
            ahead -= float(chart.normal @ off) / float(chart.normal @ speed)
        ahead %= cycle.period
        if flow(state, max(ahead, INSTANT * cycle.period), False) != DONE:
            return None
        u = np.append((flow.state - equilibrium) / chart.scales, cycle.period / chart.time)
        beside = self._moved(point.z + SHIFT * point.tangent, point.chart, ahead, chart.scales, chart.time)
        if beside is None:
            return None
        direction = np.append((beside - u) / SHIFT, point.tangent[5])
        speed = flow.path.velocity / chart.scales
        direction[:4] -= speed * (chart.normal @ direction[:4]) / (chart.normal @ speed)
        return u, direction

    def halved(self, point: Point) -> Array | None:
        """By what half of its period moves a motion that has been doubled, in the scales of its chart."""
        if self.periods % 2:
            return None
        state = np.array(point.facts.state)
        flow = self.flow(point.p)
        if self._over_period(flow, state, 0.5 * float(point.u[4]), point.chart, derivative=False) != DONE:
            return None
        return np.asarray((flow.state - state) / point.chart.scales)

    def border(self, before: Hashable, after: Hashable) -> str:
        """What one of two sequences of phases has more of: stick, or flight."""
        assert isinstance(before, tuple)
        assert isinstance(after, tuple)
        changes = [(after.count(phase) - before.count(phase), phase) for phase in (STICK, OPEN)]
        if changes[1][0]:
            return "grazing flight"
        return "grazing stick" if changes[0][0] or before != after else "sequence of events changes"

    def change(self, before: Hashable, after: Hashable) -> str:
        """What begins or ends from one sequence of phases to another."""
        return changed_phases(before, after)

    def double(self, point: Point, vector: Array) -> Guess:
        """The motion of twice the period, displaced along the eigenvector of -1."""
        self.chart = replace(point.chart, time=2.0 * point.chart.time)
        return point.u, np.append(point.chart.basis @ vector, [0.0, 0.0])


def _longest_slip(cycle: Orbit) -> float | None:
    """The time (s) from the anchor to the middle of the longest phase in which the shoe does not stick."""
    times = [*cycle.times, cycle.period + (cycle.times[0] if cycle.times else 0.0)]
    spans = [(times[k + 1] - times[k], times[k]) for k in range(len(cycle.times)) if cycle.word[k + 1] != STICK]
    if not spans:
        return None
    length, begin = max(spans)
    return (begin + 0.5 * length) % cycle.period
