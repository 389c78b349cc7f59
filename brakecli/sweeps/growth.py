"""Growth of small disturbances of steady sliding, from the differences of neighbouring runs.

The difference of two runs of one case from neighbouring starts cancels whatever roughness forces on both, so its
growth is that of a disturbance of the steady motion, on rough surfaces too. Four neighbours, one for each of x, y,
ẋ and ẏ, give the whole linear map D(t) from the disturbance at the start to that at t; the eigenvalues of
D(t₂) D(t₁)⁻¹ are those of the motion between, whatever the start put in.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import is_undamped
from brakecli.errors import CaseError
from brakecli.solver.links import natural_frequencies
from brakecli.solver.motion import solve
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.schedules import schedule
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import Initial, System

DISTURBANCE = 1e-7
"""Size of a disturbance, in static compressions: the rounding of a run is 1e-9 of it."""
SATURATED = 1e-3
"""Largest difference, in static compressions, that follows the linear equations to 1e-3."""
FADED = 1e-5
"""Smallest difference, in parts of its first size, that holds four digits."""
DEPARTED = 2.0
"""Times as far from steady sliding as roughness alone takes a run: it is on its way to a limit cycle."""
PERIODS = 40
"""Smooth surfaces are watched for as many periods of the fastest motion: their disturbances are exactly linear."""
ROUGH_PERIODS = 40
"""Surfaces that open are watched for as many periods of the slowest motion, within the case's duration."""
PASSES = 20
"""Surfaces that open are watched for as many passes of the wheel's longest wave, within the case's duration."""
STEPS_PER_PERIOD = 200
"""Steps of the two-layer scheme where the case gives no step."""
_PER_PERIOD = 20
_VX, _NORMAL_FORCE = (list(HISTORY).index(name) for name in ("vx", "normal_force"))


@dataclass(frozen=True)
class Growth:
    """The growth rate of the fastest disturbance of steady sliding."""

    rate: float  # 1/s
    spread: float  # 1/s, by how much it differs between two halves of the time watched
    noise: float  # 1/s, a rate up to here may be none

    @property
    def unstable(self) -> bool:
        """Whether disturbances grow."""
        return self.rate > self.noise


@dataclass(frozen=True)
class Sliding:
    """Steady sliding of a system at the speed and load of its start, whose disturbances are measured."""

    system: System
    x: float
    y: float
    stiffness: float  # of the contact, mean, N/m
    compression: float  # of the contact, the size of displacements, m

    @property
    def grip(self) -> float:
        """sign(U) φ."""
        return math.copysign(self.system.coefficients.phi, self.system.belt_speed)


def with_step(system: System) -> System:
    """The system with the step that growth is measured with, where its method keeps a tolerance instead."""
    method = system.method
    if not method.own_steps and method.step is not None:
        return system
    passing = abs(system.belt_speed) * float(max(system.wheel.turns, default=0.0))
    fastest = max(system.natural_frequencies[1], passing)
    step = system.interval / math.ceil(system.interval * STEPS_PER_PERIOD * fastest)
    stepped = replace(method, scheme="two-layer", theta=(0.5, 0.5), start="consistent", step=step, automatic=False)
    return replace(system, method=stepped)


def sliding(system: System) -> Sliding | None:
    """Steady sliding of a system; None where the wheel does not turn, or no load presses."""
    if system.belt_speed == 0.0:
        return None
    try:
        rest = steady_sliding(system)
    except CaseError:
        return None
    if not rest.stiffness > 0.0:
        return None
    return Sliding(system, rest.x, rest.y, rest.stiffness, rest.normal_force / rest.stiffness)


