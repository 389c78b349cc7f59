"""Random shoes whose critical value is looked for."""

import math
from typing import Any

import numpy as np

from tests.studies.sweeps.independent import Tables, held_by


def flat_critical(tables: Tables) -> float:
    """The critical friction of an undamped shoe on smooth surfaces: flutter, or self-locking."""
    _, stiffnesses, _, contact, _, grip = held_by(tables)
    cxx, cxy, cyy = (float(each) for each in stiffnesses)
    contact = float(contact)
    if grip * cxy < 0.0:
        return (abs(cxy) + (cxx - cyy - contact) ** 2 / (4.0 * abs(cxy))) / contact
    return (cxx * (cyy + contact) - cxy**2) / (contact * abs(cxy)) if cxy else math.inf


def drawn(seed: int, kind: str) -> tuple[Tables, str, float, float, float]:
    """A case, a key, its range and tolerance.

    Kinds: `opening` and `undamped` surfaces open, `passing` waves feed vibration in full contact, `smooth`
    surfaces, `soft` links near self-locking.
    """
    rng = np.random.default_rng([seed, len(kind)])

    def spread(low: float, high: float) -> float:
        return float(f"{10 ** rng.uniform(math.log10(low), math.log10(high)):.3g}")

    def between(low: float, high: float) -> float:
        return float(f"{rng.uniform(low, high):.3g}")

    while True:
        m = spread(2.0, 60.0)
        c1 = spread(4e5, 1e7)
        half = float(rng.choice([0.02, 0.03, 0.05]))
        contact = c1 * spread(0.15, 1.5)
        side = float(rng.choice([1.0, 1.0, -1.0]))
        alpha = between(3.0, 30.0)
        beta = float(rng.choice([0.0, between(-15.0, 15.0)]))
        c2 = (c1 + contact) * between(0.6, 1.5)
        if kind == "soft":
            alpha = -between(1.0, 50.0)
            beta = float(rng.choice([0.0, between(0.0, 0.05)]))
            c2 = c1 * spread(1e-6, 1e-2)
        ratio = 0.0 if kind == "undamped" or (kind == "soft" and rng.random() < 0.4) else spread(0.001, 0.02)
        b1 = 2.0 * ratio * math.sqrt(c1 * m)
        b2 = b1 * between(0.3, 2.0) if kind != "soft" else 2.0 * ratio * math.sqrt(c2 * m)
        fast = math.sqrt((c1 + contact) / m) / 2.0 / math.pi
        lengths = rng.choice(np.arange(8, 80), int(rng.choice([1, 1, 2])), replace=False).tolist()
        depth = spread(2e-5, 2e-4) if kind in ("opening", "undamped") else spread(2e-4, 1e-3)
        height = depth * (between(0.5, 1.05) if kind in ("opening", "undamped") else between(0.1, 0.3))
        speed = between(0.5, 6.0)
        tables: Tables = {
            "shoe": {"mass": m},
            "wheel": {"radius": 0.5, "angular_speed": side * 2.0 * speed},
            "link1": {"stiffness": c1, "damping": b1, "angle_deg": side * beta},
            "link2": {"stiffness": c2, "damping": b2, "angle_deg": side * alpha},
            "load": {"force": depth * (c1 + contact)},
            "friction": {"coefficient": 1.0},
            "contact": {"half_length": half, "stiffness": contact / (2.0 * half)},
            "solver": {"duration": 40.0 / fast},
        }
        critical = flat_critical(tables)
        period = 1e-3 * math.lcm(*lengths) / speed
        if kind == "passing":  # half of a wave, or the whole, at twice a natural frequency
            speed = 1e-3 * lengths[0] * fast * between(0.3, 2.1)
            tables["wheel"]["angular_speed"] = side * 2.0 * speed
            period = 1e-3 * math.lcm(*lengths) / speed
        slow_enough = kind in ("smooth", "soft") or (period * fast < 40.0 and 20.0 * height * fast < speed < 30.0)
        if 0.03 < critical < 3.0 and slow_enough:
            break
    if kind not in ("smooth", "soft"):
        parts = rng.uniform(0.3, 1.3, len(lengths))
        amplitudes = (height * parts / parts.sum()).tolist()
        tables["roughness"] = {
            "wheel": {"amplitudes": amplitudes, "wavelengths": [each / 1000 for each in lengths]}
        }
        if rng.random() < 0.5:
            tables["roughness"]["wheel"]["phases_deg"] = rng.uniform(0.0, 360.0, len(lengths)).round(1).tolist()
        if kind != "passing" and rng.random() < 0.7:
            shoe = {"amplitudes": [height * between(0.1, 0.7)], "wavelengths": [int(rng.integers(6, 40)) / 1000]}
            tables["roughness"]["shoe"] = shoe
    tables["solver"] |= scheme(rng, fast, kind)
    if "step" not in tables["solver"]:
        tables["output"] = {"sample_interval": 0.05 / fast}
    key = str(
        rng.choice(["friction__coefficient", "friction__coefficient", "link2__stiffness", "wheel__angular_speed"])
    )
    if kind == "soft" or (kind == "smooth" and key == "wheel__angular_speed"):
        key = "friction__coefficient"
    if key == "friction__coefficient":
        return (
            tables,
            key,
            0.0,
            critical * between(1.4, 2.5),
            critical * spread(1e-6 if kind == "soft" else 1e-4, 1e-3),
        )
    tables["friction"]["coefficient"] = critical * between(0.8, 1.2)
    table, name = key.split("__")
    here = tables[table][name]
    low, high = {"link2__stiffness": (0.6, 1.6)}.get(key, (0.8, 1.25))
    low, high = sorted((low * here, high * here))
    return tables, key, low, high, 1e-3 * (high - low)


def scheme(rng: Any, fast: float, kind: str) -> Tables:
    """How a case is computed."""
    step = 1.0 / (fast * float(rng.choice([60.0, 100.0, 200.0])))
    name = str(rng.choice(["two-layer", "three-layer", "weighted", "event-driven"], p=[0.3, 0.3, 0.2, 0.2]))
    if kind == "soft":
        name = str(rng.choice(["two-layer", "three-layer", "three-layer"]))
    if name == "event-driven":
        return {"scheme": name}
    if name == "weighted":
        return {"scheme": "two-layer", "step": step, "theta": [float(rng.choice([0.52, 0.55, 0.6])), 0.5]}
    return {"scheme": name, "step": step}
