"""The extremes: everything that a case gives, far larger and smaller than any brake has it, and what comes of it.

    python -m benchmarks.extremes

writes docs/extremes.md. One thing at a time is varied from a base case; every run is compared with one of the
event-driven scheme to 1e-12, and that one with a matrix exponential wherever the motion is linear.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from brakecli.analysis.stability.modes import eigensystem
from brakecli.analysis.stability.report import stability
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.comparison.deviation import errors
from brakecli.errors import RefusedError
from brakecli.runs.limits import check, refuse, within_range
from brakecli.runs.tolerance import certify
from brakecli.solver.links import natural_frequencies
from brakecli.solver.motion import Work, solve
from brakecli.solver.quantities import HISTORY, Failure
from brakecli.solver.system import System

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


def _case(tables: Tables, solver: dict[str, Any], interval: float) -> Case:
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
    system = system_of(_case(tables, {"duration": 1.0, "step": 1.0}, 1.0))
    c, k = system.coefficients, system.contact_stiffness
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
                system = system_of(_case(tables, solver, at.interval))
                work, rows = motion(system)
        except RefusedError as error:
            return Truth(None, math.nan, str(error))
        if work.failure is Failure.NONE:
            exact = exponential(system, rows)
            return Truth(rows, errors(rows, exact, at.interval).error if exact is not None else math.nan, "")
    return Truth(None, math.nan, work.failure.sentence)


def exponential(system: System, rows: Rows) -> Rows | None:
    """The motion by the matrix exponential; None where it is not linear: it sticks, turns, opens or is rough."""
    c, k, interval = system.coefficients, system.contact_stiffness, system.interval
    states, force = rows[1:, list(HISTORY).index("state")], rows[1:, list(HISTORY).index("normal_force")]
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
    load = float(system.load.values[0])
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
            system = system_of(_case(tables, scheme.solver(at.step, at.duration), at.interval))
            found = check(system)
            refuse(system, found, math.inf)
            warnings = [text for text in found.warnings if text.startswith(("solver", "contact", "friction"))]
            if scheme.order:
                work, rows = motion(system)
            else:
                answer = certify(system)
                work, rows = answer.motion.work, answer.motion.rows
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
        "friction",
        "1",
        (0.0, 1e-9, 1e-3, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0),
        _of("friction.coefficient"),
    ),
    Family(
        "speed",
        "m/s",
        (0.0, *decades(-9, 3)),
        lambda speed: _speed(FLAT, speed),
    ),
    Family("speed, rough wheel", "m/s", (0.0, *decades(-9, 2)), lambda speed: _speed(ROUGH, speed)),
    Family("dashpots, step by their rate", "of critical", (0.0, *decades(-6, 4)), _dashpots),
    Family("dashpots, step by the springs", "of critical", decades(0, 4), _dashpots, dashpots=False),
    Family("angle of link 1", "deg", ENDS, _of("link1.angle_deg")),
    Family("angle of link 2", "deg", ENDS, _of("link2.angle_deg")),
    Family("wavelength, nodes chosen", "m", decades(-4, 0, 2), lambda length: _waves(length, None)),
    Family(f"wavelength, {NODES} nodes", "m", decades(-4, 0, 2), lambda length: _waves(length, NODES)),
    Family(
        "step times ω",
        "1",
        (*decades(-3, -1, 2), 0.3, *decades(0, 3, 2)),
        lambda omega_h: FLAT,
        lambda omega_h: omega_h,
    ),
)


def campaign(
    families: Sequence[Family] = FAMILIES,
) -> Iterator[tuple[Family, float, Truth, dict[Scheme, Outcome]]]:
    """Every point of every family by every scheme."""
    for family in families:
        for value in family.values:
            tables, at = family.tables(value), family.pace(value)
            reference = truth(tables, at)
            yield family, value, reference, {scheme: judge(tables, scheme, at, reference) for scheme in SCHEMES}


DRAWN = {
    "contact.stiffness": (0, 16),
    "shoe.mass": (-6, 6),
    "wheel.angular_speed": (-9, 3),
    "friction.coefficient": (-3, 1),
    "load.force": (-6, 9),
    "link1.damping": (-3, 7),
    "link2.damping": (-3, 7),
    "link1.stiffness": (-3, 14),
    "link2.stiffness": (-3, 14),
}
"""What is drawn for the points of three extremes, as powers of ten."""
ANGLES = ("link1.angle_deg", "link2.angle_deg")
POINTS = 200


def drawn(count: int) -> Iterator[Tables]:
    """Points with three quantities anywhere in their ranges, and each angle in every third."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        tables = FLAT
        for key in rng.permutation(list(DRAWN))[:3]:
            tables = changed(tables, str(key), float(10.0 ** rng.uniform(*DRAWN[str(key)])))
        for key in ANGLES:
            if rng.uniform() < 1.0 / 3.0:
                tables = changed(tables, key, float(rng.uniform(-90.0, 90.0)))
        yield tables


