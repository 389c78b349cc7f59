"""Every evaluator and every scheme, found by its file, keeps the contract that its package states."""

import pkgutil
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Case
from brakecli.case.read import parse_case, starters
from brakecli.case.system import system_of
from brakecli.case.tables import key_schema
from brakecli.errors import CaseError
from brakecli.solver import contact, schemes, steps
from brakecli.solver.coefficients import Coefficients
from brakecli.solver.contact import auto, cells, closed_form, exact, midpoint
from brakecli.solver.contact.force import fill
from brakecli.solver.contact.pad import build_layer, build_pad
from brakecli.solver.records import MOST_KINDS, Problem, Weights, new
from brakecli.solver.roughness import surface
from brakecli.solver.steps import event_driven, piecewise_exact, three_layer, two_layer
from brakecli.solver.steps.implicit import SOLVED, newton
from brakecli.solver.steps.loop import load
from tests.solver import small_scheme
from tests.solver.rough_gap import outputs, unfilled

EVALUATORS = sorted(
    module.name
    for module in pkgutil.iter_modules(contact.__path__)
    if module.name not in ("pad", "force", "heights")
)
SCHEMES = sorted(
    module.name
    for module in pkgutil.iter_modules(steps.__path__)
    if module.name not in ("loop", "step", "implicit")
)
STEPPING = [name.replace("-", "_") for name, row in schemes.SCHEMES.items() if not row.own_steps]
WEIGHTS: dict[int, list[tuple[float, ...]]] = {
    0: [(), (), ()],
    2: [(0.5, 0.5), (1.0, 1.0), (1.0, 0.5)],
    3: [(0.25, 0.5, 0.25), (0.5, 0.0, 0.5), (0.4, 0.5, 0.1)],
}


def weights_of(name: str) -> list[tuple[float, ...]]:
    return WEIGHTS[len(schemes.SCHEMES[name.replace("_", "-")].theta)]


START = ((1e-5, -2e-5), (0.1, -0.2), (3.0, 4.0))


def test_every_file_can_be_named_in_a_case_and_every_name_has_a_file() -> None:
    names = key_schema(Case, ("solver", "scheme"))["enum"]
    for files, known, registry in (
        (EVALUATORS, key_schema(Case, ("contact", "evaluator"))["enum"], "contact.EVALUATORS"),
        (SCHEMES, set(names) - {"auto"}, "schemes.SCHEMES"),  # auto chooses one
    ):
        rows = sorted(name.replace("-", "_") for name in known)
        assert files == rows, f"give each file a row of {registry}, and each row a file"


def test_a_row_added_to_a_registry_can_be_named_in_a_case_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = ['contact.evaluator="other"', 'solver.scheme="three-equal"']
    with pytest.raises(CaseError) as caught:
        parse_case(starters()["case"], "starter", chosen)
    evaluators, names = (", ".join(map('"{}"'.format, each)) for each in (contact.EVALUATORS, schemes.SCHEMES))
    assert [str(problem) for problem in caught.value.problems] == [
        '--set contact.evaluator="other": contact.evaluator: is not one of the choices (found "other");'
        f" give one of {evaluators}",
        '--set solver.scheme="three-equal": solver.scheme: is not one of the choices (found "three-equal");'
        f' give one of {names}, "auto"',
    ]
    row = replace(schemes.SCHEMES["three-layer"], theta=(0.3, 0.4, 0.3), starts=("consistent",))
    monkeypatch.setitem(schemes.SCHEMES, "three-equal", row)
    monkeypatch.setitem(contact.EVALUATORS, "other", contact.EVALUATORS["exact"])
    method = system_of(parse_case(starters()["case"], "starter", chosen).case).method
    assert (method.row, method.theta, method.evaluator) == (row, row.theta, "other")
    assert "three-equal" in key_schema(Case, ("solver", "scheme"))["enum"]
    with pytest.raises(CaseError, match="is only for the three-layer scheme"):
        parse_case(starters()["case"], "starter", [*chosen, 'solver.start="paper"'])


# --- evaluators ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EVALUATORS)
def test_an_evaluator_fills_its_results_and_leaves_everything_else(name: str) -> None:
    rng = np.random.default_rng(41)
    valid = 0
    kinds = set()
    for _ in range(200):
        shoe, wheel = (
            surface(
                rng.uniform(1e-6, 5e-5, n).tolist(),
                wavelengths=rng.uniform(0.003, 0.1, n).tolist(),
                phases_deg=rng.uniform(0, 360, n).tolist(),
            )
            for n in rng.integers(0, 5, 2)
        )
        height = float(shoe.g.sum() + wheel.g.sum()) or 1e-5
        pad = build_pad(10 ** rng.uniform(0, 16), 0.05, shoe, wheel, 64)
        layer = unfilled(name.replace("_", "-"), pad)
        layer.angles[:] = rng.uniform(-6, 0, wheel.g.size)
        numbers: Any = layer.layer.pad
        given = numbers.tobytes(), layer.tables.tobytes(), layer.angles.tobytes()
        y = rng.uniform(-1.5, 1.5) * height
        fill(rng.uniform(-1e-2, 1e-2), y, *layer)
        filled = layer.contact
        assert np.isfinite([*outputs(filled), filled.blur]).all()
        assert filled.near >= 0.0
        assert filled.normal_force >= 0.0
        assert filled.stiffness >= 0.0
        assert 0.0 <= filled.fraction <= 1.0
        assert contact.kinds()[filled.kind]
        assert filled.valid in (0, 1)
        if filled.valid == 1:
            assert filled.normal_force == 0.0 or filled.fraction > 0.0
            # A difference of terms of 2ak height²/2: not negative but for their rounding.
            assert (
                filled.store >= -1e-14 * pad.constants.k * 2 * pad.constants.half_length * (height + abs(y)) ** 2
            )
        assert (numbers.tobytes(), layer.tables.tobytes(), layer.angles.tobytes()) == given
        valid += filled.valid == 1
        kinds.add(contact.kinds()[filled.kind])
    assert valid > 50
    assert kinds <= {name.replace("_", "-")} if name != "auto" else kinds == {"closed-form", "cells"}


