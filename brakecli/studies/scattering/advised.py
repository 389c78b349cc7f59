"""Advice under scatter: how likely a brake still squeals that is built to a changed drawing, but not quite.

Without a study, stiffnesses and friction scatter by a tenth about the values of the drawing, and all samples are
asked at once: the mean stiffness of the contact is taken to be proportional to that of its layer, as it is where
the pad touches everywhere.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.probability import Probability, surely_fewer
from brakecli.analysis.stability.advice import Change, Left, changed, numbers
from brakecli.analysis.stability.modes import first_order, is_undamped, stiffness_matrix
from brakecli.case.case import Case
from brakecli.case.read import LoadedCase, key_path
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import Counted
from brakecli.solver.links import coefficients
from brakecli.solver.steady_sliding import sliding
from brakecli.studies.runs.advise import SMALLEST, AdviceReport
from brakecli.studies.scattering.draw import sample_values
from brakecli.studies.scattering.eigen import ask, asking
from brakecli.studies.scattering.scatter import ELSEWHERE, elsewhere, squeals
from brakecli.studies.scattering.study import LoadedStudy, Parameter, Study
from brakecli.studies.sweeps.plan import LoadedSweep, sweep_of
from brakecli.studies.sweeps.point_list import GIVEN, Listed
from brakecli.studies.sweeps.workers.task import Engine

TOLERANCE = 10.0
"""Per cent by which stiffnesses and friction scatter where no study says it; a choice."""
SAMPLES = 1024
"""Brakes that are drawn: so many know a probability to a hundredth or so."""
_SCATTERING = (
    ("link1", "stiffness"),
    ("link2", "stiffness"),
    ("contact", "stiffness"),
    ("friction", "coefficient"),
)


def under_tolerance(report: AdviceReport, case: Case) -> AdviceReport:
    """The advice with the squeal that each leaves, where stiffnesses and friction scatter by a tenth.

    It stays in its order. Where no dashpot acts, or nothing slides, no probability is known.
    """
    if report.stability.equilibrium is None or report.stability.belt_speed == 0.0:
        return report

    def squeal_of(change: Change) -> Left | None:
        there = None if change.to is None else changed(case, key_path(change.parameter), float(change.rounded))
        return None if there is None else _squeal(there)

    words = f"of ±{TOLERANCE:g} % in stiffness and friction"
    advice = [replace(change, squeal=squeal_of(change)) for change in report.advice]
    return judged(replace(report, advice=advice, squeal=_squeal(case), scatter=words))


def judged(report: AdviceReport) -> AdviceReport:
    """The advice with what of it surely lowers the share that is unstable, and what leaves least of it.

    The same samples are compared. Of changes that cannot be told apart so the first is taken. Where none of them
    lowers it, or none to a half (a choice), that is said.
    """
    helpful = [change.parameter for change in report.advice if _is_better(change.squeal, report.squeal)]
    there = [change for change in report.advice if change.parameter in helpful]
    mildest = next((change.parameter for change in _tied(there)), None)
    drawn = None if report.squeal is None else report.squeal.unstable
    vain = ""
    if drawn is not None and Probability.of(drawn).lower > 0.0 and any(change.squeal for change in report.advice):
        halved = any(_share(change.squeal) <= 0.5 * drawn.mean() for change in there)
        vain = "surely lowers" if not helpful else "" if halved else "halves"
    return replace(report, helpful=helpful, mildest=mildest, in_vain=vain)


def _is_better(squeal: Left | None, other: Left | None) -> bool:
    """Whether fewer of the same brakes are surely unstable."""
    if squeal is None or other is None or squeal.unstable is None or other.unstable is None:
        return False
    return surely_fewer(squeal.unstable, other.unstable)


def _tied(changes: list[Change]) -> list[Change]:
    """The changes in order: first all that cannot be told from what leaves least, in the order they had."""
    if not changes:
        return []
    least = min(changes, key=lambda change: _share(change.squeal))
    ties = [change for change in changes if change is least or not _is_better(least.squeal, change.squeal)]
    names = {change.parameter for change in ties}
    return ties + _tied([change for change in changes if change.parameter not in names])


def _share(squeal: Left | None) -> float:
    """The part of the brakes that is unstable."""
    return np.inf if squeal is None or squeal.unstable is None else float(squeal.unstable.mean())


def _squeal(case: Case) -> Left | None:
    """The part of such brakes that squeal; None where that is not known."""
    frequencies = _frequencies(case)
    if frequencies is None:
        return None
    hits = frequencies > 0.0
    return _of_samples(hits, frequencies[hits], hits)


def _of_samples(
    hits: NDArray[np.bool_], frequencies: Floats, unstable: NDArray[np.bool_], beside: float | None = None
) -> Left:
    """What samples say of squeal: which squeal, the frequencies (Hz) of all that vibrate, which are unstable.

    `beside`: the part that is unstable without squeal.
    """
    share = Probability.of(hits)
    return Left(
        squeal_probability=share.value,
        squeal_lower=share.lower,
        squeal_upper=share.upper,
        unstable_elsewhere=beside,
        squeal_frequency=float(np.median(frequencies)) if frequencies.size else None,
        unstable=unstable,
    )


def squealing(case: Case) -> NDArray[np.bool_] | None:
    """Which of the brakes about a drawing have a mode that grows and swings: sets, samples. None if not known."""
    frequencies = _frequencies(case)
    return None if frequencies is None else frequencies > 0.0


def _frequencies(case: Case) -> Floats | None:
    """Frequency (Hz) of the mode that grows fastest and swings, of the brakes about a drawing; 0 without one."""
    system = system_of(case)
    equilibrium = sliding(system)
    if equilibrium is None or not equilibrium.is_pressed(system.load_at_start) or is_undamped(system.coefficients):
        return None
    study = about(case)
    values = sample_values(study)
    columns = {parameter.paths[0]: values[..., number] for number, parameter in enumerate(study.parameter)}
    own = {".".join(path): numbers(case).get(path, 0.0) for path in _SCATTERING}
    drawing: dict[str, Any] = {
        key: columns.get(key, np.full(values.shape[:2], value)) for key, value in own.items()
    }
    phi = drawing["friction.coefficient"]
    layer = drawing["contact.stiffness"]
    c = coefficients(
        mass=case.shoe.mass,
        c_1=drawing["link1.stiffness"],
        b_1=case.link1.damping,
        beta_deg=case.link1.angle_deg,
        c_2=drawing["link2.stiffness"],
        b_2=case.link2.damping,
        alpha_deg=case.link2.angle_deg,
        phi=case.friction.coefficient,
    )
    k = equilibrium.stiffness * layer / case.contact.stiffness
    motion = first_order(c, stiffness_matrix(c, k, np.copysign(phi, system.belt_speed)) / case.shoe.mass)
    roots = np.linalg.eigvals(motion)
    growth = np.where((roots.real > 0.0) & (roots.imag > 0.0), roots.real, 0.0)
    first = growth.argmax(axis=-1)[..., None]
    frequencies = np.where(growth > 0.0, roots.imag, 0.0) / (2.0 * np.pi)
    return np.asarray(np.take_along_axis(frequencies, first, axis=-1)[..., 0])


def about(case: Case) -> Study:
    """Brakes about a drawing: stiffnesses and friction uniform within a tenth of its values."""
    own = numbers(case)
    keys = [".".join(path) for path in _SCATTERING if own.get(path)]
    laws = [Parameter(key=key, distribution="uniform", tolerance_percent=TOLERANCE).over(case) for key in keys]
    return Study(case=GIVEN, samples=SAMPLES, parameter=tuple(laws))


def under_scatter(
    report: AdviceReport,
    base: LoadedCase,
    loaded: LoadedStudy,
    engine_of: Callable[..., Engine],
    progress: Counted,
) -> AdviceReport:
    """The advice with the probability of squeal that each leaves, by eigenvalues.

    Squeal counts in the band of the study. The order is by what is unstable in or out of it: advice that moves
    squeal out of the band does not help. First comes what surely lowers that, the least first; what the same
    samples do not tell apart stays in its order. A key that scatters itself is shifted with its distribution.
    What leaves samples without a case has none.
    """
    study = loaded.study.model_copy(update={"method": "eigenvalue"})
    values = sample_values(study)

    def squeal_of(change: Change | None) -> Left | None:
        try:
            sweep = _changed(study.columns(values), change, base)
        except CaseError:
            return None
        with engine_of(sweep.plan, compute=asking(sweep.plan, study.band)) as engine:
            answers = ask(engine, sweep.plan.points, progress)
        columns = {name: answers[name] for name in answers.dtype.names or ()}
        hits = squeals(study, columns)
        beside = elsewhere(study, columns)
        unstable = (hits | beside).reshape(values.shape[:2])
        frequencies = columns["frequency"][(hits | beside) & (columns["frequency"] > 0.0)]
        return _of_samples(hits.reshape(values.shape[:2]), frequencies, unstable, float(beside.mean()))

    advice = [
        replace(change, squeal=squeal_of(change) if change.to is not None else None) for change in report.advice
    ]
    with_squeal = judged(replace(report, advice=advice, squeal=squeal_of(None), scatter="as of the study"))
    helpful = _tied([change for change in advice if change.parameter in with_squeal.helpful])
    return replace(
        with_squeal,
        advice=helpful + [change for change in advice if change.parameter not in with_squeal.helpful],
        ranking=f"Least instability first, then {SMALLEST}",
        band=study.band,
        elsewhere=ELSEWHERE[study.band is not None],
    )


def _changed(columns: dict[str, list[float]], change: Change | None, base: LoadedCase) -> LoadedSweep:
    """The samples with a change; raises CaseError where one of them is no case."""
    if change is not None:
        count = len(next(iter(columns.values())))
        to = float(change.rounded)
        own = columns.get(change.parameter, [change.start] * count)
        columns = columns | {change.parameter: [value + (to - change.start) for value in own]}
    return sweep_of({"case": GIVEN, "points": GIVEN}, base, Listed.of([*columns], columns.values()))
