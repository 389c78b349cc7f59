"""Import what any command imports, so that Python keeps its bytecode, whatever later environments say.

Where PYTHONDONTWRITEBYTECODE is set, as in many containers, each start would otherwise compile a thousand modules.
"""

import ast
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path

PACKAGE = Path(__file__).parent.parent / "brakecli"
SAVED = ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "matplotlib.backends.backend_pdf")
"""What matplotlib imports as it saves a picture."""


def imported(source: str) -> set[str]:
    """The modules that a source imports, at its head or in its functions."""
    found = set[str]()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return found


def names() -> set[str]:
    """Names of all modules of the package, and of what these import."""
    found = set[str](SAVED)
    for path in PACKAGE.rglob("[!_]*.py"):
        found.add(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts))
        found |= imported(path.read_text())
    return found


def main() -> None:
    """Import all of it; an extra that is not installed is left out, and so is a name that is no module."""
    sys.dont_write_bytecode = False
    for name in sorted(names()):
        with suppress(ImportError):
            import_module(name)


if __name__ == "__main__":
    main()
