"""Stability of the motion that a rough wheel forces on a shoe when the surfaces open.

The wheel's waves repeat after a common period T. The forced motion is then a fixed point of the map over T; it is
stable while all eigenvalues of the map's derivative (Floquet's multipliers) lie inside the unit circle. The period
is cut into segments (multiple shooting), so that a disturbance stays small and above rounding within each of them.
Without a common period the same derivatives along a long run give Lyapunov's exponent.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import is_undamped
from brakecli.solver.links import natural_frequencies
from brakecli.solver.motion import solve
from brakecli.solver.quantities import Failure
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.system import Initial, System
from brakecli.sweeps.growth import DEPARTED, Growth, Sliding, growth, held

LONGEST = 10.0  # s, of a period that is worth computing
LARGEST_DENOMINATOR = 10**6  # of the ratio of two wavelengths
SAME = 1e-15  # relative difference of ratios that are the same but for rounding
DISTURBANCE = 1e-6  # in static compressions: the rounding of a run is 1e-10 of it
CLOSED = 1e-7  # largest gap, in static compressions, between the end of a segment and the next one
ITERATIONS = 10
SEGMENT = 10.0  # periods of the slowest motion
MOST_SEGMENTS = 250
SCANNED = 9  # values of the parameter, both ends among them, between which a change is looked for by runs
PARTS = 4  # of each interval between them, where surfaces open in a run
REFINED = 3  # times that values are added beside one at which stability is nearly lost or regained
SAMPLES = 64  # of a segment
NEUTRAL = 1e-4  # of ln of a multiplier that is one but for rounding, as all are without dashpots below flutter
SHORTEST = 16  # parts of the way from a known motion to the next that are tried
LARGEST_PART = 0.25  # of the waves' amplitudes that is added at once to a motion
RELAXED = 100.0  # periods of the slowest motion after which a stable motion has come near its orbit
STEPS = {2.0: 2.0, 0.5: -0.5}
"""Divisors of the step, which also multiply the nodes, and the error in changes of the growth: with half the step
it changes by a half of its error or more, with twice the step by all of it or more; at least half of that counts,
as patches that open make errors fall unevenly."""
WIDER = 1.5  # times the shift that these show
STRIDES = 7  # towards the place where growth with other steps passes zero
MISSED = 3  # searches for a motion that grows out of steady sliding that may fail
BATCHES, BATCH, TRANSIENT = 8, 4, 16  # batches of a long run, segments of a batch, segments before the first
CERTAIN = 3.5  # standard errors of the mean of eight batches: 99 % of Student's distribution

Floats = NDArray[np.float64]


def common_period(system: System) -> float | None:
    """The time (s) after which all waves of the wheel repeat; None where there is none, or none short enough."""
    turns, belt = system.wheel.turns, abs(system.belt_speed)
    if belt == 0.0 or not turns.size:
        return None
    ratios = [Fraction(turn / turns[0]).limit_denominator(LARGEST_DENOMINATOR) for turn in turns.tolist()]
    if any(abs(float(ratio) * turns[0] - turn) > SAME * turn for ratio, turn in zip(ratios, turns, strict=True)):
        return None
    common = math.gcd(*(each.numerator for each in ratios)) / math.lcm(*(each.denominator for each in ratios))
    period = 1.0 / (turns[0] * common * belt) if common > 0.0 else math.inf
    return float(period) if period <= LONGEST else None


class Segments:
    """The motion about steady sliding over a time (s), cut into equal segments; states are counted in `scales`."""

    def __init__(self, found: Sliding, time: float, count: int, finer: float = 1.0) -> None:
        """Prepare the systems of all segments: the wheel has turned on from one to the next.

        `finer`: divides the step, and multiplies the nodes of the contact.
        """
        system, fast = found.system, natural_frequencies(found.system.coefficients, found.stiffness)[1]
        self.scales = found.normal_force / found.stiffness * np.array([1.0, 1.0, *[2.0 * math.pi * fast] * 2])
        self.rest = np.array([found.x, found.y, 0.0, 0.0]) / self.scales
        self.time, length = time, time / count
        interval = length / SAMPLES
        step = interval / math.ceil(interval / system.step * (1.0 - 1e-9))
        method = replace(system.method, step=step, start="consistent")
        if finer != 1.0:
            method = replace(method, step=step / finer, nodes=int(finer * system.nodes))
        whole = held(replace(system, interval=interval, duration=length, method=method))
        angles, self.systems = np.zeros(system.wheel.g.size), list[System]()
        for k in range(count):
            wheel_angles(system.wheel.waves, system.belt_speed * time * k / count, 0.0, angles)
            self.systems.append(replace(whole, wheel=system.wheel._replace(phase=angles.copy())))

    def end(self, k: int, state: Floats) -> Floats:
        """Where the segment `k` ends that begins at a state; NaN where the run fails."""
        end: Floats = self._run(self.systems[k], state)[-1]
        return end

    def ends(self, states: Floats) -> Floats:
        """Where the segments end."""
        return np.array([self.end(k, state) for k, state in enumerate(states)])

    def maps(self, states: Floats, ends: Floats) -> Floats:
        """The derivative of each end by the state where its segment begins."""
        moved = [self.ends(states + DISTURBANCE * direction) - ends for direction in np.eye(4)]
        return np.stack(moved, axis=2) / DISTURBANCE

    def settled(self, state: Floats, time: float) -> Floats:
        """The states of the last period, after so many whole ones that a time (s) has passed."""
        count = len(self.systems)
        periods = max(1, math.ceil(time / self.time))
        rows = self._run(replace(self.systems[0], duration=periods * self.time), state)
        return rows[-count * SAMPLES - 1 : -1 : SAMPLES] if len(rows) > 1 else np.full((count, 4), np.nan)

    def size(self, states: Floats) -> float:
        """The largest distance from steady sliding on the way from some states."""
        runs = [self._run(system, state) for system, state in zip(self.systems, states, strict=True)]
        return float(np.abs(np.concatenate(runs) - self.rest).max())

    def moved(self, near: "Orbit") -> Floats:
        """The states of a motion at another value of the parameter, moved with steady sliding."""
        return (near.states - near.segments.rest) * (near.segments.scales / self.scales) + self.rest

    def _run(self, system: System, state: Floats) -> Floats:
        motion = solve(replace(system, initial=Initial(*(state * self.scales).tolist())))
        failed = motion.work.failure not in (Failure.NONE, Failure.UNBALANCED)
        return np.full((1, 4), np.nan) if failed else motion.rows[:, :4] / self.scales


@dataclass(frozen=True)
class Orbit:
    """A periodic motion: its states where segments begin, and the derivatives of where they end."""

    segments: Segments
    states: Floats
    maps: Floats
    rate: float  # ln of the largest multiplier's modulus over the period, 1/s
    size: float  # largest distance from steady sliding


class Disturbances:
    """Growth of small disturbances along a parameter; a periodic motion is followed from its neighbour's."""

    def __init__(self, sliding_at: Callable[[float], Sliding | None]) -> None:
        """Begin without any value."""
        self.sliding_at = sliding_at
        self.known: dict[float, Growth | None] = {}
        self.orbits: dict[float, Orbit] = {}
        self.missed = 0

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

    def scan(self, values: list[float]) -> None:
        """Measure in order, and where no periodic motion was found, look again from the ones above."""
        lost = [value for value in values if self.at(value) is None]
        for value in reversed(lost):
            if max(self.orbits, default=value) > value:
                del self.known[value]
                self.at(value)

    def scanned(self, lower: float, upper: float, windows: Iterable[tuple[float, float]]) -> list[float]:
        """The values between which changes are looked for.

        Where surfaces open they lie closer, and closest beside values where stability is nearly lost or regained.
        Otherwise the `windows` that eigenvalues show have one value each.
        """
        values: list[float] = np.linspace(lower, upper, PARTS * (SCANNED - 1) + 1).tolist()
        self.scan(values[::PARTS])
        if not any(measured and measured.opened for measured in map(self.at, values[::PARTS])):
            ends = [lower, *(end for window in windows for end in window), upper]
            return sorted({*values[::PARTS], *(0.5 * (low + high) for low, high in pairwise(ends))})
        self.scan(values)
        for _ in range(REFINED):
            added = set[float]()
            for triple in zip(values, values[1:], values[2:], strict=False):
                rates = [measured.rate for measured in map(self.at, triple) if measured]
                if len(rates) < len(triple) or min(rates) * max(rates) <= 0.0:
                    continue
                least = min(map(abs, rates))
                if least == abs(rates[1]) and least < 2.0 * np.ptp(rates):
                    added |= {0.5 * (low + high) for low, high in pairwise(triple)}
            values = sorted({*values, *added})
            self.scan(sorted(added))
        return values

    def error(self, value: float) -> float:
        """By how much the step may falsify the growth (1/s) of a periodic motion."""
        coarse = self.orbits[value]
        return max(
            abs(part * (self._finer(value, coarse, finer).rate - coarse.rate)) for finer, part in STEPS.items()
        )

    def shift(self, value: float, slope: float, lower: float, upper: float) -> float:
        """By how much the step may falsify the place, near a value, where growth of a slope passes zero."""
        return WIDER * max(self._shifted(value, slope, lower, upper, *step) for step in STEPS.items())

    def _shifted(
        self, value: float, slope: float, lower: float, upper: float, finer: float, part: float
    ) -> float:
        """How far from a value growth less its error passes zero: growing strides, and a straight line."""
        near, place, stride, rate = self.orbits[value], value, 0.0, math.nan
        for count in range(STRIDES):
            before, last = rate, place
            place = min(max(place + stride, lower), upper)
            measured = self.at(place)
            if measured is None:
                break
            near = self._finer(place, near, finer)
            rate = measured.rate + part * (near.rate - measured.rate)
            if not math.isfinite(rate):
                return math.inf
            if before * rate <= 0.0 and before != rate:
                return abs(last + (place - last) * before / (before - rate) - value)
            stride = 3.0 * stride if count else -rate / slope
        return abs(place - value)

    def _finer(self, value: float, near: Orbit, finer: float) -> Orbit:
        """The periodic motion at a value near another one, with the step divided and the nodes multiplied."""
        found = self.sliding_at(value)
        period = common_period(found.system) if found else None
        if found is None or period is None:
            return replace(near, rate=math.nan)
        segments = Segments(found, period, len(near.states), finer)
        states = segments.moved(near)
        if (forced := orbit(segments, states, near.maps)) is not None:
            return forced
        maps = segments.maps(states, segments.ends(states))
        return Orbit(segments, states, maps, _log_radius(maps) / period, near.size)

    def _measured(self, value: float, found: Sliding) -> Growth | None:
        smooth, periodic = found.system.wheel.g.size == 0, bool(self.orbits) or found.modulated
        plain = None if periodic else growth(found)  # from the first motion that opens on, all may
        if smooth or (not periodic and plain and not plain.opened):
            return plain or growth(found)
        if (period := common_period(found.system)) is None:
            return lyapunov(found, plain)
        place, near = self._near(value)
        low, high = sorted((place, value))
        gap = any(lost is None and low < other < high for other, lost in self.known.items())
        forced = None if gap else self._followed(value, found, period)
        if forced is None and not is_undamped(found.system.coefficients):
            if plain is None and near is not None and near.rate > 0.0:
                plain = growth(found)
            if plain is None or plain.rate <= 0.0:
                forced = self._waited(value, found, period)
        if forced is None and self.missed < MISSED:
            forced = self._grown(value, found, period)
            self.missed += forced is None
        if forced is None:
            return None
        self.orbits[value] = forced
        noise = NEUTRAL / period if is_undamped(found.system.coefficients) else 0.0
        return Growth(forced.rate, 0.0, noise, opened=True)

    def _near(self, value: float) -> tuple[float, Orbit | None]:
        near = min(self.orbits, key=lambda other: abs(other - value), default=math.nan)
        return near, self.orbits.get(near)

    def _nearest(self, value: float) -> tuple[float, float]:
        """Where the two nearest motions are, or twice the only one."""
        near = sorted(self.orbits, key=lambda other: abs(other - value))[:2]
        return near[0], near[-1]

    def _segments(self, value: float, found: Sliding, period: float) -> Segments:
        _, near = self._near(value)
        slow = natural_frequencies(found.system.coefficients, found.stiffness)[0]
        count = min(max(1, math.ceil(period * slow / SEGMENT)), MOST_SEGMENTS)
        return Segments(found, period, len(near.states) if near else count)

    def _followed(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """The periodic motion from the nearest one that is known, on the way in strides; from steady sliding where
        none is known.
        """
        place, near = self._near(value)
        if near is None:
            segments = self._segments(value, found, period)
            return orbit(segments, np.tile(segments.rest, (len(segments.systems), 1)), None)
        stride, shortest = value - place, abs(value - place) / SHORTEST
        while abs(stride) >= shortest:
            aim = value if abs(value - place) <= abs(stride) else place + stride
            at = found if aim == value else self.sliding_at(aim)
            length = common_period(at.system) if at else None
            forced = self._beside(aim, at, length) if at and length else None
            if forced is None:
                stride *= 0.5
            elif aim == value:
                return forced
            else:
                self.orbits[aim], place = forced, aim
        return None

    def _beside(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """The periodic motion that continues the line through the two nearest ones, or is near the nearest."""
        segments, (one, other) = self._segments(value, found, period), self._nearest(value)
        near = self.orbits[one]
        guesses = [segments.moved(near)]
        if abs(value - one) <= 2.0 * abs(one - other):
            along = guesses[0] - segments.moved(self.orbits[other])
            guesses.insert(0, guesses[0] + along * ((value - one) / (one - other)))
        tried = (orbit(segments, guess, near.maps) for guess in guesses)
        return next((forced for forced in tried if forced), None)

    def _grown(self, value: float, found: Sliding, period: float) -> Orbit | None:
        """The periodic motion that grows out of steady sliding with the waves of the wheel."""
        wheel, near, part, stride = found.system.wheel, None, 0.0, LARGEST_PART
        while part < 1.0 and stride >= LARGEST_PART / SHORTEST:
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


def orbit(segments: Segments, states: Floats, maps: Floats | None) -> Orbit | None:
    """The periodic motion near some states, by Newton's method; None where it does not converge.

    Derivatives are taken anew where those at hand do not halve the gaps, and where the motion has closed. A step
    that does not lessen the gaps is shortened.
    """
    fresh, (ends, gaps, gap) = False, _gaps(segments, states)
    for _ in range(ITERATIONS):
        if not math.isfinite(gap):
            return None
        if maps is None or gap <= CLOSED:
            maps, fresh = segments.maps(states, ends), True
        if not np.isfinite(maps).all():
            return None
        if gap <= CLOSED:
            return Orbit(segments, states, maps, _log_radius(maps) / segments.time, segments.size(states))
        change = _correction(maps, gaps)
        for part in (1.0, 0.5, 0.25, 0.125) if fresh else (1.0,):
            moved = _gaps(segments, states + part * change)
            if moved[2] < (1.0 - 0.3 * part if fresh else 0.5) * gap:
                states, (ends, gaps, gap), fresh = states + part * change, moved, False
                break
        else:
            if fresh:
                return None
            maps = None
    return None


def lyapunov(found: Sliding, plain: Growth | None) -> Growth | None:
    """Lyapunov's exponent of the motion from steady sliding, from means over batches of a long run.

    A motion that leaves what roughness forces on it is on its way to another one: its exponent says nothing, and
    the growth counts that was measured before, if it is one.
    """
    system = found.system
    slow = natural_frequencies(system.coefficients, found.stiffness)[0]
    passing = abs(system.belt_speed) * float(system.wheel.turns.min())
    length = min(max(2.0 / slow if slow > 0.0 else 0.0, 1.0 / passing), LONGEST / BATCH)
    count = TRANSIENT + BATCHES * BATCH
    segments = Segments(found, count * length, count)
    states = [segments.rest]
    for k in range(count):
        states.append(segments.end(k, states[-1]))
    visited = np.array(states)
    if not np.isfinite(visited).all():
        return None
    away = np.abs(visited - segments.rest).max(axis=1)
    if away[TRANSIENT:].max() > DEPARTED * away[: TRANSIENT // 2].max():
        return plain
    maps, logs, frame = segments.maps(visited[:-1], visited[1:]), np.zeros(count), np.eye(4)
    for k in range(count):
        frame, triangle = np.linalg.qr(maps[k] @ frame)
        logs[k] = math.log(max(abs(float(triangle[0, 0])), 1e-300))
    means = logs[TRANSIENT:].reshape(BATCHES, BATCH).mean(axis=1) / length
    error = CERTAIN * float(means.std(ddof=1)) / math.sqrt(BATCHES)
    return Growth(float(means.mean()), 0.0, 0.0, opened=True, bar=error)


def _gaps(segments: Segments, states: Floats) -> tuple[Floats, Floats, float]:
    """Where segments end, what lies between there and the next ones, and the largest of these gaps."""
    ends = segments.ends(states)
    gaps = ends - np.roll(states, -1, axis=0)
    gap = float(np.abs(gaps).max())
    return ends, gaps, gap if math.isfinite(gap) else math.inf


def _correction(maps: Floats, gaps: Floats) -> Floats:
    """The changes d of the states that close the gaps to first order: d[k + 1] - maps[k] d[k] = gaps[k]."""
    count = len(maps)
    matrix = np.zeros((count, 4, count, 4))
    for k in range(count):
        matrix[k, :, (k + 1) % count] += np.eye(4)
        matrix[k, :, k] -= maps[k]
    try:
        changes: NDArray[Any] = np.linalg.solve(matrix.reshape(4 * count, -1), gaps.ravel())
        return changes.reshape(count, 4)
    except np.linalg.LinAlgError:
        return np.full((count, 4), np.nan)


def _log_radius(maps: Floats) -> float:
    """ln of the largest modulus of the eigenvalues of the product of all maps."""
    product, log_size = np.eye(4), 0.0
    for each in maps:
        product = np.matmul(each, product)
        size = float(np.abs(product).max())
        if not size > 0.0:
            return -math.inf
        product, log_size = product / size, log_size + math.log(size)
    return log_size + math.log(max(float(np.abs(np.linalg.eigvals(product)).max()), 1e-300))
