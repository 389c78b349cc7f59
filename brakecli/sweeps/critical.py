"""The critical value of a parameter: where steady sliding loses its stability, and from where on it vibrates."""

import math
from collections.abc import Callable
from enum import StrEnum
from functools import cache
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from brakecli.analysis.regime.verdict import Regime, Verdict
from brakecli.analysis.stability.discrete import spectral_radius
from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.report import MARGIN, stability
from brakecli.analysis.stability.search import bisect
from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.system import System
from brakecli.sweeps.growth import Sliding, growth, sliding, with_step
from brakecli.sweeps.tables import Critical

Known = TypeVar("Known")
Reply = TypeVar("Reply")

SCANNED = 9  # values of the parameter, both ends among them, between which a change is looked for by runs
SCANNED_BY_EIGENVALUES = 129
SCANNED_WHERE_OPEN = 17  # by eigenvalues where surfaces open: their mean stiffness takes time
GALLOP = 4.0  # factor from one stride to the next in looking for the end of sustained vibration
LONGER = 8.0  # durations of the case that vibration beside stable sliding has to last


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
    """The answer for one point; None, or NaN, stands for what there is not.

    `error` is the half width of the bracket, plus the bias of the scheme at its step, plus what the growth
    measured in two halves of the time leaves open. `bias`: the scheme's own critical value less the exact one.
    """

    outcome: Outcome
    value: float | None = None
    lower: float = math.nan
    upper: float = math.nan
    error: float | None = None
    bias: float | None = None
    eigenvalue: float | None = None
    sustained: float | None = None
    sustained_outcome: Outcome = Outcome.NONE


SlidingAt = Callable[[float], Sliding | None]
Answer = Callable[[float], bool | None]
"""The answer to a question at a value of the parameter; None where there is none, as without steady sliding."""


def search(
    critical: Critical, case_at: Callable[[float], Case], verdict_of: Callable[[Case], Verdict | None]
) -> Search:
    """Look for the critical value of the parameter that `case_at` sets; `verdict_of` runs a case."""

    @cache
    def sliding_at(value: float) -> Sliding | None:
        try:
            return sliding(with_step(system_of(case_at(value))))
        except CaseError:  # no equilibrium, or a value that no case can have, between two that it can
            return None

    if critical.parameter == "friction.coefficient":
        exact = _friction_by_eigenvalues(critical, with_step(system_of(case_at(critical.lower))))
    else:
        exact = _by_eigenvalues(critical, sliding_at)
    if critical.method == "eigenvalue":
        return exact
    found = _by_simulation(critical, sliding_at, exact)

    @cache
    def fades(value: float) -> bool | None:
        unstable = value >= found.upper if found.outcome is Outcome.FOUND else None
        steady, case = sliding_at(value), case_at(value)
        linear = steady is not None and not steady.opens
        # Beside stable sliding it may yet fade away, or has not yet come to where it lasts.
        for times in (LONGER,) if unstable is False else (1.0, LONGER):
            duration = times * case.solver.duration
            verdict = verdict_of(changed(case, solver={"duration": duration}))
            if (answer := _fades(verdict, duration, unstable, linear)) is not None:
                return answer
        return None

    sustained, outcome = _sustained(critical, fades, found)
    return found._replace(sustained=sustained, sustained_outcome=outcome)


def _by_eigenvalues(critical: Critical, sliding_at: SlidingAt) -> Search:
    """Where the eigenvalues of steady sliding pass zero, and by how much the scheme at its step moves that."""

    def grows(found: Sliding) -> bool:
        c, k = found.system.coefficients, found.stiffness
        rate = eigenvalue_growth(c, k, found.grip)
        return rate > 1e-12 * math.sqrt((abs(c.c_xx) + abs(c.c_yy) + k) / c.m)

    def grows_in_steps(found: Sliding) -> bool:
        phi = found.system.coefficients.phi
        return spectral_radius(found.system, found.stiffness, phi) > 1.0 + MARGIN

    first = sliding_at(critical.lower)
    opens = first is not None and first.opens
    width = critical.tolerance * (1e-2 if opens else 1e-9)
    count = SCANNED_WHERE_OPEN if opens else SCANNED_BY_EIGENVALUES
    exact = _first_change(critical, _if_known(sliding_at, grows), count, width)
    own = _first_change(critical, _if_known(sliding_at, grows_in_steps), SCANNED_WHERE_OPEN, width)
    exact = exact._replace(eigenvalue=exact.value)
    if exact.value is None or own.value is None or exact.outcome is not own.outcome:
        return exact
    return exact._replace(bias=own.value - exact.value)


