"""The samples of a motion in Runge-Kutta steps, which lie on the continuous solution between their ends."""

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, BELT_SLOPE, LOAD, LOAD_SLOPE, V_X, V_Y, X, Y
from brakecli.solver.contact import CLOSED_FORM
from brakecli.solver.contact.force import evaluate
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.forces import act_first, resistance, touch
from brakecli.solver.motion.samples import mark_at, put_sample, renew_disturbance
from brakecli.solver.motion.steps import begin, put_at_start, step
from brakecli.solver.motion.tableaus import interpolated
from brakecli.solver.phases import OPEN, STICK
from brakecli.solver.plant import Plant
from brakecli.solver.quantities import Failure

_NONE = int(Failure.NONE)
_COARSE = int(Failure.COARSE)


@kernel(inline=False)
def _sample(p: Plant, tables: Floats, scratch: Floats, level: int) -> None:
    """Put the sample of a level that the motion has reached into the state, with the forces at its time."""
    c = p.c
    m = p.block
    r = p.runge
    t = p.grid.interval * level
    phase = m.phase
    belt = m.z[BELT]
    belt_slope = m.z[BELT_SLOPE]
    load = m.z[LOAD]
    ahead = 0.0  # until the motion reached
    for i in range(4):
        r.w[i] = m.z[i]
    if r.level > level or m.time > ROUNDING * t:
        m.phase = m.old
        since = (t - r.base) - r.time
        ahead = (m.base - t) + m.time
        belt_slope = r.outside[BELT_SLOPE - BELT]
        belt = r.outside[0] + belt_slope * since
        load = r.outside[LOAD - BELT] + r.outside[LOAD_SLOPE - BELT] * since
        for i in range(4):
            r.w[i] = interpolated(r, i, since / r.length)
    passes = (belt + 0.5 * belt_slope * ahead) * ahead  # by the wheel until then
    at = r.w[X] + passes
    if m.phase == STICK:
        at = m.z[X]
        r.w[X] = at - passes
        r.w[V_X] = belt
    touch(p, tables, scratch, at, r.w[Y])
    needed = c.m * belt_slope + resistance(c, load, r.w[X], r.w[Y], r.w[V_X], r.w[V_Y])[0]  # Eq. (6) in stick
    contact = p.layer.contact
    put_sample(p, r.w, m.phase, max(contact.normal_force, 0.0), contact.fraction, needed)
    m.phase = phase


@kernel(inline=False)
def sampled_between(p: Plant, tables: Floats, scratch: Floats, rows: Floats, stop: int) -> int:
    """Step until the sample `stop` is reached, or until the budget of a call is spent; a `Failure`.

    `rows` gets the samples before that of counts.level, which waits in the state; a failure adds it.
    """
    m = p.block
    r = p.runge
    counts = p.counts
    track = p.track
    row = 0
    steps = 0
    waves = p.layer.pad.shoe_terms + p.layer.pad.wheel_terms if p.layer.window.rows == 0 else 0
    failure = _NONE
    if m.started == 0:
        put_at_start(p, tables, scratch)
        act_first(p, tables, scratch)
        begin(p, scratch)
        _sample(p, tables, scratch, 0)
        m.started = 1
        if p.tangent.on == 1:
            renew_disturbance(p, 0)
        if track.on == 1:
            track.phase = m.phase if r.touch[0, 1] > 0.0 else OPEN
    while True:
        if track.on == 1 and r.level >= track.next:
            store = r.stores[0]
            if r.light == 1:
                evaluate(m.z[X], m.z[Y], p.layer, tables, scratch)
                store = p.layer.contact.store
            mark_at(p, r.level, store)
        while counts.level < stop and counts.level < r.level:
            for column in range(rows.shape[1]):  # a slice would take seconds to compile
                rows[row, column] = m.row[column]
            row += 1
            counts.level += 1
            _sample(p, tables, scratch, counts.level)
            if p.tangent.on == 1:
                renew_disturbance(p, counts.level)
        if counts.level == stop or steps >= 4096:  # an interruption need not wait for a sample
            break
        failure = step(p, tables, scratch)
        if p.tangent.beyond == 1:
            failure = _COARSE
        smooth = p.layer.contact.kind == CLOSED_FORM
        # pairs of waves take as long as a step on smooth surfaces; one that finds patches takes 64 times as long
        steps += 1 + waves * waves // 2000 if smooth else 64 + waves * waves // 3
        if failure != _NONE:
            for column in range(rows.shape[1]):
                rows[row, column] = m.row[column]
            break
    m.x = m.z[X]
    m.y = m.z[Y]
    m.v_x = m.z[V_X]
    m.v_y = m.z[V_Y]
    return failure
