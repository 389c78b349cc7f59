"""Critical values by the growth of small disturbances, held against eigenvalues and closed forms."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.branches.forced import Forced
from brakecli.analysis.branches.line import Line
from brakecli.analysis.stability.report import stability
from brakecli.api.inputs import load_sweep
from brakecli.case.case import changed
from brakecli.case.system import system_of
from brakecli.solver.integrate import solve
from brakecli.solver.links import natural_frequencies
from brakecli.solver.period import common_period
from brakecli.solver.system import Initial
from brakecli.studies.sweeps.critical import search
from brakecli.studies.sweeps.simulate import verdict_of
from brakecli.studies.sweeps.tables import Critical
from brakecli.studies.sweeps.windows import Outcome, Search
from tests.analysis.test_regime_table import random_case
from tests.campaign import campaign, counts
from tests.commands import ROOT
from tests.examples import MODE_COUPLING, ROUGH, SQUEAL, make
from tests.studies.sweeps.independent import smooth_is_unstable

OPENS: dict[str, Any] = {  # surfaces that open; the wheel repeats after 11.3 ms, the shoe's waves do not matter
    "shoe": {"mass": 17.109774},
    "wheel": {"radius": 0.5, "angular_speed": 6.74},
    "link1": {"stiffness": 32232120.1, "damping": 139.432415},
    "link2": {"stiffness": 31646471.7, "damping": 139.432415, "angle_deg": 15.583161},
    "load": {"force": 109.98632},
    "friction": {"coefficient": 0.3},
    "contact": {"half_length": 0.05, "stiffness": 116877910.0},
    "roughness": {
        "shoe": {"amplitudes": [1.0619e-5, 1.0619e-5], "wavelengths": [0.038, 0.028]},
        "wheel": {"amplitudes": [2.1238e-5], "wavelengths": [0.038]},
    },
    "solver": {"step": 2e-5, "duration": 0.5},
}


def found(
    tables: dict[str, Any], lower: float, upper: float, key: str = "friction__coefficient", **changes: Any
) -> Search:
    """Search along a key of the case; `changes` are keys of [critical], or, as table__key, of the case."""
    search_keys = {name: value for name, value in changes.items() if "__" not in name}
    case_keys = {name: value for name, value in changes.items() if "__" in name}
    critical = Critical(parameter=key.replace("__", "."), lower=lower, upper=upper, **search_keys)
    return search(critical, Line(make(tables, **case_keys), [critical.parameter], lower, upper))


def bracket(answer: Search) -> tuple[float, float, float, float]:
    """The value that was found, its lower and its upper end, and its error bar."""
    assert answer.value is not None
    assert answer.lower is not None
    assert answer.upper is not None
    assert answer.error is not None
    return answer.value, answer.lower, answer.upper, answer.error


@pytest.mark.parametrize("shoes", counts(4, 20))
def test_the_critical_friction_of_random_flat_damped_shoes_is_bracketed(shoes: int) -> None:
    rng = np.random.default_rng(5)
    tried = 0
    while tried < shoes:
        tables = random_case(rng)
        exact = stability(system_of(make(tables))).critical
        if exact is None or exact.friction > 3.0:
            continue
        system = system_of(make(tables))
        fast = natural_frequencies(system.coefficients, system.contact_stiffness)[1]
        tables["solver"] = {"step": 1.0 / (100.0 * fast), "duration": 50.0 / fast}
        tolerance = 1e-3 * exact.friction
        answer = found(tables, 0.0, rng.uniform(1.3, 3.0) * exact.friction, tolerance=tolerance)
        assert answer.outcome is Outcome.FOUND
        value, lower, upper, error = bracket(answer)
        assert lower <= exact.friction <= upper, tables
        assert upper - lower <= tolerance
        assert abs(value - exact.friction) <= error
        assert answer.eigenvalue == value
        tried += 1


def test_without_dashpots_flutter_is_found_though_nothing_decays_below_it() -> None:
    answer = found(MODE_COUPLING, 0.0, 2.0, tolerance=1e-4, solver__duration=5.0)
    assert answer.value == pytest.approx(0.75, abs=1e-4)
    assert answer.eigenvalue == pytest.approx(0.75, abs=1e-12)


def test_the_critical_value_is_that_of_the_equations_and_the_bias_that_of_the_scheme() -> None:
    answer = found(
        MODE_COUPLING, 0.0, 2.0, solver__theta=[1.0, 1.0], solver__step=0.1, output__sample_interval=0.1
    )
    assert answer.value == pytest.approx(0.75, abs=1e-12)
    assert answer.bias == pytest.approx(0.8115433 - 0.75, abs=1e-6)  # what the amplification matrix gives


def test_divergence_is_found_where_steady_sliding_ends() -> None:
    tables = {**SQUEAL, "link2": {**SQUEAL["link2"], "angle_deg": -30.0}}
    exact = stability(system_of(make(tables))).critical
    assert exact is not None
    assert exact.instability == "divergence"
    _, lower, upper, _ = bracket(found(tables, 0.0, 1.5 * exact.friction, tolerance=1e-3))
    assert lower <= exact.friction <= upper


def test_another_parameter_than_friction_is_searched_by_both_methods() -> None:
    answer = found(SQUEAL, 1.0, 10.0, "link2__angle_deg", tolerance=1e-3)
    assert answer.outcome is Outcome.REGAINED  # the steeper the link, the more friction it takes
    assert answer.value == pytest.approx(answer.eigenvalue, abs=1e-3)
    alone = found(SQUEAL, 1.0, 10.0, "link2__angle_deg", method="eigenvalue")
    assert alone.value == answer.eigenvalue
    at = stability(system_of(make(SQUEAL, link2__angle_deg=alone.value))).critical
    assert at is not None
    assert at.friction == pytest.approx(SQUEAL["friction"]["coefficient"], abs=1e-7)


@pytest.mark.parametrize("method", ["simulation", "eigenvalue"])
def test_a_range_without_a_change_says_so(method: str) -> None:
    assert found(SQUEAL, 0.0, 0.3, method=method).outcome is Outcome.STABLE
    assert found(SQUEAL, 0.8, 1.2, method=method).outcome is Outcome.UNSTABLE
    assert found(SQUEAL, 0.0, 1.0, method=method, wheel__angular_speed=0.0).outcome is Outcome.NO_SLIDING
    assert found(SQUEAL, 0.0, 0.3, method=method).value is None


def test_vibration_lasts_below_the_critical_friction() -> None:
    """A stiff contact on a slow wheel: from rest the shoe lifts and sticks far below the loss of stability."""
    tables = {
        "shoe": {"mass": 15.7},
        "wheel": {"radius": 0.5, "angular_speed": 0.0106},
        "link1": {"stiffness": 1.6e7, "damping": 85.0, "angle_deg": 27.8},
        "link2": {"stiffness": 2.85e7, "damping": 199.0, "angle_deg": 16.4},
        "load": {"force": 1144.0},
        "friction": {"coefficient": 1.0},
        "contact": {"half_length": 0.05, "stiffness": 6e7},
        "solver": {"step": 2e-5, "duration": 0.5},
    }
    answer = found(tables, 0.0, 4.0, tolerance=0.05)
    assert answer.outcome is Outcome.FOUND
    assert answer.lower is not None
    assert answer.sustained is not None
    assert answer.sustained < 0.5 * answer.lower
    for friction, lasts in ((answer.sustained - 0.1, False), (answer.sustained + 0.1, True)):
        verdict = verdict_of(make(tables, friction__coefficient=friction, solver__duration=8.0))
        assert verdict is not None
        assert (verdict.regime != "damped") is lasts


def test_a_start_from_rest_needs_no_less_friction_where_nothing_coexists() -> None:
    answer = found(SQUEAL, 0.3, 0.9, tolerance=1e-3, solver__duration=0.5)
    assert answer.sustained == pytest.approx(answer.value, abs=1e-3)


@pytest.mark.parametrize("speed", [0.16782197452490075, 10.0])
def test_slow_sliding_is_no_stick_to_a_three_layer_scheme(speed: float) -> None:
    """Friction changes its velocity by more than the wheel's in a step, and its samples read as stick."""
    tables = {
        "shoe": {"mass": 0.310697},
        "wheel": {"radius": 0.5, "angular_speed": speed},
        "link1": {"stiffness": 41683.334, "angle_deg": 19.533686},
        "link2": {"stiffness": 376572.5, "angle_deg": -15.361746},
        "load": {"force": 1491.1643},
        "friction": {"coefficient": 0.3},
        "contact": {"half_length": 0.0138968, "stiffness": 1333325.8},
        "solver": {"scheme": "three-layer", "step": 1.7406422e-4, "duration": 0.05},
    }
    answer = found(tables, 2.9353636, 15.732434, tolerance=1e-3)
    exact = stability(system_of(make(tables))).critical
    assert exact is not None
    assert answer.outcome is Outcome.FOUND
    assert answer.value == pytest.approx(exact.friction, abs=1e-3)


