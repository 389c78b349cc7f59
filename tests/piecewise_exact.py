"""The flat model solved phase by phase with matrix exponentials: an independent reference to machine precision.

On flat surfaces every phase (touching or open; slip either way or stick) is linear with constant coefficients.
Phases are advanced by exact propagators over a fine grid; where a phase's condition breaks, the instant is
found by root finding on the exact solution.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from brakecli.setup import Setup

Vector = NDArray[np.float64]


class PiecewiseExact:
    """Exact motion (x, y, vx, vy) of a flat case with constant speed and load."""

    def __init__(self, setup: Setup, grid: float) -> None:
        c, q = setup.coefficients, float(setup.load.values[0])
        self.belt, self.phi, self.stiffness = setup.belt_speed, c.phi, setup.contact_stiffness
        self.c = c
        self.q_x, self.q_y = q * c.sin_beta, q * c.cos_beta
        self.grid = grid
        self.generators: dict[tuple[bool, int], NDArray[np.float64]] = {}
        self.propagators: dict[tuple[bool, int], NDArray[np.float64]] = {}

    def generator(self, touching: bool, side: int) -> NDArray[np.float64]:
        """ż = A z for z = (x, y, vx, vy, 1)."""
        if (touching, side) not in self.generators:
            c, k = self.c, self.stiffness if touching else 0.0
            a = np.zeros((5, 5))
            a[0, 2] = a[1, 3] = 1.0
            a[3] = np.array([-c.c_xy, -c.c_yy - k, -c.b_xy, -c.b_yy, -self.q_y]) / c.m
            if side != 0 or not touching:
                drag = -side * self.phi * np.array([0.0, -k, 0.0, 0.0, 0.0])  # F_x = -side φ F_y, F_y = -k y
                a[2] = (np.array([-c.c_xx, -c.c_xy, -c.b_xx, -c.b_xy, -self.q_x]) + drag) / c.m
            self.generators[touching, side] = a
        return self.generators[touching, side]

    def needed(self, z: Vector) -> float:
        """The friction force that stick takes, from (6) with ẍ = 0, ẋ = U."""
        c = self.c
        return float(c.b_xx * self.belt + c.b_xy * z[3] + c.c_xx * z[0] + c.c_xy * z[1] + self.q_x)

    def margins(self, touching: bool, side: int) -> list[Callable[[Vector], float]]:
        """Functions that are positive while the phase lasts."""
        found: list[Callable[[Vector], float]] = [lambda z: -z[1] if touching else z[1]]
        if touching and side != 0:
            found.append(lambda z: side * (z[2] - self.belt))
        if touching and side == 0:
            found.append(lambda z: -self.phi * self.stiffness * z[1] - self.needed(z))
            found.append(lambda z: -self.phi * self.stiffness * z[1] + self.needed(z))
        return found

    def next_phase(self, z: Vector, touching: bool, side: int, event: int) -> tuple[bool, int]:
        """The phase after the condition `event` of this phase broke at z."""
        if event == 0:
            sliding = z[2] - self.belt
            return (True, 1 if sliding > 0.0 else -1) if not touching else (False, 0)
        if side == 0:
            return True, -1 if event == 1 else 1  # the wheel pulls away forwards: the shoe falls behind
        if abs(self.needed(z)) <= -self.phi * self.stiffness * z[1]:
            z[2] = self.belt
            return True, 0
        return True, -side

    def run(self, start: Vector, touching: bool, side: int, samples: int) -> NDArray[np.float64]:
        """Samples at every grid time, from a state in a known phase."""
        z = np.append(start, 1.0)
        rows = [z[:4].copy()]
        for _ in range(samples):
            left = self.grid
            while left > 0.0:
                z, left, touching, side = self._advance(z, left, touching, side)
            rows.append(z[:4].copy())
        return np.array(rows)

    def _advance(self, z: Vector, span: float, touching: bool, side: int) -> tuple[Vector, float, bool, int]:
        a = self.generator(touching, side)
        end = expm(a * span) @ z
        first, which = span, -1
        for index, margin in enumerate(self.margins(touching, side)):
            if margin(end) < 0.0 and margin(expm(a * 1e-9 * span) @ z) > 0.0:
                t = brentq(
                    lambda t, m=margin: m(expm(a * t) @ z), 1e-9 * span, span, xtol=1e-15 * span, rtol=1e-14
                )
                if t < first:
                    first, which = t, index
        if which < 0:
            return end, 0.0, touching, side
        z = expm(a * first) @ z
        touching, side = self.next_phase(z, touching, side, which)
        return z, span - first, touching, side
