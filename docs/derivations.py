"""Derives the formulas of docs/model.md and docs/errata.md again, with sympy.

Prints one line per check and exits with 1 if any fails. A check that concerns a misprint shows two things: that
the corrected form follows, and that the printed one does not.
"""
# ruff: noqa: T201  (this script's only output is its lines on stdout)

import sys
from collections.abc import Callable

import sympy as sp

CHECKS: list[Callable[[], None]] = []

m, h = sp.symbols("m h", positive=True)
c_xx, c_xy, c_yy, b_xx, b_xy, b_yy = sp.symbols("c_xx c_xy c_yy b_xx b_xy b_yy", real=True)
theta_1, theta_2, theta_3 = sp.symbols("theta_1 theta_2 theta_3", real=True)
F, Q_x, Q_y, U, phi = sp.symbols("F Q_x Q_y U phi", real=True)
x_new, x_now, x_old, y_new, y_now, y_old = sp.symbols("x_new x_now x_old y_new y_now y_old", real=True)
p, q, p_now, q_now, d, e = sp.symbols("p q p_now q_now d e", real=True)


def check(function: Callable[[], None]) -> Callable[[], None]:
    """Register a check; its name and docstring make its line."""
    CHECKS.append(function)
    return function


def zero(*expressions: sp.Expr) -> None:
    """Fail unless every expression vanishes identically."""
    for expression in expressions:
        rest = sp.simplify(sp.expand(expression))
        if rest != 0:
            raise ArithmeticError(f"not zero: {rest}")


def not_zero(*expressions: sp.Expr) -> None:
    """Fail if any expression vanishes identically."""
    for expression in expressions:
        if sp.simplify(sp.expand(expression)) == 0:
            raise ArithmeticError(f"zero: {expression}")


def at_least_zero(*expressions: sp.Expr) -> None:
    """Fail unless sympy knows from the signs of its symbols that every expression is nonnegative."""
    for expression in expressions:
        if not (expression.is_nonnegative or sp.factor(sp.simplify(expression)).is_nonnegative):
            raise ArithmeticError(f"not known to be nonnegative: {expression}")


def close(value: sp.Expr, expected: float) -> None:
    """Fail unless a number agrees with its printed value to the last digits of a double."""
    if abs(sp.N(value, 30) - expected) > 4e-16 * max(1.0, abs(expected)):
        raise ArithmeticError(f"{sp.N(value, 20)} is not {expected!r}")


@check
def links() -> None:
    """(6)-(7): the coefficients follow from the stores and losses of two inclined links; (c) and (b) are >= 0."""
    c_1, c_2, b_1, b_2 = sp.symbols("c_1 c_2 b_1 b_2", nonnegative=True)
    alpha, beta, Q, x, y = sp.symbols("alpha beta Q x y", real=True)
    along_1 = x * sp.sin(beta) + y * sp.cos(beta)  # link 1 at beta to the vertical
    along_2 = x * sp.cos(alpha) - y * sp.sin(alpha)  # link 2 at alpha to the friction plane
    for one, two in ((c_1, c_2), (b_1, b_2)):
        store = (one * along_1**2 + two * along_2**2) / 2
        xx = one * sp.sin(beta) ** 2 + two * sp.cos(alpha) ** 2
        xy = one * sp.cos(beta) * sp.sin(beta) - two * sp.cos(alpha) * sp.sin(alpha)
        yy = one * sp.cos(beta) ** 2 + two * sp.sin(alpha) ** 2
        zero(store.diff(x, x) - xx, store.diff(x, y) - xy, store.diff(y, y) - yy)
        zero(xx * yy - xy**2 - one * two * sp.cos(alpha - beta) ** 2)
        at_least_zero(xx, yy)
    zero((Q * along_1).diff(x) - Q * sp.sin(beta), (Q * along_1).diff(y) - Q * sp.cos(beta))


@check
def uncoupled_links() -> None:
    """After (7): inclined links need not couple x and y; they do not where c_1 sin 2beta = c_2 sin 2alpha."""
    c_1, c_2, alpha, beta = sp.symbols("c_1 c_2 alpha beta", positive=True)
    xy = c_1 * sp.cos(beta) * sp.sin(beta) - c_2 * sp.cos(alpha) * sp.sin(alpha)
    zero(sp.expand_trig(2 * xy - (c_1 * sp.sin(2 * beta) - c_2 * sp.sin(2 * alpha))))
    zero(xy.subs({c_2: c_1, alpha: sp.pi / 6, beta: sp.pi / 3}))


