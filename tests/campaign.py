"""Which cases of a test are left to `make campaign`: all but a few that `make test` runs."""

from collections.abc import Iterable

import pytest
from _pytest.mark import ParameterSet
