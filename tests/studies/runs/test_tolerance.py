"""A tolerance is a promise: what is certified is true, and what is not true is not certified."""

import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import CaseError
from brakecli.solver.integrate import solve
from brakecli.solver.steady_sliding import steady_sliding
from brakecli.studies.comparison.compare import errors
from brakecli.studies.runs import against
from brakecli.studies.runs.certificate import Certified
from brakecli.studies.runs.modelled import modelled
from brakecli.studies.runs.tolerance import certify
from tests.campaign import campaign, counts
from tests.commands import TINY, attributes, brakecli
from tests.examples import COULOMB, ROUGH, SQUEAL, make, simulate
from tests.solver.test_event_driven import flat_case

promises: Any = import_module("benchmarks.promises")  # benchmarks are not type-checked
FULL = {"amplitudes": [1e-6, 7e-7], "wavelengths": [0.02, 0.011]}


def promised(base: dict[str, Any], tolerance: float, **changes: Any) -> Case:
    """A case with a tolerance in the place of its step."""
    solver = {"solver__step": None, "solver__tolerance": tolerance}
    return make({**base, "output": {"sample_interval": 1e-4}}, **solver, **changes)


def truth(case: Case, tolerance: float = 1e-12) -> np.ndarray[Any, Any]:
    """The event-driven motion to 1e-12, which tests/solver/test_event_driven.py holds to independent solutions."""
    exact = changed(case, solver={"scheme": "event-driven", "tolerance": tolerance, "step": None, "theta": ()})
    return simulate(exact).rows


def kept(found: Certified, case: Case, tolerance: float = 1e-12) -> float:
    """The true error of an answer, which must not be above the estimate."""
    error = errors(found.motion.rows, truth(case, tolerance)).error
    assert error <= found.certificate.estimated_error + 10.0 * tolerance  # what the truth itself may be off
    return error


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-9, 1e-10])
@pytest.mark.parametrize("friction", [0.3, 0.7])
def test_smooth_surfaces_keep_any_tolerance(tolerance: float, friction: float) -> None:
    case = promised(SQUEAL, tolerance, friction__coefficient=friction, solver__duration=0.3)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert found.certificate.certified_until == pytest.approx(0.3)
    assert kept(found, case) <= tolerance
    assert found.motion.system.method.scheme == "piecewise-exact"


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
def test_the_event_driven_scheme_keeps_them_too(tolerance: float) -> None:
    case = promised(SQUEAL, tolerance, solver__scheme="event-driven", solver__duration=0.3)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case) <= tolerance
    assert found.motion.system.method.scheme == "event-driven"


@pytest.mark.parametrize("many", counts(6, 100))
def test_exact_steps_know_what_motions_make_of_their_rounding(many: int) -> None:
    rng = np.random.default_rng(6)
    loose = 0
    for _ in range(many):
        case, omega = flat_case(rng, 1e-12)
        case["solver"] = {"duration": 10 ** rng.uniform(1.5, 2.5) / omega, "tolerance": 1e-12}
        found = certify(system_of(Case.model_validate(case)))
        estimate = found.certificate.estimated_error
        loose = loose + (found.certificate.estimated_error > 4e-12)
        assert found.motion.system.method.scheme == "piecewise-exact"
        error = errors(found.motion.rows, truth(Case.model_validate(case), 1e-13)).error
        assert error <= 10.0 * estimate + 1e-11  # both err by chance; and what the truth itself may be off
    assert many < 10 or 0 < loose < many


@pytest.mark.parametrize("many", counts(30, 500))
def test_rounding_that_exact_runs_carry_along_is_more_than_what_other_steps_show(many: int) -> None:
    """Runs with other steps have other matrices, and other places of their parts beside events."""
    rng = np.random.default_rng(8)
    seen = 0
    for _ in range(many):
        case, omega = flat_case(rng, 1e-12)
        case["solver"] = {"duration": 10 ** rng.uniform(2.0, 3.3) / omega, "tolerance": 1e-2}
        system = system_of(Case.model_validate(case))
        estimate = certify(system).certificate.estimated_error
        runs = [solve(replace(system, method=replace(system.method, share=share))) for share in (1.0, 0.37)]
        if any(run.work.failed for run in runs):  # it grows beyond all bounds
            continue
        apart = errors(runs[0].rows, runs[1].rows).error
        assert apart <= estimate
        seen += apart > 1e-14
    assert seen > 0.1 * many


