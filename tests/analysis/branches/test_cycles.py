"""Limit cycles on smooth pads: multipliers, folds, flips and flutter against another scheme and other formulas."""

import math
from itertools import islice
from typing import cast

import numpy as np
import pytest

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import Newton, Settings
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Doubled
from brakecli.analysis.branches.sliding import Sliding
from brakecli.analysis.branches.switch import switch
from tests.analysis.branches.phasewise import Phasewise, apart, differences, multipliers
from tests.analysis.branches.smooth_shoes import (
    FRICTION,
    Followed,
    branches,
    changed,
    cycle_of,
    drawn,
    followed,
    word_of,
)
from tests.analysis.shoes import Array, Shoe, random_shoes
from tests.campaign import campaign, counts
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")

PER_BRANCH = 20  # points looked at, spread along a branch
TOLD = 1e-4  # multipliers of a point are those of a place up to 1e-5 beside it
CLOSED = 1e-8


def spread(points: list[Point], number: int = PER_BRANCH) -> list[Point]:
    return (
        [points[k] for k in sorted({round(k) for k in np.linspace(0, len(points) - 1, number)})] if points else []
    )


def told(found: Followed, point: Point) -> bool | None:
    """Whether another scheme finds the cycle closed, with the multipliers and the stability of the point.

    None where even a difference of 3e-8 changes the sequence of phases: there is nothing to compare with.
    """
    motion = found.motion(point.p)
    state, period, scales = found.cycle(point)
    matrix = differences(motion, state, period, scales)
    if matrix is None:
        return None
    own = multipliers(motion, matrix, state, scales)
    # an error e of the place leaves a gap of up to |M - I| e
    gap = float(np.abs((motion(state, period).end - state) / scales).max()) / max(1.0, abs(own[0]))
    stable = point.stable == (abs(own[0]) < 1.0) or abs(abs(own[0]) - 1.0) < TOLD
    return gap < CLOSED and apart(point.multipliers, own) < TOLD and stable


@pytest.mark.parametrize("number", counts(0, 20, 100))
def test_multipliers_are_those_of_differences_of_another_scheme(number: int) -> None:
    """Points end with a correction of up to 1e-5 whose multipliers are not computed again.

    Beside a border, where they change like the square root of the distance, that may be more than 1e-4: such a
    point must agree once it has been corrected until it stands still. One or other lies on the border itself.
    """
    compared = 0
    beside_border = 0
    wrong = 0
    for found in branches(101, number):
        for point in spread(found.branch.points[1:]):
            agrees = told(found, point)
            compared += agrees is not None
            if agrees is False:
                beside_border += 1
                better = found.refined(point)
                wrong += better is None or told(found, better) is False
    assert compared >= 0.85 * PER_BRANCH * number
    assert beside_border <= 0.03 * compared + 2.0
    assert wrong <= 0.001 * compared


def section(motion: Phasewise, state: Array, period: float, scales: Array) -> tuple[Array, Array, Array] | None:
    """Multipliers, right and left eigenvectors of the period's derivative, in scales; the flow's own one is 1."""
    matrix = differences(motion, state, period, scales)
    if matrix is None:
        return None
    values, right = np.linalg.eig(matrix)
    return values, right, np.linalg.inv(right)


def swing(motion: Phasewise, state: Array, span: float) -> tuple[float, Array]:
    """Half of peak to peak of x in a span, and the state at its end."""
    way = motion(state, span)
    return 0.5 * float(way.high[0] - way.low[0]), way.end


def settled(motion: Phasewise, state: Array, period: float) -> float:
    """The amplitude over five periods to which a motion comes, or after two thousand."""
    before = math.inf
    for _ in range(400):
        amplitude, state = swing(motion, state, 5.0 * period)
        if abs(amplitude - before) < 1e-9 * amplitude:
            break
        before = amplitude
    return amplitude


DISPLACED = 1e-3


