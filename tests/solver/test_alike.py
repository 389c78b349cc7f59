"""What is computed at once where it is alike, and histories in rows."""

import numpy as np

from brakecli.solver.alike import at_once
from brakecli.solver.history import array_history, stacked
from brakecli.solver.quantities import HISTORY


def test_each_gets_what_is_found_for_it_and_those_that_are_like_nothing_get_nothing() -> None:
    asked = list[list[int]]()

    def squares(places: list[int]) -> list[int]:
        asked.append(places)
        return [place**2 for place in places]

    assert at_once(["a", None, "b", "a", "b", None], squares) == [0, None, 4, 9, 16, None]
    assert asked == [[0, 3], [2, 4]]
    assert at_once([], squares) == []


def test_histories_in_rows_hold_the_samples_of_each() -> None:
    rows = np.random.default_rng(1).normal(size=(3, 50, len(HISTORY)))
    histories = [array_history(1e-4, each) for each in rows]
    for some in (histories, histories[:1]):
        both = stacked(some)
        assert (both.interval, both.samples) == (1e-4, 50)
        for name in HISTORY:
            expected = [each.read(name, 7, 31).tolist() for each in some]
            assert both.read(name, 7, 31).tolist() == expected