def growth(found: Sliding) -> Growth | None:
    """The growth rate of disturbances of steady sliding, None where a run of it fails.

    The runs have the scheme and step of the case, and the speed and load of its start throughout.
    """
    system = found.system
    slow, fast = natural_frequencies(system.coefficients, found.stiffness)
    per_sample = max(1, int(1.0 / (_PER_PERIOD * fast * system.step)))
    interval = per_sample * system.step
    duration = max(_watched(system, slow, fast), 8.0 * interval)
    scales = found.compression * np.array([1.0, 1.0, *[2.0 * math.pi * fast] * 2])
    displacements = np.vstack([np.zeros(4), DISTURBANCE * np.diag(scales)])
    runs = [_run(found, interval, duration, displaced) for displaced in displacements]
    if any(run is None for run in runs):
        return None
    base, *others = [run for run in runs if run is not None]
    # D[t]: columns are the differences of the neighbours, rows x, y, ẋ, ẏ, each in its scale.
    maps = np.array([(other[:, :4] - base[:, :4]) / (DISTURBANCE * scales) for other in others]).transpose(1, 2, 0)
    last = _last_linear(system, [base, *others], np.abs(maps).max(axis=(1, 2)))
    if not system.smooth:
        last = min(last, _last_forced(found, base, interval, slow))
    first = max(1, last // 4)
    if last - first < 4:  # out of steady sliding at once
        return Growth(fast, fast, 0.0)

    def rate(start: int, end: int) -> float:
        return _rate(maps[start], maps[end], (end - start) * interval)

    middle = (first + last) // 2
    noise = 1e-4 / ((last - first) * interval) if is_undamped(system.coefficients) else 0.0
    return Growth(rate(first, last), 0.5 * abs(rate(middle, last) - rate(first, middle)), noise)


def _watched(system: System, slow: float, fast: float) -> float:
    """The time (s) to watch disturbances for."""
    smooth = PERIODS / fast
    if system.wheel.g.size == 0:
        return smooth
    passing = PASSES / (abs(system.belt_speed) * float(system.wheel.turns.min()))
    rough = max(smooth, passing, ROUGH_PERIODS / slow if slow > 0.0 else 0.0)
    return min(rough, max(system.duration, smooth))


def _run(
    found: Sliding, interval: float, duration: float, displaced: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """The samples of a run from (x, y, ẋ, ẏ) beside steady sliding on, None if it fails.

    Its speed and load are held; it is sampled on whole steps.
    """
    system, (x, y, v_x, v_y) = found.system, (float(value) for value in displaced)
    motion = solve(
        replace(
            system,
            belt=schedule((0.0,), (system.belt_speed / system.radius,), system.radius),
            load=schedule((0.0,), (system.load_at_start,)),
            initial=Initial(found.x + x, found.y + y, v_x, v_y),
            interval=interval,
            duration=duration,
            method=replace(system.method, step=system.step, start="consistent"),
        )
    )
    return None if motion.work.failure not in (Failure.NONE, Failure.UNBALANCED) else motion.rows


def _last_linear(system: System, runs: list[NDArray[np.float64]], sizes: NDArray[np.float64]) -> int:
    """The last sample up to which the differences follow linear equations and are more than rounding."""
    ended = (sizes > SATURATED / DISTURBANCE) | (sizes < FADED)
    if system.smooth:  # a flat pad sticks or lifts off wholly: the motion has left steady sliding
        for run in runs:  # by its own velocity: a three-layer scheme's slow sliding may pass for stick
            ended |= (run[:, _VX] - system.belt_speed) * system.belt_speed >= 0.0
            ended |= run[:, _NORMAL_FORCE] == 0.0
    ended[0] = False
    return int(np.argmax(ended)) - 1 if ended.any() else len(sizes) - 1


def _last_forced(found: Sliding, base: NDArray[np.float64], interval: float, slow: float) -> int:
    """The last sample up to which a run on rough surfaces only does what roughness forces on it.

    An unstable one leaves that for a limit cycle, on which differences do not grow. It is gone when it moves
    `DEPARTED` times as far from steady sliding as in its first periods and its first passing wave.
    """
    away = np.abs(base[:, :2] - np.array([found.x, found.y])).max(axis=1)
    passing = abs(found.system.belt_speed) * float(found.system.wheel.turns.min(initial=np.inf))
    seconds = max(3.0 / slow if slow > 0.0 else 0.0, 1.0 / passing)
    opening = max(1, int(seconds / interval))
    gone = np.flatnonzero(away > DEPARTED * away[:opening].max())
    return int(gone[0]) - 1 if len(gone) else len(base) - 1


def _rate(start: NDArray[np.float64], end: NDArray[np.float64], time: float) -> float:
    """The growth rate (1/s) of the fastest of the disturbances that are still there at the start."""
    u, sizes, vh = np.linalg.svd(start)
    kept = sizes > 1e-6 * sizes[0]
    step = u.T[kept] @ end @ vh.T[:, kept] / sizes[kept]
    radius = float(np.abs(np.linalg.eigvals(step)).max())
    return math.log(max(radius, 1e-300)) / time
