"""Many runs at once: three-layer runs on the same rough surfaces, each in a lane of its own.

Every number of a run has neighbours, those of `LANES` - 1 other runs, so that one instruction computes several. In
all else they are strangers: what the other lanes hold does not change a bit of a run.

A lane knows slip to one side at constant speed and load, and the paper's iteration, (13), from a guess that is
good enough for most steps. A run that sticks or turns, blows up or needs many evaluations leaves its lane without
a result: `motion.solve` computes it.
"""

import math
import time
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import float64, int64, types, void
from numpy.typing import NDArray

from brakecli import stop
from brakecli.errors import CaseError
from brakecli.solver.compile import FAST, Floats, borrowed, kernel, stopped, vector
from brakecli.solver.contact.pad import BESIDE, TILE, aligned, build_pad
from brakecli.solver.energy import NOT_KEPT
from brakecli.solver.friction import observed
from brakecli.solver.motion import Motion, Work
from brakecli.solver.quantities import BOUND, HISTORY
from brakecli.solver.records import Coefficients, record
from brakecli.solver.roughness import TWO_PI, Surface
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.sine import sine_cosine
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import Initial, System

LANES, WAVES = 16, 5
"""Runs side by side, and waves of the wheel, at most."""
LEFT = 1e-4
"""What the iteration may leave of the force of a step, over the load and the tolerance."""
MOST_SAMPLES = 1 << 14
"""Of a run in a lane, so that the histories of all lanes take little memory."""

_MOST = 8  # evaluations of the contact in a step
_CONTRACTION = 0.1  # of the iteration, at most
_MOST_BYTES, _MOST_STEPS = 1e8, 1e9  # of the tables at the nodes, and between two samples
_MOST_PASSED = 1e6  # waves, beyond which their phase needs more than 16 digits
_THETA_1, _THETA_2, _THETA_3 = NUMEROV


def _lanes(names: str) -> dict[str, Any]:
    return dict.fromkeys(names.split(), (float, LANES))


LANE = record(
    **_lanes(" ".join(Coefficients._fields) + " load belt"),  # given: Q, N, and U, m/s
    **_lanes("side grip k"),  # sign of the sliding velocity, F_x/F_y, stiffness of the layer, N/m²
    **_lanes("i_11 i_12 i_22 limit"),  # inverse of a, s/kg; change of the force (N) at which (13) goes on
    **_lanes("x y x_old y_old d e force before earlier"),  # the motion, as in `records.STATE`
    **_lanes("g_1 g_2 x_0 y_0"),  # a step, as in `records.PROBLEM`
    **_lanes("at_x at_y found touches partly"),  # where the contact is evaluated, its force, the part that touches
    **_lanes("guess done out evaluations closed"),  # of the force; 1 where it is right; 1 without a result; counts
    rate=(float, (WAVES, LANES)),  # waves that pass in a second
    sine=(float, (WAVES, LANES)),  # of a wave at the middle of the pad
    cosine=(float, (WAVES, LANES)),
)
_LANE = numba.from_dtype(LANE)


class Shared(NamedTuple):
    """What the runs have in common: their grid of time, surfaces and nodes; lengths in m."""

    h: float  # s
    interval: float  # between samples, s
    per_sample: int
    nodes: int
    length: float  # of the pad
    full_up_to: float
    clear_from: float
    shoe_mean: float
    waves: Floats  # of each: wavenumber, phase, and its part of the force in full contact over k sin, m²
    table: Floats  # of each node: f1, and g sin(ωξ), g cos(ωξ) of all waves
    signals: int


_SHARED = types.NamedTuple([float64, float64, int64, int64, *[float64] * 4, vector, vector, int64], Shared)


@kernel(void(_LANE, _SHARED, int64, float64), fastmath=FAST)
def _pass(o: Any, shared: Shared, i: int, t: float) -> None:
    """Sine and cosine of a wave of the wheel."""
    omega, phase = shared.waves[3 * i], shared.waves[3 * i + 1]
    for n in range(LANES):
        turns = o.rate[i, n] * t
        angle = omega * o.at_x[n] + (phase - TWO_PI * (turns - np.floor(turns)))
        o.sine[i, n], o.cosine[i, n] = sine_cosine(angle)