@check
def friction_inequality() -> None:
    """(9): it holds in slip either way and in stick, for every velocity u."""
    bound = sp.symbols("bound", nonnegative=True)  # phi F_y
    speed = sp.symbols("speed", positive=True)  # |x' - U| in slip
    for w in (sp.Symbol("w", nonnegative=True), -sp.Symbol("w", positive=True)):  # u - U
        for direction in (1, -1):
            work = -direction * bound * (w - direction * speed)  # F_x (u - x') in slip
            at_least_zero(work + bound * (sp.Abs(w) - speed))
            at_least_zero(direction * bound * w + bound * sp.Abs(w))  # stick, at both ends of |F_x| <= bound


@check
def inequality_10() -> None:
    """(8), (10): (6) and (7) times the variations; (10) minus (8) is what (9) says is >= 0."""
    L_x, L_y, F_x, u, v, x_dot, y_dot = sp.symbols("L_x L_y F_x u v x_dot y_dot", real=True)
    sliding = sp.Abs(u - U) - sp.Abs(x_dot - U)
    eight = (L_x - F_x + Q_x) * (u - x_dot) + (L_y - F + Q_y) * (v - y_dot)
    ten = (L_x + Q_x) * (u - x_dot) + phi * F * sliding + (L_y - F + Q_y) * (v - y_dot)
    zero(ten - eight - (F_x * (u - x_dot) + phi * F * sliding))


def three_layer_rows() -> tuple[sp.Expr, sp.Expr]:
    """The two brackets of (11), with the contact force F of the weighted positions."""

    def row(a: sp.Expr, bs: tuple[sp.Expr, ...], cs: tuple[sp.Expr, ...]) -> sp.Expr:
        new, now, old = a
        x_mean = theta_1 * x_new + theta_2 * x_now + theta_3 * x_old
        y_mean = theta_1 * y_new + theta_2 * y_now + theta_3 * y_old
        rates = bs[0] * (x_new - x_old) / (2 * h) + bs[1] * (y_new - y_old) / (2 * h)
        return m * (new - 2 * now + old) / h**2 + rates + cs[0] * x_mean + cs[1] * y_mean

    along = row((x_new, x_now, x_old), (b_xx, b_xy), (c_xx, c_xy)) + Q_x
    across = row((y_new, y_now, y_old), (b_xy, b_yy), (c_xy, c_yy)) - F + Q_y
    by_velocity = {x_new: x_old + 2 * h * d, y_new: y_old + 2 * h * e}
    return along.subs(by_velocity), across.subs(by_velocity)


@check
def three_layer_positions() -> None:
    """(12): 2m(d - delta)/h is the acceleration; the weight of the old position is theta_3 + theta_1."""
    delta = (x_now - x_old) / h
    new = x_old + 2 * h * d
    zero(2 * m * (d - delta) / h - m * (new - 2 * x_now + x_old) / h**2)
    mean = theta_1 * new + theta_2 * x_now + theta_3 * x_old
    zero(2 * h * theta_1 * d + theta_2 * x_now + (theta_3 + theta_1) * x_old - mean)
    not_zero(2 * h * theta_1 * d + theta_2 * x_now + (theta_3 - theta_1) * x_old - mean)


@check
def three_layer_minimum() -> None:
    """(14): the gradient of the smooth part of J_1 is the two brackets of (11), at the force F."""
    a_11 = 2 * m / h + b_xx + 2 * c_xx * h * theta_1
    a_12 = b_xy + 2 * c_xy * h * theta_1
    a_22 = 2 * m / h + b_yy + 2 * c_yy * h * theta_1
    x_part = theta_2 * x_now + (theta_3 + theta_1) * x_old
    y_part = theta_2 * y_now + (theta_3 + theta_1) * y_old
    g_1 = 2 * m * (x_now - x_old) / h / h - c_xx * x_part - c_xy * y_part - Q_x
    g_2 = 2 * m * (y_now - y_old) / h / h - c_yy * y_part - c_xy * x_part + F - Q_y
    along, across = three_layer_rows()
    zero(a_11 * d + a_12 * e - g_1 - along, a_12 * d + a_22 * e - g_2 - across)


def two_layer_rows(sign: int = 1) -> tuple[sp.Expr, sp.Expr]:
    """The two brackets of (18) after (21)-(22), with sign -1 for the printed b_yx."""

    def mean(new: sp.Expr, now: sp.Expr) -> sp.Expr:
        return theta_1 * new + (1 - theta_1) * now

    x = x_now + h * (theta_2 * p + (1 - theta_2) * p_now)
    y = y_now + h * (theta_2 * q + (1 - theta_2) * q_now)
    p_mean = mean(p, p_now)
    q_mean = mean(q, q_now)
    x_mean = mean(x, x_now)
    y_mean = mean(y, y_now)
    along = m * (p - p_now) / h + b_xx * p_mean + c_xx * x_mean + b_xy * q_mean + c_xy * y_mean + Q_x
    across = m * (q - q_now) / h + b_yy * q_mean + c_yy * y_mean + sign * b_xy * p_mean + c_xy * x_mean - F + Q_y
    return along, across


