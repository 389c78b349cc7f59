"""What import-linter cannot see: arrows through the package itself, from the ground up to its face."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.commands import ROOT

PACKAGE = ROOT / "brakecli"


def arrows(text: str) -> Iterator[str]:
    """What a file imports of the package itself, at its top and inside functions."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name == "brakecli")
        elif isinstance(node, ast.ImportFrom) and (node.module == "brakecli" or node.level):
            yield from (f"brakecli.{each.name}" for each in node.names)


def is_room(name: str) -> bool:
    """Whether a name stands for a module, which import-linter follows."""
    path = PACKAGE.joinpath(*name.split(".")[1:])
    return path != PACKAGE and (path.with_suffix(".py").exists() or path.is_dir())


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("import brakecli", ["brakecli"]),
        ("from brakecli import __version__", ["brakecli.__version__"]),
        ("def f():\n    from brakecli import run", ["brakecli.run"]),
        ("from . import sweep", ["brakecli.sweep"]),
        ("from brakecli import stop, about", []),
        ("from brakecli.about import __version__", []),
    ],
)
def test_an_arrow_to_the_face_is_seen(text: str, wrong: list[str]) -> None:
    assert [name for name in arrows(text) if not is_room(name)] == wrong


def test_no_room_imports_the_face() -> None:
    found = {
        str(path.relative_to(PACKAGE)): wrong
        for path in PACKAGE.rglob("*.py")
        if (wrong := [name for name in arrows(path.read_text()) if not is_room(name)])
    }
    assert not found


def test_the_face_imports_nothing_but_the_version_until_it_is_used() -> None:
    tree = ast.parse(Path(PACKAGE, "__init__.py").read_text())
    at_once = [node.module for node in tree.body if isinstance(node, ast.ImportFrom)]
    assert at_once == ["typing", "brakecli.about"]
