"""A motion on smooth pads as Python sees it: carried over a span, or followed to what becomes of it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, LOAD, MATRICES, MOST_TURNS, V_X, Block, Way
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.motion.orbit import CLOSED
from brakecli.solver.motion.tasks import FLY, SEEK, SWING, advance
from brakecli.solver.phases import BACKWARD, FORWARD, OPEN, STICK
from brakecli.solver.plant import Plant
from brakecli.solver.records import one
from brakecli.solver.system import System, longest_step

FOREVER = 1e300
"""A time (s) that no motion reaches: finite, as a mode that decays does not grow in it at all."""

Modes = tuple[NDArray[np.complex128], NDArray[np.complex128]]
"""Eigenvalues of steady sliding (1/s), and the vectors of position and velocity in columns."""


class Orbit(NamedTuple):
    """A motion that repeats (SI units): along a branch, forced by waves, or on the way of a run."""

    period: float
    amplitude: float  # half of peak to peak of x
    stick_fraction: float
    contact_loss_fraction: float
    state: tuple[float, ...]  # x, y, v_x and v_y at a place of it; at t = 0 of the waves where they force it
    word: tuple[int, ...]  # phases, from there
    times: tuple[float, ...]  # when they change, from there
    level: float = math.nan  # standard deviation of vx, where it is known, m/s
    mean_force: float = math.nan  # of the friction force, where it is known, N
    error: float = math.nan  # part of its size by which a pursued orbit may be off

    @property
    def frequency(self) -> float:
        """Hz."""
        return 1.0 / self.period


def _done(plants: Sequence[Plant], block: Block, task: int, seconds: float = 0.0) -> int:
    """Have the motion of a block do a task; how that ends."""
    block.task = task
    block.seconds = seconds
    rows = np.zeros((1, 1))  # a flow fills none, and has no tables
    return int(advance(plants, rows[0], rows[0], rows, rows, 0))


def _plants(c: Coefficients, stiffness: float, belt: float, load: float) -> Sequence[Plant]:
    """An array of the record of a shoe on smooth pads, at constant speed and load."""
    plants = one(Plant)
    plant: Plant = plants[0]
    plant.c = c
    plant.exact.stiffness = stiffness
    plant.block.propagator = MATRICES
    plant.block.z[BELT] = belt
    plant.block.z[LOAD] = load
    plant.block.h = longest_step(c, stiffness)
    return plants


class SmoothFlow:
    """The flow of a shoe on smooth pads, at constant speed and load; one call after the other.

    After a call `path` holds what is known of the way, `state` its end (x, y, v_x, v_y), and `derivative` that of
    the end by the begin: one row for each component of the end.
    """

    def __init__(self, c: Coefficients, stiffness: float, belt: float, load: float) -> None:
        """From the contact's stiffness (N/m), U (m/s) and Q (N)."""
        self._plants = _plants(c, stiffness, belt, load)
        self.path: Block = self._plants[0].block

    @classmethod
    def of(cls, system: System) -> "SmoothFlow":
        """The flow of a system; raises ValueError where surfaces are rough, or where speed or load change."""
        if not (system.smooth and system.steady):
            raise ValueError("the exact flow needs smooth pads, a constant speed and a constant load")
        return cls(system.coefficients, system.contact_stiffness, system.belt_speed, system.load_at_start)

    def __call__(self, state: Floats, span: float, tangents: bool = True) -> int:
        """Carry a state over a span (s), with its derivative unless that is not needed; how it ends, as `DONE`."""
        self.path.z[:4] = state
        self.path.count = 4 if tangents else 0
        return _done(self._plants, self.path, FLY, span)

    @property
    def state(self) -> Floats:
        """x, y (m), v_x and v_y (m/s) at the end of the last span."""
        return np.array(self.path.z[:4])

    @property
    def derivative(self) -> Floats:
        """Derivative of the last end by its begin, (4, 4), in SI units."""
        return np.array(self.path.columns.T)

    @property
    def word(self) -> tuple[int, ...]:
        """The phases of the last span."""
        return tuple(self.path.word[: self.path.events + 1].tolist())

    @property
    def times(self) -> tuple[float, ...]:
        """When they change, s."""
        return tuple(self.path.times[: self.path.events].tolist())


