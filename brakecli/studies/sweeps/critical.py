"""The critical value of a parameter: where steady sliding loses its stability, and from where on it vibrates.

On smooth pads, and on a smooth wheel, the eigenvalues of steady sliding say the first. On a rough wheel it is read
off the branch of the motion that the waves force (`branches`); where their waves have no common period, Lyapunov's
exponent is measured instead.
"""

from collections.abc import Callable
from functools import cache, partial
from itertools import pairwise

import numpy as np

from brakecli.analysis.branches.answers import Answers
from brakecli.analysis.branches.line import Line
from brakecli.analysis.stability.certain import Rounded, conditions, links_of
from brakecli.analysis.stability.discrete import spectral_radius
from brakecli.analysis.stability.edges import middles
from brakecli.analysis.stability.margin import Change, Margin, between, grows, left_open, places
from brakecli.analysis.stability.modes import is_undamped
from brakecli.analysis.stability.report import MARGIN
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.steady_sliding import (
    PRESSED,
    WINDOWS,
    Mean,
    SteadySliding,
    finer,
    mean_contact,
    steady_sliding,
    tabulated,
)
from brakecli.solver.system import System
from brakecli.studies.sweeps.lyapunov import Steady, by_exponents
from brakecli.studies.sweeps.sustained import sustained
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search, of_changes
from brakecli.studies.sweeps.windows_of_branch import PART, explored, on_waves

SCANNED_BY_EIGENVALUES = 129
SCANNED_WHERE_OPEN = 17  # by eigenvalues where surfaces open: their mean stiffness takes time
_OF_SURFACES = ("contact.half_length", "contact.nodes", "contact.evaluator", "roughness.")


def search(critical: Critical, line: Line) -> Search:
    """Look for the critical value of the parameter along a line of cases."""
    case_at = cache(line.case_with)
    alike = not critical.parameter.startswith(_OF_SURFACES)  # so that all values share a table of the mean contact
    rest_at = cache(partial(_steady, case_at, tabulated if alike else None))

    def steady_at(value: float) -> tuple[System, SteadySliding] | None:
        steady = rest_at(value)
        return steady if steady and steady[1].is_pressed(steady[0].load_at_start) else None

    inner = middles(case_at(critical.lower), line.keys, critical.lower, critical.upper)
    exact = _by_eigenvalues(critical, case_at, rest_at, steady_at, inner)
    if critical.method == "eigenvalue" or exact.outcome is Outcome.NO_SLIDING:
        return exact
    case = case_at(critical.lower)
    explorer = explored(critical, case)
    result = exact
    waves = bool(system_of(case).wheel.g.size)
    answers = Answers(explorer.explored, line.own)
    if waves:
        repeats = explorer.waves is not None
        result = on_waves(critical, answers) if repeats else by_exponents(critical, steady_at)
        result = result._replace(bias=exact.bias, eigenvalue=exact.eigenvalue)

    lasting = sustained(answers, critical.tolerance, result)
    coexists = [answers.coexists_from]
    if lasting.at is not None and lasting.state is not None and result.unstable_at(lasting.at) is False:
        notes = [*explorer.notes]
        explorer.begin_at(explorer.line.place(lasting.at), lasting.state)
        explorer.notes = notes  # a user has given no motion
        answers = Answers(explorer.explored, line.own)
        coexists += [answers.coexists_from, lasting.at]  # it need not be periodic
    undamped = is_undamped(system_of(case).coefficients)
    says = not waves or not (explorer.waves is None or undamped or result.outcome is Outcome.UNDECIDED)
    words = [answers.sentence] if says else []
    if lasting.value not in (None, result.value):
        words.append(f"from its own start it vibrates from {lasting.value:.4g} on")
    return result._replace(
        sustained=lasting.value,
        sustained_outcome=lasting.outcome,
        coexists_from=min((value for value in coexists if value is not None), default=None),
        barrier=answers.barrier,
        sentence="; ".join(words),
    )


