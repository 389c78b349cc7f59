"""What the samples of histories show, of many at once: each number is computed for all of them together."""

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.regime.evidence import (
    FEWEST_SAMPLES,
    FULL,
    LAST,
    LONGEST,
    WINDOWS,
    Stretch,
    last_quarter,
    level_change,
    tenths,
)
from brakecli.analysis.spectrum import Array
from brakecli.solver.alike import at_once, by_rows
from brakecli.solver.history import History, stacked


class Statistics(NamedTuple):
    """What a history shows, in SI units; nan where the samples are too few for that."""

    state: float  # of the contact at the end
    state_from: int  # the sample from which on it is that
    full_from: int  # the sample from which on the whole pad touches; their number where it does not at the end
    first: float  # half of peak to peak of x in the first tenth
    final: float  # in the last tenth
    swing: float  # in the second half
    amplitude: float  # in the last quarter
    level: float  # standard deviation of vx there
    change: float = math.nan  # of the logarithm of the level within the second half
    change_error: float = math.nan
    final_level: float = math.nan  # in the last quarter, in the mean over windows
    largest_level: float = math.nan
    settled_from: int = 0  # the sample at which the settled part begins; 0 where there is none


def statistics(histories: Sequence[History], within: float) -> list[Statistics]:
    """What each history shows; a settled level changes by this part of itself at most."""

    def of_those(places: list[int]) -> list[Statistics]:
        columns = _columns(stacked([histories[i] for i in places]), within)
        return [Statistics(**row) for row in by_rows(columns)]

    return at_once([(history.interval, history.samples) for history in histories], of_those)


def _columns(history: History, within: float) -> dict[str, NDArray[np.generic]]:
    """The numbers of `Statistics` by their names, of each of many histories."""
    samples = history.samples
    first, last = tenths(samples)
    whole = Stretch(history, 0, samples)
    state = history.read("state", samples - 1, samples)
    quarter = Stretch(history, last_quarter(samples), samples)
    columns = {
        "state": state[:, 0],
        "state_from": whole.since("state", lambda values: values == state),
        "full_from": whole.since("contact_fraction", lambda values: values >= FULL),
        "first": Stretch(history, 0, first).amplitude("x"),
        "final": Stretch(history, last, samples).amplitude("x"),
        "swing": Stretch(history, samples // 2, samples).amplitude("x"),
        "amplitude": quarter.amplitude("x"),
        "level": quarter.deviation("vx"),
    }
    if samples < FEWEST_SAMPLES:
        return columns
    vx, least, largest = _windowed(history)
    final = _final(vx)
    window = _settled_window((vx, least, largest), within, 0.4 * within)  # the bounds of x by less; a choice
    change, change_error = level_change(vx[:, WINDOWS // 2 :])
    return columns | {
        "change": change,
        "change_error": change_error,
        "final_level": final,
        "largest_level": vx.max(axis=1),
        "settled_from": window * samples // WINDOWS,
    }


@lru_cache(maxsize=4)
def _windows(samples: int) -> tuple[NDArray[np.int_], NDArray[np.int_], NDArray[np.int_]]:
    """The samples that begin equal windows, how many each holds, and where the window of each sample begins."""
    edges = np.linspace(0, samples, WINDOWS + 1).astype(int)
    return edges[:-1], np.diff(edges), np.repeat(edges[:-1], np.diff(edges))


def _windowed(history: History) -> tuple[Array, Array, Array]:
    """Standard deviation of vx (m/s), least and largest x (m) in equal windows, of each of many histories."""
    if history.samples > LONGEST:
        edges = np.linspace(0, history.samples, WINDOWS + 1).astype(int)
        windows = [Stretch(history, begin, end) for begin, end in pairwise(edges)]
        numbers = np.array([(window.deviation("vx"), *window.extremes("x")) for window in windows])
        vx, least, largest = np.ascontiguousarray(numbers.transpose(1, 2, 0))
        return vx, least, largest
    x, vx = (history.read(name, 0, history.samples) for name in ("x", "vx"))
    starts, counts, firsts = _windows(history.samples)
    away = vx - vx[:, firsts]
    mean, square = (np.add.reduceat(values, starts, axis=1) / counts for values in (away, away * away))
    least, largest = (extreme.reduceat(x, starts, axis=1) for extreme in (np.minimum, np.maximum))
    return np.sqrt(np.maximum(square - mean**2, 0.0)), least, largest


def _final(values: Array) -> Array:
    """Means of the last windows; of a shoe at rest, whose windows are all alike, to the last bit."""
    last = values[:, -1]
    return np.asarray(last + np.add.reduce(values[:, -LAST:] - last[:, None], axis=1) / LAST)


def _settled_window(windowed: tuple[Array, Array, Array], within: float, reach: float) -> NDArray[np.int_]:
    """The windows, never the first, from which on all are settled; 0 where fewer than the last quarter are."""
    vx, least, largest = windowed
    final = _final(vx)
    span = _final(largest - least)
    settled = np.abs(vx - final[:, None]) <= within * final[:, None]
    for bound in (least, largest):
        settled &= np.abs(bound - _final(bound)[:, None]) <= reach * span[:, None]
    first = np.where(settled.all(axis=1), 1, WINDOWS - settled[:, ::-1].argmin(axis=1))
    return np.where(first <= WINDOWS - LAST, first, 0)
