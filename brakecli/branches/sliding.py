"""Steady sliding along a line of cases: eigenvalues, where it flutters or diverges, and the cycles born there."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from brakecli.analysis.stability.modes import Complex, eigensystem, is_undamped, routh_hurwitz
from brakecli.branches.cycles import Cycles
from brakecli.branches.line import Line
from brakecli.branches.newton import start
from brakecli.branches.point import Point
from brakecli.errors import CaseError
from brakecli.solver.roots import bracketed_root
from brakecli.solver.steady_sliding import PRESSED, steady_sliding, tabulated

PLACES = 65
"""Places at which steady sliding is looked at; between them a test that may vanish twice is followed down."""
LOCATED = 1e-14
"""Width of the bracket of a change."""
SEARCHES = 30
GOLDEN = 0.3819660112501051
BELOW_GRAZING = 0.9
"""Part of the amplitude that grazes at which the family of linear vibrations is begun."""
SMALL = 0.03
"""Part of its height by which a shoe rises in the first vibration where it touches in part."""
PHASES = 720
"""Phases of a linear vibration at which its extremes are looked at."""


@dataclass(frozen=True, slots=True)
class Slide:
    """Steady sliding at a place of the line; no eigenvalues (1/s) where there is none."""

    p: float
    eigenvalues: Complex | None
    vectors: Complex | None
    rest: tuple[float, float] | None
    tests: tuple[float, float]
    """Tests of divergence and of flutter: smooth, and positive where there is neither; NaN without steady sliding.

    Where a shoe on smooth pads locks, the first one is negative.
    """

    @property
    def stable(self) -> bool:
        """Whether all disturbances decay."""
        return min(self.tests) > 0.0


@dataclass(frozen=True, slots=True)
class Change:
    """A place at which steady sliding changes its stability."""

    kind: str  # flutter or divergence
    p: float
    error: float  # half the width of its bracket
    frequency: float  # Hz; 0 for divergence
    lost: bool  # as p grows, or regained


def stable_spans(
    slides: Sequence[Slide], changes: Sequence[Change]
) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The parts of the line where it is stable: both ends of each, with their errors."""
    there = [slide for slide in slides if not math.isnan(slide.tests[0])]
    if not there:
        return []
    edges = [(change.p, change.error) for change in changes]
    edges = [(there[0].p, 0.0)] * there[0].stable + edges
    edges += [(there[-1].p, 0.0)] * (len(edges) % 2)
    return [(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True) if high[0] > low[0]]


