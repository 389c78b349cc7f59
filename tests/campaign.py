"""Which cases of a test run in `make test`; all others are left to `make campaign`."""

from typing import Any

import pytest

campaign = pytest.mark.campaign


def counts(few: int, many: int) -> list[Any]:
    """How many cases a test draws, as its parameters: a few in `make test`, many in the campaign."""
    return [few, pytest.param(many, marks=campaign)]
