"""The error that an event-driven run carries along, against closed forms, finer runs and the exact contact."""

import math
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.api.inputs import load_case
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.quantities import Failure
from brakecli.solver.steady_sliding import off_by_nodes, steady_sliding
from brakecli.solver.system import System
from brakecli.studies.runs import own_error
from brakecli.studies.runs.own_error import SAFETY, Known, by_own_error, last_of
from tests.campaign import campaign, counts
from tests.examples import make
from tests.studies.runs.test_tolerance import OPEN, promised

cases: Any = import_module("benchmarks.statistics.cases")  # benchmarks are not type-checked


AMPLIFIED: dict[str, Any] = {  # it grows a hundred thousandfold from steady sliding, and sticks fourteen times
    "shoe": {"mass": 35.04381458989792},
    "wheel": {"radius": 0.5, "angular_speed": -0.030756709526101395},
    "link1": {"stiffness": 3029095.7814723463, "damping": 37.60886, "angle_deg": -11.644771271469342},
    "link2": {"stiffness": 35767778.79071583, "damping": 122.67765, "angle_deg": 22.210688713380236},
    "load": {"force": 9484.093879473288},
    "friction": {"coefficient": 0.3684843750860493},
    "contact": {"half_length": 0.00013872327946951255, "stiffness": 97123377935.28448},
    "roughness": {
        "wheel": {
            "amplitudes": [0.00014653256752264335, 0.00016012345278833544],
            "wavelengths": [0.0004171304614755917, 0.00011195715151577948],
            "phases_deg": [355.74610238141696, 226.44356871134912],
        },
        "shoe": {
            "amplitudes": [0.0001533280101554894],
            "wavelengths": [0.00043628094720226686],
            "phases_deg": [79.75201442570112],
        },
    },
    "initial": {"at": "equilibrium"},
    "solver": {"duration": 0.09118167910280045},
    "output": {"sample_interval": 0.0001310081596304604},
}

CASE_C = Path(__file__).parents[3] / "cases" / "accuracy" / "C.toml"


def knowing(system: System, start_error: tuple[float, float] = (0.0, 0.0), **changes: Any) -> Motion:
    """A run that carries its error along."""
    return solve(replace(system, start_error=start_error, method=replace(system.method, **changes)))


def true_error(run: Motion, exact: Motion) -> float:
    """The largest deviation, relative to the largest values."""
    size = np.abs(run.rows[:, :4]).max(axis=0)
    return float((np.abs(run.rows[:, :4] - exact.rows[:, :4]) / size).max())


def test_a_run_knows_its_error_and_what_is_of_the_nodes() -> None:
    system = system_of(promised(OPEN, 1e-3, solver__duration=0.01))
    exact = solve(replace(system, method=replace(system.method, tolerance=1e-10)))
    runs = {
        (nodes, tolerance): knowing(system, evaluator="cells", nodes=nodes, tolerance=tolerance)
        for nodes, tolerance in ((134, 1e-9), (512, 1e-9), (4096, 3e-4), (256, 3e-4))
    }
    for (nodes, tolerance), run in runs.items():
        steps, by_nodes, error = Known.of_run(run).of.max(axis=0)
        true = true_error(run, exact)
        if (nodes, tolerance) == (256, 3e-4):  # both are as large: they may take something off each other
            assert true <= 1.25 * error <= 1.25 * (steps + by_nodes)
        else:
            assert error == pytest.approx(true, rel=0.25)
    for nodes in (134, 512):  # steps are far better
        steps, by_nodes, _ = Known.of_run(runs[nodes, 1e-9]).of.max(axis=0)
        assert steps < 1e-2 * by_nodes
    steps, by_nodes, _ = Known.of_run(runs[4096, 3e-4]).of.max(axis=0)
    assert by_nodes < 0.1 * steps


