"""Cases that several tests share, and running them in memory."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.energy import EnergyAccount
from brakecli.solver.integrate import Work, solve
from brakecli.solver.quantities import HISTORY

SQUEAL: dict[str, Any] = {  # flat; linear critical friction coefficient 0.575 with these dashpots
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 0.1},
    "link1": {"stiffness": 1e7, "damping": 300.0},
    "link2": {"stiffness": 1.2e7, "damping": 300.0, "angle_deg": 5.0},
    "load": {"force": 5000.0},
    "friction": {"coefficient": 0.6},
    "contact": {"half_length": 0.05, "stiffness": 2e7},
    "solver": {"step": 1e-5, "duration": 0.1},
    "output": {"sample_interval": 1e-4},
}

ROUGH: dict[str, Any] = {  # rough, opens in part at first
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 4.0},
    "link1": {"stiffness": 2e7, "damping": 200.0, "angle_deg": 20.0},
    "link2": {"stiffness": 1e7, "damping": 100.0, "angle_deg": 30.0},
    "load": {"force": 1000.0},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 5e7, "nodes": 256},
    "roughness": {
        "shoe": {
            "amplitudes": [30e-6, 21e-6, 15e-6, 9e-6, 6e-6],
            "wavelengths": [0.02, 0.011, 0.007, 0.005, 0.003],
        },
        "wheel": {
            "amplitudes": [30e-6, 24e-6, 18e-6, 12e-6, 6e-6],
            "wavelengths": [0.025, 0.013, 0.008, 0.006, 0.004],
        },
    },
    "solver": {"step": 1e-5, "duration": 0.02},
    "output": {"sample_interval": 1e-4},
}

COULOMB: dict[str, Any] = {  # ẍ + x = λ, |λ| ≤ 1: the normal force is 10 N and φ = 0.1
    "shoe": {"mass": 1.0},
    "wheel": {"radius": 1.0, "angular_speed": 0.0},
    "link1": {"stiffness": 1.0},
    "link2": {"stiffness": 1.0},
    "load": {"force": 11.0},
    "friction": {"coefficient": 0.1},
    "contact": {"half_length": 0.5, "stiffness": 10.0},
    "initial": {"at": "equilibrium", "x": 12.0, "vx": 6.0},
    "solver": {"step": 0.01, "duration": 60.0},
}

MODE_COUPLING: dict[str, Any] = {  # minimal model of mode coupling: cxx = 2, cyy + 2ak = 2, cxy = -1
    "shoe": {"mass": 1.0},
    "wheel": {"radius": 1.0, "angular_speed": 100.0},
    "link1": {"stiffness": 2.0 / 3.0 * (2.0 - 3.0**0.5), "angle_deg": 60.0},
    "link2": {"stiffness": 2.0 / 3.0 * (2.0 + 3.0**0.5), "angle_deg": 30.0},
    "load": {"force": 100.0},
    "friction": {"coefficient": 1.0},
    "contact": {"half_length": 1.0, "stiffness": 2.0 / 3.0},
    "initial": {"at": "equilibrium", "x": 1e-3},
    "solver": {"step": 0.005, "duration": 20.0},
}

NEVER_STABLE = {  # changes of SQUEAL: its one mode without damping grows by any friction
    "link1__angle_deg": 20.0,
    "link2__damping": 0.0,
    "link2__stiffness": 2e6 * math.sin(math.radians(40.0)) / math.sin(math.radians(30.0)),
    "friction__coefficient": 0.3,
    "solver__duration": 0.05,
}


def make(base: dict[str, Any], **changes: Any) -> Case:
    """A case from a base, with `table__key=value` set; `None` takes a key out."""
    tables = {name: dict(table) for name, table in base.items()}
    for name, value in changes.items():
        table, key = name.split("__")
        tables.setdefault(table, {})[key] = value
        if value is None:
            del tables[table][key]
    return Case.model_validate(tables)


@dataclass
class Result:
    """A run in memory."""

    time: NDArray[np.float64]
    rows: NDArray[np.float64]
    work: Work
    energy: EnergyAccount

    def __getattr__(self, name: str) -> NDArray[np.float64]:
        column: NDArray[np.float64] = self.rows[:, list(HISTORY).index(name)]
        return column


def simulate(case: Case) -> Result:
    """Run a case in memory."""
    motion = solve(system_of(case))
    time = np.array(motion.system.interval * np.arange(len(motion.rows)))
    return Result(time, motion.rows, motion.work, motion.energy)
