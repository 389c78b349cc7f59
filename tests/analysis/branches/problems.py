"""Problems with closed forms: roots of one equation, and periodic orbits of maps."""

from collections.abc import Callable, Hashable

import numpy as np

from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Array, Doubled, Evaluation, Guess, Problem


class Roots(Problem):
    """Roots of f(u, p) for vectors u, as fixed points of u + pace · f(u, p)."""

    def __init__(
        self,
        f: Callable[[Array, float], list[float]],
        by_u: Callable[[Array, float], list[list[float]]],
        by_p: Callable[[Array, float], list[float]],
        pace: float = 0.1,
        word: Callable[[Array, float], Hashable] = lambda u, p: "",
    ) -> None:
        self.f = f
        self.by_u = by_u
        self.by_p = by_p
        self.pace = pace
        self.word = word
        self.calls = self.with_parameter = 0

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        self.calls += 1
        self.with_parameter += with_parameter
        by_u = np.array(self.by_u(u, p), float)
        return Evaluation(
            gap=np.array(self.f(u, p), float),
            by_u=by_u,
            by_p=np.array(self.by_p(u, p), float) if with_parameter else None,
            maps=(np.eye(len(u)) + self.pace * by_u)[None],
            word=self.word(u, p),
            facts={"u": u.copy()},
        )

    def border(self, before: Hashable, after: Hashable) -> str:
        return f"{before} to {after}"


Step = Callable[[Array, float], tuple[Array, Array, Array]]
"""The image of a place, its derivative by the place, and by the parameter."""


class Orbits(Doubled):
    """Orbits of period k of a map x -> f(x, r), with r = low + p (high - low); u holds their k places."""

    def __init__(self, f: Step, low: float, high: float, k: int = 1) -> None:
        self.f = f
        self.low = low
        self.high = high
        self.k = k

    def value(self, p: float) -> float:
        return self.low + p * (self.high - self.low)

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        places = u.reshape(self.k, -1)
        d = places.shape[1]
        gap = np.empty(u.size)
        by_u = np.zeros((u.size, u.size))
        by_p = np.empty(u.size)
        maps = []
        for i, place in enumerate(places):
            image, by_place, by_r = self.f(place, self.value(p))
            j = (i + 1) % self.k
            here = slice(i * d, i * d + d)
            there = ((i + 1) % self.k) * d
            gap[here] = image - places[j]
            by_u[here, here] = by_place
            by_u[here, there : there + d] -= np.eye(d)
            by_p[here] = by_r * (self.high - self.low)
            maps.append(by_place)
        return Evaluation(gap, by_u, by_p if with_parameter else None, np.array(maps), self.k, places.copy())

    def halved(self, point: Point) -> Array | None:
        return None if self.k % 2 else np.subtract(*np.split(point.u, 2))

    def double(self, point: Point, vector: Array) -> Guess:
        places = point.u.reshape(self.k // 2, -1)
        out = [vector]
        for place in places:
            out.append(self.f(place, self.value(point.p))[1] @ out[-1])
        first = np.concatenate(out[:-1])
        return np.tile(point.u, 2), np.concatenate([first, -first, [0.0]])


def logistic(x: Array, r: float) -> tuple[Array, Array, Array]:
    """x -> r x (1 - x)."""
    return r * x * (1.0 - x), np.array([[r * (1.0 - 2.0 * x[0])]]), x * (1.0 - x)


def bubble(x: Array, r: float) -> tuple[Array, Array, Array]:
    """x -> x³ - (2 - r²) x: 0 flips at r = ±1, and between them x and -x follow each other where x² + r² = 1."""
    return x**3 - (2.0 - r**2) * x, np.array([[3.0 * x[0] ** 2 - (2.0 - r**2)]]), 2.0 * r * x


def delayed_logistic(x: Array, r: float) -> tuple[Array, Array, Array]:
    """(x, y) -> (y, r y (1 - x))."""
    a, b = x
    return (
        np.array([b, r * b * (1.0 - a)]),
        np.array([[0.0, 1.0], [-r * b, r * (1.0 - a)]]),
        np.array([0.0, b * (1.0 - a)]),
    )


class Given(Problem):
    """The motion u = 0 with maps that are given as functions of the parameter.

    The word is whether the margin is positive.
    """

    def __init__(
        self, maps: Callable[[float], list[list[float]]], margin: Callable[[float], float] | None = None
    ) -> None:
        self.maps = maps
        self.margin = margin

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        by_p = np.zeros(1) if with_parameter else None
        margins = () if self.margin is None else (self.margin(p),)
        word = bool(margins and margins[0] > 0.0)
        return Evaluation(u.copy(), np.eye(1), by_p, np.array([self.maps(p)]), word, None, margins)


class Scaled(Problem):
    """The curve (u - 2)² + (p - 0.5)² = 0.04 in charts that count u from the place where each was made.

    The unknown is the distance from that place, ten times as large.
    """

    def __init__(self, carries: bool) -> None:
        self.chart: object = (2.0,)
        self.charts: list[object] = []
        self.carries = carries

    def origin(self) -> float:
        assert isinstance(self.chart, tuple)
        return float(self.chart[0])

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        x = self.origin() + 0.1 * u - 2.0
        q = p - 0.5
        by_u = 0.2 * x[:, None]
        by_p = np.array([2.0 * q]) if with_parameter else None
        return Evaluation(
            x**2 + q**2 - 0.04, by_u, by_p, np.array([np.eye(1) + by_u]), "", self.origin() + 0.1 * u[0]
        )

    def renew(self, point: Point) -> Guess | None:
        if abs(point.u[0]) < 1.0:
            return None
        self.chart = (self.origin() + 0.1 * point.u[0],)
        self.charts.append(self.chart)
        return np.zeros(1), point.tangent

    def carry(self, point: Point, chart: object) -> Guess | None:
        assert isinstance(chart, tuple)
        assert isinstance(point.chart, tuple)
        return (point.u + 10.0 * (point.chart[0] - chart[0]), point.tangent) if self.carries else None
