"""What is no motion side by side: promises, maps, searches for critical values, and how cost grows."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.performance import ensembles
from benchmarks.performance.matching import Entry, cheapest, loop
from brakecli.api.inputs import load_sweep
from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.solver.integrate import solve
from brakecli.solver.method import Method
from brakecli.solver.roughness import surface
from brakecli.solver.schemes import NUMEROV
from brakecli.solver.system import System
from brakecli.studies.runs.tolerance import certify
from brakecli.studies.sweeps.point import compute

CASES = ensembles.CASES
RELAXATION = ensembles.CASES / "relaxation.toml"
REGIMES = "solver={tolerance=1e-3, duration=2.0}"
PROBE = 100  # points along each axis: of 20, the one beside the critical friction counts for too much
# B's waves with a common length of 2.6 m, which passes in 1 s, on a suspension that loses stability
PERIODIC = (
    "wheel.angular_speed=5.2",
    "contact.stiffness=5e7",
    "roughness.shoe.amplitudes=[30e-6,21e-6,15e-6,9e-6,6e-6]",
    "roughness.wheel.amplitudes=[30e-6,24e-6,18e-6]",
    "roughness.wheel.wavelengths=[0.025,0.013,0.008]",
)


def load(name: str, *settings: str) -> System:
    return system_of(parse_case(*read_text(str(CASES / name)), settings).case)


def loop_seconds(system: System, method: Method, turns: int = 5) -> float:
    """Median time of the loop, in one block."""
    system = replace(system, method=method)
    return median([loop(system)[0] for _ in range(turns + 1)][1:])


def promise(duration: float, entries: list[Entry], turns: int = 9) -> tuple[float, float]:
    """Seconds of a certified run of B to 1e-3, and of the cheapest entry that keeps it: medians, as of entries."""
    settings = (f"solver={{duration={duration}, tolerance=1e-3}}", f"output.sample_interval={ensembles.INTERVAL}")
    best = cheapest(entries, "brakecli", 1e-3)
    seconds = list[float]()
    assert best is not None
    for _ in range(turns):
        system = load("accuracy/B.toml", *settings)
        begin = time.process_time()
        certify(system)
        seconds.append(time.process_time() - begin)
    return median(seconds[1:]), best.time


def map_seconds(points: int) -> tuple[float, float]:
    """The command for the map of regimes, points x points, with start-up and file; and its processor time."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "map.toml"
        axes = (("friction.coefficient", 0.5, 0.8), ("wheel.angular_speed", 0.04, 0.8))
        text = "".join(
            f'[[axis]]\nparameter = "{key}"\nstart = {low}\nstop = {high}\nnum = {points}\n'
            for key, low, high in axes
        )
        path.write_text(f'case = "{RELAXATION}"\n{text}')
        command = [sys.executable, "-m", "brakecli", "sweep", str(path), "--set", REGIMES, "--quiet"]
        begin = time.perf_counter()
        before = os.times()
        subprocess.run([*command, "-o", str(Path(name) / "map.h5")], check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - begin
        after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return seconds, used


def regimes_map(points: int) -> tuple[float, str]:
    """Seconds of the map, and how they were found: those of a larger one follow from that of `PROBE` x `PROBE`."""
    start, start_used = map_seconds(2)
    seconds, used = map_seconds(PROBE)
    told = f"{1e3 * (used - start_used) / PROBE**2:.3g} ms of a core a point, start and end {start:.2g} s"
    if points == PROBE:
        return seconds, told
    whole = start + (seconds - start) * points**2 / PROBE**2
    return whole, f"extrapolated from {PROBE} × {PROBE} points in {seconds:.1f} s; {told}"


def critical_seconds(case: str, high: float, settings: Iterable[str] = ()) -> float:
    """A point with its critical friction and `critical_sustained`, by simulation, in this process."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "sweep.toml"
        axis = '[[axis]]\nparameter = "link1.damping"\nvalues = [300.0]\n'
        critical = f'[critical]\nparameter = "friction.coefficient"\nlower = 0.0\nupper = {high}\n'
        path.write_text(f'case = "{CASES / case}"\n{axis}{critical}')
        loaded = load_sweep(str(path), list(settings))
        begin = time.process_time()
        compute(loaded.plan, 0, 1)
        return time.process_time() - begin


def steps(nodes: int = 0) -> Method:
    return Method("three-layer", NUMEROV, nodes=nodes, step=2.5e-5)


Table = tuple[str, list[str], list[list[str]]]
"""Title, heads of columns, rows."""


def by_duration() -> Table:
    durations = (0.02, 0.1, 0.5, 2.0)
    rows = []
    for name, method in (("S", Method("piecewise-exact")), ("B", steps(256)), ("C", steps(256))):
        system = replace(load(f"accuracy/{name}.toml"), interval=2.5e-4)
        times = [loop_seconds(replace(system, duration=each), method) for each in durations]
        how = "piecewise-exact" if name == "S" else "three-layer, 256 nodes, 2.5e-5 s"
        rows.append([name, how, *(f"{1e3 * each:.3g} ms" for each in times)])
    return "Time of the loop by duration", ["case", "how", *(f"{each:g} s" for each in durations)], rows


def _row(over: Iterable[int], what: Callable[[int], tuple[System, Method]]) -> list[str]:
    found = [what(each) for each in over]
    return [f"{1e6 * loop_seconds(*each) / replace(each[0], method=each[1]).steps:.3g} µs" for each in found]


def by_nodes() -> Table:
    counts = (64, 256, 1024, 4096)
    system = replace(load("accuracy/B.toml"), interval=2.5e-4)
    row = _row(counts, lambda nodes: (system, steps(nodes)))
    return "A step of B by nodes, five waves on the wheel", [f"{each} nodes" for each in counts], [row]


def by_waves() -> Table:
    """Over 0.1 s at a load under which the pad is open in part at each step: closed forms know few waves only."""
    counts = (5, 50, 500)
    rows = []
    b = load("accuracy/B.toml", "load.force=1000.0")

    def rough(waves: int) -> System:
        wave = np.arange(waves)
        amplitudes = 7.2e-5 / waves * np.ones(waves)
        lengths = 0.025 / (1.0 + 5.0 * wave / waves)
        wheel = surface(amplitudes=tuple(amplitudes), wavelengths=tuple(lengths))
        return replace(b, interval=2.5e-4, duration=0.1, wheel=wheel)

    for nodes in (256, 1024):
        on_nodes = Method("event-driven", evaluator="cells", nodes=nodes, tolerance=1e-4)
        two_layer = Method("two-layer", (0.5, 0.5), nodes=nodes, step=2.5e-5)
        for name, method in (("three-layer", steps(nodes)), ("two-layer", two_layer), ("event-driven", on_nodes)):
            systems = [replace(rough(waves), method=method) for waves in counts]
            turns = [[loop(each)[0] for each in systems] for _ in range(6)]  # the first one touches memory
            taken = [solve(each).work.steps for each in systems]
            least = np.min(turns[1:], axis=0) / taken
            rows.append([name, f"{nodes}", *(f"{1e6 * each:.3g} µs" for each in least)])
    title = "A step of B at a load of 1000 N, where the pad is open in part, by waves on the wheel"
    return title, ["scheme", "nodes", *(f"{each} waves" for each in counts)], rows


def by_points() -> Table:
    counts = (40, 160, 640)
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for workers in (1, 2):
            row = []
            for points in counts:
                loaded = ensembles.our_sweep(folder, RELAXATION, points, REGIMES, low=0.5, high=0.8)
                row.append(f"{1e3 * ensembles.swept(loaded, workers, folder) / points:.3g} ms")
            rows.append([f"{workers}", *row])
    title = "A point of a map of regimes (2 s of stick-slip) by points and workers"
    return title, ["workers", *(f"{each} points" for each in counts)], rows
