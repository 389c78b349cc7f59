"""The limits of a step, and what `check` says of a case."""

import numpy as np
import pytest
from scipy.linalg import eigvals

from brakecli.analysis.stability.discrete import amplification, step_limits
from brakecli.case.system import system_of
from brakecli.errors import RefusedError
from brakecli.studies.runs.limits import adjustments, check, refuse
from tests.examples import MODE_COUPLING, ROUGH, SQUEAL, make, simulate


@pytest.mark.parametrize("scheme", ["two-layer", "three-layer"])
def test_contraction_is_that_of_the_fixed_point_iteration(scheme: str) -> None:
    theta = (0.5, 0.5) if scheme == "two-layer" else (0.25, 0.5, 0.25)
    case = make(SQUEAL, solver__scheme=scheme, solver__theta=theta, friction__coefficient=0.0)
    system = system_of(case)
    limits = step_limits(system)
    # θ1 θ2 h² 2ak/m, or θ1 h² 2ak/m: both weights are 1/4 here; the links change a22 by 1e-4.
    assert limits.contraction == pytest.approx(0.25 * 1e-10 * 2e6 / 10.0, rel=1e-3)
    assert limits.unique


def test_friction_that_can_wedge_the_shoe_within_a_step_is_told() -> None:
    changes = {"solver__step": 1e-3, "output__sample_interval": 1e-3, "contact__stiffness": 1e10}
    case = make(SQUEAL, link2__angle_deg=45.0, friction__coefficient=20.0, **changes)
    system = system_of(case)
    found = check(system)
    assert not found.limits.unique
    assert any("more than one solution" in warning for warning in found.warnings)


def test_amplification_predicts_the_growth_of_a_run() -> None:
    case = make(MODE_COUPLING, solver__step=0.05, solver__duration=60.0, initial__x=1e-6)
    system = system_of(case)
    result = simulate(case)
    values = eigvals(amplification(system.coefficients, system.weights, system.scheme, system.contact_stiffness))
    fastest = values[np.argmax(np.abs(values))]
    late = result.vx[-400:]  # only the growing pair is left: v(n+1) = 2 Re(λ) v(n) - |λ|² v(n-1)
    left = np.column_stack([late[1:-1], late[:-2]])
    found = np.linalg.lstsq(left, late[2:], rcond=None)[0]
    assert np.sqrt(-found[1]) == pytest.approx(abs(fastest), abs=1e-6)


def test_check_warns_of_everything_that_is_not_resolved() -> None:
    case = make(
        ROUGH, contact__nodes=32, solver__step=5e-4, output__sample_interval=5e-3, wheel__angular_speed=40.0,
        load__force=-1.0,
    )  # fmt: skip
    warnings = " ".join(check(system_of(case)).warnings)
    for words in (
        "steps per period",
        "steps per passing wave",
        "half the sampling rate",
        "nodes per shortest",
        "negative",
    ):
        assert words in warnings


def test_check_is_silent_about_a_case_that_is_resolved() -> None:
    assert check(system_of(make(ROUGH, contact__nodes=None, output__sample_interval=2e-5))).warnings == ()


@pytest.mark.parametrize(("half_length", "warned"), [(1.57, False), (1.58, True), (50.0, True)])
def test_a_pad_longer_than_the_circumference_is_told_of(half_length: float, warned: bool) -> None:
    case = make(SQUEAL, contact__half_length=half_length, wheel__radius=0.5, solver__step=1e-7)
    pad = f"contact.half_length: the pad of {2.0 * half_length:.3g} m"
    said = f"{pad} is longer than the wheel's circumference of 3.14 m; check their units"
    assert any(said == each for each in check(system_of(case)).warnings) == warned


def test_check_changes_the_step_and_the_duration_as_the_samples_need() -> None:
    system = system_of(make(SQUEAL, solver__step=3e-5, solver__duration=0.10005))
    assert (system.per_sample, system.samples) == (4, 1001)
    assert system.step == pytest.approx(2.5e-5, rel=1e-12)
    assert len(adjustments(system)) == 2
    assert adjustments(system_of(make(SQUEAL))) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"solver__duration": 1e7}, "too long"),
        ({"solver__duration": 1e5, "output__sample_interval": 1e-5}, "file would be too large"),
        ({"solver__scheme": "three-layer", "solver__theta": (0.0, 1.0, 0.0), "solver__step": 2e-3}, "unstable"),
        (
            {"solver__theta": (0.4, 0.4), "solver__step": 1e-4, "link1__damping": 0.0, "link2__damping": 0.0},
            "unstable",
        ),
    ],
)
def test_runs_beyond_a_limit_are_refused(changes: dict[str, object], words: str) -> None:
    case = make(SQUEAL, **{"output__sample_interval": 2e-3, **changes})
    with pytest.raises(RefusedError, match=words):
        refuse(check(system_of(case)), 1e12)


def test_memory_of_the_amplification_is_the_state() -> None:
    system = system_of(make(SQUEAL))
    assert system.scheme.MEMORY == ("x", "y", "v_x", "v_y")
