"""Vibration of a brake shoe that slides on a rough wheel, with Amontons friction."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brakecli.api import classify, load, run, stability, sweep

__all__ = ["classify", "load", "run", "stability", "sweep"]
__version__ = "0.6.0"
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Small matrices: threads for linear algebra would spin on the cores of workers, and take 80 MB each."""


def __getattr__(name: str) -> Any:
    """Import a function when it is used, so that the command line starts quickly."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from brakecli import api

    return getattr(api, name)