def together(count: int) -> Iterator[dict[Scheme, Outcome]]:
    """What comes of drawn points; right is what is off by at most `MOST_ERROR`, or by the tolerance."""
    for tables in drawn(count):
        at = pace(tables)
        reference = truth(tables, at)
        most = {scheme: MOST_ERROR if scheme.order else EVENT_TOLERANCE for scheme in SCHEMES}
        yield {scheme: judge(tables, scheme, at, reference, most[scheme]) for scheme in SCHEMES}


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
LIMIT_STEPS, MOST_LIMIT = 20_000, 1e3


def _still(tables: Tables, scheme: Scheme, step: float, steps: int, **initial: float) -> System:
    """A frictionless shoe near its equilibrium."""
    tables = {**tables, "initial": {"at": "equilibrium", **initial}}
    return system_of(_case(tables, scheme.solver(step, steps * step), step))


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
    found = stability(_still(tables, scheme, at.step, 1)).discrete
    assert found is not None
    assert found.step_limit != 0.0
    predicted = found.step_limit * at.omega if found.step_limit else math.inf
    ladder = 10.0 ** np.arange(-2.0, 3.1, 0.5)
    unstable = [grows(tables, scheme, float(omega_h) / at.omega) for omega_h in ladder]
    if not any(unstable):
        return predicted if predicted < MOST_LIMIT else None, None
    first = unstable.index(True)
    if first == 0:
        return predicted, 0.0
    low, high = float(ladder[first - 1]), float(ladder[first])
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
    c, k = system.coefficients, system.contact_stiffness
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
        work, rows = motion(system_of(_case(tables, scheme.solver(0.01, length), 0.1)))
        assert work.failure is Failure.NONE
        ends.append(rows[-100:])
    apart = np.abs(ends[0] - ends[1])[:, :4].max(axis=0)
    return float((apart / np.ptp(ends[1], axis=0)[:4]).max())


PAGE = Path(__file__).parents[1] / "docs" / "extremes.md"
INTRODUCTION = """# The extremes

`make extremes` writes this page; all its numbers come from [benchmarks/extremes.py](../benchmarks/extremes.py).
One thing at a time is taken far beyond what any brake has, in both directions, from a shoe that sticks, slips
and vibrates on a smooth wheel, or on a rough one whose pad opens in part. Each scheme computes each point from
rest, over {periods:g} periods of the fastest motion with {steps} steps a period (but where the step is what is
varied), the event-driven scheme to a certified tolerance of {event:g}, as `brakecli run` does. What comes of a
run is one of these:

- **right**: x, y, ẋ and ẏ are off by less than a bound, relative to the largest value of each. The truth is
  the event-driven scheme at {truth:g}. With ω of the fastest motion, r the rate of overcritical dashpots, p the
  order of the scheme, T the duration, σ the growth rate of the motion and n the nodes per wave, the bound is
  [2(ωh)^p ωT + 2(rh)^p + 2/n² + j] e^(σT), where n counts as at least {coarsest:g}; j is what the largest jump of
  friction changes ẋ by in one step, as steps of fixed length do not know when in a step friction jumps. The
  bound of the event-driven scheme is its tolerance itself. Beyond {most:g} nothing is right.
- **warned**: it is off by more, and a warning of `brakecli check` or of the run names the key and the number
  that make it so.
- **refused**: `brakecli run` refuses it in a sentence.
- **failed by name**: the run ends with a failure that has a name and a remedy.
- **silently wrong**: off by more than the bound, and nothing says so. There must be none.

The bound is that of a few periods. The phase of an undamped vibration goes on drifting at the same rate: with
(ωh)²/12 in each radian at weights of one half, a run of thousands of periods needs more steps in each, or
`solver.tolerance` in place of `solver.step`.
"""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of the page."""
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *rows])


def _size(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.1e}"


Point = tuple[Family, float, Truth, dict[Scheme, Outcome]]


def outcomes_text(points: Sequence[Point]) -> str:
    """What came of the campaign, in tables."""
    counts = [
        [scheme.text, *(str(sum(point[3][scheme].kind == kind for point in points)) for kind in KINDS)]
        for scheme in SCHEMES
    ]
    ranges, others = [], []
    for family in dict.fromkeys(point[0] for point in points):
        mine = [point for point in points if point[0] is family]
        cells = []
        for scheme in SCHEMES:
            right = [point[3][scheme].error for point in mine if point[3][scheme].kind == "right"]
            cells.append(f"{len(right)} of {len(mine)}, {max(right):.1e}" if right else f"0 of {len(mine)}")
        low, high = min(family.values), max(family.values)
        ranges.append([family.name, f"{low:g} to {high:g}", family.unit, *cells])
        for scheme in SCHEMES:
            for kind in KINDS[1:]:
                rest = [(point[1], point[3][scheme]) for point in mine if point[3][scheme].kind == kind]
                if not rest:
                    continue
                values = f"{rest[0][0]:g}" + (f" to {rest[-1][0]:g}, {len(rest)} points" if len(rest) > 1 else "")
                sizes = [outcome.error for _, outcome in rest]
                error = _size(min(sizes)) + (
                    f" to {_size(max(sizes))}" if len(rest) > 1 and sizes[0] == sizes[0] else ""
                )
                others.append([family.name, scheme.text, values, kind, error, rest[0][1].words])
    held = sorted(point[2].apart for point in points if not math.isnan(point[2].apart))
    without = sum(point[2].rows is None for point in points)
    return f"""## What came of it

