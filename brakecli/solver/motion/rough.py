"""The flow on rough pads as Python sees it: a fixed number of steps, with the derivative beside it.

The number of steps does not depend on the state, so the end is a smooth function of the state, of the span and of
the parameters, as long as the sequence of phases is the same.

The contact is that of cells (`contact.cells`), whose force is continuously differentiable. Cells of length c in
which contact begins or ends have an error of order c³, which cancels on average as the edge passes through a cell.
The end of a flow has an error of order c⁴.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, LOAD
from brakecli.solver.coefficients import fastest_decay
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.double_double import two_product
from brakecli.solver.motion import events as ends
from brakecli.solver.motion.tasks import FLY, step
from brakecli.solver.phases import STICK
from brakecli.solver.plant import Plant
from brakecli.solver.records import one
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.system import System

STEPS_PER_PERIOD = 20  # of the fastest mode, or of the shortest wave that passes


class Status(IntEnum):
    """How a flow ended."""

    DONE = ends.DONE
    TOO_MANY_EVENTS = ends.EVENTFUL
    STALLED = ends.STALLED  # events do not end
    NOT_FINITE = ends.LOST
    GRAZED = ends.GRAZED  # a margin becomes zero without passing through it: the flow has no derivative
    STOPPED = ends.INTERRUPTED


@dataclass(frozen=True)
class Margins:
    """How near a flow comes to another sequence of phases, and how its pad touches; infinite where nothing counts.

    `slide`: least sliding speed (m/s) inside phases of slip and at both ends of the span. `hold`: least distance
    (N) of the force that stick takes from the friction cone, as stick begins, inside it, and at both ends of the
    span. `pass_by`: least force (N) by which stick failed where slip reversed. Zeros at events do not count.
    `contact` and `most_contact`: least and largest part of the pad that touches, at the ends of steps.
    `open_share` and `stick_share`: parts of the span in which nothing touches, to half a step, and in which the
    shoe sticks.
    """

    slide: float
    hold: float
    pass_by: float
    contact: float
    most_contact: float
    open_share: float
    stick_share: float


@dataclass(frozen=True)
class Flown:
    """What a flow has come to: state and velocity (its derivative by time) are those of x, y, v_x and v_y.

    `derivative`: of the state by the first state; None where it was not asked for, or where the flow has failed.
    `word`: the phases, `BACKWARD`, `STICK` or `FORWARD`; `times` (s) of the events between them, from the begin.
    `x` and `y`: least and largest (m).
    """

    status: Status
    state: Floats
    derivative: Floats | None
    velocity: Floats
    word: tuple[int, ...]
    times: tuple[float, ...]
    x: tuple[float, float]
    y: tuple[float, float]
    margins: Margins


def default_cells(system: System) -> int:
    """Cells of the pad for the shortest wave of both surfaces."""
    return max(96, math.ceil(24 * 2.0 * system.half_length * system.most_turns))


def default_steps(system: System, span: float, per_period: float = STEPS_PER_PERIOD) -> int:
    """Steps of a span (s), so many to the fastest period, of the shoe in full contact or of a wave that passes.

    There are more where dashpots ask for them: a step must not be long beside the fastest decay.
    """
    fastest = max(system.natural_frequencies[1], system.passing_frequency)
    decays = fastest_decay(system.coefficients) / 2.5  # beyond 3.3 DOPRI5 multiplies what decays
    return max(1, math.ceil(max(per_period * fastest, decays) * span))


class RoughFlow:
    """The flow of a system on rough pads, at constant speed and load; one call after the other."""

    def __init__(self, system: System, cells: int = 0) -> None:
        """Make the tables of so many cells, an even number; 0 takes `default_cells`.

        Raises ValueError where speed or load change, or where cells do not tell the shortest wave.
        """
        if not system.steady:
            raise ValueError("the flow needs a constant speed and a constant load")
        on_cells = system.by(evaluator="cells", nodes=cells or default_cells(system))
        if cells and on_cells.nodes > cells + 1:
            raise ValueError(f"{cells} cells are too few: {on_cells.nodes} are needed")
        self.system = system
        self.cells = on_cells.nodes
        self._plants = one(Plant)
        self._layer = build_layer("cells", on_cells.pad)
        self._belt = system.belt_speed
        self._waves = system.wheel.waves
        self._angles = self._layer.angles
        self._plant: Plant = self._plants[0]
        plant = self._plant
        plant.c = system.coefficients
        plant.layer = self._layer.layer
        plant.runge.on_grid = 1
        plant.runge.pair = 1
        plant.runge.light = 1
        plant.block.z[BELT] = system.belt_speed
        plant.block.z[LOAD] = system.load_at_start

    def __call__(self, state: Floats, begin_time: float, span: float, steps: int, tangents: bool = True) -> Flown:
        """The flow from a state (x, y, v_x, v_y) at a time (s), over a span (s) in so many equal steps."""
        m = self._plant.block
        r = self._plant.runge
        travel, travel_low = two_product(self._belt, begin_time)
        wheel_angles(self._waves, travel, travel_low, self._angles)
        m.z[:4] = state
        m.task = FLY
        m.count = 4 if tangents else 0
        m.seconds = span
        r.steps = steps
        rows = np.zeros((1, 1))  # a flow fills none
        status = Status(step(self._plants, self._layer.tables, self._layer.scratch, rows, rows, 0))
        events = int(m.events)
        return Flown(
            status,
            m.z[:4].copy(),
            m.columns.T.copy() if tangents and status is Status.DONE else None,
            m.velocity.copy(),
            tuple(m.word[: events + 1].tolist()),
            tuple(m.times[:events].tolist()),
            (float(m.low[0]), float(m.high[0])),
            (float(m.low[1]), float(m.high[1])),
            Margins(
                slide=float(r.least_slide),
                hold=float(r.least_hold),
                pass_by=float(r.least_pass),
                contact=float(r.least_contact),
                most_contact=float(r.most_contact),
                open_share=float(r.open) / span,
                stick_share=float(m.spent[STICK]) / span,
            ),
        )
