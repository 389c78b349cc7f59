"""The phases of the automaton on any surfaces: what acts on the shoe in each, and how far its margins reach.

Within a phase the normal force of a flat pad is continued linearly beyond zero, and an event ends the phase where
it vanishes. On a rough pad patches that appear, merge or vanish make kinks of the order gap^(3/2) inside a phase;
the control of the step finds them.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact import CLOSED_FORM, EVALUATORS
from brakecli.solver.contact.closed_form import FULL, clear, coverage, full_contact, full_press
from brakecli.solver.contact.force import evaluate
from brakecli.solver.contact.midpoint import press as press_nodes
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.motion.phases import (
    HEIGHT,
    OPEN,
    PULL,
    STICK,
    UNDECIDED,
    anchored,
    carried,
    following,
    held,
    side_of,
)
from brakecli.solver.motion.record import V_X, V_Y, X, Y
from brakecli.solver.plant import Plant
from brakecli.solver.roughness import turn
from brakecli.solver.runge_kutta import END_STAGE, interpolated
from brakecli.solver.schedules import integral_at, slope_at, value_at
from brakecli.solver.tangent import kept

NEAR = 3.0
"""Times what the error moves a margin by: one that comes nearer to zero may be an event, or none."""


_ON_NODES = list(EVALUATORS).index("midpoint")


@kernel
def resistance(c: Coefficients, load: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float]:
    """Forces of links and load against x and y, (6) and (7): what friction and normal force work against."""
    return (
        c.b_xx * v_x + c.b_xy * v_y + c.c_xx * x + c.c_xy * y + load * c.sin_beta,  # Eq. (6)
        c.b_xy * v_x + c.b_yy * v_y + c.c_xy * x + c.c_yy * y + load * c.cos_beta,  # Eq. (7)
    )


@kernel(inline=False)
def rounding(p: Plant) -> tuple[float, float]:
    """Rounding in the tangential and in the normal balance of forces, N: 4 ε times the sizes of their terms."""
    c = p.c
    pad = p.layer.pad
    m = p.motion
    x = abs(m.x)
    y = abs(m.y)
    v_x = abs(m.v_x)
    v_y = abs(m.v_y)
    load = abs(m.load)
    normal = 0.0
    if m.phase != OPEN:
        normal = 2.0 * pad.half_length * pad.k * (y + pad.wheel_bound + pad.shoe_bound)
    along = c.b_xx * v_x + abs(c.b_xy) * v_y + c.c_xx * x + abs(c.c_xy) * y + load * abs(c.sin_beta)
    across = abs(c.b_xy) * v_x + c.b_yy * v_y + abs(c.c_xy) * x + c.c_yy * y + load * c.cos_beta
    along += c.m * abs(m.belt_slope) + c.phi * normal
    return ROUNDING * along, ROUNDING * (across + normal)


@kernel(inline=False)
def arrive(p: Plant, tables: Floats, scratch: Floats) -> None:
    """What acts from outside at the time reached and, as no knot lies inside a step, all through the next step."""
    m = p.motion
    t = p.motion.time
    tau = p.motion.tau
    after = t + tau + ROUNDING * (t + tau)  # a knot within the rounding of the time has been reached
    m.belt = value_at(scratch[p.drive.belt_at : p.drive.belt_end], t + tau)
    m.belt_slope = slope_at(scratch[p.drive.belt_at : p.drive.belt_end], after)
    m.load = value_at(scratch[p.drive.load_at : p.drive.load_end], t + tau)
    m.load_slope = slope_at(scratch[p.drive.load_at : p.drive.load_end], after)
    m.travel, m.travel_low = integral_at(scratch[p.drive.belt_at : p.drive.belt_end], t, tau)
    if p.layer.pad.wheel_terms > 0:
        turn(m.travel, m.travel_low, p.layer, tables, scratch)
    m.pressed_x = math.nan
    if m.started != 0 and m.phase == STICK:
        m.x = carried(m.anchor, m.anchor_low, m.travel, m.travel_low)
        m.v_x = m.belt


@kernel(inline=False)
def press(p: Plant, tables: Floats, scratch: Floats, x: float, y: float, phase: int) -> float:
    """F_y (N) in the phase and the rest of `contact`; the closed form while a bound proves full contact.

    x is less what the wheel has travelled since the time that `angles` belong to.
    """
    pad = p.layer.pad
    contact = p.layer.contact
    if phase == OPEN:
        clear(contact)
        return 0.0
    p.counts.evaluations += 1
    if pad.shoe_terms + pad.wheel_terms == 0:
        contact.stiffness = 2.0 * pad.half_length * pad.k
        contact.normal_force = -contact.stiffness * y  # Eq. (2), continued: an event ends the phase at y = 0
        contact.fraction = 1.0 if y < 0.0 else 0.0
        contact.store_x = 0.0
        contact.tangential = 0.0
        contact.kind = CLOSED_FORM
        contact.valid = 1
        contact.store = 0.5 * contact.stiffness * y * y
        return contact.normal_force  # type: ignore[no-any-return]
    full = coverage(y, pad) == FULL
    m = p.motion
    light = m.light == 1
    if not full or p.layer.window.rows > 0:
        if light and p.layer.evaluator == _ON_NODES:
            press_nodes(x, y, p.layer, tables, scratch)
        else:
            evaluate(x, y, p.layer, tables, scratch)
        if full:  # the sum over nodes is the closed form
            contact.kind = CLOSED_FORM
    elif not light:
        full_contact(x, y, p.layer, tables, scratch)
    elif x == m.pressed_x:  # in stick; the force is linear in y
        contact.stiffness = 2.0 * pad.half_length * pad.k
        contact.fraction = 1.0
        contact.normal_force = m.pressed - contact.stiffness * (y - m.pressed_y)
        contact.kind = CLOSED_FORM
        contact.valid = 1
    else:
        full_press(x, y, p.layer, tables, scratch)
        m.pressed_x = x
        m.pressed_y = y
        m.pressed = contact.normal_force
    return contact.normal_force  # type: ignore[no-any-return]


@kernel(inline=False)
def find_slopes(
    p: Plant, tables: Floats, scratch: Floats, stage: int, since: float, x: float, y: float, v_x: float, v_y: float
) -> None:
    """(6)-(7) as equations of first order, and the powers of the energy account, `since` the begin of the step.

    The powers are F_x U, -F_x (ẋ - U), ẋ b_xx ẋ + 2 ẋ b_xy ẏ + ẏ b_yy ẏ, Q_x ẋ + Q_y ẏ, and that of the roughness.
    In stick x and its velocity are the wheel's, whatever is given.
    """
    c = p.c
    m = p.motion
    side = side_of(m.phase)
    stuck = m.phase == STICK
    load = m.load + m.load_slope * since
    belt = m.belt + m.belt_slope * since
    travel = (m.belt + 0.5 * m.belt_slope * since) * since
    at = x - travel
    if stuck:
        at = m.x
        x = m.x + travel
        v_x = belt
    normal = press(p, tables, scratch, at, y, m.phase)
    against_x, against_y = resistance(c, load, x, y, v_x, v_y)
    friction = c.m * m.belt_slope + against_x if stuck else -side * c.phi * normal  # Eq. (4), Eq. (5)
    sliding = v_x - belt
    m.slopes[stage, 0] = v_x
    m.slopes[stage, 1] = v_y
    m.slopes[stage, 2] = m.belt_slope if stuck else (friction - against_x) / c.m  # Eq. (6)
    m.slopes[stage, 3] = (normal - against_y) / c.m  # Eq. (7)
    m.touch[stage, 0] = p.layer.contact.stiffness
    m.touch[stage, 1] = p.layer.contact.tangential
    m.stores[stage] = p.layer.contact.store
    m.work_rates[stage, 0] = friction * belt
    m.work_rates[stage, 1] = -friction * sliding
    m.work_rates[stage, 2] = c.b_xx * v_x * v_x + 2.0 * c.b_xy * v_x * v_y + c.b_yy * v_y * v_y
    m.work_rates[stage, 3] = load * (c.sin_beta * v_x + c.cos_beta * v_y)
    # Where the store is not followed: what the pad does to it. The rest of its change is the roughness's work.
    m.work_rates[stage, 4] = p.layer.contact.store_x * sliding if m.light == 0 else normal * v_y


@kernel(inline=False)
def margins(p: Plant, tables: Floats, scratch: Floats, h: float, theta: float) -> tuple[float, float, float]:
    """The margins of the phase at the part theta of the step h; one that the phase does not have is 1.

    In flight y - clear; otherwise clear - y, in slip side (ẋ - U), in stick φ F_y - needed and φ F_y + needed.
    """
    c = p.c
    m = p.motion
    since = theta * h
    y = interpolated(m, Y, theta)
    if m.phase == OPEN:
        return y - p.layer.pad.clear_from, 1.0, 1.0
    height = p.layer.pad.clear_from - y
    belt = m.belt + m.belt_slope * since
    if m.phase != STICK:
        return height, side_of(m.phase) * (interpolated(m, V_X, theta) - belt), 1.0
    x = m.x + (m.belt + 0.5 * m.belt_slope * since) * since
    bound = c.phi * press(p, tables, scratch, m.x, y, m.phase)
    v_y = interpolated(m, V_Y, theta)
    against_x, _ = resistance(c, m.load + m.load_slope * since, x, y, belt, v_y)
    needed = c.m * m.belt_slope + against_x
    return height, bound - needed, bound + needed


@kernel(inline=False)
def margin_slope(p: Plant, which: int) -> float:
    """Rate of a margin at the end of a step, from the slopes and the contact there."""
    c = p.c
    m = p.motion
    x = m.slopes[END_STAGE, 0]
    y = m.slopes[END_STAGE, 1]
    v_x = m.slopes[END_STAGE, 2]
    v_y = m.slopes[END_STAGE, 3]
    if which == HEIGHT:
        return y if m.phase == OPEN else -y  # type: ignore[no-any-return]
    if m.phase != STICK:
        return side_of(m.phase) * (v_x - m.belt_slope)  # type: ignore[no-any-return]
    bound = -c.phi * p.layer.contact.stiffness * y
    needed, _ = resistance(c, m.load_slope, x, y, v_x, v_y)
    return bound - needed if which == PULL else bound + needed  # type: ignore[no-any-return]


@kernel(inline=False)
def cone(p: Plant, since: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float]:
    """How far the force that stick takes is within the friction cone (N), and what the error moves that by.

    φ F_y - |needed|, and |δ needed| + φ |∂F_y/∂x δx + ∂F_y/∂y δy|.
    """
    c = p.c
    m = p.motion
    e = p.tangent.error[0]
    n = p.tangent.error[1]
    against, _ = resistance(c, m.load + m.load_slope * since, x, y, v_x, v_y)
    d_x = e[X] + n[X]
    d_y = e[Y] + n[Y]
    more, _ = resistance(c, 0.0, d_x, d_y, e[V_X] + n[V_X], e[V_Y] + n[V_Y])
    pressed = p.layer.contact.tangential * d_x - p.layer.contact.stiffness * d_y
    within = c.phi * p.layer.contact.normal_force - abs(c.m * m.belt_slope + against)
    return within, abs(more) + c.phi * abs(pressed)


@kernel(inline=False)
def take_hold(p: Plant, tables: Floats, scratch: Floats) -> None:
    """The phase of a touching shoe that moves with the wheel: stick if friction can hold it, Eqs. (3)-(5).

    A shoe that slips on keeps its velocity: the wheel's is as uncertain as the time, however fast it changes.
    """
    c = p.c
    m = p.motion
    bound = c.phi * press(p, tables, scratch, m.x, m.y, STICK)
    against_x, _ = resistance(c, m.load, m.x, m.y, m.belt, m.v_y)
    needed = c.m * m.belt_slope + against_x
    along, _ = rounding(p)
    m.phase = held(bound - needed, bound + needed, along, along)
    part = kept(needed, bound)
    t = p.tangent
    if t.knows == 1 and bound > 0.0:
        margin, moved = cone(p, 0.0, m.x, m.y, m.belt, m.v_y)
        if abs(margin) < NEAR * moved:
            t.unsure = min(t.unsure, m.time + m.tau)
    t.v_x, t.error[0, V_X], t.error[1, V_X] = part * t.v_x, part * t.error[0, V_X], part * t.error[1, V_X]
    if m.phase == STICK:
        m.anchor, m.anchor_low = anchored(m.x, m.travel, m.travel_low)
        m.v_x = m.belt


@kernel(inline=False)
def switch(p: Plant, tables: Floats, scratch: Floats, which: int) -> None:
    """Enter the phase that follows where a margin has run out."""
    m = p.motion
    p.tangent.moved = math.inf
    if which == HEIGHT:
        m.y = p.layer.pad.clear_from  # 0 on smooth surfaces, as it must be
    m.phase = following(m.phase, which, m.v_x - m.belt)
    if m.phase == UNDECIDED:
        take_hold(p, tables, scratch)
    find_slopes(p, tables, scratch, 0, 0.0, m.x, m.y, m.v_x, m.v_y)
