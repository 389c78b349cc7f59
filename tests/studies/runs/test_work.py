"""Counts of work and memory before anything runs, against what is counted when it does."""

import tracemalloc
from typing import Any

import pytest

from brakecli.case.system import system_of
from brakecli.errors import RefusedError
from brakecli.solver.history import ROW_BYTES
from brakecli.solver.system import MOST_STEPS, System
from brakecli.studies.runs.judge import motion_of
from brakecli.studies.runs.limits import MOST_BYTES, check, refuse
from brakecli.studies.runs.work import stability_work, work_done
from tests.examples import SQUEAL, make

EXACT = {"solver__step": None, "solver__tolerance": 1e-6}
MANY = 300_000


def test_stability_works_on_averages_of_the_contact_only_where_the_pad_opens() -> None:
    def waved(count: int, size: float, longest: float = 0.0025) -> System:
        lengths = [longest] + [0.0025] * (count - 1)
        waves: dict[str, Any] = {"amplitudes": [size / count] * count, "wavelengths": lengths}
        return system_of(make(SQUEAL | {"roughness": {"wheel": waves}}))

    assert stability_work(system_of(make(SQUEAL))) == stability_work(waved(10, 1e-9)) == 0.0
    few, many = (stability_work(waved(count, 1e-3)) for count in (10, 50))
    assert 0.0 < many < few  # places that are near each other have a window
    few, many = (stability_work(waved(count, 1e-3, 20.0)) for count in (10, 100))
    assert many > 5.0 * few > 0.0


@pytest.mark.parametrize("scheme", ["piecewise-exact", "event-driven", "two-layer"])
def test_the_memory_of_histories_that_are_compared_is_counted(scheme: str) -> None:
    fine = {"solver__duration": 1e-7 * MANY, "output__sample_interval": 1e-7}
    system = system_of(make(SQUEAL, **EXACT, **fine, solver__scheme=scheme))
    tracemalloc.start()
    motion_of(system)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 * most < check(system).memory - 2e8 < 2.0 * most


def test_the_steps_of_a_run_with_a_step_are_those_that_it_takes() -> None:
    system = system_of(make(SQUEAL, solver__duration=0.01))
    assert check(system).steps == motion_of(system)[0].work.steps


def test_the_work_of_a_run_that_was_made_follows_its_steps_and_its_open_contact() -> None:
    """A contact in closed form adds none; on nodes, each evaluation adds as much as it has nodes."""

    def done(duration: float, **more: Any) -> float:
        motion = motion_of(system_of(make(SQUEAL, solver__duration=duration, **more)))[0]
        return work_done(motion.system, motion.work)

    closed = done(0.01, contact__evaluator="closed-form")
    assert done(0.02, contact__evaluator="closed-form") == pytest.approx(2.0 * closed, rel=1e-12)
    few, many = (done(0.01, contact__evaluator="cells", contact__nodes=nodes) for nodes in (64, 128))
    assert many - closed == pytest.approx(2.0 * (few - closed), rel=1e-12)
    assert few > closed


@pytest.mark.parametrize(
    ("duration", "step", "interval", "what"),
    [
        (2.0 * MOST_STEPS * 1e-6, 1e-6, 1e3, "the run is too long: about 2e"),
        (2.0 * MOST_BYTES / ROW_BYTES * 1e-4, 1e-4, 1e-4, "the file would be too large"),
    ],
)
def test_a_run_is_refused_by_its_steps_and_by_the_bytes_of_its_file(
    duration: float, step: float, interval: float, what: str
) -> None:
    case = make(SQUEAL, solver__duration=duration, solver__step=step, output__sample_interval=interval)
    with pytest.raises(RefusedError, match=what):
        refuse(check(system_of(case)))
