"""Comparisons of methods: what is measured is what it says, and it agrees with what is known otherwise."""

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray
from numpy.typing import NDArray

from brakecli.analysis.stability.report import stability
from brakecli.case.case import Case
from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.errors import UsageError
from brakecli.results.field import values_of
from brakecli.results.fields import ENTRY
from brakecli.solver.quantities import HISTORY
from brakecli.solver.schemes import NUMEROV, QUARTERS, SCHEMES
from brakecli.solver.steps.loop import load
from brakecli.studies.comparison.compare import Comparison, Entry, compare, errors
from brakecli.studies.comparison.methods import (
    COARSEST,
    NODE_FACTORS,
    RUNGS,
    TOLERANCES,
    in_a_case,
    kinds,
    ladder,
    method_label,
    parse_schemes,
    parse_steps,
    rungs,
)
from brakecli.studies.comparison.result import ComparisonReport
from brakecli.views.points import finer_error, of_comparison
from tests.campaign import campaign
from tests.commands import ROOT, TINY, attributes, brakecli, left_in
from tests.examples import MODE_COUPLING, ROUGH, SQUEAL, make

COLUMNS = {name: place for place, name in enumerate(HISTORY)}
STEPS = [0.1, 0.05, 0.025, 0.0125, 0.00625]
STEPPING = sum(len(row.trials) for row in SCHEMES.values() if not row.own_steps)  # methods with these steps
ENTRY_NAMES = {
    "scheme", "theta", "start", "iteration", "evaluator", "nodes", "step", "error", "observed_order",
    "contact_evaluations", "wall_seconds",
}  # fmt: skip


def smooth(friction: float = 0.5, **changes: Any) -> Case:
    """Always in contact, always in slip: the motion is smooth."""
    return make(MODE_COUPLING, friction__coefficient=friction, solver__duration=6.4, **changes)


@cache
def smooth_comparison() -> Comparison:
    return compare(system_of(smooth()), steps=STEPS, budget=600.0)


@cache
def rough_comparison() -> Comparison:
    case = make(ROUGH, solver__duration=0.004, contact__nodes=64)
    return compare(system_of(case), schemes=["two-layer"], steps=[2e-5, 5e-6], budget=600.0)


def entries_of(found: Comparison, scheme: str, theta: tuple[float, ...], **fields: str) -> list[Entry]:
    wanted = {"start": "consistent", "iteration": "newton"} | fields
    return [
        entry
        for entry in found.entries
        if (entry.kind.scheme, entry.kind.theta) == (scheme, theta)
        and all(getattr(entry.kind, name) == value for name, value in wanted.items())
    ]


def history(count: int) -> NDArray[np.float64]:
    """Samples of a motion at 1/64 of its rate, in every quantity alike but for its size."""
    wave = np.sin(2.0 * np.pi * np.arange(count) / 64.0)
    return np.outer(wave, 1.0 + np.arange(len(HISTORY)))


def test_errors_are_relative_to_the_largest_value_in_each_quantity() -> None:
    reference = history(64 * 40)
    rows = reference.copy()
    rows[100, COLUMNS["x"]] += 0.25 * np.abs(reference[:, COLUMNS["x"]]).max()
    rows[:, COLUMNS["vy"]] += 0.125 * np.abs(reference[:, COLUMNS["vy"]]).max()
    found = errors(rows, reference)
    assert found.error == found.largest["x"] == pytest.approx(0.25, rel=1e-12)
    assert found.mean["x"] == pytest.approx(0.25 / len(rows), rel=1e-9)
    assert [found.largest["vy"], found.mean["vy"]] == pytest.approx([0.125, 0.125], rel=1e-9)
    assert found.largest["y"] == found.mean["y"] == found.largest["vx"] == 0.0


def test_forces_have_errors_of_their_own_that_do_not_enter_the_error() -> None:
    reference = history(64)
    rows = reference.copy()
    rows[3, COLUMNS["friction_force"]] *= -1.0  # one sample on the other side of a jump
    found = errors(rows, reference)
    assert found.error == 0.0
    assert found.largest["friction_force"] > 0.1
    assert found.mean["friction_force"] == pytest.approx(found.largest["friction_force"] / 64.0)


