"""The loop of schemes whose steps are of one length: it steps a state, and samples it on a fixed interval."""

import math
from collections.abc import Sequence

from brakecli.solver import kernels
from brakecli.solver.arrays import ROWS, VECTOR, Floats
from brakecli.solver.contact.force import evaluate
from brakecli.solver.friction import observed
from brakecli.solver.kernels import entry, kernel, stopped
from brakecli.solver.phases import FORWARD, OPEN, STICK
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.roughness import turn
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.schemes import SchemeModule, module_of
from brakecli.solver.steps.implicit import SOLVED, solve
from brakecli.solver.steps.step import finish, prepare
from brakecli.solver.track import enter, mark, put, turned

_NONE = int(Failure.NONE)
_UNCONVERGED = int(Failure.UNCONVERGED)
_DIVERGED = int(Failure.DIVERGED)
_NOT_CLOSED = int(Failure.NOT_CLOSED)


@kernel(inline=False)
def _mark(p: Plant, tables: Floats, scratch: Floats, number: int, t: float) -> None:
    """Make a mark at a sample, whose contact has been evaluated.

    A scheme that lags has its energies half a step behind. The contact's is continued up to there: another
    evaluation would change what the next one begins with.
    """
    state = p.state
    track = p.track
    contact = p.layer.contact
    lag = p.grid.lag
    after = 0.5 * lag * p.s.h
    slid = 0.0
    dy = 0.0
    if lag == 1:
        slid = 0.5 * (state.x - state.x_old) - after * value_at(scratch[p.drive.belt_at : p.drive.belt_end], t)
        dy = 0.5 * (state.y - state.y_old)
    store = contact.store + contact.store_x * slid - contact.normal_force * dy
    store += (0.5 * contact.stiffness * dy - contact.tangential * slid) * dy
    at = track.states[mark(track, p.work, number, p.grid.samples, t + after, store)]
    at[0] = state.x
    at[1] = state.y
    at[2] = state.v_x
    at[3] = state.v_y
    at[4] = state.x_old
    at[5] = state.y_old


@kernel
def _needed(p: Plant, x: float, y: float, belt: float, rate: float, load: float) -> float:
    """The friction force (N) that it takes to stick: m U̇ + b_xx U + b_xy ẏ + c_xx x + c_xy y + Q_x, by (6)."""
    c = p.c
    force = c.m * rate + c.b_xx * belt + c.b_xy * p.state.v_y + c.c_xx * x + c.c_xy * y
    return force + load * c.sin_beta


@kernel
def _holds(p: Plant, sliding: float, needed: float, bound: float) -> bool:
    """Whether friction holds a shoe with this excess over the wheel's velocity (m/s), by forces in N.

    In stick a three-layer scheme's velocity leaves U at every other level, by no more than friction changes it in
    a step: it sticks there, too, while the force needed lies inside the friction cone.
    """
    flicker = p.grid.lag * p.s.h * bound / p.c.m if p.counts.stuck >= p.counts.level - 1 else 0.0
    return abs(sliding) <= flicker and abs(needed) <= bound


@kernel
def sample(p: Plant, tables: Floats, scratch: Floats, row: Floats) -> None:
    """Write the sample that is due at this level: the motion, and the forces at its own time.

    F_y is evaluated at the sample; F_x follows from the slip law, or in stick from (6) with the wheel's
    acceleration.
    """
    grid = p.grid
    state = p.state
    contact = p.layer.contact
    number = (p.counts.level - grid.lag) // grid.per_sample
    t = grid.interval * number
    x, y = (state.x, state.y) if grid.lag == 0 else (state.x_old, state.y_old)
    v_x = state.v_x
    belt = value_at(scratch[p.drive.belt_at : p.drive.belt_end], t)
    if p.layer.pad.wheel_terms > 0:
        travel, travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], t, 0.0)
        turn(travel, travel_low, p.layer, tables, scratch)
    evaluate(x, y, p.layer, tables, scratch)
    p.counts.evaluations += 1
    normal = contact.normal_force
    bound = p.c.phi * normal
    belt_slope = slope_at(scratch[p.drive.belt_at : p.drive.belt_end], t)
    load = value_at(scratch[p.drive.load_at : p.drive.load_end], t)
    sliding = v_x - belt
    if abs(sliding) <= 1e-15 * (abs(belt) + abs(belt_slope * t)):  # the step took U at its own rounding of t
        sliding = 0.0
    needed = _needed(p, x, y, belt, belt_slope, load)
    holds = _holds(p, sliding, needed, bound)
    side, friction = observed(sliding, holds, needed, normal, bound)
    row[0] = x
    row[1] = y
    row[2] = v_x
    row[3] = state.v_y
    row[4] = friction
    row[5] = normal
    row[6] = contact.fraction
    row[7] = side
    if p.track.on == 1 and number >= p.track.next:
        _mark(p, tables, scratch, number, t)