@pytest.mark.parametrize("interval", [1e-5, 1e-1])
def test_exact_runs_are_compared_with_others_where_rounding_may_be_too_much(interval: float) -> None:
    system = system_of(promised(SQUEAL, 1e-6, output__sample_interval=interval, solver__duration=0.1))
    found = certify(system).certificate
    assert found.certified
    assert found.method.startswith("the rounding")
    closer = certify(replace(system, method=replace(system.method, tolerance=1e-13))).certificate
    one, other = map(float, closer.method.split("steps of ")[1].split(" s ")[0].split(" and "))
    assert abs(math.log(other / one)) > 0.25


def test_rough_surfaces_in_full_contact_never_see_a_quadrature() -> None:
    case = promised(SQUEAL, 1e-4, roughness__shoe=FULL, roughness__wheel=FULL, initial__at="equilibrium")
    found = certify(system_of(case))
    assert found.certificate.certified
    assert set(found.motion.work.evaluators) == {"closed-form"}
    assert kept(found, case) <= 1e-4
    assert any("quadrature" in sentence for sentence in modelled(found.motion)[1])


OPEN = {**ROUGH, "contact": {"half_length": 0.05, "stiffness": 5e7}}


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-5, pytest.param(1e-7, marks=campaign)])
def test_surfaces_that_open_keep_their_tolerance_too(tolerance: float) -> None:
    case = promised(OPEN, tolerance, solver__duration=0.004)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case, 1e-4 * tolerance) <= tolerance
    assert found.motion.system.evaluator == "cells"


def test_of_few_waves_the_exact_contact_is_cheaper_than_many_cells() -> None:
    one = {"wheel": {"amplitudes": [1e-4], "wavelengths": [0.025]}}
    case = promised({**OPEN, "roughness": one}, 1e-7, solver__duration=0.004)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case, 1e-11) <= 1e-7
    assert found.motion.system.evaluator == "exact"


def test_nodes_that_agree_by_luck_are_doubled_again() -> None:
    """No edge of a patch lies where 128 nodes see more of it than 64, and the motion is off by a hundredth."""
    lucky = {"wheel": {"amplitudes": [4.37e-4], "wavelengths": [0.00941]}}
    case = promised({**OPEN, "roughness": lucky}, 1e-3, solver__duration=1e-4, output__sample_interval=4e-6)
    method = {"scheme": "two-layer", "theta": (0.5, 0.5), "tolerance": None, "step": 4e-6}
    contacts = ({"evaluator": "midpoint", "nodes": n} for n in (64, 128, 4096))
    few, more, most = (simulate(changed(case, solver=method, contact=each)) for each in contacts)
    assert errors(few.rows, more.rows).error < 1e-9 < 1e-2 < errors(more.rows, most.rows).error
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case, 1e-9) <= 1e-3


