"""What a run does whatever the case: samples, blocks, symmetry, iterations, extremes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from brakecli.analysis.stability.discrete import step_limits
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.solver import integrate as simulation
from brakecli.solver import schemes
from brakecli.solver.integrate import solve
from brakecli.solver.quantities import Failure
from tests.examples import COULOMB, MODE_COUPLING, ROUGH, SQUEAL, make, simulate
from tests.solver.test_interpreted import case as changing

SCHEMES = [(name, row.theta) for name, row in schemes.SCHEMES.items() if not row.own_steps]


@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
def test_cutting_a_run_into_blocks_changes_no_bit(
    scheme: str, theta: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = make(ROUGH, solver__scheme=scheme, solver__theta=theta, wheel__angular_speed=0.2)
    whole = simulate(case)
    monkeypatch.setattr(simulation, "BLOCK_SECONDS", 0.0)  # blocks of one step after the first
    pieces = simulate(case)
    assert np.array_equal(whole.rows, pieces.rows)
    assert whole.energy == pieces.energy
    assert len(whole.rows) == 201


@pytest.mark.parametrize("scheme", schemes.SCHEMES)
def test_cutting_a_run_changes_no_bit_of_what_is_noted_while_speed_and_load_change(
    scheme: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    evaluator = "closed-form" if schemes.SCHEMES[scheme].exact else "exact"
    system = replace(system_of(Case.model_validate(changing(scheme, evaluator))), tracked=True)
    whole = solve(system).track
    monkeypatch.setattr(simulation, "BLOCK_SECONDS", 0.0)
    pieces = solve(system).track
    assert whole is not None
    assert pieces is not None
    for one, other in zip((*whole.kept, whole.works), (*pieces.kept, pieces.works), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
@pytest.mark.parametrize("per_sample", [1, 3, 10])
def test_samples_do_not_depend_on_how_many_steps_lie_between_them(
    scheme: str, theta: tuple[float, ...], per_sample: int
) -> None:
    fine = simulate(make(SQUEAL, solver__scheme=scheme, solver__theta=theta, output__sample_interval=1e-5))
    coarse = simulate(
        make(
            SQUEAL,
            solver__scheme=scheme,
            solver__theta=theta,
            output__sample_interval=per_sample * 1e-5,
            solver__duration=0.09,
        )
    )
    assert len(coarse.rows) == 9000 // per_sample + 1
    # The steps differ by the rounding of the interval's quotient only.
    assert np.allclose(coarse.rows[:100], fine.rows[::per_sample][:100], rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
@pytest.mark.parametrize("base", [SQUEAL, ROUGH])
def test_a_wheel_that_turns_the_other_way_gives_the_mirror_image(
    scheme: str, theta: tuple[float, ...], base: dict[str, Any]
) -> None:
    changes: dict[str, Any] = {"solver__scheme": scheme, "solver__theta": theta, "wheel__angular_speed": 0.2}
    forwards = simulate(make(base, **changes))
    angles = {f"{link}__angle_deg": -base[link].get("angle_deg", 0.0) for link in ("link1", "link2")}
    rough = base.get("roughness", {})
    mirrored = {  # sin(-ωξ) = -sin(ωξ): a phase of 180° keeps the profile's mirror image
        f"roughness__{name}": {**profile, "phases_deg": [180.0] * len(profile["amplitudes"])}
        for name, profile in rough.items()
    }
    backwards = simulate(make(base, **{**changes, "wheel__angular_speed": -0.2}, **angles, **mirrored))
    signs = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
    assert np.allclose(backwards.rows[:, :7], (forwards.rows * signs)[:, :7], rtol=1e-6, atol=1e-9)
    slip = forwards.state < 2
    assert np.mean(backwards.state[slip] == -forwards.state[slip]) > 0.999


def test_a_run_that_the_fixed_point_cannot_solve_says_so() -> None:
    case = make(SQUEAL, contact__stiffness=1e14, solver__iteration="fixed-point")
    limits = step_limits(system_of(case))
    assert limits.contraction > 1.0
    work = simulate(case).work
    assert work.failure is Failure.UNCONVERGED
    assert work.unconverged_steps == 1
    assert work.unconverged.shape == (1, 2)
    assert simulate(make(SQUEAL, contact__stiffness=1e14)).work.failure is Failure.NONE


@pytest.mark.parametrize(("stiffness", "phi"), [(1.0, 0.5), (1e8, 5.0), (1e12, 0.0), (1e16, 0.5), (1e16, 5.0)])
@pytest.mark.parametrize("base", [SQUEAL, ROUGH])
def test_any_stiffness_and_friction_end_in_a_solution_or_a_named_failure(
    base: dict[str, Any], phi: float, stiffness: float
) -> None:
    case = make(base, contact__stiffness=stiffness, friction__coefficient=phi, solver__duration=0.005)
    result = simulate(case)
    assert np.all(np.isfinite(result.rows))
    assert np.all(result.normal_force >= 0.0)
    assert np.all(np.abs(result.friction_force) <= phi * result.normal_force * (1.0 + 1e-12))
    if result.work.failure is Failure.NONE:
        assert result.work.unconverged_steps == 0
        assert len(result.rows) == 51
    else:
        assert result.work.failure is Failure.UNBALANCED


@pytest.mark.parametrize(("scheme", "theta"), SCHEMES)
def test_steady_sliding_stays_where_it_is(scheme: str, theta: tuple[float, ...]) -> None:
    case = make(
        SQUEAL, initial__at="equilibrium", friction__coefficient=0.3, solver__scheme=scheme, solver__theta=theta
    )
    result = simulate(case)
    assert np.ptp(result.x) < 1e-12 * abs(result.x[0])
    assert result.friction_force == pytest.approx(0.3 * result.normal_force, rel=1e-12)


@pytest.mark.parametrize("step", [1e-5, 5e-6, 2.5e-6])
def test_three_layer_scheme_tells_stick_by_its_cycles_not_by_its_flicker(step: float) -> None:
    changes: dict[str, Any] = {
        "solver__step": step,
        "solver__duration": 0.4,
        "output__sample_interval": 2e-5,
        "friction__coefficient": 0.7,
    }
    fractions = []
    episodes = []
    for scheme, theta in SCHEMES:
        result = simulate(make(SQUEAL, solver__scheme=scheme, solver__theta=theta, **changes))
        stick = result.state[result.time > 0.2] == 0
        fractions.append(stick.mean())
        episodes.append(np.sum(stick[1:] & ~stick[:-1]))
    assert episodes[0] == episodes[1] == 35  # once in each of the cycles of 0.2 s at 174 Hz
    # Stick begins and ends within half a step of its time; samples see it to a part of one in 35 cycles.
    assert fractions[1] == pytest.approx(fractions[0], abs=step * 174.0 + 0.002)


def test_load_and_speed_schedules_act_at_their_times() -> None:
    # A free mass without links: the load decides ÿ, and the open contact nothing.
    case = make(
        {
            **COULOMB,
            "initial": {"y": 1.0},
            "link1": {"stiffness": 0.0},
            "link2": {"stiffness": 0.0},
            "load": {"times": [1.0, 2.0], "forces": [0.0, -1.0]},
            "solver": {"step": 0.01, "duration": 3.0},
        }
    )
    result = simulate(case)
    t = result.time
    exact = 1.0 + np.where(
        t < 1.0, 0.0, np.where(t < 2.0, (t - 1.0) ** 3 / 6.0, 1 / 6 + (t - 2.0) / 2 + (t - 2) ** 2 / 2)
    )
    assert np.abs(result.y - exact).max() < 0.01**2 * 2.0  # the trapezoidal rule's h²/12 ∫|Q''| and its knots


def test_motion_that_blows_up_is_named() -> None:
    case = make(MODE_COUPLING, solver__scheme="three-layer", solver__theta=(0.0, 1.0, 0.0), solver__step=1.5,
                solver__duration=3000.0)  # fmt: skip
    result = simulate(case)
    assert result.work.failure is Failure.DIVERGED
    assert np.all(np.isfinite(result.rows))


def test_closed_form_refuses_a_pad_that_may_open() -> None:
    work = simulate(make(ROUGH, contact__evaluator="closed-form")).work
    assert work.failure is Failure.NOT_CLOSED


def test_auto_takes_the_closed_form_where_the_pad_touches_and_says_so() -> None:
    work = simulate(make(ROUGH, load__force=5000.0, solver__duration=0.2)).work
    assert set(work.evaluators) == {"closed-form", "cells"}
    assert sum(work.evaluators.values()) == work.steps
    assert simulate(make(SQUEAL)).work.evaluators == {"closed-form": 10000}


def test_a_run_keeps_no_more_than_a_block_in_memory() -> None:
    sizes: list[int] = []
    system = system_of(make(SQUEAL, solver__duration=10.0, output__sample_interval=1e-5))
    solve(system, sink=lambda rows: sizes.append(len(rows)))
    assert sum(sizes) == 10**6 + 1
    assert max(sizes) <= simulation.BLOCK_ROWS
