"""What a case will cost and which limits it meets, before anything is computed."""

import math
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from brakecli.analysis.stability.discrete import StepLimits, step_limits
from brakecli.analysis.stability.search import bisect
from brakecli.errors import RefusedError
from brakecli.runs.cost import duration_text, steps_and_seconds
from brakecli.runs.warnings import UNSTABLE, adjustments, warnings
from brakecli.solver.history import ROW_BYTES
from brakecli.solver.links import natural_frequencies
from brakecli.solver.quantities import HISTORY
from brakecli.solver.system import System

MOST_STEPS = 1e11
MOST_SECONDS = 24 * 3600.0
MOST_BYTES = 1e11
MOST_TABLE_BYTES = 4e9


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
    seconds: float
    memory: float  # bytes
    file_size: float  # bytes
    adjustments: tuple[str, ...]
    warnings: tuple[str, ...]


def check(system: System) -> Check:
    """Look at a case without stepping it."""
    own, fastest = system.method.own_steps, system.natural_frequencies[1]
    waves, limits = 2.0 * system.half_length * system.most_turns, step_limits(system)
    steps, seconds = steps_and_seconds(system)
    per_period = math.inf if own or not fastest > 0.0 else 1.0 / (fastest * system.step)
    per_wave = system.nodes / waves if system.nodes and waves > 0.0 else None
    return Check(
        system=system,
        link_frequencies=natural_frequencies(system.coefficients, 0.0),
        step=None if own else system.step,
        steps=steps,
        steps_per_period=per_period,
        limits=limits,
        nodes_per_wave=per_wave,
        seconds=seconds,
        memory=1.5e8 + 8.0 * system.nodes * (2 * len(system.wheel.g) + 2),
        file_size=float(system.samples) * ROW_BYTES + 1e5,
        adjustments=tuple(adjustments(system)),
        warnings=tuple(warnings(system, limits, steps, per_period, per_wave)),
    )


def refuse(found: Check, free_bytes: float = math.inf) -> None:
    """Raise RefusedError where a run would be too large, or unstable by its scheme."""
    system, growth = found.system, found.limits.growth
    room = f"{found.memory / 1e6:.0f} MB of memory, a file of {found.file_size / 1e6:.3g} MB"
    size = f"about {found.steps:.3g} steps, {duration_text(found.seconds)}, {room}"
    coarser = "solver.tolerance" if found.step is None else "solver.step"
    remedy = f"reduce solver.duration, or increase {coarser} or output.sample_interval"
    if found.steps > MOST_STEPS or found.seconds > MOST_SECONDS:
        raise RefusedError(f"the run is too long: {size}; {remedy}")
    if found.file_size > min(MOST_BYTES, free_bytes):
        raise RefusedError(f"the file would be too large, {free_bytes / 1e6:.3g} MB are free: {size}; {remedy}")
    if found.memory > MOST_TABLE_BYTES:
        raise RefusedError(f"the contact's tables would be too large: {size}; reduce contact.nodes")
    compared = 2.0 * 8.0 * len(HISTORY) * system.samples
    if system.method.step is None and compared > MOST_TABLE_BYTES:
        what = f"two histories of {system.samples:.3g} samples are compared to keep the tolerance, which takes"
        instead = "increase output.sample_interval, or give solver.step instead"
        raise RefusedError(f"{what} {compared / 1e9:.3g} GB of memory; {instead}")
    if _blows_up(growth, found.steps):
        longest = _longest_stable_step(system)
        shorter = f"take a solver.step of at most {longest:.2g} s" if longest else "reduce solver.step"
        what = f"it multiplies disturbances by {growth:.6g} in each of {found.steps} steps"
        remedy = f"{shorter}, {system.method.row.unstable}"
        raise RefusedError(f"solver.theta: at this step the scheme is unstable, {what}; {remedy}")


def _blows_up(growth: float, steps: float) -> bool:
    return growth > 1.0 + UNSTABLE and (growth - 1.0) * steps > 1.0


def _longest_stable_step(system: System) -> float | None:
    """The longest step (s) at which a run of this duration would not blow up, rounded down to two digits."""

    def is_stable(step: float) -> bool:
        return not _blows_up(step_limits(system, step).growth, system.sampled_duration / step)

    if not is_stable(1e-6 * system.step):
        return None
    longest, _ = bisect(is_stable, 1e-6 * system.step, system.step, ratio=1.001, geometric=True)
    digit: float = 10.0 ** (math.floor(math.log10(longest)) - 1)
    return math.floor(longest / digit) * digit


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
