"""Propagation on smooth pads, exact to rounding: a step within a phase is a matrix, a part of it a Taylor series.

With U, Q and their slopes as further components, the motion is z' = A z in each phase, its margins are linear in
z, and powers are quadratic in z.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.block import (
    AHEAD,
    BELT,
    BELT_SLOPE,
    LOAD,
    LOAD_SLOPE,
    MARGINS,
    NODES,
    SIZE,
    TERMS,
    V_X,
    V_Y,
    Block,
    Exact,
    X,
    Y,
)
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.double_double import EPSILON
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.cubic import lowest
from brakecli.solver.phases import HEIGHT, OPEN, PULL, PUSH, SLIDING, STICK, side_of
from brakecli.solver.records import Works

_NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(NODES)[0]
_SHARES = 0.5 * np.polynomial.legendre.leggauss(NODES)[1]
"""Gauss' rule over a step: as a step is a part of a period, exact to rounding for what is quadratic in z."""
_POWERS = np.vander(np.append(_NODES, 1.0), TERMS, increasing=True)
"""Powers of the places of the nodes, and of the end of the step."""
ROUNDING = 8.0 * EPSILON
"""Rounding of a margin over the sum of its terms."""
_OFF = 0.01
"""What a margin may differ by from the cubic, over its slopes at both ends: one that swings does by 1e-3 of its
amplitude, (0.8 rad)⁴/384."""


@kernel
def acceleration(e: Exact, phase: int, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float]:
    """A (x, y, v_x, v_y) along x and y in a phase: what links, dashpots and contact make of (6)-(7)."""
    a = e.generator
    return (
        (a[phase, V_X, X] * x + a[phase, V_X, Y] * y) + (a[phase, V_X, V_X] * v_x + a[phase, V_X, V_Y] * v_y),
        (a[phase, V_Y, X] * x + a[phase, V_Y, Y] * y) + (a[phase, V_Y, V_X] * v_x + a[phase, V_Y, V_Y] * v_y),
    )


@kernel
def rate(e: Exact, phase: int, z: Floats, into: Floats) -> None:
    """The derivative of x, y, v_x and v_y by time at a motion in a phase: A z."""
    for i in range(4):
        total = 0.0
        for k in range(SIZE):
            total += e.generator[phase, i, k] * z[k]
        into[i] = total


@kernel(inline=False)
def expand(e: Exact, begin: Floats, phase: int, span: float) -> None:
    """The series of the motion from its begin over a span (s): (A span)^k z / k!."""
    a = e.generator
    z = e.series
    for i in range(SIZE):
        z[0, i] = begin[i]
    x = z[0, X]
    y = z[0, Y]
    v_x = z[0, V_X]
    v_y = z[0, V_Y]
    load = z[0, LOAD]
    belt_slope = z[0, BELT_SLOPE]
    z[1, BELT], z[1, LOAD] = span * z[0, BELT_SLOPE], span * z[0, LOAD_SLOPE]  # further terms are 0
    for k in range(1, TERMS):
        factor = span / k
        a_x, a_y = acceleration(e, phase, x, y, v_x, v_y)
        a_x += a[phase, V_X, LOAD] * load + a[phase, V_X, BELT_SLOPE] * belt_slope
        a_y += a[phase, V_Y, LOAD] * load
        x = factor * v_x
        y = factor * v_y
        v_x = factor * a_x
        v_y = factor * a_y
        load = z[1, LOAD] if k == 1 else 0.0
        belt_slope = 0.0
        z[k, X] = x
        z[k, Y] = y
        z[k, V_X] = v_x
        z[k, V_Y] = v_y


@kernel
def reach(e: Exact, theta: float) -> None:
    """Put the motion at a part of the span of the series, Σ z_k θ^k, into `at`."""
    z = e.series
    q = theta * theta
    for i in range(SIZE):  # the compiler makes one vector of them
        value = 0.0
        for k in range(TERMS - 2, -1, -2):  # in pairs, which wait for each other half as long
            value = value * q + (z[k + 1, i] * theta + z[k, i])
        e.at[i] = value


