"""The event-driven scheme: Runge-Kutta steps of order eight within a phase, and every event located.

Its steps are its own. Each component keeps the tolerance, relative to the largest value that it has had. Stick,
slip, lift-off and touch-down end a step: nothing is smoothed, nothing stepped over.
"""

from typing import Any

from brakecli.solver import own_steps
from brakecli.solver.arrays import ROWS, VECTOR, Floats
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.contact.force import evaluate
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.friction import observed
from brakecli.solver.kernels import entry, kernel
from brakecli.solver.motion.phases import CONE, OPEN, STICK, side_of
from brakecli.solver.motion.record import V_X, V_Y, X, Y
from brakecli.solver.motions import MOTION
from brakecli.solver.plant import PLANT, Plant
from brakecli.solver.quantities import Failure
from brakecli.solver.records import Weights
from brakecli.solver.runge_kutta import interpolated
from brakecli.solver.schemes.event_driven.phases import press, resistance
from brakecli.solver.schemes.event_driven.step import first_step, step
from brakecli.solver.tangent import renew
from brakecli.solver.track import mark

STATE = MOTION
KEPT = "motion"
LAG = own_steps.LAG
MEMORY = own_steps.MEMORY
VELOCITIES = own_steps.VELOCITIES
begin = own_steps.begin
weighted_time = own_steps.weighted_time
mechanical_energy = own_steps.mechanical_energy

_BUDGET = 4096
_EXACT = 64
"""Steps of one call on smooth surfaces, and as how many one counts that finds patches. An interruption need not
wait for a sample."""
_PAIRS = 2000
_PAIRS_EXACT = 3
"""Pairs of waves that take as long as a step on smooth surfaces, in full contact and where patches are found."""

_NONE = int(Failure.NONE)
_COARSE = int(Failure.COARSE)


def order(s: Weights, start: str) -> int:
    """The order of the steps, through all events, on smooth surfaces."""
    return 8


@kernel(inline=False)
def _sample(p: Plant, tables: Floats, scratch: Floats, interval: float, level: int) -> None:
    """Put the sample of a level that the motion has reached into the state, with the forces at its time."""
    c = p.c
    m = p.motion
    t = interval * level
    phase = m.phase
    at = m.x
    x = m.x
    y = m.y
    v_x = m.v_x
    v_y = m.v_y
    belt = m.belt
    belt_slope = m.belt_slope
    load = m.load
    if m.level > level or m.tau > ROUNDING * t:
        phase = m.phase_done
        since = (t - m.time_done) - m.tau_done
        theta = since / m.step_done
        rest = (m.time - t) + m.tau
        belt_slope = m.belt_slope_done
        belt = m.belt_done + belt_slope * since
        load = m.load_done + m.load_slope_done * since
        passed = -(belt + 0.5 * belt_slope * rest) * rest  # by the wheel since the end of the step
        x = interpolated(m, X, theta)
        y = interpolated(m, Y, theta)
        v_x = interpolated(m, V_X, theta)
        v_y = interpolated(m, V_Y, theta)
        at = x - passed
        if phase == STICK:
            at = m.x
            x = m.x + passed
            v_x = belt
    normal = max(press(p, tables, scratch, at, y, phase), 0.0)
    bound = c.phi * normal
    against_x, _ = resistance(c, load, x, y, v_x, v_y)
    needed = c.m * belt_slope + against_x  # Eq. (6) in stick
    holds = phase == STICK and abs(needed) <= bound * CONE
    state, friction = observed(side_of(phase), holds, needed, normal, bound)
    m.row[0] = x
    m.row[1] = y
    m.row[2] = v_x
    m.row[3] = v_y
    m.row[4] = friction
    m.row[5] = normal
    m.row[6] = p.layer.contact.fraction
    m.row[7] = state


@kernel(inline=False)
def _mark(p: Plant, tables: Floats, scratch: Floats, samples: int) -> None:
    """Make a mark where the motion is."""
    m = p.motion
    store = p.motion.stores[0]
    if m.light == 1:
        evaluate(m.x, m.y, p.layer, tables, scratch)
        store = p.layer.contact.store
    at = p.track.states[mark(p.track, p.work, m.level, samples, m.time + m.tau, store)]
    at[0] = m.x
    at[1] = m.y
    at[2] = m.v_x
    at[3] = m.v_y


@entry(int, [PLANT], VECTOR, VECTOR, ROWS, ROWS, int)
def advance(plants: Any, tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int) -> int:
    """Step until the sample `stop` is reached, or until the budget of a call is spent; a `Failure`.

    `rows` gets the samples before that of counts.level, which waits in the state; a failure adds it.
    """
    p = plants[0]
    m = p.motion
    counts = p.counts
    grid = p.grid
    row = 0
    steps = 0
    waves = p.layer.pad.shoe_terms + p.layer.pad.wheel_terms if p.layer.window.rows == 0 else 0
    track = p.track
    if m.started == 0:
        first_step(p, tables, scratch, grid)
        _sample(p, tables, scratch, grid.interval, 0)
        m.started = 1
        if track.on == 1:
            track.phase = m.phase if m.touch[0, 0] > 0.0 else OPEN
            _mark(p, tables, scratch, grid.samples)
    while True:
        while counts.level < stop and counts.level < m.level:
            for column in range(rows.shape[1]):  # a slice would take seconds to compile
                rows[row, column] = m.row[column]
            row += 1
            counts.level += 1
            _sample(p, tables, scratch, grid.interval, counts.level)
            if p.tangent.on == 1:
                renew(p.tangent, counts.level, grid.samples)
        if counts.level == stop or steps >= _BUDGET:
            return _NONE
        failure: int = step(p, tables, scratch, grid)
        if p.tangent.beyond == 1:
            failure = _COARSE
        steps += (
            1 + waves * waves // _PAIRS
            if p.layer.contact.kind == CLOSED_FORM
            else _EXACT + waves * waves // _PAIRS_EXACT
        )
        if failure != _NONE:
            for column in range(rows.shape[1]):
                rows[row, column] = m.row[column]
            return failure
        if track.on == 1 and m.level >= track.next:
            _mark(p, tables, scratch, grid.samples)
