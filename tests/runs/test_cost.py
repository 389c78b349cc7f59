"""What `check` says that a case costs, against what it does cost."""

import time
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import binom

from benchmarks.statistics.prices import RIGHT, SEED, priced
from brakecli.case.case import resolved_toml
from brakecli.case.read import parse_case
from brakecli.case.system import system_of
from brakecli.errors import RefusedError
from brakecli.runs import price
from brakecli.runs.cost import stability_seconds
from brakecli.runs.judge import motion_of
from brakecli.runs.limits import check, sliding_text
from brakecli.runs.price import measured
from brakecli.runs.run import load_kernels, run
from brakecli.solver.system import System
from tests.campaign import campaign
from tests.examples import ROUGH, SQUEAL, make

CASES = 20
BUSY = 20.0
"""By which times may differ that are about the same, on a machine that does something else in between."""


def test_stability_costs_averages_of_the_contact_only_where_the_pad_opens_and_is_refused_if_they_take_days(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def waved(count: int, size: float, longest: float = 0.0025) -> System:
        lengths = [longest] + [0.0025] * (count - 1)
        waves: dict[str, Any] = {"amplitudes": [size / count] * count, "wavelengths": lengths}
        return system_of(make(SQUEAL | {"roughness": {"wheel": waves}}))

    assert stability_seconds(system_of(make(SQUEAL))) == stability_seconds(waved(10, 1e-9)) == 0.0
    few, many = (stability_seconds(waved(count, 1e-3)) for count in (10, 50))
    assert 0.0 < many < few  # places that are near each other have a window
    few, many = (stability_seconds(waved(count, 1e-3, 20.0)) for count in (10, 100))
    assert many > 5.0 * few > 0.0
    assert sliding_text(waved(10, 1e-3)) is None
    monkeypatch.setattr("brakecli.runs.limits.MOST_SECONDS", few)
    with pytest.raises(RefusedError, match=r"pad that opens takes about .*; reduce contact\.nodes"):
        sliding_text(waved(100, 1e-3, 20.0))


@campaign
def test_nine_in_ten_prices_of_random_runs_are_within_a_factor_of_three() -> None:
    """The first of the cases of `make statistics`, of all kinds and methods; so few may miss by chance."""
    found = [each for number in range(CASES) if (each := priced((number, SEED)))]
    wrong = [str(each) for each in found if not each.right]
    assert len(found) > RIGHT * CASES
    assert len(wrong) <= binom.ppf(0.95, len(found), 1.0 - RIGHT), wrong


def test_a_case_that_ends_within_the_pilot_run_is_counted_and_not_guessed() -> None:
    for scheme in ("two-layer", "event-driven"):
        system = system_of(make(SQUEAL, solver__scheme=scheme, solver__duration=0.01))
        said = measured(system)
        assert said is not None
        assert (said.steps, said.at_least) == (motion_of(system)[0].work.steps, False)


def test_a_run_that_is_given_up_is_priced_by_its_progress_and_runs_that_keep_a_tolerance_at_least(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    steps = system_of(make(SQUEAL, solver__duration=10.0))
    by_runs = measured(steps)
    monkeypatch.setattr(price, "SECONDS", 0.01)
    monkeypatch.setattr(price, "FIRST", 1e3)  # the first part is the whole run
    begun = measured(steps)
    assert begun is not None
    assert by_runs is not None
    assert begun.steps == by_runs.steps == steps.steps
    assert 1.0 / BUSY < begun.seconds / by_runs.seconds < BUSY
    promise = {"solver__step": None, "solver__scheme": "two-layer", "solver__tolerance": 1e-8}
    ladder = measured(system_of(make(SQUEAL, solver__duration=1.0, **promise)))
    assert ladder is not None
    assert ladder.seconds > 0.01


EXACT = {"solver__step": None, "solver__tolerance": 1e-6}
MANY = 300_000


@pytest.mark.parametrize("changes", [EXACT, {"solver__step": 1e-8}], ids=["tolerance", "step"])
def test_many_samples_are_priced_with_their_file_and_their_verdict(
    tmp_path: Path, changes: dict[str, Any]
) -> None:
    case = make(SQUEAL, solver__duration=1e-8 * MANY, output__sample_interval=1e-8, **changes)
    loaded = parse_case(resolved_toml(case), "case")
    said = check(load_kernels(loaded), begin=True)
    begin = time.process_time()
    run(loaded, tmp_path / "r.h5", force=False)
    assert 1.0 / BUSY < said.seconds / (time.process_time() - begin) < BUSY


@pytest.mark.parametrize("scheme", ["piecewise-exact", "event-driven", "two-layer"])
def test_the_memory_of_histories_that_are_compared_is_priced(scheme: str) -> None:
    fine = {"solver__duration": 1e-7 * MANY, "output__sample_interval": 1e-7}
    system = system_of(make(SQUEAL, **EXACT, **fine, solver__scheme=scheme))
    tracemalloc.start()
    motion_of(system)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 * most < check(system).memory - 2e8 < 2.0 * most


def test_what_may_cost_more_is_said_to_cost_at_least_so_much() -> None:
    # It flies for the whole pilot run, hits the wheel at 1e10 m/s, and passes a wave in 1e-12 s from then on.
    events = {"solver__scheme": "event-driven", "contact__nodes": None, "solver__duration": 1.0}
    far = check(system_of(make(ROUGH, initial__x=2e7, **events)), begin=True)
    assert far.at_least or far.seconds > 60.0
    # A step with so many waves takes minutes, and is not tried.
    waves = {"amplitudes": [1e-6] * 2000, "wavelengths": [1e-3 + 1e-6 * i for i in range(2000)]}
    many = system_of(make({**ROUGH, "roughness": {"wheel": waves}}, **events))
    assert measured(many) is None
    assert check(many, begin=True).at_least
