"""Advice under scatter: how likely a brake still squeals that is built to a changed drawing, but not quite."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from brakecli.analysis.probability import Probability
from brakecli.analysis.stability.advice import Change, Left
from brakecli.case.read import LoadedCase
from brakecli.errors import CaseError
from brakecli.runs.advise import AdviceReport
from brakecli.scattering.draw import drawn
from brakecli.scattering.eigen import ask, asking
from brakecli.scattering.scatter import squeals
from brakecli.scattering.study import LoadedStudy
from brakecli.solver.integrate import Counted
from brakecli.sweeps.listed import GIVEN, Listed
from brakecli.sweeps.plan import LoadedSweep, sweep_of
from brakecli.sweeps.workers.task import Engine


def under_scatter(
    report: AdviceReport, base: LoadedCase, loaded: LoadedStudy, engine_of: Callable[..., Engine], tell: Counted
) -> AdviceReport:
    """The advice with the probability of squeal that each leaves, by eigenvalues, the least first.

    A key that scatters itself is shifted with its distribution. What leaves samples without a case has none.
    """
    study = loaded.study.model_copy(update={"method": "eigenvalue"})
    values = drawn(study)

    def left(change: Change | None) -> Left | None:
        try:
            sweep = _changed(study.columns(values), change, base)
        except CaseError:
            return None
        with engine_of(sweep.plan, compute=asking(sweep.plan, study.band)) as engine:
            asked = ask(engine, sweep.plan.points, tell)
        hits = squeals(study, {name: asked[name] for name in asked.dtype.names or ()})
        return Left(*Probability.of(hits.reshape(values.shape[:2])))

    advice = [replace(each, squeal=left(each) if each.to is not None else None) for each in report.advice]
    advice.sort(key=lambda each: np.inf if each.squeal is None else each.squeal.squeal_probability)
    return replace(report, advice=advice, squeal=left(None))


def _changed(columns: dict[str, list[float]], change: Change | None, base: LoadedCase) -> LoadedSweep:
    """The samples with a change; raises CaseError where one of them is no case."""
    if change is not None:
        count = len(next(iter(columns.values())))
        to = float(change.rounded)
        own = columns.get(change.parameter, [change.start] * count)
        columns = columns | {change.parameter: [each + (to - change.start) for each in own]}
    return sweep_of({"case": GIVEN, "points": GIVEN}, base, Listed.of([*columns], columns.values()))
