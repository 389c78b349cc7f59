"""Any case, rough ones too, by scipy's Runge-Kutta method with its events: a second program for the same motion.

Only the contact integral is the project's own, by its exact evaluator, which has its own proof in test_contact.py.
Constant speed and load.
"""

from functools import partial
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.schedules import values
from brakecli.solver.system import System

Vector = NDArray[np.float64]


class SolveIvp:
    """The motion (x, y, vx, vy) of a case, phase by phase: slip either way, or stick."""

    def __init__(self, system: System, relative: float, max_step: float) -> None:
        self.system = system
        self.relative = relative
        self.max_step = max_step
        self.c = system.coefficients
        self.belt = system.belt_speed
        self.q = float(values(system.load)[0])
        self.layer = build_layer("exact", system.pad)
        self.visited: list[int] = []
        self.evaluations = 0

    def normal(self, t: float, z: Vector) -> float:
        """F_y."""
        self.evaluations += 1
        wheel = self.system.wheel
        self.layer.angles[:] = wheel.phase - wheel.omega * (self.belt * t)
        fill(z[0], z[1], *self.layer)
        return float(self.layer.contact.normal_force)

    def against(self, z: Vector) -> tuple[float, float]:
        """Forces of links and load."""
        c = self.c
        x, y, v_x, v_y = z
        return (
            c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + self.q * c.sin_beta,
            c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + self.q * c.cos_beta,
        )

    def slope(self, side: int, t: float, z: Vector) -> list[float]:
        """(6)-(7) in a phase."""
        normal = self.normal(t, z)
        against_x, against_y = self.against(z)
        pull = -side * self.c.phi * normal - against_x if side else 0.0
        return [z[2], z[3], pull / self.c.m, (normal - against_y) / self.c.m]

    def hold(self, t: float, z: Vector) -> int:
        """The phase where the shoe moves with the wheel."""
        needed = self.against(z)[0]
        if abs(needed) <= self.c.phi * self.normal(t, z):
            return 0
        return -1 if needed > 0.0 else 1

    def margins(self, side: int) -> list[Any]:
        """Functions that fall through zero where a phase ends."""

        def slides(t: float, z: Vector) -> float:
            return float(side * (z[2] - self.belt))

        def holds_back(t: float, z: Vector) -> float:
            return self.c.phi * self.normal(t, z) - self.against(z)[0]

        def holds_on(t: float, z: Vector) -> float:
            return self.c.phi * self.normal(t, z) + self.against(z)[0]

        events: list[Any] = [slides] if side else [holds_back, holds_on]
        for event in events:
            event.terminal = True
            event.direction = -1
        return events

    def run(self, start: Vector, times: Vector) -> Vector:
        """The motion at the times; the start slides."""
        z = start.copy()
        t = 0.0
        side = 1 if start[2] > self.belt else -1
        rows = [start]
        for _ in count():
            self.visited.append(side)
            events = self.margins(side)
            later = times[times > t]
            size = np.abs(np.array(rows)).max(axis=0)
            found = solve_ivp(
                partial(self.slope, side),
                (t, times[-1]),
                z,
                "DOP853",
                later,
                events=events,
                rtol=self.relative,
                atol=self.relative * size,
                max_step=self.max_step,
            )
            rows += list(np.transpose(found.y))
            if found.status == 0:
                return np.array(rows)
            hits = found.t_events or []
            states = found.y_events or []
            which = next(index for index, hit in enumerate(hits) if hit.size)
            t = float(hits[which][0])
            z = states[which][0].copy()
            z[2] = self.belt
            side = self.hold(t, z) if side else (-1 if which == 0 else 1)
        raise AssertionError
