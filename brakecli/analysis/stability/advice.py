"""Which numbers of a case move its critical friction coefficient, and how far each must change to be safe."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import numpy as np
from pydantic import ValidationError

from brakecli.analysis.stability.modes import growth
from brakecli.analysis.stability.report import LARGEST_FRICTION, changes, mean_stiffness
from brakecli.analysis.stability.search import bisect
from brakecli.case.case import Case
from brakecli.case.read import put
from brakecli.case.system import system_of
from brakecli.errors import CaseError, UsageError, printable
from brakecli.solver.links import natural_frequencies
from brakecli.solver.steady_sliding import steady_sliding, tabulated

KEYS = ("*.mass", "*.stiffness", "*.damping", "*.angle_deg", "load.*")
"""What may be advised: masses, stiffnesses, dampings, angles and the load."""
FACTOR, RUNGS = 10.0, 40  # values are tried up to this factor away, in so many steps each way
DEGREE = 1.0  # step of angles, which are tried up to ±90°
_IDLE = ("initial", "solver", "output")  # steady sliding does not depend on these tables
_STEP, _ROUGH_STEP = 1e-3, 0.1  # of a derivative, as a part of the value; averages over roughness are noisy
_ROUNDING = 1e-12  # of an answer
_SURE = 0.05  # largest relative error of a derivative; beyond it there is none, as where the answer jumps

Path = tuple[str, ...]
Number = float | tuple[float, ...]
Tell = Callable[[], None]


@dataclass(frozen=True)
class Answer:
    """Linear stability of a case, in short."""

    critical: float | None  # least friction at which stability is lost, 0 where it is never there
    growth: float | None  # 1/s, at the case's own friction; None where there is no steady sliding

    def safe(self, least: float) -> bool:
        """Whether sliding is steady, and stable up to a friction coefficient."""
        return self.growth is not None and (self.critical is None or self.critical >= least)


@dataclass(frozen=True)
class Sensitivity:
    """What a number of the case moves. All entries of a list are scaled alike, and it has elasticities only."""

    parameter: str
    value: Number
    elasticity: float | None  # per cent of critical friction for one per cent of the value
    derivative: float | None  # of the critical friction, per unit of the key
    error: float | None  # relative, of both
    growth_derivative: float | None  # 1/s per unit of the key; of a list per unit of its factor

    @property
    def growth_change(self) -> float | None:
        """Change of the growth rate, 1/s, for one per cent of the value; for 0.01 where that is 0."""
        at = self.value if isinstance(self.value, float) and self.value else 1.0
        return None if self.growth_derivative is None else 0.01 * abs(at) * self.growth_derivative


@dataclass(frozen=True)
class Change:
    """The nearest value that is safe, and what it gives; `to` is None where no value between two ends helps."""

    parameter: str
    start: float
    to: float | None
    critical_friction: float | None  # None also where friction alone never makes it unstable
    lowest: float
    highest: float

    @property
    def rounded(self) -> str:
        """The value to four digits, rounded away from where it was, so that it is still as safe."""
        if self.to is None:
            return "no help"
        unit = 10.0 ** (math.floor(math.log10(abs(self.to))) - 3) if self.to else 1.0
        return f"{unit * (math.ceil if self.to > self.start else math.floor)(self.to / unit):.4g}"

    @property
    def size(self) -> float:
        """How large the change is: a logarithm, or radians; infinite where there is none."""
        if self.to is None:
            return math.inf
        if self.parameter.endswith("_deg"):
            return math.radians(abs(self.to - self.start))
        return abs(math.log(self.to / self.start)) if self.start else FACTOR


def answer(case: Case, up_to: float = LARGEST_FRICTION) -> Answer | None:
    """The answer for a case; None where the wheel stands or nothing touches it."""
    with suppress(ArithmeticError, np.linalg.LinAlgError):
        system, rest = system_of(case), None
        c, belt, k = system.coefficients, system.belt_speed, system.contact_stiffness
        with suppress(CaseError):
            rest = steady_sliding(system, mean=tabulated(system))
            k = rest.stiffness if rest.is_pressed(system.load_at_start) else 0.0
        if belt != 0.0 and k > 0.0:
            found = changes(system, mean_stiffness(system, k), up_to)
            rate = growth(c, k, math.copysign(c.phi, belt)) if rest else None
            unstable = rate is not None and rate > 1e-9 * natural_frequencies(c, k)[1]
            never = not found[0].lost if found else unstable
            critical = 0.0 if never else next((each.friction for each in found if each.lost), None)
            return Answer(critical, rate)
    return None


def numbers(case: Case) -> dict[Path, Number]:
    """Every number of a case, and every list of numbers, by key path; whole ones are choices, not quantities."""

    def within(table: Any, path: Path) -> Iterator[tuple[Path, Number]]:
        for key, value in table.items():
            if isinstance(value, dict):
                yield from within(value, (*path, key))
            elif isinstance(value, float) or (isinstance(value, tuple) and any(value)):
                yield (*path, key), value

    return dict(within(case.model_dump(), ()))


def advised_keys(case: Case, patterns: Sequence[str]) -> list[Path]:
    """The single numbers whose keys fit a pattern; raises UsageError for one that fits none."""
    known = {".".join(path): path for path, value in numbers(case).items() if isinstance(value, float)}
    known = {key: path for key, path in known.items() if path[0] not in _IDLE}
    for pattern in patterns:
        if pattern not in KEYS and not any(fnmatchcase(key, pattern) for key in known):
            what = "names no number that may be advised"
            raise UsageError(f"--keys {printable(pattern)}: {what}; these are {', '.join(known)}")
    return [path for key, path in known.items() if any(fnmatchcase(key, pattern) for pattern in patterns)]


def changed(case: Case, path: Path, value: Number) -> Case | None:
    """The case with another value; None where that is not valid."""
    data = case.model_dump(exclude_unset=True)
    put(data, path, value, Case, kept=())
    with suppress(ValidationError):
        return Case.model_validate(data)
    return None


def sensitivity(case: Case, path: Path, critical: float | None, tell: Tell) -> Sensitivity:
    """Derivatives by central differences, one-sided at the end of a range, with Richardson's error estimate."""
    value, parameter = numbers(case)[path], ".".join(path)
    listed = isinstance(value, tuple)
    at = 1.0 if isinstance(value, tuple) else value
    if path[0] in _IDLE:
        zero = None if critical is None else 0.0
        return Sensitivity(parameter, value, zero if at else None, zero, zero, 0.0)
    up_to = min(LARGEST_FRICTION, 1.2 * critical) if critical else case.friction.coefficient + 0.1

    @cache
    def found(x: float) -> Answer | None:
        tell()
        given = tuple(x * each for each in value) if isinstance(value, tuple) else x
        there = changed(case, path, given)
        return answer(there, up_to) if there else None

    noisy = _rough(case) and (path[0] == "roughness" or path[-1] == "half_length")
    step = (_ROUGH_STEP if noisy else _STEP) * (abs(at) or _scale(case, parameter))
    slope, error = _derivative(lambda x: getattr(found(x), "critical", None), at, step)
    rate, _ = _derivative(lambda x: getattr(found(x), "growth", None), at, step)
    elasticity = slope * at / critical if slope is not None and critical and at else None
    return Sensitivity(parameter, value, elasticity, None if listed else slope, error, rate)


