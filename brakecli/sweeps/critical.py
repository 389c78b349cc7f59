"""The critical value of a parameter: where steady sliding loses its stability, and from where on it vibrates."""

import math
import operator
from collections.abc import Callable
from enum import StrEnum
from functools import cache
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from brakecli.analysis.regime.rules import Regime, Verdict
from brakecli.analysis.stability.discrete import spectral_radius
from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.report import MARGIN, stability
from brakecli.analysis.stability.search import bisect
from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.system import System
from brakecli.sweeps.growth import Growth, Sliding, growth, sliding, with_step
from brakecli.sweeps.tables import Critical

Found = TypeVar("Found")

SCANNED = 9
"""Values of the parameter, both ends among them, whose growth is measured before a change is narrowed down."""
SCANNED_BY_EIGENVALUES = 129
"""Values whose eigenvalues are computed before a change is narrowed down."""
SCANNED_WHERE_OPEN = 17
"""The same where surfaces open: their mean stiffness takes time."""
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


class Search(NamedTuple):
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


CaseAt = Callable[[float], Case]
SystemAt = Callable[[float], System]
VerdictOf = Callable[[Case], Verdict | None]
Unstable = Callable[[float], bool | None]
"""Whether steady sliding is unstable at a value of the parameter; None where there is none."""


class _Change(NamedTuple):
    """Where stability changes, between `low` and `high`; without a value, why it does not."""

    outcome: Outcome
    value: float | None = None
    low: float = math.nan
    high: float = math.nan
    spread: float = 0.0


def search(critical: Critical, case_at: CaseAt, verdict_of: VerdictOf) -> Search:
    """Look for the critical value of the parameter that `case_at` sets; `verdict_of` runs a case."""

    def stepped(value: float) -> System:
        return with_step(system_of(case_at(value)))  # a case with a tolerance has no step

    exact, bias = _by_eigenvalues(critical, stepped)
    by_simulation = critical.method == "simulation"
    found = _by_simulation(critical, stepped) if by_simulation else exact

    def lasts(value: float) -> bool | None:
        known = None if found.outcome is not Outcome.FOUND else value >= found.high
        linear = _never_opens(stepped(value))
        case = case_at(value)
        longer = changed(case, solver={"duration": LONGER * case.solver.duration})
        # Beside stable sliding it may yet fade away, or has not yet come to where it lasts.
        verdict = None if known is False else _vibrates(verdict_of(case), case.solver.duration, known, linear)
        if verdict is not None:
            return verdict
        return _vibrates(verdict_of(longer), longer.solver.duration, known, linear)

    lasting = _sustained(critical, lasts, found) if by_simulation else (None, Outcome.NONE)
    if found.value is None:
        return Search(found.outcome, None, None, None, None, bias, exact.value, *lasting)
    error = 0.5 * (found.high - found.low) + (abs(bias or 0.0) if by_simulation else 0.0) + found.spread
    return Search(found.outcome, found.value, found.low, found.high, error, bias, exact.value, *lasting)


def _by_eigenvalues(critical: Critical, system_at: SystemAt) -> tuple[_Change, float | None]:
    """Where the eigenvalues of steady sliding pass zero, and by how much the scheme at its step moves that."""
    if critical.parameter == "friction.coefficient":
        return _friction_by_eigenvalues(critical, system_at(critical.lower))

    @cache
    def at(value: float) -> Sliding | None:
        return _sliding(system_at, value)

    def grows(found: Sliding) -> bool:
        c, k = found.system.coefficients, found.stiffness
        rate = eigenvalue_growth(c, k, found.grip)
        return rate > 1e-12 * math.sqrt((abs(c.c_xx) + abs(c.c_yy) + k) / c.m)

    def grows_in_steps(found: Sliding) -> bool:
        phi = found.system.coefficients.phi
        return spectral_radius(found.system, found.stiffness, phi) > 1.0 + MARGIN

    def first_change(unstable: Callable[[Sliding], bool], count: int) -> _Change:
        """The first change among `count` values, narrowed down."""
        answer = _if_known(at, unstable)
        scanned = _scan(critical, answer, count)
        if scanned.value is None:
            return scanned
        before = answer(scanned.low)
        low, high = bisect(lambda value: answer(value) == before, scanned.low, scanned.high, width=width)
        return _Change(scanned.outcome, 0.5 * (low + high), low, high)

    first = at(critical.lower)
    opens = first is not None and first.stiffness < 0.999 * first.system.contact_stiffness
    width = critical.tolerance * (1e-2 if opens else 1e-9)
    exact = first_change(grows, SCANNED_WHERE_OPEN if opens else SCANNED_BY_EIGENVALUES)
    own = first_change(grows_in_steps, SCANNED_WHERE_OPEN)
    if exact.value is None or own.value is None or exact.outcome is not own.outcome:
        return exact, None
    return exact, own.value - exact.value


