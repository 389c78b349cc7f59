"""The critical value of a parameter: where steady sliding loses its stability, and from where on it vibrates."""

import math
from collections.abc import Callable
from functools import cache, partial
from itertools import pairwise

import numpy as np

from brakecli.analysis.regime.verdict import Verdict
from brakecli.analysis.stability.certain import EPSILON, Rounded, conditions, links_of
from brakecli.analysis.stability.discrete import spectral_radius
from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.modes import is_undamped
from brakecli.analysis.stability.report import MARGIN, stability
from brakecli.analysis.stability.search import bisect
from brakecli.branches.forced import Forced
from brakecli.branches.line import Line
from brakecli.branches.problem import Array
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.system import System
from brakecli.sweeps.early import Known
from brakecli.sweeps.error_bar import left_open
from brakecli.sweeps.floquet import Disturbances
from brakecli.sweeps.growth import Sliding, has_exact_steps, sliding, with_step
from brakecli.sweeps.scan import between, scanned
from brakecli.sweeps.sustained import sustained
from brakecli.sweeps.tables import Critical
from brakecli.sweeps.windows import Edge, Outcome, Search, no_edge, of_edges

EDGES = 4  # halvings towards the ends of a range of the parameter in which the answer is not known
SCANNED_BY_EIGENVALUES = 129
SCANNED_WHERE_OPEN = 17  # by eigenvalues where surfaces open: their mean stiffness takes time


SlidingAt = Callable[[float], Sliding | None]
Signs = list[Rounded] | None
"""What is positive where sliding is stable; None where there is no steady sliding."""
EdgeIn = Callable[[float, float], Edge]
Answer = Callable[[float], bool | None]
"""The answer to a question at a value of the parameter; None where it is not known."""


def search(
    critical: Critical, case_at: Callable[[float], Case], verdict_of: Callable[[Case], Verdict | Known | None]
) -> Search:
    """Look for the critical value of the parameter that `case_at` sets; `verdict_of` runs a case."""
    case_at = cache(case_at)
    exact_steps = all(has_exact_steps(case_at, end) for end in (critical.lower, critical.upper))

    @cache
    def sliding_at(value: float) -> Sliding | None:
        try:
            return sliding(with_step(system_of(case_at(value)), unless=exact_steps))
        except CaseError:  # no equilibrium, or a value that no case can have, between two that it can
            return None

    if critical.parameter == "friction.coefficient":
        case = case_at(critical.lower)
        exact = _friction_by_eigenvalues(critical, case, with_step(system_of(case), unless=exact_steps))
    else:
        exact = _by_eigenvalues(critical, case_at, sliding_at)
    if critical.method == "eigenvalue":
        return exact
    found = _bracketed(critical, exact) if exact_steps else _by_simulation(critical, sliding_at, exact)

    def unstable(value: float) -> bool | None:
        if found.outcome is Outcome.FOUND:
            return value >= found.upper
        known = found.outcome in (Outcome.REGAINED, Outcome.STABLE, Outcome.UNSTABLE)
        return any(low <= value <= high for low, high in found.windows) if known else None

    line = Line(case_at(critical.lower), [critical.parameter], critical.lower, critical.upper)
    problem = cache(lambda: Forced.along(line))

    def calm(value: float) -> list[Array]:
        try:
            point = problem().begun(line.place(value))
        except CaseError:
            return []
        return [np.array(point.facts.state)] if point is not None and point.stable else []

    lasting = sustained(line, critical.tolerance, found, unstable, calm, verdict_of)
    return found._replace(sustained=lasting.value, sustained_outcome=lasting.outcome)


def _bracketed(critical: Critical, exact: Search) -> Search:
    """The answer of the eigenvalues with a bracket as wide as one of runs."""
    if exact.value is None or exact.error is None:
        return exact
    half = max(0.4 * critical.tolerance, exact.error)
    lower, upper = max(critical.lower, exact.value - half), min(critical.upper, exact.value + half)
    return exact._replace(lower=lower, upper=upper, error=max(0.5 * (upper - lower), exact.error))