@pytest.mark.parametrize("number", counts(0, 12, 60))
def test_runs_beside_an_unstable_cycle_part_from_it_as_its_multiplier_says(number: int) -> None:
    """A displacement e along the eigenvector grows to λ e after a period, but for terms of the order of e².

    The mean of the two sides has the e² taken away. Neither side comes back. They come to different motions below
    the flutter; beyond it, steady sliding grows to where the other side comes too. Cycles are left out with a
    border nearer than the displacement, behind which the derivative is another one.
    """
    seen = wrong = 0
    for found in branches(202, number):
        unstable = [
            point
            for point in found.inner
            if point.multipliers[0].imag == 0.0
            and point.multipliers[0].real > 1.03
            and abs(point.multipliers[1]) < 1.0
        ]
        for point in spread(unstable, 2):
            state, period, scales = found.cycle(point)
            motion = found.motion(point.p)
            modes = section(motion, state, period, scales)
            if modes is None:
                continue
            values, right, left = modes
            k = int(np.argmax(np.abs(values)))
            growth = values[k].real
            along = right[:, k].real
            across = left[k].real
            amplitude = cycle_of(point).amplitude
            step = DISPLACED * amplitude / scales[0] * along / np.abs(along).max()
            word = motion(state, period).word
            parts = []
            begins = []
            for sign in (1.0, -1.0):
                begins.append(state + sign * step * scales)
                after = motion(begins[-1], period)
                if after.word != word:
                    break
                parts.append(across @ ((after.end - state) / scales) / (across @ (sign * step)))
            if len(parts) < 2:
                continue
            one, other = (settled(motion, begin, period) for begin in begins)
            gaps = [abs(one - amplitude), abs(other - amplitude)]
            if point.p < found.flutter.p:
                gaps.append(abs(one - other))
            seen += 1
            grows = abs(0.5 * sum(parts) - growth) < 0.01 * growth
            wrong += not (grows and min(gaps) > DISPLACED * amplitude)
    assert seen > 0
    assert wrong <= 0.02 * seen


@pytest.mark.parametrize("number", counts(0, 12, 60))
def test_runs_beside_a_stable_cycle_return_to_it(number: int) -> None:
    """After n periods |λ|ⁿ of a displacement is left, times the condition of the eigenvectors.

    The displacement is so small that it leaves the sequence of phases of 20 periods as it is.
    """
    seen = wrong = 0
    for found in branches(203, number):
        stable = [point for point in found.inner if point.stable and abs(point.multipliers[0]) < 0.97]
        for point in spread(stable, 2):
            state, period, scales = found.cycle(point)
            motion = found.motion(point.p)
            chance = np.random.default_rng(1)
            size = cycle_of(point).amplitude / scales[0]
            away = size * scales * chance.uniform(-1.0, 1.0, 4)
            word = motion(state, 20.0 * period).word
            sizes = DISPLACED, 1e-4, 1e-5
            near = [part for part in sizes if motion(state + part * away, 20.0 * period).word == word]
            if not near:
                continue  # a border lies nearer
            moved = state + near[0] * away
            wait = math.ceil(math.log(1e-7) / math.log(max(abs(point.multipliers[0]), 0.1))) + 3
            end = motion(moved, wait * period).end
            # the phase along the cycle is not restored: the end is compared with the cycle's nearest place
            seen += 1
            wrong += beside(motion, end, state, period, scales) > 1e-6 * size
    assert seen > 0
    assert wrong <= 0.02 * seen


def beside(motion: Phasewise, end: Array, state: Array, period: float, scales: Array) -> float:
    """How far a state lies from a cycle, in scales: from the nearest of its places, by Newton's method in time."""
    places = []
    here = state
    for _ in range(200):
        places.append(here)
        here = motion(here, period / 200.0).end
    here = places[int(np.argmin([np.abs((place - end) / scales).max() for place in places]))]
    begin = here
    time = 0.0
    for _ in range(6):
        speed = motion.speed(here) / scales
        off = (end - here) / scales
        time += float(speed @ off) / float(speed @ speed)
        time %= period
        here = motion(begin, time).end if time > 0.0 else begin
    return float(np.abs((end - here) / scales).max())


