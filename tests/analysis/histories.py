"""Histories made by hand, and the verdict on the run of a case."""

from typing import Any

import numpy as np

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.of_run import context
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.system import system_of
from brakecli.solver.history import History, array_history
from brakecli.solver.quantities import HISTORY
from tests.examples import simulate

INTERVAL = 1e-4


def history_of(samples: int, **columns: Any) -> History:
    """A history with these variables; the others are zero."""
    rows = np.zeros((samples, len(HISTORY)))
    for name, values in columns.items():
        rows[:, list(HISTORY).index(name)] = values
    return array_history(INTERVAL, rows)


def verdict_of(case: Any) -> Verdict:
    """The verdict on the run of a case."""
    return classify(array_history(case.output.sample_interval, simulate(case).rows), context(system_of(case)))