def _friction_by_eigenvalues(critical: Critical, system: System) -> tuple[_Change, float | None]:
    """The first loss of stability within the range of φ, otherwise the first regain."""
    report = stability(system)
    within = [each for each in report.crossings if critical.lower <= each.friction <= critical.upper]
    if within:
        crossing = min(within, key=lambda each: not each.lost)
        bias = report.discrete.bias if report.discrete and crossing is report.critical else None
        outcome = Outcome.FOUND if crossing.lost else Outcome.REGAINED
        return _Change(outcome, crossing.friction, crossing.friction, crossing.friction), bias
    if report.stable is None or report.belt_speed == 0.0:
        return _Change(Outcome.NO_SLIDING), None
    return _Change(Outcome.STABLE if report.stable else Outcome.UNSTABLE), None


def _sliding(system_at: SystemAt, value: float) -> Sliding | None:
    try:
        return sliding(system_at(value))
    except CaseError:  # a value that no case can have, between two that it can
        return None


def _if_known(at: Callable[[float], Found | None], unstable: Callable[[Found], bool]) -> Unstable:
    def answer(value: float) -> bool | None:
        found = at(value)
        return None if found is None else unstable(found)

    return answer


def _scan(critical: Critical, unstable: Unstable, count: int) -> _Change:
    """Between which of `count` values stability is first lost, otherwise regained.

    It is lost, too, where steady sliding ends.
    """
    values = [float(value) for value in np.linspace(critical.lower, critical.upper, count)]
    verdicts = [unstable(value) for value in values]
    stable = [verdict is False for verdict in verdicts]
    for outcome, change in ((Outcome.FOUND, (True, False)), (Outcome.REGAINED, (False, True))):
        for (low, high), pair in zip(pairwise(values), pairwise(stable), strict=True):
            if pair == change:
                return _Change(outcome, 0.5 * (low + high), low, high)
    if all(verdict is None for verdict in verdicts):
        return _Change(Outcome.NO_SLIDING)
    return _Change(Outcome.UNSTABLE if any(verdicts) else Outcome.STABLE)


def _by_simulation(critical: Critical, system_at: SystemAt) -> _Change:
    """Where the growth of small disturbances passes zero, by Brent's method, between two values on either side."""
    from scipy.optimize import brentq

    @cache
    def at(value: float) -> Growth | None:
        steady = _sliding(system_at, value)
        return None if steady is None else growth(steady)

    unstable = _if_known(at, lambda measured: measured.unstable)
    scanned = _scan(critical, unstable, SCANNED)
    if scanned.value is None:
        return scanned
    low, high = scanned.low, scanned.high
    below = unstable(low)
    largest = max(abs(measured.rate) for measured in (at(low), at(high)) if measured is not None)

    def excess(value: float) -> float:  # where steady sliding has ended: as far beyond as the growth is large
        measured = at(value)
        return largest if measured is None else measured.rate - measured.noise

    root = float(brentq(excess, low, high, xtol=0.05 * critical.tolerance))
    for edge in (root - 0.4 * critical.tolerance, root + 0.4 * critical.tolerance):
        if low < edge < high:
            low, high = (edge, high) if unstable(edge) == below else (low, edge)
    low, high = bisect(lambda value: unstable(value) == below, low, high, width=critical.tolerance)
    value = root if low <= root <= high else 0.5 * (low + high)
    ends = at(low), at(high)
    spread = 0.0
    if ends[0] is not None and ends[1] is not None and (rise := abs(ends[1].rate - ends[0].rate)) > 0.0:
        spread = max(ends[0].spread, ends[1].spread) * (high - low) / rise
    return _Change(scanned.outcome, value, low, high, min(spread, critical.upper - critical.lower))


def _never_opens(system: System) -> bool:
    """Whether surfaces that slide on each other touch everywhere: then their motion is linear."""
    found = sliding(system)
    return found is not None and found.stiffness >= 0.999 * found.system.contact_stiffness


def _vibrates(verdict: Verdict | None, duration: float, unstable: bool | None, linear: bool) -> bool | None:
    """Whether a run has ended in vibration that lasts by itself; None where the run does not answer that.

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
    lasts = cache(vibrates)
    low, high, tolerance = critical.lower, critical.upper, critical.tolerance
    if found.outcome is Outcome.FOUND:
        low, high = max(low, found.low), min(high, found.high)
        stride = tolerance
        while lasts(low) is True and low > critical.lower:
            low, high = max(critical.lower, low - stride), low
            stride *= GALLOP
    if lasts(low) is None or lasts(high) is None:
        return None, Outcome.UNDECIDED
    if lasts(low) or not lasts(high):
        return None, Outcome.SUSTAINED if lasts(low) else Outcome.DAMPED
    low, high = bisect(_if_known(lasts, operator.not_), low, high, width=tolerance)
    if high - low > tolerance:
        return None, Outcome.UNDECIDED
    return 0.5 * (low + high), Outcome.FOUND
