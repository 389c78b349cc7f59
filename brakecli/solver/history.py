"""A time history as the analysis sees it: read in pieces, since a long one does not fit into memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from brakecli.solver.quantities import HISTORY

ROW_BYTES = 8 * len(HISTORY) + 1  # of a stored sample: the time, the variables, and the state in one byte
_COLUMNS = {name: column for column, name in enumerate(HISTORY)}


@dataclass(frozen=True)
class History:
    """Samples of the variables of `quantities.HISTORY`, at t = 0, interval, 2 interval, …"""

    interval: float  # s
    samples: int
    read: Callable[[str, int, int], NDArray[np.float64]]  # the samples start … stop - 1 of a variable, SI units;
    # of many histories at once, a row for each


def array_history(interval: float, rows: NDArray[np.float64]) -> History:
    """A history in memory: rows of `quantities.HISTORY`."""
    return History(interval, len(rows), lambda name, start, stop: rows[start:stop, _COLUMNS[name]])


def stacked(histories: Sequence[History]) -> History:
    """Many histories at once, which have the same interval and as many samples."""
    interval = histories[0].interval
    samples = histories[0].samples
    read = histories[0].read
    if len(histories) == 1:  # which may be too long for memory
        return History(interval, samples, lambda *piece: read(*piece)[None])

    @cache
    def column(name: str) -> NDArray[np.float64]:
        return np.array([history.read(name, 0, samples) for history in histories])

    return History(interval, samples, lambda name, start, stop: column(name)[:, start:stop])