@kernel(inline=False)
def _note(p: Plant, scratch: Floats, phase: int, v_before: float) -> None:
    """Note the events of the step that has been taken, see `solver.track`.

    `phase` is what its solution says, v_before the velocity before (m/s). A phase begins in the middle of the
    first step that is in it: a stick where velocities are, all others where forces are. A step that ends with the
    wheel's velocity begins no stick where friction could not hold the shoe: it turns in that step.
    """
    c = p.c
    track = p.track
    state = p.state
    problem = p.problem
    lag = p.grid.lag
    h = p.s.h
    v_x = state.v_x
    x = state.x if lag == 0 else state.x_old
    y = state.y if lag == 0 else state.y_old
    time = p.grid.interval * (p.counts.level // p.grid.per_sample)
    time += (p.counts.level % p.grid.per_sample - lag) * h
    bound = c.phi * problem.normal_force
    if phase != OPEN and not phase == track.phase == STICK:
        rate = (problem.belt_next - problem.belt_now) / h
        needed = _needed(p, x, y, problem.belt, rate, problem.load)
        phase = STICK if _holds(p, v_x - problem.belt, needed, bound) else FORWARD
    if phase != track.phase:
        ago = 0.5 * h
        if phase != STICK:
            ago += (1.0 - lag - p.grid.weighted) * h
        enter(track, scratch, phase, time - ago, x - ago * v_x, y - ago * state.v_y, v_x, state.v_y)
    if phase == STICK:
        v_x = problem.belt
    kind = turned(track, v_x)
    if kind >= 0:
        since = h * v_x / (v_x - v_before) if v_before * v_x <= 0.0 else 0.0
        put(track, scratch, kind, time - since, x - 0.5 * since * v_x)


@entry(int, [Plant], VECTOR, VECTOR, ROWS, ROWS, int)
def advance(
    plants: Sequence[Plant], tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int
) -> int:
    """Step from the level reached to `stop`, filling `rows` with the samples before each step; a `Failure`.

    A failure leaves the state at the last good level. `events` gets time and residual of unconverged steps.
    """
    p = plants[0]
    s = p.s
    grid = p.grid
    layer = p.layer
    state = p.state
    problem = p.problem
    counts = p.counts
    track = p.track
    belt = scratch[p.drive.belt_at : p.drive.belt_end]
    load = scratch[p.drive.load_at : p.drive.load_end]
    row = 0
    due = grid.lag % grid.per_sample
    sampled = counts.level // grid.per_sample
    passed = counts.level % grid.per_sample
    if counts.level == grid.lag:  # later it is that of the step before, to the last bit
        problem.belt_next = value_at(belt, grid.interval * sampled + passed * s.h)
    while counts.level < stop:
        if passed == due:
            sample(p, tables, scratch, rows[row])
            row += 1
        # A level's time is that of the sample before it plus whole steps: no rounding piles up.
        t = grid.interval * sampled
        t_low = (passed + grid.weighted) * s.h
        problem.belt_now = problem.belt_next
        problem.belt_next = value_at(belt, t + (passed + 1) * s.h)
        problem.load = value_at(load, t + t_low)
        if layer.pad.wheel_terms > 0:
            travel, travel_low = integral_at(belt, t, t_low)
            turn(travel, travel_low, layer, tables, scratch)
        prepare(p, state, problem)
        if state.force > 0.0:  # the guess lies on the parabola through the last three forces
            problem.normal_force = max(3.0 * (state.force - state.force_before) + state.force_earlier, 0.0)
        state.force_earlier = state.force_before
        state.force_before = state.force
        outcome, evaluations, rising = solve(layer, tables, scratch, problem, grid.most, grid.iteration)
        counts.evaluations, counts.most = counts.evaluations + evaluations, max(counts.most, evaluations)
        counts.rising += 1 if rising > 0 else 0
        if outcome != SOLVED:
            if counts.unconverged < events.shape[0]:
                events[counts.unconverged, 0] = t + t_low
                events[counts.unconverged, 1] = problem.residual
            counts.unconverged += 1
            if grid.go_on == 0 or not math.isfinite(problem.normal_force):
                return _UNCONVERGED
        if layer.contact.valid == 0:
            return _NOT_CLOSED
        v_before = state.v_x
        finish(p, state, problem, layer.contact, p.work)
        if not abs(state.x) + abs(state.y) + abs(state.v_x) + abs(state.v_y) < BOUND:
            return _DIVERGED
        counts.kinds[layer.contact.kind] += 1
        counts.level += 1
        counts.stuck = counts.level if problem.side == 0.0 else counts.stuck
        if track.on == 1:
            phase = OPEN if not problem.normal_force > 0.0 else STICK if problem.side == 0.0 else FORWARD
            if phase != track.phase or not state.v_x * track.way > 0.0:
                _note(p, scratch, phase, v_before)
        passed += 1
        if passed == grid.per_sample:
            sampled = sampled + 1
            passed = 0
        if stopped(layer.pad.signals):
            break
    return _NONE


take_sample = entry(None, Plant, VECTOR, VECTOR, VECTOR)(sample)
"""`sample`, for Python."""


def load(name: str) -> SchemeModule:
    """The module of a scheme; its loop is loaded before anything is timed."""
    module = module_of(name)
    kernels.load(getattr(module, "advance", advance))
    return module
