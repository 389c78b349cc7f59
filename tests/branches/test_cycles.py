"""Limit cycles on smooth pads: multipliers, folds, flips and flutter against another scheme and other formulas."""

import math
from itertools import islice

import numpy as np
import pytest

from brakecli.branches.line import Line
from brakecli.branches.point import Point
from brakecli.branches.sliding import Sliding
from tests.analysis.shoes import Array, Shoe
from tests.branches.phasewise import Phasewise, apart, differences, multipliers
from tests.branches.smooth_shoes import FRICTION, Followed, branches, changed, cycle_of, drawn, followed
from tests.campaign import counts
from tests.examples import make

pytestmark = pytest.mark.usefixtures("compiled")

PER_BRANCH = 20  # points looked at, spread along a branch
TOLD = 1e-4  # multipliers of a point are those of a place up to 1e-5 beside it
CLOSED = 1e-8


def spread(points: list[Point], number: int = PER_BRANCH) -> list[Point]:
    return [points[k] for k in sorted({round(k) for k in np.linspace(0, len(points) - 1, number)})] if points else []


def told(found: Followed, point: Point) -> bool | None:
    """Whether another scheme finds the cycle closed, with the multipliers and the stability of the point.

    None where even a difference of 3e-8 changes the sequence of phases: there is nothing to compare with.
    """
    motion, (state, period, scales) = found.motion(point.p), found.cycle(point)
    matrix = differences(motion, state, period, scales)
    if matrix is None:
        return None
    own = multipliers(motion, matrix, state, scales)
    # an error e of the place leaves a gap of up to |M - I| e
    gap = float(np.abs((motion(state, period).end - state) / scales).max()) / max(1.0, abs(own[0]))
    stable = point.stable == (abs(own[0]) < 1.0) or abs(abs(own[0]) - 1.0) < TOLD
    return gap < CLOSED and apart(point.multipliers, own) < TOLD and stable


@pytest.mark.parametrize("number", counts(2, 20, 100))
def test_multipliers_are_those_of_differences_of_another_scheme(number: int) -> None:
    """Points end with a correction of up to 1e-5 whose multipliers are not computed again.

    Beside a border, where they change like the square root of the distance, that may be more than 1e-4: such a point
    must agree once it has been corrected until it stands still. The one or other lies on the border itself.
    """
    compared, beside_border, wrong = 0, 0, 0
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


def settled(motion: Phasewise, state: Array, period: float) -> tuple[float, float]:
    """Amplitudes over spans of five periods: the last one, and the largest change among the last three."""
    seen: list[float] = []
    for _ in range(400):
        amplitude, state = swing(motion, state, 5.0 * period)
        seen.append(amplitude)
        if len(seen) > 3 and max(seen[-3:]) - min(seen[-3:]) < 1e-9 * seen[-1]:
            break
    return seen[-1], max(seen[-3:]) - min(seen[-3:])


DISPLACED = 1e-3


@pytest.mark.parametrize("number", counts(2, 12, 60))
def test_runs_beside_an_unstable_cycle_part_from_it_as_its_multiplier_says(number: int) -> None:
    """A displacement e along the eigenvector grows to λ e after a period, but for terms of the order of e².

    The second derivative is of the order of λ over the distance to the next fold or border, on which the two sides
    differ: their mean has the e² taken away. One side comes to less vibration than the cycle has, the other one to
    more, except where the cycle lies nearer than the displacement to a fold or a border.
    """
    seen = wrong = 0
    for found in branches(202, number):
        unstable = [
            point
            for point in found.inner
            if point.multipliers[0].imag == 0.0 and point.multipliers[0].real > 1.03 and abs(point.multipliers[1]) < 1.0
        ]
        for point in spread(unstable, 2):
            state, period, scales = found.cycle(point)
            motion = found.motion(point.p)
            modes = section(motion, state, period, scales)
            if modes is None:
                continue
            values, right, left = modes
            k = int(np.argmax(np.abs(values)))
            growth, along, across = values[k].real, right[:, k].real, left[k].real
            size = cycle_of(point).amplitude / scales[0]
            step = DISPLACED * size * along / np.abs(along).max()
            parts, ends = [], []
            for sign in (1.0, -1.0):
                moved = state + sign * step * scales
                after = motion(moved, period).end
                parts.append(across @ ((after - state) / scales) / (across @ (sign * step)))
                ends.append(settled(motion, moved, period)[0])
            seen += 1
            amplitude = cycle_of(point).amplitude
            grows = abs(0.5 * sum(parts) - growth) < 0.02 * growth
            parted = min(ends) < 0.999 * amplitude and max(ends) > 1.001 * amplitude
            wrong += not (grows and parted)
    assert seen > 0
    assert wrong <= 0.02 * seen


