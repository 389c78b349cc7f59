"""The event-driven scheme against two independent references, exact solutions and identities."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import RK45
from scipy.integrate._ivp import dop853_coefficients as scipy

from brakecli.analysis.stability.report import stability
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, Stepping, solve
from brakecli.solver.method import Method
from brakecli.solver.motion.tableaus import DENSE, END_STAGE, ERROR_WEIGHTS, NODES, THIRD, A
from brakecli.solver.quantities import HISTORY, ContactState, Failure
from brakecli.studies.runs.limits import check
from tests.analysis.branches import phasewise
from tests.analysis.branches.phasewise import Phasewise
from tests.analysis.shoes import Shoe
from tests.campaign import counts
from tests.examples import COULOMB, ROUGH, SQUEAL, Result, make, simulate
from tests.solver.solve_ivp_reference import SolveIvp

STICK = ContactState.STICK


def event_driven(base: dict[str, Any], tolerance: float = 1e-10, **changes: Any) -> Case:
    """A shared case by this scheme, sampled as it was."""
    interval = base.get("output", {}).get("sample_interval", base["solver"]["step"])
    changes = {"output__sample_interval": interval, **changes}
    own = {"solver__scheme": "event-driven", "solver__tolerance": tolerance, "solver__step": None}
    return make(base, **own, **changes)


def error(rows: NDArray[np.float64], exact: NDArray[np.float64]) -> float:
    """The largest deviation over the largest value, of the worst of x, y and their velocities."""
    return float((np.abs(rows[:, :4] - exact[:, :4]).max(axis=0) / np.abs(exact[:, :4]).max(axis=0)).max())


def mirrored(case: dict[str, Any]) -> dict[str, Any]:
    """The same shoe seen from behind: x, the wheel's speed and the angles change sign."""
    wheel = case["wheel"]
    start = case["initial"]
    links = {link: {**case[link], "angle_deg": -case[link]["angle_deg"]} for link in ("link1", "link2")}
    initial = {**start, "x": -start["x"], "vx": -start["vx"]}
    return {**case, **links, "wheel": {**wheel, "angular_speed": -wheel["angular_speed"]}, "initial": initial}


def flat_case(rng: np.random.Generator, tolerance: float) -> tuple[dict[str, Any], float]:
    """A smooth shoe thrown onto the wheel, and a frequency ω (rad/s): stiffnesses are 0.1 to 10 times m ω²."""
    omega = 10 ** rng.uniform(2, 3.5)
    m = 10 ** rng.uniform(-1, 2)
    load = 10 ** rng.uniform(2, 4)
    c_1, c_2, k = (m * omega**2 * 10 ** rng.uniform(-1, 1) for _ in range(3))
    b_1, b_2 = (m * omega * 10 ** rng.uniform(-3, -0.5) for _ in range(2))
    size = load / (m * omega**2)
    belt = float(rng.choice([-1, 1])) * size * omega * 10 ** rng.uniform(-2, 0.3)
    return {
        "shoe": {"mass": m},
        "wheel": {"radius": 0.5, "angular_speed": 2.0 * belt},
        "link1": {"stiffness": c_1, "damping": b_1, "angle_deg": rng.uniform(-60, 60)},
        "link2": {"stiffness": c_2, "damping": b_2, "angle_deg": rng.uniform(-60, 60)},
        "load": {"force": load},
        "friction": {"coefficient": rng.uniform(0, 1.2)},
        "contact": {"half_length": 0.05, "stiffness": k / 0.1},
        "initial": {
            "x": size * rng.normal(),
            "y": -size * rng.uniform(0.1, 1),
            "vx": size * omega * rng.normal(),
            "vy": size * omega * rng.normal(),
        },
        "solver": {"scheme": "event-driven", "tolerance": tolerance, "duration": 30 / omega},
        "output": {"sample_interval": 0.1 / omega},
    }, omega


def exact_rows(case: dict[str, Any], result: Result) -> tuple[NDArray[np.float64], set[str]]:
    """The samples of a run by another scheme, and the phases on the way."""
    reference = Phasewise(Shoe.of(case))
    return reference.samples(result.rows[0, :4], case["output"]["sample_interval"], len(result.rows) - 1)


def amplification(case: dict[str, Any], rows: NDArray[np.float64]) -> float:
    """By how much the motion amplifies a disturbance of 1e-7 of any component at its start."""
    sizes = dict(zip(("x", "y", "vx", "vy"), np.abs(rows[:, :4]).max(axis=0), strict=True))
    disturbed = [
        {**case, "initial": {**case["initial"], name: case["initial"][name] + 1e-7 * size}}
        for name, size in sizes.items()
    ]
    return max(error(simulate(Case.model_validate(each)).rows, rows) for each in disturbed) / 1e-7


