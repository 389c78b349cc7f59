"""Advice under scatter: all samples at once against each sample as a case of its own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from brakecli.analysis.probability import Probability, surely_fewer
from brakecli.analysis.stability.advice import KEYS, Change, Left, changed
from brakecli.case.case import Case
from brakecli.case.read import key_path, parse_case, read_text, starters
from brakecli.case.system import system_of
from brakecli.studies.runs.advise import AdviceReport, advise, part_of
from brakecli.studies.scattering.advised import TOLERANCE, about, judged, squealing, under_tolerance
from brakecli.studies.scattering.draw import sample_values
from brakecli.studies.scattering.eigen import answer_of
from brakecli.views.render import TERMINAL
from brakecli.views.stability import of_advice
from brakecli.views.terminal import terminal_text
from tests.commands import ROOT
from tests.examples import SQUEAL, make

WEAK = """\
shoe.mass = 0.6
link1 = { stiffness = 1.44e8, damping = 143.0 }
link2 = { stiffness = 1.587e8, damping = 158.0, angle_deg = 2.34 }
contact = { half_length = 0.04, stiffness = 3e8 }
wheel = { radius = 0.3, angular_speed = 20.0 }
solver.duration = 0.01
load.force = 9000.0
friction.coefficient = 0.45
"""
EVERY = 41  # samples between two that are asked singly, so that all of the eight sets are seen


def quiet(what: str, done: int, total: int) -> None:
    """Progress that nobody sees."""


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


def shares_left(change: Change) -> float:
    """The share that squeals after a change."""
    assert change.squeal is not None
    return change.squeal.squeal_probability


def test_the_short_table_has_the_smallest_change_and_what_leaves_least_squeal() -> None:
    loaded = parse_case(WEAK, "weak")
    report = under_tolerance(advise(loaded, KEYS, 0.2, quiet), loaded.case)
    by_share = sorted((each for each in report.advice if each.squeal), key=shares_left)
    assert report.advice[0].parameter != by_share[0].parameter  # else nothing is to be seen below
    mildest = next(each for each in report.advice if each.parameter == report.mildest)
    drawn = report.squeal
    assert drawn is not None
    assert drawn.squeal_probability > 2.0 * shares_left(mildest)
    assert shares_left(mildest) < shares_left(by_share[0]) + 0.01
    short = " ".join(terminal_text(of_advice(report, TERMINAL)).split())
    assert f"smallest ratio (or rad) first (2 of {len(by_share)}; all: --details):" in short
    rows = short.partition("squeals")[2]
    assert rows.index(report.advice[0].parameter) < rows.index(mildest.parameter)
    assert f"{mildest.parameter} → {mildest.rounded} leaves least" in report.conclusion


def test_a_drawing_that_does_not_squeal_is_told_from_brakes_that_do() -> None:
    loaded = parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml")), ["friction.coefficient=0.56"])
    report = under_tolerance(advise(loaded, ["link2.damping"], 0.2, quiet), loaded.case)
    part = f"{100.0 * report.squeal.squeal_probability:.2g}" if report.squeal else ""
    words = f"under a scatter of ±10 % in stiffness and friction {part} % of brakes built to this drawing"
    assert "as drawn it does not squeal by itself" in report.conclusion
    assert f"but {words} squeal" in report.conclusion
    shown = part_of(Left(0.0, 0.0, 0.00374))  # as of 1024 samples: Wilson's z²/(1024 + z²)
    assert shown == "at most 0.37 %"
    assert part_of(Left(0.0029, 0.0, 0.006)) == "0.29 % (95 %: 0 to 0.6 %)"
    assert part_of(Left(0.42, 0.41, 0.43)) == "42 %"


@pytest.mark.parametrize("sets", [1, 8])
def test_shares_of_the_same_samples_are_told_apart_where_their_own_intervals_meet(sets: int) -> None:
    """Of 1024 brakes 400 squeal. 20 squeal no more, and none begins: t is 4.5. Of 20 each way t is 0."""
    rng = np.random.default_rng(7)
    drawn = np.zeros(1024, np.bool_)
    drawn[rng.permutation(1024)[:400]] = True
    ended = rng.permutation(np.flatnonzero(drawn))[:20]
    begun = rng.permutation(np.flatnonzero(~drawn))[:20]
    fewer = drawn.copy()
    fewer[ended] = False
    others = fewer.copy()
    others[begun] = True
    was, less, same = (each.reshape(sets, -1) for each in (drawn, fewer, others))
    assert Probability.of(less).upper > Probability.of(was).lower
    assert surely_fewer(less, was)
    assert not surely_fewer(was, less)
    assert not surely_fewer(same, was)
    assert not surely_fewer(was, was)


def test_what_the_samples_do_not_tell_apart_stays_in_its_order_and_what_is_in_vain_is_said() -> None:
    loaded = parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml")), ["solver.duration=0.1"])
    plain = advise(loaded, ["link*.damping", "shoe.mass"], 0.2, quiet)
    drawn = (np.arange(1024) % 2 == 0).reshape(8, 128)
    fewest = drawn & (np.arange(1024) % 16 != 0).reshape(8, 128)

    def left(unstable: NDArray[np.bool_]) -> Left:
        return Left(*Probability.of(unstable), unstable=unstable)

    def found(*shares: NDArray[np.bool_]) -> AdviceReport:
        parts = [replace(each, squeal=left(part)) for each, part in zip(plain.advice, shares, strict=True)]
        return judged(replace(plain, advice=parts, squeal=left(drawn)))

    near = fewest.copy()
    near[0, np.flatnonzero(drawn[0])[-1]] = True
    one, two, three = (each.parameter for each in plain.advice)
    assert found(drawn, near, fewest).mildest == two  # one sample more is a tie, and its change is smaller
    assert found(drawn, near, fewest).helpful == [two, three]
    assert found(drawn, drawn, drawn).mildest is None
    assert "no change listed surely lowers how many are unstable" in found(drawn, drawn, drawn).conclusion
    assert "no change listed halves how many are unstable" in found(drawn, near, fewest).conclusion
    assert "no change listed" not in found(drawn & False, near, fewest).conclusion
    assert found(drawn & False, near, fewest).mildest == one


@pytest.mark.parametrize("change", ["wheel.angular_speed=0", "load.force=-1", "link1.damping=0"])
def test_where_nothing_slides_or_no_dashpot_acts_no_probability_is_known(change: str) -> None:
    changes = [change, "link2.damping=0"] if "damping" in change else [change]
    loaded = parse_case(*read_text(str(ROOT / "cases" / "relaxation.toml")), ["solver.duration=0.1", *changes])
    report = under_tolerance(advise(loaded, ["shoe.mass"], 0.2, lambda what, done, total: None), loaded.case)
    assert report.squeal is None
    assert "scatter" not in report.conclusion()
