"""A motion: the start, the loop in blocks, and what the loop has counted."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from brakecli.solver import contact
from brakecli.solver.arrays import Floats
from brakecli.solver.block import BY_NODES, BY_STEPS
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.energy import OPEN_ACCOUNT, EnergyAccount, account
from brakecli.solver.friction import minimise
from brakecli.solver.method import Method
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.records import EVENT, MOST_EVENTS, Drive, Pair, one
from brakecli.solver.roughness import turn_wheel
from brakecli.solver.schedules import Schedule, integral_at, slope_at
from brakecli.solver.steady_sliding import off_by_nodes, steady_sliding
from brakecli.solver.steps.loop import advance, load, take_sample
from brakecli.solver.system import System
from brakecli.solver.tangent import FEWEST_SAMPLES, MOST_POWERS, Exponent, exponents, seed
from brakecli.solver.track import Track, follow, tracked
from brakecli.stop import check_signals

EVENTS = 1000
"""How many unconverged steps are kept with their time and residual; all are counted."""
BLOCK_SECONDS = 0.1
"""Time that one call of the compiled loop should take: between calls Ctrl-C is heard and progress is reported."""
BLOCK_ROWS = 16384

Sink = Callable[[Floats], None]
Progress = Callable[[int], None]
Counted = Callable[[str, int, int], None]
"""Called with what is counted, how many are done, and of how many; 0 where that is not known."""


@dataclass
class Work:
    """What a run has cost and how it ended."""

    failure: Failure = Failure.NONE
    failure_time: float | None = None  # s
    steps: int = 0
    coarser_steps: int = 0  # of the runs before it that did not keep a tolerance, or showed that it does
    contact_evaluations: int = 0
    unconverged_steps: int = 0
    non_unique_steps: int = 0
    most_evaluations: int = 0  # of one step
    evaluators: dict[str, int] = field(default_factory=dict)  # steps that each evaluator took
    solve_seconds: float = 0.0
    rounding: tuple[Floats, Floats] | None = None  # of exact steps: largest x, y, vx and vy and their errors by it
    unconverged: Floats = field(default_factory=lambda: np.zeros((0, 2)))  # time (s), residual (N)

    @property
    def failed(self) -> bool:
        """Whether the run ended before its time, or is not worth having."""
        return self.failure is not Failure.NONE

    @property
    def all_steps(self) -> int:
        """Steps of all runs that a tolerance has taken."""
        return self.steps + self.coarser_steps

    @property
    def failure_sentence(self) -> str | None:
        """The failure with its time, where it has one, and what to do."""
        when = f"t = {self.failure_time:.6g} s: " if self.failure_time is not None else ""
        return when + self.failure.sentence if self.failed else None


class OwnError(NamedTuple):
    """What a run knows of its error: the largest of each component in each span of the run (m, m/s)."""

    worst: Floats  # spans, by steps, by nodes and their sum, x y vx vy
    unsure: float  # s, from which on it may be another, as an event may have been missed; infinite where none
    amplification: float | None  # of a small disturbance of the start, at most, where one is carried along


@dataclass(frozen=True)
class Motion:
    """A finished motion: its system with the method used, its samples (rows of `quantities.HISTORY`), its cost.

    `rows` is empty where the samples went elsewhere.
    """

    system: System
    rows: Floats
    work: Work
    energy: EnergyAccount
    exponent: Exponent | None = None  # of small disturbances, where they are carried along
    track: Track | None = None  # works of parts, and events, where the loop notes them
    own: OwnError | None = None  # where it is carried along


def solve(
    system: System,
    method: Method | None = None,
    *,
    sink: Sink | None = None,
    progress: Progress = lambda steps: None,
    first_block: int = 1,
) -> Motion:
    """Compute the motion of a system by a method, or by the system's own.

    Every block of samples goes to `sink` where there is one. `progress` receives the steps done after each block.
    `first_block` (steps) is 1 where it is not known what a step costs; each block adds some 0.1 ms of its own to
    `solve_seconds`.
    """
    return Stepping(replace(system, method=method) if method else system).run(sink, progress, first_block)


class Stepping:
    """The motion of a system from its start on; `run` steps it to the end.

    It holds all that the loop changes, so that a run may be cut into blocks anywhere without changing a bit.
    """

    def __init__(self, system: System) -> None:
        """Put the shoe at its start; raises RefusedError where the way to the end is too long."""
        system.refuse_steps(0.0)
        self.system = system
        self.scheme = load(system.method.scheme)
        self.work = Work()
        self.events = np.zeros((EVENTS, 2))
        drive = system.belt, system.load
        self._event_room = EVENT * MOST_EVENTS if system.tracked else 0
        room = sum(map(len, drive)) + self._event_room
        self.contact = build_layer(system.evaluator, system.pad, moving=True, room=room)
        plants = one(Plant)
        self.plant: Plant = plants[0]
        plant = self.plant
        plant.c = system.coefficients
        plant.s = system.weights
        plant.grid = system.grid
        plant.layer = self.contact.layer
        self._put_schedules(plant.drive, *drive)
        self._arrays = plants, self.contact.tables, self.contact.scratch
        self._layer = plant.layer, self.contact.tables, self.contact.scratch
        self.state = getattr(plant, self.scheme.KEPT)
        self._advance = getattr(self.scheme, "advance", advance)
        self.counts = plant.counts
        self.counts.level = self.scheme.LAG
        self.tangent = plant.tangent
        self.tangent.rate = 2.0 * math.pi * system.natural_frequencies[1]
        self._carries = system.tangents and system.method.own_steps
        if self._carries:
            seed(self.tangent)
        self._off = (0.0, 0.0)
        self._begin()
        if system.start_error is not None:
            self.tangent.knows = 1
            self.tangent.unsure = math.inf
            self.tangent.moved = math.inf
            plant.block.columns[BY_STEPS, :2] = system.start_error
            plant.block.columns[BY_NODES, :2] = self._off
            self.tangent.most = system.most_error
        if system.tracked:
            follow(self.plant.track, self.state.v_x, int(plant.drive.load_end))
        self._start_energy = self._energy()

    def run(
        self, sink: Sink | None = None, progress: Progress = lambda steps: None, first_block: int = 1
    ) -> Motion:
        """Step to the end or to a failure; the arguments are those of `solve`."""
        self.system.refuse_steps(0.0 if sink else 8.0 * len(HISTORY) * self.system.samples)
        lag = self.scheme.LAG
        work = self.work
        blocks = [np.zeros((0, len(HISTORY)))]
        sink = sink or blocks.append
        last = self.system.steps + lag
        most = BLOCK_ROWS * self.system.per_sample
        size = min(16384 if self.system.method.row.exact else first_block, most)  # exact steps are far below a µs
        while not work.failed and self.counts.level < last:
            start = time.perf_counter()
            rows = self.block(min(last, int(self.counts.level) + size))
            seconds = time.perf_counter() - start
            work.solve_seconds += seconds
            # no block is more than ten times as large as the one before, whose time may have been chance
            size = min(int(size * min(10.0, BLOCK_SECONDS / max(seconds, 1e-9))) + 1, most)
            check_signals()
            sink(rows)
            progress(int(self.counts.level) - lag)
        if not work.failed:
            sink(self.last_row()[None, :])
        self._count()
        end = self._energy()
        light = self.system.method.own_steps and self.system.nodes > 0  # see `forces.settle`
        if light:
            self.plant.work.roughness += end[2] - self._start_energy[2]
        energy = account(self._start_energy, end, self.plant.work)
        if not work.failed and not abs(energy.relative_closing_error) <= OPEN_ACCOUNT:
            work.failure = Failure.UNBALANCED
        carried = self._carries and not work.failed and self.system.samples >= FEWEST_SAMPLES
        exponent = exponents(self.tangent.logs[:, None], self.system.sampled_duration)[0] if carried else None
        track = None
        if self.system.tracked:
            track = tracked(
                self.plant.track,
                self.contact.scratch,
                self.plant.c,
                self.plant.s,
                self.scheme.mechanical_energy,
                light,
            )
        own = None
        if self.tangent.knows == 1:
            grown = (
                math.exp(min(max(0.0, float(np.cumsum(self.tangent.logs).max())), MOST_POWERS))
                if carried
                else None
            )
            own = OwnError(self.tangent.worst.copy(), float(self.tangent.unsure), grown)
        return Motion(self.system, np.concatenate(blocks), work, energy, exponent, track, own)

    def block(self, stop: int) -> Floats:
        """Step to level `stop`, or to the next sample where steps are the scheme's own; the samples on the way."""
        system = self.system
        lag = self.scheme.LAG
        per_sample = self.system.per_sample
        if system.method.own_steps:
            stop = -(-stop // per_sample) * per_sample
        first = int(self.counts.level) - lag
        rows = np.empty((-(-(stop - lag) // per_sample) + (-first // per_sample), len(HISTORY)))
        failure = self._advance(*self._arrays, rows, self.events, stop)
        done = int(self.counts.level) - lag
        if failure:
            self.work.failure = Failure(failure)
            self.work.failure_time = system.step * done
            done += 1  # the sample of the failing step's own level has been taken
        return rows if done == stop - lag else rows[: -(-done // per_sample) + (-first // per_sample)]

    def _put_schedules(self, drive: Drive, belt: Schedule, load: Schedule) -> None:
        """Put the knots of speed and load behind what the contact takes of the scratch; events follow them."""
        scratch = self.contact.scratch
        drive.load_end = len(scratch) - self._event_room
        drive.belt_end = drive.load_at = drive.load_end - len(load)
        drive.belt_at = drive.belt_end - len(belt)
        scratch[drive.belt_at : drive.belt_end] = belt
        scratch[drive.load_at : drive.load_end] = load

    def last_row(self) -> Floats:
        """The sample at the last level."""
        if self.system.method.own_steps:
            return np.array(self.state.row)
        row = np.zeros(len(HISTORY))
        take_sample(self.plant, self.contact.tables, self.contact.scratch, row)
        return row

    def _begin(self) -> None:
        """Fill the state at the scheme's first level, with the contact force there as the first guess."""
        system = self.system
        initial = self.system.initial
        plant = self.plant
        x = initial.x
        y = initial.y
        if initial.from_equilibrium:
            equilibrium = steady_sliding(system)
            x = x + equilibrium.x
            y = y + equilibrium.y
            if system.start_error is not None:
                self._off = off_by_nodes(system, equilibrium)
        self._evaluate_at(x, y, 0.0)
        velocity = (initial.vx, initial.vy)
        acceleration = (0.0, 0.0)
        at_start = plant.layer.contact
        if system.method.start == "consistent":
            acceleration = _acceleration(system, (x, y), velocity, at_start.normal_force)
        self.scheme.begin(plant.s, self.state, (x, y), velocity, acceleration)
        self.state.force = plant.work.force_before = at_start.normal_force
        if not system.method.own_steps:
            self.state.force_before = self.state.force_earlier = at_start.normal_force
        plant.work.store_x_before = at_start.store_x

    def _evaluate_at(self, x: float, y: float, steps: float) -> None:
        """Evaluate the contact, `steps` steps after t = 0."""
        samples, beyond = divmod(steps, self.system.per_sample)
        t = samples * self.system.interval
        travel, travel_low = integral_at(self.system.belt, t, beyond * self.system.step)
        turn_wheel(travel, travel_low, *self._layer)
        fill(x, y, *self._layer)

    def _energy(self) -> tuple[float, float, float]:
        """Kinetic energy, energy of the links and of the contact (J), where the scheme places them."""
        plant = self.plant
        kinetic, links, (x, y), back = self.scheme.mechanical_energy(plant.c, plant.s, self.state)
        self._evaluate_at(x, y, int(self.counts.level) - back)
        return float(kinetic), float(links), float(plant.layer.contact.store)

    def _count(self) -> None:
        counts = self.counts
        work = self.work
        work.steps = int(counts.kinds.sum())
        if self.system.method.row.exact:
            work.rounding = self.state.largest.copy(), self.state.worst.copy()
        work.contact_evaluations = int(counts.evaluations)
        work.unconverged_steps = int(counts.unconverged)
        work.non_unique_steps = int(counts.rising)
        work.most_evaluations = int(counts.most)
        work.evaluators = {kind: int(n) for kind, n in zip(contact.kinds(), counts.kinds, strict=False) if n}
        work.unconverged = self.events[: min(work.unconverged_steps, EVENTS)].copy()


def _acceleration(system: System, position: Pair, velocity: Pair, force: float) -> Pair:
    """(ẍ, ÿ) of (6)-(7) at t = 0; where the shoe moves with the wheel, friction decides as in a step."""
    c = system.coefficients
    load = system.load_at_start
    x, y = position
    v_x, v_y = velocity
    g_1 = -(c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + load * c.sin_beta)  # Eq. (6)
    g_2 = force - (c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + load * c.cos_beta)  # Eq. (7)
    sliding = v_x - system.belt_speed
    if sliding != 0.0:
        return (g_1 - np.sign(sliding) * c.phi * force) / c.m, g_2 / c.m
    return minimise(c.m, 0.0, c.m, g_1, g_2, c.phi * force, float(slope_at(system.belt, 0.0)))[:2]
