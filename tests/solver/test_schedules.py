"""Schedules in time and the arithmetic of twice the digits, against exact fractions."""

import math
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from brakecli.solver.double_double import add, multiply, split, two_product, two_sum
from brakecli.solver.schedules import Schedule, integral_at, schedule, slope_at, value_at
from brakecli.solver.schedules import knots as knots_of

EPS = 2.0**-52
doubles = st.floats(-1e120, 1e120).filter(lambda value: value == 0 or abs(value) > 1e-100)


def exact(pair: tuple[float, float]) -> Fraction:
    return Fraction(pair[0]) + Fraction(pair[1])


@st.composite
def pairs(draw: st.DrawFn) -> tuple[float, float]:
    """A sum of two doubles, the second at most half a unit in the last place of the first."""
    high = draw(doubles)
    return split(Fraction(high) + Fraction(math.ulp(high)) * Fraction(draw(st.floats(-0.5, 0.5))))


# --- arithmetic ----------------------------------------------------------------------------------------------


@given(doubles, doubles)
@example(1e120, -1e-100)
def test_two_sum_and_two_product_are_exact(a: float, b: float) -> None:
    assert exact(two_sum(a, b)) == Fraction(a) + Fraction(b)
    assert exact(two_product(a, b)) == Fraction(a) * Fraction(b)


@given(pairs(), pairs())
def test_add_keeps_32_digits_of_the_larger(a: tuple[float, float], b: tuple[float, float]) -> None:
    error = abs(exact(add(*a, *b)) - exact(a) - exact(b))
    # Two roundings of low parts, each 2^-53 of 2^-53: below 1e-31; 1e-30 is what the phases need.
    assert error <= Fraction(1e-30) * max(abs(exact(a)), abs(exact(b)))


@given(pairs(), pairs())
def test_multiply_keeps_32_digits(a: tuple[float, float], b: tuple[float, float]) -> None:
    # The product of the low parts is dropped and three sums round: below 8 * 2^-106 = 1e-31.
    assert abs(exact(multiply(*a, *b)) - exact(a) * exact(b)) <= Fraction(1e-30) * abs(exact(a) * exact(b))


@given(st.fractions(-(10**20), 10**20))
def test_split_is_the_nearest_pair(value: Fraction) -> None:
    high, low = split(value)
    assert high == float(value)
    assert abs(exact((high, low)) - value) <= Fraction(2.0**-106) * abs(value)


# --- schedules -----------------------------------------------------------------------------------------------

knots = st.lists(st.integers(-3000, 3000), min_size=1, max_size=6, unique=True).map(
    lambda numbers: [0.001 * number for number in sorted(numbers)]
)
values = st.floats(-1e3, 1e3).filter(lambda value: value == 0 or abs(value) > 1e-9)


@st.composite
def given_schedules(draw: st.DrawFn) -> tuple[list[float], list[float], float]:
    times = draw(knots)
    return times, [draw(values) for _ in times], draw(st.floats(0.1, 10))


Given = tuple[list[float], list[float], float]


def exact_value(given: Given, t: Fraction) -> Fraction:
    """The value by the definition: held outside the knots, linear between them."""
    times, heights, scale = given
    at = [
        (Fraction(time), Fraction(height) * Fraction(scale)) for time, height in zip(times, heights, strict=True)
    ]
    if t <= at[0][0]:
        return at[0][1]
    for (start, low), (end, high) in pairwise(at):
        if start <= t <= end:
            return low + (high - low) * (t - start) / (end - start)
    return at[-1][1]


def exact_integral(given: Given, t: Fraction) -> Fraction:
    """The integral from 0 to t: trapezia between all the knots on the way."""
    low = min(t, Fraction(0))
    high = max(t, Fraction(0))
    cuts = [low, *(Fraction(time) for time in given[0] if low < time < high), high]
    area = sum(
        ((exact_value(given, a) + exact_value(given, b)) / 2 * (b - a) for a, b in pairwise(cuts)), Fraction(0)
    )
    return area if t >= 0 else -area


@given(given_schedules(), st.floats(-5, 5))
def test_a_schedule_is_linear_between_its_knots_and_holds_outside(given_: Given, t: float) -> None:
    s = schedule(*given_)
    largest = max(map(abs, given_[1])) * given_[2]
    for time in (t, *given_[0]):
        # value + slope (t - knot): four roundings of terms that are at most twice the largest value.
        expected = float(exact_value(given_, Fraction(time)))
        assert value_at(s, time) == pytest.approx(expected, rel=0, abs=8 * EPS * largest)
    for (time, height), (after, later) in pairwise(zip(given_[0], given_[1], strict=True)):
        expected = float((Fraction(later) - Fraction(height)) * Fraction(given_[2]) / Fraction(after - time))
        middle = time + 0.5 * (after - time)
        assert (
            slope_at(s, time) == slope_at(s, middle) == pytest.approx(expected, rel=1e-11)
        )  # after - time rounds
    outside = (slope_at(s, given_[0][0] - 1e-9), slope_at(s, given_[0][-1]), slope_at(s, given_[0][-1] + 9.0))
    assert outside == (0.0, 0.0, 0.0)


@given(given_schedules(), st.floats(-1e6, 1e6) | st.floats(-5, 5), st.floats(-5, 5) | st.floats(-1e-12, 1e-12))
@example(([0.0, 1.0, 2.0], [1.0, 3.0, 0.0], 1.0), 0.5, 1.0)
def test_the_integral_is_exact_to_30_digits_wherever_the_time_lies(given_: Given, t: float, t_low: float) -> None:
    found = exact(integral_at(schedule(*given_), t, t_low))
    time = Fraction(t) + Fraction(t_low)
    largest = max(map(abs, given_[1])) * given_[2]
    # Sums and products of at most the largest value times the times that occur (3 s for the knots).
    scale = Fraction(largest) * (abs(Fraction(t)) + abs(Fraction(t_low)) + 6)
    assert abs(found - exact_integral(given_, time)) <= Fraction(1e-30) * scale


def test_equal_values_are_a_constant() -> None:
    assert (schedule((0.5, 1.0, 3.0), (4.0, 4.0, 4.0), 0.5) == schedule((0.0,), (2.0,))).all()


def test_a_schedule_is_one_contiguous_array_of_knots() -> None:
    s: Schedule = schedule([0.0, 1.0], [1.0, 2.0])
    assert s.flags.c_contiguous
    assert knots_of(s) == 2
