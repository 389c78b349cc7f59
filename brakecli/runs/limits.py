"""What a case will cost and which limits it meets, before anything is computed."""

import math
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from brakecli.analysis.stability.discrete import (
    RESOLVED,
    StepLimits,
    amplification,
    step_limits,
)
from brakecli.analysis.stability.modes import eigensystem
from brakecli.analysis.stability.search import bisect
from brakecli.errors import RefusedError
from brakecli.runs.cost import duration_text, own_steps, seconds_per_step
from brakecli.solver.contact.pad import NODES_PER_WAVE
from brakecli.solver.history import ROW_BYTES
from brakecli.solver.links import natural_frequencies
from brakecli.solver.loop import COLUMNS
from brakecli.solver.system import WHOLE, System

MOST_STEPS = 1e11
MOST_SECONDS = 24 * 3600.0
MOST_BYTES = 1e11
MOST_TABLE_BYTES = 4e9

_UNSTABLE = 1e-5  # growth per step that no rounding of the eigenvalues explains
_COARSE_NODES = NODES_PER_WAVE / 2
_TAKEN = 0.01  # part of the fastest motion that a scheme may take out of a run unsaid
_ROUNDING = 1e-8  # of the factors of a step


@dataclass(frozen=True)
class Check:
    """The findings, in SI units; frequencies in Hz. `warnings` are sentences that name key and number."""

    coefficients: dict[str, float]  # of (6)-(7), named as in `model.COEFFICIENTS`
    belt_speed: float
    contact_stiffness: float
    natural_frequencies: tuple[float, float]  # on the links and the contact that touches everywhere
    link_frequencies: tuple[float, float]
    passing_frequency: float  # of the shortest wave of the wheel
    step: float | None  # None: the scheme finds its steps itself, and `steps` is a rough guess
    steps: int
    steps_per_period: float
    limits: StepLimits
    evaluator: str
    nodes: int
    nodes_per_wave: float | None
    seconds: float
    memory: float  # bytes
    file_size: float  # bytes
    adjustments: tuple[str, ...]
    warnings: tuple[str, ...]


def adjustments(system: System) -> list[str]:
    """Sentences on how a run differs from what the case asks for: the grid of time, and nodes."""
    method, interval, asked, step = system.method, system.interval, system.method.step, system.step
    found = []
    if method.own_steps and asked is not None:
        found.append(
            f"solver.step: not used, event-driven finds its steps itself, to a tolerance of {method.tolerance:g}"
        )
    if asked is None and method.nodes:
        found.append("contact.nodes: not used, the tolerance chooses nodes itself")
    if asked and not method.own_steps and abs(interval / asked - system.per_sample) > WHOLE * system.per_sample:
        found.append(
            f"solver.step: reduced from {asked:g} s to {step:.9g} s, "
            f"{system.per_sample} to the sample interval of {interval:g} s"
        )
    if abs(system.duration / interval - system.samples) > WHOLE * system.samples:
        found.append(
            f"solver.duration: extended from {system.duration:g} s to the next sample at "
            f"{system.sampled_duration:.9g} s"
        )
    return found


def check(system: System) -> Check:
    """Look at a case without stepping it."""
    stiffness, frequencies = system.contact_stiffness, system.natural_frequencies
    waves = 2.0 * system.half_length * system.most_turns
    limits = step_limits(system)
    own = system.method.own_steps
    steps, runs = own_steps(system) if own else (system.steps, 1.0)
    per_period = 1.0 / (frequencies[1] * system.step) if frequencies[1] > 0.0 and not own else math.inf
    found = Check(
        coefficients=system.coefficients._asdict(),
        belt_speed=system.belt_speed,
        contact_stiffness=stiffness,
        natural_frequencies=frequencies,
        link_frequencies=natural_frequencies(system.coefficients, 0.0),
        passing_frequency=system.passing_frequency,
        step=None if own else system.step,
        steps=steps,
        steps_per_period=per_period,
        limits=limits,
        evaluator=system.evaluator,
        nodes=system.nodes,
        nodes_per_wave=system.nodes / waves if system.nodes and waves > 0.0 else None,
        seconds=runs * steps * seconds_per_step(system),
        memory=1.5e8 + 8.0 * system.nodes * (2 * len(system.wheel.g) + 2),
        file_size=float(system.samples) * ROW_BYTES + 1e5,
        adjustments=tuple(adjustments(system)),
        warnings=(),
    )
    return _with_warnings(system, found)