def zeros(
    tables: dict[str, dict[str, float]], key: str, low: float, high: float
) -> list[tuple[float, float, bool]]:
    """Where the growth of steady sliding passes zero: value, frequency (Hz) and whether it is lost there."""

    def rate(value: float) -> float:
        return float(Shoe.of(changed(tables, key, value)).modes[0].real)

    values = np.linspace(low, high, 400)
    found = []
    rates = [rate(float(value)) for value in values]
    for k in range(len(values) - 1):
        if (rates[k] > 0.0) != (rates[k + 1] > 0.0):
            a = float(values[k])
            b = float(values[k + 1])
            for _ in range(60):
                middle = 0.5 * (a + b)
                a, b = (middle, b) if (rate(middle) > 0.0) == (rates[k] > 0.0) else (a, middle)
            mode = Shoe.of(changed(tables, key, b)).modes[0]
            found.append((a, abs(float(mode.imag)) / (2.0 * math.pi), rates[k] <= 0.0))
    return found


KEYS = "wheel.angular_speed", "load.force", "link2.angle_deg", "contact.stiffness", "shoe.mass", "link1.damping"
RANGES = {"link2.angle_deg": (-40.0, 40.0), "link1.damping": (0.05, 20.0)}


@pytest.mark.parametrize("number", counts(6, 60, 300))
def test_steady_sliding_changes_where_the_eigenvalues_of_another_formula_do(number: int) -> None:
    """Eigenvalues are exact to rounding times their condition: so zeros agree within 1e-9."""
    seen = dict.fromkeys(("flutter", "divergence", "regained"), 0)
    chance = np.random.default_rng(7)
    for k, (tables, critical) in enumerate(islice(drawn(304), number)):
        key = (FRICTION, *KEYS)[k % 7]
        if key == FRICTION:
            low = 0.0
            high = 3.0 * critical
        else:
            tables = changed(tables, FRICTION, critical * chance.uniform(0.9, 1.2))
            table, name = key.split(".")
            value = tables[table].get(name, 0.0)
            lower, upper = RANGES.get(key, (0.3, 3.0))
            low, high = (value + lower, value + upper) if name == "angle_deg" else (value * lower, value * upper)
            if low == high:
                continue
        sliding = Sliding(Line(make(tables), [key], low, high))
        slides = sliding.along()
        if any(slide.signs is None for slide in slides):
            continue  # somewhere sliding leaves the pad open
        own = zeros(tables, key, low, high)
        changes = sliding.changes(slides)
        assert len(changes) == len(own), (k, key)
        for change, (value, frequency, lost) in zip(changes, own, strict=True):
            assert change.p == pytest.approx((value - low) / (high - low), abs=1e-9), (k, key)
            assert change.lost == lost
            assert (change.kind == "flutter") == (frequency > 0.0)
            assert change.frequency == pytest.approx(frequency, rel=1e-6)
            seen[change.kind] += 1
            seen["regained"] += not lost
    assert seen["flutter"] > 0
    if number > 50:
        assert all(seen.values())


@pytest.mark.parametrize("number", counts(0, 20, 60))
def test_both_sheets_meet_at_a_fold_like_a_square_root_and_no_cycle_is_left_beyond_it(number: int) -> None:
    """Four times as far from the fold the sheets lie twice as far apart, but for the next term of the series.

    A run from the cycle of the fold, a little beyond the fold, passes the place where the cycle was and goes away.
    """
    seen = 0
    for found in branches(204, number):
        for fold in found.branch.specials:
            if fold.kind != "fold" or len(set(word_of(fold.point))) < 2 or not 0.05 < fold.p < 0.95:
                continue
            sheets = beside_fold(found, fold.point)
            if sheets is None:
                continue  # a border or another fold lies nearer
            seen += 1
            near, far = sheets
            side = math.copysign(1.0, sheets[0][0].p - fold.p)
            apart_near, apart_far = (np.abs(b.z - a.z).max() for a, b in (near, far))
            assert apart_far == pytest.approx(2.0 * apart_near, rel=0.05)
            gaps = [abs(cycle_of(b).period - cycle_of(a).period) for a, b in (near, far)]
            assert gaps[1] == pytest.approx(2.0 * gaps[0], rel=0.1, abs=1e-9 * cycle_of(fold.point).period)
            state, period, scales = found.cycle(fold.point)
            gap = np.abs((found.motion(fold.p)(state, period).end - state) / scales).max()
            missing = found.motion(fold.p - side * abs(near[0].p - fold.p))
            state = state + np.append(
                missing_rest(found, fold.p, fold.p - side * abs(near[0].p - fold.p)), [0.0, 0.0]
            )
            assert np.abs((missing(state, period).end - state) / scales).max() > 100.0 * gap
            assert fold.error < 1e-7
    assert seen > 0


