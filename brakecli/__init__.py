"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

from typing import TYPE_CHECKING, Any

from brakecli.about import __version__ as __version__

if TYPE_CHECKING:
    from brakecli.api import advise, branch, classify, diff, load, plot, report, run, scatter, stability, sweep

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
    from brakecli import api

    return getattr(api, name)
