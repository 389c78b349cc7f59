"""Newton's method across a branch: from a guess to a point."""

import math
from dataclasses import dataclass

import numpy as np

from brakecli.analysis.branches.multipliers import spectrum
from brakecli.analysis.branches.point import Point, cubic
from brakecli.analysis.branches.problem import Array, Evaluation, Problem

ROUNDING = 1e-9
"""Gap that may grow from one correction to the next, and part of the range by which p may leave it."""
FROM_AFAR = 15
"""Evaluations for a point that no neighbour on its branch predicts."""
LEFT = 0.5
OFF = 1e-7
"""A point has left its branch that lies farther off its guess than this part of a stride, and this length."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How finely a branch is followed. Lengths are those of the scaled unknowns and the parameter."""

    low: float = 0.0
    """The branch ends where the parameter reaches this value,"""
    high: float = 1.0
    """or this one."""
    first: float = 0.005
    """First stride."""
    longest: float = 0.05
    """Longest stride."""
    shortest: float = 1e-6
    """Shortest stride; where Newton's method fails even with it, the branch is lost."""
    border: float = 1e-4
    """Stride with which a border is crossed at which the branch turns."""
    turn: float = 0.35
    """Angle, rad, by which the tangent may turn in a stride."""
    change: float = 0.4
    """Change of asinh of the coefficients of the characteristic polynomial in a stride: a half of large ones."""
    near: float = 1e-5
    """Correction that is the last one; the error left is of the order of its square.

    Multipliers and facts are those of the place before it. Facts of a motion so small that the correction is no
    such part of it are those of the last place.
    """
    exact: float = 1e-9
    """Correction that is the last one where a special point is located."""
    clear: float = 1e-3
    """Correction, times the ratio of corrections to gaps, that is the last one: about the error of the tangent."""
    iterations: int = 6
    """Evaluations for one correction."""
    trust: float = 0.3
    """Longest correction."""
    stale: float = 3e-3
    """Length, times that ratio, over which a derivative by the parameter may be used again."""
    steep: float = 0.02
    """Slope dp/ds below which that derivative is taken at the point, so that the sign of the slope is right."""
    points: int = 1500
    """Budget of points."""
    seconds: float = math.inf
    """Budget of time."""
    gap: float = 2e-5
    """Distance of two points between which no further point is inserted: narrower windows are not found."""
    insertions: int = 600
    """Budget of inserted points."""
    everywhere: bool = False
    """Insert points also where a motion is certainly unstable on both sides and between."""


