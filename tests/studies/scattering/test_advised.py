"""Advice under scatter: all samples at once against each sample as a case of its own."""

import numpy as np
import pytest

from brakecli.analysis.stability.advice import KEYS, changed
from brakecli.case.case import Case
from brakecli.case.read import key_path, parse_case, read_text, starters
from brakecli.case.system import system_of
from brakecli.studies.runs.advise import advise
from brakecli.studies.scattering.advised import TOLERANCE, about, squealing, under_tolerance
from brakecli.studies.scattering.draw import sample_values
from brakecli.studies.scattering.eigen import answer_of
from tests.commands import ROOT
from tests.examples import SQUEAL, make

EVERY = 41  # samples between two that are asked singly, so that all of the eight sets are seen


def alone(case: Case, values: dict[str, float]) -> bool:
    """Whether a sample squeals, as a case of its own."""
    there = case
    for key, value in values.items():
        there = changed(there, key_path(key), value) or there
    growth, frequency, _ = answer_of(system_of(there), None)
    return growth > 0.0 and frequency > 0.0


@pytest.mark.parametrize("name", ["case", "pad", "branch", "rough"])
def test_brakes_about_a_drawing_squeal_as_each_of_them_does(name: str) -> None:
    case = parse_case(starters()[name], name, ["friction.coefficient=0.58"]).case
    study = about(case)
    values = sample_values(study)
    hits = squealing(case)
    assert hits is not None
    assert hits.shape == values.shape[:2]
    names = [each.paths[0] for each in study.parameter]
    assert names == ["link1.stiffness", "link2.stiffness", "contact.stiffness", "friction.coefficient"]
    rows = values.reshape(-1, len(names))
    single = [alone(case, dict(zip(names, row, strict=True))) for row in rows[::EVERY].tolist()]
    assert single == hits.ravel()[::EVERY].tolist()


def test_the_samples_fill_a_tenth_about_the_values_of_the_drawing() -> None:
    case = make(SQUEAL)
    values = sample_values(about(case)).reshape(-1, 4)
    own = np.array([1e7, 1.2e7, 2e7, case.friction.coefficient])
    part = values / own - 1.0
    assert np.abs(part).max() <= 0.01 * TOLERANCE
    assert np.ptp(part, axis=0) == pytest.approx(0.02 * TOLERANCE, rel=0.02)  # 128 layers in each set
    assert np.abs(part.mean(axis=0)).max() < 1e-3


def test_advice_keeps_its_order_and_says_what_squeals_on_the_drawing_and_after_each_change() -> None:
    loaded = parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml")), ["solver.duration=0.1"])
    plain = advise(loaded, KEYS, 0.2, lambda what, done, total: None)
    report = under_tolerance(plain, loaded.case)
    assert [each.parameter for each in report.advice] == [each.parameter for each in plain.advice]
    assert report.squeal is not None
    assert report.squeal.squeal_probability > 0.5  # the drawing itself squeals
    for each in report.advice:
        assert (each.squeal is None) == (each.to is None)
    assert "under a scatter of ±10 % in stiffness and friction" in report.conclusion()
    assert "stable up to" not in report.conclusion()


@pytest.mark.parametrize("change", ["wheel.angular_speed=0", "load.force=-1", "link1.damping=0"])
def test_where_nothing_slides_or_no_dashpot_acts_no_probability_is_known(change: str) -> None:
    changes = [change, "link2.damping=0"] if "damping" in change else [change]
    loaded = parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml")), ["solver.duration=0.1", *changes])
    report = under_tolerance(advise(loaded, ["shoe.mass"], 0.2, lambda what, done, total: None), loaded.case)
    assert report.squeal is None
    assert "scatter" not in report.conclusion()
