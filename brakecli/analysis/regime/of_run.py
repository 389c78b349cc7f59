"""The regime of the run in a result file, found from its history: what `brakecli classify RESULT.h5` does."""

import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.rules import Context, Regime, Thresholds, Verdict, classify, forced_lines
from brakecli.analysis.stability.modes import growth
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.files import fields
from brakecli.files.field import values_of
from brakecli.files.read import StoredResult, open_result
from brakecli.files.write import ResultFile
from brakecli.solver.history import History
from brakecli.solver.schedules import value_at
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System

_ROUNDING = 1e-9
"""A velocity up to this part of the static compression, times the highest frequency, may come from rounding."""


@dataclass(frozen=True)
class StoredHistory:
    """The history of a result file that is read, or still written, in pieces."""

    stored: StoredResult | ResultFile
    interval: float
    samples: int

    def read(self, name: str, start: int, stop: int) -> NDArray[np.float64]:
        """The samples start … stop - 1 of a variable."""
        return self.stored.read("history", name, start, stop)


def context(system: System) -> Context:
    """What the rules have to know of a system."""
    last_speed = float(value_at(system.belt, system.sampled_duration))
    compression = float(np.abs(system.load["value"]).max()) / (system.coefficients.c_yy + system.contact_stiffness)
    return Context(
        last_speed,
        steady=len(system.belt) == 1 and len(system.load) == 1,
        forced=forced_lines(last_speed, [float(turns) for turns in system.wheel.turns], 0.5 / system.interval),
        quiet=_ROUNDING * compression * system.natural_frequencies[1],
        coefficients=system.coefficients,
        load=system.load_at_start,
        growth=partial(_growth, system, last_speed),
    )


def _growth(system: System, belt_speed: float) -> float:
    """Growth of a disturbance of steady sliding (1/s), by the mean stiffness of the contact; 0 if it decays."""
    try:
        rest = steady_sliding(system, belt=belt_speed)
    except CaseError:
        return 0.0
    c = system.coefficients
    return max(growth(c, rest.stiffness, math.copysign(c.phi, belt_speed)), 0.0)


def classify_result(path: Path, thresholds: Thresholds) -> dict[str, Any]:
    """Names and values of the verdict on a stored run; raises UnreadableResultError for anything else."""
    with open_result(path, kind="run") as stored:
        try:
            system = system_of(parse_case(str(stored.attributes["resolved_toml"]), str(path)).case)
        except (CaseError, KeyError) as error:
            raise UnreadableResultError(f"{path}: holds no case of this version; run its case again") from error
        variable = stored.variables("history").get("time")
        if variable is None or variable.shape[0] < 1:
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        history = StoredHistory(stored, system.interval, variable.shape[0])
        failure = stored.attributes.get("failure")
        verdict = verdict_on(history, system, failure, thresholds)
    return {**values_of(fields.VERDICT, RunVerdict(system, verdict)), "failure": failure}


def verdict_on(
    history: History, system: System, failure: str | None, thresholds: Thresholds | None = None
) -> Verdict:
    """The verdict on the motion of a system; a run that has failed has no regime."""
    verdict = classify(history, context(system), thresholds or Thresholds())
    if not failure:
        return verdict
    reasons = (f"the run failed: {failure}",)
    return replace(verdict, regime=Regime.UNDECIDED, frequency=None, reasons=reasons)


@dataclass(frozen=True)
class RunVerdict:
    """The verdict on the motion of a system."""

    system: System
    verdict: Verdict

    @property
    def settled_from(self) -> float:
        """Begin of the settled part, s."""
        return self.verdict.settled_from * self.system.interval

    @property
    def braking_torque(self) -> float:
        """Mean torque of the friction force on the wheel's axis, R F_x, N m."""
        return self.system.radius * self.verdict.mean_friction_force