@campaign
def test_the_edges_of_patches_that_hardly_move_do_not_break_a_certificate() -> None:
    """The wheel moves by 1 µm: the error of a sum over nodes is that of one position, and falls unevenly."""
    tables: dict[str, Any] = {
        "shoe": {"mass": 1.1978941200947848},
        "wheel": {"radius": 0.5, "angular_speed": 0.03193301760732767},
        "link1": {"stiffness": 2641839.32, "damping": 21.0936550667, "angle_deg": -29.814053851926097},
        "link2": {"stiffness": 24450950.73530499, "damping": 64.17213895310152, "angle_deg": 29.943775676434917},
        "load": {"force": 93.76457491802371},
        "friction": {"coefficient": 0.035261604124427096},
        "contact": {"half_length": 0.02035804419970634, "stiffness": 325929872.2019398},
        "roughness": {
            "wheel": {
                "amplitudes": [9.297627543302589e-05, 0.0001884838880977388],
                "wavelengths": [0.029303649610016646, 0.0038416921496541314],
            },
            "shoe": {
                "amplitudes": [0.0001311884681448567, 1.930668322626516e-05, 0.00011197640595953078],
                "wavelengths": [0.0006792367667911807, 0.0011174514466332748, 0.00029933846887440893],
                "phases_deg": [163.0371512821398, 129.48719375127544, 201.69367887292043],
            },
        },
        "initial": {"at": "equilibrium"},
        "solver": {"duration": 6.98418448236102e-05},
        "output": {"sample_interval": 6.349258620328199e-07},
    }
    exact = make(tables, solver__scheme="event-driven", solver__tolerance=1e-10)
    truth = certify(system_of(exact)).motion.rows[:, :4]
    for tolerance in (4.6e-3, 3.9e-3, 5.833e-4):
        found = certify(system_of(make(tables, solver__tolerance=tolerance)))
        assert found.certificate.certified
        off = np.abs(found.motion.rows[:, :4] - truth).max(axis=0) / np.abs(truth).max(axis=0)
        assert off.max() <= tolerance


@pytest.mark.parametrize("interval", [2e-6, 1e-4 / 3.0, 4e-4])
def test_samples_of_any_interval_keep_their_tolerance(interval: float) -> None:
    case = promised(OPEN, 1e-2, solver__duration=0.004, output__sample_interval=interval)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert len(found.motion.rows) == system_of(case).samples + 1
    assert kept(found, case, 1e-6) <= 1e-2


@pytest.mark.parametrize("many", counts(2, 60))
def test_no_certificate_of_random_shoes_is_broken(many: int) -> None:
    rng = np.random.default_rng(3)
    ways = set[str]()
    drawn = 0
    while drawn < many:
        case = promises.random_case(rng, promises.KINDS[-1 - drawn % len(promises.KINDS)])
        try:
            exact = truth(case, 1e-9)
        except CaseError:  # self-locking
            continue
        drawn += 1
        for tolerance in (1e-2, 1e-3, 1e-4):
            found = certify(system_of(changed(case, solver={"tolerance": tolerance})))
            error = errors(found.motion.rows, exact).error
            assert found.certificate.certified
            assert error <= found.certificate.estimated_error + 1e-7  # what the truth itself may be off
            ways.add(f"{found.motion.system.method.scheme}, {found.motion.system.evaluator}")
    assert many < 10 or ways == {"event-driven, cells", "piecewise-exact, closed-form"}


WAVE = {  # a shoe that opens over a long wave of the wheel
    "shoe": {"mass": 10.0},
    "wheel": {"radius": 0.5, "angular_speed": 1.0},
    "link1": {"stiffness": 2e7, "damping": 2000.0},
    "link2": {"stiffness": 1e7, "damping": 1000.0, "angle_deg": 5.0},
    "load": {"force": 1000.0},
    "friction": {"coefficient": 0.6},
    "contact": {"half_length": 0.05, "stiffness": 5e7},
    "roughness": {"wheel": {"amplitudes": [2e-4], "wavelengths": [0.03]}},
    "initial": {"at": "equilibrium"},
    "solver": {"step": 1e-5, "duration": 0.03},
}
PULSE = {"times": [0.0170123, 0.0170128, 0.0170133], "forces": [1e3, 1e6, 1e3]}


def back(start: float, width: float = 12e-6) -> dict[str, Any]:
    """The wheel turns back and forth between two samples."""
    times = [start, start + 0.01 * width, start + 0.99 * width, start + width]
    return {"radius": 0.5, "times": times, "angular_speeds": [1.0, -1.0, -1.0, 1.0]}


BACK = {"wheel": back(0.020001)}
EARLY = {"wheel": back(0.002001), "solver": {"duration": 0.004}}


@pytest.mark.parametrize(
    ("scheme", "changes"),
    [
        *(("auto", changes) for changes in ({"load": PULSE}, BACK, EARLY)),
        *(("two-layer", changes) for changes in ({"load": PULSE}, EARLY)),
        pytest.param("two-layer", BACK, marks=campaign),
        *(pytest.param("three-layer", changes, marks=campaign) for changes in ({"load": PULSE}, EARLY, BACK)),
    ],
)
def test_what_happens_between_two_steps_is_not_overlooked(scheme: str, changes: dict[str, Any]) -> None:
    case = promised({**WAVE, **changes}, 1e-2, solver__scheme=scheme)
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case) <= 1e-2


