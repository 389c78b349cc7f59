"""The quantities of a run that can be drawn, and the axes that they get: unit, round offset, limits."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from brakecli.views.plots import style


class Quantity(NamedTuple):
    """How a quantity is named in a title, at an axis, and as a symbol; its unit."""

    title: str
    axis: str
    symbol: str
    unit: str


VARIABLES = {  # what `--variable` may name
    "x": Quantity("tangential displacement", "displacement x", "x", "m"),
    "y": Quantity("normal displacement", "displacement y", "y", "m"),
    "vx": Quantity("tangential velocity", "velocity ẋ", "ẋ", "m/s"),
    "vy": Quantity("normal velocity", "velocity ẏ", "ẏ", "m/s"),
    "friction_force": Quantity("friction force on the shoe", "friction force $F_x$", "$F_x$", "N"),
    "normal_force": Quantity("normal contact force", "normal force $F_y$", "$F_y$", "N"),
    "torque": Quantity("braking torque", "braking torque $R F_x$", "$R F_x$", "N m"),
    "contact_fraction": Quantity(
        "part of the pad that touches", "touching part of the pad", "the touching part", ""
    ),
}


@dataclass(frozen=True)
class Scaled:
    """How values are drawn along an axis: with which words, in which unit, and less which round number."""

    label: str
    unit: str
    factor: float
    centre: float = 0.0
    limits: tuple[float, float] | None = None  # where the values are constant

    def __call__(self, values: style.Array) -> style.Array:
        """The values to be drawn."""
        return self.factor * (values - self.centre)


def scaled(variable: str, values: style.Array, whole: style.Array, also: float = 0.0) -> Scaled:
    """The axis of values in SI units, as small as they are in the whole run, where `also` is drawn beside them."""
    name = VARIABLES[variable].axis
    unit = VARIABLES[variable].unit
    largest = max(style.largest(whole), also)
    moves = float(np.ptp(values))
    if moves <= max(1e-6 * float(np.ptp(whole)), style.ROUNDING * largest):  # too little for more than a line
        middle = float(np.median(values))
        half = 0.05 * largest or 1.0
        factor, unit = style.prefixed(abs(middle) + half, unit)
        limits = factor * (middle - half), factor * (middle + half)
        return Scaled(style.labelled(name, unit), unit, factor, limits=limits)
    if centre := _centre(values) if unit != "m/s" else 0.0:
        less, its_unit = style.prefixed(abs(centre), unit)
        name += f" {'−' if centre > 0.0 else '+'} {less * abs(centre):.12g} {its_unit}".rstrip()
    factor, unit = style.prefixed(max(style.largest(values - centre), also), unit)
    return Scaled(style.labelled(name, unit), unit, factor, centre)


def _centre(values: style.Array) -> float:
    """What to subtract from values that differ too little for readable ticks, in round numbers; otherwise 0."""
    middle = 0.5 * float(values.min() + values.max())
    width = float(np.ptp(values))
    if not 0.0 < width < 0.02 * abs(middle):
        return 0.0
    digits = math.ceil(math.log10(abs(middle) / width))
    return float(f"{middle:.{digits}e}")
