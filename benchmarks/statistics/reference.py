"""The reference: a case's motion from its plain tables, at two accuracies, so that it knows its own error.

It shares no code with brakecli: equations, contact integral, steps and events are its own (`kernels`). Times of
samples and knots, the travel of the wheel and the phases of its waves are computed in exact fractions.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from benchmarks.statistics.kernels import STAGES, Floats, Shoe, Work, integrate

Tables = dict[str, Any]
SIZES = 1e-8  # error of a step over the sizes, in the run that finds these
TIGHTEST = 1e-17  # such an error of the reference; larger on pads that open, where the exact contact is expensive,
# where it is this part of the promise; and in tests
SHARE = 1e-12
QUICK_SHARE = 1e-8
# such errors of the second run over those of the first; its longest step, too
COARSER = 10.0
SHORTER = 1.6
# rad of the fastest motion and of a passing wave, in a step
LONGEST = 0.3
PER_WAVE = 0.5
CELLS = 16.0  # to the shortest wave
NOISE = 4e-18  # rounding of a step over the largest motion: no error of a step can be set below it
REST = 1e-12  # of a motion: below it a quantity is rounding, and counts as none
NAMES = ("x", "y", "vx", "vy")


@dataclass(frozen=True)
class Reference:
    """Samples of x, y, vx and vy, how far they may be off at each, and what has happened."""

    rows: Floats
    off: Floats
    sizes: Floats  # largest values of each; infinite where there is nothing but rounding
    interval: float  # s
    sticks: int
    turns: int  # of friction, without stick
    lifts: int
    opened: bool
    steps: int

    def good(self, error: float) -> int:
        """How many samples from the first on are known to a relative error."""
        late = np.flatnonzero((self.off / self.sizes).max(axis=1) > error)
        return int(late[0]) if len(late) else len(self.rows)

    def error_of(self, rows: Floats, count: int | None = None) -> float:
        """The largest deviation of other samples, of each quantity over its largest value, up to some sample."""
        one = rows[:count, :4]
        other = self.rows[:count]
        if one.shape != other.shape or not np.isfinite(one).all():
            return math.inf
        return float((np.abs(one - other) / self.sizes).max())

    def own_error(self, count: int | None = None) -> float:
        """The largest error of the reference, as `error_of` counts it."""
        return float((self.off[:count] / self.sizes).max())


def _sines(table: Tables | None) -> tuple[Floats, Floats, Floats]:
    """Amplitudes (m), wavenumbers (rad/m) and phases (rad) of a surface."""
    table = table or {"amplitudes": [], "wavelengths": []}
    amplitudes = np.array(table["amplitudes"], dtype=float)
    phases = np.radians(np.array(table.get("phases_deg", np.zeros(len(amplitudes))), dtype=float))
    return amplitudes, 2.0 * np.pi / np.array(table["wavelengths"], dtype=float), phases


def shoe_of(tables: Tables) -> Shoe:
    """The numbers of a case."""
    one = tables["link1"]
    two = tables["link2"]
    contact = tables["contact"]
    beta, alpha = (math.radians(each.get("angle_deg", 0.0)) for each in (one, two))

    def links(c_1: float, c_2: float) -> tuple[float, float, float]:
        xx = c_1 * math.sin(beta) ** 2 + c_2 * math.cos(alpha) ** 2
        xy = c_1 * math.sin(beta) * math.cos(beta) - c_2 * math.sin(alpha) * math.cos(alpha)
        return xx, xy, c_1 * math.cos(beta) ** 2 + c_2 * math.sin(alpha) ** 2

    rough = tables.get("roughness", {})
    a = contact["half_length"]
    g_1, q_1, p_1 = _sines(rough.get("shoe"))
    g_2, q_2, _ = _sines(rough.get("wheel"))
    shortest = 2.0 * math.pi / max([*q_1, *q_2, 2.0 * math.pi / a])
    edges = np.linspace(-a, a, 1 + math.ceil(2.0 * a * CELLS / shortest))
    angles = np.outer(q_2, edges)
    f_1 = (g_1[:, None] * np.sin(np.outer(q_1, edges) + p_1[:, None])).sum(axis=0)
    area_1 = float((2.0 * g_1 / q_1 * np.sin(q_1 * a) * np.sin(p_1)).sum())
    heights = np.abs([*g_1, *g_2])
    curvature = float((heights * np.array([*q_1, *q_2]) ** 2).sum())
    stiff = links(one["stiffness"], two["stiffness"])
    damped = links(one.get("damping", 0.0), two.get("damping", 0.0))
    return Shoe(
        tables["shoe"]["mass"], *stiff, *damped, math.sin(beta), math.cos(beta), tables["friction"]["coefficient"],
        contact["stiffness"], a, g_1, q_1, p_1, g_2, q_2, edges, f_1, np.sin(angles), np.cos(angles), curvature,
        float(heights.sum()), area_1,
    )  # fmt: skip


def _schedule(table: Tables, one: str, many: str) -> list[tuple[Fraction, Fraction]]:
    """Knots of what is linear in between, and constant outside."""
    if one in table:
        return [(Fraction(0), Fraction(table[one]))]
    return [(Fraction(t), Fraction(v)) for t, v in zip(table["times"], table[many], strict=True)]


def _piece(knots: list[tuple[Fraction, Fraction]], t: Fraction) -> tuple[Fraction, Fraction]:
    """Value at a time and slope behind it."""
    if t < knots[0][0]:
        return knots[0][1], Fraction(0)
    for (start, value), (end, other) in pairwise(knots):
        if start <= t < end:
            slope = (other - value) / (end - start)
            return value + slope * (t - start), slope
    return knots[-1][1], Fraction(0)


def spans_of(tables: Tables, samples: int) -> tuple[Floats, Floats, list[int]]:
    """Rows of `Span` between all samples and knots, the phases there, and which of them end at samples."""
    interval = Fraction(tables["output"]["sample_interval"])
    radius = Fraction(tables["wheel"]["radius"])
    speeds = [(t, v * radius) for t, v in _schedule(tables["wheel"], "angular_speed", "angular_speeds")]
    loads = _schedule(tables["load"], "force", "forces")
    ends = {interval * n for n in range(samples + 1)}
    stops = sorted(ends | {t for t, _ in speeds + loads if 0 < t < interval * samples})
    _, q_2, p_2 = _sines(tables.get("roughness", {}).get("wheel"))
    rows = []
    travelled = [Fraction(0)]
    for t, after in pairwise(stops):
        U, U_t = _piece(speeds, t)
        Q, Q_t = _piece(loads, t)
        length = after - t
        rows.append([float(each) for each in (length, U, U_t, Q, Q_t)])
        travelled.append(travelled[-1] + (U + U_t * length / 2) * length)
    travel = np.array([float(each) for each in travelled[:-1]], dtype=np.longdouble)
    travel += np.array([float(each - Fraction(float(each))) for each in travelled[:-1]])
    turn = 2 * np.longdouble("3.14159265358979323846264338327950288")
    phases = np.ascontiguousarray(p_2 - np.outer(travel, q_2.astype(np.longdouble)) % turn, dtype=float)
    return np.array(rows), phases, [number for number, t in enumerate(stops[1:]) if t in ends]


def rate_of(shoe: Shoe) -> float:
    """A bound of the fastest natural frequency, rad/s."""
    K = 2.0 * shoe.a * shoe.k
    row = max(shoe.c_xx + abs(shoe.c_xy) + shoe.phi * K, shoe.c_yy + abs(shoe.c_xy) + K)
    return math.sqrt(row / shoe.m) + max(shoe.b_xx, shoe.b_yy) / shoe.m


def samples_of(tables: Tables) -> int:
    """Samples after the first one."""
    return round(tables["solver"]["duration"] / tables["output"]["sample_interval"])


def motion(
    tables: Tables, tolerance: float, sizes: Floats, displaced: float = 0.0, shorter: float = 1.0
) -> tuple[Floats, Floats] | None:
    """Samples of x, y, vx and vy, and counts of events; None where the motion overflows.

    The start is displaced by a part of itself. No step is longer than the longest one over `shorter`.
    """
    shoe = shoe_of(tables)
    samples = samples_of(tables)
    spans, phases, at = spans_of(tables, samples)
    passing = max(shoe.q_2, default=0.0) * float(np.abs(spans[:, 1]).max())
    longest = min(LONGEST / rate_of(shoe), PER_WAVE / passing if passing > 0.0 else math.inf) / shorter
    start = np.array([tables.get("initial", {}).get(name, 0.0) for name in NAMES], dtype=float)
    work = Work(
        start * (1.0 + displaced), np.zeros(4), sizes, np.empty((STAGES, 4)), *(np.empty(4) for _ in range(3))
    )
    sampled = np.empty((len(spans), 4))
    counts = np.zeros(5)
    if not integrate(shoe, spans, phases, work, longest, tolerance, sampled, counts):
        return None
    return np.vstack([start, sampled[at]]), counts


def static_sizes(tables: Tables) -> Floats:
    """Sizes of x, y, vx and vy from load, heights and start."""
    shoe = shoe_of(tables)
    spans = spans_of(tables, 1)[0]
    loads = [abs(float(value)) for _, value in _schedule(tables["load"], "force", "forces")]
    start = tables.get("initial", {})
    rate = rate_of(shoe)
    size = max(loads) / (shoe.c_yy + 2.0 * shoe.a * shoe.k) + shoe.height
    size += abs(start.get("x", 0.0)) + abs(start.get("y", 0.0))
    size += (abs(start.get("vx", 0.0)) + abs(start.get("vy", 0.0)) + 1e-3 * abs(spans[0, 1])) / rate
    return size * np.array([1.0, 1.0, rate, rate])


def quick(tables: Tables) -> tuple[Floats, Floats] | None:
    """A motion to a few digits, which says what happens, and counts of events."""
    return motion(tables, SIZES, static_sizes(tables))


def reference(tables: Tables, goal: float = 0.0) -> Reference | None:
    """The reference of a case; None where its motion overflows. `goal`: error of a step where a pad opens."""
    found = quick(tables)
    if found is None:
        return None
    sizes = np.abs(found[0]).max(axis=0)
    rate = rate_of(shoe_of(tables))
    largest = np.array([1.0, 1.0, rate, rate]) * max(sizes[:2].max(), sizes[2:].max() / rate)
    if not largest.all():
        return None
    # The coarser one has other steps and, by a rounding, another start: both show what grows of such errors.
    fine = max(goal, TIGHTEST) if found[1][3] else TIGHTEST
    scale = np.maximum(sizes, NOISE / fine * largest)
    runs = [motion(tables, COARSER * fine, scale, 2.0**-52), motion(tables, fine, scale, 0.0, SHORTER)]
    if runs[0] is None or runs[1] is None:
        return None
    (coarse, _), (rows, counts) = runs
    sizes = np.abs(rows).max(axis=0)
    rounding = REST * sizes[:2].max() * np.array([1.0, 1.0, rate, rate])
    off = np.maximum.accumulate(np.abs(rows - coarse), axis=0)
    sticks, turns, lifts, opened, steps = (int(each) for each in counts)
    within = np.where(sizes > rounding, sizes, math.inf)
    return Reference(
        rows, off, within, tables["output"]["sample_interval"], sticks, turns, lifts, opened > 0, steps
    )
