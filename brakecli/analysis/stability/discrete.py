"""What a scheme makes of the linear motion in one step: the limits of the step, and its amplification."""

from dataclasses import dataclass
from functools import lru_cache
from typing import cast

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact.pad import build_layer, build_pad
from brakecli.solver.method import MOST_EVALUATIONS, Method
from brakecli.solver.records import Problem, Weights, Works, new
from brakecli.solver.roughness import surface
from brakecli.solver.schemes import SteppingModule, module_of
from brakecli.solver.steps.implicit import newton
from brakecli.solver.system import System

RESOLVED = 20  # steps per period, and per passing wave, below which a warning names the number
DIFFERENCE = 1e-3  # of the static compression: disturbance by which the matrix of a step is found


@dataclass(frozen=True)
class StepLimits:
    """How one step of the scheme takes the contact."""

    contraction: float  # bound of the factor of the error in a fixed-point iteration: above 1 it may diverge
    unique: bool  # whether a step is sure to have one solution
    growth: float  # factor of a disturbance of the frictionless, fully touching shoe: above 1 it is unstable


def step_limits(system: System, step: float | None = None) -> StepLimits:
    """The limits of the system's scheme at its step, or at another one (s), in full contact.

    A scheme that finds its steps itself solves no equations in them and is as stable as the motion.
    """
    if system.method.own_steps:
        return StepLimits(contraction=0.0, unique=True, growth=1.0)
    scheme = cast(SteppingModule, module_of(system.method.scheme))
    c = system.coefficients
    contact_stiffness = system.contact_stiffness
    s = system.weights if step is None else system.weights._replace(h=step)
    problem = new(Problem)
    scheme.prepare(c, s, new(scheme.STATE), problem)
    a_11, a_12, a_22, gain = (float(entry) for entry in (problem.a_11, problem.a_12, problem.a_22, problem.gain))
    a = a_11 * a_22 - a_12 * a_12
    steepest = contact_stiffness * float(np.abs(system.wheel.g) @ system.wheel.omega)  # bound of |∂F_y/∂x|
    # ∂e/∂F on the slip branches
    lift = (a_11 + c.phi * abs(a_12)) / a
    least = (a_11 - c.phi * abs(a_12)) / a
    rise = gain * (contact_stiffness * max(0.0, -least) + steepest * (abs(a_12) + c.phi * a_22) / a)
    matrix = amplification(c._replace(phi=0.0), s, scheme, contact_stiffness)
    return StepLimits(
        contraction=float(gain * contact_stiffness * max(lift, 1.0 / a_22)),
        unique=bool(rise < 1.0),
        growth=float(np.abs(np.linalg.eigvals(matrix)).max()),
    )


@lru_cache(maxsize=16)  # a sweep over friction asks for the same two at every point
def amplification(c: Coefficients, s: Weights, scheme: SteppingModule, contact_stiffness: float) -> Floats:
    """Amplification matrix of a scheme on the case's grid for steady sliding in full, smooth contact, U > 0.

    It acts on the scheme's memory of the motion, with velocities times h. The step is taken from a deep, loaded
    equilibrium and from its neighbours: while nothing opens or sticks, it is affine and differences are exact.
    """
    layer = build_layer("closed-form", build_pad(contact_stiffness, 0.5, surface(), surface(), 0))
    # y = -1, x = 0 is the equilibrium under a load of the size of the contact stiffness.
    loaded = c._replace(sin_beta=c.c_xy / contact_stiffness + c.phi, cos_beta=1.0 + c.c_yy / contact_stiffness)
    scales = [1.0 / s.h if name in scheme.VELOCITIES else 1.0 for name in scheme.MEMORY]

    def step(moved: str | None = None, by: float = 0.0) -> Floats:
        state = new(scheme.STATE)
        problem = new(Problem)
        state.y = state.y_old = -1.0
        state.force = problem.load = contact_stiffness
        problem.belt_now = problem.belt_next = 1e3 / s.h  # a belt so fast that nothing sticks
        if moved is not None:
            setattr(state, moved, getattr(state, moved) + by)
        scheme.prepare(loaded, s, state, problem)
        newton(*layer, problem, MOST_EVALUATIONS["newton"])
        scheme.finish(loaded, s, state, problem, layer.contact, new(Works))
        return np.array([getattr(state, name) for name in scheme.MEMORY]) / scales

    neighbours = [step(name, DIFFERENCE * scale) for name, scale in zip(scheme.MEMORY, scales, strict=True)]
    matrix: Floats = (np.array(neighbours) - step()).T / DIFFERENCE
    matrix.flags.writeable = False
    return matrix


def spectral_radius(system: System, contact_stiffness: float, phi: float, step: float | None = None) -> float:
    """Factor by which the scheme multiplies the fastest disturbance of steady sliding in a step, U ≠ 0.

    The step (s) is that of the case unless it is given. 0 where nothing touches.
    """
    if not contact_stiffness > 0.0:
        return 0.0
    c = system.coefficients._replace(phi=phi)
    s = system.weights if step is None else system.weights._replace(h=step)
    if system.belt_speed < 0.0:  # the same shoe seen from behind: x and U change sign, and so do the couplings
        c = c._replace(b_xy=-c.b_xy, c_xy=-c.c_xy, sin_beta=-c.sin_beta)
    scheme = cast(SteppingModule, module_of(system.method.scheme))
    return float(np.abs(np.linalg.eigvals(amplification(c, s, scheme, contact_stiffness))).max())


def without_damping(method: Method) -> str:
    """What to do where the steps of a scheme damp what the shoe itself does not."""
    weights = list(method.row.theta)
    return f"take theta = {weights}" if weights else "take another scheme, or a shorter step"
