"""What a motion comes to in the end: steady sliding, or a vibration, from which a branch may begin."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from brakecli.analysis.stability.modes import eigensystem, slowest_of_cycles
from brakecli.branches.cycles import Cycles
from brakecli.branches.line import Shoe
from brakecli.branches.newton import start
from brakecli.branches.point import Point
from brakecli.branches.problem import Array
from brakecli.solver.flow.repeating import Orbit
from brakecli.solver.flow.rough import RoughFlow, Status, default_steps
from brakecli.solver.flow.seek import FOUND, LINEAR, Pursuit
from brakecli.solver.flow.smooth import DONE
from brakecli.solver.period import common_period
from brakecli.solver.system import System
from brakecli.stop import signalled

MOST_STEPS = 5_000_000
"""Steps of a motion on smooth pads after which it is given up: about half a second."""

NEARS = 1.0
"""Powers of e by which a disturbance of unstable sliding may grow without an event, of a motion that nears it."""

AHEAD = 10_000
"""Steps without an event, at least, of such a motion."""

SPAN = 10.0
"""Periods of the slowest mode, at least, in a span of whole common periods, at whose ends motions on rough pads
are compared. The waves and the shoe's own vibration meet in many ways within it."""
MOST_ROUGH_STEPS = 2_000_000
"""Steps of a motion on rough pads after which it is given up."""
FOLLOWS = 0.5
"""Part of what a disturbance loses in a span, by which its size may differ from that of a linear one."""
TURNS = 0.25
"""Part of its size by which a disturbance may differ at the end from a linear one."""
IN_A_ROW = 3
"""Spans over which a motion has to obey them: one that lasts may do so in one of them, by chance."""
AT_CALM = 1e-9
"""Distance from a calm motion, over the compression of the pad, that is rounding."""
KEPT = 0.99
"""Part of its distance from all calm motions that a vibration which lasts keeps in a time twice as long."""
DRIFTS, STILL = 4.0, 1e-6
"""Standard errors of its slope beyond which that distance falls, and a fall that is none. Beside a value at which
a vibration vanishes a motion keeps nearly all of its distance for long, but it falls steadily."""
SETTLING = 1.0
"""Powers of e by which the dashpots shrink a disturbance of a vibration before its distances are compared."""
NOTICED = 0.2
"""The same of the slowest disturbance of a calm motion: one that fades a twentieth as fast is seen to fade."""

SETTLE, SEEN = 400, 8
"""Periods of the mode for which a motion of a rough shoe is left to itself, and in which returns are sought."""
LOOKS = 60
"""Places of a period at which the motion is looked at."""
RETURNS = 0.25
"""Distance, in sizes of the motion, of a state from an earlier one that may be the same."""
TRIES = 12
"""Pairs of states from which Newton's method is begun."""
AT_REST = 1e-3
"""Size of a motion, over the compression of the pad, below which it has died out."""


class End(NamedTuple):
    """What a motion comes to: whether vibration `lasts`, None where that is not known.

    `state`: x, y, v_x and v_y on the vibration, at t = 0 of the waves; `orbit` where it is a limit cycle, and the
    `rate` (1/s) at which its slowest disturbance fades.
    """

    lasts: bool | None
    state: Array | None = None
    orbit: Orbit | None = None
    rate: float | None = None


FADES, UNKNOWN = End(False), End(None)


def on_smooth_pads(shoe: Shoe, state: Array, longest: float = math.inf) -> End:
    """What the motion from a state (x, y, v_x, v_y) comes to at constant speed and load, in a `longest` time (s).

    It fades once its modes can bring about no event any more, and lasts once it nears an orbit that attracts it.
    Where sliding is unstable it cannot fade; one that is still vibrating when it is given up has a `state`.
    """
    c, stiffness, belt, load = shoe
    if shoe.rest is None or not shoe.rest[1] < 0.0:  # it locks, or would hang off the wheel
        return UNKNOWN
    values, shapes = eigensystem(c, stiffness, math.copysign(c.phi, belt))
    modes = values, np.concatenate([shapes, shapes * values])
    try:
        motion = Pursuit(c, (stiffness, belt, load), state, np.array(shoe.rest), modes)
    except np.linalg.LinAlgError:  # modes that are alike
        return UNKNOWN
    rate = float(values.real.max())
    while motion.path.steps < MOST_STEPS and motion.way.time < longest and not signalled():
        if rate > 0.0:  # near steady sliding nothing happens for long, as a disturbance grows slowly
            motion.way.duration = motion.way.time + max(NEARS / rate, AHEAD * motion.path.h)
        outcome = motion.seek()
        if outcome == LINEAR:
            return UNKNOWN if rate > 0.0 else FADES
        if outcome == FOUND and motion.multiplier < 1.0:
            rate = -math.log(max(motion.multiplier, 1e-300)) / motion.orbit.period
            return End(True, np.array(motion.orbit.state), motion.orbit, rate)
        motion.way.events = 0  # many between two falls are too many for a cycle, not for a motion
    return End(None) if rate <= 0.0 else End(None, motion.state)


