"""What `brakecli stability` says of a case: steady sliding, modes, critical friction, and the scheme's share."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise

import numpy as np

from brakecli.analysis.stability.certain import Rounded, conditions, links_with
from brakecli.analysis.stability.discrete import DIFFERENCE, spectral_radius
from brakecli.analysis.stability.margin import (
    DIVERGENCE,
    FLUTTER,
    Change,
    Margin,
    between,
    grows,
    left_by_windows,
    left_open,
)
from brakecli.analysis.stability.margin import changes as margin_changes
from brakecli.analysis.stability.modes import (
    Crossing,
    Mode,
    crossings,
    eigensystem,
    modes,
)
from brakecli.analysis.stability.search import bisect
from brakecli.errors import CaseError
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.links import natural_frequencies
from brakecli.solver.steady_sliding import (
    UNPRESSED,
    WINDOWS,
    Mean,
    SteadySliding,
    finer,
    mean_contact,
    sliding,
    steady_sliding,
    tabulated,
)
from brakecli.solver.system import System

LARGEST_FRICTION = 10.0  # to which rough surfaces are searched, whose stiffness depends on friction
FRICTIONS = 41  # values among which a scheme is asked where it loses stability, by 0.25 where nothing is known
MARGIN = 1e-9  # growth per step that counts as growth: above the rounding of simple eigenvalues

StiffnessAt = Callable[[float], float]


@dataclass(frozen=True)
class Discrete:
    """What the case's scheme makes of the same motion at its step."""

    spectral_radius: float  # factor of the fastest disturbance in a step, or sample interval if steps are its own
    growth: float | None  # 1/s, its logarithm over that time; None where nothing is left after a step
    step_limit: float | None  # s, below which the frictionless shoe is stable; None where any step is
    critical_friction: float | None  # where the radius passes one
    bias: float | None  # its distance from the exact one


@dataclass(frozen=True)
class StabilityReport:
    """Linear stability of the steady sliding of a case; None stands for what does not exist."""

    belt_speed: float
    friction: float
    equilibrium: SteadySliding | None
    no_equilibrium: str | None
    contact_stiffness: float  # N/m, mean -∂F_y/∂y at the equilibrium
    stable: bool | None
    eigenvalues: tuple[complex, ...]
    modes: tuple[Mode, ...]
    crossings: tuple[Crossing, ...]
    critical: Crossing | None  # the smallest friction coefficient at which stability is lost
    critical_error: float | None  # by which the mean over the waves leaves it open; None where that is not known
    contact_stiffness_error: float  # N/m, the same of the contact stiffness
    undamped_flutter: float | None  # φ, closed forms for the contact stiffness above
    undamped_divergence: float | None
    discrete: Discrete | None
    stiffness_at: StiffnessAt  # mean stiffness (N/m) by φ


def stability(system: System) -> StabilityReport:
    """Linear stability of steady sliding at the speed and load of t = 0."""
    c = system.coefficients
    belt = system.belt_speed
    equilibrium = None
    reason = None
    try:
        equilibrium = steady_sliding(system)
    except CaseError as error:
        reason = error.problems[0].what
    k = equilibrium.stiffness if equilibrium else system.contact_stiffness
    if equilibrium and not equilibrium.is_pressed(system.load_at_start):
        equilibrium = None
        reason = UNPRESSED
        k = 0.0
    stiffness_at = mean_stiffness(system, k)
    all_crossings = changes(system, stiffness_at)
    critical = next((crossing for crossing in all_crossings if crossing.lost), None)
    means = [] if system.smooth else [tabulated(system, window) for window in range(WINDOWS)]
    opens = means if equilibrium and equilibrium.contact_fraction < 1.0 else []
    flutter, divergence = undamped_critical(c, k, belt)
    grip = c.grip(belt)
    values, _ = eigensystem(c, k, grip)
    fastest = float(values.real.max())
    return StabilityReport(
        belt_speed=belt,
        friction=c.phi,
        equilibrium=equilibrium,
        no_equilibrium=reason,
        contact_stiffness=k,
        stable=not grows(conditions(links_with(c), k, grip)) if equilibrium else None,
        eigenvalues=tuple(values.tolist()),
        modes=tuple(modes(c, k, grip)),
        crossings=tuple(all_crossings),
        critical=critical,
        critical_error=_critical_error(system, critical, means) if critical else None,
        contact_stiffness_error=left_by_windows([at.stiffness for mean in opens if (at := sliding(system, mean))]),
        undamped_flutter=flutter,
        undamped_divergence=divergence,
        discrete=_discrete(system, stiffness_at, critical, fastest) if equilibrium else None,
        stiffness_at=stiffness_at,
    )


