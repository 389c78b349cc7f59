"""What a loop notes of a motion beside its samples: works over parts of the run, and events where they happen.

Works at a mark are those since the start, and the energies there are those that the scheme keeps, so that the
account of every part closes as that of the run does. A mark is made at a sample; that of a scheme that lags lies
half a step behind it, and that of an event-driven motion at the end of the step that reaches the sample.

Steps of the motion end at events. Those of difference schemes do not: with them a phase begins in the middle of
the first step in it, and turning points lie where the velocity vanishes, which is linear between two levels.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.solver import phases
from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.energy import Mechanical
from brakecli.solver.kernels import kernel
from brakecli.solver.records import EVENT, MOST_EVENTS, PARTS, Notes, Weights, Works

MAX, MIN, STICK, SLIP, LIFT, TOUCH, TURN = range(7)
"""Kinds of events: turning points of x, begin and end of a stick, end and begin of contact, and sliding that turns
without a stick; difference schemes do not note the last."""
KINDS = ("max", "min", "stick", "slip", "lift-off", "touch", "turn")


class Events(NamedTuple):
    """Events in the order of time: time (s), kind, x (m), and of all but turning points y (m), vx and vy (m/s)."""

    time: Floats
    kind: NDArray[np.int8]
    x: Floats
    others: Floats


class Powers(NamedTuple):
    """Mean powers over a part of a run, W; signs as in `energy.EnergyAccount`.

    `friction` is what friction gives to the vibration, the mean of F_x ẋ: the belt's work less the heat. `stored`
    is the change of kinetic energy and of the energies of links and contact, `closing` what does not add up.
    """

    friction: float
    roughness: float
    dashpots: float
    load: float
    scheme: float
    stored: float
    closing: float


@dataclass(frozen=True, eq=False)
class Track:
    """What the loop has noted.

    `works` has columns as `records.Works`, `stored` kinetic energy and the energies of links and contact, `states`
    x, y (m), vx and vy (m/s), with one row for each of the marks at `times`. `counts` has all events of each kind,
    also those that are no longer kept.
    """

    times: Floats  # s
    works: Floats  # J
    stored: Floats  # J
    states: Floats
    counts: NDArray[np.int64]
    since: float  # all events later than that are kept, s
    kept: Events

    def events(self, begin: float = 0.0) -> Events:
        """The events from a time (s) on, as far as they are kept."""
        first = int(np.searchsorted(self.kept.time, begin))
        time, kind, x, others = self.kept
        return Events(time[first:], kind[first:], x[first:], others[first:])

    def powers(self, begin: float, end: float) -> Powers:
        """Mean powers between the marks nearest to two times (s), one part at least; NaN without any part."""
        if len(self.times) < 2:
            return Powers(**dict.fromkeys(Powers._fields, math.nan))
        first = min(int(np.abs(self.times - begin).argmin()), len(self.times) - 2)
        last = max(int(np.abs(self.times - end).argmin()), first + 1)
        span = float(self.times[last] - self.times[first])
        belt, heat, dashpots, load, roughness, scheme = ((self.works[last] - self.works[first]) / span).tolist()
        stored = float((self.stored[last] - self.stored[first]).sum()) / span
        passed = (belt - heat) + roughness - dashpots - load - scheme
        return Powers(belt - heat, roughness, dashpots, load, scheme, stored, stored - passed)

    def account(self, begin: float) -> dict[str, float]:
        """Mean powers (W) from a time (s) on: the belt's, what becomes of it, and what is left; or nothing."""
        if len(self.times) < 2:
            return {}
        first = min(int(np.abs(self.times - begin).argmin()), len(self.times) - 2)
        span = float(self.times[-1] - self.times[first])
        means = ((self.works[-1, :4] - self.works[first, :4]) / span).tolist()
        names = ("power_belt", "power_friction", "power_dashpots", "power_load")
        return dict(zip(names, means, strict=True)) | {"power_rest": means[0] - sum(means[1:])}

    def given(self, begin: float, force: float) -> Floats:
        """What is given to a vibration in each part from a time (s) on, in columns; NaN without any part.

        What friction gives (J), what the roughness gives, what dashpots and scheme leave of both, and how long the
        part is (s): marks lie at the ends of steps, so that parts are not alike, and no mean of their powers is
        that of the motion. What the mean of the friction force F_x (N) does is none of the vibration's.
        """
        if len(self.times) < 2:
            return np.full((1, 4), math.nan)
        first = min(int(np.abs(self.times - begin).argmin()), len(self.times) - 2)
        works = np.diff(self.works[first:], axis=0)
        friction = works[:, 0] - works[:, 1] - force * np.diff(self.states[first:, 0])
        roughness = works[:, 4]
        remaining = friction + roughness - works[:, 2] - works[:, 5]
        return np.column_stack([friction, roughness, remaining, np.diff(self.times[first:])])


