"""Special points of branches against closed forms."""

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.explore import crossed, passes
from brakecli.analysis.branches.follow import MET_ANOTHER, both_ways, follow
from brakecli.analysis.branches.newton import Newton, Settings, start
from brakecli.analysis.branches.point import Branch, Special
from brakecli.analysis.branches.switch import switch
from tests.analysis.branches.problems import Given, Orbits, Roots, bubble, delayed_logistic, logistic
from tests.analysis.branches.test_follow import first_of, kinds, parabola


def located(branch: Branch, kind: str) -> list[Special]:
    return [special for special in branch.specials if special.kind == kind]


def cubic(a: float) -> Roots:
    """p = 0.5 + u³ - a u: a cusp at a = 0."""
    return Roots(
        lambda u, p: [p - 0.5 - u[0] ** 3 + a * u[0]], lambda u, p: [[a - 3.0 * u[0] ** 2]], lambda u, p: [1.0]
    )


def test_a_fold_is_located_to_a_hundred_millionth_of_the_range() -> None:
    problem = parabola(0.3)
    branch = both_ways(problem, first_of(problem, [0.5], 0.55))
    (fold,) = located(branch, "fold")
    assert fold.p == pytest.approx(0.3, abs=1e-8)
    assert fold.turns
    assert fold.error < 1e-8
    assert [point.stable for point in branch.points] == [point.u[0] > 1e-9 for point in branch.points]


@pytest.mark.parametrize("a", [0.3, 0.03, 1e-3, 1e-4])
def test_both_folds_of_a_cusp_are_found_however_near(a: float) -> None:
    problem = cubic(a)
    branch = follow(problem, first_of(problem, [-0.7], 0.5 - 0.343 + 0.7 * a))
    expected = [0.5 + s * 2.0 * a / 3.0 * math.sqrt(a / 3.0) for s in (1, -1)]
    assert [fold.p for fold in located(branch, "fold")] == pytest.approx(expected, abs=1e-8)
    assert branch.points[-1].p == 1.0


def test_a_transcritical_point_is_a_branch_point_of_both_branches() -> None:
    problem = Roots(
        lambda u, p: [u[0] * (p - 0.4 - u[0])], lambda u, p: [[p - 0.4 - 2.0 * u[0]]], lambda u, p: [u[0]]
    )
    for u in (0.0, -0.3):
        branch = follow(problem, first_of(problem, [u], 0.1))
        assert kinds(branch) == ["branch point", "end"]
        point = branch.specials[0]
        assert abs(point.p - 0.4) < 1e-6
        assert not point.turns
        beside = crossed(problem, branch)
        assert len(beside) == 2
        for motion in beside:  # on the other one, near by
            assert motion.u[0] == pytest.approx(motion.p - 0.4 if u == 0.0 else 0.0, abs=1e-12)
            assert 0.0 < abs(motion.p - 0.4) < 0.05


def nearly_met(gap: float) -> Roots:
    """A pitchfork with a gap: u (p - 0.4 - u²) + gap = 0; one sheet folds at p = 0.4 + 3 (gap/2)^(2/3)."""
    return Roots(
        lambda u, p: [u[0] * (p - 0.4 - u[0] ** 2) + gap],
        lambda u, p: [[p - 0.4 - 3.0 * u[0] ** 2]],
        lambda u, p: [u[0]],
    )


def test_the_sheets_that_a_branch_crosses_or_nearly_meets_are_found_on_both_sides() -> None:
    """A gap that is far narrower than the step over it: the walk goes on straight, and finds what lies aside."""
    for gap in (0.0, 1e-9, -1e-9):
        problem = nearly_met(gap)
        branch = follow(problem, first_of(problem, [0.0], 0.1))
        followed: Any = SimpleNamespace(branch=branch, problem=problem)
        assert kinds(branch)[0] == "branch point"
        beside = crossed(problem, branch)
        assert sorted(math.copysign(1.0, motion.u[0]) for motion in beside) == [-1.0, 1.0]
        for motion in beside:
            assert motion.p == pytest.approx(0.4 + motion.u[0] ** 2 - gap / motion.u[0], abs=1e-9)
            assert not passes(followed, motion)


def test_a_branch_ends_where_it_comes_along_one_that_is_followed() -> None:
    problem = parabola(0.3)
    known = both_ways(problem, first_of(problem, [0.5], 0.55)).points
    for sign in (1.0, -1.0):
        branch = follow(problem, first_of(problem, [0.2], 0.34), sign, known=known)
        assert branch.ended[1] == MET_ANOTHER
        assert len(branch.points) < 20
    other = parabola(0.2)
    assert follow(other, first_of(other, [0.2], 0.24), known=known).ended[1].kind == "range"