def test_a_start_that_takes_long_to_settle_is_given_the_time() -> None:
    """Over its own duration the amplitude still falls, towards a limit cycle far below the critical value."""
    tables = {
        "shoe": {"mass": 1.1845788},
        "wheel": {"radius": 0.5, "angular_speed": 2.5175146},
        "link1": {"stiffness": 156538.24, "damping": 1.2650601},
        "link2": {"stiffness": 44718.626, "damping": 0.9819066, "angle_deg": 20.719246},
        "load": {"force": 2593.4866},
        "friction": {"coefficient": 0.3},
        "contact": {"half_length": 0.0129496, "stiffness": 5016209.9},
        "solver": {"step": 3.610138e-4, "duration": 0.5244317},
    }
    answer = found(tables, 4.0, 20.0, tolerance=1e-2)
    assert answer.value == pytest.approx(5.683, abs=1e-2)
    assert (answer.sustained, answer.sustained_outcome) == (None, Outcome.SUSTAINED)
    verdict = verdict_of(make(tables, friction__coefficient=4.0, solver__duration=16.0))  # as one of 6 s asks
    assert verdict is not None
    assert verdict.regime == "relaxation"


def test_roughness_that_opens_the_contact_moves_the_critical_friction() -> None:
    tables = {**ROUGH, "link2": {"stiffness": 2.2e7, "angle_deg": 10.0}, "link1": {"stiffness": 2e7}}
    flat = found({**tables, "roughness": {}}, 0.0, 4.0, method="eigenvalue")
    rough = found(tables, 0.0, 4.0, method="eigenvalue")
    assert flat.value is not None
    assert rough.value is not None
    assert abs(rough.value - flat.value) > 0.05 * flat.value
    assert math.isfinite(rough.value)


