"""Whether tolerances are kept: random cases, their true errors, and what was promised.

    python -m benchmarks.promises [CASES]

Cases are drawn with a fixed seed, a fifth of each kind: flat ones that slide, flat ones that stick or lift off,
rough ones in full contact, rough ones that open, and rough ones that open and stick. The truth is the event-driven
scheme at a tolerance of 1e-12, itself held to matrix exponentials and to SciPy in
tests/solver/test_event_driven.py.
"""

import math
import sys
import time
from typing import Any

import numpy as np

from brakecli.case.case import Case, changed
from brakecli.case.system import system_of
from brakecli.errors import BrakecliError
from brakecli.solver.integrate import solve
from brakecli.solver.links import natural_frequencies
from brakecli.solver.quantities import HISTORY, ContactState
from brakecli.studies.comparison.compare import errors
from brakecli.studies.runs.tolerance import certify

KINDS = (
    "flat, sliding",
    "flat, sticking or lifting",
    "rough, full contact",
    "rough, open",
    "rough, open, sticking",
)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
TRUTH = 1e-12


def random_case(rng: np.random.Generator, kind: str) -> Case:
    """A case of a kind, as likely as not unstable."""
    mass = 10.0 ** rng.uniform(-0.5, 1.5)
    c_1 = 10.0 ** rng.uniform(6.0, 7.5)
    contact = c_1 * 10.0 ** rng.uniform(-1.0, 0.7)
    c_2 = (c_1 + contact) * 10.0 ** rng.uniform(-0.3, 0.3)
    damping = 10.0 ** rng.uniform(-2.7, -1.3) * math.sqrt(mass)
    slow = "stick" in kind
    load = 10.0 ** rng.uniform(2.0, 3.7)
    compression = load / (c_1 + contact)
    tables: dict[str, Any] = {
        "shoe": {"mass": mass},
        "wheel": {
            "radius": 0.5,
            "angular_speed": 2.0 * 10.0 ** (rng.uniform(-2.0, -0.5) if slow else rng.uniform(-0.3, 0.7)),
        },
        "link1": {"stiffness": c_1, "damping": damping * math.sqrt(c_1), "angle_deg": rng.uniform(-30.0, 30.0)},
        "link2": {"stiffness": c_2, "damping": damping * math.sqrt(c_2), "angle_deg": rng.uniform(-30.0, 30.0)},
        "load": {"force": load},
        "friction": {"coefficient": rng.uniform(0.1, 1.0)},
        "contact": {"half_length": 0.05, "stiffness": contact / 0.1},
        "solver": {"duration": 1.0},
        "output": {"sample_interval": 1e-4},
    }
    if kind.startswith("rough"):
        height = compression * (
            10.0 ** rng.uniform(-0.3, 0.5) if "open" in kind else 10.0 ** rng.uniform(-2.0, -1.0)
        )
        for name in ("shoe", "wheel"):
            waves = int(rng.integers(1, 4))
            lengths = 0.03 * 10.0 ** -rng.uniform(0.0, 0.9, waves)
            tables.setdefault("roughness", {})[name] = {
                "amplitudes": [float(value) for value in height * rng.uniform(0.2, 1.0, waves) / waves],
                "wavelengths": [float(value) for value in lengths],
            }
    if kind == "rough, full contact":  # a start from rest passes through contact that is open in part
        tables["initial"] = {"at": "equilibrium", "x": 0.1 * compression}
    case = Case.model_validate(tables)
    fast = natural_frequencies(system_of(case).coefficients, contact)[1]
    periods = rng.uniform(3.0, 8.0) if "open" in kind else rng.uniform(20.0, 200.0)
    return changed(case, solver={"duration": periods / fast}, output={"sample_interval": 1.0 / (20.0 * fast)})


def samples(case: Case, **solver: Any) -> np.ndarray[Any, Any] | None:
    """The samples of a motion; None where there is none to be had."""
    motion = solve(system_of(changed(case, solver=solver)))
    return None if motion.work.failed else motion.rows


def fits(rows: np.ndarray[Any, Any], kind: str) -> bool:
    """Whether a motion does what its kind says."""
    states = rows[:, list(HISTORY).index("state")]
    fraction = rows[:, list(HISTORY).index("contact_fraction")]
    sticks = (states == ContactState.STICK).any()
    lifts = (states == ContactState.SEPARATED).any()
    if kind == "flat, sliding":
        return not sticks
    if kind == "flat, sticking or lifting":
        return bool(sticks or lifts)
    opens = ((fraction > 0.0) & (fraction < 1.0)).any()
    return bool(opens) == ("open" in kind) and (bool(sticks) or "sticking" not in kind)


def main() -> None:
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 75
    rng = np.random.default_rng(20)
    found: list[tuple[str, float, bool, float, float, float]] = []
    for number in range(wanted):
        kind = KINDS[number % len(KINDS)]
        while True:
            case = random_case(rng, kind)
            try:
                step = case.output.sample_interval / 4.0
                coarse = samples(case, scheme="two-layer", theta=(0.5, 0.5), step=step)
                if coarse is None or not fits(coarse, kind):
                    continue
                exact = samples(case, scheme="event-driven", tolerance=TRUTH)
            except BrakecliError:
                continue
            if exact is not None and fits(exact, kind):
                break
        for tolerance in TOLERANCES:
            begin = time.perf_counter()
            answer = certify(system_of(changed(case, solver={"tolerance": tolerance})))
            seconds = time.perf_counter() - begin
            certificate = answer.certificate
            error = errors(answer.motion.rows, exact).error
            found.append((kind, tolerance, certificate.certified, certificate.estimated_error, error, seconds))
            if error > tolerance or not certificate.certified:
                told = f"true error {error:.1e}, {certificate.sentence()}"
                print(f"# case {number}, {kind}, to {tolerance:g}: {told}", flush=True)
        print(f"# {number + 1} of {wanted}", file=sys.stderr, flush=True)
    print("| tolerance | certified | kept, of those | worst true error / tolerance | median | median time, s |")
    print("|---|---|---|---|---|---|")
    for tolerance in TOLERANCES:
        rows = [row for row in found if row[1] == tolerance]
        sure = [row for row in rows if row[2]]
        ratios = [row[4] / tolerance for row in sure]
        kept = sum(ratio <= 1.0 for ratio in ratios)
        print(
            f"| {tolerance:g} | {len(sure)} of {len(rows)} | {kept} | {max(ratios):.2g} | "
            f"{np.median(ratios):.2g} | {np.median([row[5] for row in rows]):.2g} |"
        )
    print()
    print("| kind | certified | kept, of those | worst true error / tolerance | largest true error / estimate |")
    print("|---|---|---|---|---|")
    for kind in KINDS:
        rows = [row for row in found if row[0] == kind]
        sure = [row for row in rows if row[2]]
        optimistic = max(row[4] / max(row[3], 1e-300) for row in rows)
        kept = sum(row[4] <= row[1] for row in sure)
        worst = max(row[4] / row[1] for row in sure)
        print(f"| {kind} | {len(sure)} of {len(rows)} | {kept} | {worst:.2g} | {optimistic:.2g} |")


if __name__ == "__main__":
    main()