@pytest.mark.parametrize("gap", [1e-5, -1e-5, 1e-4, 1e-3])
def test_a_branch_does_not_jump_to_a_sheet_that_it_nearly_meets(gap: float) -> None:
    """It leads to the root on its side. Where a stride had come to the other sheet, the motion there is told."""
    problem = nearly_met(gap)
    branch = follow(problem, first_of(problem, [0.0], 0.1))
    assert kinds(branch) == ["end"]
    largest = max(np.roots([1.0, 0.0, -0.6, -abs(gap)]).real)
    assert branch.points[-1].u[0] == pytest.approx(math.copysign(largest, gap), abs=1e-9)
    assert (abs(gap) < 1e-4) is bool(branch.aside)
    followed: Any = SimpleNamespace(branch=branch, problem=problem)
    for other in branch.aside:
        assert other.u[0] * gap < 0.0
        assert not passes(followed, other)
    for one, other in pairwise(branch.points):
        between = Newton(problem, Settings()).between(one, other, 0.3)
        assert between is not None
        assert passes(followed, between)


@pytest.mark.parametrize("gap", [0.0, 1e-12, -1e-10, 1e-9])
def test_a_gap_that_is_narrower_than_any_range_shows_is_a_branch_point(gap: float) -> None:
    """Up to 1e-9 it is 2e-6 of the range: the straight sheet loses its stability there, within the error told."""
    problem = nearly_met(gap)
    branch = follow(problem, first_of(problem, [0.0], 0.1))
    assert kinds(branch) == ["branch point", "end"]
    gap_in_p = 3.0 * (abs(gap) / 2.0) ** (2.0 / 3.0)
    assert abs(branch.specials[0].p - 0.4) <= branch.specials[0].error + gap_in_p
    assert branch.points[-1].u[0] == pytest.approx(0.0, abs=1e-8)
    assert not branch.points[-1].stable


def test_the_logistic_map_doubles_at_3_and_at_1_plus_the_root_of_6() -> None:
    once = Orbits(logistic, 2.5, 4.0)
    twice = Orbits(logistic, 2.5, 4.0, 2)
    (flip,) = located(both_ways(once, first_of(once, [0.6], 0.0)), "flip")
    assert once.value(flip.p) == pytest.approx(3.0, abs=1e-8)
    doubled = switch(twice, flip.point)
    assert doubled is not None
    assert abs(doubled.u[0] - doubled.u[1]) > 1e-4
    assert doubled.stable
    branch = follow(twice, doubled, None)
    (second,) = located(branch, "flip")
    assert twice.value(second.p) == pytest.approx(1.0 + math.sqrt(6.0), abs=1e-8)
    # the two places of the doubled orbit are the roots of r² x² - r (r + 1) x + r + 1
    for point in branch.points:
        r = twice.value(point.p)
        root = math.sqrt((r - 3.0) * (r + 1.0))
        assert sorted(point.u) == pytest.approx(
            [(r + 1.0 - root) / (2.0 * r), (r + 1.0 + root) / (2.0 * r)], abs=1e-8
        )


def test_a_doubled_branch_ends_where_it_meets_the_motion_of_half_its_period_again() -> None:
    """A half of the circle x² + r² = 1: the other half is the same motions, half of their period later."""
    once = Orbits(bubble, -1.5, 1.5)
    twice = Orbits(bubble, -1.5, 1.5, 2)
    flips = located(both_ways(once, first_of(once, [0.0], 0.5)), "flip")
    assert [once.value(flip.p) for flip in flips] == pytest.approx([-1.0, 1.0], abs=1e-8)
    for flip, other in (flips, flips[::-1]):
        first = switch(twice, flip.point)
        assert first is not None
        branch = follow(twice, first, None)
        assert [end.kind for end in branch.ended] == ["start", "halved"]
        assert [special.kind for special in branch.specials] == ["end"]
        assert branch.points[-1].p == pytest.approx(other.p, abs=1e-8)
        for point in branch.points:
            assert point.u[0] * first.u[0] > 0.0
            assert point.u[0] ** 2 + twice.value(point.p) ** 2 == pytest.approx(1.0, abs=1e-6)
            assert point.u[1] == pytest.approx(-point.u[0], abs=1e-6)
        assert branch.points[-1].s > 1.0


