"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brakecli.api import classify, load, run, stability, sweep

__all__ = ["classify", "load", "run", "stability", "sweep"]
__version__ = "0.5.0"


def __getattr__(name: str) -> Any:
    """Import a function when it is used, so that the command line starts quickly."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from brakecli import api

    return getattr(api, name)
