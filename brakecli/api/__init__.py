"""`import brakecli`: cases in, xarray objects out, as on the command line. Large imports wait for a call."""

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