def test_what_no_step_can_follow_is_not_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(against, "MOST_RUNS", 2)
    case = promised({**WAVE, "load": PULSE}, 1e-2, solver__scheme="two-layer")
    found = certify(system_of(case))
    assert not found.certificate.certified
    assert kept(found, case) <= found.certificate.estimated_error


def test_what_lasts_for_some_steps_is_certified() -> None:
    longer = {"times": [0.0170123, 0.0175, 0.018], "forces": [1e3, 3e3, 1e3]}
    case = promised({**WAVE, "load": longer}, 1e-2, solver__scheme="two-layer")
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case) <= 1e-2


@pytest.mark.parametrize("promise", [1e-3, 1e-9])
def test_a_shoe_that_nothing_moves_keeps_any_promise_in_a_few_steps(promise: float) -> None:
    """A wave that divides the length of the pad presses alike wherever it is; what moves is rounding."""
    wave = {"wheel": {"amplitudes": [4.2432e-5], "wavelengths": [0.1]}}
    case = promised({**WAVE, "roughness": wave}, promise, wheel__angular_speed=20.0, friction__coefficient=0.3)
    found = certify(system_of(changed(case, solver={"scheme": "event-driven", "duration": 0.02})))
    assert found.certificate.certified
    assert found.motion.work.steps < 2000
    assert np.abs(found.motion.rows[:, 2:4]).max() < 1e-15


@pytest.mark.parametrize("scheme", ["two-layer", "three-layer"])
def test_a_scheme_that_is_named_is_kept(scheme: str) -> None:
    case = promised(SQUEAL, 1e-3, solver__scheme=scheme, solver__duration=0.05)
    found = certify(system_of(case))
    assert found.motion.system.method.scheme == scheme
    assert found.certificate.certified
    assert kept(found, case) <= 1e-3


@pytest.mark.parametrize("given", [{}, {"solver__scheme": "event-driven"}], ids=["auto", "named"])
def test_an_evaluator_that_is_named_is_kept(given: dict[str, Any]) -> None:
    found = {}
    for evaluator in ("auto", "exact"):
        case = promised(OPEN, 1e-3, contact__evaluator=evaluator, **given)
        found[evaluator] = {*certify(system_of(case)).motion.work.evaluators}
    assert "exact" in found["exact"]
    assert "cells" not in found["exact"]
    assert ("cells" in found["auto"]) == (not given)  # the program takes nodes where it is cheaper


def test_runs_whose_steps_are_limited_by_passing_waves_do_not_vouch_for_each_other() -> None:
    """They take the same steps and share their errors: what they differ by may be far less than either is off."""
    wave = {"wheel": {"amplitudes": [2e-6], "wavelengths": [0.004]}}
    case = promised(
        {**WAVE, "roughness": wave, "initial": {"at": "equilibrium", "x": 1e-6}},
        1e-2,
        wheel__angular_speed=12.0,
        friction__coefficient=0.0,
    )
    system = system_of(case)
    loose, tight = (solve(system, replace(system.method, tolerance=each)) for each in (1e-6, 1e-8))
    assert tight.work.steps < 1.02 * loose.work.steps
    assert errors(loose.rows, tight.rows).error < errors(tight.rows, truth(case, 1e-13)).error
    found = certify(system)
    assert found.certificate.certified
    assert kept(found, case, 1e-13) <= 1e-2


