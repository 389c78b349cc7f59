"""Which cases of a test run in `make test`, `make campaign` and `make statistics`; pages computed again."""

import re
from itertools import zip_longest
from typing import Any

import pytest

campaign = pytest.mark.campaign
statistics = pytest.mark.statistics


def counts(few: int, many: int, most: int = 0) -> list[Any]:
    """How many cases a test draws, as its parameters: in `make test`, the campaign, and `make statistics`.

    0 leaves one out. A test that `make test` leaves out says so here: marked as a whole, it would draw the large
    count of `make statistics` in the campaign as well.
    """
    drawn = (few, ()), (many, campaign), (most, statistics)
    return [pytest.param(count, marks=marks) for count, marks in drawn if count]


NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\.\w)")


def differences(found: str, written: str) -> list[tuple[str | None, str | None]]:
    """The lines in which a page that was computed again differs from the one written.

    Numbers may be off by 2 %, whole ones below 50 not at all, and errors below 1e-9 are rounding, which another
    processor or library does differently.
    """

    def same(one: str | None, other: str | None) -> bool:
        if one is None or other is None or NUMBER.sub("#", one) != NUMBER.sub("#", other):
            return False
        pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
        return all(a == b or close(*(float(each.replace("−", "-")) for each in (a, b))) for a, b in pairs)

    def close(a: float, b: float) -> bool:
        whole = a == int(a) and b == int(b) and abs(b) < 50.0
        return not whole and (abs(a - b) <= 0.02 * abs(b) or max(abs(a), abs(b)) < 1e-9)

    pages = zip_longest(found.splitlines(), written.splitlines())
    return [(one, other) for one, other in pages if not same(one, other)]