@pytest.mark.parametrize(("factor", "shift"), [(1.0, 0.0), (1.1, 0.0), (0.9, 0.3), (1.0, -0.2)])
def test_amplitude_and_phase_are_those_of_the_settled_line(factor: float, shift: float) -> None:
    reference = history(64 * 40)
    count = 64 * 40
    rows = reference.copy()
    wave = factor * np.sin(2.0 * np.pi * np.arange(count) / 64.0 + shift)
    rows[:, COLUMNS["vx"]] = wave * (1.0 + COLUMNS["vx"])
    rows[: count // 2, COLUMNS["vx"]] = 7.0  # what happened earlier does not matter
    found = errors(rows, reference)
    assert found.amplitude == pytest.approx(factor - 1.0, abs=1e-5)
    assert found.phase == pytest.approx(shift, abs=1e-5)


def test_a_motion_without_a_line_has_neither_amplitude_nor_phase() -> None:
    for reference in (np.zeros((400, len(HISTORY))), np.ones((400, len(HISTORY))), history(100)):
        found = errors(reference, reference)
        assert (found.error, found.amplitude, found.phase) == (0.0, None, None)


def test_every_method_of_a_case_is_told_apart_by_its_label() -> None:
    trials = [(row, trial.contacts) for row in SCHEMES.values() for trial in row.trials]
    rough = [1 + contacts * (len(NODE_FACTORS) + 1 - row.own_steps) for row, contacts in trials if not row.exact]
    fine = make(ROUGH, contact__nodes=1024)  # so many that a quarter of them tells the shortest wave
    for case, count in ((make(SQUEAL), len(trials)), (fine, sum(rough))):
        found = kinds(system_of(case))
        assert len({method_label(method) for method in found}) == len(found) == count
    labels = {method_label(method) for method in found}
    assert {
        "two-layer (1/2, 1/2)",
        "three-layer (1/12, 10/12, 1/12), paper's start",
        "two-layer (1/2, 1/2), fixed point",
        "two-layer (1/2, 1/2), 512 nodes",
        "two-layer (1/2, 1/2), exact contact",
        "event-driven",
        "event-driven, 256 nodes",
    } <= labels


def test_a_start_that_moves_leaves_out_the_papers_start_which_is_one_from_rest() -> None:
    moving = kinds(system_of(make(SQUEAL, initial__vx=0.01)))
    resting = kinds(system_of(make(SQUEAL)))
    assert {method.start for method in resting} == {"consistent", "paper"}
    assert moving == [method for method in resting if method.start == "consistent"]


def test_the_ladder_halves_from_a_step_that_resolves_the_fastest_motion() -> None:
    slow = make(SQUEAL)
    steps = ladder(system_of(slow))
    assert len(steps) == RUNGS
    assert [steps[0] / step for step in steps] == [2.0**rung for rung in range(RUNGS)]
    frequency = math.sqrt(max(np.linalg.eigvalsh(stiffness(slow)))) / (2.0 * math.pi)
    assert steps[0] == pytest.approx(1.0 / (COARSEST * frequency), rel=1e-9)
    turning = {"wheel__angular_speed": None, "wheel__times": [0.0, 1.0], "wheel__angular_speeds": [0.0, 100.0]}
    waves = ladder(system_of(make(ROUGH, **turning)))  # 50 m/s at last, over waves of 4 mm
    assert waves[0] == pytest.approx(0.004 / (COARSEST * 50.0), rel=1e-9)
    assert ladder(system_of(slow), [1e-6, 4e-6, 2e-6]) == [4e-6, 2e-6, 1e-6]


def stiffness(case: Case) -> NDArray[np.float64]:
    """Stiffness over mass of the shoe on links and contact, (6)-(7)."""
    c = system_of(case).coefficients
    contact = 2.0 * case.contact.half_length * case.contact.stiffness
    return np.array([[c.c_xx, c.c_xy], [c.c_xy, c.c_yy + contact]]) / c.m


def test_a_scheme_with_steps_of_its_own_climbs_tolerances() -> None:
    own = kinds(system_of(make(SQUEAL)), ["event-driven"])
    assert len(own) == 1
    assert [(rung.step, rung.tolerance) for rung in rungs(own[0], [1e-5])] == [(None, e) for e in TOLERANCES]
    two = kinds(system_of(make(SQUEAL)), ["two-layer"])[0]
    assert [(rung.step, rung.tolerance) for rung in rungs(two, [2e-5, 1e-5])] == [(2e-5, 0.0), (1e-5, 0.0)]


@campaign
def test_a_scheme_that_is_exact_is_one_entry_on_smooth_surfaces_alone() -> None:
    (exact,) = kinds(system_of(make(SQUEAL)), ["piecewise-exact"])
    assert rungs(exact, [1e-5]) == [exact]
    assert kinds(system_of(make(ROUGH)), ["piecewise-exact"]) == []
    (entry,) = entries_of(smooth_comparison(), "piecewise-exact", ())
    assert entry.errors is not None
    assert entry.error < 10.0 * smooth_comparison().reference_error
    assert str(entry) == "piecewise-exact"


def test_lists_of_schemes_and_steps_are_read() -> None:
    assert parse_schemes(None) == []
    assert parse_schemes("two-layer, event-driven") == ["two-layer", "event-driven"]
    assert parse_steps(None) == []
    assert parse_steps("1e-5, 5e-6,2.5e-6") == [1e-5, 5e-6, 2.5e-6]


@pytest.mark.parametrize("text", ["", "1e-5,", "x", "0", "-1e-5", "nan", "inf", "1e-5,3e-6", "1e-5,1e-5"])
def test_steps_that_make_no_ladder_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match=f"--steps {text}: "):
        parse_steps(text)


