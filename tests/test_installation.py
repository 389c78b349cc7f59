"""What an installation leaves: bytecode of all that commands import."""

from importlib import import_module
from typing import Any

imports: Any = import_module("benchmarks.imports")


def test_what_a_source_imports_is_found_at_its_head_and_in_its_functions() -> None:
    source = "import a.b\nfrom c import d\n\n\ndef f():\n    from e.f import g, h as i\n    from . import j\n"
    assert imports.imported(source) == {"a.b", "c", "c.d", "e.f", "e.f.g", "e.f.h"}


def test_what_commands_import_late_is_among_what_is_imported_once() -> None:
    assert {
        "numba",
        "h5py",
        "matplotlib.figure",
        "brakecli.cli.run",
        "brakecli.views.plots.curves",
        "rich",
    } <= imports.names()
