"""What acts on a shoe on any pads, and how far each margin of its phase reaches.

The normal force of a flat pad is continued linearly beyond zero, and an event ends the phase where it vanishes. On
a rough pad patches that appear, merge or vanish make kinks of the order gap^(3/2) inside a phase; the control of
the step finds them.
"""

from brakecli.solver.arrays import Floats
from brakecli.solver.block import BELT, BELT_SLOPE, LOAD, LOAD_SLOPE, V_X, V_Y, X, Y
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact import CLOSED_FORM, EVALUATORS
from brakecli.solver.contact.cells import press
from brakecli.solver.contact.closed_form import CLEAR, FULL, clear, coverage, full_contact, full_press
from brakecli.solver.contact.force import evaluate
from brakecli.solver.double_double import ROUNDING
from brakecli.solver.kernels import kernel
from brakecli.solver.phases import HEIGHT, OPEN, PULL, PUSH, SLIDING, STICK, side_of, stick_or_slip
from brakecli.solver.plant import Plant

NEAR = 3.0
"""Times what the error moves a margin by: one that comes nearer to zero may be an event, or none."""

_CELLS = list(EVALUATORS).index("cells")


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
    m = p.block
    x = abs(m.z[X])
    y = abs(m.z[Y])
    v_x = abs(m.z[V_X])
    v_y = abs(m.z[V_Y])
    load = abs(m.z[LOAD])
    normal = 0.0
    if m.phase != OPEN:
        normal = 2.0 * pad.half_length * pad.k * (y + pad.wheel_bound + pad.shoe_bound)
    along = c.b_xx * v_x + abs(c.b_xy) * v_y + c.c_xx * x + abs(c.c_xy) * y + load * abs(c.sin_beta)
    across = abs(c.b_xy) * v_x + c.b_yy * v_y + abs(c.c_xy) * x + c.c_yy * y + load * c.cos_beta
    along += c.m * abs(m.z[BELT_SLOPE]) + c.phi * normal
    return ROUNDING * along, ROUNDING * (across + normal)


@kernel(inline=False)
def touch(p: Plant, tables: Floats, scratch: Floats, at_x: float, y: float) -> None:
    """Fill `contact` for the phase; the closed form while a bound proves full contact.

    The place is x (m) less what the wheel has travelled since the time that the angles of its waves belong to.
    """
    pad = p.layer.pad
    contact = p.layer.contact
    light = p.runge.light == 1
    on_grid = p.runge.on_grid == 1
    covered = coverage(y, pad)
    if p.block.phase == OPEN or (on_grid and covered == CLEAR):
        clear(contact)
        return
    p.counts.evaluations += 1
    if pad.shoe_terms + pad.wheel_terms == 0 and not on_grid:
        contact.stiffness = 2.0 * pad.half_length * pad.k
        contact.normal_force = -contact.stiffness * y  # Eq. (2), continued: an event ends the phase at y = 0
        contact.fraction = 1.0 if y < 0.0 else 0.0
        contact.store_x = 0.0
        contact.tangential = 0.0
        contact.kind = CLOSED_FORM
        contact.valid = 1
        contact.store = 0.5 * contact.stiffness * y * y
    elif covered != FULL or p.layer.window.rows > 0:
        if light and p.layer.evaluator == _CELLS:
            press(at_x, y, p.layer, tables, scratch, p.runge.steeply == 1)
        else:
            evaluate(at_x, y, p.layer, tables, scratch)
        if covered == FULL:  # the sum over cells is the closed form
            contact.kind = CLOSED_FORM
    elif light:
        full_press(at_x, y, p.layer, tables, scratch)
    else:
        full_contact(at_x, y, p.layer, tables, scratch)


@kernel(inline=False)
def rate(p: Plant, phase: int, w: Floats, since: float, into: Floats) -> None:
    """The derivative of x, y, v_x and v_y by time, (6)-(7), with the contact found last."""
    c = p.c
    z = p.block.z
    force = p.layer.contact.normal_force
    along, across = resistance(c, z[LOAD] + z[LOAD_SLOPE] * since, w[X], w[Y], w[V_X], w[V_Y])
    into[X] = w[V_X]
    into[Y] = w[V_Y]
    into[V_X] = z[BELT_SLOPE] if phase == STICK else (-side_of(phase) * c.phi * force - along) / c.m  # Eq. (6)
    into[V_Y] = (force - across) / c.m  # Eq. (7)


