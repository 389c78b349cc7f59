"""Histories made by hand, and the verdict on the run of a case."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.fate import Fate, Kind
from brakecli.analysis.regime.classify import classify
from brakecli.analysis.regime.context import Context
from brakecli.analysis.regime.decision import Thresholds
from brakecli.analysis.regime.measure import Given
from brakecli.analysis.regime.verdict import Verdict
from brakecli.case.system import system_of
from brakecli.solver.history import History, array_history
from brakecli.solver.motion.flow import Orbit
from brakecli.solver.quantities import HISTORY, ContactState
from brakecli.solver.track import KINDS, LIFT, MAX, MIN, SLIP, STICK, TOUCH, Events, Track
from brakecli.studies.runs.judge import judged_in_memory, to_judge

INTERVAL = 1e-4
MARKS = 512
Array = NDArray[np.float64]


def history_of(samples: int, **columns: Any) -> History:
    """A history with these variables; the others are zero."""
    rows = np.zeros((samples, len(HISTORY)))
    for name, values in columns.items():
        rows[:, list(HISTORY).index(name)] = values
    return array_history(INTERVAL, rows)


def verdict_of(case: Any) -> Verdict:
    """The verdict on the run of a case."""
    return judged_in_memory(to_judge(system_of(case)), lambda steps: None).verdict


def events_from_samples(time: Array, x: Array, vx: Array, state: Array) -> Events:
    """The events that samples at equal intervals tell of.

    An extreme lies on the parabola through three samples, a change of the contact's state midway between two. What
    begins and ends between two samples is not seen.
    """
    interval = float(time[1] - time[0]) if len(time) > 1 else INTERVAL
    ways = np.sign(vx)
    moving = np.flatnonzero(ways)
    before = moving[:-1]
    after = moving[1:]
    turning = ways[before] * ways[after] < 0.0
    before, after, way = before[turning], after[turning], ways[before[turning]]
    middle = np.clip(np.where(way * x[before] >= way * x[after], before, after), 1, len(x) - 2)
    rise = x[middle + 1] - x[middle - 1]
    bend = x[middle - 1] - 2.0 * x[middle] + x[middle + 1]
    part = np.clip(-0.5 * rise / np.where(bend == 0.0, np.inf, bend), -1.0, 1.0)
    found = [(time[middle] + part * interval, np.where(way > 0.0, MAX, MIN), x[middle] + 0.25 * part * rise)]
    was = state[:-1]
    now = state[1:]
    for kind, of, begins in (
        (STICK, ContactState.STICK, True),
        (SLIP, ContactState.STICK, False),
        (LIFT, ContactState.SEPARATED, True),
        (TOUCH, ContactState.SEPARATED, False),
    ):
        i = np.flatnonzero((was != now) & ((now if begins else was) == of))
        found.append((time[i] + 0.5 * interval, np.full(len(i), kind), 0.5 * (x[i] + x[i + 1])))
    times, kinds, places = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.argsort(times, kind="stable")
    return Events(times[order], kinds[order].astype(np.int8), places[order], np.zeros((len(times), 3)))


def track_of(history: History) -> Track:
    """What a loop would have noted, as far as samples tell: works of friction and roughness, and events."""
    names = ("x", "vx", "vy", "friction_force", "normal_force", "state")
    x, v_x, v_y, friction, pressure, state = (history.read(name, 0, history.samples) for name in names)
    powers = np.zeros((history.samples, 6))
    powers[:, 0] = friction * v_x  # as if the rest became heat
    powers[:, 4] = (pressure - pressure.mean()) * v_y
    powers[:, 2] = powers[:, 0] + powers[:, 4]  # what dashpots take, so that the account closes
    time = history.interval * np.arange(history.samples, dtype=np.float64)
    at = np.linspace(0, history.samples - 1, min(MARKS, history.samples)).astype(int)
    works = history.interval * np.cumsum(powers, axis=0)[at]
    events = events_from_samples(time, x, v_x, state)
    counts = np.bincount(events.kind, minlength=len(KINDS))
    states = np.zeros((len(at), 4))
    states[:, 0] = x[at]
    return Track(time[at], works, np.zeros((len(at), 3)), states, counts, -math.inf, events)


def classified(history: History, context: Context, thresholds: Thresholds | None = None, **asked: Any) -> Verdict:
    """The verdict on a history, with the track that its samples tell of."""
    given = Given(history, context, **{"track": track_of(history), **asked})
    return classify([given], thresholds or Thresholds())[0]


def lasting(history: History, context: Context, thresholds: Thresholds | None = None, **asked: Any) -> Verdict:
    """The verdict on a history that is known to last, as its end is, where it is continued on the smooth wheel."""
    x, v_x = (history.read(name, 3 * history.samples // 4, history.samples) for name in ("x", "vx"))
    nothing = (math.nan, 0.5 * float(np.ptp(x)), math.nan, math.nan, (), (), ())
    lasts = Fate(Kind.LIMIT_CYCLE, Orbit(*nothing, level=float(v_x.std())), math.inf)
    return classified(history, context, thresholds, continued=lambda: lasts, **asked)