@pytest.mark.parametrize("number", counts(2, 12, 60))
def test_runs_beside_a_stable_cycle_return_to_it(number: int) -> None:
    """After n periods |λ|ⁿ of a displacement is left, times the condition of the eigenvectors."""
    seen = wrong = 0
    for found in branches(203, number):
        stable = [point for point in found.inner if point.stable and abs(point.multipliers[0]) < 0.97]
        for point in spread(stable, 2):
            state, period, scales = found.cycle(point)
            motion, chance = found.motion(point.p), np.random.default_rng(1)
            size = cycle_of(point).amplitude / scales[0]
            moved = state + DISPLACED * size * scales * chance.uniform(-1.0, 1.0, 4)
            wait = math.ceil(math.log(1e-7) / math.log(max(abs(point.multipliers[0]), 0.1))) + 3
            end = motion(moved, wait * period).end
            # the phase along the cycle is not restored: the end is compared with the cycle's nearest place
            seen += 1
            wrong += beside(motion, end, state, period, scales) > 1e-6 * size
    assert seen > 0
    assert wrong <= 0.02 * seen


def beside(motion: Phasewise, end: Array, state: Array, period: float, scales: Array) -> float:
    """How far a state lies from a cycle, in scales: from the nearest of its places, by Newton's method in time."""
    places, here = [], state
    for _ in range(200):
        places.append(here)
        here = motion(here, period / 200.0).end
    here = places[int(np.argmin([np.abs((place - end) / scales).max() for place in places]))]
    begin, time = here, 0.0
    for _ in range(6):
        speed, off = motion.speed(here) / scales, (end - here) / scales
        time += float(speed @ off) / float(speed @ speed)
        time %= period
        here = motion(begin, time).end if time > 0.0 else begin
    return float(np.abs((end - here) / scales).max())


def zeros(tables: dict[str, dict[str, float]], key: str, low: float, high: float) -> list[tuple[float, float, bool]]:
    """Where the growth of steady sliding passes zero: value, frequency (Hz) and whether it is lost there."""

    def rate(value: float) -> float:
        return float(Shoe.of(changed(tables, key, value)).modes[0].real)

    values, found = np.linspace(low, high, 400), []
    rates = [rate(float(value)) for value in values]
    for k in range(len(values) - 1):
        if (rates[k] > 0.0) != (rates[k + 1] > 0.0):
            a, b = float(values[k]), float(values[k + 1])
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
    """Eigenvalues are exact to rounding times their condition: near a defective pair they pass zero within 1e-9."""
    seen = {kind: 0 for kind in ("flutter", "divergence", "regained")}
    chance = np.random.default_rng(7)
    for k, (tables, critical) in enumerate(islice(drawn(304), number)):
        key = (FRICTION, *KEYS)[k % 7]
        if key == FRICTION:
            low, high = 0.0, 3.0 * critical
        else:
            tables = changed(tables, FRICTION, critical * chance.uniform(0.9, 1.2))
            table, name = key.split(".")
            value, (lower, upper) = tables[table].get(name, 0.0), RANGES.get(key, (0.3, 3.0))
            low, high = (value + lower, value + upper) if name == "angle_deg" else (value * lower, value * upper)
            if low == high:
                continue
        sliding = Sliding(Line(make(tables), [key], low, high))
        slides = sliding.along()
        valid = [slide.p for slide in slides if slide.eigenvalues is not None]
        if len(valid) < len(slides):
            continue  # somewhere there is no steady sliding in contact
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
