"""Single evaluations and single steps beside C, compiled on the spot by gcc."""

import ctypes
import multiprocessing
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from brakecli.solver.contact.midpoint import evaluate
from brakecli.solver.contact.pad import build_layer
from brakecli.solver.integrate import Stepping
from brakecli.solver.kernels import compiler
from brakecli.solver.method import Method
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.system import System

SOURCE = Path(__file__).with_name("step.c")
FLAGS = ("-O3", "-march=native", "-ffast-math", "-shared", "-fPIC")
NODES = 256
COUNT = 20_000
TURNS = 15
PROCESSES = 5
X = 1e-5
Y = -1e-4
TRAVEL = 0.01


class Beside(NamedTuple):
    """Seconds of one: ours and C's, and how far the answers of the two are apart, relative."""

    what: str
    ours: float
    theirs: float
    apart: float


def unavailable() -> str:
    return "" if shutil.which("gcc") else "gcc is not installed"


def pointer(values: Any) -> Any:
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def compiled(folder: str, waves: int) -> Any:
    library = Path(folder) / "step.so"
    sizes = (f"-DNODES={NODES}", f"-DWAVES={waves}")
    subprocess.run(["gcc", *FLAGS, *sizes, str(SOURCE), "-o", str(library), "-lm"], check=True)
    found = ctypes.CDLL(str(library))
    found.evaluations.restype = ctypes.c_double
    found.steps.restype = ctypes.c_long
    found.evaluations.argtypes = [ctypes.c_long] + [ctypes.c_double] * 3
    return found


def in_turns(one: Callable[[], float], other: Callable[[], float]) -> tuple[float, float]:
    """Median seconds of two calls, in turns."""
    times: list[tuple[float, float]] = []
    for _ in range(TURNS + 1):
        begin = time.process_time()
        one()
        middle = time.process_time()
        other()
        times.append((middle - begin, time.process_time() - middle))
    first, second = (median(column) for column in zip(*times[1:], strict=True))
    return first, second


def _evaluations(count, x, y, travel, layer, tables, scratch, omega):  # type: ignore[no-untyped-def]
    total = 0.0
    for n in range(count):
        for i in range(omega.size):
            scratch[layer.angles_at + i] = -omega[i] * (travel + 1e-6 * n)
        evaluate(x + 1e-9 * n, y, layer, tables, scratch)
        total += layer.contact.normal_force
    return total


def beside_c(load: Callable[[], System]) -> list[Beside]:
    """Medians over processes: where in memory one has its machine code and tables changes a ratio by 5 %."""
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        found = [pool.apply(_measured, (load,)) for _ in range(PROCESSES)]
    return [
        sorted(each, key=lambda one: one.ours / one.theirs)[PROCESSES // 2] for each in zip(*found, strict=True)
    ]


def _measured(load: Callable[[], System]) -> list[Beside]:
    """An evaluation with 256 nodes, and a step in slip with as many evaluations as Newton's iteration takes."""
    method = Method("three-layer", NUMEROV, evaluator="midpoint", nodes=NODES, step=2.5e-5)
    system = replace(load(), method=method, interval=2.5e-5, duration=0.2)
    pad = system.pad
    spacing = 2.0 * system.half_length / NODES
    xi = -system.half_length + spacing * (np.arange(-1, NODES + 1) + 0.5)
    shoe, wheel = (
        (f.g * np.sinc(f.omega * spacing / (2.0 * np.pi)), f.omega) for f in (system.shoe, system.wheel)
    )
    f1 = shoe[0] @ np.sin(np.outer(shoe[1], xi) + system.shoe.phase[:, None])
    parts = [f1, *(wheel[0][:, None] * f(np.outer(wheel[1], xi)) for f in (np.sin, np.cos))]
    omega = np.ascontiguousarray(system.wheel.omega)
    contact = build_layer(system.evaluator, pad)
    evaluations = compiler().njit(_evaluations)
    per_gap = system.layer_stiffness * spacing
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(folder, len(omega))
        library.tables(*(pointer(part) for part in (*parts, omega)))
        results: list[Any] = [None, None]

        def ours() -> None:
            results[0] = evaluations(COUNT, X, Y, TRAVEL, *contact, omega)

        def theirs() -> None:
            results[1] = library.evaluations(COUNT, X, Y, TRAVEL) * per_gap

        times = in_turns(ours, theirs)  # type: ignore[arg-type]
        found = [Beside(f"one evaluation, {NODES} nodes", times[0] / COUNT, times[1] / COUNT, _apart(*results))]
        found.append(_steps(system, library, per_gap))
    return found


def _steps(system: System, library: Any, per_gap: float) -> Beside:
    c = system.coefficients
    count = system.steps
    load = system.load_at_start
    numbers = [*c[:7], load * c.sin_beta, load * c.cos_beta, c.phi, system.belt_speed, system.step, *NUMEROV]
    p = np.array([*numbers, per_gap, system.layer_stiffness])
    state = np.zeros(5)
    evaluated = [0]
    begun = Stepping(system).state
    start = np.array([begun.x_old, begun.y_old, begun.x, begun.y, begun.force])
    last: list[Any] = [None]

    def theirs() -> None:
        state[:] = start
        evaluated[0] = library.steps(ctypes.c_long(count), pointer(p), pointer(state))

    def ours() -> float:
        stepping = Stepping(replace(system, interval=system.duration))  # one sample, at the end
        begin = time.process_time()
        stepping.block(count + 1)
        seconds = time.process_time() - begin
        last[0] = (float(stepping.state.x_old), int(stepping.counts.evaluations))
        return seconds

    times = []
    for _ in range(TURNS + 1):
        own = ours()
        begin = time.process_time()
        theirs()
        times.append((own, time.process_time() - begin))
    own, alone = (median(column) for column in zip(*times[1:], strict=True))
    what = f"one step, {NODES} nodes, {last[0][1] / count:.2f} evaluations against {evaluated[0] / count:.2f}"
    return Beside(what, own / count, alone / count, abs(last[0][0] / state[0] - 1.0))


def _apart(one: float, other: float) -> float:
    return abs(one / other - 1.0)
