"""Verdicts before the end of a run are those of the whole run, and orbits are what they are said to be."""

import math
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from brakecli.analysis.stability.linear import linear_theory
from brakecli.case.case import Case
from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.results.fields import POINT
from brakecli.solver.integrate import solve
from brakecli.solver.motion.events import DONE, EVENTFUL
from brakecli.solver.motion.flow import SmoothFlow
from brakecli.solver.quantities import ContactState
from brakecli.solver.system import Initial, System
from brakecli.studies.runs.settled import Judged
from brakecli.studies.sweeps.driver import journal_path
from brakecli.studies.sweeps.early import Ending, early
from brakecli.studies.sweeps.simulate import simulate
from brakecli.studies.sweeps.workers.task import compute_units
from tests.analysis.shoes import random_shoes
from tests.campaign import campaign, counts
from tests.commands import ROOT, TINY
from tests.studies.sweeps.helpers import axis, frictions, inline, interrupted, write_sweep

RELAXATION = (ROOT / "cases" / "relaxation.toml").read_text()
EXACT = "solver={tolerance=1e-3, duration=2.0}"


def case_of(text: str, *overrides: str) -> Case:
    return parse_case(text, "a case", overrides).case


def known(case: Case) -> tuple[System, Judged[Ending]]:
    system = system_of(case)
    found = early(system)
    assert found is not None
    return system, found


def compare(found: Judged[Ending], case: Case) -> None:
    """A whole run says the same, its numbers within what its samples show of them."""
    ours = found.verdict
    whole = simulate(case).verdict
    system = found.motion.system
    assert (ours.regime, ours.excitation, ours.settled) == (whole.regime, whole.excitation, whole.settled)
    of_points = [field.name for field in POINT if getattr(whole, field.name, None) is not None]
    assert [name for name in of_points if getattr(ours, name) is None] == []  # what a sweep would not give
    fast = system.natural_frequencies[1]
    interval = system.interval
    seen = 0.5 * (math.pi * fast * interval) ** 2  # of an amplitude between two samples, at the fastest frequency
    depth = system.load_at_start / (system.coefficients.c_yy + system.contact_stiffness)
    if whole.frequency is None:
        assert ours.frequency is None
        assert ours.amplitude == pytest.approx(whole.amplitude, rel=2.0 * seen, abs=1e-12 * depth)
        first = None if ours.regime != "damped" else pytest.approx(ours.amplitude_first, rel=2.0 * seen)
        assert whole.amplitude_first == first
        assert ours.mean_friction_force == pytest.approx(whole.mean_friction_force, rel=2e-3)  # ends of the part
        assert (ours.stick_fraction, ours.contact_loss_fraction) == (0.0, 0.0)
        assert ours.settled_from == whole.settled_from
        return
    # both have the orbit, from other places of it and each closed to 1e-11 of its size; the time in a stick that
    # only just comes about goes with the square root of that
    assert ours.frequency == pytest.approx(whole.frequency, rel=1e-10)
    assert ours.amplitude == pytest.approx(whole.amplitude, rel=1e-10)
    assert ours.mean_friction_force == pytest.approx(whole.mean_friction_force, rel=1e-10)
    assert ours.stick_fraction == pytest.approx(whole.stick_fraction, abs=1e-5)
    assert ours.contact_loss_fraction == pytest.approx(whole.contact_loss_fraction, abs=1e-5)


@pytest.mark.parametrize("shoes", counts(25, 300))
def test_an_early_verdict_is_that_of_the_whole_run(shoes: int) -> None:
    early_ones = lasting = 0
    for tables in islice(random_shoes("smooth", 2), shoes):
        solver = {"tolerance": 1e-3, "duration": tables["solver"]["duration"]}
        output = {"sample_interval": tables["output"]["sample_interval"] / 3.0}  # 60 samples of the fastest period
        case = case_of(tomli_w.dumps({**tables, "solver": solver, "output": output}))
        try:
            found = early(system_of(case))
            if found is not None:
                compare(found, case)
        except BrakecliError:
            continue
        early_ones += found is not None
        lasting += found is not None and found.verdict.frequency is not None
    assert early_ones > 0.25 * shoes
    assert lasting > 0.02 * shoes


