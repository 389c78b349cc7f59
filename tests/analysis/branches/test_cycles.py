"""Limit cycles on smooth pads: multipliers, folds, flips and flutter against another scheme and other formulas."""

import math
from itertools import islice
from typing import cast

import numpy as np
import pytest

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.point import Point
from brakecli.analysis.branches.problem import Doubled
from brakecli.analysis.branches.sliding import Sliding
from brakecli.analysis.branches.switch import switch
from tests.analysis.branches.phasewise import apart, differences, multipliers
from tests.analysis.branches.smooth_shoes import (
    FRICTION,
    Followed,
    branches,
    changed,
    drawn,
    followed,
)
from tests.analysis.shoes import Shoe, random_shoes
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


@pytest.mark.parametrize("number", counts(0, 10, 100))
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


@pytest.mark.parametrize("number", counts(0, 40, 200))
def test_branches_reach_the_end_of_the_range(number: int) -> None:
    lost = [
        found.branch.ended[1].reason for found in branches(707, number) if found.branch.ended[1].kind != "range"
    ]
    assert len(lost) <= 0.03 * number, lost


CORNERS = {
    (303, 178): "stick begins at flutter, growth is weak, and two short sticks lie just beyond the border",
    (404, 30): "stick begins during flight's decay, and the branch turns by more than a right angle",
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
