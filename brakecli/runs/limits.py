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
    natural_frequencies,
    step_limits,
)
from brakecli.analysis.stability.modes import eigensystem
from brakecli.analysis.stability.search import bisect
from brakecli.case.case import EVENT_TOLERANCE, Iteration
from brakecli.case.system import Setup
from brakecli.errors import RefusedError
from brakecli.solver.contact.pad import NODES_PER_WAVE
from brakecli.solver.history import ROW_BYTES
from brakecli.solver.loop import COLUMNS
from brakecli.solver.schemes import has_own_steps

MOST_STEPS = 1e11
MOST_SECONDS = 24 * 3600.0
MOST_BYTES = 1e11
MOST_TABLE_BYTES = 4e9

# Seconds, measured with `make cases` on one core; they only serve to tell minutes from days.
_STEP_SECONDS = 1.5e-7
_NODE_SECONDS = 1.2e-9  # per node, and again per node and wave of the wheel:
_NODE_WAVE_SECONDS = 4e-10
_EXACT_SECONDS = 5e-6  # per wave on the pad
_EVALUATIONS = 3.0  # of the contact in a step
_OWN_STEPS = 25.0  # in a period, of a scheme that finds them itself, at a tolerance of 1e-10
_OWN_STEP_SECONDS = 4e-6
_OWN_EVALUATIONS = 27.0

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


def check(setup: Setup) -> Check:
    """Look at a case without stepping it."""
    case, times = setup.case, setup.timing
    stiffness = setup.contact_stiffness
    frequencies = natural_frequencies(setup.coefficients, stiffness)
    speed = max(abs(float(value)) for value in setup.belt.values)
    passing = speed * max(setup.wheel.turns, default=0.0)
    shortest = max([*setup.shoe.turns, *setup.wheel.turns], default=0.0)
    waves = 2.0 * case.contact.half_length * shortest
    limits = step_limits(setup.coefficients, setup.weights, setup.scheme, stiffness, setup.wheel)
    own = has_own_steps(setup.scheme)
    steps, runs = _own_steps(setup, frequencies[1], passing) if own else (times.steps, 1.0)
    per_period = 1.0 / (frequencies[1] * times.step) if frequencies[1] > 0.0 and not own else math.inf
    found = Check(
        coefficients=setup.coefficients._asdict(),
        belt_speed=setup.belt_speed,
        contact_stiffness=stiffness,
        natural_frequencies=frequencies,
        link_frequencies=natural_frequencies(setup.coefficients, 0.0),
        passing_frequency=passing,
        step=None if own else times.step,
        steps=steps,
        steps_per_period=per_period,
        limits=limits,
        evaluator=setup.evaluator,
        nodes=setup.nodes,
        nodes_per_wave=setup.nodes / waves if setup.nodes and waves > 0.0 else None,
        seconds=runs * steps * _seconds_per_step(setup),
        memory=1.5e8 + 8.0 * setup.nodes * (2 * len(setup.wheel.g) + 2),
        file_size=float(times.samples) * ROW_BYTES + 1e5,
        adjustments=times.adjustments,
        warnings=(),
    )
    return _with_warnings(setup, found)


def _own_steps(setup: Setup, frequency: float, passing: float) -> tuple[int, float]:
    """A rough guess at the steps of a scheme that finds them itself, and at what all its runs cost over the last.

    `frequency` (Hz) is the highest natural one, `passing` (Hz) that of the shortest wave of the wheel.
    """
    promise, c = setup.case.solver.promise, setup.coefficients
    tolerance = EVENT_TOLERANCE if promise is None else max(min(1e-5 * promise, 1e-8), 1e-13)
    rate = frequency * _OWN_STEPS * (1e-10 / tolerance) ** 0.125 + 8.0 * passing + 0.25 * (c.b_xx + c.b_yy) / c.m
    duration = setup.timing.samples * setup.timing.interval
    return 1 + int(min(duration * rate, 1e300)), 1.0 if promise is None else 1.6


def _seconds_per_step(setup: Setup) -> float:
    """A rough guess at the time of one step."""
    own, n_2 = has_own_steps(setup.scheme), len(setup.wheel.g)
    if own:
        return _OWN_STEP_SECONDS * (1.0 + n_2**2 / 20.0) + (
            _OWN_EVALUATIONS * _open_part(setup) * evaluation_seconds(setup) if setup.evaluator == "exact" else 0.0
        )
    if setup.evaluator == "exact" or setup.nodes:
        return _STEP_SECONDS + _EVALUATIONS * evaluation_seconds(setup)
    return _STEP_SECONDS * (1.0 + n_2**2 / 20.0)


def _open_part(setup: Setup) -> float:
    """Of the time, that in which rough surfaces may be open in part: little if the load presses them together."""
    heights = float(np.abs(setup.shoe.g).sum() + np.abs(setup.wheel.g).sum())
    spring = setup.coefficients.c_yy + setup.contact_stiffness
    return 0.04 if heights * spring < float(np.abs(setup.load.values).min()) else 0.12


def evaluation_seconds(setup: Setup) -> float:
    """A rough guess at the time that one evaluation of a contact which is open in part takes."""
    if setup.evaluator == "exact":
        shortest = max([*setup.shoe.turns, *setup.wheel.turns], default=0.0)
        return _EXACT_SECONDS * (1.0 + 2.0 * setup.case.contact.half_length * shortest)
    return setup.nodes * (_NODE_SECONDS + _NODE_WAVE_SECONDS * len(setup.wheel.g))