@pytest.mark.parametrize("many", counts(2, 15))
@pytest.mark.parametrize("stratum", ["open", "full", "smooth"])
def test_random_shoes_know_their_errors(stratum: str, many: int) -> None:
    from tests.analysis.shoes import random_shoes

    for tables in islice(random_shoes(stratum, 41), many):
        tables["solver"] = {"duration": tables["solver"]["duration"], "tolerance": 1e-3, "scheme": "event-driven"}
        system = system_of(Case.model_validate(tables))
        duration = min(system.sampled_duration, 40.0 / system.natural_frequencies[1])
        interval = min(system.interval, 0.05 / system.natural_frequencies[1])
        system = replace(system, duration=duration, interval=interval)
        run = knowing(system, evaluator="auto" if system.smooth else "cells", nodes=0 if system.smooth else 512)
        exact = solve(replace(system, method=replace(system.method, tolerance=1e-9)))
        known = Known.of_run(run)
        error = true_error(run, exact)
        if run.work.failed or exact.work.failed or error > 1e-2:
            continue
        assert error <= SAFETY * known.of[:, 2].max() + 1e-8 or known.unsure < duration


@pytest.mark.parametrize("nodes", [128, 192, 256, 320])
def test_how_far_nodes_put_the_start_off_is_known(nodes: int) -> None:
    """The error of twice as many cells is an eighth of it, give or take as much: errors of cells fall unevenly."""
    system = system_of(make(AMPLIFIED, solver__tolerance=1e-4))
    exact = steady_sliding(system.by(evaluator="exact"))
    on_nodes = system.by(evaluator="cells", nodes=nodes)
    rest = steady_sliding(on_nodes)
    off = rest.x - exact.x, rest.y - exact.y
    assert off_by_nodes(on_nodes, rest) == pytest.approx(off, rel=0.25)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5])
def test_errors_of_steps_and_of_nodes_take_nothing_off_each_other(tolerance: float) -> None:
    """At 1e-4 both were of other signs on 256 cells, and their sum a third of the error."""
    system = system_of(make(AMPLIFIED, solver__tolerance=tolerance))
    found = last_of(by_own_error(system), solve)
    exact = solve(system.by(evaluator="exact", tolerance=1e-10))
    assert found.certificate.certified
    assert true_error(found.motion, exact) <= found.certificate.estimated_error


def test_a_dip_beside_the_end_of_a_step_is_no_longer_stepped_over() -> None:
    """The sliding velocity falls below zero for a twentieth of a step, right where one ends."""
    system = system_of(Case.model_validate(cases.draw("near grazing", 7, 28).tables))
    assert system.evaluator == "exact"
    system = replace(system, duration=1e-3, tracked=True)
    sticks = [
        solve(replace(system, method=replace(system.method, tolerance=tolerance))).track.counts[2]  # type: ignore[union-attr]
        for tolerance in (1.9236e-10, 1e-12)
    ]
    assert sticks == [1, 1]


@campaign
def test_an_event_that_may_have_been_missed_is_known() -> None:
    """It misses stick, or does not, by 1e-8 of the wheel's speed: coarse steps cannot tell, and say so."""
    system = system_of(Case.model_validate(cases.draw("near grazing", 7, 28).tables))
    coarse, fine = (Known.of_run(knowing(system, tolerance=tolerance)).unsure for tolerance in (1e-4, 1e-12))
    assert coarse < 1e-3
    assert math.isinf(fine)


def test_a_run_says_how_fine_the_next_one_has_to_be() -> None:
    for tolerance, most in ((1e-2, 1), (1e-3, 2), (1e-5, 3), (1e-7, 3)):
        system = system_of(promised(OPEN, tolerance, solver__duration=0.01))
        tried = list[System]()

        def run(rung: System, tried: list[System] = tried) -> Motion:
            tried.append(rung)
            return solve(rung)

        found = last_of(by_own_error(system), run).certificate
        assert found.certified
        assert len(tried) <= most
        assert found.by_steps is not None
        assert found.by_nodes is not None
        assert 0.03 * tolerance < found.estimated_error <= found.by_steps + found.by_nodes