class Sliding:
    """Steady sliding along a line of cases, on a wheel that turns."""

    def __init__(self, line: Line) -> None:
        """Nothing is computed yet."""
        self.line = line
        self.at = lru_cache(maxsize=1024)(self._at)

    def _at(self, p: float) -> Slide:
        """Steady sliding at a place."""
        nothing = Slide(p, None, None, None, (math.nan, math.nan))
        line = self.line
        try:
            if line.smooth:
                c, stiffness, belt, load = shoe = line.shoe(p)
                pressed = (rest := shoe.rest) is not None and -stiffness * rest[1] > PRESSED * abs(load)
            else:
                system = line.system(p)
                found = steady_sliding(system, mean=tabulated(system))
                c = system.coefficients
                stiffness = found.stiffness
                belt = system.belt_speed
                rest = (found.x, found.y)
                pressed = found.is_pressed(system.load_at_start)
        except CaseError:
            return nothing
        locks = line.smooth and rest is None
        if belt == 0.0 or not (pressed or locks):
            return nothing
        grip = c.grip(belt)
        b = (c.b_xx, c.b_xy, c.b_yy)
        links = (c.c_xx, c.c_xy, c.c_yy)
        determinant, apart = routh_hurwitz(c.m, b, links, stiffness, grip, damped=not is_undamped(c))
        if locks:  # beyond divergence there is no steady sliding, and the determinant says where it ended
            return replace(nothing, tests=(min(float(determinant), -sys.float_info.min), math.nan))
        values, vectors = eigensystem(c, stiffness, grip)
        return Slide(p, values, vectors, rest, (float(determinant), float(apart)))

    def along(self, places: int = PLACES) -> list[Slide]:
        """Steady sliding along the whole line, with further places where a test has its extremes."""
        found = [self.at(k / (places - 1)) for k in range(places)]
        more = []
        for one, middle, other in zip(found, found[1:], found[2:], strict=False):
            for test in range(2):
                a, b, c = (each.tests[test] for each in (one, middle, other))
                if math.copysign(1.0, a) == math.copysign(1.0, b) == math.copysign(1.0, c) and abs(b) < min(
                    abs(a), abs(c)
                ):
                    more.append(self._extreme(one.p, other.p, test, math.copysign(1.0, b)))
        return sorted([*found, *more], key=lambda slide: slide.p)

    def _extreme(self, left: float, right: float, test: int, sign: float) -> Slide:
        """The place between two at which a test is nearest to zero, or beyond it; by the golden section."""

        def height(p: float) -> float:
            return sign * self.at(p).tests[test]

        a = left + GOLDEN * (right - left)
        b = right - GOLDEN * (right - left)
        at_a = height(a)
        at_b = height(b)
        for _ in range(SEARCHES):
            if min(at_a, at_b) < 0.0:
                break
            if at_a < at_b:
                right = b
                b = a
                at_b = at_a
                a = left + GOLDEN * (right - left)
                at_a = height(a)
            else:
                left = a
                a = b
                at_a = at_b
                b = right - GOLDEN * (right - left)
                at_b = height(b)
        return self.at(a if at_a < at_b else b)

    def changes(self, slides: list[Slide]) -> list[Change]:
        """Where stability is lost or regained, in the order of p."""
        found = []
        for one, other in pairwise(slides):
            if math.isnan(one.tests[0]) or math.isnan(other.tests[0]) or one.stable == other.stable:
                continue
            test = 0 if one.tests[0] * other.tests[0] < 0.0 else 1
            p, error = self._zero(test, one.p, other.p)
            frequency = 0.0
            if test == 1:
                values = self.at(p).eigenvalues
                assert values is not None
                frequency = abs(float(values[int(np.argmax(values.real))].imag)) / (2.0 * math.pi)
            found.append(Change("divergence" if test == 0 else "flutter", p, error, frequency, one.stable))
        return found

    def _zero(self, test: int, low: float, high: float) -> tuple[float, float]:
        """Where a test passes zero between two places, and half the width of its bracket."""
        return bracketed_root(lambda p: self.at(p).tests[test], low, high, absolute=LOCATED), LOCATED

    def _rises(self, p: float, y: float) -> float:
        """How far (m) the shoe may rise from a height y (m) until the stiffness of the contact changes."""
        if self.line.smooth:
            return -y
        full = float(self.line.system(p).pad.constants.full_up_to)
        return full - y if y < full else SMALL * abs(y)

    def vibration(self, cycles: Cycles, change: Change) -> Point | None:
        """A motion of the family of linear vibrations that a shoe on a smooth wheel has where it flutters.

        In full contact all amplitudes exist there, up to that which grazes the wheel's velocity or the clear pad.
        Where a rough shoe touches in part they are born there, and a small one is taken. The tangent of the point
        leads to larger ones.
        """
        slide = self.at(change.p)
        belt = self.line.shoe(change.p).belt
        if slide.eigenvalues is None or slide.vectors is None or slide.rest is None:
            return None
        which = int(np.argmin(np.abs(slide.eigenvalues - 2j * math.pi * change.frequency)))
        omega = float(slide.eigenvalues[which].imag)
        shape = slide.vectors[:, which]
        turning = np.exp(2j * math.pi * np.arange(PHASES) / PHASES)
        w = (np.concatenate([shape, 1j * omega * shape])[:, None] * turning).real
        ahead = w[2] * math.copysign(1.0, belt)
        stick = abs(belt) / ahead.max()
        flight = self._rises(change.p, slide.rest[1]) / w[1].max()
        size = BELOW_GRAZING * min(stick, flight)
        touch = int(np.argmax(ahead if stick < flight else w[1]))
        mode = size * w[:, (touch + PHASES // 2) % PHASES]  # far from where it will graze
        length = size * float(np.abs(w[:2]).max())
        scales = length * np.array([1.0, 1.0, omega, omega])
        u = np.append(mode / scales, 1.0)
        time = 2.0 * math.pi / omega
        chart = cycles.chart_at(u, change.p, scales, time, 0.5 * size * float(np.ptp(w[0])))
        if chart is None:
            return None
        cycles.use(chart)
        return start(cycles, u, change.p, np.append(mode / scales, [0.0, 0.0]))
