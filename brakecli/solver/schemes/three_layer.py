"""The three-layer scheme with weights, (11)-(17): unknowns d, e, the central velocities at the middle level."""

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

WEIGHTS = 3
LAG = 1
MEMORY = (X, Y, X_OLD, Y_OLD)
VELOCITIES: tuple[int, ...] = ()


def weighted_time(s: Weights) -> float:
    """Steps after the current level at which forces are taken: zero for symmetric weights."""
    return s.theta_1 - s.theta_3


def order(s: Weights, start: str) -> int:
    """Second order with symmetric weights and the consistent start, else first."""
    return 2 if s.theta_1 == s.theta_3 and start == "consistent" else 1


def begin(
    s: Weights, position: tuple[float, float], velocity: tuple[float, float], acceleration: tuple[float, float]
) -> NDArray[np.float64]:
    """Two levels: x¹ = x⁰ + h v⁰ + h² a⁰/2. The paper's start x¹ = x⁰ is v⁰ = a⁰ = 0."""
    state = np.zeros(STATE_SIZE)
    h = s.h
    state[[X_OLD, Y_OLD]] = position
    state[[X, Y]] = [r + h * v + 0.5 * h * h * a for r, v, a in zip(position, velocity, acceleration, strict=True)]
    state[[VX, VY]] = velocity
    return state


def mechanical_energy(
    c: Coefficients, s: Weights, state: NDArray[np.float64]
) -> tuple[float, float, tuple[float, float], float]:
    """Kinetic energy and energy of the links (J), the position and how many steps back they belong: half a step.

    With symmetric weights the scheme without friction and dashpots keeps their sum (and the store's) exactly.
    """
    dx, dy = state[X] - state[X_OLD], state[Y] - state[Y_OLD]
    x, y = 0.5 * (state[X] + state[X_OLD]), 0.5 * (state[Y] + state[Y_OLD])

    def links(x: float, y: float) -> float:
        return float(0.5 * (c.c_xx * x * x + 2.0 * c.c_xy * x * y + c.c_yy * y * y))

    kinetic = 0.5 * c.m * float(dx**2 + dy**2) / s.h**2
    return kinetic, links(x, y) + (0.5 * (s.theta_1 + s.theta_3) - 0.25) * links(dx, dy), (x, y), 0.5


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
    """Eq. (14), misprints corrected, see docs/errata.md; the normal force is left out of g2."""
    h, inertia = s.h, 2.0 * c.m / s.h
    problem[A_11] = inertia + c.b_xx + 2.0 * c.c_xx * h * s.theta_1
    problem[A_12] = c.b_xy + 2.0 * c.c_xy * h * s.theta_1
    problem[A_22] = inertia + c.b_yy + 2.0 * c.c_yy * h * s.theta_1
    x = s.theta_2 * state[X] + (s.theta_3 + s.theta_1) * state[X_OLD]
    y = s.theta_2 * state[Y] + (s.theta_3 + s.theta_1) * state[Y_OLD]
    delta, gamma = (state[X] - state[X_OLD]) / h, (state[Y] - state[Y_OLD]) / h
    problem[G_1] = inertia * delta - c.c_xx * x - c.c_xy * y - load * c.sin_beta
    problem[G_2] = inertia * gamma - c.c_yy * y - c.c_xy * x - load * c.cos_beta
    problem[X_0], problem[Y_0] = x, y
    problem[GAIN] = 2.0 * s.theta_1 * h
    problem[BELT] = belt_now
    problem[D], problem[E], problem[F_Y] = state[VX], state[VY], state[FORCE]


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
    """x at the new level is x two levels back plus 2hd; and the works: the scheme times half that displacement.

    For symmetric weights inertia and links then change an energy of the pair of levels, exactly; with
    theta_1 != theta_3 the scheme takes (theta_1 - theta_3) |half displacement|² (links and layer) out itself.
    """
    h, d, e = s.h, problem[D], problem[E]
    friction = problem[A_11] * d + problem[A_12] * e - problem[G_1]
    dx, dy, slid = h * d, h * e, h * (d - belt_now)
    work[W_BELT] += h * friction * belt_now
    work[W_FRICTION] -= friction * slid
    work[W_DASHPOTS] += h * (c.b_xx * d * d + 2.0 * c.b_xy * d * e + c.b_yy * e * e)
    work[W_LOAD] += load * (c.sin_beta * dx + c.cos_beta * dy)
    work[W_ROUGHNESS] += contact[STORE_X] * slid
    links = c.c_xx * dx * dx + 2.0 * c.c_xy * dx * dy + c.c_yy * dy * dy
    layer = slid * (contact[STORE_X] - work[STORE_X_BEFORE]) - dy * (contact[NORMAL_FORCE] - work[FORCE_BEFORE])
    work[W_SCHEME] += (s.theta_1 - s.theta_3) * (links + layer)
    work[STORE_X_BEFORE], work[FORCE_BEFORE] = contact[STORE_X], contact[NORMAL_FORCE]
    x_new, y_new = state[X_OLD] + 2.0 * dx, state[Y_OLD] + 2.0 * dy
    state[X_OLD], state[Y_OLD] = state[X], state[Y]
    state[X], state[Y] = x_new, y_new
    state[VX], state[VY], state[FORCE] = d, e, problem[F_Y]