def advised(case: Case, path: Path, margin: float, tell: Tell) -> Change:
    """The nearest value at which the case is stable up to (1 + margin) times its friction, found by bisection."""
    value, parameter = numbers(case)[path], ".".join(path)
    assert isinstance(value, float)
    ways = [*_ladders(case, parameter, value)]
    ends = [value, *(way[-1] for way in ways)]

    @cache
    def safe(x: float) -> bool:
        tell()
        there = changed(case, path, x)
        least = (1.0 + margin) * there.friction.coefficient if there else 0.0
        slower = changed(there, ("friction", "coefficient"), least) if there else None
        if there is None or slower is None or (_rough(case) and _grows(slower)):  # a search takes long there
            return False
        reached = answer(there, 1.01 * least + 0.01)
        return reached is not None and reached.safe(least)

    for rung in range(1, max(map(len, ways))):
        for way in ways:
            if rung < len(way) and safe(way[rung]):
                to = _first(safe, way[rung - 1], way[rung])
                there = changed(case, path, to)
                reached = answer(there) if there else None
                critical = reached.critical if reached else None
                return Change(parameter, value, to, critical, min(ends), max(ends))
    return Change(parameter, value, None, None, min(ends), max(ends))


def _rough(case: Case) -> bool:
    return case.roughness.shoe is not None or case.roughness.wheel is not None


