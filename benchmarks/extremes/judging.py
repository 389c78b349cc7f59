"""What comes of an extreme: a run by a scheme is right, warned of, refused, failed by name or silently wrong.

Every run is compared with one of the event-driven scheme to 1e-12, and that one with a matrix exponential wherever
the motion is linear.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from brakecli.analysis.stability.modes import eigensystem
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.errors import RefusedError
from brakecli.solver.integrate import Work, solve
from brakecli.solver.links import natural_frequencies
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.schedules import values
from brakecli.solver.system import System
from brakecli.studies.comparison.compare import errors
from brakecli.studies.runs.limits import check, refuse, within_range
from brakecli.studies.runs.plausible import implausible
from brakecli.studies.runs.tolerance import certify

Rows = NDArray[np.float64]
Tables = dict[str, dict[str, Any]]

FLAT: Tables = {
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 0.1},
    "link1": {"stiffness": 1e7, "damping": 300.0},
    "link2": {"stiffness": 1.2e7, "damping": 300.0, "angle_deg": 5.0},
    "load": {"force": 5000.0},
    "friction": {"coefficient": 0.6},
    "contact": {"half_length": 0.05, "stiffness": 2e7},
}
ROUGH: Tables = {  # its pad opens in part while it is pressed on
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 0.04},
    "link1": {"stiffness": 2e7, "damping": 200.0, "angle_deg": 20.0},
    "link2": {"stiffness": 1e7, "damping": 100.0, "angle_deg": 30.0},
    "load": {"force": 1000.0},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 5e7},
    "roughness": {"wheel": {"amplitudes": [10e-6], "wavelengths": [0.01]}},
}

TRUTH = 1e-12
EVENT_TOLERANCE = 1e-8
STEPS_PER_PERIOD = 2000
PERIODS = 2.5
SAMPLES = 200
MOST_ERROR = 0.15
"""An error of which no order and no step makes a right answer."""
COARSEST = 8.0
"""Nodes per wave with which the midpoint rule is still trusted."""


@dataclass(frozen=True)
class Scheme:
    """A scheme with its weights; `order` 0: event-driven."""

    name: str
    theta: tuple[float, ...]
    order: int

    @property
    def text(self) -> str:
        return (
            f"{self.name} ({', '.join(_fraction(weight) for weight in self.theta)})" if self.theta else self.name
        )

    def solver(self, step: float, duration: float) -> dict[str, Any]:
        """The table `solver` of a case."""
        if not self.theta:
            return {"scheme": self.name, "tolerance": EVENT_TOLERANCE, "duration": duration}
        return {"scheme": self.name, "theta": self.theta, "step": step, "duration": duration}


def _fraction(weight: float) -> str:
    return str(Fraction(weight).limit_denominator(100))


MIDDLE = Scheme("two-layer", (0.5, 0.5), 2)
BACKWARD = Scheme("two-layer", (1.0, 1.0), 1)
THREE = Scheme("three-layer", (0.25, 0.5, 0.25), 2)
NUMEROV = Scheme("three-layer", (1 / 12, 10 / 12, 1 / 12), 2)
EVENTS = Scheme("event-driven", (), 0)
SCHEMES = (MIDDLE, BACKWARD, THREE, NUMEROV, EVENTS)


class Outcome(NamedTuple):
    """What came of a run: `kind` is one of `KINDS`, `words` why."""

    kind: str
    error: float
    bound: float
    words: str


KINDS = ("right", "warned", "refused", "failed by name", "silently wrong")


def changed(tables: Tables, key: str, value: object) -> Tables:
    """The tables with `table.key` set."""
    table, name = key.split(".")
    return {**tables, table: {**tables.get(table, {}), name: value}}


def case_of(tables: Tables, solver: dict[str, Any], interval: float) -> Case:
    """The case of these tables, with a solver and an interval between samples."""
    return Case.model_validate({**tables, "solver": solver, "output": {"sample_interval": interval}})


def motion(system: System) -> tuple[Work, Rows]:
    """A run in memory."""
    found = solve(system)
    return found.work, found.rows


@dataclass(frozen=True)
class Pace:
    """How long and how finely a point is run: step, sample interval and duration (s).

    `omega` (rad/s) is that of the fastest motion on the springs, `rate` (1/s) what dashpots make of it.
    """

    step: float
    interval: float
    duration: float
    omega: float
    rate: float


def pace(tables: Tables, omega_h: float | None = None, *, dashpots: bool = True) -> Pace:
    """The common pace, or a given ωh and at least 20 steps; `dashpots`: whether the step follows their rate."""
    system = system_of(case_of(tables, {"duration": 1.0, "step": 1.0}, 1.0))
    c = system.coefficients
    k = system.contact_stiffness
    omega = 2.0 * math.pi * natural_frequencies(c, k)[1]
    rate = max(omega, float(np.abs(eigensystem(c, k, c.phi)[0]).max()))
    step = (omega_h or 2.0 * math.pi / STEPS_PER_PERIOD) / (rate if dashpots else omega)
    steps = max(PERIODS * 2.0 * math.pi / ((rate if dashpots else omega) * step), 20.0)
    per_sample = max(1, math.ceil(steps / SAMPLES))
    return Pace(step, per_sample * step, per_sample * step * math.ceil(steps / per_sample), omega, rate)


class Truth(NamedTuple):
    """The reference of a point; `apart`: its distance from the matrix exponential, NaN without one."""

    rows: Rows | None
    apart: float
    words: str


def truth(tables: Tables, at: Pace) -> Truth:
    """The event-driven scheme at its finest; held to the closed form where the shoe slides one way and touches."""
    for tolerance in (TRUTH, 1e-10):
        solver = {"scheme": "event-driven", "tolerance": tolerance, "duration": at.duration}
        try:
            with within_range():
                system = system_of(case_of(tables, solver, at.interval))
                work, rows = motion(system)
        except RefusedError as error:
            return Truth(None, math.nan, str(error))
        if work.failure is Failure.NONE:
            exact = exponential(system, rows)
            return Truth(rows, errors(rows, exact).error if exact is not None else math.nan, "")
    return Truth(None, math.nan, work.failure.sentence)


def exponential(system: System, rows: Rows) -> Rows | None:
    """The motion by the matrix exponential; None where it is not linear: it sticks, turns, opens or is rough."""
    c = system.coefficients
    k = system.contact_stiffness
    interval = system.interval
    states = rows[1:, list(HISTORY).index("state")]
    force = rows[1:, list(HISTORY).index("normal_force")]
    sliding = rows[:, 2] - system.belt_speed
    clear = np.abs(sliding).min() > 0.02 * np.abs(sliding).max()
    one_way = abs(states[0]) == 1.0 and (states == states[0]).all() and clear
    omega = 2.0 * math.pi * natural_frequencies(c, k)[1]
    if (
        not system.smooth
        or omega * interval > 0.3
        or not (one_way or c.phi == 0.0)
        or force.min() < 1e-4 * force.max()
    ):
        return None
    grip = -float(states[0]) * c.phi * k if c.phi else 0.0
    load = float(values(system.load)[0])
    a = np.zeros((5, 5))  # of (x, y, vx interval, vy interval, 1), the time in intervals
    a[0, 2] = a[1, 3] = 1.0
    a[2] = np.array([c.c_xx, c.c_xy + grip, c.b_xx / interval, c.b_xy / interval, load * c.sin_beta])
    a[3] = np.array([c.c_xy, c.c_yy + k, c.b_xy / interval, c.b_yy / interval, load * c.cos_beta])
    a[2:4] *= -(interval**2) / c.m
    onward = expm(a)
    exact = rows.copy()
    z = np.array([*rows[0, :2], *(interval * rows[0, 2:4]), 1.0])
    for row in exact[1:]:
        z = onward @ z
        row[:4] = z[0], z[1], z[2] / interval, z[3] / interval
    return exact


def jump(system: System, reference: Rows, step: float) -> float:
    """What the largest jump of friction changes the velocity by in one step, as a part of the largest velocity.

    No scheme of fixed steps knows when in a step friction turns over, or the shoe stops.
    """
    states, friction = (reference[1:, list(HISTORY).index(name)] for name in ("state", "friction_force"))
    jumps = np.abs(np.diff(friction))[np.diff(states) != 0.0]
    change = float(jumps.max(initial=0.0)) * step / system.coefficients.m
    return change / (float(np.abs(reference[:, 2]).max()) or 1.0)


def bound(
    scheme: Scheme, at: Pace, system: System, reference: Rows | None, growth: float, nodes_per_wave: float | None
) -> float:
    """The error that a right answer may have, by order and step.

    A scheme of order p is off by (ωh)^p in each radian, twice that at most, and by as much once for the rate of
    overcritical dashpots; where friction jumps, by what it changes in a step; the midpoint rule by the square of
    the part of a wave that a node stands for. A motion that grows multiplies what is off.
    """
    if not scheme.order:
        return EVENT_TOLERANCE
    grown = math.exp(min(growth * at.duration, 50.0))
    smooth = 2.0 * (
        (at.omega * at.step) ** scheme.order * at.omega * at.duration + (at.rate * at.step) ** scheme.order
    )
    coarse = max(nodes_per_wave, COARSEST) ** -2 if nodes_per_wave else 0.0
    turn = jump(system, reference, at.step) if reference is not None else 0.0
    return min((smooth + 2.0 * coarse + turn) * grown, MOST_ERROR)


def judge(tables: Tables, scheme: Scheme, at: Pace, reference: Truth, most: float | None = None) -> Outcome:
    """Run a point with a scheme and tell what came of it; `most`: the error of a right answer, else `bound`."""
    try:
        with within_range():
            system = system_of(case_of(tables, scheme.solver(at.step, at.duration), at.interval))
            found = check(system)
            refuse(found)
            strange = {*implausible(system)}  # which excuses no wrong answer
            of_method = [text for text in found.warnings if text not in strange]
            warnings = [text for text in of_method if text.startswith(("solver", "contact", "friction"))]
            if scheme.order:
                work, rows = motion(system)
            else:
                answer = certify(system)
                work = answer.motion.work
                rows = answer.motion.rows
                if not answer.certificate.certified:
                    warnings.append(f"solver.tolerance: {answer.certificate.sentence()}")
            values, _ = eigensystem(system.coefficients, system.contact_stiffness, system.coefficients.phi)
    except RefusedError as error:
        return Outcome("refused", math.nan, math.nan, str(error))
    if work.failure is not Failure.NONE:
        return Outcome("failed by name", math.nan, math.nan, work.failure.name)
    growth = max(float(values.real.max()), 0.0)
    limit = most or bound(scheme, at, system, reference.rows, growth, found.nodes_per_wave)
    if work.non_unique_steps:
        warnings.append(f"{work.non_unique_steps} steps met a point where their solution need not be unique")
    if reference.rows is None:
        kind = "warned" if warnings else "silently wrong"
        return Outcome(kind, math.nan, limit, "; ".join(warnings) or "no reference: " + reference.words)
    error = errors(rows, reference.rows).error
    kind = "right" if error <= limit else "warned" if warnings else "silently wrong"
    return Outcome(kind, error, limit, "; ".join(warnings))