{table(["scheme", *KINDS], counts)}

Points that are right, and the largest error of those:

{table(["varied", "range", "unit", *(scheme.text for scheme in SCHEMES)], ranges)}

At {len(held)} of the {len(points)} points the shoe slides one way in full contact, and the motion is linear:
there the reference itself is within {held[-1]:.0e} of the matrix exponential, at half of them within
{held[len(held) // 2]:.0e}.
Points without a reference: {without}.

Every run that is not right, with what is said at the first of its values:

{table(["varied", "scheme", "values", "outcome", "error", "what is said"], others)}
"""


def together_text() -> str:
    """What came of the drawn points."""
    points = list(together(POINTS))
    rows = []
    for scheme in SCHEMES:
        mine = [point[scheme] for point in points]
        right = [outcome.error for outcome in mine if outcome.kind == "right"]
        counts = (str(sum(outcome.kind == kind for outcome in mine)) for kind in KINDS)
        rows.append([scheme.text, *counts, _size(float(np.median(right))), _size(max(right))])
    ranges = table(
        ["drawn", "from", "to"], [[f"`{key}`", f"1e{low}", f"1e{high}"] for key, (low, high) in DRAWN.items()]
    )
    wrong = [
        f"- {scheme.text}, off by {outcome.error:.2g}: {_differences(tables)}"
        for tables, point in zip(drawn(POINTS), points, strict=True)
        for scheme, outcome in point.items()
        if outcome.kind == "silently wrong"
    ]
    told = "\n".join(wrong) or "None is silently wrong."
    return f"""## Several at a time

{POINTS} points on smooth surfaces, drawn with a fixed seed: three quantities of these, in SI units and evenly in
their logarithms, and each angle anywhere in a third of the points.

{ranges}

The bound above is for one thing at a time. Here right is what is off by at most {MOST_ERROR:g}, or by the
tolerance of the event-driven scheme.

{table(["scheme", *KINDS, "median error of right ones", "largest"], rows)}

Silently wrong, each by what it changes in the base case:

{told}
"""


def _differences(tables: Tables) -> str:
    """What tables change in the base case."""
    return ", ".join(
        f"{name}.{key} = {value:.6g}"
        for name, table_ in tables.items()
        for key, value in table_.items()
        if FLAT[name].get(key) != value
    )


def limits_text() -> str:
    """The limits of stability."""
    rows = []
    for name, tables in LIMIT_CASES.items():
        cells = []
        for scheme in LIMITED:
            predicted, observed = limits(tables, scheme)
            cells.append(
                " / ".join("none" if value is None else f"{value:.4g}" for value in (predicted, observed))
            )
        rows.append([name, *cells])
    return f"""## Limits of stability

The largest stable step times ω of the fastest motion on the springs, without friction: as `brakecli stability`
predicts it, and as observed: runs of {LIMIT_STEPS} steps from a small disturbance, by halves. "none": not up to
{MOST_LIMIT:g}. The event-driven scheme has no limit, its steps are its own.

{table(["shoe", *(scheme.text for scheme in LIMITED)], rows)}
"""


def drift_text() -> str:
    """The drift of energy."""
    rows = [[scheme.text, *(f"{drift(scheme, count):.1e}" for count in (10, 100))] for scheme in SCHEMES]
    return f"""## Drift of energy

Free vibration in full contact without dashpots and friction: the relative change of its energy over as many
periods as {DRIFT_STEPS} steps make, at 10 and at 100 steps a period. The event-driven scheme does the same
periods, in one run to {EVENT_TOLERANCE:g}. The weights (1, 1) take all of it, which `brakecli check` says.

{table(["scheme", "10 steps a period", "100 steps a period"], rows)}
"""


def hours_text() -> str:
    """Hours of motion."""
    rows = [[scheme.text, f"{hours(scheme):.0e}"] for scheme in SCHEMES]
    return f"""## Hours of motion

A heavy shoe on a rough wheel for {HOURS:g} s, against a run of {SETTLING:g} s whose wheel starts with the phases
that the long run's has {SETTLING:g} s before its end, computed in fractions. Both have settled: the last 10 s of
both are compared, by the largest difference relative to the range that each quantity has there. It is rounding,
or, for the event-driven scheme, what one run to {EVENT_TOLERANCE:g} of the largest values leaves.

{table(["scheme", "difference"], rows)}
"""


def main() -> None:
    """Run the campaign and write the page."""
    introduction = INTRODUCTION.format(
        truth=TRUTH,
        periods=PERIODS,
        steps=STEPS_PER_PERIOD,
        event=EVENT_TOLERANCE,
        coarsest=COARSEST,
        most=MOST_ERROR,
    )
    parts = (outcomes_text(list(campaign())), together_text(), limits_text(), drift_text(), hours_text())
    PAGE.write_text("\n".join((introduction, *parts)))


if __name__ == "__main__":
    main()
