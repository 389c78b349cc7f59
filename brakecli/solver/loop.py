"""The only time loop: steps a state, and samples it on a fixed interval whatever the step."""

import math
from typing import Any

from brakecli.solver.arrays import ROWS, VECTOR, Floats
from brakecli.solver.contact.force import evaluate
from brakecli.solver.friction import observed
from brakecli.solver.implicit_step import SOLVED, solve
from brakecli.solver.kernels import entry, kernel, stopped
from brakecli.solver.motion.phases import FORWARD, OPEN, STICK, UNDECIDED
from brakecli.solver.plant import PLANT, Plant
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.roughness import turn
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.schemes.steps import finish, prepare
from brakecli.solver.tangent import kept, meet, renew
from brakecli.solver.tangent import solve as solve_disturbed
from brakecli.solver.track import enter, mark, put, turned

_ROUNDING = 1e-15  # of velocities, some units
_NONE, _UNCONVERGED, _DIVERGED, _NOT_CLOSED = (int(failure) for failure in tuple(Failure)[:4])


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
def sample(p: Plant, tables: Floats, scratch: Floats, row: Floats) -> None:
    """Write the sample that is due at this level: the motion, and the forces at its own time.

    F_y is evaluated at the sample; F_x follows from the slip law, or in stick from (6) with the wheel's
    acceleration. In stick a three-layer scheme's velocity leaves U at every other level, by no more than friction
    changes it in a step: it sticks there, too, while the force needed lies inside the friction cone.
    """
    c = p.c
    grid = p.grid
    state = p.state
    contact = p.layer.contact
    number = (p.counts.level - grid.lag) // grid.per_sample
    t = grid.interval * number
    x, y = (state.x, state.y) if grid.lag == 0 else (state.x_old, state.y_old)
    v_x = state.v_x
    v_y = state.v_y
    belt = value_at(scratch[p.drive.belt_at : p.drive.belt_end], t)
    if p.layer.pad.wheel_terms > 0:
        travel, travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], t, 0.0)
        turn(travel, travel_low, p.layer, tables, scratch)
    evaluate(x, y, p.layer, tables, scratch)
    p.counts.evaluations += 1
    normal = contact.normal_force
    bound = c.phi * normal
    belt_slope = slope_at(scratch[p.drive.belt_at : p.drive.belt_end], t)
    load = value_at(scratch[p.drive.load_at : p.drive.load_end], t)
    sliding = v_x - belt
    if abs(sliding) <= _ROUNDING * (abs(belt) + abs(belt_slope * t)):  # the step took U at its own rounding of t
        sliding = 0.0
    # Eq. (6) with the velocity and the acceleration of the wheel
    needed = c.m * belt_slope + c.b_xx * belt + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + load * c.sin_beta
    flicker = grid.lag * p.s.h * bound / c.m if p.counts.stuck >= p.counts.level - 1 else 0.0
    holds = abs(sliding) <= flicker and abs(needed) <= bound
    side, friction = observed(sliding, holds, needed, normal, bound)
    row[0] = x
    row[1] = y
    row[2] = v_x
    row[3] = v_y
    row[4] = friction
    row[5] = normal
    row[6] = contact.fraction
    row[7] = side
    if p.track.on == 1 and number >= p.track.next:
        _mark(p, tables, scratch, number, t)


@kernel
def _needed(p: Plant) -> float:
    """The friction force (N) that it takes to stick, where the step that has been taken has its forces.

    By (6) it is m U̇ + b_xx U + b_xy ẏ + c_xx x + c_xy y + Q_x.
    """
    c = p.c
    state = p.state
    problem = p.problem
    x = state.x_old
    y = state.y_old
    v_y = state.v_y
    belt = problem.belt_now
    if p.grid.lag == 0:  # in the middle of the step, as the normal force is
        x = 0.5 * (x + state.x)
        y = 0.5 * (y + state.y)
        belt = 0.5 * (belt + problem.belt_next)
    needed = c.m * (problem.belt_next - problem.belt_now) / p.s.h + c.b_xx * belt + c.b_xy * v_y
    return needed + (c.c_xx * x + c.c_xy * y + problem.load * c.sin_beta)  # type: ignore[no-any-return]


