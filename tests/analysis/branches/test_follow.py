"""Branches of equations with closed forms: that they are followed to their ends, and why they end."""

import math
from dataclasses import replace

import numpy as np
import pytest

from brakecli.analysis.branches.follow import both_ways, follow
from brakecli.analysis.branches.newton import Settings, start
from brakecli.analysis.branches.point import Branch, Point
from brakecli.analysis.branches.problem import Array, Evaluation, Problem
from tests.analysis.branches.problems import Roots, Scaled


def first_of(problem: Problem, u: list[float], p: float) -> Point:
    found = start(problem, np.array(u), p)
    assert found is not None
    return found


def parabola(fold: float, sign: float = 1.0) -> Roots:
    """p = fold + sign · u²."""
    return Roots(
        lambda u, p: [p - fold - sign * u[0] ** 2], lambda u, p: [[-2.0 * sign * u[0]]], lambda u, p: [1.0]
    )


def circle() -> Roots:
    return Roots(
        lambda u, p: [u[0] ** 2 + (p - 0.5) ** 2 - 0.04],
        lambda u, p: [[2.0 * u[0]]],
        lambda u, p: [2.0 * (p - 0.5)],
    )


def lemniscate(a: float) -> Roots:
    """(q² + u²)² = a² (q² - u²) with q = p - 0.5: it crosses itself at its middle and is 5.24411510858 a long."""
    return Roots(
        lambda u, p: [((p - 0.5) ** 2 + u[0] ** 2) ** 2 - a * a * ((p - 0.5) ** 2 - u[0] ** 2)],
        lambda u, p: [[4.0 * u[0] * ((p - 0.5) ** 2 + u[0] ** 2) + 2.0 * a * a * u[0]]],
        lambda u, p: [4.0 * (p - 0.5) * ((p - 0.5) ** 2 + u[0] ** 2) - 2.0 * a * a * (p - 0.5)],
    )


def kinds(branch: Branch) -> list[str]:
    return [special.kind for special in branch.specials]


def bordered(left: float, right: float, jump: float = 0.0) -> Roots:
    """Fixed points of x -> s x + p - 0.5, with s = left below x = 0 and right above it, which jumps there."""
    return Roots(
        lambda u, p: [p - 0.5 + (left - 1.0) * u[0] if u[0] < 0.0 else p - 0.5 - jump + (right - 1.0) * u[0]],
        lambda u, p: [[left - 1.0 if u[0] < 0.0 else right - 1.0]],
        lambda u, p: [1.0],
        pace=1.0,
        word=lambda u, p: "below" if u[0] < 0.0 else "above",
    )


def test_ends_of_the_range_are_exact() -> None:
    line = Roots(
        lambda u, p: [u[0] - math.sin(3.0 * p)], lambda u, p: [[1.0]], lambda u, p: [-3.0 * math.cos(3.0 * p)]
    )
    branch = both_ways(line, first_of(line, [0.9], 0.4))
    assert [branch.points[0].p, branch.points[-1].p] == [0.0, 1.0]
    assert [point.u[0] for point in branch.points] == pytest.approx(
        [math.sin(3.0 * point.p) for point in branch.points], abs=1e-9
    )
    assert [end.kind for end in branch.ended] == ["range", "range"]
    s = [point.s for point in branch.points]
    assert s == sorted(s)
    # the length of a sine: its closed form is elliptic, so by the trapezoidal rule
    p = np.linspace(0.0, 1.0, 10001)
    length = np.trapezoid(np.hypot(1.0, 3.0 * np.cos(3.0 * p)), p)
    assert s[-1] - s[0] == pytest.approx(length, rel=1e-4)


@pytest.mark.parametrize(("fold", "ends"), [(1.0001, 1), (0.9999, 2)])
def test_a_branch_that_turns_just_beyond_the_range_ends_at_the_range(fold: float, ends: int) -> None:
    problem = parabola(fold, -1.0)
    branch = follow(problem, first_of(problem, [0.5], fold - 0.25), 1.0)
    assert branch.ended[1].kind == "range"
    assert all(0.0 <= point.p <= 1.0 for point in branch.points)
    assert branch.points[-1].p == (1.0 if ends == 1 else 0.0)
    assert kinds(branch) == (["end"] if ends == 1 else ["fold", "end"])


def test_nothing_is_evaluated_outside_the_range() -> None:
    class Careful(Problem):
        def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
            assert 0.0 <= p <= 1.0
            return parabola(0.999, -1.0).evaluate(u, p, with_parameter)

    problem = Careful()
    assert kinds(both_ways(problem, first_of(problem, [0.5], 0.749))) == ["end", "fold", "end"]


def test_a_circle_is_closed_once_round() -> None:
    problem = circle()
    branch = both_ways(problem, first_of(problem, [0.2], 0.5))
    assert [end.kind for end in branch.ended] == ["closed", "closed"]
    assert branch.points[-1].s == pytest.approx(0.4 * math.pi, rel=1e-3)
    assert branch.points[-1].z == pytest.approx(branch.points[0].z, abs=1e-7)
    assert kinds(branch).count("fold") == 2