@pytest.mark.parametrize("name", EVALUATORS)
def test_an_evaluator_is_accepted_by_the_step(name: str) -> None:
    pad = build_pad(1e8, 0.05, surface(), surface(), 64)
    problem = new(Problem)
    problem.a_11 = 1e6
    problem.a_22 = 1e6
    problem.gain = 0.1
    problem.phi = 0.3
    assert newton(*build_layer(name.replace("_", "-"), pad), problem, 100)[0] == SOLVED


# --- schemes -------------------------------------------------------------------------------------------------

COEFFICIENTS = Coefficients(10.0, 300.0, -20.0, 200.0, 2e7, -1e6, 1e7, 0.0, 1.0, 0.3)


# mypy holds these modules to the signatures
STEPS: list[schemes.SteppingModule] = [two_layer, three_layer, small_scheme]
OWN_STEPS: list[schemes.OwnStepsModule] = [event_driven, piecewise_exact]
CONTACTS: list[contact.EvaluatorModule] = [auto, cells, closed_form, exact, midpoint]


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_keeps_the_contract_of_its_kind(name: str) -> None:
    module = load(name.replace("_", "-"))
    assert module in [*STEPS, *OWN_STEPS], f"add {name} to STEPS or OWN_STEPS, so that mypy sees it"
    assert isinstance(module, schemes.SchemeModule)
    assert isinstance(module, schemes.SteppingModule) is (module in STEPS) is (name in STEPPING)
    assert isinstance(module, schemes.OwnStepsModule) is (module in OWN_STEPS)


@pytest.mark.parametrize("missing", ["LAG", "VELOCITIES", "begin", "KEPT", "prepare", "finish"])
def test_a_scheme_that_lacks_a_part_is_no_scheme(missing: str) -> None:
    parts = {name: value for name, value in vars(small_scheme).items() if name != missing}
    assert isinstance(SimpleNamespace(**vars(small_scheme), __hash__=hash), schemes.SteppingModule)
    assert not isinstance(SimpleNamespace(**parts, __hash__=hash), schemes.SteppingModule)


@pytest.mark.parametrize("name", EVALUATORS)
def test_an_evaluator_keeps_its_contract(name: str) -> None:
    module = import_module(f"{contact.__name__}.{name}")
    assert module in CONTACTS, f"add {name} to CONTACTS, so that mypy sees it"
    assert isinstance(module, contact.EvaluatorModule)


def test_a_module_without_evaluate_is_no_evaluator() -> None:
    assert not isinstance(SimpleNamespace(press=exact.evaluate), contact.EvaluatorModule)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_states_what_the_loop_needs_of_it(name: str) -> None:
    scheme: Any = load(name.replace("_", "-"))
    assert scheme.LAG in (0, 1)
    assert set(scheme.VELOCITIES) <= set(scheme.MEMORY) <= set(scheme.STATE.layout.names)
    checked = 0
    for theta in weights_of(name):
        weights = Weights(1e-5, *(*theta, 0.0, 0.0, 0.0)[:3])
        assert 0.0 <= scheme.weighted_time(weights) <= 1.0
        for start in ("consistent", "paper"):
            assert scheme.order(weights, start) in ((1, 2) if name in STEPPING else (8, 17))
        checked += 1
    assert checked == 3


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_starts_at_the_given_state(name: str) -> None:
    scheme: Any = load(name.replace("_", "-"))
    weights = Weights(1e-5, *(*weights_of(name)[0], 0.0, 0.0, 0.0)[:3])
    state = new(scheme.STATE)
    scheme.begin(weights, state, *START)
    assert ((state.x, state.y) if scheme.LAG == 0 else (state.x_old, state.y_old)) == START[0]
    assert (state.v_x, state.v_y) == START[1]
    if scheme.LAG == 1:
        h = weights.h
        next_ = [r + h * v + 0.5 * h * h * a for r, v, a in zip(*START, strict=True)]
        np.testing.assert_allclose((state.x, state.y), next_, rtol=1e-15)
    kinetic, links, position, back = scheme.mechanical_energy(COEFFICIENTS, weights, state)
    # At most half a step off the start: 1/2 m v² to h a/v, the links' energy to h v/r.
    c = COEFFICIENTS
    x, y = START[0]
    v_x, v_y = START[1]
    assert kinetic == pytest.approx(0.5 * c.m * (v_x**2 + v_y**2), rel=1e-3)
    assert links == pytest.approx(0.5 * (c.c_xx * x * x + 2 * c.c_xy * x * y + c.c_yy * y * y), rel=0.2)
    assert position == pytest.approx((x, y), rel=0.1)
    assert back in (0.0, 0.5)


def test_more_evaluators_than_a_run_can_count_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    left = MOST_KINDS - len(contact.kinds())
    more = {f"of-a-user-{n}": contact.EVALUATORS["exact"] for n in range(left)}
    monkeypatch.setattr(contact, "EVALUATORS", contact.EVALUATORS | more)
    contact.place_of("of-a-user-0")
    monkeypatch.setitem(contact.EVALUATORS, "one-more", contact.EVALUATORS["exact"])
    with pytest.raises(ValueError, match="EVALUATORS has 9 kinds, a run can count 8"):
        contact.place_of("of-a-user-0")