@kernel
def _margin_rate(p: Plant, scratch: Floats, t: float, needed: float) -> float:
    """How fast φ F_y - |needed| falls or rises, where the margin of a stuck shoe runs out (N/s).

    The rate of `needed` follows from (6), with ÿ by (7).
    """
    c = p.c
    state = p.state
    problem = p.problem
    h = p.s.h
    v_y = state.v_y
    belt = problem.belt
    force = problem.normal_force
    belt_slope = (problem.belt_next - problem.belt_now) / h
    load_slope = slope_at(scratch[p.drive.load_at : p.drive.load_end], t)
    against_y = c.b_xy * belt + c.b_yy * v_y + c.c_xy * state.x + c.c_yy * state.y + problem.load * c.cos_beta
    change = c.c_xx * belt + c.c_xy * v_y + c.b_xx * belt_slope + c.b_xy * (force - against_y) / c.m
    change += load_slope * c.sin_beta
    return c.phi * (force - state.force_before) / h - math.copysign(1.0, needed) * change  # type: ignore[no-any-return]


@kernel(inline=False)
def _follow(p: Plant, scratch: Floats, phase: int, t: float, v_before: float, before: float) -> None:
    """Note the events of the step from time t on, which has been taken, see `solver.track`.

    `phase` is what its solution says, v_before the velocity before and `before` its excess over the wheel's (m/s).
    A stick begins where m |vx - U| = t (bound ± needed), and ends where bound - |needed| = 0 by its rate.
    """
    c = p.c
    track = p.track
    state = p.state
    problem = p.problem
    contact = p.layer.contact
    h = p.s.h
    lag = p.grid.lag
    was: int = track.phase
    v_x = state.v_x
    force = problem.normal_force
    needed = _needed(p)
    # time of the forces
    bound = c.phi * force
    sliding = v_x - problem.belt
    at = t + p.grid.weighted * h
    # where the velocity is
    reached = t + (1 - lag) * h
    x = state.x if lag == 0 else state.x_old
    margin = bound - abs(needed)
    if was == UNDECIDED and phase == STICK and before != 0.0:  # it slipped at the start
        was = track.phase = FORWARD
    if phase == STICK and was != STICK and margin < 0.0:
        phase = FORWARD  # it turns in the step, and has the wheel's velocity at its end, but nothing holds it
    elif phase == FORWARD and was == STICK and lag == 1 and margin >= 0.0 and p.counts.stuck == p.counts.level:
        phase = STICK if abs(sliding) <= h * bound / c.m else FORWARD  # see `sample`
    if phase == STICK and was != STICK:
        to_go = c.m * abs(before)
        change = h * (bound + math.copysign(1.0, before) * needed)
        at = reached - h + (h * to_go / change if to_go < change else h)
        track.began = at
    elif phase == FORWARD and was == STICK:
        rate = _margin_rate(p, scratch, t, needed)
        late = min(margin / rate, 2.0 * h) if margin < 0.0 and rate < 0.0 else 0.0
        at = max(at - late, track.began)
    if phase == OPEN and was != OPEN:
        fall = state.force_earlier - state.force_before
        at += h * (state.force_before / fall - 1.0) if fall > state.force_before else 0.0
    elif phase != OPEN and was == OPEN:
        rise = contact.tangential * sliding - contact.stiffness * state.v_y
        at -= force / rise if force < h * rise else h
    if phase != was:
        rest = reached - at
        there = x - rest * (v_x - 0.5 * rest * (v_x - v_before) / h)
        enter(track, phase, at, there, state.y, v_x, state.v_y)
    if phase == STICK:
        v_x = problem.belt
    kind = turned(track, v_x)
    if kind >= 0:
        rest = h * v_x / (v_x - v_before) if v_before * v_x <= 0.0 else 0.0
        put(track, kind, reached - rest, x - 0.5 * rest * v_x)


