"""At which values of a number of a case stability may change: real roots of Routh and Hurwitz's conditions.

The conditions are polynomials in each mass, stiffness and damping. For an angle they are polynomials of its
tangent: sine and cosine are divided by the cosine, and all that does not depend on the angle is multiplied by
1 + tan². Each condition as a whole is then multiplied by a positive number.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial, polynomial

from brakecli.analysis.stability.modes import routh_hurwitz
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.links import sin_cos, tensor
from brakecli.solver.steady_sliding import PRESSED


def middles(case: Case, keys: Sequence[str], low: float, high: float) -> list[float]:
    """A value between each two edges in a range of a key: stability is the same at all others between them.

    None on rough pads, whose stiffness depends on the key, and of more keys than one.
    """
    system = system_of(case)
    if not system.smooth or system.belt_speed == 0.0 or len(keys) > 1:
        return []
    low, high = min(low, high), max(low, high)
    size = max(abs(low), abs(high))
    values = edges(case, keys[0], size, system.contact_stiffness, math.copysign(1.0, system.belt_speed), 0.0)
    ends = sorted({low, high, *(value for value in values if low < value < high)})
    return [0.5 * (one + other) for one, other in pairwise(ends)]


def edges(case: Case, key: str, size: float, contact_stiffness: float, sign: float, margin: float) -> list[float]:
    """Every value of a key at which steady sliding may become stable, or pressed, up to (1 + margin) φ.

    The contact stiffness K (N/m) belongs to the case and may depend on the key only as 2ak does; `sign` is that of
    the belt speed U ≠ 0, `size` what is large for the key. At a value both friction coefficients, 0 and the
    largest, decide for those between: Hurwitz' condition is concave in φ, the others are linear.
    """
    x = Polynomial([0.0, 1.0])
    square = Polynomial([1.0])
    friction = Polynomial([case.friction.coefficient])
    stiff = case.link1.stiffness + case.link2.stiffness + contact_stiffness
    units = {"mass": case.shoe.mass, "stiffness": stiff, "damping": math.sqrt(stiff * case.shoe.mass)}
    numbers: dict[str, float | Polynomial] = {"shoe.mass": 1.0, "contact": contact_stiffness / stiff}
    numbers |= {
        f"{name}.{what}": getattr(link, what) / units[what]
        for name, link in (("link1", case.link1), ("link2", case.link2))
        for what in ("stiffness", "damping")
    }
    slopes: dict[str, tuple[float | Polynomial, float]] = {
        "link1": sin_cos(case.link1.angle_deg),
        "link2": sin_cos(case.link2.angle_deg),
    }
    link, _, what = key.rpartition(".")
    if key in numbers:
        numbers[key] = size / units[what] * x
    elif link == "contact":
        size = getattr(case.contact, what)
        numbers[link] = numbers[link] * x
    elif key == "friction.coefficient":
        friction = size * x
    elif what == "angle_deg":
        slopes[link] = (x, 1.0)
        square = 1.0 + x * x
        numbers = {name: value if name.startswith(link) else value * square for name, value in numbers.items()}
    else:
        return []
    m = numbers["shoe.mass"]
    k = numbers["contact"]
    b, c = (
        tensor(numbers[f"link1.{what}"], numbers[f"link2.{what}"], slopes["link1"], slopes["link2"])
        for what in ("damping", "stiffness")
    )
    damped = what == "damping" or case.link1.damping + case.link2.damping > 0.0
    # F_y det(S) over the load, squared as the cosine of link 1 is a root of 1 + tan² there.
    pressed = (k * (c[0] * slopes["link1"][1] - c[1] * slopes["link1"][0])) ** 2
    square = square if link == "link1" else Polynomial([1.0])
    roots = set[float]()
    for phi in (0.0, (1.0 + margin) * friction):
        determinant, apart = routh_hurwitz(m, b, c, k, sign * phi, damped=damped)
        for condition in (determinant, apart, pressed - (PRESSED * determinant) ** 2 * square):
            roots.update(_real_roots(condition))
    if what == "angle_deg":
        return [math.degrees(math.atan(root)) for root in roots]
    return [size * root for root in roots]


def _real_roots(condition: Polynomial | float) -> list[float]:
    """Real roots of a polynomial, or of a number.

    Where products of rank one cancel, rounding leaves coefficients of too high a power. They add roots far away
    and spoil all others, so that small coefficients of high powers are kept once, and once left out.
    """
    coefficients = np.atleast_1d(getattr(condition, "coef", 0.0))
    size = float(np.abs(coefficients).max())
    real = list[float]()
    for least in (0.0, 1e-13 * size):
        with suppress(np.linalg.LinAlgError):  # numbers beyond all bounds
            roots = polynomial.polyroots(polynomial.polytrim(coefficients, least))
            # rounding moves double ones, and one too many is harmless
            real += [float(root.real) for root in roots if abs(root.imag) <= 1e-3 * abs(root)]
    return real
