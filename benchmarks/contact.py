"""What the contact costs: one evaluation against C, the evaluations of a step, event-driven runs on an open pad.

`make bench-contact` prints what docs/performance.md says. The C kernel is compiled here for the numbers of nodes
and of waves; it does what `contact.midpoint` does. Times are minima over repeats; those of one evaluation take
turns, so that whatever else the machine does falls on all of them alike.
"""

import ctypes
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.solver.arrays import Floats
from brakecli.solver.contact.force import evaluate
from brakecli.solver.contact.pad import BESIDE, build_layer, build_pad
from brakecli.solver.integrate import Motion, solve
from brakecli.solver.kernels import compiler
from brakecli.solver.records import Layer
from brakecli.solver.system import System

CASES = Path(__file__).parents[1] / "cases" / "accuracy"
REPEATS = 40
CALLS = 1000
# m: of the shoe, along the wheel between two evaluations, of the bound
HEIGHT = -3e-5
DRIFT = 1e-7
REACH = 1e-9
FLAGS = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
SOURCE = r"""
#define _GNU_SOURCE
#include <math.h>
#define COLUMNS (NODES + 6)
static void evaluate(double x, double y, double reach, const double *omega, const double *restrict f1,
                     const double table[WAVES][2][COLUMNS], double *restrict out, double *restrict f2) {
    double s[WAVES], c[WAVES];
    for (int i = 0; i < WAVES; i++) sincos(omega[i] * x, &s[i], &c[i]);
    for (int j = 0; j < COLUMNS; j++) {
        double sum = 0;
        for (int i = 0; i < WAVES; i++) sum += c[i] * table[i][0][j] + s[i] * table[i][1][j];
        f2[j] = sum;
    }
    double force = 0, touching = 0, rise = 0, square = 0, work = 0, near = 0;
    for (int j = 0; j < NODES; j++) {
        double gap = f2[j + 3] - f1[j] - y;
        double across = 45 * (f2[j + 4] - f2[j + 2]) - 9 * (f2[j + 5] - f2[j + 1]) + (f2[j + 6] - f2[j]);
        near += fabs(gap) <= reach ? 1 : 0;
        double touch = gap > 0 ? 1 : 0;
        gap = gap > 0 ? gap : 0;
        force += gap; touching += touch; rise += touch * across; square += gap * gap; work += gap * across;
    }
    out[0] = force; out[1] = touching; out[2] = rise; out[3] = square; out[4] = work; out[5] = near;
}
void repeat(long calls, double drift, double y, double reach, const double *omega, const double *f1,
            const double table[WAVES][2][COLUMNS], double *out, double *f2) {
    for (long i = 0; i < calls; i++) {
        evaluate(drift * i, y, reach, omega, f1, table, out, f2);
        __asm__ volatile("" ::: "memory");
    }
}
"""


def _repeat(layer: Layer, tables: Floats, scratch: Floats, calls: int) -> None:
    for i in range(calls):
        evaluate(DRIFT * i, HEIGHT, layer, tables, scratch)


def in_c(system: System, nodes: int) -> tuple[Callable[[], None], Floats]:
    """The evaluations in C, compiled for these nodes and waves; and the sums of the last."""
    wheel = system.wheel
    spacing = 2.0 * system.half_length / nodes
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "contact.c")
        library = Path(folder, "contact.so")
        source.write_text(SOURCE)
        sizes = [f"-DNODES={nodes}", f"-DWAVES={wheel.g.size}"]
        subprocess.run(["gcc", *FLAGS, *sizes, "-o", str(library), str(source), "-lm"], check=True)
        repeat = ctypes.CDLL(str(library)).repeat
    xi = -system.half_length + spacing * (np.arange(nodes + 6) - 2.5)
    table = np.array(
        [
            [g * np.sinc(omega * spacing / (2.0 * np.pi)) * f(omega * xi) for f in (np.sin, np.cos)]
            for g, omega in zip(wheel.g, wheel.omega, strict=True)
        ]
    )
    pad = build_pad(system.layer_stiffness, system.half_length, system.shoe, wheel, nodes)
    edges = pad.tables[pad.constants.nodes_at + BESIDE :][: nodes + 1]
    f1 = 0.5 * (edges[1:] + edges[:-1])
    sums = np.zeros(6)
    arrays = [_in_lines(each) for each in (wheel.omega, f1, table.ravel(), sums, np.zeros(nodes + 6))]
    repeat.argtypes = [ctypes.c_long, *[ctypes.c_double] * 3, *[ctypes.c_void_p] * 5]

    def run() -> None:
        repeat(CALLS, DRIFT, HEIGHT, REACH, *(array.ctypes.data for array in arrays))

    return run, arrays[3]