class Newton:
    """Newton's method for one problem. It counts evaluations and remembers why it failed."""

    def __init__(self, problem: Problem, settings: Settings) -> None:
        """Nothing is evaluated yet."""
        self.problem = problem
        self.settings = settings
        self.evaluations = 0
        self.why = ""
        """Why the last correction failed."""
        self.last: Evaluation | None = None
        """What was evaluated last, also where the correction failed."""
        self.outside: Array | None = None
        """Where the last correction left the range of the parameter, if it failed for that."""

    def evaluate(self, z: Array, with_parameter: bool) -> Evaluation | None:
        """Evaluate a place; None, with the reason in `why`, where that is impossible."""
        settings = self.settings
        self.evaluations += 1
        p = min(max(float(z[-1]), settings.low), settings.high)
        evaluation = self.problem.evaluate(z[:-1], p, with_parameter)
        if isinstance(evaluation, Evaluation):
            self.last = evaluation
            return evaluation
        self.why = evaluation or "the motion cannot be computed there"
        return None

    def solve(
        self, guess: Array, normal: Array, onward: Array, s: float, exact: bool = False, most: int | None = None
    ) -> Point | None:
        """Find the point of the branch in the hyperplane through a guess.

        The tangent points to the side of `onward`. The derivative by the parameter is taken again only where the
        word changes, the place moves far, or the branch is steep; `exact` takes it in every iteration.
        """
        settings = self.settings
        self.last = self.outside = None
        near = settings.exact if exact else settings.near
        n = len(guess) - 1
        matrix = np.empty((n + 1, n + 1))
        right = np.zeros((n + 1, 2))
        matrix[n] = normal
        right[n, 1] = 1.0
        z = guess.copy()
        last = math.inf
        before = math.inf
        lever = 1.0
        by_p = None
        word = None
        taken = z
        slack = ROUNDING * (settings.high - settings.low)
        for _ in range(most or settings.iterations):
            if not settings.low - slack <= z[n] <= settings.high + slack:
                self.outside = z
                self.why = "the parameter leaves its range"
                return None
            evaluation = self.evaluate(z, by_p is None or exact)
            if evaluation is not None and evaluation.by_p is None and evaluation.word != word:
                evaluation = self.evaluate(z, True)
            if evaluation is None:
                return None
            if evaluation.by_p is not None:
                by_p = evaluation.by_p
                word = evaluation.word
                taken = z
            gap = float(np.abs(evaluation.gap).max())
            if not gap <= 4.0 * last + ROUNDING:  # a choice, as the first corrections may overshoot
                break
            last = gap
            matrix[:n, :n] = evaluation.by_u
            matrix[:n, n] = by_p
            right[:n, 0] = -evaluation.gap
            right[n, 0] = normal @ (guess - z)
            step, tangent, length = self._solution(matrix, right)
            size = float(np.abs(step).max())
            if not size <= settings.trust or not length < math.inf:
                break
            # rounding of the gap may keep corrections from becoming still smaller
            stalled = size <= settings.near and size > 0.3 * before
            before = size
            # where two branches almost meet, a small gap asks for a long step, and the tangent turns as quickly
            lever = max(lever, size / gap if gap > ROUNDING else 0.0)
            if (size > near or size * lever > settings.clear) and not stalled:
                z = z + step
                continue
            # The last correction is made without another evaluation: its error is of the order of its square.
            if taken is not z and (
                abs(tangent[n]) < settings.steep * length
                or float(np.abs(z - taken).max()) * lever > settings.stale
            ):
                evaluation = self.evaluate(z, True)
                if evaluation is None:
                    return None
                matrix[:n, n] = evaluation.by_p
                step, tangent, length = self._solution(matrix, right)
                if not length < math.inf:
                    break
            z = z + step
            if size > settings.near * evaluation.size and (reached := self.evaluate(z, False)) is not None:
                evaluation = evaluation._replace(facts=reached.facts)
            return self._point(z, tangent / length, length, matrix, onward, s, evaluation)
        self.why = "Newton's method does not converge"
        return None

    @staticmethod
    def _solution(matrix: Array, right: Array) -> tuple[Array, Array, float]:
        """The correction, a tangent and its length, which is infinite where there is none."""
        try:
            step, tangent = np.linalg.solve(matrix, right).T
        except np.linalg.LinAlgError:
            return right[:, 0], right[:, 1], math.inf
        return step, tangent, math.sqrt(tangent @ tangent)

    def _point(
        self,
        z: Array,
        tangent: Array,
        length: float,
        matrix: Array,
        onward: Array,
        s: float,
        evaluation: Evaluation,
    ) -> Point:
        sign, log = np.linalg.slogdet(matrix)
        if tangent @ onward < 0.0:
            tangent = -tangent
            sign = -sign
        multipliers = spectrum(evaluation.maps)
        return Point(
            z=z,
            tangent=tangent,
            s=s,
            multipliers=multipliers.multipliers,
            stable=multipliers.stable,
            tests=(float(tangent[-1]), *multipliers.tests),
            coefficients=multipliers.coefficients,
            # the normal in the last row becomes the tangent, whose part along the normal is 1 / length
            orientation=(float(sign), float(log) + math.log(length)),
            word=evaluation.word,
            facts=evaluation.facts,
            chart=self.problem.chart,
            maps=evaluation.maps,
            margins=evaluation.margins,
        )

    def holds(self, point: Point) -> bool:
        """Whether the word of a point is that of its place: its last correction may have led across a border."""
        evaluation = self.evaluate(point.z, False)
        return evaluation is not None and evaluation.word == point.word

    def at_parameter(self, guess: Array, p: float, onward: Array, s: float, exact: bool = False) -> Point | None:
        """Find the point at a value of the parameter."""
        guess = guess.copy()
        guess[-1] = p
        normal = np.zeros(len(guess))
        normal[-1] = 1.0
        point = self.solve(guess, normal, onward, s, exact)
        if point is not None:
            point.z[-1] = p
        return point

    def between(self, one: Point, other: Point, fraction: float) -> Point | None:
        """Find the point at a part of the way between two neighbours, which share a chart."""
        chord = other.z - one.z
        length = math.sqrt(chord @ chord)
        if length == 0.0:
            return None
        guess = cubic(one, other, fraction)
        onward = one.tangent + other.tangent if one.word == other.word else chord
        # the direction of a very short chord is mostly rounding
        normal = chord / length if length > 1e-6 else one.tangent
        point = self.solve(guess, normal, onward, one.s + fraction * (other.s - one.s), exact=True)
        if point is not None:
            off = point.z - guess
            if off @ off > (LEFT * length) ** 2 + OFF**2:
                self.why = "another branch lies beside this one"
                return None
        return point


def zero(low: float, high: float, at_ends: float = 0.02) -> float:
    """Part of the way from one value to another at which a straight line is zero, but not at the very ends.

    So a bracket whose one end lies near the zero is narrowed from both sides.
    """
    return min(max(low / (low - high), at_ends), 1.0 - at_ends) if low != high else 0.5


def start(
    problem: Problem, u: Array, p: float, onward: Array | None = None, settings: Settings | None = None
) -> Point | None:
    """Return a first point near a guess: at the given p, or in the hyperplane across the direction `onward`."""
    newton = Newton(problem, settings or Settings())
    normal = np.zeros(len(u) + 1)
    normal[-1] = 1.0
    if onward is not None:
        normal = np.asarray(onward, float) / np.linalg.norm(onward)
    return newton.solve(np.append(u, p), normal, normal, 0.0, exact=True, most=FROM_AFAR)