class _Span:
    """The flow of rough pads over whole common periods, which begins at t = 0 of the waves.

    Where the wheel is smooth no time is different from another.
    """

    def __init__(self, system: System) -> None:
        self.flow, slow = RoughFlow(system), system.natural_frequencies[0]
        period = common_period(system) or SPAN / slow
        self.length = period * math.ceil(SPAN / (slow * period))
        self.parts = math.ceil(self.length * slow)
        self.steps = default_steps(system, self.length / self.parts)
        self.taken = 0
        c = system.coefficients
        self.weights = np.zeros((4, 4))  # of twice the energy
        self.weights[:2, :2] = [[c.c_xx, c.c_xy], [c.c_xy, c.c_yy + system.contact_stiffness]]
        self.weights[2, 2] = self.weights[3, 3] = c.m
        self.scales = 1.0 / np.sqrt(np.diag(self.weights))
        depth = abs(system.load_at_start) / (c.c_yy + system.contact_stiffness)
        self.rounding = AT_CALM * depth / self.scales[1]

    def __call__(self, state: Array, tangents: bool) -> tuple[Array, Array] | None:
        """The states at the ends of all parts, and the derivative of the last one; None where there is no flow."""
        states, matrix, length = [state], np.eye(4), self.length / self.parts
        for part in range(self.parts):
            run = self.flow(states[-1], part * length, length, self.steps, tangents)
            if run.status is not Status.DONE or signalled():
                return None
            states.append(run.state)
            matrix = matrix if run.derivative is None else run.derivative @ matrix
        self.taken += self.parts * self.steps
        return np.array(states), matrix


class _Calm:
    """A stable motion that is no vibration, over a span, and what becomes of disturbances of it."""

    def __init__(self, span: _Span, states: Array, matrix: Array) -> None:
        self.span, self.states = span, states
        self.factors, vectors = np.linalg.eig(matrix * span.scales / span.scales[:, None])
        self.radius = float(np.abs(self.factors).max())
        self.to_modes = np.linalg.inv(vectors) / span.scales

    def attracts(self, states: Array) -> bool:
        """Whether a motion obeys, over the span, the linear equations of disturbances, which die out.

        The sizes of modes are theirs but for less than what they lose, however little that is. A mode of a larger
        vibration turns a little faster or slower.
        """
        begin, end = (self.to_modes @ (states[k] - self.states[k]) for k in (0, -1))
        said, size = self.factors * begin, float(np.abs(end).sum())
        off = float(np.abs(np.abs(end) - np.abs(said)).sum())
        turned = float(np.abs(end - said).sum())
        loss = (1.0 - self.radius) * size  # of the slowest modes, which are those at the end
        rounding = self.span.rounding
        return self.radius < 1.0 and off <= FOLLOWS * loss + rounding and turned <= TURNS * size + rounding

    def distance(self, states: Array) -> float:
        """The largest distance of a motion within the span, as the root of twice the energy that it takes."""
        apart = states - self.states
        return math.sqrt(float(np.einsum("ni,ij,nj->n", apart, self.span.weights, apart).max()))