@kernel(inline=False)
def settle(p: Plant, stage: int, w: Floats, since: float) -> None:
    """Rates at a stage, its contact, and the powers of the energy account, from the contact found last.

    The powers are F_x U, -F_x (ẋ - U), ẋ b_xx ẋ + 2 ẋ b_xy ẏ + ẏ b_yy ẏ, Q_x ẋ + Q_y ẏ, and that of the roughness;
    by (6) F_x is m ẍ and what it works against.
    """
    c = p.c
    m = p.block
    r = p.runge
    contact = p.layer.contact
    rate(p, m.phase, w, since, r.slopes[stage])
    r.touch[stage, 0] = contact.normal_force
    r.touch[stage, 1] = contact.stiffness
    r.touch[stage, 2] = contact.tangential
    if m.account == 0:
        return
    load = m.z[LOAD] + m.z[LOAD_SLOPE] * since
    v_x = w[V_X]
    v_y = w[V_Y]
    friction = -side_of(m.phase) * c.phi * contact.normal_force  # Eq. (5)
    if m.phase == STICK:
        friction = c.m * m.z[BELT_SLOPE] + resistance(c, load, w[X], w[Y], v_x, v_y)[0]  # Eq. (4)
    sliding = v_x - m.z[BELT] - m.z[BELT_SLOPE] * since
    powers = r.work_rates[stage]
    r.stores[stage] = contact.store
    powers[0] = friction * (v_x - sliding)
    powers[1] = -friction * sliding
    powers[2] = c.b_xx * v_x * v_x + 2.0 * c.b_xy * v_x * v_y + c.b_yy * v_y * v_y
    powers[3] = load * (c.sin_beta * v_x + c.cos_beta * v_y)
    # Where the store is not followed: what the pad does to it. The rest of its change is the roughness's work.
    powers[4] = contact.store_x * sliding if r.light == 0 else contact.normal_force * v_y


@kernel
def find_again(p: Plant, stage: int) -> None:
    """Make the contact of a stage the one found last."""
    contact = p.layer.contact
    contact.normal_force = p.runge.touch[stage, 0]
    contact.stiffness = p.runge.touch[stage, 1]
    contact.tangential = p.runge.touch[stage, 2]


@kernel(inline=False)
def act(p: Plant, tables: Floats, scratch: Floats, stage: int, since: float, w: Floats) -> None:
    """What acts at a state of the step, `since` its begin (s). In stick x and its velocity become the wheel's."""
    m = p.block
    z = m.z
    passed = (z[BELT] + 0.5 * z[BELT_SLOPE] * since) * since
    stuck = m.phase == STICK
    if stuck:
        w[X] = z[X] + passed
        w[V_X] = z[BELT] + z[BELT_SLOPE] * since
    at_x = z[X] if stuck else w[X] - passed
    if p.runge.on_grid == 1:  # its angles are those of the begin of the span
        at_x = m.anchor if stuck else w[X] - z[BELT] * (m.time + since)
    touch(p, tables, scratch, at_x, w[Y])
    settle(p, stage, w, since)


@kernel
def _take_reached(p: Plant) -> None:
    """Take the motion reached as a state of the step that is to follow."""
    for i in range(4):
        p.runge.w[i] = p.block.z[i]


@kernel
def act_first(p: Plant, tables: Floats, scratch: Floats) -> None:
    """What acts at the motion reached, which is the first stage of the next step."""
    _take_reached(p)
    act(p, tables, scratch, 0, 0.0, p.runge.w)


@kernel(inline=False)
def renew(p: Plant) -> None:
    """Make the contact found last that of the first stage of the next step."""
    _take_reached(p)
    settle(p, 0, p.runge.w, 0.0)


@kernel(inline=False)
def find_margins(p: Plant, w: Floats, acceleration: float, since: float) -> None:
    """The margins of the phase at a state of the step; one that the phase does not have is 1.

    In flight y - clear; otherwise clear - y, in slip side (ẋ - U), in stick φ F_y - needed and φ F_y + needed. F_y
    is what (7) makes of the acceleration along y: no contact is evaluated.
    """
    c = p.c
    m = p.block
    z = m.z
    margin = p.runge.margin
    height = 1.0 if p.runge.on_grid == 1 else p.layer.pad.clear_from - w[Y]
    margin[HEIGHT] = -height if m.phase == OPEN else height
    margin[PULL] = 1.0
    margin[PUSH] = 1.0
    if m.phase == STICK:
        along, across = resistance(c, z[LOAD] + z[LOAD_SLOPE] * since, w[X], w[Y], w[V_X], w[V_Y])
        bound = c.phi * (c.m * acceleration + across)
        needed = c.m * z[BELT_SLOPE] + along
        margin[PULL] = bound - needed
        margin[PUSH] = bound + needed
    elif m.phase != OPEN:
        margin[SLIDING] = side_of(m.phase) * (w[V_X] - z[BELT] - z[BELT_SLOPE] * since)


