"""Follow a branch: predictor, corrector, length of stride, corners at borders, and why it ends."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from brakecli.analysis.branches.closing import LEAST_LOOP, SHARP, TURNED_BACK, closing, find_passed, turned_back
from brakecli.analysis.branches.corner import beyond_corner, led_on
from brakecli.analysis.branches.newton import FROM_AFAR, LEFT, OFF, Newton, Settings
from brakecli.analysis.branches.point import Branch, End, Point, Special
from brakecli.analysis.branches.problem import Array, Problem
from brakecli.analysis.branches.signs import GRID, ONE_PLACE, special_points

Until = Callable[[Point], str | None]
"""Called with each point; a reason ends the branch there."""
Stop = Callable[[], bool]
"""Called before each stride; True ends the branch with the points found so far."""

HALVED = End("halved", "it reaches the motion of half its period")
MET_ITSELF = End("met", "it reaches motions of its own again")
MET_ANOTHER = End("met", "it reaches motions of a branch that is followed")


@dataclass(frozen=True)
class Strides:
    """How long a stride becomes, by the turn and the change in the one before, over those that are aimed at."""

    straightest: float = 0.1  # part that counts at least, so that none is 0; `longest` bounds what follows from it
    longest: float = 2.0  # factor from one stride to the next, at most
    shortest: float = 0.3  # and at least, where it is not halved because Newton's method fails
    aim: float = 0.9  # part of the turn that is aimed at, so that few strides are repeated
    repeated: float = 2.0  # times the turn that is aimed at, from which on a stride is repeated
    aim_again: float = 0.8  # what is aimed at then
    at_border: float = 0.5  # the same of a stride that ends beyond a border, whose sharp turn is not seen
    fine: float = 30.0  # shortest strides below which one is repeated only for turns that are `repeated` as well
    failed: float = 0.5  # part of a stride with which one is repeated that has failed
    from_border: float = 0.25  # the same of one that a border has cut, so that few are taken up to it
    bent: float = 0.5  # rad, turn in a stride up to which a cubic predicts it
    foretold: float = 4.0  # lengths of the last stride, up to which it does so
    large: float = 0.2  # part of a large coefficient by which changes of it are counted


STRIDES = Strides()
MET = 1e-5
"""Length from the last point to the motion of half the period, at which a branch ends there; a choice."""
SHORT_OF_MEETING = 0.9
"""Part of the way to that motion that a stride takes, as it is guessed by a straight line; a choice."""
SAME_P = 1e-6
"""Change of p by a new chart, beyond which another motion was found."""
MEET = 1e-3
"""Part of the range: between two sheets a gap that is far narrower is none, and a branch point lies there."""
VERTICAL = 1e-9
"""Slope dp/ds below which a tangent is vertical."""


def _strays(off: Array, length: float) -> bool:
    """Whether a point so far off its guess has left the branch in a stride of this length."""
    return math.sqrt(off @ off) > LEFT * length + OFF


def follow(
    problem: Problem,
    first: Point,
    sign: float | None = 1.0,
    settings: Settings | None = None,
    until: Until | None = None,
    stop: Stop | None = None,
    known: Sequence[Point] = (),
) -> Branch:
    """Follow a branch from a first point, and locate its special points.

    It ends where it comes along `known` points, which are those of branches of the same problem.

    With sign 1 it is followed towards larger p, with -1 towards smaller p, and with None along the tangent of the
    first point. Where the first tangent is vertical, 1 means along it and -1 against it.
    """
    walk = _Walk(problem, settings or Settings(), until, stop, known)
    points, end = walk.follow(first if sign is None else _direct(first, sign))
    return _finish(walk, points, (End("start", "the branch was begun here"), end))


def both_ways(
    problem: Problem,
    first: Point,
    settings: Settings | None = None,
    until: Until | None = None,
    stop: Stop | None = None,
    known: Sequence[Point] = (),
) -> Branch:
    """Follow a branch from a point within it both ways, as one branch with s = 0 at that point."""
    walk = _Walk(problem, settings or Settings(), until, stop, known)
    points, end = walk.follow(_direct(first, 1.0))
    begin = end
    if end.kind != "closed":
        back, begin = walk.follow(_direct(first, -1.0), points[LEAST_LOOP:])
        points = [point.turned() for point in back[:0:-1]] + points
    return _finish(walk, points, (begin, end))


def _direct(first: Point, sign: float) -> Point:
    slope = first.tangent[-1]
    upward = slope > 0.0 or abs(slope) < VERTICAL
    return replace(first if upward == (sign > 0.0) else first.turned(), s=0.0)


def _finish(walk: "_Walk", points: list[Point], ended: tuple[End, End]) -> Branch:
    specials, unsearched = special_points(walk.newton, points, walk.over)
    for point, end in ((points[0], ended[0]), (points[-1], ended[1])):
        if end.kind != "start":
            error = 0.0 if end.kind in ("range", "closed", "met", "stopped") else walk.settings.shortest
            if end.kind == "halved":  # there one multiplier is 1
                specials = [
                    each
                    for each in specials
                    if each.kind not in ("fold", "branch point") or abs(each.s - point.s) >= ONE_PLACE
                ]
            specials.append(Special("end", point.p, error, point, point.s, end.reason))
    specials.sort(key=lambda special: special.s)
    aside = [new for _, new in walk.aside]
    return Branch(points, specials, ended, walk.newton.evaluations, unsearched, aside)


class _Walk:
    """The walk along one branch, with its budgets."""

    def __init__(
        self,
        problem: Problem,
        settings: Settings,
        until: Until | None,
        stop: Stop | None,
        known: Sequence[Point],
    ) -> None:
        self.problem = problem
        self.settings = settings
        self.until = until
        self.stop = stop
        self.known = known
        self.newton = Newton(problem, settings)
        self.deadline = perf_counter() + settings.seconds
        self.count = 0
        self.aside: list[tuple[Point, Point]] = []

    def over(self) -> End | None:
        """Why nothing more may be computed, if so."""
        if self.stop is not None and self.stop():
            return End("interrupted", "it was interrupted")
        if perf_counter() > self.deadline:
            return End("seconds", f"the budget of {self.settings.seconds:g} s is spent")
        return None

    def follow(self, first: Point, other_way: Sequence[Point] = ()) -> tuple[list[Point], End]:
        """The points in one direction, and why they end; `other_way` are those of the other direction, if any."""
        settings = self.settings
        points = [first]
        stride = self.settings.first
        self.problem.use(first.chart)
        if self._at_bound(first):
            return points, self._range_end(first.p)
        while True:
            if (end := self.over()) is not None:
                return points, end
            if self.count >= settings.points:
                return points, End("points", f"the budget of {settings.points} points is spent")
            here = points[-1]
            new = self._step(points, stride)
            if new is None:
                evaluation = self.newton.last
                beyond = evaluation is not None and evaluation.word != here.word
                before = stride
                stride = stride * (STRIDES.from_border if beyond else STRIDES.failed)
                # a corner is tried as soon as the border is near, and at last in any case
                if stride >= settings.shortest and not (beyond and stride < settings.border <= before):
                    continue
                new = beyond_corner(self.newton, here)
                if new is None:
                    if stride >= settings.shortest:
                        continue
                    return points, self._lost(here)
                stride = settings.border
            else:
                if (way := self._to_half(here, new)) is not None:
                    if way < MET:
                        return points, HALVED
                    stride = SHORT_OF_MEETING * way
                    continue
                shorter, longer = self._stride(here, new, stride)
                if shorter:
                    stride = shorter
                    continue
                stride = longer
            new = self._beyond_turn(here, new) or new
            if turned_back(points, new, settings.border):
                return points, TURNED_BACK
            points.append(new)
            self.count += 1
            if self.until is not None and (reason := self.until(new)):
                return points, End("stopped", reason)
            if self._at_bound(new):
                return points, self._range_end(new.p)
            if len(points) > LEAST_LOOP:
                last, end = closing(self.newton, first, here, new)
                if end is not None:
                    points[-1:] = [last] if last is not None else []
                    return points, end
                if self._passes([*other_way, *points[1:-LEAST_LOOP]], here, new):
                    return points, MET_ITSELF
                if self._passes(self.known, here, new):
                    return points, MET_ANOTHER
                self.problem.use(new.chart)
            if (renewed := self._renewed(new)) is not None:
                points.append(renewed)

    def _passes(self, points: Sequence[Point], here: Point, new: Point) -> bool:
        """Whether a stride leads over one of these points, either way."""
        for point in find_passed(points, here, new):
            self.problem.use(new.chart)
            crossing, end = closing(self.newton, point, here, new)
            if crossing is not None or end is not None:
                return True
        return False

    def _to_half(self, here: Point, new: Point) -> float | None:
        """How far ahead of a point the branch meets the motion of half the period; None if not in this stride.

        Beyond it the same motions follow once more, half of their period later.
        """
        if here.chart is not new.chart:
            return None
        one = self.problem.halved(here)
        other = self.problem.halved(new)
        if one is None or other is None or float(one @ other) >= 0.0:
            return None
        return (new.s - here.s) * float(one @ one) / float(one @ (one - other))

    def _range_end(self, p: float) -> End:
        return End("range", f"it reaches the {'lower' if p == self.settings.low else 'upper'} end of the range")

    def _at_bound(self, point: Point) -> bool:
        slope = point.tangent[-1]
        return (point.p == self.settings.high and slope > 0.0) or (point.p == self.settings.low and slope < 0.0)

    def _lost(self, here: Point) -> End:
        evaluation = self.newton.last
        crossed = evaluation is not None and evaluation.word != here.word
        where = (
            f" at a border: {self.problem.border(here.word, evaluation.word)}" if crossed and evaluation else ""
        )
        return End("lost", f"it is lost{where} ({self.newton.why})")

    def _step(self, points: list[Point], stride: float) -> Point | None:
        """One stride: the next point, or None where it must be shorter."""
        here = points[-1]
        newton = self.newton
        settings = self.settings
        guess = self._predicted(points, stride)
        p = guess[-1]
        if not settings.low <= p <= settings.high:
            return self._end_point(here, guess)
        new = newton.solve(guess, here.tangent, here.tangent, 0.0)
        if new is None:
            return None if newton.outside is None else self._end_point(here, newton.outside)
        if not settings.low <= new.p <= settings.high:
            return self._end_point(here, new.z)
        if _strays(new.z - guess, stride):
            newton.why = "Newton's method leaves the branch"
            return None
        self._placed(here, new)
        if new.word != here.word and not newton.holds(new):
            newton.why = "Newton's method ends on a border"
            return None
        if new.word != here.word and float(new.tangent @ here.tangent) < SHARP:
            # at a sharp corner the last tangent does not say which way the branch goes on
            return led_on(newton, here, new, stride) or new
        return new

    @staticmethod
    def _predicted(points: list[Point], stride: float) -> Array:
        """The place one stride ahead: on the tangent, or on the cubic through the last two points and tangents."""
        here = points[-1]
        if len(points) > 1:
            back = points[-2]
            way = here.s - back.s
            if way > 0.0 and back.chart is here.chart and back.word == here.word:
                bend = here.tangent - back.tangent  # the curvature, times the way
                if math.sqrt(bend @ bend) * stride < STRIDES.bent * way and stride < STRIDES.foretold * way:
                    x = stride / way
                    second = back.z - here.z + way * here.tangent
                    third = 2.0 * second - way * bend
                    return here.z + stride * here.tangent + x * x * (second + (x + 1.0) * third)
        return here.z + stride * here.tangent

    @staticmethod
    def _placed(here: Point, new: Point) -> Point:
        """Set s: the chord, made longer by the bend between its ends."""
        chord = new.z - here.z
        cosine = min(max(float(here.tangent @ new.tangent), -1.0), 1.0)
        new.s = here.s + math.sqrt(chord @ chord) * (1.0 + (1.0 - cosine) / 12.0)
        return new

    def _end_point(self, here: Point, beyond: Array) -> Point | None:
        """The point at the bound of the range, on the way to a place beyond it; None where it is elsewhere."""
        bound = self.settings.high if beyond[-1] > here.z[-1] else self.settings.low
        fraction = (bound - here.z[-1]) / (beyond[-1] - here.z[-1])
        if not 0.0 < fraction <= 1.0:
            return None
        guess = here.z + fraction * (beyond - here.z)
        new = self.newton.at_parameter(guess, bound, here.tangent, 0.0, exact=True)
        if new is None or not self._at_bound(new):
            return None
        chord = new.z - here.z
        if _strays(new.z - guess, math.sqrt(chord @ chord)) or not float(chord @ here.tangent) > 0.0:
            return None
        return self._placed(here, new)

    def _beyond_turn(self, here: Point, new: Point) -> Point | None:
        """The end point where the branch leaves the range, and turns outside of it, between two points inside."""
        if here.tangent[-1] * new.tangent[-1] >= 0.0 or here.word != new.word:
            return None
        t = GRID
        rise = new.p - here.p
        way = new.s - here.s
        cubic = here.p + (3.0 * t**2 - 2.0 * t**3) * rise
        cubic += t * (1.0 - t) * way * ((1.0 - t) * here.tangent[-1] - t * new.tangent[-1])
        outside = np.flatnonzero((cubic > self.settings.high) | (cubic < self.settings.low))
        if not len(outside):
            return None
        fraction = t[outside[0]]
        guess = here.z + fraction * (new.z - here.z)
        guess[-1] = cubic[outside[0]]
        return self._end_point(here, guess)

    def _stride(self, here: Point, new: Point, stride: float) -> tuple[float, float]:
        """A shorter stride with which this one must be repeated, or 0; and the length of the next one."""
        settings = self.settings
        cosine = min(max(float(here.tangent @ new.tangent), -1.0), 1.0)
        angle = math.acos(cosine) / settings.turn
        # Very large coefficients belong to a motion that stays unstable whatever they do.
        change = max(
            abs(a - b) / max(1.0, STRIDES.large * min(abs(a), abs(b)))
            for a, b in zip(here.coefficients, new.coefficients, strict=True)
        )
        ratio = max(angle, change / settings.change, STRIDES.straightest)
        if here.word == new.word:
            if here.orientation[0] * new.orientation[0] < 0.0 and abs(new.p - here.p) > MEET:
                # A branch point lies in between, or a gap to another sheet: one that is narrower counts as none.
                if not self.aside or self.aside[-1][0] is not here:
                    self.aside.append((here, new))
                return STRIDES.shortest * stride, 0.0
            long = stride > STRIDES.fine * settings.shortest
            repeated = STRIDES.repeated
            if ratio > repeated and (long or angle > repeated):
                return max(STRIDES.shortest, STRIDES.aim_again / ratio) * stride, 0.0
        elif stride > settings.border and ratio > STRIDES.at_border:
            return STRIDES.shortest * stride, 0.0
        factor = min(STRIDES.longest, max(STRIDES.shortest, STRIDES.aim / ratio))
        return 0.0, min(settings.longest, stride * factor)

    def _renewed(self, point: Point) -> Point | None:
        """The point in a new chart, where the problem wants one and the motion is found in it."""
        guess = self.problem.renew(point)
        if guess is None:
            return None
        u, direction = guess
        onward = direction / math.sqrt(direction @ direction)
        new = self.newton.solve(np.append(u, point.p), onward, onward, point.s, exact=True, most=FROM_AFAR)
        if new is None or abs(new.p - point.p) > SAME_P:
            self.problem.use(point.chart)
            return None
        return new