def _with_warnings(system: System, found: Check) -> Check:
    """Add what a careful user would want to know before the run."""
    limits, warnings = found.limits, []
    if found.steps_per_period < RESOLVED:
        warnings.append(
            f"solver.step: {found.steps_per_period:.3g} steps per period of the fastest motion "
            f"({found.natural_frequencies[1]:.4g} Hz): it is not resolved; take a step of at most "
            f"{1.0 / (RESOLVED * found.natural_frequencies[1]):.2g} s"
        )
    elif (rate := _settling_rate(system)) * (found.step or 0.0) > 2.0 * math.pi / RESOLVED:
        warnings.append(
            f"solver.step: the dashpots settle a motion at a rate of {rate:.4g} 1/s: it is not resolved; take a "
            f"step of at most {2.0 * math.pi / (RESOLVED * rate):.2g} s, or event-driven"
        )
    if found.step is not None and found.passing_frequency * found.step > 1.0 / RESOLVED:
        warnings.append(
            f"solver.step: {1.0 / (found.passing_frequency * found.step):.3g} steps per passing wave of the wheel "
            f"({found.passing_frequency:.4g} Hz); take a step of at most "
            f"{1.0 / (RESOLVED * found.passing_frequency):.2g} s"
        )
    speed = system.fastest_belt
    grip = system.coefficients.phi * float(np.abs(system.load.values).max()) / system.coefficients.m
    if 0.0 < speed < grip * (found.step or 0.0):
        warnings.append(
            f"solver.step: friction changes the shoe's velocity by up to {grip * (found.step or 0.0):.3g} m/s in "
            f"a step, more than the wheel's {speed:.3g} m/s: stick and slip are not resolved; take a step of at "
            f"most {speed / grip:.2g} s, or event-driven"
        )
    nyquist = 0.5 / system.interval
    for what, frequency in (
        ("the contact resonance", found.natural_frequencies[1]),
        ("the shortest wave of the wheel", found.passing_frequency),
    ):
        if frequency > nyquist:
            warnings.append(
                f"output.sample_interval: {what} at {frequency:.4g} Hz lies above half the sampling rate "
                f"({nyquist:.4g} Hz) and would appear at a wrong place in the spectra; sample every "
                f"{0.4 / frequency:.2g} s or more often"
            )
    if found.nodes_per_wave is not None and found.nodes_per_wave < _COARSE_NODES:
        warnings.append(
            f"contact.nodes: {found.nodes_per_wave:.3g} nodes per shortest wavelength; "
            f"take at least {math.ceil(found.nodes * _COARSE_NODES / found.nodes_per_wave)}, or leave nodes out"
        )
    if system.method.iteration == "fixed-point" and limits.contraction >= 1.0:
        warnings.append(
            f"solver.iteration: the fixed-point iteration may diverge (its bound of contraction is "
            f'{limits.contraction:.3g}, above 1); take "newton", or a step of at most '
            f"{system.step / math.sqrt(limits.contraction):.2g} s"
        )
    if not limits.unique:
        warnings.append(
            "friction.coefficient: a step may have more than one solution, as friction can wedge the shoe into "
            "the wheel within a step; reduce solver.step or the coefficient"
        )
    if 1.0 + 1e-3 / found.steps < limits.growth and limits.growth > 1.0 + _UNSTABLE:
        warnings.append(
            f"solver.theta: the scheme itself multiplies disturbances by {limits.growth:.6g} in each step; "
            f"reduce solver.step, {system.method.row.unstable}"
        )
    taken = 0.0 if found.step is None else _taken(system, found.steps)
    if taken > _TAKEN:
        warnings.append(
            f"solver.theta: with these weights the scheme itself damps, it takes {100.0 * taken:.3g} % of the "
            "fastest motion away by the end of the run, and its errors are of first order; take theta = "
            + str(list(system.method.row.theta))
        )
    if system.load.values.min() < 0.0:
        warnings.append("load: the force is negative at times, it lifts the shoe off the wheel")
    return Check(**{**found.__dict__, "warnings": tuple(warnings)})