@pytest.mark.parametrize("motions", counts(20, 60))
def test_flat_motions_are_exact_through_stick_and_lift_off(motions: int) -> None:
    # A step errs by its rounding, about 1e-15 of the motion; 1e4 times that of some ten steps is 1e-10.
    rng = np.random.default_rng(1)
    kept = stuck = opened = both = 0
    for _ in range(motions):
        case, _ = flat_case(rng, 1e-13)
        result = simulate(Case.model_validate(case))
        assert result.work.failure is Failure.NONE
        if amplification(case, result.rows) > 1e4:
            continue
        exact, seen = exact_rows(case, result)
        assert error(result.rows, exact) < 1e-10
        sticks = phasewise.STICK in seen
        opens = phasewise.OPEN in seen
        kept = kept + 1
        stuck = stuck + sticks
        opened = opened + opens
        both = both + (sticks and opens)
    assert kept == motions  # none amplifies that much
    assert stuck >= 0.6 * motions
    assert opened >= 0.8 * motions
    assert both >= 0.5 * motions


@pytest.mark.parametrize("motions", counts(5, 20))
def test_overcritical_dashpots_leave_the_tolerance_between_steps(motions: int) -> None:
    """Steps at the limit of stability end where they should, but what they give in between is wrong by 3e-7."""
    rng = np.random.default_rng(5)
    for _ in range(motions):
        case, omega = flat_case(rng, 1e-10)
        for link in ("link1", "link2"):
            case[link]["damping"] = case["shoe"]["mass"] * omega * 10 ** rng.uniform(0.3, 1.7)
        result = simulate(Case.model_validate(case))
        assert error(result.rows, exact_rows(case, result)[0]) < 1e-10


def rough_case(rng: np.random.Generator, tolerance: float) -> tuple[dict[str, Any], float]:
    """A rough shoe on a rough wheel: amplitudes of a tenth to all of the compression, waves of 0.2 to 3 pads."""
    case, omega = flat_case(rng, tolerance)
    size = case["load"]["force"] / (case["shoe"]["mass"] * omega**2)
    shortest = 2 * abs(case["wheel"]["angular_speed"] * 0.5) / omega  # passes in two radians of the motion
    case["roughness"] = {}
    for surface in ("shoe", "wheel"):
        n = int(rng.integers(1, 3))
        lengths = np.maximum(0.05 * 10 ** rng.uniform(-0.7, 0.5, n), shortest)
        case["roughness"][surface] = {
            "amplitudes": (size * rng.uniform(0.1, 0.6, n)).tolist(),
            "wavelengths": lengths.tolist(),
            "phases_deg": rng.uniform(0, 360, n).tolist(),
        }
    case["solver"]["duration"] = 20 / omega
    case["output"]["sample_interval"] = 0.2 / omega
    return case, omega


@pytest.mark.parametrize("motions", counts(0, 6))
def test_rough_motions_agree_with_an_independent_solver(motions: int) -> None:
    # scipy's error estimate is blind to kinks at certain places of a step: its tolerance of 1e-12 alone leaves
    # errors of up to 1e-8. A longest step of 0.002/ω bounds what a kink can do there.
    rng = np.random.default_rng(5)
    seen: set[float] = set()
    partly = phases = 0
    for _ in range(motions):
        case, omega = rough_case(rng, 1e-11)
        result = simulate(Case.model_validate(case))
        assert result.work.failure is Failure.NONE
        assert amplification(case, result.rows) < 1e4
        reference = SolveIvp(system_of(Case.model_validate(case)), 1e-13, 0.002 / omega)
        exact = reference.run(result.rows[0, :4], result.time)
        assert error(result.rows, exact) < 1e-9
        seen |= set(result.state)
        partly += int(np.sum((result.contact_fraction > 0.0) & (result.contact_fraction < 1.0)))
        phases += len(reference.visited)
    assert seen == {-1.0, 0.0, 1.0, 2.0}
    assert partly > 30 * motions
    assert phases > 5 * motions


def test_the_error_falls_with_the_tolerance() -> None:
    # Through stick and lift-off, against exact phases. The errors of all steps add up to about the tolerance.
    rng = np.random.default_rng(2)
    tolerances = 10.0 ** np.arange(-4, -12, -1)
    worst = np.zeros(tolerances.size)
    for _ in range(20):
        case, _ = flat_case(rng, 1e-13)
        for index, tolerance in enumerate(tolerances):
            case["solver"]["tolerance"] = float(tolerance)
            result = simulate(Case.model_validate(case))
            if index == 0:
                exact, _ = exact_rows(case, result)
            worst[index] = max(worst[index], error(result.rows, exact))
    assert np.all(np.diff(worst) < 0)
    assert np.all(worst < 10 * tolerances)  # motions that amplify what came before
    assert np.polyfit(np.log(tolerances), np.log(worst), 1)[0] == pytest.approx(1.0, abs=0.15)