@check
def two_layer_substituted() -> None:
    """(18), (23): (21)-(22) in (18) give (23) with + b_yx; the printed - b_yx contradicts (23) and (25)."""

    def part(b: sp.Expr, c: sp.Expr, new: sp.Expr, now: sp.Expr) -> sp.Expr:
        return theta_1 * new * (b + theta_2 * c * h) + now * ((1 - theta_1) * b + theta_1 * (1 - theta_2) * c * h)

    along = m * (p - p_now) / h + part(b_xx, c_xx, p, p_now) + c_xx * x_now
    along += part(b_xy, c_xy, q, q_now) + c_xy * y_now + Q_x
    across = m * (q - q_now) / h + part(b_yy, c_yy, q, q_now) + c_yy * y_now
    across += part(b_xy, c_xy, p, p_now) + c_xy * x_now - F + Q_y
    zero(along - two_layer_rows()[0], across - two_layer_rows()[1])
    not_zero(across - two_layer_rows(sign=-1)[1])
    mean = theta_1 * (x_now + h * (theta_2 * p + (1 - theta_2) * p_now)) + (1 - theta_1) * x_now
    zero(x_now + theta_1 * theta_2 * p * h + theta_1 * (1 - theta_2) * p_now * h - mean)  # argument of F_y in (23)


@check
def two_layer_minimum() -> None:
    """(25): the gradient of the smooth part of J_2 is the two brackets of (23); the printed g_1, g_2 are not."""
    a_11 = m / h + theta_1 * (b_xx + theta_2 * c_xx * h)
    a_12 = theta_1 * (b_xy + theta_2 * c_xy * h)
    a_22 = m / h + theta_1 * (b_yy + theta_2 * c_yy * h)

    def old(b: sp.Expr, c: sp.Expr) -> sp.Expr:
        return (1 - theta_1) * b + theta_1 * (1 - theta_2) * c * h

    rest_1 = -c_xx * x_now - q_now * old(b_xy, c_xy) - c_xy * y_now - Q_x
    rest_2 = -c_yy * y_now - c_xy * x_now + F - Q_y
    g_1 = m * p_now / h - p_now * old(b_xx, c_xx) + rest_1
    g_2 = m * q_now / h - q_now * old(b_yy, c_yy) - p_now * old(b_xy, c_xy) + rest_2
    printed_1 = m / h - p_now * old(b_xx, c_xx) + rest_1
    printed_2 = m / h - p_now * old(b_yy, c_yy) - q_now * old(b_xy, c_xy) + rest_2
    along, across = two_layer_rows()
    zero(a_11 * p + a_12 * q - g_1 - along, a_12 * p + a_22 * q - g_2 - across)
    not_zero(a_11 * p + a_12 * q - printed_1 - along, a_12 * p + a_22 * q - printed_2 - across)


@check
def minimiser() -> None:
    """(15)-(17): each branch solves 0 in dJ, with the kink at U; exactly one applies; J is strictly convex."""
    a_11, a_22, det = sp.symbols("a_11 a_22 a", positive=True)
    a_12, g_1, g_2 = sp.symbols("a_12 g_1 g_2", real=True)
    g_0 = sp.symbols("g_0", nonnegative=True)
    a = a_11 * a_22 - a_12**2

    def slip(side: int) -> tuple[sp.Expr, sp.Expr]:
        along = (g_1 * a_22 - g_2 * a_12 - side * g_0 * a_22) / a
        return along, (g_2 * a_11 - g_1 * a_12 + side * g_0 * a_12) / a

    for side in (1, -1):
        along, across = slip(side)
        zero(a_11 * along + a_12 * across - g_1 + side * g_0, a_12 * along + a_22 * across - g_2)
    stuck = (g_2 - a_12 * U) / a_22
    zero(a_12 * U + a_22 * stuck - g_2)
    # In stick the subgradient is g_0 s with |s| <= 1; its ends are the conditions of (15) and (16).
    multiplier = g_1 - a_11 * U - a_12 * stuck
    for side in (1, -1):
        zero(multiplier - side * g_0 - a / a_22 * (slip(side)[0] - U))
    zero(slip(-1)[0] - slip(1)[0] - 2 * g_0 * a_22 / a)
    at_least_zero(2 * g_0 * a_22 / det)  # so (15) and (16) never hold together
    # a > 0: mass on the diagonal, and what the links add is positive semidefinite (check links).
    mass, xx, yy = sp.symbols("mass xx yy", nonnegative=True)
    xy, minor = sp.symbols("xy minor", nonnegative=True)
    zero((mass + xx) * (mass + yy) - xy**2 - (mass**2 + mass * (xx + yy) + minor).subs(minor, xx * yy - xy**2))
    at_least_zero(mass**2 + mass * (xx + yy) + minor)


