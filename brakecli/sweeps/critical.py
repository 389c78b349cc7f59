"""The critical value of a parameter: where steady sliding loses its stability, and from where on it vibrates."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from itertools import pairwise

import numpy as np

from brakecli.analysis.regime.rules import Regime, Verdict
from brakecli.analysis.stability.discrete import spectral_radius
from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.report import MARGIN, stability
from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.system import System
from brakecli.sweeps.growth import Growth, Sliding, growth, sliding, with_step
from brakecli.sweeps.tables import Critical, Method

SCANNED = 9
"""Values of the parameter, both ends among them, whose growth is measured before a change is narrowed down."""
SCANNED_BY_EIGENVALUES = 129
SCANNED_WHERE_OPEN = 17
"""As many where surfaces open, whose mean stiffness takes time."""
GALLOP = 4.0
"""Factor from one stride to the next in looking for the end of sustained vibration."""
LONGER = 8.0
"""Durations of the case that vibration beside stable sliding has to last."""


class Outcome(StrEnum):
    """What a search for a critical value has come to."""

    FOUND = "found"
    REGAINED = "found, stable above"
    STABLE = "stable throughout"
    UNSTABLE = "unstable throughout"
    NO_SLIDING = "no steady sliding"
    NONE = "not searched"
    DAMPED = "damped throughout"
    SUSTAINED = "sustained throughout"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Search:
    """The answer for one point; None stands for what there is not.

    `error` is the half width of the bracket, plus the bias of the scheme at its step, plus what the growth
    measured in two halves of the time leaves open. `bias`: the scheme's own critical value less the exact one.
    """

    outcome: Outcome
    value: float | None = None
    lower: float | None = None
    upper: float | None = None
    error: float | None = None
    bias: float | None = None
    eigenvalue: float | None = None
    sustained: float | None = None
    sustained_outcome: Outcome = Outcome.NONE


SystemAt = Callable[[float], System]
CaseAt = Callable[[float], Case]
Judge = Callable[[Case], Verdict | None]


def search(critical: Critical, case_at: CaseAt, judge: Judge) -> Search:
    """Look for the critical value of the parameter that `case_at` sets; `judge` runs a case to its verdict."""

    def stepped(value: float) -> System:
        return with_step(system_of(case_at(value)))  # where a tolerance is asked for, there is no step

    exact, bias = _by_eigenvalues(critical, stepped)
    if critical.method is Method.EIGENVALUE:
        error = None if exact.value is None else 0.5 * (exact.high - exact.low)
        low, high = (None, None) if exact.value is None else (exact.low, exact.high)
        return Search(exact.outcome, exact.value, low, high, error, bias, exact.value)
    found = _by_simulation(critical, stepped)

    def lasts(value: float) -> bool | None:
        known = None if found.outcome is not Outcome.FOUND else value >= found.high
        linear = _never_opens(stepped(value))
        case = case_at(value)
        longer = changed(case, solver={"duration": LONGER * case.solver.duration})
        # Beside stable sliding it may yet fade away, or has not yet come to where it lasts.
        verdict = None if known is False else _vibrates(judge(case), case.solver.duration, known, linear)
        if verdict is not None:
            return verdict
        return _vibrates(judge(longer), longer.solver.duration, known, linear)

    lasting = _sustained(critical, lasts, found)
    if found.value is None:
        return Search(found.outcome, None, None, None, None, bias, exact.value, *lasting)
    error = 0.5 * (found.high - found.low) + abs(bias or 0.0) + found.spread
    return Search(found.outcome, found.value, found.low, found.high, error, bias, exact.value, *lasting)


@dataclass(frozen=True)
class _Change:
    """Where stability changes: between `low` and `high`; or why there is no such place."""

    outcome: Outcome
    value: float | None = None
    low: float = math.nan
    high: float = math.nan
    spread: float = 0.0


def _by_eigenvalues(critical: Critical, system_at: SystemAt) -> tuple[_Change, float | None]:
    """Where the eigenvalues of steady sliding pass zero, and by how much the scheme at its step moves that."""
    if critical.parameter == "friction.coefficient":
        report = stability(system_at(critical.lower))
        within = [each for each in report.crossings if critical.lower <= each.friction <= critical.upper]
        for crossing in sorted(within, key=lambda each: not each.lost)[:1]:
            bias = report.discrete.bias if report.discrete and crossing is report.critical else None
            outcome = Outcome.FOUND if crossing.lost else Outcome.REGAINED
            return _Change(outcome, crossing.friction, crossing.friction, crossing.friction), bias
        if report.stable is None or report.belt_speed == 0.0:
            return _Change(Outcome.NO_SLIDING), None
        return _Change(Outcome.STABLE if report.stable else Outcome.UNSTABLE), None

    @cache
    def at(value: float) -> Sliding | None:
        return _sliding(system_at, value)

    def exactly(value: float) -> bool | None:
        found = at(value)
        if found is None:
            return None
        c, k = found.system.coefficients, found.stiffness
        rate = eigenvalue_growth(c, k, found.grip)
        return rate > 1e-12 * math.sqrt((abs(c.c_xx) + abs(c.c_yy) + k) / c.m)

    def discretely(value: float) -> bool | None:
        found = at(value)
        if found is None:
            return None
        system = found.system
        c, belt = system.coefficients, system.belt_speed
        return spectral_radius(c, system.weights, system.scheme, found.stiffness, belt) > 1.0 + MARGIN

    first = at(critical.lower)
    opens = first is not None and first.stiffness < 0.999 * first.system.contact_stiffness
    count, width = (SCANNED_WHERE_OPEN, 1e-2) if opens else (SCANNED_BY_EIGENVALUES, 1e-9)
    exact = _first_change(critical, exactly, count, width * critical.tolerance)
    own = _first_change(critical, discretely, SCANNED_WHERE_OPEN, width * critical.tolerance)
    biased = exact.value is not None and own.value is not None and exact.outcome is own.outcome
    return exact, own.value - exact.value if biased else None  # type: ignore[operator]


def _sliding(system_at: SystemAt, value: float) -> Sliding | None:
    try:
        return sliding(system_at(value))
    except CaseError:  # a value that no case can have, between two that it can
        return None


def _first_change(
    critical: Critical, unstable: Callable[[float], bool | None], count: int, width: float
) -> _Change:
    """The first loss of stability among `count` values, or else the first regain, narrowed to a width."""
    values = [float(value) for value in np.linspace(critical.lower, critical.upper, count)]
    verdicts = [unstable(value) for value in values]
    interval = _interval(values, verdicts)
    if isinstance(interval, Outcome):
        return _Change(interval)
    low, high, outcome = interval
    before = unstable(low)
    while high - low > width and low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if unstable(middle) == before else (low, middle)
    return _Change(outcome, 0.5 * (low + high), low, high)


def _interval(values: list[float], verdicts: list[bool | None]) -> tuple[float, float, Outcome] | Outcome:
    """Between which values stability is lost, or else regained; a loss, too, where steady sliding ends."""
    steps = list(zip(pairwise(values), pairwise(verdicts), strict=True))
    for (low, high), (before, after) in steps:
        if before is False and after is not False:
            return low, high, Outcome.FOUND
    for (low, high), (before, after) in steps:
        if before is not False and after is False:
            return low, high, Outcome.REGAINED
    if all(verdict is None for verdict in verdicts):
        return Outcome.NO_SLIDING
    return Outcome.UNSTABLE if any(verdicts) else Outcome.STABLE


def _by_simulation(critical: Critical, system_at: SystemAt) -> _Change:
    """Where the growth of small disturbances passes zero, by Brent's method, between two values on either side."""
    from scipy.optimize import brentq  # only searches wait for it

    found: dict[float, Growth | None] = {}

    def at(value: float) -> Growth | None:
        if value not in found:
            steady = _sliding(system_at, value)
            found[value] = growth(steady) if steady is not None else None
        return found[value]

    def unstable(value: float) -> bool | None:
        measured = at(value)
        return None if measured is None else measured.unstable

    values = [float(value) for value in np.linspace(critical.lower, critical.upper, SCANNED)]
    interval = _interval(values, [unstable(value) for value in values])
    if isinstance(interval, Outcome):
        return _Change(interval)
    low, high, outcome = interval
    below = unstable(low)
    rates = [abs(measured.rate) for measured in (at(low), at(high)) if measured is not None]

    def excess(value: float) -> float:  # where steady sliding has ended: as far beyond as the growth is large
        measured = at(value)
        return max(rates) if measured is None else measured.rate - measured.noise

    root = float(brentq(excess, low, high, xtol=0.05 * critical.tolerance))
    for edge in (root - 0.4 * critical.tolerance, root + 0.4 * critical.tolerance):
        if low < edge < high:
            low, high = (edge, high) if unstable(edge) == below else (low, edge)
    while high - low > critical.tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if unstable(middle) == below else (low, middle)
    value = root if low <= root <= high else 0.5 * (low + high)
    ends = at(low), at(high)
    spread = 0.0
    if ends[0] is not None and ends[1] is not None and (rise := abs(ends[1].rate - ends[0].rate)) > 0.0:
        spread = max(ends[0].spread, ends[1].spread) * (high - low) / rise
    return _Change(outcome, value, low, high, min(spread, critical.upper - critical.lower))


