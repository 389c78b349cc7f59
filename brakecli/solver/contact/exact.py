"""The contact exactly: the roots of the gap bound the touching intervals, and on each the integral is closed.

No pair of roots is missed: a cell is passed only when bounds on the gap's derivatives prove that it has no root,
or that the gap is monotone there; otherwise it is halved. A gap that is within its rounding all over a cell
counts as touching or not by its sign in the middle, so that the walk ends also where two equal profiles meet.
"""

import math
from typing import Any

from numba import float64, int64, types, void

from brakecli.solver.compile import Floats, kernel, stopped, vector
from brakecli.solver.contact import EXACT
from brakecli.solver.contact.closed_form import CLEAR, FULL, clear, coverage
from brakecli.solver.records import CONTACT_TYPE, EVALUATE, PAD_TYPE, Layer

# `waves` holds, for every harmonic of the gap (the wheel's first, the shoe's with minus): amplitude,
# wavenumber, phase, and for one interval the phase in its middle (sine, cosine) and the half width times omega.
SINE, COSINE, HALF_TURN = 3, 4, 5

_EPSILON = 2.220446049250313e-16


@kernel(types.UniTuple(float64, 4)(float64, float64, int64, vector))
def _gap(xi: float, y: float, n: int, waves: Floats) -> tuple[float, float, float, float]:
    """The gap f2 - f1 - y at xi, m, and its first three derivatives."""
    gap, slope, second, third = -y, 0.0, 0.0, 0.0
    for i in range(n):
        omega = waves[n + i]
        psi = omega * xi + waves[2 * n + i]
        sine, cosine = waves[i] * math.sin(psi), waves[i] * omega * math.cos(psi)
        gap += sine
        slope += cosine
        second -= omega * omega * sine
        third -= omega * omega * cosine
    return gap, slope, second, third


@kernel(float64(float64, float64, float64, float64, int64, vector))
def _root(left: float, right: float, at_left: float, y: float, n: int, waves: Floats) -> float:
    """The root of a gap that is monotone on [left, right] and changes sign: Newton inside the bracket."""
    xi = 0.5 * (left + right)
    for _ in range(100):
        gap, slope, _, _ = _gap(xi, y, n, waves)
        if (gap > 0.0) == (at_left > 0.0):
            left = xi
        else:
            right = xi
        new = xi - gap / slope if slope != 0.0 else left
        if not (left < new < right):
            new = 0.5 * (left + right)
        if abs(new - xi) <= 2e-16 * max(abs(left), abs(right)):
            return new
        xi = new
    return xi


@kernel(float64(float64, float64))
def _sinc_of(sine: float, z: float) -> float:
    """sin(z)/z for a sine that is already known; the quotient loses no digits, however small z is."""
    return sine / z if z != 0.0 else 1.0


@kernel(void(float64, float64, float64, PAD_TYPE, vector, CONTACT_TYPE))
def _add_interval(left: float, right: float, y: float, pad: Any, waves: Floats, contact: Any) -> None:
    """Add the closed integrals of a touching interval, without the factor k."""
    wheel_terms, n = pad.wheel_terms, pad.wheel_terms + pad.shoe_terms
    length, middle = right - left, 0.5 * (left + right)
    at_sine, at_cosine, at_half = SINE * n, COSINE * n, HALF_TURN * n
    heights, rise = 0.0, 0.0  # ∫ (f2 - f1), and f2(right) - f2(left) = ∫ f2'
    for i in range(n):
        g, omega = waves[i], waves[n + i]
        psi, half = omega * middle + waves[2 * n + i], 0.5 * omega * length
        sine, cosine, sine_half = math.sin(psi), math.cos(psi), math.sin(half)
        waves[at_sine + i], waves[at_cosine + i], waves[at_half + i] = sine, cosine, half
        heights += g * length * _sinc_of(sine_half, half) * sine
        if i < wheel_terms:
            rise += 2.0 * g * cosine * sine_half
    square, work = 0.0, 0.0  # ∫ (f2 - f1)², ∫ (f2 - f1) f2'
    for i in range(n):
        if stopped(pad.signals):
            return
        for j in range(n):
            half_i, half_j = waves[at_half + i], waves[at_half + j]
            minus = _sinc_of(math.sin(half_i - half_j), half_i - half_j)
            plus = _sinc_of(math.sin(half_i + half_j), half_i + half_j)
            s_i, c_i, s_j, c_j = waves[at_sine + i], waves[at_cosine + i], waves[at_sine + j], waves[at_cosine + j]
            g = 0.5 * length * waves[i] * waves[j]
            square += g * (minus * (c_i * c_j + s_i * s_j) - plus * (c_i * c_j - s_i * s_j))
            if j < wheel_terms:
                work += g * waves[n + j] * (plus * (s_i * c_j + c_i * s_j) + minus * (s_i * c_j - c_i * s_j))
    contact.normal_force += heights - y * length
    contact.stiffness += length
    contact.tangential += rise
    contact.store += 0.5 * (square + y * y * length) - y * heights
    contact.store_x += work - y * rise


