"""The two-layer scheme with weights, (18)-(25): unknowns p, q, the velocities at the new level."""

from brakecli.solver.coefficients import Coefficients
from brakecli.solver.energy import energy_at_level
from brakecli.solver.kernels import kernel
from brakecli.solver.records import Contact, Pair, Problem, State, Weights, Works

STATE = State
KEPT = "state"
LAG = 0
MEMORY: tuple[str, ...] = ("x", "y", "v_x", "v_y")
VELOCITIES: tuple[str, ...] = ("v_x", "v_y")
mechanical_energy = energy_at_level  # what the scheme keeps belongs to the level reached


def weighted_time(s: Weights) -> float:
    """Steps after the current level at which forces are taken: positions are weighted with theta_1."""
    return s.theta_1


def order(s: Weights, start: str) -> int:
    """Second order only with both weights one half, otherwise first; there is one way to start."""
    return 2 if s.theta_1 == s.theta_2 == 0.5 else 1


def begin(s: Weights, state: State, position: Pair, velocity: Pair, acceleration: Pair) -> None:
    """The initial state itself."""
    state.x, state.y = state.x_old, state.y_old = position
    state.v_x, state.v_y = velocity


@kernel
def prepare(c: Coefficients, s: Weights, state: State, problem: Problem) -> None:
    """(25), misprints corrected, see docs/errata.md; the normal force is left out of g2."""
    h = s.h
    theta_1 = s.theta_1
    theta_2 = s.theta_2
    inertia = c.m / s.h
    load = problem.load
    x = state.x
    y = state.y
    p = state.v_x
    q = state.v_y
    problem.a_11 = inertia + theta_1 * (c.b_xx + theta_2 * c.c_xx * h)  # Eq. (25)
    problem.a_12 = theta_1 * (c.b_xy + theta_2 * c.c_xy * h)  # Eq. (25)
    problem.a_22 = inertia + theta_1 * (c.b_yy + theta_2 * c.c_yy * h)  # Eq. (25)
    b = 1.0 - theta_1
    k = theta_1 * (1.0 - theta_2) * h
    xx = b * c.b_xx + k * c.c_xx
    xy = b * c.b_xy + k * c.c_xy
    yy = b * c.b_yy + k * c.c_yy
    problem.g_1 = inertia * p - xx * p - xy * q - c.c_xx * x - c.c_xy * y - load * c.sin_beta  # Eq. (25)
    problem.g_2 = inertia * q - yy * q - xy * p - c.c_yy * y - c.c_xy * x - load * c.cos_beta  # Eq. (25)
    # arguments of F_y in (23), less gain p and gain q
    problem.x_0 = x + k * p
    problem.y_0 = y + k * q
    problem.gain = theta_1 * theta_2 * h
    problem.belt = problem.belt_next
    problem.phi = c.phi
    problem.d = p
    problem.e = q
    problem.normal_force = state.force


@kernel
def finish(c: Coefficients, s: Weights, state: State, problem: Problem, contact: Contact, work: Works) -> None:
    """(21)-(22), and the works of the step: the scheme times the displacement of the step.

    m (p' - p)/h dx = change of kinetic energy + m (theta_2 - 1/2)|p' - p|², and the links likewise with
    theta_1 - 1/2: what a scheme with other weights than one half takes out of the motion by itself.
    """
    h = s.h
    p = state.v_x
    q = state.v_y
    p_new = problem.d
    q_new = problem.e
    friction = problem.a_11 * p_new + problem.a_12 * q_new - problem.g_1
    v_x = s.theta_2 * p_new + (1.0 - s.theta_2) * p
    v_y = s.theta_2 * q_new + (1.0 - s.theta_2) * q
    u_x = s.theta_1 * p_new + (1.0 - s.theta_1) * p
    u_y = s.theta_1 * q_new + (1.0 - s.theta_1) * q
    belt = s.theta_2 * problem.belt_next + (1.0 - s.theta_2) * problem.belt_now
    dx = h * v_x
    dy = h * v_y
    slid = h * (v_x - belt)
    work.belt += h * friction * belt
    work.friction -= friction * slid
    work.dashpots += dx * (c.b_xx * u_x + c.b_xy * u_y) + dy * (c.b_xy * u_x + c.b_yy * u_y)
    work.load += problem.load * (c.sin_beta * dx + c.cos_beta * dy)
    work.roughness += contact.store_x * slid
    inertia = c.m * ((p_new - p) ** 2 + (q_new - q) ** 2)
    links = c.c_xx * dx * dx + 2.0 * c.c_xy * dx * dy + c.c_yy * dy * dy
    layer = slid * (contact.store_x - work.store_x_before) - dy * (contact.normal_force - work.force_before)
    work.scheme += (s.theta_2 - 0.5) * inertia + (s.theta_1 - 0.5) * (links + layer)
    work.store_x_before = contact.store_x
    work.force_before = contact.normal_force
    state.x_old = state.x
    state.y_old = state.y
    state.x += dx  # Eq. (21)
    state.y += dy  # Eq. (22)
    state.v_x = p_new
    state.v_y = q_new
    state.force = problem.normal_force
