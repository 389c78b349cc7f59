"""One implicit step: find the normal force F with F = F_y(x(F), y(F)), where (x, y)(F) is the minimiser's answer.

`newton` solves this scalar equation inside a bracket and cannot run away; `fixed-point` is the paper's iteration,
(13) and (24), which contracts by about gain * 2ak/a22 and diverges where that exceeds one.
"""

import math

import numpy as np
from numba import float64, int64, types
from numpy.typing import NDArray

from brakecli.solver.compile import (
    A_11,
    A_12,
    A_22,
    BELT,
    D_SLOPE,
    E_SLOPE,
    EVALUATE,
    F_Y,
    G_1,
    G_2,
    GAIN,
    NORMAL_FORCE,
    RESIDUAL,
    SIDE,
    STIFFNESS,
    TANGENTIAL,
    X_0,
    Y_0,
    D,
    E,
    borrowed,
    kernel,
    vector,
)
from brakecli.solver.friction import minimise, slopes

NEWTON, FIXED_POINT = 0, 1
SOLVED, UNCONVERGED = 0, 1
MOST = {"newton": 100, "fixed-point": 500}
"""Evaluations of the contact that a step may take before it counts as not converged."""

_RELATIVE = 1e-13
"""Relative change of F below which a step is solved: a few hundred roundings, so that both iterations agree to
rounding; the gap's own rounding, times the contact's stiffness, is added to it."""

SOLVE = types.UniTuple(int64, 3)(types.FunctionType(EVALUATE), int64, float64, vector, vector, vector, vector)


@kernel(types.UniTuple(float64, 2)(types.FunctionType(EVALUATE), float64, float64, vector, vector, vector, vector))
def _try_force(
    evaluate: object,
    phi: float,
    f: float,
    angles: NDArray[np.float64],
    pad: NDArray[np.float64],
    problem: NDArray[np.float64],
    contact: NDArray[np.float64],
) -> tuple[float, float]:
    """Minimise for the normal force f, evaluate the contact there; the residual and the rounding in it (N)."""
    angles, pad, problem, contact = borrowed(angles), borrowed(pad), borrowed(problem), borrowed(contact)
    a_11, a_12, a_22 = problem[A_11], problem[A_12], problem[A_22]
    d, e, side = minimise(a_11, a_12, a_22, problem[G_1], problem[G_2] + f, phi * f, problem[BELT])
    problem[D], problem[E], problem[SIDE], problem[F_Y] = d, e, side, f
    problem[D_SLOPE], problem[E_SLOPE] = slopes(a_11, a_12, a_22, phi, side)
    y = problem[Y_0] + problem[GAIN] * e
    evaluate(problem[X_0] + problem[GAIN] * d, y, angles, pad, contact)  # type: ignore[operator]
    problem[RESIDUAL] = contact[NORMAL_FORCE] - f
    rounding = 4e-16 * contact[STIFFNESS] * (abs(problem[Y_0]) + abs(problem[GAIN] * e))
    return problem[RESIDUAL], rounding


@kernel(SOLVE)
def newton(
    evaluate: object,
    evaluations_allowed: int,
    phi: float,
    angles: NDArray[np.float64],
    pad: NDArray[np.float64],
    problem: NDArray[np.float64],
    contact: NDArray[np.float64],
) -> tuple[int, int, int]:
    """Bracketed Newton iteration from the guess problem[F_Y] >= 0; (outcome, evaluations, rising points).

    A rising point is one where the residual does not fall with F (r' >= 0): the step's solution need not be
    unique there, as in Painleve's paradox. There is always one: where F = 0 the residual is not negative, and for
    a large F, since a11 a22 > a12², the shoe either sticks and lifts off or slips and lifts off.
    """
    angles, pad, problem, contact = borrowed(angles), borrowed(pad), borrowed(problem), borrowed(contact)
    low, high = 0.0, math.inf
    f = problem[F_Y]
    rising = 0
    before_last = last = math.inf  # lengths of steps
    for evaluation in range(1, evaluations_allowed + 1):
        r, rounding = _try_force(evaluate, phi, f, angles, pad, problem, contact)
        gain = problem[GAIN]
        if gain == 0.0:  # explicit: the contact does not depend on this step's unknowns
            f = contact[NORMAL_FORCE]
            d, e, side = minimise(
                problem[A_11], problem[A_12], problem[A_22], problem[G_1], problem[G_2] + f, phi * f, problem[BELT]
            )
            problem[D], problem[E], problem[SIDE], problem[F_Y], problem[RESIDUAL] = d, e, side, f, 0.0
            return SOLVED, evaluation, 0
        slope = gain * (contact[TANGENTIAL] * problem[D_SLOPE] - contact[STIFFNESS] * problem[E_SLOPE]) - 1.0
        if slope >= 0.0:
            rising += 1
        if r == 0.0 or abs(r) <= abs(slope) * _RELATIVE * max(f, contact[NORMAL_FORCE]) + rounding:
            return SOLVED, evaluation, rising
        if r > 0.0:
            low = f
        else:
            high = f
        if high < math.inf and high - low <= _RELATIVE * high:
            return SOLVED, evaluation, rising
        new = f - r / slope if slope < 0.0 else math.inf
        # Outside the bracket, or a step not half of that before the last: halve the bracket, or open it upwards.
        # The bracket's own width tells nothing: Newton's iteration may come from one side and leave the other.
        if not (low <= new <= high) or new == math.inf or abs(new - f) > 0.5 * before_last:
            new = 0.5 * (low + high) if high < math.inf else 10.0 * max(low, contact[NORMAL_FORCE])
        before_last, last = last, abs(new - f)
        f = new
    return UNCONVERGED, evaluations_allowed, rising


@kernel(SOLVE)
def fixed_point(
    evaluate: object,
    evaluations_allowed: int,
    phi: float,
    angles: NDArray[np.float64],
    pad: NDArray[np.float64],
    problem: NDArray[np.float64],
    contact: NDArray[np.float64],
) -> tuple[int, int, int]:
    """The paper's iteration, (13) and (24), from d(0) = dⁿ, e(0) = eⁿ; (outcome, evaluations, 0)."""
    gain = problem[GAIN]
    evaluate(problem[X_0] + gain * problem[D], problem[Y_0] + gain * problem[E], angles, pad, contact)  # type: ignore[operator]
    f = contact[NORMAL_FORCE]
    for evaluation in range(2, evaluations_allowed + 1):
        r, rounding = _try_force(evaluate, phi, f, angles, pad, problem, contact)
        if abs(r) <= _RELATIVE * max(f, contact[NORMAL_FORCE]) + rounding:
            return SOLVED, evaluation, 0
        f = contact[NORMAL_FORCE]
        if not f < 1e200:
            return UNCONVERGED, evaluation, 0
    return UNCONVERGED, evaluations_allowed, 0
