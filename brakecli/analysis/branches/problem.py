"""The contract between the engine and what it follows.

A motion is a vector of unknowns `u` at a parameter `p`, at which a gap vanishes. The parameter runs from 0 to 1
over the range that a user has given. Unknowns and gap are scaled by the problem: lengths of order one are large.
"""

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from brakecli.solver.arrays import Floats

if TYPE_CHECKING:
    from brakecli.analysis.branches.point import Point

Array = Floats


class Evaluation(NamedTuple):
    """What a problem says of one place."""

    gap: Array
    """(n,), zero on the branch."""
    by_u: Array
    """(n, n), its derivatives by the unknowns."""
    by_p: Array | None
    """(n,), its derivative by the parameter, of the same word; None where it was not requested."""
    maps: Array
    """(k, d, d); the Floquet multipliers are those of the product `maps[-1] @ ... @ maps[0]`."""
    word: Hashable
    """The sequence of events. The gap is smooth where the word does not change."""
    facts: object
    """What the problem wants to know of this motion later; the engine does not look at it."""
    margins: tuple[float, ...] = ()
    """Smooth values that fall to zero where the word changes, with one meaning for each place within a word.

    They are optional. With them a word that holds only between two neighbouring points is found as well.
    """
    size: float = 1.0
    """Of the motion, in the unit of the unknowns: of one that is smaller, facts are known to a part of it."""


Guess = tuple[Array, Array]
"""Unknowns, and a direction (n + 1,) of the unknowns and the parameter, of any length."""


def steps_in_p(first: float) -> tuple[float, ...]:
    """Steps in p by which a derivative is tried, to both sides: shorter ones where others meet another word."""
    shorter = 0.03 * first  # a choice
    return first, -first, shorter, -shorter


class Problem(Protocol):
    """What the engine calls. A class that inherits from it need only write `evaluate`."""

    chart: Any = None
    """Scaling, phase condition and the like by which `u` is to be read now. Charts are compared by identity."""

    def evaluate(self, u: Array, p: float, with_parameter: bool) -> Evaluation | str | None:
        """Evaluate a place. A string says why the motion cannot be computed there; None gives no reason."""

    def finer(self, factor: float) -> "list[Problem]":
        """The same motions, computed so many times more finely in one way each; none where they are exact."""
        return []

    def use(self, chart: Any) -> None:
        """Return to the chart of a point."""
        self.chart = chart

    def renew(self, point: "Point") -> Guess | None:
        """Change to a better chart where one is due, and say where the point lies in it. None: the chart stays."""
        return None

    def carry(self, point: "Point", chart: Any) -> Guess | None:
        """Say where the point lies in another chart. None: it cannot be said. The chart in use does not change."""
        return None

    def halved(self, point: "Point") -> Array | None:
        """By what half of its period moves a motion: by nothing where it is one of half the period, twice.

        None: the motion is not one that begins at a flip.
        """
        return None

    def border(self, before: Hashable, after: Hashable) -> str:
        """Name what happens between two words, for a reader."""
        return "sequence of events changes"

    def change(self, before: Hashable, after: Hashable) -> str:
        """Say what begins or ends between two words, for a reader; empty where that is not known."""
        return ""


class Doubled(Problem, Protocol):
    """The problem of motions of twice the period."""

    def double(self, point: "Point", vector: Array) -> Guess:
        """Write a motion of the single period as one of the doubled problem, and use its chart.

        The direction is the disturbance `vector` (d,) of the first map, which comes back with the opposite sign
        after one period; its last entry, for the parameter, is zero.
        """
        ...
