"""The extremes: far larger and smaller values of everything that a case gives than any brake has, and what comes of it.

    python -m benchmarks.extremes

writes docs/extremes.md. One thing at a time is varied from a base case; every run is compared with one of the
event-driven scheme to 1e-12, and that one with a matrix exponential wherever the motion is linear.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from brakecli.analysis.precision import natural_frequencies
from brakecli.analysis.stability import eigensystem
from brakecli.case import Case
from brakecli.check import check, refuse, within_range
from brakecli.compare.errors import errors
from brakecli.errors import RefusedError
from brakecli.model import HISTORY, ContactState, Failure
from brakecli.setup import Setup, set_up
from brakecli.simulate import Motion, Work
from brakecli.stability import stability

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

TRUTH, EVENT_TOLERANCE = 1e-12, 1e-8
STEPS_PER_PERIOD = 2000
PERIODS = 2.5
SAMPLES = 200
MOST_ERROR = 0.3
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
        return f"{self.name} ({', '.join(_fraction(weight) for weight in self.theta)})" if self.theta else self.name

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


def _case(tables: Tables, solver: dict[str, Any], interval: float) -> Case:
    return Case.model_validate({**tables, "solver": solver, "output": {"sample_interval": interval}})


def motion(setup: Setup) -> tuple[Work, Rows]:
    """A run in memory."""
    blocks: list[Rows] = []
    work, _ = Motion(setup).run(lambda rows: blocks.append(rows.copy()))
    return work, np.concatenate(blocks)


@dataclass(frozen=True)
class Pace:
    """How long and how finely a point is run: step, sample interval and duration (s), and ω of its fastest motion."""

    step: float
    interval: float
    duration: float
    omega: float


def fastest(tables: Tables, *, dashpots: bool) -> float:
    """The rate (1/s) of the fastest motion: ω of the springs, or what overcritical dashpots make of it."""
    setup = set_up(_case(tables, {"duration": 1.0, "step": 1.0}, 1.0))
    c, k = setup.coefficients, setup.contact_stiffness
    omega = 2.0 * math.pi * natural_frequencies(c, k)[1]
    return max(omega, float(np.abs(eigensystem(c, k, c.phi)[0]).max())) if dashpots else omega


def pace(tables: Tables, omega_h: float | None = None, *, dashpots: bool = True) -> Pace:
    """The common pace; with a given ωh at least 20 steps."""
    omega = fastest(tables, dashpots=dashpots)
    step = (omega_h or 2.0 * math.pi / STEPS_PER_PERIOD) / omega
    steps = max(PERIODS * 2.0 * math.pi / (omega * step), 20.0)
    per_sample = max(1, math.ceil(steps / SAMPLES))
    return Pace(step, per_sample * step, per_sample * step * math.ceil(steps / per_sample), omega)


class Truth(NamedTuple):
    """The reference of a point; `apart`: how far it is from the matrix exponential, NaN where that does not hold."""

    rows: Rows | None
    apart: float
    words: str


def truth(tables: Tables, at: Pace) -> Truth:
    """The event-driven scheme at its finest; held to the closed form where the shoe slides one way and touches."""
    for tolerance in (TRUTH, 1e-10):
        solver = {"scheme": "event-driven", "tolerance": tolerance, "duration": at.duration}
        try:
            with within_range():
                setup = set_up(_case(tables, solver, at.interval))
                work, rows = motion(setup)
        except RefusedError as error:
            return Truth(None, math.nan, str(error))
        if work.failure is Failure.NONE:
            exact = exponential(setup, rows)
            return Truth(rows, errors(rows, exact, at.interval).error if exact is not None else math.nan, "")
    return Truth(None, math.nan, work.failure.sentence)


def exponential(setup: Setup, rows: Rows) -> Rows | None:
    """The motion by the matrix exponential; None where it is not linear: it sticks, turns, opens or is rough."""
    c, k, interval = setup.coefficients, setup.contact_stiffness, setup.timing.interval
    states, force = rows[1:, list(HISTORY).index("state")], rows[1:, list(HISTORY).index("normal_force")]
    sliding = rows[:, 2] - setup.belt_speed
    clear = np.abs(sliding).min() > 0.02 * np.abs(sliding).max()
    one_way = abs(states[0]) == 1.0 and (states == states[0]).all() and clear
    omega = 2.0 * math.pi * natural_frequencies(c, k)[1]
    if not setup.smooth or omega * interval > 0.3 or not (one_way or c.phi == 0.0) or force.min() < 1e-4 * force.max():
        return None
    grip = -float(states[0]) * c.phi * k if c.phi else 0.0
    load = float(setup.load.values[0])
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


def jump(setup: Setup, reference: Rows, step: float) -> float:
    """What friction changes the velocity by in one step where it turns over, as a part of the largest velocity.

    0 where the shoe slides one way all the time. No scheme of fixed steps knows when in a step friction turns.
    """
    states, force = reference[1:, list(HISTORY).index("state")], reference[:, list(HISTORY).index("normal_force")]
    if (states == states[0]).all():
        return 0.0
    change = 2.0 * setup.coefficients.phi * float(force.max()) * step / setup.coefficients.m
    return change / (float(np.abs(reference[:, 2]).max()) or 1.0)


def bound(
    scheme: Scheme, at: Pace, setup: Setup, reference: Rows | None, growth: float, nodes_per_wave: float | None
) -> float:
    """The error that a right answer may have, by order and step.

    A scheme of order p is off by (ωh)^p in each radian, twice that at most; where friction turns over, by its
    change in a step; the midpoint rule by the square of the part of a wave that a node stands for. A motion that
    grows multiplies what is off.
    """
    grown = math.exp(min(growth * at.duration, 50.0))
    if not scheme.order:
        return min(10.0 * EVENT_TOLERANCE * grown, MOST_ERROR)
    omega_h = at.omega * at.step
    radians = 1.0 + at.omega * at.duration
    coarse = max(nodes_per_wave, COARSEST) ** -2 if nodes_per_wave else 0.0
    turn = jump(setup, reference, at.step) if reference is not None else 0.0
    return min((2.0 * omega_h**scheme.order * radians + 2.0 * coarse + turn) * grown, MOST_ERROR)


def judge(tables: Tables, scheme: Scheme, at: Pace, reference: Truth) -> Outcome:
    """Run a point with a scheme and tell what came of it."""
    try:
        with within_range():
            setup = set_up(_case(tables, scheme.solver(at.step, at.duration), at.interval))
            found = check(setup)
            refuse(setup, found, math.inf)
            work, rows = motion(setup)
            values, _ = eigensystem(setup.coefficients, setup.contact_stiffness, setup.coefficients.phi)
    except RefusedError as error:
        return Outcome("refused", math.nan, math.nan, str(error))
    if work.failure is not Failure.NONE:
        return Outcome("failed by name", math.nan, math.nan, work.failure.name)
    growth = max(float(values.real.max()), 0.0)
    limit = bound(scheme, at, setup, reference.rows, growth, found.nodes_per_wave)
    warnings = [text for text in found.warnings if text.startswith(("solver", "contact", "friction"))]
    if work.non_unique_steps:
        warnings.append(f"{work.non_unique_steps} steps met a point where their solution need not be unique")
    if reference.rows is None:
        kind = "warned" if warnings else "silently wrong"
        return Outcome(kind, math.nan, limit, "; ".join(warnings) or "no reference: " + reference.words)
    error = errors(rows, reference.rows, at.interval).error
    kind = "right" if error <= limit else "warned" if warnings else "silently wrong"
    return Outcome(kind, error, limit, "; ".join(warnings))


@dataclass(frozen=True)
class Family:
    """One thing that is varied: its name, unit and values, and the tables of a case with such a value."""

    name: str
    unit: str
    values: tuple[float, ...]
    tables: Callable[[float], Tables]
    omega_h: Callable[[float], float | None] = lambda value: None
    dashpots: bool = True  # whether the step follows overcritical dashpots

    def pace(self, value: float) -> Pace:
        return pace(self.tables(value), self.omega_h(value), dashpots=self.dashpots)


def decades(low: int, high: int, each: int = 1) -> tuple[float, ...]:
    """Powers of ten from 10^low to 10^high, `each` to a decade."""
    return tuple(float(f"{10.0 ** (low + i / each):.3g}") for i in range((high - low) * each + 1))


def _of(key: str, base: Tables = FLAT) -> Callable[[float], Tables]:
    return lambda value: changed(base, key, value)


def _speed(base: Tables, speed: float) -> Tables:
    return changed(base, "wheel.angular_speed", speed / base["wheel"]["radius"])


def _dashpots(part: float) -> Tables:
    """Both dashpots at a part of the critical damping of their own spring and the mass."""
    tables = FLAT
    for link in ("link1", "link2"):
        critical = 2.0 * math.sqrt(FLAT[link]["stiffness"] * FLAT["shoe"]["mass"])
        tables = changed(tables, f"{link}.damping", part * critical)
    return tables


def _waves(wavelength: float, nodes: int | None) -> Tables:
    wheel = {"amplitudes": [10e-6], "wavelengths": [wavelength]}
    tables = changed(ROUGH, "roughness.wheel", wheel)
    return changed(tables, "contact.nodes", nodes) if nodes else tables


ENDS = (-90.0, -89.999, -45.0, -1e-6, 0.0, 1e-6, 45.0, 89.999, 90.0)
NODES = 64
FAMILIES = (
    Family("contact stiffness", "N/m²", decades(0, 16), _of("contact.stiffness")),
    Family("mass", "kg", decades(-6, 6), _of("shoe.mass")),
    Family(
        "friction", "1", (0.0, 1e-9, 1e-3, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0), _of("friction.coefficient")
    ),
    Family(
        "speed",
        "m/s",
        (0.0, *decades(-9, 3)),
        lambda speed: _speed(FLAT, speed),
    ),
    Family("speed, rough wheel", "m/s", (0.0, *decades(-9, 2)), lambda speed: _speed(ROUGH, speed)),
    Family("dashpots, step by their rate", "of critical", (0.0, *decades(-6, 4)), _dashpots),
    Family("dashpots, step by the springs", "of critical", (1.0, *decades(1, 3, 2)), _dashpots, dashpots=False),
    Family("angle of link 1", "deg", ENDS, _of("link1.angle_deg")),
    Family("angle of link 2", "deg", ENDS, _of("link2.angle_deg")),
    Family("wavelength, nodes chosen", "m", decades(-3, 0, 2), lambda length: _waves(length, None)),
    Family(f"wavelength, {NODES} nodes", "m", decades(-3, 0, 2), lambda length: _waves(length, NODES)),
    Family("step times ω", "1", decades(-3, 3, 2), lambda omega_h: FLAT, lambda omega_h: omega_h),
)


def campaign(families: Sequence[Family] = FAMILIES) -> Iterator[tuple[Family, float, Truth, dict[Scheme, Outcome]]]:
    """Every point of every family by every scheme."""
    for family in families:
        for value in family.values:
            tables, at = family.tables(value), family.pace(value)
            reference = truth(tables, at)
            yield family, value, reference, {scheme: judge(tables, scheme, at, reference) for scheme in SCHEMES}