@kernel(inline=False)
def _describe(c: Coefficients, e: Exact, phase: int) -> None:
    """The generator of a phase, its friction force and margins."""
    a = e.generator[phase]
    force = e.friction[phase]
    needed = e.needed
    margin = e.margins[phase, :, 4:]
    pressed = e.stiffness if phase != OPEN else 0.0  # F_y = -pressed y, Eq. (2)
    side = side_of(phase)
    for j in range(4):
        e.margins[phase, j, j] = 1.0
    # Eq. (6) with the velocity and the acceleration of the wheel
    needed[X] = c.c_xx
    needed[Y] = c.c_xy
    needed[V_Y] = c.b_xy
    needed[LOAD] = c.sin_beta
    needed[BELT] = c.b_xx
    needed[BELT_SLOPE] = c.m
    a[X, V_X] = a[Y, V_Y] = a[BELT, BELT_SLOPE] = a[LOAD, LOAD_SLOPE] = 1.0
    # Eq. (7)
    a[V_Y, X] = -c.c_xy / c.m
    a[V_Y, Y] = -(c.c_yy + pressed) / c.m
    a[V_Y, LOAD] = -c.cos_beta / c.m
    a[V_Y, V_X] = -c.b_xy / c.m
    a[V_Y, V_Y] = -c.b_yy / c.m
    margin[Y, HEIGHT] = 1.0 if phase == OPEN else -1.0
    if phase == STICK:
        a[V_X, BELT_SLOPE] = 1.0
        for j in range(SIZE):
            force[j] = needed[j]  # Eq. (4)
            margin[j, PULL] = -needed[j]
            margin[j, PUSH] = needed[j]
        margin[Y, PULL], margin[Y, PUSH] = margin[Y, PULL] - c.phi * pressed, margin[Y, PUSH] - c.phi * pressed
    else:
        force[Y] = side * c.phi * pressed  # Eq. (5)
        # Eq. (6)
        a[V_X, X] = -c.c_xx / c.m
        a[V_X, Y] = (force[Y] - c.c_xy) / c.m
        a[V_X, LOAD] = -c.sin_beta / c.m
        a[V_X, V_X] = -c.b_xx / c.m
        a[V_X, V_Y] = -c.b_xy / c.m
        margin[V_X, SLIDING] = side
        margin[BELT, SLIDING] = -side


@kernel(inline=False)
def _unroll(e: Exact, phase: int, h: float) -> None:
    """The series of exp(A h): the rows for x, y, v_x and v_y of (A h)^k / k!."""
    f = e.flow
    for i in range(4):
        for j in range(SIZE):
            f[0, i, j] = 1.0 if i == j else 0.0
            f[1, i, j] = h * e.generator[phase, i, j]
    for k in range(2, TERMS):
        factor = h / k
        for j in range(SIZE):
            a_x, a_y = acceleration(e, phase, f[k - 1, X, j], f[k - 1, Y, j], f[k - 1, V_X, j], f[k - 1, V_Y, j])
            f[k, X, j] = factor * f[k - 1, V_X, j]
            f[k, Y, j] = factor * f[k - 1, V_Y, j]
            f[k, V_X, j] = factor * a_x
            f[k, V_Y, j] = factor * a_y
    for k in range(1, TERMS):  # a slope of Q is followed as Q is, and added up over time
        for i in range(4):
            f[k, i, LOAD_SLOPE] = h / k * f[k - 1, i, LOAD]


@kernel
def _rates(c: Coefficients, v_x: float, v_y: float) -> tuple[float, float, float]:
    """The forces of the dashpots (N) on a velocity, and the velocity along Q: B v, and v_x sin β + v_y cos β."""
    return c.b_xx * v_x + c.b_xy * v_y, c.b_xy * v_x + c.b_yy * v_y, c.sin_beta * v_x + c.cos_beta * v_y


