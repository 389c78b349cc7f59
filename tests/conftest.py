"""Settings of the tests: property-based tests are repeatable and have no clock; kernels are compiled once."""

import os
import signal
from importlib import import_module

import pytest
from hypothesis import settings

from tests import sentences
from tests.commands import ROOT, warm_up

# Also under nohup and in the background of a shell, whose commands would not hear them
signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)
settings.register_profile("repeatable", deadline=None, derandomize=True, print_blob=False)
settings.load_profile("repeatable")
sentences.read_all()

# Two processes that compile the kernels of a new version from both ends take half the time of one
if worker := os.environ.get("PYTEST_XDIST_WORKER"):
    paths = sorted((ROOT / "brakecli" / "solver").rglob("[!_]*.py"), reverse=worker == "gw1")
    for path in paths:
        import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


@pytest.fixture(scope="session")
def compiled() -> None:
    """Kernels, so that no command of a test has to compile them, or to say that it does."""
    warm_up()


@pytest.fixture
def without_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches for critical values without the runs that say from where on vibration lasts."""
    monkeypatch.setattr("brakecli.sweeps.sustained.verdict_of", lambda case: None)
