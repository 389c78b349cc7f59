"""What a tolerance costs beside the cheapest entry of compare-schemes that keeps it.

    python -m benchmarks.promise_cost

The cases B and C of cases/accuracy and one in full contact, each for 20 ms, 0.2 s and 0.5 s. Entry and promise
take turns; the least processor time of each counts, with its tables. Entries with the exact contact force, far too
expensive for these tolerances, and event-driven ones below a tolerance of 1e-6 are left out.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time

from brakecli.case.read import parse_case, read_text
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.solver.arrays import Floats
from brakecli.solver.integrate import solve
from brakecli.solver.method import Method
from brakecli.solver.system import System
from brakecli.studies.comparison.compare import errors
from brakecli.studies.comparison.methods import kinds, ladder, method_label, rungs
from brakecli.studies.runs.tolerance import certify

CASES = Path(__file__).parents[1] / "cases"
NAMES = {"B": "accuracy/B.toml", "C": "accuracy/C.toml", "full contact": "rough-full-contact.toml"}
DURATIONS = (0.02, 0.2, 0.5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
CHOSEN = Method("event-driven", automatic=True)
EXACT = Method("event-driven", tolerance=1e-10)
# turns of an entry and a promise, and seconds after which there is none more
TURNS = 25
SLOW = 5.0


def entries(system: System, exact: Floats) -> Iterator[tuple[float, float, Method]]:
    """Processor time (s), error and method of what compare-schemes tries."""
    for kind in kinds(system):
        for method in rungs(kind, ladder(system)) if kind.evaluator != "exact" else ():
            if method.step is None and method.tolerance < 1e-6:
                continue
            try:
                _ = solve(replace(system, duration=system.interval), method)  # compiled
                begin = process_time()
                motion = solve(system, method, first_block=system.steps)
                seconds = process_time() - begin
            except BrakecliError:
                continue
            if not motion.work.failed:
                yield seconds, errors(motion.rows, exact).error, method


def cell(system: System, tried: list[tuple[float, float, Method]], exact: Floats, tolerance: float) -> str:
    """Time of the cheapest entry and of the promise (ms), and their ratio."""
    able = sorted((seconds, number) for number, (seconds, error, _) in enumerate(tried) if error <= tolerance)
    alone = {number: math.inf for _, number in able[:5]}
    promise = list[float]()
    promised = replace(system, method=replace(CHOSEN, tolerance=tolerance))
    while len(promise) < TURNS and sum(promise) < SLOW:
        for number in alone:
            begin = process_time()
            solve(system, tried[number][2], first_block=system.steps)
            alone[number] = min(alone[number], process_time() - begin)
        begin = process_time()
        found = certify(promised)
        promise.append(process_time() - begin)
    best = min(alone, key=lambda number: alone[number])
    error = errors(found.motion.rows, exact).error
    ratio = min(promise) / alone[best]
    method = tried[best][2]
    print(f"# {tolerance:g}: {method_label(method)}, {method.step or method.tolerance:.3g}", file=sys.stderr)
    print(f"# {found.certificate.sentence()}, {error:.1e} in truth", file=sys.stderr, flush=True)
    broken = "" if found.certificate.certified and error <= tolerance else ", not kept"
    return f"{alone[best] * 1e3:.2g} → {min(promise) * 1e3:.2g}, **{ratio:.2g}**{broken}"


def main() -> None:
    print("| case | " + " | ".join(f"{tolerance:g}" for tolerance in TOLERANCES) + " |")
    print("|---|" + "---|" * len(TOLERANCES), flush=True)
    for name, file in NAMES.items():
        system = system_of(parse_case(*read_text(str(CASES / file))).case)
        for duration in DURATIONS:
            sampled = replace(system, interval=ladder(system)[0], duration=duration)
            exact = solve(sampled, EXACT).rows
            tried = list(entries(sampled, exact))
            cells = [cell(sampled, tried, exact, tolerance) for tolerance in TOLERANCES]
            print(f"| {name}, {duration:g} s | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