def _in_lines(numbers: Floats) -> Floats:
    """A copy that begins where a line of the cache does."""
    room = np.zeros(numbers.size + 8)
    begin = -room.ctypes.data // 8 % 8
    room[begin : begin + numbers.size] = numbers
    return room[begin : begin + numbers.size]


def fastest(work: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Least CPU time of each (s)."""
    best = dict.fromkeys(work, np.inf)
    for _ in range(REPEATS):
        for name, function in work.items():
            start = time.process_time()
            function()
            best[name] = min(best[name], time.process_time() - start)
    return best


def of_one_evaluation(system: System, nodes: int) -> dict[str, float]:
    """Time of one evaluation of an open pad by each evaluator, and by C (s)."""
    run, sums = in_c(system, nodes)
    work: dict[str, Callable[[], Any]] = {"C": run}
    pad = build_pad(system.layer_stiffness, system.half_length, system.shoe, system.wheel, nodes)
    layers = {}
    repeat = compiler().njit(_repeat)
    for name in ("midpoint", "cells", "exact", "closed-form"):
        layers[name] = build_layer(name, pad)
        layers[name].contact.reach = REACH
        work[name] = partial(repeat, *layers[name], CALLS)
    best = fastest(work)
    force = sums[0] * pad.constants.k * 2.0 * system.half_length / nodes
    if not np.isclose(force, layers["midpoint"].contact.normal_force, rtol=1e-12):
        raise ValueError("C computes another force")
    return {name: seconds / CALLS for name, seconds in best.items()}


def timed(system: System) -> tuple[Motion, float]:
    """A motion, and the least time that its loop takes (s)."""
    motions = [solve(system, first_block=16384) for _ in range(REPEATS // 4)]
    return motions[0], min(motion.work.solve_seconds for motion in motions)


def main() -> int:
    """Print everything."""
    cases = {name: system_of(parse_case(*read_text(str(CASES / f"{name}.toml"))).case) for name in "SBC"}
    for nodes in (64, 256, 1024):
        found = of_one_evaluation(cases["B"], nodes)
        times = ", ".join(f"{name} {1e9 * seconds:.0f} ns" for name, seconds in found.items())
        print(f"one evaluation, {nodes} nodes: {times}; midpoint over C: {found['midpoint'] / found['C']:.2f}")
    for name, system in cases.items():
        for step in (5e-5, 2.5e-5, 1e-5):
            method = replace(system.method, scheme="three-layer", theta=(0.25, 0.5, 0.25), step=step)
            motion, seconds = timed(replace(system, interval=1e-3, duration=0.1, method=method))
            work = motion.work
            each = (work.contact_evaluations - len(motion.rows)) / work.steps
            print(f"{name}, h = {step:g} s: {each:.3f} evaluations and {1e9 * seconds / work.steps:.0f} ns a step")
    for tolerance in (1e-6, 1e-10):
        method = replace(cases["B"].method, scheme="event-driven", tolerance=tolerance)
        motion, seconds = timed(replace(cases["B"], interval=1e-4, method=method))
        evaluations = motion.work.contact_evaluations
        print(f"B, event-driven, tolerance {tolerance:g}: {1e3 * seconds:.1f} ms, {evaluations} evaluations")
    return 0


if __name__ == "__main__":
    sys.exit(main())
