"""heyoka.py: Taylor series, compiled, with terminal events; for smooth surfaces, as it knows no pad."""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.performance.matching import Entry, Floats, Ladder, timed
from benchmarks.performance.problem import Problem

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-11, 1e-13)
PUSH = 1e-11  # m/s, away from the wheel's speed, or the end of stick would be found again as its beginning
COOLDOWN = 1e-7  # s


def equations(problem: Problem, normal: Any, friction: Any) -> tuple[list[Any], list[tuple[Any, Any]], Any]:
    """(6)-(7) with these forces: the variables, their rates, and the friction force that stick takes."""
    import heyoka as hy

    m, b_xx, b_xy, b_yy, c_xx, c_xy, c_yy, sin_beta, cos_beta, _ = problem.c
    u = x, y, v_x, v_y = list(hy.make_vars("x", "y", "vx", "vy"))
    needed = b_xx * v_x + b_xy * v_y + c_xx * x + c_xy * y + problem.load * sin_beta
    a_y = (normal(y) - b_yy * v_y - b_xy * v_x - c_yy * y - c_xy * x - problem.load * cos_beta) / m
    a_x = (friction(normal(y)) - needed) / m if friction else hy.expression(0.0)
    return u, [(x, v_x), (y, v_y), (v_x, a_x), (v_y, a_y)], needed


def bouncing(problem: Problem, tolerance: float) -> Callable[[], Floats]:
    """A motion that always slips backward, and may leave the wheel: an event for each change of contact."""
    import heyoka as hy

    touches = hy.par[0]
    phi = problem.phi
    u, rates, _ = equations(problem, lambda y: -problem.stiffness * touches * y, lambda normal: phi * normal)

    def switch(motion: Any, direction: int) -> bool:
        motion.pars[0] = 0.0 if direction > 0 else 1.0
        return True

    # The start has y = ẏ = 0, where no time can be deduced in which the event must not be found again
    event = hy.t_event(u[1], callback=switch, cooldown=COOLDOWN)
    start = problem.start + np.array([0.0, -PUSH * COOLDOWN, 0.0, 0.0])
    motion = hy.taylor_adaptive(rates, problem.start, tol=tolerance, t_events=[event], pars=[1.0])

    def solve() -> Floats:
        motion.time = 0.0
        motion.state[:] = start
        motion.pars[0] = 1.0
        motion.reset_cooldowns()
        return motion.propagate_grid(problem.times)[-1]  # type: ignore[no-any-return]

    return solve


def stick_slip(problem: Problem, tolerance: float) -> Callable[[], Floats]:
    """A motion that never leaves the wheel: an integrator for slip and one for stick, each up to its event."""
    import heyoka as hy

    def normal(y: Any) -> Any:
        return -problem.stiffness * y

    phi = problem.phi
    belt = problem.belt
    end = problem.times[-1]
    u, rates, _ = equations(problem, normal, lambda force: phi * force)
    slip = hy.taylor_adaptive(rates, problem.start, tol=tolerance, t_events=[hy.t_event(u[2] - belt)])
    u, rates, needed = equations(problem, normal, None)
    breaks = hy.t_event(needed - phi * normal(u[1]))
    stick = hy.taylor_adaptive(rates, problem.start, tol=tolerance, t_events=[breaks])
    event = -1  # heyoka's outcome of its first terminal event

    def solve() -> Floats:
        rows = np.empty((len(problem.times), 4))
        motion = slip
        motion.time = 0.0
        motion.state[:] = problem.start
        row = 0
        slip.reset_cooldowns()
        while row < len(rows):
            due = problem.times[row]
            outcome = 0
            if due > motion.time:
                outcome = int(motion.propagate_until(due)[0].value)
            if outcome == event:
                other = stick if motion is slip else slip
                other.time = motion.time
                other.state[:] = motion.state
                other.state[2] = belt if other is stick else belt - PUSH
                other.reset_cooldowns()
                motion = other
            else:
                rows[row] = motion.state
                row += 1
        assert motion.time == end
        return rows

    return solve


def heyoka(problem: Problem, of: Callable[[Problem, float], Callable[[], Floats]]) -> list[Ladder]:
    def entry(tolerance: float) -> Entry:
        return Entry("heyoka.py", f"{tolerance:.0e}", timed(of(problem, tolerance), np.asarray))

    return [map(entry, TOLERANCES)]