def event_driven_growth(friction: float) -> float:
    """Growth (1/s) by the event-driven scheme with the exact contact, over a whole period of the wheel.

    Newton's method on the map over the period finds the forced motion; its derivative has the multipliers.
    """
    point = Forced.along(Line(make(OPENS), ["friction.coefficient"], 0.0, 3.0)).begin(friction / 3.0)
    assert point is not None
    solver = {"scheme": "event-driven", "tolerance": 1e-11, "duration": 1.0}
    system = system_of(
        make({**OPENS, "solver": solver, "output": {"sample_interval": 1e-4}}, friction__coefficient=friction)
    )
    period = common_period(system)
    depth = 1e-6
    assert period is not None
    scales = depth * np.array([1.0, 1.0, *[2.0 * math.pi * system.natural_frequencies[1]] * 2])
    system = replace(system, interval=period, duration=period)

    def end(state: Any) -> Any:
        return solve(replace(system, initial=Initial(*(state * scales).tolist()))).rows[-1, :4] / scales

    state = np.array(point.facts.state) / scales
    for _ in range(4):
        after = end(state)
        derivative = np.array([end(state + 1e-5 * direction) - after for direction in np.eye(4)]).T / 1e-5
        state = state + np.linalg.solve(np.eye(4) - derivative, after - state)
    assert np.abs(end(state) - state).max() < 1e-6
    return math.log(float(np.abs(np.linalg.eigvals(derivative)).max())) / period


@pytest.mark.usefixtures("without_runs")
@pytest.mark.parametrize(
    ("angle", "friction", "unstable"),
    [
        (15.0, 1.9, True),
        pytest.param(15.0, 0.3, False, marks=campaign),
    ],
)
def test_multipliers_of_one_are_no_instability_without_dashpots(
    angle: float, friction: float, unstable: bool | None
) -> None:
    """Below flutter all multipliers have modulus one; where the wave meets a natural frequency, as at 25 degrees,
    a pad that opens bounds the motion.
    """
    case = load_sweep(str(ROOT / "cases/paper/alpha-open.toml"), None).plan.case({})
    bare = changed(case, link1={"damping": 0.0}, link2={"damping": 0.0, "angle_deg": angle})
    critical = Critical(parameter="friction.coefficient", lower=0.05, upper=2.0)
    answer = search(critical, Line(bare, [critical.parameter], critical.lower, critical.upper))
    assert any(low < friction < high for low, high in answer.windows) is unstable