def _with_warnings(setup: Setup, found: Check) -> Check:
    """Add what a careful user would want to know before the run."""
    case, limits, warnings = setup.case, found.limits, []
    if found.steps_per_period < RESOLVED:
        warnings.append(
            f"solver.step: {found.steps_per_period:.3g} steps per period of the fastest motion "
            f"({found.natural_frequencies[1]:.4g} Hz): it is not resolved; take a step of at most "
            f"{1.0 / (RESOLVED * found.natural_frequencies[1]):.2g} s"
        )
    elif (rate := _settling_rate(setup)) * (found.step or 0.0) > 2.0 * math.pi / RESOLVED:
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
    speed = float(np.abs(setup.belt.values).max())
    grip = case.friction.coefficient * float(np.abs(setup.load.values).max()) / setup.coefficients.m
    if 0.0 < speed < grip * (found.step or 0.0):
        warnings.append(
            f"solver.step: friction changes the shoe's velocity by up to {grip * (found.step or 0.0):.3g} m/s in "
            f"a step, more than the wheel's {speed:.3g} m/s: stick and slip are not resolved; take a step of at "
            f"most {speed / grip:.2g} s, or event-driven"
        )
    nyquist = 0.5 / setup.timing.interval
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
    if case.solver.iteration is Iteration.FIXED_POINT and limits.contraction >= 1.0:
        warnings.append(
            f"solver.iteration: the fixed-point iteration may diverge (its bound of contraction is "
            f'{limits.contraction:.3g}, above 1); take "newton", or a step of at most '
            f"{setup.timing.step / math.sqrt(limits.contraction):.2g} s"
        )
    if not limits.unique:
        warnings.append(
            "friction.coefficient: a step may have more than one solution, as friction can wedge the shoe into "
            "the wheel within a step; reduce solver.step or the coefficient"
        )
    if 1.0 + 1e-3 / found.steps < limits.growth and limits.growth > 1.0 + _UNSTABLE:
        warnings.append(
            f"solver.theta: the scheme itself multiplies disturbances by {limits.growth:.6g} in each step; "
            + _stable_remedy(setup)
        )
    taken = 0.0 if found.step is None else _taken(setup, found.steps)
    if taken > _TAKEN:
        warnings.append(
            f"solver.theta: with these weights the scheme itself damps, it takes {100.0 * taken:.3g} % of the "
            "fastest motion away by the end of the run, and its errors are of first order; take theta = "
            + ("[0.5, 0.5]" if setup.scheme.WEIGHTS == 2 else "[0.25, 0.5, 0.25]")
        )
    if setup.load.values.min() < 0.0:
        warnings.append("load: the force is negative at times, it lifts the shoe off the wheel")
    return Check(**{**found.__dict__, "warnings": tuple(warnings)})


def _settling_rate(setup: Setup) -> float:
    """The fastest rate (1/s) of the frictionless shoe: that of its dashpots where they are overcritical."""
    values, _ = eigensystem(setup.coefficients, setup.contact_stiffness, 0.0)
    return float(np.abs(values).max())


def _taken(setup: Setup, steps: int) -> float:
    """Part of the fastest motion, without dashpots and friction, that the scheme takes away in so many steps."""
    c = setup.coefficients._replace(b_xx=0.0, b_xy=0.0, b_yy=0.0, phi=0.0)
    factors = np.linalg.eigvals(amplification(c, setup.weights, setup.scheme, setup.contact_stiffness))
    left = float(np.abs(factors[np.argmax(np.abs(np.angle(factors)))]))  # not a direction without a spring
    if left > 1.0 - _ROUNDING:
        return 0.0
    return -math.expm1(steps * math.log(left)) if left > 0.0 else 1.0


def _stable_remedy(setup: Setup, shorter: str = "reduce solver.step") -> str:
    if setup.scheme.WEIGHTS == 2:
        return f"{shorter}, or take weights that add up to 1 or more, such as [0.5, 0.5]"
    return f"{shorter}, or take theta = [0.25, 0.5, 0.25]"


def _blows_up(growth: float, steps: float) -> bool:
    return growth > 1.0 + _UNSTABLE and (growth - 1.0) * steps > 1.0


def _longest_stable_step(setup: Setup) -> float | None:
    """The longest step (s) at which a run of this duration would not blow up, rounded down to two digits."""
    duration = setup.timing.samples * setup.timing.interval

    def is_stable(step: float) -> bool:
        weights = setup.weights._replace(h=step)
        limits = step_limits(setup.coefficients, weights, setup.scheme, setup.contact_stiffness, setup.wheel)
        return not _blows_up(limits.growth, duration / step)

    low, high = 1e-6 * setup.timing.step, setup.timing.step
    if not is_stable(low):
        return None
    low, _ = bisect(is_stable, low, high, ratio=1.001, geometric=True)
    digit: float = 10.0 ** (math.floor(math.log10(low)) - 1)
    return math.floor(low / digit) * digit


def refuse(setup: Setup, found: Check, free_bytes: float) -> None:
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
    compared = 2.0 * 8.0 * COLUMNS * setup.timing.samples
    if setup.case.solver.promise is not None and compared > MOST_TABLE_BYTES:
        raise RefusedError(
            f"two histories of {setup.timing.samples:.3g} samples are compared to keep the tolerance, which takes "
            f"{compared / 1e9:.3g} GB of memory; increase output.sample_interval, or give solver.step instead"
        )
    growth = found.limits.growth
    if _blows_up(growth, found.steps):
        longest = _longest_stable_step(setup)
        shorter = f"take a solver.step of at most {longest:.2g} s" if longest else "reduce solver.step"
        raise RefusedError(
            f"solver.theta: at this step the scheme is unstable, it multiplies disturbances by {growth:.6g} in "
            f"each of {found.steps} steps; {_stable_remedy(setup, shorter)}"
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


def duration_text(seconds: float) -> str:
    """A time in the unit that people would say it in."""
    for unit, size in (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s"