def _steady(
    case_at: Callable[[float], Case], mean: Callable[[System], Mean] | None, value: float
) -> tuple[System, SteadySliding] | None:
    """Steady sliding at a value, by the mean contact of a system; by its places where there is no other.

    None where the wheel does not turn, or no link holds the shoe. It need not be pressed on the wheel.
    """
    try:
        system = system_of(case_at(value))
        if system.belt_speed == 0.0 or system.coefficients.c_xx == 0.0:
            return None
        return system, steady_sliding(system, mean=mean(system) if mean else None)
    except CaseError:  # no equilibrium, or a value that no case can have, between two that it can
        return None


def _by_eigenvalues(
    critical: Critical,
    case_at: Callable[[float], Case],
    rest_at: Steady,
    steady_at: Steady,
    inner: list[float],
) -> Search:
    """Where the eigenvalues of steady sliding pass zero, and by how much the scheme at its step moves that.

    `inner` values are looked at as well.
    """

    def by(steady: Steady, value: float) -> list[Rounded] | None:
        try:
            system = system_of(case_at(value))
            links = links_of(case_at(value))
        except CaseError:
            return None
        grip = system.coefficients.grip(system.belt_speed)
        if not system.smooth:
            if (state := steady(value)) is None:
                return None
            force = state[1].normal_force - PRESSED * abs(system.load_at_start)
            return [*conditions(links, state[1].stiffness, grip), Rounded(force)]
        if system.belt_speed == 0.0 or system.coefficients.c_xx == 0.0:
            return None
        pressed = links.pressed * Rounded(system.load_at_start)
        return [*conditions(links, system.contact_stiffness, grip), pressed]

    signs_at = cache(partial(by, rest_at))

    @cache
    def in_steps(value: float) -> list[Rounded] | None:
        if (state := steady_at(value)) is None:
            return None
        system, equilibrium = state
        return [Rounded(1.0 + MARGIN - spectral_radius(system, equilibrium.stiffness, system.coefficients.phi))]

    first = steady_at(critical.lower)
    opens = first is not None and first[1].stiffness < 0.999 * first[0].contact_stiffness
    width = critical.tolerance * (PART if opens else 1e-9)  # otherwise evaluations are cheap

    def scanned(count: int) -> list[float]:
        values: list[float] = np.linspace(critical.lower, critical.upper, count).tolist()
        return values

    def by_the_mean(change: Change) -> float:
        """By which the mean over the waves leaves a change open, as far as there is steady sliding."""
        if system_of(case_at(change.value)).smooth:
            return 0.0
        apart = 1e-3 * (critical.upper - critical.lower)  # to a stable value that tells the error; a choice
        near = change.value - apart if change.lost else change.value + apart
        near = min(max(near, critical.lower), critical.upper)

        def summed(system: System) -> Mean:
            return partial(mean_contact, finer(system))

        windows = [partial(by, partial(_steady, case_at, partial(tabulated, window=k))) for k in range(WINDOWS)]
        return left_open(signs_at, windows, partial(by, partial(_steady, case_at, summed)), change, near) or 0.0

    def searched(margin: Margin, values: list[float], off: Callable[[Change], float]) -> Search:
        if all(steady_at(value) is None for value in values):
            return Search(Outcome.NO_SLIDING)
        widened = (change._replace(error=change.error + off(change)) for change in between(margin, values, width))
        return of_changes(critical, grows(margin(critical.lower)), widened)

    values = scanned(SCANNED_WHERE_OPEN if opens else SCANNED_BY_EIGENVALUES)
    exact = searched(signs_at, places(signs_at, sorted({*values, *inner})), by_the_mean)
    exact = exact._replace(eigenvalue=exact.value)
    beside = exact.value and (steady_at(exact.lower) or steady_at(exact.upper))
    if not beside or beside[0].method.own_steps:
        return exact._replace(bias=0.0) if beside else exact
    if beside[0].method.step is None:
        return exact
    ends = [critical.lower, *(end for window in exact.windows for end in window), critical.upper]
    halfway = [0.5 * (low + high) for low, high in pairwise(ends)]
    own = searched(in_steps, sorted({*scanned(SCANNED_WHERE_OPEN), *halfway}), lambda _: 0.0)
    same = own.value is not None and exact.value is not None and exact.outcome is own.outcome
    return exact._replace(bias=own.value - exact.value) if same else exact  # type: ignore[operator]
