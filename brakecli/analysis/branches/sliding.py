"""Steady sliding along a line of cases: eigenvalues, where it flutters or diverges, and the cycles born there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from brakecli.analysis.branches.cycles import Cycles
from brakecli.analysis.branches.line import Line
from brakecli.analysis.branches.newton import start
from brakecli.analysis.branches.point import Point
from brakecli.analysis.stability import margin
from brakecli.analysis.stability.certain import Rounded, conditions, links_with
from brakecli.analysis.stability.edges import middles
from brakecli.analysis.stability.margin import grows
from brakecli.analysis.stability.modes import Complex, eigensystem
from brakecli.errors import CaseError
from brakecli.solver.steady_sliding import PRESSED, sliding, tabulated


@dataclass(frozen=True, slots=True)
class Slide:
    """Steady sliding at a place of the line; no eigenvalues (1/s) where there is none.

    `signs` are its margin (`analysis.stability.margin`); where the shoe locks there is one, but no steady sliding.
    """

    p: float
    eigenvalues: Complex | None
    vectors: Complex | None
    equilibrium: tuple[float, float] | None
    signs: list[Rounded] | None

    @property
    def stable(self) -> bool:
        """Whether no disturbance surely grows."""
        return not grows(self.signs)


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
    there = [slide for slide in slides if slide.signs is not None]
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
        nothing = Slide(p, None, None, None, None)
        line = self.line
        try:
            if line.smooth:
                c, stiffness, belt, load = shoe = line.shoe(p)
                equilibrium = shoe.rest
                pressed = equilibrium is not None and -stiffness * equilibrium[1] > PRESSED * abs(load)
            else:
                system = line.system(p)
                steady = sliding(system, tabulated(system))
                c = system.coefficients
                stiffness = steady.stiffness if steady else system.contact_stiffness
                belt = system.belt_speed
                equilibrium = (steady.x, steady.y) if steady else None
                pressed = steady is not None and steady.is_pressed(system.load_at_start)
        except CaseError:
            return nothing
        locks = equilibrium is None
        if belt == 0.0 or not (pressed or locks):
            return nothing
        grip = c.grip(belt)
        signs = conditions(links_with(c), stiffness, grip)
        if locks:  # beyond divergence there is no steady sliding, and the determinant says where it ended
            return nothing if signs[0].value > signs[0].error else Slide(p, None, None, None, signs)
        values, vectors = eigensystem(c, stiffness, grip)
        return Slide(p, values, vectors, equilibrium, signs)

    def _margin(self, p: float) -> list[Rounded] | None:
        return self.at(p).signs

    def along(self) -> list[Slide]:
        """Steady sliding along the whole line, with further places where its margin has extremes."""
        line = self.line
        inner = [line.place(value) for value in middles(line.case_at(0.0), line.keys, line.low, line.high)]
        values = sorted({*np.linspace(0.0, 1.0, 65).tolist(), *inner})
        return [self.at(p) for p in margin.places(self._margin, values)]

    def changes(self, slides: list[Slide]) -> list[Change]:
        """Where stability is lost or regained, in the order of p."""
        changes = []
        for change in margin.between(self._margin, [slide.p for slide in slides]):
            if change.which is None:  # steady sliding itself ends
                continue
            frequency = 0.0
            if change.which == margin.FLUTTER:
                values = self.at(change.value).eigenvalues
                assert values is not None
                frequency = abs(float(values[int(np.argmax(values.real))].imag)) / (2.0 * math.pi)
            kind = "flutter" if change.which == margin.FLUTTER else "divergence"
            changes.append(Change(kind, change.value, change.error, frequency, change.lost))
        return changes

    def _rises(self, p: float, y: float) -> float:
        """How far (m) the shoe may rise from a height y (m) until the stiffness of the contact changes."""
        if self.line.smooth:
            return -y
        full = float(self.line.system(p).pad.constants.full_up_to)
        return full - y if y < full else 0.03 * abs(y)

    def vibration(self, cycles: Cycles, change: Change) -> Point | None:
        """A motion of the family of linear vibrations that a shoe on a smooth wheel has where it flutters.

        In full contact all amplitudes exist there, up to that which grazes the wheel's velocity or the clear pad.
        Where a rough shoe touches in part they are born there, and a small one is taken. The tangent of the point
        leads to larger ones.
        """
        slide = self.at(change.p)
        belt = self.line.shoe(change.p).belt
        if slide.eigenvalues is None or slide.vectors is None or slide.equilibrium is None:
            return None
        which = int(np.argmin(np.abs(slide.eigenvalues - 2j * math.pi * change.frequency)))
        omega = float(slide.eigenvalues[which].imag)
        shape = slide.vectors[:, which]
        phases = 720  # at which its extremes are looked at
        turning = np.exp(2j * math.pi * np.arange(phases) / phases)
        w = (np.concatenate([shape, 1j * omega * shape])[:, None] * turning).real
        ahead = w[2] * math.copysign(1.0, belt)
        stick = abs(belt) / ahead.max()
        flight = self._rises(change.p, slide.equilibrium[1]) / w[1].max()
        size = 0.9 * min(stick, flight)
        touch = int(np.argmax(ahead if stick < flight else w[1]))
        mode = size * w[:, (touch + phases // 2) % phases]  # far from where it will graze
        length = size * float(np.abs(w[:2]).max())
        scales = length * np.array([1.0, 1.0, omega, omega])
        u = np.append(mode / scales, 1.0)
        time = 2.0 * math.pi / omega
        chart = cycles.chart_at(u, change.p, scales, time, 0.5 * size * float(np.ptp(w[0])))
        if chart is None:
            return None
        cycles.use(chart)
        return start(cycles, u, change.p, np.append(mode / scales, [0.0, 0.0]))
