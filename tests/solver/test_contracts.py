"""Every evaluator and every scheme, found by its file, keeps the contract that its package states."""

import pkgutil
from typing import Any

import numpy as np
import pytest

from brakecli.case.case import Evaluator, Scheme
from brakecli.solver import contact, schemes
from brakecli.solver.compile import (
    A_11,
    A_12,
    A_22,
    FRACTION,
    GAIN,
    KIND,
    NORMAL_FORCE,
    PROBLEM_SIZE,
    SCRATCH,
    STATE_SIZE,
    STIFFNESS,
    STORE,
    VALID,
    VX,
    VY,
    WORK_SIZE,
    X_OLD,
    Y_OLD,
    Coefficients,
    Weights,
    X,
    Y,
)
from brakecli.solver.contact.pad import HALF, K, build_contact, build_pad
from brakecli.solver.implicit_step import SOLVED, newton
from brakecli.solver.loop import advance
from brakecli.solver.roughness import surface

EVALUATORS = sorted(module.name for module in pkgutil.iter_modules(contact.__path__) if module.name != "pad")
SCHEMES = sorted(module.name for module in pkgutil.iter_modules(schemes.__path__))
STEPPING = [name for name in SCHEMES if not schemes.SCHEMES[name.replace("_", "-")].own_steps]
WEIGHTS: dict[int, list[tuple[float, ...]]] = {
    0: [(), (), ()],
    2: [(0.5, 0.5), (1.0, 1.0), (1.0, 0.5)],
    3: [(0.25, 0.5, 0.25), (0.5, 0.0, 0.5), (0.4, 0.5, 0.1)],
}
START = ((1e-5, -2e-5), (0.1, -0.2), (3.0, 4.0))


def test_every_file_can_be_named_in_a_case_and_every_name_has_a_file() -> None:
    assert [name.replace("_", "-") for name in EVALUATORS] == sorted(Evaluator)
    assert [name.replace("_", "-") for name in SCHEMES] == sorted(set(Scheme) - {Scheme.AUTO})  # which chooses one


# --- evaluators ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EVALUATORS)
def test_an_evaluator_fills_its_results_and_leaves_everything_else(name: str) -> None:
    evaluate = contact.load(name.replace("_", "-"))
    rng, valid, kinds = np.random.default_rng(41), 0, set()
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
        angles = rng.uniform(-6, 0, wheel.g.size)
        given = pad.copy(), angles.copy()
        filled = build_contact(pad)
        filled[:] = np.nan
        y = rng.uniform(-1.5, 1.5) * height
        evaluate(rng.uniform(-1e-2, 1e-2), y, angles, pad, filled)
        assert np.isfinite(filled[:SCRATCH]).all()
        assert filled[NORMAL_FORCE] >= 0.0
        assert filled[STIFFNESS] >= 0.0
        assert 0.0 <= filled[FRACTION] <= 1.0
        assert contact.kinds()[int(filled[KIND])]
        assert filled[VALID] in (0.0, 1.0)
        if filled[VALID] == 1.0:
            assert filled[NORMAL_FORCE] == 0.0 or filled[FRACTION] > 0.0
            # A difference of terms of 2ak height²/2: not negative but for their rounding.
            assert filled[STORE] >= -1e-14 * pad[K] * 2 * pad[HALF] * (height + abs(y)) ** 2
        np.testing.assert_array_equal(pad, given[0])
        np.testing.assert_array_equal(angles, given[1])
        valid += filled[VALID] == 1.0
        kinds.add(contact.kinds()[int(filled[KIND])])
    assert valid > 50
    assert kinds <= {name.replace("_", "-")} if name != "auto" else kinds == {"closed-form", "midpoint"}


@pytest.mark.parametrize("name", EVALUATORS)
def test_an_evaluator_is_accepted_by_the_step(name: str) -> None:
    pad = build_pad(1e8, 0.05, surface(), surface(), 64)
    problem = np.zeros(PROBLEM_SIZE)
    problem[[A_11, A_22, GAIN]] = 1e6, 1e6, 0.1
    evaluate = contact.load(name.replace("_", "-"))
    assert newton(evaluate, 100, 0.3, np.zeros(0), pad, problem, build_contact(pad))[0] == SOLVED


