"""Linear theory of a shoe that slides in full contact: it rests, rings and is shaken by the wheel's waves.

While the pad touches everywhere and the shoe slips to one side only, (6)-(7) are linear: m z̈ + B ż + S z = f.
The waves of the wheel give f = (sign(U) φ, 1) 2ak Σ g sinc(ωa) sin(ω(x - Ut) + phase). The shoe's own small motion
in that phase changes f by the slope of the surface times that motion: see `with_slopes`.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import (
    Complex,
    Mode,
    eigensystem,
    first_order,
    is_undamped,
    modes,
    stiffness_matrix,
)
from brakecli.solver.compile import Floats as Array
from brakecli.solver.quantities import ContactState
from brakecli.solver.system import System

_BEYOND = 64.0  # times as long as the run
_DENSE, _MOST_DENSE = 128, 1024  # blocks of time for each wave at most, and times in each of them
_SCATTERED: Array = np.arange(_MOST_DENSE, dtype=np.float64) * 0.6180339887498949 % 1.0  # evenly, without a period
_NEAR: Array = np.linspace(-1.0, 1.0, 33) / 8.0  # periods of the fastest wave: a block has a time in each eighth
_HIGHEST = 32  # blocks that are looked at so closely
_FEW = 32  # blocks of one product, which is so small that it wakes no threads
_ROUNDING = 1e-12  # of the largest eigenvalue: what a growth rate of zero may be off
_WEAK = 0.25  # square of what waves answer a mode by, below which the second order is enough
_ROUNDING_WITH_SLOPES = 1e-9  # the same where the passing waves enter it


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
    matrix: Array  # of ż = A z for x, y, vx, vy
    push: Array  # the same of a normal force of 1 N
    slopes: Complex  # N/m, by which each wave changes the normal force with x, with its phase at t = 0
    wavenumbers: Array  # rad/m
    heights: float  # m, by which a rough shoe may part from a wheel that touches it in the mean
    known_to: float = 0.0  # 1/s, by how much the growth may be off

    @property
    def sentence(self) -> str:
        """What becomes of the shoe's own vibration, and why."""
        mode, fate = self.mode, "it neither grows nor decays"
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

    def with_slopes(self) -> "Linear":
        """The same with the growth that the passing waves leave to the mode by their slopes, to second order.

        A small motion x(t) beside the forced one changes the normal force by S(t) x, S = Re Σ s e^{iΩt}. A mode λ
        excites x at λ ± iΩ, by G(λ ± iΩ) s/2, which acts back on it. With the forced motion X in the phases of
        the waves, S also has a mean, -1/2 Re Σ s conj(ωX). So λ moves by its residue in G times
        1/4 Σ |s|² (G(λ + iΩ) + G(λ - iΩ)) + that mean. What is left is of fourth order; where a sum of a mode and
        a wave comes near another mode, this says nothing.
        """
        if not len(self.waves):
            return self
        try:
            residues = self.vectors[0] * np.linalg.solve(self.vectors, self.push)
        except np.linalg.LinAlgError:  # two modes have met
            return replace(self, direction=0, known_to=math.inf)
        turns = 2j * math.pi * np.concatenate([self.passing, -self.passing])
        slopes = np.abs(np.tile(self.slopes, 2))
        bends = self.wavenumbers * self.waves[:, 0]
        mean = -0.5 * float((self.slopes * bends.conj()).real.sum())
        beside = self.values[:, None] + turns  # of each mode and wave
        with np.errstate(divide="ignore", invalid="ignore"):
            answers = (residues / (beside[:, :, None] - self.values)).sum(axis=2)
            moved = residues * (mean + 0.25 * (answers * slopes**2).sum(axis=1))
            strong = (0.5 * np.abs(answers) * slopes).sum(axis=1).max() + np.abs(bends).sum()
        rates = (self.values + moved).real
        fastest = int(np.argmax(rates))
        if not (np.isfinite(rates).all() and strong**2 < _WEAK):
            return replace(self, direction=0, known_to=math.inf)
        off = float(np.abs(moved).max() * strong**2 + _ROUNDING_WITH_SLOPES * np.abs(self.values).max())
        rate = float(rates[fastest])
        direction = int(np.sign(rate)) if abs(rate) > off else 0
        return replace(self, mode=replace(self.mode, growth=rate), direction=direction, known_to=off)

    def forced(self, time: Array) -> tuple[Array, Array]:
        """Positions and velocities (rows x, y) that the waves force."""
        turns, speeds = _turns(tuple(self.passing.tolist()), time.tobytes()), 2.0 * math.pi * self.passing
        position, velocity = self.waves.T, 1j * speeds * self.waves.T
        found = [np.concatenate([each.real, each.imag], axis=1) @ turns for each in (position, velocity)]
        return found[0], found[1]

    def _sum(self, waves: Complex, time: Array) -> Array:
        """What has these amplitudes, with their phases at t = 0, at times (s)."""
        turns = _turns(tuple(self.passing.tolist()), time.tobytes())
        return np.asarray(np.concatenate([waves.real, waves.imag]) @ turns)

    def _extremes(self, span: float) -> tuple[float, float]:
        """Largest and least x (m) that the waves force within a time (s).

        Where many meet is rare: blocks of time fill it, and the highest are looked at closely.
        """
        begins, turns, parts, near = _blocks(tuple(self.passing.tolist()), span)
        begins = self.waves[:, :1] * begins
        rows = np.concatenate([begins.imag, begins.real]).T.astype(np.float32)
        x = (rows.reshape(-1, _FEW, rows.shape[1]) @ parts).reshape(len(rows), -1)
        each, ups, downs = np.arange(len(x)), x.argmax(axis=1), x.argmin(axis=1)  # in half the time of max and min
        high, low = x[each, ups].argsort()[-_HIGHEST:], x[each, downs].argsort()[:_HIGHEST]
        tops = begins[:, high] * turns[:, ups[high]], begins[:, low] * turns[:, downs[low]]
        found = [(top.T @ near).imag for top in tops]
        return float(found[0].max()), float(found[1].min())

    def parts(self, x: Array, time: Array) -> tuple[float, Array, Array, Array]:
        """What the waves force: half of peak to peak of x (m), beyond the run too, as waves beat.

        Then, at the times given, the x that they force and that the shoe adds (m), and the times again (s).
        """
        lasting = self._sum(self.waves[:, 0], time)
        high, low = self._extremes(_BEYOND * time[-1]) if len(self.waves) > 1 and self.belt else (0.0, 0.0)
        size = 0.5 * (max(float(lasting.max()), high) - min(float(lasting.min()), low))
        return size, lasting, x - self.rest[0] - lasting, time

    def force_parts(self, y: Array, time: Array) -> tuple[float, Array]:
        """Half of peak to peak of the normal force (N) that the waves force; what the shoe adds at the times."""
        stiffness, lasting = self.force / self.depth, self.waves[:, 1]
        forced = self._sum(self.slopes / self.wavenumbers - stiffness * lasting, time)
        return 0.5 * float(np.ptp(forced)), stiffness * (self.rest[1] + self._sum(lasting, time) - y)

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
        bounds = [bound / part for bound, part in ((abs(self.belt), vx), (self.depth, y)) if part > 0.0]
        return max(math.log(min(bounds, default=1.0)), 0.0) / self.mode.growth


