"""The regime of a stored run, told anew from its history: what `brakecli classify RESULT.h5` does."""

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.rules import Context, Regime, Thresholds, Verdict, classify, forced_lines
from brakecli.analysis.stability.discrete import natural_frequencies
from brakecli.analysis.stability.modes import growth
from brakecli.case.read import parse_case
from brakecli.case.system import Setup, set_up
from brakecli.errors import CaseError, UnreadableResultError
from brakecli.files import fields
from brakecli.files.read import StoredResult, open_result
from brakecli.solver.schedules import value_at
from brakecli.solver.steady_sliding import equilibrium, mean_contact

_ROUNDING = 1e-9
"""A velocity of this part of the static compression, per period of the fastest motion, is no motion."""


@dataclass(frozen=True)
class StoredHistory:
    """The history of a result file, read in pieces."""

    stored: StoredResult
    interval: float
    samples: int

    def read(self, name: str, start: int, stop: int) -> NDArray[np.float64]:
        """The samples start … stop - 1 of a variable."""
        return self.stored.read("history", name, start, stop)


def context(setup: Setup) -> Context:
    """What the classifier is told of a case."""
    steady = len(setup.belt.times) == 1 and len(setup.load.times) == 1
    highest = 0.5 / setup.timing.interval
    last_speed = float(value_at(setup.belt, setup.timing.samples * setup.timing.interval))
    lines = forced_lines(last_speed, [float(turns) for turns in setup.wheel.turns], highest)
    compression = float(np.abs(setup.load.values).max()) / (setup.coefficients.c_yy + setup.contact_stiffness)
    fastest = natural_frequencies(setup.coefficients, setup.contact_stiffness)[1]
    return Context(
        last_speed,
        steady,
        lines,
        quiet=_ROUNDING * compression * fastest,
        coefficients=setup.coefficients,
        load=float(value_at(setup.load, 0.0)),
        growth=partial(_growth, setup, last_speed),
    )


def _growth(setup: Setup, belt_speed: float) -> float:
    """How fast a disturbance of steady sliding grows (1/s), by the mean stiffness of the contact; 0 if not."""
    c, mean = setup.coefficients, partial(mean_contact, setup.evaluate, setup.pad, setup.wheel)
    try:
        rest = equilibrium(c, mean, setup.pad, float(value_at(setup.load, 0.0)), belt_speed)
    except CaseError:
        return 0.0
    return max(growth(c, rest.stiffness, math.copysign(c.phi, belt_speed)), 0.0)


def classify_result(path: Path, thresholds: Thresholds) -> dict[str, Any]:
    """Names and values of the verdict on a stored run; raises UnreadableResultError for anything else."""
    with open_result(path, kind="run") as stored:
        try:
            setup = set_up(parse_case(str(stored.attributes["resolved_toml"]), str(path)).case)
        except (CaseError, KeyError) as error:
            raise UnreadableResultError(f"{path}: holds no case of this version; run its case again") from error
        variable = stored.variables("history").get("time")
        if variable is None or variable.shape[0] < 1:
            raise UnreadableResultError(f"{path}: has no history; run its case again")
        verdict = classify(
            StoredHistory(stored, setup.timing.interval, variable.shape[0]), context(setup), thresholds
        )
        failure = stored.attributes.get("failure")
    if failure:
        verdict = failed(verdict, str(failure))
    return {**fields.values(fields.VERDICT, RunVerdict(setup, verdict)), "failure": failure}


def failed(verdict: Verdict, failure: str) -> Verdict:
    """The verdict on a run that is not worth having: none, with what was measured."""
    changes: dict[str, Any] = {
        "regime": Regime.UNDECIDED,
        "frequency": None,
        "reasons": (f"the run failed: {failure}",),
    }
    return Verdict(**{**verdict.__dict__, **changes})


@dataclass(frozen=True)
class RunVerdict:
    """The verdict on a run of a case."""

    setup: Setup
    verdict: Verdict

    @property
    def settled_from(self) -> float:
        """Begin of the settled part, s."""
        return self.verdict.settled_from * self.setup.timing.interval

    @property
    def braking_torque(self) -> float:
        """Mean torque of the friction force on the wheel's axis, R F_x, N m."""
        return self.setup.case.wheel.radius * self.verdict.mean_friction_force
