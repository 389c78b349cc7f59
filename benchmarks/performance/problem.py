"""A system as general solvers take it: numbers, a compiled right-hand side, a grid of samples."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.cpython.unsafe.tuple import tuple_setitem

from brakecli.solver.system import System

FAST = {"reassoc", "contract", "nsz"}


class Problem:
    """The numbers of a system whose speed and load are constant, in the paper's symbols, and its samples."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.c = system.coefficients
        self.load = system.load_at_start
        self.belt = system.belt_speed
        self.stiffness = system.contact_stiffness
        self.times = system.interval * np.arange(system.samples + 1)
        self.start = np.array([system.initial.x, system.initial.y, system.initial.vx, system.initial.vy])
        self.phi = float(self.c.phi)

    def tables(self, nodes: int) -> tuple[Any, ...]:
        """Wavenumbers of the wheel, and at the nodes f1, g sin and g cos of the wheel: means over their cells."""
        system = self.system
        spacing = 2.0 * self.system.half_length / nodes
        xi = -system.half_length + spacing * (np.arange(nodes) + 0.5)
        shoe, wheel = (
            (f.omega, f.phase, f.g * np.sinc(f.omega * spacing / (2.0 * np.pi)))
            for f in (system.shoe, system.wheel)
        )
        f1 = sum(g * np.sin(omega * xi + phase) for omega, phase, g in zip(*shoe, strict=True))
        angles = np.outer(wheel[0], xi) + wheel[1][:, None]
        return wheel[0], f1, wheel[2][:, None] * np.sin(angles), wheel[2][:, None] * np.cos(angles)

    def force(self, nodes: int) -> Callable[[float, float, float], float]:
        """F_y(x, y, t), compiled: closed form on smooth surfaces, otherwise the midpoint rule on its nodes.

        As fast as it can be made: one sine and cosine for each wave, a loop over nodes with all numbers known to
        the compiler, and partial sums side by side.
        """
        stiffness = self.stiffness
        if self.system.smooth:

            @njit
            def smooth(x: float, y: float, t: float) -> float:
                return max(-stiffness * y, 0.0)

            return smooth  # type: ignore[no-any-return]
        omega, f1, sines, cosines = self.tables(nodes)
        belt = self.belt
        waves = len(omega)
        per_node = stiffness / nodes
        zeros = (0.0,) * waves  # an array would be allocated in each call

        @njit(fastmath=FAST)
        def rough(x: float, y: float, t: float) -> float:
            sine = zeros
            cosine = zeros
            for i in range(waves):
                angle = omega[i] * (x - belt * t)
                sine = tuple_setitem(sine, i, np.sin(angle))
                cosine = tuple_setitem(cosine, i, np.cos(angle))
            total = 0.0
            for j in range(nodes):
                gap = -f1[j] - y
                for i in range(waves):
                    gap += cosine[i] * sines[i, j] + sine[i] * cosines[i, j]
                total += gap if gap > 0.0 else 0.0
            return total * per_node

        return rough  # type: ignore[no-any-return]

    def right_hand_side(self, nodes: int, width: float = 0.0) -> Callable[..., None]:
        """rhs(t, u, du, phi), compiled: (6)-(7), friction by the sign of the speed or by tanh over a width."""
        force = self.force(nodes)
        m, b_xx, b_xy, b_yy, c_xx, c_xy, c_yy, sin_beta, cos_beta, _ = self.c
        load_x = self.load * sin_beta
        load_y = self.load * cos_beta
        belt = self.belt

        @njit
        def rhs(t: float, u: Any, du: Any, phi: float) -> None:
            x = u[0]
            y = u[1]
            v_x = u[2]
            v_y = u[3]
            normal = force(x, y, t)
            sliding = v_x - belt
            side = np.tanh(sliding / width) if width > 0.0 else np.sign(sliding)
            du[0] = v_x
            du[1] = v_y
            du[2] = (-phi * normal * side - b_xx * v_x - b_xy * v_y - c_xx * x - c_xy * y - load_x) / m
            du[3] = (normal - b_yy * v_y - b_xy * v_x - c_yy * y - c_xy * x - load_y) / m

        return rhs  # type: ignore[no-any-return]
