"""A sweep of 120 points that takes some seconds, with its result and without."""

import shutil
from pathlib import Path

import pytest

from brakecli.studies.sweeps.workers.task import compute_units
from tests.studies.sweeps.helpers import ANGLES, SLOWER, frictions, inline, write_sweep


@pytest.fixture(scope="session")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a sweep and its result, only to be read."""
    folder = tmp_path_factory.mktemp("good")
    inline(write_sweep(folder, frictions(40), ANGLES, case=SLOWER), folder / "s.h5", compute_units)
    return folder


@pytest.fixture
def here(good: Path, tmp_path: Path) -> Path:
    """A directory with that sweep, without its result."""
    for name in ("tiny.toml", "s.toml"):
        shutil.copy(good / name, tmp_path)
    return tmp_path