@pytest.mark.parametrize("points", counts(15, 300))
def test_a_map_of_regimes_is_known_early_but_for_one_point_in_fifty(points: int) -> None:
    rng = np.random.default_rng(7)
    found = 0
    for friction, speed in rng.uniform((0.5, 0.04), (0.8, 0.8), (points, 2)).tolist():
        case = case_of(RELAXATION, EXACT, f"friction.coefficient={friction}", f"wheel.angular_speed={speed}")
        known_early = early(system_of(case))
        if known_early is not None:
            compare(known_early, case)
            found += 1
    assert found >= 0.98 * points - 1.0


def test_the_first_tenth_of_a_motion_with_many_events_is_followed_to_its_end() -> None:
    """A vibration just below the least friction at which it could last: it leaves the wheel more than 60 times."""
    start = 'initial={at="equilibrium",vy=-0.03}'
    solver = "solver={tolerance=1e-3,duration=20.0}"
    case = case_of(starters()["branch"], solver, "friction.coefficient=0.167", start)
    system, found = known(case)
    flow = SmoothFlow.of(system)
    theory = linear_theory(system, system.belt_speed)
    assert theory is not None
    assert flow(system.initial.beside(theory.rest), 2.0, tangents=False) == EVENTFUL
    assert found.verdict.regime == "damped"
    compare(found, case)


ORBITS = {
    "stick": (),
    "stick and lift-off": ("wheel.angular_speed=0.55", "friction.coefficient=0.9"),
    "lift-off": ("wheel.angular_speed=2.0",),
    "backwards": ("wheel.angular_speed=-0.1", "link2.angle_deg=-5.0"),
}


def one_cycle(system: System, found: Judged[Ending], samples: int, cycles: int = 1, moved: float = 0.0) -> Any:
    """A run from the orbit's state on, by the scheme that keeps samples and an account of energy."""
    x, y, v_x, v_y = found.motion.rows[-1].tolist()
    assert found.verdict.frequency is not None
    period = 1.0 / found.verdict.frequency
    start = Initial(x * (1.0 + moved), y, v_x, v_y)
    method = replace(system.method, step=period)  # its own steps are exact: no second run
    short = replace(system, initial=start, interval=period / samples, duration=cycles * period, method=method)
    return solve(short)


@pytest.mark.parametrize("name", ORBITS)
def test_an_orbit_closes_and_its_numbers_are_those_of_one_cycle(name: str) -> None:
    system, found = known(case_of(RELAXATION, EXACT, *ORBITS[name]))
    verdict = found.verdict
    samples = 2000
    assert (verdict.stick_fraction > 0.0) is (name != "lift-off")
    assert (verdict.contact_loss_fraction > 0.0) is ("lift-off" in name)
    motion = one_cycle(system, found, samples)
    rows = motion.rows
    period = 1.0 / (verdict.frequency or 0.0)
    size = 0.5 * np.ptp(rows[:, :4], axis=0)
    np.testing.assert_array_less(np.abs(rows[-1, :4] - rows[0, :4]), 1e-8 * size)
    # a parabola between samples
    assert verdict.amplitude == pytest.approx(float(size[0]), rel=0.5 * (math.pi / samples) ** 2 * 2.0)
    # ∫ F_x U dt, which the scheme adds up exactly; what does not close is 1e-8 of the stored energy
    mean = motion.energy.belt / (system.belt_speed * period)
    assert verdict.mean_friction_force == pytest.approx(mean, rel=1e-7)
    for state, part in (
        (ContactState.STICK, verdict.stick_fraction),
        (ContactState.SEPARATED, verdict.contact_loss_fraction),
    ):
        assert part == pytest.approx(float(np.mean(rows[:-1, 7] == state)), abs=2.0 / samples)


