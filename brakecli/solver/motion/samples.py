"""The samples of a motion, the works up to them and its turning points: steps end on the grid of samples."""

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, MATRICES, SIZE, V_X, V_Y, X, Y
from brakecli.solver.friction import observed
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.motion import columns, exact
from brakecli.solver.motion.advance import advance, begin
from brakecli.solver.motion.events import DONE, LONG, STALLED, pass_knot
from brakecli.solver.phases import OPEN, STICK, carried, side_of
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import BOUND, Failure
from brakecli.solver.schedules import integral_at, value_at
from brakecli.solver.tangent import renew
from brakecli.solver.track import mark

_NONE, _DIVERGED, _STALLED = (int(failure) for failure in (Failure.NONE, Failure.DIVERGED, Failure.STALLED))


@kernel(inline=False)
def _start(p: Plant, scratch: Floats) -> None:
    """Find the phase of the initial state."""
    m = p.block
    p.exact.stiffness = 2.0 * p.layer.pad.half_length * p.layer.pad.k
    m.h = p.s.h
    m.propagator = MATRICES
    m.z[X] = m.x
    m.z[Y] = m.y
    m.z[V_X] = m.v_x
    m.z[V_Y] = m.v_y
    m.account = 1
    m.rounds = 1
    m.count = 1
    if p.tangent.on == 1:
        m.count = 2
    pass_knot(p, scratch, 0.0)
    begin(p, scratch)
    m.started = 1
    if p.track.on == 1:
        p.track.phase = m.phase


@kernel(inline=False)
def mark_at(p: Plant, number: int, store: float) -> None:
    """Make a mark where the motion is, with the energy of its contact (J)."""
    m = p.block
    at = p.track.states[mark(p.track, p.work, number, p.grid.samples, m.base + m.time, store)]
    for i in range(4):
        at[i] = m.z[i]


@kernel(inline=False)
def _mark(p: Plant, number: int) -> None:
    """Make a mark at a sample."""
    m = p.block
    exact.add_works(p.c, p.exact, m, p.work)
    mark_at(p, number, 0.5 * p.exact.stiffness * m.z[Y] * m.z[Y] if m.phase != OPEN else 0.0)


@kernel
def renew_disturbance(p: Plant, number: int) -> None:
    """Note the growth of the disturbance, the last column, up to a sample."""
    t = p.tangent
    w = p.block.columns[p.block.count - 1]
    if number > 0:
        t.x = w[X]
        t.y = w[Y]
        t.v_x = w[V_X]
        t.v_y = w[V_Y]
    renew(t, number, p.grid.samples)
    w[X] = t.x
    w[Y] = t.y
    w[V_X] = t.v_x
    w[V_Y] = t.v_y


@kernel
def put_sample(p: Plant, w: Floats, phase: int, normal: float, fraction: float, needed: float) -> None:
    """Put a sample into the state: the motion w with its forces (N); `needed` is what it takes to stick."""
    m = p.block
    bound = p.c.phi * normal
    holds = phase == STICK and abs(needed) <= bound * (1.0 + 1e-12)  # but for rounding
    state, friction = observed(side_of(phase), holds, needed, normal, bound)
    for i in range(4):
        m.row[i] = w[i]
    m.row[4] = friction
    m.row[5] = normal
    m.row[6] = fraction
    m.row[7] = state


@kernel
def _sample(p: Plant, scratch: Floats) -> None:
    """Put the sample at the level reached into the state; in stick the shoe is carried along without drift."""
    m = p.block
    z = m.z
    columns.hold_on(m)
    needed = 0.0
    if m.phase == STICK:
        belt = scratch[p.drive.belt_at : p.drive.belt_end]
        travel, travel_low = integral_at(belt, m.base, 0.0)
        z[BELT] = z[V_X] = value_at(belt, m.base)
        z[X] = carried(m.anchor, m.anchor_low, travel, travel_low)
        for i in range(SIZE):
            needed += p.exact.needed[i] * z[i]
    for i in range(4):
        m.worst[i] = max(m.worst[i], abs(m.columns[0, i]))
        m.largest[i] = max(m.largest[i], abs(z[i]))
    normal = max(-p.exact.stiffness * z[Y], 0.0) if m.phase != OPEN else 0.0
    put_sample(p, z, m.phase, normal, 1.0 if normal > 0.0 else 0.0, needed)


@kernel(inline=False)
def sampled(p: Plant, scratch: Floats, rows: Floats, stop: int) -> int:
    """Step from the level reached to that of a later sample, filling `rows` with those before it; a `Failure`."""
    m = p.block
    counts = p.counts
    grid = p.grid
    failure = _NONE
    row = 0
    if m.started == 0:
        _start(p, scratch)
    number = counts.level // grid.per_sample
    while True:
        m.base = grid.interval * number
        m.time = 0.0
        _sample(p, scratch)
        if p.tangent.on == 1:
            renew_disturbance(p, number)
        if p.track.on == 1 and number >= p.track.next:
            _mark(p, number)
        if counts.level >= stop:
            break
        for column in range(8):  # a slice would take seconds to compile
            rows[row, column] = m.row[column]
        row += 1
        ends = advance(p, scratch, grid.interval, False)
        while ends == LONG and not stopped(p.layer.pad.signals):
            ends = advance(p, scratch, grid.interval, False)
        if ends == STALLED:
            failure = _STALLED
        if not abs(m.z[X]) + abs(m.z[Y]) + abs(m.z[V_X]) + abs(m.z[V_Y]) < BOUND:
            failure = _DIVERGED
        if failure != _NONE or ends != DONE:
            counts.level += min(int(m.time / m.h), grid.per_sample - 1)  # the last good one, behind its sample
            break
        counts.level += grid.per_sample
        number += 1
    if failure != _NONE or number == grid.samples:
        exact.add_works(p.c, p.exact, m, p.work)
    m.x = m.z[X]
    m.y = m.z[Y]
    m.v_x = m.z[V_X]
    m.v_y = m.z[V_Y]
    return failure
