"""Amontons friction, set-valued: the minimisation that every step of every scheme comes down to, (14)-(17)."""

from brakecli.solver.kernels import kernel
from brakecli.solver.quantities import ContactState

_BACKWARD, _STICK, _FORWARD, _SEPARATED = (float(state) for state in ContactState)  # compiled code knows no enums


@kernel
def minimise(
    a_11: float, a_12: float, a_22: float, g_1: float, g_2: float, g_0: float, belt: float
) -> tuple[float, float, float]:
    """Minimiser (d, e) of a11 d²/2 + a12 d e + a22 e²/2 - g1 d - g2 e + g0 |d - U|, and the sign of d - U.

    a is positive definite and g0 = phi F_y >= 0. The sign is 0 in stick, where d is U exactly.
    """
    inverse = 1.0 / (a_11 * a_22 - a_12 * a_12)  # known before g_1 and g_2 are: no step waits for it
    free = (g_1 * a_22 - g_2 * a_12) * inverse
    bound = g_0 * a_22 * inverse
    if free - bound > belt:  # Eq. (15)
        return free - bound, (g_2 * a_11 - g_1 * a_12 + g_0 * a_12) * inverse, 1.0
    if free + bound < belt:  # Eq. (16)
        return free + bound, (g_2 * a_11 - g_1 * a_12 - g_0 * a_12) * inverse, -1.0
    return belt, (g_2 - a_12 * belt) / a_22, 0.0  # Eq. (17)


@kernel
def slopes(a_11: float, a_12: float, a_22: float, phi: float, side: float) -> tuple[float, float]:
    """Derivatives of d and e, (15)-(17), by the normal force F (g2 grows with F, g0 with phi F), on a `side`."""
    if side == 0.0:
        return 0.0, 1.0 / a_22
    inverse = 1.0 / (a_11 * a_22 - a_12 * a_12)
    return (-a_12 - side * phi * a_22) * inverse, (a_11 + side * phi * a_12) * inverse


@kernel
def observed(sliding: float, holds: bool, needed: float, normal: float, bound: float) -> tuple[float, float]:
    """State of the contact and friction force (N); `needed` keeps the shoe in stick, if friction `holds` it.

    F_x is `needed` in stick, (4), and -side φ F_y in slip, (5).
    """
    if normal == 0.0:
        return _SEPARATED, 0.0
    if holds:
        return _STICK, needed  # Eq. (4)
    if sliding > 0.0 or (sliding == 0.0 and needed < 0.0):
        return _FORWARD, -bound  # Eq. (5)
    return _BACKWARD, bound  # Eq. (5)