@kernel(void(float64, PAD_TYPE, vector, CONTACT_TYPE))
def _add_touching(y: float, pad: Any, waves: Floats, contact: Any) -> None:
    """Walk over the pad and add every interval on which the gap is positive."""
    end, widest, n = pad.half_length, pad.cell, pad.wheel_terms + pad.shoe_terms
    fourth, rounding = 0.0, abs(y)  # bounds of the gap's fourth derivative, and of the rounding in the gap (m)
    for i in range(n):
        g, omega = abs(waves[i]), waves[n + i]
        fourth += g * (omega * omega) * (omega * omega)
        rounding += g * (1.0 + omega * end + abs(waves[2 * n + i]))
    rounding *= _EPSILON
    left, width = -end, widest
    touching, start = False, left
    while left < end and not stopped(pad.signals):
        right = min(left + width, end)
        half = 0.5 * (right - left)
        gap, slope, second, third = _gap(0.5 * (left + right), y, n, waves)
        # Taylor: by how much the gap and its slope may differ in the cell from what they are in its middle.
        bend = half * (abs(second) + half / 2.0 * (abs(third) + half / 3.0 * fourth))
        change = half * (abs(slope) + half / 2.0 * (abs(second) + half / 3.0 * (abs(third) + half / 4.0 * fourth)))
        if abs(gap) <= change and abs(gap) + change > rounding:
            if abs(slope) <= bend:
                width = half  # neither free of roots nor monotone for sure
                continue
            gap, _, _, _ = _gap(left, y, n, waves)
            at_right, _, _, _ = _gap(right, y, n, waves)
            if (gap > 0.0) != (at_right > 0.0):
                root = _root(left, right, gap, y, n, waves)
                if touching or gap > 0.0:
                    begin = start if touching else left
                    _add_interval(begin, root if gap > 0.0 else left, y, pad, waves, contact)
                touching, start = at_right > 0.0, root
                left, width = right, min(4.0 * half, widest)
                continue
        if gap > 0.0 and not touching:
            touching, start = True, left
        elif gap <= 0.0 and touching:
            _add_interval(start, left, y, pad, waves, contact)
            touching = False
        left, width = right, min(4.0 * half, widest)
    if touching:
        _add_interval(start, end, y, pad, waves, contact)


@kernel(EVALUATE)
def evaluate(x: float, y: float, layer: Layer) -> None:
    """See the package; exact to rounding."""
    pad, tables, contact, angles = layer.pad, layer.tables, layer.contact, layer.angles
    clear(contact)
    contact.kind = EXACT
    covered = coverage(y, pad)
    if covered == CLEAR:
        return
    wheel_terms, n = pad.wheel_terms, pad.wheel_terms + pad.shoe_terms
    waves = layer.scratch[: 6 * n]
    for i in range(3 * n):
        waves[i] = tables[pad.gap_at + i]
    for i in range(wheel_terms):
        waves[2 * n + i] = waves[n + i] * x + angles[i]
    if covered == FULL:
        _add_interval(-pad.half_length, pad.half_length, y, pad, waves, contact)
    else:
        _add_touching(y, pad, waves, contact)
    contact.fraction = contact.stiffness / (2.0 * pad.half_length)
    k = pad.k
    contact.normal_force = max(k * contact.normal_force, 0.0)  # Eq. (2), not below zero by rounding
    contact.stiffness *= k
    contact.tangential *= k
    contact.store *= k
    contact.store_x *= k
