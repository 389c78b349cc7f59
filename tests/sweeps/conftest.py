"""A sweep of 120 points that takes some seconds, with its result and without."""

import shutil
from pathlib import Path

import pytest

from tests.commands import run
from tests.sweeps.helpers import ANGLES, SLOWER, frictions, write_sweep


@pytest.fixture(scope="session")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a sweep and its result, only to be read."""
    folder = tmp_path_factory.mktemp("good")
    write_sweep(folder, frictions(40), ANGLES, case=SLOWER)
    run("sweep", "s.toml", "--quiet", cwd=folder).told(0)
    return folder


@pytest.fixture
def here(good: Path, tmp_path: Path) -> Path:
    """A directory with that sweep, without its result."""
    for name in ("tiny.toml", "s.toml"):
        shutil.copy(good / name, tmp_path)
    return tmp_path
