"""Growth of small disturbances of steady sliding, from the differences of neighbouring runs.

The difference of two runs of one case from neighbouring starts cancels whatever roughness forces on both, so its
growth is that of a disturbance of the steady motion, on rough surfaces too. Four neighbours, one for each of x, y,
ẋ and ẏ, give the whole linear map D(t) from the disturbance at the start to that at t; the eigenvalues of
D(t₂) D(t₁)⁻¹ are those of the motion between, whatever the start put in.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.linear import Linear, linear_theory
from brakecli.analysis.stability.modes import is_undamped
from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.links import natural_frequencies
from brakecli.solver.motion import solve
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.schedules import schedule
from brakecli.solver.steady_sliding import SteadySliding, steady_sliding
from brakecli.solver.system import Initial, System

DISTURBANCE = 1e-7  # in static compressions: the rounding of a run is 1e-9 of it, unless a soft link reaches far
SATURATED = 1e-3  # largest difference, in static compressions, that follows the linear equations to 1e-3
LARGEST = 1e-2, 1e-5  # of disturbances on smooth surfaces, linear until the shoe lifts off, and on others
ROUNDED = 1e-9  # least ratio of a disturbance to the shoe's distance from the origin: rounding is 1e-16 of that
FADED = 1e-5  # smallest difference, in parts of its first size, that holds four digits
SLOPE = 1e-3  # of a wheel's waves that feed no disturbance
DEPARTED = 2.0  # times as far from steady sliding as roughness alone takes a run
PERIODS, PASSES = 40, 20
"""Periods of the fastest motion that are watched: disturbances on smooth surfaces are exactly linear. Rough ones
take as many of the slowest motion, and passes of the wheel's longest wave, within the case's duration."""
STEPS_PER_PERIOD = 200  # of the two-layer scheme, where the case gives no step
_SAMPLES_PER_PERIOD = 20
_VX, _NORMAL_FORCE, _CONTACT = (list(HISTORY).index(name) for name in ("vx", "normal_force", "contact_fraction"))


@dataclass(frozen=True)
class Growth:
    """The growth rate (1/s) of the fastest disturbance of steady sliding; one up to `noise` may be none.

    `spread` (1/s): by how much it differs between two halves of the time watched. `opened`: the pad did not touch
    everywhere all the time. `bar` (1/s): of a mean over a time, within which it is not known. `exact`: by
    theory, not by runs; the spread is what that leaves open.
    """

    rate: float
    spread: float
    noise: float
    opened: bool = False
    bar: float = 0.0
    exact: bool = False

    @property
    def unstable(self) -> bool | None:
        """Whether disturbances grow; None where zero lies within the bar."""
        excess = self.rate - self.noise
        return None if abs(excess) < self.bar else excess > 0.0


@dataclass(frozen=True)
class Sliding(SteadySliding):
    """Steady sliding of a system at the speed and load of its start, whose disturbances are measured."""

    system: System

    @property
    def grip(self) -> float:
        """sign(U) φ."""
        return math.copysign(self.system.coefficients.phi, self.system.belt_speed)

    @property
    def modulated(self) -> bool:
        """Whether the slopes of the wheel's waves change the growth of disturbances in a contact that touches
        everywhere: ∂F_y/∂x over 2ak.
        """
        wheel = self.system.wheel
        slopes = wheel.g * wheel.omega * np.sinc(wheel.omega * self.system.half_length / np.pi)
        return bool(np.abs(slopes).sum() > SLOPE)

    @cached_property
    def linear(self) -> Linear | None:
        """Theory of the motion that a rough wheel forces, where that surely touches everywhere and only slips."""
        if not self.system.wheel.g.size or self.opens or self.modulated:
            return None
        theory = linear_theory(self.system, self.system.belt_speed)
        if theory is None or theory.opens:
            return None
        fastest = 2.0 * math.pi * float(np.abs(theory.waves[:, 0] * theory.passing).sum())
        return theory if fastest < abs(self.system.belt_speed) else None

    def in_full_contact(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """The states x, y, ẋ, ẏ (rows) that the wheel forces at some times (s) by linear theory, if it has any."""
        theory = linear_theory(self.system, self.system.belt_speed)
        shaken = np.concatenate(theory.forced(times)).T if theory else np.full((len(times), 4), np.nan)
        states: NDArray[np.float64] = np.array([self.x, self.y, 0.0, 0.0]) + shaken
        return states

    @property
    def forced(self) -> bool:
        """Whether a rough wheel may force a motion that is not linear, or whose disturbances it feeds."""
        return bool(self.system.wheel.g.size) and self.linear is None

    @property
    def opens(self) -> bool:
        """Whether the surfaces touch in part only, so that the motion is not linear."""
        return self.stiffness < 0.999 * self.system.contact_stiffness


def with_step(system: System, *, unless: bool = False) -> System:
    """The system with the step that growth is measured with, where its method keeps a tolerance instead."""
    method = system.method
    if unless or (not method.own_steps and method.step is not None):
        return system
    passing = abs(system.belt_speed) * float(max(system.wheel.turns, default=0.0))
    fastest = max(system.natural_frequencies[1], passing)
    step = system.interval / math.ceil(system.interval * STEPS_PER_PERIOD * fastest)
    stepped = replace(method, scheme="two-layer", theta=(0.5, 0.5), start="consistent", step=step, automatic=False)
    return replace(system, method=stepped)


def stepped(case: Case) -> Case:
    """The case with the step that growth is measured with, where it gives none and no run of it is exact.

    No run is then computed twice.
    """
    system = system_of(case)
    method = with_step(system).method
    if method == system.method or system.method.row.exact:
        return case
    keys = ("scheme", "theta", "start", "step")
    return changed(case, solver={**{key: getattr(method, key) for key in keys}, "tolerance": None})


def has_exact_steps(case_at: Callable[[float], Case], value: float) -> bool:
    """Whether the steps of a case are exact: disturbances then grow as the eigenvalues say."""
    with suppress(CaseError):
        return system_of(case_at(value)).method.row.exact
    return False


def sliding(system: System) -> Sliding | None:
    """Steady sliding of a system; None where the wheel does not turn, no load presses, or no link holds the shoe
    along the wheel. Raises CaseError.
    """
    if system.belt_speed == 0.0 or system.coefficients.c_xx == 0.0:
        return None
    rest = steady_sliding(system)
    return Sliding(**vars(rest), system=system) if rest.is_pressed(system.load_at_start) else None


def held(system: System) -> System:
    """The system at the speed and load of its start throughout."""
    belt = schedule((0.0,), (system.belt_speed / system.radius,), system.radius)
    return replace(system, belt=belt, load=schedule((0.0,), (system.load_at_start,)))


def growth(found: Sliding) -> Growth | None:
    """The growth rate of disturbances of steady sliding, None where a run of it fails.

    The runs have the scheme and step of the case, and the speed and load of its start throughout.
    """
    system = found.system
    slow, fast = natural_frequencies(system.coefficients, found.stiffness)
    interval = max(1, int(1.0 / (_SAMPLES_PER_PERIOD * fast * system.step))) * system.step
    watched = replace(
        held(system),
        interval=interval,
        duration=max(_watched(system, slow, fast), 8.0 * interval),
        method=replace(system.method, step=system.step, start="consistent"),
    )
    compression = found.normal_force / found.stiffness
    scales = compression * np.array([1.0, 1.0, *[2.0 * math.pi * fast] * 2])
    small, saturated = _sizes(found, compression, float(scales[2]))
    displaced = np.vstack([np.zeros(4), small * np.diag(scales)])
    samples = []
    for start in (np.array([found.x, found.y, 0.0, 0.0]) + displaced).tolist():
        motion = solve(replace(watched, initial=Initial(*start)))
        if motion.work.failure not in (Failure.NONE, Failure.UNBALANCED):
            return None
        samples.append(motion.rows)
    runs = np.array(samples)
    # D[t]: columns are the differences of the neighbours, rows x, y, ẋ, ẏ, each in its scale.
    maps = ((runs[1:, :, :4] - runs[0, :, :4]) / (small * scales)).transpose(1, 2, 0)
    sizes = np.abs(maps).max(axis=(1, 2))
    # A smooth wheel is the same everywhere: a soft link may let x run. Rounding adds up there with three layers.
    moved = np.abs(maps[:, 1:]).max(axis=(1, 2)) if system.smooth and not system.scheme.LAG else sizes
    last = _last_linear(found, runs, (moved > saturated / small) | (sizes < FADED), interval, slow)
    opened = bool((runs[:, : last + 1, _CONTACT] < 1.0).any())
    # A linear motion has all its directions from the start on: none has faded there. Others come to their orbit.
    first = max(1, last // 4) if opened else 1
    if last - first < 4:  # out of steady sliding at once
        return Growth(fast, fast, 0.0, opened)

    def rate(start: int, end: int) -> float:
        """The growth rate (1/s) of the fastest of the disturbances that are still there at the start."""
        u, sizes, vh = np.linalg.svd(maps[start])
        kept = sizes > 1e-6 * sizes[0]
        step = u.T[kept] @ maps[end] @ vh.T[:, kept] / sizes[kept]
        radius = float(np.abs(np.linalg.eigvals(step)).max())
        return math.log(max(radius, 1e-300)) / ((end - start) * interval)

    middle = (first + last) // 2
    noise = 1e-4 / ((last - first) * interval) if is_undamped(system.coefficients) else 0.0
    later = rate(middle, last) if opened else rate(first, last)
    spread = 0.5 * abs(later - rate(first, middle)) + _rounding(found, small * compression)
    return Growth(rate(first, last), spread, noise, opened)


def _rounding(found: Sliding, small: float) -> float:
    """Growth (1/s) that moves a disturbance of a size (m) in a step by no more than the position is rounded."""
    return float(np.finfo(float).eps * math.hypot(found.x, found.y) / (small * found.system.step))


def _sizes(found: Sliding, compression: float, speed: float) -> tuple[float, float]:
    """The size of disturbances at the start, and at the end, in static compressions, whose velocity is `speed`.

    They are well above the rounding of the position. Those of smooth surfaces do not bring the shoe to the speed
    of the wheel.
    """
    reach = math.hypot(found.x, found.y) / compression
    if not found.system.smooth:
        return max(DISTURBANCE, min(ROUNDED * reach, LARGEST[1])), SATURATED
    slips = abs(found.system.belt_speed) / speed
    return max(DISTURBANCE, min(0.01 * slips, LARGEST[0])), max(SATURATED, min(0.5 * slips, 0.3))


def _watched(system: System, slow: float, fast: float) -> float:
    """The time (s) to watch disturbances for."""
    smooth = PERIODS / fast
    if system.wheel.g.size == 0:
        return smooth
    passing = PASSES / (abs(system.belt_speed) * float(system.wheel.turns.min()))
    rough = max(smooth, passing, PERIODS / slow if slow > 0.0 else 0.0)
    return min(rough, max(system.duration, smooth))


def _last_linear(
    found: Sliding, runs: NDArray[np.float64], ended: NDArray[np.bool_], interval: float, slow: float
) -> int:
    """The last sample up to which the differences follow linear equations and are more than rounding.

    On smooth surfaces a pad that sticks or lifts off does so wholly. On rough ones an unstable run leaves what
    roughness forces on it for a limit cycle, on which differences do not grow: it is gone when it moves `DEPARTED`
    times as far from steady sliding as in its first periods and its first passing wave.
    """
    system, belt = found.system, found.system.belt_speed
    if system.smooth:  # stick is found by the velocity: a three-layer scheme's slow sliding may pass for it
        sticks = (runs[:, :, _VX] - belt) * belt >= 0.0
        ended |= (sticks | (runs[:, :, _NORMAL_FORCE] == 0.0)).any(axis=0)
    else:
        away = np.abs(runs[0, :, :2] - np.array([found.x, found.y])).max(axis=1)
        passing = abs(belt) * float(system.wheel.turns.min(initial=np.inf))
        opening = max(1, int(max(3.0 / slow if slow > 0.0 else 0.0, 1.0 / passing) / interval))
        ended |= away > DEPARTED * away[:opening].max()
    ended[0] = False
    return int(np.argmax(ended)) - 1 if ended.any() else len(ended) - 1
