"""Which numbers of a case move its critical friction coefficient, and how far each must change to be safe."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from itertools import pairwise, takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from brakecli.analysis.stability.edges import edges
from brakecli.analysis.stability.modes import growth
from brakecli.analysis.stability.report import LARGEST_FRICTION, critical_friction
from brakecli.analysis.stability.search import HALVINGS, bisect
from brakecli.case.case import Case
from brakecli.case.read import put
from brakecli.case.system import system_of
from brakecli.errors import UsageError, printable
from brakecli.faces import argument
from brakecli.solver.steady_sliding import sliding, tabulated

KEYS = ("*.mass", "*.stiffness", "*.damping", "*.angle_deg", "load.*")
"""What may be advised: masses, stiffnesses, dampings, angles and the load."""
FACTOR = 10.0  # up to which away values may be advised
_IDLE = ("initial", "solver", "output")  # steady sliding does not depend on these tables
_FEWEST_DIGITS = 4  # of advice

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
class Left:
    """The probability that brakes squeal which are built to a drawing, but not quite, with its 95 % interval."""

    squeal_probability: float
    squeal_lower: float
    squeal_upper: float
    unstable_elsewhere: float | None = None  # the part that is unstable, but does not squeal; None if unknown
    squeal_frequency: float | None = None  # Hz, median of those that vibrate; None where none does
    unstable: NDArray[np.bool_] | None = field(default=None, compare=False)  # which of them are: sets, samples

    @property
    def is_vague(self) -> bool:
        """Whether the interval reaches farther than a tenth of the value: its second digit says nothing then."""
        return self.squeal_upper - self.squeal_lower > 0.2 * self.squeal_probability


@dataclass(frozen=True)
class Change:
    """The nearest value that is safe, and what it gives; `to` is None where no value between two ends helps."""

    parameter: str
    start: float
    to: float | None
    until: float | None  # the end of the interval of safe values that begins at `to`; not looked for on rough pads
    critical_friction: float | None  # None also where friction alone never makes it unstable
    lowest: float
    highest: float
    rounded: str  # `to`, or "no help"
    check: str | None = None  # regime of a run with the change; None where there was none
    squeal: Left | None = None  # what is left of squeal under scatter; None where it was not asked

    @property
    def size(self) -> float:
        """How large the change is: a logarithm, or radians; infinite where there is none."""
        return math.inf if self.to is None else _distance(self.parameter, self.start, self.to)


def answer(case: Case, up_to: float = LARGEST_FRICTION) -> Answer | None:
    """The answer for a case; None where the wheel stands or nothing touches it."""
    with suppress(ArithmeticError, np.linalg.LinAlgError):
        system = system_of(case)
        c = system.coefficients
        belt = system.belt_speed
        k = system.contact_stiffness
        if steady := sliding(system, tabulated(system)):
            k = steady.stiffness if steady.is_pressed(system.load_at_start) else 0.0
        if belt != 0.0 and k > 0.0:
            critical = critical_friction(system, k, up_to)
            return Answer(critical, growth(c, k, c.grip(belt)) if steady else None)
    return None


def numbers(case: Case) -> dict[Path, Number]:
    """Every number of a case, and every list of numbers, by key path; whole ones are choices, not quantities."""

    def within(table: Mapping[str, object], path: Path) -> Iterator[tuple[Path, Number]]:
        for key, value in table.items():
            if isinstance(value, dict):
                yield from within(value, (*path, key))
            elif isinstance(value, float) or (isinstance(value, tuple) and any(value)):
                yield (*path, key), value

    return dict(within(case.model_dump(), ()))


def advised_keys(case: Case, patterns: Sequence[str]) -> list[Path]:
    """The single numbers whose keys fit a pattern; raises UsageError for one that fits none."""
    paths = {".".join(path): path for path, value in numbers(case).items() if isinstance(value, float)}
    paths = {key: path for key, path in paths.items() if path[0] not in _IDLE}
    for pattern in patterns:
        if pattern not in KEYS and not any(fnmatchcase(key, pattern) for key in paths):
            what = "names no number that may be advised"
            raise UsageError(f"{argument('keys')} {printable(pattern)}: {what}; these are {', '.join(paths)}")
    return [path for key, path in paths.items() if any(fnmatchcase(key, pattern) for pattern in patterns)]


def changed(case: Case, path: Path, value: Number) -> Case | None:
    """The case with another value; None where that is not valid."""
    data = case.model_dump(exclude_unset=True)
    put(data, path, value, Case, kept=())
    with suppress(ValidationError):
        return Case.model_validate(data)
    return None


def sensitivity(case: Case, path: Path, critical: float | None, tell: Tell) -> Sensitivity:
    """Derivatives by central differences, one-sided at the end of a range, with Richardson's error estimate."""
    value = numbers(case)[path]
    parameter = ".".join(path)
    listed = isinstance(value, tuple)
    at = 1.0 if isinstance(value, tuple) else value
    if path[0] in _IDLE:
        zero = None if critical is None else 0.0
        return Sensitivity(parameter, value, zero if at else None, zero, zero, 0.0)
    # a changed case is searched for its own critical friction up to there
    up_to = min(LARGEST_FRICTION, 1.2 * critical) if critical else case.friction.coefficient + 0.1

    @cache
    def answer_at(x: float) -> Answer | None:
        tell()
        varied = tuple(x * entry for entry in value) if isinstance(value, tuple) else x
        there = changed(case, path, varied)
        return answer(there, up_to) if there else None

    noisy = _rough(case) and (path[0] == "roughness" or path[-1] == "half_length")
    # averages over roughness are noisy, and bend
    step = (0.1 if noisy else 1e-3) * (abs(at) or _scale(case, parameter))
    steps = [step, 0.5 * step] if noisy else [step]
    slope, error = _surest(lambda x: getattr(answer_at(x), "critical", None), at, steps)
    rate, _ = _surest(lambda x: getattr(answer_at(x), "growth", None), at, steps)
    elasticity = slope * at / critical if slope is not None and critical and at else None
    return Sensitivity(parameter, value, elasticity, None if listed else slope, error, rate)


