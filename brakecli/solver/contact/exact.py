"""The contact exactly: the roots of the gap bound the touching intervals, and on each the integral is closed.

No pair of roots is missed: a cell is passed only when bounds on the gap's derivatives prove that it has no root,
or that the gap is monotone there; otherwise it is halved. A gap that is within its rounding all over a cell
counts as touching or not by its sign in the middle, so that the walk ends also where two equal profiles meet.

What is proved of a cell holds until the gap, or its slope, has moved so far that it may be otherwise. Odometers
add up bounds of how far both move from one evaluation to the next: until a cell is due, nothing is done for it
but to follow its root.
"""

import math

import numpy as np

from brakecli.solver.arrays import Floats
from brakecli.solver.contact import EXACT
from brakecli.solver.contact.closed_form import CLEAR, FULL, clear, coverage
from brakecli.solver.double_double import EPSILON
from brakecli.solver.kernels import kernel, stopped
from brakecli.solver.records import Contact, Layer, PadNumbers
from brakecli.solver.roughness import TWO_PI
from brakecli.solver.sine import sine_cosine

# `waves` holds, for every harmonic of the gap (the wheel's first, the shoe's with minus): amplitude, wavenumber,
# phase, and for one interval sine and cosine of the phase in its middle, the half width times omega, and sine and
# cosine of that. Then come the numbers of the last evaluation, and those of each cell.
_SINE, _COSINE, _HALF, _SINE_HALF, _COSINE_HALF, _LAST = range(3, 9)

_MOVED, _TURNED, _HEIGHT, _START, _FOURTH, _ROUNDING, _CELLS = range(7)
"""Odometers of the gap (m) and of its slope; y (m); where the interval that touches begins (m), or infinity;
bounds of the gap's fourth derivative and of the rounding in the gap (m)."""

_FREE, _MONOTONE, _PLACE, _PER_CELL = range(4)
"""Readings of the odometers up to which a cell has no root, and up to which the gap is monotone in it; the sign of
the gap where it has no root, otherwise the root (m)."""

_SURE = 0.999
"""What is taken of a bound."""


@kernel(inline=False)
def _gap(xi: float, y: float, n: int, waves: Floats) -> tuple[float, float, float, float]:
    """The gap f2 - f1 - y = Σ g sin(ωξ + ψ) - y at xi, m, and its first three derivatives."""
    sines = waves[_SINE * n : (_SINE + 1) * n]
    cosines = waves[_COSINE * n : (_COSINE + 1) * n]
    for i in range(n):  # several waves at a time, whereas sums keep their order
        sines[i], cosines[i] = sine_cosine(waves[n + i] * xi + waves[2 * n + i])
    gap = -y
    slope = 0.0
    second = 0.0
    third = 0.0
    for i in range(n):
        omega = waves[n + i]
        sine = waves[i] * sines[i]
        cosine = waves[i] * omega * cosines[i]
        gap += sine
        slope += cosine
        second -= omega * omega * sine
        third -= omega * omega * cosine
    return gap, slope, second, third


@kernel(inline=False)
def _root(low: float, high: float, at_low: float, y: float, n: int, waves: Floats) -> float:
    """The root of a gap that is monotone on [low, high] and changes sign: Newton inside the bracket."""
    xi = 0.5 * (low + high)
    for _ in range(100):
        gap, slope, _, _ = _gap(xi, y, n, waves)
        if (gap > 0.0) == (at_low > 0.0):
            low = xi
        else:
            high = xi
        new = xi - gap / slope if slope != 0.0 else low
        if not (low < new < high):
            new = 0.5 * (low + high)
        if abs(new - xi) <= 2e-16 * max(abs(low), abs(high)):  # of where it is: rounding
            return new
        xi = new
    return xi


@kernel(inline=False)
def _halley(low: float, high: float, xi: float, y: float, n: int, waves: Floats) -> tuple[float, float]:
    """The root of a gap that is monotone on [low, high], by Halley's iteration from xi, and the slope there.

    ξ becomes ξ - g g'/(g'² - g g''/2). NaN where the root does not lie inside, or is not found at once.
    """
    near = 1e-5  # a step over the cell after which the next would be rounding
    small = near * (high - low)
    for _ in range(6):  # more do not pay: the root is searched for then
        gap, slope, second, _ = _gap(xi, y, n, waves)
        bent = slope * slope - 0.5 * gap * second
        step = gap * slope / bent if bent > 0.0 else math.inf
        xi -= step
        if not (low < xi < high):
            break
        if abs(step) <= small and abs(second * step) <= near * abs(slope):
            return xi, slope
    return math.nan, 0.0


@kernel
def _sinc_of(sine: float, z: float) -> float:
    """sin(z)/z for a sine that is already known; the quotient loses no digits, however small z is."""
    return sine / z if z != 0.0 else 1.0


@kernel
def _sinc_near_zero(z: float) -> float:
    """sin(z)/z up to half a radian, by its series 1 - z²/3! + z⁴/5! - …"""
    q = z * z
    series = 1.0 - q / 110.0 * (1.0 - q / 156.0)
    return 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * series)))


