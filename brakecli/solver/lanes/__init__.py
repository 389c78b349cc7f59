"""Many runs at once, each in a lane of its own: `ensemble` says which runs these may be.

A lane knows slip to one side at constant speed and load, and an iteration like the paper's, (13), from a guess
that is good enough for most steps. A run that sticks, turns, blows up or needs many evaluations is not `alive`.
"""

from brakecli.solver.arrays import CUBE, ROWS, Floats
from brakecli.solver.kernels import entry, kernel, stopped
from brakecli.solver.lanes.carried import carry, renew
from brakecli.solver.lanes.contact import touch
from brakecli.solver.lanes.records import ALIKE, LANES, Lane, Shared
from brakecli.solver.lanes.steps import forces, move, prepare, solve, some
from brakecli.solver.quantities import BOUND, ContactState

_SEPARATED = float(ContactState.SEPARATED)


@kernel
def _acceleration(o: Lane, n: int, v_x: float, v_y: float) -> tuple[float, float]:
    """By (6) and (7), where the contact was evaluated last."""
    f_x, f_y = forces(o, n, o.at_x[n], o.at_y[n], v_x, v_y, o.at_force[n])
    return (f_x + o.motion.source_x[n]) / o.m[n], (f_y + o.motion.source_y[n]) / o.m[n]


@kernel(inline=False)
def _begin(o: Lane, shared: Shared, table: Floats, gaps: Floats) -> None:
    """The second level from the first, x¹ = x⁰ + h v⁰ + h² (2 a⁰ + a¹)/6, where `g_1` and `g_2` hold a⁰."""
    h = shared.h
    s = o.motion
    touch(o, shared, table, gaps, 0.0)
    for n in range(LANES):
        s.force[n] = o.at_force[n]
        o.touched[n] = o.touches[n]
        s.g_1[n], s.g_2[n] = _acceleration(o, n, s.d[n], s.e[n])
        o.at_x[n] += h * s.d[n] + 0.5 * h * h * s.g_1[n]
        o.at_y[n] += h * s.e[n] + 0.5 * h * h * s.g_2[n]
    touch(o, shared, table, gaps, h)
    for n in range(LANES):
        a_x, a_y = _acceleration(o, n, s.d[n] + h * s.g_1[n], s.e[n] + h * s.g_2[n])
        o.at_x[n] += h * h / 6.0 * (a_x - s.g_1[n])
        o.at_y[n] += h * h / 6.0 * (a_y - s.g_2[n])
    touch(o, shared, table, gaps, h)
    for n in range(LANES):
        v_x = h * s.g_1[n]
        v_y = h * s.g_2[n]
        move(o.coarse, n, s.x[n], s.y[n], s.d[n] - 2.0 * v_x, s.e[n] - 2.0 * v_y, s.force[n])
        move(s, n, o.at_x[n], o.at_y[n], s.d[n], s.e[n], o.at_force[n])
        s.d_old[n] -= v_x
        s.e_old[n] -= v_y
        o.touching[n] = o.touches[n]
        o.earlier[n] = 2.0 * s.before[n] - s.force[n]


@kernel(fastmath=ALIKE)
def _iterate(o: Lane, shared: Shared, table: Floats, gaps: Floats, t: float) -> None:
    """The force of the next level in `guess`: as (13), until what is left is below the bound.

    The first guess is 3 (F^n - F^{n-1}) + F^{n-2}. The next F adds (F_y(z) - F)/(1 + answer times the part that
    touches), which is Newton's method.
    """
    s = o.motion
    for n in range(LANES):
        prepare(o, s, n, shared.rate)
        force = 3.0 * (s.force[n] - s.before[n]) + o.earlier[n]
        o.guess[n] = force if force > 0.0 and s.force[n] > 0.0 else 0.0
        o.waits[n] = o.alive[n]
    for _ in range(8):  # a run that needs more leaves its lane
        for n in range(LANES):
            x, y, _, _ = solve(o, s, n, shared.h, o.guess[n])
            o.at_x[n] = x if o.waits[n] > 0.0 else o.at_x[n]
            o.at_y[n] = y if o.waits[n] > 0.0 else o.at_y[n]
        touch(o, shared, table, gaps, t)
        for n in range(LANES):
            change = o.at_force[n] - o.guess[n]
            o.evaluations[n] += o.waits[n]
            near = o.guess[n] + change / (1.0 + o.answer[n] * o.touches[n])
            o.guess[n] = near if o.waits[n] > 0.0 else o.guess[n]
            o.waits[n] = 0.0 if abs(change) <= o.limit[n] else o.waits[n]
        if not some(o.waits):
            return


