"""Random shoes, in strata, and the linear equations of a sliding shoe, built here from the page on the model."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Tables = dict[str, Any]
Array = NDArray[np.float64]
PER_PERIOD = 80  # steps of the fastest period or wave


@dataclass(frozen=True)
class Shoe:
    """The numbers of the equations (6)-(7) and of steady sliding in full contact, from the tables of a case."""

    m: float
    c: Array  # stiffness of the links
    b: Array  # damping of the links
    pull: Array  # of the load, N
    k: float  # 2ak, N/m
    phi: float
    belt: float  # m/s

    @classmethod
    def of(cls, tables: Tables) -> "Shoe":
        """Build the matrices of the page on the model."""
        one = tables["link1"]
        two = tables["link2"]
        wheel = tables["wheel"]
        beta = math.radians(one.get("angle_deg", 0.0))
        alpha = math.radians(two.get("angle_deg", 0.0))
        along_1 = np.array([math.sin(beta), math.cos(beta)])
        along_2 = np.array([math.cos(alpha), -math.sin(alpha)])
        first = np.outer(along_1, along_1)
        second = np.outer(along_2, along_2)
        contact = tables["contact"]
        return cls(
            tables["shoe"]["mass"],
            one["stiffness"] * first + two["stiffness"] * second,
            one.get("damping", 0.0) * first + two.get("damping", 0.0) * second,
            tables["load"]["force"] * along_1,
            2.0 * contact["half_length"] * contact["stiffness"],
            tables["friction"]["coefficient"],
            wheel["angular_speed"] * wheel["radius"],
        )

    @property
    def stiffness(self) -> Array:
        """Stiffness of sliding in full contact: F_y = -K y and F_x = φ F_y sign(U)."""
        return self.c + self.k * np.array([[0.0, math.copysign(self.phi, self.belt)], [0.0, 1.0]])

    @property
    def modes(self) -> NDArray[np.complex128]:
        """Eigenvalues of (6)-(7), 1/s, the least stable first."""
        zero = np.zeros((2, 2))
        one = np.eye(2)
        scale = math.sqrt(float(np.abs(self.stiffness).max()) / self.m)  # rad/s: the matrix is of the order of one
        lower = [-self.stiffness / (self.m * scale**2), -self.b / (self.m * scale)]
        found = scale * np.linalg.eigvals(np.block([[zero, one], lower]))
        return np.asarray(found[np.argsort(-found.real)])

    @property
    def fast(self) -> float:
        """Frequency of the fastest mode, Hz."""
        return float(np.abs(self.modes).max()) / (2.0 * math.pi)

    @property
    def rest(self) -> Array:
        """(x, y) of steady sliding."""
        return np.asarray(np.linalg.solve(self.stiffness, -self.pull), dtype=np.float64)

    @property
    def rate(self) -> float:
        """Growth rate of the slowest mode, 1/s; 0 where it is rounding."""
        rate = float(self.modes[0].real)
        if not self.b.any():  # pairs ± of a matrix without damping: rounding, or flutter and divergence
            return rate if rate > 1e-6 * 2.0 * math.pi * self.fast else 0.0
        return rate

    @property
    def critical(self) -> float | None:
        """The least friction, up to 3, at which sliding is unstable."""
        grid = np.linspace(0.0, 3.0, 301)
        unstable = [phi for phi in grid if replace(self, phi=float(phi)).rate > 0.0]
        if not unstable:
            return None
        low = max(float(unstable[0]) - 0.01, 0.0)
        high = float(unstable[0])
        for _ in range(30):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if replace(self, phi=middle).rate > 0.0 else (middle, high)
        return high


STRATA = {
    "smooth": "smooth surfaces",
    "full": "rough surfaces, most in full contact",
    "open": "rough surfaces, most of which open",
    "frictionless": "the same without friction",
    "slow": "smooth or rough, whose slowest mode changes by less than 10 % in half of the run",
}
DAMPING = ("none", "light", "heavy", "one link")
STARTS = ("small", "rest", "hard")


def random_shoes(stratum: str, seed: int) -> Iterator[Tables]:
    """Shoes of a stratum: `STRATA` says what each is."""
    rng = np.random.default_rng([seed, *stratum.encode()])
    while True:
        tables = _links(rng, 0.07 if stratum in ("open", "frictionless") else 0.2)
        shoe = Shoe.of(tables)
        critical = shoe.critical
        if critical is None and rng.uniform() < 0.7:
            continue
        phi = (
            0.0 if rng.uniform() < 0.08 or stratum == "frictionless" else (critical or 0.7) * rng.uniform(0.0, 2.0)
        )
        tables["friction"] = {"coefficient": phi}
        shoe = Shoe.of(tables)
        if np.linalg.det(shoe.stiffness) <= 0.0 or shoe.rest[1] >= 0.0 or (stratum == "slow" and shoe.rate == 0.0):
            continue
        surfaces = {"frictionless": "open", "slow": str(rng.choice(["smooth", "full"]))}.get(stratum, stratum)
        _move(rng, tables, surfaces)
        if stratum == "slow":
            _slow_down(rng, tables)
        yield tables


def _slow_down(rng: np.random.Generator, tables: Tables) -> None:
    """Change dashpots and friction until the slowest mode changes little in half of the run."""
    seconds = 0.5 * tables["solver"]["duration"]
    least = 10.0 ** rng.uniform(-3.0, -1.0)
    tables["initial"] = {"at": "equilibrium", "x": 1e-3 * abs(float(Shoe.of(tables).rest[1]))}
    for _ in range(60):
        if abs(Shoe.of(tables).rate) * seconds <= least:
            return
        tables["friction"] = {"coefficient": 0.8 * tables["friction"]["coefficient"]}
        for link in ("link1", "link2"):
            tables[link] = {**tables[link], "damping": 0.8 * tables[link]["damping"]}


def _links(rng: np.random.Generator, undamped: float) -> Tables:
    mass = 10.0 ** rng.uniform(-1.0, 2.0)
    c_1 = 10.0 ** rng.uniform(6.0, 8.0)
    contact = c_1 * 10.0 ** rng.uniform(-1.0, 1.0)
    c_2 = (c_1 + contact) * 10.0 ** rng.uniform(-0.3, 0.3)
    kind = str(rng.choice(DAMPING, p=[undamped, 0.65 - undamped, 0.15, 0.2]))
    ratio = 10.0 ** (rng.uniform(-1.7, -0.7) if kind == "heavy" else rng.uniform(-4.0, -1.7))
    b = [2.0 * ratio * math.sqrt(mass * c) * 10.0 ** rng.uniform(-0.5, 0.5) for c in (c_1, c_2)]
    if kind == "none":
        b = [0.0, 0.0]
    elif kind == "one link":
        b[int(rng.integers(2))] = 0.0
    half = 10.0 ** rng.uniform(-2.0, -1.0)
    return {
        "shoe": {"mass": mass},
        "wheel": {"radius": 0.5, "angular_speed": float(rng.choice([-1.0, 1.0]))},
        "link1": {"stiffness": c_1, "damping": b[0], "angle_deg": rng.uniform(-30.0, 30.0)},
        "link2": {"stiffness": c_2, "damping": b[1], "angle_deg": rng.uniform(-30.0, 30.0)},
        "load": {"force": 10.0 ** rng.uniform(2.0, 4.0)},
        "friction": {"coefficient": 0.0},
        "contact": {"half_length": half, "stiffness": contact / (2.0 * half)},
    }


def _move(rng: np.random.Generator, tables: Tables, surfaces: str) -> None:
    """Give a shoe its wheel speed, roughness, start and time."""
    shoe = Shoe.of(tables)
    depth = abs(float(shoe.rest[1]))
    fast = shoe.fast
    slowest = -1.3 if surfaces == "full" else -2.5
    speed = 2.0 * math.pi * fast * depth * 10.0 ** rng.uniform(slowest, 1.0)  # of what lifts the pad off
    tables["wheel"]["angular_speed"] *= speed / 0.5 if surfaces != "smooth" or rng.uniform() > 0.03 else 0.0
    slowest = -1.3 if surfaces == "open" else -1.7
    passing = [fast * 10.0 ** rng.uniform(slowest, 0.5) for _ in range(int(rng.integers(1, 4)))]
    if surfaces != "smooth":
        high = depth * 10.0 ** (rng.uniform(-3.0, -0.6) if surfaces == "full" else rng.uniform(-0.3, 0.8))
        rough: Tables = {"wheel": _waves(rng, high, [speed / f for f in passing])}
        half = max(rough["wheel"]["wavelengths"]) * 10.0 ** rng.uniform(-1.0, 0.3)
        tables["contact"] = {"half_length": half, "stiffness": shoe.k / (2.0 * half)}
        if rng.uniform() < 0.3:
            rough["shoe"] = _waves(rng, 0.5 * high, [half * 10.0 ** rng.uniform(-0.5, 0.5)])
        if rng.uniform() < 0.05:
            rough = {"shoe": _waves(rng, high, [half])}
        tables["roughness"] = rough
    start = str(rng.choice(STARTS))
    tables["initial"] = {
        "small": {"at": "equilibrium", "x": 1e-3 * depth, "y": 1e-3 * depth},
        "rest": {"at": "rest"},
        "hard": {
            "at": "rest",
            "vx": float(rng.choice([-1.0, 1.0])) * speed * 10.0 ** rng.uniform(-0.3, 1.3),
            "y": depth * rng.uniform(-2.0, 2.0),
        },
    }[start]
    steps = PER_PERIOD * max(fast, *(passing if surfaces != "smooth" else [0.0]))
    periods = 10.0 ** rng.uniform(1.7, 2.7 if surfaces == "open" else 3.0)
    if surfaces != "smooth" and rng.uniform() < 0.8:
        periods = max(periods, 20.0 * fast / min(passing))
    tables["solver"] = {"step": 1.0 / steps, "duration": round(periods / fast * steps) / steps}
    tables["output"] = {"sample_interval": 2.0 / steps}


def _waves(rng: np.random.Generator, high: float, lengths: list[float]) -> Tables:
    parts = rng.uniform(0.2, 1.0, len(lengths))
    return {
        "amplitudes": [float(high * part / parts.sum()) for part in parts],
        "wavelengths": lengths,
        "phases_deg": [float(rng.uniform(0.0, 360.0)) for _ in lengths],
    }