def test_observed_orders_are_those_that_the_schemes_declare() -> None:
    found = smooth_comparison()
    checked = 0
    for method in dict.fromkeys(entry.kind for entry in found.entries):
        if method.own_steps:
            continue
        steps = [entry for entry in found.entries if entry.kind == method]
        system = system_of(smooth(solver__scheme=method.scheme, solver__theta=method.theta))
        declared = load(method.scheme).order(system.weights, method.start)
        assert len(steps) == len(STEPS)
        assert steps[0].order is None
        for entry in steps[-2:]:
            assert entry.errors is not None, entry.failure
            assert entry.errors.error > 10.0 * found.reference_error
            assert entry.order == pytest.approx(declared, abs=0.15), (method_label(method), entry.method.step)
            checked += 1
    assert checked == 2 * STEPPING


def test_observed_order_is_that_of_the_errors_of_neighbours() -> None:
    coarse, fine = entries_of(smooth_comparison(), "three-layer", NUMEROV)[1:3]
    assert coarse.errors is not None
    assert fine.errors is not None
    assert fine.order == pytest.approx(math.log2(coarse.errors.error / fine.errors.error), rel=1e-9)


def test_the_event_driven_scheme_keeps_near_its_tolerance_and_reaches_the_reference() -> None:
    found = entries_of(smooth_comparison(), "event-driven", ())
    assert [entry.tolerance for entry in found] == list(TOLERANCES)
    sizes = [entry.errors.error for entry in found if entry.errors is not None]
    assert len(sizes) == len(TOLERANCES)
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] < 1e-7
    assert smooth_comparison().reference_error < 1e-8


def test_step_limits_and_biases_are_those_of_stability() -> None:
    checked = 0
    for theta in ((0.5, 0.5), (1.0, 1.0), (1.0, 0.5), QUARTERS, NUMEROV):
        scheme = "two-layer" if len(theta) == 2 else "three-layer"
        for entry in entries_of(smooth_comparison(), scheme, theta):
            step = entry.method.step
            case = smooth(solver__scheme=scheme, solver__theta=theta, solver__step=step)
            known = stability(system_of(case)).discrete
            assert known is not None
            assert entry.critical_bias == pytest.approx(known.bias, abs=1e-11)
            assert entry.step_limit == (math.inf if known.step_limit is None else known.step_limit)
            checked += 1
    assert checked >= 25


def test_the_bias_of_weights_of_one_is_as_published() -> None:
    at = next(e for e in entries_of(smooth_comparison(), "two-layer", (1.0, 1.0)) if e.method.step == 0.1)
    assert at.critical_bias == pytest.approx(0.0615433, abs=5e-8)
    half = next(e for e in entries_of(smooth_comparison(), "two-layer", (0.5, 0.5)) if e.method.step == 0.1)
    assert half.critical_bias == pytest.approx(0.0, abs=1e-6)


def test_on_rough_surfaces_the_bias_is_that_of_stability_too() -> None:
    path = str(ROOT / "cases" / "accuracy" / "C.toml")
    solver = ["solver.theta=[1.0, 1.0]", "solver.duration=1e-3"]
    case = parse_case(*read_text(path), [*solver, "solver.step=2e-5", "output.sample_interval=2e-5"]).case
    found = compare(system_of(case), schemes=["two-layer"], steps=[2e-5], budget=1.0)
    (entry,) = entries_of(found, "two-layer", (1.0, 1.0))
    known = stability(system_of(case)).discrete
    assert known is not None
    assert known.bias is not None
    assert abs(known.bias) > 1e-3
    assert entry.critical_bias == pytest.approx(known.bias, abs=1e-10)