def changes(system: System, stiffness_at: StiffnessAt, up_to: float = LARGEST_FRICTION) -> list[Crossing]:
    """Every change of stability along φ; on rough surfaces those up to a friction coefficient."""
    c = system.coefficients
    belt = system.belt_speed
    if belt == 0.0 or system.smooth:
        return crossings(c, stiffness_at(c.phi), belt)
    return _rough_crossings(c, belt, stiffness_at, up_to)


def critical_friction(system: System, stiffness: float, up_to: float = LARGEST_FRICTION) -> float | None:
    """Largest friction coefficient up to which sliding is stable, 0 where it never is, or None where it always is.

    `stiffness` (N/m): that of steady sliding, or of full contact where there is none. Where stability changes
    nowhere, the growth at the system's own friction decides. The wheel turns.
    """
    c = system.coefficients
    stiffness_at = mean_stiffness(system, stiffness)
    if all_crossings := changes(system, stiffness_at, up_to):
        return all_crossings[0].friction if all_crossings[0].lost else 0.0
    k = stiffness_at(c.phi)
    if not k > 0.0:
        return None
    return 0.0 if grows(conditions(links_with(c), k, c.grip(system.belt_speed))) else None


def undamped_critical(c: Coefficients, k: float, belt: float) -> tuple[float | None, float | None]:
    """Closed forms without dashpots: φ of flutter, |cxy|/K + (cxx - cyy - K)²/(4|cxy| K), where cxy sign(U) < 0,
    and of divergence (self-locking), (cxx (cyy + K) - cxy²)/(K |cxy|), where cxy sign(U) > 0.
    """
    pull = math.copysign(1.0, belt) * c.c_xy
    if belt == 0.0 or c.c_xy == 0.0 or k == 0.0:
        return None, None
    if pull < 0.0:
        return (abs(c.c_xy) + (c.c_xx - c.c_yy - k) ** 2 / (4.0 * abs(c.c_xy))) / k, None
    return None, (c.c_xx * (c.c_yy + k) - c.c_xy**2) / (k * abs(c.c_xy))


def mean_stiffness(system: System, smooth: float, mean: Mean | None = None) -> StiffnessAt:
    """Mean stiffness of a rough contact as it depends on φ through the mean force; NaN where there is none.

    That of smooth surfaces (N/m) is known. Of a wheel at rest, and of a shoe that no link holds, it is not needed.
    """
    if system.smooth or system.belt_speed == 0.0 or system.coefficients.c_xx == 0.0:
        return lambda phi: smooth
    mean = mean or tabulated(system)

    @cache
    def at(phi: float) -> float:
        steady = sliding(system, mean, phi)
        return steady.stiffness if steady and steady.is_pressed(system.load_at_start) else math.nan

    return at


def _along_friction(c: Coefficients, belt: float, stiffness_at: StiffnessAt) -> Margin:
    """The margin of steady sliding along φ."""
    links = links_with(c)

    @cache
    def signs_at(phi: float) -> list[Rounded] | None:
        k = stiffness_at(phi)
        return conditions(links, k, math.copysign(phi, belt)) if math.isfinite(k) else None

    return signs_at


def _critical_error(system: System, critical: Crossing, windows: list[Mean]) -> float | None:
    """By which the mean over the waves leaves a critical friction open."""
    c = system.coefficients
    belt = system.belt_speed
    if not windows or belt == 0.0 or c.c_xx == 0.0:
        return 0.0

    def by(mean: Mean) -> Margin:
        return _along_friction(c, belt, mean_stiffness(system, math.nan, mean))

    which = FLUTTER if critical.instability == "flutter" else DIVERGENCE
    change = Change(critical.friction, 0.0, True, which)
    near = max(critical.friction - 1e-3, 0.0)  # a stable value; a choice
    summed = by(partial(mean_contact, finer(system)))
    return left_open(by(tabulated(system)), [by(mean) for mean in windows], summed, change, near)


