"""The gap between two rough surfaces, piece by piece between its roots: a reference that shares no formula with
the package. It finds the roots between the extremes of the gap, and integrates with `scipy.integrate.quad`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq

from brakecli.solver.contact import EVALUATORS as ROWS
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import ContactLayer, Pad, build_layer, build_pad
from brakecli.solver.records import Contact
from brakecli.solver.roughness import Surface, surface, wheel_angles

EPS = 2.0**-52
EVALUATORS = tuple(ROWS)
NODES = 512
"""20 to the shortest of the waves below, whose crests heights at edges exceed by 0.9 %: tan(z)/z with z = π/20."""


class Wave(NamedTuple):
    """Amplitude (m), wavelength (m) and phase (deg) of a sine."""

    g: float
    length: float
    phase: float = 0.0


@dataclass(frozen=True)
class Gap:
    """f2(xi + x - travel) - f1(xi) - y on -a <= xi <= a, for a layer of stiffness k (N/m²)."""

    shoe: tuple[Wave, ...]
    wheel: tuple[Wave, ...]
    a: float
    x: float
    y: float
    travel: float = 0.0
    k: float = 1e8

    @cached_property
    def sines(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Amplitude, wavenumber and phase in rad of every sine of the gap, the wheel's first."""
        rows = [
            (w.g, 2 * np.pi / w.length, np.radians(w.phase) + 2 * np.pi / w.length * (self.x - self.travel))
            for w in self.wheel
        ]
        rows += [(-w.g, 2 * np.pi / w.length, np.radians(w.phase)) for w in self.shoe]
        g, omega, phase = np.array(rows, dtype=float).reshape(-1, 3).T.copy()
        return g, omega, phase

    def value(self, xi: float, derivative: int = 0) -> float:
        """The gap or a derivative of it."""
        size, omega, phase = self._derived[derivative]
        waves = float(size @ np.sin(omega * xi + phase))
        return waves - self.y if derivative == 0 else waves

    @cached_property
    def _derived(self) -> list[tuple[NDArray[np.float64], ...]]:
        """The sines of the gap and of its first four derivatives."""
        g, omega, phase = self.sines
        return [(g * omega**n, omega, phase + 0.5 * np.pi * n) for n in range(5)]

    def values(self, xi: NDArray[np.float64], derivative: int = 0) -> NDArray[np.float64]:
        """The same at many places."""
        f = np.full(xi.size, 0.0 if derivative else -self.y)
        for g, omega, phase in zip(*self.sines, strict=True):
            f += g * omega**derivative * np.sin(omega * xi + phase + 0.5 * np.pi * derivative)
        return f

    def wheel_slope(self, xi: float) -> float:
        """f2'."""
        g, omega, phase = (column[: len(self.wheel)] for column in self.sines)
        return float(np.sum(g * omega * np.cos(omega * xi + phase)))

    @property
    def crest(self) -> float:
        """Sum of all amplitudes, m."""
        return float(np.sum(np.abs(self.sines[0])))

    def steepest(self, derivative: int = 1, *, wheel_only: bool = False) -> float:
        """A bound of a derivative of the gap, or of f2 alone."""
        g, omega, _ = (column[: len(self.wheel) if wheel_only else None] for column in self.sines)
        return float(np.sum(np.abs(g) * omega**derivative))

    @property
    def force_scale(self) -> float:
        """2ak (|y| + sum of amplitudes), N."""
        return 2 * self.a * self.k * (abs(self.y) + self.crest)

    @property
    def rounding(self) -> float:
        """What rounding may do to a gap, m: a unit in the last place of y, of each wave and of each phase."""
        g, omega, phase = self.sines
        travelled = omega * (abs(self.x) + abs(self.travel))
        return (
            4 * EPS * (abs(self.y) + float(np.sum(np.abs(g) * (1 + omega * self.a + np.abs(phase) + travelled))))
        )

    @cached_property
    def extremes(self) -> tuple[float, ...]:
        """Ends of the pad and extremes of the gap between them."""
        if not self.sines[0].size:
            return (-self.a, self.a)
        grid = np.linspace(-self.a, self.a, 3 + int(256 * self.a / min(2 * np.pi / self.sines[1])))
        slopes = self.values(grid, 1)
        found = [
            float(brentq(self.value, left, right, args=(1,), xtol=1e-18, rtol=4 * EPS))
            for (left, right), (s, t) in zip(pairwise(grid), pairwise(slopes), strict=True)
            if s * t <= 0 and self.value(left, 1) * self.value(right, 1) < 0
        ]
        return (-self.a, *found, self.a)

    def touching(self, lift: float = 0.0) -> list[tuple[float, float]]:
        """The intervals on which the gap exceeds `lift`, cut at the extremes."""
        pieces = []
        for left, right in pairwise(self.extremes):
            at_left = self.value(left) - lift
            at_right = self.value(right) - lift
            if at_left > 0 and at_right > 0:
                pieces.append((left, right))
            elif at_left > 0 or at_right > 0:
                root = left if at_left == 0 else right
                if at_left * at_right < 0:
                    root = float(brentq(lambda xi: self.value(xi) - lift, left, right, xtol=1e-18, rtol=4 * EPS))
                pieces.append((left, root) if at_left > 0 else (root, right))
        return pieces

    def length(self, lift: float = 0.0) -> float:
        """Length on which the gap exceeds `lift`, m."""
        return sum(right - left for left, right in self.touching(lift))

    def integral(self, density: Callable[[float], float], accuracy: float) -> float:
        """Integral over the touching intervals; `accuracy` is that of the density."""
        total = 0.0
        for left, right in self.touching():
            width = right - left
            if width > 1e-9 * self.a:
                total += quad(density, left, right, epsabs=accuracy * width, epsrel=1e-12)[0]
            else:  # below what quad can divide; the midpoint rule is right to 1e-18
                total += density(0.5 * (left + right)) * width
        return total

    @property
    def surfaces(self) -> tuple[Surface, Surface]:
        """The package's shoe and wheel."""
        return _surface(self.shoe), _surface(self.wheel)

    @property
    def angles(self) -> NDArray[np.float64]:
        """The package's phases of the wheel."""
        angles = np.zeros(len(self.wheel))
        wheel_angles(self.surfaces[1].waves, self.travel, 0.0, angles)
        return angles

    def pad(self, nodes: int = NODES) -> Pad:
        """The package's pad."""
        return build_pad(self.k, self.a, *self.surfaces, nodes)

    def evaluate(
        self, evaluator: str, *, nodes: int = NODES, dx: float = 0.0, dy: float = 0.0, pad: Pad | None = None
    ) -> Any:
        """What the package computes with the shoe moved by (dx, dy): a record of `Contact`."""
        layer = unfilled(evaluator, self.pad(nodes) if pad is None else pad)
        layer.angles[:] = self.angles
        fill(self.x + dx, self.y + dy, *layer)
        return layer.contact


