"""Growth of small disturbances along a parameter, where a rough wheel forces a motion on the shoe.

The motion is stable while all its multipliers lie inside the unit circle; `periodic` finds both.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from brakecli.analysis.stability.modes import is_undamped
from brakecli.solver.links import natural_frequencies
from brakecli.solver.period import LONGEST, common_period
from brakecli.sweeps.growth import DEPARTED, Growth, Sliding, growth
from brakecli.sweeps.periodic import (
    Orbit,
    Segments,
    lyapunov,
    orbit,
)

SEGMENT = 10.0  # periods of the slowest motion
MOST_SEGMENTS = 250
# Damping ratio, of the slowest motion, that would stop a growth which counts as none without dashpots
NEUTRAL = 1e-5
SHORTEST, FINEST = 16, 256  # parts of the way from a known motion to the next that are tried; with dashpots
LARGEST_PART, LEAST_PART = 0.25, 0.015  # of the waves' amplitudes that is added at once to a motion
RELAXED = 100.0  # periods of the slowest motion after which a stable motion has come near its orbit
CLOSE = 0.05  # of the size of a motion: how far its neighbour may be from where it is looked for
MISSED = 3  # searches for a motion that grows out of steady sliding that may fail
RESUMED = 8  # motions that may be found to go on beyond where they seemed to end


class Disturbances:
    """Growth of small disturbances along a parameter; a periodic motion is followed from its neighbour's."""

    def __init__(self, sliding_at: Callable[[float], Sliding | None]) -> None:
        """Begin without any value."""
        self.sliding_at = sliding_at
        self.known: dict[float, Growth | None] = {}
        self.orbits: dict[float, Orbit] = {}
        self.branches: dict[float, float] = {}  # by where the motion was found first, with dashpots
        self.missed, self.resumed, self.periodic, self.least = 0, 0, False, 0.0

    def at(self, value: float) -> Growth | None:
        """The growth at a value; None without steady sliding, and where no forced motion is found."""
        if value not in self.known:
            found = self.sliding_at(value)
            self.known[value] = None if found is None else self._measured(value, found)
        return self.known[value]

    def unstable(self, value: float) -> bool | None:
        """Whether disturbances grow or steady sliding has ended; None where no forced motion is known."""
        measured = self.at(value)
        return measured.unstable if measured else True if self.sliding_at(value) is None else None

    @property
    def motions(self) -> list[list[float]]:
        """The values at which each motion was found, in order."""
        found: dict[float, list[float]] = {}
        for value, branch in sorted(self.branches.items()):
            found.setdefault(branch, []).append(value)
        return [*found.values()]

    def scan(self, values: list[float]) -> None:
        """Measure in order, and where no periodic motion was found, look again from the ones above."""
        lost = [value for value in values if self.at(value) is None]
        for value in reversed(lost):
            if max(self.orbits, default=value) > value:
                del self.known[value]
                self.at(value)

    def jumps(self, low: float, high: float) -> bool:
        """Whether the motions at two values are not known to be one; without dashpots that does not count."""
        ends = [self.branches[value] for value in (low, high) if value in self.branches]
        return len(ends) == 2 and ends[0] != ends[1]

    def parts(self, low: float, high: float) -> bool:
        """Whether motions at two near values are two, also without dashpots."""
        ends = [self.orbits[value] for value in (low, high) if value in self.orbits and value not in self.branches]
        return self.jumps(low, high) or (len(ends) == 2 and not _same(*ends))

    def goes_on(self, low: float, high: float, wide: tuple[float, float]) -> bool:
        """Whether a stable motion goes on over a bracket in which it seemed to end; follow it on from there.

        A follow may fail for its stride only.
        """
        before, beyond, end = (low, high, wide[1]) if self.unstable(low) is False else (high, low, wide[0])
        if self.resumed == RESUMED or not self.jumps(low, high) or not self._goes_on(before, beyond, False):
            return False
        self.resumed += 1
        if beyond != end:
            self._goes_on(beyond, end, False)
        return True

    def go_on(self, values: list[float]) -> None:
        """Follow stable motions on where another one was found beyond: from the end that is stable.

        On the way back they are followed only where that other one is unstable.
        """
        up = 1 if self.unstable(values[0]) is False else -1
        for order, back in ((values[::up], False), (values[::-up], True)):
            before = order[0]
            for value in order[1:]:
                if self._goes_on(before, value, back) or value in self.branches:
                    before = value

    def _goes_on(self, before: float, value: float, back: bool) -> bool:
        """Follow a motion to another value that has none, or another one; an unstable one beside unstable ones."""
        known, other, found = self.known[before], self.known[value], self.sliding_at(value)
        period, jumps = common_period(found.system) if found else None, self.jumps(before, value)
        on = jumps and bool(other and other.unstable)
        if before not in self.branches or not (known and found and period) or (known.unstable and not on):
            return False
        if other and not other.unstable and (back or not jumps):
            return False
        forced = self._followed(value, found, period, before)
        if forced is None or (other and forced.rate > 0.0 and (back or not jumps)):
            return False
        was, now = self.branches.get(value), self.branches[before]
        if was is not None and _same(forced, self.orbits[value]):
            self.branches = {at: now if each == was else each for at, each in self.branches.items()}
        self.orbits[value], self.known[value] = forced, Growth(forced.rate, 0.0, 0.0, opened=True)
        self.branches[value] = now
        return True

    def _measured(self, value: float, found: Sliding) -> Growth | None:
        damped = not is_undamped(found.system.coefficients)
        slow, fast = natural_frequencies(found.system.coefficients, found.stiffness)
        period, level = common_period(found.system), NEUTRAL * 2.0 * math.pi * (slow or fast)
        noise, exact = 0.0 if damped else level, None
        if found.linear:
            theory = found.linear.with_slopes()  # it leaves much open with many waves
            if theory.known_to < max(level, abs(theory.mode.growth - noise)):
                exact = Growth(theory.mode.growth, theory.known_to, noise, exact=True)
        if not (self.periodic or found.forced):
            return exact or growth(found)
        if period is None:
            plain = None if exact or found.modulated else growth(found)
            return exact or (plain if plain and not plain.opened else lyapunov(found, plain))
        forced, full = self._found(value, found, period, damped)
        if forced is not None:
            self.orbits[value] = forced
        if exact and (full or forced is None or not damped):
            return exact
        return Growth(forced.rate, 0.0, noise, opened=True) if forced else None

    def _found(self, value: float, found: Sliding, period: float, damped: bool) -> tuple[Orbit | None, bool]:
        """The periodic motion at a value, and whether it is the one of linear theory.

        That one counts wherever it lasts, unless dashpots make a stable one beside it that is followed.
        """
        place, near = self._near(value)
        low, high = sorted((place, value))
        gap = any(lost is None and low < other < high for other, lost in self.known.items())
        own = self._in_full_contact(value, found, period) if found.linear or not damped else None
        forced = own if own and near and _same(own, near) else None
        if forced is None and not gap and (damped or own is None):
            forced = self._followed(value, found, period)
        followed = forced is not None
        if own and (forced is None or forced.rate >= 0.0 or _same(own, forced)):
            forced, followed = own, followed and forced is not None and _same(own, forced)
        if forced is None and damped:
            plain = growth(found) if near is not None and near.rate > 0.0 else None
            if plain is None or plain.rate <= 0.0:
                forced = self._waited(value, found, period)
        if forced is None and self.missed < MISSED:
            forced = self._grown(value, found, period)
            self.missed += forced is None
        if forced and damped:
            place, near = (place, near) if followed else self._near(value)
            goes_on = followed or (near is not None and _same(forced, near))
            self.branches[value] = self.branches.get(place, value) if goes_on else value
        return forced, forced is own

    def _in_full_contact(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """The periodic motion beside that of linear theory; None where the pad lifts off or sticks too much."""
        segments, (_, near) = self._segments(value, found, period), self._near(value)
        count = len(segments.systems)
        expected = found.in_full_contact(np.arange(count) * period / count) / segments.scales
        forced = orbit(segments, expected, near.maps if near else None)
        close = forced is not None and np.abs(forced.states - expected).max() <= CLOSE * forced.size
        return forced if close else None

    def _near(self, value: float) -> tuple[float, Orbit | None]:
        """The motion to follow to a value: the nearest, unless a single one is known on both sides of the value
        and stable on one side.

        Of a stable place and an unstable one beside the value the stable one counts: the motion may go on.
        """
        ends = [each for own in self.motions if math.isfinite(sum(each := _around(value, own)))]
        stable = [each for each in ends if min(self.orbits[at].rate for at in each) < 0.0]
        below, above = stable[0] if len(stable) == 1 else _around(value, self.orbits)
        near = below if value - below <= above - value else above
        if below in self.branches and above in self.branches:
            one, other = sorted((below, above), key=lambda at: self.orbits[at].rate)
            near = one if self.orbits[one].rate < 0.0 < self.orbits[other].rate else near
        return near, self.orbits.get(near)

    def _segments(self, value: float, found: Sliding, period: float) -> Segments:
        _, near = self._near(value)
        slow = natural_frequencies(found.system.coefficients, found.stiffness)[0]
        count = min(max(1, math.ceil(period * slow / SEGMENT)), MOST_SEGMENTS)
        return Segments(found, period, len(near.states) if near else count)

    def _followed(self, value: float, found: Sliding, period: float, start: float | None = None) -> Orbit | None:
        """The periodic motion from one that is known (the nearest one), on the way in strides; from steady sliding
        where none is known.
        """
        place, near = self._near(value) if start is None else (start, self.orbits[start])
        if near is None:
            segments = self._segments(value, found, period)
            return orbit(segments, np.tile(segments.rest, (len(segments.systems), 1)), None)
        stride, shortest = value - place, abs(value - place) / (FINEST if place in self.branches else SHORTEST)
        while abs(stride) >= shortest:
            aim = value if abs(value - place) <= abs(stride) else place + stride
            at = found if aim == value else self.sliding_at(aim)
            length = common_period(at.system) if at else None
            forced = self._beside(aim, at, length, place) if at and length else None
            if forced is None:
                stride *= 0.5
            elif aim == value:
                return forced
            else:
                if place in self.branches:
                    self.branches[aim] = self.branches[place]
                self.orbits[aim], place = forced, aim
        return None

    def _beside(self, value: float, found: Sliding, period: float, place: float) -> Orbit | None:
        """The periodic motion that continues the line through one and its neighbour, or is near that one.

        Without dashpots no motion leads through a resonance: there any motion will do. An unstable one that grows
        at once is left for a vibration that keeps in step with the waves.
        """
        near, segments, branch = self.orbits[place], self._segments(value, found, period), self.branches.get(place)
        own = [at for at in self.orbits if at != place and self.branches.get(at) == branch]
        other = min(own, key=lambda other: abs(other - (value if branch is None else place)), default=place)
        guesses = [segments.moved(near)]
        if abs(value - place) <= 2.0 * abs(place - other):
            along = guesses[0] - segments.moved(self.orbits[other])
            guesses.insert(0, guesses[0] + along * ((value - place) / (place - other)))
        sizes = [self.orbits[at].size for at in own if abs(at - value) < self.least]
        departed = DEPARTED * min(sizes, default=math.inf) if near.rate > 0.0 else math.inf
        for guess in guesses:
            forced = orbit(segments, guess, near.maps)
            close = forced and np.abs(forced.states - guess).max() <= CLOSE * near.size
            if forced and (branch is None or (close and forced.size < departed)):
                return forced
        return None

    def _grown(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """The periodic motion that grows out of steady sliding with the waves of the wheel."""
        wheel, near, part, stride = found.system.wheel, None, 0.0, LARGEST_PART
        while part < 1.0 and stride >= LEAST_PART:
            more = min(part + stride, 1.0)
            system = replace(found.system, wheel=wheel._replace(g=more * wheel.g))
            segments = self._segments(value, replace(found, system=system), period)
            guess = near.states if near else np.tile(segments.rest, (len(segments.systems), 1))
            forced = orbit(segments, guess, near.maps if near else None)
            part, near, stride = (more, forced, stride) if forced else (part, near, 0.5 * stride)
        return near if part == 1.0 else None

    def _waited(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """A stable periodic motion that is reached by waiting, unless it is far larger than the nearest one known:
        then that one has been left for a limit cycle.
        """
        segments, (_, near) = self._segments(value, found, period), self._near(value)
        slow = natural_frequencies(found.system.coefficients, found.stiffness)[0]
        start = segments.moved(near)[0] if near else segments.rest
        waited = segments.settled(start, min(RELAXED / slow, LONGEST) if slow > 0.0 else LONGEST)
        forced = orbit(segments, waited, None)
        return None if forced and near and forced.size > DEPARTED * near.size else forced


def _around(value: float, places: Collection[float]) -> tuple[float, float]:
    """The nearest places below and above a value, which is both if it is one; infinite where there is none."""
    below = max((each for each in places if each <= value), default=-math.inf)
    return below, min((each for each in places if each >= value), default=math.inf)


def _same(one: Orbit, other: Orbit) -> bool:
    """Whether two motions are so close that they are one."""
    return bool(np.abs(one.states - one.segments.moved(other)).max() <= CLOSE * other.size)
