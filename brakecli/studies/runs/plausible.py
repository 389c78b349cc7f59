"""Plausibility: ranges that the numbers of a brake lie in, and the slip that most often leads out of each."""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from brakecli.solver.schedules import knots, values
from brakecli.solver.system import System


def _load(system: System) -> float:
    """The largest |Q|, N."""
    return float(np.abs(values(system.load)).max())


def _compression(system: System) -> float:
    """How far the largest load presses the pad in, over a: |Q_y| / (c_yy + 2ak), held along the wheel."""
    c = system.coefficients
    return _load(system) * c.cos_beta / (c.c_yy + system.contact_stiffness) / system.half_length


def _of_the_links(system: System) -> float:
    """Stiffness of the whole pad over that of the links across the wheel, 2ak / c_yy."""
    across = system.coefficients.c_yy
    return system.contact_stiffness / across if across > 0.0 else math.inf


def _damping_ratio(system: System) -> float:
    """The largest v·Bv / (2 √(m v·Sv)) of the modes v of a shoe in full contact; one without a spring has none."""
    c = system.coefficients
    springs, modes = np.linalg.eigh([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy + system.contact_stiffness]])
    dashpots = np.diag(modes.T @ [[c.b_xx, c.b_xy], [c.b_xy, c.b_yy]] @ modes)
    of_modes = zip(dashpots.tolist(), springs.tolist(), strict=True)
    return max((0.5 * b / math.sqrt(c.m) / math.sqrt(s) for b, s in of_modes if s > 0.0), default=0.0)


class Range(NamedTuple):
    """A number of a system, the bound that it should keep to, and what was probably meant where it does not."""

    key: str  # as a warning names it; of a schedule with its plural
    what: str
    number: Callable[[System], float]
    side: str
    bound: float
    unit: str
    slip: str


_PAD = "were N/mm² meant? The stiffness is in N/m²"
_SPRINGS = "were N/mm and N/mm² meant? Stiffnesses are in N/m, that of the contact in N/m²"
_LINKS = "were N/mm meant? Stiffnesses are in N/m, dampings in N·s/m"
_NEWTONS = "were kilonewtons meant? Forces are in N"
_PASCALS = "was a pressure in Pa meant? Forces are in N"
_PER_CENT = "were per cent meant? It is a ratio"
_TURNS = "were revolutions per minute meant? Angular speeds are in rad/s"
_SHARE = " times the links' stiffness"
RANGES = (
    Range("shoe.mass", "", lambda s: s.coefficients.m, "more", 300.0, " kg", "were grams meant? Masses are in kg"),
    Range("wheel.radius", "", lambda s: s.radius, "more", 20.0, " m", "were millimetres meant? Lengths are in m"),
    Range("friction.coefficient", "", lambda s: s.coefficients.phi, "more", 2.0, "", _PER_CENT),
    Range("load.force", "", lambda s: _load(s) or math.inf, "less", 20.0, " N", _NEWTONS),  # no load is meant so
    Range("load.force", "", _load, "more", 1e6, " N", _PASCALS),
    Range("wheel.angular_speed", "a surface speed of ", lambda s: s.fastest_belt, "more", 100.0, " m/s", _TURNS),
    Range("contact.stiffness", "a whole pad of ", _of_the_links, "less", 0.01, _SHARE, _PAD),
    Range("contact.stiffness", "a pad pressed in by ", _compression, "more", 0.1, " half lengths", _SPRINGS),
    Range("link1.damping, link2.damping", "a damping ratio of ", _damping_ratio, "more", 1.0, "", _LINKS),
)


def implausible(system: System) -> Iterator[str]:
    """A sentence for each number that is out of its range."""
    schedules = {"load.force": system.load, "wheel.angular_speed": system.belt}
    for key, what, number, side, bound, unit, slip in RANGES:
        value = number(system)
        if value < bound if side == "less" else value > bound:
            plural = "s" if key in schedules and knots(schedules[key]) > 1 else ""
            yield f"{key}{plural}: {what}{value:.6g}{unit} is {side} than {bound:g}{unit}; {slip}"