def advised(case: Case, path: Path, margin: float, tell: Tell) -> Change:
    """The nearest value at which the case is stable up to (1 + margin) times its friction.

    Stability changes at edges only: on smooth pads real roots of its conditions, on rough ones the steps of a
    ladder. So one value between each two edges is asked, and an angle at which a link does not couple x and y.
    """
    value = numbers(case)[path]
    parameter = ".".join(path)
    assert isinstance(value, float)
    low, high = _bounds(case, parameter, value)
    decoupled = (0.0,) if _is_angle(parameter) else ()  # a shoe may be stable there alone

    @cache
    def safe(x: float) -> bool:
        tell()
        there = changed(case, path, x)
        least = (1.0 + margin) * there.friction.coefficient if there else 0.0
        slower = changed(there, ("friction", "coefficient"), least) if there else None
        if there is None or slower is None or (_rough(case) and _grows(slower)):  # a search takes long there
            return False
        reached = answer(there, 1.01 * least + 0.01)  # a little farther than it has to be safe
        return reached is not None and reached.safe(least) and _is_pressed(there, least)

    def last(there: float, beyond: float) -> float:
        """The last safe value on the way from one that is to one that is not."""
        if there < beyond:
            return bisect(safe, there, beyond, halvings=HALVINGS)[0]
        return bisect(lambda x: not safe(x), beyond, there, halvings=HALVINGS)[1]

    inner = {edge for edge in (*decoupled, *_edges(case, path, value, margin)) if low < edge < high}
    ordered = sorted({low, high, value, *inner})
    at = ordered.index(value)
    both = [_ask(way, decoupled, _is_angle(parameter)) for way in (ordered[at:], ordered[at::-1])]
    places = [(way, number) for way in both for number in range(1, len(way))]
    for way, number in sorted(places, key=lambda pair: _distance(parameter, value, pair[0][pair[1]].edge)):
        if not safe(there := way[number].value):
            continue
        before = way[number - 1].value
        to = last(there, before)
        until = None
        if there in decoupled and abs(to - there) < 1e-6 * abs(before - there):  # so close it has found 0°
            to = there
        if value == 0.0 and not decoupled:  # the least value may be as small as one likes
            to = max(to, min(there, 1e-6 * high))
        if not _rough(case):
            after = list(takewhile(lambda question: safe(question.value), way[number:]))
            ends = [question.value for question in way[number + len(after) :]] or [high if there > value else low]
            until = ends[0] if safe(ends[0]) else last(after[-1].value, ends[0])
        reached = answer(changed(case, path, to) or case)
        critical = reached.critical if reached else None
        return Change(parameter, value, to, until, critical, low, high, _shown(to, to > value, safe))
    return Change(parameter, value, None, None, None, low, high, "no help")


class _Question(NamedTuple):
    """A value that is asked, for all behind the edge next to it on the way there."""

    edge: float
    value: float


def _ask(way: Sequence[float], special: Sequence[float], angle: bool) -> list[_Question]:
    """The values to ask on a way over edges, first of all where it begins."""
    questions = [_Question(way[0], way[0])]
    for near, far in pairwise(way):
        if near in special and near != way[0]:
            questions.append(_Question(near, near))
        middle = 0.5 * (near + far) if angle or near * far <= 0.0 else math.copysign(math.sqrt(near * far), near)
        questions.append(_Question(near, middle))
    return questions