def test_a_step_above_the_limit_of_numerovs_weights_has_no_result() -> None:
    limit = math.sqrt(6.0 / 3.0)  # ωh < √6, and ω² = 3
    found = compare(system_of(smooth()), schemes=["three-layer"], steps=[1.5, 0.5], budget=30.0)
    above, below = entries_of(found, "three-layer", NUMEROV)
    for entry in (above, below):
        assert entry.step_limit == pytest.approx(limit, rel=1e-5)
    assert above.errors is None
    assert "unstable" in above.failure
    assert below.errors is not None
    assert below.order is None  # there is nothing to compare it with
    assert not above.on_front
    unlimited = entries_of(found, "three-layer", QUARTERS)
    assert [entry.step_limit for entry in unlimited] == [math.inf, math.inf]
    assert all(entry.errors is not None for entry in unlimited)


def test_no_entry_beats_one_of_the_front_and_each_other_is_beaten() -> None:
    able = [entry for entry in smooth_comparison().entries if entry.errors is not None]
    front = [entry for entry in able if entry.on_front]
    assert len(able) > 50
    assert front
    for entry in able:
        assert entry.on_front != any(beats(other, entry) for other in able), entry.label


def beats(one: Entry, other: Entry) -> bool:
    assert one.errors is not None
    assert other.errors is not None
    first = (one.wall_seconds, one.errors.error)
    second = (other.wall_seconds, other.errors.error)
    return first[0] <= second[0] and first[1] <= second[1] and first != second  # type: ignore[operator]


@pytest.mark.parametrize("target", [1e-1, 1e-3, 1e-6])
def test_recommended_is_the_cheapest_that_meets_the_target(target: float) -> None:
    found = smooth_comparison()
    best = ComparisonReport(Path("x.h5"), smooth(), found, target).recommended
    assert best is not None
    assert best.errors is not None
    assert best.errors.error <= target
    able = [e for e in found.entries if e.errors and e.errors.error + found.reference_error <= target]
    assert best.wall_seconds == min(entry.wall_seconds or math.inf for entry in able)


def test_an_error_that_is_low_by_chance_is_told() -> None:
    """The coarsest step is given an error that meets the target, which all finer ones miss."""
    found = smooth_comparison()
    coarsest, *finer = [e for e in entries_of(found, "two-layer", (0.5, 0.5)) if e.errors is not None]
    assert coarsest.errors is not None
    worst = max(entry.errors.error for entry in finer if entry.errors is not None)
    known = ComparisonReport(Path("x.h5"), smooth(), found, 1.0).numbers()["entries"]
    assert finer_error(known, values_of(ENTRY, coarsest)) == worst
    assert finer_error(known, values_of(ENTRY, finer[-1])) == 0.0
    target = 1e-3 * min(entry.errors.error for entry in finer if entry.errors is not None)
    lucky = replace(coarsest, errors=replace(coarsest.errors, error=target / 2.0))
    for entries, told in (((lucky, *finer), True), ((lucky,), False)):
        chosen = replace(found, entries=entries, reference_error=0.0)
        numbers = ComparisonReport(Path("x.h5"), smooth(), chosen, target).numbers()
        answer = of_comparison(numbers, {}, "").answer
        assert ("by chance" in answer[-1]) == told


@pytest.mark.parametrize("base", [SQUEAL, ROUGH], ids=["smooth", "rough"])
def test_the_keys_of_a_method_make_a_case_that_is_solved_by_it(base: dict[str, Any]) -> None:
    text = tomli_w.dumps(base)
    system = system_of(make(base))
    for kind in kinds(system):
        method = rungs(kind, ladder(system))[0]
        keys = [f"{key}={json.dumps(value)}" for key, value in in_a_case(method, 1e-4, system.interval).items()]
        made = system_of(parse_case(text, "case", keys).case).method
        if method.own_steps:  # a case asks for an error, and its run finds the method
            assert (made.tolerance, made.automatic, made.step) == (1e-4, True, None)
        else:
            asked = "auto" if method.evaluator == "closed-form" else method.evaluator
            nodes = method.nodes or made.nodes  # those of the case where the method needs none
            assert replace(made, tolerance=0.0) == replace(method, evaluator=asked, nodes=nodes)