@kernel
def _sum_up(e: Exact, node: int) -> None:
    """The rows of exp(A t) = Σ (t/h)^k (A h)^k/k! at a node of Gauss' rule or the end: the small terms first."""
    for i in range(4):
        for j in range(SIZE):
            total = 0.0
            for k in range(TERMS - 1, -1, -1):
                total += _POWERS[node, k] * e.flow[k, i, j]
            e.rows[i, j] = total


@kernel
def _driven(row: Floats, j: int, time: float) -> float:
    """What U, Q or one of their slopes is worth in a row after a time: r_j, and t r_(j-1) as well for slopes."""
    return (row[j] if j > V_Y else 0.0) + (time * row[j - 1] if j in (BELT_SLOPE, LOAD_SLOPE) else 0.0)


@kernel(inline=False)
def make(c: Coefficients, e: Exact, phase: int, h: float) -> None:
    """The matrices of a phase for steps h: its margins M, their slopes h A' M, and exp(A h)' times all.

    They are made once: the step, the shoe and the stiffness of the contact stay what they are.
    """
    if e.made[phase] > 0:
        return
    e.made[phase] = 1
    _describe(c, e, phase)
    a = e.generator[phase]
    margins = e.margins[phase]
    step = e.step[phase]
    rows = e.rows
    for k in range(4, 4 + MARGINS):
        for j in range(SIZE):
            slope = 0.0
            for i in range(SIZE):
                slope += margins[i, k] * a[i, j]
            margins[j, k + MARGINS] = h * slope
    _unroll(e, phase, h)
    _sum_up(e, NODES)
    for j in range(SIZE):
        for k in range(4):
            step[j, k] = rows[k, j]
        for k in range(4, 4 + 2 * MARGINS):
            moved = rows[X, j] * margins[X, k] + rows[Y, j] * margins[Y, k]
            moved += rows[V_X, j] * margins[V_X, k] + rows[V_Y, j] * margins[V_Y, k]
            step[j, k] = moved + _driven(margins[:, k], j, h)


@kernel(inline=False)
def _make_works(c: Coefficients, e: Exact, phase: int, h: float) -> None:
    """The works of a step of a phase as forms in its first motion, z' W z, by Gauss' rule.

    They are the integrals of F_x U, F_x (U - ẋ), ẋ b_xx ẋ + 2 ẋ b_xy ẏ + ẏ b_yy ẏ, and Q_x ẋ + Q_y ẏ.
    """
    e.made[phase] = 2
    r = e.rows
    pull = e.factors[0]
    v_x = e.factors[1]
    v_y = e.factors[2]
    along = e.factors[3]
    across = e.factors[4]
    slides = 0.0 if phase == STICK else 1.0
    w = e.works[phase]
    _unroll(e, phase, h)
    for n in range(NODES):
        _sum_up(e, n)
        share = h * _SHARES[n]
        time = h * _NODES[n]
        for j in range(SIZE):
            force = _driven(e.friction[phase], j, time)
            rates = _rates(c, r[V_X, j], r[V_Y, j])
            for i in range(4):
                force += e.friction[phase, i] * r[i, j]
            pull[n, j] = share * force
            v_x[n, j] = r[V_X, j]
            v_y[n, j] = r[V_Y, j]
            along[n, j] = share * rates[0]
            across[n, j] = share * rates[1]
            for k in range(2):
                u = max(j, BELT + k)
                q = max(j, LOAD + k)
                factor = time if k == 1 else 1.0
                w[0, u, j + BELT + k - u] += factor * pull[n, j]
                w[3, q, j + LOAD + k - q] += factor * share * rates[2]
    for i in range(SIZE):
        for j in range(i + 1):
            drag = damp = 0.0
            for n in range(NODES):
                drag += pull[n, i] * v_x[n, j] + pull[n, j] * v_x[n, i]
                damp += v_x[n, i] * along[n, j] + v_y[n, i] * across[n, j]
            w[1, i, j] = slides * (w[0, i, j] - (drag if j < i else 0.5 * drag))
            w[2, i, j] = 2.0 * damp if j < i else damp


