"""Windows of instability along a parameter, and what a search for a critical value has come to."""

import math
from collections.abc import Callable
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

from brakecli.sweeps.tables import Critical

WIDEST = 1.0 / 3.0
"""Part of the range that an error bar with an answer may have."""


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

    `error` is the half width of the bracket, plus what steps leave open. `bias`: the critical value of the case's
    scheme less the exact one. `windows`: both ends of every interval of instability; `window_errors`: their error
    bars, 0 where a bound of the range cuts it. `coexists_from`: the least value with a stable vibration beside
    stable sliding; `barrier`: half of peak to peak of x (m) of the unstable cycle at the case's own value;
    `sentence`: all of this in words.
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
    coexists_from: float | None = None
    barrier: float | None = None
    sentence: str = ""
    windows: tuple[tuple[float, float], ...] = ()
    window_errors: tuple[tuple[float, float], ...] = ()

    @property
    def columns(self) -> dict[str, list[float]]:
        """Both ends of the windows and their error bars, each by its name."""
        found = {"": self.windows, "_error": self.window_errors}
        ends = ("lower", "upper")
        return {end + of: [each[k] for each in found[of]] for of in found for k, end in enumerate(ends)}

    def unstable_at(self, value: float) -> bool | None:
        """Whether sliding is unstable at a value of the parameter; None where that is not known."""
        if self.outcome is Outcome.FOUND:
            return value >= self.upper
        known = self.outcome in (Outcome.REGAINED, Outcome.STABLE, Outcome.UNSTABLE)
        return any(low <= value <= high for low, high in self.windows) if known else None


class Edge(NamedTuple):
    """Where stability is lost, or regained, with its error bar; or where it is not known any more."""

    value: float
    error: float
    known: bool = True


class Piece(NamedTuple):
    """A part of the range, or a single value, and whether it is unstable; None where nobody knows."""

    low: float
    high: float
    unstable: bool | None


def joined(critical: Critical, pieces: list[Piece], edge: Callable[[float, float], Edge]) -> Search:
    """The critical value and all windows of instability; `edge` says where between two values stability changes.

    Stability may be lost where nothing is known: a window may then begin, or end, anywhere there.
    """
    decided = [k for k, piece in enumerate(pieces) if piece.unstable is not None]
    if not decided:
        return Search(Outcome.UNDECIDED)
    first = pieces[decided[0]]
    last = pieces[decided[-1]]
    edges = list[Edge]()
    begun = first.unstable and decided[0] == 0
    if decided[0] > 0:
        edges += [
            _anywhere(critical.lower, first.low),
            *[_anywhere(first.low, critical.lower)] * (not first.unstable),
        ]
    for one, other in pairwise(decided):
        before = pieces[one]
        after = pieces[other]
        if before.unstable is not after.unstable:
            edges.append(edge(before.high, after.low))
        elif not before.unstable and other > one + 1:
            edges += [_anywhere(before.high, after.low), _anywhere(after.low, before.high)]
    if decided[-1] < len(pieces) - 1:
        edges += (
            [_anywhere(critical.upper, last.high)] if last.unstable else [_anywhere(last.high, critical.upper)]
        )
    return of_edges(critical, bool(begun), edges)


def _anywhere(value: float, other: float) -> Edge:
    """An end of what may be a window of instability: at a value, or anywhere on the way to another one."""
    return Edge(value, abs(other - value), known=False)


def of_edges(critical: Critical, unstable: bool, edges: list[Edge]) -> Search:
    """The critical value and all windows, by the edges in order; `unstable`: whether the range begins in one."""
    wide = WIDEST * (critical.upper - critical.lower)
    ends = [(critical.lower, 0.0)] * unstable + [(each.value, each.error) for each in edges]
    ends += [(critical.upper, 0.0)] * (len(ends) % 2)
    columns = ([each[k] for each in ends] for k in (0, 1))
    windows, errors = (tuple(zip(each[::2], each[1::2], strict=True)) for each in columns)
    if not edges:
        return Search(Outcome.UNSTABLE if unstable else Outcome.STABLE, windows=windows, window_errors=errors)
    first = edges[min(unstable, len(edges) - 1)]  # where stability is lost; else where it is regained
    if not first.known:
        return Search(Outcome.UNDECIDED, windows=windows, window_errors=errors)
    if first.error >= wide:  # almost any value of the range may be it
        return Search(Outcome.UNDECIDED)
    outcome = Outcome.REGAINED if unstable and len(edges) == 1 else Outcome.FOUND
    lower = max(first.value - first.error, critical.lower)
    upper = min(first.value + first.error, critical.upper)
    return Search(outcome, first.value, lower, upper, first.error, windows=windows, window_errors=errors)
