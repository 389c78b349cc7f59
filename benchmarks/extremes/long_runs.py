"""What shows in long runs alone: limits of stability, the drift of energy, hours of motion."""

import math
from fractions import Fraction

import numpy as np

from benchmarks.extremes.judging import (
    BACKWARD,
    FLAT,
    MIDDLE,
    NUMEROV,
    THREE,
    Scheme,
    Tables,
    case_of,
    changed,
    motion,
    pace,
)
from brakecli.analysis.stability.report import step_limit
from brakecli.case.system import system_of
from brakecli.solver.quantities import Failure
from brakecli.solver.system import System

LIMITED = (
    MIDDLE,
    BACKWARD,
    THREE,
    NUMEROV,
    Scheme("two-layer", (1.0, 0.0), 1),
    Scheme("three-layer", (0.0, 1.0, 0.0), 2),
    Scheme("three-layer", (0.2, 0.6, 0.2), 2),
)
"""Schemes whose limit of stability is looked for: those of the campaign, and some that have one."""
STILL = changed(FLAT, "friction.coefficient", 0.0)
LIMIT_CASES: dict[str, Tables] = {
    "base": STILL,
    "contact 10¹⁶ N/m²": changed(STILL, "contact.stiffness", 1e16),
    "contact 1 N/m²": changed(STILL, "contact.stiffness", 1.0),
    "mass 10⁻⁶ kg": changed(STILL, "shoe.mass", 1e-6),
    "mass 10⁶ kg": changed(STILL, "shoe.mass", 1e6),
    "no dashpots": changed(changed(STILL, "link1.damping", 0.0), "link2.damping", 0.0),
    "critical dashpots": changed(changed(STILL, "link1.damping", 2e4), "link2.damping", 2e4),
}
LIMIT_STEPS = 20_000
MOST_LIMIT = 1e3


def _still(tables: Tables, scheme: Scheme, step: float, steps: int, **initial: float) -> System:
    """A frictionless shoe near its equilibrium."""
    tables = {**tables, "initial": {"at": "equilibrium", **initial}}
    return system_of(case_of(tables, scheme.solver(step, steps * step), step))


def _compression(system: System) -> float:
    return system.load_at_start / (system.coefficients.c_yy + system.contact_stiffness)


def grows(tables: Tables, scheme: Scheme, step: float) -> bool:
    """Whether a small disturbance grows in a run."""
    at = pace(tables)
    small = 1e-3 * _compression(_still(tables, scheme, step, 1)) / (1.0 + (at.rate * step) ** 2)
    rest = motion(_still(tables, scheme, step, 1))[1][0, :2]
    system = _still(tables, scheme, step, LIMIT_STEPS, x=small, y=small)
    work, rows = motion(system)
    away = np.abs(rows[:, :2] - rest).max(axis=1)
    half = len(away) // 2
    lost = work.failure not in (Failure.NONE, Failure.UNBALANCED)
    return lost or away.max() > _compression(system) or bool(away[half:].max() > 4.0 * away[:half].max())


def limits(tables: Tables, scheme: Scheme) -> tuple[float | None, float | None]:
    """Limit of stability of the step, times ω: predicted and observed; None where above `MOST_LIMIT`."""
    at = pace(tables)
    system = _still(tables, scheme, at.step, 1)
    # Asked of full contact: a contact of 1 N/m² bears too little of the load for steady sliding.
    found = step_limit(system, lambda phi: system.contact_stiffness)
    assert found != 0.0
    predicted = found * at.omega if found else math.inf
    ladder = 10.0 ** np.arange(-2.0, 3.1, 0.5)
    unstable = [grows(tables, scheme, float(omega_h) / at.omega) for omega_h in ladder]
    if not any(unstable):
        return predicted if predicted < MOST_LIMIT else None, None
    first = unstable.index(True)
    if first == 0:
        return predicted, 0.0
    low = float(ladder[first - 1])
    high = float(ladder[first])
    while high > 1.0005 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if grows(tables, scheme, middle / at.omega) else (middle, high)
    return predicted, low


DRIFT_STEPS = 100_000


def drift(scheme: Scheme, steps_per_period: int, steps: int = DRIFT_STEPS) -> float:
    """Relative change of the energy of free vibration, without dashpots and friction, in full contact.

    The mean of the last twentieth against that of the first, of the energy above that of the equilibrium.
    """
    tables = LIMIT_CASES["no dashpots"]
    step = 2.0 * math.pi / (steps_per_period * pace(tables).omega)
    rest = motion(_still(tables, scheme, step, 1))[1][0, :2]
    size = 0.5 * _compression(_still(tables, scheme, step, 1))
    system = _still(tables, scheme, step, steps, x=0.5 * size, y=size)
    work, rows = motion(system)
    assert work.failure is Failure.NONE
    c = system.coefficients
    k = system.contact_stiffness
    x, y = (rows[:, :2] - rest).T
    kinetic = 0.5 * c.m * (rows[:, 2] ** 2 + rows[:, 3] ** 2)
    energy = kinetic + 0.5 * (c.c_xx * x * x + 2.0 * c.c_xy * x * y + (c.c_yy + k) * y * y)
    part = len(energy) // 20
    return float(energy[-part:].mean() / energy[:part].mean()) - 1.0


HOURS = 10_000.0
SETTLING = 300.0
SLOW: Tables = {
    "shoe": {"mass": 1e5},
    "wheel": {"radius": 0.5, "angular_speed": 0.1},
    "link1": {"stiffness": 1e7, "damping": 4e4},
    "link2": {"stiffness": 1.2e7, "damping": 4e4, "angle_deg": 5.0},
    "load": {"force": 5000.0},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 2e7},
    "roughness": {
        "wheel": {"amplitudes": [3e-5, 2e-5], "wavelengths": [0.0317, 0.0211], "phases_deg": [20.0, 0.0]}
    },
}


def hours(scheme: Scheme, duration: float = HOURS) -> float:
    """How far the end of a long run is from that of a short one, whose wheel starts where the long one's had come.

    Both end settled, 10 s are compared; the short one's phases are advanced by the exact travel, in fractions.
    """
    wheel = SLOW["roughness"]["wheel"]
    speed = Fraction(SLOW["wheel"]["radius"]) * Fraction(SLOW["wheel"]["angular_speed"])
    travel = speed * Fraction(duration - SETTLING)
    phases = [
        float(Fraction(phase) - 360 * (travel / Fraction(length) % 1))
        for phase, length in zip(wheel["phases_deg"], wheel["wavelengths"], strict=True)
    ]
    late = changed(SLOW, "roughness.wheel", {**wheel, "phases_deg": phases})
    ends = []
    for tables, length in ((SLOW, duration), (late, SETTLING)):
        work, rows = motion(system_of(case_of(tables, scheme.solver(0.01, length), 0.1)))
        assert work.failure is Failure.NONE
        ends.append(rows[-100:])
    apart = np.abs(ends[0] - ends[1])[:, :4].max(axis=0)
    return float((apart / np.ptp(ends[1], axis=0)[:4]).max())