@check
def two_layer_order() -> None:
    """(18)-(22): second order exactly for theta = (1/2, 1/2), with the forces at t + theta_1 h."""
    b, c, x0, v0, f0, f1, shift = sp.symbols("b c x0 v0 f0 f1 shift", real=True)
    new_p = sp.Symbol("new_p", real=True)
    new_x = x0 + h * (theta_2 * new_p + (1 - theta_2) * v0)
    mean_x = theta_1 * new_x + (1 - theta_1) * x0
    mean_p = theta_1 * new_p + (1 - theta_1) * v0
    balance = m * (new_p - v0) / h + b * mean_p + c * mean_x - (f0 + f1 * shift * h)
    step_p = sp.solve(balance, new_p)[0]
    step_x = new_x.subs(new_p, step_p)
    a0 = (f0 - b * v0 - c * x0) / m
    j0 = (f1 - b * a0 - c * v0) / m
    error_p = sp.expand(sp.series(step_p, h, 0, 3).removeO() - (v0 + h * a0 + h**2 * j0 / 2))
    error_x = sp.expand(sp.series(step_x, h, 0, 3).removeO() - (x0 + h * v0 + h**2 * a0 / 2))
    half = sp.Rational(1, 2)
    for power in (0, 1):
        zero(error_p.coeff(h, power), error_x.coeff(h, power))
    zero(error_p.coeff(h, 2).subs(shift, theta_1) - (theta_1 - half) * j0)
    zero(error_x.coeff(h, 2) - (theta_2 - half) * a0)
    not_zero(error_p.subs({theta_1: half, theta_2: half, shift: 1}))  # wheel and load at the new level instead


@check
def three_layer_order() -> None:
    """(11): second order exactly for theta_1 = theta_3, with the forces at t + (theta_1 - theta_3) h."""
    b, c, shift = sp.symbols("b c shift", real=True)
    x = sp.symbols("x0:6", real=True)  # x and its derivatives at t

    def at(time: sp.Expr) -> sp.Expr:
        return sum(x[i] * time**i / sp.factorial(i) for i in range(6))

    force = m * x[2] + b * x[1] + c * x[0]
    force += (m * x[3] + b * x[2] + c * x[1]) * shift * h + (m * x[4] + b * x[3] + c * x[2]) * (shift * h) ** 2 / 2
    middle = 1 - theta_1 - theta_3
    residual = m * (at(h) - 2 * x[0] + at(-h)) / h**2 + b * (at(h) - at(-h)) / (2 * h)
    residual = sp.expand(residual + c * (theta_1 * at(h) + middle * x[0] + theta_3 * at(-h)) - force)
    zero(residual.coeff(h, 0))
    weighted = sp.expand(residual.subs(shift, theta_1 - theta_3))
    zero(weighted.coeff(h, 1) + (theta_1 - theta_3) * (m * x[3] + b * x[2]))
    not_zero(residual.subs({theta_3: theta_1, shift: 1}).coeff(h, 1))  # wheel and load at the new level
    free = weighted.subs({theta_3: theta_1, b: 0}).coeff(h, 2).subs(x[4], -c * x[2] / m)
    # Undamped and free, the weights (1/12, 10/12, 1/12) are of fourth order.
    zero(free - c * x[2] * (theta_1 - sp.Rational(1, 12)))


@check
def three_layer_stability() -> None:
    """(11): with theta_1 = theta_3 stable for w^2 h^2 (1 - 4 theta_1) < 4: always at 1/4, w h < sqrt 6 at 1/12."""
    kappa, theta, z = sp.symbols("kappa theta z", positive=True)
    polynomial = (z**2 - 2 * z + 1) + kappa * (theta * z**2 + (1 - 2 * theta) * z + theta)
    quadratic = sp.Poly(polynomial, z)
    zero(quadratic.coeff_monomial(z**2) - quadratic.coeff_monomial(1))  # the two roots have the product 1
    bound = 4 - kappa * (1 - 4 * theta)
    zero(sp.discriminant(polynomial, z) + kappa * bound)  # complex roots, so |z| = 1, while the bound is positive
    zero(bound.subs({theta: sp.Rational(1, 12), kappa: 6}))
    at_least_zero(bound.subs(theta, sp.Rational(1, 4)))