@kernel(void(_LANE, _SHARED), fastmath=FAST)
def _add_nodes(o: Any, shared: Shared) -> None:
    """The midpoint sum of the gaps (m), and how many nodes touch."""
    table, at = shared.table, 0
    for n in range(LANES):
        o.found[n] = o.touches[n] = 0.0
    for _ in range(shared.nodes):
        f1, s_0, s_1, s_2, s_3, s_4 = (
            table[at],
            table[at + 1],
            table[at + 2],
            table[at + 3],
            table[at + 4],
            table[at + 5],
        )
        c_0, c_1, c_2, c_3, c_4 = table[at + 6], table[at + 7], table[at + 8], table[at + 9], table[at + 10]
        at += 11
        for n in range(LANES):
            gap = o.cosine[0, n] * s_0 + o.sine[0, n] * c_0 + o.cosine[1, n] * s_1 + o.sine[1, n] * c_1
            gap += o.cosine[2, n] * s_2 + o.sine[2, n] * c_2 + o.cosine[3, n] * s_3 + o.sine[3, n] * c_3
            gap += o.cosine[4, n] * s_4 + o.sine[4, n] * c_4 - f1 - o.at_y[n]
            o.found[n] += gap if gap > 0.0 else 0.0
            o.touches[n] += 1.0 if gap > 0.0 else 0.0


@kernel(void(_LANE, _SHARED, float64), fastmath=FAST, inlined=False)
def _touch(o: Any, shared: Shared, t: float) -> None:
    """The normal force, (2), and the part that touches: in closed form where a bound proves it, or by nodes."""
    shared = borrowed(shared)
    waves, length, full, clear = shared.waves, shared.length, shared.full_up_to, shared.clear_from
    for i in range(WAVES):
        _pass(o, shared, i, t)
    some = 0.0
    for n in range(LANES):
        o.partly[n] = 1.0 if full < o.at_y[n] and o.at_y[n] < clear else 0.0
        some += o.partly[n]
    if some > 0.0:
        _add_nodes(o, shared)
    g_0, g_1, g_2, g_3, g_4 = waves[2], waves[5], waves[8], waves[11], waves[14]
    spacing, part = length / shared.nodes, 1.0 / shared.nodes
    for n in range(LANES):
        mean = (
            g_0 * o.sine[0, n] + g_1 * o.sine[1, n] + g_2 * o.sine[2, n] + g_3 * o.sine[3, n] + g_4 * o.sine[4, n]
        )
        mean -= length * (o.at_y[n] + shared.shoe_mean)
        closed = mean if mean > 0.0 and o.at_y[n] <= full else 0.0
        o.found[n] = o.k[n] * (spacing * o.found[n] if o.partly[n] > 0.0 else closed)
        o.touches[n] = part * o.touches[n] if o.partly[n] > 0.0 else 1.0 if o.at_y[n] <= full else 0.0


@kernel(void(_LANE, _SHARED), inlined=False)
def _begin(o: Any, shared: Shared) -> None:
    """The second level from the first, x¹ = x⁰ + h v⁰ + h² a⁰/2."""
    h = shared.h
    for n in range(LANES):
        o.at_x[n], o.at_y[n] = o.x_old[n], o.y_old[n]
    _touch(o, shared, 0.0)
    for n in range(LANES):
        x, y, d, e, force = o.x_old[n], o.y_old[n], o.d[n], o.e[n], o.found[n]
        pull_x = o.b_xx[n] * d + o.b_xy[n] * e + o.c_xx[n] * x + o.c_xy[n] * y + o.load[n] * o.sin_beta[n]
        pull_y = o.b_xy[n] * d + o.b_yy[n] * e + o.c_xy[n] * x + o.c_yy[n] * y + o.load[n] * o.cos_beta[n]
        o.x[n] = x + h * d + 0.5 * h * h * (o.grip[n] * force - pull_x) / o.m[n]
        o.y[n] = y + h * e + 0.5 * h * h * (force - pull_y) / o.m[n]
        o.force[n] = o.before[n] = o.earlier[n] = force


