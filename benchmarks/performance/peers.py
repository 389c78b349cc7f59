"""General solvers on the same problem, each as its authors would use it; each is imported where it is used.

All have the same compiled right-hand side, tables and nodes included. Absolute tolerances go with the size of the
motion. Where the shoe sticks, SciPy locates the events, and the others take tanh for the sign of the sliding
speed: they have nothing for a motion that changes its equations several times in a call.
"""

from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from numba import carray, cfunc, njit

from benchmarks.performance.matching import Entry, Floats, Ladder, timed
from benchmarks.performance.problem import Problem

TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 23))
WIDTHS = (1e-3, 1e-4, 1e-5, 1e-6)
"""m/s, of tanh where the shoe sticks."""
NODES = (64, 256, 1024)
MOST_STEPS = 1_000_000

MOST_PARTS = 500
"""Events of a motion that SciPy computes, beyond which it does not get on."""


def found(package: str) -> bool:
    return find_spec(package) is not None


def variants(problem: Problem, sticks: bool, least: float = 0.0) -> Iterator[tuple[str, int, float]]:
    """What a right-hand side may have beside tolerances: nodes, and the width of tanh, 0 for the sign."""
    widths = [width for width in WIDTHS if width >= least] if sticks else [0.0]
    for nodes in (0,) if problem.system.smooth else NODES:
        for width in widths:
            words = [f"{nodes} nodes"] * (nodes > 0) + [f"tanh over {width:g} m/s"] * (width > 0.0)
            yield "".join(f", {word}" for word in words), nodes, width


def ladder(
    who: str, method: str, words: str, nodes: int, call: Callable[[float], Any], rows: Callable[[Any], Floats]
) -> Ladder:
    """Entries over tolerances; `call(tolerance)` is what is timed."""
    for tolerance in TOLERANCES:
        settings = {"tolerance": tolerance, "nodes": nodes, "method": method}
        label = f"{method}, {tolerance:.1g}{words}".removeprefix(f"{who.split()[-1]}, ")
        yield Entry(who, label, timed(partial(call, tolerance), rows), settings)


def scales(reference: Floats) -> Floats:
    return np.abs(reference).max(axis=0)


def into(rhs: Any, phi: float) -> Any:
    """f(t, u, du), compiled, at one friction coefficient."""

    @njit
    def right(t: float, u: Any, du: Any) -> None:
        rhs(t, u, du, phi)

    return right


def returning(rhs: Any) -> Any:
    """f(t, u, phi), compiled, which returns what `rhs` fills in."""

    @njit
    def right(t: float, u: Any, phi: float) -> Any:
        du = np.empty(4)
        rhs(t, u, du, phi)
        return du

    return right


def at_pointers(problem: Problem, nodes: int, width: float) -> Any:
    """The right-hand side as C sees it; `data` begins with the friction coefficient."""
    from numbalsoda import lsoda_sig

    rhs = problem.right_hand_side(nodes, width)

    @cfunc(lsoda_sig)
    def right(t: float, u: Any, du: Any, data: Any) -> None:
        rhs(t, carray(u, (4,)), carray(du, (4,)), carray(data, (1,))[0])

    return right


def numbalsoda(problem: Problem, sticks: bool, reference: Floats) -> Iterator[Ladder]:
    """LSODA, and DOP853 where friction is no stiff tanh; both are called from compiled code."""
    from numbalsoda import dop853, lsoda

    size = scales(reference)[:2].min()
    data = np.array([problem.phi])

    def call(solve: Any, function: Any, tolerance: float) -> Any:
        absolute = tolerance * size
        return solve(function.address, problem.start, problem.times, data, tolerance, absolute, MOST_STEPS)

    for words, nodes, width in variants(problem, sticks):
        function = at_pointers(problem, nodes, width)
        for name, solve in {"LSODA": lsoda, "DOP853": dop853}.items():
            if name == "LSODA" or not width:
                solved = partial(call, solve, function)
                yield ladder(f"numbalsoda {name}", name, words, nodes, solved, lambda found: found[0])


