"""Linear theory of a shoe that slides in full contact: it rests, rings and is shaken by the wheel's waves.

While the pad touches everywhere and the shoe slips to one side only, (6)-(7) are linear: m z̈ + B ż + S z = f.
The waves of the wheel give f = (sign(U) φ, 1) 2ak Σ g sinc(ωa) sin(ω(x - Ut) + phase). The shoe's own small motion
in that phase changes f by the slope of the surface times that motion: see `_with_slopes`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import (
    Complex,
    Mode,
    damping_matrix,
    eigensystem,
    first_order,
    is_undamped,
    modes_of,
    stiffness_matrix,
)
from brakecli.solver.alike import at_once
from brakecli.solver.arrays import Floats as Array
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.quantities import ContactState
from brakecli.solver.schedules import value_at
from brakecli.solver.system import System

_FEW = 32  # blocks of one product, which is so small that it wakes no threads


@dataclass(frozen=True)
class Linear:
    """Rest, modes and forced motion; positions are pairs of x and y (m)."""

    belt: float  # U, m/s
    slip: ContactState | None  # the side to which the shoe slips; None without friction, where it does not matter
    rest: Array  # x, y
    force: float  # normal force at rest, N
    depth: float  # by which y has to rise from rest until the mean contact opens, m
    mode: Mode  # that decays slowest or grows fastest
    direction: int  # 1 where it grows, -1 where it decays, 0 where it does neither
    values: Complex
    vectors: Complex  # of position and velocity
    passing: Array  # frequency with its sign at which each wave passes, Hz
    waves: Complex  # amplitude of x and y that each of them forces, with its phase at t = 0
    slopes: Complex  # N/m, by which each wave changes the normal force with x, with its phase at t = 0
    wavenumbers: Array  # rad/m
    heights: float  # m, by which a rough shoe may part from a wheel that touches it in the mean
    known_to: float = 0.0  # 1/s, by how much the growth may be off

    @property
    def sentence(self) -> str:
        """What becomes of the shoe's own vibration, and why."""
        mode = self.mode
        fate = "it neither grows nor decays"
        if self.direction > 0:
            fate = f"still growing at {mode.growth:.3g} 1/s"
        elif self.direction < 0:
            fate = f"the shoe's own vibration decays at {-mode.growth:.3g} 1/s"
        how = f"{mode.frequency:.4g} Hz" if mode.frequency else "without oscillation"
        why = "without friction makes" if self.slip is None else "and slip to one side make"
        return f"full contact {why} the motion linear: {fate} ({how})"

    @property
    def opens(self) -> bool:
        """Whether waves that meet may open the pad: their heights, and how far they force y, bound that."""
        return self.depth < self.heights + float(np.abs(self.waves[:, 1]).sum())

    def forced(self, time: Array) -> tuple[Array, Array]:
        """Positions and velocities (rows x, y) that the waves force."""
        sums = _sums(self, time, np.array([*self.waves.T, *(2j * math.pi * self.passing * self.waves.T)]))
        return sums[:2], sums[2:]

    def stays(self, state: Array) -> bool:
        """Whether a motion on a smooth wheel that decays can neither stick nor open any more.

        Its modes only decay, so that the sum of their sizes bounds all that follows.
        """
        away = state - np.concatenate([self.rest, np.zeros(2)])
        parts = np.linalg.lstsq(self.vectors, away.astype(complex), rcond=None)[0]
        _, y, vx, _ = np.abs(self.vectors) @ np.abs(parts)
        slips = self.slip is None or vx < abs(self.belt)
        return bool(self.direction < 0 and not len(self.waves) and slips and y < self.depth - self.heights)

    def seconds_to_limit(self, time: float, state: Array) -> float:
        """How long the fastest mode grows from x, y, vx, vy at a time until stick or loss of contact."""
        position, velocity = self.forced(np.array([time]))
        away = state - np.concatenate([self.rest + position[:, 0], velocity[:, 0]])
        fastest = int(np.argmax(self.values.real))
        size = abs(np.linalg.lstsq(self.vectors, away.astype(complex), rcond=None)[0][fastest])
        size *= 2.0 if self.values[fastest].imag else 1.0
        _, y, vx, _ = size * np.abs(self.vectors[:, fastest])
        bounds = [bound / swing for bound, swing in ((abs(self.belt), vx), (self.depth, y)) if swing > 0.0]
        return max(math.log(min(bounds, default=1.0)), 0.0) / self.mode.growth


Theory = Callable[[], Linear | None]
"""What gives the theory of a system, where it is asked for."""


def theory_of(system: System) -> Theory:
    """The theory at the speed at which a system ends."""
    return cache(lambda: linear_theory(system, _last_speed(system)))


