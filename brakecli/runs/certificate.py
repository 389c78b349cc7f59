"""How far histories may be off, and how that is known: by what two runs of different fineness differ by."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from brakecli.solver.compile import Floats
from brakecli.solver.motion import Motion
from brakecli.solver.system import System

ROUNDING = 1e-12  # least estimate: runs that share their rounding agree better than they are right


@dataclass(frozen=True)
class Certificate:
    """How far the histories may be off, and how that is known."""

    tolerance: float
    certified: bool
    estimated_error: float  # relative to the largest value of each of x, y, vx and vy
    certified_until: float  # s; up to here they keep the tolerance where they do not to the end
    method: str

    def sentence(self) -> str:
        """The certificate in words."""
        if self.certified:
            return f"error at most {self.estimated_error:.1e}, by {self.method}"
        kept = f"up to {self.certified_until:.4g} s they keep it"
        return f"{self.tolerance:g} cannot be certified: {self.method} give {self.estimated_error:.1e}; {kept}"


class Certified(NamedTuple):
    """A motion with its certificate; its `work` counts the last run, but `solve_seconds` those of all runs."""

    motion: Motion
    certificate: Certificate


def compare(coarse: Motion, fine: Motion, tolerance: float) -> tuple[float, float]:
    """Until when (s) two runs differ by no more than the tolerance, and by how much they differ at most.

    What never exceeds the rounding of the motion does not count, as velocities of a shoe that stays where it is.
    """
    system = max(coarse.system, fine.system, key=lambda each: each.interval)
    every = (round(system.interval / each.system.interval) for each in (coarse, fine))
    one, other = (
        np.ascontiguousarray(each.rows[::n, :4].T) for each, n in zip((coarse, fine), every, strict=True)
    )
    count = other.shape[1]
    if one.shape[1] < count:
        return 0.0, 1.0
    one = one[:, :count]  # x, y, vx, vy
    size, apart = sizes(system, *(np.abs(each).max(axis=1) for each in (one, other))), np.abs(one - other)
    error = float((apart.max(axis=1) / size).max())
    late = np.flatnonzero((tolerance * size < apart.T).any(axis=1)) if error > tolerance else np.zeros(0)
    until: float = (int(late[0]) - 1 if len(late) else count - 1) * system.interval
    return max(until, 0.0), max(error, ROUNDING)


def sizes(system: System, one: Floats, other: Floats) -> Floats:
    """The largest x, y, vx and vy of the latter of two runs; infinite where both are rounding, as at rest."""
    rate = 2.0 * math.pi * system.natural_frequencies[1]
    rounding = ROUNDING * other[:2].max() * np.array([1.0, 1.0, rate, rate])
    return np.where(np.maximum(one, other) > rounding, np.maximum(other, rounding), math.inf)