@kernel(void(_LANE, _SHARED), fastmath=FAST)
def _prepare(o: Any, shared: Shared) -> None:
    """(14), as in `schemes.three_layer`, and the guess of the force as in `loop.advance`."""
    h = shared.h
    for n in range(LANES):
        inertia, x_old, y_old = o.m[n] * (2.0 / (h * h)), o.x_old[n], o.y_old[n]
        x = _THETA_2 * o.x[n] + (_THETA_3 + _THETA_1) * x_old
        y = _THETA_2 * o.y[n] + (_THETA_3 + _THETA_1) * y_old
        o.g_1[n] = inertia * (o.x[n] - x_old) - o.c_xx[n] * x - o.c_xy[n] * y - o.load[n] * o.sin_beta[n]
        o.g_2[n] = inertia * (o.y[n] - y_old) - o.c_yy[n] * y - o.c_xy[n] * x - o.load[n] * o.cos_beta[n]
        o.x_0[n], o.y_0[n] = x, y
        force = 3.0 * (o.force[n] - o.before[n]) + o.earlier[n]
        force = force if force > 0.0 else 0.0
        o.guess[n] = force if o.force[n] > 0.0 else 0.0
        o.earlier[n], o.before[n] = o.before[n], o.force[n]
        o.done[n] = o.out[n]


@kernel(void(_LANE, _SHARED, float64), fastmath=FAST)
def _iterate(o: Any, shared: Shared, t: float) -> None:
    """The force of the step in `guess`: (13), until what is left is below the bound."""
    gain = 2.0 * _THETA_1 * shared.h
    for _ in range(_MOST):
        for n in range(LANES):
            f_x, f_y = o.g_1[n] + o.grip[n] * o.guess[n], o.g_2[n] + o.guess[n]  # Eq. (15), (16)
            x = o.x_0[n] + gain * (o.i_11[n] * f_x + o.i_12[n] * f_y)
            y = o.y_0[n] + gain * (o.i_12[n] * f_x + o.i_22[n] * f_y)
            o.at_x[n] = x if o.done[n] == 0.0 else o.at_x[n]
            o.at_y[n] = y if o.done[n] == 0.0 else o.at_y[n]
        _touch(o, shared, t)
        left = 0.0
        for n in range(LANES):
            waits, change = 1.0 - o.done[n], abs(o.found[n] - o.guess[n])
            o.guess[n] = o.found[n] if waits > 0.0 else o.guess[n]
            o.evaluations[n] += waits
            o.done[n] = 1.0 if change <= o.limit[n] else o.done[n]
            left += 1.0 - o.done[n]
        if left == 0.0:
            return


@kernel(void(_LANE, _SHARED))
def _finish(o: Any, shared: Shared) -> None:
    """The next level; a lane is out where the shoe slips to its side no more, or (13) did not converge."""
    h = shared.h
    for n in range(LANES):
        f_x, f_y = o.g_1[n] + o.grip[n] * o.guess[n], o.g_2[n] + o.guess[n]
        d, e = o.i_11[n] * f_x + o.i_12[n] * f_y, o.i_12[n] * f_x + o.i_22[n] * f_y
        x, y = o.x_old[n] + 2.0 * h * d, o.y_old[n] + 2.0 * h * e
        o.x_old[n], o.y_old[n], o.x[n], o.y[n] = o.x[n], o.y[n], x, y
        o.d[n], o.e[n], o.force[n] = d, e, o.guess[n]
        good = o.done[n] > 0.0 and o.side[n] * (d - o.belt[n]) > 0.0 and abs(x) + abs(y) + abs(d) + abs(e) < BOUND
        o.out[n] = o.out[n] if good else 1.0
        o.closed[n] += 1.0 - o.partly[n]