def unfilled(evaluator: str, pad: Pad) -> ContactLayer:
    """The package's layer with nothing in it that an evaluator might take for a result."""
    layer = build_layer(evaluator, pad)
    layer.scratch[: int(layer.layer.angles_at)] = np.nan
    for name in Contact.layout.names or ():
        if name != "reach":  # which is given
            setattr(layer.contact, name, -1 if name in ("kind", "valid") else np.nan)
    return layer


def outputs(found: Any) -> NDArray[np.float64]:
    """The quantities of a record of `Contact`, in their order, without what it notes beside them."""
    return np.array(found.tolist()[:6])


def _surface(waves: tuple[Wave, ...]) -> Surface:
    return surface(
        [w.g for w in waves], wavelengths=[w.length for w in waves], phases_deg=[w.phase for w in waves]
    )


def profiles(*, phases: bool = True, most: int = 6) -> st.SearchStrategy[tuple[Wave, ...]]:
    """Rough surfaces of 0 to `most` sines, 1 to 50 micrometres high and 4 to 100 mm long."""
    amplitude = st.floats(1e-6, 5e-5) | st.floats(-5e-5, -1e-6)
    phase = st.floats(0, 360) if phases else st.just(0.0)
    wave = st.builds(Wave, amplitude, st.floats(0.004, 0.1), phase)
    return st.lists(wave, max_size=most).map(tuple)


@st.composite
def gaps(draw: st.DrawFn, lowest: float = -1.3, highest: float = 1.3, *, most: int = 6, least: int = 0) -> Gap:
    """Gaps whose height y is `lowest` to `highest` of the sum of amplitudes: below -1 the pad touches everywhere,
    above 1 nowhere; half of them without phases.
    """
    phases = draw(st.booleans())
    shoe = draw(profiles(phases=phases, most=most))
    wheel = draw(profiles(phases=phases, most=most))
    if least and len(shoe) + len(wheel) < least:
        wheel = (Wave(2e-5, 0.02),)
    crest = sum(abs(w.g) for w in shoe + wheel) or 1e-5
    return Gap(
        shoe,
        wheel,
        draw(st.floats(0.005, 0.05)),
        draw(st.floats(-0.01, 0.01)),
        draw(st.floats(lowest, highest)) * crest,
        draw(st.floats(-1, 1)),
        draw(st.sampled_from([1.0, 1e8, 1e16])),
    )
