"""Random cases, as plain tables, of ten kinds of motion; what a case does is known from the reference alone."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.statistics.reference import Tables, quick, rate_of, shoe_of

KINDS = (
    "smooth, sliding",
    "smooth, sticking or bouncing",
    "rough, full contact",
    "rough, open",
    "rough, open, sticking",
    "near grazing",
    "reversing speed",
    "load steps",
    "amplifying",
    "without friction",
)
PER_PERIOD = 20.0  # samples per period of the fastest natural motion, about
MOST_TRIES = 400
# powers of ten of tolerances
LOOSEST = -2.0
TIGHTEST = -10.0


@dataclass(frozen=True)
class Drawn:
    """A case with its kind; `seed` of its generator, by which it can be drawn again."""

    kind: str
    seed: tuple[int, ...]
    tolerance: float
    tables: Tables


def draw(kind: str, *seed: int) -> Drawn:
    """The case of a kind that belongs to a seed. Tables are drawn until one does what the kind says."""
    rng = np.random.default_rng((*seed, KINDS.index(kind)))
    tolerance = float(10.0 ** rng.uniform(TIGHTEST, LOOSEST))
    for tables in _tries(rng, kind, tolerance):
        if _fits(tables, kind):
            return Drawn(kind, seed, tolerance, tables)
    raise RuntimeError(f"{kind}, {seed}: none of {MOST_TRIES} cases does what the kind says")


def _tries(rng: np.random.Generator, kind: str, tolerance: float) -> Iterator[Tables]:
    for _ in range(MOST_TRIES):
        if kind == "near grazing":
            tables = _grazing(rng)
            if tables is None:
                continue
        else:
            tables = MAKERS[kind](rng)
        tables["solver"]["tolerance"] = tolerance
        yield tables


def _fits(tables: Tables, kind: str) -> bool:
    """Whether a motion is one of its kind: it neither overflows nor lacks the events that the kind names."""
    found = quick(tables)
    if found is None or not np.isfinite(found[0]).all() or np.abs(found[0]).max() > 1e3:
        return False
    sticks, turns, lifts, opened, _ = found[1]
    if kind == "smooth, sliding":
        return not sticks + turns + lifts
    if kind == "smooth, sticking or bouncing":
        return bool(sticks + lifts)
    if kind == "rough, full contact":
        return not opened + lifts
    if kind == "rough, open":
        return bool(opened) and not sticks
    if kind == "rough, open, sticking":
        return bool(opened) and bool(sticks)
    if kind in ("reversing speed", "load steps"):
        return bool(sticks + turns + lifts + opened)
    return True


def _flat(
    rng: np.random.Generator, speed: tuple[float, float], friction: tuple[float, float] = (0.1, 1.0)
) -> Tables:
    """A smooth case; the speed of the wheel's surface (powers of ten, m/s) and the friction lie between bounds."""
    mass = 10.0 ** rng.uniform(-0.5, 1.5)
    c_1 = 10.0 ** rng.uniform(6.0, 7.5)
    whole = c_1 * 10.0 ** rng.uniform(-1.0, 0.7)
    c_2 = (c_1 + whole) * 10.0 ** rng.uniform(-0.4, 0.3)
    damping = 10.0 ** rng.uniform(-3.0, -1.3) * math.sqrt(mass) if rng.uniform() < 0.85 else 0.0
    a = 0.05 * 10.0 ** rng.uniform(-0.5, 0.3)
    load = 10.0 ** rng.uniform(2.0, 3.7)
    return {
        "shoe": {"mass": mass},
        "wheel": {"radius": 0.5, "angular_speed": 2.0 * 10.0 ** rng.uniform(*speed)},
        "link1": {"stiffness": c_1, "damping": damping * math.sqrt(c_1), "angle_deg": rng.uniform(-30.0, 30.0)},
        "link2": {"stiffness": c_2, "damping": damping * math.sqrt(c_2), "angle_deg": rng.uniform(-30.0, 30.0)},
        "load": {"force": load},
        "friction": {"coefficient": rng.uniform(*friction)},
        "contact": {"half_length": a, "stiffness": whole / (2.0 * a)},
        "solver": {},
        "output": {},
    }


def _timed(tables: Tables, rng: np.random.Generator, least: float, most: float) -> Tables:
    """With a duration of so many periods, and samples to them, whose interval has no round number."""
    omega = rate_of(shoe_of(tables))
    interval = 2.0 * math.pi / omega / PER_PERIOD * 10.0 ** rng.uniform(-0.3, 0.3)
    samples = max(
        8, round(2.0 * math.pi / omega * 10.0 ** rng.uniform(math.log10(least), math.log10(most)) / interval)
    )
    tables["output"]["sample_interval"] = interval
    tables["solver"]["duration"] = samples * interval
    return tables


