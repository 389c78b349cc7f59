"""Steady sliding: the position at which (6)-(7) hold without motion, averaged over the wheel's roughness."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

import numpy as np

from brakecli.errors import CaseError, Problem
from brakecli.solver.arrays import VECTOR, Floats
from brakecli.solver.contact.closed_form import CLEAR, FULL, coverage
from brakecli.solver.contact.force import evaluate
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.kernels import entry
from brakecli.solver.records import Layer
from brakecli.solver.roughness import turn
from brakecli.solver.system import MOST_TABLE_BYTES, System

WINDOWS = 4
"""Stretches of the wheel of which each has an average of its own: by their differences the error is known."""
PLACES = 1024
"""Positions of the wheel that an average takes, in all stretches, each as long as 50 of its longest waves."""
TABLE = 129
PRESSED = 1e-6
"""Least normal force of a pressed shoe, as a part of the load. Below it the force is a difference of numbers that
are a million times as large, and a small change of any of them lifts the shoe off."""
UNPRESSED = (
    "there is no steady sliding: nothing presses the shoe on the wheel; change the load, or the angle of link 1"
)

Mean = Callable[[float], tuple[float, float, float]]
"""Mean force (N), stiffness (N/m) and touching part of the contact at a height y (m)."""


@dataclass(frozen=True)
class SteadySliding:
    """Steady sliding: position (m), normal force (N), mean stiffness -∂F_y/∂y (N/m), part that touches."""

    x: float
    y: float
    normal_force: float
    stiffness: float
    contact_fraction: float

    def is_pressed(self, load: float) -> bool:
        """Whether a load (N) presses the shoe on the wheel. If not, it rests there, but nothing slides."""
        return self.normal_force > PRESSED * abs(load)


@entry(None, float, VECTOR, VECTOR, Layer, VECTOR, VECTOR, VECTOR)
def add_places(
    y: float, places: Floats, weights: Floats, layer: Layer, tables: Floats, scratch: Floats, sums: Floats
) -> None:
    """Add force, stiffness and touching part at places of the wheel, Σ w_i F(x_i), with their weights."""
    contact = layer.contact
    for i in range(places.size):
        turn(places[i], 0.0, layer, tables, scratch)
        evaluate(0.0, y, layer, tables, scratch)
        sums[0] += weights[i] * contact.normal_force
        sums[1] += weights[i] * contact.stiffness
        sums[2] += weights[i] * contact.fraction


@entry(None, VECTOR, VECTOR, Layer, VECTOR, VECTOR, VECTOR)
def forces_along(
    heights: Floats, places: Floats, layer: Layer, tables: Floats, scratch: Floats, forces: Floats
) -> None:
    """The normal force (N) at each height (m) and place of the wheel (m)."""
    for i in range(places.size):
        turn(places[i], 0.0, layer, tables, scratch)
        evaluate(0.0, heights[i], layer, tables, scratch)
        forces[i] = layer.contact.normal_force


def averaged_length(system: System) -> float:
    """Travel of the wheel (m) that an average is taken over."""
    return WINDOWS * 50.0 / float(system.wheel.turns.min()) if len(system.wheel.g) else 0.0


def fills_window(system: System) -> bool:
    """Whether the places are so near each other that a window is filled sooner than each of them is summed."""
    return 0.0 < system.window_rows * averaged_length(system) < PLACES * 2.0 * system.half_length


def mean_contacts(system: System, y: float) -> Floats:
    """Force (N), stiffness (N/m) and touching part at a height y (m), averaged over each of the windows, in rows.

    Full contact averages to its closed form. Otherwise places over many waves are averaged under Hann windows, so
    that waves that do not close leave little. They lie alike on either side of the wheel's first place, so that
    mirror images have the same averages. From window to window they are shifted by a part of their distance:
    together they sample a wave that closes as finely as all of them would.
    """
    pad = system.pad.constants
    wheel = system.wheel
    covered = coverage(y, pad)
    length = 2.0 * pad.half_length
    if covered == CLEAR:
        return np.zeros((WINDOWS, 3))
    if covered == FULL:
        return np.tile([-pad.k * length * (y + pad.shoe_mean), pad.k * length, 1.0], (WINDOWS, 1))
    sums = np.zeros((WINDOWS, 3))
    layer = build_layer(system.evaluator, system.pad, moving=fills_window(system))
    if wheel.g.size == 0:
        add_places(y, np.zeros(1), np.ones(1), *layer, sums[0])
        return np.tile(sums[0], (WINDOWS, 1))
    window = averaged_length(system) / WINDOWS
    count = PLACES // WINDOWS
    for k in range(WINDOWS):
        parts = (np.arange(count) + (k + 0.5) / WINDOWS) / count
        weights = 2.0 * np.sin(np.pi * parts) ** 2
        add_places(y, window * (parts + k - WINDOWS // 2), weights / count, *layer, sums[k])
    return sums


def mean_contact(system: System, y: float) -> tuple[float, float, float]:
    """The same averaged over all windows."""
    force, stiffness, fraction = mean_contacts(system, y).mean(axis=0).tolist()
    return force, stiffness, fraction


@dataclass(frozen=True)
class _Surfaces:
    """What the mean contact of a layer of 1 N/m² depends on; systems that are alike in it share a table."""

    key: tuple[object, ...]
    system: System = field(compare=False)


@lru_cache(maxsize=4)
def _table(surfaces: _Surfaces) -> tuple[Floats, Floats]:
    """Heights (m) between full contact and none, and the mean contact at each of them in each window."""
    pad = surfaces.system.pad.constants
    heights = np.linspace(float(pad.full_up_to), float(pad.clear_from), TABLE)
    values = np.array([mean_contacts(surfaces.system, float(y)) for y in heights])
    values[:, :, :2] /= surfaces.system.layer_stiffness
    return heights, values


@lru_cache(maxsize=4 * (1 + WINDOWS))
def _interpolated(surfaces: _Surfaces, window: int | None) -> tuple[Any, Any, Any]:
    """Force, its slope and the touching part between full contact and none, interpolated; `window`: by one alone.

    The force is a cubic through its values and slopes; its error falls with the fourth power of the spacing.
    """
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    heights, by_window = _table(surfaces)
    values = by_window.mean(axis=1) if window is None else by_window[:, window]
    force = CubicHermiteSpline(heights, values[:, 0], -values[:, 1])
    return force, force.derivative(), PchipInterpolator(heights, values[:, 2])


def tabulated(system: System, window: int | None = None) -> Mean:
    """The mean contact, interpolated between `TABLE` heights where the pad touches in part: for many calls.

    `window`: by the average over one of the windows alone.
    """
    mean = partial(mean_contact, system)
    pad = system.pad.constants
    full = float(pad.full_up_to)
    top = float(pad.clear_from)
    profiles = [numbers.tobytes() for profile in (system.shoe, system.wheel) for numbers in profile]
    surfaces = _Surfaces((system.half_length, system.evaluator, system.nodes, *profiles), system)
    k = system.layer_stiffness

    def interpolated(y: float) -> tuple[float, float, float]:
        if not full < y < top:
            return mean(y)
        force, slope, fraction = _interpolated(surfaces, window)
        return k * float(force(y)), -k * float(slope(y)), float(fraction(y))

    return interpolated


def steady_sliding(
    system: System, *, belt: float | None = None, phi: float | None = None, mean: Mean | None = None
) -> SteadySliding:
    """Steady sliding under the load of t = 0; no friction acts where U = 0.

    With F_x = sign(U) phi F_y, (6) gives x for a height y and (7) remains: one equation in y. U (m/s) and phi are
    those of the system unless they are given. Raises CaseError where there is no solution.
    """
    c = system.coefficients
    pad = system.pad.constants
    load = system.load_at_start
    mean = mean or partial(mean_contact, system)
    grip = float(np.sign(system.belt_speed if belt is None else belt)) * (c.phi if phi is None else phi)
    q_x = load * c.sin_beta
    q_y = load * c.cos_beta
    if c.c_xx > 0.0:
        lean = c.c_xy / c.c_xx
    elif grip == 0.0 and q_x == 0.0:
        lean = 0.0
    else:
        raise _none("no link holds the shoe along the wheel")
    spring = c.c_yy - lean * c.c_xy
    push = q_y - lean * q_x
    uplift = 1.0 - lean * grip  # of F_y, after what its friction takes away through the links

    def unbalanced(y: float) -> float:
        return spring * y + push - uplift * mean(y)[0]

    full = float(pad.full_up_to)
    top = float(pad.clear_from)
    stiffness = system.contact_stiffness
    whole = spring + uplift * stiffness
    y = -(push + uplift * stiffness * pad.shoe_mean) / whole if whole != 0.0 else np.inf
    if not y <= full:
        if unbalanced(top) < 0.0:
            if spring <= 0.0:  # links in one line leave none across it, but for rounding of either sign
                raise _none("the load lifts the shoe off the wheel and no link holds it")
            y = -push / spring
        elif unbalanced(full) < 0.0:
            from scipy.optimize import brentq  # only pads that open wait for it

            # to a few units of rounding, of the roughness and of y
            y = brentq(unbalanced, full, top, xtol=1e-15 * max(abs(full), abs(top), 1e-300), rtol=1e-14)
        else:
            raise _none("the friction force lifts more than the load presses (self-locking)")
    force, stiffness, fraction = mean(float(y))
    x = (grip * force - q_x) / c.c_xx - lean * y if c.c_xx > 0.0 else 0.0
    return SteadySliding(float(x), float(y), force, stiffness, fraction)


def sliding(system: System, mean: Mean | None = None, phi: float | None = None) -> SteadySliding | None:
    """Steady sliding as `steady_sliding` finds it; None where there is none."""
    with suppress(CaseError):
        return steady_sliding(system, mean=mean, phi=phi)
    return None


def finer(system: System) -> System:
    """The system with twice as many cells, or with the exact contact where these are too many."""
    if not system.nodes:
        return system
    twice = system.by(evaluator="cells", nodes=2 * system.nodes)
    return twice if twice.table_bytes <= MOST_TABLE_BYTES else system.by(evaluator="exact")


def off_by_nodes(system: System, equilibrium: SteadySliding) -> tuple[float, float]:
    """How far x and y (m) of steady sliding by nodes lie off those of the exact contact.

    What the force F lacks is told by twice as many cells, whose error is an eighth of that of cells, and less of
    that of the midpoint rule. With it (7) moves y by uplift δF/(spring + uplift K), and (6) moves x.
    """
    c = system.coefficients
    if not system.nodes or c.c_xx == 0.0:
        return 0.0, 0.0
    lacks = mean_contact(finer(system), equilibrium.y)[0] - equilibrium.normal_force
    lean = c.c_xy / c.c_xx
    grip = c.grip(system.belt_speed)
    uplift = 1.0 - lean * grip
    y = uplift * lacks / (c.c_yy - lean * c.c_xy + uplift * equilibrium.stiffness)
    x = grip * (lacks - equilibrium.stiffness * y) / c.c_xx - lean * y
    return -x, -y


def _none(reason: str) -> CaseError:
    what = f"there is no steady sliding: {reason}"
    return CaseError([Problem(("initial", "at"), what, 'start from at = "rest"', source="the case")])
