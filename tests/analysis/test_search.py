"""Bisection, held against roots that are known."""

import math

import pytest

from brakecli.analysis.stability.search import bisect


def below_root_of_two(value: float) -> bool:
    return value * value < 2.0


def test_without_a_limit_the_bracket_ends_at_neighbouring_numbers() -> None:
    low, high = bisect(below_root_of_two, 1.0, 2.0)
    assert low * low < 2.0 <= high * high
    assert high == math.nextafter(low, math.inf)


@pytest.mark.parametrize("width", [0.3, 1e-3, 1e-9])
def test_the_bracket_is_halved_until_it_is_narrow_enough(width: float) -> None:
    low, high = bisect(below_root_of_two, 1.0, 2.0, width=width)
    assert low < math.sqrt(2.0) < high
    assert 0.5 * width < high - low <= width


def test_a_number_of_halvings_gives_a_bracket_of_that_part() -> None:
    low, high = bisect(lambda value: value < -0.3, -1.0, 0.0, halvings=10)
    assert low < -0.3 <= high
    assert high - low == 2.0**-10


def test_geometric_midpoints_halve_the_logarithm_of_the_ratio() -> None:
    low, high = bisect(lambda value: value < 3e-7, 1e-12, 1.0, halvings=8, geometric=True)
    assert low < 3e-7 <= high
    assert math.log(high / low) == pytest.approx(math.log(1e12) / 2**8, rel=1e-12)
    low, high = bisect(lambda value: value < 3e-7, 1e-12, 1.0, ratio=1.001, geometric=True)
    assert low < 3e-7 <= high
    assert math.sqrt(1.001) < high / low <= 1.001


def test_an_answer_that_is_not_known_ends_the_search_with_the_bracket_it_has() -> None:
    asked = []

    def answer(value: float) -> bool | None:
        asked.append(value)
        return None if value == 0.625 else value < 0.7

    assert bisect(answer, 0.0, 1.0) == (0.5, 0.75)
    assert asked == [0.5, 0.75, 0.625]