@pytest.mark.parametrize(("scheme", "promise"), [("event-driven", 1e-2), ("event-driven", 1e-8), ("auto", 1e-10)])
def test_a_shoe_on_an_unstable_equilibrium_knows_what_becomes_of_rounding(scheme: str, promise: float) -> None:
    """All runs share the rounding of their start, and agree on it; the true shoe never moves.

    A difference scheme does not feel it: what its iteration leaves of a force is more.
    """
    case = promised(SQUEAL, promise, initial__at="equilibrium", friction__coefficient=0.7, solver__scheme=scheme)
    system = system_of(changed(case, solver={"duration": 2.0}))
    rest = steady_sliding(system)
    motion, found = certify(system)
    assert not found.certified
    assert 0.0 < found.certified_until < 1.9
    until = 1 + round(found.certified_until / system.interval)
    away = np.abs(motion.rows[:until, :2] - np.array([rest.x, rest.y])).max(axis=0)
    assert (away <= promise * np.abs([rest.x, rest.y])).all()


def test_a_promise_is_kept_where_an_unstable_shoe_has_no_time_to_leave() -> None:
    """Growth of 7 1/s makes 1e-13 of 64 roundings within 0.3 s."""
    case = promised(SQUEAL, 1e-6, initial__at="equilibrium", solver__scheme="event-driven", solver__duration=0.3)
    found = certify(system_of(changed(case, initial={"x": 1e-7}))).certificate
    assert found.certified
    assert found.estimated_error < 1e-6


def test_steps_that_do_not_get_there_are_not_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(against, "MOST_RUNS", 1)
    found = certify(system_of(promised(SQUEAL, 1e-8, solver__scheme="two-layer", solver__duration=0.05)))
    assert not found.certificate.certified
    assert found.certificate.estimated_error > 1e-8
    assert "cannot be certified" in found.certificate.sentence()


def test_a_tolerance_below_rounding_is_not_certified_and_says_what_it_can_stand_for(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY.replace("step = 1e-5, duration = 0.02", "duration = 0.5"))
    done = brakecli("run", "tiny.toml", "--set", "solver.tolerance=1e-13", "--json", cwd=tmp_path)
    done.told(1, "cannot be certified", "was written, but solver.tolerance is not sure to be kept")
    assert done.json["certified"] == 0
    assert 1e-13 < done.json["estimated_error"] < 1e-9
    assert attributes(tmp_path / "tiny.h5")["certified"] == 0


def test_a_case_without_a_step_keeps_a_thousandth(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY.replace("step = 1e-5, duration = 0.02", "duration = 0.02"))
    done = brakecli("run", "tiny.toml", "--json", cwd=tmp_path)
    assert done.code == 0
    assert (done.json["tolerance"], done.json["certified"]) == (1e-3, 1)
    assert done.json["estimated_error"] <= 1e-3
    assert done.json["scheme"] == "piecewise-exact"
    again = brakecli("run", "tiny.h5", "-o", "again.h5", cwd=tmp_path)
    assert again.code == 0
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "tiny.h5").read_bytes()


def test_no_friction_no_load_and_no_roughness_are_named_as_left_out() -> None:
    case = promised(SQUEAL, 1e-3, friction__coefficient=0.0, link1__damping=0.0, link2__damping=0.0)
    found = certify(system_of(case))
    _, left = modelled(found.motion)
    for words in ("quadrature", "there is no friction", "dashpots"):
        assert any(words in sentence for sentence in left), left


def test_the_coulomb_oscillator_ends_where_it_must() -> None:
    case = changed(make(COULOMB), solver={"scheme": "auto", "theta": (), "step": None, "tolerance": 1e-8})
    found = certify(system_of(changed(case, output={"sample_interval": 0.01})))
    assert found.certificate.certified
    start = system_of(case)
    assert start.samples == len(found.motion.rows) - 1
    assert found.motion.rows[-1, 0] == pytest.approx(15.0 - 205.0**0.5, abs=1e-8 * 15.0)


@pytest.mark.parametrize("later", [0.0, 1e-9, 0.3, 0.9])
def test_friction_that_turns_at_a_time_that_all_steps_share_is_not_overlooked(later: float) -> None:
    """The oscillator turns at atan(6/11) + π, so much of a sample interval behind a sample."""
    interval = (math.atan(6.0 / 11.0) + math.pi) / (64.0 + later)
    case = promised(
        COULOMB, 1e-3, solver__duration=5.0, solver__scheme="two-layer", output__sample_interval=interval
    )
    found = certify(system_of(case))
    assert found.certificate.certified
    assert kept(found, case) <= 1e-3
