"""What becomes of a shoe, by means that share nothing with the rules of the regimes.

The eigenvalues of the linear equations decide where the motion neither sticks nor opens, and two neighbouring runs
where a steep surface may change them. Otherwise a run decides that is eight times longer, beside the same shoe
without roughness, at low friction and from another start.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomli_w

from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.solver.integrate import solve
from brakecli.solver.quantities import HISTORY
from tests.analysis.shoes import Array, Shoe, Tables

X, Y, VX, VY, FRICTION, NORMAL, FRACTION, STATE = range(len(HISTORY))
STICK = 0.0
SEPARATED = 2.0
LONGER = 8
EIGHTHS = 8
FALLS = "longer run: vx"


def without_roughness(tables: Tables) -> Tables:
    """The same shoe on smooth surfaces."""
    return {name: table for name, table in tables.items() if name != "roughness"}


def with_start(tables: Tables, **start: Any) -> Tables:
    """The same shoe from another start."""
    return {**tables, "initial": {**tables.get("initial", {}), **start}}


def history(tables: Tables, times: int) -> Array | None:
    """The samples of a run so many times longer; None where it fails."""
    system = system_of(parse_case(tomli_w.dumps(tables), "score").case)
    motion = solve(replace(system, duration=times * system.duration))
    return None if motion.work.failed else motion.rows


def linear(rows: Array, shoe: Shoe) -> bool:
    """Whether a motion slides one way in full contact throughout, so that the equations are linear."""
    slides = shoe.phi == 0.0 or (rows[:, STATE] == -math.copysign(1.0, shoe.belt)).all()
    return bool(shoe.belt != 0.0 and slides and (rows[:, FRACTION] > 1.0 - 1e-9).all())


def levels(rows: Array) -> Array:
    """Standard deviation of vx in each eighth, m/s."""
    return np.array([part[:, VX].std() for part in np.array_split(rows, EIGHTHS)])


def last_eighth(rows: Array) -> Array:
    """The last eighth of the samples."""
    return rows[-(len(rows) // EIGHTHS) :]


def sticks_per_cycle(rows: Array) -> float:
    """Sticks that begin, over rises of vx through its mean."""
    v = rows[:, VX] - rows[:, VX].mean()
    stick = rows[:, STATE] == STICK
    high = v > 0.3 * v.std()
    low = v < -0.3 * v.std()
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


def answer(tables: Tables, rows: Array) -> Answer:
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
    rate = shoe.rate
    steep = slope(tables) * 2.0 * math.pi * shoe.fast if shaken else 0.0
    how = f"{how}: {rate:.4g} 1/s"
    if steep > abs(rate):
        measured, change = measured_rate(tables)
        how += f"; two neighbours {measured:.4g} 1/s, by a factor of e^{change:.2g}"
        agree = abs(change) < 0.1
        if rate:
            agree = change * rate > 0.0 and (abs(change) > 3.0 or 0.5 <= measured / rate <= 2.0)
        if not agree:
            return Answer("no answer", how)
    if rate > 0.0:
        return Answer("grows", how)
    if rate == 0.0:
        return Answer("neutral", how)
    return Answer("forced" if shaken else "dies", how, 0.0)


def slope(tables: Tables) -> float:
    """Largest slope of the wheel's surface as the whole pad feels it: the force changes by 2ak of it with x."""
    waves = tables["roughness"]["wheel"]
    half = tables["contact"]["half_length"]
    turns = 2.0 * math.pi / np.array(waves["wavelengths"])
    return float(np.sum(np.abs(waves["amplitudes"] * turns * np.sinc(turns * half / math.pi))))


def measured_rate(tables: Tables) -> tuple[float, float]:
    """Growth rate (1/s) of the difference of two neighbouring runs, and the power of e by which it has changed."""
    shoe = Shoe.of(tables)
    initial = tables["initial"]
    speed = initial.get("vx", 0.0)
    size = 2.0 * math.pi * shoe.fast * abs(float(shoe.rest[1]))
    one = history(tables, LONGER)
    other = history(with_start(tables, vx=speed + 1e-5 * size), LONGER)
    if one is None or other is None:
        return 0.0, 0.0
    apart = levels(one - other)
    kept = np.flatnonzero((apart > 1e-11 * size) & (apart < 1e-3 * size))
    if len(kept) < 2:
        return (0.0, 0.0) if apart[1] > 1e-11 * size else (-math.inf, -math.inf)
    change = math.log(apart[kept[-1]] / apart[kept[0]])
    return change / float(kept[-1] - kept[0]) / tables["solver"]["duration"], change


