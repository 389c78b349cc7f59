"""Which extremes there are: one quantity far beyond those of any brake, or several drawn quantities at a time."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.extremes.judging import (
    EVENT_TOLERANCE,
    FLAT,
    MOST_ERROR,
    ROUGH,
    SCHEMES,
    Outcome,
    Pace,
    Scheme,
    Tables,
    Truth,
    changed,
    judge,
    pace,
    truth,
)


@dataclass(frozen=True)
class Family:
    """One thing that is varied: its name, unit and values, and the tables of a case with such a value."""

    name: str
    unit: str
    values: tuple[float, ...]
    tables: Callable[[float], Tables]
    omega_h: Callable[[float], float | None] = lambda value: None
    dashpots: bool = True  # whether the step follows overcritical dashpots

    def pace(self, value: float) -> Pace:
        return pace(self.tables(value), self.omega_h(value), dashpots=self.dashpots)


def decades(low: int, high: int, each: int = 1) -> tuple[float, ...]:
    """Powers of ten from 10^low to 10^high, `each` to a decade."""
    return tuple(float(f"{10.0 ** (low + i / each):.3g}") for i in range((high - low) * each + 1))


def _of(key: str, base: Tables = FLAT) -> Callable[[float], Tables]:
    return lambda value: changed(base, key, value)


def _speed(base: Tables, speed: float) -> Tables:
    return changed(base, "wheel.angular_speed", speed / base["wheel"]["radius"])


def _dashpots(part: float) -> Tables:
    """Both dashpots at a part of the critical damping of their own spring and the mass."""
    tables = FLAT
    for link in ("link1", "link2"):
        critical = 2.0 * math.sqrt(FLAT[link]["stiffness"] * FLAT["shoe"]["mass"])
        tables = changed(tables, f"{link}.damping", part * critical)
    return tables


def _waves(wavelength: float, nodes: int | None) -> Tables:
    wheel = {"amplitudes": [10e-6], "wavelengths": [wavelength]}
    tables = changed(ROUGH, "roughness.wheel", wheel)
    return changed(tables, "contact.nodes", nodes) if nodes else tables


ENDS = (-90.0, -89.999, -45.0, -1e-6, 0.0, 1e-6, 45.0, 89.999, 90.0)
NODES = 64
FAMILIES = (
    Family("contact stiffness", "N/m²", decades(0, 16), _of("contact.stiffness")),
    Family("mass", "kg", decades(-6, 6), _of("shoe.mass")),
    Family(
        "friction",
        "1",
        (0.0, 1e-9, 1e-3, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0),
        _of("friction.coefficient"),
    ),
    Family(
        "speed",
        "m/s",
        (0.0, *decades(-9, 3)),
        lambda speed: _speed(FLAT, speed),
    ),
    Family("speed, rough wheel", "m/s", (0.0, *decades(-9, 2)), lambda speed: _speed(ROUGH, speed)),
    Family("dashpots, step by their rate", "of critical", (0.0, *decades(-6, 4)), _dashpots),
    Family("dashpots, step by the springs", "of critical", decades(0, 4), _dashpots, dashpots=False),
    Family("angle of link 1", "deg", ENDS, _of("link1.angle_deg")),
    Family("angle of link 2", "deg", ENDS, _of("link2.angle_deg")),
    Family("wavelength, nodes chosen", "m", decades(-4, 0, 2), lambda length: _waves(length, None)),
    Family(f"wavelength, {NODES} nodes", "m", decades(-4, 0, 2), lambda length: _waves(length, NODES)),
    Family(
        "step times ω",
        "1",
        (*decades(-3, -1, 2), 0.3, *decades(0, 3, 2)),
        lambda omega_h: FLAT,
        lambda omega_h: omega_h,
    ),
)


def campaign(
    families: Sequence[Family] = FAMILIES,
) -> Iterator[tuple[Family, float, Truth, dict[Scheme, Outcome]]]:
    """Every point of every family by every scheme."""
    for family in families:
        for value in family.values:
            tables = family.tables(value)
            at = family.pace(value)
            reference = truth(tables, at)
            yield family, value, reference, {scheme: judge(tables, scheme, at, reference) for scheme in SCHEMES}


DRAWN = {
    "contact.stiffness": (0, 16),
    "shoe.mass": (-6, 6),
    "wheel.angular_speed": (-9, 3),
    "friction.coefficient": (-3, 1),
    "load.force": (-6, 9),
    "link1.damping": (-3, 7),
    "link2.damping": (-3, 7),
    "link1.stiffness": (-3, 14),
    "link2.stiffness": (-3, 14),
}
"""What is drawn for the points of three extremes, as powers of ten."""
ANGLES = ("link1.angle_deg", "link2.angle_deg")
POINTS = 200


def drawn(count: int) -> Iterator[Tables]:
    """Points with three quantities anywhere in their ranges, and each angle in every third."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        tables = FLAT
        for key in rng.permutation(list(DRAWN))[:3]:
            tables = changed(tables, str(key), float(10.0 ** rng.uniform(*DRAWN[str(key)])))
        for key in ANGLES:
            if rng.uniform() < 1.0 / 3.0:
                tables = changed(tables, key, float(rng.uniform(-90.0, 90.0)))
        yield tables


def together(count: int) -> Iterator[dict[Scheme, Outcome]]:
    """What comes of drawn points; right is what is off by at most `MOST_ERROR`, or by the tolerance."""
    for tables in drawn(count):
        at = pace(tables)
        reference = truth(tables, at)
        most = {scheme: MOST_ERROR if scheme.order else EVENT_TOLERANCE for scheme in SCHEMES}
        yield {scheme: judge(tables, scheme, at, reference, most[scheme]) for scheme in SCHEMES}
