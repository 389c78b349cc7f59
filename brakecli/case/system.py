"""From a case to the numbers that the solver works on."""

from brakecli.case.case import Case
from brakecli.case.parts import SETTLED
from brakecli.case.roughness import surface_of
from brakecli.case.schedules import belt_of, load_of
from brakecli.solver.links import natural_frequencies
from brakecli.solver.method import Method
from brakecli.solver.roughness import surface, turned
from brakecli.solver.system import Initial, System

_SMOOTH = surface()
EVENT_TOLERANCE = 1e-10  # of event-driven where a case gives it a step


def system_of(case: Case) -> System:
    """The system of a case, with the method that the case asks for."""
    wheel = case.wheel
    load = case.load
    initial = case.initial
    solver = case.solver
    automatic = solver.scheme == "auto"
    shoe, wheel_surface = (
        surface_of(profile, wheel.radius) if profile is not None else _SMOOTH
        for profile in (case.roughness.shoe, case.roughness.wheel)
    )
    if initial.wheel_angle and wheel_surface.g.size:
        wheel_surface = turned(wheel_surface, initial.wheel_angle * wheel.radius)
    slow, fast = natural_frequencies(case.coefficients, case.contact_stiffness)
    # First run of a case that is to settle: a window of its envelope, a fortieth of it, holds six slow periods.
    first = min(250.0 / (slow or fast), 500_000.0 * case.output.sample_interval)
    rough = shoe.g.size or wheel_surface.g.size  # where a tolerance may change the scheme
    return System(
        coefficients=case.coefficients,
        belt=belt_of(wheel),
        load=load_of(load),
        shoe=shoe,
        wheel=wheel_surface,
        radius=wheel.radius,
        half_length=case.contact.half_length,
        layer_stiffness=case.contact.stiffness,
        initial=Initial(initial.x, initial.y, initial.vx, initial.vy, initial.at == "equilibrium"),
        interval=case.output.sample_interval,
        duration=float(f"{first:.1e}") if solver.duration == SETTLED else solver.duration,
        budget=solver.budget or 0,
        method=Method(
            scheme=("event-driven" if rough else "piecewise-exact") if automatic else solver.scheme,
            theta=solver.theta,
            start=solver.start,
            iteration=solver.iteration,
            evaluator=case.contact.evaluator,
            nodes=case.contact.nodes or 0,
            step=solver.step,
            tolerance=solver.effective_tolerance or EVENT_TOLERANCE,
            allow_unconverged=solver.allow_unconverged,
            automatic=automatic and case.contact.evaluator == "auto",
        ),
        notes=tuple(
            f"roughness.{side}: {profile.note}" for side, profile in case.roughness if profile and profile.note
        ),
    )