# --- schemes -------------------------------------------------------------------------------------------------

COEFFICIENTS = Coefficients(10.0, 300.0, -20.0, 200.0, 2e7, -1e6, 1e7, 0.0, 1.0, 0.3)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_states_what_the_loop_needs_of_it(name: str) -> None:
    scheme: Any = schemes.load(name.replace("_", "-"))
    assert scheme.WEIGHTS in WEIGHTS
    assert scheme.LAG in (0, 1)
    assert set(scheme.VELOCITIES) <= set(scheme.MEMORY) <= set(range(STATE_SIZE))
    checked = 0
    for theta in WEIGHTS[scheme.WEIGHTS]:
        weights = Weights(1e-5, *(*theta, 0.0, 0.0, 0.0)[:3])
        assert 0.0 <= scheme.weighted_time(weights) <= 1.0
        for start in ("consistent", "paper"):
            assert scheme.order(weights, start) in ((1, 2) if name in STEPPING else (8,))
        checked += 1
    assert checked == 3


@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_starts_at_the_given_state(name: str) -> None:
    scheme: Any = schemes.load(name.replace("_", "-"))
    weights = Weights(1e-5, *(*WEIGHTS[scheme.WEIGHTS][0], 0.0, 0.0, 0.0)[:3])
    state = scheme.begin(weights, *START)
    assert state.size == STATE_SIZE if name in STEPPING else state.size > STATE_SIZE
    known = [X, Y] if scheme.LAG == 0 else [X_OLD, Y_OLD]
    assert tuple(state[known]) == START[0]
    assert tuple(state[[VX, VY]]) == START[1]
    if scheme.LAG == 1:
        h = weights.h
        next_ = [r + h * v + 0.5 * h * h * a for r, v, a in zip(*START, strict=True)]
        np.testing.assert_allclose(state[[X, Y]], next_, rtol=1e-15)
    kinetic, links, position, back = scheme.mechanical_energy(COEFFICIENTS, weights, state)
    # At most half a step off the start: 1/2 m v² to h a/v, the links' energy to h v/r.
    c, (x, y), (v_x, v_y) = COEFFICIENTS, START[0], START[1]
    assert kinetic == pytest.approx(0.5 * c.m * (v_x**2 + v_y**2), rel=1e-3)
    assert links == pytest.approx(0.5 * (c.c_xx * x * x + 2 * c.c_xy * x * y + c.c_yy * y * y), rel=0.2)
    assert position == pytest.approx((x, y), rel=0.1)
    assert back in (0.0, 0.5)


@pytest.mark.parametrize("name", STEPPING)
def test_a_scheme_s_kernels_pose_a_definite_problem_and_take_its_solution(name: str) -> None:
    scheme: Any = schemes.load(name.replace("_", "-"))
    checked = 0
    for theta in WEIGHTS[scheme.WEIGHTS]:
        weights = Weights(1e-5, *(*theta, 0.0)[:3])
        state, problem, work = scheme.begin(weights, *START), np.full(PROBLEM_SIZE, np.nan), np.zeros(WORK_SIZE)
        scheme.prepare(COEFFICIENTS, weights, state, 5e3, 1.0, 1.0, problem)
        assert problem[A_11] > 0
        assert problem[A_11] * problem[A_22] > problem[A_12] ** 2
        assert problem[GAIN] > 0
        pad = build_pad(1e8, 0.05, surface(), surface(), 0)
        filled = build_contact(pad)
        evaluate = contact.load("closed-form")
        assert newton(evaluate, 100, COEFFICIENTS.phi, np.zeros(0), pad, problem, filled)[0] == SOLVED
        assert np.isfinite(problem).all()
        before = state.copy()
        scheme.finish(COEFFICIENTS, weights, state, 5e3, 1.0, 1.0, problem, filled, work)
        assert np.isfinite(state).all()
        assert np.isfinite(work).all()
        np.testing.assert_array_equal(state[[X_OLD, Y_OLD]], before[[X, Y]])
        assert state[X] != before[X]
        checked += 1
    assert checked == 3


def test_the_loop_is_compiled_for_every_scheme_at_once() -> None:
    """One signature: what a scheme or an evaluator hands over is a function pointer, not a type of its own."""
    assert len(getattr(advance, "signatures", [None])) == 1