@pytest.mark.parametrize("name", ["stick", "lift-off"])
def test_the_largest_multiplier_is_how_neighbours_return(name: str) -> None:
    """A disturbance that has come round some cycles is along the multiplier's direction, and shrinks by it."""
    system, found = known(case_of(RELAXATION, EXACT, *ORBITS[name]))
    factor = found.verdict.evidence["largest_multiplier"]
    cycles = 60
    rows = one_cycle(system, found, 1, cycles, moved=1e-4).rows[:, :4]
    steps = np.linalg.norm(np.diff(rows, axis=0) / np.array([1.0, 1.0, *[2.0 * math.pi * 174.0] * 2]), axis=1)
    slope = np.polyfit(np.arange(cycles - 10), np.log(steps[10:]), 1)[0]  # the phase is off by more and more of it
    assert 0.5 < factor < 1.0
    assert math.exp(slope) == pytest.approx(factor, rel=0.01)


@pytest.mark.parametrize(
    "changes",
    [
        ("roughness.wheel={amplitudes=[1e-6], wavelengths=[0.01]}",),
        ("solver={scheme='two-layer', step=1e-5, duration=2.0}",),
        ("load={times=[0.0, 1.0], forces=[5e3, 6e3]}",),
        ("wheel.angular_speed=0.0",),
        ("friction.coefficient=0.0",),
        ("output.sample_interval=5e-3",),  # a cycle in one sample: the whole run sees none
        ("solver.duration=0.2",),  # settled too late
    ],
)
def test_there_is_no_early_verdict_where_a_whole_run_may_see_something_else(changes: tuple[str, ...]) -> None:
    assert early(system_of(case_of(RELAXATION, EXACT, *changes))) is None


@campaign
def test_a_point_takes_less_than_200_bytes_of_journal_and_of_result(tmp_path: Path) -> None:
    case = TINY.replace("step = 1e-5, duration = 0.02", "tolerance = 1e-3, duration = 1.0")
    sizes = []
    speeds = axis("wheel.angular_speed", "start=0.1", "stop=2.0", "num=20")
    for frictions_tried in (2, 20):
        loaded = write_sweep(tmp_path, frictions(frictions_tried), speeds, case=case)
        interrupted(loaded, tmp_path / "s.h5", compute_units, limit=1, task_size=39)
        journal = journal_path(tmp_path / "s.h5").stat().st_size
        assert inline(loaded, tmp_path / "s.h5", compute_units, task_size=39).resumed == 39
        sizes.append((tmp_path / "s.h5").stat().st_size)
        (tmp_path / "s.h5").unlink()
    header = 2000  # the sweep and the versions
    assert journal < header + 39 * 200
    assert sizes[1] - sizes[0] < 360 * 200  # what all results have in common takes 60 kB


def test_an_orbit_that_is_given_up_leaves_no_error_to_a_motion_that_fades() -> None:
    """Near the critical friction the returns come close to one another long before the motion slides steadily."""
    settings = ("solver={tolerance=1e-4, duration=1.0}", "friction.coefficient=0.569", "wheel.angular_speed=0.05")
    _, found = known(case_of(RELAXATION, *settings))
    assert found.verdict.frequency is None
    assert found.certificate is not None
    assert found.certificate.estimated_error < 1e-4


def test_a_short_rise_of_the_velocity_that_steps_do_not_show_is_no_end_of_a_cycle() -> None:
    """The orbit has a rise and a fall of ẋ within a step. Its period is the time after which it closes."""
    text = (ROOT / "brakecli" / "case" / "starters" / "branch.toml").read_text()
    case = case_of(text, "friction.coefficient=0.6", "solver.duration=20.0")
    system, found = known(case)
    frequency = found.verdict.frequency
    assert frequency is not None
    assert frequency == pytest.approx(134.94026, abs=1e-5)
    flow = SmoothFlow.of(system)
    x, y, v_x, v_y = found.motion.rows[0]
    assert flow(np.array([x, y, v_x, v_y]), 1.0 / frequency) == DONE
    np.testing.assert_allclose(flow.state, [x, y, v_x, v_y], atol=1e-9 * found.verdict.amplitude * 850.0)
