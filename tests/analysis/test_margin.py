"""Where a margin passes zero: polynomials with known roots, rounding, and values at which there is none."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from brakecli.analysis.stability.certain import Rounded
from brakecli.analysis.stability.margin import Change, Margin, between, between_known, changes, joined, left_open

VALUES = np.linspace(0.0, 1.0, 17).tolist()


def of(*terms: Sequence[float], error: float = 1e-15) -> Margin:
    """A margin of products of (x - root)."""

    def signs(x: float) -> list[Rounded]:
        return [Rounded(math.prod(x - root for root in roots), error) for roots in terms]

    return signs


@pytest.mark.parametrize(
    ("terms", "values", "sides"),
    [
        ([(0.3, 0.7)], [0.3, 0.7], [(True, 0), (False, 0)]),
        ([(-1.0,), (0.2,), (0.9, 0.4)], [0.2, 0.4, 0.9], [(False, 1), (True, 2), (False, 2)]),
    ],
)
def test_each_root_is_a_change_and_its_place_says_what_passes(
    terms: list[tuple[float, ...]], values: list[float], sides: list[tuple[bool, int]]
) -> None:
    found = list(changes(of(*terms), VALUES))
    assert [each.value for each in found] == pytest.approx(values, abs=1e-14)
    assert [(each.lost, each.which) for each in found] == sides
    assert all(0.0 < each.error < 1e-13 for each in found)


def test_a_window_between_two_values_is_found() -> None:
    """It is a thousandth of a step wide. Its slope is 6e-5 where it begins: 1e-15 are 1.7e-11 of the value."""
    low = 0.51
    found = list(changes(of((low, low + 6e-5)), VALUES))
    assert [each.value for each in found] == pytest.approx([low, low + 6e-5], abs=1.7e-11)
    assert max(each.error for each in found) < 6.8e-11


def test_beyond_its_error_the_side_of_a_change_is_sure() -> None:
    """Of x - 1/3 with an error of 1e-6 the sign is sure beyond 1e-6, and the bracket some times as wide."""
    margin = of((1 / 3,), error=1e-6)
    (found,) = changes(margin, VALUES)
    assert abs(found.value - 1 / 3) <= found.error
    assert 1e-6 <= found.error <= 2e-5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_value_at_which_rounding_hides_the_side_ends_no_bracket(sign: float) -> None:
    """The root lies 1e-9 beside a value that is looked at, on its stable side; the error is 1e-6."""
    root = 0.5 - sign * 1e-9

    def margin(x: float) -> list[Rounded]:
        return [Rounded(sign * (root - x), 1e-6)]

    (found,) = changes(margin, VALUES)
    assert abs(found.value - root) <= found.error <= 2e-5
    stable = found.value - sign * found.error
    assert sign * (root - stable) > 1e-6


@pytest.mark.parametrize("lost", [True, False])
def test_a_bracket_goes_from_the_last_known_value_to_the_first_one_after_it(lost: bool) -> None:
    """Within 0.01 of 0.35 the side is not known. 2⁻⁴ takes 16 halvings to come below 1e-6.

    From 0 and 1 the fifth value, 0.34375, is not known; 2⁻⁵ to either side of it is then halved four times.
    """
    asked = list[float]()

    def unstable(x: float) -> bool | None:
        asked.append(x)
        return None if abs(x - 0.35) <= 0.01 else (x > 0.35) is lost

    (found,) = between_known(unstable, VALUES, 1e-6)
    low = found.value - found.error
    high = found.value + found.error
    assert 0.34 - 1e-6 <= low < 0.34
    assert 0.36 < high <= 0.36 + 1e-6
    assert (found.lost, found.which, found.known) == (lost, None, True)
    assert len(asked) <= len(VALUES) + 2 * 16
    asked.clear()
    (found,) = between_known(unstable, [0.0, 1.0], 1e-6, 4)
    assert 0.34 - 2.0**-9 <= found.value - found.error < 0.34
    assert 0.36 < found.value + found.error <= 0.36 + 2.0**-9
    assert len(asked) == 2 + 5 + 2 * 4


def test_where_all_sides_are_known_each_halving_asks_once() -> None:
    """A width of 2⁻¹⁰ of the distance takes ten."""
    asked = list[float]()

    def unstable(x: float) -> bool:
        asked.append(x)
        return x > 1 / 3

    (found,) = between_known(unstable, [0.0, 1.0], 2.0**-10)
    assert abs(found.value - 1 / 3) <= found.error == 2.0**-11
    assert len(asked) == 2 + 10


@pytest.mark.parametrize(
    ("sides", "expected"),
    [
        ("FFTTF", [(1.5, 0.5, True, True), (3.5, 0.5, False, True)]),
        ("F??T", [(1.5, 1.5, True, True)]),
        ("F?FT", [(0.0, 2.0, True, False), (2.0, 2.0, False, False), (2.5, 0.5, True, True)]),
        ("T??T", []),
        ("??T", [(0.0, 2.0, True, False)]),
        ("?FF", [(0.0, 1.0, True, False), (1.0, 1.0, False, False)]),
        ("T??", [(2.0, 2.0, False, False)]),
        ("FF?", [(1.0, 1.0, True, False)]),
        ("???", []),
        ("F", []),
    ],
)
def test_a_window_may_begin_or_end_anywhere_where_nothing_is_known(
    sides: str, expected: list[tuple[float, float, bool, bool]]
) -> None:
    """Of sides at 0, 1, 2, …: F stable, T unstable, ? not known. The upper bound cuts a window that reaches it."""
    known = [(float(k), {"F": False, "T": True}.get(side)) for k, side in enumerate(sides)]

    def halfway(low: float, high: float, lost: bool) -> Change:
        return Change(0.5 * (low + high), 0.5 * (high - low), lost)

    found = list(joined(known, known[-1][0], halfway))
    assert [(each.value, each.error, each.lost, each.known) for each in found] == expected


def test_beyond_the_change_that_is_taken_nothing_is_asked() -> None:
    asked = list[float]()

    def ends(x: float) -> list[Rounded] | None:
        asked.append(x)
        return [Rounded(1.0)] if x < 0.35 else None

    next(between(ends, VALUES))
    assert max(asked) == min(value for value in VALUES if value >= 0.35)


def test_where_sliding_ends_nothing_passes_zero() -> None:
    def ends(x: float) -> list[Rounded] | None:
        return [Rounded(1.0)] if x < 0.35 else None

    (found,) = changes(ends, VALUES, 1e-9)
    assert found.value == pytest.approx(0.35, abs=1e-9)
    assert (found.lost, found.which) == (True, None)
    assert found.error <= 1e-9


def test_a_margin_that_ends_beyond_its_root_has_the_root() -> None:
    def ends(x: float) -> list[Rounded] | None:
        return [Rounded(0.36 - x, 1e-16)] if x < 0.37 else None

    (found,) = changes(ends, VALUES)
    assert found.value == pytest.approx(0.36, abs=1e-14)
    assert found.which == 0


def test_the_golden_section_finds_the_least_of_what_keeps_its_sign() -> None:
    asked = list[float]()

    def above(x: float) -> list[Rounded]:
        asked.append(x)
        return [Rounded((x - 0.6180) ** 2 + 1e-12, 1e-16)]

    assert list(changes(above, VALUES)) == []
    assert min(abs(x - 0.6180) for x in asked) < 1e-6


def test_what_a_mean_leaves_open_moves_the_root_of_a_line() -> None:
    """Of 5 (0.4 - x): windows at roots 0.4 ± 0.01 have a mean whose error is 3 · 0.01 · √(4/3) / √4."""

    def line(root: float) -> Margin:
        return lambda x: [Rounded(1.0), Rounded(5.0 * (root - x))]

    windows = [line(0.39), line(0.41), line(0.39), line(0.41)]
    change = Change(0.4, 0.0, True, 1)
    spread = 3.0 * 0.01 * math.sqrt(4.0 / 3.0) / 2.0
    assert left_open(line(0.4), windows, line(0.4), change, 0.35) == pytest.approx(spread, rel=1e-12)
    assert left_open(line(0.4), windows, line(0.402), change, 0.35) == pytest.approx(spread + 0.002, rel=1e-12)
    assert left_open(line(0.4), [line(0.4)] * 4, line(0.4), change, 0.35) == 0.0
    assert left_open(line(0.4), [lambda x: None], line(0.4), change, 0.35) is None
    assert left_open(line(0.4), windows, line(0.4), change._replace(which=None), 0.35) is None
