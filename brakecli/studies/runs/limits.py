"""What a case will take, which limits it meets, and what a careful user should know of it before it runs."""

import math
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from decimal import ROUND_DOWN, Context
from pathlib import Path

import numpy as np

from brakecli.analysis.stability.discrete import (
    RESOLVED,
    StepLimits,
    amplification,
    step_limits,
    without_damping,
)
from brakecli.analysis.stability.modes import eigensystem
from brakecli.analysis.stability.search import bisect
from brakecli.errors import RefusedError
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.history import ROW_BYTES
from brakecli.solver.links import natural_frequencies
from brakecli.solver.schedules import values
from brakecli.solver.schemes import module_of
from brakecli.solver.system import MOST_STEPS, WHOLE, System
from brakecli.studies.runs.plausible import implausible
from brakecli.studies.runs.settled import longest
from brakecli.studies.runs.work import held_bytes, work_of

MOST_BYTES = 1e11
UNSTABLE = 1e-5  # growth per step that no rounding of the eigenvalues explains
FILE_BYTES = 1e5  # of a result without its samples


@dataclass(frozen=True)
class Check:
    """The findings on a system, in SI units; frequencies in Hz. Each of the `warnings` names key and number."""

    system: System
    link_frequencies: tuple[float, float]
    step: float | None  # None: the scheme finds its steps itself, and `steps` is a rough guess
    steps: int
    steps_per_period: float
    limits: StepLimits
    nodes_per_wave: float | None
    memory: float  # bytes
    file_size: float  # bytes
    adjustments: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def check(system: System) -> Check:
    """Look at a case; nothing is run."""
    own = system.method.own_steps
    fastest = system.natural_frequencies[1]
    waves = 2.0 * system.half_length * system.most_turns
    result = Check(
        system=system,
        link_frequencies=natural_frequencies(system.coefficients, 0.0),
        step=None if own else system.step,
        steps=work_of(system).steps,
        steps_per_period=math.inf if own or not fastest > 0.0 else 1.0 / (fastest * system.step),
        limits=step_limits(system),
        nodes_per_wave=system.nodes / waves if system.nodes and waves > 0.0 else None,
        memory=2e8 + system.table_bytes + held_bytes(system),  # 200 MB for the process itself
        file_size=float(system.samples) * ROW_BYTES + FILE_BYTES,
        adjustments=tuple(adjustments(system)),
    )
    return replace(result, warnings=tuple(_warnings(result)))


def refuse(checked: Check, free_bytes: float = math.inf) -> None:
    """Raise RefusedError where a run would be too large, or unstable by its scheme."""
    system = checked.system
    growth = checked.limits.growth
    room = f"{checked.memory / 1e6:.0f} MB of memory, a file of {checked.file_size / 1e6:.3g} MB"
    size = f"about {checked.steps:.3g} steps, {room}"
    coarser = "solver.tolerance" if checked.step is None else "solver.step"
    remedy = f"reduce solver.duration, or increase {coarser} or output.sample_interval"
    if checked.steps > MOST_STEPS:
        raise RefusedError(f"the run is too long: {size}, and {MOST_STEPS:.0e} are the most; {remedy}")
    if checked.file_size > min(MOST_BYTES, free_bytes):
        raise RefusedError(f"the file would be too large, {free_bytes / 1e6:.3g} MB are free: {size}; {remedy}")
    system.refuse_tables()
    system.refuse_steps(held_bytes(system))
    if _blows_up(growth, checked.steps):
        longest = _longest_stable_step(system)
        shorter = f"take a solver.step of at most {_down(longest)} s" if longest else "reduce solver.step"
        what = f"it multiplies disturbances by {growth:.6g} in each of {checked.steps} steps"
        remedy = f"{shorter}, {system.method.row.unstable}"
        raise RefusedError(f"solver.theta: at this step the scheme is unstable: {what}; {remedy}")


def _blows_up(growth: float, steps: float) -> bool:
    return growth > 1.0 + UNSTABLE and (growth - 1.0) * steps > 1.0