@kernel(inline=False)
def _add_interval(begin: float, end: float, y: float, pad: PadNumbers, waves: Floats, contact: Contact) -> None:
    """Add the closed integrals of a touching interval, without k: ∫ gap, its length, ∫ f2', ∫ gap²/2, ∫ gap f2'.

    A wave over the length L about the middle ξ_m has the integral L sinc(ωL/2) g sin(ωξ_m + ψ); products of two
    waves have two such integrals, of the sum and of the difference of their arguments.
    """
    wheel_terms = pad.wheel_terms
    n = pad.wheel_terms + pad.shoe_terms
    length = end - begin
    middle = 0.5 * (begin + end)
    at_sine = _SINE * n
    at_cosine = _COSINE * n
    at_half = _HALF * n
    sin_half = _SINE_HALF * n
    cos_half = _COSINE_HALF * n
    # ∫ (f2 - f1), and f2(right) - f2(left) = ∫ f2'
    heights = 0.0
    rise = 0.0
    for i in range(n):
        g = waves[i]
        omega = waves[n + i]
        half = 0.5 * omega * length
        sine, cosine = sine_cosine(omega * middle + waves[2 * n + i])
        sine_half, cosine_half = sine_cosine(half)
        waves[at_sine + i] = sine
        waves[at_cosine + i] = cosine
        waves[at_half + i] = half
        waves[sin_half + i] = sine_half
        waves[cos_half + i] = cosine_half
        heights += g * length * _sinc_of(sine_half, half) * sine
        if i < wheel_terms:
            rise += 2.0 * g * cosine * sine_half
    # ∫ (f2 - f1)², ∫ (f2 - f1) f2', over half the length
    square = 0.0
    work = 0.0
    for i in range(n):
        if stopped(pad.signals):
            return
        g_i = waves[i]
        s_i = waves[at_sine + i]
        c_i = waves[at_cosine + i]
        half_i = waves[at_half + i]
        sh_i = waves[sin_half + i]
        ch_i = waves[cos_half + i]
        omega_i = waves[n + i] if i < wheel_terms else 0.0
        plus = _sinc_of(2.0 * sh_i * ch_i, 2.0 * half_i)
        square += g_i * g_i * (1.0 - plus * (c_i * c_i - s_i * s_i))
        work += g_i * g_i * omega_i * plus * (2.0 * s_i * c_i)
        for j in range(i):
            s_j = waves[at_sine + j]
            c_j = waves[at_cosine + j]
            half_j = waves[at_half + j]
            one = sh_i * waves[cos_half + j]
            other = ch_i * waves[sin_half + j]
            plus = _sinc_of(one + other, half_i + half_j)
            z = half_i - half_j
            minus = _sinc_near_zero(z) if abs(z) < 0.5 else (one - other) / z  # which loses digits near zero
            g = g_i * waves[j]
            omega_j = waves[n + j] if j < wheel_terms else 0.0
            square += 2.0 * g * (minus * (c_i * c_j + s_i * s_j) - plus * (c_i * c_j - s_i * s_j))
            sum_ = plus * (s_i * c_j + c_i * s_j)
            difference = minus * (s_i * c_j - c_i * s_j)
            work += g * (omega_j * (sum_ + difference) + omega_i * (sum_ - difference))
    square = 0.5 * length * square
    work = 0.5 * length * work
    contact.normal_force += heights - y * length
    contact.stiffness += length
    contact.tangential += rise
    contact.store += 0.5 * (square + y * y * length) - y * heights
    contact.store_x += work - y * rise


@kernel(inline=False)
def _turn(touches: bool, xi: float, y: float, pad: PadNumbers, waves: Floats, contact: Contact) -> None:
    """From a place on the pad touches, or does not: begin an interval, or add the one that ends."""
    at = _LAST * (pad.wheel_terms + pad.shoe_terms) + _START
    if touches:
        waves[at] = min(waves[at], xi)
    elif waves[at] < xi:
        _add_interval(waves[at], xi, y, pad, waves, contact)
        waves[at] = math.inf


