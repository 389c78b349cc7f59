"""From a case to the numbers that the time loop works on."""

import math
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import EVENT_TOLERANCE, Case, Evaluator, Profile, Scheme
from brakecli.solver import contact, schemes
from brakecli.solver.compile import Coefficients, Weights
from brakecli.solver.contact.pad import build_pad, default_nodes
from brakecli.solver.implicit_step import MOST
from brakecli.solver.links import coefficients
from brakecli.solver.loop import Drive, Grid
from brakecli.solver.roughness import Surface, surface
from brakecli.solver.schedules import Schedule, schedule, value_at

WHOLE = 1e-9
"""A ratio this close to a whole number is whole."""


@dataclass(frozen=True)
class Timing:
    """The grid of time that a run really uses, and how it differs from the case's."""

    interval: float
    per_sample: int
    samples: int  # after the one at t = 0
    adjustments: tuple[str, ...]

    @property
    def step(self) -> float:
        """h, s."""
        return self.interval / self.per_sample

    @property
    def steps(self) -> int:
        """Steps from the first sample to the last."""
        return self.samples * self.per_sample


def timing(case: Case) -> Timing:
    """Fit the step into the sample interval and the interval into the duration."""
    interval, duration = case.output.sample_interval, case.solver.duration
    step = case.solver.step or interval
    own_steps = case.solver.scheme in (Scheme.EVENT_DRIVEN, Scheme.AUTO)
    if own_steps:  # it sees the grid of samples alone
        step = interval
    per_sample, samples = _at_least(interval / step), _at_least(duration / interval)
    adjustments = []
    if own_steps and case.solver.step is not None:
        adjustments.append(
            f"solver.step: not used, event-driven finds its steps itself, to a tolerance of {EVENT_TOLERANCE:g}"
        )
    if case.solver.effective_tolerance is not None and case.contact.nodes is not None:
        adjustments.append("contact.nodes: not used, the tolerance chooses nodes itself")
    if abs(interval / step - per_sample) > WHOLE * per_sample:
        adjustments.append(
            f"solver.step: reduced from {step:g} s to {interval / per_sample:.9g} s, "
            f"{per_sample} to the sample interval of {interval:g} s"
        )
    if abs(duration / interval - samples) > WHOLE * samples:
        adjustments.append(
            f"solver.duration: extended from {duration:g} s to the next sample at {samples * interval:.9g} s"
        )
    return Timing(interval, per_sample, samples, tuple(adjustments))


def _at_least(ratio: float) -> int:
    """The whole number that is not below a ratio, but for rounding."""
    nearest = max(1, round(ratio))
    return nearest if abs(ratio - nearest) <= WHOLE * nearest else max(1, math.ceil(ratio))


@dataclass(frozen=True)
class Setup:
    """A case in numbers."""

    case: Case
    timing: Timing
    coefficients: Coefficients
    weights: Weights
    belt: Schedule
    load: Schedule
    shoe: Surface
    wheel: Surface
    nodes: int  # 0 where no quadrature can be needed
    evaluator: str  # the one that runs: "auto" on smooth surfaces is "closed-form"

    @cached_property
    def pad(self) -> NDArray[np.float64]:
        """Constants and tables of the contact."""
        return build_pad(
            self.case.contact.stiffness, self.case.contact.half_length, self.shoe, self.wheel, self.nodes
        )

    @cached_property
    def scheme(self) -> ModuleType:
        """The scheme's module."""
        scheme = self.case.solver.scheme
        return schemes.load(Scheme.EVENT_DRIVEN if scheme is Scheme.AUTO else scheme)

    @cached_property
    def evaluate(self) -> Any:
        """The evaluator's kernel."""
        return contact.load(self.evaluator)

    @property
    def smooth(self) -> bool:
        """Whether neither surface has any roughness."""
        return self.shoe.g.size == 0 and self.wheel.g.size == 0

    @property
    def contact_stiffness(self) -> float:
        """2ak, N/m: the contact that touches everywhere."""
        return 2.0 * self.case.contact.half_length * self.case.contact.stiffness

    @property
    def belt_speed(self) -> float:
        """U at the start, m/s."""
        return float(value_at(self.belt, 0.0))

    @property
    def _tolerance(self) -> float:
        """What a scheme with steps of its own keeps."""
        return (
            EVENT_TOLERANCE if self.case.solver.step is not None else self.case.solver.effective_tolerance or 0.0
        )

    @property
    def drive(self) -> Drive:
        """What acts from outside."""
        return Drive(self.belt, self.load, self.wheel)

    @property
    def grid(self) -> Grid:
        """The loop's view of the timing."""
        return Grid(
            self.timing.interval,
            self.timing.per_sample,
            self.scheme.weighted_time(self.weights),
            self.scheme.LAG,
            MOST[self.case.solver.iteration],
            int(self.case.solver.allow_unconverged),
            self.timing.samples,
            self._tolerance,
        )


def set_up(case: Case) -> Setup:
    """Work out every number of a case; tables and kernels follow when they are first asked for."""
    shoe, wheel = _surface(case.roughness.shoe), _surface(case.roughness.wheel)
    evaluator = case.contact.evaluator
    smooth = shoe.g.size == 0 and wheel.g.size == 0
    if evaluator is Evaluator.AUTO and smooth:
        evaluator = Evaluator.CLOSED_FORM
    elif evaluator is Evaluator.AUTO and case.solver.scheme in (Scheme.EVENT_DRIVEN, Scheme.AUTO):
        evaluator = Evaluator.EXACT
    nodes = case.contact.nodes or default_nodes(case.contact.half_length, shoe, wheel)
    times = timing(case)
    turning, load = case.wheel, case.load
    speeds = turning.angular_speeds or (turning.angular_speed or 0.0,)
    theta = (*case.solver.theta, 0.0, 0.0, 0.0)[:3]
    return Setup(
        case=case,
        timing=times,
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
        weights=Weights(times.step, *theta),
        belt=schedule(turning.times or (0.0,), speeds, turning.radius),
        load=schedule(load.times or (0.0,), load.forces or (load.force or 0.0,)),
        shoe=shoe,
        wheel=wheel,
        nodes=nodes if evaluator in (Evaluator.AUTO, Evaluator.MIDPOINT) else 0,
        evaluator=str(evaluator),
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