def _never_opens(system: System) -> bool:
    """Whether surfaces that slide on each other touch everywhere: then their motion is linear."""
    found = sliding(system)
    return found is not None and found.stiffness >= 0.999 * found.system.contact_stiffness


def _vibrates(verdict: Verdict | None, duration: float, unstable: bool | None, linear: bool) -> bool | None:
    """Whether a run has ended in vibration that lasts by itself; None where that cannot be told.

    `unstable`: what is known of steady sliding. Where it is unstable no vibration can die out. A `linear` motion
    that neither sticks nor lifts off is on its way by the same equations: it lasts if sliding is unstable. One
    that does is on its way to a limit cycle if it fades by less than a factor e in all its `duration` (s).
    """
    if verdict is None or verdict.contact_loss_fraction == 1.0 or verdict.stick_fraction == 1.0:
        return None
    limited = verdict.stick_fraction > 0.0 or verdict.contact_loss_fraction > 0.0
    if unstable or (unstable is False and linear and not limited):
        return unstable
    if verdict.regime is Regime.DAMPED:
        return False
    if verdict.regime is not Regime.UNDECIDED:
        return True
    slope = verdict.evidence.get("envelope_slope")
    if limited:
        return slope is None or slope * duration > -1.0
    error = verdict.evidence.get("envelope_slope_error", 0.0)
    return bool(slope > 0.0) if slope is not None and abs(slope) > 3.0 * error else None


def _sustained(
    critical: Critical, vibrates: Callable[[float], bool | None], found: _Change
) -> tuple[float | None, Outcome]:
    """The least value at which vibration lasts from the case's own start, as far as it lasts above it.

    From where stability is lost the search strides down, ever faster, and then narrows down by halves.
    """
    at = cache(vibrates)
    low, high, tolerance = critical.lower, critical.upper, critical.tolerance
    if found.outcome is Outcome.FOUND:
        low, high = max(low, found.low), min(high, found.high)
        stride = tolerance
        while at(low) is True and low > critical.lower:
            low, high = max(critical.lower, low - stride), low
            stride *= GALLOP
    if at(low) is None or at(high) is None:
        return None, Outcome.UNDECIDED
    if at(low) or not at(high):
        return None, Outcome.SUSTAINED if at(low) else Outcome.DAMPED
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        verdict = at(middle)
        if verdict is None:
            return None, Outcome.UNDECIDED
        low, high = (low, middle) if verdict else (middle, high)
    return 0.5 * (low + high), Outcome.FOUND
