"""Many runs at once: three-layer runs on the same rough surfaces, side by side in `lanes`.

Every number of a run has neighbours, those of `LANES` - 1 other runs, so that one instruction computes several. In
all else they are strangers: what the other lanes hold does not change a bit of a run. A run that leaves its lane
has no result: `integrate.solve` computes it.
"""

import math
import time
from collections.abc import Hashable, Sequence
from functools import lru_cache
from itertools import repeat

import numpy as np

from brakecli import stop
from brakecli.solver.arrays import Floats
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact.pad import BESIDE, TILE, aligned, build_pad
from brakecli.solver.energy import NOT_KEPT
from brakecli.solver.integrate import Motion, OwnError, Work
from brakecli.solver.kernels import load
from brakecli.solver.lanes import advance
from brakecli.solver.lanes.records import LANES, WAVES, Lane, Levels, Shared
from brakecli.solver.lanes.steps import THETA_1
from brakecli.solver.quantities import HISTORY
from brakecli.solver.records import PARTS, new
from brakecli.solver.roughness import Surface
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.steady_sliding import off_by_nodes, sliding
from brakecli.solver.system import System
from brakecli.solver.tangent import FEWEST_SAMPLES, Exponent, exponents

LEFT = 1e-3
"""What the iteration may leave of the force of a step, over load and tolerance; Newton's leaves far less."""
MOST_SAMPLES = 1 << 14
"""Most samples of a run in a lane, so that the histories of all lanes take little memory."""


Start = tuple[float, float, float, float]


def fits(system: System) -> Hashable | None:
    """What runs have in common that may be computed together; None where a run may not."""
    method = system.method
    wheel = system.wheel
    sliding = system.initial.vx - system.belt_speed
    kind = method.scheme, method.theta, method.start, method.iteration, system.evaluator
    if kind != ("three-layer", NUMEROV, "consistent", "newton", "midpoint") or not 0 < len(wheel.g) <= WAVES:
        return None
    # tables at the nodes, and steps between two samples
    large = system.samples > MOST_SAMPLES or system.table_bytes > 1e8 or system.per_sample > 1e9
    if not system.steady or sliding == 0.0 or large:
        return None
    if system.passing_frequency * system.sampled_duration > 1e6:  # their phase needs more than 16 digits
        return None
    grid = system.interval, system.per_sample, system.samples
    return system.half_length, system.shoe, wheel, system.nodes, *grid, system.tangents


@lru_cache(maxsize=4)
def _tables(
    half_length: float, shoe: Surface, wheel: Surface, nodes: int
) -> tuple[dict[str, float | Floats], Floats]:
    """What `Shared` holds of the surfaces, by its names, and the table of an even number of nodes."""
    pad, tables = build_pad(1.0, half_length, shoe, wheel, nodes)
    half = nodes // 2
    waves = np.zeros((WAVES, 3))
    table = aligned(half * (2 + 2 * WAVES)).reshape(half, -1)
    own = len(wheel.g)
    full_at = int(pad.full_at)
    waves_at = int(pad.waves_at)
    columns = int(pad.columns)
    waves[:own] = np.stack([wheel.omega, wheel.phase, tables[full_at : full_at + own]], axis=1)
    by_tiles = tables[waves_at : waves_at + 2 * own * columns].reshape(-1, own, 2, TILE)
    f1 = _means(tables[pad.nodes_at + BESIDE : pad.nodes_at + BESIDE + nodes + 1])
    table[:, 0] = f1[:half]
    table[:, 1] = f1[: -half - 1 : -1]
    for wave, function in np.ndindex(own, 2):
        right = _means(by_tiles[:, wave, function].ravel()[: half + 1])
        table[:, 2 + function * WAVES + wave] = right[::-1] * (-1.0, 1.0)[function]
    numbers: dict[str, float | Floats] = {
        "length": 2.0 * half_length,
        "full_up_to": float(pad.full_up_to),
        "clear_from": float(pad.clear_from),
        "shoe_mean": float(pad.shoe_mean),
        "waves": waves.T,
    }
    return numbers, table


def _means(edges: Floats) -> Floats:
    """Means over cells from heights at their edges."""
    return 0.5 * (edges[:-1] + edges[1:])


def run_together(systems: Sequence[System]) -> list[Motion | None]:
    """The motions of systems that fit together; None where one has to be solved alone.

    The motions know their own error; their energy is not accounted for. Where the systems ask for `tangents`, they
    have an exponent.
    """
    firsts = range(0, len(systems), LANES)
    return [motion for first in firsts for motion in _run_lanes(list(systems[first : first + LANES]))]


def _run_lanes(systems: list[System]) -> list[Motion | None]:
    load(advance)
    begin = time.perf_counter()
    alike = systems[0]
    number = len(systems)
    o = filled([*systems, *systems[-1:] * (LANES - number)])
    rows = np.zeros((alike.samples + 1, len(HISTORY), LANES))
    carried = alike.tangents and alike.samples >= FEWEST_SAMPLES
    sizes = np.ones((PARTS if carried else 0, LANES))
    advance(o, *shared(alike), rows, sizes)
    histories = np.ascontiguousarray(rows.T)
    exponents = _exponents(sizes, alike.sampled_duration) if carried else repeat(None)
    seconds = (time.perf_counter() - begin) / number
    motions = list[Motion | None]()
    for n, (system, exponent) in enumerate(zip(systems, exponents, strict=False)):
        evaluations = int(o.evaluations[n])
        work = Work(steps=system.steps, contact_evaluations=evaluations, solve_seconds=seconds)
        own = OwnError(o.worst[None, :, :, n], 0.0 if o.unsure[n] else math.inf, None)
        motion = Motion(system, histories[n].T, work, NOT_KEPT, exponent, own=own)
        motions.append(motion if o.alive[n] else None)
    return motions


