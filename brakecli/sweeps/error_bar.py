"""The error bar of a critical value: what the measured growth leaves open."""

import math
from dataclasses import replace

from brakecli.analysis.stability.modes import growth as eigenvalue_growth
from brakecli.sweeps.floquet import Disturbances
from brakecli.sweeps.periodic import Orbit, Segments, common_period, log_radius, orbit
from brakecli.sweeps.tables import Critical

STEPS = {2.0: 2.0, 0.5: -0.5}
"""Divisors of the step, which also multiply the nodes, and the error in changes of the growth: with half the step
it changes by a half of its error or more, with twice the step by all of it or more; at least half of that counts,
as patches that open make errors fall unevenly."""
WIDER = 1.5  # times the shift that these show
STRIDES = 7  # towards the place where growth with other steps passes zero
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
    so that the slope counts only as far as the ends of the bracket that was found first show it. Where
    the `bias` is not known, the bar of a linear motion reaches to where the eigenvalues change.
    """
    known, (low, high) = {value: each for value, each in at.known.items() if each is not None}, bracket
    near = sorted(known, key=lambda value: max(low - value, value - high, 0.0))[:2]
    one, other = near[0], near[-1]

    def slope(other: float) -> float:
        return abs((known[other].rate - known[one].rate) / (other - one)) if other != one else 0.0

    found = at.sliding_at(one)
    if bias is None and found and not found.forced and not known[one].noise:
        bias = _to_eigenvalues(at, low, high, critical)
    bias = abs(bias or 0.0)
    if known[one].bar:  # the bracket holds it
        return bias
    if one in at.orbits:
        stride = high - low if at.unstable(high) else low - high
        return WIDER * max(_shifted(at, one, stride, critical, *step) for step in STEPS.items())
    if known[one].noise:
        rounded = ROUNDED if found and found.system.scheme.LAG else 1.0
        hidden = rounded * max(known[one].spread, known[other].spread)
        return bias + _reach(at, low, high, 2.0 * known[one].noise + hidden)
    steep = slope(other)
    far = max((slope(end) for end in wide if end in known), default=0.0)
    if found is not None and found.system.scheme.LAG and far > 0.0:
        steep = min(steep, far)
    return bias + (max(known[one].spread, known[other].spread) / steep if steep > 0.0 else 0.0)


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


def error(at: Disturbances, value: float) -> float:
    """By how much the step may falsify the growth (1/s) of a periodic motion."""
    coarse = at.orbits[value]
    return max(abs(part * (_finer(at, value, coarse, finer).rate - coarse.rate)) for finer, part in STEPS.items())


def _shifted(
    at: Disturbances, value: float, stride: float, critical: Critical, finer: float, part: float
) -> float:
    """How far from a value growth less its error begins: growing strides, and a straight line within the last.

    The given stride leads to more growth. Without dashpots growth begins like a root, and the longer way counts.
    """
    near, place, excess = at.orbits[value], value, math.nan
    for count in range(STRIDES):
        before, last = excess, place
        place = min(max(place + (stride if count else 0.0), critical.lower), critical.upper)
        if (measured := at.at(place)) is None:
            break
        near = _finer(at, place, near, finer)
        excess = measured.rate - measured.noise + part * (near.rate - measured.rate)
        if not math.isfinite(excess):
            return math.inf
        if before * excess <= 0.0 and before != excess:
            straight = 0.0 if measured.noise else (place - last) * excess / (before - excess)
            return abs(place + straight - value)
        stride = 3.0 * stride if count else math.copysign(stride, -stride * excess)
    return abs(place - value)


def _finer(at: Disturbances, value: float, near: Orbit, finer: float) -> Orbit:
    """The periodic motion at a value near another one, with the step divided and the nodes multiplied."""
    found = at.sliding_at(value)
    period = common_period(found.system) if found else None
    if found is None or period is None:
        return replace(near, rate=math.nan)
    segments = Segments(found, period, len(near.states), finer)
    states = segments.moved(near)
    if (forced := orbit(segments, states, near.maps)) is not None:
        return forced
    maps = segments.maps(states, segments.ends(states))
    return Orbit(segments, states, maps, log_radius(maps) / period, near.size)
