"""The stable parts of branches: where each begins and ends, how certain that is, and what they cover together."""

from itertools import groupby, pairwise
from typing import NamedTuple

from brakecli.analysis.branches.bar import Bound, located
from brakecli.analysis.branches.newton import Newton, Settings
from brakecli.analysis.branches.told import Followed

NARROWEST = 1e-6
"""Part of the range below which an interval is that of rounding."""
Span = tuple[float, float]
"""Two places of the line, the lower one first."""
CUT = {"lost", "points", "seconds", "interrupted", "start"}
"""Ends of a branch beyond which the motion goes on, unknown."""


class Part(NamedTuple):
    """A stable part of one or more branches, and its frequency (Hz) at the lower end."""

    low: Bound
    high: Bound
    frequency: float


def stable_parts(followed: Followed) -> list[Part]:
    """The stable parts of a branch, each up to the special point behind its last motion."""
    found = list[Part]()
    branch = followed.branch
    points = branch.points if branch else []
    for stable, group in groupby(range(len(points)), lambda k: points[k].stable):
        if not stable:
            continue
        places = [*group]
        ends = [_bound(followed, places[0], -1), _bound(followed, places[-1], 1)]
        part = [points[k] for k in places]
        low, high = (
            min([*ends, *_turns(followed, places, way)], key=lambda bound: way * bound.p) for way in (1, -1)
        )
        special = [each.point for each in branch.specials if each.p == low.p] if branch else []
        lowest = special[0] if special else min(part, key=lambda point: point.p)
        found.append(Part(low, high, lowest.facts.frequency))
    return found


def _turns(followed: Followed, places: list[int], way: int) -> list[Bound]:
    """The inner point of a stable part that lies furthest in p, where one does: folds that rounding makes.

    Finer steps make other ones. What they move is seen at the nearest motion that is not stable.
    """
    points = followed.branch.points if followed.branch else []
    furthest = min(places, key=lambda k: way * points[k].p)
    if furthest in (places[0], places[-1]):
        return []
    inner = points[furthest]
    others = [k for k, point in enumerate(points) if not point.stable and point.chart is inner.chart]
    beyond = points[min(others, key=lambda k: abs(k - furthest))] if others else None
    return [Bound(inner.p, abs(points[furthest - 1].p - inner.p), inner, beyond, followed.problem)]


def _bound(followed: Followed, k: int, way: int) -> Bound:
    """Where the stable part ends whose last point that way is the one at k."""
    branch = followed.branch
    problem = followed.problem
    assert branch is not None
    point = branch.points[k]
    if not 0 <= k + way < len(branch.points):
        return Bound(point.p, known=branch.ended[1 if way > 0 else 0].kind not in CUT)
    beyond = branch.points[k + way]
    between = [
        special
        for special in branch.specials
        if special.kind != "end" and 0.0 <= way * (special.s - point.s) <= way * (beyond.s - point.s)
    ]
    if not between:
        p = 0.5 * (point.p + beyond.p)
        if point.chart is beyond.chart:
            problem.use(point.chart)
            pair = (point, beyond) if way > 0 else (beyond, point)
            p = located(Newton(problem, Settings()), *pair)
        return Bound(p, 0.0, point, beyond, problem)
    special = min(between, key=lambda each: abs(each.s - point.s))
    return Bound(special.p, special.error, point, beyond, problem)


def told_apart(bounds: list[Bound]) -> list[Bound]:
    """The bounds in order, with their bars, without pairs that are closer than both their bars.

    An interval that is so narrow may be none; so may what lies between two.
    """
    bounds = [bound._replace(error=bound.bar, inner=None) for bound in bounds]
    for k, (one, other) in enumerate(pairwise(bounds)):
        bars = one.error, other.error
        if one.known and other.known and other.p - one.p < min(bars):
            return told_apart([*bounds[:k], *bounds[k + 2 :]])
    return bounds


def merged(spans: list[Span]) -> list[Span]:
    """The union of spans, in order."""
    return [(part.low.p, part.high.p) for part in united([Part(Bound(a), Bound(b), 0.0) for a, b in spans])]


def united(parts: list[Part]) -> list[Part]:
    """The union of parts, in order."""
    found = list[Part]()
    for part in sorted(parts, key=lambda part: part.low.p):
        if found and part.low.p <= found[-1].high.p + NARROWEST:
            if part.high.p > found[-1].high.p:
                found[-1] = found[-1]._replace(high=part.high)
        else:
            found.append(part)
    return found
