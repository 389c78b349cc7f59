"""What nodes and steps change in a forced motion: ripple, and how far the step moves resonances.

Ripple is of the quadrature nodes, under which the waves pass where a pad opens.

The normal force at stored positions is computed again with more nodes. What it differs by shakes the shoe, by the
linear equations with the mean stiffness of the contact.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from brakecli.analysis.regime.evidence import Stretch
from brakecli.analysis.stability.modes import first_order, stiffness_matrix
from brakecli.solver.contact.pad import build_layer, build_pad
from brakecli.solver.steady_sliding import forces_along
from brakecli.solver.system import System

_LEAST = 0.05  # part of a number from which on it is said


class Ripple(NamedTuple):
    """Parts of the deviations of x, vx and the friction force, and half of peak to peak of x (m)."""

    x: float
    vx: float
    force: float
    size: float
    nodes: int

    @property
    def counts(self) -> bool:
        """Whether it is said, and not only part of the spread."""
        return max(self[:3]) >= _LEAST

    @property
    def sentence(self) -> str:
        """What it is, and what to do: it falls with the square of the number of nodes, or with a higher power."""
        enough = self.nodes * 2 ** math.ceil(0.5 * math.log2(max(self[:3]) / _LEAST) + 0.5)
        parts = f"{self.x:.0%} of x, {self.vx:.0%} of vx and {self.force:.0%} of the friction force"
        return f"ripple of the contact's {self.nodes} nodes is {parts}; take contact.nodes = {enough}"


def ripple(
    system: System, belt: float, stiffness_of: Callable[[], float], stretch: Stretch, lines: Sequence[float]
) -> Ripple | None:
    """The ripple in the last samples of a part, at a mean stiffness (N/m); None where it is not known.

    Where the part is forced on `lines` (Hz), what lies beside them is ripple: the mean stiffness of an open pad
    may miss a resonance.
    """
    samples = min(stretch.stop - stretch.start, 1024)
    end = Stretch(stretch.history, stretch.stop - samples, stretch.stop)
    nodes = 4 * system.nodes
    work = samples * nodes * len(system.wheel.g)
    # a window of fewer samples holds next to nothing
    if samples < 5 or not 0 < work <= 1 << 24 or system.method.step is None or end.touches():
        return None
    pad = build_pad(system.layer_stiffness, system.half_length, system.shoe, system.wheel, nodes)
    layer = build_layer(system.evaluator, pad, moving=True)
    names = ("x", "y", "vx", "normal_force")
    x, y, v_x, force = (stretch.history.read(name, end.start, end.stop) for name in names)
    travel = belt * stretch.history.interval * np.arange(end.start, end.stop) - x
    finer = np.zeros(samples)
    forces_along(np.ascontiguousarray(y), travel, *layer, finer)
    stiffness = stiffness_of()
    c = system.coefficients
    window = np.hanning(samples)
    added = force - finer
    grip = c.grip(belt)
    omega = 2.0 * math.pi * np.fft.rfftfreq(samples, stretch.history.interval)
    off, *wholes = (np.fft.rfft((signal - signal.mean()) * window) for signal in (added, x, v_x, force))
    (s_xx, s_xy), (s_yx, s_yy) = stiffness_matrix(c, stiffness, grip)
    a = s_xx - c.m * omega**2 + 1j * omega * c.b_xx
    b = s_xy + 1j * omega * c.b_xy
    d = s_yx + 1j * omega * c.b_xy
    e = s_yy - c.m * omega**2 + 1j * omega * c.b_yy
    if not (determinant := a * e - b * d).all():  # nothing holds the shoe
        return None
    shaken = (grip * e - b) / determinant * off
    pressed = off - stiffness * (a - grip * d) / determinant * off
    in_x, in_vx, in_force = (
        min(float(np.linalg.norm(ours) / size), 1.0) if (size := np.linalg.norm(whole)) else 0.0
        for ours, whole in zip((shaken, 1j * omega * shaken, pressed), wholes, strict=True)
    )
    swing = 0.5 * float(np.ptp(np.fft.irfft(shaken, samples)))
    if lines and max(in_x, in_vx, in_force) >= _LEAST:
        (beside, own), (vx, _), (pressing, _) = (
            stretch.beside(name, lines) for name in ("x", "vx", "normal_force")
        )
        in_x = max(in_x, beside)
        in_vx = max(in_vx, vx)
        in_force = max(in_force, pressing)
        swing = max(swing, own)
    return Ripple(in_x, in_vx, in_force, swing, system.nodes)


def detuned(
    system: System, belt: float, stiffness: Callable[[], float], stretch: Stretch, lines: Sequence[float]
) -> float:
    """Part of the amplitude of a motion forced on `lines` (Hz) by which the step may move it past resonances.

    At half weights the step turns ω into 2/h tan(ωh/2): det(iω - A) changes by (ωh)²/12 Σ ω/|iω - λ| of itself.
    """
    if system.method.own_steps or system.method.step is None or not lines:
        return 0.0
    c = system.coefficients
    x = stretch.last("x")
    ordered = np.unique(lines)
    size = np.abs(np.fft.rfft(x * np.hanning(len(x)))[1:]) ** 2
    frequencies = np.fft.rfftfreq(len(x), stretch.history.interval)[1:]
    energy = np.bincount(np.searchsorted(0.5 * (ordered[1:] + ordered[:-1]), frequencies), size, len(ordered))
    # of a pad that opens, beside the mean one of steady sliding
    stiffnesses = np.minimum(np.geomspace(0.8, 1.25, 33) * stiffness(), system.contact_stiffness)
    grip = c.grip(belt)
    omega = 2.0 * math.pi * ordered[:, None, None]
    values = np.linalg.eigvals([first_order(c, stiffness_matrix(c, k, grip) / c.m) for k in stiffnesses])
    beside = (omega / np.maximum(np.abs(1j * omega - values), 1e-9 * omega)).sum(axis=2).max(axis=1)
    change = (omega[:, 0, 0] * system.step) ** 2 * (0.25 + beside / 12.0)
    return float(np.sqrt(energy @ change**2 / max(energy.sum(), 1e-300)))