def test_the_delayed_logistic_map_has_a_torus_at_2() -> None:
    problem = Orbits(delayed_logistic, 1.5, 2.2)
    branch = both_ways(problem, first_of(problem, [0.4, 0.4], 0.2))
    assert kinds(branch) == ["end", "torus", "end"]
    torus = branch.specials[1]
    assert problem.value(torus.p) == pytest.approx(2.0, abs=1e-9)
    expected = [complex(0.5, math.sqrt(0.75)), complex(0.5, -math.sqrt(0.75))]
    assert sorted(torus.point.multipliers, key=lambda value: -value.imag) == pytest.approx(expected, abs=1e-9)


def test_a_neutral_saddle_is_not_a_torus() -> None:
    saddle = Given(lambda p: [[1.5 + p, 0.0, 0.0], [0.3, 0.5, 0.0], [0.0, 0.1, 0.2]])
    assert kinds(follow(saddle, first_of(saddle, [0.0], 0.0))) == ["end"]


def window(half: float, sign: float, centre: float = 0.4321) -> Given:
    """A multiplier that passes -1 at centre ± half and stays near -1.05 or -0.95 far away."""
    top = math.exp(-((half / 0.05) ** 2))
    return Given(
        lambda p: [[-1.0 + sign * 0.3 * (math.exp(-(((p - centre) / 0.05) ** 2)) - top), 0.0], [0.0, 0.5]]
    )


@pytest.mark.parametrize(("sign", "width"), [(1.0, 1.0 / 200.0), (-1.0, 1.0 / 2000.0), (1.0, 1.0 / 8000.0)])
def test_two_flips_in_a_narrow_window_are_found(width: float, sign: float) -> None:
    problem = window(0.5 * width, sign)
    branch = follow(problem, first_of(problem, [0.0], 0.0))
    assert [flip.p for flip in located(branch, "flip")] == pytest.approx(
        [0.4321 - 0.5 * width, 0.4321 + 0.5 * width], abs=1e-8
    )
    assert len(branch.points) < 150


def test_a_window_that_just_does_not_open_is_not_reported() -> None:
    closed = Given(lambda p: [[-1.0 - 1e-7 - 0.3 * (1.0 - math.exp(-(((p - 0.4321) / 0.05) ** 2)))]])
    assert kinds(follow(closed, first_of(closed, [0.0], 0.0))) == ["end"]


def test_a_window_of_an_unstable_motion_is_found_only_everywhere() -> None:
    # a second multiplier of 3 keeps the motion unstable, whatever the first one does
    inner = window(1.0 / 4000.0, 1.0)
    problem = Given(lambda p: [[inner.maps(p)[0][0], 0.0], [0.0, 3.0]])
    first = first_of(problem, [0.0], 0.0)
    assert located(follow(problem, first), "flip") == []
    assert len(located(follow(problem, first, settings=Settings(everywhere=True)), "flip")) == 2


def test_multipliers_of_an_area_preserving_map_raise_no_alarm() -> None:
    still = Given(lambda p: [[math.cos(1.0 + p), -math.sin(1.0 + p)], [math.sin(1.0 + p), math.cos(1.0 + p)]])
    branch = follow(still, first_of(still, [0.0], 0.0))
    assert kinds(branch) == ["end"]
    assert len(branch.points) < 60


@pytest.mark.parametrize("width", [1.0 / 200.0, 1.0 / 2000.0])
def test_a_word_that_holds_only_between_two_points_is_found_by_its_margin(width: float) -> None:
    half = 0.5 * width
    problem = Given(lambda p: [[0.5]], margin=lambda p: math.cosh(3.0 * (p - 0.4321)) - math.cosh(3.0 * half))
    branch = follow(problem, first_of(problem, [0.0], 0.0))
    grazing = located(branch, "grazing")
    assert [special.p for special in grazing] == pytest.approx([0.4321 - half, 0.4321 + half], abs=1e-6)
    # half of the bracket of 1e-6, and its length times the slope
    assert all(special.error <= 1.5e-6 for special in grazing)
    assert len(branch.points) < 100


def test_a_fold_at_the_first_point_is_located_once() -> None:
    problem = parabola(0.3)
    first = start(problem, np.array([1e-9]), 0.3, np.array([1.0, 0.0]))
    assert first is not None
    branch = both_ways(problem, first)
    assert kinds(branch) == ["end", "fold", "end"]
    assert branch.specials[1].p == pytest.approx(0.3, abs=1e-8)
    assert [branch.points[0].p, branch.points[-1].p] == [1.0, 1.0]


def test_a_branch_point_behind_the_first_point_is_located_once() -> None:
    problem = Roots(
        lambda u, p: [u[0] * (p - 0.4 - u[0])], lambda u, p: [[p - 0.4 - 2.0 * u[0]]], lambda u, p: [u[0]]
    )
    assert kinds(both_ways(problem, first_of(problem, [0.0], 0.7))) == ["end", "branch point", "end"]
