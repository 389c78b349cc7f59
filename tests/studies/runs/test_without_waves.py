"""What becomes of a motion on the smooth wheel, beside long runs."""

from typing import Any

import numpy as np
import pytest

from brakecli.analysis.fate import Fate, Kind, fate_on_smooth_pads
from brakecli.analysis.shoe import Shoe
from brakecli.case.system import system_of
from brakecli.solver.integrate import solve
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.solver.system import System
from brakecli.studies.runs.without_waves import LONGEST, without_waves
from tests.examples import SQUEAL, make

WAVES = {"wheel": {"amplitudes": [2e-5], "wavelengths": [0.03]}}
BUMPS = {"shoe": {"amplitudes": [2e-6], "wavelengths": [0.05]}}


def system(**changes: Any) -> System:
    return system_of(make(SQUEAL, friction__coefficient=0.7, **changes))


def continued(shoe: System) -> Fate:
    """From the start of a case."""
    start = shoe.initial
    return without_waves(shoe, np.array([start.x, start.y, start.vx, start.vy]))


def test_what_comes_near_unstable_sliding_is_not_said_to_last() -> None:
    """A disturbance that grows at 1e-4 of the rate has no event for longer than a run."""
    shoe = system()
    rest = steady_sliding(shoe)
    found = without_waves(shoe, np.array([rest.x, rest.y, 1e-300, 0.0]))
    assert found.kind is Kind.UNKNOWN
    assert found.orbit is None


def test_on_a_standing_wheel_nothing_is_asked() -> None:
    assert continued(system(wheel__angular_speed=0.0)) == Fate(Kind.UNKNOWN)


@pytest.mark.parametrize(("friction", "kind"), [(0.3, Kind.STEADY_SLIDING), (0.7, Kind.VIBRATION)])
def test_a_rough_shoe_is_continued_by_the_curve_of_its_force(friction: float, kind: Kind) -> None:
    shoe = system_of(make(SQUEAL | {"roughness": {**WAVES, **BUMPS}}, friction__coefficient=friction))
    assert continued(shoe).kind is kind
    flat = system_of(make(SQUEAL | {"roughness": BUMPS}, friction__coefficient=friction, solver__duration=2.0))
    speeds = solve(flat).rows[:, 2]
    late = speeds[-1000:].std()
    early = speeds[: len(speeds) // 8].std()
    assert bool(late > 0.5 * early) == (kind is Kind.VIBRATION)


def test_without_dashpots_no_limit_cycle_is_sure_to_stay() -> None:
    """A vibration that grazes stick: after a run it repeats, and after four it no longer sticks in each cycle."""
    tables: dict[str, Any] = {
        "shoe": {"mass": 2.3817},
        "wheel": {"radius": 0.5, "angular_speed": 0.46506086},
        "link1": {"stiffness": 80585672.6, "damping": 0.0},
        "link2": {"stiffness": 106870640.4, "damping": 0.0, "angle_deg": 32.5635463},
        "load": {"force": 12579.0207},
        "friction": {"coefficient": 3.36713022},
        "contact": {"half_length": 0.01372914764, "stiffness": 1024694741.47},
        "initial": {
            "at": "equilibrium", "x": -8.926775e-5, "y": -9.953954e-5, "vx": -0.085592141, "vy": 0.057690159,
        },
        "solver": {"duration": 0.0911},
        "output": {"sample_interval": 3.424e-5},
    }  # fmt: skip
    shoe = system_of(make(tables))
    state = solve(shoe).rows[-1, :4]
    assert fate_on_smooth_pads(Shoe.of(shoe), state, LONGEST * shoe.sampled_duration).orbit is not None
    found = without_waves(shoe, state)
    assert found.lasts
    assert found.orbit is None
