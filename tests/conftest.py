"""Settings of the tests: property-based tests are repeatable and have no clock; kernels are compiled once."""

import pytest
from hypothesis import settings

from tests.commands import warm_up

settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=False)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def compiled() -> None:
    """Kernels, so that no command of a test has to compile them, or to say that it does."""
    warm_up()