def theories_of(systems: Sequence[System]) -> list[Theory]:
    """The theories of all systems, in a third of the time; no number of one depends on the others."""

    def constant(theory: Linear | None) -> Theory:
        return lambda: theory

    speeds = [_last_speed(system) for system in systems]
    return [constant(theory) for theory in _by_waves(systems, speeds)]


def linear_theory(system: System, belt: float) -> Linear | None:
    """The theory at a constant speed U (m/s); None where no rest in contact exists, or friction holds the shoe."""
    return _by_waves([system], [belt])[0]


def parts(theories: Sequence[Linear], x: Array, time: Array) -> tuple[Array, Array, Array]:
    """What the waves force, by theories whose waves pass alike: half of peak to peak of x (m).

    It is that of longer motions too, as waves beat. Then, at the times given (s), the x that they force and the x
    that each shoe adds (m), in rows.
    """
    waves = np.array([theory.waves[:, 0] for theory in theories])
    equilibrium = np.array([theory.rest[:1] for theory in theories])
    lasting = _sums(theories[0], time, waves[:, None])[:, 0]
    high = lasting.max(axis=1)
    low = lasting.min(axis=1)
    if waves.shape[1] > 1 and theories[0].belt:
        beyond = _extremes(theories[0], waves, 64.0 * time[-1])  # times as long as the run
        high = np.maximum(high, beyond[0])
        low = np.minimum(low, beyond[1])
    return 0.5 * (high - low), lasting, x - equilibrium - lasting


def force_parts(theories: Sequence[Linear], y: Array, time: Array) -> tuple[Array, Array]:
    """Half of peak to peak of the normal force (N) that the waves force; what each shoe adds to it, in rows."""
    columns = np.array([(theory.force / theory.depth, theory.rest[1]) for theory in theories]).T
    stiffness, equilibrium = columns[..., None]
    slopes, waves = np.array([(theory.slopes, theory.waves[:, 1]) for theory in theories]).swapaxes(0, 1)
    pressing = slopes / theories[0].wavenumbers - stiffness * waves
    forced, lasting = _sums(theories[0], time, np.stack([pressing, waves], axis=1)).swapaxes(0, 1)
    return 0.5 * np.ptp(forced, axis=1), stiffness * (equilibrium + lasting - y)


def _sums(theory: Linear, time: Array, waves: Complex) -> Array:
    """What has these amplitudes, with their phases at t = 0, at times (s), in rows; of one theory, or of many."""
    turns = _turns(tuple(theory.passing.tolist()), time.tobytes())
    return np.asarray(np.concatenate([waves.real, waves.imag], axis=-1) @ turns)


def _extremes(theory: Linear, waves: Complex, span: float) -> tuple[Array, Array]:
    """Largest and least x (m) that waves force within a time (s), of each row of their amplitudes.

    Where many meet is rare: blocks of time fill it, and the highest are looked at closely.
    """
    begins, turns, inside, near = _blocks(tuple(theory.passing.tolist()), span)
    begins = waves[:, :, None] * begins
    rows = np.concatenate([begins.imag, begins.real], axis=1).swapaxes(1, 2).astype(np.float32, order="C")
    peaks = list[tuple[NDArray[np.intp], NDArray[np.intp]]]()
    sizes = list[list[Array]]()
    block = np.arange(rows.shape[1])
    for row in rows:  # one at a time, which stays in the cache
        x = (row.reshape(-1, _FEW, row.shape[1]) @ inside).reshape(len(row), -1)
        peaks.append((x.argmax(axis=1), x.argmin(axis=1)))  # in half the time of max and min
        sizes.append([x[block, time] for time in peaks[-1]])
    order = np.array(sizes).argsort(axis=2)
    count = 32  # of each
    highest = np.stack([order[:, 0, -count:], order[:, 1, :count]], axis=1)
    times = np.take_along_axis(np.array(peaks), highest, axis=2)
    tops = np.take_along_axis(begins[:, None], highest[:, :, None], axis=3) * np.moveaxis(turns[:, times], 0, 2)
    extremes = (tops.swapaxes(2, 3) @ near).imag
    return extremes[:, 0].max(axis=(1, 2)), extremes[:, 1].min(axis=(1, 2))