@pytest.mark.parametrize("pitch", [1e-2, 1e-4, 1e-5])
def test_a_helix_that_passes_its_start_is_not_closed(pitch: float) -> None:
    c = pitch / (2.0 * math.pi)

    def f(u: Array, p: float) -> list[float]:
        return [u[0] - 0.2 * math.cos(u[1] / c), p - 0.5 - 0.2 * math.sin(u[1] / c)]

    def by_u(u: Array, p: float) -> list[list[float]]:
        return [[1.0, 0.2 / c * math.sin(u[1] / c)], [0.0, -0.2 / c * math.cos(u[1] / c)]]

    problem = Roots(f, by_u, lambda u, p: [0.0, 1.0], pace=1e-3)
    branch = follow(problem, first_of(problem, [0.2, 0.0], 0.5), settings=Settings(points=160))
    assert branch.ended[1].kind == "points"
    assert branch.points[-1].u[1] > 1.5 * pitch


def test_a_figure_eight_begun_in_its_middle_is_not_closed_where_it_crosses_itself() -> None:
    # begun at the crossing itself, the branch comes back to the same place in another direction
    problem = lemniscate(0.3)
    beside = first_of(problem, [0.004], 0.504)
    first = replace(beside, z=np.array([0.0, 0.5]), tangent=np.array([1.0, 1.0]) / math.sqrt(2.0))
    branch = follow(problem, first, settings=Settings(points=60))
    assert branch.points[-1].s > 1.1 * 0.5 * 5.24411510858 * 0.3


@pytest.mark.parametrize("carries", [True, False])
def test_charts_are_renewed_and_a_closed_branch_is_known_in_them(carries: bool) -> None:
    problem = Scaled(carries)
    first = first_of(problem, [-1.0], 0.5 + 0.1 * math.sqrt(3.0))
    branch = follow(problem, first, settings=Settings(points=200))
    assert len(problem.charts) > 1
    # facts stand before the last correction of at most 1e-5, a tenth of that in u, with a slope of at most 0.4
    for point in branch.points:
        assert (point.facts - 2.0) ** 2 + (point.p - 0.5) ** 2 == pytest.approx(0.04, abs=4e-7)
    assert branch.ended[1].kind == ("closed" if carries else "points")
    folds = [special.p for special in branch.specials if special.kind == "fold"]
    assert sorted(folds)[:: len(folds) - 1] == pytest.approx([0.3, 0.7], abs=1e-8)
    if carries:
        assert len(folds) == 2


@pytest.mark.parametrize(
    ("left", "right", "ends", "turns"),
    [(0.5, -0.5, 1.0, False), (0.5, 2.0, 0.0, True), (0.5, 100.0, 0.0, True), (0.5, -100.0, 1.0, False)],
)
def test_a_border_is_passed_where_the_branch_bends_or_turns(
    left: float, right: float, ends: float, turns: bool
) -> None:
    problem = bordered(left, right)
    branch = follow(problem, first_of(problem, [-0.5], 0.25), 1.0)
    assert kinds(branch) == ["grazing", "end"]
    grazing = branch.specials[0]
    assert grazing.name == "below to above"
    assert grazing.turns == turns
    assert abs(grazing.p - 0.5) <= grazing.error <= 2e-6
    assert branch.points[-1].p == ends
    assert branch.points[-1].u[0] == pytest.approx((ends - 0.5) / (1.0 - right), rel=1e-9)


def test_a_branch_that_jumps_is_lost_at_the_border() -> None:
    problem = bordered(0.5, 0.5, jump=0.2)
    branch = follow(problem, first_of(problem, [-0.5], 0.25), 1.0)
    assert branch.ended[1].kind == "lost"
    assert "at a border: below to above" in branch.ended[1].reason
    assert branch.points[-1].p == pytest.approx(0.5, abs=1e-5)


def test_a_branch_is_lost_where_the_motion_cannot_be_computed() -> None:
    class Edge(Problem):
        def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
            return "the shoe has lifted" if p > 0.6 else parabola(0.0).evaluate(u, p, with_parameter)

    problem = Edge()
    branch = follow(problem, first_of(problem, [0.5], 0.25), 1.0)
    assert branch.ended[1] == ("lost", "it is lost (the shoe has lifted)")
    assert branch.points[-1].p == pytest.approx(0.6, abs=1e-5)
    assert branch.specials[-1].kind == "end"


def test_budgets_and_interruptions_leave_the_points_found_so_far() -> None:
    problem = parabola(0.3)
    first = first_of(problem, [0.8], 0.94)
    by_points = follow(problem, first, -1.0, Settings(points=7))
    assert (by_points.ended[1].kind, len(by_points.points)) == ("points", 8)
    by_time = follow(problem, first, -1.0, Settings(seconds=0.0))
    assert (by_time.ended[1].kind, len(by_time.points)) == ("seconds", 1)

    calls = 0

    def stop() -> bool:
        nonlocal calls
        calls += 1
        return calls > 10

    interrupted = follow(problem, first, -1.0, stop=stop)
    assert interrupted.ended[1].kind == "interrupted"
    assert interrupted.unsearched
    assert 2 < len(interrupted.points) <= 11


def test_a_reason_of_the_caller_stops_the_branch() -> None:
    problem = parabola(0.3)
    first = first_of(problem, [0.2], 0.34)
    branch = follow(problem, first, 1.0, until=lambda point: "too large" if point.u[0] > 0.5 else None)
    assert branch.ended[1] == ("stopped", "too large")
    assert branch.points[-1].u[0] > 0.5 >= branch.points[-2].u[0]