def scikit_sundae(problem: Problem, sticks: bool, reference: Floats) -> Iterator[Ladder]:
    """CVODE of SUNDIALS, with Adams' formulas, and with BDF for tanh; it calls the right-hand side from Cython."""
    from sksundae.cvode import CVODE

    size = scales(reference)

    def call(right: Any, method: str, tolerance: float) -> Any:
        options = {"rtol": tolerance, "atol": tolerance * size, "max_num_steps": MOST_STEPS}
        return CVODE(right, method=method, **options).solve(problem.times, problem.start)

    for words, nodes, width in variants(problem, sticks):
        right = into(problem.right_hand_side(nodes, width), problem.phi)
        for method in ("Adams", "BDF") if width else ("Adams",):
            name = f"CVODE {method}"
            solved = partial(call, right, method)
            yield ladder("scikit-sundae", name, words, nodes, solved, lambda found: np.asarray(found.y))


def diffrax_vector(problem: Problem, nodes: int, width: float) -> Callable[[Any, Any, Any], Any]:
    """The right-hand side for JAX: f(t, u, phi)."""
    import jax.numpy as jnp

    m, b_xx, b_xy, b_yy, c_xx, c_xy, c_yy, sin_beta, cos_beta, _ = problem.c
    belt = problem.belt
    load_x = problem.load * sin_beta
    load_y = problem.load * cos_beta
    stiffness = problem.stiffness
    tables = [jnp.asarray(table) for table in problem.tables(nodes)] if nodes else []

    def force(x: Any, y: Any, t: Any) -> Any:
        if not tables:
            return jnp.maximum(-stiffness * y, 0.0)
        omega, f1, sines, cosines = tables
        angle = omega * (x - belt * t)
        gap = jnp.cos(angle) @ sines + jnp.sin(angle) @ cosines - f1 - y
        return jnp.maximum(gap, 0.0).sum() * (stiffness / nodes)

    def rhs(t: Any, u: Any, phi: Any) -> Any:
        x, y, v_x, v_y = u
        normal = force(x, y, t)
        sliding = v_x - belt
        side = jnp.tanh(sliding / width) if width > 0.0 else jnp.sign(sliding)
        a_x = (-phi * normal * side - b_xx * v_x - b_xy * v_y - c_xx * x - c_xy * y - load_x) / m
        a_y = (normal - b_yy * v_y - b_xy * v_x - c_yy * y - c_xy * x - load_y) / m
        return jnp.stack([v_x, v_y, a_x, a_y])

    return rhs