@lru_cache(maxsize=1)  # the points of a sweep ask for the same ones
def _blocks(frequencies: tuple[float, ...], span: float) -> tuple[Complex, Complex, NDArray[np.float32], Complex]:
    """e^iωt of waves (Hz) where blocks of time begin within a span (s), then in a block, and near a time in it.

    Where so many blocks do not fill the span, they are scattered over it. The third are both parts of the second.
    """
    speeds, size = 2.0 * math.pi * np.array(frequencies), min(_DENSE * len(frequencies), _MOST_DENSE)
    apart = 0.125 / max(map(abs, frequencies))
    count = min(size, _FEW * math.ceil(span / (apart * size * _FEW)))
    filled = apart * size * count >= span
    size = min(size, math.ceil(span / (apart * count)))
    begins = span * (np.arange(count) / count if filled else _SCATTERED[:count])
    times = (begins, apart * np.arange(size), 8.0 * apart * _NEAR)
    first, turns, near = (np.exp(1j * np.outer(speeds, each)) for each in times)
    return first, turns, np.concatenate([turns.real, turns.imag], dtype=np.float32), near


@lru_cache(maxsize=4)  # the points of a sweep ask for the same ones
def _turns(frequencies: tuple[float, ...], time: bytes) -> Array:
    """Sines, then cosines of waves (Hz) at times (s)."""
    angles = 2.0 * math.pi * (np.outer(frequencies, np.frombuffer(time)) % 1.0)
    return np.concatenate([np.sin(angles), np.cos(angles)])