def _by_eigenvalues(critical: Critical, case_at: Callable[[float], Case], sliding_at: SlidingAt) -> Search:
    """Where the eigenvalues of steady sliding pass zero, and by how much the scheme at its step moves that."""

    @cache
    def signs_at(value: float) -> Signs:
        try:
            system, links = system_of(case_at(value)), links_of(case_at(value))
        except CaseError:
            return None
        if not system.smooth:
            return conditions(links, found.stiffness, found.grip) if (found := sliding_at(value)) else None
        if system.belt_speed == 0.0 or system.coefficients.c_xx == 0.0:
            return None
        grip = math.copysign(system.coefficients.phi, system.belt_speed)
        pressed = links.pressed * Rounded(system.load_at_start)
        return [*conditions(links, system.contact_stiffness, grip), pressed]

    def grows_in_steps(value: float) -> bool:
        found = sliding_at(value)
        phi = found.system.coefficients.phi if found else 0.0
        return found is None or spectral_radius(found.system, found.stiffness, phi) > 1.0 + MARGIN

    first = sliding_at(critical.lower)
    opens = first is not None and first.opens
    width = critical.tolerance * (1e-2 if opens else 1e-9)

    def edge(unstable: Callable[[float], bool], low: float, high: float) -> Edge:
        lost = unstable(high)
        low, high = bisect(lambda value: unstable(value) is not lost, low, high, width=width)
        return Edge(0.5 * (low + high), low, high, 0.5 * (high - low), lost)

    def found(unstable: Callable[[float], bool], edge: EdgeIn, count: int, values: list[float]) -> Search:
        values = sorted({*np.linspace(critical.lower, critical.upper, count).tolist(), *values})
        return _answer(critical, sliding_at, unstable, values, edge)

    scanned = SCANNED_WHERE_OPEN if opens else SCANNED_BY_EIGENVALUES
    exact = found(
        lambda value: _grows(signs_at(value)), partial(_certain, critical, signs_at, width=width), scanned, []
    )
    exact = exact._replace(eigenvalue=exact.value)
    if exact.value is None:
        return exact
    beside = sliding_at(exact.lower) or sliding_at(exact.upper)
    if beside is None or beside.system.method.own_steps:
        return exact._replace(bias=0.0)
    in_steps = cache(grows_in_steps)
    middles = between(critical.lower, critical.upper, exact.windows)
    own = found(in_steps, partial(edge, in_steps), SCANNED_WHERE_OPEN, middles)
    if own.value is None or exact.outcome is not own.outcome:
        return exact
    return exact._replace(bias=own.value - exact.value)


def _grows(signs: Signs) -> bool:
    """Whether disturbances surely grow, or there is no steady sliding."""
    return signs is None or any(each.negative for each in signs)


def _certain(
    critical: Critical, signs_at: Callable[[float], Signs], low: float, high: float, *, width: float = 0.0
) -> Edge:
    """The change between two values, in a bracket at whose ends its side is sure, whatever rounding does."""
    lost = _grows(signs_at(high))
    low, high = bisect(lambda value: _grows(signs_at(value)) is not lost, low, high, width=width)
    stable, bound = (low, critical.lower) if lost else (high, critical.upper)
    passing = {k for k, each in enumerate(signs_at(high if lost else low) or ()) if each.negative}

    def hidden(value: float) -> bool:
        """Whether rounding may hide what passes zero; where steady sliding ends that may be anything.

        It was not surely negative at the end of the bracket: there its true value is above -2 errors, and rounding
        alone takes none nearby below -4.
        """
        signs = [each for k, each in enumerate(signs_at(value) or ()) if k in passing or not passing]
        return any(-4.0 * each.error <= each.value <= each.error for each in signs)

    stride = math.copysign(max(high - low, EPSILON * abs(stable)), bound - stable)
    while hidden(stable) and stable != bound:
        stable, stride = (max if lost else min)(stable + stride, bound), 2.0 * stride
    low, high = (stable, high) if lost else (low, stable)
    return Edge(0.5 * (low + high), low, high, 0.5 * (high - low), lost)


def _friction_by_eigenvalues(critical: Critical, case: Case, system: System) -> Search:
    """The first loss of stability within the range of φ, otherwise the first regain."""
    report, links = stability(system), links_of(case)

    @cache
    def signs_at(phi: float) -> Signs:
        k = report.stiffness_at(phi)
        return conditions(links, k, math.copysign(phi, report.belt_speed)) if math.isfinite(k) else None

    within = [each.friction for each in report.crossings if critical.lower <= each.friction <= critical.upper]
    edges = []
    for phi, (low, high) in zip(within, pairwise(between(critical.lower, critical.upper, [within])), strict=True):
        if _grows(signs_at(low)) is not _grows(signs_at(high)):  # otherwise rounding hides both ends of a window
            edge = _certain(critical, signs_at, low, high)
            low, high = min(edge.lower, phi), max(edge.upper, phi)
            edges.append(edge._replace(value=phi, lower=low, upper=high, error=max(phi - low, high - phi)))
    held = system.coefficients.c_xx > 0.0  # otherwise there is steady sliding without friction only
    if not edges and (report.stable is None or report.belt_speed == 0.0 or not held):
        return Search(Outcome.NO_SLIDING)
    found = of_edges(critical, not edges[0].lost if edges else not report.stable, edges)
    if found.value is None:
        return found
    lost = report.critical is not None and found.value == report.critical.friction
    return found._replace(eigenvalue=found.value, bias=report.discrete.bias if report.discrete and lost else None)


