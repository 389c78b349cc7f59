"""What a motion on rough pads comes to in the end: it fades, or it keeps its distance from all that is calm."""

import math
from collections.abc import Sequence

import numpy as np

from brakecli.analysis.stability.modes import slowest_of_cycles
from brakecli.solver.arrays import Floats
from brakecli.solver.motion.rough import RoughFlow, Status, default_steps
from brakecli.solver.period import common_period
from brakecli.solver.system import System
from brakecli.stop import signalled

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
NOTICED = 0.2
"""Powers of e by which the slowest disturbance of a calm motion fades before distances are compared. One that
fades a twentieth as fast is seen to fade."""


def lasts_on_rough_pads(
    system: System, state: Floats, calm: Sequence[Floats], within: float = math.inf
) -> tuple[bool | None, Floats, int]:
    """Whether the motion from a state at t = 0 lasts, at constant speed and load; its last state, and its steps.

    `calm`: states at t = 0 of the stable motions that are no vibrations: of steady sliding on a smooth wheel, else
    of what the waves force. The motion fades once it follows the linear equations of one of them. It lasts once
    it has kept its distance from all of them in a time twice as long. None without any of them, and where neither
    is seen within some time (s).
    """
    span = _Span(system)
    motions = list[_Calm]()
    for begin in calm:
        flown = span(np.array(begin, float), True)
        if flown is None:
            return None, state, span.taken
        try:
            motions.append(_Calm(span, *flown))
        except np.linalg.LinAlgError:  # disturbances that are alike
            return None, state, span.taken
    last = np.array(state, float)
    far = list[float]()
    drawn = 0
    # within a quarter of the time the dashpots shrink a disturbance of a vibration by a factor of e
    spans = [1.0 / (slowest_of_cycles(system.coefficients) * span.length)]
    spans += [NOTICED / -math.log(motion.radius) for motion in motions if 0.0 < motion.radius < 1.0]
    while motions and span.taken < MOST_ROUGH_STEPS and len(far) * span.length < within:
        flown = span(last, False)
        if flown is None:
            break
        drawn = drawn + 1 if any(motion.attracts(flown[0]) for motion in motions) else 0
        if drawn == IN_A_ROW:
            return False, flown[0][-1], span.taken
        last = flown[0][-1]
        far.append(min(motion.distance(flown[0]) for motion in motions))
        quarter, remainder = divmod(len(far), 4)
        whole = remainder == 0 and quarter & (quarter - 1) == 0  # 4, 8, 16 … spans
        keeps = whole and max(far[2 * quarter :]) >= 0.99 * max(far[quarter : 2 * quarter])
        if keeps and quarter >= max(spans) and not _falls(far[quarter:]):
            return True, last, span.taken
    return None, last, span.taken


def _falls(far: list[float]) -> bool:
    """Whether distances fall from span to span, by a line through the logarithms of the means of eighths.

    Beside a value at which a vibration vanishes a motion keeps nearly all of its distance for long, but it falls
    steadily.
    """
    means = [math.log(float(np.mean(eighth))) for eighth in np.array_split(far, min(len(far), 8))]
    places = np.arange(len(means)) - 0.5 * (len(means) - 1)
    slope = float(places @ means / (places @ places))
    square = float(places @ places)
    residual = np.array(means) - np.mean(means) - slope * places
    error = math.sqrt(float(residual @ residual) / (len(means) - 2) / square)
    return slope < -max(4.0 * error, 1e-6 / len(means))  # standard errors, and a fall that is none


class _Span:
    """The flow of rough pads over whole common periods, which begins at t = 0 of the waves.

    Where the wheel is smooth no time is different from another.
    """

    def __init__(self, system: System) -> None:
        self.flow = RoughFlow(system)
        slow = system.natural_frequencies[0]
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
        self.rounding = 1e-9 * depth / self.scales[1]

    def __call__(self, state: Floats, tangents: bool) -> tuple[Floats, Floats] | None:
        """The states at the ends of all parts, and the derivative of the last one; None where there is no flow."""
        states = [state]
        matrix = np.eye(4)
        length = self.length / self.parts
        for k in range(self.parts):
            run = self.flow(states[-1], k * length, length, self.steps, tangents)
            if run.status is not Status.DONE or signalled():
                return None
            states.append(run.state)
            matrix = matrix if run.derivative is None else run.derivative @ matrix
        self.taken += self.parts * self.steps
        return np.array(states), matrix


class _Calm:
    """A stable motion that is no vibration, over a span, and what becomes of disturbances of it."""

    def __init__(self, span: _Span, states: Floats, matrix: Floats) -> None:
        self.span = span
        self.states = states
        self.factors, vectors = np.linalg.eig(matrix * span.scales / span.scales[:, None])
        self.radius = float(np.abs(self.factors).max())
        self.to_modes = np.linalg.inv(vectors) / span.scales

    def attracts(self, states: Floats) -> bool:
        """Whether a motion obeys, over the span, the linear equations of disturbances, which die out.

        The sizes of modes are theirs but for less than what they lose, however little that is. A mode of a larger
        vibration turns a little faster or slower.
        """
        begin, end = (self.to_modes @ (states[k] - self.states[k]) for k in (0, -1))
        said = self.factors * begin
        size = float(np.abs(end).sum())
        off = float(np.abs(np.abs(end) - np.abs(said)).sum())
        turned = float(np.abs(end - said).sum())
        loss = (1.0 - self.radius) * size  # of the slowest modes, which are those at the end
        rounding = self.span.rounding
        return self.radius < 1.0 and off <= FOLLOWS * loss + rounding and turned <= TURNS * size + rounding

    def distance(self, states: Floats) -> float:
        """The largest distance of a motion within the span, as the root of twice the energy that it takes."""
        apart = states - self.states
        return math.sqrt(float(np.einsum("ni,ij,nj->n", apart, self.span.weights, apart).max()))
