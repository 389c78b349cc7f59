"""How far histories may be off, and how that is known: what runs say of themselves, or differ by."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Motion
from brakecli.solver.schedules import values
from brakecli.solver.system import WHOLE, System

ROUNDING = 1e-12  # least estimate: runs that share their rounding agree better than they are right
MISSED = 1.0000001
"""Least error, over the promised one, of a run that does not keep it."""
NOTHING = 1.0
"""Error of a history over its largest value from which on nothing is known of it."""
DISPLACED = 64.0 * float(np.finfo(float).eps)
"""How far a replica starts away, over its distances: the roundings of 64² steps add up to that at random."""


@dataclass(frozen=True)
class Certificate:
    """How far the histories may be off, and how that is known."""

    tolerance: float
    certified: bool
    estimated_error: float  # relative to the largest value of each of x, y, vx and vy
    certified_until: float  # s; up to here they keep the tolerance where they do not to the end
    method: str
    by_steps: float | None = None  # what steps make of the error, where the run knows its own,
    by_nodes: float | None = None  # what nodes make of it,
    amplification: float | None = None  # and by how much the motion multiplies a disturbance of its start, at most

    @property
    def known_error(self) -> float | None:
        """The estimated error; None where it says nothing, as it is as large as the motion."""
        return _bound(self.estimated_error)

    @property
    def known_by_steps(self) -> float | None:
        """What steps make of it, likewise."""
        return _bound(self.by_steps)

    @property
    def known_by_nodes(self) -> float | None:
        """What nodes make of it, likewise."""
        return _bound(self.by_nodes)

    def sentence(self) -> str:
        """The certificate in words."""
        if self.certified:
            return f"error at most {self.estimated_error:.1e}, by {self.method}"
        until = f"up to {self.certified_until:.4g} s they keep it"
        bound = f"{self.known_error:.1e}" if self.known_error is not None else "no bound"
        return f"{self.tolerance:g} cannot be certified: {self.method} give {bound}; {until}"


def _bound(error: float | None) -> float | None:
    """An error that is less than the motion itself."""
    return error if error is not None and error < NOTHING else None


class Certified(NamedTuple):
    """A motion with its certificate; its `work` counts the last run, but `solve_seconds` those of all runs."""

    motion: Motion
    certificate: Certificate


@dataclass(frozen=True)
class Apart:
    """What two runs of one case differ by at the samples that they share."""

    interval: float  # s
    of: Floats  # |difference| of x, y, vx and vy (rows) at each sample
    size: Floats  # their largest values
    whole: bool = True  # False where one of the runs ended early

    @cached_property
    def error(self) -> float:
        """The largest relative difference, but no less than rounding."""
        return self.error_until(math.inf)

    def error_until(self, until: float) -> float:
        """That up to a time (s)."""
        if not self.whole:
            return NOTHING
        samples = 1 + int(min(until / self.interval + WHOLE, self.of.shape[1]))
        error = float(np.max(self.of[:, :samples].max(axis=1) / self.size))
        return max(error, ROUNDING) if error < math.inf else NOTHING

    def until(self, limit: float) -> float:
        """Until when (s) they differ by no more than a limit."""
        if not self.whole:
            return 0.0
        late = np.flatnonzero((limit * self.size < self.of.T).any(axis=1)) if self.error > limit else np.zeros(0)
        last: int = (int(late[0]) if len(late) else len(self.of.T)) - 1
        return float(max(last, 0) * self.interval)


def displacement(system: System) -> tuple[float, float]:
    """How far from its start (m) another rounding of it may lie."""
    c = system.coefficients
    initial = system.initial
    load = float(np.abs(values(system.load)).max())
    heights = sum(float(np.abs(rough.g).sum()) for rough in (system.shoe, system.wheel))
    pressed = load / (c.c_yy + system.contact_stiffness) + heights
    pulled = load * (abs(c.sin_beta) + c.phi) / c.c_xx if initial.from_equilibrium and c.c_xx > 0.0 else 0.0
    return DISPLACED * max(abs(initial.x), pressed, pulled), DISPLACED * max(abs(initial.y), pressed)


def replica(system: System) -> System:
    """The system with a start that is a few roundings away.

    Runs of one start share its rounding, and in part that of their steps. They agree on it, however much the
    motion makes of it: a shoe that is put on an unstable equilibrium stays there in all of them. What a run
    differs by from its replica is rounding times the amplification of the motion.
    """
    x, y = displacement(system)
    initial = system.initial
    return replace(system, initial=replace(initial, x=initial.x + x, y=initial.y + y))


def compare(coarse: Motion, fine: Motion) -> Apart:
    """What two runs differ by, relative to the latter.

    Components below rounding, such as the velocity of a resting shoe, are ignored.
    """
    system = max(coarse.system, fine.system, key=lambda system: system.interval)
    every = (round(system.interval / motion.system.interval) for motion in (coarse, fine))
    one, other = (
        np.ascontiguousarray(motion.rows[::n, :4].T) for motion, n in zip((coarse, fine), every, strict=True)
    )
    both = min(one.shape[1], other.shape[1])
    whole = one.shape[1] >= other.shape[1]
    one, other = one[:, :both], other[:, :both]  # x, y, vx, vy
    size = sizes(system, *(np.abs(states).max(axis=1) for states in (one, other)))
    return Apart(system.interval, np.abs(one - other), size, whole)


def sizes(system: System, one: Floats, other: Floats) -> Floats:
    """The largest x, y, vx and vy of the latter of two runs; infinite where both are rounding, as at rest."""
    rate = 2.0 * math.pi * system.natural_frequencies[1]
    rounding = ROUNDING * other[:2].max() * np.array([1.0, 1.0, rate, rate])
    return np.where(np.maximum(one, other) > rounding, np.maximum(other, rounding), math.inf)