def late_answer(shoe: Shoe, long: Array) -> Answer:
    """What the end of a long run on a smooth wheel shows: whether a motion is left, and whether it lasts."""
    last = last_eighth(long)
    level = levels(long)
    if left := at_rest(shoe, long):
        return left
    if linear(last, shoe):
        found = linear_answer({}, shoe, "eigenvalues at the end of the longer run")
        return replace(found, name="swells") if found.name == "grows" else found
    if shoe.phi == 0.0:
        return Answer("dies" if shoe.b.any() else "neutral", "no friction")
    ratio = level[-1] / max(level[-2], 1e-300)
    how = f"{FALLS} in its last eighth {ratio:.3g} of that before, {level[-1]:.2g} m/s"
    sticks = sticks_per_cycle(last)
    if ratio > 0.99 and level[-1] > 0.97 * level[-4] and (shoe.rate > 0.0 or sticks > 0.5 or ratio > 0.999):
        return Answer("neutral" if shoe.rate == 0.0 and sticks < 0.5 else "lasts", how, sticks)
    if ratio < 0.9 and level[-2] < 0.9 * level[-3] < 0.81 * level[-4]:
        return Answer("dies", how)
    return Answer("no answer", how)


def at_rest(shoe: Shoe, long: Array) -> Answer | None:
    """The answer where no motion is left at the end of a long run."""
    last = last_eighth(long)
    level = levels(long)
    if (last[:, STATE] == SEPARATED).all():
        return Answer("gone", "no contact at the end of the longer run")
    if (last[:, STATE] == STICK).all():
        return Answer("dies" if shoe.belt == 0.0 else "carried", "stick throughout at the end of the longer run")
    if level[-1] < 1e-9 * max(abs(shoe.belt), float(level.max())):
        return Answer("dies", f"vx is {level[-1]:.2g} m/s at the end of the longer run")
    return None


def shaken_answer(tables: Tables, shoe: Shoe, long: Array) -> Answer:
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
    stable = flat in ("dies", "neutral")
    damped = bool(shoe.b.any())
    if damped and (stable or times < 2.0) and by_friction < -2.0 * open_account:  # friction only takes
        return Answer("forced", how, sticks)
    if stable and (apart < 1e-3 or by_roughness > 2.0 * max(by_friction, 0.0) + 2.0 * open_account):
        return Answer("forced" if damped else "not self-excited", how, sticks)
    pays = by_friction > 2.0 * max(by_roughness, 0.0) + 2.0 * open_account
    pays = pays or (not damped and by_friction > -2.0 * open_account)
    if flat == "lasts" and apart < 1e-3 and 0.7 < times < 1.4 and not pays:
        return Answer("forced", how, sticks)  # the roughness holds the shoe's own vibration down
    if flat == "lasts" and pays and times > 1.4 and (apart > 1e-2 or times > 3.0):
        return Answer("lasts", how, sticks)
    return Answer("no answer", how, sticks)


def flat_answer(tables: Tables) -> Answer:
    """The answer to the same shoe on smooth surfaces; the run is made longer until it has one.

    What only falls, even to a third, may fall to a limit cycle.
    """
    flat = without_roughness(tables)
    shoe = Shoe.of(tables)
    found = Answer("no answer", "")
    for times in (LONGER, LONGER**2):
        rows = history(flat, times)
        found = Answer("no answer", "the longer run failed") if rows is None else late_answer(shoe, rows)
        falls = found.name == "dies" and found.how.startswith(FALLS)
        if found.name != "no answer" and not falls:
            break
    return found


def powers(shoe: Shoe, rows: Array) -> tuple[float, float, float]:
    """Mean powers that friction and the roughness give to the shoe, and by how much they miss its losses, W."""
    part = rows[len(rows) // 2 :]
    v = part[:, [VX, VY]]
    lost = float(np.einsum("ti,ij,tj->", v, shoe.b, v)) / len(v)
    mean = v.mean(axis=0)
    given = [float(part[:, f] @ (v[:, i] - mean[i])) / len(v) for i, f in enumerate((FRICTION, NORMAL))]
    return given[0], given[1], abs(sum(given) - lost)
