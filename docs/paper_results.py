"""The results behind docs/paper-claims.md: the sweeps of cases/paper, and finer ones about the least values."""

import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from brakecli.analysis.stability.report import stability
from brakecli.case.case import Case, changed
from brakecli.case.read import parse_case
from brakecli.case.system import system_of

ROOT = Path(__file__).parents[1]
CASES = ROOT / "cases" / "paper"
RESULTS = ROOT / "results" / "paper"
COMMAND = Path(sys.executable).with_name("brakecli")
C1 = 1e7
PAD = 0.1
RATIOS = (0.02, 0.05, 0.2, 1.0)
RANGES = (10.0, 20.0, 30.0)
WINDOW = np.array([-0.05, -0.025, 0.0, 0.025, 0.05])
"""Around the least value on the coarse grid: where it is looked for again, by simulation."""
ALPHA = "link2_angle_deg"
BETA = "link1_angle_deg"
C2 = "link2_stiffness"
K = "contact_stiffness"
BOTH = "link1_damping"
FIRST = "link1_damping"
SECOND = "link2_damping"
Array = NDArray[np.float64]


def run(name: str, folder: Path = CASES) -> xr.Dataset:
    """The result of a sweep, computed by the installed command unless it is there and may be kept."""
    output = RESULTS / f"{name}.h5"
    if not ("--keep" in sys.argv and output.exists()):
        print(f"sweep {name}", file=sys.stderr, flush=True)  # noqa: T201
        RESULTS.mkdir(parents=True, exist_ok=True)
        command = [COMMAND, "sweep", folder / f"{name}.toml", "-o", output, "--force", "--quiet"]
        subprocess.run(command, check=True)
    with xr.open_dataset(output, engine="h5netcdf") as data:
        return data.load()


@dataclass(frozen=True)
class Least:
    """Where along c2 the critical friction coefficient is least, and its value."""

    stiffness: float
    friction: float


def least(stiffness: Array, friction: Array) -> Least:
    """The least value of a c2 + b + d/c2 through the points: without dashpots the exact shape of the curve."""
    s = stiffness / C1
    a, b, d = np.linalg.lstsq(np.stack([s, np.ones_like(s), 1.0 / s], axis=1), friction, rcond=None)[0]
    return Least(C1 * math.sqrt(d / a), b + 2.0 * math.sqrt(a * d))


def coarsely(data: xr.DataArray) -> float:
    """c2 of the least value on a coarse grid, from it and its neighbours."""
    values = data.values
    place = int(np.nanargmin(values))
    near = slice(max(place - 1, 0), place + 2)
    return least(data[C2].values[near], values[near]).stiffness


def refined(name: str, case: str, centre: float, axes: dict[str, list[float]]) -> xr.Dataset:
    """A sweep over c2 around `centre`, written beside the results and run."""
    stiffness = [float(f"{centre * (1.0 + part):.6g}") for part in WINDOW]
    lines = [f'case = "{Path("../..") / CASES.relative_to(ROOT) / case}.toml"']
    for parameter, values in {**axes, "link2.stiffness": stiffness}.items():
        lines += ["[[axis]]", f'parameter = "{parameter}"', f"values = {values}"]
    lines += ["[critical]", 'parameter = "friction.coefficient"', "lower = 0.0", "upper = 10.0"]
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / f"{name}.toml").write_text("\n".join(lines) + "\n")
    return run(name, RESULTS)


@dataclass(frozen=True)
class Results:
    """All sweeps: those of cases/paper by name, and the refined ones by K/c1 or by the name of their surface."""

    sweeps: dict[str, xr.Dataset]
    refined: dict[float | str, xr.Dataset]

    def __getitem__(self, name: str) -> xr.Dataset:
        """A sweep of cases/paper."""
        return self.sweeps[name]


def compute() -> Results:
    """Run everything."""
    sweeps = {path.stem: run(path.stem) for path in sorted(CASES.glob("*-*.toml"))}
    found: dict[float | str, xr.Dataset] = {}
    dashpots = [0.0, 300.0]
    coarse = sweeps["ratio-eigenvalues"].critical
    for ratio in RATIOS:
        k = ratio * C1 / PAD
        centre = coarsely(coarse.sel({K: k, FIRST: 0.0, SECOND: 0.0}))
        axes = {"contact.stiffness": [k], "link1.damping": dashpots, "link2.damping": dashpots}
        found[ratio] = refined(f"least-{ratio:g}", "flat", centre, axes)
    for surface in ("rough", "open"):
        curve = sweeps[f"ratio-{surface}"].critical
        centre = coarsely(curve.sel({BOTH: 300.0}) if BOTH in curve.dims else curve)
        axes = {"link1.damping": [300.0], "link2.damping": [300.0]}
        found[surface] = refined(f"least-{surface}", surface, centre, axes)
    return Results(sweeps, found)


def base(name: str, **changes: dict[str, Any]) -> Case:
    """A case of cases/paper with some of its keys changed."""
    path = CASES / f"{name}.toml"
    return changed(parse_case(path.read_text(), str(path)).case, **changes)


def touching(name: str, **changes: dict[str, Any]) -> float:
    """K over 2ak in steady sliding: what a contact that opens in part keeps of its stiffness."""
    system = system_of(base(name, **changes))
    return stability(system).contact_stiffness / system.contact_stiffness


def nonlinearity(angle: Array, friction: Array, reach: float, affine: bool) -> float:
    """The largest distance from the best straight line, in per cent of the largest value from 0 to `reach`."""
    kept = angle <= reach + 1e-9
    x = angle[kept]
    y = friction[kept]
    columns = np.stack([x, np.ones_like(x)], axis=1) if affine else x[:, None]
    line = columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(100.0 * np.abs(y - line).max() / y.max())


def flutter(c2: Array | float, alpha: Array | float, beta: Array | float, k: float) -> Array:
    """The closed form without dashpots, NaN where there is no flutter (angles in degrees)."""
    a = np.radians(alpha)
    b = np.radians(beta)
    pull = 0.5 * (np.asarray(c2) * np.sin(2.0 * a) - C1 * np.sin(2.0 * b))  # -cxy
    apart = c2 * np.cos(2.0 * a) - C1 * np.cos(2.0 * b) - k  # cxx - cyy - K
    pull = np.where(pull > 0.0, pull, np.nan)
    return np.asarray((pull + apart**2 / (4.0 * pull)) / k)
