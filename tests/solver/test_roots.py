"""The bracketed root against closed forms, and against another implementation."""

import math
from collections.abc import Callable

import pytest

from brakecli.solver.roots import bracketed_root

CASES: list[tuple[Callable[[float], float], float, float, float]] = [
    (lambda x: x * x - 2.0, 0.0, 2.0, math.sqrt(2.0)),
    (lambda x: 2.0 - x * x, 0.0, 2.0, math.sqrt(2.0)),
    (lambda x: math.cos(x) - 0.5, 0.0, 3.0, math.pi / 3.0),
    (lambda x: math.exp(x) - 1e-8, -40.0, 1.0, math.log(1e-8)),
    (lambda x: x**9, -1.0, 2.0, 0.0),
    (lambda x: math.copysign(1.0, x - 0.3), 0.0, 1.0, 0.3),
    (lambda x: 1e-200 * (x - 1.0), 0.0, 7.0, 1.0),
    (lambda x: x - 1e-300, 0.0, 1.0, 1e-300),
]


@pytest.mark.parametrize("case", CASES)
def test_a_root_is_where_closed_forms_say(case: tuple[Callable[[float], float], float, float, float]) -> None:
    function, low, high, root = case
    for ends in ((low, high), (high, low)):
        calls: list[float] = []

        def counted(x: float, calls: list[float] = calls) -> float:
            calls.append(x)
            return function(x)

        # as far off as asked for, and a unit of rounding of the function
        assert abs(bracketed_root(counted, *ends, absolute=1e-12) - root) <= 1e-12 + 5.0 * math.ulp(root)
        assert all(min(ends) <= x <= max(ends) for x in calls)
        assert len(calls) <= 90  # twice the halves of 7 to 1e-12


def test_an_end_at_which_the_function_is_zero_is_the_root() -> None:
    assert bracketed_root(lambda x: x, 0.0, 1.0) == 0.0
    assert bracketed_root(lambda x: x - 1.0, 0.0, 1.0) == 1.0
    assert bracketed_root(lambda x: x, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("values", [(1.0, 2.0), (-1.0, -2.0), (math.nan, 1.0), (1.0, math.nan)])
def test_ends_of_one_sign_are_refused(values: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=r"no root between 0\.0 and 1\.0"):
        bracketed_root(lambda x: values[int(x)], 0.0, 1.0)
