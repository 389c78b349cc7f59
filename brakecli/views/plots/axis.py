"""An axis of a sweep: its places, their names, and what it looks like in a picture."""

import textwrap
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axis import XAxis, YAxis

from brakecli.views.plots import style


@dataclass(frozen=True)
class Axis:
    """An axis of the grid. `values` are the places along it: numbers in rising order, or 0, 1 … for texts."""

    dimension: str
    key: str
    units: str
    values: style.Array
    texts: tuple[str, ...] | None = None
    offset: bool = False  # of the state of steady sliding, and not the state itself

    @property
    def logarithmic(self) -> bool:
        """Whether the ratios of neighbours are more alike than their distances."""
        values = self.values
        if self.texts is not None or len(values) < 3 or values[0] <= 0.0:
            return False
        if values[-1] < 5.0 * values[0]:  # linear ticks are easier to read
            return False
        steps = np.diff(values)
        ratios = np.diff(np.log(values))
        # where both spreads are the same but for rounding, the axis is linear
        return bool(np.std(ratios) / np.mean(ratios) < 0.999 * np.std(steps) / np.mean(steps))

    @property
    def edges(self) -> style.Array:
        """The limits of the cells around the values: half way between neighbours."""
        places = np.log(self.values) if self.logarithmic else self.values
        middles = 0.5 * (places[1:] + places[:-1])
        edges = np.concatenate([[2.0 * places[0] - middles[0]], middles, [2.0 * places[-1] - middles[-1]]])
        return np.exp(edges) if self.logarithmic else edges

    @property
    def digits(self) -> int:
        """Digits that tell neighbours apart."""
        steps = np.diff(self.values)
        return style.digits_of(style.largest(self.values), float(steps.min()) if len(steps) else 0.0)

    def text(self, index: int) -> str:
        """The value at a place, with its unit."""
        factor, units = style.prefixed(style.largest(self.values), self.units)
        number = style.readable(factor * float(self.values[index]), self.digits)
        return f"{self.texts[index] if self.texts else number} {units}".rstrip()

    def named(self, index: int) -> str:
        """The same with its key."""
        return f"{self.key} = {self.text(index)}"

    def index_of(self, value: str) -> int | None:
        """Where the nearest value stands; None for a text that is not there, and for a number beyond all cells."""
        with suppress(ValueError):
            if self.texts is not None:
                return self.texts.index(value)
            number = float(value)
            values = self.values
            low, high = self.edges[[0, -1]] if len(values) > 1 else values[[0, 0]]
            if abs(number - 0.5 * (low + high)) <= 0.5 * (high - low) + 1e-5 * style.largest(values):
                return int(np.argmin(np.abs(values - number)))
        return None

    def apply_to(self, axis: XAxis | YAxis) -> None:
        """Set scale, ticks and label of an axis of a panel."""
        side = axis.axis_name
        values = self.values
        texts = self.texts
        factor, units = style.prefixed(style.largest(values), self.units)
        if texts is not None:
            step = -(-len(texts) // 30)  # so many at most
            slanted = side == "x" and sum(map(len, texts)) > 70  # characters, which do not fit beside each other
            turned: dict[str, Any] = {"rotation": 30, "ha": "right", "rotation_mode": "anchor"} if slanted else {}
            axis.set_ticks(values[::step], labels=texts[::step], parse_math=False, **turned)
            axis.axes.set(**{f"{side}lim": (-0.5, len(texts) - 0.5)})
            axis.grid(False)
        elif not self.logarithmic and len(values) <= 6 and np.diff(values).min() > 0.1 * np.ptp(values):
            # few, and far enough apart that each has its tick
            axis.set_ticks(values, labels=[style.readable(factor * float(value), self.digits) for value in values])
        else:
            if self.logarithmic:
                axis.axes.set(**{f"{side}scale": "log"})
            style.set_ticks(axis, values[0], values[-1], self.units)
        key = textwrap.shorten(self.key, 45, placeholder=" …") + ", from equilibrium" * self.offset
        axis.set_label_text(style.labelled(key, units), parse_math=False)
