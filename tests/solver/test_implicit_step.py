"""One implicit step: both iterations against the scalar equation that they solve, from soft to very stiff."""

import math
from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.case.system import system_of
from brakecli.solver.contact.force import evaluate, fill
from brakecli.solver.contact.pad import build_layer, build_pad
from brakecli.solver.friction import minimise
from brakecli.solver.integrate import Stepping
from brakecli.solver.method import MOST_EVALUATIONS
from brakecli.solver.records import Problem, new
from brakecli.solver.roughness import Surface, surface
from brakecli.solver.steps.implicit import SOLVED, UNCONVERGED, fixed_point, newton
from tests.campaign import campaign, counts
from tests.examples import ROUGH, make

EPS = 2.0**-52
A = 0.05
FLAT = surface()


class Step:
    """The problem of one step on a pad, and the exact function F -> F_y(x(F), y(F))."""

    def __init__(
        self,
        *,
        k: float,
        shoe: Surface = FLAT,
        wheel: Surface = FLAT,
        angles: NDArray[np.float64] | None = None,
        evaluator: str = "exact",
        phi: float = 0.3,
        guess: float = 0.0,
        **entries: float,
    ) -> None:
        self.shoe = shoe
        self.wheel = wheel
        self.phi = phi
        self.k = k
        self.layer = build_layer(evaluator, build_pad(k, A, shoe, wheel, 128))
        self.contact = self.layer.contact
        if angles is not None:
            self.layer.angles[:] = angles
        self.given = cast(Any, new(Problem))
        self.given.phi = phi
        self.given.normal_force = guess
        for name, value in entries.items():
            self.given[name] = value
        self.problem = self.given.copy()

    @property
    def crest(self) -> float:
        return float(np.abs(self.shoe.g).sum() + np.abs(self.wheel.g).sum())

    def force_at(self, force: float) -> float:
        """F_y where the minimiser puts the shoe under the normal force `force`."""
        p = self.given
        d, e, _ = minimise(p.a_11, p.a_12, p.a_22, p.g_1, p.g_2 + force, self.phi * force, p.belt)
        layer = cast(Any, self.layer.layer).copy()
        evaluate(p.x_0 + p.gain * d, p.y_0 + p.gain * e, layer, *self.layer[1:])  # interpreted, as the step is
        return float(layer.contact.normal_force)

    def run(self, solve: Any = newton, most: int = MOST_EVALUATIONS["newton"]) -> tuple[int, int, int]:
        self.problem = self.given.copy()
        with np.errstate(all="ignore"):  # as compiled code does
            outcome: tuple[int, int, int] = solve(*self.layer, self.problem, most)
        return outcome

    @property
    def force(self) -> float:
        return float(self.problem.normal_force)

    def lipschitz(self) -> float:
        """A bound of |dF_y/dF| on any branch: 2ak and the whole rise of the wheel under the pad."""
        p = self.given
        a = p.a_11 * p.a_22 - p.a_12**2
        d_slope = (abs(p.a_12) + self.phi * p.a_22) / a
        e_slope = max((p.a_11 + self.phi * abs(p.a_12)) / a, 1 / p.a_22)
        steep = min(
            2 * float(np.abs(self.wheel.g).sum()) * 20, 2 * A * float(np.abs(self.wheel.g) @ self.wheel.omega)
        )
        return float(p.gain * self.k * (2 * A * e_slope + steep * d_slope))

    def noise(self) -> float:
        """What rounding of the position and of the phases does to F_y: 2ak times that of the gap.

        The phases are below 2 pi (a + |x|)/lambda + 2 pi: some 100 rad.
        """
        p = self.problem
        y = abs(p.y_0) + abs(p.gain * p.e)
        x = abs(p.x_0) + abs(p.gain * p.d)
        # d and e round with a11 a22 - a12², which loses less than two digits here.
        steep = float(np.abs(self.wheel.g) @ self.wheel.omega)
        return float(2 * A * self.k * EPS * (4 * y + 100 * self.crest + 4 * steep * x) * 4)

    def tolerance(self) -> float:
        """A solved step knows F to 1e-13: as a Newton correction, or as the width of the bracket."""
        force = max(self.force, float(self.contact.normal_force))
        return 2e-13 * (1 + self.lipschitz()) * force + self.noise()