def test_nothing_is_recommended_where_nothing_meets_the_target() -> None:
    numbers = ComparisonReport(Path("x.h5"), smooth(), smooth_comparison(), 1e-15).numbers()
    assert numbers["recommended"] is None
    assert numbers["margin"] is None


def test_every_evaluator_appears_on_rough_surfaces_and_nodes_lower_the_error() -> None:
    found = rough_comparison()
    evaluators = {entry.kind.evaluator for entry in found.entries}
    assert {str(kind) for kind in evaluators} == {"auto", "midpoint", "exact"}
    sizes = {
        (str(entry.kind.evaluator), entry.kind.nodes): entry.errors.error
        for entry in found.entries
        if entry.errors is not None and entry.method.step == 5e-6 and entry.kind.theta == (0.5, 0.5)
    }
    nodes = [sizes["midpoint", count] for count in (134, 268, 536)]
    assert nodes == sorted(nodes, reverse=True)
    assert nodes[0] > 10.0 * nodes[-1]  # four nodes to the shortest of 33 waves, and four times as many
    assert sizes["exact", 0] < nodes[1]
    assert rough_comparison().reference_error < 1e-8


def test_what_the_budget_does_not_allow_is_left_out_and_named() -> None:
    system = system_of(make(ROUGH, solver__duration=2.0))
    found = compare(system, schemes=["two-layer"], steps=[1e-4, 5e-8], budget=1.0)
    assert found.duration < 0.5 * system.duration
    assert found.left_out > 0
    missing = [entry for entry in found.entries if "left out" in entry.failure]
    assert len(missing) == found.left_out
    for entry in missing:
        assert (entry.errors, entry.work, entry.wall_seconds, entry.on_front) == (None, None, None, False)
    assert any(entry.errors is not None for entry in found.entries)


def test_json_and_file_hold_the_same_entries(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    done = brakecli(
        "compare-schemes", "tiny.toml", "--steps", "4e-5,2e-5", "--budget", "2", "--json", cwd=tmp_path
    )
    assert done.code == 0, done.err
    numbers = done.json
    assert left_in(tmp_path) == {"tiny.toml", "tiny-schemes.h5"}
    assert len(numbers["entries"]) == STEPPING * 2 + len(TOLERANCES) + 1
    assert all(set(entry) >= ENTRY_NAMES for entry in numbers["entries"])
    assert numbers["recommended"] in numbers["entries"]
    path = tmp_path / numbers["output"]
    stored = xarray.open_dataset(path, engine="h5netcdf")
    assert stored.attrs["kind"] == "comparison"
    assert stored.sizes == {"entry": len(numbers["entries"])}
    assert numbers["entries"][stored.attrs["recommended"]] == numbers["recommended"]
    for name in sorted(ENTRY_NAMES - {"theta"}):
        values = [entry[name] for entry in numbers["entries"]]
        if stored[name].dtype.kind == "f":
            np.testing.assert_array_equal(stored[name], np.array([math.nan if v is None else v for v in values]))
        else:
            assert [str(value) for value in stored[name].values] == [str(value) for value in values], name
    assert attributes(path)["complete"] == 1
    assert all(stored[name].attrs["long_name"] for name in stored.variables)


def test_options_and_outputs_that_cannot_be_are_refused_before_anything_is_computed(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TINY)
    (tmp_path / "there.h5").write_text("mine")
    wrong = {
        ("-o", "there.h5"): "--force",
        ("--schemes", "one-layer"): "give some of two-layer, three-layer, event-driven",
        ("--steps", "1e-5,3e-6"): "must divide the largest",
        ("--steps", "1e-5,1e-5"): "twice",
        ("--budget", "0"): "--budget",
        ("--target-error", "2"): "--target-error",
        ("--set", "solver.stepp=1"): "solver.step",
    }
    for options, words in wrong.items():
        brakecli("compare-schemes", "tiny.toml", *options, cwd=tmp_path).told(2, words)
    assert left_in(tmp_path) == {"tiny.toml", "there.h5"}
    assert (tmp_path / "there.h5").read_text() == "mine"


@pytest.mark.parametrize("path", sorted((ROOT / "cases" / "accuracy").glob("*.toml")), ids=lambda path: path.stem)
def test_every_case_of_the_documentation_on_accuracy_is_valid(path: Path) -> None:
    case = parse_case(*read_text(str(path))).case
    system = system_of(case)
    assert case.title.startswith(f"Accuracy, case {path.stem}")
    assert system.smooth == (path.stem == "S")
    assert system.nodes in (0, 256)