@check
def three_layer_start() -> None:
    """(11): x^1 = x^0 leaves an error h a/2 in the first velocity; x^0 + h v + h^2 a/2 leaves one of order h^2."""
    x0, v0, a0, j0 = sp.symbols("x0 v0 a0 j0", real=True)
    exact = x0 + h * v0 + h**2 * a0 / 2 + h**3 * j0 / 6
    zero((exact - x0).subs(v0, 0) / h - (h * a0 / 2 + h**2 * j0 / 6))
    zero((exact - (x0 + h * v0 + h**2 * a0 / 2)) / h - h**2 * j0 / 6)


@check
def scalar_step() -> None:
    """Step as r(F) = 0: slopes of d and e from (15)-(17), r' by the chain rule, gain of the fixed-point loop."""
    a_11, a_12, a_22, g_1, g_2, w, x0, y0 = sp.symbols("a_11 a_12 a_22 g_1 g_2 w x0 y0", real=True)
    a = a_11 * a_22 - a_12**2
    for side in (1, -1):
        slip_d = (g_1 * a_22 - (g_2 + F) * a_12 - side * phi * F * a_22) / a
        slip_e = ((g_2 + F) * a_11 - g_1 * a_12 + side * phi * F * a_12) / a
        zero(slip_d.diff(F) + (a_12 + side * phi * a_22) / a, slip_e.diff(F) - (a_11 + side * phi * a_12) / a)
    zero(((g_2 + F - a_12 * U) / a_22).diff(F) - 1 / a_22)
    contact = sp.Function("F_y")
    slip_d = sp.Function("d")(F)
    slip_e = sp.Function("e")(F)
    slope = (contact(x0 + w * slip_d, y0 + w * slip_e) - F).diff(F).doit()
    at_x, at_y = sp.symbols("at_x at_y", real=True)
    G = contact(at_x, at_y).diff(at_x).subs({at_x: x0 + w * slip_d, at_y: y0 + w * slip_e})
    K_t = -contact(at_x, at_y).diff(at_y).subs({at_x: x0 + w * slip_d, at_y: y0 + w * slip_e})
    zero((slope - (-1 - w * (K_t * slip_e.diff(F) - G * slip_d.diff(F)))).doit())
    K = sp.Symbol("K", positive=True)  # a flat pad: G = 0; leading order in h, for every phi
    for mass, gain, limit in (
        (m / h, theta_1 * theta_2 * h, theta_1 * theta_2 * h**2 * K / m),
        (2 * m / h, 2 * theta_1 * h, theta_1 * h**2 * K / m),
    ):
        inertia = {a_11: mass + b_xx, a_22: mass + b_yy, a_12: b_xy}
        contraction = (gain * K * (a_11 + phi * a_12) / a).subs(inertia)
        zero(sp.limit(contraction / limit, h, 0) - 1)


@check
def full_contact() -> None:
    """(2), full contact: F_y = 2ak[-y + sum g_2 sinc(w_2 a) sin(w_2 (x - Ut))]; f_1 adds a constant, or 0."""
    a, k, g, w = sp.symbols("a k g w", positive=True)
    xi, s, y, psi = sp.symbols("xi s y psi", real=True)
    sinc = sp.sin(w * a) / (w * a)
    wheel = sp.integrate(sp.expand_trig(g * sp.sin(w * xi + (w * s + psi))), (xi, -a, a))
    zero(sp.expand_trig(wheel - 2 * a * g * sinc * sp.sin(w * s + psi)))
    shoe = sp.integrate(sp.expand_trig(g * sp.sin(w * xi + psi)), (xi, -a, a))
    zero(shoe.subs(psi, 0))
    zero(shoe - 2 * a * g * sinc * sp.sin(psi), shoe.diff(s))
    zero(sp.integrate(-k * y, (xi, -a, a)) + 2 * a * k * y)
    n = sp.Symbol("n", integer=True, positive=True)
    zero(sinc.subs(w, n * sp.pi / a))  # n wavelengths in the length 2a: not felt


@check
def touching_interval() -> None:
    """(2) on one touching interval: dF_y/dy = -k length, dF_y/dx = k [f_2] between its ends."""
    k = sp.Symbol("k", positive=True)
    xi, s, y, left, right = sp.symbols("xi s y left right", real=True)
    f_1 = sp.Function("f_1")
    f_2 = sp.Function("f_2")
    gap = f_2(xi + s) - f_1(xi) - y  # vanishes at the ends, so that moving ends add nothing
    zero(sp.integrate(k * gap.diff(y), (xi, left, right)) + k * (right - left))
    primitive = k * f_2(xi + s)
    zero(primitive.diff(xi) - k * gap.diff(s))


