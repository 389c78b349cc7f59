"""A case's motion: the start, the loop in blocks, and what the loop has counted."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import InitialState, Start
from brakecli.case.system import Setup
from brakecli.solver import implicit_step, schemes
from brakecli.solver.contact import KINDS
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.energy import OPEN_ACCOUNT, EnergyAccount, account
from brakecli.solver.friction import minimise
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.records import COUNTS, PROBLEM, WORK, Plant, new
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.steady_sliding import equilibrium, mean_contact

EVENTS = 1000
"""How many unconverged steps are kept with their time and residual; all are counted."""
BLOCK_SECONDS = 0.1
"""Time that one call of the compiled loop should take: between calls Ctrl-C is heard and progress is reported."""
BLOCK_ROWS = 16384


@dataclass
class Work:
    """What a run has cost and how it ended."""

    failure: Failure = Failure.NONE
    failure_time: float | None = None  # s
    steps: int = 0
    contact_evaluations: int = 0
    unconverged_steps: int = 0
    non_unique_steps: int = 0
    most_evaluations: int = 0  # of one step
    turns: int = 0  # steps after which friction points the other way, or holds
    evaluators: dict[str, int] = field(default_factory=dict)  # steps that each evaluator took
    solve_seconds: float = 0.0
    unconverged: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))  # time (s), residual (N)


class Motion:
    """The motion of one case from its start on; `run` steps it to the end.

    It holds all that the loop changes, so that a run may be cut into blocks anywhere without changing a bit.
    """

    def __init__(self, setup: Setup) -> None:
        """Put the shoe at its start."""
        self.setup = setup
        self.work = Work()
        self.events = np.zeros((EVENTS, 2))
        solve = implicit_step.newton if setup.case.solver.iteration == "newton" else implicit_step.fixed_point
        self.plant = Plant(
            c=setup.coefficients,
            s=setup.weights,
            grid=setup.grid,
            drive=setup.drive,
            layer=build_layer(setup.evaluate, setup.pad),
            plug=schemes.plug(setup.scheme, solve),
            state=new(setup.scheme.STATE),
            problem=new(PROBLEM),
            work=new(WORK),
            counts=new(COUNTS),
        )
        self.counts = self.plant.counts
        self.counts.level = setup.scheme.LAG
        self._loop = schemes.loop(setup.scheme)
        self._begin()
        self._start_energy = self._energy()

    def run(
        self,
        sink: Callable[[NDArray[np.float64]], None],
        progress: Callable[[int], None] = lambda steps: None,
        *,
        first_block: int = 1,
    ) -> tuple[Work, EnergyAccount]:
        """Step to the end or to a failure; give every block of samples (rows of `model.HISTORY`) to `sink`.

        `progress` is told the steps done after each block. `first_block` (steps) is one where it is not known what
        a step costs; each block adds some 0.1 ms of its own to `solve_seconds`.
        """
        lag, last = self.setup.scheme.LAG, self.setup.timing.steps
        size = min(first_block, self._most_steps())
        while self.work.failure is Failure.NONE and self.counts.level < last + lag:
            start = time.perf_counter()
            rows = self._block(min(last + lag, int(self.counts.level) + size))
            seconds = time.perf_counter() - start
            self.work.solve_seconds += seconds
            size = min(int(size * min(10.0, BLOCK_SECONDS / max(seconds, 1e-9))) + 1, self._most_steps())
            sink(rows)
            progress(int(self.counts.level) - lag)
        if self.work.failure is Failure.NONE:
            sink(self._sample()[None, :])
        self._count()
        energy = account(self._start_energy, self._energy(), self.plant.work)
        if self.work.failure is Failure.NONE and not abs(energy.relative_closing_error) <= OPEN_ACCOUNT:
            self.work.failure = Failure.UNBALANCED
        return self.work, energy

    def _most_steps(self) -> int:
        """Steps whose samples fit into a block."""
        return BLOCK_ROWS * self.setup.timing.per_sample

    def _block(self, stop: int) -> NDArray[np.float64]:
        """Step to level `stop`; the samples on the way."""
        setup, lag, per_sample = self.setup, self.setup.scheme.LAG, self.setup.timing.per_sample
        first = int(self.counts.level) - lag
        rows = np.zeros((-(-(stop - lag) // per_sample) + (-first // per_sample), len(HISTORY)))
        failure = self._loop.advance(self.plant, rows, self.events, stop)
        self.work.failure = Failure(failure)
        done = int(self.counts.level) - lag
        if failure:
            self.work.failure_time = setup.timing.step * done
            done += 1  # the sample of the failing step's own level has been taken
        return rows[: -(-done // per_sample) + (-first // per_sample)]

    def _sample(self) -> NDArray[np.float64]:
        """The sample at the level that has been reached."""
        row = np.zeros(len(HISTORY))
        self._loop.sample(self.plant, row)
        return row

    def _begin(self) -> None:
        """Fill the state at the scheme's first level, with the contact force there as the first guess."""
        setup, initial = self.setup, self.setup.case.initial
        x, y = initial.x, initial.y
        if initial.at is InitialState.EQUILIBRIUM:
            load = float(value_at(setup.load, 0.0))
            mean = partial(mean_contact, setup.evaluate, setup.pad, setup.wheel)
            rest = equilibrium(setup.coefficients, mean, setup.pad, load, setup.belt_speed)
            x, y = x + rest.x, y + rest.y
        velocity, acceleration = (initial.vx, initial.vy), (0.0, 0.0)
        self._evaluate_at(x, y, 0.0)
        plant, contact = self.plant, self.plant.layer.contact
        if setup.case.solver.start is Start.CONSISTENT:
            acceleration = self._acceleration((x, y), velocity, contact.normal_force)
        setup.scheme.begin(setup.weights, plant.state, (x, y), velocity, acceleration)
        plant.state.force = plant.work.force_before = contact.normal_force
        plant.work.store_x_before = contact.store_x

    def _acceleration(
        self, position: tuple[float, float], velocity: tuple[float, float], force: float
    ) -> tuple[float, float]:
        """(ẍ, ÿ) of (6)-(7) at t = 0; where the shoe moves with the wheel, friction decides as in a step."""
        c, (x, y), (v_x, v_y) = self.setup.coefficients, position, velocity
        load = float(value_at(self.setup.load, 0.0))
        g_1 = -(c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + load * c.sin_beta)
        g_2 = force - (c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + load * c.cos_beta)
        sliding = v_x - self.setup.belt_speed
        if sliding != 0.0:
            return (g_1 - np.sign(sliding) * c.phi * force) / c.m, g_2 / c.m
        belt_acceleration = float(slope_at(self.setup.belt, 0.0))
        a_x, a_y, _ = minimise(c.m, 0.0, c.m, g_1, g_2, c.phi * force, belt_acceleration)
        return a_x, a_y

    def _evaluate_at(self, x: float, y: float, steps: float) -> None:
        """Evaluate the contact, `steps` steps after t = 0."""
        t, part = divmod(steps, self.setup.timing.per_sample)
        travel = integral_at(self.setup.belt, t * self.setup.timing.interval, part * self.setup.timing.step)
        wheel_angles(self.plant.drive.wheel, *travel, self.plant.layer.angles)
        self.setup.evaluate(x, y, self.plant.layer)

    def _energy(self) -> tuple[float, float, float]:
        """Kinetic energy, energy of the links and of the contact (J), where the scheme places them."""
        setup, plant = self.setup, self.plant
        kinetic, links, (x, y), back = setup.scheme.mechanical_energy(plant.c, plant.s, plant.state)
        self._evaluate_at(x, y, int(self.counts.level) - back)
        return kinetic, links, float(plant.layer.contact.store)

    def _count(self) -> None:
        """Read the loop's counters."""
        counts, work = self.counts, self.work
        work.steps = int(counts.kinds.sum())
        work.contact_evaluations = int(counts.evaluations)
        work.unconverged_steps = int(counts.unconverged)
        work.non_unique_steps = int(counts.rising)
        work.most_evaluations = int(counts.most)
        work.turns = int(counts.turns)
        work.evaluators = {kind: int(n) for kind, n in zip(KINDS, counts.kinds, strict=True) if n}
        work.unconverged = self.events[: min(work.unconverged_steps, EVENTS)].copy()
