"""Random shoes, what becomes of each by means that share nothing with the rules of the regimes, and the score.

The answers come from the eigenvalues of the linear system, built here from the equations, where the motion neither
sticks nor opens; otherwise from a run eight times longer, from the same shoe without roughness, and from a second
start. The verdict is that of `brakecli run`, by what it writes.
"""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.files.read import open_result
from brakecli.runs.run import run
from brakecli.solver.motion import solve
from brakecli.solver.quantities import HISTORY

Tables = dict[str, Any]
Rows = NDArray[np.float64]
X, Y, VX, VY, FRICTION, NORMAL, FRACTION, STATE = range(len(HISTORY))
STICK, SEPARATED = 0.0, 2.0
LONGER = 8
EIGHTHS = 8
PER_PERIOD = 80  # steps of the fastest period or wave


@dataclass(frozen=True)
class Shoe:
    """The numbers of the equations (6)-(7) and of steady sliding in full contact, from the tables of a case."""

    m: float
    c: Rows  # stiffness of the links
    b: Rows  # damping of the links
    pull: Rows  # of the load, N
    k: float  # 2ak, N/m
    phi: float
    belt: float  # m/s

    @classmethod
    def of(cls, tables: Tables) -> "Shoe":
        """Build the matrices of the page on the model."""
        one, two, wheel = tables["link1"], tables["link2"], tables["wheel"]
        beta, alpha = math.radians(one.get("angle_deg", 0.0)), math.radians(two.get("angle_deg", 0.0))
        along_1, along_2 = (
            np.array([math.sin(beta), math.cos(beta)]),
            np.array([math.cos(alpha), -math.sin(alpha)]),
        )
        first, second = np.outer(along_1, along_1), np.outer(along_2, along_2)
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
    def stiffness(self) -> Rows:
        """Stiffness of sliding in full contact: F_y = -K y and F_x = φ F_y sign(U)."""
        return self.c + self.k * np.array([[0.0, math.copysign(self.phi, self.belt)], [0.0, 1.0]])

    @property
    def modes(self) -> NDArray[np.complex128]:
        """Eigenvalues of (6)-(7), 1/s, the least stable first."""
        zero, one = np.zeros((2, 2)), np.eye(2)
        scale = math.sqrt(float(np.abs(self.stiffness).max()) / self.m)  # rad/s: the matrix is of the order of one
        lower = [-self.stiffness / (self.m * scale**2), -self.b / (self.m * scale)]
        found = scale * np.linalg.eigvals(np.block([[zero, one], lower]))
        return np.asarray(found[np.argsort(-found.real)])

    @property
    def fast(self) -> float:
        """Frequency of the fastest mode, Hz."""
        return float(np.abs(self.modes).max()) / (2.0 * math.pi)

    @property
    def rest(self) -> Rows:
        """(x, y) of steady sliding."""
        return np.linalg.solve(self.stiffness, -self.pull)

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
        low, high = max(float(unstable[0]) - 0.01, 0.0), float(unstable[0])
        for _ in range(30):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if replace(self, phi=middle).rate > 0.0 else (middle, high)
        return high


def without_roughness(tables: Tables) -> Tables:
    """The same shoe on smooth surfaces."""
    return {name: table for name, table in tables.items() if name != "roughness"}


def with_start(tables: Tables, **start: Any) -> Tables:
    """The same shoe from another start."""
    return {**tables, "initial": {**tables.get("initial", {}), **start}}


def history(tables: Tables, times: int) -> Rows | None:
    """The samples of a run so many times longer; None where it fails."""
    system = system_of(parse_case(tomli_w.dumps(tables), "score").case)
    motion = solve(replace(system, duration=times * system.duration))
    return None if motion.work.failed else motion.rows


def linear(rows: Rows, shoe: Shoe) -> bool:
    """Whether a motion slides one way in full contact throughout, so that the equations are linear."""
    slides = shoe.phi == 0.0 or (rows[:, STATE] == -math.copysign(1.0, shoe.belt)).all()
    return bool(shoe.belt != 0.0 and slides and (rows[:, FRACTION] > 1.0 - 1e-9).all())


