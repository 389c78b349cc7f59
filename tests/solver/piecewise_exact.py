"""The flat model solved phase by phase with matrix exponentials: an independent reference to machine precision.

On flat surfaces every phase (touching or open; slip either way or stick) is linear with constant coefficients.
Phases are advanced by exact propagators over a fine grid; where a phase's condition breaks, the instant is
found by root finding on the exact solution, as the series of its matrix exponential. A condition that breaks and
holds again within one step of the grid is found by its slope; the grid is to be fine beside every motion.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from brakecli.solver.schedules import values
from brakecli.solver.system import System

Vector = NDArray[np.float64]


class PiecewiseExact:
    """Exact motion (x, y, vx, vy) of a flat case with constant speed and load."""

    def __init__(self, system: System, grid: float) -> None:
        c = system.coefficients
        q = float(values(system.load)[0])
        self.belt = system.belt_speed
        self.phi = c.phi
        self.stiffness = system.contact_stiffness
        self.c = c
        self.q_x = q * c.sin_beta
        self.q_y = q * c.cos_beta
        self.grid = grid
        self.generators: dict[tuple[bool, int], NDArray[np.float64]] = {}
        self.propagators: dict[tuple[bool, int], NDArray[np.float64]] = {}
        self.conditions: dict[tuple[bool, int], NDArray[np.float64]] = {}

    def generator(self, touching: bool, side: int) -> NDArray[np.float64]:
        """ż = A z for z = (x, y, vx, vy, 1)."""
        if (touching, side) not in self.generators:
            c = self.c
            k = self.stiffness if touching else 0.0
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

    def margins(self, touching: bool, side: int) -> Vector:
        """Rows whose products with z are positive while the phase lasts."""
        if (touching, side) not in self.conditions:
            self.conditions[touching, side] = self._margins(touching, side)
        return self.conditions[touching, side]

    def _margins(self, touching: bool, side: int) -> Vector:
        found = [[0.0, -1.0 if touching else 1.0, 0.0, 0.0, 0.0]]
        if touching and side != 0:
            found.append([0.0, 0.0, side, 0.0, -side * self.belt])
        if touching and side == 0:
            c = self.c
            needed = np.array([c.c_xx, c.c_xy, 0.0, c.b_xy, c.b_xx * self.belt + self.q_x])
            bound = np.array([0.0, -self.phi * self.stiffness, 0.0, 0.0, 0.0])
            found += [list(bound - needed), list(bound + needed)]
        return np.array(found)

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

    def first_phase(self, start: Vector) -> tuple[bool, int]:
        """The phase of a state that is on the border of none."""
        assert start[1] != 0.0
        assert start[2] != self.belt
        return start[1] < 0.0, (1 if start[2] > self.belt else -1) if start[1] < 0.0 else 0

    def run(self, start: Vector, touching: bool, side: int, samples: int, per_sample: int = 1) -> Vector:
        """Samples, `per_sample` grid times apart, from a state in a known phase."""
        z = np.append(start, 1.0)
        rows = [z[:4].copy()]
        self.visited = [(touching, side)]
        for _ in range(samples):
            for _ in range(per_sample):
                left = self.grid
                while left > 0.0:
                    z, left, touching, side = self._advance(z, left, touching, side)
            rows.append(z[:4].copy())
        return np.array(rows)

    def _advance(self, z: Vector, span: float, touching: bool, side: int) -> tuple[Vector, float, bool, int]:
        a = self.generator(touching, side)
        if (touching, side) not in self.propagators:
            self.propagators[touching, side] = expm(a * self.grid)
        terms = [z]  # of the series of expm(a t) z, with t in spans: a step of the grid is a part of a period

        def at(part: float) -> Vector:
            while len(terms) < 30:
                terms.append(a @ terms[-1] * (span / len(terms)))
            total = terms[-1]
            for term in reversed(terms[:-1]):
                total = total * part + term
            return total

        end = self.propagators[touching, side] @ z if span == self.grid else at(1.0)
        margins = self.margins(touching, side)
        broken = margins @ end < 0.0
        dips = ~broken & (margins @ (a @ z) < 0.0) & (margins @ (a @ end) > 0.0)
        if not broken.any() and not dips.any():
            return end, 0.0, touching, side
        first = 1.0
        which = -1
        for index in np.flatnonzero(broken | dips):
            row = margins[index]
            last = 1.0
            if dips[index]:
                if row @ a @ at(1e-9) >= 0.0 or row @ a @ at(1.0) <= 0.0:
                    continue  # by rounding alone
                last = brentq(lambda part, row=row: row @ a @ at(part), 1e-9, 1.0)
                if row @ at(last) >= 0.0:
                    continue
            begin = next((part for part in (1e-9, 1e-6, 1e-4, 1e-2, 0.1) if row @ at(part * last) > 0.0), None)
            if begin is not None:
                root = brentq(lambda part, row=row: row @ at(part), begin * last, last, xtol=1e-15, rtol=1e-14)
                if root < first:
                    first = root
                    which = int(index)
        if which < 0:
            return end, 0.0, touching, side
        z = at(first)
        touching, side = self.next_phase(z, touching, side, which)
        self.visited.append((touching, side))
        return z, span * (1.0 - first), touching, side
