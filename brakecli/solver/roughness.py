"""Rough surfaces as sums of sines, (1), and the phases of the wheel's harmonics as it turns."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from brakecli.solver.arrays import VECTOR, Floats
from brakecli.solver.double_double import multiply, split, two_product
from brakecli.solver.kernels import entry, kernel
from brakecli.solver.records import Layer

PI = Fraction(314159265358979323846264338327950288419716939937511, 10**50)
TWO_PI = 2.0 * math.pi


class Surface(NamedTuple):
    """A profile f(xi) = sum of g sin(omega xi + phase): amplitudes (m), wavenumbers (rad/m), phases (rad).

    `turns` + `turns_low` is the exact number of waves per metre, 1/wavelength.
    """

    g: Floats
    omega: Floats
    phase: Floats
    turns: Floats
    turns_low: Floats

    def __eq__(self, other: object) -> bool:
        """Whether the numbers are the same."""
        return isinstance(other, Surface) and self._bytes == other._bytes

    def __hash__(self) -> int:
        """By the numbers, so that what is made of a surface can be kept for all that are like it."""
        return hash((self.g.tobytes(), self.turns.tobytes()))

    @property
    def _bytes(self) -> tuple[bytes, ...]:
        return tuple(numbers.tobytes() for numbers in self)

    @property
    def waves(self) -> Floats:
        """What `wheel_angles` needs."""
        return np.concatenate([self.phase, self.turns, self.turns_low])


def surface(
    amplitudes: Sequence[float] = (),
    *,
    wavelengths: Sequence[float] | None = None,
    wavenumbers: Sequence[float] | None = None,
    orders: Sequence[float] | None = None,
    radius: float = 1.0,
    phases_deg: Sequence[float] | None = None,
) -> Surface:
    """Surface from lists of equal length; a term of no amplitude is left out, and none at all is smooth.

    Orders are waves along the circumference of this radius (m).
    """
    if wavelengths is not None:
        turns = [1 / Fraction(length) for length in wavelengths]
    elif orders is not None:
        turns = [Fraction(order) / (2 * PI * Fraction(radius)) for order in orders]
    else:
        turns = [Fraction(number) / (2 * PI) for number in wavenumbers or ()]
    phases = phases_deg or [0.0] * len(turns)
    terms = [term for term in zip(amplitudes, turns, phases, strict=True) if term[0] != 0.0]
    pairs = np.array([split(turn) for _, turn, _ in terms]).reshape(-1, 2)
    return Surface(
        np.array([g for g, _, _ in terms], dtype=float),
        np.array([float(2 * PI * turn) for _, turn, _ in terms], dtype=float),
        np.radians(np.array([phase for _, _, phase in terms], dtype=float)),
        pairs[:, 0].copy(),
        pairs[:, 1].copy(),
    )


def height(f: Surface, xi: Floats) -> Floats:
    """f(xi) in m at places xi (m)."""
    f_xi = np.zeros(xi.size)
    for g, omega, phase in zip(f.g, f.omega, f.phase, strict=True):  # no table of all waves at all places
        f_xi += g * np.sin(omega * xi + phase)  # Eq. (1)
    return f_xi


@kernel
def turn_to(waves: Floats, travel: float, travel_low: float, angles: Floats) -> None:
    """Phase in rad of each harmonic at xi = 0 after the wheel has travelled: phase - omega travel, reduced.

    `waves` has their phases and the two parts of their turns.
    The waves are counted in turns with 32 digits and only their fraction is kept, so that the phase is as exact
    after 10^7 m as at the start.
    """
    n = angles.size
    for i in range(n):
        number, number_low = multiply(travel, travel_low, waves[n + i], waves[2 * n + i])
        fraction = (number - math.floor(number)) + number_low
        angles[i] = waves[i] - TWO_PI * fraction


wheel_angles = entry(None, VECTOR, float, float, VECTOR)(turn_to)
"""`turn_to`, for Python."""


def turned(f: Surface, travel: float, travel_low: float = 0.0) -> Surface:
    """The surface of a wheel that has travelled so far (m, in one number or two), as it then begins at xi = 0."""
    phase = np.zeros(f.g.size)
    wheel_angles(f.waves, travel, travel_low, phase)
    return f._replace(phase=phase)


@kernel
def turn(travel: float, travel_low: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """The wheel has travelled so far (m): its phases, or its place on the grid of the window."""
    window = layer.window
    at = layer.pad.turns_at
    n = layer.pad.wheel_terms
    layer.level = 0
    if window.rows == 0:
        angles = scratch[layer.angles_at : layer.angles_at + n]
        turn_to(tables[at : at + 3 * n], travel, travel_low, angles)
        return
    points = np.floor(travel / window.spacing + 0.5)
    grid, grid_low = two_product(points, window.spacing)
    window.points = points
    window.travel = (travel - grid) + (travel_low - grid_low)


turn_wheel = entry(None, float, float, Layer, VECTOR, VECTOR)(turn)
"""`turn`, for Python."""