def test_coulomb_oscillator_comes_to_its_exact_rest() -> None:
    for tolerance in (1e-6, 1e-9, 1e-12):
        result = simulate(event_driven(COULOMB, tolerance))
        # x is up to 13.3; six half cycles of free vibration amplify nothing.
        assert result.x[-1] == pytest.approx(0.6821789367236466, abs=13.3 * tolerance)
        assert result.state[-1] == STICK
        assert result.vx[-1] == 0.0


def test_the_energy_account_closes_to_the_tolerance() -> None:
    closed = 0
    for base, duration in ((SQUEAL, 0.1), (ROUGH, 0.004), (COULOMB, 60.0)):
        for tolerance in (1e-6, 1e-9):
            result = simulate(event_driven(base, tolerance, solver__duration=duration))
            assert abs(result.energy.relative_closing_error) < 10 * tolerance
            assert result.energy.scheme == 0.0
            closed += 1
    assert closed == 6


@pytest.mark.parametrize("seed", range(5))
def test_the_mirror_image_of_a_motion_is_a_motion(seed: int) -> None:
    case, _ = flat_case(np.random.default_rng(seed), 1e-10)
    one, other = (simulate(Case.model_validate(each)) for each in (case, mirrored(case)))
    np.testing.assert_array_equal(other.rows[:, [1, 3, 5, 6]], one.rows[:, [1, 3, 5, 6]])
    np.testing.assert_array_equal(other.rows[:, [0, 2, 4]], -one.rows[:, [0, 2, 4]])


def stick_from_the_start(**changes: Any) -> Result:
    """A shoe pressed on so hard by so rough a friction that the wheel carries it along."""
    base = {**SQUEAL, "friction": {"coefficient": 5.0}, "solver": {"step": 1e-5, "duration": 0.002}}
    base["initial"] = {"y": -4e-4, "vx": 0.05, "x": -1e-4}
    return simulate(event_driven(base, 1e-10, **changes))


@pytest.mark.parametrize(("ramp", "speed"), [(1e-9, 20.0), (1e-8, 4.0), (1e-6, 20.0)])
def test_a_wheel_that_turns_back_late_moves_the_shoe_as_one_that_does_so_early(ramp: float, speed: float) -> None:
    """Its velocity at a time that is rounded to ε t is uncertain by 2 U ε t / ramp, 1e-6 m/s, were it taken."""

    def after(start: float) -> NDArray[np.float64]:
        wheel = {"radius": 0.5, "times": [start, start + ramp], "angular_speeds": [speed, -speed]}
        base = {**SQUEAL, "wheel": wheel, "initial": {"at": "equilibrium"}, "output": {"sample_interval": 1e-3}}
        case = event_driven(base, 1e-12, friction__coefficient=0.3, solver__duration=start + 0.05)
        return simulate(case).rows[-50:]

    assert error(after(0.7), after(0.01)) < 1e-10


def test_a_stuck_shoe_follows_a_wheel_that_speeds_up() -> None:
    speeds = {"angular_speed": None, "times": [0.0, 0.001], "angular_speeds": [0.1, 0.3]}
    result = stick_from_the_start(**{f"wheel__{key}": value for key, value in speeds.items()})
    assert set(result.state) == {STICK}
    t = result.time
    travel = np.where(t < 0.001, 0.05 * t + 50.0 * t**2, 1e-4 + 0.15 * (t - 0.001))
    assert np.abs(result.x - (travel - 1e-4)).max() < 1e-18
    np.testing.assert_allclose(result.vx, np.where(t < 0.001, 0.05 + 100.0 * t, 0.15), rtol=4e-16)


