"""The second run, which decides whether friction or the roughness keeps a vibration up."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from brakecli.analysis.regime.of_run import context, verdict_on
from brakecli.runs.second import compared, second_system

from brakecli.analysis.regime.table import Excitation, Regime
from brakecli.analysis.regime.verdict import Feeds
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.solver.history import array_history
from brakecli.solver.motion import solve
from tests.analysis.found import SHOES
from tests.analysis.histories import history_of
from tests.commands import brakecli, each

FORCED: dict[str, Any] = {  # sliding is stable; the record is too short for its lines
    "shoe": {"mass": 18.4},
    "wheel": {"radius": 0.5, "angular_speed": -2.18},
    "link1": {"stiffness": 3.11e6, "damping": 123.0, "angle_deg": 21.0},
    "link2": {"stiffness": 6.48e6, "damping": 148.0, "angle_deg": -8.59},
    "load": {"force": 1610.0},
    "friction": {"coefficient": 0.233},
    "contact": {"half_length": 0.0217, "stiffness": 4.04e7},
    "roughness": {"wheel": {"amplitudes": [2.95e-4], "wavelengths": [0.0279], "phases_deg": [22.0]}},
    "solver": {"step": 1.21e-4, "duration": 0.513},
    "output": {"sample_interval": 2.42e-4},
}
SELF_EXCITED: dict[str, Any] = {  # sliding is unstable, and the vibration falls on the lines of a fast wave
    "shoe": {"mass": 41.7},
    "wheel": {"radius": 0.5, "angular_speed": 1.08e-4},
    "link1": {"stiffness": 5.67e7, "damping": 6470.0, "angle_deg": -27.5},
    "link2": {"stiffness": 1.39e8, "damping": 22100.0, "angle_deg": -4.6},
    "load": {"force": 999.0},
    "friction": {"coefficient": 1.05},
    "contact": {"half_length": 1.17e-6, "stiffness": 8.16e13},
    "roughness": {"wheel": {"amplitudes": [2.75e-6], "wavelengths": [9.04e-7], "phases_deg": [325.0]}},
    "initial": {"vx": 7.89e-5, "y": -2.38e-6},
    "solver": {"step": 3.42e-5, "duration": 0.334},
    "output": {"sample_interval": 6.84e-5},
}
COMMAND = "brakecli classify RESULT.h5 --second-run"


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("second")
    for name, tables in (("forced", FORCED), ("own", SELF_EXCITED)):
        (folder / f"{name}.toml").write_text(tomli_w.dumps(tables))
        brakecli("run", f"{name}.toml", "--quiet", cwd=folder).told(0)
    return folder


def test_a_second_run_decides_what_its_verdict_leaves_open(here: Path) -> None:
    names = ["forced.h5", "own.h5"]
    once = each(here, [["classify", name, "--json"] for name in names])
    assert [result.json["regime"] for result in once] == ["undecided"] * 2
    assert all(COMMAND in result.json["reasons"][0] for result in once)
    forced, own = each(here, [["classify", name, "--second-run", "--json"] for name in names])
    assert (forced.json["regime"], forced.json["excitation"]) == ("damped", "forced")
    assert (own.json["regime"], own.json["excitation"]) == ("relaxation", "self-excited")
    assert (
        "second run, without the roughness of the wheel, from the end of this one, four times as long: about"
        in forced.err
    )
    assert "second run, with a friction coefficient of" in own.err
    assert all("in the second run" in result.json["reasons"][-1] for result in (forced, own))


def test_a_second_run_that_decides_nothing_is_not_asked_for_again(here: Path) -> None:
    (here / "slow.toml").write_text(tomli_w.dumps(SHOES["its own vibration grows for ever so slowly"]))
    brakecli("run", "slow.toml", "--quiet", cwd=here).told(0)
    (found,) = each(here, [["classify", "slow.h5", "--second-run", "--json"]])
    assert found.json["regime"] == "undecided"
    assert found.json["reasons"][0].endswith("; run at least 690 s")  # ln 1e9 over 0.0303 1/s, and 1 % more
    assert "in the first sliding is unstable" in found.json["reasons"][-1]
    assert not any(COMMAND in reason for reason in found.json["reasons"])


def test_a_second_run_is_made_only_where_it_can_decide(here: Path) -> None:
    brakecli("run", "forced.toml", "--set", "roughness.wheel.amplitudes=[1e-6]", "-o", "full.h5", "-q", cwd=here)
    (here / "signal.csv").write_text("\n".join(str(i % 7) for i in range(500)))
    decided, signal = each(
        here,
        [
            ["classify", "full.h5", "--second-run", "--json"],
            ["classify", "signal.csv", "--quantity", "force", "--sample-rate", "100", "--second-run"],
        ],
    )
    assert (decided.code, decided.json["regime"]) == (0, "damped")
    assert "nothing was run" in decided.err
    signal.told(2, "--second-run")


@pytest.mark.parametrize("tables", [FORCED, SELF_EXCITED])
def test_friction_of_the_second_run_cannot_feed_a_vibration(tables: dict[str, Any]) -> None:
    """Either there is no wave that shakes the shoe, or sliding is stable."""
    system = system_of(parse_case(tomli_w.dumps(tables), "case").case)
    history = array_history(system.interval, solve(system).rows)
    second = second_system(system, history)
    assert second.smooth == (context(system).growth() < 0.0)
    assert context(second.system).growth() < 0.0
    assert second.system.wheel.g.size == (0 if second.smooth else 1)
    again = compared(second, history)
    assert again == compared(second, history)


def test_no_motion_is_called_quasi_harmonic_that_sticks_without_the_roughness() -> None:
    """Eight times later it sticks in 99 % of the cycles, by another integrator."""
    system = system_of(parse_case(tomli_w.dumps(SHOES["sticks without the roughness"]), "case").case)
    history = array_history(system.interval, solve(system).rows)
    feeds, sticks, _ = compared(second_system(system, history), history)
    assert (feeds, sticks > 0.9) == (Feeds.FRICTION, True)
    assert verdict_on(history, system, None, None, feeds).regime is Regime.QUASI_HARMONIC
    assert verdict_on(history, system, None, None, feeds, sticks).regime is Regime.UNDECIDED


@pytest.mark.parametrize("name", ["ring-down on a line", "forced where sliding is unstable"])
def test_a_second_run_shows_that_the_roughness_forces_what_lasts(name: str) -> None:
    """By another integrator, the one dies to what the waves force; the other repeats with the wheel to 1e-13."""
    system = system_of(parse_case(tomli_w.dumps(SHOES[name]), "case").case)
    history = array_history(system.interval, solve(system).rows)
    feeds, *_ = compared(second_system(system, history), history)
    assert verdict_on(history, system, None).regime is Regime.UNDECIDED
    assert verdict_on(history, system, None, None, feeds).excitation is Excitation.FORCED


def test_a_second_run_that_leaves_most_of_the_level_decides_nothing() -> None:
    """By another integrator it lasts for 160 runs: friction gives energy, and the roughness takes it."""
    system = system_of(parse_case(tomli_w.dumps(SHOES["hardly decays without the roughness"]), "case").case)
    history = array_history(system.interval, solve(system).rows)
    feeds, _, shown = compared(second_system(system, history), history)
    assert feeds is Feeds.UNKNOWN
    assert "vx has 0.99 times the level" in shown
    # A half is left at the end of a second run of that time: exp(-3.5 · 0.001226/s · 161 s).
    assert shown.endswith("too slowly to show whether the first does; run at least 161 s and decide again")


def test_what_friction_feeds_and_the_roughness_brakes_is_not_forced_though_it_dies_without_roughness() -> None:
    system = system_of(parse_case(tomli_w.dumps(FORCED), "case").case)
    second = second_system(system, array_history(system.interval, solve(system).rows))
    wave = np.sin(0.1 * np.arange(2000))
    feeds = [
        compared(second, history_of(2000, vx=wave, vy=wave, friction_force=wave, normal_force=part * wave))[0]
        for part in (-0.1, 0.1)
    ]
    assert feeds == [Feeds.UNKNOWN, Feeds.ROUGHNESS]


def test_a_second_run_that_decides_nothing_says_how_long_to_run() -> None:
    system = system_of(
        parse_case(tomli_w.dumps(SHOES["grows with friction, without a critical value"]), "case").case
    )
    history = array_history(system.interval, solve(system).rows)
    told = f"run at least {4.0 * system.duration:.3g} s and decide again, or sweep friction.coefficient"
    assert told in compared(second_system(system, history), history)[2]


def test_what_falls_as_friction_does_is_not_shown_to_be_self_excited() -> None:
    """By another integrator the level rises smoothly from a third of the critical friction through it."""
    system = system_of(
        parse_case(tomli_w.dumps(SHOES["grows with friction, without a critical value"]), "case").case
    )
    history = array_history(system.interval, solve(system).rows)
    assert compared(second_system(system, history), history)[0] is Feeds.UNKNOWN


@pytest.mark.parametrize(
    ("name", "rate"),
    [  # 1/s: eigenvalues, with the mean stiffness of runs by another integrator, which decays nowhere
        ("its own vibration grows for ever so slowly", 0.0303),
        ("unstable where the pad touches as it does", 0.0176),
    ],
)
def test_less_friction_does_not_take_back_that_sliding_is_unstable(name: str, rate: float) -> None:
    """The one grows thirty times in 500 runs; of the other a line at 106 Hz, not of the waves, lasts."""
    system = system_of(parse_case(tomli_w.dumps(SHOES[name]), "case").case)
    history = array_history(system.interval, solve(system).rows)
    second = second_system(system, history)
    assert second.growth == pytest.approx(rate, rel=0.02)
    feeds, _, shown = compared(second, history)
    assert (feeds, f"grows at {second.growth:.3g} 1/s; run at least" in shown) == (Feeds.UNKNOWN, True)
    assert verdict_on(history, system, None, None, feeds).regime is Regime.UNDECIDED
