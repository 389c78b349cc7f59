"""Settings of the tests: property-based tests are repeatable and have no clock; kernels are compiled once."""

import signal

import pytest
from hypothesis import settings

from tests import sentences
from tests.commands import warm_up

# Also under nohup and in the background of a shell, whose commands would not hear them
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)
settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=False)
settings.load_profile("repeatable")
sentences.read_all()


@pytest.fixture(scope="session")
def compiled() -> None:
    """Kernels, so that no command of a test has to compile them, or to say that it does."""
    warm_up()


@pytest.fixture
def without_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches for critical values without the runs that say from where on vibration lasts."""
    monkeypatch.setattr("brakecli.studies.sweeps.sustained.verdict_of", lambda case: None)
