"""The piecewise-exact scheme against matrix exponentials, the event-driven scheme and exact solutions."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, Stepping, solve
from brakecli.solver.method import Method
from brakecli.solver.quantities import Failure
from tests.campaign import counts
from tests.examples import COULOMB, SQUEAL, make
from tests.solver.test_event_driven import error, flat_case

EXACT = Method("piecewise-exact")


def motion(case: Case | dict[str, Any], method: Method = EXACT) -> Motion:
    """The motion of a case by a method; it must not fail."""
    found = solve(system_of(case if isinstance(case, Case) else Case.model_validate(case)), method)
    assert found.work.failure is Failure.NONE
    return found


def tabled(base: dict[str, Any], **changes: Any) -> Case:
    """A shared case without a step."""
    sampled = {"output__sample_interval": base.get("output", {}).get("sample_interval", base["solver"]["step"])}
    return make(base, **{"solver__step": None, **sampled, **changes})


def same_as_event_driven(case: Case | dict[str, Any], bound: float) -> Motion:
    """The motion, if the event-driven scheme finds the same samples, states and works within a relative bound."""
    found = motion(case)
    other = motion(case, Method("event-driven", tolerance=1e-13))
    moving = np.abs(other.rows[:, :4]).max(axis=0) > 0.0
    np.testing.assert_array_equal(found.rows[:, :4][:, ~moving], 0.0)
    scale = np.where(moving, np.abs(other.rows[:, :4]).max(axis=0), 1.0)
    assert float((np.abs(found.rows[:, :4] - other.rows[:, :4]).max(axis=0) / scale).max()) < bound
    np.testing.assert_array_equal(found.rows[:, 6:], other.rows[:, 6:])
    forces = np.abs(other.rows[:, 4:6]).max()
    np.testing.assert_allclose(found.rows[:, 4:6], other.rows[:, 4:6], rtol=0.0, atol=10.0 * bound * forces)
    largest = max(map(abs, vars(other.energy).values()))
    known = (1e-8 + 10.0 * abs(other.energy.relative_closing_error)) * largest  # its works are its weakest part
    for name, energy in vars(other.energy).items():
        assert getattr(found.energy, name) == pytest.approx(energy, abs=known), name
    assert abs(found.energy.relative_closing_error) < 1e-11
    return found


# --- one phase -----------------------------------------------------------------------------------------------


# --- random shoes --------------------------------------------------------------------------------------------


def drawn(rng: np.random.Generator, kind: int) -> dict[str, Any]:
    """A smooth shoe thrown onto the wheel, of one of several kinds."""
    case, omega = flat_case(rng, 1e-12)
    links = (case["link1"], case["link2"])
    if kind == 1:  # overcritical dashpots
        for link in links:
            link["damping"] = case["shoe"]["mass"] * omega * 10 ** rng.uniform(0.3, 1.7)
    elif kind == 2:  # no dashpots, and friction that can lock
        case["friction"]["coefficient"] *= 4.0
        for link in links:
            link["damping"] = 0.0
    elif kind == 3:  # speed and load change, and the wheel turns back
        load = case["load"]["force"]
        belt = case["wheel"]["angular_speed"]
        times = np.sort(rng.uniform(0, 30, 4)) / omega
        case["load"] = {"times": times.tolist(), "forces": (load * rng.uniform(-0.3, 2, 4)).tolist()}
        case["wheel"] = {
            "radius": 0.5,
            "times": times.tolist(),
            "angular_speeds": (belt * rng.normal(size=4)).tolist(),
        }
    elif kind == 4:  # links along the axes
        links[0]["angle_deg"] = rng.choice([-90, 0, 90])
        links[1]["angle_deg"] = rng.choice([-90, 0, 90])
    return case


@pytest.mark.parametrize("many", counts(8, 60))
def test_random_shoes_move_as_by_the_event_driven_scheme(many: int) -> None:
    """Rounding errors of some 1e-15 a step, of two solutions, in motions that amplify them by up to 1e4."""
    rng = np.random.default_rng(31)
    seen = set[float]()
    for number in range(many):
        seen |= set(same_as_event_driven(drawn(rng, number % 5), 1e-10).rows[:, 7])
    assert seen == {-1.0, 0.0, 1.0, 2.0}


# --- hard cases ----------------------------------------------------------------------------------------------

FREE = {"link1__damping": 0.0, "link2__damping": 0.0}
HARD: dict[str, dict[str, Any]] = {
    "from rest": {},
    "no dashpots": FREE,
    "no friction": {"friction__coefficient": 0.0},
    "self-locking": {"friction__coefficient": 8.0, "link2__angle_deg": -40.0},
    "a wheel at rest": {"wheel__angular_speed": 0.0, "initial__vx": 0.3},
    "a wheel at rest, from rest": {"wheel__angular_speed": 0.0},
    "a wheel that turns back": {"wheel__angular_speed": -0.1},
    "no link along the wheel": {"link2__stiffness": 0.0, "link2__damping": 0.0},
    "no links at all": {f"link{i}__{key}": 0.0 for i in (1, 2) for key in ("stiffness", "damping")},
    "link 2 upright": {"link2__angle_deg": 90.0, "link1__angle_deg": 20.0},
    "link 2 upright, other way": {"link2__angle_deg": -90.0, "link1__angle_deg": -90.0},
    "equal eigenvalues": {
        **FREE,
        "friction__coefficient": 0.0,
        "link1__stiffness": 1e7,
        "link2__stiffness": 1.2e7,
        "link2__angle_deg": 0.0,
    },
    "critical damping": {"link1__damping": 2.0 * math.sqrt(1.2e7 * 10.0), "link2__angle_deg": 0.0},
    "thrown up": {"initial__y": 1e-3, "initial__vx": 0.4, "initial__vy": 0.5},
    "pulled off": {"load__force": -4e3},
    "no load": {"load__force": 0.0},
    "speed and load in tables": {
        "wheel__angular_speed": None,
        "wheel__times": [0.0101, 0.0203, 0.0204],
        "wheel__angular_speeds": [0.1, 0.02, -0.1],
        "load__force": None,
        "load__times": [-0.01, 0.00707, 0.0150001],
        "load__forces": [5000.0, 9000.0, 4000.0],
    },
    "a wheel that turns back at once": {
        "wheel__angular_speed": None,
        "wheel__times": [0.02, 0.02 + 1e-8],
        "wheel__angular_speeds": [2.0, -2.0],
    },
}


@pytest.mark.parametrize("name", HARD)
def test_hard_cases_move_as_by_the_event_driven_scheme(name: str) -> None:
    same_as_event_driven(tabled(SQUEAL, solver__duration=0.05, **HARD[name]), 1e-10)


def test_a_shoe_that_rests_on_the_wheel_and_is_pulled_off_leaves_it_at_once() -> None:
    """For a part of a step: at its end the pad is pressed in again. Here the tangential spring pulls it off."""
    pulled: dict[str, Any] = {
        **SQUEAL,
        "wheel": {"radius": 0.5, "angular_speed": 0.11507838902049322},
        "link1": {"stiffness": 1322428.1169843683, "damping": 300.0},
        "link2": {"stiffness": 395238.6330925894, "damping": 1000.0, "angle_deg": -46.18439620304848},
        "friction": {"coefficient": 0.24491735372226153},
        "contact": {"half_length": 0.05, "stiffness": 80458070.83688746},
        "initial": {"x": -0.025755755210794953, "vx": 0.05753919451024661},
        "solver": {"duration": 0.02},
        "output": {"sample_interval": 0.02},
    }
    case = make(pulled)
    same_as_event_driven(case, 1e-10)
    later = make(pulled, initial__y=1e-25)
    np.testing.assert_allclose(motion(case).rows[-1, :4], motion(later).rows[-1, :4], rtol=1e-9)


@pytest.mark.parametrize("gap", [1e-2, 1e-8, -1e-8, -1e-2])
def test_a_touch_within_a_step_is_not_passed_over(gap: float) -> None:
    """The shoe swings freely about its rest, and its velocity just reaches the wheel's, or just does not.

    Where it does, friction turns for a time of sqrt(8 gap)/ω, which may be a ten thousandth of a step.
    """
    base = {
        **COULOMB,
        "wheel": {"radius": 1.0, "angular_speed": 1.0},
        "initial": {"at": "equilibrium", "x": 1.0 + gap},
    }
    case = tabled(base, solver__duration=20.0, output__sample_interval=0.01)
    found = motion(case)
    other = motion(case, Method("event-driven", tolerance=1e-12))
    np.testing.assert_allclose(found.rows[:, [0, 2]], other.rows[:, [0, 2]], rtol=0.0, atol=1e-10)
    assert found.work.steps > system_of(case).samples if gap > 0.0 else found.work.steps == system_of(case).samples


def test_a_run_may_be_cut_into_blocks_anywhere() -> None:
    case = tabled(SQUEAL, solver__duration=0.02, output__sample_interval=1e-3)
    whole = motion(case)
    parts = Stepping(replace(system_of(case), method=EXACT))
    assert parts.system.per_sample > 1
    rows = [parts.block(stop) for stop in range(1, parts.system.steps + 1)]
    np.testing.assert_array_equal(np.concatenate(rows), whole.rows[:-1])
    assert parts.run().energy == whole.energy


@pytest.mark.parametrize("share", [0.9, 0.5, 0.03])
def test_neither_samples_nor_steps_change_the_motion(share: float) -> None:
    close = motion(tabled(SQUEAL, solver__duration=0.1))
    far = motion(tabled(SQUEAL, solver__duration=0.1, output__sample_interval=0.02), replace(EXACT, share=share))
    assert error(far.rows, close.rows[::200]) < 1e-11
    assert far.energy.friction == pytest.approx(close.energy.friction, rel=1e-11)


def test_a_motion_without_bounds_and_events_without_progress_are_failures_with_a_name() -> None:
    case = tabled(SQUEAL)
    for field, value, failure in (("x", 1e20, Failure.DIVERGED), ("crowded", 1000, Failure.STALLED)):
        found = Stepping(replace(system_of(case), method=EXACT))
        setattr(found.state, field, value)
        found.state.events_time = 1e9  # as if no time had gone by
        ended = found.run()
        assert ended.work.failure is failure
        assert np.isfinite(ended.rows).all()
        if failure is Failure.DIVERGED:  # in the first step: there is the sample before it, and no other
            assert ended.rows[:, 0].tolist() == [value]


WITHIN_A_STEP: dict[str, dict[str, Any]] = {
    "slip ends and begins": {
        "shoe": {"mass": 10.0},
        "wheel": {"radius": 0.5, "angular_speed": 38.67392761138728},
        "link1": {"stiffness": 8635835.580614746, "damping": 300.0, "angle_deg": 27.96951695267417},
        "link2": {"stiffness": 3401490.437799982, "damping": 300.0, "angle_deg": 3.318299337443051},
        "load": {"force": 286.79890170858073},
        "friction": {"coefficient": 0.504100161588205},
        "contact": {"half_length": 0.05, "stiffness": 33661595.584848024},
        "solver": {"scheme": "piecewise-exact", "tolerance": 1e-06, "duration": 0.019941196811305205},
        "initial": {
            "x": 0.011157277688601218,
            "y": -0.01257961319804308,
            "vx": 19.335854812421065,
            "vy": -21.567458050692824,
        },
        "output": {"events": True, "sample_interval": 0.019941196811305205},
    },
    "the shoe leaves the wheel and comes back": {
        "shoe": {"mass": 10.0},
        "wheel": {"radius": 0.5, "angular_speed": 26.535200237404144},
        "link1": {"stiffness": 5929094.079844125, "damping": 300.0, "angle_deg": -21.41986199118584},
        "link2": {"stiffness": 1204747.554962049, "damping": 0.0, "angle_deg": -9.152679458000136},
        "load": {"force": 123.1828896954764},
        "friction": {"coefficient": 0.15363348179988487},
        "contact": {"half_length": 0.05, "stiffness": 315329188.09802574},
        "solver": {"scheme": "piecewise-exact", "tolerance": 1e-06, "duration": 0.014533986213253872},
        "initial": {
            "x": 6.293476636493597e-05,
            "y": -3.112028056884347e-11,
            "vx": -0.0007338560552795142,
            "vy": -3.727449561554179e-09,
        },
        "output": {"events": True, "sample_interval": 0.014533986213253872},
    },
}
"""Starts from which a margin rises, falls below zero and rises again within the first step."""


@pytest.mark.parametrize("what", WITHIN_A_STEP)
def test_a_phase_within_a_step_whose_margin_rises_at_both_ends_is_found(what: str) -> None:
    case = Case.model_validate(WITHIN_A_STEP[what])
    found = motion(case)
    other = motion(case, Method("event-driven", tolerance=1e-13))
    scale = np.abs(other.rows[:, :4]).max(axis=0)
    # y is 1e6 times smaller than x, by whose rounding it is off; without the phase it is off by 1e-5 and more
    assert float((np.abs(found.rows[:, :4] - other.rows[:, :4]).max(axis=0) / scale).max()) < 1e-8


@pytest.mark.parametrize("lack", [0.0, 1e-5, 1e-11, 1e-16])
@pytest.mark.parametrize("speed", [1.0, 0.1])
def test_a_shoe_that_all_but_sticks_is_carried_along(lack: float, speed: float) -> None:
    """ẍ + x = λ, |λ| ≤ 1, with the wheel's velocity U from x = -1 - ε on, where friction lacks ε.

    It runs ahead of the wheel by ε²/2U m/s at most and 2ε³/3U² m, for a time 2ε/U, and then sticks until x = 1.
    """
    start = {"initial__at": "rest", "initial__x": -1.0 - lack, "initial__y": -1.0, "initial__vx": speed}
    changes = {
        "wheel__angular_speed": speed,
        "solver__duration": 1.9 / speed,
        "output__sample_interval": 0.1 / speed,
    }
    case = make(COULOMB, **start, **changes, solver__scheme="piecewise-exact", solver__step=None)
    motion = solve(system_of(case))
    assert not motion.work.failed
    times = np.arange(len(motion.rows)) * motion.system.interval
    ahead = 2.0 * lack**3 / (3.0 * speed**2)
    np.testing.assert_allclose(motion.rows[:, 0], -1.0 - lack + speed * times, atol=ahead + 1e-14, rtol=0)
    np.testing.assert_allclose(motion.rows[1:, 2], speed, rtol=1e-14)


@pytest.mark.parametrize("lack", [1e-9, 1e-12, 1e-15])
def test_a_shoe_that_comes_to_all_but_stick_by_slip_goes_on(lack: float) -> None:
    """(x - 1)² + ẋ² = 1 + (2 + ε)²: pushed by friction it has the wheel's velocity, 1 m/s, at x = -1 - ε."""
    case = make(
        COULOMB,
        initial__at="rest",
        initial__x=1.0 - math.sqrt(1.0 + (2.0 + lack) ** 2),
        initial__y=-1.0,
        initial__vx=0.0,
        wheel__angular_speed=1.0,
        solver__duration=4.0,
        output__sample_interval=0.1,
        solver__scheme="piecewise-exact",
        solver__step=None,
    )
    assert not solve(system_of(case)).work.failed
