"""The kernels mean the same as plain Python: one short motion, compiled and with NUMBA_DISABLE_JIT=1.

The subprocess runs this very file as a script.
"""

import os
import subprocess
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.solver import kernels
from brakecli.solver.contact import EVALUATORS
from brakecli.solver.roughness import wheel_angles
from brakecli.solver.schemes import SCHEMES as ROWS

ON_NODES = {"window", *(name for name, row in EVALUATORS.items() if row.needs_nodes)}
PAIRS = [
    (scheme, evaluator)
    for scheme, evaluator in product(ROWS, EVALUATORS)
    if not ROWS[scheme].exact and not (ROWS[scheme].own_steps and evaluator in ON_NODES - {"auto"})
]
PAIRS += [("piecewise-exact", "closed-form"), ("two-layer", "window")]
STEPS = dict.fromkeys(ROWS, 50) | {"event-driven": 20}
"""Samples; interpreted, the exact contact of the event-driven scheme takes 50 ms for each."""


def case(scheme: str, evaluator: str) -> dict[str, Any]:
    """A rough pad that bounces off a slow wheel and is caught by it; wholly in contact for the closed form."""
    smooth = scheme == "piecewise-exact"
    full = evaluator == "closed-form" and not smooth
    wheel: dict[str, Any] = {"amplitudes": [2e-5, 1e-5], "wavelengths": [0.013, 0.004]}
    if evaluator == "window":  # many waves
        wheel = {"amplitudes": [2.5e-6] * 12, "wavelengths": [0.001 * n for n in range(4, 16)]}
        evaluator = "auto"
    return {
        "shoe": {"mass": 0.1},
        "wheel": {"radius": 0.5, "times": [0.0, 5e-4], "angular_speeds": [0.1, 0.3]},
        "link1": {"stiffness": 2e7, "damping": 200.0, "angle_deg": 20.0},
        "link2": {"stiffness": 1e7, "damping": 100.0, "angle_deg": 30.0},
        "load": {"times": [0.0, 1e-3], "forces": [500.0, 800.0] if not full else [2e4, 2.1e4]},
        "friction": {"coefficient": 0.5},
        "contact": {
            "half_length": 0.01,
            "stiffness": 5e8,
            "evaluator": evaluator,
            **({"nodes": 32} if evaluator in ON_NODES else {}),
        },
        "roughness": {}
        if smooth
        else {
            "shoe": {"amplitudes": [3e-5, 1e-5], "wavelengths": [0.011, 0.005], "phases_deg": [0.0, 60.0]},
            "wheel": wheel,
        },
        "initial": {"at": "equilibrium", "vx": 0.3} if full else {"x": -2e-5, "y": 4e-5, "vx": 0.2},
        "solver": {
            "scheme": scheme,
            "duration": 2e-5 * STEPS[scheme],
            **({"tolerance": 1e-6} if ROWS[scheme].own_steps else {"step": 2e-5}),
        },
        "output": {"sample_interval": 2e-5},
    }


def histories() -> dict[str, NDArray[np.float64]]:
    """The samples of every scheme with every evaluator, the evaluations that they took, and what loops noted."""
    from brakecli.case.case import Case
    from brakecli.case.system import system_of
    from brakecli.solver.integrate import solve

    found = {}
    for scheme, evaluator in PAIRS:
        motion = solve(replace(system_of(Case.model_validate(case(scheme, evaluator))), tracked=True))
        work = motion.work
        name = f"{scheme} {evaluator}"
        found[name] = motion.rows
        track = motion.track
        assert track is not None
        found[f"{name} track"] = np.concatenate(
            [each.ravel() for each in (*track.kept, track.times, track.works, track.stored)]
        )
        found[f"{name} work"] = np.array(
            [float(work.failure), work.steps, work.contact_evaluations, motion.system.window_rows]
        )
    return found


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], dict[str, Any]]:
    assert wheel_angles in kernels.entries
    path = tmp_path_factory.mktemp("interpreted") / "interpreted.npz"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    root = Path(__file__).parents[2]
    command = [sys.executable, "-W", "error", "-m", "tests.solver.test_interpreted", str(path)]
    done = subprocess.run(command, env=environment, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with np.load(path) as file:
        return histories(), dict(file)


@pytest.mark.parametrize(("scheme", "evaluator"), PAIRS)
def test_compiled_and_interpreted_motions_are_the_same(
    both: tuple[dict[str, Any], dict[str, Any]], scheme: str, evaluator: str
) -> None:
    compiled, interpreted = (each[f"{scheme} {evaluator}"] for each in both)
    assert compiled.shape == interpreted.shape == (STEPS[scheme] + 1, 8)
    same_sums = evaluator not in ON_NODES or ROWS[scheme].own_steps
    if same_sums:
        np.testing.assert_array_equal(compiled, interpreted)
        np.testing.assert_array_equal(*(each[f"{scheme} {evaluator} track"] for each in both))
    else:
        # The compiler may add the 32 nodes' gaps in another order, 32/2 units in the last place of F_y at most, in
        # each of 50 steps: 2e-13 of the largest value. Friction and dashpots do not let a difference grow.
        largest = np.abs(interpreted).max(axis=0)
        assert np.all(np.abs(compiled - interpreted) <= STEPS[scheme] * 32 / 2 * 2.0**-52 * largest)
        np.testing.assert_array_equal(compiled[:, 7], interpreted[:, 7])
    work = [each[f"{scheme} {evaluator} work"] for each in both]
    assert work[0][0] == 0.0  # no failure
    assert (evaluator == "window") == (work[0][3] > 0.0)
    assert work[0][1] > 10 if ROWS[scheme].own_steps else work[0][1] == STEPS[scheme]
    same = [0, 1, 2, 3] if same_sums else [0, 1, 3]  # rounding may cost an evaluation
    np.testing.assert_array_equal(work[0][same], work[1][same])


def test_the_motion_compared_sticks_slips_and_opens(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    exact = both[0]["piecewise-exact closed-form"]
    assert set(exact[:, 7]) == {-1.0, 0.0, 1.0, 2.0}
    rows = np.concatenate(
        [both[0][f"{scheme} {evaluator}"] for scheme, evaluator in PAIRS if evaluator != "closed-form"]
    )
    assert set(rows[:, 7]) == {-1.0, 0.0, 1.0, 2.0}
    assert np.mean((rows[:, 6] > 0.05) & (rows[:, 6] < 0.95)) > 0.2


if __name__ == "__main__":
    np.savez(sys.argv[1], **histories())  # type: ignore[arg-type]