def missing_rest(found: Followed, here: float, there: float) -> Array:
    """How far steady sliding moves from one p to another."""
    return np.asarray(found.shoe(there).rest - found.shoe(here).rest)


def beside_fold(found: Followed, fold: Point) -> tuple[tuple[Point, Point], tuple[Point, Point]] | None:
    """Both sheets at two places, the second one four times as far from the fold; None if a word changes."""
    found.cycles.use(fold.chart)
    newton = Newton(found.cycles, Settings(exact=1e-11))
    pairs = []
    for length in (5e-3, 1e-2):
        points = [
            newton.solve(fold.z + way * length * fold.tangent, fold.tangent, fold.tangent, 0.0, exact=True)
            for way in (1.0, -1.0)
        ]
        if points[0] is None or points[1] is None or {points[0].word, points[1].word} != {fold.word}:
            return None
        p = points[0].p
        other = newton.at_parameter(points[1].z, p, -points[1].tangent, 0.0, exact=True)
        if other is None or other.word != fold.word:
            return None
        pairs.append((points[0], other))
    near, far = pairs
    if abs((far[0].p - fold.p) / (near[0].p - fold.p) - 4.0) > 0.1:
        return None  # not yet the parabola of the fold
    return near, far


@pytest.mark.parametrize("number", counts(0, 40, 200))
def test_branches_reach_the_end_of_the_range(number: int) -> None:
    lost = [
        found.branch.ended[1].reason for found in branches(707, number) if found.branch.ended[1].kind != "range"
    ]
    assert len(lost) <= 0.03 * number, lost


CORNERS = {
    (303, 89): "stick begins at flutter, and growth is weak",
    (303, 166): "the same",
    (303, 178): "the same, with two short sticks just beyond the border",
    (404, 30): "stick begins during flight's decay, and the branch turns by more than a right angle",
    (404, 155): "the same beyond a fold",
}


@pytest.mark.parametrize(("seed", "which"), CORNERS)
@campaign
def test_a_branch_goes_on_beyond_a_sharp_corner(seed: int, which: int) -> None:
    tables = next(islice(random_shoes("smooth", seed), which, None))
    critical = Shoe.of(tables).critical
    assert critical is not None
    found = followed(tables, FRICTION, 0.0, 2.0 * critical)
    assert found is not None
    assert found.branch.ended[1].kind == "range"
    assert "branch point" not in {special.kind for special in found.branch.specials}


@campaign
def test_the_motion_of_a_flip_closes_after_two_periods_and_not_after_one() -> None:
    """Its displacement from the flip is 3e-4 at least, and the single period carries it to the other side."""
    seen = 0
    for found in islice(branches(205, 18), 17, None):
        for flip in found.branch.specials:
            if flip.kind != "flip":
                continue
            new = switch(cast(Doubled, Cycles(found.line, 2)), flip.point)
            assert new is not None
            state, period, scales = found.cycle(new)
            motion = found.motion(new.p)
            twice, once = (
                np.abs((motion(state, part * period).end - state) / scales).max() for part in (1.0, 0.5)
            )
            assert twice < CLOSED
            assert once > 3e-4
            seen += 1
    assert seen == 2
