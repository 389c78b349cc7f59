"""The verdict on a motion, and on the run in a result file: what `brakecli classify RESULT.h5` does."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import context
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.regime.over_time import over_time
from brakecli.analysis.regime.table import Fate, Thresholds
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.files import fields
from brakecli.files.field import values_of
from brakecli.files.read import open_result
from brakecli.runs.without_waves import without_waves
from brakecli.solver.history import History
from brakecli.solver.system import System
from brakecli.solver.tangent import Exponent
from brakecli.solver.track import Track

_DEFAULT = Thresholds()


def verdict_on(
    history: History,
    system: System,
    failure: str | None,
    exponent: Exponent | None = None,
    track: Track | None = None,
    thresholds: Thresholds = _DEFAULT,
    continued: Callable[[], Continued] | None = None,
    *,
    in_full: bool = True,
) -> Verdict:
    """The verdict on a motion; what it comes to on the smooth wheel is computed unless it is known."""

    def computed() -> Continued:
        last = history.samples - 1
        state = [float(history.read(name, last, last + 1)[0]) for name in ("x", "y", "vx", "vy")]
        return without_waves(system, np.array(state))

    return classify(
        history,
        context(system),
        thresholds,
        exponent=exponent,
        track=track,
        continued=continued or computed,
        failure=failure,
        in_full=in_full,
    )


def classify_result(path: Path, thresholds: Thresholds) -> dict[str, Any]:
    """Names and values of the verdict on a stored run; raises UnreadableResultError for anything else."""
    with stored_run(path) as (system, history, attributes, evidence):
        failure = attributes.get("failure")
        found = {"over_time": None if failure else over_time(history, system)}
        exponent, continued = _stored(attributes, evidence)
        verdict = verdict_on(history, system, failure, exponent, None, thresholds, continued)
        shown = {field.name: attributes.get(field.name) for field in fields.EXPONENT}
        return {**numbers_of(verdict, failure), **shown, "vibrations": fields.VIBRATIONS.read(found)}


def _stored(
    attributes: Mapping[str, Any], evidence: Mapping[str, Any]
) -> tuple[Exponent | None, Callable[[], Continued] | None]:
    """What a run has asked of its case and stored; None where it has not."""
    rate, error = (attributes.get(field.name) for field in fields.EXPONENT)
    even = (float(evidence.get(name, math.nan)) for name in ("even", "even_error"))
    exponent = None if rate is None or error is None else Exponent(rate, error, *even)
    if "without_waves" not in evidence:
        return exponent, None
    numbers = (
        float(evidence.get(f"{name}_without_waves", math.nan))
        for name in ("amplitude", "rate", "period", "sticks")
    )
    continued = Continued(Fate(evidence["without_waves"]), *numbers)
    return exponent, lambda: continued


@contextmanager
def stored_run(path: Path) -> Iterator[tuple[System, History, Mapping[str, Any], Mapping[str, Any]]]:
    """System, history, attributes and evidence of a stored run; raises UnreadableResultError for anything else."""
    with open_result(path, kind="run") as result:
        try:
            system = system_of(parse_case(result.text("resolved_toml"), str(path)).case)
        except (CaseError, KeyError) as error:
            raise UnreadableResultError(f"{path}: holds no case of this version; run its case again") from error
        time = result.variables("history").get("time")
        if time is None or time.shape[0] < 1:
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        history = History(system.interval, time.shape[0], partial(result.read, "history"))
        yield system, history, result.attributes, result.group_attributes("regime/evidence")


def numbers_of(verdict: Verdict, failure: str | None) -> dict[str, Any]:
    """Names and values of a verdict as `--json` gives them."""
    return {**values_of(fields.VERDICT, {"verdict": verdict}), "failure": failure}