def on_rough_pads(system: System, state: Array, calm: Sequence[Array], longest: float = math.inf) -> End:
    """What the motion from a state at t = 0 comes to, at constant speed and load, in a `longest` time (s).

    `calm`: states at t = 0 of the stable motions that are no vibrations: of steady sliding on a smooth wheel, else
    of what the waves force. The motion fades once it follows the linear equations of one of them. It lasts once
    it has kept its distance from all of them in a time twice as long. Unknown without any of them.
    """
    span, known = _Span(system), list[_Calm]()
    for each in calm:
        flown = span(np.array(each, float), True)
        if flown is None:
            return UNKNOWN
        try:
            known.append(_Calm(span, *flown))
        except np.linalg.LinAlgError:  # disturbances that are alike
            return UNKNOWN
    last, far, drawn = np.array(state, float), list[float](), 0
    spans = [SETTLING / (slowest_of_cycles(system.coefficients) * span.length)]
    spans += [NOTICED / -math.log(each.radius) for each in known if 0.0 < each.radius < 1.0]
    while known and span.taken < MOST_ROUGH_STEPS and len(far) * span.length < longest:
        flown = span(last, False)
        if flown is None:
            break
        drawn = drawn + 1 if any(each.attracts(flown[0]) for each in known) else 0
        if drawn == IN_A_ROW:
            return FADES
        last = flown[0][-1]
        far.append(min(each.distance(flown[0]) for each in known))
        quarter, rest = divmod(len(far), 4)
        whole = rest == 0 and quarter & (quarter - 1) == 0  # 4, 8, 16 … spans
        kept = whole and max(far[2 * quarter :]) >= KEPT * max(far[quarter : 2 * quarter])
        if kept and quarter >= max(spans) and not _falls(far[quarter:]):
            return End(True, last)
    return UNKNOWN


def _falls(far: list[float]) -> bool:
    """Whether distances fall from span to span, by a line through the logarithms of the means of eighths."""
    means = [math.log(float(np.mean(part))) for part in np.array_split(far, min(len(far), 8))]
    places = np.arange(len(means)) - 0.5 * (len(means) - 1)
    slope, square = float(places @ means / (places @ places)), float(places @ places)
    rest = np.array(means) - np.mean(means) - slope * places
    error = math.sqrt(float(rest @ rest) / (len(means) - 2) / square)
    return slope < -max(DRIFTS * error, STILL / len(means))


def settled(problem: Cycles, p: float, state: Array, frequency: float) -> Point | None:
    """The cycle that the motion from a state (x, y, v_x, v_y) comes to at p.

    None where the motion dies out, or where no cycle is found. On rough shoes the cycle is sought among motions
    whose frequency is about as given (Hz).
    """
    if not problem.line.smooth:
        return _returning(problem, p, state, frequency)
    end, flow = on_smooth_pads(problem.line.shoe(p), state), problem.flow(p)
    if end.orbit is None:
        return None
    state, period = np.array(end.orbit.state), end.orbit.period
    if flow(state, period, False) != DONE:
        return None
    sizes = 0.5 * (flow.path.high - flow.path.low)
    omega = 2.0 * math.pi / period
    scales = float(sizes[:2].max()) * np.array([1.0, 1.0, omega, omega])
    return _started(problem, p, state, period, scales, period, float(sizes[0]))


def _started(
    problem: Cycles, p: float, state: Array, period: float, scales: Array, time: float, x: float
) -> Point | None:
    """The cycle near a state and a period (s), in a chart of these scales, time (s) and size (m)."""
    u = np.append((state - problem.rest(p)) / scales, period / time)
    chart = problem.chart_at(u, p, scales, time, x)
    if chart is None:
        return None
    problem.use(chart)
    return start(problem, u, p)


def _returning(problem: Cycles, p: float, state: Array, frequency: float) -> Point | None:
    """The cycle of a rough shoe whose motion returns to itself."""
    flow, rest, period = problem.flow(p), problem.rest(p), 1.0 / frequency
    states = [np.array(state, float)]
    for k in range(SETTLE * 4 + SEEN * LOOKS):
        if flow(states[-1], period * (0.25 if k < SETTLE * 4 else 1.0 / LOOKS), False) != DONE:
            return None
        states = [flow.state] if k < SETTLE * 4 else [*states, flow.state]
    seen = np.array(states)
    size = 0.5 * float(np.ptp(seen[:, :2], axis=0).max())
    if not size > AT_REST * abs(rest[1]):
        return None
    omega = 2.0 * math.pi * frequency
    scales, x = size * np.array([1.0, 1.0, omega, omega]), 0.5 * float(np.ptp(seen[:, 0]))
    belt = problem.line.shoe(p).belt
    places = [k for k in range(LOOKS) if abs(seen[k, 2] - belt) > 0.05 * abs(belt)]
    tries = 0
    for k in places[:: max(len(places) // 4, 1)]:
        away = np.abs((seen - seen[k]) / scales).max(axis=1)
        for j in range(k + LOOKS // 5, len(seen) - 1):
            if not (away[j] < RETURNS and away[j - 1] >= away[j] <= away[j + 1]):
                continue
            tries += 1
            if tries > TRIES:
                return None
            point = _started(problem, p, seen[k], (j - k) / LOOKS * period, scales, period, x)
            if point is not None and point.facts.amplitude > 0.3 * x:
                return point
    return None