def test_knots_of_the_schedules_end_a_step() -> None:
    """A load and a speed that jump in slope within a sample: the same motion whatever is sampled."""
    kinks = {
        "wheel__angular_speed": None,
        "wheel__times": [0.0101, 0.0203],
        "wheel__angular_speeds": [0.1, 0.02],
        "load__force": None,
        "load__times": [0.0, 0.00707, 0.0150001],
        "load__forces": [5000.0, 9000.0, 4000.0],
    }
    fine = simulate(event_driven(SQUEAL, 1e-12, solver__duration=0.03, output__sample_interval=1e-5, **kinks))
    coarse = simulate(event_driven(SQUEAL, 1e-12, solver__duration=0.03, output__sample_interval=1e-3, **kinks))
    assert error(coarse.rows, fine.rows[::100]) < 1e-11
    assert {-1.0, 0.0} <= set(fine.state)
    errors = []
    for step in (2e-6, 1e-6, 5e-7):
        layers = simulate(
            make(
                SQUEAL,
                solver__duration=0.03,
                solver__step=step,
                output__sample_interval=1e-3,
                **kinks,
            )
        )
        errors.append(error(layers.rows, coarse.rows))
    assert errors[2] < errors[1] < errors[0] < 1e-3


def test_a_run_may_be_cut_into_blocks_anywhere() -> None:
    whole = simulate(event_driven(SQUEAL, solver__duration=0.02))
    motion = Stepping(system_of(event_driven(SQUEAL, solver__duration=0.02)))
    rows = [motion.block(stop) for stop in range(1, motion.system.steps + 1)]
    np.testing.assert_array_equal(np.concatenate(rows), whole.rows[:-1])


def test_samples_far_apart_end_where_close_ones_do() -> None:
    # More steps than a call of the loop takes, between two samples; the motion does not depend on its samples.
    close = simulate(event_driven(SQUEAL, 1e-12, solver__duration=0.4))
    far = simulate(event_driven(SQUEAL, 1e-12, solver__duration=0.4, output__sample_interval=0.4))
    assert far.work.steps > 1000
    assert len(far.rows) == 2
    assert error(far.rows, close.rows[[0, -1]]) < 1e-9


def test_a_wheel_at_rest_holds_the_shoe() -> None:
    base = {**SQUEAL, "wheel": {"radius": 0.5, "angular_speed": 0.0}, "initial": {"at": "equilibrium", "vx": 0.05}}
    result = simulate(event_driven(base, 1e-10))
    assert result.state[0] == ContactState.FORWARD_SLIP
    assert set(result.state[-100:]) == {STICK}
    assert np.all(result.vx[-100:] == 0.0)
    assert np.ptp(result.x[-100:]) == 0.0


def test_a_touch_that_only_grazes_ends() -> None:
    # y = 5.5 + 5.5 cos t: the lowest point of each swing is the wheel itself, to rounding.
    base = {**COULOMB, "load": {"force": -5.5}, "initial": {"y": 11.0, "x": 1.0}}
    result = simulate(event_driven(base, 1e-12, solver__duration=60.0))
    assert result.work.failure is Failure.NONE
    np.testing.assert_allclose(result.y, 5.5 + 5.5 * np.cos(result.time), atol=1e-9)


def test_rest_on_the_border_of_the_friction_cone_ends() -> None:
    # The spring pulls with exactly what friction can hold: x = 1 at rest, from the start on.
    base = {**COULOMB, "initial": {"at": "equilibrium", "x": 1.0}}
    result = simulate(event_driven(base, 1e-12, solver__duration=10.0))
    assert result.work.failure is Failure.NONE
    assert np.abs(result.x - 1.0).max() <= 1e-12


def test_steps_that_shrink_to_nothing_are_a_failure_with_a_name() -> None:
    motion = Stepping(system_of(event_driven(SQUEAL)))
    motion.state.x = math.nan  # no step from here has a known error
    work = motion.run().work
    assert work.failure is Failure.STALLED
    assert "solver.tolerance" in work.failure.sentence


def test_events_without_progress_are_a_failure_with_a_name() -> None:
    motion = Stepping(system_of(event_driven(SQUEAL)))
    state = motion.state
    # as if 1000 of them had come, and no time gone by
    state.crowded = 1000
    state.events_time = 1e9
    work = motion.run().work
    assert work.failure is Failure.STALLED
    assert work.steps > 0


def test_phases_that_end_at_once_are_a_failure_with_a_name() -> None:
    # At rest on a wheel at rest, as the load comes on: the coupling pulls harder than friction holds from 0 on.
    case = event_driven(SQUEAL, wheel__angular_speed=0.0, friction__coefficient=0.1)
    assert simulate(case).work.failure is Failure.NONE
    motion = Stepping(system_of(case))
    motion.plant.runge.switches = 60
    work = motion.run().work
    assert work.failure is Failure.STALLED
    assert work.steps == 0


def test_closed_form_that_does_not_hold_is_a_failure() -> None:
    result = simulate(event_driven(ROUGH, 1e-6, contact__evaluator="closed-form", contact__nodes=None))
    assert result.work.failure is Failure.NOT_CLOSED


