"""Histories made by hand, and the verdict on the run of a case."""

import math
from typing import Any

import numpy as np

from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.measure import Continued
from brakecli.analysis.regime.table import Fate, Thresholds
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.system import system_of
from brakecli.runs.run import asked, verdict_in_memory
from brakecli.solver.history import History, array_history
from brakecli.solver.motion import solve
from brakecli.solver.quantities import HISTORY

INTERVAL = 1e-4


def history_of(samples: int, **columns: Any) -> History:
    """A history with these variables; the others are zero."""
    rows = np.zeros((samples, len(HISTORY)))
    for name, values in columns.items():
        rows[:, list(HISTORY).index(name)] = values
    return array_history(INTERVAL, rows)


def verdict_of(case: Any) -> Verdict:
    """The verdict on the run of a case."""
    system = asked(system_of(case))
    motion = solve(system)
    return verdict_in_memory(motion, system)


def lasting(history: History, context: Context, thresholds: Thresholds | None = None) -> Verdict:
    """The verdict on a history that is known to last, as its end is, where it is continued on the smooth wheel."""
    x, v_x = (history.read(name, 3 * history.samples // 4, history.samples) for name in ("x", "vx"))
    lasts = Continued(Fate.LASTS, 0.5 * float(np.ptp(x)), float(v_x.std()), math.inf)
    return classify(history, context, thresholds or Thresholds(), continued=lambda: lasts)