@lru_cache(maxsize=1)  # the points of a sweep ask for the same ones
def _blocks(frequencies: tuple[float, ...], span: float) -> tuple[Complex, Complex, NDArray[np.float32], Complex]:
    """e^iωt of waves (Hz) where blocks of time begin within a span (s), then in a block, and near a time in it.

    Where so many blocks do not fill the span, they are scattered over it. The third are both parts of the second.
    """
    speeds = 2.0 * math.pi * np.array(frequencies)
    size = min(128 * len(frequencies), 1024)  # blocks at most, and times in a block
    apart = 1.0 / (8.0 * max(map(abs, frequencies)))  # an eighth of the fastest wave; the best are then refined
    count = min(size, _FEW * math.ceil(span / (apart * size * _FEW)))
    filled = apart * size * count >= span
    size = min(size, math.ceil(span / (apart * count)))
    scattered = np.arange(count) * 0.6180339887498949 % 1.0  # evenly, without a period
    begins = span * (np.arange(count) / count if filled else scattered)
    times = (begins, apart * np.arange(size), apart * np.linspace(-1.0, 1.0, 33))
    first, turns, near = (np.exp(1j * np.outer(speeds, time)) for time in times)
    return first, turns, np.concatenate([turns.real, turns.imag], dtype=np.float32), near


@lru_cache(maxsize=4)  # the points of a sweep ask for the same ones
def _turns(frequencies: tuple[float, ...], time: bytes) -> Array:
    """Sines, then cosines of waves (Hz) at times (s)."""
    angles = 2.0 * math.pi * (np.outer(frequencies, np.frombuffer(time)) % 1.0)
    return np.concatenate([np.sin(angles), np.cos(angles)])


def _last_speed(system: System) -> float:
    return float(value_at(system.belt, system.sampled_duration))


def _by_waves(systems: Sequence[System], belts: Sequence[float]) -> list[Linear | None]:
    """The theory of each system at its speed; those with as many waves are computed at once."""

    def waves(system: System, belt: float) -> int | None:
        return len(system.wheel.g) if belt != 0.0 or system.coefficients.phi == 0.0 else None

    with np.errstate(all="ignore"):  # what is not finite has no theory
        return at_once(
            [*map(waves, systems, belts)],
            lambda places: _theories([systems[i] for i in places], np.array([belts[i] for i in places])),
        )


_Matrices = TypeVar("_Matrices", Array, Complex)


def _solved(s: _Matrices, f: Array) -> _Matrices:
    """S⁻¹ f by Cramer's rule, for matrices of two rows; not finite where there is none."""
    determinant = s[..., 0, 0] * s[..., 1, 1] - s[..., 0, 1] * s[..., 1, 0]
    first = s[..., 1, 1] * f[..., 0] - s[..., 0, 1] * f[..., 1]
    second = s[..., 0, 0] * f[..., 1] - s[..., 1, 0] * f[..., 0]
    return np.stack([first, second], axis=-1) / determinant[..., None]


def _pushes(system: System) -> tuple[float, Array]:
    """The mean height of the shoe's surface (m), and the normal force (N) of each wave in full contact."""
    if system.smooth:
        return 0.0, np.zeros(0)
    constants, tables = system.pad
    first = int(constants.full_at)
    return float(constants.shoe_mean), tables[first : first + system.wheel.g.size]


class _Modes(NamedTuple):
    """Modes of systems: eigenvalues, vectors of position and velocity, growth of the first and its error (1/s)."""

    values: Complex
    vectors: Complex
    growth: Array
    known_to: Array


def _theories(systems: Sequence[System], belt: Array) -> list[Linear | None]:
    """The theories of systems with as many waves."""
    columns = np.array([system.coefficients for system in systems]).T
    c: Any = Coefficients(**dict(zip(Coefficients._fields, columns, strict=True)))
    stiffness, load = np.array([(system.contact_stiffness, system.load_at_start) for system in systems]).T
    heights, forces = (np.array(column) for column in zip(*map(_pushes, systems), strict=True))
    wheels = np.array([(system.wheel.omega, system.wheel.phase, system.wheel.turns) for system in systems])
    omega, phase, turns = wheels.swapaxes(0, 1)
    grip = np.copysign(c.phi, belt)
    offset = -stiffness * heights
    passing = -belt[:, None] * turns
    push = np.stack([grip, np.ones_like(grip)], axis=-1)
    s = stiffness_matrix(c, stiffness, grip)
    pressed = load[:, None] * np.stack([c.sin_beta, c.cos_beta], axis=-1)
    equilibrium = _solved(s, offset[:, None] * push - pressed)
    speed = (2.0 * math.pi * passing)[:, :, None, None]
    inertia = c.m[:, None, None, None] * speed * speed * np.eye(2)
    damping = damping_matrix(c)[:, None]
    responses = _solved(s[:, None] - inertia + 1j * speed * damping, push[:, None])
    force = offset - stiffness * equilibrium[:, 1]
    moves = first_order(c, s / c.m[:, None, None])
    exists = np.isfinite(equilibrium).all(axis=1) & np.isfinite(responses).all(axis=(1, 2)) & (force > 0.0)
    exists &= np.isfinite(moves).all(axis=(1, 2))
    phases = forces * np.exp(1j * (omega * equilibrium[:, :1] + phase))
    waves = responses * phases[..., None]
    slopes = omega * phases
    own = _modes(systems, np.where(exists[:, None, None], moves, 0.0), grip)
    if turns.size:
        own = _with_slopes(own, push / c.m[:, None], passing, slopes, omega * waves[..., 0])
    return [
        Linear(
            float(belt[i]),
            (ContactState.BACKWARD_SLIP if belt[i] > 0.0 else ContactState.FORWARD_SLIP) if c.phi[i] else None,
            equilibrium[i],
            float(force[i]),
            float(force[i] / stiffness[i]),
            replace(modes_of(own.values[i], own.vectors[i])[0], growth=float(own.growth[i])),
            int(np.sign(own.growth[i])) if abs(own.growth[i]) > own.known_to[i] else 0,
            own.values[i],
            own.vectors[i],
            passing[i],
            waves[i],
            slopes[i],
            omega[i],
            2.0 * float(np.abs(system.shoe.g).sum()) + float(np.abs(system.wheel.g).sum()),
            float(own.known_to[i]),
        )
        if exists[i]
        else None
        for i, system in enumerate(systems)
    ]


