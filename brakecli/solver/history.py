"""A time history as the analysis sees it: read in pieces, since a long one does not fit into memory."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.quantities import HISTORY

ROW_BYTES = 8 * len(HISTORY) + 1  # of a stored sample: the time, the variables, and the state in one byte


class History(Protocol):
    """Samples of the variables of `model.HISTORY`, at t = 0, interval, 2 interval, …"""

    @property
    def interval(self) -> float:
        """Time between samples, s."""

    @property
    def samples(self) -> int:
        """How many samples there are."""

    def read(self, name: str, start: int, stop: int) -> NDArray[np.float64]:
        """The samples start … stop - 1 of a variable, in SI units."""


@dataclass(frozen=True)
class ArrayHistory:
    """A history in memory: rows of `model.HISTORY`."""

    interval: float
    rows: NDArray[np.float64]

    @property
    def samples(self) -> int:
        """How many samples there are."""
        return len(self.rows)

    def read(self, name: str, start: int, stop: int) -> NDArray[np.float64]:
        """The samples start … stop - 1 of a variable."""
        column: NDArray[np.float64] = self.rows[start:stop, list(HISTORY).index(name)]
        return column
