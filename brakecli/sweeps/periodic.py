"""The motion that a rough wheel forces on a shoe, and what becomes of disturbances of it.

The wheel's waves repeat after a common period. The forced motion is then a fixed point of the map over the period,
and the eigenvalues of the map's derivative are Floquet's multipliers. The period is cut into segments (multiple
shooting), so that a disturbance stays small and above rounding within each of them. Without a common period the
same derivatives along a long run give Lyapunov's exponent.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.analysis.stability.modes import first_order, modes, stiffness_matrix
from brakecli.solver.links import natural_frequencies
from brakecli.solver.motion import solve
from brakecli.solver.period import LONGEST
from brakecli.solver.quantities import Failure
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.system import Initial, System
from brakecli.sweeps.growth import DEPARTED, Growth, Sliding, held

DISTURBANCE = 1e-6  # in static compressions: the rounding of a run is 1e-10 of it
CLOSED = 1e-7  # largest gap, in static compressions, between the end of a segment and the next one
ITERATIONS = 10
SAMPLES = 64  # of a segment, or half as many as steps where they are fewer
BATCHES, BATCH, TRANSIENT = 8, 4, 16  # batches of a long run, segments of a batch, segments before the first
HIDDEN = 1e-9  # ratio of the least multiplier to the largest, below which rounding hides its vector
STICKS = 1.0  # neper that a volume shrinks in a period beyond what dashpots take: the shoe sticks at times
CERTAIN = 3.5  # standard errors of the mean of eight batches: 99 % of Student's distribution

Floats = NDArray[np.float64]


class Segments:
    """The motion about steady sliding over a time (s), cut into equal segments; states are counted in `scales`."""

    def __init__(self, found: Sliding, time: float, count: int, finer: float = 1.0) -> None:
        """Prepare the systems of all segments: the wheel has turned on from one to the next.

        `finer`: divides the step, and multiplies the nodes of the contact. Samples hold a whole number of double
        steps.
        """
        system, fast = found.system, natural_frequencies(found.system.coefficients, found.stiffness)[1]
        self.scales = found.normal_force / found.stiffness * np.array([1.0, 1.0, *[2.0 * math.pi * fast] * 2])
        self.rest = np.array([found.x, found.y, 0.0, 0.0]) / self.scales
        self.time, length = time, time / count
        pairs = 0.5 * length / system.step * (1.0 - 1e-9)
        of_sample = math.ceil(pairs / SAMPLES)
        self.samples = math.ceil(pairs / of_sample)
        interval = length / self.samples
        step = interval / (2 * of_sample)
        method = replace(system.method, step=step, start="consistent")
        if not (system.scheme.LAG and method.theta[0] == method.theta[-1]):  # weights that damp hide slow growth
            method = replace(method, theta=method.row.theta)
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

    def ends(self, states: Floats) -> tuple[Floats, float]:
        """Where the segments end, and the largest distance from steady sliding on the way."""
        runs = [self._run(system, state) for system, state in zip(self.systems, states, strict=True)]
        return np.array([run[-1] for run in runs]), float(np.abs(np.concatenate(runs) - self.rest).max())

    def maps(self, states: Floats, ends: Floats) -> Floats:
        """The derivative of each end by the state where its segment begins."""
        beside = [state + DISTURBANCE * np.eye(4) for state in states]
        moved = [[self.end(k, state) for state in each] for k, each in enumerate(beside)]  # they share tables
        columns: Floats = (np.array(moved) - ends[:, None, :]) / DISTURBANCE
        return np.ascontiguousarray(columns.transpose(0, 2, 1))

    def settled(self, state: Floats, time: float) -> Floats:
        """The states of the last period, after so many whole ones that a time (s) has passed."""
        count = len(self.systems)
        periods = max(1, math.ceil(time / self.time))
        rows = self._run(replace(self.systems[0], duration=periods * self.time), state)
        failed = len(rows) == 1
        return np.full((count, 4), np.nan) if failed else rows[-count * self.samples - 1 : -1 : self.samples]

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
    exponents: NDArray[np.complex128]  # ln of the multipliers, the largest last
    size: float  # largest distance from steady sliding

    @property
    def rate(self) -> float:
        """Growth (1/s) of the fastest disturbance."""
        return float(self.exponents[-1].real) / self.segments.time

    @property
    def sure(self) -> bool:
        """Whether its growth is more than its error.

        While the shoe slips volumes of states shrink as its dashpots say (Liouville); the maps' may not. Those of
        segments count, as the least multipliers of a period may be rounding. In steps h of the trapezoidal rule
        volumes shrink by tr(B (m + h²S/4)⁻¹), to first order in the dashpots B; the norm of the stiffness S is at
        most m ω² √(1 + φ²), with ω in full contact. The next order is the third power of their decay in a step.
        """
        system, time = self.segments.systems[0], self.segments.time
        c, h = system.coefficients, system.step
        lost, fast = (c.b_xx + c.b_yy) / c.m, natural_frequencies(c, system.contact_stiffness)[1]
        shrinks = -float(np.linalg.slogdet(self.maps)[1].sum()) / time
        stepped = (math.pi * fast * h) ** 2 * math.hypot(1.0, c.phi)
        least, most = lost / (1.0 + stepped), lost * (1.0 + stepped + (lost * h) ** 2 / 12.0)
        error = max(least - shrinks, shrinks - most, 0.0)
        return abs(self.rate) > error or error * time > STICKS

    @property
    def folds(self) -> bool:
        """Whether the largest multiplier is real and positive, as beside a fold."""
        return float(self.exponents[-1].imag) == 0.0

    @property
    def modes(self) -> Floats:
        """Decay over a period (neper) and angle (0 to pi) of two pairs of multipliers (rows), by the angle."""
        angles = np.abs(self.exponents.imag)
        order = np.lexsort((angles, (angles == 0.0) | (angles == math.pi)))  # a real one belongs to another one
        pairs = np.stack([-self.exponents.real, angles], axis=1)[order].reshape(2, 2, 2).mean(axis=1)
        rows: Floats = pairs[np.argsort(pairs[:, 1])]
        return rows


def orbit(segments: Segments, states: Floats, maps: Floats | None) -> Orbit | None:
    """The periodic motion near some states, by Newton's method; None where it does not converge.

    Derivatives are taken anew where those at hand do not halve the gaps, and where the motion has closed. A step
    that does not lessen the gaps is shortened.
    """
    fresh, (ends, gaps, gap, size) = False, _gaps(segments, states)
    for _ in range(ITERATIONS):
        if not math.isfinite(gap):
            return None
        if maps is None or gap <= CLOSED:
            maps, fresh = segments.maps(states, ends), True
        if not np.isfinite(maps).all():
            return None
        if gap <= CLOSED:
            return Orbit(segments, states, maps, exponents(maps), size)
        change = _correction(maps, gaps)
        for part in (1.0, 0.5, 0.25, 0.125) if fresh else (1.0,):
            moved = _gaps(segments, states + part * change)
            if moved[2] < (1.0 - 0.3 * part if fresh else 0.5) * gap:
                states, (ends, gaps, gap, size), fresh = states + part * change, moved, False
                break
        else:
            if fresh:
                return None
            maps = None
    return None


def exponent_length(found: Sliding) -> float:
    """The time (s) of the run that Lyapunov's exponent is measured in."""
    slow = natural_frequencies(found.system.coefficients, found.stiffness)[0]
    passing = abs(found.system.belt_speed) * float(found.system.wheel.turns.min())
    segment = min(max(2.0 / slow if slow > 0.0 else 0.0, 1.0 / passing), LONGEST / BATCH)
    return (TRANSIENT + BATCHES * BATCH) * segment


