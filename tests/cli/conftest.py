"""The tiny case, with its result and without."""

from pathlib import Path

import pytest

from tests.commands import TINY, brakecli


@pytest.fixture(scope="session")
def good(compiled: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with the tiny case and its result, only to be read."""
    directory = tmp_path_factory.mktemp("good")
    (directory / "tiny.toml").write_text(TINY)
    brakecli("run", "tiny.toml", "--quiet", cwd=directory).told(0)
    return directory


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A directory with nothing but the tiny case."""
    (tmp_path / "tiny.toml").write_text(TINY)
    return tmp_path