@kernel(void(_LANE, _SHARED, float64[:, :, ::1], int64))
def _sample(o: Any, shared: Shared, rows: NDArray[np.float64], number: int) -> None:
    """The sample at the older level, as `loop.sample` has it."""
    for n in range(LANES):
        o.at_x[n], o.at_y[n] = o.x_old[n], o.y_old[n]
    _touch(o, shared, number * shared.interval)
    for n in range(LANES):
        sliding, v_y, normal, belt = o.d[n] - o.belt[n], o.e[n], o.found[n], o.belt[n]
        bound = o.phi[n] * normal
        needed = o.b_xx[n] * belt + o.b_xy[n] * v_y + o.c_xx[n] * o.at_x[n] + o.c_xy[n] * o.at_y[n]
        needed += o.load[n] * o.sin_beta[n]  # Eq. (6)
        holds = abs(sliding) <= shared.h * bound / o.m[n] and abs(needed) <= bound
        side, friction = observed(sliding, holds, needed, normal, bound)
        row = rows[n, :, number]
        row[0], row[1], row[2], row[3] = o.at_x[n], o.at_y[n], o.d[n], v_y
        row[4], row[5], row[6], row[7] = friction, normal, o.touches[n], side
        o.evaluations[n] += 1.0


@kernel(void(_LANE, _SHARED, float64[:, :, ::1]))
def advance(o: Any, shared: Shared, rows: NDArray[np.float64]) -> None:
    """Run all lanes; `rows` gets the samples of each, variable by variable."""
    shared = borrowed(shared)
    _begin(o, shared)
    for number in range(rows.shape[2]):
        _sample(o, shared, rows, number)
        left = 0.0
        for n in range(LANES):
            left += 1.0 - o.out[n]
        if number == rows.shape[2] - 1 or left == 0.0 or stopped(shared.signals):
            return
        for step in range(shared.per_sample):
            _prepare(o, shared)
            _iterate(o, shared, number * shared.interval + (step + 1) * shared.h)
            _finish(o, shared)


def fits(system: System) -> Hashable | None:
    """What runs have in common that may be computed together; None where a run may not."""
    method, wheel, sliding = system.method, system.wheel, system.initial.vx - system.belt_speed
    kind = method.scheme, method.theta, method.start, method.iteration, system.evaluator
    if kind != ("three-layer", NUMEROV, "consistent", "newton", "auto") or not 0 < len(wheel.g) <= WAVES:
        return None
    changing, passed = len(system.belt) + len(system.load) > 2, system.passing_frequency * system.sampled_duration
    large = system.samples > MOST_SAMPLES or system.table_bytes > _MOST_BYTES or system.per_sample > _MOST_STEPS
    if changing or sliding == 0.0 or large or passed > _MOST_PASSED:
        return None
    return system.half_length, system.shoe, wheel, system.nodes, system.interval, system.per_sample, system.samples