def _friction_by_eigenvalues(critical: Critical, system: System) -> Search:
    """The first loss of stability within the range of φ, otherwise the first regain."""
    report = stability(system)
    within = [each for each in report.crossings if critical.lower <= each.friction <= critical.upper]
    if within:
        crossing = min(within, key=lambda each: not each.lost)
        bias = report.discrete.bias if report.discrete and crossing is report.critical else None
        outcome, value = Outcome.FOUND if crossing.lost else Outcome.REGAINED, crossing.friction
        return Search(outcome, value, value, value, 0.0, bias, eigenvalue=value)
    if report.stable is None or report.belt_speed == 0.0:
        return Search(Outcome.NO_SLIDING)
    return Search(Outcome.STABLE if report.stable else Outcome.UNSTABLE)


def _if_known(
    at: Callable[[float], Known | None], reply: Callable[[Known], Reply | None]
) -> Callable[[float], Reply | None]:
    return cache(lambda value: None if (known := at(value)) is None else reply(known))


def _first_change(critical: Critical, unstable: Answer, count: int, width: float = math.inf) -> Search:
    """Where stability is first lost among `count` values, otherwise regained, narrowed down to a width.

    It is lost, too, where steady sliding ends.
    """
    values = np.linspace(critical.lower, critical.upper, count).tolist()
    verdicts = [unstable(value) for value in values]
    for outcome, change in ((Outcome.FOUND, (True, False)), (Outcome.REGAINED, (False, True))):
        for bracket, (before, after) in zip(pairwise(values), pairwise(verdicts), strict=True):
            if (before is False, after is False) == change:
                low, high = bisect(lambda value: unstable(value) == before, *bracket, width=width)  # noqa: B023
                return Search(outcome, 0.5 * (low + high), low, high, 0.5 * (high - low))
    if all(verdict is None for verdict in verdicts):
        return Search(Outcome.NO_SLIDING)
    return Search(Outcome.UNSTABLE if any(verdicts) else Outcome.STABLE)


def _by_simulation(critical: Critical, sliding_at: SlidingAt, exact: Search) -> Search:
    """Where the growth of small disturbances passes zero, by Brent's method, between two values on either side."""
    from scipy.optimize import brentq

    at = _if_known(sliding_at, growth)
    unstable = _if_known(at, lambda measured: measured.rate > measured.noise)
    scanned = _first_change(critical, unstable, SCANNED)
    if scanned.value is None:
        return scanned._replace(bias=exact.bias, eigenvalue=exact.value)
    low, high = scanned.lower, scanned.upper
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
    spread, before, after = 0.0, at(low), at(high)
    if before is not None and after is not None and before.rate != after.rate:
        spread = max(before.spread, after.spread) * (high - low) / abs(after.rate - before.rate)
    error = 0.5 * (high - low) + abs(exact.bias or 0.0) + min(spread, critical.upper - critical.lower)
    return Search(scanned.outcome, value, low, high, error, exact.bias, exact.value)


def _fades(verdict: Verdict | None, duration: float, unstable: bool | None, linear: bool) -> bool | None:
    """Whether the vibration of a run dies out; None where the run does not answer that.

    `unstable`: what is known of steady sliding. Where it is unstable no vibration can die out. A `linear` motion
    that neither sticks nor lifts off is on its way by the same equations: it lasts if sliding is unstable. One
    that does is on its way to a limit cycle if it fades by less than a factor e in all its `duration` (s).
    """
    if verdict is None or verdict.contact_loss_fraction == 1.0 or verdict.stick_fraction == 1.0:
        return None
    limited = verdict.stick_fraction > 0.0 or verdict.contact_loss_fraction > 0.0
    if unstable or (unstable is False and linear and not limited):
        return not unstable
    if verdict.regime is not Regime.UNDECIDED:
        return verdict.regime is Regime.DAMPED
    slope = verdict.evidence.get("envelope_slope")
    if limited:
        return slope is not None and slope * duration <= -1.0
    error = verdict.evidence.get("envelope_slope_error", 0.0)
    return bool(slope <= 0.0) if slope is not None and abs(slope) > 3.0 * error else None


def _sustained(critical: Critical, fades: Answer, found: Search) -> tuple[float | None, Outcome]:
    """The least value at which vibration lasts from the case's own start, as far as it lasts above it.

    From where stability is lost the search strides down, ever faster, and then narrows down by halves.
    """
    low, high, tolerance = critical.lower, critical.upper, critical.tolerance
    if found.outcome is Outcome.FOUND:
        low, high = max(low, found.lower), min(high, found.upper)
        stride = tolerance
        while fades(low) is False and low > critical.lower:
            low, high = max(critical.lower, low - stride), low
            stride *= GALLOP
    if fades(low) is None or fades(high) is None:
        return None, Outcome.UNDECIDED
    if not fades(low) or fades(high):
        return None, Outcome.DAMPED if fades(low) else Outcome.SUSTAINED
    low, high = bisect(fades, low, high, width=tolerance)
    return (None, Outcome.UNDECIDED) if high - low > tolerance else (0.5 * (low + high), Outcome.FOUND)
