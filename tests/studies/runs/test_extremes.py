"""The extremes of benchmarks/extremes: a few of them, and in the campaign all of them with their page."""

from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from brakecli.case.system import system_of
from brakecli.studies.runs.limits import check
from tests.campaign import campaign, counts, differences
from tests.examples import SQUEAL, make

# benchmarks are not type-checked
judging: Any = import_module("benchmarks.extremes.judging")
points: Any = import_module("benchmarks.extremes.points")
long_runs: Any = import_module("benchmarks.extremes.long_runs")
page: Any = import_module("benchmarks.extremes.__main__")

SMOOTH = [family for family in points.FAMILIES if "rough" not in family.name and "wave" not in family.name]
QUICK_LIMITS = ("base",)
ROUGH = [family for family in points.FAMILIES if family not in SMOOTH]


@pytest.mark.parametrize("family", SMOOTH, ids=lambda family: family.name)
def test_nothing_on_smooth_surfaces_is_silently_wrong(family: Any) -> None:
    kinds = set()
    for value in sorted({*family.values[::3], family.values[0], family.values[-1]}):
        tables = family.tables(value)
        at = family.pace(value)
        reference = judging.truth(tables, at)
        assert reference.rows is not None, value
        assert not reference.apart > 1e-8, value
        for scheme in judging.SCHEMES:
            outcome = judging.judge(tables, scheme, at, reference)
            kinds.add(outcome.kind)
            assert outcome.kind != "silently wrong", (value, scheme.text, outcome)
            assert outcome.kind in ("right", "failed by name") or outcome.words, (value, scheme.text)
    assert "right" in kinds


@pytest.mark.parametrize("family", ROUGH, ids=lambda family: family.name)
def test_nothing_on_rough_surfaces_is_silently_wrong(family: Any) -> None:
    for value in (family.values[1], family.values[-1]):
        tables = family.tables(value)
        at = family.pace(value)
        reference = judging.truth(tables, at)
        assert reference.rows is not None, value
        for scheme in (judging.MIDDLE, judging.BACKWARD, judging.THREE):
            outcome = judging.judge(tables, scheme, at, reference)
            assert outcome.kind != "silently wrong", (value, scheme.text, outcome)


@pytest.mark.parametrize("count", counts(20, 80))
def test_nothing_is_silently_wrong_where_several_extremes_meet(count: int) -> None:
    found = list(points.together(count))
    assert len(found) == count
    assert [outcome for point in found for outcome in point.values() if outcome.kind == "silently wrong"] == []


@campaign
def test_the_page_of_the_extremes_is_what_they_give(tmp_path: Path) -> None:
    page.main(tmp_path / "extremes.md")
    assert differences((tmp_path / "extremes.md").read_text(), page.PAGE.read_text()) == []


def test_an_error_that_nothing_is_said_of_is_silently_wrong() -> None:
    tables = judging.FLAT
    at = judging.pace(tables)
    reference = judging.truth(tables, at)
    off = reference._replace(rows=1.01 * reference.rows)
    assert judging.judge(tables, judging.MIDDLE, at, reference).kind == "right"
    assert judging.judge(tables, judging.MIDDLE, at, off).kind == "silently wrong"
    assert judging.judge(tables, judging.MIDDLE, at, judging.Truth(None, 0.0, "")).kind == "silently wrong"


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK_LIMITS else campaign) for name in long_runs.LIMIT_CASES]
)
def test_predicted_limits_of_stability_are_those_observed(name: str) -> None:
    for scheme in long_runs.LIMITED:
        predicted, observed = long_runs.limits(long_runs.LIMIT_CASES[name], scheme)
        assert (predicted is None) == (observed is None), scheme.text
        if observed is not None:
            assert predicted == pytest.approx(observed, rel=0.02), scheme.text


def test_weights_of_one_half_keep_the_energy() -> None:
    assert abs(long_runs.drift(judging.MIDDLE, 10, 20_000)) < 1e-10
    assert long_runs.drift(judging.BACKWARD, 10, 20_000) < -0.99


def test_hours_leave_the_phases_of_the_wheel_where_they_belong() -> None:
    assert long_runs.hours(judging.MIDDLE, 5_000.0) < 1e-10


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
        "the dashpots damp a motion at a rate of 1e+06 1/s, which the step does not resolve" in w
        for w in found.warnings
    )
    assert check(system_of(make(SQUEAL, link1__damping=1e4))).warnings == ()
