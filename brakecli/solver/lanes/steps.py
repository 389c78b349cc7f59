"""A step in a lane, of the motion and of all that is carried along with it.

The weights (1/12, 10/12, 1/12) are Numerov's here: they weigh positions, velocities and contact forces at the
three levels. `steps.three_layer` computes the force at weighted positions, and a velocity from two of them.
That is right to h² only; here errors fall with h³.
"""

from brakecli.solver.arrays import Floats
from brakecli.solver.kernels import kernel
from brakecli.solver.lanes.records import ALIKE, Lane, Levels
from brakecli.solver.schemes import NUMEROV

THETA_1, THETA_2, THETA_3 = NUMEROV


@kernel(fastmath=ALIKE)
def forces(o: Lane, n: int, x: float, y: float, v_x: float, v_y: float, force: float) -> tuple[float, float]:
    """What acts by (6) and (7), without the load, N."""
    f_x = o.grip[n] * force - o.b_xx[n] * v_x - o.b_xy[n] * v_y - o.c_xx[n] * x - o.c_xy[n] * y
    f_y = force - o.b_xy[n] * v_x - o.b_yy[n] * v_y - o.c_xy[n] * x - o.c_yy[n] * y
    return f_x, f_y


@kernel(fastmath=ALIKE)
def prepare(o: Lane, s: Levels, n: int, rate: float) -> None:
    """The known part of (6) and (7) over three levels; `rate` is 1/h.

    With z = (x, y), w = (d, e) and the forces F = (φF_y, F_y) it is g = 2m (z^n - z^{n-1})/h² - C (θ2 z^n +
    (θ3 + θ1) z^{n-1}) - θ1 B (2w^n - w^{n-1}) + θ2 F^n + θ3 F^{n-1} and the sources. The mean of three velocities
    is d - (d^{n+1} - 2d + d^{n-1})/12, taken a level earlier.
    """
    x = THETA_2 * s.x[n] + (THETA_3 + THETA_1) * s.x_old[n]
    y = THETA_2 * s.y[n] + (THETA_3 + THETA_1) * s.y_old[n]
    v_x = THETA_1 * (2.0 * s.d[n] - s.d_old[n])
    v_y = THETA_1 * (2.0 * s.e[n] - s.e_old[n])
    f_x, f_y = forces(o, n, x, y, v_x, v_y, THETA_2 * s.force[n] + THETA_3 * s.before[n])
    inertia = 2.0 * rate * rate * o.m[n]
    s.g_1[n] = inertia * (s.x[n] - s.x_old[n]) + f_x + s.source_x[n]
    s.g_2[n] = inertia * (s.y[n] - s.y_old[n]) + f_y + s.source_y[n]


@kernel(fastmath=ALIKE)
def solve(o: Lane, s: Levels, n: int, h: float, force: float) -> tuple[float, float, float, float]:
    """z^{n+1} = z^{n-1} + 2h w and w = a⁻¹ (g + θ1 (φ, 1) F), by (15) and (16)."""
    f_x = s.g_1[n] + THETA_1 * o.grip[n] * force
    f_y = s.g_2[n] + THETA_1 * force
    d = o.i_11[n] * f_x + o.i_12[n] * f_y
    e = o.i_12[n] * f_x + o.i_22[n] * f_y
    return s.x_old[n] + 2.0 * h * d, s.y_old[n] + 2.0 * h * e, d, e


@kernel(fastmath=ALIKE)
def move(s: Levels, n: int, x: float, y: float, d: float, e: float, force: float) -> None:
    """Go on to the next level."""
    s.x_old[n] = s.x[n]
    s.y_old[n] = s.y[n]
    s.d_old[n] = s.d[n]
    s.e_old[n] = s.e[n]
    s.before[n] = s.force[n]
    s.x[n] = x
    s.y[n] = y
    s.d[n] = d
    s.e[n] = e
    s.force[n] = force


@kernel
def some(flags: Floats) -> bool:
    """Whether a flag of any lane is set."""
    is_set = 0
    for n in range(flags.size):
        is_set |= 1 if flags[n] > 0.0 else 0
    return is_set > 0