@kernel
def _finish(o: Lane, shared: Shared) -> None:
    """The next level; a lane has no result where the shoe slips to its side no more, or (13) did not converge."""
    s = o.motion
    for n in range(LANES):
        x, y, d, e = solve(o, s, n, shared.h, o.guess[n])
        small = abs(x) + abs(y) + abs(d) + abs(e) < BOUND
        good = small and o.waits[n] == 0.0 and o.side[n] * (d - o.belt[n]) > 0.0
        o.alive[n] = o.alive[n] if good else 0.0
        o.earlier[n] = s.before[n]
        o.touched[n] = o.touching[n]
        o.touching[n] = o.touches[n]
        move(s, n, x, y, d, e, o.guess[n])


@kernel(fastmath=ALIKE)
def _sample(o: Lane, shared: Shared, row: Floats, first: bool) -> None:
    """The sample at the older level, as `loop.sample` has it; d without h²/6 of its second derivative.

    v = w - h²/6 w'', where m w'' are the forces by (6) and (7) of w, 2 (z^{n+1} - z^n - h w)/h² and dF_y/dt.
    """
    s = o.motion
    rate = shared.rate
    factor = 0.0 if first else shared.h * shared.h / 6.0
    for n in range(LANES):
        a_x = 2.0 * rate * (rate * (s.x[n] - s.x_old[n]) - s.d[n])
        a_y = 2.0 * rate * (rate * (s.y[n] - s.y_old[n]) - s.e[n])
        f_x, f_y = forces(o, n, s.d[n], s.e[n], a_x, a_y, 0.5 * rate * (s.force[n] - o.earlier[n]))
        o.sample[0, n] = s.x_old[n]
        o.sample[1, n] = s.y_old[n]
        o.sample[2, n] = s.d[n] - factor * f_x / o.m[n]
        o.sample[3, n] = s.e[n] - factor * f_y / o.m[n]
        o.sample[4, n] = o.grip[n] * s.before[n]
        o.sample[5, n] = s.before[n]
        o.sample[6, n] = o.touched[n]
        o.sample[7, n] = o.side[n] if s.before[n] > 0.0 else _SEPARATED
    for k in range(8):
        for n in range(LANES):
            row[k, n] = o.sample[k, n]


@entry(None, Lane, Shared, ROWS, ROWS, CUBE, ROWS)
def advance(o: Lane, shared: Shared, table: Floats, gaps: Floats, rows: Floats, sizes: Floats) -> None:
    """Run all lanes; `rows` gets the samples, of each variable those of all lanes.

    `sizes` gets the growth of each disturbance in each part of the run; without parts none is carried along.
    """
    _begin(o, shared, table, gaps)
    samples = rows.shape[0] - 1
    for number in range(samples + 1):
        _sample(o, shared, rows[number], number == 0)
        if sizes.shape[0] > 0:
            renew(o, shared, sizes, number, samples)
        if number == samples or not some(o.alive) or stopped(shared.signals):
            return
        for step in range(number * shared.per_sample, (number + 1) * shared.per_sample):
            _iterate(o, shared, table, gaps, (step + 2) * shared.h)
            _finish(o, shared)
            carry(o, shared, gaps, step)
