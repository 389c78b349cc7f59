"""Random rough shoes above the critical friction of their full contact, and the mirror images of cases."""

from tests.analysis.shoes import Tables


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
