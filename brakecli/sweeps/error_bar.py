"""The error bar of a critical value: what the measured growth leaves open."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import takewhile

import numpy as np

from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.analysis.stability.search import bisect
from brakecli.solver.period import common_period
from brakecli.sweeps.floquet import Disturbances
from brakecli.sweeps.periodic import Orbit, Segments, exponents, orbit
from brakecli.sweeps.tables import Critical
from brakecli.sweeps.windows import FOLD

OTHERS = ((2.0, 2.0, 1.5), (2.0, 1.0, 3.0), (0.5, -0.5, 1.5))
"""Divisors of the step, which also multiply the nodes; which part of the change of growth counts as its error; and
how much of the way to where growth passes zero then. With half the step growth changes by a half of its error or
more, and so does the critical value, which counts where growth begins like a root. With twice the step it changes
by all of its error or more: at least half of that counts, as patches that open make errors fall unevenly."""
BEYOND = 1.2  # times the way to where growth with other steps passes zero, if it is as steep as further away
NARROW = 1.1  # ratio of the ends of the bracket of that way
STEEPER, JUMP = 10.0, 0.5  # times the slope around; of the change in a bracket, in a 32nd of it: a fold
APPROACH = 4  # values before the one that counts, from which the motion with another step is followed
ROUNDED = 20.0  # times the spread of growth that rounding makes in a three-layer scheme near self-locking


def left_open(
    at: Disturbances,
    bracket: tuple[float, float],
    wide: tuple[float, float],
    bias: float | None,
    critical: Critical,
) -> float:
    """By how much the change in a bracket may be wrong: the error of the growth over its slope, and the bias.

    The error of a periodic motion holds that of its scheme. A three-layer scheme takes velocities from differences
    of positions: near self-locking, where the force grows beyond all bounds, their rounding makes the growth jump,
    so that the slope counts only as far as the ends of the bracket that was found first show it. Where a motion
    ends in a fold, growth jumps, and the bar holds that bracket. Where the `bias` is not known, the bar of a
    linear motion reaches to where the eigenvalues change.
    """
    known, (low, high) = {value: each for value, each in at.known.items() if each is not None}, bracket
    near = sorted(known, key=lambda value: max(low - value, value - high, 0.0))[:2]
    one, other = near[0], near[-1]
    exact = known[one].exact and known[other].exact
    finers: dict[float, dict[float, Orbit]] = {}

    @cache
    def rate(place: float, finer: float) -> float:
        if (measured := at.at(place)) is None or place not in at.orbits:
            return math.nan
        if finer == 1.0:
            return measured.rate - measured.noise
        others = finers.setdefault(finer, {})
        for each in (place,) if others else (*_before(at, one), place):
            others[each] = _finer(at, each, finer, others)
        return others[place].rate - measured.noise

    def slope(other: float) -> float:
        return abs((known[other].rate - known[one].rate) / (other - one)) if other != one else 0.0

    found = at.sliding_at(one)
    if bias is None and found and not (found.forced or exact or known[one].noise):
        bias = _to_eigenvalues(at, low, high, critical)
    bias = 0.0 if exact else abs(bias or 0.0)
    if known[one].bar:  # the bracket holds it
        return bias
    far = max((slope(end) for end in wide if end in known), default=0.0)
    if one in at.orbits and not exact:
        if at.parts(low, high) or _ends(at, low, high, far):
            return max(low - wide[0], wide[1] - high, FOLD * (critical.upper - critical.lower))
        stride = high - low if at.unstable(high) else low - high

        def peak(side: float) -> float:
            """How far it is to the most growth, or decay, before stability changes again."""
            values = [value for value in known if (value - low) * side > 0.0 and (value - high) * side >= 0.0]
            values.sort(key=lambda value: abs(value - one))
            same = takewhile(lambda value: known[value].unstable is known[values[0]].unstable, values)
            return max(((abs(known[value].rate), abs(value - one)) for value in same), default=(0.0, 0.0))[1]

        return max(_shifted(rate, one, stride, critical, far, peak, other) for other in OTHERS)
    if known[one].noise:
        rounded = ROUNDED if found and found.system.scheme.LAG and not exact else 1.0
        hidden = rounded * max(known[one].spread, known[other].spread)
        return bias + _reach(at, low, high, 2.0 * known[one].noise + hidden)
    steep = slope(other)
    if found is not None and found.system.scheme.LAG and far > 0.0 and not exact:
        steep = min(steep, far)
    return bias + (max(known[one].spread, known[other].spread) / steep if steep > 0.0 else 0.0)


def _ends(at: Disturbances, low: float, high: float, steep: float) -> bool:
    """Whether a motion ends in a bracket: growth changes far more than it is `steep` outside, and in a part of it.

    Where growth crosses zero, even if it begins like a root, it changes less in a narrower bracket.
    """

    def change(low: float, high: float) -> float:
        ends = [measured.rate for measured in (at.at(low), at.at(high)) if measured]
        return abs(ends[0] - ends[-1])

    whole, below = change(low, high), at.unstable(low)
    if whole <= STEEPER * steep * (high - low):
        return False
    return change(*bisect(lambda value: at.unstable(value) is below, low, high, halvings=5)) > JUMP * whole


def _to_eigenvalues(at: Disturbances, low: float, high: float, critical: Critical) -> float:
    """How far from a bracket the eigenvalues change, or up to twice that; infinite if not within the range."""

    def grows(value: float) -> bool:
        found = at.sliding_at(value)
        return found is None or eigenvalue_growth(found.system.coefficients, found.stiffness, found.grip) > 0.0

    above = at.unstable(high) is True
    if grows(low) is not above and grows(high) is above:
        return 0.0
    down = grows(low) is above
    start, stride = (low, -critical.tolerance) if down else (high, critical.tolerance)
    place = start
    while (grows(place) is above) is down:
        place, stride = place + stride, 2.0 * stride
        if not critical.lower <= place <= critical.upper:
            return math.inf
    return abs(place - start)


def _reach(at: Disturbances, low: float, high: float, level: float) -> float:
    """How far from a bracket growth passes a level that its error may hide, or steady sliding ends.

    Without dashpots nothing decays, and growth begins like a root.
    """
    values, growing = sorted(at.known), bool(at.unstable(high))
    side = [value for value in values if value >= high] if growing else [v for v in values if v <= low][::-1]
    beyond = (value for value in side if (measured := at.known[value]) is None or measured.rate >= level)
    return abs(next(beyond, math.inf) - side[0])


def _shifted(
    rate: Callable[[float, float], float],
    value: float,
    stride: float,
    critical: Critical,
    steep: float,
    peak: Callable[[float], float],
    other: tuple[float, float, float],
) -> float:
    """How far from a value growth with another step begins: growing strides, then bisection.

    `rate`: the growth at a value with the step divided. The given stride leads to more growth; the first one
    crosses where growth is as `steep` as given, and is not beyond the `peak` on its side.
    """
    (finer, part, times), side = other, 1.0

    def excess(way: float) -> float:
        own = rate(value + side * way, 1.0)
        return own + part * (rate(value + side * way, finer) - own)

    if not math.isfinite(here := excess(0.0)):
        return math.inf
    side = math.copysign(1.0, -stride * here)
    bound = critical.upper - value if side > 0.0 else value - critical.lower
    way = min(max(abs(stride), min(BEYOND * abs(here) / steep if steep else 0.0, peak(side))), bound)
    while (there := excess(way)) * here > 0.0 and way < bound:
        way = min(3.0 * way, bound)
    if math.isinf(there):
        return math.inf
    if there * here < 0.0:

        def as_here(way: float) -> bool | None:
            return None if math.isnan(there := excess(way)) else there * here > 0.0

        way = bisect(as_here, 0.0, way, width=0.1 * abs(stride), ratio=NARROW)[1]
    return times * way


def _before(at: Disturbances, value: float) -> list[float]:
    """Values on the way to one, from further off to nearer, at which its motion is stable."""
    own = [place for place in at.orbits if at.branches.get(place) == at.branches.get(value)]
    found, reach = list[float](), 0.0
    for place in sorted(own, key=lambda place: abs(place - value)):
        if at.orbits[place].rate < 0.0 and abs(place - value) >= reach and len(found) < APPROACH:
            found, reach = [place, *found], 4.0 * abs(place - value)
    return found


def _finer(at: Disturbances, value: float, finer: float, others: dict[float, Orbit]) -> Orbit:
    """The periodic motion at a value with the step divided and the nodes multiplied.

    It differs from the known one as the nearest of the `others` does, if there is one.
    """
    found, near = at.sliding_at(value), at.orbits[value]
    period = common_period(found.system) if found else None
    if found is None or period is None:
        return replace(near, exponents=np.full(4, np.nan + 0j))
    segments = Segments(found, period, len(near.states), finer)
    states = segments.moved(near)
    if others:
        beside = min(others, key=lambda other: abs(other - value))
        moved = states + segments.moved(others[beside]) - segments.moved(at.orbits[beside])
        if (forced := orbit(segments, moved, others[beside].maps)) is not None:
            return forced
    if (forced := orbit(segments, states, near.maps)) is not None:
        return forced
    maps = segments.maps(states, segments.ends(states)[0])
    return Orbit(segments, states, maps, exponents(maps), near.size)
