"""What a careful user would want to know of a case before it runs: one sentence each, with its key and number."""

import math
from collections.abc import Iterator

import numpy as np

from brakecli.analysis.stability.discrete import RESOLVED, StepLimits, amplification
from brakecli.analysis.stability.modes import eigensystem
from brakecli.solver.contact.pad import NODES_PER_WAVE
from brakecli.solver.system import WHOLE, System

UNSTABLE = 1e-5  # growth per step that no rounding of the eigenvalues explains
_COARSE_NODES = NODES_PER_WAVE / 2
_TAKEN = 0.01  # part of the fastest motion that a scheme may take out of a run unsaid
_ROUNDING = 1e-8  # of the factors of a step


def adjustments(system: System) -> list[str]:
    """Sentences on how a run differs from what the case asks for: the grid of time, and nodes."""
    method, interval, asked, found = system.method, system.interval, system.method.step, list[str]()
    if method.own_steps and asked is not None:
        kept = f"to a tolerance of {method.tolerance:g}"
        found.append(f"solver.step: not used, event-driven finds its steps itself, {kept}")
    if asked is None and method.nodes:
        found.append("contact.nodes: not used, the tolerance chooses nodes itself")
    if asked and not method.own_steps and abs(interval / asked - system.per_sample) > WHOLE * system.per_sample:
        fitted = f"{system.step:.9g} s, {system.per_sample} to the sample interval of {interval:g} s"
        found.append(f"solver.step: reduced from {asked:g} s to {fitted}")
    if abs(system.duration / interval - system.samples) > WHOLE * system.samples:
        end = f"the next sample at {system.sampled_duration:.9g} s"
        found.append(f"solver.duration: extended from {system.duration:g} s to {end}")
    return found


def warnings(
    system: System, limits: StepLimits, steps: int, per_period: float, per_wave: float | None
) -> Iterator[str]:
    """All warnings on a run of so many steps, by its steps per fastest period and its nodes per shortest wave."""
    if not system.method.own_steps:
        for what, longest, otherwise in _unresolved(system, per_period):
            yield f"solver.step: {what}; take a step of at most {longest:.2g} s{otherwise}"
    nyquist, contact, waves = 0.5 / system.interval, system.natural_frequencies[1], system.passing_frequency
    for what, frequency in (("the contact resonance", contact), ("the shortest wave of the wheel", waves)):
        if frequency > nyquist:
            above = f"lies above half the sampling rate ({nyquist:.4g} Hz)"
            yield (
                f"output.sample_interval: {what} at {frequency:.4g} Hz {above} and would appear at a wrong place "
                f"in the spectra; sample every {0.4 / frequency:.2g} s or more often"
            )
    if per_wave is not None and per_wave < _COARSE_NODES:
        remedy = f"take at least {math.ceil(system.nodes * _COARSE_NODES / per_wave)}, or leave nodes out"
        yield f"contact.nodes: {per_wave:.3g} nodes per shortest wavelength; {remedy}"
    yield from _of_the_scheme(system, limits, steps)
    if system.load["value"].min() < 0.0:
        yield "load: the force is negative at times, it lifts the shoe off the wheel"


def _unresolved(system: System, per_period: float) -> Iterator[tuple[str, float, str]]:
    """What the step is too long for, the longest step (s) that is not, and another remedy."""
    c, step, fastest = system.coefficients, system.step, system.natural_frequencies[1]
    if per_period < RESOLVED:
        what = f"{per_period:.3g} steps per period of the fastest motion ({fastest:.4g} Hz): it is not resolved"
        yield what, 1.0 / (RESOLVED * fastest), ""
    else:  # perhaps not for the dashpots, where they are overcritical
        rate = float(np.abs(eigensystem(c, system.contact_stiffness, 0.0)[0]).max())
        if rate * step > 2.0 * math.pi / RESOLVED:
            what = f"the dashpots settle a motion at a rate of {rate:.4g} 1/s: it is not resolved"
            yield what, 2.0 * math.pi / (RESOLVED * rate), ", or event-driven"
    passing, speed = system.passing_frequency, system.fastest_belt
    if passing * step > 1.0 / RESOLVED:
        what = f"{1.0 / (passing * step):.3g} steps per passing wave of the wheel ({passing:.4g} Hz)"
        yield what, 1.0 / (RESOLVED * passing), ""
    grip = c.phi * float(np.abs(system.load["value"]).max()) / c.m
    if 0.0 < speed < grip * step:
        what = f"friction changes the shoe's velocity by up to {grip * step:.3g} m/s in a step"
        more = f"more than the wheel's {speed:.3g} m/s: stick and slip are not resolved"
        yield f"{what}, {more}", speed / grip, ", or event-driven"


def _of_the_scheme(system: System, limits: StepLimits, steps: int) -> Iterator[str]:
    """What iteration and weights do to the motion."""
    method = system.method
    if method.iteration == "fixed-point" and limits.contraction >= 1.0:
        bound = f"its bound of contraction is {limits.contraction:.3g}, above 1"
        remedy = f'take "newton", or a step of at most {system.step / math.sqrt(limits.contraction):.2g} s'
        yield f"solver.iteration: the fixed-point iteration may diverge ({bound}); {remedy}"
    if not limits.unique:
        yield (
            "friction.coefficient: a step may have more than one solution, as friction can wedge the shoe into "
            "the wheel within a step; reduce solver.step or the coefficient"
        )
    if limits.growth > 1.0 + max(UNSTABLE, 1e-3 / steps):
        what = f"the scheme itself multiplies disturbances by {limits.growth:.6g} in each step"
        yield f"solver.theta: {what}; reduce solver.step, {method.row.unstable}"
    taken = 0.0 if method.own_steps else _taken(system, steps)
    if taken > _TAKEN:
        weights = list(method.row.theta)
        remedy = f"take theta = {weights}" if weights else "take another scheme, or a shorter step"
        yield (
            f"solver.theta: with these weights the scheme itself damps, it takes {100.0 * taken:.3g} % of the "
            f"fastest motion away by the end of the run, and its errors are of first order; {remedy}"
        )


def _taken(system: System, steps: int) -> float:
    """Part of the fastest motion, without dashpots and friction, that the scheme takes away in so many steps."""
    c = system.coefficients._replace(b_xx=0.0, b_xy=0.0, b_yy=0.0, phi=0.0)
    factors = np.linalg.eigvals(amplification(c, system.weights, system.scheme, system.contact_stiffness))
    left = float(np.abs(factors[np.argmax(np.abs(np.angle(factors)))]))  # not a direction without a spring
    if left > 1.0 - _ROUNDING:
        return 0.0
    return -math.expm1(steps * math.log(left)) if left > 0.0 else 1.0
