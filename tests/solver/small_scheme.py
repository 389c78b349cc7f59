"""A small scheme for the test of the registry: backward Euler, of first order, for any step."""

from typing import Any

from brakecli.solver import records
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.energy import energy_at_level
from brakecli.solver.kernels import kernel
from brakecli.solver.records import Pair, Weights

STATE = records.State
KEPT = "state"
LAG = 0
MEMORY: tuple[str, ...] = ("x", "y", "v_x", "v_y")
VELOCITIES: tuple[str, ...] = ("v_x", "v_y")
mechanical_energy = energy_at_level


def weighted_time(s: Weights) -> float:
    return 1.0


def order(s: Weights, start: str) -> int:
    return 1


def begin(s: Weights, state: Any, position: Pair, velocity: Pair, acceleration: Pair) -> None:
    state.x, state.y = position
    state.v_x, state.v_y = velocity


@kernel
def prepare(c: Coefficients, s: Weights, state: Any, problem: Any) -> None:
    h = s.h
    inertia = c.m / s.h
    problem.a_11 = inertia + c.b_xx + c.c_xx * h
    problem.a_12 = c.b_xy + c.c_xy * h
    problem.a_22 = inertia + c.b_yy + c.c_yy * h
    problem.g_1 = inertia * state.v_x - c.c_xx * state.x - c.c_xy * state.y - problem.load * c.sin_beta
    problem.g_2 = inertia * state.v_y - c.c_yy * state.y - c.c_xy * state.x - problem.load * c.cos_beta
    problem.x_0 = state.x
    problem.y_0 = state.y
    problem.gain = h
    problem.belt = problem.belt_next
    problem.phi = c.phi
    problem.d = state.v_x
    problem.e = state.v_y
    problem.normal_force = state.force


@kernel
def finish(c: Coefficients, s: Weights, state: Any, problem: Any, contact: Any, work: Any) -> None:
    p = problem.d
    q = problem.e
    dx = s.h * problem.d
    dy = s.h * problem.e
    friction = problem.a_11 * p + problem.a_12 * q - problem.g_1
    work.belt += s.h * friction * problem.belt
    work.friction -= friction * (dx - s.h * problem.belt)
    work.dashpots += dx * (c.b_xx * p + c.b_xy * q) + dy * (c.b_xy * p + c.b_yy * q)
    work.load += problem.load * (c.sin_beta * dx + c.cos_beta * dy)
    inertia = c.m * ((p - state.v_x) ** 2 + (q - state.v_y) ** 2)
    links = c.c_xx * dx * dx + 2.0 * c.c_xy * dx * dy + c.c_yy * dy * dy
    work.scheme += 0.5 * (inertia + links - dy * (contact.normal_force - work.force_before))
    work.force_before = contact.normal_force
    state.x += dx
    state.y += dy
    state.v_x = p
    state.v_y = q
    state.force = problem.normal_force