@kernel(inline=False)
def part_works(c: Coefficients, e: Exact, m: Block, work: Works) -> None:
    """Add the works on the part of the series that has been taken, as `_make_works` has them."""
    z = e.at
    span = m.taken * m.span
    for node in range(NODES):
        reach(e, m.taken * _NODES[node])
        share = span * _SHARES[node]
        force = 0.0
        rates = _rates(c, z[V_X], z[V_Y])
        for i in range(SIZE):
            force += e.friction[m.old, i] * z[i]
        work.belt += share * force * z[BELT]
        work.friction += share * force * (z[BELT] - z[V_X]) if m.old != STICK else 0.0
        work.dashpots += share * (rates[0] * z[V_X] + rates[1] * z[V_Y])
        work.load += share * z[LOAD] * rates[2]


@kernel
def add_products(e: Exact, m: Block) -> None:
    """Let the works of the last step, a whole one, wait: its products z_i z_j, or z_i alone while U and Q last."""
    m.waiting += 1
    if m.steady == 0:
        for i in range(4, SIZE):
            for j in range(i + 1):
                e.products[i, j] += m.begin[i] * m.begin[j]
    for i in range(4):
        e.sums[i] += m.begin[i]
        for j in range(4):
            e.products[i, j] += m.begin[i] * m.begin[j]


@kernel(inline=False)
def add_works(c: Coefficients, e: Exact, m: Block, work: Works) -> None:
    """Add up the works Σ W_ij Σ z_i z_j of the whole steps that wait for it, all of the present phase."""
    if m.waiting == 0:
        return
    if e.made[m.phase] < 2:
        _make_works(c, e, m.phase, m.h)
    works = e.works[m.phase]
    for i in range(BELT, SIZE if m.steady == 1 else 0):
        for j in range(i + 1):
            e.products[i, j] = m.z[i] * (e.sums[j] if j < BELT else m.waiting * m.z[j])
    belt = 0.0
    heat = 0.0
    dashpots = 0.0
    load = 0.0
    for i in range(SIZE):
        for j in range(i + 1):
            belt += works[0, i, j] * e.products[i, j]
            heat += works[1, i, j] * e.products[i, j]
            dashpots += works[2, i, j] * e.products[i, j]
            load += works[3, i, j] * e.products[i, j]
            e.products[i, j] = 0.0
    for i in range(4):
        e.sums[i] = 0.0
    m.waiting = 0
    work.belt += belt
    work.friction += heat
    work.dashpots += dashpots
    work.load += load


@kernel(inline=False)
def look(e: Exact, phase: int, z: Floats) -> None:
    """The matrix of the phase, the margins of the motion reached, and their slopes."""
    for k in range(AHEAD):
        e.before[k] = 0.0
    for i in range(SIZE):
        component = z[i]
        for k in range(AHEAD):
            e.before[k] += e.margins[phase, i, k] * component
            e.now[i, k] = e.step[phase, i, k]
    _drive(e, z)


@kernel(inline=False)
def _drive(e: Exact, z: Floats) -> None:
    """What U, Q and their slopes add to a step."""
    for k in range(AHEAD):
        e.drive[k] = 0.0
    for i in range(BELT, SIZE):
        component = z[i]
        for k in range(AHEAD):
            e.drive[k] += e.now[i, k] * component
    for k in range(4):
        e.noise[k] = abs(e.now[BELT, k] * z[BELT]) + abs(e.now[LOAD, k] * z[LOAD])


@kernel(inline=False)
def _may_dip(begin: float, slope: float, end: float, rise: float) -> bool:
    """Whether a margin may be negative inside a step, by its cubic."""
    p, value = lowest(begin, slope, end, rise)
    # up to 1e-6 of a step a margin that begins at zero dips by rounding alone
    return p > 1e-6 and value < _OFF * (abs(rise) + abs(slope))


