"""Growth of disturbances where the waves of a wheel have no common period: Lyapunov's exponent of a long motion.

Such a motion never repeats, so that no branch can be followed. The exponent is measured at single values, with an
error bar. In full contact the motion is linear, and theory gives the growth.
"""

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from brakecli.analysis.stability.certain import Rounded
from brakecli.analysis.stability.margin import between_known
from brakecli.solver.arrays import Floats
from brakecli.solver.motion.rough import RoughFlow, Status, default_cells, default_steps
from brakecli.solver.period import LONGEST
from brakecli.solver.steady_sliding import SteadySliding
from brakecli.solver.system import System
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search, of_changes
from brakecli.studies.sweeps.windows_of_branch import in_full_contact

# batches of a long run, segments of a batch, segments before the first
BATCHES = 8
BATCH = 4
TRANSIENT = 16

Steady = Callable[[float], tuple[System, SteadySliding] | None]


def length(system: System) -> float:
    """The time (s) of a segment: two periods of the slowest mode, or the passing of the longest wave."""
    slow = system.natural_frequencies[0]
    passing = abs(system.belt_speed) * float(system.wheel.turns.min())
    return min(max(2.0 / slow if slow > 0.0 else 0.0, 1.0 / passing), LONGEST / BATCH)


def exponent_length(system: System) -> float:
    """The time (s) of the motion that an exponent is measured in."""
    return (TRANSIENT + BATCHES * BATCH) * length(system)


def exponent(system: System, equilibrium: SteadySliding, linear: bool = False) -> Rounded | None:
    """Lyapunov's exponent (1/s) of the motion from steady sliding, by means over batches of a long run.

    It is hardly off by more than its error. A motion that leaves what roughness forces on it is on its way to
    another one, whose exponent says nothing: that part is left out. None where too little is left. The maps of a
    `linear` motion hardly change: there the eigenvalues of their product count, which do not swing as lengths of
    disturbances do.
    """
    flow = RoughFlow(system, default_cells(system))
    span = length(system)
    steps = default_steps(system, span)
    begin = np.array([equilibrium.x, equilibrium.y, 0.0, 0.0])
    fast = 2.0 * math.pi * system.natural_frequencies[1]
    scales = np.array([1.0, 1.0, fast, fast])
    state = begin
    frame = np.eye(4)
    logs = list[float]()
    away = list[float]()
    maps = list[Floats]()
    for k in range(TRANSIENT + BATCHES * BATCH):
        run = flow(state, k * span, span, steps, True)
        if run.status is not Status.DONE or run.derivative is None:
            return None
        state = run.state
        away.append(float(np.abs((state - begin) * scales).max()))
        if k >= TRANSIENT and away[-1] > 2.0 * max(away[: TRANSIENT // 2]):  # roughness alone takes it less far
            break
        maps.append(run.derivative * (scales[:, None] / scales))
        frame, triangle = np.linalg.qr(maps[-1] @ frame)
        logs.append(math.log(max(abs(float(triangle[0, 0])), 1e-300)))
    batches = (len(logs) - TRANSIENT) // BATCH
    if batches < 4:  # without which an error is not known
        return None
    if linear:
        half = len(maps) // 2
        one, other = (_growth(piece) / (len(piece) * span) for piece in (maps[:half], maps[half:]))
        return Rounded(0.5 * (one + other), 0.5 * abs(one - other))
    means = np.reshape(logs[TRANSIENT : TRANSIENT + batches * BATCH], (batches, BATCH)).mean(axis=1) / span
    longer = means[batches % 2 :].reshape(-1, 2).mean(axis=1)  # what wanders slowly is alike in neighbours
    off = max(float(rates.std(ddof=1)) / math.sqrt(len(rates)) for rates in (means, longer))
    return Rounded(float(means.mean()), 3.5 * off)  # of eight batches: 99 % of Student's distribution


def _growth(maps: list[Floats]) -> float:
    """ln of the largest eigenvalue of the product of all maps, the last one on the left."""
    product = maps[0] if len(maps) == 1 else np.linalg.multi_dot(maps[::-1])
    return math.log(max(float(np.abs(np.linalg.eigvals(product)).max()), 1e-300))


def by_exponents(critical: Critical, steady_at: Steady) -> Search:
    """Where the exponent changes its sign, between values at which it is certain."""

    @cache
    def unstable(value: float) -> bool | None:
        steady = steady_at(value)
        if steady is None:
            return True
        theory = in_full_contact(steady[0])
        by_theory = Rounded(theory.mode.growth, theory.known_to) if theory else None
        certain = by_theory is not None and by_theory.positive is not None
        measured = by_theory if certain else exponent(*steady, linear=by_theory is not None)
        return measured.positive if measured else None

    values = np.linspace(critical.lower, critical.upper, 33).tolist()
    if all(steady_at(value) is None for value in values):
        return Search(Outcome.NO_SLIDING)
    # four halvings towards the ends of a range in which the answer is not known
    changes = between_known(unstable, values, critical.tolerance, 4)
    return of_changes(critical, unstable(values[0]), changes)
