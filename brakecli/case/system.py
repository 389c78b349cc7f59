"""From a case to the numbers that the solver works on."""

from brakecli.case.case import Case, Profile
from brakecli.solver.links import coefficients
from brakecli.solver.method import Method
from brakecli.solver.roughness import Surface, surface
from brakecli.solver.schedules import schedule
from brakecli.solver.system import Initial, System

EVENT_TOLERANCE = 1e-10
"""Tolerance of event-driven where a case gives it a step."""


def system_of(case: Case) -> System:
    """The system of a case, with the method that the case asks for."""
    turning, load, initial = case.wheel, case.load, case.initial
    return System(
        coefficients=coefficients(
            mass=case.shoe.mass,
            c_1=case.link1.stiffness,
            b_1=case.link1.damping,
            beta_deg=case.link1.angle_deg,
            c_2=case.link2.stiffness,
            b_2=case.link2.damping,
            alpha_deg=case.link2.angle_deg,
            phi=case.friction.coefficient,
        ),
        belt=schedule(
            turning.times or (0.0,), turning.angular_speeds or (turning.angular_speed or 0.0,), turning.radius
        ),
        load=schedule(load.times or (0.0,), load.forces or (load.force or 0.0,)),
        shoe=_surface(case.roughness.shoe),
        wheel=_surface(case.roughness.wheel),
        radius=turning.radius,
        half_length=case.contact.half_length,
        layer_stiffness=case.contact.stiffness,
        initial=Initial(initial.x, initial.y, initial.vx, initial.vy, initial.at == "equilibrium"),
        interval=case.output.sample_interval,
        duration=case.solver.duration,
        method=method_of(case),
    )


def method_of(case: Case) -> Method:
    """The method that a case asks for; a scheme that is still to be chosen is event-driven until then."""
    solver = case.solver
    automatic = solver.scheme == "auto"
    return Method(
        scheme="event-driven" if automatic else solver.scheme,
        theta=solver.theta,
        start=solver.start,
        iteration=solver.iteration,
        evaluator=case.contact.evaluator,
        nodes=case.contact.nodes or 0,
        step=solver.step,
        tolerance=solver.effective_tolerance or EVENT_TOLERANCE,
        allow_unconverged=solver.allow_unconverged,
        automatic=automatic,
    )


def _surface(profile: Profile | None) -> Surface:
    if profile is None:
        return surface()
    return surface(
        profile.amplitudes,
        wavelengths=profile.wavelengths,
        wavenumbers=profile.wavenumbers,
        phases_deg=profile.phases_deg,
    )