def _answer(
    critical: Critical, sliding_at: SlidingAt, unstable: Answer, values: list[float], edge: EdgeIn
) -> Search:
    """What the answers at some values say; `edge` narrows a change between two of them down.

    Stability is lost, too, where steady sliding ends. Where there is no answer it may be lost, as the bars say;
    without dashpots no motion leads through a resonance, and there eigenvalues say whether it may.
    """
    if all(sliding_at(value) is None for value in values):
        return Search(Outcome.NO_SLIDING)
    answers = [(value, unstable(value)) for value in values]
    decided = [(value, answer) for value, answer in answers if answer is not None]
    if not decided:
        return Search(Outcome.UNDECIDED)
    unknown = [value for value, answer in answers if answer is None and _may_grow(sliding_at(value))]
    (first, begun), (last, ended), edges = decided[0], decided[-1], list[Edge]()
    if unknown and unknown[0] < first:
        edges += [no_edge(values[0], first, lost=True), *[no_edge(first, values[0], lost=False)] * (not begun)]
    for (one, before), (other, after) in pairwise(decided):
        if before is not after:
            edges.append(edge(one, other))
            if unstable(one) is unstable(other):  # a motion was found to go on
                return _answer(critical, sliding_at, unstable, values, edge)
        elif not before and any(one < value < other for value in unknown):
            edges += [no_edge(one, other, lost=True), no_edge(other, one, lost=False)]
    if unknown and unknown[-1] > last:
        edges += [no_edge(values[-1], last, lost=False) if ended else no_edge(last, values[-1], lost=True)]
    if not edges and len(decided) < len(answers):
        return Search(Outcome.UNDECIDED)
    return of_edges(critical, begun and not (unknown and unknown[0] < first), edges)


def _may_grow(found: Sliding | None) -> bool:
    """Whether disturbances may grow where no motion is known."""
    if found is None or not is_undamped(c := found.system.coefficients):
        return True
    size = math.sqrt((c.c_xx + c.c_yy + found.stiffness) / c.m)
    return eigenvalue_growth(c, found.stiffness, found.grip) > 1e-12 * size


def _by_simulation(critical: Critical, sliding_at: SlidingAt, exact: Search) -> Search:
    """Where the growth of small disturbances passes zero, by Brent's method, between two values on either side."""
    at = Disturbances(sliding_at)
    values = scanned(at, critical.lower, critical.upper, critical.tolerance, exact.windows)
    by_runs = not any(measured.opened or measured.exact for measured in at.known.values() if measured)

    @cache
    def edge(low: float, high: float) -> Edge:
        found = _narrowed(at, low, high, critical, exact.bias)
        end, columns = "lower" if found.lost else "upper", exact.columns
        same = zip(columns[end], columns[f"{end}_error"], strict=True)
        away = min((abs(each - found.value) + bar for each, bar in same), default=0.0)
        # Eigenvalues of linear motions are exact: what the bar does not hold is rounding near self-locking.
        return found._replace(error=max(found.error, 1.001 * away)) if by_runs else found

    found = _answer(critical, sliding_at, at.unstable, values, edge)
    value, error = (math.inf, 0.0) if found.value is None else (found.value, found.error or 0.0)
    if by_runs and exact.value is not None and abs(value - exact.value) > error:  # weights that damp hide it
        found = Search(Outcome.UNDECIDED)
    return found._replace(bias=exact.bias, eigenvalue=exact.eigenvalue)


def _narrowed(at: Disturbances, low: float, high: float, critical: Critical, bias: float | None) -> Edge:
    """The change between two values with opposite answers, in a bracket as narrow as the tolerance if possible."""
    below, tolerance, wide = at.unstable(low), critical.tolerance, (low, high)
    ends = [measured for measured in (at.at(low), at.at(high)) if measured is not None]
    value, largest = None, max(abs(measured.rate) for measured in ends)
    if not any(measured.bar for measured in ends):
        from scipy.optimize import brentq

        def excess(value: float) -> float:  # where steady sliding has ended: as far beyond as the growth is large
            measured = at.at(value)
            return largest if measured is None else measured.rate - measured.noise

        value = float(brentq(excess, low, high, xtol=0.05 * tolerance))
        for end in (value - 0.4 * tolerance, value + 0.4 * tolerance):
            if low < end < high and (answer := at.unstable(end)) is not None:
                low, high = (end, high) if answer == below else (low, end)

    def as_below(value: float) -> bool | None:
        return None if (answer := at.unstable(value)) is None else answer == below

    low, high = bisect(as_below, low, high, width=tolerance)
    if at.goes_on(low, high, wide) and at.unstable(low) is at.unstable(high):
        if at.unstable(wide[0]) is at.unstable(wide[1]):
            return no_edge(*wide, lost=not below)
        return _narrowed(at, *((wide[0], low) if below else (high, wide[1])), critical, bias)
    if high - low > tolerance:  # not known in the middle
        middle = 0.5 * (low + high)
        low = bisect(lambda value: at.unstable(value) is below, low, middle, width=tolerance, halvings=EDGES)[0]
        high = bisect(lambda value: as_below(value) is not False, middle, high, width=tolerance, halvings=EDGES)[1]
    value = value if value is not None and low <= value <= high else 0.5 * (low + high)
    bar = left_open(at, (low, high), wide, bias, critical)
    error = 0.5 * (high - low) + min(bar, critical.upper - critical.lower)
    return Edge(value, low, high, error, not below)