def _settling_rate(system: System) -> float:
    """The fastest rate (1/s) of the frictionless shoe: that of its dashpots where they are overcritical."""
    values, _ = eigensystem(system.coefficients, system.contact_stiffness, 0.0)
    return float(np.abs(values).max())


def _taken(system: System, steps: int) -> float:
    """Part of the fastest motion, without dashpots and friction, that the scheme takes away in so many steps."""
    c = system.coefficients._replace(b_xx=0.0, b_xy=0.0, b_yy=0.0, phi=0.0)
    factors = np.linalg.eigvals(amplification(c, system.weights, system.scheme, system.contact_stiffness))
    left = float(np.abs(factors[np.argmax(np.abs(np.angle(factors)))]))  # not a direction without a spring
    if left > 1.0 - _ROUNDING:
        return 0.0
    return -math.expm1(steps * math.log(left)) if left > 0.0 else 1.0


def _blows_up(growth: float, steps: float) -> bool:
    return growth > 1.0 + _UNSTABLE and (growth - 1.0) * steps > 1.0


def _longest_stable_step(system: System) -> float | None:
    """The longest step (s) at which a run of this duration would not blow up, rounded down to two digits."""
    duration = system.sampled_duration

    def is_stable(step: float) -> bool:
        return not _blows_up(step_limits(system, step).growth, duration / step)

    low, high = 1e-6 * system.step, system.step
    if not is_stable(low):
        return None
    low, _ = bisect(is_stable, low, high, ratio=1.001, geometric=True)
    digit: float = 10.0 ** (math.floor(math.log10(low)) - 1)
    return math.floor(low / digit) * digit


def refuse(system: System, found: Check, free_bytes: float) -> None:
    """Raise RefusedError where a run would be too large, or unstable by its scheme."""
    size = (
        f"about {found.steps:.3g} steps, {duration_text(found.seconds)}, {found.memory / 1e6:.0f} MB of memory, "
        f"a file of {found.file_size / 1e6:.3g} MB"
    )
    coarser = "solver.tolerance" if found.step is None else "solver.step"
    remedy = f"reduce solver.duration, or increase {coarser} or output.sample_interval"
    if found.steps > MOST_STEPS or found.seconds > MOST_SECONDS:
        raise RefusedError(f"the run is too long: {size}; {remedy}")
    if found.file_size > min(MOST_BYTES, free_bytes):
        raise RefusedError(f"the file would be too large, {free_bytes / 1e6:.3g} MB are free: {size}; {remedy}")
    if found.memory > MOST_TABLE_BYTES:
        raise RefusedError(f"the contact's tables would be too large: {size}; reduce contact.nodes")
    compared = 2.0 * 8.0 * COLUMNS * system.samples
    if system.method.step is None and compared > MOST_TABLE_BYTES:
        raise RefusedError(
            f"two histories of {system.samples:.3g} samples are compared to keep the tolerance, which takes "
            f"{compared / 1e9:.3g} GB of memory; increase output.sample_interval, or give solver.step instead"
        )
    growth = found.limits.growth
    if _blows_up(growth, found.steps):
        longest = _longest_stable_step(system)
        shorter = f"take a solver.step of at most {longest:.2g} s" if longest else "reduce solver.step"
        raise RefusedError(
            f"solver.theta: at this step the scheme is unstable, it multiplies disturbances by {growth:.6g} in "
            f"each of {found.steps} steps; {shorter}, {system.method.row.unstable}"
        )


def free_bytes(directory: Path) -> float:
    """What is free on the disk of a directory; infinite where that cannot be told."""
    try:
        return float(shutil.disk_usage(directory).free)
    except OSError:
        return math.inf


@contextmanager
def within_range() -> Iterator[None]:
    """Turn an overflow of numbers that no brake has, however the code meets it, into a refusal."""
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise RefusedError(
            f"the numbers of the case are too large, too small or too far apart to compute with ({error}); look "
            "for values in other units than m, kg, s and N"
        ) from error