def _longest_stable_step(system: System) -> float | None:
    """The longest step (s) at which a run of this duration would not blow up."""

    def is_stable(step: float) -> bool:
        return not _blows_up(step_limits(system, step).growth, system.sampled_duration / step)

    shortest = 1e-6 * system.step
    if not is_stable(shortest):
        return None
    return bisect(is_stable, shortest, system.step, ratio=1.001, geometric=True)[0]


def _down(number: float) -> str:
    """Two digits of a number, rounded down: what is advised is not more than what helps."""
    two_digits = Context(prec=2, rounding=ROUND_DOWN)
    return f"{float(two_digits.create_decimal_from_float(number)):.2g}"


def adjustments(system: System) -> list[str]:
    """Sentences on how a run differs from the numbers of the case: surfaces, start, grid of time, and nodes."""
    method = system.method
    interval = system.interval
    step = system.method.step
    sentences = [*system.notes]
    start = system.initial
    if start.from_equilibrium and (start.x or start.y):
        moved = f"x = {start.x:g} m and y = {start.y:g} m are added to the position of steady sliding"
        sentences.append(f"initial: {moved}")
    if method.own_steps and step is not None:
        accuracy = "which are exact" if method.row.exact else f"to a tolerance of {method.tolerance:g}"
        sentences.append(f"solver.step: not used, {method.scheme} finds its steps itself, {accuracy}")
    if step is None and method.nodes:
        sentences.append("contact.nodes: not used, the tolerance chooses nodes itself")
    if step and not method.own_steps and abs(interval / step - system.per_sample) > WHOLE * system.per_sample:
        fitted = f"{system.step:.9g} s, {system.per_sample} to the sample interval of {interval:g} s"
        sentences.append(f"solver.step: reduced from {step:g} s to {fitted}")
    if system.settles:
        until = f"until the verdict is decided, up to {longest(system):.6g} s, or {system.budget:,} steps in all"
        sentences.append(
            f"solver.duration: {system.sampled_duration:.6g} s at first, then twice as long and so on, {until}"
        )
    elif abs(system.duration / interval - system.samples) > WHOLE * system.samples:
        end = f"the next sample at {system.sampled_duration:.9g} s"
        sentences.append(f"solver.duration: extended from {system.duration:g} s to {end}")
    return sentences


def _warnings(checked: Check) -> Iterator[str]:
    """What a careful user would want to know: one sentence each, with its key and number."""
    system = checked.system
    per_wave = checked.nodes_per_wave
    if not system.method.own_steps:
        for what, longest, otherwise in _unresolved(system, checked.steps_per_period):
            yield f"solver.step: {what}; take a step of at most {_down(longest)} s{otherwise}"
    nyquist = 0.5 / system.interval
    contact = system.natural_frequencies[1]
    waves = system.passing_frequency
    for what, frequency in (("the contact resonance", contact), ("the shortest wave of the wheel", waves)):
        if frequency > nyquist:
            above = f"lies above half the sampling rate ({nyquist:.4g} Hz) and would be aliased"
            remedy = f"sample every {_down(0.4 / frequency)} s or more often"  # with room below half a period
            yield f"output.sample_interval: {what} at {frequency:.4g} Hz {above} in the spectra; {remedy}"
    if per_wave is not None:
        coarse = 0.5 * EVALUATORS[system.evaluator].nodes_per_wave  # half of the usual ones
        nodes = min(system.method.nodes or system.nodes, system.nodes)
        if per_wave * nodes < coarse * system.nodes:
            remedy = f"take at least {math.ceil(system.nodes * coarse / per_wave)}, or leave nodes out"
            taken = f" ({system.nodes} are taken)" if nodes < system.nodes else ""
            few = f"{per_wave * nodes / system.nodes:.3g} nodes per shortest wavelength"
            yield f"contact.nodes: {few}; {remedy}{taken}"
    yield from _of_the_scheme(system, checked.limits, checked.steps)
    pad = 2.0 * system.half_length
    around = 2.0 * math.pi * system.radius
    if pad > around:
        longer = f"the pad of {pad:.3g} m is longer than the wheel's circumference of {around:.3g} m"
        yield f"contact.half_length: {longer}; check their units"
    if values(system.load).min() < 0.0:
        yield "load: the force is negative at times, it lifts the shoe off the wheel"
    yield from implausible(system)  # last: the first one is all that a sweep tells of a point


