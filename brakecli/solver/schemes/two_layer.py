"""The two-layer scheme with weights, (18)-(25): unknowns p, q, the velocities at the new level."""

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.compile import (
    A_11,
    A_12,
    A_22,
    BELT,
    F_Y,
    FINISH,
    FORCE,
    FORCE_BEFORE,
    G_1,
    G_2,
    GAIN,
    NORMAL_FORCE,
    PREPARE,
    STATE_SIZE,
    STORE_X,
    STORE_X_BEFORE,
    VX,
    VY,
    W_BELT,
    W_DASHPOTS,
    W_FRICTION,
    W_LOAD,
    W_ROUGHNESS,
    W_SCHEME,
    X_0,
    X_OLD,
    Y_0,
    Y_OLD,
    Coefficients,
    D,
    E,
    Weights,
    X,
    Y,
    kernel,
)

WEIGHTS = 2
LAG = 0
MEMORY = (X, Y, VX, VY)
VELOCITIES = (VX, VY)


def weighted_time(s: Weights) -> float:
    """Steps after the current level at which forces are taken: positions are weighted with theta_1."""
    return s.theta_1


def order(s: Weights, start: str) -> int:
    """Second order only with both weights one half, else first; there is one way to start."""
    return 2 if s.theta_1 == s.theta_2 == 0.5 else 1


def begin(
    s: Weights, position: tuple[float, float], velocity: tuple[float, float], acceleration: tuple[float, float]
) -> NDArray[np.float64]:
    """The initial state itself."""
    state = np.zeros(STATE_SIZE)
    state[[X, Y]] = state[[X_OLD, Y_OLD]] = position
    state[[VX, VY]] = velocity
    return state


def mechanical_energy(
    c: Coefficients, s: Weights, state: NDArray[np.float64]
) -> tuple[float, float, tuple[float, float], float]:
    """Kinetic energy and energy of the links (J), the position and how many steps back they belong: none."""
    x, y = state[X], state[Y]
    links = 0.5 * (c.c_xx * x * x + 2.0 * c.c_xy * x * y + c.c_yy * y * y)
    return 0.5 * c.m * float(state[VX] ** 2 + state[VY] ** 2), float(links), (x, y), 0.0


@kernel(PREPARE)
def prepare(
    c: Coefficients,
    s: Weights,
    state: NDArray[np.float64],
    load: float,
    belt_now: float,
    belt_next: float,
    problem: NDArray[np.float64],
) -> None:
    """Eq. (25), misprints corrected, see docs/errata.md; the normal force is left out of g2."""
    h, theta_1, theta_2 = s.h, s.theta_1, s.theta_2
    x, y, p, q = state[X], state[Y], state[VX], state[VY]
    problem[A_11] = c.m / h + theta_1 * (c.b_xx + theta_2 * c.c_xx * h)
    problem[A_12] = theta_1 * (c.b_xy + theta_2 * c.c_xy * h)
    problem[A_22] = c.m / h + theta_1 * (c.b_yy + theta_2 * c.c_yy * h)
    b, k = 1.0 - theta_1, theta_1 * (1.0 - theta_2) * h
    problem[G_1] = (
        c.m / h * p
        - (b * c.b_xx + k * c.c_xx) * p
        - (b * c.b_xy + k * c.c_xy) * q
        - c.c_xx * x
        - c.c_xy * y
        - load * c.sin_beta
    )
    problem[G_2] = (
        c.m / h * q
        - (b * c.b_yy + k * c.c_yy) * q
        - (b * c.b_xy + k * c.c_xy) * p
        - c.c_yy * y
        - c.c_xy * x
        - load * c.cos_beta
    )
    problem[X_0], problem[Y_0] = x + k * p, y + k * q
    problem[GAIN] = theta_1 * theta_2 * h
    problem[BELT] = belt_next
    problem[D], problem[E], problem[F_Y] = p, q, state[FORCE]


@kernel(FINISH)
def finish(
    c: Coefficients,
    s: Weights,
    state: NDArray[np.float64],
    load: float,
    belt_now: float,
    belt_next: float,
    problem: NDArray[np.float64],
    contact: NDArray[np.float64],
    work: NDArray[np.float64],
) -> None:
    """(21)-(22), and the works of the step: the scheme times the displacement of the step.

    m (p' - p)/h dx = change of kinetic energy + m (theta_2 - 1/2)|p' - p|², and the links likewise with
    theta_1 - 1/2: what a scheme with other weights than one half takes out of the motion by itself.
    """
    h, p, q = s.h, state[VX], state[VY]
    p_new, q_new = problem[D], problem[E]
    friction = problem[A_11] * p_new + problem[A_12] * q_new - problem[G_1]
    v_x, v_y = s.theta_2 * p_new + (1.0 - s.theta_2) * p, s.theta_2 * q_new + (1.0 - s.theta_2) * q
    u_x, u_y = s.theta_1 * p_new + (1.0 - s.theta_1) * p, s.theta_1 * q_new + (1.0 - s.theta_1) * q
    belt = s.theta_2 * belt_next + (1.0 - s.theta_2) * belt_now
    dx, dy, slid = h * v_x, h * v_y, h * (v_x - belt)
    work[W_BELT] += h * friction * belt
    work[W_FRICTION] -= friction * slid
    work[W_DASHPOTS] += dx * (c.b_xx * u_x + c.b_xy * u_y) + dy * (c.b_xy * u_x + c.b_yy * u_y)
    work[W_LOAD] += load * (c.sin_beta * dx + c.cos_beta * dy)
    work[W_ROUGHNESS] += contact[STORE_X] * slid
    inertia = c.m * ((p_new - p) ** 2 + (q_new - q) ** 2)
    links = c.c_xx * dx * dx + 2.0 * c.c_xy * dx * dy + c.c_yy * dy * dy
    layer = slid * (contact[STORE_X] - work[STORE_X_BEFORE]) - dy * (contact[NORMAL_FORCE] - work[FORCE_BEFORE])
    work[W_SCHEME] += (s.theta_2 - 0.5) * inertia + (s.theta_1 - 0.5) * (links + layer)
    work[STORE_X_BEFORE], work[FORCE_BEFORE] = contact[STORE_X], contact[NORMAL_FORCE]
    state[X_OLD], state[Y_OLD] = state[X], state[Y]
    state[X] += dx
    state[Y] += dy
    state[VX], state[VY], state[FORCE] = p_new, q_new, problem[F_Y]
