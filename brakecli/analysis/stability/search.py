"""Bisection: where the answer to a question changes between two values."""

import math
from collections.abc import Callable

HALVINGS = 45
"""After so many a bracket is 3e-14 of what it was, and the answers that find critical values are no surer."""


def bisect(
    as_below: Callable[[float], bool | None],
    low: float,
    high: float,
    *,
    width: float = 0.0,
    ratio: float = 1.0,
    halvings: int = 5000,
    geometric: bool = False,
) -> tuple[float, float]:
    """Narrow the bracket of a change: `as_below` is true where the answer is still that at `low`.

    It ends where the bracket is no wider than `width` or high / low no larger than `ratio`, after so many
    `halvings`, at neighbouring numbers, and where `as_below` answers None. `geometric`: both ends are positive.
    """
    for _ in range(halvings):
        middle = math.sqrt(low * high) if geometric else 0.5 * (low + high)
        if high - low <= width or high <= ratio * low or not low < middle < high:
            break
        answer = as_below(middle)
        if answer is None:
            break
        low, high = (middle, high) if answer else (low, middle)
    return low, high
