"""Motions of a shoe on smooth pads phase by phase, from the page on the model: another scheme than the package's.

In each phase (open, stick, slip either way) the motion is linear, so its state on a grid of times is a product
with powers of one matrix exponential. The instant at which a phase ends is a root of the series within one step.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from tests.analysis.shoes import Shoe

Vector = NDArray[np.float64]

OPEN = "open"
STICK = "stick"
AHEAD = "ahead of the wheel"
BEHIND = "behind it"
STEPS = 40  # of the fastest period: 0.16 rad, so that 20 terms of the series are exact
TERMS = 20
BLOCK = 64
PARTS = np.linspace(0.0, 1.0, 33)
POWERS = PARTS[:, None] ** np.arange(TERMS + 1)


class Way(NamedTuple):
    """A motion over a span."""

    end: Vector
    word: tuple[str, ...]
    times: tuple[float, ...]  # of the events, s
    low: Vector  # least x, y, v_x and v_y at the times of the grid
    high: Vector


class Phasewise:
    """Exact motion (x, y, v_x, v_y) of a shoe on smooth pads, at constant speed and load."""

    def __init__(self, shoe: Shoe) -> None:
        self.belt = shoe.belt
        self.phi = shoe.phi
        self.k = shoe.k
        m = shoe.m
        top = float(np.abs(np.linalg.eigvalsh(shoe.c)).max()) + shoe.k * (1.0 + shoe.phi)
        fast = max(math.sqrt(top / m), float(np.abs(np.linalg.eigvalsh(shoe.b)).max()) / m)
        self.h = 2.0 * math.pi / fast / STEPS
        held = np.array([*shoe.c[0], 0.0, shoe.b[0, 1], shoe.b[0, 0] * shoe.belt + shoe.pull[0]])  # (6), ẋ = U
        normal = np.array([0.0, -shoe.k, 0.0, 0.0, 0.0])
        pressed = np.array([0.0, -1.0, 0.0, 0.0, 0.0])
        sliding = np.array([0.0, 0.0, 1.0, 0.0, -shoe.belt])
        self.held = held
        self.normal = normal
        self.rows = {
            OPEN: -pressed[None],
            STICK: np.array([pressed, shoe.phi * normal - held, shoe.phi * normal + held]),
            AHEAD: np.array([pressed, sliding]),
            BEHIND: np.array([pressed, -sliding]),
        }
        self.generators = {}
        self.stacks = {}
        for phase in self.rows:
            a = np.zeros((5, 5))
            a[0, 2] = a[1, 3] = 1.0
            a[2:4] = -np.column_stack([shoe.c, shoe.b, shoe.pull]) / m
            if phase != OPEN:
                a[3] += normal / m
            if phase in (AHEAD, BEHIND):
                a[2] += (-shoe.phi if phase == AHEAD else shoe.phi) * normal / m
            if phase == STICK:
                a[2] = 0.0
            self.generators[phase] = a
            powers = [expm(a * self.h)]
            for _ in range(BLOCK - 1):
                powers.append(powers[0] @ powers[-1])
            self.stacks[phase] = np.array(powers)

    def phase(self, z: Vector) -> str:
        """The phase of a state (x, y, v_x, v_y, 1)."""
        if z[1] > 0.0:
            return OPEN
        if z[2] != self.belt:
            return AHEAD if z[2] > self.belt else BEHIND
        needed = float(self.held @ z)
        most = self.phi * float(self.normal @ z)
        return STICK if abs(needed) <= most else BEHIND if needed > most else AHEAD

    def speed(self, state: Vector) -> Vector:
        """The derivative of a state by time."""
        z = np.append(state, 1.0)
        return np.asarray((self.generators[self.phase(z)] @ z)[:4])

    def __call__(self, state: Vector, span: float, most_events: int = 2000) -> Way:
        """Carry a state over a span (s)."""
        z = np.append(state, 1.0)
        time = 0.0
        phase = self.phase(z)
        word = [phase]
        zero = (-1, 0)
        times: list[float] = []
        low = high = z[:4]
        while True:
            left = span - time
            part, which, z, states = self._phase(phase, z, left, zero)
            low = np.minimum(low, states[:, :4].min(axis=0))
            high = np.maximum(high, states[:, :4].max(axis=0))
            if which < 0:
                return Way(z[:4], tuple(word), tuple(times), low, high)
            time += part
            new, zero = self._next(phase, which, z)
            phase = new
            word.append(phase)
            times.append(time)
            if len(times) > most_events:
                raise ArithmeticError("too many events")

    def samples(self, state: Vector, interval: float, count: int) -> tuple[Vector, set[str]]:
        """The state at equal intervals (s), the first one included, and all phases on the way."""
        states = [state]
        seen = set[str]()
        for _ in range(count):
            way = self(states[-1], interval)
            states.append(way.end)
            seen |= set(way.word)
        return np.array(states), seen

    def _next(self, phase: str, which: int, z: Vector) -> tuple[str, tuple[int, int]]:
        """The next phase, and which of its margins is zero there, and how often. Rounding is taken from z."""
        if which == 0:
            z[1] = 0.0
            if phase != OPEN:
                return OPEN, (0, 1)
            return (AHEAD if z[2] > self.belt else BEHIND), (0, 1)
        if phase == STICK:
            return (BEHIND if which == 1 else AHEAD), (1, 2)
        z[2] = self.belt
        new = self.phase(z)
        return new, ((-1, 0) if new == STICK else (1, 1))

    def _phase(
        self, phase: str, z: Vector, left: float, zero: tuple[int, int]
    ) -> tuple[float, int, Vector, Vector]:
        """Follow one phase: how long it lasts, which margin ends it (-1: none), the state there, and others."""
        a = self.generators[phase]
        rows = self.rows[phase]
        stack = self.stacks[phase]
        gone = 0.0
        seen = [z[None]]
        first = True
        while True:
            number = min(BLOCK, max(math.ceil((left - gone) / self.h), 1))
            states = np.concatenate([z[None], stack[:number] @ z])
            margins = states @ rows.T
            slopes = states @ (rows @ a).T
            dips = (slopes[:-1] < 0.0) & (slopes[1:] > 0.0)
            dips &= np.minimum(margins[:-1], margins[1:]) < -slopes[:-1] * self.h
            doubt = (margins[1:] < 0.0) | dips
            if first:
                doubt[0] = True
            for k in np.flatnonzero(doubt.any(axis=1)).tolist():
                found = self._event(a, rows, states[k], zero if first and k == 0 else (-1, 0))
                if found is not None:
                    part, which = found
                    if gone + (k + part) * self.h >= left:
                        break
                    seen.append(states[: k + 1])
                    end = _series(a * self.h, states[k]).T @ part ** np.arange(TERMS + 1)
                    return gone + (k + part) * self.h, which, end, np.concatenate([*seen, end[None]])
            first = False
            if gone + number * self.h >= left:
                k = max(math.ceil((left - gone) / self.h) - 1, 0)
                part = (left - gone) / self.h - k
                end = _series(a * self.h, states[k]).T @ part ** np.arange(TERMS + 1)
                return left, -1, end, np.concatenate([*seen, states[: k + 1], end[None]])
            seen.append(states)
            gone = gone + number * self.h
            z = states[-1]

    def _event(self, a: Vector, rows: Vector, z: Vector, zero: tuple[int, int]) -> tuple[float, int] | None:
        """The part of a step after which a margin is negative for the first time, and which."""
        polynomials = rows @ _series(a * self.h, z).T
        best: tuple[float, int] | None = None
        for which, coefficients in enumerate(polynomials):
            if which == zero[0]:
                coefficients = np.append(coefficients[zero[1] :], np.zeros(zero[1]))
            part = _first_below(coefficients)
            if part is not None and (best is None or part < best[0]):
                best = part, which
        return best


def _first_below(coefficients: Vector) -> float | None:
    """Where a polynomial becomes negative for the first time in 0..1, also where it does so for a moment only."""
    slope = coefficients[1:] * np.arange(1, TERMS + 1)
    values = POWERS @ coefficients
    slopes = POWERS[:, :-1] @ slope
    if values[0] < 0.0:
        return 0.0
    for k in range(len(PARTS) - 1):
        left = float(PARTS[k])
        right = float(PARTS[k + 1])
        if values[k + 1] >= 0.0:
            if not slopes[k] < 0.0 < slopes[k + 1]:
                continue
            right = float(brentq(polyval, left, right, args=(slope,), xtol=1e-16, rtol=1e-15))
            if polyval(right, coefficients) >= 0.0:
                continue
        return float(brentq(polyval, left, right, args=(coefficients,), xtol=1e-16, rtol=1e-15))
    return None


def _series(a: Vector, z: Vector) -> Vector:
    terms = [z]
    for k in range(1, TERMS + 1):
        terms.append(a @ terms[-1] / k)
    return np.array(terms)


SIZES = 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8
AGREE = 1e-6  # of two sizes, relative to the largest entry


def differences(motion: Phasewise, state: Vector, period: float, scales: Vector) -> Vector | None:
    """The derivative of the end of a period by its begin, in scales: central differences of fourth order.

    The displacement shrinks until two in turn agree. None where they do not, or where it changes the sequence of
    phases: a border lies too near.
    """
    word = motion(state, period).word
    last = None
    for size in SIZES:
        columns = []
        for i in range(4):
            ends = []
            for part in (2.0, 1.0, -1.0, -2.0):
                moved = state.copy()
                moved[i] += part * size * scales[i]
                way = motion(moved, period)
                if way.word != word:
                    break
                ends.append(way.end)
            if len(ends) < 4:
                break
            columns.append((8.0 * (ends[1] - ends[2]) - (ends[0] - ends[3])) / (12.0 * size * scales))
        if len(columns) < 4:
            continue
        matrix = np.array(columns).T
        if last is not None and np.abs(matrix - last).max() <= AGREE * max(1.0, float(np.abs(matrix).max())):
            return matrix
        last = matrix
    return None


def multipliers(motion: Phasewise, matrix: Vector, state: Vector, scales: Vector) -> NDArray[np.complex128]:
    """The multipliers but for that of the flow's own direction, from the derivative in scales."""
    across = np.linalg.svd((motion.speed(state) / scales)[None])[2][1:].T
    found = np.linalg.eigvals(across.T @ matrix @ across)
    return np.asarray(found[np.argsort(-np.abs(found))], dtype=np.complex128)


def apart(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> float:
    """How far two sets of multipliers lie apart: relative for large ones, absolute for those inside the circle.

    Multipliers that meet depend on the motion like a square root, their symmetric functions e_k do not. Each e_k
    counts relative to e_k(max(1, |λ|)): if each multiplier changes by δ max(1, |λ|), that changes by k δ at most.
    det(I - M), det(I + M) and the like are sums of them, so stability is as certain as they are.
    """
    a, b = (np.poly(values)[1:] for values in (one, other))
    size = np.abs(np.poly(-np.maximum(1.0, np.abs(other)))[1:])
    return float((np.abs(a - b) / size).max())