def sliding_matrix() -> tuple[sp.Matrix, sp.Symbol, sp.Symbol]:
    """Stiffness of small disturbances of steady sliding, U > 0: F_x = phi F_y, F_y = -K y."""
    K, coefficient = sp.symbols("K phi", positive=True)
    return sp.Matrix([[c_xx, c_xy + coefficient * K], [c_xy, c_yy + K]]), K, coefficient


@check
def flutter_and_divergence() -> None:
    """Steady sliding, undamped: flutter from phi_cr where c_xy < 0, divergence where c_xy > 0."""
    stiffness, K, coefficient = sliding_matrix()
    x, y = sp.symbols("x y", real=True)
    along = c_xx * x + c_xy * y - coefficient * (-K * y)
    across = c_xy * x + c_yy * y - (-K * y)
    zero(along.diff(x) - stiffness[0, 0], along.diff(y) - stiffness[0, 1])
    zero(across.diff(x) - stiffness[1, 0], across.diff(y) - stiffness[1, 1])
    square = sp.Symbol("square")  # of the circular frequency
    polynomial = sp.expand((stiffness - square * sp.eye(2)).det())
    size = sp.Symbol("size", positive=True)  # |c_xy|
    flutter = (size + (c_xx - c_yy - K) ** 2 / (4 * size)) / K
    zero(sp.discriminant(polynomial, square).subs({c_xy: -size, coefficient: flutter}))
    zero(sp.discriminant(polynomial, square).subs(c_xy, -size).diff(coefficient) + 4 * size * K)  # falls with phi
    divergence = (c_xx * (c_yy + K) - c_xy**2) / (K * c_xy)
    zero(stiffness.det().subs(coefficient, divergence), stiffness.det().diff(coefficient) + K * c_xy)
    coupled = (c_xx - c_yy - K) ** 2 + 4 * size * (size + coefficient * K)
    zero(sp.discriminant(polynomial, square).subs(c_xy, size) - coupled)
    at_least_zero(coupled)  # c_xy > 0: the squares stay real, so no flutter
    zero(sp.discriminant(polynomial, square).subs(c_xy, 0) - (c_xx - c_yy - K) ** 2)
    zero(stiffness.det().subs(c_xy, 0) - c_xx * (c_yy + K))


@check
def least_critical_friction() -> None:
    """beta = 0: the least phi_cr over c_2 is (1 + c_1/K) tan alpha, at c_2 = c_1 + K."""
    c_1, c_2, K, alpha = sp.symbols("c_1 c_2 K alpha", positive=True)
    sine = sp.sin(alpha)
    cosine = sp.cos(alpha)
    size = c_2 * sine * cosine
    difference = c_2 * cosine**2 - (c_1 + c_2 * sine**2) - K
    flutter = (size + difference**2 / (4 * size)) / K
    slope = (c_2**2 - (c_1 + K) ** 2) / (4 * K * c_2**2 * sine * cosine)  # negative below c_1 + K, positive above
    zero(sp.simplify(flutter.diff(c_2) - slope))
    zero(sp.trigsimp(flutter.subs(c_2, c_1 + K) - (1 + c_1 / K) * sp.tan(alpha)))
    elsewhere = flutter.subs({c_2: 2 * (c_1 + K)})  # off the least value it does not even vanish with the angle
    if sp.limit(elsewhere.subs({c_1: 1, K: 1}), alpha, 0, "+") != sp.oo:
        raise ArithmeticError("the critical coefficient stays finite for small angles")


@check
def mode_coupling_numbers() -> None:
    """Minimal model of mode coupling: critical at 3/4 with w^2 = 2; growth and frequency at phi = 1."""
    root = sp.sqrt(3)
    c_1 = sp.Rational(2, 3) * (2 - root)
    c_2 = sp.Rational(2, 3) * (2 + root)
    K = sp.Rational(4, 3)
    alpha = sp.pi / 6
    beta = sp.pi / 3
    xx = c_1 * sp.sin(beta) ** 2 + c_2 * sp.cos(alpha) ** 2
    xy = c_1 * sp.sin(beta) * sp.cos(beta) - c_2 * sp.sin(alpha) * sp.cos(alpha)
    yy = c_1 * sp.cos(beta) ** 2 + c_2 * sp.sin(alpha) ** 2
    zero(xx - 2, xy + 1, yy + K - 2)
    zero((-xy + (xx - yy - K) ** 2 / (-4 * xy)) / K - sp.Rational(3, 4))
    # x'' + M x = 0 with M = [[2, -1 + 4 phi/3], [-1, 2]] has (lambda^2 + 2)^2 = 1 - 4 phi/3
    square = -2 + sp.I * sp.sqrt(sp.Rational(1, 3))
    growth = sp.sqrt((sp.Abs(square) - 2) / 2)
    frequency = sp.sqrt((sp.Abs(square) + 2) / 2)
    zero((growth + sp.I * frequency) ** 2 - square)
    close(growth, 0.2020717687680948)
    close(frequency, 1.4285772641803685)