@kernel(inline=False)
def _disturb(p: Plant, before: float, after: float) -> None:
    """Carry the disturbance along the step that has been taken, with the sliding velocities at both ends.

    Where friction changes from one side to another, (6) gives how far into the step: θ = m |vx - U|/(h (bound +
    side needed)). There a part of the disturbed velocity is kept; before, friction was that of the other side.
    """
    c = p.c
    t = p.tangent
    problem = p.problem
    contact = p.layer.contact
    h = p.s.h
    beside = p.beside
    side = problem.side
    was = t.side
    part = 1.0
    theta = 0.0
    lag = p.grid.lag
    if side != was:
        needed = _needed(p)
        bound = c.phi * problem.normal_force
        if side == 0.0 and abs(needed) > bound:  # the step holds, as the shoe turns in it, but friction could not
            side = -math.copysign(1.0, needed)
        elif was == 0.0 and abs(needed) <= bound and abs(after) <= lag * h * bound / c.m:  # see `sample`
            side = 0.0
        if side != was and was != 0.0:
            to_go = c.m * abs(before)
            change = h * (bound + was * needed)
            part = kept(needed, bound)
            theta = to_go / change if to_go < change else 1.0
            meet(beside, part, theta, h, lag)
            t.placed += 1
        t.side = side
    if side == 0.0:  # a scheme that lags has no other velocity
        beside.state.x_old = beside.state.x
    b = beside.state
    v_x = (b.x - b.x_old) / h if lag == 1 else b.v_x
    prepare(p, beside.state, beside.problem)
    solve_disturbed(c, beside, problem, side, contact.stiffness, contact.tangential)
    finish(p, beside.state, beside.problem, beside.contact, beside.work)
    if part > 0.0 and theta > 0.0:  # up to the event friction was that of the other side
        behind = ((b.x - b.x_old) / h - v_x if lag == 1 else b.v_x - v_x) / h
        ahead = behind + (side - was) * c.phi * beside.problem.normal_force / c.m
        change = (theta - 0.5 * lag) * h * (part * ahead - behind)
        b.x = b.x + lag * h * change
        b.v_x = b.v_x + change


@kernel(inline=False)
def _renew(p: Plant, number: int) -> None:
    """Note the growth of the disturbance up to a sample, and begin anew with one of size one."""
    t = p.tangent
    b = p.beside.state
    t.x = b.x
    t.y = b.y
    t.v_x = b.v_x
    t.v_y = b.v_y
    part = renew(t, number, p.grid.samples)
    x_old, y_old = (part * (b.x - b.x_old), part * (b.y - b.y_old)) if part > 0.0 else (0.0, 0.0)
    b.x_old = t.x - x_old
    b.y_old = t.y - y_old
    b.x = t.x
    b.y = t.y
    b.v_x = t.v_x
    b.v_y = t.v_y


@entry(int, [PLANT], VECTOR, VECTOR, ROWS, ROWS, int)
def advance(plants: Any, tables: Floats, scratch: Floats, rows: Floats, events: Floats, stop: int) -> int:
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
    part = counts.level % grid.per_sample
    if counts.level == grid.lag:  # later it is that of the step before, to the last bit
        problem.belt_next = value_at(belt, grid.interval * sampled + part * s.h)
    while counts.level < stop:
        if part == due:
            sample(p, tables, scratch, rows[row])
            row += 1
            if p.tangent.on == 1:
                _renew(p, sampled)
        # A level's time is that of the sample before it plus whole steps: no rounding piles up.
        t = grid.interval * sampled
        t_low = (part + grid.weighted) * s.h
        problem.belt_now = problem.belt_next
        problem.belt_next = value_at(belt, t + (part + 1) * s.h)
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
        before = state.v_x - problem.belt_now
        finish(p, state, problem, layer.contact, p.work)
        after = state.v_x - problem.belt_next
        if p.tangent.on == 1:
            _disturb(p, before, after)
        if track.on == 1:
            phase = OPEN if not problem.normal_force > 0.0 else STICK if problem.side == 0.0 else FORWARD
            if phase != track.phase or not state.v_x * track.way > 0.0:
                _follow(
                    p,
                    scratch,
                    phase,
                    t + part * s.h,
                    v_before,
                    before + grid.lag * (problem.belt_next - problem.belt_now),
                )
        if not abs(state.x) + abs(state.y) + abs(state.v_x) + abs(state.v_y) < BOUND:
            return _DIVERGED
        counts.kinds[layer.contact.kind] += 1
        counts.level += 1
        counts.stuck = counts.level if problem.side == 0.0 else counts.stuck
        part += 1
        if part == grid.per_sample:
            sampled = sampled + 1
            part = 0
        if stopped(layer.pad.signals):
            break
    return _NONE


take_sample = entry(None, PLANT, VECTOR, VECTOR, VECTOR)(sample)
"""`sample`, for Python."""