def levels(rows: Rows) -> Rows:
    """Standard deviation of vx in each eighth, m/s."""
    return np.array([part[:, VX].std() for part in np.array_split(rows, EIGHTHS)])


def last_eighth(rows: Rows) -> Rows:
    """The last eighth of the samples."""
    return rows[-(len(rows) // EIGHTHS) :]


def sticks_per_cycle(rows: Rows) -> float:
    """Sticks that begin, over rises of vx through its mean."""
    v, stick = rows[:, VX] - rows[:, VX].mean(), rows[:, STATE] == STICK
    high, low = v > 0.3 * v.std(), v < -0.3 * v.std()
    marks = np.where(high, 1, np.where(low, -1, 0))
    marks = marks[marks != 0]
    rises = int(np.count_nonzero(np.diff(marks) > 0))
    return float(np.count_nonzero(stick[1:] & ~stick[:-1])) / max(rises, 1)


@dataclass(frozen=True)
class Answer:
    """What becomes of a shoe, how that is known, and whether its settled motion sticks (None: not asked)."""

    name: str
    how: str
    sticks: float | None = None


def answer(tables: Tables, rows: Rows) -> Answer:
    """The answer to a case with the samples of its own run."""
    shoe = Shoe.of(tables)
    shaken = shoe.belt != 0.0 and "wheel" in tables.get("roughness", {})
    if linear(rows[len(rows) // 2 :], shoe):
        return linear_answer(tables, shoe, "eigenvalues")
    if not shaken:
        return flat_answer(tables) if "roughness" not in tables else opened_answer(tables, shoe)
    long = history(tables, LONGER)
    if long is None:
        return Answer("no answer", "the longer run failed")
    if linear(last_eighth(long), shoe):
        return linear_answer(tables, shoe, "eigenvalues at the end of the longer run")
    return at_rest(shoe, long) or shaken_answer(tables, shoe, long)


def opened_answer(tables: Tables, shoe: Shoe) -> Answer:
    """The answer to a rough shoe on a smooth wheel."""
    for times in (LONGER, LONGER**2):
        rows = history(tables, times)
        if rows is not None and (found := late_answer(shoe, rows)).name != "no answer":
            return found
    return Answer("no answer", "the longer run still changes")


def linear_answer(tables: Tables, shoe: Shoe, how: str) -> Answer:
    """What the sign of the slowest mode says, where the slopes of the surfaces cannot change it."""
    shaken = "wheel" in tables.get("roughness", {})
    rate, steep = shoe.rate, slope(tables) * 2.0 * math.pi * shoe.fast if shaken else 0.0
    how = f"{how}: {rate:.4g} 1/s"
    if steep > abs(rate):
        measured, change = measured_rate(tables)
        how += f"; two neighbours {measured:.4g} 1/s, by a factor of e^{change:.2g}"
        agree = 0.5 * rate**2 <= measured * rate <= 2.0 * rate**2 if rate else abs(change) < 0.1
        if not agree:
            return Answer("no answer", how)
    if rate > 0.0:
        return Answer("grows", how)
    if rate == 0.0:
        return Answer("neutral", how)
    return Answer("forced" if shaken else "dies", how, 0.0)


def slope(tables: Tables) -> float:
    """Largest slope of the wheel's surface as the whole pad feels it: the force changes by 2ak of it with x."""
    waves, half = tables["roughness"]["wheel"], tables["contact"]["half_length"]
    turns = 2.0 * math.pi / np.array(waves["wavelengths"])
    return float(np.sum(np.abs(waves["amplitudes"] * turns * np.sinc(turns * half / math.pi))))


def measured_rate(tables: Tables) -> tuple[float, float]:
    """Growth rate (1/s) of the difference of two neighbouring runs, and the power of e by which it has changed."""
    shoe, initial = Shoe.of(tables), tables["initial"]
    speed, size = initial.get("vx", 0.0), 2.0 * math.pi * shoe.fast * abs(float(shoe.rest[1]))
    one, other = history(tables, LONGER), history(with_start(tables, vx=speed + 1e-5 * size), LONGER)
    if one is None or other is None:
        return 0.0, 0.0
    apart = levels(one - other)
    kept = np.flatnonzero((apart > 1e-11 * size) & (apart < 1e-3 * size))
    if len(kept) < 2:
        return 0.0, 0.0
    change = math.log(apart[kept[-1]] / apart[kept[0]])
    return change / float(kept[-1] - kept[0]) / tables["solver"]["duration"], change


def late_answer(shoe: Shoe, long: Rows) -> Answer:
    """What the end of a long run on a smooth wheel shows: whether a motion is left, and whether it lasts."""
    last, level = last_eighth(long), levels(long)
    if left := at_rest(shoe, long):
        return left
    if linear(last, shoe):
        found = linear_answer({}, shoe, "eigenvalues at the end of the longer run")
        return replace(found, name="lasts", sticks=None) if found.name == "grows" else found
    if shoe.phi == 0.0:
        return Answer("dies" if shoe.b.any() else "neutral", "no friction")
    ratio = level[-1] / max(level[-2], 1e-300)
    how = f"longer run: vx in its last eighth {ratio:.3g} of that before, {level[-1]:.2g} m/s"
    sticks = sticks_per_cycle(last)
    if ratio > 0.99 and level[-1] > 0.97 * level[-4] and (shoe.rate > 0.0 or sticks > 0.5 or ratio > 0.999):
        return Answer("neutral" if shoe.rate == 0.0 and sticks < 0.5 else "lasts", how, sticks)
    if ratio < 0.9 and level[-2] < 0.9 * level[-3] < 0.81 * level[-4]:
        return Answer("dies", how)
    return Answer("no answer", how)


def at_rest(shoe: Shoe, long: Rows) -> Answer | None:
    """The answer where no motion is left at the end of a long run."""
    last, level = last_eighth(long), levels(long)
    if (last[:, STATE] == SEPARATED).all():
        return Answer("gone", "no contact at the end of the longer run")
    if (last[:, STATE] == STICK).all():
        return Answer("dies" if shoe.belt == 0.0 else "carried", "stick throughout at the end of the longer run")
    if level[-1] < 1e-9 * max(abs(shoe.belt), float(level.max())):
        return Answer("dies", f"vx is {level[-1]:.2g} m/s at the end of the longer run")
    return None


def shaken_answer(tables: Tables, shoe: Shoe, long: Rows) -> Answer:
    """Forced or self-excited, of a motion on a rough wheel that opens or sticks for ever."""
    sticks = sticks_per_cycle(last_eighth(long))
    by_friction, by_roughness, open_account = powers(shoe, long)
    if shoe.phi == 0.0:
        return Answer("forced" if shoe.b.any() else "not self-excited", "no friction", sticks)
    flat = flat_answer(tables).name
    speed = tables["initial"].get("vx", 0.0)
    other = history(with_start(tables, vx=speed + 0.05 * float(long[:, VX].std()), y=0.0), LONGER)
    low = history({**tables, "friction": {"coefficient": 0.3 * min(shoe.phi, shoe.critical or 1.0)}}, LONGER)
    if other is None or low is None:
        return Answer("no answer", "a run beside it failed")
    level = float(last_eighth(long)[:, VX].std())
    apart = float((last_eighth(long) - last_eighth(other))[:, VX].std()) / level
    times = level / float(last_eighth(low)[:, VX].std())
    how = (
        f"without roughness {flat}; two starts end {apart:.1g} apart; {times:.2g} times the level at low friction"
    )
    how += f"; friction gives {by_friction:.2g} W and roughness {by_roughness:.2g} W ± {open_account:.2g}"
    stable, damped = flat in ("dies", "neutral"), bool(shoe.b.any())
    if damped and (stable or times < 2.0) and by_friction < -2.0 * open_account:  # friction only takes
        return Answer("forced", how, sticks)
    if stable and (apart < 1e-3 or by_roughness > 2.0 * max(by_friction, 0.0) + 2.0 * open_account):
        return Answer("forced" if damped else "not self-excited", how, sticks)
    if flat == "lasts" and apart < 1e-3 and 0.7 < times < 1.4:
        return Answer("forced", how, sticks)  # the roughness holds the shoe's own vibration down
    pays = by_friction > 2.0 * max(by_roughness, 0.0) + 2.0 * open_account
    pays = pays or (not damped and by_friction > -2.0 * open_account)
    if flat == "lasts" and pays and times > 1.4 and (apart > 1e-2 or times > 3.0):
        return Answer("lasts", how, sticks)
    return Answer("no answer", how, sticks)


def flat_answer(tables: Tables) -> Answer:
    """The answer to the same shoe on smooth surfaces; the run is made longer until it has one."""
    flat, shoe = without_roughness(tables), Shoe.of(tables)
    found = Answer("no answer", "")
    for times in (LONGER, LONGER**2):
        rows = history(flat, times)
        found = Answer("no answer", "the longer run failed") if rows is None else late_answer(shoe, rows)
        if found.name != "no answer":
            break
    return found


def powers(shoe: Shoe, rows: Rows) -> tuple[float, float, float]:
    """Mean powers that friction and the roughness give to the shoe, and by how much they miss its losses, W."""
    part = rows[len(rows) // 2 :]
    v = part[:, [VX, VY]]
    lost = float(np.einsum("ti,ij,tj->", v, shoe.b, v)) / len(v)
    mean = v.mean(axis=0)
    given = [float(part[:, f] @ (v[:, i] - mean[i])) / len(v) for i, f in enumerate((FRICTION, NORMAL))]
    return given[0], given[1], abs(sum(given) - lost)


SUSTAINED = ("relaxation", "quasi-harmonic")
WRONG: dict[str, dict[str, str]] = {  # answer: what may not be said of it, and why
    "dies": {"sustained": "sustained is said of what dies", "forced": "forced is said of a smooth wheel"},
    "carried": {"sustained": "sustained is said of a shoe that is carried along"},
    "gone": {"sustained": "sustained is said of a shoe that has left"},
    "neutral": {
        "none": "died out is said of what neither grows nor decays",
        "sustained": "sustained, of a neutral one",
    },
    "grows": {
        "none": "died out is said of what grows",
        "forced": "forced is said of what grows by itself",
        "sustained": "settled is said of what still grows",
    },
    "swells": {"none": "died out is said of what grows", "forced": "forced is said of what grows by itself"},
    "lasts": {"none": "died out is said of what lasts", "forced": "forced is said of what is self-excited"},
    "forced": {
        "none": "died out is said of what the roughness shakes",
        "sustained": "self-excited, of what is forced",
    },
    "not self-excited": {"sustained": "self-excited is said of what friction does not excite"},
    "no answer": {},
}


def said(numbers: dict[str, Any]) -> str:
    """A verdict in a word."""
    if numbers["regime"] in SUSTAINED:
        return "sustained"
    if numbers["regime"] == "damped":
        return "forced" if numbers["excitation"] == "forced" else "none"
    return "undecided"


def wrong(tables: Tables, numbers: dict[str, Any], rows: Rows, true: Answer) -> str | None:
    """Why a verdict contradicts the answer, or None."""
    word = said(numbers)
    why = WRONG[true.name].get(word)
    if true.name == "neutral" and word == "forced" and own_share(tables, rows) > 0.5:
        return "forced is said of a vibration most of which is the shoe's own, which does not die"
    if why and true.name == "forced" and word == "none" and shaking(tables, rows) < 1e-3:
        return None
    if why is None and word == "sustained" and true.name in ("lasts", "swells"):
        sticks = sticks_per_cycle(rows[-(len(rows) // 4) :]), true.sticks
        if numbers["regime"] == "relaxation" and sticks == (0.0, 0.0):
            return "relaxation is said of what never sticks"
        if numbers["regime"] == "quasi-harmonic" and min(each or 0.0 for each in sticks) >= 0.9:
            return "quasi-harmonic is said of what sticks in every cycle"
    return why


def shaking(tables: Tables, rows: Rows) -> float:
    """Half of peak to peak of the x that lasts, over the static compression and displacement."""
    size = float(np.abs(Shoe.of(tables).rest).max())
    return 0.5 * float(np.ptp(last_eighth(rows)[:, X])) / size


def own_share(tables: Tables, rows: Rows) -> float:
    """Part of vx in the second half that the frequencies of the waves and the sums of two of them do not hold."""
    belt, part = Shoe.of(tables).belt, rows[len(rows) // 2 :]
    passing = [abs(belt) / length for length in tables["roughness"]["wheel"]["wavelengths"]]
    lines = {*passing, *(abs(f + s * g) for f in passing for g in passing for s in (-1.0, 1.0))}
    time = 2.0 * math.pi * tables["output"]["sample_interval"] * np.arange(len(part))
    basis = np.stack([one(f * time) for f in sorted(lines) for one in (np.cos, np.sin)], axis=1)
    left = part[:, VX] - basis @ np.linalg.lstsq(basis, part[:, VX], rcond=None)[0]
    return float(left.std() / part[:, VX].std())


def verdict(tables: Tables, folder: Path) -> tuple[Tables, dict[str, Any], Rows] | None:
    """The case, what `brakecli run` says of it, and its samples; None where the run fails at three steps."""
    path = folder / "score.h5"
    for finer in (1, 3, 3):
        tables = {**tables, "solver": {**tables["solver"], "step": tables["solver"]["step"] / finer}}
        numbers = run(parse_case(tomli_w.dumps(tables), "score"), path, force=True).numbers()
        if not numbers["failure"]:
            with open_result(path) as result:
                columns = [result.read("history", name) for name in HISTORY]
            return tables, numbers, np.stack(columns, axis=1).astype(float)
    return None


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
    seconds, least = 0.5 * tables["solver"]["duration"], 10.0 ** rng.uniform(-3.0, -1.0)
    tables["initial"] = {"at": "equilibrium", "x": 1e-3 * abs(float(Shoe.of(tables).rest[1]))}
    for _ in range(60):
        if abs(Shoe.of(tables).rate) * seconds <= least:
            return
        tables["friction"] = {"coefficient": 0.8 * tables["friction"]["coefficient"]}
        for link in ("link1", "link2"):
            tables[link] = {**tables[link], "damping": 0.8 * tables[link]["damping"]}


def _links(rng: np.random.Generator, undamped: float) -> Tables:
    mass, c_1 = 10.0 ** rng.uniform(-1.0, 2.0), 10.0 ** rng.uniform(6.0, 8.0)
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
    depth, fast = abs(float(shoe.rest[1])), shoe.fast
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


BESIDE = ("neutral", "grows", "swells", "carried", "gone")  # answers of which nothing else may be said


@dataclass
class Score:
    """What was said of how many shoes with which answers, what was wrong, and how many runs failed."""

    said: Counter[tuple[str, str]]
    mistakes: list[tuple[Tables, dict[str, Any], Answer, str]]
    failed: int = 0

    @property
    def judged(self) -> int:
        """All of them."""
        return sum(self.said.values())

    @property
    def undecided(self) -> int:
        """How many stay undecided that are neither neutral nor still growing, and that have not left."""
        return sum(n for (true, word), n in self.said.items() if word == "undecided" and true not in BESIDE)


@cache
def score(stratum: str, count: int, seed: int) -> Score:
    """Judge so many random shoes."""
    found = Score(Counter(), [])
    with TemporaryDirectory() as folder:
        for drawn in islice(random_shoes(stratum, seed), count):
            told = verdict(drawn, Path(folder))
            if told is None:
                found.failed += 1
                continue
            tables, numbers, rows = told
            true = answer(tables, rows)
            if true.name == "lasts" and levels(rows)[-1] > 1.03 * levels(rows)[-2]:
                true = replace(true, name="swells")
            found.said[true.name, said(numbers)] += 1
            if why := wrong(tables, numbers, rows, true):
                found.mistakes.append((tables, numbers, true, why))
    return found
