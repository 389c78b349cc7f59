"""Windows of instability along a parameter, and what a search for a critical value has come to."""

import math
from collections.abc import Iterable
from enum import StrEnum
from typing import NamedTuple

from brakecli.analysis.stability.margin import Change
from brakecli.studies.sweeps.tables import Critical

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
        ends_of = {"": self.windows, "_error": self.window_errors}
        ends = ("lower", "upper")
        return {end + of: [window[k] for window in ends_of[of]] for of in ends_of for k, end in enumerate(ends)}

    def unstable_at(self, value: float) -> bool | None:
        """Whether sliding is unstable at a value of the parameter; None where that is not known."""
        if self.outcome is Outcome.FOUND:
            return value >= self.upper
        decided = self.outcome in (Outcome.REGAINED, Outcome.STABLE, Outcome.UNSTABLE)
        return any(low <= value <= high for low, high in self.windows) if decided else None


def of_changes(critical: Critical, unstable: bool | None, in_order: Iterable[Change]) -> Search:
    """The critical value and all windows, by the changes in order; `unstable`: the side of the first value."""
    changes = [*in_order]
    begun = unstable is True
    ends = [(critical.lower, 0.0)] * begun + [(change.value, change.error) for change in changes]
    ends += [(critical.upper, 0.0)] * (len(ends) % 2)
    columns = ([end[k] for end in ends] for k in (0, 1))
    windows, errors = (tuple(zip(column[::2], column[1::2], strict=True)) for column in columns)
    if not changes:
        outcome = {True: Outcome.UNSTABLE, False: Outcome.STABLE, None: Outcome.UNDECIDED}[unstable]
        return Search(outcome, windows=windows, window_errors=errors)
    first = changes[min(begun, len(changes) - 1)]  # where stability is lost; else where it is regained
    if not first.known:
        return Search(Outcome.UNDECIDED, windows=windows, window_errors=errors)
    if first.error >= WIDEST * (critical.upper - critical.lower):  # almost any value of the range may be it
        return Search(Outcome.UNDECIDED)
    outcome = Outcome.REGAINED if begun and len(changes) == 1 else Outcome.FOUND
    lower = max(first.value - first.error, critical.lower)
    upper = min(first.value + first.error, critical.upper)
    return Search(outcome, first.value, lower, upper, first.error, windows=windows, window_errors=errors)
