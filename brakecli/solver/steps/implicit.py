"""One implicit step: find the normal force F with F = F_y(x(F), y(F)), where (x, y)(F) is the minimiser's answer.

`newton` solves this scalar equation inside a bracket and cannot run away. Most steps take one evaluation: where it
proves the contact to be linear up to Newton's next force, that force is known to solve the step. `fixed-point` is
the paper's iteration, (13) and (24), which contracts by about gain * 2ak/a22 and diverges where that exceeds one.
"""

import math

from brakecli.solver.arrays import Floats
from brakecli.solver.contact.force import evaluate
from brakecli.solver.friction import minimise, slopes
from brakecli.solver.kernels import kernel
from brakecli.solver.method import MOST_EVALUATIONS
from brakecli.solver.records import Layer, Problem

SOLVED, UNCONVERGED = range(2)
_RELATIVE = 1e-13
"""Relative change of F below which a step is solved: a few hundred roundings, so that both iterations agree to
rounding; the gap's own rounding, times the contact's stiffness, is added to it."""

_FIXED_POINT = list(MOST_EVALUATIONS).index("fixed-point")


@kernel(inline=False)
def _touch(x: float, y: float, layer: Layer, tables: Floats, scratch: Floats) -> None:
    """Evaluate the contact: compiled once for both iterations."""
    evaluate(x, y, layer, tables, scratch)


@kernel
def _try_force(layer: Layer, tables: Floats, scratch: Floats, problem: Problem, f: float) -> tuple[float, float]:
    """Minimise for the normal force f, evaluate the contact there; the residual and the rounding in it (N).

    The residual is r(f) = F_y(x_0 + gain d, y_0 + gain e) - f.
    """
    a_11 = problem.a_11
    a_12 = problem.a_12
    a_22 = problem.a_22
    phi = problem.phi
    d, e, side = minimise(a_11, a_12, a_22, problem.g_1, problem.g_2 + f, phi * f, problem.belt)
    problem.d = d
    problem.e = e
    problem.side = side
    problem.normal_force = f
    problem.d_slope, problem.e_slope = slopes(a_11, a_12, a_22, phi, side)
    y = problem.y_0 + problem.gain * e
    _touch(problem.x_0 + problem.gain * d, y, layer, tables, scratch)
    problem.residual = layer.contact.normal_force - f
    rounding = (
        4e-16 * layer.contact.stiffness * (abs(problem.y_0) + abs(problem.gain * e))
    )  # of a height: twice that of a sum
    return problem.residual, rounding


@kernel
def _take_unevaluated(layer: Layer, problem: Problem, f: float, allowed: float) -> bool:
    """Take the force f if the last evaluation proves that its residual is at most `allowed` (N); whether it does.

    Up to f the contact is linear, F_y + ∂F_y/∂x Δx + ∂F_y/∂y Δy, but for places that begin or cease to touch, for
    the curvature of f2 and for the error of its slope. `contact` becomes that of f.
    """
    pad = layer.pad
    contact = layer.contact
    gain = problem.gain
    a_11 = problem.a_11
    a_12 = problem.a_12
    a_22 = problem.a_22
    phi = problem.phi
    d, e, side = minimise(a_11, a_12, a_22, problem.g_1, problem.g_2 + f, phi * f, problem.belt)
    x = gain * (d - problem.d)
    y = gain * (e - problem.e)
    along = abs(x)
    near = contact.near
    reach = contact.reach
    move = abs(y) + pad.steep * along
    contact.reach = max(2.0 * move, 0.5 * reach)  # of the next evaluation, which may move the gap twice as far
    if side != problem.side or move > reach:
        return False
    normal_force = contact.normal_force + contact.tangential * x - contact.stiffness * y
    lost = near * move + (contact.blur + 0.5 * pad.curved * contact.stiffness * along) * along
    if not abs(normal_force - f) + lost <= allowed:
        return False
    problem.d = d
    problem.e = e
    problem.normal_force = f
    problem.residual = normal_force - f
    contact.normal_force = normal_force
    contact.store_x -= contact.tangential * y
    return True