def far_too_coarse() -> tuple[System, Callable[[System], Motion], list[Motion]]:
    """A shoe whose first run is, how it is run, and its runs."""
    changes = ["solver={tolerance = 1e-3, duration = 0.2}", "output.sample_interval=2.5e-4"]
    tried = list[Motion]()

    def run(rung: System) -> Motion:
        tried.append(solve(rung))
        return tried[-1]

    return system_of(load_case(str(CASE_C), [*changes, "friction.coefficient=0.5"]).case), run, tried


def test_a_run_that_is_too_coarse_by_far_ends_early() -> None:
    system, run, tried = far_too_coarse()
    assert last_of(by_own_error(system), run).certificate.certified
    first, last = tried
    assert first.work.failure is Failure.COARSE
    assert first.work.failure_time == pytest.approx((len(first.rows) - 1) * system.interval)
    assert system.samples // 16 <= len(first.rows) < system.samples // 2
    assert len(last.rows) == system.samples + 1
    whole = solve(replace(first.system, most_error=math.inf))
    assert (whole.rows[: len(first.rows) - 1] == first.rows[:-1]).all()
    assert true_error(last, solve(replace(last.system, method=replace(last.system.method, tolerance=1e-9)))) < 1e-3


def test_where_nothing_finer_helps_the_last_run_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_error, "FINEST", 1.0)  # times a thousandth it is more than the first run has
    system, run, tried = far_too_coarse()
    found = last_of(by_own_error(system), run)
    assert [each.work.failure for each in tried] == [Failure.COARSE, Failure.NONE]
    assert not found.certificate.certified
    assert found.motion is tried[-1]
    assert len(found.motion.rows) == system.samples + 1
    assert 0.0 < found.certificate.certified_until < 0.1


@pytest.mark.parametrize("displaced", [1e290, 1e308])
def test_an_error_that_overflows_is_no_promise(monkeypatch: pytest.MonkeyPatch, displaced: float) -> None:
    monkeypatch.setattr(own_error, "displacement", lambda system: (displaced, -displaced))
    found = last_of(by_own_error(system_of(promised(OPEN, 1e-2, solver__duration=0.001))), solve).certificate
    assert not found.certified
    assert found.estimated_error > 1e-2
    assert found.certified_until == 0.0


def test_no_finer_run_is_begun_beyond_so_much_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first run is too coarse; a count that nothing stays below leaves the whole of it."""
    monkeypatch.setattr(own_error, "FIRST", 5.0)
    monkeypatch.setattr(own_error, "MOST_WORK", 0.0)
    found = last_of(by_own_error(system_of(promised(OPEN, 1e-6, solver__duration=0.01))), solve)
    assert not found.certificate.certified
    assert len(found.motion.rows) == 101


def test_a_promise_that_no_run_keeps_is_not_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_error, "_MOST_RUNS", 1)
    monkeypatch.setattr(own_error, "FIRST", 5.0)
    found = last_of(by_own_error(system_of(promised(OPEN, 1e-6, solver__duration=0.01))), solve).certificate
    assert not found.certified
    assert found.estimated_error > 1e-6
    assert 0.0 <= found.certified_until < 0.01


@pytest.mark.parametrize(("friction", "speed"), [(0.4571428571428572, 0.94), (0.2326530612244898, 0.72)])
def test_an_event_at_a_loose_tolerance_is_where_the_motion_has_it(friction: float, speed: float) -> None:
    """A step to an event may come to another place than the continuous solution: left there, no phase goes on."""
    changes = [f"friction.coefficient={friction}", f"wheel.angular_speed={speed}", "output.sample_interval=2.5e-4"]
    case = load_case(str(CASE_C), [*changes, "solver={tolerance=1e-3, duration=0.12}"]).case
    assert not solve(own_error.first_of(system_of(case))).work.failed
