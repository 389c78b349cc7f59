"""Points on rough pads whose runs are computed side by side."""

import tomllib
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import tomli_w

from brakecli.analysis.regime.classify import classify
from brakecli.case.case import Case
from brakecli.case.system import system_of
from brakecli.results import fields
from brakecli.results.field import values_of
from brakecli.solver.history import array_history
from brakecli.solver.integrate import solve
from brakecli.solver.method import Method
from brakecli.studies.runs.judge import inputs_of, to_judge
from brakecli.studies.runs.together import TOGETHER, certify_together
from brakecli.studies.runs.tolerance import certify
from brakecli.studies.sweeps.plan import LoadedSweep
from brakecli.studies.sweeps.simulate import checked, judged, judged_together, may_suffice, simulate
from brakecli.studies.sweeps.workers.task import compute_units
from tests.campaign import counts
from tests.examples import ROUGH, make
from tests.studies.sweeps.helpers import axis, inline, interrupted, local, write_sweep

pytestmark = pytest.mark.usefixtures("compiled")

TOLERANCE = 1e-3
PROMISED: dict[str, Any] = ROUGH | {"solver": {"tolerance": TOLERANCE, "duration": 0.02}}
PROMISED["output"] = {"sample_interval": 2.5e-4}
OPENING = tomllib.loads((Path(__file__).parent / "opening.toml").read_text())


def rough(folder: Path, num: int) -> LoadedSweep:
    """Speeds of the wheel: at the least one the shoe sticks, and leaves its lane."""
    speeds = axis("wheel.angular_speed", f"values = {[0.02, *np.linspace(0.5, 8.0, num - 1).tolist()]}")
    return write_sweep(folder, speeds, case=tomli_w.dumps(PROMISED))


def test_no_way_of_computing_them_changes_a_byte(tmp_path: Path) -> None:
    loaded = rough(tmp_path, TOGETHER + 3)
    inline(loaded, tmp_path / "s.h5", compute_units)
    expected = (tmp_path / "s.h5").read_bytes()
    for size, order in ((9, -1), (1000, 1)):
        inline(loaded, tmp_path / "s.h5", compute_units, task_size=size, order=order, force=True)
        assert (tmp_path / "s.h5").read_bytes() == expected
    (tmp_path / "s.h5").unlink()
    interrupted(loaded, tmp_path / "s.h5", compute_units, task_size=15, order=1, limit=1)
    assert inline(loaded, tmp_path / "s.h5", compute_units, task_size=TOGETHER, order=-1).resumed > 0
    assert (tmp_path / "s.h5").read_bytes() == expected
    (tmp_path / "s.h5").unlink()
    local(loaded, tmp_path / "s.h5", compute_units, 2)
    assert (tmp_path / "s.h5").read_bytes() == expected


@pytest.mark.parametrize("num", counts(5, 20))
def test_their_numbers_are_those_of_runs_alone(tmp_path: Path, num: int) -> None:
    loaded = rough(tmp_path, num)
    inline(loaded, tmp_path / "s.h5", compute_units)
    with h5py.File(tmp_path / "s.h5") as file:
        found = {
            name: file[name][:].ravel() for name in ("regime", "amplitude", "braking_torque", "estimated_error")
        }
    for point in range(loaded.plan.points):
        whole = simulate(loaded.plan.case(loaded.plan.settings(point)))
        assert found["regime"][point].decode() == whole.verdict.regime
        assert found["estimated_error"][point] <= TOLERANCE
        assert found["amplitude"][point] == pytest.approx(whole.verdict.amplitude, rel=2.0 * TOLERANCE)
        assert found["braking_torque"][point] == pytest.approx(whole.verdict.braking_torque, rel=2.0 * TOLERANCE)


def test_what_a_sweep_leaves_out_of_a_verdict_changes_nothing_that_it_keeps(tmp_path: Path) -> None:
    loaded = rough(tmp_path, 5)
    kept = [field for field in fields.POINT if field.at.startswith("verdict.")]
    assert len(kept) > 8
    for point in range(1, loaded.plan.points):
        system = system_of(loaded.plan.case(loaded.plan.settings(point)))
        (found,) = certify_together([system])
        assert found is not None
        history = array_history(system.interval, found.motion.rows)
        inputs = [inputs_of(history, system, None)]
        (whole,), (brief,) = (classify(inputs, in_full=full) for full in (True, False))
        one, other = (values_of(kept, {"verdict": verdict}) for verdict in (whole, brief))
        assert one == other
        assert whole.reasons == brief.reasons


