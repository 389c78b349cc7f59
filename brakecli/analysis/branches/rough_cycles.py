"""Limit cycles of a rough shoe on a smooth wheel, as motions that the engine follows.

All is as on smooth pads, except for the flow. It takes the same number of steps for each period of a chart, so
that the end is a smooth function of the state and of the period. Lift-off is not an event, as the force is
continuous.
"""

import math

import numpy as np

from brakecli.analysis.branches.cycles import Chart, Cycles, Flow, Way
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.problem import Array
from brakecli.errors import CaseError, Problem
from brakecli.solver.motion.events import DONE, EVENTFUL, GRAZED, LONG
from brakecli.solver.motion.rough import RoughFlow, Status, default_cells, default_steps
from brakecli.solver.phases import BACKWARD, OPEN, STICK
from brakecli.solver.steady_sliding import steady_sliding, tabulated


class RoughCycles(Cycles):
    """Limit cycles along a line of cases whose shoe is rough and whose wheel is smooth."""

    def __init__(self, line: Line, periods: int = 1, per_period: float = 80.0) -> None:
        """`periods`: of the motions from which these have been doubled; `per_period`: steps to the fastest period.

        A period is short, and the pad lifts off and lands in few steps: so they are many.

        Raises CaseError where no place is valid, where the wheel is rough, and where speed or load change.
        """
        super().__init__(line, periods)
        systems = line.systems(9).values()
        if any(system.wheel.g.size for system in systems):
            wrong = "the wheel is rough, so no motion repeats but those that its waves force"
            raise CaseError([Problem(("roughness", "wheel"), wrong, "make it smooth", source=line.label)])
        self.per_period = per_period
        self.cells = max(map(default_cells, systems))

    def _flow(self, p: float) -> Flow:
        return Span(RoughFlow(self.line.system(p), self.cells), self.per_period)

    def _equilibrium(self, p: float) -> Array:
        system = self.line.system(p)
        steady = steady_sliding(system, mean=tabulated(system))
        return np.array([steady.x, steady.y, 0.0, 0.0])

    def _over_period(self, flow: Flow, state: Array, periods: float, chart: Chart, derivative: bool) -> int:
        assert isinstance(flow, Span)
        return flow.over(state, periods * chart.time, flow.steps(chart.time), derivative)

    def _fits(self, periods: float) -> bool:
        return 0.6 < periods < 1.6  # the steps of a chart's period are too many below, and too few above

    def _margins(self, p: float, word: tuple[int, ...], low: Array, high: Array) -> tuple[float, ...]:
        if len(word) > 1 or word[0] == STICK:
            return ()
        belt = self.line.shoe(p).belt
        fastest = high[2] if word[0] == BACKWARD else low[2]
        return (abs(1.0 - float(fastest) / belt),) if math.isfinite(fastest) else ()


_ENDS = {Status.DONE: DONE, Status.GRAZED: GRAZED, Status.TOO_MANY_EVENTS: EVENTFUL}


class Span:
    """The flow of a rough shoe on a smooth wheel, which begins at any time."""

    def __init__(self, flow: RoughFlow, per_period: float) -> None:
        """With so many steps to the fastest period."""
        self._flow = flow
        self._per_period = per_period
        self._instant = 1e-12 / flow.system.natural_frequencies[1]

    def __call__(self, state: Array, span: float, tangents: bool = True) -> int:
        """Carry a state over a span (s); see `Flow`."""
        return self.over(state, span, self.steps(span), tangents)

    def steps(self, span: float) -> int:
        """Steps that are enough for a span (s)."""
        return default_steps(self._flow.system, span, self._per_period)

    def over(self, state: Array, span: float, steps: int, tangents: bool) -> int:
        """Carry a state over a span in so many steps."""
        self._begin = np.array(state)
        self._time = span
        run = self._run = self._flow(self._begin, 0.0, span, steps, tangents)
        self.state = run.state
        self.word = run.word
        self.times = run.times
        return _ENDS.get(run.status, LONG)

    @property
    def derivative(self) -> Array:
        """See `Flow`."""
        assert self._run.derivative is not None
        return self._run.derivative

    @property
    def path(self) -> Way:
        """See `Flow`."""
        run = self._run
        belt = self._flow.system.belt_speed
        start = self._flow(self._begin, 0.0, self._instant, 1, False).velocity
        spent = np.zeros(4)
        least = run.margins.slide
        spent[STICK] = run.margins.stick_share * self._time
        spent[OPEN] = run.margins.open_share * self._time
        low = np.array([run.x[0], run.y[0], belt + least])
        high = np.array([run.x[1], run.y[1], belt - least])
        return Way(start, run.velocity, self._time, spent, low, high)