def _compression(tables: Tables) -> float:
    """Of the layer under the load, m, with a stiff suspension taking its part."""
    shoe = shoe_of(tables)
    load = tables["load"]
    force = load["force"] if "force" in load else float(np.mean(load["forces"]))
    return float(abs(force) / (shoe.c_yy + 2.0 * shoe.a * shoe.k))


def _rough(tables: Tables, rng: np.random.Generator, low: float, high: float) -> Tables:
    """With surfaces whose heights are the compression times ten to a power between two bounds."""
    height = _compression(tables) * 10.0 ** rng.uniform(low, high)
    surfaces = [("shoe", "wheel"), ("wheel",), ("shoe",)][rng.choice(3, p=(0.6, 0.3, 0.1))]
    tables["roughness"] = {}
    for name in surfaces:
        waves = int(rng.integers(1, 4))
        tables["roughness"][name] = {
            "amplitudes": [float(value) for value in height * rng.uniform(0.2, 1.0, waves) / waves],
            "wavelengths": [float(value) for value in 0.03 * 10.0 ** -rng.uniform(0.0, 0.9, waves)],
        }
        if rng.uniform() < 0.5:
            tables["roughness"][name]["phases_deg"] = [float(value) for value in rng.uniform(0.0, 360.0, waves)]
    return tables


def _settled(tables: Tables, rng: np.random.Generator, away: float) -> Tables:
    """With a start beside steady sliding in full contact, by up to a part of the compression."""
    shoe = shoe_of(tables)
    K = 2.0 * shoe.a * shoe.k
    Q = tables["load"].get("force", 0.0)
    # The wheel moves faster than the shoe: F_x = φ F_y. The surface of the shoe adds a constant to the force.
    own = shoe.k * shoe.area_1
    x, y = np.linalg.solve(
        np.array([[shoe.c_xx, shoe.c_xy + shoe.phi * K], [shoe.c_xy, shoe.c_yy + K]]),
        np.array([-Q * shoe.sin_beta - shoe.phi * own, -Q * shoe.cos_beta - own]),
    )
    far = away * _compression(tables)
    tables["initial"] = {
        "x": float(x + far * rng.uniform(-1.0, 1.0)),
        "y": float(y + far * rng.uniform(-1.0, 1.0)),
    }
    return tables


def _sliding(rng: np.random.Generator) -> Tables:
    tables = _flat(rng, (-0.3, 0.7))
    return _timed(tables if rng.uniform() < 0.5 else _settled(tables, rng, 0.5), rng, 5.0, 200.0)


def _sticking(rng: np.random.Generator) -> Tables:
    tables = _flat(rng, (-2.5, -0.3))
    if rng.uniform() < 0.4:  # thrown off the wheel
        tables["initial"] = {"vy": float(10.0 ** rng.uniform(-2.0, 0.0)), "y": 0.0}
    return _timed(tables, rng, 5.0, 120.0)


def _full(rng: np.random.Generator) -> Tables:
    return _timed(_settled(_rough(_flat(rng, (-1.5, 0.7)), rng, -2.0, -0.7), rng, 0.1), rng, 5.0, 120.0)


def _open(rng: np.random.Generator) -> Tables:
    tables = _rough(_flat(rng, (-1.0, 0.7)), rng, -0.3, 0.5)
    return _timed(tables if rng.uniform() < 0.6 else _settled(tables, rng, 0.3), rng, 1.5, 6.0)


def _open_sticking(rng: np.random.Generator) -> Tables:
    return _timed(_rough(_flat(rng, (-2.5, -0.5)), rng, -0.3, 0.5), rng, 1.5, 6.0)


def _without_friction(rng: np.random.Generator) -> Tables:
    tables = _flat(rng, (-1.0, 0.7), (0.0, 0.0))
    if rng.uniform() < 0.4:
        return _timed(tables, rng, 5.0, 120.0)
    if rng.uniform() < 0.5:
        return _timed(_settled(_rough(tables, rng, -2.0, -0.7), rng, 0.1), rng, 5.0, 60.0)
    return _timed(_rough(tables, rng, -0.3, 0.3), rng, 1.5, 4.0)


def _any_surface(tables: Tables, rng: np.random.Generator) -> Tables:
    """Smooth, rough and closed, or rough and open, with a duration that the reference can follow."""
    chance = rng.uniform()
    if chance < 0.45:
        return _timed(tables, rng, 5.0, 60.0)
    if chance < 0.7:
        return _timed(_rough(tables, rng, -2.0, -0.7), rng, 4.0, 30.0)
    return _timed(_rough(tables, rng, -0.3, 0.3), rng, 1.5, 4.0)