def say_the_same(cases: list[Case]) -> int:
    """Points of a sweep, computed side by side, say what runs of them say; how many of them lanes were enough for.

    Each amplitude is off by what both promise of the largest x.
    """
    known = [checked(case) for case in cases]
    systems = [each.system for each in known]
    lanes = 0
    found = judged_together(systems, certify_together(systems, may_suffice))
    for case, each, (by_lanes, theory) in zip(cases, known, found, strict=True):
        point = judged(case, each, by_lanes, theory, whole=False)
        run = simulate(case)
        one = point.verdict
        other = run.verdict
        assert (one.regime, one.excitation, one.settled) == (other.regime, other.excitation, other.settled)
        assert one.frequency == other.frequency  # no lane has one
        errors = [each.certificate.estimated_error for each in (point, run) if each.certificate is not None]
        assert len(errors) == 2
        largest = float(np.abs(run.motion.rows[:, 0]).max())
        assert one.amplitude == pytest.approx(other.amplitude, abs=sum(errors) * largest)
        lanes += by_lanes is not None
    return lanes


@pytest.mark.parametrize("name", OPENING)
@pytest.mark.parametrize("every", counts(20, 4))
def test_a_point_whose_pad_opens_says_what_a_run_of_it_says(name: str, every: int) -> None:
    """Its regime takes powers, and its amplitude turning points, which no lane has."""
    found = OPENING[name]
    cases = list[Case]()
    for friction, speed in product(found["frictions"], found["speeds"]):
        tables = {**found["case"], "friction": {"coefficient": friction}}
        tables["wheel"] = {**tables["wheel"], "angular_speed": speed}
        cases.append(make(tables))
    chosen = cases[::every]
    assert say_the_same(chosen) == 0
    lanes = certify_together([checked(case).system for case in chosen], may_suffice)
    assert lanes == [None] * len(chosen)  # none has been refined for nothing


def test_one_that_leaves_its_lane_is_certified_alone() -> None:
    slides, sticks = (system_of(make(PROMISED, wheel__angular_speed=speed)) for speed in (4.0, 0.02))
    found, left = certify_together([slides, sticks])
    assert found is not None
    assert left is None
    alone = certify(slides)
    assert found.certificate.certified
    one, other = (each.motion.rows[:, :4] for each in (found, alone))
    apart = np.abs(one - other).max(axis=0) / np.abs(other).max(axis=0)
    assert apart.max() <= found.certificate.estimated_error + alone.certificate.estimated_error <= 2.0 * TOLERANCE


def test_numbers_that_no_brake_has_concern_no_other_point(tmp_path: Path) -> None:
    masses = axis("shoe.mass", "values = [10.0, 1e90, 1e60, 11.0]")
    loaded = write_sweep(tmp_path, masses, case=tomli_w.dumps(PROMISED))
    inline(loaded, tmp_path / "four.h5", compute_units, task_size=4)
    inline(loaded, tmp_path / "one.h5", compute_units, task_size=1)
    assert (tmp_path / "four.h5").read_bytes() == (tmp_path / "one.h5").read_bytes()
    with h5py.File(tmp_path / "one.h5") as file:
        assert file["status"][[0, 3]].tolist() == [b"done", b"done"]
        assert b"crashed" not in file["status"][:].tolist()


def test_a_motion_that_overflows_takes_no_verdict_from_the_others() -> None:
    systems = [to_judge(system_of(make(PROMISED, friction__coefficient=each))) for each in (0.2, 0.3, 0.4)]
    certified = certify_together(systems)
    alone = [judged_together([system], [each])[0][0] for system, each in zip(systems, certified, strict=True)]
    assert all(alone)
    assert certified[1] is not None
    certified[1].motion.rows[-1, 0] = np.inf
    first, second, third = (known for known, _ in judged_together(systems, certified))
    assert second is None
    assert [*map(repr, (first, third))] == [*map(repr, alone[::2])]


@pytest.mark.parametrize("shoes", counts(3, 20))
def test_their_promises_are_kept(shoes: int) -> None:
    """Beside event-driven runs of random shoes whose pads open in part; a shoe that sticks has left its lane."""
    rng = np.random.default_rng(8)
    kept = 0
    systems = [
        system_of(
            make(
                PROMISED,
                shoe__mass=rng.uniform(5.0, 20.0),
                load__force=rng.uniform(500.0, 5000.0),
                friction__coefficient=rng.uniform(0.05, 0.5),
                wheel__angular_speed=rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 12.0),
                link2__angle_deg=rng.uniform(-20.0, 40.0),
            )
        )
        for _ in range(shoes)
    ]
    for system, found in zip(systems, certify_together(systems), strict=True):
        if found is not None:
            exact = solve(system, Method("event-driven", tolerance=1e-8)).rows[:, :4]
            apart = np.abs(found.motion.rows[:, :4] - exact).max(axis=0) / np.abs(exact).max(axis=0)
            assert apart.max() <= found.certificate.estimated_error <= TOLERANCE
            kept += 1
    assert kept > 0.7 * shoes
