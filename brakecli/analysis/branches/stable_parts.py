"""The stable parts of branches: where each begins and ends, how certain that is, and what they cover together."""

from itertools import groupby, pairwise
from typing import NamedTuple

from brakecli.analysis.branches.bar import Bound, locate
from brakecli.analysis.branches.newton import Newton, Settings
from brakecli.analysis.branches.rows import Followed

NARROWEST = 1e-6
"""Part of the range below which an interval is that of rounding."""
Span = tuple[float, float]
"""Two places of the line, the lower one first."""
CUT = {"lost", "met", "points", "seconds", "interrupted", "start"}
"""Ends of a branch beyond which the motion goes on; where it has met followed ones, as these."""


class Part(NamedTuple):
    """A stable part of one or more branches, and its frequency (Hz) at the lower end."""

    low: Bound
    high: Bound
    frequency: float


def stable_parts(followed: Followed) -> list[Part]:
    """The stable parts of a branch, each up to the special point behind its last motion."""
    parts = list[Part]()
    branch = followed.branch
    points = branch.points if branch else []
    for stable, group in groupby(range(len(points)), lambda k: points[k].stable):
        if not stable:
            continue
        places = [*group]
        ends = [_bound(followed, places[0], -1), _bound(followed, places[-1], 1)]
        motions = [points[k] for k in places]
        low, high = (
            min([*ends, *_turns(followed, places, way)], key=lambda bound: way * bound.p) for way in (1, -1)
        )
        at_low = [special.point for special in branch.specials if special.p == low.p] if branch else []
        lowest = at_low[0] if at_low else min(motions, key=lambda point: point.p)
        parts.append(Part(low, high, lowest.facts.frequency))
    return parts


def unstable_spans(followed: Followed) -> list[Span]:
    """Where a branch is not stable, from one end along it to the next, up to what bounds its stable parts.

    The vibration at flutter is neutral, as sliding is: alone it is no span.
    """
    branch = followed.branch
    points = branch.points if branch else []
    neutral = [mark.motion.amplitude for mark in followed.special if mark.kind == "flutter"]
    spans = list[Span]()
    for stable, group in groupby(range(len(points)), lambda k: points[k].stable):
        places = [*group]
        first = places[0]
        last = places[-1]
        if stable or (first == last in (0, len(points) - 1) and points[first].facts.amplitude in neutral):
            continue
        at = [points[k].p for k in places]
        at += [_bound(followed, first - 1, 1).p] if first else []
        at += [_bound(followed, last + 1, -1).p] if last + 1 < len(points) else []
        turns = [special for special in branch.specials if special.kind == "fold"] if branch else []
        at += [fold.p for fold in turns if points[first].s < fold.s < points[last].s]
        if max(at) > min(at) + NARROWEST:
            spans.append((min(at), max(at)))
    return spans


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
    assert problem is not None
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
            p = locate(Newton(problem, Settings()), *pair)
        return Bound(p, 0.0, point, beyond, problem)
    special = min(between, key=lambda special: abs(special.s - point.s))
    return Bound(special.p, special.error, point, beyond, problem)


def separate(bounds: list[Bound]) -> list[Bound]:
    """The bounds in order, with their bars, without pairs that are closer than both their bars.

    An interval that is so narrow may be none; so may what lies between two.
    """
    bounds = [bound._replace(error=bound.bar, inner=None) for bound in bounds]
    for k, (one, other) in enumerate(pairwise(bounds)):
        bars = one.error, other.error
        if one.known and other.known and other.p - one.p < min(bars):
            return separate([*bounds[:k], *bounds[k + 2 :]])
    return bounds


def merge(spans: list[Span]) -> list[Span]:
    """The union of spans, in order."""
    return [(piece.low.p, piece.high.p) for piece in unite([Part(Bound(a), Bound(b), 0.0) for a, b in spans])]


def unite(parts: list[Part]) -> list[Part]:
    """The union of parts, in order."""
    union = list[Part]()
    for piece in sorted(parts, key=lambda piece: piece.low.p):
        if union and piece.low.p <= union[-1].high.p + NARROWEST:
            if piece.high.p > union[-1].high.p:
                union[-1] = union[-1]._replace(high=piece.high)
        else:
            union.append(piece)
    return union
