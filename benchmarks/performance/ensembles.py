"""Many cases at once: case B over friction, as many cases a second as each program computes on all cores."""

import math
import multiprocessing
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, prange, set_num_threads

from benchmarks.performance import peers
from benchmarks.performance.matching import Entry, Floats
from benchmarks.performance.problem import Problem
from brakecli.api.inputs import load_sweep
from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.studies.sweeps.driver import choose_engine, sweep
from brakecli.studies.sweeps.plan import LoadedSweep
from brakecli.studies.sweeps.point import compute

CASES = Path(__file__).parents[2] / "cases"
B = CASES / "accuracy" / "B.toml"
DURATION = 0.2
INTERVAL = 2.5e-4
# friction
LEAST = 0.2
MOST = 0.4
SECONDS = 2.0  # that a measurement should take


@dataclass
class Rate:
    """Cases a second on all cores, and for each second of processor time, which other work does not change."""

    who: str
    what: str
    per_second: float
    per_cpu_second: float


def frictions(count: int) -> Floats:
    return np.linspace(LEAST, MOST, count)


def rate(solve: Callable[[Floats], float | None], count: int = 2) -> tuple[float, float]:
    """Cases a second, and for each second of the processor, which `solve` may return."""
    solve(frictions(count))  # compiles
    while True:
        begin = time.perf_counter()
        cpu = time.process_time()
        spent = solve(frictions(count))
        seconds = time.perf_counter() - begin
        used = time.process_time() - cpu
        if seconds > 0.3 * SECONDS:
            return count / seconds, count / (spent or used)
        count *= max(2, math.ceil(SECONDS / max(seconds, 1e-3)))


def numbalsoda(problem: Problem, entry: Entry, size: Floats) -> Rate:
    """Threads over cases, each with the samples of its motion."""
    from numbalsoda import dop853, lsoda

    name = entry.settings["method"]
    tolerance = entry.settings["tolerance"]
    solver = lsoda if name == "LSODA" else dop853
    function = peers.at_pointers(problem, entry.settings["nodes"], 0.0)
    address = function.address
    start = problem.start
    times = problem.times
    absolute = tolerance * size[:2].min()

    @njit(parallel=True)
    def threads(phis):  # type: ignore[no-untyped-def]
        amplitudes = np.empty(phis.size)
        for i in prange(phis.size):
            rows, _ = solver(address, start, times, np.array([phis[i]]), tolerance, absolute, 1_000_000)
            amplitudes[i] = rows[:, 0].max()
        return amplitudes

    def solve(phis: Floats) -> None:
        threads(phis)

    set_num_threads(os.cpu_count() or 1)
    return Rate(entry.who, f"prange, {entry.label}", *rate(solve))


def diffrax(problem: Problem, entry: Entry, size: Floats) -> Rate:
    import jax

    tolerance = entry.settings["tolerance"]
    solve = peers.diffrax_solver(problem, entry.settings["nodes"], 0.0, size)
    many = jax.jit(jax.vmap(lambda phi: solve(phi, tolerance)[:, 0].max()))

    def wide(phis: Floats) -> None:
        """64 cases at a time: a wider batch waits longer for its slowest case, and leaves the cache."""
        for first in range(0, len(phis), 64):
            many(np.resize(phis[first:], 64)).block_until_ready()

    return Rate(entry.who, f"vmap over 64, {entry.label}", *rate(wide, 64))


_task: list[Any] = []  # of a process of the pool: the compiled right-hand side, times and options


def _prepare(duration: float, nodes: int, options: dict[str, Any]) -> None:
    problem = b_problem(duration)
    right = peers.returning(problem.right_hand_side(nodes))
    right(0.0, problem.start, 0.3)
    _task[:] = [right, problem, options]


def _solve(phi: float) -> float:
    """Seconds of the processor that a case takes."""
    from scipy.integrate import solve_ivp

    right, problem, options = _task
    span = (0.0, problem.times[-1])
    begin = time.process_time()
    solve_ivp(right, span, problem.start, t_eval=problem.times, args=(phi,), **options)
    return time.process_time() - begin


def scipy(problem: Problem, entry: Entry, size: Floats) -> Rate:
    tolerance = entry.settings["tolerance"]
    cores = os.cpu_count() or 1
    options = {"method": entry.settings["method"], "rtol": tolerance, "atol": tolerance * size}
    arguments = (problem.system.duration, entry.settings["nodes"], options)
    with multiprocessing.get_context("spawn").Pool(cores, _prepare, arguments) as pool:
        return Rate(entry.who, f"pool, {entry.label}", *rate(lambda phis: sum(pool.map(_solve, phis)), 2 * cores))


def b_problem(duration: float) -> Problem:
    return Problem(replace(system_of(parse_case(*read_text(str(B))).case), interval=INTERVAL, duration=duration))


def our_sweep(
    folder: Path, case: Path, points: int, *settings: str, low: float = LEAST, high: float = MOST
) -> LoadedSweep:
    """A sweep over friction."""
    path = folder / "sweep.toml"
    axis = f'parameter = "friction.coefficient"\nstart = {low}\nstop = {high}\nnum = {points}\n'
    path.write_text(f'case = "{case}"\n[[axis]]\n{axis}')
    return load_sweep(str(path), list(settings))


def swept(loaded: LoadedSweep, workers: int, folder: Path) -> float:
    """Seconds of a sweep, without the start of its workers."""
    with choose_engine(loaded.plan, workers) as engine:
        return sweep(loaded, folder / "sweep.h5", engine, force=True).seconds


def ours(points: int, what: str, *settings: str) -> Rate:
    """A sweep with its verdicts, on all cores; and its points in this process."""
    with tempfile.TemporaryDirectory() as name:
        loaded = our_sweep(Path(name), B, points, *settings)
        some = min(points, 64)
        compute(loaded.plan, 0, 1)  # loads kernels
        begin = time.process_time()
        compute(loaded.plan, 0, some)
        used = (time.process_time() - begin) / some
        return Rate("brakecli", what, points / swept(loaded, os.cpu_count() or 1, Path(name)), 1.0 / used)