def _rough_crossings(c: Coefficients, belt: float, stiffness_at: StiffnessAt, up_to: float) -> list[Crossing]:
    """Changes of stability on rough surfaces, whose mean stiffness depends on φ.

    Where steady sliding ends, it is lost by self-locking. Where no link holds the shoe along the wheel there is
    none with friction, and nothing to lose.
    """
    if c.c_xx == 0.0:
        return []
    all_crossings = []
    frictions = np.linspace(0.0, up_to, math.ceil(up_to / 0.025) + 1).tolist()
    for change in margin_changes(_along_friction(c, belt, stiffness_at), frictions):
        phi = change.value
        if change.which == FLUTTER:
            frequency = modes(c._replace(phi=phi), stiffness_at(phi), math.copysign(phi, belt))[0].frequency
            all_crossings.append(Crossing(phi, "flutter", frequency, change.lost))
        elif change.which is not None or change.lost:
            all_crossings.append(Crossing(phi, "divergence", 0.0, change.lost))
    return all_crossings


def _discrete(system: System, stiffness_at: StiffnessAt, exact: Crossing | None, rate: float) -> Discrete | None:
    """What the scheme makes of steady sliding, which grows at a rate (1/s); None without contact."""
    phi = system.coefficients.phi
    h = system.weights.h
    if system.belt_speed == 0.0 or not stiffness_at(phi) > 0.0:
        return None
    if system.method.own_steps:  # the motion itself
        critical, bias = (exact.friction, 0.0) if exact else (None, None)
        return Discrete(math.exp(rate * h), rate, None, critical, bias)
    radius = spectral_radius(system, stiffness_at(phi), phi)
    critical = discrete_critical(system, stiffness_at, exact)
    growth = math.log(radius) / h if radius > 0.0 else None
    bias = critical - exact.friction if critical is not None and exact else None
    return Discrete(radius, growth, step_limit(system, stiffness_at), critical, bias)


def discrete_critical(system: System, stiffness_at: StiffnessAt, exact: Crossing | None) -> float | None:
    """φ at which steady sliding, U ≠ 0, loses stability in a scheme on the case's grid; None where nowhere.

    It is looked for up to twice the exact value.
    """

    @cache
    def signs_at(phi: float) -> list[Rounded]:
        return [Rounded(1.0 + MARGIN - spectral_radius(system, stiffness_at(phi), phi))]

    if grows(signs_at(0.0)):
        return 0.0
    highest = 2.0 * exact.friction if exact else LARGEST_FRICTION
    frictions = np.linspace(0.0, highest, FRICTIONS).tolist()
    # rounding moves a change by as much as this bracket
    return next((change.value for change in between(signs_at, frictions, 1e-9) if change.lost), None)


def step_limit(system: System, stiffness_at: StiffnessAt) -> float | None:
    """The largest stable step (s), looked for between ωh = 0.01 and 10⁴ at the highest natural frequency.

    0 where the scheme is unstable at any step, None where it is stable at all of them.
    """
    k = stiffness_at(0.0)
    omega = 2.0 * math.pi * natural_frequencies(system.coefficients, k)[1]

    def is_stable(h: float) -> bool:
        # Entries of the matrix are rounded to ε (ωh)² over the difference, double eigenvalues to the root of that:
        # where a direction has no spring they are double, so that no less than 1e-6 counts as growth.
        rounding = math.sqrt(np.finfo(float).eps / DIFFERENCE) * omega * h
        return spectral_radius(system, k, 0.0, h) <= 1.0 + max(1e-6, rounding)

    ladder = (10.0 ** np.arange(-2.0, 4.1, 0.25) / omega).tolist()
    if not is_stable(ladder[0]):
        return 0.0
    bracket = next((pair for pair in pairwise(ladder) if not is_stable(pair[1])), None)
    return bisect(is_stable, *bracket, halvings=60, geometric=True)[0] if bracket else None
