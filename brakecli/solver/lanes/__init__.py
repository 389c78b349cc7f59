"""The step of many runs at once, each in a lane of its own: `ensemble` says which runs these may be.

The weights (1/12, 10/12, 1/12) are Numerov's here: they weigh positions, velocities and contact forces at the
three levels. `schemes.three_layer` computes the force at weighted positions, and a velocity from two of them.
That is right to h² only; here errors fall with h³.

A lane knows slip to one side at constant speed and load, and an iteration like the paper's, (13), from a guess
that is good enough for most steps. A run that sticks, turns, blows up or needs many evaluations is `out`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.arrays import CUBE, ROWS, VECTOR, Floats
from brakecli.solver.friction import observed
from brakecli.solver.kernels import entry, kernel, stopped
from brakecli.solver.lanes.carried import carry, renew
from brakecli.solver.lanes.records import (
    ALIKE,
    LANE,
    LANES,
    PAIR,
    SHARED,
    THETA_1,
    THETA_2,
    THETA_3,
    WAVES,
    Shared,
)
from brakecli.solver.quantities import BOUND
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.sine import sine_cosine

_MOST = 8  # evaluations of the contact in a step


@kernel(fastmath=ALIKE)
def _pass(o: Any, shared: Shared, i: int, t: float) -> None:
    """Sine and cosine of a wave of the wheel at the middle of the pad: of ωx + φ - 2π t times `rate`."""
    omega = shared.waves[3 * i]
    phase = shared.waves[3 * i + 1]
    for n in range(LANES):
        turns = o.rate[i, n] * t
        angle = omega * o.at_x[n] + (phase - TWO_PI * (turns - np.floor(turns)))
        o.sine[i, n], o.cosine[i, n] = sine_cosine(angle)


@kernel(fastmath=ALIKE)
def _add_nodes(o: Any, shared: Shared, tables: Floats) -> None:
    """The midpoint sum of the gaps (m), how many nodes touch, and the gaps themselves.

    The gap at ξ is f2 - f1 - y, where f2 = Σ g (sin cos ωξ + cos sin ωξ) by the sine and cosine of each wave. What
    is even in ξ and what is odd give the gaps at ξ and -ξ from the table of one node.
    """
    gaps = tables[shared.gaps_at :]
    at = 0
    pair = 2 * PAIR
    for n in range(LANES):
        o.found[n] = o.touches[n] = 0.0
    for _ in range(shared.nodes // 2):
        f1 = tables[at]
        opposite = tables[at + 1]
        s_0 = tables[at + 2]
        s_1 = tables[at + 3]
        s_2 = tables[at + 4]
        s_3 = tables[at + 5]
        s_4 = tables[at + 6]
        c_0 = tables[at + 7]
        c_1 = tables[at + 8]
        c_2 = tables[at + 9]
        c_3 = tables[at + 10]
        c_4 = tables[at + 11]
        for n in range(LANES):
            odd = o.cosine[0, n] * s_0 + o.cosine[1, n] * s_1 + o.cosine[2, n] * s_2 + o.cosine[3, n] * s_3
            even = o.sine[0, n] * c_0 + o.sine[1, n] * c_1 + o.sine[2, n] * c_2 + o.sine[3, n] * c_3
            odd = odd + o.cosine[4, n] * s_4
            even = even + o.sine[4, n] * c_4 - o.at_y[n]
            one = even + odd - f1
            other = even - odd - opposite
            o.found[n] += (one if one > 0.0 else 0.0) + (other if other > 0.0 else 0.0)
            o.touches[n] += (1.0 if one > 0.0 else 0.0) + (1.0 if other > 0.0 else 0.0)
            gaps[pair + n] = one
            gaps[pair + LANES + n] = other
        at = at + 12
        pair = pair + PAIR


@kernel(fastmath=ALIKE, inline=False)
def _touch(o: Any, shared: Shared, tables: Floats, t: float) -> None:
    """The normal force, (2), and the part that touches: in closed form where a bound proves it, or by nodes.

    F_y = k ∫ max(f2 - f1 - y, 0) dξ; of a pad that touches everywhere it is k (Σ wave sin - length (y + mean f1)).
    """
    waves = shared.waves
    length = shared.length
    full = shared.full_up_to
    clear = shared.clear_from
    for i in range(WAVES):
        _pass(o, shared, i, t)
    partly = 0
    for n in range(LANES):
        o.partly[n] = 1.0 if full < o.at_y[n] and o.at_y[n] < clear else 0.0
        partly |= 1 if o.partly[n] > 0.0 else 0
    if partly:
        _add_nodes(o, shared, tables)
    g_0 = waves[2]
    g_1 = waves[5]
    g_2 = waves[8]
    g_3 = waves[11]
    g_4 = waves[14]
    spacing = length / shared.nodes
    part = 1.0 / shared.nodes
    for n in range(LANES):
        mean = g_0 * o.sine[0, n] + g_1 * o.sine[1, n] + g_2 * o.sine[2, n] + g_3 * o.sine[3, n]
        mean += g_4 * o.sine[4, n] - length * (o.at_y[n] + shared.shoe_mean)
        closed = mean if mean > 0.0 and o.at_y[n] <= full else 0.0
        o.found[n] = o.k[n] * (spacing * o.found[n] if o.partly[n] > 0.0 else closed)
        o.touches[n] = part * o.touches[n] if o.partly[n] > 0.0 else 1.0 if o.at_y[n] <= full else 0.0


@kernel
def _acceleration(o: Any, n: int, x: float, y: float, v_x: float, v_y: float, force: float) -> tuple[float, float]:
    """By (6) and (7) without the load."""
    a_x = o.grip[n] * force - o.b_xx[n] * v_x - o.b_xy[n] * v_y - o.c_xx[n] * x - o.c_xy[n] * y
    a_y = force - o.b_xy[n] * v_x - o.b_yy[n] * v_y - o.c_xy[n] * x - o.c_yy[n] * y
    return a_x / o.m[n], a_y / o.m[n]


@kernel(inline=False)
def _begin(o: Any, shared: Shared, tables: Floats) -> None:
    """The second level from the first, x¹ = x⁰ + h v⁰ + h² (2 a⁰ + a¹)/6, where `g_1` and `g_2` hold a."""
    h = shared.h
    for n in range(LANES):
        o.at_x[n], o.at_y[n], o.g_1[n], o.g_2[n] = o.x_old[n], o.y_old[n], 0.0, 0.0
    for late in range(2):
        _touch(o, shared, tables, late * h)
        part, moves = (h * h / 6.0, 0.0) if late else (0.5 * h * h, h)
        for n in range(LANES):
            v_x = o.d[n] + h * o.g_1[n]
            v_y = o.e[n] + h * o.g_2[n]
            a_x, a_y = _acceleration(o, n, o.at_x[n], o.at_y[n], v_x, v_y, o.found[n])
            a_x = a_x - o.load[n] * o.sin_beta[n] / o.m[n]
            a_y = a_y - o.load[n] * o.cos_beta[n] / o.m[n]
            o.at_x[n] += moves * v_x + part * (a_x - o.g_1[n])
            o.at_y[n] += moves * v_y + part * (a_y - o.g_2[n])
            o.g_1[n] = a_x
            o.g_2[n] = a_y
            if not late:
                o.before[n], o.touched[n] = o.found[n], o.touches[n]
                o.d_old[n] = v_x - h * a_x
                o.e_old[n] = v_y - h * a_y
                o.even_x[0, n], o.even_y[0, n], o.even_force[0, n] = o.x_old[n], o.y_old[n], o.found[n]
                o.even_d[0, n] = v_x
                o.even_d[1, n] = v_x - 2.0 * h * a_x
                o.even_e[0, n] = v_y
                o.even_e[1, n] = v_y - 2.0 * h * a_y
    _touch(o, shared, tables, h)
    for n in range(LANES):
        o.x[n], o.y[n], o.force[n], o.touching[n] = o.at_x[n], o.at_y[n], o.found[n], o.touches[n]
        o.earlier[n] = 2.0 * o.before[n] - o.force[n]


@kernel(fastmath=ALIKE)
def _prepare(o: Any, shared: Shared) -> None:
    """The known part of (6) and (7) over three levels, and the guess of the force as in `loop.advance`.

    With z = (x, y), w = (d, e) and the forces F = (φF_y, F_y) it is g = 2m (z^n - z^{n-1})/h² - C (θ2 z^n +
    (θ3 + θ1) z^{n-1}) - θ1 B (2w^n - w^{n-1}) + θ2 F^n + θ3 F^{n-1} - N (sin β, cos β); the guess is
    3 (F^n - F^{n-1}) + F^{n-2}.
    The mean of three velocities is d - (d^{n+1} - 2d + d^{n-1})/12, taken a level earlier.
    """
    h = shared.h
    for n in range(LANES):
        inertia = o.m[n] * (2.0 / (h * h))
        x_old = o.x_old[n]
        y_old = o.y_old[n]
        x = THETA_2 * o.x[n] + (THETA_3 + THETA_1) * x_old
        y = THETA_2 * o.y[n] + (THETA_3 + THETA_1) * y_old
        v_x = THETA_1 * (2.0 * o.d[n] - o.d_old[n])
        v_y = THETA_1 * (2.0 * o.e[n] - o.e_old[n])
        known = THETA_2 * o.force[n] + THETA_3 * o.before[n]
        o.g_1[n] = inertia * (o.x[n] - x_old) - o.c_xx[n] * x - o.c_xy[n] * y - o.load[n] * o.sin_beta[n]
        o.g_2[n] = inertia * (o.y[n] - y_old) - o.c_yy[n] * y - o.c_xy[n] * x - o.load[n] * o.cos_beta[n]
        o.g_1[n] += o.grip[n] * known - o.b_xx[n] * v_x - o.b_xy[n] * v_y
        o.g_2[n] += known - o.b_xy[n] * v_x - o.b_yy[n] * v_y
        force = 3.0 * (o.force[n] - o.before[n]) + o.earlier[n]
        force = force if force > 0.0 else 0.0
        o.guess[n] = force if o.force[n] > 0.0 else 0.0
        o.earlier[n], o.before[n], o.touched[n] = o.before[n], o.force[n], o.touching[n]
        o.done[n] = o.out[n]


@kernel(fastmath=ALIKE)
def _iterate(o: Any, shared: Shared, tables: Floats, t: float) -> None:
    """The force of the next level in `guess`: as (13), until what is left is below the bound.

    z^{n+1} = z^{n-1} + 2h a⁻¹ (g + θ1 (φ, 1) F) by (15) and (16), and the next F adds (F_y(z) - F)/(1 + answer
    times the part that touches), which is Newton's method.
    """
    h = shared.h
    for _ in range(_MOST):
        for n in range(LANES):
            f_x = o.g_1[n] + THETA_1 * o.grip[n] * o.guess[n]
            f_y = o.g_2[n] + THETA_1 * o.guess[n]
            x = o.x_old[n] + 2.0 * h * (o.i_11[n] * f_x + o.i_12[n] * f_y)  # Eq. (15), (16)
            y = o.y_old[n] + 2.0 * h * (o.i_12[n] * f_x + o.i_22[n] * f_y)
            o.at_x[n] = x if o.done[n] == 0.0 else o.at_x[n]
            o.at_y[n] = y if o.done[n] == 0.0 else o.at_y[n]
        _touch(o, shared, tables, t)
        left = 0
        for n in range(LANES):
            waits = 1.0 - o.done[n]
            change = abs(o.found[n] - o.guess[n])
            near = o.guess[n] + (o.found[n] - o.guess[n]) / (1.0 + o.answer[n] * o.touches[n])  # Newton's method
            o.guess[n] = near if waits > 0.0 else o.guess[n]
            o.evaluations[n] += waits
            o.done[n] = 1.0 if change <= o.limit[n] else o.done[n]
            left |= 1 if o.done[n] == 0.0 else 0
        if not left:
            return


@kernel
def _finish(o: Any, shared: Shared) -> None:
    """The next level; a lane is out where the shoe slips to its side no more, or (13) did not converge.

    w = a⁻¹ (g + θ1 (φ, 1) F) and z^{n+1} = z^{n-1} + 2h w.
    """
    h = shared.h
    for n in range(LANES):
        f_x = o.g_1[n] + THETA_1 * o.grip[n] * o.guess[n]
        f_y = o.g_2[n] + THETA_1 * o.guess[n]
        d = o.i_11[n] * f_x + o.i_12[n] * f_y
        e = o.i_12[n] * f_x + o.i_22[n] * f_y
        x = o.x_old[n] + 2.0 * h * d
        y = o.y_old[n] + 2.0 * h * e
        o.x_old[n], o.y_old[n], o.x[n], o.y[n] = o.x[n], o.y[n], x, y
        o.d_old[n], o.e_old[n], o.d[n], o.e[n] = o.d[n], o.e[n], d, e
        o.force[n], o.touching[n] = o.guess[n], o.touches[n]
        good = o.done[n] > 0.0 and o.side[n] * (d - o.belt[n]) > 0.0 and abs(x) + abs(y) + abs(d) + abs(e) < BOUND
        o.out[n] = o.out[n] if good else 1.0
        o.closed[n] += 1.0 - o.partly[n]


@kernel(fastmath=ALIKE)
def _sample(o: Any, shared: Shared, rows: NDArray[np.float64], number: int) -> None:
    """The sample at the older level, as `loop.sample` has it; d without h²/6 of its second derivative.

    v = w - h²/6 w'', where m w'' are the forces by (6) and (7) of w, 2 (z^{n+1} - z^n - h w)/h² and dF_y/dt.
    """
    h = shared.h
    part = h * h / 6.0 if number else 0.0
    squared = 2.0 / (h * h)
    for n in range(LANES):
        x_old = o.x_old[n]
        y_old = o.y_old[n]
        v_x = o.d[n]
        v_y = o.e[n]
        belt = o.belt[n]
        normal = o.before[n]
        a_x = squared * (o.x[n] - x_old - h * v_x)
        a_y = squared * (o.y[n] - y_old - h * v_y)
        rate = 0.5 / h * (o.force[n] - o.earlier[n])
        j_x, j_y = _acceleration(o, n, v_x, v_y, a_x, a_y, rate)
        o.v_x[n] = v_x - part * j_x
        o.v_y[n] = v_y - part * j_y
        sliding = o.v_x[n] - belt
        bound = o.phi[n] * normal
        needed = o.b_xx[n] * belt + o.b_xy[n] * o.v_y[n] + o.c_xx[n] * x_old + o.c_xy[n] * y_old
        needed += o.load[n] * o.sin_beta[n]  # Eq. (6)
        holds = abs(sliding) <= h * bound / o.m[n] and abs(needed) <= bound
        o.state[n], o.friction[n] = observed(sliding, holds, needed, normal, bound)
    for n in range(LANES):
        row = rows[n, :, number]
        row[0] = o.x_old[n]
        row[1] = o.y_old[n]
        row[2] = o.v_x[n]
        row[3] = o.v_y[n]
        row[4] = o.friction[n]
        row[5] = o.before[n]
        row[6] = o.touched[n]
        row[7] = o.state[n]


@entry(None, LANE, SHARED, VECTOR, CUBE, ROWS)
def advance(o: Any, shared: Shared, tables: Floats, rows: NDArray[np.float64], sizes: Floats) -> None:
    """Run all lanes; `rows` gets the samples of each, variable by variable.

    `sizes` gets the growth of each disturbance in each part of the run; without parts none is carried along.
    """
    _begin(o, shared, tables)
    for number in range(rows.shape[2]):
        _sample(o, shared, rows, number)
        if sizes.shape[0] > 0:
            renew(o, shared, sizes, number, rows.shape[2] - 1)
        left = 0
        for n in range(LANES):
            left |= 1 if o.out[n] == 0.0 else 0
        if number == rows.shape[2] - 1 or not left or stopped(shared.signals):
            return
        for step in range(shared.per_sample):
            _prepare(o, shared)
            _iterate(o, shared, tables, number * shared.interval + (step + 2) * shared.h)
            _finish(o, shared)
            if shared.first < shared.beyond:
                carry(o, shared, tables, number * shared.per_sample + step)