def _unresolved(system: System, per_period: float) -> Iterator[tuple[str, float, str]]:
    """What the step is too long for, the longest step (s) that is not, and another remedy."""
    c = system.coefficients
    step = system.step
    fastest = system.natural_frequencies[1]
    if per_period < RESOLVED:
        what = f"{per_period:.3g} steps per period of the fastest motion ({fastest:.4g} Hz): it is not resolved"
        yield what, 1.0 / (RESOLVED * fastest), ""
    else:  # perhaps not for the dashpots, where they are overcritical
        rate = float(np.abs(eigensystem(c, system.contact_stiffness, 0.0)[0]).max())
        if rate * step > 2.0 * math.pi / RESOLVED:
            what = f"the dashpots damp a motion at a rate of {rate:.4g} 1/s, which the step does not resolve"
            yield what, 2.0 * math.pi / (RESOLVED * rate), ", or event-driven"
    passing = system.passing_frequency
    speed = system.fastest_belt
    if passing * step > 1.0 / RESOLVED:
        what = f"{1.0 / (passing * step):.3g} steps per passing wave of the wheel ({passing:.4g} Hz)"
        yield what, 1.0 / (RESOLVED * passing), ""
    grip = c.phi * float(np.abs(values(system.load)).max()) / c.m
    if 0.0 < speed < grip * step:
        what = f"friction changes the shoe's velocity by up to {grip * step:.3g} m/s in a step"
        more = f"more than the wheel's {speed:.3g} m/s: stick and slip are not resolved"
        yield f"{what}, {more}", speed / grip, ", or event-driven"


def _of_the_scheme(system: System, limits: StepLimits, steps: int) -> Iterator[str]:
    """What iteration and weights do to the motion."""
    method = system.method
    if method.iteration == "fixed-point" and limits.contraction >= 1.0:
        bound = f"the bound of its contraction factor is {limits.contraction:.3g}, above 1"
        remedy = f'take "newton", or a step of at most {_down(system.step / math.sqrt(limits.contraction))} s'
        yield f"solver.iteration: the fixed-point iteration may diverge ({bound}); {remedy}"
    if not limits.unique:
        wedged = "friction can wedge the shoe into the wheel within a step; reduce solver.step or the coefficient"
        yield f"friction.coefficient: a step may have more than one solution, as {wedged}"
    if limits.growth > 1.0 + max(UNSTABLE, 1e-3 / steps):  # a thousandth by the end of the run
        what = f"the scheme itself multiplies disturbances by {limits.growth:.6g} in each step"
        yield f"solver.theta: {what}; reduce solver.step, {method.row.unstable}"
    taken = 0.0 if method.own_steps else _taken(system, steps)
    if taken > 0.01:
        away = f"it takes {100.0 * taken:.3g} % of the fastest motion away by the end of the run"
        what = f"the scheme itself damps, {away}, and its errors are of first order"
        yield f"solver.theta: with these weights {what}; {without_damping(method)}"


def _taken(system: System, steps: int) -> float:
    """Part of the fastest motion, without dashpots and friction, that the scheme takes away in so many steps."""
    c = system.coefficients._replace(b_xx=0.0, b_xy=0.0, b_yy=0.0, phi=0.0)
    scheme = module_of(system.method.scheme)
    factors = np.linalg.eigvals(amplification(c, system.weights, scheme, system.contact_stiffness))
    factor = float(np.abs(factors[np.argmax(np.abs(np.angle(factors)))]))  # not a direction without a spring
    if factor > 1.0 - 1e-8:  # what is less is rounding
        return 0.0
    return -math.expm1(steps * math.log(factor)) if factor > 0.0 else 1.0


def free_bytes(directory: Path) -> float:
    """What is free on the disk of a directory; infinite where that is not known."""
    with suppress(OSError):
        return float(shutil.disk_usage(directory).free)
    return math.inf


@contextmanager
def within_range() -> Iterator[None]:
    """Turn an overflow of numbers that no brake has, however the code meets it, into a refusal."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        what = f"the numbers of the case are too large, too small or too far apart to compute with ({error})"
        raise RefusedError(f"{what}; look for values in other units than m, kg, s and N") from error
