"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

from typing import TYPE_CHECKING, Any

from brakecli.about import __version__ as __version__

if TYPE_CHECKING:
    from brakecli.api.cases import advise, branch, run, stability
    from brakecli.api.many import scatter, sweep
    from brakecli.api.results import classify, diff, load, plot, report

__all__ = [
    "advise",
    "branch",
    "classify",
    "diff",
    "load",
    "plot",
    "report",
    "run",
    "scatter",
    "stability",
    "sweep",
]


def __getattr__(name: str) -> Any:
    """Import a function when it is used, so that the command line starts quickly."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from brakecli.api import cases, many, results

    return next(getattr(module, name) for module in (cases, many, results) if hasattr(module, name))
