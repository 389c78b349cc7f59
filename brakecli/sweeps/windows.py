"""Windows of instability along a parameter, and what a search for a critical value has come to."""

import math
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

from brakecli.sweeps.tables import Critical

WIDEST = 1.0 / 3.0  # of the range, that an error bar with an answer may have
FOLD = 1.0 / 32.0  # of the range: least bar at a fold, for steps move it, too, by an amount that is not measured


class Outcome(StrEnum):
    """What a search for a critical value has come to."""

    FOUND = "found"
    REGAINED = "found, stable above"
    STABLE = "stable throughout"
    UNSTABLE = "unstable throughout"
    NO_SLIDING = "no steady sliding"
    NONE = "not searched"
    DAMPED = "damped throughout"
    SUSTAINED = "sustained throughout"
    IN_PART = "sustained in part"
    UNDECIDED = "undecided"


class Search(NamedTuple):
    """The answer for one point; None, or NaN, stands for what there is not.

    `error` is the half width of the bracket, plus the bias of the scheme at its step, plus what the growth
    measured leaves open. `bias`: the scheme's own critical value less the exact one. `windows`: both ends of every
    interval of instability; `window_errors`: their error bars, 0 where a bound of the range cuts it.
    """

    outcome: Outcome
    value: float | None = None
    lower: float = math.nan
    upper: float = math.nan
    error: float | None = None
    bias: float | None = None
    eigenvalue: float | None = None
    sustained: float | None = None
    sustained_outcome: Outcome = Outcome.NONE
    windows: tuple[tuple[float, float], ...] = ()
    window_errors: tuple[tuple[float, float], ...] = ()

    @property
    def columns(self) -> dict[str, list[float]]:
        """Both ends of the windows and their error bars, each by its name."""
        found = {"": self.windows, "_error": self.window_errors}
        ends = ("lower", "upper")
        return {end + of: [each[k] for each in found[of]] for of in found for k, end in enumerate(ends)}


class Edge(NamedTuple):
    """Where stability is lost, or regained, with its bracket and error bar; or where it is not known any more."""

    value: float
    lower: float
    upper: float
    error: float
    lost: bool
    known: bool = True


def no_edge(value: float, other: float, lost: bool) -> Edge:
    """An end of what may be a window of instability: at a value, or anywhere on the way to another one."""
    return Edge(value, min(value, other), max(value, other), abs(other - value), lost, known=False)


def of_edges(critical: Critical, unstable: bool, edges: list[Edge]) -> Search:
    """The critical value and all windows of instability; `unstable`: whether the range begins in one.

    One that is narrower than its bars, of which one is wide, may be none; so may what lies between two.
    """
    wide = WIDEST * (critical.upper - critical.lower)
    for one, other in pairwise(edges):
        bars = one.error, other.error
        if one.known and other.known and max(bars) >= wide and other.value - one.value < min(bars):
            return of_edges(critical, unstable, [each for each in edges if each not in (one, other)])
        if one.lost and other.value - one.value < max(bars) < FOLD * (critical.upper - critical.lower):
            # A resonance is at another place with another step: both ends of its window move.
            edges = [each._replace(error=max(bars)) if each in (one, other) else each for each in edges]
    ends = [(critical.lower, 0.0)] * unstable + [(each.value, each.error) for each in edges]
    ends += [(critical.upper, 0.0)] * (len(ends) % 2)
    columns = ([each[k] for each in ends] for k in (0, 1))
    windows, errors = (tuple(zip(each[::2], each[1::2], strict=True)) for each in columns)
    if not edges:
        return Search(Outcome.UNSTABLE if unstable else Outcome.STABLE, windows=windows, window_errors=errors)
    first = next((each for each in edges if each.lost), edges[0])
    if not first.known:
        return Search(Outcome.UNDECIDED, windows=windows, window_errors=errors)
    if first.error >= wide:  # almost any value of the range may be it
        return Search(Outcome.UNDECIDED)
    outcome = Outcome.FOUND if first.lost else Outcome.REGAINED
    return Search(outcome, *first[:4], windows=windows, window_errors=errors)
