"""A motion that is followed up and down: its loop against the branch, and runs that are too short for it."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from brakecli.analysis.branches.thresholds import thresholds
from brakecli.analysis.stability.report import stability
from brakecli.case.system import system_of
from brakecli.results.read import open_result
from brakecli.studies.sweeps.plan import parse_sweep
from brakecli.studies.sweeps.workers.task import compute_units
from tests.analysis.branches.smooth_shoes import FRICTION, numbered
from tests.campaign import campaign
from tests.examples import make
from tests.studies.sweeps.helpers import inline

pytestmark = pytest.mark.usefixtures("compiled")

SEED = 2500
WIDE = 79  # of the shoes that it draws: vibrates from 0.150 on, and by itself from 0.511 on
OTHERS = [17, 77, 114]
NARROW = [0.44, 0.455, 0.47, 0.48, 0.49, 0.5, 0.505, 0.515, 0.525]
"""Values around the second of them, in steps that are no strong push."""
GROWN = "sliding is unstable, but the runs end before"


@dataclass
class Loop:
    """What a sweep finds on its two ways."""

    vibrates: dict[str, list[float]]
    findings: list[str]

    @property
    def told(self) -> list[str]:
        """Of runs that are too short."""
        return [text for text in self.findings if GROWN in text]


@dataclass
class Followed:
    """A shoe with both of its thresholds, and sweeps of it."""

    folder: Path
    number: int

    def __post_init__(self) -> None:
        self.tables = numbered(SEED, self.number)
        system = system_of(make(self.tables))
        report = stability(system)
        self.speed = system.belt_speed
        found = thresholds(make(self.tables), system, report)
        assert report.critical is not None
        assert found.coexists_from is not None
        self.critical = report.critical.friction
        self.lower = found.coexists_from
        self.frequency = report.critical.frequency

    def loop(self, values: list[float], duration: float, direction: str = "both", key: str = FRICTION) -> Loop:
        output = {"sample_interval": 0.015 / self.frequency}
        solver = {"scheme": "piecewise-exact", "duration": duration}
        start = {"at": "equilibrium", "vx": -1e-6 * self.speed}
        case = {**self.tables, "solver": solver, "output": output, "initial": start}
        (self.folder / "case.toml").write_text(tomli_w.dumps(case))
        text = f'case = "case.toml"\n[[axis]]\nparameter = "{key}"\nvalues = {values}\n'
        text += f'direction = "{direction}"\n' if direction else ""
        loaded = parse_sweep(text, "sweep.toml", self.folder, [])
        path = self.folder / "loop.h5"
        path.unlink(missing_ok=True)
        report = inline(loaded, path, compute_units)
        with open_result(path, kind="sweep") as stored:
            regimes = np.atleast_2d(stored.read("/", "regime"))
        lasts = [[v for v, regime in zip(values, way, strict=True) if _lasts(regime)] for way in regimes]
        return Loop(dict(zip(("up", "down"), lasts, strict=False)), report.findings.sentences)


def _lasts(regime: bytes | str) -> bool:
    return (regime.decode() if isinstance(regime, bytes) else regime) in ("relaxation", "quasi-harmonic")


@campaign
@pytest.mark.parametrize("number", [WIDE, *OTHERS])
def test_the_loop_opens_at_the_critical_value_and_closes_at_the_fold(tmp_path: Path, number: int) -> None:
    """On the way up the step of the axis is the disturbance. It is below the barrier, but for the last one."""
    shoe = Followed(tmp_path, number)
    values = np.linspace(0.9 * shoe.lower, 1.08 * shoe.critical, 15).tolist()
    found = shoe.loop(values, 3000.0 / shoe.frequency)
    step = values[1] - values[0]
    assert min(found.vibrates["up"]) - step <= shoe.critical <= min(found.vibrates["up"])
    assert min(found.vibrates["down"]) - step <= shoe.lower <= min(found.vibrates["down"])


@campaign
def test_runs_that_are_too_short_are_told_with_the_duration_that_is_enough(tmp_path: Path) -> None:
    shoe = Followed(tmp_path, WIDE)
    values = np.linspace(0.7 * shoe.lower, 1.25 * shoe.critical, 25).tolist()
    first_above = next(value for value in values if value > shoe.critical)
    short = shoe.loop(values, 0.26)
    (growing,) = short.told
    # the second one is where the way down begins, from the start of the case
    assert f"at 2 points, {FRICTION} = {first_above:.9g} to {values[-1]:.9g}, {GROWN}" in growing
    assert min(short.vibrates["up"]) > first_above
    long = shoe.loop(values, max(_enough(text) for text in short.told))
    assert long.told == []
    assert min(long.vibrates["up"]) == first_above
    assert long.vibrates["down"] == [value for value in values if value > shoe.lower]


@campaign
def test_a_loop_that_short_runs_miss_altogether_is_told(tmp_path: Path) -> None:
    """All that is decided is damped both ways. That alone would be taken for an answer."""
    shoe = Followed(tmp_path, WIDE)
    found = shoe.loop(NARROW, 0.02)
    assert found.vibrates == {"up": [], "down": []}
    assert "no hysteresis at the 7 points that are decided: damped on the way up" in found.findings[0]
    (told,) = found.told
    assert f"at 4 points, {FRICTION} = 0.515 to 0.525, {GROWN}" in told


@campaign
def test_one_way_is_looked_at_as_well_and_points_that_are_not_followed_are_not(tmp_path: Path) -> None:
    shoe = Followed(tmp_path, WIDE)
    (told,) = shoe.loop(NARROW, 0.02, "up").told
    assert f"at 2 points, {FRICTION} = 0.515 to 0.525, {GROWN}" in told
    assert shoe.loop(NARROW, 0.02, "").told == []


def test_where_steady_sliding_does_not_move_rounding_grows(tmp_path: Path) -> None:
    """Damping does not move it. Between rounding and a vibration lie some 36 powers of e, and three to settle."""
    shoe = Followed(tmp_path, WIDE)
    shoe.tables = {**shoe.tables, "friction": {"coefficient": 0.53}}
    own = shoe.tables["link1"]["damping"]
    (told,) = shoe.loop([own, 1.0001 * own], 0.02, "up", key="link1.damping").told
    assert GROWN in told
    rate = max(value.real for value in stability(system_of(make(shoe.tables))).eigenvalues)
    assert 30.0 < 0.75 * _enough(told) * rate < 45.0


def _enough(text: str) -> float:
    """The duration (s) that a sentence asks for."""
    found = re.search(r"solver\.duration of (\S+) s is enough for all", text)
    assert found is not None
    return float(found[1])
