"""How far the friction at each point of a sweep is from the critical one: in a map its zero is a line."""

from math import prod

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.report import LARGEST_FRICTION, critical_friction
from brakecli.case.system import system_of
from brakecli.errors import CaseError, RefusedError
from brakecli.studies.runs.limits import within_range
from brakecli.studies.sweeps.plan import Plan

_FRICTION = ("friction", "coefficient")


def margins(plan: Plan) -> NDArray[np.float64] | None:
    """Critical friction less friction at every point of the grid, by eigenvalues; None where it would take long.

    That is with more than 100 000 points, whose settings would all be listed, or where critical friction would be
    looked for in more than 2500 cases, 64 of rough surfaces: choices. What is never stable is critical at 0, what
    no friction makes unstable at the largest friction searched. With a wheel at rest, or numbers out of range, it
    is NaN.
    """
    settings = [plan.settings(point) for point in range(prod(plan.shape))] if plan.points <= 100_000 else []
    others = {
        tuple(value for path, value in setting.items() if path != _FRICTION): setting for setting in settings
    }
    try:
        rough = not all(system_of(plan.case(setting)).smooth for setting in settings[:: max(1, len(settings) - 1)])
        if not others or len(others) > (64 if rough else 2500):
            return None
        critical_of = {key: _critical(plan, setting) for key, setting in others.items()}
        own = plan.case({}).friction.coefficient
    except CaseError:
        return None
    keys = [tuple(value for path, value in setting.items() if path != _FRICTION) for setting in settings]
    critical = [critical_of[key] for key in keys]
    friction = [setting.get(_FRICTION, own) for setting in settings]
    return np.reshape(np.array(critical) - np.array(friction, float), plan.shape)


def _critical(plan: Plan, settings: dict[tuple[str, ...], object]) -> float:
    system = system_of(plan.case(settings))
    if system.belt_speed == 0.0:
        return np.nan
    try:
        with within_range():
            critical = critical_friction(system, system.contact_stiffness)
    except RefusedError:
        return np.nan
    return LARGEST_FRICTION if critical is None else critical