@kernel
def newton(layer: Layer, tables: Floats, scratch: Floats, problem: Problem, most: int) -> tuple[int, int, int]:
    """Bracketed Newton iteration from the guess problem.normal_force >= 0; (outcome, evaluations, rising points).

    F becomes F - r/r' with r' = gain (∂F_y/∂x d' + ∂F_y/∂y e') - 1. A rising point is one where the residual does
    not fall with F (r' >= 0): the step's solution need not be unique there, as in Painleve's paradox. There is
    always one: where F = 0 the residual is not negative, and for a large F, since a11 a22 > a12², the shoe either
    sticks and lifts off or slips and lifts off.
    """
    contact = layer.contact
    low = 0.0
    high = math.inf
    f = problem.normal_force
    rising = 0
    before_last = last = math.inf  # lengths of steps
    for evaluation in range(1, most + 1):
        r, rounding = _try_force(layer, tables, scratch, problem, f)
        gain = problem.gain
        if gain == 0.0:  # explicit: the contact does not depend on this step's unknowns
            f = contact.normal_force
            a_11 = problem.a_11
            a_12 = problem.a_12
            a_22 = problem.a_22
            d, e, side = minimise(a_11, a_12, a_22, problem.g_1, problem.g_2 + f, problem.phi * f, problem.belt)
            problem.d = d
            problem.e = e
            problem.side = side
            problem.normal_force = f
            problem.residual = 0.0
            return SOLVED, evaluation, 0
        slope = gain * (contact.tangential * problem.d_slope - contact.stiffness * problem.e_slope) - 1.0
        if slope >= 0.0:
            rising += 1
        if r == 0.0 or abs(r) <= abs(slope) * _RELATIVE * max(f, contact.normal_force) + rounding:
            return SOLVED, evaluation, rising
        if r > 0.0:
            low = f
        else:
            high = f
        if high < math.inf and high - low <= _RELATIVE * high:
            return SOLVED, evaluation, rising
        new = f - r / slope if slope < 0.0 else math.inf
        # Outside the bracket, or a step not half of that before the last: halve the bracket, or open it upwards.
        # The bracket's own width says nothing: Newton's iteration may come from one side and leave the other.
        if not (low <= new <= high) or new == math.inf or abs(new - f) > 0.5 * before_last:
            new = 0.5 * (low + high) if high < math.inf else 10.0 * max(low, contact.normal_force)  # a choice
        allowed = abs(slope) * _RELATIVE * max(new, contact.normal_force) + rounding
        if _take_unevaluated(layer, problem, new, allowed):
            return SOLVED, evaluation, rising
        before_last = last
        last = abs(new - f)
        f = new
    return UNCONVERGED, most, rising


@kernel
def fixed_point(
    layer: Layer, tables: Floats, scratch: Floats, problem: Problem, most: int
) -> tuple[int, int, int]:
    """The paper's iteration, (13) and (24), from d(0) = dⁿ, e(0) = eⁿ; (outcome, evaluations, 0)."""
    contact = layer.contact
    gain = problem.gain
    _touch(problem.x_0 + gain * problem.d, problem.y_0 + gain * problem.e, layer, tables, scratch)
    f = contact.normal_force
    for evaluation in range(2, most + 1):
        r, rounding = _try_force(layer, tables, scratch, problem, f)  # Eq. (13), Eq. (24)
        if abs(r) <= _RELATIVE * max(f, contact.normal_force) + rounding:
            return SOLVED, evaluation, 0
        f = contact.normal_force
        if not f < 1e200:  # its square is no number
            return UNCONVERGED, evaluation, 0
    return UNCONVERGED, most, 0


@kernel
def solve(
    layer: Layer, tables: Floats, scratch: Floats, problem: Problem, most: int, iteration: int
) -> tuple[int, int, int]:
    """One step by an iteration of `method.MOST_EVALUATIONS`; (outcome, evaluations, rising points)."""
    if iteration == _FIXED_POINT:
        return fixed_point(layer, tables, scratch, problem, most)
    return newton(layer, tables, scratch, problem, most)