@check
def coulomb_oscillator_numbers() -> None:
    """Coulomb oscillator: peaks at sqrt(205) - 1 and 2 less each half cycle, rest at 0.6821789367236466."""
    peak = sp.sqrt((12 + 1) ** 2 + 6**2) - 1  # forward slip: a circle about x = -1
    zero(peak - (sp.sqrt(205) - 1))
    turns = 0
    while peak > 1:  # beyond 1 the spring breaks it loose: half a circle about +1 or -1
        peak = peak - 2
        turns = turns + 1
    if turns != 7:
        raise ArithmeticError(f"{turns} half cycles")
    close(-peak, 0.6821789367236466)  # the seventh half cycle ends beyond zero, on the side it started from


@check
def energy_account() -> None:
    """Energy: its rate is F_x U - phi F_y |x' - U| - dashpots - load + (dV/ds)(x' - U); dV/dy = -F_y."""
    t = sp.Symbol("t", real=True)
    x, y, speed, travel = (sp.Function(name)(t) for name in ("x", "y", "U", "L"))
    F_x, F_y = sp.symbols("F_x F_y", real=True)
    V = sp.Function("V")
    at_s, at_y = sp.symbols("at_s at_y", real=True)
    here = {at_s: x - travel, at_y: y}
    kinetic = m * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2
    links_store = c_xx * x**2 / 2 + c_xy * x * y + c_yy * y**2 / 2
    dashpots = b_xx * x.diff(t) ** 2 + 2 * b_xy * x.diff(t) * y.diff(t) + b_yy * y.diff(t) ** 2
    motion = {
        x.diff(t, 2): (F_x - Q_x - b_xx * x.diff(t) - c_xx * x - b_xy * y.diff(t) - c_xy * y) / m,
        y.diff(t, 2): (F_y - Q_y - b_yy * y.diff(t) - c_yy * y - b_xy * x.diff(t) - c_xy * x) / m,
    }
    V_s, V_y = (V(at_s, at_y).diff(name).subs(here) for name in (at_s, at_y))
    store_rate = V_s * (x.diff(t) - speed) + V_y * y.diff(t)
    zero((V(x - travel, y).diff(t) - store_rate).subs(travel.diff(t), speed).doit())
    rate = ((kinetic + links_store).diff(t).subs(motion) + store_rate).subs(V_y, -F_y)
    sliding = x.diff(t) - speed
    load = Q_x * x.diff(t) + Q_y * y.diff(t)
    zero(rate - (F_x * speed + F_x * sliding - dashpots - load + V_s * sliding))
    slip = sp.Symbol("slip", positive=True)
    for side in (1, -1):  # F_x (x' - U) = -phi F_y |x' - U| in slip; in stick both sides vanish
        zero((-side * phi * F_y) * (side * slip) + phi * F_y * sp.Abs(side * slip))
    k, gap, height = sp.symbols("k gap height", positive=True)
    zero((k * (gap - height) ** 2 / 2).diff(height) + k * (gap - height))  # dV/dy = -F_y, spring by spring


@check
def scheme_energy() -> None:
    """Energy: what weights other than one half (two-layer) and theta_1 = theta_3 (three-layer) take out."""
    half = sp.Rational(1, 2)
    quarter = sp.Rational(1, 4)
    move = (theta_2 * p + (1 - theta_2) * p_now) * h
    inertia = m * (p - p_now) / h * move - m * (p**2 - p_now**2) / 2
    zero(inertia - m * (theta_2 - half) * (p - p_now) ** 2)
    spring = (theta_1 * x_new + (1 - theta_1) * x_now) * (x_new - x_now) - (x_new**2 - x_now**2) / 2
    zero(spring - (theta_1 - half) * (x_new - x_now) ** 2)

    def pair(new: sp.Expr, old: sp.Expr) -> sp.Expr:  # a spring's store for a pair of levels
        return ((new + old) / 2) ** 2 / 2 + ((theta_1 + theta_3) / 2 - quarter) * (new - old) ** 2 / 2

    move = (x_new - x_old) / 2
    inertia = m * (x_new - 2 * x_now + x_old) / h**2 * move
    zero(inertia - m * (((x_new - x_now) / h) ** 2 - ((x_now - x_old) / h) ** 2) / 2)
    spring = (theta_1 * x_new + (1 - theta_1 - theta_3) * x_now + theta_3 * x_old) * move
    zero(spring - (pair(x_new, x_now) - pair(x_now, x_old)) - (theta_1 - theta_3) * move**2)


