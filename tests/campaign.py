"""Which cases of a test run in `make test`; all others are left to `make campaign`."""

from collections.abc import Iterable
from typing import Any

import pytest

campaign = pytest.mark.campaign


def counts(few: int, many: int) -> list[Any]:
    """How many cases a test draws, as its parameters: a few in `make test`, many in the campaign."""
    return [few, pytest.param(many, marks=campaign)]


def spread(cases: Iterable[Any], few: int) -> list[Any]:
    """Cases as parameters of a test; a few of them, evenly spread from the first to the last, run in `make test`."""
    known = list(cases)
    kept = {place * (len(known) - 1) // max(few - 1, 1) for place in range(few)}
    return [pytest.param(case, marks=() if place in kept else campaign) for place, case in enumerate(known)]
