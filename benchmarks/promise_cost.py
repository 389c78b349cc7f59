"""What a tolerance costs beside the cheapest entry of compare-schemes that keeps it.

    python -m benchmarks.promise_cost [BUDGET]

The cases B and C of cases/accuracy and one in full contact, each for 20 ms, 0.2 s and 0.5 s. Entry and promise
take turns; the least processor time of each counts, with its tables. BUDGET (s) is that of each comparison.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

from brakecli.case.case import Case, changed
from brakecli.case.read import read_case
from brakecli.case.system import system_of
from brakecli.comparison.compare import Comparison, compare, errors
from brakecli.runs.tolerance import certify
from brakecli.solver.method import Method
from brakecli.solver.motion import solve

CASES = Path(__file__).parents[1] / "cases"
NAMES = {"B": "accuracy/B.toml", "C": "accuracy/C.toml", "full contact": "rough-full-contact.toml"}
DURATIONS = (0.02, 0.2, 0.5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
TURNS = 25
CHOSEN = {"scheme": "auto", "theta": (), "step": None}
SLOW = 10.0  # s, of all turns of a promise, after which there is none more


def cell(case: Case, comparison: Comparison, tolerance: float) -> str:
    """Time of the cheapest entry and of the promise (ms), and their ratio."""
    grid = {"output": {"sample_interval": comparison.interval}, "solver": {"duration": comparison.duration}}
    system = system_of(changed(case, **grid))
    able = [each for each in comparison.entries if each.error + comparison.reference_error <= tolerance]
    best = min(able, key=lambda entry: min(entry.seconds, default=math.inf))
    promised = system_of(changed(case, **grid | {"solver": {**grid["solver"], **CHOSEN, "tolerance": tolerance}}))
    alone, promise = [], []
    while len(promise) < TURNS and sum(promise) < SLOW:
        begin = process_time()
        solve(system, best.method, first_block=system.steps)
        between = process_time()
        found = certify(promised)
        alone.append(between - begin)
        promise.append(process_time() - between)
    exact = solve(system, Method("event-driven", tolerance=1e-4 * tolerance)).rows
    error, ratio = errors(found.motion.rows, exact).error, min(promise) / min(alone)
    said = found.certificate.sentence()
    print(f"# {tolerance:g}: {best}; {said}, {error:.1e} in truth", file=sys.stderr, flush=True)
    broken = "" if found.certificate.certified and error <= tolerance else ", not kept"
    return f"{min(alone) * 1e3:.2g} → {min(promise) * 1e3:.2g}, **{ratio:.2g}**{broken}"


def main() -> None:
    budget = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    print("| case | " + " | ".join(f"{tolerance:g}" for tolerance in TOLERANCES) + " |")
    print("|---|" + "---|" * len(TOLERANCES), flush=True)
    for name, file in NAMES.items():
        case = read_case(str(CASES / file)).case
        for duration in DURATIONS:
            system = replace(system_of(case), duration=duration)
            comparison = compare(system, budget=budget)
            cells = [cell(case, comparison, tolerance) for tolerance in TOLERANCES]
            print(f"| {name}, {comparison.duration:.3g} s | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