def test_no_step_limits_or_biases_the_scheme() -> None:
    system = system_of(event_driven(SQUEAL))
    report = stability(system)
    assert report.critical is not None
    assert report.discrete is not None
    assert report.discrete.step_limit is None
    assert report.discrete.bias == 0.0
    assert report.discrete.critical_friction == report.critical.friction
    assert report.discrete.growth == max(value.real for value in report.eigenvalues)
    found = check(system)
    assert found.step is None
    assert found.limits.growth == 1.0
    assert found.warnings == ()
    # A rough guess: within a factor of three.
    assert found.steps == pytest.approx(simulate(event_driven(SQUEAL)).work.steps, rel=2.0)


OPEN = {**ROUGH, "contact": {"half_length": 0.05, "stiffness": 5e7}}
SMALL = {"amplitudes": [1e-6, 7e-7], "wavelengths": [0.02, 0.011]}
"""A pad that opens and closes."""


def on_nodes(case: Case, tolerance: float, nodes: int = 256) -> Motion:
    """The motion of a case by steps on nodes instead of the exact contact."""
    return solve(system_of(case), Method("event-driven", evaluator="cells", nodes=nodes, tolerance=tolerance))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("base", [OPEN, {**OPEN, "wheel": {"radius": 0.5, "angular_speed": 0.1}}])
def test_steps_on_nodes_keep_their_tolerance(base: dict[str, Any], tolerance: float) -> None:
    """Of both orders, in slip and in stick-slip, beside the same nodes at a tolerance that leaves no error.

    The motion may amplify the errors of steps, as in every run of this scheme: twice the tolerance is allowed.
    """
    case = event_driven(base, solver__duration=0.01, output__sample_interval=1e-4)
    fine = on_nodes(case, 1e-11)
    found = on_nodes(case, tolerance)
    assert error(found.rows, fine.rows) <= 2.0 * tolerance
    assert found.work.evaluators["cells"] > 5
    assert abs(found.energy.relative_closing_error) <= tolerance


def test_nodes_come_to_the_exact_contact_as_their_number_grows() -> None:
    """With the square of their spacing at least: sixteen times the nodes leave far less than a hundredth."""
    case = event_driven(OPEN, solver__duration=0.005, output__sample_interval=1e-4)
    exact = simulate(case).rows
    few, many = (error(on_nodes(case, 1e-10, nodes).rows, exact) for nodes in (256, 4096))
    assert many <= few / 100.0
    assert few <= 1e-2


@pytest.mark.parametrize("wheel", [{"roughness__wheel": SMALL}, {}])
@pytest.mark.parametrize("start", [{"at": "equilibrium", "y": -1e-4}, {"y": -1e-4, "vx": 0.05}])
def test_nodes_that_all_touch_make_the_motion_of_the_exact_contact(
    wheel: dict[str, Any], start: dict[str, Any]
) -> None:
    """Cell means: the closed form is the sum over the nodes. Both methods have errors of 1e-10 at most."""
    shoe = {**SMALL, "phases_deg": [40.0, 70.0]}  # a wheel without waves, and x = 0, have no angles to tell by
    case = event_driven({**SQUEAL, "initial": start}, roughness__shoe=shoe, **wheel)
    exact = simulate(case)
    found = on_nodes(case, 1e-10, 64)
    assert (0.0 in found.rows[:, list(HISTORY).index("state")]) == ("vx" in start)
    assert set(found.work.evaluators) == set(exact.work.evaluators) == {"closed-form"}
    assert error(found.rows, exact.rows) <= 2e-9
    for item in ("belt", "friction", "roughness"):  # the account finds the last in another way
        apart = getattr(found.energy, item) - getattr(exact.energy, item)
        assert abs(apart) <= 1e-6 * exact.energy.stored  # works are not held to the tolerance


def test_the_tableaus_are_those_of_scipy() -> None:
    """Not imported from there: that takes 0.3 s."""
    both = [(A, scipy.A), (NODES, scipy.C), (THIRD, scipy.E3), (ERROR_WEIGHTS, scipy.E5), (DENSE, scipy.D)]
    for ours, theirs in both:
        np.testing.assert_array_equal(ours[0, ..., : theirs.shape[-1]], theirs)
    np.testing.assert_array_equal(A[1, :6, :5], RK45.A)
    np.testing.assert_array_equal(A[1, END_STAGE, :6], RK45.B)
    np.testing.assert_array_equal(NODES[1, :6], RK45.C)
    np.testing.assert_array_equal(ERROR_WEIGHTS[1, [*range(6), END_STAGE]], -RK45.E)
