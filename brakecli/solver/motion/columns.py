"""The block beside a motion: small disturbances of it, and its error by rounding, which obey the same linear map.

Within a phase a disturbance w follows the same equation as the motion: w(t) = exp(A t) w(0) by matrices, and the
derivative of each step by Runge-Kutta. The disturbed motion comes to an event n·z = 0 later, by -n·w / n·f, where
f = dz/dt is the velocity of the motion as it arrives. For that time it goes on with f and not with f', the
velocity behind the event:

    w' = (I + (f' - f) nᵀ / (nᵀ f)) w,

the saltation matrix (R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems,
Springer 2004, ch. 7). Where stick begins it takes away what w has along ẋ. Where stick ends, and where contact is
lost or made, no force jumps: f' = f, and it is the identity.
"""

import math

from brakecli.solver.block import COLUMNS, RUNGE_KUTTA, TERMS, V_X, V_Y, Block, Exact, X, Y
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion import exact, forces
from brakecli.solver.phases import STICK
from brakecli.solver.plant import Plant


@kernel
def identify(m: Block) -> None:
    """Begin with the columns of the derivative of a state by itself."""
    for j in range(m.count):
        for i in range(4):
            m.columns[j, i] = 1.0 if i == j else 0.0


@kernel
def carry(e: Exact, m: Block) -> None:
    """Move the columns along a whole step."""
    a = e.now
    for j in range(COLUMNS):  # a number that is known has the compiler make vectors
        if j >= m.count:
            break
        x = m.columns[j, X]
        y = m.columns[j, Y]
        v_x = m.columns[j, V_X]
        v_y = m.columns[j, V_Y]
        new_x = (a[X, X] * x + a[Y, X] * y) + (a[V_X, X] * v_x + a[V_Y, X] * v_y)
        new_y = (a[X, Y] * x + a[Y, Y] * y) + (a[V_X, Y] * v_x + a[V_Y, Y] * v_y)
        new_v_x = (a[X, V_X] * x + a[Y, V_X] * y) + (a[V_X, V_X] * v_x + a[V_Y, V_X] * v_y)
        new_v_y = (a[X, V_Y] * x + a[Y, V_Y] * y) + (a[V_X, V_Y] * v_x + a[V_Y, V_Y] * v_y)
        m.columns[j, X] = new_x
        m.columns[j, Y] = new_y
        m.columns[j, V_X] = new_v_x
        m.columns[j, V_Y] = new_v_y
    if m.rounds == 1:
        _round(e, m)


@kernel(inline=False)
def carry_part(e: Exact, m: Block) -> None:
    """Move the columns along the part of the last step that has been taken: Σ (A s)^k w/k!, s in seconds."""
    seconds = m.taken * m.span
    for j in range(m.count):
        x = m.columns[j, X]
        y = m.columns[j, Y]
        v_x = m.columns[j, V_X]
        v_y = m.columns[j, V_Y]
        moved_x = x
        moved_y = y
        moved_v_x = v_x
        moved_v_y = v_y
        # an error, and a disturbance beside it, are known to a few digits only
        for k in range(1, 9 if m.rounds == 1 else TERMS):
            a_x, a_y = exact.acceleration(e, m.old, x, y, v_x, v_y)
            factor = seconds / k
            x = factor * v_x
            y = factor * v_y
            v_x = factor * a_x
            v_y = factor * a_y
            moved_x += x
            moved_y += y
            moved_v_x += v_x
            moved_v_y += v_y
        m.columns[j, X] = moved_x
        m.columns[j, Y] = moved_y
        m.columns[j, V_X] = moved_v_x
        m.columns[j, V_Y] = moved_v_y
    if m.rounds == 1:
        _round(e, m)


@kernel
def _round(e: Exact, m: Block) -> None:
    """Add a bound of the rounding of a step to the error, ε Σ |z_i now_ik|, with the signs that do most harm."""
    a = e.now
    x = m.begin[X]
    y = m.begin[Y]
    v_x = m.begin[V_X]
    v_y = m.begin[V_Y]
    for i in range(4):
        size = (abs(a[X, i] * x) + abs(a[Y, i] * y)) + (abs(a[V_X, i] * v_x) + abs(a[V_Y, i] * v_y))
        m.columns[0, i] += math.copysign(ROUNDING * (size + e.noise[i]), m.columns[0, i])


@kernel(inline=False)
def jump(p: Plant) -> bool:
    """Take the columns through the event at the end of the last step; False where it is only grazed."""
    m = p.block
    falls = forces.falls(p) if m.propagator == RUNGE_KUTTA else exact.falls(p.exact, m)
    if falls >= 0.0:
        return False
    for j in range(m.count):
        late = 0.0
        for i in range(4):
            late += m.normal[i] * m.columns[j, i] / falls
        for i in range(4):
            m.columns[j, i] += (m.leaves[i] - m.arrives[i]) * late
    return True


@kernel
def hold_on(m: Block) -> None:
    """In stick nothing is left of the error of ẋ, nor of what a disturbance beside it has there."""
    if m.phase == STICK and (m.rounds == 1 or m.propagator == RUNGE_KUTTA):
        for j in range(m.count):
            m.columns[j, V_X] = 0.0