def rough(rng: np.random.Generator, scale: float, most: int = 4) -> Surface:
    n = int(rng.integers(0, most))
    return surface(
        (scale * rng.uniform(0.1, 1, n)).tolist(),
        wavelengths=(10 ** rng.uniform(-2.3, -1, n)).tolist(),
        phases_deg=rng.uniform(0, 360, n).tolist(),
    )


def random_steps(
    seed: int, count: int, stiffness: tuple[float, float], coupling: float = 0.5, evaluator: str | None = None
) -> Iterator[tuple[float, Step]]:
    """Steps with gain 2ak/a22 between the powers of ten given, in and out of contact, and that ratio."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        scale = 10 ** rng.uniform(-9, -3)
        shoe = rough(rng, scale)
        wheel = rough(rng, scale)
        height = float(shoe.g.sum() + wheel.g.sum()) or scale
        k = 10 ** rng.uniform(2, 14)
        a_22 = 10 ** rng.uniform(0, 8)
        a_11 = a_22 * rng.uniform(0.5, 2)
        ratio = 10 ** rng.uniform(*stiffness)
        gain = ratio * a_22 / (2 * A * k)
        push = height / gain  # the velocity that moves the shoe by the roughness's height
        name = evaluator or str(rng.choice(["exact", "midpoint", "auto"]))
        yield (
            ratio,
            Step(
                k=k,
                shoe=shoe,
                wheel=wheel,
                angles=rng.uniform(-6, 0, wheel.g.size),
                evaluator=name if evaluator or shoe.g.size + wheel.g.size else "closed-form",
                phi=float(rng.choice([0.0, 0.3, 1.0, 5.0])),
                a_11=a_11,
                a_22=a_22,
                a_12=coupling * rng.uniform(-1, 1) * math.sqrt(a_11 * a_22),
                gain=gain,
                x_0=rng.uniform(-1e-3, 1e-3),
                y_0=height * rng.uniform(-1.5, 1.0),
                g_1=a_11 * push * rng.normal(),
                g_2=a_22 * push * rng.normal(),
                belt=push * rng.normal() * 10 ** rng.uniform(-2, 1),
            ),
        )


@pytest.mark.parametrize("steps", counts(150, 400))
@pytest.mark.parametrize("evaluator", ["closed-form", "midpoint", "exact", "auto"])
def test_both_iterations_agree_where_both_converge(evaluator: str, steps: int) -> None:
    """The fixed point stops on changes of 1e-13 F; with a contraction below 0.8 it is within four of them."""
    compared = 0
    for _, step in random_steps(31, steps, (-4.0, 0.0), evaluator=evaluator):
        contraction = step.lipschitz()
        if contraction > 0.8:
            continue
        outcome, _, rising = step.run(newton)
        by_newton = step.force
        valid = step.contact.valid
        paper, evaluations, _ = step.run(fixed_point, MOST_EVALUATIONS["fixed-point"])
        assert (outcome, rising, paper) == (SOLVED, 0, SOLVED)
        assert evaluations <= 2 + math.log(1e-16) / math.log(max(contraction, 1e-16)) + 1 or step.noise() > 0
        if evaluator == "closed-form" and not valid:
            continue
        compared += 1
        tolerance = (1e-13 * max(by_newton, step.force) + step.noise()) / (1 - contraction)
        assert step.force == pytest.approx(by_newton, rel=0, abs=2 * tolerance)
    assert compared > 50


@pytest.mark.parametrize("many", counts(300, 1000))
def test_newton_solves_every_step_from_any_guess(many: int) -> None:
    """A solution always exists: F_y >= 0 at F = 0, and as F grows either the shoe slips and is lifted off, or it
    sticks (phi a22 > |a12|) and is lifted off. The residual at the answer is rounding.
    """
    rng = np.random.default_rng(32)
    touching = 0
    for _, step in random_steps(32, many, (-4.0, 4.0), coupling=0.95):
        guess = 0.0 if rng.random() < 0.2 else 2 * A * step.k * step.crest * 10 ** rng.uniform(-3, 1)
        step.given.normal_force = guess
        outcome, evaluations, _ = step.run()
        assert outcome == SOLVED
        assert evaluations < MOST_EVALUATIONS["newton"]
        assert step.force >= 0.0
        residual = step.force_at(step.force) - step.force
        assert abs(residual) <= step.tolerance()
        assert abs(step.problem.residual) <= step.tolerance()
        touching += step.force > 0.0
    assert touching > 0.4 * many


@pytest.mark.parametrize(
    "evaluator", ["midpoint", *(pytest.param(e, marks=campaign) for e in ("closed-form", "auto"))]
)
def test_a_force_that_is_taken_without_evaluating_it_solves_the_step(evaluator: str) -> None:
    """Places of the gap that begin or cease to touch, sides that change and wheels that are steep forbid it."""
    rng = np.random.default_rng(40)
    taken = 0
    evaluated = 0
    for _, step in random_steps(40, 1200, (-4.0, 1.0), evaluator=evaluator):
        if step.run()[0] != SOLVED or step.force == 0.0 or not step.contact.valid:
            continue
        step.contact.reach = step.crest * 10 ** rng.uniform(-5, 0)
        step.given.normal_force = step.force * (1.0 + 10 ** rng.uniform(-7, 0) * rng.choice([-1, 1]))
        outcome, evaluations, _ = step.run()
        assert outcome == SOLVED
        residual = step.force_at(step.force) - step.force
        assert abs(residual) <= step.tolerance()
        assert step.contact.normal_force == pytest.approx(step.force, rel=0, abs=step.tolerance())
        taken += evaluations == 1
        evaluated += evaluations > 1
    assert min(taken, evaluated) > 50


@pytest.mark.parametrize("scheme", ["two-layer", "three-layer"])
def test_every_step_of_a_run_meets_the_tolerance_with_one_evaluation_in_most(scheme: str) -> None:
    """A pad that opens and closes: the contact evaluated again where each step has put the shoe."""
    system = system_of(make(ROUGH, solver__scheme=scheme))
    run = Stepping(system)
    open_steps = 0
    for level in range(int(run.counts.level) + 1, 701):
        run.block(level)
        p = run.plant.problem
        layer = cast(Any, run.plant.layer).copy()
        fill(p.x_0 + p.gain * p.d, p.y_0 + p.gain * p.e, layer, run.contact.tables, run.contact.scratch.copy())
        found = layer.contact
        rounding = 4 * EPS * found.stiffness * (abs(p.y_0) + abs(p.gain * p.e))
        assert (
            abs(found.normal_force - p.normal_force) <= 2e-13 * max(p.normal_force, found.normal_force) + rounding
        )
        open_steps += 0 < found.fraction < 1
    assert open_steps > 100
    samples = 70
    assert run.counts.evaluations - samples < 1.3 * 700  # one to check a guess, and one more: 2 without a proof


@pytest.mark.parametrize(("ratio", "phi"), [(2.0, 0.3), (10.0, 5.0), (300.0, 0.0), (5000.0, 5.0)])
def test_newton_converges_where_the_fixed_point_cannot(ratio: float, phi: float) -> None:
    """A flat pad under a given approach: F = 2ak (depth - gain F/a22)+ with e's own part known, so that
    F = 2ak depth/(1 + ratio). The paper's iteration multiplies an error by -ratio and jumps between two forces.
    """
    k = 1e8
    a_22 = 1e6
    gain = ratio * a_22 / (2 * A * k)
    stiffness = 2 * A * k
    step = Step(k=k, phi=phi, a_11=1e6, a_22=a_22, gain=gain, y_0=-1e-5, evaluator="closed-form", guess=5.0)
    outcome, evaluations, rising = step.run()
    assert (outcome, rising) == (SOLVED, 0)
    assert evaluations <= 3
    assert step.force == pytest.approx(stiffness * 1e-5 / (1 + ratio), rel=1e-12)
    assert abs(step.force_at(step.force) - step.force) <= step.tolerance()
    outcome, evaluations, _ = step.run(fixed_point, MOST_EVALUATIONS["fixed-point"])
    assert (outcome, evaluations) == (UNCONVERGED, MOST_EVALUATIONS["fixed-point"])
    assert abs(step.problem.residual) > 0.1 * step.force  # and the residual tells how far off


@pytest.mark.parametrize("steps", counts(20, 100))  # interpreted, of hundreds of evaluations each
def test_a_fixed_point_that_fails_is_never_taken_for_solved(steps: int) -> None:
    outcomes = []
    for _, step in random_steps(36, steps, (-1.0, 4.0)):
        outcome, evaluations, _ = step.run(fixed_point, MOST_EVALUATIONS["fixed-point"])
        outcomes.append(outcome)
        residual = abs(step.force_at(step.force) - step.force)
        if outcome == SOLVED:
            assert residual <= step.tolerance()
        else:
            assert outcome == UNCONVERGED
            assert evaluations == MOST_EVALUATIONS["fixed-point"]
            assert abs(step.problem.residual) == residual > 0.0
    assert 0.1 * steps < outcomes.count(SOLVED) < 0.9 * steps


@pytest.mark.parametrize("evaluator", ["closed-form", "midpoint", "exact", "auto"])
@pytest.mark.parametrize("guess", [0.0, 1e9])
def test_an_open_contact_carries_nothing(evaluator: str, guess: float) -> None:
    wheel = surface([1e-5], wavelengths=[0.02])
    step = Step(
        k=1e8, wheel=wheel, evaluator=evaluator, a_11=1e6, a_22=1e6, gain=1e-3, y_0=1.1e-5, guess=guess, g_1=3.0
    )
    outcome, evaluations, rising = step.run()
    assert (outcome, rising, step.force, step.contact.normal_force) == (SOLVED, 0, 0.0, 0.0)
    assert evaluations <= 60
    assert step.problem.d == 3.0 / 1e6


# --- a wedge: the friction force presses the shoe on -----------------------------------------------------------


def wedge(guess: float, y_0: float) -> Step:
    """A flat pad on which more force means more depth while the shoe slips forwards: phi |a12| > a11, as in
    Painleve's paradox. With F it sinks, y = y0 + 1.42e-4 - 1.26e-5 F, until it sticks: from 9.1 N, which is
    g1 a22/(phi a22 - |a12|), on; then y = y0 + 3e-6 F.
    """
    return Step(
        k=1e8,
        phi=2.0,
        a_11=1e6,
        a_12=-0.9e6,
        a_22=1e6,
        gain=3.0,
        y_0=y_0,
        g_1=10.0,
        evaluator="closed-form",
        guess=guess,
    )


@pytest.mark.parametrize("guess", [0.0, 9.0, 9.2, 1e9])
def test_a_wedge_is_told_and_does_not_hang(guess: float) -> None:
    step = wedge(guess, y_0=-1.5e-4)  # touching at F = 0 already: only stick holds
    p = step.given
    a = p.a_11 * p.a_22 - p.a_12**2
    assert p.gain * 2 * A * step.k * (step.phi * abs(p.a_12) - p.a_11) / a > 1.0
    outcome, evaluations, rising = step.run()
    assert outcome == SOLVED
    assert evaluations <= 60
    assert step.problem.side == 0.0
    assert step.force == pytest.approx(1e7 * 1.5e-4 / (1 + 1e7 * 3e-6), rel=1e-12)
    if guess < 9.0909:
        assert rising > 0


def test_the_reported_slope_is_the_residual_s_derivative() -> None:
    """Newton's slope from d_slope, e_slope and the contact's derivatives, against differences along F."""
    compared = 0
    for _, step in random_steps(39, 200, (-2.0, 1.0), evaluator="exact"):
        if step.run()[0] != SOLVED or step.force == 0.0:
            continue
        p = step.problem
        c = step.contact
        slope = p.gain * (c.tangential * p.d_slope - c.stiffness * p.e_slope)
        eta = 1e-5 * step.force
        sides = [step.force_at(step.force + s * eta) for s in (-1.0, 0.0, 1.0)]
        backward = (sides[1] - sides[0]) / eta
        forward = (sides[2] - sides[1]) / eta
        # Where the two one-sided quotients agree there is no kink nearby, and they bound the derivative.
        spread = abs(forward - backward)
        if spread > 1e-3 * abs(slope):
            continue
        compared += 1
        assert 0.5 * (forward + backward) == pytest.approx(slope, rel=0, abs=spread + step.noise() / eta)
    assert compared > 50


def test_pads_count_their_waves() -> None:
    assert build_pad(1.0, A, surface([1e-6], wavelengths=[0.1]), FLAT, 0).constants.shoe_terms == 1