@kernel
def try_whole_step(e: Exact, m: Block) -> bool:
    """Take a whole step, Σ now_ik z_i, and return True.

    Where a margin runs out in it, or may do so, the motion stays as it is, and the answer is False.
    """
    a = e.now
    z = m.z
    if m.steady == 0:
        _drive(e, z)
    x = z[X]
    y = z[Y]
    v_x = z[V_X]
    v_y = z[V_Y]
    for k in range(AHEAD):
        e.after[k] = ((a[X, k] * x + a[Y, k] * y) + (a[V_X, k] * v_x + a[V_Y, k] * v_y)) + e.drive[k]
    for k in range(4, 4 + MARGINS):
        begin = e.before[k]
        end = e.after[k]
        slope = e.before[MARGINS + k]
        rise = e.after[MARGINS + k]
        if end < 0.0:
            return False
        # largest p (1 - p)²: the cubic is below the lower end by no more than this times its slopes at both ends
        if min(begin, end) < (4.0 / 27.0 + _OFF) * (abs(rise) + abs(slope)) and _may_dip(begin, slope, end, rise):
            return False
    for i in range(4):
        z[i] = e.after[i]
    if m.steady == 0:
        z[BELT] += m.h * z[BELT_SLOPE]
        z[LOAD] += m.h * z[LOAD_SLOPE]
    for k in range(AHEAD):
        e.before[k] = e.after[k]
    return True


@kernel(inline=False)
def falls(e: Exact, m: Block) -> float:
    """The rate of the margin that has run out, its gradient in `normal`, and the rates before and behind."""
    rate(e, m.old, m.z, m.arrives)
    rate(e, m.phase, m.z, m.leaves)
    k = 4 + m.which
    total = e.margins[m.old, BELT, k] * m.z[BELT_SLOPE] + e.margins[m.old, LOAD, k] * m.z[LOAD_SLOPE]
    for i in range(4):
        m.normal[i] = e.margins[m.old, i, k]
        total += m.normal[i] * m.arrives[i]
    return total  # type: ignore[no-any-return]


@kernel
def unseen(mass: float, belt: float, slope: float) -> float:
    """How much (N) a margin of stick may lack that rises at `slope` (N/s), so that nobody sees the shoe slip.

    With the lack μ, slip reverses after 2 μ/slope, and its velocity comes to μ²/(2 m slope): to less than the
    rounding of the velocity of the wheel, `belt` (m/s).
    """
    return math.sqrt(2.0 * mass * max(slope, 0.0) * ROUNDING * abs(belt))


@kernel
def hold(e: Exact, which: int, z: Floats, mass: float, h: float) -> tuple[float, float]:
    """A margin of stick (N), and by how much it may miss zero: by rounding, or as nobody sees what follows."""
    total = 0.0
    terms = 0.0
    slope = 0.0
    for i in range(SIZE):
        term = e.margins[STICK, i, 4 + which] * z[i]
        total = total + term
        terms = terms + abs(term)
        slope += e.margins[STICK, i, 4 + MARGINS + which] * z[i]
    return total, max(0.5 * ROUNDING * terms, unseen(mass, z[BELT], slope / h))


@kernel(inline=False)
def rises(c: Coefficients, e: Exact, z: Floats, h: float) -> bool:
    """Whether a shoe that rests on the wheel without pressing it leaves: its first derivative that is not zero."""
    make(c, e, OPEN, h)  # nothing presses, so that all phases begin alike
    expand(e, z, OPEN, h)
    for k in range(TERMS):
        total = 0.0
        terms = 0.0
        for i in range(SIZE):
            term = e.generator[OPEN, V_Y, i] * e.series[k, i] if i < BELT or k < 2 else 0.0
            total = total + term
            terms = terms + abs(term)
        if abs(total) > ROUNDING * terms:
            return total > 0.0
    return False