@kernel(inline=False)
def find_margin_rates(p: Plant, rates: Floats, stiffness: float) -> None:
    """The rates of the margins at a state with these rates and this stiffness of the contact (N/m)."""
    c = p.c
    m = p.block
    rate_of = p.runge.margin_rate
    rate_of[HEIGHT] = rates[Y] if m.phase == OPEN else -rates[Y]
    rate_of[PULL] = 0.0
    rate_of[PUSH] = 0.0
    if m.phase == STICK:
        bound = -c.phi * stiffness * rates[Y]
        needed, _ = resistance(c, m.z[LOAD_SLOPE], rates[X], rates[Y], rates[V_X], rates[V_Y])
        rate_of[PULL] = bound - needed
        rate_of[PUSH] = bound + needed
    elif m.phase != OPEN:
        rate_of[SLIDING] = side_of(m.phase) * (rates[V_X] - m.z[BELT_SLOPE])


@kernel(inline=False)
def falls(p: Plant) -> float:
    """The rate of the margin that has run out, its gradient in `normal`, and the rates before and behind."""
    c = p.c
    m = p.block
    contact = p.layer.contact
    rate(p, m.old, m.z, 0.0, m.arrives)
    rate(p, m.phase, m.z, 0.0, m.leaves)
    n = m.normal
    for i in range(4):
        n[i] = 0.0
    if m.which == HEIGHT:
        n[Y] = 1.0 if m.old == OPEN else -1.0
        return n[Y] * m.arrives[Y]  # type: ignore[no-any-return]
    if m.old != STICK:
        n[V_X] = side_of(m.old)
        return n[V_X] * (m.arrives[V_X] - m.z[BELT_SLOPE])  # type: ignore[no-any-return]
    sign = -1.0 if m.which == PULL else 1.0
    n[X] = c.phi * contact.tangential + sign * c.c_xx
    n[Y] = -c.phi * contact.stiffness + sign * c.c_xy
    n[V_X] = sign * c.b_xx
    n[V_Y] = sign * c.b_xy
    a = m.arrives
    needed, _ = resistance(c, m.z[LOAD_SLOPE], a[X], a[Y], a[V_X], a[V_Y])
    return sign * needed - c.phi * contact.stiffness * a[Y]  # type: ignore[no-any-return]


@kernel(inline=False)
def cone(p: Plant, since: float, w: Floats) -> tuple[float, float]:
    """How far the force that stick takes is within the friction cone (N), and what the error moves that by.

    φ F_y - |needed|, and |δ needed| + φ |∂F_y/∂x δx + ∂F_y/∂y δy|.
    """
    c = p.c
    m = p.block
    contact = p.layer.contact
    e = m.columns[0]
    n = m.columns[1]
    against, _ = resistance(c, m.z[LOAD] + m.z[LOAD_SLOPE] * since, w[X], w[Y], w[V_X], w[V_Y])
    d_x = e[X] + n[X]
    d_y = e[Y] + n[Y]
    more, _ = resistance(c, 0.0, d_x, d_y, e[V_X] + n[V_X], e[V_Y] + n[V_Y])
    pressed = contact.tangential * d_x - contact.stiffness * d_y
    within = c.phi * contact.normal_force - abs(c.m * m.z[BELT_SLOPE] + against)
    return within, abs(more) + c.phi * abs(pressed)


@kernel(inline=False)
def held_phase(p: Plant) -> int:
    """The phase at the motion reached, which moves with the wheel: stick where friction can hold it, (3)-(5).

    A shoe that slips on keeps its velocity: the wheel's is as uncertain as the time, however fast it changes.
    """
    c = p.c
    m = p.block
    z = m.z
    r = p.runge
    t = p.tangent
    bound = c.phi * p.layer.contact.normal_force
    needed = c.m * z[BELT_SLOPE] + resistance(c, z[LOAD], z[X], z[Y], z[BELT], z[V_Y])[0]
    along, _ = rounding(p)
    phase = stick_or_slip(bound - needed, bound + needed, along, along)
    if phase == STICK:
        z[V_X] = z[BELT]
        r.least_hold = min(r.least_hold, max(bound - abs(needed), 0.0))
    else:
        r.least_pass = min(r.least_pass, abs(needed) - bound)
    if t.knows == 1 and bound > 0.0:
        margin, moved = cone(p, 0.0, z)
        if abs(margin) < NEAR * moved:
            t.unsure = min(t.unsure, m.base + m.time)
    return phase