def diffrax_solver(problem: Problem, nodes: int, width: float, size: Floats) -> Any:
    """solve(phi, tolerance), compiled: Tsit5, or Kvaerno5 for tanh; steps by a PI controller, samples between."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    term = diffrax.ODETerm(diffrax_vector(problem, nodes, width))
    scale = jnp.asarray(size)

    def solve(phi: Any, tolerance: Any) -> Any:
        return diffrax.diffeqsolve(
            term,
            diffrax.Kvaerno5() if width else diffrax.Tsit5(),
            t0=0.0,
            t1=problem.times[-1],
            dt0=None,
            y0=jnp.asarray(problem.start),
            args=phi,
            saveat=diffrax.SaveAt(ts=jnp.asarray(problem.times)),
            stepsize_controller=diffrax.PIDController(
                rtol=tolerance, atol=tolerance * scale, pcoeff=0.3, icoeff=0.4
            ),
            max_steps=None,
            adjoint=diffrax.ForwardMode(),
            throw=False,
        ).ys

    return jax.jit(solve)


def diffrax(problem: Problem, sticks: bool, reference: Floats) -> Iterator[Ladder]:
    """In JAX. Each variant is compiled for seconds: of tanh only those that gain something."""

    def call(solve: Any, tolerance: float) -> Any:
        return solve(problem.phi, tolerance).block_until_ready()

    for words, nodes, width in variants(problem, sticks, 1e-5):
        if sticks and (width > 1e-4 or nodes > 256):
            continue
        solve = diffrax_solver(problem, nodes, width, scales(reference))
        name = "Kvaerno5" if width else "Tsit5"
        yield ladder("diffrax", name, words, nodes, partial(call, solve), np.asarray)


def scipy(problem: Problem, sticks: bool, reference: Floats) -> Iterator[Ladder]:
    """solve_ivp; where the shoe sticks, DOP853 from event to event."""
    from scipy.integrate import solve_ivp

    size = scales(reference)
    span = (0.0, problem.times[-1])

    def call(right: Any, method: str, tolerance: float) -> Any:
        options = {"method": method, "rtol": tolerance, "atol": tolerance * size}
        if sticks:
            return right.solve(options)
        return solve_ivp(right, span, problem.start, t_eval=problem.times, args=(problem.phi,), **options).y.T

    for words, nodes, _ in variants(problem, False):
        right = StickSlip(problem, nodes) if sticks else returning(problem.right_hand_side(nodes))
        for method in ("DOP853",) if sticks else ("DOP853", "LSODA", "RK45"):
            yield ladder("SciPy", method, words, nodes, partial(call, right, method), np.asarray)


class StickSlip:
    """The motion by SciPy from one change between stick and slip to the next; all that it calls is compiled."""

    def __init__(self, problem: Problem, nodes: int) -> None:
        force = problem.force(nodes)
        m, b_xx, b_xy, b_yy, c_xx, c_xy, c_yy, sin_beta, cos_beta, phi = problem.c
        load_x = problem.load * sin_beta
        load_y = problem.load * cos_beta
        belt = problem.belt
        self.problem = problem

        @njit
        def rates(t: float, u: Any, side: float) -> Any:
            x, y, v_x, v_y = u
            normal = force(x, y, t)
            a_x = (-phi * normal * side - b_xx * v_x - b_xy * v_y - c_xx * x - c_xy * y - load_x) / m
            a_y = (normal - b_yy * v_y - b_xy * v_x - c_yy * y - c_xy * x - load_y) / m
            return np.array([v_x, v_y, a_x if side != 0.0 else 0.0, a_y])

        @njit
        def needed(u: Any) -> float:
            return b_xx * u[2] + b_xy * u[3] + c_xx * u[0] + c_xy * u[1] + load_x

        @njit
        def margin(t: float, u: Any, side: float) -> float:
            """The sliding speed in slip; in stick, how far the force needed is within the friction cone."""
            return (u[2] - belt) * side if side != 0.0 else phi * force(u[0], u[1], t) - abs(needed(u))

        self.rates = rates
        self.margin = margin
        self.needed = needed

    def solve(self, options: dict[str, Any]) -> Floats:
        from scipy.integrate import solve_ivp

        def ends(t: float, u: Any, side: float) -> float:
            return self.margin(t, u, side)  # type: ignore[no-any-return]

        ends.terminal = True  # type: ignore[attr-defined]
        ends.direction = -1.0  # type: ignore[attr-defined]
        times = self.problem.times
        belt = self.problem.belt
        parts = list[Floats]()
        t = 0.0
        u = self.problem.start
        side = -float(np.sign(belt))
        while len(parts) < MOST_PARTS:
            due = times[np.searchsorted(times, t, "right" if parts else "left") :]
            part = solve_ivp(self.rates, (t, times[-1]), u, t_eval=due, events=ends, args=(side,), **options)
            parts.append(np.reshape(part.y, (4, -1)).T)  # a list where no sample is due
            if not part.t_events[0].size:
                return np.concatenate(parts)
            t = float(part.t_events[0][0])
            u = part.y_events[0][0].copy()
            if side:
                u[2] = belt
            sticks = side != 0.0 and self.margin(t, u, 0.0) > 0.0
            side = 0.0 if sticks else -float(np.sign(self.needed(u)))
        return np.empty((0, 4))  # it meets the same event again and again


PEERS: dict[str, Callable[[Problem, bool, Floats], Iterator[Ladder]]] = {
    "numbalsoda": numbalsoda,
    "diffrax": diffrax,
    "sksundae": scikit_sundae,
    "scipy": scipy,
}
"""By the name under which each is imported."""
