"""The extremes: the campaign of benchmarks/extremes.py, reduced."""

from importlib import import_module
from typing import Any

import pytest

from brakecli.case.system import system_of
from brakecli.runs.limits import check
from tests.examples import SQUEAL, make

extremes: Any = import_module("benchmarks.extremes")  # benchmarks are not type-checked

SMOOTH = [family for family in extremes.FAMILIES if "rough" not in family.name and "wave" not in family.name]
ROUGH = [family for family in extremes.FAMILIES if family not in SMOOTH]


def _reduced(family: Any, every: int) -> list[tuple[float, Any, Any]]:
    """The points at both ends of a family and some between, by every scheme."""
    values = sorted({*family.values[::every], family.values[0], family.values[-1]})
    return [(value, family.tables(value), family.pace(value)) for value in values]


@pytest.mark.parametrize("family", SMOOTH, ids=lambda family: family.name)
def test_nothing_on_smooth_surfaces_is_silently_wrong(family: Any) -> None:
    kinds = set()
    for value, tables, at in _reduced(family, 3):
        reference = extremes.truth(tables, at)
        assert reference.rows is not None, value
        assert not reference.apart > 1e-8, value
        for scheme in extremes.SCHEMES:
            outcome = extremes.judge(tables, scheme, at, reference)
            kinds.add(outcome.kind)
            assert outcome.kind != "silently wrong", (value, scheme.text, outcome)
            assert outcome.kind in ("right", "failed by name") or outcome.words, (value, scheme.text)
    assert "right" in kinds


@pytest.mark.parametrize("family", ROUGH, ids=lambda family: family.name)
def test_nothing_on_rough_surfaces_is_silently_wrong(family: Any) -> None:
    for value in (family.values[1], family.values[-1]):
        tables, at = family.tables(value), family.pace(value)
        reference = extremes.truth(tables, at)
        assert reference.rows is not None, value
        for scheme in (extremes.MIDDLE, extremes.BACKWARD, extremes.THREE):
            outcome = extremes.judge(tables, scheme, at, reference)
            assert outcome.kind != "silently wrong", (value, scheme.text, outcome)


def test_nothing_is_silently_wrong_where_several_extremes_meet() -> None:
    points = list(extremes.together(20))
    assert len(points) == 20
    assert [outcome for point in points for outcome in point.values() if outcome.kind == "silently wrong"] == []


def test_an_error_that_nothing_is_said_of_is_silently_wrong() -> None:
    tables = extremes.FLAT
    at = extremes.pace(tables)
    reference = extremes.truth(tables, at)
    off = reference._replace(rows=1.01 * reference.rows)
    assert extremes.judge(tables, extremes.MIDDLE, at, reference).kind == "right"
    assert extremes.judge(tables, extremes.MIDDLE, at, off).kind == "silently wrong"
    assert extremes.judge(tables, extremes.MIDDLE, at, extremes.Truth(None, 0.0, "")).kind == "silently wrong"


@pytest.mark.parametrize("name", ["base", "contact 10¹⁶ N/m²", "mass 10⁻⁶ kg", "critical dashpots"])
def test_predicted_limits_of_stability_are_those_observed(name: str) -> None:
    for scheme in extremes.LIMITED:
        predicted, observed = extremes.limits(extremes.LIMIT_CASES[name], scheme)
        assert (predicted is None) == (observed is None), scheme.text
        if observed is not None:
            assert predicted == pytest.approx(observed, rel=0.02), scheme.text


def test_weights_of_one_half_keep_the_energy() -> None:
    assert abs(extremes.drift(extremes.MIDDLE, 10, 20_000)) < 1e-10
    assert extremes.drift(extremes.BACKWARD, 10, 20_000) < -0.99


def test_hours_leave_the_phases_of_the_wheel_where_they_belong() -> None:
    assert extremes.hours(extremes.MIDDLE, 5_000.0) < 1e-10


def test_the_damping_of_a_scheme_itself_is_told() -> None:
    # Implicit Euler takes (1 + (ωh)²)^(-1/2) of a vibration in each step.
    case = make(SQUEAL, solver__theta=(1.0, 1.0), link2__angle_deg=0.0, contact__stiffness=4e7)
    system = system_of(case)
    omega_h = (1.4e7 / 10.0) ** 0.5 * 1e-5
    taken = 100.0 * (1.0 - (1.0 + omega_h**2) ** (-0.5 * system.steps))
    (warning,) = check(system).warnings
    assert warning.startswith("solver.theta: with these weights the scheme itself damps")
    assert f"it takes {taken:.3g} % of" in warning
    for theta in ((0.5, 0.5), (1.0, 0.0)):
        assert check(system_of(make(SQUEAL, solver__theta=theta))).warnings == ()
    event = make(SQUEAL, solver__scheme="event-driven", solver__step=None, solver__tolerance=1e-6)
    assert check(system_of(event)).warnings == ()


def test_dashpots_that_a_step_does_not_resolve_are_told() -> None:
    # b/m of the stronger dashpot is 1e6 1/s: in steps of 1e-5 s ten of its time constants pass.
    found = check(system_of(make(SQUEAL, link1__damping=1e7)))
    assert any(
        "the dashpots settle a motion at a rate of 1e+06 1/s: it is not resolved" in w for w in found.warnings
    )
    assert check(system_of(make(SQUEAL, link1__damping=1e4))).warnings == ()