@campaign
def test_all_windows_of_instability_are_found_where_surfaces_open() -> None:
    answer = found(OPENS, 1.8, 2.2)
    assert len(answer.windows) == 2
    assert answer.windows[-1][1] == 2.2
    inside = [0.5 * (low + high) for low, high in answer.windows]
    between = 0.5 * (answer.windows[0][1] + answer.windows[1][0])
    assert [event_driven_growth(value) > 0.0 for value in (*inside, between, 1.9)] == [True, True, False, False]


@pytest.mark.parametrize(
    ("waves", "period"),
    [
        ({"wavelengths": [0.03, 0.013]}, 0.39),
        ({"wavelengths": [0.1, 0.3]}, 0.3),
        ({"wavenumbers": [200.0, 300.0]}, 2.0 * math.pi / 100.0),
        ({"wavelengths": [0.02, 0.02 * math.sqrt(2.0)]}, None),
        ({"wavelengths": [0.03011, 0.01327]}, None),  # after 40 m and more than ten seconds
    ],
)
def test_the_period_of_the_wheel_is_that_of_the_decimals_that_are_written(
    waves: dict[str, Any], period: float | None
) -> None:
    wheel = {"amplitudes": [1e-6, 1e-6], **waves}
    time = common_period(system_of(make(SQUEAL, wheel__angular_speed=2.0, roughness__wheel=wheel)))
    assert (time is None) if period is None else time == pytest.approx(period, rel=1e-12)  # U = 1 m/s


def test_windows_are_found_by_both_methods_and_cut_by_the_bounds() -> None:
    for method in ("simulation", "eigenvalue"):
        answer = found(SQUEAL, 1.0, 10.0, "link2__angle_deg", method=method)
        assert answer.windows == ((1.0, answer.value),)
        above = found(SQUEAL, 0.3, 0.9, method=method)
        assert above.windows == ((above.value, 0.9),)
        assert found(SQUEAL, 0.0, 0.3, method=method).windows == ()
        assert found(SQUEAL, 0.8, 1.2, method=method).windows == ((0.8, 1.2),)


def test_without_dashpots_rounding_near_self_locking_is_in_the_error_bar() -> None:
    bare = {
        "shoe": {"mass": 1.64},
        "wheel": {"radius": 0.5, "angular_speed": 8.97},
        "link1": {"stiffness": 413000.0, "damping": 0.0, "angle_deg": 0.0421},
        "link2": {"stiffness": 260.0, "damping": 0.0, "angle_deg": -36.8},
        "load": {"force": 21.2},
        "friction": {"coefficient": 0.1},
        "contact": {"half_length": 0.05, "stiffness": 2770000.0},
        "solver": {"scheme": "three-layer", "step": 4.8e-5, "duration": 0.05},
    }
    value, _, _, error = bracket(found(bare, 0.0, 2.9, tolerance=1e-6))
    at = [{**bare, "friction": {"coefficient": value + way}} for way in (-error, error)]
    assert [smooth_is_unstable(each) for each in at] == [False, True]  # Hurwitz in 50 digits


@pytest.mark.parametrize("angle", [90.0, -90.0])
@pytest.mark.parametrize("method", ["simulation", "eigenvalue"])
def test_a_shoe_that_no_link_holds_has_no_critical_friction(angle: float, method: str) -> None:
    rough: dict[str, Any] = {
        "link2__angle_deg": angle,
        "roughness__wheel": {"amplitudes": [3e-5], "wavelengths": [0.025]},
    }
    report = stability(system_of(make(SQUEAL, **rough)))
    assert report.equilibrium is None
    assert report.critical is None
    answer = found(SQUEAL, 0.0, 1.0, method=method, **rough)
    assert (answer.outcome, answer.value, answer.windows) == (Outcome.NO_SLIDING, None, ())