def _edges(case: Case, path: Path, value: float, margin: float) -> list[float]:
    """Where the safety of a value may change; a ladder where the mean stiffness depends on it, too."""
    parameter = ".".join(path)
    if _rough(case):
        return [rung for way in _ladders(case, parameter, value) for rung in way]
    system = system_of(case)
    sign = math.copysign(1.0, system.belt_speed)
    return edges(case, parameter, value or _scale(case, parameter), system.contact_stiffness, sign, margin)


def _distance(parameter: str, start: float, to: float) -> float:
    """How large a change is: radians, or a logarithm."""
    if _is_angle(parameter):
        return math.radians(abs(to - start))
    return abs(math.log(to / start)) if start else FACTOR


def _shown(to: float, up: bool, safe: Callable[[float], bool]) -> str:
    """A safe value in few digits, rounded onwards, or in as many as it takes to be safe."""
    texts = (rounded(to, up, digits) for digits in range(_FEWEST_DIGITS, 17))
    return next((text for text in texts if safe(float(text))), repr(to))


def rounded(value: float, up: bool, digits: int = _FEWEST_DIGITS) -> str:
    """A number in so many digits, rounded up or down."""
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits) if value else 1.0
    return f"{unit * (math.ceil if up else math.floor)(value / unit):.{digits}g}"


def percent(share: float) -> str:
    """A share in two digits."""
    return f"{float(f'{100.0 * share:.2g}'):g} %"


def _is_angle(parameter: str) -> bool:
    return parameter.endswith("_deg")


def _bounds(case: Case, parameter: str, value: float) -> tuple[float, float]:
    """The least and the largest value that may be advised."""
    if _is_angle(parameter):
        return -90.0, 90.0
    low, high = sorted((value / FACTOR, value * FACTOR))
    return (low, high) if value else (0.0, _scale(case, parameter))


def _is_pressed(case: Case, up_to: float) -> bool:
    """Whether the load presses the shoe on, on smooth pads up to a friction coefficient: F_y is monotonic in φ."""
    if _rough(case):  # its search asks for that at every friction coefficient
        return True
    system = system_of(case)
    ends = [sliding(system, phi=phi) for phi in (0.0, up_to)]
    return all(end is not None and end.is_pressed(system.load_at_start) for end in ends)


def _rough(case: Case) -> bool:
    return case.roughness.shoe is not None or case.roughness.wheel is not None


def _grows(case: Case) -> bool:
    """Whether sliding is not steady, or not stable, at the case's own friction."""
    own = answer(case, 0.0)
    return own is None or own.growth is None or own.critical == 0.0


def _ladders(case: Case, parameter: str, value: float) -> Iterator[list[float]]:
    """The values that are tried, upwards and downwards, nearest first; from 0 on upwards alone."""
    if parameter.endswith("_deg"):
        for end, step in ((90.0, 1.0), (-90.0, -1.0)):
            yield [value, *np.arange(value + step, end, step).tolist(), end]
        return
    powers = FACTOR ** (np.arange(1, 41) / 40)
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


def _surest(
    f: Callable[[float], float | None], x: float, steps: Sequence[float]
) -> tuple[float | None, float | None]:
    """The derivative with the least error by one of the steps."""
    derivatives = (_derivative(f, x, step) for step in steps)
    return min(derivatives, key=lambda pair: math.inf if pair[1] is None else pair[1])


def _derivative(f: Callable[[float], float | None], x: float, step: float) -> tuple[float | None, float | None]:
    """The derivative and its relative error; None where there is none."""
    at = f(x)
    coarse = _difference(f, x, step)
    fine = _difference(f, x, 0.5 * step)
    if at is None or coarse is None or fine is None:
        return None, None
    # Richardson: both are of second order
    slope = fine + (fine - coarse) / 3.0
    noise = 1e-12 * abs(at) / step  # by the rounding of an answer
    if abs(slope) <= noise:
        return 0.0, 0.0
    error = (abs(fine - coarse) + noise) / abs(slope)
    return (slope, error) if error <= 0.05 else (None, None)  # as where the answer jumps


def _difference(f: Callable[[float], float | None], x: float, step: float) -> float | None:
    """A difference quotient of second order: central, or to the one side that exists."""
    high = f(x + step)
    low = f(x - step)
    at = f(x)
    if high is not None and low is not None:
        return (high - low) / (2.0 * step)
    for h in (step, -step):
        half = f(x + 0.5 * h)
        whole = f(x + h)
        if at is not None and half is not None and whole is not None:
            return (4.0 * half - whole - 3.0 * at) / h
    return None