@lru_cache(maxsize=4)
def _tables(half_length: float, shoe: Surface, wheel: Surface, nodes: int) -> tuple[Any, ...]:
    """What `Shared` holds from `length` to `table`."""
    pad, tables = build_pad(1.0, half_length, shoe, wheel, nodes)
    waves, table = np.zeros((WAVES, 3)), aligned(nodes * (1 + 2 * WAVES)).reshape(nodes, -1)
    own, full_at, waves_at, tiles = (
        len(wheel.g),
        int(pad.full_at),
        int(pad.waves_at),
        -(-(nodes + 2 * BESIDE) // TILE),
    )
    waves[:own] = np.stack([wheel.omega, wheel.phase, tables[full_at : full_at + own]], axis=1)
    by_tiles = tables[waves_at : waves_at + tiles * own * 2 * TILE].reshape(tiles, own, 2, TILE)
    table[:, 0] = tables[pad.nodes_at : pad.nodes_at + nodes]
    for wave, function in np.ndindex(own, 2):
        table[:, 1 + function * WAVES + wave] = by_tiles[:, wave, function].ravel()[BESIDE : BESIDE + nodes]
    heights = (float(pad[name]) for name in ("full_up_to", "clear_from", "shoe_mean"))
    return 2.0 * half_length, *heights, waves.ravel(), table.ravel()


def run_together(systems: Sequence[System]) -> list[Motion | None]:
    """The motions of systems that fit together; None where one has to be solved alone.

    Their energy is not accounted for.
    """
    firsts = range(0, len(systems), LANES)
    return [found for first in firsts for found in _run_lanes(list(systems[first : first + LANES]))]


def _run_lanes(systems: list[System]) -> list[Motion | None]:
    begin, alike, number = time.perf_counter(), systems[0], len(systems)
    signals = np.frombuffer(stop.memory, np.uint8).ctypes.data
    surfaces = _tables(alike.half_length, alike.shoe, alike.wheel, alike.nodes)
    o = _filled([*systems, *systems[-1:] * (LANES - number)])
    rows = np.zeros((LANES, len(HISTORY), alike.samples + 1))
    grid = alike.step, alike.interval, alike.per_sample, alike.nodes
    advance(o, Shared._make((*grid, *surfaces, signals)), rows)
    seconds, motions = (time.perf_counter() - begin) / number, list[Motion | None]()
    for n, system in enumerate(systems):
        steps, closed = system.steps, int(o.closed[n])
        kinds = {kind: count for kind, count in (("closed-form", closed), ("midpoint", steps - closed)) if count}
        work = Work(
            steps=steps, contact_evaluations=int(o.evaluations[n]), evaluators=kinds, solve_seconds=seconds
        )
        motions.append(Motion(system, rows[n].T, work, NOT_KEPT) if o.out[n] == 0.0 else None)
    return motions


def _filled(systems: Sequence[System]) -> Any:
    """Systems in their lanes; one without a start, or that (13) contracts too little for, is out."""
    c = Coefficients(*np.array([each.coefficients for each in systems]).T)
    start, h, wheel = np.array([_start(each) for each in systems]).T, systems[0].step, systems[0].wheel
    load, belt, k = np.array([(each.load_at_start, each.belt_speed, each.layer_stiffness) for each in systems]).T
    side = np.sign(start[2] - belt)
    grip = -side * c.phi
    a_11 = 2.0 * c.m / h + c.b_xx + 2.0 * _THETA_1 * h * c.c_xx  # Eq. (14)
    a_12 = c.b_xy + 2.0 * _THETA_1 * h * c.c_xy
    a_22 = 2.0 * c.m / h + c.b_yy + 2.0 * _THETA_1 * h * c.c_yy
    a = a_11 * a_22 - a_12 * a_12
    moves = np.abs(a_11 - a_12 * grip)  # y by the force, over a; then x by it, on the steepest slope
    moves += float(np.abs(wheel.g) @ wheel.omega) * np.abs(a_22 * grip - a_12)
    factor = 2.0 * _THETA_1 * h * 2.0 * systems[0].half_length * k * moves / a  # whichever part touches
    allowed = LEFT * np.array([each.method.tolerance for each in systems]) * np.abs(load)
    o = aligned(LANE.itemsize // 8).view(LANE)[0]
    values = {**c._asdict(), "load": load, "belt": belt, "k": k, "side": side, "grip": grip}
    values |= {"i_11": a_22 / a, "i_12": -a_12 / a, "i_22": a_11 / a, "limit": allowed * (1.0 - factor) / factor}
    values |= dict(zip(("x_old", "y_old", "d", "e"), start, strict=True))
    values["out"] = ~(factor < _CONTRACTION) | np.isnan(start[0])
    for name, value in values.items():
        o[name] = value
    o.rate[: len(wheel.g)] = np.outer(wheel.turns, belt)
    return o


def _start(system: System) -> tuple[float, float, float, float]:
    """x, y, vx and vy at t = 0; NaN where there is no steady sliding to start from."""
    initial = system.initial
    try:
        rest = steady_sliding(system) if initial.from_equilibrium else Initial()
    except CaseError:
        rest = Initial(math.nan)
    return initial.x + rest.x, initial.y + rest.y, initial.vx, initial.vy