@check
def linear_phases() -> None:
    """Piecewise-exact: each phase is linear in z and solves (6)-(7); its powers are those of the account."""
    x, y, v_x, v_y, slope, Q, sin, cos = z = sp.symbols("x y v_x v_y slope Q sin cos", real=True)
    K = sp.Symbol("K", positive=True)
    resist_x = b_xx * v_x + b_xy * v_y + c_xx * x + c_xy * y + Q * sin
    resist_y = b_xy * v_x + b_yy * v_y + c_xy * x + c_yy * y + Q * cos
    needed = m * slope + resist_x.subs(v_x, U)
    for side, touching in ((-1, 1), (0, 1), (1, 1), (0, 0)):
        pressed = -touching * K * y
        sticks = side == 0 and touching == 1
        force = needed if sticks else -side * phi * pressed
        a_x = slope if sticks else (force - resist_x) / m
        a_y = (pressed - resist_y) / m
        at_wheel = {v_x: U} if sticks else {}
        zero((m * a_x + resist_x - force).subs(at_wheel), m * a_y + resist_y - pressed)  # (6) and (7)
        margins = (pressed, side * (v_x - U)) if not sticks else (phi * pressed - needed, phi * pressed + needed)
        for row in (a_x, a_y, force, *margins):
            zero(*(row.diff(one, other) for one in (*z[:6], U) for other in (*z[:6], U)))
        store = (
            m * (v_x**2 + v_y**2) / 2 + c_xx * x**2 / 2 + c_xy * x * y + c_yy * y**2 / 2 + touching * K * y**2 / 2
        )
        rate = store.diff(x) * v_x + store.diff(y) * v_y + store.diff(v_x) * a_x + store.diff(v_y) * a_y
        dashpots = b_xx * v_x**2 + 2 * b_xy * v_x * v_y + b_yy * v_y**2
        powers = force * U - force * (U - v_x) - dashpots - Q * (sin * v_x + cos * v_y)
        zero((rate - powers).subs(at_wheel))


@check
def unique_step() -> None:
    """Step on a flat pad: r' < 0 on every branch where phi |a_12| < a_11, whatever the contact's stiffness."""
    a_11, a, w, K, coupling, spare = sp.symbols("a_11 a w K coupling spare", positive=True)
    for side in (1, -1):  # a_11 = phi |a_12| + spare; coupling = phi a_12 of either sign
        for sign in (1, -1):
            e_slope = (a_11 + side * sign * coupling) / a
            at_least_zero(-(-1 - w * K * e_slope).subs(a_11, coupling + spare))


@check
def routh_hurwitz() -> None:
    """Steady sliding: Hurwitz' condition over m as the code has it; concave in phi, and det(S) is linear."""
    from brakecli.analysis.stability.modes import routh_hurwitz as conditions

    m, k, phi, s = sp.symbols("m K phi s", positive=True)
    b = sp.symbols("b_xx b_xy b_yy", real=True)
    c = sp.symbols("c_xx c_xy c_yy", real=True)
    determinant, apart = conditions(m, b, c, k, phi, damped=True)
    matrix = m * s**2 * sp.eye(2) + sp.Matrix([[0, phi * k], [0, k]])
    matrix += sp.Matrix(2, 2, lambda i, j: s * b[int(i + j)] + c[int(i + j)])
    a4, a3, a2, a1, a0 = sp.Poly(matrix.det(), s).all_coeffs()
    zero(a0 - determinant, a1 * a2 * a3 - a1**2 * a4 - a0 * a3**2 - m * apart)
    zero(sp.diff(apart, phi, 2) + 2 * m * (b[1] * k) ** 2, sp.diff(determinant, phi, 2))


def main() -> int:
    """Run all checks; 1 if any fails."""
    failed = 0
    for function in CHECKS:
        try:
            function()
        except ArithmeticError as error:
            failed += 1
            print(f"FAILED {function.__name__}: {error}")
        else:
            print(f"ok     {function.__name__}: {function.__doc__}")
    print(f"{len(CHECKS) - failed} of {len(CHECKS)} checks hold")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