def _solved(s: Any, f: Array) -> Any:
    """S⁻¹ f by Cramer's rule, for one or more matrices of two rows; not finite where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = s[..., 0, 0] * s[..., 1, 1] - s[..., 0, 1] * s[..., 1, 0]
        first, second = s[..., 1, 1] * f[0] - s[..., 0, 1] * f[1], s[..., 0, 0] * f[1] - s[..., 1, 0] * f[0]
        return np.stack([first, second], axis=-1) / determinant[..., None]


def linear_theory(system: System, belt: float) -> Linear | None:
    """The theory at a constant speed U (m/s); None where no rest in contact exists, or friction holds the shoe."""
    c, stiffness = system.coefficients, system.contact_stiffness
    if belt == 0.0 and c.phi > 0.0:
        return None
    grip = math.copysign(c.phi, belt)
    push, offset, forces = np.array([grip, 1.0]), 0.0, np.zeros(0)
    if not system.smooth:
        constants, tables = system.pad
        first, offset = int(constants.full_at), -stiffness * float(constants.shoe_mean)
        forces = tables[first : first + system.wheel.g.size]
    s, load = stiffness_matrix(c, stiffness, grip), system.load_at_start
    damping = np.array([[c.b_xx, c.b_xy], [c.b_xy, c.b_yy]])
    wheel, passing = system.wheel, -belt * system.wheel.turns
    rest = _solved(s, offset * push - load * np.array([c.sin_beta, c.cos_beta]))
    at = (2.0 * math.pi * passing)[:, None, None]
    responses = _solved(s - c.m * at * at * np.eye(2) + 1j * at * damping, push)
    force = offset - stiffness * rest[1]
    if not (np.isfinite(rest).all() and np.isfinite(responses).all() and force > 0.0):
        return None
    phases = forces * np.exp(1j * (wheel.omega * rest[0] + wheel.phase))
    waves = responses * phases[:, None]
    values, vectors = eigensystem(c, stiffness, grip)
    mode, known_to = modes(c, stiffness, grip)[0], 0.0 if is_undamped(c) else _ROUNDING * np.abs(values).max()
    direction = int(np.sign(mode.growth)) if abs(mode.growth) > known_to else 0
    slip = ContactState.BACKWARD_SLIP if belt > 0.0 else ContactState.FORWARD_SLIP
    return Linear(
        belt,
        slip if c.phi > 0.0 else None,
        np.asarray(rest, np.float64),
        float(force),
        float(force / stiffness),
        mode if direction else replace(mode, growth=0.0),
        direction,
        values,
        np.concatenate([vectors, vectors * values]),
        passing,
        waves,
        first_order(c, s / c.m),
        np.concatenate([np.zeros(2), push / c.m]),
        wheel.omega * phases,
        wheel.omega,
        2.0 * float(np.abs(system.shoe.g).sum()) + float(np.abs(wheel.g).sum()),
    )