def _modes(systems: Sequence[System], moves: Array, grip: Array) -> _Modes:
    """The modes of ż = A z."""
    eigenvalues, shapes = np.linalg.eig(moves)
    values = eigenvalues.astype(complex)
    vectors = shapes.astype(complex)
    undamped = np.array([is_undamped(system.coefficients) for system in systems])
    for i in np.flatnonzero(undamped).tolist():  # by square roots, without spurious growth
        system = systems[i]
        values[i], vectors[i, :2] = eigensystem(system.coefficients, system.contact_stiffness, float(grip[i]))
    vectors[:, 2:] = vectors[:, :2] * values[:, None]
    growth = values.real.max(axis=1)
    known_to = np.where(undamped, 0.0, 1e-12 * np.abs(values).max(axis=1))  # rounding
    return _Modes(values, vectors, np.where(np.abs(growth) > known_to, growth, 0.0), known_to)


def _with_slopes(own: _Modes, push: Array, passing: Array, slopes: Complex, bends: Complex) -> _Modes:
    """The modes with the growth that the passing waves leave to the mode by their slopes, to second order.

    A small motion x(t) beside the forced one changes the normal force by S(t) x, S = Re Σ s e^{iΩt}. A mode λ
    excites x at λ ± iΩ, by G(λ ± iΩ) s/2, which acts back on it. With the forced motion X in the phases of
    the waves, S also has a mean, -1/2 Re Σ s conj(ωX). So λ moves by its residue in G times
    1/4 Σ |s|² (G(λ + iΩ) + G(λ - iΩ)) + that mean. What is left is of fourth order; where a sum of a mode and
    a wave comes near another mode, or two modes have met, this says nothing.
    """
    values = own.values
    vectors = own.vectors
    turns = 2j * math.pi * np.concatenate([passing, -passing], axis=1)
    sizes = np.abs(np.tile(slopes, 2))[:, None]
    mean = -0.5 * (slopes * bends.conj()).real.sum(axis=1)
    beside = values[:, :, None] + turns[:, None]  # of each mode and wave
    residues = vectors[:, 0] * _answers(vectors, np.concatenate([np.zeros_like(push), push], axis=1))
    answers = (residues[:, None, None] / (beside[..., None] - values[:, None, None])).sum(axis=3)
    moved = residues * (mean[:, None] + 0.25 * (answers * sizes**2).sum(axis=2))
    strong = (0.5 * np.abs(answers) * sizes).sum(axis=2).max(axis=1) + np.abs(bends).sum(axis=1)
    rates = (values + moved).real
    holds = np.isfinite(rates).all(axis=1) & (strong**2 < 0.25)  # weak enough for the second order
    off = np.abs(moved).max(axis=1) * strong**2 + 1e-9 * np.abs(values).max(axis=1)
    growth = np.where(holds, rates.max(axis=1), own.growth)
    known_to = np.where(holds, off, math.inf)
    return own._replace(growth=growth, known_to=known_to)


def _answers(vectors: Complex, push: Array) -> Complex:
    """What of each mode a push moves; not a number where two modes have met."""
    try:
        return np.asarray(np.linalg.solve(vectors, push[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if len(vectors) == 1:
            return np.full_like(vectors[:, 0], math.nan)
        return np.concatenate([_answers(*row) for row in zip(vectors[:, None], push[:, None], strict=True)])
