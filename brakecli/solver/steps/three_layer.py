"""The three-layer scheme with weights, (11)-(17): unknowns d, e, the central velocities at the middle level."""

from typing import Any

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.energy import Mechanical, links_energy
from brakecli.solver.kernels import kernel
from brakecli.solver.records import Contact, Pair, Problem, State, Weights, Works

STATE = State
KEPT = "state"
LAG = 1
MEMORY: tuple[str, ...] = ("x", "y", "x_old", "y_old")
VELOCITIES: tuple[str, ...] = ()


def weighted_time(s: Weights) -> float:
    """Steps after the current level at which forces are taken: zero for symmetric weights."""
    return s.theta_1 - s.theta_3


def order(s: Weights, start: str) -> int:
    """Second order with symmetric weights and the consistent start, otherwise first."""
    return 2 if s.theta_1 == s.theta_3 and start == "consistent" else 1


def begin(s: Weights, state: State, position: Pair, velocity: Pair, acceleration: Pair) -> None:
    """Two levels: x¹ = x⁰ + h v⁰ + h² a⁰/2. The paper's start x¹ = x⁰ is v⁰ = a⁰ = 0."""
    h = s.h
    levels = zip(position, velocity, acceleration, strict=True)
    state.x_old, state.y_old = position
    state.x, state.y = (r + h * v + 0.5 * h * h * a for r, v, a in levels)
    state.v_x, state.v_y = velocity


def mechanical_energy(c: Coefficients, s: Weights, state: Any) -> Mechanical:
    """What the scheme keeps belongs to half a step before the level reached.

    With symmetric weights the scheme without friction and dashpots keeps the sum (with the store's) exactly.
    """
    dx = state.x - state.x_old
    dy = state.y - state.y_old
    x = 0.5 * (state.x + state.x_old)
    y = 0.5 * (state.y + state.y_old)
    kinetic = 0.5 * c.m * (dx**2 + dy**2) / s.h**2
    links = links_energy(c, x, y) + (0.5 * (s.theta_1 + s.theta_3) - 0.25) * links_energy(c, dx, dy)
    return kinetic, links, (x, y), 0.5


@kernel
def prepare(c: Coefficients, s: Weights, state: State, problem: Problem) -> None:
    """(14), misprints corrected, see docs/errata.md; the normal force is left out of g2."""
    h = s.h
    inertia = 2.0 * c.m / s.h
    load = problem.load
    problem.a_11 = inertia + c.b_xx + 2.0 * c.c_xx * h * s.theta_1  # Eq. (14)
    problem.a_12 = c.b_xy + 2.0 * c.c_xy * h * s.theta_1  # Eq. (14)
    problem.a_22 = inertia + c.b_yy + 2.0 * c.c_yy * h * s.theta_1  # Eq. (14)
    x = s.theta_2 * state.x + (s.theta_3 + s.theta_1) * state.x_old
    y = s.theta_2 * state.y + (s.theta_3 + s.theta_1) * state.y_old
    delta = (state.x - state.x_old) / h
    gamma = (state.y - state.y_old) / h
    problem.g_1 = inertia * delta - c.c_xx * x - c.c_xy * y - load * c.sin_beta  # Eq. (14)
    problem.g_2 = inertia * gamma - c.c_yy * y - c.c_xy * x - load * c.cos_beta  # Eq. (14)
    # arguments of F_y in (13), less gain d and gain e
    problem.x_0 = x
    problem.y_0 = y
    problem.gain = 2.0 * s.theta_1 * h
    problem.belt = problem.belt_now
    problem.phi = c.phi
    problem.d = state.v_x
    problem.e = state.v_y
    problem.normal_force = state.force


@kernel
def finish(c: Coefficients, s: Weights, state: State, problem: Problem, contact: Contact, work: Works) -> None:
    """x at the new level is x two levels back plus 2hd; and the works: the scheme times half that displacement.

    For symmetric weights inertia and links then change an energy of the pair of levels, exactly; with
    theta_1 != theta_3 the scheme takes (theta_1 - theta_3) |half displacement|² (links and layer) out itself.
    """
    h = s.h
    d = problem.d
    e = problem.e
    belt = problem.belt_now
    friction = problem.a_11 * d + problem.a_12 * e - problem.g_1
    dx = h * d
    dy = h * e
    slid = h * (d - belt)
    work.belt += h * friction * belt
    work.friction -= friction * slid
    work.dashpots += h * (c.b_xx * d * d + 2.0 * c.b_xy * d * e + c.b_yy * e * e)
    work.load += problem.load * (c.sin_beta * dx + c.cos_beta * dy)
    work.roughness += contact.store_x * slid
    links = c.c_xx * dx * dx + 2.0 * c.c_xy * dx * dy + c.c_yy * dy * dy
    layer = slid * (contact.store_x - work.store_x_before) - dy * (contact.normal_force - work.force_before)
    work.scheme += (s.theta_1 - s.theta_3) * (links + layer)
    work.store_x_before = contact.store_x
    work.force_before = contact.normal_force
    # d and e of (12)
    x_new = state.x_old + 2.0 * dx
    y_new = state.y_old + 2.0 * dy
    state.x_old = state.x
    state.y_old = state.y
    state.x = x_new
    state.y = y_new
    state.v_x = d
    state.v_y = e
    state.force = problem.normal_force