UNTRACKED = Track(
    np.zeros(0),
    np.zeros((0, 6)),
    np.zeros((0, 3)),
    np.zeros((0, 4)),
    np.zeros(len(KINDS), np.int64),
    -math.inf,
    Events(np.zeros(0), np.zeros(0, np.int8), np.zeros(0), np.zeros((0, 3))),
)
"""Track of a motion of which nothing has been noted."""


def follow(t: Notes, v_x: float, events_at: int) -> None:
    """Note all from the start on, with the velocity there (m/s); events are kept there in the scratch."""
    t.on = 1
    t.events_at = events_at
    t.phase = phases.UNDECIDED
    t.way = np.sign(v_x)
    t.since = -math.inf


def tracked(
    t: Notes, scratch: Floats, c: Coefficients, s: Weights, energies: Callable[..., Mechanical], light: bool
) -> Track:
    """What has been noted; `light` where the work of the roughness lacks the change of the contact's store."""
    x, y, v_x, v_y, x_old, y_old, contact = t.states[: t.marks].T.copy()
    state = SimpleNamespace(x=x, y=y, v_x=v_x, v_y=v_y, x_old=x_old, y_old=y_old)
    kinetic, links, _, _ = energies(c, s, state)
    works = t.works[: t.marks].copy()
    if light:
        works[:, 4] += contact - contact[:1]
    n = min(int(t.events), MOST_EVENTS)
    events = scratch[t.events_at : t.events_at + EVENT * n].reshape(n, EVENT)
    events = events[np.argsort(events[:, 0], kind="stable")]
    time, kind, x_at = events[:, :3].T.copy()
    kept = Events(time, kind.astype(np.int8), x_at, events[:, 3:].copy())
    stored = np.column_stack([kinetic, links, contact])
    states = np.column_stack([x, y, v_x, v_y])
    return Track(t.times[: t.marks].copy(), works, stored, states, t.counts.copy(), float(t.since), kept)


@kernel(inline=False)
def mark(t: Notes, work: Works, number: int, samples: int, time: float, store: float) -> int:
    """Make a mark at a sample, and say when the next one is due; the row of `states` that gets the state there."""
    at = t.marks
    parts = min(PARTS, samples)
    t.times[at] = time
    w = t.works[at]
    w[0] = work.belt
    w[1] = work.friction
    w[2] = work.dashpots
    w[3] = work.load
    w[4] = work.roughness
    w[5] = work.scheme
    t.states[at, 6] = store
    t.marks = at + 1
    t.next = ((number * parts // samples + 1) * samples + parts - 1) // parts
    return at


@kernel(inline=False)
def put(t: Notes, scratch: Floats, kind: int, time: float, x: float) -> None:
    """Note an event; the last ones are kept."""
    at = t.events_at + EVENT * (t.events % MOST_EVENTS)
    if t.events >= MOST_EVENTS:
        t.since = max(t.since, scratch[at])
    scratch[at] = time
    scratch[at + 1] = kind
    scratch[at + 2] = x
    t.events += 1
    t.counts[kind] += 1


@kernel(inline=False)
def enter(t: Notes, scratch: Floats, phase: int, time: float, x: float, y: float, v_x: float, v_y: float) -> None:
    """Note the events with which a phase begins, and the motion there; the first one begins without any."""
    was = t.phase
    t.phase = phase
    before = t.events
    if was == phases.UNDECIDED or was == phase:
        return
    if was == phases.STICK:
        put(t, scratch, SLIP, time, x)
    if phase == phases.OPEN:
        put(t, scratch, LIFT, time, x)
    elif was == phases.OPEN:
        put(t, scratch, TOUCH, time, x)
    if phase == phases.STICK:
        put(t, scratch, STICK, time, x)
    if t.events == before:  # from one side to the other
        put(t, scratch, TURN, time, x)
    for event in range(before, t.events):
        at = t.events_at + EVENT * (event % MOST_EVENTS)
        scratch[at + 3] = y
        scratch[at + 4] = v_x
        scratch[at + 5] = v_y


@kernel
def turned(t: Notes, v_x: float) -> int:
    """The kind of a turning point that a velocity (m/s) on the other side of zero tells of; -1 if it does not."""
    kind = -1
    if v_x * t.way < 0.0:
        kind = MAX if t.way > 0.0 else MIN
    if v_x != 0.0:
        t.way = math.copysign(1.0, v_x)
    return kind