def _exponents(sizes: Floats, duration: float) -> list[Exponent]:
    """The exponents of all lanes; they mean nothing where a lane is out."""
    with np.errstate(invalid="ignore"):
        return exponents(np.log(sizes), duration)


def shared(system: System) -> tuple[Shared, Floats, Floats]:
    """What a system has in common with others beside it, its table, and room for the gaps."""
    made = new(Shared)
    values, table = _tables(system.half_length, system.shoe, system.wheel, system.nodes)
    values = values | {"h": system.step, "rate": 1.0 / system.step, "per_sample": system.per_sample}
    values |= {"nodes": system.nodes, "signals": np.frombuffer(stop.memory, np.uint8).ctypes.data}
    for name, value in values.items():
        setattr(made, name, value)
    return made, table, aligned(LANES * (system.nodes + 6)).reshape(-1, 2 * LANES)


def filled(systems: Sequence[System]) -> Lane:
    """Systems in their lanes; one without a start, or that (13) contracts too little for, is out."""
    columns = np.array([system.coefficients for system in systems]).T
    c = Coefficients(**dict(zip(Coefficients._fields, columns, strict=True)))
    start, off = (np.array(pairs).T for pairs in zip(*map(_start, systems), strict=True))
    h = systems[0].step
    wheel = systems[0].wheel
    load, belt, k = np.array(
        [(system.load_at_start, system.belt_speed, system.layer_stiffness) for system in systems]
    ).T
    side = np.sign(start[2] - belt)
    grip = -side * c.phi
    now = 1.0 - THETA_1
    a_11 = 2.0 * c.m / h + now * c.b_xx + 2.0 * THETA_1 * h * c.c_xx  # Eq. (14)
    a_12 = now * c.b_xy + 2.0 * THETA_1 * h * c.c_xy
    a_22 = 2.0 * c.m / h + now * c.b_yy + 2.0 * THETA_1 * h * c.c_yy
    a = a_11 * a_22 - a_12 * a_12
    moves = np.abs(a_11 - a_12 * grip)  # y by the force, over a; then x by it, on the steepest slope
    moves += float(np.abs(wheel.g) @ wheel.omega) * np.abs(a_22 * grip - a_12)
    factor = 2.0 * THETA_1 * h * 2.0 * systems[0].half_length * k * moves / a  # whichever part touches
    allowed = LEFT * np.array([system.method.tolerance for system in systems]) * np.abs(load)
    o: Lane = aligned(Lane.layout.itemsize // 8).view(Lane.layout)[0]
    values = {**c._asdict(), "belt": belt, "k": k, "side": side, "grip": grip}
    values |= {"i_11": a_22 / a, "i_12": -a_12 / a, "i_22": a_11 / a, "limit": allowed * (1.0 - factor) / factor}
    values["answer"] = 2.0 * THETA_1 * h * 2.0 * systems[0].half_length * k * (a_11 - a_12 * grip) / a
    values |= {"at_x": start[0], "at_y": start[1], "alive": (factor < 0.1) & ~np.isnan(start[0])}  # of (13)
    for name, value in values.items():
        setattr(o, name, value)
    o.motion.x, o.motion.y, o.motion.d, o.motion.e = start
    for levels in o.motion, o.coarse:
        levels.source_x = -load * c.sin_beta
        levels.source_y = -load * c.cos_beta
    o.turns[: len(wheel.g)] = np.outer(wheel.turns, belt)
    error = o.by_steps
    error.x, error.y = np.transpose([system.start_error or (0.0, 0.0) for system in systems])
    error.x_old = error.x
    error.y_old = error.y
    nodes = o.by_nodes
    nodes.x, nodes.y = nodes.x_old, nodes.y_old = off
    _seed(o.disturbed, np.sqrt((c.c_xx + c.c_yy + 2.0 * systems[0].half_length * k) / c.m), h)
    return o


def _seed(disturbed: Levels, rate: Floats, h: float) -> None:
    """Begin with disturbances as `tangent.seed` does; the forces of their first levels know nothing of them."""
    disturbed.x = disturbed.y = 0.5 / rate
    disturbed.d[:] = disturbed.d_old[:] = 0.5
    disturbed.e[:] = disturbed.e_old[:] = -0.5
    disturbed.x_old = disturbed.x - 0.5 * h
    disturbed.y_old = disturbed.y + 0.5 * h


def _start(system: System) -> tuple[Start, tuple[float, float]]:
    """x, y, vx and vy at t = 0, NaN where there is no steady sliding to start from; how far nodes put it off."""
    initial = system.initial
    start = initial.x, initial.y, initial.vx, initial.vy
    if not initial.from_equilibrium:
        return start, (0.0, 0.0)
    if (equilibrium := sliding(system)) is None:
        return (math.nan, math.nan, initial.vx, initial.vy), (0.0, 0.0)
    off = (0.0, 0.0) if system.start_error is None else off_by_nodes(system, equilibrium)
    return (initial.x + equilibrium.x, initial.y + equilibrium.y, initial.vx, initial.vy), off