def _grows(case: Case) -> bool:
    """Whether sliding is not steady, or not stable, at the case's own friction."""
    found = answer(case, 0.0)
    return found is None or found.growth is None or found.critical == 0.0


def _first(safe: Callable[[float], bool], before: float, after: float) -> float:
    """The first value that is safe on the way from one that is not to one that is."""
    if before < after:
        to = bisect(lambda x: not safe(x), before, after, halvings=45)[1]
    else:
        to = bisect(safe, after, before, halvings=45)[0]
    return 0.0 if abs(to) < 1e-6 * abs(after - before) and safe(0.0) else to  # where two links decouple


def _ladders(case: Case, parameter: str, value: float) -> Iterator[list[float]]:
    """The values that are tried, upwards and downwards, nearest first; from 0 on upwards alone."""
    if parameter.endswith("_deg"):
        for end, step in ((90.0, DEGREE), (-90.0, -DEGREE)):
            yield [value, *np.arange(value + step, end, step).tolist(), end]
        return
    powers = FACTOR ** (np.arange(1, RUNGS + 1) / RUNGS)
    if value:
        yield [value, *(value * powers).tolist()]
        yield [value, *(value / powers).tolist()]
    else:
        yield [0.0, *(_scale(case, parameter) * (powers / FACTOR) ** 3).tolist()]


def _scale(case: Case, parameter: str) -> float:
    """What is large for a number that is 0: the contact's stiffness and critical damping, or one unit."""
    stiffness = 2.0 * case.contact.half_length * case.contact.stiffness
    kinds = {"stiffness": stiffness, "damping": 2.0 * math.sqrt(stiffness * case.shoe.mass)}
    return kinds.get(parameter.rpartition(".")[2], 1.0)


def _derivative(f: Callable[[float], float | None], x: float, step: float) -> tuple[float | None, float | None]:
    """The derivative and its relative error; None where there is none."""
    at = f(x)
    coarse, fine = _difference(f, x, step), _difference(f, x, 0.5 * step)
    if at is None or coarse is None or fine is None:
        return None, None
    slope, noise = fine + (fine - coarse) / 3.0, _ROUNDING * abs(at) / step  # Richardson: both are of second order
    if abs(slope) <= noise:
        return 0.0, 0.0
    error = (abs(fine - coarse) + noise) / abs(slope)
    return (slope, error) if error <= _SURE else (None, None)


def _difference(f: Callable[[float], float | None], x: float, step: float) -> float | None:
    """A difference quotient of second order: central, or to the one side that exists."""
    high, low, at = f(x + step), f(x - step), f(x)
    if high is not None and low is not None:
        return (high - low) / (2.0 * step)
    for h in (step, -step):
        half, whole = f(x + 0.5 * h), f(x + h)
        if at is not None and half is not None and whole is not None:
            return (4.0 * half - whole - 3.0 * at) / h
    return None
