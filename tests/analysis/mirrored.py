"""Random rough shoes above the critical friction of their full contact, and the mirror images of cases."""

import math
from typing import Any

import numpy as np

from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.steady_sliding import sliding
from tests.analysis.shoes import Shoe, Tables
from tests.examples import make

PER_PERIOD = 150  # steps of the fast mode's period


def mirrored(tables: Tables) -> Tables:
    """The mirror image of a case: x, the wheel's way, both angles and all surfaces the other way round."""
    found: Tables = {name: dict(table) for name, table in tables.items()}
    found["wheel"]["angular_speed"] *= -1.0
    for link in ("link1", "link2"):
        found[link]["angle_deg"] = -found[link].get("angle_deg", 0.0)
    for name, waves in tables.get("roughness", {}).items():
        phases = waves.get("phases_deg", [0.0] * len(waves["amplitudes"]))
        found["roughness"][name] = {**waves, "phases_deg": [180.0 - phase for phase in phases]}
    for name in ("x", "vx"):
        if name in tables.get("initial", {}):
            found["initial"][name] *= -1.0
    return found


def longer(tables: Tables, times: float) -> Tables:
    """The same case, run for so many times as long."""
    return {**tables, "solver": {**tables["solver"], "duration": times * tables["solver"]["duration"]}}


def rough_shoe(seed: int) -> Tables:
    """A rough shoe above the critical friction of its full contact, run for 30 to 200 periods of link 1."""
    rng = np.random.default_rng([4747, seed])

    def between(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(math.log10(low), math.log10(high)))

    while True:
        mass = between(0.1, 50.0)
        one = between(3e5, 3e7)
        two = between(3e5, 3e7)
        rate = math.sqrt(one / mass)
        angle = float(rng.uniform(-30.0, 30.0))
        contact = between(0.25, 15.0) * (one + two)
        load = between(50.0, 5000.0)
        speed = between(0.02, 3.0) * load / contact * rate * float(rng.choice([-1.0, 1.0]))
        count = int(rng.integers(1, 4))
        waves = [2.0 * math.pi * abs(speed) / (rate * between(0.1, 6.0)) for _ in range(count)]
        half = between(0.1, 2.0) * max(waves)
        tables: dict[str, Any] = {
            "shoe": {"mass": mass},
            "wheel": {"radius": 0.4, "angular_speed": speed / 0.4},
            "link1": {
                "stiffness": one,
                "damping": 2.0 * between(1e-3, 2e-2) * math.sqrt(one * mass),
                "angle_deg": angle,
            },
            "link2": {
                "stiffness": two,
                "damping": 2.0 * between(1e-3, 2e-2) * math.sqrt(two * mass),
                "angle_deg": angle + float(rng.uniform(15.0, 60.0) * rng.choice([-1.0, 1.0])),
            },
            "load": {"force": load},
            "friction": {"coefficient": 0.3},
            "contact": {"half_length": half, "stiffness": contact / (2.0 * half)},
            "roughness": {
                "wheel": {
                    "amplitudes": [load / contact * between(0.05, 3.0) / count for _ in range(count)],
                    "wavelengths": waves,
                    "phases_deg": rng.uniform(0.0, 360.0, count).tolist(),
                }
            },
            "initial": {
                "at": "equilibrium",
                "vx": float(abs(speed) * rng.uniform(-1.0, 1.0)),
                "vy": float(abs(speed) * rng.uniform(-0.3, 0.3)),
            },
            "solver": {"duration": 2.0 * math.pi / rate * between(30.0, 200.0)},
        }
        critical = Shoe.of({**tables, "roughness": {}}).critical
        if critical is None or not 0.0 < critical < 4.0:
            continue
        tables["friction"]["coefficient"] = critical * between(1.02, 2.2)
        try:
            fast = system_of(make(tables)).natural_frequencies[1]
        except CaseError:
            continue
        tables["solver"]["step"] = 1.0 / (PER_PERIOD * fast)
        tables["output"] = {"sample_interval": 2.0 / (PER_PERIOD * fast)}
        if tables["solver"]["duration"] * PER_PERIOD * fast < 250000.0 and sliding(system_of(make(tables))):
            return tables