@kernel(inline=False)
def _look(low: float, high: float, cell: int, y: float, pad: PadNumbers, waves: Floats, contact: Contact) -> None:
    """Walk over the touching intervals of a cell, and keep what is proved of the cell as a whole."""
    n = pad.wheel_terms + pad.shoe_terms
    moved = waves[_LAST * n + _MOVED]
    turned = waves[_LAST * n + _TURNED]
    slack = 1e-12 * pad.crest  # rounding of an odometer before it begins anew
    fourth = waves[_LAST * n + _FOURTH]
    rounding = waves[_LAST * n + _ROUNDING]
    at = _LAST * n + _CELLS + _PER_CELL * cell
    waves[at + _FREE] = waves[at + _MONOTONE] = -1.0
    begin = low
    width = high - low
    while begin < high and not stopped(pad.signals):
        end = min(begin + width, high)
        whole = begin == low and end == high
        half = 0.5 * (end - begin)
        gap, slope, second, third = _gap(0.5 * (begin + end), y, n, waves)
        # Taylor: by how much the gap and its slope may differ in the cell from what they are in its middle.
        bend = half * (abs(second) + half / 2.0 * (abs(third) + half / 3.0 * fourth))
        change = half * (abs(slope) + half / 2.0 * (abs(second) + half / 3.0 * (abs(third) + half / 4.0 * fourth)))
        free = abs(gap) - change
        if free <= 0.0 and abs(gap) + change > rounding:
            if abs(slope) <= bend:
                width = half  # neither free of roots nor monotone for sure
                continue
            if whole:
                waves[at + _MONOTONE] = turned + _SURE * (abs(slope) - bend) - slack / pad.cell
            gap, _, _, _ = _gap(begin, y, n, waves)
            at_end, _, _, _ = _gap(end, y, n, waves)
            if (gap > 0.0) != (at_end > 0.0):
                chord = begin + (end - begin) * (gap / (gap - at_end))
                root, _ = _halley(begin, end, chord, y, n, waves)
                if math.isnan(root):
                    root = _root(begin, end, gap, y, n, waves)
                _turn(gap > 0.0, begin, y, pad, waves, contact)
                _turn(at_end > 0.0, root, y, pad, waves, contact)
                if whole:
                    waves[at + _PLACE] = root
                begin = end
                width = 4.0 * half  # twice as wide as the last part
                continue
            free = min(abs(gap), abs(at_end))
        _turn(gap > 0.0, begin, y, pad, waves, contact)
        if whole:
            waves[at + _FREE] = moved + _SURE * (free - rounding) - slack
            waves[at + _PLACE] = 1.0 if gap > 0.0 else -1.0
        begin = end
        width = 4.0 * half


@kernel(inline=False)
def _add_touching(y: float, pad: PadNumbers, waves: Floats, contact: Contact) -> None:
    """Pass over the pad and add every interval on which the gap is positive."""
    n = pad.wheel_terms + pad.shoe_terms
    end = pad.half_length
    width = 2.0 * pad.half_length / pad.cells
    moved = waves[_LAST * n + _MOVED]
    turned = waves[_LAST * n + _TURNED]
    for cell in range(pad.cells):
        at = _LAST * n + _CELLS + _PER_CELL * cell
        low = -end + cell * width
        high = -end + (cell + 1) * width if cell + 1 < pad.cells else end
        last = waves[at + _PLACE]
        if moved < waves[at + _FREE]:
            _turn(last > 0.0, low, y, pad, waves, contact)
            continue
        if stopped(pad.signals):
            return
        if turned < waves[at + _MONOTONE]:
            last = last if low < last < high else 0.5 * (low + high)
            root, slope = _halley(low, high, last, y, n, waves)
            if not math.isnan(root):
                _turn(slope < 0.0, low, y, pad, waves, contact)
                _turn(slope > 0.0, root, y, pad, waves, contact)
                waves[at + _FREE] = -1.0
                waves[at + _PLACE] = root
                continue
        _look(low, high, cell, y, pad, waves, contact)
    _turn(False, end, y, pad, waves, contact)


@kernel(inline=False)
def _move(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats, waves: Floats) -> None:
    """Put the waves where the shoe is, and let the odometers run."""
    pad = layer.pad
    n = layer.pad.wheel_terms + layer.pad.shoe_terms
    at = _LAST * n
    fourth = 0.0
    rounding = abs(y)
    moved = waves[at + _MOVED] + abs(y - waves[at + _HEIGHT])
    turned = waves[at + _TURNED]
    for i in range(n):
        g = tables[pad.gap_at + i]
        omega = tables[pad.gap_at + n + i]
        psi = tables[pad.gap_at + 2 * n + i]
        if i < pad.wheel_terms:
            psi = omega * x + scratch[layer.angles_at + i]
            turns = (psi - waves[2 * n + i]) / TWO_PI
            change = TWO_PI * abs(g) * abs(turns - np.floor(turns + 0.5))
            moved = moved + change
            turned = turned + omega * change
        waves[i] = g
        waves[n + i] = omega
        waves[2 * n + i] = psi
        fourth += abs(g) * (omega * omega) * (omega * omega)
        rounding += abs(g) * (1.0 + omega * pad.half_length + abs(psi))
    if not moved <= 1e3 * pad.crest:  # odometers begin anew then, or where there was nothing before
        moved = turned = 0.0
        for cell in range(pad.cells):
            cell_at = at + _CELLS + _PER_CELL * cell
            waves[cell_at + _FREE] = waves[cell_at + _MONOTONE] = -1.0
    waves[at + _MOVED] = moved
    waves[at + _TURNED] = turned
    waves[at + _HEIGHT] = y
    waves[at + _START] = math.inf
    waves[at + _FOURTH] = fourth
    waves[at + _ROUNDING] = EPSILON * rounding


@kernel(inline=False)
def evaluate(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """See the package; exact to rounding."""
    pad = layer.pad
    contact = layer.contact
    clear(contact)
    contact.kind = EXACT
    covered = coverage(y, pad)
    if covered == CLEAR:
        return
    waves = scratch[pad.edges_at :]
    _move(x, y, layer, tables, scratch, waves)
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