def lyapunov(found: Sliding, plain: Growth | None) -> Growth | None:
    """Lyapunov's exponent of the motion from steady sliding, from means over batches of a long run.

    A motion that leaves what roughness forces on it is on its way to another one: its exponent says nothing, and
    the growth counts that was measured before, if it is one.
    """
    count = TRANSIENT + BATCHES * BATCH
    length = exponent_length(found) / count
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


def _gaps(segments: Segments, states: Floats) -> tuple[Floats, Floats, float, float]:
    """Where segments end, what lies between there and the next ones, the largest of these gaps, and the size."""
    ends, size = segments.ends(states)
    gaps = ends - np.roll(states, -1, axis=0)
    gap = float(np.abs(gaps).max())
    return ends, gaps, gap if math.isfinite(gap) else math.inf, size


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


def exponents(maps: Floats) -> NDArray[np.complex128]:
    """ln of the eigenvalues of the product of all maps, the largest last."""
    product, log_size = np.eye(4), 0.0
    for each in maps:
        product = np.matmul(each, product)
        size = max(float(np.abs(product).max()), 1e-300)
        product, log_size = product / size, log_size + math.log(size)
    values = np.linalg.eigvals(product).astype(complex)
    values[np.abs(values) < 1e-300] = 1e-300
    logs: NDArray[np.complex128] = log_size + np.log(values)
    return logs[np.argsort(logs.real)]


def natural(found: Sliding) -> Floats:
    """The natural frequencies (Hz) of the scheme at its step with the mean stiffness; 0 where there is none."""
    turned = math.pi * found.system.step  # the schemes vibrate too slowly, by the trapezoidal rule
    known = modes(found.system.coefficients, found.stiffness, found.grip)
    return np.arctan(turned * np.array(sorted(mode.frequency for mode in known)[-2:])) / turned


def shift(found: Sliding, forced: Orbit) -> Floats | None:
    """How much faster disturbances of a motion vibrate than with the mean stiffness; None where rounding hides it.

    For each mode the disturbance nearest to it is followed. In a segment its angle in the plane of the mode
    differs from the expected one by less than half a turn.
    """
    c, scales = found.system.coefficients, forced.segments.scales
    motion = first_order(c, stiffness_matrix(c, found.stiffness, found.grip) / c.m)
    values, vectors = np.linalg.eig(motion * scales / scales[:, None])
    modal = np.argsort(values.imag)[-2:]
    product = np.eye(4)
    for each in forced.maps:
        product = each @ product
        product /= np.abs(product).max()
    multipliers, way = np.linalg.eig(product)
    sizes = np.abs(multipliers)
    if not values[modal].imag.min() > 0.0 or sizes.min() < HIDDEN * sizes.max():
        return None
    planes, ways = np.linalg.inv(vectors)[modal], [way]
    for each in forced.maps:
        ways.append(each @ ways[-1])
    seen = planes @ np.array([each / np.linalg.norm(each, axis=0) for each in ways])
    nearest = np.abs(seen).mean(axis=0).argmax(axis=1)
    turned = np.array([seen[:, k, which] for k, which in enumerate(nearest)])
    expected = 2.0 * math.pi * natural(found) * forced.segments.time / len(forced.maps)
    more = np.angle(turned[:, 1:] / turned[:, :-1] * np.exp(-1j * expected)[:, None])
    ratios: Floats = 1.0 + more.mean(axis=1) / expected
    return ratios