def _rounds(word: list[int], times: list[float], period: float) -> int:
    """How often a motion has gone round its orbit in a time (s): phases, and when they change, repeat as often."""
    for rounds in range(MOST_TURNS, 1, -1):
        events, remainder = divmod(len(times), rounds)
        if remainder == 0 and events > 0 and word[events:] == word[: len(word) - events]:
            away = np.subtract(times[events:], times[:-events]) - period / rounds
            if np.abs(away).max() <= 1e-7 * period:  # times differ by that from round to round
                return rounds
    return 1


class Pursuit:
    """A motion on smooth pads, at constant speed and load, which is followed to what becomes of it.

    `way` holds how it comes to its orbit, and `path` the motion: how far it has come, or the orbit that is found.
    """

    def __init__(
        self,
        c: Coefficients,
        acting: tuple[float, float, float],
        state: Floats,
        equilibrium: Floats,
        modes: Modes,
        duration: float = FOREVER,
    ) -> None:
        """Begin from a state (x, y, v_x, v_y), with what acts: the contact's stiffness (N/m), U (m/s), Q (N).

        `equilibrium`: x and y of steady sliding. `modes`: its eigenvalues, and the vectors of position and
        velocity in columns. Raises LinAlgError where two of them are alike.
        """
        self._plants = _plants(c, *acting)
        self.path: Block = self._plants[0].block
        self.way: Way = self._plants[0].way
        o = self.way
        values, vectors = modes
        inverse = np.linalg.inv(modes[1])
        self.path.x, self.path.y, self.path.v_x, self.path.v_y = state
        belt = acting[1]
        o.duration = duration
        o.sliding = BACKWARD if belt > 0.0 else FORWARD
        o.equilibrium[:2] = equilibrium
        o.room[:] = (-equilibrium[1], abs(belt))
        o.into[0] = inverse.real
        o.into[1] = inverse.imag
        o.growth[:] = values.real
        o.reach[:] = np.abs(vectors[:3]).T

    def seek(self) -> int:
        """Go on for some time; what the motion has come to, as `FOUND`."""
        return _done(self._plants, self.path, SEEK)

    def swing(self, begin: Floats, seconds: float) -> None:
        """Find the least and the largest x of a linear motion from a state on, for some time (s)."""
        self.path.z[:4] = begin
        _done(self._plants, self.path, SWING, seconds)

    @property
    def time(self) -> float:
        """How far the motion has been followed, s."""
        return float(self.way.time if self.way.on_orbit else self.path.time)

    @property
    def steps(self) -> int:
        """Steps so far."""
        return int(self._plants[0].counts.kinds.sum())

    @property
    def evaluations(self) -> int:
        """Steps so far in which the shoe touched the wheel."""
        return int(self._plants[0].counts.evaluations)

    @property
    def state(self) -> Floats:
        """x, y (m), v_x and v_y (m/s) that the motion has reached."""
        return np.array(self.way.saved if self.way.on_orbit else self.path.z[:4])

    @property
    def orbit(self) -> Orbit:
        """The orbit, once it is found."""
        o = self.way
        path = self.path
        x, y, v_y = o.point.tolist()
        period = float(o.period)
        spent = (path.spent / period).tolist()
        word = path.word[: path.events + 1].tolist()
        times = path.times[: path.events].tolist()
        rounds = _rounds(word, times, period)
        events = len(times) // rounds
        return Orbit(
            period=period / rounds,
            amplitude=float(o.amplitude),
            stick_fraction=spent[STICK],
            contact_loss_fraction=spent[OPEN],
            state=(x, y, 0.0, v_y),
            word=tuple(word[: events + 1]),
            times=tuple(times[:events]),
            level=float(path.band),  # the root of the mean square: the mean of vx over a period is 0
            mean_force=float(o.force),
            error=CLOSED,
        )

    @property
    def fastest(self) -> float:
        """Largest v_x on the orbit over the wheel's speed."""
        path = self.path
        return float(max(path.low[V_X] / path.z[BELT], path.high[V_X] / path.z[BELT]))

    @property
    def multiplier(self) -> float:
        """Largest part of its size that a disturbance of the orbit keeps in a cycle; an orbit attracts below 1."""
        return float(np.abs(np.linalg.eigvals(self.way.map)).max())