def _reversing(rng: np.random.Generator) -> Tables:
    tables = _any_surface(_flat(rng, (-1.5, 0.3)), rng)
    duration = tables["solver"]["duration"]
    knots = int(rng.integers(2, 6))
    speed = tables["wheel"].pop("angular_speed")
    times = np.sort(rng.uniform(0.0, duration, knots))
    signs = np.where(np.arange(knots) % 2, -1.0, 1.0) * rng.choice([-1.0, 1.0])
    speeds = speed * signs * rng.uniform(0.1, 1.0, knots)
    if rng.uniform() < 0.3:  # a stop
        speeds[-1] = 0.0
    tables["wheel"] |= {"times": [float(t) for t in times], "angular_speeds": [float(v) for v in speeds]}
    return tables


def _load_steps(rng: np.random.Generator) -> Tables:
    tables = _any_surface(_flat(rng, (-1.5, 0.3)), rng)
    duration = tables["solver"]["duration"]
    period = tables["output"]["sample_interval"] * PER_PERIOD
    force = tables["load"].pop("force")
    times = [0.0]
    forces = [1.0]
    for begin in np.sort(rng.uniform(0.05, 0.95, int(rng.integers(1, 4)))) * duration:
        if begin <= times[-1]:
            continue
        level = float(rng.choice([0.0, rng.uniform(0.2, 3.0), -rng.uniform(0.0, 0.3)], p=(0.2, 0.65, 0.15)))
        times += [float(begin), float(begin + period * 10.0 ** rng.uniform(-3.0, 0.0))]
        forces += [forces[-1], level]
    tables["load"] = {"times": times, "forces": [force * each for each in forces]}
    return tables


def _amplifying(rng: np.random.Generator) -> Tables:
    """Self-excited, for long: growth, then stick, slip and lift-off, some of it chaotic."""
    tables = _flat(rng, (-2.0, 0.3), (0.5, 1.2))
    tables["link1"]["angle_deg"] = rng.uniform(-10.0, 40.0)
    tables["link2"]["angle_deg"] = rng.uniform(0.0, 40.0)
    if rng.uniform() < 0.3:
        return _timed(_rough(tables, rng, -0.5, 0.3), rng, 3.0, 6.0)
    return _timed(_settled(tables, rng, 10.0 ** rng.uniform(-6.0, 0.0)), rng, 40.0, 250.0)


def _grazing(rng: np.random.Generator) -> Tables | None:
    """A motion that nearly touches an event, or just has it: stick by the wheel's speed, lift-off by the start.

    The value beyond which there is an event is found by halves; the case lies beside it by 1e-2 to 1e-10 of it.
    """
    tables = _flat(rng, (-1.0, 0.5))
    rough = rng.uniform() < 0.4
    if rough:
        _rough(tables, rng, -2.0, -0.8)
    _timed(_settled(tables, rng, 0.3), rng, 3.0, 20.0)
    lift = bool(rng.uniform() < 0.5)

    def with_value(value: float) -> Tables:
        return tables | ({"initial": {**tables["initial"], "vy": value}} if lift else _speed(tables, value))

    def happens(value: float) -> bool:
        found = quick(with_value(value))
        if found is None:
            return True
        sticks, turns, lifts, opened, _ = found[1]
        return bool(lifts + opened if lift else sticks + turns)

    size = _compression(tables) * rate_of(shoe_of(tables))
    quiet, busy = (0.0, 3.0 * size) if lift else (40.0 * size, 1e-3 * size)
    if happens(quiet) or not happens(busy):
        return None
    for _ in range(40):
        middle = 0.5 * (quiet + busy)
        quiet, busy = (quiet, middle) if happens(middle) else (middle, busy)
    return with_value(busy * (1.0 + float(rng.choice([-1.0, 1.0])) * 10.0 ** rng.uniform(-10.0, -2.0)))


def _speed(tables: Tables, value: float) -> dict[str, Any]:
    return {"wheel": {**tables["wheel"], "angular_speed": value / tables["wheel"]["radius"]}}


MAKERS: dict[str, Callable[[np.random.Generator], Tables]] = {
    "smooth, sliding": _sliding,
    "smooth, sticking or bouncing": _sticking,
    "rough, full contact": _full,
    "rough, open": _open,
    "rough, open, sticking": _open_sticking,
    "reversing speed": _reversing,
    "load steps": _load_steps,
    "amplifying": _amplifying,
    "without friction": _without_friction,
}
